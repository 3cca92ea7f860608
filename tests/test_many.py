"""Lines read many at once are what each of them by itself tells, in any mixture."""

import random

import numpy as np
import pytest
from specimen import BASE

from hpcwhirl.scene.quantities import PERFORMANCE, ROW
from hpcwhirl.scene.schemes import SCHEMES
from hpcwhirl.scene.words import ENUMS
from hpcwhirl.store.directory import many
from hpcwhirl.store.directory.journal import journal_name
from hpcwhirl.store.directory.lines import OWN, is_packed, line_of, opened, sealed
from hpcwhirl.store.directory.manifest import Manifest, write_manifest
from hpcwhirl.store.results.blocks import block_size, ranges, read_block
from hpcwhirl.store.results.contents import contents_of

CASES = 40


def digest(case):
    return f"{case * 0x9E3779B97F4A7C15 + 1:064x}"[-64:]


def record(case, random_):
    """Return a record with numbers of its own; some are extreme."""
    odd = [-0.0, 5e-324, 1.7976931348623157e308, float("nan"), float("inf")]
    kinds = {
        "f8": lambda: random_.choice([random_.gauss(0, 1), *odd]),
        "i8": lambda: random_.choice([0, -1, 2**62, random_.randrange(10**6)]),
    }
    row = {n: kinds[q.kind]() for n, q in ROW.items() if q.kind in kinds}
    row |= {n: random_.choice(ENUMS[n]) for n in ROW if n in ENUMS}
    row |= {"scheme": random_.choice([*SCHEMES])}
    spent = {n: kinds[q.kind]() for n, q in PERFORMANCE.items() if q.kind in kinds}
    spent["host"] = random_.choice(["node-1", "a.b.c", ""])
    ordered = {name: row[name] for name in ROW}
    return {"case": case, "digest": digest(case), "ended": 1.0 * case, "status": "ok",
            "message": "", "row": ordered, "performance": spent}  # fmt: skip


def failed(case):
    return {"case": case, "digest": digest(case), "ended": 0.0, "status": "failed",
            "message": "why", "performance": {"rank": 0, "host": "x", "seconds": 1.0}
            }  # fmt: skip


def begun(folder):
    settings = [{"speed": 1.0 + case, "direction": "squeeze"} for case in range(CASES)]
    digests = [digest(case) for case in range(CASES)]
    swept = ["speed", "direction"]
    write_manifest(folder, Manifest("e", BASE, swept, digests, settings, "0"))
    (folder / "journal").mkdir()


def written(folder, seed):
    """Write two journals of every kind of line; all cases but a few have several."""
    random_ = random.Random(seed)
    for rank in range(2):
        lines = [OWN.head]
        for _ in range(60):
            case = random_.randrange(CASES - 3)
            own = record(case, random_)
            line = random_.choice([
                line_of(own), line_of(own), line_of(own), sealed(own),
                line_of(own | {"case": random_.choice([-5, 3, 10**9])}),
                line_of(own | {"measured_by": "x"}), line_of(failed(case)),
                line_of(own | {"digest": "ab" * 32}), line_of(own)[:-9] + b"\n",
                line_of(own).replace(b"~", b"!", 1), b"\n", b"junk\n",
            ])  # fmt: skip
            lines.append(line)
        lines.append(line_of(record(0, random_))[:-20])  # torn
        (folder / "journal" / journal_name(1, rank)).write_bytes(b"".join(lines))


def blocks_of(folder, size):
    contents = contents_of(folder)
    found = [read_block(contents, r) for r in ranges(contents.cases, 0, 1, size)]
    return {name: np.concatenate([block[name] for block in found])
            for name in found[0]}, contents  # fmt: skip


@pytest.mark.parametrize("seed", range(6))
def test_columns_are_the_same_as_from_each_line_by_itself(tmp_path, monkeypatch, seed):
    begun(tmp_path)
    written(tmp_path, seed)
    fast, one = blocks_of(tmp_path, 7)
    monkeypatch.setattr(many, "_are_whole", lambda rows: np.zeros(len(rows), bool))
    slow, other = blocks_of(tmp_path, 7)
    for name in ("place", "samples", "interval"):
        assert getattr(one, name).tobytes() == getattr(other, name).tobytes()
    assert fast.keys() == slow.keys()
    for name in fast:
        assert fast[name].dtype == slow[name].dtype, name
        assert fast[name].tobytes() == slow[name].tobytes(), name
    assert {*np.unique(fast["status"])} == {ENUMS["status"].index(word)
            for word in ("ok", "failed", "missing")}  # fmt: skip


def test_most_lines_of_a_summary_campaign_are_read_at_once(tmp_path, monkeypatch):
    begun(tmp_path)
    lines = [line_of(record(case, random.Random(case))) for case in range(CASES)]
    assert all(map(is_packed, lines))
    journal = tmp_path / "journal" / journal_name(1, 0)
    journal.write_bytes(OWN.head + b"".join(lines))
    asked = []
    monkeypatch.setattr(many, "record_of",
                        lambda *words: asked.append(words[1]))  # fmt: skip
    contents = contents_of(tmp_path)
    assert asked == [OWN.head]
    assert (contents.place[:, 0] == 0).all()
    assert block_size(contents) >= CASES


def test_a_word_that_there_is_not_is_left_to_the_one_that_judges():
    good = line_of(record(1, random.Random(1)))
    at = many.FIRST + 4 * (OWN.dtype.fields["row.regime"][1] // 3)
    bodies = [good[many.AT : at] + b"////" + good[at + 4 : -1]]
    import zlib

    bad = [b"%08x " % zlib.crc32(body) + body + b"\n" for body in bodies]
    found, numbers = many.read([good, *bad])
    assert found.tolist() == [0]
    assert len(numbers) == 1
    assert opened(bad[0]) is None


def test_cases_are_found_by_digest_where_numbers_have_changed():
    digests = [digest(case) for case in range(10)]
    known = many.Known(digests)
    raw = np.frombuffer(b"".join(map(bytes.fromhex, digests)), "V32")
    hints = np.array([0, 1, 2, 9, 8, -1, 10**12, 7, 3, 4])
    assert known.find_all(raw, hints).tolist() == list(range(10))
    strange = np.frombuffer(bytes.fromhex("cd" * 32), "V32")
    assert known.find_all(strange, np.array([3])).tolist() == [-1]
    assert [known.find(digests[4], hint) for hint in (4, 5, -1, "4", None)] == [4] * 5
    assert known.find("made-up", 4) == -1
    assert many.Known(["made-up-1", "x"]).find("x", 0) == 1
