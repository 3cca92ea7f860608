"""Forces of supports on a rotor that no constant matrix represents.

These are forces of non-rotating supports that differ by direction, of squeeze films,
whose damping depends on the displacement z = x + i y of the rotor there, and of journal
and rolling bearings: at the shaft's centre, or at another station of a shaft.

In the rotating frame, at step n, with the displacement z and its velocity v,

f = -[(k_d - i Omega c_d) conj(z) + c_d conj(v)] e^{-2 i Omega t},

k_d and c_d as in `reduction.supports`, v = (z_{n+1} - z_{n-1}) / 2 dt of the step
without contact. The contribution of all these forces to v is included, by solving two
equations for each support; that of contact in the same step is not.

The matrices of y, the motion that contact causes, include the damping c_0 of a squeeze
film (`reduction.supports`), and the circle z_s of an unbalanced rotor is in equilibrium
with the film. The rest of its force, at z = z_s + y, is

f = -(c_m - c_0) v - c_d (z/c)^2 conj(v) - i Omega [(c_t - c_0) z - (c_t - c_0)_s z_s],

c_m = c_t + c_d |z/c|^2, c_t = c_0 / (1 - |z/c|^2)^{3/2}, c_d = 3/2 c_0 / (...)^{5/2}.

The sag z_g e^{-i Omega t} by the rotor's weight belongs to z, but does not move in the
static frame: its i Omega z_g is subtracted from the velocity that the film damps.

At a changing speed the motion is the sum of y and of r, the motion without contact, see
`bodies.varying`: then z is that of both, z_s = z_g = 0, and Omega that of the interval.
The angle theta stands for Omega t. The supports' forces on r are those on r alone, with
which it moves as without any contact; those on y complete them to those on y + r. F_0
is among the forces on r: so the forces here stay those beyond equilibrium.

A journal bearing or rolling bearing (`Bearings`) has the force F(Z, V) in the static
frame, Z the displacement and V its velocity, and the matrices of y include k and c of
small motions about the equilibrium under the rotor's weight. The term is the rest,

F(Z, V) + k Z + c V - F_0, F_0 = F(Z_g, 0) + k Z_g, Z_g the sag,

which vanishes in equilibrium, whatever k and c are. In the cavitated film of a short
journal bearing that part of the circumference carries in which w = V - i Omega/2 Z
closes it (F. Ocvirk, NACA TN 2808, 1952; J. Booker, J. Basic Eng. 87, 1965):

F = -(c_0 / pi) M w, M = int n n^T / (1 - eps cos(theta - phi))^3 dtheta, w n > 0,

eps e^{i phi} = Z/c, n at the angle theta. With Sommerfeld's angle chi, cos(theta - phi)
= (eps + cos chi) / (1 + eps cos chi), M has a closed form, `half_film`. The potential
w M w / 2 is convex in w, M its second derivative: the half that carries is that of the
step's velocity without these forces, and the error of second order in the step. Beyond
`CLOSED` M stays.

The n balls of a rolling bearing, at angles psi_j that turn with the cage, press by
Hertz's law where they lack room, F = -K sum_j d_j^{3/2} n_j, d_j = Z n_j - c > 0.

A stop is a ring at rest around the rotor, of clearance c: |Z| <= c after every step.
Its force is a multiplier of Carpenter's kind, as at the blades' tips, with friction
against the rotation, of a journal that slides everywhere:

f = -lambda (1 + i mu) Z / c, lambda >= 0, lambda (|Z| - c) = 0,

Z that after the step, with the forces of all supports in it, and without those of the
blades' contact in the same step, which the next one includes. With the displacement Z_0
without f, and G by which a unit force moves it, (1 + lambda B) Z = Z_0, with B = G (1 +
i mu) / c: an equation in lambda alone. The impact is plastic, as that of a tip; its
work is part of the supports'.

The equations (1 + E W) f = r of s supports have W (2 s, 2 s), the velocities by unit
forces, and E, a block of damping for each support. They are solved without exchange of
rows: each leading block 1 + E_k W_kk is regular, as W_kk > 0 and E_k >= 0.
"""

