"""Where antenna, anemometer and log stand aboard, and how often they read, change nothing of what a twin finds."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from scenes import on_wire, scene
from sea_logs import NOISE, Bridge, Row, sailed
from seatrial.data.formats.nmea import Aboard, Place, aboard_of, beside, read, write_aboard
from seatrial.data.geodesy import Datum
from seatrial.data.nmea.ship import Fittings, lines
from seatrial.identify.filters.augmented import ANTENNA
from seatrial.identify.nuisance import CURRENT
from seatrial.realtime.bridge.view import OWN
from seatrial.realtime.links.wiring import tell_places
from seatrial.realtime.twin.follow import begun, made
from seatrial.realtime.twin.live import Live
from seatrial.realtime.twin.settings import usual
from seatrial.realtime.twin.sources import Ear
from seatrial.ships.files import load
from seatrial.workflow.live.twin import twin

SHIP = load("kvlcc2")
CHANNELS = ("x", "y", "psi", "r", "u_w", "v_north", "v_east", "n_P", "delta")
ALL = NOISE | {"y": NOISE["x"], "v_east": NOISE["v_north"]}
AFT = (-0.4 * SHIP.L_pp, 5.0)


def followed(rows: list[Row], antenna: tuple[float, float] | None) -> Live:
    live = Live(SHIP, usual(SHIP, CHANNELS, noise=ALL, antenna=antenna), CHANNELS)
    for t, row in rows:
        live.feed(t, row)
    assert live.follower is not None
    return live


@pytest.mark.slow
@pytest.mark.parametrize("stated", [True, False])
def test_an_antenna_aft_is_no_force_and_no_current(stated: bool) -> None:
    """Where nothing states its place, it is found; the current is that of the water, and there is no alarm."""
    live = followed(Bridge(sailed(current=(0.0, 0.3)), AFT).rows(900.0), AFT if stated else None)
    assert live.alarms == []
    assert live.follower is not None
    for name, true in zip(CURRENT, (0.0, 0.3), strict=True):
        value, sd = live.follower.value(name)
        assert abs(value - true) < 4.0 * sd < 0.2
    if not stated:
        for name, true in zip(ANTENNA, AFT, strict=True):
            value, sd = live.follower.value(name)
            assert abs(value - true) < 4.0 * sd < 0.05 * SHIP.L_pp


@pytest.mark.slow
def test_midship_begins_as_far_from_the_fix_as_the_antenna_stands() -> None:
    """Place and velocity are those of a rigid body; what is not known of the place widens them in its direction."""
    forward, starboard, psi, r = -128.0, 5.0, 2.0, 0.01
    u, v = 7.0, -0.5
    c, s = math.cos(psi), math.sin(psi)
    u_a, v_a = u - r * starboard, v + r * forward
    read_at = {"x": 100.0 + forward * c - starboard * s, "y": 50.0 + forward * s + starboard * c, "psi": psi, "r": r,
               "v_north": u_a * c - v_a * s, "v_east": u_a * s + v_a * c, "u_w": u}  # fmt: skip
    told = made(SHIP, usual(SHIP, CHANNELS, noise=ALL, antenna=(forward, starboard)))
    readings = np.array([read_at[name] for name in told.channels])
    first = begun(told, 0.0, readings)
    np.testing.assert_allclose(first.mean[:6], [100.0, 50.0, psi, u, v, r], atol=1e-9)
    untold = made(SHIP, usual(SHIP, CHANNELS, noise=ALL, antenna=None))
    own, n = untold.traced.own, len(untold.names)
    known = np.zeros(n - own), np.zeros((n - own, n - own))
    for name, value in zip(ANTENNA, (forward, starboard), strict=True):
        known[0][untold.names.index(name) - own] = value
    np.testing.assert_allclose(begun(untold, 0.0, readings, known).mean[:6], first.mean[:6], atol=1e-9)
    wide = begun(untold, 0.0, readings)
    # however unsure the place is, the antenna is as sure as the readings: at the fix, with the velocity that was read
    expected, transposed = untold.traced.model.read(wide.mean, np.zeros(10))
    sd = dict(zip(untold.channels, np.sqrt(np.diagonal(transposed.T @ wide.cov @ transposed)), strict=True))
    by_gnss = [k for k, name in enumerate(untold.channels) if name in ("x", "y", "psi", "v_north", "v_east")]
    np.testing.assert_allclose(expected[by_gnss], readings[by_gnss], atol=1e-9)
    assert sd["x"] == pytest.approx(10.0 * untold.traced.model.noise[untold.channels.index("x")], rel=1e-6)
    assert wide.value("x")[1] > 0.1 * SHIP.L_pp
    sd_sway = wide.value("v_m")[1]
    wanted = math.hypot(5.0 * untold.traced.model.noise[untold.channels.index("v_north")], 0.3 * SHIP.L_pp * r)
    assert sd_sway == pytest.approx(wanted, rel=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("every", [1, 2, 5, 20, 60])
def test_each_forecast_is_judged_however_seldom_fixes_come(every: int) -> None:
    """Twelve minutes: no fewer than one forecast in two minutes over 30 s and 120 s, and one over 600 s."""
    bridge = Bridge(sailed(), rates=(("x", 1.0 / every), ("v_north", 1.0 / every)))
    live = followed(bridge.rows(720.0), (0.0, 0.0))
    count = {h: score.count for h, score in live.trust.scores.items()}
    assert count[30.0] >= 5
    assert count[120.0] >= 4
    assert count[600.0] >= 1
    assert all(score.rms < score.rival for score in live.trust.scores.values())


def sentences(rows: list[Row], kinds: tuple[str, ...], datum: Datum) -> list[tuple[float, list[bytes]]]:
    """A bridge's sentences: position, course and speed of the antenna, heading, rate, controls."""
    fittings, out = Fittings(datum, epoch=1_800_000_000.0), list[tuple[float, list[bytes]]]()
    for t, row in rows:
        said = {"t": t, **{name: row[name] for name in ("psi", "r", "u_w", "delta", "n_P") if name in row}, "v_w": 0.0}
        if "x" in row:
            said["latitude"], said["longitude"] = datum.place(row["x"], row["y"])
            said["U"] = math.hypot(row["v_north"], row["v_east"])
            said["chi"] = math.atan2(row["v_east"], row["v_north"]) % math.tau
        out.append((t, [line for kind in kinds for line in lines(kind, fittings, said)]))
    return out


