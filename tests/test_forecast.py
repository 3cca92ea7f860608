"""What --dry-run says beforehand is what there is afterwards."""

import pytest

from hpcwhirl.campaign.design import design_of
from hpcwhirl.campaign.forecast import forecast
from hpcwhirl.campaign.resume import prepare
from hpcwhirl.campaign.run import run_campaign

SHORT = {
    "scene": {"duration": 2e-3},
    "solver": {"time_step": 2e-6},
    "sweep": {"speed": [300.0, 410.0], "friction": [0.0, 0.05, 0.1]},
}


def size(folder, name):
    path = folder / name
    files = [path] if path.is_file() else list(path.iterdir())
    return sum(file.stat().st_size for file in files)


@pytest.mark.parametrize("detail", ["summary", "blades", "orbit", "full"])
def test_bytes_on_disk_are_predicted_within_a_few_percent(tmp_path, detail):
    output = {"traces": detail, "interval": 2e-6 if detail == "orbit" else 5e-5}
    design = design_of(SHORT | {"output": output})
    told = forecast(design, tmp_path).disk
    prepare(design, tmp_path)
    assert run_campaign(design, tmp_path).failed == 0
    found = size(tmp_path, "results.h5")
    assert told.results == pytest.approx(found, rel=0.03, abs=4096)  # a page of HDF5's
    assert told.traces == size(tmp_path, "traces")
    assert told.journal == pytest.approx(size(tmp_path, "journal"), rel=0.1)


def test_what_is_finished_is_learned_from_and_not_counted(tmp_path):
    design = design_of(SHORT | {"output": {"traces": "summary"}})
    before = forecast(design, tmp_path)
    assert (before.cases, before.left, before.finished) == (6, 6, 0)
    assert before.probed == 3
    assert before.seconds > 0.0
    prepare(design, tmp_path)
    run_campaign(design, tmp_path)
    more = SHORT["sweep"] | {"speed": [300.0, 350.0, 410.0]}
    after = forecast(
        design_of(SHORT | {"output": {"traces": "summary"}, "sweep": more}), tmp_path
    )
    assert (after.cases, after.left, after.finished) == (9, 3, 6)
    assert after.probed == 0
    assert after.steps == pytest.approx(3 * 1000)


def test_every_scheme_and_step_is_probed(tmp_path):
    sweep = {"scheme": ["modal", "exact", "paper"], "time_step": [1e-6, 2e-6]}
    design = design_of({"scene": {"duration": 0.01}, "sweep": sweep})
    found = forecast(design, tmp_path)
    assert found.probed == 6
