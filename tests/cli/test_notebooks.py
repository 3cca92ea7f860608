"""The notebooks of `jobs/`: clean, and their cells run one after the other."""

import ast
import json
import shutil
from pathlib import Path

import pytest
from launch import ROOT

NOTEBOOKS = sorted((ROOT / "jobs").glob("*.ipynb"))
MAGIC = "%matplotlib inline"  # of Jupyter: shows figures; no Python


def cells_of(path, kind):
    document = json.loads(path.read_text(encoding="utf-8"))
    found = [cell for cell in document["cells"] if cell["cell_type"] == kind]
    return found, ["".join(cell["source"]) for cell in found]


@pytest.fixture(params=NOTEBOOKS, ids=lambda path: path.stem)
def notebook(request):
    return request.param


def test_there_are_three_that_the_manual_names():
    page = (ROOT / "hpcwhirl/manual/python.md").read_text(encoding="utf-8")
    assert [path.stem for path in NOTEBOOKS] == [
        "first_campaign", "own_engine", "uncertainty",
    ]  # fmt: skip
    assert all(f"jobs/{path.name})" in page for path in NOTEBOOKS)


def test_no_output_is_stored(notebook):
    cells, _ = cells_of(notebook, "code")
    for cell in cells:
        assert (cell["outputs"], cell["execution_count"]) == ([], None)


def values_of(code, names):
    """Run a cell and return the value of its last line, which a notebook shows."""
    body = ast.parse(code).body
    last = body.pop() if isinstance(body[-1], ast.Expr) else None
    exec(compile(ast.Module(body, []), "cell", "exec"), names)
    if last is None:
        return None
    return eval(compile(ast.Expression(last.value), "cell", "eval"), names)


@pytest.mark.slow
def test_every_cell_runs_and_what_it_shows_can_be_shown(
    notebook, tmp_path, monkeypatch
):
    """Pictures are drawn, tables made: as Jupyter would, but by this process.

    Beside the campaigns that lie beside it: it takes none of them for its own.
    """
    for path in (ROOT / "jobs").glob("*.toml"):
        shutil.copy(path, tmp_path)
    monkeypatch.chdir(tmp_path)
    names, shown = {}, []
    for code in cells_of(notebook, "code")[1]:
        value = values_of(code.replace(f"{MAGIC}\n", ""), names)
        if hasattr(value, "savefig"):
            path = Path(f"{len(shown)}.png")
            value.savefig(path)
            assert path.stat().st_size > 10_000
        elif hasattr(value, "_repr_html_"):
            assert "<" in value._repr_html_()
        else:
            continue
        shown.append(value)
    assert len(shown) >= 2
    assert (tmp_path / {"first_campaign": "first", "own_engine": "my_fan"}.get(
        notebook.stem, "drawn") / "results.h5").exists()  # fmt: skip
