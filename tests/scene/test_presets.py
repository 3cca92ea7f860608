"""Presets: what is chosen, what counts over it, what is told."""

import h5py
import pytest

from hpcwhirl.campaign.finalize import facts_of
from hpcwhirl.campaign.plan.design import load_design
from hpcwhirl.case.resolve import resolve
from hpcwhirl.cli import main
from hpcwhirl.cli.options import scene_of
from hpcwhirl.dynamics.march import March
from hpcwhirl.errors import InputError
from hpcwhirl.scene import (
    apply_settings,
    load_scene,
    loss_of,
    named_scene,
    preset_in_short,
    preset_inputs,
    preset_loss,
    preset_names,
    preset_of,
)

BASE = named_scene("table2")


@pytest.mark.parametrize("name", preset_names())
def test_a_preset_is_recognized_by_its_inputs_and_named_in_the_help(name, capsys):
    chosen = apply_settings(BASE, preset_inputs(name))
    assert preset_of(chosen) == name
    assert preset_of(apply_settings(chosen, {"plan": "everything"})) == ""
    with pytest.raises(SystemExit):
        main(["run", "--help"])
    told = " ".join(capsys.readouterr().out.split())
    assert name in told
    assert "hpcwhirl inputs preset" in told
    assert preset_loss(name) not in told  # five commands would repeat it


def test_presets_are_ordered_from_fast_to_exact():
    steps = [
        March(resolve(apply_settings(BASE, preset_inputs(n)))).scene.solver.time_step
        for n in preset_names()
    ]
    assert steps == sorted(steps, reverse=True)
    asked = [preset_inputs(n)["solver.truncation"] for n in preset_names()]
    assert asked == sorted(asked, reverse=True)


@pytest.mark.turns
@pytest.mark.parametrize("order", [0, 1])
def test_set_counts_over_a_preset_in_any_order(order, capsys):
    words = [["--preset", "draft"], ["--set", "accuracy=1e-3"]]
    both = words[order] + words[1 - order]
    assert main(["model", *both, "--json", "--explain"]) == 0
    capsys.readouterr()
    inputs = [f"{n}={v}" for n, v in preset_inputs("draft").items()]
    scene = scene_of("table2", [*inputs, "accuracy=1e-3"])
    assert scene.solver.accuracy == 1e-3
    assert scene.solver.truncation == preset_inputs("draft")["solver.truncation"]


def test_two_presets_and_what_they_would_overrule_are_one_line(capsys):
    for words, told in (
        (["--preset", "draft", "--preset", "standard"], "given twice"),
        (["--preset", "draft", "--set", "time_step=1e-6"], "add --set accuracy=0"),
        (["--preset", "draft", "--set", "modes=22"], "add --set truncation=0"),
    ):
        assert main(["run", *words]) == 2
        said = capsys.readouterr().err
        assert told in said
        assert said.count("\n") == 1


def test_a_preset_says_where_nobody_has_measured_it():
    odd = {**preset_inputs("draft"), "mistuning": [0.01] * 22}
    assert "not measured" in loss_of(apply_settings(BASE, odd))
    assert loss_of(apply_settings(BASE, preset_inputs("draft"))) == preset_loss("draft")


def test_unknown_presets_and_swept_inputs_of_one_are_one_line(tmp_path, capsys):
    with pytest.raises(InputError, match="did you mean 'draft'"):
        preset_inputs("drafts")
    assert main(["run", "--preset", "standaard"]) == 2
    assert "did you mean 'standard'" in capsys.readouterr().err
    path = tmp_path / "swept.toml"
    path.write_text("[sweep]\naccuracy = [1e-2, 1e-3]\n")
    assert main(["campaign", str(path), "--preset", "draft", "--dry-run"]) == 2
    assert "the campaign sweeps this input" in capsys.readouterr().err


