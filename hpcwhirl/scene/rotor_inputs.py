"""Inputs of the bladed disk, its shaft and the supports of its centre."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, BeforeValidator

from hpcwhirl.scene.bearing import bearing_table
from hpcwhirl.scene.input_types import (
    Change,
    Finite,
    Inputs,
    NonNegative,
    OwnRatio,
    Positive,
    as_tuple,
)
from hpcwhirl.scene.quantity import given
from hpcwhirl.scene.rules import NO_BLADE, OF_ROTOR


class Rotor(Inputs):
    """Bladed disk in the rotating frame.

    A blade is clamped on the disk's rim at `disk_radius` and tapers linearly in
    thickness. Spokes (centre to blade root) and rim beams (root to root) represent
    the disk.
    """

    RULES = OF_ROTOR

    blades: int = given(
        22,
        "number of blades N; a rotor from file has its own number",
        symbol="N",
        ge=1,
        le=1000,
    )
    elements: int = given(
        10, "elements per blade; 3 N (elements + 1) <= 15000", ge=1, le=1000
    )
    radius: Positive = given(
        0.5,
        "tip radius R_bd; also the radius of the casing, even with a rotor from file",
        "m",
        symbol="R_bd",
    )
    disk_radius: Positive = given(
        0.035891, "radius of the rim, where blades are clamped; less than radius", "m"
    )
    blade_width: Positive = given(
        0.13275, "width of a blade out of the plane of rotation", "m"
    )
    root_thickness: Positive = given(
        0.010548, "thickness of a blade at its root, in plane", "m"
    )
    taper: Positive = given(
        0.77753, "ratio of a blade's thickness at the tip to that at the root"
    )
    spoke_width: Positive = given(
        0.0039693,
        "width of a spoke out of plane; spokes join the centre to the blade roots",
        "m",
    )
    spoke_thickness: Positive = given(0.051338, "thickness of a spoke in plane", "m")
    rim_width: Positive = given(
        0.99966,
        "width of a rim beam out of plane; rim beams go from root to root; the "
        "sections of spokes and rim are such that the frequencies are those of the "
        "paper, they do not resemble a real disk",
        "m",
    )
    rim_thickness: Positive = given(0.0080619, "thickness of a rim beam in plane", "m")
    young: Positive = given(
        210e9, "Young's modulus of blades and disk", "Pa", symbol="E"
    )
    density: Positive = given(
        7800.0, "density of blades and disk", "kg/m^3", symbol="ρ"
    )
    centre: Literal["free", "clamped"] = given(
        "free",
        "support of the shaft's centre; free: held by the springs k_o of the shaft; "
        "clamped: fixed",
    )
    centre_stiffness: Positive = given(
        3.4e7, "stiffness k_o of the shaft at the centre", "N/m", symbol="k_o"
    )
    damping: NonNegative = given(
        0.0085,
        "modal damping ratio xi; for a rotor from file used only if the file has no "
        "damping",
        symbol="ξ",
    )
    suspension_damping: OwnRatio = given(
        0.0275,
        "damping ratio of the suspension modes, in which the shaft's centre moves; a "
        "squeeze film, for example, makes it larger than `damping`; -1: that of the "
        "other modes; for a rotor from file used only if the file has no damping and "
        "its suspension modes are recognised; with rotation full it is the ratio at "
        "rest, and the excess over `damping` comes from a damper that does not rotate",
    )
    cross_coupling: Finite = given(
        0.0,
        "cross-coupled stiffness k_q of the suspension; its force is 90 degrees ahead "
        "of the displacement of the centre and drives forward whirl if > 0; only with "
        "rotation full",
        "N/m",
        symbol="k_q",
    )
    stiffness_difference: Finite = given(
        0.0,
        "half the difference of the shaft's stiffnesses along x and y, (k_x - k_y)/2; "
        "in the static frame; their mean is centre_stiffness, which must be larger; "
        "only with rotation full, scheme general, paper or modal",
        "N/m",
        symbol="k_d",
        later=True,
    )
    damping_difference: Finite = given(
        0.0,
        "half the difference of the suspension's damping along x and y, (c_x - "
        "c_y)/2; in the static frame; at most their mean, which suspension_damping "
        "sets; only with rotation full, scheme general, paper or modal",
        "N s/m",
        symbol="c_d",
        later=True,
    )
    film_viscosity: NonNegative = given(
        0.0,
        "viscosity of the oil of a squeeze-film damper at the centre, in parallel "
        "with the suspension; short-bearing theory without cavitation; 0: no film; "
        "only with rotation full, scheme general, paper or modal",
        "Pa s",
        symbol="μ_f",
        later=True,
    )
    film_length: Positive = given(
        0.03, "axial length L of the squeeze film", "m", symbol="L_f", later=True
    )
    film_radius: Positive = given(
        0.06, "radius R of the squeeze film", "m", symbol="R_f", later=True
    )
    film_clearance: Positive = given(
        2e-4,
        "radial clearance c of the squeeze film; the centre should not move farther, "
        "which the result centre_peak shows",
        "m",
        symbol="c_f",
        later=True,
    )
    bearing: Annotated[str, AfterValidator(bearing_table)] = given(
        "",
        "table of a bearing's coefficients over speed; it replaces springs and damper "
        "at the centre; a CSV or TOML file with the columns frequency, rad/s, kxx, "
        "kxy, kyx, kyy, cxx, cxy, cyx, cyy; stored as text; only with rotation full, "
        "not with a rotor from file",
        later=True,
    )
    lost_blade: int = given(
        NO_BLADE,
        "number of the blade that is lost when the run begins, counted from 0; -1: "
        "none; the others are then unbalanced; only with rotation full, not with a "
        "rotor from file",
        ge=NO_BLADE,
        later=True,
    )
    shaft: Literal["springs", "cantilever", "two bearings"] = given(
        "springs",
        "what holds the centre; springs: centre_stiffness, and the disk does not "
        "tilt; cantilever: a shaft clamped at one end; two bearings: a shaft that "
        "overhangs the second one; both are round and massless, and the disk tilts on "
        "them; only with rotation full, not with a rotor from file",
        later=True,
    )
    shaft_length: Positive = given(
        0.6,
        "length L of a cantilever, or distance L_1 of two bearings",
        "m",
        symbol="L_1",
        later=True,
    )
    shaft_overhang: Positive = given(
        0.4,
        "distance L_2 from the second bearing to the disk",
        "m",
        symbol="L_2",
        later=True,
    )
    shaft_diameter: Positive = given(0.1, "diameter of a round shaft", "m", later=True)
    shaft_young: Positive = given(
        210e9, "Young's modulus of the shaft", "Pa", later=True
    )
    polar_inertia: NonNegative = given(
        0.0,
        "moment of inertia of a tilting disk about the axis of rotation; 0: that of "
        "the bladed disk's beams",
        "kg m^2",
        symbol="I_p",
        later=True,
    )
    tilt_inertia: NonNegative = given(
        0.0,
        "moment of inertia of a tilting disk about a diameter; 0: half the polar one, "
        "as for a thin disk",
        "kg m^2",
        symbol="I_d",
        later=True,
    )
    mistuning: Annotated[tuple[Change, ...], BeforeValidator(as_tuple)] = given(
        (),
        "relative change delta_j of each blade's Young's modulus; N numbers, E_j = E "
        "(1 + delta_j); the disk does not change; swept as a list of such lists; not "
        "with a rotor from file",
    )

    @property
    def is_uneven(self) -> bool:
        """Whether the sectors of the rotor differ: mistuned, or with a lost blade."""
        return bool(self.mistuning) or self.lost_blade != NO_BLADE
