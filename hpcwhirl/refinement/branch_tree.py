"""Refined branches: bisection between successive cases whose words differ.

On a branch, each coarse case begins with the last state of the coarse case before it.
If the words of two successive cases differ, a fold lies between them. The case half way
between them also begins with the last state of the first one; then the half in which
the word changes is bisected, and so on. So the case in the middle of a cell continues
the case at that end of the cell which the branch passes first. All cases before a case
follow from the binary digits of its place: the history is a function of the place.
"""

from __future__ import annotations

from collections.abc import Sequence

from hpcwhirl.refinement.lattice import Cell, Lattice
from hpcwhirl.scene.history import history_of

HISTORY = "history"  # input of a case, see `scene.history`


class Branches:
    """The cells of branches, and the history of each place.

    Parameters
    ----------
    lattice : lattice of the one input that varies along branches
    places : coarse places of each branch, in the order in which they follow one another

    Attributes
    ----------
    cells : coarse cells of each branch
    """

    def __init__(self, lattice: Lattice, places: Sequence[Sequence[int]]) -> None:
        (self.side,), self.places = lattice.sides, places
        ends = [(min(line), max(line)) for line in places]
        self.cells: list[list[Cell]] = [
            [cell for cell in lattice.coarse() if low <= cell[1][0] < high]
            for low, high in ends
        ]

    def history(self, branch: int, place: int) -> str:
        """Return the history of the case at a place of a branch."""
        values = [self.side.value(before) for before in self.before(branch, place)]
        return history_of(self.side.name, values)

    def before(self, branch: int, place: int) -> list[int]:
        """Return the places of the cases before that at `place`, in branch order."""
        line = self.places[branch]
        sign = 1 if line[-1] > line[0] else -1
        found = [one for one in line if sign * (place - one) > 0]
        rest = abs(place - found[-1]) if found else 0
        if rest == 1 << self.side.depth:  # a coarse case, continuing another coarse one
            return found
        while rest & (rest - 1):  # every digit 1 except the lowest gives a case before
            step = 1 << (rest.bit_length() - 1)
            found.append(found[-1] + sign * step)
            rest -= step
        return found
