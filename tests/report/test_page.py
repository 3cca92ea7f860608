"""The page's parts in Python: rules, commands, records of traces, one safe file."""

import base64
import hashlib
import json
import re
import shlex
import tracemalloc
from dataclasses import fields
from importlib import resources

import h5py
import made_up
import numpy as np
import pytest
from synthetic import synthetic

from hpcwhirl.analysis import rules
from hpcwhirl.analysis.expression import parse, value_of
from hpcwhirl.analysis.regimes import Thresholds
from hpcwhirl.campaign.finalize import Ending
from hpcwhirl.cli import campaign, main
from hpcwhirl.cli.options import scene_of
from hpcwhirl.errors import InputError
from hpcwhirl.report.page import build, thin
from hpcwhirl.scene import campaign_tables, digest
from hpcwhirl.scene.quantities import ROW
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.reading import results_file
from hpcwhirl.store.reading.results_file import Results
from hpcwhirl.store.reading.select import known_counts

GRID = {"sweep": {"speed": [300, 350.5, 1e3 / 7], "gap": [1e-4, 2e-4]}}
HURT = "<img src=x onerror=hurt()>"


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    return made_up.campaign(tmp_path_factory.mktemp("made") / "out", GRID, samples=400)


def told(page):
    block = re.search(r'id="facts">(.*?)</script>', page, re.DOTALL)
    return json.loads(block[1])


def test_every_threshold_counts_in_the_rules_and_is_explained():
    known = {f.name for f in fields(Thresholds)}
    assert known <= set(rules.evidence_names())
    assert all(f.metadata["meaning"] for f in fields(Thresholds))


def test_conditions_are_read_and_never_run():
    known = {"speed": np.array([300.0, 410.0, 500.0]), "regime": np.array([*"abc"])}
    ask = parse("not speed / 2 - 50 >= 2e2 and (300 < speed < 450 or regime == c)")
    assert value_of(ask, known).tolist() == [False, True, False]
    with np.errstate(all="raise"):
        assert value_of(parse("abs(-1 / 0) > max(1, 2)"), {})
    for text in ("__import__('os')", "a b", "(", "x[0]", "abs(1, 2)", "lambda: 1", ""):
        with pytest.raises(InputError, match="cannot read the condition"):
            parse(text)


