"""The ship's side of the bridge, without a network: requests, command, the data that the page shows, recordings."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Protocol

from ...core.errors import RefusalError as RefusalError
from ...core.values import dataclass, field
from ...data import DataError
from ...environment import Uniform
from ...manoeuvres import Manoeuvre
from ...ships.felt import feels
from ...simulate.approach import approach
from ..helm import CommandError
from ..loop import Loop
from .autopilot import Autopilot
from .command import Command
from .drill import Drill
from .ghost import Ghost
from .path import Ahead
from .recorder import Recorder, still
from .situation import Situation
from .view import OWN, Moment, Trail, bells, gear, indices_json, motion, order_json, outline

PERIOD = 0.05
"""Time between two pictures [s]."""

_TOLD = 6
_KEPT = ("wave_x", "wave_y", "wave_T", "per_depth")
_FELT = {"wind": "wind_x", "current": "current_x"}
Orderer = Callable[[float], Manoeuvre]
"""Makes a manoeuvre for the present revolutions [1/s]."""

Request = Mapping[str, Any]
"""A request: the action ("do") and its arguments by name."""


def number(said: Request, name: str) -> float:
    """A number of a request; RefusalError: it is missing, or not a finite number."""
    value = said.get(name)
    if not isinstance(value, bool) and isinstance(value, int | float):
        with suppress(OverflowError):  # an integer with hundreds of digits
            if math.isfinite(value):
                return float(value)
    raise RefusalError(f"{name} must be a finite number")


class Companion(Protocol):
    """Data and requests of a range around the ship."""

    doing: Mapping[str, Callable[[Request], None]]

    def hello(self) -> dict[str, Any]:
        """Constant data."""
        ...

    def frame(self) -> dict[str, Any]:
        """Data that change."""
        ...

    def refusal(self) -> str:
        """Why the page may not steer now; empty if it may."""
        ...

    def weather(self) -> None:
        """The weather has been set from the page."""


@dataclass(frozen=True)
class Outfit:
    """Equipment of a bridge apart from the ship.

    Attributes:
        drills: manoeuvres by the text of their button.
        folder: folder for recordings.
        ghost: a measured trial to show beside the ship, if any.
        hold: longest silence of the commander [s of the clock].
        cannot: manoeuvres that the ship cannot perform, with the reason.
        meta: further sidecar entries of the recordings, such as `recording.dated`.
        companion: a range around the ship, if there is one.
        situation: place, date and chart.
        ahead: path of a fitted ship with its bands; None: the page draws one at constant speed and rate of turn.
    """

    drills: Mapping[str, Orderer] = field(default_factory=dict[str, Orderer])
    folder: Path = Path()
    ghost: Ghost | None = None
    hold: float = 5.0
    cannot: Mapping[str, str] = field(default_factory=dict[str, str])
    meta: Mapping[str, Any] = field(default_factory=dict[str, Any])
    companion: Companion | None = None
    situation: Situation = field(default_factory=Situation)
    ahead: Ahead | None = None


class Deck:
    """A loop with a ship called "own", steered by the client that has command.

    `ask`, `hello` and `frame` are called from one thread; the loop runs in another.

    Attributes:
        command: which client has command.
        leaps: how often the ships were set to another time, after which the trail differs.
        fresh: called from the thread of the loop when there is a new picture.
    """

    def __init__(self, loop: Loop, outfit: Outfit, clock: Callable[[], float] = time.monotonic) -> None:
        self._loop, self._outfit, self._clock = loop, outfit, clock
        self._vessel = loop.vessels[OWN]
        ship = self._vessel.plant.ship
        self._speed, self._gear = ship.speed, gear(self._vessel.plant)
        self._rudder = next((order for order in self._gear if order.kind == "rudder"), None)
        self.command = Command(outfit.hold)
        self.fresh: Callable[[], None] = lambda: None
        self._trail = Trail(self._vessel.plant, self._speed)
        self._autopilot = Autopilot(self._vessel.plant)
        self._drill: Drill | None = None
        self._drill_name, self._drill_turns = "", 0.0
        self._recorder = Recorder(loop, outfit.folder, outfit.meta)
        self._kept: tuple[float, bytes, tuple[Moment, ...]] | None = None
        self.leaps = 0
        self._following = self._was_stale = False
        self._due = -math.inf
        self._seen = motion(loop, self._gear)
        self._doing: Mapping[str, Callable[[Request], None]] = {
            "order": self._order, "around": self._around, "drill": self._begin, "end": lambda _: self._let_go(),
            "hold": self._hold, "manual": lambda _: self._let_go(),
            "record": lambda _: self._recorder.start(), "unrecord": self._stop_recording, "ghost": self._lay_ghost,
            "pause": lambda _: loop.pause(), "resume": lambda _: loop.resume(), "step": self._step, "pace": self._pace,
            "reset": lambda _: loop.reset(), "save": self._save, "back": self._back,
            **({} if outfit.companion is None else outfit.companion.doing),
        }  # fmt: skip
        loop.after(self._tick)
        loop.keep("the bridge", self)

    def ask(self, who: str, said: Request) -> str:
        """Carry out a request of a client; returns the reason of a refusal, else an empty text."""
        now, what = self._clock(), said.get("do")
        self.command.beat(who, now)
        if what == "take":
            return "" if self.command.take(who, now) else f"{self.command.holder} has been asked for command"
        if what == "give":
            return "" if self.command.give(who, now) else "nobody asks for command, or you do not have it"
        if what == "keep":
            self.command.keep(who)
        if what in ("keep", "beat"):
            return ""
        do = self._doing.get(what) if isinstance(what, str) else None
        if do is None:
            return "no such request"
        if who != self.command.holder:
            return f"{self.command.holder or 'nobody'} has command; ask for it first"
        try:
            do(said)
        except (ValueError, OSError) as error:
            return str(error)
        return ""

    def hello(self, who: str) -> dict[str, Any]:
        """Constant data, and the trail so far."""
        plant, ghost = self._vessel.plant, self._outfit.ghost
        others = {name: outline(one.plant) for name, one in self._loop.vessels.items() if name != OWN}
        return {
            "hello": who, "ship": outline(plant), "speed": self._speed, "others": others, "rate": self._loop.rate,
            "orders": [order_json(order) for order in self._gear], "bells": bells(),
            "drills": list(self._outfit.drills), "cannot": dict(self._outfit.cannot),
            "ghost": None if ghost is None else {"name": ghost.name, "duration": ghost.duration, "ship": ghost.ship},
            "feels": {what: feels(plant.ship, channel) for what, channel in _FELT.items()},
            "trail": self._trail.rows(), "hold": self._outfit.hold,
            "autopilot": self._autopilot.able, **self._outfit.situation.hello(plant),
            "range": None if self._outfit.companion is None else self._outfit.companion.hello(),
            "bands": None if self._outfit.ahead is None else self._outfit.ahead.hello(),
        }  # fmt: skip

    def frame(self) -> dict[str, Any]:
        """Data that change: the present picture."""
        loop, vessel, command, now = self._loop, self._vessel, self.command, self._clock()
        if self._due == -math.inf:  # set to another state, with no tick since
            self._look(None)
        stale = command.stale(now)
        if stale and not self._was_stale:
            loop.tell(OWN, "stale", f"{command.holder} is silent; the last orders hold")
        self._was_stale = stale
        report, drill = loop.report, self._drill
        return {
            **self._seen, "paused": loop.paused, "factor": None if math.isinf(loop.factor) else loop.factor,
            "command": [command.holder, command.asking, stale, sorted(command.present)],
            "clipped": sorted(vessel.clipped), "outside": vessel.outside, "failed": vessel.failure,
            "late": report.overruns, "told": sum(report.events.values()),
            "events": [[round(e.t, 2), e.kind, e.text] for e in loop.events[-_TOLD:]],
            "record": self._recorder.told, "kept": None if self._kept is None else self._kept[0],
            "drill": None if drill is None else
            [self._drill_name, drill.over, drill.complete, indices_json(drill.indices)],
            "following": self._following, "held": self._autopilot.course,
            **self._outfit.situation.frame(vessel.plant),
            "range": None if self._outfit.companion is None else self._outfit.companion.frame(),
            "ahead": None if self._outfit.ahead is None else self._outfit.ahead.told,
        }  # fmt: skip

    def snapshot(self) -> dict[str, Any]:
        """Manoeuvre and ghost in progress, for JSON."""
        drill, ghost = self._drill, self._outfit.ghost
        under_way = None if drill is None or drill.over else [self._drill_name, self._drill_turns, drill.snapshot()]
        return {"drill": under_way, "ghost": None if ghost is None else ghost.laid, "following": self._following,
                "autopilot": self._autopilot.snapshot()}  # fmt: skip

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Restore the result of `snapshot`."""
        self.reset()
        ghost = self._outfit.ghost
        self._autopilot.restore(saved.get("autopilot"))
        if saved["drill"] is not None:
            name, turns, state = saved["drill"]
            self._set_about(name, turns).restore(state)
        if ghost is not None and saved["ghost"] is not None:
            ghost.lay(saved["ghost"])
            self._following = bool(saved["following"])

    def reset(self) -> None:
        """End manoeuvres, and start the ghost at the ship's position."""
        self._let_go()
        self._drill, self._due = None, -math.inf
        self.leaps += 1
        self._trail.clear()
        if self._outfit.ahead is not None:
            self._outfit.ahead.forget()
        if self._outfit.ghost is not None:
            self._outfit.ghost.lay((0.0, *(self._vessel.plant[name] for name in ("x", "y", "psi"))))

    def close(self) -> list[Path]:
        """End the recording; returns its files."""
        if self._outfit.ahead is not None:
            self._outfit.ahead.close()
        return self._recorder.stop()

    def _tick(self, loop: Loop) -> None:
        """After each tick, in the thread of the loop."""
        plant = self._vessel.plant
        self._steer(loop)
        rudder = self._rudder
        self._trail.see(loop.t, rudder.actual(plant) if rudder else 0.0)
        now = self._clock()
        if self._outfit.ahead is not None and self._vessel.failure is None:
            self._outfit.ahead.see(plant, now)
        if now >= self._due - 0.2 * PERIOD:
            self._due = max(self._due + PERIOD, now)
            self._look(self._seen)
            self.fresh()

    def _look(self, before: Mapping[str, Any] | None) -> None:
        seen = motion(self._loop, self._gear, before)
        ghost = self._outfit.ghost
        self._seen = {**seen, "ghost": None if ghost is None else ghost.beside(seen["t"], seen["own"])}

    def _steer(self, loop: Loop) -> None:
        drill, ghost, plant = self._drill, self._outfit.ghost, self._vessel.plant
        if self._vessel.failure is not None:
            return
        if self._outfit.companion is not None and self._outfit.companion.refusal():
            self._let_go()
            return
        if drill is not None and not drill.over:
            orders: Mapping[str, float] = drill.steer(plant)
            if drill.over and "delta" in plant.orders:
                orders = {**orders, "delta": 0.0}
                loop.tell(OWN, "drill", f"{self._drill_name} {'is complete' if drill.complete else 'is over'}; "
                          "rudder midships")  # fmt: skip
        elif self._following and ghost is not None:
            orders = ghost.orders(loop.t)
        elif self._autopilot.course is not None:
            orders = {"delta": self._autopilot.rudder(1.0 / loop.rate)}
        else:
            return
        for name, value in orders.items():
            loop.order(OWN, name, value)

    def _order(self, said: Request) -> None:
        value, name = number(said, "value"), said.get("name")
        if name not in self._vessel.plant.orders:
            raise CommandError("no such control")
        self._steers()
        kind = next((order.kind for order in self._gear if order.name == name), "")
        if self._autopilot.course is None or kind != "engine":  # a held heading leaves the engine to the mariner
            self._let_go()
        self._loop.order(OWN, str(name), value)

    def _hold(self, said: Request) -> None:
        course = number(said, "psi")
        self._steers()
        self._sails()
        if self._autopilot.course is None:
            self._let_go()
        self._autopilot.engage(course)

    def _around(self, said: Request) -> None:
        U_T, U_C = number(said, "U_T"), number(said, "U_C")
        if not (0.0 <= U_T <= 60.0 and 0.0 <= U_C <= 5.0):
            raise RefusalError("wind is 0 to 60 m/s, current 0 to 5 m/s")
        for what, speed in (("wind", U_T), ("current", U_C)):
            if speed and not feels(self._vessel.plant.ship, _FELT[what]):
                raise RefusalError(f"{self._vessel.plant.ship.name} has no force of {what}; this has no effect")
        new = Uniform(U_T, number(said, "gamma_T"), U_C, number(said, "gamma_C")).now()
        for name, vessel in self._loop.vessels.items():
            plant = vessel.plant
            self._loop.surround(name, new._replace(**{kept: plant[kept] for kept in _KEPT}))
            if U_T and not feels(plant.ship, "wind_x"):
                self._loop.tell(name, "calm", f"{plant.ship.name} has no force of wind and is not affected")
        if self._outfit.companion is not None:
            self._outfit.companion.weather()

    def _begin(self, said: Request) -> None:
        name, plant = str(said.get("name")), self._vessel.plant
        if name not in self._outfit.drills or name in self._outfit.cannot:
            raise RefusalError(self._outfit.cannot.get(name, "no such manoeuvre"))
        self._steers()
        self._sails()
        ordered = plant["n_P_cmd"] if "n_P" in plant.controls else 0.0
        self._set_about(name, ordered or approach(plant.ship)[1])

    def _set_about(self, name: str, turns: float) -> Drill:
        policy = self._outfit.drills[name](turns)
        self._let_go()
        self._drill_name, self._drill_turns = name, turns
        self._drill = Drill(policy, self._vessel.plant, self._speed)
        return self._drill

    def _let_go(self) -> None:
        """End automatic steering; a manual order does so."""
        self._following = False
        self._autopilot.disengage()
        if self._drill is not None:
            self._drill.over = True

    def _stop_recording(self, _: Request) -> None:
        if not self._recorder.stop():
            raise DataError("nothing has been recorded")

    def _save(self, _: Request) -> None:
        self._sails()
        with still(self._loop):
            self._kept = self._loop.t, self._loop.snapshot(), self._trail.snapshot()

    def _back(self, _: Request) -> None:
        if self._kept is None:
            raise RefusalError("no state was saved")
        with still(self._loop):
            self._loop.restore(self._kept[1])
            self._trail.restore(self._kept[2])

    def _pace(self, said: Request) -> None:
        self._loop.pace(math.inf if said.get("factor") == "fastest" else number(said, "factor"))

    def _lay_ghost(self, said: Request) -> None:
        ghost, plant = self._outfit.ghost, self._vessel.plant
        if ghost is None:
            raise RefusalError("no ghost; start the bridge with --ghost TRIAL")
        self._steers()
        self._sails()
        self._let_go()
        ghost.lay((self._loop.t, plant["x"], plant["y"], plant["psi"]))
        self._following = said.get("follow") is True

    def _steers(self) -> None:
        refusal = "" if self._outfit.companion is None else self._outfit.companion.refusal()
        if refusal:
            raise RefusalError(refusal)

    def _sails(self) -> None:
        if self._vessel.failure is not None:
            raise RefusalError("the simulation of the ship failed; reset first")

    def _step(self, _: Request) -> None:
        if not self._loop.paused:
            raise RefusalError("pause first")
        self._loop.step()
