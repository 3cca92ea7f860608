"""Several contact points a tip: contact of all of them at once, in a casing with width.

The oracle is independent of the kernels: full matrices of both bodies, a casing written
down by hand, and multipliers by pivoting in Python.
"""

import numpy as np
import pytest
import scipy.linalg
import stage as stages
from alike import assert_same_bits
from dense_blade import multipliers
from rotor_files import arrays_in, exported, written
from stage import ANGLES, GAPS, STATIONS, N, by_modes, rotor, turning

from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.kernels.contact import pulse_of
from hpcwhirl.dynamics.kernels.loop.wave_types import PointRows, SectorRows
from hpcwhirl.dynamics.kernels.vectors import widths
from hpcwhirl.dynamics.march import March
from hpcwhirl.errors import InputError
from hpcwhirl.scene import apply_settings, named_scene

SHELL = {
    "discretization": "shell", "casing.width": 0.1, "casing.thickness": 0.004,
    "axial_modes": 2, "casing.harmonics": 4, "casing.damping": 0.03,
    "support_damping": -1.0,
}  # fmt: skip
FAST = {
    "duration": 1e-2, "interval": 1e-4, "time_step": 5e-6, "traces": "full",
    "blades": N, "gap": 1e-4, "friction": 0.3, "force": 6e4, "pulse": 6e-4,
    "speed": 300.0, "nodal_diameter": 2, "radius": 0.5,
}  # fmt: skip
TRACES = "tips", "centre", "energy", "impulse", "casing", "blade_impulse"


def scene(file, **settings):
    return apply_settings(
        named_scene("table2"), FAST | SHELL | {"file": str(file)} | settings
    )


def run(file, **settings):
    return March(resolve(scene(file, **settings))).run()


def same(one, other, allowed, names=TRACES):
    for name in names:
        a, b = getattr(one, name), getattr(other, name)
        assert np.abs(a - b).max() <= allowed * np.abs(b).max(), name


@pytest.fixture(scope="module")
def stage(tmp_path_factory):
    return written(tmp_path_factory.mktemp("stage") / "stage.h5", rotor())


def casing_rows(turned):
    """Return w and u of the shell at all points, (N n_c, size), written out by hand."""
    modes, harmonics = SHELL["axial_modes"], SHELL["casing.harmonics"]
    theta = turned + np.add.outer(2 * np.pi * np.arange(N) / N, ANGLES).ravel()
    waves = [np.ones_like(theta)]
    for h in range(1, harmonics + 1):
        waves += [np.cos(h * theta), np.sin(h * theta)]
    place = np.tile(STATIONS, N) / SHELL["casing.width"] + 0.5
    along = [np.sin((p + 1) * np.pi * place) for p in range(modes)]
    rows = np.array([value * wave for value in along for wave in waves]).T
    none = np.zeros_like(rows)
    return np.hstack([rows, none, none]), np.hstack([none, rows, none])


def loads_of(arrays, mu, turned):
    """Return gap rows and, by columns, loads of unit multipliers of both bodies."""
    out, tangent = casing_rows(turned)
    radial, along = arrays["tip_radial"].ravel(), arrays["tip_tangential"].ravel()
    same = np.eye(len(arrays["mass"]))
    reads = -same[radial], out
    return reads, (-(same[radial] + mu * same[along]).T, (out + mu * tangent).T)


def pulse_on_shell(lobes, size):
    """Return the load of a unit force that squeezes the shell in its middle."""
    load = np.zeros(size)
    for p in range(SHELL["axial_modes"]):
        place = p * (2 * SHELL["casing.harmonics"] + 1) + 2 * lobes - 1
        load[place] = -np.sin((p + 1) * np.pi / 2)
    return load


