"""The studies of `hpcwhirl new --study`: what their files hold beside the fan.

`studies.toml` has the texts. The sizes in them follow from the fan: an unbalance is
that whose circle touches the casing at the speed of the largest response, a gap closes
by shares of itself, and a bearing is as stiff as the shaft and as damped as a film.
"""

from __future__ import annotations

import math
import tomllib
from functools import cache
from importlib import resources
from typing import TYPE_CHECKING

from hpcwhirl.scene.units import ANGULAR, in_shown, shown_in

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from hpcwhirl.analysis.response_study import Study
    from hpcwhirl.case.fan import Checked
    from hpcwhirl.scene import Scene

USUAL = "usual"  # texts of a study that has none
GAPS = (0.5, 1.0, 2.0, 4.0)  # gaps that a new file sweeps, as multiples of the fan's
UNBALANCES = (0.5, 1.0, 2.0)  # as multiples of that at which the tips touch
CLOSURES = (0.25, 0.5, 0.75, 0.9)  # parts of the gap that close
NEAR = (0.9, 1.1)  # speeds around the largest response, as multiples of its speed
RAMP = (0.8, 1.1)  # speeds between which a run-up leads, as multiples of the same
RAMP_PERIODS, RAMP_SHARE = 120.0, 5.0 / 6.0  # duration, periods of 1F; part of the ramp
LOSS_PERIODS, OFF_PERIODS = 4.0, 40.0  # time of a loss, and duration, periods of 1F
WINDMILLING = 0.3  # speed after a loss / full speed
FEW, SPEEDS = 5, 20  # approximate numbers of speeds of sweeps
SPREAD, MOST_SPREAD = 0.05, 0.2  # standard deviation and largest deviation of gap / gap
FRICTIONS = (0.5, 1.5)  # range of friction, as multiples of the fan's
AFTER = 3.0  # amplitude limit / radius of the circle after a loss
BEARING = {  # speed / full speed: factors on (kxx, kyy, cxx, cyy) of a bearing
    0.0: (0.8, 0.9, 1.5, 1.6), 0.5: (0.9, 1.0, 1.2, 1.3), 1.0: (1.0, 1.1, 1.0, 1.1),
    1.5: (1.05, 1.15, 0.9, 1.0),
}  # fmt: skip
FILM = 0.06  # 2 xi of the damper in the bearing, on the rigid rotor


@cache
def studies() -> dict[str, dict[str, str]]:
    """Return {study: {key: text}} of all studies, with the usual texts filled in."""
    text = resources.files("hpcwhirl.cli").joinpath("studies.toml").read_text("utf-8")
    found = tomllib.loads(text)
    usual = found.pop(USUAL)
    return {name: usual | own for name, own in found.items()}


def written(value: float, unit: str, digits: int = 4) -> str:
    """Return a number in SI as the text of a TOML file, such as '"0.8 mm"'."""
    return f'"{in_shown(value, unit, digits)}"'


def listed(values: Sequence[float], unit: str) -> str:
    """Return numbers in SI as a list of a TOML file."""
    return f"[{', '.join(written(value, unit) for value in values)}]"


def spread_over(low: float, high: float, count: int) -> str:
    """Return about `count` round speeds as a range of a TOML file.

    low, high : rad/s, within which the speeds lie; with 0 they begin at two steps
    """
    unit, factor = shown_in(ANGULAR)
    step = (high - low) * factor / count
    power = 10.0 ** math.floor(math.log10(step))
    step = min((f * power for f in (1, 2, 2.5, 5, 10)), key=lambda s: abs(s - step))
    first = max(math.ceil(low * factor / step - 1e-9), 2) * step
    last = math.floor(high * factor / step + 1e-9) * step
    texts = (f'"{value:.6g} {unit}"' for value in (first, last, step))
    return "{{ start = {}, stop = {}, step = {} }}".format(*texts)


def sizes_of(study: str, scene: Scene, checked: Checked) -> dict[str, str]:
    """Return the sizes that a study's texts name, {name: text of a TOML file}.

    Parameters
    ----------
    study : a key of `studies`
    scene, checked : the fan at full speed, and properties of its model
    """
    gap, full = scene.gap, checked.full_speed
    sizes = {
        "speeds": spread_over(0.0, full, SPEEDS),
        "few": spread_over(0.0, full, FEW),
        "gaps": listed([part * gap for part in GAPS], "m"),
    }
    own = _OWN.get(study)
    return sizes | (own(scene, checked) if own else {})


