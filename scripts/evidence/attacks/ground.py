"""Unfriendly ground: another user, clocks, homes, caches, streams and directories."""

from __future__ import annotations

import os
import random
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from attacks import specimens
from attacks.apart import Ended, start
from attacks.disk import mounted, stops, unmounted
from attacks.family import Verdict, fault
from attacks.kills import mpirun
from attacks.specimens import Specimen, differs, undisturbed

NOBODY = ("setpriv", "--reuid=65534", "--regid=65534", "--clear-groups")
PROGRAM = (sys.executable, "-m", "hpcwhirl")
NOWHERE = "/proc/nowhere"  # not even root can make it
TOLD = (0, 2)
STREAMS = (
    ">&-", "2>&-", ">&- 2>&-", "<&- >&- 2>&-", ">/dev/full", "2>/dev/full",
    ">/dev/full 2>/dev/full", "| head -c 1",
)  # fmt: skip


@dataclass(frozen=True)
class Skip(Exception):  # noqa: N818 - not an error
    """Why something cannot be tried here."""

    why: str


def prepare(place: Path) -> Specimen:
    """Compute a campaign undisturbed; everyone may look at it."""
    specimen = undisturbed(replace(specimens.PLAIN, speeds=3), place)
    folder = place
    while folder != folder.parent and folder.stat().st_uid == os.getuid():
        if folder == Path("/tmp"):
            break
        folder.chmod(folder.stat().st_mode | 0o055)
        folder = folder.parent
    return specimen


def _need(tool: str) -> None:
    if shutil.which(tool) is None:
        raise Skip(f"no {tool} here")


def _root() -> None:
    if os.getuid():
        raise Skip("only root can become another user or mount")


def _program(
    words: list[str | Path],
    place: Path,
    front: tuple[str, ...] = (),
    env: dict[str, str] | None = None,
) -> Ended:
    """Return how the program, begun anew, ends."""
    return start([*front, *PROGRAM, *words], place, env=env).wait(4)


def _calls(shared: Specimen, out: Path) -> list[str | Path]:
    return ["campaign", shared.file, "--out", out]


def _copy(shared: Specimen, place: Path, lines: int = 5) -> Path:
    """Return a copy of the campaign that some of its cases are missing from."""
    out = place / "out"
    shutil.copytree(shared.out, out)
    (out / "results.h5").unlink()
    (log,) = (out / "journal").glob("*.log")
    log.write_bytes(b"".join(log.read_bytes().splitlines(keepends=True)[:lines]))
    return out


def _true(ended: Ended, out: Path, shared: Specimen, place: Path) -> str:
    return fault(ended, (0,)) or differs(out, shared.truth, place)


def other_user(shared: Specimen, place: Path) -> str:
    """Let nobody read, gather and continue what only root can write."""
    _root()
    _need("setpriv")
    place.chmod(0o755)
    place.parent.chmod(0o755)
    out = _copy(shared, place)
    if _program(["--version"], place, NOBODY, {"HOME": NOWHERE}).code:
        raise Skip("another user cannot read the program")
    for words, codes in (
        (["status", out], (0,)),
        (["gather", out], (2,)),
        (["classify", shared.out], (2,)),
        (_calls(shared, out), (2,)),
        (_calls(shared, place / "new"), (2,)),
        (["map", shared.out], (2,)),
    ):
        ended = _program(words, place, NOBODY, {"HOME": NOWHERE})
        wrong = fault(ended, codes)
        if wrong:
            return f"{words[0]}: {wrong}"
    return _true(_program(_calls(shared, out), place), out, shared, place)


def hidden(shared: Specimen, place: Path) -> str:
    """Let nobody look at journals and directories that it cannot read."""
    _root()
    _need("setpriv")
    place.chmod(0o755)
    for name in ("journal", "traces", "campaign.json", "."):
        out = _copy(shared, place)
        (out / name).chmod(0)
        for words, codes in ((["status", out], TOLD), (["gather", out], (2,)),
                             (_calls(shared, out), (2,))):  # fmt: skip
            ended = _program(words, place, NOBODY, {"HOME": NOWHERE})
            wrong = fault(ended, codes)
            if words[0] == "status" and name == "journal" and not ended.code:
                wrong = wrong or "an unreadable journal, and status says nothing of it"
            if wrong:
                return f"{name} unreadable, {words[0]}: {wrong}"
        out.chmod(0o755)
        shutil.rmtree(out)
    return ""


def clock_back(shared: Specimen, place: Path) -> str:
    """Continue, and look, with a clock that stands in 1971, and one far ahead."""
    _need("faketime")
    for when in ("1971-01-01 00:00:00", "2106-02-07 06:28:15"):
        out = _copy(shared, place)
        fake = ("faketime", "-f", f"@{when}")
        for words in (["status", out], _calls(shared, out), ["status", out],
                      ["status", out, "--json"], ["gather", out]):  # fmt: skip
            wrong = fault(
                _program(words, place, fake), (0, *(1,) * (words[0] == "gather"))
            )
            if wrong:
                return f"{when[:4]}, {words[0]}: {wrong}"
        wrong = differs(out, shared.truth, place)
        if wrong:
            return f"{when[:4]}: {wrong}"
        shutil.rmtree(out)
    return ""


