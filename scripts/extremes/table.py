"""The scenes at the extremes, each with the law that decides it. One table."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from extremes import crossed
from extremes.laws import (
    Law,
    any_law,
    at_rest,
    closed_form,
    handed_over,
    lost,
    many_steps,
    mirrored,
    no_drift,
    refused,
    scaled,
    schemes_agree,
    sound,
    stopped,
    touching,
    unique,
)

from hpcwhirl.scene import Scene, flatten
from hpcwhirl.scene.input_names import full_name

SCHEMES = ("modal", "exact", "general", "paper")
STEPWISE = ("modal", "general", "paper")  # `exact` jumps


@dataclass(frozen=True)
class Extreme:
    """A scene at an extreme: Table 2, 4 ms at 2e-6 s, with settings.

    Attributes
    ----------
    what : the input that is at its extreme
    settings : inputs by name
    law : what decides
    quick : whether the quick tests try it; the others need a kernel of their own size
    """

    what: str
    settings: dict[str, Any]
    law: Law
    quick: bool = True

    @property
    def name(self) -> str:
        """Its settings in a line."""
        return ", ".join(f"{n} = {v}" for n, v in self.settings.items()) or "table2"


def each(
    what: str, law: Law, *settings: dict[str, Any], quick: bool = True
) -> list[Extreme]:
    """Return an extreme for each of the settings."""
    return [Extreme(what, given, law, quick) for given in settings]


def over(name: str, *values: Any, **more: Any) -> list[dict[str, Any]]:
    """Return settings that differ in one input."""
    return [{name: value} | more for value in values]


FREE = {"gap": 1.0}  # m: nothing touches
TURNS = {"rotation": "full"}
MATERIAL = {"rotor.damping": 0.05, "casing.damping": 0.05}
SOON = {"gap": 5e-5}  # m: what touches late, or not, by the default gap
TABLE: list[Extreme] = [
    *each("time step", sound, {"time_step": 1e-9, "duration": 2e-5}, quick=False),
    *each("time step", schemes_agree, {"time_step": 9.6e-6}, quick=False),
    *each("time step", refused("time_step must be < 9.61"),
          *over("time_step", 9.6235e-6, 1e-5, 1.0, 1e300)),
    *each("gap", touching, *over("gap", 0.0, -0.0, 1e-9, 1e-300)),
    *each("gap", schemes_agree, {"gap": 0.0}),
    *each("gap", closed_form, *over("scheme", *SCHEMES, **FREE)),
    *each("gap", refused("gap must be"), *over("gap", -1e-9, 6.0)),
    *each("friction", unique, *over("friction", 0.0, 1.0, 10.0)),
    *each("friction", unique, *over("friction", 1.0, 10.0, discretization="elements"),
          quick=False),
    *each("friction", schemes_agree, {"friction": 10.0, "duration": 1.2e-3} | SOON),
    *each("friction", sound, *over("scheme", *SCHEMES, friction=10.0)),
    *each("friction", sound, *over("scheme", *SCHEMES, friction=1e6)),
    *each("speed", schemes_agree, *over("speed", 0.0, 1e-3, duration=2e-3)),
    *each("speed", mirrored, *over("speed", 1e-3, 1e4, 5e-324)),
    *each("speed", mirrored,
          *over("scheme", "exact", "general", "paper", speed=1e4), quick=False),
    *each("speed", refused("speed must be < 78539.8"), {"speed": 1e5}),
    *each("speed", refused("speed must be > -78539.8"), {"speed": -1e300}),
    *each("rotation", touching, *over("scheme", *SCHEMES, **TURNS)),
    *each("rotation", schemes_agree,
          *over("speed", 0.0, 1e-3, -410.0, 1e3, duration=2e-3, **TURNS)),
    *each("rotation", mirrored, *over("speed", 5e-324, 1e-3, 410.0, 1e3, **TURNS)),
    *each("rotation", mirrored,
          *over("scheme", "exact", "general", "paper", speed=1e3, **TURNS),
          quick=False),
    *each("rotation", sound, *over("scheme", *SCHEMES, friction=10.0, **TURNS)),
    *each("rotation", sound,  # all damping turns, beyond the speed where it drives
          *over("scheme", *SCHEMES, speed=900.0, **TURNS | MATERIAL)),
    *each("rotation", at_rest, *over("force", 0.0, 5e-324, speed=900.0, **TURNS)),
    *each("rotation", touching,
          *over("blades", 1, 2, scheme="general", modes=20, **SOON | TURNS)),
    *each("rotation", schemes_agree,
          *over("blades", 1, 2, modes=20, **SOON | TURNS),
          *over("blades", 3, 13, modes=20, **TURNS),
          {"centre": "clamped", "duration": 2e-3} | TURNS, quick=False),
    *each("rotation", refused("no stiffness left"),
          *over("speed", 1.5e4, -1.5e4, time_step=1e-6, **TURNS)),
    *each("rotation", refused("suspension_damping must be"),
          {"rotor.damping": 0.1, "suspension_damping": 0.05} | TURNS),
    *each("force", at_rest, *over("force", 0.0, -0.0, 1e-300, 5e-324)),
    *each("force", sound, *over("scheme", *SCHEMES, force=1e9)),
    *each("force", stopped, *over("scheme", *SCHEMES, force=1e30)),
    *each("force", lost, *over("scheme", *SCHEMES, force=1e300)),
    *each("pulse", refused("pulse must be >= 2e-05"),
          *over("pulse", 1e-7, 1.9e-5, 1e-300)),
    *each("pulse", closed_form, {"pulse": 2.1e-5} | FREE, {"pulse": 1.0} | FREE),
    *each("pulse", sound, {"pulse": 1.0}, {"pulse": 1e300}),
    *each("damping", touching,
          *over("scheme", *SCHEMES, **{"rotor.damping": 0.0, "casing.damping": 0.0})),
    *each("damping", schemes_agree,
          *({"rotor.damping": xi, "casing.damping": xi} | SOON for xi in (1.0, 30.0)),
          quick=False),
    *each("damping", closed_form,
          *over("casing.damping", 0.0, 0.999, 1.0, 5.0, **FREE)),
    *each("damping", closed_form, {"casing.damping": 0.999, "scheme": "exact"} | FREE),
    *each("damping", sound, {"rotor.damping": 1e3, "casing.damping": 1e3}),
    *each("damping", handed_over("damping < 1"), {"rotor.damping": 1.0}),
    *each("damping", refused("the step cannot be computed"),
          {"casing.damping": 1e306}, {"rotor.damping": 1e306}),
    *each("blades", touching,
          *over("blades", 1, 2, scheme="general", modes=20, **SOON),
          *over("blades", 3, 13, 21, scheme="general", modes=20)),
    *each("blades", touching, *over("blades", 3, 13, 21, modes=20), quick=False),
    *each("blades", schemes_agree, *over("blades", 1, 2, modes=20, **SOON),
          *over("blades", 3, 13, modes=20), quick=False),
    *each("blades", touching, {"blades": 200, "duration": 2e-3}, quick=False),
    *each("blades", refused("blades must be <= 1000"), {"blades": 2000}),
    *each("blades", refused("degrees of freedom"),
          {"blades": 1000}, {"blades": 200, "rotor.elements": 200}),
    *each("blade elements", schemes_agree, {"rotor.elements": 1, "modes": 0},
          quick=False),
    *each("blade elements", touching, {"rotor.elements": 200}, quick=False),
    *each("blade elements", refused("must be <= 1000"), {"rotor.elements": 100000}),
    *each("modes", touching, *over("modes", 0, 1, scheme="general")),
    *each("modes", schemes_agree, *over("modes", 0, 1), quick=False),
    *each("modes", touching, {"modes": 682, "scheme": "general", "time_step": 1e-6},
          quick=False),
    *each("modes", refused("modes must be <= 682"), *over("modes", 683, 10**6)),
    *each("lobes", closed_form,
          *over("nodal_diameter", 12, 20, duration=1.2e-3, time_step=1e-7)),
    *each("lobes", closed_form,
          *over("nodal_diameter", 0, 11, duration=1.2e-3, time_step=1e-7), quick=False),
    *each("lobes", schemes_agree, {"nodal_diameter": 2, "duration": 2e-3},
          {"nodal_diameter": 3, "duration": 2e-3} | SOON),
    *each("lobes", closed_form,
          *over("nodal_diameter", 22, 23, 40, harmonics=40, scheme="general",
                duration=1.2e-3, time_step=1e-7)),
    *each("lobes", refused("nodal_diameter must be <= 20"), {"nodal_diameter": 21}),
    *each("harmonics", refused("harmonics must be <= 1000"), {"harmonics": 10**5}),
    *each("harmonics", touching, {"harmonics": 1},
          {"harmonics": 200, "time_step": 1e-7, "duration": 2.5e-3}, quick=False),
    *each("ring", touching, *over("thickness", 1e-3, 0.1, scheme="general")),
    *each("ring", schemes_agree,
          *over("thickness", 1e-3, 0.1, duration=2.5e-3, **SOON)),
    *each("ring", refused("time_step must be < 1.64"),
          {"thickness": 0.1, "discretization": "elements"}),
    *each("ring", refused("the casing cannot be computed"),
          {"thickness": 1e300}, {"casing.density": 5e-324}),
    *each("ring elements", touching, *over("casing.elements", 3, 100,
          discretization="elements", time_step=5e-7), quick=False),
    *each("support", touching, *over("scheme", *STEPWISE, support_frequency=0.0)),
    *each("support", touching,
          *over("scheme", *STEPWISE, support_frequency=0.0, thickness=0.02, gap=0.0)),
    *each("support", refused("scheme exact needs modes that oscillate"),
          {"scheme": "exact", "support_frequency": 0.0}),
    *each("support", closed_form, *over("support_frequency", 0.0, 1e4, 9e5, **FREE)),
    *each("support", refused("time_step must be <"), {"support_frequency": 1e6}),
    *each("support", refused("the casing cannot be computed"),
          {"support_frequency": 1e300}),
    *each("rigid casing", touching,
          *over("scheme", "modal", "general", "paper", kind="rigid", amplitude=2e-4)),
    *each("rigid casing", touching,
          {"scheme": "exact", "kind": "rigid", "amplitude": 2e-4}, quick=False),
    *each("rigid casing", refused("growth must be within"),
          {"kind": "rigid", "amplitude": 1e-4, "growth": 1e300, "scheme": "general"}),
    *each("shaft", schemes_agree, {"centre": "clamped", "duration": 2e-3}, quick=False),
    *each("shaft", touching, *over("centre_stiffness", 1e-300, 1e-6, 1e10,
          scheme="general")),
    *each("shaft", refused("time_step must be <"), {"centre_stiffness": 1e30}),
    *each("duration", sound, *over("duration", 2e-6, 1e-9, 5e-324)),
    *each("duration", no_drift,
          {"duration": 0.02, "nodal_diameter": 2, "interval": 1e-3} | FREE),
    *each("duration", no_drift,
          *over("scheme", "modal", "general", duration=2.0, nodal_diameter=2,
                interval=1e-2, **FREE), quick=False),
    *each("duration", no_drift,
          *over("duration", 20.0, nodal_diameter=2, interval=1e-2, **FREE),
          quick=False),
    *each("duration", refused("1e[+]13 steps"), *over("duration", 1e8, 1e300),
          {"revolutions": 1e300, "speed": 1e-300}),
    *each("samples", refused("raise interval"),
          {"duration": 2e3, "interval": 2e-6}, {"duration": 1e4, "interval": 1e-300}),
    *each("samples", sound, {"interval": 1e308, "time_step": 1e-6, "duration": 1e-4}),
    *each("accuracy", refused("which accuracy asks for"), {"accuracy": 1e-300}),
    *each("accuracy", sound, {"accuracy": 1e300, "duration": 1e-3} | SOON, quick=False),
    *each("truncation", sound, *over("truncation", 0.3, 1e300), quick=False),
    *each("truncation", refused("time_step must be <"), {"truncation": 1e-300}),
    *each("ring that does not stretch", sound,
          *over("casing.thickness", 1e-3, 0.1, families="bending"), quick=False),
    *each("size of the engine", scaled(1e3), {}),
    *each("size of the engine", scaled(1e-3), {}),
    *each("size of the engine", scaled(1e3),
          *over("scheme", "exact", "general", "paper"), quick=False),
    *each("size of the engine", scaled(1e-3), {"friction": 1.0}, quick=False),
    *each("gap that closes", any_law, *over("gap_time", 1e-300, 1e300,
          gap_closure=5e-5)),
    *each("run-up", any_law,
          {"acceleration": 5e-324, "ramp": "smooth", "speed_to": 500.0},
          {"acceleration": -5e-324, "ramp": "decay", "speed_to": 100.0}),
    *each("run-up", refused("acceleration must be within"),
          {"acceleration": -1e14, "ramp": "decay", "speed_to": 100.0}),
    *each("layer", refused("cannot be computed"), {"contact_law": "abradable",
          "scheme": "general", "layer_hardening": 5e-324}),
    *each("supports", any_law, {"cross_coupling": 1e300, "scheme": "general"} | TURNS),
    *each("no number", refused("must be a finite number"),
          *over("speed", "nan", "inf", "-inf"), *over("gap", "nan", "inf"),
          *over("time_step", "nan", "inf"), *over("casing.damping", "nan", "inf")),
    *each("no number", refused("must be"),
          *over("speed", "true", "fast"), *over("blades", "1e2", "2.5", -1, 0),
          *over("pulse", 0.0, -0.0, -1e-300), *over("duration", 0.0, -1.0)),
]  # fmt: skip

EDGES = (0.0, -0.0, 5e-324, 1e-300, 1e-30, 1e30, 1e300, 1.7976931348623157e308)
NUMBERS = [name for name, value in flatten(Scene()).items() if isinstance(value, float)]
TABLE += [
    Extreme("edge of numbers", {name: edge, "scheme": "general"}, any_law, quick=False)
    for name in NUMBERS
    for edge in EDGES
]

OVAL = {"profile": "harmonic,amplitude,phase;2,3e-5,0.4"}
ONE_BY_ONE = {"scheme": "general"}
# {feature: inputs that switch it on, and its numbers, each of which goes to its edges}
FEATURES: dict[str, tuple[dict[str, Any], tuple[str, ...]]] = {
    "squeeze film": (
        ONE_BY_ONE | TURNS | {"film_viscosity": 2e-5},  # at 2e10 it closes to 5e-7
        ("film_viscosity", "film_length", "film_radius", "film_clearance")),
    "layer that yields": (
        ONE_BY_ONE | {"contact_law": "abradable"},
        ("layer_edge", "layer_width", "layer_thickness", "layer_young", "layer_yield",
         "layer_hardening")),
    "layer that is rubbed off": (
        ONE_BY_ONE | {"contact_law": "archard"},
        ("layer_edge", "layer_width", "wear_coefficient")),
    "oval casing": (OVAL, ("profile_scale", "offset", "offset_angle", "profile_rise")),
    "oval that is let go": (OVAL | {"profile_release": 2e-3}, ("profile_release",)),
    "rigid that grows": (
        ONE_BY_ONE | {"kind": "rigid", "amplitude": 1e-4},
        ("amplitude", "growth", "rise")),
    "run-up": ({"acceleration": 100.0}, ("acceleration", "speed_to")),
    "run-up, smooth": (
        {"acceleration": 100.0, "ramp": "smooth", "speed_to": 500.0},
        ("acceleration", "speed_to")),
    "run-down, decay": (
        {"acceleration": -100.0, "ramp": "decay", "speed_to": 100.0},
        ("acceleration", "speed_to")),
    "closing gap": (
        {"gap_closure": 5e-5, "gap_time": 2e-3}, ("gap_closure", "gap_time")),
    "unbalance": (TURNS | {"unbalance": 1e-3}, ("unbalance", "unbalance_phase")),
    "supports": (
        ONE_BY_ONE | TURNS,
        ("stiffness_difference", "damping_difference", "cross_coupling")),
    "tilting disk": (
        TURNS | {"shaft": "cantilever"},
        ("shaft_length", "shaft_diameter", "shaft_young", "polar_inertia",
         "tilt_inertia")),
    "Stribeck's friction": (
        {"friction_law": "stribeck"}, ("friction_at_rest", "friction_speed")),
    "energy at the start": (
        {"force": 0.0, "start_energy": 1.0}, ("start_energy", "start_draw")),
    "shell": (
        ONE_BY_ONE | {"discretization": "shell", "casing.harmonics": 8},
        ("casing.width", "casing.thickness", "poisson")),
}  # fmt: skip
AWAY = (0.0, 5e-324, 1e-12, 1e12, 1e300, -1.0)  # times a feature's number, or itself


def edges_of(feature: str) -> list[dict[str, Any]]:
    """Return settings of a feature that is on, one number of it at an edge."""
    on, numbers = FEATURES[feature]
    plain = flatten(Scene()) | {full_name(n): v for n, v in on.items()}
    return [
        on | {name: away * (float(plain[full_name(name)]) or 1.0)}
        for name in numbers
        for away in AWAY
    ]


TABLE += [
    Extreme(f"feature: {feature}", settings, any_law, quick=False)
    for feature in FEATURES
    for settings in edges_of(feature)
]
TABLE += [
    Extreme(pair.what, pair.settings, pair.law, quick=False) for pair in crossed.pairs()
]
TABLE += [
    Extreme(f"1e7 steps x {name}", given, many_steps, quick=False)
    for name, given in crossed.LONG.items()
]
