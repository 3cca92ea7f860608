"""Units of work: cases that ride together as lanes of one kernel, and single ones."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from hpcwhirl.case.resolve import Case
from hpcwhirl.dynamics.lanes import can_ride, group_key
from hpcwhirl.errors import WhirlError

LANES = 4  # cases of a batch: what one vector holds
PAYS = (
    300e6  # steps a rank from which batches save more than their kernel's compilation
)
Unit = tuple[int, ...]


def units_of(
    order: Sequence[int], case_of: Callable[[int], Case], steps: float, ranks: int
) -> list[Unit]:
    """Return the units of a campaign, in the order of its cases.

    Cases of one engine, gap, reduction and step make batches of `LANES`; the last of a
    group, four a rank, stay single, so that no rank is left with a batch while others
    have nothing to do. Results do not depend on it: a case has the same bits alone.

    Parameters
    ----------
    order : cases to do, the first to be handed out first
    case_of : the case of a number
    steps : predicted steps of all that is to be done
    ranks : that share the work
    """
    if steps < PAYS * ranks:
        return [(case,) for case in order]
    groups: dict[object, list[int]] = {}
    units: list[Unit] = []
    for number in order:
        case = case_of(number)
        if _rides(case):
            groups.setdefault(group_key(case), []).append(number)
        else:
            units.append((number,))
    for group in groups.values():
        whole = max(len(group) - LANES * ranks, 0) // LANES * LANES
        units += [tuple(group[i : i + LANES]) for i in range(0, whole, LANES)]
        units += [(case,) for case in group[whole:]]
    rank_of = {case: place for place, case in enumerate(order)}
    return sorted(units, key=lambda unit: (len(unit) == 1, rank_of[unit[0]]))


def _rides(case: Case) -> bool:
    """Return whether a case may ride; one that has no model fails alone, as a row."""
    try:
        return can_ride(case)
    except WhirlError:
        return False
