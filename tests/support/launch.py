"""Starting hpcwhirl as processes of its own, alone or under mpirun."""

import json
import math
import os
import shlex
import signal
import struct
import subprocess
import sys
import time
import zlib
from functools import cache
from pathlib import Path

import h5py
from forked import FIRST, Server

LIMIT = 600  # s, of any process, on a busy machine, too; numba may have to compile
ROOT = Path(__file__).parents[2]
MPIRUN = shlex.split(os.environ.get("HPCWHIRL_MPIRUN", "mpirun"))
RANK = (b"PMI_RANK=", b"OMPI_COMM_WORLD_RANK=", b"PMIX_RANK=")
# line of a campaign that ends without pictures, which take longer than short cases
BARE = 'campaign = {map = "no", report = "no"}\n'
# a campaign of six cases
SIX = f"""
{BARE}scene = {{duration = 0.05}}
solver = {{time_step = 2e-6}}
output = {{interval = 1e-3}}
sweep = {{speed = [300, 340, 380, 420, 460, 500]}}
"""
ENVIRONMENT = dict(os.environ)  # before an MPI in this process adds to it
# every slice of a case takes a while, so that no stop comes after the last
SLOW = """
import time
from hpcwhirl.dynamics.march import March
def advance(march, steps, own=March.advance):
    own(march, steps)
    time.sleep(0.01)
March.advance = advance
"""
# with so many records all cases wait, so that no stop comes after the last; once as
# many cases have been begun, each is written as it ends, and records are counted
HELD = """
import sys, time
from pathlib import Path
sys.path.append({support!r})
from launch import records
from hpcwhirl.dynamics.march import March
from hpcwhirl.store.directory import journal
OUT, LAST = Path({out!r}), []
OLD = len(records(OUT))
BEGUN = OUT.with_name(f"{{OUT.name}}.begun-{{OLD}}")
def advance(march, steps, own=March.advance):
    own(march, steps)
    if march not in LAST:
        LAST[:] = [march]
        with BEGUN.open("a") as file:
            file.write(".")
    if OLD + BEGUN.stat().st_size >= {count}:
        journal.EVERY = 0.0
        if len(records(OUT)) >= {count}:
            time.sleep({pause})
March.advance = advance
"""
MAIN = "import sys\nfrom hpcwhirl.cli import main\nsys.exit(main())\n"
# runs a file with the words after it
AS_MAIN = "import runpy, sys\nsys.argv[:1] = []\n"
AS_MAIN += "runpy.run_path(sys.argv[0], run_name='__main__')\nsys.exit()\n"


def words_of(settings):
    """Return the words by which a command is given inputs."""
    return [w for name, value in settings.items() for w in ("--set", f"{name}={value}")]


def held(out, count, pause=2 * LIMIT):
    """Return a script by which a campaign with `count` records waits for its end.

    pause : time that a slice then takes, s; a short one lets the campaign see a stop
    """
    own = {"support": str(Path(__file__).parent), "out": str(out)}
    return HELD.format(**own, count=count, pause=pause)


def ended(*call, check=False, **options):
    """Return an ended process, whatever its code, with all that it has told."""
    own = {"env": ENVIRONMENT, "cwd": ROOT, "timeout": LIMIT} | options
    words = [str(word) for word in call]
    return subprocess.run(words, capture_output=True, text=True, check=check, **own)


def python(code, *words, **options):
    """Return a new interpreter that has run some code."""
    return ended(sys.executable, "-c", code, *words, **options)


