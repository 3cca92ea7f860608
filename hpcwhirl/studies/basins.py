"""Basins: the share of starts that end on each motion, and how mixed these starts are.

A start is a set of values of the inputs `STARTS`, which determine how a run begins but
not the equations of its later motion. A point is one combination of the other swept
inputs, such as speed and gap. If starts are drawn by [sample], a motion's share of the
starts of a point has the confidence interval of independent draws; if they are swept,
they form a grid, whose boxes give the basin entropy (Daza, Wagemakers, Georgeot,
Guéry-Odelin, Sanjuán, Scientific Reports 6, 2016, 31416, doi:10.1038/srep31416).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.arrays import Floats
from hpcwhirl.errors import InputError, unknown
from hpcwhirl.scene.words import COUNTED
from hpcwhirl.store.reading.select import swept_of
from hpcwhirl.store.results.sampled import drawn_of, is_sampled
from hpcwhirl.studies.attractors import attractors
from hpcwhirl.studies.shares import ends_of, shares_of

if TYPE_CHECKING:
    import xarray

Ints = NDArray[np.int64]
STARTS = (
    "force", "pulse", "nodal_diameter", "direction", "unbalance_phase", "start_energy",
    "start_modes", "start_draw", "start_as",
)  # fmt: skip
# inputs of a start whose values have no order: a box does not span several of them
APART = ("nodal_diameter", "direction", "start_modes", "start_draw", "start_as")
BY = ("regime", "attractor")
BOX = 5  # number of starts along each side of a box, as in Daza et al. 2016
MEASURES = {
    "entropy": "Shannon entropy of the shares, natural logarithm",
    "basin_entropy": "S_b: mean entropy of boxes of starts, natural logarithm",
    "boundary_entropy": "S_bb: mean entropy of boxes with several motions",
    "boxes": "boxes of starts",
}


@dataclass(frozen=True)
class Starts:
    """The inputs that set the starts of a campaign's cases, and the point of each case.

    Attributes
    ----------
    inputs : names of the inputs that differ between the starts of a point
    drawn : whether `inputs` were drawn by [sample] instead of swept by [sweep]
    swept : names of the other swept inputs
    point : (cases,), number of each case's combination of `swept`, a point of the sweep
    chosen : (cases,), whether a case counts: with method "saltelli" only independent
        draws do, otherwise all cases
    """

    inputs: tuple[str, ...]
    drawn: bool
    swept: tuple[str, ...]
    point: Ints
    chosen: NDArray[np.bool_]


def starts_of(data: xarray.Dataset) -> Starts:
    """Return which inputs set the starts of a campaign's cases, and each case's point.

    data : results from `open_results`

    Raises
    ------
    InputError
        if all starts are equal, an input that is none of `STARTS` was drawn, the map
        was refined, or the campaign has branches
    """
    swept = swept_of(data)
    if "final" in data:
        msg = "starts of a [refine]d map lie where words change, not evenly: use "
        raise InputError(msg + "[sweep] or [sample] for basins")
    if "branch" in swept:
        msg = "cases of [branch] begin where other cases ended, not with a pulse of "
        raise InputError(msg + "their own; see hpcwhirl branches")
    if is_sampled(data):
        drawn = drawn_of(data)
        other = sorted({*drawn.inputs} - {*STARTS})
        if other:
            msg = f"{other[0]} was drawn, which changes more than the start: basins "
            msg += f"need {', '.join(STARTS)}; hpcwhirl map shows shares of any draws"
            raise InputError(msg)
        inputs, chosen = drawn.inputs, drawn.independent
    else:
        inputs = tuple(n for n in swept if n in STARTS)
        chosen = np.ones(data.sizes["case"], dtype=bool)
    if not inputs:
        msg = f"no start was drawn or swept: basins need one of {', '.join(STARTS)} in "
        raise InputError(msg + "[sample] or [sweep], see hpcwhirl manual basins")
    rest = tuple(n for n in swept if n not in inputs)
    return Starts(inputs, is_sampled(data), rest, _points(data, rest), chosen)


def _points(data: xarray.Dataset, swept: Sequence[str]) -> Ints:
    """Return the number of each case's combination of the inputs `swept`, (cases,).

    Combinations are numbered from 0 in ascending order of the first input, then of the
    next one; texts in the order in which they occur first.
    """
    columns = []
    for name in swept:
        values = data[name].to_numpy()
        if values.dtype.kind not in "iufb":
            order = {text: i for i, text in enumerate(dict.fromkeys(values.tolist()))}
            values = np.array([order[text] for text in values.tolist()])
        columns.append(values)
    if not columns:
        return np.zeros(data.sizes["case"], dtype=np.int64)
    found = np.unique(np.column_stack(columns), axis=0, return_inverse=True)[1]
    return np.asarray(found.ravel(), dtype=np.int64)


def basins(data: xarray.Dataset, by: str = "regime", box: int = BOX) -> xarray.Dataset:
    """Return the share of starts that end on each motion, at each point of a sweep.

    Overloaded starts are a kind of their own. Cases without a result, failed or
    unstable, count only in `lost`.

    Parameters
    ----------
    data : results from `open_results`, of a campaign whose starts differ
    by : what counts as one motion: "regime" (all sustained cases are one), or
        "attractor" (groups of similar motions, see `attractors`)
    box : number of starts along each side of a box of the grid, for `basin_entropy`;
        always 1 along inputs whose values have no order, `APART`

    Returns
    -------
    xarray.Dataset over `point`, with the other swept inputs as coordinates, and over
    `regime` or `attractor`: `share`, `share_low`, `share_high` (Wilson's 95 % interval,
    for a grid as if its starts had been drawn), `count`; by attractor also the medians
    `orbit_radius` and `line_frequency`; over `point` only `cases`, `lost`, `entropy`
    and, if starts form a grid, `basin_entropy`, `boundary_entropy`, `boxes`. `motion`
    has the motion of each case, over `case`

    Raises
    ------
    InputError
        for another `by`, a box of fewer than 2 starts, or as for `starts_of`
    """
    if by not in BY:
        raise unknown("motions by", by, BY)
    if box < 2:
        raise InputError(f"box must be >= 2 starts per side, got {box}")
    starts = starts_of(data)
    word = ends_of(data)
    kinds = list(COUNTED)
    if by == "attractor":
        word = attractors(data, starts.point)
        kinds = in_order(word)
    found = shares_of(word, kinds, starts.point, starts.chosen, by)
    first = np.unique(starts.point, return_index=True)[1]
    found = found.assign_coords(
        {n: ("point", data[n].to_numpy()[first], data[n].attrs) for n in starts.swept}
    )
    measures: dict[str, Any] = {"entropy": entropy(found["count"].to_numpy())}
    if not starts.drawn:
        measures |= _boxed(data, starts, word, box)
    if by == "attractor":
        found = _with_medians(found, data, word, starts)
    found = found.assign({n: ("point", v) for n, v in measures.items()})
    for name in measures:
        found[name].attrs = {"units": "1", "long_name": MEASURES[name]}
    told = {"starts": " ".join(starts.inputs), "drawn": int(starts.drawn)}
    return found.assign(motion=("case", word)).assign_attrs(told)


def with_attractors(data: xarray.Dataset) -> xarray.Dataset:
    """Return results with a variable `attractor` over `case`, such as "A1 sustained".

    data : results from `open_results`, of a campaign whose starts differ
    """
    return data.assign(attractor=("case", attractors(data, starts_of(data).point)))


def in_order(word: NDArray[np.str_]) -> list[str]:
    """Return the names that occur among motions: damped, A1, A2, ..., and the rest.

    word : (cases,), name of each case's motion from `attractors`
    """
    known = set(word.tolist()) - {""}
    numbered = sorted(known - {*COUNTED}, key=lambda name: int(name.split()[0][1:]))
    plain = [name for name in COUNTED if name in known]
    return [*(n for n in plain if n == "damped"), *numbered,
            *(n for n in plain if n != "damped")]  # fmt: skip


def entropy(count: NDArray[Any]) -> Floats:
    """Return the Shannon entropy -sum p ln p, p being the share of each kind of motion.

    NaN where all counts are 0.

    count : (..., kinds), number of starts that end on each kind of motion
    """
    from scipy.stats import entropy as of

    total = count.sum(axis=-1)
    found = of(np.where(total[..., None] > 0, count, 1), axis=-1)
    return np.where(total > 0, found, np.nan)


def _with_medians(
    found: xarray.Dataset, data: xarray.Dataset, word: NDArray[np.str_], starts: Starts
) -> xarray.Dataset:
    """Return a table of shares with each attractor's medians at each point added.

    The medians are those of `orbit_radius` and `line_frequency`; NaN where no case of
    the point ends on the attractor, and for words that are no attractor.

    Parameters
    ----------
    found : table of shares over `point` and `attractor`, from `shares_of`
    data : results
    word : (cases,), attractor of each case
    starts : starts of the cases
    """
    points, kinds = found["point"].to_numpy(), found["attractor"].to_numpy()
    for name in ("orbit_radius", "line_frequency"):
        value = data[name].to_numpy()
        table = np.full((len(points), len(kinds)), np.nan)
        for column, kind in enumerate(kinds):
            if kind in COUNTED:
                continue
            for row, point in enumerate(points):
                own = value[(word == kind) & (starts.point == point) & starts.chosen]
                if len(own):
                    table[row, column] = np.median(own)
        found = found.assign({name: (("point", "attractor"), table, data[name].attrs)})
    return found


def _boxed(
    data: xarray.Dataset, starts: Starts, word: NDArray[np.str_], box: int
) -> dict[str, Any]:
    """Return the entropies of the grid of starts at each point, and its boxes.

    Returns {"basin_entropy", "boundary_entropy", "boxes": (points,)}, the numbers that
    `basin_entropy` computes; NaN and 0 boxes at a point whose starts form no grid

    word, box : motion of each case; number of starts along each side of a box
    """
    rows = []
    for point in np.unique(starts.point):
        own = np.flatnonzero(starts.point == point)
        grid = _grid(data.isel(case=own), starts.inputs, word[own])
        if grid is None:
            rows.append((np.nan, np.nan, 0))
            continue
        sides = [1 if n in APART else box for n in starts.inputs]
        rows.append(basin_entropy(grid, sides))
    names = ("basin_entropy", "boundary_entropy", "boxes")
    return dict(zip(names, map(np.array, zip(*rows, strict=True)), strict=True))


def _grid(
    data: xarray.Dataset, inputs: Sequence[str], word: NDArray[np.str_]
) -> NDArray[np.str_] | None:
    """Return the motions of one point's cases as an array, an axis for each input.

    None if some combination of the inputs' values has no case, or several.

    Parameters
    ----------
    data : results of the cases of one point
    inputs : names of the inputs that set a start
    word : (cases,), motion of each case in `data`
    """
    places = [np.unique(data[n].to_numpy(), return_inverse=True) for n in inputs]
    shape = tuple(len(known) for known, _ in places)
    number = np.ravel_multi_index([own for _, own in places], shape)
    if len(set(number.tolist())) < np.prod(shape) or len(number) > np.prod(shape):
        return None
    found = np.empty(shape, dtype=word.dtype)
    found.ravel()[number] = word
    return found


def basin_entropy(
    motion: NDArray[Any], sides: Sequence[int]
) -> tuple[float, float, int]:
    """Return basin entropy and boundary basin entropy of a grid of starts, and boxes.

    The grid is cut into boxes of neighbouring starts; S_i is the entropy of the motions
    in box i.

    S_b = (1/N) sum_i S_i over all N boxes, and S_bb = (1/N_b) sum_i S_i over the N_b
    boxes with more than one motion, with S_i = -sum_j p_ij ln p_ij (Daza et al. 2016).
    S_bb > ln 2 means that a boundary is fractal. With few starts in a box, S_i is too
    small by about (motions - 1)/(2 starts).

    Parameters
    ----------
    motion : name of the motion on which each start of the grid ends, an axis for each
        input; "" for none
    sides : number of starts along each side of a box; starts left over at the end of an
        axis belong to no box

    Returns
    -------
    S_b, S_bb and the number of boxes; NaN, NaN, 0 if the grid is smaller than a box;
    S_bb is 0 without a boundary
    """
    whole = [n // side for n, side in zip(motion.shape, sides, strict=True)]
    if not all(whole):
        return np.nan, np.nan, 0
    cut = motion[tuple(slice(n * s) for n, s in zip(whole, sides, strict=True))]
    split = [part for pair in zip(whole, sides, strict=True) for part in pair]
    axes = [*range(0, len(split), 2), *range(1, len(split), 2)]
    boxes = cut.reshape(split).transpose(axes).reshape(int(np.prod(whole)), -1)
    kinds = [kind for kind in np.unique(boxes).tolist() if kind != ""]
    if not kinds:
        return np.nan, np.nan, 0
    count = np.stack([(boxes == kind).sum(axis=1) for kind in kinds], axis=1)
    each = entropy(count)
    mixed = (count > 0).sum(axis=1) > 1
    boundary = float(each[mixed].mean()) if mixed.any() else 0.0
    return float(np.nanmean(each)), boundary, len(boxes)
