"""What a user would write instead, on the same engine and the same first milliseconds.

    python scripts/cost/baselines.py [MILLISECONDS]

Three integrators of Table 2's case: NumPy on dense matrices, Numba on dense matrices
with BLAS, and SciPy's `solve_ivp` on modes with a penalty spring for the contact. The
first two are Algorithm 1 with a fixed step and end with the contact impulse of `modal`;
the third is another law of contact and is shown with what it finds. Prints processor
seconds for a second of engine time, and the ratio to `modal`, measured in one run.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numba import njit
from numba.extending import register_jitable
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.march import March
from hpcwhirl.reduction.bodies import tip_rows
from hpcwhirl.reduction.model import Model
from hpcwhirl.reduction.modes import ModalModel
from hpcwhirl.scene import Scene, apply_settings, named_scene

Floats = NDArray[np.float64]
PENALTY = 1e9  # N/m


@dataclass(frozen=True)
class Case:
    """One case and both bodies as one: displacements (rotor, ring)."""

    scene: Scene
    model: Model
    steps: int

    @property
    def bodies(self) -> tuple[ModalModel, ModalModel]:
        """Rotor and ring."""
        assert self.model.casing is not None  # noqa: S101 - Table 2 has a ring
        return self.model.rotor, self.model.casing

    def load(self) -> Floats:
        """Return the ring's load of a unit modal force."""
        assert self.model.ring is not None  # noqa: S101
        return -self.model.ring.lobes(self.scene.nodal_diameter)

    def pulse(self, t: float) -> float:
        """Return F(t), N."""
        inside = 0 < t < self.scene.pulse
        force = self.scene.force * np.sin(np.pi * t / self.scene.pulse)
        return float(force) if inside else 0.0

    def rows(self, t: float) -> tuple[Floats, Floats]:
        """Return radial and tangential rows (N, n) of the ring at the blades."""
        assert self.model.ring is not None  # noqa: S101
        angles = self.scene.speed * t + 2 * np.pi * np.arange(22) / 22
        return self.model.ring.rows(angles)


def dense_operators(case: Case) -> list[tuple[Floats, Floats, Floats]]:
    """Return (A x_n, A x_{n-1}, A f) matrices of both bodies."""
    step, out = case.scene.solver.time_step, []
    for body in case.bodies:
        damping = body.damping_matrix()
        left = body.mass / step**2 + damping / (2 * step)
        left = np.linalg.solve(left, np.eye(len(left)))
        now = left @ (2 * body.mass / step**2 - body.stiffness)
        before = -left @ (body.mass / step**2 - damping / (2 * step))
        out.append((now, before, left))
    return out


@register_jitable
def complementarity(gaps: Floats, w: Floats) -> Floats:
    """Return multipliers by exchanging until none is wrong."""
    active = gaps < 0
    lam = np.zeros(len(gaps))
    for _ in range(50):
        own = np.flatnonzero(active)
        lam[:] = 0.0
        lam[own] = np.linalg.solve(w[own][:, own], -gaps[own])
        after = gaps + w @ lam
        wrong = (active & (lam < 0)) | (~active & (after < -1e-18))
        if not wrong.any():
            break
        active = active ^ wrong
    return lam


def dense_steps(  # noqa: PLR0913, PLR0917
    steps, step, omega, mu, gap, force, tau, load, rotor, ring, harmonics
):
    """March with dense matrices, by NumPy or compiled; return the contact impulse."""
    a_b, c_b, l_b = rotor
    a_c, c_c, l_c = ring
    x_b, y_b = np.zeros(len(a_b)), np.zeros(len(a_b))
    x_c, y_c = np.zeros(len(a_c)), np.zeros(len(a_c))
    wide, orders = 2 * harmonics + 1, np.arange(1, harmonics + 1)
    places = 2 * np.pi * np.arange(22) / 22
    waves, impulse = np.ones((22, wide)), 0.0
    for n in range(steps):
        z_b = a_b @ x_b + c_b @ y_b
        z_c = a_c @ x_c + c_c @ y_c
        if 0 < n * step < tau:
            z_c += l_c @ (load * (force * np.sin(np.pi * n * step / tau)))
        phases = np.outer(omega * (n + 1) * step + places, orders)
        waves[:, 1::2] = np.cos(phases)
        waves[:, 2::2] = np.sin(phases)
        gaps = gap + waves @ z_c[:wide] - z_b[0:44:2]
        if gaps.min() < 0:
            push, tips = np.zeros((len(z_c), 22)), np.zeros((len(z_b), 22))
            push[:wide], push[wide:] = waves.T, mu * waves.T
            for j in range(22):
                tips[2 * j, j], tips[2 * j + 1, j] = -1.0, -mu
            moved_c, moved_b = l_c @ push, l_b @ tips
            w = waves @ moved_c[:wide] - moved_b[0:44:2]
            lam = complementarity(gaps, w)
            z_b += moved_b @ lam
            z_c += moved_c @ lam
            impulse += step * lam.sum()
        y_b, x_b, y_c, x_c = x_b, z_b, x_c, z_c
    return impulse


