"""A user's own function of a case, whose numbers become variables of the results."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from hpcwhirl.campaign.mark import mark_of
from hpcwhirl.campaign.simulate import Result
from hpcwhirl.errors import InputError, one_line, shown
from hpcwhirl.scene import Scene
from hpcwhirl.scene.quantities import (
    AXES,
    BLADES,
    INPUTS,
    PERFORMANCE,
    ROW,
    STATUS,
    TRACES,
    TUNED,
    variable_name,
)
from hpcwhirl.store.reading.shares import GROUP, SHARE
from hpcwhirl.store.results.cells import BOUNDARIES, CELLS
from hpcwhirl.store.results.measured import VALUES, WHY_NOT, one_case

if TYPE_CHECKING:
    import xarray

LONGEST = 240  # bytes of a reason
ALLOWED = 'a mapping such as {"largest_tip": "m"} or {"largest_tip": ("m", "meaning")}'


@dataclass(frozen=True)
class Measure:
    """A function of one case and the variables that it gives.

    Attributes
    ----------
    function : takes a case, see `store.measured.one_case`, and returns {name: number}
    variables : {name: (unit, meaning)} of all that it gives, of each case
    """

    function: Callable[[xarray.Dataset], Any] = field(compare=False)
    variables: dict[str, tuple[str, str]]

    @property
    def mark(self) -> str:
        """The mark of the function's code, see `mark`."""
        return mark_of(self.function)

    def plan(self) -> dict[str, list[str]]:
        """Return what a campaign's directory keeps of it; the function is not kept."""
        return {name: list(told) for name, told in self.variables.items()}

    def __call__(self, scene: Scene, result: Result) -> dict[str, Any]:
        """Return what a record keeps: the numbers, or why there are none.

        What the function raises is no failure of the case, whose words do not depend
        on it: its variables are NaN, and `measure_message` tells why.
        """
        try:
            case = one_case(scene, result.row, result.traces)
            return {VALUES: self._checked(self.function(case))}
        except Exception as failed:  # noqa: BLE001 - kept, and told
            why = f"{type(failed).__name__}: {failed}"
            return {WHY_NOT: one_line(why, LONGEST)}

    def _checked(self, given: Any) -> dict[str, float]:
        """Return the numbers; raise where they are not those that were declared."""
        if not isinstance(given, Mapping):
            msg = f"measure must return {{name: number}}, got {shown(given)}"
            raise InputError(msg)
        if given.keys() != self.variables.keys():
            own, got = ", ".join(self.variables), ", ".join(map(str, given))
            msg = f"measure must return the declared variables {own}, got {got}"
            raise InputError(msg)
        return {name: float(given[name]) for name in self.variables}


def measure_of(function: Any, variables: Any) -> Measure | None:
    """Return the measure of a call in Python, None for none.

    Raises
    ------
    InputError
        where it is no function, its variables are not told, or one has a taken name
    """
    if function is None and variables is None:
        return None
    if not callable(function):
        msg = f"measure must be a function of one case, got {shown(function)}"
        raise InputError(msg)
    if not isinstance(variables, Mapping) or not variables:
        msg = f"variables must tell what measure gives, {ALLOWED}, "
        raise InputError(msg + f"got {shown(variables)}")
    return Measure(function, {n: _told(n, given) for n, given in variables.items()})


def _told(name: Any, given: Any) -> tuple[str, str]:
    """Return unit and meaning of a variable, checked with its name."""
    if not isinstance(name, str) or not name.isidentifier() or not name.isascii():
        msg = f"variables: a name is letters, digits and _, got {shown(name)}"
        raise InputError(msg)
    taken = {
        *ROW,
        *BLADES,
        *TUNED,
        *STATUS,
        *TRACES,
        *AXES,
        *PERFORMANCE,
        *SHARE,
        GROUP,
        CELLS,
        BOUNDARIES,
        WHY_NOT,
        "performance",
    }
    if name in taken | set(map(variable_name, INPUTS)):
        msg = f"variables: {name} is a name of the results: choose another"
        raise InputError(msg)
    pair = (given, name.replace("_", " ")) if isinstance(given, str) else given
    if not isinstance(pair, tuple | list) or [type(t) for t in pair] != [str, str]:
        msg = f"variables must be {ALLOWED}, got {shown({name: given})}"
        raise InputError(msg)
    return pair[0] or "1", pair[1]
