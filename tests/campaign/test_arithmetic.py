"""A plan that is arithmetic against the product of objects, on designs at random."""

import inspect
import itertools
import json
import pickle
import re

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from hpcwhirl.campaign.begin import prepare
from hpcwhirl.campaign.plan.cost import Places, costs_of
from hpcwhirl.campaign.plan.design import design_of
from hpcwhirl.case.resolve import resolve
from hpcwhirl.errors import InputError, StoreError, one_line, shown
from hpcwhirl.planner.kinds import at_boundary
from hpcwhirl.scene import (
    Scene,
    apply_settings,
    batch_validation,
    digest,
    engine_parts,
    flatten,
)
from hpcwhirl.scene import inputs as scene_inputs
from hpcwhirl.scene.batch_validation import RULES, Many
from hpcwhirl.scene.input_names import full_name
from hpcwhirl.scene.shaft_tables import text_of
from hpcwhirl.scene.table import Table
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.directory.manifest import PlanFile

PATTERNS = [[], [0.01] * 6, [0.0, 1, -0.5, 0.1, 0.2, 0.3], [0.02] * 5]
VALUES = {
    "speed": [0, 100, 410.0, 1e300],
    "gap": [1e-4, 0.0, -0.0, 4.0, 6.0, -1.0, float("nan")],
    "radius": [0.5, 1, 0.03],
    "disk_radius": [0.04, 0.035891, 0.6],
    "nodal_diameter": [1, 2, 30, 1.0],
    "harmonics": [20, 40, True],
    "discretization": ["fourier", "elements", "file", "wrong"],
    "families": ["all", "bending"],
    "casing.elements": [40, 80],
    "kind": ["ring", "rigid"],
    "revolutions": [0.0, 1, 5.5],
    "duration": [2.5, 0.1, 30],
    "time_step": [1e-6, 1e-15, 2e-6],
    "until": ["end", "decided"],
    "longest": [20.0, 0.05],
    "blades": [6, 5, 22],
    "mistuning": PATTERNS,
    "direction": ["squeeze", "stretch"],
}
FINE = {
    "speed": [0, 100, 410.0, 500], "gap": [1e-4, 0.0, 2e-4, 1],
    "nodal_diameter": [1, 2, 3], "duration": [2.5, 1, 0.1], "blades": [22, 12],
    "direction": ["squeeze", "stretch"], "scheme": ["modal", "general"],
    "harmonics": [20, 40], "time_step": [1e-6, 2e-6],
}  # fmt: skip


def chosen(values, least=1):
    """Draw {input: some of its values}, none twice."""
    names = st.lists(st.sampled_from(sorted(values)), unique=True, max_size=3)
    return names.flatmap(
        lambda own: st.fixed_dictionaries(
            {
                n: st.lists(st.sampled_from(values[n]), min_size=least, max_size=3)
                for n in own
            }
        )
    )


@st.composite
def documents(draw, values):
    """Draw the tables of a campaign."""
    out = {"sweep": draw(chosen(values))}
    rest = {n: v for n, v in values.items() if n not in out["sweep"]}
    zipped = draw(chosen(rest))
    if zipped:
        length = min(map(len, zipped.values()))
        out["zip"] = {name: some[:length] for name, some in zipped.items()}
    rows = [{n: some[0] for n, some in row.items()}
            for row in draw(st.lists(chosen(values), max_size=4))]  # fmt: skip
    if rows:
        out["cases"] = rows
    return out


def by_hand(document):
    """Return (settings, scenes, digests) of all cases, an object each, as they were."""
    grid, zipped = document["sweep"], document.get("zip", {})
    explicit = document.get("cases", [])
    along = [dict(zip(zipped, row, strict=True))
             for row in zip(*zipped.values(), strict=True)] or [{}]  # fmt: skip
    rows = []
    if grid or zipped or not explicit:
        rows = [
            dict(zip(grid, row, strict=True)) | extra
            for row in itertools.product(*grid.values())
            for extra in along
        ]
    rows = [
        {full_name(n): 0.0 if v == 0.0 and isinstance(v, float) else v
         for n, v in row.items()}
        for row in [*rows, *explicit]
    ]  # fmt: skip
    scenes = [apply_settings(Scene(), row) for row in rows]
    digests = [digest(scene) for scene in scenes]
    for number, name in enumerate(digests):
        if digests.index(name) < number:
            first = digests.index(name)
            same = ", ".join(f"{n} = {shown(v)}" for n, v in rows[first].items())
            told = f"cases {first} and {number} have the same inputs: "
            raise InputError(told + one_line(same, 200))
    return rows, scenes, digests


