"""A rotor from an engine's file: reduced matrices, or modes, of N tips and a centre.

The file is an HDF5 file in the layout of `hpcwhirl export-model`. Coordinates of its
matrices may have any order; arrays of indices in the file say which are those of the
tips and the centre. Everything is checked before it is used.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from scipy.linalg import LinAlgError, eigh

from hpcwhirl.arrays import Floats, Integers
from hpcwhirl.reduction import modes
from hpcwhirl.reduction.cyclic_coordinates import aligned
from hpcwhirl.reduction.mistuned import modes_of, named_modes
from hpcwhirl.reduction.points import (
    points_in,
    reordered,
    stress_of,
    tip_points,
    with_single_points,
)
from hpcwhirl.reduction.recognise import EQUAL, equal_sectors
from hpcwhirl.reduction.spin import (
    check_terms,
    check_translation,
    checked,
    spin_of,
    standing_damping,
    transformed,
    turned_alike,
)
from hpcwhirl.reduction.supports import MisplacedError, Support, shaft_stiffness
from hpcwhirl.store.models.engine_file import Given, read_group

MODAL = 1e-6  # largest error of orthonormality, and off-diagonal of Phi^T D Phi
EXACT = 1e-9  # largest error of modes and frequencies of a file that are kept unchanged
LEAST = 1e-15  # an eigensolver's error of omega^2, relative to m times the largest
ROUND_OFF = 1e-6  # smallest damping by which errors are divided, over the largest one
TINY = 1e-300
ROWS = {  # {array of modal motion in a file: array with its coordinates' indices}
    "modal_tip_radial": "tip_radial",
    "modal_tip_tangential": "tip_tangential",
    "modal_centre": "centre",
}
SEMIDEFINITE = 1e-9  # negative eigenvalue that counts as 0, relative to the largest
UNSEEN = 1e-9  # motion of the centre that counts as 0, relative to the largest of all


def rotor_from(
    file: str,
    blades: int,
    damping: float,
    suspension: float = -1.0,
    eta: int | None = None,
    *,
    turns: bool = False,
) -> modes.ModalModel:
    """Return the rotor of an engine's file, in cyclic form if its sectors are equal.

    Parameters
    ----------
    file : path of an HDF5 file in the layout of `export-model`
    blades : N of the scene; the file's must be the same
    damping : modal damping ratio xi, used if the file has none
    suspension : xi of the suspension modes if the file has no damping and these modes
        are identified; negative: as the other modes
    eta : number of lowest fixed-interface modes kept of a file with matrices, without
        splitting a pair; None: all. Of a file without matrices all modes are kept
    turns : whether to include the terms of rotation; then the excess of `suspension`
        over `damping` is a damper in the static frame
    """
    given = with_single_points(read_group(file, "rotor"))
    _check_modal_rows(given)
    _check_given_ratios(given)
    if turns or "mass" in given or "stiffness" in given:
        model = _from_matrices(given, blades, damping, eta, turns=turns)
    else:
        model = _from_modes(given, blades, damping)
    if (
        model.points is None
    ):  # for several points a tip see `dynamics.waves.point_sectors`
        model = turned_alike(equal_sectors(model, blades), model, blades)
    model = _with_shaft(given, model, blades)
    if "damping" in given or "damping_ratio" in given:
        return model
    if model.spin is None:
        return modes.with_ratio(
            model, model.centre_share > modes.SUSPENSION_SHARE, suspension
        )
    own = model.spin.support.at(0.0).damping
    own += standing_damping(model, blades, damping, suspension)
    return replace(model, spin=replace(model.spin, support=Support(damping=own)))


def _from_matrices(
    given: Given, blades: int, damping: float | Floats, eta: int | None, *, turns: bool
) -> modes.ModalModel:
    if turns:
        check_terms(given)
    _check_shapes(given)
    places, others = _places(given, blades)
    held = np.r_[places, others]
    rest = np.setdiff1d(np.arange(len(given["mass"])), held)
    order = np.r_[held, rest]
    whole = [
        checked(given, name)[np.ix_(order, order)]
        for name in ("mass", "stiffness", "damping")
        if name in given or name != "damping"
    ]
    spin = transformed(spin_of(given), np.eye(len(order))[:, order]) if turns else None
    stress = stress_of(given, blades)
    if stress is not None:
        stress = replace(stress, rows=stress.rows[..., order])
    reach = math.inf
    if eta is not None and eta < len(rest):
        basis = _basis(given, whole, spin, len(held), eta)
        if basis.shape[1] < len(order):
            whole, spin, reach = _reduced(whole, spin, basis, len(held) + eta)
            stress = stress and stress.of(basis)
    omega, shapes, ratios = _modes_and_ratios(given, whole, order, blades, damping)
    kept = len(whole[0]) - len(places)
    matrices = whole[0], whole[1]
    model = named_modes(matrices, shapes, omega, blades, ratios, kept=kept)
    points = tip_points(given, blades, len(places))
    return replace(model, spin=spin, reach=reach, points=points, stress=stress)


def _modes_and_ratios(
    given: Given,
    whole: list[Floats],
    order: Integers,
    blades: int,
    damping: float | Floats,
) -> tuple[Floats, Floats, float | Floats]:
    """Return frequencies, rad/s, (m,), shapes (n, m), damping ratios of a file's rotor.

    Parameters
    ----------
    given : arrays of the engine's file
    whole : M, K and, if the file has it, the damping matrix, checked: in the
        coordinates that `order` lists, or reduced to fewer coordinates
    order : (n,), index in the file of each coordinate, tips and centre first
    damping : modal damping ratios that are used if the file has none
    """
    mass, stiffness = whole[:2]
    omega, shapes = _checked_modes(given, mass, stiffness)
    shapes, ratios = aligned(shapes, omega, blades), damping
    as_given = len(mass) == len(order) and _has_all_modes(given)
    if as_given:
        omega, shapes = given["omega"], given["shapes"][order]
    if as_given and "damping_ratio" in given:
        ratios = given["damping_ratio"]
    elif "damping" in given:
        modal = shapes.T @ whole[2] @ shapes
        if len(mass) < len(order):  # of a truncated model damping may couple modes
            modal = np.diag(np.diag(modal))
        ratios = _ratios(given, modal, omega)
    return omega, shapes, ratios


def _reduced(
    whole: list[Floats], spin: modes.Spin | None, basis: Floats, count: int
) -> tuple[list[Floats], modes.Spin | None, float]:
    """Return a rotor's matrices and terms of rotation in the coordinates of a basis.

    The third result is the highest natural frequency of the basis at rest, rad/s;
    infinite without terms of rotation.

    whole : M, K and, if given, the damping matrix, (n, n)
    spin : terms of rotation, or None
    basis : (n, m), a shape in each column
    count : number of leading columns that form the basis at rest; may exceed m
    """
    parts = [basis.T @ matrix @ basis for matrix in whole]
    whole = [(part + part.T) / 2 for part in parts]
    if spin is None:
        return whole, None, math.inf
    highest = modes.highest_of(whole[0], whole[1], min(count, basis.shape[1]))
    return whole, transformed(spin, basis), highest


def _has_all_modes(given: Given) -> bool:
    """Return whether a file has all modes of its matrices, correct to round-off.

    They are then used unchanged, so that an exported rotor is read back bit for bit.
    """
    if "shapes" not in given or given["shapes"].shape != given["mass"].shape:
        return False
    shapes, omega = given["shapes"], given["omega"]
    unit = shapes.T @ given["mass"] @ shapes - np.eye(len(omega))
    strain = np.abs(shapes.T @ given["stiffness"] @ shapes - np.diag(omega**2))
    allowed = EXACT * np.outer(omega, omega) + LEAST * len(omega) * omega.max() ** 2
    return bool(
        (np.diff(omega) >= 0.0).all()
        and np.abs(unit).max() <= EXACT
        and (strain <= allowed).all()
    )


def _basis(
    given: Given, whole: list[Floats], spin: modes.Spin | None, places: int, eta: int
) -> Floats:
    """Return the Craig-Bampton basis (n, b + m) of a rotor from file, to reduce it.

    m is eta, or less if that would split modes of close frequencies, and more with
    terms of rotation, so that the basis serves all speeds.

    Parameters
    ----------
    given : the file, for messages
    whole : M, K (and damping) (n, n), tips and centre first
    spin : terms of rotation in these coordinates, or None
    places : b, number of coordinates of tips and centre, which are kept
    eta : number of fixed-interface modes asked for
    """
    mass, stiffness, taut = whole[0], whole[1], None
    inner = slice(places, None)
    try:
        squared = eigh(stiffness[inner, inner], mass[inner, inner], eigvals_only=True)
        while eta > 0 and squared[eta] - squared[eta - 1] <= 2 * EQUAL * squared[eta]:
            eta -= 1
        if spin is not None:
            taut = stiffness + modes.stiffening_at(
                spin, modes.speed_of_basis(mass, stiffness)
            )
        kept = np.arange(places), eta
        return np.asarray(modes.reduction_basis(mass, stiffness, kept, taut))
    except LinAlgError:
        raise given.wrong(
            "stiffness",
            "be positive definite with tips and centre fixed, to reduce the modes",
            "a singular one",
        ) from None


def _from_modes(given: Given, blades: int, damping: float | Floats) -> modes.ModalModel:
    stress_of(given, blades)  # refuses stress, which needs the coordinates of matrices
    omega = given["omega"]
    if len(omega) == 0 or not omega.min() >= 0 or not omega.max() > 0:
        raise given.wrong("omega", "be >= 0 rad/s and not all 0", omega[:3])
    if "damping" in given:
        raise given.refusal("has rotor/damping without rotor/mass and rotor/stiffness")
    radial = given["modal_tip_radial"]
    _check_blades(given, "modal_tip_radial", blades)
    count = points_in(given)
    size = (blades, len(omega)) if count == 1 else (blades, count, len(omega))
    _check_size(given, "modal_tip_radial", size)
    _check_size(given, "modal_tip_tangential", size)
    tips = np.stack([radial, given["modal_tip_tangential"]], axis=-2)
    shapes, others = reordered(tips.reshape(blades, count, 2, -1))
    if "modal_centre" in given:
        _check_size(given, "modal_centre", (2, len(omega)))
        shapes = np.vstack([shapes, given["modal_centre"]])
    points = tip_points(given, blades, len(shapes))
    shapes = np.vstack([shapes, others])
    order = np.argsort(omega, kind="stable")
    shapes, ratios = np.ascontiguousarray(shapes[:, order]), damping
    if "damping_ratio" in given:  # ratios belong to these modes, not to combinations
        ratios = given["damping_ratio"][order]
    else:
        shapes = aligned(shapes, omega[order], blades)
    none = np.zeros((0, 0)), np.zeros((0, 0))
    kept = len(others)
    model = named_modes(none, shapes, omega[order], blades, ratios, kept=kept)
    return replace(model, points=points)


def _with_shaft(given: Given, model: modes.ModalModel, blades: int) -> modes.ModalModel:
    """Return a rotor from file with each mode's share of energy in the shaft's springs.

    Shares of strain energy follow from the shaft's stiffness, which is identified from
    the modes; if that is impossible, the share of modes that move the centre is NaN.

    given, blades : the file, for messages; N
    """
    hub = modes.centre_rows(model, blades)
    tips = model.shapes[: 2 * blades].reshape(blades, 2, -1)
    points = model.points
    first = 0.0 if points is None else float(points.angle[points.reference])
    try:
        spring = shaft_stiffness(tips, hub, model.omega, first)
    except MisplacedError as found:
        raise given.refusal(
            "has a rotor whose rigid translation moves its tips as if they were "
            f"{found}; they must be counted anticlockwise, blade 0 at 0 degrees, "
            "tangential motion positive with the angle, radial motion outward"
        ) from None
    if spring is not None:
        check_translation(given, model, blades, spring)
    moved = (hub**2).sum(axis=0)
    if spring is None:
        unknown = moved > UNSEEN**2 * max(float((model.shapes**2).max()), TINY)
        share = np.where(unknown, np.nan, 0.0)
    else:
        share = spring * moved / np.maximum(model.omega**2, TINY)
    return replace(model, centre_share=share)


def _check_size(given: Given, name: str, size: tuple[int, ...]) -> None:
    if given[name].shape != size:
        raise given.wrong(name, f"be {size}", given[name].shape)


def _check_blades(given: Given, name: str, blades: int) -> None:
    if len(given[name]) != blades:
        raise given.refusal(
            f"has {len(given[name])} blades (rows of rotor/{name}), "
            f"engine.rotor.blades is {blades}: they must be equal"
        )


def _check_shapes(given: Given) -> None:
    """Raise InputError if a file's matrices are not square or not of one size."""
    count = len(given["mass"])
    for name in ("mass", "stiffness", "damping"):
        if name != "damping" or name in given:
            _check_size(given, name, (count, count))
    if "shapes" in given:
        _check_size(given, "shapes", (count, len(given["omega"])))


