"""Inputs of the casing: its kind, shape, profile, contact law and layer."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator

from hpcwhirl.scene import contact_laws
from hpcwhirl.scene.input_types import Finite, Inputs, NonNegative, OwnRatio, Positive
from hpcwhirl.scene.profile import profile_table
from hpcwhirl.scene.quantity import given
from hpcwhirl.scene.rules import OF_CASING


class Casing(Inputs):
    """Casing in the static frame: an elastic ring, or a rigid one of given shape."""

    RULES = OF_CASING

    kind: Literal["ring", "rigid"] = given(
        "ring",
        "elastic ring or rigid casing; rigid: prescribed distortion -A0 exp(sigma t) "
        "cos(k theta), fixed in the static frame",
    )
    discretization: Literal["fourier", "elements", "file", "shell"] = given(
        "fourier",
        "coordinates of the ring; fourier: harmonics; elements: the paper's; file: a "
        "round casing, by the table of modes in engine.file, so that section, support "
        "and damping have no effect; shell: harmonics of a cylindrical shell of length "
        "`width`, simply supported at both ends",
    )
    harmonics: int = given(
        20,
        "highest harmonic H; each harmonic and phase has two modes",
        symbol="H",
        ge=1,
        le=1000,
    )
    families: Literal["all", "bending"] = given(
        "all",
        "modes of a ring of harmonics; all: also those that stretch it, which limit "
        "the time step; bending: only those that do not stretch it",
    )
    axial_modes: int = given(
        3,
        "axial half waves of a shell; three modes a harmonic, half wave and phase",
        symbol="P",
        ge=1,
        le=50,
        later=True,
    )
    poisson: float = given(
        0.3,
        "Poisson's ratio of a shell; a ring has none",
        symbol="ν",
        ge=0,
        lt=0.5,
        later=True,
    )
    elements: int = given(
        40,
        "number of curved beam elements of the ring; 4 degrees of freedom per node",
        ge=3,
        le=2000,
    )
    thickness: Positive = given(0.0413, "radial thickness of the ring", "m")
    width: Positive = given(0.322, "axial width of the ring", "m")
    young: Positive = given(210e9, "Young's modulus of the ring", "Pa", symbol="E")
    density: Positive = given(7800.0, "density of the ring", "kg/m^3", symbol="ρ")
    support_frequency: NonNegative = given(
        15.0,
        "frequency omega_c1 of the foundation; its stiffness is k_f = rho A omega_c1^2",
        "rad/s",
        symbol="ω_c1",
    )
    damping: NonNegative = given(0.064, "modal damping ratio xi", symbol="ξ")
    support_damping: OwnRatio = given(
        0.375,
        "damping ratio of the modes in which the ring moves on its support; an "
        "elastic mounting, for example, makes it larger than `damping`; -1: that of "
        "the other modes",
    )
    amplitude: Finite = given(
        0.0,
        "amplitude A0 of the distortion of a rigid casing, which must not reach the "
        "blades at the start",
        "m",
        symbol="A0",
    )
    growth: Finite = given(
        0.0,
        "growth rate sigma in A0 exp(sigma t) of a rigid casing; at most 5 % per step "
        "if it reaches the blades",
        "1/s",
        symbol="σ",
    )
    rise: NonNegative = given(
        1e-3,
        "time over which A0 of a rigid casing rises smoothly; at least 50 steps if it "
        "reaches the blades",
        "s",
    )
    profile: Annotated[str, AfterValidator(profile_table)] = given(
        "",
        "table of the shape of a casing that is not round, elastic or rigid; a CSV "
        "file, or its rows in one line, of columns harmonic, amplitude, m, and phase, "
        "rad, or of columns angle, rad, and departure, m, outward; kept as text",
        later=True,
    )
    profile_scale: Finite = given(
        1.0, "factor on the departures of the profile", later=True
    )
    offset: NonNegative = given(
        0.0,
        "distance of the rotor's axis from that of the casing, both at rest; it makes "
        "the gap narrower at offset_angle, and wider on the opposite side",
        "m",
        symbol="e",
        later=True,
    )
    offset_angle: Finite = given(
        0.0, "direction of `offset`, static frame", "rad", later=True
    )
    profile_rise: NonNegative = given(
        0.0,
        "time in which profile and offset fade in smoothly; 0: they have full size "
        "from the start; at least 50 steps if they reach the blades",
        "s",
        later=True,
    )
    profile_release: NonNegative = given(
        0.0,
        "time at which an elastic casing that is held at its profile is let go, to "
        "swing freely; 0: never",
        "s",
        later=True,
    )
    contact_law: contact_laws.LawName = given(
        contact_laws.RIGID,
        f"contact of tips and casing; {contact_laws.MEANINGS}",
        later=True,
    )
    layer_rods: int = given(
        4,
        "number K of rods of a layer under the edge of one tip; a numerical choice; "
        "the whole casing has M = 2 pi R K / layer_edge rods, rounded",
        symbol="K",
        ge=1,
        le=100,
        later=True,
    )
    layer_edge: Positive = given(
        4e-3,
        "length a of a tip's edge along the casing, which rubs on a layer",
        "m",
        symbol="a",
        later=True,
    )
    layer_width: Positive = given(
        0.05, "axial width of the layer that tips touch", "m", symbol="b", later=True
    )
    layer_thickness: Positive = given(
        5e-3, "thickness l of an abradable layer", "m", later=True
    )
    layer_young: Positive = given(
        1e9, "Young's modulus of an abradable layer", "Pa", symbol="E_l", later=True
    )
    layer_yield: Positive = given(
        1e6,
        "stress beyond which an abradable layer is plastic",
        "Pa",
        symbol="σ_y",
        later=True,
    )
    layer_hardening: Positive = given(
        1e8, "plastic modulus of an abradable layer", "Pa", symbol="H_l", later=True
    )
    wear_coefficient: NonNegative = given(
        1e-12,
        "worn volume per normal force and sliding distance, by Archard's law",
        "1/Pa",
        later=True,
    )
