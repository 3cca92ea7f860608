"""The inputs of a case as frozen, validated data in SI units.

Each field of a class is an input: its default, unit, meaning, symbol and limits.
"""

from __future__ import annotations

import math
from functools import partial
from operator import attrgetter
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import AfterValidator, ValidationError

from hpcwhirl.errors import InputError, shown
from hpcwhirl.scene import contact_laws
from hpcwhirl.scene.engine_parts import Engine
from hpcwhirl.scene.history import checked
from hpcwhirl.scene.kept_tables import table_over_slip, table_over_time
from hpcwhirl.scene.rules import LASTS, OF_SCENE, end_time, last_end
from hpcwhirl.scene.schemes import DEFAULT, MEANINGS, SCHEMES, SchemeName
from hpcwhirl.scene.table_model import Finite, Inputs, Label, NonNegative, Positive
from hpcwhirl.scene.units import given

if TYPE_CHECKING:
    from typing import Unpack

    from hpcwhirl.scene.typed_inputs import SceneInputs

OF_FILE = " (of a file: hpcwhirl.Design.of(file).base)"
SpeedTable = Annotated[str, AfterValidator(partial(table_over_time, name="speed"))]
GapTable = Annotated[str, AfterValidator(partial(table_over_time, name="gap"))]
FrictionTable = Annotated[str, AfterValidator(table_over_slip)]


class Solver(Inputs):
    """Inputs of the modal reduction, of the time integration, and of when it ends."""

    # fmt: off
    scheme: SchemeName = given(DEFAULT, "1",
        f"integrator; {MEANINGS}")
    time_step: Positive = given(1e-6, "s",
        "time step; if it is unstable it is refused, and the message gives the limit")
    accuracy: NonNegative = given(0.0, "1",
        "if > 0: largest relative error of the rotor's damped frequencies; sets the "
        "time step, to at most 0.9 of what stability, pulse and speed allow")
    truncation: NonNegative = given(0.0, "1",
        "if > 0: estimated relative error of motions due to modes left out; sets "
        "modes, and for a ring of harmonics also harmonics and families; without "
        "effect for unequal sectors, for rings of elements and for rotors given by "
        "modes only")
    modes: int = given(110, "1",
        "number eta of fixed-interface modes in the Craig-Bampton reduction; a rotor "
        "from file has its own number, of which truncation takes a part",
        symbol="η", ge=0)
    plan: Literal["lean", "everything"] = given("lean", "1",
        "which part of the model is integrated; lean: only the sectors and the time "
        "that the scene requires; everything: all of it; `--explain` says what is left "
        "out, and why")
    until: Literal["end", "certain", "decided"] = given("end", "1",
        "when a run ends; end: after its duration; certain: (scheme modal) as soon as "
        "its word is proved; decided: after its duration, but an undecided case is "
        "continued to twice its time, repeatedly, until it is decided or has reached "
        "`longest`; where speed or gap change in time, or a blade is lost during the "
        "run, `decided` is `end`")
    longest: Positive = given(20.0, "s",
        "with until = decided: largest engine time of a case; not below duration")
    estimate: Literal["none", "step", "all"] = given("none", "1",
        "step: integrate each case again with twice the step, or the longest stable "
        "one, and store how far radius, peak and word differ: half as much time again; "
        "all: also with a family of modes and a third of the ring's waves less")
    amplitude_limit: Positive = given(0.1, "1",
        "ratio of tip displacement to R_bd at which a run ends; displacement is the "
        "length of the vector of radial and tangential parts")
    # fmt: on

    @property
    def flies(self) -> bool:
        """Whether the scheme jumps over steps in which no blade can touch."""
        return SCHEMES[self.scheme].flies


class Output(Inputs):
    """Inputs that determine which results of a run are stored, and in what detail."""

    # fmt: off
    traces: Literal["summary", "blades", "orbit", "full"] = given("orbit", "1",
        "what is kept of a run; summary: numbers only; blades: also amplitude numbers "
        "of the blades, from the tips' positions at every interval; orbit: centre, "
        "energy, work and losses over time; full: also all tips, each blade's impulse "
        "and the casing; words do not depend on it")
    interval: Positive = given(2e-4, "s",
        "time between samples of the traces; words do not depend on it")
    forces: Literal["none", "supports"] = given("none", "1",
        "supports: read the motion at every interval, and keep from it the force of "
        "each support on the rotor and the torque of the drive; always done if a blade "
        "is lost; words do not depend on it")
    windows: int = given(20, "1",
        "number of windows of equal time into which a run whose speed or gap changes "
        "is divided; each window gets words by the same rules", ge=1, le=200)
    chaos: NonNegative = given(0.0, "1",
        "if > 0: number of revolutions after the end of a sustained case over which "
        "its largest Lyapunov exponent, period and 0-1 test are measured; this takes "
        "two more runs of that length; at least 40, some 200 for a word")
    # fmt: on


