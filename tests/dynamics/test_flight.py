"""The exact scheme: flow of free modes, flights, certificate."""

from functools import lru_cache

import numpy as np
import pytest
from alike import assert_alike, assert_same_in_parts

from hpcwhirl.campaign.simulate import result_of
from hpcwhirl.case.explain import notes_of
from hpcwhirl.case.profile import departure, shape_of
from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.bodies.timestep import central_differences, exact_flow
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.kernels.loop import flight, slot_flights
from hpcwhirl.dynamics.kernels.loop.slot_steps import slot_space
from hpcwhirl.dynamics.kernels.vectors import widths
from hpcwhirl.dynamics.march import March
from hpcwhirl.dynamics.schemes import equal_sectors
from hpcwhirl.dynamics.waves import slot_waves
from hpcwhirl.dynamics.waves.slots import blade_waves
from hpcwhirl.errors import InputError
from hpcwhirl.scene import apply_settings, named_scene

NEVER = np.iinfo(np.int64).max
ROTATIONS = "none", "full"


def scene(**settings):
    short = {"scheme": "exact", "duration": 5e-3, "interval": 1e-4, "traces": "full",
             "plan": "everything"}  # fmt: skip
    return apply_settings(named_scene("mostly_damped"), short | settings)


def ended(*, fly=True, **settings):
    march = March(resolve(scene(**settings)))
    if not fly:
        march.counter[contact.NEXT_TRY] = NEVER
    return march, march.run()


@pytest.mark.parametrize("omega", [1e-3, 13.0, 264.0, 3.3e4, 2.9e5])
@pytest.mark.parametrize("damping", [0.0, 0.01, 0.9])
def test_a_step_of_the_flow_is_the_damped_mode(omega, damping):
    # q(t) = Re e^{lambda t}, lambda = omega (-xi + i sqrt(1 - xi^2)), and v = q'
    step = 1e-6
    root = omega * complex(-damping, np.sqrt(1 - damping**2))
    time = step * np.arange(3)
    q, v = np.exp(root * time).real, (root * np.exp(root * time)).real
    d = (np.expm1(root * step) * np.exp(root * (time - step))).real
    flow = exact_flow(omega, damping, step)
    assert flow.keep * d[1] - flow.pull * q[1] == pytest.approx(d[2], rel=1e-9)
    speed = flow.speed[0] * d + flow.speed[1] * q
    assert speed == pytest.approx(v, rel=1e-8, abs=1e-9 * omega)


@pytest.mark.parametrize("damping", [0.0, 0.3])
def test_a_mode_without_stiffness_keeps_its_velocity(damping):
    step = 2e-6
    flow = exact_flow(0.0, damping, step)
    assert (flow.keep, flow.pull) == (1.0, 0.0)
    assert flow.give == pytest.approx(step**2)  # an impulse f dt, for a step
    assert flow.speed == pytest.approx((1 / step, 0.0))


def test_the_flow_is_central_differences_as_the_step_goes_to_zero():
    for omega in (264.0, 3.3e4):
        gaps = []
        for step in (4e-6, 2e-6, 1e-6):
            a, b = (f(omega, 0.01, step) for f in (exact_flow, central_differences))
            gaps.append(abs(a.pull / b.pull - 1))
        assert gaps[0] / gaps[2] == pytest.approx(16.0, rel=0.1)


def spread(rng, size, share):
    """Return random complex numbers over six decades, a share of them not 0."""
    out = 10.0 ** rng.uniform(-6, 0, size=size) * rng.normal(size=(2, size))
    return (out[0] + 1j * out[1]) * (rng.random(size) < share)


@lru_cache(maxsize=1)
def free_of(march):
    """Return the free motion of a march, made once."""
    return march.scheme.free()


def random_state(march, rng, share=1.0):
    """Put a random free motion of a share of all waves, as fast ones, into a march."""
    free = free_of(march)
    rate = np.abs(free.ahead)
    a = 1e-6 * spread(rng, len(rate), share)
    free.put(march.state, np.divide(a, rate, out=0 * a, where=rate > 1e-12))


