"""Checks of a force module, in each of its published forms, against the contract of `seatrial.forces`."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from fnmatch import fnmatchcase
from typing import Any

import numpy as np

from .. import forces
from ..core.parameters import walk
from ..data import Array
from ..forces import Flow, Slipstream
from . import discovery as found
from .discovery import INPUTS, PAIRS, Part, biases, compiled, even, require

# Alongside a quay with a bank behind it and a ship abeam; and in the corner of a dock, with one right ahead.
_NEAR = (0.2, 0.8, 0.0, 0.6, 0.0, 0.5, 0.8, 1.0, 1.0)
_ACROSS = (0.5, -1.0, -0.3, -0.2, 1.2, 0.0, -1.0, 0.6, 1.5)


def grid(part: Part) -> Array:
    """At rest, ahead, astern, sideways; stopped, ahead and reversed; in weather; afloat, touching ground and beyond."""
    own = len(part.prefixes)
    moves = itertools.product(
        (0.0, 0.4, -0.4), (0.0, 0.2, -0.2), (0.0, 0.3, -0.3), (0.0, 1.0, -1.0), (0.0, 0.5, 1.2),
        ((0, 0), (-1, 0.5)), ((0, 0, 0), (0.8, 0.2, 0.9), (-0.8, 0.2, 0)), (0.0, 0.8, 1.25, 1.4),
    )  # fmt: skip
    near = itertools.cycle(((0.0,) * 9, _NEAR, _ACROSS, (0.0,) * 9, (0.0,) * 9, (0.0,) * 9, (0.0,) * 9))
    rows = [(u, v, r, n, d, *wind, *waves, h, *place, *([n, d, 0.4][:own]))
            for (u, v, r, n, d, wind, waves, h), place in zip(moves, near, strict=False)]  # fmt: skip
    tiny = [(1e-9, 0, 0, 0, 0.3), (0, 1e-7, 1e-9, 1e-6, -0.3, 1e-8), (0.3, 0, 0, 0, math.pi / 1.4), (0, -1e-12)]
    rows += [(*row, *([0.0] * (INPUTS + own - len(row)))) for row in tiny]
    return np.array(rows, dtype=float) * part.size


def samples(part: Part) -> Array:
    """Inputs at random, of the usual size; another ship is half as long as the own one or more."""
    rows = np.random.default_rng(7).uniform(-1, 1, (150, len(part.size))) * part.size
    rows[:, INPUTS - 2] = 0.5 * (part.L_pp + np.abs(rows[:, INPUTS - 2]))
    return rows


def untried_forces() -> list[str]:
    """Classes of the package, and options of their choices, that neither a ship nor an example has."""
    modules = [part.module for part in found.force_modules().values()]
    flown = {type(part) for ship in found.ships().values() for _, part in found.components(ship.model)}
    flown |= set(map(type, modules))
    missing = [cls.__qualname__ for cls in found.classes_of(forces) if cls not in flown]
    tried = {(type(module), field, vars(module)[field]) for module in modules for field in found.choices(module)}
    wanted = {(type(module), *one) for module in modules for one in found.options(module)}
    return missing + [f"{cls.__qualname__}[{field}={option}]" for cls, field, option in wanted - tried]


def declared(part: Part) -> None:
    """It says whether port mirrors starboard; every number says what it is, and lies within what physics allows."""
    name = type(part.module).__name__
    said = isinstance(getattr(part.module, "mirror_symmetric", None), bool)
    require(said, f"{name} does not say `mirror_symmetric: ClassVar[bool]`: True, or False with its `asymmetries`")
    own = getattr(part.module, "asymmetries", ())
    require(isinstance(own, tuple), f"{name}: `asymmetries` is {own!r}; write a tuple, such as (\"delta_0\",)")
    numbers = [path for path, _, _ in walk(part.module)]
    unknown = [one for one in own if not any(fnmatchcase(path, one) for path in numbers)]
    require(not unknown, f"{name}: `asymmetries` names {', '.join(map(repr, unknown))}; it has {', '.join(numbers)}")
    found.declared(part.module)


def silent_at_rest(part: Part) -> None:
    """No force in still air and water with stopped propellers, whatever the rudder, the azimuth and the depth."""
    for angle, depth in ((0.0, 0.0), (0.4, 0.6), (-1.0, 1.2)):
        x = [0.0] * 4 + [angle] + [0.0] * 4 + [3.0, depth, 0.5, -0.5, 0.01, 0.02, 0.1, 0.2, 0.0, 5.0, 1.0]
        x += [angle if prefix == "alpha" else 0.0 for prefix in part.prefixes]
        try:
            forced = part.outputs(tuple(x))[:3]
        except ArithmeticError as e:
            raise found.ContractError(f"{type(part.module).__name__} at rest: {e}; `where` chooses between two "
                                      "values that are both finite") from None  # fmt: skip
        require(all(abs(y) == 0 for y in forced),
                f"{type(part.module).__name__} at rest, angle {angle}, d/h {depth}: X, Y, N are "
                f"{', '.join(f'{float(y):.6g}' for y in forced)}, not 0")  # fmt: skip


def _reflected(part: Part, x: Array) -> tuple[Array, Array]:
    """Outputs, and those of the mirror image (part and input) seen in the mirror."""
    module = part.module
    if "y" in vars(module):
        module = replace(module, y=-module.y)
    there = part._replace(module=module).outputs(tuple(map(float, x * part.mirror)))
    here = part.outputs(tuple(map(float, x)))
    return np.array(here, dtype=float), np.array((there[0], -there[1], -there[2], *there[3:]), dtype=float)


def mirrored(part: Part) -> None:
    """Port is the mirror image of starboard; where `mirror_symmetric` is False it is not, but for its side terms."""
    name = type(part.module).__name__
    if not part.module.mirror_symmetric:
        pairs = [_reflected(part, x) for x in samples(part)]
        differs = any((np.abs(a - b) > np.maximum(1e-6 * np.abs(b), 1e-12)).any() for a, b in pairs)
        require(differs, f"{name} is its own mirror image: mirror_symmetric = True")
        known = any(a in vars(part.module) for a, _ in PAIRS) or biases(part.module)
        require(known, f"{name} is not symmetric, and names no `asymmetries`")
    part = part._replace(module=even(part.module))
    for x in samples(part):
        here, there = _reflected(part, x)
        off = np.abs(there - here) > 1e-12 * np.abs(here).max()
        if off.any():
            k = int(off.argmax())
            require(False, f"{name}: {_outputs(part)[k]} is {here[k]:.6g}, and {there[k]:.6g} seen in the mirror, "
                           f"{_where(part, x)}")  # fmt: skip


def finite(part: Part) -> None:
    """Outputs and their Jacobian are finite at rest, astern, sideways and in weather."""
    x = grid(part)
    f, j = _traced(part)
    _all_finite(part, x, f(x.T).full().T, "")
    n, wide = len(part.size), len(_outputs(part))
    slopes = j(x.T).full().reshape(wide, len(x), n).transpose(1, 0, 2)
    _all_finite(part, x, slopes.reshape(len(x), -1), "a derivative of ")


def floats_equal_symbols(part: Part) -> None:
    """Floats and symbols give the same, to 1e-12 of the largest entry of the outputs."""
    x = np.vstack([samples(part), grid(part)[::17]])
    symbols = _traced(part)[0](x.T).full().T
    direct = np.array([part.outputs(tuple(row)) for row in x.tolist()], dtype=float)
    scale = np.abs(direct).max(axis=1, keepdims=True)
    off = np.abs(symbols - direct) > 1e-12 * scale + 1e-300
    if off.any():
        row, k = (int(i) for i in np.argwhere(off)[0])
        require(False, f"{type(part.module).__name__}: {_outputs(part)[k]} is {direct[row, k]:.6g} by floats and "
                       f"{symbols[row, k]:.6g} by symbols, {_where(part, x[row])}")  # fmt: skip


def _outputs(part: Part) -> tuple[str, ...]:
    """Names of its outputs: a propeller has a slipstream besides."""
    count = len(part.outputs(tuple(map(float, part.size))))
    return ("X", "Y", "N", *Slipstream._fields)[:count]


def _where(part: Part, x: Array) -> str:
    """The inputs of a point, those that are not zero."""
    names = [name for name in Flow._fields if name not in ("rho", "L_pp", "d")]
    names += [f"{prefix} of its own" for prefix in part.prefixes]
    said = ", ".join(f"{name} {value:.3g}" for name, value in zip(names, x, strict=True) if value)
    return f"at {said}" if said else "at rest"


def _traced(part: Part) -> tuple[Any, Any]:
    """Outputs and Jacobian as compiled from symbols; a class that no symbol can pass through is named."""
    try:
        return compiled(part.outputs, len(part.size))
    except RuntimeError as e:
        if "truth value" not in str(e):
            raise
        raise found.ContractError(
            f"{type(part.module).__name__} asks `if`, `min` or `max` of a value, which no symbol can answer: "
            "`where`, `smaller` and `larger` of core/symbolic can"
        ) from None


def _all_finite(part: Part, x: Array, table: Array, of: str) -> None:
    """Refuse the first row with a value that is not finite; columns run through the outputs in equal shares."""
    bad = np.argwhere(~np.isfinite(table))
    if not len(bad):
        return
    row, column = (int(i) for i in bad[0])
    k = column * len(_outputs(part)) // table.shape[1]
    direct = float(part.outputs(tuple(map(float, x[row])))[k])
    hint = ""
    if of:
        hint = ": `speed`, `root` and `atan2` of core/symbolic are rounded at rest"
    elif math.isfinite(direct):
        hint = f" by symbols, {direct:.6g} by floats: functions of `math` lose a symbol, those of core/symbolic do not"
    require(False, f"{type(part.module).__name__}: {of}{_outputs(part)[k]} is {table[row, column]} "
                   f"{_where(part, x[row])}{hint}")  # fmt: skip


Check = Callable[[Part], Any]

FORCE_CHECKS: Mapping[str, Check] = {
    check.__name__: check for check in (declared, silent_at_rest, mirrored, finite, floats_equal_symbols)
}
"""The checks of a force by name."""
