"""Recordings of a small boat with two thrusters, in the columns of a published set of a BlueBoat's logs.

Ten rows a second, named as a MATLAB script named them: milliseconds since boot, a receiver of 5 Hz whose places stand
twice, heading in degrees, speeds and rate of turn, and the pulses to both motors.  As in the published logs the left
motor is called right and the right one left, and the pulses of one of them count backwards.  The boat is the BlueBoat
of the library with other drag and unequal thrusters, on a lake without wind.

    python examples/blueboat_log.py logs
"""

import sys
from pathlib import Path

import numpy as np

import seatrial as st

LAKE = st.Datum(63.401783, 10.314897)
HIDDEN = {"damping.X_uu": 1.15, "damping.N_r": 1.3, "damping.Y_v": 0.8, "inertia.m_33": 0.85,
          "thrusters.starboard.T_1": 1.25, "thrusters.starboard.T_2": 1.1}  # fmt: skip
DT, REST, IDLE, PULSE = 0.1, 60.0, 1510, 400
SIDES = ("throttle_port", "throttle_starboard")
RUNS = {  # thrust of port and starboard, as a share of the most, and for how many seconds
    "ahead_and_turn": [(0, 0, 4), (0.8, 0.8, 8), (0.8, 0.2, 10), (0, 0, 8)],
    "spins": [(0, 0, 4), (-0.5, 0.5, 8), (0, 0, 6), (0.6, -0.6, 8), (0, 0, 6)],
    "zigzag": [(0, 0, 3), (0.6, 0.6, 6), *([(0.8, 0.3, 4), (0.3, 0.8, 4)] * 4), (0, 0, 6)],
    "astern": [(0, 0, 3), (-0.7, -0.7, 8), (-0.7, -0.3, 6), (0, 0, 6), (0.9, 0.9, 6), (0, 0, 6)],
    "wide_turn": [(0, 0, 3), (0.7, 0.45, 30), (0, 0, 6)],
    "free": [(0, 0, 2), (0.4, 0.7, 6), (0.9, 0.9, 5), (-0.3, 0.5, 5), (0.5, 0.1, 7), (-0.8, -0.8, 4), (0.2, 0.6, 8)],
}
HEADS = ("", "original_timestamp", "lat", "lon", "alt", "x_ned", "y_ned", "yaw", "surge", "sway", "yaw_rate",
         "thr_left", "thr_right")  # fmt: skip


def driven(boat: st.Ship, run: list[tuple[float, float, float]], heading: float) -> list[dict[str, float]]:
    """The motion under a sequence of throttles, from rest, a row each step."""
    plant, rows = boat.plant(dt=DT), []
    for side in SIDES:
        plant.order(side, 0.0)
    for _ in range(round(REST / DT)):  # a plant begins under way, and a recording at rest
        plant.step()
    c, s = np.cos(heading), np.sin(heading)
    for port, starboard, seconds in run:
        for side, order in zip(SIDES, (port, starboard), strict=True):
            plant.order(side, order)
        for _ in range(round(seconds / DT)):
            x, y = plant["x"], plant["y"]
            rows.append({"x": c * x - s * y, "y": s * x + c * y, "psi": plant["psi"] + heading, "u": plant["u"],
                         "v_m": plant["v_m"], "r": plant["r"], "port": port, "starboard": starboard})  # fmt: skip
            plant.step()
    return rows


def logged(rows: list[dict[str, float]], boot: float, rng: np.random.Generator) -> str:
    """The rows as the text of a log."""
    lines, place = [",".join(HEADS)], (0.0, 0.0)
    for k, row in enumerate(rows):
        if k % 2 == 0:
            place = row["x"] + rng.normal(0, 0.02), row["y"] + rng.normal(0, 0.02)
        latitude, longitude = LAKE.place(*place)
        cells = (
            f"{k}", f"{boot + 100 * k:.3f}", f"{latitude:.7f}", f"{longitude:.7f}", "217.9", f"{place[0]:.4f}",
            f"{place[1]:.4f}", f"{np.degrees(row['psi'] + rng.normal(0, 0.003)) % 360:.4f}",
            f"{row['u'] + rng.normal(0, 0.01):.4f}", f"{row['v_m'] + rng.normal(0, 0.01):.4f}",
            f"{row['r'] + rng.normal(0, 0.004):.5f}",
            f"{IDLE - PULSE * row['starboard']:.0f}", f"{IDLE + PULSE * row['port']:.0f}",
        )  # fmt: skip
        lines.append(",".join(cells))
    return "\n".join([*lines, ""])


def main(folder: Path) -> None:
    """Write one log for each recording."""
    library, rng = st.load("blueboat"), np.random.default_rng(5)
    boat = library.having({path: factor * st.parameters.read(library.model, path) for path, factor in HIDDEN.items()})
    folder.mkdir(parents=True, exist_ok=True)
    for k, (name, run) in enumerate(RUNS.items()):
        text = logged(driven(boat, run, 0.9 * k), 4805022.794 + 2e5 * k, rng)
        (folder / f"{name}.csv").write_text(text)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
