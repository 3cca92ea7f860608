"""Two bodies in the loop of `kernels.bodies`: what schemes of that kind share."""

from __future__ import annotations

import numpy as np

from hpcwhirl.case.unbalance import share_at_start, steady_at
from hpcwhirl.dynamics.casing_trace import waves_of_modes
from hpcwhirl.dynamics.kernels.bodies import energies_of, march_bodies
from hpcwhirl.dynamics.kernels.contact import PULSE
from hpcwhirl.dynamics.kernels.kernel_types import Arrays, BodiesState, CoupledBody
from hpcwhirl.dynamics.schemes.integrator import (
    Balance,
    Floats,
    Integrator,
    nothing_yet,
    reader,
    unfold,
)
from hpcwhirl.dynamics.unbalance import amplitudes_at_start
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene


def _bodies(model: Model, scene: Scene, arrays: Arrays) -> BodiesState:
    """Return the kernel's state with rotor and casing at rest."""
    own, casing = arrays.rotor, len(arrays.casing.keep)
    rotor = int(own.starts[-1]) if isinstance(own, CoupledBody) else len(own.keep)
    gaps = np.full(model.blades, scene.gap)
    return BodiesState(
        np.zeros(rotor), np.zeros(rotor), np.zeros(casing), np.zeros(casing),
        np.zeros(rotor), np.zeros(max(casing, 1)), gaps, gaps.copy(),
        *nothing_yet(model.blades),
    )  # fmt: skip


def started(
    whole: Integrator, model: Model, scene: Scene, own: Floats, rises: Floats
) -> Integrator:
    """Return the integrator of an unbalanced rotor with its state at the start.

    The rotor starts on its circle, or on a share of it. In the latter case the energy
    of its motion about the circle is entered in the ledger as work of the loading.

    Parameters
    ----------
    whole : integrator at rest; its arrays have the coordinates of `dynamics.unbalance`
    model, scene : what it integrates
    own, rises : (m,), initial values of the other coordinates, in those of the kernel,
        and their increments in the step before
    """
    state, m, share = whole.state, len(own), share_at_start(model, scene)
    state.q_b[:m], state.d_b[:m] = own, rises
    state.q_b[m:], state.d_b[m:] = amplitudes_at_start(len(state.q_b) - m, scene)
    for gaps in (state.gaps, state.older):
        gaps[:] = (
            scene.gap - share * steady_at(model, scene, 0.0)[0 : 2 * model.blades : 2]
        )
    if share < 1.0:
        state.ledger[PULSE] = whole.balance(state).energy
    return whole


def two_bodies(model: Model, scene: Scene, arrays: Arrays) -> Integrator:
    """Return the integrator of two bodies as modes by `kernels.bodies.march_bodies`.

    Schemes replace its fields where they differ.
    """
    step = scene.solver.time_step

    def balance(state: BodiesState) -> Balance:
        energy = sum(energies_of(arrays.rotor, arrays.casing, state, step))
        return Balance(energy, float(state.loss_b.sum() + state.loss_c.sum()))

    return Integrator(
        kernel=march_bodies,
        arrays=arrays,
        state=_bodies(model, scene, arrays),
        balance=balance,
        displacements=lambda s, _: unfold(model, s.q_b, s.q_c),
        casing_width=len(arrays.casing.keep),
        casing_waves=reader(model, scene, lambda q, _: waves_of_modes(model, q)),
    )
