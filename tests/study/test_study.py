from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest

from seatrial.core.parameters import ParameterError
from seatrial.data.trialfile import write_trial
from seatrial.identify import StudyError
from seatrial.manoeuvres.turning import Turning
from seatrial.ships import Entry
from seatrial.ships.estimate import estimate
from seatrial.ships.files import load, save
from seatrial.simulate.run import approach, simulate
from seatrial.study.freedom import freedom, stated
from seatrial.study.series import read_series
from seatrial.study.study import read_study
from tiers import slow_but

STUDY = """
schema = "seatrial-study/1"
ship = "kvlcc2_l7"
[data]
root = "logs"
train = ["turn_*"]
validation = ["turn_b*"]
[free]
"hull.*" = { prior = 0.3 }
"hull.X_rr" = false
"rudder.t_R" = { ratio = 0.5 }
[estimator]
type = "shooting:Trajectory"
window = 30
"""


@pytest.fixture
def study(tmp_path: Path):
    ship = load("kvlcc2_l7")
    (tmp_path / "logs").mkdir()
    for name, side in (("turn_a", 1), ("turn_b", -1)):
        policy = Turning(approach(ship)[1], side * 0.3)
        run = simulate(ship, policy, duration=60, dt=0.02, every=5, name=name)
        write_trial(run, tmp_path / "logs" / f"{name}.csv")

    def write(text: str) -> Path:
        path = tmp_path / "study.toml"
        path.write_text(text)
        return path

    return write


