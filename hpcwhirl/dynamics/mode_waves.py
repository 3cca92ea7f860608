"""Kernel arrays of rotors of unequal sectors, and their modes as waves.

Modes that rotation does not couple are integrated as waves by `kernels.whole`, or as
they are by `kernels.general`; both have the ring by nodal diameter and a constant
Delassus matrix.

The two roots of central differences of a mode of frequency omega and damping ratio xi,

s^2 (1 - dt^2 omega^2/4) + 2 xi omega s + omega^2 = 0,  z = (1 + s dt/2)/(1 - s dt/2),

are a conjugate pair. The mode's wave is a complex amplitude a that a free step
multiplies by z; the mode's amplitude is q = Re(a), and its increment d = q_n - q_{n-1}
= Re(rise a), rise = 1 - 1/z. A modal force f adds give f to q and to d at the step's
end. The increments of a free step that ends with a, and of the step before it, have the
sum Re(moves a).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hpcwhirl.arrays import Complexes, Floats
from hpcwhirl.dynamics.kernels import passes
from hpcwhirl.dynamics.kernels.circulant import folded
from hpcwhirl.dynamics.kernels.cyclic import widths
from hpcwhirl.dynamics.kernels.kernel_types import Arrays
from hpcwhirl.dynamics.kernels.vectors import aligned, all_aligned
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
from hpcwhirl.dynamics.turning_waves import WORST
from hpcwhirl.dynamics.whole_waves import (
    drift_of,
    opened_by_ring,
    padded_blades,
    reads_of,
)
from hpcwhirl.reduction.bodies import centre_rows, tip_rows
from hpcwhirl.reduction.model import Model
from hpcwhirl.reduction.modes import ModalModel
from hpcwhirl.scene import Scene
from hpcwhirl.scene.rules import NO_BLADE


@dataclass(frozen=True)
class ModeWaves:
    """The m modes of a body as waves of central differences, one for each mode.

    A wave is a complex amplitude a; the mode's amplitude is q = Re(a), its last
    increment d = q_n - q_{n-1}.

    Attributes
    ----------
    step : dt, s
    omega : (m,), rad/s
    ahead : (m,), z - 1: a step without forces multiplies a by z
    give : (m,), (1/dt^2 + xi omega/dt)^-1, change of q and of d in a step by a unit
        modal force
    """

    step: float
    omega: Floats
    ahead: Complexes
    give: Floats

    @property
    def rise(self) -> Complexes:
        """Factors, (m,), that give increments of modes: q_n - q_{n-1} = Re(rise a_n).

        a_n is the wave's complex amplitude at step n, q_n = Re(a_n) that of the mode.
        """
        return np.asarray(self.ahead / (1 + self.ahead))

    @property
    def rates(self) -> Complexes:
        """Factors, (m,), 1/s, that give velocities of modes, Re(rates a_n).

        a_n is the wave's complex amplitude at step n; the velocity is (q_{n+1} -
        q_{n-1}) / 2 dt.
        """
        return np.asarray(self.rise * (2 + self.ahead) / (2 * self.step))

    @property
    def is_basis(self) -> bool:
        """Whether each mode oscillates, with two roots that are not nearly equal.

        If not, its motion cannot be integrated as a wave.
        """
        with np.errstate(divide="ignore", invalid="ignore"):
            apart = np.abs(self.rise.imag) / np.abs(self.rise)
        return bool((apart * WORST > 1.0).all())

    @property
    def moves(self) -> Complexes:
        """Factors, (m,), that give the change of modal amplitudes over two free steps.

        q_{n+1} - q_{n-1} = Re(moves a_{n+1}), with a the wave's amplitude, q the
        mode's.
        """
        return np.asarray(self.rise * (1 + 1 / (1 + self.ahead)))

    def amplitudes(self, q: Floats, moved: Floats, of: Complexes) -> Complexes:
        """Return the waves' complex amplitudes a, (m,), of a motion of the modes.

        They have Re(a) = q and Re(of a) = moved.

        q, moved : (m,), amplitudes of the modes, and their increments or velocities
        of : (m,), factors for the latter: `rise` for increments, `rates` for velocities
        """
        return np.asarray(q + 1j * (of.real * q - moved) / of.imag)

    @property
    def gives(self) -> Complexes:
        """Change of each wave's complex amplitude a by a unit modal force, (m,).

        The force acts in one step; the change is that at its end.
        """
        return self.amplitudes(self.give, self.give, self.rise)

    @property
    def form(self) -> Floats:
        """Coefficients (3, m) of re^2, 2 re im and im^2 of the waves' amplitudes, in J.

        They give the energy of each mode, (d / dt)^2 / 2 + omega^2 q (q - d) / 2, with
        amplitude q and increment d = q_n - q_{n-1}.
        """
        rise, before, stiff = self.rise, 1 / (1 + self.ahead), self.omega**2
        squares = rise.real**2, -rise.real * rise.imag, rise.imag**2
        potential = stiff * before.real, -stiff * before.imag / 2, 0.0 * stiff
        return (np.array(squares) / self.step**2 + np.array(potential)) / 2


def mode_waves(body: ModalModel, step: float) -> ModeWaves:
    """Return the modes of a body as waves of central differences.

    step : dt, s, below the stability limit
    """
    omega, rate = body.omega, body.ratios * body.omega
    stiff = 1 - (omega * step / 2) ** 2
    swing = np.sqrt((omega**2 * stiff - rate**2).astype(np.complex128))
    half = (1j * swing - rate) / stiff * (step / 2)
    _, _, give = recursion(omega, body.ratios, step)
    return ModeWaves(step, omega, np.asarray(2 * half / (1 - half)), give)


def uncoupled_rotor(model: Model, scene: Scene, waves: ModeWaves) -> UncoupledRotor:
    """Return the arrays of `kernels.whole` for a rotor without terms of rotation.

    waves : the rotor's modes as waves
    """
    blades, mu = model.blades, friction_with_sign(scene)
    radial, along = reads_of(model)
    size = -(-len(waves.omega) // (2 * EIGHT)) * 2 * EIGHT

    def padded(rows: Floats) -> Floats:
        extra = size - rows.shape[-1]
        return np.pad(rows, [(0, 0)] * (rows.ndim - 1) + [(0, extra)])

    def parts(values: Complexes) -> Floats:
        return np.concatenate([padded(values.real), padded(values.imag)])

    def contact(rows: Floats, given: Floats) -> Floats:
        extra = padded_blades(blades) - blades
        return np.hstack([padded(rows), np.pad(rows @ given, ((0, 0), (0, extra)))])

    forces = radial + mu * along
    given = waves.give[:, None] * forces.T
    moves = waves.moves
    arrays = (
        parts(waves.ahead), padded(drift_of(radial, waves.ahead)), padded(radial),
        padded(radial), padded(along), padded(centre_rows(model.rotor, blades)),
        padded(np.hypot(radial, along).max(axis=0)), padded(forces), parts(waves.gives),
        np.concatenate([padded(moves.real), padded(-moves.imag)]),
        contact(radial, given), contact(along, given),
        opened_by_ring(model, scene), padded(waves.form),
    )  # fmt: skip
    return UncoupledRotor._make(all_aligned([np.ravel(array) for array in arrays]))


def _items(body: ModalModel, step: float, mu: float, size: int) -> Floats:
    """Return coefficients of a step of a body's modes, (ITEMS, size), for `general`.

    `kernels.passes` names them. The kernel `cyclic` has multipliers by nodal diameter,
    and multiplies them by the tip's displacements RADIAL and SI in a mode; `general`
    has the modal forces themselves, first those of the normal forces, then those of
    friction, divided by mu. So RADIAL and SI are 1 here.

    mu : friction with the sign of the speed
    size : number of modes, with padding
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
    """Return the arrays of a rotor's real, uncoupled modes for kernel `general`."""
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
    """Return the Delassus matrix W, (N, N), m/N, of a rotor and a ring of harmonics.

    Column j has the opening of all gaps in a step due to a unit normal force on blade j
    and its friction.
    """
    w = rotor_compliance(model, scene)
    blades = np.arange(model.blades)
    return w + ring_column(model, scene)[np.subtract.outer(blades, blades)]


def unequal_arrays(
    model: Model, scene: Scene, rotor: GeneralRotor | WholeRotor | UncoupledRotor
) -> Arrays:
    """Return all arrays of the kernel `general`, given those of the rotor.

    rotor : the rotor's arrays: real modes, or waves of coupled or of uncoupled modes
    """
    w, lost = delassus(model, scene), scene.engine.rotor.lost_blade
    if lost != NO_BLADE:
        w[lost] -= rotor_compliance(model, scene)[lost]
    loading, casing = casing_arrays(model, scene)
    contact = GeneralContact(w, *transforms(model.blades))
    return Arrays(loading, rotor, casing, contact)
