"""Eight laws of the time integration, on one table of scenes and schemes.

The table is `scenes.TABLE`: what is set on a small engine, and the schemes that march
it. Each law is asked of each row, but of those that are no case of it, which stand
beside the law with their reason.
"""

import itertools

import numpy as np
import pytest
from alike import assert_close, assert_mirrored, assert_same_in_parts
from extremes.laws import in_mirror
from losses import by_differences, by_flow
from scenes import BASE, CYCLIC, ROWS, TABLE, Scenes

from hpcwhirl.case import speed
from hpcwhirl.case.profile import departure, shape_of
from hpcwhirl.case.unbalance import steady_at
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.kernels.loop.slot_slides import KINDS, OPENED, PASSED

pytestmark = pytest.mark.turns
CLEAR = {"gap": 0.05}
WIDER = 2e-6  # m
SMOOTH = {  # a short pulse rings at all lengths
    "pulse": 1e-3, "duration": 3e-3, "interval": 1.2e-4,
}  # fmt: skip
SHORTER = {"pulse": 5e-4, "duration": 6e-4}  # intervals of one step are costly
BY_INTERVALS = "run-", "closes"  # within an interval, a line stands for the law
STARTED = {"start_energy": 5.0, "start_modes": "rotor suspension"}
UNSTARTED = "unbalance", "lost blade", "points", "clamped", "run-up, rot"


@pytest.fixture(scope="module")
def scenes(tmp_path_factory):
    return Scenes(tmp_path_factory.mktemp("scenes"))


def asked(*aside, schemes=("modal", "general", "paper", "exact")):
    """Return the mark of a law: the rows of which it is asked.

    aside : names of scenes, or of parts such as ", rotation", that are no case of it
    """
    rows = [
        (name, scheme)
        for name, scheme in ROWS
        if scheme in schemes and not any(part in name for part in aside)
    ]
    ids = [f"{name}: {scheme}" for name, scheme in rows]
    return pytest.mark.parametrize(("name", "scheme"), rows, ids=ids)


@asked()
def test_the_ledger_closes(scenes, name, scheme):
    """Energy, losses and works of loading, rotation and friction add up to nothing."""
    _, history = scenes.ended(name, scheme)
    ledger = dict(history.ledger)
    residual = abs(ledger.pop("residual"))
    assert history.contacts > 0
    if "points" in name:  # whose gaps the next law does not see
        assert history.gap_error < 1e-9
    assert residual <= 1e-11 * sum(map(abs, ledger.values())) + history.blur[0]
    # about a circle, forces of a film and of springs unlike are booked as losses
    unlike = any(part in name for part in ("unlike", "film", "journal"))
    moves = "lost blade" in name or "run-" in name
    springs = name == "sticks, layer, rubbed"  # slow rods hardly wear: they give back
    drives = "supports apart" in name or "stop" in name  # its friction does
    if not drives and not springs and not (moves and unlike):
        assert np.all(np.diff(history.lost) >= -1e-12 * abs(history.lost).max())


RUBS = [
    (name, scheme)
    for name, scheme in dict.fromkeys(
        row for name, own in ROWS for row in ((name, own), (name, "general"))
    )
    if "sticks" in name and scheme != "exact"
]


@pytest.mark.parametrize(("name", "scheme"), RUBS, ids=map(": ".join, RUBS))
def test_the_rotation_gives_what_friction_heats_and_works(scenes, name, scheme):
    """Also where the motion without contact moves: friction works on it, too."""
    _, history = scenes.ended(name, scheme)
    rubbing, work = history.rubbing, history.ledger["friction"]
    near = 1e-11 * sum(map(abs, history.ledger.values()))
    assert rubbing.heat > 0.0
    assert abs(rubbing.turned - rubbing.heat - work) <= near


LOST = {"pulse": 2.4e-3, "plan": "everything"}, 1000  # a pulse during contact; steps
# `general` has a sum of its own; with rotation at a changing speed the displacements
# have the motion without contact, too; supports unlike work, a shape is let go at
# once, and modes that are coupled have no closed form in a step of `exact`
LESS_ASKED = (
    "layer", "elements", "supports", "film", "journal", "bearing", "stop",
    "run-up, rot", "start, r",
    "unbalance, run-up", "let go",
)  # fmt: skip
WAVES = [
    row
    for row in ROWS
    if row[1] in CYCLIC and not any(part in row[0] for part in LESS_ASKED)
    and (row[1] == "modal" or "rotation" not in TABLE[row[0]][0])
]  # fmt: skip


