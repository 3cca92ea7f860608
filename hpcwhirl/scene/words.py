"""Every word that a case may be given: how it is stored, ruled, coloured; one table.

A new word is a line here and its rules. Results keep a word as its place in `ENUMS`
(see `flag_meanings`), so new ones come last. The rules are conditions of
`analysis.expression` over evidence (`analysis.regimes.evidence`), thresholds
(`analysis.regimes.Thresholds`) and, before both, what `DEFINED` makes of them; the page
reads them, too.

Lightness falls from `missing` to `failed` in steps of at least 11 (CIE L*), so that
print in grey keeps the words apart, and no two colours come close to the colour-blind;
`tests/test_palette.py` measures both. A letter says the same without colour.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Look:
    """How a word is shown.

    Attributes
    ----------
    colour : fill, sRGB
    ink : of a letter or marker on that fill
    letter : that stands for the word
    marker : of a point, as Matplotlib names it
    told : the word in a legend
    line : colour of thin lines and dots on white, where the fill is too light for them
    """

    colour: str
    ink: str
    letter: str
    marker: str
    told: str
    line: str = ""

    @property
    def stroke(self) -> str:
        """Colour of thin lines and dots on white."""
        return self.line or self.colour


@dataclass(frozen=True)
class Rule:
    """A word, and the conditions that must all hold for it."""

    word: str
    needs: tuple[str, ...] = ()


REGIMES = {
    "damped": Look("#7DB8DF", "#000000", "d", "o", "damped", "#3F86B5"),
    "sustained": Look("#F2DC3A", "#000000", "S", "s", "sustained", "#A88F00"),
    "divergent": Look("#C63D0F", "#FFFFFF", "X", "^", "divergent"),
    "undecided": Look("#8D8D8D", "#000000", "?", "D", "undecided"),
}
BAD = {  # cases whose numbers mean nothing
    "unstable": Look("#57267A", "#FFFFFF", "U", "P", "unstable"),
    "failed": Look("#0C0C0C", "#FFFFFF", "!", "X", "failed"),
    "missing": Look("#FFFFFF", "#000000", "·", ".", "not computed", "#BBBBBB"),
}
SHOWN = REGIMES | BAD  # what a case may be shown by
WHIRLS = {  # where the colour tells the whirl
    "forward": Look("#2F6DB3", "#FFFFFF", "F", "^", "forward"),
    "mixed": Look("#4BA386", "#000000", "M", "o", "mixed"),
    "backward": Look("#F0AE45", "#000000", "B", "v", "backward"),
    "none": Look("#DBD9DD", "#000000", "–", ".", "no whirl"),
}
# {variable: its words}, each stored as its place here
ENUMS = {
    "status": ("ok", "failed", "missing", "timeout", "crashed"),
    "outcome": ("none", "completed", "stopped", "unstable"),
    "regime": ("none", *REGIMES),
    "whirl": ("none", "forward", "backward", "mixed"),
    "stop": ("none", "end", "amplitude", "nonfinite", "complementarity", "certain"),
}


OPEN = {"regime": "undecided", "stop": "end"}


def word_of(status: str, outcome: str, regime: str) -> str:
    """Return the word of `SHOWN` that a case goes by, wherever it is shown or counted.

    Its regime; where it has none, whether it is `unstable`, `failed` for whatever
    reason, or `missing`.
    """
    if status != "ok":
        return status if status == "missing" else "failed"
    return "unstable" if outcome == "unstable" or regime == "none" else regime


def is_open(row: Mapping[str, Any]) -> bool:
    """Return whether a longer run may tell what a row of `undecided` does not."""
    return all(row.get(name) == word for name, word in OPEN.items())


# In this order: a later one may use an earlier one. A centre that does not move has no
# growth: where all sectors move alike, round-off is all that moves it.
DEFINED = {
    "begin": "end_time - window",
    "clear": "abs(growth_rate) > significance * growth_error",
    "growth_shaft": "growth_centre * (orbit_radius >= whirl_floor * gap_scale)",
    "rise_of_both": "min(growth_rate, growth_rotor) * window",
    "largest_change": "max(max(abs(growth_rate), abs(growth_rotor)),"
    " abs(growth_shaft)) * window",
}
KEPT_UP = (
    "late_lost >= turnover * late_energy",
    "late_fed >= replaced * late_lost",
    "late_lost >= replaced * late_fed",
)
# Of each list the first rule counts whose conditions all hold.
RULES = {
    # Unstable: not finite, no solution of the contact problem, a ledger that does not
    # close or an energy below zero, which a stable scheme does not have, gaps that are
    # not those of the bodies, a step at or above the limit. No regime, no whirl then.
    "outcome": (
        Rule("unstable", ("stop == 'nonfinite'",)),
        Rule("unstable", ("stop == 'complementarity'",)),
        Rule("unstable", ("ledger_error > ledger",)),
        Rule("unstable", ("gap_error > opening",)),
        Rule("unstable", ("step_share >= 1",)),
        Rule("stopped", ("stop == 'amplitude'",)),
        Rule("completed"),
    ),
    "regime": (
        # what is loaded by the pulse within the window
        Rule("undecided", ("begin < load_end",)),
        # no contact can recur; or at rest
        Rule("damped", ("certificate >= 0",)),
        Rule("damped", ("late_energy == 0",)),
        # no contact, the energy falling significantly and every part falling
        Rule(
            "damped",
            (
                "late_contacts == 0",
                "clear",
                "growth_rate < 0",
                "growth_rotor <= 0",
                "growth_casing <= 0",
                "growth_shaft <= 0",
            ),
        ),
        Rule("undecided", ("late_contacts == 0",)),
        # fed by rotation and friction, and beyond the amplitude limit or grown, still
        # so in the last quarter, the rotor too, to the highest of the run
        Rule("divergent", ("stop == 'amplitude'", "late_fed > 0")),
        Rule(
            "divergent",
            (
                "clear",
                "rise_of_both > rise",
                "growth_last >= onward * growth_rate",
                "summit > above",
                "late_fed > 0",
            ),
        ),
        # fed by contact what is lost, the energy turned over, and no change
        Rule("sustained", ("clear", "largest_change <= drift", *KEPT_UP)),
        Rule("sustained", ("not clear", "largest_change <= unclear", *KEPT_UP)),
        # anything else, such as falling while still touching
        Rule("undecided"),
    ),
    # not by the signed area, which weighs each line's power with its frequency: a small
    # fast line would outweigh a large slow one that turns the other way
    "whirl": (
        Rule("none", ("orbit_radius < whirl_floor * gap_scale",)),
        Rule("forward", ("whirl_ratio > direction",)),
        Rule("backward", ("whirl_ratio < -direction",)),
        Rule("mixed"),
    ),
}
