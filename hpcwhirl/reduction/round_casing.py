"""Modes of a round casing by harmonics: of a ring, of a shell, or from a file's table.

The harmonic h of a mode is its number of waves around the casing. The two modes of a
pair, phases, are turned against each other by a quarter of a wave.

A ring has two modes per harmonic and phase. For h >= 1, the first one bends the ring
(for h = 1 it moves the ring on its support); the second one stretches it, with a
frequency of c / R sqrt(1 + h^2) or more, c the speed of sound. At a contact, the
stretching mode has some thousandths of the compliance of the bending mode, but it
limits the time step.

A file has a table of modes. A mode of harmonic h is w = W cos(h theta), u = U sin(h
theta) and, as the second of the pair, w = W sin(h theta), u = -U cos(h theta); for h =
0 it is w = W or a rotation u = U. W and U are amplitudes of the mass-normalised mode
where the blades touch, one for each axial station if the file has stations. Other parts
of the casing that move in the mode (flanges) or other motion (axial) only change omega
and reduce W and U.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import lru_cache, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from hpcwhirl.arrays import Floats
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.modes import ModalModel
from hpcwhirl.scene import Casing
from hpcwhirl.store.models.engine_file import Given, read_group
from hpcwhirl.structure import (
    FourierOperator,
    Sines,
    Stations,
    Uniform,
    harmonic_matrices,
    shell_matrices,
)

STILL = 1e-12  # motion over the largest, at a station or of a mode, that counts as none


def _places(
    operator: FourierOperator, h: int, p: int
) -> Iterator[tuple[list[int], Floats]]:
    """Yield where a casing's coordinates have harmonic h: for the cos, then sin phase.

    Yields indices of the coordinates of radial w, tangential u and, of a shell, axial
    motion, and their signs in this phase, since w = W sin goes with u = -U cos. For
    each phase, W and U of a mode are entered in these coordinates.

    operator, h, p : contact operator of the casing; harmonic; axial function, from 0
    """
    layer, count = len(operator.radial), operator.directions
    cosine, sine = (operator.width * p + i for i in (max(2 * h - 1, 0), 2 * h))
    yield [cosine, layer + sine, 2 * layer + cosine][:count], np.ones(count)
    if h > 0:
        rows = [sine, layer + cosine, 2 * layer + sine]
        yield rows[:count], np.array([1.0, -1.0, 1.0])[:count]


def _stretches(h: int, modes: Floats) -> int:
    """Return the index, 0 or 1, of the mode of harmonic h that stretches a ring.

    The other one bends it.

    modes : (2, 2), w and u of the two modes, a mode in each column
    """
    return int(np.argmax(np.abs(modes[0] + h * modes[1])))


def model_of_modes(
    labels: list[tuple[float, int, int, int]],
    columns: list[Floats],
    damping: float | Floats,
    matrices: tuple[Floats, Floats] | None = None,
) -> ModalModel:
    """Return a casing's modal model from modes listed by harmonic.

    In the model they are sorted by frequency.

    Parameters
    ----------
    labels : (omega, rad/s; harmonic; rank; phase) of each mode
    columns : shape of each mode in the casing's coordinates, (n,)
    damping : modal damping ratio, one or (modes,)
    matrices : mass and stiffness; None if modes were left out, which the matrices
        would include
    """
    omega, diameter, rank, phase = map(np.array, zip(*labels, strict=True))
    order = np.lexsort((phase, rank, diameter, omega))
    mass, stiffness = matrices or (np.zeros((0, 0)),) * 2
    return ModalModel(
        mass=mass,
        stiffness=stiffness,
        shapes=np.ascontiguousarray(np.column_stack(columns)[:, order]),
        omega=omega[order],
        diameter=diameter[order],
        rank=rank[order],
        phase=phase[order],
        centre_share=np.zeros(len(omega)),
        damping=damping if isinstance(damping, float) else damping[order],
        kept=0,
    )


def _model(
    casing: Casing,
    operator: FourierOperator,
    matrices_of: Callable[[int, int], tuple[float, Floats]],
    kept_of: Callable[[int, Floats], list[int]],
) -> ModalModel:
    """Return the modes of a casing whose harmonics and axial functions are uncoupled.

    Parameters
    ----------
    casing : inputs of the casing
    operator : contact operator, which orders the coordinates
    matrices_of : function from harmonic h and axial function p to their mass, kg, and
        stiffness matrix, N/m
    kept_of : function from h and the modes, a column each, to the indices of the modes
        that are kept with the input `families` = "bending"
    """
    mass, stiffness = (np.zeros((operator.size, operator.size)) for _ in range(2))
    labels, columns, whole = [], [], casing.families == "all"
    for h in range(casing.harmonics + 1):
        found = []
        for p in range(operator.axial.count):
            inertia, stiff = matrices_of(h, p)
            own = inertia * np.eye(len(stiff))
            squared, modes = eigh(stiff, own)
            if h == 0:  # torsion is uncoupled: entries that couple it are round-off
                modes[np.abs(modes) < STILL * np.abs(modes).max()] = 0.0
            omega = np.sqrt(np.maximum(squared, 0.0))  # a free ring's are round-off
            kept = range(len(omega)) if whole else kept_of(h, modes)
            found += [(omega[n], p, modes[:, n]) for n in kept]
            for rows, signs in _places(operator, h, p):
                mass[np.ix_(rows, rows)] = own
                stiffness[np.ix_(rows, rows)] = stiff * np.outer(signs, signs)
        found.sort(key=lambda mode: mode[:2])
        for rank, (value, p, mode) in enumerate(found):
            for phase, (rows, signs) in enumerate(_places(operator, h, p)):
                columns.append(np.zeros(operator.size))
                columns[-1][rows] = signs * mode
                labels.append((value, h, rank, phase))
    matrices = (mass, stiffness) if whole else None
    return model_of_modes(labels, columns, casing.damping, matrices)


def harmonic_model(casing: Casing, radius: float) -> tuple[ModalModel, FourierOperator]:
    """Return the modes of an elastic ring, by harmonics, and its contact operator.

    Parameters
    ----------
    casing : inputs of the ring: section, support, damping and `harmonics`
    radius : R_c, m
    """

    def kept_of(h: int, modes: Floats) -> list[int]:
        return [0, 1] if h == 0 else [1 - _stretches(h, modes)]

    operator = FourierOperator(casing.harmonics, radius)
    matrices = partial(harmonic_matrices, casing, radius)
    return _model(casing, operator, lambda h, _: matrices(h), kept_of), operator


def shell_model(casing: Casing, radius: float) -> tuple[ModalModel, FourierOperator]:
    """Return the modes of a cylindrical shell, by harmonics, and its contact operator.

    There are three modes for each harmonic h, axial function p, and phase.

    Parameters
    ----------
    casing : section, `width` (its length), support, damping, `harmonics` and
        `axial_modes`; with `families` = bending, each (h, p) keeps only the mode that
        moves most radially
    radius : R_c, m
    """
    axial = Sines(casing.axial_modes, casing.width)
    operator = FourierOperator(casing.harmonics, radius, axial, directions=3)
    model = _model(
        casing,
        operator,
        lambda h, p: shell_matrices(casing, radius, h, p + 1),
        lambda _, modes: [int(np.argmax(np.abs(modes[0])))],
    )
    return model, operator


def at_station(
    model: ModalModel, operator: FourierOperator, station: float
) -> tuple[ModalModel, FourierOperator]:
    """Return a casing reduced to one plane across its axis, where the blades touch it.

    The result has no matrices, and no modes that are at rest in the plane; a casing
    that is uniform along its axis is returned unchanged. Its first coordinates are
    those in the plane. What the casing has beside them follows as further directions
    of displacement, so that displacements determine the amplitudes of modes.

    station : m, axial position of the plane, 0 in the casing's middle
    """
    if isinstance(operator.axial, Uniform):
        return model, operator
    weight = operator.axial.at(np.array([station]))
    beside = np.linalg.svd(weight)[2][1:]
    every = model.shapes.reshape(
        operator.directions, operator.axial.count, operator.width, -1
    )
    shapes = np.tensordot(weight[0], every[:2], (0, 1)).reshape(2 * operator.width, -1)
    moved = np.abs(shapes).max(axis=0)
    chosen = moved > STILL * moved.max()
    others = np.tensordot(beside, every[:2], (1, 1))
    blocks = (
        shapes,
        *(part.reshape(-1, shapes.shape[1]) for part in (others, every[2:])),
    )
    rows = np.vstack(blocks)[:, chosen]
    flat = FourierOperator(
        operator.harmonics, operator.radius, directions=len(rows) // operator.width
    )
    return model.only(chosen, rows), flat


Table = dict[str, NDArray[Any]]
NAMES = ("harmonic", "omega", "damping_ratio", "radial", "tangential")


@lru_cache(maxsize=16)
def casing_table(file: str, content: str) -> Table:
    """Return the table of m modes of a casing in an engine's file, checked; cached.

    It is {column: (m,)}, sorted by harmonic and frequency. If the file has s axial
    stations, the table has `station` (s,), m, and `radial` and `tangential`, the
    amplitudes W and U, are (m, s).

    file, content : path; SHA-256 of the file, so that a changed file is read again

    Raises
    ------
    InputError
        if a column is missing, has another length or impossible values, or if a
        harmonic has no mode with radial motion, so that the casing would be rigid
    """
    del content  # part of the cache's key, so that a changed file is read again
    given = read_group(file, "casing")
    table = {name: given[f"modal_{name}"] for name in NAMES}
    stations = _checked_stations(given, table)
    count = len(table["harmonic"])
    for name in NAMES:
        if len(table[name]) != count or not count:
            size = f"have as many entries as casing/modal_harmonic, {max(count, 1)}"
            raise given.wrong(f"modal_{name}", size, len(table[name]))
    for name in NAMES[:3]:
        if table[name].min() < 0:
            raise given.wrong(f"modal_{name}", "be >= 0", table[name].min())
    _check_harmonics(given, table)
    order = np.lexsort((table["omega"], table["harmonic"]))
    return {name: column[order] for name, column in table.items()} | stations


def _checked_stations(given: Given, table: Table) -> Table:
    """Return {"station": (s,), m} of a casing's file with s axial stations; else {}.

    Raise InputError if they do not ascend, or columns do not have one value for each.

    given, table : arrays of the file; those that are columns of the table
    """
    sizes = {name: table[name].shape[1:] for name in NAMES[3:]}
    if "station" not in given:
        wide = [name for name, size in sizes.items() if size]
        if wide:
            raise given.refusal(
                f"has casing/modal_{wide[0]} at several stations, but no casing/station"
            )
        return {}
    station = given["station"]
    for name, size in sizes.items():
        if size != station.shape:
            allowed = f"be (modes, {len(station)}), a column for each casing/station"
            raise given.wrong(f"modal_{name}", allowed, table[name].shape)
    if not len(station) or not (np.diff(station) > 0.0).all():
        raise given.wrong("station", "ascend", station[:4])
    return {"station": station}


def _moves(column: NDArray[Any]) -> NDArray[np.bool_]:
    """Return which of a casing's m modes have an amplitude other than 0, (m,).

    column : (m,) or, at s stations, (m, s): amplitudes W or U of the modes
    """
    return np.asarray((column.reshape(len(column), -1) != 0.0).any(axis=1))


def _check_harmonics(given: Given, table: Table) -> None:
    harmonic, radial = table["harmonic"], _moves(table["radial"])
    both = (harmonic == 0) & radial & _moves(table["tangential"])
    if both.any():
        raise given.refusal(
            "has a casing mode of harmonic 0 with modal_radial and modal_tangential: "
            "such a mode of a round casing moves either radially or tangentially, so "
            "one of the two must be 0"
        )
    have = set(harmonic[radial].tolist())
    missing = [h for h in range(int(harmonic.max()) + 1) if h not in have]
    if missing:
        raise given.refusal(
            f"has no casing mode that moves radially in harmonic {missing[0]}, but "
            f"some in {int(harmonic.max())}: the casing would be rigid there"
        )


def check_lobes(file: str, content: str, lobes: int) -> None:
    """Raise InputError if a pulse has more lobes than a casing from file has harmonics.

    file, content, lobes : path; SHA-256 of the file; k of the pulse
    """
    most = int(casing_table(file, content)["harmonic"].max())
    if lobes > most:
        raise InputError(
            f"nodal_diameter must be <= {most}, the highest harmonic of the casing of "
            f"engine.file {file}, got {lobes}"
        )


def round_casing(
    casing: Casing, radius: float, source: tuple[str, str]
) -> tuple[ModalModel, FourierOperator]:
    """Return the modes of a casing from file and its contact operator.

    Parameters
    ----------
    casing : inputs; `harmonics` is the highest harmonic used from the file
    radius : R_c, m
    source : path of the file, and the SHA-256 of its content
    """
    table = casing_table(*source)
    own = tuple(table["station"].tolist()) if "station" in table else None
    axial = Stations(own) if own else Uniform()
    operator = FourierOperator(casing.harmonics, radius, axial)
    rows = range(len(table["omega"]))
    columns, labels, ratios = [], [], []
    layers, layer = operator.width * np.arange(axial.count), len(operator.radial)
    for m in rows:
        h, omega, ratio, w, u = (table[n][m] for n in ("harmonic", *NAMES[1:]))
        h = int(h)
        if h > casing.harmonics:
            continue
        rank = m - int(np.searchsorted(table["harmonic"], h))
        cosine, sine = max(2 * h - 1, 0), 2 * h
        for phase in range(2 if h else 1):
            shape = np.zeros(operator.size)
            of_w, of_u = (cosine, sine) if phase == 0 else (sine, cosine)
            shape[layers + of_w] = w
            shape[layer + layers + of_u] = u if phase == 0 else -u
            columns.append(shape)
            labels.append((omega, h, rank, phase))
            ratios.append(ratio)
    return model_of_modes(labels, columns, np.array(ratios)), operator


def table_of(model: ModalModel, operator: FourierOperator) -> Table:
    """Return the table of a round casing's modes that `export-model` writes to a file.

    It has the columns of `casing_table`. For a casing that varies along its axis, W and
    U are given at the axial stations of its file or, for a shell, at equal distances.
    """
    modes = np.flatnonzero(model.phase == 0)
    modes = modes[np.lexsort((model.omega[modes], model.diameter[modes]))]
    h, stations = model.diameter[modes], _stations_of(operator)
    layers = operator.width * np.arange(operator.axial.count)[:, None]
    of_w, of_u = layers + np.maximum(2 * h - 1, 0), layers + 2 * h
    weight = operator.axial.at(stations)
    radial = (weight @ model.shapes[of_w, modes]).T
    tangential = (weight @ model.shapes[len(operator.radial) + of_u, modes]).T
    table = {
        "harmonic": h,
        "omega": model.omega[modes],
        "damping_ratio": model.ratios[modes],
        "radial": radial,
        "tangential": tangential,
    }
    if isinstance(operator.axial, Uniform):
        return table | {"radial": radial[:, 0], "tangential": tangential[:, 0]}
    return table | {"station": stations}


def _stations_of(operator: FourierOperator) -> NDArray[np.float64]:
    axial = operator.axial
    if isinstance(axial, Uniform):
        return np.zeros(1)
    if isinstance(axial, Stations):
        return np.array(axial.places)
    return np.linspace(*axial.ends, 2 * axial.count + 1)
