"""`hpcwhirl.campaign` and `hpcwhirl.Design`: what the command does, from Python."""

import ctypes
import inspect
import json
import os
import platform
import pydoc
import signal
import struct
import sys

import made_up
import numpy as np
import pytest
import xarray
from launch import ENVIRONMENT, SIX, python, records, root_variables, script
from threadpoolctl import threadpool_info, threadpool_limits

import hpcwhirl
from hpcwhirl.campaign import finalize
from hpcwhirl.campaign.measure import measure_of
from hpcwhirl.campaign.simulate import Result
from hpcwhirl.cli import main
from hpcwhirl.errors import InputError, StoreError
from hpcwhirl.reduction.numbers import one_thread
from hpcwhirl.store.results.gather import gather

pytestmark = pytest.mark.turns

TABLES = {
    "scene": {"duration": 2e-3},
    "solver": {"time_step": 2e-6},
    "output": {"interval": 5e-5},
    "sweep": {"speed": np.array([300.0, 410.0])},
}
UNITS = {"widest": ("m", "widest the centre goes"), "samples": "1"}


class Nameless:
    """An object whose text names its address, another one in each run."""


def widest(case):
    return {"widest": abs(case.centre).max(), "samples": case.sizes["time"]}


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    out = tmp_path_factory.mktemp("python") / "out"
    with hpcwhirl.campaign(TABLES, out, measure=widest, variables=UNITS):
        return out


def test_it_is_shown_and_explained():
    assert {"campaign", "Design"} <= set(dir(hpcwhirl))
    told = pydoc.plain(pydoc.render_doc(hpcwhirl.campaign))
    assert "campaign(design" in told
    assert "measure : your own function of a case" in told
    assert {"design", "out", "measure"} <= set(
        inspect.signature(hpcwhirl.campaign).parameters
    )
    assert "numpy.linspace" in pydoc.plain(pydoc.render_doc(hpcwhirl.Design.of))


def test_it_gives_the_bits_of_the_command(finished, tmp_path):
    with hpcwhirl.campaign(TABLES, tmp_path / "out") as data:
        assert data.sizes["case"] == 2
    assert root_variables(tmp_path / "out") == root_variables(finished)


def test_a_design_is_one_from_tables_a_file_or_a_scene(tmp_path):
    tables = hpcwhirl.Design.of(TABLES, {"gap": np.float64(2e-4)})
    assert tables.base.gap == 2e-4
    path = tmp_path / "speeds.toml"
    path.write_text("scene = {duration = 2e-3}\nsweep = {speed = [300.0, 410.0]}")
    assert len(hpcwhirl.Design.of(path).scenes) == 2
    assert hpcwhirl.Design.of(str(path)).digests == hpcwhirl.Design.of(path).digests
    assert hpcwhirl.Design.of(hpcwhirl.Scene(gap=1e-4)).scenes[0].gap == 1e-4
    assert hpcwhirl.Design.of(tables) is tables
    assert hpcwhirl.Design.of().swept == ("speed", "friction")


def test_a_function_sees_the_case_that_the_results_have(measured):
    with hpcwhirl.open_results(measured) as data:
        for case in range(2):
            own = widest(data.isel(case=case))
            assert float(own["widest"]) == float(data.widest[case])
        assert data.widest.attrs == {
            "units": "m", "long_name": "widest the centre goes"
        }  # fmt: skip
        assert data.samples.to_numpy().tolist() == [data.sizes["time"]] * 2
        assert data.measure_message.to_numpy().tolist() == ["", ""]


def test_it_is_told_the_inputs_of_its_case(tmp_path):
    def inputs(case):
        assert case.regime.item() in {"damped", "undecided", "sustained", "divergent"}
        return {"told": case.attrs["speed"] - case.speed}

    with hpcwhirl.campaign(
        TABLES, tmp_path / "out", measure=inputs, variables={"told": "rad/s"}
    ) as data:
        assert data.measure_message.to_numpy().tolist() == ["", ""]
        assert data.told.to_numpy().tolist() == [0.0, 0.0]


