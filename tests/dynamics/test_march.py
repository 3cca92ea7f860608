"""Truths 4, 5 and 6, for every scheme by one battery."""

import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from alike import assert_alike, assert_bodies_alike, assert_mirrored
from scipy.linalg import expm
from solving import place_of, solve

from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics import march as marching
from hpcwhirl.dynamics.bodies.timestep import recursion
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.kernels import keep_inverse as keep
from hpcwhirl.dynamics.kernels.loop import circulant
from hpcwhirl.dynamics.march import March
from hpcwhirl.dynamics.waves.slots import transforms
from hpcwhirl.errors import InputError
from hpcwhirl.scene import apply_settings, engine_inputs, named_scene

SCHEMES = ["modal", "general", "paper", "exact"]
SLOW_EXACT = [*SCHEMES[:3], pytest.param("exact", marks=pytest.mark.slow)]
CENTRAL = SCHEMES[:3]  # central differences: the same to round-off


def scene(**settings):
    fast = {"duration": 5e-3, "interval": 1e-5, "traces": "full", "time_step": 2e-6}
    return apply_settings(named_scene("mostly_damped"), fast | settings)


def ended(**settings):
    march = March(resolve(scene(**settings)))
    return march, march.run()


def assert_equal_runs(one, other):
    assert_alike(one[1], other[1])
    assert_bodies_alike(one[0], other[0])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("k", "friction", "blades"), [(1, 0.3, 22), (2, 0.0, 21), (3, 0.3, 12)]
)
def test_modal_is_paper_to_round_off(k, friction, blades):
    settings = {"nodal_diameter": k, "friction": friction, "blades": blades}
    settings |= {"time_step": 1e-6, "duration": 6e-3}
    modal, general, paper = (ended(scheme=s, **settings) for s in CENTRAL)
    assert_equal_runs(modal, paper)
    assert_equal_runs(general, paper)


@pytest.mark.parametrize("k", [3, pytest.param(14, marks=pytest.mark.slow)])
def test_schemes_agree_on_a_growing_rigid_casing(k):
    rigid = {"kind": "rigid", "amplitude": 2e-4, "growth": 40.0, "nodal_diameter": k}
    one, other = (ended(scheme=s, **rigid) for s in ("modal", "paper"))
    assert_equal_runs(one, other)


@pytest.mark.slow  # two kernels
@pytest.mark.parametrize("harmonics", [8, 33])
def test_harmonics_fold_on_the_blades(harmonics):
    # fewer harmonics than nodal diameters, and more than blades
    settings = {"harmonics": harmonics, "duration": 3e-3}
    one, other = (ended(scheme=s, **settings) for s in ("modal", "general"))
    assert_equal_runs(one, other)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_without_rotation_and_friction_nothing_is_fed(scheme):
    settings = {"speed": 0.0, "friction": 0.0, "scheme": scheme}
    march, history = ended(**settings, duration=8e-3)
    assert history.contacts > 0
    throughput = history.ledger["pulse"]
    assert abs(history.ledger["rotation"]) < 1e-12 * throughput
    assert history.ledger["friction"] == 0.0
    after = history.energy[history.time > march.scene.pulse + 2e-6]
    assert np.all(np.diff(after) < 1e-12 * throughput)


def modes_of(march):
    """Return (q, d) of the rotor of `general`, (m,) each, copies."""
    size = len(march.model.rotor.omega)
    return march.state.q_b[:size].copy(), march.state.d_b[:size].copy()


def test_multipliers_and_friction_are_what_moves_the_modes():
    # the modal increments of one step, less those predicted, are give * phi^T f
    march = March(resolve(scene(scheme="general")))
    model, step = march.model, march.scene.solver.time_step
    now = modes_of(march)
    while march.counter[contact.LAST] < 0:
        (q, d), impulse = now, march.state.impulse.copy()
        march.advance(1)
        now = modes_of(march)
    lam = (march.state.impulse - impulse) / step
    keep, pull, give = recursion(model.rotor.omega, model.rotor.ratios, step)
    pushed = (now[1] - (keep * d - pull * q)) / give
    radial, tangential = model.rotor.shapes[0:44:2], model.rotor.shapes[1:44:2]
    mu = march.scene.friction
    want = -(lam @ radial) - mu * (lam @ tangential)
    assert pushed == pytest.approx(want, rel=1e-6, abs=1e-9 * np.abs(want).max())


