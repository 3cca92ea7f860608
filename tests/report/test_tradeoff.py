"""What accuracy costs: errors are zero where they must be and fall as they must."""

import json
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from rotor_files import exported

from hpcwhirl.benchmark import drawing, tradeoff, trials
from hpcwhirl.benchmark.drawing import by_words, drawn_cases, evenly
from hpcwhirl.benchmark.numbers import (
    Run,
    error_of,
    quantile_of,
    scatter_of,
    sensitive,
    shift_of,
)
from hpcwhirl.benchmark.tradeoff import (
    Measurement,
    Row,
    computations,
    distinct,
    front_of,
    measure,
)
from hpcwhirl.benchmark.trials import (
    Setting,
    applied,
    coarser_than,
    default_scenes,
    pinned,
    reference_of,
    settings_of,
)
from hpcwhirl.benchmark.wish import (
    SURE,
    Support,
    Wish,
    cheapest,
    fewest,
    is_settled,
    wish_of,
)
from hpcwhirl.campaign.plan.design import Design
from hpcwhirl.case.resolve import resolve
from hpcwhirl.cli import main, options
from hpcwhirl.errors import InputError
from hpcwhirl.report.figures import pareto
from hpcwhirl.report.figures.pareto import markdown, percent
from hpcwhirl.scene import apply_settings, documents, flatten, named_scene
from hpcwhirl.scene.documents import load_document

LIGHT_RING = Path(__file__).parents[2] / "jobs" / "light_ring.toml"
FINE = {"scheme": "modal", "time_step": 2.5e-7}
REFERENCE = FINE | {"modes_a_blade": 5, "harmonics": 20, "elements": 10}
COARSE = [Setting("step", f"{s:g}", {"time_step": s}) for s in (8e-6, 4e-6, 2e-6)]


@pytest.fixture
def cheap(monkeypatch):
    """Let the reference be a small model; the tests' scenes have its modes."""
    _reference(monkeypatch, REFERENCE)


def _reference(monkeypatch, inputs):
    table = trials.trials() | {"reference": inputs, "coarser": {"time_step": 1.0}}
    for module in (tradeoff, trials):
        monkeypatch.setattr(module, "trials", lambda: table)


def scene(**settings):
    short = {"duration": 4e-3, "interval": 2e-5}
    return apply_settings(named_scene("table2"), short | settings)


def run(words="damped forward", **numbers):
    return Run(*words.split(), {"window": 1.0, "ledger_error": 0.0, **numbers}, 1.0)


@pytest.mark.turns
@pytest.mark.usefixtures("cheap")
def test_the_reference_has_no_error_and_smaller_steps_have_smaller_ones():
    free = scene(gap=1e-2, start_energy=5.0, force=0.0)  # nothing touches
    same = Setting("as given", "as given", FINE)
    found = measure({"free": free}, [same, *COARSE], repeats=2)
    itself, *steps = found.rows
    assert {error.largest for error in itself.errors.values()} == {0.0}
    assert itself.agree == 2
    peaks = [row.errors["blade_peak"].largest for row in steps]
    assert 0.0 < peaks[2] < 0.2 * peaks[0]
    assert all(row.ledger < 1e-9 for row in found.rows)


@pytest.mark.usefixtures("cheap")
def test_a_setting_that_is_refused_is_a_row_that_says_why():
    given = Setting("as given", "as given", {})
    above = Setting("step", "too long", {"time_step": 2e-5})
    _, row = measure({"any": scene()}, [given, above], repeats=2).rows
    assert "time_step must be <" in row.refused["any"]
    assert row.score == np.inf


def test_the_interval_of_a_quantile_covers_it_and_tells_what_few_cases_cannot():
    chance = np.random.default_rng(3)
    held = 0
    for _ in range(200):
        found = quantile_of(chance.exponential(size=60), 0.9)
        held += found.low <= np.log(10.0) <= found.high
    assert held >= 0.93 * 200
    few = quantile_of([0.01, 0.02, 0.03, 0.04], 0.9)
    assert few.value == 0.04
    assert few.high == np.inf
    assert quantile_of([0.1, np.inf, np.inf], 0.9).value == np.inf


def test_small_displacements_are_compared_with_the_gap_and_growth_with_the_window():
    a, b = [run(orbit_radius=2e-9)] * 2, [run(orbit_radius=1e-9)] * 2
    assert error_of("orbit_radius", a, b, 1e-4)[0] == pytest.approx(1e-3)
    a, b = [run(growth_rate=0.5)] * 2, [run(growth_rate=-0.5)] * 2
    assert error_of("growth_rate", a, b, 1e-4)[0] == pytest.approx(1.0)
    a = [run(line_frequency=np.nan)] * 2
    assert error_of("line_frequency", a, a, 1e-4) is None
    a = [run(orbit_area=0.0, line_frequency=50.0)]
    b = [run(orbit_area=1e-30, line_frequency=50.0)]
    assert error_of("orbit_area", a, b, 1e-4)[0] < 1e-12


