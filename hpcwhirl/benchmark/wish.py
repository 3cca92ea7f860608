"""What a user wants of a campaign's numbers, and the cheapest setting that gives it.

A wish such as "radius 1 %" is that nine in ten cases of the campaign have a smaller
error, in the worst of their twins. Of cases that were drawn, some miss it by chance, or
meet it by chance; and of many settings that are compared, the cheapest one that seems
to meet it is likely to be one of the lucky ones. So a setting meets a wish only if so
many cases did that `SURE` of all draws would have had fewer if it did not. Cases whose
number the reference itself does not know to half of the wish do not count.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from scipy import stats

from hpcwhirl.benchmark.numbers import NINE, quantile_of
from hpcwhirl.benchmark.tradeoff import Case, Measurement, Row, Tradeoff
from hpcwhirl.errors import InputError, nearest, shown
from hpcwhirl.scene import Scene

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
KNOWN = 0.5  # largest scatter of the reference of a case that is judged / wish
SURE = 0.8  # least confidence with which a setting meets a wish
ROUNDING = 1e-9  # of a number of cases
BATCH = 8  # cases that are integrated before each decision


@dataclass(frozen=True)
class Support:
    """How many drawn cases meet a wish with a setting.

    Attributes
    ----------
    met, of : cases that meet it, and cases that can be judged
    level : share of all cases that must meet it
    all : number of cases from which these were drawn
    """

    met: int
    of: int
    level: float
    all: int

    @property
    def confidence(self) -> float:
        """With which the share of all cases is `level` or more.

        It is the probability that more of the drawn cases had missed the wish if just
        one case too many of all did: the exact test for draws without replacement.
        """
        if not self.of:
            return 0.0
        missing = math.floor((1.0 - self.level) * self.all + ROUNDING) + 1
        missed = stats.hypergeom(self.all, min(missing, self.all), self.of)
        return float(missed.sf(self.of - self.met))

    @property
    def sure(self) -> bool:
        """Whether the confidence is `SURE` or more."""
        return self.confidence >= SURE

    def with_more(self, cases: int) -> Support:
        """Return the support if so many further cases all met the wish."""
        met, of = self.met + cases, self.of + cases
        return Support(met, of, self.level, max(self.all, of))


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

    @property
    def level(self) -> float:
        """The share of all cases that must meet it."""
        return 1.0 - self.most if self.name == WORDS else NINE

    def support(self, row: Row, found: Tradeoff) -> Support:
        """Return how many cases meet the wish with a setting.

        row, found : the setting's row, and what it is a row of
        """
        if self.name == WORDS:
            met, of = row.same, row.same + row.changed
        else:
            errors = self.errors(row, found.cases)
            met, of = sum(e <= self.most for e in errors), len(errors)
        judged = of / max(len(found.cases), 1)
        return Support(met, of, self.level, max(round(judged * found.total), of))

    def error(self, row: Row, cases: Cases) -> float:
        """Return the error of a row below which nine in ten cases lie, or share lost.

        It is infinite if no case can be judged.

        row, cases : the setting's row; each case
        """
        if self.name == WORDS:
            decided = row.same + row.changed
            return row.changed / decided if decided else math.inf
        errors = self.errors(row, cases)
        return quantile_of(errors, NINE).value if errors else math.inf

    def errors(self, row: Row, cases: Cases) -> list[float]:
        """Return the errors of a row in the cases that can be judged.

        Parameters are those of `error`.
        """
        number = NAMES[self.name]
        return [
            found[number]
            for name, found in row.of.items()
            if number in found and cases[name].scatter[number] <= KNOWN * self.most
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
    good = [row for row in found.rows if _can(row) and _sure(found, wishes, row)]
    return min(good, key=lambda row: row.cost, default=None)


def search(
    measurement: Measurement, scenes: Mapping[str, Scene], wishes: Sequence[Wish]
) -> Tradeoff:
    """Integrate cases until it is settled which setting is the cheapest.

    They are integrated `BATCH` at a time, in their order, with all settings.

    measurement, scenes : that gets the cases; all cases that may be integrated
    """
    left = list(scenes)
    while True:
        batch, left = left[:BATCH], left[BATCH:]
        found = measurement.add({name: scenes[name] for name in batch}).found()
        if not left or is_settled(found, wishes, len(left)):
            return found


def fewest(level: float, total: int) -> int:
    """Return how many cases, that all meet a wish, make a setting sure.

    level, total : share of all cases that must meet it; number of all cases
    """
    counts = range(1, total + 1)
    return next((n for n in counts if Support(n, n, level, total).sure), total)


def is_settled(found: Tradeoff, wishes: Sequence[Wish], more: int) -> bool:
    """Return whether further cases could not change which setting is the cheapest.

    They could if with a cheaper setting than that, or any if there is none, all of them
    might meet the wishes, and it would meet them then.

    more : number of further cases
    """
    best = cheapest(found, wishes)
    return not any(
        all(w.support(row, found).with_more(more).sure for w in wishes)
        for row in found.rows
        if _can(row) and (best is None or row.cost < best.cost)
    )


def _sure(found: Tradeoff, wishes: Sequence[Wish], row: Row) -> bool:
    return all(wish.support(row, found).sure for wish in wishes)


def _can(row: Row) -> bool:
    return not (row.refused or row.unstable) and row.axis not in ("duration", "output")


def nearest_to(found: Tradeoff, wishes: Sequence[Wish]) -> Row:
    """Return the row that misses the wishes by the smallest factor."""
    rows = [row for row in found.rows if _can(row)]

    def missed(row: Row) -> float:
        return max(w.error(row, found.cases) / max(w.most, 1e-9) for w in wishes)

    return min(rows, key=missed)
