"""Which cases a campaign wants by the words there are: all panels, and a budget."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import NamedTuple

from hpcwhirl.refinement.lattice import Lattice, Point
from hpcwhirl.refinement.tree import Tree


class Address(NamedTuple):
    """Which case: comparing addresses gives the order of rows beyond the coarse ones.

    Attributes
    ----------
    fidelity : 0: the first, 1: that which confirms
    level : at which its point appears
    panel : number of the panel
    point : its place along each refined input
    """

    fidelity: int
    level: int
    panel: int
    point: Point


@dataclass(frozen=True)
class Budget:
    """What a campaign may take.

    Attributes
    ----------
    total : of what is counted
    each : what a case of each fidelity counts
    """

    total: float
    each: tuple[float, float] = (1.0, 1.0)


class Growth:
    """The cases that a campaign wants, which grow with the words of those there are.

    Without a budget a case is wanted as soon as the words ask for it, and the set that
    is reached in the end is the same in whatever order they come. With one, cases form
    generations: what the words of all before it ask for. A generation is complete
    before the next begins, which holds the first cases of it, in the order of their
    addresses, that the budget allows: what is left out depends on words alone.

    Parameters
    ----------
    lattice : places, the same in each panel
    panels : how many there are
    levels : after which mixed cells are speckle, see `Tree`
    confirm : whether there is a second fidelity
    budget : None: no limit; twins are not counted
    twins : of which cases, see `Tree`

    Attributes
    ----------
    wanted : in the order in which they became wanted, the coarse ones first
    twinned : cases of which twins are wanted, in the order in which they became so
    dropped : cases that the budget has left out; they might have asked for more
    """

    def __init__(
        self,
        lattice: Lattice,
        panels: int = 1,
        levels: int = 0,
        *,
        confirm: bool = False,
        budget: Budget | None = None,
        twins: str = "",
    ) -> None:
        self.lattice, self.budget = lattice, budget
        self.trees = [
            Tree(lattice, levels, confirm=confirm, twins=twins) for _ in range(panels)
        ]
        self.wanted: list[Address] = []
        self.twinned: list[Address] = []
        self.dropped = 0
        self._open: set[Address] = set()  # of this generation
        self._next: list[Address] = []
        self._spent = 0.0
        fresh = [a for panel in range(panels) for a in self._take(panel)]
        self._admit(sorted(fresh))

    def _take(self, panel: int) -> list[Address]:
        level, tree = self.lattice.level, self.trees[panel]
        fresh, twinned = (
            [Address(fid, level(point), panel, point) for fid, point in wishes]
            for wishes in (tree.take(), tree.take_twins())
        )
        self.twinned += twinned
        return fresh

    def _admit(self, new: list[Address]) -> list[Address]:
        self.wanted += new
        if self.budget:
            self._open.update(new)
            self._spent += sum(self.budget.each[a.fidelity] for a in new)
        return new

    def learn(self, address: Address, word: str | None) -> list[Address]:
        """Take in that a wanted case has ended; return what has become wanted."""
        self.trees[address.panel].learn(address.fidelity, address.point, word)
        fresh = self._take(address.panel)
        if self.budget is None:
            return self._admit(fresh)
        self._open.discard(address)
        self._next += fresh
        if self._open:
            return []
        allowed = self._affordable(sorted(self._next), self.budget)
        self.dropped += len(self._next) - len(allowed)
        self._next = []
        return self._admit(allowed)

    def _affordable(self, new: list[Address], budget: Budget) -> list[Address]:
        """Return the first of a generation up to the budget; none once it is cut."""
        if self.dropped:
            return []
        spent, allowed = self._spent, []
        for address in new:
            spent += budget.each[address.fidelity]
            if spent > budget.total:
                break
            allowed.append(address)
        return allowed

    def feed(
        self, found: Callable[[Address], str | None], ask: Iterable[Address]
    ) -> list[Address]:
        """Take in all that is known, of what that makes wanted, too; return the rest.

        Parameters
        ----------
        found : the word of a case that has ended, None without one; raises KeyError of
            one that has not
        ask : wanted cases to begin with
        """
        todo, left = list(ask), []
        while todo:
            address = todo.pop()
            try:
                word = found(address)
            except KeyError:
                left.append(address)
                continue
            todo += self.learn(address, word)
        return left

    def ordered(self) -> list[Address]:
        """Return what is wanted beyond the coarse cases, in the order of their rows."""
        return sorted(a for a in self.wanted if a.fidelity or a.level)