def test_what_the_function_raises_is_a_reason_and_no_failed_case(
    finished, tmp_path, capsys
):
    def broken(case):
        if case.speed < 400:
            raise KeyError("tips")
        return {"one": 1.0}

    def mended(case):
        return {"one": float(case.speed)}

    out, told = tmp_path / "out", {"one": "1"}
    with hpcwhirl.campaign(TABLES, out, measure=broken, variables=told) as data:
        assert data.status.to_numpy().tolist() == ["ok", "ok"]
        assert data.measure_message.to_numpy().tolist() == ["KeyError: 'tips'", ""]
        np.testing.assert_equal(data.one.to_numpy(), [np.nan, 1.0])
    err = capsys.readouterr().err
    assert "case 0: measure gave no numbers: KeyError: 'tips'" in err
    assert "no numbers in 1 of 2 cases, the first because of KeyError: 'tips'" in err
    added = {"one", "measure_message"}
    own, other = root_variables(out), root_variables(finished)
    assert {n: v for n, v in own.items() if n not in added} == other  # the same words
    with hpcwhirl.campaign(
        TABLES, out, measure=mended, variables=told, retry="failed"
    ) as data:
        assert data.one.to_numpy().tolist() == [300.0, 1.0]  # the good one is kept
    assert len(records(out)) == 3


@pytest.mark.parametrize(
    ("given", "why"),
    [
        ({"a": 1.0, "b": 2.0}, "must return the declared variables one, got a, b"),
        (3.0, "must return {name: number}, got 3.0"),
        ({"one": "many"}, "must return a number for one, got 'many'"),
        ({"one": np.zeros(3)}, "must return a number for one, got array([0., 0., 0.])"),
        (Nameless(), "must return {name: number}, got <test_python.Nameless object>"),
    ],
)
def test_what_is_no_number_is_a_reason(given, why, tmp_path):
    one = {**TABLES, "sweep": {"speed": [410.0]}}
    told = {"one": "1"}
    with hpcwhirl.campaign(
        one, tmp_path / "out", measure=lambda _: given, variables=told, version=1
    ) as data:
        assert why in data.measure_message.item()
        assert np.isnan(data.one.item())


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ({"measure": 3}, "measure must be a function of one case, got 3"),
        ({"measure": widest}, "variables must declare what measure returns"),
        ({"measure": widest, "variables": {"speed": "m"}}, "is a name of the results"),
        ({"measure": widest, "variables": {"a b": "m"}}, "letters, digits and _"),
        ({"measure": widest, "variables": {"a": 3}}, "variables must be a mapping"),
        ({"measure": widest, "variables": {"a": "m\x1b[2J"}}, "no control characters"),
        ({"measure": len, "variables": {"a": "m"}}, "cannot be identified by its"),
        ({"case_limt": 3}, "unknown option 'case_limt'; did you mean 'case_limit'?"),
        ({"case_limit": -1}, "case_limit must be a number of seconds > 0, got -1"),
        ({"fresh": "yes"}, "fresh must be True or False, got 'yes'"),
        ({"design": 3}, "design must be a Design, a TOML file"),
        ({"design": {"sweep": {"sped": [1, 2]}}}, "did you mean 'speed'?"),
        ({"design": {"scene": {"gap": -1.0}}}, "gap must be >= 0.0, got -1.0"),
    ],
)
def test_wrong_input_is_one_line_and_nothing_is_made(arguments, told, tmp_path):
    with pytest.raises(InputError) as failed:
        hpcwhirl.campaign(**{"design": TABLES, "out": tmp_path / "out", **arguments})
    assert told in str(failed.value)
    assert not (tmp_path / "out").exists()


def test_other_variables_than_it_was_begun_with_are_refused(measured, tmp_path, capsys):
    before = (measured / "campaign.json").read_bytes()
    with pytest.raises(InputError, match=r"was begun with measure = .*got None"):
        hpcwhirl.campaign(TABLES, measured)
    with pytest.raises(InputError, match=r"got .*'widest': \['mm'"):
        hpcwhirl.campaign(
            TABLES, measured, measure=widest, variables={**UNITS, "widest": "mm"}
        )
    path = tmp_path / "plain.toml"
    path.write_text("sweep = {speed = [300.0, 410.0]}")
    plain = {n: v for n, v in TABLES.items() if n != "sweep"}
    sets = [f"--set={n}={v}" for table in plain.values() for n, v in table.items()]
    assert main(["campaign", str(path), *sets, "--out", str(measured)]) == 2
    assert "was begun with measure" in capsys.readouterr().err
    assert (measured / "campaign.json").read_bytes() == before


