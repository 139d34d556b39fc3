"""The card of a fitted model and the bands of its manoeuvres, as their commands give them; on runs that went wrong."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from calibrated_run import calibrated
from fitted_run import saved, trial
from seatrial.cli.app import main
from seatrial.data.trialfile import read_trials, write_trial
from seatrial.identify import StudyError
from seatrial.study.store import write_summary
from seatrial.workflow import RequestError
from seatrial.workflow.asked import Bands, Orders
from seatrial.workflow.evidence.bands import simulate_with_bands
from seatrial.workflow.evidence.card import card

STUDY = """schema = "seatrial-study/1"
ship = "kvlcc2_l7"
[data]
root = "trials"
train = ["turning_35*", "zigzag_20*"]
validation = ["turning_25*"]
[free]
"hull.Y_v" = { prior = 0.3 }
[estimator]
type = "shooting:Trajectory"
window = 50.0
[report]
restart = 40.0
"""


@pytest.fixture
def run(tmp_path: Path) -> Path:
    """model.toml of a fit to two trials on disk, with a study that keeps a third back."""
    made = [trial(35, seed=1), trial(20, 20, seed=2), trial(25, seed=3)]
    (tmp_path / "trials").mkdir()
    for one in made:
        write_trial(one, tmp_path / "trials" / f"{one.name}.csv")
    study = tmp_path / "study.toml"
    study.write_text(STUDY)
    read = {one.name: one for one in read_trials([tmp_path / "trials"])}
    fit = [read[one.name] for one in made[:2]]
    return saved(tmp_path / "run", fit, test=[read[made[2].name]], file=str(study), text=STUDY)


@pytest.mark.slow
def test_a_card_judges_what_the_study_keeps_back(run: Path, tmp_path: Path) -> None:
    page = tmp_path / "card.html"
    assert main(["card", str(run), "-o", str(page), "--json"]) == 0
    found = json.loads(page.with_suffix(".json").read_text())
    assert found["schema"] == "seatrial-card/1"
    assert found["missing"] == []
    assert found["unseen"] == ["turning_25_+1"]
    assert found["restart"] == 40.0
    assert [one["role"] for one in found["trials"]] == ["fit", "fit", "kept back"]
    assert len({one["digest"] for one in found["trials"]}) == 3
    assert found["kinds"] == ["turning", "zigzag"]
    assert [row["horizon"] for row in found["rows"]] == pytest.approx([4.0, 20.0, 40.0])
    assert all(0.0 <= share <= 1.0 for row in found["rows"] for share in row["held"].values())
    assert set(found["fitness"]) | set(found["not_judged"])
    assert any("shallow" in line for line in found["must_not"])
    assert found["repeat"]["the fit"].startswith("seatrial identify ")
    assert "Signature" in page.read_text()


@pytest.mark.slow
def test_trials_that_have_vanished_leave_a_card_without_errors(run: Path, tmp_path: Path) -> None:
    shutil.rmtree(tmp_path / "trials")
    found = card(str(run)).result
    assert found.rows == ()
    assert "cannot be read" in found.missing[0]
    assert found.grounds.covered["delta"][1] > 0.6  # what the fit covers is still known
    document = card(str(run)).document
    assert any("no unseen trial" in line for line in document["must_not"])  # type: ignore[union-attr]


@pytest.mark.slow
def test_one_vanished_or_altered_trial_is_named(run: Path, tmp_path: Path) -> None:
    kept = tmp_path / "trials" / "turning_25_+1.csv"
    one = read_trials([kept])[0]
    write_trial(one.having(u=one["u"] * 1.01), kept)
    found = card(str(run)).result
    assert found.rows == ()
    assert "not as they were when the model was fitted: turning_25_+1" in found.missing
    for suffix in (".csv", ".yaml"):
        (tmp_path / "trials" / f"zigzag_20_+1{suffix}").unlink()
    assert any("zigzag_20" in line for line in card(str(run)).result.missing)


@pytest.mark.slow
def test_a_study_that_was_changed_judges_nothing(run: Path, tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_text(STUDY.replace("turning_25*", "turning_35*"))
    assert "has changed since the fit" in card(str(run)).result.missing[0]
    (tmp_path / "study.toml").unlink()
    (told,) = card(str(run)).result.missing
    assert told.startswith(str(tmp_path / "study.toml"))
    assert "Errno" not in told


@pytest.mark.slow
def test_a_renamed_trial_of_the_fit_is_not_unseen(run: Path, tmp_path: Path) -> None:
    own = read_trials([tmp_path / "trials" / "turning_35_+1.csv"])[0]
    other = tmp_path / "other"
    other.mkdir()
    write_trial(replace(own, name="new"), other / "new.csv")
    with pytest.raises(RequestError, match=r"fitted to every one of these trials \(new\)"):
        card(str(run), trials=[other])
    write_trial(replace(trial(30, seed=9), name="fresh"), other / "fresh.csv")
    found = card(str(run), trials=[other]).result
    assert [one[0] for one in found.unseen] == ["fresh"]
    assert found.missing == ("left out, as the fit used them: new",)


@pytest.mark.slow
def test_a_fit_of_before_ranges_were_kept_has_a_card_but_no_bands(run: Path) -> None:
    file = run.with_name("fit.json")
    document = json.loads(file.read_text())
    del document["grounds"], document["study_file"]
    write_summary(file.parent, document)
    found = card(str(run)).result
    assert found.grounds.covered == {}
    assert found.missing
    with pytest.raises(RequestError, match="did not keep the ranges"):
        simulate_with_bands(str(run), "turning", Bands(95.0))


@pytest.mark.slow
def test_a_fit_without_a_covariance_has_errors_without_bands(run: Path) -> None:
    file = run.with_name("fit.json")
    write_summary(file.parent, {**json.loads(file.read_text()), "covariance": [[None] * 3] * 3})
    assert not card(str(run)).result.banded


@pytest.mark.parametrize(("arguments", "said"), [
    (["card", "kvlcc2_l7"], "no fit is beside it"),
    (["card", "RUN", "-o", "card.pdf"], "ends in .html"),
    (["card", "RUN", "--restart", "-1"], "--restart"),
    (["simulate", "kvlcc2_l7", "turning", "--bands", "95"], "no posterior"),
    (["simulate", "RUN", "turning", "--bands", "100"], "below 100"),
    (["simulate", "RUN", "turning", "--bands", "95", "--draws", "20"], "take 200 to"),
    (["simulate", "RUN", "turning", "--draws", "500"], "add --bands 95"),
    (["simulate", "RUN", "turning", "--side", "port", "--bands", "95"], "leaves the trials of the fit"),
    (["simulate", "RUN", "turning", "--bands", "95", "-o", "run.parquet"], "ends in .csv"),
])  # fmt: skip
def test_wrong_requests_end_in_one_line(
    arguments: list[str], said: str, run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    before = sorted(tmp_path.rglob("*"))
    assert main([str(run) if one == "RUN" else one for one in arguments]) == 2
    error = capsys.readouterr().err.strip()
    assert said in error
    assert "\n" not in error
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.slow
def test_a_card_of_two_runs_is_refused(run: Path) -> None:
    file = run.with_name("fit.json")
    write_summary(file.parent, {**json.loads(file.read_text()), "digest": "of-another"})
    with pytest.raises(StudyError, match="keep the two files of one run together"):
        card(str(run))


@pytest.mark.slow
def test_bands_are_written_beside_the_run(run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out" / "turn.csv"
    assert main(["simulate", str(run), "turning", "--rudder", "35", "--bands", "90", "--draws", "300",
                 "-o", str(out), "--json"]) == 0  # fmt: skip
    said = capsys.readouterr()
    found = json.loads(said.out)
    advance = found["indices"]["advance"]
    assert advance["low"] < advance["value"] < advance["high"]
    assert "what the fit leaves open about its parameters" in found["caveats"][0]
    assert "what the fit leaves open about its parameters" in said.err
    with np.load(out.with_suffix(".bands.npz")) as arrays:
        assert arrays["tracks"].shape == (300, arrays["t"].size, 6)
        assert arrays["draws"].shape == (300, 3)
        assert np.all(arrays["x_low"] <= arrays["x_high"])
        low, high = np.quantile(arrays["index_advance"], (0.05, 0.95))
        assert (low, high) == pytest.approx((advance["low"], advance["high"]))
    assert "These bands count what the fit leaves open" in out.with_suffix(".bands.html").read_text()


@pytest.mark.slow
def test_what_is_extrapolated_says_so(run: Path) -> None:
    found = simulate_with_bands(str(run), "turning", Bands(95.0, 300, True), orders=Orders(35.0, side="port"))
    assert {one.channel for one in found.sailed.beyond} >= {"delta"}
    assert any(line.startswith("extrapolated: ") for line in found.sailed.caveats)


def left_out(run: Path, factor: float = 9.0, **more: object) -> Path:
    """The same run with what few left-out trials would have said of it."""
    file = calibrated(run, count=4)
    said = {"factor": factor, "trials": 4, "left": 1.0, "errors": {"one": 81.0, "two": 1.0}, **more}
    file.write_text(json.dumps({**json.loads(file.read_text()), "power": said}))
    return run


@pytest.mark.slow
def test_a_card_counts_parameters_and_no_pairs_of_them(run: Path) -> None:
    file = run.with_name("fit.json")
    held = json.loads(file.read_text())
    said = [{"subject": "hull.Y_v", "status": "weak", "text": "hardly"},
            {"subject": "hull.Y_v and a current", "status": "weak", "text": "together"}]  # fmt: skip
    write_summary(file.parent, {**held, "verdicts": said})
    (line,) = [one for one in card(str(run)).document["must_not"] if "as physics" in one]
    assert "1 of 1 parameters" in line


@pytest.mark.slow
def test_left_out_trials_widen_bands_and_give_them_beyond_the_trials(run: Path) -> None:
    """The trials go to starboard: to port the fit's own covariance is refused, the widened one is not."""
    port = Orders(35.0, side="port")
    before = simulate_with_bands(str(run), "turning", Bands(95.0, 300, True), orders=port)
    with pytest.raises(RequestError, match="seatrial calibrate MODEL"):
        simulate_with_bands(str(run), "turning", Bands(95.0, 300), orders=port)
    after = simulate_with_bands(str(left_out(run)), "turning", Bands(95.0, 300), orders=port)
    assert {one.channel for one in after.sailed.beyond} >= {"delta"}
    assert "left out of the fit in turn" in after.sailed.caveats[0]
    assert "each of 4 trials is missed by 6.4 times" in after.sailed.caveats[1]
    assert any("as wide as the priors of what the trials leave open (0 of 3 free parameters)" in line
               for line in after.sailed.caveats)  # fmt: skip
    widths = [found[2].value - found[1].value for found in (one.indices["advance"] for one in (before, after))]
    assert widths[1] > 2.0 * widths[0]


