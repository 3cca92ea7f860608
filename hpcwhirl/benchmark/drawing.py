"""Cases of a campaign on which `hpcwhirl tradeoff` compares settings.

Some cases are drawn evenly over the campaign and computed by the fastest preset; of
these, each word gives cases in proportion to its number, at least one. So rare words
are compared, too.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from hpcwhirl.benchmark.numbers import run_of
from hpcwhirl.benchmark.trials import applied
from hpcwhirl.campaign.plan.design import Design
from hpcwhirl.campaign.simulate import simulate
from hpcwhirl.errors import InputError
from hpcwhirl.scene import Scene, apply_settings, preset_inputs, preset_names

POOL = 4  # cases computed by the fastest preset / cases compared
SEED = 0  # of the draw: the same campaign gives the same cases


def drawn_cases(
    design: Design, count: int, tell: Callable[[str], None] = lambda _: None
) -> dict[str, Scene]:
    """Return cases of a campaign, {name: scene}, drawn in proportion to their words.

    Their order is random, so that the first ones are such a draw, too. A case that
    cannot be integrated is left out.

    Parameters
    ----------
    design : the campaign; of one that is refined the cases of its sweep
    count : most cases to draw
    tell : called with a line of text before each case

    Raises
    ------
    InputError
        if a case begins where another one ended, or if no case can be integrated
    """
    if design.is_branched:
        msg = "tradeoff compares cases by themselves: [branch] begins each case where "
        raise InputError(msg + "the preceding one ended; leave it out of the file")
    numbers = evenly(len(design.settings), POOL * count)
    words, why = {}, ""
    for number in numbers:
        tell(f"words by preset {preset_names()[0]}, {design.name(number)}")
        try:
            words[number] = word_by_draft(design.scene(number))
        except InputError as failed:
            why = str(failed)
    if not words:
        raise InputError(f"no case can be integrated: {why}")
    order = np.random.default_rng(SEED).permutation(by_words(words, count)).tolist()
    return {design.name(n): design.scene(n) for n in order}


def word_by_draft(scene: Scene) -> str:
    """Return regime and whirl of a scene by the fastest preset."""
    fast = applied(scene, preset_inputs(preset_names()[0]))
    result = simulate(apply_settings(fast, {"traces": "summary", "chaos": 0.0}))
    return run_of(result, 0.0).words


def evenly(cases: int, count: int) -> list[int]:
    """Return numbers of cases, one drawn from each of `count` equal parts of all."""
    if cases <= count:
        return list(range(cases))
    edges = np.linspace(0, cases, count + 1).astype(int)
    draw = np.random.default_rng(SEED)
    return [int(draw.integers(a, b)) for a, b in itertools.pairwise(edges)]


def by_words(words: Mapping[int, str], count: int) -> list[int]:
    """Return numbers of cases, of each word in proportion to its number of cases.

    Each word has at least one, as far as `count` allows, the most frequent first.

    words, count : {number of a case: its word}; most cases to return
    """
    groups: dict[str, list[int]] = {}
    for number, word in words.items():
        groups.setdefault(word, []).append(number)
    ordered = sorted(groups.values(), key=len, reverse=True)
    shares = _shares([len(group) for group in ordered], min(count, len(words)))
    draw = np.random.default_rng(SEED)
    return sorted(
        int(number)
        for group, share in zip(ordered, shares, strict=True)
        for number in draw.permutation(group)[:share]
    )


def _shares(sizes: Sequence[int], count: int) -> list[int]:
    """Return how many of `count` each group gets: one, and by its size the rest."""
    out = [1 if number < count else 0 for number in range(len(sizes))]
    while sum(out) < count:
        lacks = [size / sum(sizes) * count - own if own < size else -np.inf
                 for size, own in zip(sizes, out, strict=True)]  # fmt: skip
        out[int(np.argmax(lacks))] += 1
    return out