def _unbalanced(scene: Scene, checked: Checked) -> dict[str, str]:
    """Return the speed of the largest response, and unbalances that touch there."""
    found = _response(scene, checked)
    worst = found.worst()
    touching, speed = found.scene.unbalance / worst.used, worst.speed
    slow, fast = (part * speed for part in RAMP)
    time = RAMP_PERIODS / checked.family
    rate = (fast - slow) / (RAMP_SHARE * time)
    return {
        "worst": written(speed, ANGULAR), "worst_told": in_shown(speed, ANGULAR, 4),
        "near": spread_over(NEAR[0] * speed, NEAR[1] * speed, SPEEDS),
        "unbalance": written(touching, "kg m"),
        "half_unbalance": written(touching / 2, "kg m"),
        "unbalances": listed([part * touching for part in UNBALANCES], "kg m"),
        "slow": written(slow, ANGULAR), "fast": written(fast, ANGULAR),
        "rate": written(rate, "rad/s^2"), "rate_down": written(-rate, "rad/s^2"),
        "ramp_duration": written(time, "s"),
        "closure": written(CLOSURES[1] * scene.gap, "m"),
        "closures": listed([part * scene.gap for part in CLOSURES], "m"),
        "gap_time": written(scene.duration / 8, "s"),
    }  # fmt: skip


def _response(scene: Scene, checked: Checked) -> Study:
    """Return the response of a fan to its unbalance up to full speed."""
    from hpcwhirl.analysis.api617 import Operating
    from hpcwhirl.analysis.response_study import study

    full = checked.full_speed
    return study(scene, Operating(NEAR[0] * full, full), full)


def _oval(scene: Scene, _: Checked) -> dict[str, str]:
    return {"oval": f"{scene.gap:.4g}"}


def _bearing(scene: Scene, checked: Checked) -> dict[str, str]:
    """Return the table of a bearing as stiff as the fan's shaft, and damped."""
    from hpcwhirl.analysis.response import moving_mass

    stiffness = scene.engine.rotor.centre_stiffness
    damping = FILM * math.sqrt(stiffness * moving_mass(scene))
    unit, factor = shown_in(ANGULAR)
    (per, stiffer), (of, more) = shown_in("N/m"), shown_in("N s/m")
    scales = (stiffer * stiffness, stiffer * stiffness, more * damping, more * damping)
    heads = [f"kxx [{per}]", f"kyy [{per}]", f"cxx [{of}]", f"cyy [{of}]"]
    rows = [[f"speed [{unit}]", *heads]]
    for part, factors in BEARING.items():
        cells = (f * s for f, s in zip(factors, scales, strict=True))
        speed = part * checked.full_speed * factor
        rows.append([f"{speed:.4g}", *(f"{cell:.4g}" for cell in cells)])
    wide = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = (
        ", ".join(f"{c:>{w}}" for c, w in zip(row, wide, strict=True)) for row in rows
    )
    return {"bearing": "\n".join(lines)}


def _blade_off(scene: Scene, checked: Checked) -> dict[str, str]:
    """Return times and rates of a loss at full speed, and a limit of amplitudes.

    The limit is of the whole rotor's largest circle by the unbalance of the loss.
    """
    from hpcwhirl.case.resolve import resolve
    from hpcwhirl.case.unbalance import released_moment
    from hpcwhirl.scene import apply_settings

    full, period = checked.full_speed, 1.0 / checked.family
    last = WINDMILLING * full
    rest = (OFF_PERIODS - LOSS_PERIODS) * period
    lost = resolve(apply_settings(scene, {"engine.rotor.lost_blade": 0}))
    moment = {"unbalance": abs(released_moment(lost.model))}
    reach = _response(apply_settings(scene, moment), checked).worst().reach
    limit = max(AFTER * reach / scene.engine.rotor.radius, 0.1)
    return {
        "loss": written(LOSS_PERIODS * period, "s"),
        "off_duration": written(OFF_PERIODS * period, "s"),
        "windmilling": written(last, ANGULAR),
        "braking": written(-3.0 * (full - last) / rest, "rad/s^2"),
        "limit": f"{limit:.2g}",
    }


def _drawn(scene: Scene, _: Checked) -> dict[str, str]:
    """Return the parameters of the distributions of gap and friction."""
    gap, friction = scene.gap, scene.friction
    return {
        "spread": written(SPREAD * gap, "m"),
        "least_gap": written((1 - MOST_SPREAD) * gap, "m"),
        "most_gap": written((1 + MOST_SPREAD) * gap, "m"),
        "least_friction": f"{FRICTIONS[0] * friction:.4g}",
        "most_friction": f"{FRICTIONS[1] * friction:.4g}",
    }


_OWN: dict[str, Callable[[Scene, Checked], dict[str, str]]] = {
    "run-up": _unbalanced, "unbalance": _unbalanced, "closing-gap": _unbalanced,
    "oval": _oval, "bearing": _bearing, "blade-off": _blade_off, "uncertainty": _drawn,
}  # fmt: skip
