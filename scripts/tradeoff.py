"""What a larger time step costs in accuracy, from the campaign jobs/tradeoff.toml.

    mpirun -n 2 hpcwhirl campaign jobs/tradeoff.toml --out DIR
    python scripts/tradeoff.py DIR

Each step is compared with the finest, speed by speed: words that agree, and medians of
the relative difference of numbers where both words agree. The twin says how much of
that is the sensitivity of the motion itself: its force differs by 1e-7.
"""

from __future__ import annotations

import sys

import numpy as np
import xarray

from hpcwhirl import open_results
from hpcwhirl.store.reader import words

NUMBERS = ("orbit_radius", "contact_impulse", "centre_peak")


def named(part: xarray.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Return regime and whirl of each case."""
    return words(part["regime"]), words(part["whirl"])


def difference(part: xarray.Dataset, fine: xarray.Dataset, name: str) -> float:
    """Return the median relative difference of a number from the finest step's."""
    a, b = part[name].to_numpy(), fine[name].to_numpy()
    same = (named(part)[0] == named(fine)[0]) & (np.abs(b) > 0)
    return float(np.median(np.abs(a[same] - b[same]) / np.abs(b[same])))


def main() -> int:
    """Print the table as Markdown."""
    data = open_results(sys.argv[1]).sortby("speed")
    steps, forces = data["time_step"].to_numpy(), data["force"].to_numpy()
    usual = forces.min()
    groups = sorted({*zip(steps, forces, strict=True)})
    fine = data.isel(case=(steps == steps.min()) & (forces == usual))
    print("| step, s | computing a second of engine time, s | regimes as the finest |"
          " whirls | orbit radius | contact impulse | centre's peak |")  # fmt: skip
    print("|---|---|---|---|---|---|---|")
    for step, force in groups[::-1]:
        part = data.isel(case=(steps == step) & (forces == force))
        cost = float(part["seconds"].sum() / part["end_time"].sum())
        (regime, whirl), (regime_f, whirl_f) = named(part), named(fine)
        label = f"{step:g}" + ("" if force == usual else " (twin)")
        errors = [f"{100 * difference(part, fine, name):.2g} %" for name in NUMBERS]
        count = len(regime)
        print(f"| {label} | {cost:.2f} | {np.sum(regime == regime_f)} of {count} | "
              f"{np.sum(whirl == whirl_f)} of {count} | " + " | ".join(errors) + " |"
        )  # fmt: skip
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
