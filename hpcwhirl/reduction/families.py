"""The modal table: families, nodal diameters, frequencies, share of the centre."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from hpcwhirl.reduction.model import Model
from hpcwhirl.reduction.modes import SUSPENSION_SHARE, ModalModel

UNKNOWN = "unknown"  # family: shapes do not tell the shaft's springs
MOVING_SHARE = 0.1  # of the shaft's springs: where two modes share them, both move
PAIR = 1e-8  # relative difference of frequencies that are one line


@dataclass(frozen=True)
class Line:
    """One line of the modal table; a pair of equal frequencies is one line.

    The centre's share of the strain energy is None where it is not known.
    """

    body: str
    family: str
    nodal_diameter: int
    frequency_hz: float
    centre_share: float | None


def family_ranks(model: ModalModel, k: int) -> dict[int, str]:
    """Return {rank: family} of a nodal diameter: by rank, the suspension apart.

    The suspension is the mode with the largest share of its strain energy in the
    shaft's springs, if that exceeds one half. Where these are not known, no family is.
    """
    own = np.flatnonzero(model.diameter == k)
    if np.isnan(model.centre_share[own]).any():
        return dict.fromkeys(model.rank[own].tolist(), UNKNOWN)
    top = own[np.argmax(model.centre_share[own])]
    suspended = model.centre_share[top] > SUSPENSION_SHARE
    apart = int(model.rank[top]) if suspended else len(own)
    names = {apart: "suspension"} if suspended else {}
    ranks = sorted({int(rank) for rank in model.rank[own]} - names.keys())
    return names | {rank: f"{rank + (rank < apart)}F" for rank in ranks}


def _rotor_lines(model: ModalModel) -> list[Line]:
    """Return the lines of a rotor; a pair that mistuning has split is two of them."""
    lines = []
    for k in np.unique(model.diameter):
        own = np.flatnonzero(model.diameter == k)
        names = family_ranks(model, int(k))
        for m, before in zip(own, np.r_[own[:1], own[:-1]], strict=True):
            twin = m != before and model.rank[m] == model.rank[before]
            if twin and model.omega[m] <= (1 + PAIR) * model.omega[before]:
                continue
            rank = int(model.rank[m])
            hertz, share = model.omega[m] / (2 * np.pi), float(model.centre_share[m])
            told = None if np.isnan(share) else share
            lines.append(Line("rotor", names[rank], int(k), float(hertz), told))
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
    """Return {nodal diameter: omega of 1F, rad/s} of a body; the lower of a pair."""
    return {
        line.nodal_diameter: 2 * np.pi * line.frequency_hz
        for line in reversed(table)
        if line.body == body and line.family == "1F"
    }


def moving_families(table: list[Line]) -> dict[str, dict[int, float]]:
    """Return {family: {nodal diameter: omega, rad/s}} of the rotor's main waves.

    These are 1F, and of each other family the modes with a share of the strain energy
    in the shaft's springs: the suspension, or two modes that halve it. The lower of a
    pair.
    """
    found: dict[str, dict[int, float]] = {}
    for line in table:
        moves = line.family == "1F" or (line.centre_share or 0.0) > MOVING_SHARE
        if line.body == "rotor" and moves:
            own = found.setdefault(line.family, {})
            own.setdefault(line.nodal_diameter, 2 * np.pi * line.frequency_hz)
    return found


def as_records(table: list[Line]) -> list[dict[str, object]]:
    """Return the table as plain records."""
    return [asdict(line) for line in table]
