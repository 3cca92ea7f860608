"""Hostile text: campaign files, `--set`, names, conditions, functions of a case.

Types, sizes, depths and characters nobody meant. Each is accepted or refused in one
line, and a refusal leaves nothing behind.
"""

from __future__ import annotations

import os
import shutil
import string
import sys
import tomllib
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from attacks.damage import cut, flipped
from attacks.family import Chance, Family, Verdict, controls, fault, first, refusal
from attacks.process import Ended, fork, run
from attacks.specimens import PLAIN, Specimen, differs, undisturbed

LONG = 70_000  # characters of a value that no message may repeat
MOST = 2100  # characters of a line that may give a path of 5,000
TABLE = tomllib.loads(Path(__file__).with_name("hostile.toml").read_text("utf-8"))
NUMBERS, WORDS, KINDS, BROKEN, STARTS, STEPS = TABLE["values"].values()
BYTES = (b"\0", b"\xff", b"\xc3", b"\x1b[2J", b"\r", b"\xed\xa0\x80", b"\x7f")
HEADS = (b"\xef\xbb\xbf", b"\xff\xfe", b"#" * LONG + b"\n")


def _long(chance: Chance) -> str:
    letters = chance.choice(["x", "é", "\\u0001", "\\n", "\U0001f6e9", " "])
    return '"' + letters * (LONG // len(letters)) + '"'


def _digits(chance: Chance) -> str:
    """Return a number of more digits than Python converts."""
    digits = "9" * chance.choice([400, 4299, 4301, LONG])
    return chance.choice(["", "-", "0x"]) + digits + chance.choice(["", ".0", "e9"])


def _deep(chance: Chance) -> str:
    """Return a value in more brackets than a recursion has room for."""
    depth = chance.choice([10, 90, 150, 500, 1500, 20_000])
    left, right = chance.choice([("[", "]"), ("{a=", "}")])
    return left * depth + "1" + right * depth


def _any_letters(chance: Chance) -> str:
    most = chance.choice([32, 128, 256, 0xD800, 0x10FFFF])
    letters = (chr(chance.randrange(1, most)) for _ in range(chance.randrange(1, 40)))
    return f'"{_escaped("".join(letters))}"'


def _escaped(text: str) -> str:
    """Return a text as TOML has it, without what is no character by itself."""
    return "".join(f"\\U{ord(c):08x}" for c in text if not 0xD800 <= ord(c) < 0xE000)


def _range(chance: Chance) -> str:
    parts = map(chance.choice, (STARTS, STARTS, STEPS))
    return "{{start = {}, stop = {}, {}}}".format(*parts).replace(", }", "}")


MADE = (_long, _digits, _deep, _any_letters, _range)


def value(chance: Chance) -> str:
    """Return the text of a hostile value."""
    if chance.random() < 0.35:
        return chance.choice(MADE)(chance)
    told = (NUMBERS, WORDS, KINDS, BROKEN)
    return str(chance.choice(chance.choices(told, (6, 5, 5, 2))[0]))


def key(chance: Chance, known: list[str]) -> str:
    """Return a key that is known, nearly known, or nothing at all."""
    near = list(chance.choice(known))
    near[chance.randrange(len(near))] = chance.choice(string.printable[:62])
    return chance.choice([
        chance.choice(known), chance.choice(known), "".join(near), "k" * LONG,
        '"' + "k" * LONG + '"', '"\\u0000"', '""', '"a\\nb"', '"\\u001b[2J"', "a.b.c.d",
        '"__class__"', "constructor", "model_fields", ".".join("a" * 1500),
    ])  # fmt: skip


def warm(place: Path) -> Specimen:
    """Compute a campaign, so that all is imported and compiled that forks need."""
    return undisturbed(replace(PLAIN, speeds=3), place)


# Campaign files

Document = list[tuple[str, list[tuple[str, str]]]]  # [(header, [(key, value)])]
SWEEP = [("speed", "{start = 300, stop = 400, num = 3}"), ("friction", "[0.0, 0.2]")]
TABLES = (
    ("[zip]", [("gap", "[1e-4, 2e-4, 3e-4]"), ("force", "[7e4]")]),
    ("[[cases]]", [("gap", "1e-4")]), ("[cases]", [("gap", "1e-4")]), ("[[cases]]", []),
    ("[preset]", [("name", "1")]), ("[[scene]]", [("speed", "1")]),
    ("[scene.speed]", [("a", "1")]), ("[sample]", [("speed", "1")]),
)  # fmt: skip
MUTATIONS = {"value": 12, "key": 3, "twice": 2, "table twice": 1, "table": 2,
             "header": 2, "sweep": 2, "no table": 1}  # fmt: skip
COMMANDS = {("campaign", "--dry-run", "--out", "{out}"): 6, ("model",): 2,
            ("job", "slurm"): 1}  # fmt: skip


def document() -> Document:
    """Return a small campaign that gives every input, as text."""
    import tomli_w

    from hpcwhirl.scene import Scene, flatten

    tables: dict[str, list[tuple[str, str]]] = {}
    for full, given in flatten(Scene(duration=2e-3)).items():
        if isinstance(given, str | bool | int | float):
            place, _, name = ("scene." * ("." not in full) + full).rpartition(".")
            told = tomli_w.dumps({name: given}).strip().partition(" = ")[2]
            tables.setdefault(f"[{place}]", []).append((name, told))
    return [*tables.items(), ("[sweep]", list(SWEEP))]


def mutate(doc: Document, chance: Chance) -> str:
    """Change one thing in a document; return what in a word."""
    at = chance.choice([place for place, (_, pairs) in enumerate(doc) if pairs])
    header, pairs = doc[at]
    place = chance.randrange(len(pairs))
    known = [name for _, those in doc for name, _ in those]
    kind = str(chance.weighted(MUTATIONS))
    if kind == "value":
        pairs[place] = pairs[place][0], value(chance)
    elif kind == "key":
        pairs.insert(place, (key(chance, known), value(chance)))
    elif kind == "twice":
        pairs.append(pairs[place])
    elif kind == "table twice":
        doc.append((header, pairs))
    elif kind == "table":
        name, its = chance.choice(TABLES)
        doc.insert(chance.randrange(len(doc)), (name, list(its)))
    elif kind == "header":
        form = chance.choice(["[{}]", "[[{}]]", "[{}", "[ {} ]"])
        doc[at] = form.format(key(chance, [*known, "engine.casing", "cases"])), pairs
    elif kind == "sweep":
        doc[-1][1].append((chance.choice(known), value(chance)))
    else:
        doc[at] = "", [(header.strip("[]"), value(chance))]
    return kind


def bytes_of(doc: Document, chance: Chance) -> bytes:
    """Return a document's bytes, now and then with some that no text has."""
    lines = (line for header, pairs in doc
             for line in (header, *(f"{name} = {v}" for name, v in pairs)))  # fmt: skip
    data = bytearray("\n".join(lines).encode("utf-8", "surrogatepass"))
    kind = chance.choice(["cut", "flipped", "inside", "head", *[""] * 8])
    if kind == "inside":
        place = chance.randrange(len(data))
        data[place:place] = chance.choice(BYTES)
    elif kind == "head":
        data[:0] = chance.choice(HEADS)
    elif kind:
        data = (cut if kind == "cut" else flipped)(data, chance)
    return bytes(data)


def attempt_toml(_: Specimen, chance: Chance, place: Path) -> Verdict:
    """Give a command a mutated campaign."""
    doc, out = document(), place / "out"
    kinds = {mutate(doc, chance) for _ in range(chance.choice([1, 1, 1, 2, 3]))}
    file = place / "hostile.toml"
    file.write_bytes(bytes_of(doc, chance))
    words = chance.weighted(COMMANDS)
    ended = run([*(w.format(out=out) for w in words), file], place)
    made = [path.name for path in out.rglob("*")]
    wrong = refusal(ended) or (f"a dry run or a refusal made {made}" if made else "")
    return Verdict(f"{words[0]}: {' + '.join(sorted(kinds))}", wrong)


# --set


def _setting(chance: Chance, known: list[str]) -> str:
    """Return a hostile NAME=VALUE; an argument of a process has no NUL."""
    name, text = key(chance, known).strip('"'), value(chance)
    text = text.strip('"') if chance.random() < 0.3 else text
    odd = {f"{name}={text}": 20, name: 1, f"={text}": 1, f"{name}=": 1,
           f"{name}={text}={text}": 1}  # fmt: skip
    whole = str(chance.weighted(odd))
    if chance.random() < 0.1:  # bytes that are no text come as lone surrogates
        whole += chance.choice(["\udcff", "\x1b[2J", "\n", "\x7f", "\u2028"])
    return whole.replace("\0", "\udc80")


def attempt_set(shared: Specimen, chance: Chance, place: Path) -> Verdict:
    """Give a command a hostile setting or two."""
    from hpcwhirl.scene import input_names

    known = [n for name in input_names() for n in (name, name.rsplit(".", 1)[-1])]
    many = range(chance.choice([1, 1, 2]))
    sets = [w for _ in many for w in ("--set", _setting(chance, known))]
    words = chance.weighted({
        ("campaign", str(shared.file), "--dry-run", "--out", str(place / "out")): 6,
        ("model",): 4, ("run", "table2", "--set", "time_step=2e-6", "--json"): 2,
        ("classify", str(shared.out)): 1,
    })  # fmt: skip
    short = ("--set", "duration=1e-5", "--set", "interval=1e-5")
    ended = run([*words, *sets, *(short if words[0] == "run" else ())], place)
    return Verdict(words[0], refusal(ended))


# Names of directories and files

NAMES = [
    *TABLE["names"]["names"], "x" * 255, "é" * 127, "x" * 250, "x" * 256,
    "/".join(["y" * 200] * 25), "../" * 40 + "dev/null/x", "\udcff\udcfe", "a\udc80b",
]  # fmt: skip


def _hostile_name(place: Path, chance: Chance) -> str:
    """Return a name in a new directory `in`, or one at which there is something."""
    taken = place / "in" / "TAKEN"
    (taken / "real").mkdir(parents=True)
    (taken / "file").write_text("something")
    os.mkfifo(taken / "pipe")
    for name, aim in (("loop", "loop"), ("dangling", "nowhere"), ("link", "real")):
        (taken / name).symlink_to(aim)
    name = chance.choice(NAMES)
    return name if name.startswith(("/", "-")) else f"{place}/in/{name}"


def _out(shared: Specimen, name: str, place: Path) -> str:
    """Compute in a directory of that name: the truth, or one line."""
    inside = place / "in"
    words = ["campaign", str(shared.file), "--out", name]

    def given(call: list[str]) -> Ended:
        return run(call, place, lambda: os.chdir(inside))

    ended = given(words)
    if ended.code or not name:
        return refusal(ended, most=MOST)
    again = (["status", "--", name], ["gather", "--", name], words)
    wrong = differs(inside / name, shared.truth, place)
    return wrong or first(fault(given(call), (0,), MOST) for call in again)


def _read(shared: Specimen, name: str, place: Path) -> str:
    """Take a campaign and an engine from a file of that name, then ask after it."""
    with suppress(OSError, ValueError):
        if "/in/" in name and not os.path.lexists(name):
            shutil.copyfile(shared.file, name)
    toml = place / "engine.toml"
    toml.write_text(f'[engine]\nfile = "{_escaped(name)}"\n')
    calls = [["campaign", "--dry-run", "--out", str(place / "out"), "--", name],
             ["model", "--set", f"file={name}"], ["model", str(toml)]]  # fmt: skip
    asked = [[c, "--", name] for c in ("status", "gather", "classify", "figures")]
    wrong = first(refusal(run(words, place), most=MOST) for words in calls)
    return wrong or first(refusal(run(c, place), (2,), MOST) for c in asked)


def _written(_: Specimen, name: str, place: Path) -> str:
    """Write a single case, and a model, to a file of that name."""
    if name.startswith(("/dev", "/proc", "/sys", "-")):
        return ""
    short = ["--set", "duration=1e-4", "--set", "interval=1e-4"]
    calls = (["run", *short, f"--out={name}"], ["export-model", "--", name])
    return first(refusal(run(words, place), most=MOST) for words in calls)


def attempt_names(shared: Specimen, chance: Chance, place: Path) -> Verdict:
    """Use a hostile name once."""
    name = _hostile_name(place, chance)
    use = chance.weighted({_out: 5, _read: 4, _written: 1})
    what = use.__name__.strip("_")
    return Verdict(f"{what}: {name[-50:]!r}", use(shared, name, place))


# Conditions of `cases --where`

VARIABLES, OPERANDS, SIGNS = TABLE["conditions"].values()
OPERANDS += ["1" * 309, "9" * 5000, "0x" + "f" * 99, "x" * 5000]
EVERY = [*VARIABLES, *OPERANDS, *SIGNS]


def _comparison(chance: Chance) -> str:
    """Return a comparison as a person writes it, one of its parts another."""
    terms = [chance.choice(part) for part in (VARIABLES[:4], SIGNS[:6], OPERANDS)]
    if chance.random() < 0.3:
        terms[chance.randrange(3)] = chance.choice(EVERY)
    return " ".join(terms)


def _soup(chance: Chance) -> str:
    return " ".join(chance.choices(EVERY, k=chance.randint(0, 12)))


def _again_and_again(chance: Chance) -> str:
    n = chance.choice([30, 300, 900, 5000])
    return chance.choice([
        "+".join(["1"] * n) + " > 0", " and ".join(["speed > 1"] * n),
        "(" * n + "speed" + ")" * n + " > 1", "-" * n + "speed > 1",
        "not " * n + "speed > 1", "speed" + " > 1" * n, "1" * n + " > speed",
    ])  # fmt: skip


def attempt_conditions(shared: Specimen, chance: Chance, place: Path) -> Verdict:
    """Ask for cases by a hostile condition: a table, or one line."""
    kind = chance.weighted({_comparison: 4, _soup: 4, _again_and_again: 2})
    words = ["cases", str(shared.out), f"--where={kind(chance)}"]
    if chance.random() < 0.2:
        words.append(f"--sort={chance.choice(VARIABLES)}")
    ended = run(words, place)
    called = f"the file is called {ended.last}" if "damaged" in ended.err else ""
    odd = controls(ended.out)
    wrong = refusal(ended) or called or (f"{odd!r} on stdout" if odd else "")
    return Verdict(kind.__name__.strip("_").replace("_", " "), wrong)


# Functions of a case: none changes what is stored, ends or hangs a campaign. Each is
# written to a file, called, then changed by a number and called again: it is refused.

SOURCE = """
import os, sys, threading
import numpy as np
NUMBER = {number}
class Silent(Exception):
    def __str__(self): raise self
class Bare(BaseException): pass
class Odd:
    def __float__(self): sys.exit(0)
def f(case):
    {body}
    return {{"x": NUMBER * 1.0}}
"""
BODIES = TABLE["functions"]
BESIDE = frozenset({"x", "measure_message"})  # variables of the function's own


def called(place: Path, body: str, number: int, file: Path) -> Ended:
    """Return how a campaign ended that was called with a function of this body."""

    def action() -> int:
        import hpcwhirl

        os.chdir(place)
        sys.path.insert(0, str(place))
        sys.dont_write_bytecode = True
        f = __import__("own_measure").f
        try:
            hpcwhirl.campaign(file, "out", measure=f, variables={"x": "1"}).close()
        except ValueError as refused:
            print(f"hpcwhirl: error: {refused}", file=sys.stderr)
            return 2
        return 0

    text = SOURCE.format(number=number, body=body)
    (place / "own_measure.py").write_text(text)
    return fork(action, place, f"call-{number}").wait()


def attempt_measures(shared: Specimen, chance: Chance, place: Path) -> Verdict:
    """Call a campaign with a hostile function, then with another one."""
    kind = chance.choice(list(BODIES))
    body = chance.choice(BODIES[kind])
    wrong = fault(called(place, body, 1, shared.file), (0,))
    wrong = wrong or differs(place / "out", shared.truth, place, BESIDE)
    if not wrong:
        again = called(place, body, 2, shared.file)
        wrong = fault(again, (2,))
        if not wrong and "another measure" not in again.err:
            wrong = f"another one was not refused as one: {again.last}"
    return Verdict(kind, f"{body}: {wrong}" if wrong else "")


Attempt = Callable[[Specimen, Chance, Path], Verdict]
ROWS: dict[str, tuple[str, int, Attempt]] = {
    "toml": ("hostile campaign files", 2000, attempt_toml),
    "set": ("hostile `--set`", 2000, attempt_set),
    "names": ("hostile names", 200, attempt_names),
    "conditions": ("hostile conditions of `cases --where`", 1000, attempt_conditions),
    "measures": ("hostile functions of a case, then changed ones", 200,
                 attempt_measures),
}  # fmt: skip
FAMILIES = {
    name: Family(title, count, warm, attempt)
    for name, (title, count, attempt) in ROWS.items()
}
