"""The one language of conditions: what it means, in Python and on the page."""

import json
import math
import os
import re
import shutil
import subprocess
import tomllib
from importlib import resources
from pathlib import Path

import numpy as np
import pytest

from hpcwhirl.analysis.columns import matching, unit_remark
from hpcwhirl.analysis.condition import Check, Source
from hpcwhirl.analysis.expression import (
    FUNCTIONS,
    MEANING,
    Known,
    asker,
    holds,
    parse,
    value_of,
)
from hpcwhirl.analysis.rules import as_data
from hpcwhirl.errors import InputError
from hpcwhirl.scene.units import WRITTEN, in_si, written_factors

EXAMPLES = tomllib.loads(
    Path(__file__).with_name("conditions.toml").read_text(encoding="utf-8")
)
CASES = {n: np.array(v) for n, v in EXAMPLES["variables"].items()}
KINDS = {"condition": "truth", "number": "number"}
GIVEN = [  # (kind of value wanted, example)
    (wanted, example)
    for kind, wanted in KINDS.items()
    for group in EXAMPLES[kind]
    for example in group["examples"]
]
LONG = [  # (kind, text) that a table would not show well
    ("number", "+".join("1" * 900)), ("number", "-" * 1999 + "1"),
    ("number", "1" + " " * 2000), ("number", "1" * 310),
    ("number", "max(" + ", ".join("1" * 100) + ")"),
    *(("number", bracket * n + "1" + ")" * n)
      for bracket in ("(", "abs(") for n in (30, 31)),
    *(("truth", f"{a} {both} {b}") for both in ("and", "or")
      for a in ("1 < 2", "1 > 2", "late_lost > 2")
      for b in ("1 < 2", "1 > 2", "late_lost > 2")),
]  # fmt: skip
PAGE = """
const told = JSON.parse(require("fs").readFileSync(0, "utf8"));
const plain = (v) => (typeof v === "string" ? v : String(Number(v)));
const number = (text) => Number({ inf: "Infinity", "-inf": "-Infinity" }[text] ?? text);
const isText = (name) => told.texts.includes(name);
const source = {
  ...told.source,
  isText,
  variable: (name) => {
    if (!Object.hasOwn(told.cases, name)) refuse(`unknown variable '${name}'`);
    return name;
  },
};
console.log(JSON.stringify(told.asked.map(([wanted, text]) => {
  try {
    const of = compile(checked(parse(text), source, wanted).tree, (name) => {
      const column = told.cases[name];
      return (i) => (isText(name) ? column[i] : number(column[i]));
    });
    return { gives: [0, 1, 2, 3].map((i) => plain(of(i))) };
  } catch (failed) {
    return { refused: failed.message };
  }
})));
"""


def node():
    program = shutil.which("node")
    if program is None and os.environ.get("HPCWHIRL_EXPECT_BROWSER") != "1":
        pytest.skip("no node")
    return program


def variable(name):
    if name not in CASES:
        raise InputError(f"unknown variable '{name}'")
    return name


SOURCE = Source(variable, CASES.__getitem__, EXAMPLES["words"], 4, EXAMPLES["units"])
LANGUAGE = ("expression", "condition")  # the page's scripts


def asked_of_page(script, told):
    """Return the JSON that the page's language and a script print; told : its input."""
    place = resources.files("hpcwhirl.report.page") / "assets"
    parts = [(place / f"{name}.js").read_text(encoding="utf-8") for name in LANGUAGE]
    ended = subprocess.run(
        [node(), "-e", "\n".join([*parts, script])],
        input=json.dumps(told), capture_output=True, text=True, check=True,
    )  # fmt: skip
    return json.loads(ended.stdout)


