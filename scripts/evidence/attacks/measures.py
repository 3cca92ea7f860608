"""Hostile functions of a case: none changes what is stored, ends or hangs a campaign.

Each is written to a file, called, then changed by a number and called again, which is
to be refused.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

from attacks.family import Chance, Family, Verdict, fault
from attacks.process import Ended, fork
from attacks.specimens import Specimen, differs
from attacks.text import warm

SOURCE = """
import os, sys, threading
import numpy as np
NUMBER = {number}
class Silent(Exception):
    def __str__(self): raise self
class Bare(BaseException): pass
class Odd:
    def __float__(self): sys.exit(0)
def f(case):
    {body}
    return {{"x": NUMBER * 1.0}}
"""
KINDS = {
    "changes": (
        "case.centre.values[:] = 7", "case['centre'] -= case.centre.mean()",
        "case.centre.data.setflags(write=True); case.centre.data[...] = 7",
        "[case[n].values.setflags(write=True) for n in case.variables]",
        "np.ndarray.sort(case.energy.values)", "case.time.values[...] = 0",
        "case.attrs.clear(); case.attrs['speed'] = 0", "case.speed.values[...] = 0",
        "np.add.at(case.centre.values, 0, 1.0)", "np.copyto(case.centre.values, 0.0)",
        "[np.asarray(case[n]).fill(0) for n in case.data_vars]",
    ),
    "ends": (
        "sys.exit(0)", "sys.exit(3)", "sys.exit('x')", "os._exit(0)", "os._exit(9)",
        "raise Bare", "raise Silent", "raise GeneratorExit", "raise StopIteration",
        "raise RecursionError", "raise MemoryError", "raise SystemExit(None)",
        "raise ValueError('\\x1b[2J' * 9999)", "return f(case)",
        "raise BaseExceptionGroup('a', [Bare()])",
    ),
    "returns": (
        "return None", "return {}", "return {'y': 1}", "return {'x': Odd()}",
        "return {'x': None}", "return {'x': 1j}", "return {'x': 'é'}", "return f",
        "return {'x': []}", "return {'x': float('nan')}", "return [('x', 1)]",
        "return {1: 2}", "return {'x': np.ones(3)}", "return {'x': 10 ** 400}",
    ),
    "beside": (
        "os.chdir('/')", "os.fork()", "os.fork() or os._exit(0)", "os.environ.clear()",
        "os.fork() or sys.exit(0)", "np.seterr(all='raise')", "np.random.seed(1)",
        "threading.Thread(target=sys.exit).start()", "print('\\x1b[2J')",
        "os.fork() or os.abort()",
    ),
}  # fmt: skip
BESIDE = frozenset({"x", "measure_message"})  # variables of the function's own


def _call(place: Path, body: str, number: int, file: Path) -> Ended:
    """Return how a campaign ended that was called with a function of this body."""

    def action() -> int:
        import hpcwhirl

        os.chdir(place)
        sys.path.insert(0, str(place))
        sys.dont_write_bytecode = True
        f = __import__("own_measure").f
        try:
            hpcwhirl.campaign(file, "out", measure=f, variables={"x": "1"}).close()
        except ValueError as refused:
            print(f"hpcwhirl: error: {refused}", file=sys.stderr)
            return 2
        return 0

    text = SOURCE.format(number=number, body=body)
    (place / "own_measure.py").write_text(text)
    return fork(action, place, f"call-{number}").wait()


def attempt(shared: Specimen, chance: Chance, place: Path) -> Verdict:
    """Call a campaign with a hostile function, then with another one."""
    kind = chance.choice(list(KINDS))
    body = chance.choice(KINDS[kind])
    wrong = fault(_call(place, body, 1, shared.file), (0,))
    wrong = wrong or differs(place / "out", shared.truth, place, BESIDE)
    if not wrong:
        again = _call(place, body, 2, shared.file)
        wrong = fault(again, (2,))
        if not wrong and "another measure" not in again.err:
            wrong = f"another one was not refused as one: {again.last}"
    return Verdict(kind, f"{body}: {wrong}" if wrong else "")


FAMILIES = {
    "measures": Family("hostile functions of a case, then changed ones", 200, warm,
                       attempt),
}  # fmt: skip