def outcome(make, *given):
    try:
        return make(*given)
    except InputError as refused:
        return str(refused)


@pytest.mark.turns
@settings(max_examples=150, deadline=None)
@given(documents(VALUES))
@example({"sweep": {"until": ["end", "decided"], "time_step": [1e-6, 1e-12]}})
def test_a_wrong_value_anywhere_is_refused_in_the_same_words(document):
    wanted, found = outcome(by_hand, document), outcome(design_of, document)
    if isinstance(wanted, str):
        assert found == wanted
    else:
        assert list(found.digests) == wanted[2]


@pytest.mark.turns
@settings(max_examples=100, deadline=None)
@given(documents(FINE))
def test_cases_are_those_of_the_product_of_objects(document):
    wanted, found = outcome(by_hand, document), outcome(design_of, document)
    if isinstance(wanted, str):
        assert found == wanted
        return
    rows, scenes, digests = wanted
    assert list(found.settings) == rows
    assert [list(row) for row in found.settings] == [list(row) for row in rows]
    assert [found.settings[i] for i in range(len(rows))] == rows
    assert found.settings[-2:] == tuple(rows[-2:])
    assert list(found.scenes) == scenes
    assert list(found.digests) == digests
    assert [found.digests[i] for i in range(len(rows))] == digests
    assert found.swept == tuple(dict.fromkeys(name for row in rows for name in row))
    sent = pickle.loads(pickle.dumps(found))
    assert list(sent.digests) == digests
    for case, name in enumerate(digests):
        assert sent.digests.find(name) == case
        assert sent.digests.find(name, case + 1) == case
    assert sent.digests.find("0" * 64) == -1
    assert sent.digests.find("no digest") == -1


@pytest.mark.turns
@settings(max_examples=40, deadline=None)
@given(documents(FINE))
def test_costs_and_places_are_those_of_each_case(document):
    try:
        found = design_of(document)
    except InputError:
        return
    costs = costs_of(found)
    assert costs.steps.tolist() == [
        found.predicted(c)[0] for c in range(len(found.scenes))
    ]
    assert costs.nominal.tolist() == [
        found.predicted(c)[1] for c in range(len(found.scenes))
    ]
    base = flatten(found.base)
    for number, name in enumerate(found.swept):
        own = [row.get(name, base[name]) for row in found.settings]
        place = Places(found)[np.arange(len(own))][:, number]
        for a, b in itertools.combinations(range(len(own)), 2):
            assert (place[a] == place[b]) == (own[a] == own[b])


@pytest.mark.turns
@settings(max_examples=40, deadline=None)
@given(documents(FINE), st.randoms(use_true_random=False))
def test_boundaries_are_those_of_lines_of_cases(document, chance):
    try:
        rows = list(design_of(document).settings)
    except InputError:
        return
    words = [chance.choice("abc") for _ in rows]
    swept = list(dict.fromkeys(n for row in rows for n in row))
    wanted = set()
    for a, b in itertools.permutations(range(len(rows)), 2):
        differ = [n for n in swept if rows[a].get(n) != rows[b].get(n)]
        if len(differ) != 1 or rows[a].keys() != rows[b].keys():
            continue
        (name,) = differ
        if not all(isinstance(row.get(name), int | float) for row in rows):
            continue
        line = sorted(r[name] for r in rows if r | {name: 0} == rows[a] | {name: 0})
        apart = abs(line.index(rows[a][name]) - line.index(rows[b][name]))
        if apart == 1 and words[a] != words[b]:
            wanted |= {a, b}
    assert set(np.flatnonzero(at_boundary(rows, swept, words)).tolist()) == wanted


