"""Hostile engine files, and engine files that change under a campaign.

What escapes the file's own bytes (links, virtual and external storage), what does not
fit and what would take the machine's memory is refused in one line; what is accepted
gives the numbers of the file that was meant.
"""

from __future__ import annotations

import gzip
import os
import random
import shutil
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from attacks.apart import command, fork, run
from attacks.family import Verdict, fault, refusal
from attacks.specimens import Table, differs, quietly, table, without_maps

BLADES = 6
SCENE = ("blades=6", "rotor.elements=2", "modes=12", "harmonics=6", "time_step=2e-6")
CAMPAIGN = """
scene = {{duration = {duration}}}
solver = {{time_step = 2e-6}}
output = {{interval = 1e-4}}
engine = {{file = "{file}", rotor = {{blades = 6}}, casing = {{harmonics = 6}}}}
sweep = {{speed = {{start = 300, stop = 500, num = 12}}}}
"""
MATRICES = ("mass", "stiffness")
INDICES = ("tip_radial", "tip_tangential", "centre")
EITHER, REFUSED, SAME = "either", "refused", "same"
Change = Callable[[Any, random.Random, Path], None]


@dataclass(frozen=True)
class Engines:
    """Files that are right, what they give, and a campaign with one of them.

    Attributes
    ----------
    file, other : two rotors
    facts : what `model --json` prints of the first
    toml : of a campaign with a copy of the first, told where it lies
    truths : of that campaign, with one and with the other
    seconds : that it took
    """

    file: Path
    other: Path
    facts: str
    text: str
    truths: tuple[Table, Table]
    seconds: float


def prepare(place: Path) -> Engines:
    """Export two rotors, and compute a campaign with one of them."""
    place.mkdir(parents=True)
    files = place / "engine.h5", place / "other.h5"
    for file, spoke in zip(files, ("0.0513", "0.0600"), strict=True):
        sets = [w for s in (*SCENE, f"spoke_thickness={spoke}") for w in ("--set", s)]
        if quietly(["export-model", str(file), *sets], place):
            raise RuntimeError(place)
    facts = run(asked(files[0]), place).out
    if not facts:
        raise RuntimeError(place)
    without_maps()
    text = CAMPAIGN.format(file="{file}", duration=4e-3)
    truths = _truth(text, files[0], place), _truth(text, files[1], place)
    begun = time.monotonic()
    toml = files[0].with_suffix(".toml")
    run(["campaign", toml, "--out", place / "timed"], place)
    return Engines(*files, facts, text, truths, time.monotonic() - begun)


def _truth(text: str, file: Path, place: Path) -> Table:
    """Return what a campaign with an engine's file gives, undisturbed."""
    toml, out = file.with_suffix(".toml"), file.with_suffix(".out")
    toml.write_text(text.replace("{file}", str(file)))
    if quietly(["campaign", str(toml), "--out", str(out)], place):
        raise RuntimeError(place)
    return table(out)


def asked(file: Path, command_name: str = "model") -> list[str]:
    """Return the words of a command about an engine's file."""
    sets = [f"file={file}", f"blades={BLADES}", "harmonics=6", "time_step=2e-6"]
    if command_name == "run":
        sets += ["duration=1e-4", "interval=1e-4"]
    words = [w for s in sets for w in ("--set", s)]
    return [command_name, *words, "--json"]


def _pick(group: Any, chance: random.Random) -> str:
    return chance.choice([n for n in (*MATRICES, *INDICES) if n in group])


def _external_link(group: Any, chance: random.Random, place: Path) -> None:
    import h5py

    name = _pick(group, chance)
    aim = chance.choice(["other.h5", "/etc/passwd", "nowhere.h5", "engine.h5", "pipe"])
    path = chance.choice([f"/rotor/{name}", "/", "/rotor"])
    del group[name]
    group[name] = h5py.ExternalLink(str(place / aim), path)


def _external_group(group: Any, chance: random.Random, place: Path) -> None:
    import h5py

    root = group.file
    del root["rotor"]
    aim = chance.choice(["other.h5", "engine.h5", "nowhere.h5"])
    root["rotor"] = h5py.ExternalLink(str(place / aim), "/rotor")


