"""Arguments and states of kernels: each array once, with shape, unit and frame.

Numba treats a NamedTuple like a tuple; a kernel unpacks it once, at its beginning.
There are N blades, bodies `b` (rotor) and `c` (casing), and k slots, see
`cyclic.widths`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class Wall(NamedTuple):
    """Where a casing stands at rest: the gap, and how its shape departs from round.

    The shape is the sum of harmonics in the static frame, of a rigid casing's lobes and
    of the profile, each w = (a cos h theta + b sin h theta) e^{sigma t}, outward, with
    its rise; see `shape.faded`.

    Attributes
    ----------
    gap : m, at the time `since`
    lobes : k, also of the loading
    orders : (n,), h; none of a round casing
    slots, signs : (n,), slots in which they are, as the rotor's nodal diameters, see
        `slots.fold`
    cosine, sine : (n,), a and b, m
    growth, rise : (n,), sigma, 1/s; s
    room : m, least gap over all angles, once the shape has faded in
    since : s, time from which on the next three hold, see `dynamics.varying`
    opening : m/s, at which the gap grows
    ahead, bend : rad, rad/s^2, of the angle of the rotor, see `contact.angle_at`
    """

    gap: float
    lobes: int
    orders: Integers
    slots: Integers
    signs: Floats
    cosine: Floats
    sine: Floats
    growth: Floats
    rise: Floats
    room: float
    since: float = 0.0
    opening: float = 0.0
    ahead: float = 0.0
    bend: float = 0.0


class Load(NamedTuple):
    """A pulse: F, N; tau, s; the casing's modal load due to a unit force, (nc,)."""

    force: float
    pulse: float
    modal: Floats


class Arrays(NamedTuple):
    """Constant arrays of a scheme's kernel; their types depend on the scheme."""

    load: Load
    rotor: Any
    casing: Any
    contact: Any


class Strides(NamedTuple):
    """Steps between samples of the traces, and between rows of the evidence."""

    traces: int
    evidence: int


class Tracks(NamedTuple):
    """Samples and rows of evidence that a march writes.

    Attributes
    ----------
    centre : (samples, 2), m, rotating frame
    energy, impulse, fed, lost : (samples,), J, N s, J, J
    tips, blade_impulse : (samples, N, 2), m; (samples, N), N s; no rows if not kept
    rubbed : (samples,), J, cumulative work of friction
    casing : (samples, width), coordinates of the scheme; no rows if not kept
    evidence : (rows, COLUMNS), see `contact`; or more, see `verbs.note_beside`
    closed : (CLOSED,), J, the ledger at the last row of evidence
    worn : (samples, M), m, depth of each rod of a layer; no rows if not kept
    """

    centre: Floats
    energy: Floats
    impulse: Floats
    fed: Floats
    lost: Floats
    tips: Floats
    blade_impulse: Floats
    rubbed: Floats
    casing: Floats
    evidence: Floats
    closed: Floats
    worn: Floats


class BodiesState(NamedTuple):
    """State of `bodies.march_bodies`.

    Attributes
    ----------
    q_b, d_b, q_c, d_c : amplitudes or coordinates and their last increments
    loss_b, loss_c : damping losses, J
    gaps, older : (N,), m, of the last two steps
    last : (N,), steps of last contacts
    counter, ledger : see `contact`
    impulse : (N,), N s
    worn : (3, M), of each rod of a layer: worn depth, m, work of wear, J, and work of
        the rotation on it, J; M is 0 without layer
    """

    q_b: Floats
    d_b: Floats
    q_c: Floats
    d_c: Floats
    loss_b: Floats
    loss_c: Floats
    gaps: Floats
    older: Floats
    last: Integers
    counter: Integers
    ledger: Floats
    impulse: Floats
    worn: Floats


class CyclicState(NamedTuple):
    """State of the kernels `cyclic` and `general`, in the rotating frame.

    Attributes
    ----------
    rotor, ring : amplitudes, and their increments in two places, see `passes`
    lam : (4 k,), spectrum of the multipliers of the last step, then its (im, -re); in
        `general` after the rotor's modal forces (2 m,), normal and tangential; in
        `whole` after `held` of `whole.push_waves`; in `points` only `held`
    gaps : (3, 2 wide) flat, folded, of three steps; of `whole` without the rotor's part
    sums_b : (6 k,), by column, see `passes`; of `general` (3 m,), of `whole` (3,)
    sums_c : (4 k,), by column, see `passes`
    known : (N + 3 + CHANGES,), blades of the last solution, see `ConstantSpace`
    last, counter, ledger, impulse : as in `BodiesState`
    """

    rotor: Floats
    ring: Floats
    lam: Floats
    gaps: Floats
    sums_b: Floats
    sums_c: Floats
    known: Integers
    last: Integers
    counter: Integers
    ledger: Floats
    impulse: Floats


class Ring(NamedTuple):
    """Kind of a casing's ring.

    kind, size : kind, see `contact`; number of elements, or highest harmonic
    length : m, of an element
    """

    kind: int
    size: int
    length: float


# of arrays, (name, array, values that it must have)
Wanted = list[tuple[str, Floats | Integers, int]]
