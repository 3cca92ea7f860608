"""Code of the time integration that numba compiles, and its cache on disk.

Terms used in these modules, besides those of the manual:

- slot: a nodal diameter 0 .. N // 2, as an index of a spectrum
- spectrum: (2 k,), re of the k slots, then im; k is N // 2 + 1, padded to vectors
- row (of modes): the f-th mode of every slot; column: re or im of one slot, in all rows
- items: the coefficients of a mode or wave that a step needs, in a fixed order
- folded row: values of all blades (2 wide,), of which the first half are those of
  blades j = 0 .. N // 2, padded to `wide`, the second those of blades N - j, see
  `circulant.folded`; in signatures, `row` is the index where it begins in a flat array
- pending step: a step whose contact forces have been computed, but not yet applied
- active blades: those in contact; push, where: their multipliers, N, and their indices
- known: the active blades of the last solution; tips: displacements of all tips
- d, d': increments of an amplitude, q_n - q_{n-1} and q_{n+1} - q_n, in the last and in
  the present step; so d' + d is the change from step n - 1 to n + 1
- W: Delassus matrix, m/N, opening of all gaps by unit multipliers

Numba's cache identifies a function by its file and line, and does not notice edits in
the functions that it calls. So the cache is in a directory named by a digest of these
files' code, under NUMBA_CACHE_DIR or the user's cache directory. If that cannot be
written, each process has a temporary cache of its own. Docstrings, comments and blank
lines are not part of the digest: if only these change, nothing is compiled again, and
saved states can be resumed.

Numba numbers the files of compiled code and writes the index first: two processes that
compile two variants of a kernel at once use the same number, and the index of one
refers to the code of the other. Here each file has a unique name and is written before
the index refers to it: at worst an entry is lost and that variant is compiled again.
"""

from __future__ import annotations

import atexit
import hashlib
import os
import re
import shutil
import tempfile
import uuid
from pathlib import Path
from typing import Any

from numba import config
from numba.core.caching import (
    CacheImpl,
    IndexDataCacheFile,
    UserProvidedCacheLocator,
)

QUOTES = '"' * 3
TEXTS = r'"(?:[^"\\]|\\.)*"', r"'(?:[^'\\]|\\.)*'"  # on one line
TEXT_OR_COMMENT = re.compile(f"({'|'.join(TEXTS)})|#.*")


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
    plain = os.environ.get("HPCWHIRL_PLAIN_NUMBA", "0")  # see `compiled`
    return hashlib.sha256((text + plain).encode()).hexdigest()[:16]


class KernelLocator(UserProvidedCacheLocator):  # type: ignore[misc, unused-ignore]
    """Numba's cache locator for these files; a new line number keeps a cached function.

    The name of the cache's directory is a digest of the code: other code is in another
    directory. So numba is given the digest in place of a stamp of the source file, and
    a constant in place of the line at which a function begins.
    """

    def get_source_stamp(self) -> str:
        """Return what the entries of the cache were made of: the digest of the code."""
        return DIGEST

    def get_disambiguator(self) -> str:
        """Return the same for each function, in the place of its line."""
        return "0"

    @classmethod
    def from_function(cls, py_func: Any, py_file: str) -> Any:
        """Return the cache locator of a function, None for one of another directory."""
        if Path(py_file).parent != HERE:
            return None
        return super().from_function(py_func, py_file)


def _cache_base(chosen: str) -> Path:
    if chosen:
        return Path(chosen)
    home = Path(os.path.expanduser("~"))  # noqa: PTH111 - Path.home raises without one
    return Path(os.environ.get("XDG_CACHE_HOME") or home / ".cache") / "hpcwhirl"


def _may_write(place: Path) -> bool:
    """Return whether files can be written to a directory; create it if missing."""
    try:
        place.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=place):
            return True
    except OSError:
        return False


def _own() -> str:
    """Create a directory for this process alone, removed at its end; return its path.

    Numba executes what it loads from its cache: other users must not be able to write.
    """
    place = tempfile.mkdtemp(prefix="hpcwhirl-numba-")
    atexit.register(shutil.rmtree, place, ignore_errors=True)
    return place


def save_apart(cache: Any, key: Any, data: Any) -> None:
    """Save compiled code as `IndexDataCacheFile.save` does, but under a unique name.

    cache : numba's index of one function
    key, data : signature and target; compiled code
    """
    overloads = cache._load_index()
    name = overloads.get(key)
    if name is not None:  # the cache has code for this key already
        cache._save_data(name, data)
        return
    overloads[key] = name = cache._data_name(uuid.uuid4().int)
    cache._save_data(name, data)
    cache._save_index(overloads)


def cache_facts() -> dict[str, Any]:
    """Return {fact: value} of numba's cache: path, writability, number of kernels."""
    compiled = sum(1 for _ in WANTED.rglob("*.nbc")) if WANTED.is_dir() else 0
    return {"cache": str(WANTED), "cache_writable": KEPT, "cache_kernels": compiled}


HERE = Path(__file__).parent
FILES = sorted([*HERE.glob("*.py"), *HERE.parent.glob("schemes/*.py")])
DIGEST = digest_of(FILES)
_settings = vars(config)
WANTED = _cache_base(_settings["CACHE_DIR"]) / DIGEST
KEPT = _may_write(WANTED)  # if False, every process compiles everything again
_settings["CACHE_DIR"] = str(WANTED) if KEPT else _own()
IndexDataCacheFile.save = save_apart  # type: ignore[method-assign]
CacheImpl._locator_classes.insert(0, KernelLocator)