from __future__ import annotations

import math

from hpcwhirl.dynamics.kernels.compiled import inlined, kernel, part
from hpcwhirl.dynamics.kernels.vectors import (
    FOUR,
    broadcast,
    element,
    fma,
    get,
    load,
    load_both,
    store,
    store_both,
    total_of,
)

CLOSED = 0.99 * 0.99  # |z/c|^2 beyond which a film's damping is that at this value
PLAIN, JOURNAL, ROLLING = 0, 1, 2  # `kernel_types.Bearings.kind`
NEWTON, CLOSE = 8, 3e-16  # iterations for a stop; error of |Z| / c that ends them
ROUNDS, LEAST = 100, 1e-13  # of iterations over several stops; relative change, same


@kernel
def at_support(hub, p, values, first, last):
    """Return the displacement x + i y of a rotor at a support, m, rotating frame.

    It is that by coordinates first .. last - 1.

    hub : (2 s, n), x, y of each support for unit coordinates of a body
    p : number of the support
    values : (n,), these coordinates; or their increments, for the increment there
    """
    x, y = 0.0, 0.0
    for m in range(first, last):
        x += hub[2 * p, m] * values[m]
        y += hub[2 * p + 1, m] * values[m]
    return complex(x, y)


@kernel
def film_at(square):
    """Return c_t / c_0 - 1 and c_d / c_0 of a squeeze film at a displacement z.

    c_t and c_d are damping coefficients, c_0 that of a centred journal, see this
    module.

    square : |z/c|^2, c the radial clearance
    """
    more = 1.0 / (1.0 - min(square, CLOSED))
    across = more * math.sqrt(more)
    return across - 1.0, 1.5 * across * more


@inlined
def scaled(value, factor):
    """Return a complex number times a real one, for which numba takes four products."""
    return complex(value.real * factor, value.imag * factor)


@kernel
def half_film(eps, along, across):
    """Return M of a cavitated short film, see this module: M_rr, M_tt, M_rt.

    r is the direction of the displacement, t across it, anticlockwise.

    eps : |Z/c|, < 1
    along, across : parts of a unit vector along w
    """
    square = 1.0 - eps * eps
    root = math.sqrt(square)
    low, high = 1.0 / (1.0 - eps * across), 1.0 / (1.0 + eps * across)
    before, sine = (across - eps) * low, -root * along * low  # where the half begins
    after, last = -(across + eps) * high, root * along * high
    width = math.pi + 2.0 * math.atan(eps * along / root)
    turn = last * after - sine * before
    down = 1.0 / (square * root)
    rr = (eps * eps + 0.5) * width + 2.0 * eps * (last - sine) + 0.5 * turn
    rt = eps * (before - after) + 0.5 * (last * last - sine * sine)
    return down * rr / square, down * 0.5 * (width - turn), down * rt / root


@kernel
def journal_terms(place, stream, clearance):
    """Return E and D of the force of a cavitated film of c_0 = pi: -E w - D conj(w).

    place, stream : Z, m; w, m/s, of which only the direction counts; in any frame
    clearance : c, m
    """
    size, rate = abs(place), abs(stream)
    if rate == 0.0 or size == 0.0:
        return 0.5 * math.pi, 0j
    way = scaled(place, 1.0 / size)
    seen = scaled(stream * way.conjugate(), 1.0 / rate)
    eps = min(size / clearance, math.sqrt(CLOSED))
    rr, tt, rt = half_film(eps, seen.real, seen.imag)
    return 0.5 * (rr + tt), complex(0.5 * (rr - tt), rt) * way * way


@kernel
def rolling_force(place, first, turn, balls, clearance):
    """Return the force of a rolling bearing over K, m^1.5.

    place : Z, m
    first, turn : e^{i psi}, psi the angle of the first ball, in the frame of the place;
        e^{2 i pi / n}
    balls, clearance : their number n; c, m, radial
    """
    ball, x, y = first, 0.0, 0.0
    for _ in range(balls):
        lack = place.real * ball.real + place.imag * ball.imag - clearance
        if lack > 0.0:
            press = lack * math.sqrt(lack)
            x, y = x - press * ball.real, y - press * ball.imag
        ball = ball * turn
    return complex(x, y)


