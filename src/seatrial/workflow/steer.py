"""A ship as an NMEA 0183 device in real time: it sends its instruments' sentences and obeys orders."""

from __future__ import annotations

import math
import shlex
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import BinaryIO, Unpack

from ..core.parameters import unknown
from ..data import DataError
from ..data.formats.nmea import beside, write_aboard
from ..data.nmea.ship import NULL_ISLAND, Fittings
from ..engine import SimulationError
from ..environment import Weather
from ..models import STATES
from ..realtime.fleet import Vessel
from ..realtime.loop import Loop, LoopError
from ..realtime.on_wire import RATES, TRANSPONDER, TRANSPONDER_RATE, OnWire, Speech, Targets
from ..realtime.plant import Plant, plant_of, rate_of
from ..realtime.recording import Recording, dated
from ..realtime.serial_line import SerialLine, is_serial
from ..realtime.wire import Address, Authority, Line, Wire, WireError
from ..sensors.instruments import Anemometer, Gnss, SpeedLog
from ..sensors.suite import Suite, draught, usual
from ..ships import Ship
from . import RequestError
from .realtime import Start, datum_of, keep_course, others_of, pair
from .request import (
    DEGREE,
    Around,
    Note,
    finite,
    obeyed,
    positive,
    ship_of,
    silent,
    speed_of,
    surroundings,
)
from .seaway import bound_for

OWN = "ship"


@dataclass(frozen=True)
class Steered:
    """A run on the wire that has ended.

    Attributes:
        loop: the loop; its report counts ticks and events.
        on_wire: who had command, and what was sent and received.
        written: recorded trial files.
        failure: why the ship or the recording failed; None where neither did.
    """

    loop: Loop
    on_wire: OnWire
    written: tuple[Path, ...]
    failure: str | None

    @property
    def plant(self) -> Plant:
        """The ship, in its final state."""
        return self.loop.vessels[OWN].plant

    @property
    def state(self) -> dict[str, float]:
        """Its final state by name, SI units."""
        return {name: self.plant[name] for name in STATES}


def steer(
    ship: str | Path | Ship, nmea: str, *, to: Sequence[str] = (), anywhere: bool = False, framed: bool = False,
    only: str | None = None, place: str | None = None, antenna: str | None = None, rate: float = 10.0,
    factor: float = 1.0, duration: float | None = None, hold: float = 10.0, commander: Sequence[str] = (),
    speed: float | None = None, heading: float = 0.0, other: Sequence[str] = (), mmsi: int | None = None,
    sensors: bool = False, seed: int = 0, log: Path | None = None, out: Path | None = None,
    beside: str | None = None, simulator: bool = False, note: Note = silent, printed: Note = silent,
    sea: str | None = None, rao: Path | None = None, roll_damping: float | None = None, **around: Unpack[Around],
) -> Steered:  # fmt: skip
    """Run a ship as an NMEA 0183 device until the duration is over, Ctrl-C, or the end of the program beside it.

    Args:
        ship: a name of the library, a ship file or a ship.
        note: takes the address and events.
        printed: takes the standard output of the program beside the ship.
        sea, rao, roll_damping: an irregular sea and the operators of the ship's motion in it, see `seaway`.
        around: weather and depth, see `surroundings`.

    The others are the options of `seatrial steer`, whose help has their meaning and units.

    Raises:
        RequestError: a request that cannot be carried out.
        SimulationError: the program beside the ship failed.
    """
    positive(rate=rate, duration=duration, hold=hold, speed=speed)
    finite(heading=heading)
    vessel = ship_of(ship)
    start = (0.0, 0.0, heading * DEGREE, speed_of(vessel, speed), 0.0, 0.0)
    offset = None if antenna is None else pair("--antenna", antenna, "FORWARD,STARBOARD in metres")
    seaway = bound_for(vessel, sea, rao, roll_damping, seed, around, note)
    weather = surroundings(vessel, seed, note, **seaway.around).weather
    try:
        loop = _loop(vessel, start, rate, factor, weather, other, seed, note,
                     {OWN: usual(vessel, offset)} if sensors else None)  # fmt: skip
        speech = Speech(_fittings(vessel, place, offset, mmsi, simulator), rates_of(only), framed)
        authority = Authority.of(tuple(commander))
    except (WireError, LoopError) as error:
        raise RequestError(str(error)) from None
    with opened(nmea, to, anywhere) as wire:
        on_wire = _on_wire(loop, wire, speech, hold, authority)
        seaway.rock(loop.vessels[OWN], on_wire.conning.control)
        record = None if out is None else _recording(loop, out, speech.fittings, place is not None)
        _hear_others(loop, on_wire)
        with writing(log) as on_wire.log:
            tell_places(log, loop.vessels[OWN])
            note(f"{vessel.name} on {wire.address}, {loop.rate:g} Hz, time factor {factor:g}; Ctrl-C ends it")
            _run(loop, duration or math.inf, beside, wire, note, printed)
            if record is not None:
                with suppress(DataError):  # why the last row was not written is in its failure
                    record.close()
    return Steered(loop, on_wire, tuple(record.paths) if record else (), _failure(vessel, loop, record) or gone(wire))