def test_the_error_is_that_of_the_mean_and_of_the_worst_twin():
    a, b = [run(contact_impulse=x) for x in (1.1, 0.9)], [run(contact_impulse=1.0)] * 2
    mean, worst = error_of("contact_impulse", a, b, 1e-4)
    assert mean == pytest.approx(0.0, abs=1e-15)
    assert worst == pytest.approx(0.1)


def test_the_scatter_is_what_a_twin_differs_by_and_makes_a_number_sensitive():
    twins = [run(contact_impulse=x) for x in (1.0, 1.0, 1.3)]
    assert scatter_of(twins, 1e-4) == {"contact_impulse": pytest.approx(0.3)}
    steady = [run(orbit_radius=1e-3, blade_peak=1.0),
              run(orbit_radius=1.01e-3, blade_peak=1.2)]  # fmt: skip
    assert sensitive(scatter_of(steady, 1e-4)) == ("blade_peak",)


def test_sensitive_cases_are_compared_as_distributions():
    chance = np.random.default_rng(1)
    alike = [(chance.normal(3.0, 0.3, 5), chance.normal(3.0, 0.3, 5)) for _ in range(9)]
    assert shift_of(alike).chance > 0.01
    moved = [(1.4 * a, b) for a, b in alike]
    assert shift_of(moved).chance < 1e-6
    assert shift_of([(np.zeros(2), np.zeros(2))]) is None


def row(label, cost, score, agree=6, refused=False, radius=()):
    of = {str(n): {"orbit_radius": error} for n, error in enumerate(radius)}
    return Row(
        "axis",
        label,
        "",
        {},
        cost,
        agree=agree,
        runs=6,
        score=score,
        of=of,
        same=agree,
        changed=6 - agree,
        refused={"a": "no"} if refused else {},
    )


def test_nothing_on_the_front_is_beaten_and_everything_else_is():
    rows = [
        row("a", 1.0, 0.1), row("b", 2.0, 0.01), row("c", 2.5, 0.05),
        row("d", 0.5, 0.01, agree=5), row("e", 3.0, 0.02, refused=True),
    ]  # fmt: skip
    assert [r.label for r in front_of(rows)] == ["d", "a", "b"]


def measured(rows, cases=20):
    sure = tradeoff.Case(1e-4, [], True, (), {"orbit_radius": 1e-4}, 1.0)
    return tradeoff.Tradeoff(rows, {str(n): sure for n in range(cases)}, {}, 1000)


def test_a_wish_is_met_by_the_cheapest_that_enough_cases_support():
    good, bad = [0.001] * 20, [0.001] * 19 + [0.5]  # 19 of 20 may be chance
    rows = [row("cheap", 0.1, 0.0, radius=bad), row("good", 0.2, 0.0, radius=good),
            row("dear", 0.3, 0.0, radius=good)]  # fmt: skip
    asked = wish_of("radius 1 %")
    assert asked == Wish("radius", 0.01)
    assert cheapest(measured(rows), [asked]).label == "good"
    rows[1] = row("good", 0.2, 0.0, agree=5, radius=good)
    words = wish_of("words 70 %")
    assert cheapest(measured(rows), [asked, words]).label == "dear"
    rows[2] = row("dear", 0.3, 0.0, radius=good[:8])  # too few to be sure
    assert cheapest(measured(rows), [asked, words]) is None


@pytest.mark.parametrize("level", [0.9, 0.6])
@pytest.mark.parametrize("count", [24, 5000])
def test_a_setting_that_misses_its_wish_is_rarely_sure_to_meet_it(level, count):
    chance, tried = np.random.default_rng(5), 0
    few = int(np.ceil(level * count)) - 1  # one case less than must meet it
    for of in (8, 16, 24):
        met = chance.hypergeometric(few, count - few, of, size=2000)
        known = {m: Support(m, of, level, count).sure for m in set(met.tolist())}
        assert np.mean([known[m] for m in met.tolist()]) <= 1.0 - SURE + 0.03
        tried += Support(of, of, level, count).sure
    assert tried  # some draws suffice
    assert not Support(0, 0, level, count).sure


