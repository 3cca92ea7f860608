"""How far each blade moves, and how much further where blades differ."""

import numpy as np
import pytest
from launch import BARE, launch, root_variables

import hpcwhirl
from hpcwhirl.analysis.blade_motion import blade_amplitudes, blade_numbers, localisation
from hpcwhirl.campaign.plan.design import design_of
from hpcwhirl.errors import InputError
from hpcwhirl.scene import apply_settings
from hpcwhirl.store.results.variables import amplification
from hpcwhirl.studies.shares import shares

pytestmark = pytest.mark.turns

SMALL = {
    "scene": {"duration": 3e-3},
    "engine": {"rotor": {"blades": 5, "elements": 3}},
    "solver": {"time_step": 2e-6, "modes": 10},
    "output": {"interval": 2e-5, "traces": "blades"},
}
LAW = {"distribution": "normal", "mean": 0.0, "deviation": 0.05}
NUMBERS = ("blade_amplitude", "blade_peak", "localisation")


def waves(time, sizes, still=0.0):
    """Return tips (n, N, 2) that swing harmonically about a place."""
    swing = np.sin(50 * 2 * np.pi * time)[:, None] * sizes + still
    return np.stack([np.zeros_like(swing), swing], axis=2)


def test_localisation_counts_the_blades_that_share_the_motion():
    assert localisation(np.full(22, 3e-5)) == pytest.approx(1.0)
    assert localisation(np.eye(22)[4] * 1e-6) == pytest.approx(22.0)
    half = np.where(np.arange(22) % 2, 1.0, 0.0)
    assert localisation(half) == pytest.approx(2.0)
    standing = np.cos(2 * np.pi * np.arange(22) / 22)
    assert localisation(abs(standing)) == pytest.approx(1.5)
    assert localisation(np.full(5, 1e-300)) == pytest.approx(1.0)
    assert localisation(np.zeros(5)) == 1.0  # all alike


def test_an_amplitude_is_an_rms_of_the_window_about_its_mean():
    time, sizes = np.arange(1, 2001) * 1e-4, np.array([1.0, 2.0, 0.5])
    tips = waves(time, sizes, still=7.0)
    np.testing.assert_allclose(blade_amplitudes(tips), sizes / 2**0.5, rtol=1e-9)
    tips[:1000] *= 9.0  # before the window
    found = blade_numbers(time, tips, 0.1)
    assert found["blade_amplitude"] == pytest.approx(2.0 / 2**0.5, rel=1e-9)
    assert found["blade_peak"] == pytest.approx(9 * 9.0, rel=1e-3)
    assert blade_numbers(time, tips[:0], 0.1) == {}
    assert blade_numbers(time, tips, 1.0) == {}


def test_they_are_those_of_the_traces_and_keep_none():
    scene = design_of(SMALL).base
    told, whole, plain = (
        hpcwhirl.simulate(apply_settings(scene, {"traces": level}))
        for level in ("blades", "full", "summary")
    )
    assert told.traces == {}
    assert whole.row == told.row  # bit for bit
    assert {n: v for n, v in told.row.items() if n not in NUMBERS} == plain.row
    tips, late = whole.traces["tips"], whole.traces["time"] > 0.6 * 3e-3
    by_hand = np.hypot(*(tips[late] - tips[late].mean(axis=0)).transpose(2, 0, 1))
    most = np.sqrt((by_hand**2).mean(axis=0)).max()
    assert told.row["blade_amplitude"] == pytest.approx(most, rel=1e-12)


def test_amplification_is_over_the_tuned_engine_with_the_same_other_inputs(tmp_path):
    patterns = [[0.1, -0.1, 0.0, 0.05, 0.0], [], [0.0, 0.2, 0.0, 0.0, 0.0]]
    swept = {"speed": [300.0, 410.0], "mistuning": patterns}
    made = design_of({**SMALL, "sweep": swept})
    with hpcwhirl.campaign(made, tmp_path / "out") as data:
        found = data.amplification.to_numpy().reshape(2, 3)
        amplitude = data.blade_amplitude.to_numpy().reshape(2, 3)
        assert data.amplification.attrs["units"] == "1"
        assert data.blade_amplitude.attrs["units"] == "m"
        assert "tips" not in data
    assert (found == amplitude / amplitude[:, 1:2]).all()
    assert (found[:, 1] == 1.0).all()
    assert len(set(found[0])) == 3
    by_hand = [hpcwhirl.simulate(s).row["blade_amplitude"] for s in made.scenes[:2]]
    assert found[0, 0] == by_hand[0] / by_hand[1]


def test_without_a_tuned_engine_or_blades_there_is_none(tmp_path):
    pattern = {"mistuning": [[0.1, -0.1, 0.0, 0.05, 0.0]]}
    with hpcwhirl.campaign({**SMALL, "sweep": pattern}, tmp_path / "a") as data:
        assert "localisation" in data
        assert "amplification" not in data
    plain = {**SMALL, "output": {"traces": "summary"}, "sweep": {"speed": [300.0]}}
    with hpcwhirl.campaign(plain, tmp_path / "b") as data:
        assert "localisation" not in data


