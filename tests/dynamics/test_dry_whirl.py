"""Dry-friction backward whirl of a Jeffcott rotor against what is published of it.

A rotor m z'' + c z' + k z = F of one mass inside a round stator, clearance r_0. The tip
that touches stands at the angle phi where the clearance is least; the stator pushes it
inward by N > 0 and friction drags it against the rotation, Omega > 0 anticlockwise:
F = -N (1 + i mu) e^{i phi}. In a steady whirl phi = omega t, and omega < 0 is backward.

**Black (1968)**: the stator moves as a body, by +N (1 + i mu) alpha_s e^{i phi}. What
is between the centres, Z - W, is r_0 long and points at the contact, so that

    -N (1 + i mu) (alpha_r + alpha_s) = r_0,   N > 0,   alpha = 1 / (k - m w^2 + i c w).

**Dry whip in a radial spring** k_b (Lingener 1990, Jiang and Ulbrich 2005): r > r_0
with k' = k_b (1 - r_0 / r), omega^2 = (k + k') / m and mu k' = c |omega|. The friction
of a larger orbit feeds more than is lost, of a smaller one less: it is unstable. There
is none where mu < c sqrt((k + k_b) / m) / k_b.

**The frame**: the stator stands in the static frame and is read at w = omega. Without
rotation terms mass, spring and damper of the rotor are those of the *rotating* frame:
its receptance is read at w = omega - Omega. Published, both are read at omega, and dry
whirl does not know of Omega. Beside a spring without mass the whip's frequency here is
Omega + the published one, and all else is the same; with mass it is nearly so.

The stator is a casing from file, of harmonic 1 (and a harmonic 0 too heavy to breathe);
the rotor two modes of a rigid disk of N tips, or N blades on springs a thousand times
as stiff as the shaft. A polygon of N tips is (pi / N)^2 / 2 short of the circle, 1.4e-3
of r_0 with 60; the step turns the contact by (omega - Omega) dt, 1e-3 at 1e-6 s beside
a friction of 0.1: N of a rigid disk is some 2 % low there, and 1 % at half the step.
"""

import h5py
import numpy as np
import pytest
from scipy.optimize import brentq

from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.bodies.motion import Motion
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.kernels.kernel_types import BodiesState
from hpcwhirl.dynamics.march import March
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.bodies import centre_rows
from hpcwhirl.scene import apply_settings, named_scene
from hpcwhirl.studies.edge import Continued, Tracking, edge_between, moment_of

GAP, OWN, MASS = 1e-4, 583.0, 100.0  # r_0, m; sqrt(k / m), rad/s; m, kg
BLACK = {"rotor_ratio": 0.02, "mass": 2.0, "spring": 4.0, "ratio": 0.05, "along": -1.0}
STIFF = 1000.0  # of k: springs of blades
WHIP = {"rotor_ratio": 0.05, "mass": 0.1, "spring": 25.0, "ratio": 0.0, "along": 0.0}
OUTER, UNSTABLE = 1.618034, 1.0692001  # T7: |omega|, k' and r* of m = k = r_0 = 1
TWIN = {"scheme": "modal", "plan": "everything"}


def engine(path, blades, stator, stiff=0.0):
    """Write a rigid disk, or one with blades on springs of `stiff` k, in a stator."""
    with h5py.File(path, "w") as file:
        if stiff:
            springy(file, blades, stiff, stator["rotor_ratio"])
        else:
            rigid(file, blades, stator["rotor_ratio"])
        amplitude = stator["mass"] ** -0.5
        file["casing/modal_harmonic"] = [0, 1]
        file["casing/modal_omega"] = [OWN, own_of(stator)]
        file["casing/modal_damping_ratio"] = [0.05, stator["ratio"]]
        file["casing/modal_radial"] = [1e-6, amplitude]
        file["casing/modal_tangential"] = [0.0, stator["along"] * amplitude]
    return path


def rigid(file, blades, ratio):
    """Write the two modes of a rigid disk: translations."""
    angle = 2 * np.pi * np.arange(blades) / blades
    file["rotor/omega"] = [OWN, OWN]
    file["rotor/damping_ratio"] = [ratio, ratio]
    radial = np.column_stack([np.cos(angle), np.sin(angle)])
    along = np.column_stack([-np.sin(angle), np.cos(angle)])
    file["rotor/modal_tip_radial"] = radial / MASS**0.5
    file["rotor/modal_tip_tangential"] = along / MASS**0.5
    file["rotor/modal_centre"] = np.eye(2) / MASS**0.5


