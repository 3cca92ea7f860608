"""The search for the engine: score, cost, coordinates, what is kept, campaigns."""

import json
import math
import signal
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from identify import engine as engines
from identify import full, named, screen
from identify import score as scoring
from identify.linear import WANTED, growths, linear_miss
from identify.space import (
    BOX,
    GAP,
    PULSES,
    allowed,
    drawn,
    engine_at,
    engine_of_scene,
)

from hpcwhirl.campaign.plan.design import design_of, load_design
from hpcwhirl.scene import (
    Scene,
    apply_settings,
    engine_inputs,
    engine_names,
    engine_shows,
    flatten,
    named_scene,
)

pytestmark = pytest.mark.evidence
DEFAULT = engine_of_scene(Scene())


@pytest.fixture
def _signals_restored():
    handlers = {s: signal.getsignal(s) for s in (2, 10, signal.SIGTERM)}
    yield
    for number, handler in handlers.items():
        signal.signal(number, handler)


SHARES = st.floats(0.0, 1.0)


def row(speed, regime, whirl="forward", **more):
    usual = {"kind": "table 2", "stop": "end", "orbit_radius": GAP, "gap": GAP,
             "line_frequency": 13.0, "whirl_ratio": 1.0 if whirl == "forward" else -1.0,
             "growth_rate": 0.0, "window": 0.6, "end_time": 1.5, "asked": 1.5,
             "late_contacts": 0.0, "late_fed": 0.0, "late_lost": 1.0,
             "last_contact": 0.1, "status": "ok"}  # fmt: skip
    if regime in {"sustained", "divergent"}:
        usual |= {"late_contacts": 1.0, "late_fed": 1.0, "last_contact": 1.5}
    if regime == "divergent":
        usual |= {"growth_rate": 2.0}
    return {"speed": speed, "regime": regime, "whirl": whirl} | usual | more


def as_the_paper():
    rows = [row(float(s), "damped") for s in range(20, 521, 10)]
    rows = [r for r in rows if r["speed"] not in (270.0, 410.0, 420.0)]
    rows += [row(270.0, "divergent", "backward", orbit_radius=1e-3)]
    rows += [row(410.0, "sustained"), row(420.0, "divergent", orbit_radius=4e-3)]
    for kind in ("clamped", "table 1, k=1", "table 1, k=2"):
        rows += [row(float(s), "damped", kind=kind) for s in range(20, 521, 50)]
    four = [r for r in rows if r["speed"] in screen.MOTIONS and r["kind"] == "table 2"]
    return rows + [r | {"kind": "default"} for r in four]


def changed(rows, speed, kind="table 2", **change):
    return [r | change if (r["speed"], r["kind"]) == (speed, kind) else r for r in rows]


def points(rows):
    return sum(won for won, _ in scoring.score_parts(rows).values())


def test_the_papers_motions_score_one_and_cost_nothing():
    parts = scoring.score_parts(as_the_paper())
    assert sum(most for _, most in parts.values()) == 24.0
    assert scoring.score(parts) == 1.0
    assert screen.cost(0.0, as_the_paper()) == 0.0
    assert screen.words_right(as_the_paper()) == 4


@pytest.mark.parametrize(
    ("speed", "change", "lost"),
    [
        (270.0, {"regime": "undecided"}, 3 + 0.5 + 1),  # and nothing to be 4 times of
        (270.0, {"whirl": "mixed"}, 0.25),
        (270.0, {"whirl": "forward", "line_frequency": 518.0}, 0.5),
        (410.0, {"regime": "undecided"}, 5),
        (410.0, {"whirl": "backward"}, 1),
        (410.0, {"orbit_radius": 3e-4}, 1),
        (420.0, {"regime": "sustained"}, 5),
        (420.0, {"orbit_radius": 9e-3}, 1),
        (420.0, {"stop": "amplitude"}, 1),
        (520.0, {"regime": "none"}, 2.5),
        (520.0, {"whirl": "mixed"}, 0.5),
        (400.0, {"regime": "sustained"}, 0),
        (150.0, {"regime": "sustained"}, 4 / 41),
    ],
)
def test_every_miss_costs_its_points(speed, change, lost):
    rows = changed(as_the_paper(), speed, **change)
    assert points(rows) == pytest.approx(24 - lost)


def test_a_divergent_neighbour_speaks_for_270():
    rows = changed(as_the_paper(), 270.0, regime="damped")
    other = {"regime": "divergent", "whirl": "backward", "orbit_radius": 1e-3}
    assert points(changed(rows, 280.0, **other)) == 24.0
    assert screen.words_right(rows) == 3  # but it is not the word at 270


def test_clamped_centre_and_table_1_weigh_by_their_share():
    rows = changed(as_the_paper(), 20.0, "clamped", regime="divergent")
    rows = changed(rows, 20.0, "table 1, k=1", regime="sustained")
    assert points(rows) == pytest.approx(24 - 2 / 11 - 1.5 / 11)


