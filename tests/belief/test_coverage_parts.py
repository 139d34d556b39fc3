"""Coverage against a search of every pair, and its verdicts at their edges."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from seatrial.belief.coverage import Coverage, Reference, columns, coverage, usual
from seatrial.belief.spread import Spread
from seatrial.data import Trial

CHANNELS = ("u", "r")


def trial(name: str, rng: np.random.Generator, rows: int = 60, dt: float = 1.0, **given: Any) -> Trial:
    t = dt * np.arange(rows)
    own = {"u": rng.normal(1.0, 0.5, rows), "r": rng.normal(0.0, 0.02, rows)}
    return Trial(name, t, own | given)


def nearest(points: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Root mean square distance to the five nearest points, and the mean squared offset from them by channel."""
    far, offset = [], []
    for one in at:
        squares = (points - one) ** 2
        five = np.argsort(squares.sum(axis=1))[:5]
        far.append(math.sqrt(squares[five].sum(axis=1).mean()))
        offset.append(squares[five].mean(axis=0))
    return np.array(far), np.array(offset)


@pytest.mark.slow
def test_novelty_is_the_distance_to_the_five_nearest_over_what_one_in_a_hundred_exceeds() -> None:
    rng = np.random.default_rng(3)
    files = [trial(str(k), rng) for k in range(4)]
    found = Reference.of(files, CHANNELS)
    whole = np.concatenate([one.stack(*CHANNELS) for one in files])
    scale = whole.std(axis=0)
    np.testing.assert_allclose(found.scale, scale)
    np.testing.assert_allclose(found.low, whole.min(axis=0))
    np.testing.assert_allclose(found.high, whole.max(axis=0))
    parts = [one.stack(*CHANNELS) / scale for one in files]
    far = [nearest(np.concatenate(parts[:k] + parts[k + 1 :]), part)[0] for k, part in enumerate(parts)]
    limit = np.quantile(np.concatenate(far), 0.99)
    assert found.limit == pytest.approx(limit)
    for name, own in zip("0123", far, strict=True):
        assert found.own[name] == pytest.approx(np.mean(own > limit))
    wild = trial("new", rng, u=rng.normal(2.5, 0.5, 60))
    seen = coverage(found, wild)
    away, offset = nearest(np.concatenate(parts), wild.stack(*CHANNELS) / scale)
    np.testing.assert_allclose(seen.novelty, away / limit)
    novel = away > limit
    assert seen.share == pytest.approx(novel.mean())
    told = offset[novel].sum(axis=0)
    assert seen.telling == pytest.approx(dict(zip(CHANNELS, told / told.sum(), strict=True)))
    beyond = [(wild[n] < whole[:, k].min()) | (wild[n] > whole[:, k].max()) for k, n in enumerate(CHANNELS)]
    assert seen.outside == pytest.approx(dict(zip(CHANNELS, np.mean(beyond, axis=1), strict=True)))
    numbers = seen.numbers()["novelty"]
    assert numbers == pytest.approx({"median": np.median(away) / limit, "largest": away.max() / limit})


def test_one_sample_a_second_stands_for_its_neighbours() -> None:
    rng = np.random.default_rng(4)
    files = [trial(str(k), rng, 200, 0.25) for k in range(3)]
    points = np.concatenate([one.stack(*CHANNELS)[::4] for one in files])
    found = Reference.of(files, CHANNELS)
    np.testing.assert_allclose(np.sort(found.points * found.scale, axis=0), np.sort(points, axis=0))


def test_two_files_are_judged_in_five_stretches_each() -> None:
    rng = np.random.default_rng(5)
    files = [trial(str(k), rng, 50) for k in range(2)]
    found = Reference.of(files, CHANNELS)
    parts = [part / found.scale for one in files for part in np.split(one.stack(*CHANNELS), 5)]
    far = [nearest(np.concatenate(parts[:k] + parts[k + 1 :]), part)[0] for k, part in enumerate(parts)]
    assert found.limit == pytest.approx(np.quantile(np.concatenate(far), 0.99))
    assert set(found.own) == {"0", "1"}