def test_a_study_is_read(study) -> None:
    found = read_study(study(STUDY))
    assert [t.name for t in found.problem.trials] == ["turn_a"]
    assert [t.name for t in found.problem.validation] == ["turn_b"]
    paths = [f.path for f in found.problem.free]
    assert "hull.X_rr" not in paths
    assert "rudder.t_R" in paths
    assert found.estimator.window == 30.0
    assert found.digest != read_study(study(STUDY.replace("window = 30", "window = 20"))).digest


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"kvlcc2_l7"', '"kvlcc2_l8"', "near: kvlcc2_l7"),
        ("root =", "rot =", "near: root"),
        ('root = "logs"', 'root = "nowhere"', "make it, or name another"),
        ('root = "logs"', 'root = "$NOT_SET_ANYWHERE/x"', "NOT_SET_ANYWHERE is not set"),
        ('["turn_b*"]', '["tern_b*"]', "turn_b.csv"),
        ('"rudder.t_R"', '"rudder.t_r"', "near: rudder.t_R"),
        ("ratio = 0.5", "ratoi = 0.5", "near: ratio"),
        ("window = 30", "windwo = 30", "near: window"),
        ("window = 30", 'window = "30"', "must be a number"),
        ("Trajectory", "Trajektory", "Trajectory"),
        ("seatrial-study/1", "seatrial-study/9", "this version reads"),
    ],
)
def test_what_is_wrong_is_named(study, old: str, new: str, words: str) -> None:
    with pytest.raises(StudyError) as caught:
        read_study(study(STUDY.replace(old, new)))
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ({"low": 0.4, "high": 0.4}, "no width"),
        ({"low": 0.5, "high": 0.6}, "exclude the start"),
        ({"ratio": 0.0}, "width"),
    ],
)
def test_intervals_that_cannot_be(entry: dict[str, float], words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        freedom(load("kvlcc2_l7").model, {"rudder.t_R": entry})


def test_a_zero_needs_an_absolute_width() -> None:
    model = load("esso_osaka_3m").model
    with pytest.raises(StudyError, match="give sigma"):
        freedom(model, {"body.J_z": {"prior": 0.3}})
    free, fixed = freedom(model, {"body.J*": {"prior": 0.3}})
    assert (free, fixed) == ((), ("body.J_z",))
    assert freedom(model, {"body.J_z": {"sigma": 0.1}})[0][0].sigma == 0.1


def test_a_trial_shorter_than_the_window_is_named(study) -> None:
    with pytest.raises(StudyError, match=r"turn_a lasts 60 s, estimator\.window is 90 s"):
        read_study(study(STUDY.replace("window = 30", "window = 90")))
    # A window that the study leaves to us adapts.
    assert read_study(study(STUDY.replace("window = 30", ""))).problem.trials


def test_extrapolation_is_asked_for_in_the_data(study) -> None:
    assert not read_study(study(STUDY)).problem.extrapolate
    assert read_study(study(STUDY.replace("[data]", "[data]\nextrapolate = true"))).problem.extrapolate


@pytest.mark.slow
def test_whatever_changes_the_report_of_a_run_changes_its_digest(study, monkeypatch: pytest.MonkeyPatch) -> None:
    kept_back = STUDY.replace('validation = ["turn_b*"]', 'test = ["turn_b"]')
    texts = (STUDY, kept_back, STUDY + "[report]\nrestart = 10\n", STUDY.replace("ship =", 'title = "A"\nship ='))
    seen = [read_study(study(text)).digest for text in texts]
    assert len(set(seen)) == len(texts)
    alone = STUDY.replace('validation = ["turn_b*"]', 'exclude = ["turn_b"]')
    assert read_study(study(alone)).digest != seen[1]
    monkeypatch.setattr("seatrial.study.study.__version__", "another", raising=False)
    assert read_study(study(STUDY)).digest != seen[0]


def test_an_error_of_an_instrument_may_have_no_prior(study) -> None:
    path = study(STUDY.replace("[estimator]", '[nuisance]\ncommon = { "offset.delta" = inf }\n[estimator]'))
    assert read_study(path).problem.nuisance.common == {"offset.delta": math.inf}


@pytest.mark.slow
def test_suspects_of_the_option_are_those_of_the_study(study) -> None:
    """One digest, so that a run that was begun by the one is resumed by the other."""
    path = study(STUDY)
    plain, asked = read_study(path), read_study(path, suspects=True)
    said = read_study(study(STUDY.replace("[estimator]", '[nuisance]\nsuspects = "auto"\n[estimator]')))
    assert plain.problem.nuisance.suspects == ""
    assert asked.problem.nuisance.suspects == said.problem.nuisance.suspects == "auto"
    assert asked.digest == said.digest != plain.digest


@pytest.mark.parametrize("kind", slow_but(
    ("evolution:Evolution", "fine_tuning:FineTuning", "logo:Shooting"), "fine_tuning:FineTuning",
))  # fmt: skip
def test_suspects_are_refused_where_the_estimator_cannot_estimate_them(study, kind: str) -> None:
    other = STUDY[: STUDY.index("[estimator]")] + f'[estimator]\ntype = "{kind}"\n'
    assert read_study(study(other)).problem.nuisance.suspects == ""
    with pytest.raises(StudyError, match=rf"--free-suspects needs .*; this is {kind.partition(':')[2]} with Mmg"):
        read_study(study(other), suspects=True)
    with pytest.raises(StudyError, match=r'nuisance\.suspects = "auto" needs'):
        read_study(study(other.replace("[estimator]", '[nuisance]\nsuspects = "auto"\n[estimator]')))


TABLE = """
schema = "seatrial-series/1"
[data]
root = "logs"
test = { b = "turn_b" }
[fits.able]
ship = "kvlcc2_l7"
train = ["turn_a"]
free = { "hull.N_r" = { prior = 0.3 } }
estimator = { type = "shooting:Trajectory", window = 30.0 }
[fits.unable]
like = "able"
estimator = { type = "evolution:Evolution" }
"""


@pytest.mark.slow
def test_suspects_of_a_table_are_for_the_fits_that_are_asked_for(study) -> None:
    path = study(TABLE)
    with pytest.raises(StudyError, match=r"fits\.unable: --free-suspects needs"):
        read_series(path, suspects=True)
    able, unable = read_series(path, suspects=True, only=("able",)).rows
    assert able.cells[0].problem.nuisance.suspects == "auto"
    assert able.cells[0].digest != read_series(path).row("able").cells[0].digest
    assert unable.cells[0].digest == read_series(path).row("unable").cells[0].digest


def test_the_sigmas_of_an_estimated_ship_are_priors_unless_refused(study, tmp_path: Path) -> None:
    made = estimate(Path(__file__).parents[2] / "examples/particulars/kvlcc2.toml").ship
    save(made, tmp_path / "mine.toml")
    free = """
"hull.R_0" = {}
"hull.Y_v" = { ratio = 0.5 }
"hull.N_v" = { sigma = 0.02 }
"hull.N_r" = { ratio = 0.5, prior = false }
"hull.Y_r" = { prior = 0.5 }
"""
    head = STUDY.replace('"kvlcc2_l7"', '"mine.toml"').replace("window = 30", "")
    start, end = head.index('"hull.*"'), head.index("[estimator]")
    found = read_study(study(head[:start] + free + head[end:]))
    sigma = {f.path: f.sigma for f in found.problem.free}
    stated = {path: made.entries[path].sigma for path in sigma}
    assert sigma["hull.R_0"] == stated["hull.R_0"]
    assert sigma["hull.Y_v"] == stated["hull.Y_v"]
    assert sigma["hull.N_v"] == 0.02
    assert sigma["hull.N_r"] == math.inf
    assert sigma["hull.Y_r"] == pytest.approx(0.5 * made.entries["hull.Y_r"].given)
    (note,) = [line for line in found.notes if line.startswith("priors from the ship file")]
    assert "hull.R_0 +- 0.002, hull.Y_v +- 0.056" in note
    assert "hull.N_" not in note


def test_sigmas_of_a_fitted_ship_are_no_priors() -> None:
    tanker = estimate(Path(__file__).parents[2] / "examples/particulars/kvlcc2.toml").ship
    entry = Entry("fitted in study first, from 0.01", 0.02, sigma=0.001)
    fitted = replace(tanker, entries={**tanker.entries, "hull.R_0": entry})
    assert "hull.R_0" not in stated(fitted)
    assert "hull.Y_v" in stated(fitted)
    assert not stated(load("kvlcc2_l7"))
    with pytest.raises(StudyError, match="give prior, sigma or ratio"):
        freedom(fitted.model, {"hull.R_0": {}}, stated(fitted))
