"""Figures 4 to 14 of the paper and `paper.md`, from campaigns kept in DIR/campaigns.

    python scripts/paper/figures.py --out DIR           # some 9 minutes on one core
    python scripts/paper/figures.py --out DIR --quick   # coarse: a minute
    python scripts/paper/figures.py --out DIR --engine NAME --engine NAME
    python scripts/paper/figures.py --out DIR --rotation none --rotation full

The same command again continues: no case is integrated twice. `paper.md` sets each of
the paper's statements beside what was computed, misses first; of several engines side
by side, or of one without and with the terms of rotation, with a directory for each.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hpcwhirl.report.canvas import save
from hpcwhirl.report.figures import frequencies, motions, shapes, sweeps
from hpcwhirl.scene import engine_inputs, engine_names
from hpcwhirl.scene.words import SHOWN
from hpcwhirl.store.reading.results_file import Results

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import completed, parser_of
from paper.found import PAPER_SPEEDS, Found
from paper.statements import statements
from paper.text import page, with_reason
from paper.veering import draw_veering


@dataclass(frozen=True)
class Effort:
    """How fine the campaigns are: steps in s, speeds in rad/s, engine time in s."""

    step: float
    spacing: int
    steps: tuple[float, ...]
    modes: tuple[int, ...]
    convergence: float


Engine = dict[str, Any]  # {input: value}
ROTATIONS = ("none", "full")
GAPS = (5e-4, 2.5e-4, 1.28e-4)  # m
FULL = Effort(
    1e-6, 10, (8e-6, 4e-6, 2e-6, 1e-6, 5e-7), (22, 44, 66, 88, 110, 132, 176, 220), 2.5
)
QUICK = Effort(4e-6, 50, (8e-6, 4e-6, 2e-6), (66, 110, 132), 0.5)


def designs(effort: Effort) -> dict[str, dict[str, Any]]:
    """Return the campaigns but `motions`, as documents in TOML's structure."""
    sweep = {"start": 20, "stop": 520, "step": effort.spacing}
    table1 = {"gap": 1e-3, "friction": 0.2, "revolutions": 20.0}
    solver = {"time_step": effort.step}
    whole = {"plan": "everything"}  # what k = 2 shows must not be built in
    paper = [float(s) for s in PAPER_SPEEDS]
    short = {"duration": effort.convergence}
    lobed = {
        "scene": table1,
        "solver": solver | whole,
        "output": {"traces": "full", "interval": 5e-4},
        "sweep": {"nodal_diameter": [1, 2], "speed": sweep},
    }
    return {
        "table1": lobed,
        "table2": {
            "solver": solver,
            "sweep": {"centre": ["free", "clamped"], "speed": sweep},
        },
        "steps": {
            "scene": short,
            "sweep": {"speed": paper, "time_step": list(effort.steps)},
        },
        "modes": {
            "scene": short,
            "solver": solver,
            "sweep": {"speed": paper, "modes": list(effort.modes)},
        },
    }


def narrower(table1: Mapping[str, Any], gap: float) -> dict[str, Any]:
    """Return Table 1 with two lobes alone and another gap, m."""
    scene, sweep = dict(table1["scene"]), dict(table1["sweep"])
    return {**table1, "scene": scene | {"gap": gap},
            "sweep": sweep | {"nodal_diameter": [2]}}  # fmt: skip


def two_lobes(
    table1: Results, place: Path, document: Any, engine: Engine
) -> Results | None:
    """Return Table 1 with k = 2 at the widest of `GAPS` where blades touch the casing.

    None where they do over 1 mm, too, or nowhere.
    """
    if any(r["contacts"] > 0 for r in table1.rows if r["nodal_diameter"] == 2):
        return None
    for gap in GAPS:
        found = computed(place / f"lobes-{gap:g}", narrower(document, gap), engine)
        if 2 * sum(row["contacts"] > 0 for row in found.rows) > len(found.rows):
            return found
    return None


def computed(folder: Path, document: Mapping[str, Any], engine: Engine) -> Results:
    """Return the cases of a campaign, integrating what is not there yet."""
    return Results(completed(document, folder, engine))


