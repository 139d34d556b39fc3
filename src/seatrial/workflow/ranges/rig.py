"""The rig: a scenario with the page of the bridge and a wire on one loop, in real time."""

from __future__ import annotations

import secrets
import time
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from socket import socket
from typing import Unpack, cast

from ...data.geodesy import Datum
from ...environment import Environment, Uniform
from ...environment.weather import Gust
from ...realtime.bridge.deck import Deck, Outfit
from ...realtime.bridge.situation import Shown, Situation
from ...realtime.bridge.view import OWN
from ...realtime.loop import LoopError
from ...realtime.range.panel import Panel
from ...realtime.range.scenario import Other, Own, Sailing, Scenario, Weather
from ...realtime.range.stage import Line, Stage
from ...realtime.wire import Authority, Mute, WireError
from ...ships import Ship
from .. import RequestError
from ..evidence.ahead import path_ahead
from ..realtime import (
    HERE,
    Routes,
    address,
    cannot,
    datum_of,
    drills,
    listen,
    other_of,
    recordings_go,
    server_of,
    situation_of,
)  # fmt: skip
from ..request import DEGREE, Around, Note, obeyed, positive, ship_of, silent, speed_of, surroundings
from ..steer import gone, maybe, reporter, tell_places, writing
from . import split
from .reading import read_scenario

_RATE = 20.0
_NOWHERE = 1e9
"""Duration of a run without a scenario [s]."""


@dataclass(frozen=True)
class Rigged:
    """A rig that has ended: the stage in its final state, the recordings, and why it failed, if it did."""

    stage: Stage
    written: tuple[Path, ...]
    failure: str | None


def rig(
    ship: str | Path | Ship, nmea: str | None, scenario: Path | None = None, *, host: str = HERE, port: int = 8020,
    anywhere: bool = False, factor: float = 1.0, speed: float | None = None, heading: float = 0.0, seed: int = 1,
    other: Sequence[str] = (), place: str | None = None, chart: str | None = None, out: Path = Path(),
    hold: float = 5.0, to: Sequence[str] = (), framed: bool = False, only: str | None = None,
    commander: Sequence[str] = (), mmsi: int | None = None,
    simulator: bool = False, log: Path | None = None, signalk: bool = False, rosbridge: bool = False,
    can: str | None = None, bands: float | None = None, draws: int | None = None, extrapolate: bool = False,
    note: Note = silent, **around: Unpack[Around],
) -> Rigged:  # fmt: skip
    """Serve the page of the bridge and a wire on one loop, until Ctrl-C.

    Args:
        ship: the own ship, in place of that of the scenario.
        nmea: address of the wire; None: the page alone.
        scenario: its file; None: what the other arguments say.
        note: takes the address of the page and events.
        around: weather and depth without a scenario, see `surroundings`.

    The others are the options of `seatrial bridge`, whose help has their meaning and units.

    Raises:
        RequestError: a request that cannot be carried out.
    """
    positive(speed=speed, hold=hold)
    _refuse_of_scenario(scenario, speed=speed, heading=heading, other=other, place=place, mmsi=mmsi, **around)
    if nmea is None and (to or commander or framed or only is not None or log is not None):
        raise RequestError("--to, --commander, --framed, --only and --log are of a wire; give --nmea udp://...")
    recordings_go(out)
    vessel = ship_of(ship)
    if scenario is None:
        sailing = Sailing(0.0, 0.0, heading * DEGREE, speed_of(vessel, speed), (), mmsi or 0)
        played = _plain(vessel, sailing, datum_of(place), other, seed, note, **around)
    else:
        played = replace(read_scenario(scenario, vessel), rate=_RATE)
    played, situation = _charted(played, scenario, chart)
    own, reports = split(only)
    authority = Authority.of(tuple(commander))
    with listen(host, port, anywhere) as listening, maybe(nmea, to, anywhere) as wire, writing(log) as file:
        tied = Mute() if wire is None and (signalk or rosbridge or can is not None) else wire
        line = None if tied is None else Line(tied, framed, own, reports, max(hold, 10.0), authority, simulator, file)
        stage = _stage(played, factor, line, log, note)
        ahead = path_ahead(ship, stage.loop.vessels[OWN].plant, bands, draws, extrapolate=extrapolate)
        outfit = Outfit(drills(vessel), out, None, hold, cannot(vessel), situation.meta, Panel(stage), situation, ahead)
        deck = Deck(stage.loop, outfit)
        key = secrets.token_urlsafe(16) if anywhere else ""
        note(f"{played.title}: {address(listening, key)} (Ctrl-C ends it)")
        if wire is not None:
            note(f"{vessel.name} on {wire.address}")
        links = _links(stage, signalk, rosbridge, key)
        with _bus(stage, can):
            _serve(deck, stage, listening, anywhere, key, links)
        note("ended")
        return Rigged(stage, tuple(deck.close()), gone(wire))


