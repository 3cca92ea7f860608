"""The one language of conditions: what it means, in Python and on the page."""

import json
import math
import os
import re
import shutil
import subprocess
from importlib import resources
from types import SimpleNamespace

import numpy as np
import pytest

from hpcwhirl.analysis.columns import Source, matching
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

CASES = {
    "speed": [300.0, 410.0, 500.0, 1e300],
    "gap": [1e-4, 2e-4 * (1 + 3e-10), 0.0, -3.0],
    "regime": ["damped", "sustained", "divergent", "none"],
    "late_lost": [math.nan, math.inf, -math.inf, 0.0],
}
SIDES = ("1 < 2", "1 > 2", "late_lost > 2")  # the last is missing in one case
TEXTS = [
    "speed > 300", "300 <= speed < 500 < 501", "gap == 2e-4", "gap != 2e-4",
    "not speed / 2 - 50 >= 2e2 and (300 < speed < 450 or regime == damped)",
    "regime in (damped, 'sustained',)", "regime not in [damped]", "speed in {300, 410}",
    "-speed + 2 * 3 - 1 < --(gap + 1) * 5", "1 / gap > 0", "-1 / gap", "gap / gap",
    "late_lost == late_lost", "late_lost != 5", "5 == late_lost", "late_lost == 1 / 0",
    "min(speed, 4e2, late_lost)", "max(gap, 1, 2, late_lost)", "abs(gap) + sqrt(gap)",
    "log(speed) + log10(gap) - exp(gap)", "speed * 1e300 * 1e300", "exp(speed)",
    "gap * (speed > 400)", "regime == 'damped' or regime != sustained", "1.5e+2 + .5",
    "not not speed > 400", "speed - 1 - 2 - 3", "speed / 2 / 2 * 3", "1 - (2 - 3)",
    "+".join("1" * 900), "((speed)) > ((3))", "speed > 1 or speed > 2 and gap > 9",
    "", " ", "speed >", "speed = 3", "speed ! 3", "a && b", "a | b", "2 ** 3", "2 ^ 3",
    "7 % 2", "a <> b", "(1", "1)", "(1, 2)", "()", "in (1)", "1 in 2", "f(1)",
    "1 in (1",
    "min(1)", "abs(1, 2)", "max(" + ", ".join("1" * 100) + ")", "a not b", "and", "a b",
    "1 2", "'a", "1.2.3", "0x10", "1_000", "1j", "a.b.c", "a[0]", "lambda: 1", "a; b",
    "1" * 310, "1e309", "(" * 30 + "1" + ")" * 30, "(" * 31 + "1" + ")" * 31,
    "abs(" * 31 + "1" + ")" * 31, "-" * 1999 + "1", "1" + " " * 2000, "é == 'ü'", "$",
    "not late_lost > 0", "not (late_lost > 0 and speed > 1)", "not late_lost != 5",
    "late_lost > 0 or speed > 1", "late_lost > 0 and speed < 1",
    "not not gap / gap > 0",
    "late_lost in (1, 0)", "late_lost not in (1, 0)", "1 < speed < late_lost",
    "speed * (late_lost > 0)", "log(gap) > 0 or regime == none", "not log(gap) > 0",
    "toString(1)", "constructor", "__proto__ == 1",
    *(f"{a} {both} {b}" for both in ("and", "or") for a in SIDES for b in SIDES),
]  # fmt: skip
PAGE = """
const told = JSON.parse(require("fs").readFileSync(0, "utf8"));
const plain = (v) => (typeof v === "number" ? String(v) : v);
console.log(JSON.stringify(told.texts.map((text) => {
  try {
    const of = compile(parse(text), (name) => {
      if (!Object.hasOwn(told.cases, name)) return null;
      const column = told.cases[name];
      return (i) => (name === "regime" ? column[i] : Number(column[i]));
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


def on_page(texts):
    """Return what expression.js gives of each text, or why it refuses it."""
    assets = resources.files("hpcwhirl.report.page") / "assets" / "expression.js"
    cases = {n: [str(v) for v in row] for n, row in CASES.items()}
    for row in cases.values():
        row[:] = [{"inf": "Infinity", "-inf": "-Infinity"}.get(v, v) for v in row]
    script = assets.read_text(encoding="utf-8") + PAGE
    ended = subprocess.run(
        [node(), "-e", script],
        input=json.dumps({"texts": texts, "cases": cases}),
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    return [SimpleNamespace(**one) for one in json.loads(ended.stdout)]


def in_python(text):
    known = {n: np.array(v) for n, v in CASES.items()}
    with np.errstate(all="ignore"):
        found = np.broadcast_to(value_of(parse(text), known), 4)
    return found.tolist()


def agree(a, b):
    if isinstance(b, bool):
        return a == b  # Python has 1 and 0
    if isinstance(a, str) and isinstance(b, str) and a == b:
        return True
    b = float(b.replace("Infinity", "inf")) if isinstance(b, str) else b
    return np.isclose(a, b, rtol=1e-14, atol=0.0, equal_nan=True)


def test_the_page_and_python_read_and_mean_the_same():
    for text, page in zip(TEXTS, on_page(TEXTS), strict=True):
        if hasattr(page, "refused"):
            with pytest.raises(InputError, match=re.escape(page.refused) + "$"):
                parse(text)
        else:
            wanted = in_python(text)
            pairs = zip(wanted, page.gives, strict=True)
            assert all(agree(a, b) for a, b in pairs), (text, wanted, page)


def test_every_function_means_something_to_both():
    assert set(FUNCTIONS) <= set(MEANING)
    texts = [f"{n}({', '.join(['2'] * least)})" for n, (least, _) in FUNCTIONS.items()]
    given = on_page(texts)
    assert [float(page.gives[0]) for page in given] == pytest.approx(
        [asker(text)(Known({})) for text in texts]
    )


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
