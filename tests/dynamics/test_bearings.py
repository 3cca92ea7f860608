"""Journal and rolling bearings of a shaft: loads, threshold of whirl, ball passing.

A rotor of mass m is carried by two bearings, W = m g / 2 each. The threshold of oil
whirl is that of a rigid rotor on coefficients of a short bearing (J. Lund;
Turbomachinery Rotordynamics, 1993, ch. 3), Q = (pi^2 (1 - eps^2) + 16 eps^2)^{-3/2}.
"""

import math

import numpy as np
import pytest
from jeffcott import MASS, stiff
from scipy.optimize import brentq

from hpcwhirl.campaign.simulate import simulate
from hpcwhirl.case.resolve import resolve
from hpcwhirl.case.unbalance import steady_start
from hpcwhirl.dynamics.bodies.motion import Motion
from hpcwhirl.dynamics.kernels.standing import rolling_force
from hpcwhirl.dynamics.march import March
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.steady import translation
from hpcwhirl.reduction.waves import wave_lines
from hpcwhirl.scene.shaft_tables import text_of

OIL, LENGTH, RADIUS, CLEARANCE = 0.01, 0.03, 0.05, 1e-4
JOURNAL = {"journal_viscosity": OIL, "journal_length": LENGTH,
           "journal_radius": RADIUS, "journal_clearance": CLEARANCE}  # fmt: skip
BALLS, CAGE, PLAY = 7, 0.42, 2e-5
ROLLING = {"rolling_stiffness": "1e10 N/m^1.5", "rolling_balls": BALLS,
           "rolling_clearance": PLAY, "rolling_cage": CAGE}  # fmt: skip
WEIGHT = 9.81
WHOLE = MASS + 0.6 * math.pi / 4 * 0.2**2 * 780  # kg, of wheel and shaft
QUIET = {"force": 0.0, "gap": 1.0, "amplitude_limit": 1e3, "casing.kind": "rigid"}
TOUCHING = {"gap": 4.5e-5, "amplitude_limit": 1.0, "casing.kind": "ring"}


def line(*bearings):
    """Return the text of a light and stiff line, with the wheel in its middle."""
    one = {"length": 0.3, "outer": 0.2, "elements": 1, "young": 5e12, "density": 780}
    sections = [one, one]
    return text_of({"sections": sections, "bearings": [*bearings]}, "the shaft")


def on_both(bearing, **settings):
    """Return the scene of a stiff rotor on two bearings that are alike."""
    both = {"station": 0, **bearing}, {"station": 2, **bearing}
    given = QUIET | {
        "shaft": line(*both), "shaft_station": 1, "shaft_modes": 4, "unbalance": 0.0,
        "gravity": WEIGHT, "suspension_damping": -1.0, "polar_inertia": 1e-6,
        "tilt_inertia": 1.6, "scheme": "modal", "plan": "everything", "speed": 800.0,
        "time_step": 2e-6, "duration": 0.02, "interval": 1e-4,
    }  # fmt: skip
    return stiff(8, **given | settings)


def carried_at(speed):
    """Return eps at which Ocvirk's film carries W; speed : rad/s."""
    size = OIL * RADIUS * LENGTH**3 * speed / (4 * CLEARANCE**2)

    def miss(eps):
        shape = math.sqrt(16 * eps**2 + math.pi**2 * (1 - eps**2))
        return size * eps * shape / (1 - eps**2) ** 2 - WHOLE * WEIGHT / 2

    return brentq(miss, 1e-9, 0.999)


def coefficients(eps):
    """Return K c / W and C c Omega / W, (2, 2), along the load and across it."""
    two, root = math.pi**2, math.sqrt(1 - eps**2)
    q = (two * (1 - eps**2) + 16 * eps**2) ** -1.5
    rest = two + (32 + two) * eps**2 + 2 * (16 - two) * eps**4
    stiff_across = two - 2 * two * eps**2 - (16 - two) * eps**4
    damped = two + 2 * (two - 8) * eps**2
    stiffness = [
        [4 * (2 * two + (16 - two) * eps**2), math.pi * stiff_across / (eps * root)],
        [-math.pi * rest / (eps * root), 4 * rest / (1 - eps**2)],
    ]
    last = two + 2 * (24 - two) * eps**2 + two * eps**4
    damping = [
        [2 * math.pi * root * damped / eps, -8 * damped],
        [-8 * damped, 2 * math.pi * last / (eps * root)],
    ]
    return q * np.array(stiffness), q * np.array(damping)


