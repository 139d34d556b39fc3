"""The command steer: a ship on the wire, for whatever speaks NMEA 0183."""

from __future__ import annotations

import math
import shlex
import subprocess
import sys
import tempfile
import time
from collections.abc import Generator
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.util import find_spec
from pathlib import Path
from typing import BinaryIO

from ..core.parameters import unknown
from ..data import DataError
from ..data.geodesy import Datum
from ..data.nmea.ship import Fittings
from ..engine import SimulationError
from ..models import STATES
from ..realtime.aboard import RATES, TRANSPONDER, TRANSPONDER_RATE
from ..realtime.loop import Loop, LoopError
from ..realtime.on_wire import OnWire, Speech, Targets
from ..realtime.plant import Plant
from ..realtime.recording import Recording
from ..realtime.wire import Address, Authority, Wire, WireError
from ..sensors.suite import draught, usual
from ..ships import Ship
from .fleet import keep_course, others_of, plant_of, rate_of
from .support import DEGREE, UsageError, around_ship, emit, finite, note, obeyed, positive, read_ship, say, speed_of

_NAME = "ship"


@dataclass(frozen=True)
class Request:
    """What the user asks of `steer`; as on the command line."""

    ship: str
    nmea: str
    to: tuple[str, ...] = ()
    anywhere: bool = False
    framed: bool = False
    only: str | None = None
    place: str | None = None
    antenna: str | None = None
    rate: float = 10.0
    factor: float = 1.0
    duration: float | None = None
    hold: float = 10.0
    speed: float | None = None
    heading: float = 0.0
    wind: str | None = None
    current: str | None = None
    sensors: bool = False
    seed: int = 0
    log: Path | None = None
    out: Path | None = None
    beside: str | None = None
    simulator: bool = False
    commander: tuple[str, ...] = ()
    gusts: str | None = None
    waves: str | None = None
    depth: float | None = None
    other: tuple[str, ...] = ()
    mmsi: int | None = None


def steer(asked: Request, json: bool) -> None:
    """Run a ship on the wire until the time is over, or the user has had enough.

    Raises:
        UsageError: a request that cannot be carried out.
        SimulationError: her model blew up, or the program beside her failed.
    """
    positive(rate=asked.rate, duration=asked.duration, hold=asked.hold, speed=asked.speed)
    finite(heading=asked.heading)
    ship = read_ship(asked.ship)
    try:
        address = Address.parse(asked.nmea, asked.anywhere)
        to = [Address.parse(one, asked.anywhere) for one in asked.to]
        loop, plant = _loop(ship, asked)
        speech = Speech(_fittings(ship, asked), _rates(asked.only), asked.framed)
        authority = Authority.of(asked.commander)
        wire = Wire(address, to=to)
    except (WireError, LoopError) as error:
        raise UsageError(str(error)) from None
    try:
        on_wire = _on_wire(loop, wire, speech, asked.hold, authority)
        record = _recording(asked, plant, loop, speech.fittings)
        _heard(loop, on_wire)
        with _writing(asked.log) as on_wire.log:
            note(f"{ship.name} on {wire.address}, {loop.rate:g} Hz, time factor {asked.factor:g}; Ctrl-C ends it")
            _run(loop, asked.duration or math.inf, _beside(asked.beside, wire.address, json))
            _end(record)
    finally:
        wire.close()
    _summary(loop, on_wire, record, json)
    _judge(ship, loop, record)


def _judge(ship: Ship, loop: Loop, record: Recording | None) -> None:
    """Tell of a run that failed.

    Raises:
        SimulationError: she blew up, or what was to be recorded was not.
    """
    if (failure := loop.vessels[_NAME].failure) is not None:
        raise SimulationError(f"{ship.name} sails no more: {failure}")
    if record is not None and record.failure:
        raise SimulationError(f"the recording is not whole: {record.failure}")


def _end(record: Recording | None) -> None:
    """End a recording; why the last row was not written is in its failure."""
    if record is not None:
        with suppress(DataError):
            record.close()


def _on_wire(loop: Loop, wire: Wire, speech: Speech, hold: float, authority: Authority) -> OnWire:
    try:
        return OnWire(loop, _NAME, wire, speech, hold=hold, authority=authority)
    except WireError as error:
        raise UsageError(f"--only: {error}") from None


@contextmanager
def _beside(command: str | None, address: Address, json: bool) -> Generator[subprocess.Popen[bytes] | None]:
    """Another program for as long as she sails; what it printed follows when it is over."""
    if command is None:
        yield None
        return
    words = [word.replace("{address}", f"{address.host}:{address.port}") for word in shlex.split(command)]
    if words and words[0] == "python":  # the one that runs here, whatever the path holds
        words[0] = sys.executable
    with tempfile.TemporaryFile() as said:
        try:
            process = subprocess.Popen(words, stdout=said)
        except (OSError, IndexError) as error:
            raise UsageError(f"--beside: '{command}' cannot be run: {error}") from None
        try:
            yield process
        finally:
            if process.poll() is None:
                process.terminate()
            process.wait()
            said.seek(0)
            (sys.stderr if json else sys.stdout).write(said.read().decode(errors="replace"))


