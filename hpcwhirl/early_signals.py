"""Record signals while a campaign's modules are imported, so that none ends it.

The imports of a campaign take up to a second, on a shared file system longer. A signal
that a scheduler sends in that time asks to stop, like a later signal. This
module imports nothing heavy, so that the handlers are installed first.
"""

from __future__ import annotations

import signal

SIGNALS = (signal.SIGTERM, signal.SIGUSR1, signal.SIGINT)
heard: list[int] = []  # signal numbers, in order of arrival
_before: dict[int, object] = {}  # signal number: its handler before `listen`


def _hear(number: int, _frame: object) -> None:
    heard.append(number)


def listen() -> None:
    """Record `SIGNALS` in `heard` from now on; do nothing outside the main thread.

    The signals are unblocked, too: if the launcher blocked them (``env
    --block-signal``), those sent while Python itself started are delivered now.
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
    """Restore the handlers that `listen` replaced.

    Parameters
    ----------
    program : whether the process is about to end; if so, the signals are ignored from
        now on, so that none changes the exit code
    """
    for name, handler in _before.items():
        if signal.getsignal(name) is _hear:
            before = signal.SIG_IGN if program else handler or signal.SIG_DFL
            signal.signal(name, before)  # type: ignore[arg-type]
    _before.clear()
