"""Draw |Z|(t) of three motions beside the numbers that their words rest on.

    python scripts/pictures/regimes.py [--out .pictures]

The default engine at 520, 410 and 420 rad/s: damped, sustained and divergent. Writes
`regime-WORD.png`; a case that has another word is refused.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

import hpcwhirl
from hpcwhirl.scene.words import REGIMES

SPEEDS = {"damped": 520.0, "sustained": 410.0, "divergent": 420.0}  # rad/s
WINDOW = "#eeeeee"


def case_of(word: str) -> Any:
    """Return the case that shows a word."""
    scene = hpcwhirl.Scene(speed=SPEEDS[word])
    found = hpcwhirl.simulate(scene)
    if found.row["regime"] != word:
        msg = f"{SPEEDS[word]} rad/s is {found.row['regime']}, not {word}"
        raise SystemExit(msg)
    return found


def told(row: Any) -> str:
    """Return the evidence of a case, a line each."""
    lines = [f"growth {row['growth_rate']:+.3g} 1/s in the window"]
    if row["late_contacts"]:
        ratio = row["late_fed"] / row["late_lost"]
        lines.append(f"contact; fed {ratio:.3g} of what is lost")
    else:
        lines.append("no contact in the window")
    if row["certificate"] >= 0:
        lines.append(f"none can recur from {row['certificate']:.2f} s on")
    if row["stop"] == "amplitude":
        lines.append("tips at a tenth of the radius: ended")
    return "\n".join(lines)


def draw(word: str) -> Any:
    """Return the picture of a word."""
    from matplotlib.figure import Figure

    found, look = case_of(word), REGIMES[word]
    row, time = found.row, found.traces["time"]
    radius = np.hypot(*found.traces["centre"].T) / row["gap"]
    figure = Figure(figsize=(4.6, 2.9), layout="constrained")
    axes = figure.subplots()
    axes.axvspan(row["end_time"] - row["window"], row["end_time"], color=WINDOW)
    axes.semilogy(time, radius, color=look.stroke, lw=0.8)
    seen = radius[time > 0.01 * row["end_time"]]
    axes.set_ylim(seen.min() / 3, seen.max() * 3)
    axes.set_xlim(0, row["end_time"])
    axes.axhline(1.0, color="black", lw=0.8, ls=":")
    axes.set(xlabel="time, s", ylabel="|Z| of the centre, gaps")
    axes.set_title(f"{SPEEDS[word]:.0f} rad/s: {word}", fontsize=11)
    low = word == "divergent"
    axes.text(0.97, 0.05 if low else 0.95, told(row), transform=axes.transAxes,
              ha="right", va="bottom" if low else "top", fontsize=8,
              bbox={"fc": "white", "ec": "none", "alpha": 0.8, "pad": 2})  # fmt: skip
    return figure


def main() -> None:
    """Write the pictures."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--out", type=Path, default=Path(".pictures"))
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    for word in SPEEDS:
        draw(word).savefig(args.out / f"regime-{word}.png", dpi=100, facecolor="white")


if __name__ == "__main__":
    main()
