"""What if the shaft's suspension were damped by itself? Table 2, one engine, a table.

    python scripts/suspension_damping.py [RATIO...]    default 0.00524 0.1 0.3 0.7

The engine search has one damping ratio for all modes of the rotor. With it, friction
drives the suspension's backward whirl (rotor's frame: 500-620 rad/s) at 410 and 420
rad/s, and that motion hides the forward one. Here the two suspension modes have a ratio
of their own, as bearings or a squeeze film would give them, and nothing else changes.
No input of a scene says that: the model is altered, so the cases are no campaign.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from identify_report import motion
from identify_score import Row, score, score_parts

from hpcwhirl.campaign.case import result_of
from hpcwhirl.dynamics.march import March
from hpcwhirl.reduction.model import model_of
from hpcwhirl.scene import Scene, apply_settings, named_scene

# The best of some 200 engines tried by hand with 8 unknowns, 1.5 to 2.5 s, step 4e-6 s.
ENGINE = {
    "engine.casing.thickness": 0.02181,
    "engine.casing.width": 0.2845,
    "engine.casing.damping": 0.01835,
    "engine.rotor.damping": 0.005241,
    "engine.casing.support_frequency": 13.85,
    "pulse": 0.3991e-3,
}
SUSPENSION = (500.0, 800.0)  # rad/s, between 1F and 2F


def motion_at(speed: float, ratio: float, step: float, duration: float) -> Row:
    """Return the row of Table 2 at a speed, suspension modes damped by `ratio`."""
    settings = {"speed": speed, "duration": duration, "solver.time_step": step}
    scene: Scene = apply_settings(named_scene("table2"), ENGINE | settings)
    model = model_of(scene)
    omega = model.rotor.omega
    inside = (omega > SUSPENSION[0]) & (omega < SUSPENSION[1])
    damping = np.where(inside, ratio, scene.engine.rotor.damping)
    altered = replace(model, rotor=replace(model.rotor, damping=damping))
    row = result_of(scene, March(scene, altered).run()).row
    return dict(row) | {"kind": "table 2", "status": "ok", "speed": speed}


def main(words: Sequence[str] | None = None) -> int:
    """Print a line a speed for every ratio, and the score."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("ratios", type=float, nargs="*", metavar="RATIO")
    parser.add_argument("--speeds", type=float, nargs="*", help="rad/s")
    parser.add_argument("--step", type=float, default=1e-6, help="s")
    parser.add_argument("--duration", type=float, default=2.5, help="s")
    args = parser.parse_args(words)
    speeds = args.speeds or [float(s) for s in range(20, 521, 10)]
    usual = (ENGINE["engine.rotor.damping"], 0.1, 0.3, 0.7)
    for ratio in args.ratios or usual:
        print(f"suspension damped by {ratio:g}")
        rows = [motion_at(s, ratio, args.step, args.duration) for s in speeds]
        for row in rows:
            print("   " + motion(row))
        print(f"   score {score(score_parts(rows)):.3f}", flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
