"""Logs of NMEA 2000 in every layout against what an own writer put in, and those of our own bus read back."""

from __future__ import annotations

import math
import struct
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest
from n2k_lines import EPOCH, HEADING, LAYOUTS, spaced

from seatrial.data import DataError
from seatrial.data.formats import n2k
from seatrial.data.n2k.groups import said
from seatrial.data.n2k.layouts import Packets, frame_of
from seatrial.data.nmea.ship import Fittings
from seatrial.realtime.links.n2k import GROUPS, SOURCE, identifier


def _heading(units: int, reference: int = 0, source: int = SOURCE, k: float = 0.0) -> str:
    data = struct.pack("<BHhhB", 1, units, 0x7FFF, 0x7FFF, 0xFC | reference)
    return f"({EPOCH + k:.6f}) can0 {identifier(127250, source):08X}#{data.hex()}"


def _written(path: Path, lines: list[str]) -> Path:
    path.write_text("\n".join(lines) + "\n", encoding="ascii")
    return path


@pytest.mark.parametrize("layout", LAYOUTS)
def test_each_layout_holds_the_frame_that_was_written(layout: str) -> None:
    frame = frame_of(LAYOUTS[layout](EPOCH, 127250, HEADING))
    assert frame is not None
    assert (frame.pgn, frame.source, frame.data) == (127250, SOURCE, HEADING)
    assert said(frame.pgn, frame.data) == {"psi": pytest.approx(1.7139, abs=1e-12)}


@pytest.mark.parametrize("cases", [4, pytest.param(1000, marks=pytest.mark.long)])
@pytest.mark.parametrize("layout", LAYOUTS)
def test_a_log_of_random_rates_and_gaps_equals_its_truth(layout: str, cases: int, tmp_path: Path) -> None:
    for seed in range(cases):
        _random_log(layout, np.random.default_rng(seed), tmp_path)


def _random_log(layout: str, rng: np.random.Generator, tmp_path: Path) -> None:
    step = rng.integers(20, 500) / 1000.0
    ticks = np.flatnonzero(rng.random(40) > 0.2)
    psi = rng.integers(0, 62831, len(ticks))
    delta = rng.integers(-6000, 6000, len(ticks))
    lines: list[str] = []
    for k, a, b in zip(ticks.tolist(), psi.tolist(), delta.tolist(), strict=True):
        t = EPOCH + k * step
        lines += [LAYOUTS[layout](t, 127250, struct.pack("<BHhhB", 1, a, 0x7FFF, 0x7FFF, 0xFC)),
                  LAYOUTS[layout](t, 127245, struct.pack("<BBhhH", 0, 0xFF, 0x7FFF, b, 0xFFFF))]  # fmt: skip
    trial = n2k.read(_written(tmp_path / "a.n2k", lines))
    assert np.allclose(trial.t, (ticks - ticks[0]) * step, atol=1e-4 if layout == "pcan" else 2e-6)
    assert np.allclose(np.cos(trial["psi"] - psi * 1e-4), 1.0, atol=1e-12)
    assert np.array_equal(trial["delta"], delta * 1e-4)


def test_what_the_bus_of_a_ship_sends_is_read_back_bit_for_bit(tmp_path: Path) -> None:
    fit = Fittings(rudders=("delta",), shafts=("n_P",))
    lines: list[str] = []
    truth: list[dict[str, float]] = []
    for k in range(30):
        known = {
            "delta": 0.01 * math.sin(k), "psi": 1.0 + 0.01 * k, "r": 0.01 * math.cos(k), "n_P": 1.5 - 0.1 * k,
            "u_w": 3.0 - 0.2 * k, "v_w": 0.1, "u": 3.1 - 0.2 * k, "v_m": -0.05 * k, "latitude": 35.0 + 1e-5 * k,
            "longitude": -139.0, "U": 3.0, "chi": 1.0, "U_A": 7.0 + 0.1 * k, "gamma_A": 0.5,
        }  # fmt: skip
        truth.append(known)
        for pgn, (_, frames) in GROUPS.items():
            lines += [LAYOUTS["candump -l"](EPOCH + k, pgn, data) for data in frames(known, fit, k)]
    trial = n2k.read(_written(tmp_path / "own.n2k", lines))
    units = {"delta": 1e-4, "psi": 1e-4, "r": 3.125e-8, "u": 1e-3, "v_m": 1e-3, "u_w": 1e-3, "U_A": 0.01}
    for name, unit in units.items():
        sent = np.array([round(one[name] / unit) for one in truth])
        assert np.array_equal(np.round(trial[name] / unit), sent), name
        assert np.max(np.abs(trial[name] - sent * unit)) < 1e-12
    turns = np.array([math.copysign(round(abs(one["n_P"]) * 240.0), one["n_P"]) for one in truth])
    assert np.array_equal(np.round(trial["n_P"] * 240.0), turns), "with the gear's sign astern"
    north = trial["x"] - trial["x"][0]
    assert np.allclose(north, 1e-5 * np.arange(30) * 110941.0, rtol=1e-3), "a degree of latitude at 35 deg is 110.94 km"


