"""Good and wrong ships drawn by a seed, for first sight: another seed has ships on which no one has looked.

Good: particulars of six types of ship, where regressions reach, through the estimate, coefficients within
their published scatter at another speed, other sizes and other loads.  Wrong: slips of units, axes and reference that
`gallery` and `second_gallery` do not try, over the bases that they hardly use.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import islice
from pathlib import Path

import gallery
import numpy as np
from gallery import Entry, good

from seatrial.core.parameters import update, values
from seatrial.ships import Ship
from seatrial.ships.estimate import estimate
from seatrial.ships.scaling import scale

_KINDS = {
    # L/B, B/d, C_b, F_n, L_pp, rudder over L d, screws
    "bulker": ((5.8, 6.8), (2.4, 3.0), (0.74, 0.83), (0.14, 0.19), (140.0, 290.0), (0.014, 0.02), 1),
    "ferry": ((5.6, 6.8), (3.4, 4.4), (0.54, 0.64), (0.25, 0.31), (80.0, 190.0), (0.016, 0.024), 2),
    "gas carrier": ((5.6, 6.6), (2.6, 3.9), (0.68, 0.78), (0.17, 0.22), (90.0, 290.0), (0.015, 0.022), 1),
    "tanker": ((5.4, 6.6), (2.4, 3.3), (0.78, 0.85), (0.125, 0.17), (170.0, 330.0), (0.014, 0.02), 1),
    "container": ((6.4, 7.8), (2.6, 3.4), (0.58, 0.68), (0.2, 0.27), (130.0, 360.0), (0.015, 0.021), 1),
    "coaster": ((5.4, 6.8), (2.3, 3.1), (0.68, 0.8), (0.17, 0.24), (60.0, 120.0), (0.018, 0.028), 1),
}
_BASES = (
    "kcs", "container_son_nomoto", "mariner", "esso_190k_tanker", "esso_osaka_3m", "kvlcc2_l7", "gms_110", "suzaku",
    "twin_virtual", "suzaku_tuned_05", "seiun_maru", "modified_abkowitz_kvlcc2_l7", "naval_blanke", "gunnerus",
    "qiuxin5", "otter", "wamv_16", "viknes_830", "cybership2", "cybership2_dp", "revolt_3m", "supply_83m",
    "milliampere_aft", "blueboat", "esso_osaka", "esso_osaka_3m_hybrid", "mariner_nomoto2", "zeefakkel",
    "tanker_nomoto2", "frigate_100m", "mariner_nomoto", "northern_clipper", "qiuxin5_6", "zeefakkel_speeds",
    "container_175m_nomoto2", "kvlcc2_shallow",
)  # fmt: skip
_GEOSIMS = ("kvlcc2", "kcs", "seiun_maru", "esso_osaka_3m", "gms_110", "twin_virtual", "otter", "gunnerus", "suzaku",
            "milliampere")  # fmt: skip
_LOADED = ("kvlcc2", "kcs", "seiun_maru", "esso_osaka_3m", "suzaku", "gms_110", "twin_virtual")
_SHARE = {"K": 0.1, "T": 0.1, "T_1": 0.1, "T_2": 0.1, "T_3": 0.1, "alpha": 0.2, "Y_b": 0.12, "N_b": 0.1, "X_0": 0.15,
          "Y_uv": 0.12, "N_uv": 0.1, "Y_uuv": 0.12, "N_uuv": 0.1, "N_uur": 0.1, "C_R": 0.15}  # fmt: skip
"""Scatter of numbers beside those of `gallery.SCATTER`."""


def particulars(kind: str, seed: int) -> Ship:
    """A ship of a kind with sensible, random particulars, its wind area on every second."""
    random = np.random.default_rng(7000 + seed)
    slender, flat, full, F_n, length, share, screws = _KINDS[kind]

    def draw(ends: tuple[float, float]) -> float:
        return float(random.uniform(*ends))

    L = draw(length)
    B = L / draw(slender)
    d = B / draw(flat)
    given = {
        "L_pp": L, "B": B, "d": d, "C_b": draw(full), "speed": draw(F_n) * (9.80665 * L) ** 0.5,
        "D_P": draw((0.55, 0.7)) * d * (0.8 if screws == 2 else 1.0), "blades": 4.0,
        "A_R": draw(share) * L * d / screws, "x_G": draw((-0.02, 0.01)) * L, "pitch_ratio": draw((0.7, 1.0)),
    }  # fmt: skip
    if screws == 2:
        given |= {"screws": 2.0, "y_P": 0.2 * B}
    rows = ['schema = "seatrial-particulars/1"', "[particulars]", *(f"{key} = {x!r}" for key, x in given.items())]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{kind}_{seed}.toml"
        path.write_text("\n".join(rows) + "\n")
        return estimate(path).ship


def scattered(base: str, seed: int) -> Ship:
    """A library ship with every coefficient within its published scatter, at 75 to 100 % of its speed."""
    ship, random = good(base), np.random.default_rng(seed)
    shares = gallery.SCATTER | _SHARE
    drawn = {name: 1.0 + share * float(random.uniform(-1.0, 1.0)) for name, share in shares.items()}
    drawn["N_d"] = drawn["Y_d"]  # one force of the rudder, at its place
    own = {path: float(x) for path, x in values(ship.model).items() if np.ndim(x) == 0 and path[:5] != "waves"}
    new = {path: x * drawn[name] for path, x in own.items() if (name := path.rpartition(".")[2]) in drawn}
    moved = replace(ship, model=update(ship.model, new), n_P=None)
    return replace(moved, speed=ship.speed * float(random.uniform(0.75, 1.0))) if seed % 2 else moved


def resized(base: str, seed: int) -> Ship:
    """A geometrically similar ship by Froude's law, half to twice as long."""
    ship = good(base)
    long = ship.L_pp * 2.0 ** float(np.random.default_rng(seed).uniform(-1.0, 1.0))
    return scale(ship, long, effects=False).ship


