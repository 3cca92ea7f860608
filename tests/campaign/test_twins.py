"""Twins of cases: how sure a word is, the same on any ranks and after any kill."""

import hashlib

import h5py
import numpy as np
import pytest
import xarray
from common import on_engine
from deaths import even_slices, until_it_lives
from hypothesis import given
from hypothesis import strategies as some
from launch import all_variables, launch, root_variables
from scipy.stats import binomtest, kstest

import hpcwhirl
from hpcwhirl.campaign.begin import Policy, prepare
from hpcwhirl.campaign.plan.design import design_of
from hpcwhirl.campaign.plan.sampling import draw, identity
from hpcwhirl.campaign.progress import progress_of
from hpcwhirl.campaign.run import run_campaign
from hpcwhirl.campaign.simulate import simulate
from hpcwhirl.cli import main
from hpcwhirl.dynamics.march import March
from hpcwhirl.errors import InputError
from hpcwhirl.planner.kinds import Grid, at_boundary
from hpcwhirl.planner.planner import completion_of
from hpcwhirl.scene import apply_settings, digest
from hpcwhirl.scene.words import ENUMS
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.directory.journal import Journals
from hpcwhirl.store.reading.shares import find_credibility, interval, shares

pytestmark = pytest.mark.turns

# at 250 rad/s hardly anything changes, at 330 a word is that of a coin
TABLES = {
    "scene": {"duration": 0.3},
    "solver": {"time_step": 8e-6},
    "output": {"traces": "summary"},
    "sweep": {"speed": [250.0, 330.0, 400.0]},
    "twins": {"count": 3, "spread": {"force": 0.3, "friction": 0.3}},
}
FIRST = on_engine("mostly_damped", TABLES)


def run(folder, policy=None, extend=None, **tables):
    design = design_of(FIRST | tables)
    prepare(design, Directory(folder), extend)
    ending = run_campaign(design, Directory(folder), policy=policy or Policy())
    assert ending.complete
    return all_variables(folder), ending


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole")
    run(folder)
    return folder


@given(some.text("0123456789abcdef", min_size=64, max_size=64), some.integers(1, 999))
def test_a_draw_is_a_number_of_its_case_twin_and_input_alone(name, number):
    one = draw(name, number, "force")
    assert -1.0 <= one <= 1.0
    assert one == draw(name, number, "force")
    assert one != draw(name, number + 1, "force")
    assert one != draw(name, number, "gap")


def test_without_a_seed_a_draw_is_what_it_was_and_each_seed_gives_another():
    told = hashlib.sha256(b"d 3 force").digest()
    whole = int.from_bytes(told[:8]) >> 11
    assert draw("d", 3, "force") == 2.0 * whole / (2**53 - 1) - 1.0
    drawn = [draw("d", 3, "force", seed) for seed in range(5)]
    assert drawn[0] == draw("d", 3, "force")
    assert len(set(drawn)) == 5


def test_twins_do_not_depend_on_what_is_kept_or_how_long_it_may_last():
    scene = design_of(FIRST).scenes[0]
    own = {"traces": "full", "interval": 1e-3, "until": "decided", "longest": 9.0}
    assert identity(apply_settings(scene, own), "") == identity(scene, "")
    other = apply_settings(scene, {"friction": 0.2})
    assert identity(other, "") != identity(scene, "")


def test_draws_are_even_and_do_not_repeat():
    drawn = np.array([draw("d", n, x) for n in range(4000) for x in ("force", "gap")])
    assert kstest(drawn, "uniform", (-1.0, 2.0)).pvalue > 1e-3
    assert abs(np.corrcoef(drawn[::2], drawn[1::2])[0, 1]) < 0.06


def test_a_twin_is_its_case_with_inputs_changed_a_little(whole):
    design = design_of(FIRST)
    records = Journals(whole).newest()
    twins = [record for record in records.values() if "twin" in record]
    assert len(twins) == 9
    for record in twins:
        case = record["case"]
        scene, own = design.scenes[case], design.digests[case]
        force, friction = (
            getattr(scene, name)
            * (1.0 + 0.3 * draw(identity(scene, ""), record["twin"], name))
            for name in ("force", "friction")
        )
        assert (record["row"]["force"], record["row"]["friction"]) == (force, friction)
        assert record["of"] == own
        twin = apply_settings(scene, {"force": force, "friction": friction})
        assert record["digest"] == digest(twin)
    assert len({record["row"]["force"] for record in twins}) == 9
    alone = simulate(apply_settings(scene, {"force": force, "friction": friction}))
    assert alone.row == twins[-1]["row"]