@pytest.mark.slow
def test_no_left_out_trial_tells_of_other_surroundings(run: Path) -> None:
    file = left_out(run).with_name("fit.json")
    document = json.loads(file.read_text())
    document["grounds"]["covered"]["depth"] = [1.0, 2.0]
    write_summary(file.parent, document)
    with pytest.raises(RequestError, match=r"leaves the trials of the fit: depth deep m \(trials: 1\.00 to 2\.00"):
        simulate_with_bands(str(run), "turning", Bands(95.0, 300), orders=Orders(35.0))


@pytest.mark.slow
@pytest.mark.parametrize("wrong", [{"factor": 0.0}, {"factor": "nine"}, {"trials": 1}, {"errors": 3}])
def test_what_left_out_trials_say_is_not_edited(run: Path, wrong: dict[str, object]) -> None:
    with pytest.raises(StudyError, match=r"model\.bands\.json: power\.\w+ is .* seatrial calibrate MODEL makes them"):
        simulate_with_bands(str(left_out(run, **wrong)), "turning", Bands(95.0))  # type: ignore[arg-type]


@pytest.mark.slow
def test_a_card_of_a_calibrated_model_says_how_often_its_bands_held(run: Path, tmp_path: Path) -> None:
    """Errors of the calibration are normal and of known size, so left-out coverage is the level up to chance."""
    calibrated(run, size=3.0)
    page = tmp_path / "card.html"
    assert main(["card", str(run), "-o", str(page), "--json"]) == 0
    found = json.loads(page.with_suffix(".json").read_text())["bands"]
    assert (found["recordings"], found["kinds"], found["level"]) == (24, ["turning", "zigzag"], 0.95)
    rows = [row for row in found["left_out"] if row["kind"] == "all kinds"]
    assert [row["windows"] for row in rows] == [144, 144, 144]
    for row in rows:
        for share in row["inside"].values():
            assert share == pytest.approx(0.95, abs=0.05)
    assert found["unseen"][-1]["inside"]["position"] == 1.0, "a good fit lies within bands that are wide for it"
    assert "hold up to" in page.read_text(encoding="utf-8")


