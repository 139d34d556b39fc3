"""`identify --sample`: draws beside the fit, done once, refused in one line, and drawn by a campaign."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from interrupted import lasting
from seatrial.belief.drawn import read_draws
from seatrial.belief.reading import posterior
from seatrial.identify import StudyError
from seatrial.workflow import RequestError
from seatrial.workflow.asked import Bands, Orders
from seatrial.workflow.campaigns.reading import campaign_of
from seatrial.workflow.evidence.bands import simulate_with_bands
from seatrial.workflow.evidence.calibrate import calibrate
from seatrial.workflow.evidence.drawn import Drawing
from seatrial.workflow.identify import identify

pytestmark = pytest.mark.slow

STUDY = """
schema = "seatrial-study/1"
ship = "kvlcc2_l7"
[data]
train = ["a"]
[free]
"hull.Y_v" = { prior = 0.3 }
"hull.N_v" = { prior = 0.3 }
[estimator]
type = "shooting:Trajectory"
initial = "measured"
[loss]
sigma = { x = 0.05, y = 0.05, psi = 0.003 }
correlation = 5.0
[virtual]
ship = "kvlcc2_l7"
seed = 1
duration = 60.0
noise = { x = 0.05, y = 0.05, psi = 0.2 }
[virtual.trials.a]
type = "zigzag:Zigzag"
rudder = 10.0
heading = 10.0
"""


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("sampled")
    study = folder / "study.toml"
    study.write_text(STUDY)
    identify(study, folder / "run", sample=400)
    return study, folder / "run"


def test_a_run_that_ended_between_draws_and_report_ends_as_one_that_was_not(run, tmp_path, monkeypatch):
    study, whole = run

    def ended(_):
        raise KeyboardInterrupt

    with monkeypatch.context() as one:
        one.setattr("seatrial.belief.drawn.inference_data", ended)
        with pytest.raises(KeyboardInterrupt):
            identify(study, tmp_path / "run", sample=400)
    assert read_draws(tmp_path / "run") is not None
    identify(study, tmp_path / "run", sample=400)
    assert lasting(tmp_path / "run") == lasting(whole)


def test_the_run_folder_has_draws_summary_and_section(run):
    _, out = run
    found, told = read_draws(out), json.loads((out / "fit.json").read_text())
    assert found is not None
    draws = found.flat
    assert draws.shape == (400, 2)
    assert list(found.paths) == list(told["parameters"])
    assert found.said["parameters"]["hull.Y_v"]["mean"] == pytest.approx(draws[:, 0].mean())
    assert "Posterior, sampled" in (out / "report.html").read_text()
    assert not list(out.glob("checkpoint*"))


def _scaled(out: Path, to: Path, factor: float, **other: object) -> Path:
    """The run with its draws so many times as far from their mean."""
    shutil.copytree(out, to)
    with np.load(out / "posterior.npz") as held:
        arrays = {name: held[name] for name in held.files}
    middle = arrays["draws"].mean(axis=(0, 1))
    np.savez(to / "posterior.npz", **{**arrays, "draws": middle + factor * (arrays["draws"] - middle), **other})
    return to / "model.toml"


def test_bands_are_those_of_the_draws_and_as_wide_as_these(run, tmp_path):
    _, out = run
    wide = _scaled(out, tmp_path / "wide", 1.5)
    made = {at: simulate_with_bands(str(at), "turning", Bands(90.0, 400, extrapolate=True), orders=Orders(35.0)).sailed
            for at in (out / "model.toml", wide)}  # fmt: skip
    one, other = (np.nanquantile(each.bands.indices["advance"], [0.05, 0.95]) for each in made.values())
    assert all("drawn from the 400 samples of the posterior beside the model" in each.caveats for each in made.values())
    assert np.diff(other)[0] / np.diff(one)[0] == pytest.approx(1.5, rel=0.03)
    drawn = [posterior(at).draws(300, 2) for at in made]
    assert drawn[1].std(axis=0) == pytest.approx(1.5 * drawn[0].std(axis=0), rel=1e-9)
    (wide.parent / "posterior.npz").unlink()
    normal = posterior(wide)
    assert normal.samples is None
    assert normal.draws(4000, 2).std(axis=0) == pytest.approx(np.sqrt(np.diag(normal.covariance)), rel=0.05)


def test_draws_of_another_fit_or_of_other_parameters_are_refused(run, tmp_path):
    _, out = run
    with pytest.raises(StudyError, match="keep the files of one run together"):
        posterior(_scaled(out, tmp_path / "other", 1.0, fit=np.array("abc")))
    with pytest.raises(StudyError, match="keep the files of one run together"):
        posterior(_scaled(out, tmp_path / "paths", 1.0, paths=np.array(["hull.Y_v", "hull.Y_r"])))


def test_draws_that_are_done_are_not_made_again(run):
    study, out = run
    before = (out / "posterior.npz").read_bytes()
    identify(study, out, sample=400)
    assert (out / "posterior.npz").read_bytes() == before


def test_too_few_draws_are_refused_before_anything_is_fitted(run, tmp_path):
    with pytest.raises(RequestError, match="--sample 10: too few"):
        identify(run[0], tmp_path / "other", sample=10)
    assert not (tmp_path / "other" / "fit.json").exists()


def test_a_campaign_runs_draws_as_they_are(run):
    _, out = run
    document = {"schema": "seatrial-campaign/1", "ships": ["kvlcc2_l7"], "runs": 50, "posterior":
                {"fit": str(out / "posterior.npz")}, "manoeuvre": {"kind": "turning", "rudder": 35.0}}  # fmt: skip
    made = campaign_of(document, out / "campaign.toml")
    assert made.correlated is not None
    assert made.dims == 1
    found = read_draws(out)
    assert found is not None
    values = made.correlated.of(np.random.default_rng(0).random((50, 1)))
    assert all((np.abs(found.flat - one).sum(axis=1) < 1e-12).any() for one in values)
    document = {"schema": "seatrial-campaign/1", "ships": ["kvlcc2_l7"], "runs": 50, "posterior":
                {"fit": str(out / "absent.npz")}, "manoeuvre": {"kind": "turning", "rudder": 35.0}}  # fmt: skip
    with pytest.raises(RequestError, match=r"absent\.npz: no such file; name the folder of a run"):
        campaign_of(document, out / "campaign.toml")


def test_a_file_that_holds_no_draws_is_refused(tmp_path):
    (tmp_path / "posterior.npz").write_text("no archive")
    with pytest.raises(StudyError, match="cannot be read"):
        read_draws(tmp_path)


def test_trials_left_out_in_turn_are_kept_beside_the_fit(run, tmp_path):
    identify(run[0], tmp_path / "one")
    with pytest.raises(RequestError, match=r"study\.toml: 1 recordings are too few to leave each out in turn"):
        calibrate(str(tmp_path / "one" / "model.toml"))
    more = STUDY.replace('["a"]', '["*"]') + "".join(
        f'[virtual.trials.{name}]\ntype = "zigzag:Zigzag"\nrudder = {angle}\nheading = {angle}\n'
        for name, angle in (("b", 20.0), ("c", 5.0))
    )
    study = tmp_path / "study.toml"
    study.write_text(more)
    identify(study, tmp_path / "run")
    model, summary = tmp_path / "run" / "model.toml", tmp_path / "run" / "fit.json"
    plain, before = posterior(model), summary.read_bytes()
    assert plain.power is None
    found = calibrate(str(model)).result
    assert summary.read_bytes() == before
    told = json.loads((tmp_path / "run" / "model.bands.json").read_text())["power"]
    assert told["trials"] == 3
    assert set(told["errors"]) == {"a", "b", "c"}
    assert told["factor"] >= 1.0
    held = posterior(model)
    assert held.power is not None
    assert held.power.factor == told["factor"]
    assert posterior(model, weighed=False).power is None
    assert found.level == 0.75  # three recordings show no more
    few, wide = (Drawing.of(str(model), Bands(level, None)) for level in (75.0, 95.0))
    assert few.found is not None
    assert wide.found is None
    bands = tmp_path / "run" / "model.bands.json"
    bands.write_text(json.dumps({**json.loads(bands.read_text()), "fit": "another"}))
    with pytest.raises(StudyError, match=r"model\.bands\.json: is of fit another, the model beside it of fit"):
        posterior(model)
