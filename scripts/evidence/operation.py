"""Runs whose speed changes: their words, the error of intervals, what a step costs.

    python scripts/evidence/operation.py [PART ...]

Without a name all: words, drawn, ovals, intervals, cost, passage.

words: run-ups and run-downs in 12 windows of 1 s, each beside two runs at the window's
mean speed for 2.5 s, of which it would be the window: one begins as cases do, the other
with the motion of the run-up in the window's middle. Prints the number of windows with
the same regime and whirl, with the same regime, and with another one though neither is
`undecided`. Two engines: the unbalanced one of jobs/run_up.toml, and the default one
with its pulse, which is sustained at 380 to 410 rad/s, damped below.
drawn: the same of 12 unbalanced rotors drawn with a seed, in 6 windows each.
ovals: the regimes of the cases of jobs/oval_casing.toml beside those of longer runs,
three times, and at half the step.
intervals: the motion of the centre of an unbalanced run-up without contact, at the
usual interval, half and a quarter of it, against a sixteenth: largest difference over
the largest radius, beside what is told; and the same of the default engine in contact.
cost: time of a step of run-ups over that at constant speed, of both kernels, least of
five, one after the other in turn in this process.
passage: largest amplitude over the eccentricity of a run-up and a run-down through a
critical speed without damping, over 1.467 sqrt(omega^2 / rate).
"""

from __future__ import annotations

import itertools
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parents[2]))
from common import in_turn, parser_of

from hpcwhirl.analysis.over_speed import words_over_speed
from hpcwhirl.campaign.simulate import result_of
from hpcwhirl.case import speed
from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.bodies.motion import Motion
from hpcwhirl.dynamics.history import History
from hpcwhirl.dynamics.march import March
from hpcwhirl.scene import Scene, apply_settings

UNBALANCED = {
    "unbalance": 0.03, "force": 0.0, "gap": 7e-4, "gap_at": "rest", "rotation": "full",
    "accuracy": 1e-2, "friction": 0.1,
}  # fmt: skip
PULSED = {"accuracy": 1e-3}
COUNT, LONG = 12, 2.5  # windows; s of a run whose window lasts a second
REPEATS = 5
SEED, DRAWN, FEWER = 31, 12, 6  # draws, and windows of each


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
        tally = _compare(engine, start, rate, COUNT)
        print(f"words, {name}, {rate:g} rad/s^2: {_told(tally)}")


def drawn() -> None:
    """Print the same of unbalanced rotors drawn with a seed."""
    draw, total = np.random.default_rng(SEED), Counter[str]()
    for _ in range(DRAWN):
        rate = draw.choice([-1.0, 1.0]) * float(np.exp(draw.uniform(0.0, np.log(20.0))))
        engine = UNBALANCED | {
            "unbalance": float(draw.uniform(5e-3, 0.05)),
            "gap": float(draw.uniform(5e-4, 1e-3)),
            "friction": float(draw.uniform(0.02, 0.2)),
        }
        start = float(draw.uniform(380.0, 520.0))
        tally = _compare(engine, start, rate, FEWER)
        total += tally
        print(f"drawn, {start:.0f} rad/s at {rate:.1f} rad/s^2: {_told(tally)}")
    print(f"drawn, seed {SEED}: {_told(total)}")


def _compare(
    engine: dict[str, Any], start: float, rate: float, count: int
) -> Counter[str]:
    """Return how the words of `count` windows of 1 s compare with runs at their speed.

    own, same : windows with both words of a run of its own, and of one that continues
    regime : the same regime as the latter
    wrong, open : another one, both certain; either `undecided`
    """
    given = engine | {"speed": start, "traces": "summary"}
    moving = {"acceleration": rate, "duration": float(count), "output.windows": count}
    march, history = _run(**given, **moving)
    spells = words_over_speed(march.case, history)
    again = March(march.case)
    tally: Counter[str] = Counter(windows=count)
    for window in range(count):
        middle = window + 0.5
        one = next((s for s in spells if s.begin <= middle < s.end), None)
        if one is None:  # the run-up ended
            continue
        again.reach(round(middle / march.scene.solver.time_step))
        at = given | {"speed": start + rate * middle, "duration": LONG}
        own = _row(at, None)
        on = _row(at | {"force": 0.0}, again.motion())  # the pulse is over
        told = one.regime, one.whirl
        true = str(on["regime"]), str(on["whirl"])
        tally["own"] += told == (own["regime"], own["whirl"])
        tally["same"] += told == true
        tally["regime"] += one.regime == true[0]
        if one.regime != true[0]:
            both = "undecided" in (one.regime, true[0])
            tally["open" if both else "wrong"] += 1
        print(f"  {at['speed']:.1f} rad/s: {' '.join(told)}; at constant speed "
              f"{own['regime']} {own['whirl']}, then {' '.join(true)}")  # fmt: skip
    return tally