def oracle(file, **settings):
    """March with full matrices; return points, impulses, lowest gap, contacts."""
    given, arrays = scene(file, **settings), rotor()
    step, casing = given.solver.time_step, resolve(given).model.casing
    bodies = (
        [arrays[n] for n in ("mass", "damping", "stiffness")],
        [casing.mass, casing.damping_matrix(), casing.stiffness],
    )
    left = [scipy.linalg.lu_factor(m / step**2 + d / (2 * step)) for m, d, _ in bodies]
    x, old = ([np.zeros(len(m)) for m, *_ in bodies] for _ in range(2))
    load = pulse_on_shell(given.nodal_diameter, len(casing.mass))
    clear = given.gap + np.tile(GAPS, N)
    seen, pushed, lowest, touched = [], np.zeros(len(clear)), 0.0, 0
    for n in range(round(given.duration / step)):
        new = []
        for b, (m, d, k) in enumerate(bodies):
            right = m @ (2 * x[b] - old[b]) / step**2 + d @ old[b] / (2 * step)
            right += b * pulse_of(n * step, given.force, given.pulse) * load[: len(m)]
            new.append(scipy.linalg.lu_solve(left[b], right - k @ x[b]))
        turned = given.speed * (n + 1) * step
        reads, loads = loads_of(arrays, given.friction, turned)
        gaps = clear + sum(r @ v for r, v in zip(reads, new, strict=True))
        if gaps.min() < 0.0:
            gives = [scipy.linalg.lu_solve(left[b], loads[b]) for b in range(2)]
            lam = multipliers(
                gaps, sum(r @ g for r, g in zip(reads, gives, strict=True))
            )
            new = [v + g @ lam for v, g in zip(new, gives, strict=True)]
            closed = clear + sum(r @ v for r, v in zip(reads, new, strict=True))
            lowest = min(lowest, closed.min())
            pushed, touched = pushed + lam * step, touched + (lam > 0.0).sum()
        x, old = new, x
        if (n + 1) % round(given.output.interval / step) == 0:
            rows = (arrays[n].ravel() for n in ("tip_radial", "tip_tangential"))
            seen.append(np.column_stack([x[0][r] for r in rows]))
    return np.array(seen), pushed, lowest, touched


@pytest.mark.turns
def test_all_points_move_as_full_matrices_say(stage):
    seen, pushed, lowest, touched = oracle(stage)
    assert touched > 100
    assert lowest > -1e-12
    for scheme in ("modal", "general", "paper"):
        march = March(resolve(scene(stage, scheme=scheme)))
        march.run()
        size = np.abs(seen).max()
        assert np.abs(march.tracks.tips[: len(seen)] - seen).max() < 1e-8 * size
        assert np.abs(march.state.impulse - pushed).max() < 1e-8 * pushed.max()
        shares = pushed.reshape(N, -1).sum(axis=0) / pushed.sum()
        assert (shares > 0.02).all()  # every point of the chord takes its part


def one_point(arrays):
    """Return a rotor of modes with the middle point of each tip alone."""
    flat = {n: arrays[n][:, 1] for n in ("modal_tip_radial", "modal_tip_tangential")}
    places = ("tip_station", "tip_angle", "tip_gap")
    return {n: v for n, v in arrays.items() if n not in places} | flat


def repeated(arrays, gaps):
    """Return the same with as many equal points a tip, and their clearances."""
    count = len(gaps)
    return arrays | {
        **{n: np.repeat(arrays[n][:, None], count, axis=1)
           for n in ("modal_tip_radial", "modal_tip_tangential")},
        "tip_station": np.zeros(count), "tip_gap": np.array(gaps),
    }  # fmt: skip


LOBES = {"kind": "rigid", "amplitude": 1.2e-4}


@pytest.mark.parametrize(
    ("gaps", "casing"),
    [((0.0, 0.0), {}), ((0.0, 1e-3), LOBES), ((1e-3, 0.0), {}), ((0.0,) * 3, LOBES)],
    ids=["singular", "second away", "first away", "three"],
)
def test_equal_points_of_a_tip_move_as_one(tmp_path, gaps, casing):
    single = one_point(by_modes(rotor()))
    one = run(written(tmp_path / "one.h5", single), scheme="general", **casing)
    more = run(written(tmp_path / "more.h5", repeated(single, gaps)), **casing)
    assert one.contacts > 0
    same(more, one, 1e-9)
    assert more.gap_error < 1e-9


@pytest.mark.parametrize(
    ("apart", "count"), [(1e-16, 5), (1e-14, 2), (1e-12, 5), (1e-9, 2)]
)
def test_nearly_equal_points_of_a_tip_move_nearly_as_one(tmp_path, apart, count):
    single = one_point(by_modes(rotor()))
    near, random = repeated(single, np.zeros(count)), np.random.default_rng(1)
    for name in ("modal_tip_radial", "modal_tip_tangential"):
        near[name] = near[name] * (1 + apart * random.normal(size=near[name].shape))
    one = run(written(tmp_path / "one.h5", single), scheme="general")
    more = run(written(tmp_path / "more.h5", near))
    assert more.stop == "end"
    same(more, one, 100 * apart + 1e-11)
    assert more.gap_error < 1e-9


