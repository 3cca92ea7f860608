"""What pictures call quantities is what the table calls them."""

import ast
import math
import re
import shutil
from pathlib import Path

import pytest

import hpcwhirl
from hpcwhirl.cli import main
from hpcwhirl.report import canvas
from hpcwhirl.report.canvas import tell_in_units
from hpcwhirl.scene.quantities import AXES, INPUTS, ROW, TRACES
from hpcwhirl.scene.units import showing, with_unit

REPORT = Path(hpcwhirl.__file__).parent / "report"


@pytest.mark.parametrize(
    ("name", "axis", "told"),
    [("speed", "Ω, rad/s", "Ω = 410 rad/s"), ("friction", "μ", "μ = 410"),
     ("gap", "gap, m", "gap = 410000 mm"), ("time", "time, s", "time = 410 s"),
     ("growth_rate", "growth rate, 1/s", "growth rate = 410 1/s")],
)  # fmt: skip
def test_a_quantity_is_shown_by_symbol_and_unit(name, axis, told):
    assert canvas.axis_of(name) == axis
    assert canvas.value_of(name, 410.0) == told


def test_an_axis_of_an_input_has_its_name_and_symbol():
    names = ("speed", "casing_damping", "gap", "casing_thickness")
    told = ["speed Ω", "casing damping ξ", "gap", "casing thickness"]
    assert [canvas.name_of(name) for name in names] == told


def test_a_value_may_have_another_unit_and_a_long_text_is_cut():
    assert canvas.value_of("speed", 3915.2, "rpm") == "Ω = 3915.2 rpm"
    assert canvas.value_of("rotor_mistuning", "x" * 80)[-3:] == "xx…"
    assert with_unit("steps", "1") == with_unit("steps", "") == "steps"


def test_rows_that_are_inputs_have_their_unit():
    own = {name.rpartition(".")[2]: told for name, told in INPUTS.items()}
    for name in ROW.keys() & own.keys():
        assert ROW[name].unit == own[name].unit, name


def test_no_axis_is_named_by_hand_where_the_table_knows_it():
    known = AXES | TRACES | ROW
    by_hand = {told.labelled(told.symbol or name) for name, told in known.items()}
    by_hand = {text for text in by_hand if ", " in text}
    assert "Ω, rad/s" in by_hand
    for path in REPORT.glob("*.py"):
        texts = set(re.findall(r'"([^"\n]*)"', path.read_text(encoding="utf-8")))
        assert not texts & by_hand, path.name


def test_charts_of_the_page_write_no_unit_by_hand():
    charts = REPORT / "page" / "assets" / "charts.js"
    by_hand = re.compile(r""" (rad/s|Hz|W|J|N s|kg|mm|m|s)["'`;]""")
    assert not by_hand.findall(charts.read_text("utf-8"))


def test_titles_are_in_the_units_asked_for():
    asked = {("rpm", "um"): ("Ω = 3915.21 rpm", "gap = 128 um"),
             ("si",): ("Ω = 410 rad/s", "gap = 0.000128 m"),
             ("practical",): ("Ω = 410 rad/s", "gap = 0.128 mm")}  # fmt: skip
    for units, told in asked.items():
        with showing(units):
            shown = canvas.value_of("speed", 410.0), canvas.value_of("gap", 0.000128)
        assert shown == told


def test_ticks_stand_at_round_numbers_of_the_unit_shown():
    """The data stay in SI: a tick is at 3000 rpm, 314 rad/s."""
    from matplotlib.figure import Figure

    figure = Figure()
    axes = figure.subplots()
    axes.plot([300.0, 500.0], [1e-4, 4e-4])
    axes.set(xlabel="Ω, rad/s", ylabel="|q|, m √kg")
    with showing(("rpm",)):
        tell_in_units(figure)
    assert axes.get_xlabel() == "Ω, rpm"
    assert axes.get_ylabel() == "|q|, m √kg"
    ticks = axes.xaxis.get_majorticklocs()
    texts = axes.xaxis.get_major_formatter().format_ticks(ticks)
    assert "3500" in texts
    for place, text in zip(ticks, texts, strict=True):
        assert place * 30 / math.pi == pytest.approx(float(text))
        assert float(text) % 250 == 0


