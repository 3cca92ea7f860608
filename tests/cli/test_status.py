"""How far a campaign is: from plan and journals alone, and never more than is known."""

import json
import os
import re
import shutil
import socket
import subprocess
import sys
import time
from dataclasses import replace

import pytest
from journals import plan_of

from hpcwhirl.campaign.progress import Progress, duration_text, progress_of
from hpcwhirl.campaign.ranks import Tally, keep_shares
from hpcwhirl.campaign.ranks import told as told_shares
from hpcwhirl.cli import gather as gather_command
from hpcwhirl.cli import main
from hpcwhirl.cli import status as status_command
from hpcwhirl.report.page.build import write_page
from hpcwhirl.scene.quantities import SHARES
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.directory.heartbeats import Notes, Running
from hpcwhirl.store.directory.journal import Journal, Journals
from hpcwhirl.store.directory.manifest import PlanFile
from hpcwhirl.store.directory.record import sealed
from hpcwhirl.store.directory.runs import Runs
from hpcwhirl.store.reading import results_file

BEGUN = 1.7e9  # s since 1970
LENGTHS = [4.0, 3.0, 2.0, 1.0, 1.0, 1.0]  # engine time of the cases, s
BASE = {"duration": 1.0, "revolutions": 0.0, "speed": 400.0, "solver.time_step": 1e-6}
SETTINGS = [{"duration": s, "speed": 400.0 + n} for n, s in enumerate(LENGTHS)]
PLAN = plan_of(BASE, ["duration", "speed"], SETTINGS)


def record(case, ended, seconds, status="ok"):
    performance = {"seconds": seconds, "rank": 0, "host": "node"}
    row = {"row": {"regime": "damped"}} if status == "ok" else {}
    made = {"case": case, "digest": PLAN.digests[case], "status": status, "message": ""}
    return made | row | {"performance": performance, "ended": BEGUN + ended}


@pytest.fixture
def folder(tmp_path):
    """Two ranks from BEGUN on: 10 s for each second of engine time; the first idles."""
    PlanFile(tmp_path).write(PLAN)
    with (
        Journal(Journals(tmp_path), 1, 0) as zero,
        Journal(Journals(tmp_path), 1, 1) as one,
    ):
        zero.append(record(0, 40.0, 40.0), {})
        zero.append(record(2, 80.0, 20.0), {})
        one.append(record(1, 30.0, 30.0, "failed"), {})
    return tmp_path


def test_counts_are_those_of_the_journals(folder):
    found = progress_of(Directory(folder), BEGUN + 90.0)
    assert (found.cases, found.done, found.failed, found.left) == (6, 2, 1, 3)
    assert found.words == {"damped": 2, "failed": 1}
    assert found.idle_for == pytest.approx(10.0)
    assert found.ranks == 2


def test_rate_time_and_core_hours_left_follow_from_what_was_computed(folder):
    found = progress_of(Directory(folder), BEGUN + 90.0)
    assert found.rate == pytest.approx(3600 * (2 / 80 + 1 / 30))
    assert found.eta == pytest.approx(3.0 / (6 / 80 + 3 / 30))
    assert found.core_hours == pytest.approx(90 / 3600)
    assert found.core_hours_left == pytest.approx(30 / 3600)


def test_the_kernel_share_is_the_share_of_time_in_the_kernel(folder):
    assert progress_of(Directory(folder)).kernel_share == pytest.approx(
        (60 + 30) / (80 + 30)
    )


def test_ranks_of_an_earlier_run_do_not_count_for_the_rate(folder):
    with Journal(Journals(folder), 2, 0) as journal:
        journal.append(record(3, 5010.0, 10.0), {})
        journal.append(record(4, 5030.0, 20.0), {})
    found = progress_of(Directory(folder), BEGUN + 5030.0)
    assert found.ranks == 1
    assert found.rate == pytest.approx(3600 * 2 / 30)
    assert found.core_hours == pytest.approx(120 / 3600)


