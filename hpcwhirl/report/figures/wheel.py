"""Figures of the wheel in motion: a strip of frames for print, and a film.

Displacements, and the gap, are enlarged by one factor about the undeformed tips.
"""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import animation
from matplotlib.collections import LineCollection

from hpcwhirl.analysis.wheel_motion import Frames, frames_of
from hpcwhirl.arrays import Floats
from hpcwhirl.errors import InputError
from hpcwhirl.report import palette
from hpcwhirl.report.canvas import in_defaults, new_figure, title_of, value_of
from hpcwhirl.scene import Scene
from hpcwhirl.store.atomic import make_folders, replacing, telling
from hpcwhirl.store.reading.results_file import Results

STRIP = 6  # frames of the strip
MOST = 120  # frames of the film
RATE = 15  # frames of the film a second
TINTS = (1.0, 0.6, 0.25)  # shares of a colour in a GIF; the rest is the ground's
HUB = 0.16  # least radius of the drawn hub / that of the wheel
FORCE = 0.26  # length of the line of the largest force / radius of the wheel
REACH = 1.27  # end of the axes / radius of the wheel
BLADES, TOUCH, PATH, WALL = (
    palette.BLUE, palette.TOUCH, palette.GREEN, palette.QUIET,
)  # fmt: skip
FORMATS = {".gif": animation.PillowWriter, ".mp4": animation.FFMpegWriter}


