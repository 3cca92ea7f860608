"""Claims on a campaign's directory: one process computes there, one writes results.

A claim is a file in `owners/`. A process first makes its claim and then reads all
others; if one of them excludes it, the process removes its own claim and waits. Since
each process reads after making its claim, at most one of two processes goes on. This
needs neither locks nor links, only that other processes see a new file. Names are never
used twice, so that removing a dead claim cannot remove a living one.

Whether a process of the same machine is alive can be looked up. A claim of another
machine counts as alive while its time stamp changes, and as dead `STALE` seconds after
the last change, by the clock of the file system, or by the local clock since the claim
was first seen.
"""

from __future__ import annotations

import json
import os
import random
import re
import shlex
import socket
import stat
import sys
import threading
import time
import uuid
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hpcwhirl.errors import InputError, MissingFileError, StoreError, unreadable
from hpcwhirl.store.atomic import NEW, Check, Say, make_folders, telling
from hpcwhirl.store.directory.heartbeats import begun, is_alive, machine
from hpcwhirl.store.directory.manifest import NAME as PLAN

CAMPAIGN, RESULTS = "campaign", "results"
NAME = re.compile(r"(campaign|results|shard-\d+-of-\d+)\.([0-9a-f]{32})\.claim")
PULSE = 15.0  # s between signs of life
STALE = 120.0  # s without a sign of life: a claim of another machine counts as dead
GRACE = 10.0  # s to wait for a living run to end before this run is refused
SOON = 2.0  # s of waiting after which a line names the other process
PAUSE = 0.02, 0.3  # s between checks, shortest and longest
MOST_BYTES = 10_000  # largest size of a claim's file
MOST_COMMAND = 200  # largest number of characters of a command that is kept
TRIES = 100  # attempts to make a file, since others may remove the directory
CAREFUL = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC


class BrokenOffError(MissingFileError):
    """Raised where a stop request ends the wait for another process's claim."""


def shard_claim(number: int, of: int) -> str:
    """Return the kind of claim that a run makes on the cases of a shard.

    number, of : the run computes part `number`, from 1, of `of` parts of the campaign
    """
    return f"shard-{number}-of-{of}"


def in_the_way(one: str, other: str) -> bool:
    """Return whether two kinds of claims on one directory exclude each other.

    Shards I/N and J/N do not exclude each other, nor do a run and the writing of
    results.

    one, other : `CAMPAIGN`, `RESULTS` or a `shard_claim`
    """
    if RESULTS in (one, other) or CAMPAIGN in (one, other):
        return (one == RESULTS) == (other == RESULTS)
    same_division = one.rpartition("-")[2] == other.rpartition("-")[2]
    return one == other or not same_division


@dataclass(frozen=True)
class Owner:
    """The process that made a claim on a campaign's directory, from the claim's file.

    Attributes
    ----------
    path : file of the claim
    changed : last sign of life, ns since 1970 by the clock of the file system
    known : {name: value} of host, machine, pid, ticks and since (start of the process),
        command; {} if the claim is damaged
    """

    path: Path
    changed: int
    known: dict[str, Any]

    @property
    def here(self) -> bool:
        """Whether the process of the claim runs on this machine."""
        return self.known.get("machine") == machine()

    @property
    def is_this(self) -> bool:
        """Whether the process of the claim is this one."""
        pid = os.getpid()
        own = (pid, begun(pid))
        return self.here and (self.known["pid"], self.known["ticks"]) == own

    def __str__(self) -> str:
        """Return number, host, start and command of the process, for messages."""
        if not self.known:
            return f"an unknown process ({self.path})"
        since = time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(self.known["since"]))
        who = f"process {self.known['pid']} on {self.known['host']} since {since}"
        return f"{who} ({self.known['command'][:MOST_COMMAND]})"


