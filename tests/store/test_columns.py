"""Journals read as columns: what is told of each case, whatever stands in them."""

import dataclasses
import tracemalloc

import numpy as np
import pytest
from journals import digest_of, drawn, journal_of, plan_of
from launch import kept
from specimen import BASE

from hpcwhirl.campaign.begin import prepare
from hpcwhirl.campaign.plan.design import design_of
from hpcwhirl.campaign.progress import progress_of
from hpcwhirl.planner.planner import Job, completion_of
from hpcwhirl.scene.quantities import PERFORMANCE, ROW, STATUS
from hpcwhirl.scene.words import ENUMS, is_open
from hpcwhirl.store.directory import reader
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.directory.completions import (
    SECONDS,
    CaseIndex,
    Ended,
    ended_in,
    marched,
    told_by,
)
from hpcwhirl.store.directory.journal import Journal, Journals, journal_name
from hpcwhirl.store.directory.manifest import PlanFile
from hpcwhirl.store.directory.reader import rows_at
from hpcwhirl.store.results.blocks import ranges, read_block
from hpcwhirl.store.results.contents import contents_of

pytestmark = pytest.mark.turns

CASES = 40
TABLES = {
    "sweep": {"speed": {"start": 100, "stop": 480, "step": 20}, "gap": [1e-4, 2e-4]}
}
OF_NONE = CASES + 7


def record(design, case, random, **more):
    return drawn(case, random) | {"digest": design.digests[case]} | more


@pytest.fixture
def made(tmp_path):
    """Return a design and a directory with journals of all there may be."""
    design, random = design_of(TABLES), np.random.default_rng(5)
    prepare(design, Directory(tmp_path))
    for run in range(3):
        number = Journals(tmp_path).claim_run()
        plan = design.digests.identity if run != 1 else ""
        with Journal(Journals(tmp_path), number, 0, plan) as journal:
            for case in random.integers(0, CASES - 4, 30):
                one = record(design, int(case), random)
                kinds = [
                    {"status": "failed", "message": "why not", "row": {}},
                    {"of": one["digest"], "twin": 1, "digest": "0" * 64},
                    {"digest": "1" * 64, "case": OF_NONE},
                    {"row": one["row"] | {"regime": "undecided", "stop": "end"}},
                    {"message": "m" * 900},
                    {} if plan else {"case": int(random.integers(CASES))},
                    {},
                ]
                journal.append(one | kinds[random.integers(len(kinds))], {})
    return design, tmp_path


def whole(folder):
    """Return (journal, first byte, record) of all records, the oldest first."""
    return [(log, begin, one) for log in sorted((folder / "journal").iterdir())
            for begin, _, one in kept(log)]  # fmt: skip


def wanted(folder, digests):
    """Return what `told_by` is to tell, a record at a time."""
    numbers = {name: case for case, name in enumerate(digests)}
    for _, _, one in whole(folder):
        row = one.get("row") or {}
        case = -1 if one.get("twin") else numbers.get(one["digest"], -1)
        words = [row.get(name, "none") for name in ("outcome", "regime")]
        still = one["status"] == "ok" and is_open(row)
        seconds = one["performance"]["seconds"]
        yield (case, one["status"], *words, still, one["ended"], seconds)


def columns(folder, digests):
    ended = Ended.nothing(design_of(TABLES).manifest())
    return [
        line
        for rows, case in told_by(Journals(folder), digests)
        for line in zip(
            case,
            *map(rows.words, ("status", "row.outcome", "row.regime")),
            (ended.ends.table[code].is_open for code in ended._codes(rows)),
            *(rows.numbers(n, np.nan) for n in ("ended", SECONDS)),
            strict=True,
        )
    ]


def test_undamaged_records_are_read_without_copies(tmp_path, monkeypatch):
    monkeypatch.setattr(reader, "AT_ONCE", reader.FIRST)
    design, count = design_of(TABLES), 8000
    with Journal(Journals(tmp_path), 1, 0) as journal:
        journal.append(record(design, 3, np.random.default_rng(2)), {})
    (path,) = (tmp_path / "journal").iterdir()
    ((begin, end, _),) = kept(path)
    data = path.read_bytes()
    path.write_bytes(data[:begin] + count * data[begin:end])
    tracemalloc.start()
    assert sum(map(len, Journals(tmp_path).rows())) == count
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 3.5 * reader.AT_ONCE < path.stat().st_size


def spoilt(folder):
    """Tear the last record of a journal, flip a bit in one of another."""
    first, second, _ = sorted((folder / "journal").iterdir())
    first.write_bytes(first.read_bytes()[:-40])
    data, begin = bytearray(second.read_bytes()), kept(second)[7][0]
    data[begin + 100] ^= 1
    second.write_bytes(data)


