"""Draw what is modelled: disk, gap, casing, springs, lobes, pulse and both frames.

    python scripts/pictures/concept.py [--out .pictures/concept.png]

Nothing is to scale: the gap and the ring's shapes are drawn large.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

BLADES, DISK, TIP, RING = 16, 0.34, 1.0, 1.13  # radii
STEEL, BLADE, LOAD, TURN = "#4d4d4d", "#3F86B5", "#C63D0F", "#57267A"
AROUND = np.linspace(0.0, 2.0 * np.pi, 721)
SLANT = 0.35  # rad, of the rotating axes


def polar(radius: Any, angle: Any) -> tuple[Any, Any]:
    """Return x, y."""
    return radius * np.cos(angle), radius * np.sin(angle)


def arrow(axes: Any, start: Any, end: Any, colour: str, **style: Any) -> None:
    """Draw an arrow."""
    from matplotlib.patches import FancyArrowPatch

    style = {"arrowstyle": "-|>", "mutation_scale": 11, "lw": 1.4, **style}
    axes.add_patch(FancyArrowPatch(start, end, color=colour, zorder=6, **style))


def spring(axes: Any, start: Any, end: Any, colour: str) -> None:
    """Draw a spring between two points."""
    start, end = np.asarray(start), np.asarray(end)
    along = np.linspace(0.0, 1.0, 11)
    side = np.array([0, 0, 1, -1, 1, -1, 1, -1, 1, 0, 0]) * 0.025
    across = np.array([-(end - start)[1], (end - start)[0]])
    across = across / np.linalg.norm(across)
    points = start + along[:, None] * (end - start) + side[:, None] * across
    axes.plot(*points.T, color=colour, lw=1.2, zorder=5)


def draw_disk(axes: Any) -> None:
    """Draw blades, rim and the shaft's springs, in the rotating frame."""
    from matplotlib.patches import Circle

    for blade in range(BLADES):
        angle = SLANT + 2 * np.pi * blade / BLADES
        axes.plot(*polar(np.array([DISK, TIP]), angle), color=BLADE, lw=3.2, zorder=3,
                  solid_capstyle="butt")  # fmt: skip
    axes.add_patch(Circle((0, 0), DISK, fc="#d8e7f2", ec=BLADE, lw=2, zorder=3))
    for turn in (np.pi, 1.5 * np.pi):
        end = np.array(polar(DISK * 0.86, SLANT + turn))
        spring(axes, (0, 0), end, STEEL)
        across = 0.06 * np.array([-np.sin(SLANT + turn), np.cos(SLANT + turn)])
        axes.plot(*np.array([end - across, end + across]).T, color=STEEL, lw=2.4,
                  zorder=5)  # fmt: skip
    axes.plot(0, 0, "o", color=STEEL, ms=5, zorder=7)
    axes.text(-0.12, 0.10, r"$k_o$", fontsize=11, color=STEEL, zorder=7, ha="center")


def draw_casing(axes: Any) -> None:
    """Draw the ring on its foundation, in the static frame."""
    from matplotlib.patches import Circle

    axes.add_patch(Circle((0, 0), RING + 0.07, fc="#bdbdbd", ec=STEEL, zorder=1))
    axes.add_patch(Circle((0, 0), RING, fc="white", ec=STEEL, zorder=2))
    for number in range(8):
        angle = np.pi * (2 * number + 1) / 8
        inner, outer = polar(RING + 0.07, angle), polar(RING + 0.27, angle)
        spring(axes, inner, outer, STEEL)
        side = 0.07 * np.array([-np.sin(angle), np.cos(angle)])
        axes.plot(*np.array([np.array(outer) - side, np.array(outer) + side]).T,
                  color=STEEL, lw=2.2)  # fmt: skip


def draw_frames(axes: Any) -> None:
    """Draw the axes of both frames and the rotation."""
    from matplotlib.patches import Arc

    for angle, name in ((0.0, "x"), (np.pi / 2, "y")):
        arrow(axes, (0, 0), polar(0.80, angle), "black", lw=1.1)
        axes.text(*polar(0.86, angle), name, ha="center", va="center", zorder=8,
                  bbox={"fc": "white", "ec": "none", "pad": 0.5})  # fmt: skip
        arrow(axes, (0, 0), polar(0.62, angle + SLANT), TURN, lw=1.4)
    axes.add_patch(Arc((0, 0), 1.04, 1.04, theta1=0, theta2=np.degrees(SLANT),
                       color=TURN, lw=1.4, zorder=6))  # fmt: skip
    box = {"fc": "white", "ec": "none", "pad": 0.6}
    axes.text(*polar(0.66, SLANT / 2), r"$\Omega t$", color=TURN, ha="center",
              va="center", zorder=8, bbox=box)  # fmt: skip


