"""Time of a step by number of blades, compared with the peak rates of the machine.

    python scripts/cost/sizes.py [SCENE] [--sizes N ...] [--repeats N] [--json]

Four motions are timed: one far from the casing, that of the scene as given, one with
contact in every step and, for unequal sectors, one in which all blades press on the
casing. With few blades, the first three are also timed for several points a tip.
Operations and bytes are those of the default scheme: which fraction of the measured
rates of a core it reaches.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import parser_of

from hpcwhirl.benchmark.bench import (
    Asked,
    Timing,
    pattern,
    settled_all,
    step_times,
    time_marches,
)
from hpcwhirl.case.resolve import resolve
from hpcwhirl.cli.export_model import arrays_of
from hpcwhirl.dynamics.kernels.kernel_types import CyclicState
from hpcwhirl.dynamics.kernels.loop import wave_types
from hpcwhirl.dynamics.kernels.loop.transform import products, span_of
from hpcwhirl.dynamics.kernels.peak import CHAINS, multiply_add, total_again
from hpcwhirl.dynamics.kernels.vectors import FOUR, widths
from hpcwhirl.dynamics.march import March
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene, apply_settings, named_scene
from hpcwhirl.scene.schemes import DEFAULT
from hpcwhirl.store.hdf5 import write_arrays

ROUNDS = 200_000  # iterations of the peak measurement; they take some 10 ms
READ = 2e8  # bytes read in a measurement of bandwidth
POINTS = 3  # contact points per tip of an engine that has several
TWIST = 0.3  # relative change of radial motion from the middle of a chord to its end
CHORD = {  # places of one end, the middle and the other end: m, rad, m
    "station": [-0.02, 0.0, 0.02], "angle": [-0.01, 0.0, 0.01], "gap": [2e-6, 0.0, 4e-6]
}  # fmt: skip
SIZES = 22, 44, 88, 176
MOST_SEVERAL = 44  # largest number of blades timed also with several points a tip
CYCLIC, UNEQUAL = "equal", "unequal"
FLIGHT, GIVEN, RUBS, PRESSED = "in flight", "as given", "rubs", "all press"
RUBBING = "mostly_damped"  # a scene with contact in every step after the first contact
# a rigid casing that shrinks around all blades, and presses on them from 5 ms on
AROUND: dict[str, Any] = {
    "casing.kind": "rigid", "nodal_diameter": 0, "casing.amplitude": 2e-4,
    "casing.rise": 5e-3, "gap": 1e-4, "friction": 0.02,
}  # fmt: skip


@dataclass(frozen=True)
class Counts:
    """The work of a mean time step.

    Attributes
    ----------
    operations : floating-point operations
    bytes : size of the arrays that the step reads and writes; padding is included
    """

    operations: float
    bytes: float


@dataclass(frozen=True)
class Row:
    """A timing of a step with N blades, and how close it is to the machine's limits.

    Attributes
    ----------
    blades, points : N; n_c, number of contact points a tip
    sectors : whether sectors are equal: `CYCLIC` or `UNEQUAL`
    motion : which motion is timed: `FLIGHT`, `GIVEN`, `RUBS` or `PRESSED`
    timing : measured time of a step
    step_in_contact : time of a step with contact, us; 0 if no step had contact
    counts : operations and bytes of a mean step; with contact a lower bound
    peak, bandwidth : operations and bytes per second, each divided by the highest rate
        measured (of reading: for an array of as many bytes); 0 if `exact` jumps
    """

    blades: int
    points: int
    sectors: str
    motion: str
    timing: Timing
    step_in_contact: float
    counts: Counts
    peak: float
    bandwidth: float


def sized(scene: Scene, blades: int) -> Scene:
    """Return a scene with another number of blades and as many modes per blade.

    blades : the new number N
    """
    own = scene.engine.rotor.blades
    modes = round(scene.solver.modes * blades / own)
    return apply_settings(scene, {"blades": blades, "modes": modes})


def rows_of(
    scene: Scene,
    sizes: Sequence[int],
    repeats: int,
    peak: float,
    several: Sequence[Callable[[Scene], Scene]] = (),
) -> list[Row]:
    """Time a step of several motions of a scene for each number of blades.

    Parameters
    ----------
    scene : scene whose number of blades is changed
    sizes, repeats : numbers of blades; number of repeats of each timing
    peak : GFLOP/s, measured peak rate
    several : functions that return a scene with several contact points a tip

    Raises
    ------
    InputError
        for an engine from file or an engine that is mistuned already
    """
    if scene.engine.file or scene.engine.rotor.is_uneven:
        msg = "timing by number of blades needs a built-in engine with equal blades"
        raise InputError(msg)
    return [row for n in sizes for row in _of_size(scene, n, repeats, peak, several)]


def _of_size(
    scene: Scene,
    blades: int,
    repeats: int,
    peak: float,
    several: Sequence[Callable[[Scene], Scene]],
) -> list[Row]:
    first = CYCLIC, FLIGHT, asked_of(scene, blades, CYCLIC, FLIGHT, "exact")
    requests = [first, *requests_of(scene, blades, several)]
    _, motions, asked = zip(*requests, strict=True)
    marches = settled_all(asked)
    timings = time_marches(asked, marches, repeats)
    flights = {
        (t.engine, march.model.each): t
        for march, t, motion in zip(marches, timings, motions, strict=True)
        if motion == FLIGHT and t.scheme == DEFAULT
    }
    rows = []
    for march, motion, timing in zip(marches, motions, timings, strict=True):
        flight = flights[timing.engine, march.model.each]
        spent = step_times(flight, timing)[1] if timing.contact else 0.0
        counts = Counts(0.0, 0.0)
        if timing.scheme == DEFAULT:
            counts = counts_of(march, timing.contact * timing.touching)
        rows.append(_row(march.model, motion, timing, spent, counts, peak))
    return rows


def requests_of(
    scene: Scene, blades: int, several: Sequence[Callable[[Scene], Scene]]
) -> list[tuple[str, str, Asked]]:
    """Return the requests for all timings with N blades by the scheme `modal`.

    Each is (sectors, motion, request), the first two named as in `Row`.

    blades : N
    several : functions that turn a scene into one with several contact points a tip
    """
    found = []
    for sectors in (CYCLIC, UNEQUAL):
        # if equal sectors all press, only one of them is integrated
        more = [FLIGHT, GIVEN, RUBS] + [PRESSED] * (sectors == UNEQUAL)
        single = [asked_of(scene, blades, sectors, motion) for motion in more]
        for points in (None, *(several if blades <= MOST_SEVERAL else ())):
            for motion, one in zip(more, single, strict=True):
                if points is None:
                    found.append((sectors, motion, one))
                elif motion != PRESSED:
                    own = replace(one, scene=points(one.scene))
                    found.append((sectors, motion, own))
    return found


def asked_of(
    scene: Scene, blades: int, sectors: str, motion: str, scheme: str = DEFAULT
) -> Asked:
    """Return the request to time the steps of one motion with N blades.

    blades, scheme : N; name of the integrator
    sectors, motion : "equal" or "unequal"; name of the motion, as in `Row`
    """
    if motion == RUBS:
        rubbing = {"plan": scene.solver.plan}
        scene = apply_settings(named_scene(RUBBING), rubbing)
    scene = sized(scene, blades)
    if sectors == UNEQUAL:
        scene = apply_settings(scene, {"mistuning": pattern(blades)})
    if motion == PRESSED:
        scene = apply_settings(scene, AROUND)
    return Asked(scene, scheme, motion != FLIGHT, sectors)


def _row(
    model: Model, motion: str, timing: Timing, spent: float, counts: Counts, peak: float
) -> Row:
    peak_share = bandwidth = 0.0
    if counts.bytes:
        rate = 1e-3 / timing.microseconds_per_step  # GHz
        peak_share = rate * counts.operations / peak
        bandwidth = rate * counts.bytes / read_bandwidth(counts.bytes)
    return Row(
        model.blades, model.each, timing.engine, motion, timing, spent, counts,
        peak_share, bandwidth,
    )  # fmt: skip


def counts_of(march: March, touching: float = 0.0) -> Counts:
    """Count the operations and bytes of a mean step; return these counts.

    march, touching : integration whose steps are counted; mean number of blades in
        contact

    Not counted are the search for the multipliers and, with contact, tips that are read
    without touching.

    Raises
    ------
    InputError
        where the kernel is that of `general` and `paper`
    """
    if not isinstance(march.state, CyclicState):
        msg = "the operations are counted for rings of harmonics and rigid casings only"
        raise InputError(msg)
    arrays, state = march.scheme.arrays, march.state
    if isinstance(arrays.rotor, wave_types.PointsRotor):
        return _of_points(arrays.rotor, len(state.last), touching)
    return _of_slots(arrays.rotor, len(state.last), touching)


def _of_slots(rotor: wave_types.SlotRotor, blades: int, touching: float) -> Counts:
    """Count operations and bytes of a mean step of equal sectors, by slots.

    A wave takes 12 operations, and with contact 16 more, of the casing 24; a blade in
    contact its rows of W and of the spectrum. Far from the casing there is no
    transform.

    rotor, blades, touching : coefficients; N; mean number of blades in contact
    """
    rows, (k, wide) = rotor.rows, widths(blades)
    own, beside = FOUR * int(rows.rotor.sum()), FOUR * int(rows.ring.sum())
    split = products(blades, span_of(blades)) if touching > 0.0 else 0.0
    step = 12 * (own + beside) + 2 * FOUR * split + 4 * wide
    size = 7 * (own + beside) + FOUR * split
    if touching > 0.0:
        step, size = step + 16 * own + 24 * beside, size + len(rows.pushed)
    row = 2 * k + 2 * wide
    return Counts(step + 2 * row * touching, 8 * (size + row * touching))


def _of_points(rotor: wave_types.PointsRotor, points: int, touching: float) -> Counts:
    """Count operations and bytes of a mean step of both bodies as waves.

    rotor, points : arrays of a rotor that is integrated as waves; number of points, N
        n_c for N blades with n_c points each
    touching : mean number of points in contact

    A wave takes 8 operations, a point 3. The rows of a touching point take 2 for
    each entry. With equal sectors each of the n_c points of a tip at which a blade
    touches takes 16 for each row and slot, once for all blades, and each wave 24 more.
    """
    rows, folded = rotor.rows, 2.0 * widths(points)[1]
    step, size = 4 * len(rotor.ahead) + 3 * folded, 2 * len(rotor.ahead) + 5 * folded
    if isinstance(rows, wave_types.SectorRows):
        own = min(rows.each, touching)
        turned = 6 * len(rows.turns) / (points // rows.each) * touching
        all_waves = (touching > 0.0) * (len(rows.move) + len(rows.give))
        step += 8 * own * len(rows.read) / rows.each + 12 * all_waves + 2 * turned
        size += own * (2 * len(rows.read) + len(rows.push)) / rows.each
        return Counts(step, 8 * (size + all_waves + turned))
    slides = 0 if len(rows.moves) else len(rows.slides)
    more = len(rows.read) + len(rows.push) + len(rows.turned) + slides
    more *= touching / points
    return Counts(step + 2 * more, 8 * (size + more))


def table(rows: Sequence[Row]) -> list[list[str]]:
    """Return timings as a table of texts: column names, then a list for each timing."""
    head = [
        "blades", "points", "sectors", "scheme", "motion", "in contact", "touching",
        "µs a step", "in contact, µs", "operations", "kB", "of the peak",
        "of the bandwidth",
    ]  # fmt: skip
    return [head, *map(_line, rows)]


def _line(row: Row) -> list[str]:
    time, counts = row.timing, row.counts
    touches, jumps = time.contact > 0.0, counts.operations == 0
    return [
        str(row.blades), str(row.points), row.sectors, time.scheme, row.motion,
        f"{time.contact:.0%}" if touches else "",
        f"{time.touching:.1f}" if touches else "",
        f"{time.microseconds_per_step:.3f}",
        f"{row.step_in_contact:.3f}" if touches else "",
        "" if jumps else f"{counts.operations:.0f}",
        "" if jumps else f"{counts.bytes / 1e3:.0f}",
        "" if jumps else f"{row.peak:.0%}", "" if jumps else f"{row.bandwidth:.0%}",
    ]  # fmt: skip


def doubts(rows: Sequence[Row]) -> list[str]:
    """Return a line of text if a limit was exceeded, and so was measured too low."""
    if all(max(row.peak, row.bandwidth) <= 1.0 for row in rows):
        return []
    why = "the machine was busy while the limits were measured"
    return [
        f"Shares above 100%: {why}; repeat on a quiet machine, with more --repeats."
    ]


def over_single(rows: Sequence[Row]) -> list[str]:
    """Return lines of text on how much several contact points a tip lengthen a step.

    They give the time of a step, divided by that with one point a tip.

    rows : timings with one point a tip and with several
    """
    of = {
        (row.blades, row.sectors, row.motion, row.points): row
        for row in rows
        if row.timing.scheme == DEFAULT
    }
    lines: dict[str, list[str]] = {}
    for (blades, sectors, motion, points), row in of.items():
        if points == 1:
            continue
        single, touches = of[blades, sectors, motion, 1], motion != FLIGHT
        spent = row.step_in_contact if touches else row.timing.microseconds_per_step
        own = single.timing.microseconds_per_step
        own = single.step_in_contact if touches else own
        name = f"{points} points a tip over one, {blades} blades, {sectors} sectors"
        lines.setdefault(name, []).append(f"{motion} {spent / own:.2f}")
    return [f"{name}: {', '.join(each)}" for name, each in lines.items()]


def with_points(folder: Path, scene: Scene, points: int = POINTS) -> Scene:
    """Return the scene with an engine from file that has several contact points a tip.

    The file is written from the scene's engine. The points are spread evenly over the
    chord; two are one end and the middle. As if blades twisted, one end of a tip moves
    radially by the fraction `TWIST` less than the middle, the other end by as much
    more; the reverse in modes of odd rank.

    folder, points : directory in which the file is written; number of points of a tip
    """
    body = (model := resolve(scene).model).rotor
    arrays = arrays_of(model)
    names = "omega", "damping_ratio", "modal_centre"
    out = {f"rotor/{name}": arrays[f"rotor/{name}"] for name in names}
    sign = np.where(body.rank % 2, -1.0, 1.0)
    ends = -1.0, 0.0, 1.0
    along_chord = np.linspace(-1.0, 1.0 if points > 2 else 0.0, points)
    twist = 1.0 + TWIST * np.outer(along_chord, sign)
    radial, along = (
        arrays[f"rotor/modal_tip_{name}"] for name in ("radial", "tangential")
    )
    out |= {
        "rotor/modal_tip_radial": radial[:, None] * twist,
        "rotor/modal_tip_tangential": np.repeat(along[:, None], points, axis=1),
        **{
            f"rotor/tip_{name}": np.interp(along_chord, ends, place)
            for name, place in CHORD.items()
        },
    }
    path = folder / f"{len(list(folder.iterdir()))}.h5"
    write_arrays(path, out, {})
    return apply_settings(scene, {"mistuning": [], "file": str(path)})


def fma_peak(repeats: int) -> float:
    """Measure the highest rate at which a core computes multiply-adds, GFLOP/s.

    A multiply-add counts as two operations.

    repeats : number of measurements, of which the fastest counts
    """
    values = np.linspace(0.0, 1.0, CHAINS)
    multiply_add(1, values, 0.5, 0.5)
    spent = []
    for _ in range(repeats):
        start = time.perf_counter()
        multiply_add(ROUNDS, values, 0.5, 0.5)
        spent.append(time.perf_counter() - start)
    return 2e-9 * CHAINS * ROUNDS / min(spent)


def read_bandwidth(size: float) -> float:
    """Measure the rate, GB/s, at which a core reads an array again and again.

    size : bytes of the array
    """
    values = np.ones(max(int(size) // 32, 16) * 4)
    rounds = max(int(READ / values.nbytes), 1)
    total_again(1, values)
    spent = []
    for _ in range(3):
        start = time.perf_counter()
        total_again(rounds, values)
        spent.append(time.perf_counter() - start)
    return 1e-9 * values.nbytes * rounds / min(spent)


def main() -> int:
    """Time a scene's engine with several numbers of blades, and print the table."""
    parser = parser_of(__doc__)
    parser.add_argument("scene", nargs="?", default="four_motions")
    parser.add_argument("--sizes", type=int, nargs="+", default=SIZES)
    parser.add_argument("--repeats", type=int, default=9)
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    scene = apply_settings(named_scene(args.scene), {"plan": "everything"})
    peak = fma_peak(args.repeats)
    with tempfile.TemporaryDirectory(prefix="hpcwhirl-sizes-") as folder:
        several = partial(with_points, Path(folder))
        rows = rows_of(scene, args.sizes, args.repeats, peak, [several])
    if args.json:
        found = {"fma_peak_gflops": peak, "rows": [asdict(row) for row in rows]}
        print(json.dumps(found))
        return 0
    head, *lines = table(rows)
    for words in (head, ["---"] * len(head), *lines):
        print(f"| {' | '.join(words)} |")
    print("", *over_single(rows), *doubts(rows), sep="\n")
    print(f"\nMeasured peak of multiply-adds: {peak:.1f} GFLOP/s.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
