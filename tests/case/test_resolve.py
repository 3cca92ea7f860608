"""A case is resolved once, stays what it is, and shares its model with its like."""

import gc
import weakref
from dataclasses import FrozenInstanceError

import numpy as np
import pytest

from hpcwhirl.campaign.begin import prepare
from hpcwhirl.campaign.plan.design import MOST_KEPT, design_of, load_design
from hpcwhirl.campaign.run import run_campaign
from hpcwhirl.case.resolve import Case, resolve
from hpcwhirl.cli import main
from hpcwhirl.dynamics.march import March
from hpcwhirl.errors import InputError
from hpcwhirl.reduction import model as models
from hpcwhirl.scene import apply_settings, digest, named_scene
from hpcwhirl.store.directory.campaign_directory import Directory

PARTS = ("given", "own", "reduced", "model", "step", "scene", "plan", "lean", "cost")
ASKED = {"accuracy": 1e-2, "truncation": 0.3}
SMALL = {"blades": 6, "nodal_diameter": 2}


def scene(**settings):
    return apply_settings(named_scene("table2"), settings)


def built():
    """Return how many models this process has built so far."""
    return models._model.cache_info().misses


@pytest.mark.parametrize("part", PARTS)
def test_no_part_of_a_case_can_be_set(part):
    case = resolve(scene(**ASKED))
    before = getattr(case, part)
    with pytest.raises(FrozenInstanceError):
        setattr(case, part, None)
    assert getattr(case, part) is before or part == "cost"


def test_a_case_has_the_inputs_that_its_errors_ask_for():
    case = resolve(scene(**ASKED))
    solver, given = case.scene.solver, case.given.solver
    assert solver.time_step == case.step > given.time_step
    assert (solver.modes, given.modes) == (66, 110)
    assert len(case.model.rotor.omega) == 66 + 46
    assert case.steps == pytest.approx(case.scene.end_time / solver.time_step)
    plain = resolve(scene())
    assert plain.scene is plain.given


def test_a_case_is_known_by_its_scene_as_given():
    text = {"solver": dict(ASKED), "sweep": {"speed": [300, 400]}}
    design = design_of(text)
    for number in range(2):
        case = design.resolved(number)
        assert design.digest(number) == digest(case.given) != digest(case.scene)


def test_what_a_case_will_cost_needs_no_model_where_its_step_is_given():
    gaps = [1e-4 + 1e-7 * i for i in range(20)]
    before = built()
    costs = [resolve(scene(gap=gap, truncation=0.3)).cost for gap in gaps]
    assert built() == before
    assert costs[0] > 0.0
    assert resolve(scene(accuracy=1e-2)).cost < resolve(scene(accuracy=1e-4)).cost


def test_a_step_beyond_its_limit_hides_no_modes_and_is_not_marched():
    case = resolve(scene(time_step=1e-3))
    assert len(case.model.rotor.omega) > 0
    assert case.plan.folds == 1
    with pytest.raises(InputError, match="time_step must be <"):
        March(case)


def test_a_model_is_built_once_for_all_cases_of_an_engine_and_a_reduction():
    before, own = built(), scene(modes=11, **{"casing.harmonics": 7})
    alike = [{}, {"speed": 100.0}, {"friction": 0.3}, {"scheme": "paper"}]
    one, *others = (resolve(apply_settings(own, more)).model for more in alike)
    assert built() == before + 1
    assert all(other is one for other in others)
    wider = resolve(apply_settings(own, {"gap": 1.1e-3})).model
    assert built() == before + 2
    assert wider.rotor is one.rotor  # the gap is the ring's
    assert wider.casing is not one.casing
    rigid = [apply_settings(own, {"kind": "rigid", "gap": g}) for g in (1e-3, 2e-3)]
    assert len({id(resolve(given).model) for given in rigid}) == 1


def test_a_sector_is_built_once_for_all_cases_that_fold_alike():
    one, other = (resolve(scene(nodal_diameter=2, speed=v)) for v in (300.0, 310.0))
    assert one.lean.model is other.lean.model
    assert one.lean.model.folds == 2
    assert one.whole.model.folds == 1
    assert one.lean.scene.speed == 2 * one.scene.speed


@pytest.mark.turns
def test_models_that_nobody_asks_for_any_more_are_dropped():
    first = weakref.ref(resolve(scene(kind="rigid", modes=1)).model)
    assert first() is not None
    for modes in range(2, 2 + models.MOST_KEPT):
        assert resolve(scene(kind="rigid", modes=modes)).model is not first()
    gc.collect()
    assert first() is None


@pytest.mark.turns
def test_another_content_of_an_engines_file_is_another_model(tmp_path):
    path = tmp_path / "engine.h5"

    def exported(damping):
        words = [f"{n}={v}" for n, v in SMALL.items()] + [f"rotor.damping={damping}"]
        sets = [word for one in words for word in ("--set", one)]
        assert main(["export-model", str(path), *sets]) == 0
        given = scene(file=str(path), **SMALL)
        return resolve(given).model, path.read_bytes()

    (one, content), (other, _) = exported(0.01), exported(0.02)
    assert not np.array_equal(one.rotor.ratios, other.rotor.ratios)
    path.write_bytes(content)
    assert resolve(scene(file=str(path), **SMALL)).model is one


def test_a_case_may_bring_its_own_model():
    own = resolve(scene(modes=11)).model
    assert Case(scene(), own).model is own
    assert len(March(Case(scene(), own)).displacements()[0]) == len(own.rotor.shapes)


@pytest.mark.turns
def test_a_campaign_resolves_each_of_its_cases_once(tmp_path, monkeypatch):
    told = []
    once = "hpcwhirl.case.resolve.resolve"
    monkeypatch.setattr(once, lambda s: told.append(s) or resolve(s))
    (tmp_path / "c.toml").write_text(
        '[scene]\nduration = 4e-3\n[solver]\naccuracy = 1e-2\nplan = "everything"\n'
        "[sweep]\nspeed = [300, 340, 380, 420, 460, 500]\n"
    )
    design, folder = load_design(tmp_path / "c.toml", {}), tmp_path / "out"
    before = built()
    prepare(design, Directory(folder))
    assert run_campaign(design, Directory(folder)).complete
    assert [s.speed for s in told] == [300, 340, 380, 420, 460, 500]
    assert built() <= before + 1


@pytest.mark.turns
def test_the_cases_kept_are_few_and_none_of_an_engines_file(tmp_path):
    speeds = [float(v) for v in range(MOST_KEPT + 1)]
    design = design_of({"sweep": {"speed": speeds}})
    first = weakref.ref(design.resolved(0))
    assert design.resolved(0) is first()
    last = [design.resolved(number) for number in range(1, len(speeds))][-1]
    assert design.resolved(MOST_KEPT) is last
    gc.collect()
    assert first() is None
    path = tmp_path / "engine.h5"
    assert main(["export-model", str(path)]) == 0
    foreign = design_of({"engine": {"file": str(path)}, "sweep": {"speed": [1.0, 2.0]}})
    assert foreign.resolved(0) is not foreign.resolved(0)
