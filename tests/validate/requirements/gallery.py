"""A gallery of wrong and of good ships, a line each: six good ships of the library, and what is changed in them.

A line of `WRONG` is "SHIP PATHS CHANGE WORDS".  PATHS are numbers of the model or of an actuator (with an at sign),
joined by "+", a star for all that begin so; a change acts on each, an exchange on two; "x21.3" is a factor.  WORDS,
joined by "|", are those of the culprit's physics, of which the judge must say one.  `SCATTER` moves good ships.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from seatrial.actuators import Actuators
from seatrial.core.parameters import update, values
from seatrial.ships import Ship
from seatrial.ships.files import load
from seatrial.validate.requirements import Judgement
from seatrial.validate.requirements.probe import Probe
from seatrial.validate.requirements.scopes import SCOPES, checked

_FACTORS: dict[str, Callable[[float], float]] = {
    "sign": lambda x: -x, "dropped": lambda x: 0.0, "twice": lambda x: 2.0 * x, "quarter": lambda x: x / 4.0,
    "half": lambda x: x / 2.0, "fourfold": lambda x: 4.0 * x, "tenfold": lambda x: 10.0 * x,
    "tenth": lambda x: x / 10.0, "degrees": lambda x: math.degrees(x), "radians": lambda x: math.radians(x),
    "gravity": lambda x: 9.81 * x, "weightless": lambda x: x / 9.81, "feet": lambda x: x / 0.3048,
    "square feet": lambda x: x / 0.3048**2, "knots": lambda x: x / 0.5144, "square knots": lambda x: x / 0.5144**2,
    "pounds": lambda x: x / 0.4536, "twelvefold": lambda x: 12.0 * x, "eightfold": lambda x: 8.0 * x,
    "at the bow": lambda x: abs(x), "minute": lambda x: 60.0, "tons": lambda x: x / 1000.0,
    "less than one": lambda x: 1.0 - x, "twice taken": lambda x: 1.0 - (1.0 - x) ** 2,
}  # fmt: skip

_WRONG = """
kvlcc2 hull.R_0 sign resistance|speed
kvlcc2 hull.R_0 tenfold resistance
kvlcc2 hull.R_0 fourfold resistance
kvlcc2 hull.R_0 tenth resistance
kvlcc2 hull.R_0 degrees resistance|thrust|blows up
kvlcc2 hull.Y_v sign sway
kvlcc2 hull.Y_v fourfold Y_v|sway
kvlcc2 hull.Y_v tenfold Y_v|sway
kvlcc2 hull.Y_v tenth Y_v|sway
kvlcc2 hull.Y_v dropped Y_v|sway
kvlcc2 hull.N_v sign N_v
kvlcc2 hull.N_v twice N_v
kvlcc2 hull.N_v fourfold N_v
kvlcc2 hull.N_v dropped N_v
kvlcc2 hull.N_v radians N_v
kvlcc2 hull.N_r sign yaw|N_r
kvlcc2 hull.N_r fourfold N_r
kvlcc2 hull.N_r dropped N_r|yaw
kvlcc2 hull.N_r tenfold N_r
kvlcc2 hull.Y_r sign Y_r
kvlcc2 hull.Y_r fourfold Y_r
kvlcc2 hull.Y_r tenfold Y_r|centrifugal
kvlcc2 hull.N_vvr sign N_vvr
kvlcc2 hull.N_vvr tenfold N_vvr
kvlcc2 hull.Y_vrr sign Y_vrr
kvlcc2 hull.Y_vrr tenfold Y_vrr
kvlcc2 hull.Y_vvv sign Y_vvv|sway
kvlcc2 hull.Y_vvv tenfold Y_vvv
kvlcc2 hull.N_vvv degrees N_vvv
kvlcc2 hull.N_vrr tenfold N_vrr
kvlcc2 hull.N_rrr degrees N_rrr
kvlcc2 hull.X_vr degrees X_vr
kvlcc2 hull.X_rr degrees X_rr
kvlcc2 hull.Y_vvr tenfold Y_vvr
kvlcc2 hull.N_r+hull.N_v exchanged exchanged|N_v|N_r
kvlcc2 hull.Y_r+hull.N_v exchanged exchanged|N_v|Y_r
kvlcc2 hull.Y_v+hull.N_v exchanged Y_v|N_v
kvlcc2 hull.Y_v+hull.Y_r exchanged sway|Y_v|Y_r
kvlcc2 hull.Y_vvv+hull.N_vvv exchanged vvv
kvlcc2 body.m twice mass|block
kvlcc2 body.m weightless mass
kvlcc2 body.m half mass
kvlcc2 body.m_x+body.m_y exchanged mass
kvlcc2 body.m_y dropped sway|m_y
kvlcc2 body.m_y tenfold sway|m_y
kvlcc2 body.I_zG fourfold inertia
kvlcc2 body.I_zG quarter inertia
kvlcc2 body.J_z gravity inertia|J_z
kvlcc2 body.x_G sign x_G
kvlcc2 body.x_G feet x_G
kvlcc2 body.d feet draught|d
kvlcc2 body.B+body.d exchanged breadth
kvlcc2 rudder.A_R square~feet rudder
kvlcc2 rudder.A_R tenth rudder
kvlcc2 rudder.f_alpha radians rudder
kvlcc2 rudder.f_alpha degrees rudder
kvlcc2 rudder.a_H sign a_H
kvlcc2 rudder.x_R sign rudder
kvlcc2 rudder.x_R half rudder|x_R
kvlcc2 rudder.x_H sign x_H
kvlcc2 rudder.l_R sign rudder
kvlcc2 rudder.epsilon tenth rudder
kvlcc2 propeller.D_P feet propeller
kvlcc2 propeller.D_P half propeller
kvlcc2 propeller.k_0+propeller.k_1+propeller.k_2 quarter propeller
kvlcc2 propeller.k_0+propeller.k_1+propeller.k_2 tenfold propeller|thrust
kvlcc2 propeller.k_1 sign thrust
kvlcc2 propeller.t_P sign t_P
kvlcc2 propeller.w_P0 sign w_P0
kvlcc2 wind.A_T+wind.A_L exchanged exchanged
kvlcc2 wind.A_T+wind.A_L square~feet area
kvlcc2 wind.A_T+wind.A_L twelvefold area|wind
kvlcc2 wind.C_Dt+wind.C_Dl_bow+wind.C_Dl_stern square~knots wind
kvlcc2 wind.C_Dt+wind.C_Dl_bow+wind.C_Dl_stern twelvefold wind
kvlcc2 wind.C_Dl_bow sign wind
kvlcc2 wind.rho_air gravity wind
kvlcc2 wind.s_L tenfold wind
kvlcc2 waves.X_*+waves.Y_* fourfold waves
kvlcc2 waves.X_*+waves.Y_* weightless waves
kvlcc2 waves.Y_* sign waves
kvlcc2 @rudder.rate radians rate|delta
kvlcc2 @rudder.rate degrees rate|delta
kvlcc2 @rudder.dead_time minute dead~time
kvlcc2 @rudder.high+@rudder.low radians angle
mariner derivatives.X_dd sign X_delta
mariner derivatives.X_u+derivatives.X_uu+derivatives.X_uuu sign surge|resistance
mariner derivatives.X_u+derivatives.X_uu+derivatives.X_uuu tenfold surge|resistance
mariner derivatives.X_u+derivatives.X_uu+derivatives.X_uuu tenth surge|resistance
mariner derivatives.Y_v+derivatives.Y_vu sign sway|Y_v
mariner derivatives.Y_v+derivatives.Y_vu fourfold Y_v
mariner derivatives.Y_v+derivatives.Y_vu quarter Y_v
mariner derivatives.N_v+derivatives.N_vu sign N_v
mariner derivatives.N_v+derivatives.N_vu fourfold N_v
mariner derivatives.N_v+derivatives.N_vu dropped N_v
mariner derivatives.N_r+derivatives.N_ru sign N_r|yaw
mariner derivatives.N_r+derivatives.N_ru fourfold N_r
mariner derivatives.N_r+derivatives.N_ru quarter N_r
mariner derivatives.Y_r+derivatives.Y_ru sign Y_r|centrifugal
mariner derivatives.Y_r+derivatives.Y_ru twice Y_r|centrifugal
mariner derivatives.Y_d+derivatives.Y_ud+derivatives.Y_uud sign rudder
mariner derivatives.N_d+derivatives.N_ud+derivatives.N_uud sign rudder
mariner derivatives.Y_d+derivatives.N_d exchanged rudder
mariner derivatives.N_d+derivatives.N_ud+derivatives.N_uud quarter rudder
mariner derivatives.N_d+derivatives.Y_d degrees rudder
mariner derivatives.N_d+derivatives.Y_d radians rudder
mariner derivatives.Y_vvv sign Y_vvv|sway
mariner derivatives.Y_vvv tenfold Y_vvv
mariner derivatives.N_vvr sign N_vvr
mariner derivatives.N_vvr fourfold N_vvr
mariner derivatives.N_vvv tenfold N_vvv
mariner derivatives.Y_vvr tenfold Y_vvr
mariner derivatives.X_rv sign X_vr
mariner derivatives.X_rv fourfold X_vr
mariner derivatives.X_vv tenfold X_vv
mariner body.m twice mass|inertia|added
mariner body.I_z fourfold inertia
mariner body.I_z tenth inertia
mariner body.Y_vdot tenfold m_y
mariner body.Y_vdot tenth m_y|sway
mariner body.X_udot+body.Y_vdot exchanged mass
mariner body.N_rdot tenfold inertia
mariner body.x_G tenfold x_G
mariner derivatives.N_v+derivatives.N_r exchanged N_v|N_r
mariner derivatives.Y_v+derivatives.N_v exchanged Y_v|N_v
mariner @rudder.rate radians rate|delta
mariner @rudder.lag minute lag
supply_76m damping.X_u sign surge|resistance
supply_76m damping.X_u tenfold resistance|ahead
supply_76m damping.X_u degrees resistance|ahead
supply_76m damping.Y_v sign sway
supply_76m damping.Y_v tenth sway
supply_76m damping.N_r sign yaw
supply_76m damping.N_r tenfold N_r
supply_76m damping.N_r degrees N_r
supply_76m damping.N_r radians N_r
supply_76m damping.N_r+damping.Y_v exchanged N_r|Y_v
supply_76m damping.X_u+damping.Y_v exchanged sway~and~surge|drag
supply_76m inertia.m_11+inertia.m_22 exchanged mass
supply_76m inertia.m_33 tenfold inertia
supply_76m inertia.m_33 tenth inertia
supply_76m inertia.m_22 tenfold mass
supply_76m inertia.m_23 sign mass
supply_76m inertia.m_23+inertia.m_32 tenfold mass|x_G
supply_76m body.m tons mass
supply_76m thrusters.tau.N_per_delta sign rudder|turn
milliampere damping.X_u+damping.X_uu+damping.X_uuu sign surge|resistance
milliampere damping.X_u+damping.X_uu+damping.X_uuu tenfold resistance|surge
milliampere damping.Y_v+damping.Y_vv+damping.Y_vvv sign sway
milliampere damping.N_r+damping.N_rr sign yaw
milliampere damping.N_r+damping.N_rr tenfold N_r
milliampere damping.N_r+damping.N_rr tenth N_r|yaw
milliampere damping.Y_v+damping.Y_vv+damping.Y_vvv tenth sway|Y_v
milliampere damping.Y_rv sign sway|energy|runs~away
milliampere damping.N_rr degrees N_r|yaw
milliampere inertia.m_33 tenfold inertia
milliampere inertia.m_33 tenth inertia
milliampere inertia.m_11+inertia.m_22 fourfold inertia
milliampere inertia.m_23 tenfold mass
milliampere thrusters.bow.x+thrusters.stern.x exchanged bow|stern
milliampere thrusters.bow.x sign bow
milliampere thrusters.stern.x at~the~bow stern
milliampere thrusters.bow.x feet bow
milliampere thrusters.bow.f_per_n+thrusters.stern.f_per_n sign thrust
container_son_nomoto X_uu sign resistance|surge
container_son_nomoto X_uu tenfold resistance|surge
container_son_nomoto derivatives.Y_v sign sway
container_son_nomoto derivatives.Y_v fourfold Y_v
container_son_nomoto derivatives.Y_v quarter Y_v
container_son_nomoto derivatives.N_v sign N_v
container_son_nomoto derivatives.N_v fourfold N_v
container_son_nomoto derivatives.N_r sign N_r|yaw
container_son_nomoto derivatives.N_r fourfold N_r
container_son_nomoto derivatives.N_r quarter N_r
container_son_nomoto derivatives.Y_r tenfold Y_r|centrifugal
container_son_nomoto derivatives.N_vvr sign N_vvr
container_son_nomoto derivatives.Y_vrr sign Y_vrr
container_son_nomoto derivatives.Y_vvv sign Y_vvv|sway
container_son_nomoto derivatives.N_v+derivatives.N_r exchanged N_v|N_r
container_son_nomoto derivatives.K_v sign heel
container_son_nomoto derivatives.K_v tenfold heel
container_son_nomoto derivatives.K_p sign roll
container_son_nomoto derivatives.K_p degrees roll
container_son_nomoto body.GM sign righting
container_son_nomoto body.GM feet righting|heel
container_son_nomoto body.GM degrees righting
container_son_nomoto body.I_x degrees roll
container_son_nomoto rudder.A_R square~feet rudder
container_son_nomoto rudder.A_R tenth rudder
container_son_nomoto rudder.x_R sign rudder
container_son_nomoto screw.D_P feet propeller
container_son_nomoto screw.D_P half propeller
container_son_nomoto screw.k_0+screw.k_1 quarter propeller
esso_osaka_3m_harbour hull.X_0F tenfold resistance
esso_osaka_3m_harbour hull.X_0F sign resistance
esso_osaka_3m_harbour hull.X_0A sign resistance
esso_osaka_3m_harbour hull.Y_v fourfold Y_v
esso_osaka_3m_harbour hull.N_v sign N_v
esso_osaka_3m_harbour hull.N_v fourfold N_v
esso_osaka_3m_harbour hull.N_r sign yaw|N_r
esso_osaka_3m_harbour hull.N_r fourfold N_r
esso_osaka_3m_harbour hull.Y_r tenfold Y_r|centrifugal
esso_osaka_3m_harbour hull.C_D tenfold Y_vvv|sway
esso_osaka_3m_harbour hull.C_D sign sway
esso_osaka_3m_harbour hull.C_rN tenfold yaw|N_r
esso_osaka_3m_harbour hull.N_v+hull.N_r exchanged N_v|N_r
esso_osaka_3m_harbour body.m gravity mass
esso_osaka_3m_harbour body.I_zG tenth inertia
esso_osaka_3m_harbour body.m_x+body.m_y exchanged mass
esso_osaka_3m_harbour propeller.D_P half propeller
esso_osaka_3m_harbour propeller.k_0+propeller.k_1+propeller.k_2 quarter propeller|thrust
esso_osaka_3m_harbour propeller.A_* gravity wheel|propeller
esso_osaka_3m_harbour propeller.B_* gravity wheel|propeller
esso_osaka_3m_harbour propeller.A_*+propeller.B_* gravity wheel|propeller
esso_osaka_3m_harbour propeller.A_* sign propeller
esso_osaka_3m_harbour rudder.A_R square~feet rudder
esso_osaka_3m_harbour rudder.x_R sign rudder
esso_osaka_3m_harbour rudder.f_alpha radians rudder
esso_osaka_3m_harbour wind.A_T+wind.A_L square~feet area
esso_osaka_3m_harbour wind.A_T+wind.A_L exchanged exchanged
esso_osaka_3m_harbour wind.Y_1+wind.Y_3+wind.Y_5+wind.X_0+wind.X_1+wind.X_3+wind.X_5 square~knots wind
esso_osaka_3m_harbour wind.X_0+wind.X_1+wind.X_3+wind.X_5 sign wind
esso_osaka_3m_harbour wind.N_1+wind.N_2+wind.N_3 tenfold wind
esso_osaka_3m_harbour wind.N_1+wind.N_2+wind.N_3 sign wind
esso_osaka_3m_harbour thrusters.bow.x+thrusters.stern.x exchanged bow|stern
esso_osaka_3m_harbour thrusters.stern.x at~the~bow stern
esso_osaka_3m_harbour thrusters.bow.x feet bow
esso_osaka_3m_harbour thrusters.bow.T_0 degrees bow
esso_osaka_3m_harbour thrusters.bow.T_0 gravity bow
esso_osaka_3m_harbour waves.X_*+waves.Y_* eightfold waves
"""


@dataclass(frozen=True)
class Entry:
    """One ship of the gallery: its name, how it is made, and words of which the judge must say one if it is wrong."""

    name: str
    made: Callable[[], Ship]
    base: str
    words: tuple[str, ...] = ()


good = cache(load)


def changed(ship: Ship, paths: tuple[str, ...], change: str) -> Ship:
    """The ship with some of its numbers, or of its actuators' (with an at sign), changed by name."""
    old: dict[str, Any] = dict(values(ship.model))
    if change == "exchanged":
        first, other = paths
        return replace(ship, model=update(ship.model, {first: old[other], other: old[first]}))
    by = _FACTORS[change] if change in _FACTORS else lambda x: float(change.removeprefix("x")) * x
    paths = tuple(one for path in paths for one in (sorted(old) if path.endswith("*") else [path])
                  if one.startswith(path.rstrip("*")))  # fmt: skip
    gears = dict(ship.actuators.by_name)
    for path in (one for one in paths if one.startswith("@")):
        gear, name = path[1:].split(".")
        gears[gear] = replace(gears[gear], **{name: by(float(getattr(gears[gear], name)))})
    new = {path: by(float(old[path])) for path in paths if not path.startswith("@")}
    return replace(ship, model=update(ship.model, new), actuators=Actuators(gears))


