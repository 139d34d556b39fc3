"""A stack in a process of its own, which knows nothing but sentences: one encounter in the range, in lock step."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, cast

from ...core.errors import RunError
from ...core.records import Limits, Positive
from ...encounters import Tracks
from ...realtime.links.wiring import Wiring, opened, running_beside
from ...realtime.loop import Loop
from ...realtime.on_wire import Lockstep, OnWire
from ...realtime.range.scenario import Scenario
from ...realtime.range.stage import Stage
from ...realtime.wire import Line as Port

_SENT = "HDT,ROT,RMC,VBW,TTM,VDM,ZDA"


@dataclass(frozen=True, kw_only=True)
class Program:
    """A stack as a case file has it.

    Attributes:
        command: what runs it, in the folder of the case; ``{address}`` is HOST:PORT of the ship, udp.
        sends: sentences that it is sent.
        answers: the sentence that it answers each time.
        patience: longest wait for an answer [s of the clock].
    """

    command: Annotated[str, Limits(least=1)]
    sends: str = _SENT
    answers: str = "ZDA"
    patience: Positive = 10.0

    def wiring(self, folder: Path) -> Wiring:
        """The wire on which it steers.

        Raises:
            RequestError: a sentence that is none.
        """
        return Wiring("udp://127.0.0.1:0", only=self.sends, answers=self.answers, lock_step=True,
                      patience=self.patience, beside=self.command, folder=folder)  # fmt: skip


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


class _Watch:
    """Whether the stack answers, and the model of the own ship is valid, tick by tick; attributes as of `Ran`."""

    def __init__(self, stage: Stage, wiring: Wiring) -> None:
        self._vessel, self.silent, self.valid, self.spoke = stage.own, None, True, False
        self._step = Lockstep(stage.loop, cast("OnWire", stage.on_wire), wiring.answers, wiring.patience)
        stage.loop.after(self.tick)

    silent: float | None

    def meet(self, alive: Callable[[], bool]) -> None:
        """Wait for its first sentence.

        Raises:
            RunError: none comes.
        """
        self._step.alive, self.silent = alive, 0.0
        self._step.meet()
        self.silent, self.spoke = None, True

    def tick(self, loop: Loop) -> None:
        """Take note."""
        self.valid &= self._vessel.outside is None
        if self.silent is None and (self._step.failure or not self._step.alive()):
            self.silent = loop.t


def ran(scenario: Scenario, wiring: Wiring) -> Ran:
    """Run one encounter to its end, whatever becomes of the stack.

    Raises:
        RequestError: a program that cannot be run.
        WireError: a sentence that the ship cannot send.
    """
    with opened(wiring) as port:
        stage = Stage(scenario, math.inf, wiring.line(cast("Port", port), None))
        watch = _Watch(stage, wiring)
        with suppress(RunError), running_beside(wiring, port, lambda _: None) as alive:
            watch.meet(cast("Callable[[], bool]", alive))
            stage.run()
        stage.run()  # where it fell silent, on its last orders
    failed = any(vessel.failure is not None for vessel in stage.loop.vessels.values())
    return Ran(None if failed else stage.wakes.tracks, watch.silent, watch.valid, watch.spoke)
