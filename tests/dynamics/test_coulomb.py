"""Set-valued friction: tips that slide either way or stick, against closed forms."""

import math

import numpy as np
import pytest
from few_modes import Bodies
from scenes import BASE, FULL, SOFT

from hpcwhirl.campaign.simulate import notes_on
from hpcwhirl.case import speed as speed_law
from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.kernels.contact import contact_space
from hpcwhirl.dynamics.kernels.coulomb import choose, coulomb_space, rub
from hpcwhirl.dynamics.kernels.kernel_types import Coulomb
from hpcwhirl.dynamics.march import March
from hpcwhirl.scene import apply_settings, named_scene

STEP, RADIUS = 1e-4, 1.0
PRESSED, DEPTH = 100.0, 1e-3  # rad/s, m: a unit mass is pressed with 10 N
NORMAL = PRESSED**2 * DEPTH


def block(omega, speed, friction, **more):
    """Return a unit mass on a tangential spring, pressed against the casing.

    The casing passes it at -Omega R.
    """
    radial, tangential = np.array([[1.0, 0.0]]), np.array([[0.0, 1.0]])
    bodies = Bodies(
        [PRESSED, omega], radial, tangential, step=STEP, speed=speed, radius=RADIUS,
        gap=-DEPTH, friction=friction, **more,
    )  # fmt: skip
    bodies.state.q_b[0] = -DEPTH
    bodies.state.gaps[:] = bodies.state.older[:] = 0.0
    return bodies


@pytest.mark.parametrize("speed", [0.3, -0.3])
def test_a_block_is_braked_to_the_speed_of_the_belt_and_stays(speed):
    bodies, late = block(0.0, speed, 0.2), abs(speed) / (0.2 * NORMAL)
    path = bodies.march(4000, every=2)
    velocity = np.gradient(path.rotor[:, 1], path.time)
    sliding = path.time < 0.98 * late
    assert velocity[sliding] == pytest.approx(
        -np.sign(speed) * 0.2 * NORMAL * path.time[sliding], abs=4e-4
    )
    assert velocity[path.time > 1.02 * late] == pytest.approx(-speed, rel=1e-10)
    ledger, counter = bodies.state.ledger, bodies.state.counter
    assert ledger[contact.HEAT] == pytest.approx(-0.5 * speed**2, rel=1e-3)
    share = counter[contact.STUCK] / counter[contact.MET]
    assert share == pytest.approx(1.0 - late / path.time[-1], abs=1e-3)


@pytest.mark.turns
def test_a_block_on_a_belt_sticks_and_slips_with_the_known_period():
    # kinetic mu beyond a very slow slide, mu_s at rest: Thomsen and Fidlin, Int. J.
    # Non-Linear Mech. 38 (2003) 389, for a steep characteristic
    omega, speed, held, slides = 20.0, 0.05, 0.4, 0.2
    bodies = block(omega, speed, slides, at_rest=held, decay=2e-4)
    bodies.state.d_b[1] = -speed * STEP
    path = bodies.march(40000, every=8)
    apart = (held - slides) * NORMAL / omega**2
    slip = (2.0 / omega) * (np.pi - np.arctan(omega * apart / speed))
    period = 2.0 * apart / speed + slip
    out = np.hypot(apart, speed / omega)
    late = path.time > 2.0
    x = path.rotor[late, 1] + slides * NORMAL / omega**2
    assert x.max() == pytest.approx(out, rel=0.01)
    assert -x.min() == pytest.approx(out, rel=0.01)
    up = np.flatnonzero((x[:-1] < 0) & (x[1:] >= 0))
    assert np.diff(path.time[late][up]).mean() == pytest.approx(period, rel=0.01)


