"""Docstrings of the program as mkdocstrings reads them.

They say `name : meaning`; types stand in the signature. numpydoc reads what follows the
colon as the type, so that each such line becomes a name and an indented meaning.
"""

from __future__ import annotations

import re
from typing import Any

from griffe import Extension

ENTRY = re.compile(r"^(\*{0,2}\w+(?:, \*{0,2}\w+)*) : (.*)$")
LISTS = ("Parameters", "Attributes")


class Meanings(Extension):  # type: ignore[misc, unused-ignore]
    """Turns the entries of all lists of a docstring into names and meanings."""

    def on_object(self, *, obj: Any, **_: Any) -> None:
        """Rewrite the docstring of an object that has just been loaded."""
        if not obj.is_alias and obj.docstring:
            obj.docstring.value = with_meanings(obj.docstring.value)


def with_meanings(text: str) -> str:
    """Return a docstring in which each entry of a list is a name and its meaning.

    Lines below `Parameters` or `Attributes` are entries; a list without such a head
    that ends a docstring gets the head `Parameters`.
    """
    lines = text.splitlines()
    first = next((i for i, line in enumerate(lines) if ENTRY.match(line)), None)
    if first is not None and not any(line.strip() in LISTS for line in lines):
        lines[first:first] = ["Parameters", "----------"]
    out = []
    for line in lines:
        entry = ENTRY.match(line)
        out += [entry[1], f"    {entry[2]}"] if entry else [line]
    return "\n".join(out)
