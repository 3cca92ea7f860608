"""`hpcwhirl inputs` tells every input as the code takes it."""

import datetime as dt
import json
import re

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

# dotted name: default as it is told, and what its line must say
TOLD = {
    "speed": ("410", "rad/s", "Omega", "negative turns clockwise"),
    "nodal_diameter": ("1", "lobes k", "squeezes"),
    "gap": ("0.000128", "clearance", "m"),
    "gap_at": ('"speed"', "rest", "grow"),
    "friction": ("0.1", "Coulomb coefficient"),
    "friction_law": ('"constant"', "stribeck", "friction_at_rest", "exp"),
    "friction_at_rest": ("0.2", "Stribeck", "without sliding"),
    "friction_speed": ("10", "m/s", "falls"),
    "force": ("75000", "F sin(pi t / tau)", "N"),
    "pulse": ("0.00063", "s", "10 time steps at least"),
    "direction": ('"squeeze"', "stretch", "theta = 0"),
    "unbalance": ("0", "kg m", "m e Omega^2", "rotation full"),
    "unbalance_phase": ("0", "rad", "blade 0"),
    "branch": ('""', "up or down", "[branch]"),
    "history": ('""', "began", "its pulse", "[branch]"),
    "acceleration": ("0", "rad/s^2", "run-up", "constant speed"),
    "ramp": ('"linear"', "half a cosine", "time constant", "windmilling"),
    "speed_to": ("0", "rad/s", "`ramp`"),
    "speed_table": ('""', "time, s", "linear between rows", "kept as text"),
    "gap_closure": ("0", "m", "heat", "gap_time"),
    "gap_time": ("1", "s", "time constant"),
    "gap_table": ('""', "time, s", "gap, m", "then held"),
    "duration": ("2.5", "s", "revolutions"),
    "revolutions": ("0", "not s"),
    "engine.name": ('"four_motions"', "engine"),
    "engine.file": ('""', "HDF5", "rotor", "relative path"),
    "engine.rotation": ('"none"', "Coriolis", "not turn", "gap_at", "auto"),
    "engine.casing.kind": ('"ring"', "rigid", "exp(sigma t)", "static frame"),
    "engine.casing.discretization": ('"fourier"', "elements"),
    "engine.casing.harmonics": ("20", "highest harmonic H", "two modes"),
    "engine.casing.families": ('"all"', "bending", "stretch"),
    "engine.casing.axial_modes": ("3", "half waves", "shell"),
    "engine.casing.poisson": ("0.3", "shell"),
    "engine.casing.elements": ("40", "curved beam", "4 degrees of freedom"),
    "engine.casing.thickness": ("0.0413", "radial", "m"),
    "engine.casing.width": ("0.322", "axial", "m"),
    "engine.casing.young": ("2.1e+11", "Pa"),
    "engine.casing.density": ("7800", "kg/m^3"),
    "engine.casing.support_frequency": ("15", "rad/s", "rho A omega_c1^2"),
    "engine.casing.damping": ("0.064", "modal damping ratio"),
    "engine.casing.support_damping": ("0.375", "support", "-1"),
    "engine.casing.amplitude": ("0", "rigid", "A0", "m"),
    "engine.casing.growth": ("0", "rigid", "1/s", "5 % per step"),
    "engine.casing.rise": ("0.001", "rigid", "s", "50 steps"),
    "engine.rotor.blades": ("22", "number of blades N"),
    "engine.rotor.elements": ("10", "elements per blade", "15000"),
    "engine.rotor.radius": ("0.5", "tip", "m"),
    "engine.rotor.disk_radius": ("0.035891", "rim", "m"),
    "engine.rotor.blade_width": ("0.13275", "m"),
    "engine.rotor.root_thickness": ("0.010548", "m"),
    "engine.rotor.taper": ("0.77753", "at the tip to that at the root"),
    "engine.rotor.spoke_width": ("0.0039693", "centre to the blade roots", "m"),
    "engine.rotor.spoke_thickness": ("0.051338", "m"),
    "engine.rotor.rim_width": ("0.99966", "root to root", "m"),
    "engine.rotor.rim_thickness": ("0.0080619", "m"),
    "engine.rotor.young": ("2.1e+11", "Pa"),
    "engine.rotor.density": ("7800", "kg/m^3"),
    "engine.rotor.centre": ('"free"', "clamped"),
    "engine.rotor.centre_stiffness": ("3.4e+07", "k_o", "N/m"),
    "engine.rotor.damping": ("0.0085", "modal damping ratio"),
    "engine.rotor.suspension_damping": ("0.0275", "squeeze film", "-1"),
    "engine.rotor.cross_coupling": ("0", "k_q", "N/m", "forward"),
    "engine.rotor.stiffness_difference": ("0", "(k_x - k_y)/2", "N/m", "static frame"),
    "engine.rotor.film_viscosity": ("0", "squeeze-film", "Pa s", "cavitation"),
    "engine.rotor.film_length": ("0.03", "axial", "m"),
    "engine.rotor.film_radius": ("0.06", "squeeze film", "m"),
    "engine.rotor.film_clearance": ("0.0002", "radial clearance", "m", "centre_peak"),
    "engine.rotor.bearing": ('""', "over speed", "frequency, rad/s", "cyy", "text"),
    "engine.casing.profile": ('""', "not round", "harmonic", "departure", "text"),
    "engine.casing.profile_scale": ("1", "factor"),
    "engine.casing.offset": ("0", "m", "axis", "narrower"),
    "engine.casing.offset_angle": ("0", "rad"),
    "engine.casing.profile_release": ("0", "s", "let go", "never"),
    "engine.casing.profile_rise": ("0", "s", "fade in", "50 steps"),
    "engine.casing.contact_law": ('"rigid"', "abradable", "archard", "penetrate"),
    "engine.casing.layer_rods": ("4", "under the edge", "numerical"),
    "engine.casing.layer_edge": ("0.004", "tip's edge", "m"),
    "engine.casing.layer_width": ("0.05", "axial", "m"),
    "engine.casing.layer_thickness": ("0.005", "thickness l", "m"),
    "engine.casing.layer_young": ("1e+09", "Young's modulus", "Pa"),
    "engine.casing.layer_yield": ("1e+06", "plastic", "Pa"),
    "engine.casing.layer_hardening": ("1e+08", "plastic modulus", "Pa"),
    "engine.casing.wear_coefficient": ("1e-12", "sliding distance", "1/Pa"),
    "engine.rotor.lost_blade": ("-1", "lost", "counted from 0", "unbalanced"),
    "engine.rotor.shaft": ('"springs"', "cantilever", "two bearings", "tilts"),
    "engine.rotor.shaft_length": ("0.6", "L_1", "m"),
    "engine.rotor.shaft_overhang": ("0.4", "second bearing", "m"),
    "engine.rotor.shaft_diameter": ("0.1", "round", "m"),
    "engine.rotor.shaft_young": ("2.1e+11", "Pa"),
    "engine.rotor.polar_inertia": ("0", "axis of rotation", "kg m^2"),
    "engine.rotor.tilt_inertia": ("0", "diameter", "kg m^2", "thin disk"),
    "engine.rotor.damping_difference": ("0", "(c_x - c_y)/2", "N s/m", "static frame"),
    "engine.rotor.mistuning": ("[]", "Young's modulus", "E_j = E (1 + delta_j)"),
    "solver.scheme": ('"modal"', "jumps", "mode by mode", "Algorithm 1"),
    "solver.time_step": ("1e-06", "s", "stable"),
    "solver.accuracy": ("0", "damped frequencies", "0.9"),
    "solver.truncation": ("0", "modes", "harmonics", "families", "estimate"),
    "solver.plan": ('"lean"', "everything", "requires"),
    "solver.until": ('"end"', "certain", "proved", "decided", "twice"),
    "solver.longest": ("20", "s", "largest", "decided"),
    "solver.modes": ("110", "fixed-interface", "Craig-Bampton"),
    "solver.amplitude_limit": ("0.1", "ends"),
    "output.traces": ('"orbit"', "summary", "full", "tips"),
    "output.interval": ("0.0002", "s", "samples"),
    "start_energy": ("0", "J", "energy", "at rest", "force", "unbalance"),
    "start_modes": ('"rotor 1F 1"', "body", "family", "nodal diameter", "commas"),
    "start_draw": ("0", "uniform", "shell", "[sample]"),
    "start_as": ('"velocities"', "both", "displacements", "refused"),
    "output.windows": ("20", "equal time", "same rules"),
    "output.chaos": ("0", "revolutions", "sustained", "Lyapunov"),
}
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


