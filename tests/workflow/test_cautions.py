"""What is said of trials and models before a prediction, and what stops one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from seatrial.cli.app import main
from seatrial.data import DataError, Trial
from seatrial.data.trialfile import write_trial
from seatrial.environment import Uniform
from seatrial.identify import Problem
from seatrial.identify.lint import lint
from seatrial.manoeuvres.turning import Turning
from seatrial.models.network import Network
from seatrial.models.neural import Neural
from seatrial.ships.files import load, save
from seatrial.simulate.replay import replay
from seatrial.simulate.run import simulate
from seatrial.workflow.validate import cautions

SHIP = load("esso_osaka_3m")
RUN = simulate(
    SHIP, Turning(delta=0.3, n_P=9.0), speed=0.4, duration=30.0, dt=0.5, name="turn",
    environment=Uniform(U_T=1.0, gamma_T=0.5),
)  # fmt: skip
LOG = replace(RUN, meta={**RUN.meta, "source": "a pond"})


def broken(rows: slice, *names: str) -> Trial:
    channels = {name: LOG[name].copy() for name in names}
    for values in channels.values():
        values[rows] = np.nan
    return LOG.having(**channels)


def test_gaps_are_told_once_with_channel_rows_and_what_fills_them() -> None:
    (line,) = cautions(SHIP, [broken(slice(10, 30), "U_T", "n_P")])
    assert line == (
        "warning: turn: n_P has no value in 20 of 61 rows (up to 10 s on end), U_T has no value in 20 of 61 rows "
        "(up to 10 s on end); the last value before is held"
    )
    assert cautions(SHIP, [LOG]) == []


def test_a_gap_at_the_start_is_filled_from_behind() -> None:
    (line,) = cautions(SHIP, [broken(slice(0, 4), "delta")])
    assert line.endswith("on either side, or the first after it at the start")


def test_gaps_beyond_the_complete_rows_are_none() -> None:
    (line,) = cautions(SHIP, [broken(slice(50, None), "u", "U_T", "n_P")])
    assert line == "note: turn: 11 rows outside of the complete ones are left out"


def test_a_fit_says_so_too() -> None:
    problem = Problem(SHIP, (broken(slice(10, 30), "U_T"),), ())
    told = [issue for issue in lint(problem) if "no value" in issue.text]
    assert ["before" in issue.text.partition("; ")[2] for issue in told] == [True]


def test_a_dead_anemometer_is_no_wind() -> None:
    dead = broken(slice(None), "U_T")
    assert cautions(SHIP, [dead]) == ["warning: turn has no wind (U_T, gamma_T); predicted in still air"]
    still = replace(LOG, channels={n: v for n, v in LOG.channels.items() if n not in ("U_T", "gamma_T")})
    assert np.array_equal(replay(SHIP, dead)["v_m"], replay(SHIP, still)["v_m"])


def test_a_rudder_without_a_value_is_refused() -> None:
    with pytest.raises(DataError, match=r"^turn: delta\b"):
        replay(SHIP, broken(slice(None), "delta"))


@pytest.mark.parametrize("command", ["predict", "validate"])
def test_an_untrained_network_is_told_whatever_the_trial(command: str, tmp_path: Path, capsys) -> None:
    net = replace(SHIP, name="net", model=Neural(dt=0.5, network=Network("forgetting", (4,), memory=2)), entries={})
    model = save(net, tmp_path / "net.toml", {})
    still = replace(LOG, channels={n: v for n, v in LOG.channels.items() if n not in ("U_T", "gamma_T")})
    write_trial(still, tmp_path / "turn.csv")
    out = ["-o", str(tmp_path / "out")] if command == "predict" else []
    assert main([command, str(model), str(tmp_path / "turn.csv"), *out]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "net is untrained" in line
    assert "seatrial identify" in line
    assert str(model) in line
    assert not (tmp_path / "out").exists()


def test_weights_without_a_name(tmp_path: Path, capsys) -> None:
    net = replace(SHIP, name="net", model=Neural(dt=0.5, network=Network("forgetting", (4,), memory=2)), entries={})
    path = save(net, tmp_path / "net.toml", {})
    path.write_text(path.read_text().replace("[network]", '[network]\nweights = ""'))
    assert main(["show", str(path)]) == 2
    assert "network.weights is ''" in capsys.readouterr().err


def apparent(trial: Trial) -> Trial:
    """The trial as an anemometer on board alone would have logged it."""
    angle = trial["gamma_T"] - trial["psi"]
    ahead, aside = (trial["U_T"] * f(angle) + trial[name] for f, name in ((np.cos, "u"), (np.sin, "v_m")))
    left = {n: v for n, v in trial.channels.items() if n not in ("U_T", "gamma_T")}
    return replace(trial, channels={**left, "U_A": np.hypot(ahead, aside), "gamma_A": np.arctan2(aside, ahead)})


def test_an_apparent_wind_drives_the_prediction_as_the_true_one_does() -> None:
    felt = apparent(LOG)
    assert np.max(np.abs(felt["U_A"] - LOG["U_T"])) > 0.1
    still = replay(SHIP, replace(felt, channels={n: v for n, v in felt.channels.items() if n != "U_A"}))
    for name in ("x", "y", "psi", "u", "v_m", "r"):
        assert replay(SHIP, felt)[name] == pytest.approx(replay(SHIP, LOG)[name], abs=1e-9)
    assert np.max(np.abs(still["v_m"] - replay(SHIP, LOG)["v_m"])) > 1e-4
    assert cautions(SHIP, [felt]) == [
        "note: turn: its true wind is computed from U_A, gamma_A and the measured motion"
    ]
    said = [issue.text for issue in lint(Problem(SHIP, (felt,), ())) if "wind" in issue.text]
    assert said == ["its true wind is computed from U_A, gamma_A and the measured motion"]


def test_an_apparent_wind_that_the_ship_cannot_feel_is_told() -> None:
    bare = replace(SHIP, model=replace(SHIP.model, wind=None))
    assert cautions(bare, [apparent(LOG)]) == [
        "note: turn: its apparent wind (U_A) is left out: the model has no force of wind"
    ]
    said = [issue.text for issue in lint(Problem(bare, (apparent(LOG),), ())) if "wind" in issue.text]
    assert said == ["its apparent wind (U_A) is left out: the model has no force of wind"]


def test_gaps_of_an_apparent_wind_are_told() -> None:
    felt = apparent(LOG)
    holes = felt["U_A"].copy()
    holes[10:20] = np.nan
    lines = cautions(SHIP, [replace(felt, channels={**felt.channels, "U_A": holes})])
    assert [line for line in lines if "U_A" in line and "10 of 61 rows" in line]
