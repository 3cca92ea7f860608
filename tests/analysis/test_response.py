"""The response to an unbalance over the speed, and what API 617 says of it.

|z| = e r^2 / sqrt((1 - r^2)^2 + (2 xi r)^2), r = Omega / omega, of a Jeffcott rotor
peaks at 1 / r^2 = 1 - 2 xi^2, and has 1 / sqrt(2) of its peak at 1 / r^2 = 1 - 2 xi^2
-+ 2 xi sqrt(1 - xi^2).
"""

import json
import tomllib

import numpy as np
import pytest
from jeffcott import HEAVY, MASS, OWN, stiff

from hpcwhirl.analysis.api617 import (
    Operating,
    Peak,
    margin_of,
    required_margin,
    scale_factor,
    unbalance_of,
)
from hpcwhirl.analysis.response import moving_mass, steady_at
from hpcwhirl.analysis.response_study import BEYOND, offered, study
from hpcwhirl.analysis.shaft_response import (
    disk_of,
    dynamic_stiffness,
    forces_of,
    shaft_ellipses,
)
from hpcwhirl.campaign.plan.design import Design
from hpcwhirl.case.resolve import resolve
from hpcwhirl.case.unbalance import exact_steady, facts_of_unbalance
from hpcwhirl.cli import main
from hpcwhirl.dynamics.march import March
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.shaft_whirl import held_by
from hpcwhirl.reduction.supports import planar
from hpcwhirl.reduction.waves import turning_matrices
from hpcwhirl.report.figures.response import draw_response
from hpcwhirl.scene import Scene, apply_settings
from hpcwhirl.scene.bearing_tables import HEAD
from hpcwhirl.scene.shaft_tables import text_of
from hpcwhirl.structure.shaft import NODE, added_matrix, line_matrices, line_of

SMALL = {
    "rotation": "full", "blades": 5, "rotor.elements": 2, "modes": 10, "harmonics": 4,
    "unbalance": 1e-3, "speed": 500.0,
}  # fmt: skip
APART = {"stiffness_difference": 4e6, "damping_difference": 500.0, "scheme": "modal"}
TABLE = ";".join(
    [HEAD, "0,3e7,1e5,-2e5,2e7,9e3,0,0,7e3", "2000,5e7,0,0,6e7,9e3,0,0,9e3"]
)
FILM = {"film_viscosity": 0.02, "film_clearance": 1e-3, "scheme": "modal"}


def small(**given):
    return apply_settings(Scene(), SMALL | given)


def half_powers(ratio):
    """Return N_1, N_c, N_2 of a Jeffcott rotor over its natural frequency."""
    wide = 2 * ratio * np.sqrt(1 - ratio**2)
    return (1 - 2 * ratio**2 + np.array([wide, 0.0, -wide])) ** -0.5


@pytest.mark.turns
@pytest.mark.parametrize("ratio", [1e-4, 0.05, 0.2])
def test_amplification_of_a_jeffcott_rotor_is_that_of_its_half_power_points(ratio):
    scene = stiff(8, speed=OWN, suspension_damping=ratio)
    found = study(scene, Operating(0.5 * OWN, 1.2 * OWN))
    low, top, high = half_powers(ratio)
    for place in ("centre", "tips"):
        (peak,) = found.peaks[place]
        ends = np.array([peak.below, peak.speed, peak.above])
        assert ends == pytest.approx(OWN * half_powers(ratio), rel=2e-3)
        assert peak.two_sided
        assert peak.amplification == pytest.approx(top / (high - low), rel=3e-3)
    most = HEAVY / MASS / (2 * ratio * np.sqrt(1 - ratio**2))
    assert found.peaks["centre"][0].amplitude == pytest.approx(most, rel=3e-3)


def test_a_rotor_beyond_half_of_critical_damping_has_no_peak():
    scene = stiff(8, speed=OWN, suspension_damping=0.75)
    found = study(scene, Operating(0.5 * OWN, 1.2 * OWN))
    assert found.peaks["centre"] == []


def parts_of(z, time, speed):
    """Return f, b of the centre's motion z, (n,), rotating frame."""
    parts = np.column_stack([np.ones(len(z)), np.exp(-2j * speed * time)])
    return np.linalg.lstsq(parts, z, rcond=None)[0]


