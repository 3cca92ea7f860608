"""Two of everything at once in one directory."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from attacks.family import Chance, Family, Verdict, fault, first
from attacks.process import Ended, command, fork, run
from attacks.specimens import PLAIN, Specimen, Table, differs, parts, table, undisturbed

LIMITS = ("--set", "significance=1e-3", "--set", "drift=10", "--set", "rise=1e-9")
SPREADS = (0.0, 0.005, 0.03)  # s between the starts of two


@dataclass(frozen=True)
class Pair:
    """A campaign, its truth, and the words that other thresholds give it."""

    specimen: Specimen
    relabelled: Table
    seconds: float


def prepare(place: Path) -> Pair:
    """Compute a campaign, and classify a copy of it."""
    specimen = undisturbed(replace(PLAIN, duration=4e-3, speeds=8), place)
    other = shutil.copytree(specimen.out, place / "classified")
    ended = run(["classify", other, *LIMITS, "--write"], place)
    if ended.code:
        raise RuntimeError(ended.err)
    begun = time.monotonic()
    run(specimen.calls(place / "timed")[0], place)
    return Pair(specimen, table(other), time.monotonic() - begun)


def _at_once(
    calls: Sequence[Sequence[str]], spread: float, chance: Chance, place: Path
) -> list[Ended]:
    """Start commands within `spread` s of one another; return how each ended."""
    children = []
    for number, words in enumerate(calls):
        children.append(fork(command(words), place, f"command-{number}"))
        time.sleep(chance.uniform(0.0, spread))
    return [child.wait() for child in children]


def _faults(ends: Sequence[Ended], *allowed: int) -> str:
    return first(fault(ended, allowed) for ended in ends)


def attempt(shared: Pair, chance: Chance, place: Path) -> Verdict:
    """Let commands meet in a directory."""
    kind, out = chance.weighted(KINDS), place / "out"
    wrong = kind(shared, chance, out) or parts(out)
    return Verdict(kind.__name__.strip("_"), wrong)


def _gathers(shared: Pair, chance: Chance, out: Path) -> str:
    """Gather a directory several times at once."""
    shutil.copytree(shared.specimen.out, out)
    if chance.random() < 0.5:
        (out / "results.h5").unlink()
    calls = [["gather", str(out), *(["--compress", "1"] * (chance.random() < 0.3))]
             for _ in range(chance.choice([2, 2, 2, 3]))]  # fmt: skip
    ends = _at_once(calls, chance.choice(SPREADS), chance, out.parent)
    return _faults(ends, 0) or differs(out, shared.specimen.truth, out.parent)


def _classify(shared: Pair, chance: Chance, out: Path) -> str:
    """Gather and classify: either's words, all other values the truth."""
    shutil.copytree(shared.specimen.out, out)
    classify = ["classify", str(out), *LIMITS, "--write"]
    calls = [["gather", str(out)], *[classify] * chance.choice([1, 1, 2])]
    chance.shuffle(calls)
    ends = _at_once(calls, chance.choice(SPREADS), chance, out.parent)
    truths = (shared.specimen.truth, shared.relabelled)
    wrong = [differs(out, truth, out.parent) for truth in truths]
    return _faults(ends, 0) or (f"neither's file: {wrong[0]}" if all(wrong) else "")


def _campaigns(shared: Pair, chance: Chance, out: Path) -> str:
    """Two campaigns in a directory: one owns it, the other is told whose it is."""
    calls = shared.specimen.calls(out) * chance.choice([2, 2, 3])
    spread = chance.choice([0.0, 0.01, shared.seconds])
    ends = _at_once(calls, spread, chance, out.parent)
    refused = [ended for ended in ends if ended.code]
    if len(refused) == len(ends):
        return f"none is complete: {'; '.join(ended.last for ended in ends)}"
    unsaid = [f"not told whose it is: {end.last}" for end in refused
              if "process" not in end.err]  # fmt: skip
    return _faults(ends, 0, 2, 75) or first(unsaid) or _once(shared.specimen, out)


def _shards(shared: Pair, chance: Chance, out: Path) -> str:
    """All shards of a campaign at once, as elements of an array job."""
    mode = replace(shared.specimen.mode, shards=chance.choice([2, 3]))
    calls = mode.calls(shared.specimen.file, out)
    ends = _at_once(calls, chance.choice([0.0, 0.05]), chance, out.parent)
    return _faults(ends, 0) or _once(shared.specimen, out)


def _status(shared: Pair, chance: Chance, out: Path) -> str:
    """Status and gather while a campaign computes; at its end all is there."""
    (words,) = shared.specimen.calls(out)
    campaign, asked = fork(command(words), out.parent, "campaign"), []
    while campaign.alive:
        if (out / "campaign.json").exists():
            name = chance.choice(["status", "gather", "gather"])
            asked.append(run([name, str(out)], out.parent))
        time.sleep(chance.uniform(0.0, 0.02))
    wrong = fault(campaign.wait(), (0,)) or _faults(asked, 0, 1)
    return wrong or _once(shared.specimen, out)


def _once(specimen: Specimen, out: Path) -> str:
    """Return what differs from the truth, or that cases were computed twice."""
    from hpcwhirl.store.directory.journal import Journals

    rows = [row["digest"] for log in Journals(out).by_file().values() for row in log]
    twice = len(rows) != len(set(rows))
    wrong = differs(out, specimen.truth, out.parent)
    return wrong or (f"{len(rows)} results of {len(set(rows))} cases" if twice else "")


KINDS: dict[Callable[[Pair, Chance, Path], str], int] = {
    _gathers: 10, _classify: 2, _campaigns: 2, _shards: 1, _status: 1,
}  # fmt: skip
FAMILIES = {
    f"together{suffix}": Family(f"commands in one directory, HDF5's locks {locks}", 300,
                                prepare, attempt, {"HDF5_USE_FILE_LOCKING": value})
    for suffix, locks, value in (("", "on", "TRUE"), ("-unlocked", "off", "FALSE"))
}  # fmt: skip
