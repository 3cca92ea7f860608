"""Compiled code under the names of its own sizes, whoever compiles beside it."""

import pytest
from numba.core.caching import IndexDataCacheFile

import hpcwhirl.dynamics.kernels  # noqa: F401 - it keeps what numba compiles apart

SIZES = ("12 blades", "22 blades")


class Beside(IndexDataCacheFile):
    """A process in which another one saves just as it writes its code.

    The other has read the index before.
    """

    other = None
    early = False

    def _load_index(self):
        return {} if self.early else super()._load_index()

    def _save_data(self, name, data):
        if self.other is not None:
            other, self.other = self.other, None
            other.early = True
            other.save("12 blades", "code of 12 blades")
            other.early = False
        super()._save_data(name, data)


@pytest.fixture
def caches(tmp_path):
    return [Beside(str(tmp_path), "kernel", "stamp") for _ in range(2)]


def test_no_index_names_code_of_another_size(caches):
    one, one.other = caches
    other = one.other
    one.save("22 blades", "code of 22 blades")
    for size in SIZES:
        assert other.load(size) in {f"code of {size}", None}  # None: compiled again
    for size in SIZES:
        one.save(size, f"code of {size}")
    assert [other.load(size) for size in SIZES] == [f"code of {s}" for s in SIZES]


def test_the_index_names_nothing_that_is_not_there(caches, monkeypatch):
    one, other = caches
    seen = []

    def look(self, index):
        seen.extend(self._load_data(name) for name in index.values())

    monkeypatch.setattr(Beside, "_save_index", look)
    one.save("22 blades", "code")
    assert seen == ["code"]
    assert other.load("22 blades") is None
