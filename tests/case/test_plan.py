"""What a plan leaves out is not missed: lean models against the whole."""

import json

import numpy as np
import pytest
from deaths import even_slices

from hpcwhirl.campaign.simulate import result_of
from hpcwhirl.case import growth
from hpcwhirl.case.explain import facts_of_plan
from hpcwhirl.case.plan import folded_model, folds_of
from hpcwhirl.case.resolve import resolve
from hpcwhirl.cli import main
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.kernels.kernel_types import Body
from hpcwhirl.dynamics.kernels.vectors import widths
from hpcwhirl.dynamics.march import March
from hpcwhirl.dynamics.waves import turning_waves, whole_waves
from hpcwhirl.errors import ModelError
from hpcwhirl.reduction.growth import Band, Span, Stability
from hpcwhirl.scene import apply_settings, named_scene

SERIES = (
    "tips",
    "energy",
    "impulse",
    "lost",
    "fed",
    "friction",
    "blade_impulse",
    "casing",
)

ENERGIES = ("energy", "lost", "fed", "friction")


def scene(**settings):
    fast = {"duration": 5e-3, "interval": 1e-5, "traces": "full", "time_step": 1e-6}
    return apply_settings(named_scene("mostly_damped"), fast | settings)


def both(**settings):
    """Return the marches and histories of a scene, lean and whole."""
    marches = [
        March(resolve(scene(**settings, plan=plan))) for plan in ("lean", "everything")
    ]
    return marches, [march.run() for march in marches]


def assert_same_motion(marches, histories, tolerance):
    lean, whole = histories
    assert (lean.steps, lean.stop) == (whole.steps, whole.stop)
    assert (lean.contacts, lean.last_contact) == (whole.contacts, whole.last_contact)
    through = sum(abs(v) for v in whole.ledger.values())
    for name in SERIES:
        one, other = getattr(lean, name), getattr(whole, name)
        assert one.shape == other.shape, name
        floor = 0.01 * through if name in ENERGIES else 0.0
        scale = max(np.abs(other).max(initial=0), floor)
        assert np.abs(one - other).max(initial=0) <= tolerance * scale, name
    for term, value in whole.ledger.items():
        assert abs(lean.ledger[term] - value) <= tolerance * through, term
    moved = max(np.abs(a).max(initial=0) for a in marches[1].displacements())
    assert np.abs(lean.centre - whole.centre).max() <= tolerance * moved
    for one, other in zip(*(m.displacements() for m in marches), strict=True):
        assert one.shape == other.shape
        scale = np.abs(other).max(initial=0)
        assert np.abs(one - other).max(initial=0) <= tolerance * scale


def test_two_lobes_need_half_the_blades_and_no_centre():
    marches, histories = both(nodal_diameter=2, friction=0.2)
    assert marches[0].lean.model.blades == 11
    assert histories[0].folds == 2
    assert histories[0].contacts > 20
    assert_same_motion(marches, histories, 1e-11)
    assert not histories[0].centre.any()


SYMMETRIC = [
    {"nodal_diameter": 4, "speed": -300.0},
    {"nodal_diameter": 0, "force": 2e6, "gap": 1e-5},
    {"nodal_diameter": 22, "harmonics": 25, "force": 2e7, "gap": 1e-5},
    {"nodal_diameter": 3, "blades": 21},
    {"nodal_diameter": 6, "blades": 9, "modes": 60, "force": 2e6, "gap": 1e-5},
    {"nodal_diameter": 2, "scheme": "exact"},
    {"nodal_diameter": 2, "kind": "rigid", "amplitude": 2e-4, "growth": 40.0},
    {"nodal_diameter": 2, "rotation": "full", "friction": 0.2},
    {"nodal_diameter": 4, "speed": -300.0, "rotation": "full", "scheme": "exact"},
    {"nodal_diameter": 11, "rotation": "full", "force": 8e6, "gap": 1e-5},
    {"nodal_diameter": 3, "blades": 21, "rotation": "full"},
]


@pytest.mark.slow
@pytest.mark.parametrize("settings", SYMMETRIC, ids=str)
def test_sectors_that_move_alike_are_one(settings):
    marches, histories = both(**settings)
    assert histories[0].folds > 1
    assert histories[0].contacts > 0
    assert_same_motion(marches, histories, 1e-10)


