"""Logs for the tutorial on a first log: six manoeuvres of a 7 m model at sea, in the words of a Norwegian logger.

Latin-1, semicolons and decimal commas, four lines before the header, a row of units, date and time in two columns,
latitude and longitude in degrees and minutes, speed and course over ground, the rudder as "12,3 SB" or "4,5 BB",
revolutions per minute, "N/A" for a gap, and some rows written twice.  The ship is the one of `seatrial demo`.

Run from the root of the repository: python examples/first_log.py logs
"""

import math
import sys
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np

import seatrial as st

Turning = st.manoeuvres.turning.Turning
Zigzag = st.manoeuvres.zigzag.Zigzag

DEGREE, KNOT = math.pi / 180.0, 1852.0 / 3600.0
QUAY, START = st.Datum(63.4412, 10.4199), datetime(2025, 4, 11, 9, 15, 45)
ABOVE = ("Prøvetur", "Fartøy: modell 7 m", "Logger: bro 2", "")
HEADS = (("Dato", ""), ("Tid", ""), ("Bredde", ""), ("Lengde", ""), ("Kurs", "grader"), ("Fart over grunn", "knop"),
         ("Kurs over grunn", "grader"), ("Girhastighet", "grader/min"), ("Ror", ""), ("Turtall", "o/min"))  # fmt: skip


def minutes(value: float, letters: str) -> str:
    """Degrees and minutes: 63° 26,472000' N."""
    whole = int(abs(value))
    return f"{whole}° {60.0 * (abs(value) - whole):.6f}' {letters[value < 0]}"


def logged(trial: st.Trial, begins: datetime, rng: np.random.Generator) -> str:
    """The trial as the text of a log."""
    speed, psi = np.hypot(trial["u"], trial["v_m"]), trial["psi"]
    course = psi + np.arctan2(trial["v_m"], trial["u"])
    rows: list[str] = []
    for k, t in enumerate(trial.t.tolist()):
        latitude, longitude = QUAY.place(float(trial["x"][k]), float(trial["y"][k]))
        rudder = trial["delta"][k] / DEGREE
        when = begins + timedelta(seconds=round(t, 3))
        cells = (
            when.strftime("%d.%m.%Y"), when.strftime("%H:%M:%S.%f")[:-3],
            minutes(latitude, "NS"), minutes(longitude, "EW"),
            f"{psi[k] / DEGREE % 360.0:.2f}", f"{speed[k] / KNOT:.3f}", f"{course[k] / DEGREE % 360.0:.2f}",
            f"{60.0 * trial['r'][k] / DEGREE:.2f}",
            "N/A" if rng.random() < 0.002 else f"{abs(rudder):.2f} {'SB' if rudder >= 0.0 else 'BB'}",
            f"{60.0 * trial['n_P'][k]:.1f}",
        )  # fmt: skip
        line = ";".join(cells).replace(".", ",").replace(cells[0].replace(".", ","), cells[0], 1)
        rows += [line] * (2 if rng.random() < 0.01 else 1)
    head = [*ABOVE, ";".join(name for name, _ in HEADS), ";".join(unit for _, unit in HEADS)]
    return "\n".join([*head, *rows, ""])


def main(folder: Path) -> None:
    """Write one log for each manoeuvre."""
    handbook = st.load(st.demo.SHIP)
    at_sea = handbook.having(
        {path: factor * st.parameters.read(handbook.model, path) for path, factor in st.demo.HIDDEN.items()}
    )
    n_P, rng = st.approach(handbook)[1], np.random.default_rng(11)
    plans = {
        "sving_35_styrbord": Turning(n_P, 35 * DEGREE), "sving_20_babord": Turning(n_P, -20 * DEGREE),
        "zigzag_10": Zigzag(n_P, 10 * DEGREE, 10 * DEGREE), "zigzag_20": Zigzag(n_P, 20 * DEGREE, 20 * DEGREE, -1.0),
        "zigzag_15_5": Zigzag(n_P, 15 * DEGREE, 5 * DEGREE), "sving_25_styrbord": Turning(n_P, 25 * DEGREE),
    }  # fmt: skip
    folder.mkdir(parents=True, exist_ok=True)
    for k, (name, plan) in enumerate(plans.items()):
        run = st.run_policy(at_sea, plan, duration=120.0, dt=0.1, every=2, name=name)
        trial = st.Sensors(noise=st.demo.NOISE).read(run, rng)
        text = logged(trial, START + timedelta(minutes=10 * k), rng)
        (folder / f"{name}.csv").write_text(text, encoding="latin-1")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