def loaded(base: str, seed: int) -> Ship:
    """A ship of 80 to 105 % of its draught: masses go with it, the primes of a hull hardly."""
    ship, by = good(base), float(np.random.default_rng(seed).uniform(0.8, 1.05))
    own = values(ship.model)
    new = {path: by * float(own[path]) for name in ("d", "m", "m_x", "m_y", "J_z", "I_zG")
           if (path := f"body.{name}") in own}  # fmt: skip
    return replace(ship, model=update(ship.model, new), n_P=None)


def right(seed: int) -> Iterator[Entry]:
    """Sixty-four good ships of a seed: 18 of particulars, 28 of the library, 10 of other sizes, 8 of other loads."""
    random = np.random.default_rng(seed)
    for k in range(18):
        kind = list(_KINDS)[k % len(_KINDS)]
        yield Entry(f"{kind} {100 * seed + k}", _later(particulars, kind, 100 * seed + k), "")
    for make, bases, count in ((scattered, _BASES, 28), (resized, _GEOSIMS, 10), (loaded, _LOADED, 8)):
        chosen = random.permutation([bases[k % len(bases)] for k in range(max(count, len(bases)))])[:count]
        for k, base in enumerate(chosen.tolist()):
            yield Entry(f"{base}, {make.__name__} {1000 * seed + k}", _later(make, base, 1000 * seed + k), base)


def _later(make: Callable[[str, int], Ship], name: str, seed: int) -> Callable[[], Ship]:
    return lambda: make(name, seed)


