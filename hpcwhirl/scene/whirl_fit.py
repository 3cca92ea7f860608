"""Coefficients over the frequency of the whirl, as springs, dampers and masses.

A bearing or seal that reacts to the frequency w of a motion e^{s t}, s = i w, has the
dynamic stiffness H(s) = k(w) + s c(w) + s^2 m of its table. It is fitted by

H(s) = k_0 + s c_0 + s^2 m_0 + sum of a_j g_j(s),
g_j(s) = (s^2 + 2 zeta w_0 s) / (s^2 + 2 zeta w_0 s + w_0^2)

with few branches j, each a mass on a spring and a damper: g_j is that of a spring
between shaft and mass, and a damper between mass and ground, whose stiffness is 0 at w
= 0 and 1 above w_0. With a_j, c_0, m_0 >= 0 the fit is passive at all frequencies: it
never gives energy. This is asked for where the table has no negative damping. The
amplitudes solve a linear problem for given w_0 and zeta (lsq_linear); these are
improved by least squares (variable projection: G. Golub, V. Pereyra, The
differentiation of pseudo-inverses and nonlinear least squares problems whose variables
separate, SIAM 10, 1973). The number of branches is the least with which
the largest error at the table's rows is at most what is allowed, and that between them,
from a monotone cubic, at most ten times as much: without that bound, branches of few
rows would resonate between them.

In the plane, H is a matrix (2, 2). The kinds of tables are

- the same in all directions: k_xx = k_yy, k_xy = -k_yx, c likewise. With Z = X + i Y it
  is one complex function, H_xx - i H_xy, of forward (w > 0) and backward whirl; a_j -
  i b_j is complex, with b_j of any sign;
- different along x and y, with cross coupling that does not depend on w: a_j of each
  direction, which must be passive.

A mass M = kappa / w_0^2 with the displacement W moves with the shaft's Z by

M W'' + 2 zeta kappa / w_0 W' + kappa W = A Z, F = -A (A Z / kappa - W),

A^2 = kappa a_j: the square root of a complex number, or that of each direction.
"""

from __future__ import annotations

import cmath
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hpcwhirl.arrays import Complexes, Floats

Row = tuple[float, ...]
MOST = 6  # branches
BETWEEN = 2  # frequencies between two rows at which a fit is judged
FASTEST = 5.0  # largest |pole| of a branch over the table's largest frequency
SLOWEST = 0.2  # least w_0 over the table's least frequency > 0
RATIOS = 0.02, 10.0  # least and largest zeta
OUTSIDE = 0.2  # least zeta of a branch far above the table's largest frequency
LIGHT = 0.1  # weight of a frequency between two rows, that of a row being 1
GRID = 8, 7  # poles that are tried for a further branch
ROUNDS = 60  # of the improvement of poles
LEAST = 1e-3  # share of the largest stiffness by which errors are at least divided
NOUGHT = 1e-12  # share of the largest stiffness below which a branch is left out
KXX, KXY, KYX, KYY, CXX, CXY, CYX, CYY = range(8)


class Branch(NamedTuple):
    """A mass beside the shaft, on a spring and a damper, see the module.

    Attributes
    ----------
    natural, ratio : w_0, rad/s; zeta
    stiffness : kappa, N/m, > 0
    xx, xy, yx, yy : A, N/m
    """

    natural: float
    ratio: float
    stiffness: float
    xx: float
    xy: float
    yx: float
    yy: float


@dataclass(frozen=True)
class WhirlFit:
    """A fit of coefficients over the whirl's frequency.

    Attributes
    ----------
    rest : (8,), k_xx, ..., c_yy of what acts beside the branches: k_0 + sum of a_j, and
        c_0; N/m, N s/m
    mass : m_0, kg
    branches : the further masses
    low, high : rad/s, range of the table
    error, between : largest |H_fit - H| / |H| at the table's rows, and between them, of
        a monotone cubic
    """

    rest: Row
    mass: float
    branches: tuple[Branch, ...]
    low: float
    high: float
    error: float
    between: float


@dataclass(frozen=True, eq=False)
class _Data:
    """Functions to be fitted, each over s = i w.

    Attributes
    ----------
    s : (n,), 1/s
    parts : (p, n), N/m; each has amplitudes of its own, and m_0 in common
    scales : (p, n), N/m, by which errors are divided
    weights : (n,), 1 at the table's rows, and less between them
    passive, massive : (p,), whether amplitudes must be >= 0; whether m_0 acts
    alike : whether the parts are H_xx and H_xy of one complex function, not H_xx, H_yy
    """

    s: Complexes
    parts: Complexes
    scales: Floats
    weights: Floats
    passive: tuple[bool, ...]
    massive: tuple[bool, ...]
    alike: bool


class _Trial(NamedTuple):
    """Amplitudes for given poles.

    Attributes
    ----------
    poles : (b, 2), logarithms of the largest |pole|, 1/s, and of zeta
    amplitudes : (p, 2 + b), k_0, c_0, a_j of each part
    mass : m_0
    errors : (p, n), complex, relative, weighted
    largest : largest error at the table's rows; of a complex function, of forward and
        backward whirl
    between : the same between the rows, beside a monotone cubic
    """

    poles: Floats
    amplitudes: Floats
    mass: float
    errors: Complexes
    largest: float
    between: float

    @property
    def worst(self) -> float:
        """The error by which it is judged."""
        return max(self.largest, LIGHT * self.between)


