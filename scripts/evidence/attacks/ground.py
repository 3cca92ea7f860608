"""Unfriendly ground: a full disk, another user, clocks, a file system to read only."""

from __future__ import annotations

import os
import resource
import shlex
import shutil
import subprocess
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path

from attacks import specimens
from attacks.family import Chance, Family, Verdict, fault, first
from attacks.process import PROGRAM, Ended, Words, run, start
from attacks.specimens import PLAIN, Mode, Specimen, differs, parts, undisturbed

MAPS = ("map.png", "map.svg")
MODES = {
    replace(PLAIN, speeds=4): 4,
    replace(specimens.SHARDS, shards=1, name="full traces", speeds=4): 4,
    replace(specimens.STATES, speeds=3): 3,
    replace(specimens.RANKS, duration=4e-3, traces="full", speeds=4): 1,
}
SPACE = ("No space left", "File too large", "MB free", "Disk quota")


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
    with suppress(OSError):
        done = subprocess.run(["mount", *words], capture_output=True, check=False)
        return done.returncode == 0
    return False


def remounted(place: Path, options: str) -> bool:
    """Mount a tmpfs with other options, e.g. with more room."""
    return _mount("-o", f"remount,{options}", str(place))


# A full disk: the campaign stops with 75 and says why; with more room the same command
# completes it.


@dataclass(frozen=True)
class Disk:
    """Campaigns by mode, the bytes that each takes, whether a tmpfs can be mounted."""

    specimens: dict[Mode, Specimen]
    sizes: dict[Mode, int]
    mounts: bool


def prepare_disk(place: Path) -> Disk:
    """Compute campaigns with their maps, and see whether a tmpfs can be mounted."""
    made = {mode: undisturbed(mode, place / mode.name.replace(" ", "-"), maps=True)
            for mode in MODES}  # fmt: skip
    sizes = {mode: sum(p.stat().st_size + 4096 for p in made[mode].out.rglob("*.*"))
             for mode in MODES}  # fmt: skip
    with mounted(place / "probe", 1 << 20) as mounts:
        return Disk(made, sizes, mounts)


def attempt_disk(shared: Disk, chance: Chance, place: Path) -> Verdict:
    """Fill the disk at a random byte of a campaign, then make room."""
    mode = chance.weighted(MODES)
    specimen, size = shared.specimens[mode], shared.sizes[mode]
    room = int(size * chance.choice([0.1, 0.5, 1.2]) * chance.random()) + 8192
    disk = place / "disk"
    (words,) = specimen.calls(disk / "out")
    if shared.mounts:
        with mounted(disk, room // 4096 * 4096):
            wrong = _stops(mode.begin(words, place).wait(2))
            if chance.random() < 0.3 and (disk / "out").exists():
                ends = (run([name, disk / "out"], place)
                        for name in ("status", "gather", "classify"))  # fmt: skip
                wrong = wrong or first(fault(ended, (0, 1, 2, 75)) for ended in ends)
            remounted(disk, f"size={1 << 28}")
            ended = mode.begin([*words, "--retry", "failed"], place).wait(2)
            wrong = wrong or _whole(ended, disk / "out", specimen, place)
        return Verdict(f"tmpfs, {mode.name}", wrong)
    if mode.ranks:
        return Verdict(mode.name, skipped="no tmpfs can be mounted here")
    disk.mkdir()

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (room, room))

    wrong = _stops(run(words, place, limit))
    ended = run([*words, "--retry", "failed"], place)
    wrong = wrong or _whole(ended, disk / "out", specimen, place)
    return Verdict(f"file size, {mode.name}", wrong)


def _stops(ended: Ended) -> str:
    """Return what is wrong with an end on a full disk: 75, and it says why."""
    untold = ended.code and not any(text in ended.err for text in SPACE)
    return fault(ended, (0, 75)) or (f"75, but not why: {ended.last}" * bool(untold))


def _whole(ended: Ended, out: Path, specimen: Specimen, place: Path) -> str:
    """Return what a campaign lacks that should be complete, its maps included."""
    wrong = fault(ended, (0,)) or differs(out, specimen.truth, place)
    maps = [out / name for name in MAPS]
    pale = [p.name for p in maps if not p.is_file() or p.stat().st_size < 1000]
    return wrong or (f"no whole {pale[0]}" if pale else "") or parts(out)


# Other ground: each check yields faults, "" where there is none

NOBODY = ("setpriv", "--reuid=65534", "--regid=65534", "--clear-groups")
HOMELESS = {"HOME": "/proc/nowhere"}  # not even root can make it
CACHES = ("XDG_CACHE_HOME", "XDG_CONFIG_HOME", "NUMBA_CACHE_DIR", "MPLCONFIGDIR")
STREAMS = (
    ">&-", "2>&-", ">&- 2>&-", "<&- >&- 2>&-", ">/dev/full", "2>/dev/full",
    ">/dev/full 2>/dev/full", "| head -c 1",
)  # fmt: skip
Check = Callable[[Specimen, Path], Iterable[str]]
Calls = Iterable[tuple[Words, tuple[int, ...]]]


