"""Thrust of thrusters from a bollard pull, and servos from logs: fits, and the tables of a ship file."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Sequence
from pathlib import Path

from ..core.files import write_whole
from ..data import Array, DataError, Trial
from ..data.table import lines_of, numbers, split_row
from ..data.units import KNOWN
from ..identify.components.servo import ServoFit, fit_servo, servos
from ..identify.components.thrust_map import ThrustMap, fit_thrust, fit_thrusters, shared
from . import RequestError
from .request import Note, check_output, silent

_HEAD = re.compile(r"^(?P<kind>[nT])(_(?P<name>\w+))?\s*\[(?P<unit>[^\]]+)\]$")
_UNITS = {"n": "1/s", "T": "N"}
_HEADING = "# Tables of a ship file (docs/extending.md)."


def thrust_map(
    table: Path, out: Path | None = None, thrusters: str | None = None, together: bool = False,
    order: int | None = None, note: Note = silent,
) -> list[ThrustMap]:  # fmt: skip
    """Fit thrust by revolutions to a table of a bollard pull, and write the [thrusters] of a ship file.

    Args:
        table: file with columns such as ``n [1/s],T_1 [N],T_2 [N]``.
        out: tables of a ship file to write (.toml).
        thrusters: names of the ship's thrusters, such as ``1,2``.
        together: whether the one column of thrust is that of all of them.
        order: highest power of n; chosen by cross-validation unless given.
        note: takes what was left out or assumed.

    Raises:
        DataError: a table that cannot be used; names column, line or revolutions.
        RequestError: options that contradict each other.
    """
    _writable(out, "thrusters", table)
    names = None if thrusters is None else [name.strip() for name in thrusters.split(",") if name.strip()]
    columns = read_pull(table)
    rows = len(lines_of(table)) - 1
    if together:
        if not names or len(columns) != 1:
            raise RequestError("--together takes one column of thrust and names whose it is: --thrusters 1,2")
        ((_, (n, T)),) = columns.items()
        both = fit_thrust(n, T, name="+".join(names), order=order)
        found = [shared(name, both, len(names)) for name in names]
    else:
        found = [*fit_thrusters(columns, names, order=order)]
    for one in found:
        if one.rows < rows:
            note(f"note: thruster {one.name}: {rows - one.rows} of {rows} rows have no revolutions or no thrust")
        if one.n_low >= 0:
            note(f"note: thruster {one.name} was not tested astern; astern = 1 is an assumption")
    if out is not None:
        _write(out, "\n".join(_map_toml(one, table.name) for one in found), note)
    return found


def read_pull(path: Path) -> dict[str, tuple[Array, Array]]:
    """Revolutions [1/s] and thrust [N] by thruster, from columns such as ``n [rpm],T_1 [N],T_2 [N]``.

    A column `n` serves all thrusts, `n_1` that of `T_1`; an empty cell leaves its row out.

    Raises:
        DataError: a column of another name or unit, thrust without revolutions, or no thrust.
    """
    lines = lines_of(path)
    found: dict[tuple[str, str], int] = {}
    factors: list[float] = []
    heads = split_row(lines[0], ",")
    for k, head in enumerate(heads):
        match = _HEAD.match(head)
        wanted = _UNITS[match["kind"]] if match else ""
        if match is None or KNOWN.get(match["unit"], ("", 0.0))[0] != wanted:
            raise DataError(f"{path}: column '{head}': write revolutions as n [1/s] or n_1 [rpm], thrust as T_1 [N]")
        if (match["kind"], match["name"] or "") in found:
            raise DataError(f"{path}: column '{head}': named twice; keep one")
        found[match["kind"], match["name"] or ""] = k
        factors.append(KNOWN[match["unit"]][1])
    if len(lines) < 2:
        raise DataError(f"{path}: no rows below the heading; write revolutions and thrust of each level")
    values, _ = numbers(path, lines, 1, heads, ",")
    out: dict[str, tuple[Array, Array]] = {}
    for (kind, name), k in found.items():
        if kind == "T":
            at = found.get(("n", name), found.get(("n", "")))
            if at is None:
                raise DataError(f"{path}: column '{heads[k]}': no revolutions; add n [1/s] or n_{name} [1/s]")
            pair = values[:, [at, k]] * [factors[at], factors[k]]
            out[name or "1"] = _filled(f"{path}: column '{heads[k]}'", pair)
    if not out:
        raise DataError(f"{path}: no thrust; add a column such as T_1 [N]")
    return out


def _filled(where: str, pair: Array) -> tuple[Array, Array]:
    """Revolutions and thrust of the rows that have both."""
    lacking = (pair != pair).any(axis=1)
    if lacking.all():
        raise DataError(f"{where}: no row has both revolutions and thrust")
    return pair[~lacking, 0], pair[~lacking, 1]


def servo(
    paths: Sequence[Path], controls: Sequence[str] = (), out: Path | None = None, note: Note = silent
) -> tuple[list[Trial], list[ServoFit]]:
    """Fit the servos of trials that hold both order and angle, and write the [actuators] of a ship file.

    Args:
        paths: trial files, or folders of them.
        controls: such as ``alpha_1``; all that have an order unless given.
        out: tables of a ship file to write (.toml).
        note: takes cautions.

    Returns:
        The trials, and a fit for each control.

    Raises:
        DataError: trials without both, or in degrees.
    """
    from ..data.trialfile import read_trials

    _writable(out, "actuators", *paths)
    trials = [*read_trials(paths)]
    wanted = tuple(controls) or servos(trials)
    if not wanted:
        raise DataError("no trial has order and angle of a servo; such as alpha_1_cmd [rad] and alpha_1 [rad]")
    found = [fit_servo(trials, control) for control in wanted]
    for one in found:
        for line in one.cautions:
            note(f"warning: {line}")
    if out is not None:
        _write(out, "\n".join(_servo_toml(one) for one in found), note)
    return trials, found


def _writable(out: Path | None, kind: str, *sources: Path) -> None:
    """Refuse an output that is no TOML file, has no folder, is an input, or is a file that this command did not write.

    Args:
        kind: the table that marks a file of this command: "thrusters", or "actuators" alone.
    """
    if out is None:
        return
    check_output(out, (".toml",), "a part of a ship file", *sources)
    if out.exists() and not _ours(out, kind):
        raise RequestError(f"{out}: exists, and this command did not write it; choose another file with -o")


def _ours(out: Path, kind: str) -> bool:
    """Whether a file is what the same command wrote before, and so may be replaced."""
    try:
        text = out.read_text(encoding="utf-8")
        tables = set(tomllib.loads(text))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError):
        return False
    return text.startswith(_HEADING) and kind in tables and ("thrusters" in tables) == (kind == "thrusters")


def _write(out: Path, text: str, note: Note) -> None:
    write_whole(out, f"{_HEADING}\n\n{text}")
    note(f"wrote {out}")


def _number(value: float, unit: str, source: str, sigma: float | None = None) -> str:
    spread = "" if sigma is None or not math.isfinite(sigma) else f", sigma = {float(sigma)!r}"
    quantity = f', unit = "{unit}"' if unit else ""
    return f'{{ value = {float(value)!r}{quantity}{spread}, source = "{source}" }}'


def _map_toml(one: ThrustMap, table: str) -> str:
    """[thrusters.NAME] without its position, which no bollard pull contains, and the limits of its revolutions."""
    source = f"bollard pull, {table}: {one.rows} rows, R^2 {one.R2:.5f}, rmse {one.rmse:.3g} N".replace('"', "'")
    back = source if one.n_low < 0 else "assumed: not tested astern"
    lines = [f"[thrusters.{one.name}]", 'type = "azimuth:Azimuth"', "# x and y, the position [m], are to be added"]
    lines += [
        f"c_{k} = {_number(one.coefficients[k], 'N' if k == 0 else 'N s' if k == 1 else f'N s^{k}', source, s)}"
        for k, s in enumerate(one.sigma) if k in one.powers
    ]  # fmt: skip
    lines += [
        f"n_max = {_number(one.n_max, '1/s', 'greatest revolutions tested')}",
        f"astern = {_number(one.astern, '', back)}", "",
        f"[actuators.n_{one.name}]", f"low = {_number(one.n_low, '1/s', 'least revolutions that the map holds for')}",
        f"high = {_number(one.n_max, '1/s', 'greatest revolutions tested')}", "",
    ]  # fmt: skip
    return "\n".join(lines)


def _servo_toml(one: ServoFit) -> str:
    source = f"log of order and angle: {one.samples} samples, R^2 {one.R2:.5f}, rmse {one.rmse:.3g} rad"
    kind = type(one.servo).__name__
    lines = [f"[actuators.{'rudder' if one.control == 'delta' else one.control}]"]
    lines += [f'type = "{kind}"'] if kind != "Actuator" else []
    units = {"rate": "rad/s", "lag": "s", "dead_time": "s"}
    lines += [
        f"{key} = {_number(float(getattr(one.servo, key)), unit, source, one.sigma[key])}"
        for key, unit in units.items() if key in one.sigma
    ]  # fmt: skip
    return "\n".join([*lines, ""])
