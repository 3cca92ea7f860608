"""Layer on the casing that wears: rods side by side, each over an equal angle.

A tip presses all rods under its edge down to the same depth s below the unworn surface.
A rod is pushed in elastically by e = flex N under the force N, and wears by w. A step
with N beyond the limit L = limit + growth w wears it by soft (N - L). An abradable,
plastic rod has soft = 1 / growth; by Archard's law L = 0 and soft is proportional to
the sliding distance of a step. In both laws the force on a tip, the sum over its rods,
is an increasing, piecewise linear function P(s): a compliance on the diagonal of the
contact problem, solved implicitly with all tips at once by Newton's method. Nearly
always the tips that would sink into rods without contact are those that press, and one
or two linear problems of these tips suffice; else each step of Newton's method solves
the contact problem of all tips.

A tip that slides onto a higher rod pushes it down to where the tip is. The rotation
does the work of that, V(s - w) with the depth s before the step, by the slope of the
layer's surface, as it does on the slope of a casing; V is the area below the force that
pushes the rod in. The work of pushing it further is done by the tip itself. A rod that
a tip leaves returns its elastic energy to the rotation.

With set-valued friction (`coulomb`) the tips of each step of Newton's method rub on its
springs: a spring adds its compliance to the diagonal of the problem, normal and
tangential, that `coulomb` solves. By Archard's law a rod then wears by its tip's slide
in the step before.
"""

from __future__ import annotations

import math

import numpy as np

from hpcwhirl.dynamics.kernels.compiled import by_numba, inlined, part, rare
from hpcwhirl.dynamics.kernels.contact import (
    IMPACT,
    WEAR,
    book_work,
    complementarity,
    delassus_rows,
)
from hpcwhirl.dynamics.kernels.coulomb import (
    CLEAR,
    choose,
    coefficients,
    list_rubbing,
    respond,
    rub,
    solve_coulomb,
)
from hpcwhirl.dynamics.kernels.keep_inverse import (
    CHANGED,
    REGULAR,
    SIZE,
    SOUND,
    place_of,
)
from hpcwhirl.dynamics.kernels.kernel_types import LayerSpace
from hpcwhirl.dynamics.kernels.vectors import FOUR, broadcast, fnma, load, store

# rows of `worn` in the state: worn depth, m; work of wear and of the rotation, J
DEPTH, WORK, CUT = 0, 1, 2
EQUAL = 1e-11  # tolerance of P(s) = multiplier, relative to the largest force
ROUND = 1e-15  # relative round-off of the depth s of a tip
ALONE = 8  # most Newton steps with the pressing tips alone
ATTEMPTS, PATIENCE = 300, 20  # most Newton steps; steps after which they are halved


@by_numba()
def layer_space(blades):
    """Return new work arrays for the contact of N tips with a layer that wears.

    See `layer`; blades : N
    """
    width = blades + FOUR - blades % FOUR  # of `row_of_springs`
    return LayerSpace(
        np.zeros(blades, np.int64), np.zeros(blades, np.int64), np.zeros(blades),
        np.zeros(blades), np.zeros(blades), np.zeros(blades), np.zeros(blades),
        np.zeros(blades), np.zeros((blades, blades)), np.zeros(blades * width),
    )  # fmt: skip


@inlined
def row_of_springs(blades):
    """Return the length of a row of `LayerSpace.springs`: N, a right side, padding."""
    return blades + FOUR - blades % FOUR


@part
def to_worn(turned, before, points, worn, under, space, gaps, last):
    """Find the rods under each tip; return the lowest gap of a tip to its rods, m.

    Parameters
    ----------
    turned, before : rad, angles of blade 0 at the end and at the start of the step
    points : `kernel_types.Points`, the positions of the N tips
    worn : (3, M), state of the layer's M rods: worn depth, m, and works, J, see
        `kernel_types.BodiesState`
    under : number of rods under a tip
    space : `kernel_types.LayerSpace`; out: the first rod under each tip at both angles,
        `rod` and `left`, the latter only for tips that were below the unworn surface;
        `high`, worn depth of the least worn rod under tips that are below it, m
    gaps : (N,), m, to the unworn surface; only tips below it (gap < 0) count, and 1 is
        returned if there are none
    last : (N,), m, gaps to the unworn surface at the start of the step
    """
    lowest, size = 1.0, worn.shape[1]
    for j in range(len(gaps)):
        own = points.angle[j]
        space.rod[j] = space.left[j] = first_rod(turned + own, size, under)
        if last[j] < 0.0:
            space.left[j] = first_rod(before + own, size, under)
        if gaps[j] < 0.0:
            space.high[j] = highest(worn, space.rod[j], under)
            lowest = min(lowest, gaps[j] + space.high[j])
    return lowest


