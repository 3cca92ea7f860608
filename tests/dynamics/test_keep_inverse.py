"""Contact of many blades: complementarity, and the inverse that is kept."""

import numpy as np
import pytest
from alike import assert_same_bits, in_parts
from solving import place_of
from solving import solve as solve_row

from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.kernels import keep_inverse as keep
from hpcwhirl.dynamics.kernels.compiled import kernel
from hpcwhirl.dynamics.kernels.loop import circulant, whole
from hpcwhirl.dynamics.kernels.loop.circulant import folded
from hpcwhirl.dynamics.kernels.vectors import widths
from hpcwhirl.dynamics.march import March
from hpcwhirl.dynamics.waves.slots import transforms
from hpcwhirl.scene import Scene, apply_settings

pytestmark = pytest.mark.turns

read_all, open_whole = (  # parts, for Python
    kernel(part.py_func) for part in (whole.read_all, whole.open_whole)
)


@kernel
def turn_or_recall(active, blades, wide, space, turns):
    """Change the kept inverse to that of some blades; or compute it from its list."""
    if turns:
        keep.turn_to(active, space.where, blades, wide, space)
    else:
        keep.recall(blades, wide, space)


@kernel
def solve_bounded(  # noqa: PLR0917
    rows, q, others, tips, opened, lowest, blades, wide, space
):
    """Return the number of active blades, where tips are bounds until computed."""
    active = circulant.guess(opened, 0, lowest, blades, wide, space)
    if active < 0:
        whole.read_all(rows, q, blades, tips)
        lowest = whole.open_whole(tips, others, 0, opened)
        active = circulant.solved(opened, 0, lowest, blades, wide, space)
    return active


