"""The table of small engines that every law of the time integration is asked of.

A scene is a base engine, of 7 blades for 4 ms, and what is set on it. A row of `TABLE`
is a scene with the schemes that march it. `ASIDE` names the laws of which a scene is no
case, each with its reason; a law that is not named there holds.
"""

from functools import cache

import numpy as np
from rotor_files import written
from stage import rotor, turning

from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.march import March
from hpcwhirl.scene import apply_settings, named_scene
from hpcwhirl.scene.shaft_tables import text_of

BASE = {
    "duration": 4e-3, "interval": 1e-5, "time_step": 2e-6, "traces": "full",
    "modes": 20, "casing.harmonics": 6, "blades": 7, "speed": 300.0, "gap": 1e-4,
}  # fmt: skip
BLADES = BASE["blades"]
HEAD = "harmonic,amplitude,phase"
COLUMNS = "frequency,kxx,kxy,kyx,kyy,cxx,cxy,cyx,cyy"
FULL = {"rotation": "full"}
SHELL = {
    "discretization": "shell", "casing.width": 0.1, "casing.thickness": 0.004,
    "axial_modes": 2, "casing.harmonics": 4,
}  # fmt: skip
UNEQUAL = {"mistuning": [0.03 * float(np.sin(7.0 * j)) for j in range(BLADES)]}
HELD = {
    "profile": f"{HEAD};2,2e-5,0.4;5,4e-6,0.9;9,3e-6,0.7", "offset": 1e-5,
    "offset_angle": 0.7,
}  # fmt: skip
RIGID = {"kind": "rigid", "amplitude": 1.2e-4, "nodal_diameter": 2}
ELEMENTS = {"discretization": "elements", "casing.elements": 14}
SOFT = {"contact_law": "abradable", "layer_yield": 1e6}
RUBBED = {"contact_law": "archard", "wear_coefficient": 1e-11}
PEDESTAL = {"pedestal_mass": 6.0, "pedestal_kxx": 9e7, "pedestal_cxx": 2e3}


def shaft(*bearings):
    """Return a shaft line on bearings, at whose station 1 the bladed disk sits."""
    return {
        "shaft_station": 1,
        "shaft": text_of({
            "viscous": 2e-5,
            "sections": [
                {"length": 0.2, "outer": 0.12, "inner": 0.05},
                {"length": 0.5, "outer": 0.1, "outer_end": 0.08},
            ],
            "disks": [{"station": 2, "mass": 20.0, "polar": 0.3}],
            "bearings": [*bearings],
        }, "the shaft"),
    }  # fmt: skip


SHAFT = shaft(
    {"station": 0, "kxx": 4e7, "cxx": 5e3, "kxy": 1e6, "kyx": -1e6},
    {"station": 2, "kxx": 6e7, "cxx": 8e3, **PEDESTAL},
)
OVAL = {"kxx": 4e7, "kyy": 7e7, "kxy": 2e6, "kyx": 3e5, "cxx": 5e3, "cyy": 2e3}
APART = shaft({"station": 0, **OVAL}, {"station": 2, **OVAL, **PEDESTAL})
OIL = {"film_viscosity": 0.02, "film_length": 0.03, "film_radius": 0.06,
       "film_clearance": 2e-4}  # fmt: skip
FILMS = shaft({"station": 0, "kxx": 4e7, **OIL}, {"station": 2, "kxx": 6e7, **OIL})
OVER = np.linspace(50.0, 4000.0, 9)  # rad/s, of the whirl
SEAL = {  # a spring in series with a damper, beside those of a shaft
    "whirl_frequency": OVER.tolist(),
    "kxx": (4e7 + 3e7 * OVER**2 / (OVER**2 + 600.0**2)).tolist(),
    "cxx": (5e3 + 3e7 * 600.0 / (OVER**2 + 600.0**2)).tolist(),
    "kxy": (3e6 - 1e3 * OVER).tolist(), "kyx": (1e3 * OVER - 3e6).tolist(),
}  # fmt: skip
WHIRL = shaft({"station": 0, **SEAL, "mxx": 2.0},
              {"station": 2, **SEAL, **PEDESTAL})  # fmt: skip
