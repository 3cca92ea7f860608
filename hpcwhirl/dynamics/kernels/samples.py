"""Reading a state of the cyclic kernel: energies, works, tips, samples; check of gaps.

Samples do not change the motion: they are taken from copies in which the pending step
is completed.

The solved contact problem must agree with the motion of the bodies. The multipliers are
found from predicted gaps and the Delassus matrix, and applied to the bodies'
amplitudes. If a sample falls on a step with contact, the gaps are computed again from
the amplitudes. Their difference from g + W lambda (the miss), relative to the lengths
of which they are sums, is round-off unless a row of W or the effect of a multiplier is
wrong. The energy ledger would not show such an error, since it has the work of the
forces that were really applied.
"""

from __future__ import annotations

import numpy as np

from hpcwhirl.dynamics.kernels.compiled import does, inlined, part, rare, verb
from hpcwhirl.dynamics.kernels.contact import (
    ENDED,
    FRICTION,
    IMPACT,
    LAST,
    MISS,
    ROTATION,
    SAMPLE,
    STEP,
    write_sample,
)
from hpcwhirl.dynamics.kernels.flight import leap
from hpcwhirl.dynamics.kernels.flow import EXACT
from hpcwhirl.dynamics.kernels.keep_inverse import place_of
from hpcwhirl.dynamics.kernels.kernel_types import CyclicState
from hpcwhirl.dynamics.kernels.passes import (
    ITEMS,
    RADIAL,
    RING_STATE,
    ROTOR_STATE,
    SI,
    SR,
    copy_to,
    item,
    to_gaps_seldom,
)
from hpcwhirl.dynamics.kernels.stepping import (
    column_sums,
    end_step,
    energies_of,
)
from hpcwhirl.dynamics.kernels.vectors import (
    FOUR,
    broadcast,
    element,
    fma,
    fnma,
    load,
    root,
    store,
)
from hpcwhirl.dynamics.kernels.wave_types import CyclicRotor, SampleSpace

ASIDE = ("rotor", "ring", "sums_b", "sums_c", "counter")  # changed by a jump


@part
def at_blade(spectrum, turns, j, width):
    """Return the value at blade j of a spectrum G: Re sum_k G_k e^{2 pi i k j / N}.

    spectrum : (width,), re, then im, of G at all nodal diameters k
    turns, width : (N, width) flat, cos and -sin of 2 pi k j / N; twice the number of
        nodal diameters, padded
    """
    total = 0.0
    for i in range(width):
        total += spectrum[i] * turns[j * width + i]
    return total


@rare
def read_tips(q, c, hub, turns, width, work, tips):
    """Compute the radial and tangential displacements of all tips, m: set tips[:N].

    q, c : amplitudes of the rotor's modes by nodal diameter; their coefficients, packed
    hub, width : (2, size), of which only the size is used; twice the number of nodal
        diameters, padded
    turns, work : (N, width) flat, cos and -sin of each nodal diameter at each blade;
        (width,), work space
    tips : (N + 1, 2), out; its last row is left as it is
    """
    size = hub.shape[1]
    k, blades = width // 2, len(tips) - 1
    for direction in range(2):
        for col in range(width):
            work[col] = 0.0
        for m in range(size):
            col = m % width
            if direction == 0:
                work[col] -= item(c, RADIAL, m) * q[m]
            elif col < k:  # tangential: -(re sigma + i im sigma) (re q + i im q)
                re, im = item(c, SR, m) * q[m], item(c, SI, m) * q[m + k]
                work[col] -= re - im
            else:
                re, im = item(c, SR, m) * q[m], item(c, SI, m) * q[m - k]
                work[col] -= re + im
        for j in range(blades):
            tips[j, direction] = at_blade(work, turns, j, width)


@verb
def along_of(rotor, q, rows, k, out):
    """Compute the tangential displacement of all tips times -1, m, as a spectrum.

    q, rows : amplitudes of the rotor, re and im, in `rows` rows of k nodal diameters
        (padded)
    out : (2 k,), out: re, then im
    """


