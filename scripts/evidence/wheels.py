#!/usr/bin/env python3
"""Frequencies of imported rotors beside those of all their unknowns.

python scripts/evidence/wheels.py wheel/wheel.toml [wheel/sector.toml]

The first is a whole wheel: its M and K are solved with scipy's eigsh, of any reduction
independent; the rotors of all files are compared with that.
"""

from __future__ import annotations

import argparse
import resource
import time
from pathlib import Path

import numpy as np
from scipy.sparse.linalg import eigsh

from hpcwhirl.cli import main as hpcwhirl
from hpcwhirl.reduction.imported import rotor_from
from hpcwhirl.store.wheel_file import read_wheel

COMPARED = 110  # frequencies of all unknowns
CLOSE = 1e-6


def full(path: Path) -> np.ndarray:
    """Return the lowest frequencies of a whole wheel's M and K, Hz."""
    wheel = read_wheel(path)
    squared = eigsh(
        wheel.stiffness.tocsc(), COMPARED, wheel.mass.tocsc(), sigma=-1e4,
        return_eigenvectors=False,
    )  # fmt: skip
    return np.sqrt(np.maximum(np.sort(squared), 0.0)) / (2 * np.pi)


def imported(path: Path) -> np.ndarray:
    """Return the frequencies of what `import-model` makes of a file, Hz."""
    out, begun = path.with_suffix(".h5"), time.perf_counter()
    if hpcwhirl(["import-model", str(path), "--out", str(out)]):
        raise SystemExit(2)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"{time.perf_counter() - begun:.1f} s, at most {peak:.0f} MiB so far")
    blades = read_wheel(path).blades
    return np.asarray(rotor_from(str(out), blades, 0.0).omega / (2 * np.pi))


def told(name: str, got: np.ndarray, truth: np.ndarray) -> None:
    """Print how far frequencies are from the truth, and up to where they are close."""
    count = min(len(got), len(truth))
    miss = np.abs(got[:count] / truth[:count] - 1)
    far = np.flatnonzero(miss > CLOSE)
    close = int(far[0]) if len(far) else count
    print(f"{name}: {close} of {count} frequencies within {CLOSE:g}")
    for last in (close, count):
        own = miss[:last]
        if last:
            print(
                f"  up to {truth[last - 1]:.5g} Hz the worst is off by {own.max():.1e}"
            )


def compare(path: Path, *others: Path, own: np.ndarray | None = None) -> None:
    """Compare a wheel's rotor, others', and what the code itself computes."""
    truth = full(path)
    if own is not None:
        told("all unknowns, against the code's own frequencies", truth, own)
    for file in (path, *others):
        got = imported(file)
        told(f"rotor of {file.name}, against all unknowns", got, truth)
        if own is not None:
            told("the same, against the code's own frequencies", got, own)


def main() -> None:
    """Compare."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("wheel", type=Path)
    parser.add_argument("others", type=Path, nargs="*")
    args = parser.parse_args()
    compare(args.wheel, *args.others)


if __name__ == "__main__":
    main()
