"""Hostile campaign files: structure-aware mutations of one that is right."""

from __future__ import annotations

import random
from pathlib import Path

from attacks import hostile
from attacks.apart import run
from attacks.family import Verdict, refusal
from attacks.specimens import PLAIN, undisturbed

Document = list[tuple[str, list[tuple[str, str]]]]  # [(header, [(key, value)])]
COMMANDS = (["campaign", "--dry-run", "--out", "OUT"], ["model"], ["job", "slurm"])


def document() -> Document:
    """Return a small campaign with every table, as text."""
    return [
        ("[scene]", [("speed", "410"), ("nodal_diameter", "1"), ("gap", "1.28e-4"),
                     ("friction", "0.1"), ("force", "75e3"), ("pulse", "7.8e-4"),
                     ("direction", '"squeeze"'), ("duration", "2e-3")]),
        ("[engine]", [("name", '"four_motions"'), ("file", '""')]),
        ("[engine.casing]", [("kind", '"ring"'), ("harmonics", "20"),
                             ("thickness", "0.02663"), ("damping", "0.1")]),
        ("[engine.rotor]", [("blades", "22"), ("elements", "10"), ("radius", "0.5"),
                            ("centre", '"free"'), ("mistuning", "[]")]),
        ("[solver]", [("scheme", '"modal"'), ("time_step", "2e-6"), ("modes", "110"),
                      ("plan", '"lean"'), ("until", '"end"')]),
        ("[output]", [("traces", '"orbit"'), ("interval", "1e-4")]),
        ("[campaign]", [("case_limit", "10"), ("save_every", "600")]),
        ("[sweep]", [("speed", "{start = 300, stop = 400, num = 3}"),
                     ("friction", "[0.0, 0.2]")]),
    ]  # fmt: skip


EXTRA = (
    ("[zip]", [("gap", "[1e-4, 2e-4]"), ("force", "[7e4, 8e4]")]),
    ("[zip]", [("gap", "[1e-4, 2e-4, 3e-4]"), ("force", "[7e4]")]),
    ("[[cases]]", [("gap", "1e-4")]),
    ("[cases]", [("gap", "1e-4")]),
    ("[[cases]]", []),
    ("[preset]", [("name", "1")]),
    ("[[scene]]", [("speed", "1")]),
    ("[scene.speed]", [("a", "1")]),
    ("[sample]", [("speed", "1")]),
)


def mutate(doc: Document, chance: random.Random) -> str:
    """Change one thing; return what in a word."""
    tables = [place for place, (_, pairs) in enumerate(doc) if pairs]
    table = chance.choice(tables)
    header, pairs = doc[table]
    place = chance.randrange(len(pairs))
    known = [name for _, those in doc for name, _ in those]
    kind = chance.choices(list(CHANGES), [12, 3, 2, 1, 2, 2, 2, 1])[0]
    if kind == "value":
        pairs[place] = pairs[place][0], hostile.value(chance)
    elif kind == "key":
        pairs.insert(place, (hostile.key(chance, known), hostile.value(chance)))
    elif kind == "twice":
        pairs.append(pairs[place])
    elif kind == "table twice":
        doc.append((header, pairs))
    elif kind == "table":
        extra = chance.choice(EXTRA)
        doc.insert(chance.randrange(len(doc)), (extra[0], list(extra[1])))
    elif kind == "header":
        doc[table] = _header(chance, known), pairs
    elif kind == "sweep":
        doc[-1][1].append((chance.choice(known), hostile.value(chance)))
    else:
        doc.insert(0, ("", [(header.strip("[]"), hostile.value(chance))]))
        del doc[table + 1]
    return kind


CHANGES = (
    "value",
    "key",
    "twice",
    "table twice",
    "table",
    "header",
    "sweep",
    "no table",
)


def _header(chance: random.Random, known: list[str]) -> str:
    name = hostile.key(chance, [*known, "engine.casing", "cases", "sweep"])
    return chance.choice(["[{}]", "[[{}]]", "[{}", "[ {} ]"]).format(name)


def text_of(doc: Document) -> str:
    """Return a document as it stands in a file."""
    parts = []
    for header, pairs in doc:
        parts += [header, *(f"{name} = {value}" for name, value in pairs)]
    return "\n".join(parts) + "\n"


def prepare(place: Path) -> None:
    """Have everything imported and compiled that a refusal may need."""
    undisturbed(PLAIN, place)


def attempt(shared: None, chance: random.Random, place: Path) -> Verdict:
    """Give a command a mutated campaign."""
    del shared
    doc = document()
    kinds = {mutate(doc, chance) for _ in range(chance.choice([1, 1, 1, 2, 3]))}
    file = place / "hostile.toml"
    file.write_bytes(hostile.bytes_of(text_of(doc), chance))
    name, *options = chance.choices(COMMANDS, [6, 2, 1])[0]
    words = [name, *(str(place / "out") if w == "OUT" else w for w in options)]
    ended = run([*words, str(file)], place)
    wrong = refusal(ended)
    return Verdict(f"{name}: {' + '.join(sorted(kinds))}", wrong or _made(place))


def _made(place: Path) -> str:
    found = [path.name for path in (place / "out").rglob("*")]
    return f"a dry run or a refusal made {', '.join(found[:3])}" if found else ""
