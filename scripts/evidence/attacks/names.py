"""Hostile names: of the campaign's directory, of its file, of results and engines."""

from __future__ import annotations

import os
import random
import shutil
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from attacks import specimens
from attacks.apart import run
from attacks.family import Verdict, fault, refusal
from attacks.specimens import Specimen, differs, undisturbed

MOST = 2100  # characters of a line that may tell a path of 5,000
PLAIN_NAMES = (
    "out", "with space", "quote'\"", "$(id)", "`id`", "a;b", "*", "?", "%s%n",
    "{0}", "é", "\U0001f6e9", "-", "--help", "-v", "#", "~",
    "~root", "CON", "a=b", "a:b",
)  # fmt: skip
ODD_NAMES = (
    "\udcff\udcfe", "a\udc80b", "a\nb", "a\x1b[31mb", "\t", "\r", "\x07", "\u202egnp",
    "\u2028", "a\x85b", "x" * 255, "é" * 127, "x" * 250, "x" * 256, "é" * 200,
    "/".join(["y" * 200] * 25), "../" * 40 + "dev/null/x", "", " ", ".", "..",
    "a/../out", "./out/", "out//", "/dev/null", "/dev/full", "/dev/zero", "/dev/stdout",
    "/proc/self/fd/1", "/sys/x", "/proc/x",
)  # fmt: skip


def prepare(place: Path) -> Specimen:
    """Compute a campaign to compare with."""
    return undisturbed(replace(specimens.PLAIN, speeds=2), place)


def _free(place: Path, name: str, _: random.Random) -> str:
    return str(place / "in" / name) if not name.startswith(("/", "-")) else name


def _there(place: Path, name: str, chance: random.Random) -> str:
    """Return a name at which there is something else than a directory."""
    del name
    path = place / "in" / "there"
    kind = chance.choice(["file", "loop", "dangling", "pipe", "deep", "link"])
    if kind == "file":
        path.write_text("something")
    elif kind == "pipe":
        os.mkfifo(path)
    elif kind == "deep":
        (place / "in" / "file").write_text("")
        return str(place / "in" / "file" / "below")
    else:
        aims = {"loop": "there", "dangling": "nowhere", "link": "real"}
        (path.parent / "real").mkdir()
        path.symlink_to(aims[kind])
    return str(path)


KINDS: dict[str, tuple[Callable[[Path, str, random.Random], str], tuple[str, ...]]] = {
    "plain": (_free, PLAIN_NAMES),
    "odd": (_free, ODD_NAMES),
    "taken": (_there, ("",)),
}


def attempt(shared: Specimen, chance: random.Random, place: Path) -> Verdict:
    """Use a hostile name once, and look for what it has made."""
    (place / "in").mkdir()
    kind = chance.choices(list(KINDS), [2, 5, 2])[0]
    where, names = KINDS[kind]
    name = where(place, chance.choice(names), chance)
    use = chance.choices(list(USES), [weight for _, weight in USES.values()])[0]
    wrong = USES[use][0](shared, name, place)
    return Verdict(f"{use}: {name[-50:]!r}", wrong)


def _out(shared: Specimen, name: str, place: Path) -> str:
    """Compute in a directory of that name: the truth, or one line."""
    words = ["campaign", str(shared.file), "--out", name]
    inside = place / "in"
    ended = run(words, place, setup=lambda: os.chdir(inside))
    wrong = fault(ended, (0, 2), MOST)
    if not wrong and ended.code == 2:
        wrong = refusal(ended, most=MOST)
    out = inside / name
    if not wrong and ended.code == 0 and name:
        wrong = differs(out, shared.truth, place) or _again(words, inside, place)
    return wrong


def _again(words: list[str], inside: Path, place: Path) -> str:
    for name in ("status", "gather", "campaign"):
        told = words if name == "campaign" else [name, "--", words[-1]]
        ended = run(told, place, setup=lambda: os.chdir(inside))
        wrong = fault(ended, (0,), MOST)
        if wrong:
            return f"then {name}: {wrong}"
    return ""


def _file(shared: Specimen, name: str, place: Path) -> str:
    """Take a campaign from a file of that name."""
    with suppress(OSError, ValueError):
        if "/in/" in name and not os.path.lexists(name):
            shutil.copyfile(shared.file, name)
    words = ["campaign", "--dry-run", "--out", str(place / "out"), "--", name]
    return refusal(run(words, place), most=MOST)


def _results(shared: Specimen, name: str, place: Path) -> str:
    """Ask after a directory of that name."""
    del shared
    for command in ("status", "gather", "classify", "figures"):
        wrong = refusal(run([command, "--", name], place), (2,), MOST)
        if wrong:
            return f"{command}: {wrong}"
    return ""


def _engine(shared: Specimen, name: str, place: Path) -> str:
    """Take an engine from a file of that name."""
    del shared
    wrong = refusal(run(["model", "--set", f"file={name}"], place), (0, 2), MOST)
    toml = place / "engine.toml"
    text = "".join(f"\\U{ord(c):08x}" for c in name if not 0xD800 <= ord(c) < 0xE000)
    for odd in ("", "\\u0000"):
        toml.write_text(f'[engine]\nfile = "{text}{odd}"\n')
        wrong = wrong or refusal(run(["model", toml], place), (0, 2), MOST)
    return wrong


def _single(shared: Specimen, name: str, place: Path) -> str:
    """Write a single case, and a model, to a file of that name."""
    del shared
    short = ["--set", "duration=1e-4", "--set", "interval=1e-4"]
    if name.startswith(("/dev", "/proc", "/sys", "-")):
        return ""
    for words in (["run", *short, f"--out={name}"], ["export-model", "--", name]):
        wrong = refusal(run(words, place), most=MOST)
        if wrong:
            return f"{words[0]}: {wrong}"
    return ""


Use = Callable[[Specimen, str, Path], str]
USES: dict[str, tuple[Use, int]] = {
    "--out": (_out, 5),
    "campaign file": (_file, 2),
    "directory asked after": (_results, 2),
    "engine file": (_engine, 2),
    "file written": (_single, 1),
}
