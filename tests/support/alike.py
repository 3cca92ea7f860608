"""Runs of one scene by two ways: alike up to round-off, or the same to the last bit."""

from itertools import cycle

import numpy as np

from hpcwhirl.dynamics.march import March
from hpcwhirl.dynamics.snapshot import fingerprint, restore, snapshot

SERIES = (
    "tips", "centre", "casing", "energy", "impulse", "blade_impulse", "lost", "fed",
)  # fmt: skip


def assert_close(one, other, near, what=""):
    """Assert that arrays differ by a share of their largest value at most."""
    assert one.shape == other.shape, what
    apart = np.abs(one - other).max(initial=0.0)
    assert apart <= near * np.abs(other).max(initial=0.0), what


def assert_alike(one, other, near=1e-8):
    """Assert that two histories are those of one motion with contact.

    The centre's difference is relative to the tips' motion: in symmetry it rests.
    """
    assert one.contacts == other.contacts > 0
    for name in SERIES:
        a, b = getattr(one, name), getattr(other, name)
        assert a.shape == b.shape, name
        size = np.abs(other.tips if name == "centre" else b).max(initial=0.0)
        assert np.abs(a - b).max(initial=0.0) <= near * size, name


def assert_mirrored(one, other, near=1e-7):
    """Assert that a history is the other one in a mirror, which swaps blades, too."""
    assert one.contacts == other.contacts > 0
    assert (
        abs(one.contact_impulse - other.contact_impulse) <= near * one.contact_impulse
    )
    mirror = -np.arange(one.blade_impulse.shape[1])
    size = np.abs(one.tips if one.tips.size else one.centre).max()
    assert np.abs(one.centre * [1.0, -1.0] - other.centre).max() <= near * size
    swapped = one.tips[:, mirror] * [1.0, -1.0]
    assert np.abs(swapped - other.tips).max(initial=0.0) <= near * size
    pushed = np.abs(one.blade_impulse[:, mirror] - other.blade_impulse)
    assert pushed.max(initial=0.0) <= near * one.contact_impulse


def assert_bodies_alike(one, other, near=1e-8):
    """Assert that the bodies of two marches are in the same places."""
    for a, b in zip(one.displacements(), other.displacements(), strict=True):
        assert_close(a, b, near)


def assert_rest_as_marched(one, other, near=1e-10, late=1e-9):
    """Assert that a march with a certificate ended as one that was marched throughout.

    late : of the last rows, relative to their own size
    """
    history, whole = one.history(), other.history()
    assert whole.certificate < 0.0 < history.last_contact < history.certificate
    assert history.last_contact == whole.last_contact
    assert_bodies_alike(one, other, late)
    assert_alike(history, whole, near)
    for name in SERIES:
        assert_close(getattr(history, name)[-50:], getattr(whole, name)[-50:], late)
    for name, value in history.ledger.items():
        if name != "residual":
            assert abs(value - whole.ledger[name]) <= 1e-9 * abs(value), name
    for a, b in zip(one.state[:2], other.state[:2], strict=True):
        assert_close(a, b, late)


def assert_same_bits(one, other):
    """Assert that two marches have the same state, tracks and numbers."""
    here, there = snapshot(one), snapshot(other)
    assert here.keys() == there.keys()
    for name, array in here.items():
        if name != "seconds":
            assert array.shape == there[name].shape, name
            assert array.tobytes() == there[name].tobytes(), name


def in_parts(case, sizes, *, anew=False):
    """Yield the march of a case after each of its slices, of these sizes in turn.

    anew : whether each slice is marched by another march, from the state of the last
    """
    march = March(case)
    for size in cycle(sizes):
        march.advance(size)
        yield march
        if march.done:
            return
        if anew:
            kept = {name: np.copy(array) for name, array in snapshot(march).items()}
            last, march = march, March(case)
            assert fingerprint(march) == fingerprint(last)
            assert restore(march, kept)


def assert_same_in_parts(case, *sizes, anew=False):
    """Assert that slices change no bit of a case; return its march in one piece."""
    whole = March(case)
    whole.advance(whole.total)
    *_, last = in_parts(case, sizes, anew=anew)
    assert_same_bits(last, whole)
    return whole