def test_what_no_journal_tells_is_not_made_up(tmp_path):
    PlanFile(tmp_path).write(PLAN)
    found = progress_of(Directory(tmp_path))
    assert found.left == 6
    assert found.rate is found.eta is found.kernel_share is found.idle_for is None
    assert found.core_hours_left is None
    assert found.core_hours == 0.0


def test_the_step_sets_the_time_left_and_no_step_no_weights(tmp_path):
    plan = plan_of(BASE | {"solver.accuracy": 0.01}, PLAN.swept, SETTINGS)
    PlanFile(tmp_path).write(plan)
    with Journal(Journals(tmp_path), 1, 0) as journal:
        journal.append(record(0, 40.0, 40.0) | {"digest": plan.digests[0]}, {})
    assert progress_of(Directory(tmp_path)).eta == pytest.approx(5 * 40.0)


def test_status_tells_in_words_what_it_tells_in_json(folder, capsys, facts):
    assert main(["status", str(folder)]) == 0
    told = capsys.readouterr().out
    assert "left: 3" in told
    assert f"rate: {3600 * (2 / 80 + 1 / 30):.4g} cases/h" in told
    assert "ranks with recent results: 2\n" in told
    found = facts("status", str(folder), "--json")
    assert found["rate"] == pytest.approx(3600 * (2 / 80 + 1 / 30))


@pytest.mark.parametrize("extended", [[], [9.0]], ids=["plain", "extended"])
def test_cases_are_counted_by_status_and_by_word_as_in_results(
    folder, extended, capsys
):
    PlanFile(folder).write(replace(PLAN, extended=extended))
    overloaded = record(5, 60.0, 1.0)
    overloaded["row"] = {"regime": "none", "outcome": "overloaded"}
    with Journal(Journals(folder), 2, 0) as journal:
        journal.append(record(3, 50.0, 1.0, "timeout"), {})
        journal.append(record(4, 55.0, 1.0, "crashed"), {})
        journal.append(overloaded, {})
    found = progress_of(Directory(folder), BEGUN + 90.0)
    assert found.statuses == {"ok": 3, "failed": 1, "timeout": 1, "crashed": 1}
    assert found.words == {"damped": 2, "overloaded": 1, "failed": 3}
    assert (found.done, found.failed, found.left) == (3, 3, 0)
    assert main(["status", str(folder)]) == 0
    told = capsys.readouterr().out
    assert "statuses: crashed 1, failed 1, ok 3, timeout 1\n" in told
    assert "words: damped 2, failed 3, overloaded 1\n" in told
    assert "none" not in told


def test_what_ranks_compute_is_told_until_it_has_ended(folder, capsys, facts):
    before = time.time()
    with Running(Notes(folder), 2, 0) as zero, Running(Notes(folder), 2, 3) as three:
        zero.begin([PLAN.digests[3]])
        three.begin([PLAN.digests[4], PLAN.digests[5], "of another plan"])
        now = time.time()
        first, second = progress_of(Directory(folder), now + 50.0).running
        assert (first.rank, first.cases, first.died) == (0, [3], False)
        assert (second.rank, second.cases) == (3, [4, 5])
        assert first.host == socket.gethostname()
        assert before <= first.since <= second.since <= now
        assert first.seconds == pytest.approx(now + 50.0 - first.since)
        ended = record(4, time.time() + 1.0 - BEGUN, 1.0)
        with Journal(Journals(folder), 2, 3) as journal:
            journal.append(ended, {})
        found = facts("status", str(folder), "--json")
        assert [one["cases"] for one in found["running"]] == [[3], [5]]
        assert main(["status", str(folder)]) == 0
        told = capsys.readouterr().out
        assert "running: rank 0 case 3 for 0 s; rank 3 case 5 for 0 s\n" in told
    assert progress_of(Directory(folder)).running == []


def test_a_case_that_is_tried_again_is_running_although_it_has_a_result(folder):
    with Running(Notes(folder), 2, 0) as running:
        running.begin([PLAN.digests[1]])
        assert [one.cases for one in progress_of(Directory(folder)).running] == [[1]]


