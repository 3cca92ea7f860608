"""The looks of words: apart in colour, in grey, and to the colour-blind."""

import ast
import itertools
import re
from pathlib import Path

import numpy as np
import pytest

import hpcwhirl
from hpcwhirl.report import palette
from hpcwhirl.scene.words import BAD, ENUMS, SHOWN, WHIRLS, word_of
from hpcwhirl.store.reading.shares import words_of

# Machado, Oliveira, Fernandes, IEEE TVCG 15 (2009), severity 1, on linear RGB
BLIND = {
    "nobody": np.eye(3),
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216],
                   [-0.003882, -0.048116, 1.051998]],
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413],
                     [-0.011820, 0.042940, 0.968881]],
    "tritanopia": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602],
                   [0.004733, 0.691367, 0.303900]],
}  # fmt: skip
XYZ = np.array([[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750],
                [0.0193339, 0.1191920, 0.9503041]])  # of linear sRGB, D65  # fmt: skip
TABLES = {"regime": SHOWN, "whirl": WHIRLS | BAD}


def linear(colour):
    """Return linear RGB, (3,), of '#RRGGBB' (IEC 61966-2-1)."""
    part = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255
    return np.where(part <= 0.04045, part / 12.92, ((part + 0.055) / 1.055) ** 2.4)


def lab(rgb):
    """Return CIE L*a*b*, (3,), of linear RGB under D65."""
    part = XYZ @ np.clip(rgb, 0, 1) / np.array([0.95047, 1.0, 1.08883])
    low = part / (3 * (6 / 29) ** 2) + 4 / 29
    x, y, z = np.where(part > (6 / 29) ** 3, np.cbrt(part), low)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def test_lab_is_lab():
    assert lab(linear("#FFFFFF")) == pytest.approx([100, 0, 0], abs=0.02)
    assert lab(linear("#FF0000")) == pytest.approx([53.24, 80.09, 67.20], abs=0.02)


@pytest.mark.parametrize("table", TABLES)
@pytest.mark.parametrize("eye", BLIND)
def test_words_are_apart_to_every_eye(eye, table):
    looks, turn = TABLES[table].items(), np.array(BLIND[eye])
    seen = {word: lab(turn @ linear(look.colour)) for word, look in looks}
    for a, b in itertools.combinations(seen, 2):
        assert np.linalg.norm(seen[a] - seen[b]) > 12, (a, b)


@pytest.mark.parametrize("table", TABLES)
def test_words_are_apart_in_grey(table):
    looks = TABLES[table].items()
    light = sorted((lab(linear(look.colour))[0], word) for word, look in looks)
    for (low, a), (high, b) in itertools.pairwise(light):
        assert high - low > 11, (a, b)


def test_letters_are_legible_on_their_colour():
    for word, look in (SHOWN | WHIRLS).items():
        y, ink = (float(XYZ[1] @ linear(c)) for c in (look.colour, look.ink))
        contrast = (max(y, ink) + 0.05) / (min(y, ink) + 0.05)  # WCAG 2
        assert contrast > 4.5, word


def test_every_word_of_a_file_has_one_look():
    looks = list(SHOWN.values())
    for part in ("colour", "letter", "marker", "told"):
        assert len({getattr(look, part) for look in looks}) == len(looks), part
    triples = list(
        itertools.product(*(ENUMS[n] for n in ("status", "outcome", "regime")))
    )
    one = [word_of(*t) for t in triples]
    assert set(one) == set(SHOWN)
    assert list(words_of(*map(np.array, zip(*triples, strict=True)))) == one
    assert set(WHIRLS) == set(ENUMS["whirl"])


@pytest.mark.parametrize("ground", ["colour", "night"])
@pytest.mark.parametrize("eye", BLIND)
def test_curves_are_apart_to_every_eye_by_day_and_night(eye, ground):
    turn = np.array(BLIND[eye])
    seen = [lab(turn @ linear(getattr(one, ground))) for one in palette.SERIES]
    for a, b in itertools.combinations(seen, 2):
        assert np.linalg.norm(a - b) > 20


@pytest.mark.parametrize("time", [0, 1])
@pytest.mark.parametrize("eye", BLIND)
def test_the_parts_of_a_moving_wheel_are_apart_to_every_eye(eye, time):
    parts = [palette.PAGE[n][time] for n in ("touch", "series-0", "series-2")]
    seen = [lab(np.array(BLIND[eye]) @ linear(colour)) for colour in parts]
    for a, b in itertools.combinations(seen, 2):
        assert np.linalg.norm(a - b) > 20


def test_curves_stand_out_from_their_ground():
    day, night = palette.PAGE["ground"]
    for one in palette.SERIES:
        for colour, ground in ((one.colour, day), (one.night, night)):
            light, dark = sorted(
                (float(XYZ[1] @ linear(c)) for c in (colour, ground)), reverse=True
            )
            assert (light + 0.05) / (dark + 0.05) > 3  # WCAG 2, graphics


def _slice(look):
    first, every = look["markevery"]
    return first, None, every


def test_a_curve_of_a_given_colour_has_no_dashes():
    """Dashes in the cycle would reach every curve that names a colour alone."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    with rc_context(palette.style()):
        axes = Figure().subplots()
        lines = [axes.plot([0, 1], c=palette.INK)[0] for _ in range(3)]
    assert {line.get_linestyle() for line in lines} == {"-"}


def test_curves_are_apart_without_colour():
    for part in ("dash", "marker"):
        assert len({getattr(one, part) for one in palette.SERIES}) == len(
            palette.SERIES
        )
    many = [palette.look_of(n) for n in range(36)]
    assert len({(look["c"], look["marker"]) for look in many}) == 36
    marked = [range(1000)[slice(*_slice(palette.spaced(n, 7, 1000)))] for n in range(7)]
    assert all(len(one) == 10 for one in marked)
    assert len({point for one in marked for point in one}) == 70


COLOURED = {"c", "color", "colors", "fc", "ec", "mfc", "mec", "ecolor", "facecolor",
            "edgecolor", "edgecolors", "foreground"}  # fmt: skip
HEX = re.compile(r"#[0-9a-fA-F]{3,8}\b")
REPORT = Path(hpcwhirl.__file__).parent / "report"


def colours_in(path):
    """Return the colours that a source names by itself."""
    from matplotlib.colors import is_color_like

    text = path.read_text("utf-8")
    if path.suffix != ".py":
        return HEX.findall(text)
    nodes = list(ast.walk(ast.parse(text)))
    given = [(k.arg, k.value) for n in nodes if isinstance(n, ast.Call)
             for k in n.keywords]  # fmt: skip
    given += [(getattr(k, "value", None), v) for n in nodes if isinstance(n, ast.Dict)
              for k, v in zip(n.keys, n.values, strict=True)]  # fmt: skip
    named = {v.value for name, v in given if name in COLOURED
             and isinstance(v, ast.Constant) and is_color_like(v.value)}  # fmt: skip
    return [*(named - {"none"}), *HEX.findall(text)]


@pytest.mark.parametrize(
    "path",
    [path for path in sorted(REPORT.rglob("*")) if path.name != "palette.py"
     and path.suffix in {".py", ".js", ".css"} and "vendor" not in path.parts],
    ids=lambda path: path.name,
)  # fmt: skip
def test_only_the_palette_and_the_words_name_colours(path):
    assert not colours_in(path)


def test_colours_named_by_hand_are_seen():
    assert len(colours_in(REPORT / "palette.py")) > 30
