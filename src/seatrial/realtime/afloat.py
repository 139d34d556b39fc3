"""One door afloat: a scenario under way, with a page, a wire, links and a recording, and what became of it.

The parts are given or left out: `seatrial steer`, `bridge` and `range` are presets of this function.
"""

from __future__ import annotations

import math
import secrets
from collections.abc import Callable, Generator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any, BinaryIO

from ..core.errors import RequestError, WireError, obeyed
from ..core.listening import HERE, address, listen
from ..core.values import dataclass, field, replace
from ..data import DataError
from ..encounters.rules import Role
from ..models import STATES
from .bridge.deck import Deck, Outfit
from .bridge.path import Ahead, Open
from .bridge.view import OWN
from .links.ardupilot import Sitl, numbered
from .links.wiring import Note, Wiring, gone, opened, running_beside, tell_places, writing
from .loop import Clock, Loop
from .on_wire import Lockstep
from .plant import Plant
from .range.alerts import PILOT
from .range.judge import Judged
from .range.panel import Panel
from .range.scenario import Scenario
from .range.stage import Line, Stage
from .range.wakes import Passed
from .recording import Recording
from .wire import Line as Port
from .wire import Mute

DEGREE = math.pi / 180.0

@dataclass(frozen=True)
class Page:
    """A page on which a mariner sees the ship and may steer it.

    Attributes:
        host, port: where it is served; port 0 takes a free one.
        anywhere: whether other machines may see it, with a key.
        outfit: its buttons, recordings, ghost, place and chart; `companion` and `ahead` are put in.
        bands: of the path ahead; None: a path without them.
    """

    host: str = HERE
    port: int = 8020
    anywhere: bool = False
    outfit: Outfit = field(default_factory=Outfit)
    bands: Open | None = None


@dataclass(frozen=True)
class Links:
    """Links of other kinds: Signal K and rosbridge at the port of the page, NMEA 2000 on a bus, ArduPilot's SITL.

    Attributes:
        ardupilot: where SITL sends its servos, such as ``udp://127.0.0.1:9002``; it then has the clock.
        servos: orders by servo, such as ``3=n_P``, in place of the usual ones.
        anywhere: whether that address may be beyond this machine.
    """

    signalk: bool = False
    rosbridge: bool = False
    can: str | None = None
    ardupilot: str | None = None
    servos: tuple[str, ...] = ()
    anywhere: bool = False

    def __bool__(self) -> bool:
        # ArduPilot needs no wire
        return self.signalk or self.rosbridge or self.can is not None


@dataclass(frozen=True)
class Voyage:
    """A scenario that has been under way.

    Attributes:
        stage: in its final state.
        passed: how others were passed, by name.
        judged: the criteria, where the run is judged.
        written: recorded trial files.
        failure: why the run failed or ended early; None if it did not.
        silence: when the autopilot on the wire of a judged run was silent; empty where it never was.
    """

    stage: Stage
    passed: Mapping[str, Passed]
    judged: tuple[Judged, ...]
    written: tuple[Path, ...]
    failure: str | None
    silence: str = ""

    @property
    def plant(self) -> Plant:
        """The own ship."""
        return self.stage.own.plant

    @property
    def state(self) -> dict[str, float]:
        """Its state by name, SI units."""
        return {name: self.plant[name] for name in STATES}

    @property
    def met(self) -> bool:
        """Whether the run reached its end, steered all the time, and every criterion is met."""
        return self.failure is None and not self.silence and all(one.met for one in self.judged)

    @property
    def wanting(self) -> str:
        """What the run lacks, for a line; empty where nothing."""
        missed = [f"{one.name}{f' of {one.where}' if one.where else ''}" for one in self.judged if not one.met]
        said = [self.silence, f"not met: {', '.join(missed)}" if missed else ""]
        return self.failure or "; ".join(filter(None, said))

    def document(self) -> dict[str, Any]:
        """Indices and criteria; metres, seconds and degrees."""
        stage, scenario, loop = self.stage, self.stage.scenario, self.stage.loop
        passed = {
            name: {"distance": one.distance, "at": one.t, "touched": one.touched, "time_in_hand": one.in_hand,
                   "role": Role(int(one.judged.role)).name.lower().replace("_", "-"), "rules": one.margins}
            for name, one in self.passed.items()
        }  # fmt: skip
        error = stage.judge.heading_error
        return {
            "scenario": scenario.title, "ship": scenario.own.ship.name, "time": loop.t, "arrived": stage.judge.arrived,
            "steered_by": stage.handover.holder, "met": self.met, "failure": self.failure or self.silence or None,
            "indices": {
                "passing": passed, "cross_track_max": stage.judge.cross_track,
                "cross_track_rms": stage.judge.cross_track_rms,
                "heading_error_max": None if error is None else error / DEGREE,
                "under_keel": stage.judge.under_keel if math.isfinite(stage.judge.under_keel) else None,
            },
            "criteria": [_criterion(one, self.failure is not None) for one in self.judged],
            "alarms": stage.alarms.told(), "events": stage.told(), "state": stage.digest, "written": self.written,
            "wire": None if stage.on_wire is None else
            {"orders": dict(stage.on_wire.conning.counts), "counts": dict(stage.on_wire.wire.counts)},
        }  # fmt: skip


