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

from hpcwhirl.errors import StoreError, WhirlError
from hpcwhirl.scene.quantities import ROW
from hpcwhirl.scene.words import ENUMS
from hpcwhirl.store.directory import journal as journal_module
from hpcwhirl.store.directory.journal import (
    Journal,
    next_run,
    read_at,
    read_records,
    read_traces,
)
from hpcwhirl.store.directory.lines import Layout, is_packed, line_of, opened, sealed
from hpcwhirl.store.directory.manifest import Manifest, write_manifest
from hpcwhirl.store.results.gather import gather

AWKWARD = [0.1 + 0.2, 5e-324, -0.0, 1.7976931348623157e308, 1 / 3]
TRACES = {
    "time": np.array(AWKWARD),
    "centre": np.array([[np.nan, -0.0], [np.inf, 1 / 3], [1e-300, 2.0]]).T,
    "none": np.zeros((0, 22, 2)),
}


def record(number):
    return {"digest": f"d{number}", "status": "ok", "row": {"gap": AWKWARD[number]}}


@pytest.fixture
def folder(tmp_path):
    """Return a directory with three journalled cases, each with traces."""
    with Journal(tmp_path, 1, 0) as journal:
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
    found = read_records(folder)
    assert list(found) == ["d0", "d1", "d2"]
    for number, one in enumerate(found.values()):
        block = one.pop("traces")
        assert one == record(number)
        traces = read_traces(folder, block)
        assert traces.keys() == TRACES.keys()
        for name, array in traces.items():
            assert array.shape == TRACES[name].shape
            assert array.tobytes() == (TRACES[name] + number).tobytes()


def test_a_case_without_traces_has_none(tmp_path):
    with Journal(tmp_path, 1, 0) as journal:
        journal.append(record(0), {})
    assert read_records(tmp_path) == {"d0": record(0)}


def test_a_record_is_on_disk_before_the_journal_is_closed(tmp_path):
    with Journal(tmp_path, 1, 0) as journal:
        journal.append(record(0), TRACES)
        block = read_records(tmp_path)["d0"]["traces"]
        assert read_traces(tmp_path, block)["time"].tolist() == AWKWARD


def test_a_tail_torn_anywhere_costs_the_last_case_alone(folder, log):
    whole = log.read_bytes()
    last = whole.rindex(b"\n", 0, -1) + 1
    for end in range(last, len(whole)):
        log.write_bytes(whole[:end])
        assert list(read_records(folder)) == ["d0", "d1"]


def test_a_flipped_byte_costs_its_own_case_alone(folder, log):
    whole = log.read_bytes()
    first, second = (i for i, byte in enumerate(whole[:-1]) if byte == ord("\n"))
    for place in range(first + 1, second):
        log.write_bytes(whole[:place] + bytes([whole[place] ^ 4]) + whole[place + 1 :])
        assert list(read_records(folder)) == ["d0", "d2"]