@kernel
def bearing_terms(own, p, motion, turned, angle):
    """Return held, even, drift of a journal or rolling bearing, see `terms_at`.

    motion : Z, V, m, m/s, rotating frame: displacement, and velocity in the static
        frame as of the step without these forces; and that of V which stays if the
        velocity of y is 0
    turned, angle : e^{-i theta}, theta, see `terms_at`
    """
    whole, rate, still = motion
    of, k, c = own.bearings, own.bearings.stiffness[p], own.bearings.damping[p]
    held = of.drawn[p] * turned - k * whole - scaled(still, c)
    if of.kind[p] == ROLLING:
        cage = of.turn[p] * angle
        first = complex(math.cos(cage), math.sin(cage)) * turned
        press = rolling_force(
            whole, first, of.between[p], of.balls[p], own.clearance[p]
        )
        return held - scaled(press, of.size[p]), -c, 0j
    half = of.turn[p] * own.speed[0]
    swirl = complex(-half * whole.imag, half * whole.real)
    even, drift = journal_terms(whole, rate - swirl, own.clearance[p])
    even, drift = of.size[p] * even, scaled(drift, of.size[p])
    base = still - swirl
    held += scaled(base, even) + drift * base.conjugate()
    return held, even - c, drift


@kernel
def answer(give, held, moving, even, drift):
    """Return the force f of a single support, N, complex, in a step.

    The force depends on the velocity that it changes: it is f = -held - even u - drift
    conj(u), where the velocity there is u = moving + W f, m/s: two equations for its
    two components.

    held, even, drift : -f at u = 0, N, complex; damping, N s/m, real and complex
    moving : m/s, complex, velocity without f
    give : (2, 2), W, change of the velocity by a unit force, m/(N s)
    """
    rest = -held - scaled(moving, even) - drift * moving.conjugate()
    a, b = drift.real, drift.imag  # f -> drift conj(f) on (x, y): [[a, b], [b, -a]]
    xx = 1.0 + (even + a) * give[0, 0] + b * give[1, 0]
    xy = (even + a) * give[0, 1] + b * give[1, 1]
    yx = b * give[0, 0] + (even - a) * give[1, 0]
    yy = 1.0 + b * give[0, 1] + (even - a) * give[1, 1]
    down = 1.0 / (xx * yy - xy * yx)
    x = (yy * rest.real - xy * rest.imag) * down
    return complex(x, (xx * rest.imag - yx * rest.real) * down)


@kernel
def turned_at(angle):
    """Return e^{-i theta}, of the static frame's directions in the rotating frame.

    angle : theta, rad, of the rotor: Omega t at a constant speed
    """
    return complex(math.cos(angle), -math.sin(angle))


@kernel
def terms_at(own, p, place, moving, when):
    """Return the terms of the force of a support.

    They are held, N, even and drift, N s/m: the force is f = -held - even v - drift
    conj(v), v being the velocity there.

    own, p : `kernel_types.Stand`; number of the support
    place, moving : m, m/s, complex displacement there, from the rotor's motion without
        contact, and velocity without these forces, on which the half of a journal's
        film that carries depends
    when : e^{-i Omega t} at the time at which the supports' directions are taken, and
        the angle theta, rad
    """
    turned, angle = when
    lost, stiff, twice = own.damping[p], own.stiffness[p], turned * turned
    speed = own.speed[0]
    spring = complex(stiff.real + speed * lost.imag, stiff.imag - speed * lost.real)
    held, drift = twice * spring * place.conjugate(), twice * lost
    even, film = 0.0, own.film[p]
    if film == 0.0 and own.bearings.kind[p] == PLAIN:
        return held, even, drift
    sag, lift = own.sag[p] * turned, own.lift[p] * turned.conjugate()
    whole = own.circle[p] + place + sag + lift
    still = scaled(lift - sag, speed)
    beyond = complex(-still.imag, still.real)
    if film == 0.0:
        resting = beyond + complex(-speed * whole.imag, speed * whole.real)
        motion = whole, moving + resting, resting
        return bearing_terms(own, p, motion, turned, angle)
    near = scaled(whole, 1.0 / own.clearance[p])
    square = near.real**2 + near.imag**2
    across, apart = film_at(square)
    turns = speed * film * across
    held += complex(-turns * whole.imag, turns * whole.real) - own.balance[p]
    if square > CLOSED:
        near = scaled(near, math.sqrt(CLOSED / square))
    even = film * (across + apart * (near.real**2 + near.imag**2))
    along = scaled(near * near, film * apart)
    held += scaled(beyond, even) + along * beyond.conjugate()
    return held, even, drift + along


