"""Write and read the cells and boundaries of a refined map in its results.

These are two groups of results.h5:

- `cells`: for every cell that is not split, the cases at its corners, the last refined
  input varying fastest (`corner`; -1: not computed, since a budget ended the
  refinement), the cell's `panel`, `level` and `state` (even: all corners have one word;
  mixed; speckle), and whether its corners are `confirmed`. Attributes: refined inputs
  (`over`), their `scale`, the kind of `words` that decide, and the number of cases left
  out by a budget (`dropped`).
- `boundaries`: points where words change; coordinates are named like the refined
  inputs. A point is the middle of an edge between two cases with different words, at
  `low` and `high` of the input `along`, see `refinement.boundary.Boundaries`. If two
  inputs are refined, `line_begin` and `line_end` are the points that lines join. An
  attribute names the kind of words. `classify` writes this group again.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from hpcwhirl.refinement.boundary import STATES, Boundaries, Cases, Cells, boundaries_of
from hpcwhirl.refinement.growth import Address, Growth
from hpcwhirl.refinement.lattice import Cell, Lattice
from hpcwhirl.refinement.rule import rule_of
from hpcwhirl.refinement.tree import CONFIRM, Node, Tree
from hpcwhirl.refinement.words import (
    ATTRACTOR,
    NUMBERS,
    REGIME,
    Word,
    any_differ,
    features_of,
    word_of,
)
from hpcwhirl.scene.quantities import INPUTS, variable_name
from hpcwhirl.scene.units import Quantity
from hpcwhirl.scene.words import NO_REGIME
from hpcwhirl.store.directory.manifest import Manifest
from hpcwhirl.store.directory.refined import RefinedPlan, dropped_of
from hpcwhirl.store.hdf5 import define_axis, mark_words, reading, tell, utf8
from hpcwhirl.store.reading.results_file import words_in

CELLS, BOUNDARIES = "cells", "boundaries"
COARSE = "coarse_regime"  # which says whether a word is sure
TOLD = {
    "corner": Quantity("1", "case at a corner, -1: none", kind="i8"),
    "panel": Quantity("1", "number of the panel", kind="i8"),
    "level": Quantity("1", "bisections", kind="i8"),
    "state": Quantity("1", "whether words at the cell's corners differ", kind="enum"),
    "confirmed": Quantity(
        "1", "1 if the words at all corners are confirmed, or sure", kind="i8"
    ),
    "along": Quantity("1", "refined input along which the edge lies, -1: none"),
    "low": Quantity("1", "lower end of the edge along that input, in its unit"),
    "high": Quantity("1", "upper end; the word changes somewhere between"),
    "before": Quantity("1", "case at the lower end of the edge, -1: none"),
    "behind": Quantity("1", "case at the upper end of the edge, -1: none"),
    "line_begin": Quantity("1", "point where a segment of the boundary begins"),
    "line_end": Quantity("1", "point where the segment ends"),
}


@dataclass(frozen=True)
class Refined:
    """Cells and boundaries of a refined campaign, as its map draws them.

    Attributes
    ----------
    over : variables of the refined inputs
    scale : "linear" or "log" for each refined input
    cells : cells that are not split
    panel_of : (cases,), number of the panel (combination of inputs not refined) of each
        case
    last : {refined input: (cases,)}, whether a case has the largest value of that input
    by : kind of word that changes at the boundaries, "regime" or "whirl"
    at : {refined input: (p,)}, coordinates of the p points of boundaries
    panel : (p,), panel of each point
    lines : (s, 2), indices of the two points of each of s line segments
    """

    over: list[str]
    scale: list[str]
    cells: Cells
    panel_of: NDArray[np.int64]
    last: dict[str, NDArray[np.bool_]]
    by: str
    at: dict[str, NDArray[np.float64]]
    panel: NDArray[np.int64]
    lines: NDArray[np.int64]


def cells_of(plan: Manifest) -> Cells | None:
    """Return the cells of a refined map that are not split; None without [refine].

    plan : plan of the campaign with all refined cases
    """
    if not isinstance(plan, RefinedPlan) or plan.growth is None:
        return None
    row = {address: number for number, address in enumerate(plan.addresses)}
    found = [
        _cell(plan.growth, panel, cell, node, row)
        for panel, tree in enumerate(plan.growth.trees)
        for cell, node in sorted(_unsplit(tree, plan.growth.lattice, panel, row))
    ]
    corner = np.array([cell[0] for cell in found], dtype=np.int64)
    panel, level, state, confirmed = np.array([c[1:] for c in found], np.int64).T
    return Cells(corner, panel, level, state, confirmed)


def _unsplit(
    tree: Tree, lattice: Lattice, panel: int, row: Mapping[Address, int]
) -> list[tuple[Cell, Node]]:
    """Return the cells of a panel that count as not split, each with its state.

    A cell counts as unsplit if cases of any of its parts are missing, since a budget
    may leave them out.

    Parameters
    ----------
    tree : tree of the panel's cells
    lattice : possible values of the refined inputs
    panel : number of the panel
    row : {address: number} of the cases that exist
    """

    def is_wanted(cell: Cell) -> bool:
        points = tree.cells[cell].corners
        return all(Address(0, lattice.level(p), panel, p) in row for p in points)

    out, todo = [], list(tree.coarse)
    while todo:
        cell = todo.pop()
        parts = lattice.children(cell) if tree.cells[cell].split else []
        if parts and all(map(is_wanted, parts)):
            todo += parts
        else:
            out.append((cell, tree.cells[cell]))
    return out


def _cell(
    growth: Growth, panel: int, cell: Cell, node: Node, row: Mapping[Address, int]
) -> tuple[Any, ...]:
    tree, rows = growth.trees[panel], []
    second = [tree.words[CONFIRM].get(point) is not None for point in node.corners]
    for point, by in zip(node.corners, second, strict=True):
        rows.append(row[Address(int(by), growth.lattice.level(point), panel, point)])
    words = {tree.word(point) for point in node.corners}
    mixed = any_differ({word for word in words if word is not None})
    speckle = mixed and tree.is_speckle(cell)
    state = "speckle" if speckle else ("mixed" if mixed else "even")
    confirmed = all(map(tree.is_confirmed, node.corners))
    return rows, panel, cell[0], STATES.index(state), int(confirmed)


def define_cells(
    file: h5py.File, plan: Manifest, rows: Mapping[str, NDArray[Any]]
) -> None:
    """Write the groups `cells` and `boundaries` of a refined campaign's results.

    Parameters
    ----------
    file : file opened for writing, by one process or by all
    plan : plan of the campaign; nothing is written if it is not refined
    rows : {variable: (cases,)}, words, refined inputs and fidelity
    """
    cells = cells_of(plan)
    if cells is None:
        return
    group = file.create_group(CELLS)
    for name in ("corner", "panel", "level", "state", "confirmed"):
        _put(group, name, getattr(cells, name), "cell")
    mark_words(group["state"], STATES)
    rule = rule_of(plan.refine)
    over = utf8(" ".join(map(variable_name, rule.over)))
    group.attrs["over"] = group["corner"].attrs["over"] = over
    group.attrs["over_dotted"] = utf8(" ".join(rule.over))
    group.attrs["scale"] = utf8(" ".join(rule.scale))
    group.attrs["words"] = utf8(rule.words)
    group.attrs["dropped"] = np.int64(dropped_of(plan))
    _define_boundaries(file, cells, rows)


def _define_boundaries(
    file: h5py.File, cells: Cells, rows: Mapping[str, NDArray[Any]]
) -> None:
    by = _text(file[CELLS].attrs["words"])
    found = boundaries_of(cells, _cases(file, rows, by))
    group = file.create_group(BOUNDARIES)
    group.attrs["words"] = utf8(by)
    over, dotted = (_list(file, name) for name in ("over", "over_dotted"))
    _put_points(group, found, over, dotted)


def _cases(file: h5py.File, rows: Mapping[str, NDArray[Any]], by: str) -> Cases:
    """Return the cases of a refined map with the words that its boundaries separate.

    Parameters
    ----------
    file : results file, which has the group `cells`
    rows : {variable: (cases,)}, words, refined inputs and fidelity
    by : kind of word, see `refinement.words`
    """
    return Cases(
        np.array([rows[name] for name in _list(file, "over")], dtype=float),
        _list(file, "scale"),
        _words(rows, by),
        _fidelity(rows, by),
    )


def _fidelity(rows: Mapping[str, NDArray[Any]], by: str) -> NDArray[np.int64]:
    """Return 1 for each case whose word is confirmed, or sure without that; else 0.

    It is 0 for all where no word was confirmed. Only regimes are sure, see
    `refinement.rule.Rule.is_sure`.

    rows, by : {variable: (cases,)}; kind of word, see `refinement.words`
    """
    second = np.asarray(rows["fidelity"], np.int64)
    if by != REGIME or COARSE not in rows or not second.any():
        return second
    sure = (rows[COARSE] == rows["regime"]) & (rows["regime"] != "none")
    return np.where(sure, 1, second)


def _list(file: h5py.File, name: str) -> list[str]:
    return _text(file[CELLS].attrs[name]).split()


def _put_points(
    group: h5py.Group, found: Boundaries, over: list[str], dotted: list[str]
) -> None:
    for number, name in enumerate(over):
        _put(group, name, found.at[:, number], "point", INPUTS[dotted[number]])
    for name in ("low", "high", "along", "before", "behind", "panel"):
        _put(group, name, getattr(found, name), "point")
    for number, name in enumerate(("line_begin", "line_end")):
        _put(group, name, found.lines[:, number], "line")


def _put(
    group: h5py.Group,
    name: str,
    values: NDArray[Any],
    axis: str,
    quantity: Quantity | None = None,
) -> None:
    """Write a variable into a group, and define its axis there if needed.

    Parameters
    ----------
    group : `cells` or `boundaries`
    name, values : the variable, (n,), or (n, corners)
    axis : name of its first axis, such as "cell" or "point"
    quantity : unit and meaning of the variable; None: those in `TOLD`
    """
    quantity = quantity or TOLD[name]
    kind = "i1" if quantity.kind == "enum" else values.dtype
    data = group.create_dataset(name, data=values.astype(kind))
    tell(data, quantity)
    for place, dimension in enumerate([axis, "vertex"][: values.ndim]):
        if dimension not in group:
            define_axis(group, dimension, values.shape[place])
        data.dims[place].attach_scale(group[dimension])


def _words(rows: Mapping[str, NDArray[Any]], by: str) -> list[Word]:
    """Return the word of each case that refinement compares, (cases,); "": none.

    Parameters
    ----------
    rows : {variable: (cases,)}
    by : kind of word, see `refinement.words`
    """
    lost = (rows["status"] != "ok") | np.isin(rows["outcome"], NO_REGIME)
    names = [n for n in ("regime", "whirl", *NUMBERS) if n in rows]
    cases = zip(*(rows[n].tolist() for n in names), strict=True)
    found = list[Word]()
    for none, values in zip(lost.tolist(), cases, strict=True):
        row = dict(zip(names, values, strict=True))
        if by == ATTRACTOR:
            row["features"] = features_of(row)
        found.append("" if none else word_of(by, row))
    return found


def write_boundaries(file: h5py.File) -> None:
    """Write boundaries and states of cells again, after `classify` has changed words.

    file : results file, opened for writing; unchanged if the campaign is not refined
    """
    if CELLS not in file:
        return
    cells, rows = _mixed_by(file, _text(file[CELLS].attrs["words"]))
    file[CELLS]["state"][:] = cells.state
    del file[BOUNDARIES]
    _define_boundaries(file, cells, rows)


def _mixed_by(file: h5py.File, by: str) -> tuple[Cells, dict[str, NDArray[Any]]]:
    """Return the cells with states that follow from the present words in the file.

    Cells in speckle keep this state.

    Parameters
    ----------
    file : results file
    by : kind of word that decides, see `refinement.words`

    Returns
    -------
    the cells; and {variable: (cases,)} of words, refined inputs and fidelity
    """
    group = file[CELLS]
    own = {n: group[n][:] for n in ("corner", "panel", "level", "state", "confirmed")}
    names = ["status", "outcome", "regime", "whirl"]
    names += [COARSE] if COARSE in file else []
    rows: dict[str, Any] = {name: words_in(file, name) for name in names}
    more = NUMBERS if by == ATTRACTOR else ()
    rows |= {name: file[name][:] for name in (*_list(file, "over"), "fidelity", *more)}
    words = [*_words(rows, by), ""]  # the last one is for corners without a case
    differ = [
        any_differ({words[case] for case in each} - {""}) for each in own["corner"]
    ]
    still = own["state"] == STATES.index("speckle")
    own["state"] = np.where(still, own["state"], np.array(differ, dtype=np.int64))
    return Cells(**own), rows


def read_refined(path: Path, by: str = "") -> Refined | None:
    """Read the cells and boundaries of a refined map from its results file.

    Parameters
    ----------
    path : the results file
    by : kind of word that changes at the boundaries, "regime" or "whirl"; "": the kind
        by which cells were split

    Returns
    -------
    cells and boundaries; None if the campaign is not refined
    """
    with reading(path), h5py.File(path, "r") as file:
        if CELLS not in file:
            return None
        over = _list(file, "over")
        by = by or _text(file[CELLS].attrs["words"])
        cells, rows = _mixed_by(file, by)
        found = boundaries_of(cells, _cases(file, rows, by))
        return Refined(
            over,
            _list(file, "scale"),
            cells,
            file["panel"][:],
            {name: rows[name] == rows[name].max() for name in over},
            by,
            dict(zip(over, found.at.T, strict=True)),
            found.panel,
            found.lines,
        )


def _text(value: Any) -> str:
    return value.decode() if isinstance(value, bytes) else str(value)
