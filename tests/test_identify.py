"""The search for the engine: its score, its bounds, its campaigns."""

import json
import signal
import tomllib

import pytest
from identify import engine as engines
from identify import score as scoring

from hpcwhirl.campaign.design import design_of


@pytest.fixture
def _signals_restored():
    handlers = {s: signal.getsignal(s) for s in (2, 10, signal.SIGTERM)}
    yield
    for number, handler in handlers.items():
        signal.signal(number, handler)


def row(speed, regime, whirl="forward", **more):
    usual = {"kind": "table 2", "stop": "end", "orbit_radius": 1.28e-4, "gap": 1.28e-4}
    return {"speed": speed, "regime": regime, "whirl": whirl, "line_frequency": 13.0,
            "status": "ok"} | usual | more  # fmt: skip


def as_the_paper():
    rows = [row(float(s), "damped") for s in range(20, 521, 10)]
    rows = [r for r in rows if r["speed"] not in (270.0, 410.0, 420.0)]
    rows += [row(270.0, "divergent", "backward", orbit_radius=1e-3)]
    rows += [row(410.0, "sustained"), row(420.0, "divergent", orbit_radius=4e-3)]
    for kind in ("clamped", "table 1, k=1", "table 1, k=2"):
        rows += [row(float(s), "damped", kind=kind) for s in range(20, 521, 50)]
    return rows


def changed(rows, speed, kind="table 2", **change):
    return [r | change if (r["speed"], r["kind"]) == (speed, kind) else r for r in rows]


def points(rows):
    return sum(won for won, _ in scoring.score_parts(rows).values())


def test_the_papers_motions_score_one():
    parts = scoring.score_parts(as_the_paper())
    assert sum(most for _, most in parts.values()) == 24.0
    assert scoring.score(parts) == 1.0


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


def test_clamped_centre_and_table_1_weigh_by_their_share():
    rows = changed(as_the_paper(), 20.0, "clamped", regime="divergent")
    rows = changed(rows, 20.0, "table 1, k=1", regime="sustained")
    assert points(rows) == pytest.approx(24 - 2 / 11 - 1.5 / 11)


def test_what_was_not_computed_is_not_possible():
    parts = scoring.score_parts([row(520.0, "damped", "mixed")])
    assert parts == {"520": (2.0, 2.0), "520 forward": (0.0, 0.5)}
    assert scoring.score({}) == 0.0


def test_a_search_begins_within_bounds_and_with_the_default():
    drawn = [engines.engine_at(p) for p in engines.first_population(64, seed=3)]
    assert len(drawn) == 64
    for name, (low, high, _) in engines.UNKNOWNS.items():
        values = [engine[name] for engine in drawn]
        assert low <= min(values) < max(values) <= high
    for name, value in engines.default_engine().items():
        assert drawn[0][name] == pytest.approx(value, rel=1e-4)


def test_an_engine_that_damps_everything_has_points_but_does_not_lead():
    rest = {"late_fed": 0.0, "late_lost": 1.0, "growth_rate": -1.0, "window": 1.0}
    paper = [r | rest for r in as_the_paper()]
    still = [r | {"regime": "damped"} for r in paper]
    half = changed(still, 420.0, regime="divergent")
    half = changed(half, 410.0, regime="sustained")
    assert scoring.guide(paper) == pytest.approx(1.0)
    assert scoring.score(scoring.score_parts(still)) > 0.4
    assert scoring.guide(still) < 0.4 < scoring.guide(half) < 1.0


def test_the_guide_rises_with_what_contact_replaces():
    def led(fed, **more):
        kept = {"late_fed": fed, "late_lost": 1.0, "growth_rate": 0.0, "window": 1.0}
        return scoring.guide([row(420.0, "undecided", **(kept | more))])

    assert led(0.1) < led(0.5) < led(1.0) <= led(3.0)
    assert led(0.5, growth_rate=-0.5) < led(0.5)


def test_unit_coordinates_come_back():
    default = engines.default_engine()
    for name in engines.UNKNOWNS:
        back = engines.from_unit(name, engines.to_unit(name, default[name]))
        assert back == pytest.approx(default[name], rel=1e-4)


def test_campaigns_are_accepted_and_keep_the_order():
    pair = [engines.engine_at(p) for p in engines.first_population(8, 5)[[0, 7]]]
    for stage in (engines.SCREEN, engines.SWEEP, engines.FINAL):
        design = design_of(tomllib.loads(engines.document(pair, stage)))
        told = [c for engine in pair for c in engines.cases_of(engine, stage)]
        assert len(design.scenes) == len(told)
        for scene, (kind, settings) in zip(design.scenes, told, strict=True):
            assert scene.speed == settings["speed"]
            assert scene.engine.casing.width == settings["engine.casing.width"]
            assert (scene.engine.rotor.centre == "clamped") == (kind == "clamped")
            assert (scene.revolutions == 20.0) == kind.startswith("table 1")


@pytest.mark.slow
@pytest.mark.usefixtures("_signals_restored")
def test_a_short_search_reports_and_is_not_repeated(tmp_path):
    words = ["--out", str(tmp_path), "--short", "--minutes", "30"]
    assert engines.main(words) == 0
    facts = json.loads((tmp_path / "engines.json").read_text())
    found = facts["stages"]
    assert [len(found[s]) for s in "AB"] == [2 * 6, 2]
    assert len(found["C"]) in {1, 2}  # the best may be the default
    assert facts["default"] in [item["engine"] for item in found["C"]]
    report = (tmp_path / "report.md").read_text()
    for heading in ("Stage C", "Within 10 %", "One at a time", "agrees"):
        assert heading in report
    before = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.h5")}
    assert engines.main(words) == 0
    assert before == {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.h5")}
