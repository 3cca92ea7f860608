"""The cases of a campaign as tables, by conditions, by values, and as a grid."""

import csv
import io
import json
import re

import numpy as np
import pytest
import xarray
from synthetic import grid_of, synthetic

import hpcwhirl
from hpcwhirl.analysis.columns import matching, source_of
from hpcwhirl.cli import main
from hpcwhirl.errors import InputError, StoreError
from hpcwhirl.store.reading.reader import coded, open_coded

ROWS = grid_of(
    speed=[300.0, 400.0, 500.0], gap=[1e-4, 4e-4], **{"casing.thickness": [0.02, 0.03]}
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    status = ["ok"] * 10 + ["failed", "missing"]
    place = tmp_path_factory.mktemp("cases") / "out"
    return synthetic(place, ROWS, status=status, samples=500)


@pytest.fixture(scope="module")
def data(folder):
    return hpcwhirl.open_results(folder)


@pytest.mark.turns
def test_columns_of_coded_results_are_those_of_words_each_text_once(folder, data):
    with open_coded(folder) as coded:
        assert coded["regime"].dtype.itemsize == 1
        own, other = source_of(data), source_of(coded)
        for name in ("word", "regime", "stop", "message", "growth_rate", "speed"):
            values = other.column(name)
            np.testing.assert_array_equal(values, own.column(name))
            if name in {"word", "regime", "stop"}:
                assert len(set(map(id, values))) == len(set(values))


def test_a_code_without_a_word_is_told():
    words = {"flag_meanings": "none damped sustained"}
    codes = np.array([2, 0, 1, np.nan])  # NaN where a case is left out
    found = coded(xarray.DataArray(codes, dims="case", attrs=words))
    assert found.tolist() == ["sustained", "none", "damped", ""]
    wrong = xarray.DataArray(codes + 1, dims="case", attrs=words, name="regime")
    with pytest.raises(StoreError, match="regime is damaged: it has a code without"):
        coded(wrong)


def test_texts_read_in_parts_are_those_of_the_whole(data, monkeypatch):
    whole = source_of(data).column("message")
    monkeypatch.setattr("hpcwhirl.analysis.columns.AT_ONCE", 5)
    assert source_of(data).column("message").tolist() == whole.tolist()
    assert len(set(whole.tolist())) == 2


def numpy_says(data):
    """Return {condition: the same in numpy}."""
    v = {n: data[n].to_numpy() for n in ("speed", "gap", "growth_rate", "orbit_radius")}
    regime, status = hpcwhirl.words(data.regime), hpcwhirl.words(data.status)
    thick = data.casing_thickness.to_numpy()
    return {
        "regime == sustained and speed > 300": (regime == "sustained")
        & (v["speed"] > 300),
        "regime == 'damped' or regime == divergent": np.isin(
            regime, ["damped", "divergent"]
        ),
        "not regime == damped": regime != "damped",
        "regime != damped": regime != "damped",
        "300 < speed <= 500": (v["speed"] > 300) & (v["speed"] <= 500),
        "gap == 1e-4": v["gap"] == 1e-4,
        "casing.thickness == 0.03": thick == 0.03,
        "thickness == 0.03 and word in (failed, missing)": (thick == 0.03)
        & (status != "ok"),
        "orbit_radius / gap >= 0.5": v["orbit_radius"] / v["gap"] >= 0.5,
        "growth_rate < -2 * 3 + 1": v["growth_rate"] < -5,
        "status == failed": status == "failed",
        "whirl not in (forward, backward)": ~np.isin(
            hpcwhirl.words(data.whirl), ["forward", "backward"]
        ),
        "case == 3": np.arange(12) == 3,
        "min(speed, 350, 1e3) == 350 and log10(gap) < -3.5": (v["speed"] >= 350)
        & (v["gap"] < 10**-3.5),
        "sqrt(abs(growth_rate)) > 1": np.abs(v["growth_rate"]) > 1,
        "abs(speed - 400) in (100,)": v["speed"] != 400,
        "not " * 90 + "speed > 300": v["speed"] > 300,
        "-" * 90 + "speed > 300": v["speed"] > 300,
        "+".join("1" * 900) + " == 900 and speed > 300": v["speed"] > 300,
        "stop == amplitude or stop != amplitude": np.ones(12, bool),
        "1 == 1 and (2 > 3 or speed > 300) and 1 in (1, 2)": v["speed"] > 300,
        "speed > 1 / 0": np.zeros(12, bool),
    }


def test_conditions_are_what_numpy_says(data):
    for text, want in numpy_says(data).items():
        assert matching(text, source_of(data)).tolist() == want.tolist(), text


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("regime == sustaned", "did you mean 'sustained'"),
        ("spee > 3", "did you mean 'speed'"),
        ("speed", "'speed' is no condition"),
        ("speed > ", "something is missing at its end"),
        ("regime > 3", "'regime' is text"),
        ("abs(regime) > 3", "'regime' is text"),
        ("regime == 3", "one is text"),
        ("speed == fast", "unknown variable 'fast'"),
        ("fast == slow", "unknown variable 'fast'"),
        ("speed = 300", "'=' is not known here, write =="),
        ("speed > 300 & gap > 0", "write and"),
        ("speed ** 2 > 9e4", "write x * x"),
        ("sin(speed) > 0", "there is no function 'sin'"),
        ("speed > " + "9" * 309, "is below 1.8e308, got one of 309 characters"),
        ("speed > 1e999", "a number is below 1.8e308"),
        ("__import__('os').system('touch /tmp/never') == 0", "is not expected there"),
        ("().__class__ == 1", "is not expected there"),
        ("speed.__class__ == 1", "unknown variable"),
        ("(lambda: 1)() == 1", "is not expected there"),
        ("[speed for speed in (1, 2)] == 1", "stands where a number or a name"),
        ("9 ** 9 ** 9 > speed", "there are no powers"),
        ("speed > 3000 mm", "'3000 mm' cannot be converted: 'speed' is in rad/s"),
        ("regime in (1 mm)", "'1 mm' cannot be equal to 'regime': one is text"),
        ("speed > 300 rmp", "'rmp' is not expected there, and is no unit"),
        ("speed > 1 if gap else 2", "'if' is not expected there"),
        ("speed is gap", "'is' is not expected there"),
        ("(x := 3) == 3", "is not expected there"),
        ("f'{speed}' == 'a'", "is not expected there"),
        ("(" * 31 + "speed" + ")" * 31 + " > 1", "more than 30 brackets"),
        ("speed > 1 and " * 200 + "speed > 1", "at most 2000 characters"),
    ],
)
def test_what_is_no_condition_is_one_line_and_never_run(data, text, said):
    with pytest.raises(InputError, match=re.escape(said)) as refused:
        matching(text, source_of(data))
    assert "\n" not in str(refused.value)


