"""Ranks that are stopped, slow or dead at an await; a directory lost at each call."""

from __future__ import annotations

import os
import shutil
import signal
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from crashing import checks, isolated, wire
from crashing.checks import Record
from crashing.disk import PART
from crashing.kinds import Kind
from crashing.trace import Call, watch

RANKS, TWO = 3, 2
EACH = 2  # times that a rank comes to an await and is struck there
PAUSE = 0.15  # s of being slow, or stopped
ENDS = (0, 2, 75)  # how one may end that has lost its directory: in one line
OWNED = ("sweep", "longer list", "gather", "refined, twins of speckle")
SHARED = ("sweep", "refined")
CASES = 3  # that an interpreter is asked for: two, and to compile
Facts = dict[str, Any]


@dataclass
class Tally:
    """What became of the awaits of a sort."""

    what: str
    points: int = 0
    wrong: Counter[str] = field(default_factory=Counter)
    first: dict[str, str] = field(default_factory=dict)

    def add(self, where: str, wrong: str) -> None:
        """Count one."""
        self.points += 1
        if wrong:
            name = PART.sub("PART", wrong)
            self.wrong[name] += 1
            self.first.setdefault(name, where)

    def facts(self) -> Facts:
        """Return what there is to tell."""
        lines = [f"{n} times: {w}; first: {self.first[w]}"
                 for w, n in self.wrong.most_common(6)]  # fmt: skip
        return {"what": self.what, "points": self.points,
                "failed": self.wrong.total(), "failures": lines}  # fmt: skip


def look_at(kind: Kind, found: Record, place: Path, share: float) -> list[Facts]:
    """Return what became of the awaits of a kind."""
    out = []
    if kind.name in SHARED:
        seen = awaits_of(found, place)
        for what, act in ACTS.items():
            tally = Tally(what)
            for fault in some(list(faults(seen, act)), share):
                where = f"rank {fault.rank} at its {fault.at + 1}. {fault.where}"
                tally.add(where, struck(found, fault))
            out.append(tally.facts())
    if kind.name == "isolated":
        tally = Tally("the case's own interpreter is stopped or dies there")
        for point in some(list(isolated.points(CASES)), share):
            tally.add(" ".join(map(str, point)), struck_apart(found, point))
        out.append(tally.facts())
    if kind.name in OWNED:
        points: list[int | wire.Fault] = [*claims_of(found)]
        # a claim belongs to rank 0, which beats while another rank is stopped: only
        # --take-over, which gather does not have, takes it then
        taken = found.kind.call(place)[0] == "campaign"
        two = faults(awaits_of(found, place, TWO), stop)
        points += [fault for fault in two if taken or fault.rank == 0]
        tally = Tally("stopped, lost to another that ends its work, goes on")
        for at in some(points, share):
            tally.add(_told(found, at), lost(found, at))
        out.append(tally.facts())
    return out


def _told(found: Record, at: int | wire.Fault) -> str:
    """Return where a directory is lost, in words."""
    if isinstance(at, wire.Fault):
        return f"rank {at.rank} at its {at.at + 1}. {at.where}"
    if at == len(found.calls):
        return "at its end"
    return f"before call {at}: {found.calls[at].kind} {found.calls[at].path}"


def some(all_of: list[Any], share: float) -> list[Any]:
    """Return an even share of what there is."""
    return all_of[:: max(round(1.0 / share), 1)]


def stop() -> None:
    """Stop this process, until it is told to go on."""
    os.kill(os.getpid(), signal.SIGSTOP)


def _die() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def _lose() -> None:
    for path in Path(os.environ["CRASH_OWNERS"]).glob("*.claim"):
        path.unlink()


ACTS: dict[str, Callable[[], None]] = {
    "a rank is stopped there, and goes on": stop,
    "a rank is slow there": lambda: time.sleep(PAUSE),
    "a rank dies there, and all with it": _die,
    "all claims are gone there": _lose,
}


def awaits_of(
    found: Record, place: Path, size: int = RANKS
) -> Counter[tuple[int, str]]:
    """Return how often each rank comes to each of its awaits, undisturbed."""
    note = place / "awaits"
    note.unlink(missing_ok=True)
    empty(found)
    ranks = start(found, size, note=note)
    wrong = ranks.wrong()
    if wrong:
        raise checks.BrokenError(wrong)
    rows = (line.split(" ", 1) for line in note.read_text().splitlines())
    return Counter((int(rank), where) for rank, where in rows)


def faults(
    seen: Counter[tuple[int, str]], act: Callable[[], None]
) -> Iterator[wire.Fault]:
    """Yield a fault at each await of each rank, the first times it comes there."""
    for (rank, where), count in sorted(seen.items()):
        for at in range(min(count, EACH)):
            yield wire.Fault(rank, where, at, act)