@pytest.mark.slow
@pytest.mark.parametrize("scheme", SCHEMES)
def test_rotation_work_is_the_transport_over_the_deformed_ring(scheme):
    # - sum lambda Omega dw/dtheta dt, from the ring's shape at each contact
    march = March(resolve(scene(scheme=scheme, friction=0.0, duration=3e-3)))
    work, step = 0.0, march.scene.solver.time_step
    while not march.done:
        older = march.state.impulse.copy()
        march.advance(1)
        impulse = march.state.impulse - older
        if not impulse.any():
            continue
        _, casing = march.displacements()
        angle = march.scene.speed * march.steps * step
        h = 1e-6
        angles = angle + 2 * np.pi * np.arange(22) / 22
        slope = march.model.ring.rows(angles + h)[0] @ casing
        slope = (slope - march.model.ring.rows(angles - h)[0] @ casing) / (2 * h)
        work -= march.scene.speed * impulse @ slope
    assert work != 0.0
    assert march.history().ledger["rotation"] == pytest.approx(work, rel=0.02)


def slips(march):
    """Yield |v' - u_c'|, m/s, of blades in contact, from displacements alone."""
    step, tips = march.scene.solver.time_step, 2 * np.arange(march.model.blades) + 1
    older, now = None, march.displacements()
    while not march.done:
        impulse, touched = march.state.impulse.copy(), march.counter[contact.TOUCHED]
        march.advance(1)
        last, older, now = older, now, march.displacements()
        looked = march.counter[contact.TOUCHED] % contact.SLIP_EVERY == 1
        if touched == march.counter[contact.TOUCHED] or not looked or march.done:
            continue
        angles = march.scene.speed * march.steps * step
        angles += 2 * np.pi * np.arange(march.model.blades) / march.model.blades
        casing = march.model.ring.rows(angles)[1] @ (now[1] - last[1])
        touching = march.state.impulse > impulse
        yield from np.abs(now[0][tips] - last[0][tips] - casing)[touching] / (2 * step)


@pytest.mark.turns
@pytest.mark.parametrize(
    ("scheme", "speed"),
    [("modal", 410.0), ("general", -300.0), ("paper", 410.0),
     pytest.param("exact", -300.0, marks=pytest.mark.slow)],
)  # fmt: skip
def test_slip_is_that_of_tips_along_the_casing(scheme, speed):
    march = March(resolve(scene(scheme=scheme, duration=2e-3, speed=speed)))
    largest = max(slips(march))
    # the exact flow takes the mean of both sides of an impulse for the velocity
    close = 0.05 if scheme == "exact" else 1e-8
    assert march.history().slip == pytest.approx(largest, rel=close)


@pytest.mark.turns
@pytest.mark.parametrize("scheme", SLOW_EXACT)
def test_a_tip_that_goes_sideways_ends_a_run_in_every_scheme(scheme):
    # within this pulse some 8 times as far along the rotation as outward
    whole, history = ended(scheme=scheme, speed=270.0)
    tips, radius = history.tips, whole.scene.engine.rotor.radius
    outward, along = np.abs(tips).max(axis=(0, 1))
    assert along > 2.0 * outward
    limit = 0.5 * (along + outward)
    march, history = ended(scheme=scheme, speed=270.0, amplitude_limit=limit / radius)
    far = np.hypot(*np.moveaxis(history.tips, -1, 0)).max(axis=1)
    assert history.stop == "amplitude"
    assert 0.9 * limit < far.max() < 1.1 * limit
    assert np.abs(history.tips[..., 0]).max() < limit
    assert march.steps < whole.steps


@pytest.mark.parametrize("scheme", SLOW_EXACT)  # it needs a kernel of its own
@pytest.mark.parametrize(("k", "speed", "growth"), [(1, 410.0, 40.0), (3, -300.0, 0.0)])
def test_rotation_work_of_a_rigid_casing_is_that_of_its_way_past_the_blades(
    scheme, k, speed, growth
):
    # - sum lambda dw/dt dt with w = -A0 e^{sigma t} cos k theta_j, A0 rising at first
    rigid = {"kind": "rigid", "amplitude": 2e-4, "growth": growth, "rise": 1e-3}
    settings = rigid | {"nodal_diameter": k, "speed": speed, "interval": 2e-6}
    march, history = ended(scheme=scheme, **settings)
    time, step = history.time[:, None], march.scene.solver.time_step

    def wall(time):
        ramp = 0.5 * (1 - np.cos(np.pi * np.minimum(time / 1e-3, 1)))
        angle = speed * time + 2 * np.pi * np.arange(22) / 22
        return -2e-4 * np.exp(growth * time) * ramp * np.cos(k * angle)

    impulse = np.diff(history.blade_impulse, axis=0, prepend=0.0)
    rate = (wall(time) - wall(time - 2 * step)) / (2 * step)  # at the step's start
    work, ledger = -(impulse * rate).sum(), history.ledger
    assert ledger["rotation"] == pytest.approx(work, rel=2e-3)
    assert 0 < ledger["impact"] < 0.2 * work
    assert np.all(np.diff(history.lost) >= -1e-12 * work)


