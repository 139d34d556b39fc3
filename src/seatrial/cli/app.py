"""The command line: one command per room, each a few lines over public functions.

Results go to standard output (one JSON object with ``--json``), messages to standard error.
Exit status: 0 done, 1 the run failed, 2 the request was wrong.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from .bench import bench
from .fits import check, identify, predict, validate
from .manoeuvres import simulate
from .outcome import ended
from .resample import resample
from .ships import design, estimate, export, imo, models, requirements, servo, ships, show, thrust_map
from .support import emit, make_folder, note, say
from .trust import offer_trust

app = typer.Typer(
    name="seatrial", no_args_is_help=True, add_completion=False, rich_markup_mode=None,
    pretty_exceptions_enable=False, help="From the logs of a ship's trials to a model you can trust.",
)  # fmt: skip

ShipName = Annotated[str, typer.Argument(help="A name of the library (seatrial ships) or a ship file.")]
Trials = Annotated[list[Path], typer.Argument(help="Trial files, or folders of them.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; the exit status."""
    return ended(typer.main.get_command(app), sys.argv[1:] if arguments is None else arguments)


@app.command()
def demo(
    out: Annotated[Path, typer.Option("-o", "--out", help="Folder for the report and the model.")] = Path("demo"),
    json: Json = False,
) -> None:
    """The whole story on embedded ships: a sea trial, checks, a fit, validation on unseen manoeuvres."""
    from ..workflow.demo import tell

    make_folder(out)
    summary = tell(out, note)
    if json:
        emit(summary)
    else:
        say("\n".join(summary["lines"]) + "\n")


for command in (ships, show, simulate, models, estimate, design, requirements, imo, export, thrust_map, servo,
                resample, bench, check, identify, predict, validate):  # fmt: skip
    # The first paragraph is for users; what a function raises is for its callers.
    app.command(help=(command.__doc__ or "").partition("\n\n")[0])(command)


@app.command("import")
def import_(
    format: Annotated[
        str, typer.Argument(help="frt-esso, simman, usv-asw, nmea, mcap, rosbag2, or csv with --mapping.")
    ],
    source: Annotated[Path, typer.Argument(metavar="SRC", help="A log, or a folder of them.")],
    out: Annotated[Path, typer.Option("-o", "--out", help="Folder for the trial files.")],
    mapping: Annotated[Path | None, typer.Option(help="Mapping file: csv, nmea, mcap, rosbag2.")] = None,
    json: Json = False,
) -> None:
    """Foreign logs to trial files."""
    from .convert import import_logs

    import_logs(format, source, out, mapping, json)


@app.command()
def convert(
    trials: Trials,
    to: Annotated[str, typer.Option(help="mcap or rosbag2.")],
    out: Annotated[Path, typer.Option("-o", "--out", help="Folder for the logs.")],
    json: Json = False,
) -> None:
    """Trial files to logs of robots, in standard messages."""
    from .convert import convert as run

    run(trials, to, out, json)


