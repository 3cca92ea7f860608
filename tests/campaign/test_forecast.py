"""What --dry-run and --pilot say beforehand is what there is afterwards."""

import itertools
import json
import re
from types import SimpleNamespace

import numpy as np
import pytest
import tomli_w
from launch import BARE, launch, root_variables
from rotor_files import written
from stage import N
from stage import rotor as small_rotor

from hpcwhirl.campaign.begin import Policy, prepare
from hpcwhirl.campaign.foresight import forecast as forecasts
from hpcwhirl.campaign.foresight.forecast import forecast
from hpcwhirl.campaign.foresight.foreseen import followers
from hpcwhirl.campaign.foresight.growth import foretold
from hpcwhirl.campaign.plan import cost as costs
from hpcwhirl.campaign.plan.cost import Costs, time_steps
from hpcwhirl.campaign.plan.design import Design, design_of
from hpcwhirl.campaign.run import run_campaign
from hpcwhirl.campaign.work_queue import Order, WorkQueue
from hpcwhirl.case.limits import step_counts
from hpcwhirl.cli import main
from hpcwhirl.cli.forecast import _between, _brief, _lines, _size
from hpcwhirl.scene import schemes
from hpcwhirl.scene.batch_validation import end_times
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.directory.journal import Journal, Journals
from hpcwhirl.store.directory.runs import Runs

SHORT = {
    "scene": {"duration": 2e-3},
    "solver": {"time_step": 2e-6},
    "sweep": {"speed": [300.0, 410.0], "friction": [0.0, 0.05, 0.1]},
}


def size(folder, name):
    path = folder / name
    files = [path] if path.is_file() else list(path.iterdir())
    return sum(file.stat().st_size for file in files)


@pytest.mark.turns
@pytest.mark.parametrize("detail", ["summary", "blades", "orbit", "full"])
def test_bytes_on_disk_are_predicted_within_a_few_percent(tmp_path, detail):
    output = {"traces": detail, "interval": 2e-6 if detail == "orbit" else 5e-5}
    design = design_of(SHORT | {"output": output})
    told = forecast(design, Directory(tmp_path)).disk
    prepare(design, Directory(tmp_path))
    assert run_campaign(design, Directory(tmp_path)).failed == 0
    found = size(tmp_path, "results.h5")
    assert told.results == pytest.approx(found, rel=0.03, abs=4096)  # a page of HDF5's
    assert told.traces == size(tmp_path, "traces")
    assert told.journal == pytest.approx(size(tmp_path, "journal"), rel=0.1)


