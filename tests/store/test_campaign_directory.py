"""A campaign's directory sweeps and renames all that belongs to it."""

import os

import numpy as np
import pytest
from journals import plan_of
from specimen import begin

from hpcwhirl.errors import InputError, MissingFileError
from hpcwhirl.store.atomic import part_of
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.directory.manifest import PlanFile


def test_what_is_half_written_is_removed_once_it_is_old(tmp_path):
    directory = Directory(tmp_path)
    whole = [directory.states.place / "a.state", directory.runs.place / "0001.json"]
    whole.append(directory.plan.path)
    for path in whole:
        path.parent.mkdir(exist_ok=True)
        path.touch()
    halves = [part_of(path) for path in whole]
    for half in halves:
        os.utime(half, (100.0, 100.0))
    directory.sweep(100.0)
    assert all(half.exists() for half in halves)
    directory.sweep(101.0)
    assert not any(half.exists() for half in halves)
    assert all(path.exists() for path in whole)


@pytest.mark.parametrize("write", [
    lambda directory: directory.states.write("a" * 64, {}, {"x": np.ones(3)}),
    lambda directory: directory.runs.write(1, []),
])  # fmt: skip
def test_a_directory_that_was_moved_is_not_made_again(tmp_path, write):
    directory = Directory(tmp_path / "out")
    with pytest.raises(MissingFileError, match=r"cannot write .*: No such file"):
        write(directory)
    assert not directory.path.exists()
    directory.path.mkdir()
    write(directory)
    assert any(directory.path.glob("*/*"))


def test_a_directory_put_aside_is_the_same_campaign_elsewhere(tmp_path):
    directory = Directory(tmp_path / "out")
    assert directory.put_aside() is None
    begin(directory.path, one_interval=True)
    plan, records = directory.plan.read(), directory.journals.newest()
    aside = directory.put_aside()
    assert aside.path == tmp_path / "out.1"
    assert not directory.path.exists()
    assert (aside.plan.read(), aside.journals.newest()) == (plan, records)


def test_another_sweep_is_refused_in_the_words_of_the_page_of_questions(tmp_path):
    plan = plan_of({}, ["speed"], [{"speed": 1.0}])
    other = plan_of({}, ["gap"], [{"gap": 1.0}])
    told = (
        r"was begun with a sweep over speed; this campaign's is over gap: use another"
    )
    with pytest.raises(InputError, match=told):
        PlanFile(tmp_path).check_same(plan, other)
