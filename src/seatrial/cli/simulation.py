"""Commands that run ships: simulate, harbour, steer (NMEA 0183), bridge (a page), range, twin, demo; and bench."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from click.exceptions import Exit

from ..core.errors import RequestError, RunError
from ..report.blocks import Block, Body, bullets, fields, table
from ..workflow.asked import Approach, Around, Bands, Departure, InWaves, Orders, Page, RealTime, Serving, Span, Wire
from . import options as o
from .evidence import bands_shown
from .fits import port_of, show
from .render import answer, fault, figure, hand_on, note

if TYPE_CHECKING:
    from ..manoeuvres import Index
    from ..realtime.afloat import Voyage
    from ..workflow.seaway import Motion
    from ..workflow.simulation import Simulated

DEGREE = math.pi / 180.0
TWIN_PORT = 8022
"""Where `twin` listens if the user names no port."""


def simulate(
    ship: o.ShipOrRun, name: o.ManoeuvreOrNone = None, device: o.Device = "cpu", out: o.TrialOut = None,
    of: o.FromCampaign = None, *, orders: Orders, begin: Approach, span: Span, around: Around, waves: InWaves,
    bands: Bands, json: bool = False,
) -> None:  # fmt: skip
    """Simulate a manoeuvre and print its indices."""
    from ..workflow.request import banded

    with_bands = banded(bands)
    if with_bands and of is not None:
        raise RequestError("--bands: a run of a campaign has none; leave --from out")
    if of is not None:
        _replay(of, ship, name, out, json)
        return
    if name is None:
        raise RequestError("name a manoeuvre after the ship; seatrial simulate --help lists them")
    if with_bands:
        from ..workflow.evidence.bands import simulate_with_bands

        if waves != InWaves():
            raise RequestError("--sea and --rao: bands are of the motion without waves; leave them or --bands out")
        if device != "cpu":
            raise RequestError(f"--device {device}: bands are computed on the processor; leave the option out")
        made = simulate_with_bands(ship, name, bands, orders=orders, begin=begin, span=span, around=around, out=out,
                                   note=note)  # fmt: skip
        answer(bands_shown(made), json)
        _incomplete(made.run)
        return
    from ..workflow.simulation import simulate as run

    ran = run(ship, name, orders=orders, begin=begin, span=span, around=around, waves=waves, device=device, out=out,
              note=note)  # fmt: skip
    answer(fields({"ship": ran.ship.name, "manoeuvre": name, "settings": ran.settings, "complete": ran.complete,
                   "reason": ran.reason, "time": ran.trial.duration},
                  indices_shown(f"{ran.ship.name}, {ran.policy.kind}", ran.indices)
                  + (_motions(ran.motions) if ran.motions else ())), json)  # fmt: skip
    _incomplete(ran)


def _motions(motions: Mapping[str, Motion]) -> Body:
    """Motions in waves: lengths in m, angles in degrees."""
    rows = [(name, figure(one.expected * scale), figure(one.found * scale), figure(one.greatest * scale), unit)
            for name, one in motions.items()
            for scale, unit in [(1.0, "m") if one.unit == "m" else (1.0 / DEGREE, "deg")]]  # fmt: skip
    head = ("motion in waves", "rms on the first heading", "rms", "greatest", "unit")
    return fields({"motions": {name: vars(one) for name, one in motions.items()}}, table(head, rows, words=(4,)))


def _incomplete(ran: Simulated) -> None:
    """Exit 1 where a run is not complete."""
    if not ran.complete:
        fault(f"error: {ran.reason}; indices that the run did not reach are left out")
        raise Exit(1)


def _replay(folder: str, run: str, manoeuvre: str | None, out: Path | None, json: bool) -> None:
    """One run of a campaign again."""
    from ..workflow.campaigns import replayed

    if manoeuvre is not None or not run.isdecimal():
        raise RequestError(f"--from {folder}: name a run alone, by its number in the table, such as 12")
    ran = replayed(folder, int(run), out)
    answer(fields({"case": ran.ship, "manoeuvre": ran.policy.kind, "inputs": ran.inputs, "complete": ran.complete,
                   "time": ran.trial.duration},
                  table(("input", "value"), [(name, figure(value, 6)) for name, value in ran.inputs.items()])
                  + indices_shown(f"{ran.ship}, {ran.policy.kind}, run {run}", ran.indices)), json)  # fmt: skip


def index_document(index: Index) -> dict[str, object]:
    """An index with its unit; angles in degrees, lengths also in ship lengths; its resolution where it has one."""
    per = DEGREE if index.unit in ("rad", "rad/s") else 1.0
    out: dict[str, object] = {"value": index.value / per, "unit": index.unit}
    if per != 1.0:
        out["unit"] = index.unit.replace("rad", "deg")
    if index.resolution:
        out["resolution"] = index.resolution / per
    return out if index.over_L is None else {**out, "over_L": index.over_L}


def indices_shown(title: str, found: Mapping[str, Index]) -> Body:
    """The indices of a manoeuvre as a table."""
    indices: dict[str, Any] = {name: index_document(index) for name, index in found.items()}
    rows = [
        (name.replace("_", " "), _resolved(i), i["unit"], figure(i.get("over_L")))
        for name, i in indices.items()
    ]
    return fields({"indices": indices}, table((title, "value", "unit", "in L_pp"), rows, words=(2,)))


def _resolved(index: Mapping[str, Any]) -> str:
    from ..manoeuvres import decimals

    finest = index.get("resolution")
    return f"{index['value']:.{decimals(finest)}f}" if finest else figure(index["value"], 5)


def harbour(
    run: o.HarbourRun, ship: o.HarbourShip = None, chart: o.Chart = None, wind: o.Wind = None,
    speed: o.HarbourSpeed = None, duration: o.Duration = None, start: o.Start = None, out: o.TrialOut = None,
    json: bool = False,
) -> None:  # fmt: skip
    """Run a ship in a harbour: banks, tugs, contact."""
    from ..workflow.harbour import SHIP
    from ..workflow.harbour import harbour as ran_in

    ran = ran_in(run, ship or SHIP, chart, wind=wind, speed=speed, duration=duration, start=start, out=out)
    answer(fields({"ship": ran.ship.name, "run": run, "chart": ran.chart.name, "time": ran.trial.duration},
                  indices_shown(f"{ran.ship.name}, {run}, {ran.chart.name}", ran.indices)), json)  # fmt: skip


def steer(
    ship: o.ShipName, scenario: o.ScenarioFile = None, departure: Departure = Departure(), around: Around = Around(),
    waves: InWaves = InWaves(), wire: Wire = Wire(), page: Page = Page(), bands: Bands = Bands(),
    run: RealTime = RealTime(), json: bool = False,
) -> None:  # fmt: skip
    """Run a ship as an NMEA 0183 device in real time."""
    from ..workflow.afloat import sail

    if wire.nmea is None and page.ardupilot is None:
        raise RequestError("--nmea: say where to listen, such as udp://127.0.0.1:10110")
    ran = sail(ship, scenario, departure, around, waves, wire, page, bands, run, note=note, printed=_printed(json))
    answer(_summary(ran), json)
    if ran.failure is not None:
        raise RunError(ran.failure)


def _printed(json: bool) -> Callable[[str], None]:
    """Takes what a program beside the ship prints, aside where standard output is for JSON."""
    return lambda text: hand_on(text, aside=json)


def _summary(ran: Voyage) -> Body:
    plant, report, on_wire = ran.plant, ran.stage.loop.report, ran.stage.on_wire
    if on_wire is None:
        return ()
    counts = on_wire.wire.counts
    unsent = f"{counts['unsent']} not sent, " if counts["unsent"] else ""
    said = (f"{report.t:g} s sailed, heading {math.degrees(plant['psi']) % 360.0:.1f} deg, "
            f"{on_wire.conning.counts['taken']} orders taken, {counts['sent']} datagrams sent, {unsent}"
            f"{report.overruns} of {report.ticks} ticks late")  # fmt: skip
    return fields({
        "ship": plant.ship.name, "address": str(on_wire.wire.address), "t": report.t, "state": ran.state,
        "commander": on_wire.conning.commander, "mode": on_wire.conning.mode,
        "orders": dict(on_wire.conning.counts), "wire": dict(counts), "overruns": report.overruns,
        "worst_late": report.worst_late, "events": dict(report.events), "written": ran.written,
    }, bullets((said, *map(str, ran.written))))  # fmt: skip


def bridge(
    ship: o.ShipName, scenario: o.ScenarioFile = None, departure: Departure = Departure(), around: Around = Around(),
    waves: InWaves = InWaves(), wire: Wire = Wire(), page: Page = Page(), bands: Bands = Bands(),
    run: RealTime = RealTime(), json: bool = False,
) -> None:  # fmt: skip
    """Serve a page to steer a ship by hand in real time."""
    from ..workflow.afloat import sail

    ran = sail(ship, scenario, departure, around, waves, wire, replace(page, page=True), bands, run, note=note,
               printed=_printed(json))  # fmt: skip
    answer(fields(ran.document(), bullets(map(str, ran.written))), json)
    if ran.failure is not None:
        raise RunError(ran.failure)


def range_(
    scenario: o.ScenarioOrShip, encounter: o.Encounter = None, departure: Departure = Departure(),
    around: Around = Around(), waves: InWaves = InWaves(), wire: Wire = Wire(), page: Page = Page(),
    bands: Bands = Bands(), run: RealTime = RealTime(), json: bool = False,
) -> None:  # fmt: skip
    """Run a scenario, or an encounter of a ship, and judge its criteria."""
    from ..workflow.afloat import sail
    from ..workflow.afloat.scenes import met

    played = scenario if encounter is None else met(str(scenario), encounter, departure)
    ran = sail(None, played, departure, around, waves, wire, page, bands, run, judge=True, note=note,
               printed=_printed(json))  # fmt: skip
    answer(_judged(ran, ran.document()), json)
    if not ran.met:
        fault(f"error: {ran.wanting}")
        raise Exit(1)


_JUDGED: Mapping[bool | None, str] = {True: "met", False: "not met", None: "not judged: the run was cut off"}


def _judged(ran: Voyage, document: Mapping[str, Any]) -> Body:
    """How others were passed, the criteria, and how it ended."""
    indices, body = document["indices"], tuple[Block, ...]()
    rows = [(name, figure(one["distance"], 5), figure(one["at"], 5), figure(one["time_in_hand"], 4), one["role"],
             ", ".join(rule for rule, margin in one["rules"].items() if margin < 0.0) or "–")
            for name, one in indices["passing"].items()]  # fmt: skip
    if rows:
        body += table(("ship", "passes at m", "after s", "time in hand s", "own part", "breaks"), rows, words=(4, 5))
    rows = [(one["name"].replace("_", " "), one["ship"] or "", figure(one["value"], 5), figure(one["limit"], 5),
             one["unit"], _JUDGED[one["met"]]) for one in document["criteria"]]  # fmt: skip
    if rows:
        body += table(("criterion", "of", "value", "limit", "unit", ""), rows, words=(1, 4, 5))
    arrived = document["arrived"]
    end = f"arrived after {arrived:.1f} s" if arrived is not None else f"ended after {document['time']:.1f} s"
    said = f"{ran.stage.scenario.title}: {end}, at most {indices['cross_track_max']:.1f} m off the route"
    return fields(document, body + bullets((said, *_unsteered(document["wire"]), *map(str, ran.written))))


def _unsteered(wire: Mapping[str, Mapping[str, int]] | None) -> tuple[str, ...]:
    """That a wire was connected and gave no order, so that nobody steered."""
    from ..realtime.conning import ORDERS

    if wire is None or wire["orders"].get("taken"):
        return ()
    return (f"nobody steered: no order was taken of {wire['counts'].get('sentences', 0)} sentences heard; orders are "
            f"{', '.join(ORDERS)}",)


def twin(
    model: o.ShipName, nmea: o.NmeaLog = None, mcap: o.McapLog = None, trial: o.TrialLog = None,
    mapping: o.Mapping = None, antenna: o.Antenna = None, out: o.TwinFolder = None, free: o.Drifting = (),
    estimator: o.Estimator = "ekf", rate: o.RowRate = 10.0, factor: o.LogFactor = math.inf, *, serving: Serving,
    json: bool = False,
) -> None:  # fmt: skip
    """Run a twin on the log of a ship; name faults."""
    from ..core.listening import HERE, address, listen
    from ..workflow.live.twin import twin as run

    port = port_of(serving, TWIN_PORT)
    listening = None if port is None else listen(HERE, port, anywhere=False)
    try:
        if listening is not None:
            note(f"page: {address(listening)}")
        show(run(model, nmea=nmea, mcap=mcap, trial=trial, mapping=mapping, antenna=antenna, out=out,
                 free=free, estimator=estimator, rate=rate, factor=factor, page=listening,
                 note=note), json)  # fmt: skip
    finally:
        if listening is not None:
            listening.close()


def demo(out: o.DemoFolder = Path("demo"), json: bool = False) -> None:
    """Run the complete worked example on built-in ships."""
    from ..workflow.demo import tell
    from ..workflow.request import make_folder

    make_folder(out)
    summary = tell(out, note)
    answer(fields(summary, bullets(summary["lines"])), json)


def bench(names: o.Peers = (), listed: o.Listed = False, out: o.BenchFolder = None, json: bool = False) -> None:
    """Compare run times with those of other programs."""
    from ..engine import SimulationError
    from ..workflow.installation.bench import bench as run

    if listed:
        answer(_peers(names), json)
        return
    result = run(names, out, note)
    answer(_times(result), json)
    if result["busy"]:
        note("note: the machine had other work: the control loop varied; measure again when it is at rest")
    if out is not None:
        note(f"wrote {out / 'bench.json'}")
    if result["failed"]:
        raise SimulationError("; ".join(f"{one['peer']} cannot be measured: {one['why']}" for one in result["failed"]))


def _peers(names: tuple[str, ...]) -> Body:
    from ..workflow.installation.bench import peers, state

    chosen = peers(names)
    rows = [(p.name, p.about, state(p)) for p in chosen]
    return fields({"peers": [{"name": p.name, "about": p.about, "installed": p.installed} for p in chosen]},
                  table(("peer", "what is compared with", "here"), rows, words=(1, 2)))  # fmt: skip


def _times(result: Mapping[str, Any]) -> Body:
    rows = [(r["peer"], r["what"], _time(r["ours_s"]), _time(r["theirs_s"]), f"{r['ratio']:.3g} x")
            for r in result["rows"]]  # fmt: skip
    loops = f"{result['control_loop_ms']:.1f} to {result['slowest_control_loop_ms']:.1f} ms"
    said = [f"{missing['peer']}: not installed ({missing['get']})" for missing in result["not_installed"]]
    said.append(f"{result['machine']}; Python control loop {loops}")
    measured = table(("peer", "time of", "ours", "theirs", "ratio"), rows, words=(1,)) if rows else ()
    return fields(result, measured + bullets(said))


def _time(seconds: float) -> str:
    """A time with three digits and a suitable unit."""
    power = min(max(math.floor(math.log10(seconds) / 3), -3), 0)
    return f"{seconds / 10.0 ** (3 * power):.3g} {('s', 'ms', 'us', 'ns')[-power]}"
