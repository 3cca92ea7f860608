"""Compute the matrices that rotation adds to a rotor: C, K_1, K_2 and loads.

They are those of `modes.Spin`: the Coriolis matrix, and the stiffness per Omega^2 and
Omega^4. For a rotor of equal sectors this module splits them into blocks, one for each
nodal diameter; for a rotor from file it checks them and finds whether they, too, are
those of equal sectors.

In the real modes of equal sectors, phases 0 and 1 of x = q_0 + i q_1, a matrix is
[[H_r, -H_i], [H_i, H_r]] on each nodal diameter, with H Hermitian or skew-Hermitian,
and does not couple different diameters. Anything else in it is a deviation of the
sectors.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from hpcwhirl.arrays import Complexes, Floats, Indices
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.cyclic_coordinates import diameters, is_simple, spread
from hpcwhirl.reduction.modes import (
    NO_ROWS,
    SUSPENSION_SHARE,
    ModalModel,
    Spin,
    SpinBlock,
    Symmetry,
    centre_rows,
)
from hpcwhirl.reduction.supports import Support
from hpcwhirl.store.models.engine_file import (
    AT_SPEEDS,
    BY_PARTS,
    Given,
    are_two_ways,
    missing_terms,
)

FEWEST = 3  # least number of blades for which waves have a direction
SYMMETRIC = 1e-9  # largest part of the wrong symmetry, relative to the largest entry
RIGID = 0.01  # largest relative deviation of the inertia of a translation
TINY = 1e-300


def with_blocks(model: ModalModel, blades: int) -> ModalModel:
    """Return a rotor of equal sectors, to which the waves' matrices have been added.

    The field `Spin.waves` has the terms of rotation on each nodal diameter. A
    rotor without terms of rotation is returned unchanged.
    """
    spin = model.spin
    if spin is None or not model.cyclic or blades < FEWEST:
        return model
    turned = _modal(model, spin)
    tips = model.shapes[: 2 * blades].reshape(blades, 2, -1)
    hub, blocks = centre_rows(model, blades), []
    for k, members in _members(model, blades):
        first, simple = members[0], is_simple(k, blades)
        waves = spread(k, blades)
        z = np.einsum("jp,jcm->pcm", waves, tips[:, :, first])
        rows = z[0] + 0j if simple else z[0] + 1j * z[1]
        moved = hub[0, first] - 1j * hub[1, first]
        quartic = turned.quartic
        blocks.append(
            SpinBlock(
                k,
                simple,
                model.omega[first],
                np.asarray(rows),
                np.asarray(moved if k == 1 else 0 * moved),
                _block(turned.coriolis, members, skew=True),
                _block(turned.stiffening, members),
                None if quartic is None else _block(quartic, members),
                _stations(spin, model, first) if k == 1 else NO_ROWS,
                _block(turned.material, members)
                if turned.material is not None and k == 1
                else None,
            )
        )
    return replace(model, spin=replace(spin, waves=tuple(blocks)))


def _stations(spin: Spin, model: ModalModel, modes: Indices) -> Complexes:
    """Return the motion of the shaft's supports in first modes of pairs, (s, m)."""
    rows = [own.rows @ model.shapes[:, modes] for own in spin.stations]
    if not rows:
        return NO_ROWS
    return np.array([row[0] - 1j * row[1] for row in rows])


def _modal(model: ModalModel, spin: Spin) -> Spin:
    """Return a rotor's terms of rotation (C, K_1, F_c, K_2) in amplitudes of its modes.

    spin : the terms in the rotor's physical coordinates
    """
    shapes = model.shapes
    return Spin(
        shapes.T @ spin.coriolis @ shapes,
        shapes.T @ spin.stiffening @ shapes,
        shapes.T @ spin.load,
        None if spin.quartic is None else shapes.T @ spin.quartic @ shapes,
        material=None if spin.material is None else shapes.T @ spin.material @ shapes,
    )


def _members(model: ModalModel, blades: int) -> Iterator[tuple[int, list[Indices]]]:
    """Yield each nodal diameter k, and the indices of its modes.

    The indices are two arrays, of the first and of the second mode of each pair, sorted
    by rank; only the first for a simple harmonic.
    """
    for k in diameters(blades):
        own = [(model.diameter == k) & (model.phase == p) for p in (0, 1)]
        parts = [np.flatnonzero(part) for part in own]
        yield (
            k,
            [part[np.argsort(model.rank[part])] for part in parts if len(part)]
            or [parts[0]],
        )


