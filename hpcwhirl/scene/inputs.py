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

from hpcwhirl.scene.bearing import bearing_table
from hpcwhirl.scene.history import checked
from hpcwhirl.scene.quantity import given, quantity_of
from hpcwhirl.scene.resolve_path import anchored, printable
from hpcwhirl.scene.rules import (
    AS_THE_REST,
    NO_BLADE,
    OF_CASING,
    OF_ENGINE,
    OF_ROTOR,
    OF_SCENE,
    Rule,
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
WRONG_UNIT = "wrong_unit"  # type of the error


def _as_tuple(value: Any) -> Any:
    """Return a list as a tuple, which cannot be changed, other values as they are."""
    return tuple(value) if isinstance(value, list) else value


def _own_ratio(value: float) -> float:
    """Check the damping ratio of special modes: >= 0, or -1 for the general ratio."""
    if value < 0.0 and value != AS_THE_REST:
        msg = f"must be >= 0, or -1 for that of the other modes, got {value}"
        raise ValueError(msg)
    return value


OwnRatio = Annotated[Finite, AfterValidator(_own_ratio)]


def _converted(name: str, value: Any, unit: str) -> Any:
    """Return a value converted to SI, or raise an error that pydantic reports."""
    try:
        return in_si(value, unit)
    except ValueError as failed:
        told = {"told": f"{name} {failed}"}
        raise PydanticCustomError(WRONG_UNIT, "{told}", told) from None


class Inputs(BaseModel):
    """Base of all tables of inputs: frozen, strict about unknown keys and types.

    Attributes
    ----------
    RULES : rules between its inputs and those of the tables inside it
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
        "number of blades N; of a rotor from file: that of the file",
        symbol="N",
        ge=1,
        le=1000,
    )
    elements: int = given(
        10, "elements a blade; 3 N (elements + 1) <= 15000", ge=1, le=1000
    )
    radius: Positive = given(
        0.5,
        "tip radius R_bd; sets the casing's radius also of a rotor from file",
        "m",
        symbol="R_bd",
    )
    disk_radius: Positive = given(0.035891, "radius of the rim; less than radius", "m")
    blade_width: Positive = given(0.13275, "blade, out of plane", "m")
    root_thickness: Positive = given(0.010548, "blade at the root", "m")
    taper: Positive = given(0.77753, "tip over root thickness")
    spoke_width: Positive = given(
        0.0039693, "spoke, centre to blade root, out of plane", "m"
    )
    spoke_thickness: Positive = given(0.051338, "spoke, in plane", "m")
    rim_width: Positive = given(
        0.99966,
        "rim beam, root to root, out of plane; spoke and rim sections are what the "
        "disk's beams need to show the paper's frequencies, not a picture of a disk",
        "m",
    )
    rim_thickness: Positive = given(0.0080619, "rim beam, in plane", "m")
    young: Positive = given(210e9, "Young's modulus", "Pa", symbol="E")
    density: Positive = given(7800.0, "density", "kg/m^3", symbol="ρ")
    centre: Literal["free", "clamped"] = given(
        "free", "shaft centre; free: held by the shaft's springs k_o"
    )
    centre_stiffness: Positive = given(
        3.4e7, "stiffness k_o of the shaft at the centre", "N/m", symbol="k_o"
    )
    damping: NonNegative = given(
        0.0085,
        "modal damping ratio xi; of a rotor from file: taken where it has none",
        symbol="ξ",
    )
    suspension_damping: OwnRatio = given(
        0.0275,
        "damping ratio of the suspension modes; as a squeeze film gives; -1: as the"
        " other modes; of a rotor from file: taken where it has no damping and its "
        "modes tell the suspension; with rotation full: at rest, what is more than "
        "`damping` by a damper that stands",
    )
    cross_coupling: Finite = given(
        0.0,
        "cross-coupled stiffness k_q of the suspension; it pushes the centre 90 degrees"
        " ahead of its displacement, forward where > 0; with rotation full alone",
        "N/m",
        symbol="k_q",
    )
    stiffness_difference: Finite = given(
        0.0,
        "half the difference of the shaft's stiffnesses along x and y, (k_x - k_y)/2; "
        "in the static frame, k_o is their mean; smaller than centre_stiffness; with "
        "rotation full alone, scheme general, paper or modal",
        "N/m",
        symbol="k_d",
        later=True,
    )
    damping_difference: Finite = given(
        0.0,
        "half the difference of the damping of the suspension along x and y, (c_x - "
        "c_y)/2; in the static frame; at most the mean, that of suspension_damping; "
        "with rotation full alone, scheme general, paper or modal",
        "N s/m",
        symbol="c_d",
        later=True,
    )
    film_viscosity: NonNegative = given(
        0.0,
        "viscosity of the oil of a squeeze-film damper at the centre, beside the "
        "suspension; a short film without cavitation; 0: no film; with rotation full "
        "alone, scheme general, paper or modal",
        "Pa s",
        symbol="μ_f",
        later=True,
    )
    film_length: Positive = given(
        0.03, "axial length L of the squeeze film", "m", symbol="L_f", later=True
    )
    film_radius: Positive = given(
        0.06, "radius R of the squeeze film's ring", "m", symbol="R_f", later=True
    )
    film_clearance: Positive = given(
        2e-4,
        "radial clearance c of the squeeze film, beyond which no centre should go; the "
        "evidence is centre_peak",
        "m",
        symbol="c_f",
        later=True,
    )
    bearing: Annotated[str, AfterValidator(bearing_table)] = given(
        "",
        "table over speed of a bearing at the centre, for springs and damper there; "
        "a CSV or TOML file of columns frequency, rad/s, kxx, kxy, kyx, kyy, cxx, cxy, "
        "cyx, cyy; kept as text; with rotation full alone, not of a rotor from file",
        later=True,
    )
    lost_blade: int = given(
        NO_BLADE,
        "blade that is lost as a run begins, counted from 0; -1: none; the others are "
        "then unbalanced; with rotation full alone, not of a rotor from file",
        ge=NO_BLADE,
        later=True,
    )
    shaft: Literal["springs", "cantilever", "two bearings"] = given(
        "springs",
        "what holds the centre; springs: centre_stiffness, no tilt; cantilever, or "
        "overhung beyond two bearings: a massless round shaft on which the disk tilts, "
        "too; with rotation full alone, not of a rotor from file",
        later=True,
    )
    shaft_length: Positive = given(
        0.6,
        "length L of a cantilever, or between two bearings L_1",
        "m",
        symbol="L_1",
        later=True,
    )
    shaft_overhang: Positive = given(
        0.4, "from the second bearing to the disk", "m", symbol="L_2", later=True
    )
    shaft_diameter: Positive = given(0.1, "of a round shaft", "m", later=True)
    shaft_young: Positive = given(
        210e9, "Young's modulus of the shaft", "Pa", later=True
    )
    polar_inertia: NonNegative = given(
        0.0,
        "moment of inertia about the axis of rotation; of a disk that tilts; 0: that of"
        " the bladed disk's beams",
        "kg m^2",
        symbol="I_p",
        later=True,
    )
    tilt_inertia: NonNegative = given(
        0.0,
        "moment of inertia about a diameter; of a disk that tilts; 0: half of the polar"
        " one, as of a thin disk",
        "kg m^2",
        symbol="I_d",
        later=True,
    )
    mistuning: Annotated[tuple[Change, ...], BeforeValidator(_as_tuple)] = given(
        (),
        "relative change of each blade's Young's modulus, N numbers; E_j = E (1 + "
        "delta_j), the disk stays as it is; swept as a list of such lists; not of a"
        " rotor from file",
    )

    @property
    def is_uneven(self) -> bool:
        """Whether its sectors are not equal."""
        return bool(self.mistuning) or self.lost_blade != NO_BLADE


class Casing(Inputs):
    """Casing in the static frame: an elastic ring, or a rigid one of given shape."""

    RULES = OF_CASING

    kind: Literal["ring", "rigid"] = given(
        "ring",
        "elastic or rigid; rigid: prescribed distortion -A0 exp(sigma t) cos(k "
        "theta), fixed in the static frame",
    )
    discretization: Literal["fourier", "elements", "file"] = given(
        "fourier",
        "of the ring: harmonics, the paper's elements, or file: a round casing of the "
        "table in engine.file; its sections, support and damping count for nothing "
        "then",
    )
    harmonics: int = given(
        20,
        "highest harmonic H; two modes a harmonic and phase",
        symbol="H",
        ge=1,
        le=1000,
    )
    families: Literal["all", "bending"] = given(
        "all",
        "modes of a ring of harmonics: all, or none that stretch it; those that "
        "stretch it set the limit of the step",
    )
    elements: int = given(
        40,
        "curved beam elements of the ring; 4 degrees of freedom a node",
        ge=3,
        le=2000,
    )
    thickness: Positive = given(0.0413, "radial thickness", "m")
    width: Positive = given(0.322, "axial width", "m")
    young: Positive = given(210e9, "Young's modulus", "Pa", symbol="E")
    density: Positive = given(7800.0, "density", "kg/m^3", symbol="ρ")
    support_frequency: NonNegative = given(
        15.0,
        "foundation frequency omega_c1; stiffness of the foundation k_f = rho A "
        "omega_c1^2",
        "rad/s",
        symbol="ω_c1",
    )
    damping: NonNegative = given(0.064, "modal damping ratio xi", symbol="ξ")
    support_damping: OwnRatio = given(
        0.375,
        "damping ratio of the modes on the support; as an elastic mounting gives; "
        "-1: as the other modes",
    )
    amplitude: Finite = given(
        0.0, "rigid: distortion A0; begins outside the blades", "m", symbol="A0"
    )
    growth: Finite = given(
        0.0,
        "rigid: sigma of A0 exp(sigma t); at most 5 % a step where it rises into "
        "the blades",
        "1/s",
        symbol="σ",
    )
    rise: NonNegative = given(
        1e-3,
        "rigid: smooth rise of A0; 50 steps at least where it rises into the blades",
        "s",
    )


class Engine(Inputs):
    """Rotor and casing; the default is the engine `four_motions`."""

    RULES = OF_ENGINE

    name: Annotated[str, AfterValidator(printable)] = given(
        "four_motions", "name of the engine, no control characters", max_length=200
    )
    file: Annotated[str, AfterValidator(anchored)] = given(
        "",
        "HDF5 file of a reduced rotor, used for this one; layout: that of `hpcwhirl"
        " export-model`; one regular file of at most 2 GiB; a relative path starts "
        "at the TOML file that names it, from --set at the working directory",
    )
    rotation: Literal["none", "full", "auto"] = given(
        "none",
        "what rotation adds to the rotor; none: nothing, as in the paper; full: "
        "Coriolis, centrifugal stiffening and softening, and supports that stand; of a "
        "rotor from file if that has them; `gap` is the clearance as `gap_at` says; "
        "auto: none in cases with a clamped centre where these change no wave by more "
        "than 1 % or `accuracy`, else full",
    )
    rotor: Rotor = Rotor()
    casing: Casing = Casing()


class Solver(Inputs):
    """Reduction and time integration."""

    scheme: SchemeName = given(DEFAULT, f"integrator; {MEANINGS}")
    time_step: Positive = given(
        1e-6, "time step; refused, with the limit, where it is not stable", "s"
    )
    accuracy: NonNegative = given(
        0.0,
        "if > 0: relative error of rotor frequencies that sets the step; no damped "
        "frequency of the rotor is wrong by more; at most 0.9 of what stability, "
        "pulse and turn allow",
    )
    truncation: NonNegative = given(
        0.0,
        "if > 0: relative error of motions by modes left out; sets modes, and of a "
        "ring of harmonics its harmonics and families; an estimate; of rotors of "
        "unequal sectors and rings of elements it changes nothing; of modes alone "
        "none are left out",
    )
    modes: int = given(
        110,
        "fixed-interface modes eta; of the Craig-Bampton reduction; not used with a"
        " rotor from file, whose truncation counts them",
        symbol="η",
        ge=0,
    )
    plan: Literal["lean", "everything"] = given(
        "lean",
        "what is modelled: what the scene requires, or all of it; `--explain` says "
        "what is left out, and why",
    )
    until: Literal["end", "certain", "decided"] = given(
        "end",
        "run to the end; certain: (modal) until the word is proved; decided: as end, "
        "and a case that is undecided then goes on to twice its time, again and again, "
        "until it is decided or has lasted longest",
    )
    longest: Positive = given(
        20.0, "until = decided: engine time of a case at most; at least duration", "s"
    )
    amplitude_limit: Positive = given(
        0.1,
        "tip displacement over R_bd, radial and tangential together, at which a run "
        "ends",
    )


class Output(Inputs):
    """Detail of the results that are kept of a run."""

    traces: Literal["summary", "blades", "orbit", "full"] = given(
        "orbit",
        "detail; summary: numbers only; blades: also numbers of how far each blade "
        "moves, by tips every interval; orbit: centre, energy, what feeds and what "
        "is lost; full: also all tips, each blade's impulse, the casing. Words do "
        "not depend on it",
    )
    interval: Positive = given(
        2e-4, "time between samples; of the traces kept; words do not depend on it", "s"
    )
    chaos: NonNegative = given(
        0.0,
        "if > 0: revolutions after the end of a sustained case over which its largest "
        "Lyapunov exponent, period and 0-1 test are measured; two marches more of that "
        "length; at least 40, for a word some 200",
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
        "rotational speed Omega; negative turns clockwise; less than half the "
        "casing's shortest wave a step",
        "rad/s",
        symbol="Ω",
    )
    nodal_diameter: int = given(
        1,
        "lobes k of the loading; the pulse squeezes the casing on k lobes; at most "
        "the ring's harmonics, or half its elements",
        symbol="k",
        ge=0,
    )
    gap: NonNegative = given(1.28e-4, "blade-tip clearance; at most 10 tip radii", "m")
    gap_at: Literal["speed", "rest"] = given(
        "speed",
        "when the gap is that: at the running speed, or at rest, from which the radial "
        "growth of the tips takes a part; with engine.rotation full alone",
        later=True,
    )
    friction: NonNegative = given(0.1, "Coulomb coefficient mu", symbol="μ")
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
        "squeeze", "of the casing at theta = 0"
    )
    unbalance: NonNegative = given(
        0.0,
        "unbalance m e of the rotor, mass times radius, at the disk's centre; a force m"
        " e Omega^2 that turns with the rotor; with engine.rotation full and a free "
        "centre alone",
        "kg m",
        symbol="m e",
        later=True,
    )
    unbalance_phase: Finite = given(
        0.0,
        "angle of the unbalance from blade 0, in the direction of theta",
        "rad",
        later=True,
    )
    branch: Annotated[str, AfterValidator(printable)] = given(
        "",
        "side from which the case was reached; up or down, set by [branch]",
        max_length=100,
        later=True,
    )
    history: Annotated[str, AfterValidator(checked)] = given(
        "",
        "cases through which it was reached; an input and its values: the first began "
        "with its pulse, each other where the one before had ended; set by [branch]",
        later=True,
    )
    duration: Positive = given(
        2.5, "engine time; or revolutions > 0; words: on its last 40 %", "s"
    )
    revolutions: NonNegative = given(
        0.0, "if > 0: the engine time in revolutions, not s"
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
        """Whether the casing's modes are harmonics: it is no ring of elements."""
        casing = self.engine.casing
        return casing.kind == "rigid" or casing.discretization != "elements"

    @property
    def is_loaded(self) -> bool:
        """Whether a pulse loads the casing: an elastic ring with a force > 0."""
        return self.engine.casing.kind == "ring" and self.force > 0.0
