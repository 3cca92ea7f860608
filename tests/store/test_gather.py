"""One contract of `results.h5` for both writers: by one process, and by MPI-IO."""

import json
import os
import pickle
import resource
import shutil

import h5netcdf
import h5py
import numpy as np
import pytest
import xarray
from journals import plan_of
from launch import ENVIRONMENT, ended, launch, python, root_variables
from specimen import BASE, FAILED, MISSING, SAMPLES, SPEEDS, begin, row

import hpcwhirl
from hpcwhirl.cli.command import run_command
from hpcwhirl.errors import MissingFileError, StoreError
from hpcwhirl.launch import Alone
from hpcwhirl.scene import Scene, flatten
from hpcwhirl.scene.quantities import PERFORMANCE, ROW, STATUS, TRACES
from hpcwhirl.scene.words import ENUMS
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.directory.journal import Journals
from hpcwhirl.store.directory.manifest import PlanFile
from hpcwhirl.store.directory.runs import Runs
from hpcwhirl.store.hdf5 import dtype
from hpcwhirl.store.reading.reader import words
from hpcwhirl.store.results import blocks
from hpcwhirl.store.results.blocks import ranges
from hpcwhirl.store.results.contents import contents_of
from hpcwhirl.store.results.gather import _blocks, gather, has_mpi_io

WRITERS = ["serial", pytest.param("mpi-io", marks=[pytest.mark.mpi, pytest.mark.mpiio])]
INCOMPLETE = "2 of 5 cases have no result: 1 failed, 1 missing"
NETCDF4 = """
import json, sys, netCDF4
with netCDF4.Dataset(sys.argv[1]) as root:
    found = {}
    for group in (root, root["performance"]):
        for name, data in group.variables.items():
            attributes = {a: str(data.getncattr(a)) for a in data.ncattrs()}
            found[name] = [data.dimensions, attributes, data[:].tolist()]
    facts = {name: str(root.getncattr(name)) for name in root.ncattrs()}
print(json.dumps([found, facts]))
"""


def write(writer, folder):
    """Gather with one of the writers; return exit code and complaint."""
    if writer == "mpi-io" and not has_mpi_io():
        if os.environ.get("HPCWHIRL_EXPECT_MPIIO") == "1":
            pytest.fail("this environment was to have an h5py with MPI-IO")
        pytest.skip("h5py was built without MPI-IO")
    if writer == "mpi-io":
        done = launch("gather", folder, ranks=3)
        written = done.returncode == 1 and INCOMPLETE in done.err
        return (0, "") if written else (done.returncode, done.err)
    try:
        gather(Directory(folder), {"version": hpcwhirl.__version__})
    except (MissingFileError, StoreError) as failed:
        return 2, f"hpcwhirl: error: {failed}\n"
    return 0, ""


@pytest.fixture(scope="module", params=[True, False], ids=["time", "sample"])
def axis(request):
    return "time" if request.param else "sample"


@pytest.fixture(scope="module", params=WRITERS)
def folder(request, axis, tmp_path_factory):
    place = tmp_path_factory.mktemp("gather")
    begin(place, one_interval=axis == "time")
    assert write(request.param, place) == (0, "")
    with h5py.File(place / "results.h5") as file:
        how = {"serial": b"serial", "mpi-io": b"MPI-IO by 3 ranks"}[request.param]
        assert file.attrs["gather"] == how
    return place


@pytest.fixture(scope="module")
def results(folder):
    with h5py.File(folder / "results.h5") as file:
        yield file


@pytest.mark.turns
def test_every_variable_of_the_schema_is_there_with_type_unit_and_meaning(results):
    for group, table in (
        (results, ROW | STATUS),
        (results["performance"], PERFORMANCE),
    ):
        for name, variable in table.items():
            data = group[name]
            assert (data.dtype, data.shape) == (dtype(variable), (len(SPEEDS),))
            assert data.attrs["units"].decode() == variable.unit != ""
            assert data.attrs["long_name"].decode() == variable.meaning != ""
            if variable.kind == "enum":
                assert data.attrs["flag_meanings"].decode().split() == [*ENUMS[name]]
    for name, told_of in TRACES.items():
        assert results[name].dtype == np.float64
        told = [results[name].attrs[a].decode() for a in ("units", "long_name")]
        assert told == [told_of.unit, told_of.meaning]


