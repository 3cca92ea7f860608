"""A case cut anywhere and taken up again has the same bits."""

import os

import numpy as np
import pytest
from alike import assert_same_bits
from deaths import even_slices, stopped_again_and_again

from hpcwhirl.campaign.compute import Checkpoints, LateError, compute
from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.march import March
from hpcwhirl.dynamics.snapshot import fingerprint, restore, snapshot
from hpcwhirl.errors import StoreError
from hpcwhirl.scene import apply_settings, named_scene
from hpcwhirl.store.directory.heartbeats import Notes, Running
from hpcwhirl.store.directory.states import States

SCHEMES = {
    "modal": {},
    "exact": {"scheme": "exact"},
    "general": {"scheme": "general"},
    "elements": {"discretization": "elements"},
    "rigid": {"kind": "rigid", "amplitude": 2e-4},
    "mistuned": {"mistuning": [0.01 * (-1) ** j * j for j in range(22)]},
    "paper": {"scheme": "paper", "duration": 1.2e-3},
    "folded": {"nodal_diameter": 2},
    "turning": {"rotation": "full"},
    "turning, exact": {"rotation": "full", "scheme": "exact"},
    "unbalanced": {"rotation": "full", "scheme": "exact", "unbalance": 2e-3},
    "unbalanced bodies": {"rotation": "full", "scheme": "general", "unbalance": 2e-3},
    "with a start": {"start_energy": 2.0, "start_as": "velocities"},
}
FITS = {"machine": "this"}


def scene(**settings):
    fast = {"duration": 3e-3, "interval": 1e-5, "traces": "full", "time_step": 2e-6}
    return apply_settings(named_scene("mostly_damped"), fast | settings)


def ended(march):
    march.advance(10**9)
    return march


@pytest.mark.turns
@pytest.mark.parametrize("name", SCHEMES)
def test_a_state_through_a_file_continues_to_the_same_bits(name, tmp_path):
    case = resolve(scene(**SCHEMES[name]))
    whole = ended(March(case))
    assert whole.history().contacts > 0
    march = March(case)
    for steps in (1, 88, 301):  # from one cut to the next, each in a new march
        march.advance(steps)
        kept = fingerprint(march)
        States(tmp_path).write("d", FITS, snapshot(march))
        march = March(case)
        assert fingerprint(march) == kept
        assert restore(march, States(tmp_path).read("d", FITS))
    assert march.steps == 390
    assert_same_bits(ended(march), whole)


def test_a_case_that_left_its_symmetry_goes_on_with_all_sectors(tmp_path):
    case, told = resolve(scene(nodal_diameter=2)), []
    march = March(case)
    march.unfold()  # as after many touchdowns
    march.advance(400)
    Checkpoints(States(tmp_path), 600.0, told.append).save("d", march)
    other = March(case)
    assert other.lean.model.folds == 2
    Checkpoints(States(tmp_path), 600.0, told.append).take_up("d", other)
    assert other.steps == 400
    assert_same_bits(ended(other), ended(march))
    assert not told


def test_a_state_of_another_case_kernel_or_shape_does_not_fit():
    march = March(resolve(scene()))
    march.advance(300)
    others = {"speed": 411.0}, {"time_step": 1e-6}, {"blades": 21}, {"thickness": 0.02}
    for settings in others:
        assert fingerprint(March(resolve(scene(**settings)))) != fingerprint(march)
    fresh, kept = March(resolve(scene(traces="orbit"))), snapshot(march)
    assert not restore(fresh, kept)
    assert fresh.steps == 0
    assert not restore(March(resolve(scene(blades=21))), kept)
    assert not restore(March(resolve(scene(interval=1e-3))), kept)
    others = {n: a for n, a in kept.items() if n != "tracks.impulse"}
    assert not restore(March(resolve(scene())), others)


def test_a_damaged_state_is_never_taken(tmp_path):
    march = March(resolve(scene(traces="orbit", interval=1e-4)))
    march.advance(500)
    States(tmp_path).write("d", FITS, snapshot(march))
    path = tmp_path / "states/d.state"
    whole = path.read_bytes()
    assert States(tmp_path).read("d", FITS).keys() == snapshot(march).keys()
    assert States(tmp_path).read("e", FITS) is None
    for end in range(0, len(whole), 499):
        path.write_bytes(whole[:end])
        with pytest.raises(StoreError, match="damaged"):
            States(tmp_path).read("d", FITS)
    for place in range(0, len(whole), 499):
        spoilt = whole[:place] + bytes([whole[place] ^ 4]) + whole[place + 1 :]
        path.write_bytes(spoilt)
        with pytest.raises(StoreError, match="damaged"):
            States(tmp_path).read("d", FITS)
    path.write_bytes(whole)
    with pytest.raises(StoreError, match="another machine"):
        States(tmp_path).read("d", {"machine": "other"})
    path.rename(tmp_path / "states/e.state")
    with pytest.raises(StoreError, match="another digest"):
        States(tmp_path).read("e", FITS)
    States(tmp_path).drop("e")
    States(tmp_path).drop("e")
    assert States(tmp_path).names() == set()


