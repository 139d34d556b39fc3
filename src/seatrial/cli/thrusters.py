"""The commands thrust-map and servo: what stands between an order and the force of a thruster."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ..core.files import write_whole
from ..data import Array, DataError
from ..data.table import lines_of, numbers, split_row
from ..data.units import KNOWN
from ..identify.components.servo import ServoFit, fit_servo, servos
from ..identify.components.thrust_map import ThrustMap, fit_thrust, fit_thrusters, shared
from .support import DEGREE, UsageError, emit, figure, note, show_table

_HEAD = re.compile(r"^(?P<kind>[nT])(_(?P<name>\w+))?\s*\[(?P<unit>[^\]]+)\]$")
_UNITS = {"n": "1/s", "T": "N"}
_HEADING = "# Tables of a ship file (docs/extending.md)."


def thrust_map(
    table: Path, out: Path | None, thrusters: str | None, together: bool, order: int | None, json: bool
) -> None:
    """Fit thrust by revolutions to a table of a bollard pull, and write the [thrusters] of a ship file.

    Raises:
        DataError: a table that cannot be used; names column, line or revolutions.
        UsageError: options that contradict each other.
    """
    _writable(out, "thrusters", table)
    names = None if thrusters is None else [name.strip() for name in thrusters.split(",") if name.strip()]
    columns = read_pull(table)
    rows = len(lines_of(table)) - 1
    if together:
        if not names or len(columns) != 1:
            raise UsageError("--together takes one column of thrust and names whose it is: --thrusters 1,2")
        ((_, (n, T)),) = columns.items()
        both = fit_thrust(n, T, name="+".join(names), order=order)
        found = tuple(shared(name, both, len(names)) for name in names)
    else:
        found = fit_thrusters(columns, names, order=order)
    for one in found:
        if one.rows < rows:
            note(f"note: thruster {one.name}: {rows - one.rows} of {rows} rows have no revolutions or no thrust")
        if one.n_low >= 0:
            note(f"note: thruster {one.name} was not tested astern; astern = 1 is an assumption")
    if out is not None:
        _write(out, "\n".join(_map_toml(one, table.name) for one in found))
    if json:
        emit({"table": table, "file": out, "thrusters": {one.name: _map_json(one) for one in found}})
        return
    rows = [
        (one.name, " ".join(f"n^{k}" for k in one.powers), f"{one.n_low:g} to {one.n_max:g}", f"{one.R2:.5f}",
         figure(one.rmse, 3), *(figure(float(c), 5) for c in one.coefficients))
        for one in found
    ]  # fmt: skip
    head = ("thruster", "terms", "tested [1/s]", "R^2", "rmse [N]", *(f"c_{k}" for k in range(6)))
    show_table(head, rows, right=tuple(range(3, 11)))


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


def servo(paths: Sequence[Path], controls: Sequence[str], out: Path | None, json: bool) -> None:
    """Fit the servos of trials that hold both order and angle, and write the [actuators] of a ship file.

    Raises:
        DataError: trials without both, or in degrees.
    """
    from ..data.trialfile import read_trials

    _writable(out, "actuators", *paths)
    trials = read_trials(paths)
    wanted = tuple(controls) or servos(trials)
    if not wanted:
        raise DataError("no trial has order and angle of a servo; such as alpha_1_cmd [rad] and alpha_1 [rad]")
    found = [fit_servo(trials, control) for control in wanted]
    for one in found:
        for line in one.cautions:
            note(f"warning: {line}")
    if out is not None:
        _write(out, "\n".join(_servo_toml(one) for one in found))
    if json:
        emit({"trials": [trial.name for trial in trials], "file": out,
              "servos": {one.control: _servo_json(one) for one in found}})  # fmt: skip
        return
    rows = [
        (one.control, *(_with(one, key, DEGREE if key in ("rate", "offset") else 1.0)
                        for key in ("rate", "lag", "dead_time", "offset")),
         figure(one.rmse / DEGREE, 3), f"{one.R2:.5f}", str(one.samples))
        for one in found
    ]  # fmt: skip
    head = ("servo", "rate [deg/s]", "lag [s]", "dead time [s]", "offset [deg]", "rmse [deg]", "R^2", "samples")
    show_table(head, rows, right=(5, 6, 7))


def _with(one: ServoFit, key: str, unit: float) -> str:
    value = one.offset if key == "offset" else float(getattr(one.servo, key))
    return f"{value / unit:.5g} ± {one.sigma[key] / unit:.2g}" if key in one.sigma else "–"


def _writable(out: Path | None, kind: str, *sources: Path) -> None:
    """Refuse an output that is no TOML file, lies nowhere, is one of the inputs, or holds what is not ours to replace.

    Args:
        kind: the table that tells a file of this command: "thrusters", or "actuators" alone.
    """
    if out is None:
        return
    if out.suffix != ".toml":
        raise UsageError(f"{out}: a part of a ship file ends in .toml")
    if not out.parent.is_dir():
        raise UsageError(f"{out}: no such folder: {out.parent}")
    if out.is_dir():
        raise UsageError(f"{out}: is a folder; name a file with -o")
    if any(out.exists() and source.exists() and out.samefile(source) for source in sources):
        raise UsageError(f"{out}: is an input; choose another file with -o")
    if out.exists() and not _ours(out, kind):
        raise UsageError(f"{out}: exists, and this command did not write it; choose another file with -o")


def _ours(out: Path, kind: str) -> bool:
    """Whether a file is what the same command wrote before, and so may be replaced."""
    try:
        text = out.read_text(encoding="utf-8")
        tables = set(tomllib.loads(text))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError):
        return False
    return text.startswith(_HEADING) and kind in tables and ("thrusters" in tables) == (kind == "thrusters")


def _write(out: Path, text: str) -> None:
    write_whole(out, f"{_HEADING}\n\n{text}")
    note(f"wrote {out}")


def _number(value: float, unit: str, source: str, sigma: float | None = None) -> str:
    spread = "" if sigma is None or not math.isfinite(sigma) else f", sigma = {float(sigma)!r}"
    quantity = f', unit = "{unit}"' if unit else ""
    return f'{{ value = {float(value)!r}{quantity}{spread}, source = "{source}" }}'


def _map_toml(one: ThrustMap, table: str) -> str:
    """[thrusters.NAME] without its position, which no bollard pull tells, and the limits of its revolutions."""
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


def _map_json(one: ThrustMap) -> Mapping[str, Any]:
    return {
        "coefficients": one.coefficients.tolist(), "sigma": one.sigma.tolist(), "covariance": one.covariance.tolist(),
        "powers": list(one.powers), "n_low": one.n_low, "n_max": one.n_max, "astern": one.astern, "R2": one.R2,
        "rmse": one.rmse, "rows": one.rows,
        "candidates": [{"powers": list(c.powers), "error": c.error, "monotone": c.monotone} for c in one.candidates],
    }  # fmt: skip


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


def _servo_json(one: ServoFit) -> Mapping[str, Any]:
    return {
        "rate": float(one.servo.rate), "lag": float(one.servo.lag), "dead_time": float(one.servo.dead_time),
        "offset": one.offset, "sigma": dict(one.sigma), "rmse": one.rmse, "R2": one.R2, "samples": one.samples,
        "cautions": list(one.cautions),
    }  # fmt: skip
