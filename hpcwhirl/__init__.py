"""hpcwhirl: whirl of a bladed disk in unilateral contact with its casing.

`Scene` holds the inputs of a case, `simulate` integrates one, `open_results` reads a
campaign as an `xarray.Dataset`, `words` gives the words of a variable such as `regime`,
`grid` turns cases into axes of what was swept. They are imported on first use.
"""

from __future__ import annotations

TYPE_CHECKING = False  # `typing` itself would delay the first look at signals
if TYPE_CHECKING:
    from typing import Any

    from hpcwhirl.campaign.simulate import simulate
    from hpcwhirl.scene import Scene
    from hpcwhirl.store.grid import grid
    from hpcwhirl.store.reader import open_results, words

__version__ = "0.1.0"
__all__ = ["Scene", "__version__", "grid", "open_results", "simulate", "words"]

_HOMES = {
    "Scene": "hpcwhirl.scene",
    "simulate": "hpcwhirl.campaign.simulate",
    "open_results": "hpcwhirl.store.reader",
    "words": "hpcwhirl.store.reader",
    "grid": "hpcwhirl.store.grid",
}


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        import importlib

        return getattr(importlib.import_module(_HOMES[name]), name)
    msg = f"module 'hpcwhirl' has no attribute '{name}'"
    raise AttributeError(msg)


def __dir__() -> list[str]:
    return sorted({*(n for n in globals() if n.startswith("__")), *__all__})
