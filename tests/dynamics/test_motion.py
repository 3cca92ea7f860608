"""A motion that is read and begun again goes on: the laws of `bodies.motion`."""

import numpy as np
import pytest

from hpcwhirl.case.resolve import Case, resolve
from hpcwhirl.case.unbalance import circle
from hpcwhirl.dynamics.bodies.motion import Motion, turned
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.march import March
from hpcwhirl.errors import InputError
from hpcwhirl.scene import apply_settings, named_scene

ROUND_OFF = 1e-11  # relative; 1e-14 to 1e-12 are found, 4e-11 of elements in `paper`
UNEVEN = {"mistuning": [0.01, 0.0, -0.02, 0.03, 0.0, 0.01, 0.0]}
ENGINES = {
    "even": {},
    "rigid": {"kind": "rigid"},
    "uneven": UNEVEN,
    "uneven, rigid": UNEVEN | {"kind": "rigid"},
    "elements": {"discretization": "elements"},
    "unbalanced": {"rotation": "full", "unbalance": 1e-4},
    "uneven, unbalanced": UNEVEN | {"rotation": "full", "unbalance": 1e-4},
}
MARCHED = {
    "modal": ENGINES, "exact": {"even", "rigid", "unbalanced"},
    "general": {"elements", "uneven, rigid", "unbalanced"},
    "paper": {"even", "elements", "uneven, unbalanced"},
}  # fmt: skip
LEAST = [("none", "rigid"), ("none", "uneven, rigid"), ("full", "rigid")]
CASES = [
    ({"scheme": scheme, "rotation": rotation} | engine)
    for scheme in ("modal", "exact", "general", "paper")
    for rotation in ("none", "full")
    for name, engine in ENGINES.items()
    if name in MARCHED[scheme]
    if (rotation == "full" or "unbalance" not in engine)
    if (rotation, name) not in LEAST
]


def case_of(**settings):
    quiet = {
        "blades": 7, "nodal_diameter": 2, "gap": 0.05, "force": 0.0, "pulse": 1e-3,
        "duration": 1e-3, "traces": "summary", "plan": "everything",
    }  # fmt: skip
    return resolve(apply_settings(named_scene("table2"), quiet | settings))


def drawn(case, size=1e-4, seed=3):
    """Return a motion with about the same energy in each mode, from the circle."""
    rng, model = np.random.default_rng(seed), case.model

    def of(body):
        if body is None:
            return np.zeros(0), np.zeros(0)
        each = rng.normal(size=(2, len(body.omega))) * size
        q = each[0] / np.maximum(body.omega, 1.0)
        return body.shapes @ q, body.shapes @ each[1]

    motion, steady = Motion(*of(model.rotor), *of(model.casing)), None
    if case.scene.unbalance:
        steady = circle(model, case.scene)
    return motion if steady is None else motion._replace(rotor=motion.rotor + steady)


def apart(case, true, found):
    """Return the largest difference of two motions, seen from found's rotor, relative.

    A motion that began turned lags behind by the angle it was turned by.
    """
    true = turned(case.model, true._replace(angle=true.angle - found.angle))
    pairs = [pair for pair in zip(true[:4], found[:4], strict=True) if len(pair[0])]
    return max(np.abs(a - b).max() / np.abs(a).max() for a, b in pairs)


def lasting(case, steps):
    """Return the case with a run of so many steps."""
    settings = {"duration": steps * case.step}
    return Case(apply_settings(case.given, settings), case.own)


def residual(march):
    ledger = march.history().ledger
    return abs(ledger["residual"]) / max(ledger["energy"], ledger["pulse"])


