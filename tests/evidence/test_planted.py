"""Blow-up is told from divergence: what is planted is lost, what is physics grows."""

import numpy as np
import pytest

from hpcwhirl.analysis.regimes import Thresholds, growths, name_regime
from hpcwhirl.campaign.simulate import result_of
from hpcwhirl.case import limits
from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.kernels.loop.slots import (
    CASING,
    FLOW,
    FLOW_CASING,
    FOUR,
    PUSH_IM,
    PUSH_RE,
    PUSHED,
)
from hpcwhirl.dynamics.kernels.loop.wave_types import FlowRows
from hpcwhirl.dynamics.march import March
from hpcwhirl.dynamics.schemes import equal_sectors
from hpcwhirl.dynamics.waves import slots
from hpcwhirl.scene import apply_settings, named_scene

SCHEMES = ["modal", "exact", "general", "paper"]
TURNING = ("modal", "exact")  # the ring in the frame of the blades
LOST = ("unstable", "none", "none")


@pytest.fixture(autouse=True)
def _unplanted():
    """Forget arrays with a bug in them, which later cases would share."""
    yield
    for module in (equal_sectors, slots):
        for function in vars(module).values():
            if hasattr(function, "cache_clear"):
                function.cache_clear()


def scene(**settings):
    short = {"duration": 4e-3, "interval": 2e-5, "time_step": 2e-6}
    return apply_settings(named_scene("mostly_damped"), short | settings)


def words(march):
    row = result_of(march.case, march.run()).row
    numbers = [v for v in row.values() if isinstance(v, float)]
    assert np.isfinite(numbers).all()
    return row["outcome"], row["regime"], row["whirl"]


def pushed_at(rows, body):
    """Return indices in `rows.pushed` of what contact changes a body's waves by."""
    flows = isinstance(rows, FlowRows)
    sizes = (FLOW, FLOW_CASING) if flows else (PUSHED, CASING)
    found, at = [], 0
    for counts in zip(rows.rotor, rows.ring, strict=True):
        for own, count, size in zip(("rotor", "casing"), counts, sizes, strict=True):
            for _ in range(count):
                if own == body:
                    found.extend(range(at + PUSH_RE, at + PUSH_IM + FOUR))
                at += size
    assert at == len(rows.pushed)
    return np.array(found)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_what_is_planted_below_is_the_only_fault(scheme):
    assert words(March(resolve(scene(scheme=scheme))))[0] == "completed"


@pytest.mark.parametrize("scheme", ["modal", "general", "paper"])
@pytest.mark.parametrize("damping", [0.0, 0.064])
@pytest.mark.parametrize("hair", [1e-2, 1e-4, 1e-9])
def test_a_step_above_the_limit_by_a_hair(monkeypatch, scheme, damping, hair):
    monkeypatch.setattr(limits, "check_step", lambda *_: None)
    step = min(resolve(scene()).model.limits(0.0).values()) * (1 + hair)
    both = {"casing.damping": damping, "rotor.damping": damping}
    march = March(
        resolve(scene(scheme=scheme, time_step=step, interval=5 * step, **both))
    )
    assert words(march) == LOST


@pytest.mark.parametrize("scheme", ["modal", "general", "paper"])
def test_damped_blow_up_has_an_energy_below_zero(monkeypatch, scheme):
    # the ledger closes, friction feeds and the tips run away: only the energy tells
    monkeypatch.setattr(limits, "check_step", lambda *_: None)
    step = min(resolve(scene()).model.limits(0.0).values()) * 1.001
    march = March(
        resolve(scene(scheme=scheme, time_step=step, interval=5 * step, duration=8e-3))
    )
    history = march.run()
    through = sum(abs(v) for v in history.ledger.values())
    assert abs(history.ledger["residual"]) < 1e-9 * through
    assert history.energy.min() < 0.0
    row = result_of(march.case, history).row | {"step_share": 0.0}  # not compared
    assert row["late_fed"] > 0.0
    assert name_regime(row, Thresholds()) == LOST


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("body", ["rotor", "casing"])
def test_a_wrong_sign_of_friction_in_the_correction(scheme, body):
    march = March(resolve(scene(scheme=scheme)))
    if scheme in TURNING:
        rows = march.scheme.arrays.rotor.rows
        smooth = March(resolve(scene(scheme=scheme, friction=0.0)))
        at = pushed_at(rows, body)
        without = smooth.scheme.arrays.rotor.rows.pushed[at]
        rows.pushed[at] = 2 * without - rows.pushed[at]  # linear in friction
    else:
        getattr(march.scheme.arrays, body).tangential[:] *= -1.0
    assert words(march) == LOST


