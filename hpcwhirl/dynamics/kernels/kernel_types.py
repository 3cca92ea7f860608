"""Types of the kernels' arguments and states, with shapes, units and frames.

Numba treats a NamedTuple like a tuple; a kernel unpacks it once, at its beginning. The
suffixes `_b` and `_c` are those of rotor (blades) and casing. There are N blades and k
slots, one for each nodal diameter, padded; arrays of all gaps in folded order are (2
wide,), see `loop.circulant.folded` and `vectors.widths`. Types of the loop `bodies`,
whose casing is in the static frame, come last.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from hpcwhirl.arrays import Complexes, Floats, Integers
from hpcwhirl.errors import ModelError


class Wall(NamedTuple):
    """The casing without elastic motion: clearance, and departure from the circle.

    The departure is a sum of harmonics in the static frame, those of a rigid casing's
    lobes and of the profile, w = (a cos h theta + b sin h theta) e^{sigma t}, outward,
    each faded in over its rise; see `shape.faded`.

    Attributes
    ----------
    gap : m, clearance of undeformed tips in a round casing, at the time `since`
    lobes : k, number of lobes of the pulse, and of a rigid casing
    orders : (n,), h; n = 0 for a round casing
    slots, signs : (n,), slot (nodal diameter) of each harmonic, and -1 where the slot
        has its conjugate, else 1, see `dynamics.waves.slots.fold`
    cosine, sine : (n,), a and b, m
    growth, rise : (n,), sigma, 1/s; time of fading in, s, 0 for none
    room : m, least clearance over all angles, once the shape has faded in
    since : s, start of the interval for which `gap`, `opening`, `ahead` and `bend` are
        valid, see `case.speed.Interval`
    opening : m/s, rate at which the clearance grows
    ahead, bend : rad, rad/s^2, terms of the rotor's angle, see `contact.angle_at`
    lag, hurry : rad/s, rad/s^2, terms of its speed, see `contact.slides_at`
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
    lag: float = 0.0
    hurry: float = 0.0


class Load(NamedTuple):
    """A pulse of force on the casing, with lobes around the circumference.

    Attributes
    ----------
    force, pulse : amplitude, N; duration, s
    modal : (modes,), forces on the casing's modes by a unit force
    """

    force: float
    pulse: float
    modal: Floats


class Arrays(NamedTuple):
    """The constant arrays that a scheme's kernel gets, as one argument.

    Attributes
    ----------
    load : pulse on the casing
    rotor, casing, contact : coefficients of the bodies and of their contact, of types
        that depend on the scheme; see `wave_types` and the types below
    """

    load: Load
    rotor: Any
    casing: Any
    contact: Any


class Strides(NamedTuple):
    """Steps between two samples of the traces, two rows of evidence, two kept states.

    Without kept states the last one is not used.
    """

    traces: int
    evidence: int
    states: int = 1


