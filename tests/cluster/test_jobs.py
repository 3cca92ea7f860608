"""Job scripts: what they ask a scheduler, what they quote, and what they do on 75."""

import os
import shlex
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from launch import LIMIT, ROOT, tree, wait_for

from hpcwhirl.campaign.foresight.forecast import forecast
from hpcwhirl.cli import main
from hpcwhirl.cli.forecast import job_line
from hpcwhirl.cluster.request import PRINTED, Request, job_script
from hpcwhirl.cluster.schedulers import SCHEDULERS, clock

TEMPLATES = sorted((ROOT / "jobs").glob("*.sh"))
AWKWARD = "a $(touch owned) `id` 'b' \"c\" ; & | > * \\ # ü.toml"
EVERY = [
    ("slurm", ("--nodes=3", "--array=1-8", "--signal=B:USR1@90", "--time=26:00:00")),
    ("pbs", ("-l select=2:ncpus=11:mpiprocs=11+1:ncpus=10:mpiprocs=10", "-J 1-8")),
    ("lsf", ('-J "big[1-8]"', '-R "span[ptile=11]"', "-wt 2", "-W 26:00", '-Q "75"')),
    ("sge", ("-t 1-8", "-l h_rt=26:00:00", "-pe orte 32")),
    ("flux", ("--nslots=32", "--time-limit=93600s", "--signal=USR1@90s", "--nodes=3")),
]


@pytest.fixture(autouse=True)
def campaigns(tmp_path_factory, monkeypatch):
    """Work where the campaigns are that jobs are asked for."""
    place = tmp_path_factory.mktemp("campaigns")
    shutil.copytree(ROOT / "jobs", place / "jobs")
    for name in ("c.toml", "-c.toml"):
        (place / name).write_text("[sweep]\nspeed = [300, 410]\n")
    monkeypatch.chdir(place)


def request(scheduler, **options):
    given = {"script": "job.sh"} if scheduler == "pbs" else {}
    return Request(scheduler, **({"file": "c.toml"} | given | options))


def run_bash(text, place, **variables):
    """Run a script with stand-ins for the tools of a scheduler; return it, ended."""
    environment = {"PATH": f"{place}/bin:{os.environ['PATH']}", "HOME": str(place)}
    call = ["bash", "-s"]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    process = subprocess.Popen(
        call, stdin=subprocess.PIPE, cwd=place, env=environment | variables, **pipes
    )
    process.stdin.write(text)
    process.stdin.close()
    process.stdin = None
    return process


@pytest.fixture
def tools(tmp_path):
    """Make launchers that run what they start once, and schedulers that only note."""
    (tmp_path / "bin").mkdir()
    passes = 'while [ "$1" != hpcwhirl ]; do shift; done; exec "$@"'
    notes = 'printf "%s\\n" "$(basename "$0") $*" >>noted'
    campaign = 'printf %s "${NUMBA_CACHE_DIR-}" >cache\n'
    campaign += 'printf "%s\\n" "$@" >words; trap "exit 75" USR1; echo begun >begun\n'
    campaign += f"for i in $(seq {20 * LIMIT}); do sleep 0.05; "
    campaign += "[ -e finish ] && exit $(cat finish); done; exit 70"
    texts = dict.fromkeys(("mpirun", "srun", "flux"), passes)
    texts |= {"scontrol": notes, "qsub": f"{notes}; cat >>submitted"}
    texts["hpcwhirl"] = campaign
    texts["flux"] = f'if [ "$1" = --parent ]; then {notes}; exit 0; fi; {passes}'
    for name, text in texts.items():
        (tmp_path / "bin" / name).write_text(f"#!/bin/bash\n{text}\n")
        (tmp_path / "bin" / name).chmod(0o755)
    return tmp_path


VARIABLES = {
    "slurm": {"SLURM_JOB_ID": "7"},
    "pbs": {"PBS_JOBID": "7"},
    "lsf": {"LSB_JOBID": "7"},
    "sge": {"JOB_ID": "7", "SGE_TASK_ID": "undefined"},
    "flux": {},
}