def _external_storage(group: Any, chance: random.Random, place: Path) -> None:
    name = chance.choice(MATRICES)
    data = group[name][()]
    raw = place / "raw.bin"
    raw.write_bytes(data.tobytes())
    aim = chance.choice([raw, raw, Path("/dev/zero"), Path("/etc/passwd")])
    del group[name]
    group.create_dataset(name, data.shape, "f8", external=[(str(aim), 0, data.nbytes)])


def _virtual(group: Any, chance: random.Random, place: Path) -> None:
    import h5py

    name = chance.choice(MATRICES)
    shape = group[name].shape
    layout = h5py.VirtualLayout(shape, "f8")
    source = chance.choice([str(place / "other.h5"), ".", str(place / "nowhere.h5")])
    layout[:] = h5py.VirtualSource(source, f"rotor/{name}", shape)
    if source == ".":
        group.file.copy(group[name], "hidden")
        layout[:] = h5py.VirtualSource(source, "hidden", shape)
    del group[name]
    group.create_virtual_dataset(name, layout)


def _bomb(group: Any, chance: random.Random, _: Path) -> None:
    name, side = chance.choice(MATRICES), chance.choice([15_000, 60_000, 200_000])
    del group[name]
    group.create_dataset(name, (side, side), "f8", chunks=(1000, 1000),
                         compression="gzip",
                         fillvalue=chance.choice([0.0, 1.0]))  # fmt: skip
    if chance.random() < 0.5:
        group[name][:1000, :1000] = 0.0


def _huge(group: Any, chance: random.Random, _: Path) -> None:
    name = chance.choice([*MATRICES, *INDICES, "damping"])
    if name in group:
        del group[name]
    shape = chance.choice([(10**6, 10**6), (2**40,), (2**32, 2**31), (1, 10**12)])
    chunks = tuple(min(n, 1000) for n in shape)
    group.create_dataset(name, shape, chance.choice(["f8", "i8", "i1"]), chunks=chunks)


def _compact_bomb(group: Any, chance: random.Random, _: Path) -> None:
    """All chunks are there, each of zeros: a few kB that unpack to 500 MB."""
    name = chance.choice(MATRICES)
    del group[name]
    data = group.create_dataset(name, (8000, 8000), "f8", chunks=(4000, 4000),
                                compression="gzip")  # fmt: skip
    zeros = gzip.zlib.compress(b"\0" * (8 * 4000 * 4000), 9)
    for i in range(0, 8000, 4000):
        for j in range(0, 8000, 4000):
            data.id.write_direct_chunk((i, j), zeros)


def _number(group: Any, chance: random.Random, _: Path) -> None:
    name = chance.choice(MATRICES)
    data = group[name][()]
    i, j = (chance.randrange(len(data)) for _ in range(2))
    data[i, j] = data[j, i] = chance.choice([np.nan, np.inf, -np.inf])
    group[name][...] = data


def _asymmetric(group: Any, chance: random.Random, _: Path) -> None:
    name = chance.choice(MATRICES)
    data = group[name][()]
    i, j = chance.sample(range(len(data)), 2)
    data[i, j] += chance.choice([1.0, 1e-3]) * np.abs(data).max()
    group[name][...] = data


def _indefinite(group: Any, chance: random.Random, _: Path) -> None:
    group[chance.choice(MATRICES)][...] *= -1.0


def _shape(group: Any, chance: random.Random, _: Path) -> None:
    name = chance.choice([*MATRICES, "tip_radial", "tip_tangential"])
    data = group[name][()]
    shapes = [data[:-1], data.ravel()[:0], data[None], data.reshape(-1)[0]]
    new = chance.choice(shapes)
    del group[name]
    group[name] = new


def _kind(group: Any, chance: random.Random, _: Path) -> None:
    name = chance.choice([*MATRICES, "tip_radial", "tip_tangential"])
    data = group[name][()]
    del group[name]
    kind = chance.choice(["c16", "S8", "bool", "vlen", "compound", "group", "null"])
    if kind == "vlen":
        group.create_dataset(name, data=["x"] * 4, dtype=_text())
    elif kind == "compound":
        group.create_dataset(name, data=np.zeros(3, [("a", "f8"), ("b", "i4")]))
    elif kind == "group":
        group.create_group(name)
    elif kind == "null":
        import h5py

        group[name] = h5py.Empty("f8")
    else:
        group.create_dataset(name, data=data.astype(kind))


def _text() -> Any:
    import h5py

    return h5py.string_dtype()


