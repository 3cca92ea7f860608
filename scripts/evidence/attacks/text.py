"""Hostile text: campaign files, `--set`, names of files, conditions of `cases`.

Types, sizes, depths and characters nobody meant. Each is accepted or refused in one
line, and a refusal leaves nothing behind.
"""

from __future__ import annotations

import os
import shutil
import string
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from attacks.damage import damaged
from attacks.family import Chance, Family, Verdict, fault, first, refusal
from attacks.process import run
from attacks.specimens import PLAIN, Specimen, differs, undisturbed

LONG = 70_000  # characters of a value that no message may repeat
MOST = 2100  # characters of a line that may give a path of 5,000
NUMBERS = (
    "0", "-1", "-0.0", "1", "2147483648", "9223372036854775808", "-9223372036854775809",
    "1e308", "-1e308", "1e309", "5e-324", "1e-300", "nan", "-nan", "inf", "-inf",
    "0xffffffffffffffffffffffff", "0o777", "0b1", "1_000", "0.1", "1.5", "-1e-9",
)  # fmt: skip
WORDS = (
    '""', '" "', "''", '"\\u0000"', '"a\\u0000b"', '"\\u001b[31mred\\u001b[0m"',
    '"a\\nb\\nhpcwhirl: error: forged"', '"\\u202egnp.exe"', '"\U0001f6e9\u0301"',
    '"%s%n{}"', '"../../../../etc/passwd"', '"/dev/zero"', '"/dev/full"', '"/"', '"."',
    '"$(id)"', '"modal"', '"squeeze"', '"nan"', '"1e-6"', '"\\r"', '"\\u0085\\u2028"',
    '"\\u009b31m"', '"/proc/self/mem"',
)  # fmt: skip
KINDS = (
    "true", "false", "[]", "{}", "[[]]", "[1, 2]", "[nan]", '["a", 1]', "[{}]",
    "{a = 1}", "1979-05-27", "1979-05-27T07:32:00Z", "07:32:00", "[true]", "[[1], [2]]",
    "[1e308, -1e308]", "{start = 1}", "[0.1, 0.1]",
)  # fmt: skip
BROKEN = ("", "=", "[", "}", '"', "'''", "\\", "1 2", "0x", "1__0", "01", "+", "é", ",")
RANGES = (
    "start = 1, stop = 2, step = 0", "start = 1, stop = 2, step = -1",
    "start = 1, stop = 2, step = 1e-300", "start = 0, stop = 1, num = 0",
    "start = 300, stop = 500, num = 1000000000000000000",
    "start = nan, stop = 1, num = 3", "start = -1e308, stop = 1e308, step = 1",
    "start = 300, stop = 500, num = -3", "start = 300, stop = 500, num = 2.5",
    "start = 300, stop = 500", "start = 300, stop = 500, num = 3, step = 10",
    "start = inf, stop = inf, step = inf", "start = '300', stop = 500, num = 3",
    "start = 300, stop = 300, num = 1", "start = 300, stop = 400, step = 5e-324",
    "start = 1e308, stop = 1e309, num = 3",
)  # fmt: skip
BYTES = (b"\0", b"\xff", b"\xc3", b"\x1b[2J", b"\r", b"\xed\xa0\x80", b"\x7f")
HEADS = (b"\xef\xbb\xbf", b"\xff\xfe", b"#" * LONG + b"\n")