def springy(file, blades, stiff, ratio):
    """Write matrices of N light blades that springs hold to a disk."""
    tips = np.arange(2 * blades).reshape(blades, 2)
    angle = 2 * np.pi * np.arange(blades) / blades
    to_disk, hub = np.eye(2 * blades + 2), slice(2 * blades, None)
    to_disk[tips[:, 0], hub] = -np.column_stack([np.cos(angle), np.sin(angle)])
    to_disk[tips[:, 1], hub] = -np.column_stack([-np.sin(angle), np.cos(angle)])
    spring, light = MASS * OWN**2, 1e-2 * MASS / blades
    springs = np.diag([stiff * spring] * 2 * blades + [spring] * 2)
    file["rotor/mass"] = np.diag([light] * 2 * blades + [0.99 * MASS] * 2)
    file["rotor/stiffness"] = to_disk.T @ springs @ to_disk
    file["rotor/damping"] = (
        2 * ratio * OWN * np.diag([light] * 2 * blades + [0.99 * MASS] * 2)
    )  # of the mass, which is modal
    file["rotor/tip_radial"], file["rotor/tip_tangential"] = tips.T
    file["rotor/centre"] = [2 * blades, 2 * blades + 1]


def own_of(stator):
    """Return the stator's frequency, rad/s."""
    return OWN * (stator["spring"] * MASS / stator["mass"]) ** 0.5


def receptance(w, mass, own, ratio):
    return 1.0 / (mass * (own**2 - w**2 + 2j * ratio * own * w))


def receptances(w, speed, stator):
    """Return alpha of the rotor in the rotating frame and the stator in the static."""
    rotor = receptance(w - speed, MASS, OWN, stator["rotor_ratio"])
    return rotor, receptance(w, stator["mass"], own_of(stator), stator["ratio"])


def black(friction, speed, stator=BLACK):
    """Return [(omega, N)] of steady backward whirls in the static frame, fastest first.

    The published ones are those at speed 0.
    """

    def joint(w):
        return (1 + 1j * friction) * sum(receptances(w, speed, stator))

    places = np.linspace(-3 * OWN, -0.1 * OWN, 1001)
    signs = np.sign([joint(w).imag for w in places])
    roots = [
        brentq(lambda w: joint(w).imag, places[i], places[i + 1])
        for i in np.flatnonzero(np.diff(signs))
    ]
    return [(w, -GAP / joint(w).real) for w in roots if joint(w).real < 0]


def onset(speed, stator=BLACK):
    """Return the least friction with a steady whirl."""
    low, high = 0.01, 0.3
    while high - low > 1e-5:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if black(middle, speed, stator) else (middle, high)
    return high


def marched(file, blades, **settings):
    base = {
        "blades": blades, "file": str(file), "discretization": "file", "gap": GAP,
        "force": 0.0, "nodal_diameter": 1, "time_step": 2e-6, "interval": 2e-5,
        "traces": "orbit", "scheme": "general", "plan": "everything",
    }  # fmt: skip
    scene = apply_settings(named_scene("table2"), base | settings)
    return March(resolve(scene))


def put(march, rotor, casing):
    """Start with places z, w, m, and turning at rates nu, omega, rad/s, of the bodies.

    rotor : (z, nu), centre, rotating frame; the disk translates
    casing : (w, omega), its harmonic 1, static frame, which is the same at t = 0
    """
    state, step, model = march.state, march.scene.solver.time_step, march.model
    hub = centre_rows(model.rotor, model.blades)[:, :2]  # blades move with the disk
    waves = model.casing.shapes[1:3]  # cos and sin of the harmonic
    found = []
    for rows, (place, rate) in ((hub, rotor), (waves, casing)):
        turn = np.exp(1j * rate * step)
        numbers = place, place - place / turn, place * (turn - 1 / turn) / (2 * step)
        found.append([np.linalg.pinv(rows) @ [z.real, z.imag] for z in numbers])
    (q, d, v), (p, e, u) = found
    if isinstance(state, BodiesState):
        state.q_b[: len(q)], state.d_b[: len(q)] = q, d
        state.q_c[: len(p)], state.d_c[: len(p)] = p, e
        return
    still, moving = (model.rotor.shapes[:, : len(q)] @ part for part in (q, v))
    bodies = still, moving, *(model.casing.shapes @ part for part in (p, u))
    assert march.scheme.begin(Motion(*bodies, 0.0))


def begun_on(file, blades, root, scale=1.0, stator=BLACK, **settings):
    """Return a march that begins on a steady whirl, `scale` times as large."""
    omega, normal = root
    march = marched(file, blades, **settings)
    scene = march.scene
    rotor, casing = receptances(omega, scene.speed, stator)
    push = scale * normal * (1 + 1j * scene.friction)
    along = push if stator["along"] else push.real
    put(march, (-push * rotor, omega - scene.speed), (along * casing, omega))
    return march