def _places(given: Given, blades: int) -> tuple[Integers, Integers]:
    """Return where a file's matrices have the coordinates of tips, centre and points.

    The first array has the indices of the radial and tangential coordinate of the
    reference point of blade 0, 1, ..., then of x_o and y_o, if any; the second those of
    all other contact points, blade by blade.
    """
    count, both = len(given["mass"]), ("tip_radial", "tip_tangential")
    for name in both:
        _check_blades(given, name, blades)
        _check_size(given, name, given[both[0]].shape)
    tips = np.stack([given[name] for name in both], axis=-1)
    own, others = reordered(tips.reshape(blades, -1, 2))
    centre = given["centre"] if "centre" in given else np.zeros(0, dtype=np.int64)
    if len(centre) not in {0, 2}:
        raise given.wrong("centre", "name 0 or 2 coordinates", len(centre))
    for name in (*both, "centre"):
        indices = centre if name == "centre" else given[name]
        wrong = indices[(indices < 0) | (indices >= count)]
        if len(wrong):
            raise given.wrong(name, f"be indices 0 to {count - 1}", wrong[0])
    places = np.asarray(np.r_[own, centre], dtype=np.int64)
    values, times = np.unique(np.r_[places, others], return_counts=True)
    if times.max() > 1:
        twice = values[times > 1][0]
        raise given.refusal(f"names coordinate {twice} twice among tips and centre")
    return places, np.asarray(others, dtype=np.int64)