@inlined
def first_rod(angle, size, under):
    """Return the number of the first of the `under` rods that are under a tip.

    angle, size : rad, of the tip in the static frame; number of rods around the casing
    """
    part = angle / (2.0 * math.pi)
    centred = (part - math.floor(part)) * size - 0.5 * (under - 1)
    first = math.floor(centred)
    first = first + size if first < 0 else first
    return first - size if first >= size else first


@inlined
def after(rod, size):
    """Return the number of the rod beside a rod, along the rotation."""
    return rod + 1 if rod + 1 < size else 0


@inlined
def covers(first, rod, size, under):
    """Return whether a tip is over a given rod of the layer.

    first, under : number of the first rod under the tip; how many rods are under it
    rod, size : number of the rod; number of rods around the casing
    """
    apart = rod - first
    return (apart + size if apart < 0 else apart) < under


@inlined
def highest(worn, first, under):
    """Return the worn depth, m, of the least worn of the rods under a tip.

    worn : (3, M), state of the layer's rods; its first row is the worn depth, m
    first, under : number of the first rod under the tip; how many rods are under it
    """
    least, rod = worn[DEPTH, first], first
    for _ in range(1, under):
        rod = after(rod, worn.shape[1])
        least = min(least, worn[DEPTH, rod])
    return least


@inlined
def limit_of(layer, depth):
    """Return the force, N, beyond which a rod of worn depth `depth`, m, wears.

    layer : `kernel_types.Layer`, which has the limit of an unworn rod and its growth
    """
    return layer.limit + layer.growth * depth


@inlined
def rod_force(layer, softness, depth, sunk):
    """Return the force of one rod on a tip, its derivative by the depth, and a range.

    They are in N, N/m and m: within the range, the derivative is the same.

    layer : `kernel_types.Layer`
    softness : m/N, wear in a step per force beyond the limit
    depth, sunk : m, worn depth of the rod; depth of the tip below the unworn surface
    """
    way, stiff, yields = sunk - depth, 1.0 / layer.flex, 1.0 / (layer.flex + softness)
    force, slope = way * stiff, stiff
    worn_in = (way + softness * limit_of(layer, depth)) * yields
    if worn_in < force:  # beyond the limit, where both are equal
        force, slope = worn_in, yields
    alike = min(abs(way), abs(way - layer.flex * limit_of(layer, depth)))
    return (force, slope, alike) if way > 0.0 else (0.0, 0.0, -way)


@part
def tip_force(layer, softness, worn, first, sunk):
    """Return P(s), the force of all rods under a tip, N, its derivative and a range.

    The derivative dP/ds, N/m, is the same for all depths within the range, m, from s.

    layer, softness : `kernel_types.Layer`; m/N, wear in a step per force beyond the
        limit
    worn : (3, M), state of the layer's rods; its first row is the worn depth, m
    first, sunk : number of the first rod under the tip; s, m, depth of the tip below
        the unworn surface
    """
    force, slope, alike, rod = 0.0, 0.0, abs(sunk), first
    if sunk <= 0.0:
        return force, slope, alike
    for _ in range(layer.under):
        one, steep, near = rod_force(layer, softness, worn[DEPTH, rod], sunk)
        force += one
        slope += steep
        alike = min(alike, near)
        rod = after(rod, worn.shape[1])
    return force, slope, alike


