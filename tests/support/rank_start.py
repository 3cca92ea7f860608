"""What mpirun starts in the place of a rank: it asks for a fork that is the rank."""

import json
import os
import signal
import socket
import sys


def ask(path, words, cwd, env, numbers):
    """Return how the fork of a server ended: its exit code, or minus a signal.

    numbers : {number that the fork gives a file: number of the file here}
    """
    told = {"words": words, "cwd": cwd, "env": env, "numbers": [*numbers]}
    with socket.socket(socket.AF_UNIX) as server:
        server.connect(path)
        message = json.dumps(told).encode() + b"\n"
        sent = socket.send_fds(server, [message], [*numbers.values()])
        server.sendall(message[sent:])
        return int(server.recv(64))


def main():
    """Ask for this rank, and end as it ends."""
    path, *words = sys.argv[1:]
    files = [0, 1, 2, *(int(os.environ[n]) for n in ("PMI_FD",) if n in os.environ)]
    env = dict(os.environ)
    code = ask(path, words, os.getcwd(), env, {file: file for file in files})  # noqa: PTH109
    if code < 0:
        signal.signal(-code, signal.SIG_DFL) if -code != signal.SIGKILL else None
        os.kill(os.getpid(), -code)
    sys.exit(code)


if __name__ == "__main__":
    main()
