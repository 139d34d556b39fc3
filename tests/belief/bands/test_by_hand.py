"""Parts of the bands against closed forms: a filter and one joint normal law, widths term by term, factors by hand."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from known_calibration import H, made

from seatrial.belief.bands import beginnings
from seatrial.belief.bands.beginnings import by_first
from seatrial.belief.bands.calibrating import horizons_of, spread
from seatrial.belief.bands.calibration import Calibration, Left, best_share
from seatrial.belief.bands.conformal import _prior, _quantile, _sizes, factors, needed, shown
from seatrial.belief.bands.crossed import crossed
from seatrial.belief.bands.disturbance import Disturbance, Process
from seatrial.belief.bands.held import Windows as Counted
from seatrial.belief.bands.held import held, windows
from seatrial.belief.bands.learning import LAYOUT, Windows, quiet
from seatrial.belief.bands.past import Filter, Past, _Belief, _onwards, disturbing, enough
from seatrial.belief.bands.prediction import Fan, Runs, whole
from seatrial.belief.bands.sailing import FreeRuns, Uncertain, sailed
from seatrial.core.errors import RequestError
from seatrial.data import DataError, Trial
from seatrial.models import STATES
from seatrial.simulate.loop import open_loop
from virtual_logs import ship


def trial(name: str, duration: float, dt: float = 0.5, **channels: Any) -> Trial:
    t = np.arange(0.0, duration + 0.5 * dt, dt)
    zero = {one: np.zeros(len(t)) for one in (*STATES, "n_P", "delta")}
    return Trial(name, t, zero | channels)


# --- the filter ----------------------------------------------------------------------------------------------------


def test_the_filter_knows_what_a_joint_normal_law_of_all_readings_says() -> None:
    """Three velocities, one process and a current, read at four times: conditioned at once, and step by step."""
    rng = np.random.default_rng(1)
    noise, n, steps = np.array([0.04, 0.09, 0.01]), 6, 4
    towards = 0.1 * rng.standard_normal((steps, 3, 3))
    drives = rng.standard_normal((steps, 3, 3))
    moved, speeds = rng.standard_normal((steps, 3)), rng.standard_normal((steps, 3))
    read, kept = rng.standard_normal((steps + 1, 3)), np.array([0.7])
    belief = _Belief.of(1, 1, noise)
    yes = np.array([True])
    for k in range(steps + 1):
        belief.read(yes, read[k : k + 1])
        if k < steps:
            belief.mean, belief.cov = _onwards(belief.mean, belief.cov, moved[k : k + 1], towards[k : k + 1],
                                               drives[k : k + 1], speeds[k : k + 1], kept)  # fmt: skip
    # z_0 about the first reading; z_k+1 = A_k z_k + b_k + w_k; every later reading is H z_k + e_k
    mean, cov = np.zeros((steps + 1, n)), np.zeros((steps + 1, steps + 1, n, n))
    mean[0, :3] = read[0]
    cov[0, 0] = np.diag([*noise, 1.0, 1.0, 1.0])
    for k in range(steps):
        A = np.eye(n)
        A[:3, :3] += towards[k]
        A[:3, 3:] = drives[k]
        A[3, 3] = 0.7
        mean[k + 1] = A @ mean[k]
        mean[k + 1, :3] += moved[k] - towards[k] @ speeds[k]
        for j in range(k + 1):
            cov[k + 1, j] = A @ cov[k, j]
            cov[j, k + 1] = cov[k + 1, j].T
        cov[k + 1, k + 1] = A @ cov[k, k] @ A.T
        cov[k + 1, k + 1, 3, 3] += 1.0 - 0.49
    seen = np.concatenate([mean[k, :3] for k in range(1, steps + 1)])
    S = np.block([[cov[i, j, :3, :3] + (i == j) * np.diag(noise) for j in range(1, steps + 1)]
                  for i in range(1, steps + 1)])  # fmt: skip
    C = np.hstack([cov[steps, j, :, :3] for j in range(1, steps + 1)])
    off = read[1:].ravel() - seen
    assert belief.mean[0] == pytest.approx(mean[steps] + C @ np.linalg.solve(S, off))
    after = cov[steps, steps] - C @ np.linalg.solve(S, C.T)
    assert belief.cov[0] == pytest.approx(after, abs=1e-9)
    # the innovations are the readings made independent: their squares and densities add up to those of the joint law
    assert 3.0 * belief.surprise[0] == pytest.approx(off @ np.linalg.solve(S, off))
    assert belief.unlikely[0] == pytest.approx(0.5 * (np.linalg.slogdet(S)[1] + off @ np.linalg.solve(S, off)))
    told = belief.told(2.5, np.zeros((1, 3)))
    assert told.mean[0] == pytest.approx(belief.mean[0, 3:])
    assert told.root[0] @ told.root[0].T == pytest.approx(after[3:, 3:], abs=1e-8)
    assert told.seconds[0] == pytest.approx(4 * 2.5)
    assert told.surprise[0] == pytest.approx(math.sqrt(belief.surprise[0] / 4.0))
    assert told.unlikely[0] == pytest.approx(belief.unlikely[0] / 4.0)


def test_a_reading_that_is_missing_changes_nothing_and_the_first_one_is_where_it_begins() -> None:
    belief = _Belief.of(2, 1, np.array([0.04, 0.09, 0.01]))
    belief.read(np.array([True, False]), np.array([[1.0, 2.0, 3.0], [9.0, 9.0, 9.0]]))
    assert belief.begun.tolist() == [True, False]
    assert belief.mean[0, :3].tolist() == [1.0, 2.0, 3.0]
    assert np.diag(belief.cov[0])[:3] == pytest.approx([0.04, 0.09, 0.01])
    assert (belief.mean[1] == 0.0).all()
    assert belief.count.tolist() == [0.0, 0.0]


@pytest.mark.parametrize(("by", "sense"), [("water", 1.0), ("air", -1.0)])
def test_speeds_through_water_and_air_are_those_of_vectors(by: str, sense: float) -> None:
    """Water moves towards, wind comes from: over ground less the current, over ground plus the wind's direction."""
    names = ["n_P", "delta", "wind_x", "wind_y", "current_x", "current_y"]
    own: Any = SimpleNamespace(kernel=SimpleNamespace(system=SimpleNamespace(series=names)))
    rng = np.random.default_rng(2)
    state, series = rng.standard_normal((7, 6)), rng.standard_normal((7, 6))
    psi = state[:, 2]
    north = state[:, 3] * np.cos(psi) - state[:, 4] * np.sin(psi)
    east = state[:, 3] * np.sin(psi) + state[:, 4] * np.cos(psi)
    k = 4 if by == "water" else 2
    through = (north - sense * series[:, k]) ** 2 + (east - sense * series[:, k + 1]) ** 2
    assert Filter._grows(own, by, state, series) == pytest.approx(through)
    assert (Filter._grows(own, "", state, series) == 1.0).all()