@kernel
def add_support(own, p, place, moving, when, push):
    """Enter the force of a support in a step in the equations for all of them.

    A single support's force is known at once, see `answer`.

    own, p, when : as in `terms_at`
    place, moving : m, m/s, displacement there at the step's start, and velocity without
        these forces, complex; in the motion that contact causes; of a stop `moving` is
        the displacement after the step, m
    push : (room,), out: N, forces x, y of s supports, or the right side of the
        equations for them; then their matrix, (2 s, 2 s)
    """
    if p >= len(own.film) - len(own.stops):
        whole = moving + resting_at(own, p, when)
        push[2 * p], push[2 * p + 1] = whole.real, whole.imag
        return
    held, even, drift = terms_at(own, p, place, moving, when)
    size = len(own.give)
    if size == 2:  # a stop is not alone with it
        force = answer(own.give, held, moving, even, drift)
        push[0], push[1] = force.real, force.imag
        return
    rest = -held - scaled(moving, even) - drift * moving.conjugate()
    x, y = 2 * p, 2 * p + 1
    push[x], push[y] = rest.real, rest.imag
    a, b = drift.real, drift.imag  # f -> drift conj(f) on (x, y): [[a, b], [b, -a]]
    for c in range(size):
        above, below = own.give[x, c], own.give[y, c]
        push[size + x * size + c] = (even + a) * above + b * below
        push[size + y * size + c] = b * above + (even - a) * below
    push[size + x * size + x] += 1.0
    push[size + y * size + y] += 1.0


@inlined
def resting_at(own, p, when):
    """Return a support's displacement after a step, m, without that of contact.

    It is that of the circle and of the sag; own, p, when : as in `terms_at`
    """
    if own.sag[p] == 0.0 and own.lift[p] == 0.0:
        return own.circle[p]
    turned = when[0] * turned_at(own.speed[0] * own.step)
    return own.circle[p] + (own.sag[p] * turned + own.lift[p] * turned.conjugate())


@kernel
def stop_force(give, at, size, place, clearance, rub):
    """Return the force of a stop, N, complex, that keeps |Z| <= c, see this module.

    give, at, size : flat matrix of which the rows at + size r, r = 0, 1, begin with G,
        m/N
    place, clearance : Z without the force, m; c, m
    rub : friction coefficient with the sign of the speed
    """
    if not abs(place) > clearance:
        return 0j
    a, b, c, d = give[at], give[at + 1], give[at + size], give[at + size + 1]
    a, b, c, d = a + rub * b, b - rub * a, c + rub * d, d - rub * c
    press, x, y = 0.0, place.real, place.imag
    for _ in range(NEWTON):  # for 1 / |Z|, all but linear in lambda
        far = math.sqrt(x * x + y * y)
        if not abs(far - clearance) > CLOSE * clearance:
            break
        u, v = a * x + b * y, c * x + d * y
        xx, yy = clearance + press * a, clearance + press * d
        xy, yx = press * b, press * c
        down = 1.0 / (xx * yy - xy * yx)
        falls = (x * (yy * u - xy * v) + y * (xx * v - yx * u)) * down / far
        more = (far - clearance) * far / (clearance * falls)
        press += more
        xx, yy = clearance + press * a, clearance + press * d
        xy, yx = press * b, press * c
        down = clearance / (xx * yy - xy * yx)
        x = (yy * place.real - xy * place.imag) * down
        y = (xx * place.imag - yx * place.real) * down
    return complex(-press * (x - rub * y), -press * (y + rub * x)) / clearance


