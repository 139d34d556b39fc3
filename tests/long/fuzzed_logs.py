"""Logs of every format for `test_fuzz`, written by the writers of the formats' own tests."""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial
from importlib import import_module
from pathlib import Path

import numpy as np
from scipy.io import savemat

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT / "tests" / "data" / part) for part in (".", "formats", "n2k", "sheets")]

from mat_by_hand import Version5, version73  # noqa: E402
from n2k_json import sailed  # noqa: E402
from n2k_lines import EPOCH, HEADING, LAYOUTS  # noqa: E402
from n2k_records import clock, fix, heading, record  # noqa: E402
from recorded import Ship as Weaving  # noqa: E402
from recorded import Speaker, ticks, write_ros1  # noqa: E402
from telemetry import Link, quaternion, tlog, ulog  # noqa: E402

Made = Callable[[Path], Path]
Kind = tuple[Made, Callable[[Path, Path], list[str]]]
T = 0.5 * np.arange(60)
PSI = 0.3 * np.sin(0.1 * T)
SUFFIXES = {"dataflash": ".bin", "gpx": ".gpx", "moos": ".alog", "n2k": ".n2k", "novatel": ".gps", "signalk": ".jsonl"}


def bytes_of(name: str, content: bytes, folder: Path) -> Path:
    (folder / name).write_bytes(content)
    return folder / name


def example(format: str, folder: Path) -> Path:
    """The short log that the module of a text format gives."""
    text = import_module(f"seatrial.data.formats.{format}").EXAMPLE
    return bytes_of(f"log{SUFFIXES[format]}", text if isinstance(text, bytes) else text.encode(), folder)


def frames(layout: str, folder: Path) -> Path:
    lines = [LAYOUTS[layout](EPOCH + t, 127250, HEADING) for t in T.tolist()]
    return bytes_of("log.n2k", "\n".join(lines).encode() + b"\n", folder)


def messages(folder: Path) -> Path:
    return bytes_of("log.json", "\n".join(sailed(degrees=True)[:200]).encode() + b"\n", folder)


def recorder(folder: Path) -> Path:
    bodies = [record(t, body) for t in T.tolist() for body in (clock(t), heading(9000), fix(59.0 + 1e-5 * t, 10.0, t))]
    return bytes_of("log.dat", b"".join(bodies), folder)


def px4(folder: Path) -> Path:
    attitude = [(t, *quaternion(psi)) for t, psi in zip(T.tolist(), PSI.tolist(), strict=True)]
    place = [(t, 1.5 * t, 0.1 * t, 1.5, 0.1) for t in T.tolist()]
    return bytes_of("log.ulg", ulog({
        "vehicle_attitude": ("float[4] q", attitude),
        "vehicle_local_position": ("float x;float y;float vx;float vy", place),
    }), folder)  # fmt: skip


def mavlink(folder: Path) -> Path:
    link = Link()
    for t, psi in zip(T.tolist(), PSI.tolist(), strict=True):
        link.attitude(EPOCH + t, t, psi, 0.01)
        link.place(EPOCH + t, t, 59.0 + 1e-5 * t, 10.0, 1.5, 0.1)
    return bytes_of("log.tlog", tlog(link), folder)


def ros1(folder: Path) -> Path:
    ship, speaker, t = Weaving(), Speaker(ros1=True), T[:40]
    north, east = ship.place(t)
    values = zip(ticks(t), north.tolist(), east.tolist(), ship.psi(t).tolist(), strict=True)
    write_ros1(folder / "log.bag", [speaker.pose("/pose", *row) for row in values])
    return folder / "log.bag"


COLUMNS = {"Time": T, "Heading": np.degrees(PSI) % 360.0, "X": 1.5 * T, "Y": 0.1 * T, "Rudder": 5.0 * np.cos(T)}


def matlab(folder: Path) -> Path:
    savemat(folder / "log.mat", COLUMNS)
    return folder / "log.mat"


def matlab_by_hand(folder: Path) -> Path:
    return bytes_of("log.mat", Version5().file({"log": COLUMNS}), folder)


def hdf(folder: Path) -> Path:
    return bytes_of("log.mat", version73({"log": COLUMNS}), folder)


def arrays(folder: Path) -> Path:
    np.savez(folder / "log.npz", **COLUMNS)
    return folder / "log.npz"


def labview(folder: Path) -> Path:
    head = ["LabVIEW Measurement\t", "Writer_Version\t2", "Reader_Version\t2", "Separator\tTab", "Multi_Headings\tNo",
            "X_Columns\tOne", "Date\t2026/05/04", "Time\t10:00:00", "***End_of_Header***\t", "\t",
            "Channels\t4\t\t\t\t", "Samples\t60\t60\t60\t60\t", "***End_of_Header***\t\t\t\t\t",
            "X_Value\tHeading\tX\tY\tRudder\tComment"]  # fmt: skip
    rows = ["\t".join([*(f"{one:.6f}" for one in row), ""]) for row in zip(*COLUMNS.values(), strict=True)]
    return bytes_of("log.lvm", "\n".join([*head, *rows]).encode() + b"\n", folder)


def imported(format: str) -> Callable[[Path, Path], list[str]]:
    return lambda file, out: ["import", format, str(file), "-o", str(out)]


def guessed(file: Path, out: Path) -> list[str]:
    return ["import", "--guess", str(file), "-o", str(out.with_suffix(".toml"))]


LOGS: dict[str, Kind] = {
    **{f"log, {name}": (partial(example, name), imported(name)) for name in SUFFIXES},
    **{f"frames, {name}": (partial(frames, name), imported("n2k")) for name in LAYOUTS},
    "messages, json": (messages, imported("n2k")),
    "messages, guessed": (messages, guessed),
    "records of a recorder": (recorder, imported("n2k")),
    "ulog": (px4, imported("ulog")),
    "tlog": (mavlink, imported("tlog")),
    "rosbag1": (ros1, imported("rosbag1")),
    "arrays, mat": (matlab, guessed),
    "arrays, mat of structures": (matlab_by_hand, guessed),
    "arrays, hdf": (hdf, guessed),
    "arrays, npz": (arrays, guessed),
    "lvm": (labview, guessed),
}
