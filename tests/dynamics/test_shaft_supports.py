"""Supports at a shaft's stations that no constant matrix gives, in the static frame.

A rigid wheel on an unreduced line of beams, with the coordinates Z of its nodes:
M Z'' - i Omega G Z' + K Z = F(Z, Z') - i g M t, marched by itself.
"""

from dataclasses import replace

import numpy as np
import pytest
from jeffcott import MASS, stiff
from scipy.integrate import solve_ivp

from hpcwhirl.case.resolve import resolve
from hpcwhirl.case.unbalance import steady_start
from hpcwhirl.dynamics.bodies.motion import Motion
from hpcwhirl.dynamics.march import March
from hpcwhirl.reduction.steady import translation
from hpcwhirl.reduction.supports import film_shares
from hpcwhirl.scene.shaft_tables import text_of
from hpcwhirl.structure.shaft import NODE, ShaftDisk, line_matrices, line_of

OVAL = {"kxx": 4e7, "kyy": 9e7, "kxy": 8e6, "kyx": 2e6, "cxx": 2e4, "cyy": 5e3,
        "cxy": 3e3}  # fmt: skip
FILM = {"kxx": 3e7, "film_viscosity": 0.02, "film_length": 0.06, "film_radius": 0.08,
        "film_clearance": 4e-4, "pedestal_mass": 8.0, "pedestal_kxx": 2e8,
        "pedestal_cxx": 1e3}  # fmt: skip
INERTIA = {"polar_inertia": 3.0, "tilt_inertia": 1.6}
FAST, AT = 0.8, 1  # m/s along x of shaft and wheel; its station


def table(*bearings):
    """Return the text of a line of two elements on bearings at both ends."""
    sections = [{"length": x, "outer": 0.12, "elements": 1} for x in (0.3, 0.5)]
    return text_of({"sections": sections, "bearings": [*bearings]}, "the shaft")


def whole(scene):
    """Return the line of a scene with its wheel as a rigid disk."""
    rotor = scene.engine.rotor
    line = line_of(rotor.shaft)
    disk = ShaftDisk(line.stations[AT], MASS, *INERTIA.values())
    return replace(line, disks=(disk,))


def force(own, z, v):
    """Return the force of a support by its eight coefficients, or by its film."""
    if own.film:
        size = abs(z)
        along, across = film_shares(size / own.clearance)
        way = z / size if size else 1.0
        turned = v * np.conj(way)
        return -own.film * complex(along * turned.real, across * turned.imag) * way
    _, kxx, kxy, kyx, kyy, cxx, cxy, cyx, cyy = own.rows[0]
    return -complex(
        kxx * z.real + kxy * z.imag + cxx * v.real + cxy * v.imag,
        kyx * z.real + kyy * z.imag + cyx * v.real + cyy * v.imag,
    )


def of_sense(own, z, v, speed):
    """Return the same of supports that are mirrored where the rotor turns clockwise."""
    if speed >= 0.0:
        return force(own, z, v)
    return force(own, z.conjugate(), v.conjugate()).conjugate()


def in_static_frame(scene, times):
    """Return the wheel's displacement X + i Y at times, m, from `FAST` on."""
    line = whole(scene)
    own, n, wheel = line_matrices(line), line.size, NODE * line.stations[AT]
    rows = [one.row(n) for one in line.supports]
    moved = np.zeros(n)
    moved[: NODE * line.nodes : NODE] = 1.0
    load = -1j * scene.gravity * (own.mass @ moved)
    inverse = np.linalg.solve(own.mass, np.eye(n))

    def pull(z, v):
        out = load - own.stiffness @ z + 1j * scene.speed * (own.gyro @ v)
        for one, row in zip(line.supports, rows, strict=True):
            out = out + row * of_sense(one, row @ z, row @ v, scene.speed)
        return out

    def held(both):
        out = load - pull(both[:n] + 1j * both[n:], np.zeros(n))
        return np.append(out.real, out.imag)

    whole_stiffness = np.column_stack([held(e) for e in np.eye(2 * n)])
    sag = np.linalg.solve(whole_stiffness, np.append(load.real, load.imag))
    z, v = sag[:n] + 1j * sag[n:], FAST * moved + 0j

    def rate(_, s):
        z, v = s[: 2 * n].view(complex), s[2 * n :].view(complex)
        return np.concatenate([v.view(float), (inverse @ pull(z, v)).view(float)])

    begun = np.concatenate([z.view(float), v.view(float)])
    found = solve_ivp(rate, (0.0, times[-1]), begun, method="LSODA", t_eval=times,
                      rtol=1e-7, atol=1e-11)  # fmt: skip
    return found.y[2 * wheel] + 1j * found.y[2 * wheel + 1]


SCENES = {
    "apart": ({"station": 0, **OVAL}, {"station": 2, **OVAL, "kyx": -4e6}),
    "films": ({"station": 0, **FILM}, {"station": 2, **FILM}),
    "film, apart": ({"station": 0, **OVAL}, {"station": 2, **FILM}),
}


@pytest.mark.parametrize(
    ("speed", "gravity", "scheme"),
    [(300.0, 0.0, "modal"), (-500.0, 60.0, "modal"), (300.0, 60.0, "general")],
)
@pytest.mark.parametrize("name", SCENES)
def test_free_motion_is_that_of_the_line_in_the_static_frame(
    name, speed, gravity, scheme
):
    scene = stiff(
        8, speed=speed, shaft=table(*SCENES[name]), shaft_station=AT, shaft_modes=20,
        gravity=gravity, unbalance=0.0, scheme=scheme, time_step=2e-6, interval=1e-4,
        duration=6e-3, gap=1.0, amplitude_limit=1e3, plan="everything",
        suspension_damping=-1.0, **{"casing.kind": "rigid"}, **INERTIA,
    )  # fmt: skip
    march = March(resolve(scene))
    body = march.model.rotor
    carried = body.mass @ translation(body, 8).real + body.terms.hung[0]
    place, velocity = steady_start(march.model, march.scene)
    velocity = velocity + FAST * np.linalg.solve(body.mass, carried)
    none = np.zeros(0)
    assert march.scheme.begin(Motion(place, velocity, none, none))
    history = march.run()
    found = history.centre @ [1, 1j] * np.exp(1j * speed * history.time)
    expected = in_static_frame(march.scene, history.time)
    size = np.abs(expected - expected[0]).max()
    assert size > 1e-4
    assert np.abs(found - expected).max() < 5e-3 * size
