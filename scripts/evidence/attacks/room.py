"""No room: a disk that is full at any byte, and errors that only close or fsync tell.

The campaign stops with 75 and says why; with more room the same command completes it.
"""

from __future__ import annotations

import errno
import os
import resource
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path

from attacks import specimens
from attacks.family import Chance, Family, Verdict, fault, first
from attacks.process import Ended, run
from attacks.specimens import Mode, Specimen, undisturbed, whole

MODES = {
    replace(specimens.PLAIN, speeds=4): 4,
    replace(specimens.SHARDS, shards=1, name="full traces", speeds=4): 4,
    replace(specimens.STATES, speeds=3): 3,
    replace(specimens.RANKS, duration=4e-3, traces="full", speeds=4): 1,
}
SPACE = ("No space left", "File too large", "MB free", "Disk quota")


@dataclass(frozen=True)
class Disk:
    """Campaigns by mode, the bytes that each takes, whether a tmpfs can be mounted."""

    specimens: dict[Mode, Specimen]
    sizes: dict[Mode, int]
    mounts: bool


def prepare(place: Path) -> Disk:
    """Compute campaigns with their maps, and see whether a tmpfs can be mounted."""
    made = {mode: undisturbed(mode, place / mode.name.replace(" ", "-"), maps=True)
            for mode in MODES}  # fmt: skip
    sizes = {mode: sum(p.stat().st_size + 4096 for p in made[mode].out.rglob("*.*"))
             for mode in MODES}  # fmt: skip
    with mounted(place / "probe", 1 << 20) as mounts:
        return Disk(made, sizes, mounts)


@contextmanager
def mounted(place: Path, size: int) -> Iterator[bool]:
    """Have a tmpfs of some bytes at a new directory; give whether there is one."""
    place.mkdir()
    try:
        yield _mount("-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(place))
    finally:  # whoever may still use it
        with suppress(OSError):
            subprocess.run(["umount", "-l", place], capture_output=True, check=False)


def _mount(*words: str) -> bool:
    try:
        call = ["mount", *words]
        return subprocess.run(call, capture_output=True, check=False).returncode == 0
    except OSError:
        return False


def remounted(place: Path, options: str) -> bool:
    """Mount a tmpfs with other options, e.g. with more room."""
    return _mount("-o", f"remount,{options}", str(place))


def attempt_disk(shared: Disk, chance: Chance, place: Path) -> Verdict:
    """Fill the disk at a random byte of a campaign, then make room."""
    mode = chance.weighted(MODES)
    specimen, size = shared.specimens[mode], shared.sizes[mode]
    room = int(size * chance.choice([0.1, 0.5, 1.2]) * chance.random()) + 8192
    if shared.mounts:
        disk = place / "disk"
        with mounted(disk, room // 4096 * 4096):
            (words,) = specimen.calls(disk / "out")
            wrong = stops(mode.begin(words, place).wait(2))
            if chance.random() < 0.3 and (disk / "out").exists():
                wrong = wrong or _others(disk / "out", place)
            remounted(disk, f"size={1 << 28}")
            ended = mode.begin([*words, "--retry", "failed"], place).wait(2)
            wrong = wrong or fault(ended, (0,)) or whole(disk / "out", specimen, place)
        return Verdict(f"tmpfs, {mode.name}", wrong)
    if mode.ranks:
        return Verdict(mode.name, skipped="no tmpfs can be mounted here")
    (words,) = specimen.calls(place / "out")

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (room, room))

    wrong = stops(run(words, place, limit))
    ended = run([*words, "--retry", "failed"], place)
    wrong = wrong or fault(ended, (0,)) or whole(place / "out", specimen, place)
    return Verdict(f"file size, {mode.name}", wrong)


def stops(ended: Ended) -> str:
    """Return what is wrong with an end on a full disk: 75, and it says why."""
    untold = ended.code and not any(text in ended.err for text in SPACE)
    return fault(ended, (0, 75)) or (f"75, but not why: {ended.last}" * bool(untold))


def _others(out: Path, place: Path) -> str:
    """Return what is wrong with other commands on the full disk."""
    ends = {name: run([name, out], place) for name in ("status", "gather", "classify")}
    return first(fault(ended, (0, 1, 2, 75)) for ended in ends.values())


# Errors told late

NUMBERS = (errno.ENOSPC, errno.EDQUOT, errno.EROFS)
ALL = "/"  # all files of the directory
NEEDED = ("/campaign.json", "/journal/0001", "/traces/0001", "/results.h5", "/map.png",
          "/map.svg", "/report.html")  # fmt: skip
SPARED = ("/owners/", "/running/", "/runs/0001.json", "/runs/results.stamp", "/states/")
OTHERS = {  # {words of a command on a finished campaign: part of what it writes}
    "map {out}": "/map.svg", "map {out} --csv": "/map.csv", "report {out}": "/report.",
    "classify {out}": "/results.h5", "gather {out}": "/results.h5",
    "figures {out} --kind orbit --out {out}/f": "/f/orbit",
    "run {file} --set speed=300 --set friction=0 --out {out}/o.h5": "/out/",
    "export-model {out}/e.h5 {file}": "/e.h5",
    "job slurm {file} --script {out}/j.sh": "/j.sh",
}  # fmt: skip


def prepare_late(place: Path) -> Specimen:
    """Compute a campaign with all that it writes."""
    return undisturbed(replace(specimens.SHARDS, shards=1, speeds=2), place, maps=True)


def attempt_late(shared: Specimen, chance: Chance, place: Path) -> Verdict:
    """Let close or fsync of some files fail, then give the same command again.

    The shim is in this process, and does nothing before the environment of a fork tells
    it to.
    """
    out, (words,) = place / "out", shared.calls(place / "out")
    other = chance.choice([None, *OTHERS]) if chance.random() < 0.5 else None
    part = OTHERS.get(other or "") or chance.choice([*NEEDED, *SPARED, ALL])
    if other:
        shutil.copytree(shared.out, out)
        words = other.format(out=out, file=shared.file).split()
    call, number = chance.choice(["close", "fsync"]), chance.choice(NUMBERS)
    seen = place / "seen"
    env = {"LATE_CALL": call, "LATE_NAME": part if part != ALL else f"{out}/",
           "LATE_ERRNO": str(number), "LATE_SEEN": str(seen)}  # fmt: skip
    ended = run(words, place, lambda: os.environ.update(env))
    wrong, failed = fault(ended, (0, 75)), seen.exists()
    if not wrong and ended.code:
        wrong = _one_line(ended, os.strerror(number))
    elif not wrong and failed and part in NEEDED and not other:
        wrong = f"exit 0, though {call} of {part} failed"
    again = run(words, place)
    wrong = wrong or fault(again, (0,)) or whole(out, shared, place)
    what = f"{call}, {errno.errorcode[number]}" if failed else "no such call came"
    return Verdict(f"{what}: {part}, {words[0]}", wrong)


def _one_line(ended: Ended, why: str) -> str:
    lines = [t for t in ended.err.splitlines() if "stopped" in t or "error" in t]
    right = len(lines) == 1 and why in lines[0]
    return "" if right else f"75, but not in one line that it is {why!r}: {lines}"


FAMILIES = {
    "disk": Family("a full disk", 100, prepare, attempt_disk),
    "late": Family("errors told by close or fsync, as file servers do", 200,
                   prepare_late, attempt_late,
                   shim=Path(__file__).with_name("late.c")),
}  # fmt: skip