def test_a_tip_of_one_point_in_an_axis_of_points_is_the_same_bits(tmp_path):
    single = one_point(by_modes(rotor()))
    axis = {n: v[:, None] if v.shape[0] == N and v.ndim > 1 and n.startswith("modal")
            else v for n, v in single.items()}  # fmt: skip
    axis["modal_centre"] = single["modal_centre"]
    one, other = (
        run(written(tmp_path / f"{n}.h5", a)) for n, a in enumerate((single, axis))
    )
    assert one.contacts > 0
    same(one, other, 0.0)


def test_the_order_of_a_tip_s_points_does_not_matter(tmp_path):
    arrays = by_modes(rotor(stations=np.zeros(3)))
    order = [1, 2, 0]
    turned = {n: arrays[n][:, order] for n in
              ("modal_tip_radial", "modal_tip_tangential")}  # fmt: skip
    turned |= {n: arrays[n][order] for n in ("tip_angle", "tip_gap")}
    marches = [
        March(resolve(scene(written(tmp_path / f"{n}.h5", a))))
        for n, a in enumerate((arrays, arrays | turned))
    ]
    one, other = (march.run() for march in marches)
    assert one.contacts == other.contacts > 0
    same(one, other, 1e-9, ("centre", "energy", "casing", "blade_impulse"))
    points = [march.state.impulse.reshape(N, 3) for march in marches]
    assert points[1] == pytest.approx(points[0][:, order], rel=1e-9, abs=1e-12)


def test_a_casing_of_one_axial_mode_moves_as_the_ring(tmp_path):
    ring = SHELL | {"discretization": "fourier", "gap": FAST["gap"]}
    arrays = arrays_in(exported(tmp_path / "ring.h5", ring), "casing")
    table = {n: a for n, a in arrays.items() if n.startswith("modal_")}
    wide = {n: np.column_stack([table[n]] * 3) for n in
            ("modal_radial", "modal_tangential")}  # fmt: skip
    file = written(tmp_path / "stage.h5", rotor())
    written(file, table | wide | {"station": [-0.05, 0.0, 0.05]}, "casing")
    one, other = (run(file, discretization=d) for d in ("file", "fourier"))
    assert one.contacts > 0
    same(one, other, 1e-11)


def going_on(march, stage, scheme):
    """Return the motion 300 steps after that of a march, by another scheme."""
    following = March(resolve(scene(stage, force=0.0, scheme=scheme)), march.motion())
    following.reach(300)
    return following.motion()


def test_a_march_goes_on_from_the_motion_of_another(stage):
    for first in ("modal", "general"):
        march = March(resolve(scene(stage, scheme=first)))
        march.reach(1200)
        assert march.counter[1] > 0
        wanted = going_on(march, stage, "paper")
        for scheme in ("modal", "general"):
            found = going_on(march, stage, scheme)
            for a, b in zip(found[:4], wanted[:4], strict=True):
                assert np.abs(a - b).max() < 1e-9 * np.abs(b).max()


def bits(march):
    """Return what a march leaves behind, as bytes."""
    parts = *march.state[:2], march.state.impulse, march.state.ledger, march.state.known
    return [part.tobytes() for part in (*parts, march.tracks.tips, march.tracks.casing)]


def seen_everywhere(march):
    """Return a march that reads all gaps in all steps."""
    march.scheme.arrays.rotor.drift[:] = 1.0
    return march


def heavier(arrays, share=1.02):
    """Return arrays of a rotor whose first blade is heavier."""
    mass, own = arrays["mass"].copy(), arrays["tip_radial"][0]
    rows = np.append(own, own + 1)
    mass[rows, rows] *= share
    return arrays | {"mass": mass, "damping": None}


@pytest.mark.parametrize("sectors", [turning, lambda a: heavier(turning(a))])
@pytest.mark.parametrize("rotation", ["none", "full"])
def test_slices_and_unread_gaps_change_no_bit(tmp_path, rotation, sectors):
    file = written(tmp_path / "stage.h5", sectors(rotor()))
    case = resolve(scene(file, rotation=rotation, suspension_damping=-1.0))
    one, other, third = March(case), March(case), seen_everywhere(March(case))
    for march in (one, third):
        march.reach(2000)
    for goal in (7, 133, *range(200, 2001, 23), 2000):
        other.reach(goal)
    assert one.counter[1] > 10
    assert bits(one) == bits(other) == bits(third)


