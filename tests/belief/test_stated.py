"""What an estimated ship states of its numbers is drawn from: each by itself, within its range, until a fit."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from seatrial.belief.reading import drawn_from, stated
from seatrial.core.parameters import read, specs
from seatrial.identify import StudyError
from seatrial.ships.estimate import estimate
from seatrial.ships.files import load, save
from seatrial.ships.scaling import scale

KCS = Path(__file__).parents[2] / "examples" / "particulars" / "kcs.toml"


def test_every_number_with_a_sigma_is_drawn_about_its_value(tmp_path: Path) -> None:
    made = estimate(KCS)
    held = drawn_from(save(made.ship, tmp_path / "ship.toml"))
    assert not held.fitted
    said = {n.path for n in made.numbers if n.sigma}
    assert set(held.names) == said
    sigma = np.sqrt(np.diag(held.covariance))
    assert held.covariance == pytest.approx(np.diag(sigma**2))
    for path, value, one in zip(held.names, held.mean, sigma, strict=True):
        assert value == float(read(made.ship.model, path))
        assert one == made.ship.entries[path].sigma
    # A primed number is drawn in the unit of the model: Y_v' as printed, m_y' as a mass.
    of = dict(zip(held.names, sigma.tolist(), strict=True))
    own = {n.path: n for n in made.numbers}
    assert of["hull.Y_v"] == own["hull.Y_v"].sigma
    assert of["body.m_y"] == pytest.approx((own["body.m_y"].sigma or 0.0) * 0.5 * 1025.0 * 230.0**2 * 10.8)


def test_draws_have_the_stated_mean_and_sigma_and_stay_within_physical_ranges() -> None:
    held = stated(estimate(KCS).ship)
    assert held is not None
    drawn = held.draws(4000, 7)
    known, sigma = specs(held.ship.model), np.sqrt(np.diag(held.covariance))
    low, high = (np.array([getattr(known[path], end) for path in held.names]) for end in ("low", "high"))
    assert ((drawn >= low) & (drawn <= high)).all()
    open_ = (held.mean - low > 4.0 * sigma) & (high - held.mean > 4.0 * sigma)
    assert open_.sum() > 20
    z = (drawn.mean(axis=0) - held.mean) / sigma * np.sqrt(4000.0)
    assert np.abs(z[open_]).max() < 4.0
    assert drawn.std(axis=0)[open_] == pytest.approx(sigma[open_], rel=0.06)
    together = np.corrcoef(drawn.T[open_]) - np.eye(int(open_.sum()))
    assert np.abs(together).max() < 0.08


def test_what_is_no_estimate_or_was_fitted_states_nothing(tmp_path: Path) -> None:
    ship = estimate(KCS).ship
    assert stated(load("kvlcc2")) is None
    assert stated(replace(ship, notes={**ship.notes, "provenance": {"digest": "1"}})) is None
    assert stated(scale(ship, 100.0).ship) is None
    exact = {path: replace(entry, sigma=None) for path, entry in ship.entries.items()}
    assert stated(replace(ship, entries=exact)) is None
    with pytest.raises(StudyError, match="no posterior"):
        drawn_from(save(load("kvlcc2"), tmp_path / "copy.toml"))
