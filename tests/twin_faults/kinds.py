"""The faults: what each does, how large it is by a ship's own length and speed, and which causes name it rightly."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from garden.ships import Ship

from .passage import Array, Fault
from .vessels import Vessel

Rows = list[dict[str, float]]
SENSORS = {"position": ("x", "y"), "compass": ("psi",), "rate gyro": ("r",), "log": ("u_w",)}


@dataclass(frozen=True)
class Kind:
    """A kind of fault.

    Attributes:
        name: as the table has it.
        fault: for a vessel, a size (about 1) and an onset.
        right: beginnings of the causes that name it rightly; `{rudder}` and `{shaft}` are the first of the ship.
        within: how soon it should be named [s].
        ordered: whether the log has the orders beside the angles.
        signed: whether it goes either way.
    """

    name: str
    fault: Callable[[Vessel, float, float], Fault]
    right: tuple[str, ...]
    within: float = 60.0
    ordered: bool = True
    signed: bool = False


def _amount(vessel: Vessel, sensor: str, size: float) -> tuple[float, ...]:
    """A step of a sensor that a watch would mind."""
    L, U = vessel.real.length, vessel.real.speed
    return {"position": (0.15 * size * L, -0.1 * size * L), "compass": (math.radians(5.0) * size,),
            "rate gyro": (0.08 * size * U / L,), "log": (0.12 * size * U,)}[sensor]  # fmt: skip


def _spoilt(sensor: str, share: Callable[[float], float]) -> Callable[[Vessel, float, float], Fault]:
    """Readings off by a share of the usual amount, by the time since the onset."""

    def made(vessel: Vessel, size: float, at: float) -> Fault:
        by = _amount(vessel, sensor, size)

        def read(since: float, rows: Rows, k: int) -> dict[str, float]:
            return rows[k] | {name: rows[k][name] + share(since) * one
                              for name, one in zip(SENSORS[sensor], by, strict=True)}  # fmt: skip

        return Fault(at, read=read)

    return made


def _frozen(*channels: str) -> Callable[[Vessel, float, float], Fault]:
    def made(vessel: Vessel, size: float, at: float) -> Fault:
        def read(since: float, rows: Rows, k: int) -> dict[str, float]:
            return rows[k] | {name: rows[k - round(since / vessel.dt)][name] for name in channels}

        return Fault(at, read=read)

    return made


def _late(*channels: str) -> Callable[[Vessel, float, float], Fault]:
    def made(vessel: Vessel, size: float, at: float) -> Fault:
        rows_late = max(1, round(size * min(0.4 * vessel.own, 5.0) / vessel.dt))

        def read(since: float, rows: Rows, k: int) -> dict[str, float]:
            return rows[k] | {name: rows[k - rows_late][name] for name in channels}

        return Fault(at, read=read)

    return made


def _times(channels: Callable[[str], bool], factor: float) -> Callable[[Vessel, float, float], Fault]:
    def made(vessel: Vessel, size: float, at: float) -> Fault:
        def read(since: float, rows: Rows, k: int) -> dict[str, float]:
            return {name: value * (1.0 + factor * size if channels(name) else 1.0) for name, value in rows[k].items()}

        return Fault(at, read=read)

    return made


def _first(vessel: Vessel, stem: str) -> int:
    return next(k for k, name in enumerate(vessel.real.controls) if name.startswith(stem))


def _rudder_offset(vessel: Vessel, size: float, at: float) -> Fault:
    name = vessel.real.controls[_first(vessel, "delta")]
    return Fault(at, read=lambda since, rows, k: rows[k] | {name: rows[k][name] + math.radians(5.0) * size})


def _follow(vessel: Vessel, rates: Array) -> Callable[[float, Array, Array, float], Array]:
    def gear(since: float, orders: Array, now: Array, h: float) -> Array:
        return np.asarray(now + np.clip(orders - now, -rates * h, rates * h))

    return gear


def _gear(share: float, stem: str = "delta") -> Callable[[Vessel, float, float], Fault]:
    """The first rudder moves at a share of its rate; the log has order and angle."""

    def made(vessel: Vessel, size: float, at: float) -> Fault:
        rates = np.array(vessel.real.gear)
        rates[_first(vessel, stem)] *= share
        return Fault(at, gear=_follow(vessel, rates))

    return made


def _unseen(share: float) -> Callable[[Vessel, float, float], Fault]:
    """The same where the log has orders alone: what it shows as the angle is what a healthy gear would have done."""

    def made(vessel: Vessel, size: float, at: float) -> Fault:
        number = _first(vessel, "delta")
        rate, then = share * vessel.real.gear[number], dict[str, float]()

        def acts(since: float, now: Array) -> Array:
            out, wanted = now.copy(), float(now[number])
            held = then.setdefault("angle", wanted)
            reach = rate * (since - then.setdefault("since", since))
            then["angle"], then["since"] = held + min(max(wanted - held, -reach), reach), since
            out[number] = then["angle"]
            return out

        return Fault(at, acts=acts)

    return made


def _thrust(share: float) -> Callable[[Vessel, float, float], Fault]:
    def made(vessel: Vessel, size: float, at: float) -> Fault:
        number = _first(vessel, "n")

        def acts(since: float, now: Array) -> Array:
            out = now.copy()
            out[number] *= share
            return out

        return Fault(at, acts=acts)

    return made


def _grown(**factors: float) -> Callable[[Ship], Ship]:
    def change(ship: Ship) -> Ship:
        found = dict[str, float]()
        for name, factor in factors.items():
            path = f"hull.{name}"
            try:
                found[path] = factor * ship.value(path)
            except KeyError:
                continue
        return ship.having(found)

    return change


def _ship(change: Callable[[Ship], Ship]) -> Callable[[Vessel, float, float], Fault]:
    def made(vessel: Vessel, size: float, at: float) -> Fault:
        changed: dict[int, Ship] = {}

        def ship(real: Ship) -> Ship:
            return changed.setdefault(0, change(real))

        return Fault(at, ship=ship)

    return made


def _heavier(ship: Ship) -> Ship:
    """Draught and mass a quarter up at the same primed coefficients."""
    real: Any = ship
    more = {name: 1.25 * getattr(real, name) for name in ("d", "volume") if hasattr(real, name)}
    return replace(real, **more)


def _another(ship: Ship) -> Ship:
    return _grown(Y_v=0.7, Y_r=0.6, N_v=0.5, N_r=1.5, R_0=1.4, X_0F=1.4)(ship)


def _blown(vessel: Vessel, size: float, at: float) -> Fault:
    """A wind from the north-east that nothing measures, up within half a minute."""
    most = size * 2.0 * vessel.real.speed

    def wind(since: float) -> tuple[float, float]:
        much = most * min(since / 30.0, 1.0)
        return 0.7 * much, 0.7 * much

    return Fault(at, wind=wind)


def _stream(vessel: Vessel, size: float, at: float) -> Fault:
    """The current turns within two lengths."""
    most = 0.1 * size * vessel.real.speed

    def current(since: float) -> tuple[float, float]:
        share = min(since / (2.0 * vessel.own), 1.0)
        return most * share, -most * share

    return Fault(at, current=current)


def _antenna(vessel: Vessel, size: float, at: float) -> Fault:
    """The receiver is taken over by one with its antenna a third of a length further forward: its place is stated."""
    lever = 0.3 * size * vessel.real.length

    def read(since: float, rows: Rows, k: int) -> dict[str, float]:
        psi, first = rows[k]["psi"], rows[k - round(since / vessel.dt)]["psi"]
        more = lever * rows[k]["r"]
        return rows[k] | {
            "x": rows[k]["x"] + lever * (math.cos(psi) - math.cos(first)),
            "y": rows[k]["y"] + lever * (math.sin(psi) - math.sin(first)),
            "v_north": rows[k]["v_north"] - more * math.sin(psi), "v_east": rows[k]["v_east"] + more * math.cos(psi),
        }  # fmt: skip

    return Fault(at, read=read)


def _clock(vessel: Vessel, size: float, at: float) -> Fault:
    return Fault(at, stamp=lambda since: (1.0 + 0.03 * size) * since)


def _ramp(seconds: float) -> Callable[[float], float]:
    return lambda since: 2.0 * since / seconds


def _pulse(since: float) -> float:
    """Off for 15 s of each 40."""
    return 1.0 if since % 40.0 < 15.0 else 0.0


def _kinds() -> tuple[Kind, ...]:
    out: list[Kind] = []
    for sensor, channels in SENSORS.items():
        jumped, drifts, scaled = f"{sensor} jumped", f"{sensor} drifts", f"{sensor} scaled"
        out += [
            Kind(f"{sensor} frozen", _frozen(*channels), (f"{sensor} frozen",)),
            Kind(f"{sensor} biased", _spoilt(sensor, lambda since: 1.0), (jumped, scaled), signed=True),
            Kind(f"{sensor} drifting", _spoilt(sensor, _ramp(300.0)), (drifts,), 600.0, signed=True),
            Kind(f"{sensor} late", _late(*channels), (f"{sensor} late",)),
            Kind(f"{sensor} jumping", _spoilt(sensor, _pulse), (jumped, scaled), signed=True),
        ]
    model = ("the model ",)
    return (
        *out,
        Kind("log scaled", _times(lambda name: name == "u_w", 0.12), ("log jumped", "log scaled")),
        Kind("rate gyro scaled", _times(lambda name: name == "r", 0.3), ("rate gyro scaled",)),
        Kind("rudder offset", _rudder_offset, ("{rudder} sensor",), signed=True),
        Kind("rudder slow", _gear(0.2), ("{rudder} slow",)),
        Kind("rudder jammed", _gear(0.0), ("{rudder} jammed",)),
        Kind("rudder slow, unseen", _unseen(0.2), ("{rudder} slow",), ordered=False),
        Kind("rudder jammed, unseen", _unseen(0.0), ("{rudder} jammed",), ordered=False),
        Kind("revolutions scaled", _times(lambda name: name.startswith("n_P"), -0.12), ("{shaft} sensor",)),
        Kind("lost thrust", _thrust(0.6), ("{shaft} without its thrust",)),
        Kind("fouling", _ship(_grown(R_0=1.5, X_0F=1.5)), ("resistance or wind changed",), 600.0),
        Kind("loading", _ship(_heavier), (*model, "resistance or wind changed", "a ship deeper"), 600.0),
        Kind("current turning", _stream, ("current changed",), 600.0),
        Kind("unlogged wind", _blown, ("wind or another force changed", "resistance or wind changed"), 600.0),
        Kind("shallow water", _ship(_grown(R_0=1.3, X_0F=1.3, Y_v=1.8, Y_r=1.3, Y_vvv=1.9, N_v=1.6, N_r=1.4,
                                           C_D=1.8)), (*model, "wind or another force", "resistance"), 600.0),
        Kind("wrong ship", _ship(_another), model, 600.0),
        Kind("clock drift", _clock, ("clock of the log",), 600.0),
        Kind("antenna elsewhere", _antenna, ("antenna",), 600.0),
    )  # fmt: skip


KINDS: Mapping[str, Kind] = {one.name: one for one in _kinds()}
