"""A case: a scene with its model, time step and plan, each computed once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from hpcwhirl.case.limits import check_limits, step_asked
from hpcwhirl.case.plan import Marched, Plan, lean_of, plan_of
from hpcwhirl.case.truncation import with_truncation
from hpcwhirl.reduction.model import Model, model_of
from hpcwhirl.scene import Scene, apply_settings
from hpcwhirl.scene.schemes import SCHEMES


@dataclass(frozen=True)
class Case:
    """A resolved scene; immutable, each property is computed once, on first use.

    The cost of a campaign with fixed steps therefore needs no models, and the modes of
    a scene that cannot be integrated can still be shown; `check` raises for it.

    Attributes
    ----------
    given : the scene as the user gave it, which identifies the case
    own : a model to use instead of one made from the scene
    """

    given: Scene
    own: Model | None = None

    @cached_property
    def reduced(self) -> Scene:
        """The scene with modes and harmonics chosen by its truncation error."""
        return with_truncation(self.given)

    @cached_property
    def model(self) -> Model:
        """The whole model; cases of one engine and reduction share one object.

        Raises
        ------
        InputError
            where the model of these inputs cannot be computed in double precision
        """
        return self.own or model_of(self.reduced)

    @cached_property
    def step(self) -> float:
        """Time step, s: as given, or chosen for the accuracy by the model."""
        if self.given.solver.accuracy == 0.0:
            return self.given.solver.time_step
        return step_asked(self.model, self.reduced)

    @cached_property
    def scene(self) -> Scene:
        """The scene with the modes, harmonics and time step that are integrated."""
        if self.given.solver.accuracy == 0.0:
            return self.reduced
        return apply_settings(self.reduced, {"time_step": self.step})

    @cached_property
    def plan(self) -> Plan:
        """Which part of the model is integrated, and how far."""
        return plan_of(self.reduced, self.model)

    @cached_property
    def lean(self) -> Marched:
        """The scene and the model that this plan integrates."""
        return lean_of(self.scene, self.model)

    @property
    def whole(self) -> Marched:
        """The scene and the model with all sectors."""
        return Marched(self.scene, self.model)

    @property
    def steps(self) -> float:
        """Number of time steps to the end of the run."""
        return self.given.end_time / self.step

    @property
    def cost(self) -> float:
        """Predicted time on one core, s, if the run goes to its end."""
        scheme = SCHEMES[self.given.solver.scheme]
        return self.steps * scheme.step_seconds(self.given.engine.rotation)

    def check(self) -> None:
        """Raise InputError, naming the limit, where the time step exceeds one."""
        check_limits(self.model, self.scene)


def resolve(scene: Scene) -> Case:
    """Return the case of a scene."""
    return Case(scene)
