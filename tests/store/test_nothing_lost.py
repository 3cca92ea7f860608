"""Nothing is lost or mixed without a word: changed engines, edited plans, odd files."""

import hashlib
import json
import os
import re
import shutil

import h5py
import pytest
from journals import journal_of
from launch import BARE, records
from specimen import begin

from hpcwhirl.campaign import evaluate
from hpcwhirl.campaign.begin import prepare
from hpcwhirl.campaign.plan.cost import costs_of
from hpcwhirl.campaign.plan.design import design_of, load_design
from hpcwhirl.campaign.progress import progress_of
from hpcwhirl.campaign.run import run_campaign
from hpcwhirl.campaign.work import share
from hpcwhirl.cli import main
from hpcwhirl.errors import MissingFileError, StoreError
from hpcwhirl.launch import Shard
from hpcwhirl.scene.words import ENUMS
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.directory.heartbeats import Notes, Running
from hpcwhirl.store.directory.journal import Journal, Journals, listed
from hpcwhirl.store.directory.manifest import SEALED, PlanFile
from hpcwhirl.store.directory.record import sealed
from hpcwhirl.store.directory.runs import Runs
from hpcwhirl.store.results.gather import gather

pytestmark = pytest.mark.turns


def statuses(folder):
    with h5py.File(folder / "results.h5") as file:
        words = [ENUMS["status"][i] for i in file["status"][:]]
        return words, [text.decode() for text in file["message"][:]]


# An engine that changes while a campaign runs


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    path = tmp_path_factory.mktemp("engine") / "rotor.h5"
    small = ("blades=6", "engine.rotor.elements=3", "modes=18")
    words = [word for setting in small for word in ("--set", setting)]
    assert main(["export-model", str(path), *words]) == 0
    return path


ENGINE = (
    BARE
    + """
scene = {duration = 1e-3}
solver = {time_step = 2e-6}
output = {interval = 5e-5, traces = "summary"}
engine.rotor = {blades = 6}
"""
)


@pytest.fixture
def engine(exported, tmp_path):
    """Return a campaign of three speeds and two engines, and a function that spoils."""
    paths = [shutil.copy(exported, tmp_path / name) for name in ("a.h5", "b.h5")]
    files = [str(path) for path in paths]
    swept = f'sweep = {{speed = [300, 310, 320], "engine.file" = {files}}}'
    (tmp_path / "engine.toml").write_text(ENGINE + swept)

    def spoil(path=paths[0]):
        with h5py.File(path, "r+") as file:
            file["rotor/stiffness"][0, 0] *= 1.01

    return tmp_path / "engine.toml", spoil, paths


@pytest.mark.parametrize("when", ["before", "while"])
def test_an_engine_that_changes_meanwhile_fails_its_cases_by_name(
    engine, tmp_path, monkeypatch, capsys, when
):
    file, spoil, paths = engine
    shutil.copy(paths[0], tmp_path / "kept.h5")
    compute, computed = evaluate.compute, []

    def compute_and_change(case, *others, **options):
        computed.append(case)
        if len(computed) == 2 and when == "before":
            spoil()
        result = compute(case, *others, **options)
        if len(computed) == 2 and when == "while":
            spoil()
        return result

    monkeypatch.setattr(evaluate, "compute", compute_and_change)
    call = ["campaign", str(file), "--out", str(tmp_path / "out")]
    assert main(call) == 1
    words, messages = statuses(tmp_path / "out")
    assert "missing" not in words
    design = load_design(file, {})
    for case, (word, message) in enumerate(zip(words, messages, strict=True)):
        if word == "ok":
            continue
        assert word == "failed"
        assert f"engine.file {paths[0]} has changed" in message
        assert design.scenes[case].engine.file == str(paths[0])
    assert 0 < words.count("failed") <= 3
    assert f"{words.count('failed')} of 6 cases failed" in capsys.readouterr().err
    shutil.copy(tmp_path / "kept.h5", paths[0])
    monkeypatch.setattr(evaluate, "compute", compute)
    assert main([*call, "--retry", "failed"]) == 0
    assert set(statuses(tmp_path / "out")[0]) == {"ok"}


def test_records_go_under_the_digests_of_the_plan_on_every_rank(engine):
    file, spoil, _ = engine
    design = load_design(file, {})
    function, values = design.__reduce__()
    elsewhere = function(*values)  # as a rank gets it
    spoil()
    assert [elsewhere.digest(case) for case in range(6)] == list(design.digests)
    assert design.manifest().digests == list(design.digests)
    with pytest.raises(Exception, match=r"engine\.file \S+a\.h5 has changed"):
        elsewhere.check_engine(0)
    elsewhere.check_engine(1)


# Missing cases


