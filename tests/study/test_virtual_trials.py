"""Virtual trials: what the study file says, what the log holds, and what is wrong with a table."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from seatrial.core.records import filled
from seatrial.identify import StudyError
from seatrial.sensors import Sensors
from seatrial.study import virtual
from seatrial.study.schema import VirtualTable
from seatrial.study.study import read_study

STUDY = Path(__file__).parents[2] / "studies" / "suyama2023.toml"
SHORT = STUDY.read_text(encoding="utf-8").replace("duration = 600.0", "duration = 40.0")


def document(text=SHORT):
    import tomllib

    return virtual.read(filled(VirtualTable, tomllib.loads(text)["virtual"], "s.toml", StudyError))


@pytest.fixture(scope="module")
def trials():
    return {trial.name: trial for trial in document().run()}


@pytest.mark.slow
def test_the_study_is_that_of_the_paper(tmp_path):
    path = tmp_path / "suyama2023.toml"
    path.write_text(SHORT)
    study = read_study(path)
    assert [t.name for t in study.problem.trials] == ["D+10", "D-20", "D+35", "D-40"]  # Eq. 41
    assert [t.name for t in study.test] == ["D-10", "D+20", "D-35", "D+40"]  # Eq. 42
    assert len(study.problem.free) == 12  # Eq. 37
    L_pp = study.problem.ship.L_pp
    weights = {name: sigma**-2 for name, sigma in study.problem.loss.sigma.items()}
    assert weights == pytest.approx({"x": L_pp, "y": L_pp, "psi": 0.25 * math.pi})  # Q, section 6.2
    assert study.problem.loss.correlation == 0.0
    assert study.title


@pytest.mark.slow
def test_the_log_holds_states_and_orders_and_nothing_else(trials):
    for name, trial in trials.items():
        assert set(trial.channels) == {"x", "y", "psi", "u", "v_m", "r", "n_P", "delta"}
        assert trial["delta"] == pytest.approx(math.radians(float(name[1:])))
        assert trial["n_P"] == pytest.approx(106 / 60)
        assert np.diff(trial.t) == pytest.approx(1.0)
        assert np.sign(trial["r"][-1]) == np.sign(trial["delta"][-1])
        assert "ship" not in trial.meta


@pytest.mark.slow
def test_the_rudder_lags_behind_its_order():
    acting = replace(document(), orders=False).run()[0]
    angle = acting["delta"] / math.radians(10.0)
    # Rows hold the mean over the step before them; a lag of 2 s has passed 1 - exp(-t/2).
    assert angle[[2, 4]] == pytest.approx(1.0 - np.exp(-0.5 * np.array([1.95, 3.95])), abs=0.01)


@pytest.mark.slow
def test_noise_is_of_the_size_told_and_in_the_first_sample_too(trials):
    clean = {t.name: t for t in replace(document(), sensors=Sensors()).run()}
    for channel, sigma in (("x", 1.0), ("y", 1.0), ("psi", math.radians(0.2))):
        noise = np.array([trials[name][channel] - clean[name][channel] for name in trials])
        assert noise.std() == pytest.approx(sigma, rel=0.15)
        assert (noise[:, 0] != 0).all()
    for channel in ("u", "v_m", "r"):
        assert all(np.array_equal(trials[n][channel], clean[n][channel]) for n in trials)


@pytest.mark.long
def test_one_seed_decides_everything(trials):
    again = {t.name: t for t in document().run()}
    assert all(np.array_equal(again[n][c], trials[n][c]) for n in trials for c in trials[n].channels)
    other = replace(document(), seed=2).run()[0]
    assert not np.array_equal(other["u"], trials["D+10"]["u"])  # other gusts
    weather = [document().weather(k).series(1.0, 100) for k in (0, 1)]
    assert not np.array_equal(*weather)
    assert np.hypot(weather[0][:, 0], weather[0][:, 1]).mean() == pytest.approx(3.0, abs=0.6)
    assert np.degrees(np.arctan2(weather[0][0, 1], weather[0][0, 0])) % 360 == pytest.approx(60.0)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('ship = "suzaku_tuned_05"', 'ship = "suzaku_tuned_07"', "near: suzaku_tuned_0"),
        ("lag = { rudder = 2.0 }", "lag = { ruder = 2.0 }", "near: rudder"),
        ("psi = 0.2 }", "psy = 0.2 }", "near: psi"),
        ("x = 1.0, y", "x = -1.0, y", "zero or above"),
        ('"davenport"', '"davenprt"', "near: davenport"),
        ("A_T = 130.0", "A_t = 130.0", "near: A_T"),
        ("A_T = 130.0", 'A_T = "130"', "must be a number"),
        ("blendermann:Blendermann", "blendermann:Blenderman", "Blendermann"),
        ("sample = 1.0", "sample = 0.25", "whole number of steps"),
        ("step = 0.1", "step = 0.0", "above zero"),
        ("rudder = 40.0", "rudder = 45.0", "goes to 40 deg"),
        ("turning:Turning", "turning:Turnings", "Turning"),
        ("rudder = 40.0", "ruder = 40.0", "near: rudder"),
        ("orders = true", "ordres = true", "near: orders"),
        ('"D-10", "D+20"', '"D+10", "D+20"', "in two of"),
        ('"D-10", "D+20"', '"D-11", "D+20"', "near: D-10"),
        ("[virtual.wind_force]", "[virtual.wind_froce]", "wind_force"),
    ],
)
def test_what_is_wrong_is_named(tmp_path, old, new, words):
    assert old in SHORT
    path = tmp_path / "study.toml"
    path.write_text(SHORT.replace(old, new))
    with pytest.raises(StudyError) as caught:
        read_study(path)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_wind_needs_a_force(tmp_path):
    start, end = SHORT.index("[virtual.wind_force]"), SHORT.index("[virtual.trials]")
    path = tmp_path / "study.toml"
    path.write_text(SHORT[:start] + SHORT[end:])
    with pytest.raises(StudyError, match="no force of wind"):
        read_study(path)


@pytest.mark.long
def test_two_studies_share_the_trials_of_one(tmp_path):
    folder = STUDY.parent
    both = [read_study(folder / f"you2023{name}.toml") for name in ("", "_as_printed")]
    for one, other in zip(*((*study.problem.trials, *study.test) for study in both), strict=True):
        assert one.name == other.name
        assert all(np.array_equal(one[name], other[name]) for name in one.channels)
    settings = both[1].estimator
    assert (settings.schedule, settings.growth, settings.starts, settings.constraints) == ("go", 1, 1, True)
    assert both[1].problem.nuisance.current == 0.0
    starts = {f.path: f.start for f in both[1].problem.free}
    assert [starts[f"inertia.m_{k}"] for k in ("11", "22", "33")] == [196.98, 254.0454, 220.1974]  # Eq. 17
    assert not any(value for path, value in starts.items() if path.startswith("damping"))


@pytest.mark.parametrize(
    ("named", "said"),
    [("nowhere.toml", "cannot be read"), ("ship.toml", "no table"), ("itself.toml", "no table")],
)
def test_a_study_that_shares_no_trials_is_refused(tmp_path, named, said):
    head = SHORT[: SHORT.index("[virtual]")]
    rest = SHORT[SHORT.index("[free]") :]
    (tmp_path / "itself.toml").write_text(head.replace("[data]", f'virtual = "{named}"\n[data]') + rest)
    (tmp_path / "ship.toml").write_text('schema = "seatrial-ship/1"\n')
    with pytest.raises(StudyError, match=f"virtual: .*{named}.*{said}"):
        read_study(tmp_path / "itself.toml")
