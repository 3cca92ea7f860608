"""The inputs of a case as frozen, validated data in SI units."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, ValidationError

from hpcwhirl.scene import contact_laws
from hpcwhirl.scene.casing_inputs import Casing
from hpcwhirl.scene.history import checked
from hpcwhirl.scene.input_types import Finite, Inputs, NonNegative, Positive
from hpcwhirl.scene.over_time import table_over_time
from hpcwhirl.scene.quantity import given
from hpcwhirl.scene.resolve_path import anchored, printable
from hpcwhirl.scene.rotor_inputs import Rotor
from hpcwhirl.scene.rules import OF_ENGINE, OF_SCENE, end_time
from hpcwhirl.scene.schemes import DEFAULT, MEANINGS, SchemeName


def speed_over_time(text: str) -> str:
    """Return a table of speeds over time as one line of text, see `table_over_time`."""
    return table_over_time(text, "speed")


def gap_over_time(text: str) -> str:
    """Return a table of gaps over time as one line of text, see `table_over_time`."""
    return table_over_time(text, "gap")


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
        "Coriolis terms, centrifugal stiffening and softening, and supports that do "
        "not turn; a rotor from file must have these terms; `gap_at` says at which "
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
        "ratio of tip displacement to R_bd at which a run ends; its radial and "
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
        "number of windows of equal time into which a run whose speed or gap changes "
        "is divided; each window gets words by the same rules",
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
            from hpcwhirl.scene.input_errors import told_by  # imports this module

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
        "sliding speed v_s in exp(-|v| / v_s), by which Stribeck's friction falls",
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
        "energy of the initial motion, in modes of both bodies; 0: at rest; the pulse "
        "acts in addition, unless `force` is 0; not with an unbalance",
        "J",
        symbol="E_0",
        later=True,
    )
    start_modes: Annotated[str, AfterValidator(printable)] = given(
        "rotor 1F 1",
        "modes that share start_energy; by body, family and nodal diameter as in "
        "`hpcwhirl model`, or by some of these three, and several separated by commas: "
        "rotor suspension, casing 2",
        max_length=200,
        later=True,
    )
    start_draw: NonNegative = given(
        0.0,
        "number that determines the random shares of modes in start_energy; uniform "
        "over the shell of that energy; sweep whole numbers, or draw it by [sample], "
        "uniform from 0 to 1",
        later=True,
    )
    start_as: Literal["velocities", "both"] = given(
        "velocities",
        "initial values of the modes; velocities: velocities alone, so that all gaps "
        "are open; both: velocities and displacements, and a case in which these close "
        "a gap is refused",
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
        "first of them began with its pulse, each later one with the last state of the "
        "one before; set by [branch]",
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
        0.0, "speed at the end of the change; see `ramp`", "rad/s", later=True
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
        "part Delta of the gap that closes in time, as by heat; gap(t) = gap - Delta "
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
        """Time to simulate, s."""
        end: float = end_time(self.duration, self.revolutions, self.speed)
        return end

    @property
    def end_times(self) -> tuple[float, ...]:
        """Simulated times at which the word of the case is determined, s, ascending.

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
