"""The general kernel: any rotor, the ring in the rotating frame, W constant.

`general` marches its modes one by one, `modal` waves of its modes.

Its twin here marches both bodies in the static frame, a row of the ring for each blade
and a Delassus matrix for each step, as the kernel did before.
"""

from types import SimpleNamespace

import numpy as np
import pytest
from solving import place_of, solve

from hpcwhirl.case.resolve import resolve
from hpcwhirl.cli.export_model import arrays_of
from hpcwhirl.dynamics.free_decay import FreeDecay
from hpcwhirl.dynamics.free_modes import FreeModes
from hpcwhirl.dynamics.kernels import circulant, contact, general, whole
from hpcwhirl.dynamics.kernels import keep_inverse as keep
from hpcwhirl.dynamics.kernels.circulant import folded
from hpcwhirl.dynamics.kernels.compiled import kernel
from hpcwhirl.dynamics.kernels.cyclic import widths
from hpcwhirl.dynamics.kernels.flight import LESS
from hpcwhirl.dynamics.kernels.wave_types import GeneralRotor, UncoupledRotor
from hpcwhirl.dynamics.march import March
from hpcwhirl.dynamics.mode_waves import _items, delassus, mode_waves
from hpcwhirl.dynamics.operators import pulse_load
from hpcwhirl.dynamics.timestep import recursion
from hpcwhirl.reduction.bodies import tip_rows
from hpcwhirl.scene import apply_settings, named_scene
from hpcwhirl.store.hdf5 import write_arrays

KINDS = {"modal": UncoupledRotor, "general": GeneralRotor}
MODES = {1: 6, 2: 8, 7: 30, 12: 54, 22: 110, 30: 60}
read_near, farthest = (  # parts, for Python
    kernel(part.py_func) for part in (whole.read_near, general.farthest)
)


def pattern(blades, size=0.05):
    return [size * np.sin(7.0 * j + 1.0) for j in range(blades)]


def scene(blades=22, **settings):
    fast = {"duration": 6e-3, "interval": 2e-5, "traces": "full", "time_step": 2e-6}
    mistuned = {"blades": blades, "mistuning": pattern(blades), "modes": MODES[blades]}
    return apply_settings(named_scene("mostly_damped"), fast | mistuned | settings)


def march_of(blades=22, **settings):
    march = March(resolve(scene(blades, **settings)))
    assert isinstance(march.scheme.arrays.rotor, KINDS[march.scene.solver.scheme])
    return march


def opened(w, gaps):
    """Return lam of 0 <= lam, 0 <= g + W lam, lam . (g + W lam) = 0."""
    active, lam = gaps < 0.0, np.zeros(len(gaps))
    for _ in range(100):
        lam[:] = 0.0
        lam[active] = np.linalg.solve(w[np.ix_(active, active)], -gaps[active])
        after = gaps + w @ lam
        wrong = (lam < 0.0) | (~active & (after < -1e-13 * np.abs(gaps).max()))
        if not wrong.any():
            return lam
        active ^= wrong
    raise AssertionError


