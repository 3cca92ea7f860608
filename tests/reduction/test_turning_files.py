"""Engines from file with the terms of rotation."""

import json
import shutil

import numpy as np
import pytest
import rotor_files
from scipy.linalg import eigh

from hpcwhirl import simulate
from hpcwhirl.case.resolve import resolve
from hpcwhirl.cli import main
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.imported import rotor_from
from hpcwhirl.reduction.model import highest
from hpcwhirl.reduction.waves import (
    largest_growth,
    stiff_up_to,
    tip_growth,
    turning_matrices,
    unbalance_speeds,
    wave_lines,
)
from hpcwhirl.scene import Scene, apply_settings

N = 5
SMALL = {
    "rotation": "full", "blades": N, "engine.rotor.elements": 3, "modes": 16,
    "harmonics": 4, "time_step": 2e-6, "interval": 1e-4, "duration": 0.02,
}  # fmt: skip
PARTS = "stress_stiffness", "softening"
DAMPING = "damping", "damping_ratio", "centre_damping"
MODAL = (
    "shapes", "omega", "modal_tip_radial", "modal_tip_tangential", "modal_centre",
)  # fmt: skip
SPEEDS = 300.0, 700.0


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    path = tmp_path_factory.mktemp("turning") / "rotor.h5"
    return rotor_files.exported(path, SMALL)


@pytest.fixture
def engine(exported, tmp_path):
    """Return a function that writes an engine with changed arrays; None takes one."""

    def changed(**changes):
        path = shutil.copy(exported, tmp_path / "engine.h5")
        return rotor_files.written(path, changes)

    return changed


@pytest.fixture(scope="module")
def arrays(exported):
    return rotor_files.arrays_in(exported)


def case(file="", **settings):
    return resolve(
        apply_settings(Scene(), SMALL | {"engine.file": str(file)} | settings)
    )


def rotor(file="", **settings):
    return case(file, **settings).model.rotor


def at_speeds(arrays, second):
    """Return the changes that give an engine K at two speeds, with K_2 = second."""
    first = arrays["stress_stiffness"] - arrays["softening"]
    a, b = np.square(SPEEDS)
    return {
        "speeds": SPEEDS,
        "stiffness_a": arrays["stiffness"] + a * first + a**2 * second,
        "stiffness_b": arrays["stiffness"] + b * first + b**2 * second,
        **dict.fromkeys(PARTS),
    }


def stiffer(arrays):
    """Return a K_2 that all sectors share: part of K_g, 10 % of it at 500 rad/s."""
    return arrays["stress_stiffness"] * 0.1 / 500.0**2


def numbers(model, speed):
    lines = wave_lines(model, N, speed)
    return np.array([(line.rotating, line.growth) for line in lines])


def test_a_rotor_read_back_turns_as_it_did(exported):
    own, found = rotor(), rotor(exported)
    assert found.cyclic
    for speed in (-410.0, 0.0, 270.0):
        one, other = (wave_lines(m, N, speed) for m in (own, found))
        names = [[(x.nodal_diameter, x.family) for x in side] for side in (one, other)]
        assert names[0] == names[1]
        size = max(abs(line.rotating) for line in one)
        assert numbers(found, speed) == pytest.approx(
            numbers(own, speed), abs=1e-12 * size
        )
    assert unbalance_speeds(found) == pytest.approx(unbalance_speeds(own), rel=1e-11)
    grown = [tip_growth(m, N, 400.0) for m in (own, found)]
    assert grown[1] == pytest.approx(grown[0], rel=1e-11)


@pytest.mark.parametrize("scheme", ["modal", "exact", "general"])
def test_a_rotor_read_back_hits_the_casing_as_it_did(exported, scheme):
    given = {"scheme": scheme, "speed": 420.0, "unbalance": 1e-3}
    one, other = (simulate(case(file, **given).given).row for file in ("", exported))
    assert one["contacts"] > 0
    for name in ("outcome", "regime", "contacts", "steps"):
        assert one[name] == other[name]
    for name in ("contact_impulse", "orbit_radius", "ledger_energy"):
        assert other[name] == pytest.approx(one[name], rel=1e-7)


