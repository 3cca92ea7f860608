"""Types of arguments of the time loops in the rotating frame: coefficients, work space.

A slot is a nodal diameter of the N blades, 0 .. N // 2; k is their number, padded. A
wave or mode of a slot has one complex amplitude, for all blades. Arrays of all blades,
(2 wide,), are in folded order: blades 0 .. N // 2 in the first half, blades N - j in
the second, see `circulant.folded`. A step is *pending* if its contact forces are known
but not yet applied to the amplitudes, see `slots`.
"""

from __future__ import annotations

from typing import NamedTuple

from hpcwhirl.arrays import Complexes, Floats, Integers
from hpcwhirl.dynamics.kernels.kernel_types import (
    ConstantSpace,
    Coulomb,
    CoulombSpace,
    CyclicState,
    LayerSpace,
    Rods,
    Stand,
)


class PointRows(NamedTuple):
    """Coefficients between P contact points and m amplitudes, a row for each point.

    They are used for unequal sectors, see `points`. `width` is m + P + 2 + 2 s, padded:
    the number of amplitudes, multipliers, cos and sin of the pulse, x and y of the
    forces of s supports. The motion of the bodies' material from step n - 1 to n + 1 is
    called d' + d.

    Attributes
    ----------
    read : (P, r) flat, change of the point's gap by unit amplitudes, of which those
        after the first r, a multiple of 16, move no point
    before : (P, m) flat, the same for the gap two steps before
    turned : (P, 2, c) flat, `before` less the gap two steps before at the point's angle
        now, for unit re and im of the first c complex amplitudes: those of the casing,
        and of the steady motion by unbalance; c is a multiple of 16
    push : (P, m) flat, change of amplitudes by the point's unit multiplier and friction
    opens, slides : (P, width) flat, rows that give d' + d of the gap, and of the casing
        relative to the tip along the rotation
    moves, gives : (m,) each, or empty. Without rotation d' + d of a wave is its
        amplitude times a complex factor `moves`, and its change by forces is its modal
        force times `gives`. Then `push`, (P, r), gives the modal forces, and the first
        m columns of `slides` are only r, for the amplitudes times `moves`
    """

    read: Floats
    before: Floats
    turned: Floats
    push: Floats
    opens: Floats
    slides: Floats
    moves: Floats
    gives: Floats


class SectorRows(NamedTuple):
    """Coefficients between the n_c contact points of a tip and waves, of equal sectors.

    They are like `PointRows`, but by slot; k is the number of slots (nodal diameters),
    padded. Each slot has `single` waves, and `pairs` pairs of waves. The waves of a
    pair move the points with equal coefficients, so that only their sum is needed: gaps
    are sums over `alike` = single + pairs rows, (rows, 2, k) flat, re and im. The
    motion of the bodies' material from step n - 1 to n + 1 is called d' + d.

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
    slides : (P, padded) flat, m/N, d' + d along the casing per unit force: the last
        columns of `slides` in `PointRows`
    turns, lanes : (N, 2 k) flat, cos and -sin of each slot at each blade; (N/4, 2 k, 4)
        flat, the same for groups of four blades
    each, single, pairs : n_c; numbers of waves and of pairs in a slot
    """

    read: Floats
    slide: Floats
    push: Floats
    before: Floats
    move: Floats
    give: Floats
    slides: Floats
    turns: Floats
    lanes: Floats
    each: int
    single: int
    pairs: int


class PointsEnergy(NamedTuple):
    """The energy of both bodies as a quadratic form of the amplitudes, in blocks.

    Attributes
    ----------
    starts : (b + 1,), at which each of b blocks begins in `which`, multiples of 4
    which : indices of the amplitudes of each block; padded
    form : J, coefficients of their products: for each block the upper triangle, by
        rows, each beginning at a multiple of 4
    split : number of blocks that are the rotor's, which come first
    """

    starts: Integers
    which: Integers
    form: Floats
    split: int


