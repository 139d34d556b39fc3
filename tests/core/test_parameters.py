"""Parameters by their paths: what is walked, replaced, matched, freed, and what a wrong name or number is told."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import pytest

from seatrial.core.parameters import (
    Free,
    ParameterError,
    Parts,
    Spec,
    Terms,
    far,
    match,
    near,
    parts,
    possible,
    read,
    spec,
    specs,
    terms,
    unknown,
    update,
    values,
    walk,
)  # fmt: skip


def meaning(name: str) -> Spec:
    return Spec("'", f"by {name}")


@dataclass(frozen=True)
class Screw:
    D: float = spec("m", "diameter", (0.1, 20.0), default=2.0)


@dataclass(frozen=True)
class Vessel:
    L: float = spec("m", "length", (1.0, 500.0))
    angle: float = spec("rad", "trim", (-0.5, 0.5), default=0.1)
    hull: Terms = terms(meaning)
    screws: Parts = parts("thruster")
    main: Screw = field(default_factory=Screw)
    name: str = "v"


ONE = Vessel(
    100.0, hull=Terms(("vv", "rr"), (-0.3, 0.02)), screws=Parts(("port", "starboard"), (Screw(3.0), Screw(4.0)))
)
PATHS = {"L": 100.0, "angle": 0.1, "hull.vv": -0.3, "hull.rr": 0.02, "screws.port.D": 3.0, "screws.starboard.D": 4.0,
         "main.D": 2.0}  # fmt: skip


def test_every_number_has_a_path_its_meaning_and_its_value() -> None:
    assert values(ONE) == PATHS
    assert [path for path, _, _ in walk(ONE)] == list(PATHS)
    assert specs(ONE)["screws.port.D"] == Spec("m", "diameter", 0.1, 20.0)
    assert specs(ONE)["hull.vv"] == Spec("'", "by vv", -math.inf, math.inf)
    assert [read(ONE, path) for path in PATHS] == list(PATHS.values())
    assert (ONE.hull.get("vv"), ONE.hull.get("none"), ONE.hull.get("none", 3.0)) == (-0.3, 0.0, 3.0)


def test_a_number_is_replaced_at_its_path_and_nowhere_else() -> None:
    for path in PATHS:
        changed = update(ONE, {path: 7.0})
        assert values(changed) == PATHS | {path: 7.0}
    everything = {path: float(k) for k, path in enumerate(PATHS)}
    assert values(update(ONE, everything)) == everything
    assert values(ONE) == PATHS
    assert update(ONE, {}) is ONE
    with pytest.raises(ParameterError, match=r"no parameter 'hull.vw'; near: hull.vv"):
        update(ONE, {"L": 1.0, "hull.vw": 1.0})


def test_patterns_find_paths() -> None:
    assert match(ONE, "screws.*.D") == ["screws.port.D", "screws.starboard.D"]
    assert match(ONE, "*") == list(PATHS)
    with pytest.raises(ParameterError, match=r"no parameter 'rudder.\*'"):
        match(ONE, "rudder.*")


def test_a_wrong_name_is_told_what_is_near_by_its_whole_or_its_last_part() -> None:
    assert unknown("hull.Y_w", ["hull.Y_v", "body.m"]) == "no parameter 'hull.Y_w'; near: hull.Y_v"
    assert unknown("far.away.Y_v", ["hull.Y_v", "body.mass"], "number") == "no number 'far.away.Y_v'; near: hull.Y_v"
    assert unknown("zzz", ["hull.Y_v", "body.m"]) == "no parameter 'zzz'; known: hull.Y_v, body.m"
    many = [f"q{k}" for k in range(60)]
    assert unknown("zzz", many).count(",") == 39


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [("L", 0.99, "L is 0.99 m; it can be 1 to 500 m"), ("L", 501, "L is 501 m; it can be 1 to 500 m"),
     ("angle", 10.0, r"angle is 10 rad; it can be -0.5 to 0.5 rad (180 deg is 3.14 rad)"), ("L", 1.0, ""),
     ("L", 500.0, ""), ("L", math.nan, ""), ("other", 1e9, ""), ("L", "text", "")],
)  # fmt: skip
def test_a_number_that_cannot_be_is_told_what_can(name: str, value: Any, said: str) -> None:
    if not said:
        possible(specs(ONE), {name: value})
        return
    with pytest.raises(ParameterError) as error:
        possible(specs(ONE), {name: value})
    assert str(error.value) == said


def test_a_parameter_is_freed_within_a_share_of_its_value() -> None:
    v, r = near(ONE, "hull.*", ratio=0.5)
    assert (v.path, v.start, v.low, v.high) == ("hull.vv", -0.3, pytest.approx(-0.45), pytest.approx(-0.15))
    assert (r.low, r.high, r.scale) == (pytest.approx(0.01), pytest.approx(0.03), pytest.approx(0.005))
    assert len(near(ONE, "hull.vv", ratio=10.0)) == 1
    with pytest.raises(ParameterError, match=r"ratio is 10\.5: 10\.5 times the value either way; 10\.5 % is 0\.105"):
        near(ONE, "hull.vv", ratio=10.5)
    assert far("x", 20.0) == "x is 20: 20 times the value either way; 20 % is 0.2"
    for path, ratio in (("main.D", 0.96), ("screws.starboard.D", 4.1)):
        with pytest.raises(ParameterError, match="leaves what it can be"):
            near(ONE, path, ratio=ratio)
    with pytest.raises(ParameterError, match="no width"):
        near(update(ONE, {"hull.vv": 0.0}), "hull.vv", ratio=0.5)


def test_the_scale_of_a_search_is_sigma_else_a_quarter_of_the_interval_else_the_size() -> None:
    assert Free("a", 2.0, 0.0, 8.0, 2.0, 0.5).scale == 0.5
    assert Free("a", 2.0, 0.0, 8.0).scale == 2.0
    assert Free("a", -20.0).scale == 20.0
    assert Free("a", 0.1, low=0.0).scale == 1.0
    for wrong in ((1.0, 2.0, 2.0), (1.0, 3.0, 2.0), (3.5, 1.0, 3.0), (0.5, 1.0, 3.0)):
        with pytest.raises(ParameterError):
            Free("a", *wrong)
    assert Free("a", 1.0, 1.0, 3.0).start == 1.0
    with pytest.raises(ParameterError, match="sigma is 0"):
        Free("a", 1.0, sigma=0.0)
