"""Figures of real campaigns: every kind, its axes and units, and its refusals."""

import itertools
import re
import sys
from pathlib import Path
from types import SimpleNamespace

import jeffcott
import numpy as np
import pytest
from launch import ended
from paper import figures as paper_figures
from paper import text as paper_text
from paper import veering
from paper.text import REASONS, with_reason
from synthetic import grid_of, synthetic

from hpcwhirl.analysis import rotation
from hpcwhirl.analysis.critical import coincidences
from hpcwhirl.analysis.rotation import critical_of, own_waves, waves_over
from hpcwhirl.campaign.simulate import simulate
from hpcwhirl.case.resolve import resolve
from hpcwhirl.cli import main
from hpcwhirl.dynamics.bodies.operators import rods_of
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.families import first_family, modal_table
from hpcwhirl.reduction.waves import unbalance_speeds, wave_lines
from hpcwhirl.report.figures import (
    frequencies,
    kinds,
    motions,
    shapes,
    sweeps,
    tips,
)
from hpcwhirl.report.figures.shaft_waves import THIN
from hpcwhirl.report.map.critical import speeds_of
from hpcwhirl.scene import Rotor, Scene, apply_settings
from hpcwhirl.scene.words import SHOWN
from hpcwhirl.store.reading.results_file import Results

SCRIPTS = Path(__file__).parents[2] / "scripts"
FULL = """
[scene]
duration = 0.1
[output]
traces = "full"
[solver]
time_step = 4e-6
[sweep]
speed = [410, 300, 520]
"""


@pytest.fixture(scope="module")
def full(tmp_path_factory):
    place = tmp_path_factory.mktemp("full")
    (place / "full.toml").write_text(FULL)
    words = ["campaign", str(place / "full.toml"), "--out", str(place / "out")]
    assert main([*words, "--map=no", "--report=no"]) == 0
    return place / "out"


@pytest.fixture(scope="module")
def cases(full):
    return Results(full)


def texts(figure):
    """Every title and axis label of a figure."""
    out = [a.get_title() + a.get_xlabel() + a.get_ylabel() for a in figure.axes]
    return " ".join(out)


@pytest.mark.turns
def test_rows_and_traces_are_those_of_the_case(cases):
    assert [row["speed"] for row in cases.rows] == [410.0, 300.0, 520.0]
    assert cases.like(0) == [1, 0, 2]
    scene = cases.scene(1)
    assert (scene.speed, scene.output.traces) == (300.0, "full")
    own = simulate(scene).traces["casing"]
    assert np.array_equal(cases.traces(1)["casing"], own)
    result = simulate(scene)
    traces = cases.traces(1)
    assert traces.keys() == result.traces.keys()
    for name, values in result.traces.items():
        assert np.allclose(traces[name], values, rtol=1e-14, atol=0), name
    assert cases.rows[1]["late_friction"] == result.row["late_friction"]
    assert cases.value(1, "gap") == scene.gap


def test_the_rotating_frame_undoes_the_static_one(cases):
    traces, row = cases.traces(0), cases.rows[0]
    turned = motions.rotating(traces, row["speed"]) @ [1, 1j]
    again = turned * np.exp(1j * row["speed"] * traces["time"])
    assert again == pytest.approx(traces["centre"] @ [1, 1j], abs=1e-15)


@pytest.mark.turns
def test_a_kind_is_drawn_of_the_case_that_was_asked_for(full, tmp_path, capsys):
    words = ["--kind", "cascade", "--kind", "ledger", "--case", "2"]
    assert main(["figures", str(full), "--out", str(tmp_path), *words]) == 0
    lines = capsys.readouterr().out.split()
    assert [Path(li).name for li in lines] == ["cascade.png", "ledger-0002.png"]


@pytest.fixture(scope="module")
def usual():
    """Return the kinds that `full` has figures of, unless some are asked for."""
    drawn = {name: kind for name, kind in kinds.KINDS.items() if not kind.asked}
    assert drawn.pop("branches").of == "branches"  # this campaign has no [branch]
    assert drawn.pop("waterfall").speed == "changing"  # and its speed is constant
    return drawn


@pytest.mark.slow
def test_every_kind_is_drawn(full, tmp_path, capsys, usual):
    assert main(["figures", str(full), "--out", str(tmp_path), "--case", "1"]) == 0
    lines = [Path(line) for line in capsys.readouterr().out.splitlines()]
    made = [path for path in lines if path.suffix == ".png"]
    assert sorted(made) == sorted(tmp_path.iterdir())
    assert sorted(path.stem.partition("-")[0] for path in made) == sorted(usual)
    assert all(path.stat().st_size > 5000 for path in made)


def test_each_kind_has_a_figure_or_one_of_each_case(
    full, tmp_path, capsys, usual, monkeypatch
):
    monkeypatch.setattr(kinds, "_drawn", lambda *given, **_: given[-1])
    assert main(["figures", str(full), "--out", str(tmp_path)]) == 0
    lines = [Path(line).name for line in capsys.readouterr().out.splitlines()]
    made = [name for name in lines if name.endswith(".png")]
    ends = {name: [f"-{n:04d}" * (kind.of == "case") for n in range(3)]
            for name, kind in usual.items()}  # fmt: skip
    expected = {f"{name}{end}.png" for name in ends for end in ends[name]}
    assert sorted(made) == sorted(expected)


