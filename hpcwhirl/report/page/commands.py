"""Commands on the page that integrate a case again.

Most name the campaign's file and set the inputs that it leaves open; where the file is
gone, or has changed since, the command sets all inputs that have not their default.
"""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import tomli_w

from hpcwhirl.errors import WhirlError
from hpcwhirl.scene import Scene, named_scene, preset_inputs, preset_names
from hpcwhirl.scene.documents import DESIGN_TABLES, load_document, scene_of_document
from hpcwhirl.scene.plain_data import SETS, flatten
from hpcwhirl.scene.quantities import INPUTS
from hpcwhirl.scene.units import in_si, shown_in
from hpcwhirl.store.reading.results_file import Results

PROGRAM = "hpcwhirl run"  # with the default scene
START = "table2"
TRACES = "output.traces"
KEPT = "orbit"  # traces that the figures of a case need
DIGITS = 12  # of a number in a unit other than SI
MOST = 5  # inputs set beside a file and the swept ones; with more, all are set


def commands_of(results: Results) -> dict[str, Any]:
    """Return what the page needs to tell the command that runs a single case.

    Most commands are "program", options of the swept inputs, and "tail". "commands",
    {case: command}, has those of other cases as a whole. "file" is the campaign's file
    and what is set beside it, "" if it does not give the same cases any more.
    """
    plan, swept = results.plan, frozenset(results.plan.swept)
    shared = given_inputs(
        {n: v for n, v in plan.base.items() if n not in swept}, frozenset()
    )
    tail = "".join(f" {setting(n, v)}" for n, v in shared.items())
    told = {}
    for case in range(len(results)):
        given = results.settings(case)
        own = given_inputs(given, swept)
        if own.keys() != swept | shared.keys():
            told[case] = " ".join([PROGRAM, *(setting(n, v) for n, v in own.items())])
    beside = _beside_file(results, swept)
    return {"program": PROGRAM, "tail": tail, "commands": told, "file": beside}


def _beside_file(results: Results, swept: frozenset[str]) -> str:
    """Return the start of a command that runs cases from the campaign's file.

    It is "" if the file is gone, or if more than `MOST` inputs would have to be set
    because it has changed.

    swept : names of swept inputs, which the command sets later
    """
    path = file_of(str(results.attrs.get("command", "")))
    scene = _scene_in(path) if path else None
    if path is None or scene is None:
        return ""
    start = [PROGRAM, shlex.quote(str(path))]
    wanted = dict(results.plan.base)
    if wanted.get(TRACES) in {"summary", "blades"}:
        wanted[TRACES] = KEPT
    written = flatten(scene)
    other = {n: v for n, v in wanted.items()
             if n in written and n not in swept and written[n] != v}  # fmt: skip
    for cause, effects in SETS.items():
        if wanted.get(cause):
            other = {n: v for n, v in other.items() if n not in effects}
    preset = str(results.attrs.get("preset", ""))
    by_preset = preset_inputs(preset) if preset in preset_names() else {}
    if by_preset and all(wanted.get(n) == v for n, v in by_preset.items()):
        other = {n: v for n, v in other.items() if n not in by_preset}
        start.append(f"--preset {preset}")
    if len(other) > MOST:
        return ""
    return " ".join([*start, *(setting(n, v) for n, v in other.items())])


def file_of(command: str) -> Path | None:
    """Return the campaign's file that a command line names; None if it names none.

    command : text such as "hpcwhirl campaign whirl.toml --out first"
    """
    try:
        words = shlex.split(command)
    except ValueError:
        return None
    after = words[words.index("campaign") + 1 :] if "campaign" in words else []
    found = [word for word in after if word.endswith(".toml")]
    return Path(found[0]) if found else None


def _scene_in(path: Path) -> Scene | None:
    """Return the scene in a campaign's file, None if it cannot be read any more."""
    try:
        return scene_of_document(load_document(path), DESIGN_TABLES, path.parent)
    except (WhirlError, OSError):
        return None


def setting(name: str, value: Any) -> str:
    """Return the option ``--set name=value`` of an input, quoted for a shell.

    A number is in the unit that the user chose where this gives the same number.
    """
    if text := _in_unit(name, value):
        return f"--set {shlex.quote(f'{name}={text}')}"
    parts = value if isinstance(value, list) else [value]
    texts = [tomli_w.dumps({"v": v}).partition(" = ")[2].strip() for v in parts]
    text = f"[{', '.join(texts)}]" if isinstance(value, list) else texts[0]
    return f"--set {shlex.quote(f'{name}={text}')}"


def _in_unit(name: str, value: Any) -> str:
    """Return a number with the unit shown, such as "3000 rpm"; "" if it is not exact.

    name, value : an input; its value in SI
    """
    si = INPUTS[name].unit if name in INPUTS else ""
    unit, factor = shown_in(si)
    if unit == si or type(value) not in {int, float}:
        return ""
    text = f"{float(f'{factor * value:.{DIGITS}g}'):.{DIGITS}g} {unit}"
    return text if in_si(text, si) == value else ""


@cache
def _start() -> dict[str, Any]:
    return dict(flatten(named_scene(START)))


def given_inputs(given: Mapping[str, Any], swept: frozenset[str]) -> dict[str, Any]:
    """Return the inputs that a command must set to run a case, the swept ones first.

    Inputs with their default are left out.

    Parameters
    ----------
    given : {dotted name: value} of the case; names that are no inputs are skipped
    swept : names of swept inputs, which are set even to their default
    """
    start = _start()
    names = sorted((n for n in start if n in given), key=lambda n: n not in swept)
    told = {n: given[n] for n in names if n in swept or given[n] != start[n]}
    if TRACES not in swept and told.get(TRACES) == "summary":
        del told[TRACES]  # keep traces, to look at the case
    for cause, effects in SETS.items():
        if told.get(cause):
            for name in effects:
                told.pop(name, None)
    return told
