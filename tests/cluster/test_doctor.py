"""What the doctor finds: each defect once put in is found, and has a remedy."""

import json
import os
import sys

import pytest
from launch import launch

from hpcwhirl.cli import main
from hpcwhirl.cluster import facts as facts_of
from hpcwhirl.cluster.facts import filesystem, place_facts, vector_bits
from hpcwhirl.cluster.findings import BREAKS, FINE, SLOW, findings
from hpcwhirl.launch import family, launched_ranks

HEALTHY = {
    "launched": 2, "host": "n1", "cores": [0, 1], "cpu": "a core", "vector_bits": 512,
    "threads": {}, "versions": {"hpcwhirl": "1", "numpy": "2"}, "h5py": "3",
    "hdf5": "2", "mpi_io": True, "locking": "", "cache": "/c", "cache_writable": True,
    "cache_kernels": 5, "mpi": "Open MPI v5", "mpi_libraries": ["/lib/libmpi.so.40"],
    "mpi_error": "", "mpirun": "/bin/mpirun", "mpirun_version": "mpirun (Open MPI) 5",
    "folder": "/d", "writable": True, "free": 1e12, "filesystem": "lustre",
    "seen": True, "exists": True, "locks": "held", "exclusive": False,
}  # fmt: skip


def found(size=2, first=None, second=None):
    """Return {what: finding} of two ranks, with what is changed on one of them."""
    ranks = [HEALTHY | {"exclusive": True} | (first or {}), HEALTHY | (second or {})]
    return {finding.what: finding for finding in findings(ranks, size)}


def test_a_healthy_cluster_has_nothing_but_fine_findings():
    assert {finding.level for finding in found().values()} == {FINE}
    assert not any(finding.remedy for finding in found().values())


DEFECTS = [
    ("MPI", BREAKS, {"mpi": "", "mpi_error": "no libmpi"}, {}),
    ("MPI", SLOW, {"mpi": "", "mpi_error": "no libmpi", "launched": 1}, {}),
    ("mpirun", BREAKS, {"mpirun_version": "HYDRA build details: Version: 5"}, {}),
    ("mpirun", SLOW, {"mpirun": ""}, {}),
    ("versions", BREAKS, {}, {"versions": {"hpcwhirl": "1", "numpy": "1"}}),
    ("HDF5", BREAKS, {"mpi_libraries": ["/a/libmpi.so.40", "/b/libmpi.so.12"]}, {}),
    ("cores", SLOW, {"cores": [0]}, {"cores": [0]}),
    ("threads", SLOW, {}, {"threads": {"MKL_NUM_THREADS": "8"}}),
    ("numba cache", BREAKS, {}, {"cache_writable": False}),
    ("directory", BREAKS, {}, {"writable": False}),
    ("directory", BREAKS, {}, {"seen": False}),
    ("exclusive files", BREAKS, {}, {"exclusive": True}),
    ("file locks", BREAKS, {}, {"locks": "not held"}),
    ("file locks", BREAKS, {}, {"locks": "Function not implemented"}),
    ("disk", SLOW, {"free": 1e9}, {}),
    ("disk", BREAKS, {"free": 1e6}, {}),
]


@pytest.mark.parametrize(("what", "level", "first", "second"), DEFECTS)
def test_a_defect_is_found_with_its_remedy(what, level, first, second):
    finding = found(first=first, second=second)[what]
    assert finding.level == level
    assert finding.remedy


def test_singletons_under_a_launcher_break():
    finding = found(size=1)["ranks"]
    assert (finding.level, "started 2, MPI sees 1" in finding.got) == (BREAKS, True)


def test_locks_that_hdf5_does_not_take_break_nothing():
    first = {"locking": "FALSE"}
    assert found(first=first, second={"locks": "No locks"})["file locks"].level == FINE


def test_serial_hdf5_is_no_defect():
    assert found(first={"mpi_io": False})["HDF5"].level == FINE