class _Told(type(Inputs)):  # type: ignore[misc]
    """Metaclass of `Scene`: InputError for invalid inputs; signature and help."""

    if not TYPE_CHECKING:  # where the signature is that of `Scene.__init__`

        def __call__(cls, *args: Any, **inputs: Any) -> Any:
            from hpcwhirl.scene.documents import scene_of_preset  # imports this module

            if args:
                told = f"Scene takes inputs by name, as speed=330.0{OF_FILE}"
                raise InputError(f"{told}, got {shown(args[0])}")
            try:
                return scene_of_preset(inputs) or super().__call__(**inputs)
            except ValidationError as failed:
                from hpcwhirl.scene.plain_data import told_by  # imports this module

                raise told_by(failed) from None

        @property
        def __signature__(cls) -> Any:
            from hpcwhirl.scene.described import signature  # imports this module

            return signature()

        @__signature__.setter
        def __signature__(cls, _: Any) -> None:
            """Ignore the signature that pydantic makes, of 10,000 characters."""

        @property
        def __doc__(cls) -> str:
            from hpcwhirl.scene.described import described  # imports this module

            return described()


class Scene(Inputs, metaclass=_Told):
    """All inputs of one case: engine, operating point, load, solver and output."""

    if TYPE_CHECKING:

        def __init__(self, **inputs: Unpack[SceneInputs]) -> None: ...

    RULES = OF_SCENE

    # fmt: off
    engine: Engine = Engine()
    speed: Finite = given(410.0, "rad/s",
        "rotational speed Omega; negative turns clockwise; per step, the rotor must "
        "turn by less than half the casing's shortest wave", symbol="Ω")
    nodal_diameter: int = given(1, "1",
        "number of lobes k of the loading; the pulse squeezes the casing at k lobes; "
        "at most the highest harmonic of the ring, or half its elements",
        symbol="k", ge=0)
    gap: NonNegative = given(1.28e-4, "m", "blade-tip clearance; at most 10 tip radii")
    gap_at: Literal["speed", "rest"] = given("speed", "1",
        "speed at which the gap is measured; speed: the running speed; rest: at rest, "
        "and the radial growth of the tips then reduces the clearance; rest only with "
        "engine.rotation full")
    friction: NonNegative = given(0.1, "1",
        "Coulomb coefficient mu of friction between tips and casing", symbol="μ")
    friction_law: contact_laws.FrictionName = given(contact_laws.FRICTION_NAMES[0], "1",
        f"coefficient of friction; {contact_laws.FRICTIONS}")
    friction_at_rest: NonNegative = given(0.2, "1",
        "coefficient of Stribeck's law without sliding", symbol="μ_s")
    friction_speed: Positive = given(10.0, "m/s",
        "sliding speed v_s in exp(-|v| / v_s), by which Stribeck's friction falls",
        symbol="v_s")
    friction_table: FrictionTable = given("", "1",
        "table of mu over the sliding speed, for friction_law table; a CSV file of "
        "columns slip, m/s, and friction, or such rows in one line; begins at 0 m/s "
        "with `friction`; linear between rows, then held; kept as text")
    slip: Literal["permanent", "set-valued"] = given("permanent", "1",
        "whether tips in contact always slide with the rotation; permanent: they do, "
        "and friction drags against it; set-valued: Coulomb's law at each tip, which "
        "may slide either way or stick")
    force: NonNegative = given(75e3, "N",
        "peak modal force; F(t) = F sin(pi t / tau) for 0 < t < tau", symbol="F")
    pulse: Positive = given(6.3e-4, "s",
        "pulse duration tau; 10 time steps at least", symbol="τ")
    direction: Literal["squeeze", "stretch"] = given("squeeze", "1",
        "sense of the pulse at theta = 0; squeeze: the casing moves inward there; "
        "stretch: outward")
    unbalance: NonNegative = given(0.0, "kg m",
        "unbalance m e of the rotor at the disk's centre, mass times radius; causes a "
        "force m e Omega^2 that turns with the rotor; only with engine.rotation full "
        "and a free centre", symbol="m e")
    unbalance_phase: Finite = given(0.0, "rad",
        "angle from blade 0 to the unbalance, in the direction of theta")
    lost_blade_time: NonNegative = given(0.0, "s",
        "time of the run at which lost_blade leaves the rotor, which has all its "
        "blades until then; 0: when the run begins; not before the end of the run: no "
        "blade is lost")
    gravity: NonNegative = given(0.0, "m/s^2",
        "acceleration by the rotor's weight, constant in the static frame; the run "
        "begins in its equilibrium; not that of the casing; only with engine.rotation "
        "full and a free centre", symbol="g")
    gravity_angle: Finite = given(-math.pi / 2, "rad",
        "direction of gravity in the static frame, from the x axis to the y axis")
    start_energy: NonNegative = given(0.0, "J",
        "energy of the initial motion, in modes of both bodies; 0: at rest; the pulse "
        "acts in addition, unless `force` is 0; added to the circle of an unbalance",
        symbol="E_0")
    start_modes: Label = given("rotor 1F 1", "1",
        "modes that share start_energy; by body, family and nodal diameter as in "
        "`hpcwhirl model`, or by some of these three, and several separated by commas: "
        "rotor suspension, casing 2", max_length=200)
    start_draw: NonNegative = given(0.0, "1",
        "number from which the random shares of modes in start_energy follow; uniform "
        "over the states of that energy, a shell; sweep whole numbers, or draw it by "
        "[sample], uniform from 0 to 1")
    start_as: Literal["velocities", "both"] = given("velocities", "1",
        "initial values of the modes; velocities: velocities alone, so that all gaps "
        "are open; both: velocities and displacements, and a case in which these close "
        "a gap is refused")
    branch: Label = given("", "1",
        "direction in which the input of [branch] was swept to this case; up or down; "
        "set by [branch]", max_length=100)
    history: Annotated[str, AfterValidator(checked)] = given("", "1",
        "cases that precede this one on its branch; an input and its values: the first "
        "case began with its pulse, each later one with the last state of the "
        "preceding one; set by [branch]")
    acceleration: Finite = given(0.0, "rad/s^2",
        "rate at which the speed changes from `speed` on, a run-up or run-down; of a "
        "smooth change the mean rate, of a decay the first; 0: constant speed",
        symbol="dΩ/dt")
    ramp: Literal["linear", "smooth", "decay"] = given("linear", "1",
        "how the speed changes; linear: to speed_to, or to the end of the run if that "
        "is 0 and not ahead; smooth: half a cosine to speed_to; decay: speed_to is "
        "approached exponentially, with the time constant (speed_to - speed) / "
        "acceleration, as by windmilling")
    speed_to: Finite = given(0.0, "rad/s", "speed at the end of the change; see `ramp`")
    speed_table: SpeedTable = given("", "1",
        "table of the speed, instead of acceleration; a CSV file of columns time, s, "
        "and speed, rad/s, or such rows in one line; linear between rows, then held; "
        "kept as text")
    gap_closure: Finite = given(0.0, "m",
        "part Delta of the gap that closes in time, as by heat; gap(t) = gap - Delta "
        "(1 - exp(-t/gap_time)); < 0: it opens", symbol="Δ")
    gap_time: Positive = given(1.0, "s",
        "time constant of the gap's closure", symbol="τ_g")
    gap_table: GapTable = given("", "1",
        "table of the gap, instead of gap_closure; a CSV file of columns time, s, and "
        "gap, m, or such rows in one line; its first gap is `gap`; linear between "
        "rows, then held; kept as text")
    duration: Positive = given(2.5, "s",
        "engine time of the run; unless revolutions > 0; its last 40 % decide the "
        "words")
    revolutions: NonNegative = given(0.0, "1",
        "if > 0: engine time of the run in revolutions, not s")
    solver: Solver = Solver()
    output: Output = Output()
    # fmt: on

    def value(self, name: str) -> Any:
        """Return the value of an input by its full dotted name."""
        return attrgetter(name)(self)

    @property
    def end_time(self) -> float:
        """Simulated time at which the run ends, s: `duration`, or `revolutions`."""
        end: float = end_time(self.duration, self.revolutions, self.speed)
        return end

    @property
    def end_times(self) -> tuple[float, ...]:
        """Simulated times at which the word of the case is determined, s, ascending.

        Each time is twice the preceding one, so that the window of a word, the last
        40 % of the run, does not overlap the window of an earlier word.
        """
        times = [self.end_time]
        last = last_end(*attrgetter(*LASTS)(self))
        while times[-1] < last:
            times.append(min(2.0 * times[-1], last))
        return tuple(times)

    @property
    def coefficient(self) -> float:
        """Coefficient of friction where tips slide at |Omega| R, by `friction_law`."""
        return self.coefficient_at(self.speed)

    def coefficient_at(self, speed: float) -> float:
        """Return the coefficient of friction at a speed, rad/s."""
        law = contact_laws.FRICTION[self.friction_law]
        sliding = speed * self.engine.rotor.radius
        own = self.friction, self.friction_at_rest, self.friction_speed
        return float(law.coefficient(*own, self.friction_table, sliding))

    @property
    def has_harmonics(self) -> bool:
        """Whether the casing's modes are harmonics: not a ring of elements."""
        casing = self.engine.casing
        return casing.kind == "rigid" or casing.discretization != "elements"

    @property
    def is_loaded(self) -> bool:
        """Whether a pulse loads the casing: an elastic ring with a force > 0."""
        return self.engine.casing.kind == "ring" and self.force > 0.0
