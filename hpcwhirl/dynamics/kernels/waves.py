"""The cyclic kernel for a rotor as waves, forward and backward ones separate.

Rotation couples the modes of a nodal diameter but not its waves (see
`dynamics.turning_waves`). A wave has a complex amplitude a: a step without forces makes
it z a, and contact forces add beta Lambda, with Lambda the spectrum of the multipliers.
A step is pending until the next pass applies its contact forces, as in `passes`; ring,
transform and contact are those of `cyclic`.

Amplitudes are sorted in rows: row f holds one wave of every slot, re then im. For
central differences they are followed by the spectra of the gaps of the last three
steps. The items of four neighbouring waves p .. p + 3 are contiguous, item i at (p
ITEMS + 4 i).

A jump over n steps multiplies a wave by z^n. With its root s, a ~ e^{s t}, bounds of
gaps follow from |gamma a|, |gamma s a| and |gamma s^2 a|, see `flight`.

Free motion loses Jacobi's energy only by the matrices D and S. So the rotor's loss is
what contact forces have added to energy and loss together, less the present energy.
"""

from __future__ import annotations

from hpcwhirl.dynamics.kernels.compiled import (
    does,
    inlined,
    kernel,
    part,
    rare,
    rare_kernel,
)
from hpcwhirl.dynamics.kernels.contact import LAST, STEP
from hpcwhirl.dynamics.kernels.flight import bound_rotor, jump_rotor
from hpcwhirl.dynamics.kernels.kernel_types import CyclicState, Wanted
from hpcwhirl.dynamics.kernels.passes import (
    copy_to,
    load_both,
    one_norm,
    store_both,
    to_gaps,
)
from hpcwhirl.dynamics.kernels.samples import (
    add_ring,
    along_of,
    at_blade,
    note_miss_folded,
    read_centre,
    sample_rotor,
    write_all,
)
from hpcwhirl.dynamics.kernels.stepping import (
    end_step,
    energies_of,
    energy_of_ring,
    is_exact,
    pass_rotor,
    settle_ring,
)
from hpcwhirl.dynamics.kernels.vectors import (
    FOUR,
    broadcast,
    fma,
    fnma,
    load,
    root,
    store,
    total_of,
)
from hpcwhirl.dynamics.kernels.wave_types import WaveRotor

# items of a wave: z - 1; gap per unit amplitude; beta; motion of the tip along the
# casing over two steps, d' + d, after a step without forces, with negative sign;
# factors of Lambda in what it adds to energy and loss
AHEAD_RE, AHEAD_IM, RADIAL, PUSH_RE, PUSH_IM = range(5)
RATE_RE, RATE_IM, WORK_RE, WORK_IM = range(5, 9)
ITEMS = 9
# items of a slot, for a unit Lambda: change of the gap; of that motion along the
# casing; energy and loss added
OPENS_RE, OPENS_IM, SLIDES_RE, SLIDES_IM, ADDS = range(5)
FIXED = 5
# further items of the exact flow: dt (v- + v+) of the gap, v- and v+ its rates before
# and after an impulse, by waves, by a unit Lambda
NEARS_RE, NEARS_IM = ITEMS, ITEMS + 1
FLOW_ITEMS, FLOW_FIXED = ITEMS + 2, FIXED + 2
SEEN = 3  # steps whose spectra of gaps the state has, for central differences
# items of a jump: z^n; of the bounds: gamma s, |gamma s^2|, |gamma|
TURNED_RE, TURNED_IM = range(2)
JUMP_ITEMS = 2
VELOCITY_RE, VELOCITY_IM, RISE, REACH = range(4)
BOUND_ITEMS = 4


@inlined
def times(c, at, which, re, im, total):
    """Return total + c (re + i im) for four waves, as a pair (re, im).

    c, at : packed coefficients of all waves, and the index at which those of the four
        waves begin
    which : number of the coefficient that is c, such as `PUSH_RE`; its imaginary part
        is number `which` + 1
    re, im, total : amplitudes or other complex numbers; pair (re, im) of sums
    """
    a, b = load(c, at + which * FOUR), load(c, at + (which + 1) * FOUR)
    real = fnma(b, im, fma(a, re, total[0]))
    return real, fma(b, re, fma(a, im, total[1]))