def dense(march: Callable[..., float], case: Case) -> float:
    """March by `dense_steps`, plain or compiled; return the contact impulse, N s."""
    scene = case.scene
    given = (scene.solver.time_step, scene.speed, scene.friction, scene.gap,
             scene.force, scene.pulse, case.load())  # fmt: skip
    matrices = dense_operators(case)
    return float(march(case.steps, *given, *matrices, scene.engine.casing.harmonics))


def penalty(case: Case) -> float:
    """Integrate modes with a penalty spring by RK45; return the contact impulse."""
    rotor, ring = case.bodies
    radial, along = tip_rows(rotor, 22)
    m, n = len(rotor.omega), len(ring.omega)
    stiff = np.r_[rotor.omega, ring.omega] ** 2
    drag = 2 * np.r_[rotor.damping * rotor.omega, ring.damping * ring.omega]
    load, mu = case.load() @ ring.shapes, case.scene.friction

    def slope(t: float, y: Floats) -> Floats:
        q, v = y[: m + n], y[m + n : 2 * (m + n)]
        out, around = (rows @ ring.shapes for rows in case.rows(t))
        gaps = case.scene.gap + out @ q[m:] - radial @ q[:m]
        lam = PENALTY * np.maximum(-gaps, 0.0)
        force = -stiff * q - drag * v
        force[:m] -= lam @ (radial + mu * along)
        force[m:] += lam @ (out + mu * around) + load * case.pulse(t)
        return np.r_[v, force, lam.sum()]

    end = case.steps * case.scene.solver.time_step
    start = np.zeros(2 * (m + n) + 1)
    found = solve_ivp(slope, (0.0, end), start, rtol=1e-6, atol=1e-9)
    return float(found.y[-1, -1])


def modal(case: Case) -> float:
    """March with scheme `modal`; return the contact impulse, N s."""
    march = March(resolve(case.scene))
    march.advance(case.steps)
    return float(march.state.impulse.sum())


def main() -> int:
    """Run all four after one another and print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("milliseconds", nargs="?", type=float, default=5.0)
    milliseconds = parser.parse_args().milliseconds
    scene = apply_settings(
        named_scene("mostly_damped"),
        {"duration": 1e-3 * milliseconds, "traces": "summary", "interval": 1e-3},
    )
    steps = round(scene.duration / scene.solver.time_step)
    case = Case(scene, resolve(scene).model, steps)
    compiled = njit(dense_steps)
    modal(case)  # compile
    dense(compiled, replace(case, steps=1))
    seconds: dict[str, float] = {}
    whose: dict[str, Callable[[Case], float]] = {
        "modal": modal, "NumPy, dense": partial(dense, dense_steps),
        "Numba with BLAS, dense": partial(dense, compiled),
        "solve_ivp, penalty": penalty,
    }  # fmt: skip
    print(f"{milliseconds:g} ms of Table 2, {scene.speed:g} rad/s, {steps} steps")
    for name, integrate in whose.items():
        start = time.process_time()
        impulse = integrate(case)
        seconds[name] = time.process_time() - start
        each = seconds[name] / scene.duration
        ratio = seconds[name] / seconds["modal"]
        print(f"{name:24s} {each:10.3g} s a second, {ratio:8.1f} times modal, "
              f"contact impulse {impulse:.6g} N s")  # fmt: skip
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
