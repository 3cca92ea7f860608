"""Layer on the casing that wears: rods side by side, each over an equal angle.

A tip presses all rods under its edge down to the same depth s below the unworn surface.
A rod is pushed in elastically by e = flex N under the force N, and wears by w. A step
with N beyond the limit L = limit + growth w wears it by soft (N - L). An abradable,
plastic rod has soft = 1 / growth; by Archard's law L = 0 and soft is proportional to
the sliding distance of a step. In both laws the force on a tip, the sum over its rods,
is an increasing, piecewise linear function P(s): a compliance on the diagonal of the
contact problem, solved implicitly with all tips at once by Newton's method.

A tip that slides onto a higher rod pushes it down to where the tip is. The rotation
does the work of that, V(s - w) with the depth s before the step, by the slope of the
layer's surface, as it does on the slope of a casing; V is the area below the force that
pushes the rod in. The work of pushing it further is done by the tip itself. A rod that
a tip leaves returns its elastic energy to the rotation.
"""

from __future__ import annotations

import math

import numpy as np

from hpcwhirl.dynamics.kernels.compiled import by_numba, inlined, rare
from hpcwhirl.dynamics.kernels.contact import WEAR, book_impact, complementarity
from hpcwhirl.dynamics.kernels.keep_inverse import CHANGED, SIZE, SOUND, place_of
from hpcwhirl.dynamics.kernels.kernel_types import LayerSpace

# rows of `worn` in the state: worn depth, m; work of wear and of the rotation, J
DEPTH, WORK, CUT = 0, 1, 2
EQUAL = 1e-11  # tolerance of P(s) = multiplier, relative to the largest force
ROUND = 1e-15  # relative round-off of the depth s of a tip
ATTEMPTS, PATIENCE = 300, 20  # most Newton steps; steps after which they are halved


@by_numba()
def layer_space(blades):
    """Return new work arrays for the contact of N tips with a layer that wears.

    See `layer`; blades : N
    """
    return LayerSpace(
        np.zeros(blades, np.int64), np.zeros(blades, np.int64), np.zeros(blades),
        np.zeros(blades), np.zeros(blades), np.zeros((blades, blades)),
    )  # fmt: skip


@rare
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
        `rod` and `left`; the latter only for tips that were below the unworn surface
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
            lowest = min(lowest, gaps[j] + highest(worn, space.rod[j], under))
    return lowest


@rare
def first_rod(angle, size, under):
    """Return the number of the first of the `under` rods that are under a tip.

    angle, size : rad, of the tip in the static frame; number of rods around the casing
    """
    part = angle / (2.0 * math.pi)
    centred = (part - math.floor(part)) * size - 0.5 * (under - 1)
    return math.floor(centred) % size


@inlined
def covers(first, rod, size, under):
    """Return whether a tip is over a given rod of the layer.

    first, under : number of the first rod under the tip; how many rods are under it
    rod, size : number of the rod; number of rods around the casing
    """
    return (rod - first) % size < under


@inlined
def highest(worn, first, under):
    """Return the worn depth, m, of the least worn of the rods under a tip.

    worn : (3, M), state of the layer's rods; its first row is the worn depth, m
    first, under : number of the first rod under the tip; how many rods are under it
    """
    least = worn[DEPTH, first]
    for i in range(1, under):
        least = min(least, worn[DEPTH, (first + i) % worn.shape[1]])
    return least


@inlined
def limit_of(layer, depth):
    """Return the force, N, beyond which a rod of worn depth `depth`, m, wears.

    layer : `kernel_types.Layer`, which has the limit of an unworn rod and its growth
    """
    return layer.limit + layer.growth * depth


@inlined
def rod_force(layer, softness, depth, sunk):
    """Return the force, N, of one rod on a tip, and its derivative by the depth, N/m.

    layer : `kernel_types.Layer`
    softness : m/N, wear in a step per force beyond the limit
    depth, sunk : m, worn depth of the rod; depth of the tip below the unworn surface
    """
    way = sunk - depth
    if way <= 0.0:
        return 0.0, 0.0
    limit = limit_of(layer, depth)
    if way <= layer.flex * limit:
        return way / layer.flex, 1.0 / layer.flex
    slope = 1.0 / (layer.flex + softness)
    return (way + softness * limit) * slope, slope


@rare
def tip_force(layer, softness, worn, first, sunk):
    """Return P(s), the force of all rods under a tip, N, and its derivative dP/ds, N/m.

    layer, softness : `kernel_types.Layer`; m/N, wear in a step per force beyond the
        limit
    worn : (3, M), state of the layer's rods; its first row is the worn depth, m
    first, sunk : number of the first rod under the tip; s, m, depth of the tip below
        the unworn surface
    """
    force, slope = 0.0, 0.0
    if sunk <= 0.0:
        return force, slope
    for i in range(layer.under):
        rod = (first + i) % worn.shape[1]
        one, steep = rod_force(layer, softness, worn[DEPTH, rod], sunk)
        force += one
        slope += steep
    return force, slope


