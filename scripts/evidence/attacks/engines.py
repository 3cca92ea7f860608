"""Hostile engine files.

What escapes the file's own bytes (links, virtual and external storage), what does not
fit and what would take the machine's memory is refused in one line; what is accepted
gives the numbers of the file that was meant.
"""

from __future__ import annotations

import os
import shutil
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from attacks.damage import BYTES, PLACES, damage
from attacks.family import Chance, Family, Verdict, refusal
from attacks.process import fork, run
from attacks.specimens import quietly

BLADES = 6
SCENE = ("blades=6", "rotor.elements=2", "modes=12", "harmonics=6", "time_step=2e-6")
MATRICES = ("mass", "stiffness")
TIPS = ("tip_radial", "tip_tangential")
EITHER, REFUSED, SAME = (0, 2), (2,), (0,)
HOSTILE = "hostile.h5"


@dataclass(frozen=True)
class Engines:
    """Two right rotors, and what `model` says of one."""

    file: Path
    other: Path
    facts: str


def prepare(place: Path) -> Engines:
    """Export two rotors, and compile what a run of one needs."""
    place.mkdir(parents=True)
    files = place / "engine.h5", place / "other.h5"
    for file, spoke in zip(files, ("0.0513", "0.0600"), strict=True):
        sets = [w for s in (*SCENE, f"spoke_thickness={spoke}") for w in ("--set", s)]
        quietly(["export-model", str(file), *sets], place)
    # by the name of those made hostile: a rotor without one goes by its file's
    same = shutil.copyfile(files[0], place / HOSTILE)
    quietly(_words(same, "run"), place)
    return Engines(*files, run(_words(same), place).out)


def _words(file: Path, name: str = "model") -> list[str]:
    """Return the words of a command about an engine's file."""
    sets = [f"file={file}", f"blades={BLADES}", "harmonics=6", "time_step=2e-6"]
    sets += ["duration=1e-4", "interval=1e-4"] if name == "run" else []
    return [name, *(w for s in sets for w in ("--set", s)), "--json"]


# Changes of what a file holds: each is called with the rotor's group, the generator and
# a directory with other.h5 and engine.h5

Change = Callable[[Any, Chance, Path], object]


def _taken(group: Any, name: str) -> Any:
    """Take an array out of a group, to be put there in another way."""
    data = group[name][()]
    del group[name]
    return data


def _external_link(group: Any, chance: Chance, place: Path) -> None:
    name = chance.choice((*MATRICES, *TIPS))
    aim = chance.choice(["other.h5", "/etc/passwd", "nowhere.h5", "engine.h5", "pipe"])
    path = chance.choice([f"/rotor/{name}", "/", "/rotor"])
    _taken(group, name)
    group[name] = h5py.ExternalLink(str(place / aim), path)


def _linked_group(group: Any, chance: Chance, place: Path) -> None:
    root, names = group.file, ("other.h5", "engine.h5", "nowhere.h5")
    del root["rotor"]
    aims = [h5py.ExternalLink(str(place / name), "/rotor") for name in names]
    root["rotor"] = chance.choice([*aims, h5py.SoftLink("/rotor")])


def _circular_link(group: Any, chance: Chance, _: Path) -> None:
    name = chance.choice((*MATRICES, *TIPS))
    _taken(group, name)
    aims = (f"/rotor/{name}", "/rotor", "/nowhere", "/rotor/other")
    group[name] = h5py.SoftLink(chance.choice(aims))
    group["other"] = h5py.SoftLink(f"/rotor/{name}")


def _link_within(group: Any, chance: Chance, _: Path) -> None:
    name = chance.choice(MATRICES)
    group.file.move(f"/rotor/{name}", "/elsewhere")
    group[name] = h5py.SoftLink("/elsewhere")


def _external_storage(group: Any, chance: Chance, place: Path) -> None:
    name, raw = chance.choice(MATRICES), place / "raw.bin"
    data = _taken(group, name)
    raw.write_bytes(data.tobytes())
    aim = chance.choice([raw, raw, "/dev/zero", "/etc/passwd"])
    group.create_dataset(name, data.shape, "f8", external=[(str(aim), 0, data.nbytes)])


def _virtual_dataset(group: Any, chance: Chance, place: Path) -> None:
    name = chance.choice(MATRICES)
    group.file.copy(group[name], "hidden")
    shape = _taken(group, name).shape
    source = chance.choice([str(place / "other.h5"), ".", str(place / "nowhere.h5")])
    layout = h5py.VirtualLayout(shape, "f8")
    path = "hidden" if source == "." else f"rotor/{name}"
    layout[:] = h5py.VirtualSource(source, path, shape)
    group.create_virtual_dataset(name, layout)


def _bomb(group: Any, chance: Chance, _: Path) -> None:
    """Put an array that unpacks to far more than the file has, of zeros or ones."""
    name, side = chance.choice(MATRICES), chance.choice([8000, 60_000, 200_000])
    _taken(group, name)
    more = {"chunks": (4000, 4000), "compression": "gzip"}
    data = group.create_dataset(name, (side, side), "f8", fillvalue=1.0, **more)
    if side == 8000:  # all chunks are there: 500 MB
        zeros = zlib.compress(bytes(8 * 4000**2), 9)
        for corner in ((0, 0), (0, 4000), (4000, 0), (4000, 4000)):
            data.id.write_direct_chunk(corner, zeros)


