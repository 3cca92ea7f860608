"""The table of a casing that is not round: its layouts, its text, its harmonics."""

import math

import numpy as np
import pytest

from hpcwhirl.case.limits import check_wall
from hpcwhirl.case.profile import (
    WITHIN,
    departure,
    is_round,
    missed_share,
    room_of,
    shape_of,
    told_of_profile,
)
from hpcwhirl.errors import InputError
from hpcwhirl.scene import Scene, apply_settings, digest, load_scene, to_toml
from hpcwhirl.scene.kept_tables import ANGLES, HARMONICS, kept_rows, profile_table

CSV = "harmonic, amplitude, phase\n2, 1e-5, 0.5\n3, 2e-6, -1\n"
TEXT = "harmonic,amplitude,phase;2.0,1e-05,0.5;3.0,2e-06,-1.0"


def shaped(table, **settings):
    return apply_settings(Scene(), {"profile": table, **settings})


def seen(table, angles, **settings):
    return departure(shape_of(shaped(table, **settings)), angles)


def test_a_file_is_kept_as_its_text(tmp_path):
    (tmp_path / "oval.csv").write_text(CSV, encoding="utf-8")
    (tmp_path / "case.toml").write_text(
        '[engine.casing]\nprofile = "oval.csv"\n', encoding="utf-8"
    )
    scene = load_scene(tmp_path / "case.toml")
    assert scene.engine.casing.profile == TEXT == profile_table(TEXT)
    assert profile_table(str(tmp_path / "oval.csv")) == TEXT
    (tmp_path / "again.toml").write_text(to_toml(scene), encoding="utf-8")
    (tmp_path / "oval.csv").unlink()
    assert load_scene(tmp_path / "again.toml") == scene
    assert digest(scene) != digest(Scene())


def test_a_round_casing_keeps_the_digest_of_cases_from_before():
    assert digest(shaped("", profile_scale=1.0)) == digest(Scene())
    assert is_round(Scene())
    assert is_round(shaped(TEXT, profile_scale=0.0))


def test_harmonics_and_offset_are_the_shape_they_name():
    angles = np.linspace(0.0, 7.0, 50)
    wanted = 3 * (1e-5 * np.cos(2 * angles - 0.5) + 2e-6 * np.cos(3 * angles + 1.0))
    wanted -= 4e-6 * np.cos(angles - 2.0)  # narrowest where the axis lies
    found = seen(TEXT, angles, profile_scale=3.0, offset=4e-6, offset_angle=2.0)
    assert found == pytest.approx(wanted, abs=1e-18)


@pytest.mark.turns
def test_lines_around_the_casing_have_the_integrals_of_their_harmonics():
    """A worn arc, unevenly spaced and across 0, against quadrature."""
    angles, values = [-0.3, 0.1, 0.5, 2.0, 4.0], [1e-5, 4e-5, 1e-5, 0.0, 2e-6]
    rows = zip(angles, values, strict=True)
    shape = shape_of(shaped(";".join([ANGLES, *(f"{a},{v}" for a, v in rows)])))
    theta = (np.arange(400000) + 0.5) * 2 * math.pi / 400000
    lines = np.interp(theta, angles, values, period=2 * math.pi)
    for h, a, b in zip(*shape[:3], strict=True):
        half = 1.0 if h else 0.5
        assert a == pytest.approx(
            2 * half * (lines * np.cos(h * theta)).mean(), abs=1e-15
        )
        assert b == pytest.approx(
            2 * half * (lines * np.sin(h * theta)).mean(), abs=1e-15
        )
    assert max(shape.orders) == 64
    assert 0.0 < shape.missed < 0.05 * 4e-5


def arc(depth, edge=0.01, wide=0.3):
    """Return the table of an arc of a constant departure, m, with steep edges, rad."""
    corners = (0, 0), (1, 0), (1 + edge, depth), (1 + wide, depth), (1 + wide + edge, 0)
    return ";".join([ANGLES, *(f"{a},{v}" for a, v in corners)])


ALL_AROUND = np.linspace(0.0, 2 * math.pi, 20001)
OUTWARD = {
    "trench": (arc(3e-3), 1.0), "shallow": (arc(1e-4), 1.0),
    "ramp": (arc(1e-3, 0.1, 0.5), 1.0), "worn": (f"{ANGLES};0,0;1,0;1.3,4e-5;2,0", 1.0),
    "turned over": (arc(-3e-4), -1.0), "slit": (arc(2e-5, 0.01, 0.02), 1.0),
}  # fmt: skip


@pytest.mark.turns
@pytest.mark.parametrize("name", OUTWARD)
def test_a_departure_outward_never_narrows_the_gap(name):
    """To 1e-6 of it, with edges as steep as they may be."""
    table, scale = OUTWARD[name]
    scene = shaped(table, profile_scale=scale)
    most = abs(scale) * max(abs(row[1]) for row in kept_rows(table))
    assert departure(shape_of(scene), ALL_AROUND).min() > -1e-6 * most
    assert room_of(scene) > scene.gap - 1e-5 * most


