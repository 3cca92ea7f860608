"""Every word from a made-up history whose answer is known."""

from dataclasses import replace

import numpy as np
import pytest

from hpcwhirl.analysis.regimes import Thresholds, evidence, growths, name_regime
from hpcwhirl.analysis.whirl import whirl_numbers
from hpcwhirl.dynamics.history import LEDGER_TERMS, Evidence, History
from hpcwhirl.scene import Scene, apply_settings, named_scene
from hpcwhirl.scene.words import is_open

LIMITS = Thresholds()
TIME = np.arange(1, 10001) * 2e-4


def judged(energy, wave, *, fed, lost, casing=None, rubbed=0.25):
    """Evidence of energies (n,), an orbit (n,), ROTATING frame, and works, J/s."""
    casing = 0.1 * energy if casing is None else casing
    centre = np.column_stack([wave.real, wave.imag])
    works = (rate * TIME[: len(energy)] for rate in (fed, rubbed * fed, lost))
    return Evidence(TIME[: len(energy)], centre, energy, casing, *works)


def made(rate, *, fed=0.0, lost=1.0, last=2.0, stop="end", residual=0.0, line=-150.0):
    """A history of amplitude e^{rate t}; fed and lost in J a second."""
    return motion(
        np.exp(rate * TIME), fed=fed, lost=lost, last=last, stop=stop,
        residual=residual, line=line,
    )  # fmt: skip


