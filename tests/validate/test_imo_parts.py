"""Verdicts of the standards on made-up figures and on ships whose surge is written down."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from seatrial.actuators import Actuators
from seatrial.data import Trial
from seatrial.models import Model, kinematics
from seatrial.ships import Ship
from seatrial.ships.files import load
from seatrial.validate import imo
from seatrial.validate.imo import FAIL, NOT_APPLICABLE, PASS, UNDECIDED, Band, Criterion, ImoTable

U, L = 5.0, 120.0
MEETS = "Meets every criterion that could be judged"


def sailing(surge: Any, *, validity: Any = None, notes: Any = None, length: float = L) -> Ship:
    """A ship with u' = surge(u, v, r, n) and nothing else."""

    @dataclass(frozen=True)
    class Toy(Model):
        def derivative(self, state: Any, control: Any, environment: Any) -> Any:
            _, _, psi, u, v, r = state[:6]
            return (*kinematics(psi, u, v, r), surge(u, v, r, control[0]), 0.0, 0.0)

    return Ship("toy", Toy(), Actuators(), L_pp=length, speed=U, validity=validity or {}, notes=notes or {})


@pytest.mark.parametrize(
    ("value", "unit", "over", "verdict"),
    [(4.4, "L", True, PASS), (4.5, "L", True, PASS), (4.6, "L", True, FAIL), (-0.1, "L", True, NOT_APPLICABLE),
     (-0.1, "deg", True, PASS), (0.0, "L", True, PASS), (None, "L", True, NOT_APPLICABLE), (None, "L", False, FAIL)],
)  # fmt: skip
def test_a_figure_passes_up_to_its_limit(value: float | None, unit: str, over: bool, verdict: str) -> None:
    found = imo._judged("x", "port", value, unit, 4.5, "", over)
    assert (found.verdict, found.value, found.limit, found.side, found.unit) == (verdict, value, 4.5, "port", unit)
    assert found.title == "x (port)"


@pytest.mark.parametrize(
    ("L_over_V", "limits"),
    [(9.999, (10.0, 25.0)), (10.0, (10.0, 25.0)), (22.0, (16.0, 34.0)), (29.999, (20.0, 40.0)), (30.0, (20.0, 40.0)),
     (300.0, (20.0, 40.0))],
)  # fmt: skip
def test_overshoot_limits_are_those_of_the_resolution(L_over_V: float, limits: tuple[float, float]) -> None:
    assert imo.overshoot_limits(L_over_V) == pytest.approx(limits, abs=1e-3)


@pytest.mark.parametrize(
    ("met", "verdict"),
    [(1.0, PASS), (0.975, PASS), (0.97, UNDECIDED), (0.5, UNDECIDED), (0.03, UNDECIDED), (0.025, FAIL), (0.0, FAIL)],
)
def test_draws_decide_where_their_whole_band_is_on_one_side(met: float, verdict: str) -> None:
    row = Criterion("x", "", 4.0, "L", 4.5, PASS, "as said")
    found = row.judged_by(Band(1.0, 2.0, met, 200), 0.95)
    assert found.verdict == verdict
    assert ("of the draws" in found.reason) == (0.0 < met < 1.0)
    assert found.reason.endswith("as said")
    assert row.judged_by(Band(1.0, 2.0, 0.92, 200), 0.8).verdict == PASS


@pytest.mark.parametrize(
    ("verdicts", "words"),
    [
        ((PASS, PASS), "Meets every criterion that could be judged (2)."),
        ((PASS, FAIL), "Does not meet: c1."),
        ((PASS, UNDECIDED, NOT_APPLICABLE), "Meets 1 criteria; undecided: c1; 1 of 3 criteria could not be judged."),
        ((FAIL, UNDECIDED), "Does not meet: c0; undecided: c1."),
        (
            (PASS, NOT_APPLICABLE),
            "Meets every criterion that could be judged (1); 1 of 2 criteria could not be judged.",
        ),
    ],
)
def test_the_sentence_on_the_whole_counts_what_there_is(verdicts: tuple[str, ...], words: str) -> None:
    rows = tuple(Criterion(f"c{k}", "", 1.0, "L", 2.0, one) for k, one in enumerate(verdicts))
    table = ImoTable("toy", L, U, 1.0, rows, {}, ())
    assert table.L_over_V == pytest.approx(24.0)
    assert [replace(table, L_pp=long).verdict for long in (100.0, 320.0)] == [words, words]
    assert replace(table, L_pp=99.0).verdict == f"{words} The standards hold from 100 m on; this one has 99 m."


