"""Arrays in which a march stores samples and evidence, and the history made of them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Protocol

import numpy as np

from hpcwhirl.arrays import Floats, Integers
from hpcwhirl.case.growth import free_growth
from hpcwhirl.case.limits import shortest_limits
from hpcwhirl.case.plan import Marched
from hpcwhirl.case.resolve import Case
from hpcwhirl.case.speed import law_of, speed_at
from hpcwhirl.case.unbalance import centre_orbit
from hpcwhirl.dynamics.bodies.operators import friction_with_sign
from hpcwhirl.dynamics.bodies.shaft_loads import COLUMNS as SHAFT
from hpcwhirl.dynamics.bodies.shaft_loads import ShaftLoads
from hpcwhirl.dynamics.history import (
    LEDGER_TERMS,
    Evidence,
    History,
    Rubbing,
    ShaftHistory,
)
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.kernels.kernel_types import CyclicState, Tracks
from hpcwhirl.dynamics.schemes.integrator import Integrator
from hpcwhirl.dynamics.waves.casing import unfolded
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene
from hpcwhirl.scene.contact_laws import PERMANENT

CERTAIN = 4  # reason for the end that no kernel returns: a certificate
STOPS = {  # {counter STOP: name of the reason for the end of a run}
    0: "end",
    1: "amplitude",
    2: "nonfinite",
    3: "complementarity",
    CERTAIN: "certain",
}
NO_LAYER = np.zeros((3, 0))  # for kernels whose states have no `worn`


class Run(Protocol):
    """What a history is made of: a march, see `march.March`.

    Attributes
    ----------
    case : the case
    scene, model, lean : scene and model of all sectors; those that are integrated
    lost_at : step at whose end a blade is lost; 0: none during the run
    scheme, state, tracks : integrator, its state, samples and rows written so far
    stresses : (samples, N, P), Pa, at the named points of all blades
    shaft, loads, jump : how loads of the shaft follow from the motion; loads read so
        far, see `march.March`; change of the angular momentum by a lost blade
    every, stride, beat : steps between two readings of the loads, between samples, and
        between rows of evidence
    interval, seconds : s, output interval; wall time of all slices
    counter, steps : the state's counters; steps taken so far
    evidence_columns : number of columns of a row of evidence
    """

    case: Case
    scene: Scene
    model: Model
    lean: Marched
    lost_at: int
    scheme: Integrator
    state: Any
    tracks: Tracks
    stresses: Floats
    loads: Floats
    jump: Floats
    every: int
    stride: int
    beat: int
    interval: float
    seconds: float

    @property
    def shaft(self) -> ShaftLoads: ...  # noqa: D102

    @property
    def counter(self) -> Integers: ...  # noqa: D102

    @property
    def steps(self) -> int: ...  # noqa: D102

    @property
    def evidence_columns(self) -> int: ...  # noqa: D102


def empty_tracks(
    samples: tuple[int, int, int],
    evidence: tuple[int, int],
    blades: int,
    width: int,
    rods: int,
    states: tuple[int, int],
) -> Tracks:
    """Return arrays of zeros for the samples and the evidence that a march will store.

    Parameters
    ----------
    samples : numbers of samples of the centre and energies, of the tips, of the casing
    evidence : number of rows of evidence, and of their columns
    blades, width : number of blades N; number of coordinates of the casing
    rods : number of rods of a layer that wears, 0 without a layer
    states : number of states kept for reading, and of their values
    """
    count, tips, casing = samples
    numbers = [np.zeros(count) for _ in range(5)]
    energy, impulse, fed, lost, rubbed = numbers
    return Tracks(
        np.zeros((count, 2)), energy, impulse, fed, lost,
        np.zeros((tips, blades, 2)), np.zeros((tips, blades)), rubbed,
        np.zeros((casing, width)), np.zeros(evidence),
        np.zeros(contact.CLOSED), np.zeros((casing, rods)), np.zeros(states),
    )  # fmt: skip


def history_of(march: Run) -> History:
    """Return the history of a march so far: its samples, totals and present ledger.

    Values of one sector that represents all are extended to all. The samples end with
    the last complete output interval.
    """
    count, folds = int(march.counter[contact.SAMPLE]), march.lean.model.folds
    kept = Tracks._make(track[:count] for track in march.tracks)
    waves = march.scheme.casing_waves(kept.casing, march.stride)
    tips, pushed = kept.tips, kept.blade_impulse
    if folds > 1:
        tips, pushed = np.tile(tips, (1, folds, 1)), np.tile(pushed, (1, folds))
        waves = unfolded(waves, folds, march.scene)
    by_point = _by_point(march.model, tips, pushed)
    points = march.model.rotor.points
    if points is not None:
        tips = by_point["point_tips"][:, :, points.reference]
        pushed = by_point["point_impulse"].sum(axis=2)
    step = march.scene.solver.time_step
    last = int(march.counter[contact.LAST])
    certified = int(march.counter[contact.CERTIFIED])
    judged = _judged(march)
    radius = np.hypot(*judged.centre.T)
    return History(
        time=np.arange(1.0, count + 1) * (march.stride * step),
        centre=kept.centre,
        energy=folds * kept.energy,
        impulse=folds * kept.impulse,
        fed=folds * kept.fed,
        friction=folds * kept.rubbed,
        lost=folds * kept.lost,
        tips=tips,
        blade_impulse=pushed,
        casing=waves,
        ledger=_closing(march),
        gap_error=float(march.state.ledger[contact.MISS]),
        slip=float(march.state.ledger[contact.SLIP]),
        step_share=step / min(shortest_limits(march.model, march.scene).values()),
        stop=STOPS[int(march.counter[contact.STOP])],
        steps=march.steps,
        contacts=folds * int(march.counter[contact.TOUCHDOWNS]),
        last_contact=last * step if last >= 0 else -1.0,
        certificate=certified * step if certified >= 0 else -1.0,
        certificate_reach=float(march.state.ledger[contact.CERTIFICATE]),
        centre_peak=float(radius.max(initial=0.0)),
        judged=judged,
        contact_impulse=folds * float(march.state.ledger[contact.IMPULSE]),
        end=march.steps * step,
        seconds=march.seconds,
        interval=march.interval,
        folds=folds,
        circle=_circle(march, judged.time),
        blur=_blur(march),
        rubbing=_rubbing(march),
        shaft=_shaft(march),
        free_growth=_free_growth(march, judged),
        stress=march.stresses[:count],
        worn=kept.worn,
        begun=0.0,
        layer=getattr(march.state, "worn", NO_LAYER),
        **by_point,
    )


def _by_point(model: Model, tips: Floats, pushed: Floats) -> dict[str, Floats]:
    """Return displacements and impulses of all contact points, {name: samples}.

    They are sorted by blade and by point of its tip; {} if each tip has one point.

    tips, pushed : (n, N n_c, 2), m, displacements; (n, N n_c), N s, impulses of all
        points
    """
    if model.rotor.points is None:
        return {}
    shape = len(tips), model.blades, model.each
    own = tips.reshape(*shape, 2), pushed.reshape(shape)
    return dict(zip(("point_tips", "point_impulse"), own, strict=True))


def _circle(march: Run, time: Floats) -> Floats:
    """Return the orbit of the centre that unbalance causes without contact.

    It is 0 without unbalance.

    time : (b,), s, at the rows of evidence

    Returns
    -------
    (b, 2), m, x_o, y_o in the rotating frame
    """
    if march.evidence_columns > contact.COLUMNS:
        beside = slice(contact.BESIDE_X, contact.OF_WHOLE)
        return march.tracks.evidence[: len(time), beside].copy()
    if law_of(march.scene) is not None:
        return np.zeros((len(time), 2))
    z, before = centre_orbit(march.model, march.scene, time), march.case.before
    if before is not None:
        lost = march.lost_at * march.scene.solver.time_step
        was = centre_orbit(before.model, before.scene, time)
        z = np.where(time > (1.0 + 1e-12) * lost, z, was)
    return np.column_stack([z.real, z.imag])


def _blur(march: Run) -> tuple[float, float]:
    """Return how far round-off may have moved an unbalanced rotor from its circle.

    The result, for the steps taken so far, is an energy, J, and a squared distance of
    the centre, m^2, see `History.blur`.
    """
    energy, squared = march.scheme.jitter
    return march.steps * energy, march.steps * squared


def _rubbing(march: Run) -> Rubbing | None:
    """Return what set-valued friction did in a run so far; None if it was not used."""
    if march.scene.slip == PERMANENT:
        return None
    ledger, counts = march.state.ledger, march.counter
    folds, heat = march.lean.model.folds, -float(ledger[contact.HEAT])
    turned = float(ledger[contact.TURNED])
    if isinstance(march.state, CyclicState):  # where slides are not all evaluated
        taken = ledger[contact.FRICTION] + march.scheme.balance(march.state).friction
        heat = turned - float(taken)
    met = max(int(counts[contact.MET]), 1)
    return Rubbing(
        heat=folds * heat,
        turned=folds * turned,
        impulse=folds * float(ledger[contact.TANGENTIAL]),
        stuck=int(counts[contact.STUCK]) / met,
        reversed=int(counts[contact.REVERSED]) / met,
    )


def _shaft(march: Run) -> ShaftHistory | None:
    """Return the loads of the shaft in a run so far; None if they were not read.

    Samples from the first that is not finite on, of a motion that diverges, are left
    out. H and the impulse of contact are differences between samples, the torque of
    supports and weight is the mean of both.
    """
    if not march.loads.size:
        return None
    rows = march.loads[: march.steps // march.every + 1]
    forces, (momentum, torque, impulse) = rows[:, :-SHAFT], rows[:, -SHAFT:].T
    good = np.logical_and.accumulate(np.isfinite(forces).all(axis=1))
    last, span = max(int(good.sum()), 1), march.every * march.scene.solver.time_step
    time = np.arange(float(last)) * span
    rise = np.diff(momentum[:last])
    lost = (march.lost_at - 1) // march.every
    if 0 <= lost < len(rise):
        rise[lost] -= march.jump[0]
    drag = _drag(march, time[1:], np.diff(impulse[:last]))
    outer = (torque[1:last] + torque[: last - 1]) / 2
    names = march.shaft.names
    return ShaftHistory(
        names,
        time[1:],
        forces[1:last].reshape(-1, len(names), 2),
        (rise - drag) / span - outer,
    )


def _drag(march: Run, time: Floats, impulse: Floats) -> Floats:
    """Return the angular impulse of friction on the rotor between samples, N m s.

    time, impulse : (m,), s, at the samples; N s, of normal forces of contact since the
        sample before or, with set-valued friction, of friction on the casing
    """
    scene, share = march.scene, np.ones(len(time))
    if scene.slip == PERMANENT:
        speeds, which = np.unique(speed_at(scene, time), return_inverse=True)
        found = [friction_with_sign(scene, float(speed)) for speed in speeds]
        share = np.array(found)[which]
    return np.asarray(-share * scene.engine.rotor.radius * impulse)


def _free_growth(march: Run, judged: Evidence) -> Floats:
    """Return the growth rate of the engine's fastest growing free motion, (b,), 1/s.

    It is that at the speed of each of b rows of evidence; at a constant speed (1,). It
    is 0 where all free motion decays.

    judged : evidence of the run
    """
    knots, rates = free_growth(march.scene, march.model)
    if len(knots) == 1:
        return rates
    return np.asarray(np.interp(speed_at(march.scene, judged.time), knots, rates))


def _judged(march: Run) -> Evidence:
    """Return the evidence that a march has stored so far.

    Energies of one of g sectors that move alike are multiplied by g.
    """
    rows = march.tracks.evidence[: int(march.counter[contact.JUDGED])]
    steps = np.arange(1.0, len(rows) + 1) * march.beat
    numbers = march.lean.model.folds * rows[:, contact.OF_ROTOR : contact.COLUMNS].T
    centre, time = rows[:, : contact.OF_ROTOR], steps * march.scene.solver.time_step
    if march.evidence_columns == contact.COLUMNS:
        return Evidence(time, centre, *numbers)
    whole = march.lean.model.folds * rows[:, contact.OF_WHOLE]
    return Evidence(time, centre, *[*numbers, whole])


def _closing(march: Run) -> dict[str, float]:
    """Return the energy balance (ledger) of all sectors, {term: J}, at this step.

    If that is not finite, return the ledger at the last row of evidence, which is
    always finite.
    """
    with np.errstate(all="ignore"):
        now, entries = march.scheme.balance(march.state), march.state.ledger
        impact = entries[contact.IMPACT] + now.impact
        friction = entries[contact.FRICTION] + now.friction
        rotation = entries[contact.ROTATION] + now.rotation
        pulse, wear = entries[contact.PULSE] + now.loading, entries[contact.WEAR]
        ledger = _ledger(
            [now.energy, now.damping, pulse, impact, friction, rotation, wear]
        )
    if not np.isfinite(ledger["residual"]):
        ledger = _ledger(march.tracks.closed)
    return {term: march.lean.model.folds * value for term, value in ledger.items()}


def _ledger(terms: Iterable[float]) -> dict[str, float]:
    """Return the energy balance (ledger) as {term: J}, with its residual.

    The terms are those of `LEDGER_TERMS`, in that order.

    terms : energy, damping, pulse, impact with wear, friction, rotation, wear, J
    """
    energy, damping, pulse, spent, friction, rotation, wear = map(float, terms)
    residual = energy + damping + spent - pulse - friction - rotation
    impact = spent - wear
    values = (energy, damping, pulse, impact, wear, friction, rotation, residual)
    return dict(zip(LEDGER_TERMS, values, strict=True))
