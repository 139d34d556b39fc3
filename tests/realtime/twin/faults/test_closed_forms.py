"""Filter, bank of suspects and judge of forecasts on a linear ship: against stacked matrices and known truths."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.linalg import expm

from linear_ship import CHANNELS, DENSITY, NAMES, NOISE, A, H, Sailed, blur, followed, machine, sailed, step_of
from seatrial.realtime.twin import ahead as ahead_module
from seatrial.realtime.twin.ahead import HORIZONS, LEVEL, Score, Trust, forecast
from seatrial.realtime.twin.faults.alarms import Judge
from seatrial.realtime.twin.faults.suspects import (
    CARRIED,
    GROWS,
    IMPULSE,
    JUMP,
    LATE,
    LAZY,
    LOST,
    MISREAD,
    PACE,
    RAMP,
    REVERSED,
    SCALED,
    SHARE,
    STUCK,
    Bank,
    suspects,
    threshold,
)
from seatrial.realtime.twin.follow import GATE, Follower, surprise, without
from tiers import slow_but

P_0 = np.diag([4.0, 4.0, 1e-4, 0.04, 0.01, 1e-6, 0.1, 0.1, 1e-6, 1e-6, 1e-10])


def start(**more: object) -> Follower:
    return Follower(machine(**more), 0.0, np.zeros(11), P_0)


def stacked(run: Sailed, dt: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean and covariance of all readings, and covariance of readings with the last state, without a recursion."""
    onward, pushed = step_of(dt)
    rows, Q = len(run.t), blur(dt)
    mean, means, cov, crosses = np.zeros(11), [], P_0, []
    # covariance of state i with state j >= i is P_i (onward^T)^(j - i)
    states = np.zeros((rows, rows, 11, 11))
    for k in range(rows):
        mean, cov = onward @ mean + pushed @ run.acting[k, :2], onward @ cov @ onward.T + Q
        means.append(mean)
        states[k, k] = cov
        for j in range(k + 1, rows):
            states[k, j] = states[k, j - 1] @ onward.T
            states[j, k] = states[k, j].T
        crosses.append(None)
    wide = np.einsum("ai,kjib,cb->kajc", H, states.transpose(0, 1, 2, 3), H, optimize=True)
    spread = wide.reshape(5 * rows, 5 * rows) + np.kron(np.eye(rows), np.diag(NOISE**2))
    last = np.concatenate([states[rows - 1, k] @ H.T for k in range(rows)], axis=1)
    return np.concatenate([H @ one for one in means]), spread, last


def test_the_filter_is_the_batch_estimate() -> None:
    """Mean and covariance after twelve rows with gaps are those of all readings at once."""
    run, dt = sailed(12, 2.0), 2.0
    run.readings[3, :2] = run.readings[7, 4] = math.nan
    after, _ = followed(start(), run)[-1]
    mean, spread, cross = stacked(run, dt)
    read = np.flatnonzero(np.isfinite(run.readings.ravel()))
    prior, P = np.zeros(11), P_0
    onward, pushed = step_of(dt)
    for acting in run.acting:
        prior, P = onward @ prior + pushed @ acting[:2], onward @ P @ onward.T + blur(dt)
    gain = np.linalg.solve(spread[np.ix_(read, read)], cross[:, read].T).T
    np.testing.assert_allclose(after.mean, prior + gain @ (run.readings.ravel() - mean)[read], rtol=1e-5, atol=1e-7)
    np.testing.assert_allclose(after.cov, P - gain @ cross[:, read].T, rtol=1e-4, atol=1e-12)


