"""Types of arguments of the kernel of several contact points a tip."""

from __future__ import annotations

from typing import NamedTuple

from hpcwhirl.arrays import Floats, Integers
from hpcwhirl.dynamics.kernels.body_types import ConstantSpace


class PointRows(NamedTuple):
    """Coefficients between P contact points and m amplitudes, a row for each point.

    `width` is m + P + 2, padded: amplitudes, multipliers, cos and sin of the pulse. The
    motion of the material from step n - 1 to n + 1 is d' + d, see `points`.

    Attributes
    ----------
    read, before : (P, m) flat, change of the point's gap by unit amplitudes, and of its
        gap two steps before
    push : (P, m) flat, change of amplitudes by the point's unit multiplier and friction
    opens, slides : (P, width) flat, rows that give d' + d of the gap, and of the casing
        relative to the tip along the rotation
    """

    read: Floats
    before: Floats
    push: Floats
    opens: Floats
    slides: Floats


class SectorRows(NamedTuple):
    """Coefficients like `PointRows` for equal sectors: by slot, for a tip's n_c points.

    k is the number of slots (nodal diameters), padded. Each slot has `single` waves,
    and `pairs` pairs of waves. The waves of a pair move the points with equal
    coefficients, so that only their sum is needed: gaps are sums over `alike` = single
    + pairs rows, (rows, 2, k) flat, re and im; d' + d as in `PointRows`.

    Attributes
    ----------
    read, slide : (n_c, alike, 2, k) flat, factors of waves or sums of pairs in gaps; of
        their d' + d in the motion along the casing. The force on a pair is the spectrum
        of the multipliers times conj(read + mu slide)
    push : (n_c, single, 2, k) flat, change of waves by the spectrum of the multipliers
    before : (n_c, waves, 2, k) flat, factors of waves in the gaps two steps before
    move : (alike, 2, k) flat, d' + d per unit amplitude of a wave; for a pair, that of
        its first wave, the conjugate of that of its second
    give : (2, pairs, 2, k) flat, change of the first waves of all pairs per unit force
        on the pair, then of the second waves; 0 where a pair has only one wave
    opens, slides : (P, padded) flat, d' + d per unit force: the last columns of
        `opens`, `slides` in `PointRows`
    turns, lanes : (N, 2 k) flat, cos and -sin at each blade; (N/4, 2 k, 4) flat, the
        same for groups of four blades
    each, single, pairs : n_c; numbers of waves and of pairs in a slot
    """

    read: Floats
    slide: Floats
    push: Floats
    before: Floats
    move: Floats
    give: Floats
    opens: Floats
    slides: Floats
    turns: Floats
    lanes: Floats
    each: int
    single: int
    pairs: int


class PointsRotor(NamedTuple):
    """Rotor and casing as waves, for P contact points, see `points`.

    There are m real amplitudes, re then im of all waves, each half padded; `width` as
    in `PointRows`.

    Attributes
    ----------
    ahead, drift : as in `WholeRotor`: (m,), re and im of z - 1, z the factor of an
        amplitude in a step; (m / 2,)
    rush : (P,), m/N, increase of the bound given by `drift` per unit multiplier
    rows : `PointRows` or `SectorRows`
    kick, kicked : (2, m), (2, width) flat, for unit cos and sin forces of the pulse:
        change of amplitudes; rows that give the motion over two steps, d' + d, on which
        these forces do work
    radial, along, hub : (P, m), (P, m), (2, m) flat, radial and tangential displacement
        of the points, and x_o, y_o, for unit amplitudes
    reach : (m / 2,), bound of any point's displacement for unit amplitudes
    pairs, form, split : (e, 2), (e,), J: indices and coefficients of the products of
        two amplitudes in the energy; the first `split` are the rotor's
    casing, shares : (c, 2), (c, 2), for each mode of the casing the indices of two
        amplitudes and their factors: the mode is the sum of the products
    """

    ahead: Floats
    drift: Floats
    rush: Floats
    rows: PointRows | SectorRows
    kick: Floats
    kicked: Floats
    radial: Floats
    along: Floats
    hub: Floats
    reach: Floats
    pairs: Integers
    form: Floats
    split: int
    casing: Integers
    shares: Floats


class PointsContact(NamedTuple):
    """Constants of the contact of P points.

    w, clear : (P, P), m/N, Delassus matrix as in `GeneralContact`; (2 wide,), m, folded
        clearances of the points beyond the gap
    waves : (n, 2, 2 wide) flat, cos and sin of the n harmonics of the casing's shape at
        the points
    """

    w: Floats
    clear: Floats
    waves: Floats


class PointsSpace(NamedTuple):
    """Work space of the kernel `points`; arrays not listed are as in `GeneralSpace`.

    spare : (width,), amplitudes before any force acts, then multipliers and pulse
    spectra : see `sectors.layout`
    solver : work space of `circulant`
    casing : (c,), modes of the casing, rotating frame
    """

    spare: Floats
    spectra: Floats
    before: Floats
    solver: ConstantSpace
    out: Floats
    again: Floats
    opened: Floats
    tips: Floats
    casing: Floats
    ledger: Floats
