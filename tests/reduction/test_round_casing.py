"""A casing from file: a table of modes by harmonic, marched as the ring it was."""

import numpy as np
import pytest
import rotor_files
from alike import assert_alike

from hpcwhirl.analysis.stability import growth_of_diameter
from hpcwhirl.case.resolve import resolve
from hpcwhirl.case.truncation import left_out, with_truncation
from hpcwhirl.dynamics.march import March
from hpcwhirl.errors import InputError
from hpcwhirl.scene import apply_settings, digest, named_scene, preset_inputs

N = 6
SMALL = {"blades": N, "engine.rotor.elements": 3, "modes": 18}
TABLE = ("harmonic", "omega", "damping_ratio", "radial", "tangential")


def exported(path, **settings):
    return rotor_files.exported(path, SMALL | settings)


@pytest.fixture
def engine(tmp_path):
    return exported(tmp_path / "engine.h5")


def scene(file, **settings):
    fast = {"duration": 3e-3, "interval": 1e-5, "traces": "full", "time_step": 2e-6}
    base = {"blades": N, "file": str(file)}
    return apply_settings(named_scene("table2"), fast | base | settings)


def from_file(file, **settings):
    return scene(file, discretization="file", **settings)


def changed(file, **news):
    """Write other columns of the table."""
    columns = {f"modal_{name}": column for name, column in news.items()}
    return rotor_files.written(file, columns, "casing")


def table_in(file):
    arrays = rotor_files.arrays_in(file, "casing")
    return {name: arrays[f"modal_{name}"] for name in TABLE}


@pytest.mark.parametrize(
    "settings",
    [
        {},
        {"casing.families": "bending", "casing.harmonics": 7},
        {"casing.support_frequency": 0.0, "casing.thickness": 0.05},
        {"casing.harmonics": 40, "support_damping": -1.0},
    ],
)
def test_the_modes_of_a_casing_read_back_are_the_same_bits(tmp_path, settings):
    file = exported(tmp_path / "engine.h5", **settings)
    own = resolve(scene("", **SMALL, **settings)).model.casing
    most = {n: v for n, v in settings.items() if n == "casing.harmonics"}
    found = resolve(from_file(file, **most)).model.casing
    for name in ("omega", "shapes", "diameter", "rank", "phase", "ratios"):
        assert np.array_equal(getattr(found, name), getattr(own, name)), name


@pytest.mark.parametrize(
    "settings", [{}, {"nodal_diameter": 2}, {"scheme": "general"}, {"scheme": "exact"}]
)
def test_a_casing_read_back_moves_with_the_same_bits(engine, settings):
    one, other = (
        March(resolve(of(engine, **settings))).run() for of in (from_file, scene)
    )
    assert one.contacts > 0
    for name in ("tips", "centre", "energy", "impulse", "casing", "blade_impulse"):
        assert np.array_equal(getattr(one, name), getattr(other, name)), name


def flanged(file):
    """Add a slow third mode, of a flange, to each harmonic of a table; shuffle it."""
    table = table_in(file)
    base = {name: table[name][::2] for name in TABLE}
    base["omega"] = 900.0 + 400.0 * base["harmonic"]
    base["radial"], base["tangential"] = 0.02 + 0 * base["omega"], 0 * base["omega"]
    whole = {name: np.concatenate([table[name], base[name]]) for name in TABLE}
    order = np.random.default_rng(1).permutation(len(whole["omega"]))
    return changed(file, **{name: whole[name][order] for name in TABLE})


@pytest.mark.parametrize("k", [1, 2])
def test_several_modes_a_harmonic_are_marched_alike_by_both_schemes(engine, k):
    flanged(engine)
    settings = {"nodal_diameter": k, "plan": "everything", "friction": 0.3}
    one, other = (
        March(resolve(from_file(engine, scheme=s, **settings))).run()
        for s in ("modal", "general")
    )
    assert one.contacts == other.contacts > 0
    assert_alike(one, other)
    plain = March(resolve(scene(engine, **settings))).run()
    assert np.abs(one.tips - plain.tips).max() > 1e-3 * np.abs(plain.tips).max()
    whole = abs(one.ledger["pulse"]) + abs(one.ledger["rotation"])
    assert abs(one.ledger["residual"]) < 1e-9 * whole


