"""What differs between schedulers in a job script, as one entry for each of them.

The differences are directives, array index, signals and requeueing.

Sources: man pages sbatch, srun and scontrol of Slurm 22.05; qsub(1B) and qrerun(1B) of
OpenPBS; IBM's reference of bsub (-wa, -wt, -Q); sge_submit(1) and queue_conf(5) of Son
of Grid Engine 8.1.9; flux-batch(1), and flux-core's issues 5105 and 6729 on signals.
`scripts/test_cluster.sh` runs the scripts under Slurm 22.05 and Son of Grid Engine
8.1.9, as in Debian 12, on one node. Scripts for PBS, LSF and Flux have run only with
stand-ins for those schedulers' commands (`tests/cluster/test_jobs.py`).
"""

from __future__ import annotations

import shlex
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hpcwhirl.cluster.request import Request

Lines = list[str]


@dataclass(frozen=True)
class Scheduler:
    """What a job script needs to know of one scheduler, such as Slurm.

    Attributes
    ----------
    sentinel : beginning of a directive's line
    submit : command that submits a script, to be followed by its path
    index : shell expression for the number of an array's element, from 1
    directives : function from a request to its directives, without `sentinel`
    launch : function from a request to the shell words that start the ranks
    again : function from a request to the shell lines that requeue the job; the lines
        may end the script
    stop : shell command that asks the running ranks to stop
    traps : names of the signals that warn of the time limit, and of those that cancel
    opening : shell lines that precede the campaign's settings
    launchers : programs that may start the ranks, the default first
    """

    sentinel: str
    submit: str
    index: str
    directives: Callable[[Request], Lines]
    launch: Callable[[Request], str]
    again: Callable[[Request], Lines]
    stop: str = 'kill -USR1 "$running"'
    traps: tuple[str, str] = ("USR1", "TERM INT USR2")
    opening: tuple[str, ...] = ()
    launchers: tuple[str, ...] = ("mpirun", "mpiexec")


def clock(seconds: int) -> str:
    """Return a duration as text HH:MM:SS for a scheduler; hours may exceed 24.

    seconds : the duration, s
    """
    minutes, rest = divmod(seconds, 60)
    return f"{minutes // 60:02d}:{minutes % 60:02d}:{rest:02d}"


def _given(option: str, value: object) -> Lines:
    return [f"{option}{value}"] if value else []


def _mpirun(request: Request) -> str:
    return f'{request.starts_with} -n "$ranks"'


def _slurm(request: Request) -> Lines:
    log = "%x-%A_%a.log" if request.array else "%x-%j.log"
    features = "&".join(request.constraint)
    return [
        f"--job-name={request.name}",
        f"--ntasks={request.ntasks}",
        "--cpus-per-task=1",
        *_given("--nodes=", request.nodes),
        *_given("--ntasks-per-node=", request.per_node),
        f"--time={clock(request.seconds)}",
        *_given("--partition=", request.partition),
        *_given("--account=", request.account),
        *_given("--mem=", request.mem),
        *_given("--qos=", request.qos),
        # Slurm removes these quotes, as a shell would
        *_given("--constraint=", features and f'"{features}"'),
        *_given("--array=1-", request.array),
        f"--signal=B:USR1@{request.warning}",
        "--requeue",
        "--open-mode=append",
        f"--output={log}",
    ]


def _slurm_launch(request: Request) -> str:
    if request.starts_with != "srun":
        return _mpirun(request)
    # Ranks that stop exit with 75 one after the other: srun must not kill the others at
    # the first exit. But if a rank crashes, the others are killed after 60 s.
    options = "--kill-on-bad-exit=0 --wait=60"
    return f'srun{f" --mpi={request.mpi}" if request.mpi else ""} {options} -n "$ranks"'


def _unless_used_up(used: str, *lines: str) -> Lines:
    """Return shell lines that requeue a job, if it may be requeued once more.

    Otherwise they say that the requeues are used up.

    Parameters
    ----------
    used : shell expression for the number of requeues so far
    lines : shell lines that requeue the job
    """
    return [
        f'if [ "{used}" -lt "$most_requeues" ]; then',
        *(f"  {line}" for line in lines),
        *("else", "  used_up", "fi"),
    ]


def _slurm_again(request: Request) -> Lines:
    # in an array, SLURM_JOB_ID of one of the elements is the number of the whole array
    job = '"$SLURM_JOB_ID"'
    if request.array:
        job = '"${SLURM_ARRAY_JOB_ID}_$SLURM_ARRAY_TASK_ID"'
    return _unless_used_up("${SLURM_RESTART_COUNT:-0}", f"scontrol requeue {job}")


def _pbs(request: Request) -> Lines:
    chunk = f"{request.ntasks}:ncpus=1:mpiprocs=1"
    if request.nodes:
        whole, rest = divmod(request.ntasks, request.per_node)
        sizes = [(whole, request.per_node), (1, rest)]
        parts = [f"{n}:ncpus={p}:mpiprocs={p}" for n, p in sizes if n * p]
        chunk = "+".join(parts)
    return [
        "-S /bin/bash",
        f"-N {request.name}",
        f"-l select={chunk}",
        f"-l walltime={clock(request.seconds)}",
        *_given("-q ", request.partition),
        *_given("-A ", request.account),
        *_given("-J 1-", request.array),
        "-j oe",
        "-r y",
    ]