@part
def press_stops(own, push):
    """Compute the forces of stops, one of which is reached; complete the supports'.

    own, push : as in `solve_supports`, which has eliminated the equations of the other
        supports; in: their forces without those of the stops, N, and the stops'
        displacements, m; out: all forces, N
    """
    size = len(own.give)
    stops = len(own.stops)
    first, spare = size - 2 * stops, size + size * size + size
    for r in range(first - 2, -1, -1):
        row = size + r * size
        for c in range(r + 1, first):
            for j in range(first, size):
                push[row + j] -= push[row + c] * push[size + c * size + j]
    for i in range(first, size):
        push[spare + i], push[i], row = push[i], 0.0, size + i * size
        for j in range(first, size):
            moved = own.give[i, j]
            for r in range(first):
                moved -= own.give[i, r] * push[size + r * size + j]
            push[row + j] = moved
    for _ in range(ROUNDS):
        change, most = 0.0, 0.0
        for s in range(stops):
            x = first + 2 * s
            place, row = complex(push[spare + x], push[spare + x + 1]), size + x * size
            for j in range(first, size):
                if j < x or j > x + 1:
                    moved = complex(push[row + j], push[row + size + j])
                    place += scaled(moved, push[j])
            force = stop_force(
                push, row + x, size, place, own.stops[s, 0], own.stops[s, 1]
            )
            change += abs(force - complex(push[x], push[x + 1]))
            push[x], push[x + 1] = force.real, force.imag
            most += abs(force)
        if stops == 1 or not change > LEAST * most:
            break
    for r in range(first):
        for j in range(first, size):
            push[r] -= push[size + r * size + j] * push[j]


@inlined
def hold_stops(own, push):
    """Find the forces of stops, in few steps other than 0, see `press_stops`."""
    size = len(own.give)
    first, beyond = size - 2 * len(own.stops), False
    for s in range(len(own.stops)):
        x = first + 2 * s
        for c in range(first):
            push[x] += own.give[x, c] * push[c]
            push[x + 1] += own.give[x + 1, c] * push[c]
        square = push[x] * push[x] + push[x + 1] * push[x + 1]
        beyond = beyond or square > own.stops[s, 0] * own.stops[s, 0]
    if beyond:
        press_stops(own, push)
        return
    for c in range(first, size):
        push[c] = 0.0


@kernel
def solve_supports(own, push):
    """Solve the equations for the forces of several supports, see `add_support`.

    own, push : `kernel_types.Stand`; in and out, its first 2 s entries become the
        forces, N
    """
    size = len(own.give)
    first = size - 2 * len(own.stops)
    if size == 2 and first == 2:
        return
    for r in range(first):
        row, right = size + r * size, push[r]
        for i in range(r):
            factor = push[row + i]
            right -= factor * push[i]
            for c in range(i + 1, size):
                push[row + c] -= factor * push[size + i * size + c]
        down = 1.0 / push[row + r]
        push[r] = right * down
        for c in range(r + 1, size):
            push[row + c] *= down
    for r in range(first - 2, -1, -1):
        for c in range(r + 1, first):
            push[r] -= push[size + r * size + c] * push[c]
    if first < size:
        hold_stops(own, push)


@kernel
def room_of(own):
    """Return the size of `push` of `add_support`.

    It has room for further (2 s,) forces, and for (2 s,) displacements of stops.

    own : `kernel_types.Stand`
    """
    size = len(own.give)
    return size + size * size + size + size


@inlined
def set_aside(own, push):
    """Copy the forces of s supports to the end of `push`, where they are kept."""
    size = len(own.give)
    for c in range(size):
        push[size + size * size + c] = push[c]


@inlined
def aside_of(own, push, c):
    """Return entry c of the forces that `set_aside` has kept, N."""
    size = len(own.give)
    return push[size + size * size + c]


