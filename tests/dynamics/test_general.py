"""Rotors of unequal sectors: both bodies as waves in the rotating frame, W constant.

`general` marches their modes one by one, with the casing in the static frame; `paper`
marches matrices in the static frame, with a row of the ring for each blade and
a Delassus matrix for each step.
"""

import numpy as np
import pytest
from alike import (
    assert_alike,
    assert_bodies_alike,
    assert_rest_as_marched,
    assert_same_bits,
    assert_same_in_parts,
    in_parts,
)
from solving import place_of, solve

from hpcwhirl.case.resolve import resolve
from hpcwhirl.cli.export_model import arrays_of
from hpcwhirl.dynamics.bodies.motion import gaps_of
from hpcwhirl.dynamics.bodies.timestep import recursion
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.kernels import keep_inverse as keep
from hpcwhirl.dynamics.kernels.compiled import kernel
from hpcwhirl.dynamics.kernels.kernel_types import Body
from hpcwhirl.dynamics.kernels.loop import bounded, circulant, whole
from hpcwhirl.dynamics.kernels.loop.circulant import folded
from hpcwhirl.dynamics.kernels.loop.flight import LESS
from hpcwhirl.dynamics.kernels.loop.wave_types import PointsRotor
from hpcwhirl.dynamics.kernels.vectors import widths
from hpcwhirl.dynamics.march import March
from hpcwhirl.dynamics.waves.mode_waves import mode_waves
from hpcwhirl.reduction.bodies import tip_rows
from hpcwhirl.scene import apply_settings, named_scene
from hpcwhirl.store.hdf5 import write_arrays

pytestmark = pytest.mark.turns

