"""Hostile engine files, and engine files that change under a campaign.

What escapes the file's own bytes (links, virtual and external storage), what does not
fit and what would take the machine's memory is refused in one line; what is accepted
gives the numbers of the file that was meant.
"""

from __future__ import annotations

import gzip
import os
import shutil
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from attacks.damage import BYTES, PLACES, damage
from attacks.family import Chance, Family, Verdict, fault, refusal
from attacks.process import command, fork, run
from attacks.specimens import Table, differs, quietly, table, without_maps

BLADES = 6
SCENE = ("blades=6", "rotor.elements=2", "modes=12", "harmonics=6", "time_step=2e-6")
CAMPAIGN = """
scene = {{duration = 4e-3}}
solver = {{time_step = 2e-6}}
output = {{interval = 1e-4}}
engine = {{file = "{}", rotor = {{blades = 6}}, casing = {{harmonics = 6}}}}
sweep = {{speed = {{start = 300, stop = 500, num = 12}}}}
"""
MATRICES = ("mass", "stiffness")
TIPS = ("tip_radial", "tip_tangential")
EITHER, REFUSED, SAME = (0, 2), (2,), (0,)
HOSTILE = "hostile.h5"


@dataclass(frozen=True)
class Engines:
    """Two right rotors, what `model` says of one, a campaign's truths with either."""

    file: Path
    other: Path
    facts: str
    truths: tuple[Table, Table]
    seconds: float


def prepare(place: Path) -> Engines:
    """Export two rotors, and compute a campaign with each."""
    place.mkdir(parents=True)
    without_maps()
    files, truths, seconds = (place / "engine.h5", place / "other.h5"), [], 0.0
    for file, spoke in zip(files, ("0.0513", "0.0600"), strict=True):
        sets = [w for s in (*SCENE, f"spoke_thickness={spoke}") for w in ("--set", s)]
        quietly(["export-model", str(file), *sets], place)
        toml, out = file.with_suffix(".toml"), file.with_suffix(".out")
        toml.write_text(CAMPAIGN.format(file))
        begun = time.monotonic()
        quietly(["campaign", str(toml), "--out", str(out)], place)
        seconds = time.monotonic() - begun
        truths.append(table(out))
    # by the name of those made hostile: a rotor without one goes by its file's
    facts = run(_words(shutil.copyfile(files[0], place / HOSTILE)), place).out
    return Engines(*files, facts, (truths[0], truths[1]), seconds)


def _words(file: Path, name: str = "model") -> list[str]:
    """Return the words of a command about an engine's file."""
    sets = [f"file={file}", f"blades={BLADES}", "harmonics=6", "time_step=2e-6"]
    sets += ["duration=1e-4", "interval=1e-4"] if name == "run" else []
    return [name, *(w for s in sets for w in ("--set", s)), "--json"]


# Changes of what a file holds: each is called with the rotor's group, the generator and
# a directory with other.h5 and engine.h5

Change = Callable[[Any, Chance, Path], None]
CHANGES: dict[str, tuple[Change, tuple[int, ...]]] = {}


def _change(name: str, allowed: tuple[int, ...] = REFUSED) -> Callable[[Change], None]:
    def keep(change: Change) -> None:
        CHANGES[name] = change, allowed

    return keep


def _taken(group: Any, name: str) -> Any:
    """Take an array out of a group, to be put there in another way."""
    data = group[name][()]
    del group[name]
    return data


@_change("external link")
def _(group: Any, chance: Chance, place: Path) -> None:
    name = chance.choice((*MATRICES, *TIPS))
    aim = chance.choice(["other.h5", "/etc/passwd", "nowhere.h5", "engine.h5", "pipe"])
    path = chance.choice([f"/rotor/{name}", "/", "/rotor"])
    _taken(group, name)
    group[name] = h5py.ExternalLink(str(place / aim), path)


@_change("group by a link")
def _(group: Any, chance: Chance, place: Path) -> None:
    root = group.file
    del root["rotor"]
    aims = [h5py.ExternalLink(str(place / name), "/rotor")
            for name in ("other.h5", "engine.h5", "nowhere.h5")]  # fmt: skip
    root["rotor"] = chance.choice([*aims, h5py.SoftLink("/rotor")])


@_change("external storage")
def _(group: Any, chance: Chance, place: Path) -> None:
    name, raw = chance.choice(MATRICES), place / "raw.bin"
    data = _taken(group, name)
    raw.write_bytes(data.tobytes())
    aim = chance.choice([raw, raw, "/dev/zero", "/etc/passwd"])
    group.create_dataset(name, data.shape, "f8", external=[(str(aim), 0, data.nbytes)])


