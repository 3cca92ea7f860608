"""Shaft lines as users give them, and as a scene stores them: one line of JSON.

A shaft line is a table with sections, disks and bearings at stations,

    [engine.shaft]
    station = 3                     # of the bladed disk; station i ends section i
    young = 2.1e11                  # Pa; density, poisson or shear likewise, for all
    sections = [{ length = "0.2 m", outer = "60 mm" }, ...]
    disks = [{ station = 1, mass = 20, polar = 0.4, diametral = 0.2 }]
    bearings = [{ station = 0, kxx = 5e7, cxx = 1e4 }, ...]

or a rotor that ROSS has saved as TOML or JSON: its elements ShaftElement, DiskElement,
BearingElement, SealElement and PointMass, whose nodes are the stations (R. Timbo et
al., ROSS - Rotordynamic open source software, JOSS 2020). Bearings have the keys of
`bearing_tables`, and those of a squeeze film, `FILM`, which acts beside its springs and
dampers. What is not modelled is refused by name. Bearings may differ by direction; the
table's unequal = "mean" takes the mean of both, 2 k = k_xx + k_yy + i (k_yx - k_xy).
Their added mass (mxx, kg) must be the same along x and y, or the mean is taken. In a
table, file = "rotor.toml" names a file with the sections, disks and bearings.

The text that a scene stores has the elements between nodes, see `structure.shaft`: a
section is divided into elements no longer than its outer diameter, at most `MOST`. It
does not depend on the file later.
"""

from __future__ import annotations

import json
import math
import re
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from hpcwhirl.errors import nearest, shown
from hpcwhirl.scene.bearing_tables import (
    MASSES,
    OF_WHIRL,
    OVER_WHIRL,
    WHIRL,
    added_mass,
    as_ross_3,
    listed,
    rows_of,
)
from hpcwhirl.scene.kept_tables import must, read
from hpcwhirl.scene.units import in_si
from hpcwhirl.scene.whirl_fit import Branch, fitted

SUFFIXES = ".toml", ".json"
WORDS = "springs", "cantilever", "two bearings"
KEPT, MEAN = "kept", "mean"
UNEQUAL = KEPT, MEAN
MOST = 12  # elements of a section
LEAST = 2  # elements of a section
OF_TUBE, OF_DISK, OF_ROW = 11, 4, 9  # numbers in a row of the stored text
LONGEST = 400  # most elements of a shaft
USUAL = {"young": 2.1e11, "density": 7800.0, "poisson": 0.3}
MATERIAL = {
    "young": "Pa", "density": "kg/m^3", "shear": "Pa", "poisson": "1",
}  # fmt: skip
SECTION = {"length": "m", "outer": "m", "outer_end": "m", "inner": "m",
           "inner_end": "m", "elements": "1", **MATERIAL}  # fmt: skip
DISK = {"station": "1", "mass": "kg", "polar": "kg m^2", "diametral": "kg m^2"}
FILM = {"film_viscosity": "Pa s", "film_length": "m", "film_radius": "m",
        "film_clearance": "m"}  # fmt: skip
JOURNAL = {"journal_viscosity": "Pa s", "journal_length": "m", "journal_radius": "m",
           "journal_clearance": "m"}  # fmt: skip
BROKEN = "N/m^1.5"
NUMBER = re.compile(r"\d+(\.\d*)?([eE][+-]?\d+)?")
ROLLING = {"rolling_stiffness": "1", "rolling_clearance": "m",
           "rolling_balls": "1", "rolling_cage": "1"}  # fmt: skip
CAGE = 0.4  # usual speed of a cage over that of the rotor
FEWEST_BALLS, MOST_BALLS = 3, 200
STOP = {"stop_clearance": "m", "stop_friction": "1"}
LAWS = {"journal": JOURNAL, "rolling": ROLLING, "stop": STOP}
PEDESTAL = "pedestal_mass", "pedestal_kxx", "pedestal_cxx"
LINE = {"sections", "disks", "bearings", "viscous", "loss", *MATERIAL}
ROSS = "ShaftElement", "DiskElement", "BearingElement", "SealElement", "PointMass"
# of ROSS, and the values at which a key has no effect
IDLE = {
    "axial_force": 0, "torque": 0, "gyroscopic": True, "alpha": 0, "beta": 0,
    "shear_method_calc": "cowper",
}  # fmt: skip
SKIPPED = {"ross_version", "parameters", "_note"}
SKIPPED_OF_BEARING = {"tag", "color", "scale_factor", "seal_leakage"}
OF_FIT = "low", "high", "error", "between"  # numbers in the stored text
TOLERANCE = 0.01  # usual largest error of a fit over the whirl's frequency
OVER = "over whirl"  # kind of a support that is to be fitted


