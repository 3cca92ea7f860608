"""Effects of rotation on a case's rotor, as `hpcwhirl model` and figures show them.

They are natural frequencies, critical speeds, stability of free motions and radial
growth of the tips. With the input rotation = "full" the rotor has Coriolis, centrifugal
and spin-softening terms; with "none" it has not, and its frequencies are constant.
"""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from hpcwhirl.analysis.critical import critical_of_families, critical_of_waves
from hpcwhirl.arrays import Floats
from hpcwhirl.case.growth import stability_of
from hpcwhirl.case.resolve import Case, resolve
from hpcwhirl.case.rotation_choice import choice_of
from hpcwhirl.case.speed import extremes
from hpcwhirl.case.unbalance import facts_of_unbalance, facts_of_weight
from hpcwhirl.errors import InputError
from hpcwhirl.reduction import families, waves
from hpcwhirl.reduction.criticals import Critical, damped_criticals, stability_limit
from hpcwhirl.reduction.growth import Stability
from hpcwhirl.reduction.modes import ModalModel, SpinBlock
from hpcwhirl.reduction.supports import ROUND, valid_up_to
from hpcwhirl.scene import Scene, apply_settings
from hpcwhirl.scene.rules import STANDING, WHOLE

Waves = dict[str, tuple[Floats, Floats]]
BESIDE = {"none": "full", "full": "none"}


def critical_of(case: Case, orders: int) -> list[dict[str, Any]]:
    """Return the speeds at which rotor and casing waves coincide, the paper's Eq. (13).

    They are dicts of nodal_diameter, order n, speed (rad/s) and family. With full
    rotation, frequencies depend on the speed; a rotor of unequal sectors then has no
    waves of one nodal diameter, and the list is empty.

    orders : highest order n of a super-harmonic of the casing, for 1F
    """
    table = families.modal_table(case.model)
    if case.model.rotor.spin is None:
        return critical_of_families(table, orders)
    rotor = families.rotor_by_diameter(case.model)
    return critical_of_waves(rotor, families.first_family(table, "casing"), orders)


def lines_of(case: Case) -> list[dict[str, Any]]:
    """Return the rotor's waves at the case's speed, with frequencies in both frames.

    Each is a dict of the attributes of `WaveLine`, and of those of `damping_of`.
    """
    rotor, blades = families.rotor_by_diameter(case.model), case.model.blades
    found = waves.wave_lines(rotor, blades, case.given.speed)
    return [asdict(line) | damping_of(line) for line in found]


def damping_of(line: waves.WaveLine) -> dict[str, float | None]:
    """Return the damping of a wave by the names that bearings' engineers use.

    damping_ratio is -sigma / |sigma + i omega|, log_decrement -2 pi sigma / |omega|
    (None where omega is 0), with sigma the growth rate and omega the frequency in the
    static frame for k = 1, where sensors at the bearings see it, else in the rotating
    frame.
    """
    omega = line.static if line.nodal_diameter == 1 else line.rotating
    return _damping(line.growth, omega)


def _damping(growth: float, omega: float) -> dict[str, float | None]:
    """Return damping_ratio and log_decrement of a wave, see `damping_of`.

    growth, omega : sigma, 1/s; rad/s
    """
    size = float(np.hypot(growth, omega))
    return {
        "damping_ratio": -growth / size if size else 0.0,
        "log_decrement": -2 * np.pi * growth / abs(omega) if omega else None,
    }


