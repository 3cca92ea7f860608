"""Set-valued friction of contact points, a term of the loop `points`; see `coulomb`.

As for equal sectors (`slot_slides`) a step is solved with permanent sliding first. If
that breaks Coulomb's law, normal forces and friction tau are found together. Waves have
friction mu lambda with the multipliers; the rest, tau - mu lambda, is a force along
theta for each point, the last of the step's forces of `wave_types.PointRows`.
"""

from __future__ import annotations

from hpcwhirl.dynamics.kernels.compiled import inlined, part
from hpcwhirl.dynamics.kernels.contact import FRICTION, book_work
from hpcwhirl.dynamics.kernels.coulomb import (
    CLEAR,
    STICKS,
    book_rub,
    dragged,
)
from hpcwhirl.dynamics.kernels.keep_inverse import blade_at, place_of
from hpcwhirl.dynamics.kernels.layer import choose_on, rub_on
from hpcwhirl.dynamics.kernels.loop.point_rows import read_every
from hpcwhirl.dynamics.kernels.loop.whole import (
    add_rows,
    open_whole,
    put,
    tip_by_waves,
)


@inlined
def is_loose(slides):
    """Return whether friction is set-valued."""
    return len(slides.drag) > 0


@part
def slide_on(slides, mu, moved, active, q, space):
    """Return whether all points in contact slide with the rotation.

    friction.state becomes the states of all points, as by `coulomb.obeyed`.

    moved : m, Omega R dt
    active : number of points in contact, the first ones of the solver's
    """
    law, push, where = slides.law, space.solver.push, space.solver.where
    points, modes = len(slides.rush), len(slides.rises) // len(slides.rush)
    states, obeys = space.friction.state, not law.always
    states[:] = CLEAR
    for s in range(active):
        if push[s] > 0.0 and law.friction > 0.0:
            j = where[s]
            slid = tip_by_waves(slides.rises, j, q, modes) - moved
            for i in range(active):
                row = where[i]
                drag = law.rotor[points + row, points + j]
                slid += push[i] * (law.rotor[row, points + j] + mu * drag)
            states[j] = dragged(slid, mu)
            obeys = obeys and states[j] != STICKS
    return obeys


@part
def rub_points(rows, contact, mu, moves, free, row, state, space):
    """Solve a step's normal forces and friction together, by Coulomb's law.

    Return the number of points in contact, -1 without a solution. What friction has
    beyond that of permanent sliding is written to space.friction.slides, for the points
    of space.solver.where in turn.

    moves : m, Omega R dt of this step and of the step before
    free, row : amplitudes before any force of the step; index of the step's clearances
    """
    friction, solver, whole, q = space.friction, space.solver, space.opened, state.rotor
    slides, rods, points = contact.slides, contact.rods, len(solver.near)
    wide = len(whole) // 2
    read_every(rows, q, points, space.out, space.spectra)
    open_whole(space.out, state.gaps, row, whole)
    for j in range(points):
        solver.near[j] = whole[place_of(j, points, wide)]
    size, more, active = 0, choose_on(rods, solver.near, slides.law, friction), 0
    while size < more:
        set_slides(slides, size, more, moves, free, q, friction)
        size = more
        active, more = rub_on(
            rods, size, slides, state.worn, solver, friction, space.layer
        )
    for j in range(points):
        put(whole, j, points, wide, solver.opened[j])
    for s in range(active):
        j = solver.where[s]
        solver.push[s] = solver.lam[j]
        friction.slides[s] = friction.after[j] - mu * solver.lam[j]
    return active


@part
def set_slides(slides, first, last, moves, free, q, friction):
    """Set slides of the points friction.chosen[first:last], see `coulomb.rub`.

    moves, free : as in `rub_points`
    q : amplitudes before contact forces
    """
    modes = len(slides.rises) // len(slides.rush)
    for s in range(first, last):
        j = friction.chosen[s]
        friction.slides[j] = tip_by_waves(slides.rises, j, q, modes) - moves[0]
        if slides.law.always:
            before = tip_by_waves(slides.pasts, j, free, modes)
            friction.before[j] = before - moves[1]


@inlined
def slide_points(rows, contact, mu, speed, moves, free, row, active, state, space):
    """Return the number of points in contact by Coulomb's law, and whether it is new.

    The second is whether friction is not that of permanent sliding. Arguments are those
    of `slide_on` and `rub_points`; the friction is entered in the account.
    """
    slides, solver = contact.slides, space.solver
    loose = not slide_on(slides, mu, moves[0], active, state.rotor, space) or active < 0
    if loose:
        active = rub_points(rows, contact, mu, moves, free, row, state, space)
    book_rub(mu, solver.push, solver.where, active, speed, slides.step, moves, loose,
             state, space.friction)  # fmt: skip
    return active, loose


@part
def rub_aside(slides, mu, active, loose, state, space):
    """Enter the work of a step's friction on the motion without contact.

    loose : whether friction is not that of permanent sliding
    """
    push, where, work = space.solver.push, space.solver.where, 0.0
    modes = len(slides.aside) // len(state.last)
    for s in range(active):
        tau = space.friction.tau[where[s]] if loose else mu * push[s]
        work += tau * tip_by_waves(slides.aside, where[s], state.rotor, modes)
    book_work(FRICTION, 0.5 * work, -0.5 * work, state.ledger)


@part
def put_rest(slides, active, at, q, space):
    """Write the rest of friction to the forces of a step; apply it to waves and gaps.

    at : index of its first force in space.spare
    q : amplitudes of the waves, in and out
    """
    rest, where, out = space.friction.slides, space.solver.where, space.out
    points, wide = len(slides.rush), len(space.out) // 2
    for s in range(active):
        j = where[s]
        space.spare[at + j] = rest[s]
        space.bounds[0] += abs(rest[s]) * slides.rush[j]
        for i in range(2 * wide):
            own = blade_at(i, points, wide)
            out[i] += rest[s] * slides.law.rotor[points + j, own]
    add_rows(slides.drag, rest, where, active, q, len(q))


@part
def book_rest(active, state, space):
    """Enter the work of the rest of friction.

    The points' motions along the casing are the first entries of state.lam.
    """
    rest, where, work = space.friction.slides, space.solver.where, 0.0
    for s in range(active):
        work += 0.5 * rest[s] * state.lam[where[s]]
    state.ledger[FRICTION] += work
    state.sums_b[2] += work