def test_results_stand_in_the_order_of_the_cases(results):
    assert results["speed"][:].tolist() == SPEEDS
    expected = ["squeeze", "squeeze", "stretch", "squeeze", "squeeze"]
    assert results["direction"][:].astype(str).tolist() == expected
    for case in SAMPLES:
        for name, value in row(case, 1e-4).items():
            if ROW[name].kind == "enum":
                assert ENUMS[name][results[name][case]] == value
            elif name != "sample_interval":
                assert results[name][case] in (value, str(value).encode())


def test_failed_and_missing_cases_are_rows_that_say_so(results):
    status = [ENUMS["status"][i] for i in results["status"]]
    assert status == ["ok", "failed", "ok", "missing", "ok"]
    message = [text.decode() for text in results["message"]]
    assert message == [
        "",
        "x" * (239),
        "",
        "not computed yet",
        "",
    ]
    for case in (FAILED, MISSING):
        assert results["gap"][case] == BASE["gap"]
        assert results["time_step"][case] == BASE["solver.time_step"]
        assert results["nodal_diameter"][case] == BASE["nodal_diameter"]
        assert np.isnan(results["orbit_radius"][case])
        assert (results["steps"][case], results["regime"][case]) == (-1, 0)
        assert all(np.isnan(results[name][case]).all() for name in TRACES)
    seconds = results["performance/seconds"][:]
    assert np.array_equal(np.isnan(seconds), np.arange(len(SPEEDS)) == MISSING)


def test_a_case_without_a_result_shows_its_duration_in_seconds(tmp_path):
    # a tenth of a revolution at 400 rad/s and nothing integrated: not 2.5 s
    base = flatten(Scene()) | {"revolutions": 0.1}
    PlanFile(tmp_path).write(plan_of(base, ["speed"], [{"speed": 400.0}]))
    with h5py.File(gather(Directory(tmp_path), {})) as file:
        assert file["duration"][0] == pytest.approx(0.1 * 2 * np.pi / 400.0)


def test_traces_equal_the_journals_and_are_padded_to_the_longest(results, folder, axis):
    found, names = Journals(folder).newest(), PlanFile(folder).read().digests
    for case, length in SAMPLES.items():
        kept = Journals(folder).traces(found[names[case]]["traces"])
        if axis == "time":
            assert np.array_equal(results["time"][:length], kept.pop("time"))
        for name, values in kept.items():
            stored = results[name][case]
            assert len(stored) == max(SAMPLES.values())
            part = tuple(map(slice, values.shape))
            assert stored[part].tobytes() == values.tobytes()
            stored[part] = np.nan
            assert np.isnan(stored).all()


def test_open_results_reads_it(folder, axis):
    data = hpcwhirl.open_results(folder)
    assert {*ROW, *STATUS, *PERFORMANCE, *TRACES} <= {*data.variables}
    assert {"speed", "gap", "friction", "nodal_diameter"} <= {*data.coords}
    assert data["tips"].dims == ("case", axis, "blade", "component")
    assert data["casing"].dims == ("case", axis, "harmonic", "phase")
    assert data["harmonic"].values.tolist() == list(range(21))
    assert words(data["status"]).tolist()[3:] == ["missing", "ok"]


def test_words_of_masked_cases_are_empty():
    meanings = {"flag_meanings": "none damped sustained"}
    regime = xarray.DataArray([1, 2, 0], dims="case", attrs=meanings)
    assert list(words(regime)) == ["damped", "sustained", "none"]
    masked = regime.where(xarray.DataArray([True, False, True], dims="case"))
    masked.attrs = meanings
    assert list(words(masked)) == ["damped", "", "none"]


def test_h5netcdf_reads_it(folder, axis):
    with h5netcdf.File(folder / "results.h5", "r") as file:
        assert file["centre"].dimensions == ("case", axis, "xy")
        assert file["scheme"][0] == b"modal"
        assert file["message"][MISSING] == b"not computed yet"
        assert file["performance"]["host"].dimensions == ("case",)


