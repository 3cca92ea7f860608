"""Base classes of all tables that users write, and types of their values.

`TableModel` is that of the tables of a campaign's file, such as [twins]; `Inputs` that
of the tables of a scene.

The meaning and allowed values of a key are declared once; options of commands,
`hpcwhirl inputs` and error messages use them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import NoneType
from typing import Annotated, Any, ClassVar, Literal, Self, get_args, get_origin

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    ValidationError,
    model_validator,
)
from pydantic_core import PydanticCustomError

from hpcwhirl.errors import InputError, as_table, nearest, shown, unknown
from hpcwhirl.scene.rules import AS_THE_REST, Rule
from hpcwhirl.scene.units import in_si, measure, quantity_of

PRESET = "preset"  # a key that only [solver] has
UNKNOWN_WORD = "unknown_word"  # type of a pydantic error with `word` and `known`


@dataclass(frozen=True)
class Key:
    """What users are told of a key of a table in a campaign's file.

    Attributes
    ----------
    meaning : explanation in one sentence
    allowed : text on the allowed values; fixed texts are separated by bars
    """

    meaning: str
    allowed: str


def key(default: Any, meaning: str = "", allowed: str = "", **limits: Any) -> Any:
    """Return the pydantic field that declares a key, with its `Key` as metadata.

    Parameters
    ----------
    default : default value; `...`: the key is required
    meaning, allowed : see `Key`; if `allowed` is "", `key_of` makes it
    limits : arguments of `pydantic.Field` such as ``gt=0``
    """
    field = Field(default, **limits)
    field.metadata.append(Key(meaning, allowed))
    return field


def kind_of(field: Any) -> Any:
    """Return the type X of a pydantic field declared as X or X | None."""
    kinds = [kind for kind in get_args(field.annotation) if kind is not NoneType]
    is_literal = get_origin(field.annotation) is Literal
    return field.annotation if is_literal or len(kinds) != 1 else kinds[0]


def key_of(field: Any) -> Key:
    """Return the `Key` of a pydantic field.

    If the field has no text `allowed`, it is made from the type and the limits.
    """
    told = next(told for told in field.metadata if isinstance(told, Key))
    return told if told.allowed else Key(told.meaning, _allowed(field))


def _allowed(field: Any) -> str:
    kind = kind_of(field)
    if get_origin(kind) is Literal:
        return " | ".join(get_args(kind))
    if kind is bool:
        return "true or false"
    names = ("gt", "ge", "le")
    above, least, most = (
        next((getattr(m, n) for m in field.metadata if hasattr(m, n)), None)
        for n in names
    )
    what = "a whole number" if kind is int else "a number"
    if above is not None:
        return f"{what} > {above}"
    if least is None:
        return "a finite number"
    return f"{what} >= {least}" if most is None else f"{what} from {least} to {most}"


class TableModel(BaseModel):
    """Base class of tables: frozen; unknown keys and wrong types are errors.

    Pydantic builds the validator of a table when it is first used.
    """

    model_config = ConfigDict(
        frozen=True, extra="forbid", strict=True, allow_inf_nan=False, defer_build=True
    )

    @classmethod
    def read(
        cls, given: Any, where: str, name: Callable[[str], str] | None = None
    ) -> Self:
        """Return the validated table from parsed TOML.

        Parameters
        ----------
        given : parsed TOML
        where : name of the table in messages, such as "[twins]"
        name : function from a key to its name in messages; None: "[twins] key"

        Raises
        ------
        InputError
            in one line: the key, its value, what is allowed, the nearest known name
        """
        as_table(where, given)
        try:
            return cls.model_validate(dict(given))
        except ValidationError as failed:
            errors = failed.errors(include_url=False)
            wrong = [one for one in errors if one["type"] == "extra_forbidden"]
            error = (wrong or errors)[0]  # a misspelt key may also count as missing
            tell = name or (lambda own: f"{where} {own}")
            raise cls._refused(error, where, tell) from None

    @classmethod
    def _refused(
        cls, error: Mapping[str, Any], where: str, name: Callable[[str], str]
    ) -> InputError:
        """Return pydantic's error about a table as an InputError of one line.

        where, name : as in `read`
        """
        own = str(error["loc"][0]) if error["loc"] else ""
        what, got = name(own) if own else where, error["input"]
        if error["type"] == "extra_forbidden":
            if own == PRESET:
                msg = f"unknown key in {where} '{own}'; it belongs in [solver]"
                return InputError(msg)
            return unknown(f"key in {where}", own, cls.model_fields)
        if error["type"] == UNKNOWN_WORD:
            return unknown(what, error["ctx"]["word"], error["ctx"]["known"])
        if error["type"] == "value_error":
            failed = error["ctx"]["error"]
            told = failed if isinstance(failed, InputError) else f"{what} {failed}"
            return InputError(str(told))
        field = cls.model_fields[own]
        words = get_args(kind_of(field))
        is_word = error["type"] == "literal_error" and isinstance(got, str)
        if is_word and nearest(got, words):
            return unknown(what, got, words)
        got = None if error["type"] == "missing" else got
        allowed = key_of(field).allowed.replace(" | ", ", ")
        one_of = "one of " if get_origin(kind_of(field)) is Literal else ""
        return InputError(f"{what} must be {one_of}{allowed}, got {shown(got)}")


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