class PointsSupport(NamedTuple):
    """The s supports whose forces no constant matrix gives, see `standing`.

    In a step these forces, x and y, change some complex amplitudes, which are in b
    blocks of four neighbours; b is 0 without such supports.

    Attributes
    ----------
    which : (b,), index of the first of each four
    reads : (s, b, 4, 2, 4) flat, x and y of each support at the step's start in the
        motion that contact causes, and their velocities without these forces, or of
        stops displacements after the step, for unit re, then im, of the amplitudes
        after the free step
    gives : (s, b, 2, 2, 4) flat, change of re, then im, of the amplitudes by unit
        forces x and y
    turns : (64, 2) flat, e^{-i Omega t} at the first steps, re and im
    nudge, rush : (s,), m/N, bounds of the motion of any point due to a unit force: in
        the step in which it acts; and the increase of the bound given by
        `PointsRotor.drift`
    stand : the supports
    """

    which: Integers
    reads: Floats
    gives: Floats
    turns: Floats
    nudge: Floats
    rush: Floats
    stand: Stand


class PointsRotor(NamedTuple):
    """Coefficients of rotor and casing as waves, for P contact points, see `points`.

    There are m real amplitudes, re then im of all waves, each half padded; `width` as
    in `PointRows`.

    Attributes
    ----------
    ahead : (m,), re and im of z - 1, z the factor by which a step multiplies an
        amplitude
    drift : (m / 2,), m, bound of the motion of any point in a step, per unit amplitude
    rush : (P,), m/N, increase of the bound given by `drift` per unit multiplier
    rows : `PointRows` or `SectorRows`
    kick, kicked : (2, m), (2, width) flat, for unit cos and sin forces of the pulse:
        change of amplitudes; rows that give the motion over two steps on which these
        forces do work
    radial, along, hub : (P, m), (P, m), (2, m) flat, radial and tangential displacement
        of the points, and x_o, y_o, for unit amplitudes
    reach : (m / 2,), bound of any point's displacement for unit amplitudes
    energy : the energy of both bodies
    casing, shares : (c, 2), (c, 2), for each of the casing's c modes the indices of two
        amplitudes and their factors: the mode is the sum of the products
    support : supports whose force acts in each step
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
    energy: PointsEnergy
    casing: Integers
    shares: Floats
    support: PointsSupport


class PointSlides(NamedTuple):
    """Set-valued friction of P points, see `point_slides`; empty: permanent sliding.

    Attributes
    ----------
    law : law of friction; its `rotor` is the response of both bodies
    step : dt, s
    places, shape : (P, 0), (P, 0): the casing has no further part in the response
    rises, pasts : (P, m) flat, slide of a step, and of the step before in free motion,
        for unit amplitudes
    drag : (P, m) flat, change of amplitudes by a unit force along theta on the point
    rush : (P,), m/N, increase of the bound given by `PointsRotor.drift` by it
    aside : (P, m) flat, slides over two steps by orbits of an unbalanced rotor, for
        unit amplitudes, with permanent sliding, too; empty if they rest in the frame of
        the blades
    """

    law: Coulomb
    step: float
    places: Integers
    shape: Floats
    rises: Floats
    pasts: Floats
    drag: Floats
    rush: Floats
    aside: Floats


class PointsContact(NamedTuple):
    """Constants of the contact of P points, one or several on each tip, with a ring.

    w : (P, P), m/N, Delassus matrix; column i: opening of all gaps by a unit multiplier
        on point i
    clear : (2 wide,), m, clearance of each point beyond the gap, in folded order, see
        `circulant.folded`
    waves : (n, 2, 2 wide) flat, cos and sin of the n harmonics of the casing's shape at
        the points
    rods : layer on the casing
    slides : set-valued friction
    """

    w: Floats
    clear: Floats
    waves: Floats
    rods: Rods
    slides: PointSlides


class PointsSpace(NamedTuple):
    """Work space of the time loop `points`; no part of a saved run.

    Attributes
    ----------
    spare : (width,), amplitudes before any force acts, then multipliers and other
        forces, N
    spectra : spectra of a tip's points, see `sectors.layout`
    before : (P,), m, gaps of the points in contact at step n - 1
    solver : work space of the contact solver, `circulant`
    out, again : (2 wide,), m, in folded order (`circulant.folded`): the waves' part of
        the gaps, or lower bounds of it; gaps computed anew for a sample
    opened : (2 wide,), m, gaps, or lower bounds of those that are not computed
    tips : (P + 1, 2), m, radial and tangential displacement of each point; then x_o,
        y_o
    casing : (c,), amplitudes of the c modes of the casing, rotating frame
    ledger : copy of the ledger with all works entered, J
    turned : (3,), see `standing.turned_by_steps`
    push : (room,), N, forces of s supports, x and y, see `standing.add_support`
    bounds : (2,), m, bound of any point's motion in a step; 1 before any is known
    layer : work space of `layer`
    friction : work space of set-valued friction; empty with permanent sliding
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
    turned: Floats
    push: Floats
    bounds: Floats
    layer: LayerSpace
    friction: CoulombSpace


