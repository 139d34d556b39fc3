"""Bands of indices before and after designed trials."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from fitted_run import saved, trial
from seatrial.cli.app import main
from seatrial.core.parameters import Free
from seatrial.identify.design.excitation import before
from seatrial.ships.estimate import estimate
from seatrial.ships.files import save
from seatrial.workflow.asked import Draws
from seatrial.workflow.evidence import designed
from seatrial.workflow.judging import design

FREE = ["hull.Y_v", "hull.N_r"]


@pytest.mark.long
def test_trials_narrow_what_a_poor_fit_leaves_open(tmp_path: Path) -> None:
    """The fit leaves 10 % of three coefficients open; good trials of 60 lengths determine two to a thousandth."""
    run = saved(tmp_path / "run", [trial(35), trial(20, 20)], share=0.1)
    told: list[str] = []
    made = design(run, FREE, bands=Draws(90.0, 200), note=told.append)
    assert "2 of 2 parameters are as open as the fit leaves them" in told[-1]
    assert made.plan.information.shape == (2, 2)
    assert (np.linalg.eigvalsh(made.plan.information) > 0.0).all()
    assert len(made.foreseen) >= 12
    for one in made.foreseen:
        assert one.before[0] < one.value < one.before[1]
        assert one.share < 0.2, one.name


@pytest.mark.long
def test_fewer_trials_leave_wider_bands(tmp_path: Path) -> None:
    run = saved(tmp_path / "run", [trial(35), trial(20, 20)], share=0.1)
    noise = "x=5,y=5,psi=3,u=0.5,v_m=0.5,r=1"
    few, many = (design(run, FREE, budget=budget, noise=noise, repeats=5, bands=Draws(90.0, 200)).foreseen
                 for budget in (20.0, 200.0))  # fmt: skip
    assert np.median([a.share for a in few]) > np.median([b.share for b in many])


@pytest.mark.slow
def test_what_makes_no_bands_is_said_in_a_line(capsys: pytest.CaptureFixture[str]) -> None:
    for more, said in ((["--bands", "120"], "above 0 and below 100"), (["--draws", "300"], "--draws needs --bands"),
                       (["--bands", "95", "--draws", "10"], "take 100 to")):  # fmt: skip
        assert main(["design", "kvlcc2_l7", "--free", "hull.Y_v", *more]) == 2
        error = capsys.readouterr().err.splitlines()
        assert said in error[-1]


@pytest.mark.long
def test_without_a_fit_the_priors_stand_before(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["design", "kvlcc2_l7", "--free", "hull.R_0", "--bands", "90", "--draws", "100", "--json"]) == 0
    captured = capsys.readouterr()
    found = json.loads(captured.out)["bands"]
    assert found["level"] == 90.0
    assert "as wide as their own size" in captured.err
    advance = next(one for one in found["indices"] if one["index"].startswith("advance"))
    assert advance["after"][1] - advance["after"][0] < 0.1 * (advance["before"][1] - advance["before"][0])


def test_an_estimated_ship_is_as_open_before_trials_as_it_states(tmp_path: Path) -> None:
    """The sigma of the file where it has one, each number by itself; the prior of the design for any other."""
    ship = estimate(Path(__file__).parents[2] / "examples" / "particulars" / "kcs.toml").ship
    file, told = save(ship, tmp_path / "ship.toml"), list[str]()
    free = (Free("hull.N_r", -0.05, prior=-0.05, sigma=0.05), Free("body.L_pp", 230.0, prior=230.0, sigma=5.0),
            Free("hull.Y_v", -0.3, prior=-0.3, sigma=0.3))  # fmt: skip
    found = designed._known(SimpleNamespace(free=free), file, told.append)  # type: ignore[arg-type]
    stated = [ship.entries[path].sigma for path in ("hull.N_r", "hull.Y_v")]
    assert np.sqrt(np.diag(found)).tolist() == pytest.approx([stated[0], before(free)[1], stated[1]])
    assert found == pytest.approx(np.diag(np.diag(found)))
    assert told == ["note: before the trials 2 of 3 parameters are as open as the estimate states them"]
