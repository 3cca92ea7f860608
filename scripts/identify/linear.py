"""What linear theory says of an engine before anything is integrated.

Contacts held closed, all tips sliding on the ring (`hpcwhirl.analysis.stability`), have
a forward root, the ring's translation with 1F's backward wave, and a backward one, the
ring with the suspension. Where contact hardens up to being closed and the root still
grows, nothing bounds the motion: the forward root of an engine with the paper's step
crosses zero near 420 rad/s, the backward one of an engine that diverges at 270 grows
there (scripts/identify/why.md). What keeps 410 up is a forward root that grows with
contacts closed for a part of the time, springs in their place, and no more when closed.
Of the pulse and of basins all this tells nothing.
"""

from __future__ import annotations

import numpy as np
from identify.space import GAP, Engine, Floats

from hpcwhirl.analysis.stability import closed_roots, coupled, sprung_roots
from hpcwhirl.case.resolve import resolve
from hpcwhirl.scene import Scene, apply_settings

FRICTION = 0.1
LINES = {"forward": (120.0, 650.0), "backward": (-350.0, -40.0)}  # rad/s, static
SPRINGS = (1.5e5, 3e5, 6e5, 1.2e6, 2.5e6, 5e6)  # N/m a blade
NONE = -100.0  # 1/s: no such root
SMALL = {"solver.modes": 44, "engine.casing.harmonics": 6}
WIDE = 10.0  # 1/s: as wrong as can be
SURE = 1.0  # 1/s beyond zero
# {(speed, root): whether it grows}; what the paper has at 410 and 420 lies between
WANTED = {
    (270.0, "backward"): True, (400.0, "forward"): False, (400.0, "backward"): False,
    (410.0, "forward sprung"): True, (410.0, "backward sprung"): False,
    (430.0, "forward"): True,
}  # fmt: skip
Growths = dict[tuple[float, str], float]


def growths(engine: Engine) -> Growths:
    """Return the growth, 1/s, of the roots that are `WANTED`, on Table 2.

    Of contacts held closed, or the largest over `SPRINGS` in their place.
    """
    model = resolve(apply_settings(Scene(), engine | SMALL | {"gap": GAP})).model
    roots: dict[tuple[float, str], Floats] = {}
    for speed in dict.fromkeys(speed for speed, _ in WANTED):
        pair = coupled(model, 1, speed, FRICTION)
        roots[speed, ""] = closed_roots(pair)
        if (speed, "forward sprung") in WANTED:
            sprung = [sprung_roots(pair, each) for each in SPRINGS]
            roots[speed, "sprung"] = np.concatenate(sprung)
    out = {}
    for speed, root in WANTED:
        name, _, kind = root.partition(" ")
        found, (low, high) = roots[speed, kind], LINES[name]
        lines = speed - found.imag  # in the static frame
        own = found.real[(lines > low) & (lines < high)]
        out[speed, root] = float(own.max(initial=NONE))
    return out


def linear_miss(found: Growths) -> float:
    """Return how far growths are from what the paper's motions want, 0 to 1."""
    short = [SURE - found[at] if grows else SURE + found[at]
             for at, grows in WANTED.items()]  # fmt: skip
    return float(np.clip(np.array(short) / WIDE, 0.0, 1.0).mean())