def test_another_function_is_refused_and_its_numbers_are_not_taken(tmp_path, capsys):
    """In a notebook a function is changed and the cell is run again."""

    def plain(case):
        return {"one": float(case.speed)}

    def larger(case):
        return {"one": 1000.0 * float(case.speed)}

    told = {"out": tmp_path / "out", "variables": {"one": "1"}}
    with hpcwhirl.campaign(TABLES, measure=plain, **told):
        pass
    with pytest.raises(InputError, match=r"numbers of another measure.*fresh=True"):
        hpcwhirl.campaign(TABLES, measure=larger, **told)
    with hpcwhirl.campaign(TABLES, measure=plain, **told) as same:
        assert same.one.to_numpy().tolist() == [300.0, 410.0]
    again = {"measure": larger, "fresh": True}
    with hpcwhirl.campaign(TABLES, **again, **told) as fresh:
        assert fresh.one.to_numpy().tolist() == [300e3, 410e3]
    assert "gave no numbers" not in capsys.readouterr().err


def in_place(case):
    case.centre.values[:] = 7.0
    return {"one": 1.0}


def by_subtraction(case):
    case["centre"] -= case.centre.mean()
    return {"one": 1.0}


def by_its_base(case):
    for name in case.variables:
        values = case[name].values
        while values is not None:
            values.setflags(write=True)
            values[...] = values.dtype.type(7)
            values = values.base
    return {"one": 1.0}


@pytest.mark.parametrize("changes", [in_place, by_subtraction, by_its_base])
def test_a_function_that_works_in_place_changes_nothing_stored(
    finished, tmp_path, changes
):
    out, told = tmp_path / "out", {"one": "1"}
    with hpcwhirl.campaign(TABLES, out, measure=changes, variables=told) as data:
        reasons = data.measure_message.to_numpy().tolist()
    assert all("read-only" in why for why in reasons) or changes is by_its_base
    own = root_variables(out)
    added = {"one", "measure_message"}
    assert {n: v for n, v in own.items() if n not in added} == root_variables(finished)


class Silent(Exception):  # noqa: N818
    def __str__(self):
        raise ValueError


class Base(BaseException):
    pass


def leaves_by_exit(_):
    sys.exit(3)


def leaves_by_0(_):
    sys.exit(0)


def leaves_at_once(_):
    os._exit(0)


def raises_silent(_):
    raise Silent


def raises_base(_):
    raise Base


def forks(_):
    child = os.fork()
    if child:
        return {"one": os.waitpid(child, 0)[1] * 0 + 1.0}
    return {"one": 2.0}


def forks_and_leaves(_):
    child = os.fork()
    if not child:
        os._exit(0)
    return {"one": os.waitpid(child, 0)[1] + 1.0}


def goes_away(_):
    os.chdir("/")
    return {"one": 1.0}


ENDS = {  # of a user's function, and what is told
    leaves_by_exit: "SystemExit: 3",
    leaves_by_0: "SystemExit: 0",
    leaves_at_once: "_EndError: os._exit(0) would have ended the campaign",
    raises_silent: "Silent, whose text cannot be printed: ValueError",
    raises_base: "Base: ",
    forks: "",
    forks_and_leaves: "",
    goes_away: "",
}


@pytest.mark.parametrize(("ends", "why"), ENDS.items())
def test_a_function_that_would_end_the_process_is_a_row(
    tmp_path, monkeypatch, capfd, ends, why
):
    monkeypatch.chdir(tmp_path)
    told = {"variables": {"one": "1"}, "measure": ends}
    with hpcwhirl.campaign(TABLES, "out", **told) as data:
        assert data.measure_message.to_numpy().tolist() == [why] * 2
        expected = [np.nan if why else 1.0] * 2
        np.testing.assert_equal(data.one.to_numpy(), expected)
    assert os.getcwd() == str(tmp_path)  # noqa: PTH109 - it is what may have changed
    assert os._exit is REAL_EXIT
    came_back = capfd.readouterr().err.count("forked by measure returned")
    assert came_back == (2 if ends is forks else 0)


REAL_EXIT = os._exit


def test_a_class_method_is_a_function_of_a_case(tmp_path):
    told = {"out": tmp_path / "out", "variables": {"one": "1"}}
    with hpcwhirl.campaign(TABLES, measure=Whole.speed, **told) as data:
        assert data.one.to_numpy().tolist() == [300.0, 410.0]


class Whole:
    scale = 1.0

    @classmethod
    def speed(cls, case):
        return {"one": cls.scale * float(case.speed)}


