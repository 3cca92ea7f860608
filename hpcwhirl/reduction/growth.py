"""Growth of a rotor's free motion, and the bands of speed in which it grows.

In amplitudes x of the modes at rest, M = 1, free motion obeys

x" + (D + D_s + 2 Omega C) x' + (K(Omega) + S) x = 0,

with D >= 0 of modal damping, C skew-Hermitian and K(Omega) Hermitian, see
`modes.Spin`. Only the supports can feed it: D_s and S act on the shaft's centre. The
energy x'^H x' + x^H K x of waves that do not move the centre never rises, so that they
do not grow where K(Omega) is positive definite, which it is up to
`waves.stiff_up_to`, beyond which no case runs. So bands are searched on nodal diameter
1 alone, or on the whole of a rotor of unequal sectors.

A search computes the roots s at equally spaced speeds: a band wider than their distance
contains one of them. Each branch s(Omega) is followed from speed to speed, and further
speeds are inserted where the maximum of Re s of a branch may rise above 0 between two.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np

from hpcwhirl.arrays import Complexes, Floats
from hpcwhirl.reduction.modes import (
    ModalModel,
    SpinBlock,
    centre_rows,
    unheld_rates,
    unlike_waves,
)
from hpcwhirl.reduction.numbers import zero_between
from hpcwhirl.reduction.supports import Bearing, planar
from hpcwhirl.reduction.waves import (
    ROUND_OFF,
    WaveLine,
    coupled_by_supports,
    diameter_matrices,
    largest_growth,
    lines_of_shapes,
    quadratic_roots,
    stiff_up_to,
    watched_speeds,
    wave_lines,
    wave_roots,
)

POINTS = 401  # speeds of a search for a rotor of equal sectors
FEWER = 101  # speeds of a search for a rotor of unequal sectors
ZOOM = 17  # speeds inserted around a maximum
ROUNDS = 3  # times that speeds are inserted
MOST_PEAKS = 20  # maxima around which speeds are inserted at a time
MODES_A_BLADE, MORE_MODES = 2, 8  # modes at each of two speeds: per blade, further
POLISHED, STEPS = 3, 6  # number of roots corrected to all modes; most corrections
ALONE = 1e-6  # singular value of a basis up to which a direction is left out
CLEAR = 1e-3  # decay of few amplitudes that all modes confirm / first frequency
MOST_KEPT = 4  # number of cached rotors in few amplitudes
CLOSE = 1e-12  # relative change of a root at which its correction ends


class Span(NamedTuple):
    """The range of speeds of a search, and why it ends there.

    Attributes
    ----------
    low, high : rad/s, >= 0; a rotor that turns clockwise is a mirror image
    ends : why no higher speed is searched: "table" (a bearing's table ends),
        "stiffness" (blades lose their stiffness), or "" (the search goes no further)
    """

    low: float
    high: float
    ends: str = ""


@dataclass(frozen=True)
class Band:
    """A band of speeds in which a free motion of the rotor grows.

    Attributes
    ----------
    start, end : rad/s
    ends : whether the motion decays beyond `end`; False: the search ends there
    growth, speed : 1/s, largest growth rate in the band; rad/s, the speed of it
    frequency : rad/s, of the motion that grows fastest, static frame; > 0: forward
    nodal_diameter, family : labels of the mode at rest from which that motion comes
    """

    start: float
    end: float
    ends: bool
    growth: float
    speed: float
    frequency: float
    nodal_diameter: int
    family: str


@dataclass(frozen=True)
class Stability:
    """The bands of speeds in which free motion grows, and what was searched.

    Attributes
    ----------
    span : the range of speeds that was searched
    resolution : rad/s, width from which on no band is missed; 0 if none can exist
    bands : the bands, ascending
    """

    span: Span
    resolution: float
    bands: tuple[Band, ...]

    @property
    def unstable_from(self) -> float | None:
        """Lowest speed, rad/s, at which a free motion grows; None if there is none."""
        return self.bands[0].start if self.bands else None


def search_range(model: ModalModel, blades: int, fastest: float = 0.0) -> Span:
    """Return the speeds at which instability and resonance of a rotor are searched.

    They are those of `waves.watched_speeds`, at most that at which blades lose their
    stiffness, since a case beyond it is refused.

    model, blades, fastest : rotor with terms of rotation; N; rad/s
    """
    low, high = watched_speeds(model, fastest)
    most = stiff_up_to(model, blades)
    if most < high:
        return Span(low, most, "stiffness")
    support = model.terms.support
    ends = isinstance(support, Bearing) and len(support.speeds) > 1
    return Span(low, high, "table" if ends else "")


def growth_at(model: ModalModel, blades: int, speed: float) -> float:
    """Return the growth rate of the fastest growing free motion, 1/s; 0 if none grows.

    Growth that round-off explains counts as 0. It says the same as
    `waves.largest_growth`, but computes only what can grow.

    model, blades, speed : rotor; N; Omega, rad/s
    """
    spin = model.spin
    if spin is None:
        return 0.0  # modal damping alone: no amplitude rises
    if not spin.waves:
        rate = _growth_of_uneven(model, blades, speed)
    else:
        rates = [
            float(wave_roots(model, piece, speed).real.max())
            for piece in spin.waves
            if piece.hub.any() or not _is_held(model, piece, speed)
        ]
        rate = max(rates, default=0.0)
    return rate if rate > floor_of(model) else 0.0


def _growth_of_uneven(model: ModalModel, blades: int, speed: float) -> float:
    """Return the largest growth rate of a rotor of unequal sectors, 1/s.

    Where few amplitudes clearly decay, it is their rate: all modes take far longer.
    """
    few = _few_of(model, blades, watched_speeds(model, abs(speed))[1])
    rate = float(few.roots(np.array([speed])).real.max())
    clear = rate < -CLEAR * float(model.omega[model.omega > 0.0].min())
    return rate if clear else largest_growth(model, blades, speed)


@lru_cache(maxsize=MOST_KEPT)
def _few_of(model: ModalModel, blades: int, high: float) -> _Uneven:
    return _Uneven(model, blades, high)


def rates_over(model: ModalModel, blades: int, speeds: Floats) -> Floats:
    """Return `growth_at` at n speeds, (n,), 1/s.

    Of a rotor of unequal sectors at several speeds it is computed from few amplitudes,
    see `_Uneven`.

    model, blades, speeds : rotor; N; (n,), rad/s
    """
    spin = model.spin
    if spin is None or spin.waves or len(speeds) == 1:
        each = (growth_at(model, blades, speed) for speed in speeds.tolist())
        return np.fromiter(each, float, len(speeds))
    few = _few_of(model, blades, watched_speeds(model, float(np.abs(speeds).max()))[1])
    rates = few.roots(speeds).real.max(axis=1)
    return np.where(rates > floor_of(model), rates, 0.0)


def floor_of(model: ModalModel) -> float:
    """Return the growth rate, 1/s, up to which round-off explains a growth."""
    return ROUND_OFF * float(model.omega.max())


def stability(model: ModalModel, blades: int, fastest: float = 0.0) -> Stability:
    """Return the bands of speeds in which a free motion of the rotor grows.

    model, blades, fastest : rotor with terms of rotation; N; rad/s, highest speed of
        interest, see `search_range`
    """
    span, pieces = search_range(model, blades, fastest), model.terms.waves
    moving = tuple(piece for piece in pieces if piece.hub.any())
    if (pieces and not moving) or not span.low < span.high:
        return Stability(span, 0.0, ())
    uneven = None if pieces else _Uneven(model, blades, span.high)
    search = _Search(model, blades, moving, uneven)
    grid = np.linspace(span.low, span.high, FEWER if uneven else POINTS)
    speeds, rates = search.sampled(grid)
    bands = [search.band(speeds, rates, run) for run in _runs(rates > 0.0)]
    return Stability(span, float(grid[1] - grid[0]), tuple(bands))


def _is_held(model: ModalModel, piece: SpinBlock, speed: float) -> bool:
    """Return whether the stiffness of a nodal diameter is positive definite.

    piece, speed : its modes and terms of rotation; Omega, rad/s
    """
    return _is_definite(diameter_matrices(model, piece, speed)[2])


def _is_definite(matrix: Any) -> bool:
    try:
        np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError:
        return False
    return True


def roots_over(model: ModalModel, piece: SpinBlock, speeds: Floats) -> Complexes:
    """Return the roots s, 1/s, of one nodal diameter at n speeds, in no order.

    They are (n, 2 m) for m modes, rotating frame; (n, 4 m), static frame, on supports
    that differ by direction, where each motion is counted with its conjugate.
    """
    spin, parts = model.terms, []
    for speed in speeds.tolist():
        gyro, damping, stiffness, push = diameter_matrices(model, piece, speed)
        pair = damping + gyro, stiffness + push
        if not spin.is_round:
            pair = coupled_by_supports(pair, unlike_waves(spin, piece), speed)
        parts.append(pair)
    rates, held = zip(*parts, strict=True)
    return quadratic_roots(np.stack(rates), np.stack(held))


def _tracked(roots: Complexes) -> Complexes:
    """Return roots at successive speeds sorted such that each column is one branch.

    roots : (n, r), in any order; so is the result
    """
    out = roots.copy()
    for i in range(1, len(out)):
        guess = 2 * out[i - 1] - out[i - 2] if i > 1 else out[0]
        cost = np.abs(guess[:, None] - out[i])
        order = cost.argmin(axis=1)
        if len(np.unique(order)) < len(order):
            from scipy.optimize import linear_sum_assignment  # slow to import

            order = linear_sum_assignment(cost)[1]
        out[i] = out[i][order]
    return out


def _peaks(rates: Floats) -> list[int]:
    """Return the samples around which a branch may rise above 0 between samples.

    There a branch has a maximum that is not above 0 itself, but by a parabola through
    it and its neighbours may be, with a margin for what the parabola misses.

    rates : (n, r), 1/s, growth rates of each branch at n speeds
    """
    low, middle, high = rates[:-2], rates[1:-1], rates[2:]
    bend = 2 * middle - low - high
    summit = (middle >= low) & (middle >= high) & (middle <= 0.0) & (bend > 0.0)
    most = middle + (high - low) ** 2 / (8 * np.where(summit, bend, np.inf)) + bend
    seen = summit & (most > 0.0)
    places, branches = np.nonzero(seen)
    first = np.argsort(-most[places, branches], kind="stable")
    return [int(i) + 1 for i in dict.fromkeys(places[first])][:MOST_PEAKS]


def _runs(above: Any) -> list[tuple[int, int]]:
    """Return first and last index of each run of True in a list of bools, (n,)."""
    steps = np.flatnonzero(np.diff(np.concatenate([[0], above, [0]]).astype(int)))
    return [(int(a), int(b) - 1) for a, b in steps.reshape(-1, 2)]


def _edge(growth: Callable[[float], float], speeds: list[float]) -> float:
    """Return the speed at which the growth rate is 0, rad/s, the end of a band.

    If it is above 0 at all samples, the last of them is returned.

    growth : function from a speed to its largest growth rate
    speeds : rad/s, samples from the last one in the band outward
    """
    for grows, calm in pairwise(speeds):
        if growth(calm) <= 0.0:
            return zero_between(growth, calm, grows) if growth(grows) > 0.0 else grows
    return speeds[-1]


@dataclass(frozen=True)
class _Search:
    """A search for bands of speed in which a free motion grows.

    Attributes
    ----------
    model, blades : rotor with terms of rotation; N
    moving : the nodal diameters that move the centre; empty for unequal sectors
    uneven : the rotor in few amplitudes; None for equal sectors
    """

    model: ModalModel
    blades: int
    moving: tuple[SpinBlock, ...]
    uneven: _Uneven | None

    def roots(self, speeds: Floats) -> Complexes:
        """Return the roots s, 1/s, that may grow, at n speeds, rad/s, (n, r)."""
        if self.uneven is not None:
            return self.uneven.roots(speeds)
        each = [roots_over(self.model, piece, speeds) for piece in self.moving]
        return np.hstack(each)

    def growth(self, speed: float) -> float:
        """Return the largest growth rate, 1/s, less what round-off explains."""
        if self.uneven is not None:
            return self.uneven.growth(speed) - floor_of(self.model)
        rates = self.roots(np.array([speed])).real
        return float(rates.max()) - floor_of(self.model)

    def sampled(self, grid: Floats) -> tuple[Floats, Floats]:
        """Return speeds and the largest growth rate at each, (n,), rad/s and 1/s.

        They are those of the grid, and those inserted around maxima of single branches.
        What round-off explains is subtracted.

        grid : (n,), rad/s, ascending
        """
        speeds, found, floor = grid, self.roots(grid), floor_of(self.model)
        for _ in range(ROUNDS):
            places = _peaks(_tracked(found).real - floor)
            around = [np.linspace(speeds[i - 1], speeds[i + 1], ZOOM) for i in places]
            more = np.setdiff1d(np.concatenate([*around, speeds[:0]]), speeds)
            if not len(more):
                break
            every = np.concatenate([speeds, more])
            order = np.argsort(every)
            found = np.concatenate([found, self.roots(more)])[order]
            speeds = every[order]
        return speeds, found.real.max(axis=1) - floor

    def band(self, speeds: Floats, rates: Floats, run: tuple[int, int]) -> Band:
        """Return the band that contains some samples, with its fastest motion.

        Parameters
        ----------
        speeds, rates : (n,), rad/s and 1/s, samples
        run : first and last sample of the band
        """
        first, last = run
        start, end = (
            _edge(self.growth, outward)
            for outward in (speeds[first::-1].tolist(), speeds[last:].tolist())
        )
        top = first + int(np.argmax(rates[first : last + 1]))
        low, high = speeds[max(top - 1, 0)], speeds[min(top + 1, len(speeds) - 1)]
        at = self._summit(max(low, start), min(high, end))
        lines = (
            wave_lines(self.model, self.blades, at)
            if self.uneven is None
            else self.uneven.lines(at)
        )
        line = max(lines, key=attrgetter("growth"))
        grown = self.growth(at) + floor_of(self.model)
        return Band(
            start, end, end < float(speeds[-1]), grown, at, line.static,
            line.nodal_diameter, line.family,
        )  # fmt: skip

    def _summit(self, low: float, high: float) -> float:
        """Return the speed of the largest growth rate between two speeds, rad/s."""
        at = low
        for _ in range(2):
            near = np.linspace(low, high, ZOOM)
            best = int(np.argmax(self.roots(near).real.max(axis=1)))
            at = float(near[best])
            low, high = near[max(best - 1, 0)], near[min(best + 1, ZOOM - 1)]
        return at


class _Uneven:
    """Waves of a rotor of unequal sectors that may grow, in few amplitudes.

    A search uses `basis`: the lowest modes at rest, and those of K(Omega) at its
    highest speed. The roots of all modes would take ten times as long. Those with the
    largest growth are corrected to roots of all modes, by Newton's method.

    Attributes
    ----------
    model, blades : the rotor; N
    rest, damping : (m,), squared frequencies, (m, m), modal damping of all m modes
    coriolis, stiffening, quartic : (m, m), terms of rotation in these modes
    hub : (2, m), displacements x_o, y_o of the centre in each mode
    basis : (m, r), orthonormal
    """

    def __init__(self, model: ModalModel, blades: int, high: float) -> None:
        self.model, self.blades = model, blades
        shapes, spin = model.shapes, model.terms
        self.rest = model.omega**2
        self.damping = np.diag(2 * model.ratios * model.omega)
        if model.unheld is not None:
            self.damping = unheld_rates(model.ratios, model.omega, model.unheld)
        if spin.material is not None:
            self.damping = self.damping + shapes.T @ spin.material @ shapes
        self.hub = centre_rows(model, blades)
        self.coriolis, self.stiffening = (
            shapes.T @ matrix @ shapes for matrix in (spin.coriolis, spin.stiffening)
        )
        own = spin.quartic
        self.quartic = None if own is None else shapes.T @ own @ shapes

        few = min(MODES_A_BLADE * blades + MORE_MODES, len(self.rest))
        moved = np.linalg.eigh(self.matrices(high)[1])[1][:, :few]
        both = np.hstack([np.eye(len(self.rest), few), moved])
        directions, sizes, _ = np.linalg.svd(both, full_matrices=False)
        self.basis = directions[:, sizes > ALONE]

    def matrices(self, speed: float) -> tuple[Floats, Floats, Floats]:
        """Return G = D + D_s + 2 Omega C, K(Omega) and S of all modes, (m, m).

        speed : Omega, rad/s
        """
        hub, own = self.hub, self.model.terms.support.at(speed)
        held = own.turning(speed)
        rate = self.damping + 2 * speed * self.coriolis
        stiffness = np.diag(self.rest) + speed**2 * self.stiffening
        if self.quartic is not None:
            stiffness += speed**4 * self.quartic
        rate += hub.T @ planar(own.damping) @ hub
        stiffness += held.real * hub.T @ hub
        push = hub.T @ planar(1j * held.imag) @ hub
        for one in self.model.terms.stations:
            own, rows = one.support.at(speed), one.rows @ self.model.shapes
            held = own.turning(speed)
            rate += rows.T @ planar(own.damping) @ rows
            stiffness += held.real * rows.T @ rows
            push += rows.T @ planar(1j * held.imag) @ rows
        return rate, stiffness, push

    def _few(self, speed: float) -> tuple[Floats, Floats]:
        """Return G and K + S of the amplitudes of `basis`, (r, r)."""
        rate, held, push = self.matrices(speed)
        some = self.basis
        return some.T @ rate @ some, some.T @ (held + push) @ some

    def roots(self, speeds: Floats) -> Complexes:
        """Return the roots s, 1/s, of few amplitudes at n speeds, (n, 2 r)."""
        each = (self._few(speed) for speed in speeds.tolist())
        return np.array([quadratic_roots(rate, held) for rate, held in each])

    def pairs(self, speed: float) -> tuple[Complexes, Complexes]:
        """Return roots s, 1/s, of few amplitudes, (q,), and those of all modes, (m, q).

        Of a pair of conjugates only the root with Im s > 0 is returned.
        """
        rate, held = self._few(speed)
        n = len(held)
        top = np.hstack([np.zeros((n, n)), np.eye(n)])
        roots, shapes = np.linalg.eig(np.vstack([top, np.hstack([-held, -rate])]))
        upper = roots.imag >= 0.0
        return roots[upper], self.basis @ shapes[:n, upper]

    def growth(self, speed: float) -> float:
        """Return the growth rate of the least stable free motion, 1/s, of all modes.

        It is 0 if the supports feed nothing and K(Omega) is positive definite, so that
        no motion grows; speed : Omega, rad/s
        """
        rate, held, push = self.matrices(speed)
        if not push.any() and _is_definite(held):
            return 0.0
        roots, shapes = self.pairs(speed)
        first = np.argsort(-roots.real)[:POLISHED]
        return max(
            _corrected(rate, held + push, complex(roots[i]), shapes[:, i])
            for i in first
        )

    def lines(self, speed: float) -> list[WaveLine]:
        """Return the waves of few amplitudes at a speed, rad/s."""
        roots, shapes = self.pairs(speed)
        radial = self.model.shapes[0 : 2 * self.blades : 2] @ shapes
        moved = np.abs(shapes) ** 2
        return lines_of_shapes(self.model, self.blades, speed, roots, radial, moved)


def _corrected(rate: Floats, held: Floats, root: complex, shape: Complexes) -> float:
    """Return the growth rate, 1/s, of the root of all modes nearest to an estimate.

    It solves (s^2 + s G + K) x = 0 by Newton's method for s and x.

    Parameters
    ----------
    rate, held : G and K with S, (m, m)
    root, shape : s, 1/s, and amplitudes (m,), the estimate
    """
    n, s, x = len(held), root, shape / np.linalg.norm(shape)
    for _ in range(STEPS):
        slope = 2 * s * x + rate @ x
        try:
            moved = np.linalg.solve(s**2 * np.eye(n) + s * rate + held, slope)
        except np.linalg.LinAlgError:  # s is a root to the last digit
            break
        step = complex(np.vdot(x, x) / np.vdot(x, moved))
        s, x = s - step, moved / np.linalg.norm(moved)
        if abs(step) <= CLOSE * abs(s):
            break
    return s.real