@pytest.mark.slow
def test_what_acted_acts_on_fading_in_its_own_time_with_the_current_beside_it() -> None:
    lacks = Disturbance((Process("u", 2e-3, 5.0), Process("r", 1e-3, 40.0)), 0.05)
    filters = Filter.of(ship(), lacks, np.zeros(6), 20.0)
    names = filters.kernel.system.series
    series = np.zeros((2, 11, len(open_loop(ship()).series)))
    lanes = FreeRuns(np.array([[0.0, 0.0, 0.3, 0.7, 0.0, 0.0]] * 2), series, 0.5, 2)
    mean = np.array([[1.5, -0.5, 0.4, -2.0], [0.0, 1.0, 0.0, 0.0]])
    acted = np.array([[1e-3, 0.0, 0.0], [0.0, 0.0, 2e-3]])
    past = Past(mean, np.tile(np.eye(4), (2, 1, 1)), np.zeros(2), np.full(2, 20.0), acted, np.zeros(2))
    made = filters.ahead(lanes, past, "filtered")
    t = 0.5 * np.arange(11)
    assert made.shape == (2, 11, len(names))
    assert made[0, :, -3] == pytest.approx(2e-3 * 1.5 * np.exp(-t / 5.0))
    assert made[0, :, -1] == pytest.approx(1e-3 * -0.5 * np.exp(-t / 40.0))
    assert made[1, :, -1] == pytest.approx(1e-3 * np.exp(-t / 40.0))
    assert (made[:, :, -2] == 0.0).all()
    assert made[0, :, names.index("current_x")] == pytest.approx(0.05 * 0.4)
    assert made[0, :, names.index("current_y")] == pytest.approx(0.05 * -2.0)
    usual = filters.ahead(lanes, past, "usual")
    assert usual[0, 0, -3:] == pytest.approx([1e-3, 0.0, 0.0])
    assert usual[1, 0, -3:] == pytest.approx([0.0, 0.0, 2e-3])
    shares = usual[0, :, -3] / usual[0, 0, -3]
    assert shares[1:-1] ** 2 == pytest.approx(shares[:-2] * shares[2:])
    assert 0.0 < shares[-1] < 1.0
    assert (usual[:, :, names.index("current_x")] == 0.0).all()


