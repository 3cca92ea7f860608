"""Units in which a campaign's file gives its inputs; commands show numbers in them."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

from hpcwhirl.errors import WhirlError
from hpcwhirl.scene.units import written_in


def in_written_units(
    run: Callable[[argparse.Namespace], int], args: argparse.Namespace
) -> int:
    """Run a command while numbers are shown in the units of its file or results.

    Returns the command's exit code
    """
    with written_in(units_of(args)):
        return run(args)


def units_of(args: argparse.Namespace) -> tuple[str, ...]:
    """Return the units of the results or the file that a command's arguments name.

    () where neither can be read: the command itself tells why.
    """
    given = vars(args)
    names = ("folder", "file", "scene", "a")  # of `compare` the first directory
    place = next((given[name] for name in names if given.get(name)), None)
    try:
        return _units_at(Path(place)) if place else ()
    except (WhirlError, OSError):
        return ()


def _units_at(place: Path) -> tuple[str, ...]:
    from hpcwhirl.scene.documents import load_document, units_of_document

    if place.suffix == ".toml":
        return units_of_document(load_document(place))
    from hpcwhirl.store.reading import results_file

    results = results_file.results_of(place)
    return results_file.units_of(results) if results.is_file() else ()
