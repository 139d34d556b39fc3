"""The search for failures: what it finds that chance does not, how they shrink, and that each runs again as found."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatrial.cli.app import main
from seatrial.encounters.meeting import Ranges
from seatrial.encounters.rules import Role, judge
from seatrial.encounters.space import Space
from seatrial.workflow import RequestError
from seatrial.workflow.safety import failing as module
from seatrial.workflow.safety.failing import Failure, searched, severities, shrunk

WIND = (0.0, 10.0)
SPACE = Space((Role.GIVE_WAY, Role.STAND_ON), 7.0, 3, Ranges(),
              (WIND, (-math.pi, math.pi), (0.0, 0.0), (0.0, 0.0)))  # fmt: skip


class Planted:
    """Fails near one time, ratio of speeds and wind, with one conduct of the second ship; the nearer the worse."""

    def __init__(self, radius: float) -> None:
        self.radius, self.asked = radius, 0

    def __call__(self, points: np.ndarray) -> tuple[np.ndarray, list[tuple[str, ...]]]:
        self.asked += len(points)
        T, k, conduct, wind = points[:, 0], points[:, 5], points[:, 7], points[:, 8]
        away = np.sqrt(((T - 680.0) / 600.0) ** 2 + (k - 1.3) ** 2 + ((wind - 8.0) / 10.0) ** 2)
        costs = away - self.radius + 0.3 * (conduct != 2.0)
        return costs, [("15",) if cost <= 0.0 else () for cost in costs]


@pytest.mark.parametrize("seed", range(10))
def test_what_chance_meets_once_in_a_thousand_runs_is_found_in_500(seed: int) -> None:
    """The ball has 4/3 pi .1^3 of the cube, and one of three conducts: .0014; 500 draws meet it in half the cases."""
    planted = Planted(0.1)
    found = searched(planted, SPACE, 500, seed, first_only=True)
    assert planted.asked == found.runs <= 500
    [failure] = found.failures
    assert failure.after <= 500
    assert planted(failure.point[None])[0][0] <= 0.0


def test_chance_needs_as_many_as_said() -> None:
    rng, points = np.random.default_rng(1), np.zeros((100_000, len(SPACE.names)))
    spans = ((600.0, 1200.0), (0.5, 1.5), WIND)
    points[:, 0], points[:, 5], points[:, 8] = (rng.uniform(*span, 100_000) for span in spans)
    points[:, 7] = rng.integers(3, size=100_000)
    share = np.mean(Planted(0.1)(points)[0] <= 0.0)
    assert share == pytest.approx(4.0 / 3.0 * math.pi * 0.1**3 / 3.0, rel=0.25)  # three standard errors


def test_it_spends_what_it_has_and_searches_on_after_a_failure() -> None:
    def two(points: np.ndarray) -> tuple[np.ndarray, list[tuple[str, ...]]]:
        """Rule 15 with short times, Rule 16 with long ones, both at once never."""
        T = points[:, 0]
        rules = [("15",) if t < 620.0 else ("16",) if t > 1180.0 else () for t in T]
        return np.minimum(T - 620.0, 1180.0 - T) / 600.0, rules

    found = searched(two, SPACE, 330, 3)
    assert found.runs == 330
    assert sorted(one.broken for one in found.failures) == [("15",), ("16",)]
    nothing = searched(lambda points: (np.ones(len(points)), [()] * len(points)), SPACE, 90, 3)
    assert (nothing.runs, nothing.failures) == (90, ())


def test_runs_are_counted_from_one() -> None:
    def third(points: np.ndarray) -> tuple[np.ndarray, list[tuple[str, ...]]]:
        costs = np.ones(len(points))
        costs[2] = -1.0
        return costs, [("14",) if cost < 0.0 else () for cost in costs]

    [failure] = searched(third, SPACE, 50, 1, first_only=True).failures
    assert failure.after == 3


def test_a_descent_goes_on_while_it_comes_nearer_and_else_begins_anew() -> None:
    def sizes(progress: float) -> list[int]:
        asked, found = module._asked(SPACE, 5), []
        cube = next(asked)
        for k in range(12):
            found.append(len(cube))
            cube = asked.send(np.full(len(cube), 10.0 - progress * k))
        return found

    assert sizes(0.1) == [40, *[20] * 11]
    assert sizes(0.0) == [40, *[20] * 4, 40, *[20] * 4, 40, 20]


def point(**values: float) -> np.ndarray:
    names = SPACE.names
    usual = {"T_1": 700.0, "k_1": 1.3, "psi_1": -2.0, "conduct_1": 1.0, "T_2": 1000.0, "k_2": 0.7, "psi_2": 2.5,
             "conduct_2": 2.0, "wind": 9.0, "wind_from": 1.0, "current": 0.0, "current_towards": 0.0}  # fmt: skip
    return np.array([{**usual, **values}[name] for name in names])


def test_a_failure_is_shrunk_to_what_it_needs() -> None:
    """It needs the second ship with its conduct, some wind, and a ratio of speeds below .9."""
    def needs(points: np.ndarray) -> tuple[np.ndarray, list[tuple[str, ...]]]:
        fails = (points[:, 5] < 0.9) & (points[:, 7] == 2.0) & (points[:, 8] > 3.0) & ~np.isnan(points[:, 4])
        return np.where(fails, -1.0, 1.0), [("17(c)", "8(d)") if one else () for one in fails]

    simple = shrunk(needs, SPACE, Failure(point(), ("8(d)",), 7), quiet=0)
    assert math.isnan(simple.point[0])  # the first ship is not needed
    found = dict(zip(SPACE.names, simple.point, strict=True))
    assert (found["conduct_2"], found["wind"], found["T_2"]) == (2.0, 9.0, 900.0)
    assert found["psi_2"] == pytest.approx(math.radians(135.0))
    assert 0.8 < found["k_2"] < 0.9
    assert (simple.broken, simple.after) == (("17(c)", "8(d)"), 7)
    calm = shrunk(lambda points: (-np.ones(len(points)), [("8(d)",)] * len(points)), SPACE,
                  Failure(point(), ("8(d)",), 1), quiet=0)  # fmt: skip
    assert calm.point[8] == 0.0
    assert np.isnan(calm.point[[0, 4]]).sum() == 1  # somebody is left
    other = shrunk(lambda points: (-np.ones(len(points)), [("14",)] * len(points)), SPACE,
                   Failure(point(), ("8(d)",), 1), quiet=0)  # fmt: skip
    assert np.array_equal(other.point, point())  # another rule is another failure


def test_ships_are_not_shrunk_into_each_other() -> None:
    """On the own course at the own speed a ship that meets the own one is where that is."""
    apart = Space(SPACE.roles, 7.0, 3, Ranges(apart=900.0), SPACE.weather)
    begins = point(T_1=math.nan, k_2=0.8, psi_2=0.1)
    simple = shrunk(lambda points: (-np.ones(len(points)), [("13",)] * len(points)), apart,
                    Failure(begins, ("13",), 1), quiet=0)  # fmt: skip
    assert apart.holds(simple.point)
    assert not np.array_equal(simple.point, begins, equal_nan=True)


def test_severity_is_at_most_zero_where_a_rule_is_broken_and_grows_with_the_distance() -> None:
    from kinematic import Sailed, meeting, tracks

    def judged(own: Any, off: float = 0.0) -> tuple[float, bool]:
        made = tracks([Sailed(0, 0, 0, 8.0, own), Sailed(*meeting(-90.0, 1500.0, 8.0, 1.0, off), -90.0, 8.0, ())],
                      T=3600.0)  # fmt: skip
        found = judge(made, own=True)
        return float(severities(found, 900.0)), bool(found[0].fails)

    hits, keeps = judged(()), judged(((300.0, 60.0, 1.0), (1900.0, -60.0, 1.0)))
    assert hits[1]
    assert hits[0] <= -1.0  # contact
    assert not keeps[1]
    assert keeps[0] > 0.0
    passes = [judged((), off) for off in (600.0, 2000.0, 4000.0)]
    assert passes[0][1]
    assert -1.0 <= passes[0][0] <= 0.0
    assert 0.0 < passes[1][0] < passes[2][0]  # no encounter at all: the farther the better


LATE = """from seatrial.encounters.avoiding import KeepClear
from seatrial.encounters.rules import Limits