def empty(found: Record) -> None:
    """Put the directory as it was before the command."""
    world = found.place / "w"
    shutil.rmtree(world, ignore_errors=True)
    world.mkdir()
    found.before.write(world)


def start(found: Record, size: int, **options: Any) -> wire.Ranks:
    """Start the command on some ranks, what it says in a new file."""
    plain = checks.act(found.kind, found.kind.call(found.place))
    return wire.start(size, plain, found.place / "again", **options)


def struck(found: Record, fault: wire.Fault) -> str:
    """Return what goes wrong where a fault strikes, then the command is given again."""
    empty(found)
    os.environ["CRASH_OWNERS"] = str(found.place / "w" / "out" / "owners")
    ranks = start(found, RANKS, fault=fault)
    dies = fault.act is _die
    allowed = (0, -signal.SIGKILL) if dies else ENDS if fault.act is _lose else (0,)
    try:
        if ranks.wait(stopped=True) is None:
            time.sleep(PAUSE)
            ranks.go_on()
    except TimeoutError:
        return "hangs"
    wrong = ranks.wrong(allowed)
    return wrong or checks.wrong_again(found, 2 if dies else 1)


def struck_apart(found: Record, point: tuple[str, int, str]) -> str:
    """Return what goes wrong where an interpreter of isolated cases is struck."""
    empty(found)
    plain = checks.act(found.kind, found.kind.call(found.place))

    def action(comm: Any) -> int:
        from hpcwhirl.campaign import worker_process

        own = worker_process.interpreter
        worker_process.interpreter = lambda _, fd: own(isolated.__name__, fd)
        os.environ[isolated.STRUCK] = ",".join(map(str, point))
        return plain(comm)

    ranks = wire.start(1, action, found.place / "struck")
    wrong = ranks.wrong((0, 1))
    if not wrong and ranks.code == 1 and point[2] not in isolated.ENDS:
        wrong = f"a case is lost: {ranks.told.strip()[-300:]}"
    return wrong or checks.wrong_again(found, 1, "--retry", "crashed")


def claims_of(found: Record) -> Iterator[int]:
    """Yield the calls at which a directory may be lost, those on a part but once."""
    log, before = found.calls, ""
    for number, call in enumerate(log):
        now = f"{call.kind} {call.path}" if PART.search(call.path) else str(number)
        if now != before:
            yield number
        before = now
    yield len(log)


def lost(found: Record, at: int | wire.Fault) -> str:
    """Return what goes wrong where one is stopped and another takes over.

    The first is stopped before the call `at`, or, one of two ranks, by a fault. The
    other is of another machine, is told to take over, and ends its work. Then the
    first goes on, and ends by itself; then the command is given again. Where the other
    has a longer plan, it stays: but at the very call that publishes the shorter one,
    and where the first had claimed nothing yet and so only comes after it.
    """
    taker = checks.going_beyond(found)
    empty(found)
    world, log = found.place / "w", found.place / "lost.log"
    log.unlink(missing_ok=True)
    told = found.place / "first"
    plain = checks.act(found.kind, found.kind.call(found.place))

    def watched(comm: Any) -> int:
        watch(world, log, at, signal.SIGSTOP)
        return plain(comm)

    if isinstance(at, int):
        first = wire.start(1, watched, told)
        owned = any(map(_claims, found.calls[:at]))
        owned = owned and not any(map(_publishes, found.calls[at : at + 1]))
    else:
        first, owned = wire.start(TWO, plain, told, fault=at), False
    wrong = ""
    try:
        if first.wait(stopped=True) is None:
            wrong, plan = taken_over(taker), _plan(world)
            first.go_on()
            first.wait()
            if not wrong and owned and plan != _plan(world):
                wrong = "is told another plan by the first"
    except TimeoutError:
        return "hangs"
    if wrong:
        return f"who takes over: {wrong}"
    return first.wrong(ENDS) or checks.wrong_again(taker, 1)


def _plan(world: Path) -> bytes:
    path = world / "out" / "campaign.json"
    return path.read_bytes() if path.exists() else b""


def _claims(call: Call) -> bool:
    return call.kind == "create" and call.path.endswith(".claim")


def _publishes(call: Call) -> bool:
    return call.kind == "rename" and call.other.endswith("campaign.json")


def taken_over(found: Record) -> str:
    """Return what goes wrong where another machine takes over; "" nothing."""
    kind = found.kind
    words = kind.call(found.place)
    if words[0] == "campaign":
        words = [*words, "--take-over"]
    plain = checks.act(kind, words)

    def elsewhere(comm: Any) -> int:
        from hpcwhirl.store.directory import owner

        owner.machine = lambda: "another machine"
        return plain(comm)

    wrong = wire.start(1, elsewhere, found.place / "taker").wrong()
    return wrong or checks.differs(found)
