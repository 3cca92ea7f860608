"""The tables [campaign], [sample], [refine], [twins] and [branch] of a campaign's file.

Each table is a class whose fields are its keys; its objects are frozen and validated.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import (
    AfterValidator,
    BeforeValidator,
    ValidationInfo,
    field_validator,
    model_validator,
)
from pydantic_core import PydanticCustomError

from hpcwhirl.errors import InputError, as_table, shown
from hpcwhirl.scene.input_names import (
    IN_UNITS,
    MISTUNING,
    by_full_name,
    full_name,
    is_number,
    is_whole,
    takes_list,
    undotted,
    value_in_si,
)
from hpcwhirl.scene.laws import KEY, Law, law_of, parameters
from hpcwhirl.scene.named import preset_names
from hpcwhirl.scene.quantities import WHOLE
from hpcwhirl.scene.swept import MOST_CASES
from hpcwhirl.scene.table_model import UNKNOWN_WORD, TableModel, key
from hpcwhirl.scene.units import in_si, told_of

RETRIES = ("failed", "timeout", "crashed")  # statuses that retry may name
MOST_ON_PAGE = 2000  # largest number of cases for which report = "auto" writes the page


def _seconds(default: float | None, meaning: str) -> Any:
    return key(default, meaning, "a number of seconds > 0", gt=0)


def _flag(meaning: str) -> Any:
    return key(default=False, meaning=meaning)


def walltime_seconds(text: str) -> float:
    """Parse ``HH:MM:SS`` as seconds; hours have no upper limit.

    Raises
    ------
    ValueError
        for another format, or zero
    """
    parts = text.split(":")
    plain = all(part.isascii() and part.isdigit() and len(part) < 10 for part in parts)
    if not plain or len(parts) != 3 or any(int(part) > 59 for part in parts[1:]):
        raise ValueError(f"must be HH:MM:SS, e.g. 01:50:00, got {shown(text)}")
    hours, minutes, seconds = map(int, parts)
    total = 3600.0 * hours + 60.0 * minutes + seconds
    if total == 0.0:
        raise ValueError(f"must be > 00:00:00, got {shown(text)}")
    return total


def _walltime(text: str) -> str:
    walltime_seconds(text)
    return text


def _path(text: str) -> str:
    if not text.strip() or not text.isprintable():
        raise ValueError(f"must be the path of a directory, got {shown(text)}")
    return text


def _statuses(given: Any) -> Any:
    """Return the statuses of cases in the key `retry`, such as "failed,timeout".

    given : text, or list of texts, of statuses separated by commas
    """
    texts = [given] if isinstance(given, str) else given
    if not isinstance(texts, list) or not all(isinstance(one, str) for one in texts):
        return given  # a set is valid; other types are refused by pydantic
    words = [word.strip() for text in texts for word in text.split(",")]
    for word in words:
        if word not in RETRIES:
            context = {"word": word, "known": RETRIES}
            raise PydanticCustomError(UNKNOWN_WORD, "{word}", context)
    return frozenset(words)


class Campaign(TableModel):
    """The table [campaign]: where a campaign is stored, its limits, and its outputs.

    No case's motion depends on it.
    """

    # fmt: off
    out: Annotated[str, AfterValidator(_path)] | None = key(None,
        "directory of the campaign (default: the file's name without .toml, in the "
        "working directory); a campaign that it already holds is continued",
        "the path of a directory")
    retry: Annotated[frozenset[str], BeforeValidator(_statuses)] = key(frozenset(),
        "compute again the cases with this status, or with several statuses, separated "
        "by commas, and the cases whose traces are damaged",
        f"{' | '.join(RETRIES)}, or a list of them")
    walltime: Annotated[str, AfterValidator(_walltime)] | None = key(None,
        "stop shortly before the command has run for this time; the same command "
        "continues the campaign",
        'a text such as "01:50:00"')
    patience: float = _seconds(30.0,
        "time that ranks have to stop after a request to stop; then the job ends with "
        "exit code 75 even if some ranks hang; finished cases are kept")
    case_limit: float | None = _seconds(None,
        "computing time of a case, summed over all runs, after which the case is "
        "stopped with status timeout")
    max_fails: int | None = key(None,
        "end with exit code 1 as soon as this many cases of a run gave no result",
        gt=0)
    save_every: float = _seconds(600.0,
        "computing time of a case between saved states, from which it can continue")
    keep_states: bool = _flag(
        "keep the last states of undecided cases, from which --extend continues")
    isolate: bool = _flag(
        "compute each case in a process of its own; if that crashes, the case gets "
        "status crashed, and the campaign goes on")
    same: Literal["told", "strict"] = key("told",
        "whether ranks whose processor or libraries differ from those that began the "
        "campaign compute, which is told (their numbers may differ), or are refused")
    map: Literal["yes", "no"] = key("yes",
        "draw map.png and map.svg; if no, hpcwhirl map can draw them later")
    report: Literal["auto", "yes", "no"] = key("auto",
        f"write report.html; auto: if there are at most {MOST_ON_PAGE} cases")
    # fmt: on

    def with_options(self, other: Campaign) -> Campaign:
        """Return the table of a file with the keys replaced that options give.

        other : table with the keys that are given as options of the command
        """
        return self.model_copy(
            update={name: getattr(other, name) for name in other.model_fields_set}
        )

    def place(self, file: Path | None) -> str:
        """Return the directory of the campaign that a file describes.

        file : the campaign's file; None: there is none
        """
        stem = file.stem if file is not None and file.suffix else ""
        return self.out or stem or "campaign"

    def pictures(self, cases: int) -> set[str]:
        """Return which of "map" and "page" (report.html) are made for `cases` cases."""
        report = {"auto": cases <= MOST_ON_PAGE, "yes": True, "no": False}[self.report]
        wanted = {"map": self.map == "yes", "page": report}
        return {name for name, asked in wanted.items() if asked}


MOST_SEED = 2**53  # largest whole number that every JSON reader keeps
LEAST_SPREAD = 1e-12  # least relative change at which twins surely differ in double


def _spread(given: Any) -> dict[str, float]:
    """Return {full dotted input: largest relative change} of `spread` in [twins]."""
    if not isinstance(given, Mapping) or not given:
        msg = f"must be a table such as {{force = 1e-6}}, got {shown(given)}"
        raise ValueError(msg)
    pairs = ((n, (n, spread)) for n, spread in undotted(given, lambda _: False))
    found = {}
    for full, (name, spread) in by_full_name(pairs, "[twins] spread").items():
        allowed = f"a number >= {LEAST_SPREAD:g} and < 1"
        if full in IN_UNITS:
            if is_number(spread) and LEAST_SPREAD <= spread < 1.0:
                found[full] = float(spread)
                continue
        else:
            allowed = "of an input that is a real number"
        raise ValueError(f"{name} must be {allowed}, got {shown(spread)}")
    return dict(sorted(found.items()))


class TwinsTable(TableModel):
    """The table [twins]: copies of cases with slightly changed inputs.

    The share of a case's twins that get its word, such as "damped", shows how certain
    the word is. `spread` is {full dotted input: largest relative change}.
    """

    # fmt: off
    count: int = key(16, "number of perturbed twins of a case", ge=2, le=1000)
    of: Literal["all", "boundary", "speckle", "even"] = key("all",
        "which cases have twins; boundary: cases with a neighbour of another regime; "
        "speckle: cases in speckle of [refine]; even: a sample of cases whose "
        "neighbours have the same regime")
    spread: Annotated[dict[str, float], BeforeValidator(_spread)] = key({"force": 1e-6},
        "largest relative change of each perturbed input",
        "a table such as {force = 1e-6}")
    sure: float = key(0.9,
        "least share of twins with the word of their case, for that word to count as "
        "sure",
        "a number > 0, at most 1", gt=0, le=1)
    seed: int = key(0,
        "seed of the perturbations and of the sample", ge=0, le=MOST_SEED)
    sample: int = key(200, "with of = even: number of cases drawn to have twins", ge=1)
    # fmt: on

    @model_validator(mode="after")
    def _samples_even_ones(self) -> Self:
        if self.of != "even" and "sample" in self.model_fields_set:
            msg = f'sample must be given only with of = "even", got {self.sample}'
            raise ValueError(msg)
        return self

    def as_plan(self) -> dict[str, Any]:
        """Return the table as plain data for the file of a campaign's plan."""
        return self.model_dump(exclude=set() if self.of == "even" else {"sample"})