def test_a_truncated_trace_block_drops_its_record(folder, blocks):
    whole = blocks.read_bytes()
    blocks.write_bytes(whole[:-1])
    assert list(read_records(folder)) == ["d0", "d1"]
    blocks.write_bytes(whole[: len(whole) // 3 - 1])
    assert read_records(folder) == {}
    blocks.unlink()
    assert read_records(folder) == {}


def test_a_flipped_byte_in_a_trace_block_is_never_read_as_a_trace(folder, blocks):
    found = read_records(folder)
    whole = bytearray(blocks.read_bytes())
    whole[found["d1"]["traces"]["offset"] + 7] ^= 1
    blocks.write_bytes(whole)
    for name in ("d0", "d2"):
        read_traces(folder, found[name]["traces"])
    with pytest.raises(StoreError, match="damaged"):
        read_traces(folder, found["d1"]["traces"])


def test_a_run_after_a_torn_one_writes_elsewhere_and_its_records_win(folder, log):
    log.write_bytes(log.read_bytes()[:-5])
    assert next_run(folder) == 2
    with Journal(folder, 2, 0) as journal:
        journal.append(record(2), TRACES)
        journal.append(record(0) | {"status": "failed"}, {})
    found = read_records(folder)
    assert sorted(found) == ["d0", "d1", "d2"]
    assert found["d0"]["status"] == "failed"
    assert found["d2"]["traces"]["file"] == "0002-00000.bin"


def test_a_record_of_no_case_of_the_plan_is_ignored(tmp_path):
    write_manifest(tmp_path, Manifest("e", {}, [], ["known"], [{}], "0"))
    where = {"status": "failed", "message": "why", "performance": {}}
    with Journal(tmp_path, 1, 0) as journal:
        journal.append({"digest": "alien", **where}, TRACES)
        journal.append({"digest": "known", **where}, {})
    path = gather(tmp_path, {})
    with h5py.File(path) as file:
        assert file["message"][:].tolist() == [b"why"]
        assert "time" not in file


# Packed lines


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


@pytest.mark.parametrize(
    "more",
    [
        {}, {"of": "d", "twin": 3, "longest": 0.5}, {"row": {"blade_peak": 0.1}},
        {"measured": {"x": 1.0}, "performance": {"host": "a" * 60}},
        {"row": {"speed": 1}}, {"row": {"regime": "new"}}, {"row": {"host": "é"}},
        {"status": "failed"}, {"digest": "D" * 64}, {"message": "m"},
    ],
)  # fmt: skip
def test_a_record_is_the_same_packed_or_not(more):
    whole = usual(4)
    for name, value in more.items():
        both = isinstance(value, dict) and name in whole
        whole[name] = whole[name] | value if both else value
    found = opened(line_of(whole))
    assert json.dumps(found, sort_keys=True) == json.dumps(whole, sort_keys=True)
    assert opened(sealed(whole)) == whole  # as versions before wrote all of them


def test_numbers_keep_their_bits_and_a_line_is_short():
    odd = {"gap": -0.0, "speed": float("inf"), "pulse": 5e-324, "force": float("nan")}
    line = line_of(usual(2, **odd))
    assert is_packed(line)
    assert len(line) <= 700
    row = opened(line)["row"]
    found = [struct.pack("<d", row[name]) for name in odd]
    assert found == [struct.pack("<d", value) for value in odd.values()]


def test_a_flipped_byte_costs_one_packed_case_alone(tmp_path):
    with Journal(tmp_path, 1, 0) as journal:
        for number in range(3):
            journal.append(usual(number), {})
    (log,) = (tmp_path / "journal").iterdir()
    whole, names = log.read_bytes(), [f"{number:064x}" for number in range(3)]
    assert list(read_records(tmp_path)) == names
    starts = [i + 1 for i, byte in enumerate(whole) if byte == ord("\n")]
    assert len(starts) == 4  # the layout, and three cases
    for place in range(0, starts[-1], 5):
        log.write_bytes(whole[:place] + bytes([whole[place] ^ 4]) + whole[place + 1 :])
        hit = sum(start <= place for start in starts)
        lost = names[hit - 1] if hit else None
        assert list(read_records(tmp_path)) == [n for n in names if n != lost]


def test_lines_of_another_layout_are_read_by_what_their_file_tells(tmp_path):
    fields = [("", "digest", "hex", ()), ("row", "regime", "word", ("calm", "wild"))]
    fields += [("row", "gap", "f8", ()), ("performance", "seconds", "f8", ())]
    other = Layout(fields)
    told = {"digest": "a" * 64, "status": "ok", "message": ""}
    told |= {"row": {"regime": "wild", "gap": 1 / 3}, "performance": {"seconds": 1.0}}
    body = other.packed(told)
    line = f"{zlib.crc32(body):08x} ".encode() + body + b"\n"
    assert opened(line) is None  # what it means is not known
    (tmp_path / "journal").mkdir()
    log = tmp_path / "journal/0001-00000.log"
    log.write_bytes(other.head + line)
    assert read_at(log, [len(other.head)]) == [told]
    assert read_records(tmp_path) == {"a" * 64: told}


# Groups


def on_disk(folder):
    return [int(name, 16) for name in read_records(folder)]


def test_cases_are_kept_after_a_second_and_at_the_end(tmp_path, monkeypatch):
    now = [100.0]
    monkeypatch.setattr(journal_module.time, "monotonic", lambda: now[0])
    with Journal(tmp_path, 1, 0) as journal:
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
    found = read_records(tmp_path)
    assert len(found) == 7
    for record in found.values():
        if "traces" in record:
            assert read_traces(tmp_path, record["traces"])["time"].tolist() == AWKWARD


def test_much_that_waits_is_kept_at_once(tmp_path):
    traces = {"time": np.zeros(journal_module.MOST // 8)}
    with Journal(tmp_path, 1, 0) as journal:
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

    with Journal(tmp_path, 1, 0) as journal:
        journal.append(usual(0), TRACES)
        journal.append(usual(1), TRACES)
        monkeypatch.setattr(os, "fsync", full)
        with pytest.raises(WhirlError, match="No space left"):
            journal.keep()
        assert on_disk(tmp_path) == [0]
        monkeypatch.setattr(os, "fsync", real)
        journal.append(usual(2), TRACES)
    assert on_disk(tmp_path) == [0, 2]
    for record in read_records(tmp_path).values():
        assert read_traces(tmp_path, record["traces"])["time"].tolist() == AWKWARD
