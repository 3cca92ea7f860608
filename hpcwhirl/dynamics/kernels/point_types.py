"""Types of arguments of the kernel of several contact points a tip."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.dynamics.kernels.body_types import ConstantSpace

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class PointRows(NamedTuple):
    """Rows by which each of P contact points reads m amplitudes and acts on them.

    `width` is m + P + 2, padded: amplitudes, multipliers, cos and sin of the pulse.

    Attributes
    ----------
    read, before : (P, m) flat, change of gaps, now and two steps before
    push : (P, m) flat, change of amplitudes by unit forces, with friction
    opens, slides : (P, width) flat: d' + d of the gaps, and of the casing relative to
        the tip along the rotation
    """

    read: Floats
    before: Floats
    push: Floats
    opens: Floats
    slides: Floats


class SectorRows(NamedTuple):
    """Rows as `PointRows`, for equal sectors: a spectrum of k slots for each point.

    A slot, of one nodal diameter, has `single` waves and `pairs` of waves that points
    read alike. A pair has one row, so that `alike` = single + pairs rows are read. Rows
    are (rows, 2, k) flat, re and im. A tip has n_c points.

    Attributes
    ----------
    read, slide : (n_c, alike, 2, k) flat: gaps from waves or from sums of a pair, and
        motion along the casing from their d' + d; forces on a pair are conjugates of
        their sum, with friction
    push : (n_c, single, 2, k) flat, change of waves by the spectrum of the multipliers
    before : (n_c, waves, 2, k) flat, gaps two steps before
    move : (alike, 2, k) flat, d' + d of waves; of a pair, that of its first wave, of
        which the second has the conjugate
    give : (2, pairs, 2, k) flat, change of the first wave of each pair by the forces on
        it, then of the second; 0 where a row has a wave without a second
    opens, slides : (P, padded) flat, d' + d by forces, as the last of `PointRows`
    turns : (N, 2 k) flat, cos and -sin; lanes : the same of four blades, (N/4, 2 k, 4)
    each, single, pairs : n_c, and numbers of rows
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
    """Both bodies as waves, for P contact points, see `points`.

    There are m real amplitudes, re then im of all waves, each half padded; `width` as
    in `PointRows`.

    Attributes
    ----------
    ahead, drift : (m,), re and im of z - 1; (m / 2,), as of `WholeRotor`
    rush : (P,), what a unit multiplier adds to the bound by `drift`
    rows : `PointRows` or `SectorRows`
    kick, kicked : (2, m), (2, width) flat, change of amplitudes by the pulse's cos and
        sin, and d' + d of the displacements on which these act
    radial, along, hub : (P, m), (P, m), (2, m) flat, displacements of the tips, x_o,
        y_o
    reach : (m / 2,), bound of any point's displacement by unit amplitudes
    pairs, form, split : (e, 2), (e,), entries of the energy, J: `split` of the rotor,
        then those of the casing
    casing, shares : (c, 2), (c, 2), indices and factors of the amplitudes whose sum is
        each mode of the casing
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
    """W (P, P) as in `GeneralContact`; clearances (2 wide,) beyond the gap, folded.

    waves : (n, 2, 2 wide) flat, cos and sin of the shape's harmonics at the points
    """

    w: Floats
    clear: Floats
    waves: Floats


class PointsSpace(NamedTuple):
    """Work space of the kernel `points`; as in `GeneralSpace`.

    spare : (width,), amplitudes before any force, and forces
    spectra : of `sectors`
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
