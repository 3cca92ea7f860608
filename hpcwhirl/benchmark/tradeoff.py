"""Comparison of solver settings by cost and by error against a finer reference.

Each case is integrated with each setting, such as another scheme or time step, and with
the reference, which is finer than all. This is done in rounds: each round integrates
everything once, with a time step a few per cent shorter than in the last, so that
repeats of a computation are spread over the whole run, and its twins differ by what a
step's error makes. The reference is a little coarser in every second round: what both
differ by is not known of the case. Settings that lead to the same computation share one
row.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from hpcwhirl.benchmark.numbers import (
    NINE,
    NUDGE,
    NUMBERS,
    ONLY_LATE,
    SCORED,
    Quantile,
    Run,
    Shift,
    error_of,
    quantile_of,
    run_of,
    scatter_of,
    sensitive,
    shifts_of,
    usual_words,
)
from hpcwhirl.benchmark.trials import (
    Setting,
    Settings,
    applied,
    coarser_than,
    pinned,
    reference_of,
    trials,
)
from hpcwhirl.campaign.simulate import course_of, simulate
from hpcwhirl.errors import InputError
from hpcwhirl.scene import Scene, apply_settings, flatten
from hpcwhirl.scene.schemes import DEFAULT

GROWING = ("growth_rate", "line_frequency")  # numbers of a divergent case
WARM = 200  # steps that compile a kernel before the timing
REFERENCE = "reference"  # key of its runs
Key = tuple[tuple[str, str], ...]
Runs = dict[tuple[str, str], list[Run]]  # {(key of a setting, case): its twins}


@dataclass(frozen=True)
class Computation:
    """One or more settings that lead to the same computation in all cases.

    Attributes
    ----------
    settings : them; the first one that can be typed gives the options
    scenes : {case: scene with time step and modes as numbers}; less those refused
    refused : {case: why the setting is refused}
    """

    settings: tuple[Setting, ...]
    scenes: dict[str, Scene]
    refused: dict[str, str]

    @property
    def label(self) -> str:
        """The names of its settings."""
        return " = ".join(setting.label for setting in self.settings)

    @property
    def key(self) -> str:
        """The key of its runs: that of its first setting."""
        return self.settings[0].key

    def with_more(self, other: Computation) -> Computation:
        """Return the same setting's computation with further cases."""
        scenes, refused = self.scenes | other.scenes, self.refused | other.refused
        return Computation(self.settings, scenes, refused)

    def of(self, names: Collection[str]) -> Computation:
        """Return the same setting's computation of the named cases only."""
        scenes = {name: one for name, one in self.scenes.items() if name in names}
        refused = {name: why for name, why in self.refused.items() if name in names}
        return Computation(self.settings, scenes, refused)


def computations(
    scenes: Mapping[str, Scene], settings: Sequence[Setting]
) -> list[Computation]:
    """Return what each setting computes, in their order; equal ones are not joined.

    scenes, settings : {case: scene}; settings to compare
    """
    return [_computation(scenes, setting) for setting in settings]


def distinct(each: Sequence[Computation]) -> list[Computation]:
    """Return computations, those joined that are the same in all cases."""
    found: dict[Key, Computation] = {}
    for one in each:
        key = tuple((name, _computed(scene)) for name, scene in one.scenes.items())
        if key in found and key:
            same = found[key]
            found[key] = replace(same, settings=(*same.settings, *one.settings))
        else:
            found[key or ((one.settings[0].key, ""),)] = one
    return list(found.values())


def _computed(scene: Scene) -> str:
    """Return a text of a pinned scene that is equal for equal computations.

    With a rotor from file, `truncation` has set `modes`; without it these are not used.
    """
    inputs = flatten(scene)
    if scene.engine.file:
        del inputs["solver.truncation" if scene.solver.truncation else "solver.modes"]
    return repr(sorted(inputs.items()))


def _computation(scenes: Mapping[str, Scene], setting: Setting) -> Computation:
    ready, refused = {}, {}
    for name, scene in scenes.items():
        try:
            tried = pinned(applied(scene, setting.inputs))
            _warm(tried)
        except InputError as failed:
            refused[name] = str(failed)
        else:
            ready[name] = tried
    return Computation((setting,), ready, refused)


def _warm(scene: Scene) -> None:
    """Integrate a few steps of a scene before the timing.

    So its kernels are compiled and its model is made.
    """
    step = scene.solver.time_step
    short = {"duration": WARM * step, "revolutions": 0.0, "interval": step}
    simulate(apply_settings(scene, short))