def test_too_short_a_past_counts_as_none_from_half_of_the_seconds_on() -> None:
    own: Any = SimpleNamespace(span=20.0)
    rng = np.random.default_rng(3)
    past = Past(rng.standard_normal((3, 4)), rng.standard_normal((3, 4, 4)), np.ones(3), np.array([9.9, 10.0, 20.0]),
                np.ones((3, 3)), np.ones(3))  # fmt: skip
    found = enough(own, past)
    assert found.seconds.tolist() == [0.0, 10.0, 20.0]
    assert (found.mean[0] == 0.0).all()
    assert (found.root[0] == np.eye(4)).all()
    assert found.surprise.tolist() == [0.0, 1.0, 1.0]
    assert (found.acted[0] == 0.0).all()
    assert found.mean[1:].tolist() == past.mean[1:].tolist()
    few = past.rows(np.array([True, False, True]))
    assert few.seconds.tolist() == [9.9, 20.0]


def test_the_smaller_of_two_currents_counts() -> None:
    one = Disturbance((), 0.05)
    assert disturbing(one, math.inf).current == 0.05
    assert disturbing(one, 0.01).current == 0.01


# --- widths, term by term ------------------------------------------------------------------------------------------


def test_a_spread_is_that_of_the_draws_that_stay_finite_and_of_a_reading() -> None:
    rng = np.random.default_rng(4)
    runs = rng.standard_normal((50, 2, 3, 6))
    runs[7, 1, 2, 4] = np.nan
    runs[9, 1, 2, 4] = np.inf
    sigma = np.array([0.5, 0.0, 0.1, 0.0, 2.0, 0.0])
    found = spread(runs, sigma)
    for lane in range(2):
        for row in range(3):
            for k in range(6):
                one = runs[:, lane, row, k]
                one = one[np.isfinite(one)]
                assert found[lane, row, k] == pytest.approx(math.sqrt(one.var() + sigma[k] ** 2))


