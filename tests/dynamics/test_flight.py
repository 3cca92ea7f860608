"""The exact scheme: flow of free modes, flights, certificate."""

import numpy as np
import pytest

from hpcwhirl.campaign.simulate import result_of
from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics import flights
from hpcwhirl.dynamics.kernels import contact, flight, passes
from hpcwhirl.dynamics.kernels.cyclic import widths
from hpcwhirl.dynamics.march import March
from hpcwhirl.dynamics.timestep import central_differences, exact_flow
from hpcwhirl.errors import InputError
from hpcwhirl.scene import apply_settings, named_scene

NEVER = np.iinfo(np.int64).max


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
    energy = 0.5 * v**2 + 0.5 * omega**2 * q**2
    lost = (
        flow.loss[0] * d[2] ** 2 + flow.loss[1] * d[2] * q[2] + flow.loss[2] * q[2] ** 2
    )
    fall = energy[1] - energy[2]
    assert lost == pytest.approx(fall, rel=1e-6, abs=1e-12 * energy[1])
    mean = flow.mean[0] * d[1] + flow.mean[1] * d[2] + flow.mean[2] * q[2]
    assert mean == pytest.approx(2 * step * v[1], rel=1e-6, abs=1e-9 * omega * step)


def test_the_flow_is_central_differences_as_the_step_goes_to_zero():
    for omega in (264.0, 3.3e4):
        gaps = []
        for step in (4e-6, 2e-6, 1e-6):
            a, b = (f(omega, 0.01, step) for f in (exact_flow, central_differences))
            gaps.append(abs(a.pull / b.pull - 1))
        assert gaps[0] / gaps[2] == pytest.approx(16.0, rel=0.1)


def items_of(march):
    """Return the items of rotor and ring, (ITEMS, size) each."""
    bodies = march.scheme.arrays.rotor, march.scheme.arrays.casing
    return [passes.unpacked(body.items) for body in bodies]


def random_state(march, rng, share=1.0):
    """Put a random free motion of a share of all modes into a march."""
    rotor, ring = march.state.rotor, march.state.ring
    items = items_of(march)
    for state, item, parts in ((rotor, items[0], 1), (ring, items[1], 2)):
        state[:] = 0.0
        size = item.shape[1]
        speed = 10.0 ** rng.uniform(-6, 0) * rng.normal(size=(parts, size))
        speed *= 10.0 ** rng.uniform(-4, 0, size=(parts, size))
        speed *= rng.random((parts, size)) < share
        held = item[passes.OMEGA] > 0
        place = speed * rng.normal(size=(parts, size))
        place = np.divide(
            place, item[passes.OMEGA], out=np.zeros_like(place), where=held
        )
        of_d = np.where(held, item[passes.SPEED_D], 1.0)
        d = (speed - item[passes.SPEED_Q] * place) / of_d * held
        state[: parts * size] = place.ravel()
        state[parts * size : 2 * parts * size] = d.ravel()


def folded(march, q_rotor, q_ring):
    """Return the N gaps of amplitudes (ring in the rotating frame), m."""
    blades = march.model.blades
    k, _ = widths(blades)
    items = items_of(march)
    spectrum = (items[0][passes.RADIAL] * q_rotor).reshape(-1, 2, k).sum(axis=0)
    ring = items[1][passes.RADIAL] * q_ring.reshape(2, -1)
    ring = ring.reshape(2, -1, k).sum(axis=1)
    turns = march.scheme.arrays.contact.turns.reshape(blades, 2 * k)
    return march.scene.gap + turns @ (spectrum + ring).ravel()


def flown(march, steps):
    """Return the gaps `steps` (any real number) after the state of a march, m."""
    step, out = march.scene.solver.time_step, []
    states = march.state.rotor, march.state.ring
    for state, item, parts in zip(states, items_of(march), (1, 2), strict=True):
        table = flights._jump(item, steps, step)
        size = item.shape[1]
        q = state[: parts * size].reshape(parts, size)
        d = state[parts * size : 2 * parts * size].reshape(parts, size)
        q = table[flight.QQ] * q + table[flight.QD] * d
        if parts == 2:
            turned = (q[0] + 1j * q[1]) * (
                table[flight.TURNED_RE] + 1j * table[flight.TURNED_IM]
            )
            q = np.array([turned.real, turned.imag])
        out.append(q.ravel())
    return folded(march, *out)


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


@pytest.mark.parametrize("k", [1, 2, 3])
def test_flights_change_nothing_but_the_work(k):
    settings = {"nodal_diameter": k, "duration": 4e-3, "interval": 2e-5, "gap": 4e-4,
                "force": 4e5}  # fmt: skip
    (with_jumps, a), (without, b) = (ended(fly=f, **settings) for f in (True, False))
    assert without.counter[contact.JUMPED] == 0
    assert with_jumps.counter[contact.JUMPED] > 50
    assert a.contacts == b.contacts > 10
    for name in ("tips", "energy", "impulse", "lost", "fed", "blade_impulse"):
        one, other = getattr(a, name), getattr(b, name)
        assert np.abs(one - other).max() < 1e-7 * np.abs(other).max(), name


