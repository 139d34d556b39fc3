"""Recordings of several manoeuvres: a zigzag and a turn with a straight course between them, and what is one."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from seatrial.data import Trial
from seatrial.data.kinds.parts import parts, separating
from seatrial.data.prepare.steps import mended
from seatrial.manoeuvres.straight import Straight
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load
from seatrial.simulate.run import simulate

DEG, N_P = math.radians(1.0), 10.4
LEGS = {
    "zigzag": (Zigzag(N_P, 20.0 * DEG, 20.0 * DEG), 100.0), "turning": (Turning(N_P, 35.0 * DEG), 150.0),
    "straight": (Straight(N_P), 60.0),
}  # fmt: skip


def _day(seed: int) -> Trial:
    """Hours on a course, the rudder at work in a sea, with three manoeuvres between; the length of the ship untold."""
    whole = _joined("straight", "zigzag", "straight", "turning", "straight", "zigzag", "straight")
    hours, random = 4000, np.random.default_rng(seed)
    straight = [0, 382, 804, 1126, len(whole)]  # rows in the middle of its straight legs, which last for hours
    rows = np.concatenate([np.r_[np.full(hours, a), np.arange(a, b)] for a, b in pairwise(straight)])
    channels = {name: whole[name][rows] for name in ("psi", "u", "v_m", "r", "delta", "n_P")}
    t = 0.5 * np.arange(rows.size)
    helm = 2.0 * DEG * np.sin(t / 4.0) * (np.diff(rows, prepend=-1) == 0)
    channels["delta"] = channels["delta"] + helm + 0.1 * DEG * random.standard_normal(t.size)
    return Trial("day", t, channels, meta={})


def _joined(*names: str, start: str = "") -> Trial:
    """Runs one after the other: each begins in the place and on the heading where the one before ended."""
    ship, t, rows = load("kvlcc2_l7"), np.zeros(0), dict[str, list[np.ndarray]]()
    for name in names:
        policy, duration = LEGS[name]
        run = simulate(ship, policy, duration=duration, dt=0.5)
        x, y, psi = (rows[n][-1][-1] if t.size else 0.0 for n in ("x", "y", "psi")) if rows else (0.0, 0.0, 0.0)
        c, s = math.cos(psi), math.sin(psi)
        moved = {"x": x + c * run["x"] - s * run["y"], "y": y + s * run["x"] + c * run["y"], "psi": psi + run["psi"]}
        for channel in ("x", "y", "psi", "u", "v_m", "r", "delta", "n_P"):
            rows.setdefault(channel, []).append(moved.get(channel, run[channel]))
        t = np.append(t, run.t + (t[-1] + 0.5 if t.size else 0.0))
    meta = {"L_pp": 7.0, **({"start": start} if start else {})}
    return Trial("log", t, {name: np.concatenate(some) for name, some in rows.items()}, meta=meta)


@pytest.mark.slow
def test_two_manoeuvres_are_told_with_their_times_and_separated_by_mend() -> None:
    log = _joined("straight", "zigzag", "straight", "turning", start="2024-05-01T10:00:00+00:00")
    first, second = found = parts(log)
    assert (first.kind.name, second.kind.name) == ("zigzag", "turning")
    assert first.start == log.t[0]
    assert 160.0 < first.stop < 185.0
    assert 195.0 < second.start < 221.5
    assert second.stop == log.t[-1]
    minutes = [int(part) for one in first.when(log).split(" to ") for part in one.split(":")[:2]]
    assert minutes == [10, 0, 10, 2]
    made = mended(log, [separating(log, found)])
    assert [one.name for one in made] == ["log_1", "log_2"]
    for one, part in zip(made, found, strict=True):
        assert (one.t[0], one.t[-1]) == (part.start, part.stop)


@pytest.mark.slow
def test_manoeuvres_of_a_day_are_cut_out_of_its_transits() -> None:
    log = _day(seed=1)
    found = parts(log)
    assert [one.kind.name for one in found] == ["zigzag", "pull-out", "zigzag"]  # the turn ends on a course
    inside = np.zeros(len(log), dtype=bool)
    for one in found:
        inside |= (log.t >= one.start) & (log.t <= one.stop)
    assert inside[np.abs(log["delta"]) > 10.0 * DEG].all()  # nothing of them is lost
    manoeuvring = 0.5 * (201 + 301 + 201) / log.duration
    assert inside.mean() < 2.0 * manoeuvring  # and the transits are, but for what leads in and out
    made = mended(log, [separating(log, found)])
    assert [len(part) for part in made] == [
        np.count_nonzero((log.t >= one.start) & (log.t <= one.stop)) for one in found
    ]


@pytest.mark.slow
def test_a_transit_with_one_manoeuvre_is_cut_and_one_without_any_is_not() -> None:
    log = _day(seed=2)
    [first, *_] = parts(log)
    alone = log.rows(log.t < first.stop + 1500.0)
    [again] = parts(alone)
    assert again.kind == first.kind
    assert again.start == pytest.approx(first.start, abs=30.0)  # a few lengths: its turns are the only measure of one
    assert parts(log.rows(log.t < first.start - 60.0)) == ()


@pytest.mark.slow
@pytest.mark.parametrize("names", [("zigzag",), ("turning",), ("straight", "zigzag"), ("turning", "straight")])
def test_one_manoeuvre_stays_whole(names: tuple[str, ...]) -> None:
    assert parts(_joined(*names)) == ()


@pytest.mark.slow
def test_the_times_of_parts_are_those_of_a_clock_that_began_before() -> None:
    log = _joined("zigzag", "straight", "zigzag")
    later = replace(log, t=log.t + 1444.0)
    assert [(one.kind, one.start - 1444.0, one.stop - 1444.0) for one in parts(later)] == [
        (one.kind, one.start, one.stop) for one in parts(log)
    ]


@pytest.mark.slow
def test_without_a_start_times_are_those_of_the_recording() -> None:
    log = _joined("zigzag", "straight", "zigzag")
    first, _ = parts(log)
    assert first.when(log) == f"0 to {first.stop:.0f} s"