def begin(scheduler, place, variables=None, **options):
    variables = variables or VARIABLES[scheduler]
    variables = variables | {"PBS_O_WORKDIR": str(place)}
    (place / "begun").unlink(missing_ok=True)
    (place / "job.sh").write_text("#PBS -N x\n#PBS -J 1-4\necho once more\n")
    process = run_bash(job_script(request(scheduler, **options)), place, **variables)
    end = time.monotonic() + LIMIT
    while not (place / "begun").exists():
        assert time.monotonic() < end, process.communicate(timeout=1)
        assert process.poll() is None, process.communicate()
        time.sleep(0.01)
    return process


def end_with(place, code):
    """Have the campaign end with a code; the file is there whole or not at all."""
    (place / "code").write_text(str(code))
    (place / "code").replace(place / "finish")


def all_wait(pid):
    """Return whether a process and all that descend from it wait for something."""
    try:
        states = [Path(f"/proc/{one}/stat").read_text() for one in tree(pid)]
    except OSError:  # one has just ended
        return False
    return all(state.rpartition(") ")[2].startswith("S") for state in states)


def signalled(scheduler, place, number, variables=None, **options):
    process = begin(scheduler, place, variables, **options)
    # the campaign has begun, but who started it may not know its number yet
    wait_for(lambda: all_wait(process.pid), process)
    if scheduler == "flux" and number == signal.SIGUSR1:  # Flux tells the ranks itself
        end_with(place, 75)
    process.send_signal(number)
    process.out, process.err = process.communicate(timeout=LIMIT)
    return process


def noted(place):
    path = place / "noted"
    return path.read_text().splitlines() if path.exists() else []


@pytest.mark.turns
def test_the_templates_are_what_the_command_prints(tmp_path, monkeypatch):
    assert {path.stem for path in TEMPLATES} >= set(SCHEDULERS)
    for path in TEMPLATES:
        text = path.read_text()
        (line,) = [li for li in text.splitlines() if li.startswith(PRINTED)]
        shutil.copytree(ROOT / "jobs", tmp_path / "jobs", dirs_exist_ok=True)
        (tmp_path / "jobs" / path.name).unlink()
        (tmp_path / "campaign.toml").write_text("[sweep]\nspeed = [300, 410]\n")
        monkeypatch.chdir(tmp_path)
        words = shlex.split(line.removeprefix(PRINTED))
        assert main([*words[1:]]) == 0
        same = (tmp_path / "jobs" / path.name).read_text() == text
        assert same, f"print {path.name} anew: {shlex.join(words)}"