@contextmanager
def opened(nmea: str, to: Sequence[str], anywhere: bool) -> Generator[Line]:
    """The wire at an address, or a serial line, closed at the end.

    Raises:
        RequestError: an address that cannot be used, or targets of a line that has none.
    """
    try:
        if is_serial(nmea):
            if to:
                raise WireError("only a wire over udp sends to given addresses; a serial line has one other end")
            wire: Line = SerialLine(nmea)
        else:
            first, *others = (Address.parse(one, anywhere) for one in (nmea, *to))
            wire = Wire(first, to=others)
    except WireError as error:
        raise RequestError(str(error)) from None
    try:
        yield wire
    finally:
        wire.close()


def maybe(nmea: str | None, to: Sequence[str], anywhere: bool) -> AbstractContextManager[Line | None]:
    """As `opened`; None without an address."""
    return nullcontext() if nmea is None else opened(nmea, to, anywhere)


def gone(wire: Line | None) -> str | None:
    """Why a run failed whose serial line was lost and has not come back; None where it is there."""
    if not isinstance(wire, SerialLine) or wire.peers:
        return None
    return f"{wire.address} was lost and has not come back: {wire.counts['unsent']} sentences were not sent"


def where(wire: Line | None) -> str | None:
    """What a program is told of where a wire is: HOST:PORT, or the path of a serial line; None where there is none."""
    if isinstance(wire, Wire):
        return f"{wire.address.host}:{wire.address.port}"
    return wire.path if isinstance(wire, SerialLine) else None


def _loop(
    ship: Ship, start: Start, rate: float, factor: float, weather: Weather, other: Sequence[str], seed: int,
    note: Note, sensors: Mapping[str, Suite] | None,
) -> Loop:  # fmt: skip
    """A loop with the ship and the others in it."""
    ticks = rate_of(ship, rate)
    fleet = {OWN: plant_of(ship, ticks, weather, start, seed), **others_of(other, ticks, weather, seed)}
    loop = Loop(fleet, ticks, factor, sensors=sensors)
    keep_course(loop, (name for name in fleet if name != OWN), note)
    return loop


def _failure(ship: Ship, loop: Loop, record: Recording | None) -> str | None:
    if (failure := loop.vessels[OWN].failure) is not None:
        return f"the simulation of {ship.name} failed: {failure}"
    if record is not None and record.failure:
        return f"the recording is not whole: {record.failure}"
    return None


def _on_wire(loop: Loop, wire: Line, speech: Speech, hold: float, authority: Authority) -> OnWire:
    try:
        return OnWire(loop, OWN, wire, speech, hold=hold, authority=authority)
    except WireError as error:
        raise RequestError(f"--only: {error}") from None


@contextmanager
def running_beside(
    command: str | None, address: str | None, printed: Note
) -> Generator[subprocess.Popen[bytes] | None]:  # fmt: skip
    """Another program for as long as the ship runs; its standard output follows at the end."""
    if command is None or address is None:
        yield None
        return
    words = [word.replace("{address}", address) for word in shlex.split(command)]
    if words and words[0] == "python":  # the one that runs here, whatever the path holds
        words[0] = sys.executable
    with tempfile.TemporaryFile() as output:
        try:
            process = subprocess.Popen(words, stdout=output)
        except (OSError, IndexError) as error:
            raise RequestError(f"--beside: '{command}' cannot be run: {error}") from None
        try:
            yield process
        finally:
            if process.poll() is None:
                process.terminate()
            process.wait()
            output.seek(0)
            printed(output.read().decode(errors="replace"))


