"""Identify the bladed disk's sections from the frequencies the paper prints.

Bounded least squares over blade and disk; prints the residual of every target and
the sections found, which are the defaults of every engine. The paper gives
the targets; it gives none of the sections.
"""

from __future__ import annotations

import argparse

import numpy as np
from scipy.optimize import least_squares

from hpcwhirl.reduction.modes import modal_model
from hpcwhirl.scene import Rotor
from hpcwhirl.structure import blade_stiffness, bladed_disk

# name, target, weight as the relative error that counts as one
TARGETS = [
    ("1F k=0, Hz", 41.66, 1e-3), ("1F k=1, Hz", 40.84, 7e-4),
    ("1F k=3, Hz", 42.02, 1e-3), ("1F k=4, Hz", 42.01, 1e-3),
    ("suspension, Hz", 102.3, 1e-3), ("2F k=0, Hz", 240.0, 6e-3),
    ("2F k=3, Hz", 240.0, 1e-2), ("2F k=1, Hz", 250.0, 5e-3),
    ("k_blade, N/m", 6.8e4, 1e-3),
]  # fmt: skip
# name, start, lower and upper bound, m (taper: -)
UNKNOWNS = [
    ("disk_radius", 0.0397, 0.03, 0.15), ("blade_width", 0.1347, 0.05, 0.30),
    ("root_thickness", 0.0104, 0.005, 0.02), ("taper", 0.78, 0.4, 1.0),
    ("spoke_width", 0.00526, 0.002, 0.10), ("spoke_thickness", 0.0483, 0.01, 0.10),
    ("rim_width", 0.9615, 0.05, 1.0), ("rim_thickness", 0.00765, 0.003, 0.05),
]  # fmt: skip
PRIOR = 0.3  # weight of one relative unit away from the start: pins what is free


def rotor_of(values: np.ndarray) -> Rotor:
    """Return the rotor with these sections."""
    names = [name for name, *_ in UNKNOWNS]
    return Rotor(**{n: float(v) for n, v in zip(names, values, strict=True)})


def computed(rotor: Rotor) -> np.ndarray:
    """Return the targets' values for a rotor."""
    model = modal_model(bladed_disk(rotor), rotor.damping, 110)
    hertz = model.omega / (2 * np.pi)

    def line(k: int, rank: int) -> float:
        pick = (model.diameter == k) & (model.rank == rank) & (model.phase == 0)
        return float(hertz[pick][0])

    first = [line(k, 0) for k in (0, 1, 3, 4)]
    rest = [line(1, 1), line(0, 1), line(3, 1), line(1, 2), blade_stiffness(rotor)]
    return np.array(first + rest)


def main() -> None:
    """Fit and print sections and residuals."""
    argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0]).parse_args()
    start = np.array([s for _, s, _, _ in UNKNOWNS])
    lower = np.array([b for _, _, b, _ in UNKNOWNS]) / start
    upper = np.array([b for _, _, _, b in UNKNOWNS]) / start
    target = np.array([t for _, t, _ in TARGETS])
    weight = np.array([w for _, _, w in TARGETS])

    def residual(scale: np.ndarray) -> np.ndarray:
        miss = (computed(rotor_of(scale * start)) / target - 1) / weight
        return np.concatenate([miss, PRIOR * (scale - 1)])

    fit = least_squares(residual, np.ones_like(start), bounds=(lower, upper))
    found = fit.x * start
    found = np.array([float(f"{v:.5g}") for v in found])  # as written in the inputs
    for (name, *_), value in zip(UNKNOWNS, found, strict=True):
        print(f"{name:16s} {value:.5g}")
    for (name, want, _), got in zip(TARGETS, computed(rotor_of(found)), strict=True):
        print(
            f"{name:16s} paper {want:10.5g}  found {got:10.5g}  {got / want - 1:+.3%}"
        )


if __name__ == "__main__":
    main()
