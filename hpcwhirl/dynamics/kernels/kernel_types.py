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
    slots, signs : (n,), where they lie beside the rotor's nodal diameters, see
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
    worn : (3, M), of each rod of a layer: worn depth, m, work of wear, J, and the part
        of it by cutting, J; M is 0 without layer
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
    lam : (4 k,), spectrum of the multipliers of the last step, then (im, -re) of it;
        of `general` behind the rotor's modal forces (2 m,), normal and tangential, or,
        of `whole`, (HELD padded,), what blades in contact slip and when they were, see
        `whole.push_waves`
    gaps : (3, 2 wide) flat, folded, of three steps; of `whole` without the rotor's part
    sums_b, sums_c : by column, (6 k,), of `general` (3 m,), and (4 k,), see `passes`;
        of `whole` (3,)
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
    """Kind of a casing (`contact`), its elements or harmonics, element length, m."""

    kind: int
    size: int
    length: float


class Points(NamedTuple):
    """Where contact points stand, blade by blade; N of them.

    Attributes
    ----------
    angle, turn : (N,), beyond blade 0's angle: rad; of a turn
    gap : (N,), m, clearance beyond that of the scene
    weight : (N, L), by which they read the casing's axial functions
    """

    angle: Floats
    turn: Floats
    gap: Floats
    weight: Floats


class Layer(NamedTuple):
    """Rods of a layer that wears, all alike; see `layer`.

    Attributes
    ----------
    flex : m/N, of the elastic rod
    soft, rub : wear of a step by force beyond the limit, m/N; that per rad/s of the
        speed, m s/(N rad)
    limit, growth : N, of a rod as made; N/m, by which wear raises it
    under : number of rods under the edge of a tip
    """

    flex: float
    soft: float
    rub: float
    limit: float
    growth: float
    under: int


class LayerSpace(NamedTuple):
    """Work space of `layer`.

    Attributes
    ----------
    rod, left : (N,), first rod under each tip at the end and at the start of a step
    sunk : (N,), m, depth s of tips below the surface as made
    give, shifted : (N,), m/N and m, 1 / P' and the gaps of the linear problem
    w : (N, N), m/N, W of the rotor with the rods
    """

    rod: Integers
    left: Integers
    sunk: Floats
    give: Floats
    shifted: Floats
    w: Floats


class Contact(NamedTuple):
    """W of the rotor (N, N) and compliance (R, R), m/N; the ring; the lost blade.

    points : where they stand
    layer : on the casing; not read where the state has no rods
    """

    w_rotor: Floats
    compliance: Floats
    ring: Ring
    lost: int
    points: Points
    layer: Layer


class ContactSpace(NamedTuple):
    """Work space of `contact.complementarity`.

    Attributes
    ----------
    response : (R,), m/N
    w : (N, N), W transposed, m/N
    have : (N,), whether a row of `w` is known
    small, right : (N, N + 1), (N,), matrix and right side of the equations of the
        active blades; the latter becomes their multipliers
    active, where : (N,), whether a blade is active; (N + 1,), the active blades
    chosen, held, left : (N,), (N,), (N + 1,), used only by `lemke`
    """

    response: Floats
    w: Floats
    have: Integers
    small: Floats
    right: Floats
    active: Integers
    where: Integers
    chosen: Integers
    held: Integers
    left: Integers


class ConstantSpace(NamedTuple):
    """Work space of `circulant`, padded to vectors.

    Attributes
    ----------
    push : (padded,), multipliers of the active blades, N
    known : (N + 3 + CHANGES,), in the state: the blades of the last solution; their
        number, whether their inverse is sound, how many changes were made to it since
        blades were inverted, and these changes, see `keep_inverse`
    inverse : (padded, padded) flat, of the W of those
    rows : (N, 2 wide) flat, what each blade's multiplier opens, folded, m/N
    where : (N + 1,), the active blades
    fallback, near, lam, opened : of `contact.complementarity`, and its arguments
    work : (4 padded,), of `keep_inverse`
    again : (2 wide,), folded gaps that the multipliers leave, m
    symbol, wave : of a circulant W: its spectrum (2 k,), m/N, twice over N, but once of
        simple slots; of `passes.to_gaps`. Both empty where W is not, or is not split
    spectrum, spread : (4 k,), of many multipliers, then of what they open, and work
        space of `transform.to_slots`, or empty
    """

    push: Floats
    known: Integers
    inverse: Floats
    rows: Floats
    where: Integers
    fallback: ContactSpace
    near: Floats
    lam: Floats
    opened: Floats
    work: Floats
    again: Floats
    symbol: Floats
    wave: Floats
    spectrum: Floats
    spread: Floats