class SkipError(Exception):
    """Why something cannot be tried here."""


def prepare(place: Path) -> Specimen:
    """Compute a campaign undisturbed; everyone may look at it."""
    specimen = undisturbed(replace(PLAIN, speeds=3), place)
    for folder in (place, place.parent):  # the latter is a temporary one of its own
        folder.chmod(0o755)
    return specimen


def _need(tool: str, *, root: bool = False) -> None:
    if shutil.which(tool) is None:
        raise SkipError(f"no {tool} here")
    if root and os.getuid():
        raise SkipError("only root can become another user or mount")


def _calls(shared: Specimen, out: Path) -> Words:
    return ["campaign", shared.file, "--out", out, "--retry", "failed"]


def _copy(shared: Specimen, out: Path) -> Path:
    """Return a copy of the campaign that half of its cases are missing from."""
    shutil.rmtree(out, ignore_errors=True)
    shutil.copytree(shared.out, out)
    (out / "results.h5").unlink()
    (log,) = (out / "journal").glob("*.log")
    os.truncate(log, log.stat().st_size // 2)
    return out


def _faults(
    calls: Calls, place: Path, front: Words = (), env: dict[str, str] | None = None
) -> Iterator[str]:
    """Give commands, and yield what is wrong with the end of each."""
    for words, codes in calls:
        wrong = fault(start([*front, *PROGRAM, *words], place, env).wait(4), codes)
        yield wrong and f"{words[0]}: {wrong}"


def other_user(shared: Specimen, place: Path) -> Iterator[str]:
    """Let nobody read, gather and continue what only root can write."""
    _need("setpriv", root=True)
    out = _copy(shared, place / "out")
    if start([*NOBODY, *PROGRAM, "--version"], place, HOMELESS).wait(4).code:
        raise SkipError("another user cannot read the program")
    calls = [["gather", out], ["classify", shared.out], ["map", shared.out],
             _calls(shared, out), _calls(shared, place / "new")]  # fmt: skip
    told = [(["status", out], (0,)), *((words, (2,)) for words in calls)]
    yield from _faults(told, place, NOBODY, HOMELESS)
    yield from _faults([(_calls(shared, out), (0,))], place)
    yield differs(out, shared.truth, place)


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


def no_home(shared: Specimen, place: Path) -> Iterator[str]:
    """Compute with a home, or a cache of compiled code, that cannot be written."""
    for name in CACHES:
        os.environ.pop(name, None)
    (place / "file").write_text("a file")
    cache = f"{HOMELESS['HOME']}/numba", str(place / "file")
    for env in (HOMELESS, *({"NUMBA_CACHE_DIR": path} for path in cache)):
        shutil.rmtree(out := place / "out", ignore_errors=True)
        yield from _faults([(_calls(shared, out), (0,))], place, env=env)
        yield differs(out, shared.truth, place)


def clocks(shared: Specimen, place: Path) -> Iterator[str]:
    """Continue, and look, with a clock that stands in 1971, far ahead, or is back."""
    _need("faketime")
    for when in ("@1971-01-01 00:00:00", "@2106-02-07 06:28:15", "-400d"):
        out = _copy(shared, place / "out")
        calls = (["status", out], _calls(shared, out), ["status", out, "--json"])
        told = [*((words, (0,)) for words in calls), (["gather", out], (0, 1))]
        yield from _faults(told, place, ("faketime", "-f", when))
        yield differs(out, shared.truth, place)


def read_only(shared: Specimen, place: Path) -> Iterator[str]:
    """Ask, gather and continue on a file system that is read-only."""
    _need("mount", root=True)
    with mounted(place / "disk", 1 << 24) as there:
        out = place / "disk" / "out"
        shutil.copytree(shared.out, out)
        if not (there and remounted(place / "disk", "ro")):
            raise SkipError("no file system can be made read-only here")
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
    other_user, hidden, clocks, read_only, no_directory, streams, no_home
)  # fmt: skip


def attempt(shared: Specimen, chance: Chance, place: Path) -> Verdict:
    """Make the check whose turn it is."""
    check = CHECKS[chance.number % len(CHECKS)]
    name = check.__name__.replace("_", " ")
    place.chmod(0o755)
    try:
        return Verdict(name, first(check(shared, place)))
    except SkipError as skip:
        return Verdict(name, skipped=f"{name}: {skip}")


FAMILIES = {
    "disk": Family("a full disk", 100, prepare_disk, attempt_disk),
    "ground": Family("another user, clocks, homes, caches, streams, directories",
                     len(CHECKS), prepare, attempt),
}  # fmt: skip