def _block(matrix: Floats, members: list[Indices], *, skew: bool = False) -> Complexes:
    """Return the complex matrix H, (m, m), of a nodal diameter from one in real modes.

    matrix : in all real modes of the rotor
    members : indices of the first, and of the second mode of the diameter's m pairs;
        only the first for a simple harmonic
    skew : whether the matrix is skew-symmetric
    """
    parts = [[matrix[np.ix_(a, b)] for b in members] for a in members]
    real, imag = parts[0][0], np.zeros_like(parts[0][0])
    if len(members) == 2:
        real, imag = (real + parts[1][1]) / 2, (parts[1][0] - parts[0][1]) / 2
    out, sign = real + 1j * imag, -1.0 if skew else 1.0
    return np.asarray((out + sign * out.conj().T) / 2)


def turned_alike(regular: ModalModel, given: ModalModel, blades: int) -> ModalModel:
    """Return a rotor as one of equal sectors if its terms of rotation allow it, too.

    Parameters
    ----------
    regular : the rotor from `recognise.equal_sectors`
    given : the rotor as in the file, which is returned if a term deviates too much
    blades : N
    """
    symmetry = regular.symmetry
    if given.spin is None or not regular.cyclic or symmetry is None:
        return regular
    whole = with_blocks(regular, blades)
    size, what = _coupled(whole, given, blades)
    if not size <= symmetry.tolerance:
        where = f"{what}, with rotation full"
        return replace(given, symmetry=Symmetry(size, symmetry.tolerance, where))
    if size > symmetry.deviation:
        where = f"{what}, with rotation full"
        whole = replace(whole, symmetry=Symmetry(size, symmetry.tolerance, where))
    return whole


def _coupled(model: ModalModel, given: ModalModel, blades: int) -> tuple[float, str]:
    """Return which term of rotation deviates most from that of equal sectors.

    Returns the deviation, 0 if the sectors are equal, and the name of the term.

    Deviations are entries outside the blocks A of the nodal diameters; for modes i and
    j they are relative to the modal masses (C), to sqrt(A_ii A_jj) with A_ii at least
    the mass (K_1), or relative changes of frequency (K_2); for the load, entries of k >
    0 relative to the largest. Couplings with modes left out by `recognise` count, too.
    """
    own, rest, spin = _modal(model, model.terms), _left_out(model, given), given.terms
    across = {
        name: np.abs(model.shapes.T @ getattr(spin, name) @ rest).max(initial=0.0)
        for name in ("coriolis", "stiffening")
    }
    pure = [np.zeros_like(own.coriolis) for _ in range(3)]
    for piece, (_, members) in zip(
        model.terms.waves, _members(model, blades), strict=True
    ):
        for out, block in zip(
            pure, (piece.coriolis, piece.stiffening, piece.quartic), strict=True
        ):
            if block is not None:
                _spread_block(out, block, members)
    still = np.abs(own.load[model.diameter != 0]).max(initial=0.0)
    found = {
        "Coriolis matrix": max(
            float(np.abs(own.coriolis - pure[0]).max()), float(across["coriolis"])
        ),
        "stiffening": max(
            float(np.abs(_scaled(own.stiffening, pure[1])).max()),
            float(across["stiffening"]),
        ),
        "centrifugal load": still / max(float(np.abs(own.load).max()), TINY),
    }
    if own.quartic is not None:  # relative change of omega at twice the first omega
        omega = np.maximum(model.omega, model.omega[model.omega > 0.0].min())
        square = (2.0 * float(omega.min())) ** 2
        miss = np.abs(own.quartic - pure[2]) * square**2 / np.outer(omega, omega)
        found["stiffening by Omega^4"] = float(miss.max()) / 2
    what = max(found, key=lambda name: found[name])
    return found[what], what


def _left_out(model: ModalModel, given: ModalModel) -> Floats:
    """Return the shapes of a rotor from file that its waves do not contain, (n, m).

    These are the modes of `given`, the rotor as in the file, less their projection on
    those of `model`, the rotor of equal sectors; m = 0 if that has all modes.
    """
    if len(model.omega) == len(given.omega):
        return np.zeros((len(given.shapes), 0))
    within = model.shapes @ (model.shapes.T @ (given.mass @ given.shapes))
    return np.asarray(given.shapes - within)


def _scaled(matrix: Floats, pure: Floats) -> Floats:
    size = np.sqrt(np.maximum(np.abs(np.diag(pure)), 1.0))
    return np.asarray((matrix - pure) / np.outer(size, size))


def _spread_block(out: Floats, block: Complexes, members: list[Indices]) -> None:
    """Set the entries of a matrix in real modes that belong to one nodal diameter.

    out : the matrix, in all real modes of the rotor; changed in place
    block : complex matrix of the diameter, (m, m)
    members : indices of the first, and of the second mode of the diameter's m pairs;
        only the first for a simple harmonic
    """
    parts = {(0, 0): block.real, (1, 1): block.real, (0, 1): -block.imag,
             (1, 0): block.imag}  # fmt: skip
    for (a, b), part in parts.items():
        if max(a, b) < len(members):
            out[np.ix_(members[a], members[b])] = part


