"""Chaos of sustained cases: asked for, measured, kept, and the same after any stop."""

import math
import tomllib

import h5py
import numpy as np
import pytest
from deaths import even_slices

import hpcwhirl
from hpcwhirl.analysis.chaos import (
    DELTA,
    exponent,
    growths,
    numbers_of,
    returns,
    section_of,
    twins_of,
    zero_one,
)
from hpcwhirl.analysis.regimes import all_thresholds
from hpcwhirl.analysis.rules import motion_of
from hpcwhirl.campaign.compute import Checkpoints, LateError, compute
from hpcwhirl.campaign.plan.design import design_of
from hpcwhirl.campaign.simulate import Course, simulate
from hpcwhirl.campaign.stop import Stop
from hpcwhirl.case.resolve import resolve
from hpcwhirl.cli import main
from hpcwhirl.dynamics.history import Evidence
from hpcwhirl.dynamics.kernels.contact import JUDGED
from hpcwhirl.scene import (
    Scene,
    apply_settings,
    digest,
    named_scene,
    preset_inputs,
)
from hpcwhirl.scene.plain_data import to_toml
from hpcwhirl.scene.quantities import CHAOS
from hpcwhirl.scene.words import ENUMS, MOTION_RULES, MOTIONS
from hpcwhirl.store.directory.states import States

ASKED = {"duration": 0.8, "speed": 433.4567, "friction": 0.14868, "gap": 1.0626e-4}
RUBBING = preset_inputs("draft") | {"traces": "summary"} | ASKED  # chaotic
NUMBERS = [name for name in CHAOS if name != "motion"]


def scene(**settings):
    return apply_settings(named_scene("mostly_damped"), RUBBING | settings)


def row(**numbers):
    calm = {"regime": "sustained", "speed": 2 * math.pi, "exponent": 0.0}
    calm |= {"exponent_error": 0.004, "zero_one": 0.1, "return_distance": 1.0}
    return calm | numbers


@pytest.mark.parametrize(
    ("word", "numbers"),
    [
        ("quasi-periodic", {}),
        ("periodic", {"return_distance": 1e-3, "exponent": -3.0}),
        ("chaotic", {"exponent": 0.5, "zero_one": 0.9}),
        ("untold", {"exponent": 0.15}),  # the walk is bounded
        ("chaotic", {"exponent": 0.5}),  # so is this one, but neighbours part fast
        ("untold", {"exponent": -0.0172, "exponent_error": 0.0159}),  # settling
        ("untold", {"zero_one": 0.9}),  # it diffuses, but the twins stay together
        ("untold", {"exponent": -3.0}),  # still on its way, and to no point
        ("untold", {"exponent_error": 0.5}),
        ("untold", {"exponent": math.nan, "exponent_error": math.nan}),
        ("untold", {"zero_one": math.nan}),
        ("none", {"regime": "damped", "exponent": 0.5, "zero_one": 0.9}),
    ],
)
def test_the_word_follows_from_the_numbers(word, numbers):
    assert motion_of(row(**numbers), all_thresholds()) == word


def test_every_word_of_a_motion_has_a_code_a_look_and_a_rule():
    assert {rule.word for rule in MOTION_RULES} == set(MOTIONS) == set(ENUMS["motion"])


def test_a_case_that_is_not_asked_costs_and_tells_nothing():
    assert digest(Scene()) == digest(apply_settings(Scene(), {"chaos": 0.0}))
    assert not CHAOS.keys() & simulate(scene(duration=0.02)).row.keys()
    other = simulate(scene(duration=0.02, chaos=5.0))
    assert other.row["motion"] == "none"  # nor one that is not sustained
    assert not set(NUMBERS) & other.row.keys()


@pytest.mark.turns
def test_what_is_measured_changes_nothing_else_and_no_traces_do():
    plain, asked = simulate(scene()), simulate(scene(chaos=45.0))
    assert plain.row["regime"] == "sustained"
    assert plain.row == {n: v for n, v in asked.row.items() if n not in CHAOS}
    assert asked.row["exponent_error"] > 0.0
    kept = simulate(scene(chaos=45.0, traces="orbit", interval=1e-4))
    assert {n: kept.row[n] for n in CHAOS} == {n: asked.row[n] for n in CHAOS}
    assert kept.traces["time"][-1] <= 0.8


