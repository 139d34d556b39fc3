"""Logs of instruments: NMEA 0183 of 60 sentences a second, and NMEA 2000 by candump, in MB/s of one core.

    python benchmarks/import_instruments.py [SECONDS]

The ratio is that of many lines at a time to the same lines one by one, within one run.  Memory is the peak of a log
three times as long beyond that of the log, over the numbers that it holds more (place, stamp, values).
"""

from __future__ import annotations

import math
import sys
import tempfile
import time
import tracemalloc
from collections.abc import Callable
from datetime import datetime, timedelta
from pathlib import Path

from timing import publish

from seatrial.data.formats import n2k, nmea
from seatrial.data.nmea.lines import _Ear, listen  # pyright: ignore[reportPrivateUsage]
from seatrial.data.nmea.sentences import checksum

BEGUN = datetime(2026, 5, 1, 10)


def arc(value: float, width: int) -> str:
    return f"{int(value):0{width}d}{value % 1 * 60:09.6f}"


def sentences(k: int) -> bytes:
    """Six sentences of a tenth of a second, behind TAG blocks with a stamp."""
    t = 0.1 * k
    now = BEGUN + timedelta(seconds=t)
    clock = f"{now:%H%M%S}.{now.microsecond // 10000:02d}"
    fix, psi = f"{arc(35 + 1e-5 * t, 2)},N,{arc(139 + 1.3e-5 * t, 3)},E", 0.5 * t % 360
    said = (
        f"GPRMC,{clock},A,{fix},{9.7 + 0.1 * math.sin(t):.3f},{psi:.2f},010526,,,A",
        f"GPGGA,{clock},{fix},4,12,0.9,12.3,M,36.5,M,,", f"HEHDT,{psi:.2f},T", f"TIROT,{30 + math.sin(t):.2f},A",
        f"RCRSA,{10 * math.sin(t / 7):.1f},A,,V", f"RCRPM,S,0,{80 + math.sin(t):.1f},,A",
    )  # fmt: skip
    tag = f"s:GP0001,c:{1777629600000 + 100 * k}".encode()
    head = b"\\" + tag + b"*" + checksum(tag).encode() + b"\\"
    return b"".join(head + b"$" + one.encode() + b"*" + checksum(one.encode()).encode() + b"\r\n" for one in said)


def frames(k: int) -> bytes:
    """Heading, rate, rudder, position, course and engine of a tenth of a second, as candump -l writes them."""
    t = 0.1 * k
    whole = lambda value, size: int(value).to_bytes(size, "little", signed=value < 0).hex().upper()  # noqa: E731
    said = (
        ("09F11223", f"07{whole(0.5e4 * t % 62831, 2)}FF7FFF7FFC"), ("09F11323", f"07{whole(2.8e5, 4)}FFFFFF"),
        ("09F10D23", f"00FFFF7F{whole(1500 * math.sin(t / 7), 2)}FFFF"),
        ("09F80123", whole(3.5e8 + 100 * t, 4) + whole(1.39e9 + 130 * t, 4)), ("09F80223", "07FCDC440202FFFF"),
        ("09F20023", "00A816FFFF7FFFFF"), ("09F20123", "0000FFFFFFFFFFFF"),
    )  # fmt: skip
    return b"".join(
        f"({1777629600 + t + 0.001 * n:.6f}) can0 {id_}#{data}\n".encode() for n, (id_, data) in enumerate(said)
    )


def processor(work: Callable[[], object], times: int = 5) -> float:
    """Least processor time of several runs [s]."""
    out = list[float]()
    for _ in range(times):
        begun = time.process_time()
        work()
        out.append(time.process_time() - begun)
    return min(out)


def peak(path: Path) -> int:
    tracemalloc.start()
    listen(path)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return most


def main() -> None:
    """Measure and print."""
    ticks = 10 * int(next((a for a in sys.argv[1:] if a.isdigit()), "3600"))
    with tempfile.TemporaryDirectory() as made:
        log, bus, short, long = (Path(made) / name for name in ("a.nmea", "a.log", "b.nmea", "c.nmea"))
        for path, say, count in ((log, sentences, ticks), (bus, frames, ticks), (short, sentences, 3000),
                                 (long, sentences, 9000)):  # fmt: skip
            path.write_bytes(b"".join(say(k) for k in range(count)))
        few = short.read_bytes().replace(b"\r\n", b"\n").splitlines()
        slow = processor(lambda: _Ear(None)._line_by_line([*enumerate(few)], 0), 2)
        quick, whole, can = (
            processor(lambda: listen(short)),
            processor(lambda: nmea.read(log)),
            processor(lambda: n2k.read(bus), 2),
        )
        more, size, sizes = (peak(long) - peak(short)) / 36_000, log.stat().st_size / 1e6, bus.stat().st_size / 1e6
    publish("import_instruments", [
        {"what": f"NMEA 0183, {size:.0f} MB to a trial", "value": size / whole, "unit": "MB/s", "bar": "at least 20"},
        {"what": "many lines at a time to one by one", "value": slow / quick, "unit": "-", "bar": "-"},
        {"what": "memory a sentence of a longer log", "value": more, "unit": "bytes", "bar": "at most 200"},
        {"what": f"NMEA 2000 by candump, {sizes:.0f} MB to a trial", "value": sizes / can, "unit": "MB/s", "bar": "-"},
    ])  # fmt: skip


if __name__ == "__main__":
    main()
