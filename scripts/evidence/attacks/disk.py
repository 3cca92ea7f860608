"""A disk that is full at any byte: on a small tmpfs, or by a limit of file size.

The campaign stops with 75 and says why; with more room the same command completes it.
"""

from __future__ import annotations

import random
import resource
import subprocess
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from attacks import specimens
from attacks.apart import Ended, command, fork, run
from attacks.family import Verdict, fault
from attacks.kills import begin
from attacks.specimens import Mode, Specimen, differs, pick, undisturbed

MODES = {
    replace(specimens.PLAIN, speeds=4): 4,
    replace(specimens.SHARDS, shards=1, name="full traces", speeds=4): 4,
    replace(specimens.STATES, speeds=3): 3,
    replace(specimens.RANKS, duration=4e-3, traces="full", speeds=4): 1,
}
SPACE = ("No space left", "File too large", "MB free", "Disk quota")


@dataclass(frozen=True)
class Disk:
    """Campaigns and the bytes that their directories take."""

    specimens: dict[str, Specimen]
    sizes: dict[str, int]
    mounts: bool


def prepare(place: Path) -> Disk:
    """Compute campaigns with their maps, and see whether a tmpfs can be mounted."""
    found, sizes = {}, {}
    for mode in MODES:
        specimen = undisturbed(mode, place / mode.name.replace(" ", "-"), maps=True)
        found[mode.name] = specimen
        files = [p for p in specimen.out.rglob("*") if p.is_file()]
        sizes[mode.name] = sum(p.stat().st_size + 4096 for p in files)
    probe = place / "probe"
    probe.mkdir()
    mounts = mounted(probe, 1 << 20)
    unmounted(probe)
    return Disk(found, sizes, mounts)


def mounted(place: Path, size: int, *, again: bool = False) -> bool:
    """Mount a tmpfs of some bytes, or give one more room."""
    options = f"{'remount,' if again else ''}size={size}"
    call = ["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(place)]
    try:
        return subprocess.run(call, capture_output=True, check=False).returncode == 0
    except OSError:
        return False


def unmounted(place: Path) -> None:
    """Take a file system away again, whoever may still use it."""
    with suppress(OSError):
        subprocess.run(["umount", "-l", str(place)], capture_output=True, check=False)


def attempt(shared: Disk, chance: random.Random, place: Path) -> Verdict:
    """Fill the disk at a random byte of a campaign, then make room."""
    mode = pick(chance, MODES)
    specimen, size = shared.specimens[mode.name], shared.sizes[mode.name]
    room = int(size * chance.choice([0.1, 0.5, 1.2]) * chance.random()) + 4096
    if shared.mounts:
        return _on_tmpfs(mode, specimen, room, chance, place)
    if mode.ranks:
        return Verdict(mode.name, skipped="no tmpfs can be mounted here")
    return _by_limit(mode, specimen, room, place)


def _on_tmpfs(
    mode: Mode, specimen: Specimen, room: int, chance: random.Random, place: Path
) -> Verdict:
    disk = place / "disk"
    disk.mkdir()
    mounted(disk, max(room // 4096, 2) * 4096)
    try:
        (words,) = mode.calls(specimen.file, disk / "out")
        wrong = stops(begin(words, mode, place).wait(2))
        if not wrong and chance.random() < 0.3:
            wrong = _commands(disk / "out", place)
        mounted(disk, 1 << 28, again=True)
        ended = begin([*words, "--retry", "failed"], mode, place).wait(2)
        wrong = wrong or fault(ended, (0,)) or _whole(disk / "out", specimen, place)
    finally:
        unmounted(disk)
    return Verdict(f"tmpfs, {mode.name}", wrong)


def _by_limit(mode: Mode, specimen: Specimen, room: int, place: Path) -> Verdict:
    (words,) = mode.calls(specimen.file, place / "out")
    limit = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (room, room))  # noqa: E731
    wrong = stops(fork(command(words), place, setup=limit).wait())
    ended = run([*words, "--retry", "failed"], place)
    wrong = wrong or fault(ended, (0,)) or _whole(place / "out", specimen, place)
    return Verdict(f"file size, {mode.name}", wrong)


def stops(ended: Ended) -> str:
    """Return what is wrong with an end on a full disk: 75, and it says why."""
    wrong = fault(ended, (0, 75))
    if not wrong and ended.code and not any(w in ended.err for w in SPACE):
        wrong = f"75, but not why: {ended.last}"
    return wrong


def _commands(out: Path, place: Path) -> str:
    """Return what is wrong with other commands on the full disk."""
    for name in ("status", "gather", "classify"):
        if out.exists():
            wrong = fault(run([name, out], place), (0, 1, 2, 75))
            if wrong:
                return f"{name}: {wrong}"
    return ""


def _whole(out: Path, specimen: Specimen, place: Path) -> str:
    """Return what a completed campaign lacks."""
    wrong = differs(out, specimen.truth, place)
    maps = [out / "map.png", out / "map.svg"]
    pale = [p.name for p in maps if not p.is_file() or p.stat().st_size < 1000]
    parts = [p.name for p in out.rglob("*.part*")]
    return wrong or next(iter(f"no whole {p}" for p in pale + parts), "")