def shaft_text(value: str) -> str:
    """Return what a scene stores of the input `shaft`: a word, or a line as JSON.

    value : one of `WORDS`, the name of a TOML or JSON file, or such a text

    Raises
    ------
    ValueError
        if it is none of these
    """
    if value in WORDS:
        return value
    if value.startswith("{"):
        return _kept(value)
    path = Path(value)
    if path.suffix not in SUFFIXES:
        hint = nearest(value, WORDS)
        raise ValueError(
            f"must be {', '.join(WORDS)}, or a TOML or JSON file of a shaft, got "
            f"{shown(value)}{hint or ''}"
        )
    return text_of(parsed(path), path.name)


def _kept(text: str) -> str:
    """Return the text of a stored line in its one form, after a check."""
    try:
        given = json.loads(text)
        _check(given)
        _check_form(given)
    except (KeyError, TypeError, IndexError, RecursionError, ValueError):
        told = "must be the text of a shaft line that a scene stores, got "
        raise ValueError(told + shown(text)) from None
    return json.dumps(given, separators=(",", ":"))


def _check_form(line: Mapping[str, Any]) -> None:
    """Raise ValueError for a stored line with wrong rows or nodes."""
    last, feet = max(tube[0] for tube in line["tubes"]) + 1, len(line["pedestals"])
    first = sorted({tube[0] for tube in line["tubes"]})
    must(first == list(range(last)), "its elements must follow each other")
    must(all(len(tube) == OF_TUBE for tube in line["tubes"]), "an element is wrong")
    nodes = [disk[0] for disk in line["disks"]] + line["stations"]
    must(all(node in range(last + 1) for node in nodes), "a node is wrong")
    must(all(len(disk) == OF_DISK for disk in line["disks"]), "a disk is wrong")
    numbers = [*line["pedestals"], line["viscous"], line["loss"]]
    must(all(0.0 <= x < math.inf for x in numbers), "a number is wrong")
    for node, foot, rows, *film in line["supports"]:
        inside = node in range(-1, last + 1) and foot in range(-1, feet)
        must(film == [] or _is_film(*film), "a film is wrong")
        must(inside and rows and max(node, foot) >= 0, "a support is wrong")
        must(all(len(row) == OF_ROW for row in rows), "a support is wrong")
        must(all(math.isfinite(x) for row in rows for x in row), "a number is wrong")
    for node, foot, mass in line.get("added", ()):
        inside = node in range(-1, last + 1) and foot in range(-1, feet)
        must(inside and max(node, foot) >= 0, "an added mass is wrong")
        must(0.0 < mass < math.inf, "an added mass is wrong")
    for number, *four, branches in line.get("over_whirl", ()):
        inside = number in range(len(line["supports"])) and len(four) == len(OF_FIT)
        must(inside and all(0.0 <= x < math.inf for x in four), "a fit is wrong")
        must(all(map(_is_branch, branches)), "a branch of a fit is wrong")


def _is_branch(numbers: Any) -> bool:
    """Return whether numbers are those of a `whirl_fit.Branch`."""
    are_finite = all(math.isfinite(x) for x in numbers)
    return len(numbers) == len(Branch._fields) and are_finite and min(numbers[:3]) > 0.0


def _is_film(numbers: Any) -> bool:
    """Return whether numbers are those of a film: mu, L, R, c, in SI, or of a law."""
    if isinstance(numbers[0], str):
        kind, *rest = numbers
        are_fit = all(0.0 <= x < math.inf for x in rest)
        return kind in LAWS and len(rest) == len(LAWS[kind]) and are_fit
    return len(numbers) == len(FILM) and all(0.0 < x < math.inf for x in numbers)


