"""Hostile input, names, streams and limits: one line of bounded length, exit code 2."""

import json
import os
import random
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from attacks.family import Chance
from attacks.text import bytes_of, document, mutate, value
from launch import ENVIRONMENT, LIMIT, ROOT, kept

from hpcwhirl.campaign.finalize import _as_text
from hpcwhirl.campaign.plan.design import load_design
from hpcwhirl.campaign.stop import time_left
from hpcwhirl.cli import main
from hpcwhirl.cli.options import scene_of
from hpcwhirl.errors import InputError, MissingFileError, WhirlError, one_line, shown
from hpcwhirl.launch import parse_shard
from hpcwhirl.scene.campaign_tables import walltime_seconds
from hpcwhirl.scene.documents import parse_setting
from hpcwhirl.store.directory.manifest import PlanFile
from hpcwhirl.store.hdf5 import reading
from hpcwhirl.store.reading.results_file import count_statuses, opened

LONGEST = 2300  # characters of any message
DIGITS = "9" * 5000
WIDE = "0x" + "f" * 5000


def told(function, *given):
    """Return what a function says of what it refuses, "" where it takes it."""
    try:
        function(*given)
    except WhirlError as refused:
        text = str(refused)
        assert text.isprintable()
        assert len(text) < LONGEST
        return text
    return ""


@pytest.mark.turns
@pytest.mark.parametrize("seed", range(2))
def test_any_document_is_a_campaign_or_one_line(tmp_path, seed):
    chance, path = Chance(seed), tmp_path / "c.toml"
    found = set()
    for _ in range(60):
        hostile = document()
        mutate(hostile, chance)
        path.write_bytes(bytes_of(hostile, chance))
        found.add(told(load_design, path, {})[:9])
    assert len(found) > 3


@pytest.mark.parametrize(
    "name", ["gap", "blades", "engine.name", "engine.file", "mistuning", "x"]
)
def test_any_setting_is_taken_or_one_line(name):
    chance = Chance(name)
    for _ in range(30):
        told(scene_of, "table2", [f"{name}={value(chance)}"])


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (f"gap = {DIGITS}", "whole number of more than 1000 bits"),
        (f"gap = {WIDE}", "whole number of more than 1000 bits"),
        ("x = " + "[" * 5000, "nested deeper than 32"),
        ("x = " + "[" * 50 + "]" * 50, "nested deeper than 32"),
        ("a." * 300 + "b = 1", "nested deeper than 32"),
        ("[ " + "a-1 . " * 200_000 + "b ]", "nested deeper than 32"),  # of no memory
        ('[scene]\n"\\u001b[2J" = 1', r"\x1b[2J"),
    ],
    ids=["digits", "bits", "open", "lists", "tables", "dots", "control"],
)
def test_what_no_scene_needs_is_told(tmp_path, text, why):
    (tmp_path / "c.toml").write_text(text)
    assert why in told(load_design, tmp_path / "c.toml", {})


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (b"[scene]\n# \xe9\nspeed = 1", "line 2 is not UTF-8: save the file as UTF-8"),
        ("[scene]".encode("utf-16"), "line 1 is not UTF-8: save the file as UTF-8"),
        (b"[scene]\ngap = 1\ngap = 2\n", "a key is given twice (at line 3"),
        (b"[scene]\n[scene]\n", "the table [scene] is given twice (at line 2"),
        (b"[engine.rotor]\n[engine.rotor]", "the table [engine.rotor] is given twice"),
        (b"[rotor]\nblades = 18", "did you mean 'engine.rotor'?"),
        (b"[sweep]\nomega = [1, 2]", "'omega'; did you mean 'speed'?"),
        ("[sweep]\n'Ω' = [1, 2]".encode(), "'Ω'; did you mean 'speed'?"),
        (b"[scene]\nmu = 0.1", "'mu'; did you mean 'friction'?"),
    ],
)  # fmt: skip
def test_a_slip_in_a_file_is_told_in_the_words_of_its_writer(tmp_path, content, why):
    (tmp_path / "c.toml").write_bytes(content)
    assert why in told(load_design, tmp_path / "c.toml", {})