@inlined
def turned_by_steps(support, number, turned):
    """Return e^{-i Omega t} at a step, by a table of the steps after every 64th.

    support, number : `loop.wave_types.SlotSupport` or `PointsSupport`; number of the
        step
    turned : (3,), in and out: re and im at such a step; its number
    """
    size = len(support.turns) // 2
    after = number & (size - 1)  # the size is a power of 2
    if turned[2] != number - after:
        stand = support.stand
        whole = turned_at(stand.speed[0] * ((number - after) * stand.step))
        turned[0], turned[1], turned[2] = whole.real, whole.imag, number - after
    return complex(turned[0], turned[1]) * complex(
        support.turns[2 * after], support.turns[2 * after + 1]
    )


@inlined
def directions(support, number, turned):
    """Return `when` of `terms_at` at a step; the arguments of `turned_by_steps`."""
    stand = support.stand
    angle = stand.speed[0] * (number * stand.step)
    return turned_by_steps(support, number, turned), angle


@part
def find_force(support, q, number, turned, push):
    """Compute the supports' forces in a step from the waves of equal sectors.

    support : `loop.wave_types.SlotSupport`; its slot is in the first group of four
    q : amplitudes after the step without forces
    number, turned : as in `turned_by_steps`, at the step's start
    push : (room,), N, out: the forces, x and y, see `add_support`
    """
    zero, reads, slot, stand = (
        broadcast(0.0),
        support.reads,
        support.slot,
        support.stand,
    )
    count, when = len(stand.film), directions(support, number, turned)
    size = len(reads) // count
    for p in range(count):
        a, b, c, d, at = zero, zero, zero, zero, p * size
        for i in range(0, size, 4 * FOUR):
            m, n = i + slot, at + i
            a = fma(load(reads, n), broadcast(get(q, m)), a)
            b = fma(load(reads, n + FOUR), broadcast(get(q, m + FOUR)), b)
            c = fma(load(reads, n + 2 * FOUR), broadcast(get(q, m + 2 * FOUR)), c)
            d = fma(load(reads, n + 3 * FOUR), broadcast(get(q, m + 3 * FOUR)), d)
        both = (a + b) + (c + d)
        place = complex(element(both, 0), element(both, 1))
        moving = complex(element(both, 2), element(both, 3))
        add_support(stand, p, place, moving, when, push)
    solve_supports(stand, push)


@part
def push_group(gives, at, size, x, y, q):
    """Add the change by a support's force to the amplitudes q of the first group.

    gives, at, size : `loop.wave_types.SlotSupport.gives`; index in it where those of
        the support begin; number of amplitudes
    x, y : N, the force, in all four lanes
    """
    for m in range(0, size, FOUR):
        gained = fma(load(gives, at + 2 * m + FOUR), y, load(q, m))
        store(q, m, fma(load(gives, at + 2 * m), x, gained))


@inlined
def give_shaft(support, push, sign, q, half):
    """Add the change by the supports' forces times `sign` to amplitudes q of waves.

    support, push : `loop.wave_types.PointsSupport`; N, the forces, x and y
    q, half : amplitudes, `half` real parts, then the imaginary ones
    """
    which, gives, at = support.which, support.gives, 0
    for p in range(len(support.stand.film)):
        x, y = broadcast(sign * push[2 * p]), broadcast(sign * push[2 * p + 1])
        for i in range(len(which)):
            m = get(which, i)
            re, im = load_both(q, half, m)
            re, im = fma(load(gives, at), x, re), fma(load(gives, at + FOUR), x, im)
            at += 2 * FOUR
            re, im = fma(load(gives, at), y, re), fma(load(gives, at + FOUR), y, im)
            at += 2 * FOUR
            store_both(q, half, m, (re, im))


