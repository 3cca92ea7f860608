"""Options that several sub-commands share, and how facts are printed."""

from __future__ import annotations

import argparse
import json
import math
import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hpcwhirl.errors import MissingFileError
from hpcwhirl.scene import (
    DESIGN_TABLES,
    NAMED,
    Scene,
    apply_settings,
    check_kept,
    load_document,
    loss_of,
    named_scene,
    parse_setting,
    preset_in_short,
    preset_inputs,
    preset_loss,
    preset_names,
    preset_of,
    scene_of_document,
)

if TYPE_CHECKING:
    from hpcwhirl.scene.many import Many

OR_FILE = "of a campaign, or a file of hpcwhirl run --out"
UNTOUCHED = (
    "no blade touched the casing: words tell of free motion alone; lengths are in m, "
    "force in N, pulse in s"
)


class _Preset(argparse.Action):
    """Put a preset's inputs before those of ``--set``, which count over them."""

    def __call__(
        self, parser: Any, namespace: Any, name: Any, option: Any = None
    ) -> None:
        """Take the name of a preset."""
        del option
        if getattr(namespace, "preset", None):
            parser.error("--preset is given twice")
        namespace.preset = name
        inputs = [f"{n}={value}" for n, value in preset_inputs(name).items()]
        setattr(namespace, self.dest, inputs + getattr(namespace, self.dest))


def add_set(parser: argparse.ArgumentParser) -> None:
    """Add ``--set NAME=VALUE``, repeatable, and ``--preset NAME``."""
    known = ", ".join(preset_names())
    parser.add_argument(
        "--preset",
        dest="settings",
        action=_Preset,
        default=[],
        metavar="NAME",
        help=f"{known}: solver inputs by name, over those of a file and below --set; "
        "as preset in a file's [solver], too; "
        "what each sets and loses: hpcwhirl inputs preset",
    )
    parser.add_argument(
        "--set",
        dest="settings",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="set a scene input by its name, e.g. speed=410 or casing.thickness=0.02",
    )


def tell_preset(scene: Scene) -> None:
    """Say on stderr, in one line, what the preset of a scene loses, if it has one."""
    name = preset_of(scene)
    if not name:
        return
    whole = loss_of(scene)
    told = preset_in_short(name) if whole == preset_loss(name) else whole
    print(f"hpcwhirl: preset {name}: {told} (hpcwhirl inputs {name})", file=sys.stderr)


def tell_remarks(cases: Many | Scene) -> None:
    """Say on stderr what of the inputs looks like another unit, a line each."""
    from hpcwhirl.scene.remarks import remarks

    for line in remarks(cases):
        print(f"hpcwhirl: {line}", file=sys.stderr)


def add_json(parser: argparse.ArgumentParser) -> None:
    """Add ``--json``."""
    parser.add_argument("--json", action="store_true", help="print facts as JSON")


def add_scene(parser: argparse.ArgumentParser) -> None:
    """Add the positional scene, ``--set`` and ``--json``."""
    parser.add_argument(
        "scene",
        nargs="?",
        default="table2",
        metavar="SCENE",
        help=f"TOML file, or one of {', '.join(NAMED)} (default table2)",
    )
    add_set(parser)
    add_json(parser)


def add_explain(parser: argparse.ArgumentParser) -> None:
    """Add ``--explain``."""
    parser.add_argument(
        "--explain",
        action="store_true",
        help="say what the plan leaves out, why that is safe, and what it saves",
    )


def print_notes(notes: Sequence[Mapping[str, Any]], file: Any = None) -> None:
    """Print what a plan leaves out."""
    if not notes:
        print("plan: nothing is left out", file=file)
    for note in notes:
        print(f"left out: {note['left_out']}", file=file)
        print(f"  safe: {note['why']}", file=file)
        print(f"  saves: {note['saves']}", file=file)


def scene_of(name: str, settings: Sequence[str]) -> Scene:
    """Return the scene of a file or a name, with settings applied.

    A word without a dot or slash that is no file is taken for a named scene. Of a
    campaign's file the scene alone is taken, and that is said on stderr.
    """
    path = Path(name)
    bare = path.suffix == "" and "/" not in name and not path.exists()
    given = parsed(settings)
    if bare:
        return apply_settings(named_scene(name), given)
    document = load_document(path)
    scene = scene_of_document(document, DESIGN_TABLES, path.parent, given)
    _tell_ignored(path, document)
    return scene


def _tell_ignored(path: Path, document: Mapping[str, Any]) -> None:
    """Say on stderr, in one line, which tables of a campaign's file are not used."""
    found = [name for name in DESIGN_TABLES if name in document]
    if found:
        tables = ", ".join("[[cases]]" if n == "cases" else f"[{n}]" for n in found)
        told = f"hpcwhirl: {path}: a campaign's {tables} ignored: one case of what all"
        print(f"{told} cases share (and of --set)", file=sys.stderr)


def parsed(settings: Sequence[str]) -> dict[str, Any]:
    """Return {dotted name: value} of ``--set`` and ``--preset``.

    Raises
    ------
    InputError
        also where one of them would be set again by another
    """
    found = dict(parse_setting(text) for text in settings)
    check_kept(found)
    return found


def check_writable(path: Path | None, *, folder: bool) -> None:
    """Raise one clear line, before any work, where the output cannot be written."""
    if path is None:
        return
    if path.exists() and path.is_dir() != folder:
        kind = "directory" if folder else "file"
        msg = f"cannot write {path}: it is not a {kind}"
        raise MissingFileError(msg)
    whole = Path(os.path.realpath(path))  # Path.resolve raises where links go around
    place = whole
    while not os.path.lexists(place):
        place = place.parent
    if not os.access(place, os.W_OK) or (place != whole and not place.is_dir()):
        msg = f"cannot write {path}: {place} is not a writable directory"
        raise MissingFileError(msg)


def print_json(facts: Mapping[str, Any]) -> None:
    """Print facts as strict JSON; a number that is not finite becomes null."""
    print(json.dumps(finite(facts), indent=2, allow_nan=False))


def finite(value: Any) -> Any:
    """Return facts with numbers that are not finite replaced by None."""
    if isinstance(value, Mapping):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [finite(item) for item in value]
    if hasattr(value, "item"):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