@pytest.mark.turns
@settings(max_examples=30, deadline=None)
@given(documents(FINE))
def test_a_plan_is_read_back_as_it_was_written(tmp_path_factory, document):
    try:
        found = design_of(document)
    except InputError:
        return
    folder = tmp_path_factory.mktemp("plan")
    prepare(found, Directory(folder))
    plan = PlanFile(folder).read()
    assert plan == found.manifest()
    assert list(plan.digests) == list(found.digests)
    assert list(plan.settings) == list(found.settings)
    assert '"digests"' not in (folder / "campaign.json").read_text()


BEARING = (
    "frequency,kxx,kxy,kyx,kyy,cxx,cxy,cyx,cyy;0.0,1.0,0.0,0.0,1.0,1.0,0.0,0.0,1.0"
)
SHAFT = text_of({
    "sections": [{"length": 1.0, "outer": 0.1}],
    "bearings": [{"station": i, "kxx": 1e7} for i in (0, 1)],
}, "the shaft")  # fmt: skip
SPEEDS, GAPS = "time,speed;0.0,300.0;1.0,310.0", "time,gap;0.0,1e-4;1.0,2e-4"
SLIPS = "slip,friction;0.0,0.2;1.0,0.1"
LATER = {"rotation": "full", "lost_blade": 3, "lost_blade_time": 0.1}
WEIGHT = {"rotation": "full", "gravity": 9.81}
BROKEN = [  # of each rule, in their order: what breaks it alone, and how that is told
    ({"disk_radius": 0.6}, "engine.rotor: disk_radius must be < radius"),
    ({"mistuning": [0.1]}, "engine.rotor: mistuning must be [] or 22 numbers"),
    ({"rotation": "full", "stiffness_difference": 1e6, "centre": "clamped"},
     "stiffness_difference must be 0 where centre is clamped"),
    ({"rotation": "full", "damping_difference": 1.0, "centre": "clamped"},
     "damping_difference must be 0 where centre is clamped"),
    ({"rotation": "full", "stop_clearance": 1e-4, "centre": "clamped"},
     "stop_clearance must be 0 where centre is clamped"),
    ({"rotation": "full", "film_viscosity": 0.01, "centre": "clamped"},
     "film_viscosity must be 0 where centre is clamped"),
    ({"rotation": "full", "shaft": "cantilever", "centre": "clamped"},
     "shaft must be springs where centre is clamped"),
    ({"rotation": "full", "lost_blade": 0, "centre": "clamped"},
     "lost_blade must be -1 where centre is clamped"),
    ({"rotation": "full", "bearing": BEARING, "centre": "clamped"},
     "bearing must be empty where centre is clamped"),
    ({"rotation": "full", "bearing": BEARING, "cross_coupling": 1.0},
     "cross_coupling must be 0 with a bearing"),
    ({"rotation": "full", "bearing": BEARING, "stiffness_difference": 1.0},
     "stiffness_difference must be 0 with a bearing"),
    ({"rotation": "full", "bearing": BEARING, "damping_difference": 1.0},
     "damping_difference must be 0 with a bearing"),
    ({"rotation": "full", "bearing": BEARING, "stop_clearance": 1e-4},
     "stop_clearance must be 0 with a bearing"),
    ({"rotation": "full", "bearing": BEARING, "film_viscosity": 0.01},
     "film_viscosity must be 0 with a bearing"),
    ({"rotation": "full", "bearing": BEARING, "shaft": "cantilever"},
     "shaft must be springs with a bearing"),
    ({"rotation": "full", "shaft": SHAFT, "stiffness_difference": 1.0},
     "stiffness_difference must be 0 with a shaft that has mass"),
    ({"rotation": "full", "shaft": SHAFT, "damping_difference": 1.0},
     "damping_difference must be 0 with a shaft that has mass"),
    ({"rotation": "full", "shaft_station": 2},
     "shaft_station must be 0 without a shaft that has mass"),
    ({"rotation": "full", "lost_blade": 22}, "lost_blade must be < blades (22)"),
    ({"rotation": "full", "polar_inertia": 3.0, "tilt_inertia": 1.4},
     "polar_inertia must be <= 2 tilt_inertia (2.8 kg m^2), as of any disk, got 3.0"),
    ({"rotation": "full", "shaft": "cantilever", "blades": 2},
     "shaft must be springs with fewer than 3 blades"),
    ({"families": "bending", "discretization": "elements"}, "families must be all"),
    ({"cross_coupling": 1.0}, "cross_coupling must be 0 where rotation is none"),
    ({"stiffness_difference": 1.0}, "stiffness_difference must be 0 where rotation"),
    ({"damping_difference": 1.0}, "damping_difference must be 0 where rotation is"),
    ({"film_viscosity": 0.01}, "film_viscosity must be 0 where rotation is none"),
    ({"stop_clearance": 1e-4}, "stop_clearance must be 0 where rotation is none"),
    ({"shaft": "two bearings"}, "shaft must be springs where rotation is none"),
    ({"rotation": "full", "shaft": "cantilever", "engine.file": __file__},
     "shaft must be springs with a rotor from file"),
    ({"bearing": BEARING}, "bearing must be empty where rotation is none"),
    ({"rotation": "full", "bearing": BEARING, "engine.file": __file__},
     "bearing must be empty with a rotor from file"),
    ({"lost_blade": 3}, "lost_blade must be -1 where rotation is none"),
    ({"rotation": "full", "lost_blade": 3, "engine.file": __file__},
     "lost_blade must be -1 with a rotor from file"),
    ({"rotation": "auto", "rotor.damping": 0.5}, "must be >= damping (0.5)"),
    ({"mistuning": [0.1] * 22, "engine.file": __file__}, "mistuning must be [] with"),
    ({"profile_release": 1e-3, "profile_rise": 2e-3}, "profile_release must be 0 or"),
    ({"profile_release": 1e-3, "kind": "rigid"}, "where the casing cannot swing"),
    ({"discretization": "file"}, "file must be named where casing.discretization"),
    ({"friction_law": "table"},
     "friction_table must be given where friction_law is table, got none"),
    ({"friction": 0.2, "friction_table": SLIPS},
     "friction_table must be empty unless friction_law is table"),
    ({"friction_law": "table", "friction_table": SLIPS},
     "friction must be 0.2, the first of friction_table, got 0.1"),
    ({"acceleration": 1.0, "revolutions": 9.0}, "revolutions must be 0 where the"),
    ({"acceleration": 1.0, "chaos": 50.0}, "output.chaos must be 0 where speed or gap"),
    ({"gap_closure": 1e-5, "history": "speed = 300.0"}, "history must be empty where"),
    (LATER | {"chaos": 50.0}, "output.chaos must be 0 where a blade is lost"),
    (LATER | {"history": "speed = 300.0"}, "history must be empty where a blade is"),
    ({"lost_blade_time": 0.1}, "lost_blade_time must be 0 where no blade is lost"),
    ({"offset": 1e-5, "history": "speed = 300.0"}, "where the casing is not round"),
    ({"acceleration": 1.0, "rotation": "auto"}, "engine.rotation must be none or full"),
    ({"acceleration": 1.0, "until": "certain"}, "must be end or decided where the sp"),
    ({"acceleration": 1.0, "speed": 300.0, "speed_table": SPEEDS},
     "acceleration must be 0 with a speed_table"),
    ({"gap_closure": 1e-5, "gap": 1e-4, "gap_table": GAPS},
     "gap_closure must be 0 with a gap_table"),
    ({"speed_table": SPEEDS}, "speed must be 300.0, the first of speed_table, got 410"),
    ({"gap_table": GAPS}, "gap must be 0.0001, the first of gap_table, got 0.00012"),
    ({"acceleration": 1.0, "scheme": "paper", "rotation": "full"},
     "scheme must be 'modal', 'exact' or 'general' where the speed changes"),
    ({"acceleration": 1.0, "ramp": "smooth", "speed": 300.0, "speed_to": 200.0},
     "speed_to must lie ahead of speed"),
    ({"nodal_diameter": 30}, "nodal_diameter must be <= 20 on a ring of 20 harmonics"),
    ({"contact_law": "archard", "layer_edge": 1.0}, "layer_edge must be <= "),
    ({"contact_law": "archard", "layer_edge": 1e-7}, "layer_rods must be <= "),
    ({"contact_law": "archard", "time_step": 1e-4}, "in which a tip moves by layer_"),
    ({"contact_law": "archard", "chaos": 50.0}, "output.chaos must be 0 where casing."),
    ({"contact_law": "archard", "history": "speed = 300.0"}, "so no [branch], where"),
    ({"unbalance": 1e-3}, "unbalance must be 0 where engine.rotation is none"),
    ({"gravity": 9.81}, "gravity must be 0 where engine.rotation is none"),
    (WEIGHT | {"centre": "clamped"},
     "gravity must be 0 where engine.rotor.centre is clamped"),
    (WEIGHT | {"scheme": "paper"}, "gravity must be 0 with scheme paper"),
    ({"gap_at": "rest"}, "gap_at must be speed where engine.rotation is none"),
    ({"rotation": "full", "unbalance": 1e-3, "centre": "clamped"},
     "unbalance must be 0 where engine.rotor.centre is clamped"),
    ({"revolutions": 1.0, "speed": 0.0}, "revolutions must be 0 where speed is 0"),
    ({"time_step": 1e-14}, "s (a run of 2.5 s has at most 1e+13 steps)"),
    ({"until": "decided", "longest": 1.0}, "longest must be >= 2.5 s (duration)"),
    ({"gap": 6.0}, "gap must be <= 5 m, got 6.0"),
]  # fmt: skip


