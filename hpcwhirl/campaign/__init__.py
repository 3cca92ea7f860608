"""Campaigns: list many cases, compute them on MPI ranks, stop, continue and gather.

The package `plan` lists the cases and how each is computed; `foresight` predicts their
computing time; the other modules run a campaign; `run.Session` calls them in order.

The package is callable: `hpcwhirl.campaign("whirl.toml", "results")` calls the function
`campaign`.

Rank 0 hands out cases by messages to single ranks, and computes cases, too; a single
process is rank 0 of one. The `planner` tells rank 0 which jobs are left. At first every
worker is sent units of work; later it asks for more when it begins the units it has.
The last units, one for each rank, go to workers that have none. The time of a case is
predicted from finished cases with similar inputs. Predictions decide the order of
cases, the time left and the number of units sent at once, never a result. An isolated
case is computed by a new interpreter, never by a fork of a process that has initialized
MPI. Every message is received (each worker waits for one HALT), since an unread message
makes `srun --mpi=pmi2` hang in MPI_Finalize.

A unit of work is a job: a case or one of its twins, integrated for its planned
duration or, if it is undecided and the campaign was extended, for a longer one. Rank 0
is told how every job ended and how long it took, and at once hands out the jobs that
follow from it: refined cases, longer runs (stages), twins. It does not wait for all
running jobs first, except with a budget. A rank without work waits as long as running
jobs may lead to others. The jobs left are planned again from the journals at every
start and by every reader of a directory, so the set of jobs depends on words only.

A case that was being computed when two processes died is computed last, in a process of
its own: if that dies, too, the case is `crashed`; otherwise it has its usual result. Of
the cases without a result, the first five of each rank are printed at once.

A campaign stops early, within seconds, and can be continued: at INT, TERM or USR1,
before its time is up (`--walltime`, SLURM_JOB_END_TIME; a tenth of the time, at most 60
s, is reserved), at a file STOP, and when the disk is full. Ranks that do not stop
within `patience` are ended. States of unfinished cases are saved at a stop, and every
ten minutes of a case's computing time. One rank of each node fills numba's cache first.
Only the group `performance` of the results depends on the number of ranks.
"""

from __future__ import annotations

import sys

TYPE_CHECKING = False  # nothing is imported before the signal handlers are installed
if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path
    from typing import Any, Unpack

    import xarray

    from hpcwhirl.campaign.options import Options
    from hpcwhirl.campaign.plan.design import Design
    from hpcwhirl.launch import Communicator
    from hpcwhirl.scene import Scene

__all__ = ["campaign"]


def campaign(
    design: Design | Scene | Mapping[str, Any] | Path | str | None = None,
    out: Path | str | None = None,
    *,
    measure: Callable[[xarray.Dataset], Mapping[str, Any]] | None = None,
    variables: Mapping[str, str | tuple[str, str]] | None = None,
    version: str | int | None = None,
    comm: Communicator | None = None,
    **options: Unpack[Options],
) -> xarray.Dataset:
    """Integrate or continue a campaign and return its results.

    It does what `hpcwhirl campaign` does, except for maps and page: finished cases are
    kept and never integrated twice, and results are equal bit for bit for any number of
    ranks. Under `mpirun -n 8 python my.py` every rank calls it and gets the results.

    Parameters
    ----------
    design : a `Design`, or anything that `Design.of` accepts: a TOML file, a mapping of
        its tables, a `Scene`; None: the default campaign
    out : directory of the campaign; an existing one is continued (default ``campaign``)
    measure : your own function of a case, whose numbers become variables of the
        results. Its argument is an `xarray.Dataset` with all that `open_results` has of
        that case, including traces over `time`, as read-only copies, and with all
        inputs as `attrs`. If it raises, or would end the program, its variables are NaN
        and `measure_message` says why. A directory refuses numbers of another function:
        the source file that defines it (in a notebook, its cell) and the values that it
        uses are compared, so it is best kept in a file of its own. Other modules are
        not compared: installed packages, and modules that your own modules import
    variables : {name: unit} or {name: (unit, meaning)} of all that `measure` returns;
        they cannot change in an existing directory
    version : version of `measure`, such as "2", which is compared instead of its
        source and values; needed if these cannot be determined
    comm : an MPI communicator; None: all ranks that were started, or this process
    options : `ranks`, a number of ranks that this call starts by mpirun, as for all
        cores from a notebook (a function `measure` must then stand in a file that they
        can import); and options of the command: `retry`, `walltime`, `case_limit`,
        `max_fails`, `isolate`, `save_every`, `keep_states`, `patience`, `same`,
        `fresh`, `take_over`

    Returns
    -------
    xarray.Dataset over `case`, read from the file on access, see `open_results`; a case
    without a result is no error: its `status` says so

    Raises
    ------
    InputError
        naming the input, its value and what is allowed; nothing was computed
    StoppedError
        if the campaign ended early; finished cases are kept, and the same call
        continues with the others

    Examples
    --------
    >>> def tips(case):
    ...     return {"largest_tip": abs(case.tips).max()}
    >>> data = hpcwhirl.campaign(
    ...     {"output": {"traces": "full"}, "sweep": {"speed": [300, 410]}},
    ...     "results", measure=tips, variables={"largest_tip": "m"},
    ... )  # doctest: +SKIP
    """
    from hpcwhirl.campaign.call import Call

    ranks = options.pop("ranks", None)
    call = Call(design, out, measure, variables, version, options)
    if ranks is None:
        return call.run(comm)
    from hpcwhirl.campaign.started_ranks import on_ranks

    return on_ranks(call, ranks)


__doc__ = campaign.__doc__ or ""  # shown by help(hpcwhirl.campaign)


class _Called(type(sys)):  # type: ignore[misc]
    """Module class that makes the package callable, as the function `campaign`."""

    __wrapped__ = staticmethod(campaign)  # gives the signature

    def __call__(self, *args: Any, **options: Any) -> xarray.Dataset:
        return campaign(*args, **options)


sys.modules[__name__].__class__ = _Called
