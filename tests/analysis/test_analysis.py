"""What is read from motion: lines, contributions, contacts, closed contacts."""

import numpy as np
import pytest

from hpcwhirl import simulate
from hpcwhirl.analysis.blade_motion import touches
from hpcwhirl.analysis.critical import coincidences, critical_speeds
from hpcwhirl.analysis.participation import contributions, family_amplitudes
from hpcwhirl.analysis.stability import (
    closed_roots,
    coupled,
    fastest,
    growth_of_diameter,
    sprung_roots,
)
from hpcwhirl.analysis.whirl import (
    after_revolutions,
    amplitude_spectrum,
    cascade,
    section,
)
from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.march import March
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.bodies import centre_rows, tip_rows
from hpcwhirl.reduction.families import family_ranks
from hpcwhirl.reduction.waves import wave_lines, wave_roots
from hpcwhirl.scene import apply_settings, named_scene

INTERVAL = 2e-4
TIME = np.arange(1, 2501) * INTERVAL
SCENE = named_scene("table2")
SHORT = {"speed": 410.0, "duration": 0.05, "time_step": 2e-6, "traces": "full"}


@pytest.fixture(scope="module")
def model():
    return resolve(SCENE).model


def mode_of(model, k, family, phase):
    rank = next(r for r, n in family_ranks(model.rotor, k).items() if n == family)
    own = (model.rotor.diameter == k) & (model.rotor.rank == rank)
    return int(np.flatnonzero(own & (model.rotor.phase == phase))[0])


def motion(model, mode, q):
    """Tips (n, N, 2) and centre (n, 2), rotating frame, of one mode's amplitude."""
    rows = [shape[:, mode] for shape in tip_rows(model.rotor, model.blades)]
    hub = centre_rows(model.rotor, model.blades)[:, mode]
    return q[:, None, None] * np.stack(rows, axis=1), q[:, None] * hub


@pytest.mark.turns
@pytest.mark.parametrize(
    ("k", "family", "phase"),
    [(0, "1F", 0), (0, "2F", 0), (1, "1F", 1), (1, "suspension", 0), (1, "2F", 0),
     (2, "1F", 0), (5, "2F", 1), (11, "1F", 0)],
)  # fmt: skip
def test_a_motion_of_one_mode_gives_only_its_contribution(model, k, family, phase):
    mode = mode_of(model, k, family, phase)
    q = 1e-3 * np.cos(model.rotor.omega[mode] * TIME + 0.3)
    found = family_amplitudes(*motion(model, mode, q), INTERVAL, model)
    inner = slice(100, -100)
    peak = found[family][inner, k].max()
    assert peak == pytest.approx(1e-3, rel=0.01)
    found[family][:, k] = 0.0
    assert max(a[inner].max() for a in found.values()) < 0.02e-3


@pytest.mark.turns
def test_contributions_are_those_of_the_integrated_modes(model):
    given = SHORT | {"speed": 280.0, "duration": 0.2, "scheme": "general"}
    march = March(resolve(apply_settings(SCENE, given)))
    lift = model.rotor.shapes.T @ model.rotor.mass
    true = []
    while not march.done:
        march.advance(march.stride)
        true.append(lift @ march.displacements()[0])
    history = march.history()
    for k, family in ((0, "1F"), (1, "1F"), (1, "suspension")):
        ranks = {n: r for r, n in family_ranks(model.rotor, k).items()}
        phases = (0,) if k == 0 else (0, 1)
        own = np.array(true)[:, [mode_of(model, k, family, p) for p in phases]]
        exact = own @ np.array([1.0, 1j])[: len(phases)]
        q = contributions(history.tips, history.centre, INTERVAL, model, k)
        error = np.abs(q[:, ranks[family]] - exact)[50:-50]
        assert np.sqrt(np.mean(error**2)) < 0.08 * np.sqrt(np.mean(abs(exact) ** 2))


@pytest.mark.turns
def test_contributions_refuse_what_has_no_nodal_diameters(model):
    spoilt = apply_settings(SCENE, {"mistuning": [0.1] + [0.0] * 21})
    tips, centre = np.zeros((8, 22, 2)), np.zeros((8, 2))
    with pytest.raises(InputError, match="equal sectors"):
        contributions(tips, centre, INTERVAL, resolve(spoilt).model, 1)
    with pytest.raises(InputError, match=r"tips must be \(n, 22, 2\)"):
        contributions(tips[:, :5], centre, INTERVAL, model, 1)