def _criterion(one: Judged, cut: bool) -> dict[str, Any]:
    """A criterion; met is None where the run ended before it could be broken."""
    angle = one.unit == "rad"
    scale, unit = (1.0 / DEGREE, "deg") if angle else (1.0, one.unit)
    value = None if one.value is None or not math.isfinite(one.value) else one.value * scale
    return {"name": one.name, "ship": one.where or None, "value": value, "limit": one.limit * scale, "unit": unit,
            "met": None if cut and one.met else one.met}  # fmt: skip


def afloat(
    scenario: Scenario, *, page: Page | None = None, wire: Wiring | None = None, links: Links = Links(),
    record: Path | None = None, judge: bool = False, factor: float | None = None, duration: float | None = None,
    note: Note = lambda _: None, printed: Note = lambda _: None,
) -> Voyage:  # fmt: skip
    """Let a scenario run: with a page until Ctrl-C, else to its end; earlier after `duration` or with a program beside.

    Args:
        page: on which a mariner may steer.
        wire: on which an autopilot may steer.
        links: of other kinds; those at the port of the page need one.
        record: new trial file of the own ship.
        judge: whether the criteria of the scenario decide.
        factor: simulated over clock time; unless given 1 with a page or a wire, without them and in lock step infinite.
        duration: simulated time to the end [s]; unless given that of the scenario, with a page infinite.
        note: takes addresses and events.
        printed: takes the standard output of the program beside the ship.

    Raises:
        RequestError: what cannot be carried out; nothing is then left behind.
        RunError: no autopilot on the wire in lock step, or the program beside the ship failed.
    """
    real = page is not None or links.ardupilot is not None or (wire is not None and not wire.lock_step)
    pace = (1.0 if real else math.inf) if factor is None else factor
    with ExitStack() as kept:
        sitl = _sitl(links, wire, factor, kept)
        screen = None if page is None else _Screen(page, kept)
        port, log = kept.enter_context(opened(wire)), kept.enter_context(writing(None if wire is None else wire.log))
        stage = _staged(scenario, pace, _line(wire, port, log, links), screen is not None, sitl, judge)
        tell_places(None if wire is None else wire.log, stage.own)
        recording = None if record is None else stage.record(record)
        step = None if wire is None else _in_step(stage, wire)
        deck = None if screen is None else screen.deck(stage)
        _steered(sitl, stage, links, note)
        _tell(stage, screen, port, note)
        with _bus(stage, links.can), running_beside(wire, port, printed) as alive:
            _end_with(stage.loop, step, alive)
            try:
                if step is not None:
                    step.meet()
                if screen is None or deck is None:
                    stage.run(duration)
                else:
                    screen.show(deck, stage, links, duration or math.inf)
            except KeyboardInterrupt:
                obeyed()
                note("ended")
        written = [*_ended(recording), *([] if deck is None else deck.close())]
    passed = stage.wakes.passed(scenario.limits.cpa, scenario.limits.tcpa)
    judged = stage.judge.judged(passed) if judge else ()
    failure = _failure(stage, recording, step, port)
    return Voyage(stage, passed, judged, tuple(written), failure, _silence(stage) if judge else "")


class _Screen:
    """A page at its port.

    Raises:
        RequestError: the extra `web` is not installed.
    """

    def __init__(self, page: Page, kept: ExitStack) -> None:
        listening = kept.enter_context(listen(page.host, page.port, page.anywhere))
        try:
            from .bridge import server
            from .pages import LOCAL, anywhere
        except ImportError as error:
            raise RequestError(f"a page needs {error.name}; pip install 'seatrial[web]'") from None
        self._page, self._listening, self._server = page, listening, server
        self._hosts = anywhere() if page.anywhere else LOCAL
        self._key = secrets.token_urlsafe(16) if page.anywhere else ""

    @property
    def address(self) -> str:
        """What to open in a browser."""
        return address(self._listening, self._key)

    def deck(self, stage: Stage) -> Deck:
        """The ship's side of the page."""
        ahead = None if self._page.bands is None else Ahead(stage.own.plant, self._page.bands)
        return Deck(stage.loop, replace(self._page.outfit, companion=Panel(stage), ahead=ahead))

    def show(self, deck: Deck, stage: Stage, links: Links, duration: float) -> None:
        """Serve page and links until Ctrl-C or the end of the run."""
        from .links.rosbridge import Rosbridge
        from .links.signalk import SignalK

        kinds = ((links.signalk, SignalK), (links.rosbridge, Rosbridge))
        routes = [kind(stage, self._key).routes for wanted, kind in kinds if wanted]
        self._server.serve(deck, stage.loop, self._listening, self._hosts, self._key, routes, duration)


