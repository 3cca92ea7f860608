"""Options and output shared by several sub-commands."""

from __future__ import annotations

import argparse
import json
import math
import os
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hpcwhirl.cli.command import add_option
from hpcwhirl.errors import InputError, MissingFileError, say
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
from hpcwhirl.scene.documents import naming_lines
from hpcwhirl.scene.quantities import INPUTS, ROW
from hpcwhirl.scene.units import told_of, units_asked

if TYPE_CHECKING:
    from hpcwhirl.scene.batch_validation import Many

OR_FILE = "directory of a campaign, or a file written by hpcwhirl run --out"
USUAL = "table2"  # scene by default
SCENES = f"scene file (TOML), or one of {', '.join(NAMED)} (default {USUAL})"
OF_CAMPAIGN = "directory of a campaign"
EVERY = 5.0  # s, least time between two lines on the progress
UNTOUCHED = (
    "no blade touched the casing: words describe free motion only; lengths are in m, "
    "force in N, pulse in s"
)


class _Preset(argparse.Action):
    """Action of argparse for ``--preset``: store the preset's inputs as settings.

    They come before those of ``--set``, which override them.
    """

    def __call__(self, parser: Any, namespace: Any, name: Any, *_option: Any) -> None:
        """Put the inputs of the preset `name` before the settings given so far."""
        if getattr(namespace, "preset", None):
            parser.error("--preset is given twice")
        namespace.preset = name
        inputs = [f"{n}={value}" for n, value in preset_inputs(name).items()]
        setattr(namespace, self.dest, inputs + getattr(namespace, self.dest))


def add_set(parser: argparse.ArgumentParser) -> None:
    """Add the options ``--set NAME=VALUE``, repeatable, and ``--preset NAME``."""
    # fmt: off
    known = ", ".join(preset_names())
    add_option(parser, "--preset NAME",
        f"a named set of solver inputs: {known}; it overrides the file (where "
        "[solver] may name a preset, too) and is overridden by --set; inputs and "
        "accuracy of each preset: hpcwhirl inputs preset",
        default=[], dest="settings", action=_Preset)
    add_option(parser, "--set NAME=VALUE",
        "set an input, e.g. speed=410 or casing.thickness=0.02; may be repeated; for "
        "the names see: hpcwhirl inputs", default=[], dest="settings")


def tell_preset(scene: Scene) -> None:
    """Print a line on stderr that tells which accuracy the scene's preset gives up.

    Nothing is printed for a scene without preset.
    """
    name = preset_of(scene)
    if not name:
        return
    whole = loss_of(scene)
    loss = preset_in_short(name) if whole == preset_loss(name) else whole
    say(f"preset {name}: {loss} (hpcwhirl inputs {name})")


def tell_remarks(cases: Many | Scene, *, load: bool = False) -> None:
    """Print on stderr one line for each input that seems to be in a wrong unit.

    cases : the scene, or the inputs of all cases of a campaign
    load : whether to warn also if the pulse moves the casing by many gaps
    """
    from hpcwhirl.scene.remarks import remarks

    for line in remarks(cases, load=load):
        say(line)


def seldom(tell: Callable[..., None], last: float = 0.0) -> Callable[..., None]:
    """Return a function that calls `tell`, at most once in `EVERY` seconds.

    Other calls do nothing; it serves lines on the progress.

    last : time of an earlier call of `tell`, s, by `time.monotonic`; 0: none
    """

    def timed(*told: Any) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last >= EVERY:
            last = now
            tell(*told)

    return timed


def add_take_over(parser: argparse.ArgumentParser) -> None:
    """Add the option ``--take-over``, to take a directory from a dead process."""
    # fmt: off
    add_option(parser, "--take-over",
        "take over DIR at once from a process on another machine that you know to be "
        "dead; without this option such a process counts as dead 2 minutes after its "
        "last sign of life")


def add_units(parser: argparse.ArgumentParser, what: str) -> None:
    """Add the option ``--units``, which sets the units of printed or drawn numbers.

    what : what is shown in these units, for the help
    """
    # fmt: off
    add_option(parser, "--units UNIT[,UNIT]",
        f"units, such as mm,rpm,kN, of {what}; si: as stored (default: practical, "
        "those of the campaign's file, else mm and kN, in text and figures; si in CSV "
        "and JSON)")


def asked_units(text: str | None) -> tuple[str, ...]:
    """Return the names of units that ``--units`` gives, checked.

    text : text of the option, such as "mm,rpm"; None: practical units
    """
    known = {q.unit for table in (INPUTS, ROW) for q in table.values()}
    return told_of("--units", lambda: units_asked(text, sorted(known)))


def add_json(parser: argparse._ActionsContainer) -> None:
    """Add the option ``--json``, which prints JSON instead of text."""
    # fmt: off
    add_option(parser, "--json", "print JSON, not text")


def add_scene_name(parser: argparse.ArgumentParser) -> None:
    """Add the optional argument SCENE: a scene's file, or name of a built-in scene."""
    parser.add_argument("scene", nargs="?", default=USUAL, metavar="SCENE", help=SCENES)


def add_scene(parser: argparse.ArgumentParser) -> None:
    """Add the argument SCENE, and the options ``--set``, ``--preset``, ``--json``."""
    add_scene_name(parser)
    add_set(parser)
    add_json(parser)