@pytest.mark.slow
def test_bands_that_are_too_narrow_are_seen_on_unseen_trials_and_forbidden(run: Path, tmp_path: Path) -> None:
    """The adversary: a calibration of errors a hundredth of the real ones."""
    calibrated(run, size=0.01)
    page = tmp_path / "card.html"
    assert main(["card", str(run), "-o", str(page), "--json"]) == 0
    found = json.loads(page.with_suffix(".json").read_text())
    assert found["bands"]["unseen"][0]["inside"]["position"] < 0.5
    assert any(line.startswith("with its bands as a margin") for line in found["must_not"])


@pytest.mark.slow
def test_a_model_without_calibration_has_no_bands_that_were_held_against_errors(run: Path, tmp_path: Path) -> None:
    page = tmp_path / "card.html"
    assert main(["card", str(run), "-o", str(page), "--json"]) == 0
    assert json.loads(page.with_suffix(".json").read_text())["bands"] is None
    assert "seatrial calibrate MODEL" in page.read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_calibration_of_another_fit_makes_no_card(run: Path, tmp_path: Path) -> None:
    calibrated(run)
    beside = run.with_suffix(".bands.json")
    beside.write_text(beside.read_text().replace('"fit": "', '"fit": "x'))
    assert main(["card", str(run), "-o", str(tmp_path / "card.html")]) == 2
    assert not (tmp_path / "card.html").exists()
