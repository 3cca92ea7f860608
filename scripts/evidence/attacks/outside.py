"""What comes from outside a campaign: links, libraries, caches, styles, processors.

Each may be planted by another user, or be the fault of a machine, a library or a file
of settings that has nothing to do with the campaign.
"""

from __future__ import annotations

import csv
import io
import os
import pickle
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import h5py
import numpy as np

from attacks.damage import cut, flipped
from attacks.family import Chance, Family, Verdict, fault, first
from attacks.process import PROGRAM, Ended, run, start
from attacks.specimens import PLAIN, Specimen, differs, undisturbed
from attacks.text import BESIDE, called, warm

KEPT = b"of another campaign\n"


def _half(shared: Specimen, out: Path) -> Path:
    """Copy a campaign that half of its cases are missing from."""
    shutil.copytree(shared.out, out)
    (out / "results.h5").unlink()
    (log,) = (out / "journal").glob("*.log")
    os.truncate(log, log.stat().st_size // 2)
    return out


def _calls(shared: Specimen, out: Path) -> list[str]:
    """Return the words that complete it; what is damaged is computed again."""
    return [*shared.calls(out)[0], "--retry", "failed"]


# Planted links: whoever may write in the directory has its owner write elsewhere

AIMS = (
    "traces/0002-00000.bin", "journal/0002-00000.log", "journal/0002-00001.log",
    "running/0002-00000.log", "runs/0002.json", "results.h5", "campaign.json",
    "states/x.state", "map.png", "report.html",
)  # fmt: skip


def attempt_links(shared: Specimen, chance: Chance, place: Path) -> Verdict:
    """Plant a link of either kind for a file that a run may write."""
    out, aim = _half(shared, place / "out"), chance.choice(AIMS)
    plant = chance.choice([Path.symlink_to, Path.hardlink_to])
    victim, path = place / "victim", out / aim
    content = path.read_bytes() if path.exists() else KEPT
    victim.write_bytes(content)
    path.unlink(missing_ok=True)
    path.parent.mkdir(exist_ok=True)
    plant(path, victim)
    ended = run(_calls(shared, out), place)
    wrong = fault(ended, (0, 2))
    if victim.read_bytes() != content:
        wrong = wrong or "a file outside the directory was written to"
    if not wrong and not ended.code:
        wrong = differs(out, shared.truth, place)
    return Verdict(f"{plant.__name__}: {aim}", wrong)


# The floating-point environment, changed by a function that is called for each case

CHANGE = "import ctypes; c = ctypes.CDLL(None); "
FLUSH = "b = bytearray(256); a = (ctypes.c_char * 256).from_buffer(b); c.fegetenv(a); "
FLUSH += "b[28:32] = bytes([b[28] | 0x40, b[29] | 0x80, b[30], b[31]]); c.fesetenv(a)"
ROUNDING = {
    **{f"round {way}": f"{CHANGE}c.fesetround({bits})"
       for way, bits in (("down", 0x400), ("up", 0x800), ("to zero", 0xC00))},
    "subnormal numbers are zero": CHANGE + FLUSH,
    "then raises": f"{CHANGE}c.fesetround(0x800); raise ValueError",
    "of its own thread": f"{CHANGE}threading.Thread(target=c.fesetround, "
                         "args=(0x800,)).start()",
    "of NumPy": "np.seterr(all='raise')",
}  # fmt: skip


def attempt_rounding(shared: Specimen, chance: Chance, place: Path) -> Verdict:
    """Change how numbers round, in each case or in every second."""
    kind = chance.choice(list(ROUNDING))
    wrong = fault(called(place, ROUNDING[kind], 1, shared.file), (0,))
    return Verdict(kind, wrong or differs(place / "out", shared.truth, place, BESIDE))


# Compiled code on disk: damaged by a crash, or planted

MARK = "planted"


class _Planted:
    """Code that makes a file, if it is loaded as numba's compiled code is."""

    def __init__(self, mark: Path) -> None:
        self.mark = mark

    def __reduce__(self) -> tuple[Callable[..., object], tuple[str]]:
        return os.mkdir, (str(self.mark),)


@dataclass(frozen=True)
class Cached:
    """A campaign, and a cache that has all that it needs."""

    specimen: Specimen
    cache: Path


def prepare_caches(place: Path) -> Cached:
    """Compute a campaign with a cache of its own."""
    specimen = undisturbed(replace(PLAIN, speeds=3), place)
    cache, out = place / "cache", place / "filled"
    ended = _with_cache(specimen, out, place, cache)
    if ended.code:
        raise RuntimeError(ended.err)
    return Cached(specimen, cache)


def _with_cache(shared: Specimen, out: Path, place: Path, cache: Path) -> Ended:
    words = [*PROGRAM, *_calls(shared, out), "--map=no", "--report=no"]
    return start(words, place, {"NUMBA_CACHE_DIR": str(cache)}).wait(4)


def attempt_caches(shared: Cached, chance: Chance, place: Path) -> Verdict:
    """Damage some files of the cache, or give one to another user, who writes it."""
    cache, mark = place / "cache", place / MARK
    shutil.copytree(shared.cache, cache)
    files = sorted(cache.glob("*/*.nbc"))
    kind = chance.choice(
        ["empty", "cut", "flipped", "of another user", "all may write"]
    )
    for path in chance.sample(files, min(len(files), chance.choice([1, 5, 500]))):
        data = bytearray(path.read_bytes())
        if kind in ("cut", "flipped"):
            path.write_bytes((cut if kind == "cut" else flipped)(data, chance))
        else:
            path.write_bytes(b"" if kind == "empty" else _planted(mark))
        if kind == "of another user":
            os.chown(path, 65534, 65534)
        elif kind == "all may write":
            path.chmod(0o666)
    out = place / "out"
    wrong = fault(_with_cache(shared.specimen, out, place, cache), (0,))
    wrong = wrong or ("planted code was executed" if mark.exists() else "")
    return Verdict(kind, wrong or differs(out, shared.specimen.truth, place))


def _planted(mark: Path) -> bytes:
    from hashlib import sha256

    content = pickle.dumps(_Planted(mark))
    return sha256(content).digest() + content


# A file of Matplotlib's settings, in the working or the home directory

STYLES = (
    "text.usetex: True", "font.size: 40", "axes.facecolor: red", "savefig.dpi: 3000",
    "backend: qtagg", "text.usetex: maybe", "no.such.key: 1", "axes.prop_cycle: x",
    "figure.autolayout: True", "font.family: Nothing", "savefig.format: pdf",
    "axes.formatter.use_mathtext: True", "path.simplify: False", "lines.linewidth: 9",
)  # fmt: skip


def prepare_styles(place: Path) -> Specimen:
    """Compute a campaign, and draw its map in a process of its own."""
    specimen = undisturbed(replace(PLAIN, speeds=3), place)
    ended = start([*PROGRAM, "map", specimen.out], place).wait(4)
    if ended.code:
        raise RuntimeError(ended.err)
    return specimen


def attempt_styles(shared: Specimen, chance: Chance, place: Path) -> Verdict:
    """Draw the map beside such a file: it is the same picture."""
    out, lines = place / "out", chance.sample(STYLES, chance.choice([1, 1, 2, 4]))
    shutil.copytree(shared.out, out)
    before = (out / "map.png").read_bytes()
    (out / "map.png").unlink()
    (place / "matplotlibrc").write_text("\n".join(lines) + "\n")
    call = ["bash", "-c", 'cd "$0" && exec "$@"', place, *PROGRAM, "map", out]
    wrong = fault(start(call, place).wait(4), (0,), most=2000)
    if not wrong and (out / "map.png").read_bytes() != before:
        wrong = "the map is another picture"
    return Verdict("matplotlibrc", f"{lines}: {wrong}" if wrong else "")


# Another kind of processor, other libraries: told in one line, or refused

PROCESSORS = {
    "an older BLAS": {"OPENBLAS_CORETYPE": "Nehalem"},
    "NumPy without vectors": {"NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4"},
    "both": {"OPENBLAS_CORETYPE": "Nehalem",
             "NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4"},
}  # fmt: skip
OTHERWISE = "computes otherwise than the process that began the campaign"


def attempt_processors(shared: Specimen, chance: Chance, place: Path) -> Verdict:
    """Go on with a campaign on a stand-in of another machine."""
    kind = chance.choice(list(PROCESSORS))
    return Verdict(kind, _unlike(shared, place, PROCESSORS[kind], chance))


def attempt_libraries(shared: Specimen, chance: Chance, place: Path) -> Verdict:
    """Go on with a campaign that other libraries began, by what its plan says."""
    from hpcwhirl.store.directory.manifest import PlanFile

    name = chance.choice(["numpy", "scipy", "numba", "llvmlite", "BLAS", "C library"])
    out = _half(shared, place / "out")
    plan = PlanFile(out)
    old = plan.read()
    plan.write(replace(old, machines=[old.machines[0] | {name: "0.1 of long ago"}]))
    return Verdict(name, _unlike(shared, place, {}, chance))


def _unlike(shared: Specimen, place: Path, env: dict[str, str], chance: Chance) -> str:
    """Return what is wrong with going on: it must be told once, or be refused."""
    out = place / "out"
    if not out.exists():
        _half(shared, out)
    strict = chance.random() < 0.5
    more = ["--same", "strict"] if strict else []
    ended = start([*PROGRAM, *_calls(shared, out), *more], place, env).wait(4)
    lines = [line for line in ended.err.splitlines() if OTHERWISE in line]
    wrong = fault(ended, (2,) if strict else (0,))
    if not wrong and len(lines) != 1:
        wrong = f"told in {len(lines)} lines"
    return wrong or _mixed(out, kinds=2 if not strict else 0)


def _mixed(out: Path, *, kinds: int) -> str:
    """Return whether results.h5 does not list so many kinds of machines; 0: no file."""
    path = out / "results.h5"
    if not kinds or not path.exists():
        return "refused, but results were written" if path.exists() else ""
    with h5py.File(path, "r") as file:
        found = bytes(file.attrs["machines"]).count(b"\n") + 1
    return "" if found == kinds else f"results.h5 lists {found} kinds of machines"


# Formulas that a spreadsheet executes

FORMULAS = ("=cmd|' /C calc'!A0", "+1+1", "-1-1", "@SUM(1+1)", "=1", "\t=1", "\r=1",
            "=HYPERLINK(1)", "-x", "+", "=", "@", "- 1", "=\"a\",=b")  # fmt: skip


def attempt_formulas(shared: Specimen, chance: Chance, place: Path) -> Verdict:
    """Have texts of results be formulas, then ask for tables."""
    out = place / "out"
    shutil.copytree(shared.out, out)
    with h5py.File(out / "results.h5", "r+") as file:
        count = len(file["message"])
        texts = chance.choices(FORMULAS, k=count)
        file["message"][:] = np.array([text.encode() for text in texts])
    ended = run(["cases", out, "--csv", "--columns", "message,growth_rate"], place)
    return Verdict("cases --csv", first((fault(ended, (0,)), *_formulas(ended.out))))


def _formulas(text: str) -> Iterator[str]:
    """Yield cells that begin as a formula does, and are no number."""
    for row in csv.reader(io.StringIO(text)):
        for cell in row:
            try:
                float(cell)
            except ValueError:
                if cell[:1] in tuple("=+-@\t\r"):
                    yield f"a cell is {cell!r}"


FAMILIES = {
    "links": Family("links planted in a campaign's directory", 200, warm,
                    attempt_links),
    "rounding": Family("functions that change the floating-point environment", 100,
                       warm, attempt_rounding),
    "caches": Family("damaged and planted compiled code", 60, prepare_caches,
                     attempt_caches),
    "styles": Family("a file of Matplotlib's settings", 60, prepare_styles,
                     attempt_styles),
    "processors": Family("another kind of processor, by stand-ins", 30, warm,
                         attempt_processors),
    "libraries": Family("libraries changed between runs", 30, warm, attempt_libraries),
    "formulas": Family("formulas in tables for spreadsheets", 200, warm,
                       attempt_formulas),
}  # fmt: skip