def test_no_fewer_cases_than_told_make_a_setting_sure():
    for level, total in ((0.9, 1000), (0.95, 1000), (0.9, 24), (0.5, 3)):
        least = fewest(level, total)
        assert Support(least, least, level, total).sure
        assert not Support(least - 1, least - 1, level, total).sure


def test_of_cases_that_are_all_there_is_the_share_itself_is_known():
    assert Support(9, 10, 0.9, 10).confidence == 1.0
    assert Support(8, 10, 0.9, 10).confidence == 0.0


def test_a_number_is_sure_only_as_far_as_no_further_case_could_change_the_choice():
    asked, few = [wish_of("radius 1 %")], [0.001] * 8
    open_ = [row("open", 0.1, 0.0, radius=few), row("dear", 0.3, 0.0, radius=few)]
    assert not is_settled(measured(open_), asked, 24)
    assert is_settled(measured(open_), asked, 2)  # no more would make it sure
    lost = [row("lost", 0.1, 0.0, radius=[0.5] * 8)]
    assert is_settled(measured(lost), asked, 24)
    sure = [row("lost", 0.1, 0.0, radius=[0.5] * 20),
            row("sure", 0.3, 0.0, radius=[0.001] * 20),
            row("dear", 0.4, 0.0, radius=[0.001] * 19 + [0.5])]  # fmt: skip
    assert is_settled(measured(sure), asked, 24)
    sure.append(row("open", 0.2, 0.0, radius=[0.001] * 19 + [0.5]))
    assert not is_settled(measured(sure), asked, 24)


@pytest.mark.turns
@pytest.mark.usefixtures("cheap")
def test_cases_that_come_in_batches_are_measured_as_those_at_once():
    free = {"gap": 1e-2, "start_energy": 5.0, "force": 0.0, "duration": 2e-3}
    scenes = {str(v): scene(speed=v, **free) for v in (100, 110, 120, 130)}
    given = Setting("as given", "as given", FINE)
    same = Setting("as given", "again", FINE)
    once = measure(scenes, [given, same, COARSE[0]], repeats=2)
    parts = Measurement([given, same, COARSE[0]], 2)
    for names in (list(scenes)[:3], list(scenes)[3:]):
        parts.add({name: scenes[name] for name in names})
    by = parts.found()
    assert list(by.cases) == list(once.cases)
    for one, other in zip(once.rows, by.rows, strict=True):
        assert (one.label, one.of, one.errors) == (other.label, other.of, other.errors)
    assert [one.label for one in by.rows] == ["as given = again", COARSE[0].label]
    few = parts.found(list(scenes)[:3])
    assert list(few.cases) == list(scenes)[:3]
    assert few.rows[1].of == {n: once.rows[1].of[n] for n in few.cases}


@pytest.mark.parametrize(
    ("text", "told"),
    [("radios 1 %", "did you mean 'radius'"), ("radius", "a name and a share"),
     ("radius 0 %", "a share from 0 to 100 %"), ("peak 3 % or so", "a name and a")],
)  # fmt: skip
def test_a_wish_that_is_not_understood_is_refused(text, told):
    with pytest.raises(InputError, match=told):
        wish_of(text)


