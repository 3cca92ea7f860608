"""The search for the engine: score, guide, coordinates, what is kept, campaigns."""

import json
import math
import signal
import tomllib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from identify import engine as engines
from identify import full, guide, screen
from identify import score as scoring
from identify.linear import SPEEDS, WANTED, growths, linear_miss, linear_rows, model_at
from identify.space import (
    COORDINATES,
    GAP,
    PULSES,
    allowed,
    default_engine,
    drawn,
    engine_at,
    engine_of_scene,
    neighbours,
    point_of,
    ring_mass,
    scattered,
    swing,
)

from hpcwhirl.campaign.plan.design import design_of, load_design
from hpcwhirl.scene import (
    Scene,
    apply_settings,
    engine_inputs,
    engine_names,
    flatten,
    named_scene,
)

pytestmark = pytest.mark.evidence


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


def likely(speed):
    grows = {root: 5.0 if yes else -5.0 for s, root, yes in WANTED if s == speed}
    return {"kind": "linear", "speed": speed} | grows


def as_the_paper():
    rows = [row(float(s), "damped") for s in range(20, 521, 10)]
    rows = [r for r in rows if r["speed"] not in (270.0, 410.0, 420.0)]
    rows += [row(270.0, "divergent", "backward", orbit_radius=1e-3)]
    rows += [row(410.0, "sustained"), row(420.0, "divergent", orbit_radius=4e-3)]
    for kind in ("clamped", "table 1, k=1", "table 1, k=2"):
        rows += [row(float(s), "damped", kind=kind) for s in range(20, 521, 50)]
    four = [r for r in rows if r["speed"] in guide.SCATTERED and r["kind"] == "table 2"]
    rows += [r | {"kind": f"scatter {i}"} for i in range(2) for r in four]
    last = [r for r in rows if r["speed"] == 520.0 and r["kind"] == "table 2"]
    rows += [r | {"kind": kind} for kind in ("long", "default") for r in four + last]
    return rows + [likely(speed) for speed in SPEEDS]


def changed(rows, speed, kind="table 2", **change):
    return [r | change if (r["speed"], r["kind"]) == (speed, kind) else r for r in rows]


def points(rows):
    return sum(won for won, _ in scoring.score_parts(rows).values())


def test_the_papers_motions_score_one_and_cost_nothing():
    parts = scoring.score_parts(as_the_paper())
    assert sum(most for _, most in parts.values()) == 24.0
    assert scoring.score(parts) == 1.0
    assert guide.cost(as_the_paper()) == 0.0
    assert guide.words_right(as_the_paper()) == 4


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
    assert guide.words_right(rows) == 3  # but it is not the word at 270


def test_clamped_centre_and_table_1_weigh_by_their_share():
    rows = changed(as_the_paper(), 20.0, "clamped", regime="divergent")
    rows = changed(rows, 20.0, "table 1, k=1", regime="sustained")
    assert points(rows) == pytest.approx(24 - 2 / 11 - 1.5 / 11)


def test_what_was_not_computed_is_not_possible():
    parts = scoring.score_parts([row(520.0, "damped", "mixed")])
    assert parts == {"520": (2.0, 2.0), "520 forward": (0.0, 0.5)}
    assert scoring.score({}) == 0.0


# -- the guide -------------------------------------------------------------------------
@given(
    st.sampled_from(["last_contact", "late_fed", "growth_rate"]),
    st.floats(-2.0, 2.0),
    st.floats(-2.0, 2.0),
    st.booleans(),
)
def test_vigour_never_falls_with_what_makes_a_motion_live(name, one, other, contact):
    low, high = sorted((one, other))

    def lively(value):
        value = abs(value) if name == "last_contact" else value
        more = {"late_contacts": float(contact), "late_lost": 1.0, "late_fed": 0.7}
        return guide.vigour(row(410.0, "undecided", **(more | {name: value})))

    if name == "last_contact":
        low, high = sorted((abs(low), abs(high)))
    assert lively(low) <= lively(high)
    assert abs(lively(high) - lively(low)) <= 1.5 * (high - low) + 1e-12  # no jump


