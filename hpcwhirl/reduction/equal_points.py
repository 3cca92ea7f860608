"""Nodal diameters of a rotor with several contact points per tip, for its frequencies.

The time integration has waves of its own, see `dynamics.point_sectors`. Natural
frequencies, Eq. 13 and the growth of free motions do not depend on contact: here only
the reference points count as tips, so that equal sectors are recognised as for a rotor
with one point per tip.
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
    """Return the rotor for frequencies, with modes by nodal diameter where possible.

    It is the model's rotor unchanged, unless tips have several points and sectors are
    equal within `recognise.EQUAL`: then modes have nodal diameters and, with terms of
    rotation, waves.
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
    """Return the share of strain energy in the shaft's springs in each mode, (m,).

    The modes are those of `found`. The springs' stiffness follows from the shares of
    `own`; the result is NaN if those are unknown.
    """
    moved, others = ((centre_rows(m, blades) ** 2).sum(0) for m in (own, found))
    if not moved.any():
        return np.zeros(len(others))
    top = int(moved.argmax())
    spring = own.centre_share[top] * own.omega[top] ** 2 / moved[top]
    still = others == 0.0
    share = spring * others / np.where(still, 1.0, found.omega**2)
    return np.asarray(np.where(still, 0.0, share))
