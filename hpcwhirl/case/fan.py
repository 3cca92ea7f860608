"""The scene of a fan from a few dimensions; `hpcwhirl new` writes it as a file.

Sections, shaft, ring and pulse follow by similarity from a pattern, the engine of
`jobs/light_ring.toml`: the paper's rotor in a ring as light as the casings of fans, in
which all regimes occur over speed and gap:

- lengths and widths scale with the tip radius; thicknesses of blades, spokes and rim
  are also scaled until 1F at high nodal diameters has the given frequency: by default
  half that of the full speed, which is the paper's ratio of 1F to its largest speed and
  usual for fans at rest; with `rotation = "full"` rotation stiffens the blades;
- the full speed is that of a tip at 400 m/s, if it is not given;
- the shaft's stiffness is k_o = 500 k_blade N / 22 (the paper's ratio per blade), so
  that the suspension stays away from 1F; it is damped as by a squeeze film, which does
  not rotate, since purely rotating damping feeds whirl beyond the critical speed;
- the ring's thickness scales with the blades' thickness, its support with the speed;
- the pulse lasts 1/25 of a period of 1F and gives the ring a speed of 20 gaps per
  period: with the modal mass m = pi R rho A (1 + 1/k^2) of an inextensional shape with
  k lobes, 2 F tau / (pi m) = 20 gap f_1F.

`Checked` has the properties of the resulting model, which are shown to the user.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from hpcwhirl.case.resolve import resolve
from hpcwhirl.errors import InputError, shown, unknown
from hpcwhirl.reduction.families import Line, modal_table
from hpcwhirl.reduction.numbers import representable
from hpcwhirl.scene import Rotor, Scene, scene_from
from hpcwhirl.scene.rules import AS_THE_REST
from hpcwhirl.structure import blade_stiffness

MATERIALS = {  # {material: (Young's modulus, Pa; density, kg/m^3)}
    "titanium": (114e9, 4430.0),  # Ti-6Al-4V
    "steel": (210e9, 7800.0),
    "aluminium": (72e9, 2800.0),
    "nickel": (205e9, 8190.0),  # Inconel 718
    "composite": (60e9, 1600.0),  # carbon and epoxy, quasi-isotropic
}
RADIUS, SPEED = 0.5, 520.0  # tip radius, m, and full speed, rad/s, of the pattern
PATTERN = Rotor()
# casing of the pattern: m, m, rad/s
RING = {"thickness": 0.0218, "width": 0.16, "support_frequency": 14.6}
ROTOR_DAMPING, RING_DAMPING, FILM = 0.0104, 0.064, 0.03
TIP_SPEED = 400.0  # m/s, at full speed
OF_FULL_SPEED = 0.5  # ratio of 1F's frequency to revolutions per second at full speed
FANS = (0.3, 1.0)  # usual range of that ratio
STIFFNESS_A_BLADE = 500.0 / 22.0  # k_o / (k_blade N)
GAP = 1.28e-4 / RADIUS  # ratio of the gap to the tip radius
PULSE_PERIODS = 1.0 / 25.0  # duration of the pulse, in periods of 1F
GAPS_A_PERIOD = 20.0  # speed that the pulse gives the ring, in gaps per period of 1F
DURATION_PERIODS = 60.0  # duration of the run, in periods of 1F
CLOSE, MOST_TRIALS = 0.002, 12  # search of thickness: relative error of 1F, most steps


@dataclass(frozen=True)
class Fan:
    """Dimensions of a fan; 0 (or "") for those to be derived from the others.

    Attributes
    ----------
    blades, radius : number of blades, and tip radius, m
    material, casing_material : keys of `MATERIALS`; "": the material of the blades
    gap : clearance of blade tips and casing, m
    full_speed : largest speed of rotation, rad/s
    frequency : frequency of 1F, first bending, at high nodal diameters, Hz
    lobes, friction : number of lobes of the load; Coulomb coefficient
    """

    blades: int = 22
    radius: float = RADIUS
    material: str = "titanium"
    casing_material: str = ""
    gap: float = 0.0
    full_speed: float = 0.0
    frequency: float = 0.0
    lobes: int = 1
    friction: float = 0.1


@dataclass(frozen=True)
class Checked:
    """Properties of a fan that follow from its model, for the user to check.

    Attributes
    ----------
    full_speed : largest speed of rotation, rad/s
    family : frequency of 1F, first bending, at the highest nodal diameter, Hz
    suspension : frequency of the suspension mode, Hz; 0 if there is none
    ring_mass : mass of the casing ring, kg
    kick : speed that the pulse gives the crests of the ring's lobes, m/s
    closing : time in which the gap closes at the speed `kick`, s
    reach : largest displacement of the ring by the pulse without contact, in gaps
    """

    full_speed: float
    family: float
    suspension: float
    ring_mass: float
    kick: float
    closing: float
    reach: float

    @property
    def share(self) -> float:
        """Ratio of the frequency of 1F to the revolutions a second at full speed."""
        return self.family * 2 * math.pi / self.full_speed


def scene_of_fan(fan: Fan) -> tuple[Scene, Checked]:
    """Return the scene of a fan at its full speed, and properties of its model.

    Raises
    ------
    InputError
        if a number is impossible for a fan, or no thickness gives the frequency
    """
    _check(fan)
    with representable("a fan of these dimensions"):
        return _scene_of(fan)


def _scene_of(fan: Fan) -> tuple[Scene, Checked]:
    """Return `scene_of_fan` of checked dimensions."""
    full = fan.full_speed or TIP_SPEED / fan.radius
    wanted = fan.frequency or OF_FULL_SPEED * full / (2 * math.pi)
    stiffer, frequency = 1.0, math.nan
    for _ in range(MOST_TRIALS):
        scene = _scene(fan, full, wanted, stiffer)
        table = modal_table(resolve(scene).model)
        frequency = _first(table)
        if abs(frequency / wanted - 1.0) < CLOSE:
            return scene, _checked(scene, full, table)
        stiffer *= wanted / frequency
    raise InputError(
        f"no thickness of the blades gives 1F (first bending) at {wanted:.3g} Hz, "
        f"the last trial gave {frequency:.3g} Hz"
    )


def _check(fan: Fan) -> None:
    for name in (fan.material, fan.casing_material or fan.material):
        if name not in MATERIALS:
            raise unknown("material", name, MATERIALS)
    for name in ("radius", "gap", "full_speed", "frequency", "friction"):
        value = getattr(fan, name)
        if not 0.0 <= value < math.inf or (name == "radius" and value == 0.0):
            msg = f"{name.replace('_', ' ')} must be a number > 0, got {shown(value)}"
            raise InputError(msg)
    for what, got, least in (("lobes", fan.lobes, 1), ("blades", fan.blades, 4)):
        if got < least:
            raise InputError(f"{what} must be >= {least}, got {got}")


def _scene(fan: Fan, full: float, family: float, stiffer: float) -> Scene:
    """Return the scene of a fan for a trial thickness of its blades, disk and ring.

    Parameters
    ----------
    fan : dimensions of the fan
    full : full speed, rad/s
    family : frequency of 1F, Hz
    stiffer : trial factor on the thicknesses, in addition to the scaling with radius
    """
    scale, thicker = fan.radius / RADIUS, stiffer * fan.radius / RADIUS
    rotor = _rotor(fan, scale, thicker)
    ring = _ring(fan, scale, thicker, full)
    gap = fan.gap or GAP * fan.radius
    pulse = PULSE_PERIODS / family
    mass = _modal_mass(ring, fan.radius + gap, fan.lobes)
    force = GAPS_A_PERIOD * gap * family * math.pi * mass / (2 * pulse)
    duration = DURATION_PERIODS / family
    return scene_from(
        {
            "speed": full, "nodal_diameter": fan.lobes, "gap": gap,
            "friction": fan.friction, "force": _round(force), "pulse": _round(pulse),
            "duration": _round(duration),
            "engine": {
                "name": "fan", "rotation": "full", "rotor": rotor, "casing": ring,
            },
        }
    )  # fmt: skip


def _rotor(fan: Fan, scale: float, thicker: float) -> dict[str, Any]:
    young, density = MATERIALS[fan.material]
    inputs: dict[str, Any] = {
        "blades": fan.blades, "radius": fan.radius,
        "young": young, "density": density, "damping": ROTOR_DAMPING,
        "suspension_damping": FILM,
    }  # fmt: skip
    for name in ("disk_radius", "blade_width", "spoke_width", "rim_width"):
        inputs[name] = _round(scale * getattr(PATTERN, name))
    for name in ("root_thickness", "spoke_thickness", "rim_thickness"):
        inputs[name] = _round(thicker * getattr(PATTERN, name))
    try:
        stiffness = blade_stiffness(Rotor(**inputs))
    except ValueError:
        return inputs  # the check of the scene will raise the error
    return inputs | {
        "centre_stiffness": _round(STIFFNESS_A_BLADE * fan.blades * stiffness)
    }


def _ring(fan: Fan, scale: float, thicker: float, full: float) -> dict[str, Any]:
    young, density = MATERIALS[fan.casing_material or fan.material]
    support = RING["support_frequency"] * full / SPEED
    return {
        "thickness": _round(thicker * RING["thickness"]),
        "width": _round(scale * RING["width"]), "young": young, "density": density,
        "support_frequency": _round(support), "damping": RING_DAMPING,
        "support_damping": AS_THE_REST,
    }  # fmt: skip


def _modal_mass(ring: Mapping[str, Any], radius: float, lobes: int) -> float:
    """Return the modal mass, kg, of a ring that bends in k lobes without stretching.

    It moves radially by w = cos(k theta), tangentially by u = -sin(k theta) / k.
    """
    section = ring["density"] * ring["thickness"] * ring["width"]
    return float(math.pi * radius * section * (1.0 + 1.0 / lobes**2))


def _round(value: float) -> float:
    """Return a number rounded to four digits, so that inputs are easy to read."""
    return float(f"{value:.4g}")


def _first(table: list[Line]) -> float:
    """Return the frequency, Hz, of 1F (first bending) at the highest nodal diameter.

    table : lines of the modal table of rotor and casing, one a mode
    """
    first = [line for line in table if line.body == "rotor" and line.family == "1F"]
    return max(first, key=lambda line: line.nodal_diameter).frequency_hz


def _checked(scene: Scene, full: float, table: list[Line]) -> Checked:
    """Return the properties of the model of a fan's scene.

    full, table : full speed, rad/s; lines of the model's modal table
    """
    casing, k = scene.engine.casing, scene.nodal_diameter
    mass = _modal_mass(casing.model_dump(), scene.engine.rotor.radius + scene.gap, k)
    kick = 2 * scene.force * scene.pulse / (math.pi * mass)
    suspended = [line.frequency_hz for line in table if line.family == "suspension"]
    waves = [line.frequency_hz for line in table
             if line.body == "casing" and line.nodal_diameter == k]  # fmt: skip
    omega, xi = 2 * math.pi * min(waves), casing.damping
    root = math.sqrt(1.0 - xi**2)
    peak = kick / omega * math.exp(-xi / root * math.atan2(root, xi))
    return Checked(
        full_speed=full,
        family=_first(table),
        suspension=suspended[0] if suspended else 0.0,
        ring_mass=_modal_mass(casing.model_dump(), scene.engine.rotor.radius, 1),
        kick=kick,
        closing=scene.gap / kick,
        reach=peak / scene.gap,
    )