def on_page(asked):
    """Return what the page gives of each (kind, text), or why it refuses it."""
    units = EXAMPLES["units"]
    factors = {unit: written_factors(unit) for unit in units.values()}
    told = {
        "asked": asked,
        "cases": {n: [str(v) for v in column] for n, column in CASES.items()},
        "texts": [n for n, column in CASES.items() if column.dtype.kind == "U"],
        "source": {"words": EXAMPLES["words"], "units": units, "factors": factors},
    }
    return [
        one.get("refused") or [*map(float, one["gives"])]
        for one in asked_of_page(PAGE, told)
    ]


def in_python(asked):
    """Return what Python gives of each (kind, text), or why it refuses it."""
    found = []
    for wanted, text in asked:
        try:
            program = Check(parse(text), SOURCE).named(wanted)
        except InputError as failed:
            found.append(str(failed))
            continue
        with np.errstate(all="ignore"):
            value = np.asarray(value_of(program, CASES), float)
        found.append(np.broadcast_to(value, 4).tolist())
    return found


def agrees(found, wanted):
    """Return whether values agree to round-off, or one refusal has the other's text.

    Hints at names, which only Python gives, do not count.
    """
    if isinstance(found, str) or isinstance(wanted, str):
        if not (isinstance(found, str) and isinstance(wanted, str)):
            return False
        plain = re.split("; (did you mean|known)", found)[0]
        return plain.removeprefix("cannot read the condition ").endswith(wanted)
    return bool(np.allclose(found, wanted, rtol=1e-14, atol=0.0, equal_nan=True))


@pytest.mark.turns
@pytest.mark.parametrize("ask", [in_python, on_page])
def test_an_example_has_the_value_or_the_refusal_of_the_table(ask):
    asked = [(wanted, example["text"]) for wanted, example in GIVEN]
    assert len(asked) > 150
    for (_, example), found in zip(GIVEN, ask(asked), strict=True):
        told = example.get("refused", example.get("gives"))
        assert agrees(found, told), (example, found)


@pytest.mark.turns
def test_the_page_and_python_agree_on_long_texts():
    for asked, one, other in zip(LONG, in_python(LONG), on_page(LONG), strict=True):
        plain = re.split("; known", other)[0] if isinstance(other, str) else other
        assert agrees(one, plain), (asked, one, other)


@pytest.mark.turns
def test_the_page_knows_the_functions_and_units_of_python():
    assert set(FUNCTIONS) <= set(MEANING)
    told = asked_of_page("console.log(JSON.stringify([FUNCTIONS, WRITTEN]))", None)
    assert told == [{n: list(counts) for n, counts in FUNCTIONS.items()}, [*WRITTEN]]
    texts = [f"{n}({', '.join(['2'] * least)})" for n, (least, _) in FUNCTIONS.items()]
    given = on_page([("number", text) for text in texts])
    assert [values[0] for values in given] == pytest.approx(
        [asker(text)(Known({})) for text in texts]
    )


@pytest.mark.parametrize("digits", ["0.3", "1e-7", "4000", "123456789.123456789"])
def test_the_page_converts_a_number_as_inputs_are_converted(digits):
    factors = {unit: written_factors(unit) for unit in ("m", "rad/s", "kg m", "N/m")}
    pairs = [(u, name) for u, names in factors.items() for name in names]
    script = (
        "console.log(JSON.stringify(JSON.parse(require('fs').readFileSync(0, 'utf8'))"
        ".map(([a, b]) => timesExactly(a, b))))"
    )
    found = asked_of_page(script, [(digits, factors[u][name]) for u, name in pairs])
    assert found == [in_si(f"{digits} {name}", u) for u, name in pairs]


def test_a_condition_that_nothing_fulfils_says_that_numbers_are_in_si():
    told = unit_remark("orbit_radius > 0.6", SOURCE)
    assert "here in m; with 0.6 mm it selects 1 case" in told
    assert unit_remark("orbit_radius > 3", SOURCE) == ""
    assert unit_remark("orbit_radius > 3000 mm", SOURCE) == ""
    assert unit_remark("friction > 0.6", SOURCE) == ""


