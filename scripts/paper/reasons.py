"""Why a statement of the paper does not agree, beside it; the statement stays as it is.

Each reason says what was seen, and where; it is shown only where the verdict is another
than `agrees`.
"""

from __future__ import annotations

from dataclasses import replace

from paper.text import VERDICTS, Statement

STILL = (
    "nothing diverges on mostly_damped: with contacts held closed its roots decay at "
    "270 and 430 rad/s, those of four_motions grow (`scripts/identify/linear.py`)"
)
REASONS = {
    "2F, k = 1, read off spectra": (
        "250 Hz is read off a spectrum; the sections are fitted to the frequencies "
        "that are printed (`scripts/identify/rotor.py`)"
    ),
    "first five families within 0.75 % at η = 110": (
        "this pair alone is further off; the paper does not print its sections"
    ),
    "k = 1: only damped motion": (
        "about 200 rad/s the ring and the suspension whirl backward by friction, as at "
        "270 rad/s on Table 2; undecided: blades still touch after 20 revolutions"
    ),
    "centre: line of the suspension at 105 Hz": (
        "damped by 0.2, the suspension has no line left: the place is that of a slope"
    ),
    "the centre's strongest line is the suspension": (
        "it is 1F's, k = 1, at 41 Hz: the suspension decays faster (its ξω is 45 times "
        "that of 1F on mostly_damped, 8 times on four_motions), and the spectrum "
        "begins after revolution 5"
    ),
    "sustained: forward and backward both occur": (
        "sustained backward motion needs other damping (`steady_beside`, 280 rad/s) or "
        "more friction (mostly_damped at 0.2, 140 to 240 rad/s)"
    ),
    "520 rad/s: k = 0 of 1F governs before 0.5 s": (
        "contact feeds k = 1 until it is lost (at 0.24 s on four_motions)"
    ),
    "410 rad/s: all other k damp out (to a tenth of k = 1)": (
        "the orbit, 1.28 gaps wide, strikes harder than that of mostly_damped, 0.54 "
        "wide"
    ),
    "410 rad/s: k = 0 dominant in the transient (0.1 s)": (
        "k = 1, fed by contact, has passed it by then"
    ),
    "420 rad/s: k = 1 of 1F dominant": (
        "taken before the amplitude limit, at 41 gaps, where blades that rub together "
        "are bent one way: k = 0"
    ),
    "k = 1 of 1F dominant in every regime's steady part": (
        "on four_motions not where motion grew to the amplitude limit (see 420 rad/s), "
        "on mostly_damped not in a damped motion's rest"
    ),
    **dict.fromkeys(
        (
            "three regimes: damped, sustained, divergent",
            "divergent: forward and backward both occur",
            "270 rad/s: divergent",
            "270 rad/s: backward (static frame)",
            "420 rad/s: divergent",
            "420 rad/s: suspension mainly in the divergent part",
        ),
        STILL,
    ),
    "410 rad/s: the casing moves by microns (up to 10)": (
        "what keeps it up here is mostly the transport of contacts over the deformed "
        "ring (`scripts/identify/why.md`), which wants a ring that deforms"
    ),
    "420 rad/s: about 4 times the amplitude of 270 (3 to 5)": (
        "the ratio of growing motions is that of the moment it is taken at; on "
        "four_motions both have reached the amplitude limit before 2.5 s"
    ),
    "9th super-harmonic at 420 rad/s": (
        "the ring's support places it, and was identified by motions; Eq. 13 at 270 "
        "asks for 13.4 rad/s, this for 18.2"
    ),
}


def with_reason(statement: Statement) -> Statement:
    """Return a statement with the reason for its miss, if it is one and is known."""
    reason = REASONS.get(statement.claim)
    if statement.verdict == VERDICTS[2] or reason is None:
        return statement
    return replace(statement, computed=f"{statement.computed}. Why: {reason}")
