"""A day with the tug of You 2023, as a logger would keep it: a bollard pull and twelve manoeuvres in a breeze.

Writes FOLDER/pull.csv and FOLDER/raw/*.csv (GNSS, compass, gyro, anemometer, orders and angles of the thrusters; no
speed log), then does what comes before a study: the map of thrust, servos, a first guess of hull and windage, and
logs that a fit can begin from, as FOLDER/tug.toml and FOLDER/trials/*.csv.

Run from anywhere: python examples/tug_day.py [FOLDER]; "tug" where none is named
"""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

import seatrial as st

STUDY = Path(__file__).parents[1] / "studies" / "you2023.toml"
HULL = st.first_guess.Hull(L_pp=2.152, B=0.6952, d=0.2485, m=187.6)
PLACES = {"1": (-0.8, 0.163), "2": (-0.8, -0.163)}
NOISE = {"x": 0.02, "y": 0.02, "psi": 0.0035, "r": 0.0035}
"""Of GNSS [m], compass [rad] and gyro [rad/s]; it is that of the logs, and known."""

ANEMOMETER = {"U_T": 0.1, "gamma_T": 0.05}
PULL = st.virtual.Bench(tuple(0.5 * k for k in range(21)), repeats=20, noise=0.3)
"""Every half revolution a second, twenty readings of the load cell each."""

WINDAGE = st.forces.wind_blendermann.Blendermann(
    rho_air=1.225, A_T=0.14, A_L=0.36, L_OA=2.3, s_L=0.15, C_Dt=0.85, C_Dl_bow=0.55, C_Dl_stern=0.55, delta=0.65
)
"""Coefficients of a tender; the areas are estimates, in truth a fifth too large."""

UNITS = {"n": "1/s", "alpha": "rad", "U_T": "m/s", "gamma_T": "rad"}


def sailed() -> st.virtual.VirtualTrials:
    """The twelve manoeuvres, the wind in their logs."""
    table = tomllib.loads(STUDY.read_text(encoding="utf-8"))["virtual"]
    virtual = st.virtual.read(st.filled(st.VirtualTable, table, STUDY))
    sails = {name: sail for name, sail in virtual.sails.items() if not name.startswith("unseen")}
    return replace(virtual, sails=sails, known=("wind",), bench=PULL)


def logged(log: st.Trial, rng: np.random.Generator) -> st.Trial:
    """What the logger keeps: no speeds, an anemometer with noise, and a name without blanks."""
    kept = {name: log[name] for name in log.channels if name not in ("u", "v_m")}
    kept |= {name: np.abs(kept[name] + sd * rng.standard_normal(len(log))) for name, sd in ANEMOMETER.items()}
    units = {name: unit for name in kept for stem, unit in UNITS.items() if name == stem or name.startswith(f"{stem}_")}
    return st.Trial(log.name.replace(" ", "_").replace("+", ""), log.t, kept, units, log.meta)


def ready(log: st.Trial, servos: Mapping[str, st.servo.ServoFit]) -> st.Trial:
    """The log with speeds to begin from, and angles as the servos answer, which are quieter than their readings."""
    begin = st.smooth(log, NOISE)
    answers = {control: st.servo.answered(servo, log) for control, servo in servos.items()}
    return log.having(u=begin["u"], v_m=begin["v_m"], **answers)


def guessed(revolutions: np.ndarray, pull: np.ndarray, servos: Mapping[str, st.servo.ServoFit]) -> st.Ship:
    """The tug as particulars, bollard pull and servo logs tell it."""
    both = st.thrust_map.fit_thrust(revolutions, pull, name="1+2")
    maps = {name: (*place, st.thrust_map.shared(name, both, len(PLACES))) for name, place in PLACES.items()}
    tug = st.first_guess.fossen_ship("tug", HULL, maps, speed=0.9, n=7.0, servos=servos)
    told = {f"wind.{key}": st.Entry("assumed: a tender's coefficients, areas from a drawing", float(value))
            for key, value in vars(WINDAGE).items() if isinstance(value, float)}  # fmt: skip
    return replace(tug, model=replace(tug.model, wind=WINDAGE), entries={**tug.entries, **told})


def off(logs: Sequence[st.Trial], truth: Sequence[st.Trial]) -> float:
    """Root mean square error of the velocity [m/s]."""
    errors = [np.hypot(a["u"] - b["u"], a["v_m"] - b["v_m"]) for a, b in zip(logs, truth, strict=True)]
    return float(np.sqrt((np.concatenate(errors) ** 2).mean()))


def main(folder: Path) -> None:
    """Make the logs, then everything that a study needs."""
    virtual = sailed()
    for place in (folder / "raw", folder / "trials"):
        place.mkdir(parents=True, exist_ok=True)
    pulled = list(virtual.pulled().values())
    revolutions, pull = pulled[0][0], sum(force for _, force in pulled)
    np.savetxt(folder / "pull.csv", np.column_stack([revolutions, pull]), delimiter=",", header="n [1/s],T [N]",
               comments="", fmt="%.4f")  # fmt: skip
    rng = np.random.default_rng(virtual.seed)
    raw = [logged(log, rng) for log in virtual.run()]
    for log in raw:
        st.write_trial(log, folder / "raw" / f"{log.name}.csv")
    servos = {control: st.servo.fit_servo(raw[4:8], control) for control in ("alpha_1", "alpha_2")}
    st.save(guessed(revolutions, np.asarray(pull), servos), folder / "tug.toml")
    trials = [ready(log, servos) for log in raw]
    for log in trials:
        st.write_trial(log, folder / "trials" / f"{log.name}.csv")
    # The same motions without noise: known here only because the day is made up.
    miss = off(trials, replace(virtual, sensors=st.Sensors()).run())
    sys.stdout.write(f"error of the velocity to begin from: {miss:.3f} m/s\n")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "tug"))
