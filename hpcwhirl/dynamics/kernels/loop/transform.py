"""The transform from spectra to blades for many blades, N = a b, in two stages.

It computes the gaps of all blades from their spectrum, g_j = gap + Re sum_kappa G_kappa
e^{2 pi i kappa j / N}, kappa = 0 .. N // 2 the nodal diameter or slot, j the blade;
`to_slots` computes spectra from values of blades. Of blades j = b s + v and slots kappa
= r + a p, since a b = N,

e^{2 pi i kappa j / N} = e^{2 pi i kappa v / N} e^{2 pi i r s / a}:

the first stage sums over p for each r and v, the second one over r for each s (Cooley
and Tukey, Math. Comp. 19, 1965). The real part of a term r is even in s, the imaginary
part odd, so that terms r and a - r, and blades s and a - s, share their products. Both
stages read the table `wave` of cos and sin of the dense product, see `passes.to_gaps`,
which has all of these factors: the first stage its first b columns, the second the
first a / 2 + 1 entries of every b-th row.

No library of transforms can be called from compiled code that holds no Python objects.
"""

from __future__ import annotations

from hpcwhirl.dynamics.kernels.compiled import inlined, rare
from hpcwhirl.dynamics.kernels.vectors import (
    FOUR,
    broadcast,
    element,
    fma,
    fnma,
    get,
    load,
    lower_of,
    put,
    reverse,
    room,
    store,
    total_of,
)

MOST = 64  # largest number of terms r in the second stage
ROOM = 2 * FOUR * MOST  # doubles of work space on the stack
WORTH = 0.7  # largest ratio of the products in two stages to those of a dense transform
BLADES, SPAN = 0, 1  # places behind the table of cos and sin: N; b, or 0 for one stage
BEHIND = FOUR  # number of entries after that table


