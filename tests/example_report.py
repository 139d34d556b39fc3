"""A report made by hand: two weaving trials and a steady turn, three labels, a fit."""

from types import SimpleNamespace

import numpy as np

from seatrial.core.parameters import Free
from seatrial.data import Trial
from seatrial.identify import Fit, Verdict
from seatrial.identify.filters import CONSTANT_VELOCITY
from seatrial.report.report import Report
from seatrial.validate.comparison import compare, constant_velocity
from seatrial.validate.metrics import spread


def arc(n=301, dt=0.1, meta=None, u=1.5, v_m=-0.2, r=0.05, psi_0=3.0):
    """A steady turn: the constant-velocity baseline is exact on it."""
    t = dt * np.arange(n)
    psi = psi_0 + r * t
    x = (u * (np.sin(psi) - np.sin(psi_0)) + v_m * (np.cos(psi) - np.cos(psi_0))) / r
    y = (-u * (np.cos(psi) - np.cos(psi_0)) + v_m * (np.sin(psi) - np.sin(psi_0))) / r
    one = np.ones(n)
    channels = {"x": x, "y": y, "psi": np.angle(np.exp(1j * psi)), "u": u * one, "v_m": v_m * one,
                "r": r * one, "delta": 0.3 * one}  # fmt: skip
    return Trial("arc", t, channels, meta=meta or {})


def weaving(name="zigzag <1>", seed=0):
    """A ship that weaves, so that constant velocity fails."""
    t = 0.2 * np.arange(1000)
    r = 0.03 * np.cos(t / 12.0)
    psi = 0.4 + np.cumsum(r) * 0.2
    u, v_m = 1.2 - 4.0 * np.abs(r), -4.0 * r
    x = np.cumsum(u * np.cos(psi) - v_m * np.sin(psi)) * 0.2
    y = np.cumsum(u * np.sin(psi) + v_m * np.cos(psi)) * 0.2
    noise = np.random.default_rng(seed).standard_normal((6, t.size))
    noisy = np.array([x, y, psi, u, v_m, r]) + noise * [[0.05], [0.05], [0.005], [0.01], [0.01], [0.001]]
    channels = dict(zip(("x", "y", "psi", "u", "v_m", "r"), noisy, strict=True))
    return Trial(name, t, channels, meta={"kind": "zigzag"})


def fit():
    free = (Free("hull.Y_v", -0.3, -0.5, 0.0), Free("rudder.t_R", 0.39, prior=0.39, sigma=0.1))
    return Fit(
        ship=SimpleNamespace(name="test <ship>", L_pp=7.0), free=free, values=np.array([-0.31, 0.4]),
        sigma=np.array([0.01, 0.09]), covariance=np.eye(2), shrinkage=np.array([0.99, 0.1]),
        at_bound=("hull.Y_v",),
        verdicts=(
            Verdict("hull.Y_v", "identified", "well"),
            Verdict("rudder.t_R", "not identified", "needs a <zigzag>"),
        ),
        history=np.array([[0, 4.0, 5.0, 0.1], [1, 1.0, 2.0, 0.2], [2, 0.5, 1.8, 0.3]]), objective=0.5,
        seconds=1.2, evaluations=30, status="converged", digest="abc",
    )  # fmt: skip


def report(**changes):
    trials = [weaving(), weaving("zigzag 2", 1)]
    sigma = spread(trials)
    found = []
    for trial in trials:
        baseline = constant_velocity(trial, 50.0)
        mixed = trial.having(**{n: 0.9 * trial[n] + 0.1 * baseline[n] for n in trial.channels})
        poor = trial.having(**{n: 0.6 * trial[n] + 0.4 * baseline[n] for n in trial.channels})
        for label, guess in (("fitted", mixed), ("published", poor), (CONSTANT_VELOCITY, baseline)):
            found.append(compare(trial, guess, label=label, restart=50.0, sigma=sigma))
    circle = arc(1500, meta={"kind": "turning", "set_points": {"delta [deg]": 20.0}})
    wide = circle.having(x=1.1 * circle["x"], y=1.1 * circle["y"])
    for label, guess in (("fitted", wide), (CONSTANT_VELOCITY, constant_velocity(circle, None))):
        found.append(compare(circle, guess, label=label, sigma=sigma, L_pp=3.0))
    given = {"fit": fit(), "trained_on": ("zigzag 2",), "findings": ("x <frozen>",)}
    return Report("Trial & error", tuple(found), **{**given, "provenance": {"ship": "a & b"}, **changes})
