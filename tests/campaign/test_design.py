"""Which cases a campaign document asks for, and which documents are refused."""

import itertools
import pickle
import tomllib

import numba
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hpcwhirl.campaign.evaluate import one_of_each
from hpcwhirl.campaign.plan.design import design_of, load_design
from hpcwhirl.case.plan import FOLDING
from hpcwhirl.dynamics.march import March
from hpcwhirl.errors import InputError
from hpcwhirl.scene import Scene, apply_settings, digest, flatten
from hpcwhirl.scene import swept as values
from hpcwhirl.scene.case_digest import PHYSICS_VERSION, digest_of, read_as
from hpcwhirl.scene.digests import CaseDigests
from hpcwhirl.scene.input_names import LATER
from hpcwhirl.scene.table import Table


def design(text, **settings):
    return design_of(tomllib.loads(text), settings)


def swept(text, name):
    return [getattr(scene, name) for scene in design(text).scenes]


def refusal(text, **settings):
    with pytest.raises(InputError) as caught:
        design(text, **settings)
    assert len(str(caught.value).splitlines()) == 1
    return str(caught.value)


def test_a_grid_is_the_product_the_last_input_fastest():
    found = design("[sweep]\nspeed = [300, 400]\ngap = [1e-4, 2e-4, 3e-4]")
    pairs = [(scene.speed, scene.gap) for scene in found.scenes]
    assert pairs == list(itertools.product([300.0, 400.0], [1e-4, 2e-4, 3e-4]))
    assert found.swept == ("speed", "gap")


def test_zipped_lists_go_side_by_side_within_each_point_of_the_grid():
    text = (
        "[sweep]\nspeed = [300, 400]\n[zip]\ngap = [1e-4, 2e-4]\nfriction = [0.1, 0.2]"
    )
    rows = [(s.speed, s.gap, s.friction) for s in design(text).scenes]
    assert rows == [
        (300.0, 1e-4, 0.1), (300.0, 2e-4, 0.2), (400.0, 1e-4, 0.1), (400.0, 2e-4, 0.2),
    ]  # fmt: skip


def test_listed_cases_come_after_the_grid_and_keep_what_they_do_not_name():
    text = "[scene]\ngap = 3e-4\n[sweep]\nspeed = [1, 2]\n[[cases]]\nfriction = 0.5"
    rows = [(s.speed, s.gap, s.friction) for s in design(text).scenes]
    assert rows == [(1.0, 3e-4, 0.1), (2.0, 3e-4, 0.1), (410.0, 3e-4, 0.5)]
    assert design(text).swept == ("speed", "friction")


def test_a_document_with_nothing_swept_is_one_case():
    for text in ("", "[sweep]", "[scene]\nspeed = 410", "cases = []"):
        assert list(design(text).scenes) == [Scene()]


def test_listed_cases_alone_are_all_the_cases():
    assert swept("[[cases]]\nspeed = 5\n[[cases]]\nspeed = 4", "speed") == [5.0, 4.0]


def test_the_end_of_a_range_is_inside():
    found = swept("[sweep]\nspeed = {start = 20, stop = 520, step = 20}", "speed")
    assert found == [20.0 * i for i in range(1, 27)]
    assert swept("[sweep]\nspeed = {start = 0, stop = 9, step = 4}", "speed") == [
        0,
        4,
        8,
    ]
    assert swept("[sweep]\nspeed = {start = 3, stop = 1, step = -1}", "speed") == [
        3,
        2,
        1,
    ]
    assert swept("[sweep]\nspeed = {start = 3, stop = 3, step = 1}", "speed") == [3]


@pytest.mark.turns
@given(st.integers(0, 500), st.integers(1, 60), st.integers(1, 60), st.integers(0, 6))
def test_a_range_gives_the_very_numbers_that_a_list_would(start, step, count, digits):
    listed = [f"{start + i * step}e-{digits}" for i in range(count)]
    span = f"{{start = {listed[0]}, stop = {listed[-1]}, step = {step}e-{digits}}}"
    assert swept(f"[sweep]\nfriction = {span}", "friction") == [
        float(v) for v in listed
    ]


