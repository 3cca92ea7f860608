"""Parts of a script by name, each done in a process of its own, which says JSON."""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
INSIDE = "SCRIPT_PART"  # of the environment: the part that this process is for


def asked(parser: Any, what: str, known: Sequence[str]) -> argparse.Namespace:
    """Return what was asked for; `names` are those of the parts.

    Parameters
    ----------
    parser : that has the script's own options
    what : a part is, for messages
    known : names of all parts
    """
    parser.add_argument("--only", default="", help=f"some {what}, by commas")
    parser.add_argument("--share", type=float, default=1.0, help="of the full counts")
    parser.add_argument("--jobs", type=int, default=1, help="processes at once")
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    args.inside = os.environ.get(INSIDE, "")
    names = args.inside or args.only
    args.names = names.split(",") if names else [*known]
    for name in args.names:
        if name not in known:
            parser.error(f"unknown {what} {name}; known: {', '.join(known)}")
    return args


def each(
    args: argparse.Namespace, environment: Callable[[str], Mapping[str, str]]
) -> Iterator[dict[str, Any]]:
    """Yield what this script says of each part, called again with `INSIDE` set.

    environment : called with a name; what the process has beside this one's
    """

    def one(name: str) -> dict[str, Any]:
        more = dict.fromkeys(THREADS, "1") | {**environment(name), INSIDE: name}
        call = [sys.executable, *sys.argv]
        done = subprocess.run(
            call, env=os.environ | more, stdout=subprocess.PIPE, check=False
        )
        if not done.stdout:
            raise SystemExit(f"{name} itself ended with {done.returncode}")
        return dict(json.loads(done.stdout))

    with ThreadPoolExecutor(args.jobs) as pool:
        yield from pool.map(one, args.names)
