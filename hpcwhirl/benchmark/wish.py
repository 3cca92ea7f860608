"""What a user wants of a campaign's numbers, and the cheapest setting that gives it.

A wish such as "radius 1 %" is met by a setting if nine in ten of the cases that were
compared have a smaller error, in the worst of their twins. Cases whose number the
reference itself does not know to half of it do not count.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from hpcwhirl.benchmark.numbers import NINE, quantile_of
from hpcwhirl.benchmark.tradeoff import Case, Row, Tradeoff
from hpcwhirl.errors import InputError, nearest, shown

Cases = Mapping[str, Case]
WORDS = "words"
# {what a user types: number in `NUMBERS`}
NAMES = {
    "radius": "orbit_radius",
    "impulse": "contact_impulse",
    "peak": "blade_peak",
    "centre": "centre_peak",
    "area": "orbit_area",
    "growth": "growth_rate",
}
SURE = 0.5  # largest scatter of the reference of a case that is judged / wish
FEWEST = 5  # cases without which a wish cannot be answered


@dataclass(frozen=True)
class Wish:
    """One wish: the largest error of a number, or the least share of words kept.

    Attributes
    ----------
    name : key of `NAMES`, or "words"
    most : largest relative error; of words the largest share of changed ones
    """

    name: str
    most: float

    def met(self, row: Row, cases: Cases) -> bool:
        """Return whether a row meets the wish.

        row, cases : what was measured of a setting, and of each case
        """
        return self.error(row, cases) <= self.most

    def error(self, row: Row, cases: Cases) -> float:
        """Return the error of a row below which nine in ten cases lie, or share lost.

        It is infinite if the cases are too few to tell. Parameters are those of `met`.
        """
        if self.name == WORDS:
            decided = row.same + row.changed
            return row.changed / decided if decided else math.inf
        errors = self.errors(row, cases)
        return quantile_of(errors, NINE).value if len(errors) >= FEWEST else math.inf

    def errors(self, row: Row, cases: Cases) -> list[float]:
        """Return the errors of a row in the cases that can be judged.

        Parameters are those of `met`.
        """
        number = NAMES[self.name]
        return [
            found[number]
            for name, found in row.of.items()
            if number in found and cases[name].scatter[number] <= SURE * self.most
        ]


def wish_of(text: str) -> Wish:
    """Return the wish that a text such as "radius 1 %" or "words 95 %" states.

    Raises
    ------
    InputError
        for an unknown number, or a share that is not between 0 and 100 %
    """
    name, _, rest = text.strip().partition(" ")
    allowed = [*NAMES, WORDS]
    if name not in allowed:
        hint = nearest(name, allowed)
        msg = f"--for must begin with one of {', '.join(allowed)}, got {shown(text)}"
        raise InputError(msg + hint)
    share = _share(rest)
    if share is None or not 0.0 < share <= 1.0:
        msg = f"--for must be a name and a share from 0 to 100 %, such as '{name} 1 %'"
        raise InputError(f"{msg}, got {shown(text)}")
    return Wish(name, 1.0 - share if name == WORDS else share)


def _share(text: str) -> float | None:
    number, per_cent, after = text.partition("%")
    try:
        value = float(number)
    except ValueError:
        return None
    return None if after.strip() else value / (100.0 if per_cent else 1.0)


def cheapest(found: Tradeoff, wishes: Sequence[Wish]) -> Row | None:
    """Return the row of least cost that meets all wishes and can be typed, or None."""
    rows = [row for row in found.rows if _can(row)]
    good = [row for row in rows if all(w.met(row, found.cases) for w in wishes)]
    return min(good, key=lambda row: row.cost, default=None)


def _can(row: Row) -> bool:
    return not (row.refused or row.unstable) and row.axis not in ("duration", "output")


def nearest_to(found: Tradeoff, wishes: Sequence[Wish]) -> Row:
    """Return the row that misses the wishes by the smallest factor."""
    rows = [row for row in found.rows if _can(row)]

    def missed(row: Row) -> float:
        return max(w.error(row, found.cases) / max(w.most, 1e-9) for w in wishes)

    return min(rows, key=missed)