def _references(scene: Scene) -> tuple[Scene, Scene]:
    """Return the reference of a scene and the coarser one, which can be integrated.

    If its scheme is refused for this scene, it gets the default scheme.
    """
    finest = reference_of(scene)
    try:
        _warm(finest)
    except InputError:
        finest = apply_settings(finest, {"scheme": DEFAULT})
        _warm(finest)
    return finest, coarser_than(finest)


def run_once(scene: Scene, round_: int) -> Run:
    """Integrate a scene in one round; return its words, numbers and processor time.

    The step is shorter by `round_` times `NUDGE`, and the run keeps the peaks of the
    blades, unless it is kept for the cost of its traces.

    scene : a scene whose time step and modes are numbers, see `pinned`
    """
    step = scene.solver.time_step * (1.0 - round_ * NUDGE)
    course = course_of(apply_settings(scene, {"time_step": step}))  # makes its model
    start = time.process_time()  # depends less on other load than wall time
    result = course.run()
    return run_of(result, time.process_time() - start)


@dataclass(frozen=True)
class Case:
    """A case on which settings are compared.

    Attributes
    ----------
    gap : m
    words : words of the reference's twins
    decided : whether they have a regime
    sensitive : numbers by which they differ so much that errors have no meaning; all
        where they differ in words
    scatter : {number: how far they differ}
    seconds : median processor time of the reference
    """

    gap: float
    words: list[str]
    decided: bool
    sensitive: tuple[str, ...]
    scatter: dict[str, float]
    seconds: float


@dataclass(frozen=True)
class Error:
    """Errors of a number over the cases in which it is not sensitive.

    Attributes
    ----------
    median, nine : error below which half, and nine in ten, of the cases lie
    largest : of all cases
    twins : scatter of the setting's twins, below which nine in ten of the cases lie
    """

    median: Quantile
    nine: Quantile
    largest: float
    twins: float


@dataclass(frozen=True)
class Row:
    """Cost and accuracy of one computation over all cases.

    Attributes
    ----------
    axis, label, options : what is varied; names of the settings; what to type
    inputs : {input: value} that the options set
    cost : processor time / that of the cases as given in the same round, median
    costs : that ratio in each round
    same, changed, open : cases with the reference's words; with other words though
        both are decided; where either is not decided, or the reference's twins differ
    agree, runs : runs with the reference's words, of all
    errors : {number: its errors}
    of : {case: {number: error of its worst twin}}, of numbers not sensitive in it
    shifts : {number: how its distribution differs}, over cases where it is sensitive
    ledger : largest |ledger_error| of any run
    refused : {case: message}
    unstable : whether a run was unstable
    score : median over cases of the largest error of the numbers `SCORED`
    front : whether no other row is as good in cost, words and score, and better in one
    """

    axis: str
    label: str
    options: str
    inputs: Settings
    cost: float = math.inf
    costs: tuple[float, ...] = ()
    same: int = 0
    changed: int = 0
    open: int = 0
    agree: int = 0
    runs: int = 0
    errors: dict[str, Error] = field(default_factory=dict)
    of: dict[str, dict[str, float]] = field(default_factory=dict)
    shifts: dict[str, Shift] = field(default_factory=dict)
    ledger: float = 0.0
    refused: dict[str, str] = field(default_factory=dict)
    unstable: bool = False
    score: float = math.inf
    front: bool = False


@dataclass(frozen=True)
class Tradeoff:
    """Results of a comparison of solver settings on several cases.

    Attributes
    ----------
    rows : cost and accuracy of each computation
    cases : {name: case}
    reference : inputs of the reference
    total : number of cases from which these were drawn
    """

    rows: list[Row]
    cases: dict[str, Case]
    reference: Settings
    total: int

    def facts(self) -> dict[str, Any]:
        """Return the results as data for JSON."""
        return asdict(self)


