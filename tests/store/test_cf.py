"""Results by the CF conventions: by our own rules, and by a checker nobody here wrote.

`compliance-checker` of the IOOS, as a program of its own. One of its checks is left
out: it asks of whatever dimension is called `time` that it be a calendar's, which CF
does not (https://github.com/ioos/compliance-checker/issues/1245); ours is engine time
in seconds. It also wants names that end in .nc.
"""

import json
import shutil
from pathlib import Path

import h5py
import made_up
import numpy as np
import pytest
import xarray
from journals import plan_of
from launch import ended
from specimen import begin

from hpcwhirl.cli import main
from hpcwhirl.scene import Scene, flatten
from hpcwhirl.scene.quantities import INPUTS, TRACES, variable_name
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.directory.manifest import PlanFile
from hpcwhirl.store.reading.reader import GROUPS, open_coded
from hpcwhirl.store.results.gather import gather
from hpcwhirl.store.results.layout import CONVENTIONS

pytestmark = pytest.mark.turns

ASIDE = "check_spatiotemporal_dims_have_coordinate_vars"
SHORT = ["--set", "duration=0.02", "--set", "traces=full", "--quiet"]
MISTUNED = [[0.0] * 21 + [change] for change in (0.01, 1 / 3)]
SWEEPS = {
    "numbers": {"speed": [300.0, 350.5], "nodal_diameter": [1, 2]},
    "words": {"direction": ["squeeze", "stretch"], "scheme": ["modal", "exact"]},
    "lists": {
        "rotor.mistuning": MISTUNED,
        "revolutions": [1.0, 2.0],
        "casing.harmonics": [5, 20],
        "casing.thickness": [0.02, 0.03],
    },
}


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Return {kind: results}, of every kind there is."""
    place = tmp_path_factory.mktemp("cf")
    found = {}
    for name, sweep in SWEEPS.items():
        document, bad = {"sweep": sweep}, {1: "it would not"}
        samples = 40 if name == "numbers" else 0
        folder = made_up.campaign(place / name, document, samples, bad)
        found[name] = folder / "results.h5"
    for name, one in (("full", True), ("sampled", False)):  # with a missing case
        (place / name).mkdir()
        begin(place / name, one_interval=one)
        found[name] = gather(
            Directory(place / name), {"version": "0"}, compress=3 * one
        )
    sweep = {"speed": [100.0, 300.0, 500.0], "gap": [1e-4, 2e-4]}
    rule = {"over": ["speed", "gap"], "levels": 2, "first": "draft"}
    document = {"sweep": sweep, "refine": rule | {"confirm": "standard"}}
    split = made_up.refined_campaign(
        place / "refined", document, lambda s: ("damped", "sustained")[s["speed"] > 270]
    )
    found["refined"] = split / "results.h5"
    shutil.copytree(place / "full", place / "named")
    assert main(["classify", str(place / "named"), "--set", "rise=0.1", "--write"]) == 0
    found["named"] = place / "named" / "results.h5"
    found["one"] = place / "one.h5"
    assert main(["run", *SHORT, "--out", str(found["one"])]) == 0
    return found


def variables(path):
    """Return {path in the file: (attributes, type)} of every variable."""
    found = {}

    def take(name, item):
        if isinstance(item, h5py.Dataset):
            found[name] = dict(item.attrs), item.dtype

    with h5py.File(path) as file:
        file.visititems(take)
    return found


def test_every_variable_has_a_unit_and_a_meaning(made):
    for kind, path in made.items():
        for name, (told, _) in variables(path).items():
            assert told.get("units"), (kind, name)
            assert told.get("long_name"), (kind, name)


def test_whatever_can_be_swept_has_the_unit_of_the_table(tmp_path):
    names, base = [*INPUTS], flatten(Scene())
    PlanFile(tmp_path).write(plan_of(base, names, [base]))
    told = variables(gather(Directory(tmp_path), {}))
    assert len({*map(variable_name, names)}) == len(names)
    for name, quantity in INPUTS.items():
        attributes, dtype = told[variable_name(name)]
        assert attributes["units"].decode() == quantity.unit, name
        assert (dtype.kind == "S") == isinstance(base[name], str | list)


def test_swept_inputs_are_told_by_the_table(made):
    for kind, sweep in SWEEPS.items():
        told = {
            n.rpartition("/")[2]: of for n, (of, _) in variables(made[kind]).items()
        }
        for name in sweep:
            full = next(n for n in INPUTS if n == name or n.endswith(f".{name}"))
            attributes = told[variable_name(full)]
            assert attributes["units"].decode() == INPUTS[full].unit, name
    thickness = variables(made["lists"])["casing_thickness"][0]
    assert thickness["units"] == b"m"
    assert TRACES["rubbed"].meaning == "cumulative work of friction"


def test_the_head_names_conventions_and_history_that_no_day_changes(made):
    heads = []
    for path in made.values():
        with h5py.File(path) as file:
            heads.append((file.attrs["Conventions"], file.attrs["history"]))
    assert set(heads) == {(CONVENTIONS.encode(), heads[0][1])}
    assert heads[0][1]


def test_flags_have_a_meaning_for_every_value(made):
    for kind, path in made.items():
        with h5py.File(path) as file:
            for name, (told, dtype) in variables(path).items():
                if "flag_values" not in told:
                    continue
                values, meanings = told["flag_values"], told["flag_meanings"].split()
                assert values.dtype == dtype == np.int8, (kind, name)
                assert len(values) == len(meanings), (kind, name)
                assert set(file[name][:].tolist()) <= set(values.tolist())


def fewest(made, place):
    """Write files with every variable, attributes, type and name in the head.

    The checker takes a while for each variable: what one file has, no other has again,
    but for axes.
    """
    links, holds = {"DIMENSION_LIST", "REFERENCE_LIST"}, {}
    for kind, path in made.items():
        with h5py.File(path) as file:
            holds[kind] = set(file.attrs)
        for name, (told, dtype) in variables(path).items():
            attributes = sorted(
                (n, str(of)) for n, of in told.items() if n not in links
            )
            holds[kind].add((name, str(dtype), *attributes))
    left = set().union(*holds.values())
    while left:
        kind = max(holds, key=lambda kind: len(holds[kind] & left))
        shutil.copy(made[kind], place / f"{kind}.nc")
        with h5py.File(place / f"{kind}.nc", "r+") as file:
            heads = file.attrs.get("coordinates", b"").decode().split()
            known = [told for told in holds[kind] - left if isinstance(told, tuple)]
            for name, *_ in known:
                if not file[name].is_scale and name not in heads:
                    del file[name]
        left -= holds[kind]


@pytest.mark.slow
def test_a_checker_of_others_finds_no_error_and_no_warning(made, tmp_path):
    fewest(made, tmp_path)
    version = CONVENTIONS.removeprefix("CF-")
    call = ["compliance-checker", f"--test=cf:{version}", f"--skip-checks={ASIDE}"]
    files = sorted(tmp_path.glob("*.nc"))
    out = tmp_path / "found.json"
    done = ended(*call, "--format=json_new", f"--output={out}", *files)
    assert done.returncode == 0, done.stdout + done.stderr
    found = json.loads(out.read_text())
    assert {Path(name).name for name in found} == {path.name for path in files}
    assert len(files) > 3
    for name, report in found.items():
        (told,) = report.values()
        wrong = [
            (each["name"], each["msgs"])
            for level in ("high_priorities", "medium_priorities")
            for each in told[level]
            if each["value"][0] < each["value"][1]
        ]
        assert wrong == [], name
        assert told["high_count"] == 0, name


@pytest.mark.parametrize(
    "kind", [*SWEEPS, "full", "sampled", "refined", "named", "one"]
)
def test_results_are_those_that_xarray_reads_by_itself(made, kind):
    asked = {"engine": "h5netcdf", "mask_and_scale": False, "decode_times": False}
    names = set()
    with h5py.File(made[kind]) as file:
        groups = ["", *filter(file.__contains__, GROUPS)]
    with open_coded(made[kind]) as ours:
        for group in groups:
            with xarray.open_dataset(made[kind], group=group or None, **asked) as own:
                for name in own.variables.keys() - ({"case"} if group else set()):
                    theirs = own[name]
                    known = name if name in own.dims else GROUPS.get(group, "") + name
                    names.add(known)
                    values = theirs.values
                    if values.dtype.kind == "S":
                        values = np.char.decode(values, "utf-8")
                    np.testing.assert_array_equal(ours[known], values)
                    assert ours[known].dims == theirs.dims
                    assert ours[known].attrs.get("units") == theirs.attrs.get("units")
                    assert group or (name in ours.coords) == (name in own.coords)
        assert names == set(ours.variables)