def draw_strip(results: Results, case: int) -> Any:
    """Return a figure of six frames of a case's wheel, at equal times.

    results, case : results with full traces; number of the case
    """
    frames, scene = _frames(results, case)
    figure, panels = new_figure((10.5, 7.4), 2, STRIP // 2)
    scale = frames.enlarged()
    chosen = np.linspace(0, len(frames.time) - 1, STRIP).astype(int)
    for axes, n in zip(np.ravel(panels), chosen.tolist(), strict=True):
        _draw(axes, frames, n, scale, scene)
    figure.suptitle(f"{title_of(results.rows[case])}\n{_legend(frames, scale, scene)}",
                    fontsize=10)  # fmt: skip
    return figure


@in_defaults
def write_film(results: Results, case: int, path: Path) -> Path:
    """Write a film of a case's wheel and return its path.

    path : its ending, one of `FORMATS`, sets the format

    Raises
    ------
    InputError
        if ffmpeg is needed and missing
    """
    if path.suffix == ".mp4" and not shutil.which("ffmpeg"):
        raise InputError("a film as mp4 needs the program ffmpeg, which is not there")
    frames, scene = _frames(results, case)
    figure, axes = new_figure((4.6, 5.0))
    scale = frames.enlarged()
    legend = _legend(frames, scale, scene).replace("; green", "\ngreen")
    title = f"{title_of(results.rows[case])}\n{legend}"

    def drawn(n: int) -> list[Any]:
        axes.clear()
        _draw(axes, frames, n, scale, scene)
        figure.suptitle(title, fontsize=7)
        return [axes]

    film = animation.FuncAnimation(figure, drawn, frames=len(frames.time), blit=False)
    with telling(path):
        make_folders(path.parent)
        with replacing(path, held=True) as part:
            named = part.with_suffix(path.suffix)  # the writer goes by the ending
            film.save(named, writer=FORMATS[path.suffix](fps=RATE), dpi=72)
            if path.suffix == ".gif":
                _with_few_colours(named)
            named.replace(part)
    return path


def _with_few_colours(path: Path) -> None:
    """Write a GIF again with one palette for all frames: half as large.

    It has the colours drawn and tints of them: one taken from a frame lacks the colour
    of contacts where this has few.
    """
    from PIL import Image, ImageSequence

    with Image.open(path) as film:
        frames = [frame.convert("RGB") for frame in ImageSequence.Iterator(film)]
    shades = Image.new("P", (1, 1))
    shades.putpalette(tints())
    first, *others = (f.quantize(palette=shades, dither=0) for f in frames)
    first.save(path, save_all=True, append_images=others, loop=0, optimize=True,
               duration=1000 // RATE)  # fmt: skip


def tints() -> list[int]:
    """Return the colours of a GIF: red, green, blue of each, one after another."""
    from matplotlib.colors import to_rgb

    ground = np.array(to_rgb(palette.GROUND))
    drawn = np.array([to_rgb(c) for c in (BLADES, TOUCH, PATH, WALL, palette.INK)])
    mixed = [share * drawn + (1.0 - share) * ground for share in TINTS]
    levels = np.rint(255 * np.vstack([*mixed, ground])).astype(int)
    return [int(level) for level in levels.ravel()]


def _frames(results: Results, case: int) -> tuple[Frames, Scene]:
    """Return the frames of a case with full traces, and its scene."""
    scene = results.scene(case)
    row = {n: results[n][case] for n in ("regime", "tip_growth")}
    return frames_of(scene, row, results.traces(case), MOST), scene


def _legend(frames: Frames, scale: float, scene: Scene) -> str:
    """Return what a reader must know of the drawing."""
    most = float(f"{frames.force.max(initial=0.0):.4g}")
    times = scale * scene.engine.rotor.radius
    way = "clockwise" if frames.angle[-1] < frames.angle[0] else "anticlockwise"
    return (
        f"static frame, Ω {way}; displacements and gap × {times:.3g}; green: blade 0 "
        "and the centre's path\nred: contact, length by the root of the force, "
        f"at most {value_of('force', most).partition('= ')[2]}"
    )


def _draw(axes: Any, frames: Frames, n: int, scale: float, scene: Scene) -> None:
    """Draw one frame: casing, blades, hub, contacts, and the centre's path until then.

    scale : drawn length of a metre of displacement, in radii of the wheel
    """
    rotor = scene.engine.rotor
    hub = max(rotor.disk_radius / rotor.radius, HUB)
    theta = np.linspace(0.0, 2.0 * np.pi, 361)
    waves = theta[:, None] * np.arange(frames.wall.shape[1])
    parts = np.cos(waves) @ frames.wall[n, :, 0] + np.sin(waves) @ frames.wall[n, :, 1]
    wall = (1.0 + scale * (frames.gap[n] + parts)) * np.exp(1j * theta)
    axes.plot(wall.real, wall.imag, c=WALL, lw=1.2, solid_capstyle="butt")
    blades = _blades(frames, n, scale, hub)
    there = np.flatnonzero(np.arange(len(blades)) != frames.lost)
    lines = [np.stack([b.real, b.imag], axis=1) for b in blades[there]]
    colours = [BLADES if j else PATH for j in there]  # blade 0 shows the rotation
    axes.add_collection(LineCollection(lines, colors=colours, linewidths=1.1))
    path = scale * (frames.centre[: n + 1] @ np.array([1.0, 1j]))
    rim = path[-1] + hub * np.exp(1j * theta)
    axes.plot(rim.real, rim.imag, c=BLADES, lw=1.1)
    axes.plot(path.real, path.imag, c=PATH, lw=0.7)
    axes.plot(path[-1].real, path[-1].imag, ".", c=palette.INK, ms=4)
    _touch(axes, blades[:, -1], frames.force[n], float(frames.force.max(initial=0.0)))
    axes.set(aspect="equal", xlim=(-REACH, REACH), ylim=(-REACH, REACH))
    axes.set_axis_off()
    axes.set_title(f"t = {1e3 * frames.time[n]:.2f} ms", fontsize=8)


def _blades(frames: Frames, n: int, scale: float, hub: float) -> Any:
    """Return points of all blades from hub to tip, (N, 9), complex, static frame.

    Each is a clamped beam that its tip bends. Tangential displacements are drawn along
    circles, so that a tip is as far from the centre as its radial displacement tells;
    along tangents it would be drawn through the casing.

    hub : its radius, in radii of the wheel
    """
    count = frames.tips.shape[1]
    turned = np.exp(1j * (frames.angle[n] + 2.0 * np.pi * np.arange(count) / count))
    centre = scale * (frames.centre[n] @ np.array([1.0, 1j])) / turned
    tip = scale * (frames.tips[n] @ np.array([1.0, 1j]))
    z = np.linspace(0.0, 1.0, 9)
    bent = 0.5 * z**2 * (3.0 - z)
    along = centre.real[:, None] + np.outer(tip.real - centre.real, z)
    across = centre.imag[:, None] + np.outer(tip.imag - centre.imag, bent)
    radius = hub + z * (1.0 - hub)
    return turned[:, None] * (radius + along) * np.exp(1j * across / radius)


def _touch(axes: Any, tips: Any, force: Floats, most: float) -> None:
    """Draw the contacts of one frame: dots, and lines inward.

    tips, force : (N,), complex, drawn places of the tips; (N,), N
    most : N, largest force of all frames
    """
    touched = force > 0.0
    if not touched.any():
        return
    at = tips[touched]
    inward = at * (1.0 - FORCE * np.sqrt(force[touched] / most) / np.abs(at))
    axes.plot([at.real, inward.real], [at.imag, inward.imag], c=TOUCH, lw=1.4)
    axes.plot(at.real, at.imag, ".", c=TOUCH, ms=6)
