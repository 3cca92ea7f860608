"""Contact of blades and casing: positions of blades, Delassus matrix, complementarity.

Sign and frame: theta grows anticlockwise; the tip of blade j is at theta_j = Omega t +
2 pi j / N; u_j is its radial displacement (rotating frame), w(theta) that of the casing
(static frame), both outward, m; its gap is g_j = gap + w(theta_j) - u_j. A multiplier
lambda_j >= 0, N, is the normal force between tip j and casing: it pushes the tip inward
and the casing outward; friction mu lambda_j drags the tip against the rotation and the
casing with it: `mu` carries the sign of Omega.

The module also keeps the account of a run: the ledger of works and losses, the
counters, and the samples that are written of the motion.

Compiled functions take scalars and arrays and allocate nothing in a step.
"""

from __future__ import annotations

import math

import numpy as np

from hpcwhirl.dynamics.kernels.compiled import by_numba, inlined, kernel, part, rare
from hpcwhirl.dynamics.kernels.kernel_types import ContactSpace
from hpcwhirl.dynamics.kernels.pivoting import begin, gather, improve, solve_singular

# indices of the ledger, whose entries are in J, IMPULSE in N s, others as said here
PULSE, IMPACT, FRICTION, ROTATION, IMPULSE = 0, 1, 2, 3, 4
# m, bound of all displacements after a certificate; largest relative error of the gaps
# that the contact solver has found, see `samples`
CERTIFICATE, MISS = 5, 6
SLIP = 7  # m/s, largest tangential velocity of a tip in contact; see `note_slip`
WEAR = 8  # J, work of wear, part of IMPACT; see `layer`
# of set-valued friction, see `coulomb`: J, its work on the slides of tips, in the loop
# `bodies` alone; N s, its impulse along theta; J, what the rotation gives against it
HEAT, TANGENTIAL, TURNED = 9, 10, 11
ENTRIES = 12  # number of entries of the ledger
# number of terms of `Tracks.closed`, J: energy, damping, pulse, impact, friction,
# rotation, wear
CLOSED = 7
# indices of the counters: steps taken, touchdowns, last step with contact, samples
# written, reason to stop, steps with contact
STEP, TOUCHDOWNS, LAST, SAMPLE, STOP, TOUCHED = 0, 1, 2, 3, 4, 5
# counters of the exact scheme: last completed step (not pending), step at which a jump
# is tried next, steps between tries, step of the certificate, steps skipped, jumps
ENDED, NEXT_TRY, PATIENCE, CERTIFIED, JUMPED, JUMPS = 6, 7, 8, 9, 10, 11
JUDGED = 12  # rows of evidence written
NEXT_LOOK = 13  # step of the next check of the amplitude limit, see `watch`
# of set-valued friction: tips in contact, of these those that stuck, and those that
# slid against the rotation, summed over steps
MET, STUCK, REVERSED = 14, 15, 16
COUNTERS = 17  # number of counters
# columns of the evidence: centre x_o, y_o, m; energies of rotor and casing, J;
# cumulative work fed, its part by friction, energy lost, J; see `History.judged`
AT_X, AT_Y, OF_ROTOR, OF_CASING, WAS_FED, WAS_RUBBED, WAS_LOST = range(7)
COLUMNS = 7  # number of columns of the evidence at constant speed
BESIDE_X, BESIDE_Y, OF_WHOLE = range(COLUMNS, COLUMNS + 3)  # see `oracle.body`
LOOK_EVERY = 32  # steps between two checks of the tips' displacements
SLIP_EVERY = 8  # one of so many steps with contact is checked for slip
FLUSH_EVERY = 256  # steps between two searches for tiny amplitudes, see `flush`
TINY = 1e-150  # magnitude below which an amplitude is set to 0
NOWHERE = 1.0  # m, gap of a lost blade
NEAR = 0.5  # share of the amplitude limit beyond which every step is checked
# reasons to stop a run: none yet; a tip beyond the amplitude limit; a number that is
# not finite; a contact problem without solution
RUNNING, AMPLITUDE, NONFINITE, COMPLEMENTARITY = 0, 1, 2, 3
# kinds of casing: rigid, a ring of elements, a ring of harmonics
RIGID, ELEMENTS, WAVES = 0, 1, 2


