"""Unfriendly ground: another user, clocks, homes, caches, streams and directories."""

from __future__ import annotations

import os
import shlex
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path

from attacks.family import Chance, Family, Verdict, fault
from attacks.process import PROGRAM, Ended, Words, start
from attacks.room import mounted, remounted, stops
from attacks.specimens import PLAIN, Specimen, differs, undisturbed

NOBODY = ("setpriv", "--reuid=65534", "--regid=65534", "--clear-groups")
NOWHERE = "/proc/nowhere"  # not even root can make it
HOMELESS = {"HOME": NOWHERE}
STREAMS = (
    ">&-", "2>&-", ">&- 2>&-", "<&- >&- 2>&-", ">/dev/full", "2>/dev/full",
    ">/dev/full 2>/dev/full", "| head -c 1",
)  # fmt: skip
CACHES = ("XDG_CACHE_HOME", "XDG_CONFIG_HOME", "NUMBA_CACHE_DIR", "MPLCONFIGDIR")
Check = Callable[[Specimen, Path], Iterable[str]]  # yields faults; "" where none is


class SkipError(Exception):
    """Why something cannot be tried here."""


def prepare(place: Path) -> Specimen:
    """Compute a campaign undisturbed; everyone may look at it."""
    specimen = undisturbed(replace(PLAIN, speeds=3), place)
    for folder in (place, place.parent):  # the latter is a temporary one of its own
        folder.chmod(0o755)
    return specimen


def _need(*tools: str, root: bool = False) -> None:
    for tool in tools:
        if shutil.which(tool) is None:
            msg = f"no {tool} here"
            raise SkipError(msg)
    if root and os.getuid():
        msg = "only root can become another user or mount"
        raise SkipError(msg)


def _program(
    words: Words,
    place: Path,
    front: Words = (),
    env: Mapping[str, str] | None = None,
    ranks: int = 0,
) -> Ended:
    return start([*front, *PROGRAM, *words], place, env, ranks).wait(4)


def _calls(shared: Specimen, out: Path) -> Words:
    return ["campaign", shared.file, "--out", out, "--retry", "failed"]


def _copy(shared: Specimen, out: Path, share: float = 0.5) -> Path:
    """Return a copy of the campaign that some of its cases are missing from."""
    shutil.rmtree(out, ignore_errors=True)
    shutil.copytree(shared.out, out)
    (out / "results.h5").unlink()
    (log,) = (out / "journal").glob("*.log")
    os.truncate(log, int(share * log.stat().st_size))
    return out


def _true(ended: Ended, out: Path, shared: Specimen, place: Path) -> str:
    return fault(ended, (0,)) or differs(out, shared.truth, place)


def _faults(
    calls: Iterable[tuple[Words, tuple[int, ...]]],
    place: Path,
    front: Words = (),
    env: Mapping[str, str] | None = None,
) -> Iterator[str]:
    """Give commands, and yield what is wrong with the end of each."""
    for words, codes in calls:
        wrong = fault(_program(words, place, front, env), codes)
        yield wrong and f"{words[0]}: {wrong}"


def other_user(shared: Specimen, place: Path) -> Iterator[str]:
    """Let nobody read, gather and continue what only root can write."""
    _need("setpriv", root=True)
    out = _copy(shared, place / "out")
    if _program(["--version"], place, NOBODY, HOMELESS).code:
        msg = "another user cannot read the program"
        raise SkipError(msg)
    calls = [["gather", out], ["classify", shared.out], ["map", shared.out],
             _calls(shared, out), _calls(shared, place / "new")]  # fmt: skip
    told = [(["status", out], (0,)), *((words, (2,)) for words in calls)]
    yield from _faults(told, place, NOBODY, HOMELESS)
    yield _true(_program(_calls(shared, out), place), out, shared, place)


def hidden(shared: Specimen, place: Path) -> Iterator[str]:
    """Let nobody look at journals and directories that it cannot read."""
    _need("setpriv", root=True)
    for name in ("journal", "traces", "campaign.json", "."):
        out = _copy(shared, place / "out")
        (out / name).chmod(0)
        looks = (2,) if name == "journal" else (0, 2)  # it says what it cannot read
        told = [(["status", out], looks), (["gather", out], (2,)),
                (_calls(shared, out), (2,))]  # fmt: skip
        yield from _faults(told, place, NOBODY, HOMELESS)
        out.chmod(0o755)


