"""A squeeze film at the centre: Reynolds' equation, circles, motion in any frame.

A rotor of mass m on springs k: m Z'' + k Z = F(Z, Z') + m e Omega^2 e^{i Omega t}.
"""

import numpy as np
import pytest
from jeffcott import HEAVY, MASS, OWN, set_off, stiff
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from hpcwhirl.campaign.simulate import simulate
from hpcwhirl.case.limits import film_error
from hpcwhirl.case.resolve import resolve
from hpcwhirl.case.unbalance import facts_of_unbalance
from hpcwhirl.cli import main
from hpcwhirl.dynamics.kernels.standing import film_at
from hpcwhirl.dynamics.march import March
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.supports import film_shares, valid_up_to
from hpcwhirl.reduction.waves import wave_lines
from hpcwhirl.scene import Scene, apply_settings
from hpcwhirl.scene.words import BEYOND_FILM
from hpcwhirl.structure import small_damping

OIL = {
    "film_viscosity": 0.02, "film_length": 0.03, "film_radius": 0.06,
    "film_clearance": 2e-4, "suspension_damping": 0.0,
}  # fmt: skip
CLEARANCE = OIL["film_clearance"]
LITTLE = small_damping(0.02, 0.03, 0.06, CLEARANCE)
STIFFNESS = MASS * OWN**2
SMALL = {
    "rotation": "full", "blades": 5, "rotor.elements": 2, "modes": 10, "harmonics": 4,
    "time_step": 2e-6, "interval": 1e-4, "scheme": "general", "speed": 400.0,
    **OIL, "film_clearance": 5e-4, "suspension_damping": 0.0275,
}  # fmt: skip
QUIET = {
    "casing.kind": "rigid", "gap": 1.0, "amplitude_limit": 1e3, "force": 0.0,
    "duration": 1e-2, "plan": "everything",
}  # fmt: skip


def march_of(**settings):
    return March(resolve(apply_settings(Scene(), SMALL | settings)))


def force_of_film(place, velocity, clearance=CLEARANCE):
    """Return F of the film, from Z and Z', by its parts along and across Z."""
    size = abs(place)
    along, across = film_shares(size / clearance)
    if size == 0.0:
        return -LITTLE * velocity
    turned = velocity * place.conjugate() / size
    return -LITTLE * complex(along * turned.real, across * turned.imag) * place / size


def reynolds(place, velocity):
    """Return F of the film: the pressure of each strip, by differences along z."""
    strips, points = 720, 41
    angle = 2 * np.pi * np.arange(strips) / strips
    around = np.exp(1j * angle)
    h = CLEARANCE - (place * around.conj()).real
    closing = -(velocity * around.conj()).real
    z, dz = np.linspace(-0.015, 0.015, points, retstep=True)
    second = np.diag(np.full(points - 2, -2.0)) + np.eye(points - 2, k=1)
    inside = np.linalg.solve((second + np.eye(points - 2, k=-1)) / dz**2,
                             np.ones(points - 2))  # fmt: skip
    shape = np.trapezoid(np.r_[0.0, inside, 0.0], z)
    pressure = 12 * 0.02 * closing / h**3 * shape
    return -(pressure * around).sum() * 0.06 * 2 * np.pi / strips


@pytest.mark.parametrize("share", [0.0, 0.3, 0.6 - 0.4j])
def test_the_force_is_that_of_reynolds_pressure(share):
    place, velocity = share * CLEARANCE, 0.02 + 0.05j
    expected = reynolds(place, velocity)
    found = force_of_film(place, velocity)
    # the pressure of the strips is a parabola, of which the trapezoids miss 1/40^2
    assert found == pytest.approx(expected, rel=1e-3)


def test_the_kernel_has_the_film_s_coefficients():
    for share in (0.0, 0.2, 0.7, 0.985, 0.995, 3.0):
        along, across = film_shares(share)
        rest, apart = film_at(share**2)
        assert rest + 1.0 == pytest.approx(across)
        assert apart * min(share, 0.99) ** 2 == pytest.approx((along - across) / 2)


