"""Completion for shells, and the man page, from the options of all commands.

Two libraries write them, an extra that is named where it is missing.
"""

from __future__ import annotations

import argparse
import importlib
import sys

from hpcwhirl.cli import COMMANDS
from hpcwhirl.errors import InputError

SHELLS = "bash", "zsh", "tcsh"
MISSING = "needs packages: pip install 'hpcwhirl[terminal]'"


class Completion(argparse.Action):
    """The option `--completion SHELL`: print a shell's completion and end."""

    def __call__(self, *given: object) -> None:
        """Print the script; given : parser, namespace, name of the shell, option."""
        try:
            import shtab
        except ImportError:
            raise InputError(f"--completion {MISSING}") from None
        sys.stdout.write(shtab.complete(whole(), shell=str(given[2])) + "\n")
        raise SystemExit(0)


class ManPage(argparse.Action):
    """The option `--man`: print the man page, in roff, and end."""

    def __call__(self, *_: object) -> None:
        """Print the page."""
        try:
            from argparse_manpage.manpage import Manpage
        except ImportError:
            raise InputError(f"--man {MISSING}") from None
        sys.stdout.write(f"{Manpage(whole())}\n")
        raise SystemExit(0)


def whole() -> argparse.ArgumentParser:
    """Return the parser of the program with those of all commands inside."""
    told = "Whirl of a bladed disk in contact with its casing."
    parser = argparse.ArgumentParser(prog="hpcwhirl", description=told)
    parser.add_argument("--version", action="store_true", help="print the version")
    inside = parser.add_subparsers(metavar="COMMAND")
    for name, meaning in COMMANDS.items():
        own = inside.add_parser(name, help=meaning, description=meaning)
        module = importlib.import_module(f"hpcwhirl.cli.{name.replace('-', '_')}")
        module.arguments(own)
    return parser