def test_one_device_tells_a_quantity_and_the_other_is_said(tmp_path: Path) -> None:
    lines = [_heading(psi, 0, source, k + 0.01 * source) for k in range(20) for source, psi in ((3, 10000), (9, 10349))]
    trial = n2k.read(_written(tmp_path / "two.n2k", lines))
    assert len(set(trial["psi"].tolist())) == 1
    assert "differs by +2 deg" in trial.meta["sources"]["heading"] or "-2 deg" in trial.meta["sources"]["heading"]


def test_two_rudders_are_port_and_starboard_whoever_tells_them(tmp_path: Path) -> None:
    """Instance 0 and 1 by one device each; a display repeats one of them as instance 252."""
    lines: list[str] = []
    for k in range(6):
        lines.append(_heading(10000 + k, k=k))
        for number, source, angle in ((0, 5, -1000), (1, 6, 2000), (252, 7, 900)):
            data = struct.pack("<BBhhH", number, 0xFF, 0x7FFF, angle + k, 0xFFFF)
            lines.append(f"({EPOCH + k:.6f}) can0 {identifier(127245, source):08X}#{data.hex()}")
    trial = n2k.read(_written(tmp_path / "twin.n2k", lines))
    assert np.allclose(trial["delta_1"], -0.1 + 1e-4 * np.arange(6), atol=1e-12)
    assert np.allclose(trial["delta_2"], 0.2 + 1e-4 * np.arange(6), atol=1e-12)
    assert "delta" not in trial


def test_magnetic_headings_need_a_variation(tmp_path: Path) -> None:
    lines = [_heading(10000, 1, k=k) for k in range(5)]
    with pytest.raises(DataError, match="magnetic"):
        n2k.read(_written(tmp_path / "m.n2k", lines))
    lines.append(LAYOUTS["candump -l"](EPOCH + 5, 127258, struct.pack("<BBHhH", 1, 0xF8, 20783, 716, 0xFFFF)))
    assert n2k.read(_written(tmp_path / "m.n2k", lines))["psi"] == pytest.approx(1.0716, abs=1e-12)