def _index(group: Any, chance: random.Random, _: Path) -> None:
    name = chance.choice(INDICES)
    data = group[name][()]
    data[chance.randrange(len(data))] = chance.choice(
        [-1, 10**6, 2**62, data[0] if len(set(data)) > 1 else -5, -(2**62)]
    )
    if len(set(data)) == len(data):
        data[-1] = -1
    group[name][...] = data


def _loop(group: Any, chance: random.Random, _: Path) -> None:
    import h5py

    name = _pick(group, chance)
    del group[name]
    aims = [f"/rotor/{name}", "/rotor", "/nowhere", "/rotor/other"]
    group[name] = h5py.SoftLink(chance.choice(aims))
    group["other"] = h5py.SoftLink(f"/rotor/{name}")


def _root_loop(group: Any, _: random.Random, __: Path) -> None:
    import h5py

    root = group.file
    del root["rotor"]
    root["rotor"] = h5py.SoftLink("/rotor")


def _missing(group: Any, chance: random.Random, _: Path) -> None:
    del group[chance.choice([*MATRICES, "tip_radial", "tip_tangential"])]


def _contradiction(group: Any, chance: random.Random, _: Path) -> None:
    count = len(group["omega"]) if "omega" in group else 4
    for name, rows in (("modal_tip_radial", BLADES), ("modal_tip_tangential", BLADES)):
        if name in group:
            del group[name]
        group[name] = np.array([[chance.gauss(0, 1) for _ in range(count)]] * rows)


def _inner_link(group: Any, chance: random.Random, _: Path) -> None:
    import h5py

    name = chance.choice(MATRICES)
    group.file.move(f"/rotor/{name}", "/elsewhere")
    group[name] = h5py.SoftLink("/elsewhere")


def _packed(group: Any, chance: random.Random, _: Path) -> None:
    name = chance.choice(MATRICES)
    data = group[name][()]
    del group[name]
    group.create_dataset(name, data=data, chunks=True, compression="gzip",
                         shuffle=chance.random() < 0.5, fletcher32=True)  # fmt: skip


CHANGES: dict[str, tuple[Change, str, int]] = {
    "external link": (_external_link, REFUSED, 4),
    "group by external link": (_external_group, REFUSED, 2),
    "external storage": (_external_storage, REFUSED, 4),
    "virtual dataset": (_virtual, REFUSED, 4),
    "sparse bomb": (_bomb, REFUSED, 3),
    "huge shape": (_huge, REFUSED, 3),
    "gzip bomb": (_compact_bomb, REFUSED, 1),
    "not finite": (_number, REFUSED, 2),
    "asymmetric": (_asymmetric, REFUSED, 2),
    "indefinite": (_indefinite, REFUSED, 2),
    "wrong shape": (_shape, REFUSED, 4),
    "wrong type": (_kind, REFUSED, 4),
    "wrong index": (_index, REFUSED, 3),
    "circular link": (_loop, REFUSED, 3),
    "circular group": (_root_loop, REFUSED, 1),
    "array missing": (_missing, REFUSED, 2),
    "contradiction": (_contradiction, REFUSED, 2),
    "link within": (_inner_link, EITHER, 1),
    "compressed": (_packed, SAME, 1),
}


def _changed_bytes(path: Path, chance: random.Random) -> str:
    data = bytearray(path.read_bytes())
    kind = chance.choice(["flipped", "flipped", "head flipped", "cut", "emptied",
                          "overwritten", "more at its end"])  # fmt: skip
    reach = min(len(data), 4096) if kind == "head flipped" else len(data)
    place = chance.randrange(reach)
    if "flipped" in kind:
        for _ in range(chance.choice([1, 2, 8, 64])):
            data[chance.randrange(reach)] ^= 1 << chance.randrange(8)
    elif kind == "cut":
        del data[place:]
    elif kind == "emptied":
        data = bytearray()
    elif kind == "overwritten":
        data[place : place + 256] = chance.randbytes(256)
    else:
        data += chance.randbytes(1000)
    path.write_bytes(data)
    return kind


