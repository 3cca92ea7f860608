"""What a refined campaign hands out: cases follow from words, without rounds."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Collection, Mapping, Sequence

import numpy as np

from hpcwhirl.campaign.agenda import MOST, Agenda
from hpcwhirl.campaign.plan.cost import APART, Costs, predicted
from hpcwhirl.campaign.plan.refined import RefinedDesign
from hpcwhirl.campaign.plan.stages import Ended
from hpcwhirl.refinement.growth import Address

FOLLOWING = 2  # what follows from words goes out before coarse cases: more may follow


class Wanted:
    """The cases that words ask for, by their numbers.

    Parameters
    ----------
    design : of the campaign
    ended : {digest: word of a case that has ended, None without one}
    twins : (digest of its case, number) of those that have ended
    """

    def __init__(
        self,
        design: RefinedDesign,
        ended: Mapping[str, str | None],
        twins: Collection[tuple[str, int]] = (),
    ) -> None:
        self.design, self.ended, self.twins = design, ended, twins
        self.growth = design.family.growth(design.kin.of if design.kin else "")
        self._told = 0  # of how many cases twins have been handed out

    def begin(self) -> list[int]:
        """Return all cases and twins that are wanted and have not ended."""
        left = self.growth.feed(self._word, list(self.growth.wanted))
        return [*self._left(left), *self._fresh_twins()]

    def after(self, case: int, end: Ended) -> list[int]:
        """Return what is wanted beside, now that a case has ended."""
        if self.design.split(case)[1]:
            return []
        word = None
        if end.status == "ok":
            word = self.design.refinement.word_of(end._asdict())
        fresh = self.growth.learn(self.design.family.address(case), word)
        left = self.growth.feed(self._word, fresh)
        return [*self._left(left), *self._fresh_twins()]

    def _fresh_twins(self) -> list[int]:
        """Return the twins that have become wanted and have not ended."""
        fresh = self.growth.twinned[self._told :]
        self._told += len(fresh)
        out: list[int] = []
        for case in map(self.design.family.number, fresh):
            name = self.design.digest(case)
            numbers = enumerate(self.design.twins_of(case), 1)
            out += [n for twin, n in numbers if (name, twin) not in self.twins]
        return out

    def _word(self, address: Address) -> str | None:
        return self.ended[self.design.digest(self.design.family.number(address))]

    def _left(self, addresses: Sequence[Address]) -> list[int]:
        return [self.design.family.number(address) for address in addresses]


class Nominal:
    """Costs of a design's cases, those beyond the coarse ones added as they come.

    A case is expected to cost what the coarse one nearest to it does; by the second
    fidelity, in the proportion of a first such case of its panel.

    Parameters
    ----------
    design : of the campaign
    costs : of the coarse cases
    """

    def __init__(self, design: RefinedDesign, costs: Costs) -> None:
        self.design, self.costs = design, costs
        own = costs.places[np.arange(len(costs.places))]
        more = np.zeros((len(own), 1))  # where the fidelities lie apart
        costs.places = np.hstack([own, more])
        self._ratio: dict[int, float] = {}
        self._known = {case: case for case in range(len(costs.nominal))}

    def index(self, case: int) -> int:
        """Return the number of a case among the costs; a twin has its case's."""
        case = self.design.split(case)[0]
        if case not in self._known:
            address = self.design.family.address(case)
            near = self._near(address)
            nominal = self.costs.nominal[near] * self._dearer(address, near)
            self._known[case] = self.costs.add(nominal, self._place(address, near))
        return self._known[case]

    def _near(self, address: Address) -> int:
        """Return the coarse case nearest to another one."""
        sides = zip(self.design.family.lattice.sides, address.point, strict=True)
        point = tuple(round(side.position(x)) << side.depth for side, x in sides)
        return self.design.family.row_of[Address(0, 0, address.panel, point)]

    def _dearer(self, address: Address, near: int) -> float:
        if not address.fidelity:
            return 1.0
        if address.panel not in self._ratio:
            coarse = self.design.family.coarse[near]._replace(fidelity=1)
            number = self.design.family.number(coarse)
            cost, first = predicted(self.design, number)[1], self.costs.nominal[near]
            self._ratio[address.panel] = cost / first if cost and first else 1.0
        return self._ratio[address.panel]

    def _place(self, address: Address, near: int) -> np.ndarray:
        place = self.costs.places[np.array([near])][0].copy()
        both = zip(self.design.family.lattice.sides, address.point, strict=True)
        for side, x in both:
            column = self.design.swept.index(side.name)
            place[column] = side.position(x) / max(len(side.depths), 1)
        place[-1] = APART * address.fidelity
        return np.asarray(place)


