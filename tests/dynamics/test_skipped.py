"""Gaps that cannot be closed are not transformed: no bit of a motion tells."""

import numpy as np
import pytest
from alike import assert_same_in_parts

from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.kernels.compiled import kernel
from hpcwhirl.dynamics.kernels.contact import TOUCHED
from hpcwhirl.dynamics.kernels.loop import passes, skipped
from hpcwhirl.dynamics.kernels.vectors import widths
from hpcwhirl.dynamics.waves.slots import transforms
from hpcwhirl.scene import Scene, apply_settings

begin, gaps_if_near, catch_up, to_gaps = (  # parts, for Python
    kernel(part.py_func)
    for part in (
        skipped.begin_unseen, skipped.gaps_if_near, skipped.catch_up, passes.to_gaps,
    )
)  # fmt: skip


@pytest.mark.parametrize(("blades", "closure"), [(22, 0.0), (88, 0.0), (22, 4e-4)])
def test_a_step_is_skipped_only_where_no_gap_is_closed(blades, closure):
    """closure : m, by which the clearance shrinks in a step."""
    (k, wide), wave = widths(blades), transforms(blades)[1]
    drawn, half, gap, left_out = np.random.default_rng(blades), blades // 2 + 1, 1.0, 0
    seen, late = np.zeros(4 * 2 * k + 8), np.zeros(3, np.int64)
    gaps, own, spectrum = np.zeros((3, 2 * wide)), np.zeros(2 * wide), np.zeros(2 * k)
    begin(k, seen, late)
    wanted, closed = [own] * 3, 0
    rates = 0.1 * drawn.normal(size=(2, half)) * np.exp(-np.arange(half) / 2)
    rates[0, 1] = 1.2 if closure == 0.0 else 0.1
    for step in range(3000):
        gap -= closure
        turn = rates * np.sin((0.002 + 0.001 * np.arange(half)) * step)
        spectrum.reshape(2, k)[:, :half] = turn
        low = to_gaps(spectrum, wave, gap, k, wide, own, 0)
        wanted[step % 3] = own.copy()
        found = gaps_if_near(
            spectrum, wave, gap, k, wide, gaps.ravel(), step % 3, seen, late
        )
        left_out += late[step % 3]
        closed += low < 0.0
        assert (found == 1.0 and low > 0.0) if late[step % 3] else found == low
        if step % 7 == 6:
            for row in range(3):
                catch_up(wave, k, wide, gaps.ravel(), row, seen, late)
            assert gaps.tobytes() == np.array(wanted).tobytes()
    assert left_out > 100
    assert closed > 100


@pytest.mark.turns
@pytest.mark.parametrize(
    "given",
    [
        {"gap": 1e-4},
        {"gap": 1e-4, "blades": 44, "speed": -420.0},
        {"gap": 3e-4, "rotation": "full"},
        {
            "engine.casing.kind": "rigid",
            "amplitude": 2e-4,
            "growth": 40.0,
            "rise": 1e-3,
        },
    ],
)
def test_steps_that_may_be_skipped_have_the_bits_of_those_that_never_are(given):
    # the first step of a call is never skipped
    case = resolve(apply_settings(Scene(), {
        "speed": 410.0, "friction": 0.1, "duration": 4e-3, "plan": "everything",
        "scheme": "modal",
    } | given))  # fmt: skip
    assert assert_same_in_parts(case, 1).counter[TOUCHED] > 0