@pytest.mark.turns
def test_a_picture_is_drawn_once_and_is_that_of_matplotlib(tmp_path, monkeypatch):
    from matplotlib.figure import Figure

    drawn, draw = [], Figure.draw

    def counted(figure, renderer):
        drawn.append(figure)
        draw(figure, renderer)

    def made():
        figure, panels = canvas.new_figure((4, 3), 2, 1, sharex=True)
        for panel in panels:
            panel.plot([0.0, 1e-5], [0.0, 1e7], label="a curve")
            panel.set(title="two\nlines", xlabel="time, s", ylabel="force, N")
        canvas.legend_below(figure, *panels)
        return figure

    made().savefig(tmp_path / "own.png", dpi=130)
    monkeypatch.setattr(Figure, "draw", counted)
    canvas.save(made(), tmp_path / "ours.png")
    assert len(drawn) == 1
    own, ours = (tmp_path / f"{name}.png" for name in ("own", "ours"))
    assert own.read_bytes() == ours.read_bytes()


ODD_STYLE = {  # of a matplotlibrc; without LaTeX the first fails
    "text.usetex": True, "font.size": 30, "lines.linewidth": 9,
    "axes.facecolor": "red", "savefig.bbox": "tight", "image.cmap": "jet",
}  # fmt: skip


@pytest.mark.turns
@pytest.mark.parametrize("words", [["map"], ["figures", "--kind", "growth"]])
def test_a_picture_is_the_same_whatever_a_matplotlibrc_says(finished, tmp_path, words):
    from matplotlib import rc_context, rcParams

    drawn = []
    for style in ({}, ODD_STYLE):
        out = tmp_path / f"out-{len(style)}"
        shutil.copytree(finished, out)
        with rc_context(style):
            assert main([words[0], str(out), *words[1:]]) == 0
            assert all(rcParams[name] == value for name, value in style.items())
        drawn.append({path.name: path.read_bytes() for path in out.rglob("*.png")})
    assert drawn[0] == drawn[1]
    assert drawn[0]


@pytest.mark.turns
def test_every_picture_that_is_written_is_drawn_in_the_defaults_of_matplotlib():
    writers, writes = [], re.compile(r"(?<![.\w])(canvas\.|film\.)?save\(")
    for path in sorted(Path(hpcwhirl.__file__).parent.rglob("*.py")):
        text = path.read_text("utf-8")
        if "canvas" not in text or path.name == "canvas.py":
            continue
        made = (n for n in ast.walk(ast.parse(text)) if isinstance(n, ast.FunctionDef))
        writers += [(f"{path.stem}.{one.name}", one) for one in made
                    if writes.search(ast.unparse(one))]  # fmt: skip
    assert len(writers) >= 8
    bare = [
        name
        for name, one in writers
        if "in_defaults"
        not in {ast.unparse(m).removeprefix("canvas.") for m in one.decorator_list}
    ]
    assert not bare


def test_a_film_keeps_the_colour_of_contacts_that_its_last_frame_lacks(tmp_path):
    from PIL import Image, ImageColor

    from hpcwhirl.report.figures import wheel

    frames = [Image.new("RGB", (40, 40), wheel.palette.GROUND) for _ in range(2)]
    frames[1].putdata([(5 * x % 256, 3 * x % 256, x % 256) for x in range(1600)])
    touch = ImageColor.getrgb(wheel.TOUCH)
    frames[0].putpixel((20, 20), touch)
    path = tmp_path / "film.gif"
    frames[0].save(path, save_all=True, append_images=frames[1:])
    wheel._with_few_colours(path)
    with Image.open(path) as film:
        found = film.convert("RGB").getpixel((20, 20))
    assert max(abs(a - b) for a, b in zip(found, touch, strict=True)) < 4