class Claim(AbstractContextManager["Claim"]):
    """A claim of this process on a campaign's directory, until it is released.

    While it is held, a thread renews the time stamp of its file as a sign of life. Used
    in a `with` statement, it is released at the end.

    Parameters
    ----------
    claims : all claims on the directory
    kind : `CAMPAIGN`, `RESULTS` or a `shard_claim`
    """

    def __init__(self, claims: Claims, kind: str) -> None:
        self.claims, self.kind = claims, kind
        self.path = claims.place / f"{kind}.{uuid.uuid4().hex}.claim"
        self.when_lost: Say = lambda _: None
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._beat, daemon=True)
        self._made: list[Path] = []

    def put(self) -> int:
        """Make the file of the claim; return its time stamp, ns since 1970.

        Raises
        ------
        MissingFileError
            where the directory cannot be written
        """
        with telling(f"in {self.claims.folder}"):
            handle = self._make()
            # on a full disk the claim is an empty file, which counts, too
            with suppress(OSError):
                os.write(handle, _words())
            try:
                return os.fstat(handle).st_mtime_ns
            finally:
                with suppress(OSError):
                    os.close(handle)

    def _make(self) -> int:
        place = self.path.parent
        for _ in range(TRIES):
            try:
                self._make_folders(place)
                return os.open(self.path, NEW, 0o644)
            except (FileNotFoundError, FileExistsError):
                # another process has just ended and removed the directory
                time.sleep(random.uniform(0.0, PAUSE[0]))
        return os.open(self.path, NEW, 0o644)

    def _make_folders(self, place: Path) -> None:
        """Make the folder `owners`; for a run, also the campaign's directory.

        place : path of the folder `owners`
        """
        if self.kind != RESULTS and not self.claims.folder.exists():
            make_folders(self.claims.folder)
            self._made = [self.claims.folder]
        place.mkdir(exist_ok=True)

    def take_back(self) -> None:
        """Remove the file of the claim, and folders made for it if they are empty."""
        with suppress(OSError):
            self.path.unlink()
        for place in (self.path.parent, *self._made):
            with suppress(OSError):
                place.rmdir()

    def live(self) -> None:
        """Start the thread that renews the claim's time stamp every `PULSE` seconds."""
        self._thread.start()

    @property
    def held(self) -> bool:
        """Whether this process still has the directory: the claim's file exists."""
        return self.path.exists()

    def check(self) -> None:
        """Raise StoreError if another process has taken over, or moved, the directory.

        It is called before a file is published. A process that was suspended for longer
        than `STALE` does not know that it has lost the directory. Only the time between
        two system calls is not protected.
        """
        if not self.held:
            raise StoreError(f"nothing is written: {self._why_lost()}")

    def _why_lost(self) -> str:
        """Return as text why the claim's file is gone."""
        folder = self.claims.folder
        if self.claims.place.exists() or (folder / PLAN).exists():
            return f"another process has taken over {folder}"
        return f"{folder} was moved or removed while this process used it"

    def release(self) -> None:
        """Free the directory for other processes: remove the file of the claim."""
        self._end.set()
        self.take_back()

    def __exit__(self, *error: object) -> None:
        """Release the claim at the end of the block."""
        self.release()

    def moved(self, claims: Claims) -> None:
        """Follow the claim's file after the campaign's directory was renamed.

        claims : claims on the renamed directory
        """
        self.claims, self._made = claims, []
        self.path = claims.place / self.path.name

    def _beat(self) -> None:
        while not self._end.wait(PULSE):
            try:
                os.utime(self.path)
            except FileNotFoundError:
                if not self._end.is_set():
                    self.when_lost(self._why_lost())
                return
            except OSError:  # the file server does not answer: try again later
                continue


@dataclass
class Asking:
    """How a process makes a claim: which others count as dead, how it waits for them.

    Attributes
    ----------
    take_over : whether all claims of other machines count as dead
    say : prints a line about a process that is waited for, or whose claim is taken over
    check : called while waiting; may raise to interrupt the wait
    """

    take_over: bool = False
    say: Say = lambda _: None
    check: Check = lambda: None
    _seen: dict[Path, tuple[int, float]] = field(default_factory=dict)
    _begun: float = field(default_factory=time.monotonic)
    _told: bool = False
    _now: int = 0

    def is_dead(self, other: Owner, now: int) -> bool:
        """Return whether the process of another claim counts as dead.

        Parameters
        ----------
        other : the other claim
        now : time stamp of this process's claim, ns since 1970 by the clock of the file
            system
        """
        if other.here:
            return not is_alive(other.known["pid"], other.known["ticks"])
        first = self._seen.setdefault(other.path, (other.changed, time.monotonic()))
        seen_for, self._now = time.monotonic() - first[1], now
        if self.take_over and (other.known or seen_for > GRACE):  # complete, or damaged
            return True
        if other.changed != first[0]:
            return False
        return now - other.changed > 1e9 * STALE or seen_for > STALE

    def is_alive(self, other: Owner) -> bool:
        """Return whether another claim has shown a sign of life since first seen.

        A process on this machine, of which `is_dead` is false, is alive.
        """
        return other.here or self._seen[other.path][0] != other.changed

    def waited(self, others: list[Owner], claim: Claim) -> None:
        """Print which process is waited for; raise InputError if it is a living run.

        It is called after each wait. Waiting for the writing of results is never
        refused.

        Parameters
        ----------
        others : the claims that exclude this process's claim
        claim : this process's claim

        Raises
        ------
        InputError
            naming the run that computes in the directory
        """
        if claim.kind != RESULTS and any(other.is_this for other in others):
            raise InputError(
                f"{claim.claims.folder} is being computed by this process already: a "
                "campaign within a measure, or in another thread, needs another "
                "directory"
            )
        waited = time.monotonic() - self._begun
        if not self._told and waited >= SOON:
            self._told = True
            self.say(
                f"waiting for {others[0]}, which has claimed {claim.claims.folder}"
            )
        alive = [other for other in others if self.is_alive(other)]
        if claim.kind == RESULTS or waited < GRACE or not alive:
            return
        mend = "wait until that process has ended, or end it"
        if not alive[0].here:
            age = max(self._now - alive[0].changed, 0) / 1e9
            mend += f"; its last sign of life is {age:.0f} s old, it counts as dead "
            mend += f"after {STALE:g} s (at once with --take-over)"
        msg = f"{claim.claims.folder} is being computed by {alive[0]}: {mend}"
        raise InputError(msg)


