#!/usr/bin/env python3
"""Frequencies of imported rotors beside those of all their unknowns.

    python jobs/wheel.py wheel
    python scripts/evidence/wheels.py wheel/wheel.toml wheel/sector.toml

The first file is a whole wheel: its M and K are solved with SciPy's eigsh, which knows
of no reduction; the rotors of all files are compared with that, for several numbers of
fixed-interface modes.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import time
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from scipy.sparse.linalg import eigsh

from hpcwhirl.cli import main as hpcwhirl
from hpcwhirl.reduction.imported import rotor_from
from hpcwhirl.store.models.wheel_file import read_wheel

COMPARED = 110  # frequencies of all unknowns
MODES = {"wheel": (110, 440), "sector": (110, 440, 880)}
CLOSE = 1e-6
SHIFT = -1e4  # rad^2/s^2: a free wheel can be solved, too
HEAD = (
    "| rotor | modes | s of CPU | compared with | within 1e-6 | up to Hz | worst (of) |"
)


def full(path: Path) -> np.ndarray:
    """Return the lowest frequencies of a whole wheel's M and K, Hz."""
    wheel = read_wheel(path)
    mass, stiffness = wheel.mass.tocsc(), wheel.stiffness.tocsc()
    squared = eigsh(stiffness, COMPARED, mass, sigma=SHIFT, return_eigenvectors=False)
    return np.sqrt(np.maximum(np.sort(squared), 0.0)) / (2 * np.pi)


def imported(path: Path, modes: int) -> tuple[np.ndarray, float]:
    """Return (frequencies, Hz, seconds of CPU) of what a file is reduced to."""
    document = tomllib.loads(path.read_text(encoding="utf-8"))
    table = document[kind_of(document)]
    table["modes"] = modes
    copy = path.with_stem(f"{path.stem}_{modes}")
    copy.write_text(tomli_w.dumps(document), encoding="utf-8")
    out, begun = copy.with_suffix(".h5"), time.process_time()
    with contextlib.redirect_stdout(io.StringIO()):
        if hpcwhirl(["import-model", str(copy), "--out", str(out)]):
            raise SystemExit(2)
    spent = time.process_time() - begun
    omega = rotor_from(str(out), table["blades"], 0.0).omega
    return omega / (2 * np.pi), spent


def kind_of(document: dict[str, Any]) -> str:
    """Return which of the tables wheel and sector a document has."""
    return next(kind for kind in MODES if kind in document)


def told(names: str, got: np.ndarray, truth: np.ndarray) -> None:
    """Print how far frequencies are from the truth, and up to where they are close."""
    count = min(len(got), len(truth))
    miss = np.abs(got[:count] / truth[:count] - 1)
    close = int(np.argmax(np.r_[miss, np.inf] > CLOSE))
    reach = f"{truth[close - 1]:.5g}" if close else "none"
    print(f"| {names} | {close} | {reach} | {miss.max():.1e} ({count}) |", flush=True)


def compare(path: Path, *others: Path, own: np.ndarray | None = None) -> None:
    """Compare a wheel's rotor, others', and what the code itself computes."""
    print(HEAD)
    print("|---" * 7 + "|")
    truth = full(path)
    if own is not None:
        told("all unknowns | | | the code itself", truth, own)
    for file in (path, *others):
        kind = kind_of(tomllib.loads(file.read_text(encoding="utf-8")))
        for modes in MODES[kind]:
            got, spent = imported(file, modes)
            row = f"{file.name} | {modes} | {spent:.1f}"
            told(f"{row} | all unknowns", got, truth)
            if own is not None:
                told(f"{row} | the code itself", got, own)


def main() -> None:
    """Compare."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("wheel", type=Path)
    parser.add_argument("others", type=Path, nargs="*")
    args = parser.parse_args()
    compare(args.wheel, *args.others)


if __name__ == "__main__":
    main()
