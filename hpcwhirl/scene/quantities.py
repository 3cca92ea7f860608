"""Table of all quantities, inputs and results, with unit, meaning and storage type."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from pydantic import BaseModel

from hpcwhirl.scene.inputs import Scene
from hpcwhirl.scene.quantity import Quantity, quantity_of


def _leaves(model: type[BaseModel], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, field in model.model_fields.items():
        kind = field.annotation
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            yield from _leaves(kind, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", field


LEAVES = tuple(_leaves(Scene))
WHOLE = tuple(name for name, field in LEAVES if field.annotation is int)
INPUTS = {name: quantity_of(field) for name, field in LEAVES}  # by dotted name


def _as_given(*names: str) -> dict[str, Quantity]:
    """Return {last part of name: quantity} of inputs that are kept for each case."""
    kinds = {name: "i8" if f.annotation is int else "f8" for name, f in LEAVES}
    return {
        name.rpartition(".")[2]: replace(INPUTS[name], kind=kinds[name])
        for name in names
    }


def _table(kind: str, unit: str, **names: str) -> dict[str, Quantity]:
    return {name: Quantity(unit, told, kind=kind) for name, told in names.items()}


ROW: dict[str, Quantity] = {
    **_table("enum", "1", outcome="how the integration ended"),
    **_table("enum", "1", regime="kind of motion"),
    **_table("enum", "1", whirl="direction of the shaft's precession, static frame"),
    **_table("enum", "1", stop="why the integration ended"),
    **_as_given("speed", "nodal_diameter", "gap", "friction", "force", "pulse"),
    **_table("f8", "s", duration="planned engine time"),
    **_as_given("solver.time_step"),
    **_table("f8", "s", sample_interval="time between samples"),
    **_table("i8", "1", modes="number eta of fixed-interface modes, input"),
    **_table("S16", "1", scheme="time-integration scheme, input"),
    **_table("i8", "1", folds="number of equal sectors, of which one is integrated"),
    **_table("i8", "1", steps="number of time steps"),
    **_table("i8", "1", contacts="number of times that a blade began to touch"),
    **_table("f8", "N s", contact_impulse="sum of the normal impulses of all contacts"),
    **_table(
        "f8", "m", orbit_radius="rms distance of the centre from its mean position"
    ),
    **_table(
        "f8", "m", centre_peak="largest displacement of the centre in the evidence"
    ),
    **_table("f8", "s", last_contact="time of the last contact, -1 for none"),
    **_table("f8", "s", end_time="time of the last step", window="length of window"),
    **_table("f8", "1/s", growth_rate="growth rate of ln sqrt(energy) over the window"),
    **_table("f8", "1/s", growth_error="standard error of growth_rate"),
    **_table("f8", "1/s", growth_rotor="as growth_rate, of the rotor's energy"),
    **_table("f8", "1/s", growth_casing="as growth_rate, of the casing's energy"),
    **_table(
        "f8", "1/s", growth_centre="growth rate of the centre's ln rms displacement"
    ),
    **_table("f8", "1/s", growth_last="as growth_rate, last quarter of the window"),
    **_table("f8", "1", summit="ln(rotor amplitude at the end / highest before)"),
    **_table("f8", "1", whirl_ratio="(P+ - P-)/(P+ + P-) of forward, backward power"),
    **_table(
        "f8", "m2/s", orbit_area="area swept per second by the centre, forward > 0"
    ),
    **_table("f8", "rad/s", line_frequency="strongest line of the centre, forward > 0"),
    **_table("f8", "J", late_fed="work of rotation and friction in the window"),
    **_table("f8", "J", late_friction="work of friction in the window"),
    **_table("f8", "J", late_rotation="work of transport over the ring in the window"),
    **_table("f8", "J", late_lost="damping and impact loss in the window"),
    **_table("f8", "J", late_energy="mean energy in the window"),
    **_table("f8", "s", load_end="end of the pulse, 0 for none"),
    **_table("i8", "1", late_contacts="1 if the window has contact"),
    **_table(
        "f8", "s", certificate="time from which no contact can recur, -1 for none"
    ),
    **_table(
        "f8", "m", certificate_reach="bound of displacements after certificate, or 0"
    ),
    **_table(
        "f8", "1", ledger_error="largest error of the energy ledger / its throughput"
    ),
    **_table("f8", "1", step_share="time step / stability limit of the time step"),
    **_table("f8", "1", gap_error="relative error of solved gaps, from displacements"),
    **_table(
        "f8",
        "1",
        slip_ratio="largest velocity of a tip in contact relative to the casing, "
        "without Omega R, / Omega R; from 1 on a tip may have slid backward",
    ),
    **_table(
        "f8",
        "m",
        tip_growth="largest radial growth of a tip by rotation; 0 if rotation is none",
    ),
    **_table("f8", "m", gap_scale="length to which the threshold whirl_floor refers"),
    **_table("f8", "J", ledger_energy="kinetic and strain energy at the end"),
    **_table("f8", "J", ledger_damping="energy lost in modal damping"),
    **_table("f8", "J", ledger_pulse="work of the pulse"),
    **_table("f8", "J", ledger_impact="energy lost in impacts"),
    **_table("f8", "J", ledger_friction="work of friction on both bodies"),
    **_table("f8", "J", ledger_rotation="work of the rotation through the contacts"),
    **_table("f8", "J", ledger_residual="residual of the energy ledger"),
}
# variables of campaigns with output.traces = "blades" or "full"
BLADES: dict[str, Quantity] = {
    **_table("f8", "m", blade_amplitude="rms distance of a tip from its mean in the"
             " window, largest of all blades"),
    **_table("f8", "m", blade_peak="largest displacement of any tip in any sample"),
    **_table("f8", "1", localisation="N sum a^4 / (sum a^2)^2 of the blades' rms: 1 if"
             " all move alike, N if one moves alone"),
}  # fmt: skip
# variables of campaigns with output.chaos > 0; measured in sustained cases only
CHAOS: dict[str, Quantity] = {
    **_table("enum", "1", motion="kind of a sustained motion"),
    **_table("f8", "1/s", exponent="largest Lyapunov exponent"),
    **_table("f8", "1/s", exponent_error="half the width of its 95 % interval"),
    **_table("i8", "1", period="revolutions after which the motion recurs best"),
    **_table("f8", "1", return_distance="distance after a period / size of the motion"),
    **_table("f8", "1", zero_one="K of the 0-1 test: 0 regular, 1 chaotic"),
}
# variables of campaigns in which speed or gap change in time
OVER_SPEED: dict[str, Quantity] = {
    **_table("S4096", "1", words_over_speed="words by windows: times, s, speeds, rad/s,"
             " regime, whirl; one interval after the other"),
}  # fmt: skip
# variables of campaigns with a layer on the casing that wears
WORN: dict[str, Quantity] = {
    **_table("f8", "J", ledger_wear="work of wear of a layer on the casing"),
    **_table("f8", "m", wear_depth="largest worn depth of the layer"),
    **_table("f8", "m3", wear_volume="volume that is worn or pressed down"),
    **_table("i8", "1", wear_lobes="strongest harmonic of the worn depth over the"
             " angle, 0 if none was worn"),
    **_table("f8", "J", wear_turning="work of the rotation on rods that tips slid onto,"
             " part of ledger_rotation"),
}  # fmt: skip
# variables of cases whose tuned counterpart was computed, too
TUNED: dict[str, Quantity] = {
    **_table("f8", "1", amplification="blade_amplitude / that of the tuned engine with"
             " the same other inputs, modes and step"),
}  # fmt: skip
PERFORMANCE: dict[str, Quantity] = {
    **_table("f8", "s", seconds="wall time in the kernel"),
    **_table("f8", "us", microseconds_per_step="wall time per step"),
    **_table("i8", "1", rank="rank that computed the case"),
    **_table("S64", "1", host="host that computed the case"),
}
# use of time of each rank of each run, over the dimension `worker`
SHARES: dict[str, Quantity] = {
    **_table("f8", "1", busy_fraction="worker_busy / worker_span"),
    **_table("f8", "s", worker_busy="time for computing and storing cases"),
    **_table(
        "f8", "s", worker_span="from the first case of any rank to the end of all"
    ),
    **_table(
        "i8", "1", worker_run="run of the campaign", worker_rank="rank in the run"
    ),
    **_table("i8", "1", worker_cases="number of cases finished by the rank"),
    **_table("S64", "1", worker_host="host of the rank"),
}
STATUS: dict[str, Quantity] = {
    **_table("enum", "1", status="whether the case gave a result"),
    **_table("S240", "1", message="reason for no result, or a remark"),
}
# variables of the cases of a refined campaign
REFINED: dict[str, Quantity] = {
    **_table("S16", "1", preset="preset whose inputs the case has"),
    **_table("i8", "1", final="1 unless a case of higher fidelity has a word here"),
    **_table("i8", "1", fidelity="0: first fidelity, 1: confirmation"),
    **_table("i8", "1", level="bisections after which the point appears, 0: coarse"),
    **_table("i8", "1", panel="number of the combination of unrefined inputs"),
}
# time histories of cases, of shape (case, time, *axes) or (case, sample, *axes)
TRACES: dict[str, Quantity] = {
    "centre": Quantity("m", "shaft centre, static frame", axes=("xy",)),
    "energy": Quantity("J", "kinetic and strain energy of both bodies"),
    "impulse": Quantity("N s", "cumulative normal contact impulse"),
    "fed": Quantity("J", "cumulative work of rotation and friction"),
    "rubbed": Quantity("J", "cumulative work of friction"),
    "lost": Quantity("J", "cumulative damping and impact loss"),
    "tips": Quantity(
        "m",
        "tips, rotating frame: radial, tangential",
        axes=("blade", "component"),
    ),
    "blade_impulse": Quantity(
        "N s", "cumulative contact impulse of each blade", axes=("blade",)
    ),
    "point_tips": Quantity(
        "m",
        "contact points of tips, rotating frame: radial, tangential",
        axes=("blade", "chord", "component"),
    ),
    "point_impulse": Quantity(
        "N s", "cumulative contact impulse of each point", axes=("blade", "chord")
    ),
    "casing": Quantity(
        "m",
        "casing, static frame: radial displacement by harmonic, its cos and sin part",
        axes=("harmonic", "phase"),
    ),
    "stress": Quantity(
        "Pa",
        "stress of the vibration at named points of each blade: von Mises' of six "
        "components, one with its sign",
        axes=("blade", "place"),
    ),
    "worn": Quantity(
        "m", "worn depth of each rod of the casing's layer", axes=("rod",)
    ),
}
# quantities that commands and figures derive from these
DERIVED: dict[str, Quantity] = {
    **_table("f8", "Hz", frequency="frequency of a line or a mode"),
    **_table("f8", "W", power="work per second"),
    **_table(
        "f8", "N/m", blade_stiffness="stiffness k_blade of a blade clamped at its root"
    ),
    **_table("f8", "rad/s", critical_speed="speed at which Eq. 13 holds"),
    **_table("f8", "s", time_step_limit="largest stable step of central differences"),
    **_table(
        "f8", "1", centre_share="share of a mode's strain energy in the shaft's springs"
    ),
    **_table(
        "f8",
        "1",
        clearance_consumption="radial amplitude of a mode's tips / whole amplitude",
    ),
}
# arrays of a model's file, by the last part of their names
ARRAYS: dict[str, Quantity] = {
    **_table("f8", "kg", mass="reduced mass matrix"),
    **_table("f8", "N/m", stiffness="reduced stiffness matrix"),
    **_table("f8", "N s/m", damping="modal damping, D"),
    **_table("f8", "kg", coriolis="C, skew-symmetric; forces are -2 Omega C x'"),
    **_table("f8", "kg m", centrifugal_load="force per unit Omega^2"),
    **_table("f8", "kg", stress_stiffness="stiffening by tension, per unit Omega^2"),
    **_table(
        "f8", "kg", softening="in-plane mass matrix, subtracted from stress_stiffness"
    ),
    **_table("f8", "rad/s", speeds="the two speeds of stiffness_a and stiffness_b"),
    **_table("f8", "N/m", stiffness_a="stiffness matrix at the first of two speeds"),
    **_table("f8", "N/m", stiffness_b="stiffness matrix at the second of two speeds"),
    **_table(
        "f8", "N s/m", centre_damping="damping of the shaft's non-rotating support"
    ),
    **_table("f8", "1/sqrt(kg)", shapes="mass-orthonormal mode shapes, by columns"),
    **_table("f8", "rad/s", omega="frequencies of the shapes"),
    **_table("f8", "1", damping_ratio="xi of each shape"),
    **_table("i8", "1", nodal_diameter="nodal diameter of each shape"),
    **_table("i8", "1", tip_radial="index of each tip's radial coordinate"),
    **_table("i8", "1", tip_tangential="index of each tip's tangential coordinate"),
    **_table("i8", "1", centre="indices of x_o and y_o; empty if clamped"),
    **_table("f8", "m", tip_station="axial position of each contact point of a tip"),
    **_table("f8", "rad", tip_angle="angle of each contact point from its blade's"),
    **_table("f8", "m", tip_gap="clearance of each contact point less the gap"),
    **_table("f8", "Pa/m", stress="stress at named points, of unit coordinates"),
    **_table("S60", "1", stress_name="names of the points of stress"),
    **_table("f8", "m", station="axial positions of modal_radial, modal_tangential"),
    **_table("f8", "1/sqrt(kg)", modal_tip_radial="radial displacement of the tips"),
    **_table(
        "f8", "1/sqrt(kg)", modal_tip_tangential="tangential displacement of tips"
    ),
    **_table("f8", "1/sqrt(kg)", modal_centre="displacement of the centre"),
    **_table("f8", "1", radial_rows="casing coordinates to w at blades, Omega t = 0"),
    **_table(
        "f8", "1", tangential_rows="casing coordinates to u at blades, Omega t = 0"
    ),
    **_table(
        "i8",
        "1",
        modal_harmonic="harmonic h of each mode (or pair) of a round casing",
    ),
    **_table("f8", "rad/s", modal_omega="frequency of each mode"),
    **_table("f8", "1", modal_damping_ratio="xi of each mode"),
    **_table("f8", "1/sqrt(kg)", modal_radial="W of w = W cos(h theta)"),
    **_table(
        "f8",
        "1/sqrt(kg)",
        modal_tangential="U of u = U sin(h theta); for h = 0 a rotation",
    ),
}
AXES = {
    "case": Quantity("1", "case of the campaign"),
    "worker": Quantity("1", "rank of a run"),
    "cell": Quantity("1", "cell that is not split"),
    "vertex": Quantity("1", "corner of a cell, the last refined input fastest"),
    "point": Quantity("1", "point of a boundary"),
    "line": Quantity("1", "line of a boundary"),
    "twin": Quantity("1", "perturbed twin of a case"),
    "time": Quantity("s", "time of the sample"),
    "sample": Quantity("1", "number of the sample"),
    "xy": Quantity("1", "0: X_o, 1: Y_o"),
    "blade": Quantity("1", "blade"),
    "chord": Quantity("1", "contact point of a tip, by its axial place"),
    "component": Quantity("1", "0: radial, 1: tangential"),
    "place": Quantity("1", "named point of a blade, in the order of rotor/stress_name"),
    "rod": Quantity("1", "rod of the layer, by angle from 0 on the casing"),
    "harmonic": Quantity("1", "number of waves around the casing"),
    "phase": Quantity("1", "0: cos, 1: sin"),
}


def variable_name(dotted: str) -> str:
    """Return the name of a swept input's variable in the results.

    It is the last part of the dotted name if every row has that variable, else all
    parts but engine and solver, joined by underscores.
    """
    leaf = dotted.rsplit(".", 1)[-1]
    if leaf in ROW:
        return leaf
    return "_".join(p for p in dotted.split(".") if p not in {"engine", "solver"})