class Claims:
    """All claims on a campaign's directory.

    folder : the campaign's directory
    """

    def __init__(self, folder: Path) -> None:
        self.folder, self.place = folder, folder / "owners"

    def make(self, kind: str, asking: Asking | None = None) -> Claim:
        """Make a claim on the directory, once no other claim excludes it; return it.

        Parameters
        ----------
        kind : `CAMPAIGN` or a `shard_claim`, refused while another run is alive; or
            `RESULTS`, which waits until other processes have written their results
        asking : how to wait; None: the defaults, without output

        Raises
        ------
        InputError
            naming another run that computes in the directory
        MissingFileError
            where the directory cannot be written
        """
        own, asking = Claim(self, kind), asking or Asking()
        while True:
            try:
                others = _others(own, own.put(), asking)
                if not others:
                    own.live()
                    return own
            except BaseException:
                own.take_back()
                raise
            own.take_back()
            asking.waited(others, own)
            asking.check()
            time.sleep(random.uniform(*PAUSE))

    def owners(self) -> list[Owner]:
        """Return who made each claim on the directory, living and dead processes."""
        try:
            names = sorted(os.listdir(self.place))  # noqa: PTH208 - errors are told
        except FileNotFoundError:
            return []
        except OSError as failed:
            raise unreadable(self.place, failed) from None
        found = (_owner(self.place / name) for name in names if NAME.fullmatch(name))
        return [owner for owner in found if owner is not None]


def _others(own: Claim, now: int, asking: Asking) -> list[Owner]:
    """Return the claims of living processes that exclude a claim; remove dead claims.

    Parameters
    ----------
    own : the claim
    now : its time stamp, ns since 1970
    asking : options, which decide when a process counts as dead
    """
    found = []
    for other in own.claims.owners():
        if other.path.name == own.path.name:
            continue
        counts = in_the_way(own.kind, other.path.name.partition(".")[0])
        if not (asking if counts else Asking()).is_dead(other, now):
            found += [other] * counts
            continue
        with suppress(OSError):
            other.path.unlink()
        if counts and not other.here:
            asking.say(f"taken over from {other}, which gives no sign of life")
    return found


def _owner(path: Path) -> Owner | None:
    """Return who made a claim, from its file; None if that is no regular file."""
    data = b""
    try:
        state = path.lstat()
        if not stat.S_ISREG(state.st_mode):
            return None
        with suppress(PermissionError):
            handle = os.open(path, CAREFUL)
            try:
                state, data = os.fstat(handle), os.read(handle, MOST_BYTES)
            finally:
                os.close(handle)
    except FileNotFoundError:
        return None
    except OSError as failed:
        raise unreadable(path, failed) from None
    return Owner(path, state.st_mtime_ns, _known(data))


def _known(data: bytes) -> dict[str, Any]:
    """Return what a claim's file says of its process, {name: value}; {} if damaged.

    data : content of the file
    """
    kinds = {"host": str, "machine": str, "pid": int, "command": str}
    try:
        known = json.loads(data)
        whole = all(isinstance(known[name], kind) for name, kind in kinds.items())
        time.localtime(known["since"])
        return known if whole and isinstance(known["ticks"], int | None) else {}
    except (ValueError, KeyError, TypeError, OverflowError, OSError, RecursionError):
        return {}


def _words() -> bytes:
    pid = os.getpid()
    known = {
        "host": socket.gethostname(), "machine": machine(), "pid": pid,
        "ticks": begun(pid), "since": time.time(),
        "command": shlex.join(sys.argv)[:MOST_COMMAND],
    }  # fmt: skip
    return json.dumps(known).encode() + b"\n"
