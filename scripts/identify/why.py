"""Why each motion is what it is: a figure and three sentences for each, computed.

    python scripts/identify/why.py --out DIR [--engine NAME] [--write]

Of the paper's four motions, on a named engine: how line and contact stiffness go with
the radius of the orbit (does contact harden?), what feeds it, what becomes of it for
other forces of the pulse and other gaps (its basin), and what linear theory says of
contacts held closed or sprung. Then the step between 410 and 420 rad/s: radius of
the kept-up motion up to where none is left. Motions at the default inputs, basins and
the step at the preset of `identify.screen`. `--write` writes scripts/identify/why.md.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parents[1]))
from identify.guide import WORDS
from identify.screen import SCREEN

from hpcwhirl import simulate
from hpcwhirl.analysis.spectrum import full_spectrum
from hpcwhirl.analysis.stability import coupled, sprung_roots, static_line
from hpcwhirl.case.resolve import resolve
from hpcwhirl.reduction.families import first_family, modal_table
from hpcwhirl.report.saving import save
from hpcwhirl.scene import Scene, apply_settings, engine_names, named_scene
from hpcwhirl.scene.words import SHOWN

Floats = NDArray[np.float64]
PAGE = Path(__file__).with_name("why.md")
WINDOW = 0.1  # s: of a line and a radius; slower ones than 63 rad/s are not resolved
SPRINGS = np.geomspace(1e3, 1e9, 121)  # N/m a blade
FACTORS = (0.25, 0.35, 0.5, 0.7, 0.85, 1.0, 1.2, 1.4, 2.0)  # of force, of gap
STEP = np.arange(350.0, 461.0, 5.0)  # rad/s


@dataclass(frozen=True)
class Motion:
    """A motion as it goes: per window, where there is contact.

    Attributes
    ----------
    radius : rms of the orbit, gaps
    line : strongest, rad/s, static frame, forward positive
    stiffness : mean normal force of all blades over blades and radius, N/m
    """

    scene: Scene
    row: dict[str, Any]
    traces: dict[str, Floats]
    radius: Floats
    line: Floats
    stiffness: Floats


def motion_of(scene: Scene) -> Motion:
    """Return the motion of a scene, window by window."""
    found = simulate(apply_settings(scene, {"traces": "orbit"}))
    time, centre = found.traces["time"], found.traces["centre"]
    orbit = centre[:, 0] + 1j * centre[:, 1]
    size = max(8, round(WINDOW / (time[1] - time[0])))
    rows = [
        _window(time[at : at + size], orbit[at : at + size],
                found.traces["impulse"][at : at + size])
        for at in range(0, len(time) - size + 1, size // 2)
    ]  # fmt: skip
    table = np.array(rows).reshape(-1, 3)
    radius, line, force = table[(table[:, 2] > 0.0) & (table[:, 0] > 0.0)].T
    stiffness = force / (scene.engine.rotor.blades * radius)
    return Motion(
        scene, dict(found.row), found.traces, radius / scene.gap, line, stiffness
    )


def _window(time: Floats, orbit: Any, impulse: Floats) -> tuple[float, float, float]:
    """Return (rms radius, strongest line, mean force) of a part of a run."""
    radius = float(np.sqrt((np.abs(orbit) ** 2).mean()))
    omega, lines = full_spectrum(orbit, float(time[1] - time[0]))
    top = int(np.clip(np.argmax(lines), 1, len(lines) - 2))
    left, peak, right = np.log(np.maximum(lines[top - 1 : top + 2], 1e-300))
    bend = left - 2 * peak + right
    off = 0.5 * (left - right) / bend if bend < 0.0 else 0.0
    line = float(omega[top] + off * (omega[1] - omega[0]))
    return radius, line, float((impulse[-1] - impulse[0]) / (time[-1] - time[0]))


def branch(scene: Scene, whirl: str) -> Any:
    """Return a root by spring, (springs,), 1/s and i rad/s of the static frame.

    It begins, without springs, at 1F's backward wave where the motion is forward, at
    the ring's backward one where it is backward, and is followed from there.
    """
    model = resolve(scene).model
    pair = coupled(model, 1, scene.speed, scene.friction)
    at = 1j * (scene.speed - first_family(modal_table(model), "rotor")[1])
    if whirl == "backward":
        at = -1j * first_family(modal_table(model), "casing")[1]
    out = []
    for spring in np.r_[0.0, SPRINGS]:
        roots = sprung_roots(pair, float(spring))
        static = roots.real + 1j * static_line(roots.imag, 1, scene.speed)
        at = static[np.argmin(np.abs(static - at))]
        out.append(at)
    return np.array(out[1:])


def basin(scene: Scene) -> NDArray[np.str_]:
    """Return the word of each (gap, force), times `FACTORS`, at the fast preset."""
    fast = {name: v for name, v in SCREEN.items() if name != "solver.amplitude_limit"}
    words = [
        [
            str(simulate(apply_settings(scene, fast | {
                "gap": scene.gap * g, "force": scene.force * f})).row["regime"])
            for f in FACTORS
        ]
        for g in FACTORS
    ]  # fmt: skip
    return np.array(words)


def step_of(engine: Scene) -> list[dict[str, Any]]:
    """Return the rows of speeds about the step, at the fast preset."""
    return [
        dict(simulate(apply_settings(engine, SCREEN | {"speed": float(s)})).row)
        for s in STEP
    ]


def sentences(motion: Motion, words: NDArray[np.str_]) -> list[str]:
    """Return what is to be said of a motion, in three sentences."""
    return [_goes(motion), _fed(motion), _lies(motion, words)]


def _goes(motion: Motion) -> str:
    row, own = motion.row, motion
    told = f"At {row['speed']:g} rad/s the motion is {row['regime']} {row['whirl']}"
    if len(own.radius) < 4:
        return f"{told}; blades touch in {len(own.radius)} windows of {WINDOW:g} s."
    order = np.argsort(own.radius)
    few = max(1, len(order) // 5)
    (r, line, soft), (r2, line2, stiff) = (
        [float(np.median(x[part])) for x in (own.radius, own.line, own.stiffness)]
        for part in (order[:few], order[-few:])
    )
    word = "hardens" if stiff > 1.1 * soft else "softens"
    word = "holds" if soft / 1.1 < stiff < 1.1 * soft else word
    return (
        f"{told}: from {r:.2g} to {r2:.2g} gaps of radius (medians of the smallest and "
        f"largest fifth of windows with contact) its line goes from {line:+.0f} to "
        f"{line2:+.0f} rad/s and contact {word}, {soft:.2g} to {stiff:.2g} N/m a blade."
    )


def _fed(motion: Motion) -> str:
    row, rate = motion.row, f"ln amplitude changes by {motion.row['growth_rate']:.2g}"
    fed, lost = row["late_fed"], row["late_lost"]
    if not row["late_contacts"] or lost == 0.0:
        last = row["last_contact"]
        return f"The last contact is at {last:.2f} s; nothing feeds it, {rate} 1/s."
    friction, transport = (row[f"late_{n}"] / lost for n in ("friction", "rotation"))
    return (
        f"In the last 40 % of the run contact feeds {fed / lost:.2g} times what is "
        f"lost: friction {friction:+.2g} and transport over the deformed ring "
        f"{transport:+.2g} times; {rate} 1/s."
    )


def _lies(motion: Motion, words: NDArray[np.str_]) -> str:
    count = Counter(words.ravel().tolist())
    told = ", ".join(f"{n} {word}" for word, n in count.most_common())
    line = float(motion.row["line_frequency"])
    root = branch(motion.scene, str(motion.row["whirl"]))
    return (
        f"Of {words.size} pairs of force and gap, {FACTORS[0]:g} to {FACTORS[-1]:g} "
        f"times the paper's, {told}; linear, with springs for contacts, the "
        f"{motion.row['whirl']} root grows {_where(root)}, held closed at "
        f"{root[-1].real:+.2g} 1/s on {root[-1].imag:+.0f} rad/s; the line computed is "
        f"{line:+.0f} rad/s{_met(root, line)}."
    )


def _where(root: Any) -> str:
    """Say for which springs a root grows, and how fast at most."""
    growing = SPRINGS[root.real > 0.0]
    if not len(growing):
        return "for none"
    end = f"{growing[-1]:.2g} N/m a blade" if root[-1].real <= 0.0 else "closed"
    return f"from {growing[0]:.2g} to {end}, at most at {root.real.max():.2g} 1/s"


def _met(root: Any, line: float) -> str:
    """Say with which spring a root has a line, where it has."""
    crossed = np.flatnonzero(np.diff(np.sign(root.imag - line)))
    if not len(crossed):
        return ""
    at = crossed[0]
    return f", the root's at {SPRINGS[at]:.2g} N/m, growing at {root[at].real:+.2g} 1/s"


def linear_sentence(growth: Sequence[float]) -> str:
    """Return where the forward root of closed contacts begins to grow."""
    up = [i for i in range(len(growth) - 1) if growth[i] <= 0.0 < growth[i + 1]]
    if not up:
        return "Linear theory has no step here: closed contacts cross no zero."
    at = up[0] - growth[up[0]] / (growth[up[0] + 1] - growth[up[0]])
    speed = float(np.interp(at, np.arange(len(STEP)), STEP))
    return (
        f"Linear, the forward root of closed contacts grows from {speed:.0f} rad/s on."
    )


def step_sentence(rows: Sequence[dict[str, Any]]) -> str:
    """Return what is to be said of the step."""
    kept = [r for r in rows if r["regime"] == "sustained"]
    gone = [r["speed"] for r in rows if r["regime"] == "divergent"]
    if not kept or not gone:
        return "There is no step here: not both words occur."
    radii = ", ".join(
        f"{r['speed']:g}: {r['orbit_radius'] / r['gap']:.2f}" for r in kept
    )
    return (
        f"The step: kept-up motion has a radius in gaps of {radii}; divergent are "
        f"{', '.join(f'{s:g}' for s in gone)} rad/s."
    )


def figure_of(motion: Motion, words: NDArray[np.str_]) -> Any:
    """Return line and stiffness over radius, ledger, basin and linear roots."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 8), layout="constrained")
    (line, ledger), (map_, linear) = figure.subplots(2, 2)
    row = motion.row
    figure.suptitle(f"{row['speed']:g} rad/s: {row['regime']} {row['whirl']}")
    line.plot(motion.radius, motion.line, "o", ms=4, c="#2F6DB3")
    line.set(xlabel="orbit radius, gaps", ylabel="line, rad/s (static)")
    if motion.radius.max(initial=0.0) > 10.0 * motion.radius.min(initial=np.inf):
        line.set_xscale("log")
    line.set_title(f"Windows of {WINDOW:g} s with contact")
    other = line.twinx()
    other.plot(motion.radius, motion.stiffness, "x", ms=4, c="#C63D0F")
    other.set(yscale="log", ylabel="× mean force over radius, N/m a blade")
    _draw_ledger(ledger, motion.traces)
    _draw_basin(map_, words)
    _draw_linear(linear, motion)
    return figure


