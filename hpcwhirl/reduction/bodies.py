"""Modal models of both bodies: bladed disk (from dimensions or a file) and casing.

They are cached, so that the cases of a campaign with one engine share them.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np

from hpcwhirl.arrays import Floats
from hpcwhirl.reduction.craig_bampton import craig_bampton, rough_modes
from hpcwhirl.reduction.imported import rotor_from
from hpcwhirl.reduction.mistuned import (
    basis_of,
    boundary_of,
    named_after,
    whole_model,
)
from hpcwhirl.reduction.modes import (
    SUSPENSION_SHARE,
    ModalModel,
    centre_rows,
    modal_model,
    whole_basis,
    with_ratio,
)
from hpcwhirl.reduction.round_casing import (
    at_station,
    harmonic_model,
    round_casing,
    shell_model,
)
from hpcwhirl.reduction.spin import standing_damping, with_blocks
from hpcwhirl.reduction.supports import Support, bearing_of
from hpcwhirl.scene import Casing, Rotor
from hpcwhirl.scene.kept_tables import kept_rows
from hpcwhirl.scene.rules import NO_BLADE
from hpcwhirl.structure import (
    CyclicStructure,
    FourierOperator,
    RingOperator,
    bladed_disk,
    ring,
    rotation_of,
    small_damping,
)

__all__ = [
    "casing_model",
    "centre_rows",
    "contact_rows",
    "file_model",
    "rotor_model",
    "tip_rows",
]

OF_SUPPORTS = (
    "damping",
    "suspension_damping",
    "cross_coupling",
    "stiffness_difference",
    "damping_difference",
    "film_viscosity",
    "film_length",
    "film_radius",
    "film_clearance",
    "stop_clearance",
    "stop_friction",
)  # inputs of dampers and bearings, which leave a rotor's M and K unchanged
WHOLE = {"lost_blade": NO_BLADE}  # input of a rotor that has all its blades
SPARSE = 4  # interior DoF per wanted mode beyond which sparse matrices are faster
SUPPORT_SHARE = 0.5  # least share of a support mode's strain energy in the foundation


@lru_cache(maxsize=16)
def rotor_model(rotor: Rotor, eta: int, rotation: str = "none") -> ModalModel:
    """Return the bladed disk of a scene reduced to modes (Eq. 1 of the paper).

    A mistuned disk is reduced as a whole, others by nodal diameters. With `rotation`
    "full" the model includes the terms of rotation, in a basis for all speeds, and the
    excess of `suspension_damping` over `damping` is a damper in the static frame.

    rotor : inputs of the rotor
    eta : number of fixed-interface modes kept
    """
    usual = {**dict.fromkeys(OF_SUPPORTS, 0.0), "bearing": ""}
    bare = rotor.model_copy(update=usual)
    model = replace(_undivided(bare, eta, rotation), damping=rotor.damping)
    suspended = model.centre_share > SUSPENSION_SHARE
    if model.spin is None:
        return with_ratio(model, suspended, rotor.suspension_damping)
    if rotor.bearing:
        return _borne(model, rotor)
    if rotor.has_line:  # its supports have dampers of their own
        return _supported(model, rotor, 0.0)
    ratios, same = (rotor.damping, rotor.suspension_damping), model
    if rotor.lost_blade != NO_BLADE:  # the damper stays as it is
        same = _undivided(bare.model_copy(update=WHOLE), eta, rotation)
        same = replace(same, damping=rotor.damping)
    return _supported(model, rotor, standing_damping(same, rotor.blades, *ratios))


def _borne(model: ModalModel, rotor: Rotor) -> ModalModel:
    """Return a rotor's model on the bearing of its table in place of the springs k_o.

    The springs, which are in the rotor's stiffness, are not in its damping, either: the
    rotor is damped as one that nothing holds.
    """
    own = bearing_of(kept_rows(rotor.bearing), rotor.centre_stiffness)
    held = math.sqrt(own.spring) * centre_rows(model, rotor.blades)
    return replace(model, unheld=held, spin=replace(model.terms, support=own))


def _supported(model: ModalModel, rotor: Rotor, damping: float) -> ModalModel:
    """Return a rotor's model with the springs and dampers of its centre, static frame.

    They follow from the inputs of supports in `rotor`, such as `cross_coupling`, the
    squeeze film and a stop. A model without terms of rotation is returned unchanged.

    damping : N s/m, mean c of the dampers, squeeze film excluded
    """
    if model.spin is None:
        return model
    clearance = rotor.film_clearance
    film = small_damping(
        rotor.film_viscosity, rotor.film_length, rotor.film_radius, clearance
    )
    support = Support(
        stiffness=-1j * rotor.cross_coupling,
        damping=damping + film + 0j,
        stiffness_apart=rotor.stiffness_difference + 0j,
        damping_apart=rotor.damping_difference + 0j,
        film=film,
        clearance=clearance if film else 0.0,
        stop=rotor.stop_clearance,
        rub=rotor.stop_friction,
    )
    return replace(model, spin=replace(model.spin, support=support))


@lru_cache(maxsize=16)
def _undivided(rotor: Rotor, eta: int, rotation: str) -> ModalModel:
    """Return the reduced bladed disk, on which supports are not yet set; cached.

    Scenes that differ only in supports or damping share it.

    eta, rotation : number of fixed-interface modes; "none" or "full"
    """
    disk = bladed_disk(rotor)
    added = rotation_of(rotor) if rotation == "full" else None
    if rotor.lost_blade != NO_BLADE:
        return _with_loss(rotor, eta, rotation)
    if not rotor.is_uneven:
        model = with_blocks(modal_model(disk, rotor.damping, eta, added), rotor.blades)
        if added is None:
            return model
        rest = _undivided(rotor, eta, "none")
        return replace(model, reach=float(rest.omega.max()))
    model = whole_model(disk, rotor.damping, eta, added, _near(rotor, disk, eta))
    return _named(model, rotor, eta)


def _near(rotor: Rotor, disk: CyclicStructure, eta: int) -> Floats | None:
    """Return modes from which those of a mistuned rotor are iterated, or None.

    None where an eigensolver of dense matrices is quicker. disk : the bladed disk
    """
    most = len(disk.mass) - len(boundary_of(disk))
    if SPARSE * (eta + rotor.blades) >= most:
        return None
    tuned = rotor.model_copy(update={"mistuning": ()})
    return _held_modes(tuned, eta + rotor.blades)


def _named(model: ModalModel, rotor: Rotor, eta: int) -> ModalModel:
    """Return a rotor of unequal sectors with modes named after those of a tuned one."""
    tuned = rotor.model_copy(update={"mistuning": ()} | WHOLE)
    disk = bladed_disk(tuned)
    most = len(disk.mass) - len(boundary_of(disk))
    # one mode more, as eta may split a pair of the tuned rotor, which is used for
    # labels
    return named_after(model, _tuned_model(tuned, eta + 1, most, model), rotor.blades)


def _with_loss(rotor: Rotor, eta: int, rotation: str) -> ModalModel:
    """Return the bladed disk that has lost a blade, in the basis of the whole one.

    So a run in which the blade is lost continues with the displacements and velocities
    that it has. The coordinates are changed inside: as those of a Craig-Bampton
    reduction they depend little on the share of the blade that is left.

    rotor, eta, rotation : as in `_undivided`
    """
    own = rotor.model_copy(update=WHOLE)
    whole, disk = _undivided(own, eta, rotation), bladed_disk(rotor)
    added = rotation_of(rotor) if rotation == "full" else None
    tilt = np.array(whole.spin.tilt if whole.spin else (), dtype=np.intp)
    others = np.setdiff1d(np.arange(len(whole.mass)), tilt)
    basis = whole_basis_of(own, eta, rotation)[:, others]
    mass, stiffness = (_even(basis.T @ a @ basis) for a in (disk.mass, disk.stiffness))
    kept = np.arange(len(boundary_of(disk)))
    turned, _ = craig_bampton(mass, stiffness, kept, len(others) - len(kept))
    into, size = np.zeros_like(whole.mass), len(others)
    into[others, :size] = turned
    into[tilt, size + np.arange(len(tilt))] = 1.0
    if whole.cyclic:  # whose coordinates of the shaft are x and -y
        into[tilt[1::2], size + 1 + np.arange(0, len(tilt), 2)] = -1.0
    model = whole_model(disk, rotor.damping, eta, added, basis=basis @ turned)
    model = replace(model, reach=whole.reach, into_whole=into)
    return _named(model, rotor, eta)


def _even(matrix: Floats) -> Floats:
    return np.asarray((matrix + matrix.T) / 2)


def whole_basis_of(rotor: Rotor, eta: int, rotation: str) -> Floats:
    """Return displacements of a disk's DoF, (d, n), for unit coordinates of its model.

    rotor, eta, rotation : as in `_undivided`, of a rotor with all its blades
    """
    disk = bladed_disk(rotor)
    added = rotation_of(rotor) if rotation == "full" else None
    if not rotor.is_uneven:
        return whole_basis(disk, eta, added)
    near = _near(rotor, disk, eta)
    return basis_of(disk, boundary_of(disk), eta, added, near)


def swing_at_rest(rotor: Rotor, eta: int) -> Floats:
    """Return the load F_e of a rotor without terms of rotation, (n,), kg m.

    rotor, eta : as for `rotor_model`
    """
    return np.asarray(rotation_of(rotor).swing @ whole_basis_of(rotor, eta, "none"))


@lru_cache(maxsize=4)
def _held_modes(tuned: Rotor, count: int) -> Floats:
    """Return a tuned rotor's approximate lowest fixed-interface modes, (i, count).

    The modes of mistuned rotors are computed from them by iteration. i is the number of
    DoF other than those of tips and centre.

    tuned, count : inputs of the rotor without mistuning; number of modes
    """
    disk = bladed_disk(tuned)
    inner = np.setdiff1d(np.arange(len(disk.mass)), boundary_of(disk))
    within = np.ix_(inner, inner)
    return rough_modes(disk.mass[within], disk.stiffness[within], count)


def _tuned_model(tuned: Rotor, eta: int, most: int, model: ModalModel) -> ModalModel:
    """Return the modal model of a tuned rotor, whose modes give a mistuned one names.

    It has at least as many modes as the mistuned rotor's `model`.

    eta : number of fixed-interface modes; more are taken until this is so
    most : number of all fixed-interface modes
    """
    eta, fewest = min(eta, most), len(model.omega)
    reference = rotor_model(tuned, eta)
    while len(reference.omega) < fewest and eta < most:
        eta = min(eta + tuned.blades, most)
        reference = rotor_model(tuned, eta)
    return reference


@lru_cache(maxsize=16)
def file_model(
    file: str,
    content: str,
    rotor: Rotor,
    eta: int | None = None,
    rotation: str = "none",
) -> ModalModel:
    """Return the modal model of the rotor in an engine's file, cached by its content.

    Parameters
    ----------
    file, content : path of the HDF5 file, and the SHA-256 of its content
    rotor : inputs that give N, and the damping if the file has none
    eta : number of fixed-interface modes kept of a file with matrices; None: all
    rotation : "full" includes the terms of rotation, which the file must have
    """
    del content  # part of the cache's key, so that a changed file is read again
    ratios = rotor.damping, rotor.suspension_damping
    turns = rotation == "full"
    model = rotor_from(file, rotor.blades, *ratios, eta, turns=turns)
    return _supported(
        model, rotor, model.spin.support.at(0.0).damping.real if model.spin else 0.0
    )


@lru_cache(maxsize=32)
def casing_model(
    casing: Casing,
    radius: float,
    source: tuple[str, str] = ("", ""),
    *,
    wide: bool = False,
) -> tuple[ModalModel, RingOperator | FourierOperator]:
    """Return the modes of an elastic casing and its contact operator.

    The operator gives displacements and loads of the casing at angles.

    Parameters
    ----------
    casing : inputs of the casing
    radius : R_c, m
    source : path and SHA-256 of an engine's file with the casing's modes; ("", ""):
        none
    wide : whether modes keep their variation along the axis, which several contact
        points per tip need; else the modes are those in the casing's middle plane
    """
    operator: RingOperator | FourierOperator
    if casing.discretization == "file":
        model, operator = round_casing(casing, radius, source)
        return (model, operator) if wide else at_station(model, operator, 0.0)
    if casing.discretization == "elements":
        structure, operator = ring(casing, radius)
        model = modal_model(structure, casing.damping)
    elif casing.discretization == "shell":
        model, operator = shell_model(casing, radius)
    else:
        model, operator = harmonic_model(casing, radius)
    # The foundation holds omega_c1^2 / omega^2 of the strain energy of a mode.
    carried = model.omega**2 < casing.support_frequency**2 / SUPPORT_SHARE
    model = with_ratio(model, carried, casing.support_damping)
    if wide or isinstance(operator, RingOperator):
        return model, operator
    return at_station(model, operator, 0.0)


def tip_rows(model: ModalModel, blades: int) -> tuple[Floats, Floats]:
    """Return radial and tangential displacement of N tips in m modes, (N, m) each.

    With several contact points per tip they are those of its reference point.

    model, blades : modal model of the rotor, with shapes of unit amplitude; N
    """
    return model.shapes[0 : 2 * blades : 2], model.shapes[1 : 2 * blades : 2]


def contact_rows(model: ModalModel, blades: int) -> tuple[Floats, Floats]:
    """Return radial and tangential displacement of contact points in m modes.

    Returns (N n_c, m) each, blade by blade, with n_c contact points on each of N tips

    model, blades : modal model of the rotor, with shapes of unit amplitude; N
    """
    if model.points is None:
        return tip_rows(model, blades)
    radial, tangential = model.points.radial, model.points.tangential
    return model.shapes[radial.ravel()], model.shapes[tangential.ravel()]