@pytest.mark.slow
def test_each_source_widens_by_itself_and_together_as_the_root_of_squares() -> None:
    """Of a ship adrift: a start that is off, and a surge that is pushed; each twice as large is twice as wide."""
    lanes = FreeRuns(np.zeros((300, 6)), np.zeros((300, 41, len(open_loop(ship()).series))), 0.5, 20)
    start = np.array([0.2, 0.1, 0.0, 0.0, 0.0, 0.0])
    still = [Process(on, 0.0, 5.0, by) for on, by in LAYOUT]
    still[LAYOUT.index(("u", ""))] = Process("u", 1e-4, 5.0)
    force = Disturbance(tuple(still))
    none = quiet(ship(), 8)

    def wide(times: float, *, off: bool, pushed: bool) -> Any:
        who = Uncertain((), none.draws, times * start * off,
                        replace(force, processes=tuple(replace(p, sigma=times * p.sigma) for p in force.processes))
                        if pushed else none.disturbance)  # fmt: skip
        runs = sailed(ship(), lanes, who, 5)
        return spread(runs.reshape(-1, 1, *runs.shape[2:]), np.zeros(6))[0]

    calm, both = wide(1.0, off=False, pushed=False), wide(1.0, off=True, pushed=True)
    off, pushed = wide(1.0, off=True, pushed=False), wide(1.0, off=False, pushed=True)
    assert np.abs(calm).max() < 1e-12
    assert off[:, :2] == pytest.approx(np.tile(start[:2], (3, 1)), rel=0.06)
    t, tau = 20.0, 5.0
    # a ship of no speed is hardly damped: the double integral of the process, by its covariance
    s = np.linspace(0.0, t, 401)
    lag = np.abs(s[:, None] - s)
    square = np.trapezoid(np.trapezoid((t - s[:, None]) * (t - s) * np.exp(-lag / tau), s), s)
    assert pushed[-1, 0] == pytest.approx(1e-4 * math.sqrt(square), rel=0.1)
    assert both[-1, 0] ** 2 == pytest.approx(off[-1, 0] ** 2 + pushed[-1, 0] ** 2, rel=0.1)
    assert wide(2.0, off=True, pushed=False)[-1, 0] == pytest.approx(2.0 * off[-1, 0], rel=1e-6)
    assert wide(2.0, off=False, pushed=True)[-1, 3] == pytest.approx(2.0 * pushed[-1, 3], rel=0.02)


def test_tracks_are_moved_until_they_are_as_wide_as_the_bands() -> None:
    """Draws of deviation s about the fitted run: half widths over 1.645 s of the level of 90 %, the last one kept."""
    rng = np.random.default_rng(6)
    t, states = np.arange(4.0), rng.standard_normal((4000, 4, 6)) * np.array([1.0, 2.0, 3.0, 4.0])[None, :, None]
    fitted = rng.standard_normal((4, 8))
    drawn = np.concatenate([fitted[None, :, :6] + states, np.zeros((4000, 4, 2))], axis=2)
    half = np.tile(np.array([2.0, 3.0, 4.0, np.nan])[:, None], (1, 6))
    run = Runs(t, tuple("abcdefgh"), fitted, drawn, half, 0.9)
    wide = (run.tracks - fitted[:, :6]).std(axis=0)
    assert wide[:3] == pytest.approx(half[:3] / 1.644854, rel=0.05)
    # row 2 has half width 4 of a deviation of 3: the same factor stands for the row after
    assert wide[3] == pytest.approx(4.0 * 4.0 / (3.0 * 1.644854), rel=0.06)
    inside = (np.abs(run.tracks - fitted[:, :6]) <= half)[:, :3].mean(axis=(0, 2))
    assert inside == pytest.approx(0.9, abs=0.02)


def test_lanes_end_with_a_full_row() -> None:
    lanes = FreeRuns(np.zeros((1, 6)), np.arange(24.0).reshape(1, 8, 3), 0.5, 3)
    assert lanes.t.tolist() == [0.0, 1.5, 3.0]
    full = whole(lanes)
    assert full.series.shape == (1, 10, 3)
    assert full.series[0, 8:].tolist() == [[21.0, 22.0, 23.0]] * 2
    assert full.t.tolist() == [0.0, 1.5, 3.0, 4.5]
    exact = replace(lanes, series=lanes.series[:, :7])
    assert whole(exact).series.shape == (1, 7, 3)


# --- horizons, rows and coverage -----------------------------------------------------------------------------------