@kernel
def place_on_elements(turned, size, length, turns, index, shape):
    """Find which nodes of a ring of elements move each contact point, and how much.

    The ring's radial displacement at a point is the sum of four nodal coordinates
    (radial displacement and slope at both ends of the element there) times Hermite
    functions.

    Parameters
    ----------
    turned : rad, angle of blade 0 in the static frame
    size, length : number of elements of the ring; length of one, m
    turns : (N,), angles from blade 0 to the N contact points, in turns
    index, shape : (N, 4), out: indices of the four coordinates in the list of the
        ring's radial ones, and the values of their Hermite functions at the point
    """
    for j in range(len(index)):
        part = turned / (2.0 * math.pi) + turns[j]
        part = (part - math.floor(part)) * size
        e = min(int(part), size - 1)
        x = part - e
        for a in range(4):
            index[j, a] = (2 * e + a) % (2 * size)
        shape[j, 0] = 1.0 - 3.0 * x * x + 2.0 * x * x * x
        shape[j, 1] = x * (1.0 - x) * (1.0 - x) * length
        shape[j, 2] = 3.0 * x * x - 2.0 * x * x * x
        shape[j, 3] = x * x * (x - 1.0) * length


@kernel
def place_on_waves(turned, size, angles, weight, index, shape):
    """Find how much each harmonic of an elastic ring moves each contact point.

    The ring's radial displacement at a point is the sum of the harmonics' coordinates
    times 1, cos h theta, sin h theta, theta the point's angle in the static frame,
    times the value there of each axial function.

    Parameters
    ----------
    turned, size : rad, angle of blade 0 in the static frame; the ring's highest
        harmonic
    angles : (N,), rad, from blade 0 to the N contact points
    weight : (N, L), values of the ring's L axial functions at the points
    index, shape : (N, L (2 size + 1)), out: indices of the ring's radial coordinates,
        and the factors by which they move the point
    """
    wide = 2 * size + 1
    for j in range(len(index)):
        theta = turned + angles[j]
        c, s = math.cos(theta), math.sin(theta)
        for layer in range(weight.shape[1]):
            own, at = weight[j, layer], layer * wide
            x, y = 1.0, 0.0
            index[j, at], shape[j, at] = at, own
            for h in range(1, size + 1):
                x, y = c * x - s * y, s * x + c * y
                a, b = at + 2 * h - 1, at + 2 * h
                index[j, a], index[j, b] = a, b
                shape[j, a], shape[j, b] = own * x, own * y


@kernel
def read_ring(radial, index, shape, j):
    """Return the ring's outward displacement, m, at contact point j.

    radial : (R,), m, the ring's R radial coordinates
    index, shape : (N, w), indices of the w coordinates that move each point, and their
        weights, from `place_on_elements` or `place_on_waves`
    """
    total = 0.0
    for a in range(index.shape[1]):
        total += shape[j, a] * radial[index[j, a]]
    return total


@inlined
def gap_at(wall, time):
    """Return the clearance, m, between undeformed tips and a round casing at a time, s.

    It changes at the constant rate wall.opening, m/s, from wall.gap at wall.since.

    wall : `kernel_types.Wall`
    """
    return wall.gap + wall.opening * (time - wall.since)


@inlined
def angle_at(wall, speed, time):
    """Return the angle of blade 0 in the static frame at a time, rad.

    It is Omega t at constant speed, with a quadratic term in an interval of changing
    speed.

    wall, speed : `kernel_types.Wall`; Omega, rad/s
    """
    late = time - wall.since
    return speed * time + (wall.ahead + wall.bend * late * late)


@inlined
def turned_by(wall, speed, time, step):
    """Return the angle by which the rotor turns in the step that begins at a time, rad.

    wall, speed, step : `kernel_types.Wall`; Omega, rad/s; dt, s
    """
    late = time - wall.since
    return speed * step + wall.bend * step * (2.0 * late + step)


