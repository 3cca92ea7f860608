"""The model of one of g sectors that move alike: N / g blades on a folded circle.

A rotor of N equal blades at rest, a round ring at rest and a load on k lobes are
unchanged by a rotation of 2 pi / g, g = gcd(k, N); so is every later motion. Only nodal
diameters and harmonics h = g h' ever move. In the angle g theta they are h' = h / g of
N / g blades that turn with g Omega under a load on k / g lobes, and this model carries
1 / g of the energy: amplitudes of mass-orthonormal modes are y / sqrt(g), their shapes
sqrt(g) times those of the whole, and the modal force is F / g. Displacements, gaps and
multipliers are the same numbers; energies, works and impulses count g times. Terms of
rotation are those of Omega, not of g Omega: C / g, K_1 / g^2 and K_2 / g^4.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.arrays import Floats
from hpcwhirl.errors import ModelError
from hpcwhirl.reduction.model import Model
from hpcwhirl.reduction.modes import ModalModel, Spin, SpinBlock
from hpcwhirl.reduction.supports import ROUND
from hpcwhirl.scene import Scene
from hpcwhirl.scene.kept_tables import scaled
from hpcwhirl.structure import FourierOperator

NONE = np.zeros((0, 0))
MOST_KEPT = 32  # number of cached models of one sector


def folded_body(
    body: ModalModel, rows: NDArray[np.intp], folds: int
) -> tuple[ModalModel, Floats]:
    """Return the modes of one sector, and the matrix from them to the whole body.

    Parameters
    ----------
    body : modes of the whole body
    rows : indices of its coordinates that belong to the sector
    folds : g, number of sectors

    Returns
    -------
    body : the modes of nodal diameters or harmonics h that g divides, labelled h / g;
        without mass and stiffness matrices
    lift : (n, m), displacements of the whole body from the sector's amplitudes
    """
    modes = np.flatnonzero(body.diameter % folds == 0)
    lift = np.ascontiguousarray(math.sqrt(folds) * body.shapes[:, modes])
    one_of_many = replace(
        body,
        mass=NONE,
        stiffness=NONE,
        shapes=np.ascontiguousarray(lift[rows]),
        omega=body.omega[modes],
        diameter=body.diameter[modes] // folds,
        rank=body.rank[modes],
        phase=body.phase[modes],
        centre_share=body.centre_share[modes],
        damping=body.ratios[modes],
        kept=0,
        spin=body.spin and _folded_spin(body.spin, folds),
    )
    return one_of_many, lift


def _folded_spin(spin: Spin, folds: int) -> Spin:
    """Return the terms of rotation of one of g = `folds` sectors, by nodal diameter.

    They have no matrices of the whole rotor and no supports, since the centre is at
    rest.
    """
    waves = tuple(_folded(own, folds) for own in spin.waves if own.k % folds == 0)
    return Spin(NONE, NONE, np.zeros(0), waves=waves, support=ROUND)


def _folded(own: SpinBlock, folds: int) -> SpinBlock:
    return replace(
        own,
        k=own.k // folds,
        coriolis=own.coriolis / folds,
        stiffening=own.stiffening / folds**2,
        quartic=None if own.quartic is None else own.quartic / folds**4,
    )


def _coordinates(operator: FourierOperator, folds: int) -> NDArray[np.intp]:
    """Return indices of the coordinates of those harmonics of a ring that g divides.

    The radial ones come first, then the tangential ones; folds : g
    """
    harmonics = folds * np.arange(1, operator.harmonics // folds + 1)
    pairs = np.column_stack([2 * harmonics - 1, 2 * harmonics]).ravel()
    radial = np.concatenate([[0], pairs])
    return np.concatenate([radial, operator.width + radial]).astype(np.intp)


@lru_cache(maxsize=MOST_KEPT)
def folded_model(whole: Model, folds: int) -> Model:
    """Return the model of one of g = `folds` sectors, without the centre, which rests.

    Raises
    ------
    ModelError
        if the whole model has no such symmetry
    """
    foreign = whole.ring is not None and not isinstance(whole.ring, FourierOperator)
    if whole.blades % folds or foreign or not whole.rotor.cyclic or folds < 2:
        msg = f"{whole.blades} blades and their casing do not fold {folds} times"
        raise ModelError(msg)
    blades = whole.blades // folds
    rotor, lift = folded_body(whole.rotor, np.arange(2 * blades), folds)
    model = replace(whole, rotor=rotor, blades=blades, folds=folds, lifts=(lift, NONE))
    if whole.casing is None or not isinstance(whole.ring, FourierOperator):
        return model
    casing, ring_lift = folded_body(
        whole.casing, _coordinates(whole.ring, folds), folds
    )
    ring = FourierOperator(whole.ring.harmonics // folds, whole.ring.radius)
    return replace(model, casing=casing, ring=ring, lifts=(lift, ring_lift))


def folded_scene(scene: Scene, folds: int) -> Scene:
    """Return the scene of one of g = `folds` sectors, which turns at g Omega.

    Its load has k / g lobes and the force F / g, its friction is the coefficient at
    Omega. Its engine is still that of the whole model; only the radius is used.
    """
    return scene.model_copy(
        update={
            "speed": folds * scene.speed,
            "acceleration": folds * scene.acceleration,
            "speed_to": folds * scene.speed_to,
            "speed_table": scaled(scene.speed_table, folds),
            "nodal_diameter": scene.nodal_diameter // folds,
            "force": scene.force / folds,
            "friction": scene.coefficient,
            "friction_law": "constant",
            "duration": scene.end_time,
            "revolutions": 0.0,
        }
    )
