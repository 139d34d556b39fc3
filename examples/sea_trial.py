"""A sea trial for the walk of a naval architect: circles and zigzags of the KCS, as tables of the trial's computer.

The ship is the published one; its particulars are in examples/particulars/kcs.toml.  The table has a row a second:
position by a local grid, heading, rate of turn, speed and course over ground, rudder and revolutions.

Run from the root of the repository: python examples/sea_trial.py trial
"""

import math
import sys
from pathlib import Path

import numpy as np

import seatrial as st

DEGREE, KNOT = math.pi / 180.0, 1852.0 / 3600.0
HEAD = "Time s;Northing m;Easting m;Heading deg;ROT deg/min;SOG kn;COG deg;Rudder deg;RPM"
NOISE = {"x": 0.5, "y": 0.5, "psi": 0.1 * DEGREE, "u": 0.03, "v_m": 0.03, "r": 0.02 * DEGREE}


def table(trial: st.Trial) -> str:
    """Rows of the trial's computer."""
    sog = np.hypot(trial["u"], trial["v_m"]) / KNOT
    cog = (trial["psi"] + np.arctan2(trial["v_m"], trial["u"])) / DEGREE % 360.0
    columns = (trial.t, trial["x"], trial["y"], trial["psi"] / DEGREE % 360.0, 60.0 * trial["r"] / DEGREE, sog, cog,
               trial["delta"] / DEGREE, 60.0 * trial["n_P"])  # fmt: skip
    rows = zip(*(one.tolist() for one in columns), strict=True)
    return "\n".join([HEAD, *(";".join(f"{value:.2f}" for value in row) for row in rows), ""])


def main(folder: Path) -> None:
    """Write one table for each run."""
    plans = {
        "turn_35_starboard": (st.Turning(rudder_deg=35), 900.0),
        "zigzag_10_10": (st.Zigzag(rudder_deg=10, heading_deg=10), 700.0),
        "zigzag_20_20": (st.Zigzag(rudder_deg=20, heading_deg=20), 700.0),
        "turn_35_port": (st.Turning(rudder_deg=35, side="port"), 900.0),
    }  # fmt: skip
    ship, rng = st.load("kcs"), np.random.default_rng(3)
    folder.mkdir(parents=True, exist_ok=True)
    for name, (plan, seconds) in plans.items():
        trial = st.Sensors(noise=NOISE).read(ship.simulate(plan, duration=seconds, dt=1.0), rng)
        (folder / f"{name}.csv").write_text(table(trial), encoding="ascii")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