def _draw_ledger(axes: Any, traces: dict[str, Floats]) -> None:
    time, rubbed = traces["time"], traces["rubbed"]
    terms = {"friction": rubbed, "transport": traces["fed"] - rubbed,
             "lost": traces["lost"], "energy": traces["energy"]}  # fmt: skip
    for name, values in terms.items():
        axes.plot(time, values, lw=1.0, label=name)
    axes.set_yscale("symlog", linthresh=1e-3)
    axes.set(xlabel="time, s", ylabel="J, cumulative", title="What feeds it")
    axes.legend(fontsize=8)


def _draw_basin(axes: Any, words: NDArray[np.str_]) -> None:
    for i, gap in enumerate(FACTORS):
        for j, force in enumerate(FACTORS):
            look = SHOWN.get(str(words[i, j]), SHOWN["unstable"])
            axes.plot(force, gap, "s", ms=13, c=look.colour)
            axes.text(force, gap, look.letter, c=look.ink, ha="center", va="center",
                      fontsize=8)  # fmt: skip
    axes.set(xscale="log", yscale="log", xlabel="force, of the paper's",
             ylabel="gap, of the paper's", title="Basin")  # fmt: skip
    axes.plot(1.0, 1.0, "s", ms=16, mfc="none", mec="k")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_ticks(FACTORS, [f"{factor:g}" for factor in FACTORS])
        axis.set_ticks([], minor=True)


