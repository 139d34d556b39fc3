"""The page of captive tests, and the figures of tracks, motions, horizons and losses, on their numbers."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seatrial.core.parameters import read
from seatrial.data import Trial
from seatrial.data.captive import MOTION, Captive
from seatrial.identify import Verdict
from seatrial.identify.regression.captive import CaptiveFit
from seatrial.report import figures, rivals
from seatrial.report.judging import captive, fans
from seatrial.ships.files import load
from seatrial.validate.comparison import compare
from shown import html, series, tables, tiles, words

SHIP = load("kvlcc2_l7")
DEG = math.radians(1.0)
PATHS = ("hull.Y_v", "rudder.a_H", "hull.N_r")


def made(**changes: Any) -> CaptiveFit:
    """Five runs in drift, the third a gap, four with a rudder angle; loads by hand."""
    motion = np.zeros((9, len(MOTION)))
    motion[:, MOTION.index("u")] = 2.0
    motion[:5, MOTION.index("v_m")] = -2.0 * np.tan(np.array([4.0, 2.0, 0.0, -2.0, -4.0]) * DEG)
    motion[5:, MOTION.index("delta")] = np.array([20.0, 10.0, -10.0, -20.0]) * DEG
    Y = np.array([5.0, 3.0, 0.0, -3.0, -5.0, 2.0, 1.0, -1.0, -2.0])
    runs = Captive("tank", motion, {"Y": Y}, 7.0, 1000.0, repeated=2)
    before = {path: float(read(SHIP.model, path)) for path in PATHS}
    given: dict[str, Any] = {
        "ship": SHIP, "began": SHIP, "runs": runs, "paths": PATHS,
        "values": np.array([before["hull.Y_v"] + 0.3, before["rudder.a_H"], before["hull.N_r"]]),
        "sigma": np.array([0.1, 0.2, 0.05]), "covariance": np.eye(3), "held": {"rudder.x_R": "no rudder test"},
        "noise": {"Y": (0.5, 1.25)}, "predicted": {"Y": Y + 0.5},
        "determined_by": {"hull.Y_v": {"drift": 2.345, "yaw": math.inf}, "rudder.a_H": {}, "hull.N_r": {"yaw": 1.5}},
        "verdicts": (*(Verdict(path, "identified", "t") for path in PATHS), Verdict("hull.Y_v and hull.N_r", "weak",
            "joined")),
    }  # fmt: skip
    return CaptiveFit(**{**given, **changes})


def test_coefficients_of_captive_tests_stand_beside_those_before() -> None:
    one = made()
    (rows,) = tables(captive._coefficients(one))
    before = captive.number(float(read(SHIP.model, "hull.Y_v")))
    now = captive.number(float(read(SHIP.model, "hull.Y_v")) + 0.3)
    assert rows[1] == ["hull.Y_v", "'", before, now, "0.10", "3.0", "identified", "drift (×2.3), yaw (×∞)"]
    assert rows[2][5] == "0"
    assert rows[2][-1] == "all alike"
    assert "hull.Y_v and hull.N_r: joined." in words(captive._coefficients(one))
    assert captive.shown("rudder.x_R", 3.5, "m", 7.0) == 0.5
    assert captive.shown("hull.Y_v", 3.5, "'", 7.0) == 3.5
    held = tables(captive._held(one))[0]
    assert held[1][0] == "rudder.x_R"
    assert held[1][2] == "no rudder test"
    assert captive._held(made(held={})) == ()


def test_the_head_of_captive_tests_counts_runs_and_explains() -> None:
    one = made()
    counts = captive._counts(one)
    assert sum(counts.values()) == 9
    said = captive.in_words(one)
    assert said.startswith("9 runs of a model of 7 m (")
    assert said.endswith("; 2 rows repeat a run and count once")
    (rows,) = tables(captive._head(one))
    Y = one.runs.loads["Y"]
    assert rows[1] == ["Y [N]", "0.500", "1.25", f"{100 * (1 - 0.25 / float(np.var(Y))):.2f} %"]
    told = captive.numbers(one)
    assert told["noise"] == {"Y": {"straight": 0.5, "oblique": 1.25}}
    assert told["parameters"]["hull.Y_v"]["sigma"] == 0.1  # type: ignore[index]
    assert told["combinations"] == [{"of": "hull.Y_v and hull.N_r", "text": "joined"}]


@pytest.mark.slow
def test_loads_are_drawn_over_what_a_kind_varies_in_its_order(monkeypatch: pytest.MonkeyPatch) -> None:
    kept: list[Any] = []
    monkeypatch.setattr(captive, "svg", lambda drawn, name: kept.append((drawn, name)) or "<svg></svg>")
    one = made()
    captive._loads(one)
    kinds = [name.removeprefix("captive ") for _, name in kept]
    assert len(kinds) == len({k for k in one.runs.kinds if one.runs.kinds.count(k) > 1})
    for (drawn, _), kind in zip(kept, kinds, strict=True):
        rows = np.array(one.runs.kinds) == kind
        left, right = drawn.axes
        computed, measured = left.lines
        x, label = captive._abscissa(one, rows, kind)
        order = np.argsort(x, kind="stable")
        assert right.x.name == label
        np.testing.assert_allclose(measured.x, x[order])
        np.testing.assert_allclose(measured.y, one.runs.loads["Y"][rows][order])
        np.testing.assert_allclose(computed.y, one.runs.loads["Y"][rows][order] + 0.5)
        np.testing.assert_allclose(right.lines[1].y, -0.5)
        assert list(right.lines[0].y) == [0.0, 0.0]
        misfit = 1.25 if "drift" in kind or "yaw" in kind or kind.startswith("PMM") else 0.5
        ((_, heights),) = right.areas[0].parts
        assert (heights.min(), heights.max()) == pytest.approx((-misfit, misfit))
    drift = np.array([k.startswith("drift") for k in one.runs.kinds])
    x, label = captive._abscissa(one, drift, "drift")
    np.testing.assert_allclose(x, np.degrees(one.runs.beta[drift]))
    assert label == "β [°]"
    every = np.ones(9, dtype=bool)
    np.testing.assert_allclose(captive._abscissa(one, every, "rudder")[0], np.degrees(one.runs.column("delta")))
    np.testing.assert_allclose(captive._abscissa(one, every, "yaw")[0], one.runs.column("r") * 7.0 / one.runs.U)
    np.testing.assert_allclose(captive._abscissa(one, every, captive.OTHER_LOAD)[0], one.runs.U)
    assert captive._abscissa(one, every, "else")[0].tolist() == list(range(9))


# Figures


def pair(restart: float | None = 10.0) -> Any:
    t = np.arange(0.0, 40.0, 0.5)
    psi = 3.0 + 0.05 * t
    seen = Trial("a", t, {"x": 2.0 * t, "y": -t, "psi": np.angle(np.exp(1j * psi)), "u": 2.0 + 0.01 * t,
        "v_m": 0.1 * np.sin(t),
                          "r": 0.05 + 0.001 * t, "delta": 0.3 + 0.0 * t})  # fmt: skip
    guess = seen.having(x=seen["x"] + 1.0, y=seen["y"] - 2.0, psi=psi + 0.1, u=seen["u"] + 0.5, r=seen["r"] * 2.0)
    return seen, psi, compare(seen, guess, label="fitted", restart=restart, sigma={"x": 1.0})


STYLES = {"fitted": ("#000", "-")}


@pytest.mark.slow
def test_a_track_is_north_over_east_as_measured_and_predicted() -> None:
    seen, _, one = pair()
    drawn = series(figures.track([one], STYLES, "a"))
    panel = "north x [m] over east y [m]"
    np.testing.assert_allclose(drawn[panel, "measured"], np.column_stack([seen["y"], seen["x"]]), rtol=1e-4)
    np.testing.assert_allclose(drawn[panel, "fitted"], np.column_stack([seen["y"] - 2.0, seen["x"] + 1.0]), rtol=1e-4)
    np.testing.assert_allclose(drawn[panel, "start"], [[0.0, 0.0]])


@pytest.mark.slow
def test_motions_are_in_degrees_with_the_heading_continuous() -> None:
    seen, psi, one = pair()
    drawn = {}
    for (panel, _), points in series(figures.series([one], STYLES, "a")).items():
        drawn.setdefault(panel.split(" over")[0], []).append(points)
    predicted, measured = drawn["ψ [°]"]
    shift = np.unique(np.round((measured[:, 1] - np.degrees(psi)) / 360.0, 3))
    assert len(shift) == 1
    np.testing.assert_allclose(predicted[:, 1] - measured[:, 1], math.degrees(0.1), atol=0.02)
    speeds = drawn["u [m/s]"]
    np.testing.assert_allclose(speeds[0][:, 1] - speeds[1][:, 1], 0.5, atol=1e-3)
    np.testing.assert_allclose(speeds[1][:, 0], seen.t)
    turn = drawn["r [°/s]"]
    np.testing.assert_allclose(turn[1][:, 1], np.degrees(seen["r"]), rtol=1e-4)
    np.testing.assert_allclose(turn[0][:, 1], 2.0 * np.degrees(seen["r"]), rtol=1e-4)
    rudder = next(points for name, points in drawn.items() if name.startswith("delta"))
    np.testing.assert_allclose(rudder[0][:, 1], math.degrees(0.3), rtol=1e-4)


def test_a_prediction_is_broken_where_it_begins_anew() -> None:
    _, _, one = pair()
    rows, gaps = figures._thin(one)
    assert rows.tolist() == list(range(80))
    assert gaps.tolist() == [20, 40, 60]
    broken = figures._broken(np.arange(80.0), gaps)
    assert np.flatnonzero(np.isnan(broken)).tolist() == [20, 41, 62]
    whole = figures._thin(pair(None)[2])
    assert whole[1].size == 0
    t = np.arange(3000) * 0.1
    long = Trial("l", t, {name: np.sin(t) for name in ("x", "y", "psi", "u", "v_m", "r")})
    rows, gaps = figures._thin(compare(long, long, label="f", restart=100.0, sigma={"x": 1.0}))
    assert len(rows) <= 604
    assert {999, 1000, 1999, 2000} <= set(rows.tolist())
    assert [rows[g] for g in gaps] == [1000, 2000]


def test_a_frame_holds_the_truth_at_equal_scale() -> None:
    truth = (np.array([0.0, 10.0]), np.array([0.0, 30.0]))
    low, high = figures._limits(truth[1], [np.array([-100.0, 35.0])])
    # as far as .6 of the range beyond the truth, and a margin of a twentieth
    assert (low, high) == pytest.approx((-18.0 - 0.05 * 53.0, 35.0 + 0.05 * 53.0))
    assert figures._limits(np.array([2.0, 2.0]), []) == pytest.approx((1.5, 2.5))
    set_to: dict[str, Any] = {}
    ax = SimpleNamespace(set_aspect=lambda *a, **k: None, set=lambda **k: set_to.update(k))
    figures.frame(ax, (), truth)
    (east, west), (south, north) = set_to["xlim"], set_to["ylim"]
    assert (west - east) / (north - south) == pytest.approx(1.25)
    assert 0.5 * (east + west) == pytest.approx(5.0)
    assert 0.5 * (south + north) == pytest.approx(15.0)
    assert south <= 0.0 < 30.0 <= north
    wide = (np.array([0.0, 100.0]), np.array([0.0, 1.0]))
    figures.frame(ax, (), wide)
    assert set_to["xlim"][0] <= 0.0 < 100.0 <= set_to["xlim"][1]
    assert set_to["ylim"][1] - set_to["ylim"][0] == pytest.approx((set_to["xlim"][1] - set_to["xlim"][0]) / 1.25)


@pytest.mark.slow
def test_horizons_losses_and_lines_are_those_given() -> None:
    curves = {"a": {10.0: 2.0, 1.0: 0.5, 100.0: 1e-9}, "b": {10.0: 3.0}}
    drawn = {name: p.tolist() for (_, name), p in series(figures.horizon(curves, {**STYLES, "a": STYLES["fitted"],
             "b": STYLES["fitted"]}, "error")).items()}  # fmt: skip
    assert drawn == {"a": [[1.0, 0.5], [10.0, 2.0]], "b": [[10.0, 3.0]]}
    history = np.array([[0, 4.0, 5.0, 0], [1, 2.0, math.nan, 0], [2, 1.0, 3.0, 0]])
    losses = {name: p.tolist() for (_, name), p in series(figures.convergence(history)).items()}
    assert losses == {"objective": [[0, 4], [1, 2], [2, 1]], "validation": [[0, 5], [2, 3]]}
    history[:, 2] = math.nan
    assert [name for _, name in series(figures.convergence(history))] == ["objective"]
    x = np.linspace(0.0, 1.0, 1500)
    lines = series(figures.lines("t", "x", "y", [("one", x, x**2), ("two", -x, x)]))
    for name, sign, power in (("one", 1.0, 2), ("two", -1.0, 1)):
        points = lines["y over x", name]
        assert 400 <= len(points) <= 600
        np.testing.assert_allclose(points[:, 1], (sign * points[:, 0]) ** power, atol=1e-4)
    assert figures.line_styles(["a", "base", "b"], "base")["base"] == figures.BASELINE
    styles = figures.line_styles(["a", "base", "b"], "base")
    assert (styles["a"], styles["b"]) == (figures.LINES[0][:2], figures.LINES[1][:2])


@pytest.mark.slow
def test_a_section_of_bands_draws_the_first_dozen_and_repeats_no_note(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fans, "fan", lambda made, trial: "<svg></svg>")
    several = tuple((SimpleNamespace(predicted=SimpleNamespace(name="p"), notes=("far",)), SimpleNamespace(name=str(k)))
                    for k in range(14))  # fmt: skip
    found: Any = fans.BandsHeld(0.9, (), several, 8)  # type: ignore[arg-type]
    made_of = fans.section(found)
    assert made_of.html.count("<figure>") == 12
    assert made_of.html.count("p: far") == 1
    assert "Bands of 90 %, calibrated on 8 recordings" in made_of.html
    assert fans.numbers(found)["notes"] == {"p": ["far"]}


# Rivals


def score(u: float, last: float = 1.0) -> Any:
    return SimpleNamespace(relative={"u": u, "v_m": 2 * u, "r": math.inf}, starts=17, steps={},
                           beyond=lambda other: dict(zip(rivals._STATES, (1.5, 1.0, 2.25, 1.0, 1.0, 1.125),
                               strict=True)))


def rivalry() -> Any:
    free = (SimpleNamespace(path="hull.Y_v", start=-0.5), SimpleNamespace(path="hull.N_r", start=-0.1))
    own = SimpleNamespace(free=free, values=np.array([-0.4, -0.12]), sigma=np.array([0.02, 0.01]), seconds=3.25,
        nuisances={},
                          verdicts=(Verdict("hull.Y_v", "identified", ""), Verdict("hull.Y_v and hull.N_r", "weak",
                              "joined")))
    case = SimpleNamespace(name="as sailed", about="all known", fits={"full": own,
        "rival": SimpleNamespace(free=free[:1])},
                           truth=np.array([-0.42, -0.1]), away=np.array([1.0, -3.5]),
                           scores={"truth": score(0.01), "full": score(0.02), "rival": score(0.05)},
                           smaller=lambda v: {"u": 2.5, "v_m": 2.5, "r": 1.0}[v])  # fmt: skip
    trials = (Trial("m", np.arange(5) * 0.2, {}), Trial("n", np.arange(7) * 0.2, {}))
    problem = SimpleNamespace(ship=SimpleNamespace(name="tug"), trials=trials)
    published = {"source": "a paper", "full": {"u": 2.33}, "R2": {"alpha_1": 0.9992}}
    study = SimpleNamespace(virtual=None, problem=problem, test=("o",), published=published)
    servo = SimpleNamespace(servo=SimpleNamespace(rate=0.5, lag=0.25), sigma={"rate": 0.01}, rmse=math.radians(0.5),
        R2=0.999)
    true = SimpleNamespace(rate=0.55, lag=0.2)
    still = SimpleNamespace(R2=0.99876, rmse=1.5, powers=(1, 2), thrust=lambda n: 10.0 * n)
    drive = SimpleNamespace(maps={"1": (still, np.array([1.0, 2.0]), None)}, servos={"alpha_1": servo},
                            thrust=lambda name: np.array([9.0, 22.5]),
                            truth=SimpleNamespace(actuators=SimpleNamespace(of=lambda _: true)))
    return SimpleNamespace(cases=(case,), fit=own, study=study, drive=drive)


def test_rivals_are_compared_in_percent_ratios_and_sigmas() -> None:
    found = rivalry()
    rows, ratios = tables(rivals.relative(found))
    assert rows[1:] == [["as sailed, truth", "1.00 %", "2.00 %", "diverges", "ours"],
                        ["as sailed, 2 parameters", "2.00 %", "4.00 %", "diverges", "ours"],
                        ["as sailed, 1 parameter", "5.00 %", "10.0 %", "diverges", "ours"],
                        ["published, 2 parameters", "2.33 %", "–", "–", "the paper's"]]  # fmt: skip
    assert ratios[1] == ["as sailed", "2.50", "2.50", "1.00", "all known"]
    assert tiles(rivals.summary(found))[:3] == [
        ("2.5 / 2.5 / 1.0", "error of 1 parameter over that of 2 parameters: surge, sway, yaw"),
        ("1 of 2", "parameters within 3 sigma of the truth"),
        ("2.25", "error after 50 steps over the truth's own, the worst of six states"),
    ]
    assert "to fit 12 samples" in words(rivals.summary(found))
    thrust, servos = tables(rivals.drive(found))
    assert thrust[1] == ["thruster 1", "1, 2", "1.50", "0.99876", "2.50"]
    assert servos[1] == ["alpha_1", "0.50000 ± 0.01", "0.55000", "not determined", "0.20", "0.500", "0.99900", "0.9992"]


@pytest.mark.slow
def test_estimates_of_rivals_stand_beside_their_truth(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rivals, "estimates", lambda cases: "<svg></svg>")
    monkeypatch.setattr(rivals, "steps", lambda *given: "<svg></svg>")
    found = rivalry()
    body = rivals.parameters(found)
    (rows,) = tables(body)
    assert rows[1] == ["Y_v", "−0.42000", "−0.5000", "−0.40000", "0.020", "1.0", "identified"]
    assert rows[2] == ["N_r", "−0.10000", "−0.1000", "−0.12000", "0.010", "−3.5", "–"]
    growth = html(rivals.growth(found))
    assert tables(growth)[0][1] == ["as sailed", "1.500", "1.000", "2.250", "1.000", "1.000", "1.125"]
    assert "After 50 steps (10 s): 2 parameters over the truth" in words(growth)
    assert "from 17 measured states" in growth
    assert growth.count("<figure>") == 1