def _checked_modes(
    given: Given, mass: Floats, stiffness: Floats
) -> tuple[Floats, Floats]:
    """Return frequencies, rad/s, (n,), and mode shapes (n, n) of a file's matrices.

    Raise InputError for matrices that are indefinite.

    mass, stiffness : M, K (n, n), in the order of the model's coordinates
    """
    lowest, highest = np.linalg.eigvalsh(mass)[[0, -1]]
    if not lowest > len(mass) * np.finfo(float).eps * highest:
        raise given.wrong("mass", "be positive definite", f"eigenvalue {lowest:.2g}")
    try:
        omega, shapes = modes_of(mass, stiffness)
    except LinAlgError:
        raise given.wrong("mass", "be positive definite", "a singular one") from None
    squared = np.einsum("im,ij,jm->m", shapes, stiffness, shapes, optimize=True)
    if not squared.max() > 0:
        raise given.wrong("stiffness", "have a positive eigenvalue", squared.max())
    if not squared.min() >= -SEMIDEFINITE * squared.max():
        value = f"omega^2 = {squared.min():.3g}"
        raise given.wrong("stiffness", "be positive semidefinite", value)
    if "shapes" in given:
        _check_given_shapes(given)
    return omega, shapes


def _check_given_shapes(given: Given) -> None:
    """Raise InputError if mode shapes and omega in a file do not fit its matrices."""
    shapes, omega = given["shapes"], given["omega"]
    unit = shapes.T @ given["mass"] @ shapes
    miss = np.abs(unit - np.eye(len(omega))).max()
    if not miss <= MODAL:
        allowed = f"be mass-orthonormal to {MODAL:g}"
        raise given.wrong("shapes", allowed, f"{miss:.2g}")
    strain = shapes.T @ given["stiffness"] @ shapes - np.diag(omega**2)
    miss = np.abs(strain).max() / max(float(omega.max()) ** 2, TINY)
    if not miss <= MODAL:
        allowed = f"be the frequencies of rotor/shapes to {MODAL:g} of the highest"
        raise given.wrong("omega", allowed, f"{miss:.2g}")


