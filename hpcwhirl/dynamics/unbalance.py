"""An unbalance in the arrays and states of kernels: one coordinate more, always 1.

The force of an unbalance is constant in the rotating frame. A coordinate s that stays 1
brings it into matrices that know no force, see `case.unbalance` for x_s:

modes: the amplitudes are those of y = x - x_s, and a mode without mass, stiffness and
damping reads x_s at the tips and the centre; of scheme `modal` it is a wave, see
`turning_waves.Circle`.

matrices: the coordinates are x, and y = [I, -x_s] (x, s): the column of s in A^-1 K is
-A^-1 F. K becomes [I, -x_s]^T K [I, -x_s], so that the energy, which then includes the
potential of the force, is again that of y.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.dynamics.kernels.kernel_types import CoupledBody, DenseBody
from hpcwhirl.reduction.model import Model

Floats = NDArray[np.float64]


def circling_modes(body: CoupledBody, model: Model, places: Floats) -> CoupledBody:
    """Return a rotor's modes with one more, which reads x_s.

    places : x_s (n,), m, in the coordinates of the rotor's matrices
    """
    count = 2 * model.blades
    tips, hub = places[:count].reshape(-1, 2), places[count : count + 2]
    none = np.zeros(1)
    blocks = {
        name: np.append(getattr(body, name), none)
        for name in ("keep", "pull", "give", "stiffness", "damping", "push")
    }
    return body._replace(
        **blocks,
        starts=np.append(body.starts, body.starts[-1] + 1),
        read=np.vstack([body.read, np.concatenate([tips[:, 0], hub])]),
        radial=np.ascontiguousarray(np.column_stack([body.radial, tips[:, 0]])),
        tangential=np.ascontiguousarray(np.column_stack([body.tangential, tips[:, 1]])),
    )


def circling_matrices(body: DenseBody, places: Floats) -> DenseBody:
    """Return a rotor's matrices with the coordinate s; places as `circling_modes`."""
    size = len(places)
    relative = np.column_stack([np.eye(size), -places])
    names = ("keep", "pull", "inverse", "mass", "stiffness", "damping", "push")
    plain = {name: np.zeros((size + 1, size + 1)) for name in names}
    for name in names:
        plain[name][:size, :size] = getattr(body, name)  # stored transposed
    for name in ("stiffness", "push"):
        plain[name] = relative.T @ getattr(body, name) @ relative
    plain["pull"][size, :size] = -places @ body.pull
    placed = body.radial, body.tangential, body.centre
    return DenseBody._make([*(plain[name] for name in names), *placed])
