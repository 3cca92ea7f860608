"""Compiled code on disk: each function of `kernels` and `schemes` has a cache here.

Numba's cache identifies a function by its file and line, and does not notice edits in
the functions that it calls. So the entries are in a directory named by a digest of
these files' code, under NUMBA_CACHE_DIR or the user's cache directory. If that cannot
be written, each process has a temporary directory of its own. Docstrings, comments and
blank lines are not part of the digest: if only these change, nothing is compiled again,
and saved states can be resumed.

Numba itself remains as it is: functions that others compile are cached where numba puts
them. A `KernelCache` belongs to one function and has one file for each signature. The
name of the file follows from what was compiled, so that processes that compile at once
need no index. A file begins with the SHA-256 of the rest. A file that is cut, empty or
altered is deleted, and its function is compiled again.

The checksum finds accidents. Code that is loaded is executed, so directory and files
must belong to the user of this process, and no other user may write them.

Which release of numba is installed decides how kernels are compiled, see `is_plain`.
"""

from __future__ import annotations

import atexit
import contextlib
import hashlib
import os
import pickle
import re
import shutil
import sys
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

import numba
from numba import config
from numba.core import compiler, serialize

from hpcwhirl import launch

numba_config: Any = config  # Any: these have no types
CompileResult: Any = compiler.CompileResult
dumps: Any = serialize.dumps

KNOWN = ("0.68",)  # releases of numba with whose inside `kernels.compiler` works
QUOTES = '"' * 3
TEXTS = r'"(?:[^"\\]|\\.)*"', r"'(?:[^'\\]|\\.)*'"  # on one line
TEXT_OR_COMMENT = re.compile(f"({'|'.join(TEXTS)})|#.*")
CHECKSUM = hashlib.sha256(b"").digest_size  # bytes before the content of a file
ROOMS = ("hpcwhirl.dynamics.kernels.", "hpcwhirl.dynamics.schemes.")


@cache
def tell(line: str) -> None:
    """Print a line on stderr, once in a process, and on rank 0 alone."""
    if launch.launched_first():
        print(f"hpcwhirl: {line}", file=sys.stderr)  # noqa: T201 - no logger here


def is_plain(release: str, asked: str) -> bool:
    """Return whether kernels are compiled by `numba.njit` alone.

    This gives the same bits, but is slower to compile and to run. It is so on request,
    and with a release of numba whose inside is not known.

    release : version of numba
    asked : HPCWHIRL_PLAIN_NUMBA: "1" for it, "0" against it, "" to decide by release
    """
    if asked:
        return asked != "0"
    if ".".join(release.split(".")[:2]) in KNOWN:
        return False
    tell(
        f"warning: numba {release} is not one of the known releases "
        f"({', '.join(KNOWN)}): kernels compile and run more slowly"
    )
    return True


def code_of(text: str) -> str:
    """Return the text of a module without docstrings, comments and blank lines.

    A docstring becomes an empty text. Triple quotes are expected around docstrings
    alone; a text with others is returned as it is. Every start does this: a parser
    takes much longer, and its trees depend on Python's version.
    """
    parts = text.split(QUOTES)
    for before, after in zip(parts[:-1:2], parts[2::2], strict=True):
        if before.rpartition("\n")[2].strip() or after.partition("\n")[0].strip():
            return text
    lines = (QUOTES * 2).join(parts[::2]).splitlines()
    kept = (TEXT_OR_COMMENT.sub(r"\1", n) if "#" in n else n for n in lines)
    return "\n".join(line.rstrip() for line in kept if line and not line.isspace())


def digest_of(files: list[Path]) -> str:
    """Return a digest of the code of some modules, and of how it is compiled."""
    text = "\n".join(code_of(path.read_text(encoding="utf-8")) for path in files)
    return hashlib.sha256(f"{text}{PLAIN:d}".encode()).hexdigest()[:16]


def _cache_base(chosen: str) -> Path:
    if chosen:
        return Path(chosen)
    home = Path(os.path.expanduser("~"))  # noqa: PTH111 - Path.home raises without one
    return Path(os.environ.get("XDG_CACHE_HOME") or home / ".cache") / "hpcwhirl"


def _may_write(place: Path) -> bool:
    """Return whether this user alone can write to a directory; create it if missing.

    If not, a line tells why: every process then compiles everything again.
    """
    why = f"others than its user may write {place}"
    try:
        place.mkdir(mode=0o700, parents=True, exist_ok=True)
        if is_own(place.stat()):
            with tempfile.TemporaryFile(dir=place):
                return True
    except OSError as failed:
        why = f"cannot write {place}: {failed.strerror}"
    tell(f"note: compiled code is not kept, each rank compiles at each start: {why}")
    return False


def is_own(state: os.stat_result) -> bool:
    """Return whether a file or directory is this user's, and no other may write it.

    state : its status
    """
    return state.st_uid == os.geteuid() and not state.st_mode & 0o022