def test_vigour_orders_damped_touching_kept_up_growing_and_gone():
    touching = {"late_contacts": 1.0, "late_fed": 0.3, "growth_rate": -0.5}
    gone = {"stop": "amplitude", "late_contacts": 1.0}
    motions = [
        row(410.0, "damped", last_contact=0.01),
        row(410.0, "damped", last_contact=0.8),
        row(410.0, "undecided", **touching),
        row(410.0, "sustained"),
        row(410.0, "divergent", growth_rate=0.5),
        row(410.0, "divergent", end_time=1.2, **gone),
        row(410.0, "divergent", end_time=0.3, **gone),
    ]
    lively = [guide.vigour(each) for each in motions]
    assert lively == sorted(lively)
    assert len(set(lively)) == len(lively)
    down = [guide.miss(each, "damped") for each in motions]
    up = [guide.miss(each, "divergent") for each in motions]
    assert down == sorted(down)
    assert up == sorted(up, reverse=True)


def test_a_wrong_word_is_never_as_good_as_the_right_one():
    for word in ("damped", "sustained", "divergent"):
        for other in ("damped", "sustained", "divergent", "undecided", "none"):
            found = guide.miss(row(410.0, other), word)
            assert found == 0.0 if other == word else guide.WRONG <= found <= 1.0
    failed = row(410.0, "none", status="failed")
    assert guide.miss(failed, "damped") == 1.0


def test_a_step_elsewhere_costs_by_how_far_it_is():
    def at(step_):
        speeds = range(330, 520, 10)
        words = dict.fromkeys(speeds, "damped") | {step_: "sustained"}
        words |= {s: "divergent" for s in speeds if s > step_}
        rows = [row(float(s), word) for s, word in words.items()]
        return guide.misses(rows)["step"]

    costs = [at(410 + away) for away in (0, 10, 20, 40)]
    assert costs[0] == 0.0
    assert costs == sorted(costs)
    assert len(set(costs)) == 4
    assert at(390) == pytest.approx(at(430))


def test_computing_more_never_costs():
    rows = as_the_paper()
    for wrong in (rows, changed(rows, 270.0, regime="damped", whirl="forward")):
        stages = [[r for r in wrong if r["speed"] in (410.0, 420.0)]]
        stages.append(stages[0] + [r for r in wrong if r["speed"] in (520.0, 270.0)])
        stages.append(wrong[:-1])
        stages.append(wrong)  # linear theory is whole with its last
        costs = [guide.cost(some) for some in [[], *stages]]
        assert costs == sorted(costs, reverse=True)
        assert len(set(costs)) == len(costs)


def test_a_centre_at_rest_does_not_pass_for_one_that_turns():
    rest = row(520.0, "damped", "none", whirl_ratio=1.0)
    assert guide.off(rest, "damped", "forward") > 0.0
    assert guide.turned(rest, "forward") == guide.WRONG
    assert guide.turned(row(270.0, "divergent", "backward"), "forward") == 1.0


def test_an_engine_that_damps_everything_does_not_lead():
    still = [row(r["speed"], "damped", kind=r["kind"]) for r in as_the_paper()
             if r["kind"] != "linear"]  # fmt: skip
    half = [r for r in still if r["speed"] not in (410.0, 420.0)]
    half += [row(410.0, "sustained"), row(420.0, "divergent")]
    assert scoring.score(scoring.score_parts(still)) > 0.4
    assert guide.cost(still) > 1.0 + guide.cost(half)


# -- screening -------------------------------------------------------------------------
def playing(words):
    """Return a compute that answers by case, else damped, and what it was asked."""
    asked = []

    def compute(engine, kind, speed):
        del engine
        asked.append((kind, speed))
        whirl = "backward" if speed == 270.0 else "forward"
        word = words.get((kind, speed), "damped")
        return row(speed, word, whirl, kind=kind)

    return compute, asked


PAPER = {270.0: "divergent", 410.0: "sustained", 420.0: "divergent"}
SEEN = ("table 2", "long", "default", *(f"scatter {i}" for i in range(screen.DRAWS)))
ALL = {(kind, speed): word for kind in SEEN for speed, word in PAPER.items()}


def test_hopeless_engines_are_given_up_early():
    good = default_engine()
    compute, asked = playing({})
    worst = max(map(engine_at, drawn(8, 1)), key=lambda e: linear_miss(linear_rows(e)))
    assert len(screen.screened(worst, compute)) == len(SPEEDS)
    assert not asked  # linear theory gives it up
    screen.screened(good, compute)
    assert len(asked) == 4
    gone = {("table 2", s): "divergent" for s in (410.0, 420.0, 520.0, 390.0, 360.0)}
    compute, asked = playing(gone)
    screen.screened(good, compute)
    assert ("table 2", 270.0) not in asked


