"""Inputs of the engine: bladed disk, shaft and supports; casing, layer and shape.

Each field of a class is an input: its default, unit, meaning, symbol and limits.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, BeforeValidator

from hpcwhirl.scene import contact_laws
from hpcwhirl.scene.bearing_tables import bearing_table
from hpcwhirl.scene.kept_tables import profile_table
from hpcwhirl.scene.rules import NO_BLADE, OF_CASING, OF_ENGINE, OF_ROTOR
from hpcwhirl.scene.shaft_tables import WORDS, shaft_text
from hpcwhirl.scene.table_model import (
    Change,
    FileName,
    Finite,
    Inputs,
    Label,
    NonNegative,
    OwnRatio,
    Positive,
    as_tuple,
)
from hpcwhirl.scene.units import given

# fmt: off


class Rotor(Inputs):
    """Inputs of the rotor: bladed disk of beams, shaft, and supports of its centre.

    A blade is clamped on the disk's rim at `disk_radius` and tapers linearly in
    thickness. Spokes (centre to blade root) and rim beams (root to root) represent
    the disk.
    """

    RULES = OF_ROTOR

    blades: int = given(22, "1",
        "number of blades N; a rotor from file has its own number",
        symbol="N", ge=1, le=1000)
    elements: int = given(10, "1",
        "elements per blade; 3 N (elements + 1) <= 15000", ge=1, le=1000)
    radius: Positive = given(0.5, "m",
        "tip radius R_bd; also the radius of the casing, even with a rotor from file",
        symbol="R_bd")
    disk_radius: Positive = given(0.035891, "m",
        "radius of the rim, where blades are clamped; less than radius")
    blade_width: Positive = given(0.13275, "m",
        "width of a blade out of the plane of rotation")
    root_thickness: Positive = given(0.010548, "m",
        "thickness of a blade at its root, in plane")
    taper: Positive = given(0.77753, "1",
        "ratio of a blade's thickness at the tip to that at the root")
    spoke_width: Positive = given(0.0039693, "m",
        "width of a spoke out of plane; spokes join the centre to the blade roots")
    spoke_thickness: Positive = given(0.051338, "m", "thickness of a spoke in plane")
    rim_width: Positive = given(0.99966, "m",
        "width of a rim beam out of plane; rim beams go from root to root; the "
        "sections of spokes and rim are such that the frequencies are those of the "
        "paper, they do not resemble a real disk")
    rim_thickness: Positive = given(0.0080619, "m", "thickness of a rim beam in plane")
    young: Positive = given(210e9, "Pa",
        "Young's modulus of blades and disk", symbol="E")
    density: Positive = given(7800.0, "kg/m^3",
        "density of blades and disk", symbol="ρ")
    centre: Literal["free", "clamped"] = given("free", "1",
        "support of the shaft's centre; free: held by the springs k_o of the shaft; "
        "clamped: fixed")
    centre_stiffness: Positive = given(3.4e7, "N/m",
        "stiffness k_o of the shaft at the centre", symbol="k_o")
    damping: NonNegative = given(0.0085, "1",
        "modal damping ratio xi; for a rotor from file used only if the file has no "
        "damping", symbol="ξ")
    suspension_damping: OwnRatio = given(0.0275, "1",
        "damping ratio of the suspension modes, in which the shaft's centre moves; a "
        "squeeze film, for example, makes it larger than `damping`; -1: that of the "
        "other modes; for a rotor from file used only if the file has no damping and "
        "its suspension modes are recognised; with rotation full it is the ratio at "
        "rest, and the excess over `damping` comes from a damper that does not rotate")
    cross_coupling: Finite = given(0.0, "N/m",
        "cross-coupled stiffness k_q of the suspension; its force is 90 degrees ahead "
        "of the displacement of the centre in the sense of rotation, and drives "
        "forward whirl if > 0; only with rotation full", symbol="k_q")
    stiffness_difference: Finite = given(0.0, "N/m",
        "half the difference of the shaft's stiffnesses along x and y, (k_x - k_y)/2; "
        "in the static frame; their mean is centre_stiffness, which must be larger; "
        "only with rotation full, scheme general, paper or modal", symbol="k_d")
    damping_difference: Finite = given(0.0, "N s/m",
        "half the difference of the suspension's damping along x and y, (c_x - c_y)/2; "
        "in the static frame; at most their mean, which suspension_damping sets; only "
        "with rotation full, scheme general, paper or modal", symbol="c_d")
    film_viscosity: NonNegative = given(0.0, "Pa s",
        "viscosity of the oil of a squeeze-film damper at the centre, in parallel with "
        "the suspension; short-bearing theory without cavitation; 0: no film; only "
        "with rotation full, scheme general, paper or modal", symbol="μ_f")
    film_length: Positive = given(0.03, "m",
        "axial length L of the squeeze film", symbol="L_f")
    film_radius: Positive = given(0.06, "m",
        "radius R of the squeeze film", symbol="R_f")
    film_clearance: Positive = given(2e-4, "m",
        "radial clearance c of the squeeze film; the centre should not move farther, "
        "see stop_clearance", symbol="c_f")
    stop_clearance: NonNegative = given(0.0, "m",
        "radial clearance of a ring at rest that stops the centre, as an auxiliary "
        "bearing does; 0: none; only with rotation full, scheme general, paper or "
        "modal", symbol="c_s")
    stop_friction: NonNegative = given(0.0, "1",
        "friction coefficient of that ring, against the rotation", symbol="μ_s")
    bearing: Annotated[str, AfterValidator(bearing_table)] = given("", "1",
        "table of a bearing's coefficients over speed; it replaces springs and damper "
        "at the centre; a CSV or TOML file with the columns speed, rad/s, kxx, kxy, "
        "kyx, kyy, cxx, cxy, cyx, cyy; stored as text; only with rotation full, not "
        "with a rotor from file")
    lost_blade: int = given(NO_BLADE, "1",
        "number of the blade that is lost when the run begins, counted from 0; -1: "
        "none; the others are then unbalanced; only with rotation full, not with a "
        "rotor from file", ge=NO_BLADE)
    shaft: Annotated[str, AfterValidator(shaft_text)] = given("springs", "1",
        "what holds the centre; springs: centre_stiffness, and the disk does not tilt; "
        "cantilever: a shaft clamped at one end; two bearings: a shaft that overhangs "
        "the second one; both are round and massless, and the disk tilts on them; or a "
        "TOML or JSON file of a shaft with mass, disks and bearings at stations, also "
        "as saved by ROSS, stored as text; only with rotation full, not with a rotor "
        "from file")
    shaft_station: int = given(0, "1",
        "station of a shaft with mass at which the bladed disk sits, counted from 0",
        ge=0)
    shaft_modes: int = given(2, "1",
        "number of modes kept of a shaft with mass, in addition to what the bladed "
        "disk and dampers move", ge=0, le=100)
    shaft_length: Positive = given(0.6, "m",
        "length L of a cantilever, or distance L_1 of two bearings", symbol="L_1")
    shaft_overhang: Positive = given(0.4, "m",
        "distance L_2 from the second bearing to the disk", symbol="L_2")
    shaft_diameter: Positive = given(0.1, "m", "diameter of a round shaft")
    shaft_young: Positive = given(210e9, "Pa", "Young's modulus of the shaft")
    polar_inertia: NonNegative = given(0.0, "kg m^2",
        "moment of inertia of a tilting disk about the axis of rotation; 0: that of "
        "the bladed disk's beams", symbol="I_p")
    tilt_inertia: NonNegative = given(0.0, "kg m^2",
        "moment of inertia of a tilting disk about a diameter; 0: half the polar one, "
        "as for a thin disk", symbol="I_d")
    mistuning: Annotated[tuple[Change, ...], BeforeValidator(as_tuple)] = given((), "1",
        "relative change delta_j of each blade's Young's modulus; N numbers, E_j = E "
        "(1 + delta_j); the disk does not change; swept as a list of such lists; not "
        "with a rotor from file")

    @property
    def has_line(self) -> bool:
        """Whether the shaft has mass and stations, see `shaft_tables`."""
        return self.shaft not in WORDS

    @property
    def is_uneven(self) -> bool:
        """Whether the sectors of the rotor differ: it is mistuned or lost a blade."""
        return bool(self.mistuning) or self.lost_blade != NO_BLADE


class Casing(Inputs):
    """Inputs of the casing, elastic or rigid, its shape and the layer that wears."""

    RULES = OF_CASING

    kind: Literal["ring", "rigid"] = given("ring", "1",
        "elastic ring or rigid casing; rigid: prescribed distortion -A0 exp(sigma t) "
        "cos(k theta), fixed in the static frame")
    discretization: Literal["fourier", "elements", "file", "shell"] = given(
        "fourier", "1",
        "coordinates of the ring; fourier: harmonics; elements: the paper's curved "
        "beams; file: a round casing, by the table of modes in engine.file, so that "
        "section, support and damping have no effect; shell: harmonics of a "
        "cylindrical shell of length `width`, simply supported at both ends")
    harmonics: int = given(20, "1",
        "highest harmonic H; each harmonic and phase has two modes",
        symbol="H", ge=1, le=1000)
    families: Literal["all", "bending"] = given("all", "1",
        "modes of a ring of harmonics; all: also modes that stretch the ring, which "
        "limit the time step; bending: only modes that do not stretch it")
    axial_modes: int = given(3, "1",
        "number of axial half waves of a shell; each gives three modes for every "
        "harmonic and phase",
        symbol="P", ge=1, le=50)
    poisson: float = given(0.3, "1",
        "Poisson's ratio of a shell; a ring has none", symbol="ν", ge=0, lt=0.5)
    elements: int = given(40, "1",
        "number of curved beam elements of the ring; 4 degrees of freedom per node",
        ge=3, le=2000)
    thickness: Positive = given(0.0413, "m", "radial thickness of the ring")
    width: Positive = given(0.322, "m", "axial width of the ring")
    young: Positive = given(210e9, "Pa", "Young's modulus of the ring", symbol="E")
    density: Positive = given(7800.0, "kg/m^3", "density of the ring", symbol="ρ")
    support_frequency: NonNegative = given(15.0, "rad/s",
        "frequency omega_c1 of the foundation; its stiffness is k_f = rho A omega_c1^2",
        symbol="ω_c1")
    damping: NonNegative = given(0.064, "1", "modal damping ratio xi", symbol="ξ")
    support_damping: OwnRatio = given(0.375, "1",
        "damping ratio of the modes in which the ring moves on its support; an elastic "
        "mounting, for example, makes it larger than `damping`; -1: that of the other "
        "modes")
    amplitude: Finite = given(0.0, "m",
        "amplitude A0 of the distortion of a rigid casing; must begin outside the "
        "blades", symbol="A0")
    growth: Finite = given(0.0, "1/s",
        "growth rate sigma in A0 exp(sigma t) of a rigid casing; at most 5 % per step "
        "if it reaches the blades", symbol="σ")
    rise: NonNegative = given(1e-3, "s",
        "time over which A0 of a rigid casing rises smoothly; at least 50 steps if it "
        "reaches the blades")
    profile: Annotated[str, AfterValidator(profile_table)] = given("", "1",
        "table of the shape of a casing that is not round, elastic or rigid; a CSV "
        "file, or its rows in one line, of columns harmonic, amplitude, m, and phase, "
        "rad, or of columns angle, rad, and departure, m, outward; kept as text")
    profile_scale: Finite = given(1.0, "1", "factor on the departures of the profile")
    offset: NonNegative = given(0.0, "m",
        "distance of the rotor's axis from that of the casing, both at rest; it makes "
        "the gap narrower at offset_angle, and wider on the opposite side", symbol="e")
    offset_angle: Finite = given(0.0, "rad", "direction of `offset`, static frame")
    profile_rise: NonNegative = given(0.0, "s",
        "time in which profile and offset fade in smoothly; 0: they have full size "
        "from the start; at least 50 steps if they reach the blades")
    profile_release: NonNegative = given(0.0, "s",
        "time at which an elastic casing that is held at its profile is let go, to "
        "swing freely; 0: never")
    contact_law: contact_laws.LawName = given(contact_laws.RIGID, "1",
        f"contact of tips and casing; {contact_laws.MEANINGS}")
    layer_rods: int = given(4, "1",
        "number K of rods of a layer under the edge of one tip; a numerical choice; "
        "the whole casing has M = 2 pi R K / layer_edge rods, rounded",
        symbol="K", ge=1, le=100)
    layer_edge: Positive = given(4e-3, "m",
        "length a of a tip's edge along the casing, which rubs on a layer", symbol="a")
    layer_width: Positive = given(0.05, "m",
        "axial width of the layer that tips touch", symbol="b")
    layer_thickness: Positive = given(5e-3, "m", "thickness l of an abradable layer")
    layer_young: Positive = given(1e9, "Pa",
        "Young's modulus of an abradable layer", symbol="E_l")
    layer_yield: Positive = given(1e6, "Pa",
        "stress beyond which an abradable layer is plastic", symbol="σ_y")
    layer_hardening: Positive = given(1e8, "Pa",
        "plastic modulus of an abradable layer", symbol="H_l")
    wear_coefficient: NonNegative = given(1e-12, "1/Pa",
        "worn volume per normal force and sliding distance, by Archard's law")


class Engine(Inputs):
    """Inputs of rotor and casing; the defaults are those of engine `four_motions`."""

    RULES = OF_ENGINE

    name: Label = given("four_motions", "1",
        "name of the engine; a label without control characters", max_length=200)
    file: FileName = given("", "1",
        "HDF5 file of a reduced rotor that replaces the built-in one; its layout is "
        "that of `hpcwhirl export-model`; a regular file of at most 2 GiB; a relative "
        "path starts at the TOML file that names it, with --set at the working "
        "directory")
    rotation: Literal["none", "full", "auto"] = given("none", "1",
        "effects of rotation on the rotor; none: none, as in the paper; full: Coriolis "
        "terms, centrifugal stiffening and softening, and supports that do not turn; a "
        "rotor from file must have these terms; `gap_at` says at which speed `gap` is "
        "measured; auto: none if the centre is clamped and no wave changes by more "
        "than 1 % or `accuracy`, else full")
    rotor: Rotor = Rotor()
    casing: Casing = Casing()
