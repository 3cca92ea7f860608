"""Every word from a made-up history whose answer is known."""

from dataclasses import replace

import numpy as np
import pytest

from hpcwhirl.analysis.regimes import Thresholds, evidence, name_regime
from hpcwhirl.dynamics.history import LEDGER_TERMS, History
from hpcwhirl.scene import Scene, apply_settings, named_scene

LIMITS = Thresholds()
TIME = np.arange(1, 10001) * 2e-4


def made(rate, *, fed=0.0, lost=1.0, last=2.0, stop="end", residual=0.0, line=-150.0):
    """A history of amplitude e^{rate t}; fed and lost in J a second."""
    energy = np.exp(2 * rate * TIME)
    radius = 1e-4 * np.exp(rate * TIME)
    wave = radius * np.exp(1j * (line - 410.0) * TIME)
    ledger = dict.fromkeys(LEDGER_TERMS, 1.0) | {"residual": residual}
    return History(
        time=TIME,
        centre=np.column_stack([wave.real, wave.imag]),
        energy=energy,
        impulse=TIME,
        fed=fed * TIME,
        friction=0.25 * fed * TIME,
        lost=lost * TIME,
        tips=np.zeros((0, 22, 2)),
        blade_impulse=np.zeros((0, 22)),
        ledger=ledger,
        gap_error=0.0,
        step_share=0.1,
        stop=stop,
        steps=10000,
        contacts=10,
        last_contact=last,
        certificate=-1.0,
        certificate_reach=0.0,
        centre_peak=float(radius.max()),
        seconds=1.0,
        interval=2e-4,
    )


def words(history, scene=None):
    found = evidence(scene or Scene(), history) | {"stop": history.stop}
    return name_regime(found, LIMITS)


def test_falling_after_contact_is_damped():
    assert words(made(-2.0, last=0.3))[:2] == ("completed", "damped")


def test_falling_while_grazing_is_damped():
    assert words(made(-2.0, fed=0.05))[1] == "damped"


def test_falling_while_fed_is_undecided():
    assert words(made(-2.0, fed=0.5))[1] == "undecided"


def test_steady_contact_that_replaces_the_loss_is_sustained():
    assert words(made(0.0, fed=10.0, lost=10.0))[1] == "sustained"


def test_steady_without_contact_is_undecided():
    assert words(made(0.0, last=0.1))[1] == "undecided"


def test_a_window_too_short_to_turn_the_energy_over_is_undecided():
    assert words(made(0.0, fed=1.0, lost=1.0))[1] == "undecided"


def test_growth_fed_by_the_rotation_is_divergent():
    assert words(made(2.0, fed=50.0))[1] == "divergent"


def test_growth_that_nothing_feeds_is_not_divergent():
    assert words(made(2.0, fed=0.0))[1] == "undecided"


def test_slow_growth_is_undecided():
    assert words(made(0.25, fed=10.0, lost=10.0))[1] == "undecided"


def test_beyond_the_amplitude_limit_is_divergent_and_stopped():
    assert words(made(9.0, fed=1.0, stop="amplitude"))[:2] == ("stopped", "divergent")


@pytest.mark.parametrize("stop", ["nonfinite", "complementarity"])
def test_a_run_that_broke_is_unstable(stop):
    assert words(made(2.0, fed=50.0, stop=stop)) == ("unstable", "none", "none")


def test_an_open_ledger_is_unstable_however_it_grows():
    assert words(made(2.0, fed=50.0, residual=1e-3))[0] == "unstable"
    assert words(made(2.0, fed=50.0, residual=float("nan")))[0] == "unstable"


def test_no_motion_at_all_is_damped_without_whirl():
    still = made(-2.0, last=-1.0)
    nothing = {n: 0 * getattr(still, n) for n in ("centre", "energy", "fed", "lost")}
    assert words(History(**(vars(still) | nothing))) == ("completed", "damped", "none")


def test_a_centre_at_round_off_has_no_whirl():
    still = made(-2.0, last=0.1)
    quiet = History(**(vars(still) | {"centre": still.centre * 1e-14}))
    assert words(quiet)[2] == "none"


@pytest.mark.parametrize(("line", "word"), [(150.0, "forward"), (-150.0, "backward")])
def test_whirl_is_that_of_the_static_frame(line, word):
    assert words(made(0.0, fed=10.0, lost=10.0, line=line))[2] == word


def orbiting(orbit, speed):
    """A steady history whose centre goes about `orbit` (n,) in the STATIC frame."""
    own = orbit * np.exp(-1j * speed * TIME)
    steady = made(0.0, fed=10.0, lost=10.0)
    return History(**(vars(steady) | {"centre": np.column_stack([own.real, own.imag])}))