def draw_contact(axes: Any) -> None:
    """Mark the gap, and what a contact does to a tip, beside one blade."""
    angle = SLANT + 2 * np.pi * 5 / BLADES
    tip, wall = polar(TIP, angle), polar(RING, angle)
    arrow(axes, tip, wall, LOAD, arrowstyle="<->", mutation_scale=8)
    axes.annotate("gap", polar((TIP + RING) / 2, angle), polar(RING + 0.42, angle),
                  color=LOAD, ha="center", va="center", fontsize=11,
                  arrowprops={"arrowstyle": "-", "color": LOAD, "lw": 0.8})  # fmt: skip


def draw_engine(axes: Any) -> None:
    """Draw the whole engine."""
    draw_casing(axes)
    draw_disk(axes)
    draw_frames(axes)
    draw_contact(axes)
    start, end = polar(TIP - 0.16, SLANT + 3.75), polar(TIP - 0.16, SLANT + 4.35)
    arrow(axes, start, end, TURN, connectionstyle="arc3,rad=0.16", lw=2.2,
          mutation_scale=16)  # fmt: skip
    axes.text(*polar(TIP - 0.32, SLANT + 4.05), r"$\Omega$", color=TURN, fontsize=14,
              ha="center", va="center", zorder=8,
              bbox={"fc": "white", "ec": "none", "pad": 0.6})  # fmt: skip
    for x, y, text, colour in (
        (0.0, RING + 0.42, "casing: elastic ring on a soft foundation, static frame",
         STEEL),
        (0.0, -RING - 0.42, "bladed disk on the shaft's springs, rotating frame",
         BLADE),
    ):  # fmt: skip
        axes.text(x, y, text, color=colour, ha="center", va="center", fontsize=10.5)
    axes.set(xlim=(-1.62, 1.62), ylim=(-1.66, 1.66), aspect="equal")
    axes.axis("off")


def draw_lobes(axes: Any, lobes: int) -> None:
    """Draw the load and the ring's shape for a number of lobes."""
    axes.plot(*polar(1.0, AROUND), color="#bdbdbd", lw=1.2)
    shape = np.cos(lobes * AROUND)
    bent = polar(1.0 - 0.13 * shape, AROUND)
    if lobes == 1:  # a shift: the tangential part keeps the ring round
        bent = (np.cos(AROUND) - 0.13, np.sin(AROUND))
    axes.plot(*bent, color=STEEL, lw=2.4)
    for angle in np.arange(24) * np.pi / 12:
        size = np.cos(lobes * angle)
        if abs(size) < 0.2:
            continue
        near, far = (1.12, 1.12 + 0.34 * abs(size))
        ends = polar(far, angle), polar(near, angle)
        arrow(axes, *(ends if size > 0 else ends[::-1]), LOAD, mutation_scale=7, lw=1)
    axes.text(0, 0, f"k = {lobes}", ha="center", va="center", fontsize=11)
    axes.set(xlim=(-1.55, 1.55), ylim=(-1.55, 1.55), aspect="equal")
    axes.axis("off")


def draw_pulse(axes: Any) -> None:
    """Draw the load over time."""
    time = np.linspace(0.0, 1.0, 100)
    axes.plot(time, np.sin(np.pi * time), color=LOAD, lw=2)
    axes.plot([1.0, 2.4], [0.0, 0.0], color=LOAD, lw=2)
    axes.set_xticks([0, 1], ["0", r"$\tau$"])
    axes.set_yticks([0, 1], ["0", r"$F$"])
    axes.set_title(r"$F \sin(\pi t/\tau)$, then nothing", fontsize=10)
    axes.set_xlabel("time", fontsize=10)
    axes.set_box_aspect(0.8)
    axes.spines[["top", "right"]].set_visible(False)


def concept() -> Any:
    """Return the picture."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 5.8), layout="constrained")
    left, right = figure.subfigures(1, 2, width_ratios=[1.75, 1.0])
    draw_engine(left.subplots())
    lower = right.subplot_mosaic([["1", "2"], ["3", "pulse"]])
    for lobes in (1, 2, 3):
        draw_lobes(lower[str(lobes)], lobes)
    draw_pulse(lower["pulse"])
    right.suptitle(r"the load: radial, $\propto \cos k\theta$, k lobes", fontsize=11)
    return figure


def main() -> None:
    """Write the picture."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--out", type=Path, default=Path(".pictures/concept.png"))
    args = parser.parse_args()
    args.out.parent.mkdir(parents=True, exist_ok=True)
    concept().savefig(args.out, dpi=100, facecolor="white")


if __name__ == "__main__":
    main()
