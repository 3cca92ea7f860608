"""`hpcwhirl response`: the response to an unbalance over the speed, without contact."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

import tomli_w

from hpcwhirl.cli import options
from hpcwhirl.cli.command import add_option
from hpcwhirl.errors import InputError, say, shown
from hpcwhirl.scene import Scene, load_document
from hpcwhirl.scene.units import ANGULAR, in_shown, in_si, showing, shown_in, told_of

if TYPE_CHECKING:
    from hpcwhirl.analysis.api617 import Margin, Operating, Peak
    from hpcwhirl.analysis.response_study import Study

KEPT = "campaign", "sweep"  # tables of a campaign that --write copies
NAMED = 6  # largest number of speeds of a sweep in one line


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `hpcwhirl response` on its parser."""
    # fmt: off
    options.add_scene(parser)
    add_option(parser, "--operating LOW,HIGH",
        "operating speeds, such as 3000rpm,4200rpm (default: lowest and highest speed "
        "of the file's sweep, else the scene's speed)")
    add_option(parser, "--up-to SPEED",
        "highest speed computed (default: 1.3 times the highest operating speed)")
    add_option(parser, "--share SHARE",
        "share of the clearance from which on a case is worth integrating (default "
        "0.75, API 617's limit; 1: where the tips touch)", default=0.75)
    add_option(parser, "--plot FILE.png",
        "draw amplitudes, lag and force over the speed", type=Path)
    add_option(parser, "--write FILE.toml",
        "write a campaign of the cases that are worth integrating", type=Path)
    options.add_units(parser, "speeds, lengths and forces")


def run(args: argparse.Namespace) -> int:
    """Print, draw or write the response of a scene, and return the exit code."""
    from hpcwhirl.analysis.response_study import facts_of_study, offered, study

    if not 0.0 < args.share <= 1.0:
        raise InputError(f"--share must be > 0 and <= 1, got {args.share:g}")
    asked = options.asked_units(args.units)
    options.check_picture(args.plot)
    options.check_writable(args.write, folder=False)
    scene, speeds = _given(args.scene, args.settings)
    operating = _operating(args.operating, speeds or [scene.speed])
    found = study(scene, operating, _speed("--up-to", args.up_to))
    worth = offered(found.bands(args.share), speeds)
    if args.plot:
        _draw(found, args.plot, asked)
    if args.write:
        _write(args, found, worth)
    if args.json:
        options.print_json({**facts_of_study(found, args.share), "sweep": worth})
        return 0
    with showing(asked):
        _show(found, args.share, worth)
    return 0


def _speed(name: str, text: str | None) -> float:
    """Return the value of an option in rad/s; 0 if it is not given.

    name, text : the option; its text, such as "3000rpm"
    """
    if text is None:
        return 0.0
    value = told_of(name, lambda: in_si(text, "rad/s"))
    try:
        number = float(value)
    except ValueError:
        number = 0.0
    if not number > 0.0:
        raise InputError(f"{name} must be a speed > 0, got {shown(text)}")
    return number


def _operating(text: str | None, speeds: list[float]) -> Operating:
    """Return the operating speeds of --operating, or those of a sweep, ascending."""
    from hpcwhirl.analysis.api617 import Operating

    if text is None:
        sizes = [abs(speed) for speed in speeds]
        if not max(sizes) > 0.0:
            raise InputError("speed must not be 0 for a response: add --operating")
        return Operating(min(sizes), max(sizes))
    parts = text.split(",")
    if len(parts) != 2:
        raise InputError(f"--operating must be two speeds LOW,HIGH, got {shown(text)}")
    low, high = (_speed("--operating", part.strip()) for part in parts)
    if low > high:
        raise InputError(f"--operating must begin with the lower speed, got {text}")
    return Operating(low, high)


def _given(name: str, settings: list[str]) -> tuple[Scene, list[float]]:
    """Return a scene, and the speeds of a campaign's cases, rad/s, ascending.

    Of a campaign's file the scene is what its cases share; of a scene speeds are [].

    name, settings : SCENE of the command line; texts of --set
    """
    from hpcwhirl.campaign.plan.design import Design
    from hpcwhirl.scene import DESIGN_TABLES
    from hpcwhirl.scene.table import listed

    if not Path(name).is_file() or not {*load_document(Path(name))} & {*DESIGN_TABLES}:
        return options.scene_of(name, settings), []
    design = Design.of(Path(name), options.parsed(settings))
    column = design.settings.column("speed", design.base.speed)
    others = [full for full in design.settings.names if full != "speed"]
    if others:
        say(f"other inputs of the cases, {', '.join(others)}: as in [scene] (or --set)")
    return design.base, sorted({float(speed) for speed in listed(column.values)})


def _draw(found: Study, path: Path, asked: tuple[str, ...]) -> None:
    from hpcwhirl.report.canvas import in_defaults, save, tell_in_units
    from hpcwhirl.report.figures.response import draw_response

    with showing(asked):
        figure = in_defaults(draw_response)(found)
        tell_in_units(figure)
        in_defaults(save)(figure, path)
    say(str(path))