def parsed(path: Path) -> Mapping[str, Any]:
    """Return the table in a TOML or JSON file; ValueError if it cannot be read."""
    text = read(path)
    try:
        found = tomllib.loads(text) if path.suffix == ".toml" else json.loads(text)
    except (tomllib.TOMLDecodeError, json.JSONDecodeError, RecursionError) as failed:
        raise ValueError(f"{path.name} cannot be read: {failed}") from None
    must(isinstance(found, Mapping), f"{path.name} must hold a table")
    return found


def text_of(
    given: Mapping[str, Any],
    name: str,
    unequal: str = KEPT,
    tolerance: float = TOLERANCE,
) -> str:
    """Return the text that a scene stores of a shaft line.

    given, name : parsed table of a user or of ROSS; its name in messages
    unequal : what becomes of bearings that differ by direction, one of `UNEQUAL`
    tolerance : largest error of a fit over the whirl's frequency
    """
    try:
        line = _of_ross(given) if _is_of_ross(given) else _of_table(given)
        _check(line)
        if unequal == MEAN:
            line["supports"] = _mean(line["supports"])
        added = [_alike(one, unequal) for one in line.pop("added")]
        fits = _fits(line["supports"], added, unequal, tolerance)
        line |= {key: own for key, own in (("added", added), ("over_whirl", fits))
                 if own}  # fmt: skip
    except ValueError as failed:
        raise ValueError(f"{name}: {failed}") from None
    except (KeyError, TypeError) as failed:
        raise ValueError(f"{name}: an element lacks or has a wrong {failed}") from None
    return json.dumps(line, separators=(",", ":"))


def tolerance_of(value: Any) -> float:
    """Return the largest error of a fit, > 0 and < 1; ValueError for another value."""
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    is_fit = is_number and 0.0 < value < 1.0
    must(is_fit, f"whirl_tolerance must be > 0 and < 1, got {shown(value)}")
    return float(value)


def _is_of_ross(given: Mapping[str, Any]) -> bool:
    return "sections" not in given and any(key.startswith(ROSS) for key in given)


# ---- a table of sections ----


def _of_table(given: Mapping[str, Any]) -> dict[str, Any]:
    _known(given, LINE, "the shaft")
    material = {**USUAL, **{key: given[key] for key in MATERIAL if key in given}}
    tubes, stations = [], [0]
    for i, section in enumerate(_tables(given, "sections")):
        where = f"section {i + 1}"
        _known(section, set(SECTION), where)
        tubes += _tubes({**material, **section}, where, stations[-1])
        stations.append(stations[-1] + tubes.pop())
    must(tubes, "it must have sections")
    disks = [_disk(one, f"disk {i}", stations)
             for i, one in enumerate(_tables(given, "disks"), 1)]  # fmt: skip
    pedestals: list[float] = []
    supports, added = [], list[list[Any]]()
    for i, one in enumerate(_tables(given, "bearings"), 1):
        where, own = f"bearing {i}", dict(one)
        mass = _added(own, where)
        supports += (found := _bearing(own, where, stations, pedestals))
        added += _placed(found[0], where, mass)
    damping = {
        key: _number(given, key, unit, "the shaft")
        for key, unit in (("viscous", "s"), ("loss", "1"))
    }
    return {
        "tubes": tubes, "disks": disks, "pedestals": pedestals, "supports": supports,
        "stations": stations, **damping, "added": added,
    }  # fmt: skip


def _tubes(section: Mapping[str, Any], where: str, first: int) -> list[Any]:
    """Return a section's elements, and then their number."""
    got = {key: _number(section, key, SECTION[key], where) for key in SECTION}
    length, out, within = got["length"], got["outer"], got["inner"]
    inner_end = got["inner_end"] if "inner_end" in section else within
    ends = got["outer_end"] or out, inner_end
    must(length > 0.0 and out > 0.0, f"{where} must have a length and outer > 0 m")
    told = f"{where} must have inner < outer, got {within} and {out}"
    must(0.0 <= within < out and 0.0 <= ends[1] < ends[0], told)
    count = int(got["elements"]) or min(MOST, max(LEAST, math.ceil(length / out)))
    must(1 <= count <= LONGEST, f"{where} must have 1 to {LONGEST} elements")
    young, density, shear, nu = (got[key] for key in MATERIAL)
    if "shear" in section and "poisson" not in section:
        nu = young / shear / 2 - 1
    shear = shear or young / 2 / (1 + nu)
    must(min(young, density, shear) > 0.0, f"{where} must have a material")

    def at(place: float, begin: float, end: float) -> float:
        return begin + (end - begin) * place / count

    return [
        [
            first + e, length / count, at(e, out, ends[0]), at(e + 1, out, ends[0]),
            at(e, within, ends[1]), at(e + 1, within, ends[1]), young, density, shear,
            nu, 1,
        ]
        for e in range(count)
    ] + [count]  # fmt: skip