def clock_of_ranks(shared: Specimen, place: Path) -> str:
    """Continue under mpirun with a clock set back between two runs."""
    _need("faketime")
    out = _copy(shared, place)
    front = ("faketime", "-f", "-400d", *mpirun(), "-n", "2")
    return _true(_program(_calls(shared, out), place, front), out, shared, place)


def no_home(shared: Specimen, place: Path) -> str:
    """Compute with a home that cannot be written, nor be made."""
    gone = ("XDG_CACHE_HOME", "XDG_CONFIG_HOME", "NUMBA_CACHE_DIR", "MPLCONFIGDIR")
    env = {"HOME": NOWHERE, **dict.fromkeys(gone, "")}
    for name in gone:
        os.environ.pop(name, None)
        env.pop(name)
    out = place / "out"
    return _true(_program(_calls(shared, out), place, (), env), out, shared, place)


def no_cache(shared: Specimen, place: Path) -> str:
    """Compute with a cache of compiled code that cannot be written."""
    out = place / "out"
    env = {"NUMBA_CACHE_DIR": f"{NOWHERE}/numba"}
    return _true(_program(_calls(shared, out), place, (), env), out, shared, place)


def cache_of_another(shared: Specimen, place: Path) -> str:
    """Compute with a cache that is a file, then one on a full disk."""
    file = place / "cache"
    file.write_text("a file")
    out = place / "out"
    env = {"NUMBA_CACHE_DIR": str(file)}
    return _true(_program(_calls(shared, out), place, (), env), out, shared, place)


def full_disk_of_ranks(shared: Specimen, place: Path) -> str:
    """Let two ranks meet a full disk; with room, the same command completes."""
    _root()
    disk = place / "disk"
    disk.mkdir()
    front = (*mpirun(), "-n", "2")
    for size in (8, 24, 40, 64, 96, 128):
        if not mounted(disk, size << 10):
            raise Skip("no tmpfs can be mounted here")
        try:
            words = _calls(shared, disk / "out")
            wrong = stops(_program(words, place, front))
            mounted(disk, 1 << 27, again=True)
            ended = _program([*words, "--retry", "failed"], place, front)
            wrong = wrong or _true(ended, disk / "out", shared, place)
        finally:
            unmounted(disk)
        if wrong:
            return f"{size} kB: {wrong}"
    return ""


def read_only(shared: Specimen, place: Path) -> str:
    """Ask, gather and continue on a file system that is read-only."""
    _root()
    disk = place / "disk"
    disk.mkdir()
    if not mounted(disk, 1 << 24):
        raise Skip("no tmpfs can be mounted here")
    try:
        out = disk / "out"
        shutil.copytree(shared.out, out)
        call = ["mount", "-o", "remount,ro", str(disk)]
        if subprocess.run(call, capture_output=True, check=False).returncode:
            raise Skip("no file system can be made read-only here")
        for words, codes in ((["status", out], (0,)), (["gather", out], (2,)),
                             (["classify", out], (2,)), (_calls(shared, out), (2,)),
                             (["map", out], (2,))):  # fmt: skip
            wrong = fault(_program(words, place), codes)
            if wrong:
                return f"{words[0]}: {wrong}"
    finally:
        unmounted(disk)
    return ""


def no_directory(shared: Specimen, place: Path) -> str:
    """Begin in a working directory that has been removed."""
    gone = place / "gone"
    for words, codes in ((["campaign", shared.file, "--out", "o"], (2,)),
                         (["status", shared.out], TOLD), (["status", "out"], (2,)),
                         (["run", "--set", "duration=1e-4", "--out", "x.h5"], (2,)),
                         (["model"], TOLD), (["job", "slurm", shared.file], TOLD),
                         (["campaign", "--dry-run", shared.file], TOLD)):  # fmt: skip
        gone.mkdir()
        told = " ".join(f"'{word}'" for word in (*PROGRAM, *words))
        call = ["bash", "-c", f"cd '{gone}' && rmdir '{gone}' && exec {told}"]
        wrong = fault(start(call, place).wait(), codes)
        if wrong:
            return f"{words[0]}: {wrong}"
    return ""


def streams(shared: Specimen, place: Path) -> str:
    """Close standard streams, or let them be full."""
    calls = (["status", shared.out], ["status", shared.out, "--json"], ["model"],
             ["campaign", shared.file, "--dry-run"], ["gather", shared.out], ["--help"],
             ["classify", shared.out], ["model", "--set", "nonsense=1"], ["doctor"],
             ["campaign", shared.file, "--out", place / "out"])  # fmt: skip
    for words in calls:
        for ends in STREAMS:
            told = " ".join(f"'{word}'" for word in (*PROGRAM, *words))
            ended = start(["bash", "-c", f"{told} {ends}"], place).wait()
            wrong = fault(ended, (0, 1, 2, 75))
            if wrong:
                return f"{words[0]} {ends}: {wrong}"
    return ""


CHECKS: tuple[Callable[[Specimen, Path], str], ...] = (
    other_user, hidden, clock_back, clock_of_ranks, no_directory, read_only, streams,
    full_disk_of_ranks, no_home, no_cache, cache_of_another,
)  # fmt: skip


def attempt(shared: Specimen, chance: random.Random, place: Path) -> Verdict:
    """Make the check whose turn it is."""
    check = CHECKS[getattr(chance, "number", 0) % len(CHECKS)]
    name = check.__name__.replace("_", " ")
    try:
        return Verdict(name, check(shared, place))
    except Skip as skip:
        return Verdict(name, skipped=f"{name}: {skip.why}")
