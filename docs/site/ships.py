"""A page for each ship of the library: its manoeuvres, what it is held against, particulars, validity, sources."""

from __future__ import annotations

import csv
import math
import warnings
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

import seatrial as st
from equations import literal

_KEPT = 400
_PARTICULARS = ("L_pp", "B", "d", "C_b", "m", "rho", "x_G")
_SETTINGS = ("speed", "rps", "rudder", "heading", "steer", "throttle", "dt")
_DEGREES = math.degrees(1.0)


def write(out: Path) -> list[str]:
    """Write a page, two pictures and their data for each ship; their names."""
    names = list(st.library())
    with ThreadPoolExecutor(2) as pool:
        runs = dict(zip(names, pool.map(_runs, names), strict=True))  # compiling waits for the compiler
    for name in names:
        (out / f"{name}.md").write_text(page(name, runs[name], out), encoding="utf-8")
    return names


def _runs(name: str) -> tuple[st.Ship, Mapping[str, Any]]:
    """Turns to both sides and a zigzag, as far as the ship can."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # its cautions stand on the page
        ship = st.load(name)
    angle = _largest(ship)
    wanted = {"starboard": st.Turning(rudder_deg=angle), "port": st.Turning(rudder_deg=angle, side="port"),
              "zigzag": st.Zigzag(rudder_deg=10.0, heading_deg=10.0)}  # fmt: skip
    found: dict[str, Any] = {}
    for kind, order in wanted.items():
        for one in (order, _by_demand(kind)):
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    found[kind] = ship.simulate(one)
                break
            except st.SeatrialError:
                continue
    return ship, found


def _largest(ship: st.Ship) -> float:
    return min(35.0, math.degrees(getattr(ship.actuators.rudder, "high", math.inf)))


def _by_demand(kind: str) -> Any:
    if kind == "zigzag":
        return st.Zigzag(steer_percent=30.0, heading_deg=10.0)
    return st.Turning(steer_percent=50.0, side="port" if kind == "port" else "starboard")


def page(name: str, ran: tuple[st.Ship, Mapping[str, Any]], out: Path) -> str:
    """The page of a ship; pictures and data are written beside it."""
    ship, runs = ran
    title = str(ship.notes.get("title", name))
    family = type(ship.model)
    room = family.__module__.rpartition(".")[2]
    parts = [f"# {name}\n\n{literal(title)}\n\n",
             f"Family [`{room}:{family.__name__}`](../families/{room}.md), L_pp {ship.L_pp:g} m, approach "
             f"speed {ship.speed:.4g} m/s. `seatrial show {name} --sources` lists every number.\n"]  # fmt: skip
    cautions = "".join(f"- {literal(one)}\n" for one in _texts(ship.notes.get("cautions", ())))
    parts += [f"\n:::{{admonition}} Cautions\n:class: caution\n{cautions}:::\n"] if cautions else []
    parts += [*_pictures(name, ship, runs, out), *_held(ship), *_particulars(ship), *_validity(ship), *_sources(ship)]
    return "".join(parts)


def _pictures(name: str, ship: st.Ship, runs: Mapping[str, Any], out: Path) -> Iterator[str]:
    turns = {side: runs[side] for side in ("starboard", "port") if side in runs}
    if not turns and "zigzag" not in runs:
        yield "\nThis ship runs neither a turning circle nor a zigzag.\n"
        return
    yield "\n## Manoeuvres\n"
    if turns:
        _turning_circle(ship, turns, out / f"{name}-turning.svg")
        yield _shown(name, "turning", "Turning circles: north up, east to the right", turns, out)
    if "zigzag" in runs:
        _zigzag(runs["zigzag"], out / f"{name}-zigzag.svg")
        yield _shown(name, "zigzag", "Zigzag: heading and order over time", {"": runs["zigzag"]}, out)


def _shown(name: str, kind: str, about: str, runs: Mapping[str, Any], out: Path) -> str:
    links = []
    for side, run in runs.items():
        stem = f"{name}-{kind}{'-' + side if side else ''}.csv"
        _data(run, out / stem)
        links.append(f"{{download}}`{side or 'data'} (CSV) <{stem}>`")
    (first, *_) = runs.values()
    rows = "".join(f"| {row[0]} | {row[1]} | {row[2]} |\n" for row in _indices(first))
    settings = ", ".join(
        f"{key} {_given(value)}" for key, value in first.settings.items() if key in _SETTINGS and value is not None
    )
    command = f"`{_command(name, kind, first.settings)}`"
    return (f"\n```{{image}} {name}-{kind}.svg\n:alt: {about} of {name}\n```\n\n{about}; {literal(settings)}. "
            f"{command}. Data: {', '.join(links)}.\n\n| index | value | unit |\n|---|---|---|\n{rows}")  # fmt: skip


def _command(name: str, kind: str, settings: Mapping[str, Any]) -> str:
    """What prints these figures."""
    given = "".join(f" --{key} {settings[key]:g}" for key in ("rudder", "heading", "steer")
                    if isinstance(settings.get(key), int | float))  # fmt: skip
    return f"seatrial simulate {name} {kind}{given}"


def _held(ship: st.Ship) -> Iterator[str]:
    """Figures that sources give beside those of the model, or why there are none."""
    found = st.published.standing(ship)
    yield f"\n## Held against\n\n{found.told}: {literal(found.why)}.\n"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        rows = [_beside(one) for one in st.published.reproduce(ship, st.published.published(ship))]
    if rows:
        yield ("\n| figure | by | published | model | within |\n|---|---|---|---|---|\n" + "".join(rows)
               + f"\n`seatrial ships --check` of the file of {ship.name} runs them again.\n")  # fmt: skip


def _beside(one: st.published.Reproduced) -> str:
    said = one.published
    given = ", ".join(f"{key} {_given(value)}" for key, value in said.settings.items())
    run = f"{said.manoeuvre} {given}".strip()
    gave = st.published.shown(said, said.value)
    value = st.published.shown(said, one.value) if math.isfinite(one.value) else literal(one.reason)
    return (f"| {said.index.replace('_', ' ')}, {literal(run)} | {said.by} | {gave} | {value} | "
            f"{100.0 * said.within:.2g} % |\n")  # fmt: skip


def _given(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _indices(run: Any) -> Iterator[tuple[str, str, str]]:
    for index, value in run.indices.found.items():
        angle = value.unit.startswith("rad")
        number = value.value * (_DEGREES if angle else 1.0)
        yield index.replace("_", " "), f"{number:.4g}", value.unit.replace("rad", "deg") if angle else value.unit


def _data(run: Any, path: Path) -> None:
    step = max(1, len(run.t) // _KEPT)
    names = [one for one in ("x", "y", "psi", "u", "v_m", "r", "delta", "n_P") if one in run]
    with path.open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file)
        table.writerow(["t [s]", *(f"{one} [{run.unit(one)}]" for one in names)])
        for i in range(0, len(run.t), step):
            table.writerow([f"{run.t[i]:.6g}", *(f"{run[one][i]:.8g}" for one in names)])


def _turning_circle(ship: st.Ship, runs: Mapping[str, Any], path: Path) -> None:
    with mpl.rc_context(st.figures.STYLE):
        figure = Figure(figsize=(6.0, 4.0), layout="constrained")
        ax = figure.subplots()
        for (side, run), (colour, dashes) in zip(
            runs.items(), ((st.figures.BLUE, "-"), (st.figures.VERMILION, "--")), strict=False
        ):
            ax.plot(run["y"] / ship.L_pp, run["x"] / ship.L_pp, dashes, color=colour, label=f"to {side}")
        ax.set(xlabel="east / L_pp [-]", ylabel="north / L_pp [-]", aspect="equal")
        ax.legend(loc="best")
        figure.savefig(path, metadata={"Date": None})


def _zigzag(run: Any, path: Path) -> None:
    with mpl.rc_context(st.figures.STYLE):
        figure = Figure(figsize=(6.0, 3.0), layout="constrained")
        ax = figure.subplots()
        ax.plot(run.t, run["psi"] * _DEGREES, color=st.figures.BLUE, label="heading")
        if "delta" in run:
            ax.plot(run.t, run["delta"] * _DEGREES, "--", color=st.figures.VERMILION, label="rudder")
        ax.axhline(0.0, color=st.figures.GREY, lw=0.8)
        ax.set(xlabel="t [s]", ylabel="angle [°], starboard positive")
        ax.legend(loc="best")
        figure.savefig(path, metadata={"Date": None})


def _particulars(ship: st.Ship) -> Iterator[str]:
    rows = []
    for path in ship.parameters:
        if path.rpartition(".")[2] in _PARTICULARS:
            entry = ship.entries.get(path)
            rows.append(f"| `{path}` | {ship.parameters[path]:.6g} | {literal(entry.source if entry else '')} |\n")
    if rows:
        yield f"\n## Particulars\n\n| number | value (SI) | source |\n|---|---|---|\n{''.join(rows)}"


def _validity(ship: st.Ship) -> Iterator[str]:
    if ship.validity:
        rows = "".join(f"| `{name}` | {low:g} | {high:g} |\n" for name, (low, high) in ship.validity.items())
        yield f"\n## Validity\n\nA run outside is an error.\n\n| state (SI) | from | to |\n|---|---|---|\n{rows}"


def _sources(ship: st.Ship) -> Iterator[str]:
    counted: dict[str, int] = {}
    for entry in ship.entries.values():
        counted[entry.source or "not given"] = counted.get(entry.source or "not given", 0) + 1
    most = sorted(counted.items(), key=lambda one: -one[1])
    rows = "".join(f"| {literal(source)} | {count} |\n" for source, count in most)
    yield f"\n## Sources\n\n| source | numbers |\n|---|---|\n{rows}"
    yield "\n" + "".join(f"- {literal(one)}\n" for one in _texts(ship.notes.get("references", ())))


def _texts(said: Any) -> list[str]:
    return [said] if isinstance(said, str) else [str(one) for one in said]
