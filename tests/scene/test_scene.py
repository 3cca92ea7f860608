"""Inputs: what is accepted, what is refused and in which words, and what names them."""

import math
import random
import tomllib
from functools import reduce
from operator import getitem

import pytest
import tomli_w
from hypothesis import given, settings
from hypothesis import strategies as st

from hpcwhirl.errors import SHOWN, InputError, WhirlError, unknown
from hpcwhirl.scene import (
    NAMED,
    Rotor,
    Scene,
    apply_settings,
    digest,
    flatten,
    input_names,
    load_document,
    load_scene,
    named_scene,
    parse_setting,
    scene_from,
    to_toml,
)
from hpcwhirl.scene.documents import scene_of_document
from hpcwhirl.scene.input_names import full_name
from hpcwhirl.scene.rules import CHANGING
from hpcwhirl.scene.shaft_tables import text_of

positive = st.floats(1e-12, 1e12)
WORDS = {
    "engine.name": "another",
    "engine.file": __file__,  # its bytes are read, not its rotor
    "engine.rotor.centre": "clamped",
    "engine.casing.kind": "rigid",
    "engine.casing.discretization": "elements",
    "solver.scheme": "paper",
    "solver.plan": "everything",
    "solver.until": "certain",
    "solver.estimate": "step",
    "output.traces": "full",
    "output.forces": "supports",
    "direction": "stretch",
    "engine.casing.families": "bending",
    "engine.rotation": "full",
    "gap_at": "rest",
    "start_modes": "casing 2",
    "start_as": "both",
    "ramp": "smooth",
    "speed_table": "time,speed;0.0,410.0;1.0,420.0",
    "gap_table": "time,gap;0.0,0.000128;1.0,0.0002",
    "branch": "up",
    "engine.casing.contact_law": "archard",
    "friction_law": "stribeck",
    "friction_table": "slip,friction;0.0,0.1;2.0,0.05",
    "slip": "set-valued",
    "history": "speed = 300.0",
    "engine.rotor.shaft": "cantilever",
    "engine.casing.profile": "harmonic,amplitude,phase;2.0,1e-05,0.5",
    "engine.rotor.bearing": (
        "frequency,kxx,kxy,kyx,kyy,cxx,cxy,cyx,cyy;0.0,1.0,0.0,0.0,1.0,1.0,0.0,0.0,1.0"
    ),
}
TURNING = {"rotation": "full"}
STANDING = [  # what supports do in the static frame
    f"engine.rotor.{name}"
    for name in (
        "cross_coupling",
        "stiffness_difference",
        "damping_difference",
        "film_viscosity",
        "stop_clearance",
    )
]
BEARING = "engine.rotor.bearing"
LOST = "engine.rotor.lost_blade"
NEEDS = dict.fromkeys(  # but for 0
    [*STANDING, "unbalance", "gravity", "gap_at", "engine.rotor.shaft", LOST, BEARING],
    TURNING,
)
NEEDS["engine.rotor.shaft_station"] = TURNING | {
    "shaft": text_of(
        {
            "sections": [{"length": 1.0, "outer": 0.1}],
            "bearings": [{"station": i, "kxx": 1e7} for i in (0, 1)],
        },
        "the shaft",
    )
}
NEEDS["friction_table"] = {"friction_law": "table"}
NEEDS["lost_blade_time"] = TURNING | {LOST: 3}
VALUES = {
    "speed": st.floats(1e-3, 1e4) | st.floats(-1e4, -1e-3),
    "nodal_diameter": st.integers(0, 20),
    "gap": st.floats(0, 1),
    "friction": st.floats(0, 10),
    "force": positive,
    "pulse": positive,
    "duration": st.floats(1e-12, 1e6),
    "revolutions": st.floats(0, 1e3),
    "solver.time_step": st.floats(1e-6, 1e12),
    "solver.modes": st.integers(0, 10**6),
    "output.traces": st.sampled_from(["summary", "orbit", "full"]),
    "engine.name": st.text(st.characters(codec="utf-8"), max_size=20).filter(
        str.isprintable
    ),
    "engine.rotor.blades": st.integers(1, 1000),
    "engine.casing.growth": st.floats(-1e6, 1e6),
    "engine.casing.kind": st.sampled_from(["ring", "rigid"]),
}


