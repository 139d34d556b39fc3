"""A ship of the MMG family in six degrees of freedom: its manoeuvring with the coefficients of a panel code."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..core.parameters import Parts, values
from ..data import Array
from ..environment.sea.hydrodynamics import Hydrodynamics
from ..environment.sea.memory import LATERAL, LONGITUDINAL, Memory, fitted
from ..forces.radiation import Lateral, Longitudinal
from ..models.mmg import Mmg
from ..models.mmg_roll import MmgRoll
from ..models.rolling import GRAVITY
from ..models.unified import Heave, Unified
from . import Entry, Ship, ShipError
from .rolled import Stability, with_roll

_MASS = 0.05
"""Largest difference of the displacement of ship and data."""
_PLANE = 1.15
"""Largest water plane over that of a box."""


def with_memory(ship: Ship, data: Hydrodynamics, roll_damping: float | None = None, added: str = "ship") -> Ship:
    """`ship` with heave, pitch and the memory of its waves.

    A ship without roll gets it by `rolled.with_roll` with the stability, the inertia and the added inertia of the data;
    its damping besides that of waves is then what Ikeda's method has above the data's at the natural frequency.

    Args:
        data: coefficients in still water about midship in the water line, as the readers give them.
        roll_damping: linear damping of roll besides that of waves, over the critical one; None keeps the ship's.
        added: added mass of surge, sway and yaw at zero frequency: of the "ship", whose manoeuvring then is unchanged,
            or of the "data".

    Raises:
        ShipError: another family, or data of another hull.
        WeatherError: data that no memory can be fitted to.
    """
    family: Any = type(ship.model)
    if family not in (Mmg, MmgRoll):
        raise ShipError(f"{ship.name}: memory is added to ships of mmg:Mmg or mmg_roll:MmgRoll; {family.__name__} is "
                        "another family")  # fmt: skip
    _same_hull(ship, data)
    here = data.moved(0.0, 0.0, data.z_G - data.z)
    along, aside = fitted(here, LONGITUDINAL), fitted(here, LATERAL)
    rolling = _rolling(ship, here, _at_zero(aside)) if family is Mmg else ship
    model: Any = rolling.model
    roll, body, further = model.roll, model.body, {}
    if added == "data":
        surge, slow = _at_zero(along), _at_zero(aside)
        body = replace(body, m_x=float(surge[0, 0]), m_y=float(slow[0, 0]), J_z=float(slow[2, 2]))
        roll = replace(roll, J_x=float(slow[1, 1]), l_y=float(-slow[0, 1] / body.m_y))
        further = {"A_26": float(slow[0, 2]), "A_46": float(slow[1, 2])}
    if roll_damping is not None:
        stiff = float(body.m) * GRAVITY * float(roll.GM) * (float(roll.I_x) + float(roll.J_x))
        roll = replace(roll, B_1=2.0 * roll_damping * math.sqrt(stiff), B_2=0.0)
    heave = Heave(
        I_y=float(here.M[4, 4]), A_13=float(along.A_inf[0, 1]), A_15=float(along.A_inf[0, 2]),
        A_33=float(along.A_inf[1, 1]), A_35=float(along.A_inf[1, 2]), A_55=float(along.A_inf[2, 2]),
        C_33=float(here.C[2, 2]), C_35=float(0.5 * (here.C[2, 4] + here.C[4, 2])), C_55=float(here.C[4, 4]), **further,
    )  # fmt: skip
    made = Unified(
        **{**vars(model), "roll": roll, "body": body}, heave=heave,
        longitudinal=_sections(along, Longitudinal, "135"), transverse=_sections(aside, Lateral, "246"),
    )  # fmt: skip
    _possible(ship.name, data.name, made)
    return _told(rolling, data, made, (along, aside))


def _at_zero(memory: Memory) -> Array:
    """Added mass at zero frequency, shape (3, 3)."""
    return memory.A_inf + memory.frequency(np.zeros(1)).real[0]


def _rolling(ship: Ship, here: Hydrodynamics, slow: Array) -> Ship:
    """A ship of the horizontal plane with the stability and the inertia of the data; damping besides that of waves."""
    body: Any = ship.model.part("body")
    GM = float(here.C[3, 3]) / (float(body.m) * GRAVITY)
    made = with_roll(ship, Stability(GM=GM, KG=float(body.d) - here.z_G))
    model: Any = made.model
    natural = math.sqrt(float(here.C[3, 3]) / float(here.M[3, 3] + slow[1, 1]))
    waves = float(here.at(np.array([natural]))[1][0, 3, 3])
    found: dict[str, tuple[float, str]] = {
        "I_x": (float(here.M[3, 3]), _of(here)), "J_x": (float(slow[1, 1]), _of(here)),
        "l_y": (float(-slow[0, 1] / body.m_y), _of(here)), "GM": (GM, _of(here)),
        "B_1": (max(float(model.roll.B_1) - waves, 0.0), f"Ikeda's simplified method less the waves of {_of(here)}"),
    }
    roll = replace(model.roll, **{name: value for name, (value, _) in found.items()})
    entries = {f"roll.{name}": Entry(why, value) for name, (value, why) in found.items()}
    return replace(made, model=replace(model, roll=roll), entries={**made.entries, **entries})


def _of(data: Hydrodynamics) -> str:
    return Path(data.name).name


def _same_hull(ship: Ship, data: Hydrodynamics) -> None:
    model: Any = ship.model
    body = model.body
    m, L, B, rho = (float(x) for x in (body.m, body.L_pp, body.B, body.rho))
    if not {2, 3, 4} <= set(data.modes):
        raise ShipError(f"{data.name}: no heave, roll or pitch; compute all three")
    heavy = float(data.M[2, 2])
    if abs(heavy / m - 1.0) > _MASS:
        raise ShipError(f"{data.name}: its body has {heavy:.4g} kg, {ship.name} {m:.4g} kg; give the data of this hull "
                        "at this draught, in SI units")  # fmt: skip
    GM = float(data.C[3, 3]) / (heavy * GRAVITY)
    if not 0.0 < GM < 0.5 * B:
        raise ShipError(f"{data.name}: its stiffness in roll makes GM {GM:.4g} m; that of a ship is above 0 and below "
                        "half its breadth: give the body its centre of mass")  # fmt: skip
    most = rho * GRAVITY * L * B
    if not 0.0 < data.C[2, 2] <= _PLANE * most:
        raise ShipError(f"{data.name}: a stiffness in heave of {data.C[2, 2]:.4g} N/m; a water plane of {L:g} m by "
                        f"{B:g} m has {most:.4g} N/m at most")  # fmt: skip
    x_D = -float(data.M[2, 4]) / heavy
    if abs(x_D - float(body.x_G)) > 0.03 * L:
        raise ShipError(f"{data.name}: its centre of gravity is {x_D:.4g} m ahead of where its axes begin, that of "
                        f"{ship.name} {float(body.x_G):.4g} m ahead of midship; begin the axes midship")  # fmt: skip
    gyration = math.sqrt(float(data.M[4, 4]) / heavy)
    if not 0.1 * L < gyration < 0.6 * L:
        raise ShipError(f"{data.name}: a radius of gyration in pitch of {gyration:.4g} m for {L:g} m of length; "
                        "it is about a quarter of it")  # fmt: skip


def _sections(memory: Memory, cls: Any, digits: str) -> Parts:
    pairs = [(i, j) for i in range(3) for j in range(i, 3)]
    names = tuple(f"m{k + 1}" for k in range(memory.a.size))
    made: list[Any] = []
    for k in range(memory.a.size):
        numbers = {f"{letter}_{digits[i]}{digits[j]}": float(matrix[k, i, j])
                   for letter, matrix in (("c", memory.c), ("d", memory.d)) for i, j in pairs}  # fmt: skip
        made.append(cls(a=float(memory.a[k]), w=float(memory.w[k]), **numbers))
    return Parts(names, tuple(made))


def _possible(name: str, source: str, made: Unified) -> None:
    """Refuse masses that memory and manoeuvring do not make together."""
    for what, matrix in zip(("surge, heave and pitch", "sway, roll and yaw"), fast_masses(made), strict=True):
        size = np.sqrt(np.abs(np.diag(matrix)))
        if np.linalg.eigvalsh(matrix / np.outer(size, size)).min() <= 1e-3 or (np.diag(matrix) <= 0.0).any():
            raise ShipError(f"{source}: with it the mass of {name} in {what} is not positive; its added masses in "
                            "manoeuvring are far below those of the data: take those (--added data)")  # fmt: skip


def fast_masses(model: Unified) -> tuple[Array, Array]:
    """Mass with added mass at infinite frequency, of surge, heave and pitch, and of sway, roll and yaw."""
    body, heave, roll = model.body, model.heave, model.roll
    lever = body.m * body.x_G
    one = np.array([[body.m + body.m_x, heave.A_13, heave.A_15],
                    [heave.A_13, body.m + heave.A_33, heave.A_35 - lever],
                    [heave.A_15, heave.A_35 - lever, heave.I_y + heave.A_55]], dtype=np.float64)  # fmt: skip
    below, far = -body.m_y * roll.l_y, lever + heave.A_26
    other = np.array([[body.m + body.m_y, below, far], [below, roll.I_x + roll.J_x, heave.A_46],
                      [far, heave.A_46, body.I_zG + body.x_G * lever + body.J_z]], dtype=np.float64)  # fmt: skip
    for section in model.longitudinal.components:
        one[0, 0] -= section.slow[0]
    for section in model.transverse.components:
        slow = section.slow
        other -= np.array([[slow[0], slow[1], slow[2]], [slow[1], slow[3], slow[4]], [slow[2], slow[4], slow[5]]])
    return one, other


def _told(ship: Ship, data: Hydrodynamics, made: Unified, memories: tuple[Memory, Memory]) -> Ship:
    entries: dict[str, Entry] = dict(ship.entries)
    before = values(ship.model)
    for path, value in values(made).items():
        if path not in before:
            entries[path] = Entry(f"fitted to {_of(data)}", float(value))
        elif float(value) != float(before[path]):
            entries[path] = Entry(f"from {_of(data)}, or as asked", float(value))
    off = "; ".join(f"{'surge, heave, pitch' if k == 0 else 'sway, roll, yaw'}: {m.a.size} sections, added mass within "
                    f"{m.misfit.added_mass:.1%}, damping {m.misfit.damping:.1%}, retardation {m.misfit.retardation:.1%}"
                    for k, m in enumerate(memories))  # fmt: skip
    notes: Mapping[str, Any] = ship.notes
    cautions = [*notes.get("cautions", ()), f"Memory of waves fitted at zero speed ({off})."]
    title = f"{notes.get('title', '')}, in six degrees of freedom".strip(", ")
    return replace(ship, name=f"{ship.of or ship.name}_unified", of=ship.of or ship.name, model=made, entries=entries,
                   notes={**notes, "title": title, "cautions": cautions})  # fmt: skip
