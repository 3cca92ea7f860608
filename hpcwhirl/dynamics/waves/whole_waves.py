"""Arrays of `kernels.loop.whole`: unequal sectors that turn, as waves of the whole.

The waves are those of `turning_waves`, but for all sectors at once and in real numbers.
Of the 2 m roots of

[s^2 (1 - dt^2 K/4) + s G + K] Y = 0,  G = D + 2 Omega C,

each conjugate pair gives a wave x = Re(Y a) with a complex amplitude a, each real root
a wave with a real amplitude. The parts q of the amplitudes, (2 m,), are all real parts,
followed by the imaginary parts of the complex ones; in x they are multiplied by Re Y
and -Im Y, respectively. With increments d = x_n - x_{n-1} and d' = x_{n+1} - x_n, a
step is

q' = q* + beta lambda,  d' + d = passing q* + give F lambda,

with q' the amplitudes after the step, lambda the multipliers, q* the amplitudes after a
step without forces, and F the modal forces of the multipliers, which act at the step's
start.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.arrays import Complexes, Floats, Matrix
from hpcwhirl.dynamics.bodies.turning import Terms, step_of, turning_terms
from hpcwhirl.dynamics.kernels.contact import LOOK_EVERY
from hpcwhirl.dynamics.kernels.loop.flight import LESS
from hpcwhirl.dynamics.kernels.vectors import EIGHT
from hpcwhirl.dynamics.waves.turning_waves import WORST, roots_of
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene

CLOSED = 1e-9  # largest relative error of the work of contact


@dataclass(frozen=True)
class WholeWaves:
    """The w waves of a whole rotor with m modes at rest, with 2 m real amplitudes q.

    x are the amplitudes of the modes at rest, d = x_n - x_{n-1} their increments.

    Attributes
    ----------
    step : dt, s
    ahead : (w,), z - 1, z the factor of a wave in a step without forces
    shapes, rises : (m, w), x and d for unit amplitudes
    paired : (w,), whether a wave has a conjugate: amplitudes of others are real
    condition : condition number of `basis`
    give, rate, stiffness, push : (m, m), (1/dt^2 + G/2dt)^-1, D, K(Omega), S, see
        `bodies.turning.Terms`
    """

    step: float
    ahead: Complexes
    shapes: Complexes
    rises: Complexes
    paired: NDArray[np.bool_]
    condition: float
    give: Floats
    rate: Floats
    stiffness: Floats
    push: Floats

    def parts(self, rows: Complexes) -> Floats:
        """Return factors (r, 2 m) of the real amplitudes q, from those of complex ones.

        The product of the result and q, the 2 m real amplitudes of the waves, is
        Re(rows a).

        rows : (r, waves), factors of the complex amplitudes a
        """
        return np.hstack([rows.real, -rows.imag[:, self.paired]])

    @property
    def rates(self) -> Complexes:
        """Velocities (x_{n+1} - x_{n-1}) / 2 dt, (m, waves), for unit amplitudes."""
        return np.asarray(self.rises * (2 + self.ahead) / (2 * self.step))

    @cached_property
    def basis(self) -> Floats:
        """Matrix, (2 m, 2 m), from amplitudes q of waves to a motion (x, d / scale).

        q are the real and imaginary parts of the waves' amplitudes, x the amplitudes of
        the modes at rest, and d their increments since the step before.
        """
        return np.vstack([self.parts(self.shapes), self.parts(self.rises) / self.scale])

    @property
    def scale(self) -> float:
        """Number by which `basis` divides the modes' increments: the largest one."""
        return float(np.abs(self.rises).max())

    @property
    def is_basis(self) -> bool:
        """Whether the waves span the rotor's motion: none nearly coincide."""
        size = sum(1 + self.paired) == 2 * len(self.give)
        return bool(size and self.condition < WORST)

    def amplitudes(self, x: Floats, d: Floats) -> Floats:
        """Return the waves' real amplitudes q, (2 m, ...), in a motion of the modes.

        x, d : (m, ...), modal amplitudes, and their increments in the last step
        """
        return np.linalg.solve(self.basis, np.concatenate([x, d / self.scale]))

    @property
    def before(self) -> Floats:
        """Matrix, (m, 2 m), from q after a free step to modal amplitudes before it.

        q are the 2 m real amplitudes of the waves.
        """
        return self.parts(self.shapes / (1 + self.ahead))

    @property
    def passing(self) -> Floats:
        """Matrix, (m, 2 m), from q after a free step to x_{n+1} - x_{n-1}.

        q are the 2 m real amplitudes of the waves, x the amplitudes of the modes.
        """
        return self.parts(self.rises * (1 + 1 / (1 + self.ahead)))

    @cached_property
    def form(self) -> Floats:
        """Symmetric matrix F, (2 m, 2 m), J: q^T F q is Jacobi's energy.

        q are the 2 m real amplitudes of the waves.
        """
        moved, place = self.parts(self.rises), self.parts(self.shapes)
        twice = moved.T @ moved / self.step**2 + place.T @ self.stiffness @ self.before
        return np.asarray((twice + twice.T) / 4)

    def books(self, reads: Floats) -> bool:
        """Return whether the energy and loss that contact adds equal its work.

        reads : (N, m), displacements on which the multipliers do work; its rows are
            also their modal forces
        """
        rows, _ = self.adds(reads.T)
        apart = rows - reads @ self.passing / 2
        return bool(np.abs(apart).max() < CLOSED * np.abs(rows).max())

    def adds(self, forces: Floats) -> tuple[Floats, Floats]:
        """Return rows (N, 2 m), numbers (N, N), J, of energy and loss added by contact.

        In a step contact adds lambda . (rows q + numbers lambda) to the energy and the
        damping loss together, lambda the multipliers, q after the step without contact.

        forces : (m, N), modal forces of unit multipliers
        """
        more = self.give @ forces
        beta = self.amplitudes(more, more)
        loss = self.rate @ self.passing / (2 * self.step) + self.push @ self.before / 2
        rows = 2 * beta.T @ self.form + more.T @ loss
        numbers = more.T @ self.rate @ more / (4 * self.step)
        return rows, beta.T @ self.form @ beta + numbers


