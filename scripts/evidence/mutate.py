"""Put a bug in, see a test fail: one bug at a time, in a copy of the tree.

    python scripts/evidence/mutate.py [WORD...]   only bugs whose truth or file has WORD

Exits 1 where a bug goes unseen, 2 where its place is no longer in the source.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
LIMIT = 300  # s for the tests of one bug


@dataclass(frozen=True)
class Bug:
    """A replacement in the source, and the tests that should see it."""

    truth: str
    file: str
    right: str
    wrong: str
    tests: str


BEAMS, RING = "structure/beams.py", "structure/ring.py"
KERNELS, REDUCED = "dynamics/kernels/", "reduction/craig_bampton.py"
CONTACT, CYCLIC = KERNELS + "contact.py", KERNELS + "cyclic.py"
GENERAL, PASSES = KERNELS + "general.py", KERNELS + "passes.py"
CIRCULANT, SLOTS = KERNELS + "circulant.py", "dynamics/slots.py"
TIMESTEP, FLIGHTS = "dynamics/timestep.py", "dynamics/flights.py"
FLIGHT = "test_flight.py"
STRUCTURE, REDUCTION = "test_structure.py", "test_reduction.py"
MARCH, WHIRL, BARS = "test_march.py", "test_whirl.py", "test_bars.py"
ANALYSIS = "test_analysis.py"
WALL = (
    MARCH + "::test_rotation_work_of_a_rigid_casing_is_that_of_its_way_past_the_blades"
)
AGREE = MARCH + "::test_schemes_agree_on_the_casing_trace"
BUGS = (
    Bug("1 membrane strain", BEAMS, "shape / radius\n", "-shape / radius\n", STRUCTURE),
    Bug(
        "1 bending strain", BEAMS, "-slope / radius, h", "slope / radius, h", STRUCTURE
    ),
    Bug("1 Hermite slope", BEAMS, "x * (1 - x) ** 2]", "x * (1 - x)]", STRUCTURE),
    Bug("1 taper", BEAMS, "h**3 / 12", "h**2 * self.thickness[0] / 12", STRUCTURE),
    Bug("1 reading the ring", RING, "node + 2] +=", "node + 2] -=", STRUCTURE),
    Bug("2 static modes", REDUCED, "= -np.linalg", "= np.linalg", REDUCTION),
    Bug("2 mass norm", REDUCED, "kept:] = modes", "kept:] = 1.01 * modes", REDUCTION),
    Bug(
        "2 phase of Eq. 10",
        "reduction/cyclic.py",
        "np.exp(2j *",
        "np.exp(-2j *",
        REDUCTION,
    ),
    Bug("2 pairs", "reduction/modes.py", "if width > left:", "if left < 1:", REDUCTION),
    Bug(
        "3 rod",
        BEAMS,
        "line_mass * np.outer(n_axial",
        "1.1 * line_mass * np.outer(n_axial",
        BARS,
    ),
    Bug("3 both bodies' gap", CONTACT, "w[j, i] += read", "w[j, i] += 0 * read", BARS),
    Bug("3 friction on the tip", GENERAL, "mu * force_t[m])", "force_t[m])", BARS),
    Bug("3 multiplier", GENERAL, "radial, -1.0, normal", "radial, -0.9, normal", BARS),
    Bug("3 impact", CONTACT, "0.5 * push[s] * before", "0.55 * push[s] * before", BARS),
    Bug(
        "3 rigid wall",
        CONTACT,
        "scene[2] * math.exp",
        "1.01 * scene[2] * math.exp",
        BARS,
    ),
    Bug(
        "5 carried by a rigid casing",
        CYCLIC,
        "ledger[IMPACT] += carried",
        "ledger[IMPACT] -= carried",
        WALL,
    ),
    Bug(
        "5 way past the blades",
        CONTACT,
        "speed * since + place",
        "speed * time + place",
        WALL,
    ),
    Bug(
        "6 frame of the casing's trace",
        SLOTS,
        "np.exp(-1j * place.harmonic * angles)",
        "np.exp(1j * place.harmonic * angles)",
        AGREE,
    ),
    Bug(
        "4 recursion",
        "dynamics/timestep.py",
        "1.0 / step**2 - damping",
        "1.0 / step**2 + damping",
        MARCH,
    ),
    Bug("4 harmonics", "structure/fourier.py", "[h * h, h]", "[h * h, -h]", STRUCTURE),
    Bug("4 ring interpolation", CONTACT, "(1.0 - x) * (1.0 - x)", "(1.0 - x)", MARCH),
    Bug(
        "4 pulse",
        PASSES,
        "push * lobe[m]\n            re",
        "push\n            re",
        MARCH,
    ),
    Bug(
        "4 turning ring", PASSES, "fma(er, di, ei * dr)", "fnma(er, di, ei * dr)", MARCH
    ),
    Bug(
        "4 folding",
        "dynamics/slots.py",
        "blades - rest, -1.0",
        "blades - rest, 1.0",
        MARCH,
    ),
    Bug("5 friction on the tip", GENERAL, "tangential, -1.0", "tangential, 1.0", MARCH),
    Bug("5 friction on the ring", GENERAL, "shape, along_c", "shape, radial_c", MARCH),
    Bug("5 tangential phase", SLOTS, "push.real, -push", "push.real, push", MARCH),
    Bug(
        "5 compliance of the ring", CONTACT, "w[j, i] += read", "w[j, i] -= read", MARCH
    ),
    Bug("5 Delassus spectrum", SLOTS, "- 1j * items", "+ 1j * items", MARCH),
    Bug("5 damping loss", PASSES, "* both, both, loss)", ", both, loss)", MARCH),
    Bug(
        "5 increment corrected",
        PASSES,
        "                store(t, now + m, d)\n            if ended:",
        "            if ended:",
        MARCH,
    ),
    Bug("5 impact", CONTACT, "0.5 * push[s] * before", "push[s] * before", MARCH),
    Bug(
        "5 kept inverse", CIRCULANT, "where[s] - where[r]", "where[r] - where[s]", MARCH
    ),
    Bug(
        "5 carried contacts", PASSES, "fnma(spin, yi, pass", "fma(spin, yi, pass", MARCH
    ),
    Bug(
        "7 exact flow", TIMESTEP, "+ 4 * decay * half", "+ 3.999 * decay * half", FLIGHT
    ),
    Bug("7 exact work", TIMESTEP, "(before[1] + after[1])", "before[1]", MARCH),
    Bug("7 exact loss", TIMESTEP, "scale * of_q**2", "scale * of_q", MARCH),
    Bug("7 bound of the gaps", FLIGHTS, "omega + 2 * spin", "0.5 * omega", FLIGHT),
    Bug("7 certificate", FLIGHTS, "REACH] = held", "REACH] = 0.1 * held", FLIGHT),
    Bug("7 jump", FLIGHTS, "back * (vd - of_q * qd)", "back * vd", FLIGHT),
    Bug(
        "5 complementarity",
        CONTACT,
        "if right[s] < 0.0:",
        "if right[s] < -1e30:",
        MARCH,
    ),
    Bug("5 guess", CIRCULANT, "push[s] >= 0.0", "push[s] >= -1e30", MARCH),
    Bug(
        "6 sign of friction",
        "dynamics/operators.py",
        "np.sign(scene.speed)",
        "1.0",
        MARCH,
    ),
    Bug(
        "6 place of the blades",
        CONTACT,
        "turned + 2.0 * math.pi * j / blades",
        "turned + 2.0 * math.pi * (j + 0.01 * (j == 3)) / blades",
        MARCH,
    ),
    Bug(
        "6 frame of the orbit",
        "analysis/whirl.py",
        "np.exp(1j * angle)",
        "np.exp(-1j * angle)",
        WHIRL,
    ),
    Bug(
        "6 centre of nodal diameter 1",
        "analysis/participation.py",
        "centre[:, 0] - 1j * centre[:, 1]",
        "centre[:, 0] + 1j * centre[:, 1]",
        ANALYSIS,
    ),
    Bug(
        "6 frame of the ring",
        "analysis/stability.py",
        "turn = -1j * h * speed",
        "turn = 1j * h * speed",
        ANALYSIS,
    ),
    Bug(
        "6 sliding of closed contacts",
        "analysis/stability.py",
        "push = -count * (radial + mu",
        "push = -count * (radial - mu",
        ANALYSIS,
    ),
    Bug(
        "6 place of a contact",
        "analysis/contact_map.py",
        "(speed * when + around",
        "(-speed * when + around",
        ANALYSIS,
    ),
)


def seen(bug: Bug) -> bool:
    """Return whether the bug's tests fail with it; exit 2 where it does not apply."""
    with tempfile.TemporaryDirectory(prefix="mutate-") as name:
        place = Path(name)
        for part in ("hpcwhirl", "tests", "scripts"):
            skip = shutil.ignore_patterns("__pycache__")
            shutil.copytree(ROOT / part, place / part, ignore=skip)
        shutil.copy(ROOT / "pyproject.toml", place)
        target = place / "hpcwhirl" / bug.file
        text = target.read_text(encoding="utf-8")
        if bug.right not in text:
            print(f"{bug.truth}: '{bug.right}' is not in {bug.file}", file=sys.stderr)
            raise SystemExit(2)
        target.write_text(text.replace(bug.right, bug.wrong), encoding="utf-8")
        call = [sys.executable, "-m", "pytest", "-qx", "-p", "no:cacheprovider"]
        kept = {"PYTHONPATH": name, "NUMBA_CACHE_DIR": str(place / "numba")}
        done = subprocess.run(
            [*call, f"tests/{bug.tests}"], cwd=place, env=os.environ | kept,
            capture_output=True, text=True, timeout=LIMIT, check=False,
        )  # fmt: skip
    lines = done.stdout.splitlines()
    failed = [line for line in lines if line.startswith(("FAILED", "ERROR"))]
    verdict = failed[0].split(" - ")[0] if failed else "NOT SEEN"
    print(f"{bug.truth:26s} {bug.file:26s} {verdict}", flush=True)
    return done.returncode == 1 and bool(failed)


def main() -> int:
    """Try the chosen bugs and report."""
    chosen = [
        b for b in BUGS
        if all(w in f"{b.truth} {b.file}" for w in sys.argv[1:])
    ]  # fmt: skip
    unseen = [bug.truth for bug in chosen if not seen(bug)]
    print(f"{len(chosen) - len(unseen)} of {len(chosen)} bugs seen")
    return 1 if unseen else 0


if __name__ == "__main__":
    raise SystemExit(main())