def rotation_of_case(case: Case, fastest: float = 0.0) -> dict[str, Any]:
    """Return the effects of rotation at the case's speed, as `model --json` shows them.

    case, fastest : the case; rad/s, highest speed of interest, such as of a sweep

    Returns
    -------
    dict of
    kind : "none" or "full", whether terms of rotation are included
    auto : what engine.rotation = "auto" chose and why, see `Choice`; None: not "auto"
    growth : 1/s, growth rate of the least stable free motion
    unstable_from : rad/s, lowest speed where a free motion grows; None if none is found
    bands : bands of speed in which a free motion grows, dicts of the attributes of
        `reduction.growth.Band`
    searched : the speeds at which bands and `unbalance_speeds` were searched: low, high
        (rad/s), ends (why no further, see `Span`), resolution (rad/s, width from which
        on no band is missed); None without terms of rotation
    unbalance_speeds : rad/s, at which an unbalance is in resonance with a wave of k =
        1, undamped
    damped_critical_speeds : the same with damping, dicts of the attributes of
        `reduction.criticals.Critical` and of `damping_of`
    stability_limit : Q_0, cross coupling at the centre, in addition to that of the
        supports, at which the log decrement of the least stable wave is 0 at the case's
        speed: coupling, N/m, and frequency, rad/s, see `reduction.criticals.Limit`;
        None for unequal sectors, a clamped centre, and without terms of rotation
    tip_growth : m, largest radial growth of a tip if rotation is full, else None
    clearance : m, at speed; `gap` less the growth if `gap_at` is rest, else `gap`
    film : damping and clearance of the squeeze film, see `_film`; None without one
    unbalance : the circle on which the scene's unbalance moves the centre, see
        `facts_of_unbalance`; None without unbalance
    weight : the sag by the rotor's weight, see `facts_of_weight`; None without gravity
    """
    model, speed = case.model, case.given.speed
    rotor, turns = families.rotor_by_diameter(model), model.rotor.spin is not None
    fastest = max(abs(fastest), *map(abs, extremes(case.given)))
    stability = stability_of(model, fastest)
    running = apply_settings(case.given, {"gap": max(case.clearance, 0.0)})
    limit = stability_limit(rotor, speed)
    return {
        "kind": case.reduced.engine.rotation,
        "auto": _chosen(case.given),
        "growth": waves.largest_growth(rotor, model.blades, speed),
        **_facts_of_bands(stability),
        "unbalance_speeds": unbalance_speeds_of(case, fastest),
        "damped_critical_speeds": damped_speeds_of(case, fastest),
        "stability_limit": limit._asdict() if limit else None,
        "tip_growth": case.growth if turns else None,
        "clearance": case.clearance,
        "film": _film(model.rotor, speed),
        "unbalance": facts_of_unbalance(model, running),
        "weight": facts_of_weight(model, running),
    }


def _facts_of_bands(found: Stability | None) -> dict[str, Any]:
    """Return the entries `unstable_from`, `bands` and `searched` of a case's facts."""
    if found is None:
        return {"unstable_from": None, "bands": [], "searched": None}
    return {
        "unstable_from": found.unstable_from,
        "bands": [asdict(band) for band in found.bands],
        "searched": found.span._asdict() | {"resolution": found.resolution},
    }


def unbalance_speeds_of(case: Case, fastest: float = 0.0) -> list[float]:
    """Return the speeds, rad/s, at which an unbalance is in resonance, undamped.

    They lie within the speeds that `reduction.growth.search_range` gives.

    case, fastest : the case; rad/s, highest speed of interest
    """
    found = stability_of(case.model, fastest)
    if found is None:
        return []
    speeds = waves.unbalance_speeds(families.rotor_by_diameter(case.model), fastest)
    return [speed for speed in speeds if speed <= found.span.high]


def damped_speeds_of(case: Case, fastest: float = 0.0) -> list[dict[str, Any]]:
    """Return the damped critical speeds of an unbalance, as `model --json` shows them.

    They are dicts of the attributes of `Critical` and of `damping_of`.

    case, fastest : the case; rad/s, highest speed of interest
    """

    def told(one: Critical) -> dict[str, Any]:
        return {**one._asdict(), **_damping(one.growth, one.speed)}

    rotor = families.rotor_by_diameter(case.model)
    return [told(one) for one in damped_criticals(rotor, case.model.blades, fastest)]


