"""Campaigns of made-up cases that touch every word: nothing is integrated."""

from dataclasses import asdict

import numpy as np

from hpcwhirl.analysis.regimes import Thresholds, name_regime
from hpcwhirl.analysis.rules import first_words
from hpcwhirl.campaign.compute import computation
from hpcwhirl.campaign.finalize import facts_of
from hpcwhirl.campaign.plan.design import design_of
from hpcwhirl.planner.planner import Job, completion_of
from hpcwhirl.scene.quantities import ROW
from hpcwhirl.scene.words import RULES
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.directory.completions import Ended
from hpcwhirl.store.directory.journal import Journal, Journals
from hpcwhirl.store.directory.manifest import PlanFile
from hpcwhirl.store.results.gather import gather

INTERVAL = 2e-4  # s
WHERE = {"rank": 0, "host": "node", "seconds": 0.5, "microseconds_per_step": 1.0}
STOPS = (*["end"] * 12, "amplitude", "nonfinite", "complementarity")


def whirl_word(ratio):
    """Return the word of a whirl ratio where the centre moves."""
    moving = {"orbit_radius": 1.0, "whirl_ratio": ratio, "gap_scale": 1.0}
    return str(first_words(RULES["whirl"], moving | asdict(Thresholds())))


def near(random, limit):
    """Return a number about a threshold, now and then the threshold itself."""
    return float(limit * random.choice([0.0, 0.3, 0.999, 1.0, 1.001, 3.0]))


def evidence(random):
    """Return evidence on either side of every threshold."""
    limits, window = Thresholds(), 0.4
    scale = random.choice([limits.rise, limits.drift, limits.unclear])
    change = random.choice([-1.0, 1.0, 1.0]) * near(random, scale)
    error = abs(change) / window / max(near(random, limits.significance), 1e-3)
    lost = float(10 ** random.uniform(-3, 3))
    fed = float(random.choice([-1.0, 1.0, 1.0, 1.0]) * near(random, 1.0) * lost)
    fed *= random.choice([1.0, limits.replaced, 1 / limits.replaced])
    rate = change / window
    return {
        "growth_rate": rate, "growth_error": error,
        "growth_rotor": rate * random.choice([1.0, 1.0, 0.0, 1.1, -0.1]),
        "growth_casing": rate * random.choice([1.0, 1.0, -0.1]),
        "growth_centre": rate * random.choice([1.0, 1.0, 1.2, -0.1]),
        "free_growth": (0.0, 0.0, 0.0, 0.25)[int(1e5 * lost) % 4],
        "growth_last": rate * near(random, limits.onward),
        "summit": near(random, limits.above),
        "end_time": 1.0, "window": window,
        "load_end": float(random.choice([0.0, 0.0, 0.0, 0.0, 0.9])),
        "late_fed": fed, "late_friction": 0.7 * fed, "late_rotation": 0.3 * fed,
        "ledger_rotation": 0.5 * fed, "ledger_friction": 0.5 * fed,
        "ledger_damping": (-0.3, 0.0, 0.3)[int(1e6 * lost) % 3] * abs(fed),
        "ledger_pulse": float(random.choice([0.0, 0.9, 1.0, 1.1])) * abs(fed),
        "driven_energy": (0.0, 0.0, 0.2)[int(1e7 * lost) % 3] * abs(fed),
        "late_lost": lost, "late_contacts": int(random.integers(4) > 0),
        "late_energy": lost / limits.turnover / random.choice([0.5, 1.0, 2.0, 5.0]),
        "certificate": float(random.choice([*[-1.0] * 8, 0.0, 0.5])),
        "ledger_error": near(random, limits.ledger) * (random.integers(4) == 0),
        "gap_error": near(random, limits.opening) * (random.integers(4) == 0),
        "step_share": float(random.choice([0.1, 0.1, 0.1, 0.999, 1.0])),
        "orbit_radius": float(random.choice([0.0, 1e-10, 5e-5, 5e-5, 5e-5])),
        "gap_scale": 1e-4,
        "whirl_ratio": float(random.uniform(-1, 1)),
        "orbit_area": float(random.normal()),
        "line_frequency": float(random.normal(0, 300)),
        "stop": str(random.choice(STOPS)),
    }  # fmt: skip


