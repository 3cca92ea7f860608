"""Eq. 13 of every family of the rotor that moves its centre, in words and pictures."""

import numpy as np
import pytest
from launch import words_of
from synthetic import grid_of, synthetic

from hpcwhirl.case.resolve import resolve
from hpcwhirl.cli import main
from hpcwhirl.reduction.families import Line, modal_table, moving_families
from hpcwhirl.report.figures import frequencies
from hpcwhirl.report.map import maps
from hpcwhirl.report.map.critical import speeds_of
from hpcwhirl.report.map.data import Wish
from hpcwhirl.scene import Scene, apply_settings

SOFT = {"centre_stiffness": 2e6}  # the suspension at 20 Hz, 1F at 40 to 51
ENGINES = [
    SOFT,
    SOFT | {"blades": 7, "support_frequency": 60.0},
    {"blades": 40, "root_thickness": 0.085, "taper": 0.7, "thickness": 0.02},
    {"centre_stiffness": 1e9},
]


def eq13(scene):
    """Return {family: speed, rad/s} of n = 1."""
    return {r["family"]: r["speed"] for r in speeds_of(scene) if r["order"] == 1}


def line_of(found, body, family, k):
    """Return omega, rad/s, and the centre's share, as printed."""
    return next(
        (2 * np.pi * m["frequency_hz"], m["centre_share"]) for m in found["modes"]
        if (m["body"], m["family"], m["nodal_diameter"]) == (body, family, k)
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("settings", ENGINES)
def test_every_critical_speed_is_that_of_its_printed_frequencies(settings, facts):
    found = facts("model", *words_of(settings), "--json", "--orders", "4")
    rows = found["critical_speeds"]
    for row in rows:
        k, n = row["nodal_diameter"], row["order"]
        own, _ = line_of(found, "rotor", row["family"], k)
        other, _ = line_of(found, "casing", "1F", k)
        assert row["speed"] == pytest.approx((own + n * other) / k, rel=1e-12)
    orders = {(r["family"], r["nodal_diameter"], r["order"]) for r in rows}
    assert len(orders) == len(rows)
    assert {(k, n) for f, k, n in orders if f == "suspension"} == {(1, 1)}
    assert {n for f, k, n in orders if (f, k) == ("1F", 1)} == {1, 2, 3, 4}
    assert [(r["nodal_diameter"], r["order"]) for r in rows] == sorted(
        (r["nodal_diameter"], r["order"]) for r in rows
    )


def test_a_suspension_below_1f_is_the_lowest_critical_speed_of_one_lobe(facts):
    found = facts("model", *words_of(SOFT), "--json")
    (own, share), (blades, _) = (
        line_of(found, "rotor", name, 1) for name in ("suspension", "1F")
    )
    assert own < blades
    assert share > 0.8
    lowest = min(
        (r for r in found["critical_speeds"] if r["nodal_diameter"] == 1),
        key=lambda row: row["speed"],
    )
    assert lowest["family"] == "suspension"
    assert lowest["speed"] == pytest.approx(own + line_of(found, "casing", "1F", 1)[0])


@pytest.mark.parametrize("stiffness", np.geomspace(2e5, 2e9, 5).tolist())
def test_no_stiffness_of_the_shaft_hides_a_mode_that_moves_the_centre(stiffness):
    scene = apply_settings(Scene(), {"centre_stiffness": stiffness})
    table = modal_table(resolve(scene).model)
    named = {row["family"] for row in speeds_of(scene)}
    ones = [m for m in table if (m.body, m.nodal_diameter) == ("rotor", 1)]
    assert {"1F"} < named
    assert sum(m.centre_share for m in ones if m.family in named) > 0.7
    assert all(m.centre_share < 0.1 for m in ones if m.family not in named)


def test_where_no_mode_has_half_of_the_shaft_both_halves_are_told():
    table = [Line("rotor", f"{n}F", 1, 40.0 * n, s) for n, s in ((1, 0.48), (2, 0.49))]
    table += [Line("rotor", "3F", 1, 900.0, 0.03), Line("rotor", "2F", 2, 90.0, 0.0)]
    assert moving_families(table).keys() == {"1F", "2F"}
    assert moving_families(table)["2F"].keys() == {1}
    assert moving_families([Line("rotor", "unknown", 1, 40.0, None)]) == {}


def test_a_clamped_centre_has_the_families_of_the_blades_alone():
    scene = apply_settings(Scene(), {"centre": "clamped"})
    assert {row["family"] for row in speeds_of(scene)} == {"1F"}


def test_the_table_names_the_family(capsys):
    assert main(["model", *words_of(SOFT), "--orders", "1"]) == 0
    table = capsys.readouterr().out.split("critical speed")[1]
    rows = [line.split("│")[1:-1] for line in table.splitlines() if "│" in line]
    ones = {r[1].strip(): float(r[3]) for r in rows if r[0].strip() == "1"}
    assert ones == pytest.approx(eq13(apply_settings(Scene(), SOFT)), abs=0.05)
    assert ones.keys() == {"1F", "suspension"}


@pytest.mark.turns
@pytest.mark.parametrize("upright", [True, False])
def test_the_map_marks_the_suspension_by_its_own_name(upright, tmp_path):
    speeds = np.linspace(100, 500, 9).tolist()
    folder = synthetic(
        tmp_path / "out",
        grid_of(speed=speeds, nodal_diameter=[1, 2, 3], centre_stiffness=[2e6]),
    )
    axes_of = ("speed", "nodal_diameter") if upright else ("nodal_diameter", "speed")
    wish = Wish(x=axes_of[0], y=axes_of[1], critical=True)
    axes = maps.drawing_of(folder / "results.h5", wish).figure.axes[0]
    want = eq13(apply_settings(Scene(), SOFT))
    own = [ln for ln in axes.lines if ln.get_gid() == "n1 suspension"]
    along, across = (
        ("get_xdata", "get_ydata") if upright else ("get_ydata", "get_xdata")
    )
    assert len(own) == 1  # k = 1 alone has one
    assert getattr(own[0], along)()[0] == pytest.approx(want["suspension"])
    assert max(getattr(own[0], across)()) == 1.5
    told = [t.get_text().replace("\n", " ") for t in axes.texts]
    assert told.count("Eq. 13, suspension") == told.count("Eq. 13") == 1


def test_the_campbell_diagram_marks_both_where_both_are_in_view():
    scene = apply_settings(Scene(), SOFT)
    axes = frequencies.draw_campbell(scene, np.array([100.0, 500.0])).axes[0]
    told = {t.get_text() for t in axes.texts}
    speeds = eq13(scene)
    assert f"Eq. 13: {speeds['1F']:.0f} rad/s" in told
    assert f"Eq. 13, suspension: {speeds['suspension']:.0f} rad/s" in told
