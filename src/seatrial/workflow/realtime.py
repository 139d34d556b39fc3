"""Ships in real time: the fleet of a loop, the socket of a page, and the bridge, a page to steer a ship by hand."""

from __future__ import annotations

import ipaddress
import math
import secrets
import socket
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Unpack

from ..core.errors import ChartError
from ..data.geodesy import Datum
from ..environment import Weather
from ..environment.chart import Chart
from ..manoeuvres import Manoeuvre
from ..models import unit
from ..models.common import Composed
from ..realtime.bridge.deck import Deck, Outfit
from ..realtime.bridge.ghost import Ghost
from ..realtime.bridge.situation import Situation, read_chart
from ..realtime.bridge.soundings import Soundings
from ..realtime.bridge.view import OWN
from ..realtime.conning import CourseKeeper
from ..realtime.loop import Loop, LoopError
from ..realtime.plant import Plant, plant_of, rate_of
from ..sensors.suite import draught
from ..ships import Ship
from ..simulate.place import Place, aground_or_inside, place_of
from . import RequestError
from .evidence.ahead import path_ahead
from .request import DEGREE, Around, Note, numbers, obeyed, positive, ship_of, silent, speed_of, surroundings
from .simulation import known, lacks, order

HERE = "127.0.0.1"

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

Start = tuple[float, ...]
"""Initial (x, y, psi, u, v_m, r) [m, rad, m/s, rad/s]."""


def others_of(
    texts: Iterable[str], rate: float, weather: Weather, seed: int, chart: Chart | None = None
) -> dict[str, Plant]:  # fmt: skip
    """Other ships, by number and name.

    Raises:
        RequestError: a text of another form than ``SHIP@NORTH,EAST,HEADING[,SPEED]``, a ship aground or in a wall.
    """
    found: dict[str, Plant] = {}
    places: dict[str, Place] = {}
    for number, text in enumerate(texts, 1):
        ship, start = other_of(text)
        place = placed(ship, chart, start, places=places)
        found[f"{number} {ship.name}"] = plant_of(ship, rate, weather, start, seed, place=place)
    return found


def placed(
    ship: Ship, chart: Chart | None, start: Sequence[float], note: Note = silent,
    places: dict[str, Place] | None = None,
) -> Place | None:  # fmt: skip
    """The place of a ship on a chart; None without a chart, or for a family that has no forces of banks and quays.

    Args:
        places: those of ships before it, by name: ships of one place are compiled once.

    Raises:
        RequestError: it starts aground or in a wall.
    """
    if chart is None:
        return None
    if not isinstance(ship.model, Composed):
        note(f"note: {ship.name}: its family knows no banks and quays; of the chart it feels the depth at most")
        return None
    known = {} if places is None else places
    place = known.setdefault(ship.name, known.get(ship.name) or place_of(ship, chart))
    if wrong := aground_or_inside(place, tuple(start), draught(ship)):
        raise RequestError(f"{ship.name}: {wrong}; start elsewhere")
    return place


def keep_course(loop: Loop, names: Iterable[str], note: Note = silent) -> None:
    """Let these ships keep their initial heading, each with an autopilot of its own."""
    for name in names:
        if "delta" in loop.vessels[name].plant.ranges:
            CourseKeeper(loop, name)
        else:
            note(f"note: --other {name.partition(' ')[2]}: it has no rudder to steer; it drifts freely")


def other_of(text: str) -> tuple[Ship, Start]:
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
    return ship, (north, east, heading * DEGREE, speed_of(ship, speed, f"--other {name}: speed"), 0.0, 0.0)


def pair(option: str, text: str, form: str) -> tuple[float, float]:
    """Two finite numbers of an option.

    Raises:
        RequestError: a text of another form than `form`, which describes it.
    """
    first, second = numbers(option, text, form)
    if not (math.isfinite(first) and math.isfinite(second)):
        raise RequestError(f"{option} is '{text}'; write {form}")
    return first, second


def datum_of(place: str | None) -> Datum | None:
    """Where x and y are zero, from ``LAT,LON`` [deg]; None without it.

    Raises:
        RequestError: a text of another form.
    """
    return None if place is None else Datum(*pair("--place", place, "LAT,LON in degrees such as 35.1,139.7"))


def listen(host: str, port: int, anywhere: bool) -> socket.socket:
    """Take the port of a page before any other work.

    Raises:
        RequestError: an address or port that is impossible, not allowed, or taken.
    """
    try:
        ip = ipaddress.IPv4Address(HERE if host == "localhost" else host)
    except ValueError:
        raise RequestError(f"--host is '{host}'; write an IPv4 address such as {HERE}") from None
    if not ip.is_loopback and not anywhere:
        raise RequestError(f"--host {host} is beyond this machine; allow that with --anywhere")
    if not 0 <= port <= 65535:
        raise RequestError(f"--port is {port}; it is 1 to 65535, or 0 for a free one")
    listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind((str(ip), port))
        listening.listen(64)
    except OSError as error:
        listening.close()
        raise RequestError(f"port {port} of {host}: {error.strerror}; choose another with --port") from None
    return listening


def address(listening: socket.socket, key: str = "") -> str:
    """What to open in a browser; the key, if any, is in the fragment, which no server and no other page receives."""
    host, port = listening.getsockname()
    if host == "0.0.0.0":
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as outward:
            try:
                outward.connect(("192.0.2.1", 9))  # sends nothing: only asks for the outward interface
                host = outward.getsockname()[0]
            except OSError:
                host = HERE
    return f"http://{host}:{port}/{f'#{key}' if key else ''}"