def products(blades: int, span: int) -> float:
    """Return how many vector products the transform from a spectrum to N blades takes.

    span : b, if N = a b is transformed in two stages; 0 for one stage
    """
    most = blades // 2 + 1
    if span == 0:
        return 0.5 * most**2
    half = blades // span // 2 + 1
    return -(-span // FOUR) * (4.0 * most + 2.0 * half**2)


def span_of(blades: int) -> int:
    """Return b if two stages are faster to transform N = a b blades; else 0."""
    best, least = 0, WORTH * products(blades, 0)
    for b in range(2, blades // 2):
        half = blades // b // 2 + 1
        if blades % b or not 3 <= half <= MOST:
            continue
        cost = products(blades, b)
        if cost < least:
            least, best = cost, b
    return best


@inlined
def add_term(spectrum, wave, k, wide, c, v, sums):
    """Add one nodal diameter's part of the gaps at blades v .. v + 3 to four sums.

    This is the first stage of the transform. The sums are of re cos, im sin, re sin and
    im cos: re, im are the spectrum's entry at nodal diameter c, cos and sin those of 2
    pi c v / N.

    spectrum, wave : (2 k,), m, re, then im of the k nodal diameters; table of cos and
        sin, see `passes.to_gaps`
    sums : four sums, each for the four blades
    """
    re, im = broadcast(get(spectrum, c)), broadcast(get(spectrum, k + c))
    cosine, sine = load(wave, c * wide + v), load(wave, (k + c) * wide + v)
    re_cos, im_sin, re_sin, im_cos = sums
    re_cos, im_sin = fma(re, cosine, re_cos), fma(im, sine, im_sin)
    return re_cos, im_sin, fma(re, sine, re_sin), fma(im, cosine, im_cos)


@inlined
def both_terms(spectrum, wave, k, wide, r, a, v):
    """Return a term of the first stage at blades v .. v + 3: parts even and odd in s.

    It is term r of the transform to the gaps of blades b s + v, see this module: the
    sum over the nodal diameters r, r + a, ... and a - r, 2 a - r, ...; beyond N / 2
    they are 0.

    spectrum, wave : (2 k,), m, re, then im of the k nodal diameters; table of cos and
        sin, see `passes.to_gaps`
    """
    zero, back = broadcast(0.0), a - r
    here = there = zero, zero, zero, zero
    c = r
    if 0 < r < back:
        while back < k:
            here = add_term(spectrum, wave, k, wide, c, v, here)
            there = add_term(spectrum, wave, k, wide, back, v, there)
            c, back = c + a, back + a
    while c < k:  # no `range`, whose length would take a division
        here = add_term(spectrum, wave, k, wide, c, v, here)
        c += a
    even, odd = here[0] - here[1], here[2] + here[3]
    return even + (there[0] - there[1]), odd - (there[2] + there[3])


@inlined
def three_blades(wave, k, wide, half, b, s, gap, work):
    """Return the results (even, odd) of the second stage for s, s + 1 and s + 2.

    With terms r and blades b s + v as this module explains, `even`, to which `gap` is
    added, sums cos(2 pi r s / a) times the even part of term r, `odd` sums the sine
    times the odd part. Then even - odd are the gaps of blades b s + v, even + odd those
    of b (a - s) + v, for four v each. In `to_slots` r and s change places, and even - i
    odd is term r.

    wave : table of cos and sin, see `passes.to_gaps`
    half, gap : number of terms; clearance, m
    work : even and odd part of each term, four numbers each
    """
    first = second = third = broadcast(gap)
    one = two = three = broadcast(0.0)
    for r in range(half):
        even, odd = load(work, 2 * FOUR * r), load(work, 2 * FOUR * r + FOUR)
        at, on = r * b * wide + s, (k + r * b) * wide + s
        first = fma(broadcast(get(wave, at)), even, first)
        second = fma(broadcast(get(wave, at + 1)), even, second)
        third = fma(broadcast(get(wave, at + 2)), even, third)
        one = fma(broadcast(get(wave, on)), odd, one)
        two = fma(broadcast(get(wave, on + 1)), odd, two)
        three = fma(broadcast(get(wave, on + 2)), odd, three)
    return (first, one), (second, two), (third, three)


@inlined
def put_four(value, gaps, row, wide, blades, j, count):
    """Store the gaps of up to four blades, j .. j + count - 1, in folded order.

    value : the four gaps, m
    gaps, row, wide : array, and the index in it of the step's first gap: a blade i is
        stored at row + i if i <= N / 2, else at row + wide + N - i
    """
    if count >= FOUR and 2 * (j + FOUR - 1) <= blades:
        store(gaps, row + j, value)
    elif count >= FOUR and 2 * j > blades:
        store(gaps, row + wide + blades - j - (FOUR - 1), reverse(value))
    else:
        for i in range(min(count, FOUR)):
            folded = j + i if 2 * (j + i) <= blades else wide + blades - j - i
            put(gaps, row + folded, element(value, i))


@inlined
def repeat(gaps, row, wide, blades):
    """Fill the places of an array of gaps that repeat a blade, in folded order.

    Padding and the second entry of blades 0 and N / 2 are set to copies of their gaps.

    gaps, row : array, and index in it of the step's first gap, m
    wide, blades : half the length of the gaps in folded order; N
    """
    first, middle = get(gaps, row), get(gaps, row + blades // 2)
    for i in range(blades // 2 + 1, wide):
        put(gaps, row + i, first)
    put(gaps, row + wide, first)
    for i in range((blades + 1) // 2, wide):
        put(gaps, row + wide + i, middle if 2 * i == blades else first)


@inlined
def put_both(parts, gaps, row, wide, blades, b, s, v, least):
    """Store the gaps of blades from b s + v and from b (a - s) + v on, in folded order.

    N = a b is the number of blades. Return the elementwise minimum of these gaps and
    the four numbers `least`, m.

    parts : (even, odd) of the second stage for s, see `three_blades`
    gaps, row : array, and index in it of the step's first gap
    """
    even, odd = parts
    a, here, there = blades // b, even - odd, even + odd
    put_four(here, gaps, row, wide, blades, s * b + v, b - v)
    least = lower_of(least, here)
    if 0 < s < a - s:
        put_four(there, gaps, row, wide, blades, (a - s) * b + v, b - v)
        least = lower_of(least, there)
    return least


@rare
def to_gaps_split(spectrum, wave, gap, k, wide, gaps, row):
    """Compute the gaps of all blades from their spectrum, in two stages.

    Return four numbers: the least of them is the lowest gap, or the clearance `gap` if
    that is lower, m. The arguments are those of `passes.to_gaps`.
    """
    behind = 2 * k * wide
    blades, b = int(get(wave, behind + BLADES)), int(get(wave, behind + SPAN))
    a = blades // b
    half, work, least = a // 2 + 1, room(ROOM), broadcast(gap)
    for v in range(0, b, FOUR):
        for r in range(half):
            even, odd = both_terms(spectrum, wave, k, wide, r, a, v)
            store(work, 2 * FOUR * r, even)
            store(work, 2 * FOUR * r + FOUR, odd)
        for three in range(0, half, 3):
            s = min(three, half - 3)
            one, two, last = three_blades(wave, k, wide, half, b, s, gap, work)
            least = put_both(one, gaps, row, wide, blades, b, s, v, least)
            least = put_both(two, gaps, row, wide, blades, b, s + 1, v, least)
            least = put_both(last, gaps, row, wide, blades, b, s + 2, v, least)
    repeat(gaps, row, wide, blades)
    return least


@inlined
def lay_out(factors, which, size, blades, spread):
    """Write values f_j of some blades j to an array of all N blades, 0 for the others.

    factors, which, size : the values; the blades are which[:size]
    spread : (N,), out
    """
    for j in range(blades):
        put(spread, j, 0.0)
    for s in range(size):
        put(spread, get(which, s), get(factors, s))


@inlined
def fold_blades(spread, a, b, v, half, work):
    """Split values of the blades b s + v .. b s + v + 3 in parts even and odd in s.

    N = a b, and s is a number 0 .. a - 1, see this module; `to_slots` needs the parts.

    spread : (N,), the values
    half, work : number of parts, a // 2 + 1; out: even and odd part for each s, four
        numbers each
    """
    for s in range(half):
        even, odd = load(spread, b * s + v), broadcast(0.0)
        if 0 < s < a - s:
            back = load(spread, b * (a - s) + v)
            even, odd = even + back, even - back
        store(work, 2 * FOUR * s, even)
        store(work, 2 * FOUR * s + FOUR, odd)


@inlined
def slot_of(stages, wave, k, wide, b, c, r, sign):
    """Return (re, im) of a discrete Fourier transform over the blades at one diameter.

    It is the last stage of `to_slots`: the sum over b blades v of term r, conjugated if
    sign is -1, times e^{-2 pi i c v / N}, for nodal diameter c.

    stages : re and im of each term r, at the b values of v
    wave, k, wide : table of cos and sin, and its sizes, see `passes.to_gaps`
    """
    re, im, sign = broadcast(0.0), broadcast(0.0), broadcast(sign)
    for v in range(0, b, FOUR):
        cosine, sine = load(wave, c * wide + v), load(wave, (k + c) * wide + v)
        real = load(stages, 2 * b * r + v)
        imag = sign * load(stages, 2 * b * r + b + v)
        re = fma(imag, sine, fma(real, cosine, re))
        im = fma(imag, cosine, fnma(real, sine, im))
    return total_of(re), total_of(im)


@rare
def to_slots(factors, which, size, wave, k, wide, spread, out):
    """Compute a spectrum from values f_j of blades, sum_j f_j e^{-2 pi i kappa j / N}.

    It is used for the multipliers of many blades. It is the transpose of
    `to_gaps_split`, in two stages; b must be a multiple of four.

    factors, which, size : f_j; the blades j are which[:size]
    wave : table of cos and sin, see `passes.to_gaps`
    spread : (room_of(N),), work space
    out : (2 k,), the spectrum at k slots kappa (nodal diameters 0 .. N // 2, padded),
        re, then im
    """
    behind = 2 * k * wide
    blades, b = int(get(wave, behind + BLADES)), int(get(wave, behind + SPAN))
    a = blades // b
    half, work, stages = a // 2 + 1, room(ROOM), spread[blades:]
    lay_out(factors, which, size, blades, spread)
    for v in range(0, b, FOUR):
        fold_blades(spread, a, b, v, half, work)
        for three in range(0, half, 3):
            r = min(three, half - 3)
            sums = three_blades(wave, k, wide, half, b, r, 0.0, work)
            for i in range(3):
                even, odd = sums[i]
                store(stages, 2 * b * (r + i) + v, even)
                store(stages, 2 * b * (r + i) + b + v, broadcast(0.0) - odd)
    r = a - a
    for c in range(blades // 2 + 1):
        back = 2 * r > a
        re, im = slot_of(
            stages, wave, k, wide, b, c, a - r if back else r, -1.0 if back else 1.0
        )
        put(out, c, re)
        put(out, k + c, im)
        r = 0 if r + 1 == a else r + 1
    for c in range(blades // 2 + 1, k):
        put(out, c, 0.0)
        put(out, k + c, 0.0)


def room_of(blades: int) -> int:
    """Return the length of the work space `spread` of `to_slots`, for N blades."""
    return 6 * blades + 4 * MOST
