"""The calibration and its file: what it gives, and what it is held to."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from known_calibration import H, made

from seatrial.belief.bands.calibration import Errors, beside, hardest, load, save
from seatrial.identify import StudyError
from virtual_logs import posterior


@pytest.mark.slow
def test_the_file_gives_the_same_bands(tmp_path: Path) -> None:
    errors = {"day": Errors(math.inf, (0.2, math.inf)), "speed": Errors(0.3, (0.2, 0.4))}
    found, model = replace(made(), errors=errors), tmp_path / "model.toml"
    path = save(found, beside(model))
    assert path.name == "model.bands.json"
    again = load(model, posterior())
    assert again.errors == errors
    assert hardest(again.errors) == "day", "a prediction that blows up is the worst"
    assert again.disturbance == found.disturbance
    assert (again.trials, again.begin, again.share) == (found.trials, "measured", found.share)
    assert again.left.kinds == found.left.kinds
    assert np.isnan(again.left.error).tolist() == np.isnan(found.left.error).tolist()
    t, width = np.array([2.0, 10.0, 30.0]), np.ones((3, 6))
    for kind in ("turning", "zigzag", "spiral"):
        assert again.half(t, width, kind, 0.9) == pytest.approx(found.half(t, width, kind, 0.9), rel=0.03)


@pytest.mark.slow
def test_half_widths_grow_with_the_horizon_and_hold_for_the_kind() -> None:
    found = made()
    half = found.half(H, np.median(found.left.spread, axis=0), "turning", 0.9)
    assert (np.diff(half, axis=0) > 0).all()
    assert half[:, 0] == pytest.approx(half[:, 1], rel=0.3)
    turning = np.array([kind == "turning" for kind in found.left.kinds])
    wide = found.half(H, found.left.spread, "turning", 0.9)[turning]
    assert np.nanmean(np.abs(found.left.error[turning]) <= wide) == pytest.approx(0.9, abs=0.03)
    before = found.half(np.array([0.5, 1.0, 2.5]), 1e-3 * np.ones((3, 6)), "turning", 0.9)
    assert (np.diff(before, axis=0) > 0).all() or found.share == 1.0


@pytest.mark.slow
def test_an_unknown_kind_has_the_widest_bands_and_nothing_holds_beyond_the_horizons() -> None:
    found, width = made(), np.ones((1, 6))
    each = [found.half(np.array([10.0]), width, kind, 0.9) for kind in ("turning", "zigzag", "spiral")]
    assert (each[2] >= np.maximum(each[0], each[1]) * (1 - 1e-9)).all()
    assert np.isnan(found.half(np.array([41.0]), width, "turning", 0.9)).all()
    assert found.reach(0.9) == 40.0
    assert found.reach(0.9, "zigzag") == 20.0
    assert found.reach(0.9, "spiral") == 0.0
    # the eighteen turnings that go so far cannot show 95 %
    assert found.reach(0.95) == 20.0
    # 99 % is of Student's t, and wider
    assert (found.factors(0.99).factor[:, :3] >= found.factors(0.95).factor[:, :3]).all()


@pytest.mark.parametrize("known", [pytest.param(True, marks=pytest.mark.slow), False])
def test_the_spread_of_the_draws_counts_where_it_knows_the_errors(known: bool) -> None:
    assert made(known=known).share == (1.0 if known else 0.0)


@pytest.mark.slow
def test_a_file_of_another_fit_or_none_is_refused(tmp_path: Path) -> None:
    model = tmp_path / "model.toml"
    with pytest.raises(StudyError, match=r"model\.bands\.json is not beside it\); seatrial calibrate MODEL"):
        load(model, posterior())
    path = save(made(), beside(model))
    with pytest.raises(StudyError, match="is of fit digest, the model beside it of fit other"):
        load(model, replace(posterior(), digest="other"))
    with pytest.raises(StudyError, match="another posterior"):
        load(model, posterior(sigma=0.02))
    document = json.loads(path.read_text())
    for key, value, told in (("schema", "seatrial-bands/1", "schema is"), ("noise", [1.0], "shape"),
                             ("left", {**document["left"], "error": [[[1.0] * 6]]}, "shape"),
                             ("share", "x", "share is 'x'; it must be a number")):  # fmt: skip
        path.write_text(json.dumps({**document, key: value}))
        with pytest.raises(StudyError, match=told):
            load(model, posterior())
    path.write_text("{")
    with pytest.raises(StudyError, match="cannot be read"):
        load(model, posterior())