@pytest.mark.turns
@pytest.mark.parametrize("friction", [0.05, 0.1])
def test_a_block_on_an_oscillating_plane_has_the_triangle_of_velocities(friction):
    # where it never sticks its speed changes at mu N, turning where it meets the plane
    omega, fastest = 40.0, 0.3
    shape = 1e-4  # of a mode of so large a mass that friction does not move it
    bodies = block(0.0, 0.0, friction, plane=(omega, shape))
    bodies.state.q_c[0] = fastest / omega / shape
    bodies.state.d_c[0] = bodies.state.q_c[0] * (1 - np.cos(omega * STEP))
    path = bodies.march(60000, every=6)
    velocity = np.gradient(path.rotor[:, 1], path.time)[path.time > 4.0]
    turned = friction * NORMAL * np.pi / (2.0 * omega)
    assert omega * np.sqrt(fastest**2 - turned**2) > friction * NORMAL  # never sticks
    assert 0.5 * np.ptp(velocity) == pytest.approx(turned, rel=0.01)
    assert (
        bodies.state.counter[contact.STUCK] < 1e-3 * bodies.state.counter[contact.MET]
    )


@pytest.mark.turns
@pytest.mark.parametrize("speed", [3.0, -3.0])
def test_a_disk_rolls_in_a_ring_at_minus_speed_times_radius_over_gap(speed):
    tips, gap, radius = 90, 0.02, 0.2
    angle = 2 * np.pi * np.arange(tips) / tips
    radial = np.column_stack([np.cos(angle), np.sin(angle)])
    tangential = np.column_stack([-np.sin(angle), np.cos(angle)])
    omega = 20.0
    bodies = Bodies(
        [omega, omega], radial, tangential, step=2e-4, speed=speed, radius=radius,
        gap=gap, friction=0.6,
    )  # fmt: skip
    spin = -speed * radius / gap  # of the centre in the rotating frame as it rolls
    bodies.state.q_b[0], bodies.state.d_b[1] = gap, 0.9 * spin * gap * bodies.step
    path = bodies.march(20000, every=20)
    x, y = path.rotor[:, 0], path.rotor[:, 1]
    late = path.time > 2.0
    turn = np.gradient(np.unwrap(np.arctan2(y[late], x[late])), path.time[late])
    # the tip's radius as it rolls is radius - gap: whirl in the static frame
    whirl = turn.mean() + speed
    assert whirl == pytest.approx(-speed * (radius - gap) / gap, rel=2e-3)
    assert bodies.state.counter[contact.STUCK] > 0.9 * bodies.state.counter[contact.MET]


def law_of(mu, response):
    """Return Coulomb's law of rigid tips with a response, its rows by force."""
    none = np.zeros((0, 0))
    return Coulomb(mu, 0.0, 0.0, 1.0, response, none, np.zeros(0), always=False)


def drawn_problem(rng, tips):
    """Return gaps, slides, mu and a response of both, of tips that are coupled."""
    size = 2 * tips
    half = rng.normal(size=(size, size + 2))
    return rng.normal(size=tips) - 0.7, rng.normal(size=tips), half @ half.T


def solved(gaps, slides, law, guess):
    """Return multipliers, friction and gaps, from a guess of the states."""
    tips = len(gaps)
    index, shape = np.zeros((tips, 0), np.int64), np.zeros((tips, 0))
    space, touch = coulomb_space(tips, 0), contact_space(tips, 0)
    space.slides[:] = slides
    lam, tau, opened = np.zeros((3, tips))
    size, more = 0, choose(gaps, law, space)
    space.state[:] = np.where(gaps < 0.0, guess, 0)
    while size < more:
        size = more
        active, more = rub(
            gaps, size, law, 1.0, index, shape, lam, tau, opened, touch, space
        )
    assert active == np.count_nonzero(lam) == len(set(touch.where[:active]))
    return lam, tau, opened