_MMG = ("kcs", "seiun_maru", "suzaku", "gms_110", "esso_osaka_3m", "twin_virtual")
_EACH = {
    _MMG: """
hull.Y_*+hull.N_* L/d Y_v|N_v|N_r|sway|yaw
hull.Y_*+hull.N_* d/L Y_v|N_v|N_r|sway|yaw
body.x_G from~aft x_G|mass
body.I_zG over~mass inertia
body.m_y+body.J_z L/d mass|inertia
rudder.x_R+rudder.x_H over~L rudder
rudder.a_H hundredfold rudder|a_H
rudder.l_R sign rudder|yaw|N_r
propeller.t_P less~than~one thrust|propeller
body.rho tons sway|Y_v|resistance|rudder|mass
body.L_pp feet length|mass|block|inertia
body.B feet breadth|block
body.d hundredth draught|block|breadth
body.m tons mass
hull.Y_v+hull.Y_b+hull.N_v+hull.N_b+hull.Y_vvv+hull.Y_bbb+hull.N_vvv+hull.N_bbb sign sway|Y_v|N_v
hull.N_v+hull.N_b dropped N_v
hull.N_r+hull.Y_r exchanged N_r|Y_r|yaw
hull.Y_r hundredfold Y_r|centrifugal
@rudder.rate sixtieth rate|slow|answer|time
@rudder.low dropped port|angle|limit
@speed knots speed|revolutions|block|thrust|resistance|propeller
""",
    ("kcs", "seiun_maru", "gms_110", "suzaku", "twin_virtual"): """
rudder.gamma_Rp+rudder.gamma_Rn sign rudder|yaw|N_r
rudder.epsilon hundredfold rudder
rudder.eta hundredth rudder|race
hull.R_0+hull.X_0 L/d resistance|surge|thrust
""",
    ("kcs", "seiun_maru", "gms_110", "twin_virtual", "esso_osaka_3m"): """
propeller.k_0+propeller.k_1 exchanged thrust|propeller
propeller.D_P hundredth propeller
""",
    ("esso_osaka_3m",): """
wind.rho_air hundredfold wind
wind.X_*+wind.Y_*+wind.N_* sign wind
wind.L_wind hundredfold wind
hull.X_0A tenfold resistance|astern
hull.C_rY hundredfold sway|Y_|yaw
propeller.k_2 sign propeller|thrust
propeller.tau hundredfold propeller|wake|thrust|rudder
""",
    ("esso_osaka", "modified_abkowitz_kvlcc2_l7"): """
body.Y_vdot sign m_y|mass|sway
body.N_rdot tenfold inertia
body.X_udot hundredfold mass
derivatives.Y_*+derivatives.N_* L/d Y_v|N_v|N_r|sway|yaw|rudder
derivatives.Y_*+derivatives.N_* d/L Y_v|N_v|N_r|sway|yaw|rudder
body.x_G hundredfold x_G|mass
derivatives.Y_d+derivatives.N_d+derivatives.Y_eee+derivatives.N_eee sign rudder
derivatives.N_d+derivatives.N_eee dropped rudder
derivatives.C_R dropped resistance
derivatives.eta_3 tenfold thrust|propeller|speed|revolutions
derivatives.N_v+derivatives.Y_r exchanged N_v|Y_r
derivatives.Y_v sign sway|Y_v
derivatives.N_r dropped N_r|yaw
body.m tenfold mass
body.I_z hundredth inertia
@rudder.rate sixtieth rate|slow|answer|time
""",
    ("mariner",): """
body.Y_vdot+body.N_rdot sign mass|inertia
derivatives.N_d+derivatives.N_ud+derivatives.N_uud+derivatives.N_ddd dropped rudder
derivatives.X_u+derivatives.X_uu+derivatives.X_uuu dropped surge|resistance
derivatives.N_v+derivatives.Y_r exchanged N_v|Y_r
derivatives.X_vv+derivatives.X_rv exchanged X_v
derivatives.Y_vvr+derivatives.Y_vvv exchanged Y_vv
derivatives.N_vvr+derivatives.N_vvv exchanged N_vv
body.X_udot sign mass
@rudder.low dropped port|angle|limit
""",
    ("esso_190k_tanker",): """
Y_uv+N_uv exchanged Y_v|N_v
d_22 sign centrifugal|Y_r
N_ccd sign rudder
Y_ccd tenfold rudder
N_uv sign N_v
X_uu tenfold resistance
screw.T_nn quarter thrust|propeller
screw.T_nn sign thrust|propeller
screw.t less~than~one thrust|propeller|deduction
body.m_33 tenth inertia
body.m_22+body.m_11 exchanged mass
body.L_pp feet length|mass|inertia
N_vr sign N_vvr|yaw
screw.c_nn hundredfold rudder|race
""",
    ("naval_blanke",): """
hull.N_uur sign yaw|N_r
hull.Y_uuv sign sway|Y_v
hull.N_uur tenth yaw|N_r|turn
body.GM hundredfold righting
body.I_z tenth inertia
body.Y_vdot sign mass|sway
hull.X_uu tenfold resistance
hull.X_uu sign resistance
hull.K_p+hull.K_up sign roll
body.m tons mass
""",
    ("gunnerus", "qiuxin5", "wamv_16", "blueboat", "revolt_3m", "milliampere_aft", "otter"): """
damping.* tons resistance|sway|surge|yaw
inertia.m_22+inertia.m_33 exchanged mass|inertia
inertia.m_33 over~mass inertia
damping.X_*+damping.Y_v*+damping.N_r* sign resistance|sway|yaw
@thrust thousandfold thrust|thruster|runs~away|spin
@thrust thousandth thrust|thruster|turn|speed
body.L_pp feet length|mass|block
inertia.m_11 tenth mass
""",
    ("gunnerus", "wamv_16", "blueboat", "revolt_3m", "milliampere_aft", "otter"): """
thrusters.port.y+thrusters.starboard.y sign side|turn|port|starboard
thrusters.port.x+thrusters.starboard.x hundredfold hull|place|lever|stands
""",
    ("gunnerus", "revolt_3m", "milliampere_aft"): """
thrusters.port.x+thrusters.port.y exchanged port|side|lever
damping.N_r+damping.X_u exchanged N_r|X_u|yaw|surge|resistance
""",
    ("cybership2", "supply_83m", "northern_clipper", "viknes_830"): """
damping.* tons resistance|sway|surge|yaw
inertia.m_22+inertia.m_33 exchanged mass|inertia
damping.N_r+damping.X_u exchanged N_r|X_u|yaw|surge|resistance
thrusters.tau.N_per_delta thousandfold turn|spin|yaw
thrusters.tau.X_per_n thousandfold thrust|runs~away|speed
thrusters.tau.X_per_n sign thrust|ahead|astern|speed
inertia.m_33 over~mass inertia
damping.Y_v* sign sway
""",
    ("mariner_nomoto2", "zeefakkel", "tanker_nomoto2", "frigate_100m", "mariner_nomoto", "container_175m_nomoto2"): """
K sign turn|side
K degrees turn|circle|runs|spin|answer
K radians turn|circle|steer|answer
U minute speed|turn|circle|stop
@rudder.rate sixtieth rate|slow|answer|time
""",
    ("zeefakkel", "frigate_100m", "mariner_nomoto"): """
T minutes turn|steer|answer|zigzag|slow
T sixtieth turn|steer|answer|yaw|fast
T sign turn|stable|runs|yaw|spin
""",
    ("mariner_nomoto2", "tanker_nomoto2", "container_175m_nomoto2"): """
T_1+T_3 exchanged turn|steer|answer|yaw|fast
T_1+T_2+T_3 minutes turn|steer|answer|zigzag|slow
T_3 hundredfold turn|steer|answer|yaw|overshoot|fast
""",
}
"""Slips by the ships that have such numbers; a line is as in `gallery`, without the ship."""

