"""What --dry-run says beforehand is what there is afterwards."""

import itertools
import json

import numpy as np
import pytest

from hpcwhirl.campaign.foresight import forecast as forecasts
from hpcwhirl.campaign.foresight.forecast import forecast
from hpcwhirl.campaign.foresight.foreseen import followers
from hpcwhirl.campaign.foresight.rehearsal import Rehearsal, drawn, rehearse
from hpcwhirl.campaign.plan import cost as costs
from hpcwhirl.campaign.plan.cost import time_steps
from hpcwhirl.campaign.plan.design import design_of
from hpcwhirl.campaign.resume import prepare
from hpcwhirl.campaign.run import run_campaign
from hpcwhirl.case.limits import step_counts
from hpcwhirl.cli import main
from hpcwhirl.scene.batch_validation import end_times
from hpcwhirl.store.directory.journal import read_records

SHORT = {
    "scene": {"duration": 2e-3},
    "solver": {"time_step": 2e-6},
    "sweep": {"speed": [300.0, 410.0], "friction": [0.0, 0.05, 0.1]},
}


def size(folder, name):
    path = folder / name
    files = [path] if path.is_file() else list(path.iterdir())
    return sum(file.stat().st_size for file in files)


@pytest.mark.parametrize("detail", ["summary", "blades", "orbit", "full"])
def test_bytes_on_disk_are_predicted_within_a_few_percent(tmp_path, detail):
    output = {"traces": detail, "interval": 2e-6 if detail == "orbit" else 5e-5}
    design = design_of(SHORT | {"output": output})
    told = forecast(design, tmp_path).disk
    prepare(design, tmp_path)
    assert run_campaign(design, tmp_path).failed == 0
    found = size(tmp_path, "results.h5")
    assert told.results == pytest.approx(found, rel=0.03, abs=4096)  # a page of HDF5's
    assert told.traces == size(tmp_path, "traces")
    assert told.journal == pytest.approx(size(tmp_path, "journal"), rel=0.1)


def test_what_any_case_keeps_is_foreseen_whichever_comes_first(tmp_path):
    sweep = {"traces": ["summary", "orbit", "full"], "blades": [12, 22]}
    design = design_of({**SHORT, "sweep": sweep, "output": {"interval": 5e-5}})
    told = forecast(design, tmp_path).disk
    prepare(design, tmp_path)
    assert run_campaign(design, tmp_path).failed == 0
    assert told.results == pytest.approx(size(tmp_path, "results.h5"), rel=0.03)


def test_steps_of_more_kinds_than_are_asked_are_those_of_their_friction(
    tmp_path, monkeypatch
):
    """An accuracy's step depends on friction: intervals differ, and times are rows."""
    sweep = {"speed": [100.0, 200.0, 300.0], "friction": [0.0, 0.1, 0.2, 0.3]}
    casing = {"thickness": 0.02, "width": 0.15}
    solver = {"preset": "draft"}
    design = design_of(
        SHORT | {"sweep": sweep, "engine": {"casing": casing}, "solver": solver}
    )
    steps, whole = time_steps(design), forecast(design, tmp_path).disk
    assert len(set(steps)) > 1
    for most in (11, 4):  # kinds: 12, and 4 without the speed
        monkeypatch.setattr(costs, "MOST_MODELS", most)
        assert np.array_equal(time_steps(design), steps)
        assert forecast(design, tmp_path).disk == whole
    monkeypatch.setattr(costs, "MOST_MODELS", 1)
    assert set(time_steps(design)) < set(steps)
    prepare(design, tmp_path)
    assert run_campaign(design, tmp_path).failed == 0
    found = size(tmp_path, "results.h5")
    assert whole.results == pytest.approx(found, rel=0.03, abs=4096)