def test_a_case_is_as_without_twins(whole, tmp_path):
    design = design_of({n: t for n, t in FIRST.items() if n != "twins"})
    prepare(design, Directory(tmp_path))
    assert run_campaign(design, Directory(tmp_path)).complete
    without, with_ = root_variables(tmp_path), root_variables(whole)
    assert "word_share" in with_
    assert {n: with_[n] for n in without} == without


def test_the_share_of_a_word_is_that_of_its_twins(whole):
    data = hpcwhirl.open_results(whole)
    own, records = hpcwhirl.words(data.regime), Journals(whole).newest().values()
    for case in range(3):
        words = [r["row"]["regime"] for r in records
                 if r["case"] == case and "twin" in r]  # fmt: skip
        assert data.twin_count[case] == 3
        assert data.word_share[case] == words.count(own[case]) / 3
        for word in ("damped", "sustained", "divergent", "undecided"):
            share = data[f"share_{word}"].values[case]
            assert share == words.count(word) / 3
            low, high = (
                data[f"share_{word}_{end}"].values[case] for end in ("low", "high")
            )
            assert low <= share <= high
    assert data.word_share.values.min() < 1.0  # else nothing was tried


@given(
    some.integers(1, 60).flatmap(
        lambda n: some.tuples(some.integers(0, n), some.just(n))
    )
)
def test_the_interval_is_that_of_a_library_and_holds_the_share(pair):
    share, low, high = interval(*pair)
    found = binomtest(*pair).proportion_ci(method="wilson")
    assert (low, high) == (found.low, found.high)
    assert low - 1e-12 <= share <= high + 1e-12


def majority(own, *twins):
    found = shares(np.array([own]), np.array([twins]))["word_majority"]
    return ENUMS["word_majority"][found[0]]


def test_a_case_goes_by_the_word_of_most_of_its_twins_and_itself():
    assert majority("damped", *["sustained"] * 7, "damped") == "sustained"
    assert majority("damped", "sustained", "sustained", "damped") == "damped"  # 2 : 2
    assert majority("damped", "sustained", "divergent", "divergent") == "divergent"
    assert majority("damped", "unstable", "unstable") == "unstable"
    assert majority("damped", "failed", "missing") == "none"
    assert majority("failed", "sustained", "sustained") == "none"


def test_late_twins_are_a_sample_of_those_at_no_boundary():
    settings = [{"speed": float(v)} for v in range(400)]
    known = ["damped"] * 200 + ["sustained"] * 199 + [""]
    digests = [f"{i:064x}" for i in range(400)]

    def twinned(twins):
        return np.flatnonzero(Grid(settings, ["speed"], digests, twins).twinned(known))

    assert twinned({"of": "boundary"}).tolist() == [199, 200]

    def sample(count, seed=0):
        twins = {"of": "even", "sample": count, "seed": seed}
        return set(twinned(twins).tolist())

    assert sample(1000) == set(range(399)) - {199, 200}
    assert len(sample(50)) == 50
    assert sample(20) < sample(50)
    assert sample(50) != sample(50, seed=1)
    drawn = sorted(x for seed in range(40) for x in sample(50, seed))
    assert kstest(np.array(drawn) / 399, "uniform").pvalue > 1e-3


def test_the_credibility_counts_cases_whose_twins_all_agree():
    columns = {"twin_count": [0, 4, 4, 4], "word_share": [np.nan, 1.0, 0.75, 1.0]}
    columns = {name: ("case", values) for name, values in columns.items()}
    found = find_credibility(xarray.Dataset(columns, attrs={"twins_of": "even"}))
    assert (found.cases, found.kept, found.twins) == (3, 2, 4)
    assert found.share == interval(2, 3)
    assert str(found).startswith("of 3 even cases 2 keep their word in 4 twins: 66.7%")
    assert find_credibility(xarray.Dataset()) is None


def test_a_case_without_twins_has_no_share():
    own = np.array(["damped", "failed", "damped"])
    twins = np.array([["missing"] * 2, ["damped"] * 2, ["damped", "failed"]])
    found = shares(own, twins)
    assert found["twin_count"].tolist() == [0, 2, 1]
    assert np.isnan(found["word_share"][:2]).all()
    assert found["word_share"][2] == 1.0
    assert np.isnan(found["share_damped"][0])
    assert found["share_damped"][1] == 1.0


