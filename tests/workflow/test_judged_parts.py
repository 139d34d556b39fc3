"""What a command makes of draws: bands of a criterion, indices put apart, and the loads of a ship at another scale."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seatrial.belief.bands.manoeuvring import Bands
from seatrial.data import Trial
from seatrial.ships.files import load
from seatrial.validate.imo import PASS, Criterion, Source
from seatrial.workflow.asked import Draws
from seatrial.workflow.evidence import drawn, judged
from seatrial.workflow.judging import _loading, scale


def found(values: np.ndarray) -> Any:
    none = np.full(len(values), np.nan)
    return SimpleNamespace(bands=Bands(np.zeros(1), np.zeros((len(values), 1, 6)), {"index": values}, none))


@pytest.mark.parametrize(
    ("unit", "size", "met"),
    [("L", 50.0, 0.70), ("deg", math.radians(1.0), 0.80)],
)
def test_the_band_of_a_criterion_is_that_of_the_draws_that_reach_it_and_its_share_that_of_all(
    unit: str, size: float, met: float
) -> None:
    """Draws of -10 to 79 in the unit of the criterion, and ten that never come so far; the limit is 69.5."""
    values = size * np.concatenate([np.arange(-10.0, 80.0), np.full(10, np.nan)])
    row = Criterion("x", "", 1.0, unit, 69.5, PASS)
    source: Any = Source(SimpleNamespace(), Trial("run", np.zeros(1), {}), "index")  # type: ignore[arg-type]
    asked: Any = SimpleNamespace(level=0.8)
    band = judged._band(row, source, found(values), asked, 50.0)
    assert (band.low, band.high) == pytest.approx(np.quantile(np.arange(-10.0, 80.0), (0.1, 0.9)))
    assert band.met == pytest.approx(met)
    assert band.draws == 100
    missing = judged._band(row, Source(source.policy, source.run, "none"), found(values), asked, 50.0)
    assert missing.met == 0.0
    assert math.isnan(missing.low)


def test_draws_that_failed_are_told_once_by_the_run_that_lost_most() -> None:
    kept: dict[str, None] = {}
    for line in ("4 of 200 draws blew up", "drawn from samples", "12 of 200 draws blew up", "2 of 200 draws blew up",
                 "2 of 100 draws blew up"):  # fmt: skip
        judged._kept(kept, line)
    assert list(kept) == ["drawn from samples", "12 of 200 draws blew up", "2 of 100 draws blew up"]


def test_indices_are_put_apart_about_the_fitted_run_and_keep_their_sign() -> None:
    values = {"a": np.array([1.0, 2.0, 4.0]), "b": np.array([-1.0, 2.0, 3.0]), "c": np.array([1.0, math.nan, 5.0])}
    made = drawn._apart(values, {"a": 2.0, "b": 1.0}, 3.0)
    np.testing.assert_allclose(made["a"], [0.0, 2.0, 8.0])  # 2 - 3 is no length
    np.testing.assert_allclose(made["b"], [-5.0, 4.0, 7.0])
    np.testing.assert_allclose(made["c"], [0.0, math.nan, 9.0])  # about the median of what was reached


def test_indices_of_a_draw_are_read_until_it_fails() -> None:
    """An index that is the last place north: of a draw that fails, that of its last row."""
    t = np.arange(5.0)
    plain = Trial("run", t, dict.fromkeys(("x", "y", "psi", "u", "v_m", "r", "delta"), 0.0 * t))
    tracks = np.zeros((2, 5, 6))
    tracks[0, :, 0], tracks[1, :, 0] = 10.0 * t, 20.0 * t
    tracks[1, 3:] = math.nan
    rows = np.dstack([np.zeros((2, 5, 6)), np.tile(0.3 * t, (2, 1))])
    runs: Any = SimpleNamespace(stored=("x", "y", "psi", "u", "v_m", "r", "delta"), drawn=rows)
    seen: list[Trial] = []

    def indices(run: Trial, L_pp: float) -> Any:
        seen.append(run)
        return {"north": SimpleNamespace(value=float(run["x"][-1]), unit="m")}

    policy: Any = SimpleNamespace(indices=indices)
    made = drawn._figures(policy, 50.0, plain, runs, tracks)
    np.testing.assert_allclose(made["north"], [40.0, 40.0])
    np.testing.assert_allclose(seen[0]["delta"], 0.3 * t)
    assert [len(run) for run in seen] == [5, 3]


@pytest.mark.slow
def test_a_ship_scaled_by_froude_alone_is_loaded_as_it_was() -> None:
    """Without friction everything is alike; with it the ship of a model needs less thrust and has a slower race."""
    alone = scale("kvlcc2_l7", 320.0, friction=False)
    assert alone.before is not None
    assert alone.after is not None
    assert alone.after.thrust == pytest.approx(alone.before.thrust, rel=1e-6)
    assert alone.after.rudder == pytest.approx(alone.before.rudder, rel=1e-6)
    assert alone.after.n_P == pytest.approx(alone.before.n_P * math.sqrt(7.0 / 320.0), rel=1e-6)
    rough = scale("kvlcc2_l7", 320.0)
    assert rough.after is not None
    assert rough.after.thrust < alone.after.thrust
    # the thrust less its deduction is the resistance: (1 - t_P) T = R_0' u'^2 in units of 0.5 rho L d U^2
    ship = load("kvlcc2_l7")
    model: Any = ship.model
    assert (1.0 - model.propeller.t_P) * alone.before.thrust == pytest.approx(model.hull.R_0, rel=0.02)
    assert _loading(load("mariner_nomoto")) is None


@pytest.mark.parametrize(("level", "least"), [(90.0, 20), (95.0, 40), (80.0, 10)])
def test_a_band_of_requirements_takes_draws_beyond_its_edges(level: float, least: int) -> None:
    """One draw on each side at least: 2 / (1 - level)."""
    with pytest.raises(Exception, match=f"take {least} to") as told:
        judged.requirements_with_bands("nothing", "berthing", Draws(level, least - 1), {})
    assert "--draws" in str(told.value)
    with pytest.raises(Exception, match="nothing"):
        judged.requirements_with_bands("nothing", "berthing", Draws(level, least), {})
