"""Types of arguments of the kernels of two bodies, in the static frame."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.dynamics.kernels.kernel_types import Ring

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class Points(NamedTuple):
    """Positions and clearances of N contact points, blade by blade.

    Attributes
    ----------
    angle, turn : (N,), angle beyond that of blade 0, in rad and in turns
    gap : (N,), m, clearance beyond that of the scene
    weight : (N, L), values of the casing's axial functions at the points
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
    soft, rub : wear in a step per force beyond the limit, m/N; the same per rad/s of
        the speed, m s/(N rad)
    limit, growth : N, force at which an unworn rod wears; N/m, by which wear raises it
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
    """Contact of two bodies.

    w_rotor, compliance : (N, N), the rotor's W; (R, R), compliance of the ring, m/N
    ring, lost : kind of the ring; the blade that is lost, -1 for none
    points : positions of the contact points
    layer : rods on the casing; not read where the state has none
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
        number, whether their inverse is sound, the number of changes made to it since
        blades were inverted, and these changes, see `keep_inverse`
    inverse : (padded, padded) flat, inverse of the part of W of these blades
    rows : (N, 2 wide) flat, what each blade's multiplier opens, folded, m/N
    where : (N + 1,), the active blades
    fallback, near, lam, opened : work space and arguments of `contact.complementarity`
    work : (4 padded,), work space of `keep_inverse`
    again : (2 wide,), folded gaps that the multipliers leave, m
    symbol, wave : spectrum (2 k,), m/N, of a circulant W, times 2 / N (simple slots:
        1 / N); argument of `passes.to_gaps`. Empty for other W or an unsplit transform
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
    give : (2, 2), change of the velocity of x_o, y_o by a unit force, m/(N s)
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

    The first `own` modes have the motion y that contact causes; the further ones, in
    equal blocks, have the motion without contact.

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
