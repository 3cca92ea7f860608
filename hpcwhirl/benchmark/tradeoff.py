"""Comparison of solver settings by cost and by error against a finer reference.

Each scene is integrated with each setting, such as another scheme or time step, and
with the reference, whose settings are more accurate than needed. This is repeated for
twins, copies whose force differs by a tiny amount, since small differences grow in a
motion with contact.

Scenes, settings and reference are in trials.toml. A setting changes one property of the
solver, its axis, such as the scheme or the time step.
"""

from __future__ import annotations

import math
import time
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from importlib import resources
from typing import Any

import numpy as np
from scipy.stats import t as student

from hpcwhirl.campaign.simulate import Result, simulate
from hpcwhirl.case.resolve import resolve
from hpcwhirl.errors import InputError, unknown
from hpcwhirl.scene import Scene, apply_settings
from hpcwhirl.scene.input_names import Value
from hpcwhirl.scene.schemes import DEFAULT
from hpcwhirl.scene.words import word_of
from hpcwhirl.structure.bladed_disk import MOST_DOF

Settings = dict[str, Value]
A_BLADE = "modes_a_blade"  # key of a setting: fixed-interface modes / N


@dataclass(frozen=True)
class Setting:
    """A setting of the solver that `hpcwhirl tradeoff` tries.

    Attributes
    ----------
    axis, label : what the setting varies, such as the scheme; name of the setting
    inputs : {input: value} that it sets in a scene
    """

    axis: str
    label: str
    inputs: Settings


def trials() -> dict[str, Any]:
    """Return the table trials.toml: scenes, settings by axis, and the reference."""
    text = resources.files("hpcwhirl.benchmark").joinpath("trials.toml").read_text()
    return tomllib.loads(text)


def default_scenes(base: Scene) -> dict[str, Scene]:
    """Return the scenes on which settings are compared by default, {name: scene}.

    There is one for each kind of motion, and one near a boundary between two words.

    base : scene of which each one changes some inputs
    """
    table = trials()["scenes"]
    return {name: apply_settings(base, inputs) for name, inputs in table.items()}


def applied(scene: Scene, inputs: Settings) -> Scene:
    """Return a scene with the inputs of a setting.

    inputs : {input: value}; the key `modes_a_blade`, times N, sets the input `modes`
    """
    settings: dict[str, Any] = {"until": "end", **inputs}
    if "time_step" in inputs:  # otherwise the input accuracy would choose it
        settings["accuracy"] = 0.0
    if inputs.keys() & {A_BLADE, "modes", "casing.harmonics", "casing.families"}:
        settings["truncation"] = 0.0
    if A_BLADE in settings:
        settings["modes"] = settings.pop(A_BLADE) * scene.engine.rotor.blades
    return apply_settings(scene, settings)


def reference_of(scene: Scene) -> Scene:
    """Return a scene with the accurate settings of the reference, and full traces."""
    scene = resolve(scene).scene  # modes and step are chosen by error bounds
    table, engine, solver = trials()["reference"], scene.engine, scene.solver
    modes = table[A_BLADE] * engine.rotor.blades
    most = MOST_DOF // (3 * engine.rotor.blades) - 1
    chosen: Settings = {
        "scheme": table["scheme"],
        "time_step": min(table["time_step"], 0.25 * solver.time_step),
        "accuracy": 0.0,
        "truncation": 0.0,
        "modes": max(modes, solver.modes),
        "casing.harmonics": max(table["harmonics"], engine.casing.harmonics),
        "casing.families": "all",
        "rotor.elements": max(min(table["elements"], most), engine.rotor.elements),
        "until": "end",
        "traces": "full",
    }
    return apply_settings(scene, chosen)


def axes() -> tuple[str, ...]:
    """Return the names of what settings vary, such as the time step.

    Those that take long to compare are last.
    """
    table = trials()
    return (*table["axes"], "together", *table["slow"])


def settings_of(names: Sequence[str] = ()) -> list[Setting]:
    """Return the settings that vary the named axes.

    names : names from `axes`; none: all but those that take long to compare

    Raises
    ------
    InputError
        for a name that is no axis
    """
    table = trials()
    single = table["axes"] | table["slow"]
    chosen = names or (*table["axes"], "together")
    out = [Setting("as given", "as given", {})]
    for name in chosen:
        if name not in (*single, "together"):
            raise unknown("axis", name, axes())
        if name == "together":
            inputs = table["together"]["inputs"]
            rows = [
                dict(zip(inputs, row, strict=True)) for row in table[name]["values"]
            ]
        else:
            rows = [{n: v} for n, values in single[name].items() for v in values]
        out += [Setting(name, _label(row), row) for row in rows]
    return out


def _label(inputs: Mapping[str, Value]) -> str:
    short = {name.rsplit(".", 1)[-1]: value for name, value in inputs.items()}
    return ", ".join(
        f"{n} {v:g}" if isinstance(v, float) else f"{n} {v}" for n, v in short.items()
    )


