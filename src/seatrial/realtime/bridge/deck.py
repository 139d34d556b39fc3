"""The ship's side of the bridge: requests in, what the page shows out; no network here."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Any

from ...approach import approach
from ...data import DataError
from ...environment import Uniform
from ...manoeuvres import Manoeuvre
from ..helm import CommandError
from ..loop import Loop
from ..recording import Recording
from .command import Command
from .drill import Drill
from .gear import gear
from .ghost import Ghost
from .view import OWN, Trail, indices_json, motion, order_json, outline

PERIOD = 0.05
"""Time between two pictures [s]."""

_TOLD = 6
Request = Mapping[str, Any]
Orderer = Callable[[float], Manoeuvre]
"""A manoeuvre made at the revolutions [1/s] that she runs at."""


@dataclass(frozen=True)
class Outfit:
    """What a bridge has beside its ship.

    Attributes:
        drills: manoeuvres by the text of their button.
        folder: where recordings go.
        ghost: a measured trial to sail beside, if any.
        hold: how long who has command may be silent [s on the clock].
    """

    drills: Mapping[str, Orderer] = field(default_factory=dict[str, Orderer])
    folder: Path = Path()
    ghost: Ghost | None = None
    hold: float = 5.0


class RefusalError(ValueError):
    """A request that is not carried out; the text says why."""


class Deck:
    """A loop with a ship called "own", steered by whoever has command.

    `ask`, `hello` and `frame` belong to one thread; the loop runs in another.

    Attributes:
        command: who has command.
        fresh: called from the loop's thread when there is a new picture.
    """

    def __init__(self, loop: Loop, outfit: Outfit, clock: Callable[[], float] = time.monotonic) -> None:
        self._loop, self._outfit, self._clock = loop, outfit, clock
        self._vessel = loop.vessels[OWN]
        ship = self._vessel.plant.ship
        self._speed, self._gear = ship.speed, gear(ship)
        self._rudder = next((o for o in self._gear if o.name == "delta"), None) or next(
            (o for o in self._gear if o.name.startswith("delta")), None)  # fmt: skip
        self.command = Command(outfit.hold)
        self.fresh: Callable[[], None] = lambda: None
        self._trail = Trail(self._vessel.plant, self._speed)
        self._drill: Drill | None = None
        self._drill_name = ""
        self._record: Recording | None = None
        self._following = self._was_stale = False
        self._due = -math.inf
        self._seen = motion(loop, self._gear)
        self._doing: Mapping[str, Callable[[Request], None]] = {
            "order": self._order, "around": self._around, "drill": self._begin, "end": self._end,
            "record": self._start_recording, "unrecord": self._stop_recording, "ghost": self._lay_ghost,
            "pause": lambda _: loop.pause(), "resume": lambda _: loop.resume(), "step": self._step,
            "reset": self._reset, "pace": lambda said: loop.pace(_number(said, "factor")),
        }  # fmt: skip
        loop.after(self._tick)

    def ask(self, who: str, said: Request) -> str:
        """Do what somebody on the bridge asks for; why not, else nothing."""
        now, what = self._clock(), said.get("do")
        self.command.beat(who, now)
        if what == "take":
            return "" if self.command.take(who, now) else f"{self.command.holder} has been asked for command"
        if what == "give":
            return "" if self.command.give(who, now) else "nobody asks for command, or you do not have it"
        if what == "keep":
            self.command.keep(who)
            return ""
        if what == "beat":
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
        """What stays, and the way so far."""
        plant, ghost = self._vessel.plant, self._outfit.ghost
        others = {name: outline(one.plant) for name, one in self._loop.vessels.items() if name != OWN}
        return {
            "hello": who, "ship": outline(plant), "speed": self._speed, "others": others, "rate": self._loop.rate,
            "orders": [order_json(order) for order in self._gear], "drills": list(self._outfit.drills),
            "ghost": None if ghost is None else {"name": ghost.name, "duration": ghost.duration},
            "trail": self._trail.rows(), "hold": self._outfit.hold,
        }  # fmt: skip

    def frame(self) -> dict[str, Any]:
        """What changes."""
        loop, vessel, command, now = self._loop, self._vessel, self.command, self._clock()
        stale = command.stale(now)
        if stale and not self._was_stale:
            loop.tell(OWN, "stale", f"{command.holder} is silent; the last orders hold")
        self._was_stale = stale
        report, drill, record = loop.report, self._drill, self._record
        return {
            **self._seen, "paused": loop.paused, "factor": loop.factor,
            "command": [command.holder, command.asking, stale, sorted(command.present)],
            "clipped": sorted(vessel.clipped), "outside": vessel.outside, "failed": vessel.failure,
            "late": report.overruns, "told": sum(report.events.values()),
            "events": [[round(e.t, 2), e.kind, e.text] for e in loop.events[-_TOLD:]],
            "record": None if record is None else [str(record.paths[-1]) if record.paths else "", record.rows],
            "drill": None if drill is None else
            [self._drill_name, drill.over, drill.complete, indices_json(drill.indices)],
            "following": self._following,
        }  # fmt: skip

    def close(self) -> list[Path]:
        """End the recording; the files of it."""
        return self._shut_recording()

    def _tick(self, loop: Loop) -> None:
        """In the loop's thread, after each tick."""
        plant = self._vessel.plant
        self._steer(loop)
        rudder = self._rudder
        self._trail.see(loop.t, rudder.actual(plant) if rudder else 0.0)
        now = self._clock()
        if now < self._due - 0.2 * PERIOD:
            return
        self._due = max(self._due + PERIOD, now)
        self._seen = {**motion(loop, self._gear), "ghost": self._beside(loop)}
        self.fresh()

    def _steer(self, loop: Loop) -> None:
        drill, ghost, plant = self._drill, self._outfit.ghost, self._vessel.plant
        if drill is not None and not drill.over:
            orders: Mapping[str, float] = drill.steer(plant)
            if drill.over and "delta" in plant.orders:
                orders = {**orders, "delta": 0.0}
                loop.tell(OWN, "drill", f"{self._drill_name} {'is complete' if drill.complete else 'has no end'}; "
                          "rudder midships")  # fmt: skip
        elif self._following and ghost is not None:
            orders = ghost.orders(loop.t)
        else:
            return
        for name, value in orders.items():
            loop.order(OWN, name, value)

    def _beside(self, loop: Loop) -> list[float] | None:
        """Pose of the ghost, how far the ship is from it [m], and by how much she heads elsewhere [rad]."""
        ghost, plant = self._outfit.ghost, self._vessel.plant
        pose = None if ghost is None else ghost.pose(loop.t)
        if pose is None:
            return None
        gap = math.hypot(plant["x"] - pose[0], plant["y"] - pose[1])
        return [round(value, 5) for value in (*pose, gap, math.remainder(plant["psi"] - pose[2], 2.0 * math.pi))]

    def _order(self, said: Request) -> None:
        value, name = _number(said, "value"), said.get("name")
        if name not in self._vessel.plant.orders:
            raise CommandError("no such control")
        self._let_go()
        self._loop.order(OWN, str(name), value)

    def _around(self, said: Request) -> None:
        U_T, U_C = _number(said, "U_T"), _number(said, "U_C")
        if not (0.0 <= U_T <= 60.0 and 0.0 <= U_C <= 5.0):
            raise RefusalError("wind is 0 to 60 m/s, current 0 to 5 m/s")
        new = Uniform(U_T, _number(said, "gamma_T"), U_C, _number(said, "gamma_C")).now()
        plant = self._vessel.plant
        for name in self._loop.vessels:
            self._loop.surround(name, new._replace(wave_x=plant["wave_x"], wave_y=plant["wave_y"],
                                                   wave_T=plant["wave_T"], per_depth=plant["per_depth"]))  # fmt: skip

    def _begin(self, said: Request) -> None:
        name, plant = str(said.get("name")), self._vessel.plant
        if name not in self._outfit.drills:
            raise RefusalError("no such manoeuvre")
        ordered = plant["n_P_cmd"] if "n_P" in plant.controls else 0.0
        policy = self._outfit.drills[name](ordered or approach(plant.ship)[1])
        self._let_go()
        self._drill_name, self._drill = name, Drill(policy, plant, self._speed)

    def _end(self, _: Request) -> None:
        self._let_go()

    def _let_go(self) -> None:
        """A hand on the wheel ends whatever steers by itself."""
        self._following = False
        if self._drill is not None:
            self._drill.over = True

    def _start_recording(self, _: Request) -> None:
        if self._record is not None:
            raise RefusalError("recording already")
        plant = self._vessel.plant
        path = self._outfit.folder / f"{plant.ship.name}_{datetime.now():%Y%m%d_%H%M%S}.csv"
        self._record = Recording(plant, path, kind="bridge")
        self._loop.witness(OWN, self._record)

    def _stop_recording(self, _: Request) -> None:
        if not self._shut_recording():
            raise DataError("nothing has been recorded")

    def _shut_recording(self) -> list[Path]:
        record, self._record = self._record, None
        if record is None:
            return []
        self._loop.dismiss(record)
        paused = self._loop.paused
        self._loop.pause()  # no tick while the last row is written
        record.close()
        if not paused:
            self._loop.resume()
        return record.paths

    def _lay_ghost(self, said: Request) -> None:
        ghost, plant = self._outfit.ghost, self._vessel.plant
        if ghost is None:
            raise RefusalError("no ghost; begin the bridge with --ghost TRIAL")
        self._let_go()
        ghost.lay((self._loop.t, plant["x"], plant["y"], plant["psi"]))
        self._following = said.get("follow") is True

    def _step(self, _: Request) -> None:
        if not self._loop.paused:
            raise RefusalError("pause first")
        self._loop.step()

    def _reset(self, _: Request) -> None:
        self._let_go()
        self._drill = None
        self._loop.reset()
        self._trail.clear()
        self._due = -math.inf
        if self._outfit.ghost is not None:
            self._outfit.ghost.lay((0.0, *(self._vessel.plant[name] for name in ("x", "y", "psi"))))
        self._seen = {**motion(self._loop, self._gear), "ghost": self._beside(self._loop)}


def _number(said: Request, name: str) -> float:
    value = said.get(name)
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise RefusalError(f"{name} is to be a finite number")
    return float(value)
