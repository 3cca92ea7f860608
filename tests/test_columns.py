"""Journals read as columns against their records, whatever stands in them."""

import dataclasses
import zlib

import numpy as np
import pytest

from hpcwhirl.campaign.plan.design import design_of
from hpcwhirl.campaign.plan.ends import ends_of
from hpcwhirl.campaign.plan.stages import Stages
from hpcwhirl.campaign.progress import progress_of
from hpcwhirl.campaign.resume import prepare
from hpcwhirl.scene.words import is_open
from hpcwhirl.store.directory.columns import told_by
from hpcwhirl.store.directory.journal import (
    Journal,
    claim_run,
    journal_name,
    read_at,
    whole_records,
)
from hpcwhirl.store.directory.lines import AT, OWN, Layout
from hpcwhirl.store.directory.manifest import read_manifest, write_manifest
from hpcwhirl.store.results.contents import contents_of

CASES = 40
TABLES = {
    "sweep": {"speed": {"start": 100, "stop": 480, "step": 20}, "gap": [1e-4, 2e-4]}
}


def record(design, case, chance, **more):
    """Return a record as a rank would keep it, of drawn numbers and words."""
    values = {"f8": chance.random, "i8": lambda: int(chance.integers(1000))}
    out = {"case": case, "digest": design.digests[case], "ended": 1e9 + chance.random()}
    out |= {"status": "ok", "message": "", "row": {}, "performance": {}}
    for table, name, kind, words in OWN.fields:
        if table:
            draw = values.get(
                kind, lambda words=words: str(chance.choice(words or ["x"]))
            )
            out[table][name] = draw()
    return out | more


@pytest.fixture
def made(tmp_path):
    """Return a design and a directory with journals of all there may be."""
    design, chance = design_of(TABLES), np.random.default_rng(5)
    prepare(design, tmp_path)
    for run in range(3):
        number = claim_run(tmp_path)
        plan = design.digests.identity if run != 1 else ""
        with Journal(tmp_path, number, 0, plan) as journal:
            for case in chance.integers(0, CASES - 4, 30):
                one = record(design, int(case), chance)
                kind = chance.integers(8)
                if kind == 0:
                    one |= {"status": "failed", "message": "why not"}
                    del one["row"]
                elif kind == 1:
                    one |= {"of": one["digest"], "twin": 1, "digest": "0" * 64}
                elif kind == 2:
                    one["digest"] = "1" * 64  # of no case
                    one["case"] = CASES + 7
                elif kind == 3:
                    one["row"] |= {"regime": "undecided", "stop": "end"}
                elif kind == 4 and not plan:
                    one["case"] = int(chance.integers(CASES))  # of another plan
                journal.append(one, {})
    return design, tmp_path


def by_records(folder, digests):
    """Return what `told_by` is to tell, a line at a time."""
    numbers = {name: case for case, name in enumerate(digests)}
    for _, _, one in whole_records(folder):
        row = one.get("row") or {}
        case = -1 if one.get("twin") else numbers.get(one["digest"], -1)
        words = [row.get(name, "none") for name in ("outcome", "regime")]
        still = one["status"] == "ok" and is_open(row)
        seconds = one["performance"]["seconds"]
        yield (case, one["status"], *words, still, one["ended"], seconds)


def columns(folder, digests):
    return [
        line for _, told in told_by(folder, digests) for line in zip(*told, strict=True)
    ]


def spoilt(folder):
    """Tear the last line, flip a bit of another and seal one that is no numbers."""
    first, second, third = sorted((folder / "journal").iterdir())
    first.write_bytes(first.read_bytes()[:-40])
    lines = second.read_bytes().splitlines(keepends=True)
    place = next(i for i, line in enumerate(lines) if line[AT : AT + 1] == b"~")
    lines[place] = (
        lines[place][:100] + bytes([lines[place][100] ^ 1]) + lines[place][101:]
    )
    second.write_bytes(b"".join(lines))
    lines = third.read_bytes().splitlines(keepends=True)
    line = next(line for line in lines if line[AT : AT + 1] == b"~")
    body = line[AT:-1][:12] + b"!" * (len(line) - AT - 13)
    lines.insert(3, b"%08x " % zlib.crc32(body) + body + b"\n")
    third.write_bytes(b"".join(lines))


@pytest.mark.parametrize("listed", [False, True], ids=["arithmetic", "listed"])
@pytest.mark.parametrize("whole", [True, False], ids=["whole", "spoilt"])
def test_columns_tell_what_records_do(made, whole, listed):
    design, folder = made
    if not whole:
        spoilt(folder)
    digests = list(design.digests) if listed else design.digests
    found, wanted = columns(folder, digests), list(by_records(folder, design.digests))
    assert len(wanted) > 60
    assert found == wanted
    assert {line[1] for line in found} == {"ok", "failed"}
    assert -1 in {line[0] for line in found}