@pytest.mark.parametrize("path", TEMPLATES, ids=lambda path: path.name)
def test_the_templates_are_sound_shell(path):
    subprocess.run(["bash", "-n", path], check=True)
    done = subprocess.run(
        ["shellcheck", path], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize(("scheduler", "lines"), EVERY, ids=[one for one, _ in EVERY])
def test_what_is_asked_for_stands_in_the_directives(scheduler, lines):
    options = {"ntasks": 32, "name": "big", "time": "1-02:00:00", "warning": 90}
    if scheduler == "sge":
        options["pe"] = "orte"
    else:
        options["nodes"] = 3
    if scheduler != "flux":
        options["array"] = 8
    script = job_script(request(scheduler, **options)).splitlines()
    sentinel = SCHEDULERS[scheduler].sentinel
    own = [li.removeprefix(sentinel) for li in script if li.startswith(sentinel)]
    for line in lines:
        assert line in own
    first = script.index(sentinel + own[0])
    assert script[first : first + len(own)] == [sentinel + line for line in own]
    assert first == 1


@pytest.mark.turns
@given(
    st.sampled_from(sorted(SCHEDULERS)),
    st.integers(1, 10**6),
    st.integers(60, 10**7),
    st.text(st.characters(exclude_categories=["C", "Z"]), min_size=1),
    st.lists(st.sampled_from(["openmpi/5", "a b", "x;y", "gcc"]), max_size=3),
)
def test_the_printed_command_prints_the_same_again(scheduler, ranks, time_, out, load):
    limit = clock(time_ % 3_000_000 + 60)
    asked = Request(
        scheduler, "c.toml", out=f"./{out}", ntasks=ranks, time=limit,
        modules=tuple(load), script="job.sh", warning=30,
    )  # fmt: skip
    if scheduler == "slurm":
        asked = replace(asked, constraint=tuple(one for one in load if one.isalnum()))
    words = shlex.split(asked.command())
    found = {}

    def keep(args):
        values = {name: getattr(args, name) for name in Request.__dataclass_fields__}
        lists = {n: tuple(v) for n, v in values.items() if isinstance(v, list)}
        found["request"] = Request(**(values | lists))
        return 0

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("hpcwhirl.cli.job.run", keep)
        assert main(words[1:]) == 0
    assert found["request"] == asked


@pytest.mark.parametrize("scheduler", sorted(SCHEDULERS))
def test_awkward_names_reach_the_campaign_as_they_are(scheduler, tools):
    process = begin(scheduler, tools, file=AWKWARD, out=f"{AWKWARD}.d")
    end_with(tools, 0)
    process.communicate(timeout=LIMIT)
    assert process.returncode == 0
    words = (tools / "words").read_text().splitlines()
    assert words == ["campaign", AWKWARD, "--out", f"{AWKWARD}.d"]
    assert not (tools / "owned").exists()
    assert (tools / f"{AWKWARD}.d").is_dir()


@pytest.mark.parametrize("given", ["", "/home/me/kernels"])
@pytest.mark.parametrize("scheduler", SCHEDULERS)
def test_a_job_keeps_compiled_code_where_the_user_says_and_not_among_results(
    scheduler, given, tools
):
    """It is executed when it is loaded; others may be allowed to write results."""
    own = {"NUMBA_CACHE_DIR": given} if given else {}
    process = begin(scheduler, tools, VARIABLES[scheduler] | own)
    end_with(tools, 0)
    process.communicate(timeout=LIMIT)
    assert (tools / "cache").read_text() == given


@pytest.mark.parametrize("code", [0, 1, 2, 70])
def test_other_codes_end_the_job(tools, code):
    end_with(tools, code)
    for scheduler in SCHEDULERS:
        process = begin(scheduler, tools)
        process.communicate(timeout=LIMIT)
        assert process.returncode == code
    assert noted(tools) == []


COMES_AGAIN = {
    "slurm": (75, ["scontrol requeue 7"]),
    "pbs": (75, ["qsub -v HPCWHIRL_REQUEUES=1"]),
    "lsf": (75, []),
    "sge": (99, []),
    "flux": (75, ["flux --parent batch job.sh"]),
}


@pytest.mark.parametrize("scheduler", sorted(SCHEDULERS))
def test_a_warning_stops_the_campaign_and_brings_the_job_back(scheduler, tools):
    process = signalled(scheduler, tools, signal.SIGUSR1, script="job.sh")
    code, calls = COMES_AGAIN[scheduler]
    assert process.returncode == code, process.err
    assert noted(tools) == calls


@pytest.mark.parametrize("scheduler", sorted(set(SCHEDULERS) - {"flux"}))
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGUSR2])
def test_a_job_that_someone_ended_stays_ended(scheduler, tools, number):
    process = signalled(scheduler, tools, number)
    assert process.returncode == 75, process.err
    assert noted(tools) == []


@pytest.mark.parametrize("scheduler", sorted(SCHEDULERS))
def test_a_job_without_requeues_says_that_there_is_more(scheduler, tools):
    process = signalled(scheduler, tools, signal.SIGUSR1, requeues=0, script="job.sh")
    assert process.returncode == (1 if scheduler in {"lsf", "sge"} else 75)
    assert noted(tools) == []
    assert "there is more to do" in process.err


@pytest.mark.parametrize("scheduler", ["lsf", "sge"])
def test_a_counted_job_comes_again_as_often_as_it_may(scheduler, tools):
    codes = [
        signalled(scheduler, tools, signal.SIGUSR1, requeues=2).returncode
        for _ in range(3)
    ]
    code = COMES_AGAIN[scheduler][0]
    assert codes == [code, code, 1]


