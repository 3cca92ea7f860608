"""Constant arrays of the kernel `general`: a rotor of unequal sectors as real modes.

They are the coefficients of the rotor's modes with the displacements of its tips, those
of the ring by nodal diameter, and the Delassus matrix of both.
"""

from __future__ import annotations

import numpy as np

from hpcwhirl.arrays import Floats
from hpcwhirl.dynamics.kernels import passes
from hpcwhirl.dynamics.kernels.circulant import folded
from hpcwhirl.dynamics.kernels.cyclic import widths
from hpcwhirl.dynamics.kernels.kernel_types import Arrays
from hpcwhirl.dynamics.kernels.vectors import aligned
from hpcwhirl.dynamics.kernels.wave_types import (
    GeneralContact,
    GeneralRotor,
    UncoupledRotor,
    WholeRotor,
)
from hpcwhirl.dynamics.kernels.whole import EIGHT
from hpcwhirl.dynamics.operators import friction_with_sign, rotor_compliance
from hpcwhirl.dynamics.slots import casing_arrays, ring_column, transforms
from hpcwhirl.dynamics.timestep import recursion
from hpcwhirl.reduction.bodies import centre_rows, tip_rows
from hpcwhirl.reduction.model import Model
from hpcwhirl.reduction.modes import ModalModel
from hpcwhirl.scene import Scene
from hpcwhirl.scene.rules import NO_BLADE


def _items(body: ModalModel, step: float, mu: float, size: int) -> Floats:
    """Return the coefficients of a rotor's modes, (ITEMS, size), see `kernels.passes`.

    Where the cyclic kernel multiplies the spectrum of the multipliers by displacements
    of a tip in a mode, the general one has the modal forces themselves: those of normal
    forces, then those of friction over mu. So the coefficients RADIAL and SI are 1.

    step, mu : dt, s; friction with the sign of the speed
    size : number of modes, padded
    """
    modes = len(body.omega)
    keep, pull, give = recursion(body.omega, body.ratios, step)
    items = np.zeros((passes.ITEMS, size))
    used = items[:, :modes]
    used[passes.KEEP], used[passes.PULL], used[passes.GIVE] = keep, pull, give
    used[passes.RADIAL], used[passes.SI] = 1.0, 1.0
    used[passes.NORMAL], used[passes.ALONG] = give, mu * give
    used[passes.OMEGA], used[passes.DAMPING] = body.omega, body.ratios
    used[passes.RATE] = 2 * body.ratios * body.omega / (4 * step)
    return items


def general_rotor(model: Model, scene: Scene) -> GeneralRotor:
    """Return the coefficients of a rotor as real modes, for the kernel `general`."""
    body, blades = model.rotor, model.blades
    size = -(-len(body.omega) // EIGHT) * EIGHT

    def padded(rows: Floats) -> Floats:
        return np.pad(rows, ((0, 0), (0, size - rows.shape[1])))

    radial, tangential = (padded(-rows) for rows in tip_rows(body, blades))
    hub = padded(centre_rows(body, blades))
    rows = radial[folded(blades, widths(blades)[1])]
    read = rows.T.reshape(size, -1, EIGHT).transpose(1, 0, 2)
    items = _items(body, scene.solver.time_step, friction_with_sign(scene), size)
    reach = np.hypot(radial, tangential).max(axis=0)
    arrays = (aligned(a.ravel()) for a in (read, radial, tangential, hub, reach))
    return GeneralRotor(passes.packed(items), *arrays)


def delassus(model: Model, scene: Scene) -> Floats:
    """Return the Delassus matrix W of rotor and ring, (N, N), m/N.

    Column j has the changes of all gaps in a step by a unit multiplier on blade j and
    its friction.
    """
    w = rotor_compliance(model, scene)
    blades = np.arange(model.blades)
    return w + ring_column(model, scene)[np.subtract.outer(blades, blades)]


def unequal_arrays(
    model: Model, scene: Scene, rotor: GeneralRotor | WholeRotor | UncoupledRotor
) -> Arrays:
    """Return all constant arrays of the kernel `general`: a rotor of unequal sectors.

    rotor : coefficients of the rotor, as real modes or as waves
    """
    w, lost = delassus(model, scene), scene.engine.rotor.lost_blade
    if lost != NO_BLADE:
        w[lost] -= rotor_compliance(model, scene)[lost]
    loading, casing = casing_arrays(model, scene)
    contact = GeneralContact(w, *transforms(model.blades))
    return Arrays(loading, rotor, casing, contact)