@part
def press(layer, worn, gaps, w_rotor, compliance, index, shape, lam, opened,
          space, own):  # fmt: skip
    """Compute the contact forces of all tips on the layer by Newton's method.

    Solve lam = P(-g - W lam): lam are the multipliers, P(s) is the force of the rods on
    a tip at the depth s, g are the gaps without contact, W is the Delassus matrix of
    both bodies. The solution is unique. Return the number of tips with lam > 0, or -1
    if no solution was found.

    Parameters
    ----------
    layer : `kernel_types.Layer`
    worn : (3, M), state of the layer's rods; its first row is the worn depth, m
    gaps : (N,), m, g, to the unworn surface
    w_rotor, compliance, index, shape, space : as in `contact.complementarity`
    lam, opened : (N,), out: multipliers, N, and gaps to the unworn surface with them, m
    own : `kernel_types.LayerSpace`, with `soft` and the results of `to_worn`; out:
        `sunk`, the depths s
    """
    size, begun = pressing(gaps, space, own), 0
    for _ in range(ALONE):
        for r in range(begun, size):
            linearize(layer, worn, gaps, -gaps[space.where[r]], own,
                      space.where[r])  # fmt: skip
        begun = size
        delassus_rows(size, w_rotor, compliance, index, shape, space)
        if not on_springs(size, space, own):
            break
        if agree_alone(layer, worn, gaps, size, space, own):
            size = widened(layer, worn, gaps, size, lam, opened, space, own)
            if size == begun:
                return size
    return press_any(
        layer, worn, gaps, w_rotor, compliance, index, shape, lam, opened, space, own,
    )  # fmt: skip


@inlined
def pressing(gaps, space, own):
    """List the tips that would sink into rods without contact; return their number.

    gaps, own : as in `press`; space : out: `where` lists them, `active` is 1 for them
    """
    size = len(gaps) - len(gaps)
    for j in range(len(gaps)):
        sinks = gaps[j] < 0.0 and gaps[j] + own.high[j] < 0.0
        space.active[j] = 1 if sinks else 0
        space.where[size] = j
        size += sinks
    return size


@part
def on_springs(size, space, own):
    """Compute the multipliers of the tips space.where[:size] as if all were on springs.

    They replace space.right, N. The springs are those of `linearize`. Return whether no
    spring pulls.
    """
    where, rows, width = space.where, own.springs, row_of_springs(len(own.give))
    last = size - size % FOUR
    for r in range(size):
        store(rows, r * width + last, broadcast(0.0))
        rows[r * width + size] = -own.shifted[where[r]]
    for s in range(size):
        column = space.w[where[s]]
        for r in range(size):
            rows[r * width + s] = column[where[r]]
        rows[s * width + s] += own.give[where[s]]
    return eliminate(rows, width, size, space.right) >= 0.0


@inlined
def eliminate(rows, width, size, right):
    """Solve linear equations by elimination without exchange of rows.

    Return the least unknown, or -1 if a pivot is too small, which those of pressing
    tips on springs are not: springs are softer than bodies, or else these are regular.

    rows, width : flat, in and out: the matrix, the right side in column `size`, and
        padding; length of a row
    right : (size,), out: the unknowns
    """
    least, lowest = REGULAR * rows[0], math.inf
    for c in range(size):
        pivot = rows[c * width + c]
        if not pivot > least:
            return -1.0
        inverse = 1.0 / pivot
        rows[c * width + c] = inverse
        for r in range(c + 1, size):
            factor = broadcast(rows[r * width + c] * inverse)
            for s in range(c - c % FOUR, size + 1, FOUR):
                row = fnma(factor, load(rows, c * width + s), load(rows, r * width + s))
                store(rows, r * width + s, row)
    for c in range(size - 1, -1, -1):
        value = rows[c * width + size] * rows[c * width + c]
        right[c], lowest = value, min(lowest, value)
        for r in range(c):
            rows[r * width + size] -= rows[r * width + c] * value
    return lowest


@part
def agree_alone(layer, worn, gaps, size, space, own):
    """Return whether multipliers on springs satisfy the law of the rods, see `agree`.

    They do if no rod's force changes its slope on the way; else the forces are computed
    again. The depths of the tips space.where[:size] become those on the springs; if
    these do not agree, the springs become the tangents there.
    """
    largest, alike = 0.0, True
    for r in range(size):
        j = space.where[r]
        largest = max(largest, space.right[r])
        solved = spring_depth(gaps, space.right[r], own, j)
        alike = alike and abs(solved - own.sunk[j]) < own.alike[j]
    if alike:
        for r in range(size):
            j = space.where[r]
            own.sunk[j] = spring_depth(gaps, space.right[r], own, j)
        return True
    alike = True
    for r in range(size):
        j, push = space.where[r], space.right[r]
        solved, steep = spring_depth(gaps, push, own, j), 1.0 / own.give[j]
        force, slope = linearize(layer, worn, gaps, solved, own, j)
        alike = alike and near_enough(force, push, largest, max(slope, steep), solved)
    return alike


