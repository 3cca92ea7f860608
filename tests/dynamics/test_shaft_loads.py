"""Loads of a shaft read from the motion: forces of supports, torque of the drive."""

import numpy as np
import pytest
from scenes import BASE, Scenes, shaft

from hpcwhirl.analysis.response import moving_mass
from hpcwhirl.case.resolve import resolve
from hpcwhirl.case.speed import angle_at, speed_at
from hpcwhirl.dynamics.bodies.operators import friction_with_sign
from hpcwhirl.dynamics.march import March
from hpcwhirl.dynamics.snapshot import restore, snapshot
from hpcwhirl.reduction.bodies import whole_basis_of
from hpcwhirl.reduction.steady import translation
from hpcwhirl.scene import apply_settings, named_scene
from hpcwhirl.structure import bladed_disk

READ = {"output.forces": "supports"}
MOMENTUM = [
    "equal", "rotation", "unbalance", "unequal", "weight, unequal",
    "cross-coupling", "film", "unlike supports, unbalance", "bearing", "tilt",
    "shaft", "shaft, film, supports apart", "weight, shaft, films",
    "lost blade, shaft, supports apart", "lost blade later", "run-up, rotation",
    "run-up, rotation, shaft", "weight, shaft, films; bearings",
]  # fmt: skip
BEARINGS = shaft(
    {"station": 0, "kxx": 4e6, "journal_viscosity": 0.02, "journal_length": 0.04,
     "journal_radius": 0.05, "journal_clearance": 1e-4},
    {"station": 2, "kxx": 4e6, "cxx": 2e3, "rolling_stiffness": 1e10,
     "rolling_balls": 7, "rolling_clearance": 2e-5, "rolling_cage": 0.42},
)  # fmt: skip


@pytest.fixture(scope="module")
def scenes(tmp_path_factory):
    return Scenes(tmp_path_factory.mktemp("scenes"))


def momentum_of(march):
    """Return M V of the rotor's centre of mass, kg m/s; static frame with rotation."""
    now, shaft, scene = march.motion(), march.shaft, march.scene
    time = march.steps * scene.solver.time_step
    speed, turn = float(speed_at(scene, time)), np.exp(1j * angle_at(scene, time))
    if march.model.rotor.spin is None:
        return shaft.moment @ now.rotor_velocity
    place = shaft.moment @ now.rotor + shaft.eccentricity
    return (shaft.moment @ now.rotor_velocity + 1j * speed * place) * turn


def by_contact(history, angles, march):
    """Return the impulses of contact on the rotor between samples, N s, complex."""
    pushed = np.diff(history.blade_impulse, axis=0, prepend=0.0)
    around = 2 * np.pi * np.arange(pushed.shape[1]) / pushed.shape[1]
    way = np.exp(1j * (angles[:, None] + around))
    return -(pushed * (1 + 1j * friction_with_sign(march.scene)) * way).sum(axis=1)


@pytest.mark.turns
@pytest.mark.parametrize("name", MOMENTUM)
def test_supports_contact_and_weight_move_the_centre_of_mass(scenes, name):
    """Their impulses between samples are the changes of the rotor's momentum."""
    more = READ | {"interval": 1e-5, "duration": 2.6e-3, "shaft_modes": 40}
    name, _, bearings = name.partition("; ")
    march = scenes.march(name, "modal", **more | (BEARINGS if bearings else {}))
    step = march.scene.solver.time_step
    momentum, lost = [momentum_of(march)], march.lost_at // march.every - 1
    while not march.done:
        march.advance(march.every)
        momentum.append(momentum_of(march))
    history, names = march.history(), march.shaft.names
    time = np.append(0.0, history.shaft.time)
    angles = np.asarray(angle_at(march.scene, time))
    on_shaft = [not one.startswith("pedestal") for one in names]
    every = march.loads[:, : 2 * len(names)].reshape(len(time), -1, 2) @ [1, 1j]
    force = every[:, on_shaft].sum(axis=1)
    between = (angles[1:] + angles[:-1]) / 2
    if march.model.rotor.spin is None:  # its momentum is that of the rotating frame
        force, between = force * np.exp(-1j * angles), 0.0 * between
    span = march.every * step
    pulled = march.shaft.gravity and march.shaft.gravity * moving_mass(march.scene)
    held = (force[1:] + force[:-1]) / 2 * span + pulled * span
    given = held + by_contact(history, between, march)
    miss = np.diff(momentum) - given
    if lost >= 0:  # in which the blade takes its momentum with it
        miss[lost] = 0.0
    size = np.abs(np.cumsum(held)).max()
    assert np.abs(np.cumsum(given - held)).max() > 0.1 * size
    assert np.abs(np.cumsum(miss)).max() <= 5e-3 * size


def drawn(seed):
    """Return a small engine of which all modes are kept, drawn with a seed."""
    r = np.random.default_rng(seed)
    blades = int(r.integers(3, 7))
    given = BASE | READ | {
        "blades": blades, "rotor.elements": 2, "modes": 7 * blades, "harmonics": 4,
        "time_step": 1e-6, "duration": 2.4e-3, "interval": 3e-6, "traces": "summary",
        "gap": 2e-5, "force": 2e5,
        "speed": r.uniform(200.0, 500.0), "friction": r.uniform(0.05, 0.3),
        "rotor.damping": 0.01, "nodal_diameter": 1,
    }  # fmt: skip
    full = {"rotation": "full", "unbalance": r.uniform(0.0, 5e-3)}
    kinds = (
        {}, full, full | {"lost_blade": 1}, full | {"acceleration": 3e4},
        full | {"lost_blade": 1, "lost_blade_time": 8.4e-4},
    )  # fmt: skip
    return apply_settings(named_scene("table2"), given | kinds[seed % len(kinds)])