def test_the_amplitude_of_a_line_is_the_peak_of_its_sine():
    hertz, amplitude = amplitude_spectrum(
        5.0 + 3.0 * np.sin(2 * np.pi * 50 * TIME), INTERVAL
    )
    top = np.argmax(amplitude)
    assert hertz[top] == pytest.approx(50.0)
    assert amplitude[top] == pytest.approx(3.0, rel=1e-6)


def test_a_narrow_line_survives_a_coarse_axis():
    spectrum = np.arange(1000.0), np.where(np.arange(1000) == 503, 7.0, 0.1)
    table = cascade([spectrum, spectrum], np.arange(0.0, 1001.0, 100.0))
    assert table.shape == (10, 2)
    assert table[5] == pytest.approx([7.0, 7.0])
    assert np.delete(table, 5, axis=0) == pytest.approx(0.1)


def test_an_axis_finer_than_the_spectrum_has_no_holes():
    spectrum = np.array([0.0, 10.0, 20.0]), np.array([1.0, 2.0, 3.0])
    table = cascade([spectrum], np.linspace(0.0, 20.0, 41))
    assert table.min() >= 1.0
    assert table[-1] == 3.0


def test_revolutions_are_counted_by_the_size_of_the_speed():
    for speed in (-62.83185307179586, 62.83185307179586):
        part = after_revolutions(TIME, speed, 2.0)
        assert TIME[part][0] == pytest.approx(0.2, abs=1e-9)
    assert after_revolutions(TIME, 0.0, 2.0) == slice(0, None)


@pytest.mark.parametrize("speed", [300.0, -300.0])
def test_a_wave_of_the_rotation_is_one_point_of_the_section(speed):
    orbit = 1e-4 * np.exp(1j * (speed * TIME + 0.4))
    points = section(TIME, np.column_stack([orbit.real, orbit.imag]), speed)
    assert len(points) == int(0.5 * 300 / (2 * np.pi))
    assert points @ [1, 1j] == pytest.approx(1e-4 * np.exp(0.4j), abs=1e-7)


def test_a_subharmonic_of_two_is_two_points_and_rest_is_none():
    orbit = np.exp(0.5j * 300.0 * TIME)
    points = section(TIME, np.column_stack([orbit.real, orbit.imag]), 300.0)[:, 0]
    assert np.allclose(points[::2], -1.0, atol=0.01) or np.allclose(
        points[1::2], -1.0, atol=0.01
    )
    assert points[1:] * points[:-1] == pytest.approx(-1.0, abs=0.02)
    assert section(TIME, np.zeros((len(TIME), 2)), 0.0).shape == (0, 2)


def test_a_contact_is_found_where_its_blade_stands():
    speed, blades, sample, blade = 200.0, 22, 30, 7
    impulse = np.zeros((100, blades))
    impulse[sample:, blade] = 0.5
    found = touches(TIME[:100], impulse, speed)
    when = TIME[sample] - INTERVAL / 2
    assert found.time == pytest.approx([when])
    assert list(found.blade) == [blade]
    assert found.impulse == pytest.approx([0.5])
    stood = (speed * when + 2 * np.pi * blade / blades) % (2 * np.pi)
    assert found.angle == pytest.approx([stood])


def test_contacts_of_a_run_carry_its_impulse():
    result = simulate(apply_settings(SCENE, SHORT))
    found = touches(result.traces["time"], result.traces["blade_impulse"], 410.0)
    assert found.impulse.sum() == pytest.approx(result.row["contact_impulse"])
    assert set(found.blade) <= set(range(22))
    assert found.angle.min() >= 0
    assert found.angle.max() < 2 * np.pi


def test_friction_and_transport_are_all_that_feeds():
    for speed in (300.0, -300.0):
        row = simulate(apply_settings(SCENE, SHORT | {"speed": speed})).row
        assert row["late_friction"] + row["late_rotation"] == pytest.approx(
            row["late_fed"]
        )
        assert row["late_friction"] != 0.0


