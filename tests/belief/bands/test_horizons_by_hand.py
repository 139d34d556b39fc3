"""At which times after a start errors are taken: by the spans of recordings, the ship's clock and the step of a log."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seatrial.belief.bands import calibrating
from seatrial.belief.bands.calibrating import horizons_of
from seatrial.core.errors import RequestError


@pytest.fixture
def spans(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Recordings of parts of so many seconds, at rows of a step."""

    def of(*groups: tuple[float, ...], dt: float = 1.0) -> list[Any]:
        made = [[SimpleNamespace(duration=span) for span in group] for group in groups]
        monkeypatch.setattr(calibrating, "recordings", lambda trials: made)
        monkeypatch.setattr(calibrating, "step_of", lambda trials: dt)
        return [one for group in made for one in group]

    return of


def test_the_longest_part_of_a_recording_is_its_span_and_as_many_reach_the_last_as_are_needed(spans: Any) -> None:
    """Of parts of 100 and 40 s and one of 60 s, both recordings reach 60 s: 7 s are .7 L/U, 1.4 times from one on."""
    found = horizons_of(spans((40.0, 100.0), (60.0,)), 10.0, None)
    assert found.tolist() == [7.0, 14.0, 21.0, 28.0, 42.0]
    many = spans(*((float(k),) for k in range(100, 75, -1)))  # 25 recordings, of which 19 are needed
    assert horizons_of(many, 10.0, None)[-1] <= 82.0
    assert horizons_of(many, 10.0, 82.0).tolist() == horizons_of(many, 10.0, None).tolist()


def test_no_horizon_is_longer_than_the_longest_recording(spans: Any) -> None:
    assert horizons_of(spans((40.0,), (90.0,)), 10.0, 300.0)[-1] <= 90.0
    assert horizons_of(spans((40.0,), (90.0,)), 10.0, 300.0).tolist() == horizons_of(
        spans((40.0,), (90.0,)), 10.0, 90.0).tolist()  # fmt: skip


def test_the_first_horizon_is_an_eighth_of_a_short_span_and_a_row_at_least(spans: Any) -> None:
    assert horizons_of(spans((40.0,), (40.0,)), 10.0, None)[0] == 5.0
    assert horizons_of(spans((40.0,), (40.0,)), 1.0, None)[0] == 1.0
    assert horizons_of(spans((40.0,), (40.0,), dt=4.0), 10.0, None)[0] == 4.0


def test_horizons_are_multiples_of_ten_rows_where_the_first_is_longer(spans: Any) -> None:
    found = horizons_of(spans((400.0,), (400.0,), dt=0.6), 20.0, None)
    assert found[0] == pytest.approx(12.0)  # 14 s to the next six
    ratio = found / found[0]
    np.testing.assert_allclose(ratio, np.round(ratio))
    assert found[-1] <= 400.0
    assert (np.diff(found) > 0.0).all()
    assert 1.2 < (ratio[-1] / ratio[-3]) ** 0.5 < 1.6


def test_what_is_asked_for_is_reached_and_one_recording_is_too_few(spans: Any) -> None:
    assert horizons_of(spans((500.0,), (500.0,)), 10.0, 56.0)[-1] == 56.0
    with pytest.raises(RequestError):
        horizons_of(spans((500.0, 400.0)), 10.0, None)