def test_what_was_modelled_otherwise_is_not_compared(tmp_path):
    swept = {"mistuning": [[], [0.1, -0.1, 0.0, 0.05, 0.0]]}
    chosen = {**SMALL, "solver": {"truncation": 0.3, "modes": 10}, "sweep": swept}
    with hpcwhirl.campaign(chosen, tmp_path / "out") as data:
        modes = data.modes.to_numpy()
        assert modes[0] != modes[1] == 10
        np.testing.assert_equal(data.amplification.to_numpy(), [1.0, np.nan])
    sample = {"count": 4, "tuned": True, "mistuning": LAW}
    for name in ("accuracy", "truncation"):
        with pytest.raises(InputError, match=f"{name}, which .*, must be 0, got 0.05"):
            design_of({**SMALL, "solver": {name: 0.05}, "sample": sample})


def test_over_a_tuned_engine_at_rest_there_is_no_number(tmp_path):
    swept = {"mistuning": [[], [0.1, -0.1, 0.0, 0.05, 0.0]]}
    still = {**SMALL, "scene": {"duration": 3e-3, "force": 0.0}, "sweep": swept}
    with hpcwhirl.campaign(still, tmp_path / "still") as data:
        assert (data.blade_amplitude == 0).all()
        assert np.isnan(data.amplification).all()


def test_a_users_function_is_told_them(tmp_path):
    def peak(case):
        return {"own": case.blade_peak}

    one = {**SMALL, "sweep": {"speed": [300.0]}}
    with hpcwhirl.campaign(
        one, tmp_path / "out", measure=peak, variables={"own": "m"}
    ) as data:
        assert data.own.item() == data.blade_peak.item() > 0.0


def test_a_sample_has_its_tuned_engine_at_each_point(tmp_path):
    given = {"count": 4, "tuned": True, "mistuning": LAW}
    made = design_of({**SMALL, "sweep": {"speed": [300.0, 410.0]}, "sample": given})
    name = "engine.rotor.mistuning"
    assert [not row[name] for row in made.settings] == ([True] + [False] * 4) * 2
    with hpcwhirl.campaign(made, tmp_path / "out") as data:
        found = shares(data)
        assert data.amplification.to_numpy()[[0, 5]].tolist() == [1.0, 1.0]
        assert np.isfinite(data.amplification).all()
    assert (found.cases + found.lost).to_numpy().tolist() == [4, 4]  # it is no draw
    more = design_of({**SMALL, "sample": {**given, "count": 8}})
    assert more.settings[:5] == tuple({name: row[name]} for row in made.settings[:5])


@pytest.mark.parametrize(
    ("more", "told"),
    [
        ({"tuned": 1}, "tuned must be true or false, got 1"),
        ({"tuned": True, "gap": {**LAW, "mean": 1.0}}, "of mistuning, not with gap"),
        ({"tuned": True, "method": "saltelli", "gap": LAW}, "not with gap"),
    ],
)
def test_a_tuned_engine_goes_with_mistuning_alone(more, told):
    with pytest.raises(InputError, match=told):
        design_of({**SMALL, "sample": {"count": 4, "mistuning": LAW, **more}})


TOML = (
    BARE
    + """
scene = {duration = 3e-3}
engine = {rotor = {blades = 5, elements = 3}}
solver = {time_step = 2e-6, modes = 10}
output = {interval = 2e-5, traces = "blades"}
sweep = {speed = [300, 410]}
[sample]
count = 4
tuned = true
mistuning = {distribution = "normal", mean = 0.0, deviation = 0.05}
"""
)


@pytest.mark.slow
@pytest.mark.mpi
def test_two_ranks_compare_with_the_same_tuned_engine(tmp_path):
    path = tmp_path / "population.toml"
    path.write_text(TOML)
    for name, ranks in (("alone", 0), ("together", 2)):
        done = launch("campaign", path, "--out", tmp_path / name, ranks=ranks)
        assert done.returncode == 0, done.err
    alone, together = (root_variables(tmp_path / n) for n in ("alone", "together"))
    assert "amplification" in alone
    assert together == alone


def test_cases_that_stopped_early_have_no_amplification():
    time, tips = np.array([1.0, 2.0]), np.ones((2, 3, 2))
    assert blade_numbers(time, tips, start=1.5) == {}  # one sample has no amplitude
    tuned = {"row": {"stop": "end", "blade_amplitude": 2.0}}
    assert amplification({"row": {"stop": "end"}}, tuned) == {}
    early = {"row": {"stop": "amplitude", "blade_amplitude": 1.0}}
    assert amplification(early, tuned) == amplification(tuned, early) == {}
    assert amplification(tuned, tuned) == {"amplification": 1.0}
