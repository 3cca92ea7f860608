"""Every variable of `results.h5`: name, type, unit, meaning. One table, one format."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hpcwhirl.errors import unknown
from hpcwhirl.scene.words import ENUMS

FORMAT = 4
TEXT = {"scheme": 16, "message": 240, "host": 64, "worker_host": 64}  # bytes


@dataclass(frozen=True)
class Variable:
    """A variable over `case`: unit and meaning; the type follows from the kind."""

    kind: str  # "f8", "i8", "enum" or "text"
    unit: str
    meaning: str


def _table(kind: str, unit: str, **names: str) -> dict[str, Variable]:
    return {name: Variable(kind, unit, meaning) for name, meaning in names.items()}


ROW: dict[str, Variable] = {
    **_table("enum", "1", outcome="how the integration ended"),
    **_table("enum", "1", regime="kind of motion"),
    **_table("enum", "1", whirl="direction of the shaft's precession, static frame"),
    **_table("enum", "1", stop="why the integration ended"),
    **_table("f8", "rad/s", speed="rotational speed Omega"),
    **_table("i8", "1", nodal_diameter="lobes k of the loading"),
    **_table("f8", "m", gap="blade-tip clearance"),
    **_table("f8", "1", friction="Coulomb coefficient mu"),
    **_table("f8", "N", force="peak modal force of the pulse"),
    **_table("f8", "s", pulse="duration of the pulse"),
    **_table("f8", "s", duration="engine time asked for"),
    **_table("f8", "s", time_step="time step"),
    **_table("f8", "s", sample_interval="time between samples"),
    **_table("i8", "1", modes="fixed-interface modes eta asked for"),
    **_table("text", "1", scheme="time-integration scheme"),
    **_table("i8", "1", folds="sectors that move alike, of which one is marched"),
    **_table("i8", "1", steps="steps taken"),
    **_table("i8", "1", contacts="touchdowns of blades on the casing"),
    **_table("f8", "N s", contact_impulse="normal impulse of all contacts"),
    **_table("f8", "m", orbit_radius="rms radius of the centre's orbit, window"),
    **_table("f8", "m", centre_peak="largest centre displacement, whole run"),
    **_table("f8", "s", last_contact="last instant with contact, -1 for none"),
    **_table("f8", "s", end_time="last step", window="length of the window"),
    **_table("f8", "1/s", growth_rate="growth of ln sqrt(energy) over the window"),
    **_table("f8", "1/s", growth_error="standard error of growth_rate"),
    **_table("f8", "1/s", growth_rotor="as growth_rate, of the rotor's energy"),
    **_table("f8", "1/s", growth_casing="as growth_rate, of the casing's energy"),
    **_table("f8", "1/s", growth_centre="growth of ln rms radius of the centre"),
    **_table("f8", "1/s", growth_last="as growth_rate, last quarter of the window"),
    **_table("f8", "1", summit="ln amplitude of the rotor, end over highest before"),
    **_table("f8", "1", whirl_ratio="(P+ - P-)/(P+ + P-), forward positive"),
    **_table("f8", "m2/s", orbit_area="signed area swept a second, forward positive"),
    **_table("f8", "rad/s", line_frequency="strongest line, forward positive"),
    **_table("f8", "J", late_fed="work of rotation and friction in the window"),
    **_table("f8", "J", late_friction="work of friction in the window"),
    **_table("f8", "J", late_rotation="work of transport over the deformed ring"),
    **_table("f8", "J", late_lost="damping and impact loss in the window"),
    **_table("f8", "J", late_energy="mean energy in the window"),
    **_table("f8", "s", load_end="end of the loading, 0 for none"),
    **_table("i8", "1", late_contacts="1 if the window has contact"),
    **_table("f8", "s", certificate="from when no contact can recur, -1 for none"),
    **_table("f8", "m", certificate_reach="bound of all later displacements, or 0"),
    **_table("f8", "1", ledger_error="worst break of the ledger, over throughput"),
    **_table("f8", "1", step_share="time step over the stability limit"),
    **_table("f8", "1", gap_error="gaps solved less those of the bodies, relative"),
    **_table("f8", "m", gap_scale="length that the whirl floor refers to"),
    **_table("f8", "J", ledger_energy="kinetic and strain energy at the end"),
    **_table("f8", "J", ledger_damping="lost in modal damping"),
    **_table("f8", "J", ledger_pulse="work of the loading"),
    **_table("f8", "J", ledger_impact="lost in impacts"),
    **_table("f8", "J", ledger_friction="work of friction on both bodies"),
    **_table("f8", "J", ledger_rotation="work of the rotation through the contacts"),
    **_table("f8", "J", ledger_residual="what the ledger leaves open"),
}
PERFORMANCE: dict[str, Variable] = {
    **_table("f8", "s", seconds="wall time in the kernel"),
    **_table("f8", "us", microseconds_per_step="wall time a step"),
    **_table("i8", "1", rank="rank that computed the case"),
    **_table("text", "1", host="host that computed the case"),
}
# what each rank of each run did with its time, over `worker`
SHARES: dict[str, Variable] = {
    **_table("f8", "1", busy_fraction="worker_busy over worker_span"),
    **_table("f8", "s", worker_busy="computing and keeping cases"),
    **_table("f8", "s", worker_span="from the first hand-out to the end of all ranks"),
    **_table("i8", "1", worker_run="run of the campaign", worker_rank="rank in it"),
    **_table("i8", "1", worker_cases="cases finished by it"),
    **_table("text", "1", worker_host="its host"),
}
STATUS: dict[str, Variable] = {
    **_table("enum", "1", status="whether the case gave a result"),
    **_table("text", "1", message="why it did not"),
}
# name: (further dimensions, unit, meaning)
TRACES: dict[str, tuple[tuple[str, ...], str, str]] = {
    "centre": (("xy",), "m", "shaft centre, static frame"),
    "energy": ((), "J", "kinetic and strain energy of both bodies"),
    "impulse": ((), "N s", "cumulative normal contact impulse"),
    "fed": ((), "J", "cumulative work of rotation and friction"),
    "rubbed": ((), "J", "cumulative work of friction, linear between 500 readings"),
    "lost": ((), "J", "cumulative damping and impact loss"),
    "tips": (("blade", "component"), "m", "tips, rotating frame: radial, tangential"),
    "blade_impulse": (("blade",), "N s", "cumulative contact impulse of each blade"),
    "casing": (
        ("harmonic", "phase"),
        "m",
        "casing's radial displacement, static frame: of cos, sin of harmonic x angle",
    ),
}


def dtype(name: str, variable: Variable) -> np.dtype:
    """Return the stored type of a variable."""
    if variable.kind == "enum":
        return np.dtype("i1")
    if variable.kind == "text":
        return np.dtype(f"S{TEXT[name]}")
    return np.dtype(variable.kind)


def missing(variable: Variable) -> float | int | bytes:
    """Return what stands where a case gave nothing."""
    empty: dict[str, float | int | bytes] = {"f8": np.nan, "i8": -1, "enum": 0}
    return empty.get(variable.kind, b"")


def encode(name: str, variable: Variable, value: float | str) -> float | int | bytes:
    """Return a row's value as it is stored, or raise where it is no such word."""
    if variable.kind == "text":
        cut = str(value).encode()[: TEXT[name]]
        return cut.decode(errors="ignore").encode()  # no half letter at the end
    if variable.kind == "enum":
        if value not in ENUMS[name]:
            raise unknown(name, str(value), ENUMS[name])
        return ENUMS[name].index(str(value))
    return float(value) if variable.kind == "f8" else int(value)