@pytest.mark.slow
def test_innovations_are_as_large_as_stated() -> None:
    """Per reading 1: over 4000 of them within four standard deviations of a chi-square mean; white from row to row."""
    run = sailed(800)
    steps = [step for _, step in followed(start(), run)][10:]
    nis = sum(step.nis for step in steps) / sum(step.rows.size for step in steps)
    assert abs(nis - 1.0) < 4.0 * math.sqrt(2.0 / (5 * len(steps)))
    root = np.array([np.linalg.solve(np.linalg.cholesky(step.spread), step.innovation) for step in steps])
    along = np.einsum("ki,ki->i", root[1:], root[:-1]) / len(root)
    assert (np.abs(along) < 4.0 / math.sqrt(len(root))).all()
    assert steps[0].slope.shape == (5, 11)
    np.testing.assert_allclose(steps[0].inverse @ steps[0].spread, np.eye(5), atol=1e-8)


def test_a_heading_is_the_same_again_after_a_turn() -> None:
    run = sailed(30)
    turned = Sailed(run.t, run.true, run.acting, run.readings.copy())
    turned.readings[::2, 2] += math.tau
    turned.readings[1::3, 2] -= 2.0 * math.tau
    one, other = (followed(start(), some)[-1][0] for some in (run, turned))
    np.testing.assert_allclose(other.mean, one.mean, atol=1e-9)


@pytest.mark.slow
def test_what_is_beyond_the_gate_is_left_out_and_what_stays_there_is_heeded_without_certainty() -> None:
    run = sailed(80)
    spoilt = Sailed(run.t, run.true, run.acting, run.readings.copy())
    spoilt.readings[40, 0] += 60.0
    cut = Sailed(run.t, run.true, run.acting, run.readings.copy())
    cut.readings[40, 0] = math.nan
    one, other = followed(start(), spoilt), followed(start(), cut)
    np.testing.assert_allclose(one[40][0].mean, other[40][0].mean, atol=1e-9)
    np.testing.assert_allclose(one[40][0].cov, other[40][0].cov, atol=1e-12)
    assert not one[40][1].taken[0]
    assert one[39][1].taken.all()
    # the gate is 6 standard deviations wide
    plain, sd = followed(start(), run), math.sqrt(one[40][1].spread[0, 0])
    for away, taken in ((GATE - 0.01, True), (GATE + 0.01, False)):
        expected = run.readings[40, 0] - plain[40][1].innovation[0]
        spoilt.readings[40, 0] = expected + away * sd
        assert followed(start(), spoilt)[40][1].taken[0] == taken
    spoilt.readings[40:, 0] = run.readings[40:, 0] + 60.0
    lost = Sailed(run.t, run.true, run.acting, run.readings.copy())
    lost.readings[40:, 0] = math.nan
    kept, without_it = followed(start(), spoilt), followed(start(), lost)
    # for the first half of L/U, 10 s, nothing; then towards the readings, no surer than without them
    np.testing.assert_allclose(kept[48][0].mean, without_it[48][0].mean, atol=1e-9)
    assert kept[70][0].mean[0] > without_it[70][0].mean[0] + 1.0
    np.testing.assert_allclose(kept[70][0].cov, without_it[70][0].cov, rtol=1e-9, atol=1e-15)


def test_a_channel_that_is_not_believed_is_compared_only() -> None:
    run = sailed(60)
    masked, lost = sailed(60), sailed(60)
    lost.readings[:, 2] = math.nan
    one, other = followed(start(), masked, (2,)), followed(start(), lost)
    np.testing.assert_allclose(one[-1][0].mean, other[-1][0].mean, atol=1e-9)
    step = one[-1][1]
    assert step.rows.size == 5
    left = without(step, (2,))
    assert left.rows.tolist() == [0, 1, 3, 4]
    np.testing.assert_allclose(left.innovation, other[-1][1].innovation, atol=1e-9)
    np.testing.assert_allclose(left.inverse @ other[-1][1].spread, np.eye(4), atol=1e-9)
    np.testing.assert_allclose(left.slope, H[[0, 1, 3, 4]], atol=1e-12)
    assert left.nis == pytest.approx(other[-1][1].nis, rel=1e-6)
    assert without(step, ()) is step
    assert surprise(other[-1][1]) == pytest.approx(
        float((other[-1][1].innovation ** 2 / np.diagonal(other[-1][1].spread)).sum()))  # fmt: skip
    assert run.readings.shape == (60, 5)


