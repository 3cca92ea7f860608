"""The step that an accuracy asks for is that of the scheme's own frequencies."""

import numpy as np
import pytest
from scipy.optimize import brentq

from hpcwhirl.case.limits import HARDLY, SAFE, frequency_error, longest_phase, turned
from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.bodies.timestep import central_differences
from hpcwhirl.dynamics.march import March
from hpcwhirl.dynamics.waves.turning_waves import diameters_of
from hpcwhirl.reduction.waves import diameter_matrices, quadratic_roots
from hpcwhirl.scene import apply_settings, named_scene


def scene(**settings):
    return apply_settings(named_scene("table2"), settings)


def swung(omega, ratio, step):
    """Return the recursion's own frequency, from the eigenvalues of a step, rad/s."""
    found = central_differences(omega, ratio, step)
    once = [[found.keep, -found.pull], [found.keep, 1.0 - found.pull]]  # of (d, q)
    return np.abs(np.angle(np.linalg.eigvals(once))).max() / step


@pytest.mark.parametrize("ratio", [0.0, 0.1, 0.6])
@pytest.mark.parametrize("accuracy", [1e-5, 1e-3, 0.144, 0.3])
def test_the_accuracy_asked_for_is_the_one_of_every_rotor_mode(accuracy, ratio):
    damping = {"rotor.damping": ratio, "rotor.suspension_damping": -1.0}
    asked = scene(accuracy=accuracy, kind="rigid", **damping)
    model = resolve(asked).model
    step = resolve(asked).scene.solver.time_step
    shown = float(np.sqrt(1.0 - ratio**2))
    errors = [
        swung(float(omega), ratio, step) / (omega * shown) - 1.0
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


def marched(stiffness, speed, part, step):
    """Return w of e^{i w t} with Coriolis forces 2 Omega c by central differences."""

    def miss(w):
        swung = (2.0 / step * np.sin(0.5 * w * step)) ** 2
        return swung + 2.0 * speed * part * np.sin(w * step) / step - stiffness

    exact = -part * speed + np.sqrt(stiffness + (part * speed) ** 2)
    return brentq(miss, 0.5 * exact, 1.5 * exact), exact


@pytest.mark.parametrize("accuracy", [1e-5, 1e-3, 0.03])
@pytest.mark.parametrize("x", [1e-3, 0.17, 0.6, 3.0])
def test_the_step_of_a_turning_rotor_is_as_accurate_for_each_wave(accuracy, x):
    omega, speed = 1e3, 1e3 * x
    step = longest_phase(accuracy) / float(turned(np.array([omega]), speed)[0])
    soft = [omega**2 - share * speed**2 for share in (0.0, 0.5, 0.999)]
    errors = [
        abs(w / exact - 1.0)
        for stiffness in soft
        for part in (-1.0, -0.5, 0.0, 0.5, 1.0)
        if stiffness > 0.0
        for w, exact in [marched(stiffness, speed, part, step)]
    ]
    assert max(errors) <= accuracy * (1.0 + 10 * accuracy**0.5)
    assert max(errors) > 0.4 * accuracy  # no step is wasted


def test_unequal_sectors_and_a_tilting_disk_ask_for_no_finer_step_with_rotation():
    small = {
        "accuracy": 1e-3,
        "kind": "rigid",
        "blades": 5,
        "modes": 10,
        "speed": 300.0,
    }
    for own in ({"mistuning": [0.05, -0.02, 0.01, 0.01, -0.02]}, {}):
        still = scene(**small, **own)
        tilts = {} if own else {"shaft": "cantilever"}
        turning = apply_settings(still, {"rotation": "full", **tilts})
        step, rest = (resolve(one).scene.solver.time_step for one in (turning, still))
        assert step == pytest.approx(rest, rel=0.05)


def test_a_fast_rotor_s_waves_are_as_accurate_as_its_modes_at_rest():
    """The modes that a basis for all speeds has in addition set no step."""
    still = scene(accuracy=1e-3, kind="rigid", speed=500.0)
    turning = apply_settings(still, {"rotation": "full"})
    case = resolve(turning)
    step, model = case.scene.solver.time_step, case.model
    assert step > 0.95 * resolve(still).scene.solver.time_step
    assert model.rotor.reach < model.rotor.omega.max()
    rest = resolve(still).model.rotor.omega.max()
    assert model.rotor.reach == pytest.approx(rest, rel=1e-9)
    for own in diameters_of(model, case.scene):
        gyro, damping, stiffness, push = diameter_matrices(
            model.rotor, model.rotor.spin.waves[own.k], turning.speed
        )
        exact = quadratic_roots(gyro + damping, stiffness + push).imag
        found = np.log1p(own.ahead).imag / step
        asked = np.abs(np.sort(exact)) <= model.rotor.reach
        miss = np.abs(np.sort(found) / np.sort(exact) - 1.0)[asked]
        assert miss.max() <= 1e-3
