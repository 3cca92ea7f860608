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
    place = given.get("folder") or given.get("file") or given.get("scene")
    try:
        return _units_at(Path(place)) if place else ()
    except (WhirlError, OSError):
        return ()


def _units_at(place: Path) -> tuple[str, ...]:
    from hpcwhirl.scene.documents import load_document, units_of_document

    if place.suffix == ".toml":
        return units_of_document(load_document(place))
    from hpcwhirl.store.reading.results_file import Results, results_of

    results = results_of(place)
    if not results.is_file():
        return ()
    with Results(results) as found:
        return tuple(filter(None, str(found.attrs.get("units", "")).split(",")))
