"""Commands on logs and tables: import, convert, resample, mend, thrust-map, servo."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from ..report.blocks import Body, bullets, fields, line
from ..report.blocks import table as rows_under
from . import options as o
from .render import answer, figure, note

if TYPE_CHECKING:
    from pathlib import Path

    from ..identify.components.servo import ServoFit
    from ..identify.components.thrust_map import ThrustMap
    from ..workflow.data import Imported

_DEGREE = math.pi / 180.0


def import_(
    format: o.LogFormat = None, source: o.Source = None, out: o.Imports = None, mapping: o.Mapping = None,
    guess: o.GuessOf = None, json: bool = False,
) -> None:  # fmt: skip
    """Import logs of other tools, or guess their mapping."""
    from ..workflow.data import import_logs, importing

    if guess is not None:
        _guess(guess, out, format or source or mapping, json)
        return
    format, source, out = importing(format, source, out)
    made = import_logs(format, source, out, mapping, note)
    told = f"{len(made.written)} trial{'s' * (len(made.written) != 1)} in {out}; next: seatrial check {out}"
    answer(fields({"format": format, **vars(made)}, _found(made) + line(told)), json)


def _found(made: Imported) -> Body:
    """What the trials hold of what a fit wants, those that hold the same in one row; what is missing, what ignored."""
    from ..data.found import QUANTITIES

    rows: dict[tuple[str, str], list[str]] = {}
    for trial, sources in made.sources.items():
        for quantity in QUANTITIES:
            said = sources.get(quantity, "not found")
            rows.setdefault((quantity, said), []).append(trial)
    count = len(made.written)
    order = list(QUANTITIES)
    cells = [[quantity, "all" if len(names) == count else ", ".join(names[:3]) + ", ..." * (len(names) > 3), said]
             for (quantity, said), names in sorted(rows.items(), key=lambda row: order.index(row[0][0]))]  # fmt: skip
    ignored: dict[str, int] = {}
    for one in made.ignored.values():
        for kind, number in one.items():
            ignored[kind] = ignored.get(kind, 0) + number
    left = ", ".join(f"{number} {kind}" for kind, number in sorted(ignored.items(), key=lambda one: -one[1]))
    return rows_under(["quantity", "trials", "from"], cells, words=(1, 2)) + (line(f"ignored: {left}") if left else ())


def _guess(folder: Path, out: Path | None, more: object, json: bool) -> None:
    from ..workflow.data import guess_mapping

    found = guess_mapping(folder, out, more)
    for told in () if json else (*found.notes, *(f"doubt: {one}" for one in found.doubts if out and found.text)):
        note(told)
    ask = f"answer {', '.join(found.asks)} in it, then" if found.asks else "read it, then"
    count = f"{len(found.doubts)} doubt{'s' * (len(found.doubts) != 1)}"
    following = f"{out}: {count}; {ask}: seatrial import {found.format} {folder} --mapping {out} -o trials"
    shown = line(following) if out else bullets(found.text.splitlines())
    answer(fields({**vars(found), "file": out if found.text else None}, shown if found.text else ()), json)


def convert(trials: o.Trials, to: o.RobotFormat, out: o.LogFolder, json: bool = False) -> None:
    """Convert trial files to robot logs with standard messages."""
    from ..workflow.data import convert as run

    answer(_written({"format": to}, run(trials, to, out)), json)


def resample(trials: o.Trials, dt: o.NewStep, out: o.TrialFolder, json: bool = False) -> None:
    """Resample trials to even time steps."""
    from ..workflow.data import resample as run

    answer(_written({"dt": dt}, run(trials, dt, out)), json)


def mend(trials: o.Trials, by: o.Steps, out: o.TrialFolder, json: bool = False) -> None:
    """Mend trials by a file of steps, as check --remedy writes."""
    from ..workflow.data import mend as run

    answer(_written({"by": by}, run(trials, by, out)), json)


def _written(how: Mapping[str, object], files: Sequence[Path]) -> Body:
    return fields({**how, "written": files}, bullets(map(str, files)))


def thrust_map(
    table: o.Pull, out: o.TablesOut = None, thrusters: o.Thrusters = None, together: o.Together = False,
    order: o.Order = None, json: bool = False,
) -> None:  # fmt: skip
    """Fit thrust by revolutions to a bollard pull."""
    from ..workflow.plant import thrust_map as run

    found = run(table, out, thrusters, together, order, note)
    rows = [
        (one.name, " ".join(f"n^{k}" for k in one.powers), f"{one.n_low:g} to {one.n_max:g}", f"{one.R2:.5f}",
         figure(one.rmse, 3), *(figure(float(c), 5) for c in one.coefficients))
        for one in found
    ]  # fmt: skip
    head = ("thruster", "terms", "tested [1/s]", "R^2", "rmse [N]", *(f"c_{k}" for k in range(6)))
    answer(fields({"table": table, "file": out, "thrusters": {one.name: _map_document(one) for one in found}},
                  rows_under(head, rows, words=(1, 2))), json)  # fmt: skip


def servo(trials: o.Trials, control: o.Control = (), out: o.TablesOut = None, json: bool = False) -> None:
    """Fit rate, lag and dead time of thrusters or rudders."""
    from ..workflow.plant import servo as run

    read, found = run(trials, control, out, note)
    rows = [
        (one.control, *(_with_spread(one, key) for key in ("rate", "lag", "dead_time", "offset")),
         figure(one.rmse / _DEGREE, 3), f"{one.R2:.5f}", str(one.samples))
        for one in found
    ]  # fmt: skip
    head = ("servo", "rate [deg/s]", "lag [s]", "dead time [s]", "offset [deg]", "rmse [deg]", "R^2", "samples")
    answer(fields({"trials": [trial.name for trial in read], "file": out,
                   "servos": {one.control: _servo_document(one) for one in found}},
                  rows_under(head, rows, words=(1, 2, 3, 4))), json)  # fmt: skip


def _with_spread(one: ServoFit, key: str) -> str:
    unit = _DEGREE if key in ("rate", "offset") else 1.0
    value = {**vars(one.servo), "offset": one.offset}[key]
    return f"{value / unit:.5g} ± {one.sigma[key] / unit:.2g}" if key in one.sigma else "–"


def _map_document(one: ThrustMap) -> Mapping[str, Any]:
    held = {key: value for key, value in vars(one).items() if key != "name"}
    return {**held, "sigma": one.sigma, "powers": one.powers}


def _servo_document(one: ServoFit) -> Mapping[str, Any]:
    held = {key: value for key, value in vars(one).items() if key not in ("control", "servo")}
    return {"rate": one.servo.rate, "lag": one.servo.lag, "dead_time": one.servo.dead_time, **held}
