"""A day of NMEA 0183 for the walk of a control engineer: five manoeuvres of a boat that is in no library, a file each.

The boat differs from the estimate of its particulars by up to a third in hull, propeller and rudder, and sails in a
current that nobody logs.  Its receiver gives RMC and GGA once a second, compass, gyro and rudder feeler five times,
the shaft once; every line has the stamp of the logger.

    seatrial estimate examples/particulars/workboat_24m.toml -o boat.toml
    python examples/boat_nmea.py boat.toml logs
"""

import math
import sys
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from functools import reduce
from pathlib import Path

import numpy as np

import seatrial as st

DEGREE, KNOT = math.pi / 180.0, 1852.0 / 3600.0
QUAY, START = st.Datum(57.6952, 11.8213), datetime(2025, 9, 18, 8, 30, tzinfo=UTC)
HIDDEN = {"hull.R_0": 1.2, "hull.Y_v": 0.8, "hull.Y_r": 1.2, "hull.N_v": 0.8, "hull.N_r": 1.15, "hull.N_vvr": 1.3,
          "propeller.w_P0": 0.8, "rudder.kappa": 1.2, "rudder.l_R": 0.9}  # fmt: skip
CURRENT = st.Weather(current=0.25, current_towards_deg=60.0)


def sentence(body: str) -> str:
    return f"${body}*{reduce(lambda total, letter: total ^ ord(letter), body, 0):02X}"


def angle(value: float, places: int, letters: str) -> str:
    """Degrees and minutes as ddmm.mmmmm,N."""
    whole = int(abs(value))
    return f"{whole:0{places}d}{60.0 * (abs(value) - whole):08.5f},{letters[value < 0]}"


def said(row: dict[str, float], when: datetime, k: int) -> Iterator[str]:
    """What the instruments say at one row of a fifth of a second."""
    yield sentence(f"HEHDT,{row['psi'] / DEGREE % 360.0:.2f},T")
    yield sentence(f"TIROT,{60.0 * row['r'] / DEGREE:.2f},A")
    yield sentence(f"IIRSA,{row['delta'] / DEGREE:.1f},A,,V")
    if k % 5:
        return
    latitude, longitude = QUAY.place(row["x"], row["y"])
    north = row["u"] * math.cos(row["psi"]) - row["v_m"] * math.sin(row["psi"])
    east = row["u"] * math.sin(row["psi"]) + row["v_m"] * math.cos(row["psi"])
    fix = f"{angle(latitude, 2, 'NS')},{angle(longitude, 3, 'EW')}"
    speed, course = math.hypot(north, east) / KNOT, math.atan2(east, north) / DEGREE % 360.0
    yield sentence(f"GPRMC,{when:%H%M%S.00},A,{fix},{speed:.2f},{course:.1f},{when:%d%m%y},,,A")
    yield sentence(f"GPGGA,{when:%H%M%S.00},{fix},4,17,0.6,3.1,M,38.2,M,,")
    yield sentence(f"IIRPM,S,0,{60.0 * row['n_P']:.1f},,A")


def main(ship: str, folder: Path) -> None:
    """Write one log for each manoeuvre."""
    sheet = st.load(ship)
    boat = sheet.having({path: f * st.parameters.read(sheet.model, path) for path, f in HIDDEN.items()})
    plans = {
        "turn_35_starboard": st.Turning(rudder_deg=35), "turn_20_port": st.Turning(rudder_deg=20, side="port"),
        "zigzag_10": st.Zigzag(rudder_deg=10, heading_deg=10), "zigzag_20": st.Zigzag(rudder_deg=20, heading_deg=20),
        "turn_25_port": st.Turning(rudder_deg=25, side="port"),
    }  # fmt: skip
    noise = {"x": 0.05, "y": 0.05, "psi": 0.2 * DEGREE, "u": 0.02, "v_m": 0.02, "r": 0.1 * DEGREE}
    rng = np.random.default_rng(5)
    folder.mkdir(parents=True, exist_ok=True)
    for number, (name, plan) in enumerate(plans.items()):
        run = boat.simulate(plan, duration=240.0, dt=0.2, weather=CURRENT)
        trial, begins = st.Sensors(noise=noise).read(run, rng), START + timedelta(minutes=12 * number)
        lines: list[str] = []
        for k, t in enumerate(trial.t.tolist()):
            when = begins + timedelta(seconds=round(t, 3))
            row = {channel: float(values[k]) for channel, values in trial.channels.items()}
            lines += [f"{when:%Y-%m-%dT%H:%M:%S.%f}Z {one}" for one in said(row, when, k)]
        (folder / f"{name}.nmea").write_text("\n".join([*lines, ""]), encoding="ascii")


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]))