def test_flavours_are_told_by_library_and_launcher():
    told = {
        "MPICH Version: 5.0.2": "MPICH",
        "HYDRA build details: Version: 5.0.2": "MPICH",
        "Intel(R) MPI Library for Linux* OS, Version 2021": "MPICH",
        "MPI VERSION : CRAY MPICH version 8.1": "MPICH",
        "Open MPI v4.1.4, package: Debian": "Open MPI",
        "mpirun (Open MPI) 4.1.4": "Open MPI",
        "something else": "",
    }
    assert {text: family(text) for text in told} == told


def test_vector_width_is_that_of_the_widest_unit():
    flags = ["fpu sse2", "sse2 avx", "sse2 avx avx2", "avx2 avx512f", "asimd", "none"]
    assert [vector_bits(text) for text in flags] == [128, 256, 256, 512, 128, 0]


def test_the_file_system_is_that_of_the_nearest_mount(tmp_path):
    mounts = "l /home/w lustre rw 0 0\ns:/x /home nfs4 rw 0 0\n/dev/a / ext4 rw 0 0"
    kinds = {
        "/etc": "ext4",
        "/home/me": "nfs4",
        "/home/w/x": "lustre",
        "/homes": "ext4",
    }
    for path, kind in kinds.items():
        assert filesystem(type(tmp_path)(path), mounts) == kind


def test_a_directory_is_tried_and_left_as_it_was(tmp_path):
    tried = place_facts(tmp_path)
    assert tried["writable"]
    assert tried["seen"]
    assert tried["exclusive"]
    assert tried["locks"] == "held"
    assert list(tmp_path.iterdir()) == []


def test_a_lock_that_does_not_hold_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr("fcntl.flock", lambda *_: None)
    assert place_facts(tmp_path)["locks"] == "not held"


@pytest.mark.turns
def test_a_missing_directory_breaks_and_is_one_finding(tmp_path, capsys):
    assert main(["doctor", "--dir", str(tmp_path / "none"), "--json"]) == 1
    told = json.loads(capsys.readouterr().out)["findings"]
    levels = {finding["what"]: finding["level"] for finding in told}
    assert [what for what, level in levels.items() if level == BREAKS] == ["directory"]
    missing = next(finding for finding in told if finding["what"] == "directory")
    assert "does not exist" in missing["got"]
    assert missing["remedy"].startswith("create it")


def test_one_rank_on_one_core_is_told_in_the_singular():
    (alone,) = [f for f in findings([HEALTHY | {"exclusive": True}], 1)
                if f.what == "cores"]  # fmt: skip
    assert ": 1 rank on " in alone.got


def test_mpi_that_aborts_takes_no_one_along(monkeypatch):
    monkeypatch.setattr(facts_of, "PROBE", "import os; os.abort()")
    assert facts_of.probed_mpi()["mpi_error"]
    monkeypatch.setattr(facts_of, "PROBE", "raise SystemExit('no libmpi')")
    assert facts_of.probed_mpi()["mpi_error"] == "no libmpi"


def test_what_mpi_prints_before_the_facts_is_no_fact(monkeypatch):
    probe = """print('a warning of MPI'); print('{"mpi": "a library"}')"""
    monkeypatch.setattr(facts_of, "PROBE", probe)
    assert facts_of.probed_mpi() == {"mpi": "a library"}


def test_srun_without_any_pmi_is_seen_to_start_several(monkeypatch):
    for name in [
        n for n in os.environ if n.startswith(("PMI", "OMPI", "SLURM", "MPI"))
    ]:
        monkeypatch.delenv(name)
    assert launched_ranks() == 1
    monkeypatch.setenv("SLURM_PROCID", "0")
    monkeypatch.setenv("SLURM_STEP_NUM_TASKS", "2")
    assert launched_ranks() == 2


@pytest.mark.mpi
def test_under_mpirun_one_report_tells_of_all_ranks(tmp_path):
    done = launch("doctor", "--dir", tmp_path, "--json", ranks=2)
    told = json.loads(done.out)
    assert len(told["ranks"]) == 2
    levels = {f["what"]: f["level"] for f in told["findings"]}
    assert levels["ranks"] == levels["directory"] == levels["file locks"] == FINE
    assert "exclusive files" not in levels
    assert done.returncode == int(BREAKS in levels.values())
    assert told["ranks"][0]["versions"]["python"] == sys.version.split()[0]
    assert list(tmp_path.iterdir()) == []