@pytest.mark.parametrize(
    ("settings", "folds"),
    [
        ({"nodal_diameter": 1}, 1),
        ({"nodal_diameter": 4}, 2),
        ({"nodal_diameter": 0}, 22),
        ({"nodal_diameter": 11}, 11),
        ({"nodal_diameter": 3}, 1),
        ({"nodal_diameter": 3, "blades": 21}, 3),
        ({"nodal_diameter": 2, "scheme": "exact"}, 2),
        ({"nodal_diameter": 2, "rotation": "full"}, 2),
        ({"nodal_diameter": 2, "rotation": "full", "unbalance": 1e-4}, 1),
        ({"nodal_diameter": 2, "plan": "everything"}, 1),
        ({"nodal_diameter": 2, "scheme": "paper"}, 1),
        ({"nodal_diameter": 2, "scheme": "general"}, 1),
        ({"nodal_diameter": 2, "discretization": "elements"}, 1),
        ({"nodal_diameter": 2, "mistuning": [0.01] + 21 * [0.0]}, 1),
        ({"nodal_diameter": 2, "kind": "rigid", "discretization": "elements"}, 2),
    ],
)
def test_only_what_is_symmetric_folds(settings, folds):
    assert folds_of(scene(**settings)) == folds


def test_all_sectors_are_marched_where_waves_are_not_told_apart(monkeypatch):
    for module in (turning_waves, whole_waves):
        monkeypatch.setattr(module, "WORST", 1.0)
    march = March(resolve(scene(nodal_diameter=2, rotation="full", modes=44)))
    assert march.case.plan.folds == 2
    assert march.lean.model.folds == 1
    assert isinstance(march.scheme.arrays.rotor, Body)


def test_a_model_folds_by_its_symmetry_only():
    whole = resolve(scene()).model
    for folds in (1, 3, 44):
        with pytest.raises(ModelError, match="equal sectors"):
            folded_model(whole, folds)


def test_a_sector_keeps_frequencies_and_takes_its_share_of_the_mass():
    whole = resolve(scene(modes=200)).model
    sector = folded_model(whole, 2)
    for body, half in ((whole.rotor, sector.rotor), (whole.casing, sector.casing)):
        even = body.diameter % 2 == 0
        assert np.array_equal(half.omega, body.omega[even])
        assert np.array_equal(2 * half.diameter, body.diameter[even])
    # a static tip load has the compliance of the whole to loads on both sectors
    tip = whole.rotor.shapes[0]
    opposite = whole.rotor.shapes[2 * 11]
    flexible = (tip * (tip + opposite) / whole.rotor.omega**2).sum()
    own = (sector.rotor.shapes[0] ** 2 / sector.rotor.omega**2).sum()
    assert own == pytest.approx(flexible, rel=1e-12)


TURNING = {
    "rotation": "full", "support_frequency": 400.0, "engine.rotor.damping": 0.05,
    "engine.rotor.suspension_damping": 0.3, "friction": 0.2, "gap": 4e-4,
}  # fmt: skip
CLOSED = [
    {"nodal_diameter": 2, "gap": 1e-3, "friction": 0.2},
    {"support_frequency": 400.0, "gap": 1e-3, "speed": 500.0, "interval": 3.7e-5},
    {"gap": 0.05, "force": 2e3, "support_frequency": 100.0},
    {**TURNING, "gap": 2.5e-4, "speed": 350.0},
    {**TURNING, "unbalance": 2e-3, "unbalance_phase": 1.0},
    {**TURNING, "nodal_diameter": 2, "speed": -300.0},
]


def state_of(march):
    """Return the parts of a march's state that have a scale of their own."""
    rotor, width = march.state.rotor, 2 * widths(march.model.blades)[0]
    return np.split(rotor, len(rotor) - width * np.array([3, 2, 1]))


@pytest.mark.parametrize("settings", CLOSED, ids=str)
def test_what_follows_a_certificate_is_what_stepping_gives(settings):
    marches, histories = both(**{"interval": 1e-4, "duration": 0.0803} | settings)
    lean, whole = histories
    assert 0.0 < lean.certificate < 0.07
    assert lean.last_contact < lean.certificate
    assert lean.contacts > 0 or "rotation" not in settings
    assert 0.0 < lean.certificate_reach < marches[0].scene.gap
    assert whole.certificate == -1.0
    assert marches[0].marched < marches[1].marched == lean.steps == 80300
    assert_same_motion(marches, histories, 1e-9)
    if lean.folds == 1:  # the state is the one that the kernel leaves
        for a, b in zip(*map(state_of, marches), strict=True):
            assert np.abs(a - b).max() <= 1e-9 * np.abs(b).max()
    words = [
        result_of(m.case, h).row["regime"]
        for m, h in zip(marches, histories, strict=True)
    ]
    assert words == ["damped", "damped"]