def _links(stage: Stage, signalk: bool, rosbridge: bool, key: str) -> list[Routes]:
    """The links at the server of the page."""
    from ...realtime.links.rosbridge import Rosbridge
    from ...realtime.links.signalk import SignalK

    kinds = ((signalk, SignalK), (rosbridge, Rosbridge))
    return [kind(stage, key).routes for wanted, kind in kinds if wanted]


@contextmanager
def _bus(stage: Stage, text: str | None) -> Generator[None]:
    """The bus of NMEA 2000, closed at the end."""
    if text is None:
        yield
        return
    from ...realtime.links.n2k import Bus

    try:
        bus = Bus(stage, text)
    except WireError as error:
        raise RequestError(f"--can: {error}") from None
    try:
        yield
    finally:
        bus.close()


def _serve(
    deck: Deck, stage: Stage, listening: socket, anywhere: bool, key: str, links: Sequence[Routes]
) -> None:  # fmt: skip
    try:
        server_of(anywhere, links)(deck, stage.loop, listening, key)
    except KeyboardInterrupt:
        obeyed()


def _stage(scenario: Scenario, factor: float, line: Line | None, log: Path | None, note: Note) -> Stage:
    try:
        stage = Stage(scenario, factor, line, page=True)
    except (WireError, LoopError) as error:
        raise RequestError(str(error)) from None
    tell_places(log, stage.loop.vessels[OWN])
    stage.loop.after(reporter(note))
    return stage


def _charted(played: Scenario, scenario: Path | None, chart: str | None) -> tuple[Scenario, Situation]:
    """The scenario with the chart of `--chart`, which the ships then feel, and what the page shows of it."""
    if played.chart is not None and chart is not None:
        raise RequestError(f"--chart is given by the scenario; leave it out, or change {scenario}")
    if played.chart is not None:
        return played, Situation(played.datum, played.epoch, Shown(played.chart))
    situation = situation_of(chart, played.datum, played.epoch)
    return replace(played, chart=situation.shown.chart, datum=situation.datum), situation


def _refuse_of_scenario(scenario: Path | None, **given: object) -> None:
    """Refuse options that a scenario gives."""
    for name, value in given.items():
        if scenario is not None and value is not None and value not in ((), [], 0.0):
            raise RequestError(f"--{name} is given by the scenario; leave it out, or change {scenario}")


def _plain(
    ship: Ship, sailing: Sailing, datum: Datum | None, other: Sequence[str], seed: int, note: Note,
    **around: Unpack[Around],
) -> Scenario:  # fmt: skip
    """The scenario of the options: steady weather, other ships that keep their line."""
    weather = surroundings(ship, seed, note, **around).weather
    base = weather.base if isinstance(weather, Gust) else weather
    now: Environment = cast("Uniform", base).now()
    others: list[Other] = []
    for number, text in enumerate(other, 1):
        there, (x, y, psi, u, _, _) = other_of(text)
        others.append(Other(f"{number} {there.name}", there, Sailing(x, y, psi, u)))
    return Scenario(
        ship.name, _NOWHERE, Own(ship, sailing, piloted=False), tuple(others), _RATE, seed, datum,
        float(round(time.time())), gusts=around.get("gusts"), weather=(Weather(0.0, 0.0, now),),
    )  # fmt: skip