def another(name):
    """Return a valid value of an input that is not its default."""
    value = flatten(Scene())[name]
    if isinstance(value, str):
        return WORDS[name]
    if isinstance(value, list):
        return [0.01] * 22
    return value + 1 if isinstance(value, int) else 0.9 * value + 1e-9


def refusal(function, *arguments):
    with pytest.raises(InputError) as caught:
        function(*arguments)
    text = str(caught.value)
    assert len(text.splitlines()) == 1
    return text


def shuffled(data, chance):
    items = list(data.items())
    chance.shuffle(items)
    return {k: shuffled(v, chance) if isinstance(v, dict) else v for k, v in items}


@pytest.mark.turns
@settings(max_examples=30)
@given(st.fixed_dictionaries({}, optional=VALUES))
def test_a_scene_written_as_toml_is_read_back_the_same(tmp_path_factory, values):
    scene = apply_settings(Scene(), values)
    path = tmp_path_factory.getbasetemp() / "scene.toml"
    path.write_text(to_toml(scene), encoding="utf-8")
    again = load_scene(path)
    assert again == scene
    assert digest(again) == digest(scene)


@pytest.mark.parametrize("name", NAMED)
def test_named_scenes_are_read_back_the_same(name):
    scene = named_scene(name)
    assert scene_of_document(tomllib.loads(to_toml(scene))) == scene


def test_every_input_is_set_and_written_by_its_dotted_name():
    values = {name: another(name) for name in input_names()}
    values["engine.rotor.mistuning"] = []  # not with a file, and of another length
    values["engine.casing.families"] = "all"  # of elements
    still = *STANDING, "unbalance", "gravity"  # of a clamped centre
    values |= dict.fromkeys(still, 0.0)
    values["engine.rotor.shaft_station"] = 0  # of a shaft with mass
    values |= {"engine.rotor.shaft": "springs", LOST: -1, BEARING: ""}
    values["lost_blade_time"] = 0.0  # nor without its blade
    values |= {**CHANGING, "history": "", "branch": "start"}  # not with chaos or shapes
    values |= {"engine.casing.contact_law": "rigid", "friction_law": "constant"}  # nor
    values["friction_table"] = ""  # without its law
    values["engine.casing.profile_release"] = 0.0  # not of a rigid casing
    scene = apply_settings(Scene(), values)
    assert flatten(scene) == values
    assert flatten(scene_of_document(tomllib.loads(to_toml(scene)))) == values


def test_every_input_changes_the_digest():
    scenes = [
        apply_settings(Scene(), {n: another(n)} | NEEDS.get(n, {}))
        for n in input_names()
    ]
    digests = {digest(scene) for scene in (Scene(), *scenes)}
    assert len(digests) == 1 + len(input_names())


@pytest.mark.parametrize("seed", range(2))
def test_the_order_of_a_file_is_no_matter_to_the_digest(seed):
    document = shuffled(
        tomllib.loads(to_toml(named_scene("table1"))), random.Random(seed)
    )
    again = tomllib.loads(tomli_w.dumps(document))
    assert digest(scene_of_document(again)) == digest(named_scene("table1"))


def test_a_whole_number_is_the_same_input_as_its_float():
    assert digest(apply_settings(Scene(), {"speed": 410})) == digest(Scene(speed=410.0))


def test_every_input_has_a_description():
    assert all(input_names().values())


def test_a_setting_may_be_named_by_an_unambiguous_ending():
    for short in ("time_step", "solver.time_step"):
        scene = apply_settings(Scene(), {short: 2e-7})
        assert scene.solver.time_step == 2e-7
    ring = apply_settings(Scene(), {"casing.young": 1e11}).engine
    assert (ring.casing.young, ring.rotor.young) == (1e11, Rotor().young)


