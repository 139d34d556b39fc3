"""Logs for the tutorial on fine-tuning: eight turns of SUZAKU, as the logger of a bridge would write them.

The turns are those of studies/suyama2023.toml.  Positions are metres north and east of the first buoy, speeds
north and east in knots, rate of turn in degrees per minute; the rudder counts to PORT, as it does on many bridges.

Run from the root of the repository: python examples/tuning_logs.py logs
"""

import math
import sys
from pathlib import Path

import numpy as np

import seatrial as st

KNOT = 1852.0 / 3600.0
HEAD = "Time,North,East,HDG,VN,VE,ROT,RUD,RPM"
STUDY = Path(__file__).resolve().parents[1] / "studies" / "suyama2023.toml"


def logged(trial: st.Trial, rng: np.random.Generator) -> str:
    """The trial as the text of a log; positions and heading have their noise already."""
    psi, degrees = trial["psi"], 180.0 / math.pi
    north = trial["u"] * np.cos(psi) - trial["v_m"] * np.sin(psi)
    east = trial["u"] * np.sin(psi) + trial["v_m"] * np.cos(psi)
    noise = rng.standard_normal((3, len(trial)))
    rows = np.column_stack([
        trial.t, trial["x"], trial["y"], (degrees * psi) % 360.0,
        north / KNOT + 0.03 * noise[0], east / KNOT + 0.03 * noise[1], 60.0 * degrees * trial["r"] + 0.5 * noise[2],
        -degrees * trial["delta"], 60.0 * trial["n_P"],
    ])  # fmt: skip
    formats = ("%.0f", "%.2f", "%.2f", "%.1f", "%.2f", "%.2f", "%.1f", "%.1f", "%.1f")
    return "\n".join([HEAD, *(",".join(f % v for f, v in zip(formats, row, strict=True)) for row in rows), ""])


def main(folder: Path) -> None:
    """Write one log for each turn: `starboard_10.csv`, `port_20.csv`, ..."""
    study, rng = st.read_study(STUDY), np.random.default_rng(4)
    folder.mkdir(parents=True, exist_ok=True)
    for trial in (*study.problem.trials, *study.test):
        side = "starboard" if trial.name[1] == "+" else "port"
        (folder / f"{side}_{trial.name[2:]}.csv").write_text(logged(trial, rng), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