def clocks(shared: Specimen, place: Path) -> Iterator[str]:
    """Continue, and look, with a clock that stands in 1971, far ahead, or is back."""
    _need("faketime")
    for when in ("1971-01-01 00:00:00", "2106-02-07 06:28:15"):
        out = _copy(shared, place / "out")
        told = [
            (["status", out], (0,)),
            (_calls(shared, out), (0,)),
            (["status", out, "--json"], (0,)),
            (["gather", out], (0, 1)),
        ]
        yield from _faults(told, place, ("faketime", "-f", f"@{when}"))
        yield differs(out, shared.truth, place)
    out, back = _copy(shared, place / "out"), ("faketime", "-f", "-400d")
    ended = start([*back, *PROGRAM, *_calls(shared, out)], place, ranks=2).wait(4)
    yield _true(ended, out, shared, place)


def no_home(shared: Specimen, place: Path) -> Iterator[str]:
    """Compute with a home, or a cache of compiled code, that cannot be written."""
    for name in CACHES:
        os.environ.pop(name, None)
    (place / "file").write_text("a file")
    for number, cache in enumerate(("", f"{NOWHERE}/numba", str(place / "file"))):
        out, env = place / f"out-{number}", {"NUMBA_CACHE_DIR": cache}
        ended = _program(_calls(shared, out), place, (), env if cache else HOMELESS)
        yield _true(ended, out, shared, place)


def full_disk_of_ranks(shared: Specimen, place: Path) -> Iterator[str]:
    """Let two ranks meet a full disk; with room, the same command completes."""
    _need(root=True)
    for size in (8, 24, 40, 64, 96, 128):
        disk = place / f"disk-{size}"
        with mounted(disk, size << 10) as there:
            if not there:
                msg = "no tmpfs can be mounted here"
                raise SkipError(msg)
            words = _calls(shared, disk / "out")
            yield stops(_program(words, place, ranks=2))
            remounted(disk, "size=128M")
            ended = _program(words, place, ranks=2)
            yield _true(ended, disk / "out", shared, place)


def read_only(shared: Specimen, place: Path) -> Iterator[str]:
    """Ask, gather and continue on a file system that is read-only."""
    _need(root=True)
    with mounted(place / "disk", 1 << 24) as there:
        out = place / "disk" / "out"
        shutil.copytree(shared.out, out)
        if not (there and remounted(place / "disk", "ro")):
            msg = "no file system can be made read-only here"
            raise SkipError(msg)
        calls = (["gather", out], ["classify", out], _calls(shared, out), ["map", out])
        # 75: it may be mounted again
        told = [(["status", out], (0,)), *((words, (2, 75)) for words in calls)]
        yield from _faults(told, place)


def no_directory(shared: Specimen, place: Path) -> Iterator[str]:
    """Begin in a working directory that has been removed."""
    gone = place / "gone"
    for words, codes in ((["campaign", shared.file, "--out", "o"], (2,)),
                         (["status", shared.out], (0, 2)), (["status", "out"], (2,)),
                         (["run", "--set", "duration=1e-4", "--out", "x.h5"], (2,)),
                         (["model"], (0, 2)), (["job", "slurm", shared.file], (0, 2)),
                         (["campaign", "--dry-run", shared.file], (0, 2))):  # fmt: skip
        gone.mkdir()
        call = f"cd '{gone}' && rmdir '{gone}' && exec {_quoted(words)}"
        wrong = fault(start(["bash", "-c", call], place).wait(), codes)
        yield wrong and f"{words[0]}: {wrong}"


def streams(shared: Specimen, place: Path) -> Iterator[str]:
    """Close standard streams, or let them be full."""
    calls = (["status", shared.out], ["status", shared.out, "--json"], ["model"],
             ["campaign", shared.file, "--dry-run"], ["gather", shared.out], ["--help"],
             ["classify", shared.out], ["model", "--set", "nonsense=1"], ["doctor"],
             ["campaign", shared.file, "--out", place / "out"])  # fmt: skip
    for words in calls:
        for ends in STREAMS:
            call = ["bash", "-c", f"{_quoted(words)} {ends}"]
            wrong = fault(start(call, place).wait(), (0, 1, 2, 75))
            yield wrong and f"{words[0]} {ends}: {wrong}"


def _quoted(words: Words) -> str:
    return shlex.join(map(str, (*PROGRAM, *words)))


CHECKS: tuple[Check, ...] = (
    other_user, hidden, clocks, no_directory, read_only, streams, full_disk_of_ranks,
    no_home,
)  # fmt: skip


def attempt(shared: Specimen, chance: Chance, place: Path) -> Verdict:
    """Make the check whose turn it is."""
    check = CHECKS[chance.number % len(CHECKS)]
    name = check.__name__.replace("_", " ")
    place.chmod(0o755)
    try:
        return Verdict(name, next(filter(None, check(shared, place)), ""))
    except SkipError as skip:
        return Verdict(name, skipped=f"{name}: {skip}")


FAMILIES = {
    "ground": Family("another user, clocks, homes, caches, streams", len(CHECKS),
                     prepare, attempt),
}  # fmt: skip