NUDGE = 1e-7  # relative change of the force from one twin of a case to the next
CONFIDENCE = 0.95
LEAST = 0.01  # least displacement by which errors of the centre are divided / gap
WARM = 200  # steps that compile a kernel before the timing
# {name of a number: scale of its error, see `difference`}
NUMBERS = {
    "orbit_radius": "radius",
    "contact_impulse": "itself",
    "centre_peak": "radius",
    "tip_peak": "itself",
    "line_frequency": "itself",
    "growth_rate": "window",
}
# numbers that can be compared between runs of different duration
ONLY_LATE = ("orbit_radius", "line_frequency", "growth_rate")
SCORED = ("orbit_radius", "contact_impulse", "centre_peak", "tip_peak")


@dataclass(frozen=True)
class Sample:
    """Words, numbers and cost of one integration of a scene.

    Attributes
    ----------
    words : regime, or why there is none, and whirl
    numbers : {name in `NUMBERS`: number}, and the window, s, and ledger error
    seconds : processor time, s
    """

    words: tuple[str, str]
    numbers: dict[str, float]
    seconds: float


@dataclass
class Compared:
    """Results of one setting on one scene, compared with the reference.

    Attributes
    ----------
    scene : name of the scene
    axis, label : what the setting varies, such as the scheme; name of the setting
    inputs : {input: value} of the setting
    seconds : processor time of each twin, s
    words : "REGIME WHIRL" of each twin
    agree : number of twins with the reference's words
    errors : {name in `NUMBERS`: relative error of the mean over the twins}
    margins : {name: half the confidence interval of that error}
    ledger : largest |ledger_error| of any twin
    refused : error message if the setting was refused, else ""
    """

    scene: str
    axis: str
    label: str
    inputs: Settings
    seconds: list[float] = field(default_factory=list)
    words: list[str] = field(default_factory=list)
    agree: int = 0
    errors: dict[str, float] = field(default_factory=dict)
    margins: dict[str, float] = field(default_factory=dict)
    ledger: float = 0.0
    refused: str = ""

    @property
    def score(self) -> float:
        """Largest relative error of the numbers `SCORED`; infinite if refused."""
        if self.refused:
            return math.inf
        return max((self.errors[n] for n in SCORED if n in self.errors), default=0.0)


def run_once(scene: Scene, twin: int) -> Sample:
    """Integrate one twin of a scene; return its words, numbers and processor time.

    Twin number `twin` has the scene's force (if that is 0, its gap) times 1 + `twin` *
    `NUDGE`. The timed run keeps the traces that the scene asks for. Unless these are
    full, a second run with full traces gives the peak displacement of the tips.
    """
    nudged = "force" if scene.is_loaded else "gap"
    larger = getattr(scene, nudged) * (1.0 + twin * NUDGE)
    scene = apply_settings(scene, {nudged: larger})
    start = time.process_time()  # depends less on other load than wall time
    result = simulate(scene)
    seconds = time.process_time() - start
    if scene.output.traces != "full":
        result = simulate(apply_settings(scene, {"traces": "full"}))
    return _sample(result, seconds)


def _sample(result: Result, seconds: float) -> Sample:
    row = result.row
    regime = word_of("ok", str(row["outcome"]), str(row["regime"]))
    numbers = {n: float(row[n]) for n in NUMBERS if n in row}
    numbers["window"] = float(row["window"])
    numbers["ledger_error"] = abs(float(row["ledger_error"]))
    tips = result.traces["tips"]
    if len(tips):
        numbers["tip_peak"] = float(np.hypot(tips[..., 0], tips[..., 1]).max())
    return Sample((regime, str(row["whirl"])), numbers, seconds)


def _warm(scene: Scene) -> None:
    """Integrate a few steps of a scene before the timing.

    So its kernels are compiled and its model is made.
    """
    step = scene.solver.time_step
    short = {"duration": WARM * step, "revolutions": 0.0, "interval": step}
    simulate(apply_settings(scene, short))


def _possible(finest: Scene) -> Scene:
    """Return the reference of a scene in a form that can be integrated.

    If its scheme is refused for this scene, it gets the default scheme. Its kernels are
    compiled, too.

    finest : the scene with the settings of the reference
    """
    try:
        _warm(finest)
    except InputError:
        finest = apply_settings(finest, {"scheme": DEFAULT})
        _warm(finest)
    return finest


def compare(
    name: str, scene: Scene, setting: Setting, reference: list[Sample], repeats: int
) -> Compared:
    """Integrate a scene with a setting and compare it with the reference.

    Parameters
    ----------
    name, scene : name of the scene; the scene
    setting : inputs to set in the scene
    reference : results of the scene's twins with the settings of the reference
    repeats : number of twins to integrate and time
    """
    out = Compared(name, setting.axis, setting.label, setting.inputs)
    try:
        tried = applied(scene, setting.inputs)
        _warm(tried)
        samples = [run_once(tried, twin) for twin in range(repeats)]
    except InputError as failed:
        out.refused = str(failed)
        return out
    usual = _usual_words(reference)
    out.seconds = [sample.seconds for sample in samples]
    out.words = [" ".join(sample.words) for sample in samples]
    out.agree = sum(sample.words == usual for sample in samples)
    out.ledger = max(sample.numbers["ledger_error"] for sample in samples)
    for number in NUMBERS:
        if setting.axis == "duration" and number not in ONLY_LATE:
            continue
        error = difference(number, samples, reference, scene.gap)
        if error is not None:
            out.errors[number], out.margins[number] = error
    return out


