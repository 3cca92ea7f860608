"""A case: a scene with its model, time step and plan, each computed at most once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from hpcwhirl.case.handover import handed_over
from hpcwhirl.case.limits import check_limits, step_asked
from hpcwhirl.case.plan import Marched, Plan, lean_of, plan_of
from hpcwhirl.case.rotation_choice import with_rotation
from hpcwhirl.case.truncation import with_truncation
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.model import Model, model_of, why_unknown
from hpcwhirl.reduction.waves import tip_growth
from hpcwhirl.scene import Scene, apply_settings
from hpcwhirl.scene.input_names import Value
from hpcwhirl.scene.rules import NO_BLADE
from hpcwhirl.scene.schemes import SCHEMES, follows_speed, marched_by
from hpcwhirl.store.models.engine_file import points_named

# inputs of a rotor that has all its blades
WHOLE: dict[str, Value] = {"lost_blade": NO_BLADE, "lost_blade_time": 0.0}


@dataclass(frozen=True)
class Case:
    """A scene with the model, time step and plan by which it is integrated.

    A property is computed on first use. So the cost of a campaign with fixed steps
    needs no models, and the modes of a scene that cannot be integrated can still be
    shown; `check` raises for such a scene.

    Attributes
    ----------
    given : the scene as the user gave it, which identifies the case
    own : model to use; None: it is computed from the scene
    goes_on : whether the case begins with the last state of another one, and without a
        pulse
    """

    given: Scene
    own: Model | None = None
    goes_on: bool = False

    @cached_property
    def reduced(self) -> Scene:
        """The scene with rotation "auto" decided and modes chosen by `truncation`.

        Where the blade would be lost after the run, none is.
        """
        scene = self.given
        if scene.lost_blade_time >= scene.end_time:
            scene = apply_settings(scene, WHOLE)
        return with_truncation(with_rotation(scene))

    @cached_property
    def model(self) -> Model:
        """The model of all sectors; cases of one engine and reduction share it.

        Raises
        ------
        InputError
            if the model of these inputs cannot be computed in double precision
        """
        return self.own or model_of(self.reduced)

    @cached_property
    def handed_over(self) -> str:
        """Why scheme `exact` hands the case over to `modal`; "": it does not."""
        return handed_over(self.model, self.reduced)

    @cached_property
    def _by_scheme(self) -> Scene:
        """The scene `reduced` with the scheme that integrates it."""
        scene = self.reduced
        name = "modal" if self.handed_over else scene.solver.scheme
        if name == "modal" and follows_speed(scene.value):
            name = "general"
        if name == scene.solver.scheme:
            return scene
        return apply_settings(scene, {"scheme": name})

    @cached_property
    def step(self) -> float:
        """Time step, s: `time_step`, or chosen so that the model meets `accuracy`."""
        if self.given.solver.accuracy == 0.0:
            return self.given.solver.time_step
        models = {self.model, self._wheel} if self.loses else {self.model}
        return min(step_asked(model, self.reduced) for model in models)

    def pinned(self, step: float) -> Scene:
        """Return the scene as given, with terms of rotation, modes and step as numbers.

        With a rotor from file it keeps `truncation`: the number of its modes is no
        input, see `reduction.model`.

        step : time step, s
        """
        chosen: dict[str, Value] = {"time_step": step, "accuracy": 0.0}
        if not self.given.engine.file:
            chosen["truncation"] = 0.0
        return apply_settings(self.reduced, chosen)

    @cached_property
    def growth(self) -> float:
        """Radial growth by rotation, m, of the tip that grows most.

        It is 0 if the model has no terms of rotation. Of a rotor that loses a blade it
        is that of the whole wheel, for which the clearance was set.
        """
        if self.model.rotor.spin is None:
            return 0.0
        model = self._wheel
        return float(tip_growth(model.rotor, model.blades, self.given.speed).max())

    @property
    def _wheel(self) -> Model:
        """The model with all blades, also if the rotor loses one."""
        if self.reduced.engine.rotor.lost_blade == NO_BLADE or self.own is not None:
            return self.model
        return model_of(apply_settings(self.reduced, WHOLE))

    @property
    def loses(self) -> bool:
        """Whether the rotor loses a blade during the run, not as it begins."""
        return self.reduced.lost_blade_time > 0.0

    @cached_property
    def reads_loads(self) -> bool:
        """Whether loads of the shaft are read: if asked for, or if a blade is lost."""
        if self.given.output.forces != "none":
            return True
        lost = self.given.engine.rotor.lost_blade != NO_BLADE
        return lost and why_unknown(self.model) == ""

    @cached_property
    def before(self) -> Marched | None:
        """The scene and the model until a blade is lost; None if none is in the run."""
        if not self.loses:
            return None
        return Marched(apply_settings(self.scene, WHOLE), self._wheel)

    @property
    def clearance(self) -> float:
        """Clearance of tips and casing at speed, m; < 0 if tips grow beyond the gap."""
        at_rest = self.given.gap_at == "rest"
        return self.given.gap - (self.growth if at_rest else 0.0)

    @cached_property
    def scene(self) -> Scene:
        """The scene that is integrated, with the chosen modes, step and clearance.

        Raises
        ------
        InputError
            where the tips have grown into the casing, or would grow unequally
        """
        settings: dict[str, Value] = {"force": 0.0} if self.goes_on else {}
        if self.given.solver.accuracy > 0.0:
            settings["time_step"] = self.step
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
        own = self._by_scheme
        return apply_settings(own, settings) if settings else own

    @cached_property
    def plan(self) -> Plan:
        """Which part of the model is integrated, and until when."""
        return plan_of(self._by_scheme, self.model)

    @cached_property
    def lean(self) -> Marched:
        """The scene and the model of the part that the plan integrates."""
        return lean_of(self.scene, self.model, self.plan.folds)

    @property
    def whole(self) -> Marched:
        """The scene and the model of all sectors, whatever the plan."""
        return Marched(self.scene, self.model)

    @property
    def steps(self) -> float:
        """Number of time steps to the end of the run, not rounded."""
        return self.given.end_time / self.step

    @property
    def cost(self) -> float:
        """Predicted computing time on one core, s, if the run goes to its end."""
        engine = self.given.engine
        uneven, points = engine.rotor.is_uneven, points_named(engine.file)
        name = str(marched_by(self.given.value, uneven or points > 1))
        step = SCHEMES[name].step_seconds(
            engine.rotation, engine.rotor.blades, uneven=uneven, points=points
        )
        return float(self.steps * step)

    def check(self) -> None:
        """Raise InputError, naming the limit, if the scene cannot be integrated."""
        check_limits(self.model, self.scene)
        if self.before:
            check_limits(self.before.model, self.before.scene)


def resolve(scene: Scene) -> Case:
    """Return the `Case` of a scene; its properties are computed on first use."""
    return Case(scene)