@pytest.mark.parametrize("share", [0.6, 1.4])
def test_the_response_is_the_circle_at_which_an_integration_arrives(share):
    """Of matrices and central differences; off its circle by a half when it begins."""
    scene = stiff(
        3, **{"casing.kind": "rigid", "rotor.damping": 0.05}, scheme="paper", gap=1.0,
        speed=share * OWN, suspension_damping=0.3, time_step=2e-6, duration=0.15,
    )  # fmt: skip
    march = March(resolve(scene))
    march.state.q_b[:-1] *= 0.5
    march.state.d_b[:] *= 0.5
    history = march.run()
    last = parts_of(history.centre[-999:] @ [1, 1j], history.time[-999:], scene.speed)
    found = steady_at(scene, scene.speed)
    assert last == pytest.approx(found.centre, rel=1e-6, abs=1e-6 * abs(last[0]))


ROOT = np.sqrt(6)
RADAU = np.array([
    [(88 - 7 * ROOT) / 360, (296 - 169 * ROOT) / 1800, (-2 + 3 * ROOT) / 225],
    [(296 + 169 * ROOT) / 1800, (88 + 7 * ROOT) / 360, (-2 - 3 * ROOT) / 225],
    [(16 - ROOT) / 36, (16 + ROOT) / 36, 1 / 9],
])  # fmt: skip


def radau(matrix, load, period, count, times):
    """Return y over the last of `times` periods of y' = A(t) y + g, of period A.

    From y = 0, in `count` steps a period of order 5, L-stable: (count, n).
    """
    n, step, maps = len(load), period / count, []
    for number in range(count):
        at = (number + RADAU.sum(axis=1)) * step
        whole = np.vstack([
            np.hstack([RADAU[i, j] * step * matrix(at[j]) for j in range(3)])
            for i in range(3)
        ])  # fmt: skip
        forced = step * np.kron(RADAU.sum(axis=1), load)
        right = np.column_stack([np.tile(np.eye(n), (3, 1)), forced])
        maps.append(np.linalg.solve(np.eye(3 * n) - whole, right)[-n:])
    y, out = np.zeros(n), []
    for number in range(times * count):
        y = maps[number % count] @ np.append(y, 1.0)
        out.append(y)
    return np.array(out[-count:])


@pytest.mark.turns
@pytest.mark.parametrize("speed", [300.0, 700.0])
@pytest.mark.parametrize("given", [{}, {"bearing": TABLE}, APART])
def test_the_response_is_the_ellipse_of_another_integration(given, speed):
    """Of the rotor's matrices and supports, with their forces over time, by Radau."""
    few = {"blades": 3, "modes": 0, "rotor.damping": 0.2, "suspension_damping": 0.4}
    scene = small(**few, **given)
    scene = apply_settings(scene, {"speed": speed})
    model = resolve(scene).model
    gyro, damping, held, push = turning_matrices(model.rotor, speed, model.blades)
    n, hub = len(held), np.s_[6:8]
    solved = np.linalg.solve(model.rotor.mass, np.eye(n))
    own = model.rotor.terms.support.at(speed)
    mirror = np.diag([1.0, -1.0])

    def matrix(time):
        turned = np.exp(-2j * speed * time)
        stiffness, rate = held + push, damping + gyro
        apart = own.stiffness_apart - 1j * speed * own.damping_apart
        stiffness[hub, hub] += planar(apart * turned) @ mirror
        rate[hub, hub] += planar(own.damping_apart * turned) @ mirror
        low = np.hstack([-solved @ stiffness, -solved @ rate])
        return np.vstack([np.hstack([np.zeros((n, n)), np.eye(n)]), low])

    load = np.zeros(2 * n)
    load[n:] = solved[:, 6] * scene.unbalance * speed**2
    period, count, times = np.pi / speed, 80, 60
    moved = radau(matrix, load, period, count, times)[:, hub] @ [1, 1j]
    time = period / count * np.arange(1, count + 1)
    found = steady_at(scene, speed).centre
    size = abs(found[0])
    assert parts_of(moved, time, speed) == pytest.approx(
        found, rel=1e-6, abs=1e-6 * size
    )


