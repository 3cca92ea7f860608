"""Gather journals and traces into `results.h5`, by one process or by MPI-IO.

Both ways define the same file with the same calls; they differ in which rank writes
which cases. Cases are read and written in blocks, so that memory does not grow with the
number of traces. Ranks do not wait for each other except where HDF5 requires it. The
file is written under a new temporary name, synced and renamed.
"""

from __future__ import annotations

import errno
import os
import shutil
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from hpcwhirl.errors import STOPPED, WRONG_INPUT, NoRoomError, WhirlError, say
from hpcwhirl.launch import ALONE, Communicator, end_all, rest_until_root
from hpcwhirl.store.atomic import Say, part_of, publish, sweep
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.directory.owner import RESULTS, Asking, Claim
from hpcwhirl.store.hdf5 import refusal, writing
from hpcwhirl.store.results.blocks import Block, block_size, ranges, read_block
from hpcwhirl.store.results.contents import STAMP, Contents, contents_of, stamp
from hpcwhirl.store.results.layout import LIBVER, define, results_bytes

MORE = 1 << 16  # bytes of free space required beyond the known need


def has_mpi_io() -> bool:
    """Return whether h5py was built with parallel HDF5, so that all ranks can write."""
    return bool(h5py.get_config().mpi)


def gather(
    directory: Directory,
    facts: Mapping[str, str | float],
    comm: Communicator = ALONE,
    *,
    compress: int = 0,
    asking: Asking | None = None,
) -> Path:
    """Gather a campaign's journals and traces into `results.h5`; return its path.

    Processes gather one at a time and wait for each other, so that the last file
    published has the newest content.

    Parameters
    ----------
    directory : directory of the campaign
    facts : further root attributes
    comm : an MPI communicator; with parallel HDF5 all its ranks write, otherwise rank 0
        alone. Every rank must call
    compress : gzip level of traces, 1 to 9; 0: not compressed
    asking : options of the claim, see `store.directory.owner.Asking`; the same on every
        rank

    Raises
    ------
    MissingFileError, StoreError
        on every rank, if any rank cannot read or write; an older file stays
    """
    rank, parallel = comm.rank, comm.size > 1 and has_mpi_io()
    final = directory.results
    with ExitStack() as stack:
        asking = asking or Asking()
        told = {
            **facts,
            "gather": f"MPI-IO by {comm.size} ranks" if parallel else "serial",
        }
        fit = partial(_fitting, directory, told if parallel else None, asking.say)
        begin = partial(_begin, directory, stack, asking, fit) if rank == 0 else None
        begun = _agreed(begin, final, comm, of_root=True)
        write = end = None
        if parallel or rank == 0:
            part, content = comm.bcast(begun and begun[1:]) if parallel else begun[1:]
            among = comm if parallel else ALONE
            write = partial(_write_file, part, content, told, compress, among)
            write = partial(_or_all_end, write, part, final, among)
        _agreed(write, final, comm, of_root=not parallel)
        if rank == 0:
            end = partial(_end, begun[0], begun[1], directory)
        _agreed(end, final, comm, of_root=True)
    return final


def _begin(
    directory: Directory, stack: ExitStack, asking: Asking, fit: Callable[[], Contents]
) -> tuple[Claim, Path, Contents]:
    """Claim the right to write results.h5, and make the temporary file to be written.

    Parameters
    ----------
    directory : directory of the campaign
    stack : context that at its end releases the claim, and removes the temporary file
        if it still exists
    asking : how to wait for other processes
    fit : returns what results are gathered from, or raises if the disk has no room for
        them

    Returns
    -------
    claim, path of the temporary file, what results are gathered from
    """
    if not directory.path.is_dir():
        directory.plan.read()  # raises if there is no campaign
    own = stack.enter_context(directory.claims.make(RESULTS, asking))
    content = fit()
    sweep(directory.path, directory.results.name)
    sweep(directory.runs.place, STAMP)
    part = part_of(directory.results)
    stack.callback(part.unlink, missing_ok=True)
    return own, part, content


def _end(own: Claim, part: Path, directory: Directory) -> None:
    """Rename the complete temporary file to results.h5, and write its stamp.

    Parameters
    ----------
    own : claim on the results; if it is lost, StoreError is raised instead
    part : the temporary file
    directory : directory of the campaign
    """
    publish(part, directory.results, own.check)
    stamp(directory)


def _agreed(
    action: Callable[[], Any] | None,
    final: Path,
    comm: Communicator,
    *,
    of_root: bool = False,
) -> Any:
    """Call `action` and return its value; an exception of one rank is raised on all.

    Parameters
    ----------
    action : function to call; None: nothing is called on this rank
    final : results file, for messages
    comm : communicator of all ranks, each of which must call
    of_root : whether only rank 0 has an action, while the others sleep
    """
    value: Any = None
    error: Exception | None = None
    try:
        value = action() if action else None
    except WhirlError as failed:
        error = failed
    except (OSError, RuntimeError) as failed:  # HDF5 raises either, with many lines
        error = refusal(final, failed)
    except Exception as failed:  # noqa: BLE001 - raised below
        error = RuntimeError(f"{type(failed).__name__}: {failed}")
        error.__cause__ = failed
    if of_root:
        rest_until_root(comm)
    for found in (error, *comm.allgather(error)):
        if found is not None:
            raise found
    return value