class Tracks(NamedTuple):
    """The output arrays of a march: samples of the traces, and rows of evidence.

    Attributes
    ----------
    centre : (samples, 2), m, displacement of the shaft's centre, rotating frame
    energy, impulse, fed, lost : (samples,): energy of both bodies, J; normal impulse so
        far, N s; work of rotation and friction so far, J; losses so far, J
    tips, blade_impulse : (samples, N, 2), m, radial and tangential, rotating frame;
        (samples, N), N s; (0, ...) if not kept
    rubbed : (samples,), J, cumulative work of friction
    casing : (samples, width), the `width` scheme's casing coordinates; (0, width) if
        not kept
    evidence : (rows, COLUMNS), see `contact`; for a changing speed with the further
        columns of `oracle.body.note_beside`
    closed : (CLOSED,), J, the ledger at the last row of evidence, see `contact.CLOSED`
    worn : (samples, rods), m, worn depth of each rod of a layer; (0, rods) if not kept
    states : (rows, width + 2), the rotor's part of the state at the last steps that are
        multiples of `Strides.states`, of which number i is in row i % rows; with it the
        impulses IMPULSE and TANGENTIAL of the ledger; (0, ...): not kept
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
    states: Floats


class BodiesState(NamedTuple):
    """State of rotor and casing in the time loop `oracle.bodies.march_bodies`.

    Attributes
    ----------
    q_b, d_b, q_c, d_c : of rotor (b) and casing (c): modal amplitudes or coordinates,
        and their increments in the last step
    loss_b, loss_c : damping losses so far, J
    gaps, older : (N,), m, gaps of the last step and of the step before it
    last : (N,), number of the step of each tip's last contact
    counter, ledger : counters of the march; account of works, J: entries are named in
        `contact`
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
    """State of rotor and casing in the kernel `points`.

    Amplitudes are in the rotating frame. There are k slots, one for each nodal
    diameter, padded. Folded arrays, (2 wide,), list all blades in the order of
    `loop.circulant.folded`.

    Attributes
    ----------
    rotor : waves of both bodies, after them what their rows need of earlier steps
    ring : nothing; the waves of the casing are in `rotor`
    lam : (2 k,), N, spectrum of the multipliers of the last step, re, then im; by
        points the array `held` of `loop.point_rows.book_points`
    gaps : (3, 2 wide) flat, m, folded gaps of three steps, step n in row n % 3; by
        points the clearances alone
    sums_b : J, works and losses, see `loop.slots.pass_slots` and
        `loop.point_rows.book_points`
    sums_c : J, by slot first the energy that start, pulse and intervals of speed have
        given, then `loop.slots.TURNING`
    known : (N + 3 + CHANGES,), blades in contact in the last solution, see
        `ConstantSpace`
    last, counter, ledger, impulse, worn : as in `BodiesState`
    entered : (N,), m, gaps after the last step to the unworn surface of a layer, where
        a tip is below it, else 0; (0,) without a layer
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
    worn: Floats
    entered: Floats


class Ring(NamedTuple):
    """How the ring of a casing is discretised.

    Attributes
    ----------
    kind : RIGID, ELEMENTS or WAVES, see `contact`
    size : number of elements, or highest harmonic
    length : m, of an element
    """

    kind: int
    size: int
    length: float


# (name of an array, the array, number of values that it must have), for each array
Wanted = list[tuple[str, Floats | Integers, int]]


def check_sizes(kernel: str, wanted: Wanted) -> None:
    """Raise ModelError if an array of a time loop, which reads unchecked, is wrong.

    kernel : name of the loop's rows, for the message
    wanted : the arrays, with the numbers of values that they must have
    """
    for name, values, size in wanted:
        if values.size != size:
            msg = f"{name} of the kernel of {kernel}: {values.size} values, not {size}"
            raise ModelError(msg)


def check_places(kernel: str, size: int, places: dict[str, Integers]) -> None:
    """Raise ModelError if an index into the amplitudes of a time loop is outside them.

    kernel, size : as in `check_sizes`; number of amplitudes
    places : indices by name
    """
    for name, values in places.items():
        if values.size and not 0 <= values.min() <= values.max() < size:
            found = f"{values.min()} to {values.max()}, not 0 to {size - 1}"
            msg = f"{name} of the kernel of {kernel}: {found}"
            raise ModelError(msg)


NOTHING, NO_MODES = np.zeros(0), np.zeros(0, dtype=np.int64)
WEIGHTLESS = np.zeros((2, 0))


class Points(NamedTuple):
    """Positions and clearances of N contact points, blade by blade.

    Attributes
    ----------
    angle, turn : (N,), angle from blade 0 to the point, in rad and in turns
    gap : (N,), m, clearance beyond that of the scene
    weight : (N, L), values of the casing's L axial functions at the points
    """

    angle: Floats
    turn: Floats
    gap: Floats
    weight: Floats


class Layer(NamedTuple):
    """Rods of a layer that wears, all alike; see `layer`.

    Attributes
    ----------
    flex : m/N, elastic compliance of a rod
    soft, rub : m/N, wear in a step per force beyond the limit; m s/(N rad), increase of
        `soft` per rad/s of the rotor's speed
    limit, growth : N, force above which an unworn rod wears; N/m, its rise with wear
    under : number of rods under the edge of a tip
    """

    flex: float
    soft: float
    rub: float
    limit: float
    growth: float
    under: int


class Rods(NamedTuple):
    """A layer that wears, as a term of the time loop `points`, for N tips.

    Without a layer all arrays are empty.

    Attributes
    ----------
    layer : the rods
    angle : (N,), rad, of the tips from blade 0, as in `Points`
    w : (N, N), m/N, Delassus matrix of both bodies; entry [i, j]: opening of gap i by a
        unit multiplier on tip j
    none, places, shape : (0, 0), (N, 0), (N, 0): the casing has no further part in it,
        see `compliance`, `index` and `shape` of `contact.delassus_row`
    """

    layer: Layer
    angle: Floats
    w: Floats
    none: Floats
    places: Integers
    shape: Floats


class LayerSpace(NamedTuple):
    """Work arrays of the functions in `layer`, for N tips.

    Attributes
    ----------
    rod, left : (N,), first rod under each tip at the end and at the start of a step
    high, sunk : (N,), m, worn depth of the least worn rod under each tip; depth s of
        tips below the unworn surface
    give, shifted : (N,), m/N and m: 1 / (dP/ds), P(s) being the force on a tip; gaps of
        the linearised problem
    alike : (N,), m, range around `sunk` within which dP/ds is the same
    soft : (N,), m/N, wear of a rod under each tip in a step per force beyond the limit
    w : (N, N), m/N, `w_rotor` of `layer.press_any` plus diag(give)
    springs : (N, `layer.row_of_springs`) flat, m/N: W of the tips that press plus
        diag(give), and the right side of their equations, m
    """

    rod: Integers
    left: Integers
    high: Floats
    sunk: Floats
    give: Floats
    shifted: Floats
    alike: Floats
    soft: Floats
    w: Floats
    springs: Floats


class Coulomb(NamedTuple):
    """Set-valued friction of N contact points, see `coulomb`; empty: permanent sliding.

    Attributes
    ----------
    friction, at_rest : mu of sliding; without sliding
    decay : m/s, sliding speed by which mu falls from one to the other; 0: constant mu
    radius : m, R, at which tips slide with the rotation
    rotor : (2 N, 2 N), m/N; row j, N + j: what a unit multiplier, a unit of friction on
        tip j adds to all gaps, then to all slides, by the rotor's motion; in the loop
        of waves by that of both bodies
    ring : (0, 0), or (2 R, 2 R), m/N; row i, R + i: displacements of the ring's R
        radial, then R tangential coordinates by a unit force on radial, on tangential
        coordinate i
    table : (2 K,), m/s, K ascending sliding speeds, then mu at each; empty: by decay
    always : whether each step needs its tips' slides, since friction or wear depends on
        them
    """

    friction: float
    at_rest: float
    decay: float
    radius: float
    rotor: Floats
    ring: Floats
    table: Floats
    always: bool


class CoulombSpace(NamedTuple):
    """Work arrays of set-valued friction, `coulomb.rub`, for N contact points.

    Attributes
    ----------
    columns : (2 N, 2 N), m/N, rows as in `Coulomb.rotor`, of both bodies; in the loop
        of waves it is that array
    have : (N,), 1 if the two rows of a tip are known in this step, else 0
    response : (2 R,), m/N, displacements of the ring by a unit force
    slides, after, before : (N,), m, slides of the step, without and with contact
        forces; those of the step before
    mu, tau : (N,), coefficients of friction; (N,), N, friction on the casing
    state, chosen : (N,), states of tips; the tips whose forces are looked for
    table : Lemke's table for 3 N variables
    """

    columns: Floats
    have: Integers
    response: Floats
    slides: Floats
    after: Floats
    before: Floats
    mu: Floats
    tau: Floats
    state: Integers
    chosen: Integers
    table: ContactSpace


class Contact(NamedTuple):
    """Constants of the contact of rotor and casing in the time loop `bodies`.

    Attributes
    ----------
    w_rotor, compliance : m/N: (N, N), the rotor's part of the Delassus matrix; (R, R),
        compliance of the ring's R radial coordinates
    ring, lost : kind of the ring; index of the lost blade, -1 for none
    points : positions of the contact points
    layer : rods on the casing; unused if the state has no rods
    coulomb : law of friction and what it needs of both bodies
    """

    w_rotor: Floats
    compliance: Floats
    ring: Ring
    lost: int
    points: Points
    layer: Layer
    coulomb: Coulomb


class ContactSpace(NamedTuple):
    """Work arrays of the contact solver `contact.complementarity`.

    Attributes
    ----------
    response : (R,), m/N, the R radial displacements of the ring due to a unit
        multiplier
    w : (N, N), m/N, the Delassus matrix W, transposed
    have : (N,), 1 if a row of `w` has been computed, else 0
    small, right : (N, N + 1), (N,), matrix and right side of the equations of the
        blades in contact; the latter becomes their multipliers
    active, where : (N,), 1 if a blade is in contact, else 0; (N + 1,), these blades
    chosen, held, left : (N,), (N,), (N + 1,), for pivoting: the blades in its table,
        and the numbers of the variables of the table's rows and columns, see
        `pivoting.set_out`
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
    """Work arrays of contact with a constant Delassus matrix, see `circulant`.

    `padded` is N, rounded up to a multiple of four. There are k slots, one for each
    nodal diameter, padded. Folded arrays, (2 wide,), list all blades in the order of
    `loop.circulant.folded`.

    Attributes
    ----------
    push : (padded,), multipliers of the active blades (those in contact), N
    known : (N + 3 + CHANGES,), array of the state: the active blades of the last
        solution; their number, whether their inverse is sound, the number of changes
        since it was computed anew, and these changes, see `keep_inverse`
    inverse : (padded, padded) flat, N/m, inverse of these blades' part of the Delassus
        matrix W, transposed
    rows : (N, 2 wide) flat, m/N; row j: change of all gaps, folded, due to a unit
        multiplier on blade j
    where : (N + 1,), the active blades
    fallback : work arrays of pivoting, used if faster ways fail
    near, lam, opened : (N,), arguments of `loop.circulant.pivot`: gaps without contact,
        m, multipliers, N, and gaps with contact, m
    work : (4 padded,), work space of `keep_inverse`
    again : (2 wide,), folded gaps with the multipliers acting, m
    symbol, wave : spectrum (2 k,), m/N, of a circulant W, times 2 / N (slots 0 and N /
        2: 1 / N); argument of `loop.passes.to_gaps`. Empty for other W or a transform
        that is not split
    spectrum, spread : (4 k,), spectrum of the multipliers, N, then that of the change
        of gaps that they cause, m; work space of `loop.transform.to_slots`. Empty like
        `symbol`
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


class Bearings(NamedTuple):
    """Journal and rolling bearings among s supports, see `standing`.

    Attributes
    ----------
    kind, balls : (s,), PLAIN, JOURNAL or ROLLING; number n of balls
    between : (s,), e^{2 i pi / n}
    size : (s,), c_0 / pi, N s/m, of a journal, or K, N/m^1.5, of a ball
    turn : (s,), speed of a journal's film, 1/2, or of the cage, over that of the rotor
    stiffness, damping : (s,), k, N/m; c, N s/m, that the rotor's matrices have
    drawn : (s,), N, F_0
    """

    kind: Integers
    balls: Integers
    between: Complexes
    size: Floats
    turn: Floats
    stiffness: Complexes
    damping: Floats
    drawn: Complexes


class Stand(NamedTuple):
    """Forces of s supports beyond constant matrices, see `standing`.

    Attributes
    ----------
    hub : (2 s, n), displacement x, y of each support, of the centre for example, for
        unit coordinates of the body; (0, 0) if there are no such forces
    moved : (2 s, n), increment of the coordinates in a step by a unit force there
    give : (2 s, 2 s), change of the supports' velocities by unit forces, m/(N s)
    stiffness, damping : (s,), k_d, N/m; c_d, N s/m, see `reduction.supports`
    speed, step : (1,), Omega, rad/s; dt, s
    film, clearance : (s,), c_0, N s/m, of a squeeze film, 0 if it has none; c, m, of it
        or of a bearing, else 1
    circle : (s,), z_s, m, displacement of an unbalanced rotor there without contact
    balance : (s,), N, i Omega (c_t - c_0) z_s, with which the circle is in equilibrium
    sag, lift : (s,), m, displacement by the rotor's weight in the static frame, and the
        part of it that turns at 2 Omega there, of unequal sectors
    bearings : journal and rolling bearings among them
    stops : (m, 2), clearance, m, and friction with the sign of the speed, of m stops,
        the last ones of the supports; their rows of `give` are changes of the
        displacement after the step, m/N
    """

    hub: Floats
    moved: Floats
    give: Floats
    stiffness: Complexes
    damping: Complexes
    speed: Floats
    step: float
    film: Floats
    clearance: Floats
    circle: Complexes
    balance: Complexes
    sag: Complexes
    lift: Complexes
    bearings: Bearings
    stops: Floats


class Body(NamedTuple):
    """A rotor or a casing in the time loop `bodies`, of n coordinates q.

    They are displacements, or amplitudes of modes. Each matrix has diagonal blocks
    only, stored one after the other, each by columns, flat.

    At a changing speed, see `bodies.varying`, the amplitudes of the first `own` modes
    are those of y, the motion that contact causes; the further ones are those of the
    motion without contact, r, mode by mode.

    Attributes
    ----------
    keep, pull, give, mass, stiffness, damping, push : blocks of the matrices of
        `bodies.turning.Turning`, `give` those of its `inverse`; `push` is (0,) for a
        body without circulatory forces
    starts : (b + 1,), first coordinate of each block, and n
    own : number of coordinates that contact moves; at constant speed further ones
        represent the circle of an unbalanced rotor
    read : (n, r), the body's r radial coordinates for unit coordinates q; of the rotor:
        tips, x_o, y_o
    radial, tangential : (r, n), coordinates on which multipliers and their friction
        act, for unit coordinates q; of the rotor: tips
    stand : forces of supports that no constant matrix represents
    still : (n,), coordinates at rest on the circle of an unbalanced rotor, from which
        its energy is measured; (0,) for another body
    swerve : the first blocks of (dOmega/dt) C, C as in `oracle.body`, stored like
        `keep`, whose force is part of `pull`; (0,) at constant speed
    force : (n,), increments in a step by the forces of unbalance and changing speed, 0
        of the first modes; (0,) at constant speed
    weight : (2, n), the same by gravity, by cos and sin of the rotor's angle; (2, 0) at
        constant speed
    alike : (n - own,), for each further mode, the index of the same mode among the
        first `own`
    blocks : b, number of blocks of the coordinates that contact moves
    """

    keep: Floats
    pull: Floats
    give: Floats
    mass: Floats
    stiffness: Floats
    damping: Floats
    push: Floats
    starts: Integers
    own: int
    read: Floats
    radial: Floats
    tangential: Floats
    stand: Stand
    still: Floats = NOTHING
    swerve: Floats = NOTHING
    force: Floats = NOTHING
    weight: Floats = WEIGHTLESS
    alike: Integers = NO_MODES
    blocks: int = 0
