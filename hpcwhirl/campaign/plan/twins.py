"""Perturbed twins of cases, which tell how sure a word is.

A twin is its case with inputs that nobody knows so well multiplied by 1 + spread u, u
evenly within -1 .. 1 and a function of the case's motion (`identity`), the number of
the twin and the input's name alone: the same wherever and whenever it is computed.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from hpcwhirl.errors import InputError, as_table, shown, unknown
from hpcwhirl.scene import Scene, apply_settings, digest, flatten
from hpcwhirl.scene.files import by_full_name, is_number, is_whole, undotted
from hpcwhirl.scene.table import Table, listed

OF = ("all", "boundary", "speckle")
KEYS = ("count", "of", "spread", "sure")
DEFAULTS: dict[str, Any] = {
    "count": 16,
    "of": "all",
    "spread": {"force": 1e-6},
    "sure": 0.9,
}
# as in a scene of nothing but defaults
ASIDE = {n: flatten(Scene())[n] for n in ("solver.until", "solver.longest")}
ASIDE |= {n: flatten(Scene())[n] for n in ("output.traces", "output.interval")}
MOST = 1000
BITS = 53  # of a double's fraction
LEAST = 1e-12  # spread, of which doubles leave each twin its own value


@dataclass(frozen=True)
class Twins:
    """The table [twins] of a campaign.

    Attributes
    ----------
    count : twins of a case
    of : of which cases: all, or those with a neighbour in the grid of another regime;
        of a refined campaign those at corners of its mixed cells, or of those in
        speckle alone
    spread : {dotted input: largest relative change}
    sure : share of twins from which their word counts as that of the case
    """

    count: int
    of: str
    spread: dict[str, float]
    sure: float

    def scene(self, scene: Scene, content: str, number: int) -> Scene:
        """Return a twin, 1 .. count, of a case; it keeps no traces.

        content : digest of its engine's file, see `scene.digest`
        """
        values, motion = flatten(scene), identity(scene, content)
        changed: dict[str, Any] = {"output.traces": "summary"}
        for name, spread in self.spread.items():
            factor = 1.0 + spread * draw(motion, number, name)
            changed[name] = float(str(values[name])) * factor
        return apply_settings(scene, changed)

    def as_plan(self) -> dict[str, Any]:
        """Return what a plan keeps, see `twins_of_plan`."""
        return asdict(self)


def identity(scene: Scene, content: str) -> str:
    """Return what the twins of a case are drawn by: a digest of its motion alone.

    How long it goes on while it is undecided and what is kept of it change no twin.
    """
    return digest(apply_settings(scene, ASIDE), content)


def draw(motion: str, number: int, name: str) -> float:
    """Return a number in -1 .. 1, evenly, of a case's motion, its twin and an input."""
    found = hashlib.sha256(f"{motion} {number} {name}".encode()).digest()
    whole = int.from_bytes(found[:8]) >> (64 - BITS)
    return float(2.0 * whole / (2**BITS - 1) - 1.0)


def twins_of(document: Mapping[str, Any], base: Scene) -> Twins | None:
    """Return the table [twins] of a document; None where it has none.

    Raises
    ------
    InputError
        naming the key, what it got and what is allowed
    """
    given = document.get("twins")
    if given is None:
        return None
    values = {**DEFAULTS, **as_table("[twins]", given, KEYS)}
    count, of, sure = _checked(values["count"], values["of"], values["sure"])
    if of == "speckle" and "refine" not in document:
        _refuse("of", "all or boundary (speckle is known of [refine] alone)", of)
    return Twins(count, of, _spread(values["spread"], base), sure)


def _checked(count: Any, of: Any, sure: Any) -> tuple[int, str, float]:
    """Return three keys of the table, as they are allowed."""
    if not is_whole(count) or not 2 <= count <= MOST:
        _refuse("count", f"a whole number, 2 to {MOST}", count)
    if of not in OF:
        raise unknown("[twins] of", str(of), OF)
    if not is_number(sure) or not 0.0 < sure <= 1.0:
        _refuse("sure", "a number > 0, at most 1", sure)
    return count, str(of), float(sure)


def check_spread(twins: Twins, base: Scene, rows: Table) -> None:
    """Refuse a relative spread about 0, of which all twins would be the case itself.

    Parameters
    ----------
    rows : {dotted input: value} of what each case sets
    """
    values = flatten(base)
    for name in twins.spread:
        column = rows.column(name, values[name])
        zero = [place for place, v in enumerate(listed(column.values)) if v == 0.0]
        if zero:
            case = column.case_of(zero[0])
            msg = f"[twins] spread {name}: it is 0 in case {case}, and a relative "
            raise InputError(msg + "change of 0 is none: spread another input")


def twins_of_plan(plan: Mapping[str, Any]) -> Twins | None:
    """Return the twins of a plan; None where it has none."""
    return Twins(**plan) if plan else None


def _refuse(key: str, allowed: str, got: Any) -> None:
    msg = f"[twins] {key} must be {allowed}, got {shown(got)}"
    raise InputError(msg)


def _spread(given: Any, base: Scene) -> dict[str, float]:
    """Return {dotted input: spread} of a table, each an input that is a real number."""
    if not isinstance(given, Mapping) or not given:
        _refuse("spread", "a table such as {force = 1e-6}", given)
    values, out = flatten(base), {}
    pairs = ((n, (n, spread)) for n, spread in undotted(given, lambda _: False))
    for full, (name, spread) in by_full_name(pairs, "[twins] spread").items():
        if not isinstance(values[full], float):
            _refuse(f"spread {name}", "of an input that is a real number", spread)
        if not is_number(spread) or not LEAST <= spread < 1.0:
            _refuse(f"spread {name}", f"a number >= {LEAST:g} and < 1", spread)
        out[full] = float(spread)
    return dict(sorted(out.items()))