@pytest.mark.parametrize("speed", [0.0, 410.0, 5000.0])
def test_no_blade_touches_within_a_jump(speed):
    march = March(resolve(scene(speed=speed, gap=5e-4)))
    blades, rng = march.model.blades, np.random.default_rng(int(speed))
    k, wide = widths(blades)
    rows = len(march.state.rotor) // passes.ROTOR_STATE // (2 * k)
    ring_rows = len(march.state.ring) // passes.RING_STATE // k
    fold = [j if j < wide else (blades - (j - wide)) % blades for j in range(2 * wide)]
    c_b, c_c = march.scheme.arrays.rotor.items, march.scheme.arrays.casing.items
    _, _, wave, arrays = march.scheme.arrays.contact
    closed, jumps = 0, []
    for _ in range(500):
        random_state(march, rng, share=0.02)
        gap = march.scene.gap
        nearest = gap - flown(march, 0.0).min()
        if nearest <= 0.0:
            continue
        used = rng.uniform(0.1, 0.95) * gap / nearest
        march.state.rotor[:] *= used  # the nearest blade uses up part of the gap
        march.state.ring[:] *= used
        now = flown(march, 0.0)
        march.counter[:] = 0
        march.counter[[contact.LAST, contact.CERTIFIED]] = -1
        march.state.gaps[: 2 * wide] = now[fold]
        steps = 1 + flight.look_ahead(
            march.scene.solver.time_step, march.scene.gap, c_b, c_c, wave, arrays,
            march.state, np.zeros(2 * k), np.zeros(2 * wide), rows, ring_rows, k, wide,
        )  # fmt: skip
        jumps.append(steps)
        for part in np.linspace(0.0, steps, 12):
            assert flown(march, part).min() > -1e-18
        ahead = [flown(march, steps * f).min() for f in (1.5, 2, 3, 5, 8)]
        closed += steps < 1024 and min(ahead) < 0.0
    jumps = np.array(jumps)
    assert len(jumps) > 250
    assert np.mean((jumps > 4) & (jumps < 1024)) > 0.3  # of use
    assert closed > 0.02 * len(jumps)  # and not far too careful


def test_after_a_certificate_no_blade_ever_touches():
    march, history = ended(gap=1e-3, friction=0.2, duration=0.1, nodal_diameter=2)
    certified = int(march.counter[contact.CERTIFIED])
    assert certified > 0
    assert 0 < history.certificate_reach < march.scene.gap
    again = March(
        resolve(scene(gap=1e-3, friction=0.2, duration=1.0, nodal_diameter=2))
    )
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
    [{"engine.casing.damping": 0.0}, {"engine.casing.support_frequency": 0.0}],
)
def test_no_certificate_without_damping_or_support(settings):
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


def test_flights_between_two_cuts_of_a_run_give_the_same_bits():
    runs = []
    for cuts in ((10**9,), (1, 7, 100, 333, 10**9), (2500, 10**9)):
        march = March(resolve(scene(gap=1e-3, friction=0.2, duration=8e-3)))
        for size in cuts:
            march.advance(size)
        runs.append(march)
    assert runs[0].counter[contact.JUMPS] > 10
    for other in runs[1:]:
        for a, b in zip(runs[0].state, other.state, strict=True):
            assert np.array_equal(a, b)


@pytest.mark.parametrize(
    "settings",
    [
        {"discretization": "elements"},
        {"blades": 2, "modes": 10},
        {"engine.rotor.damping": 1.0},
    ],
)
def test_exact_says_what_it_cannot_do(settings):
    with pytest.raises(InputError, match="scheme exact needs"):
        March(resolve(scene(**settings)))


@pytest.mark.parametrize("tiny", [1e-140, 1e-160, 1e-161, 1e-162, 1e-163, 5e-324])
def test_bounds_hold_where_the_squares_of_amplitudes_are_denormal(tiny):
    # the envelope's square is rounded below zero there; its root once made the bounds
    # NaN and let a jump pass over a contact
    march, _ = ended(duration=2e-4)
    _, rotor, casing, touching = march.scheme.arrays
    bounds, k = touching.flight, widths(march.model.blades)[0]
    chance = np.random.default_rng(1)
    for _ in range(50):
        for body, items, bound, read, per in (
            (march.state.rotor, rotor.items, bounds.bounds_b, flight.bound_rotor, 3),
            (march.state.ring, casing.items, bounds.bounds_c, flight.bound_ring, 6),
        ):
            body[:] = tiny * chance.normal(size=len(body))
            body[len(body) // 3 :] *= 0.01  # increments
            width = 2 * k if per == 3 else k
            rows = len(body) // per // width
            rate = np.zeros(2 * k)
            now = len(body) // per * (per // 3)
            bend, reach = read(body, items, bound, rows, k, now, rate)
            assert 0.0 <= bend < 1e-100
            assert 0.0 <= reach < 1e-100


def test_what_is_not_known_is_not_jumped_over():
    gaps, rates = np.full(4, 1e-3), np.zeros(4)
    assert flight.free_steps(gaps, 0, rates, 4, 1.0, 1e-6, 1000) > 100
    assert flight.free_steps(gaps, 0, rates, 4, np.nan, 1e-6, 1000) == 0
    rates[2] = np.nan
    assert flight.free_steps(gaps, 0, rates, 4, 1.0, 1e-6, 1000) == 0


def test_a_jump_that_passes_over_a_contact_is_no_result(monkeypatch):
    # bounds a thousand times too small: blades are found beyond the casing
    true = flights._bound

    def short(items, longest):
        out = true(items, longest)
        out[[flight.RISE, flight.RISE_HELD]] *= 1e-3
        return out

    monkeypatch.setattr(flights, "_bound", short)
    march, history = ended(duration=20e-3, interval=1e-3)
    row = result_of(march.case, history).row
    assert row["gap_error"] > 1e-3
    assert (row["outcome"], row["regime"]) == ("unstable", "none")
