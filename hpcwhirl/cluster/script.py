"""Text of a job script: directives, environment, campaign, requeueing on exit 75."""

from __future__ import annotations

from shlex import quote

from hpcwhirl.cluster.request import Request
from hpcwhirl.cluster.schedulers import SCHEDULERS, Lines, Scheduler

PRINTED = "# Printed by: "
ENVIRONMENT = """\
set -u
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1
mkdir -p "$out"
# compiled kernels, kept for the next run; all ranks must be able to write there
export NUMBA_CACHE_DIR="${NUMBA_CACHE_DIR:-$(cd "$out" && pwd)/numba-cache}"
"""
WAIT = """\
  running=$!
  [ "$told" = no ] || stop  # a signal came between the start and running=$!
  while :; do  # a trapped signal ends `wait` although the ranks still run: wait again
    caught=no code=0
    wait "$running" || code=$?
    [ "$caught" = yes ] || break
  done
"""
EARLY = """\
# Ranks die of a signal that comes before Python handles it: nothing is lost, requeue.
if [ "$told" = yes ]; then
  case $code in 0 | 1 | 2 | 70) ;; *) code=75 ;; esac
fi
"""
USED_UP = """\
used_up() {
  echo "hpcwhirl: started again $most_requeues times, and there is more to do:" \\
    "submit it once more" >&2
}
"""


def job_script(request: Request) -> str:
    """Return the text of the job script that a request asks for."""
    scheduler = SCHEDULERS[request.scheduler]
    parts = [
        _head(request, scheduler),
        _traps(scheduler),
        _settings(request, scheduler),
        ENVIRONMENT,
        _work(request, scheduler),
        _start(request, scheduler),
        _end(request, scheduler),
    ]
    return "\n".join(parts)


def _text(lines: Lines) -> str:
    return "".join(line + "\n" for line in lines)


def _head(request: Request, scheduler: Scheduler) -> str:
    directives = [scheduler.sentinel + line for line in scheduler.directives(request)]
    path = quote(request.script) if request.script else "THIS_FILE"
    return _text([
        "#!/bin/bash",
        *directives,
        f"{PRINTED}{request.command()}",
        f"# Submit with: {scheduler.submit} {path}",
    ])  # fmt: skip


def _settings(request: Request, scheduler: Scheduler) -> str:
    modules = [f"module load {quote(module)}" for module in request.modules]
    venv = f"source {quote(request.venv.rstrip('/') + '/bin/activate')}"
    return _text([
        "set -eo pipefail",
        *scheduler.opening,
        f"file={quote(request.file)}",
        f"out={quote(request.out)}",
        f"ranks={request.ntasks}",
        f"most_requeues={request.requeues}",
        *(modules or ["# module load the MPI that mpi4py was built for (--module)"]),
        venv if request.venv else "# source VENV/bin/activate (--venv)",
    ])  # fmt: skip


def _work(request: Request, scheduler: Scheduler) -> str:
    lines = ['work=(hpcwhirl campaign "$file" --out "$out")']
    if request.array:
        lines.append(f"shard={scheduler.index}")
        lines.append(f'work+=(--shard "$shard/{request.array}")')
    elif request.shard:
        lines.append(f"work+=(--shard {quote(request.shard)})")
    return _text(lines)


def _traps(scheduler: Scheduler) -> str:
    """Return shell lines that trap a scheduler's signals, to stop the campaign."""
    warned, ended = scheduler.traps
    return _text([
        f"# {warned}: the time limit is near; stop the campaign, then requeue the job.",
        f"# {ended}: the job was cancelled; stop the campaign, do not requeue.",
        "running='' again=yes told=no",
        "# shellcheck disable=SC2317,SC2329  # the traps call it",
        "stop() {",
        "  caught=yes told=yes",
        '  [ -n "$running" ] || return 0',
        f"  {scheduler.stop} || true",
        "  # send it twice: a process that is just starting may lose a signal",
        f"  {{ sleep 3; {scheduler.stop}; }} >/dev/null 2>&1 &",
        "}",
        f"trap stop {warned}",
        f"trap 'again=no; stop' {ended}",
    ])  # fmt: skip


def _start(request: Request, scheduler: Scheduler) -> str:
    return _text([
        "code=75  # as if stopped, if a signal came before the campaign began",
        'if [ "$told" = no ]; then',
        "  # USR2, which some schedulers send to all, must not kill the ranks",
        f"  (trap '' USR2; exec {scheduler.launch(request)} \"${{work[@]}}\") &",
        WAIT.rstrip("\n"),
        "fi",
        EARLY.rstrip("\n"),
    ])  # fmt: skip


def _end(request: Request, scheduler: Scheduler) -> str:
    again = [f"  {line}" for line in scheduler.again(request)]
    return USED_UP + _text([
        'if [ "$code" = 75 ] && [ "$again" = yes ]; then  # there is more to do',
        *again,
        "fi",
        'exit "$code"',
    ])  # fmt: skip