def test_horizons_are_multiples_of_the_first_to_where_nineteen_recordings_reach() -> None:
    many = [trial(f"t{k}", 30.0 + k) for k in range(25)]  # the nineteenth longest lasts 36 s
    found = horizons_of(many, 5.0, None)
    assert found[0] == pytest.approx(3.5)  # .7 L/U
    assert found[-1] <= 36.0
    assert found[-1] > 36.0 - found[0]
    assert (np.diff(found) > 0).all()
    assert found / found[0] == pytest.approx(np.round(found / found[0]))
    ratio = found[1:] / found[:-1]
    assert ratio[-2:] == pytest.approx(1.4, abs=0.1)  # of whole multiples
    assert horizons_of(many, 100.0, None)[0] == pytest.approx(4.5)  # an eighth of the longest
    slow = horizons_of(many, 9.0, 40.0)
    assert slow[0] == pytest.approx(5.0)  # whole multiples of ten rows where it is longer than that
    assert slow[-1] <= 40.0
    assert horizons_of(many, 5.0, 1.0).tolist() == [0.5, 1.0]  # of two rows, both
    assert horizons_of(many[:10], 5.0, None)[-1] <= 30.0  # as far as all of fewer reach
    with pytest.raises(RequestError, match="1 recordings"):
        horizons_of(many[:1], 5.0, None)


def fanned(measured: Trial, starts: tuple[int, ...], half: float) -> Fan:
    since = np.zeros(len(measured))
    for a in starts:
        since[a:] = measured.t[a:] - measured.t[a]
    return Fan(measured.having(x=measured["x"] + since), since, np.full((len(measured), 6), half), 0.9, "turn", ())


def test_a_band_holds_what_is_no_farther_to_either_side() -> None:
    error = np.array([-2.0, -1.0, 0.5, 1.5, np.nan])[:, None, None] * np.ones((5, 1, 6))
    (row,) = held([Counted.of("turn", (4.0,), error, np.ones((5, 1, 6)))])
    assert row.inside == dict.fromkeys(("position", "heading", "speeds"), 0.5)
    assert (row.horizon, row.windows, row.trials) == (4.0, 4, 1)
    assert row.distance == pytest.approx(math.sqrt(2.0 * (4.0 + 1.0 + 0.25 + 2.25) / 4.0))


@pytest.mark.parametrize("offset", [0, 1, 2])
def test_a_slow_receiver_counts_with_its_last_reading_before_a_horizon(offset: int) -> None:
    """A reading of x every third row: the error, which is the seconds since a start, is that of the reading."""
    whole = trial("m", 30.0)
    x = np.where(np.arange(len(whole)) % 3 == offset, whole["x"], np.nan)
    one = windows(fanned(whole, (0, 20, 40), 6.0), whole.having(x=x), (9.0,))
    for k, start in enumerate((0, 20, 40)):
        rows = np.flatnonzero(np.isfinite(x) & (np.arange(len(whole)) >= start))
        since = whole.t[rows] - whole.t[start]
        assert one.error[k, 0, 0] == pytest.approx(max(s for s in since if s <= 9.0))


def test_a_gap_at_a_horizon_has_no_reading_however_near_the_last_one() -> None:
    """Readings each half second that stop 1.5 s before the horizon of the first start."""
    whole = trial("m", 30.0)
    x = np.where((whole.t > 7.5) & (whole.t <= 9.5), np.nan, whole["x"])
    one = windows(fanned(whole, (0, 20, 40), 6.0), whole.having(x=x), (9.0,))
    assert np.isnan(one.error[0, 0, 0])
    assert one.error[1:, 0, 0].tolist() == [9.0, 9.0]


