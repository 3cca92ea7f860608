"""Journals: what was written is read, and what is damaged costs only itself."""

import errno
import json
import os
import struct
import zlib
from pathlib import Path

import h5py
import numpy as np
import pytest
from journals import journal_of, plan_of
from launch import kept

from hpcwhirl.errors import StoreError, WhirlError
from hpcwhirl.scene.quantities import ROW
from hpcwhirl.scene.words import ENUMS
from hpcwhirl.store.atomic import write_whole
from hpcwhirl.store.directory import journal as journal_module
from hpcwhirl.store.directory import reader as reader_module
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.directory.journal import Journal, Journals, journal_name
from hpcwhirl.store.directory.manifest import PlanFile
from hpcwhirl.store.directory.record import (
    COPY,
    MAGIC,
    fields_of,
    header_of,
    read_header,
)
from hpcwhirl.store.results.gather import gather

AWKWARD = [0.1 + 0.2, 5e-324, -0.0, 1.7976931348623157e308, 1 / 3]
TRACES = {
    "time": np.array(AWKWARD),
    "centre": np.array([[np.nan, -0.0], [np.inf, 1 / 3], [1e-300, 2.0]]).T,
    "none": np.zeros((0, 22, 2)),
}


def record(number):
    row = {"gap": AWKWARD[number]}
    return {"digest": f"d{number}", "status": "ok", "message": "", "row": row}


@pytest.fixture
def folder(tmp_path):
    """Return a directory with three journalled cases, each with traces."""
    with Journal(Journals(tmp_path), 1, 0) as journal:
        for number in range(3):
            traces = {name: array + number for name, array in TRACES.items()}
            journal.append(record(number), traces)
    return tmp_path


@pytest.fixture
def log(folder):
    return folder / "journal/0001-00000.log"


@pytest.fixture
def blocks(folder):
    return folder / "traces/0001-00000.bin"


def test_what_is_read_equals_what_was_written(folder):
    found = Journals(folder).newest()
    assert list(found) == ["d0", "d1", "d2"]
    for number, one in enumerate(found.values()):
        block = one.pop("traces")
        assert one == record(number)
        traces = Journals(folder).traces(block)
        assert traces.keys() == TRACES.keys()
        for name, array in traces.items():
            assert array.shape == TRACES[name].shape
            assert array.tobytes() == (TRACES[name] + number).tobytes()


def test_a_case_without_traces_has_none(tmp_path):
    with Journal(Journals(tmp_path), 1, 0) as journal:
        journal.append(record(0), {})
    assert Journals(tmp_path).newest() == {"d0": record(0)}


def test_a_record_is_on_disk_before_the_journal_is_closed(tmp_path):
    with Journal(Journals(tmp_path), 1, 0) as journal:
        journal.append(record(0), TRACES)
        block = Journals(tmp_path).newest()["d0"]["traces"]
        assert Journals(tmp_path).traces(block)["time"].tolist() == AWKWARD


def test_a_tail_torn_anywhere_costs_the_last_case_alone(folder, log):
    whole, (last, end, _) = log.read_bytes(), kept(log)[-1]
    assert end == len(whole)
    for place in range(last, end, 11):
        log.write_bytes(whole[:place])
        assert list(Journals(folder).newest()) == ["d0", "d1"]


@pytest.mark.turns
@pytest.mark.parametrize("change", ["flipped", "lost", "added"])
def test_a_damaged_byte_costs_its_own_case_alone(folder, log, change):
    """Of its numbers, of its text, of the header, which stands there twice."""
    whole, found = log.read_bytes(), kept(log)
    first = found[0][0]
    for place in [*range(0, first, 101), *range(first, len(whole), 17)]:
        byte = {"flipped": bytes([whole[place] ^ 4]), "lost": b"", "added": b"xx"}
        log.write_bytes(whole[:place] + byte[change] + whole[place + 1 :])
        hit = [r["digest"] for first, end, r in found if first <= place < end]
        rest = [name for name in ("d0", "d1", "d2") if name not in hit]
        assert list(Journals(folder).newest()) == rest


