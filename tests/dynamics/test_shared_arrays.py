"""What cases share as they are built: never a bit of what another one gives."""

import numpy as np
import pytest

from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.march import March
from hpcwhirl.dynamics.schemes import equal_sectors
from hpcwhirl.dynamics.waves import slots
from hpcwhirl.scene import Scene, apply_settings


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
    for module, names in (
        (slots, ("_lobes", "_rotor", "_ring")),
        (equal_sectors, ("_ring_waves", "_ring_pairs", "_rotor_pairs", "_laid_pairs")),
    ):
        for name in names:
            getattr(module, name).cache_clear()


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