def add_explain(parser: argparse.ArgumentParser) -> None:
    """Add the option ``--explain``, which says what the computation leaves out."""
    # fmt: off
    add_option(parser, "--explain",
        "say what the computation leaves out, why that is safe, and what it saves")


def print_notes(notes: Sequence[Mapping[str, Any]], file: Any = None) -> None:
    """Print what the integration of a case leaves out, why that is safe, and its gain.

    Parameters
    ----------
    notes : dicts of `left_out`, `why` and `saves`, from the case's plan
    file : stream to print to; None: stdout
    """
    if not notes:
        print("plan: nothing is left out", file=file)
    for note in notes:
        print(f"left out: {note['left_out']}", file=file)
        print(f"  safe: {note['why']}", file=file)
        print(f"  saves: {note['saves']}", file=file)


def print_bounds(bounds: Sequence[Mapping[str, Any]]) -> None:
    """Print the bounds by which parts of a case are left out.

    bounds : dicts with a text `told`, from `case.explain.facts_of_bounds`
    """
    for bound in bounds:
        print(f"bound: {bound['told']}")


def scene_of(name: str, settings: Sequence[str]) -> Scene:
    """Return the scene that the argument SCENE names, with settings applied.

    See `document_of` and `scene_in`.

    Parameters
    ----------
    name : path of a file, or name of a scene
    settings : texts ``NAME=VALUE`` of --set and --preset
    """
    document = document_of(name)
    if document is None:
        return apply_settings(named_scene(name), parsed(settings))
    return scene_in(Path(name), document, settings)


def document_of(name: str) -> dict[str, Any] | None:
    """Return the parsed TOML of a file; None for the name of a built-in scene.

    name : path of a file, or a word without dot or slash that is no file
    """
    path = Path(name)
    bare = path.suffix == "" and "/" not in name and not path.exists()
    return None if bare else load_document(path)


def scene_in(path: Path, document: Mapping[str, Any], settings: Sequence[str]) -> Scene:
    """Return the scene of a parsed file, with settings applied.

    If the file is that of a campaign, a line on stderr says that only its scene is
    used.

    Parameters
    ----------
    path, document : the file; its parsed TOML
    settings : texts ``NAME=VALUE`` of --set and --preset
    """
    given = parsed(settings)
    with naming_lines(path, given):
        scene = scene_of_document(document, DESIGN_TABLES, path.parent, given)
    _tell_ignored(path, document)
    return scene


def _tell_ignored(path: Path, document: Mapping[str, Any]) -> None:
    """Print on stderr which tables of a campaign file are ignored, if any.

    A command for one case uses only the scene of the file.

    path, document : the file; its parsed TOML
    """
    ignored = [name for name in DESIGN_TABLES if name in document]
    if ignored:
        tables = ", ".join("[[cases]]" if n == "cases" else f"[{n}]" for n in ignored)
        start = f"{path}: a campaign's {tables} ignored: the case has"
        say(f"{start} the inputs that all cases share (and --set)")


def parsed(settings: Sequence[str]) -> dict[str, Any]:
    """Return the inputs that ``--set`` and ``--preset`` give, {dotted name: value}.

    settings : texts ``NAME=VALUE``

    Raises
    ------
    InputError
        for a wrong name or value, or a setting that another one would override
    """
    values = dict(parse_setting(text) for text in settings)
    check_kept(values)
    return values


def check_writable(path: Path | None, *, folder: bool) -> None:
    """Raise MissingFileError if an output cannot be written; called before any work.

    Parameters
    ----------
    path : file or directory to write; None: nothing is checked
    folder : whether the output is a directory

    Raises
    ------
    MissingFileError
        if `path` cannot be written
    """
    if path is None:
        return
    if path.exists() and path.is_dir() != folder:
        kind = "directory" if folder else "file"
        raise MissingFileError(f"cannot write {path}: it is not a {kind}")
    whole = Path(os.path.realpath(path))  # Path.resolve raises at circular links
    nearest = whole
    while not os.path.lexists(nearest):
        nearest = nearest.parent
    if not os.access(nearest, os.W_OK) or (nearest != whole and not nearest.is_dir()):
        msg = f"cannot write {path}: {nearest} is not a writable directory"
        raise MissingFileError(msg)


def check_picture(path: Path | None) -> None:
    """Raise InputError if --plot has an unknown ending or cannot be written.

    path : file of --plot; None: no picture is wanted, and nothing is checked
    """
    if path and path.suffix not in {".png", ".svg", ".pdf"}:
        raise InputError(f"--plot must end in .png, .svg or .pdf, got '{path.name}'")
    check_writable(path, folder=False)


def print_json(facts: Mapping[str, Any]) -> None:
    """Print data as strict JSON on stdout; numbers that are not finite become null."""
    print(json_of(facts))


def print_paths(args: argparse.Namespace, made: Iterable[Path]) -> None:
    """Print the paths of files that a command has made, a line each, or as JSON.

    args : parsed options, with `json`
    """
    if args.json:
        print_json({"files": [str(path) for path in made]})
        return
    for path in made:
        print(path)


def json_of(data: Any) -> str:
    """Return data as strict JSON; numbers that are not finite become null."""
    return json.dumps(finite(data), indent=2, allow_nan=False)


def finite(value: Any) -> Any:
    """Return nested data for JSON: numbers that are not finite become None."""
    if isinstance(value, Mapping):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [finite(item) for item in value]
    if hasattr(value, "item"):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
