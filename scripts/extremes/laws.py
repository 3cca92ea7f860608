"""The laws that decide what a scene at an extreme must give.

A law takes settings of a scene, integrates what it needs, and returns in a few words
what came out; it raises `Broken` where the law does not hold. Nothing here knows a
number that the product gave once: closed forms, symmetries, bounds and identities.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import expm

from hpcwhirl.campaign.simulate import Result, result_of
from hpcwhirl.case.limits import shortest_limits
from hpcwhirl.case.profile import NEVER, departure, release_step, shape_of
from hpcwhirl.case.resolve import resolve
from hpcwhirl.case.speed import angle_at, closure_at, has_gap_law, law_of
from hpcwhirl.case.unbalance import steady_at
from hpcwhirl.dynamics.bodies.operators import contact_operators
from hpcwhirl.dynamics.bodies.pulse import pulse_load
from hpcwhirl.dynamics.history import History
from hpcwhirl.dynamics.march import March
from hpcwhirl.errors import InputError, WhirlError
from hpcwhirl.scene import Scene, apply_settings, flatten, named_scene, parse_setting

Settings = Mapping[str, Any]
Law = Callable[[Settings], str]
# One damping ratio a body, so that each extreme of it is that of all modes.
ALIKE = {"support_damping": -1.0, "suspension_damping": -1.0}
SHORT = {
    "duration": 4e-3,
    "interval": 1e-5,
    "traces": "full",
    "time_step": 2e-6,
} | ALIKE
CLOSES = 1e-9  # ledger error of a run, over its throughput
MEETS = 1e-10  # gap error of a run
# NaN before the first sample
UNKNOWN = {"support_peak", "support_peak_time", "torque_peak"}
SAME = 1e-6  # relative difference of what must be the same before chaos sets in


class Broken(Exception):  # noqa: N818 - a verdict
    """A law does not hold; the message says by how much."""


def require(holds: Any, what: str) -> None:
    """Raise Broken where something does not hold."""
    if not bool(holds):
        raise Broken(what)


@dataclass(frozen=True)
class Run:
    """An integrated scene."""

    march: March
    history: History
    result: Result

    @property
    def row(self) -> dict[str, Any]:
        """The row of numbers and words."""
        return self.result.row

    def words(self) -> str:
        """Return outcome, regime, whirl and contacts in a line."""
        row = self.row
        told = f"{row['outcome']}, {row['regime']}, {row['whirl']}"
        return f"{told}; {row['contacts']} contacts"


def scene_of(settings: Settings) -> Scene:
    """Return Table 2, short and in full detail, with settings."""
    return apply_settings(named_scene("table2"), SHORT | dict(settings))


def run_of(settings: Settings) -> Run:
    """Integrate a scene and check that every number of its result is finite."""
    march = March(resolve(scene_of(settings)))
    history = march.run()
    run = Run(march, history, result_of(march.case, history))
    numbers = {n: v for n, v in run.row.items() if not isinstance(v, str)}
    lost = [n for n, v in numbers.items() if n not in UNKNOWN and not np.isfinite(v)]
    lost += [n for n, a in run.result.traces.items() if not np.isfinite(a).all()]
    require(not lost, f"not finite: {', '.join(lost)}")
    return run


def sound(settings: Settings) -> str:
    """Finite, closed ledger, gaps those of the bodies, pushes only, losses only."""
    return checked(settings).words()


def checked(settings: Settings) -> Run:
    """Return the run of a scene that must be sound."""
    return require_sound(run_of(settings))


def require_sound(run: Run) -> Run:
    """Return a run that must be sound."""
    row, history = run.row, run.history
    told = f"{row['outcome']} by {row['stop']}"
    require(row["outcome"] != "unstable", f"{told}: ledger {row['ledger_error']:.1e}")
    require(row["ledger_error"] < CLOSES, f"ledger error {row['ledger_error']:.1e}")
    require(row["gap_error"] < MEETS, f"gap error {row['gap_error']:.1e}")
    require(np.all(np.diff(history.impulse) >= 0.0), "a contact pulls")
    through = sum(abs(v) for name, v in history.ledger.items() if name != "residual")
    least = -CLOSES * through - history.blur[0]  # the loss of waves is what works leave
    require(_is_fed(run) or row["ledger_damping"] >= least, "damping feeds")
    if row["contacts"] == 0:
        require(row["ledger_friction"] == 0.0, "friction without contact")
        require(row["ledger_rotation"] == 0.0, "rotation feeds without contact")
        require(row["regime"] != "divergent", "divergent without contact")
    if row["friction"] == 0.0 and run.march.scene.friction_law == "constant":
        require(row["ledger_friction"] == 0.0, "friction at mu = 0")
    if row["regime"] == "divergent":
        fed = row["ledger_rotation"] + row["ledger_friction"] - row["ledger_pulse"]
        late = row["late_fed"] if row["stop"] != "amplitude" else fed
        require(late > 0.0, "divergent, and nothing feeds it")
    return run


def _is_fed(run: Run) -> bool:
    """Return whether supports do work that the ledger books with damping."""
    rotor = run.march.scene.engine.rotor
    unlike = rotor.stiffness_difference != 0.0 or rotor.damping_difference != 0.0
    return unlike or rotor.cross_coupling != 0.0 or rotor.shaft.startswith("{")


def refused(word: str) -> Law:
    """Return the law: the scene is refused in one line that has the word."""

    def law(settings: Settings) -> str:
        try:
            given = dict(parse_setting(f"{n}={v}") for n, v in settings.items())
            March(resolve(scene_of(given)))
        except InputError as failed:
            text = str(failed)
            require(len(text.splitlines()) == 1, "more than a line")
            require(re.search(word, text), f"'{word}' is not in: {text}")
            return f"refused: {text}"
        raise Broken("taken")

    return law


def touching(settings: Settings) -> str:
    """Sound, and there is contact."""
    run = checked(settings)
    require(run.row["contacts"] > 0, "no contact")
    return run.words()


def lost(settings: Settings) -> str:
    """`unstable`, without a word for the motion, every number finite."""
    return _lost(run_of(settings))


def _lost(run: Run) -> str:
    row = run.row
    words = (row["outcome"], row["regime"], row["whirl"])
    require(words == ("unstable", "none", "none"), f"named {words}")
    return f"unstable by {row['stop']}"


def stopped(settings: Settings) -> str:
    """Carried to the amplitude limit by the load: `overloaded`, every number finite."""
    row = run_of(settings).row
    words = (row["outcome"], row["regime"], row["stop"])
    require(words == ("overloaded", "none", "amplitude"), f"named {words}")
    return f"stopped at step {row['steps']}"


def any_law(settings: Settings) -> str:
    """Sound; or `unstable` with every number finite; or refused in one clear line."""
    try:
        run = run_of(settings)
    except WhirlError as failed:
        require(len(str(failed).splitlines()) == 1, "a refusal of more than a line")
        return f"refused: {failed}"
    told = run.row["outcome"] == "unstable"
    return _lost(run) if told else require_sound(run).words()


def kept(settings: Settings) -> str:
    """Sound, or said to be lost, with every number finite."""
    run = run_of(settings)
    said = run.row["outcome"] == "unstable"
    return _lost(run) if said else require_sound(run).words()


def opened(settings: Settings) -> str:
    """Sound, and no tip is beyond the casing."""
    run = run_of(settings)
    if run.row["outcome"] == "unstable":
        return _lost(run)
    require_sound(run)
    engine, tips = run.march.scene.engine, run.history.tips
    followed = engine.casing.contact_law == "rigid" and run.history.casing.size
    if not followed or engine.casing.discretization in {"elements", "shell"}:
        return run.words()
    present = np.arange(tips.shape[1]) != engine.rotor.lost_blade
    deepest = -float(_gaps(run)[:, present].min())
    scene = run.march.scene
    near = 1e-5 if law_of(scene) else 1e-9
    allowed = near * float(np.abs(tips).max()) + 1e-15
    if has_gap_law(scene):  # a line between the ends of intervals
        allowed += 1e-4 * scene.gap
    require(deepest <= allowed, f"a tip is {deepest:.1e} m beyond the casing")
    return run.words()


def _gaps(run: Run) -> Any:
    """Return the gaps of a run from its traces, (n, N), m."""
    scene, history, blades = run.march.scene, run.history, run.history.tips.shape[1]
    time = history.time[:, None]
    around = 2 * np.pi * np.arange(blades) / blades
    angles = angle_at(scene, time) + around
    phases = angles[:, :, None] * np.arange(history.casing.shape[1])
    cosine, sine = history.casing[:, None, :, 0], history.casing[:, None, :, 1]
    wall = (cosine * np.cos(phases) + sine * np.sin(phases)).sum(axis=-1)
    step, let_go = scene.solver.time_step, release_step(scene)  # then the trace has it
    held = (let_go == NEVER) | (time < (let_go + 0.5) * step)
    wall = wall + held * departure(shape_of(scene), angles)
    return scene.gap - closure_at(scene, time) + wall - history.tips[..., 0]


def many_steps(settings: Settings) -> str:
    """Undamped, in contact time and again: `opened`, its ledger closed all along."""
    run = checked(settings)
    row = run.row
    require(row["contacts"] > 1000, f"{row['contacts']} contacts")
    told = f"{run.march.steps:.0e} steps, {row['contacts']} contacts"
    return f"{told}, ledger closes to {row['ledger_error']:.0e}"


def dry(settings: Settings) -> str:
    """As `opened`, and all that friction does is its heat: mu or the speed is 0.

    Tips that always slide with the rotation leave no heat, those of set-valued slip do.
    """
    run = checked(settings)
    given = run.march.scene
    slides = given.friction_law != "constant" and given.speed != 0.0
    if not slides and law_of(given) is None:
        _require_heat_alone(run)
    return opened(settings)


def _require_heat_alone(run: Run) -> None:
    """Require the work of friction to be minus its heat, to the bit where that is 0."""
    set_valued = run.march.scene.slip == "set-valued"
    heat = run.row["friction_heat"] if set_valued else 0.0
    through = sum(abs(v) for n, v in run.row.items() if n.startswith("ledger_"))
    require(heat >= 0.0, f"heat of {heat:.1e} J")
    miss = abs(run.row["ledger_friction"] + heat)
    allowed = CLOSES * through if heat > 0.0 else 0.0
    require(miss <= allowed, f"friction does {miss:.1e} J of work but its heat")


def lossless(settings: Settings) -> str:
    """As `opened`, and damping loses nothing, where no support has any."""
    run = run_of(settings)
    row, rotor = run.row, run.march.scene.engine.rotor
    held = rotor.film_viscosity > 0.0 or _is_fed(run)
    if row["outcome"] != "unstable" and not held:
        through = sum(abs(v) for n, v in row.items() if n.startswith("ledger_"))
        most = CLOSES * through + run.history.blur[0]
        require(abs(row["ledger_damping"]) <= most, f"loses {row['ledger_damping']}")
    return opened(settings)


def in_place(settings: Settings) -> str:
    """Nothing touches; rest, equilibrium or circle is kept, and not called damped."""
    run = checked(settings)
    row, scene, tips = run.row, run.march.scene, run.history.tips
    require(row["contacts"] == 0, f"{row['contacts']} contacts")
    grows = run.history.free_growth.max() > 0.0
    require(not (grows and row["regime"] == "damped"), "damped, and free motion grows")
    engine = scene.engine
    driven = scene.start_energy or scene.lost_blade_time or law_of(scene)
    driven = driven or engine.casing.profile_release or engine.casing.amplitude
    if not driven and engine.rotor.lost_blade < 0:
        points = np.stack(run.march.model.places, axis=-1)
        times, model = run.history.time, run.march.model
        rest = np.array([steady_at(model, scene, t)[points] for t in times])
        size = max(float(np.abs(tips).max()), 1e-200)
        miss = float(np.abs(tips - rest).max()) / size
        require(miss < SAME or size == 1e-200, f"moves by {miss:.1e} of its size")
    return run.words()


def at_limit(settings: Settings) -> str:
    """Sound at 0.99 of the longest step; refused by name at 1.01 of it."""
    case = resolve(scene_of(settings))
    longest = min(shortest_limits(case.model, case.scene).values())
    past = dict(settings) | {"time_step": 1.01 * longest}
    refused("time_step|speed|pulse|rise")(past)
    step = 0.99 * longest
    return kept(dict(settings) | {"time_step": step, "interval": 10 * step})


def apart_in_mirror(settings: Settings) -> str:
    """Turn the other way, all angles mirrored: the motion is mirrored."""
    one = run_of(settings)
    other = run_of(dict(settings) | in_mirror(settings))
    words = [(r.row["outcome"], r.row["regime"], r.row["whirl"]) for r in (one, other)]
    if one.row["outcome"] == "unstable":
        require(words[0] == words[1], f"{words}")
        return _lost(one)
    drawn = one.march.scene.start_energy > 0.0  # a start is drawn by the mode
    if not drawn:
        blades = one.history.tips.shape[1]
        back = (-np.arange(blades)) % blades
        a, b = one.history.tips[:, back] * [1, -1], other.history.tips
        require(a.shape == b.shape, f"{len(a)}, {len(b)} samples")
        miss = float(np.abs(a - b).max()) / max(float(np.abs(b).max()), 1e-280)
        require(miss < SAME, f"tips differ by {miss:.1e}")
        require(words[0] == words[1], f"{words}")
    return opened(settings)


def in_mirror(given: Settings) -> Settings:
    """Return the inputs by which a scene differs from the one in a mirror."""
    angles = "unbalance_phase", "gravity_angle", "offset_angle"
    signed = "speed", *angles, "acceleration", "speed_to"
    out = {name: -given[name] for name in signed if name in given}
    blades = given["blades"]
    if "mistuning" in given:
        out["mistuning"] = [given["mistuning"][-j] for j in range(blades)]
    if "lost_blade" in given:
        out["lost_blade"] = -given["lost_blade"] % blades
    if "profile" in given:
        head, *rows = given["profile"].split(";")
        parts = [row.split(",") for row in rows]
        out["profile"] = ";".join([head, *(f"{h},{a},-{p}" for h, a, p in parts)])
    if "shaft" in given and "sections" in given["shaft"]:
        turned = given["shaft"].replace("kxy", "?").replace("kyx", "kxy")
        out["shaft"] = turned.replace("?", "kyx")
    return out


def named(law: Law, inputs: frozenset[str]) -> Law:
    """Return the law: that one holds, or a line names one of the inputs."""

    def either(settings: Settings) -> str:
        try:
            return law(settings)
        except WhirlError as failed:
            text = str(failed)
            require(len(text.splitlines()) == 1, "a refusal of more than a line")
            said = set(re.findall(r"\w+", text))
            require(said & inputs, f"names none of {', '.join(sorted(inputs))}: {text}")
            return f"refused: {text}"

    either.__doc__ = law.__doc__
    return either


def at_rest(settings: Settings) -> str:
    """Nothing moves: damped, or undecided where a free motion would grow."""
    run = checked(settings)
    moved = max(float(np.abs(run.history.tips).max(initial=0)), run.row["centre_peak"])
    require(moved < 1e-200, f"moves by {moved:.1e} m")
    word = "undecided" if run.history.free_growth > 0.0 else "damped"
    require(run.row["regime"] == word, run.row["regime"])
    return run.words()


def alike(one: History, other: History, tolerance: float = SAME) -> None:
    """Require two runs of a scene to be the same to round-off, grown a little."""
    require(
        one.contacts == other.contacts, f"{one.contacts}, {other.contacts} contacts"
    )
    sizes = {"tips": "tips", "centre": "tips", "impulse": "impulse"}
    sizes |= dict.fromkeys(("energy", "lost", "fed"), "energy")
    for name, size in sizes.items():
        a, b = getattr(one, name), getattr(other, name)
        require(a.shape == b.shape, f"{name}: {a.shape}, {b.shape}")
        scale = max(float(np.abs(getattr(other, size)).max(initial=0.0)), 1e-280)
        miss = float(np.abs(a - b).max(initial=0.0)) / scale
        require(miss <= tolerance, f"{name} differ by {miss:.1e}")


def schemes_agree(settings: Settings) -> str:
    """`modal`, `general` and `paper` are the same, in contact too."""
    runs = [checked({**settings, "scheme": s}) for s in ("modal", "general", "paper")]
    require(runs[0].row["contacts"] > 0, "no contact")
    alike(runs[0].history, runs[1].history)
    alike(runs[0].history, runs[2].history)
    return runs[0].words()


def handed_over(word: str) -> Law:
    """Return the law: `exact` hands over to `modal`, for a reason that has the word."""

    def law(settings: Settings) -> str:
        """`exact` hands over to `modal`, to the bit, and says why."""
        one, other = (checked({**settings, "scheme": s}) for s in ("exact", "modal"))
        told = one.march.case.handed_over
        require(word in told, f"'{word}' is not in: {told}")
        for name in ("tips", "centre", "impulse", "energy"):
            a, b = getattr(one.history, name), getattr(other.history, name)
            require(np.array_equal(a, b), f"{name} differ")
        return one.words()

    return law


def mirrored(settings: Settings) -> str:
    """Turn the other way: the motion is mirrored."""
    one = checked(settings)
    other = checked({**settings, "speed": -one.march.scene.speed})
    blades = one.march.model.blades
    back = (-np.arange(blades)) % blades
    a, b = one.history.tips[:, back] * [1, -1], other.history.tips
    require(a.shape == b.shape, f"{len(a)}, {len(b)} samples")
    miss = float(np.abs(a - b).max()) / max(float(np.abs(b).max()), 1e-280)
    require(miss < SAME, f"tips differ by {miss:.1e}")
    words = [(r.row["regime"], r.row["whirl"]) for r in (one, other)]
    require(words[0] == words[1], f"{words}")
    return one.words()


def unique(settings: Settings) -> str:
    """Sound, and the contact problem has one solution: W + W^T positive definite."""
    run = checked(settings)
    model, scene = run.march.model, run.march.scene
    w_rotor, compliance, *_ = contact_operators(model, scene)
    least = np.inf
    for turned in np.linspace(0.0, 2 * np.pi, 97):
        angles = turned + 2 * np.pi * np.arange(model.blades) / model.blades
        w = w_rotor.copy()
        if model.ring is not None:
            rows = model.ring.rows(angles)[0][:, model.ring.radial]
            w += (rows @ compliance @ rows.T).T
        values = np.linalg.eigvalsh(w + w.T)
        least = min(least, float(values[0] / np.trace(w) * model.blades / 2))
    require(least > 0.0, f"W + W^T has an eigenvalue {least:.2g} of the mean")
    return f"{run.words()}; least eigenvalue of W + W^T {least:.2f} of the mean"


def response(omega: float, xi: float, load: float, scene: Scene, end: float) -> float:
    """Return q(end) of q'' + 2 xi w q' + w^2 q = load sin(pi t / tau), 0 < t < tau."""
    p, tau = np.pi / scene.pulse, min(scene.pulse, end)
    flow = np.zeros((4, 4))
    flow[0, 1], flow[1, 0], flow[1, 1] = 1.0, -(omega**2), -2 * xi * omega
    flow[1, 2], flow[2, 3], flow[3, 2] = load, p, -p
    state = expm(flow * tau) @ np.array([0.0, 0.0, 0.0, 1.0])
    free = expm(flow[:2, :2] * (end - tau))
    return float((free @ state[:2])[0])


