"""One case: a scene in, a row of numbers and its traces out. No MPI, no files."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.analysis.regimes import Thresholds, evidence, name_regime
from hpcwhirl.analysis.whirl import static_frame
from hpcwhirl.case.resolve import Case, resolve
from hpcwhirl.dynamics.history import LEDGER_TERMS, History
from hpcwhirl.dynamics.march import March
from hpcwhirl.scene import Scene

Value = float | int | str
SCENE_ROW = (
    "speed", "nodal_diameter", "gap", "friction", "force", "pulse",
)  # fmt: skip


@dataclass(frozen=True)
class Result:
    """What a case gives back.

    Attributes
    ----------
    row : physics alone, the same bits wherever and however often it is computed
    traces : {name: array}; `time` (n,), s; `centre` (n, 2), m, STATIC frame;
        `energy`, `fed`, `rubbed`, `lost` (n,), J; `impulse` (n,), N s; in full also
        `tips` (n, N, 2), m, rotating frame, `blade_impulse` (n, N), N s, and `casing`
        (n, H + 1, 2), m, STATIC frame; empty for `summary`
    performance : what depends on the machine and the day
    """

    row: dict[str, Value]
    traces: dict[str, NDArray[np.float64]]
    performance: dict[str, Value]


def simulate(scene: Scene, between_slices: Callable[[], None] | None = None) -> Result:
    """Integrate one scene and name what it does.

    Parameters
    ----------
    scene
        the case
    between_slices
        called every 10 ms or so; may raise to end the case

    Raises
    ------
    InputError
        where the scene cannot be integrated, e.g. a step above the limit
    """
    case = resolve(scene)
    return result_of(case, March(case).run(between_slices))


def result_of(case: Case, history: History) -> Result:
    """Return the result of an integrated case: evidence, words, row and traces."""
    scene = case.scene
    found = evidence(scene, history) | {"stop": history.stop}
    outcome, regime, whirl = name_regime(found, Thresholds())
    row: dict[str, Value] = {"outcome": outcome, "regime": regime, "whirl": whirl}
    row |= {name: getattr(scene, name) for name in SCENE_ROW}
    row |= {
        "duration": scene.end_time,
        "time_step": scene.solver.time_step,
        "modes": scene.solver.modes,
        "scheme": scene.solver.scheme,
        "folds": history.folds,
        "steps": history.steps,
        "contacts": history.contacts,
        "contact_impulse": history.contact_impulse,
        "centre_peak": history.centre_peak,
        "last_contact": history.last_contact,
    }
    row |= {f"ledger_{term}": history.ledger[term] for term in LEDGER_TERMS}
    row |= found
    row["sample_interval"] = history.interval
    performance: dict[str, Value] = {
        "seconds": history.seconds,
        "microseconds_per_step": 1e6 * history.seconds / max(history.steps, 1),
    }
    return Result(row, _traces(scene, history), performance)


def _traces(scene: Scene, history: History) -> dict[str, NDArray[np.float64]]:
    if scene.output.traces == "summary":
        return {}
    traces = {
        "time": history.time,
        "centre": static_frame(history.centre, scene.speed * history.time),
        "energy": history.energy,
        "impulse": history.impulse,
        "fed": history.fed,
        "rubbed": history.friction,
        "lost": history.lost,
    }
    if scene.output.traces == "full":
        traces |= {
            "tips": history.tips,
            "blade_impulse": history.blade_impulse,
            "casing": history.casing,
        }
    return traces
