"""The commands about ships and models: what there is, what it can do, and one made from particulars."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from ..core.parameters import walk
from ..ships import Ship
from .support import doubts, emit, note, read_ship, show_table

ShipName = Annotated[str, typer.Argument(help="A name of the library (seatrial ships) or a ship file.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
Page = Annotated[Path | None, typer.Option("-o", "--out", help="Report to write (.html).")]


def ships(json: Json = False) -> None:
    """The library of ships."""
    from ..ships.files import library

    found = [(name, read_ship(name)) for name in library()]
    if json:
        emit({"ships": [
            {"name": name, "title": str(ship.notes.get("title", "")), "L_pp": ship.L_pp, "speed": ship.speed,
             "family": type(ship.model).__name__, "parameters": sum(1 for _ in walk(ship.model))}
            for name, ship in found
        ]})  # fmt: skip
        return
    rows = [
        (name, str(s.notes.get("title", "")), f"{s.L_pp:g}", f"{s.speed:g}", type(s.model).__name__)
        for name, s in found
    ]
    show_table(("ship", "what", "L_pp [m]", "U [m/s]", "model"), rows, right=(2, 3))


def show(
    ship: ShipName,
    sources: Annotated[bool, typer.Option("--sources", help="Where each number comes from.")] = False,
    json: Json = False,
) -> None:
    """Every parameter of a ship with value, unit and meaning."""
    found = read_ship(ship)
    entries, doubtful = found.entries, doubts(found)
    for line in doubtful:
        note(f"warning: {line}")
    if json:
        emit({"ship": found.name, "L_pp": found.L_pp, "speed": found.speed, "n_P": found.n_P,
              "parameters": {
                  path: {"value": value, "unit": meaning.unit, "about": meaning.about,
                         **({"source": entries[path].source, "given": entries[path].given,
                             "prime": entries[path].prime, "sigma": entries[path].sigma}
                            if path in entries else {"source": None})}
                  for path, meaning, value in walk(found.model)
              }, "doubts": doubtful, "notes": dict(found.notes), **_network(found)})  # fmt: skip
        return
    rows = [
        (path, f"{value:.6g}", meaning.unit,
         *([entries[path].source if path in entries else "default"] if sources else [meaning.about]))
        for path, meaning, value in walk(found.model)
    ]  # fmt: skip
    show_table(("parameter", "value", "unit", "source" if sources else "meaning"), rows, right=(1,))
    for form in _network(found).values():
        note(f"network: {', '.join(f'{key} {value}' for key, value in form.items())}")


def _network(ship: Ship) -> dict[str, dict[str, Any]]:
    """The form of a network, where the ship moves by one."""
    net = ship.model.learned
    if net is None:
        return {}
    return {"network": {
        "kind": net.kind, "layers": list(net.layers), "memory": net.memory, "wind": net.wind, "weights": net.count,
        "sha256": net.digest if net.trained else "not trained yet", "limits": net.limits is not None,
    }}  # fmt: skip


def models(
    purpose: Annotated[str | None, typer.Option("--for", help="Recommend for a purpose, such as berthing.")] = None,
    json: Json = False,
) -> None:
    """The families of models: what each can and cannot represent, what it needs and costs."""
    from .models import models as run

    run(purpose, json)


def estimate(
    particulars: Annotated[Path, typer.Argument(help="A file of particulars (docs/tutorials/estimate.md).")],
    out: Annotated[Path, typer.Option("-o", "--out", help="Ship file to write (.toml).")],
    json: Json = False,
) -> None:
    """A ship from its particulars by regression formulas, each number with its formula and spread."""
    from .estimate import estimate as run

    run(particulars, out, json)


def design(
    ship: ShipName,
    free: Annotated[list[str], typer.Option("--free", help="Parameters to be identified, such as 'hull.*'.")],
    budget: Annotated[float, typer.Option(help="Length of all trials together, T' = T V/L.")] = 60.0,
    noise: Annotated[str | None, typer.Option(help="Sensor noise such as x=0.5,psi=0.1 (m, m/s, deg, deg/s).")] = None,
    interval: Annotated[float | None, typer.Option(help="Time between independent readings [s].")] = None,
    repeats: Annotated[int, typer.Option(help="How often one manoeuvre may be run.")] = 1,
    json: Json = False,
) -> None:
    """Which manoeuvres tell most about the parameters, by Fisher information."""
    from .design import design as run

    run(ship, free, budget=budget, noise=noise, interval=interval, repeats=repeats, json=json)


def requirements(
    ship: ShipName,
    scope: Annotated[str, typer.Option(help="collision-avoidance, berthing or functional.")] = "collision-avoidance",
    out: Page = None,
    json: Json = False,
) -> None:
    """What a simulator for autonomous ships must do (Sawada 2024 section 6), item by item, with evidence."""
    from .requirements import requirements as run

    run(ship, scope, out, json)


def imo(ship: ShipName, out: Page = None, json: Json = False) -> None:
    """The criteria of IMO MSC.137(76) for a ship."""
    from .imo import imo as run

    run(ship, out, json)


def export(
    model: ShipName,
    casadi: Annotated[Path | None, typer.Option(help="CasADi function; its step and names go beside it.")] = None,
    c: Annotated[Path | None, typer.Option("--c", help="Folder for a C99 source file and its header.")] = None,
    python: Annotated[Path | None, typer.Option(help="Python file that needs the standard library only.")] = None,
    actuators: Annotated[
        float | None, typer.Option(metavar="S", help="Also a step of S seconds from orders, through the actuators.")
    ] = None,
    fmu: Annotated[Path | None, typer.Option(help="Co-simulation slave (.fmu), orders in.")] = None,
    fmi: Annotated[int | None, typer.Option(help="Of --fmu: version of the interface, 2 (else) or 3.")] = None,
    hull: Annotated[bool, typer.Option("--hull", help="Of --fmu: the hull alone, forces in.")] = False,
    dt: Annotated[float | None, typer.Option(help="Of --fmu: internal step [s]; else one that suits the ship.")] = None,
    json: Json = False,
) -> None:
    """The plant of a ship for controllers and co-simulation: a CasADi function, C, a Python file, an FMU."""
    from .export import Slave
    from .export import export as run

    run(model, casadi, c, python, actuators, Slave(fmu, hull, dt, fmi), json)


def thrust_map(
    table: Annotated[Path, typer.Argument(help="Bollard pull, columns such as n [1/s],T_1 [N],T_2 [N].")],
    out: Annotated[Path | None, typer.Option("-o", "--out", help="Tables of a ship file to write (.toml).")] = None,
    thrusters: Annotated[str | None, typer.Option(help="Names of the ship's thrusters, such as 1,2.")] = None,
    together: Annotated[bool, typer.Option("--together", help="One column is the thrust of all of them.")] = False,
    order: Annotated[int | None, typer.Option(help="Highest power of n; else by cross-validation.")] = None,
    json: Json = False,
) -> None:
    """Thrust by revolutions from a bollard pull, per thruster, with the range that was tested."""
    from .thrusters import thrust_map as run

    run(table, out, thrusters, together, order, json)


def servo(
    trials: Annotated[list[Path], typer.Argument(help="Trial files, or folders of them.")],
    control: Annotated[list[str] | None, typer.Option(help="Such as alpha_1; else all that have an order.")] = None,
    out: Annotated[Path | None, typer.Option("-o", "--out", help="Tables of a ship file to write (.toml).")] = None,
    json: Json = False,
) -> None:
    """Rate, lag and dead time of azimuth thrusters or rudders, from their ordered and actual angles."""
    from .thrusters import servo as run

    run(trials, control or (), out, json)
