"""The one table of words: against a plain twin, over many cases, in old files."""

from dataclasses import asdict, fields

import h5py
import made_up
import numpy as np
import pytest
from specimen import begin

from hpcwhirl.analysis import rules
from hpcwhirl.analysis.regimes import Thresholds, name_regime
from hpcwhirl.cli import main
from hpcwhirl.errors import StoreError
from hpcwhirl.scene import words
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.reading.reader import coded, open_coded, open_results
from hpcwhirl.store.reading.results_file import Results, count_statuses, words_in
from hpcwhirl.store.results.gather import gather
from hpcwhirl.store.results.relabel import relabel

pytestmark = pytest.mark.turns


def varied(random):
    """Return thresholds about the default ones."""
    return Thresholds(
        **{f.name: made_up.near(random, f.default) for f in fields(Thresholds)}
    )


@pytest.mark.oracle
def test_the_table_names_as_its_plain_twin_does():
    random, seen = np.random.default_rng(3), set()
    for case in range(1000):
        limits = Thresholds() if case % 2 else varied(random)
        numbers = made_up.evidence(random)
        named = name_regime(numbers, limits)
        assert named == twin(numbers, limits)
        seen |= {named[1]}
    assert seen == {"none", "damped", "sustained", "divergent", "undecided"}


def test_many_cases_are_named_as_each_alone():
    random = np.random.default_rng(4)
    rows = [made_up.evidence(random) for _ in range(300)]
    columns = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    together = rules.words_by_table(columns, asdict(Thresholds()))
    alone = [name_regime(row, Thresholds()) for row in rows]
    assert list(zip(*(column.tolist() for column in together), strict=True)) == alone
    nobody = {name: column[:0] for name, column in columns.items()}
    assert [len(c) for c in rules.words_by_table(nobody, asdict(Thresholds()))] == [
        0
    ] * 3


def test_every_word_has_a_code_a_look_and_a_rule():
    for name, table in words.RULES.items():
        ruled = {rule.word for rule in table}
        assert ruled <= set(words.ENUMS[name])
        assert not table[-1].needs  # some word is always given
        if name != "outcome":
            assert ruled == set({"regime": words.REGIMES, "whirl": words.WHIRLS}[name])
    assert set(words.ENUMS["whirl"]) == set(words.WHIRLS)


LOST = ("unstable", "none", "none")


@pytest.fixture
def older(tmp_path):
    """Return results of a version that had other regimes, in another order."""
    begin(tmp_path, one_interval=True)
    path = gather(Directory(tmp_path), {})
    with h5py.File(path, "r+") as file:
        file["regime"].attrs["flag_values"] = np.arange(3, dtype="i1")
        file["regime"].attrs["flag_meanings"] = np.bytes_("none drifting damped")
        file["regime"][:] = [2, 0, 1, 0, 1]
    return path


def test_words_are_those_of_the_files_own_table(older):
    found = ["damped", "none", "drifting", "none", "drifting"]
    assert open_results(older)["regime"].values.tolist() == found
    assert Results(older.parent)["regime"].tolist() == found
    assert count_statuses(older) == {"ok": 3, "failed": 1, "missing": 1}


@pytest.mark.parametrize("code", [-1, 3, 127])
def test_a_code_without_a_word_is_refused_whoever_reads_it(older, code):
    with h5py.File(older, "r+") as file:
        file["regime"][3] = code
    told = "regime is damaged: it has a code without a word"
    with h5py.File(older) as file, pytest.raises(StoreError, match=told):
        words_in(file, "regime")
    with pytest.raises(StoreError, match=told):
        open_results(older)
    with open_coded(older) as data, pytest.raises(StoreError, match=told):
        coded(data["regime"])


@pytest.mark.parametrize("at_once", [1, 2, 99])
def test_an_older_file_takes_new_words_with_their_table(older, monkeypatch, at_once):
    monkeypatch.setattr("hpcwhirl.store.results.relabel.AT_ONCE", at_once)
    changes = relabel(
        Directory(older.parent),
        lambda n: rules.words_by_table(n, asdict(Thresholds())),
        {},
    )
    was, now = zip(*changes.elements(), strict=True)
    assert sorted(old[1] for old in was) == ["damped", "drifting", "drifting"]
    with h5py.File(older) as file:
        for name in ("outcome", "regime", "whirl"):
            meanings = file[name].attrs["flag_meanings"].decode().split()
            assert meanings == [*words.ENUMS[name]]
            assert file[name].attrs["flag_values"].tolist() == [*range(len(meanings))]
            assert 0 <= file[name][:].min() <= file[name][:].max() < len(meanings)
        given = words_in(file, "regime")[[0, 2, 4]].tolist()
        assert sorted(given) == sorted(new[1] for new in now)
        assert words_in(file, "regime")[[1, 3]].tolist() == ["none", "none"]