@pytest.mark.parametrize("own", [{}, {"kind": "rigid", "amplitude": 1.2e-4}, {
    "rotation": "full", "suspension_damping": -1.0, "pulse": 4e-3, "force": 3e4,
    "gap": 3e-5,
}])  # fmt: skip
def test_waves_and_modes_move_alike_with_the_same_works(tmp_path, own):
    file = written(tmp_path / "stage.h5", turning(rotor()))
    one, other = (run(file, scheme=s, **own) for s in ("modal", "general"))
    assert one.contacts == other.contacts > 0
    same(one, other, 1e-9, (*TRACES[:4], *TRACES[5:], "fed", "friction", "lost"))
    assert one.casing == pytest.approx(other.casing, rel=1e-9, abs=1e-15)
    assert one.slip == pytest.approx(other.slip, rel=1e-9)


@pytest.fixture
def drawn(tmp_path, monkeypatch):
    """Return a function from a seed to a file of a drawn stage, and its inputs."""

    def draw(seed, *, equal):
        random = np.random.default_rng(seed)
        blades, count = (3, 4, 5, 6, 9)[seed % 5], int(random.integers(2, 5))
        monkeypatch.setattr(stages, "N", blades)
        arrays = rotor(
            np.sort(random.uniform(-0.03, 0.03, count)),
            random.uniform(-0.05, 0.05, count), random.uniform(0.0, 4e-5, count), seed,
        )  # fmt: skip
        full = {"rotation": "full", "suspension_damping": -1.0}
        shape = {"kind": "rigid", "amplitude": 1.2e-4}
        given = {
            "blades": blades, "speed": float(random.uniform(-400.0, 400.0)),
            "friction": float(random.uniform(0.0, 0.4)), "nodal_diameter": 1 + seed % 3,
            "gap": float(random.uniform(4e-5, 1e-4)), "force": 9e4,
        } | (full if seed % 2 else {}) | (shape if seed % 4 == 0 else {})  # fmt: skip
        arrays = turning(arrays if equal else heavier(arrays))
        return written(tmp_path / f"drawn{seed}{equal}.h5", arrays), given

    return draw


def both_marched(file, **given):
    """Return the march by `modal`, its history, and that by `general`."""
    one = March(resolve(scene(file, scheme="modal", **given)))
    return one, one.run(), run(file, scheme="general", **given)


MORE = (pytest.param(seed, marks=pytest.mark.evidence) for seed in range(5, 10))


@pytest.mark.turns
@pytest.mark.parametrize("seed", [*range(5), *MORE])
@pytest.mark.parametrize("equal", [True, False])
def test_drawn_stages_move_as_in_the_static_frame(drawn, seed, equal):
    file, given = drawn(seed, equal=equal)
    one, history, other = both_marched(file, **given)
    rows = SectorRows if equal else PointRows
    assert isinstance(one.scheme.arrays.rotor.rows, rows)
    assert history.contacts == other.contacts > 0
    assert history.gap_error < 1e-12
    names = "tips", "energy", "impulse", "blade_impulse", "fed", "friction", "lost"
    same(history, other, 3e-11, names)
    moved = np.abs(other.tips).max()  # a lobed motion leaves the centre at rest
    assert np.abs(history.centre - other.centre).max() < 3e-11 * moved


@pytest.mark.parametrize(("apart", "rows"), [(1e-9, SectorRows), (1e-6, PointRows)])
def test_sectors_that_differ_by_round_off_move_as_equal_ones(tmp_path, apart, rows):
    """What light points leave of the equality of modes changes nothing."""
    arrays, random = turning(rotor()), np.random.default_rng(5)
    own = np.sqrt(1 + apart * random.uniform(-1.0, 1.0, len(arrays["mass"])))
    arrays |= {"mass": own[:, None] * arrays["mass"] * own, "damping": None}
    file = written(tmp_path / "nearly.h5", arrays)
    given = {"rotation": "full", "suspension_damping": -1.0}
    one, history, other = both_marched(file, **given)
    assert isinstance(one.scheme.arrays.rotor.rows, rows)
    assert history.contacts == other.contacts > 0
    assert abs(history.ledger["residual"]) < 1e-12 * history.ledger["pulse"]
    assert history.gap_error < 1e-12
    same(history, other, 30 * apart + 1e-10, (*TRACES[:5], "fed"))