def test_an_element_of_a_pbs_array_comes_again_by_itself(tools):
    for name, shard in (("PBS_ARRAY_INDEX", "3"), ("HPCWHIRL_SHARD", "3")):
        variables = {"PBS_JOBID": "7[3]", name: shard}
        signalled("pbs", tools, signal.SIGUSR1, variables, array=4)
        assert (tools / "words").read_text().splitlines()[-2:] == ["--shard", "3/4"]
    assert noted(tools) == ["qsub -v HPCWHIRL_REQUEUES=1,HPCWHIRL_SHARD=3"] * 2
    assert (tools / "submitted").read_text() == "#PBS -N x\necho once more\n" * 2


@pytest.mark.turns
@pytest.mark.parametrize("scheduler", ["pbs", "sge"])
def test_a_script_warns_itself_where_its_scheduler_does_not(scheduler, tools):
    process = begin(scheduler, tools, time="00:01:00", warning=55, script="job.sh")
    process.communicate(timeout=LIMIT)
    assert (process.returncode, noted(tools)) == COMES_AGAIN[scheduler]


WRONG = [
    ("slurn c.toml", "'slurn' 'slurm'"),
    ("slurm c.toml --ntasks 0", "--ntasks >= 1 0"),
    ("slurm c.toml --ntasks many", "--ntasks 'many'"),
    ("slurm c.toml --time 4h", "--time HH:MM:SS '4h'"),
    ("slurm c.toml --time 00:00:10", "--time 00:00:10"),
    ("slurm c.toml --warning 14400", "--warning <= 14399 14400"),
    ("slurm c.toml --nodes 33", "--nodes <= 32 33"),
    ("slurm c.toml --array 1", "--array >= 2 1"),
    ("slurm c.toml --array 4 --shard 1/4", "--array --shard"),
    ("slurm c.toml --shard 5/4", "--shard '5/4'"),
    ("slurm c.toml --launcher jsrun", "--launcher 'jsrun' mpirun srun"),
    ("slurm c.toml --mpi pmix", "--mpi --launcher srun"),
    ("slurm c.toml --partition a;b", "--partition 'a;b'"),
    ("slurm c.toml --account=-x", "--account '-x'"),
    ("sge c.toml --nodes 2", "--nodes --pe"),
    ("flux c.toml --array 4", "arrays --shard 1/4 4/4"),
    ("pbs c.toml", "--script"),
    ("slurm -- -c.toml", "file '-c.toml'"),
    ("slurm c.toml --mem 4x", "--mem 4G '4x'"),
    ("slurm c.toml --qos a;b", "--qos 'a;b'"),
    ('slurm c.toml --constraint a"b', "--constraint 'a\"b'"),
    ("slurm c.toml --constraint a|b --constraint c", "--constraint | only"),
    ("pbs c.toml --script j --mem 4G", "--mem slurm pbs"),
    ("slurm c.toml --set speed=3", "--set [scene]"),
    ("slurm c.toml --preset draft", "--preset [solver]"),
]