@pytest.mark.parametrize("of", ["all", "boundary", "even"])
def test_a_kill_among_twins_changes_no_bit(tmp_path, monkeypatch, of):
    table = {"twins": FIRST["twins"] | {"of": of}}
    expected, _ = run(tmp_path / "whole", **table)
    (found, _), deaths = until_it_lives(
        monkeypatch,
        30,
        lambda: run(tmp_path / "o", Policy(save_every=1e-9), **table),
    )
    assert deaths > 3
    assert found == expected


def test_more_twins_are_welcome_and_none_is_computed_again(
    whole, tmp_path, monkeypatch
):
    few, _ = run(tmp_path, twins=FIRST["twins"] | {"count": 2})
    made, advance = [], March.advance

    def counted(march, steps):
        made.append(steps)
        advance(march, steps)

    monkeypatch.setattr(March, "advance", counted)
    more, _ = run(tmp_path)
    assert more == all_variables(whole) != few
    assert len(Journals(tmp_path).newest()) == 12
    made.clear()
    again, _ = run(tmp_path, twins=FIRST["twins"] | {"count": 2})
    assert again == few
    assert made == []


def test_progress_counts_a_case_when_its_twins_are_there(tmp_path):
    for of in ("all", "boundary"):
        folder, table = tmp_path / of, {"twins": FIRST["twins"] | {"of": of}}
        without = design_of({n: t for n, t in FIRST.items() if n != "twins"})
        prepare(without, Directory(folder))
        run_campaign(without, Directory(folder))
        assert progress_of(Directory(folder)).left == 0
        prepare(design_of(FIRST | table), Directory(folder))
        words = hpcwhirl.words(hpcwhirl.open_results(folder).regime)
        differ = words[:-1] != words[1:]
        edge = np.r_[differ, False] | np.r_[False, differ]
        assert (
            progress_of(Directory(folder)).left
            == (3 if of == "all" else edge.sum())
            > 0
        )
        run(folder, **table)
        assert (
            progress_of(Directory(folder)).left,
            progress_of(Directory(folder)).done,
        ) == (0, 3)


def test_another_seed_is_refused_and_told_in_results(whole):
    other = FIRST | {"twins": FIRST["twins"] | {"seed": 1}}
    with pytest.raises(InputError, match=r"was begun with \[twins\] seed = 0, got 1"):
        prepare(design_of(other), Directory(whole))
    facts = hpcwhirl.open_results(whole).attrs
    assert (facts["twins_seed"], facts["twins_count"], facts["twins_of"]) == (
        0, 3, "all",
    )  # fmt: skip


def test_another_spread_is_refused(whole):
    other = FIRST | {"twins": FIRST["twins"] | {"spread": {"force": 0.1}}}
    with pytest.raises(InputError, match=r"was begun with \[twins\] spread = "):
        prepare(design_of(other), Directory(whole))


def test_a_twin_that_fails_is_told_and_counts_for_nothing(tmp_path, monkeypatch):
    even_slices(monkeypatch)  # a case of one slice is never late
    late = Policy(case_limit=1e-9)
    design = design_of(FIRST)
    prepare(design, Directory(tmp_path))
    run_campaign(
        design_of({n: t for n, t in FIRST.items() if n != "twins"}), Directory(tmp_path)
    )
    ending = run_campaign(design, Directory(tmp_path), policy=late)
    assert (ending.failed, ending.of_twins) == (3, 3)
    data = hpcwhirl.open_results(tmp_path)
    assert (hpcwhirl.words(data.status) == "ok").all()
    assert data.twin_count.values.tolist() == [0, 0, 0]
    assert np.isnan(data.word_share.values).all()


def test_classify_keeps_the_shares(tmp_path):
    folder = tmp_path / "o"
    run(folder)
    before = all_variables(folder)
    assert main(["classify", str(folder), "--set", "significance=1e9", "--write"]) == 0
    data = hpcwhirl.open_results(folder)
    with h5py.File(folder / "results.h5") as file:
        regimes, own = file["twins/regime"][:], file["regime"][:]
        both = (file["twins/regime"].attrs, file["regime"].attrs)
        assert both[0]["flag_meanings"] == both[1]["flag_meanings"]
    expected = (regimes == own[:, None]).mean(axis=1)
    assert np.array_equal(data.word_share.values, expected)
    assert all_variables(folder) != before
    assert main(["classify", str(folder)]) == 0
    assert all_variables(folder) == before


