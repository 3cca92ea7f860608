"""Table of all words that a case may get: how they are stored, decided and coloured.

To add a word, add a line and its rules here. Results store a word as its index in
`ENUMS` (attribute `flag_meanings`), so new ones come last. The rules are conditions
(`analysis.expression`) on evidence (`analysis.regimes.evidence`), thresholds
(`analysis.regimes.Thresholds`) and quantities derived from both, see `DEFINED`; the
HTML page evaluates them, too.

Lightness decreases from `missing` to `failed` in steps of at least 11 (CIE L*), so that
words differ in grey print, and all colours differ for the colour-blind;
`tests/scene/test_palette.py` measures both. A letter identifies a word without colour.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Look:
    """How a word of cases, such as "damped", is shown in maps and on the page.

    Attributes
    ----------
    colour : colour of the fill, sRGB
    ink : colour of a letter or marker on that fill
    letter : letter that stands for the word
    marker : Matplotlib's marker of a point
    told : text that legends show for the word
    line : colour of thin lines and dots on white, if the fill is too light; "" if not
    """

    colour: str
    ink: str
    letter: str
    marker: str
    told: str
    line: str = ""

    @property
    def stroke(self) -> str:
        """Colour in which thin lines and dots of the word are drawn on white."""
        return self.line or self.colour


@dataclass(frozen=True)
class Rule:
    """A word for a case, such as "damped", and conditions that must all hold for it.

    A condition is an expression on evidence and thresholds, as "stop == 'amplitude'".
    """

    word: str
    needs: tuple[str, ...] = ()


REGIMES = {
    "damped": Look("#7DB8DF", "#000000", "d", "o", "damped", "#3F86B5"),
    "sustained": Look("#F2DC3A", "#000000", "S", "s", "sustained", "#A88F00"),
    "divergent": Look("#C63D0F", "#FFFFFF", "X", "^", "divergent"),
    "undecided": Look("#8D8D8D", "#000000", "?", "D", "undecided"),
}
BAD = {  # cases without a regime
    "overloaded": Look("#092644", "#FFFFFF", "L", "*", "overloaded"),
    "unstable": Look("#57267A", "#FFFFFF", "U", "P", "unstable"),
    "failed": Look("#0C0C0C", "#FFFFFF", "!", "X", "failed"),
    "missing": Look("#FFFFFF", "#000000", "·", ".", "not computed", "#BBBBBB"),
}
SHOWN = REGIMES | BAD  # all words that may stand for a case
# Words of which shares are given. An overloaded run has an end, too, and is no rare
# accident: leaving it out would leave out the strongest starts.
COUNTED = REGIMES | {"overloaded": BAD["overloaded"]}
WHIRLS = {  # words of maps coloured by whirl
    "forward": Look("#2F6DB3", "#FFFFFF", "F", "^", "forward"),
    "mixed": Look("#4BA386", "#000000", "M", "o", "mixed"),
    "backward": Look("#F0AE45", "#000000", "B", "v", "backward"),
    "none": Look("#DBD9DD", "#000000", "–", ".", "no whirl"),
}
MOTIONS = {  # words of sustained motions if output.chaos > 0
    "periodic": Look("#2F6DB3", "#FFFFFF", "P", "s", "periodic"),
    "quasi-periodic": Look("#4BA386", "#000000", "Q", "o", "quasi-periodic"),
    "chaotic": Look("#F0AE45", "#000000", "C", "^", "chaotic"),
    "untold": Look("#8D8D8D", "#000000", "?", "D", "not determined"),
    "none": Look("#DBD9DD", "#000000", "–", ".", "not sustained"),
}
# {variable: its words}; a word is stored as its index
ENUMS = {
    "status": ("ok", "failed", "missing", "timeout", "crashed"),
    "outcome": ("none", "completed", "stopped", "unstable", "overloaded"),
    "regime": ("none", *REGIMES),
    "whirl": ("none", "forward", "backward", "mixed"),
    "motion": ("none", "periodic", "quasi-periodic", "chaotic", "untold"),
    "coarse_regime": ("none", *REGIMES, "overloaded", "unstable"),
    "word_majority": ("none", "unstable", *REGIMES, "overloaded"),
    "stop": ("none", "end", "amplitude", "nonfinite", "complementarity", "certain"),
}


NO_REGIME = ("unstable", "overloaded")  # outcomes of cases without a regime
NO_END = ("undecided", *BAD)  # words of cases of which nobody knows where they end
OPEN = ("undecided", "divergent")  # regimes that may change in a longer run: is_open
BY_PULSE = (  # message for an overloaded case
    "the pulse itself, not growth, moved the tips to the amplitude limit; lower force "
    "or pulse, or raise amplitude_limit"
)
BY_SPEED = (  # the same, if not the pulse did that
    "the changing speed itself, not growth, moved the tips to the amplitude limit; "
    "lower its rate or the unbalance, or raise amplitude_limit"
)
GROWS = "free motion grows by {:.3g} 1/s, without contact"
UNDISTURBED = "; nothing has disturbed the rotor from its motion at rest or on a circle"
SLIDES_BACK = (  # format string for the largest slip over that of rotation
    "slip_ratio is {:.3g}: a tip in contact may have slid back, while friction here "
    "always drags against the rotation: slip = 'set-valued' lets tips stick and slide "
    "back"
)
BEYOND_FILM = (  # message for a case that still has a word
    "the centre moved farther than film_clearance, where the housing would stop it"
)


def word_of(status: str, outcome: str, regime: str) -> str:
    """Return the word of `SHOWN` that stands for a case in maps, tables and counts.

    The word is the regime; a case without a regime is `overloaded`, `unstable`,
    `failed` (for any reason) or `missing`.
    """
    if status != "ok":
        return status if status == "missing" else "failed"
    if outcome in NO_REGIME:
        return outcome
    return "unstable" if regime == "none" else regime


def is_open(row: Mapping[str, Any]) -> bool:
    """Return whether a longer run may change the regime of a case.

    True if the case is undecided, or divergent by growth alone, and ran to its end: a
    case that ended at the amplitude limit cannot continue.

    row : results of the case by name
    """
    return row.get("regime") in OPEN and row.get("stop") == "end"


# Quantities derived from evidence and thresholds, evaluated in this order: a later one
# may use an earlier one. The growth of a centre at rest is set to 0: if all sectors
# move alike, only round-off moves it.
DEFINED = {
    "begin": "end_time - window",
    "clear": "abs(growth_rate) > significance * growth_error",
    "growth_shaft": "growth_centre * (orbit_radius >= whirl_floor * gap_scale)",
    "rise_of_both": "min(growth_rate, growth_rotor) * window",
    "fed_less": "ledger_rotation + ledger_friction + max(-ledger_damping, 0)"
    " <= ledger_pulse + driven_energy",
    "carried": "fed_less or (begin < load_end and rise_of_both <= rise)",
    "steady_rub": "growth_casing != 0"
    " and max(abs(growth_casing), abs(growth_shaft)) * window <= drift",
    "largest_change": "max(max(abs(growth_rate), abs(growth_rotor)),"
    " abs(growth_shaft)) * window",
}
KEPT_UP = (
    "late_lost >= turnover * late_energy",
    "late_fed >= replaced * late_lost",
    "late_lost >= replaced * late_fed",
)
# In each list the first rule whose conditions all hold gives the word.
# fmt: off
RULES = {
    # Unstable: numbers not finite, no solution of the contact problem, a ledger that
    # does not close or an energy below zero, which a stable scheme does not have, gaps
    # that are not those of the bodies, a step at or above the limit. Such a case has no
    # regime and no whirl, nor has an overloaded one.
    "outcome": (
        Rule("unstable", ("stop == 'nonfinite'",)),
        Rule("unstable", ("stop == 'complementarity'",)),
        Rule("unstable", ("ledger_error > ledger",)),
        Rule("unstable", ("gap_error > opening",)),
        Rule("unstable", ("step_share >= 1",)),
        # the load carried the tips to the amplitude limit: pulse, changing speed and
        # unbalance put in more energy than rotation, friction and supports, or the
        # pulse acts within the window, in which nothing grows
        Rule("overloaded", ("stop == 'amplitude'", "carried")),
        Rule("stopped", ("stop == 'amplitude'",)),
        Rule("completed"),
    ),
    "regime": (
        # rotation, friction, supports carried the tips to the amplitude limit, no load
        Rule("divergent", ("stop == 'amplitude'",)),
        # no contact can recur, whatever load is still to come
        Rule("damped", ("certificate >= 0", "free_growth <= 0")),
        # a load still acts within the window, or is still to come
        Rule("undecided", ("begin < load_end",)),
        # at rest, where no free motion of the engine grows
        Rule("damped", ("late_energy == 0", "free_growth <= 0")),
        # no contact, no free motion grows; the energy falls significantly, and that of
        # no part grows
        Rule("damped", (
            "late_contacts == 0", "free_growth <= 0", "clear", "growth_rate < 0",
            "growth_rotor <= 0", "growth_casing <= 0", "growth_shaft <= 0")),
        Rule("undecided", ("late_contacts == 0",)),
        # rotation and friction feed energy; total and rotor have grown to the highest
        # of the run, not slower in the last quarter; casing or shaft change, as contact
        # that grows moves them
        Rule("divergent", (
            "clear", "rise_of_both > rise", "growth_last >= onward * growth_rate",
            "summit > above", "late_fed > 0", "not steady_rub")),
        # contact feeds as much energy as is lost, more than the motion has is lost, and
        # amplitudes hardly change
        Rule("sustained", ("clear", "largest_change <= drift", *KEPT_UP)),
        Rule("sustained", ("not clear", "largest_change <= unclear", *KEPT_UP)),
        # the same for casing and shaft, which only contact moves steadily, while waves
        # of the blades vary slowly: with rotation, often for longer than the window
        Rule("sustained", ("steady_rub", "rise_of_both <= rise", *KEPT_UP)),
        # anything else, such as decaying while still touching
        Rule("undecided"),
    ),
    # by power, not by the signed area, which weights each line's power with its
    # frequency: a small fast line would outweigh a large slow one of opposite sense
    "whirl": (
        Rule("none", ("orbit_radius < whirl_floor * gap_scale",)),
        # too few samples for a spectrum, see `analysis.whirl.FEWEST`
        Rule("none", ("whirl_ratio == 0", "line_frequency == 0")),
        Rule("forward", ("whirl_ratio > direction",)),
        Rule("backward", ("whirl_ratio < -direction",)),
        Rule("mixed"),
    ),
}
# Not so if measured over too short a time, or if the measurement ended at a limit: one
# of both is then missing, and the motion untold.
IS_MEASURED = ("exponent_error >= 0", "zero_one <= 1")
# Rules for `motion`, if output.chaos > 0; `turn` is the time of a revolution, s.
MOTION_RULES = (
    Rule("none", ("regime != 'sustained'",)),
    # neighbouring motions diverge, far beyond doubt
    Rule("chaotic", (*IS_MEASURED, "(exponent - exponent_error) * turn > strong")),
    # neighbouring motions diverge: the exponent is above zero with its interval, and
    # the walk of the 0-1 test diffuses
    Rule("chaotic", (
        *IS_MEASURED, "exponent - exponent_error > 0",
        "(exponent - exponent_error) * turn > calm", "zero_one > diffuse")),
    # neighbouring motions stay together, and the section is a few points
    Rule("periodic", (
        *IS_MEASURED, "return_distance <= returns", "exponent * turn <= calm")),
    # they stay together, and the section is a curve, along which they neither approach
    # nor part: the exponent may be zero
    Rule("quasi-periodic", (
        *IS_MEASURED, "zero_one < bounded", "exponent * turn <= calm",
        "exponent + exponent_error >= 0",
        "exponent_error * turn <= sharp")),
    Rule("untold"),
)