@pytest.mark.turns
def test_netcdf4_reads_every_variable_and_all_text(folder, axis):
    # of its own: it brings another HDF5, and has crashed on what h5py reads
    done = python(NETCDF4, folder / "results.h5")
    assert done.returncode == 0, done.stderr
    found, facts = json.loads(done.stdout)
    assert {*ROW, *STATUS, *PERFORMANCE, *TRACES} <= found.keys()
    assert found["impulse"][0] == ["case", axis]
    assert found["speed"][1:] == [
        {"units": "rad/s", "long_name": ROW["speed"].meaning},
        SPEEDS,
    ]
    assert found["scheme"][2] == ["modal"] * len(SPEEDS)
    assert found["message"][2][MISSING] == "not computed yet"
    assert found["message"][2][FAILED] == "x" * (239)
    assert found["host"][2][0] == "node-ä"
    assert facts["swept"] == "speed direction"


@pytest.mark.mpi
@pytest.mark.mpiio
@pytest.mark.parametrize("one_interval", [True, False])
def test_both_writers_give_the_same_bits(tmp_path, one_interval):
    begin(tmp_path, one_interval=one_interval)
    write("mpi-io", tmp_path)
    parallel = root_variables(tmp_path)
    write("serial", tmp_path)
    assert root_variables(tmp_path) == parallel


def damage(folder):
    path = folder / "traces/0001-00000.bin"
    path.write_bytes(b"\xff" + path.read_bytes()[1:])


def occupy(folder):
    (folder / "owners").write_text("in the way of the claim")


@pytest.mark.parametrize(
    ("spoil", "why"), [(damage, "are damaged"), (occupy, "cannot write")]
)
@pytest.mark.parametrize("writer", WRITERS)
def test_where_gathering_fails_one_line_says_so_and_the_old_file_stays(
    tmp_path, writer, spoil, why
):
    begin(tmp_path, one_interval=True)
    (tmp_path / "results.h5").write_text("old")
    spoil(tmp_path)
    code, told = write(writer, tmp_path)
    assert code == 2
    assert told.count("hpcwhirl: error: ") == 1
    assert why in told
    assert (tmp_path / "results.h5").read_text() == "old"
    assert not list(tmp_path.glob("*.part"))


def test_the_index_of_a_campaign_travels_between_ranks(tmp_path):
    begin(tmp_path, one_interval=False)
    own = contents_of(Directory(tmp_path))
    other = pickle.loads(pickle.dumps(own))  # as mpi4py does
    cases = range(len(SPEEDS))
    expected, found = blocks.read_block(own, cases), blocks.read_block(other, cases)
    assert found.keys() == expected.keys()
    for name, values in expected.items():
        np.testing.assert_array_equal(found[name], values)


class Second(Alone):
    """Rank 1 of two, which notes how it ends all."""

    rank, size = 1, 2
    ended = None

    def Abort(self, code):
        self.ended = code

    def Iprobe(self, **_):
        return True  # rank 0 has come

    def recv(self, **_):
        return None

    def bcast(self, value, root=0):
        return 1 if root == 0 else value  # rank 0 knows of cases without a result


def test_every_rank_ends_as_rank_0_tells(monkeypatch):
    monkeypatch.setattr("hpcwhirl.launch.communicator", Second)
    monkeypatch.setattr("hpcwhirl.store.results.gather.gather", lambda *_, **__: "")
    assert run_command(["gather", "out"]) == 1


def test_an_unforeseen_error_on_one_rank_ends_all_of_them(monkeypatch, capsys):
    comm = Second()
    monkeypatch.setattr("hpcwhirl.launch.communicator", lambda: comm)
    monkeypatch.setattr("hpcwhirl.store.results.gather.gather", lambda *_, **__: 1 / 0)
    assert run_command(["gather", "out"]) == comm.ended == 70
    assert "ZeroDivisionError" in capsys.readouterr().err


def test_a_rank_alone_writes_without_mpi_io(tmp_path, monkeypatch):
    begin(tmp_path, one_interval=True)
    monkeypatch.setattr("hpcwhirl.store.results.gather.has_mpi_io", lambda: True)
    gather(Directory(tmp_path), {})
    with h5py.File(tmp_path / "results.h5") as file:
        assert file.attrs["gather"] == b"serial"


