"""A case: a scene and all that follows from it, each part made once."""

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
    """A scene, resolved: immutable, and each part is made once, when it is asked for.

    So a campaign's cost needs no models where steps are given, and a scene that cannot
    be marched has modes to show all the same; `check` tells.

    Attributes
    ----------
    given : the scene as it was given; what a case is known by
    own : its model, where it is not to be made from the scene
    """

    given: Scene
    own: Model | None = None

    @cached_property
    def reduced(self) -> Scene:
        """The scene with the modes and harmonics that its truncation asks for."""
        return with_truncation(self.given)

    @cached_property
    def model(self) -> Model:
        """The whole model; one object for all cases of an engine and a reduction.

        Raises
        ------
        InputError
            where the inputs do not lead to a model that double precision holds
        """
        return self.own or model_of(self.reduced)

    @cached_property
    def step(self) -> float:
        """Time step, s: as given, or what the accuracy asks for by the model."""
        if self.given.solver.accuracy == 0.0:
            return self.given.solver.time_step
        return step_asked(self.model, self.reduced)

    @cached_property
    def scene(self) -> Scene:
        """The scene as resolved: its modes, harmonics and step are those marched."""
        if self.given.solver.accuracy == 0.0:
            return self.reduced
        return apply_settings(self.reduced, {"time_step": self.step})

    @cached_property
    def plan(self) -> Plan:
        """What of the model is marched, and how far."""
        return plan_of(self.reduced, self.model)

    @cached_property
    def lean(self) -> Marched:
        """The scene and the model that are marched by this plan."""
        return lean_of(self.scene, self.model)

    @property
    def whole(self) -> Marched:
        """The scene and the model with all sectors."""
        return Marched(self.scene, self.model)

    @property
    def steps(self) -> float:
        """Steps to the end of the run."""
        return self.given.end_time / self.step

    @property
    def cost(self) -> float:
        """Predicted seconds of one core, if the run goes to its end."""
        return self.steps * SCHEMES[self.given.solver.scheme].nominal

    def check(self) -> None:
        """Raise InputError, naming the limit, where the step is beyond one."""
        check_limits(self.model, self.scene)


def resolve(scene: Scene) -> Case:
    """Return the case of a scene."""
    return Case(scene)