def flown(march, steps):
    """Return the gaps `steps` (any real number) after the state of a march, m."""
    step, scheme, free = (
        march.scene.solver.time_step, march.scheme, free_of(march),
    )  # fmt: skip
    a = free.amplitudes(march.state) * np.exp(steps * np.log1p(free.ahead))
    row, slot = np.nonzero(scheme.ring.there)
    ring = scheme.ring.radial[row, slot] * a[len(a) - len(row) :]
    gaps = march.scene.gap - (free.moved.radial @ a).real
    gaps += (blade_waves(march.model.blades)[:, slot] @ ring).real
    turned = march.scene.speed * steps * step
    places = turned + 2 * np.pi * np.arange(len(gaps)) / len(gaps)
    return gaps + departure(shape_of(march.scene), places)


@pytest.mark.turns
@pytest.mark.parametrize("speed", [410.0, -150.0])
def test_free_motion_is_the_same_at_any_step_and_with_any_jumps(speed):
    # each mode must be Re c e^{lambda t}: c from two steps, t after hundreds of jumps
    march = March(resolve(scene(gap=4.0, force=0.0, speed=speed, duration=20e-3)))
    step, bodies = march.scene.solver.time_step, (march.model.rotor, march.model.casing)
    random_state(march, np.random.default_rng(1))
    march.counter[contact.ENDED] = 0
    march.counter[contact.NEXT_TRY] = 1

    def amplitudes():
        found = zip(bodies, march.displacements(), strict=True)
        return [np.linalg.lstsq(b.shapes, x, rcond=None)[0] for b, x in found]

    first = amplitudes()
    march.advance(1)
    assert march.steps == 1
    second = amplitudes()
    march.run()
    assert march.counter[contact.JUMPED] > 15000
    for body, a, b, found in zip(bodies, first, second, amplitudes(), strict=True):
        root = body.omega * (-body.ratios + 1j * np.sqrt(1 - body.ratios**2))
        z = np.exp(root * step)
        sine = (a * z.real - b) / z.imag  # a = Re c, b = Re c z
        want = ((a + 1j * sine) * np.exp(root * 20e-3)).real
        scale = np.abs(a) + np.abs(sine)
        assert scale.min() > 0
        assert np.all(np.abs(found - want) < 1e-6 * scale)


@pytest.mark.parametrize(
    "given",
    [
        {"nodal_diameter": 1},
        {"nodal_diameter": 3},
        {"nodal_diameter": 1, "rotation": "full", "duration": 2e-2},
        {"nodal_diameter": 2, "rotation": "full", "unbalance": 2e-2},
    ],
)
def test_flights_change_nothing_but_the_work(given):
    settings = {"duration": 4e-3, "interval": 2e-5, "gap": 4e-4, "force": 4e5} | given
    (with_jumps, a), (without, b) = (ended(fly=f, **settings) for f in (True, False))
    assert without.counter[contact.JUMPED] == 0
    assert with_jumps.counter[contact.JUMPED] > 50
    assert a.contacts > 10
    assert_alike(a, b, 1e-7)


def bounds_of(march):
    """Return (second derivative, reach) that bound all gaps."""
    rate = np.zeros(2 * widths(march.model.blades)[0])
    return slot_flights.bound_slots(
        march.scheme.arrays.rotor.rows, march.state.rotor, rate
    )


@pytest.mark.slow
@pytest.mark.parametrize("rotation", ROTATIONS)
def test_reach_bounds_all_later_displacements(rotation):
    march = March(resolve(scene(rotation=rotation)))
    rng, gap, used = np.random.default_rng(3), march.scene.gap, []
    for _ in range(200):
        random_state(march, rng, share=0.01)
        _, reach = bounds_of(march)
        if reach == 0.0:
            continue
        later = np.r_[0, 10.0 ** rng.uniform(0, 4, size=8)]
        lowest = min(flown(march, steps).min() for steps in later)
        used.append((gap - lowest) / reach)
    assert max(used) < 1 + 1e-9
    assert max(used) > 0.9  # and not far too careful