def largest_growth(speed):
    """Return the largest Re s of the rigid rotor on these coefficients, 1/s."""
    load = WHOLE * WEIGHT / 2
    k, c = coefficients(carried_at(speed))
    k, c = k * load / CLEARANCE, c * load / CLEARANCE / speed
    half, none = WHOLE / 2, np.zeros((2, 2))
    whole = np.block([[none, np.eye(2)], [-k / half, -c / half]])
    return float(np.linalg.eigvals(whole).real.max())


def set_moving(scene, velocity):
    """Return a march that begins in its sag with a velocity along x, m/s."""
    march = March(resolve(scene))
    body = march.model.rotor
    load = body.mass @ translation(body, march.model.blades).real + body.terms.hung[0]
    place, rate = steady_start(march.model, march.scene)
    rate = rate + velocity * np.linalg.solve(body.mass, load)
    none = np.zeros(0)
    assert march.scheme.begin(Motion(place, rate, none, none))
    return march


def in_static_frame(march):
    """Return the centre's displacement X + i Y of a run, m."""
    history = march.run()
    turns = np.exp(1j * march.scene.speed * history.time)
    return history.time, history.centre @ [1, 1j] * turns


def growth_of(speed):
    """Return the growth rate of small motions in a march, 1/s."""
    more = {"rotor.young": 1e13, "time_step": 5e-7, "duration": 0.8, "interval": 5e-4}
    march = set_moving(on_both(JOURNAL, speed=speed, **more), 1e-3)
    time, z = in_static_frame(march)
    sag = march.model.rotor.terms.stations[0].support.sag(speed)
    sizes = np.log(np.abs(z - sag))
    late = time > 0.2
    return np.polyfit(time[late], sizes[late], 1)[0]


@pytest.mark.parametrize("speed", [300.0, -900.0])
def test_a_journal_rests_where_ocvirk_s_film_carries_its_load(speed):
    found = resolve(on_both(JOURNAL, speed=speed)).model.rotor.terms
    for station in found.stations:
        sag = station.support.sag(speed)
        eps = carried_at(abs(speed))
        assert abs(sag) == pytest.approx(eps * CLEARANCE, rel=1e-5)
        attitude = math.atan(math.pi * math.sqrt(1 - eps**2) / (4 * eps))
        expected = -math.pi / 2 + math.copysign(attitude, speed)
        assert np.angle(sag) == pytest.approx(expected, abs=1e-5)


@pytest.mark.slow
def test_oil_whirl_begins_at_the_speed_of_the_published_coefficients():
    """Marched at both sides; the chart's is where the largest Re s is 0."""
    threshold = brentq(largest_growth, 400.0, 1500.0)
    below, above = growth_of(0.97 * threshold), growth_of(1.03 * threshold)
    assert below < 0.0 < above
    found = 0.97 + 0.06 * below / (below - above)
    assert found == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("scheme", ["modal", "general"])
@pytest.mark.parametrize("uneven", [(), (0.05, -0.03, 0.0, 0.02, 0.01, 0.0, 0.0, 0.0)])
def test_a_rotor_in_journal_bearings_rests_to_round_off(scheme, uneven):
    if uneven:  # whose sag is not quite at rest where its sectors differ
        scheme_only = {"scheme": scheme, "duration": 2e-3}
        march = March(resolve(on_both(JOURNAL, mistuning=uneven, **scheme_only)))
        _, z = in_static_frame(march)
        assert np.abs(z - z[0]).max() < 1e-3 * abs(z[0])
        return
    _, z = in_static_frame(March(resolve(on_both(JOURNAL, scheme=scheme))))
    assert np.abs(z - z[0]).max() < 1e-11 * abs(z[0])


@pytest.mark.parametrize("bearing", [JOURNAL, ROLLING | {"cxx": 500.0}])
def test_the_ledger_closes_in_contact_and_both_loops_agree(bearing):
    given = TOUCHING | {"unbalance": 3e-3, "friction": 0.1, "duration": 0.01}
    found = [
        simulate(on_both(bearing, scheme=scheme, **given)).row
        for scheme in ("modal", "general")
    ]
    assert all(row["contacts"] > 0 for row in found)
    assert all(abs(row["ledger_error"]) < 1e-10 for row in found)
    peaks = [row["centre_peak"] for row in found]
    assert peaks[0] == pytest.approx(peaks[1], rel=1e-6)


