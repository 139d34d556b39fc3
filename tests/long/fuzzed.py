"""Further kinds of file for `test_fuzz`: what a run leaves behind and is read again, mappings, seas, campaigns.

Each kind is a valid file in a folder, and the command that reads it.
"""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from fuzzed_cases import CASES
from fuzzed_logs import LOGS

from calibrated_run import calibrated
from fitted_run import PATHS, covariance, saved, trial
from network_trials import untrained
from seatrial.belief.drawn import SCHEMA as DRAWS_SCHEMA
from seatrial.belief.drawn import Draws
from seatrial.belief.spread import Members, save_members
from seatrial.cli.app import main
from seatrial.core.parameters import read
from seatrial.core.records import to_archive
from seatrial.data.trialfile import read_trial, write_trial
from seatrial.exchange.robot_log import save_robot_log
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load
from seatrial.ships.writing import save
from seatrial.simulate.approach import approach
from seatrial.simulate.run import simulate

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests" / "environment" / "sea"))

Kind = tuple[Callable[[Path], Path], Callable[[Path, Path], list[str]]]
SHIP = "kvlcc2_l7"


def said(folder: Path, name: str, text: str) -> Path:
    (folder / name).write_text(text, encoding="utf-8")
    return folder / name


def small_trial(folder: Path, suffix: str = ".csv") -> Path:
    """A zigzag of a minute as log.csv or log.parquet."""
    ship = load(SHIP)
    run = simulate(ship, Zigzag(approach(ship)[1], 0.17, 0.17), duration=60.0, every=25, name="log")
    write_trial(run, folder / f"log{suffix}")
    return folder / f"log{suffix}"


def _scenario(folder: Path) -> Path:
    return said(folder, "scenario.toml", """schema = "seatrial-scenario/1"
title = "A crossing in a canal"
duration = 20.0
rate = 5.0
place = [35.0, 139.7]
[own]
ship = "kvlcc2"
route = [{ lat = 35.09, lon = 139.7 }]
instruments = "usual"
[traffic.ferry]
length = 150.0
speed = 8.0
at = [5600.0, 5600.0]
heading = 270.0
[[weather]]
at = 3.0
wind = "8,300"
current = "0.4,90"
[[faults]]
at = 5.0
kind = "jammed"
of = "delta"
[criteria]
passing_distance = 500.0
cross_track = 2500.0
""")


_CAMPAIGN = """schema = "seatrial-campaign/1"
ships = ["kvlcc2_l7"]
runs = 8
chunk = 4
tracks = { every = 20, columns = ["psi"] }
[manoeuvre]
kind = "zigzag"
rudder = 20.0
heading = 10.0
duration = 20.0
dt = 0.25
method = "euler"
[inputs]
"ship.hull.N_r" = { normal = [1.0, 0.1], factor = true }
"policy.delta" = { uniform = [18, 22], unit = "deg" }
[criteria.first_overshoot]
at_most = 30
unit = "deg"
"""


def _campaign(folder: Path) -> Path:
    return said(folder, "campaign.toml", _CAMPAIGN)


def _left(name: str) -> Callable[[Path], Path]:
    """A file that a campaign has left."""

    def made(folder: Path) -> Path:
        assert main(["campaign", str(_campaign(folder)), "-o", str(folder / "runs"), "--json"]) == 0
        return sorted((folder / "runs").rglob(name))[0]

    return made


def _of_campaign(*options: str) -> Callable[[Path, Path], list[str]]:
    def command(file: Path, out: Path) -> list[str]:
        folder = next(one for one in file.parents if one.name == "runs")
        more = ["-o", str(out.with_suffix(".html"))] if "--report" in options else []
        return ["campaign", str(folder), *options, *more]

    return command


def _rare(folder: Path) -> Path:
    """What a search of a rare event has left beside its levels."""
    file = _campaign(folder)
    sought = ["--rare", "first_overshoot", "--runs", "100"]
    assert main(["campaign", str(file), "-o", str(folder / "runs"), *sought, "--json"]) == 0
    return sorted((folder / "runs").rglob("*.json"))[0]


