"""One case in slices: state, samples, ledger. Phase comes from the step number."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.dynamics.history import LEDGER_TERMS, History
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.operators import friction_with_sign
from hpcwhirl.dynamics.schemes import scheme_of
from hpcwhirl.dynamics.timestep import (
    check_loading,
    check_step,
    check_turn,
    step_counts,
    with_step,
)
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.model import Model, model_of
from hpcwhirl.reduction.numbers import representable
from hpcwhirl.scene import Scene

Floats = NDArray[np.float64]
SLICE_SECONDS = 0.01
FIRST_SLICE = 256  # steps, before the speed of this machine is known
STOPS = {0: "end", 1: "amplitude", 2: "nonfinite", 3: "complementarity"}
MOST_TRACES = 4e9  # bytes of one case's samples, in memory


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
        where the step is at or above a body's stability limit or too long for the
        pulse or the speed, or where there would be more samples than memory holds
    """

    def __init__(self, scene: Scene, model: Model | None = None) -> None:
        self.model = model or model_of(scene)
        self.scene = scene = with_step(scene, self.model)
        check_step(self.model, scene.solver.time_step)
        check_loading(scene)
        check_turn(self.model, scene)
        self.total, self.stride = step_counts(scene)
        self.seconds = 0.0
        self.tracks = self._empty_tracks()
        with representable("the step"):
            self.scheme = scheme_of(self.model, scene)
        self.state = self.scheme.state

    def _empty_tracks(self) -> tuple[Any, ...]:
        samples, blades = self.total // self.stride, self.model.blades
        full = self.scene.output.traces == "full"
        size = 8.0 * samples * (7 + 3 * blades * full)
        if size > MOST_TRACES:
            msg = (
                f"output interval asks for {samples} samples of {size / samples:.0f} "
                f"bytes, allowed {MOST_TRACES / 1e9:g} GB: raise interval"
            )
            raise InputError(msg)
        tips = samples if full else 0
        return (
            np.zeros((samples, 2)),
            *(np.zeros(samples) for _ in range(4)),
            np.zeros((tips, blades, 2)),
            np.zeros((tips, blades)),
            np.zeros(samples),
            np.zeros(contact.CLOSED),
        )

    @property
    def counter(self) -> Any:
        """The kernel's counters: see `contact`."""
        return self.state[-3]

    @property
    def steps(self) -> int:
        """Steps taken so far."""
        return int(self.counter[contact.STEP])

    @property
    def done(self) -> bool:
        """Whether the end, or a reason to stop, has been reached."""
        return self.steps >= self.total or self.counter[contact.STOP] != 0

    def displacements(self) -> tuple[Floats, Floats]:
        """Return rotor (n,) and casing (m,), m, in the model's coordinates."""
        return self.scheme.displacements(self.state, self.steps)

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
        limit = scene.solver.amplitude_limit * scene.engine.rotor.radius
        start = time.perf_counter()
        self.scheme.kernel(
            min(steps, self.total - self.steps),
            self.stride,
            limit,
            scene.solver.time_step,
            scene.speed,
            friction_with_sign(scene),
            shape,
            *self.scheme.arrays,
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

    def history(self) -> History:
        """Return what has been sampled so far; the ledger is that of the last sample.

        The samples end with the last whole output interval.
        """
        count = int(self.counter[contact.SAMPLE])
        centre, energy, impulse, fed, lost, tips, blade_impulse, rubbed, _ = self.tracks
        step = self.scene.solver.time_step
        last = int(self.counter[contact.LAST])
        certified = int(self.counter[contact.CERTIFIED])
        radius = np.hypot(*centre[:count].T)
        return History(
            time=np.arange(1.0, count + 1) * (self.stride * step),
            centre=centre[:count],
            energy=energy[:count],
            impulse=impulse[:count],
            fed=fed[:count],
            friction=rubbed[:count],
            lost=lost[:count],
            tips=tips[:count],
            blade_impulse=blade_impulse[:count],
            ledger=self._closing(),
            gap_error=float(self.state[-2][contact.MISS]),
            step_share=step / min(self.model.limits().values()),
            stop=STOPS[int(self.counter[contact.STOP])],
            steps=self.steps,
            contacts=int(self.counter[contact.TOUCHDOWNS]),
            last_contact=last * step if last >= 0 else -1.0,
            certificate=certified * step if certified >= 0 else -1.0,
            certificate_reach=float(self.state[-2][contact.CERTIFICATE]),
            centre_peak=float(radius.max()) if count else 0.0,
            seconds=self.seconds,
            interval=self.stride * step,
        )

    def _closing(self) -> dict[str, float]:
        """Return the ledger at the present step, energies computed afresh.

        Where that is not finite any more: the ledger of the last sample, which is.
        """
        with np.errstate(all="ignore"):
            now, entries = self.scheme.balance(self.state), self.state[-2]
            impact = entries[contact.IMPACT] + now.impact
            friction = entries[contact.FRICTION] + now.friction
            rotation = entries[contact.ROTATION] + now.rotation
            pulse = entries[contact.PULSE]
            ledger = _ledger(
                [now.energy, now.damping, pulse, impact, friction, rotation]
            )
        return ledger if np.isfinite(ledger["residual"]) else _ledger(self.tracks[-1])


def _ledger(terms: Iterable[float]) -> dict[str, float]:
    """Return terms in the order of `LEDGER_TERMS` with what they leave open, J."""
    energy, damping, pulse, impact, friction, rotation = map(float, terms)
    residual = energy + damping + impact - pulse - friction - rotation
    values = (energy, damping, pulse, impact, friction, rotation, residual)
    return dict(zip(LEDGER_TERMS, values, strict=True))
