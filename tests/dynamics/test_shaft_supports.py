"""Supports at a shaft's stations that no constant matrix gives, in the static frame.

A rigid wheel on an unreduced line of beams, with the coordinates Z of its nodes:
M Z'' - i Omega G Z' + K Z = F(Z, Z') - i g M t, marched by itself.
"""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from jeffcott import MASS, stiff
from scipy.integrate import solve_ivp
from scipy.optimize import root

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
JOURNAL = {"journal_viscosity": 0.02, "journal_length": 0.04, "journal_radius": 0.05,
           "journal_clearance": 1e-4}  # fmt: skip
ROLLING = {"rolling_stiffness": 1e10, "rolling_balls": 7, "rolling_clearance": 2e-5,
           "rolling_cage": 0.42, "cxx": 2e3}  # fmt: skip
THIN = {**FILM, "film_viscosity": 2e-6, "film_clearance": 1e-4}
STOP = {"stop_clearance": 6e-5, "stop_friction": 0.3}
WALL = 2e11, 2e5  # N/m, N s/m, in the place of what is rigid
AROUND = np.exp(2j * np.pi * np.arange(400) / 400)
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


def wall(clearance, z, v, rub=0.0):
    """Return the force of a stop that is a stiff damped spring; rub : with its sign."""
    size = abs(z)
    if not size > clearance:
        return 0j
    closing = (v * z.conjugate()).real / size
    press = max(WALL[0] * (size - clearance) + WALL[1] * closing, 0.0)
    return -press * (1 + 1j * rub) * z / size


def force(own, z, v):
    """Return the force of a support by its eight coefficients, or by its film."""
    if own.film:
        size = abs(z)
        along, across = film_shares(size / own.clearance)
        way = z / size if size else 1.0
        turned = v * np.conj(way)
        film = -own.film * complex(along * turned.real, across * turned.imag) * way
        return film + wall(own.clearance, z, v)
    _, kxx, kxy, kyx, kyy, cxx, cxy, cyx, cyy = own.rows[0]
    return -complex(
        kxx * z.real + kxy * z.imag + cxx * v.real + cxy * v.imag,
        kyx * z.real + kyy * z.imag + cyx * v.real + cyy * v.imag,
    )


def of_law(own, z, v, speed, cage):
    """Return the force of a bearing: pressure around a film, or of each ball.

    cage : rad, angle of the first ball
    """
    kind, *numbers = own.law
    if kind == "stop":
        return wall(numbers[0], z, v, numbers[1] * np.sign(speed))
    if kind == "journal":
        viscosity, length, radius, c = numbers
        stream = v - 0.5j * speed * z
        closing = np.maximum((stream * AROUND.conj()).real, 0.0)
        room = c - (z * AROUND.conj()).real
        size = viscosity * radius * length**3 * 2 * np.pi / len(AROUND)
        return -size * (closing / room**3 @ AROUND)
    stiffness, c, balls, _ = numbers
    way = np.exp(1j * (cage + 2 * np.pi * np.arange(balls) / balls))
    lack = np.maximum((z * way.conj()).real - c, 0.0)
    return -stiffness * (lack**1.5 @ way)


def of_sense(own, z, v, speed, time=0.0):
    """Return the same of supports that are mirrored where the rotor turns clockwise.

    A journal and the balls of a bearing turn with the rotor.
    """
    if own.law:
        return of_law(own, z, v, speed, own.law[-1] * speed * time)
    if speed >= 0.0:
        return force(own, z, v)
    return force(own, z.conjugate(), v.conjugate()).conjugate()


def mean_force(own, z, speed):
    """Return the force of a support at rest, over a turn of a cage its mean."""
    if own.law[:1] != ("rolling",):
        return of_sense(own, z, 0j, speed)
    angles = 2 * np.pi / own.law[3] * np.arange(100) / 100
    return np.mean([of_law(own, z, 0j, speed, angle) for angle in angles])


