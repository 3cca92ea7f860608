"""A round casing from file: a table of its modes by harmonic.

A mode of harmonic h is w = W cos(h theta), u = U sin(h theta) and, as the second of the
pair, w = W sin(h theta), u = -U cos(h theta); for h = 0 it is w = W or a rotation u =
U. W and U are amplitudes of the mass-normalised mode where the blades touch, one for
each axial station if the file has stations. Other parts of the casing that move in the
mode (flanges) or other motion (axial) only change omega and reduce W and U.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.errors import InputError
from hpcwhirl.reduction.harmonics import model_of_modes
from hpcwhirl.reduction.modes import ModalModel
from hpcwhirl.scene import Casing
from hpcwhirl.store.models.engine_file import Given, read_casing
from hpcwhirl.structure import FourierOperator, Stations, Uniform

Table = dict[str, NDArray[Any]]
NAMES = ("harmonic", "omega", "damping_ratio", "radial", "tangential")


@lru_cache(maxsize=16)
def casing_table(file: str, content: str) -> Table:
    """Return the table of a casing's modes in a file, {name: (m,)}, by harmonic, omega.

    If the file has stations, the table has `station` (s,), m, and `radial` and
    `tangential` are (m, s).

    Raises
    ------
    InputError
        if a column is missing, has another length or impossible values, or if a
        harmonic has no mode with radial motion, so that the casing would be rigid
    """
    del content  # part of the cache's key, so that a changed file is read again
    given = read_casing(file)
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
    """Return {"station": (s,)}, checked, of a file that has stations; else {}."""
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
    """Return whether modes move at any station, (m,); column : (m,) or (m, s)."""
    return np.asarray((column.reshape(len(column), -1) != 0.0).any(axis=1))


def _check_harmonics(given: Given, table: Table) -> None:
    harmonic, radial = table["harmonic"], _moves(table["radial"])
    both = (harmonic == 0) & radial & _moves(table["tangential"])
    if both.any():
        raise given.refusal(
            "has a casing mode of harmonic 0 with modal_radial and modal_tangential: a "
            "round casing breathes or turns, one must be 0"
        )
    have = set(harmonic[radial].tolist())
    missing = [h for h in range(int(harmonic.max()) + 1) if h not in have]
    if missing:
        raise given.refusal(
            f"has no casing mode that moves radially in harmonic {missing[0]}, but "
            f"some in {int(harmonic.max())}: the casing would be rigid there"
        )


def check_lobes(file: str, content: str, lobes: int) -> None:
    """Raise InputError if a load has more lobes than the casing's highest harmonic."""
    most = int(casing_table(file, content)["harmonic"].max())
    if lobes > most:
        msg = (
            f"nodal_diameter must be <= {most}, the highest harmonic of the casing of "
            f"engine.file {file}, got {lobes}"
        )
        raise InputError(msg)


def round_casing(
    casing: Casing, radius: float, source: tuple[str, str]
) -> tuple[ModalModel, FourierOperator]:
    """Return the modes of a casing from file and its contact operator.

    Parameters
    ----------
    casing : inputs; `harmonics` is the highest harmonic used from the file
    radius : R_c, m
    source : path of the file, and the digest of its content
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
    """Return the table of a round casing's modes in the form of `casing_table`.

    For a casing that varies along its axis, W and U are given at the stations of its
    file or, for a shell, at those of `_stations_of`.
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