@pytest.mark.turns
def test_no_step_of_a_stopped_case_is_computed_twice(tmp_path, steps_of, monkeypatch):
    even_slices(monkeypatch)
    case = resolve(scene(duration=0.05, interval=1e-4))
    whole = compute(
        case, "d", Checkpoints(States(tmp_path), 1e9, print), 1e9, lambda: None
    )
    made = steps_of()
    result, stops = stopped_again_and_again(case, tmp_path, 2)
    assert stops > 3
    assert sum(made) == whole.row["steps"] == 25000
    assert result.row == whole.row
    for name, trace in whole.traces.items():
        assert result.traces[name].tobytes() == trace.tobytes()


def test_a_damaged_state_costs_a_line_and_the_case_begins_anew(tmp_path, steps_of):
    case, told = resolve(scene()), []
    march = March(case)
    march.advance(700)
    Checkpoints(States(tmp_path), 1e9, told.append).save("d", march)
    path = tmp_path / "states/d.state"
    path.write_bytes(path.read_bytes()[:-1])
    made = steps_of()
    checkpoints = Checkpoints(States(tmp_path), 1e9, told.append)
    compute(case, "d", checkpoints, 1e9, lambda: None)
    (line,) = told
    assert "it is damaged: the case starts anew" in line
    assert sum(made) == 1500
    assert States(tmp_path).names() == set()


def test_states_that_cannot_be_written_are_told_once(tmp_path):
    told: list[str] = []
    checkpoints, march = (
        Checkpoints(States(tmp_path), 1e9, told.append),
        March(resolve(scene())),
    )
    march.advance(10)
    (tmp_path / "states").touch()  # a file where the directory belongs
    for name in ("d", "e"):
        checkpoints.save(name, march)
    (line,) = told
    assert "if the run stops now, this case starts anew" in line


def test_a_state_is_kept_now_and_then_by_the_case_s_own_clock(tmp_path, monkeypatch):
    saved, save = [], Checkpoints.save
    monkeypatch.setattr(
        Checkpoints, "save", lambda *of: (saved.append(of[2].seconds), save(*of))
    )
    checkpoints = Checkpoints(States(tmp_path), 0.02, print)
    case = resolve(scene(duration=0.2, interval=1e-3))
    compute(case, "d", checkpoints, 1e9, lambda: None)
    assert saved
    assert np.diff([0.0, *saved]).min() >= 0.02


def test_a_case_beyond_its_limit_goes_on_with_a_greater_one(tmp_path, steps_of):
    case = resolve(scene(duration=0.2, interval=1e-3))
    checkpoints = Checkpoints(States(tmp_path), 1e9, print)
    with pytest.raises(LateError, match=r"more than 0\.01 s of computing"):
        compute(case, "d", checkpoints, 0.01, lambda: None)
    assert States(tmp_path).names() == {"d"}
    made = steps_of()
    result = compute(
        case, "d", Checkpoints(States(tmp_path), 1e9, print), 1e9, lambda: None
    )
    assert 0 < sum(made) < 100_000 == result.row["steps"]
    assert result.performance["seconds"] > 0.01


def test_only_a_process_that_dies_leaves_word_of_what_it_computed(tmp_path):
    with Running(Notes(tmp_path), 1, 0) as running:
        running.begin(["a", "b" * 64, "c"])
        assert Notes(tmp_path).crashes() == {"a": 1, "b" * 64: 1, "c": 1}
        running.begin(["d"])
        assert Notes(tmp_path).crashes() == {"d": 1}
    assert not Notes(tmp_path).crashes()
    for run in (2, 3):  # in processes that die, and take nothing back
        died = os.fork()
        if died == 0:
            Running(Notes(tmp_path), run, 1).__enter__().begin(["e", "f"])
            os._exit(0)
        os.waitpid(died, 0)
    (tmp_path / "running/0004-00000.log").write_bytes(b"")
    assert Notes(tmp_path).crashes() == {"e": 2, "f": 2}
    Notes(tmp_path).forget({"e"})
    assert Notes(tmp_path).crashes() == {"e": 2, "f": 2}
    Notes(tmp_path).forget({"e", "f"})
    assert not Notes(tmp_path).crashes()
