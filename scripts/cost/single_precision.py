"""Whether single precision pays: whole steps of `modal`, in flight and in contact.

    python scripts/cost/single_precision.py [--repeats N]

The package is copied twice, with vectors of eight numbers in place of four, once of
doubles and once of singles, which fill one register where doubles fill two. Copies and
the package as it is march the default engine, from the state 0.02 s after the start:
`STEPS` steps without contact, and in three motions with contact. The copy in single
precision has the arrays, coefficients and state of the one in doubles, rounded, and
tolerances above its round-off. It prints processor time of a step in turn, median, and
how far radius of the centre's orbit and contact impulse over the last 40 % are from
those in doubles, beside a twin's in doubles, whose step is 1e-6 shorter.
"""

from __future__ import annotations

import os
import pickle
import shutil
import statistics
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import TOP, parser_of, table, working_folder

STEPS = 300_000
CHUNK = 500  # steps between two positions of the centre
WINDOW = 0.4  # share of the steps of which radius and impulse are told
SCENES: dict[str, dict[str, Any]] = {
    "flight": {"gap": 1.0},
    "sustained, 400 rad/s": {"speed": 400.0},
    "damped, 520 rad/s": {"speed": 520.0},
    "damped, 60 rad/s": {"speed": 60.0, "friction": 0.03},
}
EIGHT_LANES = {
    "FOUR = 4\n": "FOUR = 8\n",
    "return (element(four, 0) + element(four, 1)) + (element(four, 2) + element(four,"
    " 3))": "total = element(four, 0)\n    for i in range(1, FOUR):\n"
    "        total += element(four, i)\n    return total",
    "[3, 2, 1, 0])": "[7, 6, 5, 4, 3, 2, 1, 0])",
}
SINGLES = EIGHT_LANES | {
    "ir.DoubleType()": "ir.FloatType()",
    'full = f"llvm.{name}.v{FOUR}f64"': 'full = f"llvm.{name}.v{FOUR}f32"',
    "value.align = 8": "value.align = 4",
    ".align = 8": ".align = 4",
    "types.float64": "types.float32",
    "context.get_constant(types.intp, count), 8": "context.get_constant(types.intp, "
    "count), 4",
}
TOLERANCES: dict[str, dict[str, str]] = {  # those of doubles are below its round-off
    "contact.py": {"TINY = 1e-150": "TINY = 1e-30"},  # denormals are slow
    "keep_inverse.py": {"REGULAR = 1e-8": "REGULAR = 1e-4"},
    "pivoting.py": {
        "SINGULAR = 1e-12": "SINGULAR = 1e-5", "1e-13 * largest": "1e-5 * largest",
        "APART = 1e-12": "APART = 1e-5", "LEAST = 1e-11": "LEAST = 1e-5",
        "CLOSED = 1e-10": "CLOSED = 1e-4",
    },
    "loop/circulant.py": {"CLOSED = 1e-13": "CLOSED = 1e-4"},
    "loop/skipped.py": {"ROUNDING = 1e-12": "ROUNDING = 1e-5"},
}  # fmt: skip
Texts = dict[str, dict[str, str]]  # {file: {old: new}}
COPIES: dict[str, Texts] = {
    "double": {},
    "eight": {"vectors.py": EIGHT_LANES},
    "single": TOLERANCES | {"vectors.py": SINGLES},
}
Row = dict[str, Any]


def copied(folder: Path, replaced: Texts) -> Path:
    """Return a folder with a copy of the package, texts of its kernels replaced."""
    shutil.copytree(TOP / "hpcwhirl", folder / "hpcwhirl")
    for name, own in replaced.items():
        file = folder / "hpcwhirl" / "dynamics" / "kernels" / name
        text = file.read_text()
        for old, new in own.items():
            if old not in text:
                raise SystemExit(f"{name} has no longer: {old}")
            text = text.replace(old, new)
        file.write_text(text)
    return folder


# What runs in a process of its own, with one of the copies


def arguments_of(inputs: Row, nudge: float) -> list[Any]:
    """Return the arguments of the time loop for a scene that has settled.

    nudge : by which the step is shorter, relative to 1e-6 s
    """
    from hpcwhirl.benchmark.bench import settled
    from hpcwhirl.dynamics.kernels.kernel_types import Strides
    from hpcwhirl.dynamics.schemes.equal_sectors import slot_space
    from hpcwhirl.scene import apply_settings, named_scene

    given = {"time_step": 1e-6 * (1.0 - nudge)} | inputs
    scene = apply_settings(named_scene("four_motions"), given)
    march = settled(scene, "modal", contact=True)
    arrays, state, never = march.scheme.arrays, march.state, 10 * STEPS
    space = slot_space(arrays, state)
    step = march.scene.solver.time_step
    return [
        CHUNK, Strides(never, never), march._limit, step, march.speed, march.friction,
        march.wall, *arrays, state, march.tracks, space,
    ]  # fmt: skip


def in_single(value: Any) -> Any:
    """Return a nested tuple with all doubles rounded to single precision."""
    if isinstance(value, np.ndarray) and value.dtype == np.float64:
        from hpcwhirl.dynamics.kernels.vectors import aligned

        return aligned(value.astype(np.float32))
    if isinstance(value, float):
        return np.float32(value)
    if isinstance(value, tuple):
        parts = map(in_single, value)
        return type(value)._make(parts) if hasattr(value, "_make") else tuple(parts)
    return value