def test_other_coordinates_are_the_same_rotor(engine, arrays, exported):
    """Inner coordinates mixed, all of them in another order."""
    size, random = len(arrays["mass"]), np.random.default_rng(4)
    outer, order = 2 * N + 2, random.permutation(size)
    mixed = np.eye(size)
    mixed[outer:, outer:] = np.linalg.qr(random.normal(size=(size - outer,) * 2))[0]
    mixed[outer:, :outer] = 0.1 * random.normal(size=(size - outer, outer))
    basis = mixed[:, order]
    names = ("mass", "stiffness", "damping", "coriolis", *PARTS)
    changes = {name: basis.T @ arrays[name] @ basis for name in names}
    changes["coriolis"] = (changes["coriolis"] - changes["coriolis"].T) / 2
    place = np.argsort(order)
    for name in ("tip_radial", "tip_tangential", "centre"):
        changes[name] = place[arrays[name]]
    changes["centrifugal_load"] = basis.T @ arrays["centrifugal_load"]
    found = rotor(engine(**changes, **dict.fromkeys(("damping_ratio", *MODAL))))
    own = rotor(exported)
    assert found.cyclic
    for speed in (0.0, 350.0):
        size = np.abs(numbers(own, speed)).max()
        assert numbers(found, speed) == pytest.approx(
            numbers(own, speed), abs=1e-7 * size
        )
    assert tip_growth(found, N, 400.0) == pytest.approx(
        tip_growth(own, N, 400.0), rel=1e-7
    )


def test_stiffness_at_two_speeds_is_that_at_any(engine, arrays):
    """Whatever asks for K(Omega) has the term of Omega^4."""
    second = stiffer(arrays)
    model = case(engine(**at_speeds(arrays, second))).model
    body, speed = model.rotor, 520.0
    first = arrays["stress_stiffness"] - arrays["softening"]
    whole = arrays["stiffness"] + speed**2 * first + speed**4 * second
    assert body.cyclic
    assert turning_matrices(body, speed, N)[2] == pytest.approx(
        whole, rel=1e-9, abs=1e-9 * np.abs(whole).max()
    )
    assert highest(body, speed, N) == pytest.approx(
        np.sqrt(eigh(whole, arrays["mass"], eigvals_only=True)[-1]), rel=1e-9
    )
    moved = np.linalg.solve(whole, speed**2 * arrays["centrifugal_load"])
    assert tip_growth(body, N, speed) == pytest.approx(moved[0 : 2 * N : 2], rel=1e-8)


def test_waves_have_the_eigenvalues_of_the_whole_quadratic_problem(engine, arrays):
    second, speed = stiffer(arrays), 520.0
    changes = at_speeds(arrays, second) | dict.fromkeys((*DAMPING, *MODAL))
    still = {"engine.rotor.damping": 0.0, "suspension_damping": 0.0}
    body = rotor(engine(**changes), **still)
    first = arrays["stress_stiffness"] - arrays["softening"]
    whole = arrays["stiffness"] + speed**2 * first + speed**4 * second
    n, parts = len(whole), np.hstack([whole, 2 * speed * arrays["coriolis"]])
    low, top = -np.linalg.solve(arrays["mass"], parts), np.eye(n, 2 * n, n)
    roots = np.sort(np.abs(np.linalg.eigvals(np.vstack([top, low])).imag))
    lines = [abs(line.rotating) for line in wave_lines(body, N, speed)]
    own = np.sort(np.repeat(lines, 2))  # a wave, and its conjugate
    assert len(own) == len(roots)
    assert own == pytest.approx(roots, abs=1e-9 * roots[-1])


