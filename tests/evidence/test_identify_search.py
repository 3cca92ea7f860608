"""The search for the engine: its sequence, what is kept of it, what it begins with."""

from dataclasses import replace

import numpy as np
import pytest
from identify import engine as engines
from identify.kept import Kept, NotKept
from identify.search import Plan, Screen, descend, next_start, search
from identify.space import default_engine, drawn, engine_at, point_of

pytestmark = pytest.mark.evidence

ROW = {"kind": "table 2", "speed": 410.0, "regime": "damped", "whirl": "forward"}


class Bowl(Screen):
    """Costs without integrating: an engine's distance from a point of the box."""

    def __init__(self, kept, most=10**9):
        super().__init__(kept, 1)
        self.computed, self.most = 0, most

    def rows(self, engines):
        for engine in engines:
            if self.computed == self.most:
                raise KeyboardInterrupt
            key = tuple(engine.values())
            if key not in self.kept.rows:
                self.computed += 1
                away = float(((point_of(engine) - 0.3) ** 2).sum())
                self.kept.add(engine, [ROW | {"away": away}], 0.1)
            self.asked[key] = self.kept.rows[key]
        return [self.kept.rows[tuple(e.values())] for e in engines]

    def costs(self, points):
        return np.array([r[0]["away"] for r in self.rows(list(map(engine_at, points)))])


PLAN = Plan(drawn=32, screened=16, batch=8, population=8, patience=5, generations=6)


def sequence(screened, batches):
    out = []
    for told in search(screened, PLAN):
        out.append((told.stage, told.engines, told.best))
        if len(out) == batches:
            return out
    raise AssertionError


def test_the_search_goes_down_and_starts_again_elsewhere():
    def costs(points):
        return ((points - 0.3) ** 2).sum(axis=1)

    plan = replace(PLAN, generations=40, patience=15)
    found = [f.min() for _, f in descend(np.full(8, 0.8), costs, plan, 0)]
    assert found[-1] < 0.02 * found[0]
    points, cost = np.array([[0.1] * 8, [0.12] * 8, [0.9] * 8]), np.array([1, 2, 3.0])
    starts = next_start(points, cost, points[:0])[None]
    assert (starts[0] == points[0]).all()
    assert (next_start(points, cost, starts) == points[2]).all()


def test_a_search_that_was_killed_asks_the_same_questions(tmp_path):
    whole = Bowl(Kept(tmp_path / "whole", "bowl"))
    told = sequence(whole, 12)
    assert told[-1][2] < told[0][2]
    halted = Bowl(Kept(tmp_path / "halted", "bowl"), most=37)
    with pytest.raises(KeyboardInterrupt):
        sequence(halted, 12)
    again = Bowl(Kept(tmp_path / "halted", "bowl"))
    assert sequence(again, 12) == told
    assert again.computed == whole.computed - 37
    assert (tmp_path / "halted").read_bytes() == (tmp_path / "whole").read_bytes()
    assert again.kept.seconds == pytest.approx(0.1 * whole.computed)


def kept_lines(path):
    kept = Kept(path, {"preset": 1})
    for point in drawn(4, 1):
        kept.add(engine_at(point), [ROW], 0.1)
    return path.read_bytes().splitlines(keepends=True)


def test_a_line_cut_by_a_kill_is_cut_off(tmp_path):
    path = tmp_path / "screened"
    lines = kept_lines(path)
    for left in (1, len(lines[-1]) // 2, len(lines[-1]) - 1):
        path.write_bytes(b"".join(lines)[: -len(lines[-1])] + lines[-1][:left])
        assert len(Kept(path, {"preset": 1}).rows) == 3
        assert path.read_bytes() == b"".join(lines[:-1])
    path.write_bytes(lines[0][:10])  # not even the first
    assert Kept(path, {"preset": 1}).rows == {}
    assert path.read_bytes() == lines[0]


@pytest.mark.parametrize("at", [0, 1, 2, 4])
def test_a_bad_line_is_refused_in_one_line(tmp_path, at):
    path = tmp_path / "screened"
    lines = kept_lines(path)
    middle = len(lines[at]) // 2
    lines[at] = lines[at][:middle] + b"\xff" + lines[at][middle + 1 :]
    path.write_bytes(b"".join(lines))
    with pytest.raises(NotKept, match=f"line {at + 1} has checksum") as told:
        Kept(path, {"preset": 1})
    assert str(path) in str(told.value)
    assert "\n" not in str(told.value)
    assert path.read_bytes() == b"".join(lines)  # nothing is lost


def test_another_screening_does_not_go_on_in_it(tmp_path):
    path = tmp_path / "screened"
    before = b"".join(kept_lines(path))
    with pytest.raises(NotKept, match="begun with another box"):
        Kept(path, {"preset": 2})
    assert path.read_bytes() == before


def test_an_engine_to_begin_with_is_read_as_a_setting_is():
    told = "casing.thickness=0.03 suspension_damping=0.1 pulse=5e-4"
    engine = engines.seed_engine(told)
    same = {"engine.casing.thickness": 0.03, "engine.rotor.suspension_damping": 0.1}
    assert engine == default_engine() | same | {"pulse": 5e-4}
    for wrong, said in (("thick_ness=1", "thickness"), ("pulse=-1", "pulse")):
        with pytest.raises(SystemExit):
            engines.main(["--seed-engine", wrong])
        with pytest.raises(Exception, match=said):
            engines.seed_engine(wrong)