@pytest.mark.parametrize("speed", [200.0, 500.0, 900.0])
@pytest.mark.parametrize("given", [{}, {"cross_coupling": 3e5}, APART])
def test_supports_take_what_springs_and_dampers_give(given, speed):
    scene = small(**given, **{"rotor.damping": 0.0})
    found = steady_at(scene, speed)
    own = resolve(scene).model.rotor.terms.support.at(speed)
    (f, b), spring = found.centre, scene.engine.rotor.centre_stiffness
    held = own.stiffness + spring
    turned = 1j * speed * own.damping
    apart, across = own.stiffness_apart, 1j * speed * own.damping_apart
    forward = (held + turned) * f + (apart + across) * np.conj(b)
    backward = (held - turned) * b + (apart - across) * np.conj(f)
    assert found.supports == pytest.approx((forward, backward), rel=1e-9, abs=1e-9)


LINE = {
    "sections": [{"length": 0.3, "outer": 0.08}, {"length": 0.5, "outer": 0.09}],
    "disks": [{"station": 1, "mass": 40.0, "polar": 0.9, "diametral": 0.5}],
    "bearings": [
        {"station": 0, "kxx": 4e7, "cxx": 2e3},
        {"station": 1, "kxx": 6e7, "cxx": 5e3, "kxy": 1e6, "kyx": -1e6},
    ],
}  # fmt: skip
ON_LINE = {"shaft": text_of(LINE, "line"), "shaft_station": 2, "shaft_modes": 8}


@pytest.mark.parametrize("changes", [[], [0.0] * 4 + [1e-9]])
@pytest.mark.parametrize("speed", [100.0, 300.0, 500.0])
def test_a_line_carries_the_disk_s_inertia_and_unbalance(speed, changes):
    """Of a disk with stiff blades: F = U Omega^2 + m Omega^2 z, M = Omega^2 (I_d - I_p)
    Phi."""
    scene = small(
        **ON_LINE, **{"rotor.young": 2.1e17, "mistuning": changes},
        polar_inertia=3.0, tilt_inertia=1.8,
    )  # fmt: skip
    rotor, model = scene.engine.rotor, resolve(scene).model
    own = apply_settings(scene, {"speed": speed})
    places = exact_steady(model, own).still
    none, line = 0.0 * places, line_of(rotor.shaft)
    (moved, back), supports = shaft_ellipses(rotor, model, places, none, speed)
    held, whole = disk_of(rotor, line), dynamic_stiffness(line, speed, supports)
    assert not back.any()
    force, moment = whole[held, : line.size] @ moved
    z, slope = moved[held]
    mass = moving_mass(scene) - line.mass
    expected = (scene.unbalance + mass * z) * speed**2
    assert force == pytest.approx(expected, rel=1e-3)
    assert moment == pytest.approx(speed**2 * (1.8 - 3.0) * slope, rel=1e-3)
    found = steady_at(scene, speed)
    assert found.stations[2][0] == pytest.approx(found.centre[0], rel=1e-12)
    own = held_by(line)[1].support.at(speed)
    stiffness = own.stiffness + 1j * speed * own.damping
    expected = stiffness * found.stations[1][0]
    assert found.forces[1][0] == pytest.approx(expected, rel=1e-12)
    assert sum(f for f, _ in found.forces) == pytest.approx(
        found.supports[0], rel=1e-12
    )


OIL = {"film_viscosity": 0.02, "film_length": 0.05, "film_radius": 0.06,
       "film_clearance": 2e-4}  # fmt: skip
ENDS = {
    "apart": [{"station": i, "kxx": 4e7, "kyy": 8e7, "kxy": 5e6, "kyx": 1e6,
               "cxx": 5e3, "cyy": 2e3} for i in (0, 1)],
    "film": [{"station": 0, "kxx": 4e7, "cxx": 2e3},
             {"station": 1, "kxx": 6e7, **OIL}],
    "added mass": [{"station": 0, "kxx": 4e7, "cxx": 2e3, "mxx": 300.0},
                   {"station": 1, "kxx": 6e7, "cxx": 2e3, "mxx": 80.0,
                    "pedestal_mass": 20.0, "pedestal_kxx": 3e8}],
}  # fmt: skip