def test_the_row_of_a_horizon_is_so_long_after_its_own_start() -> None:
    """Errors that are the seconds since a start: at a horizon of h they are h, where a window is that long."""
    measured = trial("m", 30.0)
    one = windows(fanned(measured, (0, 20, 40), 6.0), measured, (4.0, 9.0, 10.0, 12.0))
    assert one.error[:, :2, 0].tolist() == [[4.0, 9.0]] * 3
    assert one.error[:, 2, 0].tolist() == [9.5, 9.5, 10.0]  # a restart stands where the window would end
    assert np.isnan(one.error[:, 3]).all()
    rows = held([one])
    assert [row.horizon for row in rows] == [4.0, 9.0, 10.0]
    assert [row.inside["position"] for row in rows] == [1.0, 0.5, 0.5]
    assert [row.inside["heading"] for row in rows] == [1.0, 1.0, 1.0]
    assert rows[0].error["x"] == pytest.approx(4.0)
    assert rows[0].width["x"] == pytest.approx(6.0)
    assert (rows[0].windows, rows[0].trials) == (3, 1)
    assert rows[2].error["x"] == pytest.approx(math.sqrt((9.5**2 + 9.5**2 + 10.0**2) / 3.0))


@pytest.mark.slow
def test_coverage_on_a_recording_is_judged_by_the_factors_of_the_others() -> None:
    found = made(recordings=22, windows=3)
    rows = crossed(found, 0.9, [1])
    left = found.left
    scale = left.spread**found.share * left.usual ** (1.0 - found.share)
    inside, count = 0.0, 0
    groups = np.array(left.groups)
    for name in dict.fromkeys(left.groups):
        others = np.flatnonzero(groups != name)
        made_of = factors(left.scores(found.share)[others], [left.groups[k] for k in others],
                          [left.kinds[k] for k in others], 0.9, ([0, 1],))  # fmt: skip
        for k in np.flatnonzero(groups == name):
            factor = made_of.factor[made_of.kinds.index(left.kinds[k]), 1, 2]
            inside += abs(left.error[k, 1, 2]) <= factor * scale[k, 1, 2]
            count += 1
    (every,) = [row for row in rows if row.kind == "all kinds"]
    assert every.horizon == H[1]
    assert (every.windows, every.trials) == (count, 22)
    assert every.inside["heading"] == pytest.approx(inside / count)
    few = replace(found, left=replace(left, **{name: tuple(getattr(left, name)[:9]) for name in (
        "trials", "groups", "kinds")}, error=left.error[:9], spread=left.spread[:9]))  # fmt: skip
    assert crossed(few, 0.9) == (), "three recordings: two others tell no scale"


# --- factors -------------------------------------------------------------------------------------------------------


def test_sizes_of_kinds_are_drawn_towards_their_geometric_middle() -> None:
    square, kind = np.array([1.0, 3.0, 16.0, 100.0]), np.array([0, 0, 1, 1])
    here = np.array([True, True, True, False])
    middle = math.sqrt(2.0 * 16.0)
    found = _sizes(square, here, kind, 2, 3.0)
    assert found == pytest.approx([math.sqrt((4.0 + 3.0 * middle) / 5.0), math.sqrt((16.0 + 3.0 * middle) / 4.0)])


def test_the_middle_counts_by_how_much_recordings_differ_within_kinds_and_between() -> None:
    a, b = np.array([1.0, 2.0, 3.0]), np.array([10.0, 14.0])
    square, kind = np.concatenate([a, b]), np.array([0, 0, 0, 1, 1])
    within = 0.5 * (a.var(ddof=1) / a.mean() ** 2 + b.var(ddof=1) / b.mean() ** 2)
    means = np.array([a.mean(), b.mean()])
    between = means.var(ddof=1) / means.mean() ** 2 - within * 0.5 * (1 / 3 + 1 / 2)
    every = np.ones(5, dtype=bool)
    assert within / between < 0.25  # so that the least of a quarter of a recording counts
    assert _prior(square, every, kind, 2) == 0.25
    wild = np.array([1.0, 9.0, 2.0, 14.0, 3.0])
    assert _prior(wild, every, kind, 2) == 10.0
    assert _prior(square, every, np.zeros(5, dtype=int), 1) == 10.0
    some = np.array([1.0, 4.0, 7.0, 10.0, 30.0])
    p, q = some[:3], some[3:]
    within = 0.5 * (p.var(ddof=1) / p.mean() ** 2 + q.var(ddof=1) / q.mean() ** 2)
    means = np.array([p.mean(), q.mean()])
    between = means.var(ddof=1) / means.mean() ** 2 - within * 0.5 * (1 / 3 + 1 / 2)
    assert 0.25 < within / between < 10.0
    assert _prior(some, every, kind, 2) == pytest.approx(within / between)