def amplitudes(run: Run) -> tuple[Any, Any, Any]:
    """Return (loaded modes, their amplitudes at the end, their modal loads)."""
    body = run.march.model.casing
    require(body is not None, "no elastic casing")
    load = body.shapes.T @ pulse_load(run.march.model, run.march.scene)
    chosen = np.flatnonzero(np.abs(load) > 1e-9 * np.abs(load).max())
    q = body.shapes.T @ body.mass @ run.march.displacements()[1]
    return chosen, q[chosen], run.march.scene.force * load[chosen]


def closed_form(settings: Settings) -> str:
    """Without contact: the response of damped modes to half a sine, at the end."""
    run = checked(settings)
    require(run.row["contacts"] == 0, f"{run.row['contacts']} contacts")
    body, scene = run.march.model.casing, run.march.scene
    chosen, found, loads = amplitudes(run)
    step = scene.solver.time_step
    end, worst = run.march.steps * step, 0.0
    size = 0.0
    for m, q, load in zip(chosen, found, loads, strict=True):
        xi = float(body.ratios[m])
        want = response(float(body.omega[m]), xi, load, scene, end)
        omega, share = float(body.omega[m]), step / min(scene.pulse, end)
        # the most that the pulse's impulse moves it; an error of its period and damping
        most = abs(load) * min(scene.pulse, end) * min(end, 1.0 / max(omega, 1e-9))
        stiff = omega * step * (1 + 2 * xi)
        allowed = stiff**2 * (1 + omega * end) / 12 + 1.7 * share**2
        require(
            abs(q - want) <= allowed * most + 1e-12 * most,
            f"mode {m}: {q:.6e}, closed form {want:.6e}, allowed {allowed * most:.1e}",
        )
        worst, size = max(worst, abs(q - want)), max(size, abs(want))
    return f"{run.words()}; off by {worst / size:.0e}"


