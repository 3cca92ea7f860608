"""Split the cells of a refined map where the words of cases at their points differ."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from hpcwhirl.refinement.lattice import Cell, Lattice, Point
from hpcwhirl.refinement.words import Word, any_differ

SPECKLE_SHARE = 0.75  # share of mixed parts above which a cell is speckle
FIRST, CONFIRM = 0, 1  # fidelities: of the first computation, of the confirming one
Words = dict[Point, Word | None]
Wish = tuple[int, Point]  # fidelity and point of a wanted case


@dataclass(slots=True)
class Node:
    """State of one cell of a refined map, see `Tree`.

    The first fidelity is the first computation of a case, the second its repetition
    with the preset `confirm`.

    Attributes
    ----------
    corners : points at the cell's corners
    points : points of the cell at which cases are wanted, until it is split: its
        corners, and corners of smaller neighbours on its sides (hanging points)
    seen : words of the first fidelity at its points, and of the second
    at_corners : words of the first fidelity at its corners
    open : number of corners whose first-fidelity cases have not ended
    split : whether the cell is split
    demanded : whether a finer neighbour requires that it be split
    changed : whether the two fidelities give different words at one of its points
    """

    corners: tuple[Point, ...]
    points: list[Point]
    open: int
    seen: tuple[set[Word], set[Word]] = field(default_factory=lambda: (set(), set()))
    at_corners: set[Word] = field(default_factory=set)
    split: bool = False
    demanded: bool = False
    changed: bool = False

    @property
    def mixed(self) -> bool:
        """Whether words of the same fidelity differ between two points of the cell."""
        return any(map(any_differ, self.seen))

    @property
    def uneven(self) -> bool | None:
        """Whether words of the first fidelity differ at the corners of the cell.

        None: they agree so far, and cases at some corners have not ended.
        """
        return True if any_differ(self.at_corners) else (None if self.open else False)


class Tree:
    """The cells of a refined map, for one panel, and the cases that they require.

    A panel has the cases that differ in refined inputs only. The first fidelity is the
    first computation of a case, the second its repetition with the preset `confirm`. A
    cell is mixed if words at its points differ, and at its end if it cannot be split
    further. Cells and wanted cases are the smallest sets that satisfy these rules,
    which only ever add to them:

    - A cell is split if two of its points (corners, and hanging points on its sides)
      have different words by the same fidelity.
    - Split cells are balanced: the neighbours of a split cell, even at a corner, are
      not coarser than it; coarser ones are split.
    - Nothing is split or confirmed in speckle, a region whose words are mixed almost
      everywhere. A cell lies in speckle if, of all parts into which the cell `levels`
      above it could be split in `levels` steps, more than three quarters have different
      words at their corners. Parts that were not computed, since their parent has equal
      words at all corners, count as not mixed. Only words at points within that upper
      cell, its edges included, are used.
    - With a second fidelity, the corners of a mixed cell at its end are confirmed, that
      is, computed with it, unless the first words at all of them are sure: then the
      word changes within the cell by both estimates. So are those of every cell around
      a point whose word the second fidelity changes, except cells that are split anyway
      by the first words at their corners.
    - Cases with a word at the corners of mixed cells in speckle have twins; if `twins`
      is "boundary", also those of mixed cells at their end, by the second fidelity if
      there is one, and by the first if all their words are sure.

    A case that has ended without a word has no effect: no cell is split or confirmed
    because of it, and it has no twins.

    Parameters
    ----------
    lattice : values that the refined inputs may take
    levels : levels after which a cell with mostly mixed parts is speckle; 0: never
    confirm : whether there is a second fidelity
    twins : "all": every case with a word has twins; "boundary" or "speckle": those of
        the last rule; "" or "even": none by these rules
    branch : coarse cells of a panel that is a branch: split cells are not balanced,
        since a case between two others continues only the first of them; None: all
        coarse cells of the lattice, balanced

    Attributes
    ----------
    coarse : coarse cells
    cells : {cell: state} of all cells, split ones included
    fresh : cases that the rules have asked for (wanted cases) since the last `take`
    twinned : cases whose twins have become wanted since the last `take_twins`
    """

    def __init__(
        self,
        lattice: Lattice,
        levels: int = 0,
        *,
        confirm: bool = False,
        twins: str = "",
        branch: Sequence[Cell] | None = None,
    ) -> None:
        self.lattice, self.levels, self.confirm = lattice, levels, confirm
        self.coarse = list(lattice.coarse() if branch is None else branch)
        self._balanced = branch is None
        self.twins = twins
        self.twinned: list[Wish] = []
        self._followed: tuple[set[Point], set[Point]] = (set(), set())
        self._sure: set[Point] = set()  # points whose first word is sure
        self.cells: dict[Cell, Node] = {}
        self.words: tuple[Words, Words] = ({}, {})
        self.wanted: tuple[set[Point], set[Point]] = (set(), set())
        self.fresh: list[Wish] = []
        self._demanded: set[Cell] = set()  # cells to be split as soon as they exist
        self._speckled: dict[Cell, bool] = {}
        # {upper cell: cells to visit once it is known whether it is speckle}
        self._asking: dict[Cell, set[Cell]] = {}
        self._todo: list[Cell] = []
        for cell in self.coarse:
            self._make(cell, ())
        self._settle()

    def take(self) -> list[Wish]:
        """Return the cases that the rules have required since the last call.

        Each is (fidelity, point).
        """
        fresh, self.fresh = self.fresh, []
        return fresh

    def take_twins(self) -> list[Wish]:
        """Return the cases whose twins the rules have required since the last call.

        Each is (fidelity, point).
        """
        twinned, self.twinned = self.twinned, []
        return twinned

    def learn(
        self, fidelity: int, point: Point, word: Word | None, *, sure: bool = False
    ) -> None:
        """Record that the case at a point has ended, and apply the rules to its word.

        Parameters
        ----------
        fidelity : 0: first computation, 1: confirmation
        point : place along each refined input, see `lattice`
        word : word of the case; None: it has none
        sure : whether an estimate of its error says that the word would not change
        """
        words = self.words[fidelity]
        if point in words:
            return
        words[point] = word
        if sure and fidelity == FIRST and word is not None:
            self._sure.add(point)
        other = self.words[1 - fidelity].get(point)
        changed = _differ(word, other)
        if word is not None and (
            self.twins == "all" or point in self._followed[fidelity]
        ):
            self.twinned.append((fidelity, point))
        for cell in self._around(point):
            self._note(cell, fidelity, point, changed=changed)
        self._settle()

    def is_speckle(self, cell: Cell) -> bool:
        """Return whether a cell is known to lie in speckle, where splitting stops."""
        return self._allowed(cell) is False

    def word(self, point: Point) -> Word | None:
        """Return the word of the case at a point, of the second fidelity if it has one.

        None if no case at the point has a word.
        """
        return self.words[CONFIRM].get(point) or self.words[FIRST].get(point)

    def is_confirmed(self, point: Point) -> bool:
        """Return whether a point has a word by the second fidelity, or needs none."""
        known = self.words[CONFIRM].get(point) is not None
        return known or (self.confirm and point in self._sure)

    def even(self) -> list[Wish]:
        """Return the cases away from boundaries, as (fidelity, point).

        All cells around such a case that are not split have one word.
        """
        even: set[Point] = set()
        other: set[Point] = set()
        for node in self.cells.values():
            if not node.split:
                words = [self.word(point) for point in node.points]
                known = {word for word in words if word is not None}
                alike = not any_differ(known) and (None not in words or not known)
                (even if alike else other).update(node.points)
        points = sorted(p for p in even - other if self.word(p) is not None)
        second = self.words[CONFIRM]
        return [(CONFIRM if second.get(p) else FIRST, p) for p in points]

    def _around(self, point: Point) -> list[Cell]:
        """Return the existing cells of all levels that contain a point, or touch it."""
        levels = range(self.lattice.depth + 1)
        touching = (c for level in levels for c in self.lattice.touching(level, point))
        return [cell for cell in touching if cell in self.cells]

    def _note(self, cell: Cell, fidelity: int, point: Point, *, changed: bool) -> None:
        """Enter the word of an ended case into the state of a cell that has its point.

        Parameters
        ----------
        cell : the cell
        fidelity : 0: first computation, 1: confirmation
        point : place of the case along each refined input
        changed : whether the two fidelities have different words at the point
        """
        node, word = self.cells[cell], self.words[fidelity][point]
        before = node.uneven
        if word is not None:
            node.seen[fidelity].add(word)
        if fidelity == FIRST and point in node.corners:
            node.open -= 1
            if word is not None:
                node.at_corners.add(word)
        node.changed |= changed
        self._todo.append(cell)
        if node.uneven is not before:
            self._revisit_waiting(cell)

    def _revisit_waiting(self, cell: Cell) -> None:
        """Apply the rules again to finer cells that wait for the words at this cell.

        They wait to know whether a coarser cell around them lies in speckle.
        """
        level, low = cell
        for above in range(max(level - self.levels, 0), level):
            self._todo += self._asking.pop(self.lattice.at(above, low), ())

    def _settle(self) -> None:
        """Split cells and ask for cases and twins until the rules require no more."""
        while self._todo:
            self._visit(self._todo.pop())

    def _visit(self, cell: Cell) -> None:
        node, last = self.cells[cell], self.lattice.at_end(cell)
        if self.twins in ("boundary", "speckle") and node.mixed:
            self._follow(cell)
        split = not last and not node.split and (node.mixed or node.demanded)
        asked = self._to_confirm(node, last=last) if self.confirm else []
        if not (split or asked) or not self._allowed(cell):
            return
        self._want(CONFIRM, asked)
        if split:
            self._split(cell)

    def _to_confirm(self, node: Node, *, last: bool) -> list[Point]:
        """Return the corners of a cell that are to be confirmed, and are not yet.

        node, last : the cell; whether it is at its end
        """
        left = [p for p in node.corners if p not in self.wanted[CONFIRM]]
        if node.changed and (last or node.uneven is False):
            return left
        ended = [p for p in node.corners if p in self.words[FIRST]]
        return left if last and node.mixed and not self._sure.issuperset(ended) else []

    def _follow(self, cell: Cell) -> None:
        """Ask for twins at the corners of a mixed cell that is split no further.

        Such a cell lies in speckle, or at a boundary of the finest level.
        """
        allowed, corners = self._allowed(cell), self.cells[cell].corners
        fidelities = [FIRST, CONFIRM]
        if allowed and self.twins == "boundary" and self.lattice.at_end(cell):
            sure = not self.confirm or self._sure.issuperset(corners)
            fidelities = [FIRST] * sure + [CONFIRM] * self.confirm
        elif allowed is not False:
            return
        for fidelity in fidelities:
            for point in {*corners} - self._followed[fidelity]:
                self._followed[fidelity].add(point)
                if self.words[fidelity].get(point) is not None:
                    self.twinned.append((fidelity, point))

    def _split(self, cell: Cell) -> None:
        node = self.cells[cell]
        node.split = True
        for child in self.lattice.children(cell):
            self._make(child, node.points)
        level = cell[0]
        for near in self.lattice.neighbours(cell) if self._balanced else ():
            if near not in self.cells:
                above = self.lattice.at(level - 1, near[1])
                self._demanded.add(above)
                if above in self.cells:
                    self.cells[above].demanded = True
                    self._todo.append(above)

    def _make(self, cell: Cell, inherited: Iterable[Point]) -> None:
        """Add a cell to the tree, and ask for the cases at its corners.

        Parameters
        ----------
        cell : the cell
        inherited : points of the cell of which it is a part, at which cases are wanted
        """
        corners = self.lattice.corners(cell)
        self._want(FIRST, corners)
        low, high = corners[0], corners[-1]
        inside = [
            point
            for point in inherited
            if all(a <= x <= b for a, x, b in zip(low, point, high, strict=True))
        ]
        points = list(dict.fromkeys([*corners, *inside]))
        node = Node(corners, points, len(corners), demanded=cell in self._demanded)
        self.cells[cell] = node
        for point in points:
            for fidelity in (FIRST, CONFIRM):
                if point in self.words[fidelity]:
                    self._note(cell, fidelity, point, changed=self._changed(point))
        self._todo.append(cell)

    def _changed(self, point: Point) -> bool:
        return _differ(*(words.get(point) for words in self.words))

    def _want(self, fidelity: int, points: Iterable[Point]) -> None:
        for point in points:
            if point in self.wanted[fidelity]:
                continue
            self.wanted[fidelity].add(point)
            self.fresh.append((fidelity, point))
            if fidelity == FIRST:
                for cell in self._around(point):
                    node = self.cells[cell]
                    if not node.split and point not in node.points:
                        node.points.append(point)

    def _allowed(self, cell: Cell) -> bool | None:
        """Return whether a cell may be split or confirmed: it lies outside speckle.

        None: that depends on words not yet known.
        """
        level = cell[0] - self.levels
        if not self.levels or level < 0:
            return True
        above = self.lattice.at(level, cell[1])
        if above not in self._speckled:
            speckle = self._is_speckle_below(above)
            if speckle is None:
                self._asking.setdefault(above, set()).add(cell)
                return None
            self._speckled[above] = speckle
        return not self._speckled[above]

    def _is_speckle_below(self, cell: Cell) -> bool | None:
        """Return whether most parts of a cell, after `levels` bisections, are mixed.

        None: that depends on words not yet known.
        """
        parts = self.lattice.children(cell)
        for _ in range(self.levels - 1):
            if any(self._uneven(part) is None for part in parts):
                return None
            below = [self.lattice.children(p) for p in parts if self._uneven(p)]
            parts = [part for each in below for part in each]
        uneven = [self._uneven(part) for part in parts]
        if None in uneven:
            return None
        whole = self.lattice.parts(cell, self.levels)
        return sum(map(bool, uneven)) > SPECKLE_SHARE * whole

    def _uneven(self, cell: Cell) -> bool | None:
        node = self.cells.get(cell)
        return node.uneven if node else None


def _differ(one: Word | None, other: Word | None) -> bool:
    return one is not None and other is not None and any_differ({one, other})
