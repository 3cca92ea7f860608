"""hpcwhirl: whirl of a bladed disk in unilateral contact with its casing."""

from __future__ import annotations

TYPE_CHECKING = False  # `typing` itself would delay the first look at signals
if TYPE_CHECKING:
    from typing import Any

    from hpcwhirl.campaign.case import simulate
    from hpcwhirl.scene import Scene
    from hpcwhirl.store.reader import open_results

__version__ = "0.1.0"
__all__ = ["Scene", "__version__", "open_results", "simulate"]

_HOMES = {
    "Scene": "hpcwhirl.scene",
    "simulate": "hpcwhirl.campaign.case",
    "open_results": "hpcwhirl.store.reader",
}


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        import importlib

        return getattr(importlib.import_module(_HOMES[name]), name)
    msg = f"module 'hpcwhirl' has no attribute '{name}'"
    raise AttributeError(msg)