@pytest.mark.parametrize("speed", [100.0, 300.0])
@pytest.mark.parametrize("name", ENDS)
def test_forces_of_unlike_supports_and_films_carry_what_turns(name, speed):
    """The supports' sum is that of all inertia along the line, and of the unbalance."""
    shaft = {"shaft": text_of(LINE | {"bearings": ENDS[name]}, "line")}
    scene = small(
        **ON_LINE | shaft, **{"rotor.young": 2.1e17}, polar_inertia=3.0,
        tilt_inertia=1.8, unbalance=0.05,
    )  # fmt: skip
    model = resolve(scene).model
    found = exact_steady(model, apply_settings(scene, {"speed": speed}))
    line = line_of(scene.engine.rotor.shaft)
    both, supports = shaft_ellipses(
        scene.engine.rotor, model, found.still, found.of(2).conj() / 2, speed
    )
    moved, own = np.zeros(line.size), line_matrices(line)
    moved[: NODE * line.nodes : NODE] = moved[NODE * line.nodes :] = 1.0
    *_, ground = forces_of(supports, both, speed)
    wheel = moving_mass(scene) - line.mass
    at = disk_of(scene.engine.rotor, line)[0]
    for part, load, force in zip(both, (scene.unbalance, 0.0), ground, strict=True):
        turned = (own.mass - added_matrix(line)) @ part  # the fluid pushes the ground
        carried = moved @ turned + wheel * part[at] + load
        assert force == pytest.approx(speed**2 * carried, rel=2e-3)
    assert (abs(ground[1]) > 0.01 * abs(ground[0])) == (name == "apart")


@pytest.mark.slow
def test_stations_of_a_line_are_places_with_peaks_and_the_probes_of_the_scale():
    found = study(small(**ON_LINE), Operating(150.0, 250.0))
    assert {"station 0", "station 1", "station 2", "support 0", "support 1"} < (
        found.peaks.keys()
    )
    for one, other in zip(found.peaks["station 2"], found.peaks["centre"], strict=True):
        assert one.speed == pytest.approx(other.speed, rel=1e-6)
        assert one.amplification == pytest.approx(other.amplification, rel=1e-4)
    among = [one for one in found.points if 150.0 <= one.speed <= 250.0]
    most = max(abs(f) for one in among for f, _ in one.stations)
    assert found.scale == pytest.approx(scale_factor(most, 250.0))


@pytest.mark.parametrize("given", [{}, APART, FILM])
def test_the_circle_is_that_of_the_case(given):
    """The film is that at the circle's radius; `APART` up to the error of its steps."""
    scene = small(**given)
    facts = facts_of_unbalance(resolve(scene).model, scene)
    found = steady_at(scene, scene.speed)
    sizes = [abs(part) for part in found.centre]
    assert sizes == pytest.approx([facts["radius"], facts["backward"]], rel=1e-5)
    assert found.reach == pytest.approx(facts["reach"], rel=1e-5)
    assert found.used == pytest.approx(facts["over_gap"], rel=1e-5)


@pytest.mark.turns
def test_a_film_that_the_circle_would_close_is_refused_by_name():
    scene = small(**FILM, unbalance=1.0)
    with pytest.raises(InputError, match="film_clearance must be >"):
        study(scene, Operating(400.0, 500.0))


@pytest.mark.parametrize(
    ("factor", "below", "above"),
    [(2.4, 0, 0), (2.5, 0, 10), (4.0, 10.2, 20.2), (18.5, 16, 26), (1e9, 16, 26)],
)
def test_separation_margins_are_those_of_the_standard(factor, below, above):
    assert 100 * required_margin(factor, above=False) == pytest.approx(below)
    assert 100 * required_margin(factor, above=True) == pytest.approx(above)


