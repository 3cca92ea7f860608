"""`hpcwhirl inputs` tells every input as the code takes it."""

import datetime as dt
import json
import re
from pathlib import Path

import pytest

from hpcwhirl.cli import main
from hpcwhirl.errors import InputError
from hpcwhirl.scene import (
    Scene,
    apply_settings,
    flatten,
    preset_inputs,
    preset_loss,
    preset_names,
    to_toml,
)
from hpcwhirl.scene.campaign_tables import (
    BranchTable,
    Campaign,
    Refine,
    SampleTable,
    TwinsTable,
)
from hpcwhirl.scene.catalogue import catalogue, design_tables
from hpcwhirl.scene.documents import DESIGN_TABLES, scene_of_document
from hpcwhirl.scene.input_names import SYNONYMS, full_name
from hpcwhirl.scene.laws import LAWS

DEFAULTS = Path(__file__).with_name("defaults.toml")
INPUTS = flatten(Scene())
LIMITED = [
    (name, sign, float(limit))
    for name, fact in catalogue().items()
    for sign, limit in re.findall(r"(>=?|<=) (\d+)", fact.allowed)
    if not fact.allowed.startswith("[]")
]


def printed(capsys, *line):
    code = main(["inputs", *line])
    out, err = capsys.readouterr()
    return code, out, err


def shown(value):
    """Return a default as the command tells it."""
    return json.dumps(value) if isinstance(value, str | list) else f"{value:g}"


def test_defaults_are_those_that_users_count_on():
    """A campaign that leaves an input out has its default: none changes unnoticed."""
    assert to_toml(Scene()) == DEFAULTS.read_text("utf-8")


@pytest.mark.parametrize("name", INPUTS)
def test_an_input_is_told_with_its_default_unit_and_meaning(capsys, name):
    code, out, _ = printed(capsys, name)
    told, fact = " ".join(out.split()), catalogue()[name]
    assert code == 0
    assert f"{fact.name}, in [{fact.table}]: {fact.meaning}" in told
    assert f"default: {shown(INPUTS[name])} {fact.unit}".strip() in told
    assert f"allowed: {fact.allowed}" in told
    assert fact.rules in told
    assert len(fact.meaning) > len("a number")


def test_defaults_told_are_those_of_a_scene():
    assert {name: fact.default for name, fact in catalogue().items()} == INPUTS


def test_all_inputs_stand_in_the_tables_of_a_file(capsys):
    code, out, _ = printed(capsys)
    assert code == 0
    for name, value in INPUTS.items():
        table, _, own = name.rpartition(".")
        part = out[out.index(f"[{table or 'scene'}]") :].split("\n\n")[0]
        line = rf"^{own} +{re.escape(shown(value))} "
        assert re.search(line, part, re.MULTILINE), name


@pytest.mark.parametrize(("name", "sign", "limit"), LIMITED)
def test_a_limit_told_is_the_limit_held(name, sign, limit):
    step = 1 if isinstance(INPUTS[name], int) else 1e-3
    beyond = limit + step if sign == "<=" else limit - step
    if sign == ">":
        beyond = limit
    if "-1" in catalogue()[name].allowed:
        apply_settings(Scene(), {name: -1.0})
    wrong = int(beyond) if isinstance(step, int) else float(beyond)
    with pytest.raises(InputError, match=f"{sign} {limit:g}"):
        apply_settings(Scene(), {name: wrong})


def test_words_allowed_are_the_words_taken():
    words = {n: f.allowed for n, f in catalogue().items() if " | " in f.allowed}
    assert len(words) == 18
    for name, allowed in words.items():
        with pytest.raises(InputError, match="must be one of") as refused:
            apply_settings(Scene(), {name: "sideways"})
        assert all(f"'{word}'" in str(refused.value) for word in allowed.split(" | "))


def test_units_are_no_part_of_the_meaning():
    facts = catalogue().values()
    units = {fact.unit for fact in facts} - {""}
    assert len(units) == 18
    assert not any(fact.meaning.endswith(tuple(f", {u}" for u in units))
                   for fact in facts)  # fmt: skip


def test_a_name_of_two_tables_tells_both(capsys):
    _, out, _ = printed(capsys, "damping")
    assert out.index("[engine.casing]") < out.index("[engine.rotor]")
    assert "0.064" in out
    assert "0.0085" in out


@pytest.mark.parametrize("word", ["casing", "engine.casing", "[engine.casing]"])
def test_a_table_is_told_whole(capsys, word):
    _, out, _ = printed(capsys, word)
    for name in INPUTS:
        if name.startswith("engine.casing."):
            assert f"\n{name.rpartition('.')[2]} " in out
    assert "\nblades " not in out


@pytest.mark.parametrize(
    ("wrong", "right"),
    [("sspeed", "speed"), ("frictoin", "friction"), ("casig", "casing"),
     ("presets", "preset"), ("drat", "draft"), ("rotor.blade", "rotor")],
)  # fmt: skip
def test_an_unknown_name_is_one_line_with_the_nearest_known(capsys, wrong, right):
    code, out, err = printed(capsys, wrong)
    assert (code, out) == (2, "")
    assert len(err.splitlines()) == 1
    assert wrong in err
    assert right in err


