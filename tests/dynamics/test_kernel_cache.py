"""Compiled code on disk: ours apart from others', and never damaged code."""

import os
import re

import numba
import pytest
from launch import python

from hpcwhirl.dynamics import kernel_cache
from hpcwhirl.dynamics.kernel_cache import KernelCache, is_plain, write_intact
from hpcwhirl.dynamics.kernels.compiled import kernel

pytestmark = pytest.mark.turns

GONE = ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME", "HPCWHIRL_PLAIN_NUMBA")
BARE = {name: text for name, text in os.environ.items() if name not in GONE}
USERS = """
import sys
from numba import njit
if "ours" in sys.argv:
    import hpcwhirl.dynamics.kernels.loop.points
@njit(cache=True)
def twice(x):
    return 2.0 * x
assert twice(3.0) == 6.0
"""


@pytest.mark.parametrize("chosen", [False, True], ids=["beside", "chosen"])
def test_functions_of_others_are_cached_where_numba_puts_them(tmp_path, chosen):
    script, cache = tmp_path / "users.py", tmp_path / "chosen"
    script.write_text(USERS)
    env = BARE | ({"NUMBA_CACHE_DIR": str(cache)} if chosen else {})
    env["XDG_CACHE_HOME"] = str(tmp_path / "home")
    made = []
    for word in ("alone", "ours"):
        python(f"exec(compile(open({str(script)!r}).read(), {str(script)!r}, 'exec'))",
               word, env=env, check=True)  # fmt: skip
        made.append(sorted(tmp_path.rglob("*twice*.nbi")))
        for path in made[-1]:
            path.unlink()
    assert made[0] == made[1] != []


UNTOUCHED = """
import numba
from numba.core import caching, codegen, compiler, config, dispatcher, registry, types
from numba.core.types import functions

def told():
    values = {("config", name): repr(value) for name, value in vars(config).items()}
    for module in (caching, codegen, compiler, dispatcher, registry, functions):
        for name, owner in vars(module).items():
            if isinstance(owner, type) and not name.startswith("__"):
                for key, value in vars(owner).items():
                    if callable(value) or isinstance(value, (list, str, property)):
                        values[name, key] = repr(value)
    return values

before = told()
from hpcwhirl.dynamics.kernels.oracle import bodies
from hpcwhirl.dynamics.kernels.loop import cyclic, points, slots, whole
from hpcwhirl.dynamics.kernels.loop.flight import open_until
assert open_until(1.0, -2.0, 0.0) == 0.5
after = told()
print(sorted(key for key in before | after if before.get(key) != after.get(key)))
"""


def test_numba_is_left_as_it_is():
    assert python(UNTOUCHED, env=BARE, check=True).stdout.strip() == "[]"


def share(x, y):
    return x / y


@pytest.fixture
def variant(tmp_path):
    """Return a cache with one function in it, what it holds, and the file."""
    made = kernel(share)
    assert made(1.0, 2.0) == 0.5
    ((sig, result),) = made.overloads.items()
    cache = KernelCache(share, tmp_path)
    cache.save_overload(sig, result)
    (file,) = tmp_path.iterdir()
    return cache, (sig, result), file


def numba_context():
    return kernel(share).targetctx


def loaded(cache, sig):
    return cache.load_overload(sig, numba_context())


def test_what_is_kept_is_the_same_function(variant):
    cache, (sig, _), _ = variant
    assert loaded(cache, sig).entry_point(1.0, 4.0) == 0.25


def flipped(data, at):
    return data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :]