def _film(rotor: ModalModel, speed: float) -> dict[str, float] | None:
    """Return damping and clearance of the squeeze film at the shaft's centre, by name.

    None without a film.

    Returns
    -------
    damping : c_0, N s/m, in small motions
    clearance : m, of the film
    straight, circling : ratio of displacement to clearance at which the film's damping
        of straight motions through the middle, and of circles, exceeds c_0 by a tenth
    """
    own = rotor.spin.support.at(speed) if rotor.spin else ROUND
    if not own.film:
        return None
    straight, circling = valid_up_to()
    return {
        "damping": own.film,
        "clearance": own.clearance,
        "straight": straight,
        "circling": circling,
    }


def _chosen(scene: Scene) -> dict[str, Any] | None:
    if scene.engine.rotation != "auto":
        return None
    choice = choice_of(scene)
    change = None if choice.change is None else choice.change._asdict()
    return {**choice._asdict(), "change": change, "told": choice.told}


def beside(case: Case) -> Case | None:
    """Return the same case with engine.rotation = "full" instead of "none", or reverse.

    It serves to compare both. For "none", inputs that need full rotation are set to
    values without effect. None if the engine does not allow the other value.
    """
    other = BESIDE[case.reduced.engine.rotation]
    settings: dict[str, Any] = {"engine.rotation": other}
    if other == "none":
        usual = {**dict.fromkeys(STANDING, 0.0), **dict(WHOLE)}
        settings |= {f"engine.rotor.{name}": value for name, value in usual.items()}
        settings["unbalance"] = 0.0
        settings["gap_at"] = "speed"
    try:
        found = resolve(apply_settings(case.given, settings))
        found.model  # noqa: B018 - a file that lacks the terms is refused here
    except InputError:
        return None
    return found


def waves_over(case: Case, k: int, speeds: Floats) -> Waves:
    """Return frequencies, static frame, of a rotor's waves over the speed.

    Parameters
    ----------
    case : case whose rotor is taken
    k : nodal diameter of the waves
    speeds : (n,), rad/s

    Returns
    -------
    {family: ((n,), (n,))}, rad/s, of 1F and the families that move the shaft:
    frequencies in the static frame of two waves, that which turns with the rotation in
    the rotating frame, and that which turns against it; > 0: turns with the rotation

    Raises
    ------
    InputError
        with full rotation and unequal sectors, whose waves have no single diameter
    """
    model = families.rotor_by_diameter(case.model)
    speeds = np.abs(speeds)  # mirrored waves
    if model.spin is None:
        own = own_waves(families.modal_table(case.model), k)
        return {name: (k * speeds + w, k * speeds - w) for name, w in own.items()}
    if not model.spin.waves:
        msg = "waves of one nodal diameter need equal blades where rotation is full"
        raise InputError(msg)
    if k >= len(model.spin.waves):
        return {}
    piece = model.spin.waves[k]
    turned = np.array([waves.wave_roots(model, piece, s).imag for s in speeds.tolist()])
    return _pairs(model, piece, k * speeds[:, None] - turned)


def own_waves(table: list[families.Line], k: int) -> dict[str, float]:
    """Return frequencies of a rotor without terms of rotation at nodal diameter k.

    Returns {family: omega, rad/s} of 1F and the families that move the shaft; a family
    without a mode of this diameter is left out

    table : modal table of the model, from `modal_table`
    """
    found = families.moving_families(table)
    return {family: own[k] for family, own in found.items() if k in own}


def _pairs(model: ModalModel, piece: SpinBlock, values: Floats) -> Waves:
    """Return the values that belong to the two waves of each family, forward first.

    Returns {family: ((n,), (n,))} of 1F and the families that move the shaft

    Parameters
    ----------
    model : rotor with terms of rotation
    piece : its matrices of one nodal diameter, with m modes
    values : (n, 2 m), frequencies or growth rates at n speeds, a column for each of the
        2 m roots in the order of `wave_roots`
    """
    count = len(piece.omega)
    return {
        name: (values[:, count - 1 - rank], values[:, count + rank])
        for rank, name in families.moving_ranks(model, piece.k).items()
    }


