"""Sampling: known densities, bounds, ridges, tails, the same draws after a kill, and ranks of the truth."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import kstest, truncnorm

from seatrial.belief.ranks import calibrate
from seatrial.belief.sampling import sampling
from seatrial.belief.sampling.density import Density, check_proper, density_of
from seatrial.belief.sampling.hamiltonian import Sampler
from seatrial.belief.sampling.sampled import Sampled, effective, effective_mean, hopeless, rhat
from seatrial.belief.sampling.sampling import LEAST, HopelessError, sample
from seatrial.belief.sampling.walking import Walker
from seatrial.core.parameters import Free, near
from seatrial.identify import Loss, Nuisance, StudyError
from seatrial.identify.resume import ResumeError
from seatrial.identify.trajectory.gauss_newton import Normal
from seatrial.identify.trajectory.shooting import Trajectory
from suzaku_turns import GNSS, SHIP, problem

pytestmark = pytest.mark.slow

ESTIMATOR = Trajectory(window=600.0, every=10, method="euler", initial="measured", threads=2)
LOSS = Loss(GNSS, correlation=0.0)


def drawn(density, low, high, root, *, draws=600, warm=150, chains=8, seed=1):
    sampler = Sampler(density, low, high, warm, draws, seed, np.zeros(chains, dtype=np.intp))
    start = np.clip(np.random.default_rng(seed).standard_normal((chains, len(low))), low, high)
    return sampler.run(sampler.begun(start, root[None])), warm


def told(found, warm, low, high, laplace, tails=None) -> Sampled:
    free = tuple(Free(f"p_{k}", max(a, 0.0), a, b) for k, (a, b) in enumerate(zip(low, high, strict=True)))
    return Sampled(
        free, found.drawn[warm:], found.densities[warm:], found.accepted[warm:], int(found.divergent.sum()),
        np.zeros(len(low)), laplace, 1.0, tails or {}, 0.0, found.calls, "",
    )  # fmt: skip


def wide(n):
    return np.full(n, -np.inf), np.full(n, np.inf)


def gaussian(covariance):
    precision = np.linalg.inv(covariance)
    return lambda x: (-0.5 * np.einsum("li,ij,lj->l", x, precision, x), -x @ precision)


def test_a_gaussian_has_its_moments_and_laplace_is_said_to_hold():
    covariance = np.array([[4.0, 1.5, 0.0], [1.5, 1.0, 0.05], [0.0, 0.05, 0.01]])
    found, warm = drawn(gaussian(covariance), *wide(3), np.linalg.cholesky(covariance), draws=1500)
    one = told(found, warm, *wide(3), covariance)
    assert one.converged
    error = one.sigma / np.sqrt(effective_mean(one.draws))
    assert (np.abs(one.mean) < 4.0 * error).all()
    sigma = np.sqrt(np.diag(covariance))
    assert (np.abs(np.cov(one.flat.T) - covariance) < 0.1 * np.outer(sigma, sigma)).all()
    assert any("approximation holds" in line for line in one.words)


def test_a_metric_that_is_wrong_is_learned_in_the_warm_up():
    covariance = np.diag([100.0, 0.01])
    found, warm = drawn(gaussian(covariance), *wide(2), np.eye(2), draws=400, warm=300)
    one = told(found, warm, *wide(2), covariance)
    assert one.ratio == pytest.approx(1.0, abs=0.15)


def test_a_bound_reflects_and_is_named():
    """A half of a correlated Gaussian: its mean is not at the bound, its mode is."""
    covariance = np.array([[1.0, 0.8], [0.8, 1.0]])
    low, high = np.array([0.0, -np.inf]), np.full(2, np.inf)
    found, warm = drawn(gaussian(covariance), low, high, np.linalg.cholesky(covariance), draws=1500)
    one = told(found, warm, low, high, covariance)
    assert (one.flat[:, 0] >= 0).all()
    assert one.mean[0] == pytest.approx(truncnorm.mean(0, np.inf), abs=0.05)
    assert one.sigma[0] == pytest.approx(truncnorm.std(0, np.inf), abs=0.04)
    assert one.mean[1] == pytest.approx(0.8 * truncnorm.mean(0, np.inf), abs=0.06)
    assert one.cut == ("p_0",)
    assert any("Cut off by a bound" in line and "p_0" in line for line in one.words)
    assert any("approximation is off" in line for line in one.words)


def test_a_ridge_of_a_product_is_named():
    """Data fix the product of two positive parameters within one per cent, the prior each within a factor."""

    def density(x):
        away = (x[:, 0] * x[:, 1] - 1.0) / 0.01
        log = -0.5 * away**2 - 0.5 * ((x - 1.0) ** 2 / 0.3**2).sum(axis=1)
        return log, -(away / 0.01)[:, None] * x[:, ::-1] - (x - 1.0) / 0.3**2

    low, high = np.full(2, 0.2), np.full(2, 5.0)
    # Laplace at (1, 1): tight across, 0.3 along.
    H = np.array([[1.0, 1.0], [1.0, 1.0]]) / 0.01**2 + np.eye(2) / 0.3**2
    laplace = np.linalg.inv(H)
    found, warm = drawn(density, low, high, np.linalg.cholesky(laplace), draws=400, warm=200)
    one = told(found, warm, low, high, laplace)
    assert np.std(one.flat.prod(axis=1)) == pytest.approx(0.01, rel=0.15)
    assert any("ridge" in line and "p_0 and p_1" in line for line in one.words)


def test_two_modes_that_no_chain_leaves_are_no_convergence():
    def density(x):
        away = (np.abs(x) - 10.0)
        return -0.5 * (away**2).sum(axis=1), -away * np.sign(x)

    found, warm = drawn(density, *wide(1), np.eye(1), draws=200)
    one = told(found, warm, *wide(1), np.eye(1))
    assert not one.converged
    assert "do not agree" in one.words[0]


def test_chains_that_lie_apart_are_given_up_and_the_direction_is_named():
    """R-hat squared less one falls as one over the draws; apart along the difference of two of three parameters."""
    draws = np.random.default_rng(0).standard_normal((60, 8, 3))
    assert hopeless(draws, ("a", "b", "c"), 240, 10.0) == ""
    away = draws + np.arange(8)[:, None] * np.array([1.0, -1.0, 0.0])
    why = hopeless(away, ("a", "b", "c"), 240, 60.0)
    now = rhat(away).max()
    assert f"R-hat is {now:.2f}" in why
    assert f"about {np.sqrt(1.0 + (now**2 - 1.0) / 4.0):.2f} at the end" in why
    needed = int(np.ceil(60 * (now**2 - 1.0) / (1.01**2 - 1.0)))
    assert f"takes some {needed} draws of each chain, {needed / 3600.0:.1f} h" in why
    assert "along b, a," in why or "along a, b," in why
    # so little apart that four times as many draws will do
    near = draws + 0.12 * np.arange(8)[:, None] * np.array([1.0, -1.0, 0.0])
    assert hopeless(near, ("a", "b", "c"), 240, 10.0) == ""


def test_chains_are_judged_once_by_the_same_draws_and_leave_their_checkpoint(turns, fitted, tmp_path, monkeypatch):
    seen = []

    def judge(draws, paths, count, seconds):
        seen.append((draws, paths, count))
        return "no" if len(seen) == 2 else ""

    monkeypatch.setattr(sampling, "hopeless", judge)
    sample(fitted, turns, ESTIMATOR, 2 * LEAST, seed=2)
    file = tmp_path / "checkpoint.npz"
    with pytest.raises(HopelessError, match="no"):
        sample(fitted, turns, ESTIMATOR, 2 * LEAST, seed=2, checkpoint=file)
    assert file.exists()
    assert len(seen) == 2
    assert seen[0][0].shape[:2] == (50, 8)
    assert np.array_equal(seen[0][0], seen[1][0])
    assert seen[0][1:] == (tuple(one.path for one in turns.free), 100)


def test_heavy_tails_are_named():
    found, warm = drawn(gaussian(np.eye(1)), *wide(1), np.eye(1), draws=100)
    assert not any("tails" in line for line in told(found, warm, *wide(1), np.eye(1), {"u": 1.1}).words)
    assert any("heavier tails" in line and "u 6.0 times" in line
               for line in told(found, warm, *wide(1), np.eye(1), {"u": 6.0, "r": 1.0}).words)  # fmt: skip


def test_r_hat_and_effective_size_of_known_chains():
    rng = np.random.default_rng(0)
    white = rng.standard_normal((1000, 4, 1))
    assert rhat(white)[0] < 1.01
    assert effective(white)[0] == pytest.approx(4000, rel=0.2)
    slow = np.zeros((4000, 4, 1))
    for k in range(1, 4000):
        slow[k] = 0.9 * slow[k - 1] + rng.standard_normal((4, 1))
    assert effective(slow)[0] == pytest.approx(16000 * 0.1 / 1.9, rel=0.25)
    assert rhat(white + np.array([0.0, 0.0, 0.0, 2.0])[:, None])[0] > 1.2


def test_the_diagnostics_are_those_of_arviz():
    az = pytest.importorskip("arviz")
    rng = np.random.default_rng(3)
    draws = np.cumsum(rng.standard_normal((300, 4, 1)), axis=0) * 0.05 + rng.standard_normal((300, 4, 1))
    same = draws[:, :, 0].T
    assert rhat(draws)[0] == pytest.approx(float(az.rhat(same)), rel=1e-3)
    assert effective(draws)[0] == pytest.approx(float(az.ess(same)), rel=0.03)


def walked(density, mean, sigma, low, high, root, *, draws=400, warm=300, chains=8, seed=1):
    n = len(mean)
    walker = Walker(density, np.array([mean]), np.array([sigma]), low, high, warm, draws, seed,
                    np.zeros(chains, dtype=np.intp))  # fmt: skip
    start = np.clip(np.asarray(mean) + np.random.default_rng(seed).standard_normal((chains, n)), low, high)
    return walker.run(walker.begun(start, root[None])).drawn[warm:]


def test_a_walk_has_the_moments_of_prior_and_data_together():
    """Twenty parameters, of which data fix one closely, one loosely and leave the others to the prior."""
    n = 20
    mean, sigma, data = np.arange(n) / 10.0, np.full(n, 2.0), np.zeros(n)
    data[0], data[1] = 0.01**-2, 1.0
    found = walked(lambda x: -0.5 * ((data * (x - 1.0) ** 2).sum(axis=1) + (((x - mean) / sigma) ** 2).sum(axis=1)),
                   mean, sigma, *wide(n), np.diag(np.append([0.02, 1.0], np.full(n - 2, 1.0))))  # fmt: skip
    precision = data + sigma**-2
    error = effective_mean(found) ** -0.5
    away = (found.mean(axis=(0, 1)) - (data + mean * sigma**-2) / precision) * np.sqrt(precision)
    assert (np.abs(away) < 4.5 * error).all()
    assert found.std(axis=(0, 1)) * np.sqrt(precision) == pytest.approx(1.0, abs=0.15)
    # Twenty moves are an independent draw, as data fix two directions; a walk through all takes three times as many.
    assert effective(found).min() > 0.6 * found.shape[0] * found.shape[1]


def test_a_walk_does_not_mind_small_jumps_or_a_bound():
    """A density that a gradient would misread: steps of 0.5 in its logarithm at every tenth."""

    def density(x):
        return -0.5 * (x[:, 0] ** 2) + 0.5 * (np.floor(10.0 * x[:, 0]) % 2)

    low, high = np.array([0.0]), np.array([np.inf])
    found = walked(density, [0.0], [1.0], low, high, np.eye(1), draws=3000)
    x = np.arange(0.0005, 6.0, 0.001)
    weight = np.exp(density(x[:, None]))
    assert (found >= 0.0).all()
    assert found.mean() == pytest.approx(np.average(x, weights=weight), abs=0.04)
    odd = np.floor(10.0 * x) % 2 == 1
    assert (np.floor(10.0 * found) % 2).mean() == pytest.approx(weight[odd].sum() / weight.sum(), abs=0.02)


@pytest.fixture(scope="module")
def turns():
    told = problem(SHIP, loss=LOSS, angles=(10, -35), paths=("hull.R_0", "rudder.kappa"), duration=200.0)
    free = tuple(replace(f, prior=f.start, sigma=0.3 * abs(f.start)) for f in near(told.ship.model, "hull.R_0",
                 "rudder.kappa", ratio=0.8))  # fmt: skip
    return replace(told, free=free)


@pytest.fixture(scope="module")
def fitted(turns):
    return ESTIMATOR.fit(turns)


def test_the_gradient_is_that_of_the_density(turns, fitted):
    posterior = density_of(fitted, turns, ESTIMATOR)
    at = fitted.values + 0.7 * fitted.sigma
    for k in range(2):
        h = 1e-4 * fitted.sigma[k] * np.eye(2)[k]
        up, down = posterior(np.stack([at + h, at - h]))[0]
        assert posterior(at[None])[1][0, k] == pytest.approx((up - down) / (2 * h[k]), rel=1e-5)


def test_the_density_without_a_gradient_is_the_one_with(turns, fitted):
    posterior = density_of(fitted, turns, ESTIMATOR)
    values = fitted.values + np.linspace(-1.0, 1.0, 5)[:, None] * fitted.sigma
    assert posterior.value(values) == pytest.approx(posterior(values)[0], rel=1e-12)
    values[2, 0] = np.nan
    assert posterior.value(values)[2] == -np.inf


def test_draws_of_a_ship_agree_with_laplace_where_that_is_right(turns, fitted):
    one = sample(fitted, turns, ESTIMATOR, LEAST, seed=2)
    assert (np.abs(one.shift) < 0.3).all()
    assert (np.abs(np.log(one.ratio)) < 0.2).all()
    scaled = one.laplace / stated(fitted)  # residuals widen each sigma by itself, draws all by one factor
    assert scaled == pytest.approx(np.full((2, 2), scaled[0, 0]), rel=0.05)
    assert np.log(np.sqrt(np.diag(one.laplace)) / fitted.sigma).mean() == pytest.approx(0.0, abs=0.02)


def stated(fit):
    """Laplace's covariance by the loss as it is stated."""
    widened = np.array([fit.diagnosis.widened.get(path, 1.0) for path in fit.vector.paths])
    return fit.covariance / np.outer(widened, widened)


