"""A stack in a process of its own, which knows nothing but what links tell: one encounter in the range, in lock step.

Whatever it steers by, it hears of the ships on a wire of NMEA 0183.  Signal K and rosbridge are served as `seatrial
steer` serves them; with ArduPilot the datagrams of its servos are the clock.
"""

from __future__ import annotations

import asyncio
import math
import threading
import time
from collections.abc import Callable, Generator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from typing import Literal, cast

from ...core.errors import RequestError, RunError
from ...core.listening import HERE, listen
from ...core.values import dataclass, replace
from ...encounters import Tracks
from ...realtime.bridge.view import OWN
from ...realtime.links.ardupilot import Sitl
from ...realtime.links.wiring import Wiring, opened, running_beside
from ...realtime.loop import Loop
from ...realtime.on_wire import Answers, Lockstep, OnWire
from ...realtime.range.scenario import Scenario
from ...realtime.range.stage import Stage
from ...realtime.wire import Line as Port

Spoken = Literal["nmea", "signalk", "rosbridge", "ardupilot"]
"""What a stack in a process of its own steers by."""
_ANSWERS: Mapping[Spoken, Answers] = {"nmea": "wire", "signalk": "link", "rosbridge": "link", "ardupilot": "clock"}
_SITL_RATE = 50.0
"""Ticks a second that ArduPilot takes for time [Hz]."""


@dataclass(frozen=True, eq=False)
class Ran:
    """One encounter with it.

    Attributes:
        tracks: of all ships; None where the model of one blew up.
        silent: since when it did not answer [s]; None where it did to the end.  Its last orders hold.
        valid: whether the model of the own ship stayed within its validity.
        spoke: whether it ever said anything.
    """

    tracks: Tracks | None
    silent: float | None
    valid: bool
    spoke: bool


class _Granted:
    """ArduPilot's clock, which goes on by itself where no datagram comes any more.

    Attributes:
        silent: whether none did for `patience` seconds of the machine's clock, or its program has ended.
        alive: whether one can still come.
    """

    def __init__(self, sitl: Sitl, patience: float) -> None:
        self._sitl, self._patience, self.silent, self._alone = sitl, patience, False, 0.0
        self._taken, self._heard = 0, time.monotonic()
        self.alive: Callable[[], bool] = lambda: True

    def now(self) -> float:
        """Time for which ticks are granted [s]."""
        return self._sitl.now() + self._alone

    def sleep(self, seconds: float, /) -> None:
        """Wait for a datagram; where there will be none, let the time pass."""
        if self.silent:
            self._alone += seconds
            return
        alive = self.alive()  # before the look: what it sent before it ended is still taken
        self._sitl.sleep(seconds)
        now, taken = time.monotonic(), self._sitl.counts["taken"]
        if taken != self._taken:
            self._taken, self._heard = taken, now
        self.silent = taken == self._taken and (not alive or now - self._heard > self._patience)


class _Watch:
    """Whether the stack answers, and the model of the own ship is valid, tick by tick; attributes as of `Ran`."""

    def __init__(self, stage: Stage, wiring: Wiring, clock: _Granted | None, by: Answers) -> None:
        self._vessel, self.silent, self.valid, self.spoke = stage.own, None, True, False
        self._clock, on_wire = clock, cast("OnWire", stage.on_wire)
        self._step = Lockstep(stage.loop, on_wire, wiring.answers, wiring.patience, by)
        stage.loop.after(self.tick)

    silent: float | None

    def meet(self, alive: Callable[[], bool]) -> None:
        """Wait for its first sentence.

        Raises:
            RunError: none comes.
        """
        self._step.alive, self.silent = alive, 0.0
        if self._clock is not None:
            self._clock.alive = alive
        self._step.meet()
        self.silent, self.spoke = None, True

    def tick(self, loop: Loop) -> None:
        """Take note."""
        self.valid &= self._vessel.outside is None
        ended = self._clock.silent if self._clock is not None else self._step.failure or not self._step.alive()
        if self.silent is None and ended:
            self.silent = loop.t


def ran(scenario: Scenario, wiring: Wiring, speaks: Spoken = "nmea") -> Ran:
    """Run one encounter to its end, whatever becomes of the stack.

    Args:
        wiring: the wire on which it hears, and the program.
        speaks: by what it steers.

    Raises:
        RequestError: a program that cannot be run, a ship or sensors that a link does not carry.
        WireError: a sentence that the ship cannot send.
    """
    with ExitStack() as kept:
        port, clock, link, sitl = kept.enter_context(opened(wiring)), None, "", None
        if speaks == "ardupilot":
            sitl = Sitl("udp://127.0.0.1:0")
            kept.callback(sitl.close)
            clock, link = _Granted(sitl, wiring.patience), f"{sitl.address.host}:{sitl.address.port}"
            scenario = replace(scenario, rate=_SITL_RATE, own=replace(scenario.own, piloted=False))
        stage = Stage(scenario, math.inf if clock is None else 1.0, wiring.line(cast("Port", port), None), clock=clock)
        if sitl is not None:
            sitl.steer(stage.loop, OWN, {})
        watch = _Watch(stage, wiring, clock, _ANSWERS[speaks])
        if _ANSWERS[speaks] == "link":
            link = kept.enter_context(_served(stage, speaks))
        with suppress(RunError), running_beside(wiring, port, lambda _: None, link) as alive:
            watch.meet(cast("Callable[[], bool]", alive))
            stage.run()
        stage.run()  # where it fell silent, on its last orders
    failed = any(vessel.failure is not None for vessel in stage.loop.vessels.values())
    return Ran(None if failed else stage.wakes.tracks, watch.silent, watch.valid, watch.spoke)


@contextmanager
def _served(stage: Stage, speaks: Spoken) -> Generator[str]:
    """A link at a free port of this machine, in a thread; yields its address.

    Raises:
        RequestError: the extra `web` is not installed.
    """
    try:
        from fastapi import FastAPI

        from ...realtime.links.rosbridge import Rosbridge
        from ...realtime.links.signalk import SignalK
        from ...realtime.pages import attend, server
    except ImportError as error:
        raise RequestError(f"stack.speaks: {speaks} needs {error.name}; pip install 'seatrial[web]'") from None
    app = FastAPI()
    (SignalK if speaks == "signalk" else Rosbridge)(stage).routes(app)
    listening, serving = listen(HERE, 0, False), server(app)
    thread = threading.Thread(target=lambda: asyncio.run(attend(serving, listening)), name="link", daemon=True)
    thread.start()
    try:
        yield f"{HERE}:{listening.getsockname()[1]}"
    finally:
        serving.should_exit = True
        thread.join(5.0)
        listening.close()
