"""What is drawn of a trial, and what is cut out of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from seatrial.core.errors import RequestError
from seatrial.data import Trial
from seatrial.data.prepare import mended, read_steps
from seatrial.data.trialfile import write_trials
from seatrial.desk.view import cut, drawn


def trial(rows: int) -> Trial:
    t = np.arange(rows) * 0.1
    psi = np.radians(30.0) * np.sin(0.05 * t)
    u = np.where((t > 20.0) & (t < 30.0), np.nan, 2.0)
    channels = {"x": 2.0 * t, "y": -t, "psi": psi, "u": u, "v_m": 0.0 * t, "r": np.gradient(psi, t), "n_P": 5.0 + 0 * t}
    return Trial("run", t, channels)


def test_angles_are_degrees_gaps_are_null_and_long_trials_are_thinned(tmp_path: Path) -> None:
    write_trials((trial(3500),), tmp_path)
    found = drawn(tmp_path / "run.csv")
    by_name = {one["name"]: one for one in found["channels"]}
    assert found["rows"] == 3500
    assert len(found["t"]) == 1750  # every second row: at most 3000 are drawn
    assert found["t"][1] == pytest.approx(0.2)
    assert (by_name["psi"]["unit"], by_name["r"]["unit"], by_name["u"]["unit"]) == ("°", "°/s", "m/s")
    assert max(by_name["psi"]["values"]) == pytest.approx(30.0, abs=0.01)
    assert max(by_name["r"]["values"]) == pytest.approx(30.0 * 0.05, abs=0.01)  # the amplitude of the derivative
    gap = [t for t, value in zip(found["t"], by_name["u"]["values"], strict=True) if value is None]
    assert 20.0 < min(gap) < 20.4
    assert 29.6 < max(gap) < 30.0


def test_an_instrument_slower_than_the_rows_is_drawn_on_lines_and_its_gaps_are_gaps(tmp_path: Path) -> None:
    """A fix in every tenth row, none of them in one that is drawn; the course, which turns over north, stands."""
    t = np.arange(3500) * 0.1
    x = np.where((np.arange(3500) % 10 == 1) & ~((t > 100.0) & (t < 120.0)), 2.0 * t, np.nan)
    course = np.where(np.isfinite(x), np.where(np.arange(3500) % 20 == 1, 0.1, 6.2), np.nan)
    write_trials((Trial("run", t, {"x": x, "gamma_G": course, "psi": 0.01 * t}),), tmp_path)
    found = drawn(tmp_path / "run.csv")
    by_name = {one["name"]: one["values"] for one in found["channels"]}
    pairs = [(t, value) for t, value in zip(found["t"], by_name["x"], strict=True) if value is not None]
    assert len(pairs) > 1500
    np.testing.assert_allclose([value for _, value in pairs], [2.0 * t for t, _ in pairs], atol=1e-9)
    gone = [t for t, value in zip(found["t"], by_name["x"], strict=True) if value is None and 1.0 < t < 349.0]
    assert 99.0 < min(gone) < 101.0
    assert 119.0 < max(gone) < 121.0
    assert {round(one, 1) for one in by_name["gamma_G"] if one is not None} == {5.7, 355.2}


def test_a_short_trial_is_drawn_whole(tmp_path: Path) -> None:
    write_trials((trial(3000),), tmp_path)
    assert drawn(tmp_path / "run.csv")["t"] == pytest.approx(trial(3000).t.tolist())


def test_what_is_cut_out_is_what_was_chosen(tmp_path: Path) -> None:
    cut(tmp_path / "cuts.toml", "run", [(40.0, 50.0), (0.0, 5.0)])
    parts = mended(trial(1000), read_steps(tmp_path / "cuts.toml"))
    assert [part.name for part in parts] == ["run_1", "run_2"]
    assert parts[0].duration == pytest.approx(34.8)  # from 5.1 to 39.9 s
    assert parts[1].duration == pytest.approx(49.8)  # from 50.1 to 99.9 s
    other = mended(Trial("other", trial(1000).t, trial(1000).channels), read_steps(tmp_path / "cuts.toml"))
    assert len(other[0]) == 1000


@pytest.mark.parametrize("stretches", [[], [(5.0, 5.0)], [(9.0, 2.0)], [(0.0, 1.0), (3.0, 2.0)]])
def test_no_stretch_and_one_that_ends_first_are_refused(tmp_path: Path, stretches: list[tuple[float, float]]) -> None:
    with pytest.raises(RequestError):
        cut(tmp_path / "cuts.toml", "run", stretches)
    assert not (tmp_path / "cuts.toml").exists()
