"""Logs in random units, signs and axes: nothing is read wrongly without a doubt or a question."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from shapes import COASTER, KN, MODEL, Sailed, Sheet, astray, sailed, stamps

from seatrial.data.guess import ASK, DOUBT, guess
from seatrial.data.mapping.checked import read_mapping
from seatrial.data.mapping.reading import read
from seatrial.data.mapping.recordings import recordings

pytestmark = pytest.mark.long

OWNERS = {
    "x": ("position", "channels.x"), "y": ("position", "channels.x"), "psi": ("channels.psi",),
    "u": ("ground", "channels.u", "channels.psi"), "v_m": ("ground", "channels.u", "channels.psi"),
    "r": ("channels.r",), "delta": ("channels.delta",), "n_P": ("channels.n_P",),
    "U_A": ("apparent", "channels.U_A"), "gamma_A": ("apparent", "channels.U_A"),
}  # fmt: skip
"""Tables of a mapping on which each channel depends; a doubt there is one about the channel."""

ANSWERS = {"channels.delta": "deg", "channels.r": "deg/min", "channels.n_P": "rpm", "channels.psi": "deg"}


class Logger:
    """A logger that draws how it writes each quantity."""

    def __init__(self, seed: int) -> None:
        self.hand = np.random.default_rng(seed)
        self.sheet = Sheet()

    def one(self, *options: str) -> str:
        return options[self.hand.integers(len(options))]

    def put(self, head: str, values: np.ndarray, unit: str, digits: int) -> None:
        """A column whose header says its unit or does not."""
        self.sheet.put(f"{head} [{unit}]" if self.hand.random() < 0.5 else head, values, digits)

    def angle(self, head: str, values: np.ndarray) -> None:
        unit = self.one("deg", "rad")
        self.put(head, np.degrees(values) if unit == "deg" else values, unit, 3 if unit == "deg" else 5)

    def write(self, log: Sailed) -> Sheet:
        self.sheet.put("time", stamps(log.t, "utc"))
        place = self.one("fix", "north", "x")
        if place == "fix":
            self.sheet.put("latitude", log.latitude, 8).put("longitude", log.longitude, 8)
        else:
            self.put({"north": "north", "x": "x"}[place], log["x"], "m", 4)
            self.put({"north": "east", "x": "y"}[place], log["y"], "m", 4)
        name = self.one("heading", "psi", "yaw")
        anticlockwise = place != "x" and name == "yaw" and self.hand.random() < 0.5
        psi = 0.5 * np.pi - log["psi"] if anticlockwise else log["psi"]
        self.angle(name, np.arctan2(np.sin(psi), np.cos(psi)) if self.hand.random() < 0.5 else psi % (2 * np.pi))
        self.speeds(log)
        unit = self.one("deg/s", "rad/s", "deg/min")
        size = {"deg/s": 180 / np.pi, "rad/s": 1.0, "deg/min": 10800 / np.pi}[unit]
        self.put(self.one("r", "rot", "yaw rate"), float(self.one("1", "-1")) * size * log["r"], unit, 6)
        self.angle(self.one("rudder", "delta"), float(self.one("1", "-1")) * log["delta"])
        unit = self.one("1/s", "rpm")
        self.put("n", log["n_P"] * (60.0 if unit == "rpm" else 1.0), unit, 3)
        unit, away = self.one("m/s", "kn"), float(self.one("0", "180"))
        self.put("apparent wind speed", log["U_A"] / (KN if unit == "kn" else 1.0), unit, 3)
        self.sheet.put("apparent wind angle", (np.degrees(log["gamma_A"]) + away) % 360.0, 2)
        return self.sheet

    def speeds(self, log: Sailed) -> None:
        unit = self.one("m/s", "kn")
        size = 1.0 / KN if unit == "kn" else 1.0
        pairs = {
            "sog": (log.sog, log.cog), "u": (log["u"], float(self.one("1", "-1")) * log["v_m"]),
            "v_north": (log.north, log.east), "vx": (log.north, log.east),
        }  # fmt: skip
        first = self.one(*pairs)
        a, b = pairs[first]
        self.put(first, size * a, unit, 4)
        if first == "sog":
            self.sheet.put("cog", np.degrees(b), 3)
        else:
            self.put({"u": "v", "v_north": "v_east", "vx": "vy"}[first], size * b, unit, 4)


def random_log(seed: int) -> tuple[Sailed, Sheet]:
    hand = np.random.default_rng([seed, 1])
    how = dict(MODEL if seed % 2 else COASTER)
    speed = 0.55 if seed % 2 else 6.0
    how |= {"noise": float(hand.choice([0.0, 0.5, 1.0, 2.0])), "rudder": float(hand.choice([2.0, 10.0, 20.0, 35.0]))}
    how |= {"current": float(hand.choice([0.0, 0.05, 0.15])) * speed, "wind": float(hand.choice([0.5, 1.5])) * speed}
    log = sailed(**how, seed=seed, psi_0=float(hand.uniform(0.0, 6.28)))
    return log, Logger(seed).write(log)


def doubted(text: str) -> set[str]:
    """Tables with a doubt or a question."""
    found: set[str] = set()
    table, pending = "", False
    for line in text.splitlines():
        pending |= DOUBT in line
        if line.startswith("["):
            table = line.strip("[]")
            found |= {table} if pending else set()
        if not line.startswith("#"):
            pending = False
            found |= {table} if f'"{ASK}"' in line else set()
    return found


def answered(text: str) -> str:
    """The mapping with any answer to its questions."""
    table, out = "", list[str]()
    for line in text.splitlines():
        table = line.strip("[]") if line.startswith("[") else table
        line = re.sub(rf'^unit = "\{ASK}"', f'unit = "{ANSWERS.get(table, "m/s")}"', line)
        out.append(line.replace(f'sign = "{ASK}"', "sign = 1"))
    return "\n".join(out)


@pytest.mark.parametrize("seed", range(1000))
def test_what_is_wrong_is_doubted(seed: int, tmp_path: Path) -> None:
    log, sheet = random_log(seed)
    source = sheet.write(tmp_path / "log.csv")
    text = guess(source).text
    (tmp_path / "m.toml").write_text(answered(text), encoding="utf-8")
    mapping = read_mapping(tmp_path / "m.toml")
    (trial,) = (one for path in recordings(source, mapping) for one in read(path, mapping))
    speed, angle = 1e-3 + 4e-4 * float(log.sog.max()), 3e-4
    digits = {"x": 0.02, "y": 0.02, "psi": angle, "u": speed, "v_m": speed, "r": 2e-6, "delta": angle, "n_P": 1e-3,
              "U_A": 1e-3, "gamma_A": angle}  # fmt: skip
    assert {"x", "y", "psi", "r", "delta", "n_P"} <= set(trial.channels)
    wrong = astray(trial, log, {name: size for name, size in digits.items() if name in trial})
    silent = {name for name in wrong if not set(OWNERS[name]) & doubted(text)}
    assert not silent, (wrong, text)
