"""Commands on ships: ships, show, copy, estimate, captive, scale, roll, seakeeping, export."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from click.exceptions import Exit

from ..report.blocks import Body, fields, table
from . import options as o
from .outcome import FAILED
from .render import answer, figure, note

if TYPE_CHECKING:
    from ..ships import Entry, Ship
    from ..ships.estimate import Number
    from ..workflow.judging import AnotherScale

HEAD = ("number", "value", "unit", "formula", "sigma")
"""Columns of the table of an estimate."""


def ships(check: o.ShipToCheck = None, out: o.Report = None, json: bool = False) -> None:
    """List the ships of the library, or check a ship file."""
    if check is not None:
        _check(check, out, json)
        return
    if out is not None:
        from ..workflow import RequestError

        raise RequestError("-o is the page of --check FILE; name the ship file")
    from ..core.parameters import walk
    from ..ships.files import library, load, variants
    from ..workflow.contributing.published import standing

    found = [(name, ship, standing(ship)) for name in library() for ship in (load(name),)]
    said = {"ships": [
        {"name": name, "title": str(ship.notes.get("title", "")), "L_pp": ship.L_pp, "speed": ship.speed,
         "family": type(ship.model).__name__, "parameters": sum(1 for _ in walk(ship.model)),
         "state": held.state, "figures": held.figures, "within": held.within if held.figures else None,
         "held_against": held.why}
        for name, ship, held in found
    ]}  # fmt: skip
    rows = [
        (name, str(s.notes.get("title", "")), f"{s.L_pp:g}", f"{s.speed:g}", type(s.model).__name__, held.told)
        for name, s, held in found
    ]
    answer(
        fields(said, table(("ship", "what", "L_pp [m]", "U [m/s]", "model", "figures"), rows, words=(1, 4, 5))), json
    )
    if not json:
        note(f"further parameter sets of these ships, taken by name as well: {', '.join(variants())}")


def _check(file: str, out: Path | None, json: bool) -> None:
    """What stands for and against a ship file; exit status 1 where it is not fit for the library."""
    from ..workflow import RequestError
    from ..workflow.contributing.ship_check import check_ship_file

    if file.startswith("-"):
        raise RequestError(f"--check takes a ship file, not {file}; seatrial ships --help tells more")
    checked = check_ship_file(file, out=out, note=note)
    rows = [(one.what, one.state, one.detail) for one in checked.findings]
    said = [dict(zip(("check", "state", "found"), row, strict=True)) for row in rows]
    held = checked.standing
    answer(fields({"ship": checked.ship.name, "state": held.state, "held_against": held.why, "fit": checked.fit,
                   "findings": said}, table(("check", "", "found"), rows, words=(1, 2))), json)  # fmt: skip
    if not json:
        note(f"{checked.ship.name}: {held.told} ({held.why})")
    if not checked.fit:
        raise Exit(FAILED)


def show(ship: o.ShipName, sources: o.Sources = False, json: bool = False) -> None:
    """Show every parameter of a ship with value, unit and meaning."""
    from ..core.parameters import walk
    from ..workflow.request import doubts, ship_of

    found = ship_of(ship)
    entries, doubtful = found.entries, doubts(found)
    for line in doubtful:
        note(f"warning: {line}")
    parameters = {path: {"value": value, "unit": meaning.unit, "about": meaning.about, **_origin(entries.get(path))}
                  for path, meaning, value in walk(found.model)}  # fmt: skip
    rows = [
        (path, f"{value:.6g}", meaning.unit,
         *([entries[path].source if path in entries else "default"] if sources else [meaning.about]))
        for path, meaning, value in walk(found.model)
    ]  # fmt: skip
    answer(fields({"ship": found.name, "L_pp": found.L_pp, "speed": found.speed, "n_P": found.n_P,
                   "parameters": parameters, "doubts": doubtful, "notes": found.notes, **_network(found)},
                  table(("parameter", "value", "unit", "source" if sources else "meaning"), rows, words=(2, 3))),
           json)  # fmt: skip
    for form in () if json else _network(found).values():
        note(f"network: {', '.join(f'{key} {value}' for key, value in form.items())}")


def _origin(entry: Entry | None) -> dict[str, Any]:
    if entry is None:
        return {"source": None}
    return {"source": entry.source, "given": entry.given, "prime": entry.prime, "sigma": entry.sigma}


def _network(ship: Ship) -> dict[str, dict[str, Any]]:
    """The form of a network, where the ship moves by one."""
    net = ship.model.learned
    if net is None:
        return {}
    return {"network": {
        "kind": net.kind, "layers": list(net.layers), "memory": net.memory, "wind": net.wind, "weights": net.count,
        "sha256": net.digest if net.trained else "not trained yet", "limits": net.limits is not None,
    }}  # fmt: skip


def copy(ship: o.ShipName, file: o.CopyFile, json: bool = False) -> None:
    """Write a ship as a complete, commented file to edit."""
    from ..workflow.judging import copy as run

    made = run(ship, file, note)
    answer(fields({"ship": made.name, "of": made.of, "file": file}), json)


def estimate(
    particulars: o.Particulars, out: o.ShipOut, shallow: o.FeelsDepth = False, GM: o.Heeling = None, json: bool = False
) -> None:
    """Estimate a ship from its particulars by regression formulas."""
    from ..workflow.judging import estimate as run

    made = run(particulars, out, note, shallow=shallow, GM=GM)
    said = {item.path: _document(item, made.ship.entries[item.path].source) for item in made.numbers}
    answer(fields({"ship": made.ship.name, "file": out, "cautions": made.cautions, "numbers": said},
                  table(HEAD, (_row(one) for one in made.numbers if one.formula != "given"), words=(2, 3))),
           json)  # fmt: skip


def captive(
    ship: o.ShipName, tables: o.CaptiveTables, mapping: o.CaptiveMapping = None, open_water: o.OpenWater = None,
    free: o.FreeCoefficients = (), out: o.ShipFile = None, report: o.TestPage = None, json: bool = False,
) -> None:  # fmt: skip
    """Fit coefficients to captive tests."""
    from ..core.parameters import read, specs
    from ..report.judging.captive import numbers, shown
    from ..workflow.judging import captive as run

    found = run(ship, tables, out, mapping=mapping, free=free, water=open_water, page=report, note=note)
    said, meanings, L = {v.subject: v for v in found.verdicts}, specs(found.ship.model), found.ship.L_pp

    def row(path: str, value: float, sigma: float | None) -> tuple[str, ...]:
        unit = meanings[path].unit
        before, now = (shown(path, v, unit, L) for v in (float(read(found.began.model, path)), value))
        spread = "–" if sigma is None else figure(shown(path, sigma, unit, L), 2)
        why = ", ".join(found.determined_by[path]) if sigma is not None else found.held[path]
        return path, figure(before), figure(now), spread, said[path].status, why

    rows = [row(path, float(v), float(s)) for path, v, s in zip(found.paths, found.values, found.sigma, strict=True)]
    rows += [row(path, float(read(found.ship.model, path)), None) for path in found.held]
    head = ("parameter", "before", "captive", "sigma", "verdict", "determined by")
    answer(fields({**numbers(found), "file": out, "report": report}, table(head, rows, words=(4, 5))), json)
    for one in () if json else found.verdicts:
        if " and " in one.subject:
            note(f"note: {one.subject}: {one.text}")


def scale(
    ship: o.ShipName, to_length: o.ToLength, form_factor: o.FormFactor = None, roughness: o.Roughness = None,
    density: o.Density = None, rudder_wake: o.RudderWake = "proportion", froude: o.FroudeAlone = False,
    out: o.ShipFile = None, json: bool = False,
) -> None:  # fmt: skip
    """Scale a ship from model to full size, or back."""
    from ..workflow.judging import scale as run

    made = run(ship, to_length, out, form_factor=form_factor, roughness=None if roughness is None else roughness * 1e-6,
               density=density, rudder=rudder_wake, friction=not froude, note=note)  # fmt: skip
    found, a, b = made.scaled, made.before, made.after
    said = {"ship": found.ship.name, "L_pp": found.ship.L_pp, "speed": found.ship.speed, "wetted_surface": found.S,
            "friction": {"before": found.before, "after": found.after},
            "effects": {k: {"before": x, "after": y, "why": why} for k, (x, y, why) in found.effects.items()},
            "self_propulsion": {"before": a, "after": b}, "cautions": found.cautions, "file": out}  # fmt: skip
    if froude and not json:
        note(f"{found.ship.name}: L_pp {found.ship.L_pp:g} m, {found.ship.speed:g} m/s, by Froude's law alone")
    answer(fields(said, () if froude else _scaled(made)), json)


def _scaled(made: AnotherScale) -> Body:
    """What friction changes, and with it the propulsion."""
    found, a, b = made.scaled, made.before, made.after
    f, g = found.before, found.after
    rows = [
        ("Reynolds number", f.Re, g.Re, "at the approach speed"), ("C_F", f.C_F, g.C_F, "ITTC 1957"),
        ("dC_F", f.dC_F, g.dC_F, "ITTC 1978, roughness"), ("(1 + k) C_F + dC_F", f.whole, g.whole, f"k = {f.form:.3g}"),
        *((path, x, y, why) for path, (x, y, why) in found.effects.items()),
    ]  # fmt: skip
    if a is not None and b is not None:
        rows += [
            ("n_P [1/s]", a.n_P, b.n_P, "holds the approach speed"),
            ("thrust'", a.thrust, b.thrust, "over 0.5 rho L d U^2"),
            ("rudder force by angle", a.rudder, b.rudder, "over 0.5 rho A_R U^2 and radian"),
        ]
    shown = [(name, figure(x), figure(y), why) for name, x, y, why in rows]
    return table(("number", "before", "after", "why"), shown, words=(3,))


def roll(
    ship: o.ShipName, GM: o.Metacentric, KG: o.GravityAboveKeel, midship: o.Midship = 0.98, keels: o.Keels = None,
    out: o.ShipFile = None, json: bool = False,
) -> None:  # fmt: skip
    """Add heel and roll to a ship."""
    from ..workflow.seaway.making import roll as run

    _more(run(ship, GM, KG, out, C_m=midship, keels=keels, note=note), ("roll",), out, json)


def seakeeping(
    ship: o.ShipName, data: o.Coefficients, roll_damping: o.OwnRollDamping = None, added: o.AddedMass = "ship",
    out: o.ShipFile = None, json: bool = False,
) -> None:  # fmt: skip
    """Add heave, pitch and the memory of waves to a ship."""
    from ..workflow.seaway.making import seakeeping as run

    _more(run(ship, data, out, roll_damping=roll_damping, added=added, note=note), ("roll", "heave"), out, json)


def _more(made: Ship, tables: tuple[str, ...], out: Path | None, json: bool) -> None:
    """A ship with more degrees of freedom: what is new in it."""
    from ..core.parameters import walk

    rows = [(path, value, meaning.unit, made.entries[path].source if path in made.entries else "default")
            for path, meaning, value in walk(made.model) if path.partition(".")[0] in tables]  # fmt: skip
    said = {path: {"value": value, "unit": unit, "source": source} for path, value, unit, source in rows}
    shown = table(("parameter", "value", "unit", "source"), [(p, figure(v), u, s) for p, v, u, s in rows], words=(2, 3))
    answer(fields({"ship": made.name, "of": made.of, "file": out, "states": made.model.states, "parameters": said},
                  shown), json)  # fmt: skip


def export(
    model: o.ShipName, casadi: o.Casadi = None, c: o.CFolder = None, python: o.PythonFile = None,
    actuators: o.ActuatorStep = None, fmu: o.Fmu = None, fmi: o.Fmi = None, hull: o.HullAlone = False,
    dt: o.SlaveStep = None, platforms: o.Platforms = None, json: bool = False,
) -> None:  # fmt: skip
    """Export a ship as a CasADi function, C, Python or an FMU."""
    from ..workflow.plant import export as run

    made = run(model, casadi=casadi, c=c, python=python, actuators=actuators, fmu=fmu, fmi=fmi, hull=hull, dt=dt,
               platforms=platforms, note=note)  # fmt: skip
    answer(fields({**made.description, "written": made.written}), json)
    for path in () if json else made.written:
        note(f"wrote {path}")


def _row(item: Number) -> tuple[str, ...]:
    """A line of 80 columns; ranges, other formulas and what sigma is from stand in the ship file and in JSON."""
    share = "–" if item.share is None else f"{item.share:.0%}"
    return item.path, figure(item.value), item.unit or "–", item.formula, share


def _document(item: Number, source: str) -> dict[str, Any]:
    return {
        "value": item.value, "unit": item.unit, "formula": item.formula, "in_range": not item.outside,
        "outside": item.outside, "range_from": item.basis, "others": item.others, "spread": item.spread,
        "sigma": item.sigma, "relative_sigma": item.share, "sigma_from": item.sigma_from, "source": source,
    }  # fmt: skip
