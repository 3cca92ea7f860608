"""Text is UTF-8 from the input to every file; control characters stay outside."""

import csv
import shutil
import xml.etree.ElementTree as ET
from pathlib import Path

import h5py
import numpy as np
import pytest

import hpcwhirl
from hpcwhirl.cli import main
from hpcwhirl.errors import InputError, csv_cell, legible
from hpcwhirl.scene import Scene

SHORT = "scene = {duration = 2e-3}\nsolver = {time_step = 2e-6}\n"
SWEEP = "sweep = {speed = [300.0, 410.0], gap = [1e-4, 2e-4]}\n"
NAMES = ["Müller ротор 扇 \U0001f6e9", "a ✓ $b$ $\\\\frac$"]
CONTROLS = ["\x1b[2J", "\x07", "\x7f", "\x85", "\x9b31m", "\u2028", "\u202e", "\ufffe"]


def attributes(file):
    """Yield every attribute of text in a file, as HDF5 has it."""
    found = [file]
    file.visititems(lambda _, item: found.append(item))
    for item in found:
        for name in item.attrs:
            kind = item.attrs.get_id(name).get_type()
            if isinstance(kind, h5py.h5t.TypeStringID) and name not in INTERNAL:
                yield name, kind


INTERNAL = {"CLASS", "NAME", "DIMENSION_LIST", "REFERENCE_LIST"}  # of dimension scales


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_a_name_of_any_script_stands_in_every_file(tmp_path, name, capsys):
    import netCDF4

    path, out = tmp_path / "c.toml", tmp_path / "out"
    path.write_text(f'{SHORT}{SWEEP}engine = {{name = "{name}"}}\n')
    assert main(["campaign", str(path), "--out", str(out)]) == 0
    name = name.replace("\\\\", "\\")
    assert "Traceback" not in capsys.readouterr().err
    with hpcwhirl.open_results(out) as data:
        assert data.attrs["title"] == f"hpcwhirl campaign, {name}"
    with netCDF4.Dataset(out / "results.h5") as data:
        assert data.title == f"hpcwhirl campaign, {name}"
        assert f'name = "{name}"' in data.scene.replace("\\\\", "\\")
    with h5py.File(out / "results.h5") as file:
        assert file.attrs["title"].decode().endswith(name)
        kinds = dict(attributes(file))
    assert {"title", "scene", "units", "long_name", "flag_meanings"} <= kinds.keys()
    assert {kind.get_cset() for kind in kinds.values()} == {h5py.h5t.CSET_UTF8}
    ET.parse(out / "map.svg")
    for command in ("map", "cases", "report", "status"):
        assert main([command, str(out)]) == 0


@pytest.mark.turns
def test_units_and_meanings_of_ones_own_are_utf8(tmp_path):
    told = {"one": ("µm", "größte Auslenkung")}
    tables = {"scene": {"duration": 2e-3}, "solver": {"time_step": 2e-6}}
    with hpcwhirl.campaign(
        tables, tmp_path / "out", measure=lambda _: {"one": 1.0}, variables=told
    ) as data:
        assert data.one.attrs == {"units": "µm", "long_name": "größte Auslenkung"}


@pytest.mark.parametrize("odd", CONTROLS)
@pytest.mark.parametrize("name", ["name", "file"])
def test_control_characters_are_refused_at_the_input(odd, name):
    with pytest.raises(InputError, match="must have no control characters") as told:
        hpcwhirl.Design.of({"engine": {name: f"a{odd}b"}})
    assert f"engine.{name}" in str(told.value) or name in str(told.value)
    assert str(told.value).isprintable()


@pytest.mark.parametrize("odd", CONTROLS)
def test_control_characters_are_refused_of_a_command(
    tmp_path, monkeypatch, capsys, odd
):
    monkeypatch.chdir(tmp_path)
    assert main(["campaign", "--out", f"a{odd}b"]) == 2
    err = capsys.readouterr().err
    assert err.startswith(
        "hpcwhirl: error: an argument must have no control characters"
    )
    assert err.removesuffix("\n").isprintable()
    assert list(tmp_path.iterdir()) == []


def spoilt(folder, odd):
    """Put a text into a campaign's results wherever they hold text of a user's."""
    with h5py.File(folder / "results.h5", "r+") as file:
        file.attrs["title"] = f"hpcwhirl campaign, a{odd}b"
        file.attrs["scene"] = "no scene"
        file["speed"].attrs["units"] = f"rad{odd}/s"
        file["growth_rate"].attrs["long_name"] = f"growth{odd}"
        file["message"][:] = np.bytes_(f"lost{odd}".encode())
    return folder


@pytest.mark.turns
@pytest.mark.parametrize("odd", CONTROLS[::6])
def test_what_a_file_holds_reaches_no_terminal_and_no_picture(
    finished, tmp_path, capsys, odd
):
    out = spoilt(Path(shutil.copytree(finished, tmp_path / "out")), odd)
    for words in (["cases"], ["cases", "--csv"], ["cases", "--columns", "?"],
                  ["cases", "--json"], ["status"], ["map"], ["report"]):  # fmt: skip
        main([words[0], str(out), *words[1:]])
        said = capsys.readouterr()
        for text in (said.out, said.err):
            assert text.translate({ord(c): " " for c in "\n\t\xa0"}).isprintable(), (
                words
            )
    for path in out.glob("*.svg"):
        ET.parse(path)
        assert odd not in path.read_text()


FORMULAS = ("=cmd|' /C calc'!A0", "+1+1", "-2+3", "@SUM(1)", "=1,2", "\t=1")


@pytest.mark.parametrize("formula", FORMULAS)
def test_no_text_is_a_formula_in_a_spreadsheet(finished, tmp_path, capsys, formula):
    """README names the table for a spreadsheet; a message may quote anyone's text."""
    out = Path(shutil.copytree(finished, tmp_path / "out"))
    with h5py.File(out / "results.h5", "r+") as file:
        file["message"][:] = np.bytes_(formula.encode())
        file["growth_rate"][:] = -1.5
    assert main(["cases", str(out), "--csv", "--columns", "message,growth_rate"]) == 0
    rows = list(csv.DictReader(capsys.readouterr().out.splitlines()))
    assert {row["message"] for row in rows} == {legible(f"'{formula}")}
    assert {row["growth_rate [1/s]"] for row in rows} == {"-1.5"}


@pytest.mark.parametrize("given", ["damped", "-1.5", "+2e-3", "-inf", "a=b", "", "1-2"])
def test_numbers_and_other_texts_are_written_to_csv_as_they_are(given):
    assert csv_cell(given) == given


def test_text_of_a_file_that_called_it_ascii_is_read_as_utf8(finished, tmp_path):
    """As hpcwhirl wrote them before."""
    out = Path(shutil.copytree(finished, tmp_path / "out"))
    with h5py.File(out / "results.h5", "r+") as file:
        file.attrs["title"] = np.bytes_("hpcwhirl campaign, Müller".encode())
    with hpcwhirl.open_results(out) as data:
        assert data.attrs["title"] == "hpcwhirl campaign, Müller"


def test_a_plain_name_is_kept_as_it_is():
    assert hpcwhirl.Design.of({"engine": {"name": "a b"}}).base.engine.name == "a b"
    assert Scene().engine.name == "four_motions"