def test_help_names_every_kind(capsys):
    with pytest.raises(SystemExit):
        main(["figures", "--help"])
    help_text = " ".join(capsys.readouterr().out.split())
    told = re.findall(r"\w+", help_text.partition("over the speed:")[2])
    assert set(kinds.KINDS) <= set(told)


@pytest.mark.turns
def test_traces_that_were_not_kept_are_one_clear_line(finished, tmp_path, capsys):
    words = ["figures", str(finished), "--out", str(tmp_path)]
    asked = ["--kind", "contributions", "--kind", "tips", "--kind", "orbit"]
    assert main([*words, *asked]) == 0
    lines = capsys.readouterr().out.splitlines()
    for name, line in zip(("contributions", "tips"), lines, strict=False):
        assert re.search(f"^{name}: needs traces = full; .* not keep tips$", line)
    assert [Path(li).name for li in lines[2:]] == ["orbit-0000.png", "orbit-0001.png"]


def test_maps_of_tips_show_the_displacements_in_the_window(cases):
    traces, row = cases.traces(0), cases.rows[0]
    late = motions.in_window(traces["time"], row)
    axes = tips.draw_tips(cases, 0).axes
    for part, panel in enumerate(axes[:2]):
        factor, unit = motions.unit_of(np.abs(traces["tips"][late, :, part]).max())
        shown = panel.collections[0].get_array()
        assert np.array_equal(shown, factor * traces["tips"][late, :, part].T)
        told = f"{tips.DIRECTIONS[part]}, {unit}"
        assert axes[2 + part].get_ylabel().startswith(told)


@pytest.mark.parametrize(
    ("words", "said"),
    [(["--kind", "orbits"], "did you mean 'orbit'"),
     (["--case", "7"], "--case must be a finished case, 0 to 2, got 7")],
)  # fmt: skip
def test_what_cannot_be_drawn_is_refused(full, tmp_path, capsys, words, said):
    assert main(["figures", str(full), "--out", str(tmp_path), *words]) == 2
    assert said in capsys.readouterr().err
    assert not any(tmp_path.iterdir())