def _run(loop: Loop, duration: float, beside: AbstractContextManager[subprocess.Popen[bytes] | None]) -> None:
    """Sail, telling what happens as it happens; not longer than the program beside her runs.

    Raises:
        SimulationError: that program failed.
    """
    told = 0

    def tell(loop: Loop) -> None:
        nonlocal told
        counted = sum(loop.report.events.values())
        for event in loop.events[-(counted - told) :] if counted > told else ():
            note(f"{event.t:9.1f} s  {event.kind}: {event.text}")
        told = counted

    loop.after(tell)
    with beside as process:
        if process is not None:
            loop.after(lambda loop: loop.stop() if process.poll() is not None else None)
        try:
            loop.run(duration)
        except KeyboardInterrupt:
            obeyed()
            note("ended")
        failed = process is not None and process.poll()
    if failed:
        raise SimulationError(f"the program beside her failed, exit status {failed}")


def _loop(ship: Ship, asked: Request) -> tuple[Loop, Plant]:
    """A loop with the ship in it, and the others that were asked for."""
    rate = rate_of(ship, asked.rate)
    weather = around_ship(
        ship, asked.wind, asked.gusts, asked.current, asked.waves, asked.depth, asked.seed
    ).weather  # fmt: skip
    start = (0.0, 0.0, asked.heading * DEGREE, speed_of(ship, asked.speed), 0.0, 0.0)
    plant = plant_of(ship, rate, weather, start, asked.seed)
    fleet = {_NAME: plant, **others_of(asked.other, rate, weather, asked.seed)}
    antenna = None if asked.antenna is None else _antenna(asked)
    loop = Loop(fleet, rate, asked.factor, sensors={_NAME: usual(ship, antenna)} if asked.sensors else None)
    keep_course(loop, (name for name in fleet if name != _NAME))
    return loop, plant


def _heard(loop: Loop, on_wire: OnWire) -> None:
    """Let others be heard by AIS."""
    others = [name for name in loop.vessels if name != _NAME]
    if others and find_spec("pyais") is None:
        raise UsageError("--other is heard by AIS, which needs the extra 'nmea': pip install 'seatrial[nmea]'")
    if others:
        Targets(loop, others, on_wire)


def _fittings(ship: Ship, asked: Request) -> Fittings:
    latitude, longitude = _pair("--place", asked.place, "LAT,LON in degrees such as 35.1,139.7")
    return Fittings(
        Datum(latitude, longitude), round(time.time()), _antenna(asked), stern=-0.5 * ship.L_pp,
        transducer=draught(ship), simulator=asked.simulator, mmsi=_mmsi(asked.mmsi),
    )  # fmt: skip


def _mmsi(given: int | None) -> int:
    if given is not None and not 200_000_000 <= given <= 799_999_999:
        raise UsageError(f"--mmsi is {given}; that of a ship has nine digits, the first 2 to 7")
    return given or 0


def _antenna(asked: Request) -> tuple[float, float]:
    return _pair("--antenna", asked.antenna, "FORWARD,STARBOARD in metres")


def _pair(option: str, text: str | None, form: str) -> tuple[float, float]:
    if text is None:
        return 0.0, 0.0
    try:
        first, second = (float(part) for part in text.split(","))
    except ValueError:
        raise UsageError(f"{option} is '{text}'; write {form}") from None
    if not (math.isfinite(first) and math.isfinite(second)):
        raise UsageError(f"{option} is '{text}'; write {form}")
    return first, second


def _rates(only: str | None) -> dict[str, float] | None:
    if only is None:
        return None
    known = {**RATES, TRANSPONDER: TRANSPONDER_RATE}
    names = [name.strip().upper() for name in only.split(",")]
    for name in names:
        if name not in known:
            raise UsageError(f"--only: {unknown(name, known, 'sentence')}")
    return {name: known[name] for name in names}


@contextmanager
def _writing(path: Path | None) -> Generator[BinaryIO | None]:
    if path is None:
        yield None
        return
    try:
        file = path.open("xb")
    except FileExistsError:
        raise UsageError(f"--log: {path}: is there already; choose another name") from None
    except OSError as error:
        raise UsageError(f"--log: {path}: {error.strerror}") from None
    try:
        with file:
            yield file
    except UsageError:  # nothing was said
        path.unlink()
        raise


def _recording(asked: Request, plant: Plant, loop: Loop, fittings: Fittings) -> Recording | None:
    if asked.out is None:
        return None
    datum = {"datum": {"latitude": fittings.datum.latitude, "longitude": fittings.datum.longitude}}
    start = datetime.fromtimestamp(fittings.epoch, UTC).isoformat()
    record = Recording(plant, asked.out, kind="by wire", meta={"start": start, **(datum if asked.place else {})})
    loop.witness(_NAME, record)
    return record


def _summary(loop: Loop, on_wire: OnWire, record: Recording | None, json: bool) -> None:
    plant, report = loop.vessels[_NAME].plant, loop.report
    if json:
        emit({
            "ship": plant.ship.name, "address": str(on_wire.wire.address), "t": report.t,
            "state": {name: plant[name] for name in STATES}, "commander": on_wire.conning.commander,
            "mode": on_wire.conning.mode, "orders": dict(on_wire.conning.counts), "wire": dict(on_wire.wire.counts),
            "overruns": report.overruns, "worst_late": report.worst_late, "events": dict(report.events),
            "written": [str(path) for path in record.paths] if record else [],
        })  # fmt: skip
        return
    taken = on_wire.conning.counts["taken"]
    say(
        f"{report.t:g} s sailed, heading {math.degrees(plant['psi']) % 360.0:.1f} deg, {taken} orders taken, "
        f"{on_wire.wire.counts['sent']} datagrams sent, {report.overruns} of {report.ticks} ticks late\n"
    )
    for path in record.paths if record else ():
        say(f"{path}\n")
