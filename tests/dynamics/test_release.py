"""A casing that is held deformed and let go."""

import numpy as np
import pytest
from alike import assert_same_in_parts

from hpcwhirl.case.profile import departure, held_shape, profile_of
from hpcwhirl.case.resolve import resolve
from hpcwhirl.case.speed import USUAL
from hpcwhirl.dynamics.bodies.motion import Motion
from hpcwhirl.dynamics.bodies.timestep import recursion
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.march import March
from hpcwhirl.dynamics.side_by_side import SideBySide, copy_of, put_between
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.waves import tip_growth
from hpcwhirl.scene import Scene, apply_settings, named_scene

pytestmark = pytest.mark.turns

HEAD = "harmonic,amplitude,phase"
OVAL = f"{HEAD};0,8e-5,0;2,9e-5,0.4;3,5e-5,1.1;5,2e-5,2"
STEP, AT = 1e-6, 1501  # s, the step of the release: an odd one
HELD = {
    "time_step": STEP, "duration": 6e-3, "interval": 1e-5, "traces": "full",
    "force": 0.0, "profile": OVAL, "profile_release": AT * STEP,
}  # fmt: skip
CLEAR, TIGHT = {"gap": 2e-3}, {"gap": 1.1e-4, "offset": 1e-5}
KINDS = {
    "cyclic": {},
    "folded": {"profile": f"{HEAD};0,8e-5,0;2,9e-5,0.4"},
    "general": {"scheme": "general"},
    "paper": {"scheme": "paper"},
    "unequal": {"mistuning": [0.03 * float(np.sin(7.0 * j)) for j in range(22)]},
    "full": {"rotation": "full"},
    "run-up": {"acceleration": 200.0},
    "elements": {"casing.discretization": "elements", "casing.elements": 44},
    "shell": {"casing.discretization": "shell"},
}


def march_of(**settings):
    return March(resolve(apply_settings(named_scene("table2"), HELD | settings)))


def held_by(march):
    """Return the modal amplitudes, (m,), from which a casing swings."""
    body = march.model.casing
    shape = held_shape(march.model, march.scene)
    return shape.amplitudes(body.omega, body.shapes)


def held_in(march):
    """Return the displacement, (c,), m, from which a casing swings."""
    return march.model.casing.shapes @ held_by(march)


def swing_of(march, times):
    """Return (n, H + 1, 2), m: each mode a damped cosine from rest, by its recursion.

    q_n = Re A z^n, z^2 - (1 + keep - pull) z + keep = 0, q_1 = q_-1.
    """
    body, ring = march.model.casing, march.model.ring
    keep, pull, _ = recursion(body.omega, body.ratios, STEP)
    half = (1.0 + keep - pull) / 2
    z = half + 1j * np.sqrt(keep - half**2)
    turned = z - 1.0 / z  # Re A = q, Re A (z - 1 / z) = 0
    amplitude = held_by(march) * (1.0 + 1j * turned.real / turned.imag)
    steps = np.rint(np.asarray(times) / STEP).astype(int) - AT
    moved = (amplitude * z ** steps[:, None]).real
    out = np.tensordot(moved, ring.waves() @ body.shapes, (1, 2))
    return out * (steps > 0)[:, None, None]


@pytest.mark.parametrize(
    ("kind", "off"), [("cyclic", 1e-12), ("shell", 1e-12), ("elements", 1e-4)]
)
def test_the_displacement_is_the_profile(kind, off):
    march = march_of(**CLEAR, **KINDS[kind])
    angles = np.linspace(0.0, 6.0, 50)
    x = held_in(march)
    found = march.model.ring.rows(angles)[0] @ x
    want = departure(profile_of(march.scene), angles)
    assert np.abs(found - want).max() < off * np.abs(want).max()


@pytest.mark.parametrize("kind", KINDS)
def test_a_casing_let_go_swings_as_damped_cosines(kind):
    march = march_of(**CLEAR, **KINDS[kind])
    history = march.run()
    want = swing_of(march, history.time)
    assert history.contacts == 0
    assert (history.casing[history.time < AT * STEP] == 0.0).all()
    near = USUAL if kind == "run-up" else 1e-9  # by lines, of the angle of the rotor
    assert np.abs(history.casing - want).max() < near * np.abs(want).max()
    strain = 0.5 * float(((march.model.casing.omega * held_by(march)) ** 2).sum())
    assert history.ledger["pulse"] == pytest.approx(strain, rel=1e-3)