def fitted(rows: Sequence[Row], mass: float, allowed: float) -> WhirlFit:
    """Return the fit of a table over the whirl's frequency with the fewest branches.

    Parameters
    ----------
    rows : (w, k_xx, k_xy, k_yx, k_yy, c_xx, c_xy, c_yx, c_yy) at each frequency; rad/s,
        N/m, N s/m
    mass : kg, added mass that the table has besides
    allowed : largest error

    Raises
    ------
    ValueError
        if the error remains larger, or if the table differs by direction in a way that
        is not modelled
    """
    table = np.array(rows)
    w, columns = _between(table[:, 0], table[:, 1:])
    data = _data(w, columns, mass)
    best = trial = _solved(data, np.zeros((0, 2)))
    while best.worst > allowed and len(trial.poles) < MOST:
        trial = _improved(data, _with_another(data, trial))
        best = min(best, trial, key=lambda one: one.worst)
    if not best.worst <= allowed:
        raise ValueError(
            "its coefficients over whirl_frequency differ from a fit with "
            f"{len(best.poles)} branches by {best.largest:.2g} of its dynamic "
            f"stiffness, between rows by {best.between:.2g}: at most whirl_tolerance = "
            f"{allowed:g} and {allowed / LIGHT:g} are allowed"
        )
    return _as_fit(best, data, columns[0])


def _between(w: Floats, columns: Floats) -> tuple[Floats, Floats]:
    """Return frequencies of a table and some between them, and the columns there."""
    if len(w) == 1:
        return w, columns
    from scipy.interpolate import PchipInterpolator  # slow to import

    parts = [np.linspace(a, b, BETWEEN + 1, endpoint=False)
             for a, b in itertools.pairwise(w)]  # fmt: skip
    dense = np.append(np.concatenate(parts), w[-1])
    return dense, np.asarray(PchipInterpolator(w, columns)(dense))


def _data(w: Floats, columns: Floats, mass: float) -> _Data:
    """Return the functions to be fitted; columns : (n, 8)."""
    s = np.asarray(1j * w, dtype=np.complex128)
    xx, xy, yx, yy = (columns[:, i] + s * columns[:, 4 + i] for i in range(4))
    calm = bool((columns[:, [CXX, CYY]] >= 0.0).all())
    fluid = mass * s**2
    weights = np.where(np.arange(len(w)) % (BETWEEN + 1), LIGHT, 1.0)
    if np.array_equal(xx, yy) and np.array_equal(xy, -yx):
        parts = np.array([xx + fluid, xy][: 1 + bool(xy.any())])
        size = np.linalg.norm(parts, axis=0)
        scales = np.maximum(size, LEAST * size.max()) * np.ones((len(parts), 1))
        n = len(parts)
        return _Data(
            s, parts, scales, weights, (calm, False)[:n], (True, False)[:n], alike=True
        )
    cross = columns[:, [KXY, KYX, CXY, CYX]]
    are_constant = bool((cross == cross[0]).all())
    if not (are_constant and calm):
        must = (
            "kxy, kyx, cxy, cyx must be constant" if calm else "cxx, cyy must be >= 0"
        )
        raise ValueError(
            f"its {must} over whirl_frequency, or kyy = kxx, kyx = -kxy and c alike; "
            'unequal = "mean" takes the mean of both directions'
        )
    parts = np.array([xx, yy]) + fluid
    size = np.abs(parts)
    scales = np.maximum(size, LEAST * size.max(axis=1, keepdims=True))
    return _Data(s, parts, scales, weights, (True, True), (True, True), alike=False)


def _pairs(poles: Floats, high: float) -> list[tuple[float, float]]:
    """Return (w_0, zeta) of each branch.

    poles, high : (b, 2), see `_Trial`; rad/s, the table's largest frequency
    """
    out = []
    for fastest, given in np.exp(poles).tolist():
        zeta = max(given, min(OUTSIDE, RATIOS[0] * (fastest / high) ** 4))
        largest = max(zeta, 1.0) + math.sqrt(max(zeta**2 - 1.0, 0.0))  # |pole| / w_0
        out.append((fastest / largest, zeta))
    return out


def _shapes(s: Complexes, poles: Floats) -> Complexes:
    """Return 1, s and each g_j, (2 + b, n)."""
    out = [np.ones_like(s), s]
    for natural, zeta in _pairs(poles, float(s[-1].imag)):
        top = s * (s + 2.0 * zeta * natural)
        out.append(top / (top + natural**2))
    return np.array(out)