@pytest.mark.parametrize(
    ("speed", "actual", "verdict"),
    [(80.0, 0.2, "kept"), (90.0, 0.1, "too close"), (110.0, 0.0, "inside"),
     (240.0, 0.2, "too close"), (254.0, 0.27, "kept")],
)  # fmt: skip
def test_a_peak_is_judged_by_the_nearest_operating_speed(speed, actual, verdict):
    peak = Peak(speed, 1.0, 0.99 * speed, 1.01 * speed)
    margin = margin_of(peak, Operating(100.0, 200.0))
    assert margin.actual == pytest.approx(actual)
    assert margin.verdict.startswith(verdict)
    flat = Peak(speed, 1.0, 0.7 * speed, 1.3 * speed)
    assert margin_of(flat, Operating(100.0, 200.0)).verdict == "critically damped"


def test_scale_and_unbalance_are_those_of_the_standard():
    rpm = np.pi / 30
    assert scale_factor(12.7e-6, 12000 * rpm) == pytest.approx(1.0)
    assert scale_factor(12.7e-6, 3000 * rpm) == pytest.approx(2.0)
    assert (scale_factor(1.0, 300.0), scale_factor(1e-9, 300.0)) == (0.5, 6.0)
    assert unbalance_of(100.0, 12700 * rpm) == pytest.approx(2e-4)
    assert moving_mass(stiff(8)) == pytest.approx(MASS, rel=1e-9)


@pytest.fixture(scope="module")
def found():
    return study(small(**APART, speed=700.0), Operating(300.0, 700.0))


@pytest.mark.turns
def test_at_the_ends_of_a_band_tips_use_that_share(found):
    for share in (0.05, 0.75, 1.0):
        bands = found.bands(share)
        assert bands
        for low, high in bands:
            for end in {low, high} - {found.points[0].speed, found.points[-1].speed}:
                assert steady_at(found.scene, end).used == pytest.approx(share)
            assert steady_at(found.scene, (low + high) / 2).used > share
        outside = [
            one.used for one in found.points
            if not any(low <= one.speed <= high for low, high in bands)
        ]  # fmt: skip
        assert max(outside, default=0.0) < share


@pytest.mark.turns
def test_amplitudes_grow_with_the_unbalance_and_factors_do_not(found):
    other = study(apply_settings(found.scene, {"unbalance": 3e-3}), found.operating)
    for place in found.peaks:
        for one, thrice in zip(found.peaks[place], other.peaks[place], strict=True):
            assert thrice.amplitude == pytest.approx(3 * one.amplitude, rel=1e-9)
            assert thrice.amplification == pytest.approx(one.amplification, rel=1e-5)
    assert other.worst().used == pytest.approx(3 * found.worst().used, rel=1e-9)


@pytest.mark.turns
def test_speeds_at_which_free_motion_grows_are_named():
    """T3: a rotor whose damping all turns grows from its critical speed on."""
    scene = stiff(6, speed=OWN, **{"rotor.damping": 0.02, "suspension_damping": -1.0})
    found = study(scene, Operating(0.8 * OWN, 1.2 * OWN))
    ((low, high),) = found.growing()
    assert low == pytest.approx(OWN, rel=2e-3)
    assert high == found.points[-1].speed


def test_what_is_offered_are_the_campaign_s_own_speeds_where_it_has_some():
    bands = [(10.0, 20.0), (30.0, 40.0)]
    speeds = offered(bands, [-12.0, 15.0, 25.0])
    assert speeds[:2] == [-12.0, 15.0]
    assert (speeds[2], speeds[-1], len(speeds)) == (30.0, 40.0, 13)
    assert offered([], [12.0]) == []


def test_the_figure_marks_peaks_with_their_factor_and_where_tips_touch(found):
    size, lag, force = draw_response(found).axes
    told = "".join(text.get_text() for text in size.texts)
    for peak in found.peaks["centre"]:
        assert f"AF {peak.amplification:.3g}" in told
    shown = dict(zip(*size.get_legend_handles_labels()[::-1], strict=True))
    amplitude = shown["amplitude, centre"].get_ydata() / 1e3
    assert amplitude == pytest.approx([one.size("centre") for one in found.points])
    assert "the tips touch" in shown
    assert lag.get_ylim()[1] > 90.0
    assert force.get_xlim()[1] == found.points[-1].speed


