"""The ledger of checks that continuous integration leaves out."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

TOP = Path(__file__).parents[2]
sys.path.append(str(TOP / "scripts"))
import last_run  # noqa: E402


@pytest.fixture
def clone(tmp_path, monkeypatch):
    """Return a small clone in which the ledger's paths lie."""

    def git(*words):
        own = ["-c", "user.name=a", "-c", "user.email=a@b"]
        subprocess.run(["git", "-C", tmp_path, *own, *words], check=True,
                       capture_output=True)  # fmt: skip

    for name in ("hpcwhirl/store/a.py", "hpcwhirl/dynamics/b.py", "scripts/" + "c.sh"):
        path = tmp_path / name
        path.parent.mkdir(parents=True)
        path.write_text("1\n")
    git("init", "-q")
    git("add", "-A")
    git("commit", "-qm", "first")
    monkeypatch.setattr(last_run, "TOP", tmp_path)
    monkeypatch.setattr(last_run, "LEDGER", tmp_path / "scripts/last_run.md")
    return tmp_path


def test_every_command_of_the_evidence_has_what_it_judges():
    call, env = ["bash", TOP / "scripts/evidence.sh"], {"PATH": "/bin"}
    told = subprocess.run(call, check=True, capture_output=True, text=True, env=env)
    names = re.findall(r"^([\w-]+) +\|", told.stdout, re.M)
    assert ("cluster", *names) == last_run.CHECKS
    assert last_run.JUDGED.keys() <= set(last_run.CHECKS)
    paths = {path for judged in last_run.JUDGED.values() for path in judged}
    assert [path for path in paths if not (TOP / path).exists()] == []


def test_a_check_is_old_once_a_file_that_it_judges_has_changed(clone, capsys):
    for name in ("crashes", "bars"):
        assert last_run.main([name, "passed"]) == 0
    assert set(last_run.ledger()) == {"crashes", "bars"}
    assert not any("older" in line for line in last_run.told(last_run.ledger()))
    (clone / "hpcwhirl/store/a.py").write_text("2\n")
    assert last_run.main([]) == 0
    (line,) = re.findall(".*older than their code.*", capsys.readouterr().out)
    assert "crashes (" in line
    assert "bars" not in line
    assert last_run.main(["crashes", "FAILED"]) == 0
    assert "and changes" in last_run.ledger()["crashes"].commit
    lines = last_run.told(last_run.ledger())
    assert "last runs failed: crashes" in lines
    assert not any("older" in line for line in lines)


def test_the_ledger_of_this_clone_can_be_read():
    text = last_run.LEDGER.read_text("utf-8")
    assert last_run.text_of(last_run.rows_of(text)) == text


def test_an_unknown_check_is_refused(capsys):
    assert last_run.main(["crash", "passed"]) == 2
    assert "give NAME RESULT" in capsys.readouterr().err