def test_an_unbalance_and_softening_meet_the_term_of_omega_4(engine, arrays):
    path = engine(**at_speeds(arrays, -stiffer(arrays)))
    body = rotor(path)
    first = arrays["stress_stiffness"] - arrays["softening"]

    def whole(speed):
        second = -stiffer(arrays)
        return arrays["stiffness"] + speed**2 * first + speed**4 * second

    found = unbalance_speeds(body)
    assert found
    for speed in found:
        squared = eigh(whole(speed), arrays["mass"], eigvals_only=True)
        assert np.abs(squared).min() < 1e-7 * speed**2
    most, inner = stiff_up_to(body, N), np.r_[0 : 2 * N, 2 * N + 2 : len(first)]
    grid = np.ix_(inner, inner)
    squared = eigh(whole(most)[grid], arrays["mass"][grid], eigvals_only=True)
    assert abs(squared[0]) < 1e-6 * most**2
    below = eigh(whole(0.999 * most)[grid], arrays["mass"][grid], eigvals_only=True)
    assert below[0] > 0.0


def test_all_schemes_march_the_term_of_omega_4(engine, arrays):
    path = engine(**at_speeds(arrays, stiffer(arrays)))
    given = {"speed": 420.0, "duration": 0.01}
    rows = [
        simulate(case(path, scheme=scheme, **given).given).row
        for scheme in ("modal", "general", "paper")
    ]
    assert rows[0]["contacts"] > 0
    for row in rows[1:]:
        assert row["contacts"] == rows[0]["contacts"]
        for name in ("contact_impulse", "ledger_energy"):
            assert row[name] == pytest.approx(rows[0][name], rel=1e-6)
    plain = simulate(case(scheme="modal", **given).given).row
    assert plain["contact_impulse"] != pytest.approx(
        rows[0]["contact_impulse"], rel=1e-4
    )


def test_a_file_with_the_term_of_omega_4_is_exported_with_it(engine, arrays, tmp_path):
    path = engine(**at_speeds(arrays, stiffer(arrays)))
    again = rotor_files.exported(tmp_path / "again.h5", SMALL | {"file": path})
    own, found = rotor(path), rotor(again)
    assert numbers(found, 400.0) == pytest.approx(numbers(own, 400.0), rel=1e-8)


def test_unequal_terms_of_rotation_make_unequal_sectors(engine, arrays):
    softening = arrays["stress_stiffness"].copy()
    softening[0, 0] *= 1.01
    body = rotor(engine(stress_stiffness=softening))
    assert not body.cyclic
    assert "stiffening" in body.symmetry.where
    assert not body.spin.waves
    near, own = (np.sort(numbers(m, 300.0)[:, 0]) for m in (body, rotor()))
    assert len(near) == len(own)
    assert near[np.abs(near) < 2000] == pytest.approx(own[np.abs(own) < 2000], rel=1e-2)
    assert rotor(engine(stress_stiffness=softening), rotation="none").cyclic


def test_a_truncated_file_has_one_basis_for_all_speeds(engine):
    whole = rotor_from(str(engine()), N, 0.0085, eta=None, turns=True)
    few = rotor_from(str(engine()), N, 0.0085, eta=10, turns=True)
    assert len(few.omega) < len(whole.omega)
    for speed in (0.0, 300.0, 600.0):
        one, other = (
            [x.rotating for x in wave_lines(m, N, speed) if x.family == "1F"]
            for m in (whole, few)
        )
        assert other == pytest.approx(one, rel=1e-3)


def test_supports_that_stand_are_those_of_the_file_or_of_the_scene(engine, arrays):
    own = arrays["centre_damping"][0]
    assert own > 0.0
    assert rotor(engine(centre_damping=None)).spin.support.damping == 0.0
    given = rotor(engine(**dict.fromkeys((*DAMPING, *MODAL))))
    assert given.spin.support.damping == pytest.approx(own, rel=1e-6)
    assert rotor(engine(), cross_coupling=2e5).spin.support.stiffness == -2e5j
    fed = rotor(engine(), cross_coupling=1e8)
    assert largest_growth(fed, N, 100.0) > 0.0 > largest_growth(rotor(), N, 100.0)


