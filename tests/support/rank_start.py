"""What stands for a command, or a rank of mpirun, that is a fork of a server.

It asks for the fork, hands its signals on, and ends as it ends; if it is killed, so is
the fork.
"""

import contextlib
import json
import os
import signal
import socket
import sys

FORWARDED = [signal.SIGTERM, signal.SIGINT, signal.SIGUSR1, signal.SIGUSR2]


def ask(path, words, cwd, env, numbers, begun=lambda _: None):
    """Return how the fork of a server ended: its exit code, or minus a signal.

    numbers : {number that the fork gives a file: number of the file here}
    begun : called with the fork's process
    """
    told = {"words": words, "cwd": cwd, "env": env, "numbers": [*numbers]}
    with socket.socket(socket.AF_UNIX) as server:
        server.connect(path)
        message = json.dumps(told).encode() + b"\n"
        sent = socket.send_fds(server, [message], [*numbers.values()])
        server.sendall(message[sent:])
        with server.makefile("rb") as answers:
            begun(int(answers.readline()))
            return int(answers.readline())


def forward(pid):
    """Hand signals on to a process."""

    def hand(number, _):
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, number)

    for number in FORWARDED:
        signal.signal(number, hand)


def main():
    """Ask for this rank, and end as it ends."""
    path, *words = sys.argv[1:]
    files = [0, 1, 2, *(int(os.environ[n]) for n in ("PMI_FD",) if n in os.environ)]
    env = dict(os.environ)
    numbers = {file: file for file in files}
    code = ask(path, words, os.getcwd(), env, numbers, forward)  # noqa: PTH109
    if code < 0:
        if -code in FORWARDED:
            signal.signal(-code, signal.SIG_DFL)
        os.kill(os.getpid(), -code)
    sys.exit(code)


if __name__ == "__main__":
    main()
