"""Trials from the messages of a robot's log: an MCAP file, a bag of ROS 2 or of ROS 1.

A log that seatrial wrote gives the rows of its trial again (`exchange.robot_log`).  In another one the messages are
readings of instruments (`aboard`), and the trial is made of them by the rules of all logs of instruments.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from ...core.parameters import unknown
from .. import UNITS, Array, DataError, Trial, unwrapped
from ..instruments import trial_by
from ..sidecar import CONVENTIONS, began
from ..units import standard_unit
from .aboard import Aboard
from .files import opened
from .messages import FIX, ODOMETRY, READ, TWIST, VELOCITY
from .series import Series, gathered
from .topics import Number, Topics


def read(source: Path, mapping: Topics | None = None) -> Trial:
    """Read one log."""
    topics, ignored = mapping or Topics(), Counter[str]()
    asked = [one for one in (topics.odometry, topics.twist, topics.fix) if one is not None]
    with opened(source) as bag:
        series = gathered(source, bag, ignored, [*asked, *topics.axes])
    numbers = [topic + ("" if name == "value" else name) for topic, one in series.items() for name in one.columns
               if READ[one.kind][0] in ("Num", "Out")]  # fmt: skip
    for topic in topics.numbers:
        if topic not in numbers:
            raise DataError(f"{source}: {unknown(topic, numbers, 'topic of numbers')}")
    steps = [f"imported from {', '.join(f'{t} ({series[t].kind})' for t in sorted(series))}"]
    steps += [f"doubt: {one}" for one in bag.lost]
    if bag.note:
        return _again(source, bag.note, series, topics).noting(*steps)
    return _foreign(source, series, topics, ignored, steps)


def _foreign(
    path: Path, series: Mapping[str, Series], topics: Topics, ignored: Counter[str], steps: list[str]
) -> Trial:  # fmt: skip
    """The trial of a log that others wrote."""
    aboard = Aboard(path, series, topics)
    aboard.heard.ignored.update(ignored)
    aboard.listen()
    if not aboard.heard.told():
        seen = ", ".join(sorted({*series, *ignored})) or "no message"
        raise DataError(f"{path}: nothing of a ship's motion; found {seen[:200]}")
    trial = trial_by(path, aboard.heard, "messages of robots", topics, aboard.epoch, [*steps, *aboard.steps],
                     plain=aboard.plain, digits=9, base="psi")  # fmt: skip
    frames = {"frames": aboard.frames} if aboard.frames else {}
    return replace(trial, meta={**trial.meta, **frames})


def _again(path: Path, note: Mapping[str, Any], series: Mapping[str, Series], topics: Topics) -> Trial:
    """The trial of a log that seatrial wrote: a row for each stamp, and each number on its own."""
    stamps = [np.array(one.times) for one in series.values()]
    ticks = np.unique(np.concatenate(stamps)) if stamps else np.zeros(0, dtype=np.int64)
    if ticks.size < 2:
        raise DataError(f"{path}: no two messages define rows; found {', '.join(sorted(series)) or 'none'}")

    def on_rows(one: Series, name: str) -> Array:
        out = np.full(ticks.size, math.nan)
        out[np.searchsorted(ticks, np.array(one.times))] = one.column(name)
        return out

    channels: dict[str, Array] = {}
    for topic, one in series.items():
        mapped = topics.numbers.get(topic, Number(topic.rpartition("/")[2]))
        names = {ODOMETRY: ("x", "y", "psi", "phi", *VELOCITY), TWIST: VELOCITY, FIX: ()}.get(one.kind)
        said = {name: on_rows(one, name) for name in names if name in one.columns} if names is not None else {
            mapped.channel: mapped.of(on_rows(one, "value"))}  # fmt: skip
        for name, values in said.items():
            there = channels.get(name)
            channels[name] = values if there is None else np.where(np.isfinite(there), there, values)
    if "phi" in channels and not np.nan_to_num(channels["phi"]).any():
        del channels["phi"]
    if "psi" in channels:
        channels["psi"] = unwrapped(channels["psi"])
    meta: dict[str, Any] = {**CONVENTIONS, **note.get("meta", {}), **topics.meta}
    if topics.datum is not None:
        meta["datum"] = asdict(topics.datum)
    known = {name: values for name, values in channels.items() if np.isfinite(values).any()}
    mapped = {one.channel: one.si for one in topics.numbers.values()}
    units = {name: mapped.get(name) or note.get("units", {}).get(name, standard_unit(name) or "-")
             for name in known if name not in UNITS}  # fmt: skip
    zero = began(path, note.get("meta", {}))
    return Trial(path.stem, (ticks - zero) / 1e9, known, units, meta)
