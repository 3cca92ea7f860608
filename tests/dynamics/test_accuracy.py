"""The step that an accuracy asks for is that of the scheme's own frequencies."""

import numpy as np
import pytest

from hpcwhirl.case.limits import HARDLY, SAFE, frequency_error, longest_phase
from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.march import March
from hpcwhirl.dynamics.timestep import central_differences
from hpcwhirl.scene import apply_settings, named_scene


def scene(**settings):
    return apply_settings(named_scene("table2"), settings)


def turned(omega, ratio, step):
    """Return the recursion's own frequency, from the eigenvalues of a step, rad/s."""
    found = central_differences(omega, ratio, step)
    once = [[found.keep, -found.pull], [found.keep, 1.0 - found.pull]]  # of (d, q)
    return np.abs(np.angle(np.linalg.eigvals(once))).max() / step


@pytest.mark.parametrize("ratio", [0.0, 0.01, 0.1, 0.6])
@pytest.mark.parametrize("accuracy", [1e-5, 1e-4, 1e-3, 0.01, 0.1, 0.144, 0.2, 0.3])
def test_the_accuracy_asked_for_is_the_one_of_every_rotor_mode(accuracy, ratio):
    damping = {"rotor.damping": ratio, "rotor.suspension_damping": -1.0}
    asked = scene(accuracy=accuracy, kind="rigid", **damping)
    model = resolve(asked).model
    step = resolve(asked).scene.solver.time_step
    shown = float(np.sqrt(1.0 - ratio**2))
    errors = [
        turned(float(omega), ratio, step) / (omega * shown) - 1.0
        for omega in model.rotor.omega
    ]
    assert max(errors) <= accuracy * (1.0 + 1e-4)  # eigenvalues hold 1e-9 or so
    held_back = step == pytest.approx(SAFE * min(model.limits(0.0).values()))
    assert held_back or max(errors) > accuracy * (1.0 - 1e-4)
    assert held_back == (longest_phase(accuracy, ratio) > 2.0 * SAFE)


def test_a_ring_does_not_change_the_step_that_the_rotor_asks_for():
    asked = scene(accuracy=1e-3, scheme="modal")
    step = resolve(asked).scene.solver.time_step
    assert March(resolve(asked)).scene.solver.time_step == step
    rigid = apply_settings(asked, {"kind": "rigid"})
    assert resolve(rigid).scene.solver.time_step == step


def test_the_largest_frequency_error_is_that_of_the_stability_limit():
    assert frequency_error(2.0) == pytest.approx(np.pi / 2 - 1.0)
    for much in (np.pi / 2 - 1.0, 1.0, 1e300):
        assert longest_phase(much) == pytest.approx(2.0)
    for few in (1e-300, 1e-12, 1e-9, 1e-7):
        assert longest_phase(few) == pytest.approx(np.sqrt(24.0) * few**0.5, rel=1e-6)


@pytest.mark.parametrize("ratio", [0.0, 0.2, HARDLY])
def test_a_longer_step_has_a_larger_frequency_error(ratio):
    phases = np.linspace(1e-3, 2.0 * np.sqrt(1.0 - ratio**2), 500)
    errors = [frequency_error(float(x), ratio) for x in phases]
    assert (np.diff(errors) > 0.0).all()
    for accuracy in (1e-5, 1e-3, 0.1, 0.3):
        phase = longest_phase(accuracy, ratio)
        assert frequency_error(phase, ratio) == pytest.approx(accuracy, rel=1e-6)
