"""Default candidates of excitation design: turns, zigzags and random runs."""

from __future__ import annotations

import math
from dataclasses import replace

from ...manoeuvres import Manoeuvre, Settings
from ...manoeuvres.human_random import HumanRandom
from ...manoeuvres.pseudo_random import PseudoRandom
from ...manoeuvres.turning import Turning
from ...manoeuvres.zigzag import Zigzag
from ...ships import Ship
from ...simulate.run import approach
from .excitation import Candidate

# T' of each kind: a turn of some 540 deg, a zigzag to its fourth overshoot, a stretch of a random run.
_TURN, _ZIGZAG, _RANDOM = 12.0, 15.0, 25.0
_SLOW = 0.6


def usual(ship: Ship, seeds: int = 2) -> tuple[Candidate, ...]:
    """Turns, zigzags and random runs, both sides, at the approach's revolutions and at 60 % of them.

    Args:
        seeds: how many random runs of each kind.
    """
    U, n_P = approach(ship)
    limit = float(ship.actuators.rudder.high)
    settings = Settings(n_P, U, ship.L_pp, limit)
    found = [*_standard(settings, ""), *_random(settings, seeds)]
    if n_P > 0:
        slow, n_slow = approach(ship, n_P=_SLOW * n_P)
        found += _standard(replace(settings, n_P=n_slow, speed=slow), ", slow")
    return tuple(found)


def _standard(settings: Settings, suffix: str) -> list[Candidate]:
    out: list[Candidate] = []
    for word, side in (("starboard", 1.0), ("port", -1.0)):
        for degrees in (35.0, 15.0):
            asked = replace(settings, side=side, rudder=min(math.radians(degrees), settings.rudder_limit))
            out.append(_candidate(f"turning {degrees:g} {word}{suffix}", Turning.ordered(asked), settings, _TURN))
        for degrees in (20.0, 10.0):
            angle = min(math.radians(degrees), settings.rudder_limit)
            asked = replace(settings, side=side, rudder=angle, heading=math.radians(degrees))
            name = f"zigzag {degrees:g}/{degrees:g} {word}{suffix}"
            out.append(_candidate(name, Zigzag.ordered(asked), settings, _ZIGZAG))
    return out


def _random(settings: Settings, seeds: int) -> list[Candidate]:
    out: list[Candidate] = []
    for seed in range(1, seeds + 1):
        asked = replace(settings, seed=seed)
        ahead = replace(HumanRandom.ordered(asked), astern=0.0)
        out.append(_candidate(f"pseudo-random, seed {seed}", PseudoRandom.ordered(asked), settings, _RANDOM))
        out.append(_candidate(f"random, seed {seed}", HumanRandom.ordered(asked), settings, _RANDOM))
        out.append(_candidate(f"random, ahead only, seed {seed}", ahead, settings, _RANDOM))
    return out


def _candidate(name: str, policy: Manoeuvre, settings: Settings, length: float) -> Candidate:
    return Candidate(name, policy, length * settings.L_pp / settings.speed, settings.speed)