def test_a_version_is_compared_instead_of_the_source(tmp_path):
    told = {"out": tmp_path / "out", "variables": {"one": "1"}}
    with hpcwhirl.campaign(TABLES, measure=lambda _: {"one": 1}, version=1, **told):
        pass
    other = {"measure": lambda _: {"one": 2}, **told}
    with hpcwhirl.campaign(TABLES, version="1", **other) as data:
        assert data.one.to_numpy().tolist() == [1.0, 1.0]
    with pytest.raises(InputError, match=r"another measure: its version differs"):
        hpcwhirl.campaign(TABLES, version=2, **other)
    with pytest.raises(InputError, match="only with measure, got 2"):
        hpcwhirl.campaign(TABLES, tmp_path / "other", version=2)


def test_a_stop_is_an_error_that_says_how_to_go_on(measured, tmp_path, monkeypatch):
    def stops(case):
        if os.environ.get("STOP_HERE"):
            os.kill(os.getpid(), signal.SIGTERM)
        return widest(case)

    told = {"out": tmp_path / "out", "variables": UNITS, "measure": stops}
    monkeypatch.setenv("STOP_HERE", "yes")
    with pytest.raises(hpcwhirl.StoppedError, match=r"TERM.*the same call continues"):
        hpcwhirl.campaign(TABLES, **told)
    assert len(records(tmp_path / "out")) == 1
    monkeypatch.delenv("STOP_HERE")
    with hpcwhirl.campaign(TABLES, **told):
        assert root_variables(tmp_path / "out") == root_variables(measured)


SCRIPT = f"""
import json, sys
import hpcwhirl
from numpy import array
TABLES, UNITS = {TABLES}, {UNITS}
{inspect.getsource(widest)}
with hpcwhirl.campaign(TABLES, sys.argv[1], measure=widest, variables=UNITS) as data:
    sys.stdout.write(json.dumps(data.widest.to_numpy().tolist()) + "\\n")
try:
    hpcwhirl.campaign(TABLES, sys.argv[1])
except ValueError as failed:
    sys.stdout.write(f"{{failed}}\\n")
"""


@pytest.mark.mpi
def test_a_script_of_two_ranks_gives_the_bits_of_one(measured, tmp_path):
    out = tmp_path / "out"
    done = script(tmp_path / "script.py", SCRIPT, out, ranks=2)
    assert done.returncode == 0, done.err
    assert root_variables(out) == root_variables(measured)
    lines = done.out.splitlines()
    with hpcwhirl.open_results(measured) as data:
        values = data.widest.to_numpy().tolist()
    assert [json.loads(line) for line in lines if line[0] == "["] == [values] * 2
    assert sum("was begun with measure" in line for line in lines) == 2


THREADS = """
import json, sys
import scipy.linalg  # both libraries must be there to be told
from threadpoolctl import threadpool_info, threadpool_limits
import hpcwhirl
from hpcwhirl.scene import Scene, apply_settings
threadpool_limits(int(sys.argv[1]))
for given in ({"rotation": "full"}, {"scheme": "paper"}):
    settings = {"duration": 2e-3, "time_step": 2e-6, **given}
    print(json.dumps(hpcwhirl.simulate(apply_settings(Scene(), settings)).row))
print(*{p["num_threads"] for p in threadpool_info() if p["user_api"] == "blas"})
"""


def test_code_that_changes_the_threads_of_blas_changes_them_for_itself_alone():
    def threads(of=None):
        told = [one for one in threadpool_info() if one["user_api"] == "blas"]
        return {one["filepath"]: one["num_threads"] for one in told
                if of is None or one["filepath"] in of}  # fmt: skip

    with threadpool_limits(2, user_api="blas"):
        # a library of one thread alone, such as cvxopt's, may be loaded, too
        able = [path for path, count in threads().items() if count == 2]
        assert able
        with one_thread():
            with one_thread(anew=True):
                threadpool_limits(2, user_api="blas")
                assert threads(able) == dict.fromkeys(able, 2)
            with one_thread():
                assert threads(able) == dict.fromkeys(able, 1)
            assert threads(able) == dict.fromkeys(able, 1)
        assert threads(able) == dict.fromkeys(able, 2)


ROUNDED = {"up": 0x800, "down": 0x400, "to zero": 0xC00}  # of <fenv.h> on x86-64
FLUSHED = 0x8040  # bits of MXCSR: subnormal numbers are zero
x86 = pytest.mark.skipif(platform.machine() != "x86_64", reason="bits of x86-64")