def pick(cases: Results, regime: str, whirl: str, near: float) -> float | None:
    """Return the speed nearest to one at which a motion is found; centre free."""
    free = [cases.rows[i] for i in cases.like(0)]
    found = [
        float(r["speed"]) for r in free if (r["regime"], r["whirl"]) == (regime, whirl)
    ]
    return min(found, key=lambda speed: abs(speed - near)) if found else None


def backward(table2: Results) -> dict[str, float | None]:
    """Return the speeds of Figs. 9a and 11a, which the paper does not print."""
    return {
        "damped": pick(table2, "damped", "backward", 520.0),
        "sustained": pick(table2, "sustained", "backward", 410.0),
    }


def motions_design(table2: Results, effort: Effort) -> dict[str, Any]:
    """Return the campaign of full traces: the paper's speeds and Figs. 9a, 11a."""
    extra = [speed for speed in backward(table2).values() if speed]
    return {
        "solver": {"time_step": effort.step},
        "output": {"traces": "full"},
        "sweep": {"speed": sorted({*(float(s) for s in PAPER_SPEEDS), *extra})},
    }


def draw_opposed(cases: Results, line: list[int]) -> Any:
    """Return Fig. 8: tangential tips of two opposed blades, last five revolutions."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 4), layout="constrained")
    axes = figure.subplots()
    case = min(line, key=lambda i: abs(cases.rows[i]["speed"] - 270.0))
    traces, row = cases.traces(case), cases.rows[case]
    turns = traces["time"] * row["speed"] / (2 * np.pi)
    late = turns >= turns[-1] - 5
    half = traces["tips"].shape[1] // 2
    for blade, look in (
        (0, {"lw": 2.5, "c": "#9ecae1"}),
        (half, {"lw": 0.9, "c": "k"}),
    ):
        tip = 1e3 * traces["tips"][late, blade, 1]
        axes.plot(turns[late], tip, label=f"blade {blade}", **look)
    axes.set(xlabel="revolutions", ylabel="$v_{tip}$, mm (rotating frame)")
    axes.set_title(motions.title_of(row))
    axes.legend()
    return figure


def draw_pair(cases: Results, speeds: list[float | None]) -> Any:
    """Return static-frame orbits with transient and window (Figs. 9, 11, 13)."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 5.6), layout="constrained")
    for axes, speed in zip(figure.subplots(1, 2), speeds, strict=True):
        if speed is None:
            axes.text(0.5, 0.5, "no such motion was found", ha="center")
            axes.axis("off")
            continue
        case = case_at(cases, speed)
        traces, row = cases.traces(case), cases.rows[case]
        late = motions.in_window(traces["time"], row)
        motions.draw_orbit(axes, traces["centre"], late, row["gap"], transient=True)
        unit = axes.get_label()
        axes.set(xlabel=f"$X_o$, {unit} (static frame)", ylabel=f"$Y_o$, {unit}")
        axes.set_title(motions.title_of(row))
    return figure


def case_at(cases: Results, speed: float) -> int:
    """Return the case nearest to a speed."""
    return int(np.argmin([abs(row["speed"] - speed) for row in cases.rows]))