def test_samples_and_spans_are_those_of_each_scene():
    """Arithmetic on columns against the cases one by one."""
    sweep = {
        "time_step": [1e-6, 2e-6], "interval": [1e-5, 3.3e-5, 1.0],
        "revolutions": [0.0, 0.1, 0.3], "until": ["end", "decided"],
    }  # fmt: skip
    design = design_of(SHORT | {"scene": {"duration": 2e-3}, "sweep": sweep}
                       | {"solver": {"longest": 0.4}})  # fmt: skip
    for extended in ((), (0.03, 0.5)):
        get = design.columns.values
        longest = forecasts.longest_of(design, extended)
        end = end_times(design.columns.all(np.arange(len(design.settings))))
        found = forecasts._sampling(
            end, get("solver.time_step"), get("output.interval")
        )
        for case, scene in enumerate(design.scenes):
            total, stride = step_counts(scene)
            assert found[0][case] == total // stride
            assert found[1][case] == stride * scene.solver.time_step
            last = max([scene.end_times[-1], *extended])
            assert longest[case] == last / scene.end_time


def test_what_is_finished_is_learned_from_and_not_counted(tmp_path):
    design = design_of(SHORT | {"output": {"traces": "summary"}})
    before = forecast(design, tmp_path)
    assert (before.cases, before.left, before.finished) == (6, 6, 0)
    assert before.probed == 3
    assert before.rehearsed > 0
    assert before.seconds > 0.0
    prepare(design, tmp_path)
    run_campaign(design, tmp_path)
    more = SHORT["sweep"] | {"speed": [300.0, 350.0, 410.0]}
    after = forecast(
        design_of(SHORT | {"output": {"traces": "summary"}, "sweep": more}), tmp_path
    )
    assert (after.cases, after.left, after.finished) == (9, 3, 6)
    assert (after.probed, after.rehearsed) == (0, 0)
    assert after.steps == pytest.approx(3 * 1000)


def test_every_scheme_and_step_is_probed(tmp_path):
    sweep = {"scheme": ["modal", "exact", "paper"], "time_step": [1e-6, 2e-6]}
    design = design_of({"scene": {"duration": 0.01}, "sweep": sweep})
    found = forecast(design, tmp_path)
    assert found.probed == 6


def test_cases_that_end_early_are_expected_where_they_were_met(tmp_path, monkeypatch):
    """Half of the cases end after a tenth of their run: that is what all will take."""
    document = SHORT | {"output": {"traces": "summary"}}
    design = design_of(document)

    def early(*_):
        full = 1000 * 1e-6  # s, of the rate that the probes below have
        ends = {case: full * (0.1 if case < 3 else 1.0) for case in range(6)}
        return Rehearsal(seconds=ends, rows={}, overhead=0.25)

    monkeypatch.setattr(forecasts, "rehearse", early)
    monkeypatch.setattr(forecasts, "_probe", lambda *_: False)
    found = forecast(design, tmp_path)
    assert found.seconds == pytest.approx(1000 * 1e-6 * (3 * 0.1 + 3), rel=0.02)
    assert found.range[1] > found.seconds
    one, two = (found.wall(ranks)[0] for ranks in (1, 2))
    saved = one - two + found.launch
    assert saved == pytest.approx((found.seconds + 6 * 0.25) / 2)


@pytest.mark.parametrize("longest", [0.0, 8e-3])
def test_what_all_would_take_to_their_end_is_of_the_steps_that_were_made(
    tmp_path, monkeypatch, longest
):
    """In contact a step takes thrice what the probes say; cases end early or do not."""
    ends = {0: (1000, -1.0, 1.0), 2: (500, -1.0, 0.5), 4: (1000, 1e-3, 0.5)}
    solver = SHORT["solver"]
    if longest:
        solver = solver | {"until": "decided", "longest": longest}
        ends[5] = (4000, -1.0, 4.0)  # undecided, it went on
    output = {"traces": "summary"}
    design = design_of(SHORT | {"output": output, "solver": solver})
    rows = {
        case: {"steps": steps, "certificate": proved, "duration": 2e-3}
        for case, (steps, proved, _) in ends.items()
    }
    spent = {case: 3e-3 * part for case, (_, _, part) in ends.items()}

    def probed(_, case, costs):
        costs.learn([case], 1e-3)
        return True

    monkeypatch.setattr(forecasts, "_probe", probed)
    monkeypatch.setattr(
        forecasts, "rehearse", lambda *_: Rehearsal(seconds=spent, rows=rows)
    )
    found = forecast(design, tmp_path)
    assert found.most == pytest.approx(6 * 3e-3 * max(longest / 2e-3, 1.0))
    assert found.seconds < found.most


