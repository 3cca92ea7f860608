"""What a campaign refines (`Rule`), and all cases that it may then have (`Family`).

Branches are bisected between successive cases whose words differ. On a branch, each
coarse case begins with the last state of the coarse case before it. If the words of two
successive cases differ, a fold lies between them. The case half way between them also
begins with the last state of the first one; then the half in which the word changes is
bisected, and so on. So the case in the middle of a cell continues the case at that end
of the cell which the branch passes first. The binary digits of the middle's place (see
`lattice`) give all cases before it: the history is a function of the place alone.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from math import prod
from typing import Any

from hpcwhirl.errors import InputError, StoreError, shown
from hpcwhirl.refinement.growth import Address, Growth
from hpcwhirl.refinement.lattice import Cell, Lattice, Point, Side
from hpcwhirl.refinement.words import REGIME, Word, word_of
from hpcwhirl.scene.history import history_of

Settings = dict[str, Any]
HISTORY = "history"  # input of a case, see `scene.history`


@dataclass(frozen=True)
class Rule:
    """What a campaign refines: which inputs, how far, and by which words.

    The plan of the campaign stores it.

    Attributes
    ----------
    over : dotted names of the refined inputs
    depths : for each input, largest number of bisections of each interval between its
        coarse values
    scale : for each input, "linear" or "log"
    words : kind of words that are compared, one of `words.COMPARED`
    speckle : number of levels after which a mostly mixed cell is not split further; 0:
        never
    confirm : preset with which cases at boundaries are computed again, except around
        cells whose cases are all sure (see `is_sure`); "": they are not
    inputs : {dotted name: value} that `confirm` sets
    budget : largest total cost, cost of the first computation of a case (fidelity 0),
        and of its repetition with `confirm` (fidelity 1), all in cases or in core
        hours; empty for no limit
    """

    over: tuple[str, ...]
    depths: tuple[tuple[int, ...], ...]
    scale: tuple[str, ...]
    words: str = "regime"
    speckle: int = 2
    confirm: str = ""
    inputs: Settings = field(default_factory=dict)
    budget: tuple[float, ...] = ()

    def plain(self) -> dict[str, Any]:
        """Return the rule as data for JSON, in which form the plan stores it."""
        return dict(json.loads(json.dumps(self.__dict__)))

    def word_of(self, end: Mapping[str, Any]) -> Word | None:
        """Return the word of an ended case for refinement; None if it has none.

        A case that failed, or whose outcome is `unstable`, has no word.

        end : {"regime": word, "whirl": word, "features": numbers}, see `words.word_of`
        """
        return None if end["regime"] == "none" else word_of(self.words, end)

    def is_sure(self, end: Mapping[str, Any]) -> bool:
        """Return whether the word of an ended case is also that of a longer time step.

        It is known of the regime only, and of cases with `solver.estimate`.

        end : {"regime": word, "coarse_regime": word}, see `analysis.estimate`
        """
        same = end["coarse_regime"] == end["regime"] != "none"
        return self.words == REGIME and bool(same)


def rule_of(plain: Mapping[str, Any]) -> Rule:
    """Return the rule stored in a plan; raise StoreError if it is damaged.

    plain : the rule as data, from `Rule.plain`
    """
    try:
        fields = dict(plain)
        fields["depths"] = tuple(map(tuple, fields["depths"]))
        fields |= {name: tuple(fields[name]) for name in ("over", "scale", "budget")}
        return Rule(**fields)
    except (KeyError, TypeError, ValueError) as failed:
        msg = f"the rule of a refinement is damaged: {type(failed).__name__} {failed}"
        raise StoreError(msg) from None


class Family:
    """All cases that a refined campaign may have, coarse ones and refined ones.

    Coarse cases are those of [sweep]. A panel contains the cases that differ in refined
    inputs only. The number of a coarse case is its row; the numbers of other cases
    follow from their addresses.

    In a campaign with [branch] each panel is a branch, and the history of a case
    follows from its place: see `Branches`.

    Parameters
    ----------
    rule : rule of the campaign
    rows : {input: value} of each coarse case; each panel has all combinations of the
        values of the refined inputs
    whole : names of inputs that take whole numbers only

    Attributes
    ----------
    lattice : possible values of the refined inputs, the same in each panel
    panels : {input: value} that all cases of a panel have in common, for each panel
    coarse : addresses of the coarse cases
    """

    def __init__(
        self, rule: Rule, rows: Sequence[Settings], whole: Sequence[str] = ()
    ) -> None:
        self.rule, self.rows = rule, rows
        values = [tuple(sorted({row[name] for row in rows})) for name in rule.over]
        sides = zip(rule.over, values, rule.depths, rule.scale, strict=True)
        self.lattice = Lattice(
            tuple(Side(n, v, d, s, whole=n in whole) for n, v, d, s in sides)
        )
        self.panels: list[Settings] = []
        numbers: dict[str, int] = {}
        self.coarse: list[Address] = []
        places = [{v: i << s.depth for i, v in enumerate(s.values)}
                  for s in self.lattice.sides]  # fmt: skip
        for row in rows:
            rest = {n: v for n, v in row.items() if n not in (*rule.over, HISTORY)}
            key = json.dumps(rest, sort_keys=True)
            if key not in numbers:
                numbers[key] = len(self.panels)
                self.panels.append(rest)
            at = zip(places, rule.over, strict=True)
            point = tuple(place[row[name]] for place, name in at)
            self.coarse.append(Address(0, 0, numbers[key], point))

        self.branches: Branches | None = None
        if rows and HISTORY in rows[0]:
            lines = list[list[int]]([] for _ in self.panels)
            order = sorted(range(len(rows)), key=lambda n: len(rows[n][HISTORY]))
            for address in map(self.coarse.__getitem__, order):
                lines[address.panel].append(address.point[0])
            self.branches = Branches(self.lattice, lines)

    @cached_property
    def row_of(self) -> dict[Address, int]:
        """Return {address: number} of the coarse cases, those of [sweep]."""
        return {address: row for row, address in enumerate(self.coarse)}

    @property
    def _lengths(self) -> list[int]:
        return [side.last + 1 for side in self.lattice.sides]

    def number(self, address: Address) -> int:
        """Return the number of a case, which identifies it in the campaign."""
        if address in self.row_of:
            return self.row_of[address]
        number = address.fidelity * len(self.panels) + address.panel
        for place, length in zip(address.point, self._lengths, strict=True):
            number = number * length + place
        return len(self.rows) + number

    def address(self, number: int) -> Address:
        """Return the address (fidelity, level, panel, point) of a case by number."""
        if number < len(self.rows):
            return self.coarse[number]
        rest, point = number - len(self.rows), []
        for length in reversed(self._lengths):
            rest, place = divmod(rest, length)
            point.append(place)
        at: Point = tuple(reversed(point))
        fidelity, panel = divmod(rest, len(self.panels))
        return Address(fidelity, self.lattice.level(at), panel, at)

    def settings(self, address: Address) -> Settings:
        """Return {input: value} of all inputs that a case sets, by its address."""
        both = zip(self.lattice.sides, address.point, strict=True)
        refined = {side.name: side.value(place) for side, place in both}
        preset = self.rule.inputs if address.fidelity else {}
        found: Settings = refined | self.panels[address.panel] | preset
        if self.branches is not None:
            found[HISTORY] = self.branches.history(address.panel, address.point[0])
        return found

    @property
    def span(self) -> int:
        """Upper bound, exclusive, of the numbers that identify cases."""
        fidelities = 2 if self.rule.confirm else 1
        return len(self.rows) + fidelities * len(self.panels) * prod(self._lengths)

    @property
    def most(self) -> int:
        """Largest number of cases possible: all cells split, or the budget spent."""
        points = 1
        for side in self.lattice.sides:
            points *= 1 + sum(1 << depth for depth in side.depths)
        count = points * len(self.panels) * (2 if self.rule.confirm else 1)
        if self.rule.budget:
            count = min(count, int(self.rule.budget[0] // min(self.rule.budget[1:])))
        return count

    def growth(self, twins: str = "") -> Growth:
        """Return the state of the refinement before any case has ended.

        Only the coarse cases are wanted in it.

        twins : which cases have twins, see `Tree`; "": none
        """
        return Growth(
            self.lattice,
            self.branches.cells if self.branches else len(self.panels),
            self.rule.speckle,
            confirm=bool(self.rule.confirm),
            budget=self.rule.budget,
            twins=twins,
        )


def check_change(old: Mapping[str, Any], new: Mapping[str, Any], where: str) -> None:
    """Raise InputError if a new rule may not replace that of an existing campaign.

    A campaign may be refined for the first time or more finely, with another budget or
    none, and with a confirming preset if it had none.

    Parameters
    ----------
    old, new : former and new rule as data, see `Rule.plain`; empty: not refined
    where : text at the beginning of the message, which names the campaign
    """
    if not old:
        return
    if not new:
        msg = f"{where} was begun with [refine]: give the same [refine], or a finer one"
        raise InputError(msg)
    was, now = rule_of(old), rule_of(new)
    for name in ("over", "scale", "words", "speckle"):
        if getattr(was, name) != getattr(now, name):
            both = [", ".join(v) if isinstance(v, tuple) else v
                    for v in (getattr(was, name), getattr(now, name))]  # fmt: skip
            msg = f"{where} was begun with [refine] {name} = {shown(both[0])}, "
            raise InputError(msg + f"got {shown(both[1])}")
    if was.confirm and (was.confirm, was.inputs) != (now.confirm, now.inputs):
        msg = f"{where} was begun with [refine] confirm = {shown(was.confirm)}, "
        raise InputError(msg + f"got {shown(now.confirm) if now.confirm else 'none'}")
    for name, before, after in zip(was.over, was.depths, now.depths, strict=True):
        if max(after) < max(before):
            msg = f"{where} was refined over {name} by {max(before)} levels, got "
            raise InputError(msg + f"{max(after)}: resolution may only become finer")


class Branches:
    """Branches of a refined campaign: their cells, and which cases a case continues.

    A place is an integer that names a value of the input along the branches, see
    `lattice`.

    Parameters
    ----------
    lattice : possible values of the one input that varies along branches
    places : places of the coarse cases of each branch, in their order

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
        """Return the input `history` of a case: values of the cases that lead to it.

        Parameters
        ----------
        branch : number of the branch
        place : place (integer that names a value) of the case
        """
        values = [self.side.value(before) for before in self.before(branch, place)]
        return history_of(self.side.name, values)

    def before(self, branch: int, place: int) -> list[int]:
        """Return the places of the cases whose motions lead to the case at a place.

        The first case of the branch comes first.

        Parameters
        ----------
        branch : number of the branch
        place : place (integer that names a value) of the case
        """
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