def lost(march, steps):
    """Return the loss by damping of a march, J: what works leave, and summed."""
    by = by_flow if march.scene.solver.flies else by_differences
    summed = by(march, steps)
    assert march.counter[contact.TOUCHED] > 0
    return march.lean.model.folds * march.scheme.balance(march.state).damping, summed


@pytest.mark.parametrize(("name", "scheme"), WAVES, ids=map(": ".join, WAVES))
def test_what_damping_takes_is_what_works_leave(scenes, name, scheme, monkeypatch):
    """The loss of waves is works less energy: here it is summed from displacements."""
    monkeypatch.setattr(speed, "USUAL", 1e-13)
    given, steps = LOST
    left, summed = lost(scenes.march(name, scheme, **given), steps)
    assert summed > 0.0
    assert left == pytest.approx(summed, rel=1e-9)


@pytest.mark.parametrize("scheme", CYCLIC)
def test_a_work_that_is_not_entered_shows_as_damping(scenes, scheme):
    given, steps = LOST
    march = scenes.march("equal", scheme, **given)
    march.scheme.arrays.rotor.pulse.numbers[4:9] = 0.0  # by the pulse, of contact
    left, summed = lost(march, steps)
    assert abs(left - summed) > 1e-7 * summed


@pytest.mark.parametrize("scheme", CYCLIC)
def test_a_work_of_friction_that_is_not_entered_shows_as_damping(scenes, scheme):
    given, steps = LOST
    march = scenes.march("sticks", scheme, **given)
    fixed = march.scheme.arrays.contact.slides.fixed.reshape(KINDS, -1)
    fixed[OPENED : PASSED + 1] = 0.0  # of what the pass over waves does not see
    left, summed = lost(march, steps)
    assert march.counter[contact.STUCK] > 0
    assert abs(left - summed) > 1e-7 * summed


def waves_at(march, history, blades):
    """Return cos(h theta), sin(h theta) at each tip, (n, N, H + 1, 2), static frame."""
    time = history.time[:, None, None]
    turned = speed.angle_at(march.scene, time)
    turned = turned + 2 * np.pi * np.arange(blades)[:, None] / blades
    orders = np.arange(history.casing.shape[1])
    return np.stack([np.cos(turned * orders), np.sin(turned * orders)], axis=-1)


# a layer yields; points have gaps of their own; elements are no harmonics
@asked("layer", "points", "elements", "stribeck")
def test_gaps_stay_open(scenes, name, scheme):
    march, history = scenes.ended(name, scheme)
    waves = waves_at(march, history, history.tips.shape[1])
    wall = np.einsum("nhc,njhc->nj", history.casing, waves)
    if "let go" not in name:  # there the trace has the shape, too
        angles = np.arctan2(waves[..., 1, 1], waves[..., 1, 0])
        wall += departure(shape_of(march.scene), angles)
    closed = speed.closure_at(march.scene, history.time)[:, None]
    gaps = BASE["gap"] - closed + wall - history.tips[..., 0]
    given = TABLE[name][0]
    present = np.arange(gaps.shape[1]) != given.get("lost_blade", -1)
    near = 1e-5 if any(law in name for law in BY_INTERVALS) else 1e-9
    assert gaps[:, present].min() > -near * np.abs(history.tips).max()
    gone = history.time > given.get("lost_blade_time", 0.0) + 1e-9
    assert not np.diff(history.blade_impulse[gone][:, ~present], axis=0).any()
    assert history.gap_error < 1e-12


def gives(body, step):
    """Return what a unit modal force changes each amplitude by in a step."""
    return step**2 / (1.0 + body.ratios * body.omega * step)