def draw_convergence(found: Found) -> Any:
    """Return Sec. 3.3: displacements above, kind of motion below, dt and eta."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 7), layout="constrained")
    (upper, lower) = figure.subplots(2, 2, sharex="col", height_ratios=(3, 2))
    for place, (name, title) in enumerate((("steps", "Δt, s"), ("modes", "η"))):
        for level, speed in enumerate(PAPER_SPEEDS):
            rows = found.convergence(name, speed)
            early = [row["early"] for row in rows[:-1]]  # the finest differs by nothing
            upper[place].plot(early, "o-", label=f"{speed:g} rad/s")
            draw_kinds(lower[place], rows, level)
        upper[place].set(yscale="log", ylabel="difference from the finest, relative")
        upper[place].set_title("centre (static frame), rms of the first 20 ms")
        lower[place].set(xlabel=title, ylabel="Ω, rad/s", ylim=(-0.6, 3.6))
        lower[place].set_title("kind of motion (letter: regime, arrow: whirl)")
        lower[place].set_yticks(
            range(len(PAPER_SPEEDS)), [f"{s:g}" for s in PAPER_SPEEDS]
        )
        lower[place].set_xticks(range(len(rows)), [f"{row['value']:g}" for row in rows])
        upper[place].legend(fontsize=8)
    return figure


def draw_kinds(axes: Any, rows: list[dict[str, Any]], level: float) -> None:
    """Draw regime and whirl of each row beside one another, as the map has them."""
    for x, row in enumerate(rows):
        look = SHOWN[frequencies.shown_word(row)]
        whirl = {"forward": "↑", "backward": "↓", "mixed": "↕"}.get(row["whirl"], "")
        axes.text(x, level, f"{look.letter} {whirl}", ha="center", va="center",
                  color=look.ink, bbox={"fc": look.colour, "ec": "none"})  # fmt: skip
    axes.set_xlim(-0.5, len(rows) - 0.5)


def draw_all(found: Found, out: Path, pair: dict[str, float | None]) -> None:
    """Draw Figs. 4 to 14 and the convergence."""
    table1, table2, full = (found.cases[n] for n in ("table1", "table2", "motions"))
    rotor = table2.scene(0).engine.rotor
    lobed = found.cases[found.two_lobes]
    one = found.line("table1", nodal_diameter=1)
    two = found.line(found.two_lobes, nodal_diameter=2)
    free = found.line("table2", centre="free")
    title = "Table 1, after revolution 5, k = {}, gap {:g} mm"
    gap = 1e3 * lobed.rows[two[0]]["gap"]
    figures = {
        "fig04": shapes.draw_shapes(rotor),
        "fig05": draw_veering(rotor),
        "fig06": sweeps.draw_frequency(table1, one, title.format(1, 1.0)),
        "fig07": sweeps.draw_frequency(lobed, two, title.format(2, gap)),
        "fig08": draw_opposed(lobed, two),
        "fig09": draw_pair(full, [pair["damped"], 520.0]),
        "fig11": draw_pair(full, [pair["sustained"], 410.0]),
        "fig13": draw_pair(full, [270.0, 420.0]),
        "convergence": draw_convergence(found),
        "cascade": sweeps.draw_cascade(table2, free),
        "bifurcation": sweeps.draw_bifurcation(table2, free),
        "interaction": frequencies.draw_interaction(table2, free),
        "growth": sweeps.draw_growth(table2, free),
    }
    for name, speed in (("fig10", 520.0), ("fig12", 410.0), ("fig14", 420.0)):
        figures[name] = motions.draw_contributions(full, case_at(full, speed))
    for name, figure in sorted(figures.items()):
        print(save(figure, out / f"{name}.png"))


def paper_on(engine: Engine, out: Path, effort: Effort) -> Found:
    """Integrate what is missing of an engine, draw, and return what was found."""
    place, documents = out / "campaigns", designs(effort)
    cases = {n: computed(place / n, d, engine) for n, d in documents.items()}
    full = motions_design(cases["table2"], effort)
    cases["motions"] = computed(place / "motions", full, engine)
    lobes = two_lobes(cases["table1"], place, documents["table1"], engine)
    found = Found(cases | ({"lobes": lobes} if lobes else {}))
    draw_all(found, out, backward(cases["table2"]))
    return found


def main() -> int:
    """Integrate what is missing, draw, and write the page."""
    parser = parser_of(__doc__)
    parser.add_argument("--out", type=Path, required=True, metavar="DIR")
    parser.add_argument("--engine", action="append", choices=engine_names())
    parser.add_argument("--rotation", action="append", choices=ROTATIONS)
    parser.add_argument("--quick", action="store_true", help="coarse, a minute")
    args = parser.parse_args()
    engines = {
        name if rotation == "none" else f"{name}, {rotation}":
        engine_inputs(name) | {"engine.rotation": rotation}
        for name in args.engine or engine_names()[:1]
        for rotation in args.rotation or ROTATIONS[:1]
    }  # fmt: skip
    effort = QUICK if args.quick else FULL
    told = {}
    for name, engine in engines.items():
        place = args.out if len(engines) == 1 else args.out / name.replace(", ", "-")
        found = paper_on(engine, place, effort)
        judged = statements(found)
        if engine["engine.rotation"] == "none":  # of what else the reasons tell nothing
            judged = [with_reason(each) for each in judged]
        told[name] = judged
    (args.out / "paper.md").write_text(page(told, quick=args.quick), encoding="utf-8")
    print(args.out / "paper.md")
    return 0


if __name__ == "__main__":
    sys.exit(main())