@part
def hold_shaft(support, q, number, turned, push):
    """Apply the supports' forces in a step to the amplitudes q of waves.

    support : `loop.wave_types.PointsSupport`
    q : amplitudes, in and out: in those after the step without forces
    number, turned : as in `turned_by_steps`, at the step's start
    push : (room,), N, out: the forces, x and y, see `add_support`
    """
    zero, which, stand = broadcast(0.0), support.which, support.stand
    reads, half, at = support.reads, len(q) // 2, 0
    when = directions(support, number, turned)
    for p in range(len(stand.film)):
        a, b, c, d, e, f, g, h = zero, zero, zero, zero, zero, zero, zero, zero
        for i in range(len(which)):  # eight sums hide the latency of the units
            re, im = load_both(q, half, get(which, i))
            a, e = fma(load(reads, at), re, a), fma(load(reads, at + FOUR), im, e)
            at += 2 * FOUR
            b, f = fma(load(reads, at), re, b), fma(load(reads, at + FOUR), im, f)
            at += 2 * FOUR
            c, g = fma(load(reads, at), re, c), fma(load(reads, at + FOUR), im, g)
            at += 2 * FOUR
            d, h = fma(load(reads, at), re, d), fma(load(reads, at + FOUR), im, h)
            at += 2 * FOUR
        place = complex(total_of(a + e), total_of(b + f))
        moving = complex(total_of(c + g), total_of(d + h))
        add_support(stand, p, place, moving, when, push)
    solve_supports(stand, push)
    give_shaft(support, push, 1.0, q, half)


@part
def stand(body, motion, angle, force):
    """Compute the forces of supports on the rotor; add their effect to a step.

    The increments due to it are added to motion.ahead and motion.following, the
    predicted step without contact. At a changing speed the forces on the motion without
    contact, r, are those on r alone; those on y complete them to those on y + r.

    body, motion : `kernel_types.Body`; `oracle.body.Motion`
    angle : rad, of the rotor, at which the supports' directions are taken
    force : (room,), N, out, rotating frame: those on y, see `add_support`
    """
    own, when = body.stand, (turned_at(angle), angle)
    if len(own.hub) == 0:
        return
    last = own.hub.shape[1]
    first = min(body.own, last)
    if first < last:
        press_supports(own, motion, when, first, last, force)
    set_aside(own, force)
    press_supports(own, motion, when, first - first, last, force)
    if first < last:
        for c in range(len(own.hub)):
            force[c] -= aside_of(own, force, c)
        yield_to(own, motion, first, last, len(own.give) * (1 + len(own.give)), force)
    yield_to(own, motion, first - first, first, 0, force)


@inlined
def press_supports(own, motion, when, first, last, force):
    """Compute the forces of supports on coordinates first .. last - 1 of a rotor.

    own, motion, force : `kernel_types.Stand`; as in `stand`
    when : as in `terms_at`
    """
    q, d, _, ahead, _, _, _ = motion
    for p in range(len(own.film)):
        place = at_support(own.hub, p, q, first, last)
        moved = at_support(own.hub, p, d, first, last)
        rises = at_support(own.hub, p, ahead, first, last)
        moving = (moved + rises) / (2.0 * own.step)
        if p >= len(own.film) - len(own.stops):
            moving = place + rises
        add_support(own, p, place, moving, when, force)
    solve_supports(own, force)


@inlined
def yield_to(own, motion, first, last, at, force):
    """Add the effect of the supports' forces, force[at:], to coordinates of a rotor."""
    _, _, _, ahead, following, _, _ = motion
    for m in range(first, last):
        change = 0.0
        for c in range(len(own.hub)):
            change += own.moved[c, m] * force[at + c]
        ahead[m] += change
        following[m] += change


@part
def yielded(body, motion, force):
    """Subtract the work of the supports' forces in a step, J, from the damping loss.

    force : (room,), N, as `stand` has set it
    """
    own = body.stand
    last = min(body.own, own.hub.shape[1])
    for p in range(len(own.film)):
        both = at_support(own.hub, p, motion.d, 0, last)
        both += at_support(own.hub, p, motion.ahead, 0, last)
        x, y = force[2 * p], force[2 * p + 1]
        motion.loss[0] -= 0.5 * (x * both.real + y * both.imag)
