"""Damaged campaign directories: any file cut, flipped, swapped or made something else.

Every command must end, with a right exit code and no traceback, and what is published
must be the truth: rows may be computed again or be missing, never differ.
"""

from __future__ import annotations

import json
import os
import random
import shutil
import socket
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from attacks import specimens
from attacks.apart import command, fork, run, until
from attacks.family import Verdict, fault
from attacks.specimens import Specimen, alters, differs, undisturbed

CODES = {
    "status": (0, 1, 2),
    "gather": (0, 1, 2, 75),
    "classify": (0, 1, 2, 75),
    "figures": (0, 1, 2, 75),
    "campaign": (0, 1, 2, 75),
}


@dataclass(frozen=True)
class Ground:
    """A campaign, and directories of it to be damaged: done, and left at a kill."""

    specimen: Specimen
    folders: tuple[Path, ...]


def prepare(place: Path) -> tuple[Ground, ...]:
    """Return campaigns that are done, and others that were killed on their way.

    A claim that is damaged may be one of another machine, and is waited for: a second
    here instead of two minutes.
    """
    from hpcwhirl.store.directory import owner

    owner.STALE, owner.GRACE, owner.SOON = 1.0, 0.5, 0.2
    plain = replace(specimens.PLAIN, speeds=3)
    states = replace(specimens.STATES, speeds=2, duration=1e-2)
    return tuple(_ground(mode, place / mode.name) for mode in (plain, states))