def test_a_linear_film_is_within_a_tenth_up_to_where_it_is_told():
    along, across = valid_up_to()
    assert film_shares(along)[0] == pytest.approx(1.1)
    assert film_shares(across)[1] == pytest.approx(1.1)
    assert (along, across) == pytest.approx((0.1458, 0.2482), abs=1e-4)


def test_a_small_motion_decays_as_with_the_damper_c_0():
    """Re s = -c_0 / 2 m of the rotor's lines, in both senses of rotation."""
    lines = wave_lines(resolve(stiff(8, speed=300.0, **OIL)).model.rotor, 8, 300.0)
    own = [line.growth for line in lines if line.family == "suspension"]
    assert own == pytest.approx([-LITTLE / 2 / MASS] * 2, rel=0.01)


@pytest.mark.parametrize("share", [0.7, 1.0, -1.2])
def test_an_unbalance_circles_where_the_film_at_that_radius_lets_it(share):
    """r |k - m Omega^2 + i Omega c_t(r)| = m e Omega^2."""
    speed, heavy = share * OWN, 5.0 * HEAVY
    scene = stiff(8, speed=speed, time_step=1e-7, **OIL, unbalance=heavy)

    def miss(r):
        stiffness = STIFFNESS - MASS * speed**2
        damping = speed * LITTLE * film_shares(r / CLEARANCE)[1]
        return r * abs(complex(stiffness, damping)) - heavy * speed**2

    radius = brentq(miss, 0.0, 0.989 * CLEARANCE)
    assert radius > 0.3 * CLEARANCE
    found = facts_of_unbalance(resolve(scene).model, scene)
    assert found["radius"] == pytest.approx(radius, rel=0.02)


def test_the_circle_is_what_the_differences_come_to():
    given = QUIET | {"duration": 0.4, "unbalance": 0.03, "time_step": 1e-5}
    march = march_of(**given, **{"engine.rotor.damping": 0.1,
                                 "suspension_damping": 0.2})  # fmt: skip
    facts = facts_of_unbalance(march.model, march.scene)
    assert 0.3 < facts["radius"] / 5e-4 < 0.9
    own = len(march.model.rotor.omega)
    march.state.q_b[:own] = 1e-5
    first = march.scheme.balance(march.state).energy
    march.run()
    assert march.scheme.balance(march.state).energy < 1e-10 * first


@pytest.mark.parametrize("speed", [0.0, 300.0, -800.0])
def test_free_motion_is_that_of_the_static_frame_at_any_speed(speed):
    """Against m Z'' + k Z = F(Z, Z') marched by itself, from eps = 0.8."""
    scene = stiff(5, speed=speed, time_step=1e-6, unbalance=0.0, **OIL, **QUIET)
    march = March(resolve(scene))
    start, velocity = 0.8 * CLEARANCE, 0.05j
    set_off(march, start, velocity)
    history = march.run()

    def rate(_, s):
        z, v = complex(*s[:2]), complex(*s[2:])
        pull = (force_of_film(z, v) - STIFFNESS * z) / MASS
        return [v.real, v.imag, pull.real, pull.imag]

    own = solve_ivp(rate, (0.0, 1e-2), [start, 0.0, 0.0, velocity.imag],
                    t_eval=history.time, rtol=1e-9, atol=1e-14)  # fmt: skip
    z = history.centre @ [1, 1j] * np.exp(1j * speed * history.time)
    assert z == pytest.approx(own.y[0] + 1j * own.y[1], abs=0.01 * start)
    linear = solve_ivp(
        lambda _, s: [s[2], s[3], *(-(STIFFNESS * s[:2] + LITTLE * s[2:]) / MASS)],
        (0.0, 1e-2), [start, 0.0, 0.0, velocity.imag], t_eval=history.time,
    )  # fmt: skip
    assert np.abs(z - linear.y[0] - 1j * linear.y[1]).max() > 0.1 * start


