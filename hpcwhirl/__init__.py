"""hpcwhirl: whirl of a bladed disk in unilateral contact with its casing.

`Scene` holds the inputs of a case, `simulate` integrates it. `Design` holds the cases
of a campaign; `campaign` integrates them, on all ranks of an MPI script, and returns
their results. `open_results` reads the results of any campaign as an `xarray.Dataset`;
`words` returns the word of each case, of a variable such as `regime`; `grid` turns the
dimension `case` into one axis per swept input; `shares` estimates the probability of
each regime where inputs were drawn, `basins` the share of starts that end on each
motion; `credibility` counts the cases that keep their word in all their twins;
`safe_ranges` returns the ranges of an input in which all cases are damped,
`first_changes` the strongest pulse up to which they are; `compare` says which words of
two campaigns differ, and how far their numbers do; `edge` follows the motion on
the boundary between two words. Each is imported on first use.
"""

from __future__ import annotations

TYPE_CHECKING = False  # importing `typing` would delay the handlers of early signals
if TYPE_CHECKING:
    from typing import Any

    from hpcwhirl.campaign import campaign
    from hpcwhirl.campaign.plan.design import Design
    from hpcwhirl.campaign.simulate import simulate
    from hpcwhirl.errors import StoppedError
    from hpcwhirl.scene import Scene
    from hpcwhirl.store.reading.grid import grid
    from hpcwhirl.store.reading.reader import open_results, words
    from hpcwhirl.store.reading.shares import credibility
    from hpcwhirl.studies.basins import basins
    from hpcwhirl.studies.comparison import compare
    from hpcwhirl.studies.edge import edge
    from hpcwhirl.studies.margins import first_changes, safe_ranges
    from hpcwhirl.studies.shares import shares

__version__ = "0.1.0"
__all__ = [
    "Design", "Scene", "StoppedError", "__version__", "basins", "campaign",
    "compare", "credibility", "edge", "first_changes", "grid", "open_results",
    "safe_ranges", "shares", "simulate", "words",
]  # fmt: skip

_HOMES = {
    "Design": "hpcwhirl.campaign.plan.design",
    "Scene": "hpcwhirl.scene",
    "StoppedError": "hpcwhirl.errors",
    "compare": "hpcwhirl.studies.comparison",
    "edge": "hpcwhirl.studies.edge",
    "first_changes": "hpcwhirl.studies.margins",
    "basins": "hpcwhirl.studies.basins",
    "safe_ranges": "hpcwhirl.studies.margins",
    "shares": "hpcwhirl.studies.shares",
    "simulate": "hpcwhirl.campaign.simulate",
    "open_results": "hpcwhirl.store.reading.reader",
    "words": "hpcwhirl.store.reading.reader",
    "credibility": "hpcwhirl.store.reading.shares",
    "grid": "hpcwhirl.store.reading.grid",
}


if not TYPE_CHECKING:  # type checkers refuse a name that is not listed above

    def __getattr__(name: str) -> Any:
        import importlib

        if name == "open_results":  # register the accessor `data.hpcwhirl`
            importlib.import_module("hpcwhirl.report.accessor")
        if name == "campaign":  # a callable package
            return importlib.import_module("hpcwhirl.campaign")
        if name in _HOMES:
            home = importlib.import_module(_HOMES[name])
            if name == "simulate":  # `Result.plot` draws by a room above its own
                home.draw_results_by(_draw)
            return getattr(home, name)
        raise AttributeError(f"module 'hpcwhirl' has no attribute '{name}'")


def _draw(result: Any, *, transient: bool) -> Any:
    import importlib

    accessor = importlib.import_module("hpcwhirl.report.accessor")
    return accessor.plot_result(result, transient=transient)


def __dir__() -> list[str]:
    return sorted({*(n for n in globals() if n.startswith("__")), *__all__})
