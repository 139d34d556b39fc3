"""Judgements on logs at the edge of each bound, and readers of SIMMAN's files on files written here."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seatrial.data import Array, DataError, Trial
from seatrial.data.check.controls.rudder import _orders
from seatrial.data.check.rows.outliers import _elsewhere
from seatrial.data.check.track import fixes, own_samples, track_miss
from seatrial.data.formats.simman import MARIN_STEP, read
from seatrial.data.geodesy import Datum
from seatrial.data.guess.logs import _longest, leap
from seatrial.data.guess.motion import TIMES
from seatrial.data.kinds.signals import Signals, signals
from seatrial.data.kinds.speed import backwards
from seatrial.data.mapping.places import Midship
from seatrial.data.mapping.reading import _clock
from seatrial.data.nmea.ship import Fittings
from seatrial.data.prepare.cutting import segments

DEGREE = np.pi / 180.0


def marin(path: Path, step: float, rows: int = 1200) -> Path:
    """Full scale, straight at 3 m/s over ground on a course of 30 deg, written as MARIN does: times to three digits."""
    t = step * np.arange(rows)
    each = [t, 3.0 * np.cos(0.5) * t, 3.0 * np.sin(0.5) * t, 2.0, 30.0, 3.0 * np.cos(0.5), 3.0 * np.sin(0.5), 0.5, -1.5,
            12.0, 84.0]  # fmt: skip
    table = np.column_stack([np.broadcast_to(one, rows) for one in each])
    head = ["MARIN", "Zigzag test 20 / -10", "columns"]
    path.write_text("\n".join([*head, *("\t".join(f"{v:.3g}" if k == 0 else f"{v:.6f}" for k, v in enumerate(row))
                                        for row in table)]))  # fmt: skip
    return path


@pytest.mark.slow
def test_rounded_times_of_marin_give_the_step_back_and_its_signs_are_turned(tmp_path: Path) -> None:
    found = read(marin(tmp_path / "a.dat", 0.1351))
    assert np.diff(found.t) == pytest.approx(0.1351, rel=2e-4)  # three digits of the largest time are half a second
    assert found["x"][-1] == pytest.approx(3.0 * np.cos(0.5) * found.t[-1], rel=1e-6)
    assert found["y"][-1] == pytest.approx(3.0 * np.sin(0.5) * found.t[-1], rel=1e-6)
    ahead = 3.0 * np.cos(0.5 - 30.0 * DEGREE), 3.0 * np.sin(0.5 - 30.0 * DEGREE)
    assert (found["u"][5], found["v_m"][5]) == pytest.approx(ahead, abs=1e-6)
    assert (found["delta"][0], found["n_P"][0]) == pytest.approx((-12.0 * DEGREE, 1.4))
    assert (found["phi"][0], found["p"][0], found["r"][0]) == pytest.approx((2 * DEGREE, 0.5 * DEGREE, -1.5 * DEGREE))
    assert found.meta["set_points"] == pytest.approx({"rudder": 20 * DEGREE, "heading": 10 * DEGREE})
    assert (found.meta["ship"], found.meta["L_pp"], found.meta["water_density"]) == ("kvlcc2", 320.0, 1025.0)


@pytest.mark.parametrize(("step", "good"), [(0.92, True), (1.08, True), (0.88, False), (1.12, False)])
def test_a_step_that_is_not_that_of_marin_is_refused(step: float, good: bool, tmp_path: Path) -> None:
    path = marin(tmp_path / "a.dat", step * MARIN_STEP, 60)
    if good:
        assert len(read(path)) == 60
        return
    with pytest.raises(DataError, match="mean step"):
        read(path)


def test_columns_of_hsva_are_turned_and_its_title_tells_the_zigzag(tmp_path: Path) -> None:
    rows = ["0 0 0 90 0 1.1 2 0 10 9 50 3", "0.1 0 0.11 90 0 1.1 2 0 10 9 50 3", "0.2 0 0.22 90 0 1.1 2 0 10 9 50 3"]
    (tmp_path / "b.dat").write_text("\n".join(["HSVA", "model", "KVLCC2 Z_20/10", "head", *rows]))
    found = read(tmp_path / "b.dat")
    assert found.t.tolist() == [0.0, 0.1, 0.2]
    assert (found["u"][0], found["v_m"][0]) == pytest.approx((1.1, 0.0), abs=1e-12)
    assert (found["delta"][0], found["r"][0]) == pytest.approx((-10 * DEGREE, 2 * DEGREE))
    assert (found["n_P"][0], found["thrust"][0], found["torque"][0]) == (9.0, 50.0, 3.0)
    assert found.meta["set_points"] == pytest.approx({"rudder": 20 * DEGREE, "heading": 10 * DEGREE})
    assert (found.meta["scale"], found.meta["L_pp"]) == (45.714, 7.0)


def test_runs_of_just_the_least_duration_are_kept() -> None:
    t, r = np.arange(30.0), np.zeros(30)
    r[[10, 16]] = np.nan
    cut = segments(Trial("a", t, {"r": r}), min_duration=9.0)  # 9, 4 and 12 s long
    assert [(one.t[0], one.t[-1]) for one in cut] == [(0.0, 9.0), (17.0, 29.0)]
    assert [one.t[0] for one in segments(Trial("a", t, {"r": r}), min_duration=9.01)] == [17.0]
    assert len(segments(Trial("a", t, {"r": r}))) == 3


def helm(sizes: list[float], dt: float = 0.5, length: float = 150.0) -> Trial:
    """A rudder that leaps by so many degrees, one way or the other, each time within one row."""
    delta = np.concatenate([[0.0] * 4, *[[sum(sizes[: k + 1])] * 4 for k in range(len(sizes))]]) * DEGREE
    return Trial("a", dt * np.arange(delta.size), {"delta": delta}, meta={"L_pp": length})


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_three_leaps_to_either_side_are_orders_and_two_are_none(side: float) -> None:
    leaps = [side * 7.0] * 3
    (fault,) = list(_orders([helm(leaps)]))
    assert "3 leaps, up to 14 deg/s" in fault.evidence
    assert not list(_orders([helm(leaps[:2])]))
    assert not list(_orders([helm([side * 5.9] * 3)]))
    assert not list(_orders([helm(leaps, dt=0.9)]))  # 7.8 deg/s: there are such steering gears
    assert list(_orders([helm(leaps, dt=0.85)]))  # 8.2 deg/s
    assert not list(_orders([helm(leaps, length=19.0)]))  # the servo of a model
    assert list(_orders([helm(leaps, length=21.0)]))
    assert list(_orders([helm(leaps[:2]), helm(leaps[:1])]))  # over all trials


def sideways(share: float, turn: float, side: float = 1.0) -> Signals:
    """Moves aside for a share of its way, and turns by so many degrees meanwhile."""
    t = np.arange(200.0)
    aside = t < 200.0 * share
    u, v = np.where(aside, 0.1, 1.0), side * np.where(aside, 1.0, 0.1)
    psi = np.linspace(0.0, turn * DEGREE, 200)
    return Signals(t, psi, np.gradient(psi, t), u, v, None, None, None, 50.0, 50.0)


def test_a_ship_goes_sideways_for_most_of_its_way_and_without_turning_round() -> None:
    found = backwards(sideways(0.65, 80.0, -1.0))
    assert found is not None
    assert (found.name, found.settings["side"]) == ("sideways", -1.0)
    assert backwards(sideways(0.55, 80.0)) is None
    assert backwards(sideways(0.65, 100.0)) is None
    assert backwards(sideways(0.65, -100.0)) is None
    still = sideways(0.65, 0.0)
    back = replace(still, u=np.where(still.t < 130.0, -1.0, 1.0), v_m=np.zeros(200))
    assert (backwards(back) or SimpleNamespace(name="")).name == "astern"
    less = replace(still, u=np.where(still.t < 110.0, -1.0, 1.0), v_m=np.zeros(200))
    assert backwards(less) is None


@pytest.mark.parametrize(("gone", "said"), [(0.18, False), (0.22, True)])
def test_a_channel_that_is_missing_in_more_than_a_fifth_of_the_rows_is_a_doubt(gone: float, said: bool) -> None:
    t = np.arange(100.0)
    delta = np.where(t < 100.0 * gone, np.nan, 0.1)
    found = signals(Trial("a", t, {"psi": 0.01 * t, "u": np.ones(100), "v_m": np.zeros(100), "delta": delta}))
    assert isinstance(found, Signals)
    assert any(one.startswith("delta is missing") for one in found.doubts) == said


def walk(psi: Array, exchanged: bool, far: float = 1.0, n: int = 200) -> Midship:
    """A ship at 4 m/s by heading and log; its fixes as they are, or with north and east exchanged."""
    t = np.arange(float(n))
    north, east = np.cumsum(4.0 * np.cos(psi)), np.cumsum(4.0 * np.sin(psi))
    x, y = (east, north) if exchanged else (north, east)
    return Midship(t, {"psi": psi, "u": 4.0 * np.ones(n), "v_m": np.zeros(n), "x": far * x, "y": far * y})


def test_latitude_and_longitude_are_called_exchanged_where_that_makes_the_track_fit() -> None:
    here, turn = Datum(0.0, 0.0), np.linspace(0.0, 3.0, 200)
    assert walk(turn, True).exchanged(here)
    assert not walk(turn, False).exchanged(here)
    assert not walk(turn, True, 3.0).exchanged(here)  # exchanged, it fits no better
    # nearly north-east the exchange makes a small difference, whatever the size of the way
    assert not walk(np.full(200, 50.0 * DEGREE), True).exchanged(here)
    assert not walk(turn[:12], True, n=12).exchanged(here)
    assert not walk(turn[:19], True, n=19).exchanged(here)  # 19 rows are too few
    short = walk(np.linspace(0.0, 3.0, 21), True, n=21)
    assert short.exchanged(here)  # 80 m of way
    short.channels["u"] = 0.5 * short.channels["u"]
    short.channels["x"], short.channels["y"] = 0.5 * short.channels["x"], 0.5 * short.channels["y"]
    assert not short.exchanged(here)  # 40 m
    assert not walk(turn, True).exchanged(Datum(0.0, 89.5))


def test_a_file_has_the_clock_that_is_named_for_it() -> None:
    def mapping(files: object) -> Any:
        return SimpleNamespace(time="own", files=files)

    several = mapping(SimpleNamespace(clocks={"a.csv": "of a"}))
    assert _clock(several, "a.csv") == "of a"
    assert _clock(several, "b.csv") == "own"
    assert _clock(several, None) == "own"
    assert _clock(mapping(None), "a.csv") == "own"


@pytest.mark.parametrize("order", [(60, 200, 90), (200, 60, 90), (60, 90, 200)])
def test_the_longest_trial_of_a_file_is_where_it_is(order: tuple[int, int, int]) -> None:
    t = np.concatenate([5000.0 * k + np.arange(float(n)) for k, n in enumerate(order)])
    first = sum(order[: order.index(200)])
    assert _longest([], t) == slice(first, first + 200)
    gap = leap(t)
    assert gap is not None
    assert 60.0 < gap < 4700.0
    assert _longest([], np.arange(350.0)) == slice(None)


def test_units_of_time_are_seconds_times_their_size() -> None:
    assert pytest.approx({"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0}) == TIMES


def test_a_control_is_elsewhere_beyond_its_own_span_on_either_side() -> None:
    rest = np.linspace(2.0, 5.0, 7)
    for value, out in ((-0.9, False), (-1.1, True), (7.9, False), (8.1, True), (3.3, False)):
        assert _elsewhere(np.append(rest, value), value) == out


def test_only_a_new_position_is_a_fix_and_repeated_readings_are_gaps() -> None:
    t = np.arange(12.0)
    k = np.floor(t / 3.0)
    log = Trial("a", t, {"x": 2.0 * k, "y": 0.0 * t, "psi": np.where(t == 4.0, 0.7, 0.1 * k), "U_G": np.ones(12)})
    assert fixes(log).tolist() == [0, 3, 6, 9]
    own = own_samples(log)
    assert np.isfinite(own["psi"]).nonzero()[0].tolist() == [0, 3, 4, 5, 6, 9]  # it moved at 4 and back at 5
    assert np.isfinite(own["U_G"]).nonzero()[0].tolist() == [0, 3, 6, 9]
    assert np.isfinite(own["x"]).nonzero()[0].tolist() == [0, 3, 6, 9]


def test_the_direction_of_the_track_counts_where_the_ship_moves_at_three_tenths_of_its_top_speed() -> None:
    """A slow leg with a wrong course: above .3 of the top speed it counts, below not."""
    for slow, counts in ((0.35, True), (0.25, False)):
        speed = np.where(np.arange(100) < 50, 1.0, slow)
        x = np.cumsum(speed)
        log = Trial("a", np.arange(100.0), {"x": x, "y": np.zeros(100), "gamma_G": np.where(speed < 1.0, 0.5, 0.0)})
        assert (track_miss(log, "gamma_G") > 0.2) == counts
    sharp = np.cumsum(np.where(np.arange(41) < 20, 1.0, -1.0))
    corner = Trial("a", np.arange(41.0), {"x": sharp, "y": np.zeros(41), "gamma_G": np.zeros(41)})
    # displacements over two fixes either way: 37 of them, of which 17 lie behind the turn but for those across it
    course = np.array([np.arctan2(0.0, sharp[k + 2] - sharp[k - 2]) for k in range(2, 39)])
    far = np.array([abs(sharp[k + 2] - sharp[k - 2]) / 4.0 > 0.3 for k in range(2, 39)])
    wanted = np.sqrt(np.mean(((-course[far] + np.pi) % (2.0 * np.pi) - np.pi) ** 2))
    assert track_miss(corner, "gamma_G") == pytest.approx(wanted)


def test_a_ship_of_which_nothing_is_said_has_no_size_and_stands_at_its_antenna() -> None:
    plain = Fittings()
    assert (plain.length, plain.breadth, plain.draught, plain.log, plain.stern, plain.transducer) == (0.0,) * 6
    assert (plain.antenna, plain.rudders, plain.shafts) == ((0.0, 0.0), ("delta",), ("n_P",))
    assert (plain.mode, replace(plain, simulator=True).mode) == ("A", "S")
