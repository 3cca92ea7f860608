"""Layer on the casing that wears: rods side by side around it, one an element of angle.

A rod is pushed in by e = flex N, elastic, and wears by w. A step with force N beyond
the limit L = limit + growth w wears it by soft (N - L). An abradable, plastic rod has
soft = 1 / growth; by Archard's law L = 0 and soft is proportional to the sliding
distance of a step. In both laws the shortening of a rod over a step is an increasing,
piecewise linear function of the force: a compliance on the diagonal of the contact
problem, which remains one of complementarity, solved implicitly.

A tip that slides onto a higher rod pushes it down to where the tip is. The rotation
does the work of that, V(s) over s = -g_n - w, by the slope of the layer's surface, as
it does on the slope of a casing; V is the area below the curve of a push into the rod.
Further pushing is the tip's own. What a rod left behind held elastically returns.
"""

from __future__ import annotations

import math

from hpcwhirl.dynamics.kernels.compiled import rare
from hpcwhirl.dynamics.kernels.contact import IMPACT, ROTATION, WEAR, complementarity

NEAR = 1e-11  # of the limit: within it, a rod stays as it is
DEPTH, WORK, CUT = 0, 1, 2  # rows of the state
ATTEMPTS = 3  # times N: changes of all blades at once before one at a time


@rare
def to_worn(turned, before, points, worn, space, gaps):
    """Set the rods of the blades and their gaps to the worn surface; the lowest, m.

    Parameters
    ----------
    turned, before : rad, angles of blade 0 at the end and at the start of the step
    points : `kernel_types.Points`
    worn : (3, M), see `kernel_types.BodiesState`
    space : `kernel_types.LayerSpace`; out: `rod`, `left`, `clear`
    gaps : (N,), m, to the surface as made
    """
    lowest, size = 1.0, worn.shape[1]
    for j in range(len(gaps)):
        own = points.angle[j]
        space.rod[j] = rod_at(turned + own, size)
        space.left[j] = rod_at(before + own, size)
        space.clear[j] = gaps[j] + worn[DEPTH, space.rod[j]]
        lowest = min(lowest, space.clear[j])
    return lowest


@rare
def rod_at(angle, size):
    """Return the rod at an angle, rad, of `size` rods."""
    part = angle / (2.0 * math.pi)
    return min(int((part - math.floor(part)) * size), size - 1)


@rare
def press(layer, softness, worn, w_rotor, compliance, index, shape, lam, opened, space,
          own):  # fmt: skip
    """Solve the contact with the layer; return as `contact.complementarity`.

    Parameters
    ----------
    layer, softness : `kernel_types.Layer`; m/N, wear of a step by force beyond a limit
    worn : (3, M), see `kernel_types.BodiesState`
    lam, opened : (N,), out: multipliers, N, and gaps to the worn surface of before, m,
        with what rods are pushed in and wear
    own : `kernel_types.LayerSpace`; in `clear` gaps to the worn surface
    """
    wears, blades, most = own.wears, len(own.clear), ATTEMPTS * len(own.clear)
    for j in range(blades):
        wears[j] = 0
    for attempt in range(2 * most + 200):
        for j in range(blades):
            for i in range(blades):
                own.w[j, i] = w_rotor[j, i]
            own.w[j, j] += layer.flex
            own.shifted[j] = own.clear[j]
            if wears[j] == 1:
                own.w[j, j] += softness
                own.shifted[j] -= softness * limit_of(layer, worn[DEPTH, own.rod[j]])
            space.have[j] = 0
        active = complementarity(
            own.shifted, own.w, compliance, index, shape, lam, opened, space
        )
        if active < 0:
            return active
        changed = 0
        for j in range(blades):
            limit = limit_of(layer, worn[DEPTH, own.rod[j]])
            band = (NEAR if wears[j] == 0 else -NEAR) * limit
            now = 1 if lam[j] > limit + band else 0
            if now != wears[j] and (attempt < most or changed == 0):
                wears[j] = now
                changed += 1
        if changed == 0:
            return active
    return -1


@rare
def limit_of(layer, depth):
    """Return the force beyond which a rod of this worn depth wears, N."""
    return layer.limit + layer.growth * depth


@rare
def wear(layer, softness, worn, lam, opened, last, ledger, own):
    """Bring the rods up to date, and enter the works of wear in the ledger.

    The gaps become those to the surface as made. IMPACT includes WEAR.

    last : (N,), m, gaps to the surface as made at the start of the step
    """
    for j in range(len(lam)):
        rod = own.rod[j]
        depth = worn[DEPTH, rod]
        opened[j] -= depth
        if lam[j] <= 0.0:
            continue
        deeper = softness * max(lam[j] - limit_of(layer, depth), 0.0)
        opened[j] = -(depth + deeper + layer.flex * lam[j])
        worn[DEPTH, rod] = depth + deeper
        work = (lam[j] - 0.5 * layer.growth * deeper) * deeper
        worn[WORK, rod] += work
        ledger[WEAR] += work
        if own.left[j] != rod and -last[j] > depth:
            turn(work_to_push(layer, depth, -last[j] - depth), worn, rod, ledger)


@rare
def leave(layer, worn, last, ledger, own):
    """Return to the rotation what rods hold elastically that tips slide off."""
    for j in range(len(own.rod)):
        way = -last[j] - worn[DEPTH, own.left[j]]
        if own.left[j] != own.rod[j] and way > 0.0:
            turn(-0.5 * way * way / layer.flex, worn, own.left[j], ledger)


@rare
def turn(work, worn, rod, ledger):
    """Enter work of the rotation on a rod, J; IMPACT takes what nothing else does."""
    worn[CUT, rod] += work
    ledger[IMPACT] += work
    ledger[ROTATION] += work


@rare
def work_to_push(layer, depth, way):
    """Return the work, J, to push a rod in by `way`, m, without rubbing."""
    limit = limit_of(layer, depth)
    elastic = way if layer.growth == 0.0 else min(way, layer.flex * limit)
    tangent = layer.growth / (1.0 + layer.growth * layer.flex)
    rest = way - elastic
    return 0.5 * elastic * elastic / layer.flex + (limit + 0.5 * tangent * rest) * rest


@rare
def keep_depth(worn, sample, track):
    """Write the depths of the rods to a sample of `track` (samples, M), if kept."""
    if sample < len(track):
        for rod in range(worn.shape[1]):
            track[sample, rod] = worn[DEPTH, rod]


@rare
def closed_by(older, opened, out):
    """Set out (N,), m, by how much gaps closed from step n - 1 to n + 1."""
    for j in range(len(out)):
        out[j] = older[j] - opened[j]