DAMAGE = {
    "empty": lambda _: b"",
    "cut": lambda data: data[:-1],
    "cut to half": lambda data: data[: len(data) // 2],
    "cut within the checksum": lambda data: data[:7],
    "longer": lambda data: data + b"\0",
    "a bit of the checksum": lambda data: flipped(data, 3),
    "a bit of the code": lambda data: flipped(data, len(data) // 2),
    "zeros": lambda data: bytes(len(data)),
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_damaged_code_is_deleted_and_compiled_anew(variant, damage):
    cache, (sig, result), file = variant
    data = file.read_bytes()
    file.write_bytes(DAMAGE[damage](data))
    assert loaded(cache, sig) is None
    assert not file.exists()
    cache.save_overload(sig, result)
    assert loaded(cache, sig).entry_point(1.0, 2.0) == 0.5


def give_away(path):
    if os.getuid():
        pytest.skip("only root can give a file to another user")
    os.chown(path, 65534, -1)


OTHERS = {
    "group may write": lambda path: path.chmod(path.stat().st_mode | 0o020),
    "all may write": lambda path: path.chmod(path.stat().st_mode | 0o002),
    "of another user": give_away,
}


@pytest.mark.parametrize("hand", OTHERS)
def test_code_that_another_user_can_have_written_is_not_loaded(variant, hand):
    """It is executed: a checksum can be written by anyone."""
    cache, (sig, result), file = variant
    OTHERS[hand](file)
    assert loaded(cache, sig) is None
    cache.save_overload(sig, result)
    assert loaded(cache, sig).entry_point(1.0, 2.0) == 0.5
    assert file.stat().st_mode & 0o777 == 0o600


@pytest.mark.parametrize("hand", OTHERS)
def test_a_directory_that_another_user_may_write_is_not_used(tmp_path, hand):
    env = BARE | {"NUMBA_CACHE_DIR": str(tmp_path)}
    env["HPCWHIRL_PLAIN_NUMBA"] = f"{kernel_cache.PLAIN:d}"
    python(CALL, env=env, check=True)
    (place,) = tmp_path.iterdir()
    assert place.stat().st_mode & 0o777 == 0o700
    kept = sorted(place.iterdir())
    OTHERS[hand](place)
    done = python(CALL, env=env, check=True)
    assert done.stdout.split() == ["0.5", "0"]
    (line,) = done.stderr.splitlines()
    assert f"others than its user may write {place}" in line
    assert sorted(place.iterdir()) == kept


def test_code_of_another_signature_is_not_taken(variant):
    cache, (sig, _), file = variant
    other = (numba.float32, *sig[1:])
    file.rename(cache._path(cache._key(other, numba_context().codegen())))
    assert loaded(cache, other) is None
    assert loaded(cache, sig) is None


CALL = """
from hpcwhirl.dynamics.kernels.loop.flight import open_until
print(open_until(1.0, -2.0, 0.0), sum(open_until.stats.cache_hits.values()))
"""


def test_a_process_heals_a_cache_that_is_damaged(tmp_path):
    env = BARE | {"NUMBA_CACHE_DIR": str(tmp_path)}
    env["HPCWHIRL_PLAIN_NUMBA"] = f"{kernel_cache.PLAIN:d}"  # no warning of a release

    def called():
        done = python(CALL, env=env, check=True)
        compiled = done.stderr == "hpcwhirl: compiling kernels, once per machine\n"
        assert compiled or not done.stderr
        return compiled, done.stdout.split()

    assert called() == (True, ["0.5", "0"])
    (file,) = tmp_path.rglob("*open_until*.nbc")
    file.write_bytes(b"")
    assert [called(), called()] == [(True, ["0.5", "0"]), (False, ["0.5", "1"])]


def test_code_that_cannot_be_kept_is_one_line(capsys, tmp_path):
    (tmp_path / "file").touch()
    for name in ("one", "two"):
        write_intact(tmp_path / "file" / name, b"code")
    (line,) = capsys.readouterr().err.splitlines()
    assert f"compiled code is not kept in {tmp_path / 'file'}: " in line


@pytest.mark.parametrize(
    ("release", "asked", "plain", "lines"),
    [
        ("0.68.1", "", False, 0),
        ("0.68.0rc1", "", False, 0),
        ("0.6801.0", "", True, 1),
        ("0.69.0", "", True, 1),
        ("1.0.0", "", True, 1),
        ("0.69.0", "0", False, 0),
        ("0.69.0", "1", True, 0),
        ("0.68.1", "1", True, 0),
    ],
)
def test_an_unknown_release_of_numba_is_taken_plainly(
    release, asked, plain, lines, capsys
):
    kernel_cache.tell.cache_clear()
    assert is_plain(release, asked) is plain
    assert is_plain(release, asked) is plain
    told = capsys.readouterr().err.splitlines()
    assert len(told) == lines
    assert all(f"warning: numba {release} is not one of" in line for line in told)


def test_kernels_work_with_an_unknown_release(tmp_path):
    env = BARE | {"NUMBA_CACHE_DIR": str(tmp_path)}
    pretend = "import numba; numba.__version__ = '0.99.1'\n"
    done = python(pretend + CALL, env=env, check=True)
    assert done.stdout.split() == ["0.5", "0"]
    warned, compiled = done.stderr.splitlines()
    assert re.search(r"numba 0\.99\.1 .* \(0\.68\)", warned)
    assert compiled.endswith("compiling kernels, once per machine")
    other = python(pretend + CALL, env=env | {"PMI_RANK": "1"}, check=True)
    assert (other.stdout.split(), other.stderr) == (["0.5", "1"], "")