def whirl_of(orbit, speed):
    return words(orbiting(orbit, speed), apply_settings(Scene(), {"speed": speed}))[2]


def circle(line):
    return 1e-4 * np.exp(1j * line * TIME)


# made-up orbits of a rotor that turns anticlockwise, and what they are
ORBITS = {
    "forward": [
        circle(150),
        circle(13.4),
        circle(700),
        circle(150) + 4e-3 - 1e-3j,
        circle(150) + 0.5 * circle(-120) + 1e-3,
    ],
    "backward": [
        circle(-150),
        circle(-13.4),
        circle(-700),
        circle(-150) + 4e-3 - 1e-3j,
        circle(-150) + 0.5 * circle(120) + 1e-3,
    ],
    "mixed": [circle(150) + circle(-150), circle(150) + 0.5 * circle(-660)],
    "none": [np.full(len(TIME), 4e-3 - 1e-3j), 1e-11 * circle(150)],
}
CASES = [(o, word) for word, orbits in ORBITS.items() for o in orbits]
OPPOSITE = {"forward": "backward", "backward": "forward"}


@pytest.mark.parametrize(("orbit", "word"), CASES)
def test_a_made_up_orbit_is_named_rightly_whatever_way_the_rotor_turns(orbit, word):
    assert whirl_of(orbit, 410.0) == word
    assert whirl_of(orbit.conj(), -410.0) == word  # mirrored
    assert whirl_of(orbit, -410.0) == OPPOSITE.get(word, word)


@pytest.mark.parametrize("speed", [410.0, -410.0])
def test_a_bow_that_turns_with_the_rotor_is_forward(speed):
    bow = 1e-4 * np.exp(1j * speed * TIME)
    scene = apply_settings(Scene(), {"speed": speed})
    found = evidence(scene, orbiting(bow, speed))
    assert words(orbiting(bow, speed), scene)[2] == "forward"
    assert found["line_frequency"] == pytest.approx(410.0, abs=2.0)
    assert found["orbit_area"] == pytest.approx(0.5 * 410 * 1e-8, rel=0.01)


def test_beating_does_not_pass_for_growth():
    beat = made(0.0, fed=10.0, lost=10.0)
    energy = 1 + 0.9 * np.cos(2 * np.pi * 25 * TIME)
    assert words(History(**(vars(beat) | {"energy": energy})))[1] == "sustained"


@pytest.mark.parametrize("count", [0, 1, 2, 5])
def test_a_few_samples_give_a_word(count):
    whole = made(-2.0)
    names = ("time", "centre", "energy", "impulse", "fed", "friction", "lost")
    short = {n: getattr(whole, n)[:count] for n in names}
    assert words(History(**(vars(whole) | short)))[0] == "completed"


def test_other_thresholds_give_other_words_from_the_same_numbers():
    history = made(0.25, fed=10.0, lost=10.0)
    found = evidence(Scene(), history) | {"stop": "end"}
    assert name_regime(found, Thresholds(rise=0.1))[1] == "divergent"


def test_gap_of_zero_still_has_a_floor_for_whirl():
    scene = apply_settings(named_scene("table2"), {"gap": 0.0})
    assert evidence(scene, made(-2.0))["gap_scale"] > 0


def test_growth_under_the_pulse_is_no_divergence():
    growing = made(2.0, fed=30.0)
    assert words(growing)[1] == "divergent"
    loaded = apply_settings(Scene(), {"pulse": 10.0})
    assert words(growing, loaded)[1] == "undecided"
    rigid = apply_settings(Scene(), {"pulse": 10.0, "kind": "rigid"})
    assert words(growing, rigid)[1] == "divergent"


@pytest.mark.parametrize("ends", [0.85, 1.2, 1.9])
def test_a_motion_that_comes_to_rest_in_the_window_is_damped(ends):
    # its amplitudes are flushed to 0 below 1e-150: no logarithm, and yet it fell
    energy = np.where(ends > TIME, 1e-290 * np.exp(-20 * TIME), 0.0)
    assert words(replace(made(0.0, last=0.3), energy=energy))[1] == "damped"


def test_a_motion_that_begins_in_the_window_is_no_divergence():
    energy = np.where(TIME > 1.5, 1.0, 0.0)
    assert words(replace(made(0.0, fed=2.0), energy=energy))[1] != "divergent"


def test_a_motion_that_rests_for_a_while_is_not_damped():
    rests = (TIME > 1.3) & (TIME < 1.6)
    energy = np.where(rests, 0.0, 1.0)
    assert words(replace(made(0.0, last=0.3), energy=energy))[1] == "undecided"
