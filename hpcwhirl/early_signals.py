"""Record stop signals that arrive while the modules of a campaign are still imported.

The imports of a campaign take up to a second, on a shared file system longer. A signal
(TERM, USR1, INT) that a scheduler sends in that time would end the process; with the
handlers of this module it is recorded in `heard`, and the campaign then stops as for a
later signal. This module imports nothing heavy, so that it can be imported first.
"""

from __future__ import annotations

import signal

SIGNALS = (signal.SIGTERM, signal.SIGUSR1, signal.SIGINT)
heard: list[int] = []  # signal numbers, in order of arrival
_before: dict[int, object] = {}  # signal number: its handler before `listen`


def _hear(number: int, _frame: object) -> None:
    heard.append(number)


def listen() -> None:
    """Install handlers that record the stop signals `SIGNALS` in `heard` from now on.

    Outside the main thread nothing is done. The signals are unblocked, too: if the
    launcher blocked them (``env --block-signal``), those sent while Python itself
    started are delivered now.
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
    """Put back the signal handlers that were installed before `listen` was called.

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