def full(row):
    return {full_name(name): value for name, value in row.items()}


@pytest.mark.parametrize(
    "given", [{"contact_law": "archard", "time_step": 1e-4}, {"time_step": 1e-14}]
)
def test_a_given_step_is_not_judged_where_accuracy_chooses_it(given):
    """The chosen one is: it suits the layer, and the number of its steps is limited."""
    asked = given | {"accuracy": 0.01, "modes": 22, "harmonics": 4}
    resolve(apply_settings(Scene(), asked)).check()
    cases = Many(Scene(), Table.of([{}, full(asked), {}]))
    assert cases.first_wrong() == 3
    fine = asked | {"accuracy": 1e-20, "duration": 1e3}
    told = r"^duration must be <= .* \(1e\+13 steps of .* got 1000$"
    with pytest.raises(InputError, match=told):
        resolve(apply_settings(Scene(), fine)).check()


@pytest.mark.turns
def test_every_rule_is_kept_by_one_scene_and_by_columns(monkeypatch):
    seen = set()
    for wrong, told in BROKEN:
        with pytest.raises(InputError, match=re.escape(told)) as refused:
            apply_settings(Scene(), wrong)
        assert "\n" not in str(refused.value)
        cases = Many(Scene(), Table.of([{}, full(wrong), {}]))
        assert cases.first_wrong() == 1
        for number, one in enumerate(RULES):
            with monkeypatch.context() as patched:
                patched.setattr(batch_validation, "RULES", (one,))
                if cases.first_wrong() == 1:
                    seen.add(number)
        with pytest.raises(InputError, match=re.escape(told)):
            cases.check()
    assert seen == set(range(len(RULES)))
    assert len(BROKEN) == len(RULES)


