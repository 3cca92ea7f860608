"""Modal amplitudes q_k by nodal diameter and family (Sec. 4.2), from stored traces.

Traces of tips and centre give two or three signals per nodal diameter, which has more
modes than that. So mode shapes do not suffice to separate 1F from 2F, but frequencies
do. At each frequency, of all modal amplitudes that reproduce the traces exactly, those
with the least modal forces are taken,

    min sum_i |Q_i / H_i|^2  with  sum_i phi_i Q_i = Y,
    H_i(omega) = 1 / (omega_i^2 - omega^2 + 2 i xi omega_i omega),

with phi_i the shape of mode i, Q_i its amplitude, H_i its transfer function, Y the
Fourier transform of the signals; so a spectral line near omega_i is attributed to mode
i. The signals are mirrored at their end, since a jump from the end to the beginning
would contain all frequencies; the last milliseconds are less certain.
"""

from __future__ import annotations

import numpy as np

from hpcwhirl.arrays import Complexes, Floats
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.bodies import centre_rows, tip_rows
from hpcwhirl.reduction.families import UNKNOWN, family_ranks
from hpcwhirl.reduction.model import Model

LEAST = 1e-9  # singular value, relative to the largest, of linearly dependent signals


def contributions(
    tips: Floats, centre: Floats, interval: float, model: Model, k: int
) -> Complexes:
    """Return the amplitudes of all rotor modes of nodal diameter k over time.

    Parameters
    ----------
    tips : (n, N, 2), m, rotating frame: radial, tangential
    centre : (n, 2), m, ROTATING frame: x_o, y_o
    interval : s, between samples
    model : model with a cyclic rotor of N >= 3 blades
    k : nodal diameter, 0 .. N // 2

    Returns
    -------
    (n, modes of k), m sqrt(kg), by frequency: q = q_0 + i q_1 of the two phases of a
    double mode, mass-orthonormal; |q| is the amplitude of the wave. Real for a simple
    harmonic (k = 0, N / 2)
    """
    _check(tips, model)
    blades, body = model.blades, model.rotor
    modes = np.flatnonzero((body.diameter == k) & (body.phase == 0))
    modes = modes[np.argsort(body.rank[modes])]
    wave = np.exp(-2j * np.pi * k * np.arange(blades) / blades) / blades
    signals = [tips[:, :, a] @ wave for a in range(2)]
    rows = [wave @ shapes[:, modes] for shapes in tip_rows(body, blades)]
    if k == 1:  # x_o + i y_o = conj(z_o), Eq. (11)
        signals.append(centre[:, 0] - 1j * centre[:, 1])
        hub = centre_rows(body, blades)[:, modes]
        rows.append(hub[0] - 1j * hub[1])
    q = _least_forces(
        np.array(signals),
        np.array(rows),
        body.omega[modes],
        body.ratios[modes],
        interval,
    )
    return q.real.astype(np.complex128) if 2 * k % blades == 0 else q


def _check(tips: Floats, model: Model) -> None:
    if not model.rotor.cyclic or model.blades < 3:
        raise InputError("modal contributions need a rotor of 3 or more equal sectors")
    if tips.ndim != 3 or tips.shape[1:] != (model.blades, 2):
        raise InputError(f"tips must be (n, {model.blades}, 2), got {tips.shape}")


def _least_forces(
    signals: Complexes, rows: Complexes, omega: Floats, ratios: Floats, interval: float
) -> Complexes:
    """Return modal amplitudes over time, (n, m), from signals of tips and centre.

    Of all amplitudes that give the signals they are those with the least modal forces.

    Parameters
    ----------
    signals : (r, n), r signals at n times
    rows : (r, m), value of each signal for a unit amplitude of each of m modes
    omega, ratios : (m,), rad/s, natural frequencies; damping ratios
    interval : s, between samples
    """
    count = signals.shape[1]
    signals = np.hstack([signals, signals[:, ::-1]])
    at = 2 * np.pi * np.fft.fftfreq(2 * count, interval)[:, None]
    gain = 1.0 / np.abs(omega**2 - at**2 + 2j * ratios * omega * at)
    gain /= gain.max(axis=1, keepdims=True)
    lines = np.fft.fft(signals, axis=1).T
    inverse = np.linalg.pinv(rows[None] * gain[:, None, :], rcond=LEAST)
    amplitude = gain * np.einsum("fmr,fr->fm", inverse, lines)
    return np.asarray(np.fft.ifft(amplitude, axis=0)[:count])


def family_amplitudes(
    tips: Floats, centre: Floats, interval: float, model: Model
) -> dict[str, Floats]:
    """Return modal amplitudes over time of the families 1F, 2F and suspension.

    Returns {family: (n, N // 2 + 1), m sqrt(kg)}, |q_k| at n times, a column for each
    nodal diameter k; parameters are those of `contributions`. For a simple harmonic, a
    standing wave, the value is (q^2 + (q'/omega)^2)^(1/2). Columns of diameters at
    which a family has no mode (for the suspension, all but k = 1) are 0; NaN if the
    families of the rotor's modes are unknown.
    """
    diameters = model.blades // 2 + 1
    out = {n: np.zeros((len(tips), diameters)) for n in ("1F", "2F", "suspension")}
    for k in range(diameters):
        q = contributions(tips, centre, interval, model, k)
        if 2 * k % model.blades == 0 and len(q) > 1:
            omega = np.sort(model.rotor.omega[model.rotor.diameter == k])
            q = q.real + 1j * np.gradient(q.real, interval, axis=0) / omega
        amplitude = np.abs(q)
        for rank, name in family_ranks(model.rotor, k).items():
            if name == UNKNOWN:
                for columns in out.values():
                    columns[:, k] = np.nan
            if name in out and rank < amplitude.shape[1]:
                out[name][:, k] = amplitude[:, rank]
    return out
