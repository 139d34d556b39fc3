"""A guess at what bare numbers of a robot's log are: a ship with two motors, and one with a rudder, sailed by them."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from recorded import DATUM, Floats, Speaker, ticks, write_chunks
from telemetry import quaternion, ulog

from seatrial.cli.app import main
from seatrial.data import Trial
from seatrial.data.formats import reader
from seatrial.data.guess import guess
from seatrial.data.importing import import_log
from seatrial.data.trialfile import read_trial

pytestmark = pytest.mark.slow
DT = 0.2


def orders(seed: int, n: int = 1500) -> tuple[Floats, Floats]:
    """Two shares of the most, each held for some seconds."""
    rng = np.random.default_rng(seed)
    held = [np.repeat(rng.uniform(low, 1.0, n // 25), 25) for low in (-0.3, -0.4)]
    return held[0][:n], held[1][:n]


def sailed(ahead: Floats, turn: Floats) -> dict[str, Floats]:
    """A ship of first order in speed and rate of turn, driven ahead and to starboard."""
    u, r, psi, x, y = (np.zeros(ahead.size) for _ in range(5))
    for k in range(ahead.size - 1):
        u[k + 1] = u[k] + DT * (0.8 * ahead[k] - 0.4 * u[k])
        r[k + 1] = r[k] + DT * (0.3 * turn[k] - 0.6 * r[k])
        psi[k + 1] = psi[k] + DT * r[k]
        x[k + 1] = x[k] + DT * u[k] * math.cos(psi[k])
        y[k + 1] = y[k] + DT * u[k] * math.sin(psi[k])
    return {"u": u, "r": r, "psi": psi, "x": x, "y": y, "t": DT * np.arange(ahead.size)}


def bag(path: Path, ship: dict[str, Floats], more: Any) -> None:
    say = Speaker()
    stamps = ticks(ship["t"])
    found = [say.fix("/fix", k, a, b) for k, a, b in zip(stamps, ship["x"], ship["y"], strict=True)]
    found += [say.imu("/imu", k, 0.5 * math.pi - a, -b) for k, a, b in zip(stamps, ship["psi"], ship["r"], strict=True)]
    found += [one for n, k in enumerate(stamps) for one in more(say, n, k)]
    write_chunks(path, sorted(found, key=lambda one: one.logged))


def imported(tmp_path: Path, path: Path, text: str, format: str) -> Trial:
    mapping = tmp_path / "map.toml"
    mapping.write_text(text)
    return reader(format, mapping)(path)


@pytest.mark.parametrize("exchanged", [False, True])
@pytest.mark.parametrize("reversed_", [False, True])
def test_pulses_of_two_motors_are_those_of_their_sides(tmp_path: Path, exchanged: bool, reversed_: bool) -> None:
    """Channels 1 and 3 of the servo rail; which is port, and whether more is ahead, only the motion tells."""
    port, starboard = orders(4)
    ship = sailed(0.5 * (port + starboard), port - starboard)
    first, third = (starboard, port) if exchanged else (port, starboard)
    sign = -1.0 if reversed_ else 1.0
    a, b = (1500.0 + 400.0 * sign * one for one in (first, third))
    bag(tmp_path / "a.mcap", ship,
        lambda say, n, k: [say.pulses("/mavros/rc/out", k, [round(a[n]), 0, round(b[n]), 1500])])  # fmt: skip
    found = guess(tmp_path / "a.mcap")
    assert found.format == "mcap"
    got = imported(tmp_path, tmp_path / "a.mcap", found.text, "mcap")
    np.testing.assert_allclose(got["throttle_port"], port, atol=0.5 / 400 + 1e-9)
    np.testing.assert_allclose(got["throttle_starboard"], starboard, atol=0.5 / 400 + 1e-9)
    assert any("taken as pulses" in one for one in found.doubts)
    assert any("its sign is turned" in one for one in found.doubts) == reversed_


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_rudder_has_the_sign_of_the_turn(tmp_path: Path, sign: float) -> None:
    turn, _ = orders(5)
    ship = sailed(np.full(turn.size, 0.5), turn)
    kind = "std_msgs/msg/Float32"
    bag(tmp_path / "a.mcap", ship, lambda say, n, k: [say.number("/rudder_angle", k, sign * 30.0 * turn[n], kind)])
    found = guess(tmp_path / "a.mcap")
    assert not found.doubts
    got = imported(tmp_path, tmp_path / "a.mcap", found.text, "mcap")
    np.testing.assert_allclose(got["delta"], np.radians(30.0 * turn), atol=1e-6)


def test_a_log_of_px4_with_a_motor_and_a_servo(tmp_path: Path) -> None:
    ahead, turn = orders(6)
    ship = sailed(ahead, turn)
    t = ship["t"] + 5.0
    places = [DATUM.place(a, b) for a, b in zip(ship["x"], ship["y"], strict=True)]
    (tmp_path / "a.ulg").write_bytes(ulog({
        "vehicle_attitude": ("float[4] q", [(a, *quaternion(b)) for a, b in zip(t, ship["psi"], strict=True)]),
        "sensor_gps": ("double latitude_deg;double longitude_deg", [(a, *b) for a, b in zip(t, places, strict=True)]),
        "actuator_motors": ("float[2] control", [(a, b, 0.0) for a, b in zip(t, ahead, strict=True)]),
        "actuator_outputs": ("float[2] output", [(a, b, 0.0) for a, b in zip(t, -turn, strict=True)]),
    }))  # fmt: skip
    found = guess(tmp_path / "a.ulg")
    got = imported(tmp_path, tmp_path / "a.ulg", found.text, "ulog")
    np.testing.assert_allclose(got["throttle"], ahead, atol=1e-6)
    np.testing.assert_allclose(got["steering"], turn, atol=1e-6)


def test_a_number_that_moves_nothing_is_in_doubt_and_a_known_log_needs_no_mapping(tmp_path: Path) -> None:
    turn, other = orders(7, 400)
    ship = sailed(np.full(turn.size, 0.5), turn)
    bag(tmp_path / "a.mcap", ship, lambda say, n, k: [say.number("/port_motor_load", k, other[n])])
    found = guess(tmp_path / "a.mcap")
    assert found.doubts == ("/port_motor_load: nothing shows what it is; give it a channel in [numbers], or leave it",)
    bag(tmp_path / "b.mcap", ship, lambda say, n, k: [say.number("/wamv/thrusters/left/thrust", k, 1.0)])
    assert guess(tmp_path / "b.mcap").text == ""


def test_the_command_writes_a_mapping_that_its_import_takes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:  # fmt: skip
    port, starboard = orders(8, 600)
    ship = sailed(0.5 * (port + starboard), port - starboard)
    bag(tmp_path / "a.mcap", ship, lambda say, n, k: [say.pulses(
        "/rc/out", k, [round(1500 + 400 * port[n]), round(1500 + 400 * starboard[n])])])  # fmt: skip
    mapping = tmp_path / "mapping.toml"
    assert main(["import", "--guess", str(tmp_path / "a.mcap"), "-o", str(mapping)]) == 0
    assert "seatrial import mcap" in capsys.readouterr().out
    [file] = import_log("mcap", tmp_path / "a.mcap", tmp_path / "out", mapping)
    got = read_trial(file)
    assert got.meta["sources"]["revolutions or thrust"].startswith("throttle_port, throttle_starboard")
