"""Trials as logs of robots: MCAP files, and bags of ROS 2."""

from __future__ import annotations

import math
import shutil
from collections.abc import Iterator, Mapping, Sequence
from heapq import merge
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..data import UNITS, Array, DataError, Trial
from ..data.geodesy import Datum
from ..data.robot.files import write_bag, write_mcap
from ..data.robot.messages import FIX, FRAMES, NUMBER, ODOMETRY, POSE, TWIST, VELOCITY, Message, packed
from ..data.sidecar import began, plain_meta, sidecar_text

FORMATS = ("mcap", "rosbag2")
"""Formats that can be written."""

TOPICS: Mapping[str, str] = {ODOMETRY: "/odom", FIX: "/fix", TWIST: "/twist"}
"""Topics of the motion; every other channel goes out as a number on a topic of its own name."""


def save_robot_log(trial: Trial, format: str, folder: Path) -> Path:
    """Write a trial as `folder/<name>.mcap`, or as the bag `folder/<name>`.

    Raises:
        DataError: times that no stamp can hold, or a bag that is there already.
    """
    path = folder / (f"{trial.name}.mcap" if format == "mcap" else trial.name)
    sidecar_text(path, trial.meta)  # refuses what no file can hold
    if format != "mcap" and path.exists():
        raise DataError(f"{path}: is there already; remove it or choose another folder with -o")
    units = {name: trial.unit(name) for name in trial.channels if name not in UNITS}
    note = {"name": trial.name, "meta": plain_meta(path, trial.meta), "units": units}
    scratch = folder / f".{path.name}.part"
    try:
        scratch.mkdir(exist_ok=True)
        (write_mcap if format == "mcap" else write_bag)(scratch / path.name, messages(trial), note)
        (scratch / path.name).replace(path)
    except OSError as error:
        raise DataError(f"{path}: cannot be written: {error.strerror}") from None
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
    return path


def messages(trial: Trial) -> Iterator[Message]:
    """All messages of a trial in the order of time, each of them whole.

    A row that lacks a part of the pose has no odometry, and one that lacks a velocity no twist, as no reader expects
    NaN there; what it has of them goes out as numbers on topics of their own, like every other channel.
    """
    stamps = _stamps(trial)
    frames = {**FRAMES, **{str(k): str(v) for k, v in dict(trial.meta.get("frames") or {}).items() if k in FRAMES}}
    topics: list[tuple[str, str, dict[str, Array]]] = []
    left = dict(trial.channels)
    if all(name in trial for name in POSE):
        placed = _whole(trial, POSE)
        pose = {name: np.where(placed, trial[name], math.nan) for name in (*POSE, "phi") if name in trial}
        moving = {name: trial[name] for name in VELOCITY if name in trial}
        topics += [(TOPICS[ODOMETRY], ODOMETRY, {**pose, **moving}), *_fixes(trial)]
        left |= {name: np.where(placed, math.nan, trial[name]) for name in (*POSE, "phi") if name in trial}
    if all(name in trial for name in VELOCITY):
        known = _whole(trial, VELOCITY)
        topics.append((TOPICS[TWIST], TWIST, {n: np.where(known, trial[n], math.nan) for n in VELOCITY}))
        left |= {name: np.where(known, math.nan, trial[name]) for name in VELOCITY}
    topics += [(f"/{name}", NUMBER, {"value": column}) for name, column in left.items()]
    streams = [_stream(topic, kind, stamps, columns, frames) for topic, kind, columns in topics]
    return merge(*streams, key=lambda message: message.logged)


def _stream(
    topic: str, kind: str, stamps: list[int], columns: Mapping[str, Array], frames: Mapping[str, str]
) -> Iterator[Message]:
    names = tuple(columns)
    for stamp, row in zip(stamps, zip(*(column.tolist() for column in columns.values()), strict=True), strict=True):
        told = {name: value for name, value in zip(names, row, strict=True) if math.isfinite(value)}
        if all(name in told for name in (POSE if kind == ODOMETRY else names)):
            yield Message(topic, kind, stamp, packed(kind, stamp, told, frames))


def _whole(trial: Trial, names: Sequence[str]) -> NDArray[np.bool_]:
    """Rows that have all of the channels."""
    return np.asarray(np.isfinite(trial.stack(*names)).all(axis=1))


def _fixes(trial: Trial) -> list[tuple[str, str, dict[str, Array]]]:
    """The position of midship on the globe, where the trial gives its origin."""
    said: Any = trial.meta.get("datum")
    try:
        datum = Datum(float(said["latitude"]), float(said["longitude"]))
    except (TypeError, KeyError, ValueError):
        return []
    places = np.full((len(trial), 2), math.nan)
    for k in np.flatnonzero(np.isfinite(trial["x"] + trial["y"])).tolist():
        places[k] = datum.place(float(trial["x"][k]), float(trial["y"][k]))
    return [(TOPICS[FIX], FIX, {"latitude": places[:, 0], "longitude": places[:, 1]})]


def _stamps(trial: Trial) -> list[int]:
    """Times [ns]: since 1970 where the trial gives its start, else since its start."""
    first = began(trial.name, trial.meta)
    stamps = [first + round(1e9 * t) for t in trial.t.tolist()]
    if any(not 0 <= stamp < 2**31 * 10**9 for stamp in stamps[:1] + stamps[-1:]):
        raise DataError(f"{trial.name}: begins at {trial.t[0]:g} s; stamps count from zero, so begin there or later")
    return stamps
