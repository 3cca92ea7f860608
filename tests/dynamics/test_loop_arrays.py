"""The loop of waves reads unchecked: sizes and indices are checked before it begins."""

import numpy as np
import pytest

from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.kernels.loop.bounded import points_space
from hpcwhirl.dynamics.kernels.loop.slot_steps import slot_space
from hpcwhirl.dynamics.march import March
from hpcwhirl.errors import ModelError
from hpcwhirl.scene import apply_settings, named_scene

SMALL = {"blades": 5, "modes": 10, "casing.harmonics": 3, "time_step": 2e-6}
UNEQUAL = {"mistuning": [0.01, -0.02, 0.03, 0.0, 0.01]}
HELD = {"rotation": "full", "stiffness_difference": 5e6}


def arrays_of(**given):
    scheme = March(resolve(apply_settings(named_scene("table2"), SMALL | given))).scheme
    return scheme.arrays, scheme.state


def with_rows(arrays, name, values):
    rows = arrays.rotor.rows._replace(**{name: values})
    return arrays._replace(rotor=arrays.rotor._replace(rows=rows))


@pytest.mark.parametrize(
    "name", ["free", "pushed", "fixed", "along", "energy", "turns"]
)
@pytest.mark.parametrize("scheme", ["modal", "exact"])
def test_a_table_by_slot_of_another_size_is_refused(name, scheme):
    arrays, state = arrays_of(scheme=scheme)
    short = getattr(arrays.rotor.rows, name)[:-1].copy()
    slot_space(arrays, state)
    with pytest.raises(ModelError, match=rf"{name} of the kernel of slots: \d+ values"):
        slot_space(with_rows(arrays, name, short), state)


@pytest.mark.parametrize("beyond", [-1, 10**6])
def test_an_index_outside_the_amplitudes_is_refused(beyond):
    arrays, state = arrays_of()
    rotor = arrays.rotor._replace(centre=np.full_like(arrays.rotor.centre, beyond))
    with pytest.raises(ModelError, match=f"centre of the kernel of slots: {beyond} to"):
        slot_space(arrays._replace(rotor=rotor), state)


def test_supports_of_another_rotor_are_refused():
    arrays, state = arrays_of(**HELD)
    support = arrays.rotor.support._replace(gives=np.zeros(8))
    rotor = arrays.rotor._replace(support=support)
    with pytest.raises(ModelError, match="gives of the kernel of slots: 8 values"):
        slot_space(arrays._replace(rotor=rotor), state)


@pytest.mark.parametrize("name", ["read", "before", "push"])
def test_a_table_by_point_of_another_size_is_refused(name):
    arrays, state = arrays_of(**UNEQUAL)
    short = getattr(arrays.rotor.rows, name)[:-1].copy()
    with pytest.raises(ModelError, match=f"{name} of the kernel of points"):
        points_space(with_rows(arrays, name, short), state)