def test_every_word_gives_cases_in_proportion_and_the_draw_is_even():
    words = dict(enumerate(["damped"] * 60 + ["sustained"] * 35 + ["divergent"] * 5))
    drawn = by_words(words, 12)
    counts = [sum(words[n] == w for n in drawn) for w in dict.fromkeys(words.values())]
    assert sum(counts) == len(set(drawn)) == 12
    assert counts[2] == 1
    assert abs(counts[0] - 7) <= 1
    assert len(by_words(words, 2)) == 2
    assert by_words({3: "damped"}, 12) == [3]
    numbers = evenly(1000, 10)
    assert [n // 100 for n in numbers] == list(range(10))
    assert evenly(7, 10) == list(range(7))


@pytest.mark.turns
def test_cases_of_a_campaign_are_its_own_and_those_of_a_branch_are_refused():
    tables = {"scene": {"duration": 4e-3}, "sweep": {"speed": [100, 200, 1e9]}}
    tables["engine"] = {"rotor": {"blades": 5}}
    design = Design.of(tables)
    drawn = drawn_cases(design, 12)
    assert {s.speed for s in drawn.values()} <= {100.0, 200.0, 1e9}
    assert len(drawn) >= 2
    branched = Design.of(tables | {"branch": {"over": "speed"}})
    with pytest.raises(InputError, match="leave it out"):
        drawn_cases(branched, 12)


def test_settings_that_lead_to_one_computation_share_a_row():
    given = Setting("as given", "as given", {})
    draft = settings_of(["preset"])[1]
    both = Setting("together", "both", {"accuracy": 0.03, "truncation": 0.3})
    fine = Setting("together", "fine", {"accuracy": 0.01, "truncation": 0.3})
    found = distinct(computations({"any": scene()}, [given, draft, both, fine]))
    assert [one.label for one in found] == ["as given", "preset draft = both", "fine"]
    assert found[1].settings[0].options == "--preset draft"
    assert both.options == "--set accuracy=0.03 --set truncation=0.3"


def test_settings_of_unknown_axes_are_refused_and_all_inputs_are_known():
    with pytest.raises(InputError, match="did you mean 'step'"):
        settings_of(["stp"])
    base = named_scene("table2")
    for setting in settings_of(trials.axes()):
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


@pytest.mark.turns
def test_the_table_and_its_files(tmp_path, capsys, monkeypatch):
    given = tmp_path / "short.toml"
    given.write_text("[scene]\nduration = 2e-3\ngap = 1e-2\n")
    few = [Setting("as given", "as given", {}), *COARSE[:1]]
    monkeypatch.setattr(trials, "settings_of", lambda _: few)
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
    assert len(facts["rows"]) == 2
    assert markdown(facts) in text
    assert "Errors over 1 case: median" in text
    figures = []
    monkeypatch.setattr(pareto, "save", lambda figure, _: figures.append(figure))
    pareto.draw_tradeoff(facts, tmp_path / "again.png")
    figures[0].canvas.draw()
    ticks = figures[0].axes[0].get_xticklabels(which="both")
    assert not any("times" in tick.get_text() for tick in ticks)
    first, second = facts["rows"]
    assert first["cost"] == pytest.approx(1.0)
    assert second["label"] in text


@pytest.mark.parametrize(
    ("words", "told"),
    [(["--repeats", "1"], "--repeats must be >= 2"), (["table3"], "did you mean"),
     (["table1", "table1"], "named twice"), (["--axis", "steps"], "did you mean"),
     (["--cases", "0"], "--cases must be >= 1"), (["--apply"], "--apply needs --for"),
     (["--for", "radius"], "a name and a share")],
)  # fmt: skip
def test_wrong_words_are_one_line(words, told, capsys):
    assert main(["tradeoff", *words]) == 2
    said = capsys.readouterr().err
    assert told in said
    assert said.count("\n") == 1


@pytest.mark.parametrize(
    ("words", "count"),
    [([], 24), (["--for", "peak 5 %"], 48), (["--for", "peak 5 %", "--cases", "9"], 9)],
)
def test_a_wish_may_draw_more_cases(words, count, tmp_path, monkeypatch):
    file = tmp_path / "map.toml"
    file.write_text("[sweep]\nspeed = [100, 200]\n")
    drawn = []

    def draw(_, asked, __):
        drawn.append(asked)
        raise InputError("enough")

    monkeypatch.setattr(sys.modules["hpcwhirl.cli.tradeoff"], "_drawn", draw)
    assert main(["tradeoff", str(file), *words]) == 2
    assert drawn == [count]


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


@pytest.mark.turns
@pytest.mark.usefixtures("cheap")
def test_a_mistuned_rotor_has_a_reference_though_none_that_is_exact(monkeypatch):
    _reference(monkeypatch, REFERENCE | {"scheme": "exact"})
    odd = scene(mistuning=[0.01] * 11 + [-0.01] * 11, duration=5e-3)
    (row,) = measure({"mistuned": odd}, [COARSE[2]], repeats=2).rows
    assert row.refused == {}
    assert row.errors["centre_peak"].largest < 0.01


def test_the_coarser_reference_is_coarser_in_all_though_the_scene_is_fine():
    fine = {"modes": 500, "time_step": 4e-7, "casing.harmonics": 70}
    for given in ({}, fine, {"accuracy": 1e-5, "truncation": 1e-3}):
        reference = reference_of(apply_settings(named_scene("table2"), given))
        one, other = map(flatten, (reference, coarser_than(reference)))
        assert {name: other[name] / one[name] for name in one
                if one[name] != other[name]} == {
            "solver.time_step": pytest.approx(1.6),
            "solver.modes": pytest.approx(0.75, abs=0.01),
            "engine.casing.harmonics": pytest.approx(0.67, abs=0.02),
            "engine.rotor.elements": pytest.approx(0.75, abs=0.01),
        }  # fmt: skip


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


@pytest.mark.turns
def test_a_rotor_from_file_is_tried_with_the_modes_that_truncation_keeps(tmp_path):
    file = exported(tmp_path / "rotor.h5", {"blades": 5, "modes": 40})
    own = scene(file=str(file), blades=5, truncation=0.05, kind="rigid")
    few, many = (resolve(pinned(applied(own, {"truncation": share})))
                 for share in (1.0, 1e-3))  # fmt: skip
    for case in (few, many):
        given = applied(own, {"truncation": case.given.solver.truncation})
        assert case.model is resolve(given).model  # what the setting alone computes
    assert len(few.model.rotor.omega) < len(many.model.rotor.omega)
    whole = resolve(apply_settings(own, {"truncation": 0.0})).model.rotor
    assert len(resolve(reference_of(own)).model.rotor.omega) == len(whole.omega)
    tried = [Setting("one", f"{share:g}", {"truncation": share})
             for share in (0.5, 0.499, 1e-3)]  # fmt: skip
    tried += settings_of(["families", "blade"])[1:]
    found = distinct(computations({"any": own}, tried))
    assert [one.label for one in found[:2]] == ["0.5 = 0.499", "0.001"]
    assert all("no effect" in one.refused["any"] for one in found[2:])
    assert len(found[2:]) == len(tried[3:])


@pytest.mark.usefixtures("cheap")
def test_a_scene_that_is_refused_as_it_is_ends_the_measurement():
    given = Setting("as given", "as given", {})
    with pytest.raises(InputError, match="refused: time_step must be <"):
        measure({"refused": scene(time_step=1e-5)}, [given], repeats=2)


def test_a_number_that_the_reference_has_not_at_all_is_no_small_error():
    a, b = [run(contact_impulse=1.0)] * 2, [run(contact_impulse=0.0)] * 2
    assert error_of("contact_impulse", a, b, 1e-4)[0] == np.inf
    assert error_of("contact_impulse", b, b, 1e-4) is None


def test_unstable_runs_are_on_no_front():
    lost = Row("axis", "lost", "", {}, 0.1, runs=6, score=9.0, unstable=True)
    assert [r.label for r in front_of([lost, row("a", 1.0, 0.1)])] == ["a"]


def test_a_gap_at_rest_is_narrowed_once():
    rest = scene(gap_at="rest", rotation="full", gap=2e-4)
    for found in (pinned(rest), reference_of(rest)):
        assert found.gap == rest.gap
        assert found.solver.accuracy == 0.0


MINE = """\
# mine
[scene]
duration = 4e-3  # short
gap = 1e-2
[engine.rotor]
blades = 4
[solver]
preset = "standard"
[sweep]
speed = { start = 100, stop = 117, step = 1 }
"""
FOR = ["--repeats", "2", "--for", "centre 90 %", "--apply"]


@pytest.fixture
def mine(tmp_path, monkeypatch):
    """Return a campaign's file, of which only few settings are tried."""
    few = settings_of(["preset"])[:2]
    monkeypatch.setattr(trials, "settings_of", lambda _: few)
    _reference(monkeypatch, REFERENCE)
    file = tmp_path / "mine.toml"
    file.write_text(MINE)
    return file


@pytest.mark.turns
def test_a_wish_is_written_and_the_file_is_read_once(mine, capsys, monkeypatch):
    read = []

    def load(path):
        read.append(path)
        return load_document(path)

    for module in (options, documents):
        monkeypatch.setattr(module, "load_document", load)
    assert main(["tradeoff", str(mine), *FOR]) == 0
    assert read == [mine]
    told = capsys.readouterr().out
    assert f"hpcwhirl campaign {mine}" in told
    assert "met in 16 of 16 cases: in 90 % of the 18 that can be judged" in told
    text = mine.read_text()
    assert "duration = 4e-3  # short" in text
    assert "# mine" in text
    assert Design.of(mine).base.solver.accuracy == 0.03
    assert text.count("preset") == 1


@pytest.mark.turns
def test_a_file_that_changed_meanwhile_is_left_as_it_is(mine, capsys, monkeypatch):
    changed = MINE.replace("gap = 1e-2", "gap = 2e-2")

    def edited(design, count):
        mine.write_text(changed)
        return drawn_cases(design, count)

    monkeypatch.setattr(drawing, "drawn_cases", lambda d, n, _: edited(d, n))
    assert main(["tradeoff", str(mine), *FOR]) == 2
    assert "has changed since its cases were drawn" in capsys.readouterr().err
    assert mine.read_text() == changed


def test_no_number_is_known_where_the_reference_differs_in_words():
    alike = {"orbit_radius": 1e-3, "blade_peak": 1e-3}
    twins = [run("damped forward", **alike), run("undecided forward", **alike)]
    assert set(tradeoff._case(twins, 1e-4).sensitive) == set(alike)
    twins[1] = run("damped forward", **alike)
    assert tradeoff._case(twins, 1e-4).sensitive == ()