@part
def widened(layer, worn, gaps, size, lam, opened, space, own):
    """Compute the gaps with the multipliers of the tips space.where[:size] acting.

    Tips that then sink into rods, too, are appended to space.where; return the new
    number of tips. The multipliers, N, and gaps, m, of all tips are written to `lam`
    and `opened`. The other arguments are those of `press`.
    """
    where, right, listed = space.where, space.right, size
    for i in range(len(gaps)):
        opened[i], lam[i] = gaps[i], 0.0
    for r in range(size):
        column, push = space.w[where[r]], right[r]
        for i in range(len(gaps)):
            opened[i] += column[i] * push
    for r in range(size):
        lam[where[r]], opened[where[r]] = right[r], -own.sunk[where[r]]
    for j in range(len(gaps)):
        if opened[j] >= 0.0 or space.active[j] == 1:
            continue
        if opened[j] + highest(worn, own.rod[j], layer.under) < 0.0:
            where[listed], space.active[j] = j, 1
            listed += 1
    return listed


@rare
def press_any(layer, worn, gaps, w_rotor, compliance, index, shape, lam,
              opened, space, own):  # fmt: skip
    """Compute the contact forces of all tips on the layer, whichever press.

    Each step of Newton's method solves the contact problem of all tips on springs.
    Arguments and result are those of `press`.
    """
    blades, found = len(gaps), -1
    for j in range(blades):
        own.sunk[j] = -gaps[j]
        for i in range(blades):
            own.w[j, i] = w_rotor[j, i]
    for attempt in range(ATTEMPTS):
        for j in range(blades):
            linearize(layer, worn, gaps, own.sunk[j], own, j)
            own.w[j, j] = w_rotor[j, j] + own.give[j]
            space.have[j] = 0
        active = complementarity(
            own.shifted, own.w, compliance, index, shape, lam, opened, space
        )
        if active < 0:
            break
        share = 0.5 ** (attempt // PATIENCE)
        if agree(layer, worn, gaps, lam, opened, share, own):
            found = active
            break
    for j in range(blades):
        space.have[j] = 0  # the rows are of both bodies on springs
    return found


@part
def linearize(layer, worn, gaps, sunk, own, j):
    """Replace the rods under tip j by a linear spring, for one step of Newton's method.

    The spring is the tangent of P(s), the force of the rods, at the depth `sunk`, m,
    which is written to own.sunk[j]; the depth becomes s = lam / (dP/ds) +
    own.shifted[j] - g. So own.give[j] = 1 / (dP/ds) and own.shifted[j] are set. If the
    tip touches no rod, dP/ds is that of the highest rod alone; above the unworn surface
    it is taken as unworn. Return P(s) and dP/ds, which is 0 then.

    Arguments are those of `press`; j : number of the tip
    """
    force, slope, alike = tip_force(layer, own.soft[j], worn, own.rod[j], sunk)
    offset, steep = sunk, slope
    if slope == 0.0:
        alike, steep = 0.0, 1.0 / layer.flex
        offset = highest(worn, own.rod[j], layer.under) if sunk > 0.0 else 0.0
    own.sunk[j], own.alike[j], own.give[j] = sunk, alike, 1.0 / steep
    own.shifted[j] = gaps[j] + (offset - force * own.give[j])
    return force, slope


@inlined
def spring_depth(gaps, push, own, j):
    """Return the depth, m, of tip j on its spring of `linearize` under a force, N."""
    return (own.shifted[j] - gaps[j]) + push * own.give[j]


@inlined
def near_enough(force, push, largest, steep, sunk):
    """Return whether the force of the rods under a tip, N, is its multiplier.

    push, largest : N, its multiplier, and the largest one
    steep, sunk : N/m, largest slope of the force; m, depth of the tip
    """
    return abs(force - push) <= EQUAL * largest + ROUND * steep * abs(sunk)


@rare
def agree(layer, worn, gaps, lam, opened, share, own):
    """Return whether the solution with linear springs satisfies the law of the rods.

    The law is lam = P(s), the force of the rods on a tip at the depth s. If it holds,
    set own.sunk to the solution's s and `opened` (N,) to -s, m; else move own.sunk
    towards that s, by `share` of the difference, for the next step of Newton's method.

    Arguments are those of `press`.
    """
    largest, alike = 0.0, True
    for j in range(len(lam)):
        largest = max(largest, lam[j])
    for j in range(len(lam)):
        solved = spring_depth(gaps, lam[j], own, j) - opened[j]
        force, slope, _ = tip_force(layer, own.soft[j], worn, own.rod[j], solved)
        steep = max(slope, 1.0 / own.give[j])
        alike = alike and near_enough(force, lam[j], largest, steep, solved)
        own.shifted[j] = solved
    for j in range(len(lam)):
        if alike:
            own.sunk[j] = own.shifted[j]
            opened[j] = -own.sunk[j]
        else:
            own.sunk[j] += share * (own.shifted[j] - own.sunk[j])
    return alike


@part
def wear(layer, worn, lam, last, ledger, own):
    """Wear the rods that tips press beyond the limit in a step: set depths and works.

    The work of wear is entered in the ledger as WEAR, which the entry IMPACT includes.
    The work of the rotation on rods that tips slide onto is entered by `turn`.

    layer : `kernel_types.Layer`
    worn : (3, M), in and out: worn depth, m, and works, J, of the layer's rods
    lam, last : (N,), multipliers, N; gaps to the unworn surface at the start of the
        step, m
    own : `kernel_types.LayerSpace`, with the results of `to_worn` and `press`
    """
    size, total = worn.shape[1], ledger[WEAR]
    for j in range(len(lam)):
        rod, under = own.rod[j], layer.under if lam[j] > 0.0 else 0
        softness = own.soft[j]
        for _ in range(under):
            depth = worn[DEPTH, rod]
            force, _, _ = rod_force(layer, softness, depth, own.sunk[j])
            deeper = softness * max(force - limit_of(layer, depth), 0.0)
            worn[DEPTH, rod] = depth + deeper
            work = (force - 0.5 * layer.growth * deeper) * deeper
            worn[WORK, rod] += work
            total += work
            if -last[j] > depth and not covers(own.left[j], rod, size, layer.under):
                turn(work_to_push(layer, depth, -last[j] - depth), worn, rod, ledger)
            rod = after(rod, size)
    ledger[WEAR] = total


@part
def leave(layer, worn, last, ledger, own):
    """Book the elastic energy that rods of the layer release when tips leave them, J.

    It goes back to the drive that keeps the speed: `turn` enters it in `worn` and
    `ledger` as negative work of the rotation.

    layer : `kernel_types.Layer`
    worn : (3, M), in and out: worn depth, m, and works, J, of the layer's rods
    last : (N,), m, gaps to the unworn surface at the start of the step
    own : `kernel_types.LayerSpace`, with the rods that `to_worn` has found
    """
    size = worn.shape[1]
    for j in range(len(own.rod)):
        if own.left[j] == own.rod[j] or last[j] >= 0.0:
            continue
        rod = own.left[j]
        for _ in range(layer.under):
            way = -last[j] - worn[DEPTH, rod]
            if way > 0.0 and not covers(own.rod[j], rod, size, layer.under):
                turn(-0.5 * way * way / layer.flex, worn, rod, ledger)
            rod = after(rod, size)


@rare
def turn(work, worn, rod, ledger):
    """Enter the work of the rotation on a rod, J, in worn[CUT] and in the ledger.

    The ledger's entries ROTATION and IMPACT both contain this work.

    work, rod : J, < 0 if the rod returns it; number of the rod
    """
    worn[CUT, rod] += work
    book_work(IMPACT, work, work, ledger)


@rare
def work_to_push(layer, depth, way):
    """Return the work, J, of a tip that slides onto a rod and pushes it in by `way`, m.

    The rod yields elastically and, beyond its limit, plastically; wear by sliding is
    left out.

    layer, depth : `kernel_types.Layer`; m, worn depth of the rod
    """
    limit = limit_of(layer, depth)
    elastic = way if layer.growth == 0.0 else min(way, layer.flex * limit)
    tangent = layer.growth / (1.0 + layer.growth * layer.flex)
    rest = way - elastic
    return 0.5 * elastic * elastic / layer.flex + (limit + 0.5 * tangent * rest) * rest


@rare
def keep_depth(worn, sample, track):
    """Write the worn depth of all rods, m, to row `sample` of the stored trace.

    worn : (3, M), state of the layer's M rods; its first row is the worn depth, m
    track : (samples, M), out, or without rows if the depths are not stored
    """
    if sample < len(track):
        for rod in range(worn.shape[1]):
            track[sample, rod] = worn[DEPTH, rod]


@rare
def closed_by(older, opened, out):
    """Compute how much the gaps have closed from step n - 1 to n + 1: out (N,), m.

    The impact loss depends on it, see `contact.book_contacts`.

    older, opened : (N,), m, gaps at step n - 1 and at step n + 1
    """
    for j in range(len(out)):
        out[j] = older[j] - opened[j]


@inlined
def is_inside(entered):
    """Return whether a tip was below the unworn surface after the last step.

    entered : see `kernel_types.CyclicState`; empty without a layer
    """
    lowest = 0.0
    for j in range(len(entered)):
        lowest = min(lowest, entered[j])
    return lowest < 0.0


@part
def press_rods(rods, turned, before, speed, gaps, row, lowest, state, solver, own):
    """Find the forces of a step of all tips on the layer; `wear_rods` wears it.

    Return the number of tips that press, the first ones of solver.push and
    solver.where; 0 if none; -1 if no solution was found. It is a term of the time loop
    `points`, where the Delassus matrix of both bodies is constant.

    Parameters
    ----------
    rods : `kernel_types.Rods`
    turned, before, speed : rad, angles of blade 0 at the end and at the start of the
        step; Omega, rad/s
    gaps, row : m, folded gaps to the unworn surface, from index `row` on: in without
        contact, out with it
    lowest : m, lowest of them; if it is not below 0, they need not be known
    state, solver : `kernel_types.CyclicState`, whose rods, ledger and contacts change;
        `kernel_types.ConstantSpace`
    own : `kernel_types.LayerSpace`
    """
    layer, worn, entered, ledger = rods.layer, state.worn, state.entered, state.ledger
    near, lam, opened = solver.near, solver.lam, solver.opened
    blades, wide, active = len(entered), len(state.gaps) // 6, 0
    for j in range(blades):
        near[j] = gaps[row + place_of(j, blades, wide)] if lowest < 0.0 else 1.0
        opened[j] = near[j]
    pressed = to_worn(turned, before, rods, worn, layer.under, own, near, entered) < 0.0
    leave(layer, worn, entered, ledger, own)
    if pressed:
        for j in range(blades):
            own.soft[j] = layer.soft + layer.rub * abs(speed)
        active = press(
            layer, worn, near, rods.w, rods.none, rods.places, rods.shape, lam, opened,
            solver.fallback, own,
        )  # fmt: skip
        if active >= 0:
            note_pressed(active, gaps, row, state.known, solver, blades, wide)
    return active


@inlined
def wear_rods(rods, active, state, solver, own):
    """Wear the layer by the forces of a step, after `press_rods` and any friction.

    active : number of tips that press; other arguments are those of `press_rods`
    """
    if active > 0:
        wear(rods.layer, state.worn, solver.lam, state.entered, state.ledger, own)
    for j in range(len(state.entered)):
        state.entered[j] = min(solver.opened[j], 0.0)


@rare
def rub_rods(layer, worn, gaps, law, step, index, shape, lam, tau, opened, touch, space,
             own):  # fmt: skip
    """Compute normal forces and friction of tips that rub on the layer.

    Solve lam = P(s) with Coulomb's law: each step of Newton's method solves the problem
    of `coulomb` for tips on springs. Return the number of tips in contact, -1 without a
    solution.

    layer, worn : as in `press`; gaps, m, are those to the unworn surface, without
        contact forces, and `opened` with them
    law, step, index, shape, lam, tau, touch, space : as in `coulomb.rub`, with slides
        of all tips
    own : `kernel_types.LayerSpace`, with the results of `to_worn`; out: `sunk`, `soft`
    """
    tips, found = len(gaps), -1
    coefficients(law, step, tips, space)
    for j in range(tips):
        slid = abs(space.before[j]) / (law.radius * step) if law.always else 0.0
        own.sunk[j], own.soft[j] = -gaps[j], layer.soft + layer.rub * slid
        respond(j, law, index, shape, space)
        own.w[j, j] = space.columns[j, j]
    for attempt in range(ATTEMPTS):
        for j in range(tips):
            linearize(layer, worn, gaps, own.sunk[j], own, j)
            space.columns[j, j] = own.w[j, j] + own.give[j]
        active = rub_springs(law, index, shape, lam, opened, space, own)
        if active < 0:
            break
        share = 0.5 ** (attempt // PATIENCE)
        if agree(layer, worn, gaps, lam, opened, share, own):
            found = active
            break
    for j in range(tips):
        space.columns[j, j] = own.w[j, j]
    list_rubbing(lam, tau, touch, space)
    return found


@part
def rub_springs(law, index, shape, lam, opened, space, own):
    """Compute normal forces and friction of tips that rub on springs of `linearize`.

    Return the number of tips in contact, -1 without a solution. Arguments are those of
    `rub_rods`.
    """
    size, more, active = 0, 0, 0
    for j in range(len(lam)):
        lam[j], space.tau[j], opened[j] = 0.0, 0.0, own.shifted[j]
        if own.shifted[j] < 0.0:
            space.chosen[more] = j
            more += 1
        else:
            space.state[j] = CLEAR
    while size < more:
        size = more
        active, more = solve_coulomb(
            own.shifted, size, law, index, shape, lam, opened, space
        )
    return active


@part
def choose_on(rods, gaps, law, space):
    """List the tips whose slides `rub_on` needs in space.chosen; return their number.

    On a layer these are all tips.

    rods, gaps, law, space : `kernel_types.Rods`; as in `coulomb.choose`
    """
    size = choose(gaps, law, space)
    if len(rods.angle) == 0:
        return size
    return choose_all(space.chosen)


@part
def choose_all(chosen):
    """List all tips in chosen (N,); return their number."""
    for j in range(len(chosen)):
        chosen[j] = j
    return len(chosen)


@part
def rub_on(rods, size, slides, worn, solver, friction, own):
    """Compute a step's normal forces and friction, on a layer or on a rigid surface.

    It is a term of the loop `points`; return as `coulomb.rub` does.

    rods, slides : `kernel_types.Rods`; law and responses of set-valued friction
    size, worn : number of tips chosen, see `choose_on`; state of the rods
    solver, friction, own : `kernel_types.ConstantSpace`, with gaps without contact in
        `near`; `CoulombSpace`; `LayerSpace`
    """
    if len(rods.angle) > 0:
        active = rub_rods(
            rods.layer, worn, solver.near, slides.law, slides.step, slides.places,
            slides.shape, solver.lam, friction.after, solver.opened, solver.fallback,
            friction, own,
        )  # fmt: skip
        return active, size
    return rub(
        solver.near, size, slides.law, slides.step, slides.places, slides.shape,
        solver.lam, friction.after, solver.opened, solver.fallback, friction,
    )  # fmt: skip


@inlined
def note_pressed(active, gaps, row, known, solver, blades, wide):
    """Write the solution of `press`: gaps with contact, multipliers, which tips press.

    The kept inverse of the Delassus matrix is not theirs, and is marked so.

    Arguments are those of `press_rods`; known : see `kernel_types.ConstantSpace`
    """
    push, where = solver.push, solver.where
    for j in range(blades):
        gaps[row + place_of(j, blades, wide)] = solver.opened[j]
    for s in range(active):
        push[s] = solver.lam[where[s]]
        known[s] = where[s]
    known[blades + SIZE], known[blades + SOUND], known[blades + CHANGED] = active, 0, 0


@inlined
def close_from(entered, where, active, before):
    """Subtract from gaps of step n - 1 those of n + 1, which a layer leaves open, m.

    The impact loss depends on the difference, see `contact.book_contacts`.

    entered : gaps at step n + 1, see `kernel_types.CyclicState`; empty without a layer
    where, active : the tips in contact are where[:active]
    before : (N,), in and out
    """
    if len(entered) > 0:
        for s in range(active):
            before[where[s]] -= entered[where[s]]