def test_a_gather_of_what_is_not_complete_says_so_and_ends_with_1(tmp_path, capsys):
    begin(tmp_path, one_interval=True)
    assert main(["gather", str(tmp_path)]) == 1
    told = capsys.readouterr()
    assert told.out == f"{tmp_path / 'results.h5'}\n"
    assert "2 of 5 cases have no result: 1 failed, 1 missing" in told.err


def test_a_gather_of_what_is_complete_ends_with_0(finished, tmp_path, capsys):
    shutil.copytree(finished, tmp_path / "out")
    assert main(["gather", str(tmp_path / "out")]) == 0
    assert capsys.readouterr().err == ""


SHORT = (
    BARE
    + """
scene = {duration = 2e-3}
solver = {time_step = 2e-6}
output = {interval = 5e-5}
sweep = {speed = [300, 350, 410]}
"""
)


@pytest.fixture
def short(tmp_path):
    (tmp_path / "short.toml").write_text(SHORT)
    return ["campaign", str(tmp_path / "short.toml"), "--out", str(tmp_path / "out")]


def lose(monkeypatch, case):
    """Let the record of a case get lost between its journal and the end."""
    append = Journal.append

    def keep_others(self, record, traces):
        if record["case"] != case:
            append(self, record, traces)

    monkeypatch.setattr(Journal, "append", keep_others)


def test_no_campaign_ends_with_0_while_a_case_has_no_row(
    short, tmp_path, monkeypatch, capsys
):
    with monkeypatch.context() as patch:
        lose(patch, 1)
        assert main(short) == 1
    assert "1 of 3 cases failed, 1 of them without a row" in capsys.readouterr().err
    assert statuses(tmp_path / "out")[0] == ["ok", "missing", "ok"]
    assert main(short) == 0
    assert statuses(tmp_path / "out")[0] == ["ok"] * 3


def test_a_shard_fails_by_its_own_cases_and_the_last_by_all(
    short, tmp_path, monkeypatch, capsys
):
    design = load_design(tmp_path / "short.toml", {})
    first, second = (sorted(share(costs_of(design).steps, Shard(i, 2))) for i in (1, 2))
    with monkeypatch.context() as patch:
        lose(patch, first[0])
        assert main([*short, "--shard", "1/2"]) == 1  # its own, without a row
    assert not (tmp_path / "out/results.h5").exists()
    assert main([*short, "--shard", "1/2"]) == 0  # others are still to come
    shutil.copytree(tmp_path / "out", tmp_path / "lost")
    assert main([*short, "--shard", "2/2"]) == 0
    assert "results.h5" in capsys.readouterr().out
    digest = design.digests[first[0]]
    failure = {"case": first[0], "digest": digest, "status": "failed", "message": "x"}
    with Journal(
        Journals(tmp_path / "lost"), Journals(tmp_path / "lost").claim_run(), 0
    ) as journal:
        journal.append(failure | {"performance": {}}, {})
    short[3] = str(tmp_path / "lost")
    assert main([*short, "--shard", "2/2"]) == 1  # it gathers, and one has failed
    assert "1 of 3 cases failed" in capsys.readouterr().err
    assert len(second) < 3


# Many runs


def failed(digest, **news):
    return {
        "digest": digest,
        "status": "failed",
        "message": "",
        "performance": {},
    } | news


def test_the_ten_thousandth_run_is_newer_than_the_one_before(tmp_path):
    for run, told in (
        (9999, "old"),
        (10_000, "new"),
        (2, "first"),
        (100_000, "newest"),
    ):
        with Journal(Journals(tmp_path), run, 0) as journal:
            journal.append(failed("d0", message=told), {})
        if run != 2:
            assert Journals(tmp_path).newest()["d0"]["message"] == told
    names = [name.partition("-")[0] for name in Journals(tmp_path).by_file()]
    assert names == ["0002", "9999", "10000", "100000"]
    assert Journals(tmp_path).next_run() == 100_001
    for rank in (100_000, 99_999):
        with Journal(Journals(tmp_path), 100_001, rank) as journal:
            journal.append(failed("d0", message=str(rank)), {})
    assert Journals(tmp_path).newest()["d0"]["message"] == "100000"


def test_times_of_ranks_stand_in_the_order_of_the_runs(tmp_path):
    share = {"rank": 0, "host": "n", "cases": 1, "busy": 1.0, "span": 2.0}
    for run in (9999, 10_000, 3):
        Runs(tmp_path).write(run, [share])
    assert [one["run"] for one in Runs(tmp_path).shares()] == [3, 9999, 10_000]


