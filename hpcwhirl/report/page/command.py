"""The command that integrates one case of a campaign again, from the same inputs."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from functools import cache
from typing import Any

import tomli_w

from hpcwhirl.scene import named_scene
from hpcwhirl.scene.plain_data import SETS, flatten

PROGRAM = "hpcwhirl run"  # with the default scene
START = "table2"
TRACES = "output.traces"


@cache
def _start() -> dict[str, Any]:
    return dict(flatten(named_scene(START)))


def setting(name: str, value: Any) -> str:
    """Return ``--set name=value``, quoted for a shell."""
    parts = value if isinstance(value, list) else [value]
    texts = [tomli_w.dumps({"v": v}).partition(" = ")[2].strip() for v in parts]
    text = f"[{', '.join(texts)}]" if isinstance(value, list) else texts[0]
    return f"--set {shlex.quote(f'{name}={text}')}"


def given_inputs(given: Mapping[str, Any], swept: frozenset[str]) -> dict[str, Any]:
    """Return the inputs of a case that must be set, the swept ones first.

    Parameters
    ----------
    given : {dotted name: value}; other names than inputs are skipped
    swept : names of inputs that are set even to their default
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


def command_of(given: Mapping[str, Any], swept: frozenset[str]) -> str:
    """Return the command that integrates a case; arguments as of `given_inputs`."""
    told = given_inputs(given, swept)
    return " ".join([PROGRAM, *(setting(n, v) for n, v in told.items())])