@inlined
def slides_at(wall, speed, radius, time, step):
    """Return Omega R dt of the step that ends at a time, s, and of the one before, m.

    A casing that is integrated in the rotor's frame turns back at a constant rate in an
    interval of changing speed, while tips follow Omega(t): a tip that sticks has no
    other velocity.

    wall, speed, radius, step : `kernel_types.Wall`; Omega, rad/s; R, m; dt, s
    """
    late = time - wall.since
    now = turned_by(wall, speed, time - step, step)
    now += step * (wall.lag + wall.hurry * (late - 0.5 * step))
    before = turned_by(wall, speed, time - step - step, step)
    before += step * (wall.lag + wall.hurry * (late - 1.5 * step))
    return radius * now, radius * before


@kernel
def pulse_of(time, force, pulse):
    """Return the force, N, of the pulse on the casing at a time, s.

    It is F sin(pi t / tau) for 0 < t < tau, else 0.

    force, pulse : F, N; its duration tau, s
    """
    if 0.0 < time < pulse:
        return force * math.sin(math.pi * time / pulse)
    return 0.0


@kernel
def delassus_row(j, w_rotor, compliance, index, shape, response, w):
    """Compute how much a unit multiplier on blade j opens each gap, m/N: set w[j].

    That is column j of the Delassus matrix W, of rotor and ring; w is W transposed.

    w_rotor : (N, N), m/N, the rotor's part of W
    compliance : (R, R), m/N, row i has the ring's R radial coordinates due to a unit
        load, with its friction, on radial coordinate i
    index, shape : (N, w), the w coordinates of the ring that move each point, and
        weights
    response : (R,), m/N, work space; (0,) for a rigid casing
    """
    for i in range(len(w_rotor)):
        w[j, i] = w_rotor[i, j]
    if len(response) == 0:
        return
    response[:] = 0.0
    for a in range(index.shape[1]):
        row, part = compliance[index[j, a]], shape[j, a]
        for r in range(len(response)):
            response[r] += part * row[r]
    for i in range(len(w_rotor)):
        w[j, i] += read_ring(response, index, shape, i)


@part
def delassus_rows(size, w_rotor, compliance, index, shape, space):
    """Compute the columns of the Delassus matrix for the tips space.where[:size].

    Those that space.have tells are left; the arguments are those of `delassus_row` and
    `complementarity`.
    """
    where, have = space.where, space.have
    for s in range(size):
        if have[where[s]] == 0:
            delassus_row(
                where[s], w_rotor, compliance, index, shape, space.response, space.w
            )
            have[where[s]] = 1


@kernel
def complementarity(gaps, w_rotor, compliance, index, shape, lam, opened, space):
    """Compute the contact forces of a step: multipliers that prevent penetration.

    Solve 0 <= lam, 0 <= g + W lam, lam . (g + W lam) = 0: g are the gaps predicted
    without contact, W is the Delassus matrix. Return the number of active blades (those
    in contact), listed first in space.where, or -1 if no solution was found. The method
    is block principal pivoting from the penetrating blades; after 3 N exchanges only
    the last violating blade is exchanged (Murty), which ends for any P-matrix. If a
    part of W is singular, since more blades touch than the bodies have modes for, the
    method is Lemke's, see `pivoting`.

    Parameters
    ----------
    gaps : (N,), m, g; below 0 where the tip penetrates
    w_rotor, compliance, index, shape : parts of W, as in `delassus_row`
    lam, opened : (N,), out: multipliers, N, and gaps g + W lam with them, m
    space : result of `contact_space`; rows of its `w` are reused where `have` is 1
    """
    response, w, have, _, _, active, where, _, _, _ = space
    largest = begin(gaps, lam, active)
    for attempt in range(3 * len(gaps) + 200):
        size = gather(active, where)
        delassus_rows(size, w_rotor, compliance, index, shape, space)
        wrong = improve(gaps, size, lam, opened, attempt, largest, space)
        if wrong == 0:
            return size
        if wrong < 0:
            break
    for j in range(len(gaps)):
        if have[j] == 0:
            delassus_row(j, w_rotor, compliance, index, shape, response, w)
            have[j] = 1
    return solve_singular(gaps, lam, opened, space)