def _long(chance: Chance) -> str:
    letters = chance.choice(["x", "é", "\\u0001", "\\n", "\U0001f6e9", " "])
    return '"' + letters * (LONG // len(letters)) + '"'


def _digits(chance: Chance) -> str:
    """Return a number of more digits than Python converts."""
    digits = "9" * chance.choice([400, 4299, 4301, LONG])
    return chance.choice(["", "-"]) + digits + chance.choice(["", ".0", "e9"])


def _deep(chance: Chance) -> str:
    """Return a value in more brackets than a recursion has room for."""
    depth = chance.choice([10, 90, 150, 500, 1500, 20_000])
    left, right = chance.choice([("[", "]"), ("{a=", "}")])
    return left * depth + "1" + right * depth


def _any_letters(chance: Chance) -> str:
    most = chance.choice([32, 128, 256, 0xD800, 0x10FFFF])
    codes = [chance.randrange(1, most) for _ in range(chance.randrange(1, 40))]
    return '"' + "".join(f"\\U{c:08x}" for c in codes if not _surrogate(c)) + '"'


def _surrogate(code: int) -> bool:
    return 0xD800 <= code < 0xE000


VALUES = {
    NUMBERS: 6, WORDS: 5, KINDS: 5, BROKEN: 2, tuple(f"{{{r}}}" for r in RANGES): 3,
    _long: 2, _digits: 2, _deep: 2, _any_letters: 2,
}  # fmt: skip


def value(chance: Chance) -> str:
    """Return the text of a hostile value."""
    kind = chance.weighted(VALUES)
    return str(kind(chance) if callable(kind) else chance.choice(kind))


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
    return undisturbed(PLAIN, place)


# Campaign files

DOCUMENT = {
    "[scene]": "speed = 410, nodal_diameter = 1, gap = 1.28e-4, friction = 0.1, "
               'force = 75e3, pulse = 7.8e-4, direction = "squeeze", duration = 2e-3',
    "[engine]": 'name = "four_motions", file = ""',
    "[engine.casing]": 'kind = "ring", harmonics = 20, thickness = 0.027, damping = .1',
    "[engine.rotor]": 'blades = 22, elements = 10, radius = 0.5, centre = "free", '
                      "mistuning = []",
    "[solver]": 'scheme = "modal", time_step = 2e-6, modes = 110, plan = "lean", '
                'until = "end"',
    "[output]": 'traces = "orbit", interval = 1e-4',
    "[campaign]": "case_limit = 10, save_every = 600",
    "[sweep]": "speed = {start = 300; stop = 400; num = 3}, friction = [0.0; 0.2]",
}  # fmt: skip
EXTRA = (
    ("[zip]", [("gap", "[1e-4, 2e-4]"), ("force", "[7e4, 8e4]")]),
    ("[zip]", [("gap", "[1e-4, 2e-4, 3e-4]"), ("force", "[7e4]")]),
    ("[[cases]]", [("gap", "1e-4")]), ("[cases]", [("gap", "1e-4")]), ("[[cases]]", []),
    ("[preset]", [("name", "1")]), ("[[scene]]", [("speed", "1")]),
    ("[scene.speed]", [("a", "1")]), ("[sample]", [("speed", "1")]),
)  # fmt: skip
MUTATIONS = {"value": 12, "key": 3, "twice": 2, "table twice": 1, "table": 2,
             "header": 2, "sweep": 2, "no table": 1}  # fmt: skip
COMMANDS = {("campaign", "--dry-run", "--out", "{out}"): 6, ("model",): 2,
            ("job", "slurm"): 1}  # fmt: skip
Document = list[tuple[str, list[tuple[str, str]]]]  # [(header, [(key, value)])]


def document() -> Document:
    """Return a small campaign with every table, as text."""
    out: Document = []
    for header, told in DOCUMENT.items():
        pairs = [pair.split(" = ", 1) for pair in told.split(", ")]
        out.append((header, [(name, v.replace(";", ",")) for name, v in pairs]))
    return out


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
        name, its = chance.choice(EXTRA)
        doc.insert(chance.randrange(len(doc)), (name, list(its)))
    elif kind == "header":
        form = chance.choice(["[{}]", "[[{}]]", "[{}", "[ {} ]"])
        name = key(chance, [*known, "engine.casing", "cases", "sweep"])
        doc[at] = form.format(name), pairs
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
    return bytes(damaged(data, kind, chance) if kind in ("cut", "flipped") else data)


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
    commands = {
        ("campaign", str(shared.file), "--dry-run", "--out", str(place / "out")): 6,
        ("model",): 4,
        ("run", "table2", "--set", "time_step=2e-6", "--json"): 2,
        ("classify", str(shared.out)): 1,
    }
    words = chance.weighted(commands)
    short = ("--set", "duration=1e-5", "--set", "interval=1e-5")
    ended = run([*words, *sets, *(short if words[0] == "run" else ())], place)
    return Verdict(words[0], refusal(ended))


# Names of directories and files

NAMES = (
    "out", "with space", "quote'\"", "$(id)", "`id`", "a;b", "*", "?", "%s%n", "{0}",
    "é", "\U0001f6e9", "-", "--help", "-v", "#", "~", "~root", "CON", "a=b", "a:b",
    "\udcff\udcfe", "a\udc80b", "a\nb", "a\x1b[31mb", "\t", "\r", "\x07", "\u202egnp",
    "\u2028", "a\x85b", "x" * 255, "é" * 127, "x" * 250, "x" * 256, "é" * 200,
    "/".join(["y" * 200] * 25), "../" * 40 + "dev/null/x", "", " ", ".", "..",
    "a/../out", "./out/", "out//", "/dev/null", "/dev/full", "/dev/zero", "/dev/stdout",
    "/proc/self/fd/1", "/sys/x", "/proc/x", "TAKEN/file", "TAKEN/loop", "TAKEN/real",
    "TAKEN/dangling", "TAKEN/pipe", "TAKEN/file/below", "TAKEN/link",
)  # fmt: skip


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

    def given(call: list[str]) -> str:
        ended = run(call, place, lambda: os.chdir(inside))
        return fault(ended, (0,), MOST)

    ended = run(words, place, lambda: os.chdir(inside))
    if ended.code or not name:
        return refusal(ended, most=MOST)
    again = (["status", "--", name], ["gather", "--", name], words)
    return differs(inside / name, shared.truth, place) or first(map(given, again))


def _file(shared: Specimen, name: str, place: Path) -> str:
    """Take a campaign from a file of that name."""
    with suppress(OSError, ValueError):
        if "/in/" in name and not os.path.lexists(name):
            shutil.copyfile(shared.file, name)
    words = ["campaign", "--dry-run", "--out", str(place / "out"), "--", name]
    return refusal(run(words, place), most=MOST)


def _asked_after(_: Specimen, name: str, place: Path) -> str:
    """Ask after a directory of that name."""
    commands = ("status", "gather", "classify", "figures")
    return first(refusal(run([c, "--", name], place), (2,), MOST) for c in commands)


def _engine(_: Specimen, name: str, place: Path) -> str:
    """Take an engine from a file of that name."""
    toml = place / "engine.toml"
    text = "".join(f"\\U{ord(c):08x}" for c in name if not _surrogate(ord(c)))
    wrong = refusal(run(["model", "--set", f"file={name}"], place), most=MOST)
    for end in ("", "\\u0000"):
        toml.write_text(f'[engine]\nfile = "{text}{end}"\n')
        wrong = wrong or refusal(run(["model", toml], place), most=MOST)
    return wrong


def _written(_: Specimen, name: str, place: Path) -> str:
    """Write a single case, and a model, to a file of that name."""
    if name.startswith(("/dev", "/proc", "/sys", "-")):
        return ""
    short = ["--set", "duration=1e-4", "--set", "interval=1e-4"]
    calls = (["run", *short, f"--out={name}"], ["export-model", "--", name])
    return first(refusal(run(words, place), most=MOST) for words in calls)


USES: dict[Callable[[Specimen, str, Path], str], int] = {
    _out: 5, _file: 2, _asked_after: 2, _engine: 2, _written: 1
}  # fmt: skip


def attempt_names(shared: Specimen, chance: Chance, place: Path) -> Verdict:
    """Use a hostile name once."""
    name, use = _hostile_name(place, chance), chance.weighted(USES)
    what = use.__name__.strip("_").replace("_", " ")
    return Verdict(f"{what}: {name[-50:]!r}", use(shared, name, place))


# Conditions of `cases --where`

VARIABLES = ("speed", "gap", "regime", "word", "case", "whirl", "friction", "message",
             "sped", "x", "__import__", "é", "\u202e", "growth_rate")  # fmt: skip
OPERANDS = (
    "1", "0", "-1", "400", "1e400", "nan", "inf", "1" * 309, "9" * 5000,
    "0x" + "f" * 99, "damped", "sustained", "'damped'", '"', "'", "True", "None", "[]",
    "()", "{}", "1j", "1_000", "0b1", "…", "x" * 5000,
)  # fmt: skip
SIGNS = ("==", "!=", "<", ">", "<=", ">=", "=", "and", "or", "not", "+", "-", "*", "/",
         "**", "%", "//", "@", "in", "is", ":=", ",", ".", ";", "&", "|", "~", "if",
         "else", "lambda x:", "\n", "\t", "#")  # fmt: skip
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
    damaged = "damaged" in ended.err
    odd = sorted({c for c in ended.out if ord(c) < 32 and c not in "\n\t"})
    wrong = refusal(ended) or (f"the file is called {ended.last}" if damaged else "")
    what = kind.__name__.strip("_").replace("_", " ")
    return Verdict(what, wrong or (f"{odd!r} on stdout" if odd else ""))


def _few(place: Path) -> Specimen:
    return undisturbed(replace(PLAIN, speeds=2), place)


FAMILIES = {
    "toml": Family("hostile campaign files", 2000, warm, attempt_toml),
    "set": Family("hostile `--set`", 2000, warm, attempt_set),
    "names": Family("hostile names", 200, _few, attempt_names),
    "conditions": Family("hostile conditions of `cases --where`", 1000, warm,
                         attempt_conditions),
}  # fmt: skip
