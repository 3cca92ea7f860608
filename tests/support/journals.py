"""Plans and journals of what they are given, by the program's own writer."""

import numpy as np

from hpcwhirl.scene.case_digest import PHYSICS_VERSION
from hpcwhirl.scene.digests import CaseDigests
from hpcwhirl.scene.input_names import FILE
from hpcwhirl.scene.quantities import PERFORMANCE, ROW
from hpcwhirl.scene.schemes import SCHEMES
from hpcwhirl.scene.table import Table
from hpcwhirl.scene.words import ENUMS
from hpcwhirl.store.directory.manifest import Manifest
from hpcwhirl.store.directory.record import fields_of, header_of


def plan_of(base, swept, settings, engine="e"):
    """Return a plan of made-up inputs: those that all share, and those of each case."""
    shared, table = {FILE: ""} | base, Table.of(settings)
    digests = CaseDigests(shared, table, {"": ""}, PHYSICS_VERSION)
    return Manifest(engine, shared, swept, digests, table, "0")


def journal_of(records, plan="", fields=None):
    """Return the bytes of a journal."""
    header, head = header_of(plan, "0001-00000.bin", fields or fields_of())
    return head + b"".join(header.layout.encode(r, header.tag) for r in records)


def digest_of(case):
    return f"{case * 0x9E3779B97F4A7C15 + 1:064x}"[-64:]


def drawn(case, random):
    """Return a record of a case with drawn numbers and words; some are extreme."""
    odd = [-0.0, 5e-324, 1.7976931348623157e308, np.nan, np.inf]
    kinds = {
        "f8": lambda: float(random.choice([random.normal(), *odd])),
        "i8": lambda: int(random.choice([0, -1, 2**62, random.integers(10**6)])),
    }
    row = {n: kinds[q.kind]() for n, q in ROW.items() if q.kind in kinds}
    row |= {n: str(random.choice(ENUMS[n])) for n in ROW if n in ENUMS}
    row["scheme"] = str(random.choice([*SCHEMES]))
    spent = {n: kinds[q.kind]() for n, q in PERFORMANCE.items() if q.kind in kinds}
    spent |= {"seconds": float(random.random()), "host": "node-1"}
    return {
        "case": case, "digest": digest_of(case), "ended": 1e9 + float(random.random()),
        "status": "ok", "message": "", "row": row, "performance": spent,
    }  # fmt: skip