def spoil(how):
    """Change the floating-point environment as a library may; return the former."""
    mathematics, former = ctypes.CDLL(None), ctypes.create_string_buffer(256)
    mathematics.fegetenv(former)
    if how in ROUNDED:
        mathematics.fesetround(ROUNDED[how])
    else:
        changed = bytearray(former.raw)
        changed[28:32] = struct.pack(
            "I", struct.unpack("I", changed[28:32])[0] | FLUSHED
        )
        mathematics.fesetenv(bytes(changed))
    return former


@x86
@pytest.mark.parametrize("how", [*ROUNDED, "flushed"])
def test_a_measure_that_changes_how_numbers_round_changes_no_bit(
    measured, tmp_path, how
):
    """Nor does a caller who has changed it, who finds it afterwards as it was."""

    def spoiling(case):
        found = widest(case)
        spoil(how)
        return found

    mathematics = ctypes.CDLL(None)
    for number in range(2):
        former = spoil(how) if number else None
        try:
            rounding = mathematics.fegetround()
            with hpcwhirl.campaign(
                TABLES,
                tmp_path / str(number),
                measure=spoiling,
                variables=UNITS,
                version=1,
            ) as data:
                assert (data.status == "ok").all()
            assert mathematics.fegetround() == rounding
        finally:
            mathematics.fesetenv(former or ctypes.c_void_p(-1))
        assert root_variables(tmp_path / str(number)) == root_variables(measured)


def test_a_row_that_was_recorded_but_not_gathered_is_told(
    tmp_path, monkeypatch, capsys
):
    def losing(directory, *rest, **options):
        """Gather from a disk that has lost part of the last record."""
        (log,) = directory.journals.files()
        os.truncate(log, log.stat().st_size - 100)
        return gather(directory, *rest, **options)

    monkeypatch.setattr(finalize, "gather", losing)
    out = tmp_path / "out"
    with pytest.raises(StoreError, match=r"1 of 2 cases have ended, but have no row"):
        hpcwhirl.campaign(TABLES, out)
    monkeypatch.setattr(finalize, "gather", gather)
    with hpcwhirl.campaign(TABLES, out) as data:
        assert (data.status == "ok").all()
    monkeypatch.setattr(finalize, "gather", losing)
    file = tmp_path / "c.toml"
    file.write_text(SIX.replace("0.05", "0.002"))
    assert main(["campaign", str(file), "--out", str(tmp_path / "by-command")]) == 1
    assert "1 of 6 cases failed, 1 of them without a row" in capsys.readouterr().err


def test_a_campaign_within_its_own_measure_is_refused_at_once(tmp_path):
    """It would wait for itself, ten seconds in every case."""
    out = tmp_path / "out"

    def nested(case):
        hpcwhirl.campaign(TABLES, out)
        return {"x": float(case.speed)}

    with hpcwhirl.campaign(
        TABLES, out, measure=nested, version=1, variables={"x": "1"}
    ) as data:
        (why,) = set(data.measure_message.to_numpy().tolist())
        assert "is being computed by this process already" in why
        assert (data.status == "ok").all()


@pytest.mark.slow
def test_threads_of_the_callers_blas_change_no_bit_and_stay_as_they_were():
    """OpenBLAS rounds the matrices of a step otherwise on two threads than on one."""
    free = {n: v for n, v in ENVIRONMENT.items() if not n.endswith("_NUM_THREADS")}
    ran = [python(THREADS, count, env=free, check=True) for count in (1, 2)]
    told = [done.stdout.splitlines() for done in ran]
    assert told[0][:2] == told[1][:2]
    assert [lines[2] for lines in told] == ["1", "2"]


UNLIKE = """
import os, sys
import hpcwhirl
from mpi4py import MPI
from numpy import array
rank = MPI.COMM_WORLD.rank
if {choice}:
    def own(case): return {{"x": 1.0}}
else:
    def own(case): {body}
try:
    data = hpcwhirl.campaign(
        {tables}, sys.argv[1], measure=own, variables={{"x": "1"}}{more}
    )
except ValueError as failed:
    sys.stdout.write(f"{{failed}}\\n")
else:
    sys.stdout.write(f"{{data.measure_message.to_numpy().tolist()}}\\n")
"""


