"""One case in slices: state, samples, ledger. Phase comes from the step number."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from hpcwhirl.dynamics import kernels
from hpcwhirl.dynamics.history import LEDGER_TERMS, History
from hpcwhirl.dynamics.operators import (
    contact_operators,
    dense_arrays,
    friction_with_sign,
    modal_arrays,
)
from hpcwhirl.dynamics.timestep import check_step
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.model import Model, model_of
from hpcwhirl.scene import Scene

SLICE_SECONDS = 0.01
FIRST_SLICE = 256  # steps, before the speed of this machine is known
STOPS = {0: "end", 1: "amplitude", 2: "nonfinite", 3: "complementarity"}
MOST_SAMPLES = 20_000_000


class March:
    """A case on its way: advance it in slices, then read its history.

    Parameters
    ----------
    scene
        the case
    model
        its model; built from the scene if not given

    Raises
    ------
    InputError
        where the step is at or above a body's stability limit
    """

    def __init__(self, scene: Scene, model: Model | None = None) -> None:
        self.scene = scene
        self.model = model or model_of(scene)
        check_step(self.model, scene.solver.time_step)
        step = scene.solver.time_step
        self.total = max(1, math.ceil(scene.end_time / step - 1e-9))
        self.stride = max(1, round(scene.output.interval / step))
        self.stride = min(self.stride, self.total)
        self.seconds = 0.0
        self._arrays = self._operators()
        self.state = self._rest()
        self.tracks = self._empty_tracks()

    def _operators(self) -> tuple[Any, ...]:
        dense = self.scene.solver.scheme == "paper"
        make = dense_arrays if dense else modal_arrays
        rotor, casing, load = make(self.model, self.scene)
        self._kernel = kernels.march_paper if dense else kernels.march_modal
        return load, rotor, casing, contact_operators(self.model, self.scene)

    def _rest(self) -> tuple[Any, ...]:
        """Return the state at rest; its arrays are all that a resume needs."""
        _, rotor, casing, _ = self._arrays
        blades = self.model.blades
        gaps = np.full(blades, self.scene.gap)
        sizes = (len(rotor[0]), len(rotor[0]), len(casing[0]), len(casing[0]))
        q_b, d_b, q_c, d_c = (np.zeros(n) for n in sizes)
        losses = np.zeros(sizes[0]), np.zeros(sizes[2])
        if len(losses[1]) == 0:
            losses = (losses[0], np.zeros(1))
        counter = np.zeros(5, dtype=np.int64)
        counter[kernels.LAST] = -1
        touching = np.zeros(blades, dtype=np.int64)
        ledger, impulse = np.zeros(5), np.zeros(blades)
        return (q_b, d_b, q_c, d_c, *losses, gaps, gaps.copy(), touching, counter,
                ledger, impulse)  # fmt: skip

    def _empty_tracks(self) -> tuple[Any, ...]:
        samples, blades = self.total // self.stride, self.model.blades
        if samples > MOST_SAMPLES:
            msg = (
                f"output interval asks for {samples} samples, allowed {MOST_SAMPLES}: "
                "raise interval"
            )
            raise InputError(msg)
        tips = samples if self.scene.output.traces == "full" else 0
        return (
            np.zeros((samples, 2)),
            *(np.zeros(samples) for _ in range(4)),
            np.zeros((tips, blades, 2)),
            np.zeros((tips, blades)),
        )

    @property
    def counter(self) -> Any:
        """The kernel's counters: step, touchdowns, last contact, sample, stop."""
        return self.state[9]

    @property
    def steps(self) -> int:
        """Steps taken so far."""
        return int(self.counter[kernels.STEP])

    @property
    def done(self) -> bool:
        """Whether the end, or a reason to stop, has been reached."""
        return self.steps >= self.total or self.counter[kernels.STOP] != 0

    def advance(self, steps: int) -> None:
        """March at most `steps` steps; any cut into slices gives the same bits."""
        scene = self.scene
        casing = scene.engine.casing
        shape = (
            scene.gap,
            scene.nodal_diameter,
            casing.amplitude,
            casing.growth,
            casing.rise,
        )
        load, rotor, body, contact = self._arrays
        limit = scene.solver.amplitude_limit * scene.engine.rotor.radius
        start = time.perf_counter()
        self._kernel(
            min(steps, self.total - self.steps),
            self.stride,
            limit,
            scene.solver.time_step,
            scene.speed,
            friction_with_sign(scene),
            shape,
            load,
            rotor,
            body,
            contact,
            self.state,
            self.tracks,
        )
        self.seconds += time.perf_counter() - start

    def run(self, between_slices: Callable[[], None] | None = None) -> History:
        """March to the end in slices of some 10 ms and return the history."""
        size = FIRST_SLICE
        while not self.done:
            before = time.perf_counter()
            self.advance(size)
            spent = max(time.perf_counter() - before, 1e-6)
            size = int(min(max(size * SLICE_SECONDS / spent, 16), 2 * size))
            if between_slices:
                between_slices()
        return self.history()

    def _ledger(self, energy: float, lost: float) -> dict[str, float]:
        entries = self.state[10]
        impact = float(entries[kernels.IMPACT])
        pulse = float(entries[kernels.PULSE])
        friction = float(entries[kernels.FRICTION])
        rotation = float(entries[kernels.ROTATION])
        residual = energy + lost - pulse - friction - rotation
        values = (energy, lost - impact, pulse, impact, friction, rotation, residual)
        return dict(zip(LEDGER_TERMS, values, strict=True))

    def history(self) -> History:
        """Return what has been sampled so far; the ledger is that of the last sample.

        The samples end with the last whole output interval.
        """
        count = int(self.counter[kernels.SAMPLE])
        centre, energy, impulse, fed, lost, tips, blade_impulse = self.tracks
        step = self.scene.solver.time_step
        last = int(self.counter[kernels.LAST])
        radius = np.hypot(*centre[:count].T)
        return History(
            time=np.arange(1.0, count + 1) * (self.stride * step),
            centre=centre[:count],
            energy=energy[:count],
            impulse=impulse[:count],
            fed=fed[:count],
            lost=lost[:count],
            tips=tips[:count],
            blade_impulse=blade_impulse[:count],
            ledger=self._closing(),
            stop=STOPS[int(self.counter[kernels.STOP])],
            steps=self.steps,
            contacts=int(self.counter[kernels.TOUCHDOWNS]),
            last_contact=last * step if last >= 0 else -1.0,
            centre_peak=float(radius.max()) if count else 0.0,
            seconds=self.seconds,
            interval=self.stride * step,
        )

    def _closing(self) -> dict[str, float]:
        """Return the ledger at the present step, energies computed afresh."""
        _, rotor, casing, _ = self._arrays
        x_b, d_b, x_c, d_c, loss_b, loss_c = self.state[:6]
        step = self.scene.solver.time_step
        if self.scene.solver.scheme == "paper":
            work = np.zeros_like(x_b), np.zeros_like(x_c)
            energy = kernels.dense_energy(x_b, d_b, rotor[3], rotor[4], step, work[0])
            energy += kernels.dense_energy(
                x_c, d_c, casing[3], casing[4], step, work[1]
            )
        else:
            energy = kernels.modal_energy(x_b, d_b, rotor[4], step)
            energy += kernels.modal_energy(x_c, d_c, casing[4], step)
        lost = float(loss_b.sum() + loss_c.sum() + self.state[10][kernels.IMPACT])
        return self._ledger(float(energy), lost)