class ModalBody(NamedTuple):
    """A body as modes, see `timestep.recursion`.

    Attributes
    ----------
    keep, pull, give, rate, omega : (m,)
    read : (m, r), radial coordinates from modes; of the rotor: tips, then x_o, y_o
    radial, tangential : (r, m), coordinates on which multipliers act; of the rotor:
        tips
    """

    keep: Floats
    pull: Floats
    give: Floats
    rate: Floats
    omega: Floats
    read: Floats
    radial: Floats
    tangential: Floats


class Stand(NamedTuple):
    """Forces of supports at the centre beyond constant matrices, see `standing`.

    Attributes
    ----------
    hub : (2, n), x_o and y_o from a body's coordinates; (0, 0) without such forces
    moved : (2, n), change of d' by a unit force at x_o, y_o
    give : (2, 2), change of d' of x_o, y_o themselves
    stiffness, damping : k_d, N/m; c_d, N s/m
    speed, step : Omega, rad/s; dt, s
    film, clearance : c_0, N s/m, and c, m, of a squeeze film; 0, 1 if there is none
    circle : z_s, m, of an unbalanced rotor, about which the film force is taken
    """

    hub: Floats
    moved: Floats
    give: Floats
    stiffness: complex
    damping: complex
    speed: float
    step: float
    film: float
    clearance: float
    circle: complex


class CoupledBody(NamedTuple):
    """A rotor's modes that are coupled by its rotation, see `turning`.

    Attributes
    ----------
    keep, pull, give, stiffness, damping, push : blocks of each diameter, one after the
        other, each by columns, flat
    starts : (b + 1,), the first mode of each block, and m
    own : number of modes that move; further ones represent an unbalanced rotor's circle
    read : (m, N + 2), radial coordinates from modes: tips, then x_o, y_o
    radial, tangential : (N, m), motion of the tips from modes
    stand : forces of supports beyond constant matrices
    """

    keep: Floats
    pull: Floats
    give: Floats
    stiffness: Floats
    damping: Floats
    push: Floats
    starts: Integers
    own: int
    read: Floats
    radial: Floats
    tangential: Floats
    stand: Stand


class DrivenBody(NamedTuple):
    """A `CoupledBody` whose speed changes, see `dynamics.varying`.

    The `own` first modes have the motion y that contact causes, the further ones, in
    blocks that are the same, that without contact.

    Attributes
    ----------
    swerve : blocks of (dOmega/dt) C, as `keep`
    force : (m,), N/sqrt(kg), of unbalance and changing speed, 0 on the first modes
    work : (m,), N/sqrt(kg), of `force` and `swerve` in the present step: work space
    alike : (m - own,), the first modes that the further ones repeat
    blocks : b, number of blocks of the first modes
    """

    keep: Floats
    pull: Floats
    give: Floats
    stiffness: Floats
    damping: Floats
    push: Floats
    starts: Integers
    own: int
    read: Floats
    radial: Floats
    tangential: Floats
    stand: Stand
    swerve: Floats
    force: Floats
    work: Floats
    alike: Integers
    blocks: int


class DenseBody(NamedTuple):
    """A body as matrices (n, n), each stored transposed, A = M/dt^2 + D/2dt.

    Attributes
    ----------
    keep, pull, inverse : A^-1 (M/dt^2 - D/2dt), A^-1 K, A^-1
    mass, stiffness, damping : M, K, D
    push : S (n, n), circulatory; (0, 0) for a body without it
    stand : forces of supports beyond constant matrices
    radial, tangential, centre : indices of coordinates; the last of x_o, y_o, if any
    """

    keep: Floats
    pull: Floats
    inverse: Floats
    mass: Floats
    stiffness: Floats
    damping: Floats
    push: Floats
    stand: Stand
    radial: Integers
    tangential: Integers
    centre: Integers


class CyclicRotor(NamedTuple):
    """Packed items (ITEMS size,), `passes`; hub (2, size), x_o, y_o; size 2 k rows."""

    items: Floats
    hub: Floats


class WaveRotor(NamedTuple):
    """A rotor as waves, see `waves`; k slots, rows of amplitudes.

    Attributes
    ----------
    items, fixed : (ITEMS rows k,), (FIXED k,), of waves and of slots
    hub : (2, 2 rows k), x_o, y_o of re and im of the amplitudes
    form : (rows (rows + 1) k,), J: for each row the energy with itself and the rows
        after it, re and im of each slot
    along : (2 rows k,), negative tangential displacement of the tip due to the waves,
        re and im of each slot
    """

    items: Floats
    fixed: Floats
    hub: Floats
    form: Floats
    along: Floats


