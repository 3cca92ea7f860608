"""Engines in operation with all else: laws of time, shapes and features drawn together.

Each scene is marched by every scheme that takes it. With intervals of one step the
schemes of central differences are one up to round-off, and the ledger closes.
"""

import math
import random
import re

import numpy as np
import pytest
from cf_units import Unit
from scenes import BASE, FULL, HEAD, SHELL, UNEQUAL, of_files

from hpcwhirl.campaign.simulate import simulate
from hpcwhirl.case import speed
from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.march import March
from hpcwhirl.errors import InputError
from hpcwhirl.scene import Scene, apply_settings, flatten, named_scene
from hpcwhirl.scene.quantities import INPUTS, ROW, WORN

SHORT = BASE | {"interval": 5e-5}
LAWS = {
    "constant": {},
    "run-up": {"acceleration": 2000.0},
    "decay": {"acceleration": -3000.0, "ramp": "decay", "speed_to": 100.0},
    "smooth": {"acceleration": 3000.0, "ramp": "smooth", "speed_to": 310.0},
    "table": {"speed_table": "time,speed;0,300;0.002,310;0.004,305"},
    "clockwise": {"acceleration": -2000.0, "speed": -300.0},
    "gap": {"gap_closure": 6e-5, "gap_time": 3e-3},
    "gap by table": {"gap_table": "time,gap;0,1e-4;0.002,5e-5;0.005,7e-5"},
    "both": {"acceleration": 1500.0, "gap_closure": 4e-5, "gap_time": 3e-3},
}
SHAPES = {
    "round": {},
    "held": {"profile": f"{HEAD};2,2e-5,0.4;5,4e-6,0.9;9,3e-6,0.7", "offset": 1e-5,
             "offset_angle": 0.7},
    "fading in": {"profile": f"{HEAD};2,1e-4,0.4;3,2e-5,0.9;9,1e-5,0.7",
                  "profile_rise": 1e-3},
}  # fmt: skip
FEATURES = {
    "start": {"start_energy": 5.0, "start_modes": "rotor suspension, casing 2",
              "start_draw": 3.0, "force": 0.0},
    "start and pulse": {"start_energy": 3.0, "start_modes": "rotor, casing"},
    "shell": SHELL,
    "elements": {"discretization": "elements", "casing.elements": 14},
    "rigid": {"kind": "rigid", "amplitude": 1.2e-4, "nodal_diameter": 2},
    "unbalance": FULL | {"unbalance": 5e-3, "unbalance_phase": 0.3},
    "film": FULL | {"film_viscosity": 0.01},
    "unequal supports": FULL | {"stiffness_difference": 1.2e7,
                                "damping_difference": 1200.0},
    "bearing": FULL | {"bearing": ("3.4e7", "3.0e7")},
    "bearing alike": FULL | {"bearing": ("3.4e7", "3.4e7")},
    "cross-coupling": FULL | {"cross_coupling": 1e6},
    "film, cross-coupling": FULL | {"film_viscosity": 0.01, "cross_coupling": 3e6,
                                    "unbalance": 5e-3, "unbalance_phase": 0.3},
    "unequal": UNEQUAL,
    "unequal, rotation": FULL | UNEQUAL,
    "unequal, film": FULL | UNEQUAL | {"film_viscosity": 0.01},
    "unequal, unbalance": FULL | UNEQUAL | {"unbalance": 5e-3},
    "elements, unbalance": FULL | {"discretization": "elements",
                                   "casing.elements": 14, "unbalance": 5e-3},
    "rigid, unbalance": FULL | {"kind": "rigid", "amplitude": 1.2e-4,
                                "nodal_diameter": 2, "unbalance": 5e-3},
    "lost blade": FULL | {"lost_blade": 2},
    "shaft": FULL | {"shaft": "cantilever"},
    "clamped": {"centre": "clamped"},
    "points": SHELL | {"file": "still", "blades": 5, "nodal_diameter": 2},
    "points, rotation": FULL | {"file": "turning", "blades": 5, "nodal_diameter": 2,
                                "unbalance": 2e-4},
}  # fmt: skip
OFTEN = [
    ("both", "held", "start"),
    ("run-up", "fading in", "points"),
    ("gap", "held", "unequal, rotation"),
    ("decay", "held", "unequal"),
]
SLOWER = {"friction_law": "stribeck", "friction_speed": 80.0}
SCALED = [  # a law of time, a shape, a feature, and what else is set
    ("both", "held", "start", {}),
    ("run-up", "held", "unequal, rotation", {"cross_coupling": 1e6}),
    ("constant", "fading in", "unbalance", {"contact_law": "archard"}
     | SLOWER),
    ("gap by table", "round", "film", {"contact_law": "abradable"}),
    ("table", "round", "rigid", {}),
]  # fmt: skip
LARGER = {"m": 2.0**3, "kg": 2.0**-6, "s": 2.0**2}  # units, in SI
TABLES = {  # {input: units of its columns}
    "profile": ("1", "m", "rad"), "speed_table": ("s", "rad/s"),
    "gap_table": ("s", "m"),
}  # fmt: skip
NEAR = 1e-9  # of the largest value, between schemes


