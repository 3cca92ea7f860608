"""Results of a single case, written like those of a campaign of one case."""

from __future__ import annotations

import socket
import tempfile
import time
from pathlib import Path

from hpcwhirl.campaign.finalize import facts_of
from hpcwhirl.campaign.plan.design import Design
from hpcwhirl.campaign.simulate import Result, notes_on
from hpcwhirl.store.atomic import make_folders, publish, telling
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.directory.journal import Journal
from hpcwhirl.store.results.gather import gather


def write_case(path: Path, design: Design, result: Result) -> None:
    """Write the results of one case as a campaign's results file, atomically.

    The file is gathered beside `path`, as for a campaign, and renamed.

    Parameters
    ----------
    path : file to replace
    design : design of one case
    result : result of the case

    Raises
    ------
    MissingFileError, StoreError
        if it cannot be written; an older file stays
    """
    name = design.digest(0)
    performance = {"rank": 0, "host": socket.gethostname(), **result.performance}
    record = {"case": 0, "digest": name, "ended": time.time(), "status": "ok",
              "message": "; ".join(notes_on(design.scene(0), result.row)),
              "row": result.row, "performance": performance}  # fmt: skip
    with telling(path):
        make_folders(path.parent)
        with tempfile.TemporaryDirectory(prefix=".hpcwhirl-", dir=path.parent) as place:
            directory = Directory(Path(place))
            directory.plan.write(design.manifest())
            with Journal(directory.journals, 1, 0) as journal:
                journal.append(record, result.traces)
            publish(gather(directory, facts_of(design)), path)