@_change("virtual dataset")
def _(group: Any, chance: Chance, place: Path) -> None:
    name = chance.choice(MATRICES)
    group.file.copy(group[name], "hidden")
    shape = _taken(group, name).shape
    source = chance.choice([str(place / "other.h5"), ".", str(place / "nowhere.h5")])
    layout = h5py.VirtualLayout(shape, "f8")
    path = "hidden" if source == "." else f"rotor/{name}"
    layout[:] = h5py.VirtualSource(source, path, shape)
    group.create_virtual_dataset(name, layout)


@_change("sparse bomb")
def _(group: Any, chance: Chance, _: Path) -> None:
    name, side = chance.choice(MATRICES), chance.choice([15_000, 60_000, 200_000])
    _taken(group, name)
    data = group.create_dataset(name, (side, side), "f8", chunks=(1000, 1000),
                                compression="gzip",
                                fillvalue=chance.choice([0.0, 1.0]))  # fmt: skip
    if chance.random() < 0.5:
        data[:1000, :1000] = 0.0


@_change("gzip bomb")
def _(group: Any, chance: Chance, _: Path) -> None:
    """All chunks are there, each of zeros: a few kB that unpack to 500 MB."""
    name, zeros = chance.choice(MATRICES), gzip.zlib.compress(bytes(8 * 4000**2), 9)
    _taken(group, name)
    data = group.create_dataset(name, (8000, 8000), "f8", chunks=(4000, 4000),
                                compression="gzip")  # fmt: skip
    for corner in ((0, 0), (0, 4000), (4000, 0), (4000, 4000)):
        data.id.write_direct_chunk(corner, zeros)


@_change("huge shape")
def _(group: Any, chance: Chance, _: Path) -> None:
    name = chance.choice([*MATRICES, *TIPS, "damping"])
    if name in group:
        _taken(group, name)
    shape = chance.choice([(10**6, 10**6), (2**40,), (2**32, 2**31), (1, 10**12)])
    chunks = tuple(min(n, 1000) for n in shape)
    group.create_dataset(name, shape, chance.choice(["f8", "i8", "i1"]), chunks=chunks)


@_change("wrong number")
def _(group: Any, chance: Chance, _: Path) -> None:
    data = group[chance.choice(MATRICES)]
    matrix = data[()]
    i, j = chance.sample(range(len(matrix)), 2)
    kind = chance.choice(["not finite", "asymmetric", "indefinite"])
    if kind == "not finite":
        matrix[i, j] = matrix[j, i] = chance.choice([np.nan, np.inf, -np.inf])
    elif kind == "asymmetric":
        matrix[i, j] += chance.choice([1.0, 1e-3]) * np.abs(matrix).max()
    else:
        matrix *= -1.0
    data[...] = matrix


@_change("wrong index")
def _(group: Any, chance: Chance, _: Path) -> None:
    data = group[chance.choice((*TIPS, "centre"))]
    rows = data[()]
    rows[chance.randrange(len(rows))] = chance.choice([-1, 10**6, 2**62, -5, -(2**62)])
    data[...] = rows


@_change("wrong shape or type")
def _(group: Any, chance: Chance, _: Path) -> None:
    name = chance.choice((*MATRICES, *TIPS))
    data = _taken(group, name)
    kind = chance.choice(["missing", "group", "vlen", "bool", "c16", "S8", "other"])
    if kind == "group":
        group.create_group(name)
    elif kind == "vlen":
        group.create_dataset(name, data=["x"] * 4, dtype=h5py.string_dtype())
    elif kind == "other":
        others = (data[:-1], data.ravel()[:0], data[None], data.ravel()[0],
                  h5py.Empty("f8"), np.zeros(3, "f8, i4"))  # fmt: skip
        group[name] = chance.choice(others)
    elif kind != "missing":
        group.create_dataset(name, data=data.astype(kind))


@_change("circular link")
def _(group: Any, chance: Chance, _: Path) -> None:
    name = chance.choice((*MATRICES, *TIPS))
    _taken(group, name)
    aims = (f"/rotor/{name}", "/rotor", "/nowhere", "/rotor/other")
    group[name] = h5py.SoftLink(chance.choice(aims))
    group["other"] = h5py.SoftLink(f"/rotor/{name}")


@_change("contradiction")
def _(group: Any, chance: Chance, _: Path) -> None:
    count = len(group["omega"]) if "omega" in group else 4
    for name in ("modal_tip_radial", "modal_tip_tangential"):
        group.pop(name, None)
        group[name] = np.array([[chance.gauss(0, 1) for _ in range(count)]] * BLADES)


