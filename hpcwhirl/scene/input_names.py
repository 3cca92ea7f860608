"""Names and values of inputs as users write them, made full dotted names and SI."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from typing import Any, TypeGuard, get_origin

from hpcwhirl.errors import InputError, unknown
from hpcwhirl.scene.bearing_tables import bearing_table
from hpcwhirl.scene.kept_tables import profile_table
from hpcwhirl.scene.quantities import INPUTS, LEAVES
from hpcwhirl.scene.shaft_tables import shaft_text
from hpcwhirl.scene.units import each_in_si, told_of

Value = bool | int | float | str | list[float]
FILE = "engine.file"  # the one input that names a file
TABLES_KEPT: dict[str, Callable[[str], str]] = {  # inputs whose file is kept as text
    "engine.rotor.bearing": bearing_table,
    "engine.casing.profile": profile_table,
    "engine.rotor.shaft": shaft_text,
}
MISTUNING = "engine.rotor.mistuning"  # the one input that is a list
# Inputs of the first release, by table. A later input is part of a digest only if it is
# not the default, so that older cases keep their digests.
OLDEST = {
    "": "speed nodal_diameter gap friction force pulse direction duration revolutions",
    "engine": "name file rotation",
    "engine.rotor": "blades elements radius disk_radius blade_width root_thickness "
    "taper spoke_width spoke_thickness rim_width rim_thickness young density centre "
    "centre_stiffness damping suspension_damping cross_coupling mistuning",
    "engine.casing": "kind discretization harmonics families elements thickness width "
    "young density support_frequency damping support_damping amplitude growth rise",
    "solver": "scheme time_step accuracy truncation modes plan until longest "
    "amplitude_limit",
    "output": "traces interval",
}
LATER = tuple(
    name
    for name, (table, _, leaf) in ((n, n.rpartition(".")) for n in INPUTS)
    if leaf not in OLDEST[table].split()
)
IN_UNITS = {name for name, field in LEAVES if field.annotation is float}
PRESET = "preset"  # key of [solver]: a name for the values of several inputs
TABLES = {"sweep", "zip", "cases", "sample", "refine", "twins", "branch", "campaign"}
_UNIT = "this is a unit, which the text of a value may contain"
_LEFT_OUT = "this is not modelled; hpcwhirl manual trust lists what is left out"
_SHAFT = (
    "the shaft is modelled by springs, see centre_stiffness, suspension_damping, "
    "cross_coupling and stiffness_difference; by a table over speed, see bearing; or "
    "by a shaft with mass, disks and bearings, see hpcwhirl manual shaft"
)
OTHERWISE = {  # {word that users look up but that is no input: answer}
    "rpm": f'{_UNIT}: speed = "3000 rpm"',
    "mm": f'{_UNIT}: gap = "0.8 mm"',
    "kn": f'{_UNIT}: force = "30 kN"',
    "hz": f'{_UNIT}: support_frequency = "3 Hz"',
    "imbalance": 'use the input unbalance: unbalance = "20 g mm"',
    "blade-off": "use the input lost_blade, the number of the blade",
    "bearings": _SHAFT,
    **dict.fromkeys(
        ("coating", "wear"), "use the input contact_law: hpcwhirl manual layer"
    ),
    "squeeze film": "use film_viscosity, film_length, film_radius, film_clearance",
    **dict.fromkeys(
        ("temperature", "thermal", "seal", "aerodynamics", "flutter"),
        _LEFT_OUT,
    ),
}  # fmt: skip


SYNONYMS = {  # {word of the field or symbol, lower case: input that it stands for}
    **dict.fromkeys(("omega", "ω", "velocity", "rotation_speed"), "speed"),
    **dict.fromkeys(("mu", "μ", "µ", "friction_coefficient"), "friction"),
    **dict.fromkeys(("k", "lobes", "diameters"), "nodal_diameter"),
    **dict.fromkeys(("clearance", "tip_clearance", "gap_size"), "gap"),
    **dict.fromkeys(("dt", "timestep", "step"), "time_step"),
    **dict.fromkeys(("t_end", "tend", "time", "end_time"), "duration"),
    **dict.fromkeys(("e", "youngs_modulus"), "young"),
    **dict.fromkeys(("n", "n_blades", "blade_count"), "blades"),
    **dict.fromkeys(("r", "tip_radius"), "radius"),
    **dict.fromkeys(("xi", "ξ", "zeta", "ζ", "damping_ratio"), "damping"),
    **dict.fromkeys(("oval", "ovality", "ovalization", "shape"), "profile"),
    **dict.fromkeys(("run_up", "runup", "ramp_rate"), "acceleration"),
    **dict.fromkeys(("blade_off", "blade_loss", "fbo"), "lost_blade"),
    **dict.fromkeys(("stiffness", "shaft_stiffness"), "centre_stiffness"),
    **dict.fromkeys(("phase", "imbalance_phase"), "unbalance_phase"),
}  # fmt: skip


def stands_for(word: str) -> str:
    """Return a hint at the input that a word of the field means; "" for other words."""
    found = SYNONYMS.get(word.lower())
    return f"; did you mean '{found}'?" if found else ""


def input_names() -> dict[str, str]:
    """Return {dotted name: meaning with its unit} of every input of a scene."""
    return {name: told.labelled(told.meaning) for name, told in INPUTS.items()}


def value_in_si(name: str, value: Any) -> Any:
    """Return the value of an input in SI: "0.8 mm" gives 8e-4.

    The name of a file with a bearing's or profile's table gives the table as text.

    Parameters
    ----------
    name : full dotted name
    value : value from TOML; in a list each element is converted

    Raises
    ------
    InputError
        naming the input, if the unit is unknown or of another quantity
    """
    told = INPUTS.get(name)
    if name in TABLES_KEPT:
        return told_of(name, lambda: _tables_in(value, TABLES_KEPT[name]))
    if told is None or name not in IN_UNITS:
        return value
    return told_of(name, lambda: each_in_si(value, told.unit))


def _tables_in(value: Any, table: Callable[[str], str]) -> Any:
    """Return the text of the table in a file, in the form that a scene stores.

    value : name of the file; a list of names gives a list of texts
    table : function from a file's name to the text
    """
    if isinstance(value, list):
        return [_tables_in(one, table) for one in value]
    return table(value) if isinstance(value, str) else value


@cache
def takes_list(name: str) -> bool:
    """Return whether the input of a full dotted name is a list of numbers."""
    return any(n == name and get_origin(f.annotation) is tuple for n, f in LEAVES)


def full_name(name: str) -> str:
    """Return the full dotted name of an input, given that name or a unique ending."""
    if name in INPUTS:
        return name
    matches = [n for n in INPUTS if n.endswith("." + name)]
    if len(matches) == 1:
        return matches[0]
    if matches:
        raise InputError(f"input '{name}' is ambiguous: {' or '.join(matches)}")
    if name.rpartition(".")[2] == PRESET:
        raise InputError(
            "a preset is no scene input: --preset NAME, or preset in a file's [solver]"
        )
    if name.partition(".")[0] in TABLES:
        table = name.partition(".")[0]
        msg = f"'{name}' is no scene input: write [{table}] in the campaign's file"
        raise InputError(msg)
    if name.lower() in OTHERWISE:
        raise InputError(f"unknown scene input '{name}': {OTHERWISE[name.lower()]}")
    if hint := stands_for(name):
        raise InputError(f"unknown scene input '{name}'{hint}")
    short = {n.rsplit(".", 1)[-1] for n in INPUTS}
    raise unknown("scene input", name, short | INPUTS.keys())


def by_full_name(given: Iterable[tuple[str, Any]], where: str) -> dict[str, Any]:
    """Return inputs under their full dotted names, {name: value}; 0.0 replaces -0.0.

    Parameters
    ----------
    given : (name or unambiguous ending, value) of each input
    where : name, for messages, of the table or option that gives the inputs

    Raises
    ------
    InputError
        for an unknown or ambiguous name, or an input under two names
    """
    out: dict[str, Any] = {}
    for name, value in given:
        full = full_name(name)
        if full in out:
            raise InputError(f"{where} names {full} twice, once as {name}")
        out[full] = _signless(value)
    return out


def _signless(value: Any) -> Any:
    """Return a value, or a list of values, with -0.0 replaced by 0.0."""
    if isinstance(value, list):
        return [_signless(one) for one in value]
    return value + 0.0 if isinstance(value, float) else value


def undotted(
    content: Mapping[str, Any],
    is_value: Callable[[Mapping[str, Any]], bool],
    prefix: str = "",
) -> Iterator[tuple[str, Any]]:
    """Yield (dotted name, value) of each key of a TOML table and of tables inside it.

    So dotted keys, which TOML parses as nested tables, get back their names.

    Parameters
    ----------
    content : parsed table
    is_value : function that tells whether a nested table is a value, such as a range
    prefix : text put before all names
    """
    for name, given in content.items():
        if isinstance(given, Mapping) and given and not is_value(given):
            yield from undotted(given, is_value, f"{prefix}{name}.")
        else:
            yield prefix + name, given


def is_whole(value: object) -> TypeGuard[int]:
    """Return whether a value from TOML is a whole number, which booleans are not."""
    return isinstance(value, int) and not isinstance(value, bool)


def is_number(value: object) -> TypeGuard[int | float]:
    """Return whether a value from TOML is a number, perhaps infinite or NaN."""
    return is_whole(value) or isinstance(value, float)


@cache
def default_of(name: str) -> Any:
    """Return the default value of an input by its full dotted name."""
    return next(field.default for n, field in LEAVES if n == name)
