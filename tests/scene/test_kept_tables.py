"""Small tables that an input names: read alike, and refused in one line."""

import sys

import pytest

from hpcwhirl.errors import MissingFileError
from hpcwhirl.scene.bearing_tables import bearing_table
from hpcwhirl.scene.case_list import cases_in_file
from hpcwhirl.scene.kept_tables import (
    MOST_BYTES,
    profile_table,
    table_over_slip,
    table_over_time,
)

READERS = {
    "bearing": bearing_table,
    "speed": lambda text: table_over_time(text, "speed"),
    "profile": profile_table,
    "friction": table_over_slip,
}


@pytest.mark.parametrize("reader", READERS.values(), ids=READERS)
@pytest.mark.parametrize(
    ("content", "told"),
    [
        (None, "cannot read '[^(]*': No such file"),
        (b"", "must name a file that has a table, got '[^(]*', which is empty"),
        (b"\n \n", "which is empty"),
        (b"\xff\xfe\x00", "line 1 is not UTF-8"),
        (b" " * (MOST_BYTES + 1), f"at most {MOST_BYTES} bytes"),
    ],
)
def test_a_file_without_a_table_is_refused_in_one_line(reader, content, told, tmp_path):
    path = tmp_path / "table.csv"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ValueError, match=told) as raised:
        reader(str(path))
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("reader", READERS.values(), ids=READERS)
@pytest.mark.parametrize("missing", [False, True])
def test_what_is_no_spreadsheet_or_needs_a_package_is_told(
    reader, missing, tmp_path, monkeypatch
):
    path = tmp_path / "table.xlsx"
    path.write_bytes(b"PK\x03\x04\xff\xfe")
    told = "it is no spreadsheet that can be read"
    if not missing:
        pytest.importorskip("python_calamine", reason="needs the extra sheets")
    else:
        monkeypatch.setitem(sys.modules, "python_calamine", None)
        told = r"pip install 'hpcwhirl\[sheets\]'; or save it as CSV"
    with pytest.raises(ValueError, match=told):
        reader(str(path))
    with pytest.raises(MissingFileError, match=told):
        cases_in_file(path)


@pytest.mark.parametrize("reader", READERS.values(), ids=READERS)
def test_a_directory_is_no_table(reader, tmp_path):
    with pytest.raises(ValueError, match="must name a file"):
        reader(str(tmp_path))


@pytest.mark.parametrize(
    ("reader", "content"),
    [
        ("bearing", "frequency,kxx,cxx\n0,1e6,10\n100,2e6,10\n"),
        ("speed", "time,speed\n0,100\n2,300\n"),
        ("profile", "harmonic,amplitude,phase\n2,1e-5,0.5\n"),
        ("friction", "slip,friction\n0,0.2\n1.5,0.1\n"),
    ],
)
def test_the_line_that_a_scene_keeps_is_the_table_itself(reader, content, tmp_path):
    path = tmp_path / "table.csv"
    path.write_text(content)
    kept = READERS[reader](str(path))
    path.unlink()
    assert "\n" not in kept
    assert READERS[reader](kept) == kept


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("slip,friction;0,0.2", "two rows at least"),
        ("slip,friction;0,0.2;1,nan", "of finite numbers"),
        ("slip,friction;0.1,0.2;1,0.1", "its slip must begin at 0 m/s and ascend"),
        ("slip,friction;0,0.2;2,0.1;1,0.1", "must begin at 0 m/s and ascend"),
        ("slip,friction;0,0.2;1,0.1;1,0.05", "must begin at 0 m/s and ascend"),
        ("slip,friction;0,0.2;1,-0.1", "its friction must be >= 0, got -0.1"),
        ("speed,friction;0,0.2;1,0.1", "it must have the columns slip,friction"),
    ],
)
def test_a_table_of_friction_that_is_none_is_refused(text, told):
    with pytest.raises(ValueError, match=told):
        table_over_slip(text)