@app.command()
def steer(
    ship: ShipName,
    nmea: Annotated[str, typer.Option(help="Where she listens: udp://127.0.0.1:PORT or tcp://127.0.0.1:PORT.")],
    to: Annotated[list[str] | None, typer.Option(help="Send here as well, udp only. Repeatable.")] = None,
    anywhere: Annotated[bool, typer.Option("--anywhere", help="Allow addresses beyond this machine.")] = False,
    framed: Annotated[bool, typer.Option("--framed", help="Datagrams of IEC 61162-450.")] = False,
    only: Annotated[str | None, typer.Option(help="Sentences to send, such as HDT,ROT,RMC; also VDO.")] = None,
    place: Annotated[str | None, typer.Option(help="LAT,LON of the start [deg].")] = None,
    antenna: Annotated[str | None, typer.Option(help="FORWARD,STARBOARD of midship [m].")] = None,
    rate: Annotated[float, typer.Option(help="Ticks per second [Hz].")] = 10.0,
    factor: Annotated[float, typer.Option(help="Simulated over real time, 0.1 to 100; inf for the fastest.")] = 1.0,
    duration: Annotated[float | None, typer.Option(help="End after so much simulated time [s].")] = None,
    hold: Annotated[float, typer.Option(help="How long who has command may be silent [s].")] = 10.0,
    commander: Annotated[
        list[str] | None, typer.Option(help="Obey this HOST or HOST:PORT and no other. Repeatable.")
    ] = None,
    speed: Annotated[float | None, typer.Option(help="Speed at the start [m/s].")] = None,
    heading: Annotated[float, typer.Option(help="Heading at the start [deg].")] = 0.0,
    wind: Annotated[str | None, typer.Option(help="True wind: M/S,DEG it comes from.")] = None,
    current: Annotated[str | None, typer.Option(help="Current: M/S,DEG it goes towards.")] = None,
    gusts: Annotated[str | None, typer.Option(help="Spectrum of gusts about the wind: davenport, ...")] = None,
    waves: Annotated[str | None, typer.Option(help="Waves: height M, period S, DEG they come from.")] = None,
    depth: Annotated[float | None, typer.Option(help="Depth of water [m].")] = None,
    other: Annotated[list[str] | None, typer.Option(help="SHIP@NORTH,EAST,DEG another ship. Repeatable.")] = None,
    mmsi: Annotated[int | None, typer.Option(help="Of the transponder (VDO): nine digits.")] = None,
    sensors: Annotated[bool, typer.Option("--sensors", help="Through the usual instruments.")] = False,
    seed: Annotated[int, typer.Option(help="Of the instruments and the gusts.")] = 0,
    log: Annotated[Path | None, typer.Option(help="Write what she says (.nmea).")] = None,
    out: Annotated[Path | None, typer.Option("-o", "--out", help="Record to a trial file (.csv).")] = None,
    beside: Annotated[
        str | None, typer.Option(help="Run this beside her, and end with it; {address} in it is where she listens.")
    ] = None,
    simulator: Annotated[bool, typer.Option("--simulator", help="Say in them that a simulator talks.")] = False,
    json: Json = False,
) -> None:
    """A ship on the wire: she talks NMEA 0183 and obeys it, in real time."""
    from .wire import Request
    from .wire import steer as run

    run(Request(ship, nmea, tuple(to or ()), anywhere, framed, only, place, antenna, rate, factor, duration, hold,
                speed, heading, wind, current, sensors, seed, log, out, beside, simulator, tuple(commander or ()),
                gusts, waves, depth, tuple(other or ()), mmsi), json)  # fmt: skip


@app.command()
def bridge(
    ship: ShipName,
    host: Annotated[str, typer.Option(help="Address to serve at.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="Port to serve at; 0 takes a free one.")] = 8020,
    anywhere: Annotated[bool, typer.Option("--anywhere", help="Allow addresses beyond this machine.")] = False,
    factor: Annotated[float, typer.Option(help="Simulated over real time, 0.1 to 100; inf for the fastest.")] = 1.0,
    speed: Annotated[float | None, typer.Option(help="Speed at the start [m/s].")] = None,
    heading: Annotated[float, typer.Option(help="Heading at the start [deg].")] = 0.0,
    wind: Annotated[str | None, typer.Option(help="True wind: M/S,DEG it comes from.")] = None,
    gusts: Annotated[str | None, typer.Option(help="Spectrum of gusts about the wind: davenport, ...")] = None,
    current: Annotated[str | None, typer.Option(help="Current: M/S,DEG it goes towards.")] = None,
    waves: Annotated[str | None, typer.Option(help="Waves: height M, period S, DEG they come from.")] = None,
    depth: Annotated[float | None, typer.Option(help="Depth of water [m].")] = None,
    seed: Annotated[int, typer.Option(help="Of the gusts.")] = 1,
    ghost: Annotated[Path | None, typer.Option(help="Measured trial to sail beside.")] = None,
    other: Annotated[list[str] | None, typer.Option(help="SHIP@NORTH,EAST,DEG another ship. Repeatable.")] = None,
    out: Annotated[Path, typer.Option("-o", "--out", help="Folder for recordings.")] = Path(),
    hold: Annotated[float, typer.Option(help="How long who has command may be silent [s].")] = 5.0,
) -> None:
    """A page on which the ship is steered by hand, in real time."""
    from .bridge import Request
    from .bridge import bridge as run

    run(Request(ship, host, port, anywhere, factor, speed, heading, wind, gusts, current, waves, depth, seed, ghost,
                tuple(other or ()), out, hold))  # fmt: skip


offer_trust(app)