class Interrupt:
    """Stop after some calls, once."""

    def __init__(self, calls=math.inf):
        self.left = calls
        self.calls = 0

    def __call__(self):
        self.calls += 1
        if self.calls > self.left:
            self.left = math.inf
            raise Stop


@pytest.mark.turns
@pytest.mark.parametrize("scheme", ["modal", "exact"])
def test_a_case_that_is_stopped_measures_the_same(scheme, tmp_path, monkeypatch):
    even_slices(monkeypatch)
    case, told = resolve(scene(chaos=42.0, scheme=scheme)), []
    count = Interrupt()
    whole = Course(case).run(count)
    assert whole.row["motion"] == "chaotic"
    late = Interrupt(0.8 * count.calls)  # the case itself takes less
    checkpoints = Checkpoints(States(tmp_path), 1e9, told.append)
    with pytest.raises(Stop):
        compute(case, "d", checkpoints, 1e9, late)
    checkpoints = Checkpoints(States(tmp_path), 1e9, told.append)
    left = Interrupt()
    assert compute(case, "d", checkpoints, 1e9, left).row == whole.row
    assert left.calls < count.calls  # the case is not integrated again
    assert told == []


@pytest.mark.turns
def test_the_limit_of_a_case_ends_its_measurement(tmp_path, monkeypatch):
    even_slices(monkeypatch)
    case, told = resolve(scene(chaos=4000.0)), []
    checkpoints = Checkpoints(States(tmp_path), 1e9, told.append)
    alone = Course(resolve(scene())).run().performance["seconds"]
    with pytest.raises(LateError, match=r"100\.0% of the case"):
        compute(case, "d", checkpoints, 3.0 * alone, lambda: None)


@pytest.mark.turns
@pytest.mark.parametrize("scheme", ["modal", "exact", "general"])
def test_twins_of_a_free_casing_come_together_as_its_slowest_mode_decays(scheme):
    """They part by the casing alone: what is between them is its free motion."""
    free = {"gap": 1e-2, "duration": 2e-2, "force": 1e3, "plan": "everything"}
    march = Course(resolve(scene(scheme=scheme, **free))).march
    march.reach(march.total)
    ring = march.model.casing
    twins = twins_of(march, 200.0)
    found = exponent(growths(twins, DELTA, twins.intervals - 40, 40), twins.interval)
    assert twins.one.beat != march.beat  # of a longer run, rows of evidence are others
    assert twins.one.counter[JUDGED] <= len(twins.one.tracks.evidence)
    assert twins.one.steps // twins.one.beat == twins.one.counter[JUDGED]
    loaded = ring.diameter == 1
    slowest = (ring.ratios * ring.omega)[loaded].min()
    assert found.rate == pytest.approx(-slowest, rel=0.02)


def test_a_march_of_one_sector_or_at_rest_is_not_measured():
    folded = Course(resolve(scene(nodal_diameter=2, duration=2e-3))).march
    assert folded.lean.model.folds == 2
    assert twins_of(folded, 50.0) is None
    still = Course(resolve(scene(speed=0.0, duration=2e-3))).march
    assert twins_of(still, 50.0) is None


def made_up(turns, radius, angle):
    """Return evidence of 120 revolutions of 1 s, 60 rows each, which are no divisor.

    radius, angle : of the centre, functions of time
    """
    time = np.arange(1, int(120 * 60.7)) / 60.7
    z = radius(time) * np.exp(1j * angle(time))
    energy = 1.0 + radius(time) ** 2
    none = np.zeros_like(time)
    judged = Evidence(
        time, np.column_stack([z.real, z.imag]), energy, 0.1 * energy, none, none, none
    )
    return section_of(judged, 2 * math.pi, turns)