def standing_damping(
    model: ModalModel, blades: int, ratio: float, suspension: float
) -> float:
    """Return the damping, N s/m, of a damper in the static frame at the shaft's centre.

    It is such that the suspension has the damping ratio that the scene sets, to first
    order in the damping: of the two modes of a split pair the mean.

    Parameters
    ----------
    model : rotor at rest
    blades : N
    ratio, suspension : damping ratio xi of all modes, and total xi of the suspension,
        damper included
    """
    held = suspension_modes(model)
    if suspension <= ratio or not len(held):
        return 0.0
    moved = (centre_rows(model, blades)[:, held] ** 2).sum(axis=0)
    return 2 * (suspension - ratio) / float((moved / model.omega[held]).mean())


def suspension_modes(model: ModalModel) -> Indices:
    """Return the indices of the suspension's modes: a pair; none if unknown.

    Of the modes with more than half of their strain energy in the shaft's springs they
    are the lowest: on a shaft that lets the disk tilt, the conical modes are higher.
    """
    held = np.flatnonzero(model.centre_share > SUSPENSION_SHARE)
    if not len(held):
        return held
    lowest = held[np.argmin(model.omega[held])]
    same = model.diameter[held] == model.diameter[lowest]
    return np.asarray(held[same & (model.rank[held] == model.rank[lowest])])


def spin_of(given: Given) -> Spin:
    """Return the terms of rotation (Coriolis, stiffening, loads) of a rotor from file.

    They are in the coordinates of the file's matrices.

    Raises
    ------
    InputError
        if terms deviate from the layout
    """
    count = len(given["mass"])
    if given["centrifugal_load"].shape != (count,):
        size = given["centrifugal_load"].shape
        raise given.wrong("centrifugal_load", f"be {(count,)}", size)
    supports = given.arrays.get("centre_damping", np.zeros(1))
    if supports.shape != (1,) or not supports[0] >= 0.0:
        raise given.wrong("centre_damping", "be one number >= 0 N s/m", supports)
    names = AT_SPEEDS[1:] if "speeds" in given else BY_PARTS
    terms = {name: checked(given, name) for name in names}
    if "speeds" in given:
        terms["speeds"] = given["speeds"]
    first, quartic = stiffness_terms(given["stiffness"], terms)
    return Spin(
        checked(given, "coriolis", skew=True),
        first,
        given["centrifugal_load"],
        quartic,
        support=Support(damping=complex(supports[0])),
    )


def check_terms(given: Given) -> None:
    """Raise InputError if an engine's file has not all terms of rotation.

    Of two forms of stiffness it must have exactly one: the matrices of stress stiffness
    and softening, or the stiffness at two speeds.
    """
    if are_two_ways(given.arrays):
        raise given.refusal(
            f"has rotor/{AT_SPEEDS[0]} or {AT_SPEEDS[1]} and rotor/{BY_PARTS[0]} or "
            f"{BY_PARTS[1]}: stiffness at two speeds, or its two parts, but not both"
        )
    missing = [name for name in ("mass", "stiffness") if name not in given]
    missing += missing_terms(given.arrays)
    if missing:
        names = ", ".join(f"rotor/{name}" for name in missing)
        raise given.refusal(
            f"has no {names}: engine.rotation must be none, got full or auto"
        )
    if "speeds" in given:
        speeds = given["speeds"]
        if speeds.shape != (2,) or not 0.0 < speeds[0] < speeds[1]:
            raise given.wrong("speeds", "be two, ascending, > 0 rad/s", speeds)


def stiffness_terms(rest: Any, terms: Mapping[str, Any]) -> tuple[Any, Any]:
    """Return how the stiffness of a rotor from file depends on the speed: K_1 and K_2.

    K(Omega) = K_0 + Omega^2 K_1 + Omega^4 K_2, dense or sparse; K_2 is None if it is 0.
    K_1 is `stress_stiffness` less `softening`; or K_1 and K_2 follow from the stiffness
    at two speeds (Sternchuss and Balmes 2006), a = Omega_a^2, b = Omega_b^2:

    K_1 = [b^2 (K_a - K_0) - a^2 (K_b - K_0)] / (a b (b - a))
    K_2 = [a (K_b - K_0) - b (K_a - K_0)] / (a b (b - a))

    Parameters
    ----------
    rest : K_0 (n, n)
    terms : matrices by their names in an engine's file
    """
    if "speeds" not in terms:
        return terms[BY_PARTS[0]] - terms[BY_PARTS[1]], None
    of_a, of_b = (terms[name] - rest for name in AT_SPEEDS[1:])
    a, b = np.square(terms["speeds"])
    scale = a * b * (b - a)
    return (b**2 * of_a - a**2 * of_b) / scale, (a * of_b - b * of_a) / scale


