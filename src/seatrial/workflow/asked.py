"""What a user asks for, as values: groups of settings that several commands share, each declared once.

The fields of a group are the options of a command that takes it (`cli.command` makes them), and the group itself is
what the work is given.  A value has the unit that its help names; none is converted here.  Nothing of the package is
imported here, as `--help` needs no more.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any

from ..core.values import dataclass, field

Given = Mapping[str, Any]
Offers = Callable[[Given], list[str]]
"""What a shell completes: names, from what else the command has been given so far."""


def _spectra(_: Given) -> list[str]:
    from ..environment.weather import SPECTRA

    return list(SPECTRA)


def charts(_: Given) -> list[str]:
    """The charts of the library."""
    from ..environment.geojson import library

    return list(library())


def _sides(_: Given) -> list[str]:
    return ["port", "starboard"]


@dataclass(frozen=True)
class Argument:
    """How a command line names a value that stands by its place.

    Attributes:
        help: an imperative sentence of at most 80 characters.
        metavar: its name in the usage; that of the parameter in capitals unless given.
        offers: values that a shell completes; files where none of them begins with what is typed.
        first: the line that the command begins with for a value, if any; a request that is wrong does not show it.
    """

    help: str
    metavar: str | None = None
    offers: Offers | None = None
    first: Callable[[str], str | None] | None = None


@dataclass(frozen=True, init=False)
class Option:
    """How a command line names a value that is given by a flag.

    Attributes:
        flags: such as ``-o, --out``; the name of the field with two dashes unless given.
        help: an imperative sentence of at most 80 characters.
        metavar: what stands for the value; its type unless given.
        offers: values that a shell completes; files where none of them begins with what is typed.
    """

    flags: tuple[str, ...]
    help: str
    metavar: str | None
    offers: Offers | None

    def __init__(self, *flags: str, help: str, metavar: str | None = None, offers: Offers | None = None) -> None:
        vars(self).update(flags=flags, help=help, metavar=metavar, offers=offers)


@dataclass(frozen=True)
class Project:
    """The file `seatrial.toml` of a working folder: what its commands take where they are not told.

    Attributes:
        data: stands for $SEATRIAL_DATA where the shell has none.
        quiet: as `--quiet`.
        options: of commands, by command and option without its dashes.
    """

    data: Path | None = None
    quiet: bool = False
    options: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)


@dataclass(frozen=True)
class Always:
    """Every command."""

    json: Annotated[bool, Option(help="Print one JSON object and nothing else.")] = False
    trust: Annotated[
        tuple[str, ...], Option(metavar="MODULE", help="Import classes of files from MODULE. Repeatable.")
    ] = ()
    quiet: Annotated[bool, Option(help="Print results and errors only: no notes, no progress.")] = False


@dataclass(frozen=True)
class Around:
    """Around the ship."""

    wind: Annotated[str | None, Option(help="Set the true wind M/S,DEG: speed and direction it comes from.")] = None
    gusts: Annotated[str | None, Option(help="Add gusts of a spectrum such as davenport.", offers=_spectra)] = None
    current: Annotated[
        str | None, Option(help="Set the current M/S,DEG: speed and direction it flows towards.")
    ] = None
    waves: Annotated[
        str | None, Option(help="Set waves M,S,DEG: height, mean period, direction they come from.")
    ] = None
    depth: Annotated[float | None, Option(help="Set the water depth [m]; deep water unless given.")] = None


@dataclass(frozen=True)
class InWaves:
    """Motion in waves."""

    sea: Annotated[
        str | None, Option(help="Set an irregular sea: a file, or M,S,DEG (JONSWAP, peak period).")
    ] = None
    rao: Annotated[Path | None, Option(help="Read operators of the motion in waves: .nc or .csv.")] = None
    roll_damping: Annotated[
        float | None, Option(help="Add damping of roll to an .nc file, as a share of critical.")
    ] = None


@dataclass(frozen=True)
class Approach:
    """Approach."""

    speed: Annotated[float | None, Option(help="Set the approach speed [m/s].")] = None
    rps: Annotated[float | None, Option(help="Set the propeller revolutions [1/s].")] = None
    throttle: Annotated[float | None, Option(help="Set the throttle of a craft driven by throttle [%].")] = None


@dataclass(frozen=True)
class Orders:
    """Orders."""

    rudder: Annotated[float | None, Option(help="Set the rudder angle, magnitude [deg].")] = None
    steer: Annotated[float | None, Option(help="Set the steering demand of a craft without rudder [%].")] = None
    heading: Annotated[float | None, Option(help="Set the heading change, such as of a zigzag [deg].")] = None
    side: Annotated[str | None, Option(help="Turn first to port or starboard.", offers=_sides)] = None
    seed: Annotated[int | None, Option(help="Seed a random manoeuvre and the gusts.")] = None


@dataclass(frozen=True)
class Draws:
    """Bands of a fitted ship."""

    level: Annotated[
        float | None, Option("--bands", metavar="PERCENT", help="Set the level of bands, such as 95 [%].")
    ] = None
    count: Annotated[
        int | None, Option("--draws", metavar="N", help="Set the draws for --bands (100 to 1000 unless given).")
    ] = None


@dataclass(frozen=True)
class Bands(Draws):
    """Bands of a fitted ship."""

    extrapolate: Annotated[bool, Option(help="Allow --bands beyond the ranges of the trials of the fit.")] = False


@dataclass(frozen=True)
class Departure:
    """How the own ship begins."""

    speed: Annotated[float | None, Option(help="Set the initial speed [m/s].")] = None
    heading: Annotated[float | None, Option(help="Set the initial heading [deg].")] = None
    start: Annotated[str | None, Option(help="Set the start X,Y,DEG: north and east [m], heading.")] = None
    place: Annotated[str | None, Option(help="Start at LAT,LON [deg].")] = None
    mmsi: Annotated[int | None, Option(help="Set the MMSI of the transponder (VDO): nine digits.")] = None
    sensors: Annotated[bool, Option(help="Simulate the errors of the usual instruments.")] = False
    antenna: Annotated[str | None, Option(help="Place the antenna FORWARD,STARBOARD of midship [m].")] = None
    other: Annotated[tuple[str, ...], Option(help="Add another ship SHIP@NORTH,EAST,DEG. Repeatable.")] = ()
    seed: Annotated[int | None, Option(help="Seed the instruments, the gusts and the sea.")] = None


@dataclass(frozen=True)
class Cluster:
    """On a cluster."""

    dask: Annotated[
        str | None, Option(metavar="ADDRESS", help="Use a Dask cluster: tcp://HOST:PORT, or local:N.")
    ] = None


@dataclass(frozen=True)
class Shares(Cluster):
    """On several machines."""

    shard: Annotated[str | None, Option(metavar="K/N", help="Run share K of N only, such as 2/8.")] = None


@dataclass(frozen=True)
class Wire:
    """Wire of NMEA 0183."""

    nmea: Annotated[
        str | None, Option(help="Listen at udp://127.0.0.1:PORT, tcp:// or serial:///dev/ttyUSB0.")
    ] = None
    to: Annotated[tuple[str, ...], Option(help="Send to this udp address as well. Repeatable.")] = ()
    framed: Annotated[bool, Option(help="Send datagrams of IEC 61162-450.")] = False
    only: Annotated[str | None, Option(help="Send only these sentences, such as HDT,ROT,RMC; also VDO.")] = None
    commander: Annotated[
        tuple[str, ...], Option(help="Obey only this HOST or HOST:PORT. Repeatable.")
    ] = ()
    simulator: Annotated[bool, Option(help="Mark the sentences as those of a simulator.")] = False
    log: Annotated[Path | None, Option(help="Write the sentences that are sent to this file (.nmea).")] = None
    lock_step: Annotated[bool, Option(help="Run in step with the answers of the autopilot.")] = False
    answer_to: Annotated[
        str, Option(metavar="KIND", help="Name the sentence that --lock-step has answered.")
    ] = "ZDA"
    patience: Annotated[float, Option(metavar="S", help="End after so long without an answer [s].")] = 20.0
    beside: Annotated[
        str | None, Option(help="Run a program until the end; {address} in it is the ship's.")
    ] = None


@dataclass(frozen=True)
class Span:
    """Time."""

    duration: Annotated[float | None, Option(help="Set the length of the run [s].")] = None
    dt: Annotated[float | None, Option(help="Set the time step [s].")] = None


@dataclass(frozen=True)
class Predicting:
    """How trials are predicted."""

    restart: Annotated[float | None, Option(help="Reset to the measured state every N seconds.")] = None
    smooth_start: Annotated[
        float | None, Option(help="Estimate initial states from the last N seconds of data.")
    ] = None
    current: Annotated[
        str | None, Option(help="Set the current M/S,DEG: speed and direction it flows towards.")
    ] = None
    fit_first: Annotated[
        float | None, Option(metavar="S", help="Estimate start, current and biases on S seconds; predict the rest.")
    ] = None
    history: Annotated[
        float | None, Option(metavar="S", help="Add what acted beyond the model in the S seconds before each start.")
    ] = None
    instruments: Annotated[
        str | None, Option(metavar="MODEL", help="Use the instrument errors of the fit of this model.toml.")
    ] = None


@dataclass(frozen=True)
class Page:
    """Page and links."""

    page: Annotated[bool, Option(help="Show the bridge page (bridge always does).")] = False
    host: Annotated[str, Option(help="Serve at this address.")] = "127.0.0.1"
    port: Annotated[int, Option(help="Serve at this port; 0 takes a free one.")] = 8020
    ghost: Annotated[Path | None, Option(help="Replay a measured trial beside the ship.")] = None
    signalk: Annotated[bool, Option(help="Serve Signal K at the port of the page.")] = False
    rosbridge: Annotated[bool, Option(help="Serve topics of ROS 2 at the port of the page.")] = False
    can: Annotated[
        str | None, Option(metavar="BUS", help="Send NMEA 2000 on this bus, such as virtual:N or socketcan:can0.")
    ] = None
    ardupilot: Annotated[
        str | None, Option(metavar="ADDRESS", help="Serve the JSON physics of ArduPilot at udp://127.0.0.1:9002.")
    ] = None
    servo: Annotated[
        tuple[str, ...], Option(help="Set the order of a servo of ArduPilot, such as 3=n_P. Repeatable.")
    ] = ()


@dataclass(frozen=True)
class RealTime:
    """Run in real time."""

    factor: Annotated[
        float | None, Option(help="Set simulated over real time: 0.1 to 100, or inf for the fastest.")
    ] = None
    rate: Annotated[float | None, Option(help="Set the tick rate [Hz] (default: 10, with a page 20).")] = None
    duration: Annotated[float | None, Option(help="End after this simulated time [s].")] = None
    hold: Annotated[
        float | None, Option(help="Release command after this silence [s] (default: page 5, wire 10).")
    ] = None
    chart: Annotated[
        str | None, Option(help="Set the chart to sail on: a name, or a file (.geojson).", offers=charts)
    ] = None
    anywhere: Annotated[bool, Option(help="Allow addresses beyond this machine.")] = False
    out: Annotated[
        Path | None, Option("-o", "--out", help="Record to this .csv file; of the page to this folder.")
    ] = None


@dataclass(frozen=True)
class Foreign:
    """Logs of other tools."""

    format: Annotated[str | None, Option(help="Name the format of the logs, as of import.")] = None
    mapping: Annotated[Path | None, Option(help="Read a mapping file: csv, nmea, mcap, rosbag2.")] = None


@dataclass(frozen=True)
class Port:
    """A page on this machine."""

    port: Annotated[int | None, Option(help="Serve the page at this port, 0 for a free one.")] = None


@dataclass(frozen=True)
class Serving(Port):
    """A page on this machine."""

    page: Annotated[bool, Option(help="Show the work on a local page while it runs.")] = False
