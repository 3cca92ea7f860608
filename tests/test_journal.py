"""Journals: what was written is read, and what is damaged costs only itself."""

import h5py
import numpy as np
import pytest

from hpcwhirl.errors import StoreError
from hpcwhirl.store.gather import gather
from hpcwhirl.store.journal import Journal, next_run, read_records, read_traces
from hpcwhirl.store.manifest import Manifest, write_manifest

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
