"""Commands as forks of one interpreter: processes that import and load nothing anew.

A start of `hpcwhirl campaign` costs seconds of the processor for imports, kernels from
the cache and a process that draws the map. Where a test asks for another process, not
for its start, one that has done all that forks for each command.
"""

import atexit
import gc
import importlib
import json
import os
import subprocess
import sys
import tempfile
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from types import SimpleNamespace


class Server:
    """An interpreter with an environment of its own that forks for each command."""

    def __init__(self, env):
        call = [sys.executable, __file__]
        env = {**env, "PYTHONPATH": str(Path(__file__).parents[2])}
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
        self.process = subprocess.Popen(call, env=env, **pipes)
        atexit.register(self.close)

    def close(self):
        self.process.communicate()

    def command(self, words, cwd, env=None, out=None):
        """Return the ended command with its `returncode`, `out` and `err`."""
        with tempfile.TemporaryDirectory() as place:
            told = {"out": str(out or f"{place}/out"), "err": f"{place}/err"}
            asked = {"words": [*map(str, words)], "cwd": str(cwd), "env": env or {}}
            self.process.stdin.write(json.dumps(asked | told) + "\n")
            self.process.stdin.flush()
            code = int(self.process.stdout.readline())
            texts = {name: Path(path).read_text() for name, path in told.items()}
        return SimpleNamespace(returncode=code, **texts)


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


def serve():
    """Fork for each line of stdin; tell on stdout how the fork ended."""
    from hpcwhirl.cli import main

    warm()
    gc.freeze()  # pages that no collection touches stay shared
    for line in sys.stdin:
        pid = os.fork()
        if pid == 0:
            begin(**json.loads(line))
            sys.exit(main())
        code = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
        sys.stdout.write(f"{code}\n")
        sys.stdout.flush()


def begin(words, cwd, env, out, err):
    """Give a fork its words, its directory, its environment and its files."""
    sys.argv[1:] = words
    os.chdir(cwd)
    for number, path in enumerate(("/dev/null", out, err)):
        handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
        os.dup2(handle, number)
        os.close(handle)
    os.environ.update(env)  # last: it may let calls fail


if __name__ == "__main__":
    serve()
