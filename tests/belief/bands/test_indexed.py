"""Factors of indices from those of left-out manoeuvres."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from calibrated_run import calibrated
from fitted_run import saved, trial
from seatrial.belief.bands.calibration import load, save
from seatrial.belief.bands.indexing.scores import LeftIndices
from seatrial.belief.reading import posterior
from seatrial.manoeuvres.told import seen
from seatrial.workflow.asked import Bands, Orders
from seatrial.workflow.evidence.bands import simulate_with_bands

NAMES = (("turning", "advance"), ("turning", "transfer"), ("zigzag", "first_overshoot"))
SIZES = {"advance": 1.0, "transfer": 3.0, "first_overshoot": 0.5}


def made(recordings: int, seed: int = 0) -> LeftIndices:
    """Errors that are normal, so many spreads large by index: every recording has one of each."""
    rng = np.random.default_rng(seed)
    rows = [(f"t{k}", kind, name) for k in range(recordings) for kind, name in NAMES]
    spread = rng.uniform(1.0, 2.0, len(rows))
    error = np.array([SIZES[name] for _, _, name in rows]) * spread * rng.standard_normal(len(rows))
    groups, kinds, names = zip(*rows, strict=True)
    return LeftIndices(groups, kinds, names, error, spread)


@pytest.mark.parametrize(("kind", "name"), NAMES)
def test_each_index_has_the_factor_of_its_own_errors(kind: str, name: str) -> None:
    assert made(120).factor(kind, name, 0.9) == pytest.approx(1.645 * SIZES[name], rel=0.15)


def test_indices_that_were_not_left_out_or_too_seldom_have_none() -> None:
    assert made(120).factor("turning", "tactical_diameter", 0.9) is None
    assert made(120).factor("zigzag", "advance", 0.9) is None
    assert made(18).factor("turning", "advance", 0.95) is None, "18 recordings do not show 95 %, whatever their indices"
    assert made(19).factor("turning", "advance", 0.95) is not None


@pytest.mark.slow
def test_draws_keep_their_order_and_get_the_width_of_the_factor() -> None:
    found, rng = made(120), np.random.default_rng(1)
    values = 10.0 + rng.exponential(1.0, 2000)
    values[:5] = np.nan
    moved = found.apart("turning", "transfer", values, 11.0, 0.9)
    assert moved is not None
    assert np.isnan(moved[:5]).all()
    assert (np.argsort(moved[5:]) == np.argsort(values[5:])).all()
    low, high = np.quantile(moved[5:], (0.05, 0.95))
    factor = found.factor("turning", "transfer", 0.9)
    assert factor is not None
    assert 0.5 * (high - low) == pytest.approx(factor * np.std(values[5:]), rel=0.01)
    assert 0.5 * (high + low) == pytest.approx(11.0, abs=0.02)


@pytest.mark.slow
def test_they_are_kept_beside_the_model_and_bands_stand_on_them(tmp_path: Path) -> None:
    run = saved(tmp_path / "run", [trial(35), trial(20, 20)])
    path = calibrated(run)
    found = load(run, posterior(run))
    assert found.indices is None
    widths: list[float] = []
    for size in (1.0, 2.0):
        given = made(40)
        save(replace(found, indices=replace(given, error=size * given.error)), path)
        again = load(run, posterior(run)).indices
        assert again is not None
        assert again.names == given.names
        np.testing.assert_allclose(again.error, size * given.error, rtol=1e-3)
        sailed = simulate_with_bands(str(run), "turning", Bands(90.0, 300), orders=Orders(35.0))
        _, low, high = (one.value for one in sailed.indices["transfer"])
        widths.append(high - low)
        assert any(line.startswith("advance, transfer: calibrated on the same") for line in sailed.sailed.caveats)
        assert any("tactical diameter" in line and "no left-out manoeuvre" in line for line in sailed.sailed.caveats)
    assert widths[1] == pytest.approx(2.0 * widths[0], rel=1e-3)  # four digits are kept


def test_the_manoeuvre_of_a_trial_is_seen_in_its_data_where_nobody_told_it() -> None:
    for one in (trial(35, side=-1), trial(20, 20)):
        told, blind = seen(one), seen(replace(one, meta={}))
        assert type(told) is type(blind)
        assert told is not None
        assert blind is not None
        assert float(blind.delta) == pytest.approx(float(told.delta), abs=0.02)
        assert float(blind.n_P) == pytest.approx(float(told.n_P), rel=1e-3)
