"""`hpcwhirl bench`: time of a step and of whole cases on this core."""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

from hpcwhirl.cli.command import add_option
from hpcwhirl.cli.options import add_scene, print_json, scene_of
from hpcwhirl.errors import InputError, say
from hpcwhirl.scene import Scene, apply_settings
from hpcwhirl.scene.quantities import PERFORMANCE
from hpcwhirl.scene.schemes import DEFAULT, NAMES, SCHEMES

# damped, sustained and divergent on Table 2, and two lobes in a wide gap
CASES: tuple[dict[str, float | int], ...] = (
    {"speed": 520.0},
    {"speed": 400.0},
    {"speed": 420.0},
    {"speed": 520.0, "gap": 1e-3, "nodal_diameter": 2},
)
START = (
    "import sys\n"
    "from hpcwhirl.case.resolve import resolve\n"
    "from hpcwhirl.dynamics.march import March\n"
    "from hpcwhirl.scene import apply_settings, named_scene\n"
    "sizes = {n: int(v) for n, v in (word.split('=') for word in sys.argv[2:])}\n"
    "chosen = sizes | {'scheme': sys.argv[1]}\n"
    "March(resolve(apply_settings(named_scene('table2'), chosen))).warm()\n"
)
# {name: inputs} of processes that start one after the other and take one step each;
# they share a cache of compiled functions, which is empty for the first
STARTS: dict[str, tuple[str, ...]] = {
    "cold": (),
    "new_size": ("blades=13", "modes=52", "harmonics=7"),
    "warm": (),
}


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `hpcwhirl bench` on its parser."""
    # fmt: off
    add_scene(parser)
    add_option(parser, "--repeats N",
        "number of timed repetitions (default 9)", default=9)
    add_option(parser, "--cases", "also time whole cases, one for each regime")
    add_option(parser, "--learn",
        "instead, time the steps of engines of 6, 22 and 66 blades, and keep the times "
        "beside the compiled kernels: campaign --dry-run and job use them from then on")
    add_option(parser, "--compile",
        "also time the starts of processes: the first ever, which compiles, the first "
        "with another model size, and the next one; takes minutes, since each of the "
        f"{len(NAMES)} schemes is compiled anew")


def run(args: argparse.Namespace) -> int:
    """Time a step of each scheme on this core, and print the times.

    Returns the exit code
    """
    if args.repeats < 1:
        raise InputError(f"--repeats must be >= 1, got {args.repeats}")
    if args.learn:
        return _learn(args.repeats, as_json=args.json)
    scene = scene_of(args.scene, args.settings)
    scene = apply_settings(scene, {"plan": "everything"})  # leave out no step
    facts = facts_of(scene, args.repeats)
    if args.cases:
        facts["cases"] = whole_cases(scene)
    if args.compile:
        facts["starts"] = []
        for scheme in NAMES:
            say(f"starts of scheme {scheme}, which is compiled anew")
            facts["starts"].append(start_of(scheme))
    facts["peak_memory_mb"] = _peak_memory()
    if args.json:
        print_json(facts)
    else:
        _show(facts)
    return 0


def _learn(repeats: int, *, as_json: bool) -> int:
    """Measure the times by which costs are predicted, and keep them."""
    from hpcwhirl.benchmark.learn import measure
    from hpcwhirl.campaign.plan.learned import keep

    rows = measure(repeats)
    path = keep(rows)
    if as_json:
        print_json({"file": str(path), "rows": [asdict(row) for row in rows]})
        return 0
    print("scheme   rotation  blades          flight  contact, measured / nominal")
    for row in rows:
        sectors = f"{row.blades}{' unequal' if row.uneven else ''}"
        print(f"{row.scheme:8} {row.rotation:9} {sectors:15} {row.flight:6.2f}"
              f"  {row.contact:7.2f}")  # fmt: skip
    print(path)
    return 0


def facts_of(scene: Scene, repeats: int) -> dict[str, Any]:
    """Time a step of each scheme; return the numbers that `bench` prints, by name.

    They are times of a step on the scene's engine and its variants.

    Parameters
    ----------
    scene : case to time
    repeats : number of times that each timing is repeated
    """
    from hpcwhirl.benchmark import bench

    with tempfile.TemporaryDirectory(prefix="hpcwhirl-bench-") as folder:
        engines = engines_of(scene, Path(folder)) | bench.in_operation(scene)
        asked = bench.rows_of(scene, engines)
        timings = bench.time_steps(asked, repeats)
    rows = [asdict(timing) for timing in timings]
    facts: dict[str, Any] = {"rows": rows}
    facts["over_none"] = bench.over_none(timings)
    facts["modal_tail_ratio"] = bench.tail_ratio(scene, repeats)
    facts[f"{DEFAULT}_bytes"] = bench.bytes_of(scene, DEFAULT)
    return facts


def engines_of(scene: Scene, folder: Path) -> dict[str, Scene]:
    """Return variants of a scene's engine to time, {name: scene with the variant}.

    They are mistuned, with rotation, or read from files. {} if the engine comes from a
    file or is mistuned already.

    Parameters
    ----------
    scene : a scene with a built-in engine
    folder : directory in which engine files are written
    """
    from hpcwhirl.benchmark.bench import FULL, pattern
    from hpcwhirl.case.resolve import resolve
    from hpcwhirl.cli.export_model import arrays_of
    from hpcwhirl.store.hdf5 import write_arrays

    if scene.engine.file or scene.engine.rotor.is_uneven:
        return {}
    mistuned = apply_settings(scene, {"mistuning": pattern(scene.engine.rotor.blades)})
    engines = {"mistuned": mistuned}
    for name, source in (("file, cyclic", scene), ("file, mistuned", mistuned)):
        path = folder / f"{name}.h5"
        write_arrays(path, arrays_of(resolve(source).model), {})
        engines[name] = apply_settings(scene, {"file": str(path)})
    if scene.engine.rotation == "none":
        full = {"rotation": "full"}
        engines[FULL] = apply_settings(scene, full)
        engines[f"{FULL}, mistuned"] = apply_settings(mistuned, full)
    return engines


def whole_cases(scene: Scene) -> list[dict[str, Any]]:
    """Time whole cases, one for each regime, by each scheme that can use symmetry.

    With symmetry only one of several sectors that move alike is integrated. Returns a
    dict for each case of `CASES` and scheme: speed, gap, scheme, words, steps, end time
    (s) and wall time (s)
    """
    from hpcwhirl.campaign.simulate import simulate

    out = []
    for settings in CASES:
        for scheme in [name for name, known in SCHEMES.items() if known.folds]:
            chosen = apply_settings(scene, {"revolutions": 0.0, "scheme": scheme})
            result = simulate(apply_settings(chosen, settings))
            row, spent = result.row, result.performance
            names = ("speed", "gap", "regime", "whirl", "end_time", "steps")
            facts = {name: row[name] for name in names} | {"scheme": scheme}
            out.append(facts | {"seconds": spent["seconds"]})
    return out


def start_of(scheme: str) -> dict[str, Any]:
    """Time how long a new process takes to start and integrate one time step.

    The first process has an empty cache of compiled functions. Returns for each of
    `STARTS` its wall and processor time, s, and the number of functions that it
    compiled

    scheme : name of the integrator
    """
    facts: dict[str, Any] = {"scheme": scheme}
    with tempfile.TemporaryDirectory(prefix="hpcwhirl-bench-") as cache:
        for name, settings in STARTS.items():
            before, start = _compiled(cache), time.perf_counter()
            busy = _of_children()
            subprocess.run(
                [sys.executable, "-c", START, scheme, *settings],
                env=os.environ | {"NUMBA_CACHE_DIR": cache}, check=True,
            )  # fmt: skip
            facts[f"{name}_seconds"] = time.perf_counter() - start
            facts[f"{name}_processor_seconds"] = _of_children() - busy
            facts[f"{name}_compiled"] = _compiled(cache) - before
    return facts


def _compiled(cache: str) -> int:
    """Return how many compiled functions a directory has that numba uses as cache."""
    return sum(1 for _ in Path(cache).rglob("*.nbc"))


def _of_children() -> float:
    """Return the processor time, user mode, s, of this process's ended children."""
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime


def _peak_memory() -> float:
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / 1024 if sys.platform != "darwin" else peak / 1024**2


def _show(facts: dict[str, Any]) -> None:
    from rich.console import Console
    from rich.table import Table

    console = Console()
    table = Table(
        "scheme",
        "engine",
        "steps in contact",
        f"{PERFORMANCE['microseconds_per_step'].unit} a step",
        "spread",
    )
    for row in facts["rows"]:
        table.add_row(
            str(row["scheme"]), str(row["engine"]), f"{row['contact']:.1%}",
            f"{row['microseconds_per_step']:.3f}", f"{row['spread']:.0%}",
        )  # fmt: skip
    console.print(table)
    console.print(
        f"{facts[f'{DEFAULT}_bytes']} bytes of state and operators ({DEFAULT}), peak "
        f"memory of the process {facts['peak_memory_mb']:.0f} MB; a step of a "
        f"decayed motion takes {facts['modal_tail_ratio']:.2f} times as long as that "
        "of a large one"
    )
    if facts["over_none"]:
        console.print(_table_of_features(facts["over_none"]))
    for case in facts.get("cases", []):
        console.print(
            f"{case['speed']:g} rad/s, gap {1e3 * case['gap']:g} mm, {case['scheme']}: "
            f"{case['regime']}, {case['whirl']}, {case['steps']} steps "
            f"({case['end_time']:.2f} s of engine time) in {case['seconds']:.3f} s"
        )
    if "starts" in facts:
        console.print(_table_of_starts(facts["starts"]))


def _table_of_features(features: dict[str, dict[str, Any]]) -> Any:
    """Return a table with a row a feature: how much it lengthens a step."""
    from rich.table import Table

    table = Table(
        "feature", "in flight", "in contact", "steps in contact", "blades touching",
        caption="times of a step, and shares of steps, with the feature over without",
    )  # fmt: skip
    for name, over in features.items():
        (with_it, without), (many, few) = over["shares"], over["touching"]
        table.add_row(
            name, f"{over['in_flight']:.2f}", f"{over['in_contact']:.2f}",
            f"{with_it:.0%} / {without:.0%}", f"{many:.1f} / {few:.1f}",
        )  # fmt: skip
    return table


def _table_of_starts(starts: list[dict[str, Any]]) -> Any:
    from rich.table import Table

    heads = ("first start ever", "a new size", "next start")
    table = Table("seconds (of the processor)", *heads, "compiled")
    for facts in starts:
        cells = [
            f"{facts[f'{name}_seconds']:.1f} ({facts[f'{name}_processor_seconds']:.1f})"
            for name in STARTS
        ]
        counts = [str(facts[f"{name}_compiled"]) for name in STARTS]
        table.add_row(facts["scheme"], *cells, ", ".join(counts))
    return table