def _huge_shape(group: Any, chance: Chance, _: Path) -> None:
    name = chance.choice([*MATRICES, *TIPS, "damping"])
    group.pop(name, None)
    shape = chance.choice([(10**6, 10**6), (2**40,), (2**32, 2**31), (1, 10**12)])
    chunks = tuple(min(n, 1000) for n in shape)
    group.create_dataset(name, shape, chance.choice(["f8", "i8", "i1"]), chunks=chunks)


def _wrong_number(group: Any, chance: Chance, _: Path) -> None:
    data = group[chance.choice(MATRICES)]
    matrix = data[()]
    i, j = chance.sample(range(len(matrix)), 2)
    kind = chance.choice(["not finite", "asymmetric", "indefinite"])
    if kind == "not finite":
        matrix[i, j] = matrix[j, i] = chance.choice([np.nan, np.inf, -np.inf])
    elif kind == "asymmetric":
        matrix[i, j] += chance.choice([1.0, 1e-3]) * np.abs(matrix).max()
    data[...] = -matrix if kind == "indefinite" else matrix


def _wrong_index(group: Any, chance: Chance, _: Path) -> None:
    data = group[chance.choice((*TIPS, "centre"))]
    rows = data[()]
    rows[chance.randrange(len(rows))] = chance.choice([-1, 10**6, 2**62, -5, -(2**62)])
    data[...] = rows


def _wrong_array(group: Any, chance: Chance, _: Path) -> None:
    name = chance.choice((*MATRICES, *TIPS))
    data = _taken(group, name)
    makes: dict[str, Callable[[], object]] = {
        "missing": bool, "group": lambda: group.create_group(name),
        "text": lambda: group.create_dataset(name, data=["x"] * 4),
    }  # fmt: skip
    others = (*(data.astype(kind) for kind in ("bool", "c16", "S8")), data[:-1],
              data.ravel()[:0], data[None], data.ravel()[0], h5py.Empty("f8"),
              np.zeros(3, "f8, i4"))  # fmt: skip
    kind = chance.choice([*makes, "other", "other"])
    if kind in makes:
        makes[kind]()
    else:
        group[name] = chance.choice(others)


def _contradiction(group: Any, chance: Chance, _: Path) -> None:
    count = len(group["omega"]) if "omega" in group else 4
    for name in ("modal_tip_radial", "modal_tip_tangential"):
        group.pop(name, None)
        group[name] = np.array([[chance.gauss(0, 1) for _ in range(count)]] * BLADES)


def _compressed(group: Any, chance: Chance, _: Path) -> None:
    name = chance.choice(MATRICES)
    group.create_dataset(name, data=_taken(group, name), chunks=True, fletcher32=True,
                         compression="gzip", shuffle=chance.random() < 0.5)  # fmt: skip


CHANGES: dict[Change, tuple[int, ...]] = {
    **dict.fromkeys(
        (_external_link, _linked_group, _circular_link, _external_storage,
         _virtual_dataset, _bomb, _huge_shape, _wrong_number, _wrong_index,
         _wrong_array, _contradiction), REFUSED,
    ), _link_within: EITHER, _compressed: SAME,
}  # fmt: skip


def attempt(shared: Engines, chance: Chance, place: Path) -> Verdict:
    """Make one hostile file and ask about it."""
    for source in (shared.file, shared.other):
        shutil.copyfile(source, place / source.name)
    os.mkfifo(place / "pipe")
    file = shutil.copyfile(shared.file, place / HOSTILE)
    sort = chance.weighted({"content": 12, "bytes": 4, "no file": 2})
    if sort == "content":
        what, allowed = _changed(file, chance, place)
    else:
        what = chance.choice(BYTES if sort == "bytes" else PLACES)
        damage(file, what, chance, [file])
        allowed = EITHER if sort == "bytes" else REFUSED
    name = chance.weighted({"model": 3, "run": 1})
    ended = run(_words(file, name), place)
    wrong = refusal(ended, allowed)
    if allowed == SAME and name == "model" and ended.out != shared.facts:
        wrong = wrong or "another model than the file's"
    return Verdict(f"{sort}: {what}, {name}", wrong)


def _changed(file: Path, chance: Chance, place: Path) -> tuple[str, tuple[int, ...]]:
    """Change what a file holds, in a fork: h5py may die of it."""
    change, allowed = chance.choice(list(CHANGES.items()))

    def action() -> int:
        with h5py.File(file, "r+") as root:
            change(root["rotor"], chance, place)
        return 0

    ended = fork(action, place, "made").wait()
    name = change.__name__.strip("_").replace("_", " ")
    return (name, allowed) if not ended.code else (f"not made: {ended.last}", EITHER)


FAMILIES = {"engines": Family("hostile engine files", 400, prepare, attempt)}