def test_a_word_that_is_new_is_a_line_of_the_table(older, monkeypatch):
    new = words.Rule("hopping", ("ledger_error >= 0",))
    monkeypatch.setitem(words.ENUMS, "regime", (*words.ENUMS["regime"], "hopping"))
    monkeypatch.setitem(words.RULES, "regime", (new, *words.RULES["regime"]))
    monkeypatch.setitem(words.RULES, "outcome", (words.Rule("completed"),))
    assert main(["classify", str(older.parent)]) == 0
    assert set(open_results(older)["regime"].values[[0, 2, 4]].tolist()) == {"hopping"}


def test_a_word_of_no_table_is_not_written(older):
    def alien(numbers):
        given = np.full(len(numbers["stop"]), "flying")
        return given, given, given

    before = older.read_bytes()
    with pytest.raises(StoreError, match="flying, which this version does not know"):
        relabel(Directory(older.parent), alien, {})
    assert older.read_bytes() == before


def twin(numbers, limits):
    """Return the words by the rule in plain Python."""
    stop = numbers["stop"]
    broken = numbers["ledger_error"] > limits.ledger
    broken = broken or numbers["gap_error"] > limits.opening
    broken = broken or numbers["step_share"] >= 1.0
    if stop in {"nonfinite", "complementarity"} or broken:
        return LOST
    fed = numbers["ledger_rotation"] + numbers["ledger_friction"]
    fed += max(-numbers["ledger_damping"], 0.0)  # by supports
    loaded = numbers["end_time"] - numbers["window"] < numbers["load_end"]
    rate = min(numbers["growth_rate"], numbers["growth_rotor"])
    still = loaded and rate * numbers["window"] <= limits.rise
    load = numbers["ledger_pulse"] + numbers["driven_energy"]
    if stop == "amplitude" and (still or not fed > load):
        return "overloaded", "none", "none"
    outcome = "stopped" if stop == "amplitude" else "completed"
    return outcome, _regime(numbers, limits), _whirl(numbers, limits)


def _regime(numbers, limits):
    value = {name: float(of) for name, of in numbers.items() if not isinstance(of, str)}
    if numbers["stop"] == "amplitude":
        return "divergent"
    loaded = value["end_time"] - value["window"] < value["load_end"]
    calm = value["free_growth"] <= 0.0
    proved = value["certificate"] >= 0.0 and calm
    if proved or (value["late_energy"] == 0.0 and calm and not loaded):
        return "damped"
    if loaded:
        return "undecided"
    clear = abs(value["growth_rate"]) > limits.significance * value["growth_error"]
    if not value["late_contacts"]:
        falling = value["growth_rate"] < 0.0
        falling = falling and all(rate <= 0.0 for rate in _parts(value, limits))
        return "damped" if clear and falling and calm else "undecided"
    steady = _rubs_steadily(value, limits)
    grows = value["late_fed"] > 0.0 and clear and _diverges(value, limits)
    if grows and not steady:
        return "divergent"
    most = limits.drift if clear else limits.unclear
    rise = min(value["growth_rate"], value["growth_rotor"]) * value["window"]
    kept_up = _is_kept_up(value, limits, most)
    kept_up |= steady and rise <= limits.rise and _is_kept_up(value, limits)
    return "sustained" if kept_up else "undecided"


def _rubs_steadily(value, limits):
    """Return whether casing and shaft change by no more than the drift."""
    _, casing, centre = _parts(value, limits)
    still = max(abs(casing), abs(centre)) * value["window"] <= limits.drift
    return casing != 0.0 and still


def _parts(value, limits):
    """Return the growth of rotor, casing and centre, 0 of a centre that is at rest.

    Where all sectors move alike, round-off is all that moves it.
    """
    rest = value["orbit_radius"] < limits.whirl_floor * value["gap_scale"]
    centre = 0.0 if rest else value["growth_centre"]
    return value["growth_rotor"], value["growth_casing"], centre


def _diverges(value, limits):
    """Return whether the whole and the rotor rise, go on to, and are at their top."""
    window, rate = value["window"], value["growth_rate"]
    rising = min(rate, value["growth_rotor"]) * window > limits.rise
    onward = value["growth_last"] >= limits.onward * rate
    return rising and onward and value["summit"] > limits.above


def _is_kept_up(value, limits, most=np.inf):
    """Return whether a motion that changes by at most `most` is fed what it loses."""
    rotor, _, centre = _parts(value, limits)
    rates = value["growth_rate"], rotor, centre
    change = max(abs(rate) for rate in rates) * value["window"]
    lost = value["late_lost"]
    turned_over = lost >= limits.turnover * value["late_energy"]
    fed = value["late_fed"]
    kept_up = min(fed, lost) >= limits.replaced * max(fed, lost)
    return change <= most and turned_over and kept_up


def _whirl(numbers, limits):
    floor = limits.whirl_floor * float(numbers["gap_scale"])
    if float(numbers["orbit_radius"]) < floor:
        return "none"
    if numbers["whirl_ratio"] == 0.0 == numbers["line_frequency"]:
        return "none"
    if abs(numbers["whirl_ratio"]) <= limits.direction:
        return "mixed"
    return "forward" if numbers["whirl_ratio"] > 0 else "backward"
