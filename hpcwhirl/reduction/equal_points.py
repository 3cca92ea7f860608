"""Nodal diameters of a rotor with several contact points a tip, for what is told of it.

Its march has waves of its own, see `dynamics.point_sectors`. Frequencies alone, as in
omega(Omega), Eq. 13 and the growth of free motions, ask of a contact point no more than
that it is a coordinate: the reference points are the tips then, and sectors are
recognised like those of one point a tip.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.reduction.model import MOST_KEPT, Model
from hpcwhirl.reduction.modes import ModalModel, centre_rows
from hpcwhirl.reduction.recognise import equal_sectors
from hpcwhirl.reduction.spin import turned_alike


@lru_cache(maxsize=MOST_KEPT)
def rotor_by_diameter(model: Model) -> ModalModel:
    """Return the rotor of which frequencies are told, by nodal diameter if it can be.

    It is the model's own but for several points a tip, whose sectors are equal to
    `recognise.EQUAL`: of these a cyclic one, with waves if it has a spin.
    """
    own, blades = model.rotor, model.blades
    if own.points is None:
        return own
    single = replace(own, points=None)
    found = turned_alike(equal_sectors(single, blades), single, blades)
    if not found.cyclic or (found.spin is not None and not found.spin.waves):
        return own
    return replace(found, centre_share=_shares(own, found, blades))


def _shares(own: ModalModel, found: ModalModel, blades: int) -> NDArray[np.float64]:
    """Return the shares of the shaft's springs in the modes of `found`, (m,).

    The stiffness of the springs is that which the shares of `own` tell, NaN if unknown.
    """
    moved, others = ((centre_rows(m, blades) ** 2).sum(0) for m in (own, found))
    if not moved.any():
        return np.zeros(len(others))
    top = int(moved.argmax())
    spring = own.centre_share[top] * own.omega[top] ** 2 / moved[top]
    still = others == 0.0
    share = spring * others / np.where(still, 1.0, found.omega**2)
    return np.asarray(np.where(still, 0.0, share))