def _check_modal_rows(given: Given) -> None:
    """Raise InputError if modal motions of tips and centre differ from full shapes.

    A file may have both: modal_tip_radial, modal_tip_tangential, modal_centre; and
    shapes of all coordinates. A file with matrices and modal motions, but no full
    shapes, is refused: the motions could not be compared and would be ignored.
    """
    modal = [name for name in ("omega", *ROWS, "damping_ratio") if name in given]
    if "shapes" in given:
        for name in ROWS.keys() & set(modal):
            _check_rows(given, name)
    elif modal and ("mass" in given or "stiffness" in given):
        raise given.refusal(
            f"has rotor/{modal[0]} beside matrices without rotor/shapes, so that they "
            "cannot be compared: leave it out"
        )


def _check_rows(given: Given, name: str) -> None:
    """Raise InputError if an array of modal motion differs from its part of the shapes.

    The part is the rows of rotor/shapes in the file that belong to the same
    coordinates. The modal motion of a clamped centre must be 0.

    name : array to check, such as "modal_centre", a key of `ROWS`
    """
    shapes, places = given["shapes"], ROWS[name]
    if places not in given and "mass" not in given:
        return  # a file with modes only needs no index maps
    rows = np.asarray(given.arrays.get(places, ()), dtype=np.int64)
    if len(rows) and not 0 <= rows.min() <= rows.max() < len(shapes):
        allowed = f"be indices 0 to {len(shapes) - 1}"
        raise given.wrong(places, allowed, rows[(rows < 0) | (rows >= len(shapes))][0])
    expected = shapes[rows] if len(rows) else np.zeros((2, shapes.shape[1]))
    _check_size(given, name, expected.shape)
    miss = np.abs(given[name] - expected).max(initial=0.0)
    if not miss <= MODAL * max(np.abs(expected).max(initial=0.0), TINY):
        allowed = f"be the rows rotor/{places} of rotor/shapes to {MODAL:g}"
        raise given.wrong(name, allowed, f"a difference of {miss:.2g}")