def two_ranks(tmp_path, **words):
    text = UNLIKE.format(tables=TABLES, **words)
    return script(tmp_path / "script.py", text, tmp_path / "out", ranks=2)


@pytest.mark.mpi
@pytest.mark.parametrize(
    ("more", "why"),
    [
        ("", "its place in the source file differs"),
        (", version=rank", "its version differs"),
    ],
)
def test_ranks_of_different_functions_are_refused_and_nothing_is_made(
    tmp_path, more, why
):
    body = 'return {"x": 2.0}'
    done = two_ranks(tmp_path, choice="rank == 0", body=body, more=more)
    assert done.returncode == 0, done.err
    assert done.out.count("got another one on rank 1 than on rank 0: " + why) == 2
    assert not (tmp_path / "out").exists()


@pytest.mark.mpi
@pytest.mark.parametrize(
    ("body", "why"),
    [
        ("sys.exit(0)", "SystemExit: 0"),
        ("raise BaseException", "BaseException: "),
        ("os._exit(0)", "would have ended the campaign"),
    ],
)
def test_a_function_that_ends_one_rank_hangs_no_other(tmp_path, body, why):
    body = f"{body} if rank or case.speed > 400 else None; return {{'x': 0.0}}"
    if body.startswith("raise"):
        body = "raise BaseException"
    done = two_ranks(tmp_path, choice="False", body=body, more=", version=1")
    assert done.returncode == 0, done.err
    assert done.out.count(why) >= 2


@pytest.mark.mpi
def test_an_interrupt_of_one_rank_ends_all(tmp_path):
    body = "raise KeyboardInterrupt"
    done = two_ranks(tmp_path, choice="False", body=body, more=", version=1")
    assert done.returncode != 0
    assert "KeyboardInterrupt" in done.err


@pytest.mark.parametrize("name", ["word_share", "twins", "cells", "boundaries"])
def test_a_variable_may_not_have_a_name_of_the_results(name):
    with pytest.raises(InputError, match=f"{name} is a name of the results"):
        measure_of(dict, {name: "1"})


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"spede": 3}, "did you mean 'speed'?"),
        ({"gap": -1.0}, "gap must be >= 0"),
        ({"rotor": {}}, "it is the table [engine.rotor]"),
        ({"engine": {"bearing": {}}}, "it belongs in [engine.rotor]"),
        ({"engine": {"rotor": {"blade": 3}}}, "did you mean 'blades'?"),
    ],
)
def test_a_scene_made_in_python_is_refused_in_the_words_of_the_command(given, told):
    with pytest.raises(InputError) as failed:
        hpcwhirl.Scene(**given)
    assert told in str(failed.value)
    assert "\n" not in str(failed.value)


def test_help_tells_the_parameters_of_what_is_called():
    told = pydoc.plain(pydoc.render_doc(hpcwhirl.campaign))
    first = told[: told.index("PACKAGE CONTENTS")]
    for name in ("design :", "out :", "measure :", "variables :", "comm :", "Raises"):
        assert name in first
    assert "HALT" not in told


@pytest.fixture(scope="module")
def opened(tmp_path_factory):
    place = tmp_path_factory.mktemp("accessor") / "out"
    document = {"sweep": {"speed": [300.0, 400.0, 500.0], "friction": [0.05, 0.1]}}
    return hpcwhirl.open_results(made_up.campaign(place, document, samples=400))


def test_a_map_is_axes_over_what_was_swept(opened):
    axes = np.ravel(opened.hpcwhirl.map(x="friction", y="speed"))[0]
    assert "friction" in axes.get_xlabel()
    assert "speed" in axes.get_ylabel()


def test_an_orbit_is_that_of_the_case_in_both_frames(opened):
    static, rotating = opened.hpcwhirl.orbit(3, transient=True)
    assert "static" in static.get_xlabel()
    assert "rotating" in rotating.get_xlabel()
    drawn = np.vstack([line.get_xydata() for line in static.lines[:2]])
    assert len(drawn) == opened.sizes["time"]
    kept = opened.centre.isel(case=3).to_numpy()
    factor = np.ptp(drawn[:, 0]) / np.ptp(kept[:, 0])  # mm, um or nm
    assert np.log10(factor) / 3 == pytest.approx(round(np.log10(factor) / 3))