def take_literals_as_single() -> None:
    """Let numba take each number of Python as one of single precision."""
    from numba import types
    from numba.core.typing.typeof import typeof_impl

    typeof_impl.register(float)(lambda _value, _context: types.float32)


def marched(args: list[Any]) -> Row:
    """March; return time of a step, us, radius of the centre, m, impulse, N s."""
    from hpcwhirl.dynamics.kernels.contact import STEP, TOUCHED
    from hpcwhirl.dynamics.kernels.loop.points import march_points

    state, rotor = args[-3], args[8]
    march_points(0, *args[1:])  # compiled
    begun, spent, seen = int(state.counter[STEP]), 0.0, []
    for _ in range(STEPS // CHUNK):
        start = time.process_time()
        march_points(*args)
        spent += time.process_time() - start
        where = moved(rotor.hub, state.rotor, rotor.centre)
        seen.append((*where, float(state.impulse.sum())))
    x, y, impulse = np.array(seen[int((1 - WINDOW) * len(seen)) :]).T
    steps = int(state.counter[STEP]) - begun
    return {
        "us": 1e6 * spent / max(steps, 1),
        "radius": float(np.hypot(x - x.mean(), y - y.mean()).mean()),
        "impulse": float(impulse[-1] - impulse[0]),
        "contact": float(state.counter[TOUCHED]) / max(steps, 1),
        "steps": steps,
    }


def moved(hub: Any, amplitudes: Any, where: Any) -> tuple[float, float]:
    """Return x_o, y_o, m, from the waves that move the centre.

    hub, where : (2, n, 2), m by re and im of n amplitudes; their places
    """
    from hpcwhirl.dynamics.kernels.vectors import FOUR

    parts = np.stack([amplitudes[where], amplitudes[where + FOUR]], -1).astype(float)
    return tuple((np.asarray(hub, float).reshape(2, -1, 2) * parts).sum((1, 2)))


def child(kind: str, file: Path) -> None:
    """March all scenes with one of the copies; keep what was found, by scene.

    file : of the arguments of the loop that "eight" has made, for "single"
    """
    if kind == "single":
        take_literals_as_single()
        kept = pickle.loads(file.read_bytes())
        made = {name: [*in_single(tuple(args))] for name, args in kept.items()}
    else:
        nudge = 1e-6 if kind == "twin" else 0.0
        made = {name: arguments_of(own, nudge) for name, own in SCENES.items()}
        if kind == "eight":
            file.write_bytes(pickle.dumps(made))
    rows = {name: marched(args) for name, args in made.items()}
    sys.stdout.buffer.write(pickle.dumps(rows))


def found(kind: str, folder: Path, file: Path) -> dict[str, Row]:
    """Return what a copy finds of each scene."""
    words = [sys.executable, __file__, "--child", kind, str(file)]
    own = {"PYTHONPATH": str(folder), "HPCWHIRL_PLAIN_NUMBA": "0"}
    cache = {"NUMBA_CACHE_DIR": str(folder / "cache")} if kind == "single" else {}
    done = subprocess.run(words, check=True, stdout=subprocess.PIPE,
                          env=os.environ | own | cache)  # fmt: skip
    return pickle.loads(done.stdout)


def main() -> None:
    """Measure all in turn; print the table."""
    if sys.argv[1:2] == ["--child"]:
        child(sys.argv[2], Path(sys.argv[3]))
        return
    parser = parser_of(__doc__)
    parser.add_argument("--repeats", type=int, default=3)
    repeats = parser.parse_args().repeats
    with working_folder(None, "single") as scratch:
        file = scratch / "arguments"
        folders = {n: copied(scratch / n, own) for n, own in COPIES.items()}
        runs = [{n: found(n, folder, file) for n, folder in folders.items()}
                for _ in range(repeats)]  # fmt: skip
        twin = found("twin", folders["double"], file)
    print("\n".join(lines_of(runs, twin)))


def lines_of(runs: list[dict[str, dict[str, Row]]], twin: dict[str, Row]) -> list[str]:
    """Return the table: times of a step by copy, their ratio, errors."""
    rows = []
    for name in SCENES:
        us = {kind: statistics.median(run[kind][name]["us"] for run in runs)
              for kind in COPIES}  # fmt: skip
        right, single = runs[0]["double"][name], runs[0]["single"][name]
        off = [f"{apart(one, right, number)}" for one in (single, twin[name])
               for number in ("radius", "impulse")]  # fmt: skip
        times = [f"{us[kind]:.3f}" for kind in COPIES]
        ratio = f"{us['double'] / us['single']:.2f}"
        rows.append([name, f"{right['contact']:.0%}", *times, ratio, *off])
    head = (
        "motion", "steps in contact", "double, us a step", "of eight", "single",
        "times as fast", "radius off", "impulse off", "radius of the twin", "impulse",
    )  # fmt: skip
    return table(head, rows)


def apart(one: Row, other: Row, number: str) -> str:
    """Return how far a number is from another, relative, as text."""
    if not other[number]:
        return "none"
    return f"{abs(one[number] / other[number] - 1.0):.1e}"


if __name__ == "__main__":
    main()
