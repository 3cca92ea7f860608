"""`hpcwhirl.campaign(...)`: the command `campaign` from a notebook or a script.

It imports nothing before it is called, so that a command can install its signal
handlers first.
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path
    from typing import Any

    import xarray

    from hpcwhirl.campaign.plan.design import Design
    from hpcwhirl.launch import Communicator
    from hpcwhirl.scene import Scene


def campaign(
    design: Design | Scene | Mapping[str, Any] | Path | str | None = None,
    out: Path | str | None = None,
    *,
    measure: Callable[[xarray.Dataset], Mapping[str, Any]] | None = None,
    variables: Mapping[str, str | tuple[str, str]] | None = None,
    version: str | int | None = None,
    comm: Communicator | None = None,
    **options: Any,
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
    options : options of the command: `retry`, `walltime`, `case_limit`, `max_fails`,
        `isolate`, `save_every`, `patience`, `fresh`, `take_over`

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

    return Call(design, out, measure, variables, version, options).run(comm)
