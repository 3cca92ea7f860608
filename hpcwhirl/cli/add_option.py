"""Declaration of one option of a command, in the form in which its help shows it.

This module imports nothing slow, so that `--help` is fast.
"""

from __future__ import annotations

import argparse
from typing import Any


def add_option(
    parser: argparse._ActionsContainer,
    usage: str,
    told: str,
    *,
    default: Any = None,
    **how: Any,
) -> None:
    """Add an option to a command's parser.

    Parameters
    ----------
    parser : parser or group of options
    usage : the option's names, separated by bars, and its value, as ``--at NAME=V``;
        without a value the option is a flag
    told : help text of the option
    default : default value; a number also sets the option's type, a list means that
        the option may be repeated
    how : further arguments of argparse's `add_argument`
    """
    names, _, shape = usage.partition(" ")
    if not shape:
        how = {"action": "store_true"} | how
    else:
        how |= {"metavar": shape, "default": default}
        if isinstance(default, list):
            how = {"action": "append"} | how
        elif isinstance(default, int | float):
            how = {"type": type(default)} | how
    parser.add_argument(*names.split("|"), help=told, **how)
