"""What fitness reads off a log, on logs whose answer is known in closed form."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from seatrial.data import Trial
from seatrial.ships.files import load
from seatrial.validate import fitness
from seatrial.validate.fitness import CONDITIONS, FEWEST, FIT, NOT_FIT, OPEN, SIZE, Fitness, Found, Limit

SHIP = load("esso_osaka_3m")
L, U = SHIP.L_pp, SHIP.speed
LIMIT = Limit("x", "an error", "position", 1.0, "L", "a test")
FROUDE = math.sqrt(9.81 * L)


def log(seconds: float = 60.0, dt: float = 0.5, **given: Any) -> Trial:
    """A log of a ship on a straight course at the approach speed, but for what is given as a function of time."""
    t = np.arange(0.0, seconds + 0.5 * dt, dt)
    usual = dict.fromkeys(("y", "psi", "v_m", "r", "delta"), 0.0 * t) | {"u": 0.0 * t + U, "n_P": 0.0 * t + 10.0}
    channels = usual | {name: f(t) + 0.0 * t if callable(f) else f + 0.0 * t for name, f in given.items()}
    speed = np.concatenate([[0.0], 0.5 * np.diff(t) * (channels["u"][1:] + channels["u"][:-1])])
    return Trial("made", t, {"x": np.cumsum(speed)} | channels)


@pytest.mark.slow
def test_the_interval_is_that_of_the_mean_square_of_many_trials() -> None:
    """Of many trials, the logarithm of the root mean square is normal: half the relative spread of the mean square."""
    rng = np.random.default_rng(4)
    for each in (1, 7):
        errors = [tuple(row) for row in rng.normal(0.0, 0.3, (400, each))]
        value, low, high = fitness.interval(errors)
        squares = np.sum(np.square(errors), axis=1)
        assert value == pytest.approx(SIZE * math.sqrt(squares.sum() / (400 * each)))
        half = 1.96 * 0.5 * squares.std(ddof=1) / math.sqrt(400) / squares.mean()
        assert math.log(high / value) == pytest.approx(half, rel=0.15)
        assert math.log(value / low) == pytest.approx(half, rel=0.15)
    narrow = fitness.interval(errors, level=0.5)
    assert math.log(narrow[2] / narrow[1]) == pytest.approx(2 * half * 0.6745 / 1.96, rel=0.15)


def test_trials_count_by_their_windows_and_equal_ones_leave_no_doubt() -> None:
    errors = [(3.0,), (1.0, 1.0, 1.0)]
    assert fitness.interval(errors)[0] == pytest.approx(SIZE * math.sqrt(12.0 / 4.0))
    value, low, high = fitness.interval([(0.2, 0.4)] * 8)
    assert low == pytest.approx(value, rel=1e-6)
    assert high == pytest.approx(value, rel=1e-6)
    assert fitness.interval([(0.0,)] * 3) == (0.0, 0.0, 0.0)
    assert fitness.interval([(math.inf,), (1.0,)]) == (math.inf,) * 3


def test_two_trials_have_students_interval_at_least_and_twice_at_most() -> None:
    """t of one degree of freedom at 95 % is 12.706; the deviation of the logarithm is that of two mean squares."""
    value, low, high = fitness.interval([(1.0,), (2.0,)])
    own = 0.5 * math.sqrt(2.0 * 2 * 1.5**2) / 5.0
    for side in (math.log(high / value), math.log(value / low)):
        assert 12.706 * own * 0.999 <= side <= 2 * 12.706 * own * 1.001


def test_the_trials_that_are_needed_narrow_the_interval_to_the_limit() -> None:
    rng = np.random.default_rng(11)
    errors = {str(k): tuple(np.abs(rng.normal(0.0, 0.5, 3))) for k in range(6)}
    found = fitness.verdict(LIMIT, errors)
    assert found.verdict == OPEN
    assert found.value < LIMIT.size < found.high
    words = found.reason.split()
    wanted = int(words[words.index("about") + 1])
    assert found.value * (found.high / found.value) ** math.sqrt(6 / wanted) <= LIMIT.size
    assert found.value * (found.high / found.value) ** math.sqrt(6 / (wanted - 1)) > LIMIT.size


@pytest.mark.parametrize(("value", "words"), [(1.02, "beyond the limit"), (0.995, "hardly decide")])
def test_an_error_at_the_limit_asks_for_more_trials_and_for_no_number(value: float, words: str) -> None:
    sizes = np.linspace(0.3, 1.7, 8)
    sizes *= value / SIZE / math.sqrt(np.mean(sizes**2))
    found = fitness.verdict(LIMIT, {str(k): (e,) for k, e in enumerate(sizes.tolist())})
    assert found.verdict == OPEN
    assert found.value == pytest.approx(value)
    assert found.low < LIMIT.size < found.high
    assert words in found.reason


def test_a_purpose_is_met_where_all_is_met() -> None:
    def found(*verdicts: str) -> str:
        return Fitness("", "", tuple(Found(LIMIT, {}, 0.0, 0.0, 0.0, one, "") for one in verdicts), 1.0).verdict

    assert found(FIT, FIT) == FIT
    assert found(FIT, OPEN) == OPEN
    assert found(OPEN, NOT_FIT, FIT) == NOT_FIT


@pytest.mark.parametrize(
    ("unit", "meta", "size"),
    [("m", {}, 1.0), ("m", {"scale": 50.0}, 0.02), ("m", {"scale": 0}, 1.0), ("m", {"scale": "none"}, 1.0),
     ("L", {"scale": 50.0}, L), ("deg", {}, math.pi / 180.0), ("U", {}, U), ("share", {}, 1.0)],
)  # fmt: skip
def test_units_are_those_of_the_ship_and_metres_those_at_full_scale(unit: str, meta: Any, size: float) -> None:
    limit = replace(LIMIT, unit=unit)
    assert fitness.unit_of(limit, SHIP, replace(log(), meta=meta)) == pytest.approx(size)


@pytest.mark.parametrize(
    ("of", "unit", "level"), [("position", "L", 0.05 / L), ("heading", "deg", 0.2), ("speed", "U", 0.02 / U)]
)
def test_the_scatter_of_readings_is_that_of_what_is_judged(of: str, unit: str, level: float) -> None:
    rng = np.random.default_rng(3)
    size = {"x": 0.03, "y": 0.04, "psi": math.radians(0.2), "u": 0.02}
    clean = log(1500.0, psi=lambda t: 0.02 * t)
    noisy = clean.having(**{name: clean[name] + rng.normal(0.0, s, len(clean)) for name, s in size.items()})
    wrapped = noisy.having(psi=np.mod(noisy["psi"], 2 * math.pi))
    limit = replace(LIMIT, of=of, unit=unit)
    assert fitness._noise(limit, SHIP, wrapped) == pytest.approx(level, rel=0.06)
    assert fitness._noise(replace(limit, of="overshoot"), SHIP, wrapped) == 0.0


@pytest.mark.parametrize(
    ("of", "error"),
    [("position", 0.5), ("heading", 0.2), ("speed", 0.07), ("turn", abs((0.2 - 0.05) / 0.6))],
)
def test_an_error_is_that_at_the_last_complete_row(of: str, error: float) -> None:
    measured = log(psi=lambda t: 0.01 * t)
    last = 2.0 * math.pi  # a lap more in the prediction is the same heading
    guess = measured.having(
        x=measured["x"] + np.linspace(0.0, 0.3, len(measured)), y=measured["y"] - np.linspace(0.0, 0.4, len(measured)),
        psi=measured["psi"] + np.linspace(0.05, 0.2, len(measured)) + last, u=measured["u"] - 0.07,
    )  # fmt: skip
    assert fitness._at_end(of, measured, guess) == pytest.approx(error)
    for name in ("x", "psi", "u"):
        gap = measured[name].copy()
        gap[-1] = math.nan
        measured = measured.having(**{name: gap})
    before = fitness._at_end(of, measured, guess)
    assert before == pytest.approx(error, rel=0.02)
    none = guess.having(**{name: np.full(len(guess), math.nan) for name in ("x", "psi", "u")})
    assert fitness._at_end(of, measured, none) == math.inf


@pytest.mark.parametrize("share", [0.9, 1.1])
@pytest.mark.parametrize(
    ("name", "given"),
    [
        ("under way", lambda f: {"u": f * 0.05 * FROUDE}),
        ("turning", lambda f: {"psi": lambda t: f * math.radians(10.0) * t / 60.0}),
        ("turning", lambda f: {"psi": lambda t: -f * math.radians(10.0) * t / 60.0}),
        ("large rudder angle", lambda f: {"delta": -f * math.radians(20.0)}),
        ("propeller reversed", lambda f: {"n_P": lambda t: np.where(t <= f * 0.3 * 60.0, -5.0, 5.0)}),
        ("low speed", lambda f: {"u": 1e-4, "psi": lambda t: f * math.radians(5.0) * t / 60.0}),
        ("low speed", lambda f: {"u": f * 0.05 * L / 60.0}),
        ("low speed", lambda f: {"u": 0.05 * FROUDE / f}),
    ],
)  # fmt: skip
def test_a_window_shows_what_passes_the_threshold(name: str, given: Any, share: float) -> None:
    assert CONDITIONS[name](SHIP, log(**given(share))) == (share > 1.0)


def test_a_ship_that_backs_with_reversed_revolutions_does_not_brake() -> None:
    assert not CONDITIONS["propeller reversed"](SHIP, log(u=-0.2, n_P=-5.0))
    assert not CONDITIONS["large rudder angle"](SHIP, log(delta=math.nan))


def test_windows_are_whole_and_show_what_is_asked() -> None:
    """Half of a log turns; of windows of 10 s, the last of 4 s does not count."""
    trial = log(64.0, psi=lambda t: 0.1 * np.maximum(t - 30.0, 0.0))
    limit = replace(LIMIT, horizon=10.0 * U / L, when="turning")
    assert fitness._seconds(limit, SHIP) == pytest.approx(10.0)
    assert fitness._windows(limit, SHIP, trial) == [slice(60, 80), slice(80, 100), slice(100, 120)]


STOP = {"u": lambda t: U * np.clip(1.0 - np.maximum(t - 10.0, 0.0) / 30.0, 0.0, 1.0)}


@pytest.mark.parametrize(
    ("given", "stops"),
    [
        ({"n_P": lambda t: np.where(t < 10.0, 10.0, -8.0), **STOP}, [slice(19, 121)]),
        ({"n_P": lambda t: np.where(t < 10.0, 10.0, 0.9), **STOP}, [slice(19, 121)]),
        ({"n_P": lambda t: np.where(t < 10.0, 10.0, 1.1), **STOP}, []),
        ({"n_P": lambda t: np.where((t < 10.0) | (t >= 50.0), 10.0, -8.0), **STOP}, [slice(19, 100)]),
        ({"n_P": lambda t: np.where((t < 10.0) | (t >= 30.0), 10.0, -8.0), **STOP}, []),  # a third of the speed is left
        ({"n_P": lambda t: np.where((t < 10.0) | (t >= 35.0), 10.0, -8.0), **STOP}, [slice(19, 70)]),  # a sixth
        ({"n_P": -8.0, "u": lambda t: U * np.maximum(1.0 - t / 30.0, 0.0)}, [slice(0, 121)]),
        ({"n_P": lambda t: np.where(t < 10.0, 10.0, -8.0), "u": lambda t: 0.36 * STOP["u"](t)}, [slice(19, 121)]),
        ({"n_P": lambda t: np.where(t < 10.0, 10.0, -8.0), "u": lambda t: 0.3 * STOP["u"](t)}, []),
    ],
)  # fmt: skip
def test_a_stop_reaches_from_the_order_until_the_engine_goes_ahead(given: Any, stops: list[slice]) -> None:
    """From the last row ahead, between which and the next the order is given; a log may begin with it."""
    assert fitness.brakes(SHIP, log(**given)) == stops


def test_the_way_of_a_stop_goes_on_beyond_the_log_at_the_mean_deceleration() -> None:
    """Even deceleration a from U: to a fifth of the speed it is (U^2 - (U/5)^2) / (2 a), whether the log shows it."""
    a = U / 50.0
    whole, short = (log(seconds, 0.1, u=lambda t: U - a * t) for seconds in (45.0, 20.0))
    way = (U * U - 0.04 * U * U) / (2.0 * a)
    assert fitness._distance(whole, U) == pytest.approx(way, rel=3e-3)
    assert fitness._distance(short, U) == pytest.approx(way, rel=3e-3)
    assert fitness._distance(log(20.0, u=lambda t: U + a * t), U) == math.inf
    assert fitness._distance(log(20.0), U) == math.inf


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_leg_of_a_zigzag_is_one_whose_heading_comes_back_from_a_peak(side: float) -> None:
    """The helm is laid over every 10 s; the heading swings on for 3 s after each reversal."""
    helm = side * math.radians(10.0)
    steps = {
        "delta": lambda t: helm * np.where((t // 10.0) % 2 == 0.0, 1.0, -1.0),
        "psi": lambda t: side * math.radians(8.0) * np.sin(math.pi * (t - 8.0) / 10.0),
    }
    trial = replace(log(39.5, **steps), meta={"kind": "zigzag"})
    assert fitness.legs(trial) == [slice(20, 40), slice(40, 60), slice(60, 80)]
    assert fitness.legs(replace(trial, meta={"kind": "turning"})) == []
    swinging = replace(log(39.5, delta=steps["delta"], psi=lambda t: side * 0.01 * t), meta={"kind": "zigzag"})
    assert fitness.legs(swinging) == [], "the heading never comes back"


def test_the_least_error_of_few_trials_is_that_of_chi_squared() -> None:
    """One trial: the root mean square over the 97.5 % end of |normal|, 2.2414."""
    assert fitness._least([(3.0, 3.0)]) == pytest.approx(SIZE * 3.0 / 2.2414, rel=1e-4)
    assert fitness._least([(1.0,), (2.0, 2.0)]) == pytest.approx(SIZE * math.sqrt(5.0 / 7.3778), rel=1e-4)
    assert FEWEST == 5


def test_predictions_are_shared_by_limits_of_one_horizon_and_no_others(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[float | None, float | None]] = []

    def guess(_: Any, trial: Trial, *, restart: float | None, smooth_start: float | None) -> Trial:
        asked.append((restart, smooth_start))
        return replace(trial)

    monkeypatch.setattr(fitness, "replay", guess)
    trial = log(u=np.full(121, 0.4))
    long = SHIP.L_pp / SHIP.speed
    first = fitness._guess(SHIP, trial, 3.0 * long, None)
    assert fitness._guess(SHIP, trial, 3.0 * long, None) is first
    fitness._guess(SHIP, trial, 5.0 * long, None)
    fitness._guess(SHIP, trial, 5.0 * long, 2.0)
    assert asked == [(3.0 * long, None), (5.0 * long, None), (5.0 * long, 2.0)]
