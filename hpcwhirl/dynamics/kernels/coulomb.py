"""Set-valued friction: which tips in contact slide, which way, and which stick.

Permanent sliding, which `contact` assumes, drags each tip against the rotation. Here
each tip in contact obeys Coulomb's law. With v the tangential velocity of the casing at
the tip less that of the tip, and tau the friction on the casing, -tau that on the tip,
both along increasing theta,

|tau| <= mu lambda,    tau = -mu lambda sgn v where v is not 0.

A tip that only rotates has v = -Omega R, so that tau = mu lambda for Omega > 0, as
with permanent sliding. v is the velocity after the step: implicit, so that a tip that
sticks stays where it is. v dt is called the slide of a step, m.

The slide of tip i is y_i, without contact forces, plus what the multipliers and the
friction on all tips add. With v dt = v_+ - v_-, tau_R = mu lambda + tau and tau_L = mu
lambda - tau the contact problem of the plane is linear (Pfeiffer and Glocker, Multibody
Dynamics with Unilateral Contacts, 1996, chapter 6): for all tips

g, v_+, tau_L >= 0 are complementary to lambda, tau_R, v_- >= 0.

It is solved for the tips that penetrate without contact forces, then anew with those
that penetrate with them. The first guess is the solution with permanent sliding, in
which tips that would be dragged backward stick; states that break the law are
corrected, and linear equations of few tips solved again. Where this does not end soon,
Lemke's method (`pivoting`) finds the states. Where the solution with permanent sliding
obeys the law, it is kept, with the same bits. Both time loops use it: that of waves has
the response of both bodies in the frame of the blades, which is constant.

What is tried first follows from the step alone, not from the states of the step before,
which no saved run has: results do not depend on where a run was stopped.
"""

from __future__ import annotations

import math

import numpy as np

from hpcwhirl.dynamics.kernels.compiled import by_numba, kernel, part, rare
from hpcwhirl.dynamics.kernels.contact import (
    HEAT,
    MET,
    REVERSED,
    STUCK,
    TANGENTIAL,
    TURNED,
    contact_space,
)
from hpcwhirl.dynamics.kernels.kernel_types import CoulombSpace
from hpcwhirl.dynamics.kernels.pivoting import (
    APART,
    CLOSED,
    GOLDEN,
    carriers,
    solve_dense,
)

# states of a tip: clear of the casing; sticking; the casing slides past it towards
# decreasing or increasing theta
CLEAR, STICKS, BEHIND, AHEAD = 0, 1, 2, 3
ROUNDS = 4  # number of times that states are corrected before Lemke's method is used
SLACK = 1e-9  # relative tolerance of Coulomb's law after the equations are solved anew


@by_numba()
def coulomb_space(points, coordinates):
    """Return new work arrays of `rub`, for N contact points.

    points, coordinates : N, or 0 for permanent sliding; number R of the ring's radial
        coordinates
    """
    return CoulombSpace(
        np.zeros((2 * points, 2 * points)),
        np.zeros(points, np.int64),
        np.zeros(2 * coordinates),
        np.zeros(points),
        np.zeros(points),
        np.zeros(points),
        np.zeros(points),
        np.zeros(points),
        np.zeros(points, np.int64),
        np.zeros(points, np.int64),
        contact_space(3 * points, 0),
    )


def constant_response(points, law, *, springs):
    """Return new work arrays of `rub` where the response of both bodies is constant.

    points, law : N; `kernel_types.Coulomb`, empty for permanent sliding
    springs : whether tips rub on springs, see `layer.rub_rods`, which change entries
    """
    used = points * (len(law.rotor) > 0)
    space = coulomb_space.py_func(used, 0)
    columns = law.rotor.copy() if springs else law.rotor
    return space._replace(columns=columns, have=np.ones(used, np.int64))


