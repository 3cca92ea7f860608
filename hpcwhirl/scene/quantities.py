"""Table of all quantities, inputs and results: unit, meaning, and type in the file."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Any

from pydantic import BaseModel

from hpcwhirl.scene.inputs import Scene
from hpcwhirl.scene.units import Quantity, quantity_of


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
    """Return {last part of its name: `Quantity`} of inputs that results repeat.

    names : full dotted names of the inputs
    """
    kinds = {name: "i8" if f.annotation is int else "f8" for name, f in LEAVES}
    return {
        name.rpartition(".")[2]: replace(INPUTS[name], kind=kinds[name])
        for name in names
    }


def _table(kind: str, unit: str, **names: str) -> dict[str, Quantity]:
    """Return {name: `Quantity`} of results with the same type and unit.

    kind, unit : type in the file, see `Quantity`; unit
    names : {name of a result: its meaning}
    """
    return {name: Quantity(unit, told, kind=kind) for name, told in names.items()}


def _text(kind: str, **names: str) -> dict[str, Quantity]:
    return _table(kind, "1", **names)


_real = partial(_table, "f8")
_count = partial(_text, "i8")
_word = partial(_text, "enum")


ROW: dict[str, Quantity] = {
    **_word(outcome="how the integration ended"),
    **_word(regime="kind of motion"),
    **_word(whirl="direction of the shaft's precession, static frame"),
    **_word(stop="why the integration ended"),
    **_as_given("speed", "nodal_diameter", "gap", "friction", "force", "pulse"),
    **_real("s", duration="planned engine time"),
    **_as_given("solver.time_step"),
    **_real("s", sample_interval="time between samples"),
    **_count(modes="number eta of fixed-interface modes, input"),
    **_text("S16", scheme="time-integration scheme, input"),
    **_count(folds="number of equal sectors, of which one is integrated"),
    **_count(steps="number of time steps"),
    **_count(contacts="number of times that a blade began to touch"),
    **_real("N s", contact_impulse="sum of the normal impulses of all contacts"),
    **_real("m", orbit_radius="rms distance of the centre from its mean position"),
    **_real("m", centre_peak="largest displacement of the centre in the evidence"),
    **_real("s", last_contact="time of the last contact, -1 for none"),
    **_real("s", end_time="time of the last step", window="length of window"),
    **_real("1/s", growth_rate="growth rate of ln sqrt(energy) over the window"),
    **_real("1/s", growth_error="standard error of growth_rate"),
    **_real(
        "1/s",
        growth_rotor="as growth_rate, of the rotor's energy; at rest, of its "
        "fastest growing free motion",
    ),
    **_real(
        "1/s",
        free_growth="largest growth rate of a free motion, without contact, of rotor, "
        "supports and casing at the window's speeds; 0 if all decay",
    ),
    **_real("1/s", growth_casing="as growth_rate, of the casing's energy"),
    **_real("1/s", growth_centre="growth rate of the centre's ln rms displacement"),
    **_real("1/s", growth_last="as growth_rate, in the last quarter of the window"),
    **_real("1", summit="ln(rotor amplitude at the end / highest one before)"),
    **_real("1", whirl_ratio="(P+ - P-)/(P+ + P-) of forward, backward power"),
    **_real("m2/s", orbit_area="area swept per second by the centre, forward > 0"),
    **_real("rad/s", line_frequency="strongest line of the centre, forward > 0"),
    **_real("J", late_fed="work of rotation and friction in the window"),
    **_real("J", late_friction="work of friction in the window"),
    **_real("J", late_rotation="work of rotation through contacts in the window"),
    **_real("J", late_lost="damping and impact loss in the window"),
    **_real("J", late_energy="mean energy in the window"),
    **_real("s", load_end="end of the last load: pulse, rise, release; 0 for none"),
    **_count(late_contacts="1 if the window has contact"),
    **_real("s", certificate="time from which no contact can recur, -1 for none"),
    **_real("m", certificate_reach="bound of displacements after certificate, or 0"),
    **_real("1", ledger_error="largest error of the energy ledger / its throughput"),
    **_real("1", step_share="time step / stability limit of the time step"),
    **_real("1", gap_error="relative difference of solved gaps from displacements"),
    **_real(
        "1",
        slip_ratio="largest velocity of a tip in contact relative to the casing, "
        "without Omega R, / Omega R; from 1 on a tip may have slid backward",
    ),
    **_real(
        "m",
        tip_growth="largest radial growth of a tip by rotation; 0 if rotation is none",
    ),
    **_real(
        "1",
        lean_checked="largest share, reached / allowed, of the bounds by which parts "
        "of the case are left out; 0 if nothing is, above 1: beyond a bound",
    ),
    **_real("m", gap_scale="length to which the threshold whirl_floor refers"),
    **_real(
        "J",
        driven_energy="energy at the end that a changing speed has put into the rotor "
        "without contact; 0 if speed is constant or rotation none",
    ),
    **_real("J", ledger_energy="kinetic and strain energy at the end"),
    **_real("J", ledger_damping="energy lost in modal damping"),
    **_real("J", ledger_pulse="work of the pulse"),
    **_real("J", ledger_impact="energy lost in impacts"),
    **_real("J", ledger_friction="work of friction on both bodies"),
    **_real("J", ledger_rotation="work of the rotation through the contacts"),
    **_real("J", ledger_residual="residual of the energy ledger"),
}
# variables of campaigns with output.traces = "blades" or "full"
BLADES: dict[str, Quantity] = {
    **_real("m", blade_amplitude="rms distance of a tip from its mean in the"
             " window, largest of all blades"),
    **_real("m", blade_peak="largest displacement of any tip in any sample"),
    **_real("1", localisation="N sum a^4 / (sum a^2)^2 of the blades' rms: 1 if"
             " all move alike, N if one moves alone"),
}  # fmt: skip
# variables of campaigns with output.chaos > 0; measured in sustained cases only
CHAOS: dict[str, Quantity] = {
    **_word(motion="kind of a sustained motion"),
    **_real("1/s", exponent="largest Lyapunov exponent"),
    **_real("1/s", exponent_error="half the width of the exponent's 95 % interval"),
    **_count(period="revolutions after which the motion recurs best"),
    **_real("1", return_distance="distance after a period / size of the motion"),
    **_real("1", zero_one="K of the 0-1 test: 0 regular, 1 chaotic"),
}
# variables of campaigns with solver.estimate; NaN: no longer step is stable
ESTIMATED: dict[str, Quantity] = {
    **_word(coarse_regime="regime of the coarser run of solver.estimate"),
    **_real("1", radius_error="difference of orbit_radius from that run / the larger of"
             " orbit_radius and 0.01 gap"),
    **_real("1", peak_error="the same of centre_peak"),
}  # fmt: skip
# variables of campaigns in which speed or gap change in time
OVER_SPEED: dict[str, Quantity] = {
    **_text("S4096", words_over_speed="words by windows: times, s, speeds, rad/s,"
             " regime, whirl; one interval after the other"),
}  # fmt: skip
# variables of campaigns in which loads of the shaft are read; NaN: the run ends before
# its first sample, or the loads do not follow from the motion
LOADS: dict[str, Quantity] = {
    **_real("N", support_peak="largest force of a support on the rotor in any sample"),
    **_real("s", support_peak_time="time of support_peak"),
    **_text("S64", support_peak_place="the support of support_peak"),
    **_real("N m", torque_peak="largest magnitude of shaft_torque, the torque of the"
             " drive, in any sample"),
    **_text("S512", support_names="names of the supports, in their order in the trace"
             " support_force"),
}  # fmt: skip
# variables of campaigns in which a blade is lost
LOST: dict[str, Quantity] = {
    **_real("N m", friction_torque="mean torque of friction on the rotor in the run"),
    **_real("J", released_energy="kinetic energy of the blade as it leaves, without its"
             " vibration; 0 if none leaves in the run"),
}  # fmt: skip
# variables of campaigns with slip = "set-valued"
SLIPPED: dict[str, Quantity] = {
    **_real("1", stick_share="share of the time in contact in which a tip sticks to the"
             " casing; 0 without contact"),
    **_real("1", reverse_share="share of the time in contact in which a tip slides"
             " against the rotation; at speed 0, either way"),
    **_real("J", friction_heat="energy that friction has taken by sliding"),
}  # fmt: skip
# variables of campaigns with a layer on the casing that wears
WORN: dict[str, Quantity] = {
    **_real("J", ledger_wear="work of wear of a layer on the casing"),
    **_real("m", wear_depth="largest worn depth of the layer"),
    **_real("m3", wear_volume="volume that is worn or pressed down"),
    **_count(wear_lobes="strongest harmonic of the worn depth over the"
             " angle, 0 if none was worn"),
    **_real("J", wear_turning="work of the rotation on rods that tips slid onto,"
             " part of ledger_rotation"),
}  # fmt: skip
# variables of cases whose tuned counterpart was computed, too
TUNED: dict[str, Quantity] = {
    **_real("1", amplification="blade_amplitude over that of the tuned engine"
             " with the same other inputs, modes and step"),
}  # fmt: skip
PERFORMANCE: dict[str, Quantity] = {
    **_real("s", seconds="wall time in the kernel"),
    **_real("us", microseconds_per_step="wall time per step"),
    **_count(rank="rank that computed the case"),
    **_text("S64", host="host that computed the case"),
}
# use of time of each rank of each run, over the dimension `worker`
SHARES: dict[str, Quantity] = {
    **_real("1", busy_fraction="worker_busy / worker_span"),
    **_real("s", worker_busy="time for computing and storing cases"),
    **_real("s", worker_span="time from the first case of any rank to the end of all"),
    **_count(worker_run="run of the campaign", worker_rank="rank in the run"),
    **_count(worker_cases="number of cases finished by the rank"),
    **_text("S64", worker_host="host of the rank"),
}
STATUS: dict[str, Quantity] = {
    **_word(status="whether the case gave a result"),
    **_text("S240", message="reason for no result, or a remark"),
}
# variables of the cases of a refined campaign
REFINED: dict[str, Quantity] = {
    **_text("S16", preset="preset whose inputs the case has"),
    **_count(final="1 unless a case of higher fidelity has a word at this point"),
    **_count(fidelity="0: first fidelity, 1: confirmation"),
    **_count(level="bisections after which the point appears, 0: coarse"),
    **_count(panel="number of the combination of unrefined inputs"),
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
        "m", "tips, rotating frame: radial, tangential", axes=("blade", "component")
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
    "support_force": Quantity(
        "N",
        "force of each support on the rotor, static frame",
        axes=("bearing", "xy"),
    ),
    "shaft_torque": Quantity(
        "N m",
        "torque of the drive on the rotor, mean since the sample before, anticlockwise "
        "> 0",
    ),
    "worn": Quantity(
        "m", "worn depth of each rod of the casing's layer", axes=("rod",)
    ),
}
# quantities that commands and figures derive from these
DERIVED: dict[str, Quantity] = {
    **_real("Hz", frequency="frequency of a line or a mode"),
    **_real("W", power="work per second"),
    **_real("N/m", blade_stiffness="stiffness k_blade of a blade clamped at its root"),
    **_real("rad/s", critical_speed="speed at which Eq. 13 holds"),
    **_real("s", time_step_limit="largest stable step of central differences"),
    **_real("1", centre_share="share of a mode's strain energy in the shaft's springs"),
    **_real(
        "1", clearance_consumption="radial amplitude of a mode's tips / whole amplitude"
    ),
}
# arrays of a model's file, by the last part of their names
ARRAYS: dict[str, Quantity] = {
    **_real("kg", mass="reduced mass matrix"),
    **_real("N/m", stiffness="reduced stiffness matrix"),
    **_real("N s/m", damping="modal damping, D"),
    **_real("kg", coriolis="C, skew-symmetric; forces are -2 Omega C x'"),
    **_real("kg m", centrifugal_load="force per unit Omega^2"),
    **_real("kg", stress_stiffness="stiffening by tension, per unit Omega^2"),
    **_real("kg", softening="in-plane mass matrix, subtracted from stress_stiffness"),
    **_real("rad/s", speeds="the two speeds of stiffness_a and stiffness_b"),
    **_real("N/m", stiffness_a="stiffness matrix at the first of two speeds"),
    **_real("N/m", stiffness_b="stiffness matrix at the second of two speeds"),
    **_real("N s/m", centre_damping="damping of the shaft's non-rotating support"),
    **_real("1/sqrt(kg)", shapes="mass-orthonormal mode shapes, by columns"),
    **_real("rad/s", omega="frequencies of the shapes"),
    **_real("1", damping_ratio="xi of each shape"),
    **_count(nodal_diameter="nodal diameter of each shape"),
    **_count(tip_radial="index of each tip's radial coordinate"),
    **_count(tip_tangential="index of each tip's tangential coordinate"),
    **_count(centre="indices of x_o and y_o; empty if clamped"),
    **_real("m", tip_station="axial position of each contact point of a tip"),
    **_real("rad", tip_angle="angle of each contact point from its blade's"),
    **_real("m", tip_gap="clearance of each contact point less the gap"),
    **_real("Pa/m", stress="stress at named points, of unit coordinates"),
    **_text("S60", stress_name="names of the points of stress"),
    **_real("m", station="axial positions of modal_radial, modal_tangential"),
    **_real("1/sqrt(kg)", modal_tip_radial="radial displacement of the tips"),
    **_real("1/sqrt(kg)", modal_tip_tangential="tangential displacement of tips"),
    **_real("1/sqrt(kg)", modal_centre="displacement of the centre"),
    **_real("1", radial_rows="casing coordinates to w at blades, Omega t = 0"),
    **_real("1", tangential_rows="casing coordinates to u at blades, Omega t = 0"),
    **_count(modal_harmonic="harmonic h of each mode (or pair) of a round casing"),
    **_real("rad/s", modal_omega="frequency of each mode"),
    **_real("1", modal_damping_ratio="xi of each mode"),
    **_real("1/sqrt(kg)", modal_radial="W of w = W cos(h theta)"),
    **_real(
        "1/sqrt(kg)", modal_tangential="U of u = U sin(h theta); for h = 0 a rotation"
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
    "bearing": Quantity("1", "support of the rotor, in the order of support_names"),
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

    It is the last part of the dotted name if results always have that variable, else
    all parts but engine and solver, joined by underscores.
    """
    leaf = dotted.rsplit(".", 1)[-1]
    if leaf in ROW:
        return leaf
    return "_".join(p for p in dotted.split(".") if p not in {"engine", "solver"})