def test_what_was_not_computed_is_not_possible():
    parts = scoring.score_parts([row(520.0, "damped", "mixed")])
    assert parts == {"520": (2.0, 2.0), "520 forward": (0.0, 0.5)}
    assert scoring.score({}) == 0.0


# -- screening -------------------------------------------------------------------------
def test_computing_more_never_costs():
    rows = as_the_paper()
    for wrong in (rows, changed(rows, 270.0, regime="damped", whirl="forward")):
        stages = [[r for r in wrong if r["speed"] in (410.0, 420.0)][:2]]
        stages.append(stages[0] + [r for r in wrong if r["speed"] in (520.0, 270.0)])
        costs = [screen.cost(1.0, some) for some in [[], *stages, wrong]]
        costs.append(screen.cost(0.0, wrong))
        assert costs == sorted(costs, reverse=True)
        assert len(set(costs)) == len(costs)


def test_a_centre_at_rest_does_not_pass_for_one_that_turns():
    rest = row(520.0, "damped", "none", whirl_ratio=1.0)
    turned = row(270.0, "divergent", "forward", whirl_ratio=1.0)
    assert screen.off(rest) == screen.TURNED * screen.WRONG
    assert screen.off(turned) == screen.TURNED


def test_an_engine_that_damps_everything_does_not_lead():
    still = [row(r["speed"], "damped", kind=r["kind"]) for r in as_the_paper()]
    half = [r for r in still if r["speed"] not in (410.0, 420.0)]
    half += [row(410.0, "sustained"), row(420.0, "divergent")]
    assert scoring.score(scoring.score_parts(still)) > 0.4
    assert screen.cost(0.0, still) > 0.7 + screen.cost(0.0, half)


def playing(words):
    """Return a compute that answers by case, else damped, and what it was asked."""
    asked = []

    def compute(engine, kind, speed):
        del engine
        asked.append((kind, speed))
        whirl = "backward" if speed == 270.0 else "forward"
        return row(speed, words.get((kind, speed), "damped"), whirl, kind=kind)

    return compute, asked


ALL = {(kind, speed): word for kind in ("table 2", "default")
       for speed, (word, _) in screen.MOTIONS.items()}  # fmt: skip


def test_hopeless_engines_are_given_up_early():
    compute, asked = playing({})
    worst = max(map(engine_at, drawn(8, 1)), key=lambda e: linear_miss(growths(e)))
    assert screen.screened(worst, compute)[1] == []
    assert not asked  # linear theory gives it up
    gone = {("table 2", 410.0): "none", ("table 2", 420.0): "none"}
    compute, asked = playing(gone)
    screen.screened(DEFAULT, compute)
    assert asked == list(gone)


def test_an_engine_with_all_motions_is_asked_everything():
    compute, asked = playing(ALL)
    _, rows = screen.screened(DEFAULT, compute)
    told = {kind: {s for k, s in asked if k == kind} for kind, _ in asked}
    assert told["table 2"] == {*screen.MOTIONS, *screen.OTHERS}
    assert told["default"] == set(screen.MOTIONS)
    assert len(asked) == len(set(asked)) == len(rows)
    assert screen.words_right(rows, "default") == 4
    compute, asked = playing(ALL | {("table 2", 270.0): "damped"})
    screen.screened(DEFAULT, compute)
    assert len(asked) == 4


def test_a_screened_motion_is_that_of_the_program_at_that_preset():
    found = screen.motion(DEFAULT, "clamped", 520.0)
    assert (found["regime"], found["status"]) == ("damped", "ok")
    assert all(math.isfinite(found[name]) for name in screen.NUMBERS)
    assert found == json.loads(json.dumps(found))
    found = screen.motion(DEFAULT | {"pulse": 1e-12}, "table 2", 520.0)
    assert (found["status"], found["regime"]) == ("failed", "none")
    assert screen.cost(1.0, [found]) == sum(screen.WEIGHTS.values())


def test_linear_theory_is_that_of_the_roots_and_of_the_frame():
    damped = growths(engine_of_scene(named_scene("mostly_damped")))
    assert damped[430.0, "forward"] < 0.0  # which is why it never diverges
    at = growths(DEFAULT)
    assert at[270.0, "backward"] > 0.0 > at[400.0, "backward"]
    assert at[400.0, "forward"] < 0.0 < at[430.0, "forward"]
    right = {key: 5.0 if grows else -5.0 for key, grows in WANTED.items()}
    assert linear_miss(right) == 0.0
    assert linear_miss({key: -20.0 * v for key, v in right.items()}) == 1.0
    assert linear_miss(at) < linear_miss(damped)