def _disk(one: Mapping[str, Any], where: str, stations: list[int]) -> list[float]:
    _known(one, set(DISK), where)
    mass, polar, across = (
        _number(one, key, DISK[key], where) for key in ("mass", "polar", "diametral")
    )
    if "diametral" not in one:
        across = polar / 2
    return [_node(one, where, stations), mass, polar, across]


def _bearing(
    one: dict[str, Any], where: str, stations: list[int], pedestals: list[float]
) -> list[list[Any]]:
    """Return the supports of a bearing: its own, and those of film and pedestal."""
    node = _node(one, where, stations)
    foot = {key: one.pop(key) for key in PEDESTAL if key in one}
    film = {key: one.pop(key) for key in FILM if key in one}
    nonlinear: list[Any] = []
    for kind, keys in LAWS.items():
        if given := {key: one.pop(key) for key in keys if key in one}:
            nonlinear.append([kind, *_law(kind, given, where)])
    del one["station"]
    place = [node, len(pedestals) if foot else -1]
    usual = {"cxx": 0.0} | ({"kxx": 0.0} if film or nonlinear else {})
    is_alone = bool(nonlinear) and not film and not one
    own = [] if is_alone else [[*place, *_rows(usual | one, where)]]
    nonlinear += [_film(film, where)] if film else []
    own += [[*place, [[0.0] * OF_ROW], numbers] for numbers in nonlinear]
    if not foot:
        return own
    missing = ", ".join(key for key in PEDESTAL[:2] if key not in foot)
    must(not missing, f"{where} must have {missing}")
    mass = _number(foot, PEDESTAL[0], "kg", where)
    k = _number(foot, PEDESTAL[1], "N/m", where)
    c = _number(foot, PEDESTAL[2], "N s/m", where)
    pedestals.append(mass)
    base = [[0.0, k, 0.0, 0.0, k, c, 0.0, 0.0, c]]
    return [*own, [-1, len(pedestals) - 1, base]]


def _added(own: dict[str, Any], where: str) -> tuple[float, float] | None:
    """Remove the keys of added mass from a bearing's table; return mxx and myy, kg.

    None: it has no added mass.
    """
    given = {name: own.pop(name) for name in MASSES if name in own}
    try:
        return added_mass(given)
    except ValueError as failed:
        raise ValueError(f"{where}: {failed}") from None


def _placed(
    support: list[Any], where: str, mass: tuple[float, float] | None
) -> list[list[Any]]:
    """Return an added mass of a support as a list of at most one, see `_alike`.

    Over the whirl's frequency it becomes part of the table to be fitted, in place.
    """
    if support[-1][0] == OVER:
        support[-1][-1] = mass
        return []
    return [[where, *support[:2], *mass]] if mass else []


def with_tables(
    given: Mapping[str, Any], anchored: Callable[[str], str]
) -> dict[str, Any]:
    """Return the table of a shaft with the columns of each bearing's file.

    given : table of a user, whose bearings may have a key table = "seal.csv"
    anchored : function from a file's name to its path

    Raises
    ------
    ValueError
        if a file cannot be read, or has a key of the bearing besides
    """
    bearings = []
    for i, one in enumerate(_tables(given, "bearings"), 1):
        own, name = dict(one), one.get("table")
        if name is not None:
            del own["table"]
            must(isinstance(name, str), f"bearing {i}: table must name a file")
            try:
                found = listed(anchored(name))
            except ValueError as failed:
                raise ValueError(f"bearing {i}: {name}: {failed}") from None
            twice = ", ".join(key for key in found if key in own)
            must(not twice, f"bearing {i}: {twice} must not be given besides table")
            own |= found
        bearings.append(own)
    return {**given, "bearings": bearings} if bearings else dict(given)


