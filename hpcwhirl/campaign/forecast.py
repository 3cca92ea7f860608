"""What a campaign will cost, before it runs: core-hours and bytes on disk."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hpcwhirl.campaign.cost import Costs, costs_of
from hpcwhirl.campaign.design import Design
from hpcwhirl.campaign.ending import facts_of
from hpcwhirl.campaign.simulate import simulate
from hpcwhirl.campaign.stages import Stages, Todo
from hpcwhirl.campaign.work import learn_ends, share
from hpcwhirl.case.limits import step_counts
from hpcwhirl.case.resolve import Case
from hpcwhirl.dynamics.march import March
from hpcwhirl.errors import WhirlError
from hpcwhirl.launch import Shard
from hpcwhirl.scene import Scene, apply_settings
from hpcwhirl.store.contents import sizes_of
from hpcwhirl.store.manifest import NAME
from hpcwhirl.store.sizes import Bytes, bytes_of

PROBE = 0.03  # s of computing a probe
FIRST = 2000  # steps of its first slice
KINDS = 12  # of scheme, engine, eta and step that are probed at most


@dataclass(frozen=True)
class Forecast:
    """What is left of a campaign.

    Attributes
    ----------
    cases, left : all, and those without a result
    steps : of those that are left, if they run to their end
    seconds : of one core for them; of those that go on while they are undecided, to
        the next time that their word is asked for
    most : the same if all of those are undecided for as long as they may be
    probed, finished : cases that the cost of a step is learned from: marched for
        `PROBE` seconds, or finished in the directory before
    disk : of the whole campaign, if no case ends early
    """

    cases: int
    left: int
    steps: float
    seconds: float
    most: float
    probed: int
    finished: int
    disk: Bytes


def forecast(
    design: Design,
    folder: Path,
    shard: Shard | None = None,
    extended: Sequence[float] = (),
) -> Forecast:
    """Return what is left to compute of a design, and the bytes it will all take.

    Parameters
    ----------
    design : the campaign
    folder : its directory; if it has finished cases, they are learned from
    shard : whose cases alone are counted
    extended : s, to what undecided cases go on, see `stages`
    """
    costs = costs_of(design)
    mine = share(costs.steps, shard)
    begun = (folder / NAME).exists()
    ended = learn_ends(folder, design, costs) if begun else {}
    stages = Stages(design, extended)
    open_ = {c: stage for c, stage in stages.left(ended).items() if c in mine}
    left = list(open_)
    spans = np.array([_spans(stages, *item) for item in open_.items()]).reshape(-1, 2)
    finished = int(np.isfinite(costs.factor).sum())
    probes = [] if finished else _probes(design)
    probed = sum(_probe(design, case, costs) for case in probes)
    seconds = costs.predict(left)
    steps = np.array([costs.steps[case] for case in left])
    return Forecast(
        cases=len(mine),
        left=len(left),
        steps=float(steps @ spans[:, 0]),
        seconds=float(seconds @ spans[:, 0]),
        most=float(seconds @ spans[:, 1]),
        probed=probed,
        finished=finished,
        disk=_disk(design, stages),
    )


def _spans(stages: Stages, case: int, todo: Todo) -> tuple[float, float]:
    """Return how long a case and twins are marched at least, at most, over its time."""
    found = np.array([_span(stages, case, stage) for _, stage in todo])
    least, most = found.sum(axis=0)
    twins = stages.design.twins
    if twins and twins.of == "boundary" and todo[0][0] == 0:  # it is not yet known
        most += twins.count * _span(stages, case, 0)[1]
    return float(least), float(most)


def _span(stages: Stages, case: int, stage: int) -> tuple[float, float]:
    """Return the same of one of these, from a stage on."""
    ends = stages.design.scenes[case].end_times
    times = stages.times(case)
    longest = (times or ends)[-1]
    if stage == 0:
        return 1.0, longest / ends[0]
    before = times[stage - 2] if stage > 1 else ends[-1]
    soon = min(2.0 * before, times[stage - 1])
    return (soon - before) / ends[0], (longest - before) / ends[0]


def _probes(design: Design) -> list[int]:
    """Return the cases to measure: the first, middle and last of each kind."""
    kinds: dict[object, list[int]] = {}
    for case, scene in enumerate(design.scenes):
        solver = scene.solver
        kind = scene.engine, solver.scheme, solver.modes, solver.time_step
        kinds.setdefault(kind, []).append(case)
    chosen: set[int] = set()
    for place in np.linspace(0, len(kinds) - 1, min(KINDS, len(kinds))).round():
        cases = list(kinds.values())[int(place)]
        chosen |= {cases[i] for i in (0, len(cases) // 2, -1)}
    return sorted(chosen)


def _probe(design: Design, case: int, costs: Costs) -> bool:
    """March a case for a moment and learn; return whether it could be marched."""
    try:
        resolved = design.resolved(case)
        march = March(resolved)
        march.advance(1)  # compiles
        march.seconds, size = 0.0, FIRST
        while march.seconds < PROBE and not march.done:
            march.advance(size)
            size *= 2
    except WhirlError:  # it will fail as a row
        return False
    step = march.seconds / max(march.steps - 1, 1)
    costs.learn([case], step * resolved.steps)
    return True


def _disk(design: Design, stages: Stages) -> Bytes:
    """Return the bytes of the campaign, if every case runs to its longest end."""
    samples = np.zeros(len(design.scenes), dtype=np.int64)
    intervals = np.full(len(design.scenes), np.nan)
    for case, scene in enumerate(design.scenes):
        count, intervals[case] = _sampling(design.resolved(case))
        longest = _span(stages, case, 0)[1]
        samples[case] = int(longest * count) if _keeps(scene) else 0
    sizes = sizes_of(_kinds(design))
    return bytes_of(design.manifest(), samples, intervals, sizes, facts_of(design))


def _kinds(design: Design) -> list[dict[str, tuple[int, ...]]]:
    """Return {trace: shape without samples} of the cases with most in their traces."""
    rotor = max(design.scenes, key=lambda s: s.engine.rotor.blades)
    casing = max(design.scenes, key=lambda s: s.engine.casing.harmonics)
    found = []
    for scene in {id(s): s for s in (rotor, casing) if _keeps(s)}.values():
        step = scene.solver.time_step
        short = {"duration": 20 * step, "revolutions": 0.0, "interval": step}
        try:
            traces = simulate(apply_settings(scene, short)).traces
        except WhirlError:  # it will fail as a row
            continue
        found.append({name: values.shape[1:] for name, values in traces.items()})
    return found


def _keeps(scene: Scene) -> bool:
    return scene.output.traces not in {"summary", "blades"}


def _sampling(case: Case) -> tuple[int, float]:
    """Return the samples of a case and the seconds between them."""
    try:
        total, stride = step_counts(case.scene)
    except WhirlError:  # it will fail as a row
        return 0, np.nan
    return total // stride, stride * case.scene.solver.time_step
