"""Laws of engines whose disk sits on a shaft line: old shafts, whole rotors, files."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from shafts import SECTIONS_AND_DISK

from hpcwhirl.errors import InputError
from hpcwhirl.reduction.bodies import rotor_model
from hpcwhirl.reduction.shaft_whirl import held_by, whirls
from hpcwhirl.reduction.waves import wave_lines
from hpcwhirl.scene import Rotor
from hpcwhirl.scene.documents import scene_of_document
from hpcwhirl.scene.shaft_tables import shaft_text, text_of
from hpcwhirl.structure import bladed_disk
from hpcwhirl.structure.mount import reduced
from hpcwhirl.structure.shaft import (
    AddedMass,
    ShaftDisk,
    ShaftLine,
    added_matrix,
    line_of,
)

LIGHT, RIGID = 1e-4, 1e12  # kg/m^3, N/m
FAN = {"blades": 7, "elements": 4, "suspension_damping": -1.0, "damping": 0.0}


def table(**changes: Any) -> dict[str, Any]:
    """Return the table of a shaft on three bearings, with a disk, and dampers."""
    usual: dict[str, Any] = {
        **SECTIONS_AND_DISK,
        "bearings": [
            {"station": 0, "kxx": 4e7, "cxx": 2e3},
            {"station": 1, "kxx": 6e7, "cxx": 5e3, "kxy": 1e6, "kyx": -1e6},
            {"station": 3, "kxx": 3e7},
        ],
    }
    return usual | changes


def rotor(line: dict[str, Any], **changes: Any) -> Rotor:
    """Return a small bladed disk on a shaft line."""
    return Rotor(**FAN | {"shaft": text_of(line, "line")} | changes)


def static_lines(own: Rotor, speed: float, eta: int = 14) -> np.ndarray:
    """Return frequency and growth of the waves of k = 1, sorted, (n, 2)."""
    model = rotor_model(own, eta, "full")
    lines = [w for w in wave_lines(model, own.blades, speed) if w.nodal_diameter == 1]
    return np.array(sorted((w.static, w.growth) for w in lines))


@pytest.mark.parametrize("speed", [0.0, 250.0, -250.0])
def test_a_massless_line_on_rigid_bearings_is_the_old_shaft(speed):
    """Two bearings and an overhang, as a line whose mass is next to none."""
    section = {"outer": 0.1, "young": 2.1e11, "shear": 1e20, "density": LIGHT}
    line = {
        "sections": [section | {"length": 0.6}, section | {"length": 0.4}],
        "bearings": [{"station": i, "kxx": RIGID, "cxx": 0.0} for i in (0, 1)],
    }
    old = Rotor(**FAN, shaft="two bearings", shaft_diameter=0.1)
    new = rotor(line, shaft_station=2, shaft_modes=0)
    expected = static_lines(old, speed)
    assert static_lines(new, speed)[:, 0] == pytest.approx(expected[:, 0], rel=1e-4)


OVAL = {"kxx": 4e7, "kyy": 7e7, "kxy": 2e6, "kyx": 3e5, "cxx": 5e3, "cyy": 2e3}
APART = [{"station": 0, **OVAL}, {"station": 1, **OVAL, "kyy": 5e7}]


@pytest.mark.parametrize("bearings", [{}, {"bearings": APART}], ids=["alike", "apart"])
@pytest.mark.parametrize("speed", [0.0, 300.0, -300.0])
def test_shaft_modes_tend_to_those_of_a_rigid_disk_as_blades_stiffen(speed, bearings):
    """Frequencies and growth beside those of the unreduced line with a rigid disk."""
    own = rotor(table(**bearings), young=2.1e18, shaft_station=3, shaft_modes=12)
    line = line_of(own.shaft)
    disk = bladed_disk(own)
    moved = np.zeros(len(disk.mass))
    for j in range(own.blades):  # a translation of the whole disk along x
        angle = 2 * np.pi * j / own.blades
        nodes = j * disk.sector_size + 3 * np.arange(own.elements + 1)
        moved[nodes], moved[nodes + 1] = np.cos(angle), -np.sin(angle)
    moved[disk.centre[0]] = 1.0
    mass = float(moved @ disk.mass @ moved)
    mount = disk.mount
    assert mount is not None
    bare = Rotor(**FAN | {"shaft": "cantilever", "young": 2.1e18})
    held = bladed_disk(bare).mount
    assert held is not None
    rigid = ShaftDisk(line.stations[3], mass, held.gyro[1, 1], held.mass[1, 1])
    whole = ShaftLine(
        line.tubes, (*line.disks, rigid), line.pedestals, supports=line.supports
    )
    found = static_lines(own, speed, 7)
    for whirl in whirls(whole, held_by(whole), speed)[:6]:
        sense = 1.0 if whirl.is_anticlockwise == (speed >= 0.0) else -1.0
        wanted = np.array([sense * whirl.frequency, whirl.growth])
        if speed == 0.0 or bearings:  # of an ellipse, the sense is a name
            away = np.abs(np.abs(found) - np.abs(wanted)).sum(axis=1)
        else:
            away = np.abs(found - wanted).sum(axis=1)
        assert away.min() < 2e-4 * whirl.frequency


def test_a_rotor_taken_as_a_whole_has_the_waves_of_equal_sectors():
    own = rotor(table(viscous=1e-5), shaft_station=1)
    other = own.model_copy(update={"mistuning": (1e-12,) * 7})
    one, two = static_lines(own, 300.0), static_lines(other, 300.0)
    assert len(one) == len(two)
    low = np.abs(one[:, 0]) < 4000.0  # above, the two bases differ
    assert low.sum() > 8
    assert two[low] == pytest.approx(one[low], rel=2e-4, abs=0.01)


def saved_by_ross(**changes: Any) -> dict[str, Any]:
    """Return a rotor as ROSS 2 saves it: two elements, a disk, a bearing, a seal.

    A pedestal stands below the bearing at node 2.
    """
    material = {"name": "Steel", "rho": 7810.0, "E": 2.11e11, "G_s": 8.12e10}
    element = {
        "L": 0.25, "idl": 0.0, "odl": 0.05, "idr": 0.0, "odr": 0.05, "axial_force": 0,
        "torque": 0, "shear_effects": True, "rotary_inertia": True,
        "gyroscopic": True, "shear_method_calc": "cowper", "alpha": 0.0, "beta": 0.0,
        "material": material,
    }  # fmt: skip
    bearing = {key: [0] for key in ("kxy", "kyx", "cxy", "cyx", "mxx", "myy", "kzz")}
    bearing |= {"kxx": [1e7], "kyy": [1e7], "cxx": [200.0], "cyy": [200.0]}
    return {
        "ross_version": "2.3.0", "parameters": {},
        "ShaftElement_a": element | {"n": 0, "tag": "a"},
        "ShaftElement_b": element | {"n": 1, "odr": 0.06, "tag": "b"},
        "DiskElement_d": {"n": 1, "m": 3.0, "Id": 0.01, "Ip": 0.02, "tag": "d"},
        "BearingElement_left": bearing | {"n": 0, "tag": "left"},
        "SealElement_right": bearing
        | {"n": 2, "tag": "right", "n_link": 3, "frequency": [0.0, 500.0],
           "kxx": [1e7, 2e7], "kyy": [1e7, 2e7], "cxx": [2e2, 1e2],
           "cyy": [2e2, 1e2], "kxy": [0, 0],
           "kyx": [0, 0], "cxy": [0, 0], "cyx": [0, 0]},
        "BearingElement_foot": bearing | {"n": 3, "tag": "foot"},
        "PointMass_p": {"n": 3, "m": 5.0, "mx": 5.0, "my": 5.0, "tag": "p"},
    } | changes  # fmt: skip


def test_a_rotor_saved_by_ross_is_read_whole(tmp_path):
    path = tmp_path / "rotor.json"
    path.write_text(json.dumps(saved_by_ross()))
    line = line_of(shaft_text(str(path)))
    assert (line.nodes, line.size, line.pedestals) == (3, 7, (5.0,))
    assert line.disks == (ShaftDisk(1, 3.0, 0.02, 0.01),)
    assert [(own.at, own.to, len(own.rows)) for own in line.supports] == [
        (0, -1, 1), (6, -1, 1), (4, 6, 2),
    ]  # fmt: skip
    assert line.tubes[1].outer == (0.05, 0.06)
    document = {"engine": {"rotation": "full", "shaft": str(path), "station": 1}}
    rotor = scene_of_document(document).engine.rotor
    assert (rotor.shaft_station, line_of(rotor.shaft)) == (1, line)
    growth = static_lines(rotor.model_copy(update=FAN), 200.0)[:, 1]
    assert (growth < 1e-6).all()


def as_ross_3(given: dict[str, Any]) -> dict[str, Any]:
    """Return a rotor of ROSS 2 as ROSS 3.1 saves it."""
    out: dict[str, Any] = {"_note": "generated by ROSS"} | given
    out["ross_version"] = "3.1.0"
    for name, own in given.items():
        if name.startswith("ShaftElement"):
            out[name] = {k: v for k, v in own.items() if k not in {"alpha", "beta"}}
        if name.startswith(("BearingElement", "SealElement")):
            table = {k: v for k, v in own.items() if k != "frequency"}
            speed = {"speed": own["frequency"]} if "frequency" in own else {}
            more = {"interpolation": "pchip", "radial_clearance": None}
            out[name] = table | speed | more
    return out


def test_a_rotor_saved_by_ross_3_is_that_saved_by_ross_2(tmp_path):
    (tmp_path / "two.json").write_text(json.dumps(saved_by_ross()))
    (tmp_path / "three.json").write_text(json.dumps(as_ross_3(saved_by_ross())))
    two, three = (shaft_text(str(tmp_path / f"{n}.json")) for n in ("two", "three"))
    assert two == three


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        (
            {
                "SealElement_right": {
                    "interpolation": "linear",
                    "frequency": [0, 1, 2],
                    "kxx": [1, 1, 1],
                }
            },
            "interpolation = 'linear' is not modelled, only pchip",
        ),
        ({"GearElement_g": {"n": 1}}, "'GearElement_g' is not modelled"),
        ({"MagneticBearingElement_m": {}}, "'MagneticBearingElement_m' is not"),
        ({"ShaftElement_a": {"axial_force": 9.0}}, "axial_force = 9.0 is not modelled"),
        ({"ShaftElement_a": {"beta": 1e-5}}, "beta = 1e-05 is not modelled"),
        ({"BearingElement_left": {"mxx": [2.0]}}, "'left': mxx must equal myy, got 2"),
        (
            {"SealElement_right": {"mxx": [2.0, 3.0], "myy": [2.0, 3.0]}},
            "'right': mxx must be one number, .*: added mass over the speed",
        ),
        ({"DiskElement_d": {"n": 9}}, "'d' must be at a node of the shaft, 0 to 2"),
        ({"PointMass_p": {"n": 4}}, "linked to node 3, which has no PointMass"),
        ({"ShaftElement_b": {"n": 4}}, "must follow each other from node 0"),
    ],
)
def test_what_a_rotor_of_ross_has_that_is_not_modelled_is_refused(
    tmp_path, changed, told
):
    given = saved_by_ross()
    for name, values in changed.items():
        given[name] = given.get(name, {}) | values
    path = tmp_path / "rotor.json"
    path.write_text(json.dumps(given))
    with pytest.raises(InputError, match=f"shaft: rotor.json: .*{told}") as caught:
        scene_of_document(
            {"engine": {"rotation": "full", "shaft": "rotor.json"}}, folder=tmp_path
        )
    assert len(str(caught.value).splitlines()) == 1


def test_unequal_bearings_are_taken_at_their_mean_where_a_table_asks_for_it(tmp_path):
    unequal = {"kyy": [3e7], "kxy": [4e6], "kyx": [1e6], "mxx": [5.0], "myy": [1.0]}
    given = saved_by_ross()
    given["BearingElement_left"] |= unequal
    (tmp_path / "rotor.json").write_text(json.dumps(given))
    shaft = {"file": "rotor.json", "station": 2, "unequal": "mean"}
    document = {"engine": {"rotation": "full", "shaft": shaft}}
    rotor = scene_of_document(document, folder=tmp_path).engine.rotor
    assert line_of(rotor.shaft).supports[0].rows[0][1:5] == (2e7, 1.5e6, -1.5e6, 2e7)
    assert line_of(rotor.shaft).added == (AddedMass(0, -1, 3.0),)


FLUID = 9.0  # kg, at a station with a disk


@pytest.mark.parametrize("speed", [0.0, 250.0, -250.0])
def test_an_added_mass_moves_as_a_disk_without_inertia_and_weighs_nothing(speed):
    held = table()["bearings"]
    wet = table(bearings=[held[0], held[1] | {"mxx": "9 kg"}, held[2]])
    disks = [*table()["disks"], {"station": 1, "mass": FLUID}]
    one, two, dry = (
        rotor(line, shaft_station=3) for line in (wet, table(disks=disks), table())
    )
    found, same, without = (static_lines(own, speed) for own in (one, two, dry))
    assert found == pytest.approx(same, rel=1e-9, abs=1e-6)
    assert np.abs(found - without).max() > 0.1
    lines = [line_of(own.shaft) for own in (one, two, dry)]
    assert [line.mass - lines[2].mass for line in lines] == [0.0, FLUID, 0.0]
    loads = [reduced(line, 3, 2).weight.sum() for line in lines]
    assert loads[0] == pytest.approx(loads[2], rel=1e-12)


def test_an_added_mass_between_shaft_and_pedestal_moves_with_their_difference():
    foot = {"pedestal_mass": 20.0, "pedestal_kxx": 1e8}
    held = table()["bearings"]
    line = line_of(text_of(table(bearings=[held[0] | foot | {"mxx": 3.0}, *held[1:]]),
                           "line"))  # fmt: skip
    (one,) = line.added
    moved = np.zeros(line.size)
    moved[[one.at, one.to]] = 2.0, 0.5
    assert moved @ added_matrix(line) @ moved == pytest.approx(3.0 * 1.5**2)


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"mxx": -1.0}, "bearing 1: mxx must be a number >= 0, got -1"),
        ({"mxx": "2 m"}, "mxx must be in kg"),
        ({"mxx": 1.0, "myx": 2.0}, "myx must be 0, got 2: added mass acts along x"),
        ({"mxx": 1.0, "myy": 2.0}, "mxx must equal myy, got 1 and 2 kg"),
        ({"mxx": [1.0, 2.0]}, "mxx must be one number"),
    ],
)
def test_an_added_mass_that_is_not_modelled_is_refused_in_one_line(changes, told):
    held = {"station": 0, "kxx": 4e7} | changes
    with pytest.raises(ValueError, match=r"^line: bearing 1") as caught:
        text_of(table(bearings=[held]), "line")
    assert told in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"bearing": []}, "unknown key 'bearing'"),
        ({"bearings": []}, "it must have bearings"),
        ({"sections": [{"length": 1.0}]}, "section 1 must have a length and outer"),
        ({"bearings": [{"station": 7, "kxx": 1.0}]}, "station from 0 to 3, got 7"),
        ({"disks": [{"station": 1, "mass": -1.0}]}, "mass must be a number >= 0"),
        ({"density": "heavy"}, "density"),
        ({"station": 8}, "shaft_station must be 0 to 3"),
        ({"bearings": [{"station": 0, "kxx": 1e7}]}, "leave a motion free"),
        (
            {"bearings": [{"station": 0, "kxx": 1e7, "film_length": 0.03}]},
            "bearing 1 must have film_viscosity, film_radius, film_clearance of its sq",
        ),
        ({"unequal": "both"}, "unequal must be one of kept, mean"),
    ],
)
def test_a_wrong_table_of_a_shaft_is_refused_in_one_line(changes, told):
    document = {"engine": {"rotation": "full", "shaft": table(**changes)}}
    with pytest.raises(InputError, match=told) as caught:
        rotor_model(scene_of_document(document).engine.rotor, 30, "full")
    assert len(str(caught.value).splitlines()) == 1


def test_a_stored_text_that_was_changed_by_hand_is_refused_in_one_line():
    text = text_of(table(), "the shaft")
    assert shaft_text(text) == text
    broken = [
        text[:-9],
        "{}",
        '{"tubes":[]}',
        text.replace('"disks":[[', '"disks":[[9'),
    ]
    broken += [text.replace("null", "0").replace("0.08", key) for key in ("NaN", "-1")]
    given = json.loads(text)
    for key, value in (("stations", [99]), ("supports", [[0, 5, [[0] * 9]]])):
        broken.append(json.dumps(given | {key: value}))
    for one in broken:
        with pytest.raises(InputError, match="must be the text of a shaft") as caught:
            scene_of_document({"engine": {"rotation": "full", "rotor": {"shaft": one}}})
        assert len(str(caught.value).splitlines()) == 1