def _captive(folder: Path) -> Path:
    rows = [f"2.0,{b},{r},{0.3 * b / 57.3 + 0.05 * r},{0.1 * b / 57.3 - 0.04 * r}"
            for b in (-10, -5, 0, 5, 10) for r in (-0.4, 0.0, 0.4)]  # fmt: skip
    said(folder, "tank.csv", "V,drift,r',Y',N'\n" + "\n".join(rows) + "\n")
    return said(folder, "map.toml", """schema = "seatrial-captive/1"
L_pp = 7.0
d = 0.455
over = "L d"
[columns]
U = { column = "V", unit = "m/s" }
beta = { column = "drift", unit = "deg", sign = 1 }
r = { column = "r'", unit = "'" }
Y = { column = "Y'", unit = "'" }
N = { column = "N'", unit = "'" }
""")


def _tank(folder: Path) -> Path:
    return _captive(folder).with_name("tank.csv")


def _fitted(file: Path, _: Path) -> list[str]:
    table, mapping = file.with_name("tank.csv"), file.with_name("map.toml")
    return ["captive", SHIP, str(table), "--mapping", str(mapping), "--free", "hull.Y_v", "--free", "hull.N_v"]


def _open_water(folder: Path) -> Path:
    _captive(folder)
    rows = [f"{J},{0.3 - 0.25 * J - 0.1 * J * J}" for J in np.linspace(0.0, 0.8, 9)]
    return said(folder, "water.csv", "J,K_T\n" + "\n".join(rows) + "\n")


def _sea(folder: Path) -> Path:
    _rao(folder)
    return said(folder, "sea.toml", 'schema = "seatrial-sea/1"\nspectrum = "jonswap"\nH_S = 0.1\nT_P = 1.5\n'
                'gamma = 3.3\ndirection = 90\nspread = 8\nseed = 3\n')  # fmt: skip


def _rao(folder: Path) -> Path:
    rows = [f"{w},{c},{1 / (1 + w):.4f},{10 * w:.2f},{0.01 * w:.4f},-90"
            for c in range(0, 360, 45) for w in (0.5, 2.0, 4.0, 6.0, 9.0, 14.0)]  # fmt: skip
    head = "omega [rad/s],chi [deg],heave [m/m],heave_phase [deg],pitch [rad/m],pitch_phase [deg]"
    return said(folder, "rao.csv", head + "\n" + "\n".join(rows) + "\n")


def _netcdf(folder: Path) -> Path:
    return Path(shutil.copy(ROOT / "tests" / "environment" / "sea" / "hemisphere.nc", folder / "rao.nc"))


def _classic(folder: Path) -> Path:
    """The same data as netCDF 3."""
    import xarray as xr

    with xr.open_dataset(_netcdf(folder), engine="h5netcdf") as data:
        kept = data[["added_mass", "radiation_damping", "inertia_matrix", "hydrostatic_stiffness", "excitation_force",
                     "center_of_mass"]]  # fmt: skip
        for name in [name for name in kept.coords if kept[name].dtype.kind in "OU"]:
            kept[name] = kept[name].astype(str)
        kept.to_netcdf(folder / "old.nc", engine="scipy")
    return folder / "old.nc"


def _coefficients(folder: Path) -> Path:
    names = ["omega [rad/s]", "z_G [m]", "M_35 [kg m]", "M_53 [kg m]",
             *(f"M_{k}{k} [{u}]" for k, u in ((3, "kg"), (4, "kg m^2"), (5, "kg m^2"))),
             *(f"C_{k}{k} [{u}]" for k, u in ((3, "N/m"), (4, "N m"), (5, "N m"))),
             *(f"A_{k}{k} [{u}]" for k, u in ((3, "kg"), (4, "kg m^2"), (5, "kg m^2"))),
             *(f"B_{k}{k} [{u}]" for k, u in ((3, "kg/s"), (4, "kg m^2/s"), (5, "kg m^2/s")))]  # fmt: skip
    rows = [f"{w},0.1,-817.5,-817.5,3270,600,9000,80000,5000,200000,{2000 / w},300,{6000 / w},{900 * w},40,{3000 * w}"
            for w in np.linspace(0.4, 12.0, 30)]  # fmt: skip
    return said(folder, "hull.csv", ",".join(names) + "\n" + "\n".join(rows) + "\n")


