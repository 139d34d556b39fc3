"""Logs of two zigzags of a ship that turns less readily than the library's, for studies that find it."""

from __future__ import annotations

from pathlib import Path

from seatrial.data.trialfile import write_trial
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load
from seatrial.simulate.approach import approach
from seatrial.simulate.run import simulate


def write_zigzags(folder: Path) -> None:
    """A zigzag to either side of `kvlcc2_l7` with 1.2 times its N_r, of 60 s with a row each 0.5 s."""
    folder.mkdir()
    ship = load("kvlcc2_l7")
    truth = ship.having({"hull.N_r": 1.2 * float(ship.model.hull.N_r)})
    for name, side in (("port", -1.0), ("starboard", 1.0)):
        run = simulate(truth, Zigzag(approach(truth)[1], 0.35, 0.35, side), duration=60.0, dt=0.1, every=5, name=name)
        write_trial(run, folder / f"{name}.csv")
