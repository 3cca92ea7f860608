"""How many cases words will ask for in a refined campaign, guessed from a few words."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.campaign.plan.refined import RefinedDesign
from hpcwhirl.refinement.growth import Address

MOST = 200_000  # cases of a guess


def followers(
    design: RefinedDesign, words: Mapping[Address, str | None]
) -> tuple[int, int]:
    """Return how many cases beyond the coarse ones there would be, by each fidelity.

    The rule of the refinement is applied as if every case had the word of that one of
    some which lies nearest to it: boundaries then are about as long as real ones where
    the few lie evenly, and where motions wander they are too short.

    Parameters
    ----------
    design : the campaign
    words : of the cases that are known, None without one
    """
    if not words:
        return 0, 0
    family = design.family
    known = np.array([_place(design, address) for address in words])
    spoken = list(words.values())

    def word(address: Address) -> str | None:
        if address in words:
            return words[address]
        if len(growth.wanted) > MOST:
            raise KeyError
        away = ((known - _place(design, address)) ** 2).sum(axis=1)
        return spoken[int(np.argmin(away))]

    growth = family.growth()
    growth.feed(word, list(growth.wanted))
    again = sum(address.fidelity for address in growth.wanted)
    return len(growth.wanted) - len(family.coarse) - again, again


def _place(design: RefinedDesign, address: Address) -> NDArray[np.float64]:
    """Return where a case lies, each refined input and the panels over 0 ... 1."""
    family = design.family
    both = zip(family.lattice.sides, address.point, strict=True)
    along = [side.position(x) / len(side.depths) for side, x in both]
    return np.array([*along, address.panel / len(family.panels)])