def checked(given: Given, name: str, *, skew: bool = False) -> Floats:
    """Return a matrix of an engine's file, made exactly symmetric or skew-symmetric.

    Raise InputError if it is not so within `SYMMETRIC`.

    name, skew : the matrix's name in the file; whether it must be skew-symmetric
    """
    matrix, count = given[name], len(given["mass"])
    if matrix.shape != (count, count):
        raise given.wrong(name, f"be {(count, count)}", matrix.shape)
    sign = -1.0 if skew else 1.0
    miss = np.abs(matrix - sign * matrix.T).max() / max(np.abs(matrix).max(), TINY)
    if not miss <= SYMMETRIC:
        kind = "skew" if skew else "symmetric"
        allowed = f"be {kind} to {SYMMETRIC:g} of its largest entry"
        raise given.wrong(name, allowed, f"{miss:.2g}")
    return np.asarray((matrix + sign * matrix.T) / 2)


def transformed(spin: Spin, basis: Floats) -> Spin:
    """Return terms of rotation in m new coordinates y, x = basis y.

    spin, basis : terms in n coordinates x; (n, m)
    """
    back, quartic = basis.T, spin.quartic
    turned, first = back @ spin.coriolis @ basis, back @ spin.stiffening @ basis
    if quartic is not None:
        quartic = back @ quartic @ basis
        quartic = (quartic + quartic.T) / 2
    return replace(
        spin,
        coriolis=(turned - turned.T) / 2,
        stiffening=(first + first.T) / 2,
        load=back @ spin.load,
        swing=None if spin.swing is None else back @ spin.swing,
        quartic=quartic,
    )


def check_translation(
    given: Given, model: ModalModel, blades: int, spring: float
) -> None:
    """Raise InputError if a file's terms of rotation resist a rigid translation.

    A rotor without shaft would move on a straight line in the static frame; wrong signs
    or units of the terms show in a force on it.

    Parameters
    ----------
    given : the file
    model : its rotor with terms of rotation, held only by springs at its centre
    blades : N
    spring : k_o, N/m
    """
    if model.spin is None or not model.omega.min() > 0.0:
        return
    hub = centre_rows(model, blades)
    moved = spring * (model.shapes / model.omega**2) @ hub.T  # static response to k_o
    check_turned(model.spin, model.mass, moved, given.arrays.get("speeds"), given.wrong)


def check_turned(
    spin: Spin,
    mass: Floats,
    moved: Floats,
    speeds: Floats | None,
    wrong: Callable[[str, str, object], InputError],
) -> None:
    """Raise an error for terms of rotation that resist a rigid translation.

    Without springs at its centre a rotor moves uniformly in the static frame, with the
    double root s = -i Omega in the rotating frame. Hence T_x C T_y = -T_x M T_x = -m
    and T_x (K_1 + Omega^2 K_2) T_x = -m. The opposite sign of C would exchange forward
    and backward.

    Parameters
    ----------
    spin : terms of rotation of a rotor, in n coordinates
    mass : M (n, n)
    moved : (n, 2), unit translations T_x and T_y along x and y
    speeds : rad/s, the two speeds, if the stiffness is given at two speeds
    wrong : function that makes the error from the name of a matrix, what it must be
        and what it is
    """
    size = float(np.trace(moved.T @ mass @ moved)) / 2
    turned = (moved.T @ spin.coriolis @ moved) / size
    if not np.abs(turned - [[0.0, -1.0], [1.0, 0.0]]).max() <= RIGID:
        across, hint = turned[0, 1], ""
        if abs(across - 1.0) <= RIGID:
            hint = ": it has the other sign, which exchanges forward and backward"
        elif abs(across + 2.0) <= 2 * RIGID:
            hint = ": it is 2 C, the gyroscopic matrix of a unit speed"
        told = f"have C_xy = -m in a translation of the rotor of m = {size:.4g} kg"
        raise wrong("coriolis", told, f"{across * size:.4g}{hint}")
    soft = spin.stiffening
    if spin.quartic is not None and speeds is not None:
        soft = soft + speeds[1] ** 2 * spin.quartic
    soft = (moved.T @ soft @ moved) / size
    if not np.abs(soft + np.eye(2)).max() <= RIGID:
        names = BY_PARTS if speeds is None else AT_SPEEDS[1:]
        told = f"soften a translation of the rotor by its mass m = {size:.4g} kg"
        raise wrong(
            names[1], f"{told}, together with {names[0]}", f"{-soft[0, 0] * size:.4g}"
        )
