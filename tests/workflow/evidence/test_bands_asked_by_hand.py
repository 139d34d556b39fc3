"""What is handed on to make bands of predictions and of manoeuvres, and what is made of them."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seatrial.core.errors import RequestError
from seatrial.data import Trial
from seatrial.models import STATES
from seatrial.workflow.asked import Bands, Predicting
from seatrial.workflow.evidence import drawn, fans, judged
from seatrial.workflow.evidence.drawn import Drawing
from seatrial.workflow.evidence.fans import Banding


def run_of(seconds: float = 100.0, **meta: Any) -> Trial:
    t = np.arange(0.0, seconds + 1.0)
    return Trial("run", t, dict.fromkeys(STATES, 0.0 * t), {}, meta)


def posterior(**given: Any) -> Any:
    usual = {"names": ("a", "b"), "covered": {"u": (0.0, 5.0)}, "power": None, "samples": None, "fitted": True,
             "free": ("a", "b"), "covariance": np.eye(2), "grounds": SimpleNamespace(kinds=("turning",)), "digest": "d",
             "ship": SimpleNamespace(name="s", model=SimpleNamespace(controls=("delta",)))}  # fmt: skip
    return SimpleNamespace(**{**usual, **given})


# --- predictions with bands ---


@pytest.fixture
def read(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    asked: dict[str, Any] = {"held": posterior(), "loaded": [], "levels": []}
    found = SimpleNamespace(disturbance="what pushes", noise="of instruments", doubt="of starts", law="its law",
                            factors=asked["levels"].append)  # fmt: skip
    monkeypatch.setattr(fans, "posterior", lambda model: asked["held"])
    monkeypatch.setattr(fans, "load", lambda model, held, begin=None: asked["loaded"].append((model, begin)) or found)
    monkeypatch.setattr(fans, "begin_of", lambda history, first: ("begun", history, first))
    monkeypatch.setattr(fans.Filter, "of", staticmethod(lambda *given: given))
    return asked


def test_bands_of_predictions_are_of_a_level_and_a_thousand_draws(read: dict[str, Any]) -> None:
    made = Banding.of("m", Bands(level=90.0))
    assert (made.level, made.draws, made.extrapolate, made.filters, made.plain) == (0.9, 1000, False, None, None)
    assert read["loaded"] == [("m", ("begun", None, None))]
    assert read["levels"] == [0.9]
    carried = Banding.of("m", Bands(level=90.0, extrapolate=True), Predicting(history=30.0))
    assert carried.extrapolate
    assert carried.filters == (read["held"].ship, "what pushes", "of instruments", 30.0, "of starts")
    assert read["loaded"][1:] == [("m", ("begun", 30.0, None)), ("m", None)]
    with pytest.raises(RequestError, match="leave --smooth-start out"):
        Banding.of("m", Bands(level=90.0), Predicting(smooth_start=3.0))
    with pytest.raises(RequestError, match="--fit-first already"):
        Banding.of("m", Bands(level=90.0), Predicting(history=30.0, fit_first=20.0))
    assert Banding.of("m", Bands(level=90.0), Predicting(fit_first=20.0)).filters is None


def test_a_prediction_is_judged_on_its_own_rows_with_the_controls_of_the_trial(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rows are those of the prediction's times; states are predicted, the rudder is the measured one."""
    t = np.arange(10.0)
    trial = Trial("t", t, {**dict.fromkeys(STATES, 0.0 * t), "delta": 0.1 * t})
    predicted = trial.rows(slice(4, 8)).having(u=np.full(4, 9.0))
    seen: list[Trial] = []
    grounds = SimpleNamespace(kinds=("turning",), beyond=lambda run, controls: seen.append(run) or ["u"])
    monkeypatch.setattr(fans, "reached", lambda found: found[0].upper())
    made = Banding(posterior(grounds=grounds), SimpleNamespace(), 0.95, 100, False)  # type: ignore[arg-type]
    with pytest.raises(RequestError, match="t leaves the trials of the fit: U; nothing is known"):
        made.refuse(trial, predicted)
    (run,) = seen
    np.testing.assert_allclose(run["delta"], 0.1 * np.arange(4, 8))
    np.testing.assert_allclose(run["u"], 9.0)
    Banding(posterior(), SimpleNamespace(), 0.95, 100, True).refuse(trial, predicted)  # type: ignore[arg-type]
    assert len(seen) == 1