def bridge(
    ship: str | Path | Ship, *, host: str = HERE, port: int = 8020, anywhere: bool = False, factor: float = 1.0,
    speed: float | None = None, heading: float = 0.0, seed: int = 1, ghost: Path | None = None,
    other: Sequence[str] = (), place: str | None = None, chart: str | None = None, out: Path = Path(),
    hold: float = 5.0, bands: float | None = None, draws: int | None = None, extrapolate: bool = False,
    note: Note = silent, **around: Unpack[Around],
) -> list[Path]:  # fmt: skip
    """Serve a page on which a ship is steered by hand, until Ctrl-C.

    Args:
        ship: a name of the library, a ship file or a ship.
        place: ``LAT,LON`` [deg] of the start, for the page and the recordings; a ghost gives its own.
        note: takes the address of the page and events.
        around: weather and depth, see `surroundings`.

    The others are the options of `seatrial bridge`, whose help has their meaning and units.

    Returns:
        The recordings.

    Raises:
        RequestError: a request that cannot be carried out.
    """
    positive(speed=speed, hold=hold)
    if place is not None and ghost is not None:
        raise RequestError("--place and --ghost both set the position; leave out --place")
    datum = datum_of(place)
    with listen(host, port, anywhere) as listening:
        serve, vessel = server_of(anywhere), ship_of(ship)
        beside, rate = _ghost(vessel, ghost, note), rate_of(vessel, _RATE)
        weather = surroundings(vessel, seed, note, **around).weather
        begun = (0.0, 0.0, heading * DEGREE, speed_of(vessel, speed), 0.0, 0.0)
        start = begun if beside is None else beside.start
        situation = situation_of(chart, datum if beside is None else beside.datum, round(time.time()))
        around_it = placed(vessel, situation.shown.chart, start, note)
        own = plant_of(vessel, rate, weather, start, seed, beside is None, around_it)
        loop = _afloat(own, others_of(other, rate, weather, seed, situation.shown.chart), rate, factor, situation)
        recordings_go(out)
        keep_course(loop, (name for name in loop.vessels if name != OWN), note)
        outfit = Outfit(drills(vessel), out, beside, hold, cannot(vessel), situation.meta, None, situation,
                        path_ahead(ship, own, bands, draws, extrapolate=extrapolate))  # fmt: skip
        deck = Deck(loop, outfit)
        key = secrets.token_urlsafe(16) if anywhere else ""
        note(f"{vessel.name}: {address(listening, key)} (Ctrl-C ends it)")
        try:
            serve(deck, loop, listening, key)
        except KeyboardInterrupt:
            obeyed()
            note("ended")
        return [*deck.close()]


def _afloat(own: Plant, others: Mapping[str, Plant], rate: float, factor: float, situation: Situation) -> Loop:
    """The ships in a loop, with soundings where there is a chart.

    Raises:
        RequestError: a factor or ships that make no loop.
    """
    try:
        loop = Loop({OWN: own, **others}, rate, factor)
    except LoopError as error:
        raise RequestError(str(error)) from None
    if situation.shown.chart is not None:
        Soundings(loop, situation.shown.chart)
    return loop


def recordings_go(out: Path) -> None:
    """Refuse what is no folder for recordings."""
    if not out.is_dir():
        what = "a file" if out.exists() else "no such folder"
        raise RequestError(f"-o: {out}: {what}; recordings go into a folder")


def situation_of(chart: str | None, datum: Datum | None, epoch: float) -> Situation:
    """Place, date and chart of a page.

    Raises:
        RequestError: a file that is no chart, or one that is elsewhere.
    """
    if chart is None:
        return Situation(datum, epoch)
    try:
        shown, here = read_chart(chart, datum)
    except ChartError as error:
        raise RequestError(f"--chart: {error}") from None
    return Situation(here, epoch, shown)


Routes = Callable[[Any], None]
"""Adds routes to the server of a page."""


def server_of(everywhere: bool, links: Sequence[Routes] = ()) -> Callable[[Deck, Loop, socket.socket, str], None]:
    """What serves the page and further `links`, to this machine or to any address."""
    try:
        from ..realtime.bridge.server import serve
        from ..realtime.pages import LOCAL, anywhere
    except ImportError as error:
        raise RequestError(f"bridge needs {error.name}; pip install 'seatrial[web]'") from None
    names = anywhere() if everywhere else LOCAL
    return lambda deck, loop, listening, key: serve(deck, loop, listening, names, key, links)


def _ghost(ship: Ship, path: Path | None, note: Note) -> Ghost | None:
    if path is None:
        return None
    from ..data.trialfile import read_trial

    ghost = Ghost(read_trial(path), ship.model.controls)
    if ghost.ship and ghost.ship != ship.name:
        note(f"note: --ghost: {path} is a trial of {ghost.ship}, not of {ship.name}")
    return ghost


def drills(ship: Ship) -> dict[str, Callable[[float], Manoeuvre]]:
    """The buttons."""
    return {text: lambda n_P, kind=kind, given=given: order(kind, ship, ship.speed, n_P, given)
            for text, (kind, given) in _BUTTONS.items() if kind in known()}  # fmt: skip


def cannot(ship: Ship) -> dict[str, str]:
    """Buttons of what the ship cannot do, and why not."""
    turns = any(unit(name) == "rad" for name in ship.model.obeying("delta"))
    found: dict[str, str] = {}
    for text, (kind, _) in _BUTTONS.items():
        drill = known()[kind]
        unsteered = f"{ship.name} has nothing here that is steered by an angle; its thrusters turn it"
        why = lacks(ship, drill) if drill.by_engine or turns else unsteered
        if why is not None:
            found[text] = why
    return found
