"""Inputs as type checkers know them; written by scripts/typed_inputs.py.

A number may also be a text with a unit, such as "0.8 mm".
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal, TypeAlias, TypedDict

if TYPE_CHECKING:
    from hpcwhirl.scene.engine_parts import Casing, Engine, Rotor
    from hpcwhirl.scene.inputs import Output, Solver

Number: TypeAlias = float | str


class RotorInputs(TypedDict, total=False):
    """Inputs of `Rotor`, any of them."""

    blades: int
    elements: int
    radius: Number
    disk_radius: Number
    blade_width: Number
    root_thickness: Number
    taper: Number
    spoke_width: Number
    spoke_thickness: Number
    rim_width: Number
    rim_thickness: Number
    young: Number
    density: Number
    centre: Literal["free", "clamped"]
    centre_stiffness: Number
    damping: Number
    suspension_damping: Number
    cross_coupling: Number
    stiffness_difference: Number
    damping_difference: Number
    film_viscosity: Number
    film_length: Number
    film_radius: Number
    film_clearance: Number
    stop_clearance: Number
    stop_friction: Number
    bearing: str
    lost_blade: int
    shaft: str
    shaft_station: int
    shaft_modes: int
    shaft_length: Number
    shaft_overhang: Number
    shaft_diameter: Number
    shaft_young: Number
    polar_inertia: Number
    tilt_inertia: Number
    mistuning: Sequence[float]


class CasingInputs(TypedDict, total=False):
    """Inputs of `Casing`, any of them."""

    kind: Literal["ring", "rigid"]
    discretization: Literal["fourier", "elements", "file", "shell"]
    harmonics: int
    families: Literal["all", "bending"]
    axial_modes: int
    poisson: Number
    elements: int
    thickness: Number
    width: Number
    young: Number
    density: Number
    support_frequency: Number
    damping: Number
    support_damping: Number
    amplitude: Number
    growth: Number
    rise: Number
    profile: str
    profile_scale: Number
    offset: Number
    offset_angle: Number
    profile_rise: Number
    profile_release: Number
    contact_law: Literal["rigid", "abradable", "archard"]
    layer_rods: int
    layer_edge: Number
    layer_width: Number
    layer_thickness: Number
    layer_young: Number
    layer_yield: Number
    layer_hardening: Number
    wear_coefficient: Number


class EngineInputs(TypedDict, total=False):
    """Inputs of `Engine`, any of them."""

    name: str
    file: str
    rotation: Literal["none", "full", "auto"]
    rotor: Rotor | RotorInputs
    casing: Casing | CasingInputs


class SolverInputs(TypedDict, total=False):
    """Inputs of `Solver`, any of them."""

    scheme: Literal["modal", "exact", "general", "paper"]
    time_step: Number
    accuracy: Number
    truncation: Number
    modes: int
    plan: Literal["lean", "everything"]
    until: Literal["end", "certain", "decided"]
    longest: Number
    estimate: Literal["none", "step", "all"]
    amplitude_limit: Number
    preset: str


class OutputInputs(TypedDict, total=False):
    """Inputs of `Output`, any of them."""

    traces: Literal["summary", "blades", "orbit", "full"]
    interval: Number
    forces: Literal["none", "supports"]
    windows: int
    chaos: Number


class SceneInputs(TypedDict, total=False):
    """Inputs of `Scene`, any of them."""

    engine: Engine | EngineInputs
    speed: Number
    nodal_diameter: int
    gap: Number
    gap_at: Literal["speed", "rest"]
    friction: Number
    friction_law: Literal["constant", "stribeck", "table"]
    friction_at_rest: Number
    friction_speed: Number
    friction_table: str
    slip: Literal["permanent", "set-valued"]
    force: Number
    pulse: Number
    direction: Literal["squeeze", "stretch"]
    unbalance: Number
    unbalance_phase: Number
    lost_blade_time: Number
    gravity: Number
    gravity_angle: Number
    start_energy: Number
    start_modes: str
    start_draw: Number
    start_as: Literal["velocities", "both"]
    branch: str
    history: str
    acceleration: Number
    ramp: Literal["linear", "smooth", "decay"]
    speed_to: Number
    speed_table: str
    gap_closure: Number
    gap_time: Number
    gap_table: str
    duration: Number
    revolutions: Number
    solver: Solver | SolverInputs
    output: Output | OutputInputs