def _at_sea(*options: str) -> Callable[[Path, Path], list[str]]:
    """A run in waves, by the file for the option whose value is empty."""

    def command(file: Path, _: Path) -> list[str]:
        given = [str(file) if one == "FILE" else one.format(file.parent) for one in options]
        return ["simulate", SHIP, "straight", "--duration", "2", "--json", *given]

    return command


def _nmea_mapping(folder: Path) -> Path:
    status = main(["steer", "kvlcc2", "--nmea", "udp://127.0.0.1:0", "--factor", "inf", "--duration", "20",
                   "--place", "35,139", "--log", str(folder / "log.nmea")])  # fmt: skip
    assert status == 0
    return said(folder, "map.toml", """schema = "seatrial-nmea/1"
antenna = { forward = 2.5, starboard = -0.4 }
log = { forward = 1.0 }
datum = { latitude = 35.0, longitude = 139.0 }
L_pp = 320.0
ship = "kvlcc2"
""")


def _robot_mapping(folder: Path) -> Path:
    save_robot_log(read_trial(small_trial(folder)), "mcap", folder)
    return said(folder, "map.toml", """schema = "seatrial-robot/1"
odometry = "/odom"
[numbers]
"/n_P" = { channel = "n_P", unit = "1/s", sign = -1 }
""")


_STUDY = """schema = "seatrial-study/1"
ship = "kvlcc2_l7"
title = "A fit"
[data]
root = "."
sets = "sets.toml"
train = ["@B"]
[free]
"hull.Y_v" = { ratio = 0.5 }
[estimator]
type = "shooting:Trajectory"
window = 30.0
"""


def _sets(folder: Path) -> Path:
    small_trial(folder)
    said(folder, "study.toml", _STUDY)
    return said(folder, "sets.toml", 'schema = "seatrial-sets/1"\n[sets.A]\nT = ["log"]\n[sets.B]\nZ = ["log"]\n')


def _of_a_fit(name: str) -> Callable[[Path], Path]:
    """A file of a fit with draws, bands and members."""

    def made(folder: Path) -> Path:
        model = saved(folder / "fit", [trial(20.0), trial(10.0, 10.0)], test=[trial(15.0, side=-1)])
        rng, ship = np.random.default_rng(0), load(SHIP)
        middle = np.array([float(read(ship.model, path)) for path in PATHS])
        draws = rng.multivariate_normal(middle, covariance(0.01), 60)
        if name == "posterior.npz":
            held = Draws("digest-of-this-fit", PATHS, draws[:, None], np.zeros((60, 1)), middle, covariance(0.01), {})
            model.with_name(name).write_bytes(to_archive(held, DRAWS_SCHEMA))
        if name == "model.bands.json":
            calibrated(model)
        if name == "spread.npz":
            scale = dict.fromkeys(("x", "y", "psi", "u", "v_m", "r"), 1.0)
            save_members(Members(PATHS, middle, draws, None, scale, 30.0, {"log": 0.1}, None), model.with_name(name))
        small_trial(folder)
        return model.with_name(name)

    return made


def _banded(file: Path, _: Path) -> list[str]:
    return ["simulate", str(file.with_name("model.toml")), "turning", "--bands", "95", "--draws", "200",
            "--duration", "10", "--json", "--extrapolate"]  # fmt: skip


def _network(folder: Path) -> Path:
    save(untrained(), folder / "net.toml")
    return next(iter(sorted(folder.glob("*.npz"))), folder / "net.toml")


