"""What surviving costs: states, notes of what runs, cases in a process of their own.

    python scripts/cost/survival.py [--repeats 30]

A table on stdout, medians of this machine: keeping and taking up the state of a case
of Table 2 after 0.5 s of engine time, noting a case as begun, beginning the process of
isolated cases, and what a case of some ms costs more in it.
"""

from __future__ import annotations

import argparse
import math
import statistics
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

from hpcwhirl.campaign.checkpoints import Checkpoints
from hpcwhirl.campaign.compute import compute
from hpcwhirl.campaign.isolate import Child
from hpcwhirl.campaign.log import say
from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.march import March
from hpcwhirl.scene import apply_settings, digest, named_scene
from hpcwhirl.store.directory.running import Running

SHORT = {"duration": 0.01, "time_step": 2e-6, "interval": 1e-3}


def seconds(action: Callable[[], object], repeats: int) -> float:
    """Return the median time of an action, s."""
    spent = []
    for _ in range(repeats):
        start = time.perf_counter()
        action()
        spent.append(time.perf_counter() - start)
    return statistics.median(spent)


def of_states(folder: Path, repeats: int) -> None:
    """Print what a state costs, with samples of the orbit and of all tips."""
    for traces in ("orbit", "full"):
        settings = {"duration": 0.5, "time_step": 1e-6, "traces": traces}
        march = March(resolve(apply_settings(named_scene("table2"), settings)))
        march.advance(march.total)
        name = digest(march.scene)
        checkpoints = Checkpoints(folder, math.inf, say)
        kept = seconds(partial(checkpoints.save, name, march), repeats)
        size = (folder / "states" / f"{name}.state").stat().st_size
        other = March(resolve(march.scene))
        taken = seconds(partial(checkpoints.take_up, name, other), repeats)
        line = f"state, {traces}: {size} bytes, kept in {1e3 * kept:.1f} ms"
        print(f"{line}, taken up in {1e3 * taken:.2f} ms")


def of_isolation(folder: Path, repeats: int) -> None:
    """Print what a process of its own costs, at its start and a case."""
    scene = apply_settings(named_scene("table2"), SHORT)
    checkpoints, child = Checkpoints(folder, math.inf, say), Child(folder, math.inf)
    name, limit = digest(scene), math.inf

    def here() -> None:
        compute(resolve(scene), name, checkpoints, limit, lambda: None)

    def there() -> None:
        child.compute(scene, name, limit, lambda: None)

    here()
    begun = seconds(there, 1)
    own, apart = seconds(here, repeats), seconds(there, repeats)
    child.close()
    print(f"process of isolated cases: first answer after {begun:.2f} s")
    print(f"a case: {1e3 * own:.1f} ms here, {1e3 * apart:.1f} ms there, "
          f"{1e3 * (apart - own):.1f} ms more")  # fmt: skip


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--repeats", type=int, default=30)
    repeats = parser.parse_args().repeats
    with tempfile.TemporaryDirectory(prefix="hpcwhirl-survival-") as place:
        folder = Path(place)
        of_states(folder, repeats)
        with Running(folder, 1, 0) as running:
            note = seconds(lambda: running.begin(["0" * 64]), 10 * repeats)
        print(f"note of a case begun: {1e6 * note:.0f} us")
        of_isolation(folder, repeats)


if __name__ == "__main__":
    main()