def test_every_input_there_is_has_a_line_of_its_own_here():
    assert TOLD.keys() == flatten(Scene()).keys()


@pytest.mark.parametrize("name", TOLD)
def test_an_input_is_told_with_its_default_and_meaning(capsys, name):
    code, out, _ = printed(capsys, name)
    default, *said = TOLD[name]
    if "in [" not in out:  # several of this name, as of `damping`
        pytest.fail(out)
    assert code == 0
    assert re.search(rf"default: {re.escape(default)}( |$)", out, re.MULTILINE)
    assert all(word in out for word in said), out


def test_defaults_told_are_those_of_a_scene():
    defaults = flatten(Scene())
    assert {name: fact.default for name, fact in catalogue().items()} == defaults


def test_all_inputs_stand_in_the_tables_of_a_file(capsys):
    code, out, _ = printed(capsys)
    assert code == 0
    for name, (default, *_) in TOLD.items():
        table, _, own = name.rpartition(".")
        part = out[out.index(f"[{table or 'scene'}]") :].split("\n\n")[0]
        assert re.search(rf"^{own} +{re.escape(default)} ", part, re.MULTILINE), name


@pytest.mark.parametrize(("name", "sign", "limit"), LIMITED)
def test_a_limit_told_is_the_limit_held(name, sign, limit):
    step = 1 if isinstance(flatten(Scene())[name], int) else 1e-3
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
    assert len(words) == 16
    for name, allowed in words.items():
        with pytest.raises(InputError, match="must be one of") as refused:
            apply_settings(Scene(), {name: "sideways"})
        assert all(f"'{word}'" in str(refused.value) for word in allowed.split(" | "))


def test_units_are_no_part_of_the_meaning():
    facts = catalogue().values()
    units = {fact.unit for fact in facts} - {""}
    assert len(units) == 17
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
    for name in TOLD:
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
    [("clearance", {"gap", "film_clearance"}),
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