def not_touched(scenes, name, scheme, step, number):
    """Return tips and casing at a step as if the gap were not closed until then.

    The casing's radius grows with the gap: of two wider ones the limit is taken.
    """
    found = []
    for more in (WIDER, 2 * WIDER):
        gap = TABLE[name][0].get("gap", BASE["gap"]) + more
        march = scenes.march(name, scheme, interval=step, gap=gap)
        march.advance(number + 2)
        history = march.history()
        assert history.impulse[number] == 0.0
        found.append((history.tips[number], history.casing[number]))
    (tips, casing), (tips_far, casing_far) = found
    return 2 * tips - tips_far, 2 * casing - casing_far


# a layer yields; points have rows of their own; elements are no harmonics; a rigid
# casing takes any momentum; Stribeck's friction is another one; a shell touches from
# the start; a lost blade takes its share of the modes along;
# where the speed passes 0 the first tip sticks
@asked(
    "layer", "points", "elements", "rigid", "stribeck", "table", "shell", "lost blade",
    "through 0",
)  # fmt: skip
def test_one_force_pushes_both_bodies_apart(scenes, name, scheme):
    """At the first contact, against the same motion in gaps that are not closed there.
    What contact has moved is what the multipliers move by the modes of both bodies.
    Rotation couples these by terms of the order of the step, which are not counted, nor
    does `exact` move modes as differences do.
    """
    step = 2e-6
    march = scenes.march(name, scheme, interval=step)
    history = march.run()
    first = int(np.argmax(history.impulse > 0.0))
    tips, casing = not_touched(scenes, name, scheme, step, first)
    lam, mu = history.blade_impulse[first] / step, march.scene.friction
    rotor, ring, blades = march.model.rotor, march.model.casing, len(lam)
    assert np.count_nonzero(lam) >= 1
    turning = TABLE[name][0].get("rotation") == "full"
    share = 2e-2 if turning or scheme == "exact" else 1e-5
    if any(law in name for law in BY_INTERVALS):
        share = max(share, 1e-3)
    radial, tangential = (rotor.shapes[at : 2 * blades : 2] for at in (0, 1))
    push = -(lam @ radial + mu * lam @ tangential) * gives(rotor, step)
    want = np.stack([push @ radial.T, push @ tangential.T], axis=1)
    assert_close(history.tips[first] - tips, want, share)
    out, along = (rows @ ring.shapes for rows in march.model.ring.rows(
        speed.angle_at(march.scene, history.time[first])
        + 2 * np.pi * np.arange(blades) / blades
    ))  # fmt: skip
    push = (lam @ out + mu * lam @ along) * gives(ring, step)
    waves = waves_at(march, history, blades)[first]
    moved = np.einsum("hc,jhc->j", history.casing[first] - casing, waves)
    assert_close(moved, out @ push, share)


# rotors of a file are given for one sense of rotation; a start is drawn by the mode
@asked("points", "start", "bearing")
def test_a_mirrored_speed_gives_a_mirrored_motion(scenes, name, scheme):
    _, history = scenes.ended(name, scheme)
    back = scenes.march(name, scheme, **in_mirror(BASE | TABLE[name][0])).run()
    assert_mirrored(history, back, 1e-7)


@asked()
def test_slices_and_resumes_give_the_same_bits(scenes, name, scheme):
    march = scenes.march(name, scheme)
    assert_same_in_parts(march.case, 1, 87, 88, 271, 700, 10**9, anew=True)


ORACLE = {
    "unlike supports, unbalance": "general",
    "shell": "general",
    "run-up, rotation": "general",
    "sticks, run-up, rotation": "general",
    "sticks, unlike supports, unbalance": "general",
    "sticks, unequal, film": "general",
    "run-up, rotation, shaft": "general",
    "run-up, rotation, supports apart, film": "general",
    "start, run-up": "general",
    "start, unbalance, run-up": "general",
    "start, unbalance, unlike supports": "general",
    "unequal, unlike supports, unbalance": "general",
    "lost blade, unlike supports": "general",
    "shaft, supports apart, unbalance": "general",
    "unequal, shaft, films, unbalance": "general",
    "lost blade, shaft, supports apart": "general",
    "lost blade later, unlike supports": "general",
    "lost blade later, film": "general",
    "run-up, rotation, shaft, stops": "general",
}  # `paper` refuses these


