#!/usr/bin/env python3
"""Write hpcwhirl/scene/typed_inputs.py, by which type checkers know all inputs.

python scripts/typed_inputs.py > hpcwhirl/scene/typed_inputs.py
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Literal, get_args, get_origin

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import parser_of

from hpcwhirl.scene import Casing, Engine, Output, Rotor, Scene, Solver

TABLES = {"Rotor": Rotor, "Casing": Casing, "Engine": Engine, "Solver": Solver,
          "Output": Output, "Scene": Scene}  # fmt: skip
HEAD = '''"""Inputs as type checkers know them; written by scripts/typed_inputs.py.

A number may also be a text with a unit, such as "0.8 mm".
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal, TypeAlias, TypedDict

if TYPE_CHECKING:
    from hpcwhirl.scene.engine_parts import Casing, Engine, Rotor
    from hpcwhirl.scene.inputs import Output, Solver

Number: TypeAlias = float | str
'''


def kind_of(field: object) -> str:
    """Return the type of an input as text."""
    own = field.annotation  # type: ignore[attr-defined]
    if own is float:
        return "Number"
    if own in {int, str, bool}:
        return str(own.__name__)
    if get_origin(own) is Literal:
        return f"Literal[{', '.join(map(repr, get_args(own)))}]".replace("'", '"')
    if get_origin(own) is tuple:
        return "Sequence[float]"
    return f"{own.__name__} | {own.__name__}Inputs"


def lines_of(name: str) -> Iterator[str]:
    """Yield the lines of the class of one table."""
    yield f"\n\nclass {name}Inputs(TypedDict, total=False):"
    yield f'    """Inputs of `{name}`, any of them."""\n'
    for own, field in TABLES[name].model_fields.items():
        line = f"    {own}: {kind_of(field)}"
        if len(line) > 88:
            words = ", ".join(f'"{word}"' for word in get_args(field.annotation))
            line = f"    {own}: Literal[\n        {words}\n    ]"
        yield line
    if name == "Solver":
        yield "    preset: str"


def text() -> str:
    """Return the module's text."""
    return HEAD + "\n".join(line for name in TABLES for line in lines_of(name)) + "\n"


if __name__ == "__main__":
    parser_of(__doc__).parse_args()
    print(text(), end="")