def _draw_linear(axes: Any, motion: Motion) -> None:
    root = branch(motion.scene, str(motion.row["whirl"]))
    axes.semilogx(SPRINGS, root.real, "k-", lw=1)
    axes.axhline(0.0, c="grey", lw=0.6)
    axes.set(xlabel="springs for contacts, N/m a blade", ylabel="growth, 1/s",
             title=f"Linear: the {motion.row['whirl']} root")  # fmt: skip
    other = axes.twinx()
    other.semilogx(SPRINGS, root.imag, ":", c="#2F6DB3")
    other.axhline(float(motion.row["line_frequency"]), c="#2F6DB3", lw=0.6)
    other.set_ylabel("its line, rad/s (static, dotted; thin: computed)")


def closed_growth(engine: Scene) -> list[float]:
    """Return the growth of the forward root of closed contacts by speed, 1/s."""
    scenes = [apply_settings(engine, {"speed": float(s)}) for s in STEP]
    return [float(branch(scene, "forward")[-1].real) for scene in scenes]


def draw_step(rows: Sequence[dict[str, Any]]) -> Any:
    """Return the radius of the orbit over the speed, by words."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 4), layout="constrained")
    axes = figure.subplots()
    for row in rows:
        look = SHOWN.get(str(row["regime"]), SHOWN["unstable"])
        radius = max(row["orbit_radius"] / row["gap"], 1e-3)
        axes.plot(row["speed"], radius, look.marker, mfc=look.colour, mec=look.stroke)
    axes.set(yscale="log", xlabel="speed, rad/s", ylabel="orbit radius, gaps",
             title="The step: where kept-up motion ends")  # fmt: skip
    return figure


def page(name: str, out: Path) -> list[str]:
    """Return the page of an engine; its figures go to a directory."""
    engine = named_scene(name)
    lines = [
        f"# Why: {name}",
        "",
        f"`python scripts/identify/why.py --engine {name}`",
        "",
    ]
    for speed, regime, whirl in WORDS:
        motion = motion_of(apply_settings(engine, {"speed": speed}))
        words = basin(motion.scene)
        save(figure_of(motion, words), out / f"{name}_{speed:g}.png")
        lines += [f"## {speed:g} rad/s (the paper: {regime} {whirl})", ""]
        lines += [*sentences(motion, words), ""]
    rows = step_of(engine)
    save(draw_step(rows), out / f"{name}_step.png")
    told = [step_sentence(rows), linear_sentence(closed_growth(engine))]
    return [*lines, "## The step", "", *told]


def main(words: Sequence[str] | None = None) -> int:
    """Compute, draw, print and write."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("build/why"))
    parser.add_argument("--engine", choices=engine_names(), default="four_motions")
    parser.add_argument("--write", action="store_true", help=f"write {PAGE.name}")
    args = parser.parse_args(words)
    lines = page(args.engine, args.out)
    print("\n".join(lines))
    if args.write:
        PAGE.write_text("\n".join(lines) + "\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
