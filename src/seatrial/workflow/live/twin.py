"""Follow a ship on its own log: state, forecasts, alarms, and what drifts."""

from __future__ import annotations

import math
import socket
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import numpy as np

from ...core.errors import obeyed
from ...core.values import dataclass, replace
from ...data import Trial
from ...data.formats import nmea as sentences
from ...data.sidecar import UNPLACED
from ...data.trialfile import read_trials
from ...models import unit
from ...realtime.twin.card import page as card
from ...realtime.twin.card import parameters, unseen
from ...realtime.twin.likely import likeliest
from ...realtime.twin.live import Live
from ...realtime.twin.page.screen import STATIC, Screen
from ...realtime.twin.saved import learnt, load_state, provenance, save_state
from ...realtime.twin.settings import NOISE, usual
from ...realtime.twin.sources import Ear, Row, channels_of, noise_of, rows_from, rows_of
from ...realtime.wire import WireError
from ...report.blocks import Body, fields, joined, line, table
from ...report.page import write
from ...ships import Ship
from ...ships.writing import save
from ...simulate.steering import steered
from ...study.assumed import SPEED, holds, wanting, with_assumed
from .. import Outcome, RequestError, figure
from ..request import Note, make_folder, pair, ship_of, silent

STATE, MODEL, CARD = "twin.json", "model.toml", "card.html"
"""Files in the folder of a twin."""

# State is saved after so much time of the log, and so much by the clock [s].
_SAVED, _CLOCK = 600.0, 20.0
# A wire that has told a speed for so long and no revolutions has none [s].
_UNTOLD = 30.0
# Trials of a folder follow each other with this gap, in L/U.
_APART = 10.0


@dataclass(frozen=True)
class _Log:
    """What a twin follows.

    Attributes:
        name, channels, noise: of the log; noise where it shows.
        rows: gives its rows from the beginning.
        antenna: where the satellite antenna stands whose place and velocity they hold; None is not known.
        live: whether it comes in by a wire.
        held: controls that keep their value from row to row.
    """

    name: str
    channels: tuple[str, ...]
    noise: Mapping[str, float]
    rows: Callable[[], Iterator[Row]]
    antenna: tuple[float, float] | None
    live: bool = False
    held: tuple[str, ...] = ()


def twin(
    model: str | Path | Ship, *, nmea: str | None = None, mcap: Path | None = None, trial: Path | None = None,
    mapping: Path | None = None, antenna: str | None = None, out: Path | None = None, free: Sequence[str] = (),
    estimator: str = "ekf", rate: float = 10.0, factor: float = math.inf, page: socket.socket | None = None,
    note: Note = silent,
) -> Outcome[Live]:  # fmt: skip
    """Follow a ship on its log to its end, or until Ctrl-C.

    Args:
        model: a name of the library, a ship file or a ship.
        nmea, mcap, trial: the log: one of them; `nmea` may be an address such as udp://127.0.0.1:10110.
        mapping: mapping file of the former two; by default that beside a log of sentences.
        antenna: place of the satellite antenna, ``FORWARD,STARBOARD`` of midship [m]; by default that of the mapping.
            One that nothing states is estimated.
        out: folder for state, ship and card; a twin that was killed goes on from it.
        free: paths of parameters that may drift.
        estimator: ekf or mhe.
        rate: rows a second of what comes in by UDP [Hz].
        factor: time of a log over real time; infinite for as fast as it is read.
        page: listening socket of the page.

    Raises:
        RequestError: a request that cannot be carried out.
        DataError, StudyError: the log or the saved state cannot be used.
    """
    ship = ship_of(model)
    stated = None if antenna is None else pair("--antenna", antenna, "FORWARD,STARBOARD in metres")
    log = _log(ship, nmea, mcap, trial, mapping, rate, note)
    settings = usual(ship, log.channels, noise=log.noise, free=free, antenna=stated or log.antenna,
                     estimator=estimator)  # fmt: skip
    if not log.live:
        settings, found = likeliest(ship, settings, log.rows(), log.held)
        note(f"process noise: {found.motion:g} times the usual in the motion, {found.slow:g} times in slow forces; "
             f"noise of the sensors: {found.noise:g} times their scatter")  # fmt: skip
    live = Live(ship, settings, log.channels, log.held)
    begun = -math.inf
    if out is not None:
        make_folder(out)
        if (out / STATE).exists():
            begun = load_state(live, out / STATE)
            note(f"goes on from t = {begun:.0f} s")
    screen = Screen(live, log.name)
    with _served(screen, page):
        try:
            _follow(live, log, begun, factor, out, screen, note)
        except KeyboardInterrupt:
            obeyed()
            note("ended")
        screen.over = True
        _keep(live, log.name, out, note)
        screen.look(force=True)
    document = card(live, log.name).document
    return Outcome(live, fields(document, _shown(live, log.name)))