class Measurement:
    """Cases that are integrated with every setting and with the reference.

    Parameters
    ----------
    settings : settings to compare; the first is that with which costs are compared
    repeats : rounds, at least 2
    total : number of cases from which its cases are drawn; 0: of its cases
    tell : called with a line of text before each integration
    """

    def __init__(
        self,
        settings: Sequence[Setting],
        repeats: int,
        total: int = 0,
        tell: Callable[[str], None] = lambda _: None,
    ) -> None:
        self.settings, self.repeats, self.total = settings, repeats, total
        self.tell = tell
        self._each = [Computation((setting,), {}, {}) for setting in settings]
        self._runs: Runs = {}
        self._gaps: dict[str, float] = {}

    def add(self, scenes: Mapping[str, Scene]) -> Measurement:
        """Integrate further cases, {name: scene}; return this measurement.

        Raises
        ------
        InputError
            if a case cannot be integrated as given, or with the reference's settings
        """
        scenes = {name: _with_peaks(scene) for name, scene in scenes.items()}
        more = computations(scenes, self.settings)
        for name, why in more[0].refused.items():
            raise InputError(f"{name}: {why}")
        joined = distinct(more)
        finest = {name: _references(scene) for name, scene in scenes.items()}
        for round_ in range(self.repeats):
            for key, name, scene in _todo(joined, finest, round_):
                self.tell(f"round {round_ + 1} of {self.repeats}, {name}: {key}")
                run = run_once(scene, round_)
                self._runs.setdefault((key, name), []).append(run)
        for one in joined:
            for setting in one.settings[1:]:
                for name in one.scenes:
                    self._runs[setting.key, name] = self._runs[one.key, name]
        self._each = [a.with_more(b) for a, b in zip(self._each, more, strict=True)]
        self._gaps |= {name: scene.gap for name, scene in scenes.items()}
        return self

    def found(self, names: Collection[str] = ()) -> Tradeoff:
        """Return what was measured of the named cases; none named: of all."""
        names = names or self._gaps
        cases = {name: _case(self._runs[REFERENCE, name], gap)
                 for name, gap in self._gaps.items() if name in names}  # fmt: skip
        given = self.settings[0].key
        rows = [_row(one, given, self._runs, cases)
                for one in distinct([one.of(names) for one in self._each])]  # fmt: skip
        total = max(self.total, len(cases))
        return Tradeoff(_marked(rows), cases, trials()["reference"], total)


def measure(
    scenes: Mapping[str, Scene], settings: Sequence[Setting], repeats: int
) -> Tradeoff:
    """Integrate cases with every setting and the reference; see `Measurement`."""
    return Measurement(settings, repeats).add(scenes).found()


def _with_peaks(scene: Scene) -> Scene:
    """Return a scene that keeps the peaks of its blades, whatever its traces."""
    kept = scene.output.traces in ("blades", "full")
    return scene if kept else apply_settings(scene, {"traces": "blades"})


def _todo(
    tried: Sequence[Computation], finest: Mapping[str, Sequence[Scene]], round_: int
) -> Iterator[tuple[str, str, Scene]]:
    for name, scenes in finest.items():
        yield REFERENCE, name, scenes[round_ % len(scenes)]
        for one in tried:
            if name in one.scenes:
                yield one.key, name, one.scenes[name]


def _case(reference: list[Run], gap: float) -> Case:
    scatter, words = scatter_of(reference, gap), [run.words for run in reference]
    same = len(set(words)) == 1
    return Case(
        gap,
        words,
        all(run.is_decided for run in reference),
        sensitive(scatter) if same else tuple(scatter),
        scatter,
        float(np.median([run.seconds for run in reference])),
    )


def _row(one: Computation, given: str, runs: Runs, cases: Mapping[str, Case]) -> Row:
    """Return the row of a computation; given : key of the setting of cost 1."""
    first = next((s for s in one.settings if s.options), one.settings[0])
    empty = Row(one.settings[0].axis, one.label, first.options, first.sets,
                refused=one.refused)  # fmt: skip
    if not one.scenes:
        return empty
    pairs = {n: (runs[one.key, n], runs[REFERENCE, n]) for n in one.scenes}
    flat = [run for own, _ in pairs.values() for run in own]
    late = one.settings[0].axis == "duration"
    names = ONLY_LATE if late else tuple(NUMBERS)
    of = {n: _errors(_kept(names, cases[n]), pair, cases[n].gap)
          for n, pair in pairs.items()}  # fmt: skip
    costs, counts = _costs(one, given, runs), _words(pairs)
    return replace(
        empty,
        cost=float(np.median(costs)),
        costs=costs,
        same=counts["same"],
        changed=counts["changed"],
        open=counts["open"],
        agree=counts["agree"],
        runs=counts["runs"],
        errors=_over_cases(of, pairs, cases),
        of={n: {name: e[1] for name, e in found.items()} for n, found in of.items()},
        shifts=shifts_of(_sensitive(pairs, cases)),
        ledger=max(run.numbers["ledger_error"] for run in flat),
        unstable=any(run.regime == "unstable" for run in flat),
        score=_score(of),
    )


