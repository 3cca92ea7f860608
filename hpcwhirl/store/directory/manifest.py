"""`campaign.json`: what a campaign directory holds, and whether it may go on."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from pathlib import Path
from typing import Any

from hpcwhirl.errors import (
    InputError,
    MissingFileError,
    StoreError,
    shown,
)
from hpcwhirl.refinement.rule import check_change
from hpcwhirl.safe_open import read_regular
from hpcwhirl.scene import Scene, apply_settings, input_names
from hpcwhirl.scene.digests import CaseDigests, Digests
from hpcwhirl.scene.files import FILE, LATER, PHYSICS_VERSION, default_of
from hpcwhirl.scene.table import Table, is_table, listed
from hpcwhirl.store.atomic import Check, anyone, write_whole

NAME = "campaign.json"
FORMAT = 6  # since journals are records of fixed size
CONTENT = f"{FILE} (SHA-256)"  # among the inputs: a changed file is a changed input
MEASURE = "measure"  # among the inputs: {a user's own variable: [unit, meaning]}
FINGERPRINT = "measure's code"  # among the inputs: of the function that gives them
SAMPLE = "sample"  # among the inputs: {method, seed, inputs} of drawn ones
PHYSICS = "physics version"  # among the inputs: the same ones may give other numbers
BEYOND = (MEASURE, SAMPLE)  # of these, that there is none counts, too
SEALED = b'{\n "seal": "%b",\n'
SEAL = re.compile(rb'\{\n "seal": "([0-9a-f]{64})",\n')
REMEDY = (
    "put back what it was, or move it away and give the campaign's command again: "
    "finished cases are kept"
)


@dataclass(frozen=True)
class Manifest:
    """The resolved campaign.

    Attributes
    ----------
    engine : name of the engine
    base : {dotted input: value} shared by all cases but for what is swept
    swept : dotted names of the swept inputs
    digests : one for each case, in the order of `case`; of a plan that is arithmetic
        `CaseDigests`, and none of them stands in the file
    settings : the swept inputs' values of each case; of such a plan, a `Table`
    version, format : of the program and of this file
    refine : the rule by which further cases follow from words; empty for none
    extended : s, to what its undecided cases were extended, in this order
    twins : how many of which cases, by which spread of inputs; empty for none
    """

    engine: str
    base: dict[str, Any]
    swept: list[str]
    digests: Sequence[str]
    settings: Sequence[dict[str, Any]]
    version: str
    format: int = FORMAT
    extended: list[float] = field(default_factory=list)
    refine: dict[str, Any] = field(default_factory=dict)
    twins: dict[str, Any] = field(default_factory=dict)

    @cached_property
    def table(self) -> Table:
        """The settings as columns."""
        return Table.of(self.settings)

    @property
    def is_arithmetic(self) -> bool:
        """Whether cases follow from their numbers and are not listed one by one."""
        return isinstance(self.digests, CaseDigests)


def inputs_in(base: Mapping[str, Any]) -> dict[str, Any]:
    """Return {dotted input: value} of a plan's `base`, without what stands beside."""
    return {
        n: v
        for n, v in base.items()
        if n not in (CONTENT, PHYSICS, FINGERPRINT, *BEYOND)
    }


def write_manifest(folder: Path, plan: Manifest, check: Check = anyone) -> None:
    """Store the plan of a campaign directory, sealed.

    Parameters
    ----------
    folder, plan : the directory and its plan
    check : raises where the directory is no longer this process's, see `publish`
    """
    data = {field.name: getattr(plan, field.name) for field in fields(Manifest)}
    if not plan.refine:
        del data["refine"]
    cases = ""
    if isinstance(plan.digests, CaseDigests):
        del data["digests"], data["settings"]
        data["reads"] = plan.digests.reads
        cases = f',\n "cases": {json.dumps(plan.digests.table.plain())}\n}}'
    else:
        data |= {"digests": list(plan.digests), "settings": list(plan.settings)}
    text = json.dumps(data, indent=1)
    body = (text.removesuffix("\n}") + cases if cases else text).encode()
    write_whole(folder / NAME, SEALED % _sha256(body) + body[2:], check)


def _sha256(body: bytes) -> bytes:
    return hashlib.sha256(body).hexdigest().encode()


def read_manifest(folder: Path) -> Manifest:
    """Return the plan of a campaign directory, or raise one clear line.

    Its seal, the SHA-256 of all that follows it, must be there and fit.
    """
    path = folder / NAME
    try:
        text = read_regular(path)
    except OSError as failed:
        msg = f"{folder} is no campaign directory: {path.name}: {failed.strerror}"
        raise MissingFileError(msg) from None
    head = SEAL.match(text)
    if head and _sha256(b"{\n" + text[head.end() :]) != head[1]:
        msg = f"{path} is damaged or was edited: its seal does not fit; {REMEDY}"
        raise StoreError(msg)
    plan = _parsed(path, text)
    if not head:
        msg = f"{path} is damaged or was edited: it has no seal; {REMEDY}"
        raise StoreError(msg)
    return plan


