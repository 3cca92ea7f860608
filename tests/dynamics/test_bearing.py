"""Bearings from a table over speed: what they read, their splits, their rotor."""

import numpy as np
import pytest
from jeffcott import MASS, OWN, stiff

from hpcwhirl.case.resolve import resolve
from hpcwhirl.cli import main
from hpcwhirl.dynamics.march import March
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.supports import bearing_of, planar
from hpcwhirl.reduction.waves import unbalance_speeds, wave_lines
from hpcwhirl.scene import Scene, apply_settings, digest, load_scene, to_toml
from hpcwhirl.scene.bearing_tables import HEAD, bearing_table
from hpcwhirl.scene.kept_tables import kept_rows

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


MISTUNED = [0.01, -0.02, 0.0, 0.015, -0.005]


@pytest.mark.parametrize("speed", [100.0, 800.0])
@pytest.mark.parametrize("mistuning", [[], MISTUNED])
def test_the_springs_that_a_table_replaces_have_no_effect(mistuning, speed):
    """Growth, frequency and work are the same on any `centre_stiffness`."""
    own = table((0, 3e7, 0, 0, 3e7, 2e3, 0, 0, 2e3))
    found = []
    for base in (3.4e6, 3.4e7, 3.4e8):
        more = {"bearing": own, "centre_stiffness": base, "mistuning": mistuning}
        rotor = resolve(apply_settings(Scene(), GIVEN | more)).model.rotor
        lines = wave_lines(rotor, 5, speed)
        found.append(np.array(sorted((x.growth, abs(x.rotating)) for x in lines)))
    assert found[0] == pytest.approx(found[1], rel=1e-6)
    assert found[2] == pytest.approx(found[1], rel=1e-6)


def test_a_rotor_on_a_table_damps_no_translation_of_its_own():
    """Of a stiff rotor the bearing's damper alone decides: m s^2 + c s + k = 0."""
    k, c = STIFFNESS, 500.0
    own = table((0, k, 0, 0, k, c, 0, 0, c))
    ratios = {"suspension_damping": -1.0, "rotor.damping": 0.05}
    scene = stiff(8, bearing=own, speed=300.0, **ratios)
    lines = wave_lines(resolve(scene).model.rotor, 8, 300.0)
    growth = [x.growth for x in lines if x.family == "suspension"]
    assert growth == pytest.approx([-c / (2 * MASS)] * 2, rel=2e-3)


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
        ("a.csv", "kxx,cxx\n1,2\n3,4\n", "column speed, or one row, got 'kxx, cxx'"),
        ("a.csv", "frequency,cxx\n1,2\n", "columns kxx"),
        ("a.csv", "frequency,kxx,cxx\n2,1,1\n1,1,1\n", "ascend"),
        ("a.csv", "frequency,kxx,cxx\n\n1,x,1\n", "line 3, column kxx: .* number"),
        ("a.csv", "frequency,kxx,cxx\n1,nan,1\n", "line 2, column kxx: .* finite"),
        ("a.csv", "frequency,kxx,cxx\n1,2\n", "line 2: it must have 3 values"),
        ("a.csv", "frequency,kxx,cxx\n1,2,3,4\n", "line 2: .* 3 .*, got 4"),
        ("a.csv", "speed [m],kxx,cxx\n1,2,3\n", "column speed: its unit .* rad/s"),
        ("a.csv", "speed,kxx,cxx,kxx\n1,2,3,4\n", "'kxx' twice"),
        ("a.csv", "frequency,kxx,cxx\n", "one row at least"),
        ("a.csv", "speed,kxx,cxx,kxy_\n1,2,3,0\n2,2,3,4\n", "'kxy_'; did .* 'kxy'"),
        ("a.csv", "speed,kxx,cxx,mxx\n1,2,3,4\n", "'mxx': added mass is only model"),
        ("a.csv", "speed,kxx,cxx,leakage\n1,2,3,4\n", "'leakage'; known: speed"),
        ("a.csv", "speed,frequency,kxx,cxx\n1,1,2,3\n", "frequency of the whirl"),
        ("a.toml", "[MagneticBearing.a]\nkxx = [1]\ncxx = [1]\n", "of the whirl"),
        ("a.toml", "speed = [1, 2]\nkxx = [[1, 2], [3]]\ncxx = 1\n", "of the whirl"),
        ("a.toml", "[a]\nkxx = 1\n[b]\nkxx = 1\n", "got 2: name one, as file.toml#"),
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