def test_a_range_of_whole_numbers_serves_inputs_that_must_be_whole():
    text = "[sweep]\nnodal_diameter = {start = 1, stop = 5, step = 2}"
    assert swept(text, "nodal_diameter") == [1, 3, 5]


def test_num_divides_a_range_evenly_and_reaches_both_ends():
    found = swept("[sweep]\nspeed = {start = 20, stop = 520, num = 26}", "speed")
    assert np.allclose(found, np.arange(20, 521, 20), rtol=1e-15)
    assert (len(found), found[0], found[-1]) == (26, 20.0, 520.0)
    for end in ("num = 1", "step = 5", "step = -5"):
        assert swept(f"[sweep]\nspeed = {{start = 7, stop = 7, {end}}}", "speed") == [7]


@pytest.mark.parametrize(
    "text",
    [
        "[sweep]\nengine.casing.thickness = [0.01, 0.02]",
        "[sweep]\ncasing.thickness = [0.01, 0.02]",
        '[sweep]\n"engine.casing.thickness" = [0.01, 0.02]',
        "[sweep.engine.casing]\nthickness = {start = 0.01, stop = 0.02, num = 2}",
        "[zip]\ncasing.thickness = [0.01, 0.02]",
        "[[cases]]\ncasing.thickness = 0.01\n[[cases]]\nengine.casing.thickness = 0.02",
    ],
)
def test_dotted_names_reach_every_table(text):
    found = design(text)
    assert [s.engine.casing.thickness for s in found.scenes] == [0.01, 0.02]
    assert found.swept == ("engine.casing.thickness",)


def test_short_and_full_names_give_the_same_campaign():
    short, full = "time_step = [1e-6]", "solver.time_step = [1e-6]"
    assert (
        design(f"[sweep]\n{short}").manifest() == design(f"[sweep]\n{full}").manifest()
    )


def test_a_setting_changes_every_case():
    found = design("[sweep]\nspeed = [1, 2]", gap=5e-4)
    assert [s.gap for s in found.scenes] == [5e-4, 5e-4]


def test_the_plan_names_each_case_by_the_digest_of_its_scene():
    found = design("[sweep]\nspeed = [1, 2]")
    assert found.manifest().digests == [
        digest(Scene(speed=1.0)),
        digest(Scene(speed=2.0)),
    ]
    assert found.manifest().settings == [{"speed": 1}, {"speed": 2}]


def test_the_embedded_campaign_is_78_cases_of_speed_and_friction():
    found = load_design(None, {})
    assert len(found.scenes) == 78
    assert found.swept == ("speed", "friction")


@pytest.mark.parametrize(
    "text",
    [
        "[sweep]\nspeed = [1, 2, 1]",
        "[sweep]\nspeed = [410]\n[[cases]]\nspeed = 410.0",
        "[[cases]]\nspeed = 3\n[[cases]]\nspeed = 3",
        "[zip]\nspeed = [1, 1]\ngap = [1e-4, 1e-4]",
    ],
)
def test_two_equal_cases_are_refused(text):
    assert "have the same inputs: speed = " in refusal(text)


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("[sweep]\ntime_step = [1e-6, 2e-6]", "solver.time_step"),
        ("[sweep]\nsolver.time_step = [1e-6, 2e-6]", "time_step"),
        ("[zip]\ngap = [1e-4, 2e-4]", "gap"),
        ("[[cases]]\nfriction = 0.2", "friction"),
    ],
)
def test_a_setting_of_a_swept_input_is_refused(text, name):
    assert name in refusal(text, **{name: 1e-6})


