import json
import re
from types import SimpleNamespace

import numpy as np
import pytest
from test_comparison import arc

from seatrial.core.parameters import Free
from seatrial.data import Trial
from seatrial.identify import Fit, Verdict
from seatrial.report.report import Report, ReportError
from seatrial.validate.comparison import CONSTANT_VELOCITY, compare, constant_velocity
from seatrial.validate.metrics import spread


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
        ship=SimpleNamespace(name="test <ship>"), free=free, values=np.array([-0.31, 0.4]),
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


@pytest.mark.long
def test_page_is_whole_and_self_contained(tmp_path):
    path = report().write(tmp_path / "deep" / "report.html")
    html = path.read_text()
    assert html.startswith("<!DOCTYPE html>")
    assert not re.search(r"https?://|<script|<link|<img|@import|url\((?!#)", html)
    assert html.count("<svg") == html.count("</svg>") == 9
    assert "zigzag &lt;1&gt;" in html
    assert "<frozen>" not in html
    assert "needs a <zigzag>" not in html
    assert "What this does not show" in html
    assert "nan" not in re.sub(r"<svg.*?</svg>", "", html, flags=re.S).lower().replace("provenance", "")
    assert len(html) < 900_000
    assert sorted(p.name for p in path.parent.iterdir()) == ["report.html", "report.json"]


@pytest.mark.long
def test_numbers_beside_the_page(tmp_path):
    one = report()
    one.write(tmp_path / "report.html")
    data = json.loads((tmp_path / "report.json").read_text())
    pooled = data["standardised"]
    assert pooled["fitted"] < pooled["published"] < pooled[CONSTANT_VELOCITY]
    expected = one.trials["zigzag 2"]["fitted"].standardised
    assert data["trials"]["zigzag 2"]["fitted"]["standardised"] == expected
    assert data["trials"]["arc"]["fitted"]["indices"]["tactical_diameter"]["unit"] == "m"
    assert data["fit"]["parameters"]["rudder.t_R"]["high"] is None
    assert any("1 of 3 trials were used" in line for line in data["caveats"])


@pytest.mark.long
def test_pages_are_the_same_for_the_same_report(tmp_path):
    a, b = (report().write(tmp_path / name).read_text() for name in ("a.html", "b.html"))
    assert a == b


def test_all_trials_seen(tmp_path):
    names = tuple(report().trials)
    text = report(trained_on=names).numbers()["caveats"][0]
    assert text.startswith("None of the 3 trials is unseen")


def test_empty_report(tmp_path):
    html = Report("nothing", ()).write(tmp_path / "r.html").read_text()
    assert "Nothing was compared" in html


def test_refusals(tmp_path):
    one = report().comparisons[0]
    with pytest.raises(ReportError, match="two comparisons labelled"):
        Report("twice", (one, one))
    with pytest.raises(ReportError, match="overwritten"):
        report().write(tmp_path / "report.json")


@pytest.mark.long
def test_metrics_table_is_in_degrees(tmp_path):
    html = report().write(tmp_path / "r.html").read_text()
    assert "°/s" in html