def test_a_section_is_taken_at_whole_revolutions():
    wave = 2 * math.pi * 2 / 3  # twice in three revolutions
    section = made_up(300, lambda t: 2 + np.sin(wave * t), lambda t: 2 * math.pi * t)
    number, distance = returns(section)
    assert number == 3
    assert distance < 1e-3
    assert len(section) == 115  # from the 300th row on
    curve = made_up(300, lambda t: 2 + np.sin(wave * t), lambda t: 1.234 * t)
    assert returns(curve)[1] > 0.5
    assert abs(zero_one(curve[:, 0])) < 0.2


@pytest.mark.parametrize(
    ("word", "varies", "growth"),
    [
        ("periodic", lambda t: 1e-4 * np.exp(-t / 40), -0.007),
        ("periodic", lambda t: 1e-3 * np.exp(-t / 40), -0.007),
        ("untold", lambda t: 0.3 * np.exp(-t / 40), -0.007),  # still on its way
        ("quasi-periodic", lambda t: 1e-2 * np.cos(1.234 * t), 0.0),
        ("quasi-periodic", lambda t: 0.3 * np.cos(1.234 * t), 0.0),
    ],
)
def test_a_fixed_point_is_periodic_while_the_last_of_the_way_there_decays(
    word, varies, growth
):
    """A synchronous rub: the centre turns with the rotor at a distance that settles."""
    section = made_up(300, lambda t: 1.0 + varies(t), lambda t: 2 * math.pi * t + 0.7)
    steps = growth + 1e-4 * np.cos(np.arange(480.0))
    numbers = numbers_of(steps, 0.25, section)
    assert motion_of(row(**numbers), all_thresholds()) == word
    if word == "periodic":
        assert numbers["period"] == 1


def test_a_motion_that_does_not_vary_is_periodic():
    still = made_up(300, np.ones_like, np.zeros_like)
    numbers = numbers_of(np.full(100, -0.01), 0.25, still)
    assert (numbers["period"], numbers["return_distance"]) == (1, 0.0)
    assert motion_of(row(**numbers), all_thresholds()) == "periodic"


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    place = tmp_path_factory.mktemp("chaos") / "out"
    made = design_of({
        **tomllib.loads(to_toml(scene(chaos=42.0))),
        "sweep": {"speed": [300.0, 433.4567]},
    })  # fmt: skip
    with hpcwhirl.campaign(made, place) as data:
        return place, data.load()


@pytest.mark.turns
def test_a_campaign_stores_the_numbers_and_classify_keeps_them(campaign):
    place, data = campaign
    words = data["motion"].values.tolist()
    assert set(words) <= set(ENUMS["motion"])
    sustained = data["regime"].values == "sustained"
    assert (np.isfinite(data["exponent"].values) == sustained).all()
    with h5py.File(place / "results.h5") as file:
        before = file["exponent"][:].tobytes()
    limits = ("returns", "calm", "strong")  # so high that all sustained are periodic
    words_of_limits = [w for n in limits for w in ("--set", f"{n}=1e9")]
    assert main(["classify", str(place), *words_of_limits, "--write"]) == 0
    with hpcwhirl.open_results(place) as after:
        told = np.where(sustained, "periodic", "none")
        assert after["motion"].values.tolist() == told.tolist()
    with h5py.File(place / "results.h5") as file:
        assert file["exponent"][:].tobytes() == before
        assert file.attrs["threshold_calm"] == 1e9
    assert main(["classify", str(place)]) == 0
    with hpcwhirl.open_results(place) as after:
        assert after["motion"].values.tolist() == words


@pytest.mark.turns
def test_a_map_shows_motions_and_exponents(campaign, tmp_path):
    place, _ = campaign
    for colour in ("motion", "exponent"):
        words = ["map", str(place), "--colour", colour, "--out", str(tmp_path)]
        assert main(words) == 0
        assert (tmp_path / f"map-{colour}.svg").exists()
    assert "not sustained" in (tmp_path / "map-motion.svg").read_text()