def motion(amplitude, *, casing=None, fed=0.0, lost=1.0, last=2.0, stop="end",
           residual=0.0, line=-150.0):  # fmt: skip
    """A history of amplitudes (n,), of the rotor and its centre, and of the casing."""
    radius = 1e-4 * amplitude
    wave = radius * np.exp(1j * (line - 410.0) * TIME)
    ledger = dict.fromkeys(LEDGER_TERMS, 1.0) | {"residual": residual}
    casing = None if casing is None else casing**2
    return History(
        judged=judged(amplitude**2, wave, fed=fed, lost=lost, casing=casing),
        contact_impulse=1.0,
        end=float(TIME[-1]),
        time=TIME,
        centre=np.column_stack([wave.real, wave.imag]),
        energy=amplitude**2,
        impulse=TIME,
        fed=fed * TIME,
        friction=0.25 * fed * TIME,
        lost=lost * TIME,
        tips=np.zeros((0, 22, 2)),
        blade_impulse=np.zeros((0, 22)),
        ledger=ledger,
        gap_error=0.0,
        slip=0.0,
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


def of_energy(energy, *, fed=0.0, lost=1.0, last=2.0):
    """A history with an energy (n,) of the rotor, and its centre at amplitude 1e-4."""
    whole = made(0.0, fed=fed, lost=lost, last=last)
    evident = replace(whole.judged, rotor=energy, casing=0 * energy)
    return replace(whole, judged=evident)


def words(history, scene=None):
    found = evidence(scene or Scene(), history) | {"stop": history.stop}
    return name_regime(found, LIMITS)


def test_falling_after_contact_is_damped():
    assert words(made(-2.0, last=0.3))[:2] == ("completed", "damped")


@pytest.mark.parametrize("fed", [0.0, 0.05])
def test_what_still_touches_is_not_damped(fed):
    assert words(made(-2.0, fed=fed))[1] == "undecided"


def test_without_contact_no_part_may_rise():
    falling, rising = np.exp(-2.0 * TIME), np.exp(0.5 * (TIME - 2.0))
    assert words(motion(falling, casing=0.1 * falling, last=0.3))[1] == "damped"
    assert words(motion(falling, casing=0.1 * rising, last=0.3))[1] == "undecided"
    assert words(motion(0.1 * rising, casing=falling, last=0.3))[1] == "undecided"


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


def test_growth_while_a_gap_closes_is_not_divergent():
    closing = Scene(gap_closure=5e-5)
    assert words(made(2.0, fed=50.0), closing)[1] == "undecided"
    beyond = made(2.0, fed=50.0, stop="amplitude")
    assert words(beyond, closing)[1] == "divergent"


def test_growth_that_nothing_feeds_is_not_divergent():
    assert words(made(2.0, fed=0.0))[1] == "undecided"


def test_slow_growth_is_undecided():
    assert words(made(0.25, fed=10.0, lost=10.0))[1] == "undecided"


def at_the_limit(pulse, friction, rotation, load=0.0):
    """Words of a run to the amplitude limit, by what went in; load : s, pulse."""
    history = made(9.0, fed=1.0, stop="amplitude")
    works = {"pulse": pulse, "friction": friction, "rotation": rotation}
    loaded = apply_settings(Scene(), {"pulse": load}) if load else None
    return words(replace(history, ledger=history.ledger | works), loaded)


def test_beyond_the_amplitude_limit_is_divergent_and_stopped():
    assert words(made(9.0, fed=1.0, stop="amplitude"))[:2] == ("stopped", "divergent")


def test_a_run_fed_by_friction_at_the_limit_is_divergent():
    # also while the pulse still acts: more time could tell no more
    assert at_the_limit(1.0, 3.0, 1.0)[:2] == ("stopped", "divergent")
    assert at_the_limit(1.0, 3.0, 1.0, load=1.9)[:2] == ("stopped", "divergent")


def test_a_run_that_the_pulse_carried_to_the_limit_is_overloaded():
    for load in (0.0, 1.9):
        assert at_the_limit(4.0, 3.0, 1.0, load) == ("overloaded", "none", "none")
        assert at_the_limit(4.0, -3.0, 1.0, load) == ("overloaded", "none", "none")


@pytest.mark.parametrize(
    "stop", ["amplitude", "nonfinite", "complementarity", "certain"]
)
@pytest.mark.parametrize("regime", ["undecided", "divergent", "sustained", "none"])
def test_what_did_not_reach_its_end_is_never_offered_more_time(stop, regime):
    assert not is_open({"regime": regime, "stop": stop})


def test_a_swing_of_the_pulse_that_does_not_grow_is_overloaded():
    # tips reach the limit sideways at once, and would swing back: no runaway
    history = made(0.1, fed=1.0, stop="amplitude")
    loaded = apply_settings(Scene(), {"pulse": 1.9})
    assert words(history, loaded) == ("overloaded", "none", "none")
    assert words(history)[:2] == ("stopped", "divergent")


def test_growth_alone_may_come_to_an_end_in_a_longer_run():
    assert is_open({"regime": "divergent", "stop": "end"})
    assert is_open({"regime": "undecided", "stop": "end"})
    assert not is_open({"regime": "sustained", "stop": "end"})


def test_growth_that_slows_by_a_third_is_not_divergent():
    # amplitudes as of motions that were sustained for good in a longer run
    slowing = np.exp(3.0 * TIME - 0.55 * (TIME - 1.2) ** 2 * (TIME > 1.2))
    numbers = evidence(Scene(), motion(slowing, fed=10.0))
    assert 0.5 < numbers["growth_last"] / numbers["growth_rate"] < 0.9
    assert words(motion(slowing, fed=10.0))[1] == "undecided"


@pytest.mark.parametrize("stop", ["nonfinite", "complementarity"])
def test_a_run_that_broke_is_unstable(stop):
    assert words(made(2.0, fed=50.0, stop=stop)) == ("unstable", "none", "none")


def test_an_open_ledger_is_unstable_however_it_grows():
    assert words(made(2.0, fed=50.0, residual=1e-3))[0] == "unstable"
    assert words(made(2.0, fed=50.0, residual=float("nan")))[0] == "unstable"


def test_no_motion_at_all_is_damped_without_whirl():
    still = made(-2.0, last=-1.0)
    seen = vars(still.judged)
    nothing = Evidence(**{n: v if n == "time" else 0 * v for n, v in seen.items()})
    assert words(replace(still, judged=nothing)) == ("completed", "damped", "none")


def test_a_centre_at_round_off_has_no_whirl():
    still = made(-2.0, last=0.1)
    quiet = replace(still.judged, centre=still.judged.centre * 1e-14)
    assert words(replace(still, judged=quiet))[2] == "none"


def orbiting(orbit, speed):
    """A steady history whose centre goes about `orbit` (n,) in the STATIC frame."""
    own = orbit * np.exp(-1j * speed * TIME)
    steady = made(0.0, fed=10.0, lost=10.0)
    centre = np.column_stack([own.real, own.imag])
    return replace(steady, judged=replace(steady.judged, centre=centre))


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
        circle(150) + 0.14 * circle(-1500),  # 98 % of its power, the smaller area rate
    ],
    "backward": [
        circle(-150),
        circle(-13.4),
        circle(-700),
        circle(-150) + 4e-3 - 1e-3j,
        circle(-150) + 0.5 * circle(120) + 1e-3,
        circle(-150) + 0.14 * circle(1500),
    ],
    "mixed": [circle(150) + circle(-150), circle(150) + 0.8 * circle(-660)],
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
    energy = 1 + 0.9 * np.cos(2 * np.pi * 25 * TIME)
    assert words(of_energy(energy, fed=10.0, lost=10.0))[1] == "sustained"


@pytest.mark.parametrize("count", [0, 1, 2, 5])
def test_a_few_rows_of_evidence_give_a_word(count):
    whole = made(-2.0)
    short = Evidence(**{n: v[:count] for n, v in vars(whole.judged).items()})
    assert words(replace(whole, judged=short))[0] == "completed"


