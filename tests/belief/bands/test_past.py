"""What the seconds before a start tell: a known current and force are found, and another ship's past is noticed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from known_calibration import made

from seatrial.belief.bands.beginnings import by_first, by_history
from seatrial.belief.bands.calibrating import Withheld
from seatrial.belief.bands.calibration import Calibration, beside, load, save
from seatrial.belief.bands.disturbance import Disturbance, Process
from seatrial.belief.bands.held import held, windows
from seatrial.belief.bands.past import Filter, Past, carried
from seatrial.belief.bands.prediction import Fan, fan
from seatrial.core.errors import RequestError
from seatrial.core.parameters import read
from seatrial.data import Trial
from seatrial.identify import StudyError
from seatrial.models import STATES
from seatrial.simulate.replay import replay
from virtual_logs import NOISE, left_out, log, posterior, ship

SIGMA = np.array([NOISE[name] for name in STATES])
LACKS = Disturbance((Process("u", 1e-4, 5.0), Process("v_m", 1e-4, 5.0), Process("r", 1e-5, 50.0)), 0.05)
SPAN, RESTART = 20.0, 20.0


def drifting(rng: np.random.Generator, size: float = 0.05) -> tuple[float, float]:
    """Another current in every trial."""
    return tuple(size * rng.standard_normal(2))


def past_of(trial: Trial, lacks: Disturbance = LACKS, span: float = SPAN) -> tuple[Trial, Past]:
    return carried(Filter.of(ship(), lacks, SIGMA, span), "filtered", trial, restart=RESTART)


def test_a_current_that_nobody_logged_is_found_in_a_turn_and_carried_on() -> None:
    trial = log(ship(), 1, np.random.default_rng(0), (0.0, 0.1))
    predicted, past = past_of(trial)
    north, east = LACKS.current * past.mean[2, -2:]
    assert (north, east) == pytest.approx((0.0, 0.1), abs=0.03)
    late = trial.t >= 40.0
    plain = replay(ship(), trial, restart=RESTART)
    for name in ("x", "y", "psi", "u", "v_m"):
        off, before = (np.sqrt(np.mean((run[name] - trial[name])[late] ** 2)) for run in (predicted, plain))
        assert off < 0.6 * before, name


def test_the_covariance_is_small_at_a_start_with_a_past_and_that_of_the_process_without() -> None:
    trial = log(ship(), 1, np.random.default_rng(0))
    _, past = past_of(trial)
    variance = np.einsum("sij,sij->si", past.root, past.root)
    assert past.seconds.tolist() == pytest.approx([0.0, SPAN, SPAN], abs=0.6)
    assert variance[0] == pytest.approx(np.ones(5))
    assert (variance[1:] <= 1.0 + 1e-6).all()
    assert (variance[1:, -2:] < 0.1).all()
    assert (past.mean[0] == 0.0).all()
    values, currents = past.drawn(4000, np.random.default_rng(1))
    both = np.hstack([values, currents]).reshape(4000, 3, 5)
    assert both.mean(axis=0) == pytest.approx(past.mean, abs=0.08)
    assert both.var(axis=0) == pytest.approx(variance, rel=0.15, abs=1e-3)


@pytest.mark.slow
def test_a_force_is_read_off_and_forgotten_in_its_own_time() -> None:
    """A steady unknown yaw acceleration: a process that lasts is carried on, one that is brief is not."""
    trial = log(ship(), 1, np.random.default_rng(0))
    lasting, brief = (Disturbance((Process("u", 1e-4, 5.0), Process("r", 1e-3, tau))) for tau in (1e3, 1.0))
    filters = Filter.of(ship(), lasting, SIGMA, SPAN)
    pushed = trial.having(r=trial["r"] + 4e-4 * trial.t)
    found = [past_of(pushed, who)[1].mean[2, 1] - past_of(trial, who)[1].mean[2, 1] for who in (lasting, brief)]
    # what is read also differs by the model's own damping of the greater rate
    assert 1e-3 * found[0] > 3e-4
    assert 1e-3 * found[1] < 1e-3 * found[0] * 3.0
    assert filters.span == SPAN


@pytest.mark.slow
def test_a_gap_says_nothing_and_too_short_a_past_counts_as_none() -> None:
    trial = log(ship(), 1, np.random.default_rng(0))
    torn = trial.having(v_m=np.where((trial.t > 25.0) & (trial.t < 39.0), np.nan, trial["v_m"]))
    made, past = past_of(torn)
    assert np.isfinite(made.stack(*STATES)).all()
    assert past.seconds[2] == 0.0  # six of twenty seconds
    _, brief = past_of(trial, span=50.0)
    assert (brief.seconds > 0.0).tolist() == [False, False, True]
    with pytest.raises(RequestError, match="--history is 0 s"):
        past_of(trial, span=0.0)


@pytest.mark.slow
def test_the_past_of_another_ship_is_noticed() -> None:
    rng = np.random.default_rng(0)
    own = log(ship(), 1, rng)
    model = ship().model
    altered = {"hull.N_r": 2.5 * float(read(model, "hull.N_r")), "hull.Y_v": 0.4 * float(read(model, "hull.Y_v"))}
    other = log(ship().moved(altered), 1, np.random.default_rng(0))
    usual = past_of(own)[1].surprise.max()
    assert past_of(other)[1].surprise.max() > 3.0 * usual
    found = replace(made(), disturbance=LACKS, noise=SIGMA, surprise=1.5 * float(usual), begin="history 20")
    for trial, expected in ((own, False), (other, True)):
        predicted, past = past_of(trial)
        line = fan(posterior(), found, trial, predicted, 0.9, restart=RESTART, draws=60, past=past, plain=made()).notes
        assert any("the past does not fit this model" in one for one in line) is expected


@pytest.mark.slow
def test_a_calibration_is_kept_with_what_it_is_for(tmp_path: object) -> None:
    from pathlib import Path

    model, who = Path(str(tmp_path)) / "model.toml", posterior()
    found = replace(made(), begin="history 20", surprise=2.5, law="filtered", doubt=3.0)
    path = save(found, beside(model, found.begin))
    assert path.name == "model.history-20.bands.json"
    again = load(model, who, "history 20")
    assert (again.begin, again.surprise, again.law, again.doubt) == ("history 20", 2.5, "filtered", 3.0)
    with pytest.raises(StudyError, match="seatrial calibrate MODEL --fit-first 20"):
        load(model, who, "fit-first 20")
    path.rename(beside(model, "history 30"))
    with pytest.raises(StudyError, match="begin by 'history 20', not 'history 30'"):
        load(model, who, "history 30")


def judged(fans: list[tuple[Fan, Trial]], horizons: tuple[float, ...]) -> tuple[float, dict[str, float]]:
    """Mean coverage, and mean width at the first horizon."""
    rows = [row for row in held(windows(one, t, horizons) for one, t in fans) if row.kind == "all kinds"]
    return float(np.mean([value for row in rows for value in row.inside.values()])), dict(rows[0].width)


def fans_of(trials: list[Trial], plain: Calibration, found: Calibration) -> list[list[tuple[Fan, Trial]]]:
    """Of later starts only, without and with the past."""
    filters = Filter.of(ship(), found.disturbance, found.noise, SPAN, found.doubt)
    both: list[list[tuple[Fan, Trial]]] = [[], []]
    for trial in trials:
        run, past = carried(filters, found.law, trial, restart=RESTART)
        bare = replay(ship(), trial, restart=RESTART)
        for k, one in enumerate((
            fan(posterior(), plain, trial, bare, 0.95, restart=RESTART, draws=200),
            fan(posterior(), found, trial, run, 0.95, restart=RESTART, draws=200, past=past, plain=plain),
        )):  # fmt: skip
            late = one.predicted.t >= one.predicted.t[0] + RESTART
            both[k].append((replace(one, half=np.where(late[:, None], one.half, np.nan)), trial))
    return both


@pytest.mark.long
def test_bands_with_a_past_hold_on_new_trials_and_are_narrower_where_a_disturbance_lasts() -> None:
    """A current that differs from trial to trial, which the seconds before tell."""
    rng = np.random.default_rng(3)
    logs = [log(ship(), k, rng, drifting(rng)) for k in range(24)]
    new = [log(ship(), k, rng, drifting(rng)) for k in range(30)]
    withheld = Withheld.of(posterior(), left_out(logs))
    plain, found = withheld.measured(), by_history(withheld, SPAN)
    assert (plain.begin, found.begin, found.law) == ("measured", "history 20", "filtered")
    assert np.isinf(plain.surprise)
    (held_plain, wide), (held_past, narrow) = (judged(one, (4.0, 10.0)) for one in fans_of(new, plain, found))
    assert 0.90 <= held_plain <= 0.99
    assert 0.90 <= held_past <= 0.99
    assert narrow["x"] + narrow["y"] < 0.8 * (wide["x"] + wide["y"])
    assert narrow["v_m"] < wide["v_m"]
    with pytest.raises(RequestError, match="--history 110: 0 of the left-out trials last longer"):
        by_history(withheld, 110.0)


@pytest.mark.long
def test_bands_of_predictions_that_fit_the_first_seconds_hold() -> None:
    from seatrial.belief.fit_first import fit_first

    rng = np.random.default_rng(5)
    logs = [log(ship(), k, rng, drifting(rng)) for k in range(24)]
    new = [log(ship(), k, rng, drifting(rng)) for k in range(24)]

    withheld = Withheld.of(posterior(), left_out(logs))
    plain, found = withheld.measured(), by_first(withheld, SPAN, {})
    assert found.begin == "fit-first 20"
    both: list[list[tuple[Fan, Trial]]] = [[], []]
    for trial in new:
        one = fit_first(ship(), trial, SPAN)
        begin = (one.t, one.state)
        run = replay(ship(), one.trial, begin=begin)
        both[0].append((fan(posterior(), found, one.trial, run, 0.95, draws=200, begin=begin,
                            current=one.current), one.trial))  # fmt: skip
        rest = trial.rows(slice(int(np.searchsorted(trial.t, one.t - 1e-6)), None))
        both[1].append((fan(posterior(), plain, rest, replay(ship(), rest), 0.95, draws=200), rest))
    (inside, narrow), (_, wide) = (judged(one, (4.0, 10.0, 20.0)) for one in both)
    assert 0.90 <= inside <= 0.995
    assert narrow["x"] + narrow["y"] < wide["x"] + wide["y"]
