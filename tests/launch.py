"""Starting hpcwhirl as processes of its own, alone or under mpirun."""

import base64
import json
import os
import shlex
import signal
import struct
import subprocess
import sys
import time
import zlib
from pathlib import Path

import h5py

LIMIT = 600  # s, of any process, on a busy machine, too; numba may have to compile
ROOT = Path(__file__).parents[1]
MPIRUN = shlex.split(os.environ.get("HPCWHIRL_MPIRUN", "mpirun"))
ENVIRONMENT = dict(os.environ)  # before an MPI in this process adds to it


def start(words, ranks=0, **options):
    """Start `hpcwhirl WORDS`, under mpirun where `ranks` > 0."""
    front = [*MPIRUN, "-n", str(ranks)] if ranks else []
    call = [*front, sys.executable, "-m", "hpcwhirl", *map(str, words)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen(call, cwd=ROOT, **pipes, **{"env": ENVIRONMENT, **options})


def finish(process):
    """Return the ended process with `out` and `err`, within the time limit."""
    try:
        process.out, process.err = process.communicate(timeout=LIMIT)
    except subprocess.TimeoutExpired:
        kill(process)
        raise
    return process


def launch(*words, ranks=0, **options):
    return finish(start(words, ranks, **options))


def wait_for(reached, process):
    """Wait until `reached()`; the process must still be at work then."""
    end = time.monotonic() + LIMIT
    while not reached():
        if process.poll() is not None or time.monotonic() > end:
            kill(process)
            raise AssertionError(process.communicate())
        time.sleep(0.005)


def tree(pid):
    """Return a process and all that descend from it; mpirun's have own groups."""
    found = [pid]
    for task in Path(f"/proc/{pid}/task").glob("*/children"):
        for child in task.read_text().split():
            found += tree(int(child))
    return found


def kill(process):
    """Kill -9 a process and its descendants before one of them can clean up."""
    members = tree(process.pid)
    for number in (signal.SIGSTOP, signal.SIGKILL):
        for pid in members:
            try:
                os.kill(pid, number)
            except ProcessLookupError:
                continue
    process.communicate()


def records(folder):
    """Return every whole line of a campaign's journals, read without hpcwhirl."""
    lines = [p.read_text().splitlines(True) for p in folder.glob("journal/*.log")]
    whole = [line for part in lines for line in part if line.endswith("\n")]
    bodies = [line.partition(" ")[2] for line in whole]
    plain = [json.loads(body) for body in bodies if body[0] == "{"]
    tables = {f"{zlib.crc32(body[:-1].encode()):08x}": json.loads(body)["layout"]
              for body in bodies if body.startswith('{"layout"')}  # fmt: skip
    packed = [unpacked(body.split(maxsplit=2), tables) for body in bodies
              if body[0] == "~"]  # fmt: skip
    return packed + [record for record in plain if "digest" in record]


def unpacked(words, tables):
    """Return the record of a packed line, by what its file tells of it."""
    table, data = tables[words[0][1:]], base64.b64decode(words[1])
    codes = {"f8": "d", "i8": "q", "word": "B", "hex": "32s", "text": "24s"}
    code = "<" + "".join(codes[kind] for _, _, kind, _ in table)
    values = struct.unpack_from(code, data)
    more = json.loads(words[2]) if len(words) > 2 else {}
    tables = {"row": {}, "performance": {}}
    record = {"status": "ok", "message": "", **more, **tables}
    for (part, name, kind, known), value in zip(table, values, strict=True):
        told = {"word": lambda v, known=known: known[v], "hex": bytes.hex,
                "text": lambda v: v.rstrip(b"\0").decode()}  # fmt: skip
        own = record[part] if part else record
        own[name] = told.get(kind, lambda v: v)(value)
    for part in ("row", "performance"):
        record[part] |= more.get(part, {})
    return record


def root_variables(folder):
    """Return {name: (type, shape, bytes)} of the root variables of results.h5."""
    with h5py.File(folder / "results.h5") as file:
        found = {n: d for n, d in file.items() if isinstance(d, h5py.Dataset)}
        return {n: (str(d.dtype), d.shape, d[()].tobytes()) for n, d in found.items()}
