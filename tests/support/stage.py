"""A small stage of a file: blades with several contact points on a disk and a shaft."""

import numpy as np
import scipy.linalg

N = 5
STATIONS = np.array([-0.03, 0.005, 0.04])
ANGLES = np.array([-0.04, 0.0, 0.05])
GAPS = np.array([2e-5, 0.0, 1e-5])
SHAFT = 3.0e6  # N/m


def axes(angles):
    """Return the radial and tangential direction at angles, (n, 2, 2)."""
    c, s = np.cos(angles), np.sin(angles)
    return np.stack([np.stack([c, s], -1), np.stack([-s, c], -1)], axis=1)


def rotor(stations=STATIONS, angles=ANGLES, gaps=GAPS, seed=3):
    """Return {name: array} of a rotor of N blades of rigidity that couples its points.

    A tip's points are masses held to a rigid disk, and to one another along the chord;
    the disk's centre stands on two springs.
    """
    random, points = np.random.default_rng(seed), len(stations)
    size = 2 * N * points + 2
    turned = 2 * np.pi * np.arange(N)[:, None] / N + angles
    relative = np.eye(size)
    relative[:-2, -2:] = -axes(turned.ravel()).reshape(-1, 2)
    held = np.diag([2.0e5, 6.0e4] * points)
    for a in range(2 * points - 2):  # neighbours, by direction
        link = np.zeros(2 * points)
        link[[a, a + 2]] = 1.0, -1.0
        held += 4.0e5 * np.outer(link, link)
    mixed = random.normal(size=held.shape)
    held += 2.0e3 * mixed @ mixed.T
    stiffness = np.zeros((size, size))
    stiffness[-2:, -2:] = SHAFT * np.eye(2)
    for j in range(N):
        own = slice(2 * points * j, 2 * points * (j + 1))
        stiffness[own, own] = held
    mass = np.diag([0.3, 0.3] * (N * points) + [12.0, 12.0])
    stiffness = relative.T @ stiffness @ relative
    rows = np.arange(2 * N * points).reshape(N, points, 2)
    omega, shapes = modes(mass, stiffness)
    damping = (mass @ shapes * (2 * 0.01 * omega)) @ (mass @ shapes).T
    return {
        "mass": mass,
        "stiffness": stiffness,
        "damping": damping,
        "tip_radial": rows[:, :, 0],
        "tip_tangential": rows[:, :, 1],
        "centre": np.array([size - 2, size - 1]),
        "tip_station": np.asarray(stations, dtype=float),
        "tip_angle": np.asarray(angles, dtype=float),
        "tip_gap": np.asarray(gaps, dtype=float),
    }


def modes(mass, stiffness):
    """Return frequencies and mass-orthonormal shapes."""
    squared, shapes = scipy.linalg.eigh(stiffness, mass)
    return np.sqrt(np.maximum(squared, 0.0)), shapes


def turning(arrays):
    """Return the arrays with terms of rotation of free masses, and a stiffening."""
    mass, size = arrays["mass"], len(arrays["mass"])
    coriolis = np.zeros((size, size))
    radial, along = (arrays[f"tip_{name}"].ravel() for name in ("radial", "tangential"))
    coriolis[along, radial] = np.diag(mass)[radial]
    x, y = arrays["centre"]
    coriolis[y, x] = mass[x, x]
    coriolis -= coriolis.T
    load = np.zeros(size)
    load[radial] = 0.3 * 0.5
    taut = 1e-7 * arrays["stiffness"]
    taut[[x, y], [x, y]] -= 1e-7 * SHAFT
    return arrays | {
        "coriolis": coriolis,
        "centrifugal_load": load,
        "stress_stiffness": taut,
        "softening": mass.copy(),
        "centre_damping": np.array([300.0]),
    }


def by_modes(arrays):
    """Return the same rotor as a file of modes alone has it."""
    omega, shapes = modes(arrays["mass"], arrays["stiffness"])
    places = ("tip_station", "tip_angle", "tip_gap")
    return {
        "omega": omega,
        "damping_ratio": np.full(len(omega), 0.01),
        "modal_tip_radial": shapes[arrays["tip_radial"]],
        "modal_tip_tangential": shapes[arrays["tip_tangential"]],
        "modal_centre": shapes[arrays["centre"]],
    } | {name: arrays[name] for name in places if name in arrays}