class SlotRows(NamedTuple):
    """Coefficients of equal sectors' waves by slot, packed in groups of four slots.

    Slots are nodal diameters, k, padded; G = k / 4 groups. A group has as many rows as
    its slot with most waves: first those of the rotor, then those of the casing. The
    items of rows and groups are named in `slots`.

    Attributes
    ----------
    free, pushed : items of all rows of a step without contact, and of one with contact
    fixed : items of each group
    along : (2, 4) a row of the rotor: -1 times the tangential displacement of the tip
        for unit amplitude, re, then im
    energy : (e, 2, 4) flat, J, coefficients c of the products conj(a) c a' in energy
    rotor, ring : (G,), numbers of rows of rotor and casing
    pairs : (e, 2) flat, indices of re of the amplitudes a and a' of four slots each
    split : number of products of the rotor, which come first
    turns, wave : tables of cos and sin between blades and slots, see
        `waves.slots.transforms`
    """

    free: Floats
    pushed: Floats
    fixed: Floats
    along: Floats
    energy: Floats
    rotor: Integers
    ring: Integers
    pairs: Integers
    split: int
    turns: Floats
    wave: Floats


class SlotFlight(NamedTuple):
    """Coefficients of the exact scheme's jumps over steps without contact.

    See `flights_of_slots`; there are R rows of waves in all groups.

    Attributes
    ----------
    total : number of steps of the run
    certifiable : whether it can be proved that contact never recurs (the certificate)
    counts : (P,), number of steps of each of P tabulated jumps; the last one is the
        number between rows of evidence
    jumps : (P, R, 2, 4) flat, z^n of these jumps, re and im
    bounds : (R, 4, 4) flat, for unit amplitude: rate of the gap, re and im; bounds of
        its second derivative; of the gap
    """

    total: int
    certifiable: bool
    counts: Integers
    jumps: Floats
    bounds: Floats


class FlowRows(NamedTuple):
    """Coefficients of equal sectors' waves by slot, for steps of the exact flow.

    Attributes are those of `SlotRows`; `flight` has those of jumps.
    """

    free: Floats
    pushed: Floats
    fixed: Floats
    along: Floats
    energy: Floats
    rotor: Integers
    ring: Integers
    pairs: Integers
    split: int
    turns: Floats
    wave: Floats
    flight: SlotFlight


class SlotPulse(NamedTuple):
    """The pulse on the casing, by p waves of one slot.

    at : (p,), indices of re of the waves' amplitudes; im follow four further
    push, move : (p, 2), re and im: change of the amplitude by a unit force; motion over
        two steps on which it does work, for unit amplitude
    numbers : (11,): change of the gap by a unit force; motion by a unit force; re and
        im of that by a unit spectrum of the multipliers; by a unit force, the motion of
        the gap beyond that of free waves, and re and im of that along the casing, and
        in the exact flow of the rate in passing; by a unit spectrum of forces along
        theta, re and im of the motion
    slot, sign : slot; -1 if it has the conjugate of the pulse's harmonic, else 1
    """

    at: Integers
    push: Floats
    move: Floats
    numbers: Floats
    slot: int
    sign: float


