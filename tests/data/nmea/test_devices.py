"""Logs as devices write them, against the motion that they were made from: a circle at 5 m/s, 0.5 deg/s."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest
from circling import (
    KNOT,
    SECONDS,
    SPEED,
    Say,
    clock,
    course,
    gga,
    gll,
    hdt,
    log,
    place,
    rmc,
    signed,
    true,
)
from hypothesis import given, settings
from hypothesis import strategies as some

from seatrial.data import DataError
from seatrial.data.formats import logs
from seatrial.data.formats.nmea import read, read_all, read_mapping
from seatrial.data.geodesy import Datum
from seatrial.data.nmea.heard import hear, pieces
from seatrial.data.nmea.readings import readings
from seatrial.data.nmea.sentences import NmeaError
from seatrial.realtime.twin.sources import Ear


@pytest.mark.parametrize("says", [(rmc, gga, hdt), (gga, gll, rmc, hdt), (gll, hdt), (gga, hdt), (hdt, rmc, gga)],
                         ids=["rmc gga", "gga gll rmc", "gll", "gga", "heading first"])  # fmt: skip
def test_a_fix_that_several_sentences_tell_is_one(tmp_path: Path, says: Sequence[Say]) -> None:
    trial = log(tmp_path, says, SECONDS)
    assert len(trial) == 60
    true(trial)


def test_two_rates_of_one_receiver(tmp_path: Path) -> None:
    """Five RMC a second, one GGA: every fix where it was, none twice."""
    times = [0.2 * k for k in range(200)]
    both = lambda t: rmc(t) + ("\r\n" + gga(t) if abs(t - round(t)) < 1e-6 else "")  # noqa: E731
    trial = log(tmp_path, (both, hdt), times)
    assert len(trial) == 200
    true(trial)


@pytest.mark.parametrize(
    ("sentence", "said"),
    [
        ("HCHDG,{m:.3f},3.0,W,10.0,E", "HCHDG"), ("HCHDM,{n:.3f},M", "HCHDM"), ("IIVHW,{t:.3f},T,,M,9.7,N,,K", "IIVHW"),
        ("PASHR,{c},{t:.3f},T,1.0,-0.4,0.1,.02,.02,.05,2,1", "PASHR"), ("PSXN,23,1.0,-0.4,{t:.3f},0.1", "PSXN"),
        ("PRDID,-0.4,1.0,{t:.3f}", "PRDID"), ("PSSN,HRP,{c},010526,{t:.3f},1.0,-0.4,.1,.1,.1,12,2,3.0,E", "PSSN"),
        ("INTHS,{t:.3f},A", "INTHS"), ("PTNL,AVR,{c},{t:.3f},Yaw,0.4,Tilt,,,1.0,3,1.0,12", "PTNL"),
        ("PSAT,HPR,{c},{t:.3f},-0.4,1.0,N", "PSAT"),
    ],
    ids=lambda one: one[:9],
)  # fmt: skip
def test_headings_of_every_kind_are_true_ones(tmp_path: Path, sentence: str, said: str) -> None:
    """A compass 3 deg W of its deviation, 10 E of variation: true = sensor - 3 + 10."""

    def say(t: float) -> str:
        true = course(t)
        return signed(sentence.format(t=true, m=(true - 7.0) % 360, n=(true - 10.0) % 360, c=clock(t)))

    trial = log(tmp_path, (lambda t: rmc(t, variation="10.0,E"), say), SECONDS)
    true(trial)
    assert trial.meta["sources"]["heading"].startswith(said)
    assert trial["v_m"] == pytest.approx(0.0, abs=1e-3)  # course and heading are the same
    for name, angle in (("phi", 1.0), ("theta", -0.4)):
        if name in trial:
            assert np.rad2deg(trial[name]) == pytest.approx(angle)


def test_a_magnetic_heading_alone_asks_for_the_variation(tmp_path: Path) -> None:
    magnetic = lambda t: signed(f"HCHDM,{(course(t) - 6.0) % 360:.3f},M")  # noqa: E731
    with pytest.raises(DataError, match="HCHDM, which is magnetic, and no variation in HDG or RMC; give it in a mapp"):
        log(tmp_path, (rmc, magnetic), SECONDS)
    true(log(tmp_path, (rmc, magnetic), SECONDS, "variation = 6.0"))


def test_a_compass_that_is_not_set_says_no_variation(tmp_path: Path) -> None:
    """HDG with 0.0,E beside RMC with 4.0,W: the one that is not zero counts."""
    compass = lambda t: signed(f"HCHDG,{(course(t) + 4.0) % 360:.3f},0.0,E,0.0,E")  # noqa: E731
    true(log(tmp_path, (lambda t: rmc(t, variation="4.0,W"), compass), SECONDS))


def test_two_gyros_are_not_interleaved_and_their_difference_is_told(tmp_path: Path) -> None:
    says = (rmc, lambda t: hdt(t, "GP", 2.0), hdt)
    trial = log(tmp_path, says, SECONDS)
    true(trial)
    assert trial.meta["sources"]["heading"] == (
        "HEHDT, 1 Hz, 100 % of the time; GPHDT left aside, differs by +2 deg in the median"
    )
    other = log(tmp_path, says, SECONDS, 'prefer = { heading = "GPHDT" }')
    assert np.rad2deg(other["psi"] - trial["psi"]) == pytest.approx(2.0, abs=1e-2)
    with pytest.raises(DataError, match=r"prefer\.heading: .*GPHDX"):
        log(tmp_path, says, SECONDS, 'prefer = { heading = "GPHDX" }')


def test_two_receivers_are_not_interleaved(tmp_path: Path) -> None:
    trial = log(tmp_path, (lambda t: gga(t, "GN", 20.0), gga, hdt), SECONDS, 'prefer = { position = "GPGGA" }')
    assert len(trial) == 60
    true(trial)
    assert "GNGGA left aside, 20 m away in the median" in trial.meta["sources"]["position"]


def test_a_silent_gyro_is_followed_by_the_other_without_its_offset(tmp_path: Path) -> None:
    gone = lambda t: hdt(t) if t < 40 else signed(f"GPVTG,{course(t):.2f},T,,M,9.7,N,18,K,A")  # noqa: E731
    trial = log(tmp_path, (rmc, gone, lambda t: hdt(t, "GP", 2.0)), SECONDS)
    true(trial)
    assert "fills 20 readings where the first is silent" in trial.meta["sources"]["heading"]


def test_lost_fixes_are_taken_from_the_other_sentence_of_their_receiver(tmp_path: Path) -> None:
    trial = log(tmp_path, (lambda t: rmc(t) if t % 3 else "", gga, hdt), SECONDS)
    assert np.isfinite(trial["x"]).all()
    true(trial)


@pytest.mark.parametrize(
    "wrong",
    [
        lambda s: s.replace(",A*", ",A*")[: s.rindex("*")],  # no checksum
        lambda s: s.replace("$GPRMC,", "$GPRMC, "),
        lambda s: s.replace(f"{SPEED / KNOT:.4f}", f"+{SPEED / KNOT:.4f}"),
        lambda s: s.replace("010526", "310226"),
        lambda s: s.replace("010526", "01052026"),
        lambda s: s.replace("010526,,,A", "010526,999.9,E,A"),
        lambda s: s.replace("010526,,,A", "010526,,,A,V"),
        lambda s: s + "   ",
        lambda s: "\x00" + s,
        lambda s: f'"{s}"',
    ],
    ids=["checksum", "blank", "plus", "no such day", "long year", "variation", "status", "tail", "nul", "quoted"],
)  # fmt: skip
def test_careless_sentences_lose_what_is_bad_and_nothing_else(tmp_path: Path, wrong: Callable[[str], str]) -> None:
    def say(t: float) -> str:
        changed = wrong(rmc(t))
        body = changed.strip().strip('"\x00')
        return changed if "*" not in body else changed.replace(body, signed(body[1:].partition("*")[0]))

    true(log(tmp_path, (say, hdt), SECONDS))


STAMPS: dict[str, Callable[[float], str]] = {
    "iso": lambda t: f"2026-05-01T10:00:{t:09.6f}Z ",
    "comma": lambda t: f"2026-05-01T10:00:{t:06.3f} ".replace(".", ","),
    "zone": lambda t: f"2026-05-01 12:00:{t:06.3f}+02:00\t", "brackets": lambda t: f"[2026-05-01 10:00:{t:06.3f}] ",
    "slashes": lambda t: f"2026/05/01 10:00:{t:06.3f} ", "dots": lambda t: f"01.05.2026 10:00:{t:06.3f};",
    "months first": lambda t: f"05/01/2026,10:00:{t:06.3f},", "clock": lambda t: f"10:00:{t:06.3f} ",
    "day of year": lambda t: f"cnav\t2026:121:10:00:{t:07.4f}\t", "epoch": lambda t: f"{1777629600 + t:.3f}: ",
    "milliseconds": lambda t: f"{1777629600000 + round(1000 * t)};I;", "uptime": lambda t: f"{100 + t:.2f} ",
    "r2r": lambda t: f"NAV 2026/05/01 10:00:{t:06.3f} GPS ",
    "datalog": lambda t: f"INNAV\t2026-05-01T10:00:{t:06.3f}Z\tS3\t",
    "tag": lambda t: f"\\s:GP0001,c:{1777629600000 + round(1000 * t)}*",
    "syslog": lambda t: f"May  1 10:00:{int(t):02d} ",
}  # fmt: skip


def stamped(name: str) -> Say:
    def stamp(t: float) -> str:
        said = STAMPS[name](t)
        if name != "tag":
            return said
        total = 0
        for byte in said[1:-1].encode():
            total ^= byte
        return f"{said}{total:02X}\\"

    return stamp


@pytest.mark.parametrize("name", STAMPS)
def test_stamps_of_loggers(tmp_path: Path, name: str) -> None:
    """Heading and rudder alone, every two seconds: nothing but the stamp tells the time."""
    rudder = lambda _: signed("IIRSA,12.0,A,,V")  # noqa: E731
    trial = log(tmp_path, (hdt, rudder), SECONDS[::2], stamp=stamped(name))
    assert trial.t == pytest.approx(SECONDS[::2], abs=1e-3)
    assert np.rad2deg(trial["psi"]) == pytest.approx([course(t) for t in SECONDS[::2]], abs=0.01)
    assert np.rad2deg(trial["delta"]) == pytest.approx(12.0)
    if name not in ("clock", "uptime", "syslog"):
        assert trial.meta["start"] == "2026-05-01T10:00:00.000000+00:00"


def test_stamps_behind_the_sentence_and_in_a_table(tmp_path: Path) -> None:
    behind = lambda t: f"{hdt(t)},{1777629600 + t:.3f}"  # noqa: E731
    assert log(tmp_path, (behind,), SECONDS).t == pytest.approx(SECONDS)
    path = tmp_path / "vdr.csv"
    rows = "\n".join(f'{1777629600000 + round(1000 * t)},NMEA0183,COM3,HEHDT,"{hdt(t)}"' for t in SECONDS)
    path.write_text(f"received_at,protocol,source,msg_type,raw_data\n{rows}\n")
    assert read(path).t == pytest.approx(SECONDS)


def test_the_clock_of_the_fix_is_its_time_whatever_the_stamp_says(tmp_path: Path) -> None:
    """Stamps an hour ahead and .4 s late by turns: fixes lie where their clock says, and the offset is told."""
    late = lambda t: f"2026-05-01T11:00:{t + (0.4 if int(t) % 2 else 0.0):06.3f}Z "  # noqa: E731
    trial = log(tmp_path, (rmc,), SECONDS[:50], stamp=late)
    assert trial.t == pytest.approx(SECONDS[:50])
    true(trial, headed=False)
    assert any("s off the clock of the receiver, which counts" in one for one in trial.meta["processing"])


def test_several_sentences_on_a_line_and_sentences_taken_apart() -> None:
    parts = [*pieces(f"GPS\t39440.5\t{rmc(0.0)},{hdt(1.0)} \r".encode())]
    assert [hear(one.sentence).source for one in parts] == ["GPRMC", "HEHDT"]
    assert parts[0].before == b"GPS\t39440.5\t"
    assert hear(b"$02MWV,327.6,R,1.89,N").source == "02MWV"
    with pytest.raises(NmeaError, match="checksum is 00"):
        hear(b"$HEHDT,98.25,T*00")


def test_a_clock_that_goes_back_is_refused_with_its_line(tmp_path: Path) -> None:
    with pytest.raises(DataError, match=r"line 81: the clock of GPRMC goes back by 10 s, from 10:00:39.00 to 10:00:29"):
        log(tmp_path, (rmc, hdt), [*SECONDS[:40], *SECONDS[29:]])


@pytest.mark.parametrize("says", [(rmc, hdt), (hdt, gga, rmc)], ids=["fix first", "fix last"])
def test_a_log_joined_in_the_wrong_order_is_two_trials(tmp_path: Path, says: Sequence[Say]) -> None:
    """Each piece has its own place on the circle, and nothing of the other one at its ends."""
    later, path = [720.0 + k for k in range(70)], tmp_path / "log.nmea"
    path.write_text("\n".join(say(t) for t in (*later, *[float(k) for k in range(90)]) for say in says) + "\n")
    trials = read_all(path)
    assert [(one.name, len(one)) for one in trials] == [("log_1", 70), ("log_2", 90)]
    for one in trials:  # the circle takes 720 s; what stands where the log is cut belongs to neither for sure
        true(one, headed=False)
        there = np.isfinite(one["psi"])
        assert (~there).sum() <= 1
        assert np.rad2deg(one["psi"])[there] == pytest.approx(0.5 * np.flatnonzero(there), abs=0.01)
    assert [one.meta["start"][11:19] for one in trials] == ["10:12:00", "10:00:00"]
    for one in trials:
        assert any("goes back by 789 s, from 10:13:09.00 to 10:00:00.00" in step for step in one.meta["processing"])
        assert not any("doubt" in step for step in one.meta["processing"])
    with pytest.raises(DataError, match="2 trials of it; import it first"):
        read(path)


@pytest.mark.parametrize("wrong", [[100], [100, 101, 102]])
def test_a_clock_that_is_wrong_for_a_while_is_refused(tmp_path: Path, wrong: list[int]) -> None:
    path = tmp_path / "log.nmea"
    path.write_text("\n".join(say(t + 1800.0 * (t in wrong)) for t in range(200) for say in (rmc, hdt)))
    with pytest.raises(DataError, match=f"line {2 * wrong[-1] + 3}: the clock of GPRMC goes back"):
        read_all(path)


def test_pieces_that_lie_over_each_other_are_doubted(tmp_path: Path) -> None:
    path = tmp_path / "log.nmea"
    path.write_text("\n".join(say(t) for t in [*range(80), *range(60, 140)] for say in (rmc, hdt)))
    trials = read_all(path)
    assert [len(one) for one in trials] == [80, 80]
    assert all(any(step.startswith("doubt: it lies over") for step in one.meta["processing"]) for one in trials)


def test_stamps_that_go_back_part_a_log_without_a_clock(tmp_path: Path) -> None:
    """Two sources tell the step each; the hour that a logger loses in autumn is not sorted into the one before."""
    path, times = tmp_path / "log.txt", [*range(7200, 7300), *range(3700, 3800)]
    line = lambda t, say: f"2026-10-25T{t // 3600:02d}:{t // 60 % 60:02d}:{t % 60:02d}Z {say}"  # noqa: E731
    path.write_text("\n".join(line(t, say) for t in times for say in (hdt(t), signed("TIROT,30.0,A"))))
    trials = read_all(path)
    assert [len(one) for one in trials] == [100, 100]
    for one, first in zip(trials, (7200, 3700), strict=True):
        turn = np.rad2deg(one["psi"]) - course(first)
        assert turn - 360.0 * round(float(turn[0]) / 360.0) == pytest.approx(0.5 * np.arange(100), abs=0.01)
    short = [*range(7200, 7300), *range(7250, 7260)]
    path.write_text("\n".join(line(t, hdt(t)) for t in short))
    with pytest.raises(DataError, match=r"line 101: the stamp goes back by 49 s, from 02:01:39"):
        read_all(path)


def test_stamps_that_go_back_are_left_aside_where_the_fix_has_a_clock(tmp_path: Path) -> None:
    path = tmp_path / "log.txt"
    stamp = lambda t: f"2026-05-01T10:{(t - 20 * (t > 50)) // 60 % 60:02d}:{(t - 20 * (t > 50)) % 60:02d}Z "  # noqa: E731
    path.write_text("\n".join(stamp(t) + say(float(t)) for t in range(100) for say in (rmc, hdt)))
    trial = read(path)
    assert trial.t == pytest.approx(np.arange(100.0))
    true(trial)
    assert any(step.startswith("stamps of lines left aside: line 103: the stamp goes back") for step in
               trial.meta["processing"])  # fmt: skip


@pytest.mark.parametrize("last", [True, False], ids=["heading last", "fix last"])
def test_headings_lie_before_their_fixes_only_where_a_log_ends_in_a_fix(tmp_path: Path, last: bool) -> None:
    """Both logs begin with a heading: one amid an epoch, one with its first."""
    first, path = -1 if last else 0, tmp_path / "log.nmea"
    lines = [hdt(first), *[line for k in range(60) for line in (rmc(k), hdt(first + 1 + k))]]
    path.write_text("\n".join(lines if last else lines[:-1]))
    trial = read(path)
    there = np.isfinite(trial["psi"])
    assert there.sum() >= 60
    begun = datetime.fromisoformat(trial.meta["start"]).timestamp() % 86400.0 - 36000.0
    off = np.rad2deg(trial["psi"]) - 0.5 * (trial.t + begun)
    assert np.cos(np.deg2rad(off[there])) == pytest.approx(1.0, abs=1e-8)


def test_midnight_is_no_step_back(tmp_path: Path) -> None:
    trial = log(tmp_path, (lambda t: rmc(t, begun=86390.0), hdt), SECONDS)
    assert trial.t == pytest.approx(SECONDS)
    true(trial)


def test_rudders_and_shafts_of_a_twin_screw(tmp_path: Path) -> None:
    says = (rmc, hdt, lambda _: signed("AGRSA,5.0,A,-5.0,A"), lambda _: signed("IIRPM,S,2,90.0,,A"),
            lambda _: signed("IIRPM,S,1,-60.0,,A"))  # fmt: skip
    trial = log(tmp_path, says, SECONDS)
    assert np.rad2deg(trial["delta_1"]) == pytest.approx(-5.0)  # port
    assert np.rad2deg(trial["delta_2"]) == pytest.approx(5.0)
    assert (trial["n_P_1"] == 1.5).all()
    assert (trial["n_P_2"] == -1.0).all()
    assert (trial.unit("delta_1"), trial.unit("n_P_2")) == ("rad", "1/s")


def test_a_rudder_that_only_the_port_field_tells_or_a_transducer(tmp_path: Path) -> None:
    port = log(tmp_path, (rmc, hdt, lambda _: signed("AGRSA,,V,-7.0,A")), SECONDS)
    assert np.rad2deg(port["delta"]) == pytest.approx(-7.0)
    turned = log(tmp_path, (rmc, lambda _: signed("IIXDR,C,,C,AIRTEMP,A,-1.0,D,HEEL,A,9.5,D,RUDDER")), SECONDS)
    assert np.rad2deg(turned["delta"]) == pytest.approx(9.5)
    assert np.rad2deg(turned["phi"]) == pytest.approx(-1.0)


@pytest.mark.parametrize(
    ("sentence", "said"),
    [
        ("WIMWV,330.0,R,10.0,N", {"U_A": 10 * KNOT, "gamma_A": math.radians(330.0)}),
        ("WIMWV,330.0,R,10.0,S,A", {"U_A": 10 * 1609.344 / 3600.0, "gamma_A": math.radians(330.0)}),
        ("WIMWV,330.0,R,10.0,N,V", {}), ("IIVWR,030.0,L,,N,5.0,M,,K", {"U_A": 5.0, "gamma_A": math.radians(330.0)}),
        ("IIVWT,030.0,R,10.0,N,,M,,K", {"U_T": 10 * KNOT, "gamma_T_bow": math.radians(30.0)}),
        ("IIMWD,270.0,T,,M,10.0,N,,M", {"U_T_ground": 10 * KNOT, "gamma_T_ground": math.radians(270.0)}),
        ("SDDBT,32.8,f,10.0,M,5.5,F", {"depth": 10.0}), ("SDDBT,100.0,f,,M,,F", {"depth": 30.48}),
        ("IIVHW,,T,,M,06.1,N,,K", {"u_log_water": 6.1 * KNOT}), ("IIVHW,,T,,M,,N,36.0,K", {"u_log_water": 10.0}),
        ("GPVTG,90.0,85.0,10.0,18.52", {"gamma_G": math.radians(90.0), "U_G": 10 * KNOT}),
        ("GPVTG,90.0,T,85.0,M,10.0,N,18.52,K,N", {}),
        ("GNGNS,100000.00,5900.00,N,01000.00,E,NNA,9,,,,,",
         {"time_of_day": 36000.0, "latitude": 59.0, "longitude": 10.0}),
        ("GNGNS,100000.00,5900.00,N,01000.00,E,NN,9,,,,,", {"time_of_none": 36000.0}),
        ("GPGLL,5900.00,S,01000.00,W", {"latitude": -59.0, "longitude": -10.0}), ("GPGLL,5960.00,S,01000.00,W", {}),
        ("PASHR,ATT,326000.0,101.3,-0.4,1.2", {}), ("PSXN,20,1,1,1,1", {}), ("TIROT,-60.0", {"r": -math.radians(1.0)}),
        ("TIROT,-60.0,V", {}), ("RCRPM,E,2,1500,,A", {"rpm_E_2": 1500.0}), ("RCRPM,S,,1500,,A", {}),
    ],
    ids=lambda one: str(one)[:30],
)  # fmt: skip
def test_fields_mean_what_manuals_say(sentence: str, said: dict[str, float]) -> None:
    assert readings(hear(signed(sentence).encode())) == pytest.approx(said)


@pytest.mark.slow
@given(seed=some.integers(0, 2**32 - 1))
@settings(max_examples=25, deadline=None)
def test_any_mix_of_devices_is_the_circle(tmp_path_factory: pytest.TempPathFactory, seed: int) -> None:
    """Random kinds, order, rates and losses: positions to the last digit of the minutes, whatever is told twice."""
    draw = np.random.default_rng(seed)
    fixes = [one for one in (rmc, gga, gll) if draw.random() < 0.7] or [rmc]
    says: list[Say] = [*fixes, hdt, *([lambda t: hdt(t, "GP", 1.5)] if draw.random() < 0.5 else [])]
    draw.shuffle(says)  # type: ignore[arg-type]
    step = float(draw.choice([0.2, 0.5, 1.0]))
    times = [round(step * k, 2) for k in range(60) if k < 2 or draw.random() > 0.1]
    trial = log(tmp_path_factory.mktemp("mix"), says, times)
    good = np.isfinite(trial["x"])
    origin = place(float(trial.t[np.argmax(good)]))
    truth = np.array([place(one)[0] - origin[0] for one in trial.t.tolist()])
    assert trial["x"][good] == pytest.approx(truth[good], abs=0.05)
    assert np.rad2deg(trial["psi"]) == pytest.approx([course(t) for t in trial.t.tolist()], abs=0.01)


def test_a_live_ear_takes_one_gyro_and_a_compass_by_its_variation() -> None:
    ear = Ear()
    for t in range(3):
        for say in (lambda t: hdt(t, "GP", 2.0), hdt, rmc, gga):
            ear.hear(say(float(t)).encode(), float(t))
        row = ear.row()
        assert math.degrees(row["psi"]) == pytest.approx(course(t), abs=0.01)
    ear.hear(hdt(9.0, "GP", 2.0).encode(), 9.0)  # the gyro is silent since 7 s
    assert math.degrees(ear.row()["psi"]) == pytest.approx(course(9.0) + 2.0, abs=0.01)
    compass = Ear()
    compass.hear(signed("HCHDG,98.2,1.0,W,4.1,E").encode(), 0.0)
    assert math.degrees(compass.row()["psi"]) == pytest.approx(101.3)


def test_stamps_of_other_sentences_are_moved_onto_the_clock_of_the_fix(tmp_path: Path) -> None:
    """A logger in another zone: the heading, which has no clock, lies where the fix of its second lies."""
    trial = log(tmp_path, (rmc, hdt), SECONDS, stamp=lambda t: f"2026-05-01T12:00:{t:06.3f}Z ")
    assert trial.t == pytest.approx(SECONDS)
    true(trial)
    assert trial.meta["start"] == "2026-05-01T10:00:00.000000+00:00"
    assert "stamps of lines are +7200 s off the clock of the receiver, which counts" in trial.meta["processing"]


def test_a_receiver_that_counts_its_weeks_anew_has_the_date_of_the_stamps(tmp_path: Path) -> None:
    """16 September 2006 is 1024 weeks before 2 May 2026 (a Saturday each)."""
    old = lambda t: signed(rmc(t)[1:].partition("*")[0].replace("010526", "160906"))  # noqa: E731
    trial = log(tmp_path, (old, hdt), SECONDS, stamp=lambda t: f"2026-05-02T10:00:{t:06.3f}Z ")
    assert trial.meta["start"] == "2026-05-02T10:00:00.000000+00:00"
    assert any("1 x 1024 weeks old" in one for one in trial.meta["processing"])


def test_a_position_without_a_date_has_that_of_the_stamps(tmp_path: Path) -> None:
    trial = log(tmp_path, (gga, hdt), SECONDS, stamp=lambda t: f"2026-05-01T10:00:{t:06.3f}Z ")
    assert trial.meta["start"] == "2026-05-01T10:00:00.000000+00:00"


@pytest.mark.parametrize(("until", "lead"), [(26.0, "GPHDT"), (36.0, "HEHDT")])
def test_a_gyro_that_speaks_for_less_than_half_of_the_log_is_not_taken(tmp_path: Path, until: float, lead: str) -> None:
    gyro = lambda t: hdt(t) if t < until else ""  # noqa: E731
    trial = log(tmp_path, (rmc, gyro, lambda t: hdt(t, "GP", 0.5)), SECONDS)
    assert trial.meta["sources"]["heading"].partition(": ")[2].startswith(lead) or (
        trial.meta["sources"]["heading"].startswith(lead)
    )


@pytest.mark.parametrize(
    ("sentence", "said"),
    [
        ("GPGLL,9000.00,S,18000.00,W", {"latitude": -90.0, "longitude": -180.0}), ("GPGLL,9000.01,S,18000.00,W", {}),
        ("GPGLL,5900.00,S,18000.01,W", {}), ("IIXDR,A,50.0,P,RUDDER", {}), ("IIXDR,U,5.0,D,RUDDER", {}),
        ("GPVTG,361.0,T,,M,,N,,K", {}), ("GPVTG,360.0,T,,M,,N,,K", {"gamma_G": math.tau}),
        ("IIVHW,,T,,M,,N,180.0,K", {"u_log_water": 50.0}), ("IIVHW,,T,,M,,N,201.0,K", {}),
        ("IIVHW,,T,,M,99.5,N,,K", {}), ("SDDPT,40.0,-2.0", {"depth": 40.0}), ("SDDPT,40.0,2.0", {"depth": 42.0}),
        ("GPRMC,100000,A,,,,,1.0,2.0,010526,181.0,E,A", {"time_of_day": 36000.0, "day": 20574 * 86400.0,
                                                        "U_G": KNOT, "gamma_G": math.radians(2.0)}),
    ],
    ids=lambda one: str(one)[:30],
)  # fmt: skip
def test_fields_beyond_their_range_are_no_readings(sentence: str, said: dict[str, float]) -> None:
    assert readings(hear(signed(sentence).encode())) == pytest.approx(said)


def tagged(source: str, t: float, sentence: str) -> str:
    content = f"s:{source},c:{round(1000.0 * t) + 1_790_000_000_000}"
    return f"\\{signed(content)[1:]}\\{sentence}"


@pytest.mark.parametrize("lead", ["HE0001", "HE0002"])
def test_tag_blocks_part_two_gyros_of_one_talker(tmp_path: Path, lead: str) -> None:
    """One of them says 1.7 deg less, half a second later; and the second receiver is 22 m to the north."""
    path = tmp_path / "net.txt"
    first, second = ("HE0001", "HE0002") if lead == "HE0001" else ("HE0002", "HE0001")
    path.write_text("\n".join(
        line for t in range(120) for line in (
            tagged("GP0001", t, gga(t)), tagged("GP0002", t + 0.02, gga(t, north=22.0)), tagged(first, t, hdt(t)),
            tagged(second, t + 0.5, hdt(t + 0.5, off=-1.7)))))  # fmt: skip
    mapping = tmp_path / "m.toml"
    sources = f'prefer = {{ heading = "{lead}/HEHDT", position = "GP0001/GPGGA" }}'
    mapping.write_text(f'schema = "seatrial-nmea/1"\n{sources}\n')
    trial = read(path, read_mapping(mapping))
    true(trial if lead == first else trial.having(psi=trial["psi"] + math.radians(1.7)))
    said = trial.meta["sources"]
    assert f"{second if lead == first else first}/HEHDT left aside, differs by" in said["heading"]
    assert "GP0002/GPGGA left aside, 22 m away" in said["position"]


def test_one_tag_block_a_talker_keeps_the_name_of_the_source(tmp_path: Path) -> None:
    path = tmp_path / "net.txt"
    path.write_text("\n".join(
        line for t in range(60) for line in (tagged("GP0001", t, rmc(t)), tagged("HE0001", t, hdt(t)))))  # fmt: skip
    assert read(path).meta["sources"]["heading"].startswith("HEHDT,")


@pytest.mark.parametrize("copies", [2, 3])
def test_sentences_that_are_logged_several_times_are_one(tmp_path: Path, copies: int) -> None:
    """A rudder that is held repeats itself truly, and the sentences of one fix do not: 2 headings a fix are 2."""
    rudder = ["$IIRSA,5.0,A,,V", "$IIRSA,5.5,A,,V"]
    once_told = [[rmc(t), hdt(t), hdt(t + 0.5), rudder[t // 40]] for t in range(80)]
    for name, count in (("once", 1), ("again", copies)):
        lines = [line for told in once_told for line in told for _ in range(count)]
        (tmp_path / name).write_text("\n".join(lines))
    one, again = read(tmp_path / "once"), read(tmp_path / "again")
    assert np.array_equal(one.t, again.t)
    for name in one.channels:
        assert np.array_equal(one[name], again[name], equal_nan=True), name
    assert any(f"each sentence is logged {copies} times" in step for step in again.meta["processing"])


def test_a_second_fix_with_the_same_time_is_no_copy(tmp_path: Path) -> None:
    """RMC and GGA of one fix, and a ship at anchor whose headings repeat themselves."""
    path = tmp_path / "anchored"
    path.write_text("\n".join(line for t in range(60) for line in (rmc(t), gga(t), "$HEHDT,90.0,T", "$HEHDT,90.0,T")))
    trial = read(path)
    assert len(trial) == 120
    assert not any("is logged" in step for step in trial.meta["processing"])


def _compass(t: float) -> str:
    """Sensor reading of a compass with a deviation of 1 deg W, in a variation of 4 deg E."""
    return signed(f"HCHDG,{(course(t) + 1.0 - 4.0) % 360:.3f},1.0,W,4.0,E")


FORMS: dict[str, Callable[[float], list[tuple[float, str]]]] = {
    "fixes told three times": lambda t: [(t, gga(t)), (t, rmc(t)), (t + 0.01, gll(t)), (t + 0.02, hdt(t))],
    "two ports": lambda t: [(t, rmc(t)), (t, hdt(t)), (t + 0.6, rmc(t))],
    "two gyros of two talkers": lambda t: [(t, rmc(t)), (t, hdt(t)), (t + 0.6, hdt(t + 0.6, "GP", 2.0))],
    "two gyros by TAG blocks": lambda t: [(t, rmc(t)), (t, tagged("HE0001", t, hdt(t))),
                                          (t + 0.6, tagged("HE0002", t, hdt(t + 0.6, off=-1.7)))],
    "two receivers by TAG blocks": lambda t: [(t, tagged("GP0001", t, rmc(t))), (t, hdt(t)),
                                              (t + 0.6, tagged("GP0002", t, rmc(t + 0.6, begun=36001.0)))],
    "a compass alone": lambda t: [(t, rmc(t)), (t, _compass(t))],
}  # fmt: skip


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("rate", [1.0, 2.0])
def test_rows_of_a_live_feed_are_those_of_a_clean_one(form: str, rate: float) -> None:
    """A twin has its forecasts from these rows alone, so that they are as good as with a clean feed."""
    rows: list[list[dict[str, float]]] = []
    for says in (lambda t: [(t, rmc(t)), (t, hdt(t))], FORMS[form]):
        ear, told = Ear(), list[dict[str, float]]()
        coming = sorted((one for k in range(40) for one in says(float(k))), key=lambda one: one[0])
        for due in np.arange(1.0, 40.0 * rate + 1.0) / rate - 0.05:
            while coming and coming[0][0] <= due:
                at, text = coming.pop(0)
                ear.hear(text.encode(), at)
            told.append(ear.row())
        rows.append(told)
    clean, messy = rows
    assert sum(map(bool, clean)) == 40
    for right, got in zip(clean, messy, strict=True):
        assert got == pytest.approx(right, abs=2e-5)


@pytest.mark.parametrize("begun", [36000.0, 79200.0])
def test_a_clock_that_is_wrong_for_a_while_is_refused_with_its_line(begun: float, tmp_path: Path) -> None:
    """For three seconds the hour is 0: that is no midnight, as the clock goes on where it was."""
    lines = []
    for t in map(float, range(180)):
        at = t % 60.0 if 60.0 <= t < 63.0 else begun + t
        lines += [rmc(t, begun=at - t), hdt(t)]
    path = tmp_path / "a.nmea"
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(DataError, match=r"line \d+: the clock of GPRMC goes back by"):
        read_all(path)


def test_a_clock_over_midnight_goes_on(tmp_path: Path) -> None:
    path = tmp_path / "a.nmea"
    path.write_text("\n".join(line for t in SECONDS for line in (rmc(t, begun=86400.0 - 30.0), hdt(t))) + "\n")
    assert np.diff(read(path).t) == pytest.approx(1.0, abs=1e-6)


def test_an_inertial_unit_of_vectornav_tells_fix_heading_and_velocity(tmp_path: Path) -> None:
    """GPS is 18 s ahead of UTC; week 2416 begins on 26 April 2026, and the first of May at 10 o'clock is a Friday."""
    lines = []
    for t in SECONDS:
        north, east = Datum(59.0, 10.0).place(*place(t))
        yaw = (course(t) + 180.0) % 360.0 - 180.0
        v = SPEED * np.exp(1j * math.radians(course(t)))
        status = "0002" if t % 7 else "0000"
        lines.append(signed(f"VNINS,{5 * 86400 + 36000 + 18 + t:.6f},2416,{status},{yaw:+08.3f},+001.000,-002.000,"
                            f"{north:+013.9f},{east:+014.9f},41,{v.real:+.4f},{v.imag:+.4f},0,.3,.5,.1"))  # fmt: skip
    path = tmp_path / "a.txt"
    path.write_text("\n".join(lines) + "\n")
    trial = read(path)
    assert len(trial) == sum(t % 7 != 0 for t in SECONDS), "a status of 0 has no solution"
    assert datetime.fromisoformat(trial.meta["start"]) == datetime.fromisoformat("2026-05-01T10:00:01+00:00")
    known = [t for t in SECONDS if t % 7]
    off = trial["psi"] - np.radians([course(t) for t in known])
    assert np.angle(np.exp(1j * off)) == pytest.approx(0.0, abs=1e-4)
    assert trial["u"] == pytest.approx(SPEED, abs=1e-3)
    assert trial["v_m"] == pytest.approx(0.0, abs=1e-3)
    assert (trial["phi"][0], trial["theta"][0]) == pytest.approx((math.radians(-2.0), math.radians(1.0)))
    assert np.hypot(np.diff(trial["x"]), np.diff(trial["y"])) / np.diff(trial.t) == pytest.approx(SPEED, abs=0.05)