_THRUST = ("f_per_n", "c_", "T_1", "T_2", "k")
"""Beginnings of what makes thrust of an order."""


def wrong(seed: int) -> Iterator[Entry]:
    """Sixty-four wrong ships of a seed."""
    pool = [(base, *line.split(maxsplit=2)) for bases, lines in _EACH.items()
            for base in bases for line in lines.strip().splitlines()]  # fmt: skip
    drawn = (pool[k] for k in np.random.default_rng(seed).permutation(len(pool)).tolist())
    told = ((base, paths, change.replace("~", " "), words) for base, paths, change, words in drawn)
    changed = (one for one in told if _differs(slipped(good(one[0]), one[1].split("+"), one[2]), good(one[0])))
    for base, paths, change, words in islice(changed, 64):
        said = tuple(words.replace("~", " ").split("|"))
        yield Entry(f"{base}: {paths} {change}", _slip(base, paths, change), base, said)


def _differs(ship: Ship, other: Ship) -> bool:
    """Whether a slip changed anything: a rate without a limit has no sixtieth, a place at midship no hundredfold."""
    one, two = ({**{path: x for path, x in values(of.model).items() if np.ndim(x) == 0}, "speed": of.speed}
                for of in (ship, other))  # fmt: skip
    return one != two or ship.actuators != other.actuators


def _slip(base: str, paths: str, change: str) -> Callable[[], Ship]:
    return lambda: slipped(good(base), paths.split("+"), change)


def slipped(ship: Ship, paths: list[str], change: str) -> Ship:
    """The ship with a slip; of paths those that it has, and every number that begins as one before a star."""
    if paths == ["@speed"]:
        return replace(ship, speed=ship.speed / 0.5144)
    if paths == ["body.L_pp"]:
        ship = replace(ship, L_pp=ship.L_pp / 0.3048)
    own = {path: x for path, x in values(ship.model).items() if np.ndim(x) == 0}
    L, d = ship.L_pp, float(ship.model.draught) or ship.L_pp / 16.0
    mass = float(getattr(ship.model, "displaced", 0.0)) or 100.0
    by = {"L/d": L / d, "d/L": d / L, "hundredfold": 100.0, "hundredth": 0.01, "thousandfold": 1e3,
          "thousandth": 1e-3, "over L": 1.0 / L, "over mass": 1.0 / mass, "sixtieth": 1 / 60.0,
          "minutes": 60.0}  # fmt: skip
    if paths == ["@thrust"]:
        paths = [one for one in own if one.startswith("thrusters") and one.rpartition(".")[2].startswith(_THRUST)]
    have = [path for path in paths if path.startswith("@") or any(_is(path, one) for one in own)]
    if change == "from aft":
        return replace(ship, model=update(ship.model, {have[0]: float(own[have[0]]) + 0.5 * L}))
    if change not in by:
        return gallery.changed(ship, tuple(have), change)
    return gallery.changed(ship, tuple(have), f"x{by[change]}")


def _is(path: str, one: str) -> bool:
    return one.startswith(path[:-1]) if path.endswith("*") else one == path