def test_an_engine_with_all_motions_is_asked_everything():
    good = default_engine()
    compute, asked = playing(ALL)
    rows = screen.screened(good, compute)
    told = {kind: {s for k, s in asked if k == kind} for kind, _ in asked}
    assert {270.0, 520.0, *screen.OTHERS} < told["table 2"]
    assert told["clamped"] == set(screen.CLAMPED)
    assert len(asked) == len(set(asked)) == len(rows) - len(SPEEDS)
    assert len([k for k in told if k.startswith("scatter")]) == screen.DRAWS
    assert told["default"] == set(full.DECIDING)
    assert guide.shows_all(rows)


def screened_but(**lost):
    """Return the rows of an engine with all motions but those at 410 or 420 rad/s."""
    good = default_engine()
    other = {
        (kind.replace("_", " "), speed): word for kind, (speed, word) in lost.items()
    }
    return screen.screened(good, playing(ALL | other)[0])


def test_motions_must_last_stay_where_unknowns_scatter_and_be_the_defaults():
    rows = screened_but(long=(410.0, "divergent"))  # grows, but slowly
    assert guide.words_right(rows) == 4
    assert not guide.shows_all(rows)
    assert not any(r["kind"].startswith("scatter") for r in rows)
    rows = screened_but(**{f"scatter_{i}": (420.0, "damped") for i in range(3)})
    assert guide.steady_share(rows) == 5 / 8
    assert not any(r["kind"] == "default" for r in rows)  # not worth that
    assert not guide.shows_all(rows)
    rows = screened_but(default=(420.0, "sustained"))
    assert guide.words_right(rows, "long") == 4
    assert not guide.shows_all(rows)


def test_a_screened_motion_is_that_of_the_program_at_that_preset():
    found = screen.motion(default_engine(), "clamped", 520.0)
    assert (found["regime"], found["status"]) == ("damped", "ok")
    assert all(math.isfinite(found[name]) for name in screen.NUMBERS)
    assert found == json.loads(json.dumps(found))
    refused = default_engine() | {"pulse": 1e-12}
    found = screen.motion(refused, "table 2", 520.0)
    assert (found["status"], found["regime"]) == ("failed", "none")
    assert guide.cost([found]) == pytest.approx(sum(guide.WEIGHTS.values()), rel=0.1)


def test_linear_theory_is_that_of_the_roots_and_of_the_frame():
    damped = engine_of_scene(named_scene("mostly_damped"))
    found = growths(model_at(damped), 430.0)
    assert found["forward"] < 0.0  # which is why it never diverges
    growing = default_engine()
    at = {row["speed"]: row for row in linear_rows(growing)}
    assert at[270.0]["backward"] > 0.0 > at[400.0]["backward"]
    assert at[400.0]["forward"] < 0.0 < at[430.0]["forward"]
    assert linear_miss([]) == 1.0
    assert linear_miss([likely(speed) for speed in SPEEDS]) == 0.0
    assert linear_miss(linear_rows(growing)) < linear_miss(linear_rows(damped))


# -- coordinates -----------------------------------------------------------------------
@given(st.lists(SHARES, min_size=8, max_size=8))
def test_coordinates_come_back(point):
    found = engine_at(point)
    assert PULSES[0] <= found["pulse"] <= PULSES[1]
    inside = PULSES[0] < found["pulse"] < PULSES[1]
    back = point_of(found)
    for name, share, got in zip(COORDINATES, point, back, strict=True):
        if inside or name != "swing":
            assert got == pytest.approx(share, abs=1e-4)
    again = engine_at(back)
    for name, value in found.items():
        assert again[name] == pytest.approx(value, rel=3e-4)


def test_neighbours_have_one_unknown_off_each():
    engine = default_engine()
    near = neighbours(engine, 0.01)
    off = [{n: o[n] / engine[n] for n in o if o[n] != engine[n]} for o in near]
    assert all(len(each) == 1 for each in off)
    assert {n for each in off for n in each} == set(engine)
    ratios = sorted(r for each in off for r in each.values())
    assert ratios == pytest.approx([0.99] * 8 + [1.01] * 8, rel=1e-4)