def test_a_device_of_a_folder_that_makes_no_rows_is_left_out_and_told(tmp_path: Path) -> None:
    (tmp_path / "gps.nmea").write_text("\n".join(line for t in SECONDS for line in (rmc(t), hdt(t))) + "\n")
    sonar = tmp_path / "sonar.nmea"
    sonar.write_text("\n".join(signed(f"SDDBT,,f,{20 + 0.1 * k:.1f},M,,F") for k in range(40)) + "\n")
    ((path, (trial,)),) = logs("nmea", tmp_path)
    assert path.name == "gps.nmea"
    assert any("doubt: left out" in one and "sonar.nmea: no time" in one for one in trial.meta["processing"])
    with pytest.raises(DataError, match=r"sonar\.nmea: no time"):
        list(logs("nmea", sonar))
    (tmp_path / "gps.nmea").write_text("no log\n" * 30)
    with pytest.raises(DataError, match=r"gps\.nmea"):
        list(logs("nmea", tmp_path))


def test_revolutions_in_transducers_are_those_of_engine_or_shaft() -> None:
    for name, wanted in (("ENGINE#0", "rpm_E_0"), ("Engine#2", "rpm_E_2"), ("SHAFT_1", "rpm_S_1"), ("PROP", "rpm_S_0")):
        assert readings(hear(signed(f"ERXDR,T,148.5,R,{name}").encode())) == {wanted: 148.5}
    assert readings(hear(signed("ERXDR,T,148.5,C,ENGINE#0").encode())) == {}
    assert readings(hear(signed("ERXDR,T,148.5,R,TURBO").encode())) == {}


def test_a_piece_begins_with_no_heading_of_the_piece_before(tmp_path: Path) -> None:
    """A clock set back by 100 s in a turn, five headings before each fix: those around the cut are of either."""
    lines = []
    for begin, end in ((0, 170), (70, 300)):
        for t in range(begin, end):
            lines += [hdt(t + 0.2 * k - 1.0) for k in range(1, 6)] + [rmc(float(t))]
        lines += [hdt(end + 0.2 * k - 1.0) for k in range(1, 4 * (end == 170))]  # of a fix that was not told any more
    path = tmp_path / "a.nmea"
    path.write_text("\n".join(lines) + "\n")
    _, second = read_all(path)
    turn = np.diff(second["psi"]) / np.diff(second.t)
    assert turn == pytest.approx(math.radians(0.5), abs=math.radians(0.3))
