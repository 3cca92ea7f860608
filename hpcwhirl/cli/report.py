"""`hpcwhirl report`: write a campaign as one HTML file that works offline."""

from __future__ import annotations

import argparse
import webbrowser
from contextlib import suppress
from functools import partial
from pathlib import Path

from hpcwhirl.cli.command import add_option
from hpcwhirl.cli.options import (
    OF_CAMPAIGN,
    add_json,
    add_units,
    asked_units,
    check_writable,
    print_paths,
)
from hpcwhirl.cli.so_far import gathered_so_far
from hpcwhirl.errors import InputError, say


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `hpcwhirl report` on its parser."""
    # fmt: off
    parser.add_argument("folder", type=Path, metavar="DIR", help=OF_CAMPAIGN)
    add_option(parser, "--out FILE.html",
        "file to write (default: report.html in DIR)", type=Path)
    add_option(parser, "--animate CASE",
        "show the wheel of this case, by its number, in motion; the case is integrated "
        "again unless full traces were kept; may be repeated (default: a case of each "
        "word, of those with full traces)", type=int, action="append", default=[])
    add_option(parser, "--live PORT",
        "follow the campaign while it runs: serve the page on this machine alone, at "
        "PORT or a free port, until the campaign has ended", type=int, nargs="?",
        const=0)
    add_option(parser, "--open", "show the page in the web browser")
    add_json(parser)
    add_units(parser, "axes, cases and colours (filters stay in SI)")


def run(args: argparse.Namespace) -> int:
    """Write a campaign's HTML page, print its path; return the exit code.

    With --live serve the page instead.
    """
    if args.live is not None:
        return _serve(args)
    from hpcwhirl.report.page.build import write_page
    from hpcwhirl.scene.units import showing
    from hpcwhirl.store.directory.campaign_directory import Directory

    check_writable(args.out, folder=False)
    gathered_so_far(args.folder)
    with showing(asked_units(args.units)):
        page = write_page(Directory(args.folder), args.out, args.animate)
    print_paths(args, [page])
    if args.open:
        _open(page.resolve().as_uri())
    return 0


def _open(address: str) -> None:
    if not webbrowser.open(address):
        say(f"no web browser could be started: open {address}")


def _serve(args: argparse.Namespace) -> int:
    """Serve a campaign's page until the campaign has ended; return the exit code."""
    from hpcwhirl.report.live import serve
    from hpcwhirl.scene.units import showing
    from hpcwhirl.store.directory.campaign_directory import Directory

    if args.out or args.animate or args.json:
        raise InputError("--live writes no file: leave out --out, --animate and --json")
    directory = Directory(args.folder)

    def begun(address: str) -> None:
        print(address, flush=True)
        if args.open:
            _open(address)

    with showing(asked_units(args.units)), suppress(KeyboardInterrupt):
        gathered = partial(gathered_so_far, args.folder, quiet=True)
        say(f"the server has ended: {serve(directory, gathered, begun, args.live)}")
    return 0
