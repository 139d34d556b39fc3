"""What is done to trials before a model is judged on them, by hand: starts, currents, scales, labels, limits."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seatrial.belief import fit_first as first_seconds
from seatrial.belief.bands.prediction import Fan
from seatrial.belief.fit_first import Beginning
from seatrial.data import DataError, Trial
from seatrial.data.check import Finding
from seatrial.engine import SimulationError
from seatrial.identify import StudyError
from seatrial.models import STATES
from seatrial.ships.files import load
from seatrial.simulate import replay as replays
from seatrial.simulate.starts import of_a_wrong_compass
from seatrial.study import store
from seatrial.study.grounds import Grounds, Used
from seatrial.study.study import Study
from seatrial.validate.metrics import ESSO_OSAKA_SIGMA, scales
from seatrial.workflow import RequestError, comparing, data, demo, identify
from seatrial.workflow.asked import Predicting
from seatrial.workflow.comparing import STATUS, compared, judged, purpose_of, refuse, scales_asked
from seatrial.workflow.data import _damage, _doubting, importing, mend
from seatrial.workflow.validate import _about, _predicted, _purpose, _told, check

SHIP = load("kvlcc2_l7")
UNIT = dict.fromkeys(STATES, 1.0)


class Heard:
    """A sink that keeps its notes."""

    def __init__(self) -> None:
        self.notes: list[str] = []

    def note(self, line: str) -> None:
        self.notes.append(line)


def straight(name: str = "a", rows: int = 11, u: float = 1.0, **meta: Any) -> Trial:
    """North at an even speed, a row a second."""
    t = np.arange(float(rows))
    rest = dict.fromkeys(("y", "psi", "v_m", "r", "delta"), 0.0 * t)
    return Trial(name, t, {"x": u * t, "u": u + 0 * t, "n_P": 10 + 0 * t, **rest}, {}, meta)


# --- comparisons ---


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Replays that are a metre off to the east per second, beginning at the third row where a start is given."""
    calls: list[Any] = []

    def replay(ship: Any, trial: Trial, *, restart: Any, smooth_start: Any, begin: Any) -> Trial:
        calls.append((ship.name, trial.name, restart, smooth_start, begin))
        if trial.name == "wild" and ship.name == SHIP.name:
            raise SimulationError("wild: blows up at 3 s")
        part = trial.rows(slice(0 if begin is None else 3, 9))
        return part.having(y=part.t - part.t[0])

    monkeypatch.setattr(replays, "replay", replay)
    return calls


def test_a_trial_is_compared_on_the_rows_that_are_predicted_with_the_baseline_beside_it(asked: list[Any]) -> None:
    found, failed = compared(SHIP, [straight()], 5.0, UNIT, smooth_start=2.0)
    assert failed == ()
    assert [one.label for one in found] == ["published", "constant velocity"]
    assert asked == [(SHIP.name, "a", 5.0, 2.0, None)]
    assert found[0].measured.t.tolist() == found[1].measured.t.tolist() == [float(k) for k in range(9)]
    assert found[0].standardised == pytest.approx(np.mean(np.arange(9.0) ** 2))
    assert found[1].standardised == pytest.approx(0.0, abs=1e-20)


def test_what_begins_later_is_compared_from_there_in_the_estimated_state(asked: list[Any]) -> None:
    """Everybody begins at 3 s at (0, 1, 0 ...) with 2 m/s: constant velocity runs ahead by a metre a second."""
    trial = straight(kind="zigzag", set_points={"rudder": 0.1, "heading": 0.2})
    state = np.array([3.0, 0.0, 0.0, 2.0, 0.0, 0.0])
    begun: Any = {"a": SimpleNamespace(t=3.0, state=state)}
    found, _ = compared(SHIP, [trial], None, UNIT, begun=begun)
    assert asked[0][4] == (3.0, state)
    assert found[1].measured.t.tolist() == [3.0, 4.0, 5.0, 6.0, 7.0, 8.0]
    assert found[1].metrics["x"].rmse == pytest.approx(math.sqrt(np.mean(np.arange(6.0) ** 2)))
    assert not found[0].indices