@inlined
def columns(s, c, fixed, lam, rows, k, seen, touched, exact, out, sums, slip):
    """Apply the last step's contact forces to a rotor's waves; predict the next step.

    Arguments not listed are those of `pass_waves`.

    fixed : flat, effects of a unit spectrum of the multipliers at each of k nodal
        diameters, such as `OPENS_RE`
    touched, exact : whether the last step had contact; whether the exact flow is used
    seen : first indices in s of the spectra of the gaps of the last step, of two steps
        before it, and of the predicted step; the last two coincide
    """
    own, older, next_one = seen
    items, zero = FLOW_ITEMS if exact else ITEMS, broadcast(0.0)
    for col in range(0, k, FOUR):
        push = load_both(lam, k, col)
        real, imag, rate, work = zero, zero, (zero, zero), (zero, zero)
        near = zero, zero
        for f in range(rows):
            m = 2 * k * f + col
            at = (k * f + col) * items
            re, im = load(s, m), load(s, k + m)
            if touched:
                if exact:
                    near = times(c, at, NEARS_RE, re, im, near)
                rate = times(c, at, RATE_RE, re, im, rate)
                work = times(c, at, WORK_RE, re, im, work)
                re, im = times(c, at, PUSH_RE, push[0], push[1], (re, im))
            re, im = times(c, at, AHEAD_RE, re, im, (re, im))
            store(s, m, re)
            store(s, k + m, im)
            gamma = load(c, at + RADIAL * FOUR)
            real, imag = fma(gamma, re, real), fma(gamma, im, imag)
        if touched:
            slid = book(
                s, fixed, push, k, col, own, older, rate, work, near, exact, sums
            )
            store_both(slip, k, col, slid)
        store_both(out, k, col, (real, imag))
        if not exact:
            store_both(s, k, next_one + col, (real, imag))


@inlined
def book(s, fixed, push, k, col, own, older, rate, work, near, exact, sums):
    """Add a step's works of contact at four nodal diameters to sums; return the slip.

    The slip is dt (v- + v+) of the casing less that of the tips, (re, im), m. For
    central differences, the spectrum of the last step's gaps, in the state s, is also
    completed by the effect of contact.

    fixed, exact : as in `columns`
    push : (re, im) of the multipliers' spectrum at these nodal diameters, col .. col +
        3, N
    near, rate, work : (re, im), sums over the waves by `columns`: dt (v- + v+) of the
        gap; the same along the casing; effect on energy and loss
    own, older : where spectra of gaps begin in the state s, see `seen_at`
    """
    pr, pi = push
    if exact:
        a, b = load_both(fixed, k, FIXED * k + col)
        real, imag = fnma(b, pi, fma(a, pr, near[0])), fma(b, pr, fma(a, pi, near[1]))
    else:
        a, b = load_both(fixed, k, OPENS_RE * k + col)
        real, imag = load_both(s, k, own + col)
        real, imag = fnma(b, pi, fma(a, pr, real)), fma(b, pr, fma(a, pi, imag))
        store_both(s, k, own + col, (real, imag))
        was = load_both(s, k, older + col)
        real, imag = real - was[0], imag - was[1]
    normal = fma(pi, imag, load(sums, col))
    store(sums, col, fma(pr, real, normal))
    a, b = load_both(fixed, k, SLIDES_RE * k + col)
    slid = fnma(b, pi, fma(a, pr, rate[0])), fma(b, pr, fma(a, pi, rate[1]))
    drag = fma(pi, slid[1], load(sums, k + col))
    store(sums, k + col, fma(pr, slid[0], drag))
    given = fma(pi, work[1], fma(pr, work[0], load(sums, 2 * k + col)))
    square = fma(pr, pr, pi * pi)
    given = fma(load(fixed, ADDS * k + col), square, given)
    store(sums, 2 * k + col, given)
    return slid