@pytest.mark.turns
def test_results_name_the_preset_and_what_it_loses(tmp_path, capsys):
    path = tmp_path / "two.toml"
    path.write_text("[scene]\nduration = 2e-3\n[sweep]\nspeed = [300.0, 400.0]\n")
    out = tmp_path / "out"
    assert main(["campaign", str(path), "--preset", "draft", "--out", str(out)]) == 0
    said = [line for line in capsys.readouterr().err.splitlines() if "preset" in line]
    assert len(said) == 1
    assert f"preset draft: {preset_in_short('draft')}" in said[0]
    assert len(said[0]) < 250
    with h5py.File(out / "results.h5") as file:
        assert file.attrs["preset"].decode() == "draft"
        assert file.attrs["preset_loses"].decode() == preset_loss("draft")
    other = load_design(path, preset_inputs("draft") | {"solver.accuracy": 0.5})
    assert "preset" not in facts_of(other)


SWEPT = "[scene]\nduration = 2e-3\n[sweep]\nspeed = [300.0, 400.0]\n"


@pytest.mark.parametrize("others", ["", "accuracy = 1e-3\nscheme = 'general'\n"])
@pytest.mark.parametrize("name", preset_names())
def test_a_preset_in_the_file_gives_the_digests_of_the_option(tmp_path, name, others):
    bare, named = tmp_path / "bare.toml", tmp_path / "named.toml"
    bare.write_text(f"{SWEPT}[solver]\n{others}")
    named.write_text(f"{SWEPT}[solver]\npreset = '{name}'\n{others}")
    wanted, found = load_design(bare, preset_inputs(name)), load_design(named, {})
    assert found.digests == wanted.digests
    told = facts_of(found)
    assert told["preset"] == name
    assert told["scene"] == facts_of(wanted)["scene"]
    other = preset_inputs("reference")
    assert load_design(named, other).digests == load_design(bare, other).digests
    over = {"solver.accuracy": 0.5}
    both = load_design(bare, preset_inputs(name) | over)
    assert load_design(named, over).digests == both.digests


def test_a_preset_in_a_scene_s_file_counts_over_its_inputs_and_below_options(tmp_path):
    path = tmp_path / "one.toml"
    path.write_text("[solver]\npreset = 'draft'\naccuracy = 1e-3\n")
    draft = apply_settings(BASE, preset_inputs("draft"))
    assert load_scene(path) == scene_of(str(path), []) == draft
    asked = [f"{n}={v}" for n, v in preset_inputs("standard").items()]
    assert preset_of(scene_of(str(path), asked)) == "standard"
    assert scene_of(str(path), ["accuracy=0.5"]).solver.accuracy == 0.5


@pytest.mark.parametrize(
    ("text", "words", "told"),
    [
        ("[solver]\npreset = 'drafft'", [], "'drafft' did you mean 'draft'"),
        ("[solver]\npreset = 3", [], "[solver] preset one of draft got 3"),
        ("[solver]\nprset = 'draft'", [], "[solver] 'prset' did you mean 'preset'"),
        ("[scene]\npreset = 'draft'", [], "'preset' belongs in [solver]"),
        ("[campaign]\npreset = 'draft'", [], "'preset' belongs in [solver]"),
        ("[sweep]\npreset = ['draft']", [], "no scene input preset [solver]"),
        ("[solver]\npreset = 'draft'\n[sweep]\naccuracy = [0.1]", [],
         "[solver] preset solver.accuracy sweeps"),
        ("[solver]\npreset = 'draft'", ["time_step=1e-6"], "add --set accuracy=0"),
        ("", ["preset=draft"], "no scene input --preset NAME"),
    ],
)  # fmt: skip
def test_a_preset_in_a_file_that_means_nothing_is_one_line(
    tmp_path, capsys, text, words, told
):
    path = tmp_path / "c.toml"
    path.write_text(text + "\n")
    sets = [part for word in words for part in ("--set", word)]
    assert main(["campaign", str(path), "--dry-run", *sets]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert all(word in said for word in told.split()), said