def test_without_friction_or_rotation_neither_works():
    row = simulate(apply_settings(SCENE, SHORT | {"friction": 0.0})).row
    assert row["late_friction"] == 0.0
    still = simulate(apply_settings(SCENE, SHORT | {"speed": 0.0})).row
    assert still["late_friction"] == 0.0
    assert abs(still["late_rotation"]) < 1e-9 * still["late_lost"]


def test_the_work_of_friction_is_read_alike_however_the_run_is_cut():
    scene = apply_settings(SCENE, SHORT)
    whole, cut = March(resolve(scene)), March(resolve(scene))
    whole.advance(10**9)
    while not cut.done:
        cut.advance(777)
    a, b = whole.history(), cut.history()
    assert np.array_equal(a.friction, b.friction)
    assert a.friction[-1] == pytest.approx(a.ledger["friction"], rel=1e-9)


@pytest.mark.turns
@pytest.mark.parametrize("scheme", ["modal", "exact", "general", "paper"])
def test_mirrored_runs_have_one_row_of_evidence(scheme):
    settings = SHORT | {"duration": 0.02, "time_step": 2e-6, "scheme": scheme}
    one, other = (
        simulate(apply_settings(SCENE, settings | {"speed": speed}))
        for speed in (430.0, -430.0)
    )
    assert one.row["contacts"] > 0
    assert one.row["whirl"] != "none"
    assert other.row["speed"] == -430.0
    rounded = {"speed", "ledger_residual", "ledger_error"}
    for name in one.row.keys() - rounded:
        value, found = one.row[name], other.row[name]
        if isinstance(value, str):
            assert found == value, name
        else:
            assert found == pytest.approx(value, rel=1e-5, abs=1e-12), name
    mirrored = one.traces["centre"] * [1, -1]
    assert (
        np.abs(other.traces["centre"] - mirrored).max() < 1e-7 * np.abs(mirrored).max()
    )


def test_waves_coincide_where_their_lines_cross():
    rotor, casing = {1: 256.0, 2: 260.0}, {1: 14.0, 2: 40.0}
    for found in coincidences(rotor, casing, 9):
        k, n, speed = (found[name] for name in ("nodal_diameter", "order", "speed"))
        waves = k * speed + rotor[k], k * speed - rotor[k]
        assert min(abs(abs(wave) - n * casing[k]) for wave in waves) < 1e-9
    own = [f["speed"] for f in coincidences(rotor, casing) if f["side"] == -1]
    assert own == [f["speed"] for f in critical_speeds(rotor, casing)]


def test_open_contacts_leave_both_bodies_their_own_frequencies(model):
    speed = 300.0
    roots = sprung_roots(coupled(model, 1, speed, 0.1), 0.0)
    expected = []
    for body, turn in ((model.casing, 1j * speed), (model.rotor, 0.0)):
        own = (body.diameter == 1) & (body.phase == 0)
        omega, xi = body.omega[own], body.ratios[own]
        root = -xi * omega + 1j * omega * np.sqrt(1 - xi**2)
        expected += [*(root + turn), *(root.conj() + turn)]
    for root in expected:
        assert np.abs(roots - root).min() < 1e-6 * abs(root)
    assert len(roots) == len(expected)


def test_closed_contacts_are_those_of_both_bodies_in_real_coordinates(model):
    # Omega -> 0: N tips tied to the ring with friction, all nodal diameters at once
    mu, blades = 0.2, model.blades
    radial, tangential = tip_rows(model.rotor, blades)
    out, along = model.ring.rows(2 * np.pi * np.arange(blades) / blades)
    out, along = out @ model.casing.shapes, along @ model.casing.shapes
    gap = np.hstack([-radial, out])
    push = np.vstack([-(radial + mu * tangential).T, (out + mu * along).T])
    squared = np.r_[model.rotor.omega, model.casing.omega] ** 2
    project = np.eye(len(squared)) - push @ np.linalg.solve(gap @ push, gap)
    real = np.linalg.eigvals(project * squared)
    bare = coupled(model, 3, 1e-9, mu)
    bare = type(bare)(0 * bare.damping, bare.stiffness, bare.gap, bare.push)
    for root in closed_roots(bare):
        assert np.abs(real + root**2).min() < 1e-6 * abs(root**2) + 1e-3