@inlined
def seen_at(step, rows, k):
    """Return where the spectra of the gaps of three steps begin in a rotor's state.

    They are those of the last step, of the step two before, and of the predicted one;
    the last two share their place.

    step, rows, k : number of the last step; number of rows of k complex amplitudes,
        which come before the spectra
    """
    first = 2 * k * rows
    own, older = step % SEEN * 2 * k, (step + 1) % SEEN * 2 * k
    return first + own, first + older, first + older


@does(pass_rotor, WaveRotor)
@inlined
def pass_waves(rotor, way, s, lam, rows, k, counter, out, sums, slip):
    """Apply the last step's contact forces to a rotor's waves; predict the next step.

    The implementation of `stepping.pass_rotor` for a rotor as waves.

    Parameters
    ----------
    rotor, way : `wave_types.WaveRotor`; `differences.CENTRAL` or `flow.EXACT`
    s : (2 k (rows + SEEN),), state: amplitudes, spectra of the gaps of three steps; of
        the exact flow amplitudes alone, (2 k rows,)
    lam : N, re, then im, of the multipliers' spectrum in its first 2 k
    counter : counters of the march: number of the last step, and of the last with
        contact
    out : (2 k,), m, out: spectrum of the rotor's part of the gaps
    sums : (3 k,), J: twice the work of normal forces, twice that of friction over mu,
        and the energy and loss that contact forces have added
    slip : (4 k,), m, out after a step with contact, see `passes.slip_of`
    """
    c, fixed, seen = rotor.items, rotor.fixed, seen_at(counter[STEP], rows, k)
    exact = is_exact(way)
    if counter[LAST] == counter[STEP]:
        columns(s, c, fixed, lam, rows, k, seen, True, exact, out, sums, slip)
    else:
        columns(s, c, fixed, lam, rows, k, seen, False, exact, out, sums, slip)


@rare
def settle_waves(rotor, s, t, lam, counter, exact, sums):
    """Copy a rotor's state s to t; apply the last step's contact forces to t.

    Works and losses of that step are added to sums (3 k,), J.

    lam, counter : as in `pass_waves`
    exact : whether the step is that of the exact flow
    """
    copy_to(t, s)
    if counter[LAST] != counter[STEP]:
        return
    c, fixed, k = rotor.items, rotor.fixed, len(sums) // 3
    rows = rotor.hub.shape[1] // (2 * k)
    own, older, _ = seen_at(counter[STEP], rows, k)
    items = FLOW_ITEMS if exact else ITEMS
    for col in range(0, k, FOUR):
        zero = broadcast(0.0)
        push, rate, work = load_both(lam, k, col), (zero, zero), (zero, zero)
        near = zero, zero
        for f in range(rows):
            m = 2 * k * f + col
            at = (k * f + col) * items
            re, im = load_both(s, k, m)
            if exact:
                near = times(c, at, NEARS_RE, re, im, near)
            rate = times(c, at, RATE_RE, re, im, rate)
            work = times(c, at, WORK_RE, re, im, work)
            store_both(t, k, m, times(c, at, PUSH_RE, push[0], push[1], (re, im)))
        book(t, fixed, push, k, col, own, older, rate, work, near, exact, sums)


@does(end_step, WaveRotor)
@rare_kernel
def end_waves(rotor, way, s_b, t_b, s_c, t_c, c_c, lam, counter, sums_b, sums_c):
    """Copy the states of rotor and ring; complete the last step in the copies.

    The implementation of `stepping.end_step`, with its arguments, for a rotor as waves.
    """
    settle_waves(rotor, s_b, t_b, lam, counter, is_exact(way), sums_b)
    settle_ring(way, s_c, t_c, c_c, lam, counter, sums_c)