# -- coordinates -----------------------------------------------------------------------
@given(st.lists(SHARES, min_size=8, max_size=8))
def test_engines_have_the_mass_and_swing_of_their_point(point):
    found, low, high = engine_at(np.array(point)), *np.array(list(BOX.values())).T
    assert PULSES[0] <= found["pulse"] <= PULSES[1]
    section = found["engine.casing.thickness"] * found["engine.casing.width"]
    mass = 7800 * section * 2 * math.pi * (0.5 + GAP)
    assert mass == pytest.approx(low[0] * (high[0] / low[0]) ** point[0], rel=2e-4)
    if PULSES[0] < found["pulse"] < PULSES[1]:
        impulse = 75e3 * 2 / math.pi * found["pulse"]
        swing = impulse / mass / found["engine.casing.support_frequency"]
        told = low[1] * (high[1] / low[1]) ** point[1]
        assert swing == pytest.approx(told, rel=5e-4)


def test_drawn_points_fill_the_box_and_begin_alike():
    some, more = drawn(64, 3), drawn(128, 3)
    assert (some == more[:64]).all()
    halves = (more < 0.5).sum(axis=0)
    assert (halves == 64).all()


# -- at full numerics ------------------------------------------------------------------
def test_campaigns_are_accepted_and_keep_the_order():
    pair = [engine_at(p) for p in drawn(8, 5)[[0, 7]]]
    for stage in (full.FOUR, full.WHOLE):
        design = design_of(full.document(pair, stage))
        told = [c for engine in pair for c in full.cases_of(engine, stage)]
        assert len(design.scenes) == len(told)
        for scene, (kind, settings) in zip(design.scenes, told, strict=True):
            assert scene.speed == settings["speed"]
            assert scene.engine.casing.width == settings["engine.casing.width"]
            assert (scene.engine.rotor.centre == "clamped") == (kind == "clamped")
            assert (scene.revolutions == 20.0) == kind.startswith("table 1")
            other = full.NUMERICS.get(kind, {})
            assert all(flatten(scene)[name] == value for name, value in other.items())
            if not other:
                assert scene.solver == named_scene("table2").solver


def test_an_engine_holds_where_all_motions_are_right_in_all_numerics():
    rows = as_the_paper()
    four = [r for r in rows if r["speed"] in screen.MOTIONS and r["kind"] == "table 2"]
    for kind in full.FOUR.other:
        rows = rows + [r | {"kind": kind} for r in four]
    found = full.Found(DEFAULT, rows)
    assert found.holds
    assert len(found.words) == 1 + len(full.FOUR.other)
    wrong = changed(rows, 420.0, "exact", whirl="mixed")
    assert not full.Found(DEFAULT, wrong).holds
    assert not full.Found(DEFAULT, []).holds


@pytest.mark.parametrize("name", engine_names())
def test_a_named_engine_is_that_of_its_job(name):
    path = Path(__file__).parents[2] / "jobs"
    files = {"four_motions": "table2"}
    scene = load_design(path / f"{files.get(name, name)}.toml", {}).scenes[0]
    own = engine_inputs(name)
    own.pop("engine.name")
    assert own == {n: flatten(scene)[n] for n in own}
    assert named_scene(name).engine.name == name


def test_engines_with_rotation_keep_it_and_a_damper_that_stands():
    turning = DEFAULT | {"engine.rotation": "full"}
    turning["engine.rotor.suspension_damping"] = 0.0
    least = allowed(turning)
    assert allowed(DEFAULT) == DEFAULT
    assert least["engine.rotation"] == "full"
    rotor = apply_settings(Scene(), least).engine.rotor  # accepted
    assert rotor.suspension_damping >= rotor.damping
    assert growths(DEFAULT) != growths(least)


def test_a_line_of_speeds_is_told_in_ranges():
    words = "dVVVdSd"
    regimes = {"d": "damped", "V": "divergent", "S": "sustained"}
    sweep = {10.0 * i: row(10.0 * i, regimes[w]) for i, w in enumerate(words)}
    assert named.ranges(sweep, "divergent") == "10-30 (forward)"
    assert named.ranges(sweep, "sustained") == "50 (forward)"
    assert named.ranges(sweep, "undecided") == ""
    with pytest.raises(SystemExit, match="no line"):
        named.written("[one]\n", "one", "something")


def test_named_engines_say_what_they_show():
    for name in engine_names():
        assert all(f"{speed:g}" in engine_shows(name) for speed in screen.MOTIONS)


@pytest.mark.slow
@pytest.mark.usefixtures("_signals_restored")
@pytest.mark.parametrize("rotation", ["none", "full"])
def test_a_short_search_reports_and_is_not_repeated(rotation, tmp_path):
    words = ["--out", str(tmp_path), "--short", "--minutes", "30"]
    words += ["--rotation", rotation]
    assert engines.main(words) == 1  # none is found in so few
    facts = json.loads((tmp_path / "engines.json").read_text())
    held = {"engine.rotation": rotation} if rotation != "none" else {}
    assert facts["whole"][-1]["engine"] == allowed(DEFAULT | held)
    report = (tmp_path / "report.md").read_text()
    for heading in ("engines screened", "Computed whole", "agrees"):
        assert heading in report
    before = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.h5")}
    kept = (tmp_path / "screened").read_bytes()
    assert engines.main(words) == 1
    assert before == {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.h5")}
    assert kept == (tmp_path / "screened").read_bytes()
