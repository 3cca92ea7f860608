"""A campaign directory of made-up results: nothing is integrated."""

import numpy as np
from journals import plan_of

from hpcwhirl.scene.quantities import ROW, TRACES
from hpcwhirl.scene.words import ENUMS
from hpcwhirl.store.directory.journal import Journal, Journals
from hpcwhirl.store.directory.manifest import PlanFile

SPEEDS = [300.0, 350.0, 400.0, 410.0, 450.0]
SAMPLES = {0: 5, 2: 3, 4: 7}  # of the cases that gave a result
FAILED, MISSING = 1, 3
BLADES = {0: 22, 2: 12, 4: 22}
HARMONICS = {0: 9, 2: 21, 4: 21}
MESSAGE = "x" * 239 + "µ, and more than there is room for"  # 240 bytes
BASE = {"speed": 1.0, "gap": 1e-4, "nodal_diameter": 2, "direction": "squeeze",
        "solver.time_step": 2e-6, "solver.scheme": "modal"}  # fmt: skip


def row(case, interval):
    kinds = {"f8": 0.1 * case + 1 / 3, "i8": case, "S16": "modal"}
    made = {n: kinds.get(v.kind) for n, v in ROW.items()}
    made |= {n: ENUMS[n][case % len(ENUMS[n])] for n in ROW if n in ENUMS}
    return made | {"speed": SPEEDS[case], "sample_interval": interval}


def traces(case, interval):
    random, n = np.random.default_rng(case), SAMPLES[case]
    made = {"time": (1 + np.arange(n)) * interval}
    for name, told in TRACES.items():
        sizes = {"blade": BLADES[case], "xy": 2, "component": 2, "phase": 2}
        sizes |= {"harmonic": HARMONICS[case], "chord": 3, "rod": 5}
        sizes |= {"place": 4, "bearing": 2}
        made[name] = random.normal(size=(n, *(sizes[axis] for axis in told.axes)))
    return made


def begin(folder, *, one_interval):
    """Journal three results, a failure and a record of another campaign, two ranks."""
    settings = [{"speed": speed} for speed in SPEEDS]
    settings[2] |= {"direction": "stretch"}
    plan = plan_of(BASE, ["speed", "direction"], settings, "four_motions")
    PlanFile(folder).write(plan)
    where = {"rank": 1, "host": "node-ä", "seconds": 0.5}
    with (
        Journal(Journals(folder), 1, 0) as zero,
        Journal(Journals(folder), 1, 1) as one,
    ):
        for case, journal in zip(SAMPLES, (one, zero, one), strict=True):
            record = {"digest": plan.digests[case], "status": "ok", "message": ""}
            interval = 1e-4 if one_interval else 1e-4 * (1 + case)
            record |= {"row": row(case, interval), "performance": where}
            journal.append(record, traces(case, interval))
        bad = {"status": "failed", "message": MESSAGE, "performance": where}
        zero.append({"digest": plan.digests[FAILED], **bad}, {})
        one.append({"digest": "alien", **bad}, traces(4, 1e-4))