def _usual_words(samples: Sequence[Sample]) -> tuple[str, str]:
    words = [sample.words for sample in samples]
    return max(words, key=words.count)


def difference(
    number: str, samples: Sequence[Sample], reference: Sequence[Sample], gap: float
) -> tuple[float, float] | None:
    """Return the relative error of a number, and half its confidence interval.

    The error is that of the mean over twins, relative to the reference's mean; for
    displacements of the centre to at least `LEAST` times the gap. The error of a growth
    rate is multiplied by the window, which makes it a change of ln amplitude. Return
    None if a value is not finite, or if both samples and reference are 0.

    Parameters
    ----------
    number : name of the number, one of `NUMBERS`
    samples, reference : results of one scene's twins, with the setting and with the
        reference
    gap : m
    """
    a = np.array([s.numbers.get(number, math.nan) for s in samples])
    b = np.array([s.numbers.get(number, math.nan) for s in reference])
    if not (np.isfinite(a).all() and np.isfinite(b).all()):
        return None
    scale = abs(float(b.mean()))
    if NUMBERS[number] == "radius":
        scale = max(scale, LEAST * gap)
    if NUMBERS[number] == "window":
        scale = 1.0 / max(s.numbers["window"] for s in reference)
    if scale == 0.0:
        return (math.inf, math.inf) if a.any() else None
    return abs(float(a.mean() - b.mean())) / scale, _margin(a, b) / scale


def _margin(a: Any, b: Any) -> float:
    """Return half the confidence interval of the difference of two means (Welch).

    a, b : values of one number in the twins with two settings
    """
    if min(len(a), len(b)) < 2:
        return math.inf
    parts = np.array([a.var(ddof=1) / len(a), b.var(ddof=1) / len(b)])
    if not parts.sum() > 0.0:
        return 0.0
    freedom = parts.sum() ** 2 / (parts**2 / [len(a) - 1, len(b) - 1]).sum()
    return float(student.ppf(0.5 + CONFIDENCE / 2, freedom) * math.sqrt(parts.sum()))


def floor_of(reference: Sequence[Sample], gap: float) -> dict[str, float]:
    """Return how much numbers of a scene differ by chance alone, between twins.

    Returns {name in `NUMBERS`: largest relative error of one twin against the mean of
    the others}; a setting with smaller errors is as good as the reference

    reference, gap : results of a scene's twins with the settings of the reference; m
    """
    out = {}
    for number in NUMBERS:
        errors = [
            difference(number, [one], [s for s in reference if s is not one], gap)
            for one in reference
        ]
        finite = [f[0] for f in errors if f is not None]
        if finite:
            out[number] = max(finite)
    return out


@dataclass
class Tradeoff:
    """Results of a comparison of solver settings on several scenes.

    Attributes
    ----------
    compared : results of each setting on each scene
    words : {scene: words of the reference's twins}
    floors : {scene: errors that chance alone makes, see `floor_of`}
    reference : inputs of the reference
    reference_seconds : {scene: median processor time of a reference run, s}
    """

    compared: list[Compared]
    words: dict[str, list[str]]
    floors: dict[str, dict[str, float]]
    reference: Settings
    reference_seconds: dict[str, float]

    def facts(self) -> dict[str, Any]:
        """Return the results as data for JSON, with the score of each comparison."""
        rows = [asdict(row) | {"score": row.score} for row in self.compared]
        return asdict(self) | {"compared": rows}


def measure(
    scenes: Mapping[str, Scene],
    settings: Sequence[Setting],
    repeats: int,
    tell: Callable[[str], None] = lambda _: None,
) -> Tradeoff:
    """Integrate every scene with every setting and with the reference.

    Parameters
    ----------
    scenes : {name: scene}
    settings : settings to compare
    repeats : twins per setting, at least 2 for confidence intervals
    tell : called with a line of text before each setting

    Raises
    ------
    InputError
        if a scene cannot be integrated as given, or with the reference's settings
    """
    out = Tradeoff([], {}, {}, trials()["reference"], {})
    for name, scene in scenes.items():
        tell(f"{name}: reference")
        finest = _possible(reference_of(scene))
        reference = [run_once(finest, twin) for twin in range(repeats)]
        out.words[name] = [" ".join(sample.words) for sample in reference]
        out.floors[name] = floor_of(reference, scene.gap)
        out.reference_seconds[name] = float(np.median([s.seconds for s in reference]))
        for setting in settings:
            tell(f"{name}: {setting.label}")
            row = compare(name, scene, setting, reference, repeats)
            if row.refused and not setting.inputs:
                raise InputError(f"{name}: {row.refused}")
            out.compared.append(row)
    return out
