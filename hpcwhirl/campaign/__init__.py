"""Designs of many cases, one case, and their distribution over MPI ranks.

Packages: `plan` lists the cases and how each is computed, `foresight` predicts their
cost; the modules beside them run a campaign, `session` in the order of its steps.

Called, as `hpcwhirl.campaign("whirl.toml", "results")`, it is the function `campaign`.

Rank 0 hands out cases by messages to one rank at a time, and computes cases, too; a
process alone is rank 0 of one. The `planner` tells rank 0 what is left. At first every
worker is sent units of work; later it asks for more as it begins those that it has.
The last units, one a rank, go to workers that have none. The seconds that a case takes
are predicted from finished cases with similar inputs; they decide the order of cases,
the time left and the number of units sent at once, never a result. An isolated case is
computed by a new interpreter, never by a fork of a process that has initialized MPI.
Every message is received: each worker waits for one HALT, since an unread message hangs
`srun --mpi=pmi2` in MPI_Finalize.

A unit is a job: a case, one of its twins, or one of both for longer where the campaign
was extended and it is undecided. Rank 0 hears how every job ended with its seconds and
hands out what follows from it as soon as it does: refined cases, later stages, twins.
There are no rounds, but for a budget. A rank with nothing left waits while jobs at work
may lead to others. What is left is planned again from the journals at every start and
by everything that reads a directory: the set of jobs is a function of words.

A case in flight when two processes died is computed last, in a process of its own: if
it dies again it is `crashed`, else it was a bystander and has its bits. Of cases that
give no result, the first five of a rank are printed at once.

A campaign ends early, resumable and within seconds, at INT, TERM or USR1, before its
time is up (`--walltime`, SLURM_JOB_END_TIME: a tenth of the time, at most 60 s, is kept
free), at a file STOP, and when the disk is full; ranks that do not stop within
`patience` are left behind. States of cases on their way are kept at a stop, and every
ten minutes of a case's computing. One rank a node fills numba's cache first. Only
the group `performance` of the results depends on how many ranks there were.
"""

from __future__ import annotations

import sys

from hpcwhirl.campaign.python import campaign

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    import xarray

__all__ = ["campaign"]
__doc__ = campaign.__doc__ or ""  # what help(hpcwhirl.campaign) is asked for


class _Called(type(sys)):  # type: ignore[misc]
    """The package as what it does: `hpcwhirl.campaign(...)` is `campaign(...)`."""

    __wrapped__ = staticmethod(campaign)  # whose signature is told

    def __call__(self, *args: Any, **options: Any) -> xarray.Dataset:
        return campaign(*args, **options)


sys.modules[__name__].__class__ = _Called
