"""Frames and readings of many lines together are those of each line alone, to the bit, also of damaged lines."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from seatrial.data.formats import n2k
from seatrial.data.n2k.frames import frames
from seatrial.data.n2k.groups import FAST, PGNS, all_said, said
from seatrial.data.n2k.layouts import frame_of
from seatrial.data.nmea.digits import WIDEST

SLOW, LONG = pytest.param(25, marks=pytest.mark.slow), pytest.param(1000, marks=pytest.mark.long)
JUNK = "0123456789abcfgABCF.,:# ()RTZ-"


def line(
    draw: np.random.Generator, layout: int, k: int, groups: Sequence[int] = (*PGNS, 127505), damaged: float = 0.125
) -> str:  # fmt: skip
    """A line of candump -l, Yacht Devices RAW or canboat, some of them damaged."""
    pgn, data = int(draw.choice(groups)), draw.bytes(int(draw.choice([8, 8, 8, 6, 2])))
    number = 0x08000000 | pgn << 8 | int(draw.integers(0, 4)) | (int(draw.integers(0, 8)) << 26)
    clock = f"{23 + k // 80:02d}:{k // 60 % 60:02d}:{k % 60:02d}"
    text = (
        f"({1795694400 + k}.{draw.integers(0, 10**6):06d}) can0 {number:08X}#{data.hex().upper()}",
        f"{clock}.{draw.integers(0, 1000):03d} R {number:08X} {data.hex(' ').upper()}",
        f"2026-11-26T{clock}.{draw.integers(0, 1000):03d}Z,{draw.integers(0, 8)},{pgn},{draw.integers(0, 254)},255,"
        f"{len(data)},{data.hex(',')}",
    )[layout]
    if draw.random() < damaged:
        at = int(draw.integers(0, len(text)))
        text = text[:at] + JUNK[draw.integers(0, len(JUNK))] + text[at + int(draw.integers(0, 2)) :]
    return text


@pytest.mark.parametrize("cases", [3, SLOW, LONG])
@pytest.mark.parametrize("layout", range(3))
def test_frames_of_many_lines_are_those_of_each(layout: int, cases: int) -> None:
    together = 0
    for seed in range(cases):
        draw = np.random.default_rng(seed)
        lines = [line(draw, layout, k) for k in range(160)]
        raw = np.frombuffer("\n".join([*lines, ""]).encode() + bytes(WIDEST), np.uint8)
        end = np.flatnonzero(raw == ord("\n"))
        for found in frames(raw, np.append(0, end[:-1] + 1), end):
            for k, frame in found.one_by_one():
                assert frame == frame_of(lines[k]), (seed, lines[k])
            together += len(found)
    assert together > 40 * cases


@pytest.mark.parametrize("pgn", sorted(PGNS - FAST))
def test_readings_of_many_messages_are_those_of_each(pgn: int) -> None:
    """Sentinels and codes of every kind, and messages that are too short."""
    draw = np.random.default_rng(pgn)
    for width in (0, 1, 2, 5, 8):
        data = draw.integers(0, 256, (300, width)).astype(np.uint8)
        data[draw.random(data.shape) < 0.3] = 255
        data[draw.random(data.shape) < 0.1] = 127
        seen = list[int]()
        for rows, values in all_said(pgn, data):
            for at, row in enumerate(rows.tolist()):
                every = {name: float(np.broadcast_to(value, len(rows))[at]) for name, value in values.items()}
                assert {n: v for n, v in every.items() if not math.isnan(v)} == said(pgn, data[row].tobytes())
            seen += rows.tolist()
        assert sorted(seen) == list(range(300))


@pytest.mark.slow
def test_blocks_of_any_size_tell_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    draw, path = np.random.default_rng(1), tmp_path / "a.n2k"
    path.write_text("\r\n".join(line(draw, 0, k, sorted(PGNS - {129025, 129029}), 0.0) for k in range(400)), newline="")
    whole = n2k.read(path)
    for size in (1000, 4001):
        monkeypatch.setattr(n2k, "_BLOCK", size)
        parts = n2k.read(path)
        assert np.array_equal(parts.t, whole.t)
        assert all(np.array_equal(parts[name], whole[name], equal_nan=True) for name in whole.channels)
        assert parts.meta == whole.meta