def shape_of(harmonics, angles):
    """Return w (m,), m, of harmonics (H + 1, 2) at angles (m,)."""
    phase = np.outer(angles, np.arange(len(harmonics)))
    return np.cos(phase) @ harmonics[:, 0] + np.sin(phase) @ harmonics[:, 1]


@pytest.mark.parametrize("engine", ["mostly_damped", "four_motions"])
@pytest.mark.parametrize("scheme", SCHEMES)
def test_the_casing_trace_is_its_radial_shape_in_the_static_frame(scheme, engine):
    settings = engine_inputs(engine) | {"speed": -390.0, "interval": 5e-4}
    settings["duration"] = 3e-3
    march, angles = (
        March(resolve(scene(scheme=scheme, **settings))),
        np.linspace(0, 6, 50),
    )
    compared = 0
    while not march.done:
        march.advance(march.stride)
        _, casing = march.displacements()
        shape = march.model.ring.rows(angles)[0] @ casing
        found = march.history().casing
        assert found.shape == (march.steps // march.stride, 21, 2)
        assert not found[:, 0, 1].any()  # sin 0
        near = pytest.approx(shape, abs=1e-9 * np.abs(shape).max())
        if march.steps == len(found) * march.stride:  # else `exact` flew past a sample
            compared += 1
            assert shape_of(found[-1], angles) == near
    assert compared >= 2
    first = found[0]  # the pulse squeezes at theta = 0, where blades have come by since
    assert first[1, 0] < -10 * abs(first[1, 1])
    assert np.abs(found[-1][2:, 1]).max() > 1e-3 * np.abs(found[-1]).max()


@pytest.mark.turns
def test_schemes_agree_on_the_casing_trace():
    one, *others = (ended(scheme=s)[1].casing for s in ("general", "modal", "paper"))
    for other in others:
        assert np.abs(one - other).max() < 1e-8 * np.abs(one).max()


@pytest.mark.parametrize("scheme", ["general", "paper"])
def test_the_casing_trace_of_elements_has_the_harmonics_of_their_shape(scheme):
    march = March(
        resolve(scene(scheme=scheme, discretization="elements", interval=1e-3))
    )
    history = march.run()
    _, casing = march.displacements()
    angles = 2 * np.pi * np.arange(4096) / 4096
    shape = march.model.ring.rows(angles)[0] @ casing
    lines = np.fft.rfft(shape)[:20] / len(shape)
    found = history.casing[-1]
    assert found.shape == (21, 2)
    want = np.column_stack([2 * lines.real, -2 * lines.imag])
    want[0] /= 2
    assert np.abs(found[:20] - want).max() < 1e-6 * np.abs(want).max()


@pytest.mark.parametrize(("kind", "scheme"), [("ring", "exact"), ("rigid", "modal")])
def test_without_full_traces_the_casing_is_not_kept(kind, scheme):
    settings = {"kind": kind, "duration": 1e-3, "scheme": scheme}
    _, history = ended(traces="orbit", **settings)
    assert history.casing.shape == (0, 21, 2)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_two_lobed_casing_leaves_the_shaft_at_rest(scheme):
    march, history = ended(scheme=scheme, nodal_diameter=2, plan="everything")
    tips = np.abs(history.tips).max()
    assert history.contacts > 0
    assert history.centre_peak < 1e-10 * tips
    opposed = history.tips[:, :11] - history.tips[:, 11:]  # Fig. 8
    assert np.abs(opposed).max() < 1e-10 * tips
    assert march.done


@pytest.mark.turns
@pytest.mark.parametrize("scheme", SCHEMES)
def test_mirrored_rotation_mirrors_the_orbit(scheme):
    (_, a), (_, b) = (ended(scheme=scheme, speed=s) for s in (410.0, -410.0))
    assert_mirrored(a, b, 1e-9)


@pytest.mark.turns
@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_whole_turn_of_blades_is_the_same_disk(scheme):
    # squeeze and stretch of k = 1 differ by half a turn: blades 11 on, orbit turned
    turned = [ended(scheme=scheme, direction=d)[1] for d in ("squeeze", "stretch")]
    a, b = turned
    scale = np.abs(a.tips).max()
    assert np.abs(np.roll(a.tips, 11, axis=1) - b.tips).max() < 1e-9 * scale
    assert np.abs(a.centre + b.centre).max() < 1e-9 * scale


def test_relabelling_blades_by_a_sector_permutes_the_answer():
    # k = 0 knows no direction: on a rigid casing every blade does the same
    rigid = {"kind": "rigid", "nodal_diameter": 0, "amplitude": 2e-4}
    _, history = ended(**rigid, plan="everything")  # not one blade of 22
    scale = np.abs(history.tips).max()
    assert history.contacts > 0
    assert np.abs(history.tips - history.tips[:, :1]).max() < 1e-10 * scale


def test_no_contact_is_the_matrix_exponential():
    march = March(
        resolve(
            scene(gap=0.05, force=0.0, duration=2e-3, time_step=1e-6, scheme="general")
        )
    )
    model, step = march.model.rotor, 1e-6
    size = len(model.omega)
    slow = model.omega < 2e4
    rng = np.random.default_rng(3)
    q, v = rng.normal(size=(2, size)) * 1e-6 * slow
    v = v * 300.0
    drag, stiff = 2 * model.damping * model.omega, model.omega**2
    back = q - step * v - 0.5 * step**2 * (stiff * q + drag * v)
    rotor = march.state.q_b
    rotor[:size], march.state.d_b[:size] = q, q - back
    march.run()
    time = march.steps * step
    for m in np.flatnonzero(slow)[:40]:
        flow = expm(np.array([[0, 1], [-stiff[m], -drag[m]]]) * time)
        want = flow[0] @ [q[m], v[m]]
        error = (model.omega[m] * step) ** 2 * model.omega[m] * time
        size_q = abs(q[m]) + abs(v[m]) / model.omega[m]
        assert abs(rotor[m] - want) < (error + 1e-5) * size_q


@pytest.mark.order
@pytest.mark.parametrize("scheme", SCHEMES)
def test_observed_order_is_two_before_contact(scheme):
    def end(step):
        settings = {"gap": 0.05, "time_step": step, "duration": 1.6e-3}
        march, _ = ended(scheme=scheme, pulse=8e-4, **settings)
        return march.displacements()[1]

    coarse, middle, fine = (end(4e-6 / 2**n) for n in range(3))
    order = math.log2(np.abs(coarse - middle).max() / np.abs(middle - fine).max())
    assert order == pytest.approx(2.0, abs=0.2)


@pytest.mark.parametrize("scheme", CENTRAL)
def test_a_damped_tail_flushes_to_zero_instead_of_denormals(scheme):
    damped = {"gap": 0.05, "time_step": 4e-6, "duration": 0.02, "force": 10.0}
    march = March(resolve(scene(scheme=scheme, discretization="elements", **damped)))
    march.run()
    state = march.state
    values = np.abs(np.concatenate([state.q_b, state.d_b, state.q_c, state.d_c]))
    tiny = (values > 0) & (values < 1e-290)
    assert not tiny.any()


@pytest.mark.parametrize("scheme", CENTRAL)
def test_a_step_above_the_limit_is_refused_with_the_limit(scheme):
    ring = {"discretization": "elements"}
    limit = min(resolve(scene(**ring)).model.limits(0.0).values())
    assert limit == pytest.approx(4.67e-6, rel=2e-3)
    with pytest.raises(InputError, match=r"time_step must be < 4\.67.*casing"):
        March(resolve(scene(scheme=scheme, time_step=limit * 1.000001, **ring)))


def random_contacts(friction, trials=200):
    """Yield a Delassus matrix, its first column, and gaps of which some are closed."""
    march = March(resolve(scene(friction=friction)))
    column = march.scheme.arrays.contact.column
    places = np.subtract.outer(np.arange(22), np.arange(22)) % 22
    rng = np.random.default_rng(5)
    for trial in range(trials):
        yield column[places], column, rng.normal(size=22) * 1e-6 + trial * 1e-8


def pivoted(w, gaps):
    """Return (lam, opened, active) of `complementarity`."""
    none, index = np.zeros((0, 0)), np.zeros((22, 0), np.int64)
    lam, opened, space = np.zeros(22), np.zeros(22), contact.contact_space(22, 0)
    space[1][:], space[2][:] = w.T, 1
    active = contact.complementarity(gaps, none, none, index, none, lam, opened, space)
    return lam, opened, active


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_complementarity_of_random_contacts(friction):
    # 0 <= lam, 0 <= g + W lam, lam . (g + W lam) = 0 on random gaps
    for w, _, gaps in random_contacts(friction):
        lam, _, active = pivoted(w, gaps)
        assert active == np.count_nonzero(lam)
        after = gaps + w @ lam
        assert lam.min() >= 0
        assert after.min() > -1e-16
        assert np.abs(lam * after).max() < 1e-15 * max(lam.max(), 1.0)


@pytest.mark.slow
def test_the_guess_is_the_solution_or_says_no():
    # from the last solution's set, from the penetrating set, else by pivoting
    wide, right, known = 12, 0, np.zeros(keep.length_of_known(22), np.int64)
    fold = np.r_[np.arange(12), (22 - np.arange(12)) % 22]
    places = [place_of(j, 22, wide) for j in range(22)]
    for w, column, gaps in random_contacts(0.3):
        if gaps.min() >= 0:
            continue
        space = circulant.circulant_space(22, wide, column, known, transforms(22)[1])
        assert np.array_equal(space.rows.reshape(22, -1), w[fold].T)
        row = gaps[fold].copy()
        active, way = solve(row, gaps.min(), 22, wide, space, True)
        right += way < 2
        lam, opened, _ = pivoted(w, gaps)
        found = np.zeros(22)
        found[space[4][:active]] = space[0][:active]
        assert found == pytest.approx(lam, rel=1e-11)
        assert row[places] == pytest.approx(opened, rel=1e-9, abs=1e-19)
        again = solve(gaps[fold], gaps.min(), 22, wide, space, False)
        assert again == (active, 0)  # the set that is kept is the solution's
    assert 0 < right < 200


def test_delassus_rows_of_the_ring_of_elements():
    march = March(
        resolve(scene(scheme="general", discretization="elements", friction=0.3))
    )
    w_rotor, compliance, *_ = march.scheme.arrays.contact
    model, step = march.model, march.scene.solver.time_step
    turned = 0.37
    index, shape = np.zeros((22, 4), np.int64), np.zeros((22, 4))
    turns = np.arange(22) / 22
    contact.place_on_elements(turned, 40, model.ring.length, turns, index, shape)
    found = np.zeros((22, 22))
    for j in range(22):
        contact.delassus_row(j, w_rotor, compliance, index, shape, np.zeros(80), found)
    angles = turned + 2 * np.pi * np.arange(22) / 22
    radial, tangential = (
        rows @ model.casing.shapes for rows in model.ring.rows(angles)
    )
    _, _, give = recursion(model.casing.omega, model.casing.damping, step)
    want = w_rotor + (radial * give) @ (radial + 0.3 * tangential).T
    assert np.abs(found.T - want).max() < 1e-9 * np.abs(want).max()


@pytest.mark.evidence
@pytest.mark.slow
@pytest.mark.oracle
def test_what_a_user_would_write_finds_the_same_impulse():
    script = Path(__file__).parents[2] / "scripts/cost/baselines.py"
    done = subprocess.run(
        [sys.executable, script, "2"], capture_output=True, text=True, check=True
    )
    found = {
        line[:24].strip(): float(line.split()[-3])
        for line in done.stdout.splitlines()[1:]
    }
    assert found["modal"] > 0
    for name in ("NumPy, dense", "Numba with BLAS, dense"):
        assert found[name] == pytest.approx(found["modal"], rel=1e-5)
    assert found["solve_ivp, penalty"] == pytest.approx(found["modal"], rel=0.2)


def test_a_march_cut_into_any_number_of_slices_ends(monkeypatch):
    monkeypatch.setattr(March, "_slice", lambda _, size: min(size, 2))  # as by looks
    undamped = {"casing.damping": 0.0}  # no certificate: marched to the end
    march = March(resolve(scene(nodal_diameter=2, force=1.0, **undamped)))
    slices = []
    history = march.run(between_slices=lambda: slices.append(march.steps))
    assert len(slices) > 1100  # doubled so often, a slice is no number any more
    assert (history.stop, history.steps) == ("end", march.total)


def left_by(march):
    """The bytes of all that a march leaves."""
    history = vars(march.history())
    arrays = history | vars(history["judged"]) | march.state._asdict()
    return {n: a.tobytes() for n, a in arrays.items() if isinstance(a, np.ndarray)}


@pytest.mark.parametrize("scheme", ["modal", "exact", "general"])
@pytest.mark.parametrize("kind", [{}, {"nodal_diameter": 2}])
def test_cases_of_one_process_leave_no_trace_in_each_other(scheme, kind):
    own = {"scheme": scheme, "friction": 0.3, **kind}
    first = March(resolve(scene(**own)))
    first.run()
    kept = left_by(first)
    beside = March(resolve(scene(**own, speed=300.0)))
    beside.advance(700)  # and is left there, as at a stop
    diverged, last = ended(**own, amplitude_limit=1e-9)
    lost = March(resolve(scene(**own)))
    lost.state[0][:] = math.nan  # its rotor, as of a case that blew up
    lost.run()
    again = March(resolve(scene(**own)))
    again.run()
    assert last.stop == "amplitude"
    assert diverged.steps < first.steps
    assert left_by(first) == kept == left_by(again)


@pytest.mark.parametrize("made", [1, 50, 10_000])
def test_no_slice_outgrows_what_the_last_one_showed(made):
    size, seconds = marching.FIRST_SLICE, 1e-3
    for _ in range(5000):
        size = marching.next_slice(size, made, seconds)
    shown = made * marching.SLICE_SECONDS / seconds
    assert size == max(round(shown), marching.LEAST_SLICE)


@pytest.mark.parametrize("scheme", ["modal", "exact"])
@pytest.mark.parametrize(
    ("blades", "k", "kind"),
    [(3, 1, "rigid"), (8, 3, "ring"), (21, 4, "rigid"), (36, 2, "ring")],
)
def test_one_kernel_marches_every_number_of_blades(blades, k, kind, scheme):
    # odd and even, slots with and without padding; the oracle has no slots at all
    settings = {"blades": blades, "modes": 5 * blades, "nodal_diameter": k,
                "duration": 3e-3, "friction": 0.2}  # fmt: skip
    if kind == "rigid":
        settings |= {"kind": kind, "amplitude": 4e-4, "growth": 40.0}
    own, general = ended(scheme=scheme, **settings), ended(scheme="general", **settings)
    if scheme == "modal":
        assert_equal_runs(own, general)
    assert own[1].contacts > 0
    assert own[1].gap_error < 1e-9
    assert own[1].contacts == pytest.approx(general[1].contacts, rel=0.2)


@pytest.mark.parametrize(("blades", "friction"), [(22, 0.3), (200, 0.0)])
@pytest.mark.parametrize("harmonics", [[1], [0, 1, 2]])
def test_contacts_of_fewer_modes_than_blades_are_opened(blades, friction, harmonics):
    # W of rank 1 to 5: the penetrating blades cannot all be closed to the point
    angle, rng = 2 * np.pi * np.arange(blades) / blades, np.random.default_rng(3)
    waves = np.exp(1j * np.outer(angle, harmonics))
    w = (waves @ waves.conj().T + 1j * friction * waves @ waves.conj().T).real * 1e-9
    none, index = np.zeros((0, 0)), np.zeros((blades, 0), np.int64)
    for trial in range(40):
        depth = 10.0 ** rng.uniform(-3.5, 0.0)
        gaps = 1e-4 * (1 - (1 + depth) * np.cos(angle - rng.uniform(0, 2 * np.pi)))
        gaps += (trial % 2) * 1e-9 * rng.normal(size=blades)
        if gaps.min() >= 0:
            continue
        lam, opened = np.zeros(blades), np.zeros(blades)
        space = contact.contact_space(blades, 0)
        space.w[:], space.have[:] = w.T, 1
        active = contact.complementarity(
            gaps, none, none, index, none, lam, opened, space
        )
        after, largest = gaps + w @ lam, np.abs(gaps).max()
        assert 0 < active == np.count_nonzero(lam) <= 2 * len(harmonics)
        assert lam.min() >= 0
        assert after.min() >= -1e-15 * largest
        assert np.abs(after[lam > 0]).max() <= 1e-14 * largest
        assert opened == pytest.approx(after, abs=1e-14 * largest)
