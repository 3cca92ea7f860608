"""How the two rings differ: bending frequencies, and the Delassus matrix on the way.

    python scripts/evidence/rings.py

The Delassus matrix of a step is what a unit multiplier on one blade opens at all
blades. The ring of harmonics makes it constant; on the ring of elements it depends on
where between two nodes the blades stand.
"""

from __future__ import annotations

import argparse

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.operators import contact_operators, friction_with_sign
from hpcwhirl.dynamics.timestep import recursion
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene, apply_settings, named_scene

Floats = NDArray[np.float64]
PLACES = 21  # of the blades between two nodes


def delassus(scene: Scene, model: Model, turned: float) -> Floats:
    """Return W (N, N), m/N, of both bodies with blade 0 at the angle `turned`."""
    casing, ring = model.casing, model.ring
    if casing is None or ring is None:
        msg = "a rigid casing has no Delassus matrix"
        raise ValueError(msg)
    angles = turned + 2 * np.pi * np.arange(model.blades) / model.blades
    radial, along = (rows @ casing.shapes for rows in ring.rows(angles))
    _, _, give = recursion(casing.omega, casing.ratios, scene.solver.time_step)
    mu = friction_with_sign(scene)
    return (
        contact_operators(model, scene)[0] + (radial * give) @ (radial + mu * along).T
    )


def main() -> None:
    """Print both comparisons for Table 2's engine."""
    argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0]).parse_args()
    base = named_scene("mostly_damped")
    scenes = {
        name: apply_settings(base, {"discretization": name})
        for name in ("fourier", "elements")
    }
    models = {name: resolve(scene).model for name, scene in scenes.items()}
    print("harmonic   bending, Hz: harmonics   elements   apart")
    for h in (1, 2, 4, 8, 12, 16, 20):
        hertz = []
        for model in models.values():
            casing = model.casing
            own = casing.omega[casing.diameter == h]  # type: ignore[union-attr]
            hertz.append(float(own.min()) / (2 * np.pi))
        print(
            f"{h:8d} {hertz[0]:22.3f} {hertz[1]:10.3f} {hertz[1] / hertz[0] - 1:8.3%}"
        )
    span = 2 * np.pi / scenes["elements"].engine.casing.elements
    print("W between blades     harmonics, m/N   elements over a passing, m/N")
    for apart in range(4):
        one = delassus(scenes["fourier"], models["fourier"], 0.0)[apart, 0]
        many = [
            delassus(scenes["elements"], models["elements"], part * span)[apart, 0]
            for part in np.linspace(0.0, 1.0, PLACES)
        ]
        print(f"{apart:16d} {one:20.4g} {min(many):16.4g} ... {max(many):.4g}")
    drift = max(
        np.abs(
            delassus(scenes["fourier"], models["fourier"], part * span)
            - delassus(scenes["fourier"], models["fourier"], 0.0)
        ).max()
        for part in np.linspace(0.0, 1.0, PLACES)
    )
    print(f"harmonics: W changes by {drift:.1e} m/N over a passing")


if __name__ == "__main__":
    main()