def in_static_frame(scene, times, fast):
    """Return the wheel's displacement X + i Y at times, m, from a velocity, m/s, on."""
    line = whole(scene)
    own, n, wheel = line_matrices(line), line.size, NODE * line.stations[AT]
    rows = [one.row(n) for one in line.supports]
    moved = np.zeros(n)
    moved[: NODE * line.nodes : NODE] = 1.0
    load = -1j * scene.gravity * (own.mass @ moved)
    inverse = np.linalg.solve(own.mass, np.eye(n))

    def pull(z, v, each):
        out = load - own.stiffness @ z + 1j * scene.speed * (own.gyro @ v)
        for one, row in zip(line.supports, rows, strict=True):
            out = out + row * each(one, row @ z, row @ v)
        return out

    def held(both):
        def each(one, z, _):
            return mean_force(one, z, scene.speed)

        out = pull(both.view(complex), np.zeros(n), each)
        return out.view(float)

    begun = np.zeros(n, complex)
    for one, row in zip(line.supports, rows, strict=True):
        begun -= 0.2j * one.law[4] * row if one.law[:1] == ("journal",) else 0.0
        begun -= 1j * (one.law[2] + 5e-6) * row if one.law[:1] == ("rolling",) else 0.0
    sag = root(held, begun.view(float), method="lm", tol=1e-14).x.view(complex)
    z, v = sag, fast * moved + 0j

    def rate(time, s):
        def each(one, z, v):
            return of_sense(one, z, v, scene.speed, time)

        z, v = s[: 2 * n].view(complex), s[2 * n :].view(complex)
        return np.concatenate([v.view(float), (inverse @ pull(z, v, each)).view(float)])

    begun = np.concatenate([z.view(float), v.view(float)])
    found = solve_ivp(rate, (0.0, times[-1]), begun, method="LSODA", t_eval=times,
                      rtol=1e-7, atol=1e-11)  # fmt: skip
    return found.y[2 * wheel] + 1j * found.y[2 * wheel + 1]


SCENES = {
    "apart": ({"station": 0, **OVAL}, {"station": 2, **OVAL, "kyx": -4e6}),
    "films": ({"station": 0, **FILM}, {"station": 2, **FILM}),
    "film, apart": ({"station": 0, **OVAL}, {"station": 2, **FILM}),
}


LOADED = {
    "journals": ({"station": 0, **JOURNAL}, {"station": 2, **JOURNAL}),
    "rolling": ({"station": 0, **ROLLING}, {"station": 2, **ROLLING}),
    "both, film": ({"station": 0, **JOURNAL}, {"station": 1, **FILM},
                   {"station": 2, **ROLLING}),
}  # fmt: skip
STOPPED = {
    "stop": ({"station": 0, **OVAL}, {"station": 2, **OVAL, **STOP}),
    "stop, pedestal": (
        {"station": 0, **OVAL, **STOP},
        {
            "station": 2,
            "kxx": 6e7,
            "cxx": 2e4,
            **STOP,
            "pedestal_mass": 8.0,
            "pedestal_kxx": 2e8,
            "pedestal_cxx": 1e3,
        },
    ),
    "films that bottom": tuple(
        {"station": at, **THIN, "stop_clearance": THIN["film_clearance"]}
        for at in (0, 2)
    ),
}
CASES = [
    *itertools.product(
        SCENES, [(300.0, 0.0, "modal"), (-500.0, 60.0, "modal"),
                 (300.0, 60.0, "general")],
    ),
    ("journals", (300.0, 60.0, "modal")), ("rolling", (-500.0, 60.0, "modal")),
    ("both, film", (-500.0, 60.0, "general")),
    ("stop", (300.0, 0.0, "modal")), ("stop, pedestal", (-500.0, 0.0, "modal")),
    ("films that bottom", (300.0, 0.0, "modal")), ("stop", (-500.0, 0.0, "general")),
]  # fmt: skip
STIFFER = {"rotor.young": 1e14, "time_step": 2e-7, "duration": 2e-3}


@pytest.mark.turns
@pytest.mark.parametrize(("name", "given"), CASES)
def test_free_motion_is_that_of_the_line_in_the_static_frame(name, given):
    speed, gravity, scheme = given
    loaded = name in LOADED  # whose films resist by more than a wheel of beams bears
    more, off = (STIFFER, 2e-4) if loaded else ({}, 5e-3)
    fast = FAST / 8 if loaded else FAST
    if name in STOPPED:  # the ring of the static frame yields
        off = 2e-2
    bearings = (SCENES | LOADED | STOPPED)[name]
    scene = stiff(
        8, speed=speed, shaft=table(*bearings), shaft_station=AT,
        shaft_modes=20, gravity=gravity, unbalance=0.0, scheme=scheme, interval=1e-4,
        gap=1.0, amplitude_limit=1e3, plan="everything", suspension_damping=-1.0,
        **{"casing.kind": "rigid"}, **INERTIA,
        **{"time_step": 2e-6, "duration": 6e-3} | more,
    )  # fmt: skip
    march = March(resolve(scene))
    body = march.model.rotor
    carried = body.mass @ translation(body, 8).real + body.terms.hung[0]
    place, velocity = steady_start(march.model, march.scene)
    velocity = velocity + fast * np.linalg.solve(body.mass, carried)
    none = np.zeros(0)
    assert march.scheme.begin(Motion(place, velocity, none, none))
    history = march.run()
    found = history.centre @ [1, 1j] * np.exp(1j * speed * history.time)
    expected = in_static_frame(march.scene, history.time, fast)
    size = np.abs(expected - expected[0]).max()
    assert size > 2e-5
    assert np.abs(found - expected).max() < off * size
