"""The process of isolated cases, as its parent sees it: an answer that never ends."""

import math
import os
import struct
import subprocess
from multiprocessing import Pipe

import pytest

from hpcwhirl.campaign import worker_process
from hpcwhirl.campaign.compute import DiedError
from hpcwhirl.scene import Scene
from hpcwhirl.store.directory.states import States


def test_a_process_that_stalls_in_its_answer_is_killed(tmp_path, monkeypatch):
    monkeypatch.setattr(worker_process, "GRACE", 0.2)
    child = worker_process.Child(States(tmp_path), 600.0)
    child._pipe, theirs = Pipe()
    with theirs:
        words = ["sleep", "600"]
        child._process = subprocess.Popen(words, pass_fds=[theirs.fileno()])
        os.write(theirs.fileno(), struct.pack("!i", 1000) + b"some of 1000 bytes")
    with pytest.raises(DiedError, match="SIGKILL"):
        child.compute(Scene(), "", math.inf, lambda: None, keep=False)