def test_mass_and_swing_are_those_of_the_ring():
    engine = default_engine()
    section = engine["engine.casing.thickness"] * engine["engine.casing.width"]
    mass = 7800 * section * 2 * math.pi * (0.5 + GAP)
    assert ring_mass(engine) == pytest.approx(mass, rel=1e-6)
    impulse = 75e3 * 2 / math.pi * engine["pulse"]
    free = impulse / mass / engine["engine.casing.support_frequency"]
    assert swing(engine) == pytest.approx(free, rel=1e-6)
    assert swing(engine | {"pulse": 2 * engine["pulse"]}) == pytest.approx(2 * free)


def test_the_box_holds_the_default_and_all_named_engines():
    for name in engine_names():
        at = point_of(engine_of_scene(named_scene(name)))
        assert (at >= 0.0).all(), name
        assert (at <= 1.0).all(), name


def test_drawn_points_fill_the_box_and_begin_alike():
    some, more = drawn(64, 3), drawn(128, 3)
    assert (some == more[:64]).all()
    halves = (more < 0.5).sum(axis=0)
    assert (halves == 64).all()


# -- at full numerics ------------------------------------------------------------------
def test_campaigns_are_accepted_and_keep_the_order():
    pair = [engine_at(p) for p in drawn(8, 5)[[0, 7]]]
    for stage in (full.FOUR, full.WHOLE):
        design = design_of(tomllib.loads(full.document(pair, stage)))
        told = [c for engine in pair for c in full.cases_of(engine, stage)]
        assert len(design.scenes) == len(told)
        for scene, (kind, settings) in zip(design.scenes, told, strict=True):
            assert scene.speed == settings["speed"]
            assert scene.engine.casing.width == settings["engine.casing.width"]
            assert (scene.engine.rotor.centre == "clamped") == (kind == "clamped")
            assert (scene.revolutions == 20.0) == kind.startswith("table 1")
            other = full.OTHER_NUMERICS.get(kind, {})
            assert all(flatten(scene)[name] == value for name, value in other.items())
            if not other:
                assert scene.solver == named_scene("table2").solver


def test_an_engine_holds_where_all_motions_are_right_in_all_numerics():
    rows = as_the_paper()
    four = [r for r in rows if r["speed"] in full.DECIDING and r["kind"] == "table 2"]
    for kind in full.FOUR.other:
        rows = rows + [r | {"kind": kind} for r in four]
    found = full.Found(default_engine(), rows)
    assert found.holds
    assert len(found.words) == 1 + len(full.FOUR.other)
    assert not found.firm  # not asked
    found.beside = 16
    assert found.firm
    found.beside = 15
    assert not found.firm
    wrong = changed(rows, 420.0, "exact", whirl="mixed")
    assert not full.Found(default_engine(), wrong).holds
    assert not full.Found(default_engine(), []).holds


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
    turning = default_engine() | {"engine.rotation": "full"}
    turning["engine.rotor.suspension_damping"] = 0.0
    least = allowed(turning)
    assert allowed(default_engine()) == default_engine()
    beside = neighbours(least, 0.05) + scattered(least, 0.05, 8)
    for engine in [least, *beside]:
        assert engine["engine.rotation"] == "full"
        scene = apply_settings(Scene(), engine)  # accepted
        assert scene.engine.rotor.suspension_damping >= scene.engine.rotor.damping
    none, full = (linear_rows(e) for e in (default_engine(), least))
    assert none != full


@pytest.mark.slow
@pytest.mark.usefixtures("_signals_restored")
@pytest.mark.parametrize("rotation", ["none", "full"])
def test_a_short_search_reports_and_is_not_repeated(rotation, tmp_path):
    words = ["--out", str(tmp_path), "--short", "--minutes", "30"]
    words += ["--rotation", rotation]
    assert engines.main(words) == 1  # none is found in so few
    facts = json.loads((tmp_path / "engines.json").read_text())
    assert facts["engines"] >= 8
    held = {"engine.rotation": rotation} if rotation != "none" else {}
    default = allowed(default_engine() | held)
    assert [item["engine"] for item in facts["whole"]][-1] == default
    report = (tmp_path / "report.md").read_text()
    for heading in ("when screened", "Computed whole", "agrees"):
        assert heading in report
    before = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.h5")}
    kept = (tmp_path / "screened").read_bytes()
    assert engines.main(words) == 1
    assert before == {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.h5")}
    assert kept == (tmp_path / "screened").read_bytes()
