"""Scenes decided in processes apart, each within a limit of processor time.

A hang, a crash or a stray line is a finding, too, after which another process goes on.
The limit is of the processor's time, so that a loaded machine breaks no scene; one that
waits for ever is ended by the clock.
"""

from __future__ import annotations

import multiprocessing
import signal
import time
import traceback
import warnings
from collections import deque
from collections.abc import Iterator, Sequence
from multiprocessing.connection import Connection, wait
from typing import NamedTuple

from extremes.laws import Broken
from extremes.table import Extreme

LIMIT = 300.0  # s of the processor for a scene, compilation of its kernels included
PATIENCE = 60.0  # s of the clock that a scene may take / s of the processor
FORK = multiprocessing.get_context("fork")


class Answer(NamedTuple):
    """What a scene gave.

    Attributes
    ----------
    holds, told : whether its law holds; what came out, or what is broken
    seconds : processor time that it took
    """

    holds: bool
    told: str
    seconds: float


def decide(extreme: Extreme) -> Answer:
    """Decide a scene by its law, warnings being errors."""
    start = time.process_time()
    holds, told = _decided(extreme)
    return Answer(holds, told, round(time.process_time() - start, 3))


def _decided(extreme: Extreme) -> tuple[bool, str]:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            return True, extreme.law(extreme.settings)
        except Broken as broken:
            return False, f"BROKEN: {broken}"
        except Exception:  # noqa: BLE001 - a traceback is the finding
            last = traceback.format_exc().strip().splitlines()
            return False, f"TRACEBACK: {last[-1]} at {last[-3].strip()}"


def serve(extremes: Sequence[Extreme], parent: Connection, limit: float) -> None:
    """Decide the scenes whose numbers the parent sends, until it ends.

    A scene beyond its limit of processor time, s, ends this process.
    """
    while True:
        try:
            number = parent.recv()
        except EOFError:
            return
        signal.setitimer(signal.ITIMER_PROF, limit)
        answer = decide(extremes[number])
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        parent.send(answer)


class Worker:
    """A process that decides scenes, one at a time, and is replaced where one ends it.

    Attributes
    ----------
    number : of the scene that it decides
    answers : connection that is ready when it has an answer, or has ended
    """

    def __init__(self, extremes: Sequence[Extreme], limit: float) -> None:
        self.extremes, self.limit = extremes, limit
        self.number, self.deadline = 0, 0.0
        self._begin()

    def _begin(self) -> None:
        self.answers, its = FORK.Pipe()
        given = self.extremes, its, self.limit
        self.process = FORK.Process(target=serve, args=given, daemon=True)
        self.process.start()
        its.close()

    def take(self, number: int) -> None:
        """Give it the number of the next scene."""
        self.number = number
        self.deadline = time.monotonic() + PATIENCE * self.limit
        self.answers.send(number)

    @property
    def is_late(self) -> bool:
        """Whether its scene takes too long by the clock."""
        return time.monotonic() > self.deadline

    def answer(self) -> Answer:
        """Return its answer; where it has none, end it and begin another one."""
        try:
            if self.answers.poll():
                return Answer(*self.answers.recv())
            told = f"HANG: {PATIENCE * self.limit:g} s of the clock"
        except EOFError:
            self.process.join()
            told = f"DIED: {self.process.exitcode}"
            if self.process.exitcode == -signal.SIGPROF:
                told = f"OVER: more than {self.limit:g} s of the processor"
        self.end()
        self._begin()
        return Answer(holds=False, told=told, seconds=self.limit)

    def end(self) -> None:
        """End the process."""
        self.process.kill()
        self.process.join()
        self.answers.close()


def apart(
    extremes: Sequence[Extreme], count: int = 1, limit: float = LIMIT
) -> Iterator[tuple[int, Answer]]:
    """Yield the number and the answer of each scene, in the order in which they end.

    extremes, count : the scenes; number of processes at once
    limit : s, processor time of a scene
    """
    left = deque(range(len(extremes)))
    busy = [Worker(extremes, limit) for _ in range(min(count, len(left)))]
    for one in busy:
        one.take(left.popleft())
    try:
        while busy:
            ready = wait([one.answers for one in busy], timeout=1.0)
            for one in [w for w in busy if w.answers in ready or w.is_late]:
                yield one.number, one.answer()
                if left:
                    one.take(left.popleft())
                else:
                    busy.remove(one)
                    one.end()
    finally:
        for one in busy:
            one.end()
