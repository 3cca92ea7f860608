"""The plan of a campaign, file `campaign.json`, and which new plan may continue it."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from pathlib import Path
from typing import Any

from hpcwhirl.errors import InputError, MissingFileError, StoreError, shown, unreadable
from hpcwhirl.refinement.rule import check_change
from hpcwhirl.safe_open import read_regular
from hpcwhirl.scene import Scene, apply_settings, input_names
from hpcwhirl.scene.case_digest import PHYSICS_VERSION
from hpcwhirl.scene.digests import CaseDigests, Digests
from hpcwhirl.scene.input_names import FILE, LATER, default_of
from hpcwhirl.scene.table import Table, is_table, listed
from hpcwhirl.store.atomic import Check, anyone, write_whole

NAME = "campaign.json"
FORMAT = 6  # 6: journals are records of fixed size
CONTENT = f"{FILE} (SHA-256)"  # an entry of `base`: digest of the engine's file
MEASURE = "measure"  # an entry of `base`: {a user's own variable: [unit, meaning]}
FINGERPRINT = "measure's code"  # an entry of `base`: fingerprint of the function
SAMPLE = "sample"  # an entry of `base`: {method, seed, inputs} of drawn inputs
PHYSICS = "physics version"  # an entry of `base`: version of the equations
BEYOND = (MEASURE, SAMPLE)  # entries that a campaign must keep when it is continued
# keys that older plans lack, and what they then are
LATER_KEYS: dict[str, Any] = {
    "extended": [], "twins": {}, "refine": {}, "machines": [], "units": []
}  # fmt: skip
SEALED = b'{\n "seal": "%b",\n'
SEAL = re.compile(rb'\{\n "seal": "([0-9a-f]{64})",\n')
REMEDY = (
    "restore it, or move it away and give the campaign's command again: "
    "finished cases are kept"
)


@dataclass(frozen=True)
class Manifest:
    """The plan of a campaign: its cases with all inputs, as `campaign.json` stores it.

    Attributes
    ----------
    engine : name of the engine
    base : {dotted input: value} of all inputs; cases override the swept ones
    swept : dotted names of the swept inputs
    digests : digest of each case; the file holds only what `CaseDigests` needs
    settings : {swept input: value} of each case; the file holds them as a `Table`
    version, format : version of the program; format number of the file
    refine : the rule by which further cases follow from words; {} without [refine]
    extended : end times to which undecided cases were extended, s, ascending
    twins : table [twins]; empty: no twins
    machines : what decides the last digits of results, {fact: text}, of the process
        that began the campaign, then of ranks of other kinds, see `campaign.machine`
    units : those of the campaign's file, in which its numbers are shown
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
    machines: list[dict[str, str]] = field(default_factory=list, compare=False)
    units: list[str] = field(default_factory=list, compare=False)

    @cached_property
    def table(self) -> Table:
        """The values of the inputs that cases set, one array for each input."""
        return Table.of(self.settings)

    def values(self, name: str, default: Any = None) -> list[Any]:
        """Return the values of an input: that of all cases, then those that cases set.

        Parameters
        ----------
        name : dotted name of the input
        default : value where the plan has none
        """
        base = self.base.get(name, default)
        return [base, *listed(self.table.column(name, base).values)]


def inputs_in(base: Mapping[str, Any]) -> dict[str, Any]:
    """Return {dotted input: value} from the entry `base` of a plan.

    Entries of `base` that are no inputs, such as digests, are left out.
    """
    return {
        n: v
        for n, v in base.items()
        if n not in (CONTENT, PHYSICS, FINGERPRINT, *BEYOND)
    }


class PlanFile:
    """The file of a campaign's plan, `campaign.json`, which it reads and writes.

    folder : the campaign's directory
    """

    def __init__(self, folder: Path) -> None:
        self.folder, self.path = folder, folder / NAME

    def write(self, plan: Manifest, check: Check = anyone) -> None:
        """Replace the file by that of a new plan, with its SHA-256 in the first line.

        Parameters
        ----------
        plan : the plan
        check : called before the file is replaced; raises if another process has taken
            over the directory
        """
        if not isinstance(plan.digests, CaseDigests):  # a refined plan with all cases
            raise TypeError
        data = {field.name: getattr(plan, field.name) for field in fields(Manifest)}
        if not plan.refine:
            del data["refine"]
        del data["digests"], data["settings"]
        data["reads"] = plan.digests.reads
        text = json.dumps(data, indent=1).removesuffix("\n}")
        cases = json.dumps(plan.digests.table.plain())
        body = f'{text},\n "cases": {cases}\n}}'.encode()
        write_whole(self.path, SEALED % _sha256(body) + body[2:], check)

    def read(self) -> Manifest:
        """Return the plan that the file holds, after checking the file's SHA-256.

        Raises
        ------
        MissingFileError, StoreError
            if the plan is missing or damaged: its checksum, the SHA-256 of the rest of
            the file, must be present and correct
        """
        try:
            text = read_regular(self.path)
        except PermissionError as failed:
            raise unreadable(self.path, failed) from None
        except OSError as failed:
            msg = f"{self.folder} is no campaign directory: {NAME}: {failed.strerror}"
            raise MissingFileError(msg) from None
        head, edited = SEAL.match(text), f"{self.path} is damaged or was edited"
        if head and _sha256(b"{\n" + text[head.end() :]) != head[1]:
            raise StoreError(f"{edited}: its seal (SHA-256) is wrong; {REMEDY}")
        plan = _parsed(self.path, text)
        if not head:
            raise StoreError(f"{edited}: it has no seal (SHA-256); {REMEDY}")
        return plan

    def check_same(self, old: Manifest, new: Manifest) -> None:
        """Raise InputError, naming the change, if a plan may not continue the old one.

        A campaign may get more cases: swept lists may grow, and further inputs may be
        swept if their former value is among the swept values.

        old, new : plan in the file, and plan of this call
        """
        own = "use another --out, the same inputs as before, or --fresh to start over"
        begun = f"{self.folder} was begun"
        if old.version != new.version:
            msg = f"{begun} by hpcwhirl {old.version}, this is {new.version}: {own}"
            raise InputError(msg)
        if not set(old.swept) <= set(new.swept):
            were = ", ".join(old.swept)
            msg = f"{begun} with a sweep over {were}; this campaign's is over "
            raise InputError(msg + f"{', '.join(new.swept) or 'nothing'}: {own}")
        own_kinds = [name for name in BEYOND if name in old.base]
        for name in dict.fromkeys([*new.base, *own_kinds]):
            if name == FINGERPRINT:  # checked by the caller
                continue
            before = default_of(name) if name in LATER else None
            was, now = old.base.get(name, before), _values(new, name, old.swept)
            if now and was not in now:
                got = " or ".join(map(shown, now[:3])) + " ..." * (len(now) > 3)
                msg = f"{begun} with {name} = {shown(was)}, got {got}: {own}"
                raise InputError(msg)
        check_change(old.refine, new.refine, f"{self.folder}")
        _check_twins(old.twins, new.twins, f"{begun} with", own)
        file = _changed_file(old, new)
        if file:
            raise InputError(f"{begun} with other content of {file}: {own}")


