"""A casing that is not round: its gaps, its work, its certificate, its symmetries."""

import math

import numpy as np
import pytest
from alike import assert_mirrored
from dense_blade import multipliers
from jeffcott import stiff

from hpcwhirl import simulate
from hpcwhirl.analysis.over_speed import spells_of
from hpcwhirl.case.profile import departure, room_of, shape_of
from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.march import March
from hpcwhirl.dynamics.waves.casing import wall_of
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.bodies import tip_rows
from hpcwhirl.scene import apply_settings, named_scene
from hpcwhirl.scene.schemes import NAMES, SCHEMES

HEAD = "harmonic,amplitude,phase"
# harmonics that alias: 22 to 0, 25 to 3, 11 to N / 2, 43 conjugated to 1
SHAPE = f"{HEAD};2,3e-5,0.4;11,3e-6,0.9;22,2e-6,0.7;25,4e-6,0.3;43,1e-6,2"
OFF = {"profile": SHAPE, "offset": 2e-5, "offset_angle": 0.7}
FADED = {"profile_rise": 1e-3, "profile_scale": 4.0, "force": 0.0}
PULSED = "pulsed", {}
SQUEEZED = "squeezed", FADED
RIGID = "rigid", {"kind": "rigid", **FADED}
SPINNING = "spinning", {"rotation": "full", **FADED}
CASES = [PULSED, SQUEEZED, RIGID, SPINNING]


def scene(**settings):
    short = {"duration": 4e-3, "interval": 2e-5, "time_step": 1e-6, "traces": "full"}
    return apply_settings(named_scene("table2"), short | settings)


def march_of(**settings):
    march = March(resolve(scene(**settings)))
    return march, march.run()


def moved(history):
    """Return all tips relative to the largest displacement."""
    return history.tips / np.abs(history.tips).max()


@pytest.mark.turns
@pytest.mark.parametrize("scheme", [n for n in NAMES if not SCHEMES[n].flies])
@pytest.mark.parametrize("lobes", [2, 3])
def test_one_harmonic_is_a_rigid_casing_of_as_many_lobes(scheme, lobes):
    """Bit for bit: -A0 cos k theta by its inputs, or by a table."""
    shared = {"kind": "rigid", "nodal_diameter": lobes, "scheme": scheme}
    lobed = {"amplitude": 3e-4, "rise": 1e-3}
    table = {"profile": f"{HEAD};{lobes},-3e-4,0", "profile_rise": 1e-3}
    (one, a), (two, b) = (march_of(**shared, **own) for own in (lobed, table))
    assert one.lean.model.folds == two.lean.model.folds
    assert a.contacts > 0
    for name in ("tips", "centre", "energy", "fed", "lost", "casing"):
        assert np.array_equal(getattr(a, name), getattr(b, name)), name
    assert a.ledger == b.ledger


@pytest.mark.turns
@pytest.mark.parametrize(("_", "own"), CASES)
def test_schemes_agree_and_the_ledger_closes(_, own):
    runs = {name: march_of(**OFF, **own, scheme=name) for name in NAMES}
    exact = {name for name in NAMES if SCHEMES[name].flies}
    paper = moved(runs["paper"][1])
    for name, (_, history) in runs.items():
        near = 1e-2 if name in exact else 1e-8
        assert np.abs(moved(history) - paper).max() < near
        assert history.contacts > 0
        largest = max(map(abs, history.ledger.values()))
        assert abs(history.ledger["residual"]) < 1e-10 * largest
        assert history.gap_error < 1e-12


def test_the_impact_of_both_flows_is_one_as_the_step_falls():
    """What the shape carries is no impact: both schemes split the work alike."""
    own = {"kind": "rigid", **OFF, **FADED, "time_step": 2.5e-7}
    modal, exact = (march_of(scheme=s, **own)[1].ledger for s in ("modal", "exact"))
    for term in ("impact", "rotation"):
        assert exact[term] == pytest.approx(modal[term], rel=5e-3)


NARROW = {
    "offset": {"offset": 1.4e-4, "offset_angle": 0.63},
    # all blades begin at a crest, where the gap's rate is 0, and touch soon
    "crests": {"profile": f"{HEAD};0,-2.6775e-4,0;15,1.4e-4,0"},
}


@pytest.mark.turns
@pytest.mark.parametrize("rotation", ["none", "full"])
@pytest.mark.parametrize("kind", ["ring", "rigid"])
@pytest.mark.parametrize("shape", NARROW)
def test_flights_end_before_the_shape_touches(shape, kind, rotation):
    """A rotor at rest turns into a narrow place; with jumps and without alike."""
    own = NARROW[shape] | {"force": 0.0, "duration": 2e-3, "profile_rise": 5e-5}
    own |= {"scheme": "exact", "kind": kind, "rotation": rotation, "blades": 5}
    march, flown = march_of(**own)
    stepped = March(resolve(scene(**own)))
    stepped.counter[contact.NEXT_TRY] = np.iinfo(np.int64).max
    walked = stepped.run()
    assert march.counter[contact.JUMPED] > 0 == stepped.counter[contact.JUMPED]
    assert flown.contacts == walked.contacts > 0
    assert np.abs(moved(flown) - moved(walked)).max() < 1e-9
    assert flown.gap_error < 1e-12


