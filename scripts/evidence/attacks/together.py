"""Two of everything at once in one directory, with HDF5's locks and without."""

from __future__ import annotations

import random
import shutil
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from attacks import specimens
from attacks.apart import Ended, command, fork, run
from attacks.family import Verdict, fault
from attacks.specimens import Specimen, Table, alters, differs, table, undisturbed
from hpcwhirl.store.directory.lines import AT, MARK

WORDS = ("outcome", "regime", "whirl")
LIMITS = ("--set", "significance=1e-3", "--set", "drift=10", "--set", "rise=1e-9")


@dataclass(frozen=True)
class Pair:
    """A campaign, its truth, and the words that other thresholds give it."""

    specimen: Specimen
    relabelled: Table
    seconds: float


def prepare(place: Path) -> Pair:
    """Compute a campaign, and classify a copy of it."""
    specimen = undisturbed(replace(specimens.PLAIN, duration=4e-3, speeds=8), place)
    other = place / "classified"
    shutil.copytree(specimen.out, other)
    ended = run(["classify", other, *LIMITS], place)
    if ended.code:
        raise RuntimeError(ended.err)
    begun = time.monotonic()
    run(specimen.mode.calls(specimen.file, place / "timed")[0], place)
    return Pair(specimen, table(other), time.monotonic() - begun)


def at_once(
    calls: Sequence[Sequence[str]], longest: float, chance: random.Random, place: Path
) -> list[Ended]:
    """Start commands within `longest` s of one another; return how each ended."""
    children = []
    for number, words in enumerate(calls):
        children.append(fork(command(words), place, f"command-{number}"))
        time.sleep(chance.uniform(0.0, longest))
    return [child.wait() for child in children]


def gathers(shared: Pair, chance: random.Random, place: Path) -> Verdict:
    """Gather a directory several times at once."""
    out = place / "out"
    shutil.copytree(shared.specimen.out, out)
    if chance.random() < 0.5:
        (out / "results.h5").unlink()
    calls = [["gather", str(out), *(["--compress", "1"] * (chance.random() < 0.3))]
             for _ in range(chance.choice([2, 2, 2, 3]))]  # fmt: skip
    ended = at_once(calls, chance.choice([0.0, 0.005, 0.03]), chance, place)
    wrong = next((w for w in (fault(one, (0,)) for one in ended) if w), "")
    wrong = wrong or differs(out, shared.specimen.truth, place) or _parts(out)
    return Verdict(f"{len(calls)} gathers", wrong)


def _parts(out: Path) -> str:
    found = [p.name for p in out.rglob("*.part*")]
    return f"left over: {found[0]}" if found else ""


def mixed(shared: Pair, chance: random.Random, place: Path) -> Verdict:
    """Let two different commands, or two campaigns, meet in a directory."""
    kind = chance.choice(
        [_classify, _classify, _campaigns, _campaigns, _shards, _status]
    )
    return kind(shared, chance, place / "out")


def _classify(shared: Pair, chance: random.Random, out: Path) -> Verdict:
    """Gather and classify: either's words, all other values the truth."""
    shutil.copytree(shared.specimen.out, out)
    calls = [["gather", str(out)], ["classify", str(out), *LIMITS]]
    calls += [["classify", str(out), *LIMITS]] * (chance.random() < 0.3)
    chance.shuffle(calls)
    ended = at_once(calls, chance.choice([0.0, 0.005, 0.03]), chance, out.parent)
    wrong = next((w for w in (fault(one, (0,)) for one in ended) if w), "")
    first = differs(out, shared.specimen.truth, out.parent)
    second = differs(out, shared.relabelled, out.parent)
    if not wrong and first and second:
        wrong = f"neither the gatherer's file nor the classifier's: {first}"
    return Verdict("gather + classify", wrong or _parts(out))


def _campaigns(shared: Pair, chance: random.Random, out: Path) -> Verdict:
    """Two campaigns in a directory: one owns it, the other is told whose it is."""
    (words,) = shared.specimen.mode.calls(shared.specimen.file, out)
    spread = chance.choice([0.0, 0.01, shared.seconds])
    both = at_once([words] * chance.choice([2, 2, 3]), spread, chance, out.parent)
    wrong = next((w for w in (fault(one, (0, 2, 75)) for one in both) if w), "")
    if not wrong and not any(one.code == 0 for one in both):
        wrong = f"none is complete: {both[0].last}; {both[1].last}"
    wrong = wrong or next(
        (f"not told whose it is: {one.last}" for one in both
         if one.code and "process" not in one.err), "")  # fmt: skip
    wrong = wrong or differs(out, shared.specimen.truth, out.parent) or _parts(out)
    return Verdict("campaign + campaign", wrong or _once(shared, out))


def _once(shared: Pair, out: Path) -> str:
    """Return whether cases were computed more than once."""
    logs = [p.read_bytes().splitlines() for p in out.glob("journal/*.log")]
    packed = sum(line[AT:].startswith(MARK) for log in logs for line in log)
    lines = packed + sum(b'"digest": ' in line for log in logs for line in log)
    cases = shared.specimen.mode.cases
    return f"{lines} results of {cases} cases" if lines != cases else ""


def _shards(shared: Pair, chance: random.Random, out: Path) -> Verdict:
    """All shards of a campaign at once, as elements of an array job."""
    mode = replace(shared.specimen.mode, shards=chance.choice([2, 3]))
    calls = mode.calls(shared.specimen.file, out)
    ended = at_once(calls, chance.choice([0.0, 0.05]), chance, out.parent)
    wrong = next((w for w in (fault(one, (0,)) for one in ended) if w), "")
    wrong = wrong or differs(out, shared.specimen.truth, out.parent) or _parts(out)
    return Verdict("shards", wrong or _once(shared, out))


def _status(shared: Pair, chance: random.Random, out: Path) -> Verdict:
    """Status and gather while a campaign computes; at its end all is there."""
    (words,) = shared.specimen.mode.calls(shared.specimen.file, out)
    campaign = fork(command(words), out.parent, "campaign")
    asked = []
    while campaign.alive:
        name = chance.choice(["status", "gather", "gather"])
        if (out / "campaign.json").exists():
            asked.append(run([name, str(out)], out.parent))
        time.sleep(chance.uniform(0.0, 0.02))
    ended = campaign.wait()
    wrong = fault(ended, (0,))
    wrong = wrong or next((w for w in (fault(one, (0, 1)) for one in asked) if w), "")
    wrong = wrong or differs(out, shared.specimen.truth, out.parent)
    wrong = wrong or alters(out, shared.specimen.truth, out.parent)[0]
    return Verdict("campaign + status + gather", wrong or _parts(out))
