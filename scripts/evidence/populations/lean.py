"""The plan `lean` gives the words of `everything`, its bounds kept or named.

Engines of equal blades with k >= 2 lobes, of which one of g sectors would stand for
all: fed by rotating damping, by cross-coupled stiffness, or by both; three of four turn
faster than the speed from which a free motion grows, one of four slower. The growing
wave is one that the sector has not, k = 1. The first two engines are of 22 blades, on
which one sector was certified as damped before all waves were asked. Each bound by
which a part is left out must be kept by the run (`lean_checked` at most 1), or be named
in a note of the case.
"""

from __future__ import annotations

import random
from typing import Any

from hpcwhirl.campaign.simulate import simulate
from hpcwhirl.case.growth import stability_of
from hpcwhirl.case.resolve import resolve
from hpcwhirl.scene import apply_settings, named_scene, preset_inputs

COUNT = 60
LEAST = 1.0
WORDS = "outcome", "regime", "whirl"
MOST = 900.0  # rad/s, speeds searched
KNOWN: tuple[dict[str, Any], ...] = (
    {"suspension_damping": -1.0, "speed": 600.0},
    {"cross_coupling": 3e6, "speed": 300.0},
)


def drawn(seed: int, index: int) -> dict[str, Any]:
    """Return the inputs of an engine, {name: value}."""
    if index < len(KNOWN):
        large = {"rotation": "full", "nodal_diameter": 2, "gap": 1e-3, "duration": 1.5}
        return {**preset_inputs("draft"), **large, **KNOWN[index]}
    draw = random.Random(f"lean {seed} {index}")
    lobes = draw.choice([2, 3])
    given: dict[str, Any] = {
        "rotation": "full",
        "nodal_diameter": lobes,
        "blades": lobes * draw.choice([2, 3, 4]),
        "casing.harmonics": 3 * lobes,
        "gap": draw.choice([1e-4, 3e-4, 1e-3]),
        "force": draw.uniform(2e4, 8e4),
        "friction": draw.choice([0.0, 0.1]),
        "rotor.damping": draw.uniform(0.003, 0.02),
        "suspension_damping": draw.choice([-1.0, 0.025, 0.05]),
        "scheme": draw.choice(["modal", "exact"]),
        "until": draw.choice(["end", "certain"]),
        "accuracy": 0.1,
        "duration": 0.3,
    }
    given["modes"] = 2 * given["blades"]
    if draw.random() < 0.5:
        given["cross_coupling"] = 10 ** draw.uniform(6.0, 7.5)
    return given | {"speed": _speed(given, draw, above=index % 4 != 0)}


def _speed(given: dict[str, Any], draw: random.Random, *, above: bool) -> float:
    """Return a speed, rad/s, above that from which a free motion grows, or below."""
    model = resolve(_scene(given | {"speed": 1.0})).model
    found = stability_of(model, MOST)
    if found is None or not found.bands:
        return draw.uniform(100.0, 600.0)
    start, high = found.bands[0].start, found.span.high
    if not above:
        return draw.uniform(0.5, 0.98) * start or 50.0
    return min(max(start, 50.0) * draw.uniform(1.02, 1.5), 0.98 * high)


def _scene(given: dict[str, Any]) -> Any:
    return apply_settings(named_scene("four_motions"), given)


def judged(row: dict[str, Any]) -> dict[str, Any]:
    """Return whether both plans give the same words, and none is damped above."""
    lean, whole = (
        simulate(_scene(row | {"plan": plan})) for plan in ("lean", "everything")
    )
    one, other, share = lean.row, whole.row, float(lean.row["lean_checked"])
    words = [" ".join(str(each[name]) for name in WORDS) for each in (one, other)]
    grows = float(one["free_growth"]) > 0.0
    safe = not (grows and "damped" in {one["regime"], other["regime"]})
    told = f"lean {words[0]}, everything {words[1]}, growth {one['free_growth']:.3g}"
    kept = share <= 1.0 or any("beyond the bound" in note for note in lean.notes)
    held = _same(one, other) and safe and kept
    told += f", lean_checked {share:.3g}"
    return {"held": held, "why": told, "grows": grows, "words": words, "share": share}


def _same(one: dict[str, Any], other: dict[str, Any]) -> bool:
    """Return whether two rows have the same words.

    With `until = "certain"` a run with a certificate ends early: its whirl is that of
    the shorter window, and is not compared.
    """
    names = WORDS if one["certificate"] < 0.0 else WORDS[:2]
    return all(one[name] == other[name] for name in names)
