"""A motion put between two equal ones is that motion, in steady contact, too."""

import numpy as np
import pytest

from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.march import March
from hpcwhirl.dynamics.side_by_side import copy_of, distance, put_between
from hpcwhirl.scene import apply_settings, named_scene

RUB = {
    "rotation": "full", "blades": 9, "modes": 54, "unbalance": 0.074, "gap": 7e-5,
    "friction": 0.012, "speed": 367.0, "suspension_damping": 0.18, "force": 0.0,
    "duration": 0.1, "traces": "summary", "plan": "everything", "accuracy": 0.03,
}  # fmt: skip
SCHEMES = {
    "waves by slot": {},
    "waves of points": {"rotor.mistuning": [0.01 * (-1) ** j for j in range(9)]},
    "bodies": {"scheme": "general"},
}


@pytest.mark.turns
@pytest.mark.parametrize("name", SCHEMES)
def test_a_motion_between_equal_ones_goes_on_as_they_do(name):
    case = resolve(apply_settings(named_scene("four_motions"), RUB | SCHEMES[name]))
    one, other = March(case), March(case)
    for march in (one, other):
        march.coast, march.watched = None, 0
    one.reach(one.total // 2 // one.beat * one.beat, None)
    state = copy_of(one)
    assert state.counter[contact.LAST] > state.counter[contact.STEP] - one.beat
    other.put(copy_of(one))
    put_between(other, state, state, 0.3)
    one.put(state)
    for march in (one, other):
        march.reach(march.steps + 5, None)
    size = np.sqrt(one.scheme.balance(copy_of(one)).energy)
    assert distance(one, copy_of(one), copy_of(other)) < 1e-11 * size
    assert one.counter[contact.LAST] == other.counter[contact.LAST]