@pytest.mark.parametrize("name", ["young", "damping", "density", "elements"])
def test_an_ambiguous_name_is_refused_with_both_its_homes(name):
    text = refusal(apply_settings, Scene(), {name: 3})
    assert f"engine.rotor.{name}" in text
    assert f"engine.casing.{name}" in text


@pytest.mark.parametrize(
    ("wrong", "right"),
    [("sped", "speed"), ("timestep", "time_step"), ("frictoin", "friction"),
     ("nodal_diam", "nodal_diameter"), ("engine.rotor.blade", "engine.rotor.blades")],
)  # fmt: skip
def test_an_unknown_name_is_refused_with_the_nearest_one(wrong, right):
    assert f"did you mean '{right}'?" in refusal(parse_setting, f"{wrong}=1")


def test_as_many_known_names_are_told_as_there_is_room_for():
    names = [letter * (SHOWN - 2) for letter in "xyz"]
    assert str(unknown("word", "0", names)).endswith(f"; known: {', '.join(names)}")
    told = str(unknown("word", "0", [*names, "zz"]))
    assert told.endswith(f"; known: {names[0]}, {names[1]}, zz and 1 more")


@pytest.mark.parametrize(
    ("document", "words"),
    [
        ("[scene]\nspeedy = 3", ("[scene]", "'speedy'", "'speed'")),
        ("[engine.rotor]\nblade = 3", ("[engine.rotor]", "'blade'", "'blades'")),
        ("[solver]\nstep = 1e-6", ("[solver]", "'step'", "'time_step'")),
        ("[engines.rotor]\nblades = 3", ("'engines'", "'engine'")),
        ("[scene]\ntime_step = 1e-6", ("[scene]", "'time_step'", "[solver]")),
        ("[engine]\nyoung = 1.0", ("[engine.rotor]", "[engine.casing]")),
        ("[scene]\nsolver = 3", ("[scene]", "[solver]")),
        ("[engine]\nrotor = 3", ("engine.rotor", "table", "3")),
        ("scene = 3", ("[scene]", "table", "3")),
    ],
)
def test_a_wrong_key_is_named_with_its_table_and_the_right_one(document, words):
    text = refusal(scene_of_document, tomllib.loads(document))
    assert all(word in text for word in words)


@pytest.mark.parametrize(
    ("name", "value", "allowed"),
    [
        ("gap", -1e-4, ">= 0"),
        ("speed", math.nan, "finite"),
        ("speed", "fast", "a number"),
        ("speed", True, "a number"),
        ("nodal_diameter", -1, ">= 0"),
        ("nodal_diameter", 1.5, "whole number"),
        ("nodal_diameter", 21, "<= 20"),
        ("friction", -0.1, ">= 0"),
        ("duration", 0.0, "> 0"),
        ("duration", math.inf, "finite"),
        ("direction", "sideways", "'squeeze' or 'stretch'"),
        ("solver.modes", "many", "whole number"),
        ("solver.modes", 2.5, "whole number"),
        ("solver.time_step", 0.0, "> 0"),
        ("solver.scheme", "exactly", "'modal'"),
        ("engine.name", 3, "a string"),
        ("engine.rotor.blades", 0, ">= 1"),
        ("engine.rotor.disk_radius", 0.6, "< radius (0.5 m)"),
        ("engine.casing.young", -1.0, "> 0"),
        ("engine.casing.growth", -math.inf, "finite"),
    ],
)
def test_a_wrong_value_is_told_in_one_line_what_got_allowed(name, value, allowed):
    text = refusal(apply_settings, Scene(), {name: value})
    assert name.rsplit(".", 1)[-1] in text
    assert f"got {value!r}" in text
    assert allowed in text