def drawn_column(blades, drawn, least):
    """Return column 0 of a circulant W, not symmetric; least : of its symbol."""
    size = np.abs(drawn.normal(size=blades // 2 + 1))
    symbol = least + size + 0.3j * drawn.normal(size=blades // 2 + 1)
    symbol[[0, -1]] = symbol[[0, -1]].real
    return np.fft.irfft(symbol, blades)


def drawn_matrix(blades, drawn):
    """Return a W of unequal sectors, not symmetric."""
    root, skew = drawn.normal(size=(2, blades, blades))
    w = root @ root.T / blades + 0.1 * (skew - skew.T) / blades**0.5
    return w + np.eye(blades)


def space_of(w):
    blades = len(w)
    known = np.zeros(keep.length_of_known(blades), np.int64)
    return circulant.constant_space(blades, widths(blades)[1], w, known)


def solve(gaps, space):
    """Return multipliers, corrected gaps, and by which way they were found."""
    blades, wide = len(gaps), widths(len(gaps))[1]
    row = gaps[folded(blades, wide)]
    active, way = solve_row(row, gaps.min(), blades, wide, space, False)
    lam = np.zeros(blades)
    lam[space.where[:active]] = space.push[:active]
    return lam, row[[place_of(j, blades, wide) for j in range(blades)]], way


def slowly(gaps, drawn, steps):
    """Yield gaps that change little from one to the next, here and there a lot."""
    for step in range(steps):
        gaps = gaps + 0.03 * drawn.normal(size=len(gaps))
        if step % 40 == 39:
            gaps = drawn.normal(size=len(gaps)) - 1.5 * drawn.random()
        yield gaps


@pytest.mark.parametrize(
    ("blades", "least"), [(25, 1e-7), (60, None), (88, 1.0), (176, 1e-7), (176, None)]
)
def test_complementarity_of_many_blades_that_come_and_go(blades, least):
    # of W well and badly conditioned, circulant, and of unequal sectors
    drawn, ways = np.random.default_rng(blades), [0, 0, 0]
    if least is None:
        w = drawn_matrix(blades, drawn)
        space, most = space_of(w), 0
    else:
        apart = np.subtract.outer(np.arange(blades), np.arange(blades)) % blades
        column = drawn_column(blades, drawn, least)
        w, known = column[apart], np.zeros(keep.length_of_known(blades), np.int64)
        wide, wave = widths(blades)[1], transforms(blades)[1]
        space = circulant.circulant_space(blades, wide, column, known, wave)
        most = 0
    for gaps in slowly(drawn.normal(size=blades) - 0.5, drawn, 160):
        lam, opened, way = solve(gaps, space)
        after, size = gaps + w @ lam, np.abs(lam).max() * np.abs(w).sum(axis=1).max()
        ways[way] += 1
        most = max(most, int((lam > 0.0).sum()))
        assert lam.min() >= 0.0
        assert after.min() > -1e-11 * size
        assert np.abs(lam * after).max() <= 1e-11 * size * np.abs(lam).max()
        assert opened == pytest.approx(
            np.where(lam > 0.0, 0.0, after), abs=1e-11 * size
        )
    assert ways[1] > 20
    assert most > blades // 2


def test_all_blades_that_touch_carry_what_the_inverse_says():
    drawn = np.random.default_rng(1)
    apart = np.subtract.outer(np.arange(176), np.arange(176)) % 176
    w = np.eye(176) + 0.1 * drawn_column(176, drawn, 1.0)[apart]
    space = space_of(w)
    for _ in range(3):
        gaps = -1.0 - 0.1 * drawn.random(176)
        lam, opened, _ = solve(gaps, space)
        assert lam == pytest.approx(np.linalg.solve(w, -gaps), rel=1e-11)
        assert not opened.any()


def test_a_kept_inverse_is_that_of_its_blades_and_is_found_again():
    # by the changes since blades were inverted, to the bit
    blades, drawn = 40, np.random.default_rng(4)
    wide, w = widths(blades)[1], drawn_matrix(blades, drawn)
    space, other = space_of(w), space_of(w)
    padded, changed = len(space.push), 0
    active = (drawn.random(blades) < 0.5).astype(np.int64)
    for _ in range(200):
        flips = drawn.choice(blades, size=drawn.integers(1, 4), replace=False)
        active[flips] = 1 - active[flips]
        turn_or_recall(active.copy(), blades, wide, space, True)
        size = space.known[blades + keep.SIZE]
        changed += space.known[blades + keep.CHANGED] > 0
        own = space.known[:size]
        assert sorted(own) == list(np.flatnonzero(active))
        found = space.inverse.reshape(padded, padded)[:size, :size]
        assert found.T @ w[np.ix_(own, own)] == pytest.approx(np.eye(size), abs=1e-11)
        other.known[:] = space.known
        turn_or_recall(active, blades, wide, other, False)
        assert np.array_equal(other.known, space.known)
        again = other.inverse.reshape(padded, padded)[:size, :size]
        assert again.tobytes() == found.tobytes()
    assert changed > 100


def test_blades_whose_w_is_singular_make_the_inverse_unsound():
    drawn = np.random.default_rng(5)
    root = drawn.normal(size=(30, 12))
    w, wide = root @ root.T, widths(30)[1]  # of rank 12
    space, active = space_of(w), np.zeros(30, np.int64)
    active[:10] = 1
    turn_or_recall(active.copy(), 30, wide, space, True)
    assert space.known[30 + keep.SOUND] == 1
    for j in range(10, 14):
        active[j] = 1
        turn_or_recall(active.copy(), 30, wide, space, True)
        assert space.known[30 + keep.SOUND] == (j < 12)


def test_slices_and_snapshots_of_many_contacts_give_the_same_bits():
    given = {
        "blades": 88, "scheme": "modal", "duration": 4e-3, "gap": 2e-5, "speed": 420.0,
        "friction": 0.1, "plan": "everything",
    }  # fmt: skip
    case = resolve(apply_settings(Scene(), given))
    whole, changes = March(case), []
    whole.advance(whole.total)
    for parts in in_parts(case, [61], anew=True):
        known = parts.state.known
        changes.append(known[88 + keep.CHANGED] * (known[88 + keep.SIZE] > keep.FEW))
    assert max(changes) > 5
    assert whole.counter[contact.TOUCHED] > 1000
    assert_same_bits(parts, whole)


@pytest.mark.parametrize("blades", [30, 60])
def test_sets_are_the_same_whether_tips_are_computed_or_bounded(blades):
    """Blades that do not touch have bounds between 0 and their gaps, until computed."""
    drawn, wide = np.random.default_rng(blades), widths(blades)[1]
    w = drawn_matrix(blades, drawn)
    sure, near, q = space_of(w), space_of(w), drawn.normal(size=16)
    places = np.array([place_of(j, blades, wide) for j in range(blades)])
    others, chosen = np.zeros(2 * wide), folded(blades, wide)
    tips, opened, computed, left = np.zeros((4, 2 * wide))
    again, entered, ways = drawn.normal(size=(blades, 16)), 0, [0, 0, 0]
    for gaps in slowly(drawn.normal(size=blades), drawn, 300):
        rows = (again * (gaps / (again @ q))[:, None]).ravel()
        read_all(rows, q, blades, computed)
        own = computed[places]
        lowest = open_whole(computed, others, 0, opened)
        if not lowest < 0.0:
            continue
        bounds = np.where(own > 0.0, own * drawn.random(blades), own)
        known = near.known[: near.known[blades + keep.SIZE]]
        bounds[known] = own[known]
        tips[:] = bounds[chosen]
        open_whole(tips, others, 0, left)
        ways[solve(own, sure)[2]] += 1
        active = solve_bounded(rows, q, others, tips, left, lowest, blades, wide, near)
        assert near.known.tobytes() == sure.known.tobytes()
        assert near.where[:active].tobytes() == sure.where[:active].tobytes()
        assert near.push[:active].tobytes() == sure.push[:active].tobytes()
        entered += (tips[places] != bounds).any()
    assert entered > 0
    assert min(ways[:2]) > 0
