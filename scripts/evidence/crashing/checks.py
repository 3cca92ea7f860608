"""A command recorded, and given again on what a crash has left."""

from __future__ import annotations

import hashlib
import json
import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from crashing import wire
from crashing.disk import PROCESS, Crash, Disk, Outlines, crashes, state
from crashing.kinds import Kind, command
from crashing.trace import Call, calls_of, watch

FACTS = frozenset({"command", "created", "gather", "git", "hosts", "mpi", "ranks"})
STALE = 0.5  # s instead of 120: an empty claim is dead after that
RECORDING = 2  # ranks that make a record, where as many may


def prepare(chosen: Iterable[Kind], place: Path) -> None:
    """Let this process have all imported and compiled that its forks will need."""
    from contextlib import redirect_stderr, redirect_stdout

    from hpcwhirl.campaign import finalize
    from hpcwhirl.launch import ALONE
    from hpcwhirl.store import atomic
    from hpcwhirl.store.directory import journal, owner

    journal.EVERY = 0.0  # each case is a group of its own: more calls, more points
    owner.STALE, owner.PULSE = STALE, 0.1 * STALE
    atomic.YOUNG = 0.0  # a part that a crash left is not of a living writer
    finalize._git_state = lambda: ""
    for number, kind in enumerate(chosen):
        own = place / f"warm-{number}"
        (own / "w").mkdir(parents=True)
        with (
            (own / "told").open("w") as told,
            redirect_stdout(told),
            redirect_stderr(told),
        ):
            for before in (*range(len(kind.before)), None):
                act(kind, kind.call(own, before))(ALONE)
        shutil.rmtree(own)


def act(kind: Kind, words: list[str]) -> Any:
    """Return what a rank does to give a command."""

    def action(comm: Any) -> int:
        from hpcwhirl import launch
        from hpcwhirl.cli import campaign as cli
        from hpcwhirl.dynamics import march
        from hpcwhirl.report import render_process
        from hpcwhirl.report.map import maps

        own = comm if comm.size > 1 else launch.ALONE
        cli.communicator = launch.communicator = lambda: own
        if kind.slices:
            march.FIRST_SLICE, march._slices = kind.slices, {}
            march.next_slice = lambda *_: kind.slices
        if not kind.made:  # half a second each, and not what is looked at
            render_process.draw_in_process = maps.draw_map = lambda *_, **__: []
        return command(words, own)()

    return action


@dataclass
class Record:
    """A command recorded.

    Attributes
    ----------
    before : what its directory held before
    calls : that it made
    truth : what its results hold, and the pictures' names
    beyond : what they hold by the plan of who takes over
    """

    kind: Kind
    place: Path
    before: Disk
    calls: list[Call]
    truth: dict[str, str]
    beyond: dict[str, str] = field(default_factory=dict)


class BrokenError(Exception):
    """An undisturbed command did not do what it should."""


def record(kind: Kind, place: Path) -> Record:
    """Give a command undisturbed, and note what it does."""
    (place / "w").mkdir(parents=True)
    for number in range(len(kind.before)):
        _give(kind, kind.call(place, number), place, 1)
    before, log = Disk.of(place / "w"), place / "calls.log"
    words, action = kind.call(place), None
    plain = act(kind, words)

    def action(comm: Any) -> int:  # noqa: F811
        watch(place / "w", log)
        return plain(comm)

    _well(wire.start(min(RECORDING, kind.ranks), action, place / "told"), kind.name)
    calls = calls_of(log)
    after = Disk.of(place / "w")
    made = state(before, calls, Crash(len(calls), PROCESS))
    if _plain(made) != _plain(after):
        msg = f"{kind.name}: the calls recorded do not make the directory"
        raise BrokenError(msg)
    wrong = left_over(place / "w" / "out")
    if wrong:
        raise BrokenError(f"{kind.name} undisturbed leaves {wrong}")
    found = Record(kind, place, before, calls, contents(kind, place / "w" / "out"))
    if kind.beyond:
        longer = replace(kind, text=kind.beyond)
        _give(longer, longer.call(place), place, 1)
        found.beyond = contents(longer, place / "w" / "out")
    return found


