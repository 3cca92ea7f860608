"""Gaps of all blades are the discrete Fourier transform of their spectrum."""

import numpy as np
import pytest

from hpcwhirl.dynamics.kernels.compiled import kernel
from hpcwhirl.dynamics.kernels.loop import passes, transform
from hpcwhirl.dynamics.kernels.loop.circulant import folded
from hpcwhirl.dynamics.kernels.vectors import widths
from hpcwhirl.dynamics.waves.slots import transforms

to_gaps, to_slots = (  # parts, for Python
    kernel(part.py_func) for part in (passes.to_gaps, transform.to_slots)
)


@pytest.mark.turns
@pytest.mark.parametrize("split", [False, True])
def test_gaps_are_the_transform_of_their_spectrum(split):
    # by numpy, of every number of blades; as one product, and in two stages
    seen = 0
    for blades in [*range(3, 100), 120, 143, 150, 176, 200, 240, 251]:
        k, wide = widths(blades)
        wave, half = transforms(blades)[1].copy(), blades // 2 + 1
        wave[2 * k * wide + transform.SPAN] *= split
        seen += wave[2 * k * wide + transform.SPAN] > 0
        drawn = np.random.default_rng(blades)
        spectrum, rows = np.zeros(2 * k), np.full(4 * wide, 7.0)
        spectrum[:half] = drawn.normal(size=half)
        spectrum[k : k + half] = drawn.normal(size=half)
        lowest = to_gaps(spectrum, wave, 0.3, k, wide, rows, 2 * wide)
        values = spectrum[:k] + 1j * spectrum[k:]
        full = np.zeros(blades, complex)
        full[:half] = values[:half]
        simple = [0, blades // 2] if blades % 2 == 0 else [0]
        full[simple] = full[simple].real  # sin(pi j) is 0
        want = 0.3 + blades * np.fft.ifft(full).real
        assert np.all(rows[: 2 * wide] == 7.0)
        assert rows[2 * wide :] == pytest.approx(want[folded(blades, wide)], abs=1e-12)
        assert lowest == pytest.approx(min(0.3, want.min()), abs=1e-12)
    assert seen > 20 if split else seen == 0


def test_a_split_is_made_of_factors_and_where_it_is_worth_it():
    for blades in range(3, 300):
        b = transform.span_of(blades)
        assert b == 0 or (blades % b == 0 and blades // b // 2 < transform.MOST)
    assert transform.span_of(22) == 0  # one product is as short
    assert transform.span_of(176) == 8
    assert transform.span_of(181) == 0  # prime


@pytest.mark.turns
def test_the_spectrum_of_multipliers_is_their_transform():
    # by numpy, wherever the first stage has whole vectors
    seen = 0
    for blades in [*range(60, 130), 144, 176, 180, 200, 240]:
        (k, wide), wave = widths(blades), transforms(blades)[1]
        span, drawn = transform.span_of(blades), np.random.default_rng(blades)
        if not span or span % 4:
            continue
        seen += 1
        which = drawn.permutation(blades)[: blades // 2]
        push, values, out = drawn.random(len(which)), np.zeros(blades), np.ones(2 * k)
        values[which] = push
        spread = drawn.random(transform.room_of(blades))
        to_slots(push, which, len(which), wave, k, wide, spread, out)
        found = out[:k] + 1j * out[k:]
        want = np.fft.rfft(values)
        assert found[: len(want)] == pytest.approx(want, abs=1e-12)
        assert not found[len(want) :].any()
        assert found[0].imag == 0.0 == (found[len(want) - 1].imag * (blades % 2 == 0))
    assert seen > 10
