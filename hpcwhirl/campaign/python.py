"""`hpcwhirl.campaign(...)`: the command `campaign` from a notebook or a script.

It imports nothing before it is called, so that a command handles signals from its
start.
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

    It does what `hpcwhirl campaign` does, without maps and page: finished cases are
    kept and never integrated twice, and the results are the same bits for any number of
    ranks. Under `mpirun -n 8 python my.py` every rank calls it and gets the results.

    Parameters
    ----------
    design : a `Design`, or whatever `Design.of` takes: a TOML file, a mapping of its
        tables, a `Scene`; None: the campaign that runs where no file is given
    out : directory of the campaign; an old one is continued (default ``campaign``)
    measure : your own function of a case, whose numbers become variables of the
        results. It is given an `xarray.Dataset`, which has what `open_results` has of
        that case, traces over `time` included, as copies that cannot be written to,
        and all inputs as `attrs`. Where it raises or would end the program, its
        variables are NaN and `measure_message` says why. A directory takes no numbers
        of another function: the source file that defines it (in a notebook, its cell)
        and the values that it uses are compared, so a file of its own suits it best.
        Not seen: other modules, that is installed packages and what your own modules
        import
    variables : {name: unit} or {name: (unit, meaning)} of all that `measure` returns;
        a directory keeps the variables that it was begun with
    version : of the measure, to be compared instead of its source and values, such as
        "2"; needed where those cannot be known
    comm : an MPI communicator; None: all ranks that were started, or this process
    options : those of the command: `retry`, `walltime`, `case_limit`, `max_fails`,
        `isolate`, `save_every`, `patience`, `fresh`, `take_over`

    Returns
    -------
    xarray.Dataset over `case`, read from the file as it is asked for, see
    `open_results`; a case without a result is one by its `status`, not an error

    Raises
    ------
    InputError
        naming what is wrong, what was got and what is allowed; nothing was computed
    StoppedError
        where it ended early; finished cases are kept and the same call continues

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