KINDS = {"modal": PointsRotor, "general": Body}
MODES = {1: 6, 2: 8, 7: 30, 12: 54, 22: 110, 30: 60}
read_near, farthest = (  # parts, for Python
    kernel(part.py_func) for part in (whole.read_near, bounded.farthest_point)
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


MOTIONS = [  # N, k, mu, speed; harmonics reach 20
    (22, 1, 0.3, 420.0),
    (12, 2, 0.0, -420.0),
    (7, 3, 0.3, 420.0),
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


@pytest.mark.parametrize("scheme", KINDS)
@pytest.mark.parametrize(("blades", "k", "mu", "speed"), MOTIONS)
def test_the_ring_turning_is_the_ring_at_rest(blades, k, mu, speed, scheme):
    given = {"gap": 1e-5, "force": 1e6, "amplitude_limit": 9.0} if k > 3 else {}
    given |= {"nodal_diameter": k, "friction": mu, "speed": speed, "duration": 4e-3}
    march = march_of(blades, scheme=scheme, **given)
    paper = March(resolve(scene(blades, scheme="paper", **given)))
    history, other = march.run(), paper.run()
    assert march.counter[contact.TOUCHED] == paper.counter[contact.TOUCHED]
    assert_alike(history, other)
    assert_bodies_alike(march, paper)
    ledger = history.ledger
    through = sum(abs(v) for v in ledger.values())
    assert abs(ledger["residual"]) < 1e-9 * through
    for term in ("damping", "pulse", "rotation", "friction", "impact"):
        near = 1e-9 * through
        assert ledger[term] == pytest.approx(other.ledger[term], rel=1e-8, abs=near)


def test_an_uneven_rotor_from_file_is_the_one_it_was_written_from(tmp_path):
    whole = scene(7, friction=0.3)
    path = tmp_path / "rotor.h5"
    write_arrays(path, arrays_of(resolve(whole).model), {})
    file = apply_settings(whole, {"mistuning": [], "file": str(path)})
    marches = [March(resolve(s)) for s in (file, whole)]
    kinds = {type(march.scheme.arrays.rotor) for march in marches}
    assert kinds == {PointsRotor}
    assert_alike(*(march.run() for march in marches))
    assert_bodies_alike(*marches)


def test_w_is_that_of_both_bodies_wherever_the_blades_are():
    march = march_of(7, friction=0.3, speed=-420.0)
    model, step = march.model, march.scene.solver.time_step
    _, _, give = recursion(model.casing.omega, model.casing.ratios, step)
    radial, tangential = tip_rows(model.rotor, 7)
    _, _, own = recursion(model.rotor.omega, model.rotor.ratios, step)
    found = march.scheme.arrays.contact.w
    for turned in (0.0, 0.37, 2.0):
        rows = model.ring.rows(turned + 2 * np.pi * np.arange(7) / 7)
        out, along = (r @ model.casing.shapes for r in rows)
        want = (out * give) @ (out - 0.3 * along).T
        want += (radial * own) @ (radial - 0.3 * tangential).T
        assert np.abs(found - want).max() < 1e-12 * np.abs(want).max()


@pytest.mark.slow
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
    whole = assert_same_in_parts(resolve(scene(**drawn(seed))), size)
    assert isinstance(whole.scheme.arrays.rotor, PointsRotor)
    assert whole.history().contacts > 0


@pytest.mark.parametrize("seed", [0, 2])
def test_sets_that_change_are_found_from_lower_bounds_with_the_same_bits(seed):
    """30 blades, more than are solved from the penetrating set, in a lobed casing."""
    random = np.random.default_rng(seed)
    lobed = {
        "speed": 300.0, "nodal_diameter": 3 + seed, "gap": 1e-4, "friction": 0.1,
        "mistuning": random.normal(0.0, 0.05, 30).tolist(), "scheme": "modal",
        "casing.kind": "rigid", "casing.amplitude": 1.5e-4, "casing.rise": 1e-3,
    }  # fmt: skip
    case, sets, most = resolve(scene(30, **lobed)), set(), 0
    whole = March(case)
    whole.advance(whole.total)
    for parts in in_parts(case, [1]):  # all tips are read in the first step of a slice
        size = parts.state.known[30 + keep.SIZE]
        sets.add(tuple(sorted(parts.state.known[:size])))
        most = max(most, size)
    assert len(sets) > 20
    assert most > keep.FEW
    assert_same_bits(parts, whole)


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


def test_tips_are_within_a_bound_that_each_mode_alone_reaches():
    march = march_of(7)
    rotor = march.scheme.arrays.rotor

    def far(limit, q):
        state = march.state._replace(rotor=q)
        return farthest(rotor.rows, rotor, limit, state, None)

    size, (alone,) = len(rotor.ahead), np.nonzero(rotor.reach)
    assert len(alone) > 7
    for q in np.eye(size)[alone]:
        assert far(1e9, q) == pytest.approx(far(0.0, q))
    for q in np.random.default_rng(4).normal(size=(20, size)):
        assert 0.0 < far(0.0, q) < far(1e9, q)


def test_amplitudes_that_die_out_become_zero():
    quiet = {"gap": 0.05, "force": 1e-140, "duration": 0.3, "traces": "summary"}
    march = march_of(7, **quiet)
    march.run()
    values = np.abs(np.concatenate([march.state.rotor, march.state.ring]))
    assert not ((values > 0) & (values < 1e-290)).any()


LONG = {
    "speed": 520.0, "duration": 0.6, "revolutions": 0.0, "interval": 1e-3,
    "time_step": 4e-6, "nodal_diameter": 3, "friction": 0.3,
}  # fmt: skip


def test_the_rest_in_closed_form_is_the_rest_marched():
    one, other = march_of(**LONG), march_of(**LONG, plan="everything")
    history, _ = one.run(), other.run()
    assert history.certificate < 0.5 * history.end
    assert one.marched < 0.5 * one.total
    assert_rest_as_marched(one, other, late=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize(("modes", "share"), [(slice(None), 0.05), ([12], 0.9)])
def test_the_bound_of_the_certificate_is_one_of_each_blade(modes, share):
    march = march_of(7, gap=1.0, force=0.0, duration=0.05)
    random, state = np.random.default_rng(2), march.state.rotor
    waves = march.scheme.waves
    own, beside, _ = waves.apart
    size = 1e-6 * random.normal(size=(2, len(own)))[:, modes]
    state[own[modes]], state[waves.half + own[modes]] = size
    if modes == slice(None):
        size = 1e-7 * random.normal(size=(2, len(beside)))
        state[beside], state[waves.half + beside] = size
    coast = march.scheme.free()
    bound = coast.bound(march.state)[0].sum(axis=1)
    assert len(bound) == 7
    most = np.zeros(7)
    for _ in range(4000):
        march.advance(1)
        rotor, casing = march.displacements()
        turned = march.scene.speed * march.steps * march.scene.solver.time_step
        gaps = gaps_of(march.model, 0.0, rotor, casing, turned)
        most = np.maximum(most, np.abs(gaps))
    assert (most < LESS * bound).all()
    assert (most > share * bound).all()  # one mode reaches it