def test_other_thresholds_give_other_words_from_the_same_numbers():
    history = made(0.25, fed=10.0, lost=10.0)
    found = evidence(Scene(), history) | {"stop": "end"}
    assert name_regime(found, Thresholds(rise=0.1, above=0))[1] == "divergent"


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
    energy = np.where(ends > TIME, 1e-240 * np.exp(-20 * TIME), 0.0)
    assert words(of_energy(energy, last=0.3))[1] == "damped"


def test_the_rate_of_a_motion_that_came_to_rest_does_not_tell_when_it_was_flushed():
    # kernels flush amplitudes below 1e-150, the closed form goes on to denormals
    time = np.linspace(2.0, 5.0, 3000)
    natural = np.exp(-2 * 100.0 * time)
    flushed = np.where(natural > 1e-295, natural, 0.0)
    (one, _), (other, _) = growths(np.stack([time, natural, flushed]))
    assert natural[-1] == flushed[-1] == 0.0
    assert one == pytest.approx(other, rel=1e-12)
    assert one == pytest.approx(-100.0, rel=0.2)


def test_a_motion_that_begins_in_the_window_is_no_divergence():
    energy = np.where(TIME > 1.5, 1.0, 0.0)
    assert words(of_energy(energy, fed=2.0))[1] != "divergent"


def test_a_motion_that_rests_for_a_while_is_not_damped():
    rests = (TIME > 1.3) & (TIME < 1.6)
    energy = np.where(rests, 0.0, 1.0)
    assert words(of_energy(energy, last=0.3))[1] == "undecided"


# a battery of motions, all in contact and fed what they lose: the word each must get
KEPT_UP = {"fed": 10.0, "lost": 10.0}


def wandering(seed):
    """An amplitude about 1 that forgets itself within 20 ms (Ornstein, Uhlenbeck)."""
    pushes = np.random.default_rng(seed).normal(size=len(TIME))
    out, keep = np.zeros(len(TIME)), np.exp(-2e-4 / 0.02)
    for n in range(1, len(out)):
        out[n] = keep * out[n - 1] + 0.2 * np.sqrt(1 - keep**2) * pushes[n]
    return np.exp(out)


def test_growth_is_divergent_however_it_accelerates():
    for rate in (0.7, 2.0, 5.0, 20.0):
        assert words(made(rate, fed=50.0))[1] == "divergent"
    for end in (2.001, 2.05, 2.3):  # with a large error of a straight line
        assert words(motion(1 / (end - TIME), fed=50.0))[1] == "divergent"


@pytest.mark.parametrize("bend", [0.0, 0.5, 2.0])
@pytest.mark.parametrize("seed", range(4))
def test_a_word_is_monotone_in_the_growth_that_it_is_given_by(seed, bend):
    """Growth that a straight line fits badly: it wanders, and becomes faster."""
    way, rates = (TIME / TIME[-1]) ** (1 + bend), np.geomspace(0.1, 40.0, 12)
    noise = wandering(seed) ** 0.3
    found = [words(motion(noise * np.exp(2 * rate * way), fed=50.0))[1]
             for rate in rates]  # fmt: skip
    first = found.index("divergent")
    assert first > 0
    assert set(found[first:]) == {"divergent"}
    assert set(found[:first]) <= {"undecided", "sustained"}


def test_a_limit_cycle_is_sustained():
    assert words(motion(1 + 0 * TIME, **KEPT_UP))[1] == "sustained"
    two = np.abs(1 + 0.5 * np.exp(2j * np.pi * 17.3 * TIME))
    assert words(motion(two, **KEPT_UP))[1] == "sustained"


@pytest.mark.parametrize("period", [0.5, 0.7, 1.0, 1.3])
@pytest.mark.parametrize("swing", [0.3, 0.9])
def test_a_beat_that_was_as_high_before_is_no_divergence(period, swing):
    for phase in np.linspace(0, 2 * np.pi, 12, endpoint=False):
        beat = 1 + swing * np.sin(2 * np.pi * TIME / period + phase)
        assert words(motion(beat, **KEPT_UP))[1] in {"undecided", "sustained"}


@pytest.mark.parametrize("when", [1.3, 1.5, 1.7, 1.8])
def test_a_rise_that_has_ended_is_no_divergence(when):
    saturated = 1 / (1 + np.exp(-20 * (TIME - when)))
    assert words(motion(saturated, **KEPT_UP))[1] in {"undecided", "sustained"}


def test_a_ring_that_rings_on_does_not_hide_an_orbit():
    ringing = 5 * np.exp(-0.5 * TIME)
    grown = np.minimum(0.1 * np.exp(3 * TIME), 1.0)
    for orbit in (grown, 1 + 0 * TIME, 0.1 * np.exp(0.7 * TIME)):
        told = words(motion(orbit, casing=ringing, fed=8.0, lost=12.0))
        assert told[1] == "undecided"


