"""A case: a scene with its model, time step and plan, each computed once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from hpcwhirl.case.limits import check_limits, step_asked
from hpcwhirl.case.plan import Marched, Plan, lean_of, plan_of
from hpcwhirl.case.rotation_choice import with_rotation
from hpcwhirl.case.speed import check_tables, law_of
from hpcwhirl.case.truncation import with_truncation
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.model import Model, model_of
from hpcwhirl.reduction.waves import tip_growth
from hpcwhirl.scene import Scene, apply_settings
from hpcwhirl.scene.input_names import Value
from hpcwhirl.scene.schemes import SCHEMES
from hpcwhirl.store.models.engine_file import points_named


@dataclass(frozen=True)
class Case:
    """A resolved scene; immutable, each property is computed once, on first use.

    So the cost of a campaign with fixed steps needs no models, and the modes of a scene
    that cannot be integrated can still be shown; `check` raises for such a scene.

    Attributes
    ----------
    given : the scene as the user gave it, which identifies the case
    own : model to use instead of the one computed from the scene; None: no such model
    goes_on : whether the case begins with the last state of another, without a pulse
    """

    given: Scene
    own: Model | None = None
    goes_on: bool = False

    @cached_property
    def reduced(self) -> Scene:
        """The scene with rotation chosen, and the modes that `truncation` allows."""
        return with_truncation(with_rotation(self.given))

    @cached_property
    def model(self) -> Model:
        """The whole model; cases of one engine and reduction share one object.

        Raises
        ------
        InputError
            if the model of these inputs cannot be computed in double precision
        """
        return self.own or model_of(self.reduced)

    @cached_property
    def step(self) -> float:
        """Time step, s: as given, or chosen for the accuracy by the model."""
        if self.given.solver.accuracy == 0.0:
            return self.given.solver.time_step
        return step_asked(self.model, self.reduced)

    @cached_property
    def growth(self) -> float:
        """Radial growth at speed, m, of the tip that grows most; 0 without rotation."""
        if self.model.rotor.spin is None:
            return 0.0
        return float(
            tip_growth(self.model.rotor, self.model.blades, self.given.speed).max()
        )

    @property
    def clearance(self) -> float:
        """Clearance at speed, m, after radial growth; it may be negative."""
        at_rest = self.given.gap_at == "rest"
        return self.given.gap - (self.growth if at_rest else 0.0)

    @cached_property
    def scene(self) -> Scene:
        """The scene with the modes, harmonics, step and clearance that are integrated.

        Raises
        ------
        InputError
            where the tips have grown into the casing, or would grow unequally
        """
        settings: dict[str, Value] = {"force": 0.0} if self.goes_on else {}
        if self.given.solver.accuracy > 0.0:
            settings["time_step"] = self.step
        if self.model.rotor.spin is not None and law_of(self.given) is not None:
            settings["scheme"] = "general"  # waves hold for one speed only
        if self.given.gap_at == "rest":
            if self.model.rotor.points is not None:
                raise InputError(
                    f"gap_at must be speed with {self.model.each} contact points a tip,"
                    " which grow unequally, got rest"
                )
            if not self.clearance > 0.0:
                raise InputError(
                    f"gap must be > {self.growth:.6g} m (growth of the tips at "
                    f"{self.given.speed:.6g} rad/s, where gap_at is rest), "
                    f"got {self.given.gap:.6g}"
                )
            settings["gap"] = self.clearance
        return apply_settings(self.reduced, settings) if settings else self.reduced

    @cached_property
    def plan(self) -> Plan:
        """The plan: which part of the model is integrated, and until when."""
        return plan_of(self.reduced, self.model)

    @cached_property
    def lean(self) -> Marched:
        """The scene and the model of the part that the plan integrates."""
        return lean_of(self.scene, self.model)

    @property
    def whole(self) -> Marched:
        """The scene and the model of all sectors, whatever the plan."""
        return Marched(self.scene, self.model)

    @property
    def steps(self) -> float:
        """Number of time steps to the end of the run."""
        return self.given.end_time / self.step

    @property
    def cost(self) -> float:
        """Predicted time on one core, s, if the run goes to its end."""
        engine, name = self.given.engine, self.given.solver.scheme
        if engine.rotation != "none" and law_of(self.given) is not None:
            name = "general"
        step = SCHEMES[name].step_seconds(
            engine.rotation, engine.rotor.blades, uneven=engine.rotor.is_uneven,
            points=points_named(engine.file),
        )  # fmt: skip
        return float(self.steps * step)

    def check(self) -> None:
        """Raise InputError if an input exceeds a limit, and name the limit."""
        check_tables(self.given)
        check_limits(self.model, self.scene)


def resolve(scene: Scene) -> Case:
    """Return the `Case` of a scene; its properties are computed on first use."""
    return Case(scene)
