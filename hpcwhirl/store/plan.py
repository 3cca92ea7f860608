"""`campaign.json`: what a campaign directory holds, and whether it may go on."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from hpcwhirl.errors import InputError, MissingFileError, StoreError
from hpcwhirl.regular import read_regular
from hpcwhirl.store.schema import FORMAT
from hpcwhirl.store.whole import write_whole

NAME = "campaign.json"
PHYSICS = "physics version"  # among the inputs: the same ones may give other numbers


@dataclass(frozen=True)
class Plan:
    """The resolved campaign.

    Attributes
    ----------
    engine : name of the engine
    base : {dotted input: value} shared by all cases but for what is swept
    swept : dotted names of the swept inputs
    digests : one for each case, in the order of `case`
    settings : the swept inputs' values of each case
    version, format : of the program and of this file
    """

    engine: str
    base: dict[str, Any]
    swept: list[str]
    digests: list[str]
    settings: list[dict[str, Any]]
    version: str
    format: int = FORMAT


def write_plan(folder: Path, plan: Plan) -> None:
    """Store the plan of a campaign directory."""
    write_whole(folder / NAME, json.dumps(asdict(plan), indent=1).encode())


def read_plan(folder: Path) -> Plan:
    """Return the plan of a campaign directory, or raise one clear line."""
    path = folder / NAME
    try:
        data = json.loads(read_regular(path))
    except OSError as failed:
        msg = f"{folder} is no campaign directory: {path.name}: {failed.strerror}"
        raise MissingFileError(msg) from None
    except ValueError:
        msg = f"{path} is damaged: not valid JSON"
        raise StoreError(msg) from None
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        found = data.get("format") if isinstance(data, dict) else None
        msg = f"{path} has format {found!r}, this program reads {FORMAT}"
        raise StoreError(msg)
    try:
        return Plan(**data)
    except TypeError:
        msg = f"{path} is damaged: its keys are not those of a campaign"
        raise StoreError(msg) from None


def check_same(old: Plan, new: Plan, folder: Path) -> None:
    """Raise InputError, naming what changed, where `new` may not continue `old`.

    A campaign may get more cases: longer lists, and further inputs to sweep as long as
    the value that they had is among those that they get.
    """
    own = "use another --out, the inputs it was begun with, or --fresh to start over"
    if old.version != new.version:
        msg = f"{folder} was begun by hpcwhirl {old.version}, this is {new.version}: "
        raise InputError(msg + own)
    if not set(old.swept) <= set(new.swept):
        msg = f"{folder} sweeps {', '.join(old.swept)}; this sweeps "
        raise InputError(msg + f"{', '.join(new.swept) or 'nothing'}: {own}")
    for name in new.base:
        was, now = old.base.get(name), _values(new, name, old.swept)
        begun_before = name == PHYSICS and was is None
        if now and was not in now and not begun_before:
            msg = f"{folder} was begun with {name} = {was!r}, "
            got = " or ".join(map(repr, now[:3])) + (" ..." if len(now) > 3 else "")
            raise InputError(msg + f"got {got}: {own}")
    known = {_key(s): d for s, d in zip(old.settings, old.digests, strict=True)}
    for settings, digest in zip(new.settings, new.digests, strict=True):
        file = settings.get("engine.file")
        if file and known.get(_key(settings), digest) != digest:
            msg = f"{folder} was begun with another content of {file}: {own}"
            raise InputError(msg)


def _values(plan: Plan, name: str, swept: list[str]) -> list[Any]:
    """Return the values an input has in a plan; none where `swept` lets it differ."""
    if name in swept:
        return []
    if name not in plan.swept:
        return [plan.base[name]]
    values = (settings.get(name, plan.base[name]) for settings in plan.settings)
    return list({json.dumps(value): value for value in values}.values())


def _key(settings: dict[str, Any]) -> str:
    return json.dumps(settings, sort_keys=True)
