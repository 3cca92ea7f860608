"""Frame and sign: made-up orbits are named rightly, whatever way the disk turns."""

import numpy as np
import pytest
from made_up import whirl_word

from hpcwhirl.analysis.critical import critical_speeds
from hpcwhirl.analysis.whirl import (
    full_spectrum,
    static_frame,
    whirl_numbers,
    whole_revolutions,
)

TIME = np.arange(1, 5001) * 2e-4


def named(orbit, speed):
    centre = np.column_stack([orbit.real, orbit.imag])
    numbers = whirl_numbers(TIME, centre, speed)
    return whirl_word(numbers.ratio), numbers


@pytest.mark.parametrize("speed", [410.0, -410.0, 0.0])
@pytest.mark.parametrize("turning", [1, -1])
def test_a_circle_is_named_by_its_turning_with_the_rotation(speed, turning):
    sense = -1 if speed < 0 else 1
    orbit = 1e-4 * np.exp(1j * turning * sense * 153.0 * TIME)
    word, numbers = named(orbit, speed)
    assert word == ("forward" if turning > 0 else "backward")
    assert numbers.ratio == pytest.approx(turning, abs=1e-3)
    assert numbers.line == pytest.approx(turning * 153.0, abs=8.0)
    assert numbers.radius == pytest.approx(1e-4, rel=0.01)
    swept = 0.5 * turning * 153.0 * 1e-8
    assert numbers.area_rate == pytest.approx(swept, rel=0.02)


def test_an_offset_turns_nowhere():
    orbit = 3e-3 + 2e-3j + 1e-5 * np.exp(-1j * 90.0 * TIME)
    word, numbers = named(orbit, 410.0)
    assert word == "backward"
    assert numbers.radius == pytest.approx(1e-5, rel=0.05)


def test_the_power_of_an_orbit_names_it_not_the_frequency_of_its_lines():
    # power says forward, (1 - 0.25)/1.25; the area swept, 150 - 0.25 * 660, backward
    strong, weak = np.exp(1j * 150 * TIME), 0.5 * np.exp(-1j * 660 * TIME)
    word, numbers = named(1e-4 * (strong + weak), 410.0)
    assert word == "forward"
    assert numbers.area_rate < 0
    weak = 0.9 * np.exp(-1j * 660 * TIME)
    assert named(1e-4 * (strong + weak), 410.0)[0] == "mixed"
    weak = 0.3 * np.exp(-1j * 300 * TIME)
    assert named(1e-4 * (strong + weak), 410.0)[0] == "forward"


@pytest.mark.parametrize("count", [16, 17, 100])
@pytest.mark.parametrize("speed", [410.0, 0.0])
def test_a_mirrored_orbit_has_the_same_whirl(count, speed):
    """Mirrored with the rotation it turns as before; alone, the other way."""
    centre = np.random.default_rng(count).normal(size=(count, 2))
    mirrored = centre * [1.0, -1.0]
    time = TIME[:count]
    one = whirl_numbers(time, centre, speed)
    for other, sign in ((mirrored, -1.0), (centre, 1.0)):
        turned = whirl_numbers(time, other, sign * speed)
        sense = sign if speed == 0.0 else 1.0
        assert turned.ratio == pytest.approx(sense * one.ratio, rel=1e-12)
        assert turned.area_rate == pytest.approx(sense * one.area_rate, rel=1e-12)


def test_an_orbit_is_judged_over_whole_revolutions():
    speed, time = 2 * np.pi / (100 * 2e-4), TIME[:4970]  # 49 revolutions and 70 samples
    assert whole_revolutions(time, speed) == slice(70, 4970)
    orbit = np.column_stack([np.cos(speed * time), np.sin(speed * time)])
    numbers = whirl_numbers(time, 1e-4 * orbit, speed)  # without a mean of its own
    assert numbers.radius == pytest.approx(1e-4, rel=1e-12)


@pytest.mark.parametrize("count", [1, 2, 3, 15])
def test_an_orbit_of_few_samples_has_a_radius_and_no_direction(count):
    turned = 2 * np.pi * np.arange(count) / count  # a circle about the mean
    orbit = 3e-3 + 1e-4 * np.exp(1j * turned)
    numbers = whirl_numbers(
        TIME[:count], np.column_stack([orbit.real, orbit.imag]), 410.0
    )
    radius = 0.0 if count == 1 else 1e-4
    assert numbers == type(numbers)(0.0, 0.0, 0.0, pytest.approx(radius, rel=1e-9))


def test_rest_has_no_direction():
    _, numbers = named(np.zeros(len(TIME)) + 0j, 410.0)
    assert numbers == type(numbers)(0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("size", [1e-160, 1e-12, 1.0])
def test_the_name_does_not_depend_on_the_size(size):
    assert named(size * np.exp(-1j * 77 * TIME), 410.0)[0] == "backward"


def test_static_frame_turns_anticlockwise():  # Eq. (12)
    angle = np.array([0.0, np.pi / 2])
    turned = static_frame(np.array([[1.0, 0.0], [1.0, 0.0]]), angle)
    assert turned == pytest.approx(np.array([[1.0, 0.0], [0.0, 1.0]]))


def test_a_rotor_frame_backward_wave_is_forward_where_the_disk_is_faster():
    # 256.6 rad/s backward in the rotor stands at Omega - 256.6 in the static frame
    speed, own = 270.0, 256.6
    wave = 1e-4 * np.exp(-1j * own * TIME)
    rotor = np.column_stack([wave.real, wave.imag])
    centre = static_frame(rotor, speed * TIME)
    orbit = centre[:, 0] + 1j * centre[:, 1]
    assert np.abs(orbit - 1e-4 * np.exp(1j * (speed - own) * TIME)).max() < 1e-15
    assert named(1e-4 * np.exp(1j * 13.4 * TIME), speed)[0] == "forward"


def test_spectrum_amplitude_is_the_radius_of_the_circle():
    omega, amplitude = full_spectrum(2.0 * np.exp(1j * 2 * np.pi * 50 * TIME), 2e-4)
    top = np.argmax(amplitude)
    assert amplitude[top] == pytest.approx(2.0, rel=1e-6)
    assert omega[top] == pytest.approx(2 * np.pi * 50)


@pytest.mark.paper
def test_critical_speeds_of_the_paper():  # Eq. (13) and the 9th super-harmonic
    first = critical_speeds({1: 256.6}, {1: 13.4})
    assert first == [{"nodal_diameter": 1, "order": 1, "speed": pytest.approx(270.0)}]
    ninth = critical_speeds({1: 256.6}, {1: 18.2}, 9)[-1]
    assert ninth["speed"] == pytest.approx(420.0, abs=0.5)


def test_critical_speeds_need_both_bodies_and_a_diameter():
    speeds = critical_speeds({0: 1.0, 2: 10.0, 3: 5.0}, {0: 1.0, 2: 4.0}, 2)
    assert [(r["nodal_diameter"], r["speed"]) for r in speeds] == [(2, 7.0), (2, 9.0)]
