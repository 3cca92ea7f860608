"""Command line: the table of sub-commands and the entry point `main`.

Each sub-command is a module with `arguments`, which declares its options, and `run`,
which does its work and returns the exit code. Modules are imported only when needed, so
that `--help` is fast. For `campaign`, the handlers of signals are installed before
anything else is imported.
"""

from __future__ import annotations

import sys

from hpcwhirl import early_signals

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

COMMANDS = {
    "new": "write a campaign file for a fan from a few numbers",
    "campaign": "integrate all cases of a campaign on all MPI ranks and draw the map",
    "run": "integrate one case and print its summary",
    "status": "show the progress of a campaign, also while it runs",
    "gather": "write results.h5 from the journals and traces of a campaign",
    "classify": "classify the regimes again with other thresholds, without integrating",
    "map": "draw regimes, whirl or a number over the swept inputs",
    "basins": "list which share of starts ends on each motion, at each point",
    "sensitivity": "compute Sobol indices: which drawn input makes an output vary",
    "cases": "list the cases of a campaign that meet a condition",
    "compare": "compare two campaigns: words that changed, numbers that moved",
    "margin": "list the ranges of an input in which all cases are damped",
    "branches": "list where sweeps up and down change their words",
    "edge": "follow the motion on the boundary between two words",
    "figures": "draw spectra, orbits, modal amplitudes, contacts and energy ledgers",
    "export": "write one case as CSV, for MATLAB or for ParaView",
    "report": "write one HTML page to explore a campaign offline",
    "job": "print a job script for the scheduler of a cluster",
    "doctor": "check machine, MPI and directory: what will break, and the remedy",
    "manual": "show a page of the manual, or list the pages",
    "inputs": "list inputs and presets: default, unit, allowed values, meaning",
    "model": "print modal table, critical speeds and time-step limits of an engine",
    "response": "compute the response to an unbalance over the speed, without contact",
    "tradeoff": "measure the error and cost of solver inputs against a finer run",
    "bench": "measure the time of a step and of a case on this core",
    "import-model": "reduce finite-element matrices M and K to an engine file",
    "export-model": "write M, K, D and contact operators of an engine to HDF5",
}


def main(argv: Sequence[str] | None = None) -> int:
    """Run one sub-command and return its exit code (0, 1, 2, 70 or 75).

    Parameters
    ----------
    argv : words after the program's name; None: those of `sys.argv`; this process is
        then the program, and its standard streams may be replaced
    """
    words = list(sys.argv[1:] if argv is None else argv)
    listens = words[:1] == ["campaign"]  # a signal ends other commands
    if listens:
        early_signals.listen()
    try:
        from hpcwhirl.cli.command import run_command

        return run_command(words, program=argv is None)
    finally:
        if listens:
            early_signals.leave(program=argv is None)