def told(history, speed, begin, end):
    """Return (omega, rad/s, static frame; mean N; mean |z|, m) between two times."""
    chosen = (history.time > begin) & (history.time <= end)
    z, time = history.centre[chosen] @ [1, 1j], history.time[chosen]
    turning = np.polyfit(time, np.unwrap(np.angle(z)), 1)[0] + speed
    push = np.ptp(history.impulse[chosen]) / np.ptp(time)
    return turning, push, np.abs(z).mean()


def pushed_off(file, scale, speed):
    """Return the history of a whirl begun `scale` times r* (T7) away, friction 0.1."""
    rate = -OUTER * OWN
    root = rate + speed, OUTER * MASS * OWN**2 * UNSTABLE * GAP
    march = begun_on(
        file, 60, root, scale, WHIP, speed=speed, friction=0.1, duration=0.15,
        time_step=5e-7,
    )  # fmt: skip
    return march.run()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("engines")


@pytest.fixture(scope="module")
def rigid_disk(folder):
    return engine(folder / "rigid.h5", 60, BLACK)


@pytest.fixture(scope="module")
def whip(folder):
    return engine(folder / "whip.h5", 60, WHIP)


@pytest.mark.parametrize("scheme", ["modal", "general", "exact"])
def test_a_rigid_disk_touches_with_fewer_modes_than_blades(rigid_disk, scheme):
    # W of 60 tips has the rank 3: every scheme finds what carries, and closes its books
    pushed = {"force": 2e5, "pulse": 1e-3, "duration": 5e-3, "scheme": scheme}
    march = marched(rigid_disk, 60, speed=100.0, friction=0.1, **pushed)
    found = march.run()
    assert found.stop == "end"
    assert found.contacts > 20
    assert found.gap_error < 1e-14
    assert abs(found.ledger["residual"]) < 1e-10 * found.ledger["pulse"]
    first = marched(rigid_disk, 60, speed=100.0, friction=0.1, **pushed | TWIN).run()
    assert found.contact_impulse == pytest.approx(first.contact_impulse, rel=5e-3)


