"""Hostile `--set NAME=VALUE` of every command that takes one."""

from __future__ import annotations

import random
from pathlib import Path

from attacks import hostile
from attacks.apart import run
from attacks.family import Verdict, refusal
from attacks.specimens import PLAIN, Specimen, undisturbed

SHORT = ("--set", "duration=1e-5", "--set", "interval=1e-5")


def prepare(place: Path) -> Specimen:
    """Have everything imported and compiled that a refusal may need."""
    return undisturbed(PLAIN, place)


def names() -> list[str]:
    """Return all inputs, by their whole names and by their last parts."""
    from hpcwhirl.scene import input_names

    return [*input_names(), *(name.rsplit(".", 1)[-1] for name in input_names())]


def setting(chance: random.Random, known: list[str]) -> str:
    """Return a hostile NAME=VALUE; an argument of a process has no NUL."""
    name = hostile.key(chance, known).strip('"')
    value = hostile.value(chance)
    if chance.random() < 0.3:
        value = value.strip('"')
    whole = chance.choices(
        [f"{name}={value}", name, f"={value}", f"{name}=", f"{name}={value}={value}"],
        [20, 1, 1, 1, 1],
    )[0]
    if chance.random() < 0.1:  # bytes that are no text come as lone surrogates
        whole += chance.choice(["\udcff", "\x1b[2J", "\n", "\x7f", "\u2028"])
    return whole.replace("\0", "\udc80")


def attempt(shared: Specimen, chance: random.Random, place: Path) -> Verdict:
    """Give a command a hostile setting or two."""
    known = names()
    told = [w for _ in range(chance.choice([1, 1, 2]))
            for w in ("--set", setting(chance, known))]  # fmt: skip
    name = chance.choices(["campaign", "model", "run", "classify"], [6, 4, 2, 1])[0]
    words = {
        "campaign": ["campaign", str(shared.file), "--dry-run", "--out", place / "out"],
        "model": ["model"],
        "run": ["run", "table2", "--set", "time_step=2e-6", "--json"],
        "classify": ["classify", shared.out],
    }[name]
    last = SHORT if name == "run" else ()
    ended = run([*words, *told, *last], place)
    return Verdict(name, refusal(ended))
