"""Laws of engines whose disk sits on a shaft line: old shafts, whole rotors, files."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hpcwhirl.reduction.bodies import rotor_model
from hpcwhirl.reduction.shaft_whirl import held_by, whirls
from hpcwhirl.reduction.waves import wave_lines
from hpcwhirl.scene import Rotor
from hpcwhirl.scene.shaft_tables import text_of
from hpcwhirl.structure.shaft import ShaftDisk, ShaftLine, line_of

LIGHT, RIGID = 1e-4, 1e12  # kg/m^3, N/m
FAN = {"blades": 7, "elements": 4, "suspension_damping": -1.0, "damping": 0.0}


def table(**changes: Any) -> dict[str, Any]:
    """Return the table of a shaft on three bearings, with a disk, and dampers."""
    usual: dict[str, Any] = {
        "sections": [
            {"length": 0.3, "outer": 0.08, "inner": 0.03},
            {"length": 0.5, "outer": 0.1, "outer_end": 0.07},
            {"length": 0.4, "outer": 0.07},
        ],
        "disks": [{"station": 2, "mass": 40.0, "polar": 0.9, "diametral": 0.5}],
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


@pytest.mark.parametrize("speed", [0.0, 300.0, -300.0])
def test_shaft_modes_tend_to_those_of_a_rigid_disk_as_blades_stiffen(speed):
    """Frequencies and growth beside those of the unreduced line with a rigid disk."""
    own = rotor(table(), young=2.1e18, shaft_station=3, shaft_modes=12)
    line = line_of(own.shaft)
    model = rotor_model(own, 7, "full")
    mount_free = rotor_model(own.model_copy(update={"young": 2.1e18}), 7, "full")
    assert mount_free is model
    from hpcwhirl.structure.bladed_disk import bladed_disk

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
        if speed == 0.0:
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