def _timed(request: Request) -> str:
    # `timeout` sends the warning, since the scheduler's is not reliable: PBS sends TERM
    # only at the limit, and KILL seconds later; Grid Engine kills a requeued job at
    # s_rt as if that were h_rt.
    limit = request.seconds - request.warning
    return f"timeout --foreground --preserve-status -s USR1 {limit} {_mpirun(request)}"


def _pbs_again(request: Request) -> Lines:
    if not request.script:
        return ["used_up"]
    shard = ",HPCWHIRL_SHARD=$shard" if request.array else ""
    return [
        "used=${HPCWHIRL_REQUEUES:-0}",
        *_unless_used_up(
            "$used",
            "# qrerun is for operators: submit a new job, of an array this element",
            f"sed '/^#PBS -J /d' {shlex.quote(request.script)} |",
            f'  qsub -v "HPCWHIRL_REQUEUES=$((used + 1)){shard}"',
        ),
    ]


def _lsf(request: Request) -> Lines:
    name = f'"{request.name}[1-{request.array}]"' if request.array else request.name
    minutes = -(-request.seconds // 60)
    return [
        f"-J {name}",
        f"-n {request.ntasks}",
        *_given('-R "span[ptile=', f'{request.per_node}]"' if request.nodes else ""),
        f"-W {minutes // 60}:{minutes % 60:02d}",
        *_given("-q ", request.partition),
        *_given("-P ", request.account),
        f"-wt {-(-request.warning // 60)}",
        "-wa USR1",
        *_given("-Q ", '"75"' if request.requeues else ""),
        "-r",
        f"-o {request.name}-%J{'-%I' if request.array else ''}.log",
    ]


def _sge(request: Request) -> Lines:
    return [
        "-S /bin/bash",
        "-cwd",
        f"-N {request.name}",
        f"-pe {request.pe} {request.ntasks}",
        f"-l h_rt={clock(request.seconds)}",
        *_given("-q ", request.partition),
        *_given("-P ", request.account),
        *_given("-t 1-", request.array),
        "-notify",
        "-r y",
        "-j y",
    ]


def _counted(job: str, code: int) -> Callable[[Request], Lines]:
    """Return `Scheduler.again` for a scheduler that requeues a job by its exit code.

    Such a scheduler does not tell a job how often it was requeued, so a file counts.

    Parameters
    ----------
    job : shell text that identifies the job, in the name of the file that counts its
        requeues
    code : exit code with which the scheduler requeues a job
    """

    def again(_request: Request) -> Lines:
        return [
            f'count="$out/requeues-{job}"',
            'used=$(cat "$count" 2>/dev/null || echo 0)',
            'if [ "$used" -lt "$most_requeues" ]; then',
            '  echo "$((used + 1))" >"$count"',
            f"  exit {code}",
            "fi",
            "used_up",
            "code=1  # not 75, at which some schedulers requeue the job",
        ]

    return again


def _flux(request: Request) -> Lines:
    return [
        f"--job-name={request.name}",
        f"--nslots={request.ntasks}",
        *_given("--nodes=", request.nodes),
        f"--time-limit={request.seconds}s",
        *_given("--queue=", request.partition),
        *_given("--bank=", request.account),
        f"--signal=USR1@{request.warning}s",
        f"--output={request.name}-{{{{id}}}}.log",
    ]


def _flux_again(request: Request) -> Lines:
    script = shlex.quote(request.script) if request.script else '"$0"'
    return [
        "used=${HPCWHIRL_REQUEUES:-0}",
        *_unless_used_up(
            "$used",
            "export HPCWHIRL_REQUEUES=$((used + 1))",
            f"flux --parent batch {script}",
        ),
    ]


SCHEDULERS = {
    "slurm": Scheduler(
        "#SBATCH ", "sbatch", "$SLURM_ARRAY_TASK_ID",
        _slurm, _slurm_launch, _slurm_again,
        launchers=("mpirun", "mpiexec", "srun"),
    ),
    "pbs": Scheduler(
        "#PBS ", "qsub", "${PBS_ARRAY_INDEX:-$HPCWHIRL_SHARD}",
        _pbs, _timed, _pbs_again,
        opening=('cd "$PBS_O_WORKDIR"',),
    ),
    "lsf": Scheduler(
        "#BSUB ", "bsub <", "$LSB_JOBINDEX",
        _lsf, _mpirun, _counted("${LSB_JOBID}_${LSB_JOBINDEX:-0}", 75),
    ),
    "sge": Scheduler(
        "#$ ", "qsub", "$SGE_TASK_ID",
        _sge, _timed, _counted("${JOB_ID}_$SGE_TASK_ID", 99),
    ),
    "flux": Scheduler(
        "# flux: ", "flux batch", "",
        _flux, lambda _: 'flux run -n "$ranks"', _flux_again,
        # Flux itself forwards USR1 to the ranks; the signal would end flux run
        stop='[ "$again" = yes ] || flux cancel --all', traps=("USR1", "TERM INT HUP"),
        launchers=("flux",),
    ),
}  # fmt: skip
