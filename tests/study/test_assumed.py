"""Controls that no log has: orders through the actuator of the ship, revolutions of the first speed, levels fitted."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import seatrial as st
from seatrial.belief.corrected import corrected, of_trial
from seatrial.data import Trial
from seatrial.data.folder import read_folder
from seatrial.data.prepare import Step, derived, mended
from seatrial.data.trialfile import write_trials
from seatrial.identify import Nuisance, StudyError
from seatrial.identify.lint import lint
from seatrial.identify.trajectory.suspects import level_of, named
from seatrial.manoeuvres.straight import Straight
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.models import STATES
from seatrial.ships.files import load
from seatrial.simulate.approach import approach, surge_balance
from seatrial.simulate.run import simulate
from seatrial.study.assumed import SPEED, levels, unassumed, wanting, with_assumed
from seatrial.study.drafting.draft import draft
from seatrial.study.study import read_study

DEG = math.radians(1.0)
NOISE = {"x": 0.02, "y": 0.02, "psi": 0.003, "u": 0.01, "v_m": 0.01, "r": 0.002}


@cache
def ship() -> st.Ship:
    return load("kvlcc2_l7")


@cache
def run(policy: object, speed: float = 1.179) -> Trial:
    return simulate(ship(), policy, duration=60.0, dt=0.5, speed=speed)


def without(trial: Trial, *names: str) -> Trial:
    return replace(trial, channels={name: v for name, v in trial.channels.items() if name not in names})


def zigzag() -> Trial:
    return run(Zigzag(approach(ship())[1], 20.0 * DEG, 20.0 * DEG))


def test_what_a_trial_lacks_is_told_by_orders_or_by_the_speed() -> None:
    assert wanting(zigzag(), ship()) == {}
    assert wanting(without(zigzag(), "n_P"), ship()) == {"n_P": "n_P_cmd"}
    assert wanting(without(zigzag(), "n_P", "n_P_cmd"), ship()) == {"n_P": SPEED}
    assert wanting(without(zigzag(), "delta", "delta_cmd"), ship()) == {"delta": ""}
    twin = load("twin_virtual")
    assert wanting(Trial("t", np.arange(3.0), {"delta": np.zeros(3)}), twin)["n_P_1"] == SPEED


def test_a_rudder_follows_its_order_as_the_actuator_of_the_ship_does() -> None:
    """The simulator, whose actuator is stepped in compiled code, recorded both."""
    made = with_assumed(without(zigzag(), "delta"), ("delta",), ship())
    assert made["delta"][0] == zigzag()["delta_cmd"][0]  # where it was before, no log of orders tells
    np.testing.assert_allclose(made["delta"][5:], zigzag()["delta"][5:], atol=1e-9)
    assert np.abs(zigzag()["delta"] - zigzag()["delta_cmd"]).max() > 5.0 * DEG
    assert derived(made) == {"delta": "delta_cmd"}


def test_an_order_between_gaps_counts_until_the_next() -> None:
    log = zigzag()
    thin = np.where(np.diff(log["delta_cmd"], prepend=np.nan) == 0.0, np.nan, log["delta_cmd"])
    made = with_assumed(without(log, "delta").having(delta_cmd=thin), ("delta",), ship())
    np.testing.assert_allclose(made["delta"][5:], log["delta"][5:], atol=1e-9)


def test_revolutions_of_the_first_speed_hold_it() -> None:
    log = without(run(Straight(approach(ship(), speed=0.9)[1]), 0.9), "n_P", "n_P_cmd")
    made = with_assumed(log, ("n_P",), ship())
    assert np.ptp(made["n_P"]) == 0.0
    assert surge_balance(ship(), 0.9, float(made["n_P"][0])) == pytest.approx(0.0, abs=1e-6)
    assert derived(made) == {"n_P": SPEED}
    assert levels([made, zigzag()], ship()) == (f"level.n_P.{made.name}",)
    assert with_assumed(zigzag(), ("n_P", "delta"), ship()) == zigzag()


@pytest.mark.parametrize(
    ("lost", "names", "said"),
    [(("delta", "delta_cmd"), ("delta",), r"no delta and no order delta_cmd; log it, or leave the trial out"),
     ((), ("n_q",), r"'n_q' is no control of kvlcc2_l7, which has n_P, delta")],
)  # fmt: skip
def test_what_nothing_tells_is_refused(lost: tuple[str, ...], names: tuple[str, ...], said: str) -> None:
    with pytest.raises(StudyError, match=said):
        with_assumed(without(zigzag(), *lost), names, ship())


def test_a_trial_that_begins_astern_tells_no_revolutions() -> None:
    log = without(zigzag(), "n_P", "n_P_cmd")
    assert unassumed(log, ship()) == ""
    assert "it does not begin ahead" in unassumed(log.having(u=-log["u"]), ship())
    assert "no channel" in unassumed(without(log, "u", "x", "y"), ship())


def test_a_level_acts_on_its_own_trial_alone() -> None:
    trials = [zigzag(), replace(zigzag(), name="b.1")]
    name = "level.n_P.b.1"
    assert level_of(name) == ("n_P", "b.1")
    assert level_of("scale.n_P") == ("", "")
    [one] = named(ship().model, trials, (name,), np.array([0, 1, 1]))
    series = np.full((3, 4, 10), 2.0)
    moved = one.acts(series, 0.5) if one.acts else series
    assert moved[1:, :, 0].tolist() == [[2.0] * 4] * 2  # n_P of the second trial's windows
    moved[1:, :, 0] = 0.0
    assert not moved.any()
    with pytest.raises(StudyError, match="controls are n_P, delta"):
        named(ship().model, trials, ("level.n_q.b.1",), np.array([0]))


def test_levels_correct_their_own_trial_and_no_other() -> None:
    found = {"*": {"level.n_P.a": 0.1, "level.n_P.b": -0.2, "offset.delta": 0.0}}
    trial = replace(zigzag(), name="a")
    own = of_trial("a", found, ("a", "b"))
    assert set(own) == {"level.n_P.a", "offset.delta"}
    right = corrected(trial, own, ship().model)
    np.testing.assert_allclose(right["n_P"], 1.1 * trial["n_P"])
    np.testing.assert_array_equal(right["delta"], trial["delta"])
    assert of_trial("c", found, ("a", "b", "c")) == {"offset.delta": 0.0}


def test_the_level_of_a_trial_that_is_not_fitted_is_refused() -> None:
    problem = st.Problem(ship(), (replace(zigzag(), name="a"),), st.near(ship(), "hull.N_r", ratio=0.5),
                         nuisance=Nuisance(common={"level.n_P.b": 0.1}))  # fmt: skip
    [error] = [one for one in lint(problem, felt=False) if one.severity == "error"]
    assert error.where == "nuisance.common.level.n_P.b"
    assert "no training trial" in error.text


@pytest.mark.slow
def test_the_level_of_revolutions_is_estimated_with_the_parameters() -> None:
    """A turn that truly began 4 % above the revolutions that hold its first speed, and one that began as it went on."""
    n = approach(ship())[1]
    fast = simulate(ship(), Turning(1.04 * n, 20.0 * DEG), duration=60.0, dt=0.5, speed=1.179)
    sound = simulate(ship(), Turning(n, 35.0 * DEG), duration=60.0, dt=0.5, speed=1.179)
    random, logs = np.random.default_rng(4), list[Trial]()
    for name, one in (("fast", fast), ("sound", sound)):
        read = {k: one[k] + NOISE[k] * random.standard_normal(len(one)) for k in STATES}
        logs.append(Trial(name, one.t, {**read, "delta": one["delta"], "n_P": np.full(len(one), n)}))
    names = ("level.n_P.fast", "level.n_P.sound")
    fit = st.fit(st.Problem(ship(), tuple(logs), st.near(ship(), "hull.N_r", "hull.Y_v", ratio=0.5),
                            nuisance=Nuisance(common=dict.fromkeys(names, 0.1))))  # fmt: skip
    sizes = {one.name: (one.size, one.sigma) for one in fit.diagnosis.errors}
    for name, true in zip(names, (0.04, 0.0), strict=True):
        assert abs(sizes[name][0] - true) < 4.0 * sizes[name][1] + 1e-4
        assert sizes[name][1] < 0.005
    truth = [st.load("kvlcc2_l7").parameters[one.path] for one in fit.free]
    assert (np.abs(fit.values - np.array(truth)) < 4.0 * fit.sigma).all()


@pytest.mark.slow
def test_a_first_study_of_logs_without_revolutions_reads_them(tmp_path: Path) -> None:
    n = approach(ship())[1]
    runs = {"zigzag": zigzag(), "again": run(Zigzag(n, 20.0 * DEG, 20.0 * DEG, side=-1)),
            "turn": run(Turning(n, 35.0 * DEG)), "port": run(Turning(n, -25.0 * DEG))}  # fmt: skip
    logs = [replace(without(one, "n_P", "n_P_cmd"), name=name, meta={}) for name, one in runs.items()]
    logs[0] = without(logs[0], "delta")
    (tmp_path / "trials").mkdir()
    write_trials(logs, tmp_path / "trials")
    made = draft("kvlcc2_l7", ship(), read_folder(tmp_path / "trials"), tmp_path / "study.toml")
    assert any("n_P: not on record" in note and 'do = "constant"' in note for note in made.notes)
    assert any("delta: only orders are on record" in note for note in made.notes)
    (tmp_path / "study.toml").write_text(made.text, encoding="utf-8")
    problem = read_study(tmp_path / "study.toml").problem
    fitted = [trial.name for trial in problem.trials]
    assert [name for name in problem.nuisance.common if level_of(name)[0]] == [f"level.n_P.{name}" for name in fitted]
    for trial in problem.trials:
        assert trial["n_P"] == pytest.approx(runs[trial.name]["n_P"], rel=0.05)
        np.testing.assert_allclose(trial["delta"][5:], runs[trial.name]["delta"][5:], atol=1e-9)
    assert not [one for one in lint(problem, felt=False) if one.severity == "error"]


def test_constant_revolutions_that_are_known_are_a_step() -> None:
    [made] = mended(without(zigzag(), "n_P"), [Step(do="constant", channels=("n_P",), amount=(711.0,), unit="rpm")])
    assert made["n_P"] == pytest.approx(np.full(len(made), 11.85))
    assert derived(made) == {}
    assert "take n_P as 711 rpm in every row" in made.meta["processing"]


def test_a_fit_of_logs_without_revolutions_names_the_key() -> None:
    problem = st.Problem(ship(), (without(zigzag(), "n_P", "n_P_cmd"),), st.near(ship(), "hull.N_r", ratio=0.5))
    [error] = [one for one in lint(problem, felt=False) if one.severity == "error"]
    assert error.text.endswith('assumed = ["n_P"] in [data] of the study')
