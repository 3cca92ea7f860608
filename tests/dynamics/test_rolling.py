"""Black's rotor with friction that follows the slip: rolling, whip, and the end."""

import pytest
from pictures import rolling

DURATION, STEP = 1.2, 4e-6  # s


@pytest.mark.slow
def test_a_disk_rolls_in_its_ring_whips_and_stops_at_black_s_frequencies():
    """It is hit once at rest, while its speed rises and falls again."""
    rub = rolling.marched(DURATION, time_step=STEP)
    least, whip = rolling.limits()
    for w in (-650.0, -800.0, -900.0):
        assert rolling.near(rub, w, DURATION) == pytest.approx(w, rel=0.01)
    for w in (-1200.0, -1280.0):  # tips slide: the faster disk does not whirl faster
        assert rolling.near(rub, w, DURATION) == pytest.approx(-whip, rel=5e-3)
    assert rolling.ending(rub, DURATION) == pytest.approx(-least, rel=0.02)
