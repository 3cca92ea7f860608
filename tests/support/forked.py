"""Commands as forks of one interpreter: processes that import and load nothing anew.

A start of `hpcwhirl campaign` costs seconds of the processor for imports, kernels from
the cache and a process that draws the map. Where a test asks for another process, not
for its start, one that has done all that forks for each command. Where mpirun starts it
or a test sends it signals, `rank_start` stands for it and hands its files over.
"""

import atexit
import ctypes
import fcntl
import gc
import importlib
import json
import os
import select
import signal
import socket
import subprocess
import sys
import tempfile
from contextlib import redirect_stderr, redirect_stdout, suppress
from pathlib import Path
from types import SimpleNamespace

from rank_start import ask

HIGH = 500  # number from which files are put that wait for their own
FIRST = "TEST_RUNS_FIRST"  # variable with a script that a fork runs before its words
START = Path(__file__).with_name("rank_start.py")


class Server:
    """An interpreter with an environment of its own that forks for each command."""

    def __init__(self, env):
        self.env = {**env, "PYTHONPATH": str(Path(__file__).parents[2])}
        self.place = tempfile.TemporaryDirectory()
        self.path = f"{self.place.name}/forks"
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
        call = [sys.executable, __file__, self.path]
        self.process = subprocess.Popen(call, env=self.env, **pipes)
        assert self.process.stdout.readline() == "ready\n"
        atexit.register(self.close)

    def close(self):
        self.process.communicate()
        self.place.cleanup()

    def command(self, words, cwd, env=None, out=None):
        """Return the ended command with its `returncode`, `out` and `err`."""
        with tempfile.TemporaryDirectory() as place:
            told = {"out": str(out or f"{place}/out"), "err": f"{place}/err"}
            paths = ["/dev/null", *told.values()]
            files = [os.open(path, os.O_RDWR | os.O_CREAT, 0o666) for path in paths]
            own = {**self.env, **(env or {})}
            numbers = dict(enumerate(files))
            code = ask(self.path, [*map(str, words)], str(cwd), own, numbers)
            for file in files:
                os.close(file)
            texts = {name: Path(path).read_text() for name, path in told.items()}
        return SimpleNamespace(returncode=code, **texts)

    def fork_of(self, pid):
        """Return the fork for which a process stands, or 0."""
        try:
            return int(Path(f"{self.path}-{pid}").read_text() or 0)
        except FileNotFoundError:
            return 0

    def starter(self):
        """Return the first words of a command that stands for a fork."""
        return [sys.executable, "-I", "-S", str(START), self.path]


SMALL = "scene = {duration = 1e-3}\nsweep = {speed = [300, 410]}\n"


def warm():
    """Run a campaign and draw its map here, which loads what every fork will need."""
    from hpcwhirl.cli import main

    importlib.import_module("matplotlib.figure")  # with both, a map is drawn in here
    importlib.import_module("xarray")
    with tempfile.TemporaryDirectory() as name, Path(os.devnull).open("w") as nowhere:
        path = Path(name, "small.toml")
        path.write_text(SMALL)
        words = ["campaign", str(path), "--out", f"{name}/out"]
        with redirect_stdout(nowhere), redirect_stderr(nowhere):
            assert main(words) == 0


def serve(path):
    """Fork for each connection until stdin ends; answer how the fork ended."""
    from hpcwhirl.cli import main

    warm()
    gc.freeze()  # pages that no collection touches stay shared
    listener = socket.socket(socket.AF_UNIX)
    listener.bind(path)
    listener.listen(64)
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    forks = Forks(path)
    while True:
        ready, _, _ = select.select([0, listener, *forks.watched()], [], [])
        if 0 in ready:
            forks.end()
            return
        for file in ready:
            forks.look(file)
        if listener in ready and not forks.begin(listener):
            leave(main())


def leave(code):
    """End a fork as its interpreter would, but for the memory, which it leaves alone.

    To clear it would take as long as a short campaign: every page is copied first.
    """
    atexit._run_exitfuncs()
    mpi = sys.modules.get("mpi4py.MPI")  # which ends itself as memory is cleared
    if mpi and mpi.Is_initialized() and not mpi.Is_finalized():
        mpi.Finalize()
    sys.stdout.flush()
    sys.stderr.flush()
    ctypes.CDLL(None).exit(code)  # with what libraries do at the end


def answer(asker, number):
    """Tell a number to who asked, if it has not been killed meanwhile."""
    with suppress(BrokenPipeError, ConnectionResetError):
        asker.sendall(b"%d\n" % number)


class Forks:
    """The forks at work, each with a file that tells its end and who asked for it."""

    def __init__(self, path):
        self.path = path
        self.asked = {}  # file of the process: (process, connection, note of it)

    def watched(self):
        return [*self.asked, *(asker for _, asker, _ in self.asked.values())]

    def begin(self, listener):
        """Fork for who asks next; return whether this is still the server."""
        asker, _ = listener.accept()
        message, files = b"", []
        while not message.endswith(b"\n"):
            more, some, _, _ = socket.recv_fds(asker, 1 << 20, 8)
            message, files = message + more, files + list(some)
            if not more:  # it was killed
                asker.close()
                return True
        pid = os.fork()
        if pid:
            for file in files:
                os.close(file)
            told = asker.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, 4)
            note = Path(f"{self.path}-{int.from_bytes(told, sys.byteorder)}")
            note.write_text(f"{pid}")  # for `Server.fork_of`
            self.asked[os.pidfd_open(pid)] = pid, asker, note
            answer(asker, pid)
            return True
        for handle in self.asked:
            os.close(handle)
        for own in (listener, asker, *(other for _, other, _ in self.asked.values())):
            own.close()  # its number may be that of another file now
        become(**json.loads(message), files=files)
        return False

    def end(self):
        for pid, _, _ in self.asked.values():
            os.kill(pid, signal.SIGKILL)

    def look(self, file):
        """Answer for a fork that has ended; kill one whose asker is gone."""
        for handle, (pid, asker, note) in list(self.asked.items()):
            if file is asker:  # it says nothing more: it was closed
                os.kill(pid, signal.SIGKILL)
            if file in (handle, asker):
                code = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
                note.unlink(missing_ok=True)
                if file is handle:
                    answer(asker, code)
                os.close(handle)
                asker.close()
                del self.asked[handle]


def become(words, cwd, env, numbers, files):
    """Give a fork its words, its directory, its environment and its files."""
    sys.argv[1:] = words
    os.chdir(cwd)
    high = [fcntl.fcntl(file, fcntl.F_DUPFD, HIGH) for file in files]
    for file in files:
        os.close(file)
    for number, file in zip(numbers, high, strict=True):
        os.dup2(file, number)
        os.close(file)
    os.environ.clear()
    os.environ.update(env)  # last: it may let calls fail
    exec(os.environ.pop(FIRST, ""), {})


if __name__ == "__main__":
    serve(sys.argv[1])