@pytest.mark.parametrize("listed", [False, True], ids=["arithmetic", "listed"])
@pytest.mark.parametrize("damaged", [False, True])
def test_columns_tell_what_was_written(made, damaged, listed):
    design, folder = made
    if damaged:
        spoilt(folder)
    digests = list(design.digests) if listed else design.digests
    found = columns(folder, digests)
    assert len(found) == 90 - 2 * damaged
    assert found == list(wanted(folder, design.digests))
    assert {line[1] for line in found} == {"ok", "failed"}
    assert -1 in {line[0] for line in found}


@pytest.mark.parametrize("again", [(), ("failed",)])
@pytest.mark.parametrize("twins", [0, 2])
def test_jobs_have_ended_as_their_newest_records_tell(made, twins, again):
    design, folder = made
    spoilt(folder)
    plan, asked = design.manifest(), [design.digests[i] for i in (0, 3, CASES - 1)]
    plan = dataclasses.replace(
        plan, twins={"of": "all", "count": twins} if twins else {}
    )
    anew = None
    if again:
        anew = lambda rows: np.isin(rows.words("status").astype(str), again)  # noqa: E731
    found = ended_in(Journals(folder), plan, asked, anew)
    numbers = {name: case for case, name in enumerate(design.digests)}
    jobs, told, seconds = {}, {}, np.full(CASES, np.nan)
    for _, _, one in whole(folder):
        twin, case = one.get("twin", 0), numbers.get(one.get("of", one["digest"]))
        end = completion_of(one)._replace(features=())
        known = None if one["status"] in again or case is None or twin > twins else end
        told[one["digest"]] = known
        if case is not None and twin <= twins:
            jobs[Job(case, twin)] = known
            if not twin:
                took = one["performance"]["seconds"]
                seconds[case] = took if end.is_ok else np.nan
    every = [Job(case, twin) for case in range(CASES) for twin in range(1 + twins)]
    assert [found.ends.find(job) for job in every] == [jobs.get(job) for job in every]
    assert {end.is_open for end in jobs.values() if end} == {True, False}
    assert 0 < found.over.sum() < CASES
    assert found.told == {n: told[n] for n in asked if told.get(n)}
    np.testing.assert_array_equal(found.seconds, seconds)
    assert np.isfinite(found.marched).any()
    left = {job for job in every if not job.twin and not jobs.get(job)}
    planner = found.planner()
    assert {Job(r) for r in planner.left().row[planner.left().twin == 0]} == left


def test_a_record_under_a_plan_that_has_grown_is_known_by_its_digest(made):
    design, folder = made
    more = design_of({"sweep": TABLES["sweep"] | {"gap": [0.5e-4, 1e-4, 2e-4]}})
    prepare(more, Directory(folder))
    found = list(wanted(folder, more.digests))
    assert columns(folder, more.digests) == found
    names = list(design.digests)
    moved = [names.index(more.digests[line[0]]) for line in found if line[0] >= 0]
    assert moved != [line[0] for line in found if line[0] >= 0]


def test_status_counts_what_columns_tell(made):
    design, folder = made
    newest = {line[0]: line for line in wanted(folder, design.digests)}
    newest.pop(-1)
    found = progress_of(Directory(folder), 2e9)
    assert 0 < found.left == CASES - len(newest) < found.cases == CASES
    done = sum(line[1] == "ok" for line in newest.values())
    assert (found.done, found.failed) == (done, len(newest) - done)
    assert found.failed > 0


def test_no_steps_follow_what_makes_a_case_certain_to_decay():
    certificate = np.array([-1.0, 0.5, 2.0, np.nan])
    found = marched(np.full(4, 1000), certificate, 2.0)
    np.testing.assert_array_equal(found, [1000, 250, 1000, np.nan])


def test_gather_finds_each_case_where_its_newest_whole_record_is(made):
    design, folder = made
    spoilt(folder)
    contents = contents_of(Directory(folder))
    newest = {one["digest"]: (log, begin) for log, begin, one in whole(folder)
              if not one.get("twin")}  # fmt: skip
    expected = [newest.get(name, (None, -1)) for name in design.digests]
    names = [*(path for path, _ in contents.files), None]
    found = [(names[n], start) for n, start in contents.place[:, 0].tolist()]
    assert found == expected


def test_numbers_of_the_plan_spare_digests_and_those_of_another_do_not(made):
    design, folder = made
    (first, second, _), asked = sorted((folder / "journal").iterdir()), []
    other = second.read_bytes()
    second.unlink()  # of no plan
    digests = design.digests
    digests.find_all = lambda words, hints: (asked.append(len(words)), hints)[1]
    columns(folder, digests)
    assert not asked
    first.write_bytes(other)
    columns(folder, digests)
    assert asked


