"""What is compiled, and when: no waiting for compilers, and nothing stale."""

import io
import re

import pytest
from rich.console import Console

from hpcwhirl.case.resolve import resolve
from hpcwhirl.cli import bench
from hpcwhirl.dynamics.kernels import cyclic, passes
from hpcwhirl.dynamics.march import March
from hpcwhirl.scene import apply_settings, named_scene
from hpcwhirl.scene.schemes import NAMES

MARCHES = {"modal": cyclic.march_differences, "exact": cyclic.march_flow}
PRETEND = """
import os, pathlib, sys
cache = pathlib.Path(os.environ["NUMBA_CACHE_DIR"])
for word in ["all", *sys.argv[2:]]:
    (cache / f"{word}.nbc").touch()
"""


@pytest.mark.parametrize("scheme", MARCHES)
def test_a_new_size_compiles_nothing(scheme):
    for settings in (
        {},
        {"blades": 8, "modes": 40, "harmonics": 5},
        {"blades": 13, "modes": 52, "kind": "rigid"},
        {"traces": "full", "nodal_diameter": 3},
    ):
        short = {"scheme": scheme, "plan": "everything", "duration": 1e-3}
        scene = apply_settings(named_scene("table2"), short | settings)
        March(resolve(scene)).advance(20)
        assert len(MARCHES[scheme].signatures) == 1


def test_a_part_is_no_function_of_python():
    # it has no entry for Python: called, it would jump to nowhere
    with pytest.raises(TypeError, match="flush is for compiled code alone"):
        cyclic.flush(passes.packed)


def test_starts_are_told_with_what_they_compiled(monkeypatch):
    # a program in the place of ten steps: one function, and one for each new size
    monkeypatch.setattr(bench, "START", PRETEND)
    found = bench.start_of("modal")
    new = len(bench.STARTS["new_size"])
    counts = [found[f"{name}_compiled"] for name in bench.STARTS]
    assert (found["scheme"], counts) == ("modal", [1, new, 0])
    for name in bench.STARTS:
        assert found[f"{name}_seconds"] > 0
        assert found[f"{name}_processor_seconds"] >= 0
    out = io.StringIO()
    Console(file=out, width=120).print(bench._table_of_starts([found]))
    assert f"1, {new}, 0" in out.getvalue()
    assert len(re.findall(r"\d\.\d \(\d\.\d\)", out.getvalue())) == len(bench.STARTS)


@pytest.mark.slow
@pytest.mark.parametrize("scheme", NAMES)
def test_a_start_with_a_full_cache_compiles_nothing(scheme):
    found = bench.start_of(scheme)
    assert found["cold_compiled"] > 10
    assert found["new_size_compiled"] == 0
    assert found["warm_compiled"] == 0
