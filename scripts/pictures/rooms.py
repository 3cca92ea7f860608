"""Draw the rooms of the package by their imports, for the manual's page on design.

    python scripts/pictures/rooms.py [--write]

Each row is a floor: a room imports only from lower floors, and from at least one room
of the floor below. Names in brackets are rooms within a room.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping
from pathlib import Path

import grimp

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import TOP, parser_of

PAGE = TOP / "hpcwhirl/manual/design.md"
PLACE = re.compile(r"```text\n┌─ hpcwhirl .*?```\n", re.DOTALL)  # in the page
WIDE = 92  # characters in a line, less than the manual's
INSIDE = "hpcwhirl.dynamics"  # the room whose own rooms are drawn, too
Rooms = Mapping[str, set[str]]


def rooms_of(graph: grimp.ImportGraph, parent: str) -> Rooms:
    """Return {room: rooms of the same parent that it imports}.

    parent : a package; its rooms are its subpackages and modules
    """
    below: dict[str, set[str]] = {}
    for child in sorted(graph.find_children(parent)):
        name = child.removeprefix(f"{parent}.")
        if name.startswith("_"):
            continue
        own = {child, *graph.find_descendants(child)}
        imported = {
            m for one in own for m in graph.find_modules_directly_imported_by(one)
        }
        others = {m.removeprefix(f"{parent}.").partition(".")[0] for m in imported - own
                  if m.startswith(f"{parent}.")}  # fmt: skip
        below[name] = others - {name}
    return below


def floors_of(below: Rooms) -> list[list[str]]:
    """Return the rooms floor by floor, the lowest first.

    Raises
    ------
    ValueError
        if rooms import one another in a circle
    """
    floors: list[list[str]] = []
    left = dict(below)
    while left:
        here = sorted(name for name, others in left.items() if not others & left.keys())
        if not here:
            raise ValueError(f"a circle of imports in {', '.join(sorted(left))}")
        floors.append(here)
        for name in here:
            del left[name]
    return floors


def drawn(name: str, floors: list[list[str]], texts: Mapping[str, str],
          inside: Mapping[str, list[str]], wide: int) -> list[str]:  # fmt: skip
    """Return a box with a room's floors as lines of text, the highest first.

    texts, inside : {room: what stands for it}; {room: lines of its own box instead}
    """
    lines = [f"┌─ {name} ".ljust(wide - 1, "─") + "┐"]
    for floor in reversed(floors):
        for room in floor:
            lines += [f"│ {line:{wide - 4}} │" for line in inside.get(room, [])]
        if others := [texts[room] for room in floor if room not in inside]:
            lines.append(f"│ {'  │  '.join(others):{wide - 4}} │")
    return [*lines, "└" + "─" * (wide - 2) + "┘"]


def texts_of(graph: grimp.ImportGraph, parent: str) -> dict[str, str]:
    """Return {room: its name, and names of its own rooms}."""
    found = {}
    for room in rooms_of(graph, parent):
        whole = f"{parent}.{room}"
        own = [child.rpartition(".")[2] for child in sorted(graph.find_children(whole))
               if graph.find_children(child)]  # fmt: skip
        found[room] = room + (f" ({', '.join(own)})" if own else "")
    return found


def picture() -> str:
    """Return the picture of all rooms, as text."""
    graph = grimp.build_graph("hpcwhirl", cache_dir=None)
    name = INSIDE.rpartition(".")[2]
    texts = texts_of(graph, INSIDE)
    floors = floors_of(rooms_of(graph, INSIDE))
    own = drawn(name, floors, texts, {}, WIDE - 4)
    floors = floors_of(rooms_of(graph, "hpcwhirl"))
    lines = drawn("hpcwhirl", floors, texts_of(graph, "hpcwhirl"), {name: own}, WIDE)
    return "\n".join(lines)


def with_picture(page: str) -> str:
    """Return the page with the picture in its place."""
    text, count = PLACE.subn(f"```text\n{picture()}\n```\n", page)
    if count != 1:
        raise ValueError(f"the page has {count} pictures of the rooms, not one")
    return text


def main() -> None:
    """Print the picture, or write it to the page."""
    args = parser_of(__doc__, write=PAGE).parse_args()
    if args.write:
        PAGE.write_text(with_picture(PAGE.read_text("utf-8")), "utf-8")
    else:
        print(picture())


if __name__ == "__main__":
    main()