def _sha256(body: bytes) -> bytes:
    return hashlib.sha256(body).hexdigest().encode()


def _parsed(path: Path, text: bytes) -> Manifest:
    try:
        data = json.loads(text)
    except (ValueError, RecursionError):
        raise StoreError(f"{path} is damaged: not valid JSON") from None
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        found = data.get("format") if isinstance(data, dict) else None
        msg = f"{path} has format {found!r:.40}, this program reads {FORMAT}: continue "
        msg += "it with the version that began it, or use another --out"
        raise StoreError(msg)
    if SEAL.match(text):
        del data["seal"]
    for name, none in LATER_KEYS.items():
        data.setdefault(name, type(none)())
    if not _unpacked(data) or not _has_types(data):
        raise StoreError(f"{path} is damaged: its keys are not those of a campaign")
    return Manifest(**data)


def _unpacked(data: dict[str, Any]) -> bool:
    """Turn the entry `cases` of a plan read from JSON into `digests` and `settings`.

    Return whether the plan has the keys that it must have.

    data : the parsed file, changed here
    """
    keys = {"cases", "reads", *Manifest.__dataclass_fields__} - {"digests", "settings"}
    if data.keys() != keys:
        return False
    plain, reads, base = data.pop("cases"), data.pop("reads"), data["base"]
    if not (is_table(plain) and isinstance(reads, dict) and isinstance(base, dict)):
        return False
    data["settings"] = table = Table.from_plain(plain)
    version = base.get(PHYSICS, PHYSICS_VERSION)
    data["digests"] = CaseDigests(inputs_in(base), table, reads, version)
    return base.keys() >= {FILE, *table.names}


def _has_types(data: dict[str, Any]) -> bool:
    """Return whether the entries of a plan read from JSON have the right types."""
    kinds = {"engine": str, "base": dict, "swept": list, "version": str}
    kinds |= {"extended": list, "twins": dict, "refine": dict, "machines": list}
    kinds |= {"units": list}
    return (
        all(isinstance(data[name], kind) for name, kind in kinds.items())
        and all(isinstance(name, str) for name in (*data["swept"], *data["units"]))
        and all(isinstance(time, float) for time in data["extended"])
        and all(map(_are_facts, data["machines"]))
    )


def _are_facts(given: Any) -> bool:
    """Return whether an entry of `machines` is {fact: text}."""
    return isinstance(given, dict) and all(isinstance(t, str) for t in given.values())


def digests_of(plan: Manifest) -> Digests:
    """Return the object that computes digests of a plan's cases from their inputs."""
    known = input_names()
    given = {name: value for name, value in plan.base.items() if name in known}
    base = apply_settings(Scene(), given)
    return Digests(base, {base.engine.file: plan.base.get(CONTENT, "")})


def _check_twins(
    old: Mapping[str, Any], new: Mapping[str, Any], begun: str, own: str
) -> None:
    """Raise InputError if a new plan would change the inputs of twins in another way.

    Parameters
    ----------
    old, new : tables [twins] of the plan in the directory and of the new one
    begun, own : beginning and end of the message
    """
    for name, default in (("spread", {}), ("seed", 0)):
        was, now = (twins.get(name, default) for twins in (old, new))
        if old and new and was != now:
            msg = f"{begun} [twins] {name} = {shown(was)}, got {shown(now)}: {own}"
            raise InputError(msg)


def _changed_file(old: Manifest, new: Manifest) -> str:
    """Return the path of an engine file that has changed since the plan was stored.

    "" if none has; only swept engine files are compared.

    old, new : plan in the directory, and plan of this run
    """
    digests = old.digests, new.digests
    was, now = (d.reads if isinstance(d, CaseDigests) else {} for d in digests)
    changed = (file for file in was if now.get(file, was[file]) != was[file])
    return next(changed, "") if FILE in new.swept else ""


def _values(plan: Manifest, name: str, swept: list[str]) -> list[Any]:
    """Return the different values of an input in a plan; [] if the input is in `swept`.

    Parameters
    ----------
    plan : the plan
    name : dotted name of the input
    swept : inputs that were swept before, whose values may change
    """
    if name in swept:
        return []
    if name not in plan.swept:
        return [plan.base.get(name)]
    values = listed(plan.table.column(name, plan.base[name]).values)
    return list({json.dumps(value): value for value in values}.values())