@pytest.mark.parametrize("k", [0, 1, 3, 11])
def test_open_contacts_leave_a_rotating_rotor_its_waves(k):
    turning = resolve(apply_settings(SCENE, {"rotation": "full"})).model
    pair = coupled(turning, k, 410.0, 0.1)
    own = wave_roots(turning.rotor, turning.rotor.spin.waves[k], 410.0)
    roots = sprung_roots(pair, 0.0)
    for root in own:
        assert np.abs(roots - root).min() < 1e-6 * abs(root)
    at_rest = [coupled(m, k, 1e-9, 0.1) for m in (turning, resolve(SCENE).model)]
    one, other = (closed_roots(pair) for pair in at_rest)
    # high roots depend on the modes kept; with k = 1 the suspension's damper stands
    for root in other[np.abs(other) < 3000.0]:
        assert np.abs(one - root).min() < (1e-3 if k != 1 else 1e-2) * abs(root)


@pytest.mark.turns
@pytest.mark.parametrize("speed", [0.5, 150.0, 410.0, -410.0])
def test_a_rigid_rotor_on_springs_rubs_alike_at_any_speed(speed):
    # static frame: m s^2 + k + (N kappa / 2) (1 + i mu) = 0, backward growing
    given = {
        "rotation": "full", "engine.rotor.young": 2.1e17, "engine.rotor.damping": 0.0,
        "engine.rotor.suspension_damping": 0.0, "engine.casing.density": 1e10,
    }  # fmt: skip
    body = resolve(apply_settings(SCENE, given)).model
    rotor, blades, mu, spring = body.rotor, body.blades, 0.2, 2e5
    lines = [w for w in wave_lines(rotor, blades, speed) if w.nodal_diameter == 1]
    own = min(abs(w.static) for w in lines)
    moved = np.zeros(len(rotor.mass))
    angle = 2 * np.pi * np.arange(blades) / blades
    moved[0 : 2 * blades : 2], moved[2 * blades] = np.cos(angle), 1.0
    moved[1 : 2 * blades : 2] = -np.sin(angle)
    mass = (rotor.shapes.T @ rotor.mass @ moved) ** 2
    mass = float(mass[rotor.omega < 2 * own].sum())
    stiff = own**2 + blades * spring / 2 / mass * (1 + 1j * mu * np.sign(speed))
    published = np.array([1j, -1j]) * np.sqrt(stiff)
    found = sprung_roots(coupled(body, 1, speed, mu), spring)
    static = found.conj() + 1j * speed  # of the centre, x + i y
    for root in published:
        assert np.abs(static - root).min() < 1e-3 * abs(root)


def test_the_fastest_root_is_the_one_of_largest_growth_below_a_line():
    roots = np.array([-3.0 + 10.0j, -1.0 + 200.0j, -2.0 - 5.0j])
    assert fastest(roots) == roots[1]
    assert fastest(roots, 100.0) == roots[2]
    assert fastest(roots, 5.0).real == -np.inf  # none of them


def test_without_friction_and_rotation_closed_contacts_only_lose_energy(model):
    for k in range(12):
        assert fastest(closed_roots(coupled(model, k, 0.0, 0.0))).real < 0


@pytest.mark.parametrize("speed", [300.0, -300.0])
def test_in_the_static_frame_the_ring_has_its_own_lines(model, speed):
    free = sprung_roots(coupled(model, 1, speed, 0.0), 0.0)
    lines = speed - free.imag
    own = (model.casing.diameter == 1) & (model.casing.phase == 0)
    soft = np.flatnonzero(own)[np.argmin(model.casing.omega[own])]
    omega, ratio = model.casing.omega[soft], model.casing.ratios[soft]
    for line in omega * np.sqrt(1 - ratio**2) * np.array([1.0, -1.0]):
        assert np.abs(lines - line).min() < 1e-6 * omega


@pytest.mark.turns
def test_mirrored_rotation_predicts_the_same_growth():
    small = {"blades": 5, "harmonics": 6, "modes": 20}
    few = resolve(apply_settings(SCENE, small)).model
    for k in range(3):
        one, other = (growth_of_diameter(few, k, speed, 0.1) for speed in (300, -300))
        assert one["closed"] == pytest.approx(other["closed"], rel=1e-6)
    with pytest.raises(InputError, match="ring of harmonics"):
        coupled(
            resolve(apply_settings(SCENE, {"discretization": "elements"})).model,
            1,
            1.0,
            0.1,
        )