@does(along_of, CyclicRotor)
@inlined
def along_of_modes(rotor, q, rows, k, out):
    """Compute the tangential displacement of all tips times -1, m, as a spectrum.

    The implementation of `along_of`, with its arguments, for a rotor's modes by nodal
    diameter.
    """
    c = rotor.items
    for col in range(0, k, FOUR):
        real, imag = broadcast(0.0), broadcast(0.0)
        for f in range(rows):
            m = 2 * k * f + col
            sr, si = load(c, m * ITEMS + SR * FOUR), load(c, m * ITEMS + SI * FOUR)
            re, im = load(q, m), load(q, m + k)
            real = fnma(si, im, fma(sr, re, real))
            imag = fma(si, re, fma(sr, im, imag))
        store(out, col, real)
        store(out, k + col, imag)


@inlined
def radial_bound(q, c, size, width):
    """Return an upper bound, m, of the radial displacement of any tip.

    q, c : amplitudes of the rotor's modes by nodal diameter; their coefficients, packed
    size, width : number of amplitudes; twice the number of nodal diameters, padded
    """
    total = broadcast(0.0)
    for col in range(0, width, FOUR):
        spectrum = broadcast(0.0)
        for m in range(col, size, width):
            radial = load(c, m * ITEMS + RADIAL * FOUR)
            spectrum = fma(radial, load(q, m), spectrum)
        total = total + root(spectrum * spectrum)
    bound = 0.0
    for i in range(FOUR):
        bound += element(total, i)
    return bound


@inlined
def read_centre(q, hub, tips):
    """Compute the displacement of the shaft's centre: set the last row of tips, m.

    q, hub : amplitudes of the rotor; (2, size), x_o and y_o for unit amplitudes
    tips : (N + 1, 2), m, rotating frame, out: x_o, y_o in the last row
    """
    for axis in range(2):
        total = 0.0
        for m in range(hub.shape[1]):
            total += hub[axis, m] * q[m]
        tips[-1, axis] = total


@verb
def sample_rotor(rotor, mu, gap, row, c_c, turns, wave, state, energies, works, sample,
                 keep, judge, tracks):  # fmt: skip
    """Write a sample of the traces, a row of evidence, or both, from a copy of a state.

    In the copy, which is in `sample` (`wave_types.SampleSpace`), the last step is
    completed. Tips are computed only if they are stored. At a row of evidence with
    contact, the gaps are compared with those of the contact problem, which are in
    state.gaps from `row` on.

    mu, gap : friction with the sign of the speed; m, clearance at this step
    c_c : coefficients of the ring's modes, packed
    turns, wave : (N, 2 k) flat, cos and -sin of each nodal diameter at each blade; as
        in `passes.to_gaps`
    energies, works : results of `stepping.energies_of` and `column_sums` for the copy,
        J
    keep, judge : whether to write a sample of the traces; a row of the evidence
    """


@does(sample_rotor, CyclicRotor)
@rare
def sample_modes(rotor, mu, gap, row, c_c, turns, wave, state, energies, works, sample,
                 keep, judge, tracks):  # fmt: skip
    """Write a sample of the traces, a row of evidence, or both, from a copy of a state.

    The implementation of `sample_rotor`, which explains the arguments, for a rotor's
    modes by nodal diameter.
    """
    counter, ledger, impulse = state.counter, state.ledger, state.impulse
    t_b, t_c, (c_b, hub) = sample.rotor, sample.ring, rotor
    width, size = len(sample.columns), len(t_b) // ROTOR_STATE
    if judge and counter[LAST] == counter[STEP]:
        most = radial_bound(t_b, c_b, size, width)
        note_miss_cyclic(t_b, c_b, t_c, c_c, wave, gap, most, state.gaps, row,
                         sample.wall, sample.again, len(impulse), ledger)  # fmt: skip
    if keep and len(tracks.tips) > 0:
        read_tips(t_b, c_b, hub, turns, width, sample.columns, sample.tips)
    read_centre(t_b, hub, sample.tips)
    write_all(mu, state, energies, works, works[3], sample, keep, judge, tracks)