@pytest.mark.parametrize("kind", KINDS)
def test_the_ledger_closes_and_slices_change_no_bit(kind):
    case = march_of(**TIGHT | KINDS[kind] | {"duration": 4e-3}).case
    for before in (AT - 1, AT, AT + 1) if kind == "cyclic" else (AT,):
        march = assert_same_in_parts(case, before - 7, 7, 10**9, anew=True)
    history = march.history()
    assert history.contacts > 0
    assert history.last_contact > AT * STEP
    largest = max(map(abs, history.ledger.values()))
    assert abs(history.ledger["residual"]) < 1e-10 * largest
    assert history.gap_error < 1e-12


@pytest.mark.parametrize("kind", ["cyclic", "general"])
def test_what_goes_on_from_a_state_has_the_casing_of_that_state(kind):
    given = TIGHT | KINDS[kind] | {"duration": 3e-3, "force": 4e5}
    march, longer = march_of(**given), march_of(**given | {"duration": 5e-3})
    march.reach(AT - 1000)
    held, touched = copy_of(march), [march.counter[contact.TOUCHED]]
    march.reach(AT)
    touched.append(march.counter[contact.TOUCHED])
    march.reach(march.total)
    ends = march.displacements()
    put_between(march, held, held, 0.0)
    march.reach(march.total)
    twins = SideBySide(march, 1e-3, 2e-3, 1e-9)
    touched.append(march.counter[contact.TOUCHED])
    twins.advance()
    touched.append(twins.one.counter[contact.TOUCHED])
    assert (np.diff(touched) > 0).all()  # each part has contact
    longer.reach(twins.one.steps)
    pairs = (march.displacements(), ends), (twins.one.displacements(),
                                            longer.displacements())  # fmt: skip
    for own, other in pairs:
        assert all(map(np.array_equal, own, other))


@pytest.mark.parametrize("kind", ["cyclic", "paper"])
def test_a_release_is_the_start_of_a_displaced_casing(kind):
    given = KINDS[kind] | {"gap": 1.1e-4, "speed": 0.0, "duration": 4e-3}
    march = march_of(**given)
    history = march.run()
    x = held_in(march)
    rotor = np.zeros(len(march.model.rotor.shapes))
    round_ = {"profile": "", "profile_release": 0.0, "duration": 4e-3 - AT * STEP}
    free = resolve(apply_settings(named_scene("table2"), HELD | given | round_))
    begun = March(free, Motion(rotor, rotor, x, 0.0 * x))
    other = begun.run()
    assert history.contacts == other.contacts > 0
    size = np.abs(begun.motion().rotor).max()
    assert np.abs(march.motion().rotor - begun.motion().rotor).max() < 1e-9 * size


@pytest.mark.parametrize("rate", [0.0, 200.0])
def test_every_law_at_once_closes_the_ledger(rate):
    given = {
        "rotation": "full", "gap_at": "rest", "gap": 6e-4, "speed": 300.0,
        "duration": 0.02, "time_step": 8e-6, "offset": 5e-5, "gap_closure": 1e-4,
        "gap_time": 0.02, "profile_release": 0.01, "acceleration": rate,
        "traces": "summary", "profile": f"{HEAD};2,1e-4,0.4", "force": 75e3,
    }  # fmt: skip
    march = March(resolve(apply_settings(Scene(), given)))
    history = march.run()
    grown = tip_growth(march.model.rotor, march.model.blades, 300.0).max()
    assert march.schedule.gap(0.0) == pytest.approx(6e-4 - grown, rel=1e-9)
    assert history.contacts > 0
    largest = max(map(abs, history.ledger.values()))
    assert abs(history.ledger["residual"]) < 1e-10 * largest
    assert history.gap_error < 1e-12


def test_a_certificate_waits_for_the_release_and_counts_the_swing():
    given = {"speed": 200.0, "duration": 0.3, "traces": "summary", "interval": 1e-3,
             "time_step": 4e-6, "profile_release": 0.02, "force": 1.0}  # fmt: skip
    near = march_of(**given, gap=1.3e-4)
    history = near.run()
    assert history.last_contact > 0.02
    wide = march_of(**given, gap=4e-4).run()
    assert wide.contacts == 0
    assert wide.certificate > 0.02


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        (
            {
                "casing.discretization": "elements",
                "casing.elements": 44,
                "profile": f"{HEAD};22,1e-5,0",
            },
            "in which the casing cannot swing: 22",
        ),
        ({"profile": f"{HEAD};21,1e-5,0"}, "in which the casing cannot swing: 21"),
    ],
)
def test_what_cannot_be_let_go_is_refused_in_one_line(settings, told):
    with pytest.raises(InputError) as refused:
        march_of(**{"gap": 1e-3} | settings)
    assert told in str(refused.value)
    assert "\n" not in str(refused.value)
