"""Types of the commands' arguments and options, each with its help, written once.

Help is an imperative sentence of at most 80 characters.  Nothing here imports the package: `--help` needs no NumPy.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from ..workflow.asked import Argument, Given, Offers, Option, charts


# What a shell completes, beside files.
def _ships(_: Given) -> list[str]:
    from ..ships.files import library, variants

    return [*library(), *variants()]


def manoeuvres(_: Given) -> list[str]:
    """The manoeuvres that `simulate` runs."""
    from ..workflow.simulation import known

    return list(known())


def _formats(_: Given) -> list[str]:
    from ..data.formats import formats

    return [one.name for one in formats().values()]


def _parameters(given: Given) -> list[str]:
    """Parameters of the ship that is named, and each of its parts as a whole."""
    from ..core.errors import SeatrialError
    from ..core.parameters import specs
    from ..ships.files import load

    try:
        paths = list(specs(load(str(given.get("ship") or given.get("model"))).model))
    except (SeatrialError, OSError):
        return []
    return [*dict.fromkeys(f"{path.partition('.')[0]}.*" for path in paths if "." in path), *paths]


def _channels(given: Given) -> list[str]:
    """Channels of the first trial that is named."""
    from ..core.errors import SeatrialError
    from ..data.trialfile import read_trial

    try:
        return list(next(read_trial(one) for one in given.get("trials") or ()).channels)
    except (SeatrialError, OSError, StopIteration):
        return []


def _noise(_: Given) -> list[str]:
    from ..models import STATES

    return [f"{one}=" for one in STATES]


def _purposes(_: Given) -> list[str]:
    from ..choosing.purposes import PURPOSES

    return [one.key for one in PURPOSES]


def _scopes(_: Given) -> list[str]:
    from ..validate.requirements.scopes import SCOPES

    return list(SCOPES)


def _folds(_: Given) -> list[str]:
    from ..study.folds import FOLDS
    from ..workflow.evidence.calibrate import HARDEST

    return [*FOLDS, HARDEST]


def _papers(_: Given) -> list[str]:
    from ..workflow.evidence.paper import PAPERS

    return list(PAPERS)


def _harbour_runs(_: Given) -> list[str]:
    from ..workflow.harbour import RUNS

    return list(RUNS)


def _either(*names: str) -> Offers:
    return lambda _: list(names)


# What a command begins with.
def _unverified(named: str) -> str | None:
    from ..workflow.contributing.published import warned

    return warned(named)


# What a command works on.
ShipName = Annotated[
    str, Argument(help="Name a ship of the library (seatrial ships) or a ship file.", offers=_ships, first=_unverified)
]  # fmt: skip
ShipOrRun = Annotated[
    str,
    Argument(
        metavar="SHIP", help="Name a ship of the library or a ship file; with --from, a run.", offers=_ships,
        first=_unverified,
    ),
]  # fmt: skip
ShipToCheck = Annotated[
    str | None, Option("--check", metavar="FILE", help="Check a ship file: sources, conformance, published indices.")
]  # fmt: skip
ManoeuvreOrNone = Annotated[
    str | None, Argument(metavar="MANOEUVRE", help="Name a manoeuvre (listed below).", offers=manoeuvres)
]  # fmt: skip
Trials = Annotated[tuple[Path, ...], Argument(help="Name trial files, or folders of them.")]
Particulars = Annotated[Path, Argument(help="Name a file of particulars (docs/tutorials/estimate.md).")]
StudyFile = Annotated[
    Path, Argument(help="Name a study file, or a table of many fits.", first=_unverified)
]  # fmt: skip
Folder = Annotated[Path, Argument(metavar="FOLDER", help="Name a folder of trial files or logs.")]
DeskFolder = Annotated[Path, Argument(metavar="FOLDER", help="Name the folder to work in; it may be empty.")]
StudyAction = Annotated[str, Argument(metavar="new", help="Write new for a new study.")]
Pull = Annotated[Path, Argument(help="Name a bollard pull table with columns such as n [1/s],T_1 [N].")]
CaptiveTables = Annotated[
    tuple[Path, ...], Argument(metavar="TABLE...", help="Name tables of captive tests (docs/captive.md).")
]  # fmt: skip
Source = Annotated[Path | None, Argument(metavar="SRC", help="Name a log, or a folder of logs.")]
LogFormat = Annotated[
    str | None,
    Argument(metavar="FORMAT", help="Name the format of the logs (listed below).", offers=_formats),
]  # fmt: skip
GuessOf = Annotated[
    Path | None, Option("--guess", metavar="FOLDER", help="Write the mapping that the logs of this folder suggest.")
]  # fmt: skip
Imports = Annotated[
    Path | None, Option("-o", "--out", help="Write the trial files to this folder (--guess: the mapping to this file).")
]  # fmt: skip
Peers = Annotated[tuple[str, ...], Argument(metavar="[NAME]...", help="Name peers to measure; all unless given.")]

# Output.
Page = Annotated[Path | None, Option("-o", "--out", help="Write the report to this file (.html).")]
Report = Annotated[Path | None, Option("-o", "--out", help="Write the report to this file (.html; .json beside it).")]
CoveragePage = Annotated[Path | None, Option("-o", "--out", help="Write a page on --against to this file (.html).")]
SurveyPage = Annotated[Path | None, Option("-o", "--out", help="Write the page to this file (.html).")]
NewStudy = Annotated[Path, Option("-o", "--out", help="Write the study to this file (.toml).")]
TrialOut = Annotated[Path | None, Option("-o", "--out", help="Write the run to this trial file (.csv).")]
TrialFolder = Annotated[Path, Option("-o", "--out", help="Write the trial files to this folder.")]
LogFolder = Annotated[Path, Option("-o", "--out", help="Write the logs to this folder.")]
DemoFolder = Annotated[Path, Option("-o", "--out", help="Write the report and the model to this folder.")]
RunFolder = Annotated[Path, Option("-o", "--out", help="Write the run to this folder; resume it if it was killed.")]
PredictionFolder = Annotated[Path, Option("-o", "--out", help="Write the predictions to this folder.")]
BenchFolder = Annotated[Path | None, Option("-o", "--out", help="Write bench.json to this folder.")]
CopyFile = Annotated[Path, Argument(help="Name the new ship file (.toml).")]
ShipOut = Annotated[Path, Option("-o", "--out", help="Write the ship to this file (.toml).")]
ShipFile = Annotated[Path | None, Option("-o", "--out", help="Write the ship to this file (.toml).")]
TestPage = Annotated[Path | None, Option("--report", help="Write a report with residuals to this file (.html).")]
TablesOut = Annotated[Path | None, Option("-o", "--out", help="Write tables of a ship file to this file (.toml).")]
Sources = Annotated[bool, Option("--sources", help="Show the source of each value.")]
Listed = Annotated[bool, Option("--list", help="List the peers and measure nothing.")]

# Manoeuvres.
HarbourRun = Annotated[
    str, Argument(metavar="RUN", help="Name a run: berthing, unberthing, lock, canal, meeting.",
                  offers=_harbour_runs)
]  # fmt: skip
HarbourShip = Annotated[
    str | None, Option("--ship", help="Name a ship or give its file; kvlcc2_harbour unless given.", offers=_ships)
]  # fmt: skip
Chart = Annotated[str | None, Option(help="Name a chart or give its file (.geojson).", offers=charts)]
HarbourSpeed = Annotated[float | None, Option("--speed", help="Set the speed in a lock or canal [m/s].")]
Start = Annotated[str | None, Option(help="Set the start X,Y,DEG: north and east [m], heading.")]
Duration = Annotated[float | None, Option(help="Set the length of the run [s].")]
Device = Annotated[str, Option(help="Run on the processor, cpu, or on a GPU: cuda, cuda:1 ...")]

# What is around the ship.
Wind = Annotated[str | None, Option(help="Set the true wind M/S,DEG: speed and direction it comes from.")]
Metacentric = Annotated[float, Option("--gm", help="Set the metacentric height [m].")]
Heeling = Annotated[float | None, Option("--gm", help="Add heel and roll, with this metacentric height [m].")]
FeelsDepth = Annotated[bool, Option("--shallow", help="Add what shallow water does to hull and added mass.")]
GravityAboveKeel = Annotated[float, Option("--kg", help="Set the centre of gravity above the keel [m].")]
Midship = Annotated[float, Option(help="Set the coefficient of the midship section.")]
Keels = Annotated[str | None, Option(help="Set bilge keels M,M: breadth and length.")]
Coefficients = Annotated[Path, Argument(metavar="DATA", help="Read added mass and damping: .nc of Capytaine, or .csv.")]
OwnRollDamping = Annotated[
    float | None, Option("--roll-damping", help="Set damping of roll besides waves, as a share of critical.")
]  # fmt: skip
AddedMass = Annotated[
    str, Option(help="Use the added masses in surge, sway and yaw of the ship, or of the data.",
                offers=_either("ship", "data"))
]  # fmt: skip

# Trials and predictions.
NewStep = Annotated[float, Option(help="Set the new time step [s].")]
Mapping = Annotated[Path | None, Option(help="Read a mapping file: csv, nmea, mcap, rosbag2.")]
RobotFormat = Annotated[str, Option(help="Choose the format, mcap or rosbag2.", offers=_either("mcap", "rosbag2"))]
Against = Annotated[
    tuple[Path, ...], Option(help="Compare with training files or a study: overlap, coverage. Repeatable.")
]  # fmt: skip
Remedies = Annotated[
    Path | None, Option("--remedy", help="Write the steps of the remedies to this .toml file.")
]  # fmt: skip
Separated = Annotated[Path | None, Option("--remedy", help="Write steps that cut files of several runs to this .toml.")]
Steps = Annotated[Path, Option("--by", help="Read this file of steps, as check --remedy writes.")]
FreeSuspects = Annotated[bool, Option("--free-suspects", help="Estimate instrument errors that residuals call for.")]
Sample = Annotated[int | None, Option("--sample", metavar="N", help="Add N samples of the posterior of the fit.")]
Details = Annotated[bool, Option("--details", help="Show parameters, residuals and standardised errors too.")]
FitFor = Annotated[
    str | None, Option("--for", metavar="PURPOSE", help="Judge for a use; exit 0 fit, 3 not fit, 4 cannot tell.",
                      offers=_purposes)
]  # fmt: skip
Limit = Annotated[str | None, Option(metavar="NAME=VALUE", help="Set limits of --for, such as position=2,stopping=5.")]
Scale = Annotated[str | None, Option(help="Divide errors as in the fit of this model.toml.")]
Quick = Annotated[bool, Option("--quick", help="Run the rehearsal of a table of fits.")]
OnlyFits = Annotated[tuple[str, ...], Option("--only", help="Run only this fit of a table of fits. Repeatable.")]
FittedModel = Annotated[str, Argument(metavar="MODEL", help="Name the model.toml of a fit.")]
Unseen = Annotated[
    tuple[Path, ...], Option("--trials", help="Judge on these trials (default: kept back). Repeatable.")
]  # fmt: skip
Windows = Annotated[float | None, Option("--restart", help="Judge windows of N seconds (default: of the study).")]

RunOrShip = Annotated[
    str, Argument(metavar="RUN", help="Name the folder of a run, a ship file or a ship.", offers=_ships)
]  # fmt: skip
CasePath = Annotated[Path, Argument(metavar="CASE", help="Name the file of a case; with --verify, its folder.")]
CaseSearch = Annotated[int | None, Option(metavar="RUNS", help="Run so many to find failures; keep each simplest.")]
CaseVerify = Annotated[bool, Option("--verify", help="Check that a folder is as it was when it was signed.")]
CaseFolder = Annotated[Path | None, Option("-o", "--out", help="Write parts, page and numbers to this folder.")]
YardstickSets = Annotated[
    tuple[Path, ...], Argument(metavar="[SET]...", help="Name files of sets; studies/yardstick unless given.")
]  # fmt: skip
Methods = Annotated[
    tuple[str, ...], Option("--method", help="Measure this study, ship, new:SHIP or program. Repeatable.")
]  # fmt: skip
YardstickFile = Annotated[Path | None, Option("-o", "--out", help="Write the result to this file (.json).")]
PaperKey = Annotated[
    str, Argument(metavar="PAPER", help="Name sawada2024, suyama2023, wakita2022 or you2023.", offers=_papers)
]  # fmt: skip
PaperPage = Annotated[Path, Option("-o", "--out", help="Write the page to this file (.html; .json beside it).")]
PaperTable = Annotated[int | None, Option("--table", help="Show the parts of the page that have this table.")]
LeftOutParts = Annotated[int | None, Option("--parts", help="Set the number of parts, each left out of a fit once.")]
Folds = Annotated[
    str | None, Option("--folds", help="Split by recording, day, kind, kind-day, speed or wind, or take the hardest.",
                       offers=_folds)
]  # fmt: skip
BandHorizon = Annotated[
    float | None, Option("--horizon", help="Set the longest time ahead that bands reach [s].")
]  # fmt: skip

CalibratedHistory = Annotated[
    float | None, Option("--history", metavar="S", help="Use the S seconds before, in a calibration of its own.")
]  # fmt: skip
CalibratedFirst = Annotated[
    float | None, Option("--fit-first", metavar="S", help="Fit S seconds first, in a calibration of its own.")
]  # fmt: skip

# Design and judgement.
Purpose = Annotated[
    str | None, Option("--for", help="Recommend families for a purpose such as berthing.", offers=_purposes)
]  # fmt: skip
FreeParameters = Annotated[
    tuple[str, ...], Option("--free", help="Name parameters to be identified, such as 'hull.*'.", offers=_parameters)
]  # fmt: skip
Budget = Annotated[float, Option(help="Limit the length of all trials together, T' = T V/L.")]
Noise = Annotated[
    str | None, Option(help="Set sensor noise such as x=0.5,psi=0.1 (m, m/s, deg, deg/s).", offers=_noise)
]  # fmt: skip
Interval = Annotated[float | None, Option(help="Set the time between independent readings [s].")]
Repeats = Annotated[int, Option(help="Limit how often one manoeuvre is run.")]
Scope = Annotated[str, Option(help="Choose collision-avoidance, berthing or functional.", offers=_scopes)]

# Captive tests and scale.
CaptiveMapping = Annotated[Path | None, Option("--mapping", help="Read a mapping file of the columns.")]
OpenWater = Annotated[Path | None, Option(help="Fit K_T to an open-water table first, columns J and K_T.")]
FreeCoefficients = Annotated[
    tuple[str, ...], Option("--free", help="Fit these parameters, such as 'hull.*'. Repeatable.", offers=_parameters)
]  # fmt: skip
ToLength = Annotated[float, Option(help="Set the new length between perpendiculars [m].")]
FormFactor = Annotated[float | None, Option(help="Set the form factor k; Watanabe's formula unless given.")]
Roughness = Annotated[float | None, Option(help="Set the roughness of the hull of a ship [um] (default: 150).")]
Density = Annotated[float | None, Option(help="Set the density of the water there [kg/m^3].")]
RudderWake = Annotated[
    str, Option(help="Choose the wake at the rudder: proportion or own.", offers=_either("proportion", "own"))
]  # fmt: skip
FroudeAlone = Annotated[bool, Option("--froude", help="Use Froude's law alone, without friction and wake.")]

# Export and thrusters.
Casadi = Annotated[Path | None, Option(help="Write a CasADi function; its step and names go beside it.")]
CFolder = Annotated[Path | None, Option("--c", help="Write a C99 source file and its header to this folder.")]
PythonFile = Annotated[Path | None, Option(help="Write a Python file that needs the standard library only.")]
ActuatorStep = Annotated[
    float | None, Option(metavar="S", help="Add a step of S seconds from orders, through the actuators.")
]
Fmu = Annotated[Path | None, Option(help="Write a co-simulation slave (.fmu) driven by orders.")]
Fmi = Annotated[int | None, Option(help="Choose version 2 or 3 of FMI for --fmu (default: 2).")]
HullAlone = Annotated[bool, Option("--hull", help="Write --fmu for the hull alone, driven by forces.")]
Platforms = Annotated[str | None, Option(help="Choose whose binaries --fmu holds (default: this machine's).")]
SlaveStep = Annotated[float | None, Option(help="Set the internal step of --fmu [s].")]
Thrusters = Annotated[str | None, Option(help="Name the ship's thrusters, such as 1,2.")]
Together = Annotated[bool, Option("--together", help="Split one column of thrust among all thrusters.")]
Order = Annotated[int | None, Option(help="Limit the power of n; cross-validate unless given.")]
Control = Annotated[
    tuple[str, ...], Option(help="Fit this control, such as alpha_1; all with orders unless given.", offers=_channels)
]  # fmt: skip

# Real time.
Antenna = Annotated[str | None, Option(help="Place the antenna FORWARD,STARBOARD of midship [m].")]

# Scenarios.
ScenarioOrShip = Annotated[
    Path, Argument(metavar="SCENARIO", help="Name a scenario file; with --encounter, a ship.")
]  # fmt: skip
Encounter = Annotated[
    str | None,
    Option("--encounter", metavar="SET:NUMBER[,CONDUCT]", help="Run this encounter: imazu:7, drawn:give-way,late."),
]  # fmt: skip
ScenarioFile = Annotated[Path | None, Option("--scenario", help="Run a scenario file around the ship.")]

# The live twin.
NmeaLog = Annotated[
    str | None, Option("--nmea", help="Read this log of sentences, or udp://HOST:PORT where they come in.")
]  # fmt: skip
McapLog = Annotated[Path | None, Option("--mcap", help="Read this log of a robot (.mcap).")]
TrialLog = Annotated[Path | None, Option("--trial", help="Read this trial file, or a folder of them.")]
TwinFolder = Annotated[
    Path | None, Option("-o", "--out", help="Write state, ship and card to this folder; go on from it.")
]  # fmt: skip
Drifting = Annotated[
    tuple[str, ...], Option("--free", help="Allow this parameter to drift: hull.R_0, or hull.*=0.3. Repeatable.",
                            offers=_parameters)
]  # fmt: skip
Estimator = Annotated[
    str, Option(help="Choose ekf, or mhe for moving horizon estimation.", offers=_either("ekf", "mhe"))
]  # fmt: skip
RowRate = Annotated[float, Option("--rate", help="Set the rows a second of sentences by UDP [Hz].")]
LogFactor = Annotated[float, Option("--factor", help="Set the time of a log over real time; inf for the fastest.")]

# Campaigns.
CampaignSource = Annotated[str, Argument(metavar="CAMPAIGN", help="Name a campaign file, or the folder of one.")]
CampaignFolder = Annotated[
    str | None, Option("-o", "--out", help="Write to this folder or s3://..., or --merge or --report to a file.")
]  # fmt: skip
FromCampaign = Annotated[
    str | None, Option("--from", metavar="DIR", help="Replay a run of the campaign in this folder.")
]  # fmt: skip
Threads = Annotated[int | None, Option(help="Use so many threads; one a processor unless given.")]
CampaignDevice = Annotated[str | None, Option("--device", help="Run on cpu or cuda, whatever the file says.")]
CampaignStatus = Annotated[bool, Option("--status", help="Show how far the campaign of a folder is.")]
Verify = Annotated[bool, Option("--verify", help="Read every part and compare it with the manifest.")]
Merge = Annotated[bool, Option("--merge", help="Write the whole table to one Parquet file.")]
CampaignReport = Annotated[bool, Option("--report", help="Write a page of what the runs of a folder show.")]
Rare = Annotated[
    str | None, Option(metavar="CRITERION", help="Estimate how rarely a criterion of the file is violated.")
]  # fmt: skip
RareRuns = Annotated[int | None, Option("--runs", metavar="N", help="Use so many runs a level of --rare.")]