ONCE = ("RMC", "HDT", "ROT", "RSA", "RPM", "VBW")
TWICE = ("RMC", "GGA", "HDT", "THS", "ROT", "RSA", "RPM", "VBW")
PLACE = Datum(35.0, 139.7)


@pytest.mark.slow
def test_what_is_told_twice_in_a_second_is_one_reading(tmp_path: Path) -> None:
    """Fix in RMC and GGA, heading in HDT and THS: the trial of the log is that of the plain one, row by row."""
    rows = Bridge(sailed()).rows(60.0)
    found = []
    for kinds in (ONCE, TWICE):
        path = tmp_path / f"{len(kinds)}.nmea"
        path.write_bytes(b"".join(line for _, some in sentences(rows, kinds, PLACE) for line in some))
        found.append(read(path))
    once, twice = found
    assert len(twice.t) == len(once.t) == 60
    for name, values in once.channels.items():
        np.testing.assert_array_equal(twice[name], values)


@pytest.mark.slow
def test_what_is_told_twice_on_a_wire_is_one_reading() -> None:
    """Even where the second one falls into the next row; and the other one is heard where the first falls silent."""
    rows = Bridge(sailed()).rows(30.0)
    once, twice, alone = Ear(PLACE), Ear(PLACE), Ear(PLACE)
    for (t, some), (_, more), (_, gga) in zip(
        sentences(rows, ONCE, PLACE), sentences(rows, TWICE, PLACE), sentences(rows, ("GGA", "THS"), PLACE), strict=True
    ):
        for line in some:
            once.hear(line, t)
        late = [line for line in more if line[3:6] in (b"GGA", b"THS")]
        for line in (line for line in more if line not in late):
            twice.hear(line, t)
        assert twice.row() == once.row()
        for line in late:
            twice.hear(line, t + 0.1)
        assert twice.row().keys() <= {"delta", "n_P"}
        if t < 10.0 or t > 20.0:
            alone.hear(some[0], t)
        for line in gga:
            alone.hear(line, t + 0.1)
        assert ("x" in alone.row()) == (t <= 9.0 or t >= 14.0)


