"""Read the TOML file that says what the unknowns of a finite-element model are.

It names the files of the matrices and the degrees of freedom of tips, centre and cuts.
No mechanics. Degrees of freedom (DoF) are rows of M and K, from 0; angles are in rad,
anticlockwise. `wheel_example.toml` has all keys with their meanings; `hpcwhirl
import-model --example` prints it. A single sector is described by a table [sector]
instead of [wheel]; its blade is blade 0, and each of the keys x, y, radial and
tangential is a single DoF.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy import sparse

from hpcwhirl.arrays import Floats, Integers
from hpcwhirl.errors import InputError, as_table, nearest, shown, unknown
from hpcwhirl.scene.documents import load_document
from hpcwhirl.scene.input_names import is_number, is_whole
from hpcwhirl.store.models.engine_file import (
    AT_SPEEDS,
    BY_PARTS,
    COMPONENTS,
    LARGEST,
    are_two_ways,
    missing_terms,
    wrong_name,
)
from hpcwhirl.store.models.sparse_file import (
    READERS,
    read_matrix,
    read_rows,
    read_vector,
    row_names,
)

MOST_BLADES = LARGEST // 2 - 1
DECKS = ".inp", ".cdb", ".bdf", ".nas", ".dat"
EXAMPLE = Path(__file__).with_name("wheel_example.toml")
FAMILIES = 5  # default number of mode families that are kept
EVEN = 1e-6  # rad, largest deviation from 2 pi / N between blades
TURNING = ("coriolis", "centrifugal_load", *BY_PARTS, *AT_SPEEDS)
KEYS = {
    "wheel": ("mass", "stiffness", "blades", "modes", "held", *TURNING),
    "tips": ("x", "y", "radial", "tangential", "angle", "station", "turn", "gap"),
    "centre": ("x", "y", "angle", "stiffness", "mass", "held"),
    "stress": ("matrix", "names"),
}
CUTS = ("left", "right", "left_x", "right_x", "left_y", "right_y")
TABLES = {**KEYS, "sector": (*KEYS["wheel"], *CUTS)}


@dataclass(frozen=True)
class Centre:
    """The shaft's centre in a finite-element model, table [centre] of its file.

    Attributes
    ----------
    dofs : (2,), DoF of the displacements along x and y
    angle : rad, angle of blade 0 from the x axis of these DoF, anticlockwise
    stiffness : N/m, of each of two springs added to the model, along x and y
    mass : kg, of the point mass added to the model
    held : whether the centre is fixed
    """

    dofs: Integers
    angle: float
    stiffness: float
    mass: float
    held: bool


@dataclass(frozen=True)
class Cut:
    """DoF on the two cuts along which one sector was cut out of its wheel.

    The i-th ones of the left and the right cut are at corresponding positions.

    Attributes
    ----------
    left, right : (s,), s DoF along axes that turn from sector to sector
    left_plane, right_plane : (p, 2), DoF of p nodes along x and y, axes that are the
        same for all sectors
    """

    left: Integers
    right: Integers
    left_plane: Integers
    right_plane: Integers


@dataclass(frozen=True)
class FiniteElements:
    """A finite-element model of a wheel, or of one of its sectors, with its matrices.

    Attributes
    ----------
    file : the TOML file
    sources : files of M, K and the terms of rotation
    mass, stiffness : (n, n), kg and N/m, of n DoF, symmetric
    blades : N, number of blades of the whole wheel
    tips : (N, 2), or (1, 2) of a sector: DoF of each tip; with several contact points a
        tip, DoF of all of them, blade by blade, (N n_c, 2) or (n_c, 2)
    angle : rad, one per row of `tips`: from the axes of its DoF to the radial,
        tangential ones
    centre : the shaft's centre; None if it is clamped
    held : DoF that do not move
    modes : number of fixed-interface modes to keep
    cut : DoF on the cuts of a sector; None for a wheel
    turning : {name as in an engine's file: matrix, vector, or two speeds} of the terms
        of rotation, all or none
    points : {name as in an engine's file: (n_c,)} of several contact points per tip
    stress : None, or names of P points and rows (r, n), Pa/m, ordered by blade, then
        point, then component, as in an engine's file; r = N P c, or P c for a sector
    """

    file: str
    sources: tuple[Path, ...]
    mass: sparse.csr_array
    stiffness: sparse.csr_array
    blades: int
    tips: Integers
    angle: Floats
    centre: Centre | None
    held: Integers
    modes: int
    cut: Cut | None
    turning: dict[str, Any]
    points: dict[str, Floats] = field(default_factory=dict)
    stress: tuple[tuple[str, ...], sparse.csr_array] | None = None

    @property
    def each(self) -> int:
        """Number of contact points per tip, n_c."""
        return len(self.points["tip_station"]) if self.points else 1

    @property
    def places(self) -> Floats:
        """Angles of all contact points, blade by blade, (N n_c,), rad, from blade 0."""
        blade = 2 * np.pi * np.arange(self.blades) / self.blades
        turn = self.points["tip_angle"] if self.points else np.zeros(1)
        return np.add.outer(blade, turn).ravel()

    def refusal(self, told: str) -> InputError:
        """Return the InputError "FILE: TOLD", for a model that is refused.

        told : the rest of the message, such as "has no ..."
        """
        return InputError(f"{self.file}: {told}")

    def wrong(self, name: str, allowed: str, got: object) -> InputError:
        """Return the InputError for a part of the model that breaks a rule.

        Parameters
        ----------
        name : name of the part
        allowed : what it must do, as text after "must", such as "be finite"
        got : what the model has instead
        """
        return self.refusal(f"{name} must {allowed}, got {got}")


class _Table:
    """A table of the TOML file; each method returns the value of a key, checked.

    There is a method for each type of value; a wrong value raises InputError.
    """

    def __init__(
        self, file: str, name: str, data: Any, rows: Mapping[str, int] | None = None
    ) -> None:
        self.file, self.name, self.rows = file, name, rows or {}
        self.data = as_table(f"{file}: [{name}]", data, TABLES[name])

    def wrong(self, key: str, allowed: str, got: object) -> InputError:
        return InputError(f"{self.file}: [{self.name}] {key} must {allowed}, got {got}")

    def asked(self, key: str, default: Any = None) -> Any:
        value = self.data.get(key, default)
        if value is None:
            raise InputError(f"{self.file}: [{self.name}] has no {key}")
        return value

    def text(self, key: str) -> str:
        value = self.asked(key)
        if not isinstance(value, str):
            raise self.wrong(key, "be the name of a file", shown(value))
        return value

    def flag(self, key: str) -> bool:
        value = self.asked(key, default=False)
        if not isinstance(value, bool):
            raise self.wrong(key, "be true or false", shown(value))
        return value

    def whole(self, key: str, least: int, most: int, default: int | None = None) -> int:
        value = self.asked(key, default)
        if not is_whole(value) or not least <= value <= most:
            raise self.wrong(key, f"be a whole number {least} to {most}", shown(value))
        return int(value)

    def number(self, key: str, default: float, *, positive: bool = False) -> float:
        value = self.asked(key, default)
        if not _is_number(value) or (positive and value < 0):
            kind = "number >= 0" if positive else "number"
            raise self.wrong(key, f"be a {kind}", shown(value))
        return float(value)

    def indices(self, key: str, size: int, count: int | None = None) -> Integers:
        """Return the DoF that a key lists, whole numbers 0 .. size - 1, as an array.

        Parameters
        ----------
        key : the key
        size : number of DoF of the model
        count : required number of DoF; None: any. A single DoF may be written without a
            list
        """
        value = self.asked(key, None if count else [])
        value = value if isinstance(value, list) else [value]
        value = [self._row(key, one) if isinstance(one, str) else one for one in value]
        if not all(map(is_whole, value)):
            raise self.wrong(key, "hold whole numbers", shown(value))
        if count and len(value) != count:
            raise self.wrong(key, f"name {count} degrees of freedom", len(value))
        wrong = [i for i in value if not 0 <= i < size]
        if wrong:
            hint = ": these numbers begin with 0" if max(value) == size else ""
            raise self.wrong(key, f"be 0 to {size - 1}", f"{shown(wrong[0])}{hint}")
        return np.array(value, dtype=np.int64)

    def _row(self, key: str, name: str) -> int:
        """Return the DoF that CalculiX names "node.direction" in its file .dof."""
        if not self.rows:
            allowed = "hold whole numbers: there is no .dof beside the matrices"
            raise self.wrong(key, allowed, shown(name))
        if name not in self.rows:
            near = nearest(name, self.rows)
            raise self.wrong(key, 'be "node.direction" of .dof', shown(name) + near)
        return self.rows[name]


def _is_number(value: object) -> bool:
    return is_number(value) and math.isfinite(value)


def read_wheel(path: Path) -> FiniteElements:
    """Read a finite-element model from its TOML file and the files of its matrices.

    Raises
    ------
    MissingFileError
        where the file or the file of a matrix cannot be read
    InputError
        naming the key, its value and what is allowed
    """
    _check_kind(path)
    document, file = load_document(path), str(path)
    kind = _kind_of(document, file)
    body = _Table(file, kind, document.get(kind, {}))
    tips = _Table(file, "tips", document.get("tips", {}))
    is_sector = kind == "sector"
    blades = body.whole("blades", 3 if is_sector else 1, MOST_BLADES)
    names = ("mass", "stiffness")
    turning, more = _turning(body, path.parent)
    sources = tuple(path.parent / body.text(name) for name in names)
    mass, stiffness = map(read_matrix, sources, names)
    body.rows = tips.rows = rows_named = row_names(sources[0]) or row_names(sources[1])
    size = mass.shape[0]
    if stiffness.shape != mass.shape:
        told = f"{size} degrees of freedom, stiffness {stiffness.shape[0]}"
        raise body.wrong("mass and stiffness", "be of one size", f"mass {told}")
    _read_turning(body, turning, more, size)
    points = _points(tips)
    each = len(points["tip_station"]) if points else 1
    pairs, of_blade = _tips(tips, size, blades, (1 if is_sector else blades, each))
    plane, centre = "x" in tips.data, None
    if "centre" in document:
        table = _Table(file, "centre", document["centre"], rows_named)
        centre = _centre(table, size, float(of_blade[0]) if plane else 0.0)
    turn = points["tip_angle"] if points and plane else np.zeros(each)
    stress, rows = _stress(document, path, size, 1 if is_sector else blades)
    most = LARGEST - 2 * blades * each - (2 if centre else 0)
    wheel = FiniteElements(
        file=file,
        sources=(*sources, *more.values(), *rows),
        mass=mass,
        stiffness=stiffness,
        blades=blades,
        tips=pairs,
        angle=np.add.outer(of_blade, turn).ravel(),
        centre=centre,
        held=body.indices("held", size),
        modes=body.whole("modes", 0, most, min(FAMILIES * blades, most)),
        cut=_cut(body, size) if is_sector else None,
        turning=turning,
        points=points,
        stress=stress,
    )
    _check_once(wheel)
    return wheel


def _check_kind(path: Path) -> None:
    """Raise InputError for a finite-element code's own file in place of the TOML."""
    ending = path.suffix.lower()
    if ending in DECKS:
        raise InputError(
            f"{path} is an input deck: a step with *FREQUENCY, SOLVER=MATRIXSTORAGE "
            "lets CalculiX write .mas, .sti and .dof, which FILE.toml names: hpcwhirl "
            "import-model --example"
        )
    if ending in READERS or ending == ".dof":
        msg = f"{path} is one file of a model: FILE.toml names mass and stiffness: "
        raise InputError(f"{msg}hpcwhirl import-model --example")


def _kind_of(document: dict[str, Any], file: str) -> str:
    """Return which table a file has, "wheel" or "sector"; refuse none or both."""
    kinds = [name for name in ("wheel", "sector") if name in document]
    if len(kinds) != 1:
        msg = f"{file} must have one of the tables [wheel], [sector], got {len(kinds)}"
        raise InputError(f"{msg}: hpcwhirl import-model --example")
    for name in document:
        if name not in TABLES:
            raise unknown(f"table in {file}", name, TABLES)
    return kinds[0]


def _turning(table: _Table, folder: Path) -> tuple[dict[str, Any], dict[str, Path]]:
    """Return which files hold the matrices and the load of the terms of rotation.

    Parameters
    ----------
    table : table [wheel] or [sector]
    folder : folder of the TOML file

    Returns
    -------
    {"speeds": (2,), rad/s}, if the stiffness is given at two speeds, else {}; and {name
    of a matrix or load: its file}, {} without terms of rotation
    """
    if not any(name in table.data for name in TURNING):
        return {}, {}
    told = f"{table.file}: [{table.name}]"
    if are_two_ways(table.data):
        msg = f"{told} must have {', '.join(AT_SPEEDS)} or {', '.join(BY_PARTS)}"
        raise InputError(f"{msg}, got both")
    missing = missing_terms(table.data)
    if missing:
        msg = f"{told} has no {', '.join(missing)}: all terms of rotation or none"
        raise InputError(msg)
    files = [n for n in TURNING if n in table.data and n != "speeds"]
    found: dict[str, Any] = {}
    if "speeds" in table.data:
        speeds = table.data["speeds"]
        pair = isinstance(speeds, list) and len(speeds) == 2
        if (
            not pair
            or not all(map(_is_number, speeds))
            or not 0 < speeds[0] < speeds[1]
        ):
            allowed = "be two, ascending, > 0 rad/s"
            raise table.wrong("speeds", allowed, shown(speeds))
        found["speeds"] = np.array(speeds, dtype=np.float64)
    return found, {name: folder / table.text(name) for name in files}


def _read_turning(
    table: _Table, found: dict[str, Any], files: dict[str, Path], size: int
) -> None:
    """Read the matrices and the load of the terms of rotation from their files.

    Parameters
    ----------
    table : table that names the files, for messages
    found : filled here, {name: (n, n) matrix or (n,) load}
    files : {name: file}
    size : n, number of DoF
    """
    for name, path in files.items():
        if name == "centrifugal_load":
            found[name] = read_vector(path, name, size)
            continue
        found[name] = read_matrix(path, name)
        if found[name].shape[0] != size:
            told = f"{found[name].shape[0]} degrees of freedom"
            raise table.wrong(name, f"have the {size} degrees of freedom of mass", told)


def _points(table: _Table) -> dict[str, Floats]:
    """Return places and gaps of several contact points per tip from table [tips].

    They are {name in an engine's file: (n_c,)}: the axial place, the angle and the
    additional gap of each point; {} for a single point.
    """
    names = {"station": "tip_station", "turn": "tip_angle", "gap": "tip_gap"}
    beside = [name for name in ("turn", "gap") if name in table.data]
    if "station" not in table.data:
        if beside:
            allowed = "come with station, the axial place of each contact point"
            raise table.wrong(beside[0], allowed, "none")
        return {}
    found: dict[str, Floats] = {}
    given = table.asked("station")
    count = len(given) if isinstance(given, list) else 0
    for key, name in names.items():
        value = table.asked(key, [0.0] * count)
        if not isinstance(value, list) or not all(map(_is_number, value)):
            raise table.wrong(key, "be a list of numbers", shown(value))
        if len(value) != count or not count:
            raise table.wrong(key, f"have {max(count, 1)} numbers", len(value))
        found[name] = np.array(value, dtype=np.float64)
    if (np.diff(found["tip_station"]) < 0.0).any():
        raise table.wrong("station", "ascend", shown(table.data["station"]))
    return found if count > 1 else {}


def _stress(
    document: dict[str, Any], path: Path, size: int, blades: int
) -> tuple[tuple[tuple[str, ...], sparse.csr_array] | None, list[Path]]:
    """Return the stress points of table [stress] and their rows, read from a file.

    Parameters
    ----------
    document : the parsed TOML file
    path : path of that file
    size : n, number of DoF
    blades : number of blades whose rows are in the file

    Returns
    -------
    (names of the points, rows (r, n), Pa/m), None without a table [stress]; and [file
    of the rows], [] without
    """
    if "stress" not in document:
        return None, []
    table = _Table(str(path), "stress", document["stress"])
    given = table.asked("names")
    if not isinstance(given, list) or not all(isinstance(one, str) for one in given):
        raise table.wrong("names", "be a list of texts", shown(given))
    names = tuple(given)
    wrong = wrong_name(names)
    if wrong is not None or not names:
        allowed = "be texts that are all different"
        raise table.wrong("names", allowed, shown(given if wrong is None else wrong))
    file = path.parent / table.text("matrix")
    rows = read_rows(file, "stress", size)
    each, rest = divmod(rows.shape[0], blades * len(names))
    if rest or each not in COMPONENTS:
        told = " or ".join(str(blades * len(names) * c) for c in COMPONENTS)
        raise table.wrong("matrix", f"have {told} rows", rows.shape[0])
    return (names, rows), [file]


def _tips(
    table: _Table, size: int, blades: int, counts: tuple[int, int]
) -> tuple[Integers, Floats]:
    """Return the DoF of the tips and the direction of each blade from table [tips].

    Parameters
    ----------
    table : table [tips]
    size : number of DoF of the model
    blades : N
    counts : number c of blades in the model, and n_c of contact points per tip

    Returns
    -------
    (c n_c, 2), DoF of each contact point; and (c,), rad, angle from the axes of a
    blade's DoF to its radial, tangential axes
    """
    count, each = counts
    plane = "x" in table.data or "y" in table.data
    if plane and ("radial" in table.data or "tangential" in table.data):
        raise table.wrong("tips", "be x, y or radial, tangential", "both")
    names = ("x", "y") if plane else ("radial", "tangential")
    pairs = np.column_stack([table.indices(n, size, count * each) for n in names])
    given = table.asked("angle", 0.0)
    if not isinstance(given, list):
        step = 2 * np.pi / blades if plane else 0.0
        first = table.number("angle", 0.0)
        return pairs, first + step * np.arange(count, dtype=np.float64)
    if len(given) != count or not all(map(_is_number, given)):
        raise table.wrong("angle", f"be a number or {count} of them", shown(given))
    angle = np.array(given, dtype=np.float64)
    steps = np.diff(angle) - 2 * np.pi / blades
    if plane and (np.abs(np.angle(np.exp(1j * steps))) > EVEN).any():
        allowed = "rise by 2 pi / N from blade to blade, anticlockwise"
        raise table.wrong("angle", allowed, shown(given))
    return pairs, angle


def _centre(table: _Table, size: int, angle: float) -> Centre:
    dofs = np.concatenate([table.indices(name, size, 1) for name in ("x", "y")])
    return Centre(
        dofs,
        table.number("angle", angle),
        table.number("stiffness", 0.0, positive=True),
        table.number("mass", 0.0, positive=True),
        table.flag("held"),
    )


def _cut(table: _Table, size: int) -> Cut:
    """Return the DoF on both cuts of a sector; refuse cuts of different sizes.

    Parameters
    ----------
    table : table [sector] of the TOML file
    size : number of DoF of the model
    """
    found = {name: table.indices(name, size) for name in CUTS}
    for left, right in (
        ("left", "right"),
        ("left_x", "right_x"),
        ("left_y", "right_y"),
    ):
        if len(found[left]) != len(found[right]):
            told = f"{len(found[left])} and {len(found[right])}"
            raise table.wrong(f"{left} and {right}", "be of one length", told)
    if len(found["left_x"]) != len(found["left_y"]):
        told = f"{len(found['left_x'])} and {len(found['left_y'])}"
        raise table.wrong("left_x and left_y", "be of one length", told)
    if not len(found["left"]) + len(found["left_x"]):
        msg = f"{table.file}: [sector] has neither left and right nor left_x, left_y, "
        raise InputError(msg + "right_x, right_y")
    planes = [np.column_stack([found[f"{s}_x"], found[f"{s}_y"]]) for s in CUTS[:2]]
    return Cut(found["left"], found["right"], *planes)


def _check_once(wheel: FiniteElements) -> None:
    """Raise InputError if the keys of the file name a DoF twice."""
    cut = wheel.cut
    sides = (
        [] if cut is None else [cut.left, cut.right, cut.left_plane, cut.right_plane]
    )
    hub = [] if wheel.centre is None else [wheel.centre.dofs]
    named = np.concatenate([a.ravel() for a in (wheel.tips, wheel.held, *hub, *sides)])
    values, times = np.unique(named, return_counts=True)
    if times.max() > 1:
        kinds = "tips, centre, held" + (", left and right" if cut else "")
        twice = values[times > 1][0]
        raise wheel.refusal(f"degree of freedom {twice} is named twice among {kinds}")