def _row(given: dict[str, Any], begun: Motion | None) -> dict[str, Any]:
    march = March(resolve(apply_settings(Scene(), given)), begun)
    return result_of(march.case, march.run()).row


def _told(tally: Counter[str]) -> str:
    return (
        f"of {tally['windows']} windows {tally['own']} have the words of a run of its "
        f"own, {tally['same']} of one that continues ({tally['regime']} the regime); "
        f"{tally['wrong']} another regime, {tally['open']} where one is undecided"
    )


def ovals() -> None:
    """Print whether the words of ovals hold, in longer runs and at half the step."""
    shared = {
        "force": 0.0, "profile": "harmonic,amplitude,phase;2,1e-5,0;3,2e-6,0.5",
        "profile_rise": 0.02, "offset": 2e-5, "offset_angle": 1.0, "traces": "summary",
    }  # fmt: skip
    tally: Counter[str] = Counter()
    for speed_, scale in itertools.product((300.0, 410.0, 520.0), (5, 10, 15, 20)):
        at = shared | {"speed": speed_, "profile_scale": float(scale)}
        own = _row(at | {"duration": 0.5}, None)["regime"]
        half = 0.5 * resolve(apply_settings(Scene(), at)).scene.solver.time_step
        for name, more in (
            ("longer", {"duration": 1.5}),
            ("half", {"duration": 0.5, "time_step": half}),
        ):
            other = _row(at | more, None)["regime"]
            both = "undecided" in (own, other)
            same = "same" if own == other else "open" if both else "wrong"
            tally[f"{name} {same}"] += 1
            print(f"  {speed_:g} rad/s, {scale}: {own}; {name} {other}")
    print(f"ovals: {dict(sorted(tally.items()))}")


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
                found.append((march.schedule.sections[0].every, history.centre))
        best = found[-1][1]
        for every, centre in found[:-1]:
            away = np.abs(centre - best).max() / np.hypot(*best.T).max()
            print(f"intervals, {name}: {every} steps miss {away:.2g}, told "
                  f"{speed.USUAL:g} with {found[0][0]} steps")  # fmt: skip


def cost() -> None:
    """Print the time of a step of run-ups over that at constant speed."""
    kinds = {
        "modal, none": PULSED | {"speed": 300.0, "duration": 0.5},
        "modal, full": UNBALANCED | {"speed": 430.0, "duration": 0.3},
        "general, full": UNBALANCED | {"speed": 430.0, "duration": 0.3,
                                       "scheme": "general"},
    }  # fmt: skip
    for name, given in kinds.items():

        def once(rate: float, given: dict[str, Any] = given) -> float:
            _, history = _run(**given, acceleration=rate)
            return history.seconds / history.steps

        times = in_turn({f"{r:g}": partial(once, r) for r in (0.0, 100.0)}, REPEATS)
        still, moving = map(min, times.values())
        print(f"cost, {name}: a step of a run-up takes {moving / still:.2f} of one at "
              f"constant speed ({1e6 * still:.2f} us)")  # fmt: skip


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
    "words": words, "drawn": drawn, "ovals": ovals, "intervals": intervals,
    "cost": cost, "passage": passage,
}  # fmt: skip

if __name__ == "__main__":
    parser = parser_of(__doc__)
    parser.add_argument("parts", nargs="*", choices=[[], *PARTS], metavar="PART")
    for asked in parser.parse_args().parts or PARTS:
        PARTS[asked]()