@pytest.mark.parametrize(("restart", "longest"), [(None, 60.0), (20.0, 20.0), (90.0, 80.0)])
def test_coverage_is_counted_at_shares_of_the_reach_or_the_restart(
    monkeypatch: pytest.MonkeyPatch, restart: float | None, longest: float
) -> None:
    """Of bands that hold for 80 s, on runs of 40 and 60 s."""
    found = SimpleNamespace(reach=lambda level: 80.0, left=SimpleNamespace(groups=("a", "b", "a")))
    asked = Banding(posterior(), found, 0.95, 100, False)  # type: ignore[arg-type]
    made: Any = [(SimpleNamespace(since=np.array([0.0, span])), f"t{span:g}") for span in (40.0, 60.0)]
    monkeypatch.setattr(fans, "windows", lambda one, trial, horizons: (trial, tuple(horizons)))
    monkeypatch.setattr(fans, "held", tuple)
    told = fans.judged(made, asked, restart)
    assert told is not None
    assert told.recordings == 2
    assert told.rows == tuple((name, pytest.approx((0.1 * longest, 0.5 * longest, longest))) for name in ("t40", "t60"))
    monkeypatch.setattr(fans, "held", lambda rows: ())
    assert fans.judged(made, asked, restart) is None


# --- draws of a manoeuvre ---


@pytest.fixture
def beside(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> dict[str, Any]:
    asked: dict[str, Any] = {"held": posterior(), "found": None, "levels": []}
    (tmp_path / "there").touch()
    monkeypatch.setattr(drawn, "drawn_from", lambda model: asked["held"])
    monkeypatch.setattr(drawn, "beside", lambda model: tmp_path / ("there" if asked["found"] else "gone"))
    monkeypatch.setattr(drawn, "load", lambda model, held: asked["found"])
    monkeypatch.setattr(drawn, "read_summary", lambda folder: SimpleNamespace(explained=False))
    return asked


@pytest.mark.parametrize(("power", "level", "kept"), [(None, 95.0, True), (None, 90.0, True), ("wide", 90.0, True),
                                                      ("wide", 95.0, False)])  # fmt: skip
def test_a_calibration_of_too_few_recordings_leaves_a_level_to_the_widened_posterior(
    beside: dict[str, Any], power: Any, level: float, kept: bool
) -> None:
    beside["found"] = SimpleNamespace(power=power, level=0.9, factors=beside["levels"].append)
    found = Drawing.of("m", Bands(level=level))
    assert (found.found is not None) is kept
    assert beside["levels"] == ([0.01 * level] if kept else [])
    assert found.explained is False


# --- criteria and requirements by draws ---


def test_a_criterion_is_sailed_a_third_longer_by_every_draw(monkeypatch: pytest.MonkeyPatch) -> None:
    """30 percent, as some draws are slower than the fitted numbers."""
    sailed: list[Any] = []
    monkeypatch.setattr(judged, "simulate", lambda ship, policy, speed, duration: (ship, policy, speed, duration))
    held = posterior()
    asked: Any = SimpleNamespace(refusal=lambda run: "", held=held,
                                 sail=lambda *given, **how: sailed.append((given, how)) or "found")  # fmt: skip
    source: Any = SimpleNamespace(run=run_of(100.0), policy="a turn")
    assert judged._sailed(asked, SimpleNamespace(speed=7.0), source) == "found"  # type: ignore[arg-type]
    ((ship, policy, run), how) = sailed[0]
    assert (ship, policy) == (held.ship, "a turn")
    assert run == (held.ship, "a turn", 7.0, pytest.approx(130.0))
    assert (how["speed"], how["dt"]) == (7.0, 1.0)
    asked.held = posterior(fitted=False)  # draws of an estimate differ by more
    judged._sailed(asked, SimpleNamespace(speed=7.0), source)  # type: ignore[arg-type]
    assert sailed[1][0][2][3] == pytest.approx(250.0)
    asked.refusal = lambda run: "no"
    assert judged._sailed(asked, SimpleNamespace(speed=7.0), source) == "no"  # type: ignore[arg-type]


