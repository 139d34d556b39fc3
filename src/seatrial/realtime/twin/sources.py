"""Rows for a twin: from a trial, or from sentences as they come in by UDP."""

from __future__ import annotations

import math
import socket
import time
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ...data import Array, DataError, Trial
from ...data.formats.nmea import Aboard, controls, felt_at_midship
from ...data.geodesy import Datum
from ...data.nmea.framing import read_line, split
from ...data.nmea.heard import hear
from ...data.nmea.readings import readings
from ...data.nmea.sentences import NmeaError
from ...data.nmea.sources import GROUP_OF, rank
from ...identify.noise import resolution, sensor_noise

Row = tuple[float, Mapping[str, float]]
"""Time [s], and readings by channel, SI units; one without an entry has none."""

# Noise is no less than this share of the change from reading to reading: a log without any is a simulation.
_LEAST = 1e-2
# A source that has been silent for so long leaves its readings to another one [s].
_SILENT = 5.0


def moving(channels: Mapping[str, Array]) -> dict[str, Array]:
    """Channels of a trial with course and speed over ground as components, v_north and v_east."""
    out = dict(channels)
    if "U_G" in out and "gamma_G" in out:
        out["v_north"], out["v_east"] = out["U_G"] * np.cos(out["gamma_G"]), out["U_G"] * np.sin(out["gamma_G"])
    return out


def rows_of(trial: Trial) -> Iterator[Row]:
    """The rows of a trial."""
    channels = moving(trial.channels)
    names, table = tuple(channels), np.column_stack(list(channels.values())).tolist()
    for t, row in zip(trial.t.tolist(), table, strict=True):
        yield t, {name: value for name, value in zip(names, row, strict=True) if math.isfinite(value)}


def noise_of(trial: Trial) -> dict[str, float]:
    """Noise of the readings of a trial by channel, from their scatter; of both components of a pair the larger."""
    found: dict[str, float] = {}
    for name, values in moving(trial.channels).items():
        if name not in ("x", "y", "psi", "r", "u_w", "v_north", "v_east"):
            continue
        known = values[np.isfinite(values)]
        known = np.unwrap(known) if name == "psi" else known
        level = sensor_noise(known) if known.size else math.nan
        if math.isfinite(level):
            found[name] = max(level, _LEAST * float(np.std(np.diff(known))), 0.5 * resolution(known), 1e-9)
    for a, b in (("x", "y"), ("v_north", "v_east")):
        if a in found and b in found:
            found[a] = found[b] = max(found[a], found[b])
    return found