def test_every_rule_is_a_condition_over_numbers_and_the_word_of_stop():
    """A rule is checked as a filter is: no number stands where a condition should."""
    from hpcwhirl.analysis.rules import evidence_names
    from hpcwhirl.scene.words import ENUMS

    told = as_data()
    columns = {n: np.ones(3) for n in evidence_names()}
    columns["stop"] = np.array(["end", "amplitude", "certain"])

    def variable(name):
        if name not in columns:
            msg = f"unknown variable '{name}'"
            raise InputError(msg)
        return name

    source = Source(variable, columns.__getitem__, {"stop": ENUMS["stop"]}, 3)
    truths = {
        "clear",
        "fed_less",
        "carried",
        "steady_rub",
    }  # conditions; the others are numbers
    assert truths <= told["defined"].keys()
    for name, text in told["defined"].items():
        columns[name] = np.asarray(value_of(parse(text), columns), float)
    for rules in told["tables"].values():
        for need in (need for rule in rules for need in rule["needs"]):
            plain = need.removeprefix("not ")
            if plain not in truths:
                assert matching(need, source).shape == (3,)


TRUTHS = {"yes": "1 < 2", "no": "1 > 2", "missing": "x > 2"}
NEGATED = {"yes": "no", "no": "yes", "missing": "missing"}


def truth_of(text):
    """Return which of TRUTHS a condition over a number x that is missing is."""
    value = float(asker(text)(Known({"x": math.nan})))
    return {1.0: "yes", 0.0: "no"}.get(value, "missing")


@pytest.mark.parametrize("a", TRUTHS)
@pytest.mark.parametrize("b", TRUTHS)
def test_what_is_missing_stays_so_unless_the_other_side_decides(a, b):
    """Kleene's logic: the least of both is `and`, the largest `or`."""
    order = ["no", "missing", "yes"]
    both = sorted([a, b], key=order.index)
    assert truth_of(f"{TRUTHS[a]} and {TRUTHS[b]}") == both[0]
    assert truth_of(f"{TRUTHS[a]} or {TRUTHS[b]}") == both[1]
    assert truth_of(f"not ({TRUTHS[a]})") == NEGATED[a]
    one, other = (f"({TRUTHS[each]})" for each in (a, b))  # De Morgan's law
    assert truth_of(f"not ({one} and {other})") == truth_of(f"not {one} or not {other}")


def test_no_case_without_a_number_is_selected_by_a_condition_or_its_opposite():
    rate = np.array([-1.0, 0.0, 2.0, math.nan])
    source = Source(str, {"rate": rate}.__getitem__, {}, 4)
    for text in ("rate > 0", "rate == 2", "rate in (2, 3)", "0 <= rate < 3"):
        once, other = (matching(t, source) for t in (text, f"not ({text})"))
        assert (once | other).tolist() == [True, True, True, False]
        assert not (once & other).any()


@pytest.mark.parametrize(
    ("text", "known", "gives"),
    [
        ("a == b", {"a": 1.0, "b": 1.0 + 5e-10}, True),
        ("a == b", {"a": 1.0, "b": 1.0 + 5e-9}, False),
        ("a == 0", {"a": 1e-300}, False),  # nothing but zero is near zero
        ("a == b", {"a": 3.0, "b": math.inf}, False),
        ("a == b", {"a": math.inf, "b": math.inf}, True),
        ("a == b", {"a": math.nan, "b": math.nan}, False),
        ("a != b", {"a": math.nan, "b": 1.0}, False),
    ],
)
def test_numbers_are_equal_to_nine_digits(text, known, gives):
    with np.errstate(all="ignore"):
        assert bool(holds(parse(text), known)) is gives


def test_a_step_has_the_text_that_it_completes():
    texts = [step.text for step in parse("'damped' == regime and speed > 3")]
    assert texts == [
        "'damped'", "regime", "'damped' == regime", "speed", "3", "speed > 3",
        "'damped' == regime and speed > 3",
    ]  # fmt: skip
