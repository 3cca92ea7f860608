"""The inputs of a case as frozen data that check themselves. SI units."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal, Self

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    model_validator,
)

from hpcwhirl.scene.anchor import anchored
from hpcwhirl.scene.quantity import given
from hpcwhirl.scene.schemes import DEFAULT, MEANINGS, SchemeName

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Change = Annotated[float, Field(gt=-1, allow_inf_nan=False)]
AS_THE_REST = -1.0  # of a damping ratio of its own: none
MOST_STEPS = 1e13
MOST_GAP = 10.0  # tip radii


def _as_tuple(value: Any) -> Any:
    """Return a list as the tuple that a frozen input keeps."""
    return tuple(value) if isinstance(value, list) else value


def _own_ratio(value: float) -> float:
    """Check a damping ratio that some modes may have of their own."""
    if value < 0.0 and value != AS_THE_REST:
        msg = f"must be >= 0, or -1 for that of the other modes, got {value}"
        raise ValueError(msg)
    return value


OwnRatio = Annotated[Finite, AfterValidator(_own_ratio)]


def end_time(duration: float, revolutions: float, speed: float) -> float:
    """Return the engine time, s, of a duration, s, or of revolutions, if > 0."""
    if revolutions > 0:
        return revolutions * 2 * math.pi / abs(speed)
    return duration


class Inputs(BaseModel):
    """Base: frozen, strict about unknown keys, strict about types."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", strict=True, validate_default=True
    )


class Rotor(Inputs):
    """Bladed disk in the rotating frame (reference §1).

    A blade is clamped on the disk's rim at `disk_radius` and tapers linearly in
    thickness. Spokes (centre to blade root) and rim beams (root to root) stand
    for the disk.
    """

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
        "modes tell the suspension",
    )
    mistuning: Annotated[tuple[Change, ...], BeforeValidator(_as_tuple)] = given(
        (),
        "relative change of each blade's Young's modulus, N numbers; E_j = E (1 + "
        "delta_j), the disk stays as it is; swept as a list of such lists; not of a"
        " rotor from file",
    )

    @model_validator(mode="after")
    def _a_change_a_blade(self) -> Self:
        count = len(self.mistuning)
        if count not in {0, self.blades}:
            msg = (
                f"mistuning must be [] or {self.blades} numbers, one a blade, "
                f"got {count}"
            )
            raise ValueError(msg)
        return self

    @model_validator(mode="after")
    def _disk_inside(self) -> Self:
        if self.disk_radius >= self.radius:
            msg = (
                f"disk_radius must be < radius ({self.radius} m), "
                f"got {self.disk_radius}"
            )
            raise ValueError(msg)
        return self


class Casing(Inputs):
    """Casing in the static frame: an elastic ring, or rigid and distorted."""

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

    @model_validator(mode="after")
    def _families_of_harmonics(self) -> Self:
        if self.families != "all" and self.discretization != "fourier":
            msg = (
                f"families must be all on a ring of {self.discretization}, "
                f"got {self.families}"
            )
            raise ValueError(msg)
        return self


class Engine(Inputs):
    """The structures; `four_motions` is the default."""

    name: str = given("four_motions", "name of the engine", max_length=200)
    file: Annotated[str, AfterValidator(anchored)] = given(
        "",
        "HDF5 file of a reduced rotor, used for this one; layout: that of `hpcwhirl"
        " export-model`; one regular file of at most 2 GiB; a relative path starts "
        "at the TOML file that names it, from --set at the working directory",
    )
    rotor: Rotor = Rotor()
    casing: Casing = Casing()

    @model_validator(mode="after")
    def _a_file_is_as_it_is(self) -> Self:
        if self.file and self.rotor.mistuning:
            msg = f"rotor.mistuning must be [] with a rotor from file, got {self.file}"
            raise ValueError(msg)
        return self

    @model_validator(mode="after")
    def _a_casing_has_its_file(self) -> Self:
        if self.casing.discretization == "file" and not self.file:
            msg = "file must be named where casing.discretization is file, got none"
            raise ValueError(msg)
        return self


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
        0.1, "tip displacement over R_bd at which a run ends"
    )


class Output(Inputs):
    """What is kept of a run."""

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


class Scene(Inputs):
    """One case: engine, operating point, loading, solver and output."""

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
    duration: Positive = given(
        2.5, "engine time; or revolutions > 0; words: on its last 40 %", "s"
    )
    revolutions: NonNegative = given(
        0.0, "if > 0: the engine time in revolutions, not s"
    )
    solver: Solver = Solver()
    output: Output = Output()

    @model_validator(mode="after")
    def _ring_carries_the_load(self) -> Self:
        casing = self.engine.casing
        most, what = casing.elements // 2, f"{casing.elements} elements"
        if casing.discretization != "elements":
            most, what = casing.harmonics, f"{casing.harmonics} harmonics"
        if casing.kind == "ring" and self.nodal_diameter > most:
            msg = (
                f"nodal_diameter must be <= {most} on a ring of {what}, "
                f"got {self.nodal_diameter}"
            )
            raise ValueError(msg)
        return self

    @model_validator(mode="after")
    def _revolutions_need_a_speed(self) -> Self:
        if self.revolutions > 0 and self.speed == 0:
            msg = "revolutions must be 0 where speed is 0, got revolutions > 0"
            raise ValueError(msg)
        return self

    @model_validator(mode="after")
    def _countable_steps(self) -> Self:
        step, last = self.solver.time_step, max(self.end_times)
        if last > MOST_STEPS * step:
            msg = (
                f"time_step must be >= {last / MOST_STEPS:.3g} s "
                f"({MOST_STEPS:g} steps), got {step}"
            )
            raise ValueError(msg)
        return self

    @model_validator(mode="after")
    def _lasts_as_long_as_asked(self) -> Self:
        longest = self.solver.longest
        if self.solver.until == "decided" and longest < self.end_time:
            msg = f"longest must be >= {self.end_time:g} s (duration), got {longest:g}"
            raise ValueError(msg)
        return self

    @model_validator(mode="after")
    def _gap_of_a_ring(self) -> Self:
        radius = self.engine.rotor.radius
        if self.gap > MOST_GAP * radius:
            msg = f"gap must be <= {MOST_GAP * radius:g} m, got {self.gap}"
            raise ValueError(msg)
        return self

    @property
    def end_time(self) -> float:
        """Engine time to simulate, s."""
        return end_time(self.duration, self.revolutions, self.speed)

    @property
    def end_times(self) -> tuple[float, ...]:
        """Engine times, s, at which the word of the case is asked for.

        Each is twice the one before: the window of a word, the last 40 % of a run,
        then holds nothing that an earlier word was given by.
        """
        times = [self.end_time]
        if self.solver.until == "decided":
            while times[-1] < self.solver.longest:
                times.append(min(2.0 * times[-1], self.solver.longest))
        return tuple(times)

    @property
    def has_harmonics(self) -> bool:
        """Whether the casing is round, no elements: its modes come in harmonics."""
        casing = self.engine.casing
        return casing.kind == "rigid" or casing.discretization != "elements"

    @property
    def is_loaded(self) -> bool:
        """Whether a pulse loads the casing; a rigid one takes none."""
        return self.engine.casing.kind == "ring" and self.force > 0.0
