"""Fine-tuning on a small problem: four parameters, short turns."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from seatrial.cli.app import main
from seatrial.core.parameters import Free, read
from seatrial.identify import StudyError
from seatrial.identify.population.evolution import Evolution
from seatrial.identify.tuning.fine_tuning import FineTuning
from seatrial.identify.tuning.ranges import Scorer, correlated, residuals, softened, within
from seatrial.identify.tuning.tuned import findings
from seatrial.sensors import Sensors
from seatrial.ships.files import load
from seatrial.simulate.replay import replay
from seatrial.study.study import read_study

pytestmark = pytest.mark.slow

STUDY = Path(__file__).parents[3] / "studies" / "suyama2023.toml"
KEPT = ("hull.R_0", "propeller.w_P0", "rudder.a_H", "rudder.gamma_Rp")
SMALL = FineTuning(ratios=(0.2, 0.6), population=8, largest=16, agree=2, starts=4, fold_starts=2,
                   method="euler", initial="measured")
TINY = replace(SMALL, ratios=(0.3,), starts=2, fold_starts=1)


def small(text):
    """The study with short trials and few parameters."""
    lines = text.replace("duration = 600.0", "duration = 150.0").splitlines()
    dropped = [x for x in lines if "ratio = 0.6" in x and not any(f'"{path}"' in x for path in KEPT)]
    return "\n".join(x for x in lines if x not in dropped) + "\n"


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    path = tmp_path_factory.mktemp("study") / "small.toml"
    settings = "ratios = [0.2]\npopulation = 8\nlargest = 16\nagree = 2\nstarts = 4\nfold_starts = 2\n"
    text = small(STUDY.read_text(encoding="utf-8")).replace(' "D+20", "D-35", "D+40"]', "]")
    path.write_text(text.replace("ratios = [0.2, 0.3, 0.4, 0.5, 0.6]", settings))
    return path


@pytest.fixture(scope="module")
def read_(study):
    return read_study(study)


@pytest.fixture(scope="module")
def tuning(read_):
    return SMALL.tune(read_.problem, read_.test)


def tiny(read_):
    """Two trials and two parameters of it."""
    return replace(read_.problem, trials=read_.problem.trials[:2], free=read_.problem.free[:2])


def same(a, b):
    """Whether two studies came out alike in every number but the seconds."""
    return all(
        np.array_equal(x.fit.values, y.fit.values) and x.left_out == y.left_out and x.tune == y.tune
        and np.array_equal(x.soft, y.soft) and x.soft_left_out == y.soft_left_out
        and all(np.array_equal(x.methods[n].ends, y.methods[n].ends) for n in x.methods)
        for x, y in zip(a.ranges, b.ranges, strict=True)
    )  # fmt: skip


def test_both_methods_agree_and_a_wider_range_fits_better(tuning):
    assert all(r.apart < 1e-4 for r in tuning.ranges)
    for r in tuning.ranges:
        assert r.fit.objective == min(m.objective for m in r.methods.values()) == r.methods[r.kept].objective
        assert sum(r.tune.values()) == pytest.approx(r.fit.objective)
        assert (np.abs(r.position) <= 1.0).all()
    costs = [r.fit.objective for r in tuning.ranges]
    assert costs == sorted(costs, reverse=True)


@pytest.mark.parametrize("seed", [2, pytest.param(3, marks=pytest.mark.long)])
def test_the_methods_agree_from_other_seeds(read_, seed):
    one = replace(read_.problem, free=within(read_.problem, 0.4))
    gradient = replace(SMALL, seed=seed).gradient(150.0).fit(one)
    evolution = Evolution(
        population=8, largest=16, agree=2, method="euler", initial="measured", seed=seed, threads=1
    ).fit(one)
    assert evolution.objective == pytest.approx(gradient.objective, rel=1e-4)


def test_tuned_beats_untuned_on_every_test_trial(tuning):
    for r in tuning.ranges:
        assert all(r.test[name] < cost for name, cost in tuning.untuned_test.items())


@pytest.mark.long
def test_the_range_is_chosen_without_the_test_trials(tuning, read_):
    totals = [sum(r.left_out.values()) for r in tuning.ranges]
    assert tuning.chosen == int(np.argmin(totals))
    blind = TINY.tune(tiny(read_))
    assert same(blind, TINY.tune(tiny(read_), read_.test))
    assert any("nothing is known" in f.text for f in findings(blind))


def test_a_trial_left_out_is_predicted_from_the_others(tuning, read_):
    out, *others = read_.problem.trials
    one = replace(read_.problem, trials=tuple(others), free=within(read_.problem, 0.2))
    fit = SMALL.gradient(150.0).fit(one)
    expected = Scorer.of(read_.problem, None, "euler").scores([out], fit.values)[out.name]
    assert tuning.ranges[0].left_out[out.name] == pytest.approx(expected, rel=1e-6)


@pytest.mark.long
def test_threads_change_no_digit_and_a_killed_run_ends_with_the_same_numbers(read_, tmp_path):
    path = tmp_path / "checkpoint.npz"
    whole = TINY.tune(tiny(read_), checkpoint=path)
    assert same(replace(TINY, threads=1).tune(tiny(read_)), whole)
    kept = sorted(tmp_path.iterdir())
    assert len(kept) == 2
    for file in kept:
        if "evolution" in file.name:  # cut in the middle of a generation
            file.write_bytes(file.read_bytes()[: file.stat().st_size * 2 // 3 + 3])
    kept[1].unlink()
    assert same(TINY.tune(tiny(read_), checkpoint=path), whole)


def test_a_range_is_cut_to_what_is_declared(read_):
    path = "rudder.a_H"
    value = read(read_.problem.ship.model, path)
    one = replace(read_.problem, free=(Free(path, value, 0.9 * value, 2.0 * value),))
    (box,) = within(one, 0.3)
    assert (box.low, box.high) == pytest.approx((0.9 * value, 1.3 * value))
    (soft,) = softened(one, 0.3, 0.5)
    assert soft.prior == value
    assert soft.sigma == pytest.approx(0.1 * value)
    assert (soft.low, soft.high) == pytest.approx((0.9 * value, 2.0 * value))
    outside = replace(read_.problem, free=(Free(path, 2.0 * value, 1.9 * value, 2.1 * value),))
    with pytest.raises(StudyError, match="outside of"):
        within(outside, 0.3)


def test_neighbours_alike_count_as_fewer():
    draw = np.random.default_rng(1)
    rows = []
    for _ in range(20):
        e = np.zeros(4000)
        for k, push in enumerate(draw.standard_normal(3999)):
            e[k + 1] = 0.9 * e[k] + push
        rows.append(e)
    first, time = correlated(rows)
    assert first == pytest.approx(0.9, abs=0.01)
    assert time == pytest.approx(1.9 / 0.1, rel=0.15)
    assert correlated([draw.standard_normal(4000)])[1] == pytest.approx(1.0, abs=0.2)


@pytest.mark.parametrize(("share", "slow"), [(1e-3, False), (0.3, True)])
def test_a_channel_that_hardly_weighs_does_not_say_how_long_errors_last(share, slow):
    """White errors of x, errors of psi that keep their sign: these count from a hundredth of the largest weight on."""
    draw, n = np.random.default_rng(2), 2000
    left = np.zeros((1, n, 6))
    left[0, :, 0] = draw.standard_normal(n)
    left[0, :, 2] = np.sqrt(share)
    scale = np.zeros((1, n, 6))
    scale[:, :, [0, 2]] = 1.0
    windows = SimpleNamespace(scale=scale, measured=draw.standard_normal((1, n, 6)))
    objective = SimpleNamespace(
        windows=windows, begun=lambda values, none=None: none, residuals=lambda values, none: left
    )
    found = residuals(SimpleNamespace(objective=lambda trials: objective), [SimpleNamespace(name="t")], np.zeros(1))
    assert found.time == pytest.approx(n if slow else 1.0, rel=0.2)
    assert found.correlation["psi"] == pytest.approx(1.0, abs=1e-3)


def test_a_complete_model_leaves_noise_and_a_lacking_one_is_told(tuning, read_):
    assert len(tuning.residuals.warnings) >= 2
    assert tuning.residuals.noise["x"] == pytest.approx(1.0, rel=0.15)
    assert any("lacks something" in f.text for f in findings(tuning))
    truth, draw = load("suzaku_tuned_05"), np.random.default_rng(4)
    noise, clean = Sensors(noise={"x": 1.0, "y": 1.0, "psi": 0.003}), []
    for trial in read_.problem.trials:
        run = replay(truth, trial, method="euler")
        noisy = noise.read(run, draw).having(delta=trial["delta"], n_P=trial["n_P"])
        for name in ("x", "y", "psi"):
            noisy[name][0] = run[name][0]
        clean.append(noisy)
    values = np.array([read(truth.model, f.path) for f in read_.problem.free])
    left = residuals(Scorer.of(replace(read_.problem, ship=truth), None, "euler"), clean, values)
    assert left.warnings == ()
    assert left.rms["x"] == pytest.approx(left.noise["x"], rel=0.15)
    assert left.independent > 1000


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"ratios": []}, "list of numbers"), ({"ratios": [0.3, 0.2]}, "must rise"), ({"ratios": [0.3, "x"]}, "list"),
        ({"starts": 0}, "starts"), ({"soft": 0.0}, "soft"), ({"population": 2}, "population"),
    ],
)  # fmt: skip
def test_settings_that_cannot_be(settings, words):
    with pytest.raises(StudyError, match=words):
        FineTuning(**settings)


def test_studies_that_cannot_be(read_):
    problem = read_.problem
    with pytest.raises(StudyError, match="keep it in one"):
        SMALL.tune(problem, problem.trials[:1])
    with pytest.raises(StudyError, match=r'give two or more, or take type = "shooting:Trajectory" with priors'):
        SMALL.tune(replace(problem, trials=problem.trials[:1]))
    with pytest.raises(StudyError, match="declares no wider"):
        FineTuning(ratios=(0.7, 0.8)).tune(problem)


@pytest.mark.long
def test_the_command_runs_it_all_and_tells_of_a_finished_run(study, tmp_path, capsys):
    out = tmp_path / "run"
    assert main(["identify", str(study), "-o", str(out), "--json"]) == 0
    first = json.loads(capsys.readouterr().out)
    assert first["schema"] == "seatrial-tuning/1"
    assert first["chosen"] == 0.2
    assert sorted(f.name for f in out.iterdir()) == [
        "fit.json", "fit.npz", "history.csv", "model.toml", "report.html", "report.json", "run.json",
    ]  # fmt: skip
    fitted = load(str(out / "model.toml"))
    best = next(r for r in first["ranges"] if r["ratio"] == first["chosen"])
    expected = {path: one["value"] for path, one in best["parameters"].items()}
    assert {path: read(fitted.model, path) for path in KEPT} == pytest.approx(expected)
    assert main(["identify", str(study), "-o", str(out), "--json"]) == 0
    captured = capsys.readouterr()
    assert "done already" in captured.err
    assert json.loads(captured.out) == first
    assert main(["identify", str(study), "-o", str(out)]) == 0
    assert "chosen" in capsys.readouterr().out