def test_twins_of_boundaries_stand_where_neighbours_differ(tmp_path):
    table = FIRST["twins"] | {"of": "boundary"}
    speeds = [100.0, 250.0, 400.0, 420.0]
    run(tmp_path, twins=table, sweep={"speed": speeds})
    data = hpcwhirl.open_results(tmp_path)
    words = hpcwhirl.words(data.regime)
    edge = [
        any(words[i] != words[j] for j in (i - 1, i + 1) if 0 <= j < 4)
        for i in range(4)
    ]
    assert 0 < sum(edge) < 4
    assert (data.twin_count.values == 3 * np.array(edge)).all()
    # one more speed moves the boundaries: shares are those of the new ones
    more = sorted([*speeds, 200.0, 330.0])
    grown, _ = run(tmp_path, twins=table, sweep={"speed": more})
    fresh, _ = run(tmp_path / "fresh", twins=table, sweep={"speed": more})
    assert grown == fresh


def test_a_neighbour_differs_in_one_number_by_one_level():
    rows = [{"a": a, "b": b, "word": w} for a in (1, 2, 4) for b in (0.1, 0.2)
            for w in ("x", "y")]  # fmt: skip
    words = ["s"] * 12
    words[4] = "t"  # a = 2, b = 0.1, x
    found = at_boundary(rows, ["a", "b", "word"], words)
    assert np.flatnonzero(found).tolist() == [0, 4, 6, 8]
    words[4] = ""  # it failed: nobody knows whether a boundary is beside it
    assert not at_boundary(rows, ["a", "b", "word"], words).any()


def test_only_what_has_a_regime_is_a_neighbour_of_another():
    row = {"outcome": "completed", "regime": "damped"}
    lost = {"outcome": "unstable", "regime": "none"}
    assert completion_of({"status": "ok", "row": row}).word == "damped"
    assert completion_of({"status": "ok", "row": lost}).word == ""
    assert completion_of({"status": "timeout"}).word == ""


def test_twins_go_on_with_their_case(tmp_path):
    table = {"scene": {"duration": 0.1}, "sweep": {"speed": [330.0, 430.0]}}
    own = {"until": "decided", "longest": 0.4}
    natural, _ = run(tmp_path / "a", solver=FIRST["solver"] | own, **table)
    run(tmp_path / "b", **table)
    extended, _ = run(tmp_path / "b", extend=0.4, **table)
    assert extended == natural
    with h5py.File(tmp_path / "b" / "results.h5") as file:
        assert set(np.unique(file["twins/duration"][:])) >= {0.4}


WRONG = {
    "count = 1": "[twins] count must be a whole number from 2 to 1000, got 1",
    'of = "speckle"': "[twins] of must be all, boundary or even (speckle needs",
    'of = "boundaryy"': "unknown [twins] of 'boundaryy'; did you mean 'boundary'?",
    "cuont = 3": "unknown key in [twins] 'cuont'; did you mean 'count'?",
    "sure = 2": "[twins] sure must be a number > 0, at most 1, got 2",
    "spread = {forcee = 1e-6}": "unknown scene input 'forcee'",
    "spread = {blades = 0.1}": "spread blades must be of an input that is a real",
    "spread = {force = 2}": "spread force must be a number >= 1e-12 and < 1, got 2",
    "spread = 3": "[twins] spread must be a table such as {force = 1e-6}, got 3",
}


@pytest.mark.parametrize("line", WRONG)
def test_a_wrong_table_is_one_line(line, tmp_path, capsys):
    file = tmp_path / "c.toml"
    file.write_text(f"sweep = {{speed = [300, 400]}}\n[twins]\n{line}\n")
    assert main(["campaign", str(file), "--out", str(tmp_path / "o")]) == 2
    (told,) = capsys.readouterr().err.splitlines()
    assert WRONG[line] in told
    assert not (tmp_path / "o").exists()