@pytest.mark.parametrize(
    "text",
    [
        "[sweep]\ntime_step = [1e-6]\nsolver.time_step = [2e-6]",
        "[zip]\ntime_step = [1e-6]\nsolver.time_step = [2e-6]",
        "[[cases]]\ntime_step = 1e-6\nsolver.time_step = 2e-6",
        "[sweep]\ntime_step = [1e-6]\n[zip]\nsolver.time_step = [2e-6]",
    ],
)
def test_an_input_under_two_names_is_refused(text):
    assert "solver.time_step" in refusal(text)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[sweep]\nspeed = []", ("speed", "list", "[]")),
        ("[sweep]\nspeed = 3", ("speed", "list", "3")),
        ("[sweep]\nspeed = {}", ("speed", "{}")),
        ("[sweep]\nspeed = [[1], [2]]", ("speed", "list")),
        ("[sweep]\nspeed = [1979-05-27]", ("speed", "list")),
        ("[sweep]\nspeed = ['fast']", ("speed", "a number", "fast")),
        ("[sweep]\nspeed = [nan]", ("speed", "finite")),
        ("[sweep]\nnodal_diameter = [1.5]", ("nodal_diameter", "whole", "1.5")),
        ("[sweep]\ngap = [1e-4, -1e-4]", ("gap", ">= 0", "-0.0001")),
        ("[sweep]\nsped = [1]", ("'sped'", "'speed'")),
        ("[sweep]\nyoung = [1e11]", ("ambiguous", "engine.rotor.young")),
        ("[sweeps]\nspeed = [1]", ("'sweeps'", "'sweep'")),
        ("[zip]\nspeed = [1, 2]\ngap = [1e-4]", ("[zip]", "2", "1", "one length")),
        ("[zip]\nspeed = [1]\n[sweep]\nspeed = [2]", ("speed", "[sweep]", "[zip]")),
        ("sweep = 3", ("[sweep]", "table", "3")),
        ("zip = [1]", ("[zip]", "table", "[1]")),
        ("cases = 3", ("[[cases]]", "3")),
        ("cases = [3]", ("[[cases]]", "3")),
        ("[[cases]]\nspeed = [1, 2]", ("speed", "a number", "[1, 2]")),
        ("[[cases]]\nspedd = 1", ("'spedd'", "'speed'")),
    ],
)
def test_a_wrong_document_is_told_in_one_line(text, words):
    told = refusal(text)
    assert all(word in told for word in words)


@pytest.mark.parametrize(
    ("span", "words"),
    [
        ("start = 0, stop = 1, step = 0", ("step",)),
        ("start = 0, stop = 1, step = -1", ("step",)),
        ("start = 5, stop = 1, step = 1", ("step",)),
        ("start = 0, stop = 1, step = 1e-9", ("step",)),
        ("start = 0, stop = 1, stepp = 1", ("'stepp'", "'step'")),
        ("start = 0, stop = 1", ("step or num",)),
        ("start = 0, step = 1", ("stop",)),
        ("start = 0, stop = 1, step = 1, num = 2", ("either",)),
        ("start = 0, stop = 1, step = 1.001", ("step of at most stop - start",)),
        ("start = 0, stop = 1, num = 1", ("num >= 2", "stop")),
        ("start = 0, stop = 1, num = 0", ("num", "> 0")),
        ("start = 0, stop = 1, num = 2.5", ("num", "whole", "2.5")),
        ("start = 'a', stop = 1, step = 1", ("start", "number", "'a'")),
        ("start = 0, stop = true, step = 1", ("stop", "number", "True")),
        ("start = nan, stop = 1, step = 1", ("start", "finite")),
        ("start = 0, stop = inf, step = 1", ("stop", "finite")),
        ("start = 0, stop = inf, num = 3", ("stop", "finite")),
        ("start = 0, stop = 1, step = " + "9" * 400, ("step", "finite")),
    ],
)
def test_a_wrong_range_is_told_in_one_line(span, words):
    told = refusal(f"[sweep]\nspeed = {{{span}}}")
    assert all(word in told for word in ("speed", *words))


