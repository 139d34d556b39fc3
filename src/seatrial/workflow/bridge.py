"""The bridge: a page on which a ship is steered by hand in real time."""

from __future__ import annotations

import secrets
import socket
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Unpack

from ..manoeuvres import Manoeuvre
from ..models import follows, unit
from ..realtime.bridge.deck import Deck, Outfit
from ..realtime.bridge.ghost import Ghost
from ..realtime.bridge.view import OWN
from ..realtime.loop import Loop, LoopError
from ..ships import Ship
from . import RequestError
from .fleet import keep_course, others_of, plant_of, rate_of
from .request import DEGREE, Around, Note, obeyed, positive, ship_of, silent, speed_of, surroundings
from .serving import HERE, address, listen
from .simulation import known, lacks, order

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
"""Manoeuvres on the page: text, kind, and its options [deg]."""


def bridge(
    ship: str | Path | Ship, *, host: str = HERE, port: int = 8020, anywhere: bool = False, factor: float = 1.0,
    speed: float | None = None, heading: float = 0.0, seed: int = 1, ghost: Path | None = None,
    other: Sequence[str] = (), out: Path = Path(), hold: float = 5.0, note: Note = silent, **around: Unpack[Around],
) -> list[Path]:  # fmt: skip
    """Serve a page on which a ship is steered by hand, until Ctrl-C.

    Args:
        ship: a name of the library, a ship file or a ship.
        host: address to serve at.
        port: port to serve at; 0 takes a free one.
        anywhere: whether addresses beyond this machine are allowed.
        factor: ratio of simulated to real time.
        speed: initial speed [m/s].
        heading: initial heading [deg].
        seed: of the gusts.
        ghost: measured trial to replay beside the ship.
        other: other ships, each ``SHIP@NORTH,EAST,DEG``.
        out: folder for recordings.
        hold: time after which a silent commander loses command [s].
        note: takes the address of the page and events.
        around: weather and depth, see `surroundings`.

    Returns:
        The recordings.

    Raises:
        RequestError: a request that cannot be carried out.
    """
    positive(speed=speed, hold=hold)
    with listen(host, port, anywhere) as listening:
        serve = _server(anywhere)
        vessel = ship_of(ship)
        beside = _ghost(vessel, ghost, note)
        rate = rate_of(vessel, _RATE)
        weather = surroundings(vessel, seed, note, **around).weather
        start = (0.0, 0.0, heading * DEGREE, speed_of(vessel, speed), 0.0, 0.0)
        own = plant_of(vessel, rate, weather, start if beside is None else beside.start, seed, beside is None)
        try:
            loop = Loop({OWN: own, **others_of(other, rate, weather, seed)}, rate, factor)
        except LoopError as error:
            raise RequestError(str(error)) from None
        if not out.is_dir():
            what = "a file" if out.exists() else "no such folder"
            raise RequestError(f"-o: {out}: {what}; recordings go into a folder")
        keep_course(loop, (name for name in loop.vessels if name != OWN), note)
        deck = Deck(loop, Outfit(_drills(vessel), out, beside, hold, cannot(vessel)))
        key = secrets.token_urlsafe(16) if anywhere else ""
        note(f"{vessel.name}: {address(listening, key)} (Ctrl-C ends it)")
        try:
            serve(deck, loop, listening, key)
        except KeyboardInterrupt:
            obeyed()
            note("ended")
        return [*deck.close()]


def _server(everywhere: bool) -> Callable[[Deck, Loop, socket.socket, str], None]:
    """Serves the page to this machine, or to any address."""
    try:
        from ..realtime.bridge.server import serve
        from ..realtime.pages import LOCAL, anywhere
    except ImportError as error:
        raise RequestError(f"bridge needs {error.name}; pip install 'seatrial[web]'") from None
    names = anywhere() if everywhere else LOCAL
    return lambda deck, loop, listening, key: serve(deck, loop, listening, names, key)


def _ghost(ship: Ship, path: Path | None, note: Note) -> Ghost | None:
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
    steering = [name for name, (of, _) in zip(ship.model.controls, follows(ship.model), strict=True) if of == "delta"]
    turns = any(unit(name) == "rad" for name in steering)
    found: dict[str, str] = {}
    for text, (kind, _) in _BUTTONS.items():
        engine = getattr(known()[kind], "by_engine", False)
        why = lacks(ship, known()[kind]) if engine or turns else f"{ship.name} has nothing that is steered by an angle"
        if why is not None:
            found[text] = why
    return found
