"""Logs whose lines are not one instrument each time it spoke: copies, devices under one name, late and bare clocks."""

from __future__ import annotations

import math
import os
from pathlib import Path

import numpy as np
import pytest
from circling import RATE, SECONDS, clock, course, fix, gga, hdt, log, place, rmc, signed, true

from seatrial.data.formats.nmea import read, read_mapping
from seatrial.data.nmea.copies import apart
from seatrial.data.nmea.heard import hear
from seatrial.data.nmea.readings import readings

LONG = [float(k) for k in range(120)]
RUDDERS = ["$IIRSA,5.0,A,,V", "$IIRSA,5.5,A,,V"]


@pytest.mark.parametrize("seed", range(3))
def test_lines_that_some_are_logged_twice_of_are_told_once(tmp_path: Path, seed: int) -> None:
    """A third of the lines stand twice, as they happen to; a rudder that is held repeats itself truly."""
    rng = np.random.default_rng(seed)
    told = [line for t in LONG for line in (rmc(t), hdt(t), hdt(t + 0.5), RUDDERS[int(t) // 60])]
    (tmp_path / "once").write_text("\n".join(told))
    (tmp_path / "some").write_text("\n".join(line for one in told for line in [one] * (1 + (rng.random() < 0.3))))
    one, some = read(tmp_path / "once"), read(tmp_path / "some")
    assert np.array_equal(one.t, some.t)
    for name in one.channels:
        assert np.array_equal(one[name], some[name], equal_nan=True), name
    assert any("logged twice in a row" in step for step in some.meta["processing"])


def test_headings_of_a_ship_at_rest_are_no_copies(tmp_path: Path) -> None:
    """Fixes that are told once leave headings alone which are all alike, and stand in a row."""
    (tmp_path / "rest").write_text("\n".join(line for t in LONG for line in (rmc(t), *["$HEHDT,90.0,T"] * 4)))
    assert len(read(tmp_path / "rest")) == 480


def _turns(t: float, off: float) -> list[str]:
    return [rmc(t), hdt(t), hdt(t, off=off)]


@pytest.mark.parametrize("off", [2.0, -0.6])
def test_two_gyros_of_one_name_are_two_sources(tmp_path: Path, off: float) -> None:
    path = tmp_path / "gyros"
    path.write_text("\n".join(line for t in LONG for line in _turns(t, off)))
    trial = read(path)
    psi = np.rad2deg((trial["psi"] - RATE * trial.t + 1.0) % math.tau - 1.0)
    assert np.ptp(psi) < 0.01
    assert float(np.mean(psi)) == pytest.approx(0.0, abs=0.01) or float(np.mean(psi)) == pytest.approx(off, abs=0.01)
    assert (
        f"differs by {off if psi[0] < 0.1 * off or abs(psi[0]) < 0.01 else -off:+.2g} deg"
        in (trial.meta["sources"]["heading"])
    )
    assert any("doubt: two instruments speak as HEHDT" in step for step in trial.meta["processing"])


@pytest.mark.parametrize("lead", ["1", "2"])
def test_one_of_two_gyros_of_one_name_can_be_preferred(tmp_path: Path, lead: str) -> None:
    path, mapping = tmp_path / "gyros", tmp_path / "m.toml"
    path.write_text("\n".join(line for t in LONG for line in _turns(t, 2.0)))
    mapping.write_text(f'schema = "seatrial-nmea/1"\nprefer = {{ heading = "{lead}/HEHDT" }}\n')
    trial = read(path, read_mapping(mapping))
    off = float(np.rad2deg(np.mean(trial["psi"] - RATE * trial.t)))
    assert off == pytest.approx(0.0 if lead == "1" else 2.0, abs=0.01)


def test_one_noisy_gyro_stays_one(tmp_path: Path) -> None:
    """Noise is as large where every other reading is left out."""
    rng = np.random.default_rng(0)
    trial = log(tmp_path, (rmc, lambda t: hdt(t, off=float(rng.normal(0.0, 0.5)))), LONG)
    assert trial.meta["sources"]["heading"].startswith("HEHDT,")
    assert not any("instruments" in step for step in trial.meta["processing"])


@pytest.mark.parametrize("lost", [(), (20, 47, 61)])
def test_two_receivers_of_one_name_are_two_sources(tmp_path: Path, lost: tuple[int, ...]) -> None:
    """Their fixes are 22 m apart and 0.4 s; some of the second are lost, so that the turns change."""
    lines = [line for k, t in enumerate(LONG) for line in
             (gga(t), hdt(t), *([] if k in lost else [gga(t + 0.4, north=22.0)]))]  # fmt: skip
    (tmp_path / "two").write_text("\n".join(lines))
    trial = read(tmp_path / "two")
    true(trial)
    assert "2/GPGGA left aside, 22 m away" in trial.meta["sources"]["position"]
    (said,) = (step for step in trial.meta["processing"] if "speak as GPGGA" in step)
    assert float(said.partition("turns and ")[2].partition(" m")[0]) == pytest.approx(22.0, abs=0.5)


def test_a_clock_that_repeats_old_fixes_is_not_that_of_the_log(tmp_path: Path) -> None:
    """A repeater tells the fix of 0.7 s ago with its time; headings lie where the receiver's clock says."""
    trial = log(tmp_path, (lambda t: rmc(t, "GN"), lambda t: rmc(t - 0.7, "II"), hdt), LONG)
    true(trial)
    assert any("by the clock in GNRMC" in step for step in trial.meta["processing"])


@pytest.mark.parametrize("said", [True, False])
def test_what_is_told_before_the_first_fix_keeps_its_pace(tmp_path: Path, said: bool) -> None:
    """For 20 s the receiver has no fix, and its clock or nothing; the headings of that time lie in 20 s."""
    void = lambda t: signed(f"GPRMC,{clock(t)},V,,,,,,,010526,,,N")  # noqa: E731
    lines = [line for t in LONG for line in ((rmc(t),) if t >= 20 else (void(t),) * said) + (hdt(t), hdt(t + 0.5))]
    (tmp_path / "late").write_text("\n".join(lines))
    trial = read(tmp_path / "late")
    assert trial.t[-1] == pytest.approx(119.5, abs=0.6)
    assert np.rad2deg(trial["psi"] - trial["psi"][0]) == pytest.approx(np.rad2deg(RATE * trial.t), abs=0.3)
    assert np.rad2deg(trial["r"][2:-2]) == pytest.approx(np.rad2deg(RATE), abs=0.02)


@pytest.mark.parametrize(("unit", "word"), [(1e3, "milliseconds"), (1e6, "microseconds"), (1.0, "seconds")])
@pytest.mark.parametrize("fixed", [True, False])
def test_a_counter_of_the_logger_is_in_the_unit_that_instruments_have(
    tmp_path: Path, unit: float, word: str, fixed: bool
) -> None:
    turn = lambda t: signed(f"HEROT,{60 * math.degrees(RATE):.2f},A")  # noqa: E731
    trial = log(tmp_path, (rmc, hdt) if fixed else (hdt, turn), SECONDS, stamp=lambda t: f"{unit * (t + 7):.0f} ")
    assert trial.t == pytest.approx(SECONDS)
    assert np.rad2deg(trial["psi"] - trial["psi"][0]) == pytest.approx(np.rad2deg(RATE * trial.t), abs=0.01)
    assert f"stamps of lines: {word}" in trial.meta["processing"]


@pytest.mark.parametrize(("written", "doubted"), [("2026-05-03", True), ("2007-01-01", False)])
def test_a_date_that_is_1024_weeks_older_than_the_file_is_a_doubt(tmp_path: Path, written: str, doubted: bool) -> None:
    path = tmp_path / "old"
    path.write_text("\n".join(line for t in SECONDS for line in (
        signed(rmc(t)[1:].partition("*")[0].replace("010526", "160906")), hdt(t))))  # fmt: skip
    at = float(np.datetime64(written, "s").astype(np.int64))
    os.utime(path, (at, at))
    told = [step for step in read(path).meta["processing"] if step.startswith("doubt: the date is 2006-09-16")]
    assert bool(told) == doubted
    assert all("on 2026-05-02" in one for one in told)


def test_a_log_whose_stamps_alone_have_a_date_is_as_old_as_these(tmp_path: Path) -> None:
    """Headings and rates without a receiver, of this year by the logger: time 0 of such a log is 1970."""
    turn = lambda t: signed(f"HEROT,{60 * math.degrees(RATE):.2f},A")  # noqa: E731
    trial = log(tmp_path, (hdt, turn), SECONDS, stamp=lambda t: f"2026-05-01T10:00:{t:06.3f}Z ")
    assert trial.meta["start"] == "2026-05-01T10:00:00.000000+00:00"
    assert not any("weeks of GPS" in step for step in trial.meta["processing"])


@pytest.mark.parametrize(
    ("groups", "port", "starboard"),
    [
        ("A,5.0,D,RUDDER_P,A,7.0,D,RUDDER_S", 5.0, 7.0), ("A,7.0,D,RUDDER STBD,A,5.0,D,PORT RUDDER", 5.0, 7.0),
        ("A,5.0,D,RUDDER#0,A,7.0,D,RUDDER#1", 5.0, 7.0), ("A,7.0,D,RUDDER", None, 7.0),
        ("A,5.0,D,RUDDERPORT", 5.0, None), ("A,5.0,D,RUDDER_PS", 5.0, None),
    ],
)  # fmt: skip
def test_rudders_of_transducers_have_their_sides(groups: str, port: float | None, starboard: float | None) -> None:
    found = readings(hear(signed(f"YXXDR,{groups}").encode()))
    right = {"delta_port": port, "delta": starboard}
    assert found == pytest.approx({name: math.radians(one) for name, one in right.items() if one is not None})


def test_the_first_of_two_transducers_of_one_angle_counts() -> None:
    found = readings(hear(signed("YXXDR,A,3.0,D,ROLL,A,-9.0,D,HEEL").encode()))
    assert found == pytest.approx({"phi": math.radians(3.0)})


def _series(t: np.ndarray, **values: np.ndarray) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    return {name: (t, one) for name, one in values.items()}


@pytest.mark.parametrize("jitter", [0.0, 0.02])
def test_readings_with_times_are_taken_apart_with_what_is_told_beside(jitter: float) -> None:
    """Two units of one name, 3 deg apart, also over north; a rate that is told with the heading stays with it."""
    rng = np.random.default_rng(1)
    t = np.arange(100) * 0.5 + rng.uniform(-jitter, jitter, 100)
    second = np.arange(100) % 2 == 1
    psi = np.mod(6.2 + 0.01 * t + np.where(second, math.radians(3.0), 0.0), math.tau)
    u = np.arange(30.0), np.full(30, 5.0)
    told, said = apart({"7/imu": {**_series(t, psi=psi, r=np.where(second, 0.02, 0.01)), "u_log_water": u}})
    assert list(told) == ["1/7/imu", "2/7/imu", "7/imu"]
    for k, source in enumerate(list(told)[:2]):
        times, values = told[source]["psi"]
        assert np.array_equal(times, t[second == bool(k)])
        assert np.mod(values - 6.2 - 0.01 * times - k * math.radians(3.0) + 1.0, math.tau) == pytest.approx(1.0)
        assert np.array_equal(told[source]["r"][1], np.full(50, 0.01 * (k + 1)))
    assert told["7/imu"]["u_log_water"] is u
    assert "speak as 7/imu, in turns and 3 deg apart" in said[0]


def test_a_yaw_that_is_as_quick_as_its_readings_is_one() -> None:
    """A boat that yaws by 2 deg at random from reading to reading, and places without a longitude beside them."""
    t, rng = np.arange(300.0), np.random.default_rng(2)
    told = {"a": _series(t, psi=rng.normal(0.0, math.radians(2.0), 300)), "b": _series(t, latitude=59.0 + 1e-6 * t),
            "c": _series(t[:12], psi=np.where(t[:12] % 2, 0.1, 0.0))}  # fmt: skip
    assert apart(told) == (told, [])


@pytest.mark.parametrize("rates", [(0.5, 1.0), (0.2, 1.0), (1.0, 1.0)])
@pytest.mark.parametrize("seed", range(3))
def test_two_gyros_of_any_rates_in_any_order_are_told(tmp_path: Path, rates: tuple[float, float], seed: int) -> None:
    """Each writes when it happens to, within its interval: sometimes one of them twice before the other."""
    rng = np.random.default_rng(seed)
    said = [(t, rmc(t)) for t in LONG]
    for rate, off in zip(rates, (0.0, 2.0), strict=True):
        said += [(t + rng.uniform(0.05, 0.9) * rate, hdt(t, off=off)) for t in np.arange(0.0, 119.0, rate).tolist()]
    (tmp_path / "mixed").write_text("\n".join(line for _, line in sorted(said)))
    told = [step for step in read(tmp_path / "mixed").meta["processing"] if "two instruments speak as HEHDT" in step]
    assert len(told) == 1
    assert float(told[0].partition("turns and ")[2].partition(" deg")[0]) == pytest.approx(2.0, abs=0.5)


def test_of_two_sources_of_one_rank_the_finer_is_taken(tmp_path: Path) -> None:
    """Whole degrees by the repeater, tenths by the gyro, as often."""
    whole = lambda t: signed(f"HEHDT,{round(course(t)) % 360},T")  # noqa: E731
    fine = lambda t: signed(f"HETHS,{course(t):.1f},A")  # noqa: E731
    assert log(tmp_path, (rmc, whole, fine), LONG).meta["sources"]["heading"].startswith("HETHS")


def test_shafts_that_two_talkers_tell_otherwise_are_compared(tmp_path: Path) -> None:
    turns = [lambda t, a=a: signed(f"{a[0]}RPM,S,1,{a[1] + 0.01 * t:.2f},,A") for a in (("II", 120.0), ("ER", 135.0))]
    said = log(tmp_path, (rmc, hdt, *turns), SECONDS).meta["sources"]
    assert any("differs by -15 rpm" in one or "differs by +15 rpm" in one for one in said.values())


def test_a_fix_at_nought_before_the_first_is_none(tmp_path: Path) -> None:
    none = lambda t: signed(f"GPGGA,{clock(t)},0000.00000,N,00000.00000,E,1,00,99.9,0.0,M,0.0,M,,")  # noqa: E731
    trial = log(tmp_path, (lambda t: none(t) if t < 20 else gga(t), hdt), SECONDS)
    assert np.isnan(trial["x"][:20]).all()
    assert np.isfinite(trial["x"][20:]).all()
    assert np.ptp(trial["x"][20:]) < 1000.0
    assert any("20 fixes at 0 N, 0 E are none" in step for step in trial.meta["processing"])


def test_the_rate_by_headings_is_there_where_they_are_fewer_than_the_rows(tmp_path: Path) -> None:
    lines = [line for k in range(300) for line in (rmc(0.2 * k), *([hdt(0.2 * k)] if k % 5 == 0 else []))]
    (tmp_path / "few").write_text("\n".join(lines))
    trial = read(tmp_path / "few")
    assert len(trial) == 300
    assert np.isfinite(trial["r"]).sum() == np.isfinite(trial["psi"]).sum() >= 60
    assert np.rad2deg(trial["r"][np.isfinite(trial["r"])]) == pytest.approx(0.5, abs=0.01)


def test_the_circle_is_one() -> None:
    """The helper's own sentences, by an independent point: a quarter of the circle is a radius ahead and aside."""
    assert place(math.tau / 4 / RATE) == pytest.approx((5.0 / RATE, 5.0 / RATE))
    assert course(180.0) == pytest.approx(90.0)
    assert fix(0.0) == "5900.00000,N,01000.00000,E"
