"""Sixty runs labelled by eye from drawings of their tracks, before the checks saw them, against the verdicts.

The labels are of the own ship: its part, and whether it kept the rules.  They were made by one reader who knew the
rules and the safe distance, from tracks with times along them, the turns and losses of speed, and the least distance.
They stand as they were made: in two (57, 59) the reader took the end of the other ship's track for its start, and in
two (3, 30) gave a part to ships that pass well clear.
"""

from __future__ import annotations

import numpy as np
import pytest

from kinematic import Sailed, meeting, tracks
from seatrial.encounters.rules import Role, judge

LABELS = (
    "g+ s- h- g+ h+ h- o- o+ t- g+ t- s- "
    "s- h+ g- t- s+ s- g- s+ g+ g+ o+ g+ "
    "g- h+ h+ t- t+ h- g+ s- h- s- h- g+ "
    "g- h+ s+ s- g+ o+ o+ s- o- s- g+ o- "
    "n+ s- s- t- g- h- g- t+ h- g+ g+ g+ "
)
"""Head-on, overtaking, gives way, stands on, is overtaken (t), no risk; rules kept or not."""

ROLES = {"n": Role.NONE, "h": Role.HEAD_ON, "o": Role.OVERTAKING, "g": Role.GIVE_WAY, "s": Role.STAND_ON,
         "t": Role.OVERTAKEN}  # fmt: skip
Orders = tuple[tuple[float, float, float], ...]


def drawn() -> list[tuple[Sailed, Sailed]]:
    """Meetings, crossings and overtakings; either ship does nothing, acts early, late, too little, or slows."""
    rng = np.random.default_rng(20240)
    found: list[tuple[Sailed, Sailed]] = []
    for _ in range(60):
        kind = rng.choice(["meets", "crosses", "overtakes"], p=[0.2, 0.55, 0.25])
        heading = {"meets": 180.0 + rng.uniform(-8, 8), "crosses": rng.choice([-1, 1]) * rng.uniform(35, 150),
                   "overtakes": rng.uniform(-25, 25)}[kind]  # fmt: skip
        k = float(rng.uniform(0.35, 0.55) if kind == "overtakes" else rng.uniform(0.8, 1.2))
        if kind == "overtakes" and rng.random() < 0.4:
            k = 1.0 / k
        off = float(rng.choice([0.0, 150.0, -150.0, 2500.0], p=[0.4, 0.25, 0.25, 0.1]))
        U = 8.0 / max(1.0, k / 1.2)
        start = meeting(heading, 1500.0, U, k, off)
        found.append((Sailed(0, 0, 0, U, orders(rng)), Sailed(*start, heading, k * U, orders(rng))))
    return found


def orders(rng: np.random.Generator) -> Orders:
    what = rng.choice(["nothing", "early", "late", "small", "slow"], p=[0.35, 0.35, 0.1, 0.1, 0.1])
    side = 1.0 if rng.random() < 0.75 else -1.0
    at, turn = float(rng.uniform(600, 750)), float(rng.uniform(40, 60))
    choices: dict[str, Orders] = {
        "nothing": (), "early": ((at, side * turn, 1.0), (2000.0, -side * turn, 1.0)),
        "late": ((at + 550.0, side * turn, 1.0),), "small": ((at, side * float(rng.uniform(12, 18)), 1.0),),
        "slow": ((at, 0.0, 0.3),),
    }  # fmt: skip
    return choices[str(what)]


@pytest.mark.slow
def test_verdicts_agree_with_labels_by_eye() -> None:
    roles, verdicts = [], []
    for k, (ships, label) in enumerate(zip(drawn(), LABELS.split(), strict=True)):
        one = judge(tracks(ships, T=3000.0))[0]
        if Role(int(one.role)) is not ROLES[label[0]]:
            roles.append((k, label, Role(int(one.role)).name))
        if bool(one.fails) != (label[1] == "-"):
            verdicts.append((k, label, one.broken()))
    assert len(roles) <= 4, roles
    assert len(verdicts) <= 2, verdicts
