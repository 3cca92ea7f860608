"""Plant an instability in the sources, see the run named `unstable`.

    python scripts/evidence/planted.py [WORD...]     only bugs whose name has WORD

Each bug goes into a copy of the package, with a cache of its own, and `hpcwhirl run`
marches Table 2 with it; a broken row of W is that of a blade which touches. Exits 1
where a run has another word, 2 where the place of a bug is no longer in the source.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).parents[2]
LIMIT = 600  # s for one run, compilation included
KERNELS = "dynamics/kernels/"
SHORT = {"duration": 8e-3, "time_step": 2e-6, "interval": 2e-5}


@dataclass(frozen=True)
class Bug:
    """A replacement in the source and the scene that it is tried on."""

    name: str
    file: str
    right: str
    wrong: str
    scheme: str
    settings: dict[str, float] = field(default_factory=dict)


LET_BY = ("dynamics/timestep.py", "if not step < limit:", "if not step < 2 * limit:")
BUGS = (
    Bug("nothing (the sources as they are)", "errors.py", "", "", "general"),
    Bug("step a hair above", *LET_BY, "general", {"time_step": 9.6235e-6}),
    Bug("step above, damped", *LET_BY, "paper", {"time_step": 9.7e-6}),
    Bug(
        "friction of the wrong sign in the correction",
        KERNELS + "general.py",
        "ahead[m] += give[m] * (force_n[m] + mu * force_t[m])",
        "ahead[m] += give[m] * (force_n[m] - mu * force_t[m])",
        "general",
    ),
    Bug(
        "friction of the wrong sign, dense",
        KERNELS + "dense.py",
        "force = force_n[c] + mu * force_t[c]",
        "force = force_n[c] - mu * force_t[c]",
        "paper",
    ),
    Bug(
        "a row of W without the ring",
        KERNELS + "contact.py",
        "w[j, i] += read_ring(response, index, shape, i)",
        "w[j, i] += (j != 17) * read_ring(response, index, shape, i)",
        "general",
    ),
    Bug(
        "a row of W of the wrong sign",
        KERNELS + "contact.py",
        "w[j, i] += read_ring(response, index, shape, i)",
        "w[j, i] += (1.0 - 1.5 * (j == 17)) * read_ring(response, index, shape, i)",
        "paper",
    ),
    Bug(
        "work of friction dropped",
        KERNELS + "general.py",
        "ledger[FRICTION] += mu * force_t[m] * mean",
        "ledger[FRICTION] += 0.0 * force_t[m] * mean",
        "general",
    ),
    Bug(
        "impact entered once only",
        KERNELS + "contact.py",
        "ledger[ROTATION] -= work",
        "ledger[ROTATION] -= 0.0 * work",
        "general",
    ),
    Bug(
        "a kept inverse 2 % too large",
        KERNELS + "circulant.py",
        "column[(where[s] - where[r]) % blades]",
        "0.98 * column[(where[s] - where[r]) % blades]",
        "modal",
    ),
    Bug(
        "turn of the ring to the other side",
        KERNELS + "passes.py",
        "fma(er, di, ei * dr)",
        "fnma(er, di, ei * dr)",
        "modal",
    ),
)  # fmt: skip


def outcome(bug: Bug) -> str:
    """Return the outcome of a run with the bug in; exit 2 where it has no place."""
    with tempfile.TemporaryDirectory(prefix="planted-") as name:
        place = Path(name)
        skip = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / "hpcwhirl", place / "hpcwhirl", ignore=skip)
        target = place / "hpcwhirl" / bug.file
        text = target.read_text(encoding="utf-8")
        if bug.right not in text:
            print(f"{bug.name}: '{bug.right}' is not in {bug.file}", file=sys.stderr)
            raise SystemExit(2)
        if bug.right:
            target.write_text(text.replace(bug.right, bug.wrong), encoding="utf-8")
        call = [sys.executable, "-m", "hpcwhirl", "run", "--json", "--quiet"]
        for key, value in {**SHORT, **bug.settings, "scheme": bug.scheme}.items():
            call += ["--set", f"{key}={value}"]
        kept = {"PYTHONPATH": name, "NUMBA_CACHE_DIR": str(place / "numba")}
        done = subprocess.run(
            call, cwd=place, env=os.environ | kept, capture_output=True, text=True,
            timeout=LIMIT, check=False,
        )  # fmt: skip
    if not done.stdout:
        return f"no result: {done.stderr.strip().splitlines()[-1]}"
    facts = json.loads(done.stdout)
    found = ("ledger_error", "gap_error", "step_share")
    numbers = ", ".join(f"{n} {facts[n]:.1e}" for n in found)
    return f"{facts['outcome']} ({facts['stop']}; {numbers})"


def main() -> int:
    """Try the chosen bugs and report."""
    chosen = [b for b in BUGS if all(w in b.name for w in sys.argv[1:])]
    wrong = 0
    for bug in chosen:
        told = outcome(bug)
        wanted = "unstable" if bug.right else "completed"
        wrong += not told.startswith(wanted)
        print(f"{bug.name:46s} {bug.scheme:8s} {told}", flush=True)
    print(f"{len(chosen) - wrong} of {len(chosen)} as they should be")
    return 1 if wrong else 0


if __name__ == "__main__":
    raise SystemExit(main())
