"""Signals that come while a campaign is still being imported: noted, not died of.

The imports of a campaign take up to a second, and on a shared file system longer; a
warning or an end that a scheduler sends meanwhile is a wish to stop like any later one.
Nothing heavy is imported here, so that this comes first.
"""

from __future__ import annotations

import signal

SIGNALS = (signal.SIGTERM, signal.SIGUSR1, signal.SIGINT)
heard: list[int] = []  # numbers, in the order they came
_before: dict[int, object] = {}


def _hear(number: int, frame: object) -> None:
    del frame
    heard.append(number)


def listen() -> None:
    """Note signals from now on; only a main thread can, elsewhere nothing changes.

    A launcher that blocks them (``env --block-signal``) has them wait for this, so that
    not even the start of Python is deaf to them.
    """
    heard.clear()
    try:
        for name in SIGNALS:
            _before[name] = signal.signal(name, _hear)
    except ValueError:  # not the main thread
        _before.clear()
        return
    signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)


def leave(*, program: bool) -> None:
    """End listening where `listen` has begun it.

    Parameters
    ----------
    program : whether the process ends now; no signal is to change its exit code then
    """
    for name, handler in _before.items():
        if signal.getsignal(name) is _hear:
            before = signal.SIG_IGN if program else handler or signal.SIG_DFL
            signal.signal(name, before)  # type: ignore[arg-type]
    _before.clear()