def test_without_load_nothing_is_stepped():
    march = March(resolve(scene(force=0.0, duration=0.5, interval=1e-3)))
    history = march.run()
    assert march.marched == march.beat
    assert len(history.time) == 500
    assert not any(getattr(history, name).any() for name in (*SERIES, "centre"))


@pytest.mark.turns
def test_slices_of_any_size_find_the_same_certificate(monkeypatch):
    found = []
    for size in (256, 37, 10**6):
        even_slices(monkeypatch, size)
        settings = {"nodal_diameter": 2, "gap": 1e-3, "duration": 0.06}
        march = March(resolve(scene(**settings)))
        found.append((march, march.run()))
    for march, history in found[1:]:
        pairs = zip(march.state, found[0][0].state, strict=True)
        assert all(np.array_equal(one, other) for one, other in pairs)
        assert history.ledger == found[0][1].ledger
        assert history.certificate == found[0][1].certificate > 0


def test_a_run_that_asks_for_its_word_alone_ends_as_it_is_proved():
    settings = {"nodal_diameter": 2, "gap": 1e-3, "duration": 2.5, "interval": 2e-4}
    march = March(resolve(scene(**settings, until="certain", traces="summary")))
    history = march.run()
    row = result_of(march.case, history).row
    assert (row["stop"], row["regime"]) == ("certain", "damped")
    assert row["outcome"] == "completed"
    assert history.steps * 1e-6 == pytest.approx(history.certificate)
    assert history.steps < 0.05 * march.total


def test_a_case_that_might_touch_again_runs_to_its_end():
    march = March(resolve(scene(until="certain", traces="summary")))
    history = march.run()
    assert (history.stop, history.steps) == ("end", march.total)
    assert history.certificate == -1.0


@pytest.mark.turns
def test_a_tip_that_might_pass_the_limit_is_not_certified_away():
    settings = {"nodal_diameter": 2, "gap": 1e-3, "duration": 0.08, "interval": 1e-6,
                "force": 2.5e5}  # fmt: skip
    usual = March(resolve(scene(**settings))).run()
    most = 1.02 * np.hypot(usual.tips[..., 0], usual.tips[..., 1]).max()
    near = March(resolve(scene(**settings, amplitude_limit=most / 0.5))).run()
    assert (usual.stop, near.stop) == ("end", "end")
    assert usual.certificate > 0.0  # of the radial ones alone, below the gap
    assert near.certificate == -1.0 or near.certificate > usual.certificate


UNSTABLE = {"engine.casing.damping": 0.005, "speed": 500.0, "friction": 0.3,
            "thickness": 0.012, "nodal_diameter": 2, "time_step": 2e-6,
            "interval": 2e-4, "duration": 0.3}  # fmt: skip


def test_a_symmetry_that_breaks_is_left_to_the_whole_model():
    # in the whole model the shaft leaves its rest out of round-off and whirls
    marches, (lean, whole) = both(**UNSTABLE)
    assert (lean.folds, marches[0].lean.model.blades) == (1, 22)
    assert whole.centre_peak > 1e-6
    assert np.array_equal(lean.centre, whole.centre)
    assert lean.ledger == whole.ledger


def test_model_tells_its_plan(facts):
    plan = facts("model", "--set", "nodal_diameter=2", "--json")["plan"]
    assert plan["folds"] == 2
    assert plan["blades"] == 11
    assert plan["nodal_diameters"] == [0, 2, 4, 6, 8, 10]
    assert plan["centre"] is False
    assert plan["marched"] == {"rotor": 77, "casing": 42}
    assert plan["settles"] is True
    assert len(plan["left_out"]) == 2
    whole = facts(
        "model", "--set", "nodal_diameter=2", "--set", "plan=everything", "--json"
    )["plan"]
    assert whole["marched"] == whole["coordinates"] == {"rotor": 156, "casing": 82}
    assert whole["left_out"] == []


def test_what_is_left_out_is_explained(capsys):
    words = ["run", "--set", "nodal_diameter=2", "--set", "duration=0.2", "--quiet"]
    assert main([*words, "--explain", "--set", "gap=1e-3"]) == 0
    told = capsys.readouterr().out
    assert told.count("left out:") == told.count("  safe:") == 2
    assert "round-off" in told
    assert "of the whole model's amplitudes times steps" in told
    assert main([*words, "--explain", "--set", "plan=everything"]) == 0
    assert "nothing is left out" in capsys.readouterr().out


