"""The modes of each body: bladed disk, from file or sections, and casing."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.reduction.harmonics import harmonic_model
from hpcwhirl.reduction.imported import rotor_from
from hpcwhirl.reduction.mistuned import boundary_of, named_after, whole_model
from hpcwhirl.reduction.modes import (
    SUSPENSION_SHARE,
    ModalModel,
    centre_rows,
    modal_model,
    with_ratio,
)
from hpcwhirl.reduction.round_casing import round_casing
from hpcwhirl.scene import Casing, Rotor
from hpcwhirl.structure import FourierOperator, RingOperator, bladed_disk, ring

__all__ = ["casing_model", "centre_rows", "file_model", "rotor_model", "tip_rows"]

Floats = NDArray[np.float64]
SUPPORT_SHARE = 0.5  # of a mode's strain energy in the foundation: on the support


@lru_cache(maxsize=16)
def rotor_model(rotor: Rotor, eta: int) -> ModalModel:
    """Return the reduced bladed disk (Eq. 1); as a whole where it is mistuned."""
    bare = rotor.model_copy(update={"damping": 0.0, "suspension_damping": 0.0})
    model = replace(_undivided(bare, eta), damping=rotor.damping)
    suspended = model.centre_share > SUSPENSION_SHARE
    return with_ratio(model, suspended, rotor.suspension_damping)


@lru_cache(maxsize=16)
def _undivided(rotor: Rotor, eta: int) -> ModalModel:
    """Return the reduced bladed disk; its modes are those of any damping."""
    disk = bladed_disk(rotor)
    if not rotor.mistuning:
        return modal_model(disk, rotor.damping, eta)
    model = whole_model(disk, rotor.damping, eta)
    most = len(disk.mass) - len(boundary_of(disk))
    tuned = rotor.model_copy(update={"mistuning": ()})
    # one mode more: none is left unnamed where eta splits a pair of the tuned rotor
    return named_after(model, rotor_model(tuned, min(eta + 1, most)), rotor.blades)


@lru_cache(maxsize=16)
def file_model(
    file: str, content: str, rotor: Rotor, eta: int | None = None
) -> ModalModel:
    """Return the rotor of a file; its content is part of the cache's key.

    Parameters
    ----------
    file, content : HDF5, and the digest of what it holds
    rotor : N, and the damping of a file that has none
    eta : fixed-interface modes kept of matrices; None: all that there are
    """
    del content  # with it in the cache's key, a changed file is read again
    ratios = rotor.damping, rotor.suspension_damping
    return rotor_from(file, rotor.blades, *ratios, eta)


@lru_cache(maxsize=32)
def casing_model(
    casing: Casing, radius: float, source: tuple[str, str] = ("", "")
) -> tuple[ModalModel, RingOperator | FourierOperator]:
    """Return the ring, not reduced, and its contact operator.

    source : engine's file and digest of its content, of a casing that is from there
    """
    operator: RingOperator | FourierOperator
    if casing.discretization == "file":
        return round_casing(casing, radius, source)
    if casing.discretization == "fourier":
        model, operator = harmonic_model(casing, radius)
    else:
        structure, operator = ring(casing, radius)
        model = modal_model(structure, casing.damping)
    # The foundation holds omega_c1^2 / omega^2 of the strain energy of a mode.
    carried = model.omega**2 < casing.support_frequency**2 / SUPPORT_SHARE
    return with_ratio(model, carried, casing.support_damping), operator


def tip_rows(model: ModalModel, blades: int) -> tuple[Floats, Floats]:
    """Return (radial, tangential) modal tip shapes, each (N, m)."""
    return model.shapes[0 : 2 * blades : 2], model.shapes[1 : 2 * blades : 2]