BOTH = shaft({"station": 0, **OVAL}, {"station": 2, "kxx": 6e7, **OIL, **PEDESTAL})
SLIM = {"journal_viscosity": 0.02, "journal_length": 0.05, "journal_radius": 0.06,
        "journal_clearance": 2e-4}  # fmt: skip
BALLS = {"rolling_stiffness": 1e10, "rolling_balls": 7, "rolling_clearance": 1e-5,
         "rolling_cage": 0.42, "cxx": 2e3}  # fmt: skip
JOURNALS = shaft({"station": 0, **SLIM}, {"station": 2, **SLIM, **PEDESTAL})
LOADED = shaft({"station": 0, **SLIM}, {"station": 2, **BALLS})
STOP = {"stop_clearance": 1e-5, "stop_friction": 0.2}
STOPS = shaft({"station": 0, **OVAL, **STOP}, {"station": 2, "kxx": 6e7, **OIL, **STOP})
WEIGHT = {"gravity": 9.81, "gravity_angle": -1.4}
START = {
    "start_energy": 5.0, "start_modes": "rotor suspension, casing 2",
    "start_draw": 3.0, "force": 0.0,
}  # fmt: skip
TABLED = {"friction_law": "table", "friction_table": "slip,friction;0,0.5;1,0.3;3,0.2"}
STICKS = {"slip": "set-valued", "speed": 3.0, "friction": 0.5}
CENTRAL = "modal", "general", "paper"
ALL = *CENTRAL, "exact"
CYCLIC = "modal", "exact"

SLOWER = STICKS | {"speed": 0.3}