@pytest.mark.turns
def test_a_lost_blade_is_the_unbalance_that_is_printed_and_lagged():
    """As `model` prints them at one speed, also beside an unbalance elsewhere."""
    scene = small(lost_blade=2, unbalance_phase=1.0, speed=600.0)
    found = study(scene, Operating(300.0, 600.0))
    facts = facts_of_unbalance(resolve(scene).model, scene)
    assert abs(found.moment) == pytest.approx(facts["unbalance"])
    assert abs(found.moment) != pytest.approx(scene.unbalance)
    size, lag, _ = draw_response(found).axes
    assert f"{1e3 * facts['unbalance']:.4g} kg mm" in size.get_title()
    speeds, degrees = lag.lines[0].get_data()
    at = np.interp(600.0, speeds, np.radians(degrees))
    assert at == pytest.approx(facts["lag"] % (2 * np.pi), rel=1e-3)


CAMPAIGN = """
[scene]
unbalance = 1e-3
[engine]
rotation = "full"
[engine.rotor]
blades = 5
elements = 2
[engine.casing]
harmonics = 4
[solver]
modes = 10
[sweep]
speed = { start = 600, stop = 900, step = 10 }
friction = [0.1, 0.2]
"""


@pytest.mark.turns
def test_the_campaign_that_is_written_has_the_speeds_worth_integrating(
    tmp_path, capsys
):
    path, out = tmp_path / "whole.toml", tmp_path / "part.toml"
    path.write_text(CAMPAIGN)
    words = ["response", str(path), "--write", str(out), "--json"]
    assert main(words) == 0
    told = capsys.readouterr()
    assert "other inputs of the cases, friction" in told.err
    facts = json.loads(told.out)
    assert facts["operating"] == [600.0, 900.0]
    assert facts["range"][1] == pytest.approx(BEYOND * 900.0)
    (low, high) = facts["worth_integrating"]["bands"][0]
    own = [v for v in range(600, 901, 10) if low <= v <= high]
    assert facts["sweep"] == own != []
    assert tomllib.loads(out.read_text())["sweep"]["friction"] == [0.1, 0.2]
    whole, part = Design.of(path), Design.of(out)
    digests = {whole.digest(case) for case in range(len(whole.scenes))}
    assert {part.digest(case) for case in range(len(part.scenes))} < digests
    assert len(part.scenes) == 2 * len(own)


@pytest.mark.parametrize(
    ("words", "told"),
    [(["rotation=none", "unbalance=0"], "engine.rotation must be full"),
     (["centre=clamped", "unbalance=0"], "engine.rotor.centre must be free"),
     (["--operating", "3"], "must be two speeds LOW,HIGH"),
     (["--operating", "4rpm,3rpm"], "must begin with the lower speed"),
     (["--operating", "1,2 m"], "--operating"),
     (["--up-to", "-3"], "--up-to must be a speed > 0"),
     (["--up-to", "20"], "operating speeds must be from"),
     (["--share", "2"], "--share must be > 0 and <= 1"),
     (["speed=0"], "speed must not be 0")],
)  # fmt: skip
def test_what_has_no_response_is_one_line(words, told, capsys):
    given = [f"{n}={v}" for n, v in SMALL.items()]
    given += [word for word in words if "=" in word]
    sets = [part for one in given for part in ("--set", one)]
    options = [word for word in words if "=" not in word]
    assert main(["response", *sets, *options]) == 2
    error = capsys.readouterr().err
    assert told in error
    assert error.count("\n") == 1


@pytest.mark.turns
def test_a_balanced_rotor_gets_the_unbalance_of_the_standard(capsys):
    sets = [f"--set={n}={v}" for n, v in (SMALL | {"unbalance": 0}).items()]
    assert main(["response", *sets, "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    mass = moving_mass(small())
    assert facts["unbalance"] == pytest.approx(unbalance_of(mass, 500.0))
    assert facts["unbalance_of_api617"]
    assert main(["response", *sets]) == 0
    shown = capsys.readouterr().out
    assert "4 * 6350 g mm W/N of API 617" in shown
    assert "…" not in shown  # no head or cell of the table is cut