def _film(given: Mapping[str, Any], where: str) -> list[float]:
    """Return a film's numbers in the order of `FILM`, all > 0."""
    return _positive(given, FILM, where, "squeeze film")


def _law(kind: str, given: Mapping[str, Any], where: str) -> list[float]:
    """Return the numbers of a journal or rolling bearing in the order of its keys.

    kind, given : one of `LAWS`; the keys that are given
    """
    if kind == "journal":
        return _positive(given, JOURNAL, where, "journal bearing")
    if kind == "stop":
        rub = _number({"stop_friction": 0.0, **given}, "stop_friction", "1", where)
        return [*_positive(given, {"stop_clearance": "m"}, where, "stop"), rub]
    usual: dict[str, Any] = {"rolling_clearance": 0.0, "rolling_cage": CAGE, **given}
    stiffness = usual.get("rolling_stiffness")
    if isinstance(stiffness, str):  # no unit of UDUNITS has a broken power
        number = stiffness.removesuffix(BROKEN).strip()
        told = f"{where}: rolling_stiffness must be in {BROKEN}, got {shown(stiffness)}"
        must(NUMBER.fullmatch(number), told)
        usual["rolling_stiffness"] = float(number)
    must_be = {key: ROLLING[key] for key in ("rolling_stiffness", "rolling_balls")}
    stiff, balls = _positive(usual, must_be, where, "rolling bearing")
    whole = balls == int(balls) and FEWEST_BALLS <= balls <= MOST_BALLS
    must(whole, f"{where}: rolling_balls must be a whole number, {FEWEST_BALLS} to "
                f"{MOST_BALLS}, got {balls:g}")  # fmt: skip
    clearance, cage = (
        _number(usual, key, ROLLING[key], where)
        for key in ("rolling_clearance", "rolling_cage")
    )
    must(cage < 1.0, f"{where}: rolling_cage must be < 1, got {cage:g}")
    return [stiff, clearance, balls, cage]


def _positive(
    given: Mapping[str, Any], units: Mapping[str, str], where: str, what: str
) -> list[float]:
    """Return the numbers of all keys in `units`, in SI, all > 0."""
    missing = [key for key in units if key not in given]
    must(not missing, f"{where} must have {', '.join(missing)} of its {what}")
    numbers = [_number(given, key, unit, where) for key, unit in units.items()]
    for key, number in zip(units, numbers, strict=True):
        must(number > 0.0, f"{where}: {key} must be > 0, got {number:g}")
    return numbers


def _rows(one: Mapping[str, Any], where: str) -> list[Any]:
    """Return the rows of a bearing; and `OVER`, if over the whirl's frequency."""
    units = {"k": "N/m", "c": "N s/m", "s": "rad/s", "w": "rad/s"}
    try:
        plain = {
            key: in_si(value, units[key[0]])
            if isinstance(value, str) and key[0] in units
            else value
            for key, value in one.items()
            if key not in SKIPPED_OF_BEARING
        }
        rows, over = rows_of(plain)
    except ValueError as failed:
        raise ValueError(f"{where}: {failed}") from None
    return [list(map(list, rows)), *([[OVER, where, None]] if over else [])]


def _node(one: Mapping[str, Any], where: str, stations: list[int]) -> int:
    number = one.get("station")
    is_one = isinstance(number, int) and not isinstance(number, bool)
    told = f"{where} must have a station from 0 to {len(stations) - 1}"
    inside = isinstance(number, int) and 0 <= number < len(stations)
    must(is_one and inside, f"{told}, got {shown(number)}")
    return stations[int(number or 0)]


def _tables(given: Mapping[str, Any], key: str) -> list[Mapping[str, Any]]:
    found = given.get(key, [])
    are_tables = isinstance(found, list) and all(isinstance(t, Mapping) for t in found)
    must(are_tables, f"{key} must be a list of tables, got {shown(found)}")
    return found  # type: ignore[no-any-return]