def _solved(data: _Data, poles: Floats) -> _Trial:
    """Return the amplitudes of least squares for given poles."""
    from scipy.optimize import lsq_linear  # slow to import

    shapes = _shapes(data.s, poles)
    count, parts = len(shapes), len(data.parts)
    matrix = np.zeros((parts, len(data.s), parts * count + 1), complex)
    least = np.zeros(parts * count + 1)
    for i, scale in enumerate(data.scales):
        own = slice(i * count, (i + 1) * count)
        matrix[i, :, own] = (data.weights * shapes / scale).T
        matrix[i, :, -1] = data.weights * data.massive[i] * data.s**2 / scale
        least[own] = 0.0 if data.passive[i] else -np.inf
        least[own.start] = -np.inf  # a spring of either sign gives no energy
    flat = matrix.reshape(-1, parts * count + 1)
    wanted = (data.weights * data.parts / data.scales).ravel()
    real, target = np.vstack([flat.real, flat.imag]), np.r_[wanted.real, wanted.imag]
    size = np.maximum(np.linalg.norm(real, axis=0), np.finfo(float).tiny)
    found = lsq_linear(real / size, target, (least, np.inf), method="bvls").x / size
    errors = (flat @ found - wanted).reshape(parts, -1)
    amplitudes = found[:-1].reshape(parts, count)
    sizes = _sizes(data, errors / data.weights)
    at = data.weights == 1.0
    worst = float(sizes[:, at].max()), float(sizes[:, ~at].max(initial=0.0))
    return _Trial(poles, amplitudes, float(found[-1]), errors, *worst)


def _sizes(data: _Data, errors: Complexes) -> Floats:
    """Return the sizes of errors, of each part or of both whirls, (1 or 2, n)."""
    if data.alike and len(errors) == 2:
        direct, cross = errors
        errors = np.array([direct - 1j * cross, direct + 1j * cross])
    return np.abs(errors)


def _limits(data: _Data) -> tuple[Floats, Floats]:
    """Return the least and the largest of a branch's logarithms in `_Trial.poles`."""
    w = data.s.imag
    low, high = SLOWEST * float(w[w > 0.0].min(initial=w[-1])), FASTEST * float(w[-1])
    return np.log([low, RATIOS[0]]), np.log([high, RATIOS[1]])


def _with_another(data: _Data, trial: _Trial) -> _Trial:
    """Return amplitudes with one more branch, the best of a grid of poles."""
    low, high = _limits(data)
    each = zip(low, high, GRID, strict=True)
    grid = itertools.product(*(np.linspace(a, b, n) for a, b, n in each))
    tried = (_solved(data, np.vstack([trial.poles, one])) for one in grid)
    return min(tried, key=lambda one: float(np.linalg.norm(one.errors)))


def _improved(data: _Data, trial: _Trial) -> _Trial:
    """Return amplitudes with the poles that are best nearby."""
    from scipy.optimize import least_squares  # slow to import

    def residuals(flat: Floats) -> Floats:
        errors = _solved(data, flat.reshape(-1, 2)).errors.ravel()
        return np.append(errors.real, errors.imag)

    low, high = (np.tile(one, len(trial.poles)) for one in _limits(data))
    start = np.clip(trial.poles.ravel(), low + 1e-9, high - 1e-9)
    found = least_squares(residuals, start, bounds=(low, high), max_nfev=ROUNDS)
    return _solved(data, found.x.reshape(-1, 2))


def _as_fit(trial: _Trial, data: _Data, first: Floats) -> WhirlFit:
    """Return a fit as masses on springs and dampers.

    first : (8,), coefficients at the least frequency, of which constant cross coupling
        is kept
    """
    own, alike = trial.amplitudes, data.alike
    ends = float(data.s[0].imag), float(data.s[-1].imag)
    largest = float(np.abs(own[:, 2:]).max(initial=0.0))
    stiff, rates = own[:, 0] + own[:, 2:].sum(axis=1), own[:, 1]
    branches = []
    for (natural, zeta), a in zip(
        _pairs(trial.poles, ends[1]), own[:, 2:].T, strict=True
    ):
        size = float(np.linalg.norm(a) if alike else a.max())
        if size > NOUGHT * largest:
            branches.append(
                Branch(natural, zeta, size, *_coupling(a, size, alike=alike))
            )
    rest = [*_matrix(stiff, alike=alike), *_matrix(rates, alike=alike)]
    if not alike:
        for i in (KXY, KYX, CXY, CYX):
            rest[i] = float(first[i])
    for one in branches:
        for i, part in enumerate(one[3:]):
            rest[i] -= part
    return WhirlFit(
        tuple(rest), trial.mass, tuple(branches), *ends, trial.largest, trial.between
    )


def _coupling(a: Floats, size: float, *, alike: bool) -> tuple[float, ...]:
    """Return A of a branch with amplitudes a, (p,), and kappa = size."""
    if not alike:
        return _matrix(np.sqrt(size * a), alike=alike)
    root = cmath.sqrt(size * complex(a[0], -a[1] if len(a) == 2 else 0.0))
    return _matrix(np.array([root.real, -root.imag]), alike=alike)


def _matrix(parts: Floats, *, alike: bool) -> tuple[float, ...]:
    """Return xx, xy, yx, yy of (xx, xy) or (xx,), or of (xx, yy) without `alike`."""
    first, *other = parts.tolist()
    second = other[0] if other else 0.0
    return (first, second, -second, first) if alike else (first, 0.0, 0.0, second)