@_change("link within", EITHER)
def _(group: Any, chance: Chance, _: Path) -> None:
    name = chance.choice(MATRICES)
    group.file.move(f"/rotor/{name}", "/elsewhere")
    group[name] = h5py.SoftLink("/elsewhere")


@_change("compressed", SAME)
def _(group: Any, chance: Chance, _: Path) -> None:
    name = chance.choice(MATRICES)
    group.create_dataset(name, data=_taken(group, name), chunks=True, fletcher32=True,
                         compression="gzip", shuffle=chance.random() < 0.5)  # fmt: skip


def _content(file: Path, chance: Chance, place: Path) -> tuple[str, tuple[int, ...]]:
    """Change what a file holds, in a fork: h5py may die of it."""
    name = chance.choice(list(CHANGES))
    change, allowed = CHANGES[name]

    def action() -> int:
        with h5py.File(file, "r+") as root:
            change(root["rotor"], chance, place)
        return 0

    ended = fork(action, place, "made").wait()
    return (name, allowed) if not ended.code else (f"not made: {ended.last}", EITHER)


def _bytes(file: Path, chance: Chance, _: Path) -> tuple[str, tuple[int, ...]]:
    """Change the bytes of a file."""
    kind = chance.choice(BYTES)
    damage(file, kind, chance, [file])
    return kind, EITHER


def _no_file(file: Path, chance: Chance, _: Path) -> tuple[str, tuple[int, ...]]:
    """Put something else than an engine in a file's place."""
    kind = chance.choice([*PLACES, "text"])
    if kind == "text":
        file.write_text("[scene]\nspeed = 1\n" * 100)
    else:
        damage(file, kind, chance, [file])
    return kind, REFUSED


def attempt(shared: Engines, chance: Chance, place: Path) -> Verdict:
    """Make one hostile file and ask about it; or change it under a campaign."""
    sort = chance.weighted({_content: 12, _bytes: 4, _no_file: 2, _meanwhile: 2})
    for source in (shared.file, shared.other):
        shutil.copyfile(source, place / source.name)
    if sort is _meanwhile:
        return _meanwhile(shared, chance, place)
    os.mkfifo(place / "pipe")
    file = shutil.copyfile(shared.file, place / HOSTILE)
    what, allowed = sort(file, chance, place)
    name = chance.weighted({"model": 3, "run": 1})
    ended = run(_words(file, name), place)
    wrong = refusal(ended, allowed)
    if allowed == SAME and name == "model" and ended.out != shared.facts:
        wrong = wrong or "another model than the file's"
    kind = sort.__name__.strip("_").replace("_", " ")
    return Verdict(f"{kind}: {what}, {name}", wrong)


def _meanwhile(shared: Engines, chance: Chance, place: Path) -> Verdict:
    """Change an engine's file while a campaign computes, or between two runs of it."""
    file, toml, out = place / "engine.h5", place / "campaign.toml", place / "out"
    toml.write_text(CAMPAIGN.format(file))
    words = ["campaign", str(toml), "--out", str(out)]
    child = fork(command(words), place)
    time.sleep(chance.uniform(0.0, 1.2 * shared.seconds))
    killed = chance.random() < 0.3
    if killed:
        child.kill()
        child.wait()
    _replace(file, shared.other, chance)
    ended = (fork(command(words), place) if killed else child).wait()
    wrong = fault(ended, (0, 1, 2))
    if not wrong and ended.code == 0:  # of the first file alone, or of the second
        wrong, *others = (differs(out, truth, place) for truth in shared.truths)
        wrong = f"exit 0, but {wrong}" if all((wrong, *others)) else ""
    shutil.copyfile(shared.file, file)
    what = f"meanwhile: {'between' if killed else 'while it computes'}"
    return Verdict(what, wrong or _completed(words, out, shared, place))


def _replace(file: Path, other: Path, chance: Chance) -> None:
    kind = chance.choice(["renamed", "overwritten", "gone", "cut"])
    if kind == "renamed":
        shutil.copyfile(other, file.with_name("new.h5")).replace(file)
    elif kind == "overwritten":
        shutil.copyfile(other, file)
    else:
        damage(file, {"gone": "deleted", "cut": "cut"}[kind], chance, [file])


def _completed(words: list[str], out: Path, shared: Engines, place: Path) -> str:
    """Give the command again with the right file: it completes, or is another's."""
    ended = run([*words, "--retry", "failed"], place)
    wrong = fault(ended, (0, 2))
    if not wrong and ended.code and "SHA-256" not in ended.err:
        wrong = f"not because of the other file: {ended.last}"
    if wrong or ended.code:
        return f"with the file put back: {wrong}" if wrong else ""
    return differs(out, shared.truths[0], place)


FAMILIES = {"engines": Family("hostile engine files", 400, prepare, attempt)}