def wrong(arrays):
    coriolis, size = arrays["coriolis"], len(arrays["mass"])
    skewed = coriolis.copy()
    skewed[0, 1] += 0.1
    lame = arrays["softening"].copy()
    lame[0, 3] += 0.1
    return {
        "sign": ({"coriolis": -coriolis}, "exchanges forward and backward"),
        "double": ({"coriolis": 2 * coriolis}, "it is 2 C"),
        "none": ({"coriolis": 0 * coriolis}, "rotor/coriolis must have C_xy = -m"),
        "not skew": ({"coriolis": skewed}, "rotor/coriolis must be skew"),
        "symmetric": ({"coriolis": arrays["mass"]}, "rotor/coriolis must be skew"),
        "infinite": ({"coriolis": coriolis + np.inf}, "rotor/coriolis must be finite"),
        "shape": ({"coriolis": coriolis[:-1, :-1]}, "rotor/coriolis must be"),
        "lame": ({"softening": lame}, "rotor/softening must be symmetric"),
        "no softening": (
            {"softening": 0 * lame},
            "rotor/softening must soften a translation",
        ),
        "load": ({"centrifugal_load": np.ones(size + 1)}, "rotor/centrifugal_load mus"),
        "all missing": (
            dict.fromkeys(("coriolis", "centrifugal_load", *PARTS)),
            "has no rotor/coriolis, rotor/centrifugal_load, rotor/stress_stiffness",
        ),
        "half": ({"softening": None}, "has no rotor/softening: engine.rotation"),
        "one speed": (
            {**at_speeds(arrays, 0.0), "stiffness_b": None},
            "has no rotor/stiffness_b",
        ),
        "both": ({"speeds": SPEEDS}, "but not both"),
        "descending": (
            {**at_speeds(arrays, 0.0), "speeds": SPEEDS[::-1]},
            "rotor/speeds must be two, ascending",
        ),
        "supports": ({"centre_damping": [-1.0]}, "rotor/centre_damping must be one"),
        "softened": (
            {**at_speeds(arrays, 0.0), "stiffness_b": arrays["stiffness"]},
            "rotor/stiffness_b must soften a translation",
        ),
    }  # fmt: skip


WRONG = (
    "sign", "double", "none", "not skew", "symmetric", "infinite", "shape", "lame",
    "no softening", "load", "all missing", "half", "one speed", "both", "descending",
    "supports", "softened",
)  # fmt: skip


@pytest.mark.parametrize("kind", WRONG)
def test_terms_that_are_none_are_refused_in_one_line(engine, arrays, kind):
    changes, told = wrong(arrays)[kind]
    with pytest.raises(InputError) as failed:
        rotor(engine(**changes))
    assert told in str(failed.value)
    assert "\n" not in str(failed.value)


def test_modes_alone_cannot_turn(engine):
    changes = dict.fromkeys(("mass", "stiffness", "damping", "shapes"))
    with pytest.raises(InputError, match="has no rotor/mass, rotor/stiffness: engine"):
        rotor(engine(**changes))


@pytest.mark.turns
def test_model_shows_a_file_with_and_without_rotation(exported, engine, capsys):
    for path, kinds in (
        (exported, {"none", "full"}),
        (engine(coriolis=None), {"none"}),
    ):
        given = ["--set", f"file={path}", "--set", f"blades={N}"]
        assert main(["model", "--explain", "--json", *given]) == 0
        assert set(json.loads(capsys.readouterr().out)["rotations"]) == kinds


@pytest.mark.parametrize("more", ["rotor.lost_blade=1", "rotor.shaft=cantilever"])
def test_what_a_file_has_no_place_for_is_not_exported(tmp_path, capsys, more):
    given = [x for name, value in SMALL.items() for x in ("--set", f"{name}={value}")]
    out = tmp_path / "a.h5"
    assert main(["export-model", str(out), *given, "--set", more]) == 2
    assert "has no terms for either" in capsys.readouterr().err
    assert not out.exists()
