"""Base class of the tables of inputs, and the types of their fields."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, ClassVar, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator
from pydantic_core import PydanticCustomError

from hpcwhirl.errors import shown
from hpcwhirl.scene.rules import AS_THE_REST, Rule
from hpcwhirl.scene.units import in_si, measure, quantity_of


def _one_zero(value: float) -> float:
    """Return 0.0 for -0.0, since these equal values would have different digests."""
    return value + 0.0


Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[
    float, Field(ge=0, allow_inf_nan=False), AfterValidator(_one_zero)
]
Finite = Annotated[float, Field(allow_inf_nan=False), AfterValidator(_one_zero)]
Change = Annotated[float, Field(gt=-1, allow_inf_nan=False), AfterValidator(_one_zero)]
WRONG_UNIT = "wrong_unit"  # type of the pydantic error for a wrong unit


def as_tuple(value: Any) -> Any:
    """Return a list as a tuple, which is immutable; other values unchanged."""
    return tuple(value) if isinstance(value, list) else value


def _own_ratio(value: float) -> float:
    """Return a damping ratio after a check: >= 0, or -1 for that of the other modes."""
    if value < 0.0 and value != AS_THE_REST:
        msg = f"must be >= 0, or -1 for the ratio of the other modes, got {value}"
        raise ValueError(msg)
    return value


OwnRatio = Annotated[Finite, AfterValidator(_own_ratio)]


def anchored(file: str, folder: Path | str = "") -> str:
    """Return the absolute path of a file whose name is relative to `folder`.

    "", for no file, stays "".

    Raises
    ------
    ValueError
        if no file can have this name, or the path is not printable UTF-8
    """
    if not file:
        return ""
    try:
        path = str((Path(folder) / file).resolve())
        path.encode()  # results store it as UTF-8
    except UnicodeEncodeError:
        raise ValueError(f"a path must be UTF-8, got {shown(file)}") from None
    except (OSError, RuntimeError, ValueError) as failed:  # circular links, NUL
        raise ValueError(f"no file can be named {shown(file)}: {failed}") from None
    return printable(path)


def printable(text: str) -> str:
    """Return a text unchanged after checking that all its characters are printable.

    Raises
    ------
    ValueError
        if it has control or other unprintable characters
    """
    if not text.isprintable():
        raise ValueError(f"must have no control characters, got {shown(text)}")
    return text


Label = Annotated[str, AfterValidator(printable)]
FileName = Annotated[str, AfterValidator(anchored)]


def _converted(name: str, value: Any, unit: str) -> Any:
    """Return an input's value in SI, or raise an error that pydantic reports.

    name, unit : the input, and its SI unit; value : number, or text such as "0.8 mm"
    """
    try:
        return in_si(value, unit)
    except ValueError as failed:
        told = {"told": f"{name} {failed}"}
        raise PydanticCustomError(WRONG_UNIT, "{told}", told) from None


class Inputs(BaseModel):
    """Base class of all tables of inputs: frozen, strict about unknown keys and types.

    Attributes
    ----------
    RULES : rules between inputs of the table or of tables inside it, which a new object
        checks
    """

    RULES: ClassVar[tuple[Rule, ...]] = ()
    model_config = ConfigDict(
        frozen=True, extra="forbid", strict=True, validate_default=True
    )

    @model_validator(mode="before")
    @classmethod
    def _in_si(cls, data: Any) -> Any:
        """Convert numbers with units, such as "0.8 mm", in a table of inputs to SI."""
        if not isinstance(data, dict):
            return data
        for name in [name for name, value in data.items() if measure(value)]:
            field = cls.model_fields.get(name)
            if field is not None and field.annotation is float:
                unit, value = quantity_of(field).unit, data[name]
                data = {**data, name: _converted(name, value, unit)}
        return data

    @model_validator(mode="after")
    def _keeps_rules(self) -> Self:
        for rule in self.RULES:
            rule.check(self)
        return self
