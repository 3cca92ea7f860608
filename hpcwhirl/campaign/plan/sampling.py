"""Random inputs of cases ([sample]), and slightly changed copies of cases ([twins]).

With [sample], inputs are drawn at each point of a sweep. Every point gets the same
draws, so that points differ only by the swept inputs. All methods except
`latin_hypercube` can be continued: a larger `count` keeps the earlier draws. With
`saltelli`, each of the `count` draws consists of a pair A, B of independent draws and,
for each sampled input, a copy of A with this input taken from B (Saltelli et al.,
Computer Physics Communications 181, 2010, doi:10.1016/j.cpc.2009.09.018).

The directory stores the draws. A continued campaign uses these, even if another version
of SciPy would draw differently.

Twins of a case, by which the certainty of its regime is estimated, are the case with
uncertain inputs multiplied by 1 + spread u. The number u, uniform in -1 .. 1, depends
only on the case's inputs (`identity`), the number of the twin, the name of the input
and the seed, so that a twin is the same wherever and whenever it is computed.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from hpcwhirl.arrays import Floats
from hpcwhirl.errors import InputError, as_table
from hpcwhirl.planner.kinds import LATE
from hpcwhirl.scene import Scene, apply_settings, flatten
from hpcwhirl.scene.batch_validation import Many
from hpcwhirl.scene.campaign_tables import LATIN, SALTELLI, SampleTable, TwinsTable
from hpcwhirl.scene.case_digest import digest_of
from hpcwhirl.scene.input_names import MISTUNING, takes_list
from hpcwhirl.scene.laws import drawn
from hpcwhirl.scene.swept import MOST_CASES
from hpcwhirl.scene.table import Axis, Table, listed
from hpcwhirl.store.directory.manifest import SAMPLE
from hpcwhirl.store.reading.shares import WHICH
from hpcwhirl.store.results.sampled import TUNED

BLADES = "engine.rotor.blades"
CHAOS = "output.chaos"
# {input: default} of inputs that do not affect how twins are drawn
ASIDE = {
    name: flatten(Scene())[name]
    for name in (
        "solver.until", "solver.longest", "output.traces", "output.interval", CHAOS,
        "output.forces",
    )
}  # fmt: skip
BITS = 53  # number of bits in the significand of a double


class Sample(SampleTable):
    """The table [sample] of a campaign, which draws random inputs of cases."""

    @property
    def each(self) -> int:
        """Number of cases at each point of the sweep: draws, and the tuned engine.

        The tuned engine, with equal blades, is added if [sample] asks for it.
        """
        width = len(self.laws) + 2 if self.method == SALTELLI else 1
        return self.tuned + self.count * width

    def plan(self) -> dict[str, Any]:
        """Return those entries of [sample] on which the draws depend, for the plan."""
        laws = {name: law.model_dump() for name, law in self.laws.items()}
        found = {"method": self.method, "seed": self.seed, "inputs": laws}
        found |= {"count": self.count} if self.method == LATIN else {}
        return found | ({TUNED: True} if self.tuned else {})

    def draws(self, blades: int) -> Axis:
        """Return the drawn values of the inputs of [sample] as an axis of cases.

        blades : N, the number of values in a draw of an input with one per blade
        """
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
        together = np.stack(blocks, axis=1)  # A, B, then the copies of A, draw by draw
        return self._axis(together.reshape(-1, sum(widths)), widths)

    def _unit(self, size: int) -> Floats:
        """Return the draws as points in the unit cube, (count, size).

        The distributions (laws) of the inputs are applied to them afterwards.

        size : number of numbers in a draw
        """
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
    """Return the checked table [sample] of a campaign's TOML; None if there is none.

    Raises
    ------
    InputError
        naming the key, its value and what is allowed
    """
    if SAMPLE not in document:
        return None
    table = as_table("[sample]", document[SAMPLE])
    for other in ("cases", "refine"):
        if other in document:
            msg = f"[sample] goes with [sweep] and [zip], not with [{other}]"
            raise InputError(msg)
    return Sample.of(table)


def sampled_rows(sample: Sample | None, rows: Table, base: Scene) -> Table:
    """Return {input: value} of all cases: every draw at each point of the sweep.

    Parameters
    ----------
    sample : table [sample]; None: no draws
    rows : {input: value} of each point of the sweep
    base : scene with the other inputs

    Raises
    ------
    InputError
        if a drawn input is swept, too, or if there are too many cases
    """
    if sample is None:
        return rows
    swept = set(rows.names)
    twice = swept & sample.laws.keys()
    if twice:
        raise InputError(f"{min(twice)} is in [sweep] or [zip] and in [sample]")
    if BLADES in swept and any(map(takes_list, sample.laws)):
        msg = f"[sample] draws one number per blade: {BLADES} cannot be swept"
        raise InputError(msg)
    _check_twin(sample, base)
    if len(rows) * sample.each > MOST_CASES:
        many = f"{len(rows)} points of {sample.each} draws"
        raise InputError(f"a campaign has at most {MOST_CASES} cases, got {many}")
    return rows.times(sample.draws(base.engine.rotor.blades))


def _check_twin(sample: Sample, base: Scene) -> None:
    """Raise InputError if the tuned engine would get other modes or another time step.

    Parameters
    ----------
    sample : table [sample]; it may ask for a case of the tuned engine, to compare
    base : scene with the inputs that are not drawn
    """
    for name in ("truncation", "accuracy"):
        value = getattr(base.solver, name)
        if sample.tuned and value:
            msg = f"[sample] {TUNED} needs the same modes and time_step in all cases: "
            msg += f"{name}, which chooses them case by case, must be 0, got {value:g}"
            raise InputError(msg)


def check_scenes(base: Scene, rows: Table, sample: Sample | None) -> None:
    """Raise InputError if a case of a campaign has an invalid input.

    The message names the draw if the input was drawn.

    Parameters
    ----------
    base : scene with the inputs that do not vary
    rows : {input: value} of each case
    sample : table [sample]; None: no draws
    """
    many = Many(base, rows)
    try:
        many.check()
    except InputError as failed:
        if sample is None:
            raise
        draw = many.first_wrong() % sample.each
        msg = f"[sample] draw {draw} gives an invalid input: {failed}; uniform and "
        raise InputError(msg + "truncated_normal keep draws within bounds") from None


class Twins(TwinsTable):
    """The table [twins] of a campaign, which makes the twins of its cases."""

    @property
    def is_late(self) -> bool:
        """Whether twins are given to cases only after all regimes are known."""
        return self.of in LATE

    @property
    def told(self) -> str:
        """Which cases have how many twins, as text for messages."""
        which = "case" if self.of == "all" else f"of the {WHICH[self.of]}"
        return f"{self.count} twins for each {which}"

    def scene(self, scene: Scene, content: str, number: int) -> Scene:
        """Return the scene of one twin of a case; a twin keeps no traces.

        Parameters
        ----------
        scene : the case
        content : digest of the case's engine file, see `scene.digest`
        number : number of the twin, 1 .. count
        """
        values, motion = flatten(scene), identity(scene, content)
        changed: dict[str, Any] = {"output.traces": "summary", CHAOS: 0.0}
        changed["output.forces"] = "none"
        for name, spread in self.spread.items():
            factor = 1.0 + spread * draw(motion, number, name, self.seed)
            changed[name] = float(str(values[name])) * factor
        return apply_settings(scene, changed)


def identity(scene: Scene, content: str) -> str:
    """Return the text that decides how the inputs of a case's twins are changed.

    It is a digest of the case's inputs, except those that set how long undecided cases
    continue and which traces are kept; so a case with other values of these has the
    same twins.

    Parameters
    ----------
    scene : the case
    content : digest of the case's engine file, see `scene.digest`
    """
    return digest_of(flatten(scene) | ASIDE, content)


def draw(motion: str, number: int, name: str, seed: int = 0) -> float:
    """Return u, -1 .. 1, by which one input of one twin is changed; drawn uniformly.

    The input is multiplied by 1 + spread u.

    Parameters
    ----------
    motion : digest of the case, see `identity`
    number : number of the twin, 1 .. count
    name : dotted name of the input
    seed : seed of the table [twins]
    """
    told = f"{motion} {number} {name}" + (f" {seed}" if seed else "")
    found = hashlib.sha256(told.encode()).digest()
    whole = int.from_bytes(found[:8]) >> (64 - BITS)
    return float(2.0 * whole / (2**BITS - 1) - 1.0)


def twins_of(document: Mapping[str, Any]) -> Twins | None:
    """Return the checked table [twins] of a campaign's TOML; None if there is none.

    Raises
    ------
    InputError
        naming the key, its value and what is allowed
    """
    if "twins" not in document:
        return None
    twins = Twins.read(document["twins"], "[twins]")
    if twins.of == "speckle" and "refine" not in document:
        msg = "[twins] of must be all, boundary or even (speckle needs [refine]), got "
        raise InputError(msg + "'speckle'")
    return twins


def check_spread(twins: Twins, base: Scene, rows: Table) -> None:
    """Raise InputError if twins would equal their case: a changed input is 0.

    Twins change inputs by a relative amount, which has no effect on 0.

    Parameters
    ----------
    twins : table [twins]
    base : scene with the inputs that are not swept
    rows : {dotted input: value} that each case sets
    """
    values = flatten(base)
    for name in twins.spread:
        column = rows.column(name, values[name])
        zero = [place for place, v in enumerate(listed(column.values)) if v == 0.0]
        if zero:
            case = column.case_of(zero[0])
            msg = f"[twins] spread {name}: {name} is 0 in case {case}, and a relative "
            raise InputError(msg + "change of 0 has no effect: spread another input")