class CyclicCasing(NamedTuple):
    """Coefficients of a casing in slots.

    items : (ITEMS ring_size,), see `differences`
    sign : of the load's harmonic in its slot, as in `dynamics.slots`
    """

    items: Floats
    sign: float


class CyclicContact(NamedTuple):
    """W to blade 0 (N,), m/N; turns (N, 2 k), flat; wave: `passes.to_gaps`; flight."""

    column: Floats
    turns: Floats
    wave: Floats
    flight: Any


class GeneralRotor(NamedTuple):
    """A rotor as real modes, see `general`; displacements of tips have negative sign.

    Attributes
    ----------
    items : (ITEMS m,), see `passes`; one mode is a column
    read : (2 wide / 8, m, 8) flat, radial displacements of folded blades
    radial, tangential : (N, m) flat, of each tip
    hub : (2, m) flat, x_o, y_o
    reach : (m,), |tangential| of the tip that each mode moves most
    """

    items: Floats
    read: Floats
    radial: Floats
    tangential: Floats
    hub: Floats
    reach: Floats


class WholeRotor(NamedTuple):
    """A rotor of unequal sectors as waves, see `whole`; tips have negative sign.

    There are m real amplitudes, re then im of the waves, each half padded; `padded` is
    N, padded.

    Attributes
    ----------
    ahead : (m,), re and im of z - 1
    drift : (m / 2,), bound of the motion of any tip in a step, per unit amplitude
    read : (N, m) flat, like `radial`, but a lost blade is at `bodies.NOWHERE`
    radial, tangential, hub, reach : as in `GeneralRotor`
    push : (N, m) flat, beta: change of amplitudes by a unit multiplier and its friction
    opens, slides : (N, m + padded) flat: d' + d of a tip's radial and of its tangential
        displacement, from amplitudes after a step without contact and from multipliers
    ring : (N, 2 wide) flat, folded: change of gaps by a unit multiplier due to the ring
        only, m/N
    form : energy q^T form q, J: upper triangle by rows, each beginning at a multiple of
        4
    """

    ahead: Floats
    drift: Floats
    read: Floats
    radial: Floats
    tangential: Floats
    hub: Floats
    reach: Floats
    push: Floats
    opens: Floats
    slides: Floats
    ring: Floats
    form: Floats


class UncoupledRotor(NamedTuple):
    """A rotor of unequal sectors as waves, one a mode, see `whole`; as `WholeRotor`.

    Tips read the real parts of the m amplitudes alone; m is padded.

    Attributes
    ----------
    ahead : (2 m,), re and im of z - 1
    drift, reach : (m,), as of `WholeRotor`
    read, radial, tangential, hub : (N, m) flat, (2, m) flat, of real parts
    push : (N, m) flat, modal forces of a unit multiplier and its friction
    gives : (2 m,), what a unit modal force adds to re and im
    moves : (2 m,), d' + d of re and im, of amplitudes after a step without contact
    opens, slides : (N, m + padded) flat, of d' + d of the modes and of multipliers
    ring : as of `WholeRotor`
    form : (3 m,), J: the energy's factors of re^2, 2 re im, im^2
    """

    ahead: Floats
    drift: Floats
    read: Floats
    radial: Floats
    tangential: Floats
    hub: Floats
    reach: Floats
    push: Floats
    gives: Floats
    moves: Floats
    opens: Floats
    slides: Floats
    ring: Floats
    form: Floats


class PointRows(NamedTuple):
    """What each of P contact points reads of m amplitudes, and does to them.

    `width` is m and P + 2 forces, padded: multipliers, and cos and sin of the pulse.

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
    """The same of equal sectors, by slots k: a spectrum for each of n_c points.

    A slot, of one nodal diameter, has `single` waves and `pairs` of waves that points
    read alike; the latter are `alike` = single + pairs rows. Rows are (rows, 2, k)
    flat, re and im.

    Attributes
    ----------
    read, slide : (n_c, alike, 2, k) flat: gaps from waves or from sums of a pair, and
        motion along the casing from their d' + d; forces on a pair are conjugates of
        their sum, with friction
    push : (n_c, single, 2, k) flat, change of waves by the spectrum of the multipliers
    before : (n_c, waves, 2, k) flat, gaps two steps before
    move : (alike, 2, k) flat, d' + d of waves, of a pair of its first: those of the
        other are conjugates
    give : (2, pairs, 2, k) flat, change of the first of pairs by these forces, then of
        the second; 0 for a wave without one
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
    rush : (P,), what a unit multiplier adds to that bound
    rows : `PointRows` or `SectorRows`
    kick, kicked : (2, m), (2, width) flat, change of amplitudes by the pulse's cos and
        sin, and d' + d of its places
    radial, along, hub : (P, m), (P, m), (2, m) flat, displacements of the tips, x_o,
        y_o
    reach : (m / 2,), bound of any point's displacement by unit amplitudes
    pairs, form, split : (e, 2), (e,), entries of the energy, J: `split` of the rotor,
        then those of the casing
    casing, shares : (c, 2) each, amplitudes that each mode of the casing is made of
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


