"""Scenarios by options: of a ship alone, and of a scenario in which options take the place of what it says."""

from __future__ import annotations

import math
import time
from dataclasses import replace

from ...core.parameters import unknown
from ...data.geodesy import Datum
from ...encounters.conduct import CONDUCTS
from ...encounters.meeting import named
from ...environment import CALM
from ...realtime.bridge.ghost import Ghost
from ...realtime.range.encounter import encountered
from ...realtime.range.scenario import Other, Own, Sailing, Scenario, Weather
from ...ships import Ship
from ...simulate.approach import approach
from .. import RequestError
from ..asked import Around, Departure, InWaves
from ..request import DEGREE, Note, finite, numbers, pair, ship_of, speed_of
from ..seaway import bound_for
from .scenarios import channels_of

_RATE = 10.0


def alone(ship: Ship, ghost: Ghost | None = None) -> Scenario:
    """A ship in calm water that is steered by whoever commands it, from where a measured trial begins if one is given.

    The date is now, and nothing ends the run.
    """
    x, y, psi = (0.0, 0.0, 0.0) if ghost is None else ghost.start[:3]
    own = Own(ship, Sailing(x, y, psi, ship.speed), piloted=False, begun=None if ghost is None else ghost.start)
    return Scenario(ship.name, math.inf, own, (), _RATE, datum=None if ghost is None else ghost.datum,
                    epoch=float(round(time.time())), weather=(Weather(0.0, 0.0, CALM),))  # fmt: skip


def met(ship: str, encounter: str, departure: Departure) -> Scenario:
    """A ship in an encounter by its name (`meeting.named`), all others of one conduct, which may follow a comma.

    Raises:
        RequestError: no such encounter or conduct, or a start that the encounter gives.
    """
    for name in ("start", "heading"):
        if getattr(departure, name) is not None:
            raise RequestError(f"--{name}: an encounter begins where x and y are zero, on course north; leave it out")
    own = ship_of(ship)
    U = approach(own)[0] if departure.speed is None else speed_of(own, departure.speed)
    encounter, _, conduct = encounter.partition(",")
    conduct = conduct or "rules"
    meeting = named(encounter, U, 1 if departure.seed is None else departure.seed)
    if conduct not in CONDUCTS:
        raise RequestError(f"--encounter: {unknown(conduct, CONDUCTS, 'conduct')}")
    return encountered(own, meeting, [conduct] * len(meeting.x), title=f"{own.name} in {encounter}")


def varied(played: Scenario, departure: Departure, around: Around, waves: InWaves, note: Note) -> Scenario:
    """A scenario in which the options take the place of what it says; other ships join those that it has.

    Wind, current, waves and depth that are given hold from its start to its end, whatever its weather does with them.
    A sea that it has was drawn when it was read: a seed does not change it.

    Raises:
        RequestError: an option that cannot be, or that something else of the scenario hangs on.
    """
    ship, own = played.own.ship, played.own
    seed = played.seed if departure.seed is None else departure.seed
    if around.waves is not None and waves == InWaves() and played.sea is not None:
        raise RequestError("--waves: the sea of the scenario gives the mean drift already; give --sea in its place")
    seaway = bound_for(ship, waves, seed, around, note)
    sea, rao = (played.sea, played.rao) if seaway.sea is None else (seaway.sea, seaway.rao)
    antenna = own.antenna if departure.antenna is None else pair(
        "--antenna", departure.antenna, "FORWARD,STARBOARD in metres")  # fmt: skip
    others = [(number, *other_of(text)) for number, text in enumerate(departure.other, 1)]
    return replace(
        played, seed=seed, datum=_datum(played, departure.place), sea=sea, rao=rao,
        gusts=played.gusts if around.gusts is None else around.gusts,
        weather=_weather(played, seaway.around, seaway.sea is not None, note),
        own=replace(own, sailing=_begun(own, departure), usual=own.usual or departure.sensors, antenna=antenna),
        others=(*played.others, *(Other(f"{number} {there.name}", there, where) for number, there, where in others)),
    )  # fmt: skip


def _weather(played: Scenario, around: Around, bound: bool, note: Note) -> tuple[Weather, ...]:
    """The weather of a scenario with what is given in its place; of a sea that is `bound` for it, its mean drift."""
    windy = any(one.around.wind_x or one.around.wind_y for one in played.weather)
    given = around if around.wind is not None or not windy else replace(around, gusts=None)
    calm = {"wave_x": 0.0, "wave_y": 0.0, "wave_T": 0.0} if bound else {}
    changed = {**calm, **channels_of(played.own.ship, given, note)}
    if not changed:
        return played.weather
    begun = any(one.at == 0.0 and one.over == 0.0 for one in played.weather)
    before = played.weather if begun else (Weather(0.0, 0.0, CALM), *played.weather)
    return tuple(replace(one, around=one.around._replace(**changed)) for one in before)


def _begun(own: Own, departure: Departure) -> Sailing:
    """How the own ship begins."""
    sailing, mmsi, heading = own.sailing, departure.mmsi, departure.heading
    if mmsi is not None and not 200_000_000 <= mmsi <= 799_999_999:
        raise RequestError(f"--mmsi is {mmsi}; that of a ship has nine digits, the first 2 to 7")
    x, y, psi = sailing.x, sailing.y, sailing.psi
    if heading is not None:
        finite(heading=heading)
        psi = heading * DEGREE
    if departure.start is not None:
        if heading is not None:
            raise RequestError("--start and --heading both give the heading; leave out --heading")
        x, y, degrees = numbers("--start", departure.start, "X,Y,DEG such as 0,50,90")
        for value in (x, y, degrees):
            finite(start=value)
        psi = degrees * DEGREE
    speed = sailing.speed if departure.speed is None else speed_of(own.ship, departure.speed)
    return replace(sailing, x=x, y=y, psi=psi, speed=speed, mmsi=sailing.mmsi if mmsi is None else mmsi)


def _datum(played: Scenario, place: str | None) -> Datum | None:
    """Where x and y are zero; what lies at a latitude and longitude would move with it."""
    if place is None:
        return played.datum
    if played.datum is not None or played.chart is not None:
        raise RequestError("--place is given by the scenario, whose ships and chart lie about it; leave it out")
    return datum_of(place)


def other_of(text: str) -> tuple[Ship, Sailing]:
    """Another ship: NAME@NORTH,EAST,HEADING[,SPEED] [m, deg, m/s]."""
    name, _, place = text.partition("@")
    try:
        north, east, heading, *rest = (float(part) for part in place.split(","))
        (speed,) = rest or (None,)
    except ValueError:
        raise RequestError(f"--other is '{text}'; write SHIP@NORTH,EAST,HEADING such as kcs@2000,500,180") from None
    if not all(map(math.isfinite, (north, east, heading, speed or 0.0))) or (speed or 0.0) < 0.0:
        raise RequestError(f"--other is '{text}'; place and heading are numbers, the speed zero or above")
    ship = ship_of(name)
    return ship, Sailing(north, east, heading * DEGREE, speed_of(ship, speed, f"--other {name}: speed"))


def datum_of(place: str | None) -> Datum | None:
    """Where x and y are zero, from ``LAT,LON`` [deg]; None without it.

    Raises:
        RequestError: a text of another form.
    """
    return None if place is None else Datum(*pair("--place", place, "LAT,LON in degrees such as 35.1,139.7"))
