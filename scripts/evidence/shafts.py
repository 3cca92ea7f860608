"""Do shaft lines have ROSS's roots? Ten public rotors, read from files that ROSS saved.

    python -m venv ross; ross/bin/pip install ross-rotordynamics 'plotly<6'
    python scripts/evidence/shafts.py ross/bin/python

Each rotor is saved by ROSS (`ross_rotors.py`) and read as `engine.shaft` reads it, with
bearings that differ by direction; of its lowest roots s at three speeds the largest
difference from ROSS's nearest root, relative to |s|, is printed. Exits 1 beyond 1e-4.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import parser_of

from hpcwhirl.arrays import Complexes
from hpcwhirl.reduction.shaft_whirl import held_by, whirls
from hpcwhirl.scene.shaft_tables import KEPT, parsed, text_of
from hpcwhirl.structure.shaft import line_of

LOWEST = 12  # roots compared at each speed, two for each mode
TOLERANCE = 1e-4


def roots_of(path: Path, speed: float) -> Complexes:
    """Return the lowest roots of the rotor in a file, 1/s."""
    line = line_of(text_of(parsed(path), path.name, KEPT))
    found = whirls(line, held_by(line), speed)
    return np.array([whirl.root for whirl in found[:LOWEST]])


def main() -> int:
    """Compare all rotors, print a table; return the exit status."""
    parser = parser_of(__doc__)
    parser.add_argument("python", help="of an environment with ross-rotordynamics")
    python = parser.parse_args().python
    script = Path(__file__).with_name("ross_rotors.py")
    worst = 0.0
    with tempfile.TemporaryDirectory() as folder:
        told = subprocess.run(
            [python, str(script), folder], check=True, capture_output=True
        ).stdout
        document = json.loads(told[told.index(b"{") :])
        print(f"| rotor | roots | largest difference from ROSS {document['version']} |")
        print("|---|---|---|")
        for name, own in document["rotors"].items():
            misses = []
            for speed, theirs in own["roots"].items():
                known = np.array([complex(*root) for root in theirs])
                ours = roots_of(Path(own["file"]), float(speed))
                away = np.abs(ours[:, None] - known).min(axis=1)
                misses += (away / np.abs(ours)).tolist()
            worst = max(worst, *misses)
            print(f"| {name} | {len(misses)} | {max(misses):.1e} |")
    return int(worst > TOLERANCE)


if __name__ == "__main__":
    sys.exit(main())
