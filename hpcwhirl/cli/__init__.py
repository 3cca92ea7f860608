"""Command line: one sub-command, one call. Imports stay lazy: `--help` is fast.

Before anything else is imported, a campaign listens to the signals that end it.
"""

from __future__ import annotations

import sys

from hpcwhirl import early

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

COMMANDS = {
    "campaign": "integrate a whole design over MPI ranks and draw its map",
    "run": "integrate one case",
    "status": "say how far a campaign is, from its journals",
    "gather": "write results.h5 from journals and traces",
    "classify": "name the regimes again with other thresholds",
    "map": "draw regimes, whirl or a number over the inputs",
    "sensitivity": "say which drawn input makes what vary, by Sobol indices",
    "cases": "list the cases, chosen by a condition",
    "figures": "draw spectra, orbits, contributions, contacts, ledgers",
    "report": "write one HTML file to explore a campaign with, offline",
    "job": "print a job script for slurm, pbs, lsf, sge or flux",
    "doctor": "say what will break here, and how to mend it",
    "inputs": "list inputs and presets: default, unit, meaning, allowed",
    "model": "modal table, critical speeds, time-step limits",
    "tradeoff": "measure what accuracy costs, against a finer reference",
    "bench": "measure what a step costs on this core",
    "import-model": "reduce M and K of finite elements to an engine's file",
    "export-model": "write M, K, D and contact operators to HDF5",
}


def main(argv: Sequence[str] | None = None) -> int:
    """Run one sub-command and return its exit code (0, 1, 2, 70 or 75).

    Parameters
    ----------
    argv : words after the program's name; None: this process is that program
    """
    words = list(sys.argv[1:] if argv is None else argv)
    listens = words[:1] == ["campaign"]  # all others die of a signal, as any program
    if listens:
        early.listen()
    try:
        from hpcwhirl.cli.command import run_command, run_program

        return run_program(words) if argv is None else run_command(words)
    finally:
        if listens:
            early.leave(program=argv is None)