@by_numba()
def contact_space(blades, coordinates):
    """Return new work arrays for the contact solver `complementarity`.

    blades, coordinates : N; number R of the ring's radial coordinates
    """
    return ContactSpace(
        np.zeros(coordinates),
        np.zeros((blades, blades)),
        np.zeros(blades, np.int64),
        np.zeros((blades, blades + 1)),
        np.zeros(blades),
        np.zeros(blades, np.int64),
        np.zeros(blades + 1, np.int64),
        np.zeros(blades, np.int64),
        np.zeros(blades, np.int64),
        np.zeros(blades + 1, np.int64),
    )


@inlined
def book_work(entry, work, given, ledger):
    """Enter work, J, in the ledger, and what the rotation gives for it.

    What is lost or stored at once as contact closes, entry IMPACT, is work of the
    rotation. Energies are those of the motion that contact causes: of work of FRICTION
    on the other one, the rotation that keeps it going gives the opposite.
    """
    ledger[entry] += work
    ledger[ROTATION] += given


@part
def book_contacts(push, where, active, before, last, counter, ledger, impulse, step):
    """Enter a step's contacts in the account: impact loss, impulse, touchdowns.

    The work of the normal forces on both bodies is already in ledger[ROTATION]; its
    part lambda (g_{n+1} - g_{n-1}) / 2 is the impact loss and is moved to
    ledger[IMPACT].

    push : multipliers, N, of the blades in contact, which are where[:active]
    before : (N,), m, gaps of step n - 1, if the multipliers act at step n; the gaps of
        blades in contact are 0 at step n + 1
    last, impulse : (N,), in and out: step of each blade's last contact; its normal
        impulse so far, N s
    step : dt, s
    """
    work, total = 0.0, 0.0
    for s in range(active):
        j = where[s]
        work -= 0.5 * push[s] * before[j]
        total += push[s] * step
        impulse[j] += push[s] * step
        counter[TOUCHDOWNS] += last[j] != counter[STEP] - 1
        last[j] = counter[STEP]
    book_work(IMPACT, -work, -work, ledger)
    ledger[IMPULSE] += total
    counter[LAST] = counter[STEP]
    counter[TOUCHED] += 1


@inlined
def watch(far, limit, counter):
    """Stop the run if a tip moves beyond the amplitude limit; plan the next check.

    The check is repeated at each step once a tip is beyond half the limit, else after
    `LOOK_EVERY` steps. So a run ends at the first step beyond the limit; later if a
    displacement doubles within `LOOK_EVERY` steps, or if `exact` skips that step by a
    jump.

    far : m, largest magnitude of a tip's displacement; or an upper bound of it, if that
        is below `NEAR` times the limit
    limit : m
    counter : counters of the run; its entries STOP and NEXT_LOOK are set
    """
    if far > limit:
        counter[STOP] = AMPLITUDE
    soon = far > NEAR * limit
    counter[NEXT_LOOK] = counter[STEP] + (1 if soon else LOOK_EVERY)


@inlined
def slips_now(counter):
    """Return whether the tips' sliding velocity in the last step is to be checked.

    It is checked in every eighth step with contact.

    counter : counters of the run
    """
    return counter[LAST] == counter[STEP] and counter[TOUCHED] % SLIP_EVERY == 1


@inlined
def slips_next(counter):
    """Return whether `slips_now` holds after this step, in which blades touch."""
    return (counter[TOUCHED] + 1) % SLIP_EVERY == 1


@part
def note_slip(both, step, ledger):
    """Raise ledger[SLIP] to the slip, m/s, of a tip in contact, if this is larger.

    The slip is the tangential velocity of the tip by vibration relative to that of the
    casing, without Omega R, averaged over both sides of a step. Friction drags against
    the rotation, as the model assumes, as long as the slip is below |Omega| R.

    both : m, dt (v- + v+) of the casing at a blade less that of its tip, along the
        rotation; v- and v+ are the velocities before and after the impulse of the step
    step : dt, s
    """
    speed = abs(both) / (2.0 * step)
    ledger[SLIP] = max(ledger[SLIP], speed)