def test_notes_of_dead_processes_are_told_apart_and_foreign_ones_believed(
    folder, capsys
):
    with subprocess.Popen([sys.executable, "-c", ""]) as gone:
        gone.wait()
    mine = {"host": socket.gethostname(), "digests": [PLAN.digests[3]], "since": BEGUN}
    theirs = {"host": "elsewhere", "digests": [PLAN.digests[4]], "since": BEGUN + 1.0}
    (folder / "running").mkdir()
    for rank, who in enumerate(
        [
            mine | {"pid": gone.pid},
            theirs | {"pid": gone.pid},
            mine | {"pid": os.getpid()},
        ]
    ):
        note = sealed({"rank": rank, **who})
        (folder / f"running/0001-{rank:05d}.log").write_bytes(note)
    (folder / "running/0001-00009.log").write_bytes(note[:-5])  # torn
    found = {one.rank: one.died for one in progress_of(Directory(folder)).running}
    assert found == {0: True, 1: False, 2: False}
    assert main(["status", str(folder)]) == 0
    told = capsys.readouterr().out
    assert "left by processes that died: rank 0 case 3 for " in told


def test_of_many_ranks_those_at_work_for_longest_are_shown(tmp_path, capsys):
    PlanFile(tmp_path).write(PLAN)
    (tmp_path / "running").mkdir()
    for rank in range(20):
        note = {
            "rank": rank,
            "host": "elsewhere",
            "pid": 1,
            "digests": [PLAN.digests[0]],
        }
        note["since"] = time.time() - 10.0 * rank
        (tmp_path / f"running/0001-{rank:05d}.log").write_bytes(sealed(note))
    assert main(["status", str(tmp_path)]) == 0
    told = capsys.readouterr().out.splitlines()
    (line,) = [line for line in told if line.startswith("running: ")]
    assert line.startswith("running: rank 19 case 0 for 3 min; rank 18 ")
    assert line.endswith("rank 12 case 0 for 2 min; 12 more")


def finish_one(folder, left):
    """Return a sleep in which another case is finished, each by a run of its own."""

    def sleep(seconds):
        assert seconds == 0.5
        case = left.pop(0)
        with Journal(Journals(folder), case, 0) as journal:
            journal.append(record(case, 100.0 + case, 1.0), {})

    return sleep


@pytest.mark.parametrize("as_json", [False, True])
def test_watching_prints_a_line_a_look_and_ends_with_the_campaign(
    folder, capsys, monkeypatch, as_json
):
    monkeypatch.setattr(status_command.time, "sleep", finish_one(folder, [3, 4, 5]))
    words = ["status", str(folder), "--watch", "0.5", *(["--json"] if as_json else [])]
    assert main(words) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 4
    if as_json:
        assert [json.loads(line)["left"] for line in lines] == [3, 2, 1, 0]
    else:
        counts = [line.partition(",")[0] for line in lines]
        assert counts == [f"{done} of 6 cases" for done in (2, 3, 4, 5)]
        assert all("1 failed" in line for line in lines)


def test_on_a_terminal_the_same_is_drawn_in_place(folder, capsys, monkeypatch):
    monkeypatch.setattr(status_command.time, "sleep", finish_one(folder, [3, 4, 5]))
    monkeypatch.setattr(status_command.sys.stdout, "isatty", lambda: True)
    assert main(["status", str(folder), "--watch", "0.5"]) == 0
    shown = capsys.readouterr().out
    assert "core_hours" in shown
    assert "1 failed" not in shown


@pytest.mark.parametrize("every", ["0", "-1", "nan", "inf"])
def test_a_watch_that_could_not_wait_is_refused(folder, capsys, every):
    assert main(["status", str(folder), "--watch", every]) == 2
    assert "--watch must be >= 0.2 s" in capsys.readouterr().err


