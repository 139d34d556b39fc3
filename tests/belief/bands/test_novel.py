"""Novelty of a run so far, and bands that grow with it: closed forms, and laws that are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from known_calibration import UNIT, H, made

from seatrial.belief.bands.calibration import Left, best_power, crossed_half, factors_of, load, save
from seatrial.belief.bands.crossed import crossed
from seatrial.belief.bands.novel import acting, reference_of, so_far
from seatrial.belief.bands.prediction import fan, manoeuvre
from seatrial.belief.bands.sailing import FreeRuns
from seatrial.belief.coverage import WIND, Reference, columns
from seatrial.data import Trial
from seatrial.environment import Uniform
from seatrial.manoeuvres.turning import Turning
from seatrial.simulate.loop import open_loop
from seatrial.simulate.replay import replay
from seatrial.simulate.run import approach, simulate
from virtual_logs import log, posterior, ship

DAYS = ("01-Jan-2020", "02-Jan-2020", "03-Jan-2020", "04-Jan-2020")


def still(*channels: str, limit: float = 2.0) -> Reference:
    """Trials in which nothing has moved: novelty is the distance from rest over the limit."""
    n = len(channels)
    return Reference(channels, np.ones(n), np.zeros((5, n)), limit, np.zeros(n), np.zeros(n), {})


def test_novelty_so_far_is_the_mean_over_time() -> None:
    t = np.array([0.0, 1.0, 3.0, 4.0])
    run = {"u": np.array([t, 2.0 * np.ones(4)])}
    found = so_far(still("u"), run, t + 7.0)
    assert found[0] == pytest.approx(t / 4.0)  # the mean of u / 2 until t, on uneven rows
    assert found[1] == pytest.approx(np.ones(4))
    assert so_far(replace(still("u"), scale=np.array([0.5])), run, t) == pytest.approx(2.0 * found)


def test_the_apparent_wind_of_a_run_is_that_of_its_trial() -> None:
    rng, t = np.random.default_rng(3), np.arange(6.0)
    states = {name: rng.standard_normal(6) for name in ("u", "v_m", "r", "psi")}
    U_T, gamma = rng.uniform(1.0, 5.0, 6), rng.uniform(-3.0, 3.0, 6)
    trial = Trial("windy", t, {**states, "U_T": U_T, "gamma_T": gamma})
    own = np.sqrt((columns(trial, WIND) ** 2).sum(axis=1))
    run = {name: one[None] for name, one in states.items()}
    run |= {"wind_x": (U_T * np.cos(gamma))[None], "wind_y": (U_T * np.sin(gamma))[None]}
    found = so_far(still(*WIND, limit=1.0), run, t)[0]
    assert found[0] == pytest.approx(own[0])
    assert found[-1] == pytest.approx(np.trapezoid(own, t) / 5.0)
    there = replace(still(*WIND, limit=1.0), points=np.tile(columns(trial, WIND)[0], (5, 1)))
    begun = {name: column[:, :1] for name, column in run.items()}
    assert so_far(there, begun, t[:1])[0, 0] == pytest.approx(0.0, abs=1e-9)


def test_what_is_unknown_counts_as_the_edge() -> None:
    t = np.arange(3.0)
    assert so_far(still("u", "n_P"), {"u": np.zeros((2, 3))}, t) == pytest.approx(np.ones((2, 3)))
    gap = so_far(still("u"), {"u": np.array([[0.0, np.nan, 0.0]])}, t)
    assert gap[0] == pytest.approx([0.0, 0.5, 0.5])


@pytest.mark.slow
def test_a_reference_is_thinned_and_knows_no_past() -> None:
    rng, t = np.random.default_rng(0), np.arange(4100.0)
    trials = [Trial(f"t{k}", t, {name: rng.standard_normal(t.size) for name in ("u", "v_m", "r", "delta")})
              for k in range(3)]  # fmt: skip
    found = reference_of(trials)
    assert found is not None
    assert found.channels == ("u", "v_m", "r", "delta")
    assert 1500 < len(found.points) <= 2000
    # a hundredth of what was drawn of the same law is beyond the limit of all points, a few more of the thinned
    share = np.mean(found.novelty(rng.standard_normal((2000, 4))) > 1.0)
    assert 0.003 < share < 0.15
    assert (found.novelty(np.array([[8.0, 0.0, 0.0, 0.0]])) > 2.0).all()
    assert reference_of([Trial("bare", t, {"x": t})]) is None


@pytest.mark.slow
def test_runs_have_the_inputs_of_their_rows() -> None:
    names = open_loop(ship()).series
    series = np.arange(7.0)[None, :, None] + 100.0 * np.arange(len(names))
    lanes = FreeRuns(np.zeros((1, 6)), series, 0.5, 3)
    found = acting(ship(), np.arange(18.0).reshape(1, 3, 6), lanes)
    k = names.index("delta")
    assert found["delta"] == pytest.approx(np.array([[0.0, 3.0, 6.0]]) + 100.0 * k)
    assert found["u"] == pytest.approx(np.array([[3.0, 9.0, 15.0]]))
    assert found["psi"] == pytest.approx(np.array([[2.0, 8.0, 14.0]]))


def errors(power: float, *, days: bool = True, windows: int = 3, seed: int = 0) -> Left:
    """Errors of 28 recordings of four days, seven a day, whose size goes with a power of novelty; days differ in it."""
    rng, names = np.random.default_rng(seed), [f"{k}_{DAYS[k // 7]}" if days else f"r{k}" for k in range(28)]
    level = np.exp(0.5 * np.repeat(np.arange(28) // 7 - 1.5, windows) + 0.4 * rng.standard_normal(28 * windows))
    novelty = np.repeat(level[:, None], len(H), axis=1)
    usual = UNIT * (H / 10.0)[:, None]
    error = usual * novelty[:, :, None] ** power * rng.standard_normal((28 * windows, len(H), 6))
    of = tuple(name for name in names for _ in range(windows))
    return Left(of, of, ("turning",) * len(of), H, error, np.broadcast_to(usual, error.shape).copy(), novelty)


@pytest.mark.slow
@pytest.mark.parametrize(("power", "days"), [(0.0, True), (0.5, True), (1.0, True), (1.0, False)])
def test_the_power_of_novelty_is_found(power: float, days: bool) -> None:
    left = errors(power, days=days)
    assert bool(left.days) == days
    assert best_power(left, 0.5, 0.9) == power
    assert best_power(replace(left, novelty=None), 0.5, 0.9) == 0.0


@pytest.mark.slow
def test_a_gain_of_chance_is_none() -> None:
    """Errors go with novelty, which hardly differs: the score gains less than a fiftieth."""
    left = errors(1.0)
    faint = left.novelty**0.1  # type: ignore[operator]
    error = left.error * (faint / left.novelty)[:, :, None]
    assert best_power(replace(left, novelty=faint, error=error), 0.5, 0.9) == 0.0


@pytest.mark.slow
def test_days_choose_and_not_recordings() -> None:
    """Each day has a kind of its own, whose factor tells its size to its other recordings, and to no other day."""
    rng, left = np.random.default_rng(2), errors(0.0, windows=4)
    day = np.array([DAYS.index(name.partition("_")[2]) for name in left.groups])
    size, chance = 2.0**day, np.exp(0.6 * rng.standard_normal(day.size))
    wide = replace(left, error=left.error * size[:, None, None], kinds=tuple(f"kind {k}" for k in day),
                   novelty=np.repeat((size * chance)[:, None], len(H), axis=1))  # fmt: skip
    assert best_power(wide, 0.5, 0.9) > 0.0
    untold = tuple(name.partition("_")[0] for name in left.groups)
    assert best_power(replace(wide, groups=untold), 0.5, 0.9) == 0.0


@pytest.mark.slow
def test_bands_of_an_unseen_day_hold_by_its_novelty() -> None:
    """The day that differs most, by factors of the others: without novelty its bands are too narrow by half."""
    left = errors(1.0)
    last = np.array([DAYS[3] in name for name in left.groups])
    held = {power: float((np.abs(left.error[last]) <= crossed_half(left, 0.5, 0.9, power, last)).mean())
            for power in (0.0, 1.0)}  # fmt: skip
    assert held[0.0] < 0.75
    assert 0.85 < held[1.0] < 0.95
    found = replace(made(), left=left, share=0.5)
    plain, knowing = (crossed(replace(found, novel=power), 0.9)[-1].inside["speeds"] for power in (0.0, 1.0))
    assert knowing > plain
    # recordings of days that nobody has told are judged by those of their own day too
    assert crossed(replace(found, left=replace(left, groups=left.trials)), 0.9)[-1].windows == len(left.groups)


def test_two_days_are_too_few_to_tell() -> None:
    left = errors(0.0)
    two = tuple(name.replace(DAYS[2], DAYS[0]).replace(DAYS[3], DAYS[1]) for name in left.groups)
    assert replace(left, groups=two).days == ()
    assert replace(left, groups=(*left.groups[:-1], "without a day")).days == ()
    three = tuple(name.replace(DAYS[3], DAYS[0]) for name in left.groups)
    assert len(set(replace(left, groups=three).days)) == 3


@pytest.mark.slow
def test_half_widths_grow_with_the_power_of_novelty() -> None:
    left = errors(1.0)
    found = replace(made(), left=left, share=0.0, novel=1.0)
    t, width = np.array([5.0, 20.0]), np.ones((2, 6))
    one, two = (found.half(t, width, "turning", 0.9, size * np.ones(2)) for size in (1.0, 2.0))
    assert two == pytest.approx(2.0 * one)
    assert found.half(t, width, "turning", 0.9) == pytest.approx(one), "unknown: the edge of the trials"
    assert replace(found, novel=0.5).half(t, width, "turning", 0.9, 4.0 * np.ones(2)) == pytest.approx(
        2.0 * replace(found, novel=0.5).half(t, width, "turning", 0.9, np.ones(2)))
    least = float(left.novelty.min())  # type: ignore[union-attr]
    assert found.half(t, width, "turning", 0.9, np.zeros(2)) == pytest.approx(
        found.half(t, width, "turning", 0.9, least * np.ones(2)))  # fmt: skip
    # the factor of a law of normal errors is its quantile
    assert factors_of(left, 0.0, 0.9, 1.0).factor[0, 1] * left.usual[1] == pytest.approx(1.645 * UNIT, rel=0.25)


@pytest.mark.slow
def test_a_run_unlike_the_trials_has_wider_bands(tmp_path) -> None:
    """By the file, through the prediction: half widths are those without novelty times novelty."""
    rng = np.random.default_rng(1)
    logs = [log(ship(), k, rng) for k in range(6)]
    reference = reference_of(logs)
    assert reference is not None
    plain = replace(made(), share=0.0)
    knowing = replace(plain, novel=1.0, reference=reference,
                      left=replace(plain.left, novelty=np.full(plain.left.error.shape[:2], 0.01)))  # fmt: skip
    model = tmp_path / "model.toml"
    save(knowing, tmp_path / "model.bands.json")
    again = load(model, posterior())
    trial = log(ship(), 7, rng)
    predicted = replay(ship(), trial)
    before, after = (fan(posterior(), one, trial, predicted, 0.9, draws=50).half for one in (plain, again))
    calm = {name: np.zeros((1, len(predicted))) for name in ("wind_x", "wind_y")}
    moved = {name: predicted[name][None] for name in ("u", "v_m", "r", "psi")}
    run = moved | {name: trial[name][None] for name in ("delta", "n_P")} | calm
    own = so_far(reference, run, predicted.t)[0]
    held = np.isfinite(before[:, 0]) & (own > 0.01) & (predicted.t >= 3.0)  # before that the noise of starts decides
    assert held.sum() > 20
    # errors that came with a novelty of .01 are 100 times as great at the edge
    assert (after / before)[held, 0] == pytest.approx(100.0 * own[held], rel=0.1)


@pytest.mark.slow
def test_bands_of_a_manoeuvre_grow_with_how_unlike_the_trials_it_is() -> None:
    """In a wind that no trial has: by the channels of a simulated run, which columns reads on its own."""
    rng, (U, n_P) = np.random.default_rng(1), approach(ship())
    logs = [log(ship(), k, rng) for k in range(6)]
    calm = [one.having(U_T=rng.uniform(0.0, 0.2, len(one)), gamma_T=np.zeros(len(one))) for one in logs]
    reference = reference_of(calm)
    assert reference is not None
    assert set(WIND) <= set(reference.channels)
    plain = replace(made(), share=0.0)
    knowing = replace(plain, novel=1.0, reference=reference,
                      left=replace(plain.left, novelty=np.full(plain.left.error.shape[:2], 0.01)))  # fmt: skip
    policy, weather = Turning(n_P, 0.3), Uniform(U_T=6.0, gamma_T=1.0)
    given = {"speed": U, "duration": 30.0, "dt": 0.1, "weather": weather, "draws": 10}
    before, after = (manoeuvre(posterior(), one, policy, 0.9, **given) for one in (plain, knowing))  # type: ignore[arg-type]
    run = simulate(ship(), policy, speed=U, duration=30.0, dt=0.1, environment=weather)
    at = reference.novelty(columns(run, reference.channels))
    assert (after.half / before.half)[-1, 0] == pytest.approx(100.0 * np.trapezoid(at, run.t) / run.t[-1], rel=0.05)
    still = manoeuvre(posterior(), knowing, policy, 0.9, **{**given, "weather": Uniform()})  # type: ignore[arg-type]
    assert still.half[-1, 0] < 0.8 * after.half[-1, 0]
