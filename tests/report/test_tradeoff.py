"""What accuracy costs: errors are zero where they must be and fall as they must."""

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from hpcwhirl.benchmark import tradeoff
from hpcwhirl.benchmark.tradeoff import (
    Compared,
    Sample,
    Setting,
    applied,
    default_scenes,
    difference,
    floor_of,
    measure,
    reference_of,
    settings_of,
)
from hpcwhirl.cli import main
from hpcwhirl.errors import InputError
from hpcwhirl.report.figures import pareto
from hpcwhirl.report.figures.pareto import Row, front_of, markdown, percent, table_of
from hpcwhirl.scene import apply_settings, flatten, named_scene

LIGHT_RING = Path(__file__).parents[2] / "jobs" / "light_ring.toml"
FINE = {"scheme": "modal", "time_step": 2.5e-7}
REFERENCE = FINE | {"modes_a_blade": 5, "harmonics": 20, "elements": 10}
COARSE = [Setting("step", f"{s:g}", {"time_step": s}) for s in (8e-6, 4e-6, 2e-6)]


@pytest.fixture
def cheap(monkeypatch):
    """Let the reference be a small model; the tests' scenes have its modes."""
    table = tradeoff.trials() | {"reference": REFERENCE}
    monkeypatch.setattr(tradeoff, "trials", lambda: table)


def scene(**settings):
    short = {"duration": 4e-3, "interval": 2e-5}
    return apply_settings(named_scene("table2"), short | settings)


def sample(words="damped forward", **numbers):
    return Sample(tuple(words.split()), {"window": 1.0, **numbers}, 1.0)


@pytest.mark.usefixtures("cheap")
def test_the_reference_has_no_error_and_smaller_steps_have_smaller_ones():
    free = scene(gap=1e-2)  # nothing touches
    same = Setting("as given", "as given", FINE)
    found = measure({"free": free}, [same, *COARSE], repeats=2)
    itself, *steps = found.compared
    assert set(itself.errors.values()) == {0.0}
    assert itself.agree == 2
    assert "tip_peak" not in found.floors["free"]  # the rotor rests
    touching = measure({"touching": scene()}, COARSE, repeats=2).compared
    peaks = [row.errors["centre_peak"] for row in touching]
    assert peaks[2] < peaks[0]
    assert all(row.ledger < 1e-9 for row in (*steps, *touching))


@pytest.mark.usefixtures("cheap")
def test_a_setting_that_is_refused_is_a_row_that_says_why():
    above = Setting("step", "too long", {"time_step": 2e-5})
    (row,) = measure({"any": scene()}, [above], repeats=2).compared
    assert "time_step must be <" in row.refused
    assert row.score == np.inf


def test_the_confidence_interval_is_that_of_welch():
    chance = np.random.default_rng(3)
    a, b = chance.normal(1.0, 0.1, 5), chance.normal(1.1, 0.3, 4)
    found = difference(
        "contact_impulse",
        [sample(contact_impulse=x) for x in a],
        [sample(contact_impulse=x) for x in b],
        1e-4,
    )
    welch = stats.ttest_ind(a, b, equal_var=False).confidence_interval(0.95)
    assert found[0] == pytest.approx(abs(a.mean() - b.mean()) / b.mean())
    assert found[1] == pytest.approx(0.5 * (welch.high - welch.low) / b.mean())


def test_small_displacements_are_compared_with_the_gap_and_growth_with_the_window():
    a, b = [sample(orbit_radius=2e-9)] * 2, [sample(orbit_radius=1e-9)] * 2
    assert difference("orbit_radius", a, b, 1e-4)[0] == pytest.approx(1e-3)
    a, b = [sample(growth_rate=0.5)] * 2, [sample(growth_rate=-0.5)] * 2
    assert difference("growth_rate", a, b, 1e-4)[0] == pytest.approx(1.0)
    a = [sample(line_frequency=np.nan)] * 2
    assert difference("line_frequency", a, a, 1e-4) is None


def test_the_floor_is_what_a_twin_differs_by():
    twins = [sample(contact_impulse=x) for x in (1.0, 1.0, 1.3)]
    assert floor_of(twins, 1e-4) == {"contact_impulse": pytest.approx(0.3)}


def row(label, cost, score, agree=6, refused=()):
    return Row("axis", label, cost, 0.0, agree, 6, {}, score, 0.0, refused)


def test_nothing_on_the_front_is_beaten_and_everything_else_is():
    rows = [
        row("a", 1.0, 0.1), row("b", 2.0, 0.01), row("c", 2.5, 0.05),
        row("d", 0.5, 0.01, agree=5), row("e", 3.0, 0.02, refused=("no",)),
    ]  # fmt: skip
    assert [r.label for r in front_of(rows)] == ["d", "a", "b"]


def test_settings_of_unknown_axes_are_refused_and_all_inputs_are_known():
    with pytest.raises(InputError, match="did you mean 'step'"):
        settings_of(["stp"])
    base = named_scene("table2")
    for setting in settings_of(tradeoff.axes()):
        applied(base, setting.inputs)  # a wrong name or value raises
    kinds = default_scenes(base)
    assert len(kinds) == 7
    # whose sustained backward motion the pictures of the README show
    own = tomllib.loads(LIGHT_RING.read_text())
    given = flatten(kinds["sustained backward"])
    for body in ("casing", "rotor"):
        for name, value in own["engine"][body].items():
            assert given[f"engine.{body}.{name}"] == value
    assert given["pulse"] == own["scene"]["pulse"]