@part
def respond(j, law, index, shape, space):
    """Compute how unit forces on a tip change all gaps and slides, unless known.

    Rows j and N + j of space.columns are set: the effect of a unit multiplier on tip j,
    and of a unit of friction.

    law : `kernel_types.Coulomb`
    index, shape : (N, w), the coordinates of the ring that move each point, and weights
    space : `kernel_types.CoulombSpace`
    """
    if space.have[j] == 1:
        return
    space.have[j] = 1
    response, size = space.response, len(space.have)
    half = len(response) // 2
    for side in range(2):
        column = space.columns[side * size + j]
        for i in range(2 * size):
            column[i] = law.rotor[side * size + j, i]
        if half == 0:
            continue
        response[:] = 0.0
        for a in range(index.shape[1]):
            row, weight = law.ring[side * half + index[j, a]], shape[j, a]
            for r in range(len(response)):
                response[r] += weight * row[r]
        for i in range(size):
            for a in range(index.shape[1]):
                at, weight = index[i, a], shape[i, a]
                column[i] += weight * response[at]
                column[size + i] += weight * response[half + at]


@part
def obeyed(mu, law, lam, space):
    """Return whether the solution with permanent sliding obeys Coulomb's law.

    It does if all tips in contact still slide with the rotation, and neither friction
    nor wear depends on their slides.

    mu : friction with the sign of the speed
    lam : (N,), multipliers of this solution, N; space.after has its slides, m, and
        space.state becomes the states of all tips, of which one that could not slide so
        sticks
    """
    obeys = not law.always
    for j in range(len(lam)):
        space.state[j] = CLEAR
        if lam[j] > 0.0 and law.friction > 0.0:
            space.state[j] = dragged(space.after[j], mu)
            obeys = obeys and space.state[j] != STICKS
    return obeys


@part
def dragged(slide, mu):
    """Return the state of a tip in the solution with permanent sliding.

    It slides with the rotation, or else is taken to stick.

    slide, mu : m; friction with the sign of the speed
    """
    if slide * mu < 0.0:
        return BEHIND if mu > 0.0 else AHEAD
    return STICKS


@rare
def set_table(gaps, size, unit, largest, space):
    """Set up Lemke's table for the tips space.chosen[:size], see the module's text.

    Variables are numbered as in `pivoting.set_out`, for 3 size rows: first g, v_+ and
    tau_L, then lambda, tau_R and v_-, of all tips each. Forces are multiplied by `unit`
    and all divided by `largest`.

    gaps : (N,), m, without contact forces
    unit, largest : m/N; m
    """
    table, tips, rows = space.table, len(gaps), 3 * size
    small, right, columns = table.small, table.right, space.columns
    for r in range(rows):
        small[r, :rows] = 0.0
        small[r, rows] = 1.0
        table.held[r], table.left[r] = r, rows + r
    table.left[rows] = 2 * rows
    for r in range(size):
        i = space.chosen[r]
        right[r] = gaps[i] / largest
        right[size + r] = space.slides[i] / largest
        right[2 * size + r] = 0.0
        for s in range(size):
            j = space.chosen[s]
            mu = space.mu[j]
            for side in range(2):
                at = side * tips + i
                drag = columns[tips + j, at] / unit
                small[side * size + r, s] = columns[j, at] / unit - mu * drag
                small[side * size + r, size + s] = drag
        small[size + r, 2 * size + r] = 1.0
        small[2 * size + r, r] = 2.0 * space.mu[i]
        small[2 * size + r, size + r] = -1.0
    for r in range(rows):
        share = GOLDEN * (r + 1)
        right[r] += APART * (share - int(share))


@rare
def read_table(size, unit, largest, lam, space):
    """Read each chosen tip's state and forces from the table that Lemke's method left.

    lam, space.tau, space.state : (N,), out: N; N; for other tips they are 0
    """
    table, rows, state, tau = space.table, 3 * size, space.state, space.tau
    lam[:] = 0.0
    tau[:] = 0.0
    state[:] = CLEAR
    scale = largest / unit
    for r in range(rows):
        variable = table.held[r] - rows
        if 0 <= variable < size and table.right[r] > 0.0:
            j = space.chosen[variable]
            lam[j], state[j] = table.right[r] * scale, STICKS
    for r in range(rows):
        variable, value = table.held[r], table.right[r] * scale
        if size <= variable < 2 * size:
            j = space.chosen[variable - size]
            if state[j] != CLEAR:
                state[j] = AHEAD
        elif variable >= rows + size:
            j = space.chosen[(variable - rows) % size]
            if state[j] == CLEAR:
                continue
            if variable < rows + 2 * size:
                tau[j] = value
            else:
                state[j] = BEHIND
    for s in range(size):
        j = space.chosen[s]
        if state[j] != CLEAR:
            tau[j] -= space.mu[j] * lam[j]


