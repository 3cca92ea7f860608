"""Damaged campaign directories: any file cut, flipped, swapped or made something else.

Every command must end, with a right exit code and no traceback, and what is published
must be the truth: rows may be computed again or be missing, never differ.
"""

from __future__ import annotations

import json
import os
import shutil
import socket
from collections.abc import Callable
from contextlib import chdir, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from attacks import specimens
from attacks.family import Chance, Family, Verdict, fault
from attacks.process import command, fork, run, wait_for
from attacks.specimens import Specimen, alters, differs, undisturbed

LINKS = ("nowhere", "/dev/zero", "/dev/full", "/dev/null", "..", "/", "/proc/self/mem",
         "/etc/passwd")  # fmt: skip
ODD = (None, [], {}, "", "x", -1, 1e300, 10**25, True, [[]], {"a": 1}, float("nan"))


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
    specimen, half = undisturbed(mode, place), place / "half"
    child = fork(command(specimen.calls(half)[0]), place)

    def written(folder: Path) -> int:
        return sum(log.stat().st_size for log in folder.glob("journal/*.log"))

    enough = written(specimen.out) / 2
    wait_for(lambda: not child.alive or written(half) >= enough, 60.0)
    child.kill()
    child.wait()
    return Ground(specimen, (specimen.out, half))


# What may happen to a file's bytes


def cut(data: bytearray, chance: Chance) -> bytearray:
    """Return the first of some bytes."""
    return data[: chance.randrange(len(data) + 1)]


def flipped(data: bytearray, chance: Chance) -> bytearray:
    """Return bytes of which some bits are others."""
    for _ in range(chance.choice([1, 1, 2, 8, 64]) if data else 0):
        data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
    return data


def _overwritten(data: bytearray, chance: Chance) -> bytearray:
    start, size = chance.randrange(len(data) + 1), chance.choice([1, 16, 512, 4096])
    new = (b"\0" * size, chance.randbytes(size), b"", b"\n" * size, b"{" * size)
    data[start : start + size] = chance.choice(new)
    return data


def _other_json(data: bytearray, chance: Chance) -> bytearray:
    head, sign, body = data.partition(b"{")
    try:
        content = _changed(json.loads(sign + body), chance)
    except ValueError:
        return flipped(data, chance)
    return head + json.dumps(content, indent=1).encode()


def _changed(content: Any, chance: Chance) -> Any:
    """Return JSON with one thing in it changed."""
    inside = isinstance(content, dict | list) and content
    if not inside or chance.random() < 0.1:
        return chance.choice(ODD)
    keys = content if isinstance(content, dict) else range(len(content))
    key = chance.choice(list(keys))
    if chance.random() < 0.2:
        del content[key]
    else:
        content[key] = _changed(content[key], chance)
    return content


# What may happen to a file in its directory


def _doubled(path: Path, chance: Chance, _: list[Path]) -> None:
    names = [path.name.replace("0001", n) for n in ("0007", "9" * 12, "-1")]
    names += [f"copy-of-{path.name}", f"{path.name}.1", "²-00000.log", "x.log",
              f"{path.stem}-9{path.suffix}", "10000-00000.log", "0001.json",
              "é\udcff" + path.suffix, "a" * 64 + ".state"]  # fmt: skip
    with suppress(shutil.SameFileError):
        shutil.copyfile(path, path.with_name(chance.choice(names)))


def _swapped(path: Path, chance: Chance, files: list[Path]) -> None:
    other = chance.choice(files)
    with suppress(OSError):
        data = other.read_bytes()
        other.write_bytes(path.read_bytes())
        path.write_bytes(data)


def _socket(path: Path) -> None:
    with chdir(path.parent):  # a socket's name has little room
        socket.socket(socket.AF_UNIX).bind(path.name)


def _of_bytes(make: Callable[[bytearray, Chance], bytearray]) -> Any:
    def act(path: Path, chance: Chance, _: list[Path]) -> None:
        path.write_bytes(make(bytearray(path.read_bytes()), chance))

    return act


def _instead(make: Callable[[Path], object]) -> Any:
    def act(path: Path, chance: Chance, _: list[Path]) -> None:
        path.unlink()
        aim = chance.choice([path.name, *LINKS])
        path.symlink_to(aim) if make is Path.symlink_to else make(path)

    return act