def _follow(
    live: Live, log: _Log, begun: float, factor: float, out: Path | None, screen: Screen, note: Note
) -> None:  # fmt: skip
    saved, clock, start, told = begun, time.monotonic(), None, len(live.alarms)
    shift = begun + _APART if log.live and math.isfinite(begun) else 0.0
    for t, values in log.rows():
        at = t + shift
        if at <= begun:
            continue
        if math.isfinite(factor) and not log.live:
            start = start or (at, time.monotonic())
            time.sleep(max(0.0, start[1] + (at - start[0]) / factor - time.monotonic()))
        live.feed(at, values)
        screen.heard(at, values)
        for one in live.alarms[told:]:
            note(f"t = {one.named:.0f} s: {one.line}")
        told = len(live.alarms)
        if out is not None and live.follower is not None and (at - saved > _SAVED or time.monotonic() - clock > _CLOCK):
            saved, clock = at, time.monotonic()
            save_state(live, out / STATE)


def _keep(live: Live, log: str, out: Path | None, note: Note) -> None:
    """Write state, ship and card."""
    if live.follower is None:
        raise RequestError(f"{log}: no row shows heading, position and all controls; there is nothing to follow")
    if out is None:
        return
    save_state(live, out / STATE)
    save(learnt(live, log), out / MODEL, provenance(live, log))
    write(out / CARD, card(live, log))
    note(f"wrote {out / MODEL}, {out / CARD}")


def _log(
    ship: Ship, nmea: str | None, mcap: Path | None, trial: Path | None, mapping: Path | None, rate: float, note: Note
) -> _Log:  # fmt: skip
    """The log that was asked for.

    Raises:
        RequestError: none, or more than one.
    """
    given = [one for one in (nmea, mcap, trial) if one is not None]
    if len(given) != 1:
        raise RequestError("give one log: --nmea FILE or udp://HOST:PORT, --mcap FILE, or --trial FILE")
    if nmea is not None and "://" in nmea:
        return _wire(ship, nmea, rate, sentences.read_mapping(mapping) if mapping else sentences.Aboard(), note)
    if nmea is not None:
        aboard = sentences.aboard_of(Path(nmea), mapping)
        # the filter takes the antenna to midship by its own heading, so that a wrong compass moves no fix
        found = (sentences.read(Path(nmea), replace(aboard, antenna=None)),)
        return _of(ship, nmea, found, aboard.place, note)
    if mcap is not None:
        from ...data.robot.topics import read_topics
        from ...data.robot.trial import read

        found = (read(mcap, read_topics(mapping) if mapping else None),)
    else:
        found = tuple(read_trials([trial or Path()]))
    placed = all(UNPLACED not in one.meta.get("processing", ()) for one in found)
    return _of(ship, str(given[0]), found, (0.0, 0.0) if placed else None, note)


def _of(
    ship: Ship, name: str, found: tuple[Trial, ...], antenna: tuple[float, float] | None, note: Note
) -> _Log:  # fmt: skip
    """A log of trials; a control that one lacks is assumed as a fit assumes it, and said."""
    lacking = [{name: told for name, told in wanting(one, ship).items() if told} for one in found]
    found = tuple(with_assumed(one, tuple(names), ship) for one, names in zip(found, lacking, strict=True))
    for control in dict.fromkeys(one for names in lacking for one in names):
        one, told = next((one, names[control]) for one, names in zip(found, lacking, strict=True) if control in names)
        note(_taken(control, float(one[control][0])) if told == SPEED else
             f"no {control} in the log: what its actuator in the ship file makes of {told} is taken")  # fmt: skip
    channels = channels_of(found[0], ship.model.controls)
    for one in found[1:]:
        channels_of(one, ship.model.controls)
    held = (*found[0].meta.get("held", ()), *_at_once(ship))
    return _Log(Path(name).name, channels, noise_of(found[0]), lambda: _one_after_another(ship, found, held),
                antenna, held=held)  # fmt: skip


def _at_once(ship: Ship) -> tuple[str, ...]:
    """Controls that are where they are ordered without delay: one value acts until a row shows the next."""
    return tuple(name for name in ship.model.controls if ship.actuators.of(name).at_once)


