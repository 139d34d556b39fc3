"""What a recording holds of what a fit wants, by channels that are there, half there, and not there."""

import numpy as np

from seatrial.data import Trial
from seatrial.data.found import QUANTITIES, told


def test_each_quantity_is_found_by_its_channels_or_missing() -> None:
    t = 0.5 * np.arange(10.0)
    some = np.where(np.arange(10) % 2 == 0, 1.0, np.nan)
    trial = Trial("a", t, {"psi": t, "n_bow": t, "alpha_1": t, "U_G": some, "r": np.full(10, np.nan), "x_sd": t})
    said = told(trial).meta
    assert said["sources"] == {
        "heading": "psi: 2 Hz, 100 % of the rows", "speed over ground": "U_G: 1 Hz, 50 % of the rows",
        "rudder or azimuth": "alpha_1: 2 Hz, 100 % of the rows",
        "revolutions or thrust": "n_bow: 2 Hz, 100 % of the rows",
    }  # fmt: skip
    assert said["missing"] == ["position", "rate of turn", "speed through water", "wind", "depth"]
    assert set(said["missing"]) | set(said["sources"]) == set(QUANTITIES)


def test_a_reader_that_knows_its_source_is_believed() -> None:
    t = np.arange(4.0)
    by = {"rpm_S_1": "RCRPM, 1 Hz", "rudder": "AGRSA, 1 Hz", "true wind": "IIMWV, 1 Hz"}
    said = told(Trial("a", t, {"n_P_1": t, "delta_1": t, "U_T": t, "y": t}, {}, {"sources": by})).meta["sources"]
    assert said == {"position": "y: 1 Hz, 100 % of the rows", "rudder or azimuth": "delta_1: AGRSA, 1 Hz",
                    "revolutions or thrust": "n_P_1: RCRPM, 1 Hz", "wind": "U_T: IIMWV, 1 Hz"}  # fmt: skip