@rare
def press(layer, softness, worn, gaps, w_rotor, compliance, index, shape, lam, opened,
          space, own):  # fmt: skip
    """Compute the contact forces of all tips on the layer by Newton's method.

    Solve lam = P(-g - W lam): lam are the multipliers, P(s) is the force of the rods on
    a tip at the depth s, g are the gaps without contact, W is the Delassus matrix of
    both bodies. Return the number of tips with lam > 0, or -1 if no solution was found.

    Parameters
    ----------
    layer, softness : `kernel_types.Layer`; m/N, wear in a step per force beyond the
        limit
    worn : (3, M), state of the layer's rods; its first row is the worn depth, m
    gaps : (N,), m, g, to the unworn surface
    w_rotor, compliance, index, shape, space : as in `contact.complementarity`
    lam, opened : (N,), out: multipliers, N, and gaps to the unworn surface with them, m
    own : `kernel_types.LayerSpace`; out: `sunk`, the depths s
    """
    blades = len(gaps)
    for j in range(blades):
        own.sunk[j] = -gaps[j]
        for i in range(blades):
            own.w[j, i] = w_rotor[j, i]
    for attempt in range(ATTEMPTS):
        for j in range(blades):
            linearize(layer, softness, worn, gaps, w_rotor[j, j], own, j)
            space.have[j] = 0
        active = complementarity(
            own.shifted, own.w, compliance, index, shape, lam, opened, space
        )
        if active < 0:
            return active
        share = 0.5 ** (attempt // PATIENCE)
        if agree(layer, softness, worn, gaps, lam, opened, share, own):
            return active
    return -1


@rare
def linearize(layer, softness, worn, gaps, give, own, j):
    """Replace the rods under tip j by a linear spring, for one step of Newton's method.

    The spring is the tangent of P(s), the force of the rods, at the tip's present depth
    own.sunk[j]; the depth becomes s = lam / (dP/ds) + own.shifted - g. So own.w[j, j]
    and own.shifted[j] are set. If the tip touches no rod, dP/ds is that of the highest
    rod alone; above the unworn surface it is taken as unworn.

    Arguments are those of `press`
    give, j : m/N, opening of the gap by a unit multiplier on it; number of the tip
    """
    force, slope = tip_force(layer, softness, worn, own.rod[j], own.sunk[j])
    offset = own.sunk[j]
    if slope == 0.0:
        worn_off = highest(worn, own.rod[j], layer.under) if offset > 0.0 else 0.0
        offset, slope = worn_off, 1.0 / layer.flex
    own.give[j] = 1.0 / slope
    own.w[j, j] = give + own.give[j]
    own.shifted[j] = gaps[j] + (offset - force * own.give[j])


@rare
def agree(layer, softness, worn, gaps, lam, opened, share, own):
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
        solved = (own.shifted[j] - gaps[j]) + lam[j] * own.give[j] - opened[j]
        force, slope = tip_force(layer, softness, worn, own.rod[j], solved)
        steep = max(slope, 1.0 / own.give[j])
        apart = abs(force - lam[j])
        alike = alike and apart <= EQUAL * largest + ROUND * steep * abs(solved)
        own.shifted[j] = solved
    for j in range(len(lam)):
        if alike:
            own.sunk[j] = own.shifted[j]
            opened[j] = -own.sunk[j]
        else:
            own.sunk[j] += share * (own.shifted[j] - own.sunk[j])
    return alike


@rare
def wear(layer, softness, worn, lam, last, ledger, own):
    """Wear the rods that tips press beyond the limit in a step: set depths and works.

    The work of wear is entered in the ledger as WEAR, which the entry IMPACT includes.
    The work of the rotation on rods that tips slide onto is entered by `turn`.

    layer, softness : `kernel_types.Layer`; m/N, wear in a step per force beyond the
        limit
    worn : (3, M), in and out: worn depth, m, and works, J, of the layer's rods
    lam, last : (N,), multipliers, N; gaps to the unworn surface at the start of the
        step, m
    own : `kernel_types.LayerSpace`, with the results of `to_worn` and `press`
    """
    size = worn.shape[1]
    for j in range(len(lam)):
        if lam[j] <= 0.0:
            continue
        for i in range(layer.under):
            rod = (own.rod[j] + i) % size
            depth = worn[DEPTH, rod]
            force, _ = rod_force(layer, softness, depth, own.sunk[j])
            deeper = softness * max(force - limit_of(layer, depth), 0.0)
            worn[DEPTH, rod] = depth + deeper
            work = (force - 0.5 * layer.growth * deeper) * deeper
            worn[WORK, rod] += work
            ledger[WEAR] += work
            if -last[j] > depth and not covers(own.left[j], rod, size, layer.under):
                turn(work_to_push(layer, depth, -last[j] - depth), worn, rod, ledger)


@rare
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
        for i in range(layer.under):
            rod = (own.left[j] + i) % size
            way = -last[j] - worn[DEPTH, rod]
            if way > 0.0 and not covers(own.rod[j], rod, size, layer.under):
                turn(-0.5 * way * way / layer.flex, worn, rod, ledger)


@rare
def turn(work, worn, rod, ledger):
    """Enter the work of the rotation on a rod, J, in worn[CUT] and in the ledger.

    The ledger's entries ROTATION and IMPACT both contain this work.

    work, rod : J, < 0 if the rod returns it; number of the rod
    """
    worn[CUT, rod] += work
    book_impact(work, ledger)


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


@rare
def press_rods(rods, turned, before, speed, gaps, row, lowest, state, solver, own):
    """Find the forces of a step of all tips on the layer, and wear it.

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
        softness = layer.soft + layer.rub * abs(speed)
        active = press(
            layer, softness, worn, near, rods.w, rods.none, rods.places, rods.shape,
            lam, opened, solver.fallback, own,
        )  # fmt: skip
        if active < 0:
            return active
        wear(layer, softness, worn, lam, entered, ledger, own)
        note_pressed(active, gaps, row, state.known, solver, blades, wide)
    for j in range(blades):
        entered[j] = min(opened[j], 0.0)
    return active


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