@pytest.mark.turns
def test_balls_pass_at_their_number_times_the_cage_s_speed():
    """The strongest line of a loaded rotor that nothing else disturbs."""
    given = {"duration": 0.6, "interval": 2e-4, "time_step": 2e-6, "speed": 150.0}
    march = March(resolve(on_both(ROLLING | {"cxx": 5e4}, **given)))
    time, z = in_static_frame(march)
    late = z[time > 0.2] - z[time > 0.2].mean()
    lines = np.abs(np.fft.fft(late * np.hanning(len(late))))
    speeds = 2 * np.pi * np.abs(np.fft.fftfreq(len(late), 2e-4))
    passing = BALLS * CAGE * 150.0
    assert speeds[lines.argmax()] == pytest.approx(passing, abs=speeds[1])


def test_balls_within_their_clearance_press_nothing():
    turn = np.exp(2j * np.pi / BALLS)
    for angle in np.linspace(0.0, 1.0, 7):
        way = np.exp(1j * angle)
        assert rolling_force(0.999 * PLAY * way, 1.0 + 0j, turn, BALLS, PLAY) == 0.0
        assert rolling_force(1.2 * PLAY + 0j, way, turn, BALLS, PLAY).real < 0.0


@pytest.mark.turns
@pytest.mark.parametrize("bearing", [JOURNAL, ROLLING | {"cxx": 500.0}])
@pytest.mark.parametrize("scheme", ["modal", "general"])
def test_a_table_of_one_speed_moves_as_that_speed(scheme, bearing):
    given = {"scheme": scheme, "duration": 4e-3, "unbalance": 1e-4, "time_step": 1e-6}
    table = "time,speed;0,800;1,800"
    first, *others = (
        in_static_frame(March(resolve(on_both(bearing, **given, **more))))[1]
        for more in ({}, {"speed_table": table}, {"acceleration": 1e-9})
    )
    size = np.abs(first - first.mean()).max()
    assert size > 1e-7
    for other in others:  # which a step's error tells from the constant speed's
        assert np.abs(other - first).max() < 1e-5 * size


@pytest.mark.parametrize(
    ("bearing", "told"),
    [
        ({"journal_viscosity": 0.1}, "bearing 1 must have journal_length, journal_rad"),
        (JOURNAL | {"journal_clearance": 0.0}, "journal_clearance must be > 0, got 0"),
        (JOURNAL | {"journal_radius": "5 s"}, "journal_radius must be in m"),
        (ROLLING | {"rolling_balls": 2}, "rolling_balls must be a whole number, 3 to"),
        (ROLLING | {"rolling_stiffness": "1e8 N/m"}, "must be in N/m^1.5, got '1e8 N/"),
        (ROLLING | {"rolling_cage": 1.0}, "rolling_cage must be < 1, got 1"),
    ],
)
def test_what_is_no_bearing_is_refused_in_one_line(bearing, told):
    with pytest.raises(ValueError, match=r"^the shaft: bearing 1") as failed:
        line({"station": 0, **bearing})
    assert told in str(failed.value)
    assert "\n" not in str(failed.value)


@pytest.mark.parametrize("way", [1, -1])
def test_oil_whirl_turns_forward_at_half_the_speed(way):
    # of all that acts in a film only its cross coupling feeds a motion, a forward one
    case = resolve(on_both(JOURNAL, speed=way * 1500.0))
    lines = wave_lines(case.model.rotor, 8, case.given.speed)
    growing = [one for one in lines if one.nodal_diameter == 1 and one.growth > 0.0]
    assert growing
    assert all(0.3 < line.static / 1500.0 < 0.6 for line in growing)


@pytest.mark.parametrize(
    ("given", "got"),
    [
        ({"speed": 1.0}, 1),
        ({"speed_table": "time,speed;0,800;0.02,1"}, 1),
        ({"speed_table": "time,speed;0,800;0.02,-800", "slip": "set-valued"}, 0),
    ],
)
def test_a_speed_at_which_no_film_carries_the_rotor_is_refused(given, got):
    with pytest.raises(InputError, match=rf"speed must be >= \d.*got {got}$"):
        resolve(on_both(JOURNAL, **given)).check()
