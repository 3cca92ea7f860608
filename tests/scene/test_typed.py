"""What type checkers and help know of the inputs."""

import inspect
import pydoc
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import typed_inputs

import hpcwhirl
from hpcwhirl.errors import InputError
from hpcwhirl.scene import scene_of_document
from hpcwhirl.scene import typed_inputs as written

RIGHT = """
import hpcwhirl
hpcwhirl.Scene(speed=330.0, gap="0.5 mm")
hpcwhirl.Scene(engine={"rotor": {"blades": 18}}, output={"traces": "full"})
hpcwhirl.Scene(solver={"preset": "draft"})
hpcwhirl.campaign("whirl.toml", "first", ranks=4, case_limit=3.0)
case = hpcwhirl.simulate(hpcwhirl.Scene(speed=330.0))
print(case.dataset.centre, case.row["regime"])
"""
WRONG = {
    'hpcwhirl.Scene(sped=330.0)': "sped",
    'hpcwhirl.Scene(gap_at="now")': "gap_at",
    'hpcwhirl.Scene(engine={"rotor": {"blade": 18}})': "engine",
    'hpcwhirl.campaign("whirl.toml", presett="draft")': "presett",
    'hpcwhirl.campaign("whirl.toml", patience="long")': "patience",
    "hpcwhirl.nothing": "nothing",
}  # fmt: skip


def test_the_inputs_written_down_are_those_of_the_tables():
    own = Path(written.__file__).read_text(encoding="utf-8")
    again = "python scripts/typed_inputs.py > hpcwhirl/scene/typed_inputs.py"
    assert own == typed_inputs.text(), f"inputs changed: {again}"


@pytest.mark.slow
def test_a_type_checker_takes_what_the_manual_writes_and_refuses_what_is_misspelt(
    tmp_path,
):
    """Without the plugin of pydantic."""
    (tmp_path / "mypy.ini").write_text("[mypy]\nstrict = true\n")
    (tmp_path / "right.py").write_text(RIGHT)
    (tmp_path / "wrong.py").write_text("\n".join(["import hpcwhirl", *WRONG]) + "\n")
    words = [sys.executable, "-m", "mypy", "right.py", "wrong.py"]
    done = subprocess.run(
        words, cwd=tmp_path, capture_output=True, text=True, check=False
    )
    errors = re.findall(r"^(\w+)\.py:(\d+): error: (.*)$", done.stdout, re.MULTILINE)
    assert {file for file, *_ in errors} == {"wrong"}
    told = {int(line): text for _, line, text in errors}
    for line, name in enumerate(WRONG.values(), 2):
        assert name in told[line]


def test_help_tells_each_input_on_a_page():
    told = pydoc.plain(pydoc.render_doc(hpcwhirl.Scene))
    assert "gap : number >= 0, m; default 0.000128" in told
    assert "engine.rotor : table" in told
    signature = str(inspect.signature(hpcwhirl.Scene))
    assert "speed: float | str = 410.0" in signature
    assert len(signature) < 2000


def test_a_result_fits_a_screen_and_is_xarray_with_units():
    scene = hpcwhirl.Scene(
        duration=2e-3, solver={"time_step": 2e-6}, output={"interval": 5e-5}
    )
    case = hpcwhirl.simulate(scene)
    assert len(repr(case).splitlines()) < 20
    assert len(repr(case)) < 2000
    assert f"regime {case.row['regime']}" in repr(case)
    data = case.dataset
    assert data.centre.dims == ("time", "xy")
    assert (data.centre.time.to_numpy() == case.traces["time"]).all()
    assert data.centre.attrs["units"] == "m"
    assert data.attrs["speed"] == scene.speed


def test_a_scene_takes_a_preset_as_a_file_does():
    text = "[solver]\npreset = 'draft'\n"
    assert hpcwhirl.Scene(solver={"preset": "draft"}) == scene_of_document(
        tomllib.loads(text)
    )


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda: hpcwhirl.simulate({"speed": 330}), r"a Scene \(of a mapping: Scene"),
        (lambda: hpcwhirl.simulate(3), "simulate takes a Scene, got 3"),
        (lambda: hpcwhirl.simulate("fan.toml"), r"Design\.of\(file\)\.base\), got 'f"),
        (lambda: hpcwhirl.Scene("fan.toml"), r"Design\.of\(file\)\.base\), got 'f"),
        (lambda: hpcwhirl.Scene(solver={"preset": "drat"}), "'drat'; .*'draft'"),
        (lambda: hpcwhirl.words("regime"), r"as words\(data.regime\), got 'regime'"),
    ],
)
def test_a_wrong_argument_is_one_clear_line(call, told):
    with pytest.raises(InputError, match=told):
        call()