def test_a_directory_without_results_is_one_line(tmp_path, capsys):
    assert main(["figures", str(tmp_path)]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1


def test_orbits_show_the_window_alone_unless_asked(cases):
    static, rotating = motions.draw_orbits(cases, 0).axes
    late = motions.in_window(cases.traces(0)["time"], cases.rows[0])
    drawn = {line.get_label(): len(line.get_xdata()) for line in static.lines}
    assert drawn["window of the words"] == late.sum()
    assert "transient" not in drawn
    assert "static frame" in static.get_xlabel()
    assert "rotating frame" in rotating.get_xlabel()
    asked = motions.draw_orbits(cases, 0, transient=True).axes[0]
    drawn = {line.get_label(): len(line.get_xdata()) for line in asked.lines}
    assert drawn["transient"] == (~late).sum()


def test_the_orbit_drawn_is_the_one_kept_in_its_unit(cases):
    axes = motions.draw_orbits(cases, 0, transient=True).axes[0]
    factor = {"mm": 1e3, "µm": 1e6, "nm": 1e9}[axes.get_label()]
    late = motions.in_window(cases.traces(0)["time"], cases.rows[0])
    line = next(li for li in axes.lines if li.get_label() == "window of the words")
    assert line.get_xydata() == pytest.approx(factor * cases.traces(0)["centre"][late])


def test_energies_are_on_a_logarithmic_axis_and_none_is_lost(cases):
    """What is negative is dashed: with the solid part it is all that was kept."""
    figure = motions.draw_ledger(cases, 0)
    (axes,) = figure.axes
    assert axes.get_yscale() == "log"
    traces = cases.traces(0)
    parts = {"fed by transport over the ring": traces["fed"] - traces["rubbed"],
             "lost in damping and impacts": traces["lost"]}  # fmt: skip
    lines = {line.get_label(): np.asarray(line.get_ydata()) for line in axes.lines}
    for name, values in parts.items():
        drawn = np.nan_to_num(lines[name])
        drawn = drawn - np.nan_to_num(lines.get(f"{name}, negative", 0.0 * drawn))
        assert drawn == pytest.approx(values[:: len(values) // len(drawn)])


def test_the_gap_is_seen_over_an_orbit_and_its_legend_hides_no_curve(cases):
    """The dashed circle lies above the path, on white; legends stand beside axes."""
    static, _ = motions.draw_orbits(cases, 0, transient=True).axes
    gap = next(line for line in static.lines if line.get_label() == "gap")
    others = [line.get_zorder() for line in static.lines if line is not gap]
    assert gap.get_zorder() > max(others)
    assert gap.get_path_effects()
    figure = motions.draw_traces(cases.traces(0), cases.rows[0])
    figure.canvas.draw()
    for panel in figure.axes:
        inside = panel.get_window_extent()
        assert panel.get_legend().get_window_extent().x0 >= inside.x1


@pytest.mark.parametrize(("gaps", "drawn"), [(0.1, False), (0.3, True)])
def test_an_orbit_far_smaller_than_the_gap_is_drawn_without_it(gaps, drawn):
    from matplotlib.figure import Figure

    turn = np.linspace(0, 2 * np.pi, 99)
    path, axes = np.column_stack([np.cos(turn), np.sin(turn)]), Figure().subplots()
    motions.draw_orbit(axes, path, turn >= 0.0, 1.0 / gaps, transient=False)
    told = [line.get_label() for line in axes.lines]
    assert ("gap" in told, any("outside" in one for one in told)) == (drawn, not drawn)


@pytest.mark.parametrize(("samples", "coarse"), [(12, True), (60, False)])
def test_the_samples_of_an_orbit_are_shown_where_they_are_few(samples, coarse):
    """A circle of 12 samples turns by 30 degrees from one to the next."""
    from matplotlib.figure import Figure

    turn = np.linspace(0, 6 * np.pi, 3 * samples, endpoint=False)
    path = 1e-3 * np.column_stack([np.cos(turn), np.sin(turn)])
    axes = Figure().subplots()
    every = np.ones(len(path), dtype=bool)
    motions.draw_orbit(axes, path, every, 1e-3, transient=False)
    label = axes.lines[0].get_label()
    assert ("dots are samples" in label) == coarse
    assert (axes.lines[0].get_marker() == ".") == coarse


@pytest.mark.parametrize(
    ("largest", "unit"),
    [(2e-3, "mm"), (2e-4, "mm"), (3e-6, "µm"), (1e-9, "nm"), (0, "pm")],
)
def test_lengths_are_told_in_a_unit_of_their_size(largest, unit):
    assert motions.unit_of(largest)[1] == unit


def test_a_ledger_of_nothing_says_so(cases, monkeypatch):
    traces = {n: (n == "time") * values for n, values in cases.traces(0).items()}
    monkeypatch.setattr(cases, "traces", lambda _: traces)
    (axes,) = motions.draw_ledger(cases, 0).axes
    assert axes.texts[0].get_text().startswith("no contact")


@pytest.mark.turns
def test_amplitudes_and_frames_are_told(cases):
    line = cases.like(0)
    told = texts(sweeps.draw_frequency(cases, line))
    assert "frequency, Hz (rotating frame)" in told
    assert "amplitude, mm (peak of the sine)" in told
    told = texts(sweeps.draw_cascade(cases, line))
    assert "static frame:\nbackward < 0 < forward" in told
    assert "m √kg" in texts(motions.draw_contributions(cases, 0))
    assert "N s" in texts(tips.draw_contacts(cases, 0))
    assert "J, cumulative" in texts(motions.draw_ledger(cases, 0))


def test_regimes_lie_under_the_interaction_diagram(cases):
    line = cases.like(0)
    diagram, strip = frequencies.draw_interaction(cases, line).axes
    words = [SHOWN[frequencies.shown_word(cases.rows[i])].letter for i in line]
    equal = [letter for letter, _ in itertools.groupby(words)]
    assert [text.get_text() for text in strip.texts] == equal
    assert len(strip.patches) == len(equal)
    told = [t.get_text() for t in diagram.texts]
    assert told[0].startswith("Eq. 13: 27")  # the first cell begins below it
    assert told[-1].startswith("n = 12")
    assert "casing's frame" in diagram.get_ylabel()


def test_the_interaction_diagram_marks_the_suspension_too(cases, monkeypatch):
    soft = apply_settings(cases.scene(0), {"centre_stiffness": 1.7e7})
    monkeypatch.setattr(cases, "scene", lambda _: soft)
    axes = frequencies.draw_interaction(cases, cases.like(0)).axes[0]
    told = [t.get_text() for t in axes.texts]
    own = {row["family"]: row["speed"] for row in speeds_of(soft) if row["order"] == 1}
    assert f"Eq. 13, suspension: {own['suspension']:.0f} rad/s" in told
    assert sum(t.startswith("Eq. 13") for t in told) == 2
    table = modal_table(resolve(soft).model)
    waves, casing = own_waves(table, 1), first_family(table, "casing")
    at = {  # in view, of the first two multiples of the casing's frequency
        (family, row["order"]): row["speed"] for family in ("1F", "suspension")
        for row in coincidences({1: waves[family]}, casing, 2) if row["side"] == -1
    }  # fmt: skip
    marks = [li.get_xdata()[0] for li in axes.lines if li.get_marker() == "o"]
    marked = {key for key, speed in at.items() if np.isclose(speed, marks).any()}
    assert marked == {("1F", 1), ("1F", 2), ("suspension", 1)}


@pytest.mark.turns
def test_with_rotation_the_interaction_diagram_marks_eq_13_of_its_lobes(
    cases, monkeypatch
):
    turning = apply_settings(cases.scene(0), {"rotation": "full"})
    monkeypatch.setattr(cases, "scene", lambda _: turning)
    line = cases.like(0)
    axes = frequencies.draw_interaction(cases, line).axes[0]
    low, high = axes.get_xlim()
    lobes = turning.nodal_diameter
    rows = [r for r in critical_of(resolve(turning), 12) if low <= r["speed"] <= high]
    own, others = (
        {r["speed"] for r in rows if (r["nodal_diameter"] == lobes) == same}
        for same in (True, False)
    )
    marks = {li.get_xdata()[0] for li in axes.lines if li.get_marker() == "o"}
    assert own == marks
    assert others - marks


def test_measured_growth_stands_beside_the_linear_check(cases):
    upper, lower = sweeps.draw_growth(cases, cases.like(0)).axes
    marks = {SHOWN[frequencies.shown_word(row)].marker for row in cases.rows}
    dots = [li for li in upper.lines if li.get_marker() in marks]
    drawn = [(li.get_xdata()[0], li.get_ydata()[0]) for li in dots]
    assert sorted(drawn) == sorted((r["speed"], r["growth_rate"]) for r in cases.rows)
    rubbed = next(li for li in lower.lines if li.get_label() == "friction")
    row = cases.rows[1]
    assert rubbed.get_ydata()[0] == row["late_friction"] / row["late_lost"]


WORDED = [sweeps.draw_growth, sweeps.draw_bifurcation, frequencies.draw_interaction]


@pytest.mark.parametrize("draw", WORDED)
def test_words_over_the_speed_differ_without_colour(cases, draw, monkeypatch):
    """In markers, or in letters of the cells."""
    line, words = cases.like(0), ["sustained", "divergent", "undecided"]
    made = dict(zip((cases.rows[i]["speed"] for i in line), words, strict=True))
    for module in (sweeps, frequencies):
        monkeypatch.setattr(module, "shown_word", lambda row: made[row["speed"]])
    figure = draw(cases, line)
    drawn = {li.get_marker() for axes in figure.axes for li in axes.lines}
    letters = {text.get_text() for axes in figure.axes for text in axes.texts}
    for word in words:
        look = SHOWN[word]
        assert look.marker in drawn or look.letter in letters
    (legend,) = figure.legends
    told = {text.get_text().rpartition("  ")[2] for text in legend.get_texts()}
    assert {SHOWN[word].told for word in words} <= told


def test_a_clamped_centre_moves_only_nodal_diameter_one():
    free = veering.frequencies(veering.full_rotor(Rotor()))
    held = veering.frequencies(veering.full_rotor(Rotor(), clamped=True))
    for (k, family), hertz in held.items():
        if k != 1:
            assert hertz == pytest.approx(free[k, family], rel=1e-9)
    assert abs(held[1, "2F"] / free[1, "2F"] - 1) > 0.01
    assert (1, "suspension") not in held


@pytest.mark.turns
def test_shapes_and_veering_are_drawn(tmp_path):
    for name, figure in (
        ("shapes", shapes.draw_shapes(Rotor())),
        ("veering", veering.draw_veering(Rotor())),
    ):
        assert kinds.save(figure, tmp_path / f"{name}.png").stat().st_size > 5000
    assert "k = 1, f = 40.77 Hz" in texts(shapes.draw_shapes(Rotor()))


def test_the_casing_stands_around_the_shapes_of_every_diameter():
    """A ring's k lobes: its radius has k maxima around, and k = 1 moves it as one."""
    scene = apply_settings(Scene(), {"blades": 8})
    figure = shapes.draw_shapes_of(scene)
    titles = [a.get_title().split(",")[0] for a in figure.axes]
    assert titles == ["k = 0", "k = 1", "k = 2", "k = 3", "k = 4"]
    ring_of = first_family(modal_table(resolve(scene).model), "casing")  # rad/s
    for k, axes in enumerate(figure.axes):
        (ring,) = (a for a in axes.lines if "casing" in str(a.get_label()))
        z = np.array(ring.get_data()).T[:-1] @ [1.0, 1j]
        lobes = np.abs(np.fft.rfft(np.abs(z - z.mean())))[1:]
        if k > 1:
            assert 1 + np.argmax(lobes) == k
        assert (abs(z.mean()) > 1e-3) == (k == 1)
        hertz = ring_of[k] / (2 * np.pi)
        assert axes.get_title().endswith(f"\ncasing {hertz:.2f} Hz")
        spokes = [a for a in axes.lines if len(a.get_xdata()) == 2]
        assert len(spokes) == 2 * 8  # at rest and moved


@pytest.mark.turns
def test_a_legend_stands_beside_what_is_drawn(cases):
    line = cases.slices()[0]
    drawn = [
        frequencies.draw_interaction(cases, line), sweeps.draw_growth(cases, line),
        frequencies.draw_campbell(cases.scene(0), cases["speed"]),
    ]  # fmt: skip
    for figure in drawn:
        figure.draw_without_rendering()
        (legend,) = figure.legends
        box = legend.get_window_extent()
        assert all(not box.overlaps(a.get_tightbbox()) for a in figure.axes)
        assert not any(a.get_legend() for a in figure.axes)


def test_a_rigid_casing_has_no_interaction_diagram(cases, monkeypatch):
    rigid = apply_settings(cases.scene(0), {"kind": "rigid"})
    monkeypatch.setattr(cases, "scene", lambda _: rigid)
    with pytest.raises(InputError, match="elastic casing"):
        frequencies.draw_interaction(cases, [0])


@pytest.fixture(scope="module")
def stiff(tmp_path_factory):
    """A compressor: blades eight times as thick, 1F far above the paper's, two gaps."""
    place = tmp_path_factory.mktemp("stiff")
    (place / "stiff.toml").write_text(
        FULL.replace("[410, 300, 520]", "[800, 1600]\ngap = [1.28e-4, 2.56e-4]")
        .replace("0.1", "0.03").replace("4e-6", "2e-6")
        + "[engine.rotor]\nroot_thickness = 0.085\n"
    )  # fmt: skip
    words = ["campaign", str(place / "stiff.toml"), "--out", str(place / "out")]
    assert main([*words, "--map=no", "--report=no"]) == 0
    return place / "out"


@pytest.mark.turns
def test_spectra_of_a_tip_have_engine_orders_and_own_frequencies(stiff):
    cases = Results(stiff)
    line = cases.slices()[0]
    lines = sweeps.draw_frequency(cases, line).axes[0].get_lines()
    orders = [own for own in lines if own.get_linestyle() == "-"]
    assert len(orders) > 2
    for n, own in enumerate(orders, 1):
        speeds, hertz = own.get_data()
        assert hertz == pytest.approx(n * speeds / (2 * np.pi))
    named = {str(own.get_label()) for own in lines if own.get_linestyle() == "--"}
    assert {"1F, ω(Ω)", "2F, ω(Ω)"} <= named
    table = modal_table(resolve(cases.scene(0)).model)
    low = min(first_family(table, "rotor").values()) / (2 * np.pi)
    first = next(own for own in lines if own.get_label() == "1F, ω(Ω)")
    assert first.get_ydata() == pytest.approx(low)


def test_ranges_are_those_of_the_engine(stiff):
    cases = Results(stiff)
    line = cases.slices()[0]
    table = modal_table(resolve(cases.scene(0)).model)
    first = first_family(table, "rotor")
    hertz = max(first.values()) / (2 * np.pi)
    assert hertz > 250
    frequency = sweeps.draw_frequency(cases, line).axes[0]
    assert frequency.get_ylim()[1] > hertz
    diagram = frequencies.draw_interaction(cases, line).axes[0]
    low, high = diagram.get_ylim()
    speeds = [cases.rows[i]["speed"] for i in line]
    assert high > max(speeds) + first[1]
    assert low < min(speeds) - first[1]
    cascade = sweeps.draw_cascade(cases, line).axes[0]
    assert cascade.get_ylim()[1] > first[1] + max(speeds)


def test_a_run_that_stopped_has_the_samples_up_to_there(stiff):
    cases = Results(stiff)
    stopped = [i for i in cases.finished() if cases.rows[i]["stop"] == "amplitude"]
    assert stopped
    for case in stopped:
        row, traces = cases.rows[case], cases.traces(case)
        last = traces["time"][-1]
        assert last <= row["end_time"] < last + row["sample_interval"]
        for name, values in traces.items():
            assert np.isfinite(values).all(), name


def test_no_axis_of_frequency_is_beyond_what_the_samples_tell(cases, monkeypatch):
    line = cases.like(0)
    rows = [row | {"sample_interval": 5e-3} for row in cases.rows]
    monkeypatch.setattr(cases, "rows", rows)
    assert frequencies.rotating_top(cases, line) == 100.0
    assert frequencies.centre_top(cases, line) == pytest.approx(2 * np.pi * 100.0)


@pytest.mark.turns
def test_each_line_of_speeds_has_a_file_of_its_own(stiff, tmp_path, capsys):
    words = ["figures", str(stiff), "--kind", "interaction", "--out", str(tmp_path)]
    assert main(words) == 0
    names = ["interaction-gap=0.000128.png", "interaction-gap=0.000256.png"]
    assert sorted(p.name for p in tmp_path.iterdir()) == names
    capsys.readouterr()
    assert main([*words, "--at", "gap=2.56e-4"]) == 0
    assert capsys.readouterr().out.split() == [str(tmp_path / names[1])]


def test_figures_that_draw_nothing_are_wrong_input(finished, tmp_path, capsys):
    words = ["figures", str(finished), "--out", str(tmp_path), "--kind", "contacts"]
    assert main(words) == 2
    told = capsys.readouterr()
    assert "needs traces = full" in told.out
    assert "could be drawn" in told.err


@pytest.mark.turns
def test_the_engine_has_shapes_and_a_campbell_diagram(finished, tmp_path):
    words = ["figures", str(finished), "--out", str(tmp_path)]
    assert main([*words, "--kind", "shapes", "--kind", "campbell"]) == 0
    assert {p.name for p in tmp_path.iterdir()} == {"shapes.png", "campbell.png"}
    axes = frequencies.draw_campbell(Scene(), np.array([200.0, 500.0])).axes[0]
    named = [t for t in axes.texts if t.get_text() == "Eq. 13: 271 rad/s"]
    assert [t.get_bbox_patch().get_facecolor()[:3] for t in named] == [(1, 1, 1)]
    assert axes.get_ylabel() == "frequency, Hz (rotating frame)"


def test_a_mistuned_rotor_has_no_shapes_by_diameter():
    scene = apply_settings(Scene(), {"mistuning": [0.01] + [0.0] * 21})
    with pytest.raises(InputError, match="equal blades"):
        shapes.draw_shapes_of(scene)


def test_misses_come_first_and_numbers_are_judged_by_their_tolerance():
    near, far, none = (
        paper_text.number("Fig. 1", "a frequency", 100.0, here, "Hz", 0.01)
        for here in (100.9, 101.1, float("nan"))
    )
    assert [s.verdict for s in (near, far, none)] == [
        "agrees",
        "differs",
        "cannot be judged",
    ]
    text = paper_text.page({"one": [near, none, far]}, quick=False)
    assert "3 statements: 1 differ, 1 cannot be judged, 1 agree." in text
    verdicts = re.findall(r"^\| (differs|cannot be judged|agrees) ", text, re.MULTILINE)
    assert verdicts == ["differs", "cannot be judged", "agrees"]
    with pytest.raises(ValueError, match="verdict must be one of"):
        paper_text.Statement("", "", "", "perfect")


def told_of(*verdicts):
    return [
        paper_text.Statement("Fig. 1", f"{i}", "x", v) for i, v in enumerate(verdicts)
    ]


def test_engines_stand_beside_one_another_what_agrees_on_fewest_first():
    yes, no, open_ = "agrees", "differs", "cannot be judged"
    told = {"one": told_of(yes, no, no), "two": told_of(yes, open_, no)}
    text = paper_text.page(told, quick=False)
    assert "one: 3 statements: 2 differ, 0 cannot be judged, 1 agree." in text
    assert "On at least one of them 1 of 3 agree." in text
    assert re.findall(r"^\| Fig. 1 \| (\d)", text, re.MULTILINE) == ["2", "1", "0"]
    assert f"*{no}*: x | *{open_}*: x |" in text
    told["two"].reverse()  # answers to other questions
    with pytest.raises(ValueError, match="different questions"):
        paper_text.page(told, quick=False)


def test_a_reason_stands_beside_a_miss_alone():
    claim, reason = next(iter(REASONS.items()))
    for verdict in paper_text.VERDICTS:
        told = with_reason(paper_text.Statement("Fig. 1", claim, "1 Hz", verdict))
        assert (told.claim, told.verdict) == (claim, verdict)
        assert told.computed.startswith("1 Hz")
        assert (reason in told.computed) == (verdict != "agrees")
    other = paper_text.Statement("Fig. 1", "another", "1 Hz", "differs")
    assert with_reason(other) == other


def test_two_lobes_are_looked_for_where_blades_touch(monkeypatch, tmp_path):
    asked = []

    def computed(_place, document, _engine):
        asked.append((document["scene"]["gap"], document["sweep"]["nodal_diameter"]))
        touches = int(document["scene"]["gap"] < 3e-4)
        return SimpleNamespace(rows=[{"contacts": touches}, {"contacts": touches}])

    monkeypatch.setattr(paper_figures, "computed", computed)
    table1 = paper_figures.designs(paper_figures.QUICK)["table1"]
    for touching, gaps in ((1, []), (0, [5e-4, 2.5e-4])):
        rows = [{"nodal_diameter": 2, "contacts": touching}]
        cases = SimpleNamespace(rows=rows)
        found = paper_figures.two_lobes(cases, tmp_path, table1, "four_motions")
        assert (found is None) == (not gaps)
        assert asked == [(gap, [2]) for gap in gaps]
    assert table1["scene"]["gap"] == 1e-3  # Table 1 is as it was


@pytest.mark.evidence
def test_the_quick_paper_is_whole_and_continues(tmp_path):
    call = [
        sys.executable,
        str(SCRIPTS / "paper/figures.py"),
        "--out",
        str(tmp_path),
        "--quick",
    ]
    done = ended(*call, check=True)
    assert {f"fig{n:02d}.png" for n in range(4, 15)} <= {
        p.name for p in tmp_path.iterdir()
    }
    page = (tmp_path / "paper.md").read_text()
    assert page.count("\n| ") > 50
    assert str(tmp_path / "paper.md") in done.stdout


@pytest.mark.turns
def test_the_campbell_diagram_of_full_rotation_has_its_lines():
    """Waves of k = 1 apart, Eq. 13 with the stiffened blades, the unbalance's speed."""
    scene = apply_settings(Scene(), {"rotation": "full"})
    case, speeds = resolve(scene), np.array([0.0, 270.0, 410.0])
    figure = frequencies.draw_campbell(scene, speeds)
    axes = figure.axes[0]
    assert not axes.title.get_parse_math()  # an engine's name is no formula
    (row,) = [r for r in critical_of(case, 1) if r["nodal_diameter"] == 1]
    assert [t.get_text() for t in axes.texts if "Eq" in t.get_text()] == [
        f"Eq. 13: {row['speed']:.0f} rad/s"
    ]
    lines = {line.get_label(): line for line in axes.lines}
    own = {
        (x.family, "forward" if x.rotating > 0 else "backward"): abs(x.rotating)
        for x in wave_lines(case.model.rotor, 22, 270.0)
        if x.nodal_diameter == 1 and x.family in {"1F", "suspension"}
    }
    assert len(own) == 4
    for (family, way), omega in own.items():
        x, y = lines[f"{family}, k = 1, {way}"].get_data()
        assert np.interp(270.0, x, y) == pytest.approx(omega / (2 * np.pi), rel=2e-3)
    (speed,) = unbalance_speeds(case.model.rotor)
    marked = axes.get_legend_handles_labels()[1]
    assert (f"unbalance: {speed:.0f} rad/s" in marked) == (speed <= axes.get_xlim()[1])
    figure.draw_without_rendering()
    (legend,) = figure.legends
    box = legend.get_window_extent()
    assert box.x0 >= 0.0
    assert box.x1 <= figure.bbox.width
    assert not box.overlaps(axes.get_window_extent())


@pytest.mark.turns
def test_waves_of_the_shaft_have_their_growth_as_colour():
    scene = apply_settings(Scene(), {"rotation": "full", "suspension_damping": -1.0})
    case = resolve(scene)
    axes = frequencies.draw_campbell(scene, np.array([300.0, 620.0])).axes[1]
    found = rotation.shaft_waves_over(case, np.linspace(0.0, axes.get_xlim()[1], 61))
    for waves, way in itertools.product(axes.collections, (0, 1)):
        ends = np.array(waves.get_segments())[:, :, 1] * 2 * np.pi
        rates = [
            found["growth"][name][way]
            for name, pair in found["static"].items()
            if np.allclose(np.abs(pair[way][:-1]), ends[:, 0])
        ]
        for rate in rates:
            middle = (rate[:-1] + rate[1:]) / 2
            assert np.asarray(waves.get_array()) == pytest.approx(middle)
            wide = np.array(waves.get_linewidths()) > THIN
            assert (wide == (middle > 0.0)).all()
    assert any(max(waves.get_linewidths()) > THIN for waves in axes.collections)
    marked = {line.get_label(): line.get_data() for line in axes.lines}
    for kind, speeds in (
        ("damped", [one["speed"] for one in rotation.damped_speeds_of(case)]),
        ("undamped", unbalance_speeds(case.model.rotor)),
    ):
        x, y = marked[f"critical speed, {kind}"]
        assert x == pytest.approx(speeds)
        assert 2 * np.pi * y == pytest.approx(speeds)


def test_waves_over_the_speed_are_those_at_each():
    for kind in ("none", "full"):
        case = resolve(apply_settings(Scene(), {"rotation": kind}))
        found = waves_over(case, 1, np.array([270.0, 410.0]))
        for place, speed in enumerate((270.0, 410.0)):
            lines = wave_lines(case.model.rotor, 22, speed)
            for family, both in found.items():
                own = sorted(
                    x.static
                    for x in lines
                    if (x.nodal_diameter, x.family) == (1, family)
                )
                told = sorted(wave[place] for wave in both)
                assert told == pytest.approx(own, abs=1.0)  # damped, and not


@pytest.mark.turns
def test_the_stability_diagram_shows_who_grows_by_damping_that_turns():
    """T3: Z'' + 2 (xi_s + xi_r) w Z' + (w^2 - 2 i Omega xi_r w) Z = 0 of a stiff rotor.

    The forward whirl grows beyond w (1 + xi_s / xi_r), the backward one never.
    """
    own, turns, stands = jeffcott.OWN, 0.01, 0.005
    scene = jeffcott.stiff(
        7,
        unbalance=0.0,
        **{"rotor.damping": turns, "suspension_damping": turns + stands},
    )
    onset = own * (1 + stands / turns)
    figure = frequencies.draw_stability(scene, np.array([0.0, onset]))
    lines = {line.get_label(): line for line in figure.axes[0].lines}
    speeds, forward = lines["suspension, k = 1, forward"].get_data()
    _, backward = lines["suspension, k = 1, backward"].get_data()
    for speed, ahead, behind in zip(speeds, forward, backward, strict=True):
        last = own**2 - 2j * speed * turns * own
        roots = np.roots([1.0, 2 * (turns + stands) * own, last])
        with_it, against = roots[np.argsort(-roots.imag)].real
        assert ahead == pytest.approx(with_it, abs=2e-3 * own * turns)
        assert behind == pytest.approx(against, abs=2e-3 * own * turns)
    assert np.interp(0.0, forward, speeds) == pytest.approx(onset, rel=2e-3)
    told = figure.axes[0].get_legend_handles_labels()[1]
    assert f"free motion grows from {onset:.0f} rad/s" in told
    figure.draw_without_rendering()


def test_wear_is_drawn_in_micrometres_around_the_casing(cases):
    made = apply_settings(Scene(), {"contact_law": "archard"})
    angle = np.linspace(0, 2 * np.pi, rods_of(made), endpoint=False)
    depth = 3e-6 * (1.0 + np.cos(4 * angle))
    traces = {"worn": np.stack([0.0 * depth, depth]), "time": np.arange(2.0)}
    shown = SimpleNamespace(
        traces=lambda _: traces, rows=cases.rows, scene=lambda _: made
    )
    figure = tips.draw_wear(shown, 0)
    (bars,) = figure.axes[0].patches
    values, edges, _ = bars.get_data()
    assert values == pytest.approx(1e6 * depth)
    assert (edges[0], edges[-1]) == (0.0, 360.0)
    assert "strongest harmonic 4" in figure.axes[0].get_title()
    assert all("µm" in axes.get_ylabel() for axes in (figure.axes[0], figure.axes[2]))
    traces["worn"][:] = 0.0
    with pytest.raises(InputError, match="no rod of the layer was worn"):
        tips.draw_wear(shown, 0)


@pytest.mark.turns
def test_a_case_that_kept_no_traces_is_told_and_in_no_figure(tmp_path, capsys):
    rows = grid_of(speed=[300.0, 310.0], **{"output.traces": ["orbit", "summary"]})
    place = synthetic(tmp_path / "out", rows, samples=500)
    words = ["figures", str(place), "--kind", "orbit", "--kind", "cascade"]
    assert main(words) == 0
    told = capsys.readouterr().out.splitlines()
    drawn = [Path(line).name for line in told if line.endswith(".png")]
    assert drawn == ["orbit-0000.png", "orbit-0002.png", "cascade-traces=orbit.png"]
    why = "needs traces = orbit, not kept here"
    assert [line for line in told if not line.endswith(".png")] == [
        f"orbit, case 1: {why}", f"orbit, case 3: {why}",
        f"cascade, cascade-traces=summary: {why}",
    ]  # fmt: skip


def of_mirrored(values, **inputs):
    """Results of a campaign, and of the same one turning clockwise."""
    back = {n: -v if n in {"speed", "acceleration"} else v for n, v in inputs.items()}
    return [
        SimpleNamespace(
            scene=lambda _, own=own: apply_settings(values.scene(0), own),
            rows=[row | {"speed": sign * row["speed"]} for row in values.rows],
            others=values.others, like=values.like,
        )
        for sign, own in ((1.0, inputs), (-1.0, back))
    ]  # fmt: skip


@pytest.mark.turns
@pytest.mark.parametrize("rotation", ["none", "full"])
def test_the_interaction_diagram_of_a_mirrored_speed_is_mirrored(cases, rotation):
    there, back = of_mirrored(cases, speed=410.0, rotation=rotation)
    line = cases.like(0)
    one = frequencies.draw_interaction(there, line).axes[0]
    other = frequencies.draw_interaction(back, line[::-1]).axes[0]
    marks = [
        sorted((abs(x.get_xdata()[0]), x.get_ydata()[0]) for x in axes.lines
               if x.get_marker() == "o")
        for axes in (one, other)
    ]  # fmt: skip
    assert len(marks[0]) > 3
    assert np.array(marks[1]) == pytest.approx(np.array(marks[0]))
    own = [li for li in one.lines if len(li.get_xdata()) > 2]
    for a, b in zip(own, other.lines, strict=False):
        assert a.get_label() == b.get_label()
        assert b.get_xdata()[::-1] == pytest.approx(-a.get_xdata())
        assert b.get_ydata()[::-1] == pytest.approx(a.get_ydata())


@pytest.mark.turns
def test_the_waterfall_of_a_mirrored_run_up_shows_forward_whirl_above(cases):
    law = {"speed": 300.0, "acceleration": 2000.0, "duration": 0.06}
    shown = []
    for each in of_mirrored(cases, **law):
        result = simulate(each.scene(0))
        each.rows, each.traces = [result.row], lambda _, own=result.traces: own
        figure = sweeps.draw_waterfall(each, 0)
        panels = figure.axes[:2]
        sign = "" if each.scene(0).speed > 0.0 else "-"
        assert f"Ω = {sign}300 to {sign}420 rad/s" in figure.get_suptitle()
        letters = {look.letter for look in SHOWN.values()}
        assert {t.get_text() for axes in panels for t in axes.texts} <= letters
        assert panels[0].texts
        dotted = [
            abs(li.get_xdata()[0]) for li in panels[1].lines if li.get_ls() == ":"
        ]
        low, high = np.abs(panels[1].get_xlim())
        assert all(min(low, high) < at < max(low, high) for at in dotted)
        amplitude = [axes.collections[0].get_array() for axes in panels]
        shown.append((np.array(amplitude[0]), np.array(amplitude[1])[:, ::-1]))
        shown[-1] += (np.array(amplitude[1]),)
    (time, _, speed), (mirrored, turned, _) = shown
    rows = time.sum(axis=1)
    assert np.abs(rows - rows[::-1]).max() > 0.1 * rows.max()  # not the same both ways
    assert mirrored[1:-1] == pytest.approx(time[1:-1], abs=1e-2 * time.max())
    assert turned[1:-1] == pytest.approx(speed[1:-1], abs=1e-2 * time.max())