def _line(wire: Wiring | None, port: Port | None, log: BinaryIO | None, links: Links) -> Line | None:
    """How the ship uses the wire; links without one need a line to nobody, whose orders they give."""
    if wire is None or port is None:
        return Line(Mute()) if links else None
    return wire.line(port, log)


def _sitl(links: Links, wire: Wiring | None, factor: float | None, kept: ExitStack) -> Sitl | None:
    """The link to ArduPilot at its port; None where none is asked for."""
    if links.ardupilot is None:
        if links.servos:
            raise RequestError("--servo is of ArduPilot; give --ardupilot udp://127.0.0.1:9002")
        return None
    if factor is not None or (wire is not None and wire.lock_step):
        raise RequestError("--ardupilot: the autopilot has the clock; leave out --factor and --lock-step")
    try:
        sitl = Sitl(links.ardupilot, links.anywhere)
    except WireError as error:
        raise RequestError(f"--ardupilot: {error}") from None
    kept.callback(sitl.close)
    return sitl


def _steered(sitl: Sitl | None, stage: Stage, links: Links, note: Note) -> None:
    """Let ArduPilot steer the own ship, if it is there."""
    if sitl is None:
        return
    try:
        sitl.steer(stage.loop, OWN, numbered(links.servos))
    except WireError as error:
        raise RequestError(f"--ardupilot: {error}") from None
    stage.handover.join("ardupilot", sitl)
    said = ", ".join(f"servo {servo} {order}" for servo, order in sorted(sitl.servos.items()))
    note(f"waiting for ArduPilot at {sitl.address}, {stage.loop.rate:g} Hz; {said}")


def _staged(
    scenario: Scenario, factor: float, line: Line | None, page: bool, clock: Clock | None, judge: bool
) -> Stage:  # fmt: skip
    if clock is not None:  # who has the clock has command
        scenario = replace(scenario, own=replace(scenario.own, piloted=False))
    try:
        stage = Stage(scenario, factor, line, page, clock)
    except WireError as error:
        raise RequestError(f"--only: {error}") from None
    if judge and stage.wakes.begun:
        raise RequestError(f"{stage.wakes.begun} touch at the start; an encounter begins with ships apart")
    return stage


def _in_step(stage: Stage, wire: Wiring) -> Lockstep | None:
    if not wire.lock_step or stage.on_wire is None:
        return None
    return Lockstep(stage.loop, stage.on_wire, wire.answers, wire.patience)


def _tell(stage: Stage, screen: _Screen | None, port: Port | None, note: Note) -> None:
    """Say where things are, and from now on what happens."""
    stage.loop.after(reporter(note))
    title = stage.scenario.title
    if screen is not None:
        note(f"{title}: {screen.address} (Ctrl-C ends it)")
    if port is not None:
        note(f"{stage.own.plant.ship.name} on {port.address}, {stage.loop.rate:g} Hz, time factor "
             f"{stage.loop.factor:g}; Ctrl-C ends it")  # fmt: skip
    elif screen is None:
        note(title)


def _end_with(loop: Loop, step: Lockstep | None, alive: Callable[[], bool] | None) -> None:
    """Run no longer than the program beside the ship; in lock step its last orders hold."""
    if alive is None:
        return
    if step is not None:
        step.alive = alive
    else:
        loop.after(lambda loop: None if alive() else loop.stop())


def _ended(recording: Recording | None) -> list[Path]:
    if recording is None:
        return []
    with suppress(DataError):  # why the last row was not written is in its failure
        recording.close()
    return recording.paths


@contextmanager
def _bus(stage: Stage, text: str | None) -> Generator[None]:
    """The bus of NMEA 2000, closed at the end."""
    if text is None:
        yield
        return
    from .links.n2k import Bus

    try:
        bus = Bus(stage, text)
    except WireError as error:
        raise RequestError(f"--can: {error}") from None
    try:
        yield
    finally:
        bus.close()


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


def _silence(stage: Stage) -> str:
    """When the autopilot on the wire did not answer any more, by the alarm that this raises."""
    if (alarm := stage.alarms.alarms.get((PILOT, 1))) is None:
        return ""
    spans = [f"from {begin:.0f} s" + (f" to {end:.0f} s" if end else "") for begin, end in alarm.spans]
    return f"the autopilot on the wire was silent {', '.join(spans)}"


def _failure(stage: Stage, record: Recording | None, step: Lockstep | None, port: Port | None) -> str | None:
    if stage.own.failure is not None:
        return f"the simulation of {stage.own.plant.ship.name} failed: {stage.own.failure}"
    if (lost := gone(port)) is not None:
        return lost
    if step is not None and step.failure:
        return step.failure
    return f"the recording is not whole: {record.failure}" if record is not None and record.failure else None