def test_a_setting_of_several_lines_loses_none_of_them():
    with pytest.raises(InputError, match="more than one line"):
        parse_setting("gap=1e-4\nspeed=3")


def test_numbers_without_end_are_no_walltime_and_no_shard():
    with pytest.raises(ValueError, match="must be HH:MM:SS"):
        walltime_seconds(f"{DIGITS}:00:00")
    assert "--shard must be" in told(parse_shard, f"1/{DIGITS}")
    assert time_left(None, {"SLURM_JOB_END_TIME": DIGITS}) is None


def test_a_message_keeps_what_and_allowed_of_a_long_input():
    text = one_line("speed must be a number, got '" + "z" * 70_000 + "' (rad/s)")
    assert text.startswith("speed must be a number, got 'zzz")
    assert text.endswith("zzz' (rad/s)")
    assert len(text) < LONGEST
    assert one_line("a\nb\x1b\udcff\0ü") == r"a\nb\x1b\udcff\x00ü"
    assert shown(10**9999) == "a whole number of 33216 bits"
    assert len(shown({"x": ["y" * 999] * 99})) < 500


@pytest.mark.parametrize(
    "command", ["campaign", "run", "status", "map", "job", "model"]
)
def test_bytes_that_are_no_utf8_are_refused_before_any_work(
    tmp_path, monkeypatch, capsys, command
):
    monkeypatch.chdir(tmp_path)
    assert main([command, "--out", os.fsdecode(b"a\xff")]) == 2
    err = capsys.readouterr().err
    assert err == "hpcwhirl: error: an argument must be UTF-8, got 'a\\udcff'\n"
    assert list(tmp_path.iterdir()) == []


def test_the_command_is_kept_as_text_whatever_the_program_is_called():
    assert _as_text(os.fsdecode(b"/opt/\xff/hpcwhirl")).encode().endswith(b"/hpcwhirl")


@pytest.mark.parametrize(
    "line",
    ["run {}", "model {}.toml", "campaign --out {}", "status {}", "figures {}",
     "map {}", "gather {}", "run --out {}/x.h5", "job slurm c.toml --script {}",
     "export-model {}.h5"],
)  # fmt: skip
def test_a_name_over_255_bytes_is_one_line(tmp_path, monkeypatch, capsys, line):
    monkeypatch.chdir(tmp_path)
    assert main(line.format("x" * 300).split()) == 2
    err = capsys.readouterr().err
    assert err.startswith("hpcwhirl: error: ")
    assert err.count("\n") == 1


def test_a_name_is_not_read_as_markup(capsys):
    assert main(["model", "--up-to", "1", "--set", "engine.name='[/red]'"]) == 0
    assert "engine [/red]" in capsys.readouterr().out


def test_damaged_results_are_one_line(finished, tmp_path, capsys):
    folder = Path(shutil.copytree(finished, tmp_path / "out"))
    whole, source = (folder / "results.h5").read_bytes(), random.Random(3)
    damaged = 0
    for _ in range(4):
        spoilt = bytearray(whole)
        for _ in range(30):
            spoilt[source.randrange(6000)] = source.randrange(256)
        (folder / "results.h5").write_bytes(spoilt)
        damaged += bool(told(count_statuses, folder / "results.h5"))
        for command in ("figures", "classify", "map"):
            code = main([command, str(folder)])
            err = capsys.readouterr().err
            assert code == 0 or (code == 2 and err.count("\n") == 1), err
    assert damaged


# The streams and limits of a process


def shell(line, place, **options):
    call = line.replace("hpcwhirl", f"{sys.executable} -m hpcwhirl")
    environment = ENVIRONMENT | {"PYTHONPATH": str(ROOT)}
    return subprocess.run(
        ["bash", "-c", call], cwd=place, env=environment, capture_output=True,
        text=True, timeout=LIMIT, check=False, **options,
    )  # fmt: skip