def _write_file(
    part: Path,
    contents: Contents,
    facts: Mapping[str, str | float],
    compress: int,
    comm: Communicator,
) -> None:
    """Write the temporary results file; each rank of `comm` writes its share of cases.

    Parameters
    ----------
    part : the temporary file
    contents : what results are gathered from
    facts : further root attributes
    compress : gzip level of traces; 0: not compressed
    comm : communicator of the ranks that write
    """
    parallel = comm.size > 1
    options: dict[str, Any] = {"driver": "mpio", "comm": comm} if parallel else {}
    with writing(part, libver=LIBVER, **options) as file:
        define(file, contents, facts, compress)
        in_step = parallel and compress > 0
        for cases, block in _blocks(contents, part, comm, in_step=in_step):
            for name, values in block.items():
                _put(file[name], cases, values, in_step=in_step)


def _blocks(
    contents: Contents, part: Path, comm: Communicator, *, in_step: bool
) -> Iterator[tuple[range, Block]]:
    """Yield the blocks of cases that this rank writes: their numbers and variables.

    An exception of one rank is raised on all. If `in_step`, all ranks yield equally
    many blocks, some of them empty at the end, at the same time, as compressed traces
    require. Else ranks do not wait for each other.

    Parameters
    ----------
    contents : what results are gathered from
    part : temporary file, for messages
    comm : communicator of the ranks that write
    in_step : whether every rank must write each block at the same time

    Yields
    ------
    numbers of the cases; {variable: values, (cases, ...)}
    """
    mine = ranges(contents.cases, comm.rank, comm.size, block_size(contents))
    error: Exception | None = None
    for cases in mine:
        read = partial(read_block, contents, cases)
        if in_step:
            yield cases, _agreed(read, part, comm)
            continue
        try:
            block = read()
        except Exception as failed:  # noqa: BLE001 - raised below, on every rank
            error = failed
            break
        yield cases, block
    _agreed(partial(_raise, error), part, comm)


def _raise(error: Exception | None) -> None:
    if error is not None:
        raise error


def _put(data: h5py.Dataset, cases: range, values: Any, *, in_step: bool) -> None:
    """Write the values of some cases into a variable of the open results file.

    Collective writes are used only if required (`in_step`): ranks wait for each other
    in each of hundreds of writes, which took longer than the writing itself.

    Parameters
    ----------
    data : the variable
    cases : numbers of the cases, a range that may be empty
    values : (cases, ...)
    in_step : whether all ranks write at the same time
    """
    if not (in_step and data.chunks):
        if len(cases):
            data[cases.start : cases.stop] = values
        return
    whole, rest = data.id.get_space(), data.shape[1:]
    if len(cases) and all(rest):
        start = (cases.start, *(0 for _ in rest))
        whole.select_hyperslab(start, (len(cases), *rest))
        memory = h5py.h5s.create_simple((len(cases), *rest))
    else:
        whole.select_none()
        memory = h5py.h5s.create_simple((1,))
        memory.select_none()
    how = h5py.h5p.create(h5py.h5p.DATASET_XFER)
    how.set_dxpl_mpio(h5py.h5fd.MPIO_COLLECTIVE)
    plain = np.ascontiguousarray(values, dtype=data.dtype)
    data.id.write(memory, whole, plain, dxpl=how)


def _or_all_end(
    write: Callable[[], None], part: Path, final: Path, comm: Communicator
) -> None:
    """Call `write`; if it fails on one of several ranks, end all ranks.

    The exit code is 75 if the same command may succeed later, as after a full disk.

    The ranks must end since HDF5 crashes when it closes a file whose MPI-IO has failed,
    and since other ranks may wait for this one in a collective call. Nothing is lost:
    the journals exist.

    Parameters
    ----------
    write : writes the temporary file
    part, final : temporary file and results file, for the message
    comm : communicator of the ranks that write
    """
    try:
        write()
    except (OSError, RuntimeError) as failed:
        if comm.size == 1 or isinstance(failed, WhirlError):  # raised on all ranks
            raise
        told = refusal(final, _cause(part, failed))
        time.sleep(5.0 if comm.rank else 0.0)  # lets rank 0 report first
        say(f"stopped early: {told}; the same command continues")
        end_all(comm, STOPPED if isinstance(told, NoRoomError) else WRONG_INPUT)


def _cause(part: Path, failed: Exception) -> Exception:
    """Return why MPI-IO failed to write a file, such as a full disk.

    It is the system's error of lengthening the file; if the file can be lengthened,
    `failed` itself.

    Parameters
    ----------
    part : the file
    failed : exception that the write has raised
    """
    try:
        with part.open("r+b") as file:
            os.posix_fallocate(file.fileno(), 0, file.seek(0, os.SEEK_END) + MORE)
    except OSError as found:
        return found
    return failed


def _fitting(
    directory: Directory, facts: Mapping[str, str | float] | None, say: Say
) -> Contents:
    """Return what results are gathered from; raise if the disk has no room for them.

    With MPI-IO, which crashes on a full disk, the whole file must fit; otherwise only
    its values. Quotas are not known beforehand.

    Parameters
    ----------
    directory : directory of the campaign
    facts : root attributes of a file to be written by MPI-IO; None: no MPI-IO
    say : prints one line about damaged files on which no result depends
    """
    contents = contents_of(directory, say)
    size = contents.size
    if facts is not None:
        size = int(1.01 * results_bytes(contents, facts)) + MORE
    free = shutil.disk_usage(directory.path).free
    if size > free:
        need, have = size / 1e6, free / 1e6
        why = f"{os.strerror(errno.ENOSPC)}, {need:.3g} MB needed, {have:.3g} MB free"
        raise NoRoomError(f"cannot write {directory.results}: {why}")
    return contents