# `exact` has the error of another step: see the order
@asked(schemes=("modal", "general"))
def test_a_scheme_agrees_with_the_paper_s(scenes, name, scheme, monkeypatch):
    """Intervals of one step, in which a speed that changes has no error."""
    monkeypatch.setattr(speed, "USUAL", 1e-13)
    given = {"duration": 2.4e-3} if "run" in name else {}
    one, other = (
        scenes.march(name, n, **given).run()
        for n in (scheme, "general" if "weight" in name else ORACLE.get(name, "paper"))
    )
    assert one.contacts == other.contacts > 0
    for series in ("tips", "centre", "casing", "energy", "worn"):
        a, b = getattr(one, series), getattr(other, series)
        size = np.abs(other.tips if series == "centre" else b).max(initial=0.0)
        blur = one.blur[0] if series == "energy" else 0.0
        assert a.shape == b.shape
        assert np.abs(a - b).max(initial=0.0) <= 1e-9 * size + blur, series
    share = 1e-8 if "run" in name else 1e-9  # intervals: another impact by 4e-7
    near = share * sum(abs(v) for v in other.ledger.values()) + one.blur[0]
    for term, value in one.ledger.items():  # by waves, a loss is what works leave
        assert abs(value - other.ledger[term]) <= near, term
    if one.rubbing:
        assert abs(one.rubbing.heat - other.rubbing.heat) <= near


# contact alone has a layer, or slip; a release is in one step; a stop is a contact
@asked("layer", "stribeck", "let go", "friction", "stop")
def test_the_error_of_free_motion_is_of_second_order_or_none(
    scenes, name, scheme, monkeypatch
):
    """Three steps, each half of the last: errors fall by four.

    The flow of `exact` has no error, but the pulse on the casing, which it takes as
    constant in a step.
    """
    monkeypatch.setattr(speed, "USUAL", 1e-13)
    begun = {} if any(n in name for n in UNSTARTED) else STARTED
    turns = {"rotation", "acceleration"} <= TABLE[name][0].keys()
    given = CLEAR | SMOOTH | (SHORTER if turns else {}) | begun
    longest = 1e-6 if "lost blade" in name else 4e-6  # the bare root is stiff
    found = [
        scenes.march(name, scheme, time_step=step, **given).run()
        for step in (longest, longest / 2, longest / 4)
    ]
    errors = {
        series: [
            np.abs(getattr(a, series) - getattr(b, series)).max()
            for a, b in itertools.pairwise(found)
        ]
        for series in ("casing", "tips")
    }
    if scheme == "exact":
        assert max(errors.pop("tips")) <= 1e-12 * np.abs(found[0].tips).max()
    for coarse, fine in errors.values():
        if coarse > 1e-15:  # m; else the body is at rest
            assert np.log2(coarse / fine) == pytest.approx(2.0, abs=0.1)


# an initial motion, a shape let go, a blade lost and Euler's force set in motion
@asked("start", "let go", "run-up, rotation", "lost blade")
def test_rest_stays_rest(scenes, name, scheme):
    """On its circle, where there is an unbalance."""
    quiet = {"force": 0.0, "duration": 1e-3}
    march = scenes.march(name, scheme, **quiet, **CLEAR)
    history = march.run()
    assert history.contacts == 0
    moved = history.tips - history.tips[:1]
    if "run" not in name:
        moved = history.tips - steady_tips(march, history)
    assert np.abs(moved).max() <= 1e-9 * np.abs(history.tips).max()
    assert history.ledger["friction"] == 0.0


def steady_tips(march, history):
    """Return the tips' motion without contact by an unbalance, (n, N, 2), m."""
    points, places = march.model.rotor.points, np.stack(march.model.places, axis=-1)
    if points is not None:  # of each tip the trace has one
        places = places.reshape(-1, points.count, 2)[:, points.reference]
    moved = [steady_at(march.model, march.scene, t)[places] for t in history.time]
    return np.array(moved)


@asked("one blade fewer", "equal")
def test_what_a_scene_sets_moves_it_otherwise(scenes, name, scheme):
    """Or the laws above would be asked of the same motion again and again."""
    _, history = scenes.ended(name, scheme)
    _, plain = scenes.ended("equal", "modal")
    assert history.contact_impulse != pytest.approx(plain.contact_impulse, rel=1e-4)