def _costs(one: Computation, given: str, runs: Runs) -> tuple[float, ...]:
    """Return the processor time of each round / that as given, of the same cases."""
    own, other = ([[run.seconds for run in runs[key, n]] for n in one.scenes]
                  for key in (one.key, given))  # fmt: skip
    ratio = np.sum(own, axis=0) / np.sum(other, axis=0)
    return tuple(float(r) for r in ratio)


def _words(pairs: Mapping[str, tuple[list[Run], list[Run]]]) -> dict[str, int]:
    """Return how many cases and runs have the words of the reference."""
    out = dict.fromkeys(("same", "changed", "open", "agree", "runs"), 0)
    for own, reference in pairs.values():
        usual = usual_words(reference)
        out["runs"] += len(own)
        out["agree"] += sum(run.words == usual for run in own)
        sure = len({run.words for run in reference}) == 1
        decided = sure and all(run.is_decided for run in (*own, *reference))
        same = usual_words(own) == usual
        out["open" if not decided else "same" if same else "changed"] += 1
    return out


def _kept(names: Sequence[str], case: Case) -> Sequence[str]:
    """Return the numbers that have an error: those that are not sensitive.

    Of a divergent case they are those of its growth: its size is that at which the run
    ended, and multiplies any error of the rate.
    """
    grows = max(case.words, key=case.words.count).startswith("divergent")
    known = [n for n in names if n not in case.sensitive]
    return [n for n in known if n in GROWING] if grows else known


def _sensitive(
    pairs: Mapping[str, tuple[list[Run], list[Run]]], cases: Mapping[str, Case]
) -> dict[str, list[tuple[list[Run], list[Run]]]]:
    """Return {number: twins of the cases in which it is sensitive}."""
    return {
        number: [pair for n, pair in pairs.items() if number in cases[n].sensitive]
        for number in SCORED
    }


def _errors(
    names: Sequence[str], pair: tuple[list[Run], list[Run]], gap: float
) -> dict[str, tuple[float, float]]:
    found = {name: error_of(name, *pair, gap) for name in names}
    return {name: error for name, error in found.items() if error is not None}


def _over_cases(
    of: Mapping[str, Mapping[str, tuple[float, float]]],
    pairs: Mapping[str, tuple[list[Run], list[Run]]],
    cases: Mapping[str, Case],
) -> dict[str, Error]:
    """Return {number: its errors over the cases} in which it is not sensitive.

    of : {case: {number: (error of the mean, of the worst twin)}}
    """
    out = {}
    scatter = [scatter_of(own, cases[n].gap) for n, (own, _) in pairs.items()]
    for name in NUMBERS:
        errors = [found[name][0] for found in of.values() if name in found]
        twins = [found[name] for found in scatter if name in found]
        if errors:
            out[name] = Error(
                quantile_of(errors, 0.5),
                quantile_of(errors, NINE),
                max(errors),
                quantile_of(twins, NINE).value if twins else 0.0,
            )
    return out


def _score(of: Mapping[str, Mapping[str, tuple[float, float]]]) -> float:
    known = [[found[n][0] for n in SCORED if n in found] for found in of.values()]
    worst = [max(errors) for errors in known if errors]
    return float(np.median(worst)) if worst else 0.0


def _marked(rows: list[Row]) -> list[Row]:
    """Return rows, those on the Pareto front marked."""
    front = {id(row) for row in front_of(rows)}
    return [replace(row, front=id(row) in front) for row in rows]


def front_of(rows: Sequence[Row]) -> list[Row]:
    """Return the rows on the Pareto front, sorted by cost.

    Minimised are cost, number of runs with other words than the reference, and score
    (see `Row`); refused and unstable settings, and those of the duration, are left out.
    """
    whole = [
        row
        for row in rows
        if not (row.refused or row.unstable) and row.axis != "duration"
    ]
    keys = np.array([(row.cost, row.runs - row.agree, row.score) for row in whole])
    front = [
        row
        for row, key in zip(whole, keys, strict=True)
        if not ((keys <= key).all(axis=1) & (keys < key).any(axis=1)).any()
    ]
    return sorted(front, key=lambda row: row.cost)