@pytest.mark.turns
@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("factor", [0.5, 0.999, 1.001, 2.0])
def test_a_broken_row_of_the_delassus_matrix(scheme, factor):
    march = March(resolve(scene(scheme=scheme)))
    touch = march.scheme.arrays.contact
    w = "column" if scheme in TURNING else "w_rotor"
    row = getattr(touch, w).reshape(22, -1)
    row[0] *= factor  # to blade 0 where W is circulant, of blade 0 where it is not
    assert words(march) == LOST


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_term_of_the_ledger_dropped(scheme):
    march = March(resolve(scene(scheme=scheme)))
    if scheme in TURNING:
        pulse = march.scheme.arrays.rotor.pulse  # losses are what works leave
        pulse.move[:], pulse.numbers[1:4] = 0.0, 0.0
    else:  # D is in the matrices of the step already
        march.scheme.arrays.casing.damping[:] *= 0.5
    assert words(march) == LOST


def rates(steps, **settings):
    """Return the growth of ln sqrt(energy) after the pulse at each step, 1/s."""
    out = []
    for step in steps:
        march = March(resolve(scene(time_step=step, interval=4e-5, **settings)))
        history = march.run()
        row = result_of(march.case, history).row
        assert row["regime"] == "divergent"
        late = history.time > 1.2 * march.scene.pulse
        ((rate, _),) = growths(np.stack([history.time, history.energy])[:, late])
        out.append(rate)
    return np.array(out)


THIN = {
    "thickness": 5e-3,
    "engine.casing.damping": 0.064,
    "pulse": 4e-4,
    "duration": 6e-3,
}


@pytest.mark.parametrize("friction", [0.0, 0.1])
def test_a_thin_ring_outrun_by_the_blades_grows_the_same_at_every_step(friction):
    found = rates([4e-6, 2e-6, 1e-6], friction=friction, **THIN)
    assert found.min() > 300.0
    assert found.max() / found.min() < 1.1


@pytest.mark.parametrize("scheme", ["general", "exact"])
def test_friction_that_outgrows_all_losses_does_so_at_every_step(scheme):
    found = rates([4e-6, 2e-6, 1e-6], friction=1.0, scheme=scheme, duration=4e-3)
    assert found.min() > 500.0
    assert found.max() / found.min() < 1.02


RUBBING = {  # Table 2 at 280 rad/s diverges with this casing
    "thickness": 0.0218, "engine.casing.width": 0.16, "engine.casing.damping": 0.064,
    "support_damping": -1.0, "support_frequency": 14.6, "engine.rotor.damping": 0.0104,
    "suspension_damping": -1.0, "pulse": 0.97e-3, "speed": 280.0, "duration": 1.0,
    "interval": 2e-4,
}  # fmt: skip


@pytest.mark.slow
def test_a_slow_divergence_grows_the_same_at_every_step():
    found = []
    for step in (4e-6, 2e-6, 1e-6):
        march = March(resolve(scene(time_step=step, **RUBBING)))
        row = result_of(march.case, march.run()).row
        assert (row["regime"], row["stop"]) == ("divergent", "amplitude")
        found.append(row["growth_rate"])
    assert min(found) > 5.0
    assert max(found) / min(found) < 1.15
