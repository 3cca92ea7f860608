"""The inputs of a case as frozen, validated data in SI units."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationError,
    model_validator,
)
from pydantic_core import PydanticCustomError

from hpcwhirl.scene import contact_laws
from hpcwhirl.scene.bearing import bearing_table
from hpcwhirl.scene.history import checked
from hpcwhirl.scene.over_time import table_over_time
from hpcwhirl.scene.profile import profile_table
from hpcwhirl.scene.quantity import given, quantity_of
from hpcwhirl.scene.resolve_path import anchored, printable
from hpcwhirl.scene.rule import Rule
from hpcwhirl.scene.rules import (
    AS_THE_REST,
    NO_BLADE,
    OF_CASING,
    OF_ENGINE,
    OF_ROTOR,
    OF_SCENE,
    end_time,
)
from hpcwhirl.scene.schemes import DEFAULT, MEANINGS, SchemeName
from hpcwhirl.scene.units import in_si, measure


def _one_zero(value: float) -> float:
    """Return 0.0 for -0.0, which are equal but would have different digests."""
    return value + 0.0


Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[
    float, Field(ge=0, allow_inf_nan=False), AfterValidator(_one_zero)
]
Finite = Annotated[float, Field(allow_inf_nan=False), AfterValidator(_one_zero)]
Change = Annotated[float, Field(gt=-1, allow_inf_nan=False), AfterValidator(_one_zero)]
WRONG_UNIT = "wrong_unit"  # type of the pydantic error for a wrong unit


def _as_tuple(value: Any) -> Any:
    """Return a list as a tuple, which is immutable; other values unchanged."""
    return tuple(value) if isinstance(value, list) else value


def _own_ratio(value: float) -> float:
    """Return a damping ratio after a check: >= 0, or -1 for that of other modes."""
    if value < 0.0 and value != AS_THE_REST:
        msg = f"must be >= 0, or -1 for that of the other modes, got {value}"
        raise ValueError(msg)
    return value


def speed_over_time(text: str) -> str:
    """Return a table of speeds over time as one line of text, see `table_over_time`."""
    return table_over_time(text, "speed")


def gap_over_time(text: str) -> str:
    """Return a table of gaps over time as one line of text, see `table_over_time`."""
    return table_over_time(text, "gap")


OwnRatio = Annotated[Finite, AfterValidator(_own_ratio)]


def _converted(name: str, value: Any, unit: str) -> Any:
    """Return a value converted to SI, or raise an error that pydantic reports."""
    try:
        return in_si(value, unit)
    except ValueError as failed:
        told = {"told": f"{name} {failed}"}
        raise PydanticCustomError(WRONG_UNIT, "{told}", told) from None


class Inputs(BaseModel):
    """Base class of all tables of inputs: frozen, strict about unknown keys and types.

    Attributes
    ----------
    RULES : rules between the inputs of the table and of the tables inside it
    """

    RULES: ClassVar[tuple[Rule, ...]] = ()
    model_config = ConfigDict(
        frozen=True, extra="forbid", strict=True, validate_default=True
    )

    @model_validator(mode="before")
    @classmethod
    def _in_si(cls, data: Any) -> Any:
        """Convert numbers with units, such as "0.8 mm", to SI."""
        if not isinstance(data, dict):
            return data
        for name in [name for name, value in data.items() if measure(value)]:
            field = cls.model_fields.get(name)
            if field is not None and field.annotation is float:
                unit, value = quantity_of(field).unit, data[name]
                data = {**data, name: _converted(name, value, unit)}
        return data

    @model_validator(mode="after")
    def _keeps_rules(self) -> Self:
        for rule in self.RULES:
            rule.check(self)
        return self


class Rotor(Inputs):
    """Bladed disk in the rotating frame (reference §1).

    A blade is clamped on the disk's rim at `disk_radius` and tapers linearly in
    thickness. Spokes (centre to blade root) and rim beams (root to root) stand
    for the disk.
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
        0.77753, "thickness of a blade at the tip over that at the root"
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
        "its suspension modes are recognised; with rotation full it holds at rest, "
        "and the excess over `damping` is due to a damper that does not rotate",
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
    mistuning: Annotated[tuple[Change, ...], BeforeValidator(_as_tuple)] = given(
        (),
        "relative change delta_j of each blade's Young's modulus; N numbers, E_j = E "
        "(1 + delta_j); the disk does not change; swept as a list of such lists; not "
        "with a rotor from file",
    )

    @property
    def is_uneven(self) -> bool:
        """Whether the sectors of the rotor differ: mistuned, or with a lost blade."""
        return bool(self.mistuning) or self.lost_blade != NO_BLADE


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
        "of the ring: harmonics, the paper's elements, or file: a round casing of the "
        "table in engine.file; its sections, support and damping count for nothing "
        "then; shell: harmonics of a cylindrical shell, simply supported at both ends, "
        "its length the width",
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
        "amplitude A0 of the distortion of a rigid casing; must begin outside the "
        "blades",
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
        "distance of the rotor's axis from that of the casing, both at rest; the gap "
        "is narrower by it at offset_angle, and wider opposite",
        "m",
        symbol="e",
        later=True,
    )
    offset_angle: Finite = given(
        0.0, "angle to which the rotor's axis lies off", "rad", later=True
    )
    profile_rise: NonNegative = given(
        0.0,
        "time in which profile and offset fade in, smoothly; 0: held from the start; "
        "50 steps at least where they come into the blades",
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
        "rods K of a layer under the edge of one tip; a numerical choice; around the "
        "casing stand M = 2 pi R K / layer_edge of them, rounded",
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


class Engine(Inputs):
    """Rotor and casing; the default is the engine `four_motions`."""

    RULES = OF_ENGINE

    name: Annotated[str, AfterValidator(printable)] = given(
        "four_motions",
        "name of the engine; a label without control characters",
        max_length=200,
    )
    file: Annotated[str, AfterValidator(anchored)] = given(
        "",
        "HDF5 file of a reduced rotor that replaces the built-in one; its layout is "
        "that of `hpcwhirl export-model`; a regular file of at most 2 GiB; a relative "
        "path starts at the TOML file that names it, with --set at the working "
        "directory",
    )
    rotation: Literal["none", "full", "auto"] = given(
        "none",
        "effects of rotation on the rotor; none: none, as in the paper; full: "
        "Coriolis terms, centrifugal stiffening and softening, and supports that "
        "stand still; a rotor from file must have these terms; `gap_at` says at which "
        "speed `gap` is measured; auto: none if the centre is clamped and no wave "
        "changes by more than 1 % or `accuracy`, else full",
    )
    rotor: Rotor = Rotor()
    casing: Casing = Casing()


class Solver(Inputs):
    """Inputs of the reduction and of the time integration."""

    scheme: SchemeName = given(DEFAULT, f"integrator; {MEANINGS}")
    time_step: Positive = given(
        1e-6,
        "time step; if it is unstable it is refused, and the message gives the limit",
        "s",
    )
    accuracy: NonNegative = given(
        0.0,
        "if > 0: largest relative error of the rotor's damped frequencies; sets the "
        "time step, to at most 0.9 of what stability, pulse and speed allow",
    )
    truncation: NonNegative = given(
        0.0,
        "if > 0: estimated relative error of motions due to modes left out; sets "
        "modes, and for a ring of harmonics also harmonics and families; without "
        "effect for unequal sectors, for rings of elements and for rotors given by "
        "modes only",
    )
    modes: int = given(
        110,
        "number eta of fixed-interface modes in the Craig-Bampton reduction; a rotor "
        "from file has its own number, of which truncation takes a part",
        symbol="η",
        ge=0,
    )
    plan: Literal["lean", "everything"] = given(
        "lean",
        "what is computed; lean: only what the scene requires; everything: all of it; "
        "`--explain` says what is left out, and why",
    )
    until: Literal["end", "certain", "decided"] = given(
        "end",
        "when a run ends; end: after its duration; certain: (scheme modal) as soon as "
        "its word is proved; decided: after its duration, but an undecided case goes "
        "on to twice its time, again and again, until it is decided or has reached "
        "`longest`",
    )
    longest: Positive = given(
        20.0,
        "with until = decided: engine time of a case at most; not below duration",
        "s",
    )
    amplitude_limit: Positive = given(
        0.1,
        "tip displacement over R_bd at which a run ends; its radial and "
        "tangential parts together, as a vector",
    )


class Output(Inputs):
    """Inputs on which results of a run are kept, in which detail."""

    traces: Literal["summary", "blades", "orbit", "full"] = given(
        "orbit",
        "what is kept of a run; summary: numbers only; blades: also amplitude numbers "
        "of the blades, from the tips' positions at every interval; orbit: centre, "
        "energy, work and losses over time; full: also all tips, each blade's impulse "
        "and the casing; words do not depend on it",
    )
    interval: Positive = given(
        2e-4, "time between samples of the traces; words do not depend on it", "s"
    )
    windows: int = given(
        20,
        "windows of equal time by which a run whose speed or gap changes has its words "
        "told, each judged by the same rules",
        ge=1,
        le=200,
        later=True,
    )
    chaos: NonNegative = given(
        0.0,
        "if > 0: number of revolutions after the end of a sustained case over which "
        "its largest Lyapunov exponent, period and 0-1 test are measured; this takes "
        "two more runs of that length; at least 40, some 200 for a word",
        later=True,
    )


class _Told(type(Inputs)):  # type: ignore[misc]
    """Metaclass of `Scene`: its validation errors are InputErrors of one line."""

    def __call__(cls, *args: Any, **inputs: Any) -> Any:
        try:
            return super().__call__(*args, **inputs)
        except ValidationError as failed:
            from hpcwhirl.scene.files import told_by  # imports this module

            raise told_by(failed) from None


class Scene(Inputs, metaclass=_Told):
    """One case: engine, operating point, loading, solver and output."""

    RULES = OF_SCENE

    engine: Engine = Engine()
    speed: Finite = given(
        410.0,
        "rotational speed Omega; negative turns clockwise; per step, the rotor must "
        "turn by less than half the casing's shortest wave",
        "rad/s",
        symbol="Ω",
    )
    nodal_diameter: int = given(
        1,
        "number of lobes k of the loading; the pulse squeezes the casing at k lobes; "
        "at most the highest harmonic of the ring, or half its elements",
        symbol="k",
        ge=0,
    )
    gap: NonNegative = given(1.28e-4, "blade-tip clearance; at most 10 tip radii", "m")
    gap_at: Literal["speed", "rest"] = given(
        "speed",
        "speed at which the gap is measured; speed: the running speed; rest: at rest, "
        "and the radial growth of the tips then reduces the clearance; rest only with "
        "engine.rotation full",
        later=True,
    )
    friction: NonNegative = given(
        0.1, "Coulomb coefficient mu of friction between tips and casing", symbol="μ"
    )
    friction_law: contact_laws.FrictionName = given(
        contact_laws.FRICTION_NAMES[0],
        f"coefficient of friction; {contact_laws.FRICTIONS}",
        later=True,
    )
    friction_at_rest: NonNegative = given(
        0.2, "coefficient of Stribeck's law without sliding", symbol="μ_s", later=True
    )
    friction_speed: Positive = given(
        10.0,
        "sliding speed over which friction falls by 1/e, of Stribeck's law",
        "m/s",
        symbol="v_s",
        later=True,
    )
    force: NonNegative = given(
        75e3,
        "peak modal force; F(t) = F sin(pi t / tau) for 0 < t < tau",
        "N",
        symbol="F",
    )
    pulse: Positive = given(
        6.3e-4, "pulse duration tau; 10 time steps at least", "s", symbol="τ"
    )
    direction: Literal["squeeze", "stretch"] = given(
        "squeeze",
        "sense of the pulse at theta = 0; squeeze: the casing moves inward there; "
        "stretch: outward",
    )
    unbalance: NonNegative = given(
        0.0,
        "unbalance m e of the rotor at the disk's centre, mass times radius; causes a "
        "force m e Omega^2 that turns with the rotor; only with engine.rotation full "
        "and a free centre",
        "kg m",
        symbol="m e",
        later=True,
    )
    unbalance_phase: Finite = given(
        0.0,
        "angle from blade 0 to the unbalance, in the direction of theta",
        "rad",
        later=True,
    )
    start_energy: NonNegative = given(
        0.0,
        "energy of the motion that the run begins with, on modes of both bodies; 0: at "
        "rest; beside the pulse, which `force` = 0 leaves out; not with an unbalance",
        "J",
        symbol="E_0",
        later=True,
    )
    start_modes: Annotated[str, AfterValidator(printable)] = given(
        "rotor 1F 1",
        "modes that share start_energy; by body, family and nodal diameter as in "
        "`hpcwhirl model`, any of them, several by commas: rotor suspension, casing 2",
        max_length=200,
        later=True,
    )
    start_draw: NonNegative = given(
        0.0,
        "number that draws how modes share start_energy; uniform over the shell of "
        "that energy; sweep whole numbers, or draw it by [sample], uniform from 0 to 1",
        later=True,
    )
    start_as: Literal["velocities", "both"] = given(
        "velocities",
        "what the start gives the modes; velocities: these alone, so that gaps are "
        "open; both: displacements, too, and a case with a gap then closed is refused",
        later=True,
    )
    branch: Annotated[str, AfterValidator(printable)] = given(
        "",
        "direction in which the input of [branch] was swept to this case; up or down; "
        "set by [branch]",
        max_length=100,
        later=True,
    )
    history: Annotated[str, AfterValidator(checked)] = given(
        "",
        "cases that precede this one on its branch; an input and its values: the "
        "first of them began with its pulse, each other one where the one before had "
        "ended; set by [branch]",
        later=True,
    )
    acceleration: Finite = given(
        0.0,
        "rate at which the speed changes from `speed` on, a run-up or run-down; of a "
        "smooth change the mean rate, of a decay the first; 0: constant speed",
        "rad/s^2",
        symbol="dΩ/dt",
        later=True,
    )
    ramp: Literal["linear", "smooth", "decay"] = given(
        "linear",
        "how the speed changes; linear: to speed_to where that lies ahead, else to the "
        "end; smooth: half a cosine to speed_to; decay: speed_to is approached "
        "exponentially, with the time constant (speed_to - speed) / acceleration, as by"
        " windmilling",
        later=True,
    )
    speed_to: Finite = given(
        0.0, "speed to which it changes; see `ramp`", "rad/s", later=True
    )
    speed_table: Annotated[str, AfterValidator(speed_over_time)] = given(
        "",
        "table of the speed, instead of acceleration; a CSV file of columns time, s, "
        "and speed, rad/s, or such rows in one line; linear between rows, then held; "
        "kept as text",
        later=True,
    )
    gap_closure: Finite = given(
        0.0,
        "part Delta of the gap that is lost in time, as by heat; gap(t) = gap - Delta "
        "(1 - exp(-t/gap_time)); < 0: it opens",
        "m",
        symbol="Δ",
        later=True,
    )
    gap_time: Positive = given(
        1.0, "time constant of the gap's closure", "s", symbol="τ_g", later=True
    )
    gap_table: Annotated[str, AfterValidator(gap_over_time)] = given(
        "",
        "table of the gap, instead of gap_closure; a CSV file of columns time, s,"
        " and gap, m, or such rows in one line; its first gap is `gap`; linear between "
        "rows, then held; kept as text",
        later=True,
    )
    duration: Positive = given(
        2.5,
        "engine time of the run; unless revolutions > 0; its last 40 % decide the "
        "words",
        "s",
    )
    revolutions: NonNegative = given(
        0.0, "if > 0: engine time of the run in revolutions, not s"
    )
    solver: Solver = Solver()
    output: Output = Output()

    @property
    def end_time(self) -> float:
        """Engine time to simulate, s."""
        end: float = end_time(self.duration, self.revolutions, self.speed)
        return end

    @property
    def end_times(self) -> tuple[float, ...]:
        """Engine times at which the word of the case is determined, s, ascending.

        Each is twice the one before, so that the window of a word, the last 40 % of the
        run, does not overlap the window of an earlier word.
        """
        times = [self.end_time]
        if self.solver.until == "decided":
            while times[-1] < self.solver.longest:
                times.append(min(2.0 * times[-1], self.solver.longest))
        return tuple(times)

    @property
    def has_harmonics(self) -> bool:
        """Whether the casing's modes are harmonics: not a ring of elements."""
        casing = self.engine.casing
        return casing.kind == "rigid" or casing.discretization != "elements"

    @property
    def is_loaded(self) -> bool:
        """Whether a pulse loads the casing: an elastic ring with a force > 0."""
        return self.engine.casing.kind == "ring" and self.force > 0.0
