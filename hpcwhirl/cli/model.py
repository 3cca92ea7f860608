"""`hpcwhirl model`: modal table, critical speeds, time-step limits."""

from __future__ import annotations

import argparse
from typing import Any

from hpcwhirl.analysis.critical import critical_of_families
from hpcwhirl.case.explain import facts_of_file, facts_of_plan
from hpcwhirl.case.resolve import Case, resolve
from hpcwhirl.cli.options import (
    add_explain,
    add_scene,
    print_json,
    print_notes,
    scene_of,
    tell_remarks,
)
from hpcwhirl.errors import SHOWN, InputError, one_line, shown
from hpcwhirl.reduction.families import (
    UNKNOWN,
    as_records,
    modal_table,
)
from hpcwhirl.scene.quantities import DERIVED
from hpcwhirl.structure import blade_stiffness

MOST_ORDERS = 10_000
SHOWN_HZ = 300.0
SHOWN_SPEED = 600.0  # rad/s


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_scene(parser)
    add_explain(parser)
    parser.add_argument(
        "--orders",
        type=int,
        default=12,
        help="super-harmonics of Eq. 13, of 1F (default 12)",
    )
    parser.add_argument(
        "--up-to", type=float, default=SHOWN_HZ, metavar="HZ",
        help=f"highest frequency printed (default {SHOWN_HZ:g}; JSON has them all)",
    )  # fmt: skip


def facts_of(case: Case, orders: int) -> dict[str, Any]:
    """Return the facts that `model --json` prints."""
    engine, table = case.given.engine, modal_table(case.model)
    speeds = critical_of_families(table, orders)
    foreign = engine.file != ""  # of its blades, tips alone are known
    return {
        "engine": engine.name,
        "modes": as_records(table),
        "blade_stiffness": None if foreign else blade_stiffness(engine.rotor),
        "critical_speeds": speeds,
        "rotor_from_file": facts_of_file(case.model.rotor) if foreign else None,
        "time_step_limits": case.model.limits(),
        "plan": facts_of_plan(case),
    }


def run(args: argparse.Namespace) -> int:
    """Print the model's facts."""
    if not 1 <= args.orders <= MOST_ORDERS:
        msg = f"--orders must be >= 1 and <= {MOST_ORDERS}, got {shown(args.orders)}"
        raise InputError(msg)
    scene = scene_of(args.scene, args.settings)
    facts = facts_of(resolve(scene), args.orders)
    tell_remarks(scene)
    if args.json:
        print_json(facts)
    elif args.explain:
        print_notes(facts["plan"]["left_out"])
    else:
        _show(facts, args.up_to, scene.nodal_diameter)
    return 0


def _show_plan(plan: dict[str, Any]) -> None:
    if plan["truncation_error"] is not None:
        print(
            f"modes left out: relative error of some {plan['truncation_error']:.2g} in "
            "motions that touch (estimate)"
        )
    part = f"one of {plan['folds']} sectors" if plan["folds"] > 1 else "the whole"
    marched = " and ".join(f"{n} {body}" for body, n in plan["marched"].items())
    print(f"plan {plan['kind']}: {part} is marched, {marched} amplitudes", end="")
    wanted = plan["settles"]
    print(", to the end in closed form once no contact can recur" if wanted else "")


def _show(facts: dict[str, Any], up_to: float, own: int) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    console = Console()
    hertz, speed = DERIVED["frequency"].unit, DERIVED["critical_speed"].unit
    table = Table("body", "family", "nodal diameter", hertz, "centre share")
    for mode in facts["modes"]:
        if mode["frequency_hz"] <= up_to:
            share = mode["centre_share"]
            table.add_row(
                mode["body"],
                mode["family"],
                str(mode["nodal_diameter"]),
                f"{mode['frequency_hz']:.3f}",
                UNKNOWN if share is None else f"{share:.3f}",
            )
    name = escape(one_line(facts["engine"], SHOWN))
    console.print(f"engine {name}, modes up to {up_to:g} {hertz}", table)
    if facts["rotor_from_file"] is None:
        unit = DERIVED["blade_stiffness"].unit
        console.print(
            f"blade stiffness k_blade = {facts['blade_stiffness']:.4g} {unit}"
        )
    else:
        console.print(facts["rotor_from_file"]["told"], soft_wrap=True, markup=False)
    if facts["critical_speeds"]:
        heading = f"critical speed (Eq. 13) up to {SHOWN_SPEED:g} {speed}"
        heading += f", of the load's k = {own} all"
        speeds = Table("nodal diameter", "family", "order", heading)
        for row in facts["critical_speeds"]:
            if row["speed"] > SHOWN_SPEED and row["nodal_diameter"] != own:
                continue
            told = (row[n] for n in ("nodal_diameter", "family", "order"))
            speeds.add_row(*map(str, told), f"{row['speed']:.1f}")
        console.print(speeds)
    for body, limit in facts["time_step_limits"].items():
        unit = DERIVED["time_step_limit"].unit
        console.print(f"time-step limit of the {body}: {limit:.4g} {unit}")
    plan = facts["plan"]
    console.print(f"coordinates: {plan['coordinates']}")
    _show_plan(plan)