@pytest.mark.turns
@pytest.mark.parametrize(
    "document",
    [
        GRID,
        {"scene": {"friction": 0.1 + 0.2}, "sweep": {"direction": ["squeeze"]}},
        {"engine": {"name": "a 'b' \"c\" \\ $(d)", "casing": {"thickness": 0.02}},
         "sweep": {"rotor.mistuning": [[0.0] * 21 + [v] for v in (1e-2, 1 / 3)]}},
        {"solver": {"accuracy": 0.01, "truncation": 0.02}, "sweep": {"speed": [1, 2]}},
        {"sweep": {"solver.accuracy": [0.0, 0.01]}, "output": {"traces": "full"}},
        {"cases": [{"speed": 300}, {"gap": 2e-4}, {"scheme": "exact"}]},
    ],
)  # fmt: skip
def test_the_command_of_a_case_has_its_digest(tmp_path, document):
    folder = made_up.campaign(tmp_path / "out", document)
    facts, plan = told(page_of(folder)), Results(folder).plan
    for case, wanted in enumerate(plan.digests):
        program, verb, *words = shlex.split(composed(facts, plan, case))
        assert (program, verb, words[::2]) == (
            "hpcwhirl", "run", ["--set"] * (len(words) // 2),
        )  # fmt: skip
        assert digest(scene_of("table2", words[1::2])) == wanted


def page_of(folder):
    return build.write_page(Directory(folder)).read_text(encoding="utf-8")


def composed(facts, plan, case):
    """Return a case's command as `commandOf` in data.js makes it."""
    if str(case) in facts["commands"]:
        return facts["commands"][str(case)]
    front = ""
    for swept in facts["swept"]:
        name = swept["name"]
        value = plan.settings[case].get(name, plan.base[name])
        front += f" {swept['set'][swept['levels'].index(value)]}"
    return facts["program"] + front + facts["tail"]


def test_a_case_integrated_again_keeps_its_orbit(tmp_path):
    folder = made_up.campaign(
        tmp_path / "out", GRID | {"output": {"traces": "summary"}}
    )
    assert "traces" not in composed(told(page_of(folder)), Results(folder).plan, 0)


def test_inputs_that_accuracy_replaces_are_not_set_twice(tmp_path):
    folder = made_up.campaign(
        tmp_path / "out", {"solver": {"accuracy": 0.01, "time_step": 3e-7}}
    )
    command = composed(told(page_of(folder)), Results(folder).plan, 0)
    assert "accuracy" in command
    scene_of("table2", shlex.split(command)[3::2])  # `run` would refuse both


def test_what_comes_from_inputs_cannot_leave_its_place(tmp_path):
    folder = made_up.campaign(
        tmp_path / "out",
        {"engine": {"name": f"</title></script>{HURT}{{{{style}}}}"},
         "sweep": {"speed": [1, 2]}},
        messages={1: f"</script><script>hurt()</script>{HURT}"},
    )  # fmt: skip
    page = page_of(folder)
    assert HURT not in page
    assert page.count("hurt()") == len(re.findall(r"(u003c|&lt;)[^<]*?hurt\(\)", page))
    assert told(page)["messages"]["1"] == f"</script><script>hurt()</script>{HURT}"
    assert "{{style}}" in told(page)["engine"]


@pytest.mark.turns
def test_a_page_has_all_that_words_follow_from_and_no_messages(made):
    names = {column["name"] for column in told(page_of(made))["columns"]}
    assert set(rules.evidence_names()) & ROW.keys() <= names
    assert names.isdisjoint({"message", "rank"})


def test_a_case_without_a_result_has_no_counts(tmp_path):
    rows = [{"speed": 300.0}, {"speed": 310.0}]
    page = page_of(synthetic(tmp_path / "out", rows, status=["ok", "failed"]))
    (column,) = (c for c in told(page)["columns"] if c["name"] == "contacts")
    text = re.search(r'id="columns">(.*?)</script>', page, re.DOTALL)[1]
    shown = np.frombuffer(base64.b64decode(text), "<f4", 2, column["at"])
    assert shown[0] >= 0
    assert np.isnan(shown[1])


def test_numbers_on_the_page_are_those_of_the_results_to_the_last_bit(made):
    page, results = page_of(made), Results(made)
    data = base64.b64decode(re.search(r'id="columns">(.*?)</script>', page, re.S)[1])
    columns = [c for c in told(page)["columns"] if c["name"] in results]
    numbers = [c for c in columns if results[c["name"]].dtype.kind != "U"]
    assert {"gap", "friction", "force", "pulse", "time_step"} <= {
        c["name"] for c in numbers
    }
    for column in numbers:
        count = 1 if column["same"] else len(results)
        shown = np.frombuffer(data, f"<{column['kind']}", count, column["at"])
        wanted = known_counts(results[column["name"]])
        assert np.array_equal(
            np.broadcast_to(shown, len(results)), wanted, equal_nan=True
        ), column["name"]


def test_the_policy_names_the_scripts_and_forbids_the_network(made):
    page = page_of(made)
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', page)[1]
    scripts = re.findall(r"<script>(.*?)</script>", page, re.DOTALL)
    hashes = [base64.b64encode(hashlib.sha256(s.encode()).digest()) for s in scripts]
    rules_of = dict(part.split(" ", 1) for part in policy.split("; "))
    assert rules_of["default-src"] == "'none'"
    assert rules_of["script-src"].split() == [f"'sha256-{h.decode()}'" for h in hashes]
    assert rules_of.keys().isdisjoint({"connect-src", "object-src", "frame-src"})


def test_own_scripts_make_no_markup_of_text():
    for name in build.SCRIPTS:
        text = build._asset(f"assets/{name}.js")
        assert not re.search(r"innerHTML|outerHTML|insertAdjacentHTML|document\.write"
                             r"|\beval\b|new Function|https?:", text), name  # fmt: skip


def test_libraries_are_as_published_and_come_with_their_licences():
    place = resources.files("hpcwhirl.report.page").joinpath("vendor")
    told_there = place.joinpath("README.md").read_text("utf-8")
    for name in ("d3", "plot"):
        found = hashlib.sha256(place.joinpath(f"{name}.min.js").read_bytes())
        assert found.hexdigest() in told_there
        assert "Permission to use" in place.joinpath(f"{name}.LICENSE").read_text()


def test_two_thousand_cases_with_orbits_stay_below_eight_megabytes():
    libraries = sum(len(build._asset(name)) for name in build.LIBRARIES)
    own = sum(len(build._asset(f"assets/{name}.js")) for name in build.SCRIPTS)
    record = thin.sizes_for(2000).bytes
    columns = 8 * (len(build.ROW) + len(build.STATUS) + len(build.PERFORMANCE) + 8)
    whole = 2000 * 4 / 3 * (record + columns) + libraries + own
    assert whole < 8e6 - 3e5  # left for names, messages and commands
    assert thin.sizes_for(20_000).orbit >= 50


def decoded(codes, scale):
    """Return the values of codes, as `decoded` in data.js."""
    value = np.sign(codes) * scale * 2.0 ** (-40 * (1 - np.abs(codes / 32767)))
    return np.where(codes == thin.NOTHING, np.nan, value)


def test_curves_keep_twelve_decades_to_a_part_in_a_thousand():
    values = np.array([3e5, -2.0, 1e-6, 0.0, np.nan, np.inf, 1e-9])
    scale, codes = thin._codes(values)
    kept = decoded(codes, scale)
    assert np.allclose(kept[:3], values[:3], rtol=5e-4, atol=0)
    assert (kept[3], *np.isnan(kept[4:6])) == (0.0, True, True)
    assert abs(kept[6]) < 1e-6


def test_a_record_holds_the_orbit_to_a_part_in_thousands(made):
    results, sizes = Results(made), thin.sizes_for(6)
    case, kept = next(iter(results.each_traces([3], thin.NEEDED)))
    speed = results["speed"][case]
    record = thin.record_of(kept, speed, 0.03, -2 * speed, sizes)
    assert len(record) == sizes.bytes
    scale, start, step, reach, *scales = np.frombuffer(record[:32], "<f4")
    places = np.frombuffer(record[32:], "<i2")[: 2 * sizes.orbit].reshape(2, -1)
    shown = places[0] != thin.NOTHING
    x, y = places[:, shown] * scale / thin.SCALE
    stride = round(step / made_up.INTERVAL)
    chosen = np.arange(399, -1, -stride)[: sizes.orbit][::-1]
    error = np.abs(np.column_stack([x, y]) - kept["centre"][chosen])
    assert error.max() < 1e-4 * scale
    turned = np.remainder(speed * kept["time"][chosen[0]] - start, 2 * np.pi)
    assert min(turned, 2 * np.pi - turned) < 1e-4
    codes = np.frombuffer(record[32 + 4 * sizes.orbit :], "<i2")
    ends = [2 * sizes.radius, *[sizes.ledger] * 4, sizes.lines]
    _, energy, friction, rotation, lost, lines, _ = (
        decoded(part, scale)
        for part, scale in zip(
            np.split(codes, np.cumsum(ends)),
            (scales[0], scales[1], *[scales[2]] * 3, scales[3], 0.0), strict=True,
        )
    )  # fmt: skip
    for curve, value in ((energy, 3), (friction, 3), (rotation, 2), (lost, 4)):
        assert np.nanmax(np.abs(curve / value - 1)) < 1e-3
    at = (np.nanargmax(lines) + 0.5) / sizes.lines * 2 * reach - reach
    assert abs(at + 2 * speed) < 2 * reach / sizes.lines + 2 * np.pi / 0.03


@pytest.mark.parametrize("samples", [0, 1, 3, 50])
@pytest.mark.parametrize("wild", [1.0, np.inf, np.nan, 1e300])
def test_a_record_has_one_size_whatever_became_of_the_run(samples, wild):
    sizes = thin.sizes_for(2000)
    kept = {"time": (1.0 + np.arange(samples)) * 2e-4}
    kept |= {name: np.ones(samples) for name in thin.NEEDED}
    kept["centre"] = np.ones((samples, 2))
    for name in thin.NEEDED:
        kept[name][samples // 2 :] *= wild
    assert len(thin.record_of(kept, 400.0, 1e-3, 0.0, sizes)) == sizes.bytes


def test_traces_are_those_of_the_case_however_they_are_read(tmp_path, monkeypatch):
    folder = made_up.campaign(
        tmp_path / "out", {"sweep": {"speed": [*range(1, 13)]}}, samples=20,
        messages={4: "a", 5: "b"},
    )  # fmt: skip
    results = Results(folder)
    chosen = [0, 1, 3, 6, 7, 11]
    for block in (1, 3 * 140 * 8, 10**9):
        monkeypatch.setattr(results_file, "BLOCK", block)
        found = dict(results.each_traces(chosen, ["centre", "lost"]))
        assert [*found] == chosen
        for case, kept in found.items():
            with h5py.File(folder / "results.h5") as file:
                assert np.array_equal(kept["centre"], file["centre"][case])
            assert kept["time"][-1] == results["end_time"][case]


@pytest.mark.turns
def test_few_cases_of_traces_are_in_memory_at_a_time(tmp_path, monkeypatch):
    peaks = []
    monkeypatch.setattr(results_file, "BLOCK", 100_000)
    for cases in (4, 40):
        sweep = {"sweep": {"speed": [300 + i for i in range(cases)]}}
        folder = made_up.campaign(tmp_path / str(cases), sweep, samples=1000)
        results = Results(folder)
        tracemalloc.start()
        parts = build._records(results)
        kept = sum(map(len, parts[1]))
        peaks.append(tracemalloc.get_traced_memory()[1] - kept)
        tracemalloc.stop()
    assert peaks[1] < 1.5 * peaks[0]


@pytest.mark.turns
def test_a_page_knows_when_its_words_are_old(made_copy, capsys):
    assert not build.is_stale(Directory(made_copy))  # there is none yet
    path = build.write_page(Directory(made_copy))
    assert not build.is_stale(Directory(made_copy))
    assert main(["classify", str(made_copy), "--set", "rise=0.01", "--write"]) == 0
    assert f"hpcwhirl report {made_copy}" in capsys.readouterr().err
    assert build.is_stale(Directory(made_copy))
    assert main(["report", str(made_copy)]) == 0
    assert not build.is_stale(Directory(made_copy))
    path.write_text("no page", encoding="utf-8")
    assert build.is_stale(Directory(made_copy))


@pytest.fixture
def made_copy(tmp_path):
    return made_up.campaign(tmp_path / "own", GRID)


@pytest.mark.turns
def test_report_writes_where_it_is_told_and_prints_it(made, tmp_path, capsys):
    out = tmp_path / "new" / "page.html"
    assert main(["report", str(made), "--out", str(out)]) == 0
    assert capsys.readouterr().out == f"{out}\n"
    page = out.read_text(encoding="utf-8")
    assert page.startswith("<!doctype html>")
    assert page == page_of(made)  # the same bytes of the same results


@pytest.mark.turns
def test_a_case_without_samples_among_others_has_no_orbit(tmp_path):
    folder = made_up.campaign(
        tmp_path / "out", {"sweep": {"speed": [1, 2, 3]}}, samples=30
    )
    with h5py.File(folder / "results.h5", "r+") as file:
        file["centre"][1] = np.nan
    slots = build._records(Results(folder))[2]
    assert slots.tolist() == [0, -1, 1]


@pytest.mark.turns
def test_damaged_traces_are_one_line(tmp_path, capsys):
    folder = made_up.campaign(tmp_path / "out", GRID, samples=3000)
    path = folder / "results.h5"
    with path.open("rb+") as file:
        file.truncate(path.stat().st_size // 2)
    assert main(["report", str(folder)]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert [*folder.glob("report*")] == []


def test_report_of_no_campaign_is_one_line(tmp_path, capsys):
    assert main(["report", str(tmp_path)]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_a_campaign_leaves_its_page_beside_the_map(finished):
    page = (finished / "report.html").read_text(encoding="utf-8")
    assert told(page)["cases"] == 2
    assert not build.is_stale(Directory(finished))


@pytest.mark.turns
@pytest.mark.parametrize(("wish", "most", "there"), [
    ("auto", 1, False), ("auto", 2, True), ("yes", 1, True), ("no", 2, False),
])  # fmt: skip
def test_a_page_is_written_unasked_where_it_is_cheap(
    tmp_path, monkeypatch, capsys, wish, most, there
):
    for module in (campaign, campaign_tables):
        monkeypatch.setattr(module, "MOST_ON_PAGE", most)
    folder = made_up.campaign(tmp_path / "out", {"sweep": {"speed": [1, 2]}})
    rules = campaign_tables.Campaign(report=wish)
    ended = Ending(complete=True, cases=2, failed=0, results=folder / "results.h5")
    assert bool(campaign._pages(ended, Directory(folder), rules)) == there
    assert (folder / "report.html").exists() == there
    told_so = "no report.html: 2 cases, more than 1" in capsys.readouterr().err
    assert told_so == (wish == "auto" and not there)


@pytest.mark.turns
def test_a_page_that_is_not_wanted_is_told_with_its_map(made_copy, capsys):
    rules, directory = campaign_tables.Campaign(report="no"), Directory(made_copy)
    ended = Ending(complete=True, cases=9, results=directory.results, gathered=True)
    assert campaign._pages(ended, directory, rules) == []
    assert capsys.readouterr().err == ""  # there is none
    build.write_page(directory)
    assert campaign._pages(ended, directory, rules) == [directory.page]
    directory.page.write_text("older words")
    assert campaign._pages(ended, directory, rules) == []
    told = f"report.html is of earlier results: hpcwhirl report {directory}\n"
    assert capsys.readouterr().err.endswith(told)