@pytest.mark.parametrize(
    "text",
    [
        "speed,kxx,cxx\n100,2e7,10\n200,3e7,20\n",
        "# a comment\n\n frequency ; KXX;cxx;mxx\n100;2e7;10,0;0\n200;3e7;20;0\n",
        "w\tkxx [N/mm]\tcxx\tkzz\n100\t2e4\t10\t5\n200\t3e4\t20\t5\n",
        "speed,kxx,cxx\nrad/s,N/m,N s/m\n100,2e7,10\n200,3e7,20\n,,\n",
        "cxx,kxx,speed (rad/s)\n10,2e7,100\n20,3e7,200\n",
        "% speed kxx cxx tag\n100 2e7 10 a\n200 3e7 20 a\n".replace(" a", " 1"),
        '"speed","kxx","cxx"\n"100","2e7","10"\n"200","3e7","20"\n',
    ],
)
def test_one_table_in_several_spellings_is_one_text(text, tmp_path):
    plain = table(
        (100, 2e7, 0, 0, 2e7, 10, 0, 0, 10), (200, 3e7, 0, 0, 3e7, 20, 0, 0, 20)
    )
    assert bearing_table(str(written(tmp_path, "b.csv", text))) == plain


def test_revolutions_are_a_unit_of_a_table_s_speed(tmp_path):
    text = "speed [rpm];kxx;cxx\n3000;1;1\n6000;1;1\n"
    rows = kept_rows(bearing_table(str(written(tmp_path, "b.csv", text))))
    assert [row[0] for row in rows] == pytest.approx([100 * np.pi, 200 * np.pi])


@pytest.mark.parametrize(
    ("name", "text"),
    [("a.csv", "kxx,cxx\n2e7,10\n"), ("a.csv", "speed,kxx,cxx\n50,2e7,10\n"),
     ("a.toml", "[BearingElement6DoF_1]\nkxx = 2e7\ncxx = 10\nkzz = 3.0\nczz = 1\n")],
)  # fmt: skip
def test_a_table_of_one_row_holds_at_all_speeds(name, text, tmp_path):
    own = bearing_of(kept_rows(bearing_table(str(written(tmp_path, name, text)))), 0.0)
    assert own.range == (0.0, np.inf)
    for speed in (0.0, 1.0, -3000.0):
        assert own.at(speed).stiffness == 2e7
        assert own.at(speed).damping == 10.0


def test_an_element_of_several_is_chosen_by_its_name_or_tag(tmp_path):
    path = written(tmp_path, "r.toml", ROSS + ROSS.replace("0]", "1]").replace(
        "left", "right").replace("[1e7, 2e7, 4e7]", "[3e7, 3e7, 3e7]"))  # fmt: skip
    by_tag, by_name = bearing_table(f"{path}#right"), bearing_table(f"{path}#1")
    assert by_tag == by_name != bearing_table(f"{path}#left")
    assert kept_rows(by_tag)[0][1] == 3e7
    with pytest.raises(ValueError, match="no element 'rihgt'; did you mean 'right'"):
        bearing_table(f"{path}#rihgt")


def test_each_coefficient_stays_between_its_rows():
    """Columns that fall and rise apart from one another do not mix."""
    rows = [
        (100, 1e6, 0, 0, 4e7, 1e3, 0, 0, 4e4),
        (200, 1e6, 0, 0, 9e6, 1e3, 0, 0, 9e3),
        (300, 9e6, 0, 0, 8e6, 9e3, 0, 0, 8e3),
        (400, 9e6, 0, 0, 7e6, 9e3, 0, 0, 7e3),
    ]
    own = bearing_of(rows, 3e7)
    for speed in (130.0, 156.0):
        support = own.at(speed)
        along = support.stiffness + 3e7 + support.stiffness_apart
        assert along == pytest.approx(1e6, rel=1e-9)
        assert support.damping + support.damping_apart == pytest.approx(1e3, rel=1e-9)


def test_a_table_with_a_direction_without_stiffness_is_refused_by_its_name():
    own = table((0, -1e6, 0, 0, 4e7, 1, 0, 0, 1))
    scene = apply_settings(Scene(), GIVEN | {"bearing": own})
    with pytest.raises(InputError, match=r"bearing must have in all .* got -1e"):
        March(resolve(scene))


def test_a_speed_beyond_the_table_is_refused():
    own = table((100, 1e7, 0, 0, 1e7, 1, 0, 0, 1), (200, 2e7, 0, 0, 2e7, 1, 0, 0, 1))
    through = {"speed": 150.0, "speed_table": "time,speed;0,150;1e-3,-150"}
    given = {"speed": 250.0}, {"speed": -50.0}, through | {"slip": "set-valued"}
    for more in given:
        scene = apply_settings(Scene(), GIVEN | {"bearing": own} | more)
        with pytest.raises(InputError, match="speed must be 100 to 200 rad/s"):
            March(resolve(scene))


def test_a_rotor_on_a_table_is_not_written_as_one_on_springs(tmp_path, capsys):
    out, own = tmp_path / "e.h5", table((0, 3e7, 0, 0, 3e7, 2e3, 0, 0, 2e3))
    given = {"rotation": "full", "blades": 5, "modes": 10, "bearing": own}
    words = [f"--set={name}={value}" for name, value in given.items()]
    assert main(["export-model", str(out), *words]) == 2
    assert "cannot write a bearing's table" in capsys.readouterr().err
    assert not out.exists()