def test_a_prediction_that_blows_up_is_a_line_and_leaves_the_others(asked: list[Any]) -> None:
    found, failed = compared(SHIP, [straight("wild"), straight("b")], None, UNIT)
    assert failed == ("published: wild: blows up at 3 s",)
    assert [(one.measured.name, one.label) for one in found] == [("b", "published"), ("b", "constant velocity")]
    base = replace(SHIP.having({"hull.R_0": 0.03}), name="before")
    found, failed = compared(SHIP, [straight("wild")], None, UNIT, base)
    assert [one.label for one in found] == ["untuned", "constant velocity"]
    assert failed == ("fitted: wild: blows up at 3 s",)


def test_a_carrier_predicts_the_ship_and_no_other(asked: list[Any]) -> None:
    carried: list[Any] = []
    carrier = SimpleNamespace(replay=lambda trial, **how: carried.append((trial.name, how)) or trial)
    base = replace(SHIP.having({"hull.R_0": 0.03}), name="before")
    found, _ = compared(SHIP, [straight()], 4.0, UNIT, base, smooth_start=1.0, carrier=carrier)  # type: ignore[arg-type]
    assert carried == [("a", {"restart": 4.0, "smooth_start": 1.0})]
    assert [one[0] for one in asked] == ["before"]
    assert found[0].standardised == 0.0


def test_labels_of_a_ship_of_the_library_of_a_fit_and_of_neither() -> None:
    assert list(comparing._models(SHIP, None)) == ["published"]
    assert list(comparing._models(replace(SHIP, name="mine"), None)) == ["mine"]
    twin = replace(load("kvlcc2_l7_arx"), name=SHIP.name)  # another model of the ship of that name
    assert list(comparing._models(twin, None)) == [SHIP.name]
    assert list(comparing._models(SHIP, SHIP)) == ["fitted", "published"]
    other = SHIP.having({"hull.R_0": 0.03})
    assert list(comparing._models(SHIP, other)) == ["fitted", "untuned"]


def test_a_fit_knows_the_numbers_it_began_from() -> None:
    R_0 = float(SHIP.model.hull.R_0)
    made = {"ship": SHIP.name, "began": {"hull.R_0": R_0}}
    fitted = replace(SHIP.having({"hull.R_0": 0.03}), name="fit", notes={"provenance": made})
    models = comparing._models(fitted, None)
    assert list(models) == ["fitted", "published"]
    assert float(models["published"].model.hull.R_0) == R_0
    changed = replace(fitted, notes={"provenance": {**made, "began": {"hull.R_0": 0.04}}})
    assert list(comparing._models(changed, None)) == ["fitted", "untuned"]
    old = replace(fitted, notes={"provenance": {"ship": SHIP.name}})
    assert list(comparing._models(old, None)) == ["fitted", "published"]
    assert list(comparing._models(replace(fitted, notes={"provenance": {"ship": "gone"}}), None)) == ["fitted"]


# --- scales ---


def test_scales_are_those_given_else_of_the_common_evaluator_else_the_spread() -> None:
    some = [straight(u=2.0)]
    assert scales(some, UNIT) == UNIT
    assert set(scales(some, {"x": 1.0})) == {"x"}  # too few are none: x alone varies here
    assert scales(some, {"x": 1.0})["x"] == pytest.approx(2.0 * math.sqrt(10.0))
    esso = straight(source="FRT-DS-ESSO, turn 3")
    assert scales([esso, esso], None) is ESSO_OSAKA_SIGMA
    assert scales([esso, *some], None) is not ESSO_OSAKA_SIGMA
    assert scales([], None) == {}


def test_the_origin_of_scales_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    kept: dict[str, Any] = {"fit.toml": UNIT}
    monkeypatch.setattr(store, "fitted_scale", lambda fit: kept.get(fit, {}))
    assert scales_asked([straight()], "fit.toml") == (UNIT, "as where fit.toml was fitted")
    assert scales_asked([straight()], None)[1] == "the spread of these trials"
    assert scales_asked([straight(source="FRT-DS-ESSO")], None)[1] == "those of the common evaluator of this set"
    with pytest.raises(RequestError, match="no fit beside it has kept its scales"):
        scales_asked([straight()], "other.toml")


# --- what is done to the trials ---