@pytest.mark.parametrize("rotation", ["none", "full"])
def test_unlike_nodal_diameters_have_no_energy_in_common(tmp_path, rotation):
    """So a sample costs the entries of each diameter only."""
    file = written(tmp_path / "stage.h5", turning(rotor()))
    march = March(resolve(scene(file, rotation=rotation, suspension_damping=-1.0)))
    arrays = march.scheme.arrays.rotor
    half = len(arrays.ahead) // 2
    blocks = np.split(arrays.energy.which, arrays.energy.starts[1:-1])
    assert len(blocks) > N // 2
    for block in blocks:
        own = block[block != 0]  # without padding
        assert len(set((own % half % widths(N)[0]).tolist())) <= 1


@pytest.mark.parametrize("apart", [0.0, 1e-14, 1e-9])
def test_nearly_dependent_points_of_equal_sectors_move_alike(tmp_path, apart):
    near = repeated(one_point(by_modes(rotor())), np.zeros(3))
    factors = 1 + apart * np.array([-1.0, 0.3, 1.0])[:, None]
    for name in ("modal_tip_radial", "modal_tip_tangential"):
        near[name] = near[name] * factors
    file = written(tmp_path / "near.h5", near)
    one, history, other = both_marched(file)
    assert isinstance(one.scheme.arrays.rotor.rows, SectorRows)
    assert history.contacts > 0  # which of the points carries is not unique
    same(history, other, 100 * apart + 1e-11, (*TRACES[:5], "fed"))
    assert history.gap_error < 1e-9


REFUSED = [
    ({"gap_at": "rest", "rotation": "full"}, "gap_at must be speed with 3 contact"),
    ({"contact_law": "archard"}, "casing.contact_law must be rigid where tips have"),
    ({"casing.width": 0.07}, "rotor/tip_station 0.04 m, beyond the casing, which"),
]


@pytest.mark.parametrize(("settings", "told"), REFUSED)
def test_what_several_points_do_not_allow_is_told(tmp_path, settings, told):
    file = written(tmp_path / "stage.h5", turning(rotor()))
    with pytest.raises(InputError, match=told) as caught:
        March(resolve(scene(file, suspension_damping=-1.0, **settings)))
    assert len(str(caught.value).splitlines()) == 1


def test_exact_hands_several_points_over_to_modal(tmp_path):
    file = written(tmp_path / "stage.h5", turning(rotor()))
    exact, modal = (
        March(resolve(scene(file, suspension_damping=-1.0, scheme=s)))
        for s in ("exact", "modal")
    )
    assert "several contact points" in exact.case.handed_over
    for march in (exact, modal):
        march.advance(10**9)
    assert modal.counter[contact.TOUCHED] > 0
    assert_same_bits(exact, modal)


def test_a_profile_may_not_reach_into_the_casing(tmp_path):
    arrays = rotor(gaps=[-2e-4, 0.0, 0.0])
    with pytest.raises(InputError, match=r"gap must be >= 0\.0002 m"):
        run(written(tmp_path / "stage.h5", arrays))


@pytest.mark.parametrize("gap", [{}, {"offset": 2e-5, "offset_angle": 0.7}])
def test_points_are_run_up_with_rotation(tmp_path, gap):
    """A speed that hardly changes is a constant one; slices change no bit."""
    file = written(tmp_path / "turning.h5", turning(rotor()))
    given = {"rotation": "full", "scheme": "general"} | gap
    held = run(file, **given)
    moving = run(file, **given, acceleration=1e-7)
    assert moving.contacts == held.contacts > 0
    same(moving, held, 1e-7)
    fast = given | {"acceleration": 1e3}
    whole = run(file, **fast)
    ledger = dict(whole.ledger)
    residual = abs(ledger.pop("residual"))
    assert residual < 1e-11 * sum(map(abs, ledger.values()))
    cut = March(resolve(scene(file, **fast)))
    while not cut.done:
        cut.advance(97)
    same(cut.history(), whole, 0.0)
