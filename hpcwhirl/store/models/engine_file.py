"""Read an engine's HDF5 file into arrays, after checking its layout; no mechanics.

All data must be in the file itself, since its bytes decide the digest of a case: links
to other files, external raw data, virtual datasets and names outside the layout are
refused, and the message names them. Types and sizes are checked before an array is
read.

The group `rotor`, as `hpcwhirl export-model` writes it; N is `engine.rotor.blades`:

mass, stiffness             (n, n), kg and N/m: symmetric; M positive definite, K
                            positive semidefinite
damping                     (n, n), N s/m, if any: modal (Phi^T D Phi diagonal to 1e-6);
                            the ratio xi of each mode follows from it
tip_radial, tip_tangential  (N,), from 0: coordinates of the tips, blade j at 2 pi j /
                            N; (N, n_c) of several contact points a tip
centre                      (2,), from 0: coordinates x_o, y_o; empty or absent: clamped

and, with these, what engine.rotation = "full" needs, all or none:

coriolis                    (n, n), kg, skew-symmetric: force -2 Omega C x'. A mass m
                            with displacements x, y has C_yx = +m, C_xy = -m
centrifugal_load            (n,), kg m: N per unit Omega^2
stress_stiffness, softening (n, n), kg: N/m per unit Omega^2, symmetric; the stiffness
                            at Omega is K + Omega^2 (stress_stiffness - softening);
                            softening is the mass matrix of motion in the plane
speeds, stiffness_a,        or, instead of stress_stiffness and softening, the stiffness
stiffness_b                 (n, n), N/m, at two speeds (2,), ascending, rad/s, softening
                            included
centre_damping              (1,), N s/m, optional: of the shaft's support, static frame

with several contact points a tip, see `reduction.points`,

tip_station                 (n_c,), m: axial place of each, ascending, 0 in the middle
                            of the casing
tip_angle                   (n_c,), rad: angle of each beyond that of its blade, if any;
                            radial and tangential are the directions there
tip_gap                     (n_c,), m: clearance of each beyond the scene's gap, if any

the stress at P points of each blade, see `reduction.points`, in a file with matrices,

stress                      (N, P, c, n), Pa/m: c = 1 or 6 components (xx, yy, zz, yz,
                            zx, xy) of unit coordinates
stress_name                 (P,), text: names of the points, all different

or, instead of matrices,

omega                       (m,), rad/s: frequencies of mass-orthonormal modes
damping_ratio               (m,), xi of each, if any
modal_tip_radial,           (N, m), 1/sqrt(kg): tips of each mode; (N, n_c, m) of
modal_tip_tangential        several contact points a tip
modal_centre                (2, m), 1/sqrt(kg): x_o, y_o of each mode; absent: clamped

The group `casing`, read if `engine.casing.discretization` is "file": a round casing in
the static frame, as a table of m modes, several for each harmonic h, see
`reduction.round_casing`:

modal_harmonic              (m,): h = 0, 1, ... up to the highest, without a gap
modal_omega                 (m,), rad/s
modal_damping_ratio         (m,), xi
modal_radial                (m,), 1/sqrt(kg): W of w = W cos(h theta)
modal_tangential            (m,), 1/sqrt(kg): U of u = U sin(h theta); h = 0: of u = U
station                     (s,), m, if any: axial places, ascending, 0 in the middle,
                            of a casing with width; W and U are (m, s) then, and linear
                            in between

A file with matrices may also have `shapes`, `omega` and `damping_ratio`, which must
agree with the matrices to 1e-6 and are not used otherwise. With modes only, the scheme
`paper` is not available. The SHA-256 of the file is part of a case's identity.

A rotor whose sectors are equal to 2e-5 (frequencies, damping over frequency, shapes of
tips and centre) is integrated like the built-in one, see `reduction.recognise`. The
springs of the shaft follow from the modes if nothing else holds the rotor, see
`reduction.supports`; otherwise shares of the centre and families of k = 1 are unknown.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.errors import InputError, MissingFileError, WhirlError, nearest, one_line
from hpcwhirl.safe_open import check_regular
from hpcwhirl.scene.case_digest import check_bytes, content_digest

if TYPE_CHECKING:
    import h5py

Array = NDArray[Any]
Kinds = dict[str, tuple[tuple[int, ...], bool]]
# name: (dimensions allowed, whether it holds indices); the layout of `export-model`
DATASETS: Kinds = {
    **dict.fromkeys(
        ("mass", "stiffness", "damping", "shapes", "modal_centre", "coriolis",
         "stress_stiffness", "softening", "stiffness_a", "stiffness_b"),
        ((2,), False),
    ),
    **dict.fromkeys(
        ("omega", "damping_ratio", "centrifugal_load", "speeds", "centre_damping",
         "tip_station", "tip_angle", "tip_gap", "stress_name"),
        ((1,), False),
    ),
    "modal_tip_radial": ((2, 3), False),
    "modal_tip_tangential": ((2, 3), False),
    "tip_radial": ((1, 2), True),
    "tip_tangential": ((1, 2), True),
    "centre": ((1,), True),
    "stress": ((4,), False),
}  # fmt: skip
TEXTS = {"stress_name"}  # hold text; all others hold numbers
LONGEST_NAME = 60  # bytes of a text
COMPONENTS = (1, 6)  # of a stress: one, or all
AT_SPEEDS = ("speeds", "stiffness_a", "stiffness_b")
BY_PARTS = ("stress_stiffness", "softening")
BODY = (
    "mass", "stiffness", "damping", "omega", "damping_ratio", "shapes",
    "nodal_diameter",
)  # fmt: skip
CASING: Kinds = {
    "modal_harmonic": ((1,), True),
    "modal_omega": ((1,), False),
    "modal_damping_ratio": ((1,), False),
    "modal_radial": ((1, 2), False),
    "modal_tangential": ((1, 2), False),
    "station": ((1,), False),
}
KINDS = {"rotor": DATASETS, "casing": CASING}
# All allowed names; `export-model` also writes labels and the casing in the coordinates
# of the time integration, which are not read.
LAYOUT = {
    "rotor": (*DATASETS, "nodal_diameter"),
    "casing": (*CASING, *BODY, "radial_rows", "tangential_rows"),
}
UNREADABLE = (OSError, RuntimeError, ValueError, KeyError, TypeError)  # HDF5 raises
LARGEST = 4000  # coordinates or modes along an axis: a matrix takes 128 MB
WIDEST = 16  # bytes, largest size of one number
DEFLATE = 1032  # largest ratio of deflated data's size before and after compression
CHUNK = 1 << 28  # bytes, largest size of one chunk after decompression


@dataclass(frozen=True)
class Given:
    """The arrays that an engine's file has in one group, rotor or casing.

    `given[name]` is an array; a missing one raises InputError.

    Attributes
    ----------
    file : path of the file
    arrays : {name: array}, only those that the file has
    group : "rotor" or "casing"
    """

    file: str
    arrays: dict[str, Any]
    group: str = "rotor"

    def __contains__(self, name: str) -> bool:
        return name in self.arrays

    def __getitem__(self, name: str) -> Array:
        if name not in self.arrays and self.group == "casing":
            raise self.refusal(
                f"has no casing/{name}; the table of a round casing is "
                f"{', '.join(f'casing/{n}' for n in CASING if n != 'station')}"
            )
        if name not in self.arrays:
            raise self.refusal(
                f"has no rotor/{name}; it must hold rotor/mass, rotor/stiffness, "
                "rotor/tip_radial and rotor/tip_tangential, or rotor/omega, "
                "rotor/modal_tip_radial and rotor/modal_tip_tangential"
            )
        array: Array = self.arrays[name]
        return array

    def refusal(self, told: str) -> InputError:
        """Return the InputError "engine.file FILE TOLD", for a file that is refused.

        told : the rest of the message, such as "has no ..."
        """
        return InputError(f"engine.file {self.file} {told}")

    def wrong(self, name: str, allowed: str, got: object) -> InputError:
        """Return the InputError for an array that breaks a rule of the layout.

        Parameters
        ----------
        name : name of the array
        allowed : what it must do, as text after "must", such as "be finite"
        got : what the file has instead
        """
        return self.refusal(f"{self.group}/{name} must {allowed}, got {got}")


def missing_terms(there: Collection[str]) -> list[str]:
    """Return the names of the arrays of rotation terms that an engine's file lacks.

    The change of stiffness with speed is given by two parts, `stress_stiffness` and
    `softening`, or by the stiffness at two speeds. If a file has neither, the two parts
    are returned as missing.

    there : names of the arrays that the file has
    """
    names = ("coriolis", "centrifugal_load")
    way = AT_SPEEDS if any(name in there for name in AT_SPEEDS) else BY_PARTS
    return [name for name in (*names, *way) if name not in there]


def are_two_ways(there: Collection[str]) -> bool:
    """Return whether a file gives the stiffness at speed twice, in both allowed forms.

    These are `AT_SPEEDS` and `BY_PARTS`; a file may have only one of them.

    there : names of the arrays that the file has
    """
    return all(any(name in there for name in way) for way in (AT_SPEEDS, BY_PARTS))


def points_named(file: str) -> int:
    """Return the number of contact points per tip, n_c, that an engine's file has.

    Only shapes are read. It is 1 if the file has no such points, or cannot be read, so
    that its cases will fail.

    file : path of the file; "": no file
    """
    with suppress(WhirlError):
        return _points_named(file, content_digest(file)) if file else 1
    return 1


@lru_cache(maxsize=64)
def _points_named(file: str, _content: str) -> int:
    """Return the number of contact points per tip, n_c, in an engine's file; cached.

    Parameters
    ----------
    file : path of the file
    _content : digest of the file, so that a changed file is read again
    """
    import h5py

    with readable(f"engine.file {file}"), h5py.File(file, "r") as root:
        for name, axes in (("tip_radial", 1), ("modal_tip_radial", 2)):
            data = root.get(f"rotor/{name}")
            if isinstance(data, h5py.Dataset) and len(data.shape) > axes:
                return int(data.shape[1])
    return 1


def read_group(file: str, name: str) -> Given:
    """Return the arrays of the group "rotor" or "casing" in an engine's file, checked.

    All numbers are finite. Each axis has at most `LARGEST` entries (coordinates or
    modes), the file at most `scene.case_digest.MOST_BYTES`. Nothing is read from a
    larger file.

    Parameters
    ----------
    file : path of the file
    name : "rotor" or "casing"

    Raises
    ------
    MissingFileError
        where the file cannot be read as HDF5
    InputError
        where the file deviates from the layout, or refers to data in other files
    """
    import h5py

    given, datasets = Given(file, {}, name), KINDS[name]
    with readable(f"engine.file {file}"):
        check_bytes(file, check_regular(file))
        with h5py.File(file, "r") as root:
            _check_layout(given, root)
            group = root[name]
            found = {key: group.get(key) for key in datasets if key in group}
            for key, data in found.items():  # check all before reading one
                _check_kind(given, key, data, datasets[key])
            given.arrays.update({key: data[()] for key, data in found.items()})
    for key in found:
        given.arrays[key] = _checked(given, key, indices=datasets[key][1])
    return given


@contextmanager
def readable(
    what: str, failures: tuple[type[Exception], ...] = UNREADABLE
) -> Iterator[None]:
    """Turn an error of the block, which reads a damaged file, into a one-line message.

    Parameters
    ----------
    what : the file, for the message
    failures : classes of the exceptions that are turned

    Raises
    ------
    MissingFileError
        naming the file
    """
    try:
        yield
    except (InputError, MissingFileError):
        raise
    except failures as failed:
        said = getattr(failed, "strerror", None) or str(failed)
        reason = said.splitlines()[0] if said else type(failed).__name__
        raise MissingFileError(f"cannot read {what}: {reason}") from None


def _check_layout(given: Given, root: h5py.File) -> None:
    """Raise InputError if a file has names that the layout lacks, or links out of it.

    Links are checked before they are followed; a group may be a link, too.

    Parameters
    ----------
    given : the file and the group to be read, for messages
    root : root group of the file
    """
    import h5py

    _check_names(given, root, tuple(LAYOUT), "")
    for name, known in LAYOUT.items():
        body = root.get(name)
        if name in root and isinstance(body, h5py.Group):
            _check_names(given, body, known, f"{name}/")
    if not isinstance(root.get(given.group), h5py.Group):
        raise given.refusal(f"has no group {given.group}")


def _check_names(
    given: Given, group: h5py.Group, known: tuple[str, ...], path: str
) -> None:
    for name in group:
        if name not in known:
            told = name if isinstance(name, str) else ascii(name)  # not UTF-8
            hint = nearest(told, known) or f"; known: {', '.join(sorted(known))}"
            raise given.refusal(f"has an unknown {path}{one_line(told, 100)}{hint}")
        check_link(given, group, name, path)


def check_link(given: Given, group: h5py.Group, name: str, path: str) -> None:
    """Raise InputError if a link in an HDF5 file leads out of the file, or nowhere.

    Parameters
    ----------
    given : the file, for messages
    group : group that has the link
    name, path : name of the link; path of its group in the file
    """
    import h5py

    link = group.get(name, getlink=True)
    if isinstance(link, h5py.ExternalLink):
        raise given.refusal(
            f"has {path}{name} as a link to another file, {link.filename}: "
            "copy its target into this file"
        )
    if not isinstance(link, h5py.HardLink | h5py.SoftLink):
        raise given.refusal(f"has {path}{name} as a user-defined link")
    try:
        data = group[name]
    except (KeyError, RuntimeError, OSError):
        told = getattr(link, "path", "an object that cannot be opened")
        raise given.refusal(
            f"has {path}{name} as a link that leads nowhere: {told}"
        ) from None
    if isinstance(data, h5py.Dataset):
        _check_inside(given, data, path + name)


def _check_inside(given: Given, data: h5py.Dataset, name: str) -> None:
    """Raise InputError if the numbers of a dataset are stored outside its file.

    Parameters
    ----------
    given : the file, for messages
    data : the dataset
    name : its name
    """
    if data.external:
        raise given.refusal(
            f"keeps {name} in another file, {data.external[0][0]}: copy it to this file"
        )
    if data.is_virtual:
        raise given.refusal(
            f"has {name} as a virtual dataset, of other files: copy it to this file"
        )


def _check_kind(
    given: Given, name: str, data: Any, kind: tuple[tuple[int, ...], bool]
) -> None:
    """Raise InputError for an unread dataset of wrong type, dimensions or size.

    Parameters
    ----------
    given : the file, for messages
    name, data : name of the dataset, and the dataset
    kind : allowed numbers of dimensions, and whether the data must be indices
    """
    dimensions, indices = kind
    kinds = ("iu", "whole numbers") if indices else ("iuf", "numbers")
    kinds = ("SO", "text") if name in TEXTS else kinds
    widest = LONGEST_NAME if name in TEXTS else WIDEST
    shape = getattr(data, "shape", None)
    if shape is None:
        raise given.wrong(name, f"hold {kinds[1]}", "no array")
    if data.dtype.kind not in kinds[0] or data.dtype.itemsize > widest:
        raise given.wrong(name, f"hold {kinds[1]}", data.dtype)
    if len(shape) not in dimensions:
        told = " or ".join(map(str, dimensions))
        raise given.wrong(name, f"have {told} dimensions", len(shape))
    if max(shape) > LARGEST:
        raise given.wrong(name, f"have at most {LARGEST} entries along an axis", shape)
    if data.chunks:
        check_chunks(given, name, data)


def check_chunks(given: Given, name: str, data: h5py.Dataset) -> None:
    """Raise InputError for a dataset that would take very much memory to decompress.

    HDF5 reads whole chunks, which must have at most `CHUNK` bytes.

    Parameters
    ----------
    given : the file, for messages
    name, data : name of the dataset, and the dataset
    """
    size = int(np.prod(data.chunks, dtype=float)) * data.dtype.itemsize
    stored = 0

    def look(chunk: Any) -> None:
        nonlocal stored
        stored = max(stored, chunk.size)

    data.id.chunk_iter(look)
    if data.id.get_create_plist().get_nfilters():
        # Compressed noise is a little larger than its content, zeros a thousandth of
        # it.
        size = max(size, DEFLATE * stored if stored > size + size // 8 + 1024 else 0)
    if size > CHUNK:
        allowed = f"have chunks of at most {CHUNK >> 20} MiB"
        raise given.wrong(name, allowed, f"{size >> 20} MiB")


def _checked(given: Given, name: str, *, indices: bool) -> Array:
    """Return an array of an engine's file as float64, or int64 for indices.

    Infinite numbers and NaN are refused.

    Parameters
    ----------
    given : the arrays as read
    name : name of the array
    indices : whether it holds indices
    """
    array = given.arrays[name]
    if name in TEXTS:
        return _texts(given, name, array)
    if not np.isfinite(array).all():
        raise given.wrong(name, "be finite", array[~np.isfinite(array)][0])
    return np.asarray(array, dtype=np.int64 if indices else np.float64)


def _texts(given: Given, name: str, array: Array) -> Array:
    """Return an array of texts of an engine's file as str; refuse long texts.

    Parameters
    ----------
    given : the file, for messages
    name, array : name of the array, and the array of bytes in UTF-8
    """
    try:
        texts = [bytes(text).decode() for text in array]
    except (TypeError, UnicodeDecodeError):
        raise given.wrong(name, "hold text in UTF-8", str(array.dtype)) from None
    long = next((text for text in texts if len(text) > LONGEST_NAME), None)
    if long is not None:
        raise given.wrong(
            name, f"have at most {LONGEST_NAME} characters each", len(long)
        )
    return np.array(texts, dtype=str)


def wrong_name(names: tuple[str, ...]) -> str | None:
    """Return the first name of stress points that is empty, not printable or repeated.

    None if all names are allowed.
    """
    for place, name in enumerate(names):
        if not name.strip() or not name.isprintable() or name in names[:place]:
            return name
    return None
