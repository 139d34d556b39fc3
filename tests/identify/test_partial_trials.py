"""Fits to logs that lack states: the truth is found by what is left, and what is unknown is said."""

from functools import cache

import numpy as np
import pytest

import seatrial as st
from seatrial.data.prepare import marked
from seatrial.identify import StudyError
from seatrial.identify.lint import lint
from seatrial.identify.noise import noise
from seatrial.identify.nuisance import begun_as
from seatrial.identify.record import spread

NOISE = {"x": 0.02, "y": 0.02, "psi": 0.003, "u": 0.01, "v_m": 0.01, "r": 0.002}


@cache
def _truth():
    return st.load("kvlcc2_l7")


@cache
def _sailed():
    with pytest.warns(UserWarning, match="not over after 50 s"):
        run = _truth().simulate(st.Zigzag(rudder_deg=20, heading_deg=20), duration=50.0, dt=0.1)
    return run.with_noise(NOISE, seed=3)


def _log(*lacking, empty=(), thin=()):
    channels = {name: np.array(_sailed()[name]) for name in _sailed().channels if name not in lacking}
    for name in empty:
        channels[name][:] = np.nan
    for name in thin:
        channels[name][np.arange(len(_sailed())) % 50 != 7] = np.nan
    return st.Trial("log", _sailed().t, channels, meta=dict(_sailed().meta))


def _problem(trial):
    start = _truth().having({path: 1.2 * _truth().parameters[path] for path in ("hull.N_r", "hull.Y_v")})
    return st.Problem(start, (trial,), st.near(start, "hull.N_r", "hull.Y_v", ratio=0.5))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("lacking", "empty", "thin"),
    [("x y", "", ""), ("u v_m", "", ""), ("v_m", "", ""), ("r", "", ""), ("psi", "", ""), ("x y r", "", ""),
     ("", "v_m", ""), ("u v_m r", "", "x y"), ("", "", "x y")],
    ids=["no position", "no speed", "no sway", "no rate", "no heading", "heading and speed", "empty sway",
         "track every 5 s and heading", "track every 5 s"],
)  # fmt: skip
def test_the_truth_is_found_by_what_is_left(lacking, empty, thin):
    fit = st.fit(_problem(_log(*lacking.split(), empty=empty.split(), thin=thin.split())))
    truth = np.array([_truth().parameters[one.path] for one in fit.free])
    assert (np.abs(fit.values - truth) < 4.0 * fit.sigma).all()
    assert (np.abs(fit.values / truth - 1.0) < 0.03).all()


def _made(trial):
    """A rate and velocities by central differences, as `mend do = "derive"` or a logger makes them."""
    north, east, r = (np.gradient(trial[name], trial.t) for name in ("x", "y", "psi"))
    c, s = np.cos(trial["psi"]), np.sin(trial["psi"])
    return trial.having(u=north * c + east * s, v_m=east * c - north * s, r=r)


@pytest.mark.slow
def test_channels_made_from_others_count_for_nothing():
    """Track and heading alone tell what they do with velocities that are differences of them."""
    made = marked(_made(_log()), {"u": "x, y, psi", "v_m": "x, y, psi", "r": "psi"})
    fit, alone = st.fit(_problem(made)), st.fit(_problem(_log("u", "v_m", "r")))
    assert fit.values == pytest.approx(alone.values, rel=1e-3)
    assert fit.sigma == pytest.approx(alone.sigma, rel=0.02)
    truth = np.array([_truth().parameters[one.path] for one in fit.free])
    assert (np.abs(fit.values - truth) < 4.0 * fit.sigma).all()
    assert set(fit.diagnosis.channels) == {"x", "y", "psi"}
    assert not fit.diagnosis.lacking


def test_channels_made_from_others_are_said():
    log = marked(_log().having(r=_made(_log())["r"]), {"r": "psi"})
    (told,) = [one for one in lint(_problem(log), felt=False) if "made from" in one.text]
    assert told.text.endswith("left out of the residuals: r (from psi)")
    assert spread([marked(_log(), {"r": "psi"})]).keys() == {"x", "y", "psi", "u", "v_m"}
    assert begun_as(_problem(marked(_log(), {"r": "psi"})), "free").nuisance.initial["r"] < np.inf


def test_sparse_readings_between_the_compared_rows_are_told():
    """Fixes every .7 s beside a heading at 10 Hz: of the rows that are compared, 1 s apart, one in seven has one."""
    fixes = np.arange(len(_sailed())) % 7 == 3
    log = _log().having(**{name: np.where(fixes, _sailed()[name], np.nan) for name in ("x", "y")})
    told = [one.text for one in lint(_problem(log), estimator=st.Trajectory(), felt=False) if "readings of" in one.text]
    assert len(told) == 2
    # rows 3, 13, ... 493 are compared, of which 3, 73, ... 493 have a fix
    assert told[0].startswith(f"8 of {np.count_nonzero(fixes)} readings of x lie in the rows that are compared, 1 s ")
    assert told[0].endswith("every = 1 in [estimator] compares every row")
    assert not [one for one in lint(_problem(log), estimator=st.Trajectory(every=1), felt=False)
                if "readings of" in one.text]  # fmt: skip
    aligned = _log(thin=("x", "y"))  # every 5 s, and windows begin where one is
    assert not [one for one in lint(_problem(aligned), estimator=st.Trajectory(), felt=False)
                if "readings of" in one.text]  # fmt: skip


@pytest.mark.slow
def test_less_is_known_without_a_position():
    whole, partly = st.fit(_problem(_log())), st.fit(_problem(_log("x", "y")))
    assert (partly.sigma > 1.05 * whole.sigma).all()


def test_what_is_not_told_is_said():
    (told,) = [one for one in lint(_problem(_log("x", "y")), felt=False) if "no readings" in one.text]
    assert told.severity == "warning"
    assert "a current" in told.text


def test_an_estimator_that_needs_every_state_refuses():
    with pytest.raises(StudyError, match="no channel x, y"):
        st.Regression().fit(_problem(_log("x", "y")))


def test_starts_that_nothing_read_have_a_prior_and_positions_none():
    free = begun_as(_problem(_log("x", "y", "v_m")), "free").nuisance.initial
    assert set(free) == {"psi", "u", "v_m", "r"}
    assert list(free) == ["psi", "u", "v_m", "r"]
    assert free["v_m"] == pytest.approx(0.5 * _truth().speed)
    assert np.isinf(free["u"])


def test_a_state_without_a_reading_has_no_spread():
    assert set(spread((_log("x", empty=("u",)),))) == {"y", "psi", "v_m", "r"}


@pytest.mark.slow
def test_the_noise_of_a_sparse_channel_is_that_of_its_readings():
    """Rows between the readings are no gaps of the sensor; with few readings the noise is not small by chance."""
    rng = np.random.default_rng(4)
    t = np.arange(2000.0)
    for every, count in ((5, 10), (100, 60)):
        levels = []
        for _ in range(count):
            x = np.where(t % every == 0, 0.1 * t + rng.normal(0.0, 0.5, t.size), np.nan)
            levels.append(noise((st.Trial("t", t, {"x": x, "u": rng.normal(0.0, 1.0, t.size)}),), ("x", "u"))["x"])
        assert np.mean(levels) == pytest.approx(0.5, rel=0.1)