def test_a_wire_has_the_apparent_wind_and_the_speed_of_midship() -> None:
    """A mast 120 m aft feels -120 r from starboard; a log 10 m to starboard is 10 r slower in a turn to starboard."""
    r, fittings = 0.02, Fittings(PLACE)
    ahead, aside = 9.0, -3.0
    felt = {"t": 0.0, "r": r, "U_A": math.hypot(ahead, aside + r * -120.0), "u_w": 6.0 - 10.0 * r, "v_w": 0.0,
            "gamma_A": math.atan2(aside + r * -120.0, ahead) % math.tau}  # fmt: skip
    ear = Ear(PLACE, Aboard(log=Place(0.0, 10.0), mast=Place(-120.0, 0.0)))
    for kind in ("ROT", "VBW", "MWV"):
        for line in lines(kind, fittings, felt):
            ear.hear(line)
    row = ear.row()
    assert row["u_w"] == pytest.approx(6.0, abs=0.01)
    assert row["U_A"] * math.cos(row["gamma_A"]) == pytest.approx(ahead, abs=0.1)
    assert row["U_A"] * math.sin(row["gamma_A"]) == pytest.approx(aside, abs=0.1)


@pytest.mark.slow
def test_a_trial_of_a_log_has_place_course_speed_and_wind_of_midship(tmp_path: Path) -> None:
    motion, forward, starboard = sailed(), -100.0, 8.0
    rows = Bridge(motion, (forward, starboard), noise=0.0).rows(400.0)
    path = tmp_path / "a.nmea"
    path.write_bytes(b"".join(line for _, some in sentences(rows, ONCE, PLACE) for line in some))
    write_aboard(path, antenna=(forward, starboard), log=(0.0, 0.0), mast=(0.0, 0.0))
    found = read(path, replace(aboard_of(path), datum=PLACE))
    true = motion.at(found.t)
    np.testing.assert_allclose(found["x"], true["x"], atol=0.4)
    np.testing.assert_allclose(found["y"], true["y"], atol=0.4)
    north, east = (found["U_G"] * f(found["gamma_G"]) for f in (np.cos, np.sin))
    c, s = np.cos(true["psi"]), np.sin(true["psi"])
    np.testing.assert_allclose(north, true["u"] * c - true["v_m"] * s, atol=0.03)
    np.testing.assert_allclose(east, true["u"] * s + true["v_m"] * c, atol=0.03)


def test_a_log_of_the_wire_says_where_its_instruments_stand(tmp_path: Path) -> None:
    stage, _ = on_wire(scene(usual=True))
    tell_places(tmp_path / "a.nmea", stage.loop.vessels[OWN])
    aboard, L = aboard_of(tmp_path / "a.nmea"), stage.scenario.own.ship.L_pp
    assert aboard.place == pytest.approx((-0.4 * L, 0.0))
    assert (aboard.mast.forward, aboard.log.forward) == pytest.approx((-0.4 * L, 0.3 * L))


def logged(path: Path, seconds: float, told: str) -> Path | None:
    """Write a log of sentences with the antenna aft; its mapping file, where that is not beside it."""
    rows = Bridge(sailed(current=(0.0, 0.3)), AFT).rows(seconds)
    path.write_bytes(b"".join(line for _, some in sentences(rows, ONCE, PLACE) for line in some))
    if told in ("beside", "mapping"):
        write_aboard(path, antenna=AFT, log=(0.0, 0.0), mast=(0.0, 0.0))
    return beside(path).rename(path.with_name("m.toml")) if told == "mapping" else None


@pytest.mark.slow
@pytest.mark.parametrize("told", ["mapping", "option", "nowhere"])
def test_the_command_takes_the_antenna_from_wherever_it_is_stated(tmp_path: Path, told: str) -> None:
    mapping = logged(tmp_path / "a.nmea", 60.0, told)
    option = f"{AFT[0]},{AFT[1]}" if told == "option" else None
    live = twin(SHIP, nmea=str(tmp_path / "a.nmea"), mapping=mapping, antenna=option).result
    assert live.machine.settings.antenna == ((0.0, 0.0) if told == "nowhere" else pytest.approx(AFT))
    assert live.machine.settings.placed == (told != "nowhere")
    # a stated place may be off by a thirtieth of the length, one that nothing states by a third
    assert live.machine.settings.start[ANTENNA[0]] == pytest.approx((0.3 if told == "nowhere" else 0.03) * SHIP.L_pp)


@pytest.mark.long
@pytest.mark.parametrize("told", ["beside", "nowhere"])
def test_a_twin_on_a_log_with_the_antenna_aft_names_nothing(tmp_path: Path, told: str) -> None:
    logged(tmp_path / "a.nmea", 900.0, told)
    live = twin(SHIP, nmea=str(tmp_path / "a.nmea")).result
    assert live.alarms == []
    assert live.follower is not None
    assert live.follower.value(CURRENT[1])[0] == pytest.approx(0.3, abs=0.1)
