"""Layers that wear: convergence, lobes and cost.

python scripts/evidence/layer.py rods    # results over rods under a tip and time step
python scripts/evidence/layer.py lobes   # lobes that one blade wears, over the speed
python scripts/evidence/layer.py cost    # time of a step with and without a layer
"""

from __future__ import annotations

import math
import sys
import tempfile
import time
from functools import partial
from pathlib import Path
from typing import Any

import h5py
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import in_turn, parser_of

from hpcwhirl.analysis.blade_motion import wear_numbers
from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.march import March
from hpcwhirl.scene import Scene, apply_settings, named_scene

LAYER = {"contact_law": "abradable"}
WHEEL = LAYER | {"duration": 0.03, "modes": 5, "scheme": "general"}
# a casing that becomes eccentric within the run, and so feeds a blade into its layer
FEEDING = LAYER | {
    "duration": 2.0, "interval": 5e-3, "time_step": 5e-6, "scheme": "general",
    "gap": 1e-5, "friction": 0.6, "blades": 1, "engine.casing.kind": "rigid",
    "engine.casing.profile": "harmonic,amplitude,phase;1,5e-5,0", "profile_rise": 2.0,
}  # fmt: skip
OMEGA = 1200.0  # rad/s, of the only mode of the blade, of 1 kg, damped by 0.5 %
SPEEDS = (290.0, 270.0, 250.0, 230.0, 210.0, 190.0, 162.0)  # rad/s
REPEATS = 5


def marched(scene: Scene, settings: dict[str, Any]) -> tuple[Scene, Any]:
    """Return the scene with its settings, and the history of its march."""
    case = resolve(apply_settings(scene, settings))
    return case.scene, March(case).run()


def rods() -> None:
    """Print results of table2 over the rods under a tip and the time step."""
    print("rods  time step, s  volume, m3  depth, m  ledger_wear, J")
    for step in (1e-6, 2.5e-7):
        for count in (1, 2, 4, 8, 16, 32):
            own = WHEEL | {"layer_rods": count, "time_step": step}
            scene, told = marched(named_scene("table2"), own)
            found = wear_numbers(scene, told.layer)
            print(
                f"{count:4} {step:12.3g} {found['wear_volume']:13.5e} "
                f"{found['wear_depth']:.4e} {told.ledger['wear']:.4f}"
            )


def one_blade(path: Path, slope: float) -> dict[str, str]:
    """Write an engine of one blade; return the setting that names it.

    slope : radial over tangential motion of the tip; if < 0, friction pulls a tip that
        moves outward further out
    """
    angle = math.atan(slope)
    with h5py.File(path, "w") as file:
        file["rotor/omega"], file["rotor/damping_ratio"] = [OMEGA], [0.005]
        file["rotor/modal_tip_radial"] = [[math.sin(angle)]]
        file["rotor/modal_tip_tangential"] = [[math.cos(angle)]]
    return {"engine.file": str(path)}


def lobes() -> None:
    """Print the strongest harmonic above 2 that a blade wears, over the speed."""
    print("slope  speed, rad/s  omega / Omega  lobes by step and rods  depth, m")
    with tempfile.TemporaryDirectory() as folder:
        for slope in (-0.2, 0.2):
            engine = one_blade(Path(folder, f"{slope}.h5"), slope)
            for speed in SPEEDS:
                found, depths = [], []
                for step in (5e-6, 2.5e-6):
                    for count in (2, 4, 8):
                        own = {"speed": speed, "time_step": step, "layer_rods": count}
                        _, told = marched(Scene(), FEEDING | engine | own)
                        sizes = np.abs(np.fft.rfft(told.layer[0]))
                        found.append(3 + int(sizes[3:].argmax()))
                        depths.append(told.layer[0].max())
                print(
                    f"{slope:5} {speed:8.0f} {OMEGA / speed:10.2f}   {found}   "
                    f"{min(depths):.1e} to {max(depths):.1e}"
                )


def cost() -> None:
    """Print the least time of a step, in turn, of schemes with and without layer."""
    kinds: dict[str, dict[str, Any]] = {
        "modal": {"scheme": "modal"},
        "modal, abradable": {"scheme": "modal", **LAYER},
        "modal, archard": {"scheme": "modal", "contact_law": "archard"},
        "modal, abradable, 16 rods": {"scheme": "modal", "layer_rods": 16, **LAYER},
        "general, abradable": {"scheme": "general", **LAYER},
    }
    own = {"duration": 0.1, "traces": "summary"}
    cases = {
        name: resolve(apply_settings(named_scene("table2"), own | kind))
        for name, kind in kinds.items()
    }

    def once(case: Any) -> float:
        march = March(case)
        march.advance(1)
        start = time.process_time()
        march.advance(march.total)
        return (time.process_time() - start) / march.total

    times = in_turn({n: partial(once, case) for n, case in cases.items()}, REPEATS)
    for name, found in times.items():
        ratio = min(found) / min(times["modal"])
        print(f"{name:30} {1e6 * min(found):7.2f} us a step, {ratio:.2f} times modal")


def main() -> None:
    """Run what is asked for."""
    parser = parser_of(__doc__)
    parser.add_argument("what", choices=("rods", "lobes", "cost"))
    {"rods": rods, "lobes": lobes, "cost": cost}[parser.parse_args().what]()


if __name__ == "__main__":
    main()