@pytest.mark.turns
@pytest.mark.parametrize(
    ("line", "why"),
    [
        ("hpcwhirl --help >/dev/full", "cannot write stdout: No space left on device"),
        ("hpcwhirl model --json >/dev/full", "stdout: No space left on device"),
        (
            "mkdir x; cd x; rmdir ../x; hpcwhirl model",
            "the working directory cannot be",
        ),
        ("ulimit -v 150000; hpcwhirl model", "not enough memory (ulimit -v 150000)"),
    ],
)
def test_a_place_that_takes_nothing_is_one_line(tmp_path, line, why):
    done = shell(line, tmp_path)
    assert done.returncode == (75 if "No space" in why else 2)
    assert done.stderr.startswith("hpcwhirl: error: ")
    assert why in done.stderr
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("hpcwhirl --help >&-", 0),
        ("hpcwhirl nonsense 2>/dev/full", 2),
        ("hpcwhirl nonsense <&- >&- 2>&-", 2),
    ],
)
def test_closed_streams_change_no_exit_code(tmp_path, line, code):
    done = shell(line, tmp_path)
    assert (done.returncode, done.stderr) == (code, "")


STAND_IN = """
import os
os.close(0), os.close(2)
from hpcwhirl.cli.command import stand_in
stand_in()
print([os.get_inheritable(number) for number in range(3)])
"""


def test_what_stands_in_for_a_closed_stream_is_open_for_children_too():
    """A child's first file would get the number of stderr otherwise."""
    done = subprocess.run(
        [sys.executable, "-c", STAND_IN], env=ENVIRONMENT | {"PYTHONPATH": str(ROOT)},
        capture_output=True, text=True, timeout=LIMIT, check=False,
    )  # fmt: skip
    assert done.stdout == "[True, True, True]\n"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("stdout", "code"), [(">/dev/full", 75), ("> >(exec true)", 1), (">&-", 0)]
)
def test_a_stdout_that_takes_nothing_loses_no_file(tmp_path, stdout, code):
    """The words are asked for beside the files, and computed no second time."""
    short = "--set duration=2e-3 --set time_step=2e-6 --quiet"
    done = shell(f"hpcwhirl run {short} --out o.h5 --plot p {stdout}", tmp_path)
    assert done.returncode == code
    assert "Traceback" not in done.stderr
    assert count_statuses(tmp_path / "o.h5")["ok"] == 1
    assert list((tmp_path / "p").glob("*.png"))


@pytest.mark.slow
def test_who_has_read_enough_of_a_list_is_no_failure(finished, tmp_path):
    words = f"cases {finished}"
    done = shell(f"hpcwhirl {words} > >(exec true); echo", tmp_path)
    assert done.stderr == ""
    done = shell(f"sleep 1 | (hpcwhirl {words}; echo $? >code) | head -c 1", tmp_path)
    assert (tmp_path / "code").read_text() == "0\n"


@pytest.mark.slow
def test_pictures_are_drawn_whatever_the_backend_of_a_notebook(finished, tmp_path):
    done = shell(f"MPLBACKEND=none hpcwhirl map {finished} --out m", tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "m/map.png").is_file()


@pytest.mark.turns
@pytest.mark.parametrize("words", ["--help", "--version", "import-model --example"])
def test_who_has_read_enough_of_a_help_is_no_failure_either(words, tmp_path):
    shell(f"(hpcwhirl {words}; echo $? >code) > >(exec true); wait", tmp_path)
    assert (tmp_path / "code").read_text() == "0\n"


def test_a_file_that_cannot_be_written_loses_no_words(tmp_path, monkeypatch, capsys):
    """A place that was writable as the run began, and is not when it ends."""

    def full(path, *_):
        msg = f"cannot write {path}: No space left on device"
        raise MissingFileError(msg)

    monkeypatch.setattr("hpcwhirl.campaign.finalize.write_case", full)
    short = ["--set", "duration=2e-3", "--set", "time_step=2e-6"]
    out = str(tmp_path / "o.h5")
    assert main(["run", *short, "--quiet", "--json", "--out", out]) == 2
    said = capsys.readouterr()
    assert json.loads(said.out)["outcome"] == "completed"
    assert said.err.count("\n") == 1
    assert "No space left" in said.err