def test_a_forecast_carries_mean_and_covariance_on() -> None:
    """By the matrix exponential and Van Loan's integral over the whole span."""
    follower, acting = followed(start(), sailed(20))[-1][0], np.zeros(10)
    acting[:2] = 1.0, 0.05
    ahead = forecast(follower, acting, 600.0)
    assert ahead.t[0] == follower.t
    assert ahead.t[-1] == pytest.approx(follower.t + 600.0)
    assert (np.diff(ahead.t) > 0.0).all()
    for k in (1, 20, 40):
        span = ahead.t[k] - follower.t
        onward, pushed = step_of(span)
        np.testing.assert_allclose(ahead.mean[k], (onward @ follower.mean + pushed @ acting[:2])[:6], rtol=1e-8)
        cov = onward @ follower.cov @ onward.T + blur(span)
        np.testing.assert_allclose(ahead.cov[k], cov[:3, :3], rtol=1e-4)
    np.testing.assert_allclose(ahead.half[40] / np.sqrt(np.diagonal(ahead.cov[40])), 1.6449, rtol=1e-9)


def test_a_forecast_takes_of_what_was_carried_the_share_that_earlier_ones_show() -> None:
    """Half of what current and slow forces add at 30 s, none at 600 s, between on a line; bands twice as wide there."""
    follower, acting = followed(start(), sailed(20))[-1][0], np.zeros(10)
    acting[:2] = 1.0, 0.05
    scores = {30.0: Score(), 600.0: Score()}
    for h, share in ((30.0, 0.5), (600.0, 0.0)):
        scores[h] = Score(1, ways=[0.0, 0.0, 1e9, 0.0, share * 1e9], alone=1e9)
    scores[600.0].wider = math.log(2.0)
    ahead, whole = (forecast(follower, acting, 600.0, one) for one in (scores, None))
    bare = follower.mean * np.repeat([1.0, 0.0], [6, 5])
    for k in (1, 12, 40):
        span = ahead.t[k] - follower.t
        onward, pushed = step_of(span)
        along = min(max((span - 30.0) / 570.0, 0.0), 1.0)
        share = 0.5 * (1.0 - along)
        wanted = onward @ (bare + share * (follower.mean - bare)) + pushed @ acting[:2]
        np.testing.assert_allclose(ahead.mean[k], wanted[:6], rtol=2e-3, atol=1e-3)
        np.testing.assert_allclose(ahead.cov[k], (1.0 + along) ** 2 * whole.cov[k], rtol=1e-9)


def test_a_forecast_takes_of_learnt_parameters_a_share_of_their_own(monkeypatch: pytest.MonkeyPatch) -> None:
    """A quarter of what the parameter adds, which a state stands for here, and half of what the current does."""
    monkeypatch.setattr(ahead_module, "values", lambda model: {"slow.r": 2e-5})
    here = start(free=("slow.r",))
    here = replace(here, mean=np.array([0.0, 0.0, 0.0, 5.0, 0.0, 0.0, 0.4, -0.3, 0.0, 0.0, 0.0]))
    score = Score(1, ways=[1e9, 0.0, 4e9, 0.25e9, 2e9], alone=1e9)
    found = forecast(here, np.zeros(10), 600.0, {600.0: score})
    plain, carried = here.mean * np.repeat([1.0, 0.0], [6, 5]), here.mean * np.repeat([0.0, 1.0], [6, 5])
    wanted = step_of(600.0)[0] @ (plain + 0.75 * 2e-5 * np.eye(11)[10] + 0.5 * carried)
    np.testing.assert_allclose(found.mean[40], wanted[:6], rtol=2e-3, atol=1e-3)


