"""A rotor from elsewhere: reduced matrices, or modes, of N tips and a centre.

Coordinates of the file's matrices may come in any order; index maps say which are the
tips' and the centre's. Everything is checked before it is believed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError

from hpcwhirl.reduction.degenerate import aligned
from hpcwhirl.reduction.mistuned import modes_of, named_modes
from hpcwhirl.reduction.modes import ModalModel
from hpcwhirl.store.engine_file import Given, read_rotor

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
SYMMETRIC = 1e-9  # relative to the largest entry
MODAL = 1e-6  # orthonormality of shapes, off-diagonals of Phi^T D Phi
ROUND_OFF = 1e-6  # of the largest modal damping: the least that one is measured by
TINY = 1e-300
ROWS = {  # modal rows: of which coordinates
    "modal_tip_radial": "tip_radial",
    "modal_tip_tangential": "tip_tangential",
    "modal_centre": "centre",
}
SEMIDEFINITE = 1e-9  # of the largest eigenvalue


def rotor_from(file: str, blades: int, damping: float) -> ModalModel:
    """Return the rotor of an engine's file.

    Parameters
    ----------
    file : HDF5, the layout of `export-model`
    blades : N of the scene, which the file's must be
    damping : modal damping ratio xi where the file has no rotor/damping
    """
    given = read_rotor(file)
    _check_modal_rows(given)
    if "mass" in given or "stiffness" in given:
        return _from_matrices(given, blades, damping)
    return _from_modes(given, blades, damping)


def _from_matrices(given: Given, blades: int, damping: float) -> ModalModel:
    _check_shapes(given)
    places = _places(given, blades)
    rest = np.setdiff1d(np.arange(len(given["mass"])), places)
    order = np.r_[places, rest]
    mass, stiffness = (
        _symmetric(given, name)[np.ix_(order, order)] for name in ("mass", "stiffness")
    )
    omega, shapes = _checked_modes(given, mass, stiffness)
    shapes = aligned(shapes, omega, blades)
    ratios: float | Floats = damping
    if "damping" in given:
        whole = _symmetric(given, "damping")[np.ix_(order, order)]
        ratios = _ratios(given, shapes.T @ whole @ shapes, omega)
    matrices = mass, stiffness
    return named_modes(matrices, shapes, omega, blades, ratios, kept=len(rest))


def _from_modes(given: Given, blades: int, damping: float) -> ModalModel:
    omega = given["omega"]
    if len(omega) == 0 or not omega.min() >= 0 or not omega.max() > 0:
        raise given.wrong("omega", "be >= 0 rad/s and not all 0", omega[:3])
    if "damping" in given:
        raise given.refusal("has rotor/damping without rotor/mass and rotor/stiffness")
    radial = given["modal_tip_radial"]
    _check_blades(given, "modal_tip_radial", blades)
    _check_size(given, "modal_tip_radial", (blades, len(omega)))
    _check_size(given, "modal_tip_tangential", (blades, len(omega)))
    tips = np.stack([radial, given["modal_tip_tangential"]], axis=1)
    shapes = tips.reshape(2 * blades, -1)
    if "modal_centre" in given:
        _check_size(given, "modal_centre", (2, len(omega)))
        shapes = np.vstack([shapes, given["modal_centre"]])
    order = np.argsort(omega, kind="stable")
    shapes = aligned(np.ascontiguousarray(shapes[:, order]), omega[order], blades)
    none = np.zeros((0, 0)), np.zeros((0, 0))
    return named_modes(none, shapes, omega[order], blades, damping, kept=0)


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
    """Check that the matrices are square, and of one size."""
    count = len(given["mass"])
    for name in ("mass", "stiffness", "damping"):
        if name != "damping" or name in given:
            _check_size(given, name, (count, count))
    if "shapes" in given:
        _check_size(given, "shapes", (count, len(given["omega"])))


def _places(given: Given, blades: int) -> Integers:
    """Return the coordinates of tips (radial, tangential of blade 0, ...), centre."""
    count = len(given["mass"])
    for name in ("tip_radial", "tip_tangential"):
        _check_blades(given, name, blades)
    tips = np.column_stack([given["tip_radial"], given["tip_tangential"]]).ravel()
    centre = given["centre"] if "centre" in given else np.zeros(0, dtype=np.int64)
    if len(centre) not in {0, 2}:
        raise given.wrong("centre", "name 0 or 2 coordinates", len(centre))
    for name in ("tip_radial", "tip_tangential", "centre"):
        indices = centre if name == "centre" else given[name]
        wrong = indices[(indices < 0) | (indices >= count)]
        if len(wrong):
            raise given.wrong(name, f"be indices 0 to {count - 1}", wrong[0])
    places = np.asarray(np.r_[tips, centre], dtype=np.int64)
    values, times = np.unique(places, return_counts=True)
    if times.max() > 1:
        twice = values[times > 1][0]
        raise given.refusal(f"names coordinate {twice} twice among tips and centre")
    return places


def _symmetric(given: Given, name: str) -> Floats:
    matrix = given[name]
    miss = np.abs(matrix - matrix.T).max() / max(np.abs(matrix).max(), TINY)
    if not miss <= SYMMETRIC:
        allowed = f"be symmetric to {SYMMETRIC:g} of its largest entry"
        raise given.wrong(name, allowed, f"{miss:.2g}")
    return np.asarray((matrix + matrix.T) / 2)


def _checked_modes(
    given: Given, mass: Floats, stiffness: Floats
) -> tuple[Floats, Floats]:
    """Return (omega (n,), shapes (n, n)) of matrices that are definite."""
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
        told = f"omega^2 = {squared.min():.3g}"
        raise given.wrong("stiffness", "be positive semidefinite", told)
    if "shapes" in given:
        _check_given_shapes(given)
    return omega, shapes


def _check_given_shapes(given: Given) -> None:
    """Check that shapes and omega, where given too, are those of the matrices."""
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
    """Check that modes said twice are the same: of shapes, and where they are met.

    Beside matrices, modes that come without all their shapes cannot be compared, and
    are refused: they would be ignored.
    """
    modal = [name for name in ("omega", *ROWS) if name in given]
    if "shapes" in given:
        for name in ROWS.keys() & set(modal):
            _check_rows(given, name)
    elif modal and ("mass" in given or "stiffness" in given):
        raise given.refusal(
            f"has rotor/{modal[0]} beside matrices without rotor/shapes, so that they "
            "cannot be compared: leave it out"
        )


def _check_rows(given: Given, name: str) -> None:
    """Check modal rows against those of the shapes; a clamped centre has none."""
    shapes, places = given["shapes"], ROWS[name]
    if places not in given and "mass" not in given:
        return  # modes alone say no places
    rows = np.asarray(given.arrays.get(places, ()), dtype=np.int64)
    if len(rows) and not 0 <= rows.min() <= rows.max() < len(shapes):
        allowed = f"be indices 0 to {len(shapes) - 1}"
        raise given.wrong(places, allowed, rows[(rows < 0) | (rows >= len(shapes))][0])
    own = shapes[rows] if len(rows) else np.zeros((2, shapes.shape[1]))
    _check_size(given, name, own.shape)
    miss = np.abs(given[name] - own).max(initial=0.0)
    if not miss <= MODAL * max(np.abs(own).max(initial=0.0), TINY):
        allowed = f"be the rows rotor/{places} of rotor/shapes to {MODAL:g}"
        raise given.wrong(name, allowed, f"a difference of {miss:.2g}")


def _ratios(given: Given, modal: Floats, omega: Floats) -> Floats:
    """Return the damping ratios (m,) of Phi^T D Phi (m, m), which must be diagonal."""
    own = np.diag(modal)
    most = max(float(np.abs(modal).max()), TINY)
    if not own.min() >= -MODAL * most:
        raise given.wrong("damping", "be positive semidefinite", f"{own.min():.3g}")
    scale = np.sqrt(np.maximum(own, ROUND_OFF * most))
    miss = np.abs((modal - np.diag(own)) / np.outer(scale, scale)).max()
    if not miss <= MODAL:
        allowed = f"be modal (Phi^T D Phi diagonal to {MODAL:g})"
        raise given.wrong("damping", allowed, f"{miss:.2g}")
    still = omega == 0.0
    if (own[still] > MODAL * most).any():
        allowed = "leave modes without stiffness undamped"
        raise given.wrong("damping", allowed, f"{own[still].max():.3g}")
    ratios = np.maximum(own, 0.0) / np.where(still, 1.0, 2 * omega)
    return np.asarray(np.where(still, 0.0, ratios))