def test_a_run_that_was_killed_ends_with_the_same_draws(turns, fitted, tmp_path, monkeypatch):
    monkeypatch.setattr(sampling, "_PAUSE", 0.0)
    whole, file = sample(fitted, turns, ESTIMATOR, LEAST, seed=4), tmp_path / "checkpoint.npz"

    def kill(done, count):
        if done == 40:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sample(fitted, turns, ESTIMATOR, LEAST, seed=4, checkpoint=file, told=kill)
    again = sample(fitted, turns, ESTIMATOR, LEAST, seed=4, checkpoint=file)
    assert np.array_equal(again.draws, whole.draws)
    with pytest.raises(ResumeError, match="belongs to another problem"):
        sample(fitted, turns, ESTIMATOR, LEAST, seed=5, checkpoint=file)


def test_the_factor_is_found_however_wrong_sigma_was(turns, fitted):
    """A loss a million times too sure, as of a channel without noise: the draws are as wide as with the right one."""
    sure = replace(turns, loss=Loss({name: 1e-6 * one for name, one in LOSS.sigma.items()}, 0.0))
    wrong, right = (density_of(fitted, told, ESTIMATOR).laplace(fitted.values[None])[0] for told in (sure, turns))
    assert wrong == pytest.approx(right, rel=2e-3)
    assert np.log(np.sqrt(np.diag(right)) / fitted.sigma).mean() == pytest.approx(0.0, abs=1e-3)


