"""A wire by its address: what it carries, who may steer on it, its log, and a program that runs beside the ship."""

from __future__ import annotations

import shlex
import subprocess
import sys
import tempfile
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from ...core.errors import RequestError, RunError, WireError
from ...core.parameters import unknown
from ...core.values import dataclass
from ...data.formats.nmea import beside, write_aboard
from ...sensors.instruments import Anemometer, Gnss, SpeedLog
from ..fleet import Vessel
from ..on_wire import RATES, TRANSPONDER, TRANSPONDER_RATE
from ..range.reports import REPORTED
from ..range.stage import Line
from ..serial_line import SerialLine, is_serial
from ..wire import Address, Authority, Wire
from ..wire import Line as Port

Note = Callable[[str], object]
"""Takes a line for the user."""

_GRACE = 5.0
"""Time in which a program ends that is asked to [s]."""

_KNOWN: Mapping[str, float] = {**RATES, TRANSPONDER: TRANSPONDER_RATE}


@dataclass(frozen=True)
class Wiring:
    """A wire of NMEA 0183, on which a sender may steer.

    Attributes:
        address: ``udp://127.0.0.1:PORT``, ``tcp://...`` or ``serial:///dev/...``.
        to: further addresses to send to (udp).
        anywhere: whether addresses may be beyond this machine.
        framed: whether datagrams are those of IEC 61162-450.
        only: sentences that are sent, separated by commas; None for all.
        hold: longest silence of a commander [s of the simulated time].
        commander: senders that alone may have command, HOST or HOST:PORT.
        simulator: whether sentences are marked as those of a simulator.
        log: new file for the sentences that are sent.
        answers: kind of sentence after which the ship waits for an answer in lock step.
        lock_step: whether it waits.
        patience: longest wait for it [s of the clock].
        beside: a program that runs with the ship, ``{address}`` in it is where the wire is.
        folder: where it runs; the present one unless given.
    """

    address: str
    to: Sequence[str] = ()
    anywhere: bool = False
    framed: bool = False
    only: str | None = None
    hold: float = 10.0
    commander: Sequence[str] = ()
    simulator: bool = False
    log: Path | None = None
    answers: str = "ZDA"
    lock_step: bool = False
    patience: float = 20.0
    beside: str | None = None
    folder: Path | None = None

    def __post_init__(self) -> None:
        if self.answers not in RATES:
            raise RequestError(f"--answer-to: {unknown(self.answers, RATES, 'sentence')}")

    def line(self, port: Port, log: BinaryIO | None) -> Line:
        """How the ship uses an opened port."""
        rates, reports = chosen(self.only)
        authority = Authority.of(tuple(self.commander))
        return Line(port, self.framed, rates, reports, self.hold, authority, self.simulator, log)


@contextmanager
def opened(wire: Wiring | None) -> Generator[Port | None]:
    """The port of a wire, or a serial line, closed at the end; None without a wire.

    Raises:
        WireError: an address that cannot be used, or targets of a line that has none.
    """
    if wire is None:
        yield None
        return
    if not is_serial(wire.address):
        first, *others = (Address.parse(one, wire.anywhere) for one in (wire.address, *wire.to))
        port: Wire | SerialLine = Wire(first, to=others)
    elif wire.to:
        raise WireError("only a wire over udp sends to given addresses; a serial line has one other end")
    else:
        port = SerialLine(wire.address)
    try:
        yield port
    finally:
        port.close()


def gone(port: Port | None) -> str | None:
    """Why a run failed whose serial line was lost and has not come back; None where it is there."""
    if not isinstance(port, SerialLine) or port.peers:
        return None
    return f"{port.address} was lost and has not come back: {port.counts['unsent']} sentences were not sent"


def where(port: Port | None) -> str | None:
    """What a program is told of where a wire is: HOST:PORT, or the path of a serial line; None where there is none."""
    if isinstance(port, Wire):
        return f"{port.address.host}:{port.address.port}"
    return port.path if isinstance(port, SerialLine) else None


@contextmanager
def running_beside(
    wire: Wiring | None, port: Port | None, printed: Note, link: str = ""
) -> Generator[Callable[[], bool] | None]:  # fmt: skip
    """Another program for as long as the ship runs; its standard output follows at the end.

    Args:
        link: where a link of another kind is, ``{link}`` in its command.

    Yields:
        Whether it still runs; None without a program.

    Raises:
        RequestError: it cannot be run.
        RunError: it failed.
    """
    command, at = None if wire is None else wire.beside, where(port)
    if wire is None or command is None or at is None:
        yield None
        return
    words = [word.replace("{address}", at).replace("{link}", link) for word in shlex.split(command)]
    if words and words[0] == "python":  # the one that runs here, whatever the path holds
        words[0] = sys.executable
    with tempfile.TemporaryFile() as output:
        try:
            process = subprocess.Popen(words, stdout=output, cwd=wire.folder)
        except (OSError, IndexError) as error:
            raise RequestError(f"--beside: '{command}' cannot be run: {error}") from None
        failed: int | None = None
        try:
            yield lambda: process.poll() is None
            failed = process.poll()
        finally:
            if process.poll() is None:
                process.terminate()
            try:
                process.wait(_GRACE)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
            output.seek(0)
            printed(output.read().decode(errors="replace"))
    if failed:
        raise RunError(f"the program of --beside failed, exit status {failed}")


def chosen(only: str | None) -> tuple[dict[str, float] | None, tuple[str, ...]]:
    """Rates of the own ship's sentences [Hz], None for the usual ones, and the others that are sent, from --only.

    Raises:
        RequestError: an unknown sentence.
    """
    if only is None:
        return None, REPORTED
    names = [name.strip().upper() for name in only.split(",")]
    for name in names:
        if name not in _KNOWN and name not in REPORTED:
            raise RequestError(f"--only: {unknown(name, (*_KNOWN, *REPORTED), 'sentence')}")
    rates = {name: _KNOWN[name] for name in names if name in _KNOWN}
    return rates, tuple(name for name in names if name in REPORTED)


@contextmanager
def writing(path: Path | None) -> Generator[BinaryIO | None]:
    """A new file for the sentences of a wire; it is removed where the request turns out to be wrong."""
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
