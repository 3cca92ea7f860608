"""What the table of schemes tells of each is what it does."""

import math

import numpy as np
import pytest

from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.march import March
from hpcwhirl.errors import InputError
from hpcwhirl.scene import apply_settings, named_scene
from hpcwhirl.scene.schemes import DEFAULT, NAMES, SCHEMES


def scene(**settings):
    quiet = {"duration": 2e-3, "interval": 1e-3, "gap": 0.05, "traces": "summary"}
    return apply_settings(named_scene("table2"), quiet | settings)


def refuses(given):
    try:
        March(resolve(given))
    except InputError:
        return True
    return False


def ended(**settings):
    march = March(resolve(scene(**settings)))
    march.advance(10**9)
    return march


def test_names_are_those_that_campaigns_are_written_with():
    assert NAMES == ("modal", "exact", "general", "paper")
    assert DEFAULT == "modal"


@pytest.mark.parametrize("name", NAMES)
def test_what_folds_flies_and_is_handed_over_or_refused_is_as_told(name):
    known = SCHEMES[name]
    two = March(resolve(scene(scheme=name, nodal_diameter=2)))
    assert (two.lean.model.folds == 2) == known.folds
    other = resolve(scene(scheme=name, discretization="elements"))
    assert (other.handed_over != "") == known.cyclic
    assert refuses(scene(scheme=name, families="bending")) == known.matrices


@pytest.mark.parametrize("name", [n for n in NAMES if SCHEMES[n].folds])
def test_flights_are_those_of_schemes_that_fly(name):
    march = ended(scheme=name, duration=4e-3)
    assert (march.counter[contact.JUMPED] > 0) == SCHEMES[name].flies


@pytest.mark.parametrize("name", [n for n in NAMES if SCHEMES[n].order < math.inf])
def test_the_error_of_a_motion_is_of_the_order_told(name):
    exact = next(n for n, known in SCHEMES.items() if known.flies)
    smooth = {"pulse": 2e-3, "duration": 3e-3}  # a short pulse rings at all lengths
    _, true = ended(scheme=exact, time_step=1.25e-7, **smooth).displacements()
    errors = []
    for step in (2e-6, 1e-6):
        _, found = ended(scheme=name, time_step=step, **smooth).displacements()
        errors.append(np.abs(found - true).max() / np.abs(true).max())
    assert math.log2(errors[0] / errors[1]) == pytest.approx(
        SCHEMES[name].order, abs=0.05
    )