def _one_after_another(ship: Ship, trials: Sequence[Trial], held: Sequence[str]) -> Iterator[Row]:
    """The rows of some trials; a file knows how a control went on to its next reading, a wire does not yet."""
    begun = 0.0
    for one in trials:
        shift = begun - float(one.t[0])
        yield from ((t + shift, values) for t, values in rows_of(steered(one, ship.model, held)))
        begun += one.duration + _APART * ship.L_pp / max(ship.speed, 1e-3)


def _taken(control: str, value: float) -> str:
    return (f"no {control} in the log: {figure(value)} 1/s are taken, which hold the first speed in calm water by the "
            "ship file; what the engine does since looks like a change of resistance or of its thrust")  # fmt: skip


def _powered(rows: Iterator[Row], ship: Ship, note: Note) -> Iterator[Row]:
    """Rows of a wire that tells no revolutions with those that hold the first speed, until they are told."""
    model = ship.model
    silent = {name: stand_in for name, (stand_in, _), (order, _)
              in zip(model.controls, model.stands_for, model.follows, strict=True)
              if order == "n_P" and unit(name) == "1/s"}  # fmt: skip
    speeds, taken, begun = list[float](), dict[str, float](), math.nan
    for t, values in rows:
        silent = {name: stand_in for name, stand_in in silent.items() if not {name, stand_in} & values.keys()}
        if silent and not taken:
            speed = values.get("u_w", math.hypot(values.get("v_north", math.nan), values.get("v_east", math.nan)))
            if math.isfinite(speed):
                speeds.append(speed)
                begun = t if math.isnan(begun) else begun
            if t - begun >= _UNTOLD and (speed := float(np.median(speeds))) > 0.0:
                taken = {name: holds(ship, name, speed) for name in silent}
                for name, value in taken.items():
                    note(_taken(name, value))
        yield t, {**{name: value for name, value in taken.items() if name in silent}, **values}


def _wire(ship: Ship, address: str, rate: float, aboard: sentences.Aboard, note: Note) -> _Log:
    """Sentences by UDP."""
    from ...realtime.wire import Address

    try:
        at = Address.parse(address)
    except WireError as error:
        raise RequestError(f"--nmea: {error}") from None
    listening = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        listening.bind((at.host, at.port))
    except OSError as error:
        listening.close()
        raise RequestError(f"--nmea {address}: {error.strerror}; choose another port") from None
    orders = tuple(f"{name}_cmd" for name in ship.model.controls)
    return _Log(address, (*NOISE, "y", "v_east", *ship.model.controls, *orders), {},
                lambda: _powered(rows_from(listening, rate, Ear(aboard=aboard)), ship, note), aboard.place, live=True,
                held=_at_once(ship))  # fmt: skip


def _served(screen: Screen, listening: socket.socket | None) -> Any:
    if listening is None:
        return nullcontext()
    try:
        from ...realtime.pages import Watched
    except ImportError as error:
        raise RequestError(f"--page needs {error.name}; pip install 'seatrial[web]'") from None
    return Watched(screen, STATIC, listening)


def _shown(live: Live, log: str) -> Body:
    t = 0.0 if live.follower is None else live.follower.t
    hours = live.tally.hours
    inside = sum(one.inside() for one in hours)
    size = sum(one.nis for one in hours) / max(1, sum(one.readings for one in hours))
    shown = line(
        f"{live.machine.ship.name} on {log}: {t:.0f} s followed; innovations within their 95 % band in {inside} of "
        f"{len(hours)} hours, {size:.3g} of what they should be"
    )
    if rows := parameters(live):
        shown += table(("parameter", "before", "now", "sd"), (
            (one["path"], figure(one["before"]), figure(one["value"]), figure(one["sd"], 2)) for one in rows
        ))  # fmt: skip
    others = ((one["name"], one["unit"], figure(one["value"], 3), figure(one["sd"], 2)) for one in unseen(live))
    shown += table(("unseen", "unit", "now", "sd"), others, words=(1,))
    shown += table(("ahead [s]", "forecasts", "error [m]", "constant [m]", "held"), (
        (f"{h:g}", str(s.count), figure(s.rms, 3), figure(s.rival, 3), figure(100 * s.held, 3))
        for h, s in live.trust.scores.items()))  # fmt: skip
    alarms = [f"alarm at {one.named:.0f} s: {one.text}" for one in live.alarms if not one.of] or ["no alarm"]
    return shown + joined(map(line, alarms))
