"""Hostile values and texts: types, sizes, depths and characters nobody meant."""

from __future__ import annotations

import random
import string

LONG = 70_000  # characters of a value that no message may repeat

NUMBERS = (
    "0", "-1", "-0.0", "1", "2147483648", "9223372036854775808", "-9223372036854775809",
    "1e308", "-1e308", "1e309", "5e-324", "1e-300", "nan", "-nan", "inf", "-inf",
    "0xffffffffffffffffffffffff", "0o777", "0b1", "1_000", "0.1", "1.5", "-1e-9",
)  # fmt: skip
WORDS = (
    '""', '" "', "''", '"\\u0000"', '"a\\u0000b"', '"\\u001b[31mred\\u001b[0m"',
    '"a\\nb\\nhpcwhirl: error: forged"',
    '"\\u202egnp.exe"', '"\U0001f6e9\u0301"', '"%s%n{}"',
    '"../../../../etc/passwd"', '"/dev/zero"', '"/dev/full"', '"/"', '"."', '"$(id)"',
    '"modal"', '"squeeze"', '"nan"', '"1e-6"', '"\\r"',
    '"\\u0085\\u2028"', '"\\u009b31m"',
    '"/proc/self/mem"',
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
    "start = nan, stop = 1, num = 3",
    "start = -1e308, stop = 1e308, step = 1", "start = 300, stop = 500, num = -3",
    "start = 300, stop = 500, num = 2.5", "start = 300, stop = 500",
    "start = 300, stop = 500, num = 3, step = 10",
    "start = inf, stop = inf, step = inf",
    "start = '300', stop = 500, num = 3", "start = 300, stop = 300, num = 1",
    "start = 300, stop = 400, step = 5e-324", "start = 1e308, stop = 1e309, num = 3",
)  # fmt: skip


def long_word(chance: random.Random) -> str:
    """Return a quoted value that is too long to be repeated."""
    letters = chance.choice(["x", "é", "\\u0001", "\\n", "\U0001f6e9", " "])
    return '"' + letters * (LONG // len(letters)) + '"'


def long_number(chance: random.Random) -> str:
    """Return an integer or a float of more digits than Python converts."""
    digits = chance.choice([400, 4299, 4301, 70_000])
    return chance.choice(["", "-"]) + "9" * digits + chance.choice(["", ".0", "e9"])


def deep(chance: random.Random) -> str:
    """Return a value in more brackets than a recursion has room for."""
    depth = chance.choice([10, 90, 150, 500, 1500, 20_000])
    if chance.random() < 0.5:
        return "[" * depth + "1" + "]" * depth
    return "{a=" * depth + "1" + "}" * depth


def ranged(chance: random.Random) -> str:
    """Return a range for a sweep that is none."""
    return "{" + chance.choice(RANGES) + "}"


def random_word(chance: random.Random) -> str:
    """Return a quoted value of any characters."""
    codes = [chance.randrange(1, chance.choice([32, 128, 256, 0xD800, 0x10FFFF]))
             for _ in range(chance.randrange(1, 40))]  # fmt: skip
    told = (c if not 0xD800 <= c < 0xE000 else 0xFFFD for c in codes)
    return '"' + "".join(f"\\U{c:08x}" for c in told) + '"'


def value(chance: random.Random) -> str:
    """Return the text of a hostile value."""
    kind = chance.choices(
        [
            NUMBERS,
            WORDS,
            KINDS,
            BROKEN,
            long_word,
            long_number,
            deep,
            ranged,
            random_word,
        ],
        [6, 5, 5, 2, 2, 2, 2, 3, 2],
    )[0]
    return kind(chance) if callable(kind) else chance.choice(kind)


def key(chance: random.Random, known: list[str]) -> str:
    """Return a key that is known, nearly known, or nothing at all."""
    near = list(chance.choice(known))
    near[chance.randrange(len(near))] = chance.choice(string.printable[:62])
    return chance.choice([
        chance.choice(known), chance.choice(known), "".join(near),
        '"' + "k" * LONG + '"', "k" * LONG,
        '"\\u0000"', '""', '"a\\nb"', '"\\u001b[2J"',
        "a.b.c.d", '"__class__"', "constructor", "model_fields", ".".join("a" * 1500),
    ])  # fmt: skip


def bytes_of(text: str, chance: random.Random) -> bytes:
    """Return a document's bytes, now and then with some that no text has."""
    data = bytearray(text.encode("utf-8", "surrogatepass"))
    kind = chance.randrange(12)
    place = chance.randrange(len(data) + 1)
    if kind == 0:
        data[place:place] = chance.choice(
            [b"\0", b"\xff", b"\xc3", b"\x1b[2J", b"\r", b"\xed\xa0\x80", b"\x7f"]
        )
    elif kind == 1:
        del data[place:]
    elif kind == 2:
        data[:0] = chance.choice([b"\xef\xbb\xbf", b"\xff\xfe", b"#" * LONG + b"\n"])
    elif kind == 3 and place < len(data):
        data[place] ^= 1 << chance.randrange(8)
    return bytes(data)
