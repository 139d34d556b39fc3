"""Commands that simulate and measure: simulate, demo, bench."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from . import options as o
from .render import emit, figure, note, say, show_table

if TYPE_CHECKING:
    from ..manoeuvres import Index

DEGREE = math.pi / 180.0


def simulate(
    ship: o.ShipName, name: o.ManoeuvreName, rudder: o.Rudder = None, heading: o.HeadingChange = None,
    side: o.Side = None, seed: o.Seed = None, speed: o.ApproachSpeed = None, rps: o.Rps = None,
    duration: o.Duration = None, dt: o.TimeStep = None, wind: o.Wind = None, gusts: o.Gusts = None,
    current: o.Current = None, waves: o.Waves = None, depth: o.Depth = None, out: o.TrialOut = None,
    json: o.Json = False,
) -> None:  # fmt: skip
    """Simulate a manoeuvre and print its indices."""
    from ..workflow.simulation import simulate as run

    ran = run(ship, name, rudder=rudder, heading=heading, side=side, seed=seed, speed=speed, rps=rps,
              duration=duration, dt=dt, out=out, note=note, wind=wind, gusts=gusts, current=current, waves=waves,
              depth=depth)  # fmt: skip
    indices = {key: index_document(index) for key, index in ran.indices.items()}
    if json:
        emit({"ship": ran.ship.name, "manoeuvre": name, "settings": ran.settings, "complete": ran.complete,
              "reason": ran.reason, "time": ran.trial.duration, "indices": indices})  # fmt: skip
    else:
        show_indices(f"{ran.ship.name}, {ran.policy.kind}", indices)
    if not ran.complete:
        note(f"error: {ran.reason}; indices that the run did not reach are left out")
        raise typer.Exit(1)


def index_document(index: Index) -> dict[str, object]:
    """An index with its unit; angles in degrees, lengths also in ship lengths."""
    if index.unit in ("rad", "rad/s"):
        return {"value": index.value / DEGREE, "unit": index.unit.replace("rad", "deg")}
    out: dict[str, object] = {"value": index.value, "unit": index.unit}
    return out if index.over_L is None else {**out, "over_L": index.over_L}


def show_indices(title: str, indices: Mapping[str, Mapping[str, Any]]) -> None:
    """The indices of a manoeuvre as a table."""
    rows = [
        (name.replace("_", " "), figure(i["value"], 5), i["unit"], figure(i.get("over_L")))
        for name, i in indices.items()
    ]
    show_table((title, "value", "unit", "in L_pp"), rows, right=(1, 3))


def demo(out: o.DemoFolder = Path("demo"), json: o.Json = False) -> None:
    """Run the complete worked example on built-in ships."""
    from ..workflow.demo import tell
    from ..workflow.request import make_folder

    make_folder(out)
    summary = tell(out, note)
    if json:
        emit(summary)
    else:
        say("\n".join(summary["lines"]) + "\n")


def bench(names: o.Peers = None, listed: o.Listed = False, out: o.BenchFolder = None, json: o.Json = False) -> None:
    """Compare run times with those of other programs."""
    from ..engine import SimulationError
    from ..workflow.bench import bench as run

    if listed:
        _list_peers(names or [], json)
        return
    result = run(names or [], out, note)
    if json:
        emit(result)
    else:
        _show_times(result)
    if out is not None:
        note(f"wrote {out / 'bench.json'}")
    if result["failed"]:
        raise SimulationError("; ".join(f"{one['peer']} cannot be measured: {one['why']}" for one in result["failed"]))


def _list_peers(names: list[str], json: bool) -> None:
    from ..workflow.bench import peers, state

    chosen = peers(names)
    if json:
        emit({"peers": [{"name": p.name, "about": p.about, "installed": p.installed} for p in chosen]})
    else:
        show_table(("peer", "what is compared with", "here"), [(p.name, p.about, state(p)) for p in chosen])


def _show_times(result: Mapping[str, Any]) -> None:
    rows = [(r["peer"], r["what"], _time(r["ours_s"]), _time(r["theirs_s"]), f"{r['ratio']:.3g} x")
            for r in result["rows"]]  # fmt: skip
    if rows:
        show_table(("peer", "time of", "ours", "theirs", "ratio"), rows, right=(2, 3, 4))
    for missing in result["not_installed"]:
        say(f"{missing['peer']}: not installed ({missing['get']})\n")
    loops = f"{result['control_loop_ms']:.1f} to {result['slowest_control_loop_ms']:.1f} ms"
    say(f"{result['machine']}; Python control loop {loops}\n")
    if result["busy"]:
        note("note: the machine had other work: the control loop varied; measure again when it is at rest")


def _time(seconds: float) -> str:
    """A time with three digits and a suitable unit."""
    power = min(max(math.floor(math.log10(seconds) / 3), -3), 0)
    return f"{seconds / 10.0 ** (3 * power):.3g} {('s', 'ms', 'us', 'ns')[-power]}"
