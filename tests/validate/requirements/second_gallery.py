"""Ships on which the judge was not made: good ones of other bases, and wrong ones, written before they were judged."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import gallery
import numpy as np
from gallery import Entry, good

from seatrial.actuators import Actuators
from seatrial.core.parameters import update, values
from seatrial.ships import Ship
from seatrial.ships.estimate import estimate
from seatrial.ships.scaling import scale

_FROUDE = 9.80665


def estimated(seed: int) -> Ship:
    """A ship of random, sensible particulars: fuller where slower, a few of two screws, in ballast or models of ships.

    Lengths 60 to 330 m, or 2 to 8 m of a model; Watson's C_b = 1.08 - 1.68 F_n within 0.03; rudders of at least the
    area of DNV's rule; wind on every second.
    """
    random = np.random.default_rng(1000 + seed)
    model, ballast, twin = seed % 5 == 1, seed % 5 == 2, seed % 7 == 3
    L = float(random.uniform(2.0, 8.0) if model else random.uniform(60.0, 330.0))
    F_n = float(random.uniform(0.13, 0.27))
    full = min(1.08 - 1.68 * F_n + float(random.uniform(-0.03, 0.03)), 0.85)
    B = L / float(random.uniform(5.3, 7.6))
    deep = B / float(random.uniform(2.3, 3.4))
    d = 0.68 * deep if ballast else deep
    given = {
        "L_pp": L, "B": B, "d": d, "C_b": full - 0.03 * ballast, "speed": F_n * (_FROUDE * L) ** 0.5,
        "D_P": float(random.uniform(0.5, 0.68)) * deep * (0.75 if twin else 1.0), "blades": 4.0 + seed % 2,
        "A_R": float(random.uniform(1.0, 1.3)) * 0.01 * L * deep * (1 + 25 * (B / L) ** 2) / (1 + twin),
        "x_G": float(random.uniform(-0.02, 0.03)) * L, "pitch_ratio": float(random.uniform(0.7, 1.05)),
    }  # fmt: skip
    if model:
        given |= {"rho": 1000.0, "nu": 1.14e-6}
    if twin:
        given |= {"screws": 2.0, "y_P": 0.22 * B}
    rows = ['schema = "seatrial-particulars/1"', "[particulars]", *(f"{key} = {x!r}" for key, x in given.items())]
    if seed % 2:
        free = float(random.uniform(0.35, 0.9)) * deep + (deep - d)
        house, under = float(random.uniform(0.06, 0.1)) * L, L * free
        area = house * 0.07 * L
        rows += ["[wind]", f"A_L = {under + area!r}", f"A_T = {B * (free + 0.05 * L)!r}", f"A_OD = {area!r}",
                 f"C = {-0.38 * L * area / (under + area)!r}", f"C_BR = {-0.38 * L!r}", f"H_BR = {free + 0.07 * L!r}",
                 f"H_C = {(0.5 * free * under + (free + 0.035 * L) * area) / (under + area)!r}"]  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"estimated_{seed}.toml"
        path.write_text("\n".join(rows) + "\n")
        return estimate(path).ship


def moved(base: str, **factors: float) -> Ship:
    """A ship with numbers multiplied, `__` for a dot; those of its rudder gear by `gear`."""
    ship = good(base)
    gear = factors.pop("gear", 1.0)
    old = values(ship.model)
    new = {key.replace("__", "."): by * float(old[key.replace("__", ".")]) for key, by in factors.items()}
    gears = dict(ship.actuators.by_name)
    if gear != 1.0:
        gears["rudder"] = replace(gears["rudder"], rate=gear * float(gears["rudder"].rate))
    return replace(ship, model=update(ship.model, new), actuators=Actuators(gears), n_P=None)


_SCATTERED = (
    "gms_110", "twin_virtual", "suzaku", "kcs", "seiun_maru", "esso_190k_tanker", "modified_abkowitz_kvlcc2_l7",
    "gunnerus", "qiuxin5", "otter", "wamv_16", "northern_clipper", "milliampere_aft", "revolt_3m",
)  # fmt: skip
_SCALED = (("kvlcc2", 100.0), ("suzaku", 3.0), ("seiun_maru", 4.2), ("kvlcc2_l7", 2.9), ("gms_110", 5.5))
_MOVED: tuple[tuple[str, dict[str, float]], ...] = (
    ("kvlcc2", {"rudder__A_R": 1.2}), ("kvlcc2", {"rudder__A_R": 0.85}), ("suzaku", {"rudder__A_R": 1.15}),
    ("kvlcc2", {"propeller__D_P": 1.06}), ("kvlcc2", {"gear": 2.0}),
    ("seiun_maru", {"propeller__k_0": 1.1, "propeller__k_1": 1.1, "propeller__k_2": 1.1}),
)  # fmt: skip
_ESTIMATES = 15


_LACKS = ("no [wind] force", "no [waves] force", "has no hand")
"""What an estimate is told rightly: what formulas do not give."""


def new(entry: Entry) -> list[str]:
    """What the judge says of a ship and not of the one it was made from; of an estimate, all but what it lacks."""
    if entry.base:
        return list(gallery.new(entry))
    every = (f"{verdict}: {words}" for verdict, words in gallery.told(entry.made()))
    return [said for said in every if not any(lack in said for lack in _LACKS)]


def right(first: int = 0) -> Iterator[Entry]:
    """Forty good ships: estimates, other bases within the scatter, other sizes, rudders, propellers and gears.

    Args:
        first: seed of the first; another has other estimates and other scatter.
    """
    for seed in range(first, first + _ESTIMATES):
        yield Entry(f"estimate {seed}", _later(estimated, seed), "")
    for base in _SCATTERED:
        yield Entry(f"{base}, scatter {101 + first}", _later(gallery.scattered, base, 101 + first), base)
    for base, L in _SCALED:
        yield Entry(f"{base} to {L:g} m", _later(lambda base, L: scale(good(base), L).ship, base, L), base)
    for base, factors in _MOVED:
        yield Entry(f"{base} with {factors}", _later(lambda base, some: moved(base, **some), base, factors), base)


_WRONG = """
kcs hull.Y_b+hull.N_b exchanged Y_v|N_v
kcs hull.Y_b+hull.Y_r+hull.N_b+hull.N_r x21.3 Y_v|N_v|N_r
kcs hull.N_bbr sign N_vvr
kcs body.m_x+body.m_y+body.J_z dropped mass
kcs propeller.w_P0 less~than~one propeller|thrust|wake
kcs propeller.D_P twice propeller
suzaku hull.N_r sign yaw|N_r
suzaku hull.Y_v+hull.Y_r exchanged sway|Y_v|Y_r
suzaku hull.N_v x21.8 N_v
suzaku body.d feet draught|block
suzaku rudder.x_R+rudder.x_H sign rudder
seiun_maru propeller.t_P twice~taken thrust|propeller|t_P
seiun_maru hull.N_v+hull.N_r exchanged exchanged|N_v|N_r
seiun_maru hull.Y_r sign Y_r|centrifugal
seiun_maru body.I_zG weightless inertia
seiun_maru @rudder.rate degrees rate
seiun_maru rudder.A_R square~feet rudder
esso_190k_tanker N_uv fourfold N_v
esso_190k_tanker N_ccd+Y_ccd exchanged rudder|N_delta|Y_delta
esso_190k_tanker body.m_33 fourfold inertia
esso_190k_tanker X_uu tenth resistance|surge|X_u
gms_110 hull.Y_b+hull.N_b radians Y_v|N_v|sway
gms_110 hull.N_r fourfold N_r
gms_110 propeller.D_P half propeller
modified_abkowitz_kvlcc2_l7 derivatives.N_v+derivatives.N_r exchanged N_v|N_r
modified_abkowitz_kvlcc2_l7 derivatives.N_vvr sign N_vvr
modified_abkowitz_kvlcc2_l7 derivatives.Y_d sign rudder
gunnerus inertia.m_11+inertia.m_22+inertia.m_33 x9.81 mass|inertia
gunnerus damping.N_r+damping.N_rr degrees N_r|yaw
gunnerus thrusters.port.x+thrusters.starboard.x sign stern|rudder|side|turn
qiuxin5 damping.Y_v+damping.Y_vv+damping.Y_vvv sign sway
qiuxin5 inertia.m_33 tenfold inertia
qiuxin5 damping.X_u+damping.X_uu+damping.X_uuu tenfold resistance|surge
otter thrusters.port.y+thrusters.starboard.y exchanged turn|side
otter damping.N_r+damping.N_rr degrees N_r|yaw
wamv_16 inertia.m_33 tenfold inertia
wamv_16 damping.X_u+damping.X_uu tons resistance|surge
naval_blanke body.GM sign righting
naval_blanke hull.N_uur tenfold yaw|N_r
naval_blanke hull.Y_ur sign centrifugal|Y_r|sway
mariner_nomoto K sign turn|side
mariner_nomoto T+K exchanged turn|steer|answer|runs
mariner_nomoto K degrees turn|runs
zeefakkel alpha sign turn|stable|runs|tighter
viknes_830 inertia.m_33 tenfold inertia
kcs hull.X_0 tenfold resistance
kcs hull.Y_r sign Y_r|centrifugal
kcs rudder.A_R square~feet rudder
kcs rudder.x_R half rudder|x_R
kcs body.I_zG fourfold inertia
suzaku propeller.w_P0 less~than~one wake
suzaku hull.N_v+hull.N_r radians N_v|N_r|yaw
suzaku hull.Y_vvv+hull.N_vvv exchanged vvv
esso_190k_tanker Y_uv sign sway|Y_v
esso_190k_tanker body.m_22 tenfold mass|m_y
esso_190k_tanker screw.t twice~taken thrust|deduction
esso_190k_tanker d_33 sign N_r|yaw
gms_110 hull.N_r+hull.N_b exchanged exchanged|N_v|N_r
gms_110 rudder.f_alpha radians rudder
gms_110 body.m tons mass
modified_abkowitz_kvlcc2_l7 body.I_z tenfold inertia
modified_abkowitz_kvlcc2_l7 derivatives.C_R+derivatives.eta_1 tenfold resistance|thrust|surge
modified_abkowitz_kvlcc2_l7 derivatives.Y_r sign Y_r|centrifugal
esso_osaka derivatives.N_v sign N_v
esso_osaka derivatives.Y_d+derivatives.N_d exchanged rudder|N_delta|Y_delta
gunnerus damping.X_u+damping.X_uu degrees resistance|surge|ahead
gunnerus inertia.m_33 tenth inertia
gunnerus thrusters.port.y+thrusters.starboard.y exchanged side|turn
otter inertia.m_22 tenfold mass
otter damping.X_u tenth resistance|surge
revolt_3m thrusters.bow.x sign bow
revolt_3m damping.Y_v+damping.N_r exchanged N_r|Y_v
cybership2 damping.N_r sign yaw|N_r
zeefakkel T minute turn|steer|answer|zigzag
zeefakkel K sign turn|side
"""


def wrong() -> Iterator[Entry]:
    """Wrong ships on bases that the first gallery does not use: axes, units, signs, other ways to make primes."""
    yield from gallery.wrong(_WRONG)


def _later(make: Callable[..., Ship], *args: Any) -> Callable[[], Ship]:
    return lambda: make(*args)