def _ground(mode: specimens.Mode, place: Path) -> Ground:
    specimen = undisturbed(mode, place)
    half = place / "half"
    (words,) = mode.calls(specimen.file, half)
    child = fork(command(words), place)
    until(lambda: not child.alive or len(_lines(half)) >= mode.cases // 2, 60.0)
    child.kill()
    child.wait()
    return Ground(specimen, (specimen.out, half))


def _lines(folder: Path) -> list[bytes]:
    return [line for path in folder.glob("journal/*.log")
            for line in path.read_bytes().splitlines()]  # fmt: skip


def _cut(path: Path, chance: random.Random, _: list[Path]) -> None:
    os.truncate(path, chance.randrange(path.stat().st_size + 1))


def _empty(path: Path, *_: Any) -> None:
    path.write_bytes(b"")


def _flip(path: Path, chance: random.Random, _: list[Path]) -> None:
    data = bytearray(path.read_bytes())
    for _ in range(chance.choice([1, 1, 2, 8, 64])):
        if data:
            data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
    path.write_bytes(data)


def _overwrite(path: Path, chance: random.Random, _: list[Path]) -> None:
    data = bytearray(path.read_bytes())
    start = chance.randrange(len(data) + 1)
    size = chance.choice([1, 16, 512, 4096])
    data[start : start + size] = chance.choice(
        [b"\0" * size, chance.randbytes(size), b"", b"\n" * size, b"{" * size]
    )
    path.write_bytes(data)


def _delete(path: Path, *_: Any) -> None:
    path.unlink()


def _double(path: Path, chance: random.Random, _: list[Path]) -> None:
    names = [f"copy-of-{path.name}", f"{path.name}.1",
             path.name.replace("0001", "0007"),
             path.name.replace("0001", "9" * 12), path.name.replace("0001", "-1"),
             "²-00000.log", "x.log", f"{path.stem}-9{path.suffix}", "10000-00000.log",
             "é\udcff" + path.suffix, "0001.json", "a" * 64 + ".state"]  # fmt: skip
    with suppress(shutil.SameFileError):
        shutil.copyfile(path, path.with_name(chance.choice(names)))


def _swap(path: Path, chance: random.Random, files: list[Path]) -> None:
    other = chance.choice(files)
    with suppress(OSError):
        one, two = path.read_bytes(), other.read_bytes()
        path.write_bytes(two)
        other.write_bytes(one)


def _folder(path: Path, chance: random.Random, _: list[Path]) -> None:
    path.unlink()
    path.mkdir()
    if chance.random() < 0.5:
        (path / "within").write_text("something")


def _pipe(path: Path, *_: Any) -> None:
    path.unlink()
    os.mkfifo(path)


def _door(path: Path, *_: Any) -> None:
    path.unlink()
    here = Path.cwd()
    os.chdir(path.parent)  # a socket's name has little room
    try:
        socket.socket(socket.AF_UNIX).bind(path.name)
    finally:
        os.chdir(here)


def _link(path: Path, chance: random.Random, _: list[Path]) -> None:
    path.unlink()
    aims = [path.name, "nowhere", "/dev/zero", "/dev/full", "/dev/null", "..", "/",
            "/proc/self/mem", "/etc/passwd"]  # fmt: skip
    path.symlink_to(chance.choice(aims))


def _json(path: Path, chance: random.Random, files: list[Path]) -> None:
    """Change something within JSON, so that it is still JSON."""
    data = path.read_bytes()
    head, sign, body = data.partition(b"{")
    try:
        content = json.loads(sign + body)
    except ValueError:
        _flip(path, chance, files)
        return
    path.write_bytes(head + json.dumps(_changed(content, chance), indent=1).encode())


def _changed(content: Any, chance: random.Random) -> Any:
    """Return JSON with one thing in it changed."""
    odd = [None, [], {}, "", "x", -1, 1e300, 10**25, True, [[]], {"a": 1}, float("nan")]
    inside = isinstance(content, dict | list) and content
    if not inside or chance.random() < 0.1:
        return chance.choice(odd)
    keys = list(content) if isinstance(content, dict) else list(range(len(content)))
    key = chance.choice(keys)
    if chance.random() < 0.2:
        del content[key]
        return content
    content[key] = _changed(content[key], chance)
    return content


SORTS: dict[str, tuple[Callable[..., None], int]] = {
    "cut": (_cut, 4),
    "emptied": (_empty, 1),
    "flipped": (_flip, 5),
    "overwritten": (_overwrite, 3),
    "deleted": (_delete, 3),
    "doubled": (_double, 3),
    "swapped": (_swap, 3),
    "a directory": (_folder, 2),
    "a FIFO": (_pipe, 2),
    "a socket": (_door, 1),
    "a link": (_link, 3),
    "other JSON": (_json, 4),
}


def hurt(folder: Path, chance: random.Random) -> tuple[str, Path]:
    """Damage one file of a directory; return how, and which."""
    files = sorted(p for p in folder.rglob("*") if p.is_file() and not p.is_symlink())
    kinds = sorted({p.relative_to(folder).parts[0] for p in files})
    kind = chance.choice(kinds)
    path = chance.choice([p for p in files if p.relative_to(folder).parts[0] == kind])
    if path.parent != folder and chance.random() < 0.08:
        return _hurt_folder(path.parent, chance), path.parent
    name = chance.choices(list(SORTS), [weight for _, weight in SORTS.values()])[0]
    SORTS[name][0](path, chance, files)
    return name, path


def _hurt_folder(folder: Path, chance: random.Random) -> str:
    shutil.rmtree(folder)
    kind = chance.choice(["gone", "a file", "a link"])
    if kind == "a file":
        folder.write_text("something")
    elif kind == "a link":
        folder.symlink_to("nowhere")
    return f"directory {kind}"


def attempt(shared: tuple[Ground, ...], chance: random.Random, place: Path) -> Verdict:
    """Damage a directory, then ask every command about it."""
    ground = chance.choice(shared)
    out = place / "out"
    shutil.copytree(chance.choice(ground.folders), out)
    hurts = [hurt(out, chance) for _ in range(chance.choice([1, 1, 1, 2, 3]))]
    what = ", ".join(f"{path.relative_to(out)} {kind}" for kind, path in hurts)
    touched = any(path.name.startswith("results.h5") or kind == "swapped"
                  for kind, path in hurts)  # fmt: skip
    names = ["status", "gather", "classify", *(["figures"] * (chance.random() < 0.05))]
    chance.shuffle(names)
    for name in [*names, "campaign", "gather"]:
        wrong = _asked(name, ground.specimen, out, place, touched=touched)
        if wrong.text:
            return Verdict(f"damage: {what}; {name}", wrong.text)
        touched = touched and not wrong.fresh
    return Verdict("damage")


@dataclass(frozen=True)
class _Found:
    """What is wrong after a command, and whether results.h5 was written anew."""

    text: str = ""
    fresh: bool = False


def _asked(
    name: str, specimen: Specimen, out: Path, place: Path, *, touched: bool
) -> _Found:
    """Give a command; results that are not touched must be true, and new ones too."""
    words = [name, str(out)]
    if name == "campaign":
        (words,) = specimen.mode.calls(specimen.file, out)
    before = _identity(out / "results.h5")
    ended = run(words, place)
    wrong = fault(ended, CODES[name])
    if wrong:
        return _Found(wrong)
    after = _identity(out / "results.h5")
    fresh = after != before and name != "classify"
    if name == "campaign" and ended.code == 0:
        return _Found(differs(out, specimen.truth, place), fresh=True)
    if after is None or (touched and not fresh):
        return _Found()
    wrong, missing = alters(out, specimen.truth, place)
    if not wrong and missing and name == "gather" and ended.code == 0 and fresh:
        quiet = "missing" not in ended.err + ended.out
        wrong = f"{missing} rows missing, exit 0, untold" if quiet else ""
    return _Found(wrong, fresh)


def _identity(path: Path) -> tuple[int, int] | None:
    """Return what changes when a file is replaced; None where there is none."""
    if not path.is_file():
        return None
    state = path.stat()
    return state.st_ino, state.st_mtime_ns