TABLE = {  # scene: what is set, the schemes that march it
    "equal": ({}, ALL),
    "equal, one blade fewer": ({"blades": 6}, CYCLIC),
    "fold": ({"blades": 6, "nodal_diameter": 2}, CYCLIC),
    "no friction": ({"friction": 0.0}, CYCLIC),
    "rotation": (FULL, ALL),
    "unbalance": (FULL | {"unbalance": 5e-3, "unbalance_phase": 0.3}, ALL),
    "unequal": (UNEQUAL, CENTRAL),
    "unequal, rotation": (FULL | UNEQUAL, ("modal", "general")),
    "unequal, unbalance": (FULL | UNEQUAL | {"unbalance": 5e-3}, ("modal",)),
    "lost blade": (FULL | {"lost_blade": 2}, CENTRAL),
    "lost blade, rigid": (FULL | RIGID | {"lost_blade": 2}, ("modal",)),
    "lost blade, elements": (FULL | ELEMENTS | {"lost_blade": 2}, ("modal",)),
    "lost blade later": (
        FULL | {"lost_blade": 2, "lost_blade_time": 1.5e-3, "unbalance": 5e-3}, CENTRAL
    ),
    "lost blade later, rigid": (
        FULL | RIGID | {"lost_blade": 2, "lost_blade_time": 1.5e-3}, ("modal",)
    ),
    "lost blade later, elements": (
        FULL | ELEMENTS | {"lost_blade": 2, "lost_blade_time": 1.5e-3}, ("modal",)
    ),
    "lost blade later, film": (
        FULL | {"lost_blade": 2, "lost_blade_time": 1.5e-3, "film_viscosity": 0.01},
        ("modal",),
    ),
    "lost blade later, unlike supports": (
        FULL | {"lost_blade": 2, "lost_blade_time": 1.5e-3, "unbalance": 5e-3,
                "stiffness_difference": 1.2e7, "damping_difference": 1200.0},
        ("modal",),
    ),
    "weight": (FULL | WEIGHT, ("modal", "general")),
    "weight, unbalance": (FULL | WEIGHT | {"unbalance": 5e-3}, ("modal",)),
    "weight, unequal": (FULL | UNEQUAL | WEIGHT | {"unbalance": 5e-3}, ("modal",)),
    "weight, unequal, unlike supports": (
        FULL | UNEQUAL | WEIGHT | {"stiffness_difference": 1.2e7}, ("modal",),
    ),
    "weight, lost blade": (FULL | WEIGHT | {"lost_blade": 2}, ("modal",)),
    "weight, elements": (FULL | ELEMENTS | WEIGHT, ("modal",)),
    "film": (FULL | {"film_viscosity": 0.01}, ("modal", "paper")),
    "unequal, film": (FULL | UNEQUAL | {"film_viscosity": 0.01}, ("modal",)),
    "unlike supports": (
        FULL | {"stiffness_difference": 1.2e7, "damping_difference": 1200.0},
        ("modal", "paper"),
    ),
    "unlike supports, unbalance": (
        FULL | {"stiffness_difference": 1.2e7, "unbalance": 5e-3},
        ("modal",),
    ),
    "unequal, unlike supports, unbalance": (
        FULL | UNEQUAL | {"stiffness_difference": 1.2e7, "damping_difference": 1200.0,
                          "unbalance": 5e-3},
        ("modal",),
    ),
    "lost blade, unlike supports": (
        FULL | {"lost_blade": 2, "stiffness_difference": 1.2e7}, ("modal",),
    ),
    "bearing": (FULL | {"bearing": ("3.4e7", "3.0e7")}, ("modal",)),
    "bearing alike": (FULL | {"bearing": ("3.4e7", "3.4e7")}, CYCLIC),
    "cross-coupling": (FULL | {"cross_coupling": 1e6}, CYCLIC),
    "tilt": (FULL | {"shaft": "cantilever"}, CYCLIC),
    "shaft": (FULL | SHAFT, ALL),
    "shaft over whirl": (FULL | WHIRL, ALL),
    "unequal, shaft over whirl, unbalance": (
        FULL | UNEQUAL | WHIRL | {"unbalance": 5e-3}, ("modal",),
    ),
    "shaft, supports apart": (FULL | APART, ("modal", "paper")),
    "shaft, supports apart, unbalance": (
        FULL | APART | {"unbalance": 5e-3}, ("modal",),
    ),
    "shaft, film, supports apart": (FULL | BOTH, ("modal", "general")),
    "unequal, shaft, films, unbalance": (
        FULL | FILMS | UNEQUAL | {"unbalance": 5e-3}, ("modal",),
    ),
    "lost blade, shaft, supports apart": (FULL | APART | {"lost_blade": 2}, ("modal",)),
    "weight, shaft, films": (FULL | FILMS | WEIGHT, ("modal",)),
    "weight, shaft, journals": (FULL | JOURNALS | WEIGHT, ("modal",)),
    "weight, shaft, supports apart, unequal": (
        FULL | APART | WEIGHT | UNEQUAL | {"unbalance": 5e-3}, ("modal",),
    ),
    "unequal, unbalance, shaft": (
        FULL | SHAFT | UNEQUAL | {"unbalance": 5e-3}, ("modal",),
    ),
    "run-up, rotation, shaft": (
        FULL | SHAFT | {"acceleration": 2000.0, "unbalance": 5e-3}, ("modal",),
    ),
    "run-up, rotation, shaft, films, weight": (
        FULL | FILMS | WEIGHT | {"acceleration": 2000.0, "unbalance": 5e-3}, ("modal",),
    ),
    "run-up, rotation, shaft, journal, balls, weight": (
        FULL | LOADED | WEIGHT | {"acceleration": 2000.0, "unbalance": 1e-3},
        ("modal",),
    ),
    "run-up, rotation, supports apart, film": (
        FULL | {"stiffness_difference": 1.2e7, "damping_difference": 1200.0,
                "film_viscosity": 0.01, "unbalance": 5e-3, "acceleration": 2000.0},
        ("modal",),
    ),
    "stop": (FULL | STOP, CENTRAL),
    "stop, film, unequal": (FULL | UNEQUAL | STOP | {"film_viscosity": 1e-4},
                            ("modal",)),
    "shaft, stops": (FULL | STOPS, ("modal", "general")),
    "run-up, rotation, shaft, stops": (
        FULL | STOPS | {"acceleration": 2000.0, "unbalance": 3e-3}, ("modal",),
    ),
    "clamped": ({"centre": "clamped"}, ("modal",)),
    "shell": (SHELL, ("modal",)),
    "elements": (ELEMENTS, ("modal", "paper")),
    "elements, unbalance": (FULL | ELEMENTS | {"unbalance": 5e-3}, ("modal",)),
    "rigid": (RIGID, ALL),
    "rigid, unbalance": (FULL | RIGID | {"unbalance": 5e-3}, ("modal",)),
    "points": (SHELL | {"file": "still", "blades": 5, "nodal_diameter": 2}, CENTRAL),
    "points, rotation": (
        FULL | {"file": "turning", "blades": 5, "nodal_diameter": 2,
                "unbalance": 2e-4},
        ("modal",),
    ),
    "run-up": ({"acceleration": 2000.0}, ("modal", "paper")),
    "run-up, rotation": (FULL | {"acceleration": 2000.0, "unbalance": 5e-3},
                         ("modal",)),
    "run-down": ({"acceleration": -3000.0, "ramp": "decay", "speed_to": 100.0},
                 ("modal", "general")),
    "run-up, unequal": (UNEQUAL | {"acceleration": 2000.0}, ("modal",)),
    "run-up, elements": (ELEMENTS | {"acceleration": 2000.0}, ("modal",)),
    "gap closes": ({"gap_closure": 6e-5, "gap_time": 3e-3}, ("modal", "paper")),
    "gap closes, unequal": (UNEQUAL | {"gap_closure": 6e-5, "gap_time": 3e-3},
                            ("modal",)),
    "gap closes, points": (
        SHELL | {"file": "still", "blades": 5, "nodal_diameter": 2,
                 "gap_closure": 6e-5, "gap_time": 3e-3},
        ("modal",),
    ),
    "oval": (HELD, ("modal", "exact", "paper")),
    "oval, rotation": (FULL | HELD, ("modal",)),
    "oval, unequal": (UNEQUAL | HELD, ("modal",)),
    "oval let go": (
        {"profile": f"{HEAD};2,2e-5,0.4;5,4e-6,0.9", "profile_release": 1.502e-3},
        CENTRAL,
    ),
    "layer": (SOFT, CENTRAL),
    "layer, rubbed": (RUBBED, ("modal",)),
    "layer, rotation": (FULL | SOFT, ("modal",)),
    "layer, unequal": (UNEQUAL | SOFT, ("modal",)),
    "layer, lost blade": (FULL | SOFT | {"lost_blade": 2}, ("modal",)),
    "layer, lost blade later": (
        FULL | SOFT | {"lost_blade": 2, "lost_blade_time": 1.5e-3}, ("modal",)
    ),
    "layer, film": (FULL | SOFT | {"film_viscosity": 0.01}, ("modal",)),
    "layer, run-up": (SOFT | {"acceleration": 2000.0}, ("modal",)),
    "layer, elements": (ELEMENTS | SOFT, ("modal",)),
    "stribeck": ({"friction_law": "stribeck", "friction_speed": 80.0}, CYCLIC),
    "stribeck, run-up": (
        {"friction_law": "stribeck", "friction_speed": 80.0, "acceleration": 2000.0},
        ("modal", "paper"),
    ),
    "sticks": (STICKS, ALL),
    "sticks, long pulse": (STICKS | {"pulse": 2.4e-3}, CYCLIC),
    "sticks, fold": (STICKS | {"blades": 6, "nodal_diameter": 2}, CYCLIC),
    "sticks, stribeck": (
        STICKS | {"friction_law": "stribeck", "friction_speed": 0.5},
        ("modal", "exact", "paper"),
    ),
    "sticks, rotation": (FULL | STICKS, ("modal", "exact", "paper")),
    "sticks, unlike supports, unbalance": (
        FULL | STICKS | {"stiffness_difference": 1.2e7, "unbalance": 5e-3}, ("modal",)
    ),
    "sticks, unequal": (UNEQUAL | STICKS, ("modal", "paper")),
    "sticks, unequal, film": (
        FULL | UNEQUAL | STICKS | {"film_viscosity": 0.01, "unbalance": 5e-3},
        ("modal",),
    ),
    "sticks, elements": (ELEMENTS | STICKS, ("modal", "paper")),
    "sticks, points": (
        SHELL | STICKS | {"file": "still", "blades": 5, "nodal_diameter": 2}, ("modal",)
    ),
    "sticks, run-down": (
        STICKS | {"acceleration": -800.0, "speed_to": 1.0, "speed": 3.0}, ("modal",)
    ),
    "sticks, run-down through 0": (
        STICKS | {"acceleration": -2500.0, "speed_to": -3.0}, ("modal",)
    ),
    "sticks, run-down through 0, unequal": (
        UNEQUAL | STICKS | {"acceleration": -2500.0, "speed_to": -3.0}, ("modal",)
    ),
    "sticks, run-up, rotation": (
        FULL | STICKS | {"acceleration": 500.0, "unbalance": 5e-3}, ("modal",)
    ),
    "sticks, run-up, rotation, film, weight": (
        FULL | STICKS | WEIGHT
        | {"acceleration": -2500.0, "speed_to": -3.0, "unbalance": 5e-3,
           "film_viscosity": 0.01},
        ("modal",),
    ),
    "sticks, rotation, lost blade": (FULL | STICKS | {"lost_blade": 2}, ("modal",)),
    "sticks, layer": (SLOWER | SOFT, CENTRAL),
    "sticks, layer, rotation": (FULL | SLOWER | SOFT, ("modal", "paper")),
    "sticks, layer, rubbed": (STICKS | RUBBED, ("modal", "paper")),
    "sticks, layer, unequal": (UNEQUAL | SLOWER | SOFT, ("modal", "paper")),
    "sticks, layer, lost blade": (FULL | SLOWER | SOFT | {"lost_blade": 2}, ("modal",)),
    "sticks, table": (STICKS | TABLED, ("modal", "exact", "paper")),
    "start": (START, CYCLIC),
    "start, unbalance": (FULL | START | {"unbalance": 5e-3}, ALL),
    "start, lost blade": (FULL | START | {"lost_blade": 2}, ("modal", "general")),
    "start, unbalance, unlike supports": (
        FULL | START | {"unbalance": 5e-3, "stiffness_difference": 1.2e7}, ("modal",),
    ),
    "start, unbalance, run-up": (
        FULL | START | {"unbalance": 5e-3, "acceleration": 2000.0}, ("modal",),
    ),
    "start, run-up": (FULL | START | {"acceleration": 2000.0}, ("modal",)),
    "gap at rest": (FULL | {"gap_at": "rest", "gap": 1.4e-4}, CYCLIC),
}  # fmt: skip
ROWS = [(scene, scheme) for scene, (_, schemes) in TABLE.items() for scheme in schemes]


def of_files(given, place):
    """Return the inputs of a scene with its files written to a folder."""
    if "file" in given:
        made = rotor() if given["file"] == "still" else turning(rotor())
        given = given | {"file": str(written(place / f"{given['file']}.h5", made))}
    if "bearing" in given:
        x, y = given["bearing"]
        table = place / f"{x}{y}.csv"
        rows = [f"{at},{x},1e6,-1e6,{y},2e3,0,0,2e3" for at in (0, 900)]
        table.write_text("\n".join([COLUMNS, *rows, ""]))
        given = given | {"bearing": str(table)}
    return given


class Scenes:
    """The scenes of the table, each marched once for all laws that look at it."""

    def __init__(self, place):
        self.place = place
        self.ended = cache(self._ended)

    def case(self, name, scheme, **more):
        """Return the case of a row, with further settings."""
        given = BASE | of_files(TABLE[name][0], self.place) | {"scheme": scheme} | more
        return resolve(apply_settings(named_scene("table2"), given))

    def march(self, name, scheme, **more):
        """Return the march of a row before its first step."""
        return March(self.case(name, scheme, **more))

    def _ended(self, name, scheme):
        march = self.march(name, scheme)
        return march, march.run()