@pytest.mark.parametrize(("_", "own"), [PULSED, SQUEEZED, RIGID])
def test_a_shape_turned_by_a_pitch_turns_the_motion(_, own):
    quiet = own | {"force": 0.0, **FADED}  # a pulse stands at theta = 0
    pitch = 2 * math.pi / 22
    turned = f"{HEAD};" + ";".join(
        f"{h},{size},{float(phase) + int(h) * 3 * pitch}"
        for h, size, phase in (row.split(",") for row in SHAPE.split(";")[1:])
    )
    other = {"profile": turned, "offset": 2e-5, "offset_angle": 0.7 + 3 * pitch}
    _, one = march_of(**OFF | quiet)
    _, two = march_of(**other | quiet)
    assert one.contacts == two.contacts > 0
    assert np.abs(np.roll(moved(one), 3, axis=1) - moved(two)).max() < 1e-9


@pytest.mark.turns
@pytest.mark.parametrize("scheme", ["modal", "general"])
def test_a_mirrored_shape_mirrors_the_motion(scheme):
    mirror = f"{HEAD};" + ";".join(
        f"{h},{size},{-float(phase)}"
        for h, size, phase in (row.split(",") for row in SHAPE.split(";")[1:])
    )
    other = {"profile": mirror, "offset": 2e-5, "offset_angle": -0.7}
    _, one = march_of(**OFF, scheme=scheme)
    _, two = march_of(**other, scheme=scheme, speed=-named_scene("table2").speed)
    assert_mirrored(one, two, 1e-8)


@pytest.mark.turns
@pytest.mark.parametrize("scheme", NAMES)
def test_a_harmonic_of_order_0_is_a_wider_gap(scheme):
    own = {"scheme": scheme, "kind": "rigid", "amplitude": 3e-4}
    gap = named_scene("table2").gap
    _, one = march_of(**own, profile=f"{HEAD};0,2e-5,0", gap=gap - 2e-5)
    _, two = march_of(**own)
    assert one.contacts == two.contacts > 0
    assert np.abs(moved(one) - moved(two)).max() < 1e-9


def held_apart(model, gaps):
    """Return the rotor's static displacement that leaves no gap negative."""
    radial = tip_rows(model.rotor, model.blades)[0] / model.rotor.omega
    push = multipliers(gaps, radial @ radial.T)
    amplitudes = -(radial.T @ push) / model.rotor.omega
    return model.rotor.shapes @ amplitudes, push


def test_an_offset_beyond_the_gap_is_the_static_equilibrium_of_the_blades():
    """At rest, without friction: no gap negative, no force at an open one."""
    heavy = {"rotor.damping": 0.7, "suspension_damping": 0.7, "friction": 0.0}
    own = {"kind": "rigid", "speed": 0.0, "offset": 2e-4, "offset_angle": 2.1}
    march, _ = march_of(
        **heavy, **own, profile_rise=0.05, duration=0.2, time_step=1e-5, modes=20
    )
    angles = 2 * math.pi * np.arange(22) / 22
    gaps = march.scene.gap - 2e-4 * np.cos(angles - 2.1)
    still, push = held_apart(march.model, gaps)
    found, _ = march.displacements()
    assert (push > 0.0).sum() >= 2
    assert np.abs(found - still).max() < 1e-6 * np.abs(still).max()
    centre = complex(*found[44:46])
    assert (centre * np.exp(-2.1j)).real < 0.0  # away from the narrow gap


@pytest.mark.turns
def test_a_stiff_rotor_ends_a_gap_off_the_casings_centre():
    """Its axis, e off, is pushed back by e - gap: the offset shifts the rotor."""
    gap, e = 1e-4, 3e-4
    given = stiff(
        40, kind="rigid", unbalance=0.0, friction=0.0, speed=30.0, offset=e,
        offset_angle=1.0, profile_rise=0.02, suspension_damping=0.5, duration=0.1,
        time_step=1e-6, scheme="modal",
    )  # fmt: skip
    history = March(resolve(given)).run()
    z = history.centre @ [1.0, 1j] * np.exp(30.0j * history.time)
    late = z[history.time > 0.08]
    assert np.abs(late + (e - gap) * np.exp(1.0j)).max() < 2e-2 * (e - gap)