def test_a_truncated_trace_block_drops_its_record(folder, blocks):
    whole = blocks.read_bytes()
    blocks.write_bytes(whole[:-1])
    assert list(Journals(folder).newest()) == ["d0", "d1"]
    blocks.write_bytes(whole[: len(whole) // 3 - 1])
    assert Journals(folder).newest() == {}
    blocks.unlink()
    assert Journals(folder).newest() == {}


def test_a_flipped_byte_in_a_trace_block_is_never_read_as_a_trace(folder, blocks):
    found = Journals(folder).newest()
    whole = bytearray(blocks.read_bytes())
    whole[found["d1"]["traces"]["offset"] + 7] ^= 1
    blocks.write_bytes(whole)
    for name in ("d0", "d2"):
        Journals(folder).traces(found[name]["traces"])
    with pytest.raises(StoreError, match="damaged"):
        Journals(folder).traces(found["d1"]["traces"])


def test_a_run_after_a_torn_one_writes_elsewhere_and_its_records_win(folder, log):
    log.write_bytes(log.read_bytes()[:-5])
    assert Journals(folder).next_run() == 2
    with Journal(Journals(folder), 2, 0) as journal:
        journal.append(record(2), TRACES)
        journal.append(record(0) | {"status": "failed"}, {})
    found = Journals(folder).newest()
    assert sorted(found) == ["d0", "d1", "d2"]
    assert found["d0"]["status"] == "failed"
    assert found["d2"]["traces"]["file"] == "0002-00000.bin"


def test_a_record_of_no_case_of_the_plan_is_ignored(tmp_path):
    plan = plan_of({}, [], [{}])
    PlanFile(tmp_path).write(plan)
    where = {"status": "failed", "message": "why", "performance": {}}
    with Journal(Journals(tmp_path), 1, 0) as journal:
        journal.append({"digest": "alien", **where}, TRACES)
        journal.append({"digest": plan.digests[0], **where}, {})
    path = gather(Directory(tmp_path), {})
    with h5py.File(path) as file:
        assert file["message"][:].tolist() == [b"why"]
        assert "time" not in file


# Records


def usual(number=0, **row):
    """Return a record as campaigns write them, of awkward numbers."""
    kinds = {"f8": AWKWARD[number % len(AWKWARD)], "i8": number}
    values = {n: kinds.get(quantity.kind) for n, quantity in ROW.items()}
    words = {name: known[-1] for name, known in ENUMS.items() if name in ROW}
    spent = {"seconds": 1 / 7, "microseconds_per_step": 2.0, "rank": 3, "host": "node"}
    return {
        "case": number, "digest": f"{number:064x}", "ended": 1.7e9, "status": "ok",
        "message": "", "row": values | words | {"scheme": "modal"} | row,
        "performance": spent,
    }  # fmt: skip


def written(folder, *journals):
    (folder / "journal").mkdir(exist_ok=True)
    for rank, data in enumerate(journals):
        (folder / "journal" / journal_name(1, rank)).write_bytes(data)
    return folder


@pytest.mark.parametrize(
    "more",
    [
        {}, {"of": "0" * 64, "twin": 3, "longest": 0.5}, {"row": {"blade_peak": 0.1}},
        {"measured": {"x": 1.0}, "performance": {"host": "a" * 60}},
        {"row": {"speed": 1}}, {"row": {"regime": "new"}}, {"row": {"host": "é"}},
        {"status": "failed"}, {"digest": "D" * 64}, {"message": "m" * 5000},
        {"performance": {"host": "b" * 90}}, {"row": {"steps": 1 << 70}},
        {"measure_message": "why not", "of": "d"},
    ],
)  # fmt: skip
@pytest.mark.parametrize("measured", [(), ("x", "y")])
def test_a_record_is_read_as_it_was_written(tmp_path, more, measured):
    whole = usual(4)
    for name, value in more.items():
        both = isinstance(value, dict) and name in whole
        whole[name] = whole[name] | value if both else value
    data = journal_of([usual(1), whole, usual(2)], fields=fields_of(measured))
    found = list(Journals(written(tmp_path, data)).newest().values())
    wanted = [usual(1), whole, usual(2)]
    assert [json.dumps(one, sort_keys=True) for one in found] == [
        json.dumps(one, sort_keys=True) for one in wanted
    ]


def test_numbers_keep_their_bits_and_a_record_is_short(tmp_path):
    odd = {"gap": -0.0, "speed": float("inf"), "pulse": 5e-324, "force": float("nan")}
    one, two = (journal_of([usual(2, **odd)] * count) for count in (1, 2))
    assert len(two) - len(one) <= 700
    (found,) = Journals(written(tmp_path, one)).newest().values()
    found = [struct.pack("<d", found["row"][name]) for name in odd]
    assert found == [struct.pack("<d", value) for value in odd.values()]


def test_fields_of_another_version_are_read_by_what_the_journal_tells(tmp_path):
    fields = [("", "digest", "hex", ()), ("", "status", "word", ("odd", "ok"))]
    fields += [("row", "regime", "word", ("calm", "wild")), ("row", "gap", "f8", ())]
    told = {"digest": "a" * 64, "status": "ok", "message": ""}
    told |= {"row": {"regime": "wild", "gap": 1 / 3}, "performance": {"seconds": 1.0}}
    data = journal_of([told, told | {"digest": "b" * 64, "status": "odd"}], "", fields)
    assert Journals(written(tmp_path, data)).newest() == {"a" * 64: told}


def test_a_field_of_another_kind_is_of_no_journal(tmp_path):
    fields = [("", "digest", "hex", ()), ("", "status", "f8", ())]
    _, head = header_of("", "x.bin", fields_of())
    body = json.dumps({"plan": "", "traces": "", "fields": fields}).encode()
    told = COPY.pack(MAGIC, len(body), zlib.crc32(body)) + body
    assert read_header(2 * told) is None
    assert read_header(told + head) is not None
    assert Journals(written(tmp_path, 2 * told + bytes(3000))).newest() == {}


def test_a_word_that_there_is_not_costs_its_case(tmp_path):
    header, head = header_of("", "x.bin", fields_of())
    slots = bytearray(header.layout.encode(usual(1), header.tag))
    slots[header.layout.dtype.fields["row.whirl"][1]] = 200
    slots[4:8] = zlib.crc32(slots[8:]).to_bytes(4, "little")
    good = header.layout.encode(usual(2), header.tag)
    found = Journals(written(tmp_path, head + slots + good)).newest()
    assert list(found) == [usual(2)["digest"]]


def test_a_text_follows_its_own_record_alone(tmp_path):
    """Two slots lost between them make no text of one record that of another."""
    one, two = usual(1) | {"message": "one"}, usual(2) | {"message": "two"}
    data, size = journal_of([one, two]), len(journal_of([one])) - len(journal_of([]))
    begin, half = len(journal_of([])), size // 2
    lost = data[: begin + half] + data[begin + half + size :]
    assert Journals(written(tmp_path, lost)).newest() == {}


@pytest.mark.parametrize("size", [700, 1500, 4000])
def test_any_bytes_read_at_once_tell_the_same(tmp_path, monkeypatch, size):
    random = np.random.default_rng(size)
    some = [usual(n) | {"message": "m" * int(random.choice([0, 10, 3000]))}
            for n in range(40)]  # fmt: skip
    written(tmp_path, journal_of(some))
    wanted = Journals(tmp_path).newest()
    assert len(wanted) == 40
    monkeypatch.setattr(reader_module, "FIRST", len(journal_of([])) + size // 2)
    monkeypatch.setattr(reader_module, "AT_ONCE", size)
    assert Journals(tmp_path).newest() == wanted


# Groups


def on_disk(folder):
    return [int(name, 16) for name in Journals(folder).newest()]


def test_cases_are_kept_after_a_second_and_at_the_end(tmp_path, monkeypatch):
    now = [100.0]
    monkeypatch.setattr(journal_module.time, "monotonic", lambda: now[0])
    with Journal(Journals(tmp_path), 1, 0) as journal:
        for number in range(4):
            journal.append(usual(number), TRACES)
            now[0] += 0.3
        assert on_disk(tmp_path) == [0]
        journal.keep_due()
        assert on_disk(tmp_path) == [0, 1, 2, 3]
        journal.append(usual(4), {})
        assert on_disk(tmp_path) == [0, 1, 2, 3]
        now[0] += journal_module.EVERY
        journal.append(usual(5), {})  # a longer one is kept at once
        assert on_disk(tmp_path) == [0, 1, 2, 3, 4, 5]
        journal.append(usual(6), TRACES)
    found = Journals(tmp_path).newest()
    assert len(found) == 7
    for record in found.values():
        if "traces" in record:
            assert (
                Journals(tmp_path).traces(record["traces"])["time"].tolist() == AWKWARD
            )


def test_much_that_waits_is_kept_at_once(tmp_path):
    traces = {"time": np.zeros(journal_module.MOST // 8)}
    with Journal(Journals(tmp_path), 1, 0) as journal:
        journal.append(usual(0), {})
        journal.append(usual(1), {})
        assert on_disk(tmp_path) == [0]
        journal.append(usual(2), traces)
        assert on_disk(tmp_path) == [0, 1, 2]


@pytest.mark.parametrize("which", ["journal", "traces"])
def test_a_full_disk_costs_a_group_and_what_follows_is_whole(
    tmp_path, monkeypatch, which
):
    real = os.fsync

    def full(number):
        if f"/{which}/" in str(Path(f"/proc/self/fd/{number}").readlink()):
            raise OSError(errno.ENOSPC, "No space left on device")
        real(number)

    with Journal(Journals(tmp_path), 1, 0) as journal:
        journal.append(usual(0), TRACES)
        journal.append(usual(1), TRACES)
        monkeypatch.setattr(os, "fsync", full)
        with pytest.raises(WhirlError, match="No space left"):
            journal.keep()
        assert on_disk(tmp_path) == [0]
        monkeypatch.setattr(os, "fsync", real)
        journal.append(usual(2), TRACES)
    assert on_disk(tmp_path) == [0, 2]
    for record in Journals(tmp_path).newest().values():
        assert Journals(tmp_path).traces(record["traces"])["time"].tolist() == AWKWARD


def test_names_are_synced_before_what_they_name_counts_as_kept(tmp_path, monkeypatch):
    """Else a machine that dies loses whole files whose content was synced."""
    synced, fsync = [], os.fsync

    def noted(handle):
        synced.append(Path(f"/proc/self/fd/{handle}").readlink())
        fsync(handle)

    monkeypatch.setattr(os, "fsync", noted)
    folder = tmp_path / "a" / "b"
    write_whole(folder / "states" / "x", b"1")
    assert {tmp_path, tmp_path / "a", folder} <= set(synced)
    assert synced[-1] == folder / "states"  # after it was renamed
    synced.clear()
    with Journal(Journals(folder), 1, 0) as journal:
        journal.append(record(0), TRACES)
        last = [*synced]
        journal.append(record(1), TRACES)
    assert set(last[:3]) == {folder, folder / "journal", folder / "traces"}
    assert len(synced) == len(last) + 2  # once a file, not once a group