@rare
def write_all(mu, state, energies, works, loss, sample, keep, judge, tracks):
    """Write a sample or a row of evidence, with `works` added to a copy of the ledger.

    works, loss : J, result of `stepping.column_sums`; J, energy taken by damping so far
    energies : (2,), energies of rotor and ring, J
    sample : `wave_types.SampleSpace`; its ledger becomes the copy
    keep, judge : whether to write a sample of the traces; a row of the evidence
    """
    whole, (rotation, impact, drag, _) = sample.ledger, works
    copy_to(whole, state.ledger)
    whole[ROTATION] += rotation
    whole[IMPACT] += impact
    whole[FRICTION] += mu * drag
    write_sample(
        state.counter, whole, state.impulse, sample.tips, sample.ring, energies, loss,
        keep, judge, tracks,
    )  # fmt: skip


def sample_space(state: CyclicState, blades: int, width: int) -> SampleSpace:
    """Return work space for samples of a state: copies of the bodies, spectra, tips.

    state, blades : state of the cyclic kernel; N
    width : twice the number of nodal diameters, padded
    """
    return SampleSpace(
        np.zeros(len(state.rotor)), np.zeros(len(state.ring)),
        np.zeros(len(state.sums_b)), np.zeros(len(state.sums_c)), np.zeros(width),
        np.zeros((blades + 1, 2)), np.zeros(len(state.ledger)),
        np.zeros(len(state.gaps) // 3), np.zeros(width),
    )  # fmt: skip


def aside_space(state: CyclicState) -> CyclicState:
    """Return copies of those arrays of a state that a jump changes (`ASIDE`).

    The other arrays of the result are those of the state itself.
    """
    own = {name: getattr(state, name).copy() for name in ASIDE}
    return state._replace(**own)


@part
def put_aside(state, aside):
    """Copy those arrays of a state that a jump changes to `aside`, before the jump.

    Samples within the jump are computed from `aside`, the result of `aside_space`.
    """
    copy_to(aside.rotor, state.rotor)
    copy_to(aside.ring, state.ring)
    copy_to(aside.sums_b, state.sums_b)
    copy_to(aside.sums_c, state.sums_c)
    for entry in range(len(aside.counter)):
        aside.counter[entry] = state.counter[entry]


@rare
def keep_between(begun, stride, step, mu, gap, rotor, c_c, turns, wave, flight, state,
                 space, tracks, sizes):  # fmt: skip
    """Write the samples of the traces within a jump, from copies of the state.

    The copies are moved from the jump's start to each sample. Samples of the traces do
    not end a jump, so that the motion is the same whichever traces are kept.

    begun, stride : step at which the jump began; steps between samples
    step, mu, gap : dt, s; friction with the sign of the speed; clearance, m
    c_c, flight : coefficients of the ring's modes, packed; `wave_types.Flight`
    space, sizes : `wave_types.CyclicSpace`; `wave_types.Sizes`
    """
    aside, sample, (_, rows, ring_rows, k, _) = space.aside, space.sample, sizes
    counter, own, yes = state.counter, aside.counter, stride > 0
    t_b, t_c = aside.rotor, aside.ring
    out_b, out_c = space.between
    if own[ENDED] != begun:  # complete the pending step, as the jump has done
        end_step(
            rotor, EXACT, t_b, t_b, t_c, t_c, c_c, aside.lam, own, aside.sums_b,
            aside.sums_c,
        )  # fmt: skip
        own[ENDED] = begun
    first = (begun // stride + 1) * stride
    for goal in range(first, counter[STEP], stride):
        while own[STEP] < goal:
            leap(goal - own[STEP], rotor, c_c, flight, aside, out_b, out_c, rows,
                 ring_rows, k)  # fmt: skip
        own[SAMPLE] = counter[SAMPLE]
        copy_to(sample.rotor, aside.rotor)
        copy_to(sample.ring, aside.ring)
        sample_rotor(
            rotor, mu, gap, 0, c_c, turns, wave, aside,
            energies_of(rotor, EXACT, t_b, t_c, c_c, own[STEP] & 1, step),
            column_sums(EXACT, aside.sums_b, aside.sums_c, step), sample, yes, not yes,
            tracks,
        )  # fmt: skip
        counter[SAMPLE] = own[SAMPLE]


@part
def note_miss(actual, solved, u, gap, ledger):
    """Raise ledger[MISS] to the largest error of a step's solved gaps, if larger.

    The error is the largest |actual - solved| over (gap + largest |u| + largest
    |actual|).

    actual, solved, u : (N,) or more, m: gaps computed from the amplitudes, gaps of the
        contact problem (g + W lambda), displacements of the tips
    gap : m, clearance
    """
    worst, reach, apart = 0.0, 0.0, 0.0
    for j in range(len(actual)):
        worst = max(worst, abs(actual[j] - solved[j]))
        reach = max(reach, abs(u[j]))
        apart = max(apart, abs(actual[j]))
    if worst > ledger[MISS] * (gap + reach + apart):
        ledger[MISS] = worst / (gap + reach + apart)


@rare
def note_miss_folded(again, gaps, row, reach, gap, blades, ledger):
    """Raise ledger[MISS] to the largest error of a step's solved gaps, if larger.

    The error is defined in `note_miss`. Arrays are in folded order (see
    `circulant.folded`). Entries that repeat a blade are not compared, since pivoting
    does not correct them.

    again : (2 wide,), m, gaps computed from the amplitudes
    gaps, row : m, gaps of the contact problem, and the index at which those of this
        step begin
    reach, gap, blades : m, bound of the tips' displacements; m, clearance; N
    """
    worst, apart = 0.0, 0.0
    for j in range(blades):
        at = place_of(j, blades, len(again) // 2)
        worst = max(worst, abs(again[at] - gaps[row + at]))
        apart = max(apart, abs(again[at]))
    if worst > ledger[MISS] * (gap + reach + apart):
        ledger[MISS] = worst / (gap + reach + apart)


@rare
def add_ring(t, c, k, spectrum):
    """Add the ring's radial displacement to the spectrum of the gaps (2 k,), m.

    t, c : (6 size,), state of the ring, after the last step's contact forces;
        coefficients of its modes, packed
    k : number of slots (nodal diameters, padded)
    """
    size = len(t) // RING_STATE
    for m in range(size):
        psi = item(c, RADIAL, m)
        spectrum[m % k] += psi * t[m]
        spectrum[k + m % k] += psi * t[size + m]


@rare
def note_miss_cyclic(t_b, c_b, t_c, c_c, wave, gap, reach, gaps, row, spectrum, again,
                     blades, ledger):  # fmt: skip
    """Raise ledger[MISS] to the largest error of a step's solved gaps, if larger.

    The gaps of the contact problem are compared with those computed from states. There
    are k slots, one for each nodal diameter, padded; arrays (2 wide,) list all blades
    in folded order (see `circulant.folded`).

    t_b, t_c : states of rotor and ring of the cyclic kernel, after the step's contact
        forces
    c_b, c_c : coefficients of their modes, packed
    reach, gap : bound of the tips' displacements, m; clearance, m
    gaps, row : m, gaps of the contact problem, and the index at which those of this
        step begin
    spectrum : (2 k,), m, in: that of the casing's shape; out: that of the gaps
    again : (2 wide,), out: gaps computed from the states, m
    """
    width, size = len(spectrum), len(t_b) // ROTOR_STATE
    k, wide = width // 2, len(wave) // width
    for m in range(size):
        spectrum[m % width] += item(c_b, RADIAL, m) * t_b[m]
    add_ring(t_c, c_c, k, spectrum)
    to_gaps_seldom(spectrum, wave, gap, k, wide, again, 0)
    note_miss_folded(again, gaps, row, reach, gap, blades, ledger)