def looked_ahead(march):
    """Return the steps that a march takes for free, from its state as the first."""
    blades, (_, wide) = march.model.blades, widths(march.model.blades)
    fold = [j if j < wide else (blades - (j - wide)) % blades for j in range(2 * wide)]
    march.counter[:] = 0
    march.counter[[contact.LAST, contact.CERTIFIED]] = -1
    march.state.gaps[: 2 * wide] = flown(march, 0.0)[fold]
    return 1 + slot_flights.steps_ahead(
        march.scheme.arrays.rotor.rows, march.wall, march.scene.solver.time_step,
        march.speed, march.state, slot_space(march.scheme.arrays, march.state),
    )  # fmt: skip


OVAL = "harmonic,amplitude,phase;2,-2e-4,0.4;5,5e-5,1;43,2e-6,2"


@pytest.mark.turns
@pytest.mark.parametrize(
    ("rotation", "speed", "profile"),
    [
        ("none", 0.0, ""),
        ("none", 5000.0, ""),
        ("full", 1000.0, ""),
        ("none", 410.0, OVAL),
        ("full", -410.0, OVAL),
    ],
)
def test_no_blade_touches_within_a_jump(rotation, speed, profile):
    given = scene(rotation=rotation, speed=speed, gap=5e-4, profile=profile)
    march = March(resolve(given))
    rng, closed, jumps = np.random.default_rng(int(abs(speed))), 0, []
    for _ in range(250):
        random_state(march, rng, share=0.02)
        gap = march.scene.gap
        nearest = gap - flown(march, 0.0).min()
        if nearest <= 0.0:
            continue
        used = rng.uniform(0.1, 0.95) * gap / nearest
        march.state.rotor[:] *= used  # the nearest blade uses up part of the gap
        if flown(march, 0.0).min() <= 0.0:  # of a shape beside the motion
            continue
        steps = looked_ahead(march)
        jumps.append(steps)
        for part in np.linspace(0.0, steps, 12):
            assert flown(march, part).min() > -1e-18
        ahead = [flown(march, steps * f).min() for f in (1.5, 2, 3, 5, 8)]
        closed += steps < 1024 and min(ahead) < 0.0
    jumps = np.array(jumps)
    assert len(jumps) > 125
    assert np.mean((jumps > 4) & (jumps < 1024)) > 0.3  # of use
    if not profile:  # a shape's own bound, of all harmonics at once, is careful
        assert closed > 0.02 * len(jumps)  # and not far too careful


@pytest.mark.parametrize("rotation", ROTATIONS)
def test_after_a_certificate_no_blade_ever_touches(rotation):
    settings = {"gap": 1e-3, "friction": 0.2, "nodal_diameter": 2, "rotation": rotation}
    march, history = ended(duration=0.1, **settings)
    certified = int(march.counter[contact.CERTIFIED])
    assert certified > 0
    assert 0 < history.certificate_reach < march.scene.gap
    again = March(resolve(scene(duration=1.0, **settings)))
    again.advance(certified)
    last = again.counter[contact.LAST]
    lowest = np.inf
    again.counter[contact.NEXT_TRY] = NEVER  # step on, ten times as long
    again.counter[contact.CERTIFIED] = -1
    while again.steps < 10 * certified:
        again.advance(97)
        lowest = min(lowest, again.state.gaps.min())
    assert again.counter[contact.LAST] == last
    assert lowest >= again.scene.gap - history.certificate_reach
    assert result_of(march.case, history).row["regime"] == "damped"


@pytest.mark.parametrize(
    "settings",
    [
        {"engine.casing.damping": 0.0},
        {"engine.rotor.damping": 0.0, "rotation": "full"},
        {"speed": 1000.0, "rotation": "full"},  # ground resonance: a wave grows
    ],
)
def test_no_certificate_where_motion_may_last(settings):
    quiet = {"gap": 0.05, "duration": 0.02, "force": 10.0}
    march, history = ended(**quiet, **settings)
    assert march.counter[contact.JUMPED] > 0
    assert history.certificate == -1.0
    assert history.certificate_reach == 0.0


@pytest.mark.slow  # a kernel of its own
def test_a_growing_rigid_casing_allows_no_flight():
    rigid = {"kind": "rigid", "amplitude": 2e-4, "growth": 40.0}
    march, history = ended(**rigid)
    assert history.contacts > 0
    assert march.counter[contact.JUMPED] == 0