def test_the_room_is_the_least_gap_over_all_angles():
    given = scene(**OFF)
    angles = np.random.default_rng(3).uniform(0.0, 2 * math.pi, 200000)
    shape = shape_of(given)
    least = given.gap + float(departure(shape, angles).min())
    assert room_of(given) == pytest.approx(least, abs=1e-9)
    assert room_of(given) <= least
    case = resolve(given)
    assert wall_of(case.model, given).room == room_of(given)


@pytest.mark.parametrize("scheme", ["modal", "exact"])
def test_a_certificate_counts_on_the_least_gap(scheme):
    """It comes later than in a round casing, and what may follow is within it."""
    own = {
        "scheme": scheme,
        "gap": 2.2e-4,
        "duration": 1.2,
        "interval": 1e-2,
        "force": 2e3,
    }
    own |= {"until": "certain"} if scheme == "modal" else {}
    _, plain = march_of(**own)
    _, narrow = march_of(**own, offset=1e-4)
    assert plain.contacts == narrow.contacts == 0
    assert 0.0 < plain.certificate < narrow.certificate
    assert narrow.certificate_reach < 1.2e-4


@pytest.mark.parametrize(
    ("orders", "folds"), [((2, 4), 2), ((2, 3), 1), ((11,), 11), ((22,), 22), ((1,), 1)]
)
def test_sectors_stand_for_all_as_far_as_the_shape_repeats(orders, folds):
    table = f"{HEAD};" + ";".join(f"{h},1e-6,0.2" for h in orders)
    given = scene(profile=table, nodal_diameter=0, force=0.0, kind="rigid")
    assert resolve(given).plan.folds == folds


def test_one_sector_has_the_motion_of_all():
    table = f"{HEAD};2,1.6e-4,0.3;4,2e-5,1;20,1e-5,2"
    own = {"profile": table, "profile_rise": 1e-3, "nodal_diameter": 2}
    own |= {"profile_scale": 2.0}
    for kind in ("ring", "rigid"):
        one, a = march_of(**own, kind=kind)
        two, b = march_of(**own, kind=kind, plan="everything")
        assert (one.lean.model.folds, two.lean.model.folds) == (2, 1)
        assert a.contacts == b.contacts > 0
        assert np.abs(moved(a) - moved(b)).max() < 1e-9
        size = np.abs(b.casing).max()
        assert np.abs(a.casing - b.casing).max() < 1e-8 * size


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        ({"offset": 1.5e-4}, "profile_rise must be >= 5e-05 s"),
        ({"offset": 1.5e-4, "profile_rise": 4e-5}, "profile_rise must be"),
        ({"profile": f"{HEAD};2,-2e-4,0", "kind": "rigid"}, "profile_rise must be"),
        ({"profile": f"{HEAD};150,1e-6,0", "time_step": 1e-4}, "must be <"),
    ],
)
def test_no_shape_jumps_into_the_blades(settings, told):
    with pytest.raises(InputError, match=told):
        March(resolve(scene(**settings)))


def test_a_motion_is_not_continued_in_a_casing_that_is_not_round():
    march, _ = march_of(**OFF, duration=1e-3)
    with pytest.raises(InputError, match="only in a round casing"):
        March(resolve(scene(**OFF)), start=march.motion())


RISING = {
    "traces": "summary", "force": 0.0, "speed": 360.0, "gap": 1.3e-4,
    "profile": f"{HEAD};2,2.2e-4,0", "interval": 1e-3, "accuracy": 0.03,
}  # fmt: skip
RISES = {
    "rises": {"profile_rise": 0.5},
    "is let go": {"profile_scale": 0.5, "profile_release": 0.5, "gap": 2e-4},
    "rigid": {"profile": "", "kind": "rigid", "nodal_diameter": 2, "rise": 0.5,
              "amplitude": 2e-4},
}  # fmt: skip


@pytest.mark.parametrize("name", RISES)
def test_a_casing_that_still_changes_leaves_the_word_open(name):
    """As a pulse does: no blade has met yet the casing that stays."""
    given = RISING | RISES[name]
    early, late = (
        simulate(scene(**given, duration=duration)).row for duration in (0.2, 1.0)
    )
    assert early["load_end"] == late["load_end"] == pytest.approx(0.5, rel=1e-4)
    assert early["regime"] == "undecided"
    assert late["regime"] != "undecided"


def test_windows_before_the_casing_stays_are_open_and_later_ones_are_not():
    """Of a rotor at rest: each window has its own part of the rise."""
    opens = {"gap": 4e-4, "gap_closure": -1e-6, "windows": 10, "plan": "everything"}
    row = simulate(scene(**RISING | opens, profile_rise=0.3, duration=1.0)).row
    first, then = spells_of(row["words_over_speed"])
    assert (first.regime, then.regime, row["regime"]) == (
        "undecided", "damped", "damped",
    )  # fmt: skip
    assert first.end == pytest.approx(0.3)