@pytest.mark.turns
def test_a_casing_from_file_may_do_what_a_ring_of_harmonics_may(engine):
    found, own = from_file(engine), scene(engine)
    for k in range(N // 2 + 1):
        a, b = (
            growth_of_diameter(resolve(s).model, k, 410.0, 0.1) for s in (found, own)
        )
        assert a == b
    flanged(engine)
    assert growth_of_diameter(resolve(found).model, 1, 410.0, 0.1) != b
    draft = with_truncation(from_file(engine, **preset_inputs("draft")))
    assert draft.engine.casing.harmonics == 20
    assert left_out(draft).ring == 0.0


def test_its_inputs_of_a_ring_count_for_nothing(engine):
    other = {"casing.thickness": 0.05, "casing.damping": 0.3, "support_damping": 0.7}
    one, two = (resolve(from_file(engine, **s)).model.casing for s in ({}, other))
    assert np.array_equal(one.omega, two.omega)
    assert np.array_equal(one.ratios, two.ratios)


def test_modes_above_the_harmonics_are_left_out(engine):
    own = {"casing.harmonics": 4}
    one, two = (
        resolve(from_file(engine, **own)).model,
        resolve(scene(engine, **own)).model,
    )
    assert np.array_equal(one.casing.shapes, two.casing.shapes)


def test_its_content_is_of_the_digest(engine):
    before = digest(from_file(engine))
    changed(engine, omega=table_in(engine)["omega"] * 1.001)
    assert digest(from_file(engine)) != before


def test_elements_have_no_table(tmp_path):
    path = exported(tmp_path / "elements.h5", discretization="elements")
    arrays = rotor_files.arrays_in(path, "casing")
    assert not any(name.startswith("modal_") for name in arrays)
    assert "has no casing/modal_harmonic" in refusal(path)


def refusal(file, **settings):
    with pytest.raises(InputError) as caught:
        March(resolve(from_file(file, **settings)))
    assert len(str(caught.value).splitlines()) == 1
    return str(caught.value)


@pytest.mark.parametrize(
    ("spoil", "told"),
    [
        (lambda t: {"omega": -t["omega"]}, "casing/modal_omega must be >= 0, got -"),
        (lambda t: {"damping_ratio": t["damping_ratio"] - 1.0}, "ratio must be >= 0"),
        (lambda t: {"harmonic": t["harmonic"] - 1}, "harmonic must be >= 0, got -1"),
        (lambda t: {"harmonic": t["harmonic"] + 0.5}, "hold whole numbers, got float"),
        (lambda t: {"omega": t["omega"] * np.nan}, "omega must be finite, got nan"),
        (lambda t: {"radial": t["radial"][1:]}, "radial must have as many entries"),
        (lambda t: {n: t[n][:0] for n in TABLE}, "must have as many entries"),
        (lambda t: {"tangential": t["tangential"] + 0.01}, "radially or tangential"),
        (lambda t: {n: t[n][t["harmonic"] != 3] for n in TABLE},
         "has no casing mode that moves radially in harmonic 3, but some in 20"),
        (lambda t: {"radial": np.where(t["harmonic"] == 2, 0.0, t["radial"])},
         "moves radially in harmonic 2"),
        (lambda _: {"radial": None}, "has no casing/modal_radial; the table of"),
    ],
)  # fmt: skip
def test_a_wrong_table_is_told_in_one_line(engine, spoil, told):
    text = refusal(changed(engine, **spoil(table_in(engine))))
    assert told in text
    assert str(engine) in text


def test_an_unknown_column_is_told(engine):
    assert "did you mean 'modal_radial'?" in refusal(changed(engine, radials=[1.0]))


def test_more_lobes_than_harmonics_are_told(engine):
    table = table_in(engine)
    changed(engine, **{n: table[n][table["harmonic"] < 3] for n in TABLE})
    assert "nodal_diameter must be <= 2, the highest" in refusal(
        engine, nodal_diameter=3
    )


def test_paper_is_told_that_it_needs_coordinates(engine):
    assert "discretization not 'file'" in refusal(engine, scheme="paper")