def rows_of(capsys, *words):
    assert main(["cases", *map(str, words), "--csv"]) == 0
    return list(csv.DictReader(io.StringIO(capsys.readouterr().out)))


def test_a_table_has_units_and_the_messages_of_those_that_failed(folder, capsys):
    assert main(["cases", str(folder)]) == 0
    out = capsys.readouterr().out
    head = out.splitlines()[:2]
    assert "rad/s" in head[0] + head[1]
    assert "casing_thickness" in out
    assert "made up: it gave no result" in out
    rows = rows_of(capsys, folder, "--where", "status == ok")
    assert len(rows) == 10
    assert {"speed [rad/s]", "gap [m]", "growth_rate [1/s]"} <= rows[0].keys()
    assert "message" not in rows[0]


def test_rows_are_sorted_and_chosen(folder, data, capsys):
    rows = rows_of(capsys, folder, "--sort", "growth_rate", "--reverse")
    rates = [float(r["growth_rate [1/s]"]) for r in rows]
    known = [r for r in rates if r == r]  # noqa: PLR0124
    assert known == sorted(known, reverse=True)
    assert rates[:10] == known
    rows = rows_of(capsys, folder, "--at", "speed=400", "--columns", "contacts,stop")
    assert list(rows[0]) == [
        "case", "speed [rad/s]", "gap [m]", "casing_thickness [m]", "contacts", "stop",
    ]  # fmt: skip
    assert [int(r["case"]) for r in rows] == np.flatnonzero(data.speed == 400).tolist()


def test_what_all_rows_share_is_said_once_above(folder, capsys):
    words = ["cases", str(folder), "--at", "speed=400", "--where", "status == ok"]
    assert main(words) == 0
    first, *rest = capsys.readouterr().out.splitlines()
    assert first.startswith("all 4 cases: speed = 400 rad/s, ")
    assert "speed" not in "".join(rest)
    assert {"word", "gap"} <= {*" ".join(rest[:2]).split()}
    assert main([*words, "--columns", "speed,status"]) == 0  # asked for: kept
    out = capsys.readouterr().out
    assert "all 4" not in out
    assert out.split().count("ok") == 4


def test_why_a_case_ended_is_told_by_default(folder, capsys):
    rows = rows_of(capsys, folder)
    assert {"outcome", "stop"} <= rows[0].keys()