@part
def settle_slides(gaps, size, lam, space):
    """Solve the contact's equations for the states that space.state names.

    Touching tips have gap 0; those that stick slide 0; the others have the friction mu
    lambda against their slide. A tip that would pull becomes clear, one that cannot
    stick slides, and the equations are solved again. Return whether they are regular
    and their solution obeys the law; else lam and space.tau stay as they are.

    gaps, lam : (N,), m, without contact forces; (N,), N, in and out
    """
    right, state, where = space.table.right, space.state, space.table.where
    for _ in range(2 * size + 2):
        touching, last = number_unknowns(size, space)
        if not solve_states(gaps, touching, last, space):
            return False
        most, wrong, sticking = 0.0, 0, touching
        for s in range(touching):
            most = max(most, right[s])
        for s in range(touching):
            j = where[s]
            if state[j] == STICKS:
                drag = right[sticking]
                sticking += 1
                if abs(drag) > space.mu[j] * right[s] + SLACK * most:
                    state[j] = BEHIND if drag > 0.0 else AHEAD
                    wrong += 1
            if right[s] < 0.0:
                state[j] = CLEAR
                wrong += 1
        if wrong == 0:
            break
    if wrong > 0:
        return False
    for s in range(size):
        lam[space.chosen[s]] = 0.0
        space.tau[space.chosen[s]] = 0.0
    sticking = touching
    for s in range(touching):
        j = where[s]
        lam[j] = right[s]
        space.tau[j] = slope(state[j]) * space.mu[j] * right[s]
        if state[j] == STICKS:
            space.tau[j] = right[sticking]
            sticking += 1
    return True


@part
def number_unknowns(size, space):
    """List the unknown forces in space.table.where: multipliers, then friction.

    Return (number of touching tips, number of unknowns). Friction on tip j, numbered N
    + j, is unknown if it sticks.
    """
    where, touching = space.table.where, 0
    for s in range(size):
        if space.state[space.chosen[s]] != CLEAR:
            where[touching] = space.chosen[s]
            touching += 1
    last = touching
    for s in range(touching):
        if space.state[where[s]] == STICKS:
            where[last] = len(space.have) + where[s]
            last += 1
    return touching, last


@part
def solve_states(gaps, touching, last, space):
    """Solve for the unknown forces of `number_unknowns`: into space.table.right.

    Return whether the equations are regular.
    """
    matrix, right, where = space.table.small, space.table.right, space.table.where
    tips, columns = len(gaps), space.columns
    for r in range(last):
        at = where[r]
        right[r] = -gaps[at] if at < tips else -space.slides[at - tips]
        for s in range(touching):
            j = where[s]
            drag = slope(space.state[j]) * space.mu[j]
            matrix[r, s] = columns[j, at] + drag * columns[tips + j, at]
        for s in range(touching, last):
            matrix[r, s] = columns[where[s], at]
    return solve_dense(matrix, right, last)


@part
def slope(state):
    """Return tau / (mu lambda) of a tip that slides in a state; 0 where it sticks."""
    if state == BEHIND:
        return 1.0
    if state == AHEAD:
        return -1.0
    return 0.0


@part
def open_gaps(gaps, lam, opened, space):
    """Compute the gaps with the contact forces acting, opened (N,), m.

    gaps, lam : (N,), m, without contact forces; (N,), N
    """
    size = len(gaps)
    for i in range(size):
        opened[i] = gaps[i]
    for j in range(size):
        if lam[j] > 0.0:
            push, drag = space.columns[j], space.columns[size + j]
            for i in range(size):
                opened[i] += lam[j] * push[i] + space.tau[j] * drag[i]


@part
def guess_states(gaps, size, least, lam, space):
    """Solve for the forces in the states of space.state; correct these.

    A tip that is not clear of the casing, or slides with its friction, is taken to
    stick in the next round. Return whether the forces obey the law in the end.

    gaps, lam : (N,), m, without contact forces; (N,), N, in and out
    size, least : the tips are space.chosen[:size]; m, largest penetration
    """
    state = space.state
    for _ in range(ROUNDS):
        if not settle_slides(gaps, size, lam, space):
            return False
        wrong = 0
        for s in range(size):
            i = space.chosen[s]
            if state[i] == CLEAR:
                gap = moved_to(gaps[i], i, size, lam, space)
                wrong += stick_if(gap < -CLOSED * least, i, state)
            elif state[i] != STICKS:
                slide = moved_to(space.slides[i], len(gaps) + i, size, lam, space)
                wrong += stick_if(slope(state[i]) * slide > 0.0, i, state)
        if wrong == 0:
            return True
    return False