def test_who_reads_no_list_of_figures_gets_them_all(monkeypatch, tmp_path):
    drawn = []

    def figures(*_, **__):
        for number in range(3):
            drawn.append(number)
            yield Path(f"{number}.png")

    def unread(*_):
        raise BrokenPipeError

    results = "hpcwhirl.store.reading.results_file.Results"
    monkeypatch.setattr(results, lambda place: place)
    monkeypatch.setattr("hpcwhirl.report.figures.kinds.draw_figures", figures)
    monkeypatch.setattr("builtins.print", unread)
    assert main(["figures", str(tmp_path)]) == 1
    assert drawn == [0, 1, 2]


@pytest.mark.slow
def test_no_message_is_written_into_a_journal(tmp_path):
    """Where a stream is closed, the next file that is opened would have its number."""
    (tmp_path / "c.toml").write_text(
        "scene = {duration = 2e-4}\nsolver = {time_step = 2e-6}\n"
        "sweep = {speed = [300, 410]}\n"
    )
    done = shell("hpcwhirl campaign c.toml --out o --map no <&- >&- 2>&-", tmp_path)
    assert done.returncode == 0
    for path in (tmp_path / "o/journal").iterdir():
        assert sum(end - begin for begin, end, _ in kept(path)) == (
            path.stat().st_size - kept(path)[0][0]
        )


@pytest.mark.turns
@pytest.mark.parametrize(
    ("letter", "key", "why"),
    [
        ("x", "name", "at most 200 characters"),
        ("\\u0001", "name", "at most 200 characters"),
        ("x", "file", "cannot read"),
        ("\\u0001", "file", "must have no control characters"),
    ],
)
def test_a_name_of_thousands_of_letters_is_a_short_line(
    tmp_path, capsys, letter, key, why
):
    path = tmp_path / "long.toml"
    path.write_text(f'[engine]\n{key} = "{letter * 70_000}"\n')
    assert main(["model", str(path)]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert why in said
    assert len(said) < 700


def test_an_input_that_others_give_way_to_is_told_where_it_is_no_number(capsys):
    given = ["--set", "accuracy=much", "--set", "time_step=1e-6"]
    assert main(["model", "table2", *given]) == 2
    assert "accuracy must be a number, got 'much'" in capsys.readouterr().err


@pytest.mark.parametrize("speed", ["1e7", "-1e7", "1e308", "-1e308"])
def test_a_limit_of_the_speed_is_one_that_the_speed_exceeds(speed, capsys):
    assert main(["run", "--quiet", "--set", f"speed={speed}"]) == 2
    told = capsys.readouterr().err
    sign, limit = told.partition("speed must be ")[2].split()[:2]
    assert sign == ("<" if float(speed) > 0 else ">")
    assert 0 < float(limit) / float(speed) < 1
    assert abs(float(limit)) == pytest.approx(157080, rel=1e-5)


def test_a_file_that_may_not_be_read_is_not_called_damaged(tmp_path, monkeypatch):
    """The tests may run as root, who may read all: the refusal is made up."""

    def refuse(path, *_):
        raise PermissionError(13, f"Unable to open\n {path}", str(path))

    place = tmp_path / "results.h5"
    place.write_bytes(b"")
    monkeypatch.setattr("h5py.File", refuse)
    monkeypatch.setattr("hpcwhirl.store.directory.manifest.read_regular", refuse)
    with pytest.raises(MissingFileError, match=r"^cannot read .* Permission denied$"):
        opened(place)
    with (
        pytest.raises(MissingFileError, match=r"^cannot read .* Permission denied$"),
        reading(place),
    ):
        refuse(place)
    with pytest.raises(MissingFileError, match=r"^cannot read .*: Permission denied$"):
        PlanFile(tmp_path).read()