def test_the_equation_of_dry_whip_is_the_one_that_is_published():
    # m = k = r_0 = 1, c = 0.1 in a stator 0.2, 25, 0.2: what the tests below rely on
    stator = BLACK | {"rotor_ratio": 0.05, "mass": 0.2 * MASS, "spring": 25.0}
    stator["ratio"] = 0.2 / (2 * (25.0 * 0.2) ** 0.5)
    omega, normal = black(0.1, 0.0, stator)[-1]
    assert omega == pytest.approx(-1.687602 * OWN, rel=1e-6)
    assert normal == pytest.approx(1.997273 * MASS * OWN**2 * GAP, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(
    "speed", [100.0, pytest.param(20.0, marks=pytest.mark.evidence)]
)
def test_dry_whip_of_stiff_blades_has_black_s_frequency_and_force(folder, speed):
    # in this program's frame: the published frequency, of any speed, is off by Omega
    file = engine(folder / "stiff.h5", 60, BLACK, STIFF)
    root, published = black(0.1, speed)[0], black(0.1, 0.0)[0]
    given = {"speed": speed, "friction": 0.1, "time_step": 1e-6, "duration": 0.12}
    history = begun_on(file, 60, root, **given).run()
    omega, normal, _ = told(history, speed, 0.06, 0.12)
    assert omega == pytest.approx(root[0], rel=2e-3)
    assert normal == pytest.approx(root[1], rel=0.01)
    assert omega - published[0] == pytest.approx(speed, rel=0.2)


@pytest.mark.slow
@pytest.mark.parametrize("scale", [0.97, 1.03])
def test_dry_whip_of_a_rigid_disk_comes_to_black_s_orbit_from_both_sides(
    rigid_disk, scale
):
    root = black(0.2, 100.0)[0]
    given = {"speed": 100.0, "friction": 0.2, "duration": 0.15, "time_step": 1e-6}
    history = begun_on(rigid_disk, 60, root, scale, **given).run()
    omega, normal, _ = told(history, 100.0, 0.1, 0.15)
    assert omega == pytest.approx(root[0], rel=2e-3)
    assert normal == pytest.approx(root[1], rel=0.02)


@pytest.mark.turns
def test_the_slower_of_black_s_orbits_is_unstable(rigid_disk):
    # from below contact is lost, from above it goes over to the faster one
    slow = black(0.1, 100.0)[-1]
    given = {"speed": 100.0, "friction": 0.1, "duration": 0.15}
    below, above = (
        begun_on(rigid_disk, 60, slow, scale, **given).run() for scale in (0.97, 1.03)
    )
    assert told(below, 100.0, 0.0, 0.003)[0] == pytest.approx(slow[0], rel=0.06)
    assert below.last_contact < 0.1
    assert told(above, 100.0, 0.1, 0.15)[1] > 2.0 * slow[1]


@pytest.mark.slow
def test_dry_whip_begins_at_black_s_friction(rigid_disk):
    least, ends = onset(100.0), {}
    root = black(1.1 * least, 100.0)[0]
    for share in (0.85, 1.1):
        given = {"speed": 100.0, "friction": share * least, "duration": 0.5}
        ends[share] = begun_on(rigid_disk, 60, root, **given).run()
    assert ends[0.85].last_contact < 0.45
    omega, normal, _ = told(ends[1.1], 100.0, 0.4, 0.5)
    assert omega == pytest.approx(root[0], rel=0.03)
    assert normal == pytest.approx(root[1], rel=0.15)


def continued(file, **settings):
    """Return motions of a whip, and two states far from its orbit, left and right."""
    given = {"friction": 0.1, "duration": 0.45, "traces": "summary"} | settings
    given |= {"scheme": "modal", "speed": 100.0, "time_step": 1e-6, "until": "certain"}
    states, march = [], None
    for place, rate in ((0.5 * GAP, -OWN), (3.0 * GAP, -3.0 * OWN)):
        march = marched(file, 60, **given)
        march.unfold()
        put(march, (place, rate - 100.0), (0j, 0.0))
        march.state.ledger[contact.PULSE] += march.history().ledger["residual"]
        march.advance(2)
        states.append(moment_of(march))
    return Continued(march, 0.05), tuple(states)


@pytest.mark.slow
def test_the_unstable_orbit_of_dry_whip_is_the_motion_on_the_edge(whip):
    # begun at 0.5 and 3 r_0, turning at -1 and -3 sqrt(k / m): far from its orbit
    motions, ends = continued(whip)
    found = edge_between(motions, ends, Tracking(span=0.12, near=1e-3, far=3e-2))
    assert (found.low.word, found.high.word) == ("damped", "divergent")
    assert found.numbers["orbit_radius"] == pytest.approx(UNSTABLE * GAP, rel=0.01)
    turning = found.numbers["turning_rate"] - 100.0
    assert turning == pytest.approx(-OUTER * OWN, rel=0.01)
    assert abs(found.numbers["orbit_change"]) < 2e-3
    assert found.numbers["contact_share"] > 0.99
    assert found.numbers["leaving_rate"] > 50.0
    assert found.low.radius[-1] < 0.4 * GAP
    left = found.high.radius > 1.01 * UNSTABLE * GAP
    assert (np.diff(found.high.radius[left]) > 0.0).all()
    assert found.high.radius[-1] > 1.1 * UNSTABLE * GAP


def test_below_the_published_friction_there_is_no_edge(whip):
    motions, ends = continued(whip, friction=0.9 * 0.1 * 26**0.5 / 25.0)
    with pytest.raises(InputError, match=r"^no edge: two states .* same word, damped$"):
        edge_between(motions, ends)


@pytest.mark.evidence  # tracked, it is found by the test before
@pytest.mark.slow
@pytest.mark.parametrize("speed", [100.0, 300.0])
def test_the_unstable_orbit_of_dry_whip_is_found_by_bisection(whip, speed):
    # r* / r_0 = 1.0692001: below it decays, above it grows
    low, high = 0.9, 1.1
    while high - low > 1e-3:
        middle = 0.5 * (low + high)
        grew = pushed_off(whip, middle, speed).centre_peak > 2 * GAP
        low, high = (low, middle) if grew else (middle, high)
    assert 0.5 * (low + high) == pytest.approx(1.0, abs=5e-3)
    near = pushed_off(whip, low, speed)
    assert near.last_contact < 0.1
    omega, normal, _ = told(near, speed, 0.0, 5e-3)
    assert omega == pytest.approx(speed - OUTER * OWN, abs=1e-2 * OWN)
    assert normal == pytest.approx(OUTER * MASS * OWN**2 * UNSTABLE * GAP, rel=0.02)


@pytest.mark.slow
def test_dry_whip_in_a_spring_begins_at_the_published_friction(whip):
    # mu = c sqrt((k + k_b) / m) / k_b is that of an infinite orbit; of 40 r_0 it is
    # c sqrt((k + k') / m) / k'
    spring = WHIP["spring"] * (1 - 1 / 40.0)
    least = 2 * WHIP["rotor_ratio"] * (1 + spring) ** 0.5 / spring
    assert least == pytest.approx(0.1 * 26**0.5 / 25.0, rel=0.02)
    root = 100.0 - (1 + spring) ** 0.5 * OWN, spring * MASS * OWN**2 * 40.0 * GAP
    grown = []
    for share in (0.95, 1.05):
        given = {"speed": 100.0, "friction": share * least, "duration": 0.03}
        history = begun_on(whip, 60, root, 1.0, WHIP, **given).run()
        first, last = (told(history, 100.0, a, a + 5e-3)[2] for a in (5e-3, 0.025))
        grown.append(last / first)
    assert grown[0] < 1.0 < grown[1]
