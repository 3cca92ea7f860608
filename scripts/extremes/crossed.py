"""Each extreme met by each feature: the rows are their pairs.

The engine is small, 11 blades for 3 ms; the features are those of
`evidence/combinations.py` and the ways to integrate. A pair holds by the law of its
extreme, or is refused in one line that names an input of the pair.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from evidence.combinations import FEATURES as COMBINED
from extremes.laws import (
    Law,
    apart_in_mirror,
    at_limit,
    dry,
    in_place,
    kept,
    lossless,
    named,
    opened,
)

Given = dict[str, Any]
ENGINE: Given = {
    "speed": 420.0, "duration": 3e-3, "interval": 1e-5, "time_step": 1e-6,
    "blades": 11, "modes": 22, "gap": 5e-5, "casing.harmonics": 6, "force": 2e5,
}  # fmt: skip
FEATURES: dict[str, Given] = {
    "none": {},
    **COMBINED,
    "one of three sectors": {"blades": 12, "nodal_diameter": 3},
    "scheme general": {"scheme": "general"},
    "scheme paper": {"scheme": "paper"},
}
DAMPINGS = "rotor.damping", "casing.damping"
TURNS: Given = {"rotation": "full"}


class Extreme(NamedTuple):
    """What is at its extreme, and the law that decides a scene there.

    Attributes
    ----------
    settings : inputs by name, which win over those of a feature
    law : what decides
    """

    settings: Given
    law: Law


def _damped(ratio: float) -> Given:
    return dict.fromkeys(DAMPINGS, ratio)


EXTREMES: dict[str, Extreme] = {
    "gap 0": Extreme({"gap": 0.0}, opened),
    "gap 1e-9 m": Extreme({"gap": 1e-9}, opened),
    "gap 1 m": Extreme({"gap": 1.0}, opened),
    "friction 0": Extreme({"friction": 0.0}, dry),
    "friction 50": Extreme({"friction": 50.0}, opened),
    "speed 0": Extreme({"speed": 0.0}, dry),
    "speed reversed": Extreme({}, apart_in_mirror),
    "speed 1e4 rad/s": Extreme({"speed": 1e4}, opened),
    "beyond onset": Extreme(TURNS | {"speed": 900.0} | _damped(0.05), opened),
    "beyond onset, at rest": Extreme(
        TURNS | {"speed": 900.0, "force": 0.0, "gap": 1.0} | _damped(0.05), in_place
    ),
    "at rest": Extreme({"force": 0.0, "gap": 1.0}, in_place),
    "force 1e12 N": Extreme({"force": 1e12}, kept),
    "damping 0": Extreme(_damped(0.0), lossless),
    "damping 30": Extreme(_damped(30.0), opened),
    "1 blade": Extreme({"blades": 1, "modes": 2}, opened),
    "2 blades": Extreme({"blades": 2, "modes": 4}, opened),
    "500 blades": Extreme(
        {"blades": 500, "modes": 0, "rotor.elements": 1, "duration": 2e-4, "gap": 1e-6},
        opened,
    ),
    "no modes": Extreme({"modes": 0}, opened),
    "0.99 of the longest step": Extreme({}, at_limit),
    "one step": Extreme({"duration": 1e-6}, kept),
    "denormal gap": Extreme({"gap": 5e-324}, opened),
    "denormal speed": Extreme({"speed": 5e-324}, apart_in_mirror),
    "denormal force": Extreme({"force": 5e-324, "gap": 1.0}, in_place),
    "denormal friction": Extreme({"friction": 5e-324}, opened),
    "denormal damping": Extreme(_damped(5e-324), opened),
}
DEAR = "500 blades"
DENSE = "lost blade", "lost blade later"  # whose model takes minutes, of 500 blades
# 1e7 steps in and out of contact, undamped; with friction it would diverge soon
MANY: Given = (
    ENGINE
    | {"duration": 10.0, "interval": 1e-2, "traces": "summary", "friction": 0.0}
    | _damped(0.0)
)
LONG: dict[str, Given] = {
    name: MANY | FEATURES[name] for name in ("none", "rotation", "unbalance", "exact")
}


class Pair(NamedTuple):
    """An extreme met by a feature: a row of the table."""

    extreme: str
    feature: str

    @property
    def what(self) -> str:
        """Return the pair in words."""
        return f"{self.extreme} x {self.feature}"

    @property
    def settings(self) -> Given:
        """Return the inputs of its scene."""
        given = FEATURES[self.feature] | EXTREMES[self.extreme].settings
        given = ENGINE | given
        if "mistuning" in given:
            wanted = given["blades"]
            given["mistuning"] = (given["mistuning"] * wanted)[:wanted]
        return given

    @property
    def law(self) -> Law:
        """Return what decides it: the law of its extreme, or a refusal by name."""
        return named(EXTREMES[self.extreme].law, self.touched)

    @property
    def touched(self) -> frozenset[str]:
        """Return the inputs that the pair sets, of which a refusal must name one."""
        set_here = {*FEATURES[self.feature], *EXTREMES[self.extreme].settings}
        names = {n.rpartition(".")[2] for n in set_here} | {"time_step"}
        return frozenset(names | ({"layer_edge"} if "contact_law" in names else set()))


def pairs() -> list[Pair]:
    """Return the rows of the table, extreme by extreme."""
    every = (Pair(extreme, feature) for extreme in EXTREMES for feature in FEATURES)
    return [pair for pair in every if not is_dense(pair)]


def is_dense(pair: Pair) -> bool:
    """Return whether the model of a pair takes minutes: it is tried apart."""
    return pair.extreme == DEAR and pair.feature in DENSE