def test_so_many_recordings_show_the_level_that_needs_them() -> None:
    for count in range(2, 200):
        assert shown(count) == pytest.approx(count / (count + 1.0), abs=1e-8)
        assert needed(shown(count)) == count
    assert shown(1) == 0.0


def test_a_quantile_is_the_value_at_which_the_share_of_the_weight_lies() -> None:
    value, weight = np.array([1.0, 2.0, 3.0, 4.0]), np.array([0.1, 0.2, 0.3, 0.4])
    assert [_quantile(value, weight, share) for share in (0.05, 0.1, 0.11, 0.3, 0.61, 1.0)] == [1, 1, 2, 2, 4, 4]


def test_the_factor_of_one_kind_is_the_least_that_covers_left_out_recordings_to_the_level() -> None:
    """One score a recording: a quantile of the others covers the one left out; the least that does so often enough."""
    score = np.sort(np.abs(np.random.default_rng(8).standard_normal(30)))
    found = factors(score[:, None, None], [f"r{k}" for k in range(30)], ["turn"] * 30, 0.9)
    assert found.factor[0, 0, 0] == pytest.approx(score[27], rel=0.05)
    # recordings of many windows count as those of one: the factor does not move
    twice = np.repeat(score, np.where(np.arange(30) < 15, 40, 1))
    names = [f"r{k}" for k in range(30) for _ in range(40 if k < 15 else 1)]
    again = factors(twice[:, None, None], names, ["turn"] * len(names), 0.9).factor[0, 0, 0]
    assert again == pytest.approx(found.factor[0, 0, 0], rel=0.15)


@pytest.mark.slow
def test_a_channel_that_nobody_measured_at_the_last_horizons_has_no_factor_there() -> None:
    """Twelve recordings show 90 %; of one channel only eight of them do from the third horizon on, or none."""
    for kept in (8, 0):
        gap = made(recordings=12, windows=1)
        late = np.arange(12) >= kept
        gap.left.error[late, 2:, 4] = np.nan
        factor = gap.factors(0.9).factor
        assert np.isfinite(factor[:, :2]).all()
        assert np.isnan(factor[:, 2:, 4]).all()
        assert np.isfinite(np.delete(factor, 4, axis=2)[:, 2]).all()
        assert gap.reach(0.9) == H[1]
        assert max(row.horizon for row in crossed(gap, 0.9)) == H[1]


# --- a calibration -------------------------------------------------------------------------------------------------


def known(share: float = 0.5) -> Calibration:
    found = made(recordings=30, windows=1)
    return replace(found, share=share)


@pytest.mark.slow
def test_half_widths_between_horizons_are_interpolated_in_the_logarithm() -> None:
    found = known()
    factor, usual = found.factors(0.9).factor[0], found.left.usual
    width = np.ones((1, 6))
    at = found.half(np.array([10.0]), width, "turning", 0.9)[0]
    assert at == pytest.approx(factor[1] * np.sqrt(usual[1]))
    mid = found.half(np.array([math.sqrt(5.0 * 10.0)]), width, "turning", 0.9)[0]
    end = found.half(np.array([5.0]), width, "turning", 0.9)[0]
    assert mid == pytest.approx(np.sqrt(at * end), rel=1e-6)
    assert found.half(np.array([10.0]), 4.0 * width, "turning", 0.9)[0] == pytest.approx(2.0 * at)