def test_too_many_cases_are_refused_before_they_are_made(monkeypatch):
    monkeypatch.setattr(values, "MOST_CASES", 5)
    told = refusal("[sweep]\nspeed = [1, 2]\ngap = [1e-4, 2e-4, 3e-4]")
    assert "at most 5 cases, [sweep] asks for 6" in told
    assert "at most 5" in refusal(
        "".join(f"[[cases]]\nspeed = {i}\n" for i in range(6))
    )


def test_a_design_sent_to_another_rank_has_the_same_cases():
    lists = [[], [0.1] * 22]
    whole = design_of({"sweep": {"speed": [300, 410], "mistuning": lists}})
    sent = pickle.loads(pickle.dumps(whole))
    assert [digest(s) for s in sent.scenes] == [digest(s) for s in whole.scenes]
    assert (sent.base, sent.swept) == (whole.base, whole.swept)
    assert [s.speed for s in sent.scenes[1:3]] == [s.speed for s in whole.scenes[1:3]]


def test_a_design_is_sent_as_a_few_bytes_a_case():
    speeds = [[300.0 + i for i in range(n)] for n in (500, 1000)]
    sizes = [len(pickle.dumps(design_of({"sweep": {"speed": v}}))) for v in speeds]
    assert sizes[1] - sizes[0] < 500 * 100


def test_scenes_of_real_inputs_are_those_that_are_validated():
    reals = {"speed": [100, -0.0, 2.5e2], "engine.casing.thickness": [0.01, 0.02]}
    found = design_of({"sweep": reals | {"solver.accuracy": [0, 0.01]}})
    for case, settings in enumerate(found.settings):
        whole = apply_settings(found.base, settings)
        assert repr(flatten(found.scene(case))) == repr(flatten(whole))
        assert found.scene(case) == whole


@pytest.mark.slow
@pytest.mark.parametrize(
    "sweep",
    [
        {"mistuning": [[], [0.01] * 22, [0.02] * 22], "rotation": ["none", "full"]},
        {"unbalance": [0.0, 1e-6, 2e-6], "rotation": ["full"], "nodal_diameter": [1]},
        {"nodal_diameter": [1, 2, 3], "scheme": ["modal", "exact"]},
    ],
    ids=" ".join,
)
def test_kernels_are_compiled_before_the_cases_that_need_them(sweep):
    def kernel(case):
        march = March(found.resolved(case)).scheme
        arrays = tuple(map(numba.typeof, march.arrays))
        return found.scene(case).solver.scheme, type(march), arrays

    found = design_of({"sweep": sweep})
    cases = np.arange(len(found.settings))
    warmed = one_of_each(found, found.columns.first_of(cases, FOLDING))
    assert {*map(kernel, warmed)} == {*map(kernel, cases.tolist())}
    assert len(warmed) < len(cases)


def other_than(value):
    if isinstance(value, str):
        return f"{value} other"
    if isinstance(value, list):
        return [0.5]
    return value + 1 if isinstance(value, int) else value + 0.5


def test_a_newer_input_that_is_swept_is_hashed_as_in_a_case_alone():
    shared = flatten(Scene())
    others = {name: other_than(shared[name]) for name in LATER}
    pairs = itertools.pairwise(sorted(LATER))
    for names in [*((name,) for name in LATER), *pairs]:
        both = itertools.product(*((shared[name], others[name]) for name in names))
        rows = [dict(zip(names, own, strict=True)) | {"speed": 300.0} for own in both]
        found = CaseDigests(shared, Table.of(rows), {"": read_as("")}, PHYSICS_VERSION)
        assert list(found) == [digest_of(shared | row, "") for row in rows]
        assert [found[n] for n in range(len(rows))] == list(found)


def test_kinds_are_the_first_cases_of_each_combination_of_inputs():
    many = design_of({"sweep": {"gap": [1e-4, 2e-4], "speed": [300, 400]}}).columns
    for names, first in (
        (["gap"], [0, 2]), (["speed"], [0, 1]), (["gap", "friction"], [0, 2]),
        (["friction"], [0]), (["speed", "gap"], [0, 1, 2, 3]),
    ):  # fmt: skip
        assert many.kinds(names).tolist() == first