def no_drift(settings: Settings) -> str:
    """Undamped, free: q_n = sum_j dt^2 f_j sin((n - j) theta) / sin theta exactly."""
    run = checked({**settings, "casing.damping": 0.0, "rotor.damping": 0.0})
    require(run.row["contacts"] == 0, "contact")
    scene, body = run.march.scene, run.march.model.casing
    step, steps = scene.solver.time_step, run.march.steps
    j = np.arange(1, int(scene.pulse / step) + 1)
    j = j[j * step < scene.pulse]
    force = np.sin(np.pi * j * step / scene.pulse)
    chosen, found, loads = amplitudes(run)
    want = np.zeros(len(chosen))
    for place, m in enumerate(chosen):
        half = np.longdouble(body.omega[m]) * step / 2
        theta = 2 * np.arcsin(half)
        phase = np.sin(theta * (steps - j).astype(np.longdouble))
        sums = (force * phase).sum() * loads[place] * step**2 / np.sin(theta)
        want[place] = float(sums)
    miss = float(np.abs(found - want).max() / np.abs(want).max())
    require(miss < 1e-5, f"off by {miss:.1e} after {steps} steps")
    return f"{steps} steps, off by {miss:.0e}"


LENGTH, TIME, FORCE, SPEED = 1, 1, 2, -1  # powers of the scale, E and rho unchanged
POWERS = {
    "gap": LENGTH, "pulse": TIME, "duration": TIME, "force": FORCE, "speed": SPEED,
    "solver.time_step": TIME, "output.interval": TIME,
    "engine.rotor.centre_stiffness": 1, "engine.casing.support_frequency": SPEED,
} | {
    f"engine.rotor.{name}": LENGTH
    for name in ("radius", "disk_radius", "blade_width", "root_thickness",
                 "spoke_width", "spoke_thickness", "rim_width", "rim_thickness")
} | {f"engine.casing.{name}": LENGTH for name in ("thickness", "width")}  # fmt: skip


def scaled(factor: float) -> Law:
    """Return the law: an engine `factor` times as large does the same, scaled.

    Lengths and times by s, speeds by 1, forces by s^2, energies by s^3.
    """

    def law(settings: Settings) -> str:
        one = checked(settings)
        plain = flatten(one.march.scene)
        grown = {n: plain[n] * factor**p for n, p in POWERS.items()}
        other = checked(plain | grown)
        require(one.row["contacts"] == other.row["contacts"], "contacts differ")
        for word in ("outcome", "regime", "whirl"):
            require(one.row[word] == other.row[word], f"{word} differs")
        by = {"energy": 3, "impulse": 3, "lost": 3, "tips": 1, "centre": 1}
        for name, power in by.items():
            a, b = getattr(one.history, name), getattr(other.history, name)
            miss = np.abs(a - b / factor**power).max() / np.abs(a).max()
            require(miss < SAME, f"{name} differs by {miss:.1e}")
        return f"{one.words()}; as the original"

    return law
