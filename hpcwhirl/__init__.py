"""hpcwhirl: whirl of a bladed disk in unilateral contact with its casing.

`Scene` holds the inputs of a case, `simulate` integrates one. `Design` holds the cases
of a campaign; `campaign` integrates them, on all ranks of an MPI script, and returns
its results. `open_results` reads those of any campaign as an `xarray.Dataset`, `words`
gives the words of a variable such as `regime`, `grid` turns cases into axes of what was
swept, `shares` tells how probable each regime is where inputs were drawn. They are
imported on first use.
"""

from __future__ import annotations

TYPE_CHECKING = False  # `typing` itself would delay the first look at signals
if TYPE_CHECKING:
    from typing import Any

    from hpcwhirl.analysis.shares import shares
    from hpcwhirl.campaign.plan.design import Design
    from hpcwhirl.campaign.python import campaign
    from hpcwhirl.campaign.simulate import simulate
    from hpcwhirl.errors import StoppedError
    from hpcwhirl.scene import Scene
    from hpcwhirl.store.reading.grid import grid
    from hpcwhirl.store.reading.reader import open_results, words

__version__ = "0.1.0"
__all__ = [
    "Design",
    "Scene",
    "StoppedError",
    "__version__",
    "campaign",
    "grid",
    "open_results",
    "shares",
    "simulate",
    "words",
]

_HOMES = {
    "Design": "hpcwhirl.campaign.plan.design",
    "Scene": "hpcwhirl.scene",
    "StoppedError": "hpcwhirl.errors",
    "shares": "hpcwhirl.analysis.shares",
    "simulate": "hpcwhirl.campaign.simulate",
    "open_results": "hpcwhirl.store.reading.reader",
    "words": "hpcwhirl.store.reading.reader",
    "grid": "hpcwhirl.store.reading.grid",
}


def __getattr__(name: str) -> Any:
    import importlib

    if name == "campaign":  # a package that can be called
        return importlib.import_module("hpcwhirl.campaign")
    if name in _HOMES:
        return getattr(importlib.import_module(_HOMES[name]), name)
    msg = f"module 'hpcwhirl' has no attribute '{name}'"
    raise AttributeError(msg)


def __dir__() -> list[str]:
    return sorted({*(n for n in globals() if n.startswith("__")), *__all__})
