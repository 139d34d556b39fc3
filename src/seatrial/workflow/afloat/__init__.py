"""Ships in real time: what `seatrial steer`, `bridge` and `range` are asked for, as a scenario and its equipment."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from ...core.errors import ChartError
from ...data.geodesy import Datum
from ...manoeuvres import Manoeuvre
from ...models import unit
from ...realtime.afloat import Links, Voyage, afloat
from ...realtime.afloat import Page as Shown
from ...realtime.bridge.deck import Outfit
from ...realtime.bridge.ghost import Ghost
from ...realtime.bridge.situation import Shown as Seen
from ...realtime.bridge.situation import Situation, read_chart
from ...realtime.links.wiring import Wiring
from ...realtime.range.scenario import Scenario
from ...ships import Ship
from .. import RequestError
from ..asked import Around, Bands, Departure, InWaves, Page, RealTime, Wire
from ..evidence.ahead import path_ahead
from ..request import Note, grounds_of, positive, ship_of, silent
from ..simulation import known, lacks, order
from .scenarios import read_scenario
from .scenes import alone, varied

_RATE_OF_PAGE, _RATE_OF_ARDUPILOT = 20.0, 400.0
_PAGELESS = ("can", "ardupilot", "servo")
"""Links that need no page."""

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


def sail(
    ship: str | Path | Ship | None = None, scenario: Path | Scenario | None = None,
    departure: Departure = Departure(), around: Around = Around(), waves: InWaves = InWaves(), wire: Wire = Wire(),
    page: Page = Page(), bands: Bands = Bands(), run: RealTime = RealTime(), *, judge: bool = False,
    note: Note = silent, printed: Note = silent,
) -> Voyage:  # fmt: skip
    """Run a ship in real time with the equipment that is asked for.

    Args:
        ship: a name of the library, a ship file or a ship; with a scenario in place of its own ship, or None.
        scenario: its file, or a scenario; None: the ship alone.
        departure, around, waves: take the place of what the scenario says.
        judge: whether the criteria of the scenario decide.
        note: takes addresses and events.
        printed: takes the standard output of the program beside the ship.

    The others are groups of options, whose help has their meaning and units.

    Raises:
        RequestError: a request that cannot be carried out.
        RunError: no autopilot on the wire in lock step, or the program beside the ship failed.
    """
    positive(speed=departure.speed, rate=run.rate, duration=run.duration, hold=run.hold, patience=wire.patience)
    wiring = _wiring(wire, run)
    _refuse_without_page(page, bands)
    vessel = None if ship is None else ship_of(ship)
    ghost = _ghost(vessel, scenario, departure, page.ghost, note)
    if scenario is None:
        if vessel is None:
            raise RequestError("name a ship, or a scenario with one")
        played = alone(vessel, ghost)
    else:
        played = scenario if isinstance(scenario, Scenario) else read_scenario(scenario, vessel, departure.seed)
    if ship is not None and (tested := grounds_of(ship, note)) is not None:
        played = replace(played, own=replace(played.own, grounds=tested))
    played, situation = _charted(varied(played, departure, around, waves, note), scenario, run.chart)
    usual = _RATE_OF_ARDUPILOT if page.ardupilot else _RATE_OF_PAGE if page.page else played.rate
    record, folder = _recorded(run.out, page.page)
    shown = None
    if page.page:
        own = played.own.ship
        outfit = Outfit(drills(own), folder, ghost, run.hold or 5.0, cannot(own), situation.meta, situation=situation)
        shown = Shown(page.host, page.port, run.anywhere, outfit, path_ahead(ship, bands))
    return afloat(
        replace(played, rate=run.rate or usual), page=shown, wire=wiring,
        links=Links(page.signalk, page.rosbridge, page.can, page.ardupilot, page.servo, run.anywhere), record=record,
        judge=judge, factor=run.factor, duration=run.duration, note=note, printed=printed,
    )  # fmt: skip


def _wiring(wire: Wire, run: RealTime) -> Wiring | None:
    """The wire that is asked for; None without an address, when nothing else may be said of it."""
    if wire.nmea is None:
        for name in _changed(wire):
            raise RequestError(f"--{name} is of a wire; give --nmea udp://127.0.0.1:0")
        return None
    return Wiring(wire.nmea, wire.to, run.anywhere, wire.framed, wire.only, run.hold or 10.0, wire.commander,
                  wire.simulator, wire.log, wire.answer_to, wire.lock_step, wire.patience, wire.beside)  # fmt: skip


def _changed(group: Any) -> list[str]:
    """Options of a group that are given."""
    return [one.name.replace("_", "-") for one in fields(group) if getattr(group, one.name) != one.default]


def _refuse_without_page(page: Page, bands: Bands) -> None:
    if not page.page:
        for name in (*(one for one in _changed(page) if one not in _PAGELESS), *_changed(bands)):
            raise RequestError(f"--{'bands' if name == 'level' else name} is of the page; add --page")


def _recorded(out: Path | None, page: bool) -> tuple[Path | None, Path]:
    """The file of the whole run, and the folder of what the page records."""
    if not page or (out is not None and out.suffix == ".csv"):
        return out, Path()
    folder = out or Path()
    if not folder.is_dir():
        what = "a file" if folder.exists() else "no such folder"
        raise RequestError(f"-o: {folder}: {what}; recordings go into a folder")
    return None, folder


def _charted(played: Scenario, scenario: Path | Scenario | None, chart: str | None) -> tuple[Scenario, Situation]:
    """The scenario with the chart of `--chart`, which the ships then feel, and what a page shows of it."""
    if played.chart is not None and chart is not None:
        raise RequestError(f"--chart is given by the scenario; leave it out, or change {scenario}")
    if played.chart is not None:
        return played, Situation(played.datum, played.epoch, Seen(played.chart))
    situation = situation_of(chart, played.datum, played.epoch)
    return replace(played, chart=situation.shown.chart, datum=situation.datum), situation


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


def _ghost(
    ship: Ship | None, scenario: Path | Scenario | None, departure: Departure, path: Path | None, note: Note
) -> Ghost | None:  # fmt: skip
    if path is None:
        return None
    from ...data.trialfile import read_trial

    if scenario is not None or ship is None:
        raise RequestError("--ghost: the ship begins where its trial does; leave the scenario out")
    for name in ("place", "start", "heading"):
        if getattr(departure, name) is not None:
            raise RequestError(f"--{name} and --ghost both set the position; leave out --{name}")
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