def going_beyond(found: Record) -> Record:
    """Return the record with the plan and the truth of who takes over."""
    if not found.kind.beyond:
        return found
    kind = replace(found.kind, text=found.kind.beyond)
    return replace(found, kind=kind, truth=found.beyond)


def _plain(disk: Disk) -> Any:
    folders, files = disk.reachable()
    return folders, {name: bytes(file.data) for name, file in files.items()}


def _give(kind: Kind, words: list[str], place: Path, size: int) -> None:
    _well(wire.start(size, act(kind, words), place / "told"), " ".join(words))


def _well(ranks: wire.Ranks, what: str) -> None:
    wrong = ranks.wrong()
    if wrong:
        raise BrokenError(f"{what} undisturbed {wrong}")


def contents(kind: Kind, out: Path) -> dict[str, str]:
    """Return {name: digest of type, shape, bytes and attributes} of all results."""
    import h5py

    found: dict[str, str] = {name: "made" for name in kind.made if _made(out / name)}

    def look(name: str, item: Any) -> None:
        if name.partition("/")[0] == "performance":
            return
        told = hashlib.sha256(repr(_attributes(item)).encode())
        if isinstance(item, h5py.Dataset):
            told.update(f"{item.dtype} {item.shape}".encode())
            told.update(item[()].tobytes())
        found[name] = told.hexdigest()

    with h5py.File(out / "results.h5", "r") as file:
        look("", file)
        file.visititems(look)
    return found


def _made(path: Path) -> bool:
    return path.exists() and path.stat().st_size > 100


def _attributes(item: Any) -> list[tuple[str, str]]:
    skipped = ("REFERENCE_LIST", "DIMENSION_LIST")  # of addresses
    return [(name, repr(value)) for name, value in sorted(item.attrs.items())
            if name not in FACTS and name not in skipped]  # fmt: skip


def left_over(out: Path) -> str:
    """Return what a complete campaign should not have in its directory."""
    from hpcwhirl.scene.words import is_open
    from hpcwhirl.store.directory.journal import Journals

    found = [str(p.relative_to(out)) for p in out.rglob("*.part*")]
    found += [f"owners/{p.name}" for p in (out / "owners").glob("*")]
    found += [f"running/{p.name}" for p in (out / "running").glob("*")]
    ended = Journals(out).records()
    going = {record["digest"]: is_open(record.get("row", {})) for record in ended}
    kept = {path.stem for path in (out / "states").glob("*")}
    found += [f"states/{n}" for n in sorted(kept) if not going.get(n)]
    found += [str(p.name) for p in out.parent.glob(".hpcwhirl-*")]
    return ", ".join(found[:3])


def points(calls: list[Call]) -> Iterable[int]:
    """Return the numbers of calls before which, and the end after which, to die."""
    return range(len(calls) + 1)


def states(found: Record) -> dict[Any, tuple[Crash, int]]:
    """Return {outline: (a crash that leads to it, how many do)} of all crashes."""
    out: dict[Any, tuple[Crash, int]] = {}
    for at in points(found.calls):
        outlines = Outlines(found.before, found.calls, at)
        for crash in crashes(found.calls, at):
            name = outlines.of(crash)
            first, count = out.get(name, (crash, 0))
            out[name] = first, count + 1
    return out


def wrong_after(found: Record, crash: Crash, size: int) -> str:
    """Return what goes wrong where a command is given again after a crash; "" nothing.

    size : ranks that give it
    """
    make(found, crash)
    return wrong_again(found, size)


def make(found: Record, crash: Crash) -> None:
    """Put the directory as a crash leaves it."""
    world = found.place / "w"
    shutil.rmtree(world, ignore_errors=True)
    world.mkdir()
    state(found.before, found.calls, crash).write(world)


