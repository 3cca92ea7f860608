"""Which cases a refined campaign needs, given the words of cases that have ended."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

from hpcwhirl.refinement.lattice import Cell, Lattice, Point
from hpcwhirl.refinement.tree import Tree
from hpcwhirl.refinement.words import Word


class Address(NamedTuple):
    """Identity of a case of a refined campaign; sorted, it is the order of the results.

    Attributes
    ----------
    fidelity : 0: first computation; 1: confirmation, the repetition with another preset
    level : number of bisections after which its point appears; 0: a coarse case
    panel : number of the combination of the other inputs, which are not refined
    point : integer position along each refined input, see `lattice`
    """

    fidelity: int
    level: int
    panel: int
    point: Point


class Growth:
    """The cases that a refined campaign needs (wanted cases), a set that words extend.

    Without a budget, a case is wanted as soon as words require it, and the final set
    does not depend on the order in which words arrive. With a budget, cases form
    generations. A generation starts when all cases of the generation before have ended.
    It has as many of the cases that their words require as the budget allows, in the
    order of addresses. So the excluded cases depend on words only.

    Parameters
    ----------
    lattice : possible values of the refined inputs, the same in each panel
    panels : number of panels (combinations of the inputs not refined); or, if panels
        are branches, the coarse cells of each one
    levels : levels after which mixed cells are speckle, see `Tree`
    confirm : whether cases at boundaries are repeated with another preset (second
        fidelity)
    budget : largest sum of the cases' costs, without twins, then the cost of a first
        computation (fidelity 0) and of a repetition (fidelity 1), all in cases or in
        core hours; empty for no limit
    twins : which cases have twins, see `Tree`

    Attributes
    ----------
    wanted : cases in the order in which they became wanted, the coarse ones first
    twinned : cases whose twins are wanted, in the order in which they became wanted;
        without the cases drawn after all have ended, see `even`
    dropped : number of cases that the budget excluded, not counting further cases that
        their words might have required
    """

    def __init__(
        self,
        lattice: Lattice,
        panels: int | Sequence[Sequence[Cell]] = 1,
        levels: int = 0,
        *,
        confirm: bool = False,
        budget: Sequence[float] = (),
        twins: str = "",
    ) -> None:
        self.lattice, self.budget = lattice, budget
        self.trees = [
            Tree(lattice, levels, confirm=confirm, twins=twins, branch=branch)
            for branch in ([None] * panels if isinstance(panels, int) else panels)
        ]
        self.wanted: list[Address] = []
        self.twinned: list[Address] = []
        self.dropped = 0
        self._open: set[Address] = set()  # wanted cases that have not ended
        self._next: list[Address] = []
        self._spent = 0.0
        fresh = [a for panel in range(len(self.trees)) for a in self._take(panel)]
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
        self._open.update(new)
        if self.budget:
            self._spent += sum(self.budget[1 + a.fidelity] for a in new)
        return new

    def learn(
        self, address: Address, word: Word | None, *, sure: bool = False
    ) -> list[Address]:
        """Record the word of an ended case; return the further cases that it requires.

        Parameters
        ----------
        address : the case
        word : its word; None: it has none
        sure : whether an estimate of its error says that the word would not change
        """
        tree = self.trees[address.panel]
        tree.learn(address.fidelity, address.point, word, sure=sure)
        fresh = self._take(address.panel)
        self._open.discard(address)
        if not self.budget:
            return self._admit(fresh)
        self._next += fresh
        if self._open:
            return []
        allowed = self._affordable(sorted(self._next))
        self.dropped += len(self._next) - len(allowed)
        self._next = []
        return self._admit(allowed)

    def _affordable(self, new: list[Address]) -> list[Address]:
        """Return the first of the cases `new`, as many as the budget still allows.

        None of them once the budget has excluded a case.
        """
        if self.dropped:
            return []
        spent, allowed = self._spent, []
        for address in new:
            spent += self.budget[1 + address.fidelity]
            if spent > self.budget[0]:
                break
            allowed.append(address)
        return allowed

    def feed(
        self,
        found: Callable[[Address], Word | None],
        ask: Iterable[Address],
        sure: Callable[[Address], bool] = lambda _: False,
    ) -> list[Address]:
        """Record the words of many ended cases; return the wanted cases still left.

        Cases that become wanted by these words are looked up, too.

        Parameters
        ----------
        found : function from a case to its word, None without one; raises KeyError for
            a case that has not ended
        ask : wanted cases that are looked up first
        sure : function from a case to whether its word is sure, see `learn`
        """
        todo, left = list(ask), []
        while todo:
            address = todo.pop()
            try:
                word = found(address)
            except KeyError:
                left.append(address)
                continue
            todo += self.learn(address, word, sure=sure(address))
        return left

    @property
    def left(self) -> int:
        """Number of cases that the campaign needs and that have not ended."""
        return len(self._open)

    def even(self) -> list[Address]:
        """Return the cases away from boundaries: cells around them have one word only.

        Only cells that are not split count. At each point (set of values of the refined
        inputs) the case of the second fidelity is taken if it has a word, else that of
        the first.
        """
        level = self.lattice.level
        return [
            Address(fidelity, level(point), panel, point)
            for panel, tree in enumerate(self.trees)
            for fidelity, point in tree.even()
        ]

    def ordered(self) -> list[Address]:
        """Return the refined cases needed, not coarse ones, in the order of results."""
        return sorted(a for a in self.wanted if a.fidelity or a.level)