def _write(args: argparse.Namespace, found: Study, worth: list[float]) -> None:
    """Write a campaign of the cases that are worth integrating."""
    from hpcwhirl.scene import to_toml
    from hpcwhirl.scene.documents import parsed_toml
    from hpcwhirl.store.atomic import replacing

    if not worth:
        say(f"{args.write} is not written: no case is worth integrating")
        return
    given = load_document(Path(args.scene)) if Path(args.scene).is_file() else {}
    tables = {name: dict(given[name]) for name in KEPT if name in given}
    document = parsed_toml(to_toml(found.scene)) | tables
    document["sweep"] = {**document.get("sweep", {}), "speed": worth}
    with replacing(args.write) as part:
        part.write_text(tomli_w.dumps(document), encoding="utf-8")
    say(f"{args.write}: next hpcwhirl campaign {args.write}")


def _show(found: Study, share: float, worth: list[float]) -> None:
    from rich.console import Console
    from rich.table import Table

    heads = "place", f"peak at, {shown_in(ANGULAR)[0]}", "amplitude", "AF"
    table = Table(*heads, "margin", "required", "verdict")
    for place, peak, margin in found.margins():
        table.add_row(place, *_row(place, peak, margin))
    console = Console()
    for line in _head(found):
        console.print(line, soft_wrap=True, markup=False)
    if table.rows:
        console.print(table)
    else:
        console.print("no peak at these speeds")
    for line in _clearance(found) + _worth(found, share, worth):
        console.print(line, soft_wrap=True, markup=False)


def _head(found: Study) -> list[str]:
    of = ", 4 * 6350 g mm W/N of API 617" if found.assumed else ""
    low, high = (in_shown(speed, ANGULAR, 5) for speed in found.operating)
    ends = (in_shown(found.points[i].speed, ANGULAR, 4) for i in (0, -1))
    moment = in_shown(abs(found.moment), "kg m", 4)
    line = (
        f"response to an unbalance of {moment}{of}, without contact, from "
        f"{' to '.join(ends)}; operating speeds {low} to {high}"
    )
    return [line]


def _row(place: str, peak: Peak, margin: Margin) -> tuple[str, ...]:
    """Return the cells of a peak in the table, but its place."""
    from hpcwhirl.analysis.response import unit_of

    factor = peak.amplification
    side = "" if peak.two_sided else ", of one side"
    needed = margin.required
    return (
        f"{shown_in(ANGULAR)[1] * peak.speed:.2f}",
        in_shown(peak.amplitude, unit_of(place), 4),
        "-" if factor is None else f"{factor:.3g}{side}",
        f"{100 * margin.actual:.1f} %",
        "-" if needed is None else f"{100 * needed:.1f} %",
        margin.verdict,
    )


def _clearance(found: Study) -> list[str]:
    """Return lines of text on the clearance used, and on the force on the supports."""
    from hpcwhirl.analysis.api617 import CLEARANCE

    worst, scaled = found.worst(), found.scale * found.worst().used
    kept = "kept" if scaled <= CLEARANCE else "exceeded"
    hardest = max(found.points, key=lambda one: one.size("supports"))
    used = (
        f"clearance used: {100 * worst.used:.4g} % of {in_shown(worst.room, 'm', 4)} "
        f"at {in_shown(worst.speed, ANGULAR, 5)}; times API 617's scale factor "
        f"{found.scale:.3g}: {100 * scaled:.4g} %, limit {100 * CLEARANCE:g} %: {kept}"
    )
    force = (
        f"force on the supports: at most {in_shown(hardest.size('supports'), 'N', 4)}, "
        f"at {in_shown(hardest.speed, ANGULAR, 5)}"
    )
    return [used, force]


def _worth(found: Study, share: float, worth: list[float]) -> list[str]:
    """Return lines of text on where tips touch, and the sweep that is worth it."""
    lines = [_bands("the tips touch the casing", found.bands(1.0))]
    if growing := found.growing():
        told = "free motion grows, and no circle is kept,"
        lines.append(_bands(told, growing))
    if share < 1.0:
        told = f"the tips use at least {100 * share:g} % of the clearance"
        lines.append(_bands(told, found.bands(share)))
    if not worth:
        return [*lines, "no case is worth integrating for this unbalance"]
    unit, factor = shown_in(ANGULAR)
    texts = [f'"{factor * v:.6g} {unit}"' for v in worth]
    rows = [", ".join(texts[i : i + NAMED]) for i in range(0, len(texts), NAMED)]
    body = ",\n  ".join(rows)
    return [*lines, "worth integrating:", f"[sweep]\nspeed = [\n  {body},\n]"]


def _bands(told: str, bands: list[tuple[float, float]]) -> str:
    """Return a sentence on bands of speed, such as "... from 300 to 310 rad/s"."""
    spans: list[Any] = [
        " to ".join(in_shown(end, ANGULAR, 5) for end in band) for band in bands
    ]
    return f"{told} from {', '.join(spans)}" if spans else f"{told} at no speed"
