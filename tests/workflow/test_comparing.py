"""By what scales and beside which ship a fit is judged, and in which currents."""

from __future__ import annotations

import json
import math
import re
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from seatrial.cli.app import main
from seatrial.data.trialfile import read_trial, write_trial
from seatrial.report.blocks import Line
from seatrial.ships.files import load
from seatrial.ships.writing import save
from seatrial.study.store import write_summary
from seatrial.workflow.asked import Predicting
from seatrial.workflow.comparing import provenance
from seatrial.workflow.validate import predict, validate

pytestmark = pytest.mark.slow


def judged(at: Path, model: str, capsys: pytest.CaptureFixture[str], *more: str) -> dict:
    capsys.readouterr()
    assert main(["validate", model, str(at / "logs"), "--json", *more]) == 0
    return json.loads(capsys.readouterr().out)


def test_two_models_are_judged_by_the_same_scales(fitted: Path, capsys) -> None:
    """Constant velocity knows no model, so its error tells by what was divided."""
    fit = str(fitted / "run" / "model.toml")
    ours, theirs = (judged(fitted, m, capsys)["standardised"]["constant velocity"] for m in (fit, "kvlcc2_l7"))
    assert ours == pytest.approx(theirs, rel=1e-9)
    scaled = [judged(fitted, m, capsys, "--scale", fit)["standardised"] for m in (fit, "kvlcc2_l7")]
    assert scaled[0]["constant velocity"] == pytest.approx(scaled[1]["constant velocity"], rel=1e-9)
    assert scaled[0]["constant velocity"] != pytest.approx(ours, rel=1e-2)
    assert main(["validate", fit, str(fitted / "logs"), "--scale", "kvlcc2"]) == 2


def test_a_fit_from_a_ship_file_is_judged_beside_that_ship(fitted: Path, capsys) -> None:
    said = judged(fitted, str(fitted / "run" / "model.toml"), capsys)["standardised"]
    assert said["fitted"] < said["untuned"]
    mine = judged(fitted, str(fitted / "mine.toml"), capsys)["standardised"]["mine"]
    assert math.isfinite(mine)


def test_the_estimated_current_acts_on_the_trials_it_was_estimated_on(fitted: Path, capsys) -> None:
    capsys.readouterr()
    fit = str(fitted / "run" / "model.toml")
    assert main(["validate", fit, str(fitted / "logs"), "--json"]) == 0
    told = capsys.readouterr()
    assert "a: a current of" in told.err
    errors = json.loads(told.out)["trials"]["a"]["fitted"]["metrics"]
    assert errors["x"]["rmse"] < 1.0  # 0.2 m/s over 60 s are 12 m


def shared(fitted: Path, to: Path, *kept: str, **errors: float) -> str:
    """The fit with what it might have estimated on trial a as common to all trials, and only there.

    Args:
        kept: other trials of its study.
    """
    shutil.copytree(fitted / "run", to)
    held = json.loads((to / "fit.json").read_text())
    model = (to / "model.toml").read_text()
    (to / "model.toml").write_text(re.sub(r'trained_on = \[[^\]]*\]', 'trained_on = ["a"]', model))
    held["grounds"]["trials"] = [one for one in held["grounds"]["trials"] if one["name"] in ("a", *kept)]
    write_summary(to, {**held, "nuisances": {"*": {k.replace("_", "."): v for k, v in errors.items()}}})
    return str(to / "model.toml")