SALTELLI, LATIN = "saltelli", "latin_hypercube"
IN_TWOS = ("sobol", SALTELLI)  # methods that are balanced if count is a power of 2


def _is_law(table: Mapping[str, Any]) -> bool:
    return KEY in table or not all(isinstance(v, Mapping) for v in table.values())


def _laws(given: Mapping[str, Any]) -> dict[str, Law]:
    """Return {full dotted input: its validated distribution} of [sample]."""
    found = {}
    pairs = ((name, (name, law)) for name, law in undotted(given, _is_law))
    for full, (name, law) in by_full_name(pairs, "[sample]").items():
        if full not in IN_UNITS and not takes_list(full):
            msg = f"[sample] {name} must be an input of real numbers: use [sweep]"
            raise InputError(msg)
        found[full] = law_of(name, law)
    if not found:
        msg = "must have an input and its distribution, such as "
        msg += f'gap = {{ {KEY} = "uniform", low = 1e-4, high = 2e-4 }}'
        raise InputError("[sample] " + msg)
    return found


class SampleTable(TableModel):
    """The table [sample]: inputs drawn at random, and how.

    `laws` is {full dotted input: its distribution} in the order of the file. In the
    file, such an input is itself a key of the table, as are `method`, `seed`, ...
    """

    # fmt: off
    method: Literal["random", "sobol", "halton", "latin_hypercube", "saltelli"] = key(
        "sobol",
        "method of drawing; hpcwhirl sensitivity needs saltelli")
    seed: int = key(0,
        "seed of the draws; the same seed gives the same draws", ge=0, le=MOST_SEED)
    count: int = key(...,
        "number of draws at each point of the sweep, with saltelli of pairs of draws; "
        "a power of 2 with sobol and saltelli", ge=1, le=MOST_CASES)
    laws: Annotated[dict[str, Any], BeforeValidator(_laws)] = key(...,
        parameters(),
        f"{{{KEY}, and its parameters}}")
    tuned: bool = _flag(
        "also compute the tuned engine, with equal blades, at each point of the sweep, "
        "before its draws")
    # fmt: on

    @classmethod
    def of(cls, given: Any) -> Self:
        """Return the validated table [sample] of parsed TOML.

        Errors are those of `TableModel.read`.
        """
        table = as_table("[sample]", given)
        keys = {n: v for n, v in table.items() if n in cls.model_fields and n != "laws"}
        laws = {n: v for n, v in table.items() if n not in keys}
        return cls.read(keys | {"laws": laws}, "[sample]")

    @model_validator(mode="after")
    def _balanced(self) -> Self:
        if self.method in IN_TWOS and self.count & (self.count - 1):
            below = 1 << (self.count.bit_length() - 1)
            msg = f"count must be a power of 2 with method {self.method}, such as "
            raise ValueError(msg + f"{below} or {2 * below}, got {self.count}")
        if self.method == SALTELLI and len(self.laws) < 2:
            msg = f"method {SALTELLI} needs at least two drawn inputs, got "
            raise ValueError(msg + ", ".join(self.laws))
        others = [n for n in self.laws if n != MISTUNING]
        if self.tuned and (others or self.method == SALTELLI):
            msg = "tuned must be set only with draws of mistuning, not with "
            raise ValueError(msg + ", ".join(others or [f"method {self.method}"]))
        return self


