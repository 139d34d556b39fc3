"""Commands that run a ship in real time: steer (NMEA 0183) and bridge (a page)."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

from . import options as o
from .render import emit, hand_on, note, say

if TYPE_CHECKING:
    from ..workflow.steer import Steered


def steer(
    ship: o.ShipName, nmea: o.Nmea, to: o.To = None, anywhere: o.Anywhere = False, framed: o.Framed = False,
    only: o.Sentences = None, place: o.Place = None, antenna: o.Antenna = None, rate: o.Rate = 10.0,
    factor: o.Factor = 1.0, duration: o.End = None, hold: o.Hold = 10.0, commander: o.Commander = None,
    speed: o.StartSpeed = None, heading: o.StartHeading = 0.0, wind: o.Wind = None, current: o.Current = None,
    gusts: o.Gusts = None, waves: o.Waves = None, depth: o.Depth = None, other: o.Other = None,
    mmsi: o.Mmsi = None, sensors: o.WithSensors = False, seed: o.InstrumentSeed = 0, log: o.SentenceLog = None,
    out: o.Record = None, beside: o.Beside = None, simulator: o.Simulator = False, json: o.Json = False,
) -> None:  # fmt: skip
    """Run a ship as an NMEA 0183 device in real time."""
    from ..engine import SimulationError
    from ..workflow.steer import steer as run

    ran = run(ship, nmea, to=to or (), anywhere=anywhere, framed=framed, only=only, place=place, antenna=antenna,
              rate=rate, factor=factor, duration=duration, hold=hold, commander=commander or (), speed=speed,
              heading=heading, wind=wind, current=current, gusts=gusts, waves=waves, depth=depth, other=other or (),
              mmsi=mmsi, sensors=sensors, seed=seed, log=log, out=out, beside=beside, simulator=simulator, note=note,
              printed=lambda text: hand_on(text, aside=json))  # fmt: skip
    _summarise(ran, json)
    if ran.failure is not None:
        raise SimulationError(ran.failure)


def _summarise(ran: Steered, json: bool) -> None:
    plant, report, on_wire = ran.plant, ran.loop.report, ran.on_wire
    if json:
        emit({
            "ship": plant.ship.name, "address": str(on_wire.wire.address), "t": report.t, "state": ran.state,
            "commander": on_wire.conning.commander, "mode": on_wire.conning.mode,
            "orders": dict(on_wire.conning.counts), "wire": dict(on_wire.wire.counts), "overruns": report.overruns,
            "worst_late": report.worst_late, "events": dict(report.events), "written": ran.written,
        })  # fmt: skip
        return
    taken = on_wire.conning.counts["taken"]
    say(
        f"{report.t:g} s sailed, heading {math.degrees(plant['psi']) % 360.0:.1f} deg, {taken} orders taken, "
        f"{on_wire.wire.counts['sent']} datagrams sent, {report.overruns} of {report.ticks} ticks late\n"
    )
    say("".join(f"{path}\n" for path in ran.written))


def bridge(
    ship: o.ShipName, host: o.Host = "127.0.0.1", port: o.Port = 8020, anywhere: o.Anywhere = False,
    factor: o.Factor = 1.0, speed: o.StartSpeed = None, heading: o.StartHeading = 0.0, wind: o.Wind = None,
    gusts: o.Gusts = None, current: o.Current = None, waves: o.Waves = None, depth: o.Depth = None,
    seed: o.GustSeed = 1, ghost: o.Ghost = None, other: o.Other = None, place: o.Place = None,
    out: o.RecordingFolder = Path(), hold: o.Hold = 5.0,
) -> None:  # fmt: skip
    """Serve a page to steer a ship by hand in real time."""
    from ..workflow.realtime import bridge as run

    recordings = run(ship, host=host, port=port, anywhere=anywhere, factor=factor, speed=speed, heading=heading,
                     wind=wind, gusts=gusts, current=current, waves=waves, depth=depth, seed=seed, ghost=ghost,
                     other=other or (), place=place, out=out, hold=hold, note=note)  # fmt: skip
    say("".join(f"{path}\n" for path in recordings))
