"""Lock step with an autopilot on the wire: the ship waits for an answer each time it has sent a certain sentence.

That sentence is ZDA unless another is named: it is the last of its tick, so whoever has it has all.  Where each answer
is one datagram, the order of everything is that of the simulated time, whatever the machines are doing: the run is the
same each time, and as fast as the autopilot answers.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from ...core.errors import RunError
from ..loop import Loop
from ..on_wire import OnWire


class Lockstep:
    """Waits in the loop for an answer to each sentence of one kind.

    Attributes:
        failure: why it gave up; empty while it did not.
        answers: answers so far.
        waited: time for which it has waited [s of the clock].
        alive: whether an answer can still come.
    """

    def __init__(self, loop: Loop, on_wire: OnWire, to: str = "ZDA", patience: float = 10.0) -> None:
        """Wait after each tick in which a sentence `to` is sent, at most `patience` seconds of the clock."""
        self._on_wire, self._to, self._patience = on_wire, to, patience
        self.failure, self.answers, self.waited = "", 0, 0.0
        self.alive: Callable[[], bool] = lambda: True
        loop.after(self.tick)

    def meet(self) -> None:
        """Wait for the first valid sentence, by which a wire over udp learns where to send.

        Raises:
            RunError: none comes.
        """
        if not self._answered():
            raise RunError(f"no valid sentence on {self._on_wire.wire.address} within {self._patience:g} s; is the "
                           "autopilot running, and sending there?")  # fmt: skip

    def tick(self, loop: Loop) -> None:
        """Wait, if the sentence was sent; stop the loop where no answer comes.

        An autopilot that has ended is waited for no more: its last orders hold.
        """
        if self._to not in self._on_wire.said or self.failure or not self.alive():
            return
        if self._answered():
            self.answers += 1
        elif self.alive():
            self.failure = f"no answer within {self._patience:g} s at {loop.t:g} s; each {self._to} is to be answered"
            loop.stop()

    def _answered(self) -> bool:
        wire, begin = self._on_wire.wire, time.monotonic()
        while True:
            heard = wire.poll()
            self._on_wire.hold(heard)
            now = time.monotonic()
            if heard or now - begin > self._patience or not self.alive():
                self.waited += now - begin
                return bool(heard)
            wire.wait(min(0.2, self._patience))