@pytest.mark.turns
@pytest.mark.parametrize("settings", CASES, ids=str)
def test_a_free_motion_that_is_begun_again_is_the_uninterrupted_one(settings):
    case = case_of(**settings)
    start = drawn(case)
    once, first = March(case, start), March(case, start)
    assert apart(case, start, first.motion()) < ROUND_OFF
    first.reach(first.total // 2 + 1)  # an odd and an even number of steps
    left = first.total - first.steps
    again = March(lasting(case, left), first.motion())
    assert again.total == left
    again.reach(left)
    once.reach(once.total)
    assert again.history().contacts == once.history().contacts == 0
    assert apart(case, once.motion(), again.motion()) < 10 * ROUND_OFF
    assert residual(again) < 10 * ROUND_OFF


ROUND = [given for given in CASES if "discretization" not in given]


@pytest.mark.turns
@pytest.mark.parametrize("settings", ROUND, ids=str)
def test_a_motion_that_is_begun_again_meets_the_casing_as_before(settings):
    start = drawn(case_of(**settings), 1e-2)  # of elements blades would meet others
    reach = float(start.rotor[0:14:2].max())
    case = case_of(**settings, gap=0.9 * reach, duration=5e-3)
    march = March(case, start)
    march.counter[contact.NEXT_TRY] = 10**9  # no flights, whose ends differ
    while march.counter[contact.LAST] < max(march.steps, 40):
        march.advance(1)
        assert not march.done
    begun, touched = march.steps, int(march.counter[contact.TOUCHED])
    again = March(case, march.motion())
    again.counter[contact.NEXT_TRY] = 10**9
    while march.counter[contact.TOUCHED] < touched + 5:
        march.advance(1)
        again.advance(1)
        assert not march.done
    assert again.steps == march.steps - begun
    assert again.counter[contact.TOUCHED] == 5
    assert apart(case, march.motion(), again.motion()) < 1e-7
    assert residual(again) < 1e-10


def test_one_sector_goes_on_alone_where_the_motion_repeats_and_else_does_not():
    pulse = {"force": 3e5, "plan": "lean", "gap": 1.28e-4, "blades": 8}
    march = March(case_of(**pulse))
    assert march.lean.model.folds == 2
    march.reach(march.total)
    assert march.history().contacts > 0
    case = case_of(**(pulse | {"force": 0.0}))
    again = March(case, march.motion())
    assert again.lean.model.folds == 2
    start = march.motion()
    apart_now = again.motion()._replace(angle=0.0)
    for true, found in zip(turned(case.model, start)[:4], apart_now[:4], strict=True):
        assert found == pytest.approx(true, rel=1e-9, abs=1e-9 * np.abs(true).max())
    tip = start.rotor + 1e-6 * (np.arange(len(start.rotor)) == 0)
    alone = March(case, start._replace(rotor=tip))
    assert alone.lean.model.folds == 1
    assert alone.scheme.balance(alone.state).energy > 0.0


@pytest.mark.parametrize(
    "change", [{"speed": 400.0}, {"gap": 0.04}, {"engine.rotor.young": 2e11}]
)
def test_a_motion_goes_on_at_other_inputs_with_its_places_and_velocities(change):
    march = March(case_of(rotation="full"), drawn(case_of(rotation="full")))
    march.reach(march.total)
    start = turned(march.model, march.motion())
    again = March(case_of(rotation="full", **change), march.motion())
    for true, found in zip(start[:4], again.motion()[:4], strict=True):
        assert found == pytest.approx(true, rel=1e-9, abs=1e-9 * np.abs(true).max())


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"blades": 8}, "same number of coordinates: it has"),
        ({"kind": "rigid", "amplitude": 1e-5}, "amplitude must be 0 m"),
        ({"rotation": "full", "stiffness_difference": 1e6}, "alike in x and y"),
    ],
)
def test_what_a_motion_cannot_go_on_in_is_refused(settings, words):
    start = drawn(case_of())
    with pytest.raises(InputError, match=words):
        March(case_of(**settings), start)


@pytest.mark.parametrize("by", ["fourier", "elements"])
def test_a_turned_casing_meets_the_blades_at_the_same_places(by):
    case = case_of(discretization=by, **{"casing.elements": 20})
    start, pitch = drawn(case), 2 * np.pi / 20
    angle = 3 * pitch if by == "elements" else 1.234  # a node on another
    found = turned(case.model, start._replace(angle=angle))
    rows, blades = case.model.ring.rows, pitch * np.arange(7)
    for there, here in zip(rows(blades + angle), rows(blades), strict=True):
        assert here @ found.casing == pytest.approx(there @ start.casing, abs=1e-15)
        assert here @ found.casing_velocity == pytest.approx(
            there @ start.casing_velocity, rel=1e-9, abs=1e-12
        )
    assert found.angle == 0.0
