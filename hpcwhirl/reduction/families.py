"""The modal table: families, nodal diameters, frequencies, share of the centre."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from hpcwhirl.reduction.model import Model
from hpcwhirl.reduction.modes import ModalModel

SUSPENSION_SHARE = 0.5  # of the strain energy in the shaft's springs


@dataclass(frozen=True)
class Line:
    """One line of the modal table; a pair of equal frequencies is one line."""

    body: str
    family: str
    nodal_diameter: int
    frequency_hz: float
    centre_share: float


def _rotor_lines(model: ModalModel) -> list[Line]:
    """Name families by rank within a nodal diameter, the suspension apart.

    The suspension is the k = 1 mode with the largest share of its strain energy in
    the shaft's springs, if that exceeds one half.
    """
    lines = []
    for k in np.unique(model.diameter):
        own = np.flatnonzero((model.diameter == k) & (model.phase == 0))
        shares = model.centre_share[own]
        top = int(np.argmax(shares))
        apart = top if shares[top] > SUSPENSION_SHARE else -1
        family = 0
        for place, m in enumerate(own):
            family += place != apart
            name = "suspension" if place == apart else f"{family}F"
            hertz = float(model.omega[m] / (2 * np.pi))
            lines.append(Line("rotor", name, int(k), hertz, float(shares[place])))
    return lines


def modal_table(model: Model) -> list[Line]:
    """Return the modal table of both bodies, each in order of frequency.

    Families of the casing count from 1 within a nodal diameter, as ``1F``, ``2F``.
    """
    table = sorted(_rotor_lines(model.rotor), key=lambda line: line.frequency_hz)
    casing = model.casing
    if casing is None:
        return table
    for m in np.flatnonzero(casing.phase == 0):
        name = f"{casing.rank[m] + 1}F"
        hertz = float(casing.omega[m] / (2 * np.pi))
        table.append(Line("casing", name, int(casing.diameter[m]), hertz, 0.0))
    return table


def first_family(table: list[Line], body: str) -> dict[int, float]:
    """Return {nodal diameter: omega of 1F, rad/s} of a body."""
    return {
        line.nodal_diameter: 2 * np.pi * line.frequency_hz
        for line in table
        if line.body == body and line.family == "1F"
    }


def as_records(table: list[Line]) -> list[dict[str, object]]:
    """Return the table as plain records."""
    return [asdict(line) for line in table]
