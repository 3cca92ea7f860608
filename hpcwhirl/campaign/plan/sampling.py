"""[sample]: draws of inputs by their distributions, at each point of a sweep.

Every point gets the same draws, so that points differ by what was swept alone. All
methods but `latin_hypercube` go on where they were: a larger `count` keeps the draws
that there are. With `saltelli` each of `count` draws is a pair A, B of independent
ones, and for each sampled input a copy of A with this input of B (Saltelli et al.,
Computer Physics Communications 181, 2010, doi:10.1016/j.cpc.2009.09.018).

A directory keeps the draws: one that is continued has those it was begun with, whatever
another version of SciPy would draw.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.campaign.plan.distributions import KEY, drawn, law_of
from hpcwhirl.campaign.plan.swept import MOST_CASES
from hpcwhirl.errors import InputError, as_table, shown, unknown
from hpcwhirl.scene import Scene
from hpcwhirl.scene.files import (
    by_full_name,
    is_whole,
    takes_list,
    undotted,
)
from hpcwhirl.scene.many import Many
from hpcwhirl.scene.quantities import LEAVES
from hpcwhirl.scene.table import Axis, Table, is_begun_by, listed
from hpcwhirl.store.directory.blades import MISTUNING
from hpcwhirl.store.directory.manifest import NAME, SAMPLE, read_manifest
from hpcwhirl.store.results.sampled import SALTELLI, TUNED, drawn_axis

if TYPE_CHECKING:
    from hpcwhirl.campaign.plan.design import Design

Floats = NDArray[np.float64]
TABLE = "sample"
BLADES = "engine.rotor.blades"
LATIN = "latin_hypercube"
METHODS = ("random", "sobol", "halton", LATIN, SALTELLI)
IN_TWOS = ("sobol", SALTELLI)  # balanced where the count is a power of 2
OWN_KEYS = ("method", "count", "seed", "tuned")
LARGEST_SEED = 2**53  # that any JSON keeps


@dataclass(frozen=True)
class Sample:
    """How inputs are drawn.

    Attributes
    ----------
    method : of `METHODS`
    seed : of the method; the same draws for the same seed
    count : draws at each point; of `saltelli`, pairs of draws
    laws : {full dotted input: law of `distributions.law_of`}, in the order of the file
    tuned : whether each point has the tuned engine, too, before its draws
    """

    method: str
    seed: int
    count: int
    laws: dict[str, dict[str, Any]]
    tuned: bool = False

    @property
    def each(self) -> int:
        """Cases at each point."""
        width = len(self.laws) + 2 if self.method == SALTELLI else 1
        return self.tuned + self.count * width

    def plan(self) -> dict[str, Any]:
        """Return what a directory keeps of it: what draws depend on."""
        found = {"method": self.method, "seed": self.seed, "inputs": self.laws}
        found |= {"count": self.count} if self.method == LATIN else {}
        return found | ({TUNED: True} if self.tuned else {})

    def draws(self, blades: int) -> Axis:
        """Return the draws, of an engine of so many blades."""
        widths = [blades if takes_list(name) else 1 for name in self.laws]
        if self.method != SALTELLI:
            found = self._axis(self._unit(sum(widths)), widths)
            if not self.tuned:
                return found
            return Axis((MISTUNING,), ([[], *listed(found.columns[0])],))
        one, other = np.hsplit(self._unit(2 * sum(widths)), 2)
        ends = np.cumsum([0, *widths])
        blocks = [one, other]
        for a, b in pairwise(ends):
            mixed = one.copy()
            mixed[:, a:b] = other[:, a:b]
            blocks.append(mixed)
        together = np.stack(blocks, axis=1)  # a pair and its mixtures follow each other
        return self._axis(together.reshape(-1, sum(widths)), widths)

    def _unit(self, size: int) -> Floats:
        """Return points of the unit cube, (count, size)."""
        from scipy.stats import qmc

        if self.method == "random":
            return np.random.default_rng(self.seed).random((self.count, size))
        kinds = {"halton": qmc.Halton, LATIN: qmc.LatinHypercube}
        kind = kinds.get(self.method, qmc.Sobol)
        return np.asarray(kind(size, rng=self.seed).random(self.count))

    def _axis(self, unit: Floats, widths: Sequence[int]) -> Axis:
        columns: list[Floats] = []
        parts = np.split(unit, np.cumsum(widths)[:-1], axis=1)
        for (name, law), part in zip(self.laws.items(), parts, strict=True):
            values = np.asarray(drawn(law, part), dtype=float)
            columns.append(np.array(values if takes_list(name) else values[:, 0]))
        return Axis(tuple(self.laws), tuple(columns))


def sample_of(document: Mapping[str, Any]) -> Sample | None:
    """Return the table [sample] of a document, checked; None where there is none.

    Raises
    ------
    InputError
        naming the key, what it got and what is allowed
    """
    if TABLE not in document:
        return None
    content = as_table("[sample]", document[TABLE])
    for other in ("cases", "refine"):
        if other in document:
            msg = f"[sample] goes with [sweep] and [zip], not with [{other}]"
            raise InputError(msg)
    method = content.get("method", "sobol")
    if method not in METHODS:
        raise unknown("method of [sample]", str(method), METHODS)
    seed = _whole("seed", content.get("seed", 0), 0, LARGEST_SEED)
    count = _whole("count", content.get("count"), 1, MOST_CASES)
    if method in IN_TWOS and count & (count - 1):
        below = 1 << (count.bit_length() - 1)
        msg = f"[sample] count must be a power of 2 with method {method}, such as "
        raise InputError(msg + f"{below} or {2 * below}, got {count}")
    inputs = {n: value for n, value in content.items() if n not in OWN_KEYS}
    laws = _laws(inputs)
    if method == SALTELLI and len(laws) < 2:
        msg = f"[sample] method {SALTELLI} must have two inputs at least, got "
        raise InputError(msg + ", ".join(laws))
    return Sample(method, seed, count, laws, _tuned(content, method, laws))


def _tuned(content: Mapping[str, Any], method: str, laws: Mapping[str, Any]) -> bool:
    """Return whether a tuned engine is asked for beside draws of mistuning alone."""
    tuned = content.get(TUNED, False)
    if not isinstance(tuned, bool):
        msg = f"[sample] {TUNED} must be true or false, got {shown(tuned)}"
        raise InputError(msg)
    if tuned and (list(laws) != [MISTUNING] or method == SALTELLI):
        msg = f"[sample] {TUNED} goes with draws of mistuning alone, not with "
        others = [n for n in laws if n != MISTUNING] or [f"method {method}"]
        raise InputError(msg + ", ".join(others))
    return tuned


def _whole(key: str, value: Any, least: int, most: int) -> int:
    if not is_whole(value) or not least <= value <= most:
        allowed = f"a whole number from {least} to {most}"
        msg = f"[sample] {key} must be {allowed}, got {shown(value)}"
        raise InputError(msg)
    return int(value)


def _laws(inputs: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return {full dotted input: its checked law}."""
    found: dict[str, dict[str, Any]] = {}
    pairs = ((name, (name, given)) for name, given in undotted(inputs, _is_law))
    for full, (name, given) in by_full_name(pairs, "[sample]").items():
        kind = next(field.annotation for leaf, field in LEAVES if leaf == full)
        if kind is not float and not takes_list(full):
            msg = f"[sample] {name} must be an input of any number between: sweep it"
            raise InputError(msg)
        found[full] = law_of(name, given)
    if not found:
        msg = "[sample] must have an input and its distribution, such as "
        msg += f'gap = {{ {KEY} = "uniform", low = 1e-4, high = 2e-4 }}'
        raise InputError(msg)
    return found