def growth_over(case: Case, speeds: Floats) -> tuple[Floats, Waves]:
    """Return growth rates of the rotor's free motions over the speed, 1/s.

    Parameters
    ----------
    case : case whose rotor is taken
    speeds : (n,), rad/s

    Returns
    -------
    (n,), growth rate of the fastest growing motion of any nodal diameter; and {family:
    ((n,), (n,))}, growth rates of the forward and the backward wave of k = 1, {}
    without full rotation
    """
    model, blades = families.rotor_by_diameter(case.model), case.model.blades
    fastest = [waves.largest_growth(model, blades, speed) for speed in speeds.tolist()]
    return np.array(fastest), shaft_waves_over(case, speeds)["growth"]


def shaft_waves_over(case: Case, speeds: Floats) -> dict[str, Waves]:
    """Return frequencies and growth rates of the waves of k = 1 over the speed.

    Returns {"static": Waves, "growth": Waves}: rad/s, static frame, > 0: forward; 1/s;
    both {} without terms of rotation and for unequal sectors

    case, speeds : the case; (n,), rad/s
    """
    model = families.rotor_by_diameter(case.model)
    spin, speeds = model.spin, np.abs(speeds)
    if spin is None or len(spin.waves) < 2:
        return {"static": {}, "growth": {}}
    piece = spin.waves[1]
    roots = np.array([waves.wave_roots(model, piece, s) for s in speeds.tolist()])
    return {
        "static": _pairs(model, piece, speeds[:, None] - roots.imag),
        "growth": _pairs(model, piece, roots.real),
    }


def bands_over(case: Case, speeds: Floats) -> Waves:
    """Return the band of frequencies of each family of rotor modes over the speed.

    Returns {family: ((n,), (n,))}, rad/s, the least and the largest |omega| in the
    rotating frame of all nodal diameters; with full rotation of all but k = 1, whose
    two waves differ much

    speeds : (n,), rad/s
    """
    model, same = case.model, np.ones(len(speeds))
    rotor = families.rotor_by_diameter(model)
    if rotor.spin is None:
        found: dict[str, list[float]] = {}
        for line in families.modal_table(model):
            if line.body == "rotor":
                omega = 2 * np.pi * line.frequency_hz
                found.setdefault(line.family, []).append(omega)
        return {name: (min(w) * same, max(w) * same) for name, w in found.items()}
    sizes: dict[str, list[list[float]]] = {}
    for place, speed in enumerate(speeds.tolist()):
        lines = waves.wave_lines(rotor, model.blades, speed)
        for wave in (line for line in lines if line.nodal_diameter != 1):
            own = sizes.setdefault(wave.family, [[] for _ in speeds])
            own[place].append(abs(wave.rotating))
    return {
        name: (np.array([min(w) for w in own]), np.array([max(w) for w in own]))
        for name, own in sizes.items()
        if all(own)
    }


def side_by_side(case: Case, orders: int, fastest: float = 0.0) -> dict[str, Any]:
    """Return a rotor's facts without and with the effects of rotation, to compare them.

    Returns {"none": facts, "full": facts}. Facts are the dict of `rotation_of_case`
    with two more entries: `lines`, the rotor's waves, and `critical_speeds`. For an
    engine from file without terms of rotation only "none" is returned.

    orders : highest order n of a super-harmonic of the casing, for 1F
    fastest : rad/s, highest speed of interest
    """
    cases = [case, beside(case)]
    return {
        one.reduced.engine.rotation: {
            **rotation_of_case(one, fastest),
            "lines": lines_of(one),
            "critical_speeds": critical_of(one, orders),
        }
        for one in cases
        if one is not None
    }