def _known(given: Mapping[str, Any], known: set[str], where: str) -> None:
    for key in given:
        if key not in known:
            hint = nearest(key, sorted(known)) or f"; known: {', '.join(sorted(known))}"
            raise ValueError(f"{where} has the unknown key {shown(key)}{hint}")


def _number(given: Mapping[str, Any], key: str, unit: str, where: str) -> float:
    """Return a number of a table in SI, 0 if it is not there."""
    value = given.get(key, 0.0)
    try:
        found = in_si(value, unit)
    except ValueError as failed:
        raise ValueError(f"{where}: {key} {failed}") from None
    is_number = isinstance(found, int | float) and not isinstance(found, bool)
    is_fit = is_number and math.isfinite(found) and found >= 0.0
    must(is_fit, f"{where}: {key} must be a number >= 0, got {shown(value)}")
    return float(found)


# ---- a rotor that ROSS has saved ----


def _of_ross(given: Mapping[str, Any]) -> dict[str, Any]:
    found: dict[str, list[tuple[str, Mapping[str, Any]]]] = {kind: [] for kind in ROSS}
    for key, table in given.items():
        if key in SKIPPED:
            continue
        kind = key.partition("_")[0]
        told = f"{shown(key)} is not modelled; known elements: {', '.join(ROSS)}"
        must(kind in found and isinstance(table, Mapping), told)
        found[kind].append((str(table.get("tag") or key), table))
    tubes = _ross_tubes(found["ShaftElement"])
    nodes = int(max(tube[0] for tube in tubes)) + 2
    disks = [[_ross_node(t, tag, nodes), *(float(t[key]) for key in ("m", "Ip", "Id"))]
             for tag, t in found["DiskElement"]]  # fmt: skip
    masses = {int(t["n"]): _point_mass(tag, t) for tag, t in found["PointMass"]}
    disks += [[n, masses[n], 0.0, 0.0] for n in sorted(masses) if n < nodes]
    feet = sorted(n for n in masses if n >= nodes)
    supports, added = list[list[Any]](), list[list[Any]]()
    is_new = int(str(given.get("ross_version", "0")).partition(".")[0] or 0) >= 3
    for tag, table in (*found["BearingElement"], *found["SealElement"]):
        own = as_ross_3(table) if is_new else dict(table)
        mass = _added(own, shown(tag))
        supports.append(_ross_support(tag, own, nodes, feet))
        added += _placed(supports[-1], shown(tag), mass)
    return {
        "tubes": tubes, "disks": disks, "pedestals": [masses[n] for n in feet],
        "supports": supports, "stations": list(range(nodes)), "viscous": 0.0,
        "loss": 0.0, "added": added,
    }  # fmt: skip


def _ross_tubes(elements: list[tuple[str, Mapping[str, Any]]]) -> list[list[float]]:
    must(elements, "it must have a ShaftElement")
    tubes = []
    for place, (tag, table) in enumerate(elements):
        for key, idle in IDLE.items():
            value = table.get(key, idle)
            told = f"{shown(tag)}: {key} = {shown(value)} is not modelled, only {idle}"
            must(value == idle, told)
        own = table.get("material")
        must(isinstance(own, Mapping), f"{shown(tag)} must have a material as a table")
        young, shear = float(own["E"]), float(own["G_s"])  # type: ignore[index]
        node = table.get("n")
        tubes.append([
            int(place if node is None else node), float(table["L"]),
            float(table["odl"]), float(table.get("odr", table["odl"])),
            float(table["idl"]), float(table.get("idr", table["idl"])), young,
            float(own["rho"]),  # type: ignore[index]
            shear if table.get("shear_effects", True) else 0.0, young / shear / 2 - 1,
            int(table.get("rotary_inertia", True)),
        ])  # fmt: skip
    tubes.sort(key=lambda tube: tube[0])
    told = "its shaft elements must follow each other from node 0"
    must(sorted({t[0] for t in tubes}) == list(range(int(tubes[-1][0]) + 1)), told)
    return tubes


def _ross_node(table: Mapping[str, Any], tag: str, nodes: int) -> int:
    node = int(table["n"])
    told = f"{shown(tag)} must be at a node of the shaft, 0 to {nodes - 1}, got {node}"
    must(0 <= node < nodes, told)
    return node