@pytest.mark.slow
@pytest.mark.parametrize("tips", [1, 2, 5, 12])
@pytest.mark.parametrize("mu", [0.0, 0.1, 0.8, 3.0])
def test_the_forces_of_drawn_problems_obey_the_law(tips, mu):
    rng, count = np.random.default_rng(tips), 0
    for _ in range(60):
        gaps, slides, response = drawn_problem(rng, tips)
        if gaps.min() >= 0.0:
            continue
        law = law_of(mu, np.ascontiguousarray(response.T))
        lam, tau, opened = solved(gaps, slides, law, rng.integers(0, 4, tips))
        after = np.concatenate([gaps, slides]) + response @ np.concatenate([lam, tau])
        gap, slide = after[:tips], after[tips:]
        small = 1e-9 * max(abs(gaps).max(), abs(slides).max())
        assert lam.min() >= 0.0
        assert gap.min() >= -small
        assert np.abs(lam * gap).max() <= small * lam.max()
        assert np.all(np.abs(tau) <= mu * lam + 1e-9 * lam.max())
        moving = np.abs(slide) > small
        against = -np.sign(slide) * mu * lam
        assert tau[moving] == pytest.approx(against[moving], abs=1e-8 * lam.max())
        assert opened == pytest.approx(gap, abs=small)
        count += 1
    assert count > 30


def test_a_rod_that_jams_sticks():
    """Painleve: friction of sliding would draw the tip in; it sticks at once."""
    response = np.array([[1.0, 1.5], [1.5, 3.0]])  # W_nn - mu W_nt < 0
    law = law_of(1.0, response)
    lam, tau, _ = solved(np.array([-0.1]), 2.0, law, 0)
    assert lam[0] > 0.0
    after = np.array([-0.1, 2.0]) + response @ [lam[0], tau[0]]
    assert after == pytest.approx([0.0, 0.0], abs=1e-12)
    assert abs(tau[0]) <= lam[0]


def on_two_feet():
    """Return the response of a block: unit mass, inertia 1/3, feet 1 beside and below.

    Rows as in `kernel_types.Coulomb.rotor`, the gaps and slides of its two feet.
    """
    out = np.array([[0.0, 1.0, -1.0], [0.0, 1.0, 1.0]])
    along = np.array([[1.0, 0.0, 1.0], [1.0, 0.0, 1.0]])
    rows = np.vstack([out, -along])
    return rows @ np.diag([1.0, 1.0, 3.0]) @ rows.T


# it slides on both feet; tips; its first foot would be drawn in, and jams (Painleve)
@pytest.mark.parametrize(
    ("mu", "pushes", "drags"),
    [
        (0.5, (0.075, 0.025), (-0.0375, -0.0125)),
        (1.2, (0.25, 0.0), (-0.3, 0.0)),
        (2.0, (6.4 / 7.0, 0.0), (-8.3 / 7.0, 0.0)),
    ],
)
@pytest.mark.parametrize("guess", range(4))
def test_a_block_slides_on_two_feet_tips_or_jams(mu, pushes, drags, guess):
    gaps, slides = np.full(2, -0.1), np.full(2, 2.0)
    law = law_of(mu, on_two_feet())
    lam, tau, opened = solved(gaps, slides, law, guess)
    assert lam == pytest.approx(pushes, abs=1e-12)
    assert tau == pytest.approx(drags, abs=1e-12)
    slid = (slides + on_two_feet()[2:] @ [*lam, *tau])[0]
    assert slid == pytest.approx(0.0, abs=1e-12) if mu == 2.0 else slid > 0.0
    assert opened.min() > -1e-12


def marched(**more):
    """Return the history of the tests' small engine with further settings."""
    scene = apply_settings(named_scene("table2"), BASE | {"scheme": "modal"} | more)
    return March(resolve(scene)).run()


@pytest.mark.turns
@pytest.mark.parametrize("draw", sorted({*range(24)} - {6, 8, 9}))  # these touch
def test_where_tips_slide_on_the_results_are_those_of_permanent_sliding(draw):
    rng = np.random.default_rng(draw)
    given = {
        "speed": float(rng.choice([-1, 1]) * rng.uniform(50.0, 600.0)),
        "friction": float(rng.uniform(0.0, 0.3)),
        "gap": float(rng.uniform(4e-5, 2e-4)),
        "blades": int(rng.integers(4, 12)),
        "rotation": str(rng.choice(["none", "full"])),
        "nodal_diameter": int(rng.integers(1, 4)),
        "scheme": ("modal", "exact", "modal", "general")[draw % 4],
    }  # fmt: skip
    if draw % 4 == 2:
        given["mistuning"] = (0.03 * rng.normal(size=given["blades"])).tolist()
    permanent, loose = marched(**given), marched(slip="set-valued", **given)
    assert permanent.contacts > 0
    assert loose.rubbing.stuck == loose.rubbing.reversed == 0.0
    assert np.array_equal(loose.tips, permanent.tips)
    drag = given["friction"] * np.sign(given["speed"]) * loose.contact_impulse
    assert loose.rubbing.impulse == pytest.approx(drag, rel=1e-12)