def test_a_case_that_was_cut_off_tells_only_how_far_it_came(tmp_path, monkeypatch):
    design = design_of(SHORT | {"output": {"traces": "summary"}})
    monkeypatch.setattr(forecasts, "rehearse", lambda *_: Rehearsal(reached=0.2))
    found = forecast(design, tmp_path)
    assert found.range[0] == pytest.approx(0.2 * found.seconds)
    assert found.range[1] == pytest.approx(found.most)


def test_a_rehearsal_leaves_nothing_and_computes_what_the_campaign_does(tmp_path):
    design = design_of(SHORT | {"output": {"traces": "summary"}})
    out = tmp_path / "not there yet"
    found = rehearse(design, out, drawn(range(6)), 30.0, lambda: False)
    assert not any(tmp_path.iterdir())
    prepare(design, out)
    assert run_campaign(design, out).failed == 0
    rows = {r["case"]: r["row"] for r in read_records(out).values()}
    assert found.rows == rows
    assert found.overhead > 0.0


def test_a_wish_to_stop_ends_a_rehearsal_at_once(tmp_path):
    design = design_of(SHORT | {"output": {"traces": "summary"}})
    found = rehearse(design, tmp_path, drawn(range(6)), 30.0, lambda: True)
    assert not found.seconds
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize("count", [1, 2, 5, 78, 1000])
def test_the_first_drawn_cases_lie_evenly_over_all(count):
    found = drawn(range(count))
    assert len(set(found)) == len(found) == min(count, 256)
    for taken in (4, 16, 64):
        if taken <= len(found) < count or taken < count // 4:
            edges = [0, *sorted(found[:taken]), count]
            widest = max(b - a for a, b in itertools.pairwise(edges))
            assert widest <= 3 * count / taken


def test_followers_are_those_of_the_rule_where_all_words_are_known():
    document = SHORT | {
        "sweep": {"speed": [100.0, 200.0, 300.0], "friction": [0.0, 0.1, 0.2]},
        "refine": {"over": ["speed", "friction"], "levels": 3},
    }
    design = design_of(document)
    coarse = design.family.coarse
    alike = dict.fromkeys(coarse, "damped")
    assert followers(design, alike) == (0, 0)
    split = {a: "damped" if a.point[0] == 0 else "sustained" for a in coarse}
    count, again = followers(design, split)
    # a straight boundary: each level adds the middle column and halves its cells
    assert (count, again) == (_straight(design, split), 0)


def _straight(design, words):
    """Return the followers of words that are those of the nearest speed."""
    growth = design.family.growth()
    half = 1 << (design.family.lattice.sides[0].depth - 1)

    def word(address):
        return "damped" if address.point[0] <= half else "sustained"

    growth.feed(word, list(growth.wanted))
    return len(growth.wanted) - len(words)


def test_a_dry_run_tells_the_wall_time_on_as_many_ranks_as_asked(tmp_path, capsys):
    (tmp_path / "c.toml").write_text("[scene]\nduration = 0.05\n")
    words = ["campaign", str(tmp_path / "c.toml"), "--out", str(tmp_path / "o")]
    assert main([*words, "--dry-run", "--json", "--ranks", "128"]) == 0
    assert json.loads(capsys.readouterr().out)["wall_seconds"]["ranks"] == 128
    for options, told in (
        (["--ranks", "128"], "mpirun -n 128"),
        (["--dry-run", "--ranks", "0"], "--ranks must be >= 1"),
    ):
        assert main([*words, *options]) == 2
        err = capsys.readouterr().err
        assert told in err
        assert err.count("\n") == 1
    assert not (tmp_path / "o").exists()