BYTES = ("cut", "emptied", "flipped", "overwritten")
PLACES = ("a directory", "a FIFO", "a socket", "a link")  # taken by something else
DAMAGES: dict[str, tuple[int, Callable[[Path, Chance, list[Path]], None]]] = {
    "cut": (4, _of_bytes(cut)), "emptied": (1, _of_bytes(lambda *_: bytearray())),
    "flipped": (5, _of_bytes(flipped)), "overwritten": (3, _of_bytes(_overwritten)),
    "other JSON": (4, _of_bytes(_other_json)), "deleted": (3, _instead(lambda _: None)),
    "doubled": (3, _doubled), "swapped": (3, _swapped),
    "a directory": (2, _instead(Path.mkdir)), "a FIFO": (2, _instead(os.mkfifo)),
    "a socket": (1, _instead(_socket)), "a link": (3, _instead(Path.symlink_to)),
}  # fmt: skip


def damage(path: Path, kind: str, chance: Chance, files: list[Path]) -> None:
    """Damage a file, or put something else in its place; `files` are all there are."""
    DAMAGES[kind][1](path, chance, files)


def hurt(folder: Path, chance: Chance) -> tuple[str, Path]:
    """Damage one file of a directory, or one in it; return how, and which."""
    files = sorted(p for p in folder.rglob("*") if p.is_file() and not p.is_symlink())
    kinds = sorted({p.relative_to(folder).parts[0] for p in files})
    top = folder / chance.choice(kinds)
    path = chance.choice([p for p in files if top in (p, *p.parents)])
    if path.parent == folder or chance.random() > 0.08:
        kind = chance.weighted({name: weight for name, (weight, _) in DAMAGES.items()})
        damage(path, kind, chance, files)
        return kind, path
    kind = chance.choice(["directory gone", "directory a file", "directory a link"])
    shutil.rmtree(path.parent)
    if kind == "directory a file":
        path.parent.write_text("something")
    elif kind == "directory a link":
        path.parent.symlink_to("nowhere")
    return kind, path.parent


def attempt(shared: tuple[Ground, ...], chance: Chance, place: Path) -> Verdict:
    """Damage a directory, then ask every command about it."""
    ground, out = chance.choice(shared), place / "out"
    shutil.copytree(chance.choice(ground.folders), out)
    hurts = [hurt(out, chance) for _ in range(chance.choice([1, 1, 1, 2, 3]))]
    what = ", ".join(f"{path.relative_to(out)} {kind}" for kind, path in hurts)
    touched = any(path.name.startswith("results.h5") or kind == "swapped"
                  for kind, path in hurts)  # fmt: skip
    names = ["status", "gather", "classify", *(["figures"] * (chance.random() < 0.05))]
    chance.shuffle(names)
    for name in [*names, "campaign", "gather"]:
        wrong, fresh = _wrong(name, ground.specimen, out, place, touched=touched)
        if wrong:
            return Verdict(f"damage: {what}; {name}", wrong)
        touched = touched and not fresh
    return Verdict("damage")


def _wrong(
    name: str, specimen: Specimen, out: Path, place: Path, *, touched: bool
) -> tuple[str, bool]:
    """Give a command; return what is wrong, and whether results.h5 is a new one.

    Results that are not touched must be true, and new ones, too.
    """
    words = [name, str(out)] if name != "campaign" else specimen.calls(out)[0]
    before = _identity(out / "results.h5")
    ended = run(words, place)
    after = _identity(out / "results.h5")
    fresh = after != before and name != "classify"
    wrong = fault(ended, (0, 1, 2) if name == "status" else (0, 1, 2, 75))
    if not wrong and name == "campaign" and ended.code == 0:
        return differs(out, specimen.truth, place), True
    if wrong or after is None or (touched and not fresh):
        return wrong, False
    wrong, missing = alters(out, specimen.truth, place)
    untold = "missing" not in ended.err + ended.out and not ended.code
    if not wrong and missing and name == "gather" and fresh and untold:
        wrong = f"{missing} rows missing, exit 0, untold"
    return wrong, fresh


def _identity(path: Path) -> tuple[int, int] | None:
    """Return what changes when a file is replaced; None where there is none."""
    state = path.stat() if path.is_file() else None
    return state and (state.st_ino, state.st_mtime_ns)


FAMILIES = {"damage": Family("damaged campaign directories", 2000, prepare, attempt)}