def _no_file(path: Path, chance: random.Random) -> str:
    """Put something else than a file in its place."""
    path.unlink()
    kind = chance.choice(["FIFO", "directory", "loop", "text", "zero", "full", "null",
                          "memory", "dangling", "itself"])  # fmt: skip
    links = {"loop": path.name, "zero": "/dev/zero", "full": "/dev/full",
             "null": "/dev/null", "memory": "/proc/self/mem", "dangling": "nowhere",
             "itself": "/proc/self/fd/0"}  # fmt: skip
    if kind == "FIFO":
        os.mkfifo(path)
    elif kind == "directory":
        path.mkdir()
    elif kind == "text":
        path.write_text("[scene]\nspeed = 1\n" * 100)
    else:
        path.symlink_to(links[kind])
    return kind


def attempt(shared: Engines, chance: random.Random, place: Path) -> Verdict:
    """Make one hostile file and ask about it; or change it under a campaign."""
    for source in (shared.file, shared.other):
        shutil.copyfile(source, place / source.name)
    os.mkfifo(place / "pipe")
    file = place / "hostile.h5"
    shutil.copyfile(shared.file, file)
    sort = chance.choices(["content", "bytes", "no file", "meanwhile"], [12, 4, 2, 2])[
        0
    ]
    if sort == "meanwhile":
        return _meanwhile(shared, chance, place)
    allowed = REFUSED
    if sort == "bytes":
        what, allowed = _changed_bytes(file, chance), EITHER
    elif sort == "no file":
        what = _no_file(file, chance)
    else:
        what = chance.choices(list(CHANGES), [w for _, _, w in CHANGES.values()])[0]
        change, allowed, _ = CHANGES[what]
        made = fork(lambda: _change(file, change, chance, place), place, "made").wait()
        if made.code:
            return Verdict(what, skipped=f"h5py cannot make it: {made.last}")
    name = chance.choices(["model", "run"], [3, 1])[0]
    ended = run(asked(file, name), place)
    wrong = refusal(ended, (2,) if allowed == REFUSED else (0, 2))
    if allowed == SAME and name == "model" and ended.out != shared.facts:
        wrong = wrong or "another model than the file's"
    return Verdict(f"{sort}: {what}, {name}", wrong)


def _change(file: Path, change: Change, chance: random.Random, place: Path) -> int:
    import h5py

    with h5py.File(file, "r+") as root:
        change(root["rotor"], chance, place)
    return 0


def _meanwhile(shared: Engines, chance: random.Random, place: Path) -> Verdict:
    """Change an engine's file while a campaign computes, or between two runs of it."""
    file, toml, out = place / "engine.h5", place / "campaign.toml", place / "out"
    toml.write_text(shared.text.replace("{file}", str(file)))
    words = ["campaign", str(toml), "--out", str(out)]
    child = fork(command(words), place)
    time.sleep(chance.uniform(0.0, 1.2 * shared.seconds))
    killed = chance.random() < 0.3
    if killed:
        child.kill()
        child.wait()
    _replace(file, shared.other, chance)
    if killed:
        child = fork(command(words), place)
    ended = child.wait()
    wrong = fault(ended, (0, 1, 2))
    if not wrong and ended.code == 0:
        wrong = _one_of(out, shared, place)
    shutil.copyfile(shared.file, file)
    if not wrong:
        wrong = _completed(words, out, shared, place)
    return Verdict(f"meanwhile: {'between' if killed else 'while it computes'}", wrong)


def _replace(file: Path, other: Path, chance: random.Random) -> None:
    kind = chance.choice(["renamed", "overwritten", "gone", "cut"])
    if kind == "renamed":
        new = file.with_name("new.h5")
        shutil.copyfile(other, new)
        new.replace(file)
    elif kind == "overwritten":
        shutil.copyfile(other, file)
    elif kind == "gone":
        file.unlink()
    else:
        os.truncate(file, 3000)


def _one_of(out: Path, shared: Engines, place: Path) -> str:
    """Return what differs: the campaign is the first file's alone, or the second's."""
    one, other = (differs(out, truth, place) for truth in shared.truths)
    return f"exit 0, but {one}" if one and other else ""


def _completed(words: list[str], out: Path, shared: Engines, place: Path) -> str:
    """Give the command again with the right file: it completes, or is another's."""
    ended = run([*words, "--retry", "failed"], place)
    wrong = fault(ended, (0, 2))
    if wrong:
        return f"with the file put back: {wrong}"
    if ended.code == 2:  # begun with the other file: said so
        return "" if "SHA-256" in ended.err else f"with the file put back: {ended.last}"
    return differs(out, shared.truths[0], place)
