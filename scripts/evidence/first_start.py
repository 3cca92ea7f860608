"""Where the seconds of a first start go.

    python scripts/evidence/first_start.py [SCHEME ...]

Compiles what a case of the default engine needs, with an empty cache, and prints the
processor's seconds: imports, numba's passes, LLVM, and of each function its own.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections import Counter
from typing import Any

from numba.core import config, event

from hpcwhirl.errors import unknown
from hpcwhirl.scene.schemes import SCHEMES

MOST = 12  # passes and functions told


class Spent(event.Listener):  # type: ignore[misc, unused-ignore]
    """Seconds of each pass and each function, without what happens inside them."""

    def __init__(self) -> None:
        self.open: list[list[float]] = []
        self.passes: Counter[str] = Counter()
        self.functions: Counter[str] = Counter()

    def on_start(self, _: Any) -> None:
        """Begin with a pass."""
        self.open.append([time.process_time(), 0.0])

    def on_end(self, seen: Any) -> None:
        """Enter a pass."""
        start, inside = self.open.pop()
        whole = time.process_time() - start
        if self.open:
            self.open[-1][1] += whole
        name = seen.kind.removeprefix("numba:")
        if name == "run_pass":
            name = seen.data["name"].split(" [")[0]
            self.functions[seen.data["qualname"]] += whole - inside
        self.passes[name] += whole - inside


def profiled(scheme: str) -> None:
    """Print where the seconds of a scheme's first start go."""
    spent = Spent()
    for kind in ("compile", "run_pass", "llvm_lock"):
        event.register(f"numba:{kind}", spent)
    from hpcwhirl.case.resolve import resolve
    from hpcwhirl.dynamics.march import March
    from hpcwhirl.scene import apply_settings, named_scene

    imports = time.process_time()
    scene = apply_settings(named_scene("table2"), {"scheme": scheme})
    March(resolve(scene)).warm()
    whole = time.process_time()
    count = len(spent.functions)
    print(
        f"{scheme}: {whole:.1f} s of the processor, {imports:.1f} of imports; {count}"
    )
    print("functions; llvm_lock is LLVM, compile what numba does beside its passes")
    for found in (spent.passes, spent.functions):
        for name, seconds in found.most_common(MOST):
            print(f"{seconds:8.2f}  {name}")


def main() -> None:
    """Profile a scheme in this process, or several in one of its own each."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("schemes", nargs="*", default=["modal"], metavar="SCHEME")
    schemes = parser.parse_args().schemes
    for name in schemes:
        if name not in SCHEMES:
            parser.error(str(unknown("scheme", name, SCHEMES)))
    if len(schemes) > 1:
        import subprocess

        for scheme in schemes:
            subprocess.run([sys.executable, __file__, scheme], check=True)
        return
    with tempfile.TemporaryDirectory() as cache:
        vars(config)["CACHE_DIR"] = cache
        profiled(schemes[0])


if __name__ == "__main__":
    main()