def _run(
    loop: Loop, duration: float, command: str | None, wire: Line, note: Note, printed: Note
) -> None:  # fmt: skip
    """Run the loop, with a note on each event; not longer than the program beside the ship runs.

    Raises:
        SimulationError: that program failed.
    """
    loop.after(reporter(note))
    with running_beside(command, where(wire), printed) as process:
        if process is not None:
            loop.after(lambda loop: loop.stop() if process.poll() is not None else None)
        try:
            loop.run(duration)
        except KeyboardInterrupt:
            obeyed()
            note("ended")
        failed = process is not None and process.poll()
    if failed:
        raise SimulationError(f"the program of --beside failed, exit status {failed}")


def reporter(note: Note) -> Callable[[Loop], None]:
    """A listener of a loop that gives a note on each event."""
    reported = 0

    def report(loop: Loop) -> None:
        nonlocal reported
        counted = sum(loop.report.events.values())
        for event in loop.events[-(counted - reported) :] if counted > reported else ():
            note(f"{event.t:9.1f} s  {event.kind}: {event.text}")
        reported = counted

    return report


def _hear_others(loop: Loop, on_wire: OnWire) -> None:
    """Report the other ships by AIS."""
    others = [name for name in loop.vessels if name != OWN]
    if others and find_spec("pyais") is None:
        raise RequestError("--other is reported by AIS, which needs the extra 'nmea': pip install 'seatrial[nmea]'")
    if others:
        Targets(loop, others, on_wire)


def _fittings(
    ship: Ship, place: str | None, antenna: tuple[float, float] | None, mmsi: int | None, simulator: bool
) -> Fittings:
    if mmsi is not None and not 200_000_000 <= mmsi <= 799_999_999:
        raise RequestError(f"--mmsi is {mmsi}; that of a ship has nine digits, the first 2 to 7")
    return Fittings(
        datum_of(place) or NULL_ISLAND, round(time.time()), antenna or (0.0, 0.0), stern=-0.5 * ship.L_pp,
        transducer=draught(ship), simulator=simulator, mmsi=mmsi or 0,
    )  # fmt: skip


def rates_of(only: str | None, listed: Sequence[str] = ()) -> dict[str, float] | None:
    """Rate of each sentence of the option --only [Hz]; None where it is not given; `listed` is told to be known too.

    Raises:
        RequestError: an unknown sentence.
    """
    if only is None:
        return None
    known = {**RATES, TRANSPONDER: TRANSPONDER_RATE}
    names = [name.strip().upper() for name in only.split(",")]
    for name in names:
        if name not in known:
            raise RequestError(f"--only: {unknown(name, dict.fromkeys((*known, *listed)), 'sentence')}")
    return {name: known[name] for name in names}


@contextmanager
def writing(path: Path | None) -> Generator[BinaryIO | None]:
    if path is None:
        yield None
        return
    try:
        file = path.open("xb")
    except FileExistsError:
        raise RequestError(f"--log: {path}: is there already; choose another name") from None
    except OSError as error:
        raise RequestError(f"--log: {path}: {error.strerror}") from None
    try:
        with file:
            yield file
    except RequestError:  # nothing was sent
        path.unlink()
        beside(path).unlink(missing_ok=True)
        raise


def tell_places(log: Path | None, own: Vessel) -> None:
    """Say beside a log of the wire where the instruments of the own ship stand, for whoever reads it."""
    if log is None or own.watch is None:
        return
    try:
        write_aboard(log, *(own.watch.suite.place(kind) for kind in (Gnss, SpeedLog, Anemometer)))
    except OSError as error:
        raise RequestError(f"--log: {error.filename}: {error.strerror}") from None


def _recording(loop: Loop, out: Path, fittings: Fittings, placed: bool) -> Recording:
    meta = dated(fittings.epoch, fittings.datum if placed else None)
    record = Recording(loop.vessels[OWN].plant, out, kind="by wire", meta=meta)
    loop.witness(OWN, record)
    return record
