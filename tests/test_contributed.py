"""A force, a log format and a ship as a newcomer wrote them from the docs alone: each is one file, and nothing else.

They stand in tests/contributed as they were written, in one to three minutes each.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from rooms import Rooms, rooms
from seatrial.cli.app import main
from seatrial.core.parameters import Parts
from seatrial.data.trialfile import read_trial
from seatrial.environment import CALM
from seatrial.forces import Flow
from seatrial.ships.files import load
from seatrial.testing import FORMAT_CHECKS, Log, Part, check_force, discovery, log_examples, untried_forces
from seatrial.workflow.contributing.ship_check import check_ship_file

FOLDER = Path(__file__).parent / "contributed"


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Rooms]:
    with rooms(tmp_path, monkeypatch) as made:
        yield made


def text(name: str) -> str:
    return (FOLDER / name).read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_force(here: Rooms) -> None:
    """Found and tried by the suite; a dinghy off the centre line turns the ship to its side and slows it down."""
    towed = here.put("forces/towed.py", text("towed.py"))
    for one in towed.EXAMPLES:
        check_force(Part(one, rho=1000.0, L_pp=7.0, d=0.46, U=1.2, n=7.0))
    discovery.force_modules.cache_clear()
    try:
        assert "towed:TowedBody" in discovery.force_modules()
        assert not untried_forces()
    finally:
        discovery.force_modules.cache_clear()
    astern = Flow(2.0, 0.0, 0.0, *[0.0] * 4, 1000.0, 7.0, 0.46)
    X, Y, N = towed.TowedBody(area=0.004, C_D=1.0, x=-3.0, y=0.5).force(astern)
    assert pytest.approx((-8.0, 0.0, 4.0), abs=1e-9) == (X, Y, N)
    ship = load("kvlcc2")
    drawn = ship.model.__class__(**vars(ship.model) | {
        "extras": Parts(("dinghy",), (towed.TowedBody(area=1.0, C_D=1.0, x=-160.0),))})  # fmt: skip
    at = (0.0, 0.0, 0.0, 7.0, 0.0, 0.0)
    slower, plain = (one.derivative(at, (1.5, 0.0), CALM)[3] for one in (drawn, ship.model))
    assert slower < plain


def test_a_log_format(here: Rooms, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    portlog = here.put("data/formats/portlog.py", text("portlog.py"))
    assert "portlog" in log_examples()
    for check in FORMAT_CHECKS.values():
        check(Log(portlog, portlog.EXAMPLE))
    log = tmp_path / "pilot.plg"
    log.write_text(portlog.EXAMPLE, encoding="utf-8")
    assert main(["import", "portlog", str(log), "-o", str(tmp_path / "trials")]) == 0
    trial = read_trial(tmp_path / "trials" / "pilot.csv")
    assert np.diff(trial.t) == pytest.approx(0.5)  # over midnight
    assert math.degrees(trial["psi"][-1]) == pytest.approx(362.9)
    assert trial["delta"][2] == pytest.approx(math.radians(5.0))  # theirs is positive to port
    assert np.isnan(trial["x"]).tolist() == [False] * 4 + [True, False, False]
    log.write_text(portlog.EXAMPLE.replace(";359.4;", ";459.4;"), encoding="utf-8")
    capsys.readouterr()
    assert main(["import", "portlog", str(log), "-o", str(tmp_path / "trials")]) == 2
    assert "pilot.plg: line 3, heading: 459.4 deg is not within 0 to 360 deg" in capsys.readouterr().err
    assert main(["check", str(log)]) == 2
    assert "seatrial import portlog" in capsys.readouterr().err


@pytest.mark.slow
def test_a_ship() -> None:
    checked = check_ship_file(FOLDER / "monohull_38m.toml")
    assert checked.fit, [one for one in checked.findings if one.state == "error"]
    assert main(["simulate", str(FOLDER / "monohull_38m.toml"), "turning"]) == 0
