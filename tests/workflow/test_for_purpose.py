"""`seatrial validate --for`: refusals before any work, exit status by verdict, and the section of the page."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import pytest

from seatrial.cli.app import main
from seatrial.data.trialfile import write_trial
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load
from seatrial.ships.writing import save
from seatrial.simulate.run import simulate

SEA = ("--for", "collision-avoidance")


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Five zigzags and five turns of the 3 m Esso Osaka, all at speed."""
    at, ship = tmp_path_factory.mktemp("logs"), load("esso_osaka_3m")
    for k in range(5):
        angle = math.radians(10.0 + 2.0 * k)
        runs = {f"zigzag_{k}": Zigzag(10.0, angle, angle), f"turn_{k}": Turning(10.0, angle * (-1.0) ** k)}
        for name, policy in runs.items():
            run = simulate(ship, policy, duration=130.0, dt=0.1, every=5, name=name)
            write_trial(run, at / f"{name}.csv")
    return at


def ended(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    capsys.readouterr()
    status = main(["validate", *arguments])
    told = capsys.readouterr()
    return status, told.out, told.err


@pytest.mark.slow
def test_the_exit_status_is_the_verdict(logs: Path, tmp_path: Path, capsys) -> None:
    status, out, _ = ended(capsys, "esso_osaka_3m", str(logs), *SEA, "--json")
    assert status == 0
    found = json.loads(out)["fitness"]
    assert found["verdict"] == "fit"
    assert set(found["limits"]) == {"position", "heading", "overshoot", "advance"}
    ship = load("esso_osaka_3m")
    save(replace(ship.having({"rudder.f_alpha": 1.0, "rudder.a_H": 0.0}), name="weak"), tmp_path / "weak.toml")
    status, out, _ = ended(capsys, str(tmp_path / "weak.toml"), str(logs), *SEA)
    assert status == 3
    assert ": not fit." in out
    status, out, _ = ended(capsys, "esso_osaka_3m", str(logs / "zigzag_0.csv"), *SEA, "--json")
    assert status == 4
    assert "shown by 1 trial only; 5 are needed" in json.loads(out)["fitness"]["limits"]["position"]["why"]


@pytest.mark.long
def test_the_page_has_the_verdict_the_intervals_and_the_sources(logs: Path, tmp_path: Path, capsys) -> None:
    page = tmp_path / "page.html"
    assert ended(capsys, "esso_osaka_3m", str(logs / "zigzag_0.csv"), *SEA, "-o", str(page))[0] == 4
    html = page.read_text(encoding="utf-8")
    assert "For collision avoidance by heading control: cannot tell." in html
    assert "half of the smallest limit that MSC.137(76) 5.3.3 has" in html
    assert json.loads(page.with_suffix(".json").read_text())["fitness"]["limits"]["overshoot"]["why"]


@pytest.mark.slow
def test_a_limit_may_be_set_by_the_user(logs: Path, capsys) -> None:
    strict = ended(capsys, "esso_osaka_3m", str(logs / "turn_0.csv"), *SEA, "--limit", "heading=0.001", "--json")[1]
    limit = json.loads(strict)["fitness"]["limits"]["heading"]
    assert (limit["accepted"], limit["source"]) == (0.001, "as asked for by --limit")


@pytest.mark.parametrize(
    ("asked", "line"),
    [
        (("--for", "berthing"), "position=1 m is much for turn_0, of a ship of 3 m; give a scale (ship over model)"),
        (("--for", "berthing", "--limit", "position=0.05"), "no trial shows position at low speed"),
        (("--for", "dancing"), "errors are judged for: berthing, collision-avoidance, training"),
        (("--limit", "position=1"), "name one with --for"),
        ((*SEA, "--limit", "stopping=1"), "known: position, heading, overshoot, advance"),
        ((*SEA, "--limit", "position=-1"), "write position=0.5, in L"),
        ((*SEA, "--fit-first", "20"), "leave --fit-first out"),
    ],
)
def test_what_cannot_be_judged_is_refused_in_one_line(logs: Path, asked, line: str, tmp_path: Path, capsys) -> None:
    page = tmp_path / "page.html"
    status, out, error = ended(capsys, "esso_osaka_3m", str(logs), *asked, "-o", str(page))
    assert (status, out) == (2, "")
    assert line in error.splitlines()[-1]
    assert not page.exists()
