"""What cases share as they are built: never a bit of what another one gives."""

import numpy as np
import pytest

from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics import slots
from hpcwhirl.dynamics.kernels import contact, cyclic, passes
from hpcwhirl.dynamics.kernels.cyclic import widths
from hpcwhirl.dynamics.march import March
from hpcwhirl.scene import Scene, apply_settings, named_scene


def drawn(friction, speed, scheme):
    return March(resolve(apply_settings(Scene(), {
        "friction": friction, "speed": speed, "solver.scheme": scheme,
        "duration": 0.01,
    })))  # fmt: skip


def bits(value):
    if isinstance(value, tuple | list):
        return [b for part in value for b in bits(part)]
    return [np.asarray(value).tobytes()]


def forget():
    names = "_rubbed", "_rubbed_ring", "_packed_ring", "_lobes", "_ring_column"
    for name in names:
        getattr(slots, name).cache_clear()


@pytest.mark.parametrize("scheme", ["modal", "exact"])
def test_arrays_do_not_tell_which_cases_came_before(scheme):
    cases = [(0.0, 300.0), (0.0, -300.0), (0.1, 300.0), (0.1, -300.0), (0.1, 410.0)]
    alone = []
    for case in cases:
        forget()
        alone.append(bits(drawn(*case, scheme).scheme.arrays))
    forget()
    after = [bits(drawn(*case, scheme).scheme.arrays) for case in cases]
    assert after == alone
    assert len({repr(case) for case in alone}) == len(cases)


@pytest.mark.parametrize("scheme", ["modal", "exact"])
def test_a_march_writes_nothing_that_cases_share(scheme):
    march = drawn(0.1, 410.0, scheme)
    before = bits(march.scheme.arrays)
    march.run()
    assert march.counter[contact.TOUCHDOWNS] > 0
    assert bits(march.scheme.arrays) == before
    assert bits(drawn(0.1, 410.0, scheme).scheme.arrays) == before


@pytest.mark.parametrize("scheme", ["modal", "exact"])
def test_slots_without_a_mode_are_passed_over(scheme, monkeypatch):
    # 13 harmonics on 22 blades: of four rows of slots, two hold one harmonic each
    settings = {"scheme": scheme, "duration": 4e-3, "harmonics": 13, "gap": 5e-5}
    scene = apply_settings(named_scene("table2"), settings)
    march = March(resolve(scene))
    k, _ = widths(22)
    rows = len(march.state.ring) // (passes.RING_STATE * k)
    filled = passes.filled_rows(march.scheme.arrays.casing.items, k)
    assert filled.min() < filled.max() == rows
    march.advance(march.total)
    every = lambda _, k: np.full(k // 4, rows)  # noqa: E731
    monkeypatch.setattr(cyclic, "filled_rows", every)
    whole = March(resolve(scene))
    whole.advance(march.total)
    assert march.counter[contact.TOUCHED] > 0
    for one, other in zip(march.state, whole.state, strict=True):
        np.testing.assert_array_equal(one, other)