class GeneralContact(NamedTuple):
    """W (N, N), m/N, column j: gaps opened by blade j; turns, wave as in `cyclic`."""

    w: Floats
    turns: Floats
    wave: Floats


class GeneralSpace(NamedTuple):
    """Work space of the general kernel.

    Attributes
    ----------
    spare : (m,), used by the rotor's pass
    spectrum : (2 k,), spectrum of the gaps, without the rotor's part
    slip_b, slip_c : (2 m,), (2 k,), see `general.note_slips`
    before : (N,), m, gaps before contact
    contact : work space of `circulant`
    rotor, ring, sums_b, sums_c : as in the state, with the pending step completed
    wall : (2 k,), spectrum of a rigid casing, set in each sample
    out, again : (2 wide,), folded: tips with negative sign, and gaps, m
    tips : (N + 1, 2), m; a row of `Tracks.tips`, then x_o, y_o
    ledger : ledger with all works entered, J
    opened : (2 wide,), for waves: solved gaps, or lower bounds where tips are not read
    """

    spare: Floats
    spectrum: Floats
    slip_b: Floats
    slip_c: Floats
    before: Floats
    contact: ConstantSpace
    rotor: Floats
    ring: Floats
    sums_b: Floats
    sums_c: Floats
    wall: Floats
    out: Floats
    again: Floats
    tips: Floats
    ledger: Floats
    opened: Floats


class SampleSpace(NamedTuple):
    """Work space of `samples.sample_rotor`.

    Attributes
    ----------
    rotor, ring, sums_b, sums_c : as in the state, with the pending step completed
    columns, wall : (2 k,), spectra of the tips, and of a rigid casing, set in each
        sample
    tips : (N + 1, 2), m; a row of `Tracks.tips`, then x_o, y_o
    ledger : ledger with all works entered, J
    again : (2 wide,), gaps, m
    """

    rotor: Floats
    ring: Floats
    sums_b: Floats
    sums_c: Floats
    columns: Floats
    tips: Floats
    ledger: Floats
    again: Floats
    wall: Floats


# of arrays, (name, array, values that it must have)
Wanted = list[tuple[str, Floats | Integers, int]]


class Sizes(NamedTuple):
    """Blades N, rows of rotor and ring, slots k, columns `wide` of the transform."""

    blades: int
    rows: int
    ring_rows: int
    k: int
    wide: int


class CyclicSpace(NamedTuple):
    """Work space of the cyclic kernel.

    Attributes
    ----------
    out_b, out_c, spectrum : (2 k,), spectra of rotor, ring and gaps
    rates : (2 wide,), m/s, rates of the gaps
    slips : (4 k,) of the rotor, (2 k,) of the ring, see `passes.slip_of`
    between : spectra of rotor and ring in copies of a state within a jump
    before : (N,), m, gaps before contact
    sample, contact : work space of `samples` and `circulant`
    aside : for the exact flow, a state with copies of what a jump changes
    seen, skipped : (8 k + 8,), (3,), see `skipped`
    """

    out_b: Floats
    out_c: Floats
    spectrum: Floats
    rates: Floats
    slips: tuple[Floats, Floats]
    between: tuple[Floats, Floats]
    before: Floats
    sample: SampleSpace
    contact: ConstantSpace
    aside: CyclicState
    seen: Floats
    skipped: Integers


class Flight(NamedTuple):
    """Arrays for the jumps of the exact scheme, see `flight`.

    Attributes
    ----------
    total : number of steps of the run
    certifiable : whether a certificate is possible
    counts : (P,), steps of the jumps; the last is the number between rows of evidence
    jumps_b, jumps_c : (P, JUMP_ITEMS size), (P, JUMP_ITEMS ring_size)
    bounds_b, bounds_c : (BOUND_ITEMS size,), (BOUND_ITEMS ring_size,); for a rotor's
        waves see `waves`
    """

    total: int
    certifiable: bool
    counts: Integers
    jumps_b: Floats
    jumps_c: Floats
    bounds_b: Floats
    bounds_c: Floats