@pytest.mark.slow
def test_the_share_is_that_of_the_best_interval_score() -> None:
    found = made(recordings=30, windows=2)
    assert best_share(found.left, 0.9) == 1.0
    shuffled = replace(found.left, spread=found.left.spread[::-1])
    assert best_share(shuffled, 0.9) == 0.0
    assert Left.scores(found.left, 0.5) == pytest.approx(
        np.abs(found.left.error) / np.sqrt(found.left.spread * found.left.usual), nan_ok=True)  # fmt: skip


# --- calibrations that know more than a measured start -------------------------------------------------------------


class Grounded:
    """What a calibration is made of, written down."""

    def __init__(self, count: int, lasts: float) -> None:
        trials = tuple(trial(f"t{k}", lasts) for k in range(count))
        self.parts = [SimpleNamespace(out=SimpleNamespace(held=SimpleNamespace(ship=ship()), ship=ship(), trials=half))
                      for half in (trials[: count // 2], trials[count // 2 :])]  # fmt: skip
        self.lacks = (Disturbance((), 0.05), Disturbance((), 0.02))
        self.horizons, self.sigma, self.dt = np.array([5.0, 10.0]), np.zeros(6), 0.5

    def made(self, begin: str, cuts: Any, errors: Any, spreads: Any) -> Any:
        return begin, cuts, errors, spreads


def test_predictions_that_fit_the_first_seconds_have_the_spread_of_the_current_that_is_left(monkeypatch: Any) -> None:
    asked: list[tuple[float, str]] = []

    def fit_first(_: Any, one: Trial, span: float, *, differing: Any) -> Any:
        assert (span, differing) == (20.0, {"bias.psi": 0.01})
        if one.name == "t3":
            raise DataError("too short")
        return SimpleNamespace(rest=one, state=np.full(6, 7.0), current=0.03)

    def windows_of(_: Any, trials: Any, horizons: Any, dt: float, begun: Any) -> Windows:
        (one,) = trials
        assert dt == 0.5
        assert begun[one.name].tolist() == [7.0] * 6
        lanes = FreeRuns(np.zeros((2, 6)), np.zeros((2, 11, 10)), 0.5, 10)
        return Windows((one.name,) * 2, ("turn",) * 2, lanes, horizons, np.ones((2, 2, 6)), np.ones((2, 2, 6)),
                       np.zeros(2, dtype=np.intp))  # fmt: skip

    def spread_of(out: Any, lanes: FreeRuns, lacks: Disturbance, sigma: Any) -> Any:
        asked.append((lacks.current, out.trials[0].name))
        return np.tile(np.arange(2.0)[None, :, None], (2, 1, 6))  # a row at the start and one at the first horizon

    monkeypatch.setattr(beginnings, "fit_first", fit_first)
    monkeypatch.setattr(beginnings, "windows_of", windows_of)
    monkeypatch.setattr(beginnings, "spread_of", spread_of)
    grounds: Any = Grounded(21, 60.0)
    begin, cuts, errors, spreads = by_first(grounds, 20.0, {"bias.psi": 0.01})
    assert begin == "fit-first 20"
    names = [name for cut in cuts for name in cut.trials]
    assert len(set(names)) == 20
    assert "t3" not in names
    assert asked == [(0.03, "t0")] * 9 + [(0.02, "t10")] * 11  # the smaller of what is lacked and what is left
    joined = np.concatenate(spreads)
    assert joined.shape == np.concatenate(errors).shape == (40, 2, 6)
    assert (joined[:, 0] == 1.0).all()
    assert np.isnan(joined[:, 1]).all()  # the runs end before the second horizon
    few: Any = Grounded(2, 60.0)
    with pytest.raises(RequestError, match="--fit-first 20: 2 of the left-out trials last longer, and bands take at "
                                           "least 3"):  # fmt: skip
        by_first(few, 20.0, {"bias.psi": 0.01})