def test_facts_may_be_long_as_the_hosts_of_ten_thousand_ranks_are(tmp_path):
    begin(tmp_path, one_interval=True)
    hosts = " ".join(f"node{i:05d}" for i in range(10_000))
    gather(Directory(tmp_path), {"hosts": hosts})
    with h5py.File(tmp_path / "results.h5") as file:
        assert file.attrs["hosts"].decode() == hosts


@pytest.mark.mpi
@pytest.mark.mpiio
def test_ranks_do_not_wait_for_one_that_cannot_write(tmp_path):
    begin(tmp_path, one_interval=True)
    (tmp_path / "results.h5").mkdir()
    done = launch("gather", tmp_path, ranks=2)
    assert done.returncode == 2
    assert done.err.count("hpcwhirl: error: cannot write") == 1
    assert not list(tmp_path.glob("*.part"))


@pytest.mark.turns
def test_a_full_disk_leaves_the_old_file_and_nothing_half_written(tmp_path):
    begin(tmp_path, one_interval=True)
    (tmp_path / "results.h5").write_text("old")
    limit = (30_000, 30_000)  # bytes of any file, of which Python writes none
    done = launch(
        "gather", tmp_path, env=ENVIRONMENT | {"PYTHONDONTWRITEBYTECODE": "1"},
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, limit),
    )  # fmt: skip
    assert done.returncode != 0  # HDF5 itself may crash on the way out
    assert "\nhpcwhirl: error: cannot write" in "\n" + done.err
    assert (tmp_path / "results.h5").read_text() == "old"
    assert not list(tmp_path.glob("*.part"))


@pytest.mark.mpi
@pytest.mark.mpiio
@pytest.mark.parametrize("one_interval", [True, False])
def test_compressed_traces_are_the_same_traces(tmp_path, one_interval):
    begin(tmp_path, one_interval=one_interval)
    write("serial", tmp_path)
    plain = root_variables(tmp_path)
    for ranks in (0, 3) if has_mpi_io() else (0,):
        done = launch("gather", tmp_path, "--compress", 4, ranks=ranks)
        assert (done.returncode, INCOMPLETE in done.err) == (1, True), done.err
        assert root_variables(tmp_path) == plain
        with h5py.File(tmp_path / "results.h5") as file:
            assert file["tips"].compression == "gzip"
            assert file["tips"].chunks[0] == 1


@pytest.mark.mpi
@pytest.mark.mpiio
@pytest.mark.parametrize("ranks", [2, pytest.param(7, marks=pytest.mark.slow)])
def test_ranks_without_a_case_take_part_in_every_write(tmp_path, ranks):
    if not has_mpi_io():
        pytest.skip("h5py was built without MPI-IO")
    begin(tmp_path, one_interval=True)  # five cases
    write("serial", tmp_path)
    plain = root_variables(tmp_path)
    done = launch("gather", tmp_path, "--compress", 1, ranks=ranks)
    assert (done.returncode, INCOMPLETE in done.err) == (1, True), done.err
    assert root_variables(tmp_path) == plain


@pytest.mark.parametrize("cases", [0, 1, 5, 1000])
@pytest.mark.parametrize("size", [1, 2, 7])
@pytest.mark.parametrize("block", [1, 3, 1024])
def test_ranks_share_all_cases_in_as_many_rounds(cases, size, block):
    shares = [ranges(cases, rank, size, block) for rank in range(size)]
    assert [case for own in shares for part in own for case in part] == [*range(cases)]
    assert len({len(own) for own in shares}) == 1
    assert max((len(part) for own in shares for part in own), default=0) <= block


class Two(Alone):
    """Rank 0 of two; it counts how often it waits for the other, which may fail."""

    size, waits, other = 2, 0, None

    def allgather(self, value):
        self.waits += 1
        return [value, self.other]


@pytest.mark.parametrize("in_step", [False, True])
def test_ranks_wait_for_one_another_once_unless_they_must_write_in_step(
    tmp_path, monkeypatch, in_step
):
    begin(tmp_path, one_interval=True)
    monkeypatch.setattr(blocks, "MOST_CASES", 1)
    comm = Two()
    found = _blocks(
        contents_of(Directory(tmp_path)), tmp_path / "part", comm, in_step=in_step
    )
    assert [[*cases] for cases, _ in found if len(cases)] == [[0], [1]]
    assert comm.waits == (4 if in_step else 1)  # three blocks and the end
    comm.other = StoreError("damaged there")
    with pytest.raises(StoreError, match="damaged there"):
        [
            *_blocks(
                contents_of(Directory(tmp_path)),
                tmp_path / "part",
                comm,
                in_step=in_step,
            )
        ]