def _state(folder: Path) -> Path:
    log = small_trial(folder)
    assert main(["twin", SHIP, "--trial", str(log), "-o", str(folder / "twin"), "--json"]) == 0
    return next(path for path in sorted((folder / "twin").glob("*.json")) if "seatrial-twin" in path.read_text())


SLOW = ("state of a twin", "operators, netCDF", "coefficients", "coefficients, netCDF 3", "campaign", "campaign, rare",
        "case", "case, weather and sensors", "case, rare", "case, levels")  # fmt: skip
"""Kinds of which a tenth as many mutations are tried: each takes seconds."""

MORE: dict[str, Kind] = {
    "scenario": (_scenario, lambda file, _: ["range", str(file), "--duration", "10", "--json"]),
    "campaign": (_campaign, lambda file, out: ["campaign", str(file), "-o", str(out), "--json"]),
    "campaign, manifest": (_left("campaign.json"), _of_campaign("--status")),
    "campaign, manifest, report": (_left("campaign.json"), _of_campaign("--report")),
    "campaign, part": (_left("*.parquet"), _of_campaign("--verify")),
    "campaign, part, report": (_left("*.parquet"), _of_campaign("--report")),
    "campaign, rare": (_rare, lambda file, out: [
        "campaign", str(file.parents[len(file.relative_to(next(p for p in file.parents if p.name == "runs")).parts)]
                        / "campaign.toml"),
        "-o", str(next(p for p in file.parents if p.name == "runs")), "--rare", "first_overshoot", "--runs", "100"]),
    "captive mapping": (_captive, _fitted),
    "captive table": (_tank, _fitted),
    "open water": (_open_water, lambda file, _: ["captive", SHIP, str(file.with_name("tank.csv")), "--mapping",
                                                 str(file.with_name("map.toml")), "--open-water", str(file), "--json"]),
    "sea": (_sea, _at_sea("--sea", "FILE", "--rao", "{}/rao.csv")),
    "operators": (_rao, _at_sea("--sea", "0.1,1.5,90", "--rao", "FILE")),
    "operators, netCDF": (_netcdf, _at_sea("--sea", "0.1,8,90", "--rao", "FILE")),
    "coefficients": (_coefficients, lambda file, _: ["seakeeping", SHIP, str(file), "--json"]),
    "coefficients, netCDF 3": (_classic, lambda file, _: ["seakeeping", SHIP, str(file), "--json"]),
    "nmea mapping": (_nmea_mapping, lambda file, out: ["import", "nmea", str(file.with_name("log.nmea")), "-o",
                                                       str(out), "--mapping", str(file)]),
    "robot mapping": (_robot_mapping, lambda file, out: ["import", "mcap", str(file.with_name("log.mcap")), "-o",
                                                         str(out), "--mapping", str(file)]),
    "sets": (_sets, lambda file, out: ["identify", str(file.with_name("study.toml")), "-o", str(out)]),
    "fit, banded": (_of_a_fit("fit.json"), _banded),
    "fitted model": (_of_a_fit("model.toml"), _banded),
    "draws": (_of_a_fit("posterior.npz"), _banded),
    "bands": (_of_a_fit("model.bands.json"), _banded),
    "members": (_of_a_fit("spread.npz"), lambda file, out: [
        "predict", str(file.with_name("model.toml")), str(file.parents[1] / "log.csv"), "-o", str(out)]),
    "card": (_of_a_fit("fit.json"), lambda file, _: ["card", str(file.with_name("model.toml")), "--json", "--trials",
                                                     str(file.parents[1] / "log.csv")]),
    "weights": (_network, lambda file, _: ["show", str(file.with_name("net.toml")), "--json"]),
    "state of a twin": (_state, lambda file, _: ["twin", SHIP, "--trial", str(file.parents[1] / "log.csv"), "-o",
                                                 str(file.parent), "--json"]),
    **LOGS,
    **CASES,
}  # fmt: skip
