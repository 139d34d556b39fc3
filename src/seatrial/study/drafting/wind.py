"""A force of wind for an estimated ship whose outline above water nobody gave, where a wind is on record.

A wind that acts on the truth and on no part of the ship is taken up by other numbers, most where the ship is small: of
a stranger of 24 m in 3 m/s the added mass in sway went to nothing and Y_v to its bound, and the tactical diameter of an
unseen turn was 14 % off.  Ships above water differ less than that: the regression of Fujiwara (1998) is taken over
outlines from a loaded tanker to a ferry, and their scatter is the prior, wide enough for the trials to decide.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ...core.parameters import specs, values
from ...data import Trial
from ...forces.wind import Fujiwara, fujiwara1998
from ...ships import Entry, Ship

_OUTLINES: Mapping[str, tuple[float, float, float, float, float, float]] = {
    "tanker, loaded": (0.46, 0.033, 0.3, -0.04, -0.38, 0.08), "cargo ship": (0.6, 0.05, 0.3, -0.03, -0.35, 0.09),
    "container ship": (1.0, 0.09, 0.5, 0.0, -0.25, 0.12), "ferry": (1.0, 0.11, 0.3, 0.0, 0.25, 0.13),
    "workboat": (0.9, 0.1, 0.5, 0.05, 0.1, 0.2),
}  # fmt: skip
"""A_T/B^2, A_L/L^2, A_OD/A_L, C/L, C_BR/L and H_BR/L of kinds of ships: judgements, as rounded as they are."""

_FRONT, _SIDE, _HEIGHT = 0.8, 0.07, 0.55
"""A_T/B^2 and A_L/L^2 that the coefficients are scaled to, and H_C L/A_L: about half the mean height."""

_AIR = 1.225


def blown(trial: Trial) -> bool:
    """Whether a wind is on record, true or apparent."""
    return any(name in trial and bool((np.abs(trial[name]) > 0.0).any()) for name in ("U_T", "U_A"))


def with_wind(ship: Ship, trials: Iterable[Trial]) -> Ship:
    """The ship with a force of wind, if `estimate` made it without one and all trials have a wind on record."""
    known = values(ship.model)
    made = any(entry.source.startswith("estimated:") for entry in ship.entries.values())
    if not made or ship.model.feels_wind or not ship.model.takes("wind") or "body.B" not in known:
        return ship
    if not all(map(blown, trials)):
        return ship
    sizes, numbers = outline(ship.L_pp, float(known["body.B"]))
    force: Any = Fujiwara(**sizes, **{name: mean for name, (mean, _) in numbers.items()})
    entries = {f"wind.{name}": Entry("assumed: by length and beam", value)
               for name, value in sizes.items()}  # fmt: skip
    entries |= {f"wind.{name}": Entry(
        "estimated: fujiwara1998, outlines from tanker to ferry", mean, sigma=sigma)
        for name, (mean, sigma) in numbers.items()}  # fmt: skip
    model: Any = ship.model
    return replace(ship, model=replace(model, wind=force), entries={**ship.entries, **entries})


def outline(L: float, B: float) -> tuple[dict[str, float], dict[str, tuple[float, float]]]:
    """Sizes of `Fujiwara` for a ship of this length and beam [m], and mean and sigma of each coefficient."""
    A_T, A_L = _FRONT * B * B, _SIDE * L * L
    found: list[dict[str, float]] = []
    for front, side, deck, C, C_BR, H_BR in _OUTLINES.values():
        own = fujiwara1998(
            A_T=front * B * B, A_L=side * L * L, A_OD=deck * side * L * L, C=C * L, C_BR=C_BR * L, H_BR=H_BR * L,
            H_C=_HEIGHT * side * L, B=B, L=L,
        )  # fmt: skip
        found.append({name: value * (front / _FRONT if name[0] == "X" else side / _SIDE)
                      for name, value in own.items()})  # fmt: skip
    columns = {name: np.array([one[name] for one in found]) for name in found[0]}
    return ({"rho_air": _AIR, "A_T": A_T, "A_L": A_L, "L_wind": L},
            {name: (float(column.mean()), float(column.std(ddof=1))) for name, column in columns.items()})  # fmt: skip


def unfelt(bare: Ship, ship: Ship, trials: Iterable[Trial]) -> tuple[str, ...]:
    """A note where a wind is on record and the ship file has no force of it: what takes its place, and the remedy.

    Args:
        bare: as its file has it; `ship` as the study does.
        trials: the recordings.
    """
    windy = [trial for trial in trials if blown(trial)]
    if bare.model.feels_wind or not windy:
        return ()
    name = next(name for name in ("U_T", "U_A") if any(name in trial for trial in windy))
    mean = float(np.nanmean(np.concatenate([trial[name] for trial in windy if name in trial])))
    told = ("that of an outline typical of its length and beam is in [wind], and free; areas above water in a table "
            "[wind] of its particulars make it sharper (docs/tutorials/estimate.md)") if ship is not bare else (
            "so other numbers of the fit take it up: give the areas above water in a table [wind] of its particulars, "
            "and estimate it anew (docs/tutorials/estimate.md); of another ship, in its file (docs/environment.md)")
    return (f"a wind is on record ({name}: {mean:.1f} m/s in the mean) and {ship.name} has no force of wind, {told}",)


def table(ship: Ship) -> list[str]:
    """The force of wind of a ship as the table [wind] of a study."""
    known, meaning = values(ship.model), specs(ship.model)
    lines = ["[wind] # a wind is on record that the ship file does not feel: its force on an assumed outline",
             'type = "wind:Fujiwara"']  # fmt: skip
    for path, entry in ship.entries.items():
        if path.startswith("wind."):
            unit = f', unit = "{meaning[path].unit}"' if meaning[path].unit else ""
            sigma = "" if entry.sigma is None else f", sigma = {entry.sigma:.3g}"
            said = f'value = {float(known[path]):.4g}{unit}, source = "{entry.source}"{sigma}'
            lines.append(f"{path[5:]} = {{ {said} }}")
    return [*lines, ""]