class Ear:
    """Sentences gathered to rows.

    A quantity that several sources tell (position in RMC and GGA, heading of two gyros) is taken from one, talker and
    kind, the first of those that speak in the order of `data.nmea.sources`: a reading that comes twice would count
    twice.  The source in a TAG block parts two of one talker.  A magnetic compass tells heading once the variation is
    known, by the mapping or by a sentence.

    Attributes:
        wrong: lines that were no valid sentence.
        datum: where x and y are zero: the first fix.
        aboard: where the instruments are.  Place and velocity of the antenna stay its own.
    """

    def __init__(self, datum: Datum | None = None, aboard: Aboard | None = None) -> None:
        self.wrong, self.datum, self.aboard = 0, datum, aboard or Aboard()
        self._now: dict[str, float] = {}
        self._held: dict[str, Array] = {}
        self._told: dict[str, tuple[str, float]] = {}
        self._fixes: dict[str, dict[str, float]] = {}
        self._variation = None if self.aboard.variation is None else math.radians(self.aboard.variation)
        self._psi, self._r = math.nan, 0.0

    def hear(self, data: bytes, t: float = 0.0) -> None:
        """Take in a datagram that came at time `t` [s]."""
        try:
            lines = split(data)
        except NmeaError:
            self.wrong += 1
            return
        for line in lines:
            try:
                framed = read_line(line)
                heard = hear(framed.sentence)
            except NmeaError:
                self.wrong += 1
                continue
            tag = framed.tag.source if framed.tag else None
            self._take(f"{tag}/{heard.source}" if tag else heard.source, readings(heard), t)

    def _take(self, source: str, said: dict[str, float], t: float) -> None:
        """Readings of one sentence, where it is the one that its quantities are taken from."""
        if "time_of_day" in said:  # the same fix again, digit by digit, is a copy that came by another port
            told, self._fixes[source] = self._fixes.get(source), said
            if told == said:
                return
        if said.get("variation") and self.aboard.variation is None:  # 0 is that of a compass that has not been set
            self._variation = said["variation"]
        if "psi_magnetic" in said and "psi" not in said and self._variation is not None:
            said["psi"] = (said["psi_magnetic"] + self._variation) % (2.0 * math.pi)
        for name, value in said.items():
            group = GROUP_OF.get(name, name)
            leads, last = self._told.get(group, (source, t))
            place, before = self._place(group, source), self._place(group, leads)
            if source == leads or place < before or t - last > _SILENT:
                self._told[group], self._now[name] = (source, t), value

    def _place(self, group: str, source: str) -> tuple[bool, int]:
        """Place of a source among those of a quantity; one that is preferred may be named without its TAG block."""
        preferred = self.aboard.prefer.get(group)
        return preferred not in (source, source.rpartition("/")[2]), rank(group, source)

    def row(self) -> dict[str, float]:
        """What has come in since the last row, as channels of a trial."""
        raw, self._now = self._now, {}
        self._held |= {name: np.array(value) for name, value in raw.items() if name.startswith(("rpm_", "delta"))}
        steered = dict[str, Array]()
        controls(steered, self._held, [], self.aboard.gear)
        out = {name: float(value) for name, value in steered.items()}
        out |= {name: raw[name] for name in ("psi", "r", "U_T", "depth") if name in raw}
        self._psi, self._r = raw.get("psi", self._psi), raw.get("r", self._r)
        if "latitude" in raw and "longitude" in raw:
            self.datum = self.datum or Datum(raw["latitude"], raw["longitude"])
            x, y = self.datum.track(np.array([raw["latitude"]]), np.array([raw["longitude"]]))
            out |= {"x": float(x[0]), "y": float(y[0])}
        if "U_G" in raw and "gamma_G" in raw:
            out |= {"v_north": raw["U_G"] * math.cos(raw["gamma_G"]), "v_east": raw["U_G"] * math.sin(raw["gamma_G"])}
        if "u_log_water" in raw:
            out["u_w"] = raw["u_log_water"] + self.aboard.log.starboard * self._r
        if "U_A" in raw and "gamma_A" in raw:
            at_mast = np.array(raw["U_A"]), np.array(raw["gamma_A"])
            felt = felt_at_midship(*at_mast, np.array(self._r), self.aboard.mast)
            out["U_A"], out["gamma_A"] = (float(one) for one in felt)
        if "gamma_T_bow" in raw:
            out["gamma_T"] = math.fmod(raw["gamma_T_bow"] + self._psi, 2.0 * math.pi)
        return out


def rows_from(listening: socket.socket, rate: float, ear: Ear) -> Iterator[Row]:
    """Rows at `rate` [Hz] of what comes in, until the process ends; an empty one where nothing did."""
    begun, k = time.monotonic(), 0
    while True:
        k += 1
        due = begun + k / rate
        while (left := due - time.monotonic()) > 0.0:
            listening.settimeout(left)
            try:
                ear.hear(listening.recv(65535), due - begun)
            except TimeoutError:
                break
        yield due - begun, ear.row()


def channels_of(trial: Trial, needed: Sequence[str]) -> tuple[str, ...]:
    """Channels of a trial that hold any value, with those that follow from others.

    Raises:
        DataError: a control is missing.
    """
    found = tuple(name for name, values in moving(trial.channels).items() if np.isfinite(values).any())
    lacking = [name for name in needed if name not in found]
    if lacking:
        raise DataError(f"{trial.name}: no channel {', '.join(lacking)}; a twin is steered by {', '.join(needed)}")
    return found