class GrowingAgenda(Agenda):
    """An agenda whose units, a case each, lead to others.

    Units go by the number of their case: what a rank is sent it can look up by itself.

    Parameters
    ----------
    cases : left to compute
    nominal : costs
    after : what is wanted once a case has ended
    ranks, last : see `Agenda`
    """

    def __init__(
        self,
        cases: Sequence[int],
        nominal: Nominal,
        after: Callable[[int, Ended], list[int]],
        ranks: int = 1,
        last: Collection[int] = (),
    ) -> None:
        self.cases, self.nominal, self.after = list(cases), nominal, after
        self.unit_of = {case: unit for unit, case in enumerate(cases)}
        self.dropped = False
        units = [(nominal.index(case),) for case in cases]
        super().__init__(units, nominal.costs, ranks, last)
        self.turn[self._leading(cases)] = FOLLOWING
        self.turn[list(last)] = 0
        self.queue = array("q", self._ordered(np.arange(len(units))))

    @property
    def design(self) -> RefinedDesign:
        """The design of the cases."""
        return self.nominal.design

    @property
    def may_grow(self) -> bool:
        """Whether cases at work may lead to others."""
        return self.left > 0 and not self.dropped

    def take(self) -> int:
        """Return the next case."""
        return self.cases[super().take()]

    def bundle(self, most_units: int = MOST) -> list[int]:
        """Return the next cases for one answer."""
        return [self.cases[unit] for unit in super().bundle(most_units)]

    def drop(self) -> None:
        """Hand out nothing more, of what is still to come neither."""
        self.dropped = True
        super().drop()

    def finished(self, unit: int, seconds: float) -> None:
        """Learn that a case has taken some seconds."""
        super().finished(self.unit_of[unit], seconds)

    def hear(self, unit: int, ends: Sequence[Ended]) -> None:
        """Take in how a case ended; what follows is the next to go out."""
        for end in ends:
            self._add(self.after(unit, end))

    def _leading(self, cases: Sequence[int]) -> np.ndarray:
        """Return which of these are cases beyond the coarse level, and no twins."""
        coarse, span = len(self.design.settings), self.design.family.span
        return np.array([coarse <= case < span for case in cases], dtype=bool)

    def _add(self, cases: Sequence[int]) -> None:
        first, count = len(self.units), len(cases)
        if not count:
            return
        indices = [self.nominal.index(case) for case in cases]
        self.units = [*self.units, *((index,) for index in indices)]
        self.cases += cases
        self.unit_of |= {case: first + i for i, case in enumerate(cases)}
        new = np.arange(first, first + count)
        grown = self.took / self.told if self.told > 0.0 else 1.0
        expected = grown * self.costs.nominal[indices]
        self.predicted = np.append(self.predicted, expected)
        self.unfinished = np.append(self.unfinished, np.ones(count, dtype=bool))
        self.turn = np.append(self.turn, np.ones(count, dtype=np.int8))
        self.turn[first:][self._leading(cases)] = FOLLOWING
        self.left += count
        if not self.dropped:
            self.queue += array("q", self._ordered(new))