@pytest.fixture
def beside(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Summaries of fits by the name of their model."""
    kept: dict[str, Any] = {}
    monkeypatch.setattr(store, "summary_beside", kept.get)
    return kept


def summary(*names: str, **nuisances: dict[str, float]) -> Any:
    trials = tuple(Used(name, "fit", "", 9, 9.0, "", "tank") for name in names)
    return SimpleNamespace(nuisances={k.replace("every", "*"): v for k, v in nuisances.items()},
                           grounds=Grounds(trials))  # fmt: skip


def test_a_current_that_is_given_acts_on_every_trial(beside: dict[str, Any]) -> None:
    heard = Heard()
    found = judged(SHIP, "m", [straight("a"), straight("b")], Predicting(current="0.5,120"), heard)
    for trial in found.trials:
        assert trial["U_C"] == pytest.approx(0.5)
        assert trial["gamma_C"] == pytest.approx(math.radians(120.0))
    assert heard.notes == ["note: --current: 0.5 m/s towards 120 deg acts on every trial"]
    assert found.changes == ("--current: 0.5 m/s towards 120 deg acts on every trial",)
    with pytest.raises(RequestError, match="15 m/s"):
        judged(SHIP, "m", [straight()], Predicting(current="15.1,0"), heard)
    assert judged(SHIP, "m", [straight()], Predicting(current="15,0"), heard).trials[0]["U_C"][0] == 15.0


def test_errors_that_all_trials_share_are_taken_out_of_those_of_the_study_alone(beside: dict[str, Any]) -> None:
    beside["m"] = summary("a", every={"bias.u": 0.2}, a={"bias_v_m": 0.05})
    heard = Heard()
    found = judged(SHIP, "m", [straight("a"), straight("b")], Predicting(), heard)
    assert found.trials[0]["u"] == pytest.approx(0.8)
    assert found.trials[0]["v_m"] == pytest.approx(-0.05)
    assert found.trials[1]["u"] == pytest.approx(1.0)
    assert sum("a: corrected by a bias of" in line for line in heard.notes) == 1
    assert sum("b: not of this study" in line for line in heard.notes) == 1
    assert sum("taken as the fit estimated" in line for line in heard.notes) == 1


def test_trials_of_the_same_source_have_the_same_instruments_and_currents_of_their_own(beside: dict[str, Any]) -> None:
    beside["m"] = summary("a", every={"bias.u": 0.2, "current.north": 0.3})
    heard = Heard()
    ours, like, other = judged(
        SHIP, "m", [straight("a"), straight("b", source="tank"), straight("c", source="sea")], Predicting(), heard
    ).trials
    assert [one["u"][0] for one in (ours, like, other)] == pytest.approx([0.8, 0.8, 1.0])
    assert ours["U_C"][0] == pytest.approx(0.3)
    assert "U_C" not in like
    assert any("b: of the source of the trials of m, so corrected by a bias" in line and "current" not in line
               for line in heard.notes)  # fmt: skip
    assert any("c: not of this study, nor of the source" in line for line in heard.notes)


def test_a_prediction_is_read_as_the_instruments_of_its_trial_log_it(beside: dict[str, Any]) -> None:
    beside["m"] = summary("a", every={"bias.psi": 0.1, "bias.u": 0.2}, a={"bias_u": 0.05})
    found = judged(SHIP, "m", [straight("a"), straight("c")], Predicting(), Heard())
    for trial, logged in zip(found.trials, (straight("a"), straight("c")), strict=True):
        back = found.read[trial.name](trial)
        for name in ("psi", "u", "v_m"):
            assert back[name] == pytest.approx(logged[name]), name
    assert of_a_wrong_compass(found.trials[0])
    assert not of_a_wrong_compass(found.trials[1])


def test_what_is_written_of_a_prediction_and_of_its_bands_is_as_the_instruments_log(
    monkeypatch: pytest.MonkeyPatch, beside: dict[str, Any]
) -> None:
    """A compass .1 rad off by the fit of all trials, and another .2 by the first seconds of this one."""
    beside["m"] = summary("a", every={"bias.psi": 0.1})
    begun = Beginning(straight("a"), 3.0, np.zeros(6), {"bias.psi": 0.2}, {"bias.psi": 0.01}, 1.0)
    monkeypatch.setattr(first_seconds, "fit_first", lambda *_, **__: begun)
    edges = Fan(straight("a"), np.zeros(11), np.full((11, 6), 0.5), 0.95, "", ())

    class Bands:
        def predicted(self, trial: Trial, *_: Any) -> tuple[Trial, Fan]:
            return straight("a"), edges

    for how, off in ((Predicting(), 0.1), (Predicting(fit_first=2.0), 0.3)):
        asked = judged(SHIP, "m", [straight("a")], how, Heard())
        one, made = _predicted(SHIP, asked, asked.trials[0], how, Bands(), Heard())  # type: ignore[arg-type]
        assert one["psi"] == pytest.approx(off)
        assert one["u"] == pytest.approx(1.0)
        assert made is not None
        assert made.edges["psi"][0] == pytest.approx(off - 0.5)


def test_instruments_of_another_fit_correct_every_trial(beside: dict[str, Any]) -> None:
    beside["m"], beside["other"] = summary("a"), summary("z", every={"bias.u": 0.2})
    found = judged(SHIP, "m", [straight("a"), straight("b")], Predicting(instruments="other"), Heard())
    assert [trial["u"][0] for trial in found.trials] == pytest.approx([0.8, 0.8])
    beside["other"] = summary("z", z={"current_x": 0.1})
    with pytest.raises(RequestError, match="no fit beside it has estimated"):
        judged(SHIP, "m", [straight()], Predicting(instruments="other"), Heard())


def test_a_current_that_is_given_stands_in_place_of_those_that_were_estimated(beside: dict[str, Any]) -> None:
    beside["m"] = summary("a", every={"current.north": 0.3}, a={"current_y": 0.1, "bias_u": 0.2})
    (plain,) = judged(SHIP, "m", [straight("a")], Predicting(), Heard()).trials
    assert plain["U_C"] * np.cos(plain["gamma_C"]) == pytest.approx(0.3)
    assert plain["U_C"] * np.sin(plain["gamma_C"]) == pytest.approx(0.1)
    (given,) = judged(SHIP, "m", [straight("a")], Predicting(current="0,0"), Heard()).trials
    assert given["U_C"] == pytest.approx(0.0)
    assert given["u"] == pytest.approx(0.8)  # the bias is of the instrument


@pytest.mark.parametrize(("count", "said"), [(4, "t0, t1, t2, t3"), (5, "t0, t1, t2 and 2 more")])
def test_more_than_four_trials_are_counted(count: int, said: str) -> None:
    assert comparing._named([f"t{k}" for k in range(count)]) == said


def beginning(found: dict[str, float], sigma: float, size: float) -> Any:
    one: Any = Beginning.__new__(Beginning)
    vars(one).update(trial=straight(), found=found, sigma=dict.fromkeys(found, sigma), size=size)
    return one


def test_what_was_found_on_the_first_seconds_is_told_beyond_two_sigma() -> None:
    (line,) = comparing._begun_words(SHIP, beginning({"bias.u": 0.2}, 0.099, 1.0), 60.0)
    assert line.startswith("a: from its first 60 s: a bias of")
    (line,) = comparing._begun_words(SHIP, beginning({"bias.u": 0.2}, 0.101, 1.0), 60.0)
    assert line == "a: from its first 60 s: no current and no bias beyond 2 sigma"
    # both components of a current are told where one is clear
    both = beginning({"current.north": 0.3, "current.east": 0.01}, 0.1, 1.0)
    assert "a current of 0.3 m/s towards 1.91 deg" in comparing._begun_words(SHIP, both, 60.0)[0]
    many = comparing._begun_words(SHIP, beginning({"bias.u": 0.2}, 0.01, 9.0), 60.0)
    assert len(many) == 2
    assert "residuals 9 times the noise" in many[1]
    (none,) = comparing._begun_words(SHIP, beginning({"bias.u": 0.0}, 0.01, 9.0), 60.0)
    assert "no current and no bias is estimated" in none


# --- purposes ---


def test_a_limit_of_a_purpose_may_be_another_in_its_own_unit() -> None:
    usual = purpose_of("collision-avoidance", None)
    key = usual.accuracy[0].key
    changed = purpose_of("collision-avoidance", f" {key}=0.25 ")
    assert changed.accuracy[0].size == 0.25
    assert changed.accuracy[0].source == "as asked for by --limit"
    assert changed.accuracy[1:] == usual.accuracy[1:]
    for wrong in (f"{key}=0", f"{key}=-1", f"{key}=inf", f"{key}=wide", key):
        with pytest.raises(RequestError, match="--limit"):
            purpose_of("collision-avoidance", wrong)
    with pytest.raises(RequestError, match="--for is 'nothing'"):
        purpose_of("nothing", None)
    assert STATUS == {"fit": 0, "not fit": 3, "cannot tell": 4}


def test_trials_that_show_nothing_of_a_purpose_are_refused() -> None:
    purpose = purpose_of("collision-avoidance", None)
    with pytest.raises(RequestError, match="fitted to every one"):
        refuse(purpose, SHIP, [straight()], ["a"])
    musts = tuple(replace(one, must=True) for one in purpose.accuracy if one.of == "overshoot")
    with pytest.raises(RequestError, match="no trial shows"):
        refuse(replace(purpose, accuracy=musts), SHIP, [straight()], [])
    refuse(replace(purpose, accuracy=tuple(replace(one, must=False) for one in musts)), SHIP, [straight()], [])


@pytest.mark.parametrize(("size", "scale", "wide"), [(0.71, None, True), (0.69, None, False), (71.0, 100.0, True),
                                                     (69.0, 100.0, False)])  # fmt: skip
def test_metres_of_a_ship_are_much_for_a_model_beyond_a_tenth_of_it(size: float, scale: Any, wide: bool) -> None:
    """Of a model of 7 m; at full scale where the scale is on record."""
    purpose = purpose_of("collision-avoidance", None)
    trial = straight(**({} if scale is None else {"scale": scale}))
    one = replace(purpose.accuracy[0], size=size, unit="m", must=True, of="overshoot", horizon=0.0, when="", source="x")
    with pytest.raises(RequestError) as told:
        refuse(replace(purpose, accuracy=(one,)), SHIP, [trial], [])
    assert ("is much for" in str(told.value)) is wide
    if wide:
        assert ("a scale" in str(told.value)) is (scale is None)


# --- words and counts of validate and check ---


def test_how_trials_were_predicted_is_told() -> None:
    assert _told(Predicting()) == {"restart": "none"}
    assert _told(Predicting(restart=60.0, smooth_start=2.5, history=30.0)) == {
        "restart": "60 s", "starts": "from the readings of 2.5 s", "carried on": "what acted in 30 s before each start"}
    assert _purpose(None, None, 5.0) is None
    with pytest.raises(RequestError, match="name one with --for"):
        _purpose(None, "a=1", None)
    with pytest.raises(RequestError, match="leave --fit-first out"):
        _purpose("collision-avoidance", None, 5.0)


def test_an_overlap_is_listed_under_the_trial_that_is_tested() -> None:
    one = SimpleNamespace(kind="overlap", trials=("train", "test"))
    assert _about(one) == ("test",)  # type: ignore[arg-type]
    assert _about(SimpleNamespace(kind="gap", trials=("a", "b"))) == ("a", "b")  # type: ignore[arg-type]


def test_findings_are_counted_by_severity(monkeypatch: pytest.MonkeyPatch) -> None:
    from seatrial.workflow import validate

    def finding(severity: Any, *names: str) -> Finding:
        found: Any = Finding.__new__(Finding)
        vars(found).update(dict.fromkeys(Finding.__dataclass_fields__, ""), severity=severity, trials=names,
                           what=severity, steps=(), kind="gap", where=names[0])  # fmt: skip
        return found

    some = [finding("error", "a"), finding("warning", "a"), finding("warning", "a", "b"), finding("info", "b")]
    monkeypatch.setattr(validate, "read_trials", lambda paths: [straight("a"), straight("b")])
    monkeypatch.setattr(validate, "check_folder", lambda trials: some)
    found = check([Path("x")])
    assert found.document["counts"] == {"error": 1, "warning": 2, "info": 1}
    assert [len(found.result[name]) for name in ("a", "b")] == [3, 2]
    assert len(found.errors) == 1
    assert found.shown[0].body[-1].text == "2 trials: 1 error, 2 warnings, 1 note"  # type: ignore[union-attr]


# --- logs ---


def test_what_is_missing_of_a_log_is_told() -> None:
    assert _damage({}) == _damage({"all": 9, "invalid": 0}) == ""
    assert _damage({"all": 9, "invalid": 2}) == "2 of 9 lines are no valid sentence and are left out"
    assert _damage({"all": 9, "invalid": 2, "untimed": 3}) == (
        "2 of 9 lines are no valid sentence and 3 sentences have no time and are left out")
    assert importing("csv", Path("a"), Path("b")) == ("csv", Path("a"), Path("b"))
    for given in ((None, Path("a"), Path("b")), ("csv", None, Path("b")), ("csv", Path("a"), None)):
        with pytest.raises(RequestError):
            importing(*given)


def test_doubts_stand_at_the_head_of_a_guess_before_those_there_were() -> None:
    from seatrial.data.guess import DOUBT, Guess

    some: Any = Guess.__new__(Guess)
    vars(some).update(dict.fromkeys(Guess.__dataclass_fields__, ()), text="# head\n\n[map]\na = 1", doubts=("old",))
    found = _doubting(some, ["new"])
    assert found.text == f"# head\n# {DOUBT} new\n\n[map]\na = 1"
    assert found.doubts == ("new", "old")


def test_two_parts_of_one_name_are_refused(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(data, "read_steps", lambda by: [SimpleNamespace(trials=("a",))])
    monkeypatch.setattr(data, "read_trials", lambda paths: [straight("a"), straight("b")])
    monkeypatch.setattr(data, "mended", lambda trial, steps: [replace(trial, name="same")])
    with pytest.raises(DataError, match="two trials would be called same"):
        mend([tmp_path / "logs"], Path("steps.toml"), tmp_path / "out")
    monkeypatch.setattr(data, "read_steps", lambda by: [SimpleNamespace(trials=("c",))])
    with pytest.raises(DataError, match="no trial 'c'"):
        mend([tmp_path / "logs"], Path("steps.toml"), tmp_path / "out")
    monkeypatch.setattr(data, "read_steps", lambda by: [])
    monkeypatch.setattr(data, "mended", lambda trial, steps: [trial])
    assert [p.name for p in mend([tmp_path / "logs"], Path("s"), tmp_path / "out")] == ["a.csv", "b.csv"]


# --- the worked example ---


def test_the_demo_records_twenty_seconds_of_a_straight_approach() -> None:
    run = straight(rows=21)
    run = replace(run, t=0.1 * run.t)
    found = demo._with_approach(run, 1.5, 9.0)
    assert found.t[0] == -20.0
    assert np.diff(found.t) == pytest.approx(0.1)
    assert len(found) == 200 + 21
    before = found.rows(slice(0, 200))
    assert before["x"] == pytest.approx(1.5 * before.t)
    assert (before["u"] == 1.5).all()
    assert (before["n_P"] == 9.0).all()
    assert (before["delta"] == 0.0).all()
    assert found["n_P"][200:].tolist() == [10.0] * 21


def test_the_demo_counts_what_is_within_three_sigma_of_the_truth(tmp_path: Path) -> None:
    paths = ("hull.R_0", "hull.Y_v", "hull.N_r")
    exact = [float(getattr(SHIP.model.hull, path.partition(".")[2])) for path in paths]
    sigma = np.array([0.001, 0.01, 0.01])
    fit: Any = SimpleNamespace(
        free=[SimpleNamespace(path=path) for path in paths], sigma=sigma, status="converged", seconds=2.34,
        values=np.array(exact) + sigma * np.array([2.9, -3.1, 0.0]), evaluations=17,
        verdicts=[SimpleNamespace(status=one) for one in ("identified", "weak", "identified")],
    )  # fmt: skip
    found = demo._summary(fit, SHIP, ["first", "second"], {"fitted": 0.5}, tmp_path)
    assert (found["within_3_sigma"], found["parameters"]) == (2, 3)
    lines = "\n".join(found["lines"])
    assert "2 of 3 parameters within 3 sigma" in lines
    assert "2 of 3 identified" in lines
    assert "5 for the fit, 3 kept back" in lines
    assert "2 findings, such as: first" in lines
    assert "converged in 2.3 s, 17 evaluations" in lines
    assert len(demo.HIDDEN) == 12
    assert max(abs(factor - 1.0) for factor in demo.HIDDEN.values()) == pytest.approx(0.2)


def test_the_demo_fits_from_the_handbook_with_priors_of_thirty_percent(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    from seatrial.identify.trajectory import shooting

    sailed: list[Any] = []
    fitted: list[Any] = []
    told: list[Any] = []

    class Estimator:
        def __init__(self, **how: Any) -> None:
            fitted.append(how)

        def fit(self, problem: Any) -> Any:
            fitted.append(problem)
            return "fit"

    monkeypatch.setattr(shooting, "Trajectory", Estimator)
    monkeypatch.setattr(demo, "_trial",
                        lambda ship, *plan: sailed.append((ship, plan[:3])) or straight(str(len(sailed))))  # fmt: skip
    monkeypatch.setattr(demo, "check_folder", lambda trials: [])
    monkeypatch.setattr(demo, "lint", lambda problem: ())
    monkeypatch.setattr(demo, "save_fit", lambda *given, **more: told.append((given, more)))
    monkeypatch.setattr(demo, "_report", lambda *given: {"fitted": 0.5})
    monkeypatch.setattr(demo, "_summary", lambda fit, truth, findings, pooled, out: (fit, truth, pooled))
    said: list[str] = []
    fit, truth, pooled = demo.tell(tmp_path, said.append)  # type: ignore[misc]
    assert (fit, pooled, len(said)) == ("fit", {"fitted": 0.5}, 3)
    handbook = load(demo.SHIP)
    how, problem = fitted
    assert how == {"window": 200.0, "every": 5, "method": "rk4", "tolerance": 1e-8}
    for one in problem.free:
        part, name = one.path.split(".")
        usual, true = (float(getattr(getattr(ship.model, part), name)) for ship in (handbook, truth))
        assert true == pytest.approx(demo.HIDDEN[one.path] * usual)
        assert (one.start, one.prior, one.sigma) == (usual, usual, pytest.approx(0.3 * abs(usual)))
    assert [one.path for one in problem.free] == list(demo.HIDDEN)
    assert (dict(problem.loss.sigma), problem.loss.correlation) == (dict(demo.NOISE), 0.0)
    assert dict(problem.nuisance.initial) == dict(demo.NOISE)
    assert [trial.name for trial in problem.trials] == list("12345")
    assert {id(ship) for ship, _ in sailed} == {id(truth)}
    training = [(35, None, 1), (20, None, -1), (10, 10, 1), (20, 20, -1), (15, 5, 1)]
    assert [plan for _, plan in sailed] == [*training, (35, None, -1), (25, None, 1), (15, 15, 1)]
    ((_, out, _), more) = told[0]
    assert out == tmp_path
    assert [trial.name for trial in more["test"]] == list("678")


def test_the_demo_turns_to_the_side_and_by_the_angles_of_its_plan(monkeypatch: pytest.MonkeyPatch) -> None:
    ran: list[Any] = []

    def simulate(ship: Any, policy: Any, **how: Any) -> Trial:
        ran.append((policy, how))
        return replace(straight(), t=0.1 * np.arange(11.0), channels={
            **straight().channels, "n_P_cmd": np.full(11, 10.0), "delta_cmd": np.zeros(11)})  # fmt: skip

    monkeypatch.setattr(demo, "simulate", simulate)
    monkeypatch.setattr(demo, "_with_approach", lambda run, U, n_P: run)
    rng = np.random.default_rng(0)
    demo._trial(SHIP, 20, None, -1, rng)
    demo._trial(SHIP, 15, 5, 1, rng)
    (turn, how), (zigzag, more) = ran
    assert turn.delta == pytest.approx(-math.radians(20.0))
    assert (zigzag.delta, zigzag.psi, zigzag.side) == pytest.approx((math.radians(15.0), math.radians(5.0), 1.0))
    assert (how["name"], more["name"]) == ("turning_20_port", "zigzag_15_5_starboard")
    assert (how["duration"], how["dt"], how["every"]) == (180.0, 0.02, 5)
    degree = math.radians(1.0)
    assert dict(demo.NOISE) == pytest.approx({"x": 0.03, "y": 0.03, "psi": 0.1 * degree, "u": 0.005, "v_m": 0.005,
                                              "r": 0.05 * degree})  # fmt: skip
    assert demo.RESTART == 60.0


# --- what a study file asks for ---


def test_a_rival_of_virtual_trials_needs_trials_kept_back(monkeypatch: pytest.MonkeyPatch) -> None:
    nothing: Any = None
    study = Study("s", Path("s.toml"), nothing, nothing, (), None, "d", rival=("x",), virtual=object())  # type: ignore[arg-type]
    monkeypatch.setattr(identify, "is_series", lambda path: False)
    monkeypatch.setattr(identify, "read_study", lambda path, suspects: study)
    with pytest.raises(StudyError, match="trials kept back"):
        identify._read(study.path, False, (), False)
    for allowed in ({"test": ("t",)}, {"rival": ()}, {"virtual": None}):
        other = replace(study, **allowed)  # type: ignore[arg-type]
        monkeypatch.setattr(identify, "read_study", lambda path, suspects, other=other: other)
        assert identify._read(study.path, False, (), False) is other
    for quick, only in ((True, ()), (False, ("a",))):
        with pytest.raises(RequestError, match="--quick and --only"):
            identify._read(study.path, quick, only, False)