def test_simpler_models_have_no_current_and_the_plain_one_its_own_parameters(monkeypatch: pytest.MonkeyPatch) -> None:
    here = start(free=("slow.r",))  # a state that stands for a parameter here
    here = replace(here, mean=np.arange(11.0) + 1.0)
    monkeypatch.setattr(ahead_module, "values", lambda model: {"slow.r": 9.0})
    plain, learnt = ahead_module.simpler(here)
    assert learnt.tolist() == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    assert plain.tolist() == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 0.0, 0.0, 0.0, 0.0, 9.0]
    without = ahead_module.simpler(start())
    assert without[0] is without[1]


def trusted(run: Sailed, follower: Follower) -> Trust:
    trust = Trust()
    for (after, _), acting, readings in zip(followed(follower, run), run.acting, run.readings, strict=True):
        trust.note(after, acting, readings)
    return trust


@pytest.mark.slow
def test_bands_of_forecasts_hold_nine_in_ten_fixes_and_no_more() -> None:
    """Runs of 7 and 25 minutes: shares within four binomial deviations, allowing for forecasts that overlap."""
    found: dict[float, list[float]] = {h: [] for h in HORIZONS}
    error: dict[float, list[float]] = {h: [] for h in HORIZONS}
    for seed in range(12):
        trust = trusted(sailed(1500 if seed < 3 else 400, 1.0, seed), start())
        for h, score in trust.scores.items():
            if score.count:
                found[h].append(score.held)
                error[h].append(score.rms)
    for h in (30.0, 120.0):
        assert abs(np.mean(found[h]) - LEVEL) < 4.0 * np.std(found[h]) / math.sqrt(len(found[h])) + 0.01
        assert 0.8 < np.mean(found[h]) < 0.97
    # the error is that of the stationary filter, carried on
    after = followed(start(), sailed(300))[-1][0]
    for h in (30.0, 120.0):
        onward = expm(A * h)
        cov = onward @ after.cov @ onward.T + blur(h)
        wanted = math.sqrt(cov[0, 0] + cov[1, 1] + 2.0 * NOISE[0] ** 2)
        assert np.sqrt(np.mean(np.square(error[h]))) == pytest.approx(wanted, rel=0.15)