def test_boundaries_need_numbers_and_all_words(tmp_path, capsys):
    file = tmp_path / "c.toml"
    file.write_text('twins = {of = "boundary"}\nsweep = {direction = ["squeeze"]}\n')
    assert main(["campaign", str(file), "--out", str(tmp_path / "o")]) == 2
    assert "no two cases differ in one number alone" in capsys.readouterr().err
    file.write_text('twins = {of = "boundary"}\nsweep = {speed = [300, 400]}\n')
    words = ("--out", str(tmp_path / "o"), "--shard", "1/2")
    assert main(["campaign", str(file), *words]) == 2
    assert "needs the words of all cases: no --shard" in capsys.readouterr().err


def test_a_dry_run_counts_twins(tmp_path, facts):
    file = tmp_path / "c.toml"
    text = "solver = {time_step = 2e-6}\nscene = {duration = 4e-3}\n"
    file.write_text(text + "sweep = {speed = [300, 400]}\n")
    words = ("campaign", str(file), "--dry-run", "--json", "--out", str(tmp_path / "o"))
    alone = facts(*words)
    file.write_text(text + "sweep = {speed = [300, 400]}\ntwins = {count = 4}\n")
    found = facts(*words)
    assert found["steps"] == 5 * alone["steps"]
    assert found["bytes"]["results"] > alone["bytes"]["results"]


@pytest.mark.slow
@pytest.mark.mpi
def test_two_ranks_have_the_same_twins(whole, tmp_path):
    import tomli_w

    file = tmp_path / "c.toml"
    file.write_text(tomli_w.dumps(FIRST))
    done = launch("campaign", file, "--map=no", "--out", tmp_path / "o", ranks=2)
    assert done.returncode == 0, done.err
    assert all_variables(tmp_path / "o") == all_variables(whole)


@pytest.mark.parametrize(
    "tables",
    [
        {"sweep": {"force": [0.0, 75e3]}},
        {"sweep": {"rotor.damping": [0.0, 0.01]}, "spread": {"rotor.damping": 0.01}},
        {"scene": {"friction": 0.0}, "spread": {"friction": 0.1}},
    ],
)
def test_a_relative_spread_about_zero_is_refused(tables):
    # all twins were the case itself: missing for ever, and a share of one computation
    twins = {"count": 4, "spread": tables.pop("spread", {"force": 1e-6})}
    with pytest.raises(InputError, match="change of 0 has no effect"):
        design_of({"sweep": {"speed": [300.0]}, **tables, "twins": twins})
    with pytest.raises(InputError, match="must be a number >= 1e-12"):
        design_of({"twins": {"spread": {"gap": 1e-17}}})


def test_every_place_tells_the_same_numbers_of_cases_and_twins(tmp_path, capsys, facts):
    folder = tmp_path / "out"
    run(folder)
    told = capsys.readouterr().err
    assert "hpcwhirl: 3 cases, 3 twins for each case\n" in told
    assert "hpcwhirl: 3 of 3 cases and 9 of 9 twins, " in told
    assert "hpcwhirl: 3 cases and 9 twins in " in told
    found = facts("status", str(folder), "--json")
    assert (found["cases"], found["done"], found["twins"]) == (3, 3, [9, 9, 0])
    rows = [row["word"] for row in facts("cases", str(folder), "--json")["cases"]]
    assert found["words"] == {word: rows.count(word) for word in set(rows)}
    assert main(["status", str(folder)]) == 0
    assert "\ntwins: 9, 9 done\n" in capsys.readouterr().out


def test_a_campaign_whose_twins_alone_fail_says_so(tmp_path, capsys, monkeypatch):
    import tomli_w

    even_slices(monkeypatch)  # a case of one slice is never late
    folder, file = tmp_path / "out", tmp_path / "c.toml"
    without = {n: t for n, t in FIRST.items() if n != "twins"}
    file.write_text(tomli_w.dumps(without))
    assert main(["campaign", str(file), "--out", str(folder), "--map", "no"]) == 0
    file.write_text(tomli_w.dumps(FIRST | {"output": FIRST["output"]}))
    words = ["campaign", str(file), "--out", str(folder), "--map", "no"]
    assert main([*words, "--case-limit", "1e-9"]) == 1
    told = capsys.readouterr().err
    assert "hpcwhirl: twins of 3 of 3 cases have no result\n" in told
    assert main(["status", str(folder)]) == 0
    assert "failed: 0\nleft: 0\ntwins: 9, 0 done, 9 failed\n" in capsys.readouterr().out
