"""A condition on inputs, for one case and for columns of cases."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from operator import attrgetter
from typing import Any


@dataclass(frozen=True)
class Rule:
    """A condition on several inputs of a table, or of tables inside it.

    Attributes
    ----------
    inputs : dotted names of the inputs, relative to the table
    holds : function that returns whether their values, scalars or (cases,), are
        allowed; a list is passed as its length
    message : function from the values of a case that breaks the rule to the text of
        its error
    """

    inputs: tuple[str, ...]
    holds: Callable[..., Any]
    message: Callable[..., str]

    @cached_property
    def _read(self) -> attrgetter[tuple[Any, ...]]:
        return attrgetter(*self.inputs)

    def check(self, table: object) -> None:
        """Raise ValueError if the inputs of a table, an object, break the rule."""
        values = [len(v) if isinstance(v, tuple) else v for v in self._read(table)]
        if not self.holds(*values):
            raise ValueError(self.message(*values))