@pytest.mark.slow
def test_forecasts_of_an_exact_model_miss_by_nothing_and_are_counted() -> None:
    """One a minute; those over 30 s, 2 min and 10 min that have ended by 1000 s.  Rival: the same course and speed."""
    run = sailed(1000, noise=0.0)
    trust = trusted(run, start())
    for h, score in trust.scores.items():
        assert score.count == math.floor((1000.0 - 1.0 - h) / 60.0) + 1
        assert score.held == 1.0
        assert score.rms < 1e-6
    misses = []
    for k in range(0, 1000 - 30, 60):
        x, y, psi, u, v = run.true[k, :5]
        c, s = math.cos(psi), math.sin(psi)
        straight = np.array([x + 30.0 * (u * c - v * s), y + 30.0 * (u * s + v * c)])
        misses.append(np.sum((run.true[k + 30, :2] - straight) ** 2))
    assert trust.scores[30.0].rival == pytest.approx(math.sqrt(np.mean(misses)), rel=1e-6)
    assert trust.scores[30.0].square[1] == pytest.approx(np.sum(misses), rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("every", [7, 45, 90])
def test_the_first_fix_after_its_horizon_judges_a_forecast(every: int) -> None:
    """However rare fixes are; and by where the ship is then, so that an exact model still misses by nothing."""
    run = sailed(1200, noise=0.0)
    run.readings[np.arange(1200) % every != 0, :2] = math.nan
    trust = trusted(run, start())
    for h, score in trust.scores.items():
        assert score.count >= (1200.0 - h) / 240.0 - 1.0
        assert score.count >= 1
        assert score.rms < 1e-6


@pytest.mark.slow
def test_a_fix_that_comes_much_too_late_judges_nothing() -> None:
    run = sailed(400, noise=0.0)
    run.readings[20:100, :2] = math.nan
    trust = trusted(run, start())
    # that of t = 1 s over 30 s has its fix at 101 s, 40 s after its horizon; those of 61 s have theirs 10 s after it
    whole = trusted(sailed(400, noise=0.0), start())
    assert trust.scores[30.0].count == whole.scores[30.0].count - 1
    assert trust.scores[120.0].count == whole.scores[120.0].count
    after = followed(start(), run)[399][0]
    for cleared in (False, True):  # those on their way are judged later, unless they are dropped
        if cleared:
            whole.clear()
        before = whole.scores[600.0].count
        whole.note(replace(after, t=650.0 + 700.0 * cleared), run.acting[399], run.readings[399])
        assert (whole.scores[600.0].count > before) == (not cleared)


ROWS, ONSET = 40, 14


def of_time(one: SimpleNamespace, dt: float, passed: list) -> np.ndarray:
    """The same for readings that are late or off by a share, and for a clock that is off its pace."""
    onward, pushed = step_of(dt)
    less, z = step_of(0.999 * dt), np.zeros(11)
    rows = [CHANNELS.index(name) for name in one.what if name in CHANNELS]
    out = np.zeros((ROWS, 5, 1))
    for k in range(ONSET, ROWS):
        before, acting = passed[k][1].before, passed[k][1].acting[:2]
        there = onward @ before + pushed @ acting
        if one.how == PACE:
            z = onward @ z - 1e3 * (there - less[0] @ before - less[1] @ acting)
            out[k, :, 0] = H @ z
        else:
            shown = [H @ (onward @ passed[j][1].before + pushed @ passed[j][1].acting[:2]) for j in range(ONSET, k + 1)]
            read = shown[-1]
            if one.how == LATE:  # over the delay, once so much is known; before that by the rate
                back = one.share / dt
                j = math.floor(len(shown) - 1 - back)
                w = len(shown) - 1 - back - j
                read = (H @ (before - there) / dt if j < 0 else
                        ((1.0 - w) * shown[j] + w * shown[min(j + 1, len(shown) - 1)] - shown[-1]) / one.share)
            out[k, rows, 0] = read[rows]
    return out


def effect(one: SimpleNamespace, run: Sailed, dt: float, passed: list) -> np.ndarray:
    """Readings that a fault of unit size adds from ONSET on, by component: shape (ROWS, 5, components)."""
    if one.how in (LATE, SHARE, PACE):
        return of_time(one, dt, passed)
    onward, pushed = step_of(dt)
    out = np.zeros((ROWS, 5, len(one.what)))
    for i, name in enumerate(one.what):
        z, lazy = np.zeros(11), float(run.acting[ONSET, 1])
        if one.how == IMPULSE:
            z[NAMES.index(name)] = 1.0
        for k in range(ONSET, ROWS):
            if one.how in (JUMP, RAMP):
                out[k, CHANNELS.index(name), i] = 1.0 if one.how == JUMP else run.t[k] - run.t[ONSET - 1]
                continue
            n, delta = run.acting[k, :2]
            instead = {IMPULSE: 0.0, STUCK: (run.acting[ONSET, 1] - delta, 1.0)[i], REVERSED: -2.0 * delta, LOST: -n,
                       MISREAD: -1.0, SCALED: -n if name == "n_P" else -delta}.get(one.how, 0.0)  # fmt: skip
            if one.how == LAZY:
                lazy += np.clip(delta - lazy, -one.share * 0.05 * dt, one.share * 0.05 * dt)
                instead = lazy - delta
            column = 0 if name == "n_P" else 1
            if one.how in (GROWS, CARRIED):
                grows = np.eye(11)[NAMES.index(name)]
                if one.how == CARRIED:  # the ship goes with the water, which the log through it does not show
                    psi = passed[k][1].before[2]
                    turned = [[math.cos(psi), math.sin(psi)], [-math.sin(psi), math.cos(psi)]]
                    grows[[3, 4]] = np.array(turned)[:, i]
                z = onward @ z + min(dt, max(40.0 - (run.t[k - 1] - run.t[ONSET - 1]), 0.0)) * grows
                out[k, :, i] = H @ z
                continue
            z = onward @ z + pushed[:, column] * (0.0 if one.how == IMPULSE else instead)
            out[k, :, i] = H @ z
    return out


@pytest.mark.parametrize("level", [pytest.param(1.0, marks=pytest.mark.slow), 2.5])
def test_the_evidence_of_each_suspect_is_twice_the_logarithm_of_its_bayes_factor(level: float) -> None:
    """Against Gaussian densities of all innovations at once; size and deviation are those of the posterior."""
    dt, follower = 2.0, start()
    run = sailed(ROWS, dt)
    found = suspects(follower.machine)
    bank = Bank(follower.machine, found)
    passed = followed(follower, run)
    before = follower
    for k, (after, step) in enumerate(passed):
        if k == ONSET:
            bank.onset(before.t, run.acting[k], before.mean)
        if k >= ONSET:
            bank.weigh(step, run.acting[k], level=level)
        before = after
    told = {one.suspect: one for one in bank.evidence()}
    assert len(told) == len(found) >= 12
    nu = np.concatenate([step.innovation for _, step in passed])
    S = np.zeros((nu.size, nu.size))
    for k, (_, step) in enumerate(passed):
        S[5 * k : 5 * k + 5, 5 * k : 5 * k + 5] = level * step.spread
    null = density(nu, S)
    for one in found:
        if one.how == STUCK and one.what[0] != "delta":
            continue
        G = responded(passed, effect(one, run, dt, passed))
        mean, free = (G[:, 0], G[:, 1:]) if one.how == STUCK else (np.zeros(nu.size), G)
        sizes = np.array(one.size[1:] if one.how == STUCK else one.size)
        if one.fixed and one.how != STUCK:
            mean, free, sizes = G[:, 0], G[:, :0], np.zeros(0)
        spread = S + (free * sizes**2) @ free.T
        score = 2.0 * (density(nu - mean, spread) - null)
        evidence = told[one]
        assert evidence.score == pytest.approx(score, rel=1e-4, abs=1e-4), one.cause
        assert evidence.onset == run.t[ONSET - 1]
        if sizes.size:
            weight = free.T @ np.linalg.solve(S, free) + np.diag(sizes**-2.0)
            size = np.linalg.solve(weight, free.T @ np.linalg.solve(S, nu - mean))
            sd = np.sqrt(np.diagonal(np.linalg.inv(weight)))
            np.testing.assert_allclose(evidence.size[-sizes.size :], size, rtol=1e-5, atol=1e-9)
            np.testing.assert_allclose(evidence.sigma[-sizes.size :], sd, rtol=1e-5)


def density(away: np.ndarray, spread: np.ndarray) -> float:
    """Logarithm of a Gaussian density, less a constant, whatever the units."""
    size = np.sqrt(np.diagonal(spread))
    root = np.linalg.cholesky(spread / np.outer(size, size))
    return float(-0.5 * np.sum(np.linalg.solve(root, away / size) ** 2) - np.sum(np.log(np.diagonal(root) * size)))


def responded(passed: list, added: np.ndarray) -> np.ndarray:
    """What added readings do to the innovations, through the gains that the filter had: shape (5 rows, components)."""
    z, out = np.zeros((11, added.shape[2])), []
    for (_, step), more in zip(passed, added, strict=True):
        z = step.onward @ z
        innovation = more - step.slope @ z
        z = z + step.gain @ innovation
        out.append(innovation)
    return np.concatenate(out)


SPOILT = {
    "position jumped": lambda run, k: run.readings[k].__iadd__([12.0, -8.0, 0.0, 0.0, 0.0]),
    "compass jumped": lambda run, k: run.readings[k].__iadd__([0.0, 0.0, 0.05, 0.0, 0.0]),
    "rate gyro jumped": lambda run, k: run.readings[k].__iadd__([0.0, 0.0, 0.0, 3e-3, 0.0]),
    "log jumped": lambda run, k: run.readings[k].__iadd__([0.0, 0.0, 0.0, 0.0, 0.8]),
    "delta sensor jumped": lambda run, k: run.acting[k].__iadd__([0.0, 0.05, *[0.0] * 8]),
}


@pytest.mark.parametrize("cause", slow_but(SPOILT, "log jumped"))
def test_a_sensor_that_jumps_is_the_best_suspect_with_its_size_and_onset(cause: str) -> None:
    run, follower = sailed(100), start()
    for k in range(50, 100):
        SPOILT[cause](run, k)
    bank, before = Bank(follower.machine, suspects(follower.machine)), follower
    judge = Judge(threshold(len(bank.suspects), 5.0, 0.2))
    for k in range(100):
        after, step = before.row(float(run.t[k]), run.acting[k], run.readings[k])
        if k % 5 == 0 or bank.surprised(step):
            bank.onset(before.t, run.acting[k], before.mean)
        bank.weigh(step, run.acting[k])
        before = after
        named = judge.named(after.t, bank.evidence())
        if named is not None:
            break
    else:
        pytest.fail("no alarm in 50 s")
    best, _ = named
    assert best.suspect.cause == cause
    assert best.score > judge.limit
    assert abs(best.onset - 50.0) <= 5.0
    sizes = {"position jumped": (12.0, -8.0), "compass jumped": (0.05,), "rate gyro jumped": (3e-3,),
             "log jumped": (0.8,), "delta sensor jumped": (0.05,)}[cause]  # fmt: skip
    for size, sigma, true in zip(best.size, best.sigma, sizes, strict=True):
        assert abs(size - true) < 4.0 * sigma + 0.1 * abs(true)
        assert sigma < 0.25 * abs(true)


@pytest.mark.slow
def test_no_more_false_alarms_than_are_accepted() -> None:
    """Ville's inequality over 100 runs of 200 s: the share of runs above 2 log(1/p) is p at most, and not far below."""
    above = {4.0: 0, 8.0: 0}
    runs = 100
    for seed in range(runs):
        follower, run = start(), sailed(60, 2.0, 1000 + seed)
        one = [s for s in suspects(follower.machine) if s.cause == "log jumped"]
        bank, before, top = Bank(follower.machine, one), follower, -math.inf
        for k in range(60):
            after, step = before.row(float(run.t[k]), run.acting[k], run.readings[k])
            if k == 20:
                bank.onset(before.t, run.acting[k], before.mean)
            if k >= 20:
                bank.weigh(step, run.acting[k])
                top = max(top, bank.evidence()[0].score)
            before = after
        for limit in above:
            above[limit] += top > limit
    for limit, count in above.items():
        p = math.exp(-0.5 * limit)
        assert count / runs < p + 3.0 * math.sqrt(p / runs)
    assert threshold(14, 5.0, 0.2) == pytest.approx(2.0 * math.log(86400.0 / 5.0 * 14 / 0.2))


def test_the_oldest_onset_makes_room_for_a_new_one() -> None:
    follower, run = start(), sailed(60)
    bank = Bank(replace(follower.machine, settings=replace(follower.machine.settings, window=20.0)), suspects(
        follower.machine))  # fmt: skip
    before = follower
    assert bank.latest == -math.inf
    for k in range(60):
        after, step = before.row(float(run.t[k]), run.acting[k], run.readings[k])
        if k % 5 == 0:
            bank.onset(before.t, run.acting[k], before.mean)
            assert bank.latest == before.t
        bank.weigh(step, run.acting[k])
        before = after
    onsets = {one.onset for one in bank.evidence()}
    assert onsets <= {40.0, 45.0, 50.0, 55.0}
    bank.clear()
    assert bank.evidence() == []
    assert DENSITY.shape == (11,)
