"""Runs whose speed changes: their words, the error of intervals, what a step costs.

    python scripts/evidence/operation.py [words] [intervals] [cost] [passage]

Without a name all four.

words: run-ups and run-downs in 12 windows of 1 s, each beside a run at the window's
mean speed for 2.5 s, of which it would be the window; prints the share of windows with
the same regime and whirl. Two engines: the unbalanced one of jobs/run_up.toml, and the
default one with its pulse, which is sustained at 380 to 410 rad/s, damped below.
intervals: the motion of the centre of an unbalanced run-up without contact, at the
usual interval, half and a quarter of it, against a sixteenth: largest difference over
the largest radius, beside what is told; and the same of the default engine in contact.
cost: time of a step of run-ups over that at constant speed, of both kernels, least of
five, one after the other in turn in this process.
passage: largest amplitude over the eccentricity of a run-up and a run-down through a
critical speed without damping, over 1.467 sqrt(omega^2 / rate).
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from hpcwhirl.analysis.over_speed import spells_of
from hpcwhirl.campaign.simulate import simulate
from hpcwhirl.case import speed
from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.history import History
from hpcwhirl.dynamics.march import March
from hpcwhirl.scene import Scene, apply_settings

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))
UNBALANCED = {
    "unbalance": 0.03, "force": 0.0, "gap": 7e-4, "gap_at": "rest", "rotation": "full",
    "accuracy": 1e-2, "friction": 0.1,
}  # fmt: skip
PULSED = {"accuracy": 1e-3}
COUNT, LONG = 12, 2.5  # windows; s of a run whose window lasts a second
REPEATS = 5


def _run(**settings: Any) -> tuple[March, History]:
    march = March(resolve(apply_settings(Scene(), settings)))
    return march, march.run()


def words() -> None:
    """Print the words of windows beside those at constant speed."""
    for name, engine, start, rate in (
        ("default, pulse", PULSED, 400.0, -2.0),
        ("default, pulse", PULSED, 400.0, -5.0),
        ("unbalanced, full", UNBALANCED, 430.0, 2.0),
        ("unbalanced, full", UNBALANCED, 400.0, 10.0),
    ):
        own = engine | {"speed": start, "traces": "summary"}
        moving = {"acceleration": rate, "duration": float(COUNT)}
        told = _row(own | moving | {"output.windows": COUNT})["words_over_speed"]
        spells, same = spells_of(str(told)), 0
        for window in range(COUNT):
            middle = window + 0.5
            one = next(s for s in spells if s.begin <= middle < s.end)
            at = start + rate * middle
            row = _row(own | {"speed": at, "duration": LONG})
            words = row["regime"], row["whirl"]
            same += words == (one.regime, one.whirl)
            print(f"  {at:.1f} rad/s: {one.regime} {one.whirl}; at constant speed "
                  f"{words[0]} {words[1]}")  # fmt: skip
        print(f"words, {name}, {rate:g} rad/s^2: {same} of {COUNT} windows as at "
              "constant speed")  # fmt: skip


def _row(settings: dict[str, Any]) -> dict[str, Any]:
    return simulate(apply_settings(Scene(), settings)).row


@contextmanager
def _accuracy(value: float) -> Iterator[None]:
    usual = speed.USUAL
    speed.USUAL = value
    try:
        yield
    finally:
        speed.USUAL = usual


def intervals() -> None:
    """Print what intervals miss, of a run-up without contact and of one with it."""
    free = {"rotation": "full", "unbalance": 0.01, "force": 0.0, "gap": 1e-2,
            "time_step": 8e-6, "speed": 420.0, "acceleration": 200.0,
            "duration": 0.4}  # fmt: skip
    rub = {"time_step": 4e-6, "speed": 300.0, "acceleration": 200.0, "duration": 0.05}
    for name, given in (("free", free), ("in contact", rub)):
        found = []
        for part in (1.0, 0.5, 0.25, 1 / 16):
            with _accuracy(speed.USUAL * part**2):
                march, history = _run(**given)
                found.append((march.schedule.every, history.centre))
        best = found[-1][1]
        for every, centre in found[:-1]:
            away = np.abs(centre - best).max() / np.hypot(*best.T).max()
            print(f"intervals, {name}: {every} steps miss {away:.2g}, told "
                  f"{speed.USUAL:g} with {found[0][0]} steps")  # fmt: skip


def cost() -> None:
    """Print the time of a step of run-ups over that at constant speed."""
    kinds = {
        "modal, none": PULSED | {"speed": 300.0, "duration": 0.5},
        "general, full": UNBALANCED | {"speed": 430.0, "duration": 0.3,
                                       "scheme": "general"},
    }  # fmt: skip
    for name, given in kinds.items():
        times: dict[float, list[float]] = {0.0: [], 100.0: []}
        for _ in range(REPEATS):
            for rate, own in times.items():
                _, history = _run(**given, acceleration=rate)
                own.append(history.seconds / history.steps)
        ratio = min(times[100.0]) / min(times[0.0])
        print(f"cost, {name}: a step of a run-up takes {ratio:.2f} of one at constant "
              f"speed ({1e6 * min(times[0.0]):.2f} us)")  # fmt: skip


def passage() -> None:
    """Print largest amplitudes of passages over what stationary phase says."""
    from tests.support.jeffcott import HEAVY, MASS
    from tests.support.run_up import run_up

    for rate, start in ((40.0, 10.0), (-40.0, 70.0), (10.0, 20.0), (-10.0, 60.0)):
        march, history = run_up(
            acceleration=rate, speed=start, duration=60.0 * abs(rate) ** -1.0 * 0.85,
            suspension_damping=0.0, time_step=4e-5,
        )  # fmt: skip
        own = march.model.rotor.omega[march.model.rotor.diameter == 1][0]
        most = np.hypot(*history.centre.T).max() / (HEAVY / MASS)
        q = own**2 / abs(rate)
        print(f"passage, {rate:g} rad/s^2, q {q:.0f}: {most:.2f} e, "
              f"{most / (1.4672 * np.sqrt(q)):.3f} of 1.467 sqrt(q)")  # fmt: skip


PARTS: dict[str, Callable[[], None]] = {
    "words": words, "intervals": intervals, "cost": cost, "passage": passage,
}  # fmt: skip

if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("parts", nargs="*", choices=[[], *PARTS], metavar="PART")
    for asked in parser.parse_args().parts or PARTS:
        PARTS[asked]()