@pytest.mark.turns
def test_lists_are_short_and_numbered(tmp_path, capsys):
    lists = [[0.001 * (i + j) for i in range(22)] for j in (0, 1)]
    place = synthetic(tmp_path / "out", grid_of(mistuning=lists, speed=[300.0, 310.0]))
    assert main(["cases", str(place)]) == 0
    out = capsys.readouterr().out
    assert max(map(len, out.splitlines())) < 120
    for number in ("#1 [", "#2 ["):
        assert out.count(number) == 2
    assert main(["cases", str(place), "--at", "mistuning=#2"]) == 0
    assert "all 2 cases: rotor_mistuning = #2 [" in capsys.readouterr().out
    assert rows_of(capsys, place)[0]["rotor_mistuning"] == str(lists[0])


def test_json_is_strict(folder, facts):
    told = facts("cases", str(folder), "--json")
    assert len(told["cases"]) == 12
    assert told["cases"][10]["growth_rate"] is None
    assert told["units"]["speed"] == "rad/s"


@pytest.mark.turns
def test_a_case_without_a_result_has_no_counts(folder, data, capsys, facts):
    assert data.contacts.to_numpy()[10:].tolist() == [-1, -1]
    assert not matching("contacts < 0", source_of(data)).any()
    assert data.hpcwhirl.where("contacts >= 0").case.to_numpy().tolist() == [*range(10)]
    asked = ("--columns", "contacts", "--sort", "contacts")
    shown = [row["contacts"] for row in rows_of(capsys, folder, *asked)]
    assert shown[10:] == ["nan", "nan"]
    assert sorted(map(int, shown[:10])) == sorted(data.contacts.to_numpy()[:10])
    told = facts("cases", str(folder), "--json")["cases"]
    assert [type(case["contacts"]) for case in told] == [int] * 10 + [type(None)] * 2
    assert main(["cases", str(folder), "--columns", "contacts"]) == 0
    assert "-1" not in capsys.readouterr().out


def test_a_long_table_says_what_it_leaves_out(folder, capsys):
    assert main(["cases", str(folder), "--limit", "5"]) == 0
    assert "7 more of 12 cases" in capsys.readouterr().out
    assert main(["cases", str(folder), "--where", "speed > 9999"]) == 0
    assert "no case matches" in capsys.readouterr().err


def test_every_column_is_told(folder, data, capsys):
    assert main(["cases", str(folder), "--columns", "?"]) == 0
    out = capsys.readouterr().out
    assert out.startswith("word: the regime, or overloaded, unstable, failed, missing")
    assert "growth_rate, 1/s: growth rate of ln sqrt(energy) over the window" in out
    names = {line.split(":")[0].split(",")[0] for line in out.splitlines()}
    assert {n for n, v in data.variables.items() if v.dims == ("case",)} <= names


def test_words_and_texts_compare_with_text(data):
    """A byte a case, or bytes, would never be equal to a text."""
    regime = hpcwhirl.words(data.regime)
    assert (data.regime == "damped").to_numpy().tolist() == (
        regime == "damped"
    ).tolist()
    assert (data.regime == "damped").any()
    assert (data.scheme == "modal").any()
    assert "flag_values" not in data.regime.attrs
    assert data.regime.attrs["flag_meanings"].split()[1] == "damped"
    assert (data.isel(case=data.status == "failed").message != "").all()


@pytest.mark.turns
def test_reading_leaves_numbers_in_the_file_until_asked(tmp_path):
    import tracemalloc

    folder = synthetic(tmp_path / "out", ROWS, samples=80_000)
    hpcwhirl.open_results(folder)
    tracemalloc.start()
    opened = hpcwhirl.open_results(folder)
    one = opened.centre.isel(case=3).to_numpy()
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert one.shape == (80_000, 2)
    assert peak < 0.2 * opened.nbytes


def test_cases_become_a_grid_over_what_was_swept(data):
    full = hpcwhirl.grid(data)
    axes = {name: full.sizes[name] for name in full.growth_rate.dims}
    assert axes == {"speed": 3, "gap": 2, "casing_thickness": 2}
    for i, row in enumerate(ROWS):
        place = {
            "speed": row["speed"], "gap": row["gap"],
            "casing_thickness": row["casing.thickness"],
        }  # fmt: skip
        one = full.sel(place)
        assert int(one.case) == i
        assert str(one.regime.item()) == str(data.regime[i].item())
        assert np.array_equal(one.growth_rate, data.growth_rate[i], equal_nan=True)
        assert np.array_equal(one.centre, data.centre[i], equal_nan=True)
    assert full.growth_rate.attrs["units"] == "1/s"
    assert full.centre.dims == (*full.growth_rate.dims, "time", "xy")


