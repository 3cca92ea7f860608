"""Bearings from a table over speed: what they read, their splits, their rotor."""

import numpy as np
import pytest
from jeffcott import MASS, OWN, stiff

from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.march import March
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.supports import bearing_of, planar
from hpcwhirl.reduction.waves import unbalance_speeds, wave_lines
from hpcwhirl.scene import Scene, apply_settings, digest, load_scene, to_toml
from hpcwhirl.scene.kept_tables import HEAD, bearing_table, kept_rows

STIFFNESS = MASS * OWN**2
CSV = """frequency, kxx, kyy, kxy, kyx, cxx
0, 1e7, 2e7, 1e5, -2e5, 1000
200, 2e7, 3e7, 2e5, -3e5, 2000
600, 4e7, 4e7, 0, 0, 3000
"""
ROSS = """[BearingElement.0]
n = 0
kxx = [1e7, 2e7, 4e7]
cxx = [1000.0, 2000.0, 3000.0]
kyy = [2e7, 3e7, 4e7]
kxy = [1e5, 2e5, 0.0]
kyx = [-2e5, -3e5, 0.0]
cyy = [1000.0, 2000.0, 3000.0]
cxy = [0, 0, 0]
cyx = [0, 0, 0]
frequency = [0.0, 200.0, 600.0]
tag = "left"
"""


def written(tmp_path, name, text):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return path


def table(*rows):
    return ";".join([HEAD, *(",".join(map(repr, map(float, row))) for row in rows)])


def test_both_layouts_give_one_table(tmp_path):
    csv, toml = (
        bearing_table(str(written(tmp_path, *one)))
        for one in (("a.csv", CSV), ("a.toml", ROSS))
    )
    assert csv == toml == bearing_table(csv)
    assert kept_rows(csv)[1] == (200, 2e7, 2e5, -3e5, 3e7, 2000, 0, 0, 2000)


@pytest.mark.parametrize("speed", [0.0, 200.0, 350.0, 600.0])
def test_a_support_is_the_matrices_of_the_table(speed):
    """F = -K x - C x' at the table's speeds; between them monotone."""
    rows = kept_rows(table(
        (0, 1e7, 1e5, -2e5, 2e7, 900, 5, 7, 800),
        (200, 2e7, 2e5, -3e5, 3e7, 9, 8, 7, 6),
        (600, 4e7, 3e5, 1e5, 3.5e7, 1, 2, 3, 4),
    ))  # fmt: skip
    own = bearing_of(rows, 5e6).at(speed)
    x, mirror = np.array([0.3, -0.7]), np.diag([1.0, -1.0])
    k = planar(own.stiffness + 5e6) + planar(own.stiffness_apart) @ mirror
    c = planar(own.damping) + planar(own.damping_apart) @ mirror
    at = {row[0]: row for row in rows}
    if speed in at:
        assert k @ x == pytest.approx(np.reshape(at[speed][1:5], (2, 2)) @ x)
        assert c @ x == pytest.approx(np.reshape(at[speed][5:], (2, 2)) @ x)
    else:
        assert 2e7 < k[0, 0] < 4e7
        assert 3e7 < k[1, 1] < 3.5e7


def test_a_rotor_that_turns_the_other_way_has_the_mirror_image():
    """Y -> -Y: direct coefficients stay, cross-coupled ones change their sign."""
    own = bearing_of([(0, 4, 3, 2, 1, 9, 8, 7, 6), (9, 5, 3, 1, 2, 9, 5, 7, 6)], 0.0)
    there, back, mirror = own.at(4.0), own.at(-4.0), np.diag([1.0, -1.0])
    for name in ("stiffness", "damping"):
        one, two = (
            planar(getattr(s, name)) + planar(getattr(s, f"{name}_apart")) @ mirror
            for s in (there, back)
        )
        assert mirror @ one @ mirror == pytest.approx(two)
        assert abs(one[0, 1]) > 0.0


GIVEN = {
    "rotation": "full", "blades": 5, "rotor.elements": 2, "modes": 10, "harmonics": 4,
    "time_step": 2e-6, "scheme": "general", "speed": 400.0, "duration": 8e-3,
    "suspension_damping": -1.0,
}  # fmt: skip