def wrong(lines: str = _WRONG) -> Iterator[Entry]:
    """The wrong ships, one of each line."""
    for line in lines.strip().splitlines():
        base, paths, change, words = line.split(maxsplit=3)
        change, told = change.replace("~", " "), tuple(words.replace("~", " ").split("|"))
        yield Entry(f"{base}: {paths} {change}", _made(base, tuple(paths.split("+")), change), base, told)


def _made(base: str, paths: tuple[str, ...], change: str) -> Callable[[], Ship]:
    return lambda: changed(good(base), paths, change)


SCATTER = {
    "Y_v": 0.12, "Y_r": 0.15, "N_v": 0.1, "N_r": 0.1, "X_u": 0.15, "R_0": 0.15, "X_0F": 0.15, "X_uu": 0.15,
    "Y_vvv": 0.2, "Y_vvr": 0.2, "Y_vrr": 0.2, "N_vvr": 0.2, "N_vrr": 0.2, "N_vvv": 0.2, "N_rrr": 0.2, "C_D": 0.15,
    "X_vv": 0.2, "X_vr": 0.1, "m_y": 0.07, "m_x": 0.2, "J_z": 0.1, "a_H": 0.15, "t_R": 0.15, "f_alpha": 0.07,
    "kappa": 0.1, "l_R": 0.1, "t_P": 0.1, "w_P0": 0.1, "C_Dt": 0.1, "T_0": 0.2, "K_p": 0.2, "GM": 0.1,
    "Y_d": 0.1, "N_d": 0.1, "Y_vv": 0.15, "N_rr": 0.15, "m_22": 0.05, "m_33": 0.08, "A_L": 0.1, "A_T": 0.1,
}  # fmt: skip
"""Standard scatter of coefficients between towing tanks and fits of one hull, as shares."""
_SHARED = {"Y_vu": "Y_v", "N_vu": "N_v", "N_ru": "N_r", "Y_ud": "Y_d", "Y_uud": "Y_d", "N_ud": "N_d", "N_uud": "N_d"}
"""Terms of an Abkowitz table that move with another."""
_BASES = ("kvlcc2", "mariner", "supply_76m", "milliampere", "container_son_nomoto", "esso_osaka_3m_harbour")