@pytest.mark.parametrize(("line", "told"), WRONG, ids=[line for line, _ in WRONG])
def test_wrong_wishes_are_one_line(capsys, line, told):
    assert main(["job", *line.split()]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("hpcwhirl: error: ")
    assert err.count("\n") == 1
    assert all(word in err for word in told.split())


@pytest.mark.parametrize("odd", ["a\nb", "a\rb", "a\x1bb", "a\0b", "\u2028"])
@pytest.mark.parametrize(
    "option", ["--name", "--partition", "--account", "--venv", "--module", "--out"]
)
def test_nothing_breaks_out_of_its_line(capsys, option, odd):
    assert main(["job", "slurm", "c.toml", option, odd]) == 2
    assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.turns
def test_a_file_that_is_no_job_script_is_kept(tmp_path, capsys):
    mine = tmp_path / "campaign.toml"
    mine.write_text("mine")
    assert main(["job", "slurm", "c.toml", "--script", str(mine)]) == 2
    assert "is kept" in capsys.readouterr().err
    assert mine.read_text() == "mine"
    script = tmp_path / "job.sh"
    for ranks in ("2", "3"):
        words = ["job", "slurm", "c.toml", "--ntasks", ranks, "--script", str(script)]
        assert main([*words]) == 0
        assert f"--ntasks={ranks}\n" in script.read_text()
    assert capsys.readouterr().out == f"sbatch {script}\n" * 2


@pytest.mark.turns
def test_a_job_takes_directory_and_time_from_the_campaign_s_file(
    tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    rules = '[campaign]\nout = "scratch/whirl"\nwalltime = "08:00:00"\n'
    rules += "[sweep]\nspeed = [300, 410]\n"
    (tmp_path / "c.toml").write_text(rules)
    assert main(["job", "slurm", "c.toml"]) == 0
    text = capsys.readouterr().out
    assert "\nout=scratch/whirl\n" in text
    assert "--time=08:00:00\n" in text
    words = ["job", "slurm", "c.toml", "--out", "x", "--time", "01:00:00"]
    assert main([*words]) == 0
    text = capsys.readouterr().out
    assert "\nout=x\n" in text
    assert "--time=01:00:00\n" in text
    (tmp_path / "c.toml").write_text("[campaign]\nwaltime = '08:00:00'\n")
    assert main(["job", "slurm", "c.toml"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert "did you mean 'walltime'" in err


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (None, "cannot read nothere.toml"),
        ("[sweep]\nsped = [1]\n", "did you mean 'speed'"),
        ("[sweep", "nothere.toml"),
        ("[sweep]\nspeed = [300, 300]\n", "have the same inputs"),
        ("[sweep]\nfriction = [0.0, -0.0]\n", "have the same inputs: friction = 0.0"),
    ],
)
def test_a_job_of_what_is_no_campaign_is_refused_before_it_waits(capsys, text, told):
    if text is not None:
        Path("nothere.toml").write_text(text)
    assert main(["job", "slurm", "nothere.toml"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert told in err


def test_shards_of_what_follows_from_words_are_refused(tmp_path, capsys):
    path = tmp_path / "refined.toml"
    path.write_text(
        '[sweep]\nspeed = [300.0, 400.0]\n[refine]\nover = "speed"\nlevels = 1\n'
    )
    assert main(["job", "slurm", str(path), "--out", "x", "--array", "4"]) == 2
    assert "[refine] needs the words of all cases" in capsys.readouterr().err


def test_what_slurm_alone_has_is_quoted_and_the_home_is_found(capsys, monkeypatch):
    monkeypatch.setenv("HOME", "/home/me")
    words = "--mem 4G --qos long --constraint milan --constraint ib --venv ~/venv"
    assert main(["job", "slurm", "c.toml", *words.split()]) == 0
    text = capsys.readouterr().out
    for line in ("--mem=4G", "--qos=long", '--constraint="milan&ib"'):
        assert f"#SBATCH {line}\n" in text
    assert "\nsource /home/me/venv/bin/activate\n" in text


def test_core_hours_are_told_beside_the_time_limit(capsys, monkeypatch):
    asked = []

    def kept(*args):
        asked.append(forecast(*args))
        return asked[0]

    monkeypatch.setattr("hpcwhirl.campaign.foresight.forecast.forecast", kept)
    assert main(["job", "slurm", "c.toml", "--time", "24:00:00"]) == 0
    out, err = capsys.readouterr()
    assert out.startswith("#!/bin/bash\n")
    (cost,) = asked
    low, high = (f"{seconds / 3600:.3g}" for seconds in cost.range)
    assert 0.0 < cost.range[0] < cost.seconds < cost.range[1]
    told = f"nominally {low} (no contact) to {high} core-hours (always in contact), "
    assert err.startswith(f"hpcwhirl: {told}")
    assert err.endswith(
        " on 32 ranks, campaign --pilot 20 measures the cost; --time 24:00:00\n"
    )
    for day, told in ((1.5, "may not be enough"), (4.0, "is not enough")):
        low, *rest = (32 * 86400 * day * part for part in (0.5, 0.6, 1.0))
        more = replace(cost, range=(low, rest[1]), seconds=rest[0], finished=9)
        line = job_line(more, 32, request("slurm", time="24:00:00"))
        assert f" {told} for all: the job is requeued up to 20 times" in line
        assert f"predicted {rest[0] / 3600:.3g} core-hours" in line


def test_a_job_script_loads_no_validation_of_inputs():
    """Loading pydantic would take longer than all else that the command does."""
    check = "import sys, hpcwhirl.cli.job; sys.exit('pydantic' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", check], check=False).returncode == 0
