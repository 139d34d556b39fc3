"""Frames of NMEA 2000 as loggers write them, each layout by an own writer."""

from __future__ import annotations

import base64
from collections.abc import Callable
from datetime import UTC, datetime
from functools import reduce
from operator import xor

from seatrial.realtime.links.n2k import identifier

EPOCH = 1795694400.25
HEADING = bytes.fromhex("07f342ff7fcc02fc")
"""1.7139 rad true, and a variation of 0.0716 rad, which is not to be added."""


def _iso(t: float, mark: str = "T") -> str:
    return datetime.fromtimestamp(t, UTC).strftime(f"%Y-%m-%d{mark}%H:%M:%S.%f")


def spaced(data: bytes, mark: str = " ") -> str:
    return mark.join(f"{one:02x}" for one in data)


def _clock(t: float) -> str:
    return _iso(t)[11:]


def _pcdin(t: float, pgn: int, data: bytes) -> str:
    body = f"PCDIN,{pgn:06X},{round((t - EPOCH) * 1000):08X},23,{data.hex().upper()}"
    return f"${body}*{reduce(xor, body.encode()):02X}"


LAYOUTS: dict[str, Callable[[float, int, bytes], str]] = {
    "plain": lambda t, pgn, d: f"{_iso(t)}Z,2,{pgn},35,255,{len(d)},{spaced(d, ',')}",
    "plain, old": lambda t, pgn, d: f"{_iso(t, '-')},2,{pgn},35,255,{len(d)},{spaced(d, ',')}",
    "candump -l": lambda t, pgn, d: f"({t:.6f}) can0 {identifier(pgn):08X}#{d.hex().upper()}",
    "candump -ta": lambda t, pgn, d: f" ({t:.6f})  can0  {identifier(pgn):08X}   [{len(d)}]  {spaced(d).upper()}",
    "candump -tA": lambda t, pgn, d: f" ({_iso(t, ' ')})  can0  {identifier(pgn):08X}   [{len(d)}]  {spaced(d)}",
    "candump -x": lambda t, pgn, d: f" ({t:.6f})  can0  RX - -  {identifier(pgn):08X}   [{len(d)}]  {spaced(d)}",
    "candump, no brackets": lambda t, pgn, d: f"{_iso(t, ' ')}  can0  {identifier(pgn):08X}  [{len(d)}]  {spaced(d)}",
    "yacht devices": lambda t, pgn, d: f"{_clock(t)} R {identifier(pgn):08X} {spaced(d).upper()}",
    "actisense": lambda t, pgn, d: f"A{_clock(t).replace(':', '')} 23FF2 {pgn:05X} {d.hex().upper()}",
    "ikonvert": lambda t, pgn, d: f"!PDGY,{pgn},2,35,255,{t - EPOCH:.6f},{base64.b64encode(d).decode().rstrip('=')}",
    "seasmart": _pcdin,
    "airmar": lambda t, pgn, d: f"{_iso(t)} - {pgn} {identifier(pgn):08x} {spaced(d, ',')}",
    "pcan": lambda t, pgn, d: f"  2)  {(t - EPOCH) * 1000:.1f}  Rx  {identifier(pgn):08X}  {len(d)}  {spaced(d)}",
    "vector": lambda t, pgn, d: f"{t - EPOCH:11.6f} 1  {identifier(pgn):X}x       Rx   d {len(d)} {spaced(d).upper()}",
    "vector, told more": lambda t, pgn, d: f"{t - EPOCH:11.6f} 1  {identifier(pgn):X}x  Tx   d {len(d)} {spaced(d)} "
                                           f" Length = 273910 BitCount = 141 ID = {identifier(pgn)}x",
    "savvycan": lambda t, pgn, d: f"{round((t - EPOCH) * 1e6)},{identifier(pgn):08X},true,Rx,0,8,{spaced(d, ',')},",
    "savvycan, old": lambda t, pgn, d: f"{round((t - EPOCH) * 1e6)},{identifier(pgn):08X},true,0,8,{spaced(d, ',')},",
    "python-can": lambda t, pgn, d: f"{t:.6f},0x{identifier(pgn):x},1,0,0,8,{base64.b64encode(d).decode()}",
}  # fmt: skip
