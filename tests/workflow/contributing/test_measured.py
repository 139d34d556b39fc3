"""Figures of ships: those that logs gave are what the logs say, and what is unverified is told once, first."""

from __future__ import annotations

import math
import os
from pathlib import Path

import numpy as np
import pytest

from seatrial.cli.app import main
from seatrial.data.importing import import_log
from seatrial.manoeuvres.told import manoeuvre
from seatrial.ships.files import library, load
from seatrial.workflow.contributing.published import Published, published, reproduce, standing, warned
from seatrial.workflow.data import read_trials

DATA = Path(os.environ.get("SEATRIAL_DATA", Path(__file__).parents[4] / "shared" / "data"))
MEASURED = [name for name in library() if standing(load(name)).state == "measured"]
TANK = math.sqrt(320.0 / 7.0)
needs = pytest.mark.skipif(not DATA.is_dir(), reason="public data, see docs/datasets.md")


def of(name: str, by: str = "") -> list[Published]:
    return [one for one in published(load(name)) if one.by == by or (not by and one.by != "code")]


def circle(path: Path) -> tuple[float, float]:
    """Rudder [deg] and diameter of the last whole turn [3 m], its path over pi; NaN where none is whole."""
    (t,) = read_trials([path])
    psi, U = np.unwrap(t["psi"]), np.hypot(t["u"], t["v_m"])
    delta = float(np.median(t["delta"][t.t.size // 3 :]))
    left = math.copysign(1.0, delta) * (psi[-1] - psi) <= 2.0 * math.pi
    begin = int(np.flatnonzero(left)[0])
    return math.degrees(delta), float(np.trapezoid(U[begin:], t.t[begin:])) / math.pi / 3.0 if begin else math.nan


@needs
@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in MEASURED if "kvlcc2" in name])
def test_figures_of_the_zigzags_are_those_of_the_logs(name: str, tmp_path: Path) -> None:
    import_log("simman", DATA / "kvlcc2_marin_simman2008", tmp_path)
    logs = {path.stem: read_trials([path])[0] for path in tmp_path.glob("*.csv")}
    assert len(of(name, "model test")) >= 7
    for one in of(name, "model test"):
        (run,) = [log for log in logs.values() if (kind := manoeuvre(log)) is not None
                  and math.degrees(kind.delta) == pytest.approx(one.settings["rudder"])
                  and (kind.side > 0) == (one.settings["side"] == "starboard")]  # fmt: skip
        found = manoeuvre(run).indices(run, 320.0)[one.index].value  # type: ignore[union-attr]
        carried = 1.0 / TANK if one.unit == "s" and load(name).L_pp == 7.0 else 1.0
        assert one.value == pytest.approx(carried * found / (320.0 if one.lengths else 1.0), rel=2e-3), one


@needs
@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in MEASURED if "esso_osaka" in name])
def test_figures_of_the_circles_are_those_of_the_logs(name: str, tmp_path: Path) -> None:
    import_log("frt-esso", DATA / "esso_osaka_frt" / "data" / "turning", tmp_path)
    every = [circle(path) for path in sorted(tmp_path.glob("turn_[0-9]*.csv"))]
    for one in of(name, "model test"):
        wanted = one.settings["rudder"] * (1.0 if one.settings["side"] == "starboard" else -1.0)
        some = [diameter for delta, diameter in every if abs(delta - wanted) < 1.0 and not math.isnan(diameter)]
        assert one.value == pytest.approx(np.mean(some), abs=0.006), (one, some)


@pytest.mark.slow
@pytest.mark.parametrize("name", MEASURED)
def test_the_model_misses_a_measurement_by_no_more_than_the_file_says_and_says_no_more_than_that(name: str) -> None:
    """`within` is the miss rounded up to 5 %: a model that came nearer, or went off, changes its word."""
    for one in reproduce(load(name), tuple(of(name))):
        assert one.kept, one
        assert abs(one.ratio - 1.0) > one.published.within - 0.061, one


def test_code_is_not_a_measurement() -> None:
    assert standing(load("kcs")).state == "verified code"
    assert standing(load("kvlcc2_l7")).state == "measured"
    assert standing(load("kvlcc2_l7")).within == pytest.approx(0.45)
    assert standing(load("zeefakkel")).state == "unverified"
    assert standing(load("zeefakkel")).told == "unverified"
    assert standing(load("kcs")).told == "verified code: 6 within 8 %"
    assert standing(load("esso_osaka")).told == "measured: 4 within 45 %"
    assert len(MEASURED) >= 11


def test_every_ship_has_a_state_and_why() -> None:
    for name in library():
        found = standing(load(name))
        assert len(found.why) > 10
        assert (found.state == "unverified") == (found.figures == 0) == math.isnan(found.within)


def test_a_command_on_an_unverified_ship_begins_with_its_reason(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["show", "esso_osaka_3m_hybrid", "--json"]) == 0
    first, *rest = capsys.readouterr().err.splitlines()
    assert first.startswith("esso_osaka_3m_hybrid is unverified in part: its residual is zero")
    assert len(first) < 120
    assert not any("unverified" in line for line in rest)
    assert main(["show", "kcs", "--json"]) == 0
    assert "unverified" not in capsys.readouterr().err
    assert main(["simulate", "esso_osaka_3m_hybrid", "no_such"]) == 2  # a request that is wrong is one line
    said = capsys.readouterr().err
    assert said.startswith("error: ")
    assert said.count("\n") == 1


def test_files_of_ones_own_and_studies_are_looked_at(tmp_path: Path) -> None:
    own = tmp_path / "mine.toml"
    own.write_text('schema = "seatrial-ship/1"\nlike = "kvlcc2_l7"\n', encoding="utf-8")
    study = tmp_path / "study.toml"
    study.write_text('schema = "seatrial-study/1"\nship = "mine.toml"\n', encoding="utf-8")
    for path in (own, study):
        assert (warned(path) or "").startswith("mine is unverified: its file names no figure")
    own.write_text(
        'schema = "seatrial-ship/1"\nlike = "kvlcc2_l7"\n[notes.provenance]\nstudy = "x"\n', encoding="utf-8"
    )
    assert warned(own) is None  # a fit tells how good it is itself
    assert warned(tmp_path / "none.toml") is None
    assert warned("no_such_ship") is None


def test_every_unverified_reason_is_short() -> None:
    for name in library():
        line = warned(name)
        ship = load(name)
        assert (line is None) == (standing(ship).state != "unverified" and "unverified" not in ship.notes)
        assert len(line or "") < 160, line
