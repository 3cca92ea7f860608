"""Measure the times of steps by which the cost of campaigns is predicted."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from hpcwhirl.benchmark.bench import Asked, Timing, pattern, step_times, time_steps
from hpcwhirl.campaign.plan.learned import Measured
from hpcwhirl.scene import Scene, apply_settings
from hpcwhirl.scene.input_names import Value
from hpcwhirl.scene.schemes import DEFAULT, SCHEMES

SIZES = (6, 22, 66)  # numbers of blades
SLOW = 22  # largest number of blades of engines that are measured with slow schemes
RUBS = {"speed": 400.0, "gap": 1e-4}  # a motion in which blades touch often


def measure(repeats: int) -> list[Measured]:
    """Time steps of all schemes, with and without contact; return ratios to nominal.

    repeats : number of times that each timing is repeated
    """
    kinds = list(_kinds())
    asked = [Asked(scene, name, contact) for name, _, _, _, scene in kinds
             for contact in (False, True)]  # fmt: skip
    timings = time_steps(asked, repeats)
    pairs = zip(kinds, timings[::2], timings[1::2], strict=True)
    return [_ratios(kind[:4], flight, mixed) for kind, flight, mixed in pairs]


Kind = tuple[str, str, bool, int]


def _kinds() -> Iterator[tuple[str, str, bool, int, Scene]]:
    """Yield (scheme, rotation, whether blades differ, blades, scene) to be timed."""
    for name, scheme in SCHEMES.items():
        fast = scheme.folds
        for blades in SIZES if fast else [n for n in SIZES if n <= SLOW]:
            for rotation in ("none", "full"):
                for uneven in (False, True) if name == DEFAULT else (False,):
                    scene = scene_of(blades, rotation, uneven=uneven)
                    yield name, rotation, uneven, blades, scene


def scene_of(blades: int, rotation: str, *, uneven: bool) -> Scene:
    """Return a scene to be timed, in which blades rub."""
    settings: dict[str, Value] = {
        "rotor.blades": blades,
        "rotation": rotation,
        "plan": "everything",
    }
    settings |= {"modes": 5 * blades, **RUBS}
    if uneven:
        settings["mistuning"] = pattern(blades)
    return apply_settings(Scene(), settings)


def _ratios(kind: Kind, flight: Timing, mixed: Timing) -> Measured:
    """Return the measured times over the nominal ones.

    Without contact in the timed steps, one with contact has the ratio of one without.

    flight, mixed : timing without contact; timing in which some steps have contact
    """
    name, rotation, uneven, blades = kind
    first, second = step_times(flight, mixed) if mixed.contact else (0.0, 0.0)
    scheme = SCHEMES[name]
    nominal = [
        1e6 * float(scheme.step_seconds(rotation, blades, uneven=uneven, share=share,
                                        touching=touching))
        for share, touching in ((0.0, None), (1.0, mixed.touching or None))
    ]  # fmt: skip
    still = flight.microseconds_per_step / nominal[0]
    row = Measured(name, rotation, uneven, blades, still, still)
    return replace(row, contact=second / nominal[1]) if second > first else row