SLOW = {"slip": "set-valued", "friction": 0.5, "gap": 5e-5}


@pytest.mark.parametrize("speed", [5.0, 1.0, 1e-9, -1.0, 0.0])
@pytest.mark.parametrize("rotation", ["none", "full"])
def test_the_heat_of_friction_is_what_rotation_gives_less_what_motions_take(
    speed, rotation
):
    if speed == 0.0 and rotation == "full":
        rotation = "none"
    history = marched(speed=speed, rotation=rotation, **SLOW)
    radius = named_scene("table2").engine.rotor.radius
    given = speed * radius * history.rubbing.impulse
    taken = history.ledger["friction"]
    assert history.rubbing.heat >= 0.0
    assert history.rubbing.stuck > 0.0
    assert history.rubbing.heat == pytest.approx(given - taken, rel=1e-9, abs=1e-12)


def test_friction_without_rotation_drives_nothing():
    """A tip that turns at 1e-9 rad/s is dragged by nothing but its vibration."""
    permanent, loose = (
        marched(**SLOW | {"speed": 1e-9, "slip": slip})
        for slip in ("permanent", "set-valued")
    )
    assert permanent.ledger["friction"] > 1.0  # it drives where nothing turns
    assert -math.inf < loose.ledger["friction"] < 0.0


@pytest.mark.turns
@pytest.mark.parametrize("rotation", ["none", "full"])
def test_tips_that_stick_follow_the_speed_inside_its_intervals(rotation, monkeypatch):
    """Were the speed constant in an interval, the heat would err by 1 and 6 %."""
    given = {"speed": 3.0, "acceleration": 1000.0, "rotation": rotation} | SLOW
    usual = marched(**given)
    monkeypatch.setattr(speed_law, "USUAL", 1e-13)
    fine = marched(**given)
    assert usual.rubbing.stuck > 0.1
    assert usual.rubbing.stuck == pytest.approx(fine.rubbing.stuck, rel=2e-3)
    assert usual.rubbing.heat == pytest.approx(fine.rubbing.heat, rel=5e-4)


@pytest.mark.parametrize(
    ("slip", "ratio", "told"),
    [("permanent", 1.5, 1), ("permanent", 0.9, 0), ("set-valued", 1.5, 0)],
)
def test_a_slip_beyond_that_of_rotation_is_a_note_of_permanent_sliding(
    slip, ratio, told
):
    scene = apply_settings(named_scene("table2"), {"scheme": "modal", "slip": slip})
    row = {"outcome": "completed", "free_growth": 0.0, "lean_checked": 0.0}
    notes = notes_on(scene, row | {"slip_ratio": ratio})
    assert sum("slip = 'set-valued'" in note for note in notes) == len(notes) == told


@pytest.mark.turns
@pytest.mark.parametrize("given", [SOFT, FULL | SOFT | {"lost_blade": 2}])
def test_after_a_run_down_to_standstill_friction_on_a_layer_feeds_nothing(given):
    stop = 1.5e-3
    table = {"speed": 20.0, "speed_table": f"time,speed;0,20;{stop},0"}
    scene = apply_settings(
        named_scene("table2"),
        BASE | given | SLOW | table | {"gap": 2e-5, "duration": 6e-3},
    )
    march, heat = March(resolve(scene)), [0.0]
    while not march.done:
        march.advance(100)
        heat.append(march.history().rubbing.heat)
    history = march.history()
    late = history.friction[history.time >= stop]
    small = 1e-12 * heat[-1]
    assert min(np.diff(heat)) >= -small
    assert np.diff(late).max() <= small
    assert late[-1] < late[0]
    assert abs(history.worn).max() > 0.0
