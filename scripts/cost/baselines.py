"""What a user would write instead, on the same engine and the same first milliseconds.

    python scripts/cost/baselines.py [MILLISECONDS]

Three integrators of Table 2's case: NumPy on dense matrices, Numba on dense matrices
with BLAS, and SciPy's `solve_ivp` on modes with a penalty spring for the contact. The
first two are Algorithm 1 with a fixed step and end with the contact impulse of `modal`;
the third is another law of contact and is shown with what it finds. Prints seconds of
computing for a second of engine time, and the ratio to `modal`, measured in one run.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numba import njit
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


def complementarity(gaps: Floats, w: Floats) -> Floats:
    """Return multipliers by exchanging until none is wrong."""
    active = gaps < 0
    lam = np.zeros(len(gaps))
    for _ in range(50):
        lam[:] = 0.0
        lam[active] = np.linalg.solve(w[np.ix_(active, active)], -gaps[active])
        after = gaps + w @ lam
        wrong = (active & (lam < 0)) | (~active & (after < -1e-18))
        if not wrong.any():
            return lam
        active = active ^ wrong
    return lam


def numpy_dense(case: Case) -> float:
    """March with NumPy; return the contact impulse, N s."""
    step, mu = case.scene.solver.time_step, case.scene.friction
    (a_b, c_b, l_b), (a_c, c_c, l_c) = dense_operators(case)
    x_b, y_b = np.zeros(len(a_b)), np.zeros(len(a_b))
    x_c, y_c = np.zeros(len(a_c)), np.zeros(len(a_c))
    load, impulse = case.load(), 0.0
    for n in range(case.steps):
        z_b = a_b @ x_b + c_b @ y_b
        z_c = a_c @ x_c + c_c @ y_c + l_c @ (load * case.pulse(n * step))
        radial, along = case.rows((n + 1) * step)
        gaps = case.scene.gap + radial @ z_c - z_b[0:44:2]
        if gaps.min() < 0:
            push = (radial + mu * along).T
            tips = np.zeros((len(z_b), 22))
            tips[range(0, 44, 2), range(22)] = -1.0
            tips[range(1, 44, 2), range(22)] = -mu
            w = radial @ l_c @ push - (l_b @ tips)[0:44:2]
            lam = complementarity(gaps, w)
            z_b, z_c = z_b + l_b @ (tips @ lam), z_c + l_c @ (push @ lam)
            impulse += step * lam.sum()
        x_b, y_b, x_c, y_c = z_b, x_b, z_c, x_c
    return impulse


@njit
def _numba_steps(  # noqa: C901, PLR0912, PLR0913, PLR0915, PLR0917
    steps, step, omega, mu, gap, force, tau, load, rotor, ring, harmonics
):
    a_b, c_b, l_b = rotor
    a_c, c_c, l_c = ring
    x_b, y_b = np.zeros(len(a_b)), np.zeros(len(a_b))
    x_c, y_c = np.zeros(len(a_c)), np.zeros(len(a_c))
    wide = 2 * harmonics + 1
    waves, impulse = np.ones((22, wide)), 0.0
    for n in range(steps):
        z_b = a_b @ x_b + c_b @ y_b
        z_c = a_c @ x_c + c_c @ y_c
        if 0 < n * step < tau:
            z_c += l_c @ (load * (force * np.sin(np.pi * n * step / tau)))
        for j in range(22):
            theta = omega * (n + 1) * step + 2 * np.pi * j / 22
            for h in range(1, harmonics + 1):
                waves[j, 2 * h - 1], waves[j, 2 * h] = (
                    np.cos(h * theta),
                    np.sin(h * theta),
                )
        gaps = gap + waves @ z_c[:wide] - z_b[0:44:2]
        if gaps.min() < 0:
            push = np.zeros((len(z_c), 22))
            push[:wide], push[wide:] = waves.T, mu * waves.T
            tips = np.zeros((len(z_b), 22))
            for j in range(22):
                tips[2 * j, j], tips[2 * j + 1, j] = -1.0, -mu
            moved_c, moved_b = l_c @ push, l_b @ tips
            w = waves @ moved_c[:wide] - moved_b[0:44:2]
            active = gaps < 0
            lam = np.zeros(22)
            for _ in range(50):
                where = np.flatnonzero(active)
                small = np.empty((len(where), len(where)))
                for r in range(len(where)):
                    for s in range(len(where)):
                        small[r, s] = w[where[r], where[s]]
                lam[:] = 0.0
                lam[where] = np.linalg.solve(small, -gaps[where])
                after = gaps + w @ lam
                wrong = (active & (lam < 0)) | (~active & (after < -1e-18))
                if not wrong.any():
                    break
                active = active ^ wrong
            z_b += moved_b @ lam
            z_c += moved_c @ lam
            impulse += step * lam.sum()
        y_b, x_b, y_c, x_c = x_b, z_b, x_c, z_c
    return impulse


def numba_dense(case: Case, steps: int | None = None) -> float:
    """March with Numba and BLAS; return the contact impulse, N s."""
    scene = case.scene
    rotor, ring = dense_operators(case)
    return float(
        _numba_steps(
            case.steps if steps is None else steps, scene.solver.time_step,
            scene.speed, scene.friction, scene.gap, scene.force, scene.pulse,
            case.load(), rotor, ring, scene.engine.casing.harmonics,
        )
    )  # fmt: skip


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
    modal(case)  # compile
    numba_dense(case, 1)
    seconds: dict[str, float] = {}
    whose: list[tuple[str, Callable[[Case], float]]] = [
        ("modal", modal), ("NumPy, dense", numpy_dense),
        ("Numba with BLAS, dense", numba_dense), ("solve_ivp, penalty", penalty),
    ]  # fmt: skip
    print(f"{milliseconds:g} ms of Table 2, {scene.speed:g} rad/s, {steps} steps")
    for name, integrate in whose:
        start = time.perf_counter()
        impulse = integrate(case)
        seconds[name] = time.perf_counter() - start
        each = seconds[name] / scene.duration
        ratio = seconds[name] / seconds["modal"]
        print(f"{name:24s} {each:10.3g} s a second, {ratio:8.1f} times modal, "
              f"contact impulse {impulse:.6g} N s")  # fmt: skip
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