def scattered(base: str, seed: int) -> Ship:
    """A good ship with every coefficient moved within the scatter of published sets; of others, in speed too."""
    ship, random = good(base), np.random.default_rng(seed)
    drawn = {name: 1.0 + share * float(random.uniform(-1.0, 1.0)) for name, share in SCATTER.items()}
    new: dict[str, float] = {}
    for path, value in values(ship.model).items():
        name = path.rpartition(".")[2]
        name = _SHARED.get(name, name)
        if name in drawn and np.ndim(value) == 0 and not path.startswith("waves"):
            new[path] = float(value) * drawn[name]
    moved = replace(ship, model=update(ship.model, new), n_P=None)
    return moved if seed % 3 else replace(moved, speed=ship.speed * float(random.uniform(0.8, 1.0)))


def right() -> Iterator[Entry]:
    """The good ships."""
    for base in _BASES:
        for seed in range(25):
            yield Entry(f"{base}, scatter {seed}", lambda base=base, seed=seed: scattered(base, seed), base)


_ORDER = (("berthing", (3, 5, 9, 10, 11, 1, 2, 4, 6, 7, 8, 0)), ("collision-avoidance", (6,)))
"""Items of both scopes once, those that name most first; the last two of a scope, of the computation, left out."""


def told(ship: Ship) -> Iterator[tuple[str, str]]:
    """Verdict and words of everything that does not hold, item by item."""
    p = Probe.of(ship)
    for scope, numbers in _ORDER:
        for number in numbers:
            yield from _said(checked(SCOPES[scope][number], p))


def _said(judgement: Judgement) -> Iterator[tuple[str, str]]:
    if judgement.verdict not in ("fail", "doubt"):
        return
    wrong = [one for one in judgement.findings if not one.holds]
    if not wrong:
        yield judgement.verdict, judgement.reason
    for one in wrong:
        yield ("doubt" if one.doubt else "fail"), one.wrong


@cache
def usual(base: str) -> frozenset[str]:
    """What the good ship is told already, the first words of it: what its file lacks."""
    return frozenset(_first(words) for _, words in told(good(base)))


def _first(words: str) -> str:
    """The first words without their figures: a good ship of 35 degrees of overshoot is told them at 42 as well."""
    return re.sub(r"[\d.]+", "", words.partition(",")[0].partition("(")[0])


def new(entry: Entry) -> Iterator[str]:
    """What the judge says of a ship and not of the good one it was made from."""
    known = usual(entry.base)
    for verdict, words in told(entry.made()):
        if _first(words) not in known:
            yield f"{verdict}: {words}"


def named(entry: Entry) -> bool:
    """Whether one of the words of the culprit's physics is said."""
    return any(word in said for said in new(entry) for word in entry.words)