def row(random, scene, samples):
    kinds = {"f8": 0.0, "i8": 0, "S16": "modal"}
    made = {name: kinds.get(v.kind, "none") for name, v in ROW.items()}
    made |= evidence(random)
    inputs = ("speed", "gap", "friction", "nodal_diameter", "duration", "force")
    made |= {name: getattr(scene, name) for name in inputs}
    made |= {
        "sample_interval": INTERVAL,
        "contact_impulse": 10 ** random.uniform(-4, 2),
    }
    if samples:
        end = samples * INTERVAL
        made |= {"end_time": end, "window": 0.4 * end, "load_end": 0.0}
    words = name_regime(made, Thresholds())
    return made | dict(zip(("outcome", "regime", "whirl"), words, strict=True))


def traces(scene, samples):
    """Return a circle of a tenth of the gap that turns at twice the speed, backward."""
    time = (1 + np.arange(samples)) * INTERVAL
    z = 0.1 * scene.gap * np.exp(-2j * scene.speed * time)
    energy, power = np.full(samples, 3.0), np.full(samples, INTERVAL)
    return {
        "time": time, "centre": np.column_stack([z.real, z.imag]), "energy": energy,
        "impulse": 0 * time, "fed": np.cumsum(5 * power),
        "rubbed": np.cumsum(3 * power), "lost": np.cumsum(4 * power),
    }  # fmt: skip


def campaign(folder, document, samples=0, messages=None, seed=1):
    """Write a finished campaign of a document; return its directory.

    Parameters
    ----------
    samples : of each trace, 0 for none
    messages : {case: why it failed}
    """
    random = np.random.default_rng(seed)
    design = design_of(document)
    folder.mkdir(parents=True)
    PlanFile(folder).write(design.manifest())
    with Journal(Journals(folder), 1, 0) as journal:
        for case, scene in enumerate(design.scenes):
            record = {"digest": design.digests[case], "performance": WHERE}
            if case in (messages or {}):
                failed = {"status": "failed", "message": messages[case]}
                journal.append(record | failed, {})
                continue
            made = row(random, scene, samples)
            record |= {"status": "ok", "message": "", "row": made}
            journal.append(record, traces(scene, samples) if samples else {})
    gather(Directory(folder), facts_of(design))
    return folder


def refined_campaign(  # noqa: PLR0915 - a row, step by step
    folder, document, field, seed=1, radius=None, coarse=None
):
    """Write a refined campaign whose words a function gives; return its directory.

    Parameters
    ----------
    field : (settings of a case) -> its regime, or regime and whirl, None for a case
        that failed; where it has twins, their settings have `twin` beside, its number
    radius : (settings of a case) -> radius of its orbit, m
    coarse : (settings of a case) -> its regime with a longer step, if it is estimated
    """
    random, design = np.random.default_rng(seed), design_of(document)
    folder.mkdir(parents=True, exist_ok=True)
    PlanFile(folder).write(design.manifest())
    kinds = {"f8": 0.0, "i8": 0, "S16": "modal"}
    with Journal(Journals(folder), Journals(folder).next_run(), 0) as journal:
        planner = Ended.nothing(design.manifest()).planner()
        waiting = [Job(case) for case in range(len(design.settings))]
        while waiting:
            job = waiting.pop(int(random.integers(len(waiting))))
            case, own = job.case, {"twin": job.twin} if job.twin else {}
            word = field(design.settings_of(case) | own)
            computed = computation(design, job)
            record = {"digest": computed.digest, "performance": WHERE} | computed.facts
            made = {name: kinds.get(v.kind, "none") for name, v in ROW.items()}
            scene = design.scene(case)
            inputs = ("speed", "gap", "friction", "force")
            made |= {name: getattr(scene, name) for name in inputs}
            regime, _, whirl = (word or "").partition(" ")
            made |= {"outcome": "completed", "regime": regime, "window": 1.0}
            made |= {"whirl": whirl or "none"}
            if radius:
                made["orbit_radius"] = radius(design.settings_of(case))
                made["gap_scale"] = scene.gap
            if coarse and scene.solver.estimate == "step":
                made |= {"coarse_regime": coarse(design.settings_of(case))}
                made |= {"radius_error": 0.0, "peak_error": 0.0}
            told = {"status": "ok", "message": "", "row": made}
            if word is None:
                told = {"status": "failed", "message": "made up"}
            journal.append(record | told, {})
            waiting += planner.complete(job, completion_of(record | told))
    gather(Directory(folder), facts_of(design))
    return folder