@rare
def write_sample(
    counter, ledger, impulse, tips, casing, energies, lost, keep, judge, tracks
):
    """Write the state of a step to the stored traces, to the evidence, or to both.

    Traces are sampled at the user's output interval, which does not affect the run;
    rows of evidence have an interval of their own, and only they detect a motion that
    is not finite and end the run.

    Parameters
    ----------
    counter, ledger, impulse : of the state; the last one (N,), N s, for each blade
    tips : (N + 1, 2), m, rotating frame: radial and tangential displacement of each
        tip, then the centre's x_o, y_o
    casing : (n,), coordinates of the casing, which depend on the scheme
    energies, lost : (2,), J, of rotor and casing; J, dissipated by damping so far
    keep, judge : whether to write a sample of the traces; a row of the evidence
    tracks : `kernel_types.Tracks`, out
    """
    energy = energies[0] + energies[1]
    whole = energy + lost
    for entry in range(MISS + 1):
        whole += ledger[entry]
    if not math.isfinite(whole):
        if judge:
            counter[STOP] = NONFINITE
        return
    if keep:
        keep_sample(counter, ledger, impulse, tips, casing, energy, lost, tracks)
    if judge:
        judge_sample(counter, ledger, tips, len(impulse), energies, lost, tracks)


@part
def keep_state(first, second, counter, ledger, every, states):
    """Copy the rotor's part of a state to its row of those kept, see `Tracks`.

    first, second : the arrays of the rotor's part, one after the other
    counter, ledger, every : of the state; steps between two kept states
    states : out
    """
    row, size = states[counter[STEP] // every % len(states)], len(first)
    for i in range(size):
        row[i] = first[i]
    for i in range(len(second)):
        row[size + i] = second[i]
    row[len(row) - 2], row[len(row) - 1] = ledger[IMPULSE], ledger[TANGENTIAL]


@inlined
def keep_sample(counter, ledger, impulse, tips, casing, energy, lost, tracks):
    """Write the state of a step to the next sample of the stored traces.

    Arguments are those of `write_sample`; energy : J, of both bodies together
    """
    s, blades = counter[SAMPLE], len(impulse)
    tracks.centre[s, 0], tracks.centre[s, 1] = tips[blades, 0], tips[blades, 1]
    tracks.energy[s] = energy
    tracks.impulse[s] = ledger[IMPULSE]
    tracks.fed[s] = ledger[ROTATION] + ledger[FRICTION]
    tracks.rubbed[s] = ledger[FRICTION]
    tracks.lost[s] = lost + ledger[IMPACT]
    if len(tracks.tips) > 0:
        for j in range(blades):
            tracks.tips[s, j, 0], tracks.tips[s, j, 1] = tips[j, 0], tips[j, 1]
            tracks.blade_impulse[s, j] = impulse[j]
    if len(tracks.casing) > 0:
        for m in range(tracks.casing.shape[1]):
            tracks.casing[s, m] = casing[m]
    counter[SAMPLE] += 1


@inlined
def judge_sample(counter, ledger, tips, blades, energies, lost, tracks):
    """Write the state of a step to the next row of evidence, from which words follow.

    The terms of the energy balance up to this row are written to tracks.closed.
    Arguments are those of `write_sample`; blades : N
    """
    row, closed = tracks.evidence[counter[JUDGED]], tracks.closed
    row[AT_X], row[AT_Y] = tips[blades, 0], tips[blades, 1]
    row[OF_ROTOR], row[OF_CASING] = energies[0], energies[1]
    row[WAS_FED] = ledger[ROTATION] + ledger[FRICTION]
    row[WAS_RUBBED] = ledger[FRICTION]
    row[WAS_LOST] = lost + ledger[IMPACT]
    closed[0], closed[1] = energies[0] + energies[1], lost
    closed[2], closed[3] = ledger[PULSE], ledger[IMPACT]
    closed[4], closed[5] = ledger[FRICTION], ledger[ROTATION]
    closed[6] = ledger[WEAR]
    counter[JUDGED] += 1
