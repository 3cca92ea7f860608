"""Processes and cases that end after some slices of a march, again and again."""

from hpcwhirl.campaign.compute import Checkpoints, compute
from hpcwhirl.campaign.stop import Stop
from hpcwhirl.dynamics import march as marching
from hpcwhirl.store.directory.states import States

SLICE = 512  # steps
MOST = 400


class Death(BaseException):
    """What no code catches."""


def even_slices(patch, steps=SLICE):
    """Let all slices have as many steps, however fast the machine is."""
    patch.setattr(marching, "FIRST_SLICE", steps)
    patch.setattr(marching, "_slices", {})
    patch.setattr(marching, "next_slice", lambda *_: steps)


def until_it_lives(monkeypatch, slices, attempt):
    """Return what a function returns at last, and how often it died before.

    slices : of a march that an attempt lives to make
    """
    advance, deaths = marching.March.advance, 0
    while True:
        left = [slices]

        def counted(march, steps, left=left):
            left[0] -= 1
            if left[0] < 0:
                raise Death
            advance(march, steps)

        with monkeypatch.context() as patch:
            patch.setattr(marching.March, "advance", counted)
            even_slices(patch)
            try:
                return attempt(), deaths
            except Death:
                deaths += 1
                assert deaths < MOST


def stopped_again_and_again(case, folder, slices):
    """Return the result of a case that is stopped after some slices, and how often."""
    for stops in range(MOST):
        calls, told = [], []

        def between(calls=calls):
            calls.append(1)
            if len(calls) > slices:
                raise Stop

        checkpoints = Checkpoints(States(folder), 1e9, told.append)
        try:
            return compute(case, "d", checkpoints, 1e9, between), stops
        except Stop:
            assert States(folder).names() == {"d"}
        assert told == []
    raise AssertionError
