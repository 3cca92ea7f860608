"""The history of an integrated case: samples, energy ledger, reason for its end."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from hpcwhirl.arrays import Floats

LEDGER_TERMS = (
    "energy",  # kinetic + strain of both bodies at the end, J; of an unbalanced rotor
    # the energy of its motion about its circle, with the potential of the unbalance's
    # force
    "damping",  # lost in modal damping, J, >= 0
    "pulse",  # work of the loading, J; with that of an unbalance put on at the start
    "impact",  # lost in inelastic impacts, J, >= 0; of scheme `exact` with an error,
    # relative to `rotation`, of second order in the time step
    "wear",  # spent on wear of a layer, plastic or by rubbing, J, >= 0
    "friction",  # work of friction on the motions of both bodies, J
    "rotation",  # work of the rotation, -lambda Omega dw/dtheta; w with the shape, J;
    # with that of a gap that closes, and in a run-up with rotation "full" that of the
    # motion without contact, lambda r_u' + tau r_t', tau r_t' being taken by friction
    "residual",  # energy + damping + impact + wear - pulse - friction - rotation, J
)


@dataclass(frozen=True)
class Evidence:
    """Samples of a run from which its word follows, whichever traces are stored.

    Attributes
    ----------
    time : (b,), s, of the b samples
    centre : (b, 2), m, ROTATING frame: x_o, y_o
    rotor, casing : (b,), J, kinetic + strain energy of each body
    fed, friction, lost : (b,), J, cumulative work, as in `History`
    whole : (b,), J, if the speed changes and rotation is "full": energy of the whole
        motion of the rotor, while `rotor` is that of the motion that contact causes;
        else (0,)
    """

    time: Floats
    centre: Floats
    rotor: Floats
    casing: Floats
    fed: Floats
    friction: Floats
    lost: Floats
    whole: Floats = field(default_factory=lambda: np.zeros(0))

    @property
    def energy(self) -> Floats:
        """Energy of both bodies together, J, at the times of `time`."""
        return self.rotor + self.casing


@dataclass(frozen=True)
class Rubbing:
    """What set-valued friction did in a run.

    Attributes
    ----------
    heat : J, that friction took by sliding, >= 0: minus its work on the velocities of
        casing and tips relative to each other
    turned : J, that the rotation gave against friction: heat and the ledger's friction
    impulse : N s, of friction on the casing, along increasing theta
    stuck, reversed : shares of the time in contact, summed over tips, in which a tip
        stuck to the casing, and slid against the rotation
    """

    heat: float
    turned: float
    impulse: float
    stuck: float
    reversed: float


@dataclass(frozen=True)
class ShaftHistory:
    """Loads of the shaft, read from the motion at m samples of a run.

    Attributes
    ----------
    names : names of the s supports
    time : (m,), s
    force : (m, s, 2), N, of each support on the rotor, static frame: F_x, F_y
    torque : (m,), N m, of the drive on the rotor about its axis, anticlockwise > 0,
        mean since the sample before; NaN if it does not follow from the motion
    """

    names: tuple[str, ...]
    time: Floats
    force: Floats
    torque: Floats


@dataclass(frozen=True)
class History:
    """Samples and totals of one run; all in SI units, all numbers finite.

    The scene's output.traces selects the traces that are stored.

    Attributes
    ----------
    time : (n,), s, of the n samples of the traces
    centre : (n, 2), m, ROTATING frame: x_o, y_o
    energy : (n,), J, kinetic + strain of both bodies
    impulse : (n,), N s, cumulative normal contact impulse of all blades
    fed : (n,), J, cumulative work of rotation and friction
    friction : (n,), J, the part of `fed` by friction; the rest is the transport of
        contacts over the deformed ring
    lost : (n,), J, cumulative damping and impact loss, and work of wear
    tips : (n, N, 2), m, rotating frame: radial, tangential; (0, N, 2) unless stored
    blade_impulse : (n, N), N s, cumulative per blade; (0, N) unless stored
    casing : (n, H + 1, 2), m, STATIC frame: c_h, s_h, h = 0 .. H, of the casing's
        radial displacement w = sum_h c_h cos(h theta) + s_h sin(h theta); (0, H + 1, 2)
        unless stored
    point_tips, point_impulse : (n, N, n_c, 2), (n, N, n_c), as `tips`, `blade_impulse`,
        for all contact points, if a tip has several; else n_c is 0
    stress : (n, N, P), Pa, at the named points of each blade; P is 0 unless stored, and
        if the rotor has no such points
    ledger : {term: J} over the whole run, see `LEDGER_TERMS`; if it is not finite, the
        ledger at the last row of evidence
    gap_error : largest difference between the solved gaps and those computed from the
        displacements, relative to the latter, at rows of evidence with contact
    slip : m/s, largest tangential velocity of a tip in contact, from vibration only,
        less that of the casing at the tip; from every eighth step with contact
    step_share : time step, divided by the stability limit of the faster body
    stop : "end", "amplitude", "nonfinite", "complementarity", or "certain" if the run
        ended with its certificate
    steps : number of steps taken
    contacts : number of touchdowns of blades on the casing
    last_contact : s, the last instant with contact; -1 if there was none
    certificate : s, time after which no contact can recur; -1 if not proved
    certificate_reach : m, bound of all later displacements; below the gap
    centre_peak : m, largest displacement of the centre in the evidence
    seconds : wall time in the kernel
    interval : s between samples
    contact_impulse : N s, normal impulse of all contacts of the run
    end : s, time of the last step
    judged : evidence for words
    begun : s, time of the run that is 0 of `judged`, see `between`
    folds : number of sectors that move alike, of which one was integrated; 1: all were
    circle : (b, 2), m, rotating frame: x_o, y_o of an unbalanced rotor without contact,
        at the b samples of the evidence; energies are those of the motion about it; 0
        without unbalance
    blur : energy, J, and squared distance of the centre, m^2, up to which a motion
        about the circle may be round-off; 0 for schemes that compute this motion
    rubbing : what set-valued friction did; None with permanent sliding
    free_growth : (b,) or (1,), 1/s, growth rate of the engine's fastest growing free
        motion, at the speed of each of the b samples of the evidence; 0 if all decay,
        or if round-off explains it
    worn : (n, M), m, depth of each of M rods of a layer on the casing; (0, M) unless
        stored
    shaft : loads of the shaft; None unless read
    layer : (3, M), at the end: worn depth, m, work of wear, J, and work of the rotation
        on the rods, J; M is 0 without layer
    """

    time: Floats
    centre: Floats
    energy: Floats
    impulse: Floats
    fed: Floats
    friction: Floats
    lost: Floats
    tips: Floats
    blade_impulse: Floats
    ledger: dict[str, float]
    gap_error: float
    slip: float
    step_share: float
    stop: str
    steps: int
    contacts: int
    last_contact: float
    certificate: float
    certificate_reach: float
    centre_peak: float
    seconds: float
    interval: float
    contact_impulse: float
    end: float
    judged: Evidence
    begun: float = 0.0
    casing: Floats = field(default_factory=lambda: np.zeros((0, 1, 2)))
    point_tips: Floats = field(default_factory=lambda: np.zeros((0, 1, 0, 2)))
    point_impulse: Floats = field(default_factory=lambda: np.zeros((0, 1, 0)))
    stress: Floats = field(default_factory=lambda: np.zeros((0, 1, 0)))
    folds: int = 1
    worn: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    layer: Floats = field(default_factory=lambda: np.zeros((3, 0)))
    circle: Floats = field(default_factory=lambda: np.zeros((1, 2)))
    blur: tuple[float, float] = (0.0, 0.0)
    rubbing: Rubbing | None = None
    shaft: ShaftHistory | None = None
    free_growth: Floats = field(default_factory=lambda: np.zeros(1))


def since(history: History, start: float) -> History:
    """Return a history of which only the part after `start`, s, is judged.

    That time becomes 0 of the evidence, the samples by which words are found. Traces
    and ledger stay those of the whole run, with their times.
    """
    return between(history, start, history.end)


def between(history: History, start: float, end: float) -> History:
    """Return a history with the evidence from `start`, then time 0, to `end` only.

    Samples of the traces and the ledger stay those of the whole run. If contact occurs
    after `end`, the time of the last contact before it is that of the last row in which
    the work fed changes.

    start, end : s
    """
    judged = history.judged
    rows = (judged.time > start) & (judged.time <= end)
    numbers = {n: getattr(judged, n) for n in judged.__dataclass_fields__}
    part = {n: each[rows] if len(each) else each for n, each in numbers.items()}
    part["time"] = part["time"] - start
    last = history.last_contact
    if last > end:
        fed = np.flatnonzero(np.diff(judged.fed[judged.time <= end]))
        last = float(judged.time[fed[-1] + 1]) if len(fed) else -1.0
    circle, growth = (
        each[rows] if len(each) == len(rows) else each
        for each in (history.circle, history.free_growth)
    )
    proved = 0.0 <= history.certificate <= end
    return replace(
        history,
        judged=Evidence(**part),
        begun=history.begun + start,
        circle=circle,
        free_growth=growth,
        end=end - start,
        last_contact=max(last - start, -1.0),
        certificate=history.certificate - start if proved else -1.0,
    )
