"""Traces of a case reduced to a few bytes, a record, for the page.

A record consists of a few numbers and of curves (orbit, radius, energy, powers,
spectrum) and has one size for all cases; values of curves have 16 bits. Coordinates of
the orbit are integer multiples of a fraction of the largest coordinate. Values that
span decades are stored as a sign and the logarithm of their ratio to the largest, in
32,767 steps of 0.085 %, down to a ratio of 2^-40.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.analysis.whirl import full_spectrum
from hpcwhirl.arrays import Floats

Traces = dict[str, Floats]
TARGET = 4_170_000  # bytes of all records of a page, unless records become too small
THINNEST, FINEST = 600, 12_000  # bytes of a record, smallest and largest
MOST_RECORDS = 20_000
LARGEST, LEAST = 1e38, 1e-37  # limits of single precision
HEAD = 8  # number of numbers, of four bytes each, before the curves of a record
NEEDED = ("centre", "energy", "fed", "rubbed", "lost")
PER_TURN = 36  # samples of an orbit in the period of its fastest strong line
LEAST_LINE = 1e-2  # least line within a shown spectrum, relative to the strongest
SCALE = 32767  # steps of a coordinate of the orbit
NOTHING = -32768  # code for "no value"
OCTAVES = 40  # log2 of the ratio of a curve's largest to its smallest stored value


@dataclass(frozen=True)
class Sizes:
    """Numbers of points of the curves in a case's record, the same for all cases.

    Attributes
    ----------
    orbit : number of positions of the centre, at the end of the run
    radius : number of intervals of the run, each with the least and the largest |Z|
    ledger : number of intervals of the run, each with energy and powers
    lines : number of intervals of the two-sided spectrum, each with its largest line
    """

    orbit: int
    radius: int
    ledger: int
    lines: int

    @property
    def bytes(self) -> int:
        """Number of bytes of a record, a multiple of 3: base64 texts can be joined."""
        values = 2 * self.orbit + 2 * self.radius + 4 * self.ledger + self.lines
        return -(-(4 * HEAD + 2 * values) // 12) * 12


def sizes_for(cases: int) -> Sizes:
    """Return numbers of points of a record so that the whole page is of good size.

    cases : number of cases that have a record
    """
    room = min(max(TARGET // max(cases, 1), THINNEST), FINEST) // 2 - 2 * HEAD
    return Sizes(
        orbit=int(0.27 * room), radius=int(0.085 * room),
        ledger=int(0.04 * room), lines=int(0.12 * room),
    )  # fmt: skip


def record_of(
    traces: Traces, speed: float, window: float, line: float, sizes: Sizes
) -> bytes:
    """Return a case's record: its traces, reduced to few points, as bytes.

    Parameters
    ----------
    traces : `time` and the traces `NEEDED`; centre (n, 2), m, static frame
    speed : Omega, rad/s
    window : s, length of the last part of the run, by which its words are decided
    line : frequency of the strongest spectral line, rad/s, forward positive
    sizes : number of points of each curve
    """
    time = traces["time"]
    with np.errstate(all="ignore"):  # of a diverged run, finite values are shown
        centre = traces["centre"] @ np.array([1.0, 1j])
        late = time > time[-1] - window if len(time) else slice(0)
        shown = len(time[late]), _fastest(speed, line)
        head, places = _orbit(time, centre, shown, sizes.orbit)
        reach, lines = _lines(time, centre[late], abs(speed), sizes.lines)
        spans = spans_of(np.abs(centre), sizes.radius)
        energy, power = np.split(_ledger(traces, sizes.ledger), [sizes.ledger])
        scales, codes = zip(*map(_codes, (spans, energy, power, lines)), strict=True)
        start = np.fmod(speed * head[1], 2 * np.pi)  # angle of the rotating frame
        numbers = np.array([head[0], start, head[2], reach, *scales], "<f4").tobytes()
    whole = numbers + np.concatenate([places, *codes]).tobytes()
    return whole.ljust(sizes.bytes, b"\0")


def _fastest(speed: float, line: float) -> float:
    """Return the angular speed that an orbit must be sampled finely enough for, rad/s.

    It is the largest of the speed and the strongest line's frequency in either frame.

    speed, line : Omega; frequency of the strongest spectral line in the static frame
    """
    return max(abs(speed), abs(line), abs(line - abs(speed)), 1e-9)


def _orbit(
    time: Floats, centre: NDArray[np.complex128], shown: tuple[int, float], most: int
) -> tuple[tuple[float, float, float], NDArray[np.int16]]:
    """Return the last part of an orbit as positions at equal intervals, at most `most`.

    Parameters
    ----------
    time : (n,), s
    centre : (n,), m, x + i y in the static frame
    shown : number of samples of the window, which is covered if possible; fastest
        angular speed, rad/s, a turn of which has at least `PER_TURN` positions
    most : largest number of positions

    Returns
    -------
    (scale, m; time of the first position, s; interval, s), and the positions (2 *
    most,), x then y, as integers in units of scale / `SCALE`
    """
    out = np.full((2, most), NOTHING, "<i2")
    finite = np.isfinite(centre)
    last = int(np.argmin(finite)) if not finite.all() else len(centre)
    if last < 2:
        return (0.0, 0.0, 0.0), out.reshape(-1)
    interval = float(time[1] - time[0])
    window, fastest = shown
    turning = int(2 * np.pi / fastest / PER_TURN / interval)
    stride = max(min(turning, -(-window // most)), 1)
    chosen = np.arange(last - 1, -1, -stride)[:most][::-1]
    path = centre[chosen]
    scale = float(max(np.abs(path.real).max(), np.abs(path.imag).max()))
    unit = SCALE / scale if scale > 0 else 0.0
    out[:, : len(chosen)] = np.rint(unit * np.array([path.real, path.imag]))
    return (scale, float(time[chosen[0]]), stride * interval), out.reshape(-1)


def at_most(items: Any, most: int) -> Any:
    """Return every n-th item of a list or array, at most `most`, with the least n."""
    return items[:: max(-(-len(items) // most), 1)]


def cuts_of(count: int, most: int) -> NDArray[np.int64]:
    """Divide samples into at most `most` intervals; return each one's first index.

    count : number of samples
    """
    return np.unique(np.linspace(0, count, min(most, count), endpoint=False, dtype=int))


def spans_of(values: Floats, most: int) -> Floats:
    """Return the least and the largest value in each of `most` intervals of samples.

    Returns
    -------
    (2 * most,), the least value of each interval, then the largest of each; NaN for
    missing intervals
    """
    out = np.full((2, most), np.nan)
    if len(values):
        cuts = cuts_of(len(values), most)
        out[0, : len(cuts)] = np.fmin.reduceat(values, cuts)
        out[1, : len(cuts)] = np.fmax.reduceat(values, cuts)
    return out.reshape(-1)


def _ledger(traces: Traces, most: int) -> Floats:
    """Return energy and powers of a run, means over each of `most` intervals.

    The result, (4 * most,), has the energies, J, then the powers of friction, of
    transport of contacts and of losses, W; NaN for missing intervals.
    """
    out = np.full((4, most), np.nan)
    time, rubbed = traces["time"], traces["rubbed"]
    if not len(time):
        return out.reshape(-1)
    cuts = cuts_of(len(time), most)
    ends = np.append(cuts[1:], len(time)) - 1
    shown = slice(len(cuts))
    out[0, shown] = np.add.reduceat(traces["energy"], cuts) / (ends - cuts + 1)
    spent = np.diff(time[ends], prepend=0.0)
    sums = (rubbed, traces["fed"] - rubbed, traces["lost"])
    for row, total in enumerate(sums, start=1):
        out[row, shown] = np.diff(total[ends], prepend=0.0) / spent
    return out.reshape(-1)


def _lines(
    time: Floats, orbit: NDArray[np.complex128], speed: float, most: int
) -> tuple[float, Floats]:
    """Return an orbit's full spectrum, reduced to the largest line in each interval.

    Returns the end of the spectrum, rad/s, and amplitudes, (most,), m, in `most` equal
    intervals from -end to end; NaN in one without a line

    time, orbit : (n,), s; (n,), m, x + i y in the static frame
    speed : |Omega|, rad/s
    """
    out = np.full(most, np.nan)
    if len(orbit) < 4 or not np.isfinite(orbit).all():
        return 0.0, out
    omega, lines = full_spectrum(orbit, float(time[1] - time[0]))
    strong = np.abs(omega[lines >= LEAST_LINE * lines.max()])
    reach = min(max(1.1 * float(strong.max(initial=0.0)), 1.5 * speed), -omega[0])
    inside = np.abs(omega) < reach
    if reach <= 0.0 or not inside.any():
        return 0.0, out
    piece = ((omega[inside] + reach) / (2 * reach) * most).astype(int)
    np.fmax.at(out, np.minimum(piece, most - 1), lines[inside])
    return reach, out


def _codes(values: Floats) -> tuple[float, NDArray[np.int16]]:
    """Encode values of a curve as integers of 16 bits; return scale and integers.

    Value = +- scale 2^(-OCTAVES (1 - |code| / SCALE)), with the sign of the code; 0 for
    the code 0.
    """
    known = np.where(np.abs(values) < LARGEST, values, np.nan)
    scale = float(np.nanmax(np.abs(known), initial=0.0))
    if scale < LEAST:
        return 0.0, np.where(np.isnan(known), NOTHING, 0).astype("<i2")
    with np.errstate(divide="ignore"):  # zero gets the sign 0
        ratio = np.maximum(np.log2(np.abs(known) / scale), -OCTAVES)
    codes = np.sign(known) * np.maximum(np.rint(SCALE * (1 + ratio / OCTAVES)), 0)
    return scale, np.where(np.isnan(known), NOTHING, codes).astype("<i2")