def start(words, ranks=0, first="", real=None, **options):
    """Start `hpcwhirl WORDS`, under mpirun where `ranks` > 0.

    first : script that its process runs before the words
    real : whether its process is a new interpreter; by default with options such as
        `env`, and always where HDF5 is parallel, which begins MPI as it is imported;
        else it is a fork of one process, which costs nothing
    """
    front = [*MPIRUN, "-n", str(ranks)] if ranks else []
    real = h5py.get_config().mpi or (bool(options) if real is None else real)
    plain = [sys.executable, *(["-c", first + MAIN] if first else ["-m", "hpcwhirl"])]
    tool = plain if real else server().starter()
    call = [*front, *tool, *map(str, words)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    own = {"cwd": ROOT} | options
    own["env"] = own.get("env", ENVIRONMENT) | {FIRST: first}
    return subprocess.Popen(call, **pipes, **own)


def spent():
    """Return processor time, s, of this process, what it started and what has ended."""
    found = sum(os.times()[:4])
    if server.cache_info().currsize:
        stat = Path(f"/proc/{server().process.pid}/stat").read_text()
        ticks = stat.rpartition(")")[2].split()[11:15]
        found += sum(map(int, ticks)) / os.sysconf("SC_CLK_TCK")
    return found


def finish(process):
    """Return the ended process with `out` and `err`, within the time limit."""
    try:
        process.out, process.err = process.communicate(timeout=LIMIT)
    except subprocess.TimeoutExpired:
        kill(process)
        raise
    return process


@cache
def server():
    return Server(ENVIRONMENT)


def launch(*words, ranks=0, **options):
    """Return the ended command; a plain one is a fork, too."""
    if ranks or options:
        return finish(start(words, ranks, **options))
    return server().command(words, ROOT)


def script(path, text, *words, ranks):
    """Return ranks that have ended a script with some words; they are forks."""
    path.write_text(text)
    return launch(path, *words, ranks=ranks, first=AS_MAIN, real=False)


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
    if (fork := fork_of(pid)) != pid:
        found += tree(fork)
    for task in Path(f"/proc/{pid}/task").glob("*/children"):
        for child in task.read_text().split():
            found += tree(int(child))
    return found


def fork_of(pid):
    """Return the fork for which a process stands; of other processes themselves."""
    return (server().fork_of(pid) if server.cache_info().currsize else 0) or pid


def pid_of(process, rank):
    """Return the process that is some rank, by what its launcher told it."""
    for pid in tree(process.pid):
        try:
            told = Path(f"/proc/{pid}/environ").read_bytes().split(b"\0")
            call = Path(f"/proc/{pid}/cmdline").read_bytes()
        except OSError:
            continue
        ours = b"hpcwhirl" in call or fork_of(pid) != pid
        if ours and any(name + b"%d" % rank in told for name in RANK):
            return fork_of(pid)
    return None


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
    """Return every whole record of a campaign's journals, read without hpcwhirl."""
    logs = sorted(folder.glob("journal/*.log"))
    return [record for log in logs for _, _, record in kept(log)]


def kept(log):
    """Return (first byte, end, record) of each whole record of a journal."""
    data, found = log.read_bytes(), []
    magic = data.find(b"\n") + 1
    if not magic or len(data) < magic + 8:
        return found
    length, tag = struct.unpack_from("<I4s", data, magic)
    body = data[magic + 8 :][:length]
    if len(body) < length:
        return found  # it is being written
    assert zlib.crc32(body).to_bytes(4, "little") == tag
    header, start = json.loads(body), 2 * (magic + 8 + length)
    codes = {"f8": "d", "i8": "q", "word": "B", "hex": "32s", "text": "64s"}
    bits = -(-len(header["fields"]) // 8)
    code = f"<4sIiI{bits}s" + "".join(codes[kind] for _, _, kind, _ in header["fields"])
    size, text, wanted = struct.calcsize(code), b"", math.inf
    for place in range(start, len(data) - size + 1, size):
        mark, crc, more, _, has, *values = struct.unpack_from(code, data, place)
        if mark != tag or crc != zlib.crc32(data[place + 8 : place + size]):
            continue
        if more >= 0:
            begin, wanted, text, own = place, more, b"", (has, values)
        else:
            text += data[place + 16 : place + size]
        if len(text) >= wanted:
            record = {"message": "", **unpacked(header, *own)}
            for name, value in json.loads(text[:wanted] or b"{}").items():
                both = isinstance(value, dict) and name in record
                record[name] = record[name] | value if both else value
            found.append((begin, place + size, record))
            wanted = math.inf  # what follows is of another one
    return found


def unpacked(header, has, values):
    """Return what the fields of a record hold, by what its file tells of them."""
    told, record = int.from_bytes(has, "little"), {}
    for place, (table, name, kind, words) in enumerate(header["fields"]):
        value = values[place]
        if kind == "word":
            value = words[value]
        elif kind in ("hex", "text"):
            value = value.hex() if kind == "hex" else value.rstrip(b"\0").decode()
        if told >> place & 1:
            (record.setdefault(table, {}) if table else record)[name] = value
    return record


def inputs(place, text):
    """Write a campaign's file; return its path."""
    (place / "campaign.toml").write_text(text)
    return place / "campaign.toml"


def all_variables(folder):
    """Return the root variables of results, and those of the twins."""
    with h5py.File(folder / "results.h5") as file:
        twins = {
            f"twins/{n}": d[()].tobytes() for n, d in file.get("twins", {}).items()
        }
    return root_variables(folder) | twins


def root_variables(folder):
    """Return {name: (type, shape, bytes)} of the root variables of results.h5."""
    with h5py.File(folder / "results.h5") as file:
        found = {n: d for n, d in file.items() if isinstance(d, h5py.Dataset)}
        return {n: (str(d.dtype), d.shape, d[()].tobytes()) for n, d in found.items()}