@pytest.mark.usefixtures("cheap")
@pytest.mark.parametrize(
    ("ratio", "told"),
    [(0.0, "0"), (1e-7, "1e-05 %"), (0.0123, "1.2 %"), (0.25, "25 %"), (0.99, "99 %"),
     (0.996, "100 %"), (1.0, "100 %"), (12.34, "1234 %"), (float("nan"), "—")],
)  # fmt: skip
def test_large_errors_are_told_without_an_exponent(ratio, told):
    assert percent(ratio) == told


def test_the_table_and_its_files(tmp_path, capsys, monkeypatch):
    given = tmp_path / "short.toml"
    given.write_text("[scene]\nduration = 2e-3\n")
    few = [Setting("as given", "as given", {}), *COARSE[:1]]
    monkeypatch.setattr(tradeoff, "settings_of", lambda _: few)
    out = tmp_path / "out"
    words = ["tradeoff", str(given), "--repeats", "2", "--out", str(out), "--plot"]
    assert main(words) == 0
    text = (out / "tradeoff.md").read_text()
    assert text in capsys.readouterr().out
    facts = json.loads((out / "tradeoff.json").read_text())
    assert (out / "tradeoff.png").stat().st_size > 1000
    assert facts["machine"] in text
    finest = facts["reference"]["time_step"]
    assert "Reference, at least: " in text
    assert f"time_step {finest}" in text
    assert len(facts["compared"]) == 2
    assert markdown(facts) in text
    assert "median over 1 scene (" in text
    figures = []
    monkeypatch.setattr(pareto, "save", lambda figure, _: figures.append(figure))
    pareto.draw_tradeoff(facts, tmp_path / "again.png")
    figures[0].canvas.draw()
    ticks = figures[0].axes[0].get_xticklabels(which="both")
    assert not any("times" in tick.get_text() for tick in ticks)
    first, second = table_of(facts)
    assert first.cost == pytest.approx(1.0)
    assert second.label in text


@pytest.mark.parametrize(
    ("words", "told"),
    [(["--repeats", "1"], "--repeats must be >= 2"), (["table3"], "did you mean"),
     (["table1", "table1"], "named twice"), (["--axis", "steps"], "did you mean")],
)  # fmt: skip
def test_wrong_words_are_one_line(words, told, capsys):
    assert main(["tradeoff", *words]) == 2
    said = capsys.readouterr().err
    assert told in said
    assert said.count("\n") == 1


def test_a_compared_setting_is_scored_by_its_worst_number():
    found = Compared("s", "a", "l", {}, errors={"orbit_radius": 0.1, "tip_peak": 0.2,
                                                "growth_rate": 9.0})  # fmt: skip
    assert found.score == 0.2


def test_the_reference_is_at_least_as_fine_as_the_scene():
    fine = apply_settings(
        named_scene("table2"),
        {"time_step": 4e-7, "modes": 500, "casing.harmonics": 70, "rotor.elements": 30,
         "rotor.blades": 40},
    )  # fmt: skip
    found = reference_of(fine)
    assert found.solver.time_step == 1e-7
    assert found.solver.modes == 500
    assert found.engine.casing.harmonics == 70
    assert found.engine.rotor.elements == 30


@pytest.mark.usefixtures("cheap")
def test_a_mistuned_rotor_has_a_reference_though_none_that_is_exact(monkeypatch):
    table = tradeoff.trials() | {"reference": REFERENCE | {"scheme": "exact"}}
    monkeypatch.setattr(tradeoff, "trials", lambda: table)
    odd = scene(mistuning=[0.01] * 11 + [-0.01] * 11, duration=5e-3)
    (row,) = measure({"mistuned": odd}, [COARSE[2]], repeats=2).compared
    assert row.refused == ""
    assert row.errors["centre_peak"] < 0.01


def test_an_axis_is_tried_though_the_scene_asks_by_errors():
    asked = apply_settings(named_scene("table2"), {"accuracy": 0.1, "truncation": 0.3})
    assert applied(asked, {"time_step": 4e-6}).solver.accuracy == 0.0
    assert applied(asked, {"time_step": 4e-6}).solver.truncation == 0.3
    fewer = applied(asked, {"modes_a_blade": 2})
    assert (fewer.solver.modes, fewer.solver.truncation) == (44, 0.0)
    fine = apply_settings(asked, {"accuracy": 1e-6, "truncation": 1e-4})
    found = reference_of(fine)
    assert found.solver.time_step < 1.5e-8
    assert found.solver.accuracy == found.solver.truncation == 0.0
    assert reference_of(fine).engine.casing.harmonics >= 80


@pytest.mark.usefixtures("cheap")
def test_a_scene_that_is_refused_as_it_is_ends_the_measurement():
    given = Setting("as given", "as given", {})
    with pytest.raises(InputError, match="refused: time_step must be <"):
        measure({"refused": scene(time_step=1e-5)}, [given], repeats=2)


def test_a_number_that_the_reference_has_not_at_all_is_no_small_error():
    a, b = [sample(contact_impulse=1.0)] * 2, [sample(contact_impulse=0.0)] * 2
    assert difference("contact_impulse", a, b, 1e-4)[0] == np.inf
    assert difference("contact_impulse", b, b, 1e-4) is None


def test_unstable_runs_are_on_no_front():
    lost = Row("axis", "lost", 0.1, 0.0, 0, 6, {}, 9.0, 0.0, (), unstable=True)
    assert [r.label for r in front_of([lost, row("a", 1.0, 0.1)])] == ["a"]
