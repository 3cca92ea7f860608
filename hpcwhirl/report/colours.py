"""What the colour of a case tells: its regime, its whirl, or a number."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.errors import InputError, nearest
from hpcwhirl.report.palette import DIVERGING, SEQUENTIAL
from hpcwhirl.scene.quantity import with_unit
from hpcwhirl.scene.words import BAD, SHOWN, WHIRLS, Look
from hpcwhirl.store.reading.reader import words
from hpcwhirl.store.reading.select import variable_of

if TYPE_CHECKING:
    import xarray

Floats = NDArray[np.float64]
DECADES = 100.0  # largest over least number from which a scale is logarithmic
KEPT = 1e-4  # of the largest, down to which a signed scale is logarithmic


@dataclass(frozen=True)
class Colours:
    """What the colours tell.

    Attributes
    ----------
    name, label : what is shown, and with its unit
    kind : (n,), the word by which a case is coloured; "" for its number
    number : (n,) or None
    looks : of the words that may be kinds
    """

    name: str
    label: str
    kind: NDArray[np.str_]
    number: Floats | None
    looks: dict[str, Look]

    def norm(self) -> Any:
        """Return Matplotlib's norm of the numbers: logarithmic over decades."""
        from matplotlib.colors import LogNorm, Normalize, SymLogNorm

        known = self._known()
        if self.name.startswith("share"):
            return Normalize(0.0, 1.0)
        least, most = float(known.min(initial=0.0)), float(known.max(initial=0.0))
        size = max(-least, most) or 1.0
        if least < 0.0 < most:
            small = np.percentile(abs(known[known != 0]), 10)
            if small * DECADES < size:
                return SymLogNorm(max(small, KEPT * size), vmin=-size, vmax=size)
            return Normalize(-size, size)
        if least < 0.0 or not (known > 0).any():
            return Normalize(float(known.min(initial=0.0)), most or 1.0)
        positive = known[known > 0]
        if positive.max() >= DECADES * positive.min():
            return LogNorm(float(positive.min()), float(positive.max()), clip=True)
        return Normalize(float(known.min()), float(known.max()))

    def map(self) -> str:
        """Return the name of the colour map: about zero where numbers have signs."""
        known = self._known()
        return (
            DIVERGING if known.min(initial=0) < 0 < known.max(initial=0) else SEQUENTIAL
        )

    def _known(self) -> Floats:
        number = self.number if self.number is not None else np.zeros(0)
        return np.asarray(number[(self.kind == "") & np.isfinite(number)])


def colours_of(
    data: xarray.Dataset,
    name: str,
    case: NDArray[np.intp],
    word: NDArray[np.str_],
    whirl: NDArray[np.str_],
) -> Colours:
    """Return what the colours of a map tell.

    Parameters
    ----------
    data : results
    name : "regime", "whirl", a number of the file, or ``number/number``
    case, word, whirl : (n,), of the cases shown
    """
    bad = np.isin(word, list(BAD))
    if name == "regime":
        return Colours(name, "", word, None, SHOWN)
    if name == "whirl":
        return Colours(name, "", np.where(bad, word, whirl), None, WHIRLS | BAD)
    number, label = _numbers(data, name)
    shown = number[case]
    kind = np.where(bad, word, np.where(np.isfinite(shown), "", "failed"))
    return Colours(name, label, kind, shown, BAD)


def numeric(data: xarray.Dataset) -> list[str]:
    """Return the variables that are a number of each case."""
    return [
        str(n) for n, v in data.variables.items()
        if v.dims == ("case",) and v.dtype.kind in "iuf" and n != "case"
    ]  # fmt: skip


def _numbers(data: xarray.Dataset, name: str) -> tuple[Floats, str]:
    """Return (values of all cases, label) of a number or of one over another."""
    parts = [_number(data, part.strip()) for part in name.split("/")]
    if len(parts) > 2:
        msg = f"--colour takes one number or one over another, got '{name}'"
        raise InputError(msg)
    values = [data[part].to_numpy().astype(float) for part in parts]
    units = [str(data[part].attrs.get("units", "")) for part in parts]
    plain = [part.replace("_", " ") for part in parts]
    if len(parts) == 1:
        return values[0], with_unit(plain[0], units[0])
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = values[0] / values[1]
    unit = "" if units[0] == units[1] else f", {units[0]} / {units[1]}"
    return ratio, f"{plain[0]} over {plain[1]}{unit}"


def _number(data: xarray.Dataset, name: str) -> str:
    known = numeric(data)
    if name in data and name not in known:
        if words(data["regime"]).dtype.kind == "U" and data[name].dtype.kind in "OU":
            msg = f"--colour '{name}' is text; allowed: regime, whirl or a number"
            raise InputError(msg)
        msg = f"--colour '{name}' is not one number a case"
        raise InputError(msg)
    try:
        return variable_of(name, known, "number")
    except InputError:
        hint = nearest(name, ["regime", "whirl", *known])
        msg = f"unknown --colour '{name}'{hint or ': regime, whirl or a number'}"
        raise InputError(msg) from None