@part
def stick_if(wrong, tip, state):
    """Take a tip to stick if its state is wrong; return 1 then, else 0."""
    if wrong:
        state[tip] = STICKS
        return 1
    return 0


@part
def moved_to(free, at, size, lam, space):
    """Return a gap or slide, m, with the forces of the tips space.chosen[:size].

    free, at : its value without them; its column in space.columns
    """
    tips, total = len(lam), free
    for s in range(size):
        j = space.chosen[s]
        total += lam[j] * space.columns[j, at]
        total += space.tau[j] * space.columns[tips + j, at]
    return total


@rare
def by_lemke(gaps, size, unit, largest, lam, space):
    """Find states and forces of the tips space.chosen[:size] by Lemke's method.

    Return whether it ends with a solution, and whether the equations of its states were
    solved anew, so that gaps of touching tips are 0.

    gaps, lam : (N,), m, without contact forces; (N,), N, out
    unit, largest : as in `set_table`
    """
    set_table(gaps, size, unit, largest, space)
    if not carriers(3 * size, space.table):
        return False, False
    read_table(size, unit, largest, lam, space)
    return True, settle_slides(gaps, size, lam, space)


@part
def solve_coulomb(gaps, size, law, index, shape, lam, opened, space):
    """Compute normal forces and friction of the tips space.chosen[:size].

    Return the number of tips in contact, -1 if no solution was found, and the number of
    tips chosen, to which those are added that penetrate with these forces.

    Parameters
    ----------
    gaps : (N,), m, without contact forces
    law, index, shape : as in `respond`
    lam, opened : (N,), out: N, multipliers; m, gaps with the contact forces acting
    space : `kernel_types.CoulombSpace`, with `slides` and `mu` of these tips
    """
    chosen, least, largest, unit = space.chosen, 0.0, 0.0, 0.0
    for s in range(size):
        j = chosen[s]
        respond(j, law, index, shape, space)
        unit = max(unit, abs(space.columns[j, j]))
        least, largest = max(least, -gaps[j]), max(largest, abs(space.slides[j]))
    largest = max(largest, least)
    if unit == 0.0:
        return -1, size
    exact = guess_states(gaps, size, least, lam, space)
    if not exact:
        solved, exact = by_lemke(gaps, size, unit, largest, lam, space)
        if not solved:
            return -1, size
    open_gaps(gaps, lam, opened, space)
    more, allowed = size, CLOSED * max(least, largest * APART / CLOSED)
    for j in range(len(gaps)):
        if opened[j] < -allowed:
            chosen[more], space.state[j] = j, STICKS
            more += 1
    if more == size:
        return touching_of(lam, opened, exact=exact), size
    for s in range(size):
        if opened[chosen[s]] < -CLOSED * least:
            return -1, size
    return 0, more


@part
def touching_of(lam, opened, exact):
    """Return the number of tips with a multiplier; set their gaps to 0 if exact."""
    active = 0
    for j in range(len(lam)):
        if lam[j] > 0.0:
            active += 1
            if exact:
                opened[j] = 0.0
    return active


@part
def coefficient_in(table, speed):
    """Return mu at a sliding speed, m/s: linear between rows, held beyond the last.

    table : as in `kernel_types.Coulomb`
    """
    size = len(table) // 2
    for k in range(1, size):
        if speed < table[k]:
            share = (speed - table[k - 1]) / (table[k] - table[k - 1])
            return (1.0 - share) * table[size + k - 1] + share * table[size + k]
    return table[2 * size - 1]


@part
def coefficients(law, step, size, space):
    """Set space.mu of the chosen tips by the slide of each in the step before.

    law, step : `kernel_types.Coulomb`; dt, s
    size : the tips are space.chosen[:size]
    """
    for s in range(size):
        j = space.chosen[s]
        space.mu[j] = law.friction
        if len(law.table) > 0:
            space.mu[j] = coefficient_in(law.table, abs(space.before[j]) / step)
        elif law.decay > 0.0:
            fall = math.exp(-abs(space.before[j]) / (law.decay * step))
            space.mu[j] += (law.at_rest - law.friction) * fall