def test_the_date_of_a_clock_of_the_day_is_told_by_a_group(tmp_path: Path) -> None:
    """A clock nine hours ahead of UTC, over its midnight, which is 15:00 UTC."""
    noon = 1795651200.0 + 15 * 3600.0
    lines: list[str] = []
    for k in range(-3, 3):
        ahead, utc = noon + k + 9 * 3600.0, noon + k
        told = struct.pack("<BBHI", 1, 0xF0, int(utc // 86400), round(utc % 86400 * 1e4))
        head = struct.pack("<BHhhB", 1, 1000 + k, 0x7FFF, 0x7FFF, 0xFC)
        lines += [LAYOUTS["yacht devices"](ahead, 127250, head), LAYOUTS["yacht devices"](ahead, 126992, told)]
    trial = n2k.read(_written(tmp_path / "y.n2k", lines))
    assert np.array_equal(trial.t, np.arange(6.0))
    assert datetime.fromisoformat(trial.meta["start"]).timestamp() == noon - 3


def test_sentinels_are_gaps() -> None:
    for raw in (0xFFFF, 0xFFFE, 0xFFFD):
        assert said(127250, struct.pack("<BHhhB", 1, raw, 0, 0, 0xFC)) == {}
    for raw in (0x7FFF, 0x7FFE, 0x7FFD):
        assert said(127245, struct.pack("<BBhhH", 0, 0xFF, raw, raw, 0xFFFF)) == {}
    assert said(127245, struct.pack("<BBhhH", 0, 0xFF, 0x7FFF, 0x7FFC, 0xFFFF)) == {"delta_0": pytest.approx(3.2764)}


def test_a_fast_packet_with_a_lost_frame_is_left_out() -> None:
    data = bytes(range(12))
    parts = [bytes([0x40, 12]) + data[:6], bytes([0x41]) + data[6:] + b"\xff"]
    frames = [frame_of(f"(1.0) can0 {identifier(130578):08X}#{one.hex()}") for one in parts]
    first, second = frames
    assert first is not None
    assert second is not None
    packets = Packets()
    assert packets.whole(first) is None
    whole = packets.whole(second)
    assert whole is not None
    assert whole.data == data
    assert packets.whole(second) is None
    assert packets.lost == 1


def test_times_between_lines_and_clocks_that_go_back_are_refused(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="no time"):
        n2k.read(_written(tmp_path / "n.n2k", [f" can0  {identifier(127250):08X}   [8]  {spaced(HEADING)}"] * 3))
    steps = [0.1, 0.01, 0.1, 0.02, 0.1, 0.03]
    with pytest.raises(DataError, match="between lines"):
        n2k.read(_written(tmp_path / "d.n2k", [LAYOUTS["candump -ta"](t, 127250, HEADING) for t in steps]))
    with pytest.raises(DataError, match="line 3: the clock goes back by 50 s"):
        n2k.read(_written(tmp_path / "b.n2k", [LAYOUTS["plain"](EPOCH + t, 127250, HEADING) for t in (0, 60, 10, 20)]))


def test_a_clock_that_goes_back_parts_a_log_into_trials(tmp_path: Path) -> None:
    """Two runs of 90 s in the wrong order, each with its own headings; a stamp that is ahead once is refused."""

    def log(times: list[float]) -> Path:
        return _written(tmp_path / "p.n2k", [_heading(round(50 * t), k=t) for t in times])

    later, sooner = [300.0 + k for k in range(90)], [float(k) for k in range(91)]
    trials = n2k.read_all(log([*later, *sooner]))
    assert [(one.name, len(one)) for one in trials] == [("p_1", 90), ("p_2", 91)]
    for trial, times in zip(trials, (later, sooner), strict=True):
        assert trial["psi"] == pytest.approx(0.005 * np.array(times), abs=1e-12)
        assert any("line 91: the clock goes back by 389 s" in step for step in trial.meta["processing"])
        assert not any("doubt" in step for step in trial.meta["processing"])
    again = n2k.read_all(log([*sooner, *[30.0 + k for k in range(90)]]))
    assert all(any(step.startswith("doubt: it lies over") for step in one.meta["processing"]) for one in again)
    with pytest.raises(DataError, match="makes 2 trials of it; import it first"):
        n2k.read(log([*later, *sooner]))
    for wrong in ([120.0], [900.0, 901.0, 902.0]):
        with pytest.raises(DataError, match="the clock goes back by"):
            n2k.read_all(log([*sooner, *wrong, *[91.0 + k for k in range(90)]]))


def test_lines_that_an_ikonvert_has_glued_are_taken_apart(tmp_path: Path) -> None:
    lines = [LAYOUTS["ikonvert"](EPOCH + k, 127250, struct.pack("<BHhhB", 1, 1000 + k, 0x7FFF, 0x7FFF, 0xFC)) + end
             for k, end in enumerate(("$PDGY,000000,4,,5,482,1,0", "", "!PDGY,000000,3,,5,483,1,0", ""))]  # fmt: skip
    trial = n2k.read(
        _written(tmp_path / "g.n2k", ["$PDGY,000000,4,,5,481,1,0", lines[0], lines[1] + lines[2], lines[3]])
    )
    assert trial.t == pytest.approx([0.0, 1.0, 2.0, 3.0])
    assert trial["psi"] == pytest.approx(0.1 + 1e-4 * np.arange(4), abs=1e-12)
    assert trial.meta["lines"]["invalid"] == 0


@pytest.mark.parametrize("line", [
    "2026-11-26T12:00:00Z,2,127250,35,255,223,07", "(1.0) can0 09F11223#" + "00" * 400,
    "!PDGY,127250,2,35,255,1.0," + "A" * 3000, "$PCDIN,01F112,00000000,23,07F342FF7FCC02FD*00",
    "2026-13-26T12:00:00Z,2,127250,35,255,1,07", "99:99:99 R zzzzzzzz",
])  # fmt: skip
def test_wrong_counts_and_lengths_are_no_frames(line: str) -> None:
    assert frame_of(line) is None


@pytest.mark.parametrize("form", ["candump -l", "candump -ta"])
@pytest.mark.parametrize("off", [0, 500])
def test_two_buses_are_two_devices_of_one_address(tmp_path: Path, form: str, off: int) -> None:
    """Both buses in one log: one device that two interfaces hear is told once, two are compared."""
    lines = list[str]()
    for k in range(40):
        for bus, more in (("can0", 0), ("can1", off)):
            data = struct.pack("<BHhhB", 1, 10_000 + k + more, 0x7FFF, 0x7FFF, 0xFC)
            lines.append(LAYOUTS[form](EPOCH + 0.1 * k + 0.003 * (bus == "can1"), 127250, data).replace("can0", bus))
    trial = n2k.read(_written(tmp_path / "two.log", lines))
    assert trial.t == pytest.approx(0.1 * np.arange(40), abs=1e-5)
    assert trial["psi"] == pytest.approx(1.0 + 1e-4 * np.arange(40), abs=1e-9)
    said = trial.meta["sources"]["heading"]
    assert f"can1/{SOURCE}/127250 left aside, {'differs by +2.9 deg' if off else 'agrees'}" in said


def test_frames_of_fast_packets_on_two_buses_are_not_mixed() -> None:
    """A message of two frames each, whose frames come by turns."""
    packets, whole = Packets(), list[bytes]()
    for data in ("a00a010203040506", "a10708090affffff"):
        for bus in ("can0", "can1"):
            frame = frame_of(f"({EPOCH:.6f}) {bus} {identifier(129029):08X}#{data}")
            assert frame is not None
            if (one := packets.whole(frame)) is not None:
                whole.append(one.data)
    assert [one.hex() for one in whole] == ["0102030405060708090a"] * 2
    assert packets.lost == 0


def test_a_gear_makes_revolutions_of_the_shaft_of_those_of_the_engine(tmp_path: Path) -> None:
    """1450 rpm of the engine: 24.17 1/s as the shaft's with a doubt, 12.08 1/s by a gear of 2 to 1."""
    lines = [_heading(100 * k, k=k) for k in range(30)]
    engine = struct.pack("<BHHbH", 0, 5800, 0xFFFF, 0x7F, 0xFFFF).hex()
    lines += [f"({EPOCH + k:.6f}) can0 {identifier(127488):08X}#{engine}" for k in range(30)]
    log, mapping = _written(tmp_path / "a.log", sorted(lines)), tmp_path / "m.toml"
    plain = n2k.read(log)
    assert plain["n_P"] == pytest.approx(1450.0 / 60.0)
    assert any("gear = 2.0 in a mapping" in one for one in plain.meta["processing"])
    mapping.write_text('schema = "seatrial-nmea/1"\ngear = 2.0\n')
    geared = n2k.read(log, n2k.read_mapping(mapping))
    assert geared["n_P"] == pytest.approx(1450.0 / 120.0)
    assert not any("doubt" in one for one in geared.meta["processing"] if "revolutions" in one)
    mapping.write_text('schema = "seatrial-nmea/1"\ngear = 0.0\n')
    with pytest.raises(DataError, match="gear is 0"):
        n2k.read_mapping(mapping)
