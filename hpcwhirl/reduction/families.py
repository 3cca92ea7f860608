"""The modal table of an engine, which `hpcwhirl model` prints, and families of modes.

A family is the modes of one kind for all nodal diameters, such as the first bending
modes of the blades, 1F. The rank of a mode is its index among those of its nodal
diameter, by frequency, from 0.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from hpcwhirl.arrays import Floats
from hpcwhirl.reduction.bodies import contact_rows
from hpcwhirl.reduction.modes import SUSPENSION_SHARE, ModalModel, centre_rows
from hpcwhirl.reduction.recognise import equal_sectors
from hpcwhirl.reduction.spin import turned_alike

if TYPE_CHECKING:  # which imports this module for the waves of a rotor
    from hpcwhirl.reduction.model import Model

HELD = "suspension", "conical"  # families of modes on the springs of the shaft
UNKNOWN = "unknown"  # family if shapes do not determine the shaft's springs
MOVING_SHARE = 0.1  # least energy share in the springs for a mode that moves the shaft
MOST_KEPT = 32  # number of cached rotors, as in `model`
PAIR = 1e-8  # relative difference of frequencies up to which a pair is one line


@dataclass(frozen=True)
class Line:
    """One line of the modal table: a mode, or a pair of modes of equal frequency.

    Attributes
    ----------
    body, family : "rotor" or "casing"; such as "1F" or "suspension"
    nodal_diameter, frequency_hz : k; Hz, at rest
    centre_share : share of the strain energy in the shaft's springs; None if unknown
    clearance_consumption : how much of the tips' motion closes the clearance, 0 to 1,
        see the function of this name; None for the casing
    """

    body: str
    family: str
    nodal_diameter: int
    frequency_hz: float
    centre_share: float | None
    clearance_consumption: float | None = None


def family_ranks(model: ModalModel, k: int) -> dict[int, str]:
    """Return the family of each mode of a nodal diameter, {rank: "1F", "2F", ...}.

    A rank is a mode's index among those of diameter k. The suspension is the mode with
    more than half of its strain energy in the shaft's springs; a disk that tilts on its
    shaft has two such modes, and the higher one is called conical; those of a shaft
    with mass that are higher still are S3, S4, .... Other modes are counted by rank. If
    the shares of strain energy are unknown, all families are `UNKNOWN`.
    """
    modes = np.flatnonzero(model.diameter == k)
    if np.isnan(model.centre_share[modes]).any():
        return dict.fromkeys(model.rank[modes].tolist(), UNKNOWN)
    held = modes[model.centre_share[modes] > SUSPENSION_SHARE]
    ranks = sorted({int(r) for r in model.rank[held]})
    more = (f"S{place}" for place in itertools.count(len(HELD) + 1))
    names = dict(zip(ranks, itertools.chain(HELD, more), strict=False))
    ranks = sorted({int(rank) for rank in model.rank[modes]} - names.keys())
    return names | {rank: f"{place}F" for place, rank in enumerate(ranks, 1)}


def clearance_consumption(radial: Floats, tangential: Floats) -> float:
    """Return c_Delta of a mode: how much of its tip motion closes the clearance.

    It is the largest radial amplitude |U| of any contact point, divided by the largest
    in-plane displacement of any, the semi-major axis a of its ellipse, a^2 = (|U|^2 +
    |V|^2 + |U^2 + V^2|) / 2: 1 where tips move radially, 0 where they move only along
    the casing or not at all. Clearance consumption, the clearance that a blade uses up
    as it vibrates in one of its modes, comes from shape optimisation with contact
    (Laine et al.); here it is divided by the displacement.

    Parameters
    ----------
    radial, tangential : (p, 1 or 2), of p contact points, in one mode or in both of a
        pair, which vibrate a quarter of a period apart
    """
    u, v = (np.dot(part, [1.0, 1j][: part.shape[1]]) for part in (radial, tangential))
    size = np.abs(u) ** 2 + np.abs(v) ** 2 + np.abs(u**2 + v**2)
    most = float(np.sqrt(size.max() / 2))
    return float(np.abs(u).max()) / most if most > 0.0 else 0.0


def _rotor_lines(model: ModalModel, blades: int) -> list[Line]:
    """Return the lines of the modal table for a rotor, one for each mode or pair.

    A pair of modes that mistuning has split gives two lines.

    model, blades : modal model of the rotor; N
    """
    lines, rows = [], contact_rows(model, blades)
    for k in np.unique(model.diameter):
        modes = np.flatnonzero(model.diameter == k)
        names = family_ranks(model, int(k))
        for m, before in zip(modes, np.r_[modes[:1], modes[:-1]], strict=True):
            if _are_pair(model, before, m):
                continue
            rank = int(model.rank[m])
            hertz, share = model.omega[m] / (2 * np.pi), float(model.centre_share[m])
            known_share = None if np.isnan(share) else share
            own = [m, *(i for i in modes if _are_pair(model, m, i))]
            used = clearance_consumption(*(part[:, own] for part in rows))
            name = names[rank]
            lines.append(Line("rotor", name, int(k), float(hertz), known_share, used))
    return lines


def _are_pair(model: ModalModel, one: np.intp, other: np.intp) -> bool:
    """Return whether two modes of a rotor are the first and second of a pair.

    A pair has one rank and, to round-off, one frequency.

    one, other : indices of the modes, both of one nodal diameter
    """
    if other <= one or model.rank[one] != model.rank[other]:
        return False
    return bool(model.omega[other] <= (1 + PAIR) * model.omega[one])


def modal_table(model: Model) -> list[Line]:
    """Return the modal table of an engine: lines of the rotor, then of the casing.

    Lines of a body are sorted by frequency. Families of the casing count from 1 within
    a nodal diameter, as ``1F``, ``2F``.
    """
    table = sorted(
        _rotor_lines(model.rotor, model.blades), key=lambda line: line.frequency_hz
    )
    casing = model.casing
    if casing is None:
        return table
    for m in np.flatnonzero(casing.phase == 0):
        name = f"{casing.rank[m] + 1}F"
        hertz = float(casing.omega[m] / (2 * np.pi))
        table.append(Line("casing", name, int(casing.diameter[m]), hertz, 0.0))
    return table


def first_family(table: list[Line], body: str) -> dict[int, float]:
    """Return frequencies of a body's first bending family, 1F, by nodal diameter.

    Returns {nodal diameter: omega, rad/s}; of a pair that mistuning has split, the
    lower omega

    table, body : modal table of the engine; "rotor" or "casing"
    """
    return {
        line.nodal_diameter: 2 * np.pi * line.frequency_hz
        for line in reversed(table)
        if line.body == body and line.family == "1F"
    }


def moving_families(table: list[Line]) -> dict[str, dict[int, float]]:
    """Return frequencies of the rotor's modes that matter for whirl, by family.

    Returns {family: {nodal diameter: omega, rad/s}}. These modes are 1F and, of the
    other families, those with more than `MOVING_SHARE` of their strain energy in the
    shaft's springs: the suspension, or two modes that share this energy. Of a pair that
    mistuning has split, the lower frequency is returned.

    table : modal table of the engine
    """
    families: dict[str, dict[int, float]] = {}
    for line in table:
        moves = line.family == "1F" or (line.centre_share or 0.0) > MOVING_SHARE
        if line.body == "rotor" and moves:
            frequencies = families.setdefault(line.family, {})
            frequencies.setdefault(line.nodal_diameter, 2 * np.pi * line.frequency_hz)
    return families


def moving_ranks(model: ModalModel, k: int) -> dict[int, str]:
    """Return {rank: family} of 1F, and of modes that move the shaft, at one diameter.

    A mode moves the shaft if it has more than `MOVING_SHARE` of its strain energy in
    the shaft's springs. A rank is a mode's index among those of the diameter.

    model, k : modal model of the rotor; nodal diameter
    """
    modes = np.flatnonzero((model.diameter == k) & (model.phase == 0))
    names = family_ranks(model, k)
    share = {int(model.rank[m]): float(model.centre_share[m]) for m in modes}
    return {
        rank: name
        for rank, name in names.items()
        if name == "1F" or share[rank] > MOVING_SHARE
    }


@lru_cache(maxsize=MOST_KEPT)
def rotor_by_diameter(model: Model) -> ModalModel:
    """Return a model's rotor with modes sorted by nodal diameter, if that is possible.

    Natural frequencies, critical speeds (Eq. 13 of the paper) and the growth of free
    motions do not depend on contact: they are computed with this rotor, in which only
    the reference points count as tips, so that equal sectors are recognised as with one
    point per tip. The time integration has waves of its own, see
    `dynamics.waves.point_sectors`.

    It is the model's rotor unchanged, unless tips have several points and sectors are
    equal within `recognise.EQUAL`: then modes have nodal diameters and, with terms of
    rotation, waves.
    """
    own, blades = model.rotor, model.blades
    if own.points is None:
        return own
    single = replace(own, points=None)
    found = turned_alike(equal_sectors(single, blades), single, blades)
    if not found.cyclic or (found.spin is not None and not found.spin.waves):
        return own
    return replace(found, centre_share=_shares(own, found, blades))


def _shares(own: ModalModel, found: ModalModel, blades: int) -> Floats:
    """Return the share of each mode's strain energy in the shaft's springs, (m,).

    The modes are those of `found`. The stiffness of the springs follows from the shares
    of `own`, the same rotor with other modes whose shares are known; NaN if unknown.
    """
    moved, others = ((centre_rows(m, blades) ** 2).sum(0) for m in (own, found))
    if not moved.any():
        return np.zeros(len(others))
    top = int(moved.argmax())
    spring = own.centre_share[top] * own.omega[top] ** 2 / moved[top]
    still = others == 0.0
    share = spring * others / np.where(still, 1.0, found.omega**2)
    return np.asarray(np.where(still, 0.0, share))