def test_odd_names_count_as_the_oldest_and_give_no_run_number(tmp_path):
    (tmp_path / "journal").mkdir()
    for name in ("x", "²-0", "0001-00000 (copy)", "9" * 200 + "-0", "-", "0002"):
        (tmp_path / f"journal/{name}.log").write_bytes(
            journal_of([failed("d0", message=name)])
        )
    with Journal(Journals(tmp_path), 1, 0) as journal:
        journal.append(failed("d1"), {})
    assert Journals(tmp_path).newest()["d0"]["message"] == "0002"
    assert Journals(tmp_path).next_run() == 3
    assert len(listed(tmp_path / "journal", ".log")) == 7


# The plan


def edited(folder, old, new):
    path = folder / "campaign.json"
    text = path.read_text()
    assert text.count(old) >= 1
    path.write_text(text.replace(old, new, 1))


@pytest.mark.parametrize(
    ("old", "new"), [("350.0", "351.0"), ("{", "{ "), ("\n}", " }")]
)
def test_an_edited_plan_is_refused_by_all_who_read_it(tmp_path, capsys, old, new):
    begin(tmp_path, one_interval=True)
    assert main(["gather", str(tmp_path)]) == 1
    before = (tmp_path / "results.h5").read_bytes()
    edited(tmp_path, old, new)
    capsys.readouterr()
    for command in ("gather", "status"):
        assert main([command, str(tmp_path)]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert "campaign.json is damaged" in line
    assert (tmp_path / "results.h5").read_bytes() == before


def rewritten(folder, change, *, is_sealed=True):
    """Write other content of a plan, with a seal that fits or without one."""
    path = folder / "campaign.json"
    data = json.loads(path.read_text()) | change
    del data["seal"]
    body = json.dumps(data, indent=1).encode()
    seal = SEALED % hashlib.sha256(body).hexdigest().encode()
    path.write_bytes(seal + body[2:] if is_sealed else body)


def test_a_plan_without_a_seal_is_refused(tmp_path):
    prepare(design_of({"sweep": {"speed": [300, 310.0]}}), Directory(tmp_path))
    plan = PlanFile(tmp_path).read()
    rewritten(tmp_path, {})
    assert PlanFile(tmp_path).read() == plan
    rewritten(tmp_path, {}, is_sealed=False)
    with pytest.raises(StoreError, match="was edited: it has no seal"):
        PlanFile(tmp_path).read()


@pytest.mark.parametrize(
    "change",
    [
        {"cases": [{}]}, {"cases": 3}, {"cases": [[{"weight": [1]}]]}, {"swept": [1]},
        {"reads": [None] * 5}, {"base": []}, {"engine": 1}, {"more": 1},
        {"settings": [{}]},
    ],
)  # fmt: skip
def test_a_plan_of_other_types_is_one_line(tmp_path, capsys, change):
    begin(tmp_path, one_interval=True)
    rewritten(tmp_path, change)
    assert main(["gather", str(tmp_path)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.endswith("is damaged: its keys are not those of a campaign")


# Damaged notes


@pytest.mark.parametrize(
    "text",
    [
        "{}", "[]", "3", '{"run": 1, "ranks": [{"rank": 0}]}', "\xff",
        '{"run": 1, "ranks": [3]}', "[" * 5000,
        '{"run": 1, "ranks": [{"rank": 0, "host": 1, "cases": 1, "busy": 1}]}',
        '{"run": 1, "ranks": [{"rank": 0, "host": "n", "cases": 1' + "0" * 99
        + ', "busy": 1, "span": 1}]}',
    ],
)  # fmt: skip
def test_a_damaged_note_of_a_run_is_left_out_with_a_line(tmp_path, capsys, text):
    begin(tmp_path, one_interval=True)
    share = {"rank": 0, "host": "n", "cases": 1, "busy": 1.0, "span": 2.0}
    Runs(tmp_path).write(2, [share])
    (tmp_path / "runs/0001.json").write_bytes(text.encode("latin-1"))
    assert main(["gather", str(tmp_path)]) == 1
    lines = capsys.readouterr().err.splitlines()
    told = [line for line in lines if "runs/0001.json" in line]
    assert len(told) == 1
    assert "left out" in told[0]
    with h5py.File(tmp_path / "results.h5") as file:
        assert file["performance/worker_run"][:].tolist() == [2]


@pytest.mark.parametrize(
    "kind", ["mode", "directory", "dangling", "loop"], ids=lambda kind: kind
)
def test_notes_that_cannot_be_read_block_nothing(tmp_path, kind, monkeypatch):
    begin(tmp_path, one_interval=True)
    (tmp_path / "runs").mkdir()
    (tmp_path / "running").mkdir()
    for path in (tmp_path / "runs/0001.json", tmp_path / "running/0001-00000.log"):
        unreadable(path, kind, monkeypatch)
    gather(Directory(tmp_path), {})
    assert Notes(tmp_path).all() == []
    assert progress_of(Directory(tmp_path)).running == []


@pytest.mark.parametrize("lacking", ["rank", "host", "pid", "digests"])
def test_a_note_of_a_rank_that_lacks_something_is_left_out(tmp_path, lacking):
    begin(tmp_path, one_interval=True)
    note = {"rank": 0, "host": "n", "pid": 1, "digests": ["d0"], "since": 1.0}
    (tmp_path / "running").mkdir()
    del note[lacking]
    (tmp_path / "running/0001-00000.log").write_bytes(sealed(note))
    with Running(Notes(tmp_path), 1, 1) as running:
        running.begin(["d1"])
        assert Notes(tmp_path).crashes() == {"d1": 1}
        assert len(Notes(tmp_path).all()) == 1


@pytest.mark.parametrize(
    "record",
    [
        {}, {"digest": "d3"}, {"status": "ok", "digest": "d3"}, {"status": "ok"},
        {"digest": 3, "status": "failed"}, {"digest": "d3", "status": ["ok"]},
        {"digest": "d3", "status": "excellent"}, {"status": "ok", "row": {"gap": 1.0}},
        {"digest": "d3", "status": "ok", "row": 3},
        {"digest": "d3", "status": "failed", "twin": "1"},
        {"digest": "d3", "status": "ok", "row": {"gap": 1.0}, "traces": {"file": "x"}},
    ],
)  # fmt: skip
def test_a_record_that_is_of_no_case_is_dropped(tmp_path, record):
    begin(tmp_path, one_interval=True)
    journal = tmp_path / "journal/0002-00000.log"
    journal.write_bytes(journal_of([record]))
    assert "d3" not in Journals(tmp_path).newest()
    gather(Directory(tmp_path), {})
    assert progress_of(Directory(tmp_path)).left == 1


# What cannot be read


def unreadable(path, kind, monkeypatch):
    """Put something in the place of a file that cannot be read as one."""
    if path.is_dir():
        shutil.rmtree(path)
    path.unlink(missing_ok=True)
    if kind == "directory":
        path.mkdir()
    elif kind == "dangling":
        path.symlink_to("nowhere")
    elif kind == "loop":
        path.symlink_to(path.name)
    else:
        path.write_bytes(b"")
        deny(path, monkeypatch)


def deny(denied, monkeypatch):
    """Refuse to open or list a path, as to who is not root."""
    for module, name in ((os, "open"), (os, "listdir"), (__import__("io"), "open")):
        real = getattr(module, name)

        def refuse(path, *others, real=real, **options):
            if isinstance(path, str | os.PathLike) and os.fspath(path) == str(denied):
                raise PermissionError(13, "Permission denied", str(path))
            return real(path, *others, **options)

        monkeypatch.setattr(module, name, refuse)


@pytest.mark.parametrize("kind", ["mode", "directory", "dangling", "loop"])
@pytest.mark.parametrize("name", ["journal/0001-00000.log", "journal"])
@pytest.mark.parametrize("command", ["gather", "status"])
def test_a_journal_that_cannot_be_read_is_named_and_nothing_is_lost(
    tmp_path, capsys, monkeypatch, command, name, kind
):
    begin(tmp_path, one_interval=True)
    (tmp_path / "results.h5").write_text("old")
    if (name, kind) == ("journal", "directory"):
        name = "journal/0001-00001.log"
    unreadable(tmp_path / name, kind, monkeypatch)
    assert main([command, str(tmp_path)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"hpcwhirl: error: cannot read {tmp_path / name}: ")
    assert (tmp_path / "results.h5").read_text() == "old"


@pytest.mark.parametrize("kind", ["mode", "dangling"])
def test_a_campaign_does_not_begin_anew_where_it_cannot_look(
    short, tmp_path, capsys, monkeypatch, kind
):
    assert main(short) == 0
    (log,) = (tmp_path / "out/journal").iterdir()
    before = records(tmp_path / "out")
    log.rename(tmp_path / "kept.log")
    unreadable(log, kind, monkeypatch)
    capsys.readouterr()
    assert main(short) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"hpcwhirl: error: cannot read {log}: ")
    monkeypatch.undo()
    log.unlink()
    (tmp_path / "kept.log").rename(log)
    assert records(tmp_path / "out") == before


@pytest.mark.usefixtures("short")
def test_states_that_cannot_be_listed_are_not_forgotten(tmp_path, monkeypatch):
    design = load_design(tmp_path / "short.toml", {})
    prepare(design, Directory(tmp_path / "out"))
    unreadable(tmp_path / "out/states", "dangling", monkeypatch)
    with pytest.raises(MissingFileError, match=re.escape(f"{tmp_path}/out/states")):
        run_campaign(design, Directory(tmp_path / "out"))