@pytest.mark.parametrize("rotation", ROTATIONS)
def test_flights_between_two_cuts_of_a_run_give_the_same_bits(rotation):
    settings = {"gap": 1e-3, "friction": 0.2, "duration": 8e-3, "rotation": rotation}
    for cuts in ((1, 7, 100, 333, 10**9), (2500, 10**9)):
        march = assert_same_in_parts(resolve(scene(**settings)), *cuts)
        assert march.counter[contact.JUMPS] > 10


def test_exact_says_what_it_cannot_do():
    with pytest.raises(InputError, match="scheme exact needs modes that oscillate"):
        March(resolve(scene(**{"engine.casing.support_frequency": 0.0})))


@pytest.mark.turns
@pytest.mark.parametrize(
    ("settings", "told"),
    [
        ({"discretization": "elements", "casing.elements": 40}, "equal blades in a"),
        ({"blades": 2, "modes": 10}, "three or more equal blades"),
        ({"engine.rotor.damping": 1.0}, "damping < 1"),
        ({"acceleration": 50.0}, "speed or gap change"),
        ({"gap_closure": 1e-5, "gap_time": 1e-3}, "speed or gap change"),
        ({"contact_law": "archard"}, "the casing wears"),
        ({"profile": "harmonic,amplitude,phase;2,2e-5,0", "profile_release": 1e-3},
         "a casing is let go"),
        ({"rotation": "full", "stiffness_difference": 1e6}, "supports differ"),
        ({"rotation": "full", "film_viscosity": 0.01}, "have a film"),
        ({"mistuning": [0.01] + 21 * [0.0]}, "equal blades"),
    ],
)  # fmt: skip
def test_where_exact_does_not_hold_it_is_modal_to_the_bit(settings, told):
    short = settings | {"duration": 2e-4, "time_step": 1e-6}
    case, same = (resolve(scene(**short, scheme=s)) for s in ("exact", "modal"))
    assert told in case.handed_over
    assert same.handed_over == ""
    assert told in notes_of(case)[0]["why"]
    a, b = March(case), March(same)
    a.advance(100)
    b.advance(100)
    for one, other in zip(a.state, b.state, strict=True):
        assert np.array_equal(one, other)


@pytest.mark.parametrize("rotation", ROTATIONS)
@pytest.mark.parametrize("tiny", [1e-140, 1e-161, 1e-163, 5e-324])
def test_bounds_hold_where_the_squares_of_amplitudes_are_denormal(tiny, rotation):
    # the envelope's square is rounded below zero there; its root once made the bounds
    # NaN and let a jump pass over a contact
    march, _ = ended(duration=2e-4, rotation=rotation)
    chance = np.random.default_rng(1)
    for _ in range(50):
        march.state.rotor[:] = tiny * chance.normal(size=len(march.state.rotor))
        for bound in np.ravel(bounds_of(march)):
            assert 0.0 <= bound < 1e-100


def test_what_is_not_known_is_not_jumped_over():
    gaps, rates = np.full(4, 1e-3), np.zeros(4)
    assert flight.free_steps(gaps, 0, rates, 4, 1.0, 1e-6, 1000) > 100
    assert flight.free_steps(gaps, 0, rates, 4, np.nan, 1e-6, 1000) == 0
    rates[2] = np.nan
    assert flight.free_steps(gaps, 0, rates, 4, 1.0, 1e-6, 1000) == 0


@pytest.mark.parametrize("rotation", ROTATIONS)
def test_a_jump_that_passes_over_a_contact_is_no_result(monkeypatch, rotation):
    # bounds a thousand times too small: blades are found beyond the casing
    found = slot_waves.flight_of

    def short(*given):
        jumps, bounds, dies = found(*given)
        bounds.reshape(-1, 4, 4)[:, 2] *= 1e-3
        return jumps, bounds, dies

    monkeypatch.setattr(equal_sectors, "flight_of", short)
    march, history = ended(duration=20e-3, interval=1e-3, rotation=rotation)
    row = result_of(march.case, history).row
    assert row["gap_error"] > 1e-3
    assert (row["outcome"], row["regime"]) == ("unstable", "none")