def twin(march):  # noqa: PLR0915
    """March in the static frame; return tips, impulses of blades and works."""
    scene, model = march.scene, march.model
    step, mu = scene.solver.time_step, scene.friction * np.sign(scene.speed)
    radial, tangential = tip_rows(model.rotor, model.blades)
    bodies = model.rotor, model.casing
    keeps, pulls, gives = zip(
        *(recursion(b.omega, b.ratios, step) for b in bodies), strict=True
    )
    force = pulse_load(model, scene) @ model.casing.shapes
    w_rotor = (radial * gives[0]) @ (radial + mu * tangential).T
    q, d = ([np.zeros(len(b.omega)) for b in bodies] for _ in range(2))
    around = 2 * np.pi * np.arange(model.blades) / model.blades
    tips, impulse, touched = [], np.zeros(model.blades), 0
    fed = lost = pulse = 0.0
    for n in range(march.total):
        ahead = [
            k * d_ - p * q_ for k, d_, p, q_ in zip(keeps, d, pulls, q, strict=True)
        ]
        push = contact.pulse_of(n * step, scene.force, scene.pulse)
        ahead[1] += gives[1] * push * force
        rows = model.ring.rows(scene.speed * (n + 1) * step + around)
        out, along = (r @ model.casing.shapes for r in rows)
        gaps = scene.gap + out @ (q[1] + ahead[1]) - radial @ (q[0] + ahead[0])
        if gaps.min() < 0.0:
            w = w_rotor + (out * gives[1]) @ (out + mu * along).T
            lam = opened(w, gaps)
            loads = -lam @ (radial + mu * tangential), lam @ (out + mu * along)
            for body in range(2):
                ahead[body] += gives[body] * loads[body]
                fed += loads[body] @ (ahead[body] + d[body]) / 2
            impulse += lam * step
            touched += 1
        pulse += push * force @ (ahead[1] + d[1]) / 2
        for body, ratios in enumerate(b.ratios * b.omega / (2 * step) for b in bodies):
            lost += ratios @ (ahead[body] + d[body]) ** 2
            q[body] = q[body] + ahead[body]
            d[body] = ahead[body]
        if (n + 1) % march.stride == 0:
            tips.append(np.column_stack([radial @ q[0], tangential @ q[0]]))
    return SimpleNamespace(
        tips=np.array(tips), impulse=impulse, fed=fed, lost=lost, pulse=pulse,
        touched=touched, q=q,
    )  # fmt: skip


TWINS = [  # N, k, mu, speed; harmonics reach 20
    (22, 1, 0.3, 420.0),
    (12, 2, 0.0, -420.0),
    (7, 5, 0.3, -420.0),  # folds on 2, conjugated
    (7, 7, 0.0, 420.0),  # folds on 0
    (2, 1, 0.3, 420.0),
    (1, 1, 0.3, 420.0),
]


def test_waves_of_modes_move_by_central_differences():
    body = resolve(scene(7)).model.rotor
    waves = mode_waves(body, 2e-6)
    z = 1.0 + waves.ahead  # of an amplitude in a step
    stiff = body.omega**2 + (z - 2.0 + 1.0 / z) / 2e-6**2
    lost = 2 * body.ratios * body.omega * (z - 1.0 / z) / (2 * 2e-6)
    assert np.abs(stiff + lost).max() < 1e-6 * np.abs(stiff).max()
    assert waves.rise == pytest.approx(1.0 - 1.0 / z, rel=1e-9)
    assert waves.rates == pytest.approx((z - 1.0 / z) / (2 * 2e-6), rel=1e-9)


@pytest.mark.parametrize("step", [4, 5])
def test_a_free_motion_that_is_left_at_once_is_the_state_it_began_with(step):
    body = resolve(scene(7)).model.rotor
    modes = len(body.omega)
    free = FreeModes(_items(body, 2e-6, 0.0, modes), modes, 2e-6)
    begun = np.random.default_rng(1).normal(size=free.shape)
    left = begun.copy()
    free.motion(begun, step).leave(left, 0, step)
    for place in (0, 1 + (step & 1)):
        np.testing.assert_allclose(left[place], begun[place], rtol=1e-7)


