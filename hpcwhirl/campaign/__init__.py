"""Campaigns: designs of many cases, a single case, and distribution over MPI ranks.

The package `plan` lists the cases and how each is computed; `foresight` predicts their
cost; the other modules run a campaign, and `session` calls them in order.

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

A unit is a job: a case or one of its twins, with its planned duration or, if it is
undecided and the campaign was extended, a longer one. Rank 0 receives the completion
and the computing time of every job, and at once hands out the jobs that follow from it:
refined cases, later stages, twins. There are no rounds, except with a budget. A rank
without work waits as long as running jobs may lead to others. The jobs left are planned
again from the journals at every start and by every reader of a directory, so the set of
jobs depends on words only.

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

from hpcwhirl.campaign.python import campaign

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    import xarray

__all__ = ["campaign"]
__doc__ = campaign.__doc__ or ""  # shown by help(hpcwhirl.campaign)


class _Called(type(sys)):  # type: ignore[misc]
    """Module class that makes the package callable, as the function `campaign`."""

    __wrapped__ = staticmethod(campaign)  # gives the signature

    def __call__(self, *args: Any, **options: Any) -> xarray.Dataset:
        return campaign(*args, **options)


sys.modules[__name__].__class__ = _Called