def test_a_spectrum_has_a_circle_at_its_frequency_and_side(opened):
    axes = opened.hpcwhirl.spectrum(2)
    omega, amplitude = axes.lines[0].get_data()
    row = opened.isel(case=2)
    late = row.time.to_numpy() > float(row.end_time - row.window)
    assert len(omega) == np.count_nonzero(late)
    assert (np.diff(omega) > 0).all()
    assert amplitude.max() < 1.1e3 * abs(row.centre.to_numpy()).max() * 2**0.5


@pytest.mark.parametrize("case", [6, -1])
def test_a_case_that_is_none_is_one_clear_line(opened, case):
    with pytest.raises(InputError, match="case must be a finished case, 0 to 5"):
        opened.hpcwhirl.orbit(case)


def test_a_condition_chooses_cases_and_refuses_a_word_that_there_is_not(opened):
    found = opened.hpcwhirl.where("speed > 300 and status == ok")
    wanted = (opened.speed > 300) & (opened.status == "ok")
    assert found.case.to_numpy().tolist() == np.flatnonzero(wanted).tolist()
    with pytest.raises(InputError, match=r"where: .*'sustaned'.*'sustained'"):
        opened.hpcwhirl.where("regime == sustaned")


@pytest.mark.parametrize("name", ["regime", "whirl"])
def test_words_are_drawn_by_xarrays_own_plot(opened, name):
    shown = hpcwhirl.grid(opened)[name]
    mesh = shown.plot(x="speed", y="friction")
    names = [t.get_text() for t in mesh.colorbar.ax.get_yticklabels()]
    codes = mesh.get_array().reshape(2, 3)
    told = np.array(names)[np.ma.filled(codes, 0).astype(int)]
    known = shown.transpose("friction", "speed").to_numpy()
    there = ~np.ma.getmaskarray(codes)
    assert there.any()
    assert (told == known)[there].all()
    mesh.figure.clear()
    line = shown.isel(speed=0).plot()
    labels = [t.get_text() for t in line.axes.get_yticklabels()]
    known = shown.isel(speed=0).to_numpy().tolist()
    for code, word in zip(line.get_ydata(), known, strict=True):
        assert (labels[int(code)] if code >= 0 else "none") == word
    line.figure.clear()
    with pytest.raises(InputError, match=r"over one or two swept inputs, got case"):
        opened[name].plot()
    assert opened.speed.plot()  # numbers as ever


def test_results_without_a_file_and_wrong_wishes_are_told(opened):
    with pytest.raises(InputError, match="have no file"):
        xarray.Dataset({"speed": ("case", [1.0])}).hpcwhirl.map()
    with pytest.raises(InputError, match="options of map are x, y, panels"):
        opened.hpcwhirl.map(xx="speed")


def test_a_result_is_a_table_in_a_notebook():
    told = Result({"regime": "<b>", "gap": 1.28e-4}, {}, {})._repr_html_()
    assert "<td>&lt;b&gt;</td>" in told
    assert "<th>gap</th><td>0.000128</td><td>m</td>" in told


def test_a_result_draws_its_orbit_in_both_frames():
    scene = hpcwhirl.Scene(duration=0.02)
    case = hpcwhirl.simulate(scene)
    static, rotating = case.plot(transient=True)
    lines = [np.column_stack(line.get_data()) for line in static.lines[:2]]
    factor = 1e3 if static.get_label() == "mm" else 1e6
    assert np.concatenate(lines) == pytest.approx(factor * case.traces["centre"])
    assert "rotating" in rotating.get_xlabel()
    assert f"k = {scene.nodal_diameter}" in static.figure.get_suptitle()
    with pytest.raises(InputError, match='traces = "orbit"'):
        Result(case.row, {}, {}).plot()


def test_results_are_shown_in_the_units_of_the_file_whoever_gathers_them(tmp_path):
    tables = TABLES | {"sweep": {"speed": ["3000 rpm", "4000 rpm"]}}
    with hpcwhirl.campaign(tables, tmp_path) as data:
        assert data.attrs["units"] == "rpm"
        assert "rpm" in data.hpcwhirl.map().get_xlabel()
    (tmp_path / "results.h5").unlink()
    assert main(["gather", str(tmp_path)]) == 0
    with hpcwhirl.open_results(tmp_path) as data:
        assert data.attrs["units"] == "rpm"
    again = tables | {"sweep": {"speed": ["50 Hz", "4000 rpm"]}}  # the same cases
    with hpcwhirl.campaign(again, tmp_path) as data:
        assert data.attrs["units"] == "Hz"