def settings(place, law, shape, feature):
    """Return the inputs of a scene, with its files written."""
    return SHORT | of_files(LAWS[law] | SHAPES[shape] | FEATURES[feature], place)


def agree(given):
    """Compare the schemes that take a scene; return their histories, but `exact`'s."""
    found = []
    for scheme in ("paper", "general", "modal", "exact"):
        scene = named_scene("table2")
        try:
            march = March(resolve(apply_settings(scene, given | {"scheme": scheme})))
        except InputError as refused:
            if "\n" in str(refused):
                raise AssertionError(scheme) from refused
            continue
        found.append((scheme, march.run()))
    for scheme, history in found:
        ledger = dict(history.ledger)
        residual = abs(ledger.pop("residual"))
        work = sum(map(abs, ledger.values()))
        assert residual <= 1e-11 * work + history.blur[0], scheme
        assert history.gap_error < 1e-12, scheme
    central = [history for scheme, history in found if scheme != "exact"]
    for other in central[1:]:
        assert other.contacts == central[0].contacts
        for name in ("tips", "centre", "casing", "energy"):
            a, b = getattr(central[0], name), getattr(other, name)
            if a.shape == b.shape:  # of `paper`, a ring of other coordinates
                blur = central[0].blur[0] if name == "energy" else 0.0
                assert np.abs(a - b).max() <= NEAR * np.abs(a).max() + blur, name
    return central


@pytest.fixture(autouse=True)
def _intervals_of_one_step(monkeypatch):
    monkeypatch.setattr(speed, "USUAL", 1e-13)


@pytest.mark.turns
@pytest.mark.parametrize(("law", "shape", "feature"), OFTEN)
def test_schemes_agree_on_engines_in_operation(tmp_path, law, shape, feature):
    assert len(agree(settings(tmp_path, law, shape, feature))) >= 2


def of_unit(unit):
    """Return how many of a unit, such as N s/m, are one in the units `LARGER`."""
    parts = re.findall(r"([a-z]+)(-?\d*)", Unit(unit).definition)
    return math.prod(LARGER.get(name, 1.0) ** int(power or 1) for name, power in parts)


def in_larger_units(given):
    """Return all inputs of a scene as numbers of the units `LARGER`."""
    return {name: _in_larger(name, value) for name, value in flatten(given).items()}


def _in_larger(name, value):
    units = TABLES.get(name.rpartition(".")[2], ())
    if units and value:
        head, *rows = value.split(";")
        factors = np.array([of_unit(unit) for unit in units])
        numbers = [np.array(row.split(","), dtype=float) / factors for row in rows]
        return ";".join([head, *(",".join(map(repr, n.tolist())) for n in numbers)])
    return value / of_unit(INPUTS[name].unit) if isinstance(value, float) else value


@pytest.mark.turns
@pytest.mark.parametrize(("law", "shape", "feature", "more"), SCALED)
def test_no_result_depends_on_the_units(tmp_path, law, shape, feature, more):
    """Of length, mass and time; powers of 2, which round nothing."""
    given = settings(tmp_path, law, shape, feature) | {"scheme": "modal"} | more
    scene = apply_settings(named_scene("table2"), given)
    one = simulate(scene).row
    other = simulate(apply_settings(Scene(), in_larger_units(scene))).row
    assert one["contacts"] > 0
    energy = max(abs(one[f"ledger_{term}"]) for term in ("energy", "damping"))
    for name, quantity in (ROW | WORN).items():
        if isinstance(value := one.get(name), float):
            most = energy if quantity.unit == "J" else abs(value)
            found = other[name] * (of_unit(quantity.unit) if value != -1.0 else 1.0)
            assert found == pytest.approx(value, abs=1e-7 * most + 1e-12), name
        elif value is not None:
            assert other[name] == value, name


@pytest.mark.evidence
@pytest.mark.timeout(3000)
@pytest.mark.parametrize("seed", range(4))
def test_schemes_agree_on_drawn_engines_in_operation(tmp_path, seed):
    """Refused in one line, or alike: 20 scenes a seed."""
    chance, compared = random.Random(seed), 0
    for _ in range(20):
        drawn = [chance.choice(list(table)) for table in (LAWS, SHAPES, FEATURES)]
        try:
            compared += len(agree(settings(tmp_path, *drawn))) >= 2
        except AssertionError as failed:
            raise AssertionError(drawn) from failed
    assert compared >= 10