def test_a_clamped_shaft_has_no_centre():
    clamped = scene(centre="clamped")
    told = facts_of_plan(resolve(clamped))
    assert told["centre"] is False
    assert "the shaft's centre" in [note["left_out"] for note in told["left_out"]]


@pytest.mark.turns
def test_a_campaign_of_regimes_alone(tmp_path, capsys):
    file = tmp_path / "words.toml"
    file.write_text(
        "scene = {nodal_diameter = 2, gap = 1e-3, duration = 1.0}\n"
        "sweep = {speed = [100, 410]}\n"
    )
    words = ["campaign", str(file), "--out", str(tmp_path / "out"), "--json"]
    assert main([*words, "--regimes-only", "--explain"]) == 0
    said = capsys.readouterr()
    assert json.loads(said.out)["failed"] == 0
    assert "2 cases" in said.err
    assert "left out:" in said.err
    from hpcwhirl.store.reading.results_file import Results

    rows = Results(tmp_path / "out").rows
    assert [row["regime"] for row in rows] == ["damped", "damped"]
    assert [row["stop"] for row in rows] == ["certain", "certain"]
    assert [row["folds"] for row in rows] == [2, 2]
    assert max(row["steps"] for row in rows) < 200_000


def test_the_counter_of_looks_is_part_of_the_state():
    march = March(resolve(scene(nodal_diameter=2, gap=1e-3, duration=0.3)))
    assert int(march.counter[contact.NEXT_TRY]) % march.beat == 0
    assert int(march.counter[contact.NEXT_TRY]) * 1e-6 >= 2 * march.scene.pulse


GROWING = {  # rotors of which a wave of k = 1 grows, which one sector of k = 2 has not
    "rotation": "full", "nodal_diameter": 2, "blades": 6, "modes": 12, "gap": 1e-3,
    "casing.harmonics": 4, "duration": 0.2, "time_step": 4e-5,
}  # fmt: skip
FED = {
    "rotating damping": {"suspension_damping": -1.0, "speed": 900.0},
    "cross coupling": {"cross_coupling": 3e7, "speed": 300.0},
    "at some speed only": {
        "suspension_damping": -1.0, "speed": 300.0, "acceleration": 3000.0,
    },
}  # fmt: skip


@pytest.mark.parametrize("until", ["end", "certain"])
@pytest.mark.parametrize("scheme", ["modal", "exact"])
@pytest.mark.parametrize("fed", ["rotating damping", "cross coupling"])
def test_no_sector_stands_for_all_and_none_is_certain_where_a_wave_grows(
    fed, scheme, until
):
    given = GROWING | FED[fed] | {"scheme": scheme, "until": until}
    plans = "lean", "everything"
    cases = [resolve(scene(**given, plan=plan)) for plan in plans]
    assert cases[0].plan.growth > 0.0
    assert (cases[0].plan.folds, cases[0].plan.settles) == (1, False)
    rows = [result_of(case, March(case).run()).row for case in cases]
    assert rows[0]["regime"] == rows[1]["regime"] != "damped"
    assert rows[0]["certificate"] == -1.0
    assert rows[0]["folds"] == 1
    assert rows[0]["free_growth"] == pytest.approx(cases[0].plan.growth)


@pytest.mark.parametrize("fed", FED)
def test_plan_and_texts_follow_from_the_growth_of_all_waves(fed):
    case = resolve(scene(**GROWING | FED[fed]))
    calm = resolve(scene(**GROWING | {"speed": 100.0, "suspension_damping": 0.3}))
    assert (case.plan.folds, calm.plan.folds) == (1, 2)
    told = [note["why"] for note in facts_of_plan(case)["left_out"]]
    assert any("free motion" in why and "grows" in why for why in told)
    assert not any("no contact can recur" in why for why in told)
    assert facts_of_plan(calm)["settles"]
    assert calm.plan.growth == 0.0


def test_a_band_narrower_than_the_knots_of_a_run_is_not_missed():
    own = {"rotation": "full", "blades": 5, "modes": 10, "nodal_diameter": 0}
    model = resolve(scene(**own, speed=300.0)).model
    band = Band(500.0, 500.5, True, 2.0, 500.2, 300.0, 1, "1F")
    found = Stability(Span(0.0, 900.0), 1.0, (band,))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(growth, "stability_of", lambda *_: found)
        for sense in (1.0, -1.0):
            ends = sorted((sense * 100.0, sense * 800.0))
            knots = growth._knots(model, *ends)
            assert {sense * v for v in (500.0, 500.2, 500.5)} <= set(knots)
            assert (knots[0], knots[-1]) == tuple(ends)