@pytest.mark.parametrize("depth", [3e-3, -3e-4, 5e-5])
def test_a_shape_is_its_table_within_the_angle_that_is_stated(depth):
    """Each value of one is that of the other nearby, to `missed`."""
    table = arc(depth)
    shape = shape_of(shaped(table))
    angles, values = np.array(kept_rows(table)).T
    lines = np.interp(ALL_AROUND, angles, values, period=2 * math.pi)
    found = departure(shape, ALL_AROUND)
    near = round(WITHIN / (ALL_AROUND[1] - ALL_AROUND[0]))
    for one, other in ((lines, found), (found, lines)):
        around = np.concatenate([other[-near - 1 : -1], other, other[1 : near + 1]])
        windows = np.lib.stride_tricks.sliding_window_view(around, 2 * near + 1)
        outside = np.maximum(windows.min(1) - one, one - windows.max(1)).max()
        assert outside < shape.missed + 1e-3 * abs(depth)
    assert 0.0 < shape.missed < 0.012 * abs(depth)


def test_a_profile_with_parts_that_harmonics_lose_is_refused():
    """A ledge of 1 mm that is 0.02 rad wide, of which they keep half the height."""
    scene = shaped(arc(-1e-3, 0.01, 0.02))
    assert missed_share(scene) > 1.0
    with pytest.raises(
        InputError, match="profile must be smooth enough for 64"
    ) as told:
        check_wall(scene)
    assert "\n" not in str(told.value)


@pytest.mark.parametrize(
    ("table", "scale"),
    [(arc(1e300), 1.0), (arc(1e-5), 1e300), (f"{ANGLES};0,1;1,-1e308;2,1e308", -1.0)],
)
def test_a_huge_profile_is_refused_without_a_warning(table, scale):
    for gap in (0.0, 1e-300, 1e-4):
        with pytest.raises(InputError, match="must be"):
            check_wall(shaped(table, profile_scale=scale, gap=gap))


def test_what_a_profile_misses_is_told():
    assert "deviate from its table by up to 0.0138 mm" in told_of_profile(
        shaped(arc(3e-3))
    )
    assert told_of_profile(shaped(arc(1e-4))) == told_of_profile(Scene()) == ""


def test_a_shape_between_the_blades_may_not_stand_in_their_way_at_the_start():
    """A ledge half a pitch from the blades, as one at a blade."""
    for place in (0.0, math.pi / 22):
        oval = f"{HARMONICS};22,1.5e-4,{22 * place + math.pi}"
        with pytest.raises(InputError, match="profile_rise must be"):
            check_wall(shaped(oval))
        check_wall(shaped(oval, profile_rise=0.01))


def test_two_bumps_are_those_of_their_formula():
    """g0 (1 - 2 exp(-((theta mod pi)/pi - 1/2)^2 / 0.15^2)), as a laboratory has it."""
    g0, angles = 3.56e-4, np.arange(1440) * math.pi / 720

    def bumps(theta):
        return -2 * g0 * np.exp(-(((theta % math.pi) / math.pi - 0.5) ** 2) / 0.15**2)

    rows = zip(angles.tolist(), bumps(angles).tolist(), strict=True)
    table = ";".join([ANGLES, *(f"{a!r},{v!r}" for a, v in rows)])
    between = angles + 0.3 * math.pi / 720
    assert np.abs(seen(table, between) - bumps(between)).max() < 2e-4 * g0
    assert all(h % 2 == 0 for h in shape_of(shaped(table)).orders)


@pytest.mark.parametrize(
    ("table", "told"),
    [
        ("none.csv", "none.csv"),
        ("lobes,size;1,2", "it must have the columns"),
        (f"{HARMONICS};1,2", "every row must have 3 numbers"),
        (f"{HARMONICS};1,a,2", "every row must have 3 numbers"),
        (f"{HARMONICS};1.5,1e-5,0", "whole numbers from 0 to 200"),
        (f"{HARMONICS};2,1e-5,0;2,1e-6,0", "each harmonic once"),
        (f"{HARMONICS};2,inf,0", "of finite numbers"),
        (f"{ANGLES};0,1;1,1", "3 at least"),
        (f"{ANGLES};0,1;2,1;1,1", "must ascend"),
        (f"{ANGLES};0,0;3,1e-6;6.283186,0", "within one turn"),
    ],
)
def test_a_wrong_table_is_told_in_one_line(table, told):
    with pytest.raises(InputError, match=told) as failed:
        shaped(table)
    assert "\n" not in str(failed.value)
    assert "profile" in str(failed.value)


def test_a_shape_beyond_all_numbers_has_a_depth_without_a_warning():
    assert shape_of(shaped("harmonic,amplitude,phase;2,1e308,0")).depth == math.inf
