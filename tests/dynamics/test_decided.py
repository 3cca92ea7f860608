"""A case that goes on until it is decided: the bits of a run that was as long."""

import numpy as np
import pytest
from deaths import even_slices, stopped_again_and_again

from hpcwhirl.campaign.compute import Checkpoints, compute
from hpcwhirl.campaign.simulate import simulate
from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.march import March
from hpcwhirl.dynamics.snapshot import fingerprint, restore, snapshot
from hpcwhirl.scene import apply_settings, named_scene
from hpcwhirl.scene.quantities import BLADES
from hpcwhirl.store.directory.states import States

LASTING = {"until": "decided", "longest": 1.3}


def scene(**settings):
    fast = {"duration": 0.1, "interval": 1e-3, "time_step": 2e-6}
    return apply_settings(named_scene("mostly_damped"), fast | settings)


def assert_same(one, other):
    assert one.row == other.row
    assert one.traces.keys() == other.traces.keys()
    for name, trace in one.traces.items():
        assert trace.tobytes() == other.traces[name].tobytes()


# Settings of cases that are undecided at first, and when they are decided. Of 1 ms the
# pulse is in the window, and evidence is as dense as the run is short; of `ring` a
# certificate is looked for at 0.4 s and not before.
CASES = {
    "modal": ({}, 0.8),
    "exact": ({"scheme": "exact"}, 0.8),
    "longest": ({"speed": 400.0, "longest": 0.35}, 0.35),
    "full": ({"traces": "full", "interval": 1e-2, "speed": 330.0}, 0.4),
    "revolutions": ({"revolutions": 5.0, "speed": 330.0}, None),
    "folded": ({"nodal_diameter": 2, "duration": 1e-3, "longest": 0.05}, None),
    "general": ({"scheme": "general", "duration": 1e-3, "longest": 4e-3}, None),
    "rigid": ({"kind": "rigid", "amplitude": 2e-4, "longest": 0.3}, None),
}


@pytest.mark.turns
@pytest.mark.parametrize("name", CASES)
def test_a_case_decided_late_is_one_that_was_asked_for_that_long(name):
    settings, end = CASES[name]
    given = scene(**LASTING | settings)
    found = simulate(given)
    lasted = found.row["duration"]
    assert lasted == (end or lasted)
    assert lasted in given.end_times[1:]
    asked = {"until": "end", "revolutions": 0.0, "duration": lasted}
    assert_same(found, simulate(apply_settings(given, asked)))
    assert found.row["window"] == pytest.approx(0.4 * lasted, rel=1e-4)
    for earlier in given.end_times[: given.end_times.index(lasted)]:
        before = simulate(apply_settings(given, asked | {"duration": earlier}))
        assert before.row["regime"] == "undecided"
    last = lasted == given.end_times[-1]
    assert last or found.row["regime"] != "undecided"


@pytest.mark.turns
def test_steps_are_not_marched_twice(monkeypatch, steps_of):
    for settings in ({}, {"scheme": "exact"}):
        made = steps_of()
        row = simulate(scene(**LASTING, **settings)).row
        assert row["duration"] == 0.8
        # from the last row of evidence on: no more than a row, three times
        assert row["steps"] <= sum(made) < row["steps"] + 3 * 200
        monkeypatch.undo()


@pytest.mark.parametrize("scheme", ["modal", "exact"])
def test_a_longer_march_passes_the_last_row_but_not_the_end(scheme):
    """Where a run of scheme exact ends, it ends a jump that would have gone on."""
    short, long = (
        March(resolve(scene(scheme=scheme, speed=330.0, duration=duration)))
        for duration in (0.1001, 0.12)
    )
    assert fingerprint(short) == fingerprint(long)
    assert short.last_row < short.total
    short.reach(short.last_row)
    passed = snapshot(short)
    short.reach(short.total)
    assert not restore(long, snapshot(short))
    assert restore(long, passed)
    long.reach(long.total)
    whole = March(long.case)
    whole.reach(whole.total)
    for a, b in zip(long.state + long.tracks, whole.state + whole.tracks, strict=True):
        assert a.tobytes() == b.tobytes()


@pytest.mark.turns
def test_a_run_that_is_marched_otherwise_begins_anew(steps_of):
    """A longer run looks for a certificate where a shorter one had no time for it."""
    drawn = {"speed": 400.0, "gap": 2e-4, "longest": 2.0, "time_step": 4e-6}
    begun = resolve(scene(**drawn)).plan.settling / 0.7 / 1.3
    given = scene(**LASTING | drawn | {"duration": begun, "traces": "summary"})
    short, long = (
        simulate(apply_settings(given, {"until": "end", "duration": d})).row
        for d in given.end_times[:2]
    )
    assert short["regime"] == "undecided"
    assert 0.0 < long["certificate"] < begun
    made = steps_of()
    assert simulate(given).row == long
    assert sum(made) >= short["steps"] + round(long["certificate"] / 4e-6)


@pytest.mark.slow
@pytest.mark.parametrize("settings", [{}, {"scheme": "exact", "rotation": "full"}])
def test_a_case_stopped_again_and_again_has_the_same_bits(
    settings, tmp_path, monkeypatch
):
    even_slices(monkeypatch)
    case = resolve(scene(**LASTING | settings))
    whole = compute(case, "d", Checkpoints(States(tmp_path), 1e9, print), 1e9, int)
    result, stops = stopped_again_and_again(case, tmp_path, 12)
    assert stops > 2
    assert_same(result, whole)


@pytest.mark.turns
def test_words_do_not_depend_on_what_is_kept():
    kept = ({"traces": "summary"}, {"traces": "full", "interval": 7e-3}, {})
    rows = [simulate(scene(**LASTING, speed=430.0, **each)).row for each in kept]
    for row in rows:
        for name in ("sample_interval", *BLADES):  # of what is kept
            row.pop(name, None)
    assert rows[0] == rows[1] == rows[2]


def test_a_run_that_ended_early_does_not_begin_again():
    """Beyond the amplitude limit there is nothing more to come."""
    limit = {"amplitude_limit": 1e-9, "friction": 0.0, "duration": 1e-3}
    row = simulate(scene(**LASTING | limit)).row
    assert row["stop"] == "amplitude"
    assert row["duration"] == 1e-3


def test_a_word_is_asked_for_on_evidence_that_no_earlier_one_had():
    ends = np.array(scene(**LASTING | {"longest": 100.0}).end_times)
    assert (0.6 * ends[1:-1] >= ends[:-2]).all()
    assert ends[-1] == 100.0


def test_a_longest_time_does_not_matter_to_a_run_to_its_end():
    assert scene(longest=0.05).end_times == (0.1,)