class SlotSupport(NamedTuple):
    """The s supports whose forces no constant matrix gives, see `standing`.

    With equal sectors a force f = x + i y acts on the rotor's waves of one slot, nodal
    diameter 1. It changes complex numbers of that slot in proportion to conj(f).

    reads : (s, n, 4) flat, as in `PointsSupport`, for re, then im, of each of the
        slot's rows in turn, padded; empty without such supports
    gives : (s, n, 2, 4) flat, change of the amplitudes of the group of four slots by
        unit x and y
    gaps : (s, 2, 2, 4) flat, m/N, change of re, then im, of the gaps' spectrum of the
        group by unit x and y
    slides : (s, 2) flat, m/N, re and im: motion along the casing by unit conj(f),
        beyond that of the waves after the force
    turns : (64, 2) flat, e^{-i Omega t} at the first steps, re and im
    swing : (2,), re and im: motion of the gap from step n - 1 to n + 1 by a unit
        amplitude of the orbit of an unbalanced rotor that turns at 2 Omega
    orbit : index of re of that amplitude; -1 if there is none
    slot : the slot, in the first group
    stand : the supports
    """

    reads: Floats
    gives: Floats
    gaps: Floats
    slides: Floats
    turns: Floats
    swing: Floats
    orbit: int
    slot: int
    stand: Stand


class SlotHeld(NamedTuple):
    """The supports of `SlotSupport` at a changing speed, in an interval of speed.

    They are s supports, which w waves of their slot move, by y and by r of `SlotDrive`.
    Displacements and velocities are x + i y. Arrays are empty without such supports.

    Attributes
    ----------
    own, beside : (w,), indices of re of the slot's waves of y, and of r or (0,)
    places, moves : (s, w), displacement at the step's start and velocity of a support
        without its force, or of a stop displacement after the step, for unit conj(a),
        a the amplitudes after the free step
    nudge : (s, 3), m/s, what the forces on r in the step add to that velocity, and the
        weight by cos and sin of the rotor's angle
    gives, gaps : (s, w), (s,), change of the amplitudes, and of the gaps' spectrum, by
        unit conj(f), f the force
    slides : (s, 2) flat, as in `SlotSupport`
    swirl, swirls : (s, w), (s, s), J/N, J/N^2, as in `SlotDrive`: work by unit f and a;
        by unit forces alone
    slot : the slot
    stand : the supports
    """

    own: Integers
    beside: Integers
    places: Complexes
    moves: Complexes
    nudge: Complexes
    gives: Complexes
    gaps: Complexes
    slides: Floats
    swirl: Complexes
    swirls: Complexes
    slot: int
    stand: Stand


class SlotDrive(NamedTuple):
    """A rotor with terms of rotation whose speed changes, in an interval of speed.

    Its motion is y + r: y, which contact causes, has the waves of `SlotRows`; r, the
    motion without contact, has n further waves of the same shapes, which constant
    forces drive. Arrays are empty at a constant speed.

    Attributes
    ----------
    filled, first : (s, 2), slots of these waves, and numbers of rows of four waves that
        each fills; index in the state of the first row, which the others follow
    at, own, slot : (n,), of each wave: index of re of its amplitude; of that of y with
        the same shape; its slot
    free : items of a step of all rows: z - 1, re and im, change of the gap; what the
        forces add to an amplitude, re and im
    radial, along : (n,), (n, 2): change of the gap, and -1 times the tangential
        displacement of the tip, for unit amplitude
    hub : (2, n, 2), x_o and y_o for unit re and im of the amplitudes
    turning : J, like `SlotRows.energy`, but for the casing: a form of the amplitudes
    spin : (4,) a row of the rotor, J, factors of |a|^2
    swirl, swirls : (2, 4) a row of the rotor; (4,) a group: factors, re and im, of a in
        the work of a unit spectrum of the multipliers; work by it alone. These three
        and the form are the work of the force -(dOmega/dt) C y, see
        `slots.turn_slots`
    weight : (2, n), change of the amplitudes in a step by the rotor's weight, by cos
        and sin of the rotor's angle; (2, 0) without
    held : supports whose forces no constant matrix gives
    """

    filled: Integers
    first: int
    at: Integers
    own: Integers
    slot: Integers
    free: Floats
    radial: Floats
    along: Floats
    hub: Floats
    turning: Floats
    spin: Floats
    swirl: Floats
    swirls: Floats
    weight: Complexes
    held: SlotHeld


