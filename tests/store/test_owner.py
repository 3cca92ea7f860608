"""One owner of a directory at a time, whoever dies and whoever else comes."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from dataclasses import asdict

import h5py
import pytest
from launch import (
    BARE,
    ENVIRONMENT,
    LIMIT,
    ROOT,
    SLOW,
    finish,
    fork_of,
    kill,
    launch,
    records,
    root_variables,
    start,
)
from launch import wait_for as wait
from specimen import begin

from hpcwhirl.analysis.regimes import Thresholds
from hpcwhirl.analysis.rules import words_by_table
from hpcwhirl.campaign.begin import prepare
from hpcwhirl.campaign.plan.design import design_of, load_design
from hpcwhirl.campaign.run import run_campaign
from hpcwhirl.cli import main
from hpcwhirl.errors import InputError, MissingFileError, StoreError
from hpcwhirl.store.atomic import part_of, replacing, sweep, write_whole
from hpcwhirl.store.directory import heartbeats, owner
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.directory.heartbeats import begun, is_alive, machine
from hpcwhirl.store.directory.owner import Asking, Claims, in_the_way
from hpcwhirl.store.results import gather as gathering
from hpcwhirl.store.results import relabel
from hpcwhirl.store.results.gather import gather

SHORT = (
    BARE
    + """