@pytest.mark.parametrize("ramp", ["linear", "smooth", "decay"])
@pytest.mark.parametrize(
    ("rate", "speed", "end", "told"),
    [
        (100.0, 600.0, 300.0, "got 300.0: a run-down needs acceleration = -100.0"),
        (-100.0, 300.0, 600.0, "got 600.0: a run-up needs acceleration = 100.0"),
        (100.0, 600.0, 600.0, "speed is that at the start: lower it for a run-up"),
        (-100.0, 600.0, 300.0, ""),
        (100.0, 300.0, 600.0, ""),
    ],
)
def test_a_speed_to_that_lies_behind_is_refused_with_the_remedy(
    ramp, rate, speed, end, told
):
    given = {"ramp": ramp, "acceleration": rate, "speed": speed, "speed_to": end}
    if not told:
        assert apply_settings(Scene(), given).speed_to == end
        return
    with pytest.raises(InputError, match=re.escape(told)):
        apply_settings(Scene(), given)


def test_no_model_has_rules_that_columns_do_not_know():
    rooms = scene_inputs, engine_parts
    kinds = [c for m in rooms for _, c in inspect.getmembers(m, inspect.isclass)]
    models = {c for c in kinds if issubclass(c, scene_inputs.Inputs)}
    assert {
        name
        for kind in models
        for name, own in kind.__pydantic_decorators__.model_validators.items()
        if own.info.mode == "after"
    } == {"_keeps_rules"}
    assert sum(len(kind.RULES) for kind in models) == len(RULES)