def _parsed(path: Path, text: bytes) -> Manifest:
    try:
        data = json.loads(text)
    except (ValueError, RecursionError):
        msg = f"{path} is damaged: not valid JSON"
        raise StoreError(msg) from None
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        found = data.get("format") if isinstance(data, dict) else None
        msg = f"{path} has format {found!r:.40}, this program reads {FORMAT}"
        raise StoreError(msg)
    if SEAL.match(text):
        del data["seal"]
    for name, none in (("extended", []), ("twins", {}), ("refine", {})):
        data.setdefault(name, none)  # plans of before have none of them
    if not _unpacked(data) or not _has_types(data):
        msg = f"{path} is damaged: its keys are not those of a campaign"
        raise StoreError(msg)
    return Manifest(**data)


def _unpacked(data: dict[str, Any]) -> bool:
    """Turn `cases` into digests and settings, in place; return whether keys fit."""
    if "cases" in data:
        plain, reads = data.pop("cases"), data.pop("reads", None)
        base = data.get("base")
        if not (is_table(plain) and isinstance(reads, dict) and isinstance(base, dict)):
            return False
        table = Table.from_plain(plain)
        data["settings"] = table
        version = base.get(PHYSICS, PHYSICS_VERSION)
        data["digests"] = CaseDigests(inputs_in(base), table, reads, version)
    return data.keys() == Manifest.__dataclass_fields__.keys()


def _has_types(data: dict[str, Any]) -> bool:
    """Return whether the values of a plan are of the types that `Manifest` tells."""
    kinds = {"engine": str, "base": dict, "swept": list, "version": str}
    kinds |= {"extended": list, "twins": dict, "refine": dict}
    return (
        all(isinstance(data[name], kind) for name, kind in kinds.items())
        and all(isinstance(name, str) for name in data["swept"])
        and all(isinstance(time, float) for time in data["extended"])
        and _are_cases(data["digests"], data["settings"])
    )


def _are_cases(digests: Any, settings: Any) -> bool:
    """Return whether these are digests and settings of as many cases."""
    if isinstance(digests, CaseDigests):
        return digests.shared.keys() >= set(digests.table.names) | {FILE}
    return (
        isinstance(digests, list)
        and isinstance(settings, list)
        and len(digests) == len(settings)
        and all(isinstance(name, str) for name in digests)
        and all(isinstance(row, dict) for row in settings)
    )


def digests_of(plan: Manifest) -> Digests:
    """Return the digests of cases by what they set beside what all of a plan share."""
    known = input_names()
    given = {name: value for name, value in plan.base.items() if name in known}
    base = apply_settings(Scene(), given)
    return Digests(base, {base.engine.file: plan.base.get(CONTENT, "")})


def check_same(old: Manifest, new: Manifest, folder: Path) -> None:
    """Raise InputError, naming the change, if plan `new` may not continue plan `old`.

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
    own_kinds = [name for name in BEYOND if name in old.base]
    for name in dict.fromkeys([*new.base, *own_kinds]):
        if name == FINGERPRINT:  # who calls knows whether another function may go on
            continue
        before = default_of(name) if name in LATER else None
        was, now = old.base.get(name, before), _values(new, name, old.swept)
        if now and was not in now:
            msg = f"{folder} was begun with {name} = {shown(was)}, "
            got = " or ".join(map(shown, now[:3])) + (" ..." if len(now) > 3 else "")
            raise InputError(msg + f"got {got}: {own}")
    check_change(old.refine, new.refine, f"{folder}")
    _check_twins(old.twins, new.twins, f"{folder} was begun with", own)
    file = _changed_file(old, new)
    if file:
        msg = f"{folder} was begun with another content of {file}: {own}"
        raise InputError(msg)


def _check_twins(
    old: Mapping[str, Any], new: Mapping[str, Any], begun: str, own: str
) -> None:
    """Raise InputError where twins of before are perturbed otherwise than new ones."""
    for name, default in (("spread", {}), ("seed", 0)):
        was, now = (twins.get(name, default) for twins in (old, new))
        if old and new and was != now:
            msg = f"{begun} [twins] {name} = {shown(was)}, got {shown(now)}: {own}"
            raise InputError(msg)


def _changed_file(old: Manifest, new: Manifest) -> str:
    """Return an engine's file that is swept and whose content has changed; "": none."""
    if FILE not in new.swept:
        return ""
    if isinstance(old.digests, CaseDigests) and isinstance(new.digests, CaseDigests):
        was, now = old.digests.reads, new.digests.reads
        return next((f for f in was if now.get(f, was[f]) != was[f]), "")
    known = {_key(s): d for s, d in zip(old.settings, old.digests, strict=True)}
    for settings, digest in zip(new.settings, new.digests, strict=True):
        file = settings.get(FILE)
        if file and known.get(_key(settings), digest) != digest:
            return str(file)
    return ""


def _values(plan: Manifest, name: str, swept: list[str]) -> list[Any]:
    """Return the values an input has in a plan; none where `swept` lets it differ."""
    if name in swept:
        return []
    if name not in plan.swept:
        return [plan.base.get(name)]
    values = listed(plan.table.column(name, plan.base[name]).values)
    return list({json.dumps(value): value for value in values}.values())


def _key(settings: dict[str, Any]) -> str:
    return json.dumps(settings, sort_keys=True)
