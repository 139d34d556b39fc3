"""The command `design`: which manoeuvres to run for the parameters that are wanted."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from ..core.parameters import unknown
from ..models import STATES
from .support import DEGREE, UsageError, emit, figure, note, positive, read_ship, say, show_table

if TYPE_CHECKING:
    from ..identify.design.optimal import Plan

_ANGULAR = ("psi", "r")


def design(
    ship: str, free: Sequence[str], *, budget: float = 60.0, noise: str | None = None,
    interval: float | None = None, repeats: int = 1, json: bool = False,
) -> None:  # fmt: skip
    """Choose manoeuvres for the parameters `free` of a ship and say what they would tell.

    Args:
        ship: a name of the library or a ship file.
        free: patterns of parameter paths, such as ``hull.*``.
        budget: greatest dimensionless length T' = T V/L of the set.
        noise: sensor noise as ``x=0.5,psi=0.1``: m, m/s, deg and deg/s; None assumes good sensors.
        interval: time between independent readings [s].
        repeats: how often one manoeuvre may be run.

    Raises:
        UsageError, ParameterError, StudyError, ShipError: a request that cannot be carried out.
    """
    from ..identify.design.candidates import usual
    from ..identify.design.excitation import plan, usual_noise, wanted

    positive(budget=budget, interval=interval, repeats=float(repeats))
    vessel = read_ship(ship)
    if not free:
        raise UsageError("--free: name the parameters to design for, such as 'hull.*' (seatrial show SHIP lists them)")
    deviations = _noise(noise) if noise else usual_noise(vessel)
    if not noise:
        note("note: no --noise given; good sensors are assumed: " + _told(deviations))
    found = plan(
        vessel, wanted(vessel, free), usual(vessel), budget, noise=deviations, interval=interval, repeats=repeats
    )
    for line in found.left_out:
        note(f"note: left out: {line}")
    if json:
        emit({"ship": vessel.name, "budget": budget, "noise": deviations, **_document(found)})
    else:
        _show(vessel.name, found)


def _noise(text: str) -> dict[str, float]:
    """Deviations in SI units and radians from ``channel=value,...``.

    Raises:
        UsageError: an unknown channel, or no number above zero.
    """
    out: dict[str, float] = {}
    for part in text.split(","):
        name, _, value = part.strip().partition("=")
        if name not in STATES:
            raise UsageError(f"--noise: {unknown(name, STATES, 'channel')}")
        try:
            number = float(value)
        except ValueError:
            raise UsageError(f"--noise: '{part.strip()}' is no deviation; write {name}=0.1") from None
        positive(noise=number)
        out[name] = number * (DEGREE if name in _ANGULAR else 1.0)
    return out


def _told(deviations: dict[str, float]) -> str:
    units = {"x": "m", "y": "m", "psi": "deg", "u": "m/s", "v_m": "m/s", "r": "deg/s"}
    return ", ".join(
        f"{name} {figure(value / (DEGREE if name in _ANGULAR else 1.0), 2)} {units[name]}"
        for name, value in deviations.items()
    )


def _document(found: Plan) -> dict[str, Any]:
    from ..identify.design.excitation import TABLE_1

    return {
        "manoeuvres": [{"name": name, "length": length, "gain": gain} for name, length, gain in found.chosen],
        "length": found.length, "log_det": found.log_det,
        "parameters": {
            f.path: {"value": f.start, "sigma": sigma, "removed": share, "status": verdict.status}
            for f, sigma, share, verdict in zip(
                found.free, found.sigma.tolist(), found.share.tolist(), found.verdicts, strict=False
            )
        },
        "open": [{"combination": v.subject, "text": v.text} for v in found.verdicts[len(found.free) :]],
        "left_out": list(found.left_out),
        "published": [
            {"reference": p.reference, "model": p.model, "parameters": list(p.parameters),
             "manoeuvres": p.manoeuvres, "length": list(p.length)} for p in TABLE_1
        ],
    }  # fmt: skip


def _show(name: str, found: Plan) -> None:
    from ..identify.design.excitation import TABLE_1

    rows = [(what, figure(length), figure(gain)) for what, length, gain in found.chosen]
    rows.append(("together", figure(found.length), figure(found.log_det)))
    show_table((f"{name}: manoeuvre", "T'", "adds to log det"), rows, right=(1, 2))
    parameters = [
        (f.path, figure(f.start), figure(sigma, 2), f"{share:.0%}", verdict.status)
        for f, sigma, share, verdict in zip(
            found.free, found.sigma.tolist(), found.share.tolist(), found.verdicts, strict=False
        )
    ]
    show_table(("parameter", "value", "expected +-", "prior removed", "status"), parameters, right=(1, 2, 3))
    for verdict in found.verdicts:
        if verdict.status != "identified":
            say(f"{verdict.subject}: {verdict.text}\n")
    published = [
        (f"[{p.reference}]", p.model, ", ".join(map(str, p.parameters)), p.manoeuvres,
         figure(p.length[0]) if p.length[0] == p.length[1] else f"{p.length[0]:g}-{p.length[1]:g}")
        for p in TABLE_1
    ]  # fmt: skip
    show_table(("Sawada 2024 Table 1", "model", "parameters", "manoeuvres", "T'"), published, right=(2, 4))