def test_errors_of_instruments_are_taken_out_of_trials_of_another_source_only_where_asked(
    fitted: Path, tmp_path: Path, capsys
) -> None:
    fit = shared(fitted, tmp_path / "run", bias_psi=0.1)
    same, other = fitted, tmp_path / "other"
    shutil.copytree(same / "logs", other / "logs")
    log = read_trial(other / "logs" / "b.csv")
    write_trial(replace(log, meta={**log.meta, "source": "another tank"}), other / "logs" / "b.csv")

    def told(at: Path, *more: str) -> tuple[str, dict]:
        capsys.readouterr()
        assert main(["validate", fit, str(at / "logs"), "--json", *more]) == 0
        out = capsys.readouterr()
        return out.err, json.loads(out.out)["trials"]

    said, alike = told(same)
    assert "note: a: corrected by a bias of the heading of 5.73 deg" in said
    assert f"note: b: of the source of the trials of {fit}, so corrected by a bias of the heading of 5.73 deg" in said
    said, apart = told(other)
    assert "note: b: not of this study, nor of the source of its trials, so not corrected" in said
    assert f"--instruments {fit} does it" in said
    _, asked = told(other, "--instruments", fit)
    assert apart["a"] == asked["a"] == alike["a"]
    assert alike["b"] == asked["b"]
    ours, plain = (found["b"]["fitted"]["metrics"]["x"]["rmse"] for found in (asked, apart))
    assert ours != pytest.approx(plain, rel=1e-2)  # it sails another way from the corrected heading
    assert main(["validate", fit, str(fitted / "logs"), "--instruments", "kvlcc2"]) == 2
    assert "no fit beside it has estimated an error of an instrument" in capsys.readouterr().err


def test_a_current_of_all_trials_acts_on_those_that_the_study_keeps_back(fitted: Path, tmp_path: Path, capsys) -> None:
    """As the same current does that is given; on a trial of another study only where asked."""
    north, east = 0.2 * math.cos(0.5), 0.2 * math.sin(0.5)
    there = {"current_north": north, "current_east": east}
    kept, apart = shared(fitted, tmp_path / "kept", "b", **there), shared(fitted, tmp_path / "apart", **there)
    log = str(fitted / "logs" / "b.csv")

    def error(*words: str) -> float:
        capsys.readouterr()
        assert main(["validate", *words, log, "--json"]) == 0
        return json.loads(capsys.readouterr().out)["trials"]["b"]["fitted"]["metrics"]["x"]["rmse"]

    given = error(apart, "--current", f"0.2,{math.degrees(0.5):.9f}")
    assert error(kept) == pytest.approx(given, rel=1e-6)
    assert error(apart, "--instruments", apart) == pytest.approx(given, rel=1e-6)
    assert error(apart) != pytest.approx(given, rel=1e-2)
    assert error(kept, "--current", "0,0") == pytest.approx(error(apart), rel=1e-6)


def test_a_current_that_is_given_acts_in_place_of_any_other(fitted: Path, tmp_path: Path, capsys) -> None:
    """Trial a met .2 m/s towards .5 rad."""
    log = str(fitted / "logs" / "a.csv")
    there = f"0.2,{math.degrees(0.5):.6f}"
    capsys.readouterr()
    errors = {}
    for option in ((), ("--current", there)):
        assert main(["validate", str(fitted / "mine.toml"), log, "--json", *option]) == 0
        errors[option] = json.loads(capsys.readouterr().out)["trials"]["a"]
    assert errors["--current", there]["mine"]["metrics"]["x"]["rmse"] < errors[()]["mine"]["metrics"]["x"]["rmse"]
    assert errors["--current", there]["constant velocity"] == errors[()]["constant velocity"]
    fit = str(fitted / "run" / "model.toml")
    assert main(["predict", fit, log, "-o", str(tmp_path / "p"), "--current", there]) == 0
    told = capsys.readouterr().err
    assert "as the fit estimated" not in told
    assert told.count("acts on every trial") == 1


