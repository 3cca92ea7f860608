"""Types of the kernels' arguments and states, with shapes, units and frames.

Numba treats a NamedTuple like a tuple; a kernel unpacks it once, at its beginning.
The suffixes `_b` and `_c` are those of rotor (blades) and casing. There are N blades, k
slots (nodal diameters), and `wide` columns of the transform to gaps, see
`cyclic.widths`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from hpcwhirl.arrays import Floats, Integers


class Wall(NamedTuple):
    """The casing without elastic displacement: gap, and departure from the circle.

    The departure is a sum of harmonics in the static frame, those of a rigid casing's
    lobes and of the profile, w = (a cos h theta + b sin h theta) e^{sigma t}, outward,
    each faded in over its rise; see `shape.faded`.

    Attributes
    ----------
    gap : m, at the time `since`
    lobes : k, number of lobes of the pulse, and of a rigid casing
    orders : (n,), h; n = 0 for a round casing
    slots, signs : (n,), slot of each harmonic, and -1 where the slot has its conjugate,
        else 1, see `dynamics.slots.fold`
    cosine, sine : (n,), a and b, m
    growth, rise : (n,), sigma, 1/s; time of fading in, s, 0 for none
    room : m, least gap over all angles, once the shape has faded in
    since : s, start of the interval for which `gap`, `opening`, `ahead` and `bend` are
        valid, see `case.speed.Interval`
    opening : m/s, rate at which the gap grows
    ahead, bend : rad, rad/s^2, terms of the rotor's angle, see `contact.angle_at`
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
    """A pulse: amplitude, N; duration, s; modal forces (nc,) of 1 N on the casing."""

    force: float
    pulse: float
    modal: Floats


class Arrays(NamedTuple):
    """Constant arrays of a scheme's kernel, of types that depend on the scheme."""

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
    centre : (samples, 2), m, displacement of the shaft's centre, rotating frame
    energy, impulse, fed, lost : (samples,), J, N s, J, J, as in `history.History`
    tips, blade_impulse : (samples, N, 2), m; (samples, N), N s; (0, ...) if not kept
    rubbed : (samples,), J, cumulative work of friction
    casing : (samples, width), the scheme's casing coordinates; (0, width) if not kept
    evidence : (rows, COLUMNS), see `contact`; for a changing speed with the further
        columns of `verbs.note_beside`
    closed : (CLOSED,), J, the ledger at the last row of evidence, see `contact.CLOSED`
    worn : (samples, M), m, worn depth of each rod of a layer; (0, M) if not kept
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
    """State of rotor and casing in `bodies.march_bodies`.

    Attributes
    ----------
    q_b, d_b, q_c, d_c : amplitudes or coordinates, and increments in the last step
    loss_b, loss_c : damping losses so far, J
    gaps, older : (N,), m, gaps of the last step and of the step before it
    last : (N,), step of each tip's last contact
    counter, ledger : entries are named in `contact`
    impulse : (N,), N s, normal impulse on each tip so far
    worn : (3, M), for each rod of a layer: worn depth, m, work of wear, J, and work of
        the rotation on it, J; M is 0 without a layer
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
    rotor, ring : amplitudes, then their increments, those of even and those of odd
        steps, see `passes`; of waves see `waves` and `whole`
    lam : (4 k,), spectrum of the multipliers of the last step as (re, im), then as (im,
        -re). In `general` the rotor's modal forces (2 m,), normal and tangential, come
        before it, in `whole` the array `held` of `whole.push_waves`; in `points` lam is
        `held` alone
    gaps : (3, 2 wide) flat, m, folded gaps of three steps, step n in row n % 3; in
        `whole` without the rotor's displacement, in `points` the clearances alone
    sums_b : (6 k,), works and losses by slot, see `differences.pass_modes`; in
        `general` (3 m,), in `whole` and `points` (3,), see `whole.push_waves`
    sums_c : (4 k,), the same for the ring; the fourth part is used by `flow`
    known : (N + 3 + CHANGES,), active blades of the last solution, see `ConstantSpace`
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
    """How a casing's ring is discretised.

    kind : RIGID, ELEMENTS or WAVES, see `contact`
    size : number of elements, or highest harmonic
    length : m, of an element
    """

    kind: int
    size: int
    length: float


# (name of an array, the array, number of values that it must have), for each array
Wanted = list[tuple[str, Floats | Integers, int]]
