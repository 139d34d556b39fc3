"""The command bridge: a page on which a ship is steered by hand."""

from __future__ import annotations

import secrets
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..manoeuvres import Manoeuvre
from ..models import unit
from ..realtime.bridge.deck import Deck, Outfit
from ..realtime.bridge.ghost import Ghost
from ..realtime.bridge.view import OWN
from ..realtime.loop import Loop, LoopError
from ..realtime.plant import Plant
from ..ships import Ship
from .fleet import keep_course, others_of, plant_of, rate_of
from .manoeuvres import known, lacks, order
from .page import address, listen
from .support import DEGREE, UsageError, around_ship, note, obeyed, positive, read_ship, say, speed_of

_RATE = 20.0

_BUTTONS: Mapping[str, tuple[str, Mapping[str, Any]]] = {
    "Turn 35° starboard": ("turning", {}),
    "Turn 35° port": ("turning", {"side": "port"}),
    "Zigzag 10/10": ("zigzag", {}),
    "Zigzag 20/20": ("zigzag", {"rudder": 20.0, "heading": 20.0}),
    "Initial turning": ("initial-turning", {}),
    "Pull-out": ("pull-out", {}),
    "Williamson turn": ("williamson", {}),
    "Scharnow turn": ("scharnow", {}),
    "Stopping": ("stopping", {}),
    "Crash stop": ("crash-astern", {}),
}
"""Manoeuvres on the page: text, kind, and what is asked of it [deg]."""


@dataclass(frozen=True)
class Request:
    """What the user asks of `bridge`; as on the command line."""

    ship: str
    host: str = "127.0.0.1"
    port: int = 8020
    anywhere: bool = False
    factor: float = 1.0
    speed: float | None = None
    heading: float = 0.0
    wind: str | None = None
    gusts: str | None = None
    current: str | None = None
    waves: str | None = None
    depth: float | None = None
    seed: int = 1
    ghost: Path | None = None
    other: tuple[str, ...] = ()
    out: Path = Path()
    hold: float = 5.0


def bridge(asked: Request) -> None:
    """Serve the page until the user has had enough.

    Raises:
        UsageError: a request that cannot be carried out.
    """
    positive(speed=asked.speed, hold=asked.hold)
    listening = listen(asked.host, asked.port, asked.anywhere)
    with listening:
        try:
            from ..realtime.bridge.server import serve
            from ..realtime.pages import LOCAL, anywhere
        except ImportError as error:
            raise UsageError(f"bridge needs {error.name}; pip install 'seatrial[web]'") from None
        ship = read_ship(asked.ship)
        ghost = _ghost(ship, asked.ghost)
        try:
            loop = Loop(_fleet(ship, asked, ghost), rate_of(ship, _RATE), asked.factor)
        except LoopError as error:
            raise UsageError(str(error)) from None
        if not asked.out.is_dir():
            what = "a file" if asked.out.exists() else "no such folder"
            raise UsageError(f"-o: {asked.out}: {what}; recordings go into a folder")
        keep_course(loop, (name for name in loop.vessels if name != OWN))
        deck = Deck(loop, Outfit(_drills(ship), asked.out, ghost, asked.hold, cannot(ship)))
        key = secrets.token_urlsafe(16) if asked.anywhere else ""
        note(f"{ship.name}: {address(listening, key)} (Ctrl-C ends it)")
        try:
            serve(deck, loop, listening, anywhere() if asked.anywhere else LOCAL, key)
        except KeyboardInterrupt:
            obeyed()
            note("ended")
        say("".join(f"{path}\n" for path in deck.close()))


def _fleet(ship: Ship, asked: Request, ghost: Ghost | None) -> dict[str, Plant]:
    rate = rate_of(ship, _RATE)
    weather = around_ship(
        ship, asked.wind, asked.gusts, asked.current, asked.waves, asked.depth, asked.seed
    ).weather  # fmt: skip
    speed = speed_of(ship, asked.speed)
    start = (0.0, 0.0, asked.heading * DEGREE, speed, 0.0, 0.0) if ghost is None else ghost.start
    own = plant_of(ship, rate, weather, start, asked.seed, ghost is None)
    return {OWN: own, **others_of(asked.other, rate, weather, asked.seed)}


def _ghost(ship: Ship, path: Path | None) -> Ghost | None:
    if path is None:
        return None
    from ..data.trialfile import read_trial

    ghost = Ghost(read_trial(path), ship.model.controls)
    if ghost.ship and ghost.ship != ship.name:
        note(f"note: --ghost: {path} is a trial of {ghost.ship}, not of {ship.name}")
    return ghost


def _drills(ship: Ship) -> dict[str, Callable[[float], Manoeuvre]]:
    """The buttons."""

    def made(kind: str, given: Mapping[str, Any]) -> Callable[[float], Manoeuvre]:
        return lambda n_P: order(kind, ship, ship.speed, n_P, dict(given))

    return {text: made(kind, given) for text, (kind, given) in _BUTTONS.items() if kind in known()}


def cannot(ship: Ship) -> dict[str, str]:
    """Buttons of what the ship cannot do, and why not."""
    steering = [name for name, (of, _) in zip(ship.model.controls, ship.model.follows, strict=True) if of == "delta"]
    turns = any(unit(name) == "rad" for name in steering)
    found: dict[str, str] = {}
    for text, (kind, _) in _BUTTONS.items():
        engine = known()[kind].by_engine
        why = lacks(ship, known()[kind]) if engine or turns else f"{ship.name} has nothing that is steered by an angle"
        if why is not None:
            found[text] = why
    return found