def whole_waves(
    model: Model, scene: Scene, terms: Terms | None = None, blocks: Iterable[Any] = ()
) -> WholeWaves:
    """Return the waves of central differences of a rotor with terms of rotation.

    terms : matrices in the modes at rest; None: those of the model
    blocks : orthonormal combinations (m, c) of modes; the terms do not couple modes of
        different blocks. A complex block stands for its conjugate, too. Empty: one
        block of all modes
    """
    step, shapes = scene.solver.time_step, model.rotor.shapes
    terms = terms or turning_terms(model, scene, shapes)
    own = step_of(terms, step)
    whole = terms.stiffness + terms.push
    matrices = terms.mass - step**2 / 4 * whole, terms.damping + terms.gyro, whole
    parts, moved = [], []
    for block in list(blocks) or [np.eye(len(whole))]:
        back, real = block.conj().T, np.isrealobj(block)
        roots, found = roots_of(*(back @ matrix @ block for matrix in matrices))
        chosen = (roots.imag >= 0.0) | (not real)
        paired = (roots.imag > 0.0) | (not real)
        ahead = roots[chosen] * step / (1 - roots[chosen] * step / 2)
        parts.append(_Part(block, ahead, found[:, chosen], paired[chosen]))
        moved.append((block @ found)[:, chosen].T)
    ahead, paired = (np.concatenate([p[i] for p in parts]) for i in (1, 3))
    found = np.concatenate(moved).T
    rises = found * ahead / (1 + ahead)
    scale = float(np.abs(rises).max())
    return WholeWaves(
        step, ahead, found, rises, paired, _condition(parts, scale),
        own.inverse, own.damping, own.stiffness, own.push,
    )  # fmt: skip


class _Part(NamedTuple):
    """The waves of one block of modes; z is the factor of an amplitude in a step.

    Attributes
    ----------
    block : (m, c), orthonormal combinations of the m modes at rest, see `whole_waves`
    ahead : (waves,), z - 1 of each wave
    shapes : (c, waves), waves of unit amplitudes, as coefficients of the combinations
    paired : (waves,), whether a wave has a conjugate, which is not listed
    """

    block: Any
    ahead: Complexes
    shapes: Complexes
    paired: NDArray[np.bool_]


def _condition(parts: list[_Part], scale: float) -> float:
    """Return the condition number of `WholeWaves.basis`, from the waves of each block.

    In orthonormal coordinates the basis has a part for each block of modes. A complex
    block B with its conjugates gives the modes x = Re(B Y a), |x|^2 = |Y a|^2 / 2, from
    the shapes Y and amplitudes a of its waves.

    parts, scale : the waves of each block; by which the basis divides the increments
    """
    sizes = []
    for block, ahead, shapes, paired in parts:
        both = np.vstack([shapes, shapes * ahead / (1 + ahead) / scale])
        if np.iscomplexobj(block):
            both = both / np.sqrt(2.0)
        else:
            both = np.hstack([both.real, -both.imag[:, paired]])
        sizes.append(np.linalg.svd(both, compute_uv=False))
    every = np.concatenate(sizes)
    least = float(every.min())
    return float(every.max()) / least if least > 0.0 else float("inf")


def drift_of(reads: Matrix, ahead: Complexes) -> Floats:
    """Return a bound of any tip's motion in a step per unit amplitude, (waves,).

    It holds for each of the next `LOOK_EVERY` steps, in which a wave may grow.

    reads, ahead : (N, waves), displacements of the tips for unit amplitudes; (waves,),
        z - 1, z the factor of a wave in a step
    """
    growth = np.maximum(np.abs(1 + ahead), 1.0) ** LOOK_EVERY
    moved = np.abs(reads).max(axis=0) * np.abs(ahead)
    return np.asarray(moved * growth / LESS)


def padded_blades(blades: int) -> int:
    """Return the number of multipliers in the kernel's state: N, padded."""
    return -(-blades // EIGHT) * EIGHT