@pytest.mark.parametrize(
    ("share", "verdict"), [(0.04, "inside"), (0.06, "edge"), (0.19, "edge"), (0.21, "leaves"), (0.05, "inside")]
)
def test_verdicts_go_by_the_share_of_novel_samples(share: float, verdict: str) -> None:
    none = np.zeros(3)
    found = Coverage("x", none, none, share, {"u": 0.2, "r": 0.8}, {"u": 0.0, "r": 0.0})
    assert found.verdict == verdict
    assert found.channels == (() if verdict == "inside" else ("r",))


@pytest.mark.parametrize(
    ("telling", "outside", "channels"),
    [((0.2, 0.8), (0.06, 0.0), ("r", "u")), ((0.2, 0.8), (0.04, 0.0), ("r",)), ((0.74, 0.26), (0.0, 0.0), ("u", "r")),
     ((0.76, 0.24), (0.0, 0.0), ("u",))],
)  # fmt: skip
def test_channels_are_named_by_distance_or_by_range(telling: Any, outside: Any, channels: tuple[str, ...]) -> None:
    none = np.zeros(3)
    found = Coverage(
        "x", none, none, 0.5, dict(zip(CHANNELS, telling, strict=True)), dict(zip(CHANNELS, outside, strict=True))
    )
    assert found.channels == channels


def test_the_apparent_wind_is_the_true_wind_and_the_ships_own_velocity() -> None:
    t = np.arange(4.0)
    windy = Trial("w", t, {"u": 2.0 + 0 * t, "v_m": 0.5 + 0 * t, "psi": 0.3 + 0.1 * t, "gamma_T": 1.2 + 0 * t,
                           "U_T": 6.0 + 0 * t, "r": 0 * t, "delta_cmd": 0.1 * t, "n_P": t**2})  # fmt: skip
    ahead = 6.0 * np.cos(1.2 - windy["psi"]) + 2.0
    aside = 6.0 * np.sin(1.2 - windy["psi"]) + 0.5
    assert usual([windy]) == ("u", "v_m", "r", "n_P", "delta", "wind ahead", "wind aside")
    table = columns(windy, ("wind aside", "delta", "wind ahead"))
    np.testing.assert_allclose(table, np.column_stack([aside, 0.1 * t, ahead]))
    calm = Trial("c", t, {name: windy[name] for name in ("u", "r", "psi", "U_T", "n_P")})
    assert usual([windy, calm]) == ("u", "r", "n_P")


@pytest.mark.parametrize(
    ("ratio", "share", "verdict"),
    [(1.7, 0.0, "inside"), (1.8, 0.0, "edge"), (2.9, 0.0, "edge"), (3.1, 0.0, "leaves"), (1.0, 0.1, "edge"),
     (1.0, 0.3, "leaves"), (3.1, 0.1, "leaves"), (1.8, None, "edge"), (1.0, None, "inside")],
)  # fmt: skip
def test_a_spread_is_judged_by_the_worse_of_members_and_samples(
    ratio: float, share: float | None, verdict: str
) -> None:
    """Three times the usual leaves the data, the root of it is the edge."""
    none = np.zeros(3)
    covered = None if share is None else Coverage("x", none, none, share, {"u": 1.0}, {"u": 0.0})
    deviation = np.full((2, 3, 6), 2.0)
    deviation[0, 0, 0] = np.nan
    deviation[1, 2, 1] = 4.0
    found = Spread("x", deviation, 5.0, ratio, covered)
    assert found.verdict == verdict
    numbers = found.numbers()
    assert numbers["deviation"]["x"] == pytest.approx(2.0)
    assert numbers["deviation"]["y"] == pytest.approx(math.sqrt((5 * 4.0 + 16.0) / 6))
    assert (numbers["ratio"], numbers["standardised"]) == (ratio, 5.0)
    assert Spread("x", deviation, math.inf, math.inf, None).numbers()["ratio"] is None