@pytest.mark.parametrize(
    ("word", "names"),
    [("clearance", {"gap", "film_clearance", "stop_clearance"}),
     ("Coulomb", {"friction"}), ("lobes", {"nodal_diameter"}),
     ("coriolis", {"rotation"})],
)  # fmt: skip
def test_a_word_that_names_no_input_is_looked_for_in_meanings(capsys, word, names):
    code, out, _ = printed(capsys, word, "--json")
    assert code == 0
    assert {fact["name"] for fact in json.loads(out)["inputs"]} == names


@pytest.mark.parametrize(
    ("word", "told"),
    [("imbalance", 'unbalance = "20 g mm"'), ("coating", "hpcwhirl manual layer"),
     ("seal", "hpcwhirl manual trust"),
     ("bearings", "centre_stiffness"),
     ("rpm", 'speed = "3000 rpm"'), ("MM", 'gap = "0.8 mm"')],
)  # fmt: skip
def test_what_is_no_input_is_told_in_its_place(capsys, word, told):
    code, _, err = printed(capsys, word)
    assert code == 2
    assert told in err
    assert "did you mean" not in err


@pytest.mark.parametrize("word", SYNONYMS)
def test_a_word_of_the_field_leads_to_its_input(word, capsys):
    meant = SYNONYMS[word]
    hint = f"'{word}'; did you mean '{meant}'?"
    with pytest.raises(InputError, match=re.escape(hint)):
        full_name(word)
    with pytest.raises(InputError, match=re.escape(hint)):
        scene_of_document({"scene": {word: 1.0}})
    assert main(["inputs", word]) in {0, 2}  # a list by meaning, or the hint
    out, err = capsys.readouterr()
    assert out or hint in err
    assert main(["inputs", meant]) == 0


def test_presets_are_told_with_what_they_set_and_lose(capsys):
    _, out, _ = printed(capsys, "preset")
    for name in preset_names():
        part = out[out.index(f"--preset {name}\n") :].split("--preset", 2)[1]
        assert preset_loss(name) in part
        for full, value in preset_inputs(name).items():
            said = f'"{value}"' if isinstance(value, str) else f"{value:g}"
            assert f"{full} = {said}" in part
    assert printed(capsys, "draft")[1] in out


def test_facts_are_json(capsys):
    found = json.loads(printed(capsys, "gap", "--json")[1])["inputs"]
    assert found == [
        {"name": "gap", "table": "scene", "default": 1.28e-4, "unit": "m",
         "meaning": "blade-tip clearance", "allowed": "number >= 0",
         "rules": "at most 10 tip radii"}
    ]  # fmt: skip
    told = json.loads(printed(capsys, "preset", "--json")[1])["presets"]
    assert [each["inputs"] for each in told] == [*map(preset_inputs, preset_names())]


INPUT = "<input>"
CAMPAIGN_KEYS = {
    "sweep": {INPUT},
    "zip": {INPUT},
    "cases": {INPUT},
    "sample": {"method", "count", "seed", "tuned", INPUT},
    "refine": set(Refine.model_fields),
    "twins": set(TwinsTable.model_fields),
    "branch": set(BranchTable.model_fields),
    "campaign": set(Campaign.model_fields),
}
MODELS = {
    "sample": SampleTable, "refine": Refine, "twins": TwinsTable,
    "branch": BranchTable, "campaign": Campaign,
}  # fmt: skip
LEAST = {  # what a table must have
    "sample": {"count": 2, "gap": {"distribution": "uniform", "low": 0, "high": 1}},
    "refine": {"over": "speed", "levels": 1},
    "branch": {"over": "speed"},
    "saltelli": {"force": {"distribution": "uniform", "low": 0, "high": 1}},
}


def test_tables_of_a_campaign_have_the_keys_that_the_program_takes():
    found = {name: {f.name for f in facts} for name, facts in design_tables().items()}
    assert found == CAMPAIGN_KEYS
    assert tuple(found) == DESIGN_TABLES
    (told,) = (f.meaning for f in design_tables()["sample"] if f.name == INPUT)
    for law, one in LAWS.items():
        assert re.search(rf"\b{law}\b", told)
        assert all(name in told for name in one.model_fields.keys() - {"distribution"})


@pytest.mark.parametrize(
    ("table", "name"),
    [(f.table, f.name) for facts in design_tables().values() for f in facts
     if f.name != INPUT],
)  # fmt: skip
def test_a_key_tells_its_default_and_refuses_what_it_does_not_tell(table, name):
    (fact,) = (f for f in design_tables()[table] if f.name == name)
    read = MODELS[table].of if table == "sample" else MODELS[table].read
    where = () if table == "sample" else (f"[{table}]",)
    least = LEAST.get(table, {})
    if fact.default is not None and name != "sample":
        own = read(least | {name: fact.default}, *where)
        assert own == read(least, *where)
    with pytest.raises(
        InputError, match=rf"^\[{table}\] {name} .*, got datetime"
    ) as told:
        read(least | {name: dt.date(1979, 5, 27)}, *where)
    words = fact.allowed.partition(", or")[0].split(" | ")
    assert all(word in str(told.value) for word in words) or len(words) == 1
    for word in words if len(words) > 1 else ():
        read(least | LEAST.get(word, {}) | {name: word}, *where)


@pytest.mark.parametrize("table", CAMPAIGN_KEYS)
def test_tables_of_a_campaign_are_told_by_name(table, capsys):
    assert main(["inputs", f"[{table}]"]) == 0
    out = capsys.readouterr().out
    assert all(key in out for key in CAMPAIGN_KEYS[table])
    assert "()" not in out  # a list is told as TOML writes it