class SlotRotor(NamedTuple):
    """Coefficients of rotor and casing of equal sectors, see `slots`.

    rows, pulse, support : `SlotRows` or `FlowRows`; `SlotPulse`; `SlotSupport`
    centre, hub : (h,), (2, h, 2): indices of the waves that move the centre, and x_o
        and y_o for unit re and im of their amplitudes
    modes : (c, 2), for each complex mode of the casing the indices of its two waves,
        whose sum it is
    drive : what a changing speed adds
    """

    rows: SlotRows | FlowRows
    pulse: SlotPulse
    centre: Integers
    hub: Floats
    modes: Integers
    support: SlotSupport
    drive: SlotDrive


class SlotSlides(NamedTuple):
    """Set-valued friction of equal sectors, see `slot_slides`; else empty.

    Attributes
    ----------
    law : law of friction; its `rotor` is the response of both bodies
    step : dt, s
    places, shape : (N, 0), (N, 0): the casing has no further part in the response
    rows : items of all rows of waves
    fixed : (7, 2 k) flat, by slot, re, then im, what unit forces change: items `SLID`
        to `MOVED`
    swirl, swirls : those of `SlotDrive`, of forces along theta
    at, slot, aside : (n,), (n,), (n, 2): waves of the motion without contact, that of a
        changing speed or an orbit: index of re, slot; re, im of the slide of a step for
        unit amplitude; with permanent sliding, too
    """

    law: Coulomb
    step: float
    places: Integers
    shape: Floats
    rows: Floats
    fixed: Floats
    swirl: Floats
    swirls: Floats
    at: Integers
    slot: Integers
    aside: Floats


class SlotContact(NamedTuple):
    """Constants of the contact of equal sectors.

    column : (N,), m/N, column 0 of the circulant Delassus matrix
    rods : layer on the casing
    slides : set-valued friction
    """

    column: Floats
    rods: Rods
    slides: SlotSlides


class SlotSpace(NamedTuple):
    """Work space of the time loop for equal sectors; no part of a saved run.

    spectrum, slip, radial, along : (2 k,), m, spectra of the gaps, of the motion along
        the casing, and of the rotor's displacements
    seen, skipped : see `skipped`
    before : (N,), m, gaps of the blades in contact at step n - 1
    solver : work space of the contact solver, `circulant`
    out, again : (2 wide,), m, displacements or gaps in folded order
    tips, casing : (N + 1, 2), m, displacements of tips, then x_o, y_o; (2 c,), re, then
        im of the casing's modes
    ledger : copy of the ledger with all works entered, J
    kicked, held : (4,) each, of the last step with contact and a pulse, or a force of
        the supports: re and im, m, of the motion along the casing by it alone; number
        of the step; slot
    push, turned : (room,), N, forces of the supports in this step, x and y, see
        `standing.add_support`; (3,), see `standing.turned_by_steps`
    aside : for the exact scheme, a state with copies of the arrays that a jump changes
    layer : work space of `layer`
    friction : work space of set-valued friction; empty with permanent sliding
    rubbed : (4 k + 4,), or empty: of the last step in which friction was not that of
        permanent sliding: spectra (2 k,) of the motion along the casing that the rest
        of it causes, beyond what the pass sees, m, and of this rest, N; the step
    past : (2 k,), or empty: m, spectrum of the slides of the step before by the motion
        without contact
    """

    spectrum: Floats
    slip: Floats
    radial: Floats
    along: Floats
    seen: Floats
    skipped: Integers
    before: Floats
    solver: ConstantSpace
    out: Floats
    again: Floats
    tips: Floats
    casing: Floats
    ledger: Floats
    kicked: Floats
    held: Floats
    push: Floats
    turned: Floats
    aside: CyclicState
    layer: LayerSpace
    friction: CoulombSpace
    rubbed: Floats
    past: Floats
