"""States between two motions of one scene are the states of the motion between."""

import numpy as np
import pytest

from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.march import March
from hpcwhirl.dynamics.side_by_side import copy_of, distance, put_between
from hpcwhirl.scene import apply_settings, named_scene

KINDS = {
    "modal": {},
    "exact": {"scheme": "exact"},
    "general": {"scheme": "general"},
    "elements": {"discretization": "elements"},
    "rigid": {"kind": "rigid", "amplitude": 2e-4},
    "paper": {"scheme": "paper", "rotor.elements": 1, "modes": 2},
    "turning": {"rotation": "full"},
    "turning, exact": {"rotation": "full", "scheme": "exact"},
    "whole": {
        "rotation": "full",
        "mistuning": [0.01 * (-1) ** j * j for j in range(22)],
    },
    "unbalanced": {"rotation": "full", "unbalance": 1e-3},
    "bodies": {"rotation": "full", "scheme": "general", "unbalance": 1e-3},
}


def case(**settings):
    fast = {
        "duration": 4e-3,
        "traces": "summary",
        "time_step": 2e-6,
        "plan": "everything",
    }
    return resolve(apply_settings(named_scene("mostly_damped"), fast | settings))


def marched(steps, **settings):
    march = March(case(**settings))
    march.reach(steps)
    return march


def in_contact(march):
    """March on to a step that has contact."""
    while march.counter[contact.LAST] != march.steps:
        march.advance(1)
        assert not march.done
    return march


def places(march):
    return np.concatenate(march.displacements())


def sides(settings):
    """Return two marches of one scene at the same step, one in contact, and a third."""
    one = in_contact(marched(400, **settings))
    more = {"force": 1.02 * one.scene.force}
    if one.model.casing is None:
        more = {"amplitude": 1.02 * settings["amplitude"]}
    stronger = March(case(**(settings | more)))
    stronger.advance(one.steps)
    assert stronger.steps == one.steps
    return one, stronger, March(case(**settings))


@pytest.mark.turns
@pytest.mark.parametrize("name", KINDS)
def test_a_state_between_two_motions_is_their_mean_and_moves_on(name):
    """By its places, by its distances from both, and with a ledger that closes."""
    one, other, between = sides(KINDS[name])
    a, b = copy_of(one), copy_of(other)
    far = distance(one, a, b)
    assert far > 0.0
    put_between(between, a, b, 0.0)
    near = distance(between, a, copy_of(between))
    assert near == pytest.approx(0.0, abs=1e-12 * far)
    put_between(between, a, b, 0.25)
    mean, middle = 0.75 * places(one) + 0.25 * places(other), copy_of(between)
    np.testing.assert_allclose(places(between), mean, atol=1e-12 * abs(mean).max())
    assert distance(one, a, middle) == pytest.approx(0.25 * far, rel=1e-6)
    assert distance(one, middle, b) == pytest.approx(0.75 * far, rel=1e-6)
    between.reach(between.steps + 50)
    ledger = between.history().ledger
    residual = ledger.pop("residual")
    assert abs(residual) < 1e-9 * sum(map(abs, ledger.values()))


def test_states_between_which_there_is_none_are_refused():
    march = March(case())
    rest, ended = copy_of(march), copy_of(march)
    later = rest._replace(counter=rest.counter.copy())
    later.counter[contact.STEP] += 1
    ended.counter[contact.STOP] = contact.RUNNING + 1
    other = copy_of(March(case(harmonics=4)))
    for states, told in (
        ((rest, later), "at the same step, got 0 and 1"),
        ((rest, ended), "of runs that have not ended"),
        ((rest, other), "of one scene"),
    ):
        with pytest.raises(ValueError, match=told):
            put_between(march, *states, 0.5)


@pytest.mark.parametrize("name", ["modal", "turning"])
def test_the_distance_from_rest_is_the_energy_of_a_motion(name):
    """Kinetic, as seen in the rotor's frame, plus strain: not Jacobi's energy."""
    one = in_contact(marched(400, **KINDS[name]))
    rest = March(case(**KINDS[name], force=0.0))
    rest.advance(one.steps)
    a = copy_of(one)
    energy, rotor = float(one.scheme.balance(a).energy), one.model.rotor
    if rotor.spin is not None:
        x = one.displacements()[0]
        energy += 0.5 * one.scene.speed**2 * float(x @ rotor.mass @ x)
    for pair in ((copy_of(rest), a), (a, copy_of(rest))):
        assert distance(one, *pair) ** 2 == pytest.approx(energy, rel=1e-10)


@pytest.mark.turns
def test_a_state_at_one_end_goes_on_as_that_motion():
    one, other, between = sides(KINDS["whole"])
    put_between(between, copy_of(one), copy_of(other), 0.0)
    between.reach(between.steps + 50)
    one.reach(between.steps)
    size = abs(places(one)).max()
    np.testing.assert_allclose(places(between), places(one), atol=1e-9 * size)


def test_states_of_other_steps_or_sectors_are_refused():
    one, other = marched(40), marched(41)
    with pytest.raises(ValueError, match="same step"):
        put_between(one, copy_of(one), copy_of(other), 0.5)
    few = marched(40, blades=21)
    with pytest.raises(ValueError, match="one scene"):
        distance(one, copy_of(one), copy_of(few))
