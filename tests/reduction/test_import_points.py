"""Finite elements with several contact points a tip: a wheel and its sector agree."""

import io
from contextlib import redirect_stdout

import numpy as np
import pytest
import tomli_w
from scipy import sparse
from scipy.io import mmwrite
from test_import_model import MODES, ROTOR, SIZE, TIP, N, sector
from test_import_model import wheel as plain_wheel

from hpcwhirl.cli import main
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.bodies import contact_rows
from hpcwhirl.reduction.imported import rotor_from
from hpcwhirl.store.models.wheel_file import read_wheel
from hpcwhirl.structure import bladed_disk
from hpcwhirl.structure.elements import turn

INNER = TIP - 3  # the node of a blade before its tip
PLACES = {"station": [-0.02, 0.03], "turn": [0.0, 0.0], "gap": [1e-5, 0.0]}


def by_axis(blades, names):
    """Return the DoF of both points, blade by blade."""
    pairs = SIZE * np.arange(blades)[:, None, None] + np.array([INNER, TIP])
    return dict(zip(names, pairs.reshape(-1, 2).T.tolist(), strict=True))


def wheel(place, turned=(0.0, 0.0)):
    """Write a wheel whose points and centre are in x, y; return its TOML."""
    disk = bladed_disk(ROTOR)
    lift, pairs = np.eye(len(disk.mass)), np.array([INNER, TIP])
    for j in range(N):
        for pair in SIZE * j + pairs:
            lift[np.ix_(pair, pair)] = turn(2 * np.pi * j / N)
    for file, matrix in (("m.mtx", disk.mass), ("k.mtx", disk.stiffness)):
        whole = sparse.csr_array(lift.T @ matrix @ lift)
        mmwrite(place / file, (whole + whole.T) / 2, symmetry="symmetric")
    table = {"mass": "m.mtx", "stiffness": "k.mtx", "blades": N, "modes": MODES}
    tips = by_axis(N, "xy") | PLACES | {"turn": list(turned)}
    centre = dict(zip("xy", np.array(disk.centre).tolist(), strict=True))
    text = tomli_w.dumps({"wheel": table, "tips": tips, "centre": centre})
    (place / "turned.toml").write_text(text)
    return place / "turned.toml"


def reduced(toml):
    out = toml.with_suffix(".h5")
    assert main(["import-model", str(toml), "--out", str(out)]) == 0
    return rotor_from(str(out), N, 0.01)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Return (rotor of the wheel, what is told of it)."""
    with redirect_stdout(io.StringIO()) as told:
        rotor = reduced(wheel(tmp_path_factory.mktemp("wheel")))
    return rotor, told.getvalue()


def test_a_wheel_and_its_sector_have_the_same_points(whole, tmp_path):
    one = sector(tmp_path, tips=by_axis(1, ("radial", "tangential")) | PLACES)
    rotors = whole[0], reduced(one)
    for rotor in rotors:
        assert rotor.points.count == 2
        assert rotor.points.station == pytest.approx(PLACES["station"])
        assert rotor.points.gap == pytest.approx(PLACES["gap"])
        assert rotor.kept == MODES + 2 * N
    assert rotors[0].omega == pytest.approx(rotors[1].omega, rel=1e-7)
    steady = [
        rows @ (rows / r.omega**2).T for r in rotors for rows in contact_rows(r, N)
    ]
    for a, b in zip(steady[:2], steady[2:], strict=True):
        assert np.abs(a - b).max() < 1e-7 * np.abs(a).max()


def test_the_summary_counts_tips_points_and_modes(whole):
    assert f"{N} tips of 2 contact points, {MODES} fixed-interface modes" in whole[1]


def test_the_axes_of_a_point_are_those_at_its_angle(whole, tmp_path):
    turned = reduced(wheel(tmp_path, turned=(0.0, 0.3)))
    plain, other = (contact_rows(rotor, N) for rotor in (whole[0], turned))
    c, s = np.cos(0.3), np.sin(0.3)
    expected = c * plain[0] + s * plain[1]
    norms = [np.abs(rows[1::2] @ rows[1::2].T) for rows in (expected, other[0])]
    assert norms[0] == pytest.approx(norms[1], rel=1e-6, abs=1e-9)


def test_points_do_not_change_the_wheel(whole, tmp_path):
    plain, more = reduced(plain_wheel(tmp_path)), whole[0]
    assert more.omega[:12] == pytest.approx(plain.omega[:12], rel=1e-3)


WRONG = [
    ({"station": [0.03, -0.02]}, "station must ascend"),
    ({"gap": [0.0]}, "gap must have 2 numbers, got 1"),
    ({"station": []}, "station must have 1 numbers, got 0"),
    ({"turn": ["x", 0.0]}, "turn must be a list of numbers"),
    ({"station": [-0.1, 0.0, 0.1], "turn": [0.0] * 3, "gap": [0.0] * 3},
     f"name {3 * N} degrees of freedom, got {2 * N}"),
]  # fmt: skip


@pytest.mark.parametrize(("spoil", "told"), WRONG)
def test_wrong_points_are_told_in_one_line(tmp_path, spoil, told):
    toml = plain_wheel(
        tmp_path, tips=by_axis(N, "xy") | {"angle": 0.0} | PLACES | spoil
    )
    with pytest.raises(InputError, match=told) as caught:
        read_wheel(toml)
    assert len(str(caught.value).splitlines()) == 1
