"""Records of Yacht Devices: frames that an own writer puts into them come back, over minutes, silence and damage."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from n2k_records import clock, fix, heading, record

from seatrial.data.formats import n2k
from seatrial.data.n2k.layouts import frame_of
from seatrial.data.n2k.recorder import lines
from seatrial.realtime.links.n2k import SOURCE

SERVICE = struct.pack("<I", 0xFFFFFFFF) + b"YDVR v05"
ORDER = struct.pack("<I", 0x18EAFF23) + bytes.fromhex("14f001")
"""An order for group 126996 to all."""
def of(raw: bytes) -> list[tuple[float, int, bytes]]:
    """Stamps, groups and bytes of the frames in the lines."""
    found = [frame_of(line.decode()) for block in lines(raw) for line in block.splitlines()]
    assert all(one is not None and one.clock == "start" and one.source == SOURCE for one in found)
    return [(one.t, one.pgn, one.data) for one in found if one is not None]


@pytest.mark.parametrize("step", [60.0, 65.536])
@pytest.mark.parametrize("seed", range(3))
def test_frames_come_back_with_their_times(step: float, seed: int) -> None:
    draw = np.random.default_rng(seed)
    t = np.cumsum(np.round(draw.uniform(0.2, 0.7, 600), 3))
    bodies = [(heading(int(draw.integers(60000))), fix(10.0 + 1e-4 * k, 20.0, now), SERVICE, ORDER)[
        draw.choice(4, p=[0.6, 0.2, 0.1, 0.1])] for k, now in enumerate(t)]  # fmt: skip
    found = of(b"".join(record(now, body, step) for now, body in zip(t, bodies, strict=True)))
    there = [(now, body) for now, body in zip(t, bodies, strict=True) if body is not SERVICE]
    assert [one[0] for one in found] == pytest.approx([now for now, _ in there], abs=1e-3)
    for (_, pgn, data), (_, body) in zip(found, there, strict=True):
        expected = {127250: body[4:], 129029: body[6:], 59904: body[4:]}
        assert data == expected[pgn]


def test_minutes_of_silence_are_put_back_by_the_clock_of_the_bus() -> None:
    before, after = np.arange(0.0, 30.0), np.arange(250.0, 300.0)  # four minutes in a marina
    t = np.concatenate([before, after])
    raw = b"".join(record(now, clock(now)) + record(now, heading(round(100 * now))) for now in t)
    headings = [(now, data) for now, pgn, data in of(raw) if pgn == 127250]
    assert [now for now, _ in headings] == pytest.approx(t.tolist(), abs=1e-3)


def test_damage_costs_the_records_that_it_hits() -> None:
    raw = bytearray(b"".join(record(0.5 * k, heading(k)) for k in range(100)))
    raw[14 * 50 : 14 * 50 + 9] = b"\xff" * 9
    found = of(bytes(raw))
    assert 96 <= len(found) <= 99
    assert {one[2][1] for one in found} <= set(range(100))
    assert len(of(bytes(raw[: 14 * 20 + 5]))) == 20  # cut off within a record
    assert of(b"") == []


@pytest.mark.slow
def test_a_log_is_read_with_its_date_and_its_fast_packets(tmp_path: Path) -> None:
    path, psi = tmp_path / "00010001.DAT", 0.5 + 0.01 * np.arange(300)
    raw = record(0.0, SERVICE)
    for k, angle in enumerate(psi):
        raw += record(k, clock(k)) if k % 10 == 0 else b""
        raw += record(k + 0.001, heading(round(1e4 * angle))) + record(k + 0.002, fix(63.0 + 1e-5 * k, 10.0, k))
    path.write_bytes(raw)
    trial = n2k.read(path)
    assert trial["psi"][np.isfinite(trial["psi"])] == pytest.approx(psi, abs=1e-4)
    assert trial["x"][np.isfinite(trial["x"])][-1] == pytest.approx(299e-5 * 111420.0, rel=2e-3)
    assert str(trial.meta["start"]).startswith("2026-11-26T11:59:59.999")