@pytest.mark.parametrize("base", [3.4e7, 1e7])
def test_a_table_of_springs_is_the_springs(base):
    """The motion is that of centre_stiffness, stiffness_difference, cross_coupling.

    Modes at rest, which share out the rotor's own damping, are those on `base`.
    """
    k, k_d, k_q = 3.4e7, 5e6, 1e6
    springs = {
        "centre_stiffness": k,
        "stiffness_difference": k_d,
        "cross_coupling": k_q,
    }
    own = table((0, k + k_d, k_q, -k_q, k - k_d, 0, 0, 0, 0))
    listed = {"bearing": own, "centre_stiffness": base}
    none = {"engine.rotor.damping": 0.0, "suspension_damping": 0.0}
    one, two = (
        March(resolve(apply_settings(Scene(), GIVEN | more | none)))
        for more in (springs, listed)
    )
    lines = [
        sorted(
            x.static
            for x in wave_lines(m.model.rotor, 5, 400.0)
            if x.nodal_diameter == 1
        )
        for m in (one, two)
    ]
    assert lines[0] == pytest.approx(lines[1], rel=1e-6)
    histories = one.run(), two.run()
    assert histories[0].contacts == histories[1].contacts > 3
    assert histories[0].contact_impulse == pytest.approx(
        histories[1].contact_impulse, rel=1e-6
    )
    residual = histories[1].ledger["residual"]
    assert abs(residual) < 1e-9 * histories[1].ledger["pulse"]


def test_critical_speeds_are_where_the_table_s_frequency_is_the_speed():
    """k(Omega) = m Omega^2, k linear in the speed: a quadratic equation."""
    k_0, slope = 0.5 * STIFFNESS, 0.8 * STIFFNESS / OWN
    most = k_0 + 2 * slope * OWN
    own = table((0, k_0, 0, 0, k_0, 0, 0, 0, 0),
                (2 * OWN, most, 0, 0, most, 0, 0, 0, 0))  # fmt: skip
    scene = stiff(8, bearing=own, speed=300.0, suspension_damping=0.0)
    expected = max(np.roots([MASS, -slope, -k_0]))
    found = unbalance_speeds(resolve(scene).model.rotor)
    assert found == pytest.approx([expected], rel=2e-3)
    lines = wave_lines(resolve(scene).model.rotor, 8, 300.0)
    static = [abs(x.static) for x in lines if x.family == "suspension"]
    unit = np.sqrt((k_0 + 300.0 * slope) / MASS)
    assert static == pytest.approx([unit, unit], rel=2e-3)


def test_a_scene_keeps_the_table_and_not_the_file(tmp_path):
    path = written(tmp_path, "b.csv", CSV)
    scene = apply_settings(Scene(), {"rotation": "full", "bearing": str(path)})
    toml = '[engine]\nrotation = "full"\n[engine.rotor]\nbearing = "b.csv"\n'
    assert load_scene(written(tmp_path, "s.toml", toml)) == scene
    path.unlink()
    again = load_scene(written(tmp_path, "t.toml", to_toml(scene)))
    assert again == scene
    assert digest(again) == digest(scene) != digest(Scene())


@pytest.mark.parametrize(
    ("name", "text", "told"),
    [
        ("a.csv", "kxx,cxx\n1,2\n", "columns frequency"),
        ("a.csv", "frequency,cxx\n1,2\n", "columns kxx"),
        ("a.csv", "frequency;kxx;cxx\n1;2;3\n", "commas, got 'frequency;kxx;cxx'"),
        ("a.csv", "frequency,kxx,cxx\n2,1,1\n1,1,1\n", "ascend"),
        ("a.csv", "frequency,kxx,cxx\n1,x,1\n", "must be numbers"),
        ("a.csv", "frequency,kxx,cxx\n1,nan,1\n", "finite"),
        ("a.csv", "frequency,kxx,cxx\n1,2\n", "must be numbers"),
        ("a.csv", "frequency,kxx,cxx\n1,2,3,4\n", "as many values"),
        ("a.csv", "frequency,kxx,cxx\n", "one row at least"),
        ("a.toml", "a = 1\n", "one table with kxx, got 0"),
        ("a.toml", "a = \n", "no TOML"),
        ("gone.csv", None, "cannot read"),
    ],
)  # fmt: skip
def test_what_is_no_table_is_refused_in_one_line(tmp_path, name, text, told):
    path = tmp_path / name if text is None else written(tmp_path, name, text)
    with pytest.raises(InputError, match=told) as failed:
        apply_settings(Scene(), {"rotation": "full", "bearing": str(path)})
    assert "\n" not in str(failed.value)
    assert "bearing" in str(failed.value)


def test_a_speed_beyond_the_table_is_refused():
    own = table((100, 1e7, 0, 0, 1e7, 1, 0, 0, 1), (200, 2e7, 0, 0, 2e7, 1, 0, 0, 1))
    for speed, told in ((250.0, "100 to 200 rad/s"), (-50.0, "100 to 200 rad/s")):
        scene = apply_settings(Scene(), GIVEN | {"bearing": own, "speed": speed})
        with pytest.raises(InputError, match=f"speed must be {told}"):
            March(resolve(scene))