@pytest.mark.parametrize(("scheme", "block"), [("modal", 16), ("general", 8)])
def test_modes_are_padded_to_whole_vectors_and_no_further(scheme, block):
    march = march_of(7, scheme=scheme)
    modes, arrays = len(march.model.rotor.omega), march.scheme.arrays.rotor
    assert len(arrays.hub) == 2 * len(arrays.reach)
    assert len(arrays.reach) == -(-modes // block) * block > modes


@pytest.mark.parametrize("scheme", KINDS)
@pytest.mark.parametrize(("blades", "k", "mu", "speed"), TWINS)
def test_the_ring_turning_is_the_ring_at_rest(blades, k, mu, speed, scheme):
    stiff = {"gap": 1e-5, "force": 1e6, "amplitude_limit": 9.0} if k > 3 else {}
    stiff |= {"scheme": scheme, "duration": 4e-3}
    march = march_of(blades, nodal_diameter=k, friction=mu, speed=speed, **stiff)
    history, other = march.run(), twin(march)
    assert march.counter[contact.TOUCHED] == other.touched > 0
    assert np.abs(history.tips - other.tips).max() < 1e-8 * np.abs(other.tips).max()
    impulse = history.blade_impulse[-1]
    assert np.abs(impulse - other.impulse).max() < 1e-8 * other.impulse.max()
    for body, q in zip((march.model.rotor, march.model.casing), other.q, strict=True):
        want = body.shapes @ q
        moved = march.displacements()[body is march.model.casing]
        assert np.abs(moved - want).max() < 1e-8 * np.abs(want).max()
    ledger = history.ledger
    through = sum(abs(v) for v in ledger.values())
    assert abs(ledger["residual"]) < 1e-9 * through
    assert ledger["damping"] == pytest.approx(other.lost, rel=1e-8)
    assert ledger["pulse"] == pytest.approx(other.pulse, rel=1e-8)
    fed = ledger["rotation"] + ledger["friction"] - ledger["impact"]
    assert fed == pytest.approx(other.fed, rel=1e-8, abs=1e-9 * through)


def assert_equal_runs(one, other):
    (march, history), (march_b, history_b) = ((m, m.run()) for m in (one, other))
    assert history.contacts == history_b.contacts > 0
    for a, b in zip(march.displacements(), march_b.displacements(), strict=True):
        assert np.abs(a - b).max(initial=0) <= 1e-8 * np.abs(b).max(initial=0)
    names = "tips", "centre", "energy", "impulse", "lost", "fed", "casing"
    for name in names:
        a, b = getattr(history, name), getattr(history_b, name)
        assert np.abs(a - b).max() < 1e-8 * np.abs(b).max(), name


@pytest.mark.parametrize(
    ("blades", "k", "mu"),
    [(7, 3, 0.3), (12, 2, 0.0), pytest.param(22, 1, 0.3, marks=pytest.mark.slow)],
)
def test_a_mistuned_rotor_is_that_of_matrices(blades, k, mu):
    settings = {"nodal_diameter": k, "friction": mu}
    paper = March(resolve(scene(blades, scheme="paper", **settings)))
    assert_equal_runs(march_of(blades, **settings), paper)


def test_an_uneven_rotor_from_file_is_the_one_it_was_written_from(tmp_path):
    whole = scene(7, friction=0.3)
    path = tmp_path / "rotor.h5"
    write_arrays(path, arrays_of(resolve(whole).model), {})
    file = apply_settings(whole, {"mistuning": [], "file": str(path)})
    marches = [March(resolve(s)) for s in (file, whole)]
    kinds = {type(march.scheme.arrays.rotor) for march in marches}
    assert kinds == {UncoupledRotor}
    assert_equal_runs(*marches)


def test_w_is_that_of_both_bodies_wherever_the_blades_are():
    march = march_of(7, friction=0.3, speed=-420.0)
    model, step = march.model, march.scene.solver.time_step
    _, _, give = recursion(model.casing.omega, model.casing.ratios, step)
    radial, tangential = tip_rows(model.rotor, 7)
    _, _, own = recursion(model.rotor.omega, model.rotor.ratios, step)
    found = delassus(model, march.scene)
    for turned in (0.0, 0.37, 2.0):
        rows = model.ring.rows(turned + 2 * np.pi * np.arange(7) / 7)
        out, along = (r @ model.casing.shapes for r in rows)
        want = (out * give) @ (out - 0.3 * along).T
        want += (radial * own) @ (radial - 0.3 * tangential).T
        assert np.abs(found - want).max() < 1e-12 * np.abs(want).max()


@pytest.mark.parametrize("blades", [1, 2, 5, 22])
def test_contacts_of_unequal_blades_are_opened_by_any_way(blades):
    # the set that is kept, the penetrating blades, or pivoting: one solution
    wide, random = widths(blades)[1], np.random.default_rng(blades)
    places = [place_of(j, blades, wide) for j in range(blades)]
    known, ways = np.zeros(keep.length_of_known(blades), np.int64), [0, 0]
    for trial in range(200):
        root = random.normal(size=(blades, blades))
        skew = random.normal(size=(blades, blades))
        w = root @ root.T + 0.3 * (skew - skew.T)
        w += (1.0, 20.0 * blades)[trial % 2] * np.eye(blades)  # far from diagonal, near
        gaps = random.normal(size=blades) * 1e-6
        if gaps.min() >= 0.0:
            continue
        space = circulant.constant_space(blades, wide, w, known)
        row = gaps[folded(blades, wide)]
        active, way = solve(row, gaps.min(), blades, wide, space, True)
        ways[way == 2] += 1
        lam = np.zeros(blades)
        lam[space.where[:active]] = space.push[:active]
        after = gaps + w @ lam
        assert lam.min() >= 0.0
        assert after.min() > -1e-17
        assert row[places] == pytest.approx(np.where(lam > 0, 0.0, after), abs=1e-17)
    assert ways[0] > 0
    assert ways[1] > 0 or blades <= 2


def drawn(seed):
    """Return inputs of a mistuned engine that strikes, in a ring or a rigid casing."""
    random = np.random.default_rng(seed)
    blades = int(random.choice([2, 7, 12]))
    rigid = {"casing.kind": "rigid", "casing.amplitude": 2e-4, "casing.rise": 1e-3}
    return {
        "blades": blades, "speed": float(random.uniform(-500.0, 500.0)),
        "mistuning": random.normal(0.0, 0.05, blades).tolist(), "modes": 3 * blades,
        "gap": float(random.uniform(3e-5, 1.5e-4)), "nodal_diameter": 1 + seed % 3,
        "friction": float(random.uniform(0.0, 0.3)), "scheme": "modal",
    } | (rigid if seed % 4 == 0 else {})  # fmt: skip


@pytest.mark.parametrize(
    ("seed", "size"), [(0, 1), (1, 37), (2, 1), (3, 37), (4, 37), (5, 1)]
)
def test_it_changes_no_bit_which_tips_are_read_when(seed, size):
    """All are read in the first step of a slice: with slices of 1, in every step."""
    whole, parts = (March(resolve(scene(**drawn(seed)))) for _ in range(2))
    assert isinstance(whole.scheme.arrays.rotor, UncoupledRotor)
    whole.advance(whole.total)
    while not parts.done:
        parts.advance(size)
    assert whole.history().contacts > 0
    for one, other in zip(whole.state, parts.state, strict=True):
        assert one.tobytes() == other.tobytes()
    for one, other in zip(whole.tracks, parts.tracks, strict=True):
        assert one.tobytes() == other.tobytes()


@pytest.mark.parametrize("seed", [0, 2])
def test_sets_that_change_are_found_from_lower_bounds_with_the_same_bits(seed):
    """30 blades, more than are solved from the penetrating set, in a lobed casing."""
    random = np.random.default_rng(seed)
    lobed = {
        "speed": 300.0, "nodal_diameter": 3 + seed, "gap": 1e-4, "friction": 0.1,
        "mistuning": random.normal(0.0, 0.05, 30).tolist(), "scheme": "modal",
        "casing.kind": "rigid", "casing.amplitude": 1.5e-4, "casing.rise": 1e-3,
    }  # fmt: skip
    whole, parts = (March(resolve(scene(30, **lobed))) for _ in range(2))
    whole.advance(whole.total)
    sets, most = set(), 0
    while not parts.done:
        parts.advance(1)  # all tips are read in the first step of a slice
        size = parts.state.known[30 + keep.SIZE]
        sets.add(tuple(sorted(parts.state.known[:size])))
        most = max(most, size)
    assert len(sets) > 20
    assert most > keep.FEW
    for one, other in zip(whole.state, parts.state, strict=True):
        assert one.tobytes() == other.tobytes()


def test_a_guess_takes_no_lower_bound_for_the_gap_of_a_blade_in_contact_before():
    # blade 2 penetrates; 0, of the last solution with it, is bounded above 0
    blades, wide, random = 5, widths(5)[1], np.random.default_rng(3)
    rows, q = random.normal(size=(blades, 16)), random.normal(size=16)
    own = np.array([3.0, 4.0, -1.0, 5.0, 6.0]) * 1e-5
    rows *= (own / (rows @ q))[:, None]
    gaps, tips = np.zeros(2 * wide), (own - 2e-5)[folded(blades, wide)]
    known = np.zeros(keep.length_of_known(blades), np.int64)
    known[[0, 1]], known[blades + keep.SIZE] = (0, 2), 2
    opened, where = gaps + tips, np.zeros(blades + 1, np.int64)
    lowest = read_near(rows.ravel(), q, blades, gaps, 0, known, tips, opened, where)
    seen = opened[[place_of(j, blades, wide) for j in range(blades)]]
    wanted = np.array([3.0, 2.0, -1.0, 3.0, 4.0]) * 1e-5  # others keep their bounds
    assert lowest == pytest.approx(-1e-5)
    assert seen == pytest.approx(wanted)


@pytest.mark.parametrize("scheme", KINDS)
def test_tips_are_within_a_bound_that_each_mode_alone_reaches(scheme):
    rotor = march_of(7, scheme=scheme).scheme.arrays.rotor
    for q in np.eye(len(rotor.reach)):
        assert farthest(1e9, q, rotor) == pytest.approx(farthest(0.0, q, rotor))
    for q in np.random.default_rng(4).normal(size=(20, len(rotor.reach))):
        assert 0.0 < farthest(0.0, q, rotor) < farthest(1e9, q, rotor)


def test_amplitudes_that_die_out_become_zero():
    quiet = {"gap": 0.05, "force": 1e-140, "duration": 0.3, "traces": "summary"}
    march = march_of(7, scheme="general", **quiet)
    march.run()
    values = np.abs(np.concatenate([march.state.rotor, march.state.ring]))
    assert not ((values > 0) & (values < 1e-290)).any()


LONG = {
    "speed": 520.0, "duration": 0.6, "revolutions": 0.0, "interval": 1e-3,
    "time_step": 4e-6, "nodal_diameter": 3, "friction": 0.3,
}  # fmt: skip


def test_the_rest_in_closed_form_is_the_rest_marched():
    one, other = march_of(**LONG), march_of(**LONG, plan="everything")
    history, history_b = one.run(), other.run()
    assert history_b.certificate < 0.0
    assert 0.0 < history.last_contact < history.certificate < 0.5 * history.end
    assert one.marched < 0.5 * one.total
    for a, b in zip(one.displacements(), other.displacements(), strict=True):
        assert np.abs(a - b).max() < 1e-9 * np.abs(b).max()
    for name in ("tips", "centre", "energy", "impulse", "lost", "fed", "casing"):
        a, b = getattr(history, name), getattr(history_b, name)
        assert np.abs(a - b).max() < 1e-10 * np.abs(b).max(), name
        c, d = a[-50:], b[-50:]  # of their own size, not of the run's
        assert np.abs(c - d).max() < 1e-8 * np.abs(d).max(), name
    for name, a in history.ledger.items():
        if name != "residual":
            assert a == pytest.approx(history_b.ledger[name], rel=1e-9), name
    for a, b in zip(one.state[:2], other.state[:2], strict=True):
        assert np.abs(a - b).max() < 1e-8 * np.abs(b).max()


@pytest.mark.parametrize(("modes", "share"), [(slice(None), 0.05), ([12], 0.9)])
def test_the_bound_of_the_certificate_is_one_of_each_blade(modes, share):
    march = march_of(7, gap=1.0, force=0.0, duration=0.05)
    random = np.random.default_rng(2)
    size = len(march.model.rotor.omega)
    half = len(march.scheme.arrays.rotor.drift)
    parts = march.state.rotor[: 2 * half].reshape(2, half)
    parts[:, np.arange(size)[modes]] = 1e-6 * random.normal(size=(2, size))[:, modes]
    ring = march.state.ring.reshape(3, 2, -1)
    own = march.coast.ring.own
    if modes == slice(None):
        ring[:2, :, own] = random.normal(size=(2, 2, len(own))) * 1e-7
    coast = FreeDecay(march.scheme)
    bound = coast.bound(march.state)[0].sum(axis=1)
    assert len(bound) == 7
    most = np.zeros(7)
    wide = len(march.state.gaps) // 6
    places = [place_of(j, 7, wide) for j in range(7)]
    for _ in range(4000):
        march.advance(1)
        row = march.state.gaps.reshape(3, -1)[march.steps % 3]
        tips = march.displacements()[0][:14:2]
        most = np.maximum(most, np.abs(row[places] - tips - 1.0))
    assert (most < LESS * bound).all()
    assert (most > share * bound).all()  # one mode reaches it
