"""Two owners that both believe in their right: who came later is never overwritten.

The first is stopped between a look at its claim and the publishing that follows; the
second takes over, publishes and goes. All in one process, at the system call itself.
"""

from dataclasses import asdict

import pytest
from specimen import begin as specimen
from test_owner import foreign, inputs

from hpcwhirl.analysis.regimes import Thresholds
from hpcwhirl.analysis.rules import words_by_table
from hpcwhirl.campaign import begin as beginning
from hpcwhirl.campaign.begin import Policy, Prepared, prepare
from hpcwhirl.campaign.plan.design import design_of
from hpcwhirl.campaign.run import run_campaign
from hpcwhirl.campaign.stop import Stopping
from hpcwhirl.cli import main
from hpcwhirl.errors import StoreError
from hpcwhirl.store import atomic
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.directory.manifest import PlanFile
from hpcwhirl.store.directory.owner import Asking, Claim, Claims
from hpcwhirl.store.results import gather as gathering
from hpcwhirl.store.results.gather import gather
from hpcwhirl.store.results.relabel import relabel

LOST = "another process has taken over"


def design(*speeds):
    return design_of({"scene": {"duration": 2e-3}, "sweep": {"speed": list(speeds)}})


def taking_over(folder, publishes):
    """Return what another process does at once while this one is stopped."""
    done = []

    def act():
        if not done:
            done.append(True)
            for one in Claims(folder).owners():
                one.path.unlink()
            publishes()

    return act


def around(patch, place, name, act):
    """Let another process act right before a function of this one is done."""
    real = getattr(place, name)

    def stopped(*args, **named):
        act()
        return real(*args, **named)

    patch.setattr(place, name, stopped)


@pytest.mark.parametrize("moment", ["models are built", "the new plan is synced"])
def test_a_longer_plan_of_who_took_over_stays(tmp_path, monkeypatch, moment):
    prepare(design(300), Directory(tmp_path))
    act = taking_over(
        tmp_path, lambda: prepare(design(300, 310, 320), Directory(tmp_path))
    )
    if moment == "models are built":
        around(monkeypatch, beginning, "check_steps", act)
    else:
        around(monkeypatch, atomic.os, "fsync", act)
    with Stopping() as stopping, pytest.raises(StoreError, match=LOST):
        beginning.begin(
            Prepared(design(300, 310), Directory(tmp_path), Policy()), stopping
        )
    assert len(PlanFile(tmp_path).read().settings) == 3
    assert not list(tmp_path.glob("*.part"))


def test_a_directory_of_who_took_over_is_not_put_aside(tmp_path, monkeypatch):
    out = tmp_path / "out"
    prepare(design(300), Directory(out))
    act = taking_over(out, lambda: prepare(design(300, 310, 320), Directory(out)))
    enter = Claim.__enter__

    def stopped(claim):
        own = enter(claim)
        act()
        return own

    monkeypatch.setattr(Claim, "__enter__", stopped)
    prepared = Prepared(design(400), Directory(out), Policy(), fresh=True)
    with Stopping() as stopping, pytest.raises(StoreError, match=LOST):
        beginning.begin(prepared, stopping)
    assert len(PlanFile(out).read().settings) == 3
    assert [p.name for p in tmp_path.iterdir()] == ["out"]


@pytest.mark.turns
@pytest.mark.parametrize("swept", [False, True])
def test_results_of_who_took_over_stay(tmp_path, monkeypatch, swept):
    specimen(tmp_path, one_interval=True)
    gather(Directory(tmp_path), {})

    def publishes():
        (tmp_path / "results.h5").write_text("another's")
        for part in tmp_path.glob("*.part") if swept else ():
            part.unlink()

    act = taking_over(tmp_path, publishes)
    around(monkeypatch, gathering if swept else atomic.os,
           "publish" if swept else "fsync", act)  # fmt: skip
    with pytest.raises(StoreError, match=LOST):
        gather(Directory(tmp_path), {})
    assert (tmp_path / "results.h5").read_text() == "another's"


@pytest.mark.turns
def test_words_of_who_took_over_stay(tmp_path, monkeypatch):
    specimen(tmp_path, one_interval=True)
    path = gather(Directory(tmp_path), {})
    act = taking_over(tmp_path, lambda: path.write_text("another's"))
    around(monkeypatch, atomic.os, "fsync", act)

    def same(numbers):
        return words_by_table(numbers, asdict(Thresholds()))

    with pytest.raises(StoreError, match=LOST):
        relabel(Directory(path.parent), same, {"rise": 7.0})
    assert path.read_text() == "another's"


def test_who_has_lost_its_directory_before_it_computes_says_so(tmp_path):
    with Stopping() as stopping:
        prepared = Prepared(design(300), Directory(tmp_path), Policy())
        own = beginning.begin(prepared, stopping)
        own.path.unlink()
        with pytest.raises(StoreError, match=LOST):
            run_campaign(design(300), Directory(tmp_path), stopping=stopping, own=own)


@pytest.mark.turns
@pytest.mark.parametrize("command", ["campaign", "gather", "classify"])
def test_take_over_reaches_the_claim_of_gathering(
    tmp_path, monkeypatch, capsys, command
):
    """A gatherer on another machine, stopped just now, would cost two minutes."""
    out = tmp_path / "out"
    words = ["campaign", str(inputs(tmp_path)), "--out", str(out)]
    assert main(words) == 0
    foreign(out, "results")
    if command == "campaign":
        (out / "results.h5").unlink()
    else:
        words = [command, str(out)]
    monkeypatch.setattr(Asking, "waited", lambda *_: pytest.fail("it waits"))
    assert main([*words, "--take-over"]) == 0
    assert "taken over from process 1 on node7" in capsys.readouterr().err
    assert not (out / "owners").exists()