MOST_LEVELS = 16
MOST_OVER = 3


def _over(given: Any) -> tuple[str, ...]:
    names = [given] if isinstance(given, str) else given
    is_list = isinstance(names, list) and 0 < len(names) <= MOST_OVER
    if not is_list or not all(isinstance(name, str) for name in names):
        msg = f"must be one to {MOST_OVER} numeric inputs of [sweep], got "
        raise ValueError(msg + shown(given))
    over = tuple(full_name(name) for name in names)
    if len(set(over)) < len(over):
        raise ValueError(f"names an input twice: {', '.join(over)}")
    return over


def _preset(given: Any) -> Any:
    names = preset_names()
    if given not in names:
        raise ValueError(f"must be one of {', '.join(names)}, got {shown(given)}")
    return given


def _budget(given: Any) -> Any:
    kinds = ("cases", "core_hours")
    if not isinstance(given, Mapping) or len(given) != 1 or not {*given} <= {*kinds}:
        msg = "must be {cases = N} or {core_hours = H}, got "
        raise ValueError(msg + shown(given))
    ((kind, amount),) = given.items()
    if not is_number(amount) or not 0 < amount < math.inf:
        msg = f"[refine] budget: {kind} must be a number > 0, got {shown(amount)}"
        raise InputError(msg)
    return {kind: float(amount)}


def _scale(name: str, given: Any, _: Mapping[str, Any]) -> Any:
    if given not in SCALES:
        raise ValueError(f"must be one of {', '.join(SCALES)}, got {shown(given)}")
    if given == "log" and name in WHOLE:
        msg = f"[refine] scale of {name}: an input of whole numbers is linear"
        raise InputError(msg)
    return given


def _level(_: str, given: Any, __: Mapping[str, Any]) -> int:
    if not is_whole(given) or not 0 <= given <= MOST_LEVELS:
        msg = f"must be a whole number from 0 to {MOST_LEVELS}, got {shown(given)}"
        raise ValueError(msg)
    return given


def _resolution(name: str, given: Any, scales: Mapping[str, Any]) -> float:
    """Return the finest grid step of a refined input, in SI; on a log scale, relative.

    name, given : full dotted name of the input; its step as written in the file
    scales : {full dotted input: "log" or "linear"}
    """
    if scales.get(name) == "log":
        given = told_of(f"[refine] resolution of {name}", lambda: in_si(given, "1"))
    else:
        given = value_in_si(name, given)
    if not is_number(given) or not 0 < given < math.inf:
        raise ValueError(f"must be a number > 0, got {shown(given)}")
    return given


