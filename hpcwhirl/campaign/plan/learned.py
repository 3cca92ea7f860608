"""Times of steps that `hpcwhirl bench --learn` has measured on this machine.

They are kept beside the compiled kernels, one file for each processor, and belong to
this version of the kernels: others have another folder. Predictions use them from then
on, and no result depends on them.
"""

from __future__ import annotations

import json
import math
import platform
import re
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from hpcwhirl.scene.schemes import Scheme
from hpcwhirl.store.atomic import write_whole


@dataclass(frozen=True)
class Measured:
    """Measured times of a step over the nominal ones, for one engine.

    Attributes
    ----------
    scheme, rotation, uneven : scheme; value of engine.rotation, "none" or "full";
        whether blades differ
    blades : number of blades
    flight, contact : measured / nominal time of a step without, and with contact
    """

    scheme: str
    rotation: str
    uneven: bool
    blades: int
    flight: float
    contact: float

    @property
    def kind(self) -> tuple[str, str, bool]:
        """What a measurement is used for: scheme, rotation, and unequal blades."""
        return self.scheme, self.rotation, self.uneven


def place() -> Path:
    """Return the file of this processor's times."""
    from hpcwhirl.campaign.machine import processor_name
    from hpcwhirl.dynamics.kernel_cache import WANTED

    name = re.sub(r"\W+", "-", f"{platform.machine()} {processor_name()}").strip("-")
    return WANTED / f"steps-{name}.json"


def keep(rows: Sequence[Measured]) -> Path:
    """Write measured times; return their file.

    Raises
    ------
    MissingFileError
        if the folder of the kernels' cache cannot be written
    """
    path = place()
    write_whole(path, (json.dumps([asdict(row) for row in rows]) + "\n").encode())
    learned.cache_clear()
    return path


@lru_cache(maxsize=1)
def learned() -> tuple[Measured, ...]:
    """Return the measured times of this processor; () if there are none.

    A file that is not as `keep` writes it counts as none.
    """
    try:
        rows = json.loads(place().read_text("utf-8"))
        return tuple(_checked(Measured(**row)) for row in rows)
    except (OSError, ValueError, TypeError):
        return ()


def _checked(row: Measured) -> Measured:
    numbers = row.blades, row.flight, row.contact
    if not all(0 < x < math.inf for x in numbers):  # a text raises TypeError
        raise ValueError(row)
    return row


def step_seconds(
    scheme: Scheme, rotation: str, blades: Any, share: float, **more: Any
) -> Any:
    """Return the predicted time of a step, s: nominal, times what was measured.

    Between the measured numbers of blades the ratios are interpolated in log N, beyond
    them they are those of the nearest.

    Parameters
    ----------
    scheme, rotation, blades, share : as for `Scheme.step_seconds`
    more : `uneven` and `points` of the same
    """
    name = rotation if rotation == "none" else "full"
    uneven = bool(more.get("uneven")) and scheme.folds
    of = sorted((r for r in learned() if r.kind == (scheme.name, name, uneven)),
                key=lambda row: row.blades)  # fmt: skip
    still, pressed = (
        scheme.step_seconds(rotation, blades, share=part, **more) for part in (0.0, 1.0)
    )
    if not of:
        return (1.0 - share) * still + share * pressed
    at, size = np.log([row.blades for row in of]), np.log(blades)
    flight, contact = (
        np.exp(np.interp(size, at, np.log([getattr(row, part) for row in of])))
        for part in ("flight", "contact")
    )
    return (1.0 - share) * still * flight + share * pressed * contact