@pytest.mark.parametrize("whole", [True, False], ids=["whole", "spoilt"])
def test_what_has_ended_is_the_same_by_columns_and_by_records(made, whole):
    design, folder = made
    if not whole:
        spoilt(folder)
    stages = Stages(design)
    asked = [design.digests[case] for case in (0, 3, CASES - 1)]
    one, two = ends_of(folder, stages, (), asked), ends_of(folder, stages)
    assert one.over.tolist() == two.over.tolist()
    assert 0 < one.over.sum() < CASES
    np.testing.assert_array_equal(one.seconds, two.seconds)
    assert one.told.keys() == two.told.keys() & set(asked)
    for name, end in one.told.items():
        assert (end.status, end.is_open) == (
            two.told[name].status,
            two.told[name].is_open,
        )


def test_a_line_under_a_plan_that_has_grown_is_known_by_its_digest(made):
    design, folder = made
    more = design_of({"sweep": TABLES["sweep"] | {"gap": [0.5e-4, 1e-4, 2e-4]}})
    prepare(more, folder)
    wanted = list(by_records(folder, more.digests))
    assert columns(folder, more.digests) == wanted
    names = list(design.digests)
    moved = [names.index(more.digests[line[0]]) for line in wanted if line[0] >= 0]
    assert moved != [line[0] for line in wanted if line[0] >= 0]


def test_status_counts_the_same_of_a_listed_plan(made):
    _, folder = made
    plan = read_manifest(folder)
    found = progress_of(folder, 2e9)
    listed = {"digests": list(plan.digests), "settings": list(plan.settings)}
    write_manifest(folder, type(plan)(**{**vars_of(plan), **listed}))
    assert not read_manifest(folder).is_arithmetic
    assert progress_of(folder, 2e9) == found
    assert 0 < found.left < found.cases == CASES
    assert found.failed > 0


def vars_of(plan):
    return {name: getattr(plan, name) for name in plan.__dataclass_fields__}


def test_other_layouts_are_read_and_one_that_lacks_what_is_asked_costs_nothing(made):
    """Of a program with a field more, and of one whose lines do not tell when."""
    design, folder = made
    wider = Layout([*OWN.fields, ("row", "novel", "f8", ())])
    poorer = Layout([field for field in OWN.fields if field[1] != "ended"])
    lines = [wider.head, poorer.head]
    for case, layout in ((5, wider), (CASES - 1, wider), (CASES - 2, poorer)):
        one = record(design, case, np.random.default_rng(case))
        if layout is wider:
            one["row"]["novel"] = 1.0
        else:
            del one["ended"]
        lines.append(sealed_body(layout.packed(one)))
    odd = OWN.packed(record(design, CASES - 3, np.random.default_rng(1)))
    at = len("~00000000 ") + 4 * (OWN.dtype.fields["row.whirl"][1] // 3)
    lines.append(sealed_body(odd[:at] + b"////" + odd[at + 4 :]))  # no word of whirl
    (folder / "journal" / journal_name(9, 0)).write_bytes(b"".join(lines))
    found = columns(folder, design.digests)[-3:]
    assert [line[0] for line in found] == [5, CASES - 1, CASES - 2]
    assert np.isnan(found[2][5])
    assert progress_of(folder, 2e9).cases == CASES
    contents = contents_of(folder)
    assert (contents.place[[5, CASES - 1, CASES - 2], 0] == 3).all()
    assert contents.place[CASES - 3, 0] == -1


def sealed_body(body):
    return b"%08x " % zlib.crc32(body) + body + b"\n"


def test_gather_finds_each_case_where_its_newest_whole_line_is(made):
    design, folder = made
    spoilt(folder)
    contents, newest = contents_of(folder), {}
    for path, start, one in whole_records(folder):
        if not one.get("twin"):
            newest[one["digest"]] = (path.name, start)
    wanted = [newest.get(name, ("", -1)) for name in design.digests]
    names = [*contents.journals, ""]
    assert [(names[n], start) for n, start in contents.place.tolist()] == wanted


def test_numbers_of_the_plan_spare_digests_and_those_of_another_do_not(made):
    design, folder = made
    (first, second, _), asked = sorted((folder / "journal").iterdir()), []
    second.unlink()  # of no plan
    digests = design.digests
    digests.find_all = lambda words, _hints: asked.append(len(words))
    columns(folder, digests)
    assert not asked
    first.write_bytes(first.read_bytes().partition(b"\n")[2])
    with pytest.raises(TypeError):
        columns(folder, digests)
    assert asked


def test_a_later_stage_stands_whatever_lines_follow_it(made):
    """Packed lines after it, and others, between which no packed line is."""
    design, folder = made
    write_manifest(folder, dataclasses.replace(read_manifest(folder), extended=[9.0]))
    chance, case = np.random.default_rng(3), CASES - 1
    later = record(design, case, chance, of=design.digests[case], longest=9.0)
    with Journal(folder, claim_run(folder), 0) as journal:
        for one in (later | {"digest": "2" * 64}, later | {"digest": "2" * 64}):
            journal.append(one, {})
        journal.append(record(design, case, chance), {})
        journal.append(record(design, case - 1, chance), {})
    contents = contents_of(folder)
    path = folder / "journal" / contents.journals[contents.place[case, 0]]
    found, other = read_at(path, contents.place[[case, case - 1], 1].tolist())
    assert found["longest"] == 9.0
    assert other["case"] == case - 1
