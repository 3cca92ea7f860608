"""Completion, man page, and paths for scripts."""

import json
import subprocess
import sys
import webbrowser

import made_up
import pytest

from hpcwhirl.cli import COMMANDS, main
from hpcwhirl.cli.completion import whole


@pytest.fixture(scope="module")
def first(tmp_path_factory):
    place = tmp_path_factory.mktemp("terminal") / "first"
    made_up.campaign(place, {"sweep": {"speed": [300.0, 400.0]}}, samples=40)
    return place


@pytest.mark.parametrize("shell", ["bash", "zsh", "tcsh"])
def test_completion_knows_commands_and_options(shell, capsys):
    pytest.importorskip("shtab", reason="needs the extra terminal")
    with pytest.raises(SystemExit) as ended:
        main(["--completion", shell])
    assert ended.value.code == 0
    told = capsys.readouterr().out
    assert all(name in told for name in COMMANDS)
    assert "take-over" in told


def test_bash_completes_a_command(tmp_path, capsys):
    pytest.importorskip("shtab", reason="needs the extra terminal")
    with pytest.raises(SystemExit):
        main(["--completion", "bash"])
    script = tmp_path / "complete.sh"
    script.write_text(
        capsys.readouterr().out + "COMP_WORDS=(hpcwhirl clas); COMP_CWORD=1\n"
        '_shtab_hpcwhirl; echo "${COMPREPLY[@]}"\n'
    )
    done = subprocess.run(
        ["bash", str(script)], capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == ["classify"]


def test_the_man_page_has_all_commands(capsys):
    pytest.importorskip("argparse_manpage", reason="needs the extra terminal")
    with pytest.raises(SystemExit):
        main(["--man"])
    told = capsys.readouterr().out
    assert told.startswith(".TH HPCWHIRL")
    assert all(name.replace("-", "\\-") in told for name in COMMANDS)


@pytest.mark.parametrize(
    ("words", "module"),
    [(["--completion", "bash"], "shtab"), (["--man"], "argparse_manpage.manpage")],
)
def test_a_missing_package_is_named(words, module, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, module, None)
    assert main(words) == 2
    assert "pip install 'hpcwhirl[terminal]'" in capsys.readouterr().err


def test_the_whole_parser_is_that_of_the_commands():
    parser = whole()
    args = parser.parse_args(["classify", "DIR", "--set", "rise=0.2", "--write"])
    assert args.write


@pytest.mark.turns
@pytest.mark.parametrize("command", ["map", "report"])
def test_a_script_gets_the_paths_as_json(command, first, tmp_path, capsys):
    out = tmp_path / "page.html" if command == "report" else tmp_path
    assert main([command, str(first), "--json", "--out", str(out)]) == 0
    files = json.loads(capsys.readouterr().out)["files"]
    assert files
    assert all((tmp_path / file).is_file() for file in files)


@pytest.mark.turns
def test_a_script_gets_the_paths_of_figures_and_what_is_not_drawn(
    first, tmp_path, capsys
):
    words = ["--kind", "orbit", "--kind", "wear", "--case", "0", "--json"]
    assert main(["figures", str(first), *words, "--out", str(tmp_path)]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["files"] == [str(tmp_path / "orbit-0000.png")]
    assert [line.partition(":")[0] for line in told["not_drawn"]] == ["wear"]


def test_a_script_gets_the_paths_of_gathered_results(first, capsys):
    assert main(["gather", str(first), "--json"]) in {0, 1}
    files = json.loads(capsys.readouterr().out)["files"]
    assert files[0] == str(first / "results.h5")


@pytest.mark.parametrize("starts", [True, False])
def test_a_page_is_opened_in_the_browser(starts, first, tmp_path, monkeypatch, capsys):
    asked = []
    monkeypatch.setattr(webbrowser, "open", lambda url: asked.append(url) or starts)
    out = tmp_path / "page.html"
    assert main(["report", str(first), "--open", "--out", str(out)]) == 0
    assert asked == [out.as_uri()]
    told = "no web browser could be started" in capsys.readouterr().err
    assert told is not starts


@pytest.mark.parametrize(("words", "told"), [
    (["campaign", "f.toml", "--resume"], "command that began a campaign continues it"),
    (["campaign", "f.toml", "--pilott", "3"], "did you mean '--pilot'?"),
    (["cases", "first", "second"], "unrecognized arguments: second (see"),
])  # fmt: skip
def test_an_unknown_option_is_told_with_what_may_be_meant(words, told, capsys):
    assert main(words) == 2
    assert told in capsys.readouterr().err