@pytest.mark.turns
@pytest.mark.parametrize(("rules", "pictures"), [
    ({}, {"map", "page"}), ({"map": "no"}, {"page"}), ({"report": "no"}, {"map"}),
    ({"report": "yes"}, {"map", "page"}),
])  # fmt: skip
@pytest.mark.parametrize("most", [5, 6])
def test_only_what_will_be_drawn_is_foreseen(
    tmp_path, monkeypatch, capsys, rules, pictures, most
):
    monkeypatch.setattr("hpcwhirl.scene.campaign_tables.MOST_ON_PAGE", most)
    wanted = pictures if most == 6 or rules.get("report") else pictures - {"page"}
    design = design_of(SHORT | {"campaign": rules})
    found = forecast(design, Directory(tmp_path / "out"))
    assert found.after.keys() == {"gather"} | wanted
    assert min(found.after.values()) > 0.0
    said = [word for n, v in rules.items() for word in (f"--{n}", v)]
    file = tmp_path / "c.toml"
    file.write_text(tomli_w.dumps(SHORT))
    asked = ["campaign", str(file), "--dry-run", "--json", *said]
    assert main([*asked, "--out", str(tmp_path / "out")]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["seconds_after"].keys() == found.after.keys()


@pytest.mark.turns
@pytest.mark.parametrize("sweep", [
    {"traces": ["summary", "orbit", "full"], "blades": [12, 22]},
    {"traces": ["summary", "orbit"], "rotation": ["full"], "lost_blade": [-1, 3],
     "amplitude_limit": [0.5]},
])  # fmt: skip
def test_what_any_case_keeps_is_foreseen_whichever_comes_first(tmp_path, sweep):
    interval = 5e-5 if "full" in sweep["traces"] else 2e-6
    design = design_of({**SHORT, "sweep": sweep, "output": {"interval": interval}})
    told = forecast(design, Directory(tmp_path)).disk
    prepare(design, Directory(tmp_path))
    assert run_campaign(design, Directory(tmp_path)).failed == 0
    assert told.results == pytest.approx(size(tmp_path, "results.h5"), rel=0.03)


@pytest.mark.turns
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
    steps, whole = time_steps(design), forecast(design, Directory(tmp_path)).disk
    assert len(set(steps)) > 1
    for most in (11, 4):  # kinds: 12, and 4 without the speed
        monkeypatch.setattr(costs, "MOST_MODELS", most)
        assert np.array_equal(time_steps(design), steps)
        assert forecast(design, Directory(tmp_path)).disk == whole
    monkeypatch.setattr(costs, "MOST_MODELS", 1)
    assert set(time_steps(design)) < set(steps)
    prepare(design, Directory(tmp_path))
    assert run_campaign(design, Directory(tmp_path)).failed == 0
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


@pytest.mark.turns
def test_what_is_finished_is_learned_from_and_not_counted(tmp_path):
    design = design_of(SHORT | {"output": {"traces": "summary"}})
    before = forecast(design, Directory(tmp_path))
    assert (before.cases, before.left, before.finished) == (6, 6, 0)
    assert 0.0 < before.range[0] < before.seconds < before.range[1]  # nominal
    prepare(design, Directory(tmp_path))
    run_campaign(design, Directory(tmp_path))
    more = SHORT["sweep"] | {"speed": [300.0, 350.0, 410.0]}
    after = forecast(
        design_of(SHORT | {"output": {"traces": "summary"}, "sweep": more}),
        Directory(tmp_path),
    )
    assert (after.cases, after.left, after.finished) == (9, 3, 6)
    assert after.range[0] <= after.seconds <= after.range[1]
    assert after.steps == pytest.approx(3 * 1000)


def test_a_dry_run_computes_nothing_and_leaves_nothing(tmp_path, monkeypatch, capsys):
    def marched(*_):
        pytest.fail("a dry run marches nothing")

    monkeypatch.setattr("hpcwhirl.dynamics.march.March.advance", marched)
    file = tmp_path / "c.toml"
    file.write_text("sweep = {speed = [300, 410]}\noutput = {traces = 'summary'}\n")
    words = ["campaign", str(file), "--out", str(tmp_path / "out"), "--dry-run"]
    assert main(words) == 0
    out = capsys.readouterr().out
    assert "nominal; --pilot SECONDS" in out
    assert re.search(r"\nnominal: \S+ to \S+ core-hours, if none ends early\n", out)
    assert [path.name for path in tmp_path.iterdir()] == ["c.toml"]


def finished(design, folder, rows, share=None):
    """Make a directory in which some cases have ended.

    rows : {case: (steps, s without steps proved or -1, seconds of computing)}
    """
    prepare(design, Directory(folder))
    with Journal(Journals(folder), 1, 0, design.digests.identity) as journal:
        for case, (steps, proved, seconds) in rows.items():
            record = {
                "case": case, "digest": design.digest(case), "status": "ok",
                "performance": {"seconds": seconds, "rank": 0, "host": "n"},
                "row": {"steps": steps, "certificate": proved, "duration": 2e-3,
                        "outcome": "completed", "regime": "damped", "stop": "end"},
            }  # fmt: skip
            journal.append(record, {})
    if share:
        own = {"rank": 0, "host": "n", "cases": len(rows), "busy": 1.0, "span": 1.0}
        Runs(folder).write(1, [own | share])


def test_cases_that_end_early_are_expected_where_they_were_met(tmp_path):
    """Half of the cases end after a tenth of their run: that is what all will take."""
    sweep = {"speed": [300.0, 410.0], "friction": [0.01 * i for i in range(20)]}
    design = design_of(SHORT | {"output": {"traces": "summary"}, "sweep": sweep})
    ends = dict.fromkeys(range(20, 40, 2), (1000, -1.0, 0.001))
    ends |= dict.fromkeys(range(0, 20, 2), (100, -1.0, 0.0001))
    finished(design, tmp_path, ends, {"beside": 0.25, "first": 0.5})
    found = forecast(design, Directory(tmp_path))
    assert found.left == 20
    assert found.seconds == pytest.approx(10 * 1e-3 + 10 * 1e-4, rel=0.02)
    assert found.range[1] > found.seconds
    assert found.before["models"] == 0.5
    one, two = (found.wall(ranks)[0] for ranks in (1, 2))
    saved = one - two + found.launch
    assert saved == pytest.approx((found.seconds + 20 * 0.25) / 2)


@pytest.mark.parametrize("count", [2, 3, 5, 10, 20])
@pytest.mark.parametrize("early", [0.0, 0.7, 0.92])
def test_a_range_holds_however_few_cases_have_finished(count, early):
    """Of 100 cases, a share ends early, in a tenth of the time."""
    rng, held = np.random.default_rng(1), 0
    every = np.where(np.arange(100) < 100 * early, 0.1, 1.0) * rng.normal(1, 0.1, 100)
    for _ in range(300):
        done = rng.permutation(100) < count
        seconds = every[done].mean() * (100 - count)
        whole = max(seconds, 100.0 - count)
        low, high = forecasts._range(seconds, every[done], whole)
        held += low <= every[~done].sum() <= high
    assert held >= 0.8 * 300


@pytest.mark.parametrize("longest", [0.0, 8e-3])
def test_what_all_would_take_to_their_end_is_of_the_steps_that_were_made(
    tmp_path, longest
):
    """Of three cases one was cut short and one ended by proof, at 3 us a step each."""
    ends = {0: (1000, -1.0, 3e-3), 2: (500, -1.0, 1.5e-3), 4: (1000, 1e-3, 1.5e-3)}
    solver = SHORT["solver"]
    if longest:
        solver = solver | {"until": "decided", "longest": longest}
        ends[5] = (4000, -1.0, 12e-3)  # undecided, it went on
    design = design_of(SHORT | {"output": {"traces": "summary"}, "solver": solver})
    finished(design, tmp_path, ends)
    found = forecast(design, Directory(tmp_path))
    left = 6 - len(ends)
    assert found.most == pytest.approx(left * 3e-3 * max(longest / 2e-3, 1.0))
    assert found.seconds < found.most


@pytest.mark.slow
def test_a_pilot_keeps_what_it_computed_and_the_campaign_goes_on_from_it(
    tmp_path, capsys
):
    """The cases of the pilot lie evenly over all, and none is computed again."""
    file, out = tmp_path / "c.toml", tmp_path / "out"
    speeds = ", ".join(str(300 + i) for i in range(400))
    file.write_text(
        "scene = {duration = 0.02}\nsolver = {time_step = 2e-6}\n"
        f"output = {{traces = 'summary'}}\nsweep = {{speed = [{speeds}]}}\n"
    )
    words = ["campaign", str(file), "--out", str(out), "--json"]
    assert main([*words, "--pilot", "0.5"]) == 0
    told = json.loads(capsys.readouterr().out)
    first = Journals(out).newest()
    assert 0 < len(first) < 400
    assert told["learned_from"] == {"finished": len(first)}
    assert told["left"] == 400 - len(first)
    low, high = told["core_hours_range"]
    assert low <= told["core_hours"] <= high
    edges = [-1, *sorted(record["case"] for record in first.values()), 400]
    widest = max(b - a for a, b in itertools.pairwise(edges))
    assert widest <= 4 * 400 / len(first)
    assert not (out / "results.h5").exists()
    assert main([*words, "--set", "duration=0.02"]) == 0
    after = Journals(out).newest()
    assert len(after) == 400
    assert all(after[name] == record for name, record in first.items())


@pytest.mark.slow
@pytest.mark.mpi
def test_a_pilot_changes_no_bit_on_any_number_of_ranks(tmp_path):
    file, out, whole = (tmp_path / name for name in ("c.toml", "out", "whole"))
    speeds = ", ".join(str(300 + i) for i in range(120))
    file.write_text(
        f"{BARE}scene = {{duration = 0.2}}\n"
        "solver = {time_step = 2e-6}\n"
        f"output = {{interval = 1e-3}}\nsweep = {{speed = [{speeds}]}}\n"
    )
    words = ("campaign", file, "--out", out)
    done = launch(*words, "--pilot", 0.3, ranks=2)
    assert done.returncode == 0, done.err
    assert "learned from" in done.out
    assert launch(*words, ranks=3).returncode == 0
    assert launch("campaign", file, "--out", whole).returncode == 0
    assert root_variables(out) == root_variables(whole)


@pytest.mark.turns
def test_a_pilot_in_which_all_ends_is_the_campaign(tmp_path, capsys):
    file, out = tmp_path / "c.toml", tmp_path / "out"
    file.write_text(
        "scene = {duration = 2e-3}\nsolver = {time_step = 2e-6}\n"
        "sweep = {speed = [300, 410]}\n"
    )
    words = ["campaign", str(file), "--out", str(out), "--pilot", "300"]
    assert main(words) == 0
    assert str(out / "results.h5") in capsys.readouterr().out
    for wrong in ("0", "-1", "nan", "inf"):
        assert main([*words[:-1], wrong]) == 2
        assert "--pilot must be a number of seconds > 0" in capsys.readouterr().err
    assert main([*words, "--dry-run"]) == 2


@pytest.mark.parametrize("count", [5, 78, 1000])
def test_the_first_cases_of_a_pilot_lie_evenly_over_all(count):
    """Whatever they are predicted to take; those that follow go out last."""
    nominal = np.linspace(1.0, 50.0, count)
    costs = Costs(nominal, np.zeros((count, 1)))
    queue = WorkQueue(range(count), costs, order=Order(even=True))
    found = [queue.take() for _ in range(count - 1)]
    for taken in (4, 16, 64):
        if taken < count // 4:
            edges = [0, *sorted(found[:taken]), count]
            widest = max(b - a for a, b in itertools.pairwise(edges))
            assert widest <= 3 * count / taken
    rest = queue.take()
    assert sorted([*found, rest]) == [*range(count)]


def test_a_policy_without_a_pilot_has_no_even_order():
    nominal = np.array([1.0, 3.0, 2.0])
    queue = WorkQueue(range(3), Costs(nominal, np.zeros((3, 1))))
    assert [queue.take() for _ in range(3)] == [1, 2, 0]
    assert Policy().pilot is None


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


@pytest.mark.parametrize(
    ("sweep", "distinct"),
    [
        ({"scheme": ["modal", "general"], "rotation": ["none", "full"]}, 4),
        ({"scheme": ["modal", "paper"], "blades": [11, 22]}, 4),
        ({"mistuning": [[], [0.01] * 22, [0.02] * 22]}, 2),
    ],
)
def test_the_nominal_cost_of_a_step_is_that_of_its_kind(sweep, distinct, tmp_path):
    document = SHORT | {"sweep": sweep, "output": {"traces": "summary"}}
    design = design_of(document)
    each = [design.predicted(case)[1] for case in range(len(design.settings))]
    assert len(set(each)) == distinct
    found = forecast(design, Directory(tmp_path))
    assert found.seconds == pytest.approx(sum(each))
    limits = [sum(costs.costs_of(design, share=x).nominal) for x in (0.0, 1.0)]
    assert found.range == pytest.approx(limits)


def with_points(folder, count):
    """Return the engine of a small rotor from file with so many points a tip."""
    places = 0.01 * np.arange(count)
    arrays = small_rotor(places, 0.0 * places, 0.0 * places)
    if count == 1:
        arrays |= {n: arrays[n][:, 0] for n in ("tip_radial", "tip_tangential")}
        arrays = {n: a for n, a in arrays.items() if not n.startswith("tip_")} | {
            n: arrays[n] for n in ("tip_radial", "tip_tangential")
        }
    file = written(folder / f"{count}.h5", arrays)
    return {"file": str(file), "rotor": {"blades": N}}


@pytest.mark.parametrize("points", [2, 3, 16])
def test_the_nominal_cost_knows_the_contact_points_of_a_file(tmp_path, points):
    """In flight and in contact, the factors of the scheme."""
    designs = [
        design_of(SHORT | {"engine": with_points(tmp_path, n)}) for n in (1, points)
    ]
    for share, (first, each) in ((0.0, schemes.EQUAL.still),
                                 (1.0, schemes.EQUAL.pressed)):  # fmt: skip
        one, several = (costs.costs_of(d, share=share).nominal for d in designs)
        assert several == pytest.approx((first + each * points) * one)
    usual = costs.costs_of(designs[1]).nominal
    cases = range(len(usual))
    predicted = [designs[1].predicted(case)[1] for case in cases]
    assert usual.tolist() == pytest.approx(predicted)


def test_files_that_are_swept_cost_as_their_own_points(tmp_path):
    files = [with_points(tmp_path, n)["file"] for n in (1, 3)]
    engine = {"rotor": {"blades": N}}
    design = design_of(SHORT | {"engine": engine, "sweep": {"engine.file": files}})
    one, several = costs.costs_of(design, share=1.0).nominal
    assert several == pytest.approx(3.0 * one)
    assert costs.most_points(design) == 3


@pytest.mark.turns
@pytest.mark.parametrize(("points", "told"), [(3, False), (16, True)])
def test_a_cost_beyond_the_points_measured_is_told(tmp_path, capsys, points, told):
    document = SHORT | {"engine": with_points(tmp_path, points)}
    (tmp_path / "one.toml").write_text(tomli_w.dumps(document))
    words = ["campaign", str(tmp_path / "one.toml"), "--out", str(tmp_path / "out")]
    assert main([*words, "--dry-run"]) == 0
    clause = f"; {points} contact points a tip, extrapolated from up to 3"
    assert (clause in capsys.readouterr().out) == told


@pytest.mark.parametrize("name", schemes.NAMES)
def test_a_nominal_step_grows_in_proportion_to_the_share_of_contact(name):
    def step(share, blades=22):
        return schemes.SCHEMES[name].step_seconds(
            "none", blades, uneven=False, share=share
        )

    usual = schemes.USUAL[0]
    assert step(usual) == pytest.approx(schemes.SCHEMES[name].nominal)
    for blades in (22, 88):
        low, middle, high = (step(share, blades) for share in (0.0, usual, 1.0))
        assert 0.0 < low < high
        assert middle == pytest.approx(low + usual * (high - low))


def test_bytes_are_told_by_the_unit_that_leaves_three_digits():
    sizes = {123_456: "123 kB", 2.5e15: "2.5e+03 TB", 1000: "1 kB", 999: "999 B"}
    for size, told in sizes.items():
        assert _size(size) == told


def test_where_no_case_is_left_no_step_and_no_cost_of_a_case_is_told():
    cost = SimpleNamespace(
        cases=22, left=0, finished=22, range=(0.0, 0.0), steps=0, seconds=0.0, most=0.0,
        wall=lambda _: (10.0, (8.0, 13.0)), before={"start": 6.0}, after={"map": 4.0},
        overhead=1.2, disk=SimpleNamespace(results=6e6, traces=7e6, journal=3e4),
    )  # fmt: skip
    design = SimpleNamespace(swept=["speed"], twins=None, grows=False)
    text = "\n".join(_lines(cost, design, 1))
    assert "22 cases over speed, 0 left\nno case is left to compute\nwall time" in text
    assert "each" not in text
    assert "a case in addition" not in text
    assert "6 MB results.h5" in text


@pytest.mark.parametrize(
    ("seconds", "told"), [(4.83e-3, "4.8 ms"), (0.072, "72 ms"), (1.23, "1.2 s")]
)
def test_the_cost_of_a_case_has_no_exponent(seconds, told):
    assert _brief(seconds) == told


def test_a_span_of_equal_times_is_told_once():
    assert _between((18.2, 18.4)) == "18 s"
    assert _between((2.0, 80.0)) == "2.0 s to 80 s"


@pytest.mark.turns
def test_a_dry_run_tells_in_how_many_cases_a_free_motion_grows(tmp_path, capsys):
    file = tmp_path / "c.toml"
    file.write_text(
        '[engine]\nrotation = "full"\n[engine.rotor]\nblades = 5\n'
        "suspension_damping = -1.0\n[solver]\nmodes = 10\n"
        "[sweep]\nspeed = [100.0, 200.0, 800.0, 900.0]\n"
    )
    assert main(["campaign", str(file), "--dry-run", "--out", str(tmp_path / "o")]) == 0
    told = capsys.readouterr().err
    speeds = [100.0, 200.0, 800.0, 900.0]
    design = Design.of(file)
    grows = [design.resolved(i).plan.growth > 0.0 for i in range(4)]
    assert 0 < sum(grows) < 4
    assert f"in {sum(grows)} of 4 cases" in told
    assert f"at {speeds[grows.index(True)]:g} to 900 rad/s" in told


@pytest.mark.turns
def test_a_dry_run_tells_which_cases_their_model_refuses():
    rotor = {"blades": 6, "elements": 2, "lost_blade": 0}
    tables = {
        "engine": {"rotation": "full", "rotor": rotor},
        "solver": {"modes": 14},
        "sweep": {"amplitude_limit": [1e-4, 50.0]},
    }
    line, *_ = foretold(design_of(tables))
    assert re.match(r"1 of 2 cases will be refused, the first case 0: amplitude_", line)
    tables["sweep"] = {"amplitude_limit": [40.0, 50.0]}
    assert not any("refused" in line for line in foretold(design_of(tables)))
