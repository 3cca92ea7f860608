"""Whether single precision pays: free steps of all modes, and the tips, in both.

    python scripts/cost/single_precision.py

The step of central differences and the radial displacements of all tips, as in a step
without contact, of the default engine with the preset `standard`: 200,000 steps in
numbers of 8 and of 4 bytes in turn, least time of three; the difference of the tips.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import parser_of

from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.bodies.timestep import central_differences
from hpcwhirl.scene import apply_settings, named_scene, preset_inputs

STEPS, TIMES = 200_000, 3
FASTER = {"reassoc", "contract", "nsz"}  # sums in any order, as those of the kernels


@njit(fastmath=FASTER)  # type: ignore[untyped-decorator]
def free(q: Any, v: Any, keep: Any, pull: Any, shapes: Any, tips: Any) -> None:
    """Take all steps of modal amplitudes q, increments v; keep the tips of each."""
    for _ in range(STEPS):
        for i in range(q.size):
            v[i] = keep[i] * v[i] - pull[i] * q[i]
            q[i] += v[i]
        for j in range(len(shapes)):
            moved = q[0] * shapes[j, 0]
            for i in range(1, shapes.shape[1]):
                moved += shapes[j, i] * q[i]
            tips[j] = moved


def marched(kind: Any) -> tuple[float, Any]:
    """Return the processor time of all steps, s, and the tips at the end, m."""
    scene = apply_settings(named_scene("four_motions"), preset_inputs("standard"))
    case = resolve(scene)
    rotor, casing, step = case.model.rotor, case.model.casing, case.step
    omega = np.r_[rotor.omega, casing.omega] if casing else rotor.omega
    once = [central_differences(float(w), 0.0, step) for w in omega]
    shapes = rotor.shapes[0 : 2 * case.model.blades : 2]
    q = 1.0 / np.maximum(omega, 1.0)
    parts = [q, 0.0 * q, [one.keep for one in once], [one.pull for one in once], shapes]
    arrays = [np.ascontiguousarray(part, dtype=kind) for part in parts]
    tips = np.zeros(len(shapes), kind)
    begun = time.process_time()
    free(*arrays, tips)
    return time.process_time() - begun, tips


def main() -> None:
    """Measure both in turn; print the time of a step, their ratio and difference."""
    parser_of(__doc__).parse_args()
    marched(np.float64), marched(np.float32)  # compiled
    runs = [(marched(np.float64), marched(np.float32)) for _ in range(TIMES)]
    double, single = (min(run[i][0] for run in runs) for i in (0, 1))
    one, other = (runs[0][i][1].astype(float) for i in (0, 1))
    apart = np.abs(one - other).max() / np.abs(one).max()
    each = [f"{1e6 * seconds / STEPS:.2f}" for seconds in (double, single)]
    print(f"{each[0]} us a step in double, {each[1]} in single precision")
    print(f"{double / single:.2f} times as fast; tips apart by {apart:.1e}")


if __name__ == "__main__":
    main()
