"""A day at the tank with the tug of You 2023, as a logger would keep it: a bollard pull and twelve manoeuvres.

Writes FOLDER/pull.csv and FOLDER/raw/*.csv (GNSS, compass, gyro, orders and angles of the thrusters; no speed log),
then does what comes before a study: maps of thrust, servos, a first guess of the hull, and velocities by a Kalman
smoother, as FOLDER/tug.toml and FOLDER/trials/*.csv.

Run from the root of the repository: python examples/tug_day.py FOLDER
"""

from __future__ import annotations

import sys
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np

from seatrial.data import Trial
from seatrial.data.trialfile import write_trial
from seatrial.identify.filtering import Kalman
from seatrial.identify.first_guess import Hull, fossen_ship
from seatrial.identify.measurement import Antenna, Heading, Rate
from seatrial.identify.servo import fit_servo
from seatrial.identify.study_schema import StudyFile
from seatrial.identify.thrust_map import fit_thrust
from seatrial.identify.virtual_trials import read
from seatrial.sensors import Sensors
from seatrial.ships.files import save

STUDY = Path("studies") / "you2023.toml"
HULL = Hull(L_pp=2.152, B=0.6952, d=0.2485, m=187.6)
PLACES = {"1": (-0.8, 0.163), "2": (-0.8, -0.163)}
GNSS, COMPASS, GYRO = 0.02, 0.0035, 0.0035
KALMAN = Kalman(
    measurement={"gnss": Antenna(GNSS), "compass": Heading(COMPASS), "gyro": Rate(GYRO)},
    # The hull is only guessed yet: its accelerations may be off by this much in a second.
    process={"u": 0.03, "v_m": 0.03, "r": 0.03},
)


def main(folder: Path) -> None:
    """Make the logs, then everything that a study needs."""
    document = tomllib.loads(STUDY.read_text(encoding="utf-8"))
    virtual = read(StudyFile.model_validate(document).virtual)
    sails = {name: sail for name, sail in virtual.sails.items() if not name.startswith("unseen")}
    virtual = replace(virtual, sails=sails)
    pulled = virtual.pulled()
    table = np.column_stack([next(iter(pulled.values()))[0], *(pull for _, pull in pulled.values())])
    for place in (folder / "raw", folder / "trials"):
        place.mkdir(parents=True, exist_ok=True)
    head = ",".join(["n [1/s]", *(f"T_{name} [N]" for name in pulled)])
    np.savetxt(folder / "pull.csv", table, delimiter=",", header=head, comments="", fmt="%.4f")

    raw = virtual.run()
    maps = {name: (*PLACES[name], fit_thrust(n, pull, name=name)) for name, (n, pull) in pulled.items()}
    servos = {c: fit_servo(raw[4:8], c) for c in ("alpha_1", "alpha_2")}
    tug = fossen_ship("tug", HULL, maps, speed=0.9, n=7.0, servos=servos)
    save(tug, folder / "tug.toml")
    # The same motions without noise: known here only because the day is made up.
    true = replace(virtual, sensors=Sensors()).run()
    errors: dict[str, list[np.ndarray]] = {"differences": [], "smoother": []}
    for log, truth in zip(raw, true, strict=True):
        kept = {name: log[name] for name in log.channels if name not in ("u", "v_m")}
        bare = Trial(log.name.replace(" ", "_").replace("+", ""), log.t, kept, meta=log.meta)
        write_trial(bare, folder / "raw" / f"{bare.name}.csv")
        smooth = KALMAN.run(tug, bare).smoothed().trial()
        write_trial(smooth, folder / "trials" / f"{bare.name}.csv")
        north, east = (np.gradient(log[name], log.t) for name in ("x", "y"))
        c, s = np.cos(log["psi"]), np.sin(log["psi"])
        errors["differences"].append(np.hypot(c * north + s * east - truth["u"], c * east - s * north - truth["v_m"]))
        errors["smoother"].append(np.hypot(smooth["u"] - truth["u"], smooth["v_m"] - truth["v_m"]))
    for name, found in errors.items():
        rms = float(np.sqrt((np.concatenate(found) ** 2).mean()))
        sys.stdout.write(f"error of the velocity by {name}: {rms:.4f} m/s\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
