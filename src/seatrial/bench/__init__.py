"""Benchmarks: how fast, as a ratio to another program that does the same on this machine, in this run.

Contract: `PEERS` names what can be compared; `peer.measure()` times both sides, `peer.installed` says whether there
is anything to time.  Ratios hold from machine to machine far better than times; `timing.control_loop` before and
after shows whether the machine had other work.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec

from ..core.values import dataclass


@dataclass(frozen=True)
class Row:
    """Times of one thing on both sides [s]."""

    what: str
    ours: float
    theirs: float

    @property
    def ratio(self) -> float:
        """How many times as long the peer takes."""
        return self.theirs / self.ours


@dataclass(frozen=True)
class Peer:
    """A program that ours is compared with: its import name, what is timed, how to get it."""

    name: str
    about: str
    module: str
    get: str
    measure: Callable[[], tuple[Row, ...]]

    @property
    def installed(self) -> bool:
        """Whether it can be imported."""
        return find_spec(self.module) is not None

    @property
    def version(self) -> str:
        """Of the installed distribution; "" where unknown."""
        try:
            return version(self.module)
        except PackageNotFoundError:
            return ""


# A peer is imported when it is measured, so that a list of the peers costs nothing.
def _floats() -> tuple[Row, ...]:
    from . import turn

    return (Row("a right-hand side of the MMG model, a ship", turn.per_call(), turn.bare()),)


def _scipy() -> tuple[Row, ...]:
    from . import turn

    return (Row("a right-hand side within the solver, a ship", turn.per_call(), turn.by_scipy()),)


def _shipmmg() -> tuple[Row, ...]:
    from . import shipmmg, turn

    even, zigzag = shipmmg.even_turn(), shipmmg.even_zigzag(shipmmg.random_ships())
    return (
        Row("a right-hand side of the MMG model, a ship", turn.per_call(), shipmmg.their_call()),
        Row(f"a turn of {turn.DURATION:g} s at equal error, a ship", even.ours, even.theirs),
        Row(f"a zigzag of {shipmmg.SECONDS:g} s at equal error, a ship", zigzag.ours, zigzag.theirs),
    )


def _fossen() -> tuple[Row, ...]:
    from . import fossen

    return (Row("an Euler step of the 190 000 dwt tanker, a ship", fossen.ours(), fossen.theirs()),)


PEERS = (
    Peer("floats", "our own equations on Python floats", "seatrial", "comes with seatrial", _floats),
    Peer("scipy", "solve_ivp on our equations on Python floats", "scipy", "comes with seatrial", _scipy),
    Peer("shipmmg", "the same 7 m KVLCC2 in shipmmg", "shipmmg", 'pip install "seatrial[bench]"', _shipmmg),
    Peer("fossen", "the same tanker in Fossen's PythonVehicleSimulator", "python_vehicle_simulator",
         "from its repository, cybergalactic/PythonVehicleSimulator", _fossen),
)  # fmt: skip
"""In the order they are measured in."""