def _point_mass(tag: str, table: Mapping[str, Any]) -> float:
    given = (table.get(key) for key in ("m", "mx", "my"))
    mass = [float(one) for one in given if one is not None]
    told = f"{shown(tag)}: a mass that differs by direction is not modelled"
    must(mass and min(mass) == max(mass), told)
    return mass[0]


def _ross_support(
    tag: str, table: Mapping[str, Any], nodes: int, feet: list[int]
) -> list[Any]:
    kind = tag.replace("_", "").lower()
    is_clear = table.get(OF_WHIRL) or not any(word in kind for word in OVER_WHIRL)
    must(is_clear, f"{shown(tag)}: {WHIRL}")
    node, link = int(table["n"]), table.get("n_link")
    ends = []
    for end in (node, link):
        if end is None:
            ends.append((-1, -1))
        elif int(end) < nodes:
            ends.append((int(end), -1))
        else:
            told = f"{shown(tag)} is linked to node {end}, which has no PointMass"
            must(int(end) in feet, told)
            ends.append((-1, feet.index(int(end))))
    rows = _rows(table, shown(tag))
    (node, foot), (other, base) = ends
    told = f"{shown(tag)} connects two nodes of the shaft, which is not modelled"
    must(other < 0, told)
    must(foot < 0 or base < 0, f"{shown(tag)} connects two pedestals: not modelled")
    return [node, base if node >= 0 else foot, *rows]


# ---- both ----


def _fits(
    supports: list[list[Any]], added: list[Any], unequal: str, tolerance: float
) -> list[list[Any]]:
    """Return what a stored line has of supports over the whirl's frequency.

    Their tables are replaced by what acts beside the branches, in place, and their
    added mass by that of the fit. Returns (number of the support, `OF_FIT`, branches)
    """
    out = []
    for number, (node, foot, rows, *kind) in enumerate(supports):
        if not kind or kind[0][0] != OVER:
            continue
        _, where, both = kind[0]
        mass = _alike([where, node, foot, *both], unequal)[2] if both else 0.0
        try:
            fit = fitted(rows, mass, tolerance)
        except ValueError as failed:
            raise ValueError(f"{where}: {failed}") from None
        supports[number] = [node, foot, [[0.0, *fit.rest]]]
        added += [[node, foot, fit.mass]] if fit.mass else []
        numbers = [getattr(fit, key) for key in OF_FIT]
        out.append([number, *numbers, [list(one) for one in fit.branches]])
    return out


def _check(line: Mapping[str, Any]) -> None:
    """Raise ValueError for a line that has too many elements or no supports."""
    tubes = line["tubes"]
    must(len(tubes) <= LONGEST, f"it must have at most {LONGEST} elements")
    must(line["supports"], "it must have bearings")
    ratios = [tube[9] for tube in tubes]  # Poisson's, < 0 where E < 2 G
    must(all(-1.0 < nu < math.inf for nu in ratios), "its E and G must be > 0 Pa")
    numbers = [x for row in (*tubes, *line["disks"]) for x in row]
    are_fit = all(math.isfinite(x) and x >= 0.0 for x in numbers if x not in ratios)
    must(are_fit, "its numbers must be finite and >= 0")


def _alike(given: list[Any], unequal: str) -> list[Any]:
    """Return the row of an added mass that is the same along x and y.

    given : bearing in messages; node and pedestal of its support; mxx, myy, kg
    unequal : as of `text_of`
    """
    where, node, foot, xx, yy = given
    told = f'{where}: mxx must equal myy, got {xx:g} and {yy:g} kg; unequal = "{MEAN}" '
    must(xx == yy or unequal == MEAN, f"{told}takes their mean")
    return [node, foot, (xx + yy) / 2]


def _mean(supports: list[list[Any]]) -> list[list[Any]]:
    """Return supports that are the same in all directions, the mean of both."""
    out = []
    for at, to, rows, *film in supports:
        alike = []
        for speed, *columns in rows:
            means = []
            for xx, xy, yx, yy in (columns[:4], columns[4:]):
                cross = (xy - yx) / 2
                means += [(xx + yy) / 2, cross, -cross, (xx + yy) / 2]
            alike.append([speed, *means])
        out.append([at, to, alike, *film])
    return out