@pytest.mark.turns
def test_a_motion_that_wanders_is_neither_damped_nor_divergent():
    told = [words(motion(wandering(seed), **KEPT_UP))[1] for seed in range(40)]
    assert set(told) <= {"sustained", "undecided"}
    assert told.count("sustained") > 30


def rub(blades, *, casing=0.0, shaft=0.0, fed=10.0):
    """A rub that loses 10 J/s; amplitudes of energies and centre, e^{rate t}."""
    whole = made(shaft, fed=fed, lost=10.0)
    energies = [np.exp(2 * rate * (TIME - 2.0)) for rate in (blades, casing)]
    evident = replace(whole.judged, rotor=energies[0], casing=0.3 * energies[1])
    return replace(whole, judged=evident)


@pytest.mark.parametrize("rate", [-0.6, -0.3, 0.3])  # a window has 0.8 s
def test_blades_that_wander_do_not_end_a_rub_that_goes_on_all_round(rate):
    assert words(rub(rate))[1] == "sustained"
    assert words(rub(rate, casing=rate))[1] != "sustained"
    assert words(rub(rate, shaft=rate))[1] != "sustained"
    assert words(rub(rate, fed=7.0))[1] != "sustained"


def test_growth_that_moves_neither_casing_nor_shaft_is_no_divergence():
    assert words(rub(1.0))[1] == "undecided"
    assert words(rub(1.0, casing=1.0))[1] == "divergent"
    assert words(rub(1.0, shaft=1.0))[1] == "divergent"


def test_a_rigid_casing_tells_nothing_of_a_rub():
    rigid = rub(1.0)
    evident = replace(rigid.judged, casing=0 * TIME)
    assert words(replace(rigid, judged=evident))[1] == "divergent"


def test_what_cannot_be_told_from_a_fall_is_not_sustained():
    rough = np.exp(-1.3 * TIME + 0.9 * np.sign(np.sin(2 * np.pi * 7.5 * TIME)))
    found = evidence(Scene(), motion(rough, **KEPT_UP))
    assert abs(found["growth_rate"]) < 3 * found["growth_error"]
    assert words(motion(rough, **KEPT_UP))[1] == "undecided"


def plainly(time, energy):
    """The rate of a growth and its error, 1/s, as they are told, array by array."""
    count = min(12, len(time))
    at = np.array([part.mean() for part in np.array_split(time, count)])
    parts = np.array_split(energy, count)
    level = 0.5 * np.log(np.array([part.mean() for part in parts]))
    away, bend = at - at.mean(), np.diff(level, 2)
    error = np.sqrt(bend @ bend / (6 * len(bend)) / (away @ away))
    return float(away @ level / (away @ away)), float(error)


@pytest.mark.parametrize("count", [3, 12, 13, 65, 1000, 4096])
def test_growths_are_the_bits_of_plain_formulas(count):
    chance = np.random.default_rng(count)
    time = np.arange(1.0, count + 1) * 7e-6
    energies = np.exp(chance.normal(size=(4, count)))
    found = growths(np.vstack([time, energies]))
    assert found == [plainly(time, energy) for energy in energies]


@pytest.mark.parametrize("count", [16, 17, 65, 1000])
@pytest.mark.parametrize("speed", [410.0, -410.0, 0.0])
def test_whirl_numbers_are_the_bits_of_plain_formulas(count, speed):
    chance = np.random.default_rng(count)
    time = np.arange(1.0, count + 1) * 7e-6
    centre = chance.normal(size=(count, 2))
    found = whirl_numbers(time, centre, speed)
    orbit = centre[:, 0] + 1j * centre[:, 1]
    orbit = orbit - orbit.mean()
    radius = float(np.sqrt(np.mean(np.abs(orbit) ** 2)))
    scaled, interval, sign = orbit / radius, float(time[1] - time[0]), np.sign(speed)
    sign = sign or 1.0
    window = 0.5 + 0.5 * np.cos(np.linspace(-np.pi, np.pi, count + 1)[:-1])
    centred = scaled - (window @ scaled) / window.sum()
    power = np.abs(np.fft.fftshift(np.fft.fft(window * centred)) / window.sum()) ** 2
    omega = 2 * np.pi * np.fft.fftshift(np.fft.fftfreq(count, interval))
    ahead, back = power[sign * omega > 0].sum(), power[sign * omega < 0].sum()
    if count % 2 == 0:
        ahead, back = ahead + sign * power[0] / 2, back - sign * power[0] / 2
    swept = 0.5 * np.imag(scaled[:-1].conj() * scaled[1:]).mean() / interval
    assert found.ratio == float((ahead - back) / (ahead + back))
    assert found.line == float(sign * omega[np.argmax(power)])
    assert (found.radius, found.area_rate) == (radius, float(sign * swept * radius**2))