@pytest.mark.parametrize(
    ("surge", "held"),
    [
        (lambda u, v, r, n: 0.0, True), (lambda u, v, r, n: 0.1 * n, False), (lambda u, v, r, n: 0.01 * (U - u), False),
        (lambda u, v, r, n: 1e-4 * v * r, False), (lambda u, v, r, n: 1e-12 * u, True),
    ],
)  # fmt: skip
def test_a_speed_is_held_where_nothing_changes_it(surge: Any, held: bool) -> None:
    """Not even turning: v_m = -0.3 U and r = 0.3 U/L are tried."""
    assert imo.held_speed(sailing(surge), U, 2.0) == held


@pytest.mark.parametrize(
    ("surge", "astern", "words"),
    [
        (lambda u, v, r, n: n - 0.4 * u, -2.0, ""),
        (lambda u, v, r, n: -0.1 * u, -2.0, "no propulsion"),
        (lambda u, v, r, n: max(n, 0.0) - 0.4 * u, -2.0, "no reverse thrust"),
        (lambda u, v, r, n: abs(n) - 0.4 * u, -2.0, "no reverse thrust"),
        (lambda u, v, r, n: n * n - 0.4 * u, -2.0, "no reverse thrust"),
        (lambda u, v, r, n: n - 0.4 * u, 0.0, "does not turn astern"),
    ],
)
def test_why_a_ship_cannot_be_stopped(surge: Any, astern: float, words: str) -> None:
    said = imo.no_stop(sailing(surge), U, 2.0, astern)
    assert words in said
    assert bool(said) == bool(words)


def test_a_stop_is_doubted_outside_of_what_the_file_claims() -> None:
    t = np.arange(0.0, 5.0)
    run = Trial("stop", t, {"u": 4.0 - t, "n_P": -2.0 + 0.0 * t, "v_m": 0.1 * t})
    inside = {"n_P": (-2.0, 9.0), "u": (0.0, 9.0), "v_m": (-1.0, 0.4), "r": (0.0, 0.0)}
    assert imo.unreliable_stop(sailing(None, validity=inside), -2.0, run) == ""
    for name, ends, words in (
        ("n_P", (-1.9, 9.0), "full astern"), ("u", (0.1, 9.0), "u leaves"), ("u", (0.0, 3.9), "u leaves"),
        ("v_m", (0.01, 1.0), "v_m leaves"), ("v_m", (-1.0, 0.39), "v_m leaves"),
    ):  # fmt: skip
        assert words in imo.unreliable_stop(sailing(None, validity=inside | {name: ends}), -2.0, run)


@pytest.mark.parametrize(
    ("surge", "length", "told"),
    [
        (lambda u, v, r, n: 0.01 * (n - u), 120.0, set()),
        (lambda u, v, r, n: 0.01 * (n - u), 99.0, {"100 m"}),
        (lambda u, v, r, n: 0.01 * (n - u), 100.0, set()),
        (lambda u, v, r, n: 0.01 * (n - u) + 1.9e-3 * U * U / L, 120.0, set()),
        (lambda u, v, r, n: 0.01 * (n - u) - 2.1e-3 * U * U / L, 120.0, {"not steady"}),
        (lambda u, v, r, n: 0.0, 120.0, {"holds its speed"}),
    ],
)  # fmt: skip
def test_the_table_warns_of_what_it_does_not_know(surge: Any, length: float, told: set[str]) -> None:
    ship = sailing(surge, length=length, notes={"cautions": ("mind the gap",)})
    said = "\n".join(imo._caveats(ship, U, U))
    assert {one for one in ("100 m", "not steady", "holds its speed") if one in said} == told
    assert "mind the gap" in said


