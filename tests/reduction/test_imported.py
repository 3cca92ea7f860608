"""Rotors from file whose sectors are equal: the built-in's waves, or told why not."""

import inspect
import itertools
from dataclasses import replace

import numpy as np
import pytest
import read_back as comparison
import rotor_files
from alike import assert_alike
from launch import words_of
from read_back import SAME, compared, read_back, sound

from hpcwhirl.analysis.participation import family_amplitudes
from hpcwhirl.analysis.stability import growth_of_diameter
from hpcwhirl.case.coarser import coarser
from hpcwhirl.case.resolve import resolve
from hpcwhirl.case.truncation import left_out, with_truncation
from hpcwhirl.cli import main
from hpcwhirl.cli.bench import engines_of
from hpcwhirl.dynamics.march import March
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.families import modal_table
from hpcwhirl.reduction.recognise import EQUAL, transform
from hpcwhirl.scene import apply_settings, flatten, named_scene, preset_inputs

N = 6
SMALL = {"blades": N, "engine.rotor.elements": 3, "modes": 18}
MATRICES = ("mass", "stiffness", "damping", "tip_radial", "tip_tangential", "centre")
MODAL = ("omega", "damping_ratio", "modal_tip_radial", "modal_tip_tangential",
         "modal_centre")  # fmt: skip
ANGLES = 2 * np.pi * np.arange(N) / N


def scene(file="", **settings):
    fast = {"duration": 3e-3, "interval": 1e-5, "traces": "full", "time_step": 2e-6}
    geometry = {"blades": N, "file": str(file)} if file else SMALL
    return apply_settings(named_scene("mostly_damped"), fast | geometry | settings)


def rotor_of(file="", **settings):
    return resolve(scene(file, **settings)).model.rotor


def ended(*args, **settings):
    return March(resolve(scene(*args, **settings))).run()


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    path = tmp_path_factory.mktemp("small") / "rotor.h5"
    return rotor_files.exported(path, SMALL, "mostly_damped")


@pytest.fixture(scope="module")
def arrays(exported):
    return rotor_files.arrays_in(exported)


@pytest.fixture
def written(tmp_path):
    """Return a function: {name: array} -> path of such a file."""
    number = itertools.count()

    def write(rotor):
        return rotor_files.written(tmp_path / f"rotor-{next(number)}.h5", rotor)

    return write


def chosen(arrays, names=MATRICES, **news):
    return {name: arrays[name] for name in names} | news


def staggered(stagger=0.4, shift=3e4, grounded=0.0, loss=0.0):
    """Return a wheel that is no mirror image of itself: tips on skew springs.

    Between neighbours one spring leads from the radial motion of a tip to the
    tangential one of the next.
    """
    size = 2 * N + 2
    rows, springs = [], []
    for j, angle in enumerate(ANGLES):
        cosine, sine = np.cos(angle), np.sin(angle)
        radial, tangential = np.zeros(size), np.zeros(size)
        radial[2 * j], tangential[2 * j + 1] = 1.0, 1.0
        ground = radial + tangential
        radial[-2:], tangential[-2:] = (-cosine, -sine), (sine, -cosine)
        c, s = np.cos(stagger), np.sin(stagger)
        after = np.zeros(size)
        after[2 * ((j + 1) % N) + 1] = 1.0
        after[-2:] = (np.sin(angle + 2 * np.pi / N), -np.cos(angle + 2 * np.pi / N))
        rows += [c * radial + s * tangential, c * tangential - s * radial]
        rows += [radial - after, ground]
        springs += [2e6, 6.8e4, shift, grounded]
    rows += list(np.eye(size)[-2:])
    springs += [3.4e6, 3.4e6]
    stiffness = np.array(rows).T @ (np.array(springs)[:, None] * np.array(rows))
    tips = np.arange(2 * N).reshape(N, 2)
    return {
        "mass": np.diag([0.9] * 2 * N + [20.0] * 2),
        "stiffness": stiffness,
        "damping": loss * stiffness,
        "tip_radial": tips[:, 0],
        "tip_tangential": tips[:, 1],
        "centre": np.array([2 * N, 2 * N + 1]),
    }


# It is the same rotor