def begin(scene):
    return KeepClear(scene, Limits().changed({"horizon": 60.0, "alone": 60.0}, "a planted defect"))
"""
CASE = """schema = "seatrial-case/1"
claim = "it keeps clear"
ship = "kvlcc2_l7"
stack = "late.py:begin"
traffic = ["rules", "ignores"]
[encounters]
roles = ["give-way"]
[weather]
wind = [0.0, 1.0]
"""


@pytest.mark.slow
def test_a_planted_defect_is_found_kept_and_runs_again_bit_for_bit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    monkeypatch.setattr(module, "_FIRST", 4)
    monkeypatch.setattr(module, "_ROUNDS", 2)
    (tmp_path / "late.py").write_text(LATE, encoding="utf-8")
    path, out = tmp_path / "case.toml", tmp_path / "out"
    path.write_text(CASE, encoding="utf-8")
    assert main(["case", str(path), "-o", str(out), "--search", "4"]) == 0
    assert "kinds of failure" in capsys.readouterr().out
    kept = out / "failure-1.toml"
    said = tomllib.loads(kept.read_text(encoding="utf-8"))
    assert said["stack"] == "../late.py:begin"
    assert "16" in said["found"]["broken"]
    assert said["weather"]["wind"] == [0.0, 0.0]
    assert main(["case", str(kept), "-o", str(tmp_path / "again")]) == 0
    assert f"as found: breaks {', '.join(said['found']['broken'])} on the same tracks" in capsys.readouterr().err
    (tmp_path / "late.py").write_text(LATE.replace("60.0", "1200.0"), encoding="utf-8")
    assert main(["case", str(kept), "-o", str(tmp_path / "mended")]) == 0
    assert "not as found: nothing broken, then" in capsys.readouterr().err


@pytest.mark.parametrize(("runs", "change", "said"), [
    (0, ("", ""), "--search is 0"),
    (5, ('roles = ["give-way"]', 'set = "imazu"'), "'imazu' has nothing to vary"),
    (5, ("[weather]", "[sensors.radar]\n[weather]"), "sensors: their errors differ"),
    (5, ('stack = "late.py:begin"', 'stack = { command = "python me.py {address}" }'), "on a wire"),
])  # fmt: skip
def test_what_cannot_be_searched_is_a_line(tmp_path: Path, runs: int, change: tuple[str, str], said: str) -> None:
    path = tmp_path / "case.toml"
    (tmp_path / "late.py").write_text(LATE, encoding="utf-8")
    path.write_text(CASE.replace(*change), encoding="utf-8")
    with pytest.raises(RequestError, match=said):
        module.search(path, tmp_path / "out", runs)
    assert not (tmp_path / "out").exists()