@pytest.mark.slow
def test_the_table_of_a_ship_has_the_limits_of_its_own_clock() -> None:
    ship = load("mariner_nomoto")
    table = imo.imo_table(ship)
    first, second = imo.overshoot_limits(ship.L_pp / table.speed)
    limits = {row.name.partition(", rudder")[0]: row.limit for row in table.rows}
    assert limits["10/10 zigzag, first overshoot"] == first
    assert limits["10/10 zigzag, second overshoot"] == second
    assert limits["20/20 zigzag, first overshoot"] == 25.0
    assert limits["advance"] == 4.5
    assert limits["tactical diameter"] == 5.0
    assert limits["way to 10 deg of heading"] == 2.5
    assert limits["track reach, full astern"] == 15.0
    for name, index in (("10/10 zigzag, first overshoot", "first_overshoot"), ("advance, rudder 35 deg", "advance")):
        for row in (one for one in table.rows if one.name == name):
            assert row.source is not None
            figure = row.source.policy.indices(row.source.run, ship.L_pp)[index]
            scale = 180.0 / math.pi if row.unit == "deg" else 1.0 / ship.L_pp
            assert row.value == pytest.approx(scale * figure.value)
            assert row.source.run["delta"][-1] * (1.0 if row.side == "starboard" else -1.0) > 0 or "zigzag" in name
    steered = [row for row in table.rows if row.side]
    assert len(steered) == 2 * 6
    assert {row.side for row in steered} == {"starboard", "port"}
    # without the file's yaw asymmetry both sides of a linear ship are the same
    by_name: dict[str, list[float]] = {}
    for row in steered:
        by_name.setdefault(row.name, []).append(row.value or 0.0)
    model: Any = ship.model
    if not model.delta_r:
        for pair in by_name.values():
            assert pair[0] == pytest.approx(pair[1], rel=1e-6)


def test_a_long_run_is_given_up_after_480_lengths(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[float] = []

    def simulated(ship: Any, policy: Any, *, speed: float, duration: float) -> Any:
        asked.append(duration * speed / ship.L_pp)
        return Trial("run", np.array([0.0, duration]), {})

    class Endless:
        def complete(self, run: Any) -> bool:
            return False

    monkeypatch.setattr(imo, "simulate", simulated)
    endless: Any = Endless()
    run, reason, over = imo._run(sailing(None), endless, U)
    assert asked == pytest.approx([15.0, 30.0, 60.0, 120.0, 240.0, 480.0])
    assert "480 ship lengths" in reason
    assert run is not None
    assert not over


def test_relaxed_stops_are_told_between_15_and_20_lengths(monkeypatch: pytest.MonkeyPatch) -> None:
    """The track of a stop that is a straight line of a given length at an even deceleration."""
    ship = sailing(lambda u, v, r, n: 0.01 * (n - u))
    for reach, verdict, relaxed in ((14.9, PASS, False), (15.1, FAIL, True), (19.9, FAIL, True), (20.1, FAIL, False)):
        lasts = 2.0 * reach * L / U

        def ran(ship: Any, policy: Any, *, speed: float, duration: float, lasts: float = lasts) -> Trial:
            t = np.linspace(0.0, lasts, 4001)
            u = U * (1.0 - t / lasts)
            flat = dict.fromkeys(("y", "psi", "v_m", "r", "delta"), 0.0 * t)
            return Trial("stop", t, {"x": U * t - 0.5 * U * t * t / lasts, "u": u, "n_P": -2.0 + 0 * t,
                                     "n_P_cmd": -2.0 + 0 * t, "delta_cmd": 0 * t, **flat})  # fmt: skip

        monkeypatch.setattr(imo, "simulate", ran)
        row = imo._stop(ship, imo.Settings(2.0, U, L, 0.6), -2.0)
        assert row.value == pytest.approx(reach, rel=1e-3)
        assert row.verdict == verdict
        assert ("Administration" in row.reason) == relaxed
    assert replace(row, side="port").title.endswith("(port)")