@pytest.mark.parametrize("more", [{}, {"unbalance": 0.05}])
def test_what_the_film_takes_is_booked_in_contact(more):
    march = march_of(duration=0.05, friction=0.2, gap=5e-5, **more)
    history = march.run()
    assert history.contacts > 3
    ledger = history.ledger
    assert abs(ledger["residual"]) < 1e-10 * sum(map(abs, ledger.values()))
    assert np.hypot(*history.centre.T).max() < 5e-4


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"unbalance": 1e-3, "scheme": "paper"}, "unbalance must be 0 with scheme"),
        ({"unbalance": 1e-3, "stiffness_difference": 1e6}, "and have a film"),
        ({"unbalance": 3.0, **QUIET}, r"film_clearance must be > 0.0005 m"),
    ],
)  # fmt: skip
def test_films_that_cannot_be_are_refused_in_one_line(given, told):
    with pytest.raises(InputError, match=told) as failed:
        march_of(**given)
    assert "\n" not in str(failed.value)


@pytest.mark.turns
@pytest.mark.parametrize(("clearance", "beyond"), [(1e-7, True), (1e-3, False)])
def test_a_centre_that_leaves_the_film_is_told(tmp_path, capsys, clearance, beyond):
    given = {
        "rotation": "full", "film_viscosity": 1e-6, "film_length": 1e-4,
        "film_radius": 1e-2, "film_clearance": clearance, "duration": 5e-3,
        "time_step": 2e-6,
    }  # fmt: skip
    line = [f"--set={name}={value}" for name, value in given.items()]
    file = str(tmp_path / "one.h5")
    assert main(["run", *line, "--quiet", "--out", file]) == 0
    assert (BEYOND_FILM in capsys.readouterr().err) == beyond
    assert main(["cases", file, "--columns", "message", "--csv"]) == 0
    assert (BEYOND_FILM in capsys.readouterr().out) == beyond
    result = simulate(apply_settings(Scene(), given))
    assert (BEYOND_FILM in result.notes) == (BEYOND_FILM in result._repr_html_())
    assert (BEYOND_FILM in result.notes) == beyond


STRONG = {  # oil and load of films in contact, by how much they damp
    "thin": {"film_viscosity": 0.002, "film_clearance": 5e-5, "force": 3e4},
    "wide": {"film_viscosity": 0.05, "film_clearance": 2e-4, "force": 1e5},
    "light oil": {"film_viscosity": 2e-4, "film_clearance": 3e-5, "force": 3e4},
}


@pytest.mark.parametrize("name", STRONG)
def test_a_film_s_error_in_time_is_within_its_estimate(name):
    """In contact, against a step four times shorter: of first order, and not above."""
    paths = []
    for step in (2e-6, 1e-6, 5e-7):
        given = {**STRONG[name], "speed": 300.0, "duration": 6e-3, "time_step": step}
        march = march_of(**given, traces="full", interval=2e-5)
        history = march.run()
        paths.append(history.centre)
    size = np.hypot(*paths[-1].T).max()
    away = [np.hypot(*(path - paths[-1]).T).max() / size for path in paths[:2]]
    assert away[0] == pytest.approx(3.0 * away[1], rel=0.2)
    share = history.centre_peak / STRONG[name]["film_clearance"]
    told = film_error(march.model, 2e-6, share)
    assert 0.2 * told < 4.0 / 3.0 * away[0] < told


def test_accuracy_counts_a_film_s_error_in_time():
    case = resolve(apply_settings(Scene(), SMALL | STRONG["thin"] | {"accuracy": 1e-4}))
    assert film_error(case.model, case.step, 0.5) == pytest.approx(1e-4)
    oil = {"film_viscosity": 0.0}
    other = resolve(apply_settings(case.given, oil))
    assert case.step < 0.5 * other.step
    assert film_error(other.model, other.step, 0.5) == 0.0


def test_a_film_that_errs_by_more_than_is_asked_for_is_told():
    given = SMALL | STRONG["wide"] | {"speed": 300.0, "duration": 6e-3}
    scene = apply_settings(Scene(), given | {"time_step": 4e-6})
    (told,) = simulate(scene).notes
    assert told.startswith("the squeeze film's error in time is some 0.0")
    assert simulate(apply_settings(scene, {"time_step": 5e-7})).notes == ()