@pytest.mark.turns
def test_a_grid_leaves_traces_in_the_file_until_asked(tmp_path):
    import tracemalloc

    folder = synthetic(tmp_path / "out", ROWS, samples=80_000)
    tracemalloc.start()
    opened = hpcwhirl.open_results(folder)
    one = hpcwhirl.grid(opened).centre.isel(speed=1, gap=0, casing_thickness=1)
    assert one.to_numpy().shape == (80_000, 2)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 0.2 * opened.nbytes


def test_an_input_of_one_value_is_no_axis(tmp_path):
    rows = [{"gap": 2e-4, "speed": s} for s in (300.0, 400.0)]
    full = hpcwhirl.grid(hpcwhirl.open_results(synthetic(tmp_path / "out", rows)))
    assert dict(full.growth_rate.sizes) == {"speed": 2}


def test_what_a_zip_ties_together_is_one_axis(tmp_path):
    rows = [{"speed": s, "gap": g} for s, g in ((300.0, 2e-4), (400.0, 1e-4))]
    full = hpcwhirl.grid(hpcwhirl.open_results(synthetic(tmp_path / "out", rows)))
    assert dict(full.growth_rate.sizes) == {"speed": 2}
    assert full.gap.dims == ("speed",)
    assert full.gap.to_numpy().tolist() == [2e-4, 1e-4]


def test_scattered_cases_are_no_grid(tmp_path):
    random = np.random.default_rng(1)
    rows = [
        {"speed": float(s), "gap": float(g)}
        for s, g in zip(
            [300.0, 300.0, *range(301, 330)], random.random(31), strict=True
        )
    ]
    data = hpcwhirl.open_results(synthetic(tmp_path / "out", rows))
    with pytest.raises(
        InputError, match=r"31 cases over speed x gap do not fill a grid"
    ):
        hpcwhirl.grid(data)


def test_what_python_offers_is_shown():
    assert {"Scene", "simulate", "open_results", "words", "grid"} <= set(dir(hpcwhirl))
    for name in hpcwhirl.__all__:
        assert getattr(hpcwhirl, name)


@pytest.mark.turns
def test_figures_take_cases_by_their_inputs(folder, tmp_path, capsys):
    words = ["figures", str(folder), "--out", str(tmp_path), "--kind", "orbit"]
    assert main([*words, "--at", "speed=400", "--at", "gap=1e-4"]) == 0
    names = [line.rpartition("/")[2] for line in capsys.readouterr().out.split()]
    assert names == ["orbit-0004.png", "orbit-0005.png"]
    assert main([*words, "--at", "speed=410"]) == 2
    assert "no case has this value, known: 300, 400, 500" in capsys.readouterr().err
    where = ["--at", "speed=500", "--at", "gap=4e-4", "--at", "thickness=0.02"]
    assert main([*words, *where]) == 2
    assert "case 10 is failed: made up: it gave no result" in capsys.readouterr().err


def test_json_rows_have_the_numbers_of_the_file(folder, data, capsys):
    assert main(["cases", str(folder), "--json", "--columns", "late_lost"]) == 0
    told = json.loads(capsys.readouterr().out)["cases"]
    for row in told[:10]:
        assert row["late_lost"] == float(data.late_lost[row["case"]])


@pytest.mark.turns
def test_rows_of_csv_are_printed_some_at_a_time(finished, monkeypatch, capsys):
    assert main(["cases", str(finished), "--csv"]) == 0
    whole = capsys.readouterr().out
    monkeypatch.setattr("hpcwhirl.cli.tables.AT_ONCE", 1)
    assert main(["cases", str(finished), "--csv"]) == 0
    assert capsys.readouterr().out == whole
    assert whole.count("\n") == 3


@pytest.mark.turns
@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("growth > 0", "unknown variable 'growth'; did you mean 'growth_rate'?"),
        ("orbit > 0", "did you mean 'orbit_area'?"),
        ("gapp > 0", "did you mean 'gap'?"),
        ("motion == chaotic", "'motion' needs output.chaos > 0, which these results"),
        ("wear_depth > 1 mm", "'wear_depth' needs a layer that wears"),
        ("blade_peak > 1 mm", "'blade_peak' needs output.traces"),
        ("zzz > 0", "unknown variable 'zzz'; `cases --columns '?'` lists all"),
    ],
)
def test_a_name_that_results_lack_is_answered_by_the_nearest_or_by_its_need(
    finished, capsys, text, told
):
    assert main(["cases", str(finished), "--where", text]) == 2
    assert told in capsys.readouterr().err