@rare
def energy_of_waves(rotor, t):
    """Return Jacobi's energy, J, of a rotor as waves.

    t : state of the waves, after the last step's contact forces
    """
    hub, form = rotor.hub, rotor.form
    rows = 2 * len(form) // hub.shape[1] - 1
    k, at, total = hub.shape[1] // (2 * rows), 0, broadcast(0.0)
    for f in range(rows):
        for col in range(0, k, FOUR):
            real, imag, place = broadcast(0.0), broadcast(0.0), at + col
            for g in range(f, rows):
                re, im = load_both(t, k, 2 * k * g + col)
                a, b = load_both(form, k, place)
                real = fnma(b, im, fma(a, re, real))
                imag = fma(b, re, fma(a, im, imag))
                place += 2 * k
            re, im = load_both(t, k, 2 * k * f + col)
            total = fma(re, real, fma(im, imag, total))
        at += 2 * k * (rows - f)
    return total_of(total)


@does(energies_of, WaveRotor)
@rare_kernel
def energies_of_waves(rotor, way, t_b, t_c, c_c, now, step):
    """Return the energies of a rotor as waves and of the casing ring, J, after a step.

    The implementation of `stepping.energies_of`, which explains the arguments.
    """
    return energy_of_waves(rotor, t_b), energy_of_ring(way, t_c, c_c, now, step)


@does(bound_rotor, WaveRotor)
@kernel
def bound_waves(_rotor, s, bound, rows, k, _counter, rate):
    """Return bounds of a rotor's waves: acceleration of any gap, tip displacement.

    They are in m/s^2 and m. The implementation of `flight.bound_rotor`, which explains
    the arguments, except that `rows` is the number of waves of a nodal diameter.
    """
    bend, reach, size = broadcast(0.0), broadcast(0.0), rows * k
    for col in range(0, k, FOUR):
        rate_re, rate_im = broadcast(0.0), broadcast(0.0)
        for f in range(rows):
            m, (re, im) = k * f + col, load_both(s, k, 2 * k * f + col)
            a, b = load_both(bound, size, VELOCITY_RE * size + m)
            rate_re = fnma(b, im, fma(a, re, rate_re))
            rate_im = fma(b, re, fma(a, im, rate_im))
            held = root(fma(re, re, im * im))
            bend = fma(load(bound, RISE * size + m), held, bend)
            reach = fma(load(bound, REACH * size + m), held, reach)
        store_both(rate, k, col, (rate_re, rate_im))
    return total_of(bend), total_of(reach)


@does(jump_rotor, WaveRotor)
@part
def jump_waves(rotor, s, table, rows, k, _now, _then, out, _sums):
    """Move the amplitudes of a rotor's waves to the end of a jump over n steps.

    Each is multiplied by z^n, z its factor in a step. No damping loss is entered, since
    it follows from the energy. The implementation of `flight.jump_rotor`, with its
    arguments.
    """
    c, size = rotor.items, rows * k
    for col in range(0, k, FOUR):
        real, imag = broadcast(0.0), broadcast(0.0)
        for f in range(rows):
            m = k * f + col
            a, b = load_both(table, size, TURNED_RE * size + m)
            re, im = load_both(s, k, 2 * k * f + col)
            re, im = fnma(b, im, a * re), fma(b, re, a * im)
            store_both(s, k, 2 * k * f + col, (re, im))
            gamma = load(c, m * FLOW_ITEMS + RADIAL * FOUR)
            real, imag = fma(gamma, re, real), fma(gamma, im, imag)
        store_both(out, k, col, (real, imag))


@inlined
def radial_of(rotor, q, rows, k, out):
    """Compute the spectrum (2 k,) of the rotor's part of the gaps, m, from its waves.

    q, rows : amplitudes, re and im, in `rows` rows of k nodal diameters (padded)
    out : (2 k,), out: re, then im
    """
    c, items = rotor.items, len(rotor.items) // (rows * k)
    for col in range(0, k, FOUR):
        real, imag = broadcast(0.0), broadcast(0.0)
        for f in range(rows):
            re, im = load_both(q, k, 2 * k * f + col)
            gamma = load(c, (k * f + col) * items + RADIAL * FOUR)
            real, imag = fma(gamma, re, real), fma(gamma, im, imag)
        store_both(out, k, col, (real, imag))