@pytest.mark.parametrize("names", [MATRICES, MODAL])
def test_a_rotor_read_back_has_the_modes_it_had(arrays, written, names):
    own, found = rotor_of(), rotor_of(written(chosen(arrays, names)))
    assert found.cyclic
    assert found.symmetry.deviation < 1e-8
    for name in ("diameter", "rank", "phase"):
        assert np.array_equal(getattr(found, name), getattr(own, name))
    for name in ("omega", "ratios"):
        assert getattr(found, name) == pytest.approx(getattr(own, name), rel=1e-9)
    assert found.centre_share == pytest.approx(own.centre_share, abs=1e-9)
    pairs = found.phase == 1
    assert np.array_equal(found.omega[pairs], found.omega[np.flatnonzero(pairs) - 1])
    a, b = (waves(body) for body in (found, own))
    turn = (b.conj() * a).sum(axis=0) / (np.abs(b) ** 2).sum(axis=0)
    assert np.abs(turn) == pytest.approx(1.0, abs=1e-8)  # a pair's phase is nobody's
    assert np.abs(a - turn * b).max() < 1e-8 * np.abs(b).max()


def waves(body):
    """Return F_k (3, m) of each mode's own k; of second phases times -i."""
    rows = len(body.shapes) - 2 * N - body.kept
    hub = body.shapes[2 * N : 2 * N + rows] if rows else np.zeros((2, len(body.omega)))
    seen = transform(body.shapes, hub, N)[body.diameter, :, np.arange(len(body.omega))]
    return (seen * np.where(body.phase == 1, -1j, 1.0)[:, None]).T


@pytest.mark.parametrize(
    "settings",
    [
        {},
        {"nodal_diameter": 2},
        {"nodal_diameter": 3, "friction": 0.3},
        {"speed": -410.0},
        {"scheme": "exact"},
        {"kind": "rigid", "amplitude": 3e-4, "growth": 20.0},
    ],
)
def test_a_rotor_read_back_moves_as_it_did(exported, settings):
    one, other = ended(exported, **settings), ended(**settings)
    assert one.folds == other.folds
    assert_alike(one, other, 1e-9)


def layout(value, name=""):
    """Yield what a compiled step depends on of all it is called with but numbers."""
    if isinstance(value, tuple):
        fields = getattr(value, "_fields", range(len(value)))
        yield name, type(value), len(value)
        for own, part in zip(fields, value, strict=True):
            yield from layout(part, f"{name}.{own}")
    elif isinstance(value, np.ndarray):
        kept = value.dtype.kind != "f" and value.tolist()  # places, counts
        yield name, value.dtype, value.shape, value.strides, value.flags.num, kept
    else:
        yield name, type(value), value if isinstance(value, int) else None


def called(marched, arrays=None):
    """Return the compiled kernel and the layout of all that it is called with."""
    scheme = marched.scheme
    own = inspect.getclosurevars(scheme.kernel).nonlocals
    arrays = arrays or scheme.arrays
    given = arrays, scheme.state, marched.tracks, own["space_of"]()
    return own["march"], list(layout(given))


BUILT = (
    SMALL | {"nodal_diameter": 2},
    SMALL | {"scheme": "exact", "nodal_diameter": 3, "friction": 0.3},
    SMALL | {"centre": "clamped"},
    {"blades": 7, "engine.rotor.elements": 3, "modes": 25, "traces": "summary"},
    {},  # of 22 blades, which `bench` times
)


@pytest.mark.turns
@pytest.mark.parametrize("settings", BUILT)
def test_a_rotor_read_back_takes_the_same_operations_a_step(tmp_path, settings):
    own = apply_settings(named_scene("table2"), {"duration": 3e-3} | settings)
    read = engines_of(own, tmp_path)["file, cyclic"]
    (kernel, wanted), (again, found) = (called(March(resolve(s))) for s in (own, read))
    assert again is kernel
    assert found == wanted


@pytest.mark.parametrize(
    ("part", "spoil"),
    [
        ("free", lambda items: np.r_[items, np.zeros(8)]),  # a slot of padding
        ("free", lambda items: items.repeat(2)[::2]),
        ("pushed", lambda items: items.astype(np.float32)),
        ("ring", lambda counts: counts + 1),  # as many rows more of the casing
    ],
)
def test_another_layout_is_other_operations(part, spoil):
    marched = March(resolve(scene()))
    _, wanted = called(marched)
    arrays = marched.scheme.arrays
    rotor = arrays.rotor
    rows = rotor.rows._replace(**{part: spoil(getattr(rotor.rows, part))})
    other = arrays._replace(rotor=rotor._replace(rows=rows))
    assert called(marched, other)[1] != wanted


