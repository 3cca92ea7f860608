"""An unbalance in arrays and states of kernels: a coordinate that is always 1.

The force of an unbalance is constant in the rotating frame. A coordinate s that stays 1
represents it in kernels without constant forces; `case.unbalance` explains x_s:

modes: the amplitudes are those of y = x - x_s, and a mode without mass, stiffness and
damping adds x_s at the tips and the centre; in scheme `modal` it is a wave, see
`turning_waves.Circle`. If supports differ by direction, two further modes that vary as
cos 2 Omega t and sin 2 Omega t add the ellipse's Re xi and -Im xi.

matrices: the coordinates are x, and y = [I, -x_s] (x, s): the column of s in A^-1 K is
-A^-1 F. K becomes [I, -x_s]^T K [I, -x_s], so that the energy, which then includes the
potential of the force, is that of y, too.
"""

from __future__ import annotations

import math

import numpy as np

from hpcwhirl.arrays import Floats
from hpcwhirl.case.unbalance import circle, swing
from hpcwhirl.dynamics.kernels.body_types import CoupledBody, DenseBody
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene


def circling_modes(body: CoupledBody, model: Model, scene: Scene) -> CoupledBody:
    """Return an unbalanced rotor's modes, with added ones that represent its orbit.

    The circle is x_s, see `case.unbalance`.
    """
    rows, count = read_by(model, scene), 2 * model.blades
    radial, tangential = (rows[:, places] for places in model.places)
    hub = rows[:, count : count + 2]
    none = np.zeros(len(rows))
    pulls = np.array([0.0, *(len(rows) - 1) * [swings(scene)[0]]])
    return body._replace(
        keep=np.append(body.keep, pulls > 0.0),
        pull=np.append(body.pull, pulls),
        give=np.append(body.give, none),
        stiffness=np.append(body.stiffness, none),
        damping=np.append(body.damping, none),
        push=np.append(body.push, none),
        starts=np.append(body.starts, body.starts[-1] + 1 + np.arange(len(rows))),
        read=np.vstack([body.read, np.hstack([radial, hub])]),
        radial=np.ascontiguousarray(np.hstack([body.radial, radial.T])),
        tangential=np.ascontiguousarray(np.hstack([body.tangential, tangential.T])),
    )


def read_by(model: Model, scene: Scene) -> Floats:
    """Return the displacements of the rotor for unit amplitudes of the added modes, m.

    They are (1, n); (3, n) on supports that differ by direction; (0, n) if balanced.
    """
    places, swung = circle(model, scene), swing(model, scene)
    if places is None:
        return np.zeros((0, len(model.rotor.shapes)))
    if swung is None:
        return places[None, :]
    return np.stack([places, swung.real, -swung.imag])


def swings(scene: Scene) -> tuple[float, float]:
    """Return (2 - 2 cos a, sin a) of the step of an unbalanced rotor's ellipse.

    The ellipse turns by a = 2 Omega dt in a step, rotating frame.
    """
    half = scene.speed * scene.solver.time_step
    return 4.0 * math.sin(half) ** 2, math.sin(2.0 * half)


def amplitudes_at_start(count: int, scene: Scene) -> tuple[Floats, Floats]:
    """Return (amplitudes, increments) at step 0 of the modes of `circling_modes`."""
    pull, sine = swings(scene)
    q, d = np.array([1.0, 1.0, 0.0]), np.array([0.0, pull / 2, sine])
    return q[:count], d[:count]


def circling_matrices(body: DenseBody, places: Floats) -> DenseBody:
    """Return an unbalanced rotor's matrices with the added coordinate s, which is 1.

    places : (n,), displacement of the circle, x_s, m, in the rotor's coordinates
    """
    size = len(places)
    relative = np.column_stack([np.eye(size), -places])
    names = ("keep", "pull", "inverse", "mass", "stiffness", "damping", "push")
    plain = {name: np.zeros((size + 1, size + 1)) for name in names}
    for name in names:
        plain[name][:size, :size] = getattr(body, name)  # stored transposed
    for name in ("stiffness", "push"):
        plain[name] = relative.T @ getattr(body, name) @ relative
    plain["pull"][size, :size] = -places @ body.pull
    placed = body.stand, body.radial, body.tangential, body.centre
    return DenseBody._make([*(plain[name] for name in names), *placed])
