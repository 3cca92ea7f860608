"""Command line: one sub-command, one call. Imports stay lazy: `--help` is fast."""

from __future__ import annotations

import argparse
import importlib
import os
import sys
import traceback
from collections.abc import Sequence
from typing import NoReturn

COMMANDS = {
    "campaign": "integrate a whole design over MPI ranks and draw its map",
    "run": "integrate one case",
    "status": "say how far a campaign is, from its journals",
    "gather": "write results.h5 from journals and traces",
    "classify": "name the regimes again with other thresholds",
    "map": "draw regimes, whirl or a number over the inputs",
    "cases": "list the cases, chosen by a condition",
    "figures": "draw spectra, orbits, contributions, contacts, ledgers",
    "report": "write one HTML file to explore a campaign with, offline",
    "job": "print a job script for slurm, pbs, lsf, sge or flux",
    "doctor": "say what will break here, and how to mend it",
    "model": "modal table, critical speeds, time-step limits",
    "tradeoff": "measure what accuracy costs, against a finer reference",
    "bench": "measure what a step costs on this core",
    "export-model": "write M, K, D and contact operators to HDF5",
}
COMPLETE, FAILED, WRONG_INPUT, INTERNAL, STOPPED = 0, 1, 2, 70, 75
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


class _Parser(argparse.ArgumentParser):
    """A parser whose complaint is one line, as that of every other wrong input."""

    def error(self, message: str) -> NoReturn:
        """Raise instead of printing the usage and leaving."""
        from hpcwhirl.errors import InputError

        raise InputError(f"{message} (see {self.prog} --help)")


def _parser() -> argparse.ArgumentParser:
    from hpcwhirl import __version__

    parser = _Parser(
        prog="hpcwhirl",
        description="Whirl of a bladed disk in contact with its casing.",
    )
    parser.add_argument("--version", action="version", version=__version__)
    parser.add_argument("command", choices=COMMANDS, metavar="COMMAND")
    parser.epilog = "commands: " + "; ".join(f"{k}: {v}" for k, v in COMMANDS.items())
    return parser


def _command(name: str) -> str:
    from hpcwhirl.errors import unknown

    if name not in COMMANDS:
        raise unknown("command", name, COMMANDS)
    return f"hpcwhirl.cli.{name.replace('-', '_')}"


def main(argv: Sequence[str] | None = None) -> int:
    """Run one sub-command and return its exit code (0, 1, 2, 70 or 75)."""
    words = list(sys.argv[1:] if argv is None else argv)
    for name in THREADS:
        os.environ.setdefault(name, "1")
    from hpcwhirl.errors import WhirlError

    try:
        if not words or words[0].startswith("-"):
            parser = _parser()
            if words:
                parser.parse_args(words)
            parser.print_help()
            return WRONG_INPUT
        module = importlib.import_module(_command(words[0]))
        parser = _Parser(prog=f"hpcwhirl {words[0]}", description=COMMANDS[words[0]])
        module.arguments(parser)
        return int(module.run(parser.parse_args(words[1:])))
    except WhirlError as failed:
        print(f"hpcwhirl: error: {failed}", file=sys.stderr)
        return WRONG_INPUT
    except BrokenPipeError:
        return FAILED
    except Exception:  # noqa: BLE001 - 1 would say that some cases failed
        traceback.print_exc()
        return INTERNAL