SCALES = ("linear", "log")
_EACH = {"scale": _scale, "levels": _level, "resolution": _resolution}
Preset = Annotated[str, BeforeValidator(_preset)]


class Refine(TableModel):
    """The table [refine]: where words of neighbouring cases differ, cases are added.

    `scale`, `levels` and `resolution` are {full dotted input: value} for the inputs in
    `over`; one value in the file stands for all inputs.
    """

    # fmt: off
    over: Annotated[tuple[str, ...], BeforeValidator(_over)] = key(...,
        "inputs whose grid is refined; each combination of the other swept inputs is a "
        "panel, refined separately",
        f"one to {MOST_OVER} numeric inputs of [sweep]")
    scale: dict[str, Any] = key({},
        "scale on which cells are halved",
        "linear | log, or {input = scale}; default linear")
    levels: dict[str, Any] = key({},
        "largest number of times that a cell of the coarse grid is halved",
        f"0 to {MOST_LEVELS}, or {{input = levels}}")
    resolution: dict[str, Any] = key({},
        "finest step of the refined grid; relative on a log scale, 0.05 is 5 percent",
        "a number > 0, or {input = number}; instead of levels")
    words: Literal["regime", "whirl", "both", "attractor", "branch"] = key("regime",
        "what must differ between the corners of a cell for it to be split; attractor: "
        "regime, or orbit, whirl and energy or growth; branch: the regime along "
        "[branch], undecided cases as sustained ones")
    speckle: int = key(2,
        "number of levels after which a cell is speckle if most of its parts are still "
        "mixed; speckle is not split further",
        "a whole number of levels, 0 for never", ge=0, le=MOST_LEVELS)
    budget: Annotated[dict[str, float], BeforeValidator(_budget)] | None = key(None,
        "limit of cases or of computing time; coarse cells are split first",
        "{cases = N} or {core_hours = H}")
    first: Preset | None = key(None,
        "preset of all cases except those that confirm boundaries of words",
        "a preset")
    confirm: Preset | None = key(None,
        "preset with which cases at boundaries of words are computed again; with "
        "solver.estimate and words = regime only in cells at a corner of which the "
        "regime differs with twice the time step, and around words that have changed",
        "a preset")
    # fmt: on

    @field_validator("scale", "levels", "resolution", mode="before")
    @classmethod
    def _of_each(cls, given: Any, info: ValidationInfo) -> dict[str, Any]:
        """Return {full dotted input: checked value} of scale, levels or resolution.

        given : {input: value}, or one value for all inputs in `over`
        """
        over: Sequence[str] = info.data.get("over", ())
        what = info.field_name or ""
        values = given if isinstance(given, Mapping) else dict.fromkeys(over, given)
        found = {}
        for short, value in values.items():
            name = full_name(short)
            if over and name not in over:
                raise ValueError(f"{name}: not an input of over = {', '.join(over)}")
            try:
                found[name] = _EACH[what](name, value, info.data.get("scale", {}))
            except InputError:
                raise
            except ValueError as failed:
                raise ValueError(f"of {name} {failed}") from None
        return found

    @model_validator(mode="after")
    def _has_an_end(self) -> Self:
        for name in self.over:
            if (name in self.levels) == (name in self.resolution):
                raise ValueError(f"needs either levels or resolution of {name}")
        return self


def _input(given: Any) -> Any:
    return full_name(given) if isinstance(given, str) else given


def _numbers(given: Any) -> Any:
    listed = isinstance(given, list) and all(map(is_number, given))
    return tuple(map(float, given)) if listed else given


MOST_POINTS = 1000  # most cases of a branch: each stores the values of all before it


class BranchTable(TableModel):
    """The table [branch]: sweeps in which a case begins where the one before ended.

    Its initial state is the last state of the case at the preceding value.
    """

    # fmt: off
    over: Annotated[str, BeforeValidator(_input)] = key(...,
        "input that is swept along a branch; each combination of the other swept "
        "inputs has branches of its own",
        "a numeric input of [sweep]")
    directions: Literal["both", "up", "down"] = key("both",
        "direction of the sweep; both: one branch with rising values, one with falling")
    starts: Annotated[tuple[float, ...], BeforeValidator(_numbers)] = key((),
        "values at which branches begin with a pulse; default: the ends of the sweep",
        "a list of values of the sweep")
    # fmt: on


TABLES: dict[str, type[TableModel]] = {
    "sample": SampleTable,
    "refine": Refine,
    "twins": TwinsTable,
    "branch": BranchTable,
    "campaign": Campaign,
}
