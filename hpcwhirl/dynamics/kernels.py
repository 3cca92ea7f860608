"""All compiled code: contact solution and both marching schemes.

One file, since the cache of compiled code follows the file of a function only.
Kernels take scalars and arrays, allocate nothing a step, and march `steps` steps from
the state they are given, so that a run is cut into slices at will.

Sign and frame: theta grows anticlockwise; the tip of blade j stands at
theta_j = Omega t + 2 pi j / N; u_j is its radial displacement (rotating frame),
w(theta) that of the casing, both outward; g_j = gap + w(theta_j) - u_j.
A multiplier lambda_j >= 0 pushes the tip inward and the casing outward; friction
drags the tip against the rotation and the casing with it: `mu` carries the sign of
Omega.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

# ledger slots
PULSE, IMPACT, FRICTION, ROTATION, IMPULSE = 0, 1, 2, 3, 4
# counter slots
STEP, TOUCHDOWNS, LAST, SAMPLE, STOP = 0, 1, 2, 3, 4
# reasons to stop
RUNNING, AMPLITUDE, NONFINITE, COMPLEMENTARITY = 0, 1, 2, 3
FLUSH_EVERY = 256  # steps; see `flush`
TINY = 1e-150


@njit(cache=True)
def place_blades(turned, blades, elements, length, elem, shape):
    """Set element (N,) and Hermite shapes (N, 4) of the blades at angle `turned`."""
    for j in range(blades):
        part = turned / (2.0 * math.pi) + j / blades
        part = (part - math.floor(part)) * elements
        e = int(part)
        if e >= elements:
            e = elements - 1
        x = part - e
        elem[j] = e
        shape[j, 0] = 1.0 - 3.0 * x * x + 2.0 * x * x * x
        shape[j, 1] = x * (1.0 - x) * (1.0 - x) * length
        shape[j, 2] = 3.0 * x * x - 2.0 * x * x * x
        shape[j, 3] = x * x * (x - 1.0) * length


@njit(cache=True)
def rigid_radial(k, amplitude, growth, rise, time, angle):
    """Return the radial place of a rigid casing distorted on k lobes, m."""
    ramp = 1.0
    if time < rise:
        ramp = 0.5 * (1.0 - math.cos(math.pi * time / rise))
    return -amplitude * math.exp(growth * time) * ramp * math.cos(k * angle)


@njit(cache=True)
def delassus_column(j, w_rotor, compliance, elem, shape, response, full):
    """Set column j of W: how a unit multiplier on blade j opens every gap, m/N.

    `compliance` (2 elements, 2 elements) holds, a row for each loaded nodal DoF
    (w, w'), the nodal (w, w') that a unit normal load with its friction gives;
    `response` (2 elements,) is work space.
    """
    n, nodes = len(elem), len(response)
    for i in range(n):
        full[i, j] = w_rotor[i, j]
    if nodes == 0:
        return
    first = 2 * elem[j]
    second = (first + 2) % nodes
    r0, r1 = compliance[first], compliance[first + 1]
    r2, r3 = compliance[second], compliance[second + 1]
    a, b, c, d = shape[j, 0], shape[j, 1], shape[j, 2], shape[j, 3]
    for r in range(nodes):
        response[r] = (a * r0[r] + b * r1[r]) + (c * r2[r] + d * r3[r])
    for i in range(n):
        full[i, j] += read_ring(response, elem[i], shape[i])


@njit(cache=True)
def read_ring(nodal, e, shape):
    """Return the radial displacement in element e from nodal (w, w'), m."""
    f = 2 * e + 2
    if f == len(nodal):
        f = 0
    return (shape[0] * nodal[2 * e] + shape[1] * nodal[2 * e + 1]) + (
        shape[2] * nodal[f] + shape[3] * nodal[f + 1]
    )


@njit(cache=True)
def solve_dense(matrix, right, size):
    """Solve in place by Gauss with partial pivoting; return whether it could."""
    for c in range(size):
        p = c
        for r in range(c + 1, size):
            if abs(matrix[r, c]) > abs(matrix[p, c]):
                p = r
        if not abs(matrix[p, c]) > 0.0:
            return False
        if p != c:
            for s in range(size):
                matrix[c, s], matrix[p, s] = matrix[p, s], matrix[c, s]
            right[c], right[p] = right[p], right[c]
        for r in range(c + 1, size):
            factor = matrix[r, c] / matrix[c, c]
            for s in range(c, size):
                matrix[r, s] -= factor * matrix[c, s]
            right[r] -= factor * right[c]
    for c in range(size - 1, -1, -1):
        for s in range(c + 1, size):
            right[c] -= matrix[c, s] * right[s]
        right[c] /= matrix[c, c]
    return True


@njit(cache=True)
def complementarity(
    gaps,
    w_rotor,
    compliance,
    elem,
    shape,
    lam,
    opened,
    response,
    full,
    have,
    active,
    small,
    right,
):
    """Solve 0 <= lam, 0 <= g + W lam, lam . (g + W lam) = 0; return success.

    Block principal pivoting from the penetrating set; after 3 N exchanges, one
    index at a time from the last (Murty), which ends for any P-matrix.

    Parameters
    ----------
    gaps : (N,), m, predicted
    w_rotor, compliance, elem, shape : as in `delassus_column`
    lam, opened : (N,), out: multipliers, N, and corrected gaps, m
    full, have : (N, N), (N,): W, made column by column as blades come in
    active, small, right : work space (N,), (N, N), (N,)
    """
    n = len(gaps)
    scale = 0.0
    for i in range(n):
        active[i] = 1 if gaps[i] < 0.0 else 0
        have[i] = 0
        scale = max(scale, abs(gaps[i]))
    tolerance = 1e-13 * scale
    for attempt in range(3 * n + 200):
        for j in range(n):
            if active[j] == 1 and have[j] == 0:
                delassus_column(j, w_rotor, compliance, elem, shape, response, full)
                have[j] = 1
        size = 0
        for i in range(n):
            lam[i] = 0.0
            if active[i] == 1:
                right[size] = -gaps[i]
                column = 0
                for j in range(n):
                    if active[j] == 1:
                        small[size, column] = full[i, j]
                        column += 1
                size += 1
        if not solve_dense(small, right, size):
            return False
        size = 0
        for i in range(n):
            if active[i] == 1:
                lam[i] = right[size]
                size += 1
        wrong = 0
        last = -1
        for i in range(n):
            opened[i] = gaps[i]
            for j in range(n):
                if active[j] == 1:
                    opened[i] += full[i, j] * lam[j]
            if active[i] == 1:
                opened[i] = 0.0
            bad = (active[i] == 1 and lam[i] < 0.0) or opened[i] < -tolerance
            if bad:
                wrong += 1
                last = i
                if attempt < 3 * n:
                    active[i] = 1 - active[i]
        if wrong == 0:
            return True
        if attempt >= 3 * n:
            active[last] = 1 - active[last]
    return False


@njit(cache=True)
def flush(values, increments):
    """Zero amplitudes below 1e-150 before their products become denormal."""
    for m in range(len(values)):
        if abs(values[m]) < TINY and abs(increments[m]) < TINY:
            values[m] = 0.0
            increments[m] = 0.0


@njit(cache=True)
def accumulate(rows, values, out):
    """Set out = values @ rows, four rows at a time; rows is (m, n), m % 4 == 0."""
    for j in range(len(out)):
        out[j] = 0.0
    for m in range(0, len(values), 4):
        a, b, c, d = values[m], values[m + 1], values[m + 2], values[m + 3]
        ra, rb, rc, rd = rows[m], rows[m + 1], rows[m + 2], rows[m + 3]
        for j in range(len(out)):
            out[j] += (a * ra[j] + b * rb[j]) + (c * rc[j] + d * rd[j])


@njit(cache=True)
def predict(keep, pull, values, increments, ahead, following):
    """Set d_{n+1} (`ahead`) and q_{n+1} (`following`) without forces."""
    for m in range(len(values)):
        step = keep[m] * increments[m] - pull[m] * values[m]
        ahead[m] = step
        following[m] = values[m] + step


@njit(cache=True)
def accept(values, increments, ahead, rate, loss):
    """Take the step; add damping loss 2 xi w (d' + d)^2 / (4 dt) mode by mode."""
    for m in range(len(values)):
        both = ahead[m] + increments[m]
        loss[m] += rate[m] * both * both
        values[m] += ahead[m]
        increments[m] = ahead[m]


@njit(cache=True)
def modal_energy(values, increments, omega, step):
    """Return 1/2 v^2 + 1/2 w^2 q_n q_{n+1} over all modes at n + 1/2, J."""
    total = 0.0
    for m in range(len(values)):
        speed = increments[m] / step
        total += 0.5 * speed * speed
        total += 0.5 * omega[m] * omega[m] * values[m] * (values[m] - increments[m])
    return total


@njit(cache=True)
def push_modes(force_n, force_t, mu, give, ahead, increments, following, ledger):
    """Correct the increments by modal contact forces and enter their work."""
    for m in range(len(ahead)):
        change = give[m] * (force_n[m] + mu * force_t[m])
        ahead[m] += change
        following[m] += change
    normal = 0.0
    drag = 0.0
    for m in range(len(ahead)):
        mean = 0.5 * (ahead[m] + increments[m])
        normal += force_n[m] * mean
        drag += mu * force_t[m] * mean
    ledger[ROTATION] += normal
    ledger[FRICTION] += drag


@njit(cache=True)
def pulse_of(time, force, pulse):
    """Return F(t) = F sin(pi t / tau) for 0 < t < tau, else 0, N."""
    if 0.0 < time < pulse:
        return force * math.sin(math.pi * time / pulse)
    return 0.0


@njit(cache=True)
def book_contacts(n, lam, opened, before, touching, counter, ledger, impulse, step):
    """Enter multipliers in counters, impulses and ledger after a solved contact.

    The normal work of both bodies is already in ledger[ROTATION]; its part
    lambda (g_{n+1} - g_{n-1}) / 2 is the impact and moves to its own slot.
    """
    for j in range(n):
        if lam[j] > 0.0:
            own = 0.5 * lam[j] * (opened[j] - before[j])
            ledger[IMPACT] -= own
            ledger[ROTATION] -= own
            ledger[IMPULSE] += lam[j] * step
            impulse[j] += lam[j] * step
            counter[LAST] = counter[STEP]
            if touching[j] == 0:
                counter[TOUCHDOWNS] += 1
            touching[j] = 1
        else:
            touching[j] = 0


@njit(cache=True)
def read_gaps(u, nodal, scene, elem, shape, elements, turned, time, gaps):
    """Set the N gaps from tips, and nodal (w, w') or the rigid distortion."""
    gap, k, amplitude, growth, rise = scene
    n = len(gaps)
    lowest = 1.0
    for j in range(n):
        if elements > 0:
            w = read_ring(nodal, elem[j], shape[j])
        else:
            angle = turned + 2.0 * math.pi * j / n
            w = rigid_radial(k, amplitude, growth, rise, time, angle)
        gaps[j] = gap + w - u[j]
        lowest = min(lowest, gaps[j])
    return lowest


@njit(cache=True)
def march_modal(
    steps,
    stride,
    limit,
    step,
    speed,
    mu,
    scene,
    load,
    rotor,
    casing,
    contact,
    state,
    tracks,
):
    """March `steps` steps of scheme `modal` (see timestep.recursion).

    Parameters
    ----------
    steps, stride : steps to take; steps between samples
    limit : tip displacement that ends the run, m
    step, speed : dt, s; Omega, rad/s
    mu : friction coefficient times the sign of Omega
    scene : (gap, k, amplitude, growth, rise)
    load : (F, tau, modal load (mc,))
    rotor : (keep, pull, give, rate, omega, outputs (mb, N + 2), radial (N, mb),
        tangential (N, mb)); outputs are radial tips, then x_o, y_o
    casing : (keep, pull, give, rate, omega, nodal (mc, 2 elements),
        shapes (4 elements, mc), arc length of an element)
    contact : (W of the rotor (N, N), compliance (2 elements) squared)
    state : q, d of rotor and casing, losses, gaps of the last two steps, touching,
        counter, ledger, impulse
    tracks : centre, energy, impulse, fed, lost, tips, blade impulse
    """
    force, pulse, lobes = load
    (keep_b, pull_b, give_b, rate_b, omega_b, outputs, radial, tangential) = rotor
    (keep_c, pull_c, give_c, rate_c, omega_c, nodal_rows, shapes, length) = casing
    w_rotor, compliance = contact
    (
        q_b,
        d_b,
        q_c,
        d_c,
        loss_b,
        loss_c,
        last_gaps,
        older_gaps,
        touching,
        counter,
        ledger,
        impulse,
    ) = state
    blades = len(last_gaps)
    elements = len(compliance) // 2
    ahead_b, next_b = np.empty_like(q_b), np.empty_like(q_b)
    ahead_c, next_c = np.empty_like(q_c), np.empty_like(q_c)
    normal_b, drag_b = np.empty_like(q_b), np.empty_like(q_b)
    normal_c, drag_c = np.empty_like(q_c), np.empty_like(q_c)
    u, nodal = np.zeros(blades + 2), np.zeros(2 * elements)
    gaps, opened, lam = np.zeros(blades), np.zeros(blades), np.zeros(blades)
    elem, shape = np.zeros(blades, np.int64), np.zeros((blades, 4))
    full, small = np.zeros((blades, blades)), np.zeros((blades, blades))
    right, response = np.zeros(blades), np.zeros(2 * elements)
    active, have = np.zeros(blades, np.int64), np.zeros(blades, np.int64)
    for _ in range(steps):
        now = counter[STEP] * step
        following = (counter[STEP] + 1) * step
        turned = (speed * following) % (2.0 * math.pi)
        predict(keep_b, pull_b, q_b, d_b, ahead_b, next_b)
        predict(keep_c, pull_c, q_c, d_c, ahead_c, next_c)
        push = pulse_of(now, force, pulse)
        if push != 0.0:
            for m in range(len(q_c)):
                change = give_c[m] * push * lobes[m]
                ahead_c[m] += change
                next_c[m] += change
        accumulate(outputs, next_b, u)
        if elements > 0:
            accumulate(nodal_rows, next_c, nodal)
            place_blades(turned, blades, elements, length, elem, shape)
        lowest = read_gaps(
            u, nodal, scene, elem, shape, elements, turned, following, gaps
        )
        counter[STEP] += 1
        if lowest < 0.0:
            if not complementarity(
                gaps,
                w_rotor,
                compliance,
                elem,
                shape,
                lam,
                opened,
                response,
                full,
                have,
                active,
                small,
                right,
            ):
                counter[STOP] = COMPLEMENTARITY
                return
            normal_b[:] = 0.0
            drag_b[:] = 0.0
            normal_c[:] = 0.0
            drag_c[:] = 0.0
            for j in range(blades):
                if lam[j] > 0.0:
                    for m in range(len(q_b)):
                        normal_b[m] -= lam[j] * radial[j, m]
                        drag_b[m] -= lam[j] * tangential[j, m]
                    if elements > 0:
                        for a in range(4):
                            node = 4 * ((elem[j] + a // 2) % elements) + a % 2
                            part = lam[j] * shape[j, a]
                            for m in range(len(q_c)):
                                normal_c[m] += part * shapes[node + 2, m]
                                drag_c[m] += part * shapes[node, m]
            push_modes(normal_b, drag_b, mu, give_b, ahead_b, d_b, next_b, ledger)
            push_modes(normal_c, drag_c, mu, give_c, ahead_c, d_c, next_c, ledger)
            book_contacts(
                blades,
                lam,
                opened,
                older_gaps,
                touching,
                counter,
                ledger,
                impulse,
                step,
            )
        else:
            for j in range(blades):
                opened[j] = gaps[j]
                touching[j] = 0
        if push != 0.0:
            for m in range(len(q_c)):
                ledger[PULSE] += push * lobes[m] * 0.5 * (ahead_c[m] + d_c[m])
        accept(q_b, d_b, ahead_b, rate_b, loss_b)
        accept(q_c, d_c, ahead_c, rate_c, loss_c)
        for j in range(blades):
            older_gaps[j] = last_gaps[j]
            last_gaps[j] = opened[j]
        if counter[STEP] % FLUSH_EVERY == 0:
            flush(q_b, d_b)
            flush(q_c, d_c)
        if counter[STEP] % stride == 0:
            energy = modal_energy(q_b, d_b, omega_b, step)
            energy += modal_energy(q_c, d_c, omega_c, step)
            accumulate(outputs, q_b, u)
            lost = loss_b.sum() + loss_c.sum()
            write_sample(counter, ledger, impulse, u, energy, lost, limit, tracks)
            write_tips(counter, u, tangential, q_b, tracks)
            counter[SAMPLE] += 1
            if counter[STOP] != RUNNING:
                return


@njit(cache=True)
def write_sample(counter, ledger, impulse, u, energy, lost, limit, tracks):
    """Write one sample of everything but the tips; decide whether to stop."""
    centre, energies, impulses, fed, losses, _, blade_impulse = tracks
    s = counter[SAMPLE]
    blades = len(impulse)
    centre[s, 0], centre[s, 1] = u[blades], u[blades + 1]
    energies[s] = energy
    impulses[s] = ledger[IMPULSE]
    fed[s] = ledger[ROTATION] + ledger[FRICTION]
    losses[s] = lost + ledger[IMPACT]
    if len(blade_impulse) > 0:
        blade_impulse[s, :] = impulse
    for j in range(blades):
        if abs(u[j]) > limit:
            counter[STOP] = AMPLITUDE
    if not math.isfinite(energy):
        counter[STOP] = NONFINITE


@njit(cache=True)
def write_tips(counter, u, tangential, q_b, tracks):
    """Write radial and tangential tip displacements, where they are asked for."""
    tips = tracks[5]
    if len(tips) == 0:
        return
    s = counter[SAMPLE]
    for j in range(len(tangential)):
        total = 0.0
        for m in range(len(q_b)):
            total += tangential[j, m] * q_b[m]
        tips[s, j, 0] = u[j]
        tips[s, j, 1] = total


@njit(cache=True)
def apply_dense(matrix_t, vector, sign, out):
    """Add sign * matrix @ vector to out; `matrix_t` is stored by columns."""
    for c in range(len(vector)):
        factor = sign * vector[c]
        column = matrix_t[c]
        for r in range(len(out)):
            out[r] += factor * column[r]


@njit(cache=True)
def accept_dense(values, increments, ahead, damping, step, work):
    """Take the step; return damping loss (d' + d)^T D (d' + d) / (4 dt), J."""
    for i in range(len(values)):
        increments[i] += ahead[i]
    work[:] = 0.0
    apply_dense(damping, increments, 1.0, work)
    loss = 0.0
    for i in range(len(values)):
        loss += increments[i] * work[i]
        increments[i] = ahead[i]
        values[i] += ahead[i]
    return loss / (4.0 * step)


@njit(cache=True)
def dense_energy(values, increments, mass, stiffness, step, work):
    """Return 1/2 v^T M v + 1/2 x_n^T K x_{n+1} at n + 1/2, J."""
    work[:] = 0.0
    apply_dense(mass, increments, 0.5 / step**2, work)
    total = 0.0
    for i in range(len(values)):
        total += work[i] * increments[i]
    work[:] = 0.0
    apply_dense(stiffness, values, 0.5, work)
    for i in range(len(values)):
        total += work[i] * (values[i] - increments[i])
    return total


@njit(cache=True)
def push_dense(force_n, force_t, mu, inverse, ahead, increments, ledger, work):
    """Correct dense increments by contact forces and enter their work."""
    for i in range(len(ahead)):
        work[i] = force_n[i] + mu * force_t[i]
    for c in range(len(work)):
        if work[c] != 0.0:
            for r in range(len(ahead)):
                ahead[r] += inverse[c, r] * work[c]
    for i in range(len(ahead)):
        mean = 0.5 * (ahead[i] + increments[i])
        ledger[ROTATION] += force_n[i] * mean
        ledger[FRICTION] += mu * force_t[i] * mean


@njit(cache=True)
def march_paper(
    steps,
    stride,
    limit,
    step,
    speed,
    mu,
    scene,
    load,
    rotor,
    casing,
    contact,
    state,
    tracks,
):
    """March `steps` steps of Algorithm 1 on the dense matrices.

    As `march_modal`, with the bodies in physical coordinates: rotor and casing are
    (keep, pull, inverse, mass, stiffness, damping), keep = A^-1 (M/dt^2 - D/2dt),
    pull = A^-1 K, inverse = A^-1, A = M/dt^2 + D/2dt, each stored transposed;
    load is (F, tau, nodal load). Tips are the rotor's first 2 N coordinates, x_o and
    y_o the next two; `casing` ends with the arc length of an element.
    """
    force, pulse, lobes = load
    keep_b, pull_b, inverse_b, mass_b, stiff_b, damp_b, free = rotor
    keep_c, pull_c, inverse_c, mass_c, stiff_c, damp_c, length = casing
    w_rotor, compliance = contact
    (
        x_b,
        d_b,
        x_c,
        d_c,
        loss_b,
        loss_c,
        last_gaps,
        older_gaps,
        touching,
        counter,
        ledger,
        impulse,
    ) = state
    blades = len(last_gaps)
    elements = len(compliance) // 2
    ahead_b, ahead_c = np.empty_like(x_b), np.empty_like(x_c)
    normal_b, drag_b = np.empty_like(x_b), np.empty_like(x_b)
    normal_c, drag_c = np.empty_like(x_c), np.empty_like(x_c)
    work_b, work_c = np.empty_like(x_b), np.empty_like(x_c)
    u, nodal = np.zeros(blades + 2), np.zeros(2 * elements)
    gaps, opened, lam = np.zeros(blades), np.zeros(blades), np.zeros(blades)
    elem, shape = np.zeros(blades, np.int64), np.zeros((blades, 4))
    full, small = np.zeros((blades, blades)), np.zeros((blades, blades))
    right, response = np.zeros(blades), np.zeros(2 * elements)
    active, have = np.zeros(blades, np.int64), np.zeros(blades, np.int64)
    for _ in range(steps):
        now = counter[STEP] * step
        following = (counter[STEP] + 1) * step
        turned = (speed * following) % (2.0 * math.pi)
        ahead_b[:] = 0.0
        ahead_c[:] = 0.0
        apply_dense(keep_b, d_b, 1.0, ahead_b)
        apply_dense(pull_b, x_b, -1.0, ahead_b)
        apply_dense(keep_c, d_c, 1.0, ahead_c)
        apply_dense(pull_c, x_c, -1.0, ahead_c)
        push = pulse_of(now, force, pulse)
        if push != 0.0:
            apply_dense(inverse_c, lobes, push, ahead_c)
        for j in range(blades):
            u[j] = x_b[2 * j] + ahead_b[2 * j]
        for node in range(elements):
            nodal[2 * node] = x_c[4 * node + 2] + ahead_c[4 * node + 2]
            nodal[2 * node + 1] = x_c[4 * node + 3] + ahead_c[4 * node + 3]
        if elements > 0:
            place_blades(turned, blades, elements, length, elem, shape)
        lowest = read_gaps(
            u, nodal, scene, elem, shape, elements, turned, following, gaps
        )
        counter[STEP] += 1
        if lowest < 0.0:
            if not complementarity(
                gaps,
                w_rotor,
                compliance,
                elem,
                shape,
                lam,
                opened,
                response,
                full,
                have,
                active,
                small,
                right,
            ):
                counter[STOP] = COMPLEMENTARITY
                return
            normal_b[:] = 0.0
            drag_b[:] = 0.0
            normal_c[:] = 0.0
            drag_c[:] = 0.0
            for j in range(blades):
                if lam[j] > 0.0:
                    normal_b[2 * j] = -lam[j]
                    drag_b[2 * j + 1] = -lam[j]
                    if elements > 0:
                        for a in range(4):
                            node = 4 * ((elem[j] + a // 2) % elements) + a % 2
                            normal_c[node + 2] += lam[j] * shape[j, a]
                            drag_c[node] += lam[j] * shape[j, a]
            push_dense(normal_b, drag_b, mu, inverse_b, ahead_b, d_b, ledger, work_b)
            push_dense(normal_c, drag_c, mu, inverse_c, ahead_c, d_c, ledger, work_c)
            book_contacts(
                blades,
                lam,
                opened,
                older_gaps,
                touching,
                counter,
                ledger,
                impulse,
                step,
            )
        else:
            for j in range(blades):
                opened[j] = gaps[j]
                touching[j] = 0
        if push != 0.0:
            for i in range(len(x_c)):
                ledger[PULSE] += push * lobes[i] * 0.5 * (ahead_c[i] + d_c[i])
        loss_b[0] += accept_dense(x_b, d_b, ahead_b, damp_b, step, work_b)
        loss_c[0] += accept_dense(x_c, d_c, ahead_c, damp_c, step, work_c)
        for j in range(blades):
            older_gaps[j] = last_gaps[j]
            last_gaps[j] = opened[j]
        if counter[STEP] % FLUSH_EVERY == 0:
            flush(x_b, d_b)
            flush(x_c, d_c)
        if counter[STEP] % stride == 0:
            energy = dense_energy(x_b, d_b, mass_b, stiff_b, step, work_b)
            energy += dense_energy(x_c, d_c, mass_c, stiff_c, step, work_c)
            for j in range(blades):
                u[j] = x_b[2 * j]
            if free == 1:
                u[blades] = x_b[2 * blades]
                u[blades + 1] = x_b[2 * blades + 1]
            lost = loss_b.sum() + loss_c.sum()
            write_sample(counter, ledger, impulse, u, energy, lost, limit, tracks)
            if len(tracks[5]) > 0:
                for j in range(blades):
                    tracks[5][counter[SAMPLE], j, 0] = x_b[2 * j]
                    tracks[5][counter[SAMPLE], j, 1] = x_b[2 * j + 1]
            counter[SAMPLE] += 1
            if counter[STOP] != RUNNING:
                return