def _check_given_ratios(given: Given) -> None:
    """Raise InputError if a file's damping ratios are wrong.

    They must be >= 0 and equal to those of its damping matrix, if there is one.
    """
    if "damping_ratio" not in given:
        return
    ratios, omega = given["damping_ratio"], given["omega"]
    _check_size(given, "damping_ratio", omega.shape)
    if not ratios.min(initial=0.0) >= 0.0:
        raise given.wrong("damping_ratio", "be >= 0", ratios.min())
    if "shapes" not in given or "mass" not in given:
        return
    if "damping" not in given:
        raise given.refusal(
            "has rotor/damping_ratio beside matrices: rotor/damping must be there, too"
        )
    _check_shapes(given)
    rates = np.einsum("im,ij,jm->m", s := given["shapes"], given["damping"], s)
    miss = np.abs(rates - 2 * ratios * omega).max() / max(np.abs(rates).max(), TINY)
    if not miss <= MODAL:
        allowed = f"be those of rotor/damping to {MODAL:g} of the largest"
        raise given.wrong("damping_ratio", allowed, f"{miss:.2g}")


def _ratios(given: Given, modal: Floats, omega: Floats) -> Floats:
    """Return the damping ratio of each mode, (m,), from the modal damping matrix.

    Raise InputError if that matrix is not diagonal or has negative entries.

    modal, omega : Phi^T D Phi, (m, m), D being the file's damping matrix; (m,), rad/s
    """
    rates = np.diag(modal)
    most = max(float(np.abs(modal).max()), TINY)
    if not rates.min() >= -MODAL * most:
        raise given.wrong("damping", "be positive semidefinite", f"{rates.min():.3g}")
    scale = np.sqrt(np.maximum(rates, ROUND_OFF * most))
    miss = np.abs((modal - np.diag(rates)) / np.outer(scale, scale)).max()
    if not miss <= MODAL:
        allowed = f"be modal (Phi^T D Phi diagonal to {MODAL:g})"
        raise given.wrong("damping", allowed, f"{miss:.2g}")
    still = omega == 0.0
    if (rates[still] > MODAL * most).any():
        allowed = "leave modes without stiffness undamped"
        raise given.wrong("damping", allowed, f"{rates[still].max():.3g}")
    ratios = np.maximum(rates, 0.0) / np.where(still, 1.0, 2 * omega)
    return np.asarray(np.where(still, 0.0, ratios))
