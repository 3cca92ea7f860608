"""Job scripts for `hpcwhirl job`: check the options, and fill the template.

No value of an option can inject shell or directives.
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from importlib import resources
from string import Template
from typing import Any

from hpcwhirl.cluster.schedulers import SCHEDULERS
from hpcwhirl.errors import InputError, unknown
from hpcwhirl.launch import MOST_SHARDS, parse_shard

WORD = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.+-]{0,99}")
PLACE = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.,:@/+=-]{0,199}")
TIME = re.compile(r"(?:(\d{1,3})-)?(\d{1,3}):([0-5]\d):([0-5]\d)")
WORDS = {"name": WORD, "partition": PLACE, "account": PLACE, "mpi": WORD, "pe": WORD}
SIZE = re.compile(r"[1-9]\d{0,11}[KMGT]?")
FEATURES = re.compile(r"[A-Za-z0-9_(\[][A-Za-z0-9_.:,&|*()\[\]@-]{0,199}")
SLURM = {  # options of Slurm only: (form, its description)
    "mem": (SIZE, "a size such as 4G"),
    "qos": (WORD, "the name of a quality of service"),
    "constraint": (FEATURES, "features of nodes such as 'milan&ib'"),
}
MOST_TASKS = 10_000_000  # largest number of ranks of a job
LONGEST = 365 * 86400  # s, longest time limit of a job
PRINTED = "# Printed by: "  # beginning of a line of every job script


def _option(shape: str, meaning: str, default: Any = "") -> Any:
    """Declare a field of `Request` that is an option of `hpcwhirl job`.

    shape, meaning : form of its value, such as "DIR"; its help text
    """
    return field(default=default, metadata={"shape": shape, "meaning": meaning})


@dataclass(frozen=True)
class Request:
    """The options of `hpcwhirl job`: what the script that runs a campaign must have.

    Attributes
    ----------
    scheduler : a key of `SCHEDULERS`
    file, out : campaign file and directory, arguments of `hpcwhirl campaign`
    ntasks : number of ranks of the job, or of each element of an array
    time : time limit, ``[D-]HH:MM:SS``
    nodes : number of nodes to spread the ranks over; 0: the scheduler's choice
    name : name of the job
    partition, account : queue and project; empty: the site's default
    mem, qos : memory per node, quality of service (Slurm); empty: the site's default
    constraint : features that nodes must all have (Slurm); a feature may be an
        expression with & and |
    array : number of elements of an array job, one shard each; 0: no array
    shard : ``I/N``, the single shard that this job computes; empty: all cases
    launcher : program that starts the ranks; empty: the scheduler's default
    mpi : value of ``srun --mpi``
    pe : parallel environment of Grid Engine
    venv : virtual environment to activate
    modules : environment modules to load, in this order
    requeues : how often the job may be started again while cases remain
    warning : time before the limit at which the campaign is signalled to stop, s
    script : path of the script that will be submitted; empty: unknown
    """

    # fmt: off
    scheduler: str
    file: str
    out: str = _option("DIR",
        "directory of the campaign (default: out in the file's [campaign], else the "
        "file's name without .toml)", "campaign")
    ntasks: int = _option("N",
        "number of ranks of the job, or of each array element (default 32)", 32)
    time: str = _option("[D-]HH:MM:SS",
        "time limit of the job (default: walltime in the file's [campaign], else 4 h)",
        "04:00:00")
    nodes: int = _option("N",
        "number of nodes to spread the ranks over (default: scheduler's choice)", 0)
    name: str = _option("NAME", "name of the job (default hpcwhirl)", "hpcwhirl")
    partition: str = _option("NAME", "partition or queue")
    account: str = _option("NAME", "account, project or bank")
    mem: str = _option("SIZE", "memory of each node, e.g. 4G (Slurm)")
    qos: str = _option("NAME", "quality of service (Slurm)")
    constraint: tuple[str, ...] = _option("FEATURES",
        "features that nodes must have, e.g. 'milan|genoa' (Slurm); if repeated, all "
        "of them", ())
    array: int = _option("N",
        "make an array job of N elements, each of which computes a shard", 0)
    shard: str = _option("I/N", "compute only the I-th of N shares of the campaign")
    launcher: str = _option("NAME",
        "program that starts the ranks: mpirun, mpiexec, srun (Slurm) or flux (Flux)")
    mpi: str = _option("NAME", "value of srun --mpi, e.g. pmix or pmi2")
    pe: str = _option("NAME",
        "parallel environment of Grid Engine (default mpi)", "mpi")
    venv: str = _option("DIR", "virtual environment to activate")
    modules: tuple[str, ...] = _option("NAME",
        "environment module to load; may be repeated", ())
    requeues: int = _option("N",
        "requeue the job up to N times while cases remain (default 20)", 20)
    warning: int = _option("N",
        "stop the campaign N seconds before the time limit (default 120)", 120)
    script: str = _option("PATH", "write the script to PATH instead of printing it")
    # fmt: on

    def __post_init__(self) -> None:
        """Check all options of the job script.

        Raises
        ------
        InputError
            for values that are unsafe in a script, out of range, or contradictory
        """
        if self.scheduler not in SCHEDULERS:
            raise unknown("scheduler", self.scheduler, SCHEDULERS)
        for name in ("file", "out", "venv", "script"):
            _check_path(name, getattr(self, name))
        for module in self.modules:
            _check_path("--module", module)
        for name, pattern in WORDS.items():
            value = getattr(self, name)
            if value and not pattern.fullmatch(value):
                msg = f"--{name} must be letters, digits and {_allowed(pattern)}, "
                raise InputError(msg + f"not beginning with '-', got {value!r}")
        self._check_slurm()
        self._check_numbers()
        self._check_together()

    def _check_slurm(self) -> None:
        """Raise InputError for Slurm's options, if wrong or for another scheduler."""
        for name, (pattern, what) in SLURM.items():
            given = getattr(self, name)
            for value in (given,) if isinstance(given, str) else given:
                if value and not pattern.fullmatch(value):
                    raise InputError(f"--{name} must be {what}, got {value!r}")
            if given and self.scheduler != "slurm":
                msg = f"--{name} is for slurm, got {self.scheduler}: add the directive "
                raise InputError(msg + "to the script by hand")
        if len(self.constraint) > 1 and any("|" in one for one in self.constraint):
            msg = "--constraint with | must be the only --constraint, got "
            raise InputError(msg + " and ".join(self.constraint))

    def _check_numbers(self) -> None:
        limits = {
            "ntasks": (1, MOST_TASKS),
            "nodes": (0, self.ntasks),
            "requeues": (0, 1000),
            "warning": (10, min(self.seconds - 1, 65535)),
        }
        for name, (least, most) in limits.items():
            value = getattr(self, name)
            if not least <= value <= most:
                msg = f"--{name} must be >= {least} and <= {most}, got {value}"
                raise InputError(msg)
        if self.array and not 2 <= self.array <= MOST_SHARDS:
            msg = f"--array must be >= 2 and <= {MOST_SHARDS}, got {self.array}"
            raise InputError(msg)

    def _check_together(self) -> None:
        """Raise InputError for options that exclude each other.

        The same is done for options that the scheduler does not have.
        """
        allowed = SCHEDULERS[self.scheduler].launchers
        if self.launcher and self.launcher not in allowed:
            msg = f"--launcher of {self.scheduler} must be {' or '.join(allowed)}"
            raise InputError(f"{msg}, got {self.launcher!r}")
        if self.mpi and self.starts_with != "srun":
            raise InputError("--mpi needs --launcher srun")
        if self.shard:
            parse_shard(self.shard)
        if self.shard and self.array:
            raise InputError("--array makes the shards itself: leave out --shard")
        if self.scheduler == "sge" and self.nodes:
            msg = "--nodes: in Grid Engine the parallel environment sets it, see --pe"
            raise InputError(msg)
        if self.scheduler == "flux" and self.array:
            msg = f"flux batch has no arrays: print {self.array} jobs with --shard "
            raise InputError(msg + f"1/{self.array} to {self.array}/{self.array}")
        if self.scheduler == "pbs" and self.requeues and not self.script:
            msg = "pbs needs --script PATH: the job submits PATH again while there is "
            raise InputError(msg + "more to do (--requeues 0: it does not)")

    @property
    def starts_with(self) -> str:
        """Name of the program that starts the ranks, such as mpirun."""
        return self.launcher or SCHEDULERS[self.scheduler].launchers[0]

    @property
    def seconds(self) -> int:
        """Time limit of the job, s."""
        match = TIME.fullmatch(self.time)
        if match is None:
            raise InputError(f"--time must be [D-]HH:MM:SS, got {self.time!r}")
        days, hours, minutes, seconds = (int(part or 0) for part in match.groups())
        total = ((24 * days + hours) * 60 + minutes) * 60 + seconds
        if not 60 <= total <= LONGEST:
            msg = f"--time must be >= 00:01:00 and <= 365-00:00:00, got {self.time}"
            raise InputError(msg)
        return total

    @property
    def per_node(self) -> int:
        """Number of ranks per node, on the last node perhaps fewer; 0: not set."""
        return -(-self.ntasks // self.nodes) if self.nodes else 0

    def command(self) -> str:
        """Return the command line `hpcwhirl job ...` that prints this script again."""
        words = ["hpcwhirl", "job", self.scheduler, self.file]
        for own in fields(self):
            value = getattr(self, own.name)
            if own.metadata and value != own.default:
                for one in value if isinstance(value, tuple) else (value,):
                    words += [option_of(own.name), str(one)]
        return shlex.join(words)


def option_of(name: str) -> str:
    """Return the option of `hpcwhirl job` that sets a field of `Request`.

    name : the field's name, such as "ntasks"
    """
    return "--module" if name == "modules" else f"--{name}"


def _check_path(name: str, value: str) -> None:
    what = name if name.startswith("--") or name == "file" else f"--{name}"
    if name in {"file", "out", "--module"} and not value:
        raise InputError(f"{what} must not be empty")
    odd = [character for character in value if not character.isprintable()]
    if odd:
        msg = f"{what} must have no line breaks or control characters, got {value!r}"
        raise InputError(msg)
    if value.startswith("-"):
        raise InputError(f"{what} must not begin with '-', got {value!r}")


def _allowed(pattern: re.Pattern[str]) -> str:
    return "_ . + -" if pattern is WORD else "_ . , : @ / + = -"


class _Script(Template):
    delimiter = "%"


def job_script(request: Request) -> str:
    """Return the text of the job script for given options."""
    scheduler = SCHEDULERS[request.scheduler]
    quote = shlex.quote
    warned, ended = scheduler.traps
    path = quote(request.script) if request.script else "THIS_FILE"
    modules = [f"module load {quote(module)}" for module in request.modules]
    venv = f"source {quote(request.venv.rstrip('/') + '/bin/activate')}"
    shard: list[str] = []
    if request.array:
        shard.append(f"shard={scheduler.index}")
        shard.append(f'work+=(--shard "$shard/{request.array}")')
    elif request.shard:
        shard.append(f"work+=(--shard {quote(request.shard)})")
    text = resources.files("hpcwhirl.cluster").joinpath("job.template").read_text()
    return _Script(text).substitute(
        directives=_lines(scheduler.directives(request), scheduler.sentinel),
        command=request.command(), submit=f"{scheduler.submit} {path}",
        warned=warned, ended=ended, stop=scheduler.stop,
        opening=_lines(scheduler.opening),
        file=quote(request.file), out=quote(request.out),
        ranks=request.ntasks, requeues=request.requeues,
        modules=_lines(
            modules or ["# module load the MPI that mpi4py was built for (--module)"]
        ),
        venv=venv if request.venv else "# source VENV/bin/activate (--venv)",
        shard=_lines(shard), launch=scheduler.launch(request),
        requeue=_lines(scheduler.again(request), "  "),
    )  # fmt: skip


def _lines(lines: Sequence[str], before: str = "") -> str:
    return "".join(f"{before}{line}\n" for line in lines)