def _temporary() -> Path:
    """Create a directory for this process alone, removed at its end; return its path.

    Code loaded from a cache is executed: other users must not be able to write there.
    """
    place = tempfile.mkdtemp(prefix="hpcwhirl-numba-")
    atexit.register(shutil.rmtree, place, ignore_errors=True)
    return Path(place)


def read_intact(path: Path) -> bytes | None:
    """Return the content of a file of the cache, None without an intact one.

    A damaged file is deleted, and so is one that another user can have written.
    """
    try:
        with path.open("rb") as file:
            data = file.read() if is_own(os.fstat(file.fileno())) else b""
    except OSError:  # none, or none that can be read: the function is compiled
        return None
    content = data[CHECKSUM:]
    if hashlib.sha256(content).digest() == data[:CHECKSUM]:
        return content
    with contextlib.suppress(OSError):
        path.unlink()
    return None


def write_intact(path: Path, content: bytes) -> None:
    """Write a file of the cache with its checksum; other processes see all or nothing.

    Where it cannot be written, a line tells why: the code is then compiled again by
    each process.
    """
    part = path.with_name(f"{path.name}.{os.getpid()}.tmp")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with part.open("wb") as file:
            os.fchmod(file.fileno(), 0o600)  # whatever the umask
            file.write(hashlib.sha256(content).digest() + content)
        part.replace(path)
    except OSError as failed:
        with contextlib.suppress(OSError):
            part.unlink()
        tell(f"note: compiled code is not kept in {path.parent}: {failed.strerror}")


class KernelCache:
    """The compiled variants of one function on disk, in the place of numba's cache.

    Numba calls the methods; its own class for this is `numba.core.caching.Cache`.
    """

    def __init__(self, function: Any, place: Path) -> None:
        """Make the cache of a function; its files are in the directory `place`."""
        self.function, self.place = function, place
        module = function.__module__.rpartition(".")[2]
        name = re.sub(r"[<>]", "", function.__qualname__)
        self.name = f"{module}.{name}"

    @property
    def cache_path(self) -> str:
        """Return the directory of the files."""
        return str(self.place)

    def flush(self) -> None:
        """Delete the function's files."""
        for path in self.place.glob(f"{self.name}-*.nbc"):
            path.unlink(missing_ok=True)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the compiled variant for a signature, None if there is none."""
        target_context.refresh()
        key = self._key(sig, target_context.codegen())
        content = read_intact(self._path(key))
        if content is None:
            if KEPT:
                tell("compiling kernels, once per machine")
            return None
        of, reduced = pickle.loads(content)
        return CompileResult._rebuild(target_context, *reduced) if of == key else None

    def save_overload(self, sig: Any, result: Any) -> None:
        """Keep the compiled variant for a signature; one with addresses cannot be."""
        if result.library.has_dynamic_globals:
            return
        key = self._key(sig, result.codegen)
        write_intact(self._path(key), dumps((key, result._reduce())))

    def _key(self, sig: Any, codegen: Any) -> str:
        """Return what the machine code depends on, besides the code of all kernels.

        These are the types of arguments, the processor, versions, and the variables of
        a function made by another one.
        """
        cells = self.function.__closure__ or ()
        held = hashlib.sha256(dumps(tuple(n.cell_contents for n in cells))).hexdigest()
        versions = numba.__version__, sys.version
        return repr((self.name, sig, codegen.magic_tuple(), held, versions))

    def _path(self, key: str) -> Path:
        short = hashlib.sha256(key.encode()).hexdigest()[:32]
        return self.place / f"{self.name}-{short}.nbc"


def kept(dispatcher: Any) -> Any:
    """Give a function that numba compiles a cache on disk; return it.

    A function of another package or of a test is not kept: the digest does not cover
    its code.
    """
    function = dispatcher.py_func
    if function.__module__.startswith(ROOMS):
        dispatcher._cache = KernelCache(function, PLACE)
    return dispatcher


def cache_facts() -> dict[str, Any]:
    """Return {fact: value} of the cache: path, writability, number of kernels."""
    compiled = sum(1 for _ in WANTED.glob("*.nbc")) if WANTED.is_dir() else 0
    return {"cache": str(WANTED), "cache_writable": KEPT, "cache_kernels": compiled}


PLAIN = is_plain(numba.__version__, os.environ.get("HPCWHIRL_PLAIN_NUMBA", ""))
HERE = Path(__file__).parent
FILES = sorted([*HERE.glob("kernels/**/*.py"), *HERE.glob("schemes/*.py")])
DIGEST = digest_of(FILES)
WANTED = _cache_base(numba_config.CACHE_DIR) / DIGEST
KEPT = _may_write(WANTED)  # if False, every process compiles everything again
PLACE = WANTED if KEPT else _temporary()