@kernel
def choose(gaps, law, space):
    """List the tips that penetrate in space.chosen, for `rub`; return their number.

    gaps, law : (N,), m, without contact forces; `kernel_types.Coulomb`
    """
    if len(law.ring) > 0:
        space.have[:] = 0  # the response changes as the blades pass
    size = 0
    for j in range(len(gaps)):
        if gaps[j] < 0.0:
            space.chosen[size] = j
            size += 1
    return size


@kernel
def rub(gaps, size, law, step, index, shape, lam, tau, opened, touch, space):
    """Compute normal forces and friction of a step by Coulomb's law.

    Return the number of tips in contact, -1 without a solution, and the number of tips
    chosen. If this exceeds `size`, further tips penetrate: their slides are to be set,
    and the function called again. Tips in contact, and their multipliers, are listed in
    touch.where and touch.right.

    Parameters
    ----------
    gaps, size : (N,), m, without contact forces; number of tips chosen, see `choose`
    law, step : `kernel_types.Coulomb`; dt, s
    index, shape : as in `respond`
    lam, tau, opened : (N,), out: N, multipliers; N, friction on the casing; m, gaps
    touch, space : `kernel_types.ContactSpace`; `CoulombSpace`, whose `slides` are those
        of the chosen tips, and if law.always `before`, too; its `state` is the first
        guess, all other tips being clear
    """
    coefficients(law, step, size, space)
    lam[:] = 0.0
    space.tau[:] = 0.0
    active, more = solve_coulomb(gaps, size, law, index, shape, lam, opened, space)
    list_rubbing(lam, tau, touch, space)
    return active, more


@part
def list_rubbing(lam, tau, touch, space):
    """List the tips in contact and their multipliers; copy the friction to tau.

    lam, tau, touch, space : as in `rub`
    """
    listed = 0
    for j in range(len(lam)):
        tau[j] = space.tau[j]
        if lam[j] > 0.0:
            touch.where[listed], touch.right[listed] = j, lam[j]
            listed += 1


@part
def book_slides(lam, tau, step, mu, moves, counter, ledger, space):
    """Enter a step's friction in the account: its heat, its impulse, tips that stick.

    The work on the slide, tau (y_n + y_{n-1}) / 2, is negative: heat. y_n is the slide
    of step n, space.after, y_{n-1} that of the step before.

    lam, tau : (N,), N, multipliers; friction on the casing
    step, mu, moves : dt, s; friction with the sign of the speed; Omega R dt of this
        step and of the last, m
    counter, ledger : of the run; entries HEAT, TURNED, TANGENTIAL, MET, STUCK and
        REVERSED grow
    """
    for j in range(len(lam)):
        if lam[j] > 0.0:
            slid, back = space.after[j], space.before[j]
            ledger[HEAT] += 0.5 * tau[j] * (slid + back)
            ledger[TURNED] += 0.5 * tau[j] * (moves[0] + moves[1])
            ledger[TANGENTIAL] += tau[j] * step
            counter[MET] += 1
            sticks = space.state[j] == STICKS
            counter[STUCK] += sticks
            counter[REVERSED] += not sticks and tau[j] * mu < 0.0


@part
def book_rub(mu, push, where, active, speed, step, moves, loose, state, space):
    """Enter a step's friction in the account of the loop `points`, as `book_slides`.

    Heat is what the rotation gives, TURNED, less the work on motions, which the ledger
    has.

    mu, push, where, active : friction of permanent sliding; multipliers, N, of the tips
        where[:active]
    speed, step, moves : Omega, rad/s; dt, s; Omega R dt of this step and of the last, m
    loose : whether friction is that of `rub`, in space.tau; else mu times multipliers
    space : `kernel_types.CoulombSpace`
    """
    counter, ledger, both = state.counter, state.ledger, moves[0] + moves[1]
    for s in range(active):
        j = where[s]
        tau = space.tau[j] if loose else mu * push[s]
        ledger[TURNED] += 0.5 * tau * both
        ledger[TANGENTIAL] += tau * step
        counter[MET] += push[s] > 0.0
        sticks = loose and space.state[j] == STICKS
        counter[STUCK] += sticks
        counter[REVERSED] += not sticks and tau * speed < 0.0