def test_what_the_built_in_rotor_may_do_it_may(exported):
    for settings in ({}, {"nodal_diameter": 2}, {"duration": 2.5, "until": "certain"}):
        found, own = scene(exported, **settings), scene(**settings)
        plans = [resolve(s).plan for s in (found, own)]
        assert plans[0].folds == plans[1].folds
        assert plans[0].settles == plans[1].settles
    assert resolve(scene(exported, nodal_diameter=2)).plan.folds > 1


@pytest.mark.turns
def test_growth_and_contributions_are_those_of_the_built_in(exported):
    one, other = (resolve(scene(file)).model for file in ("", exported))
    for k in range(N // 2 + 1):
        a, b = (growth_of_diameter(m, k, 410.0, 0.1) for m in (one, other))
        for name in ("closed", "slow", "sprung"):
            assert a[name] == pytest.approx(b[name], rel=1e-6)
    history = ended()
    found = [
        family_amplitudes(history.tips, history.centre, 1e-5, m) for m in (one, other)
    ]
    for name, amplitude in found[0].items():
        assert found[1][name] == pytest.approx(
            amplitude, abs=1e-6 * max(amplitude.max(), 1e-300)
        )
    assert found[0]["suspension"].max() > 0.0


def test_its_suspension_is_called_so(exported, arrays, written):
    for file in (exported, written(chosen(arrays, MODAL))):
        own, found = (modal_table(resolve(scene(f)).model) for f in ("", file))
        assert [line.family for line in found] == [line.family for line in own]
        assert sum(line.family == "suspension" for line in found) == 1


@pytest.mark.turns
@pytest.mark.parametrize(
    "preset", ["draft", pytest.param("standard", marks=pytest.mark.evidence)]
)
def test_presets_leave_out_what_they_leave_out_of_the_built_in(tmp_path, preset):
    inputs = preset_inputs(preset)
    path = tmp_path / "finest.h5"  # all modes that an estimate looks at
    settings = SMALL | {"modes": 8 * N, "engine.rotor.elements": 10}
    rotor_files.exported(path, settings, "mostly_damped")
    own = with_truncation(scene(**settings, **inputs))
    found = with_truncation(scene(path, **inputs))
    assert found.solver.modes == own.solver.modes
    assert found.solver.modes < 8 * N or preset != "draft"
    assert found.engine.casing == own.engine.casing
    one, other = resolve(own).model.rotor, resolve(found).model.rotor
    assert other.omega == pytest.approx(one.omega, rel=1e-9)
    assert flatten(with_truncation(found)) == flatten(found)
    rotor = left_out(own).rotor
    assert left_out(found).rotor == pytest.approx(rotor, rel=0.2, abs=1e-9)


def test_of_modes_alone_a_truncation_leaves_out_harmonics_only(arrays, written):
    file = written(chosen(arrays, MODAL))
    given = scene(file, **preset_inputs("draft"))
    found = with_truncation(given)
    assert len(resolve(given).model.rotor.omega) == len(rotor_of(file).omega)
    assert found.engine.casing.harmonics < 20
    assert left_out(found).rotor == 0.0


@pytest.mark.turns
def test_a_coarser_run_has_the_modes_of_a_file_or_fewer(tmp_path):
    finest = SMALL | {"modes": 8 * N, "engine.rotor.elements": 10}
    path = rotor_files.exported(tmp_path / "finest.h5", finest, "mostly_damped")

    def modes(case):
        return len(case.model.rotor.omega)

    own, step, every = (
        resolve(scene(path, truncation=0.1, accuracy=1e-3, estimate=name))
        for name in ("none", "step", "all")
    )
    whole = resolve(scene(path, accuracy=1e-3))
    assert modes(coarser(every)) < modes(coarser(step)) == modes(own) < modes(whole)


# Whatever its coordinates


def test_other_coordinates_may_be_any_combinations(arrays, written):
    random = np.random.default_rng(3)
    inner = np.eye(len(arrays["mass"]))
    size = len(inner) - 2 * N - 2
    inner[-size:, -size:] = np.linalg.qr(random.normal(size=(size, size)))[0] * (
        random.uniform(0.1, 10.0, size)
    )
    inner[-size:, :-size] = random.normal(size=(size, 2 * N + 2))
    news = {n: inner.T @ arrays[n] @ inner for n in ("mass", "stiffness", "damping")}
    found = rotor_of(written(chosen(arrays, **news)))
    assert found.cyclic
    assert found.omega == pytest.approx(rotor_of().omega, rel=1e-8)


@pytest.mark.parametrize("round_off", [0.0, 1e-6])  # N/m
def test_what_neither_tips_nor_centre_see_is_left_out(arrays, written, round_off):
    size = len(arrays["mass"])
    news, random = {}, np.random.default_rng(5)
    for name, value in {"mass": 1.0, "stiffness": 1e7, "damping": 5.0}.items():
        news[name] = np.zeros((size + 3, size + 3))
        news[name][:size, :size] = arrays[name]
        news[name][size:, size:] = value * np.eye(3)
    joined = round_off * random.normal(size=(size, 3))
    news["stiffness"][:size, size:] = joined
    news["stiffness"][size:, :size] = joined.T
    found = rotor_of(written(chosen(arrays, **news)))
    assert found.cyclic
    assert found.omega == pytest.approx(rotor_of().omega, rel=1e-9)


@pytest.mark.parametrize(("stagger", "k"), [(0.4, 1), (-0.4, 2), (0.4, 3), (0.0, 2)])
def test_a_wheel_without_a_mirror_turns_as_its_matrices_do(written, stagger, k):
    """The dense scheme knows no nodal diameters, no phases and no direction."""
    file = written(staggered(stagger, loss=1e-5))
    assert rotor_of(file).cyclic
    settings = {"nodal_diameter": k, "friction": 0.3, "plan": "everything"}
    one, other = (ended(file, scheme=s, **settings) for s in ("modal", "paper"))
    assert_alike(one, other)


def test_degenerate_families_are_taken_apart(written):
    """Tips on a rigid disk: all modes of a family but those of k = 1 are one space."""
    file = written(staggered(0.0, shift=0.0, loss=1e-5))
    found = rotor_of(file)
    assert found.cyclic
    for k in range(N // 2 + 1):
        width = 2 if k in {1, 2} else 1
        count = 3 if k == 1 else 2
        assert np.count_nonzero(found.diameter == k) == count * width
    one, other = (ended(file, scheme=s) for s in ("modal", "paper"))
    assert_alike(one, other)


# What is not equal


def mistuned(arrays, change):
    stiffness = arrays["stiffness"].copy()
    own = [arrays["tip_radial"][2], arrays["tip_tangential"][2]]
    stiffness[own, own] *= 1.0 + change
    return chosen(arrays, stiffness=stiffness)


def test_the_deviation_of_a_mistuned_rotor_is_told(written, capsys):
    sizes = []
    for change in (1e-4, 1e-3, 1e-2):
        file = written(mistuned(staggered(), change))
        found = rotor_of(file)
        assert not found.cyclic
        sizes.append(found.symmetry.deviation)
    assert sizes[0] > EQUAL
    assert np.diff(sizes).min() > 0.0
    assert main(["model", *words_of({"blades": N, "file": file})]) == 0
    told = [line for line in capsys.readouterr().out.splitlines() if "sectors" in line]
    assert len(told) == 1
    assert f"sectors differ by {sizes[-1]:.2g} at most" in told[0]
    assert told[0].endswith("integrated each by itself")


def test_less_than_the_tolerance_is_equal(written):
    found = rotor_of(written(mistuned(staggered(), 1e-9)))
    assert found.cyclic
    assert 1e-11 < found.symmetry.deviation < EQUAL
    assert not rotor_of(written(mistuned(staggered(), 1e-5))).cyclic


def test_a_truncation_changes_nothing_of_a_mistuned_rotor(written):
    file = written(mistuned(staggered(), 1e-2))
    given = scene(file, truncation=0.3)
    assert with_truncation(given) == given


def test_a_mistuned_rotor_is_handed_over_to_modal_which_moves_as_general(written):
    file = written(mistuned(staggered(), 1e-2))
    assert "equal blades" in resolve(scene(file, scheme="exact")).handed_over
    exact, modal, general = (
        ended(file, scheme=scheme) for scheme in ("exact", "modal", "general")
    )
    assert np.array_equal(exact.tips, modal.tips)
    assert_alike(modal, general)


def unequal_shaft(wheel):
    stiffness = wheel["stiffness"].copy()
    stiffness[-1, -1] += 1e3
    return wheel | {"stiffness": stiffness}


def modes_of_wheel(body, ratios):
    return {
        "omega": body.omega,
        "damping_ratio": ratios,
        "modal_tip_radial": body.shapes[0 : 2 * N : 2],
        "modal_tip_tangential": body.shapes[1 : 2 * N : 2],
        "modal_centre": body.shapes[2 * N :],
    }


def odd_mode(wheel):
    size = len(wheel["mass"])
    out = {}
    for name, value in {"mass": 1.0, "stiffness": 1e7}.items():
        out[name] = np.zeros((size + 1, size + 1))
        out[name][:size, :size] = wheel[name]
        out[name][-1, -1] = value
    wave = np.zeros(size)
    wave[0 : 2 * N : 2] = np.cos(ANGLES * 2)
    out["mass"][-1, :size] = out["mass"][:size, -1] = 0.05 * wave
    return wheel | out


@pytest.mark.parametrize(
    ("spoil", "told"), [(unequal_shaft, "at "), (odd_mode, "cannot all be paired")]
)
def test_what_looks_equal_but_is_not_is_found(written, spoil, told):
    wheel = staggered(0.2)
    del wheel["damping"]
    found = rotor_of(written(spoil(wheel)))
    assert not found.cyclic
    assert told in found.symmetry.where


def test_a_pair_whose_phases_are_damped_unequally_is_no_pair(written):
    plain = rotor_of(written(staggered(0.2)))
    ratios = np.where((plain.diameter == 2) & (plain.phase == 1), 0.011, 0.01)
    found = rotor_of(written(modes_of_wheel(plain, ratios)))
    assert not found.cyclic
    assert "damping at" in found.symmetry.where
    assert "nodal diameter 2" in found.symmetry.where
    assert found.ratios == pytest.approx(ratios)  # and marched as it is


def test_a_pair_cut_at_the_end_of_a_file_of_modes_is_told(arrays, written):
    body = rotor_of()
    last = int(np.flatnonzero(body.phase == 1)[-1])
    short = {n: np.delete(arrays[n], last, axis=-1) for n in MODAL}
    found = rotor_of(written(short))
    assert not found.cyclic
    assert f"nodal diameter {body.diameter[last]}" in found.symmetry.where


# Which way round


def reversed_tips(wheel):
    back = -np.arange(N) % N
    return wheel | {n: wheel[n][back] for n in ("tip_radial", "tip_tangential")}


def against(name):
    def turn(wheel):
        size = len(wheel["mass"])
        sign = np.ones(size)
        sign[wheel[name]] = -1.0
        return wheel | {
            n: sign[:, None] * wheel[n] * sign for n in ("mass", "stiffness", "damping")
        }

    return turn


def turned_centre(wheel):
    return wheel | {"centre": wheel["centre"][::-1]}


@pytest.mark.parametrize(
    ("spoil", "told"),
    [
        (reversed_tips, "counted clockwise, blade 0 at 0 degrees"),
        (against("tip_tangential"), "tangential motion positive against the angle"),
        (against("tip_radial"), "blade 0 at 180 degrees"),
        (turned_centre, "counted clockwise, blade 0 at 90 degrees"),
    ],
)
@pytest.mark.parametrize("stagger", [0.0, 0.4])
def test_tips_and_centre_that_lie_otherwise_are_refused(written, spoil, told, stagger):
    with pytest.raises(InputError) as caught:
        rotor_of(written(spoil(staggered(stagger))))
    assert told in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


# Springs and damping


def test_the_shafts_springs_are_told_by_the_modes(written):
    found = rotor_of(written(staggered()))
    share = found.centre_share[found.diameter == 1]
    hub = found.shapes[2 * N :, found.diameter == 1]
    assert share == pytest.approx(
        3.4e6 * (hub**2).sum(axis=0) / found.omega[found.diameter == 1] ** 2
    )


def test_springs_that_modes_do_not_tell_are_unknown(written):
    file = written(staggered(grounded=1e4))
    found = resolve(scene(file)).model
    assert found.rotor.cyclic
    for line in modal_table(found):
        if line.body == "rotor":
            assert (line.family == "unknown") == (line.nodal_diameter == 1)
            assert (line.centre_share is None) == (line.nodal_diameter == 1)
    history = ended(file)
    amplitude = family_amplitudes(history.tips, history.centre, 1e-5, found)
    assert np.isnan(amplitude["1F"][:, 1]).all()
    assert np.isfinite(amplitude["1F"][:, 2]).all()


def test_a_file_without_damping_is_damped_as_the_scene_says(arrays, written):
    names = [n for n in MATRICES if n != "damping"]
    file = written(chosen(arrays, names))
    ratios = {"engine.rotor.damping": 0.02, "suspension_damping": 0.3}
    assert rotor_of(file, **ratios).ratios == pytest.approx(
        rotor_of(**ratios).ratios, rel=1e-12
    )
    assert set(rotor_of(file, **ratios).ratios) == {0.02, 0.3}
    both = written(chosen(arrays))  # its own damping decides
    assert rotor_of(both, **ratios).ratios == pytest.approx(rotor_of().ratios, rel=1e-9)


@pytest.mark.parametrize(
    ("names", "news", "told"),
    [
        (MODAL, lambda r: {"damping_ratio": -r["damping_ratio"]}, "must be >= 0, got"),
        (MODAL, lambda r: {"damping_ratio": r["damping_ratio"][1:]}, "must be (32,)"),
        ((*MATRICES, "shapes", "omega"),
         lambda r: {"damping_ratio": 1.01 * r["damping_ratio"]},
         "damping_ratio must be those of rotor/damping"),
        ((*MATRICES[:2], *MATRICES[3:], "shapes", "omega", "damping_ratio"),
         lambda _: {}, "rotor/damping must be there, too"),
        ((*MATRICES, "damping_ratio"), lambda _: {}, "without rotor/shapes"),
    ],
)  # fmt: skip
def test_wrong_damping_ratios_are_told_in_one_line(arrays, written, names, news, told):
    with pytest.raises(InputError) as caught:
        rotor_of(written(chosen(arrays, names, **news(arrays))))
    assert told in str(caught.value)


def test_unevenly_damped_modes_of_one_frequency_keep_their_damping(written):
    """Degenerate modes with a damping of their own are not mixed with one another."""
    wheel = staggered(0.0, shift=0.0)
    plain = rotor_of(written(wheel))
    ratios = 0.001 + 0.002 * plain.diameter
    found = rotor_of(written(modes_of_wheel(plain, ratios)))
    assert found.cyclic
    assert found.ratios == pytest.approx(0.001 + 0.002 * found.diameter, rel=1e-9)
    damped = replace(plain, damping=ratios).damping_matrix()
    again = rotor_of(written(wheel | {"damping": damped}))
    assert again.ratios == pytest.approx(0.001 + 0.002 * again.diameter, rel=1e-6)


# Exported, read back, at random


@pytest.mark.evidence
@pytest.mark.parametrize("index", range(60))
def test_scenes_at_random_are_the_same_before_chaos(tmp_path, index):
    record = compared(index, tmp_path)
    assert sound(record), record


@pytest.mark.parametrize("index", [0, 4])
def test_scenes_at_random_are_the_same_when_their_rotor_is_read_back(tmp_path, index):
    record = compared(index, tmp_path, duration=0.1)
    assert record["kernel"]
    assert record["same"]
    assert record["apart"] <= SAME
    assert record["bits"] == (record["way"] != "matrices" or record["apart"] == 0.0)


def test_what_differs_from_the_built_in_is_counted(tmp_path, monkeypatch):
    """The comparison sees a rotor read back the wrong way round."""

    def spoilt(scene, path, way):
        again = read_back(scene, path, way)
        stiffness = rotor_files.arrays_in(path)["stiffness"] * (1.0 + 1e-7)
        rotor_files.written(path, {"stiffness": stiffness})
        return again

    monkeypatch.setattr(comparison, "read_back", spoilt)
    record = compared(4, tmp_path, duration=0.1)
    assert record["apart"] > SAME
    assert not sound(record)


def test_one_blade_further_is_refused(written):
    wheel = staggered(0.4)
    ahead = {n: np.roll(wheel[n], 1) for n in ("tip_radial", "tip_tangential")}
    with pytest.raises(InputError, match="blade 0 at 300 degrees"):
        rotor_of(written(wheel | ahead))


def test_modes_that_come_with_their_matrices_keep_every_bit(exported):
    found, own = rotor_of(exported), rotor_of()
    for name in ("omega", "shapes", "ratios", "diameter", "rank", "phase"):
        assert np.array_equal(getattr(found, name), getattr(own, name))
    one, other = ended(exported, duration=0.02), ended(duration=0.02)
    assert np.array_equal(one.tips, other.tips)
    assert one.ledger == other.ledger


def test_modes_that_are_not_quite_those_of_the_matrices_are_solved_anew(
    arrays, written
):
    """Within what is refused, matrices decide."""
    whole = {n: a for n, a in arrays.items() if n != "damping_ratio"}
    near = whole | {"omega": arrays["omega"] * (1.0 + 1e-8)}
    found = rotor_of(written(near))
    assert found.cyclic
    assert found.omega == pytest.approx(arrays["omega"], rel=1e-10)