@pytest.mark.parametrize(
    ("text", "got"),
    [("speed", "speed"), ("speed=", "speed="), ("=3", "=3"), ("", ""),
     ("speed=[1, 2]", "[1, 2]"), ("speed={a = 1}", "{a = 1}")],
)  # fmt: skip
def test_a_setting_is_a_name_and_one_value(text, got):
    assert f"got '{got}'" in refusal(parse_setting, text)


@pytest.mark.parametrize(
    ("raw", "value"),
    [("410", 410), ("1e-6", 1e-6), (".5", 0.5), ("-3.", -3.0), ("1_000", 1000)],
)
def test_a_number_may_be_set_as_engineers_write_it(raw, value):
    assert parse_setting(f" speed = {raw}") == ("speed", value)


@pytest.mark.paper
def test_named_scenes_are_those_of_the_papers_tables():
    one, two = named_scene("table1"), named_scene("table2")
    assert (one.gap, one.friction, one.revolutions) == (1e-3, 0.2, 20.0)
    assert (two.gap, two.friction, two.end_time) == (1.28e-4, 0.1, 2.5)
    assert one.speed == two.speed == 410.0


def test_a_word_needs_no_quotes():
    for raw in ("clamped", '"clamped"'):
        assert parse_setting(f"centre={raw}") == ("engine.rotor.centre", "clamped")


@pytest.mark.parametrize("speed", [410.0, -410.0])
def test_revolutions_set_the_end_time(speed):
    scene = Scene(speed=speed, revolutions=20.0, duration=1.0)
    assert scene.end_time == pytest.approx(20 * 2 * math.pi / 410.0, rel=1e-15)
    assert Scene(speed=speed, duration=1.5).end_time == 1.5


def test_a_scene_cannot_be_changed():
    for part, name in ((Scene(), "gap"), (Scene().solver, "modes"), (Rotor(), "young")):
        with pytest.raises(ValueError, match="frozen"):
            setattr(part, name, 1)


@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"], ids=["none", "BOM"])
@pytest.mark.parametrize("end", [b"\n", b"\r\n"], ids=["LF", "CRLF"])
def test_a_file_is_read_as_editors_of_any_system_write_it(tmp_path, mark, end):
    path = tmp_path / "scene.toml"
    path.write_bytes(mark + end.join([b"[scene]", b"speed = 300", b""]))
    assert load_document(path) == {"scene": {"speed": 300}}


@pytest.mark.parametrize("content", [None, b"[scene\n", b"speed = ", b"\xff\xfe"])
def test_a_file_that_cannot_be_read_is_one_line_with_its_name(tmp_path, content):
    path = tmp_path / "scene.toml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(WhirlError) as caught:
        load_document(path)
    assert "scene.toml" in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


CHANGES = [
    {"speed": 300.0},
    {"engine.rotor.blades": 21},
    {"engine.rotor.blades": 21, "engine.casing.harmonics": 6, "gap": 2e-4},
    {"time_step": 2e-6, "traces": "summary", "nodal_diameter": 2},
    {"engine.rotor.mistuning": [0.01] * 22},
    {"nodal_diameter": 10_000},  # allowed of a ring of more harmonics alone
    {"engine.rotor.blades": 21, "engine.rotor.mistuning": [0.01] * 22},
    {"gap": 1e3},
    {"engine.rotor.blades": 0},
    {"until": "decided", "longest": 1e-3},
]


# tables that no change touches are shared: all rules hold as of the whole
@pytest.mark.parametrize("changes", CHANGES)
def test_what_is_not_set_is_as_it_was_and_checked_with_what_is(changes):
    def outcome(make):
        try:
            return make()
        except InputError as refused:
            return str(refused)

    def whole():
        data = named_scene("table2").model_dump()
        for name, value in changes.items():
            *tables, leaf = full_name(name).split(".")
            reduce(getitem, tables, data)[leaf] = value
        return scene_from(data)

    base = named_scene("table2")
    before = flatten(base)
    found = outcome(lambda: apply_settings(base, changes))
    assert found == outcome(whole)
    assert flatten(base) == before