scene = {duration = 2e-3}
solver = {time_step = 2e-6}
output = {interval = 5e-5}
sweep = {speed = [300, 410]}
"""
)
# Holds a claim until its input ends, as a process of its own.
HOLDER = """
import sys
from pathlib import Path
from hpcwhirl.store.directory.owner import Claims
held = Claims(Path(sys.argv[1])).make(sys.argv[2])
print("held", flush=True)
sys.stdin.read()
"""


def holder(folder, kind):
    call = [sys.executable, "-c", HOLDER, str(folder), kind]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    process = subprocess.Popen(call, cwd=ROOT, env=ENVIRONMENT, **pipes)
    assert process.stdout.readline() == "held\n"
    return process


def foreign(folder, kind="campaign", age=0.0, **news):
    """Write the claim of a process of another machine, its last sign `age` s old."""
    known = {"host": "node7", "machine": "another", "pid": 1, "ticks": 1}
    known |= {"since": time.time() - 100.0, "command": "hpcwhirl campaign x", **news}
    (folder / "owners").mkdir(exist_ok=True)
    path = folder / f"owners/{kind}.{'a' * 32}.claim"
    path.write_text(json.dumps(known))
    os.utime(path, (time.time() - age,) * 2)
    return path


@pytest.fixture
def hasty(monkeypatch):
    """Let a living process be refused at once, and a silent one be dead soon."""
    monkeypatch.setattr(owner, "GRACE", 0.0)
    monkeypatch.setattr(owner, "STALE", 0.4)
    monkeypatch.setattr(owner, "PULSE", 0.05)


@pytest.mark.parametrize(
    ("one", "other", "excluded"),
    [
        ("campaign", "campaign", True),
        ("campaign", "shard-1-of-4", True),
        ("shard-1-of-4", "shard-1-of-4", True),
        ("shard-1-of-4", "shard-2-of-4", False),
        ("shard-1-of-4", "shard-2-of-8", True),
        ("results", "results", True),
        ("results", "campaign", False),
        ("results", "shard-1-of-4", False),
    ],
)
def test_shards_of_one_division_share_and_nothing_else_does(one, other, excluded):
    assert in_the_way(one, other) == in_the_way(other, one) == excluded


@pytest.mark.turns
@pytest.mark.usefixtures("hasty")
def test_a_living_owner_is_named_and_left_alone(tmp_path):
    process = holder(tmp_path, "campaign")
    for kind in ("campaign", "shard-1-of-4"):
        with pytest.raises(InputError, match=rf"process {process.pid} on \S+ since 20"):
            Claims(tmp_path).make(kind)
    Claims(tmp_path).make("results").release()
    assert len(Claims(tmp_path).owners()) == 1
    process.communicate("")
    Claims(tmp_path).make("campaign").release()  # which removes the dead one's
    assert not (tmp_path / "owners").exists()


@pytest.mark.turns
@pytest.mark.usefixtures("hasty")
@pytest.mark.parametrize("reaped", [True, False])
def test_a_killed_owner_of_this_machine_is_taken_over_unasked(tmp_path, reaped):
    process = holder(tmp_path, "campaign")
    os.kill(process.pid, signal.SIGKILL)
    # until it has ended, and is a zombie or no more
    os.waitid(os.P_PID, process.pid, os.WEXITED | (0 if reaped else os.WNOWAIT))
    with Claims(tmp_path).make("campaign"):
        assert len(Claims(tmp_path).owners()) == 1
    process.stdin.close()
    process.stdout.close()
    process.wait()


@pytest.mark.usefixtures("hasty")
def test_a_later_process_of_the_same_number_is_not_the_owner(tmp_path):
    own = {"machine": machine(), "pid": os.getpid(), "ticks": begun(os.getpid())}
    path = foreign(tmp_path, **own)
    with pytest.raises(InputError, match="is being computed by this process"):
        Claims(tmp_path).make("campaign")
    path.unlink()
    foreign(tmp_path, **own | {"ticks": own["ticks"] - 1})
    Claims(tmp_path).make("campaign").release()


@pytest.mark.usefixtures("hasty")
def test_an_owner_elsewhere_is_dead_once_it_has_been_silent(tmp_path):
    told = []
    foreign(tmp_path, age=0.0)
    Claims(tmp_path).make("campaign", Asking(say=told.append)).release()
    assert any("process 1 on node7" in line for line in told)
    foreign(tmp_path, age=5.0)  # long ago by the file system's clock: at once
    asking = Asking(check=lambda: pytest.fail("it waits"))
    Claims(tmp_path).make("campaign", asking).release()


@pytest.mark.usefixtures("hasty")
def test_an_owner_elsewhere_is_dead_whatever_its_clock_says(tmp_path):
    dead = foreign(tmp_path, age=-1e6)  # its file server's clock was put back since
    Claims(tmp_path).make("campaign").release()
    assert not dead.exists()


@pytest.mark.usefixtures("hasty")
def test_an_owner_elsewhere_that_gives_signs_of_life_is_refused(tmp_path):
    path = foreign(tmp_path)
    asking = Asking(check=lambda: os.utime(path))
    with pytest.raises(InputError, match=r"node7 .*; its last sign .*--take-over"):
        Claims(tmp_path).make("campaign", asking)
    Claims(tmp_path).make("campaign", Asking(take_over=True)).release()


def test_waiting_ends_where_it_is_broken_off(tmp_path):
    class BreakError(Exception):
        pass

    def check():
        raise BreakError

    foreign(tmp_path)
    with pytest.raises(BreakError):
        Claims(tmp_path).make("campaign", Asking(check=check))
    assert [path.name[:8] for path in (tmp_path / "owners").iterdir()] == ["campaign"]


@pytest.mark.usefixtures("hasty")
def test_who_loses_a_claim_hears_of_it(tmp_path):
    lost = threading.Event()
    with Claims(tmp_path).make("campaign") as own:
        own.when_lost = lambda _: lost.set()
        before = own.path.stat().st_mtime_ns
        wait_until(lambda: own.path.stat().st_mtime_ns > before)  # signs of life
        own.path.unlink()
        assert not own.held
        assert lost.wait(60)


def wait_until(reached):
    end = time.monotonic() + LIMIT
    while not reached():
        assert time.monotonic() < end
        time.sleep(0.005)


def test_of_many_at_once_one_at_a_time_owns(tmp_path):
    inside, most, failures = [], [], []

    def own():
        try:
            with Claims(tmp_path).make("results"):
                inside.append(1)
                most.append(len(inside))
                time.sleep(1e-3)
                inside.pop()
        except Exception as failed:  # noqa: BLE001 - told by the test
            failures.append(failed)

    threads = [threading.Thread(target=own) for _ in range(12)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert failures == []
    assert most == [1] * 12
    assert not (tmp_path / "owners").exists()


def test_what_is_no_claim_is_in_nobody_s_way(tmp_path):
    foreign(tmp_path).unlink()
    (tmp_path / "owners/README").write_text("")
    (tmp_path / f"owners/campaign.{'b' * 32}.claim").mkdir()
    os.mkfifo(tmp_path / f"owners/campaign.{'c' * 32}.claim")
    there = sorted(tmp_path.rglob("*"))
    Claims(tmp_path).make("campaign").release()
    assert sorted(tmp_path.rglob("*")) == there


@pytest.mark.usefixtures("hasty")
@pytest.mark.parametrize("words", ["", "{", "[]", '{"pid": 1}', '{"pid": "x"}'])
def test_a_claim_that_is_not_whole_is_alive_until_it_is_old(tmp_path, words):
    path = foreign(tmp_path)
    path.write_text(words)
    seen = []
    Claims(tmp_path).make("campaign", Asking(check=lambda: seen.append(1))).release()
    assert seen  # it was waited for


def test_ended_processes_are_dead_and_stopped_ones_alive():
    with subprocess.Popen(["sleep", "60"]) as process:
        ticks = begun(process.pid)
        os.kill(process.pid, signal.SIGSTOP)
        assert is_alive(process.pid, ticks)
        assert not is_alive(process.pid, ticks + 1)
        process.kill()
        os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)  # a zombie
        assert not is_alive(process.pid, ticks)
    assert not is_alive(process.pid, ticks)


def test_a_hidden_process_of_another_user_is_alive(monkeypatch):
    def refuse(pid, number):
        raise PermissionError(1, f"{pid} {number}")

    monkeypatch.setattr(heartbeats.os, "kill", refuse)
    monkeypatch.setattr(heartbeats, "_state", lambda _: None)
    assert is_alive(4711, 1)


# Gathering


@pytest.mark.turns
def test_two_gathers_in_the_midst_of_each_other_harm_neither(tmp_path, monkeypatch):
    # as where the claim of one was lost: each writes to a file of its own
    begin(tmp_path, one_interval=True)
    gather(Directory(tmp_path), {})
    alone, read, nested = root_variables(tmp_path), gathering.read_block, []

    def read_while_another_gathers(contents, cases):
        if not nested:
            nested.append("begun")
            gather(Directory(tmp_path), {})
            assert root_variables(tmp_path) == alone
        return read(contents, cases)

    monkeypatch.setattr(gathering, "read_block", read_while_another_gathers)
    monkeypatch.setattr(owner, "in_the_way", lambda *_: False)
    monkeypatch.setattr(gathering, "sweep", lambda *_: None)
    gather(Directory(tmp_path), {})
    assert nested
    assert root_variables(tmp_path) == alone
    assert not list(tmp_path.glob("*.part*"))


@pytest.mark.turns
def test_a_gather_that_fails_takes_no_file_of_another_with_it(tmp_path, monkeypatch):
    begin(tmp_path, one_interval=True)
    gather(Directory(tmp_path), {})
    alone, read, nested = root_variables(tmp_path), gathering.read_block, []

    def fail_while_another_gathers(contents, cases):
        if not nested:
            nested.append("begun")
            with pytest.raises(MissingFileError):
                gather(Directory(tmp_path), {})
        elif len(nested) == 1:
            nested.append("failed")
            raise MissingFileError("planted")
        return read(contents, cases)

    monkeypatch.setattr(gathering, "read_block", fail_while_another_gathers)
    monkeypatch.setattr(owner, "in_the_way", lambda *_: False)
    monkeypatch.setattr(gathering, "sweep", lambda *_: None)
    gather(Directory(tmp_path), {})
    assert root_variables(tmp_path) == alone


@pytest.mark.slow
@pytest.mark.parametrize("locking", ["TRUE", "FALSE"])
def test_gathers_and_classify_at_once_give_one_whole_file(tmp_path, locking):
    begin(tmp_path, one_interval=True)
    gather(Directory(tmp_path), {})
    alone = root_variables(tmp_path)
    env = ENVIRONMENT | {"HDF5_USE_FILE_LOCKING": locking}
    real = locking == "FALSE"  # HDF5 looks as it is loaded; TRUE is what forks have
    words = [["gather", tmp_path], ["gather", tmp_path, "--compress", 3]]
    words += [["classify", tmp_path]] * 2
    ended = [finish(p) for p in [start(call, env=env, real=real) for call in words]]
    codes = [process.returncode for process in ended]
    assert codes == [1, 1, 0, 0], ended[0].err  # two cases have no result
    found = root_variables(tmp_path)
    for name in relabel.WORDS:  # who came last decides on these
        del found[name], alone[name]
    assert found == alone
    assert not list(tmp_path.glob("*.part"))
    assert not (tmp_path / "owners").exists()


@pytest.mark.turns
def test_classify_waits_for_what_a_gather_writes(tmp_path, monkeypatch):
    begin(tmp_path, one_interval=True)
    gather(Directory(tmp_path), {})
    (tmp_path / "results.h5").replace(tmp_path / "old.h5")
    read, ended = gathering.read_block, []

    def rename():
        limits = asdict(Thresholds())
        relabel.relabel(
            Directory(tmp_path),
            lambda numbers: words_by_table(numbers, limits),
            {"rise": 7.0},
        )
        ended.append("classify")

    other = threading.Thread(target=rename)

    def read_and_look(contents, cases):
        (tmp_path / "old.h5").replace(tmp_path / "results.h5")
        other.start()
        other.join(0.5)
        ended.append("gather")
        return read(contents, cases)

    monkeypatch.setattr(gathering, "read_block", read_and_look)
    gather(Directory(tmp_path), {})
    other.join()
    assert ended == ["gather", "classify"]
    with h5py.File(tmp_path / "results.h5") as file:
        assert file.attrs["threshold_rise"] == 7.0


def test_who_was_believed_dead_does_not_publish(tmp_path, monkeypatch):
    begin(tmp_path, one_interval=True)
    (tmp_path / "results.h5").write_text("another's")
    read = gathering.read_block

    def take_over(contents, cases):
        for one in Claims(tmp_path).owners():
            one.path.unlink()
        return read(contents, cases)

    monkeypatch.setattr(gathering, "read_block", take_over)
    with pytest.raises(ValueError, match="another process has taken over"):
        gather(Directory(tmp_path), {})
    assert (tmp_path / "results.h5").read_text() == "another's"


def test_a_dead_claim_is_removed_whosever_way_it_is_in(tmp_path):
    """A campaign whose results are current gathers nothing, and claims no results."""
    own = {"machine": machine(), "pid": os.getpid(), "ticks": 1}  # ended, number reused
    claims = []
    for letter, age, news in (("b", 0.0, own), ("c", 1e3, {}), ("d", 0.0, {})):
        path = foreign(tmp_path, "results", age, **news)
        claims.append(path.rename(path.with_name(f"results.{letter * 32}.claim")))
    ended, silent, living = claims
    with Claims(tmp_path).make("campaign"):
        assert not ended.exists()
        assert not silent.exists()
        assert living.exists()


# Temporary files


@pytest.mark.turns
@pytest.mark.parametrize("ages", [0.0, 1e5])
def test_who_gathers_or_names_anew_sweeps_what_the_dead_have_left(tmp_path, ages):
    begin(tmp_path, one_interval=True)
    gather(Directory(tmp_path), {})
    limits = asdict(Thresholds())

    def name(numbers):
        return words_by_table(numbers, limits)

    for action in (
        lambda: gather(Directory(tmp_path), {}),
        lambda: relabel.relabel(Directory(tmp_path), name, {}),
    ):
        part_of(tmp_path / "results.h5")
        action()
        assert not list(tmp_path.glob("*.part"))
    stamp = part_of(tmp_path / "runs" / "results.stamp")
    os.utime(stamp, (time.time() - ages,) * 2)
    gather(Directory(tmp_path), {})
    assert not stamp.exists()


def test_notes_left_by_halves_are_removed_by_who_owns_the_directory(tmp_path):
    design = design_of({"sweep": {"speed": [300.0]}, "scene": {"duration": 1e-4}})
    (tmp_path / "running").mkdir()
    for number, content in enumerate((b"", bytes(4096), b'{"rank": 0')):
        (tmp_path / f"running/000{number + 1}-00000.log").write_bytes(content)
    prepare(design, Directory(tmp_path))
    assert run_campaign(design, Directory(tmp_path)).complete
    assert not list((tmp_path / "running").iterdir())


def test_no_link_is_written_through(tmp_path):
    begin(tmp_path, one_interval=True)
    (tmp_path / "victim").write_text("keep me")
    for name in ("results.h5.part", "results.h5"):
        (tmp_path / name).symlink_to("victim")
    gather(Directory(tmp_path), {})
    assert (tmp_path / "victim").read_text() == "keep me"
    assert not (tmp_path / "results.h5").is_symlink()


def test_a_temporary_name_is_new_each_time_and_fits(tmp_path):
    path = tmp_path / ("ä" * 127)
    parts = {part_of(path) for _ in range(3)}
    assert len(parts) == 3
    write_whole(path, b"whole")
    assert path.read_bytes() == b"whole"
    assert {*tmp_path.iterdir()} == parts | {path}


def test_where_writing_fails_nothing_is_left(tmp_path):
    def spoil():
        with replacing(tmp_path / "x") as part:
            part.write_bytes(b"half")
            raise KeyError

    with pytest.raises(KeyError):
        spoil()
    assert not list(tmp_path.iterdir())


def test_stray_temporary_files_are_swept_and_nothing_else(tmp_path):
    stray = [part_of(tmp_path / "x"), part_of(tmp_path / "results.h5")]
    (tmp_path / "results.h5.part").write_text("of an older version")
    kept = [tmp_path / "notes.part", tmp_path / "x", tmp_path / "results.h5"]
    for path in kept:
        path.write_text("mine")
    sweep(tmp_path, older=stray[0].stat().st_mtime - 1.0)
    assert all(path.exists() for path in stray)
    sweep(tmp_path, "results.h5")
    assert stray[0].exists()
    sweep(tmp_path)
    assert {*tmp_path.iterdir()} == {*kept}


# Campaigns


def inputs(place):
    (place / "short.toml").write_text(SHORT)
    return place / "short.toml"


@pytest.mark.turns
@pytest.mark.usefixtures("hasty")
def test_a_second_campaign_in_a_directory_is_refused_by_name(tmp_path, capsys):
    out = tmp_path / "out"
    process = holder(out, "campaign")
    call = ["campaign", str(inputs(tmp_path)), "--out", str(out)]
    for more in ([], ["--shard", "1/2"], ["--fresh"], ["--take-over"]):
        assert main([*call, *more]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert f"{out} is being computed by process {process.pid} on" in line
        assert [path.name for path in out.iterdir()] == ["owners"]
    process.communicate("")


@pytest.mark.turns
@pytest.mark.usefixtures("hasty")
def test_a_campaign_sweeps_pictures_that_were_killed_half_drawn(tmp_path):
    out = tmp_path / "out"
    words = ["campaign", str(inputs(tmp_path)), "--out", str(out)]
    assert main(words) == 0
    strays = [part_of(out / n) for n in ("map.png", "map.svg", "report.html")]
    for path in strays:
        os.utime(path, (time.time() - 1.0,) * 2)
    assert main(words) == 0
    assert not any(path.exists() for path in strays)
    assert not list(out.glob("*.part"))


def test_a_campaign_without_mpi_claims_its_directory_itself(tmp_path):
    design = load_design(inputs(tmp_path), {})
    prepare(design, Directory(tmp_path / "out"))
    with Claims(tmp_path / "out").make("campaign"), pytest.raises(InputError):
        run_campaign(design, Directory(tmp_path / "out"))
    for part in ("states", "runs", "."):
        (tmp_path / "out" / part).mkdir(exist_ok=True)
    stray = [part_of(tmp_path / "out" / n) for n in ("states/a.state", "runs/1.json")]
    stray += [part_of(tmp_path / "out" / n) for n in ("campaign.json", "results.h5")]
    assert run_campaign(design, Directory(tmp_path / "out")).complete
    assert not any(path.exists() for path in stray)
    assert not (tmp_path / "out/owners").exists()


@pytest.mark.slow
def test_a_campaign_goes_on_after_a_kill_of_its_owner(tmp_path):
    out = tmp_path / "out"
    text = SHORT.replace("2e-3", "0.5").replace("[300, 410]", "[300, 410, 420, 430]")
    (tmp_path / "long.toml").write_text(text)
    words = ["campaign", tmp_path / "long.toml", "--out", out]
    process = start(words, first=SLOW)
    wait(lambda: list(out.glob("running/*")), process)
    pid = fork_of(process.pid)
    os.kill(pid, signal.SIGSTOP)  # it lives, however fast this machine is
    assert len(Claims(out).owners()) == 1
    refused = launch(*words)
    assert refused.returncode == 2
    assert f"process {pid} on" in refused.err
    kill(process)
    assert launch(*words).returncode == 0
    assert not (out / "owners").exists()


@pytest.mark.slow
def test_two_campaigns_at_once_compute_each_case_once(tmp_path):
    text = SHORT.replace("[300, 410]", "{start = 300, stop = 410, num = 12}")
    (tmp_path / "twelve.toml").write_text(text)
    words = ["campaign", tmp_path / "twelve.toml", "--out", tmp_path / "out"]
    ended = [finish(process) for process in [start(words), start(words)]]
    assert 0 in [process.returncode for process in ended]
    for process in ended:  # the other one has waited, or was refused by name
        refused = process.returncode == 2 and "is being computed by" in process.err
        assert process.returncode == 0 or refused, process.err
    assert sorted(record["case"] for record in records(tmp_path / "out")) == [
        *range(12)
    ]
    assert not (tmp_path / "out/owners").exists()


def test_a_directory_that_was_moved_is_not_told_as_taken_over(tmp_path, monkeypatch):
    monkeypatch.setattr(owner, "PULSE", 0.05)
    folder, told = tmp_path / "out", []
    claim = Claims(folder).make("campaign")
    with claim:
        claim.when_lost = told.append
        (folder / "campaign.json").write_text("")
        folder.rename(tmp_path / "moved")
        with pytest.raises(StoreError, match=r"out was moved or removed while this"):
            claim.check()
        claim._thread.join(10.0)
    assert told == [f"{folder} was moved or removed while this process used it"]
