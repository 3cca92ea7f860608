"""What decides the last digits of results: features of the processor, and libraries.

NumPy, OpenBLAS and numba choose their code by the processor, and round otherwise on
another one; so may other versions of them. A campaign's plan has these facts of the
process that began it; every rank compares its own at every start. Models differ, too,
so nothing would be gained by sending them from one rank to all: the integration and
the evaluation of results use the same libraries.
"""

from __future__ import annotations

import platform
from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib import import_module, metadata
from pathlib import Path

from hpcwhirl.errors import WhirlError, say
from hpcwhirl.launch import Communicator
from hpcwhirl.reduction.numbers import blas_told
from hpcwhirl.store.directory.manifest import PlanFile
from hpcwhirl.store.directory.owner import Claim

LIBRARIES = ("numpy", "scipy", "numba", "llvmlite")
FEATURES = "features of the processor"  # a fact, whose words are compared one by one
MOST = 4  # features named in a message
Facts = Mapping[str, str]


class UnlikeError(WhirlError):
    """Raised on all ranks where one of another kind must not compute (`same`)."""


def core_facts() -> dict[str, str]:
    """Return {name: text} of a core, as Linux lists it in /proc/cpuinfo; else {}."""
    try:
        lines = Path("/proc/cpuinfo").read_text("utf-8", errors="replace").splitlines()
    except OSError:
        return {}
    shown = dict(line.split(":", 1) for line in lines if ":" in line)
    return {name.strip(): text.strip() for name, text in shown.items()}


def processor_name() -> str:
    """Return the name of this machine's processor; "" if nothing tells it."""
    return core_facts().get("model name", platform.processor())


def machine_facts() -> dict[str, str]:
    """Return {fact: text} of what decides the last digits of this process's results."""
    features = import_module("numpy._core._multiarray_umath").__cpu_features__
    own = {name: metadata.version(name) for name in LIBRARIES}
    own |= {"BLAS": blas_told(), "C library": " ".join(platform.libc_ver())}
    own |= {"processor": platform.machine()}
    return own | {FEATURES: " ".join(sorted(n for n in features if features[n]))}


def difference(was: Facts, now: Facts) -> str:
    """Return how the facts of two processes differ, for a message; "" if they do not.

    was, now : facts of the process that is compared with, and of the other
    """
    parts = [
        f"{name} {now.get(name, 'none')} instead of {was[name]}"
        for name in was
        if name != FEATURES and now.get(name) != was[name]
    ]
    had, has = (set(facts.get(FEATURES, "").split()) for facts in (was, now))
    parts += [f"without {_some(had - has)}"] if had - has else []
    parts += [f"with {_some(has - had)}"] if has - had else []
    return ", ".join(parts)


def _some(names: set[str]) -> str:
    """Return the first few of some features, and how many others there are."""
    few = " ".join(sorted(names)[:MOST])
    return few + (f" and {len(names) - MOST} others" if len(names) > MOST else "")


def compare(
    machines: Sequence[Facts],
    plan: PlanFile,
    comm: Communicator,
    own: Claim | None,
    *,
    strict: bool,
) -> None:
    """Compare this run's ranks with the process that began the campaign.

    One line on stderr of rank 0 tells of others, and the plan gets their facts.

    Parameters
    ----------
    machines : facts in the campaign's plan, first those of the process that began it
    plan : file of the plan
    comm : communicator of all ranks, each of which must call
    own : rank 0's claim on the directory, without which it writes no plan
    strict : whether a rank of another kind is refused

    Raises
    ------
    UnlikeError
        on all ranks, if one is refused
    """
    facts = machine_facts()
    unlike = facts != machines[0]
    every = comm.allgather(facts if unlike else None)
    if not any(every):
        return
    text = told(machines[0], every)
    if strict:
        raise UnlikeError(f'{text}, and same = "strict" refuses that')
    if comm.rank:
        return
    say(f"{text}: numbers of its cases may differ (hpcwhirl manual clusters)")
    new = [one for number, one in enumerate(every)
           if one and one not in (*machines, *every[:number])]  # fmt: skip
    if new and own is not None:
        old = plan.read()
        plan.write(replace(old, machines=[*old.machines, *new]), own.check)


def told(first: Facts, every: Sequence[Facts | None]) -> str:
    """Return which ranks are not of the kind of the process that began a campaign.

    first : facts of that process
    every : for each rank its facts; None: they are the same
    """
    ranks = [number for number, facts in enumerate(every) if facts]
    which = f"rank {ranks[0]} computes" if len(ranks) == 1 else (
        f"{len(ranks)} of {len(every)} ranks, first rank {ranks[0]}, compute"
    )  # fmt: skip
    if len(every) == 1:
        which = "this process computes"
    differs = difference(first, every[ranks[0]] or {})
    return f"{which} otherwise than the process that began the campaign: {differs}"