@pytest.mark.parametrize("laws", [("gap",), ("gap", "friction"), ("mistuning",)])
@pytest.mark.parametrize("method", ["random", "halton"])
def test_draws_stand_at_each_point(laws, method):
    law = {"distribution": "uniform", "low": 1e-4, "high": 2e-4}
    document = {
        "sweep": {"speed": [300, 410.0], "nodal_diameter": [1, 2]},
        "zip": {"duration": [1, 2.0], "direction": ["squeeze", "stretch"]},
        "sample": {"method": method, "count": 3, **dict.fromkeys(laws, law)},
    }
    found = design_of(document)
    points = design_of({n: document[n] for n in ("sweep", "zip")})
    assert len(found.settings) == 3 * len(points.settings) == 24
    draws = [{full_name(n): row[full_name(n)] for n in laws}
             for row in found.settings[:3]]  # fmt: skip
    assert len({json.dumps(draw) for draw in draws}) == 3
    assert list(found.settings) == [p | d for p in points.settings for d in draws]
    assert list(found.digests) == [digest(scene) for scene in found.scenes]


def test_a_million_cases_are_planned_in_a_megabyte_and_found_by_their_digests():
    numbers = {"start": 1e-4, "stop": 2e-4, "num": 1000}
    found = design_of({"sweep": {"speed": numbers | {"stop": 500.0}, "gap": numbers}})
    assert len(found.settings) == found.most == 1_000_000
    assert len(pickle.dumps(found)) < 1_000_000
    for case in (0, 999, 1000, 123_456, 999_999):
        name = digest(found.scenes[case])
        assert found.digests[case] == name
        assert found.digests.find(name, case) == case


def test_a_coarse_level_is_arithmetic_too():
    found = design_of(
        {
            "sweep": {"speed": [300, 310.0, 320]},
            "refine": {"over": "speed", "levels": 2},
        }
    )
    assert found.grows
    assert [found.digest(case) for case in range(3)] == list(found.digests)
    assert list(found.digests) == [digest(scene) for scene in found.scenes]


@pytest.mark.parametrize(
    "cases",
    [3, [3], [[3]], [[{}]], [[{"speed": 3}]], [[{"speed": [1, 2], "gap": [1]}]],
     [[{"nothing": [1]}]]],
)  # fmt: skip
def test_a_plan_of_other_cases_is_one_line(tmp_path, cases):
    prepare(design_of({"sweep": {"speed": [300, 310]}}), Directory(tmp_path))
    path = tmp_path / "campaign.json"
    data = json.loads(path.read_text()) | {"cases": cases}
    del data["seal"]
    path.write_text(json.dumps(data))
    with pytest.raises(StoreError, match="its keys are not those of a campaign"):
        PlanFile(tmp_path).read()


def test_a_table_of_listed_cases_is_the_list():
    rows = [{"a": 1}, {"a": 2}, {}, {}, {"b": 1, "a": 2}, {"a": 2, "b": 1}]
    table = Table.of(rows)
    assert list(table) == rows
    assert table == rows
    assert Table.from_plain(json.loads(json.dumps(table.plain()))) == rows
    column = table.column("b", 7)
    values = np.array(column.values)[column.codes(np.arange(6))]
    assert values.tolist() == [7, 7, 7, 7, 1, 1]


BLOCKS = {"cases": [{"speed": 10}, {"speed": 20}, {"gap": 3e-4}]}


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ({"gap": 1e-4}, {"gap": 2e-4}),
        ({"speed": 100.0}, {"speed": 200.0}),
    ],
)
def test_plans_of_other_cases_are_others(one, other):
    """A block of cases that does not set an input has the base's value of it."""
    first, second = (
        design_of({"scene": base, **BLOCKS}).digests for base in (one, other)
    )
    assert list(first) != list(second)
    assert first != second
    assert first.identity != second.identity