def test_what_is_not_sampled_is_refused_in_one_line(turns, fitted):
    with pytest.raises(StudyError, match=f"draw {LEAST} or more"):
        sample(fitted, turns, ESTIMATOR, 10)
    with pytest.raises(StudyError, match=r"\[nuisance\] current"):
        density_of(fitted, replace(turns, nuisance=Nuisance(current=0.1)), ESTIMATOR)
    with pytest.raises(StudyError, match=r"estimator\.stride"):
        density_of(fitted, turns, replace(ESTIMATOR, stride=50.0))
    with pytest.raises(StudyError, match="compares no trajectories"):
        density_of(fitted, turns, object())


def test_a_direction_that_nothing_limits_is_no_posterior(turns):
    """The data fix a sum, without prior and bounds nothing fixes the difference; bounds on both do."""
    open_ = replace(turns, free=tuple(Free(f.path, f.start) for f in turns.free))
    normal = Normal(1.0, 1e6 * np.ones((2, 2)), np.zeros(2))
    with pytest.raises(StudyError, match=r"nothing limits hull\.R_0 and rudder\.kappa: neither data, prior nor"):
        check_proper(normal, open_)
    check_proper(normal, turns)


def test_ranks_of_the_truth_are_uniform_where_the_posterior_is_right(turns):
    found = calibrate(turns, ESTIMATOR, repeats=16, draws=30, seed=5)
    assert found.shape == (16, 2)
    for column in found.T:
        assert kstest(column, "uniform").pvalue > 0.01


@pytest.mark.long
def test_ranks_tell_a_posterior_that_is_too_narrow(turns, monkeypatch):
    call = Density.__call__

    def narrow(self, values):
        density, gradient = call(self, values)
        return 25.0 * density, 25.0 * gradient

    monkeypatch.setattr(Density, "__call__", narrow)
    found = calibrate(turns, ESTIMATOR, repeats=40, draws=60, seed=5)
    assert min(kstest(column, "uniform").pvalue for column in found.T) < 0.01


@pytest.mark.long
@pytest.mark.parametrize("name", ["suzaku", "kvlcc2_l7", "esso_osaka_3m", "kcs", "mariner"])
def test_ranks_of_two_hundred_truths_are_uniform_for_five_ships(name, monkeypatch):
    """Coefficients of each ship from a zigzag with the noise of instruments, as the benchmark has them."""
    monkeypatch.syspath_prepend(str(Path(__file__).parents[3] / "benchmarks"))
    from ranks import SHIPS, ranks

    found = ranks(name)
    assert found.shape == (200, len(SHIPS[name]))
    for column in found.T:
        assert kstest(column, "uniform").pvalue > 0.01