@pytest.mark.turns
@pytest.mark.parametrize("one_interval", [True, False])
def test_the_size_of_a_block_changes_no_bit(tmp_path, monkeypatch, one_interval):
    begin(tmp_path, one_interval=one_interval)
    write("serial", tmp_path)
    whole = root_variables(tmp_path)
    for most in (1, 2, 3):
        monkeypatch.setattr(blocks, "MOST_CASES", most)
        write("serial", tmp_path)
        assert root_variables(tmp_path) == whole


@pytest.mark.turns
def test_what_each_rank_did_is_told_over_all_runs(tmp_path):
    begin(tmp_path, one_interval=True)
    ranks = [{"rank": r, "host": f"n{r}", "cases": 4, "busy": 9.0 + r,
              "span": 10.0} for r in range(2)]  # fmt: skip
    Runs(tmp_path).write(1, ranks)
    Runs(tmp_path).write(2, ranks[:1])
    (tmp_path / "runs/0003.json").write_text('{"run": 3, "ran')  # torn: left out
    write("serial", tmp_path)
    with h5py.File(tmp_path / "results.h5") as file:
        group = file["performance"]
        assert group["busy_fraction"][:].tolist() == [0.9, 1.0, 0.9]
        assert group["worker_run"][:].tolist() == [1, 1, 2]
        assert group["worker_host"][:].tolist() == [b"n0", b"n1", b"n0"]
        assert "busy_fraction" not in file
    data = hpcwhirl.open_results(tmp_path)
    assert data["busy_fraction"].dims == ("worker",)
    done = python(NETCDF4, tmp_path / "results.h5")
    assert done.returncode == 0, done.stderr
    found, _ = json.loads(done.stdout)
    assert found["busy_fraction"][::2] == [["worker"], [0.9, 1.0, 0.9]]


def test_h5dump_reads_the_head_and_values(folder):
    if shutil.which("h5dump") is None:
        if os.environ.get("HPCWHIRL_EXPECT_MPIIO") == "1":
            pytest.fail("this environment was to have h5dump")
        pytest.skip("no h5dump on this machine (Debian: hdf5-tools)")
    done = ended("h5dump", "-d", "/speed", folder / "results.h5")
    assert done.returncode == 0, done.stderr
    assert "(0): 300, 350, 400, 410, 450" in done.stdout
    head = ended("h5dump", "-H", folder / "results.h5")
    assert head.returncode == 0, head.stderr
    for name in (*ROW, *STATUS, *PERFORMANCE, *TRACES):
        assert f'DATASET "{name}"' in head.stdout


@pytest.mark.slow
@pytest.mark.parametrize("writer", WRITERS)
def test_a_disk_too_small_for_the_file_is_told_and_room_continues(writer, disk):
    place, resize = disk
    begin(place / "out", one_interval=True)
    used = sum(-(-p.stat().st_size // 4096) for p in place.rglob("*") if p.is_file())
    for more in (4, 12, 18):  # values alone, some of the head, nearly all
        resize(f"{4 * (used + more)}k")
        code, told = write(writer, place / "out")
        assert code in (2, 75)
        assert "No space left on device" in told
        assert "Traceback" not in told
        assert [path.name for path in (place / "out").glob("results*")] == []
    resize("8M")
    assert write(writer, place / "out") == (0, "")


@pytest.mark.turns
def test_a_journal_whose_name_is_no_utf_8_is_read_like_any_other(tmp_path):
    begin(tmp_path, one_interval=True)
    write("serial", tmp_path)
    plain = root_variables(tmp_path)
    journal = next((tmp_path / "journal").iterdir())
    shutil.copy(journal, os.fsdecode(os.fsencode(journal.parent) + b"/\xe9\xff.log"))
    assert write("serial", tmp_path) == (0, "")
    assert root_variables(tmp_path) == plain