def test_a_campaign_that_its_file_keeps_stopped_says_so(folder, capsys, facts):
    assert facts("status", str(folder), "--json")["stopped"] == ""
    (folder / "STOP").touch()
    assert main(["status", str(folder)]) == 0
    assert "stopped: STOP\n" in capsys.readouterr().out
    assert facts("status", str(folder), "--json")["stopped"] == "STOP"
    with Running(Notes(folder), 2, 0) as zero:
        zero.begin([PLAN.digests[3]])
        assert main(["status", str(folder)]) == 0
        assert "stopping: STOP\n" in capsys.readouterr().out


def test_the_last_run_says_why_it_stopped_and_no_other_does(folder, capsys):
    tally = Tally(busy=1.0, span=2.0, cases=1)
    keep_shares(Runs(folder), 1, tally, stopped="signal USR1")
    assert main(["status", str(folder)]) == 0
    assert "stopped: signal USR1\n" in capsys.readouterr().out
    keep_shares(Runs(folder), 1, tally, stopped=f"{folder / 'STOP'} is there")
    assert progress_of(Directory(folder)).stopped == "STOP, removed since"
    with Running(Notes(folder), 1, 0) as zero:
        zero.begin([PLAN.digests[3]])
        assert progress_of(Directory(folder)).stopped == ""
    Journals(folder).claim_run()  # which was killed
    assert progress_of(Directory(folder)).stopped == ""


def test_busy_means_one_thing_and_is_what_results_call_so(folder, capsys):
    assert main(["status", str(folder)]) == 0
    told = capsys.readouterr().out
    assert "busy" not in told
    assert f"in the kernel: {100 * 90 / 110:.1f} %\n" in told
    assert "busy" not in Progress.__dataclass_fields__
    share = {"cases": 1, "busy": 9.0, "span": 10.0}
    assert "busy fraction 0.900" in told_shares([share])
    assert told_shares([share]).startswith("1 case in 10.0 s on 1 rank: ")
    assert "busy" in SHARES["busy_fraction"].meaning


@pytest.mark.turns
def test_a_page_of_other_words_is_called_stale(finished, tmp_path, capsys, facts):
    out = tmp_path / "out"
    shutil.copytree(finished, out)
    write_page(Directory(out))
    assert facts("status", str(out), "--json")["stale"] == ""
    page = (out / "report.html").read_text()
    other = re.sub(
        '(hpcwhirl-results" content=")[0-9a-f]{64}', r"\g<1>" + 64 * "0", page
    )
    (out / "report.html").write_text(other)
    assert main(["status", str(out)]) == 0
    told = capsys.readouterr().out
    assert f"stale: report.html: hpcwhirl report {out}\n" in told
    (out / "results.h5").write_bytes(b"torn")
    assert main(["status", str(out)]) == 0
    assert "stale: report.html cannot be checked: " in capsys.readouterr().out


def test_durations_are_written_as_people_write_them():
    told = [duration_text(s) for s in (0.4, 119.4, 120, 3570, 3600, 100_000)]
    assert told == ["0 s", "119 s", "2 min", "1 h 00 min", "1 h 00 min", "27 h 47 min"]


@pytest.mark.parametrize(
    ("counts", "told", "hints"),
    [
        ({"ok": 5, "missing": 1}, "1 of 6 cases has no result: 1 missing; ", "the"),
        ({"ok": 4, "failed": 2}, "2 of 6 cases have no result: 2 failed; ", "see"),
        ({"failed": 2, "missing": 1}, "3 of 3 cases have no result: ", "see the"),
    ],
)
def test_gather_says_what_to_do_about_cases_without_a_result(
    counts, told, hints, tmp_path, monkeypatch, capsys
):
    monkeypatch.setattr(results_file, "count_statuses", lambda _: counts)
    assert gather_command._code(tmp_path / "results.h5") == 1
    err = capsys.readouterr().err
    assert told in err
    assert ("see `status` and `message` in " in err) == ("see" in hints)
    assert ("; the campaign's own command computes what" in err) == ("the" in hints)
