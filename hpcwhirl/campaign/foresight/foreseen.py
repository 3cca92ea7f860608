"""Estimate how many refined cases will follow, from the regimes known so far."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.campaign.plan.design import Design
from hpcwhirl.refinement.growth import Address
from hpcwhirl.refinement.words import Word
from hpcwhirl.store.directory.completions import Ended

MOST = 200_000  # largest number of cases to which an estimate assigns a regime


@dataclass(frozen=True)
class Beyond:
    """Number and computing time of a campaign's refined cases, without coarse ones.

    Coarse cases are those of [sweep]; refined cases follow from their words.

    Attributes
    ----------
    ended : number of refined cases that have ended
    count : expected number of refined cases that are left
    guessed : part of `count` that the known regimes do not yet require
    most : number of refined cases left if every cell is split
    steps, seconds : number of time steps, and kernel time on one core, s, of `count`
        cases
    most_seconds : kernel time of `most` cases, s
    """

    ended: int
    count: int
    guessed: int
    most: int
    steps: float
    seconds: float
    most_seconds: float


class Known(NamedTuple):
    """A case that has ended, for the estimate of those that follow.

    Attributes
    ----------
    word : its regime; None: it has none
    seconds : its kernel time, s; NaN if unknown
    sure : whether its word is sure, see `refinement.rule.Rule.is_sure`
    """

    word: Word | None
    seconds: float
    sure: bool


def grown(design: Design, ended: Ended, mean: float) -> Beyond:
    """Return an estimate of the number and the computing time of the refined cases.

    Parameters
    ----------
    design : the campaign's cases
    ended : completed jobs in its directory
    mean : kernel time of a coarse case (case of [sweep]), s, used if no refined case
        has finished
    """
    known, asked = _known(design, ended)
    words: dict[Address, Word | None] = {a: one.word for a, one in known.items()}
    sure = {address for address, one in known.items() if one.sure}
    done = [0, 0]
    for address in known:
        done[address.fidelity] += bool(address.level or address.fidelity)
    found = followers(design, words, sure)
    left = [max(n - over, 0) for n, over in zip(found, done, strict=True)]
    most = design.most - len(design.settings) - sum(done)
    one, two = _each(design, known, mean)
    steps = _steps(design)
    return Beyond(
        sum(done), sum(left), max(sum(left) - asked, 0), most,
        left[0] * steps[0] + left[1] * steps[1], left[0] * one + left[1] * two,
        most * max(one, two),
    )  # fmt: skip


def _known(design: Design, ended: Ended) -> tuple[dict[Address, Known], int]:
    """Return the cases that have ended, and how many refined cases are still to do.

    The first value is {address: ended case}, by the place in the refined map; the
    second is the number of cases that refinement has asked for and that have not ended.
    """
    planner, address = ended.planner(), design.family.address
    known: dict[Address, Known] = {}
    for row, code in enumerate(planner.ends.tolist()):
        if code < 0:
            continue
        case, end = planner.number(row), planner.known.table[code]
        rule, told = design.family.rule, end._asdict()
        word = rule.word_of(told) if end.is_ok else None
        sure = end.is_ok and rule.is_sure(told)
        known[address(case)] = Known(word, ended.seconds_of(case), sure)
    jobs = planner.left()
    beyond = (jobs.row >= planner.kind.first) & (jobs.twin == 0)
    return known, int(beyond.sum())


def _each(
    design: Design, known: Mapping[Address, Known], mean: float
) -> tuple[float, float]:
    """Return the mean kernel times, s, of a refined case: first and confirming.

    The first computation of a case has fidelity 0, the repetition with the preset
    `confirm` fidelity 1.

    Parameters
    ----------
    design : the campaign's cases
    known : {address: case that has ended}
    mean : kernel time of a coarse case, s, used if no ended case has a time
    """
    taken: tuple[list[float], list[float]] = ([], [])
    for address, one in known.items():
        if (address.level or address.fidelity) and math.isfinite(one.seconds):
            taken[address.fidelity].append(one.seconds)
    coarse = [one.seconds for address, one in known.items() if not address.fidelity]
    usual = next((times for times in (taken[0], coarse) if times), [mean])
    first = float(np.nanmean(usual))
    if taken[1]:
        return first, float(np.mean(taken[1]))
    nominal = design.mean_seconds(design.family.rule)
    return first, first * nominal[1] / nominal[0]


def _steps(design: Design) -> tuple[float, float]:
    """Return the numbers of time steps of a refined case: first and confirming.

    The first computation of a case has fidelity 0, the repetition with the preset
    `confirm` fidelity 1. The middle one of the coarse cases stands for all.
    """
    family = design.family
    middle = family.coarse[len(family.coarse) // 2]
    first = design.predicted(family.number(middle))[0]
    if not design.family.rule.confirm:
        return first, first
    return first, design.predicted(family.number(middle._replace(fidelity=1)))[0]


def followers(
    design: Design,
    words: Mapping[Address, Word | None],
    sure: Collection[Address] = (),
) -> tuple[int, int]:
    """Return an estimate of the numbers of refined cases that words will require.

    There are two: first computations (fidelity 0), and repetitions with the preset
    `confirm` (fidelity 1). The rule of refinement is applied as if every case had the
    regime of the nearest known case. If known cases are spread evenly, the resulting
    boundaries are about as long as the real ones; if regimes are scattered, they are
    too short.

    Parameters
    ----------
    design : the campaign's cases
    words : {address: regime} of the cases that have ended; None: no regime
    sure : those of them whose word is sure, see `refinement.rule.Rule.is_sure`
    """
    if not words:
        return 0, 0
    family = design.family
    known = np.array([_place(design, address) for address in words])
    addresses = list(words)

    @cache
    def nearest(address: Address) -> Address:
        if address in words:
            return address
        if len(growth.wanted) > MOST:
            raise KeyError
        away = ((known - _place(design, address)) ** 2).sum(axis=1)
        return addresses[int(np.argmin(away))]

    growth = family.growth()
    growth.feed(
        lambda address: words[nearest(address)],
        list(growth.wanted),
        lambda address: nearest(address) in sure,
    )
    again = sum(address.fidelity for address in growth.wanted)
    return len(growth.wanted) - len(family.coarse) - again, again


def _place(design: Design, address: Address) -> NDArray[np.float64]:
    """Return the refined inputs and the panel number of a case, scaled to 0 .. 1.

    They are the coordinates, (d + 1,), in which the nearest known case is found.
    """
    family = design.family
    both = zip(family.lattice.sides, address.point, strict=True)
    along = [side.position(x) / len(side.depths) for side, x in both]
    return np.array([*along, address.panel / len(family.panels)])