def blocked_by(march):
    """Return rows of x and x' that give the moment at the centre's blocked rotation.

    It is -theta (K x + D x'), N m, theta a rotation of the whole disk, of which K is
    not reduced.
    """
    before = march.case.before if march.later else None
    scene, model = (
        (before.scene, before.model) if before else (march.scene, march.model)
    )
    rotor, body = scene.engine.rotor, model.rotor
    turned = np.zeros((rotor.elements + 1, 3))
    radii = np.linspace(rotor.disk_radius, rotor.radius, rotor.elements + 1)
    turned[:, 1], turned[:, 2] = radii, 1.0
    theta = np.append(np.tile(turned.ravel(), rotor.blades), [0.0, 0.0])
    whole = rotor.model_copy(update={"lost_blade": -1})
    rotation = "none" if body.spin is None else "full"
    basis = whole_basis_of(whole, scene.solver.modes, rotation)
    if body.into_whole is not None:
        basis = basis @ body.into_whole
    swing = march.shaft.swing
    lost = swing @ np.linalg.solve(body.mass, body.damping_matrix())
    return -theta @ bladed_disk(rotor).stiffness @ basis, -lost


@pytest.mark.turns
@pytest.mark.parametrize("seed", range(5))
def test_the_drive_gives_the_moment_at_the_blocked_rotation_of_the_centre(seed):
    """The balance of the angular momentum agrees with the disk's elastic forces."""
    march = March(resolve(drawn(seed)))
    later, rows, found, square = march.later, blocked_by(march), [], []
    while True:
        now, shaft = march.motion(), march.shaft
        x, v = now.rotor, now.rotor_velocity
        found.append(float(rows[0] @ x + rows[1] @ v))
        linear = shaft.swing @ v
        if shaft.coriolis is not None:
            linear += 2 * speed_of(march) * (shaft.load @ x)
        whole = momentum(shaft, x, v, speed_of(march))
        square.append(whole - linear - shaft.inertia * speed_of(march))
        if march.done:
            break
        march.advance(march.every)
        if march.later is not later:  # whose first-order loads are other ones
            later, rows, found, square = march.later, blocked_by(march), [], []
    history, span = march.history(), march.every * march.scene.solver.time_step
    assert history.contacts > 0
    count = len(found) - 1
    outer = march.loads[-count - 1 :, -2]
    given = history.shaft.torque[-count:] + (outer[1:] + outer[:-1]) / 2
    own = np.cumsum(given * span - np.diff(square))
    torque = np.array(found)
    between = np.cumsum((torque[1:] + torque[:-1]) / 2) * span
    size = np.abs(between).max()
    assert size > 0.0
    assert np.abs(own - between).max() <= 2e-2 * size


def momentum(shaft, x, v, speed):
    return float(shaft.angular_momenta(x[None], v[None], np.array([speed]))[0])


def speed_of(march):
    return float(speed_at(march.scene, march.steps * march.scene.solver.time_step))


@pytest.mark.parametrize("name", ["rotation", "unequal, rotation"])
def test_a_translation_has_the_angular_momentum_of_a_point_mass(scenes, name):
    """M Im(conj(z) z') + Omega M |z|^2, of the whole rotor's mass M."""
    march = scenes.march(name, "modal", **READ)
    shaft, body = march.shaft, march.model.rotor
    t, speed = translation(body, march.model.blades), march.scene.speed
    z, rate = 3e-4 - 2e-4j, 0.1 + 0.3j
    x, v = ((t.conj() * one).real for one in (z, rate))
    mass = float((t.conj() @ body.mass @ t).real) / 2
    found = momentum(shaft, x, v, speed) - shaft.inertia * speed
    point = (z.conjugate() * rate).imag + speed * abs(z) ** 2
    assert found == pytest.approx(mass * point, rel=1e-9)


@pytest.mark.turns
@pytest.mark.parametrize(
    ("name", "scheme", "more"),
    [
        ("rotation", "exact", {}),
        ("fold", "modal", {"gap": 6e-4, "duration": 0.02}),
        ("lost blade later", "modal", {}),
        ("shaft, film, supports apart", "general", {}),
    ],
)
def test_reading_changes_no_motion_and_goes_on_elsewhere(scenes, name, scheme, more):
    own = READ | {"interval": 3e-5} | more
    plain = scenes.march(name, scheme, **own | {"output.forces": "none"}).run()
    whole, first, second = (scenes.march(name, scheme, **own) for _ in range(3))
    truth = whole.run()
    assert np.array_equal(truth.judged.centre, plain.judged.centre)
    assert truth.steps == plain.steps
    first.advance(777)
    saved = {key: array.copy() for key, array in snapshot(first).items()}
    assert restore(second, saved)
    found = second.run().shaft
    assert np.array_equal(found.force, truth.shaft.force)
    assert np.array_equal(found.torque, truth.shaft.torque)


@pytest.mark.turns
def test_a_scheme_that_jumps_and_a_closed_form_read_the_same_forces(scenes):
    """Samples within a jump, and after a certificate, are those of steps."""
    more = READ | {"interval": 3e-5, "duration": 0.02, "gap": 6e-4}
    certain = scenes.march("fold", "modal", **more).run()
    steps = scenes.march("fold", "modal", **more, plan="everything").run()
    jumps = scenes.march("fold", "exact", **more).run()
    assert 0.0 < certain.certificate < 0.015
    size = np.abs(steps.shaft.force).max()
    assert np.abs(certain.shaft.force - steps.shaft.force).max() <= 1e-9 * size
    assert np.abs(jumps.shaft.force - steps.shaft.force).max() <= 2e-3 * size