def _is_law(table: Mapping[str, Any]) -> bool:
    return KEY in table or not all(isinstance(v, Mapping) for v in table.values())


def sampled_rows(sample: Sample | None, rows: Table, base: Scene) -> Table:
    """Return the settings of all cases: of each point of a sweep, every draw.

    Raises
    ------
    InputError
        where an input is swept, too, or the cases are too many
    """
    if sample is None:
        return rows
    swept = set(rows.names)
    twice = swept & sample.laws.keys()
    if twice:
        msg = f"{min(twice)} is in [sweep] or [zip] and in [sample]"
        raise InputError(msg)
    if BLADES in swept and any(map(takes_list, sample.laws)):
        msg = f"[sample] draws a number for each blade: {BLADES} cannot be swept"
        raise InputError(msg)
    _check_twin(sample, base)
    if len(rows) * sample.each > MOST_CASES:
        many = f"{len(rows)} points of {sample.each} draws"
        raise InputError(f"a campaign has at most {MOST_CASES} cases, got {many}")
    return rows.times(sample.draws(base.engine.rotor.blades))


def _check_twin(sample: Sample, base: Scene) -> None:
    """Refuse to compare a tuned engine that would be modelled otherwise."""
    for name in ("truncation", "accuracy"):
        value = getattr(base.solver, name)
        if sample.tuned and value:
            msg = (
                f"[sample] {TUNED} goes with modes and time_step for all: {name} must "
            )
            msg += f"be 0, got {value:g}, which chooses others for the tuned engine"
            raise InputError(msg)


def check_scenes(base: Scene, rows: Table, sample: Sample | None) -> None:
    """Refuse cases of which one is no scene; of a draw, say which it was."""
    many = Many(base, rows)
    try:
        many.check()
    except InputError as failed:
        if sample is None:
            raise
        draw = many.first_wrong() % sample.each
        msg = f"[sample] draw {draw} is no input: {failed}; uniform "
        raise InputError(msg + "or truncated_normal keep between bounds") from None


def as_begun(design: Design, folder: Path) -> Design:
    """Return the design with the draws of its directory, where that has some.

    Raises
    ------
    InputError
        where more draws are asked for and SciPy would go on otherwise than it began
    """
    sample = design.sample
    if sample is None or not (folder / NAME).exists():
        return design
    old = read_manifest(folder)
    if old.base.get(SAMPLE) != sample.plan():
        return design  # refused by name when the directory is prepared
    kept, own = drawn_axis(old), drawn_axis(design.manifest())
    if is_begun_by(kept, own) or is_begun_by(own, kept):
        return design
    if len(kept) < len(own):
        msg = (
            f"{folder} has other draws than this version of SciPy makes: it cannot be "
        )
        raise InputError(msg + f"continued beyond {len(kept)} draws a point")
    rows = design.settings.along_last(kept.until(len(own)))
    check_scenes(design.base, rows, sample)
    return replace(design, settings=rows)