@does(along_of, WaveRotor)
@inlined
def along_of_waves(rotor, q, rows, k, out):
    """Compute the tangential displacement of all tips times -1, m, as a spectrum.

    The implementation of `samples.along_of`, with its arguments, for a rotor as waves.
    """
    for col in range(0, k, FOUR):
        real, imag = broadcast(0.0), broadcast(0.0)
        for f in range(rows):
            at = 2 * k * f + col
            (re, im), (a, b) = load_both(q, k, at), load_both(rotor.along, k, at)
            real = fnma(b, im, fma(a, re, real))
            imag = fma(b, re, fma(a, im, imag))
        store_both(out, k, col, (real, imag))


@part
def read_tips(spectrum, turns, direction, tips):
    """Set the radial or the tangential displacement of all tips, m, by a spectrum.

    direction : column of `tips`: 0, radial, or 1, tangential
    spectrum : (2 k,), m, of the tips' displacements times -1, for k nodal diameters,
        padded
    turns : (N, 2 k) flat, cos and -sin of each nodal diameter at each blade
    tips : (N + 1, 2), out; its last row is left as it is
    """
    for j in range(len(tips) - 1):
        tips[j, direction] = -at_blade(spectrum, turns, j, len(spectrum))


@does(sample_rotor, WaveRotor)
@rare
def sample_waves(rotor, mu, gap, row, c_c, turns, wave, state, energies, works, sample,
                 keep, judge, tracks):  # fmt: skip
    """Write a sample of the traces, a row of evidence, or both, of a rotor as waves.

    The implementation of `samples.sample_rotor`, with its arguments. The rotor's
    damping loss is the energy and loss that contact has added, less the present energy.
    """
    t_b, t_c, radial = sample.rotor, sample.ring, sample.columns
    counter, k, wide = state.counter, len(radial) // 2, len(state.gaps) // 6
    rows = rotor.hub.shape[1] // (2 * k)
    radial_of(rotor, t_b, rows, k, radial)
    if judge and counter[LAST] == counter[STEP]:
        reach = one_norm(radial, 2 * k)
        for col in range(2 * k):
            sample.wall[col] += radial[col]
        add_ring(t_c, c_c, k, sample.wall)
        to_gaps(sample.wall, wave, gap, k, wide, sample.again, 0)
        note_miss_folded(
            sample.again, state.gaps, row, reach, gap, len(state.impulse), state.ledger
        )
    if keep and len(tracks.tips) > 0:
        read_tips(radial, turns, 0, sample.tips)
        along_of_waves(rotor, t_b, rows, k, radial)
        read_tips(radial, turns, 1, sample.tips)
    read_centre(t_b, rotor.hub, sample.tips)
    lost = works[3] - energies[0]
    write_all(mu, state, energies, works, lost, sample, keep, judge, tracks)


def wave_sizes(
    rotor: WaveRotor, state: CyclicState, size: int, k: int, *, exact: bool
) -> Wanted:
    """Return (name, array, required number of values) of a wave rotor's arrays.

    They are checked by `cyclic.check_sizes` before the first step.

    size, k : number of waves, with padding; number of nodal diameters, padded
    exact : whether scheme `exact` integrates them
    """
    rows, seen = size // k, 0 if exact else SEEN
    return [
        ("rotor", state.rotor, 2 * k * (rows + seen)), ("sums_b", state.sums_b, 3 * k),
        ("rotor items", rotor.items, (FLOW_ITEMS if exact else ITEMS) * size),
        ("fixed", rotor.fixed, (FLOW_FIXED if exact else FIXED) * k),
        ("form", rotor.form, (rows + 1) * size), ("along", rotor.along, 2 * size),
    ]  # fmt: skip