def test_a_later_stage_stands_whatever_records_follow_it(made):
    design, folder = made
    PlanFile(folder).write(dataclasses.replace(PlanFile(folder).read(), extended=[9.0]))
    random, case = np.random.default_rng(3), CASES - 1
    later = record(design, case, random, of=design.digests[case], longest=9.0)
    failed = later | {"digest": "3" * 64, "status": "failed", "message": "why"}
    with Journal(Journals(folder), Journals(folder).claim_run(), 0) as journal:
        for one in (later | {"digest": "2" * 64}, later | {"digest": "2" * 64}, failed):
            journal.append(one, {})
        journal.append(record(design, case, random), {})
        journal.append(record(design, case - 1, random), {})
    contents = contents_of(Directory(folder))
    place = contents.place[[case, case - 1], 0]
    assert place[0, 0] == place[1, 0]
    rows = rows_at(*contents.files[place[0, 0]], place[:, 1])
    assert rows.record(0)["digest"] == "2" * 64
    assert rows.record(1)["case"] == case - 1


# Rows into results


def some_records(random, digests):
    """Return records of some cases: failed ones, and values of other types."""
    for case in random.integers(0, CASES - 3, 60).tolist():
        one = drawn(case, random) | {"digest": digests[case]}
        kind = random.integers(5)
        if kind == 0:
            one |= {"status": "failed", "message": "why"}
            del one["row"]
        elif kind == 1:
            one["row"]["steps"], one["row"]["gap"] = 2.0, 3
        yield case, one | {"case": int(random.choice([case, -5, 3, 10**9]))}


@pytest.fixture(params=range(3))
def journals(request, tmp_path):
    """Return a directory of journals with other fields, and its newest records."""
    random, newest = np.random.default_rng(request.param), {}
    settings = [{"speed": 1.0 + case, "direction": "squeeze"} for case in range(CASES)]
    plan = plan_of(BASE, ["speed", "direction"], settings)
    PlanFile(tmp_path).write(plan)
    (tmp_path / "journal").mkdir()
    few = [("", "digest", "hex", ()), ("", "status", "word", ENUMS["status"])]
    for rank in range(2):
        some = dict(enumerate(some_records(random, plan.digests)))
        newest |= dict(some.values())
        data = journal_of([one for _, one in some.values()], "",
                          few if rank == request.param else None)  # fmt: skip
        (tmp_path / "journal" / journal_name(1, rank)).write_bytes(data)
    return tmp_path, newest


def stored(name, quantity, values):
    """Return values of a results file as records have them."""
    if quantity.kind == "enum":
        return [ENUMS[name][code] for code in values]
    if quantity.kind.startswith("S"):
        return [value.decode() for value in values]
    return values.tolist()


@pytest.mark.parametrize(
    ("table", "of"), [("row", ""), ("performance", "performance/")]
)
def test_rows_of_results_are_those_of_the_newest_records(journals, table, of):
    folder, newest = journals
    contents = contents_of(Directory(folder))
    parts = [read_block(contents, part) for part in ranges(CASES, 0, 1, 7)]
    found = {name: np.concatenate([p[name] for p in parts]) for name in parts[0]}
    empty = {"f8": np.nan, "i8": -1, "enum": "none"}
    known = [case for case in range(CASES) if table in newest.get(case, {})]
    assert 10 < len(known) < CASES
    for name, quantity in {"row": ROW, "performance": PERFORMANCE}[table].items():
        values = [newest[case][table].get(name, empty.get(quantity.kind, ""))
                  for case in known]  # fmt: skip
        own = stored(name, quantity, found[of + name][known])
        np.testing.assert_equal(own, values, err_msg=name)
    status = [
        newest.get(case, {"status": "missing"})["status"] for case in range(CASES)
    ]
    assert stored("status", STATUS["status"], found["status"]) == status
    assert found["speed"][-1] == CASES  # of its inputs: it is missing


def test_cases_are_found_by_digest_where_numbers_have_changed():
    digests = [digest_of(case) for case in range(10)]
    index = CaseIndex(digests)
    raw = np.frombuffer(b"".join(map(bytes.fromhex, digests)), "V32")
    hints = np.array([0, 1, 2, 9, 8, -1, 10**12, 7, 3, 4])
    assert index.find_all(raw, hints).tolist() == list(range(10))
    strange = np.frombuffer(bytes.fromhex("cd" * 32), "V32")
    assert index.find_all(strange, np.array([3])).tolist() == [-1]
    assert [index.find(digests[4], hint) for hint in (4, 5, -1)] == [4] * 3
    assert index.find("made-up", 4) == -1
    assert CaseIndex(["made-up-1", "x"]).find("x", 0) == 1