@pytest.mark.parametrize("command", ["predict", "validate"])
def test_a_current_and_a_time_that_cannot_be_are_refused(command: str, fitted: Path, tmp_path: Path, capsys) -> None:
    out = ["-o", str(tmp_path / "out")] if command == "predict" else []
    for option, text, told in (("--current", "90,1", "speed first, that is 1,90"), ("--fit-first", "-5", "above zero"),
                               ("--fit-first", "60", "leave nothing to predict")):  # fmt: skip
        capsys.readouterr()
        assert main([command, "kvlcc2_l7", str(fitted / "logs"), *out, option, text]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert told in line
        assert not (tmp_path / "out").exists()
    assert main([command, "kvlcc2_l7_arx", str(fitted / "logs"), *out, "--fit-first", "20"]) == 2
    assert "--fit-first: " in capsys.readouterr().err


def test_the_rest_is_compared_from_one_state_for_all(fitted: Path, capsys) -> None:
    """Nothing that the fit found on trial a is assumed; current and start come from its first 30 s."""
    report = validate(str(fitted / "run" / "model.toml"), [fitted / "logs"], how=Predicting(fit_first=30.0)).result
    for found in report.trials.values():
        assert set(found) == {"fitted", "untuned", "constant velocity"}
        starts = [[c.predicted[name][0] for name in ("x", "y", "psi", "u", "v_m", "r")] for c in found.values()]
        assert starts[1:] == [pytest.approx(starts[0], abs=1e-9)] * 2
        assert all(c.measured.t[0] == 30.0 for c in found.values())
    assert "after the first 30 s, on which the start was estimated" in report.numbers()["summary"]
    assert any("every label starts there in the same state" in line for line in report.numbers()["caveats"])
    assert not any("taken as the fit estimated" in line for line in report.changes)
    assert report.pooled["fitted"] < report.pooled["constant velocity"]


def test_predictions_begin_after_the_seconds_that_were_fitted(fitted: Path, tmp_path: Path) -> None:
    outcome = predict(str(fitted / "mine.toml"), [fitted / "logs" / "b.csv"], tmp_path / "p",
                      how=Predicting(fit_first=20.0))  # fmt: skip
    (one,) = outcome.result
    assert one.t[0] == 20.0
    assert read_trial(tmp_path / "p" / "b.csv").t[0] == 20.0
    assert set(outcome.document["fit_first"]["b"]["estimated"]) >= {"current.north", "bias.psi"}


def test_history_is_of_the_model_alone(fitted: Path, tmp_path: Path) -> None:
    model, logs = str(fitted / "mine.toml"), [fitted / "logs" / "b.csv"]
    plain, carried = (validate(model, logs, how=Predicting(20.0, history=some)).result.trials["b"]
                      for some in (None, 15.0))  # fmt: skip
    (label,) = set(plain) - {"constant velocity", "untuned", "published"}
    for other in set(plain) - {label}:
        assert carried[other].standardised == plain[other].standardised
    assert carried[label].standardised != plain[label].standardised
    (one,) = predict(model, logs, tmp_path / "p", how=Predicting(20.0, history=15.0)).result
    assert one["u"] == pytest.approx(carried[label].predicted["u"])


@pytest.mark.parametrize("command", ["predict", "validate"])
def test_histories_that_cannot_be(fitted: Path, tmp_path: Path, capsys, command: str) -> None:
    out = ["-o", str(tmp_path / "out")] if command == "predict" else []
    for model, more, told in (("kvlcc2_l7", ["--history", "0"], "history"),
                              ("kvlcc2_l7", ["--history", "9", "--fit-first", "9"], "--history: --fit-first already"),
                              ("kvlcc2_l7_arx", ["--history", "9"], "in discrete time")):  # fmt: skip
        capsys.readouterr()
        assert main([command, model, str(fitted / "logs"), *out, *more]) == 2
        (*_, line) = capsys.readouterr().err.splitlines()
        assert told in line
        assert not (tmp_path / "out").exists()


def test_a_fit_that_predicts_worse_than_before_says_so_first(fitted: Path, tmp_path: Path, capsys) -> None:
    """A fit that has found a coefficient three times too large."""
    shutil.copytree(fitted / "run", tmp_path / "run")
    model = tmp_path / "run" / "model.toml"
    spoilt = load(model)
    save(spoilt.having({"hull.N_r": 3.0 * float(spoilt.model.hull.N_r)}), model, provenance(spoilt))
    write_summary(model.parent, json.loads(model.with_name("fit.json").read_text()))
    outcome = validate(str(model), [fitted / "logs"])
    (line,) = outcome.leads
    assert outcome.shown[0].body[0] == Line(line)  # type: ignore[union-attr]
    assert line.startswith("worse than untuned: standardised error ")
    assert line.endswith("on the training trials")
    said = outcome.document["worse_than_untuned"]
    assert said["fitted"] > 1.02 * said["untuned"]
    assert validate(str(fitted / "run" / "model.toml"), [fitted / "logs"]).leads == ()