def wrong_under_mpirun(found: Record, crash: Crash, size: int) -> str:
    """Return what goes wrong where mpirun's ranks go on after a crash; "" nothing."""
    make(found, crash)
    front = shlex.split(os.environ.get("HPCWHIRL_MPIRUN", "mpirun"))
    call = [*front, "-n", str(size), sys.executable, "-m", "hpcwhirl"]
    env = {n: v for n, v in os.environ.items() if n != "LD_PRELOAD"}

    def plain(comm: Any) -> int:
        del comm
        words = [*call, *found.kind.call(found.place)]
        return subprocess.run(words, env=env, check=False).returncode

    return _judged_after(found, 1, plain)


def wrong_again(found: Record, size: int, *more: str) -> str:
    """Return what goes wrong where a command is given on what there is; "" nothing.

    size : ranks that give it
    more : words of the command beside
    """
    kind = found.kind
    plain = act(kind, [*kind.call(found.place), *more])
    return _judged_after(found, min(size, kind.ranks), plain)


def _judged_after(found: Record, size: int, plain: Callable[[Any], int]) -> str:
    place, answer = found.place, found.place / "answer.json"
    answer.unlink(missing_ok=True)

    def action(comm: Any) -> int:
        kept = _rows(place / "w" / "out")
        code = plain(comm)
        if comm.rank == 0 and not code:
            answer.write_text(json.dumps(_judged(found, kept)))
        return code

    wrong = wire.start(size, action, place / "again").wrong()
    return wrong or str(json.loads(answer.read_text()))


def differs(found: Record) -> str:
    """Return in what results differ from the undisturbed ones, read by a fork."""
    answer = found.place / "differs.json"
    answer.unlink(missing_ok=True)

    def action(comm: Any) -> int:
        del comm
        answer.write_text(json.dumps(_differs(found)))
        return 0

    wrong = wire.start(1, action, found.place / "told").wrong()
    if wrong:
        return f"leaves results that cannot be read: {wrong}"
    return str(json.loads(answer.read_text()))


def _rows(out: Path) -> set[tuple[str, ...]]:
    """Return the cases of a directory that have ended, and how."""
    from hpcwhirl.errors import WhirlError
    from hpcwhirl.store.directory.journal import Journals

    try:
        found = Journals(out).by_file().items()
        return {(str(r["digest"]), str(r["status"]), name)
                for name, rows in found for r in rows}  # fmt: skip
    except WhirlError:
        return set()


def _judged(found: Record, kept: set[Any]) -> str:
    """Return what is wrong with a directory once a command has ended well."""
    out = found.place / "w" / "out"
    wrong = left_over(out)
    if wrong:
        return f"left over: {wrong}"
    wrong = _differs(found)
    if wrong:
        return wrong
    known = {name for name, status, _ in kept if status == "ok"}
    again = [row for row in _rows(out) - kept if row[0] in known]
    if again and "fresh" not in found.kind.name:
        return f"{len(again)} finished cases were computed again"
    return ""


def _differs(found: Record) -> str:
    now = contents(found.kind, found.place / "w" / "out")
    differ = sorted(n for n in now.keys() | found.truth.keys()
                    if now.get(n) != found.truth.get(n))  # fmt: skip
    return f"results differ in {', '.join(differ[:4])}" if differ else ""


def described(found: Record, crash: Crash) -> str:
    """Return a crash in words."""
    told = f"{crash.how} dies before call {crash.at} of {len(found.calls)}"
    if crash.at < len(found.calls):
        call = found.calls[crash.at]
        told += f" ({call.kind} {call.path}{', in its midst' if crash.torn else ''})"
    if crash.keep != "whole":
        told += f", {crash.keep} kept of what was not synced"
    lost = [found.calls[n] for n in sorted(crash.lost)]
    if lost:
        told += f", lost {', '.join(f'{c.kind} {c.path}' for c in lost[:3])}"
    return told


def room() -> str | None:
    """Return where directories are made: in memory, where there is such a place."""
    place = Path("/dev/shm")
    return str(place) if os.access(place, os.W_OK) else None
