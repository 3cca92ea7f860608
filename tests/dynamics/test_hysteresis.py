"""Sweeps up and down of a rotor that rubs all around: hysteresis as it is known.

A Jeffcott rotor with unbalance m e in a stator of receptance 1 / kappa, clearance r_0.
In a rub the contact turns with the rotor; the force N > 0 moves the stator by N / kappa
away from it, and between the centres is r_0 (Black 1968, with an unbalance):

    z = r_0 + N / kappa,   |z (k - m Omega^2 + i c Omega) + N (1 + i mu)| = m e Omega^2,
    kappa = k_b - m_s Omega^2 + i c_s Omega.

Without contact |z| = m e Omega^2 / |k - m Omega^2 + i c Omega| <= r_0. Between the
speeds where the second begins and the first ends in a fold, both live.
"""

import numpy as np
import pytest
from jeffcott import GAP, MASS, OWN, spring_casing, stiff

from hpcwhirl.case.resolve import Case
from hpcwhirl.dynamics.march import March
from hpcwhirl.reduction.model import Model, model_of

# of k, sqrt(k m), r_0 and m: k_b, c, mu, e, m_s; damping ratios of stator and blades
SPRING, DAMPING, DRAG, PART, LIGHT, YIELD = 3.0, 0.1, 0.05, 0.3, 0.1, 0.5
BLADES = 0.05  # a damper that turns with the rotor takes nothing from the rub
STEP = 0.1
SPEEDS = np.round(np.arange(1.0, 1.75, STEP), 3)


def alone(speed):
    """Return the radius without contact, over r_0."""
    return PART * speed**2 / abs(1.0 - speed**2 + 1j * DAMPING * speed)


def rubs(speed):
    """Return the radii of the rub, over r_0, by ascending force of contact."""
    push = np.linspace(0.0, 6.0, 60001)
    drag = 2j * YIELD * (SPRING * LIGHT) ** 0.5 * speed
    place = 1.0 + push / (SPRING - LIGHT * speed**2 + drag)
    held = place * (1.0 - speed**2 + 1j * DAMPING * speed) + push * (1 + 1j * DRAG)
    over = np.sign(abs(held) - PART * speed**2)
    return abs(place[:-1][over[:-1] != over[1:]])


def swept(path, speeds):
    """Return the mean radius at each speed, from where the speed before has ended."""
    ring = spring_casing(path, (SPRING / LIGHT) ** 0.5, YIELD, LIGHT)
    found, motion = [], None
    for speed in speeds.tolist():
        scene = stiff(
            60, scheme="modal", speed=speed * OWN, friction=DRAG, time_step=5.5e-7,
            unbalance=PART * MASS * GAP, suspension_damping=BLADES + DAMPING / 2,
            duration=0.2, plan="everything", **{"rotor.damping": BLADES},
        )  # fmt: skip
        case = Case(scene, Model(model_of(scene).rotor, *ring, 60))
        march = March(case, motion)
        history = march.run()
        late = history.time > 0.15
        radius = abs(history.centre[late] @ [1, 1j]) / GAP
        found.append(float(radius.mean()))
        motion = march.motion()
    return np.array(found)


@pytest.mark.evidence  # of 16 runs; in short: test_branch, test_unbalance -k published
@pytest.mark.slow
def test_sweeps_up_and_down_find_where_a_rub_ends_and_where_it_begins(tmp_path):
    up = swept(tmp_path / "up.h5", SPEEDS)
    down = swept(tmp_path / "down.h5", SPEEDS[::-1])[::-1]
    fine = np.arange(1.1, 1.8, 1e-3).tolist()
    fold = max(speed for speed in fine if len(rubs(speed)))
    freed = min(speed for speed in fine if alone(speed) < 1.0)
    assert (freed, fold) == pytest.approx((1.186, 1.555), abs=1e-3)
    free = np.array([alone(speed) for speed in SPEEDS])
    ends, begins = SPEEDS[up < 1.0].min(), SPEEDS[down < 1.0].min()
    assert ends - STEP / 2 == pytest.approx(fold, abs=STEP)
    assert begins - STEP / 2 == pytest.approx(freed, abs=STEP)  # it may swing over it
    rub = np.array([rubs(speed)[-1] for speed in SPEEDS[fold > SPEEDS]])
    assert up[: len(rub)] == pytest.approx(rub, rel=0.015)  # a polygon of 60 tips
    both = (down < 1.0) & (up > 1.0)
    assert both.sum() >= 3
    assert down[down < 1.0] == pytest.approx(free[down < 1.0], rel=3e-3)
    assert down[down > 1.0] == pytest.approx(up[down > 1.0], rel=1e-3)
