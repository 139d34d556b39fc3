"""Training of networks: the gradient of the folded network, what a kill costs, what is refused, and that it learns."""

from __future__ import annotations

import math
import os
import shlex
import signal
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from network_trials import problem, untrained, virtual
from seatrial.core.parameters import Free
from seatrial.data import DataError, Trial
from seatrial.identify import FitError, StudyError
from seatrial.identify.networks.training import Training
from seatrial.identify.resume import ResumeError
from seatrial.models.network import Network, initial
from seatrial.models.network_pass import accelerations
from seatrial.ships import Ship
from seatrial.ships.files import load
from seatrial.ships.writing import save
from seatrial.simulate.replay import replay
from seatrial.validate.comparison import constant_velocity
from seatrial.validate.metrics import ESSO_OSAKA_SIGMA

torch = pytest.importorskip("torch")
pytestmark = pytest.mark.slow  # the library takes two seconds to import
SMALL: dict[str, Any] = {"epochs": 2, "batch": 32, "stride": 20, "horizon": 20, "learning_rate": 3e-3, "threads": 1}


def weights(ship: Ship) -> dict[str, np.ndarray]:
    model: Any = ship.model
    return model.network.weights


def same(a: Ship, b: Ship) -> bool:
    return all(np.array_equal(weights(a)[name], weights(b)[name]) for name in weights(a))


def random_batch(rows: int, windows: int, apparent: bool) -> Any:
    from seatrial.identify.networks.data import Batch

    rng = np.random.default_rng(1)

    def made(*shape: int) -> Any:
        return torch.tensor(rng.normal(size=shape))

    return Batch(
        0.3 * made(rows, windows, 6), made(rows, windows, 2), made(rows, windows, 2), 0.1 * made(rows, windows, 3),
        made(9).abs() + 1.0, 0.1, apparent,
    )  # fmt: skip


FORMS = [
    ("forgetting", 4, 4, (6, 5, 4)), ("forgetting", 1, 1, (6, 5)), ("forgetting", 13, 13, (6,)),
    ("rnn", 0, 4, (6, 5, 4)), ("rnn", 0, 1, (6,)), ("feedforward", 1, 1, (6, 5, 4)),
]  # fmt: skip


@pytest.mark.parametrize("simulate", [True, False], ids=["state", "acceleration"])
@pytest.mark.parametrize(("wind", "apparent"), [(True, False), (True, True), (False, False)])
@pytest.mark.parametrize(("kind", "memory", "known", "layers"), FORMS)
def test_gradient_of_the_folded_network_is_that_of_the_printed_equations(
    kind: str, memory: int, known: int, layers: tuple[int, ...], wind: bool, apparent: bool, simulate: bool
) -> None:
    from seatrial.identify.networks.data import fold
    from seatrial.identify.networks.engine import folded_losses, literal_losses

    scale = (0.5, 0.6, 0.7, 2.0, 1.0, 1.1, 1.2)[: 7 if wind else 5]
    network = initial(Network(kind, layers, wind=wind, memory=memory, scale=scale), 3)
    w = {name: torch.tensor(array, requires_grad=True) for name, array in network.weights.items()}
    batch, by = random_batch(14, 5, apparent), torch.tensor(scale, dtype=torch.float64)
    wanted = literal_losses(w, by, batch, kind=kind, memory=memory, known=known, simulate=simulate)
    slopes = torch.autograd.grad(wanted.sum(), list(w.values()), materialize_grads=True)
    loss = folded_losses(fold(w, by), batch, memory=memory, known=known, simulate=simulate)
    got = torch.autograd.grad(loss.sum(), list(w.values()), materialize_grads=True)
    with torch.no_grad():
        bare = folded_losses(fold(w, by), batch, memory=memory, known=known, simulate=simulate)
    assert torch.allclose(loss, wanted, rtol=1e-12)
    assert torch.equal(loss, bare)
    for a, b in zip(slopes, got, strict=True):
        assert torch.allclose(a, b, rtol=1e-10, atol=1e-13)
    if kind == "forgetting" and memory == 1:
        assert not got[list(w).index("W_r0")].any()  # exactly zero, or Adam would walk on rounding errors


@pytest.mark.parametrize("kind", [
    "forgetting", "rnn", "feedforward", "lstm", "gru",
])
def test_training_and_prediction_are_one_simulation(kind: str) -> None:
    from seatrial.identify.networks.data import Rows, Source, fold
    from seatrial.identify.networks.engine import Engine, Form, simulated

    ship, trial = untrained(kind), virtual(1)
    network = initial(ship.model.network, 5)  # type: ignore[attr-defined]
    network = network.having({**network.weights, "W_2": 0.05 * network.weights["W_2"]})  # as fast as a ship
    ship = replace(ship, model=replace(ship.model, network=network))
    known = network.look_back + 1
    rows = Rows.of([trial], ship.model, measured_wind=False, window=2)  # type: ignore[arg-type]
    source = Source(rows, np.ones(9), 0.1, device="cpu", apparent=False, repeat=known - 1)
    engine = Engine(Form(network, known, 0.0), "cpu", 1)
    n = 80
    starts = np.array([0])
    theta = torch.tensor(engine.vector.exact(network.weights), dtype=torch.float32)
    loss = engine.losses(theta, source.batch(starts, n), gradient=False)[0].numpy()
    # The first known - 1 rows of a window stand for the first sample; the replay begins with that.
    held = trial.rows(slice(known - 1, n))
    predicted = replay(ship, held)
    error = [np.sum((predicted[c] - np.unwrap(held[c]) if c == "psi" else predicted[c] - held[c]) ** 2) / n
             for c in ESSO_OSAKA_SIGMA]  # fmt: skip
    np.testing.assert_allclose(loss[:6], error, rtol=2e-4, atol=1e-9)
    if engine.form.folds:
        folded = fold(engine.vector.tensors(theta), engine.scale)
        path = simulated(folded, source.batch(starts, n), memory=network.memory, known=known)
        together = torch.cat((path.psi[..., None], path.velocity), -1)[known - 1 :, 0].numpy()
        for k, name in enumerate(("psi", "u", "v_m", "r")):
            np.testing.assert_allclose(together[:, k], predicted[name], atol=1e-6)


def missed(run: Trial, by: Trial) -> float:
    """The standardised error of Wakita 2022 Eq. 25."""
    found = {c: run[c] - by[c][: len(run)] for c in ESSO_OSAKA_SIGMA}
    found["psi"] = np.unwrap(run["psi"]) - np.unwrap(by["psi"][: len(run)])
    return sum(float(np.mean((found[c] / sigma) ** 2)) for c, sigma in ESSO_OSAKA_SIGMA.items())


def test_an_epoch_brings_the_loss_down() -> None:
    fit = Training(**{**SMALL, "epochs": 6, "horizon": 30, "schedule": "cosine"}).fit(problem())
    assert fit.history[-1, 1] < 0.85 * fit.history[0, 1]
    assert fit.objective == pytest.approx(fit.history[:, 2].min())


@pytest.mark.long
@pytest.mark.parametrize(("acceleration", "most"), [(0.0, 0.25), (1.0, 0.15)])
def test_it_recovers_a_known_ship(acceleration: float, most: float) -> None:
    told, unseen = problem(untrained(layers=(24, 24)), trials=8, duration=300.0), virtual(40, 200.0)
    fit = Training(
        epochs=30, batch=128, stride=10, horizon=60, learning_rate=5e-3, schedule="cosine", patience=99, threads=1,
        acceleration=acceleration,
    ).fit(told)  # fmt: skip
    assert missed(replay(fit.ship, unseen, restart=100.0), unseen) < most
    assert missed(constant_velocity(unseen, 100.0), unseen) > 1.0


@pytest.mark.parametrize("kind", ["lstm", "gru", "rnn", "feedforward"])
def test_every_kind_trains_and_is_silent_at_the_origin(kind: str) -> None:
    fit = Training(**{**SMALL, "epochs": 1, "stride": 60}).fit(problem(untrained(kind, layers=(4, 4))))
    network = fit.ship.model.network  # type: ignore[attr-defined]
    assert np.abs(accelerations(network, np.zeros((1, 3, 7)))).max() == 0.0
    assert fit.free == ()
    assert np.isfinite(fit.objective)


def test_seed_decides_and_threads_do_not() -> None:
    told, settings = problem(), {**SMALL, "batch": 300, "stride": 2, "epochs": 1}
    one = Training(**settings).fit(told)
    assert same(one.ship, Training(**{**settings, "threads": 3}).fit(told).ship)
    assert not same(one.ship, Training(**settings, seeds=[1]).fit(told).ship)
    best = Training(**settings, seeds=[0, 1]).fit(told)
    assert best.ends.shape == (2, 1)
    assert best.objective == best.ends.min()
    assert best.ends[0, 0] == one.objective


def test_mixture_curriculum_and_a_trained_start() -> None:
    told = problem()
    first = Training(**SMALL, curriculum=[10], acceleration=0.3, wind="true", start="held", schedule="cosine").fit(told)
    assert len(first.history) == 2
    again = Training(**{**SMALL, "learning_rate": 1e-9}).fit(replace(told, ship=first.ship))
    for name, array in weights(first.ship).items():
        np.testing.assert_allclose(weights(again.ship)[name], array, rtol=1e-5, atol=1e-7)


class KilledError(Exception):
    pass


def test_goes_on_where_it_was_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("seatrial.identify.networks.training._QUICK", -1.0)
    told, estimator = problem(), Training(**{**SMALL, "epochs": 4}, seeds=[0, 1])
    whole = estimator.fit(told)
    for stop in (1, 5):
        file = tmp_path / f"{stop}.npz"

        def stopping(epoch: int, loss: float, watched: float, stop: int = stop) -> None:
            if epoch == stop + 1:
                raise KilledError

        with pytest.raises(KilledError):
            estimator.fit(told, progress=stopping, checkpoint=file)
        assert file.exists()
        again = estimator.fit(told, checkpoint=file)
        assert same(again.ship, whole.ship)
        assert np.array_equal(again.history[:, :3], whole.history[:, :3])
        with pytest.raises(ResumeError, match="another problem"):
            replace(estimator, batch=31).fit(told, checkpoint=file)


@pytest.mark.parametrize("moment", [2, 7, 11])
def test_goes_on_within_an_epoch(moment: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from seatrial.identify.networks.data import Source

    told, estimator = problem(), Training(**{**SMALL, "epochs": 3, "batch": 16, "curriculum": [12]})
    whole = estimator.fit(told)
    batch, seen = Source.batch, list[int]()

    def killed(self: Source, starts: Any, rows: int) -> Any:
        seen.append(1)
        if len(seen) == moment:
            raise KilledError
        return batch(self, starts, rows)

    monkeypatch.setattr("seatrial.identify.networks.training._PAUSE", -1.0)
    monkeypatch.setattr(Source, "batch", killed)
    with pytest.raises(KilledError):
        estimator.fit(told, checkpoint=tmp_path / "kept.npz")
    again = estimator.fit(told, checkpoint=tmp_path / "kept.npz")
    assert len(seen) > moment
    assert same(again.ship, whole.ship)
    assert np.array_equal(again.history[:, :3], whole.history[:, :3])


def test_stops_early_and_keeps_the_best() -> None:
    fit = Training(**{**SMALL, "epochs": 40, "learning_rate": 0.3}, patience=2).fit(problem())
    assert "no better for 2 epochs" in fit.status
    assert fit.objective == pytest.approx(fit.history[:, 2].min())
    assert len(fit.history) == np.argmin(fit.history[:, 2]) + 3


def test_a_loss_that_is_no_number_names_batch_and_channel(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(FitError, match=r"seed 0, epoch \d+, batch \d+: (u|v_m|r|the gradient); lower"):
        Training(**{**SMALL, "learning_rate": 1e30}).fit(problem())
    from seatrial.identify.networks.data import Source

    whole, seen = Source.batch, list[int]()

    def broken(self: Source, starts: Any, rows: int) -> Any:
        seen.append(1)
        batch = whole(self, starts, rows)
        if len(seen) == 10:  # a batch of training; each epoch has one, and two of validation
            batch.state[-1, 0, 3] = float("nan")
        return batch

    monkeypatch.setattr(Source, "batch", broken)
    fit = Training(**{**SMALL, "epochs": 20, "stride": 30}).fit(problem())
    assert ": u; kept the weights of epoch" in fit.status
    assert np.isfinite(weights(fit.ship)["W_1"]).all()


def without(trial: Trial, *names: str) -> Trial:
    kept = {n: trial[n] for n in trial.channels if n not in names}
    return replace(trial, channels=kept, meta={**trial.meta, "source": "a pond"})


BAD = [
    (lambda p: replace(p, trials=(without(virtual(1), "U_T"),)), {}, "no values of U_T; the network takes the wind"),
    (lambda p: replace(p, trials=(replace(virtual(1), t=2.0 * virtual(1).t),)), {},
     r"sampled every 0.2 s, the network runs at 0.1 s only; make it a trial file"),
    (lambda p: replace(p, trials=(virtual(1).rows(slice(0, 15)),)), {}, "15 rows; a window takes 20"),
    (lambda p: replace(p, validation=(virtual(9).rows(slice(0, 15)),)), {}, "15 rows; a window takes 20"),
    (lambda p: p, {"horizon": 3}, "horizon is 3 rows; the network looks back on 3"),
    (lambda p: replace(p, ship=load("esso_osaka_3m")), {}, "Training is for networks only; this is Mmg"),
    (lambda p: replace(p, free=(Free("dt", 0.1),)), {}, "a network has weights, no free parameters"),
    (lambda p: p, {"wind": "measured"}, "no channel U_A, gamma_A"),
    (lambda p: p, {"kind": "lstm", "memory": 4}, "for the kind 'forgetting' only"),
]  # fmt: skip


@pytest.mark.parametrize(("change", "settings", "said"), BAD)
def test_refuses_in_one_line(change: Any, settings: dict[str, Any], said: str) -> None:
    with pytest.raises((StudyError, DataError), match=said) as refused:
        Training(**{**SMALL, **settings}).fit(replace(change(problem()), linted=True))  # its own words, behind lint's
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"epochs": 0}, "epochs is 0"), ({"seeds": []}, "seeds are one or more"), ({"seeds": 3}, "list of whole"),
        ({"schedule": "linear"}, "known: constant, cosine|near"), ({"learning_rate": 0.0}, "above zero"),
        ({"acceleration": 1.5}, "a share"), ({"kind": "transformer"}, "feedforward"), ({"curriculum": [1]}, "from 2"),
    ],
)  # fmt: skip
def test_settings_that_cannot_be(settings: dict[str, Any], said: str) -> None:
    with pytest.raises(StudyError, match=said):
        Training(**settings)


def test_a_gap_is_left_out() -> None:
    r = virtual(1)["r"].copy()
    r[300] = np.nan
    told = replace(problem(), trials=(replace(virtual(1), channels={**virtual(1).channels, "r": r}),))
    assert np.isfinite(Training(**SMALL).fit(told).objective)


@pytest.mark.parametrize("name", ["r", "n_P", "U_T"])
def test_what_was_filled_is_no_data(name: str) -> None:
    from seatrial.identify.networks.data import Rows

    values = virtual(1)[name].copy()
    values[300:310] = np.nan
    model: Any = untrained().model
    found = Rows.of([virtual(1).having(**{name: values})], model, False, 20)
    starts = found.starts(20, 1)
    assert not ((starts > 300 - 20) & (starts < 310)).any()
    assert len(starts) == len(virtual(1)) - 19 - 29


def test_the_remedy_for_another_step_runs_as_printed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from seatrial.cli.app import main
    from seatrial.data.prepare import resample
    from seatrial.data.trialfile import read_trial, write_trial

    monkeypatch.chdir(tmp_path)
    Path("a log").mkdir()
    files = [Path("a log") / f"random {seed}.csv" for seed in (1, 2)]
    for seed, file in enumerate(files, start=1):
        write_trial(resample(virtual(seed), 0.2), file)
    coarse = tuple(map(read_trial, files))
    with pytest.raises(DataError, match=r"random 1: .*\(and 1 more alike\).*run: seatrial resample") as refused:
        Training(**SMALL).fit(replace(problem(), trials=coarse))
    program, *arguments = shlex.split(str(refused.value).partition("run: ")[2])
    assert program == "seatrial"
    assert main(arguments) == 0
    fine = tuple(read_trial(Path("a log_0.1s") / file.name) for file in files)
    assert np.isfinite(Training(**SMALL).fit(replace(problem(), trials=fine)).objective)


def test_without_torch_it_names_the_extra() -> None:
    code = (
        "import sys; sys.modules['torch'] = None\n"
        "from seatrial.identify.networks.training import Training\n"
        "import seatrial.models.neural, seatrial.ships.networks\n"
        "from network_trials import problem\n"
        "try: Training().fit(problem())\n"
        "except ValueError as error: print(error)"
    )
    here = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=here)
    assert "pip install 'seatrial[neural]'" in done.stdout
    assert done.stdout.count("\n") == 1


STUDY = """
schema = "seatrial-study/1"
ship = "net.toml"
[data]
root = "trials"
train = ["random 1*"]
validation = ["random 9*"]
[estimator]
type = "training:Training"
kind = "forgetting"
hidden = 6
layers = 2
memory = 4
epochs = {epochs}
stride = 20
batch = 32
horizon = 20
learning_rate = 3e-3
threads = 1
"""


def study(folder: Path, epochs: int) -> Path:
    """A study with its files."""
    from seatrial.data.trialfile import write_trial

    (folder / "trials").mkdir()
    save(untrained(), folder / "net.toml", {})
    for seed in (1, 9):
        write_trial(virtual(seed), folder / "trials" / f"random {seed}.csv")
    path = folder / "study.toml"
    path.write_text(STUDY.format(epochs=epochs), encoding="utf-8")
    return path


@pytest.mark.long
def test_a_study_ends_with_a_model_that_predicts(tmp_path: Path) -> None:
    path, run = study(tmp_path, 2), tmp_path / "run"
    subprocess.run([sys.executable, "-m", "seatrial", "identify", str(path), "-o", str(run)], check=True)
    assert {"model.toml", "weights.npz", "fit.json", "report.html", "history.csv"} <= {f.name for f in run.iterdir()}
    assert len(replay(load(run / "model.toml"), virtual(9))) == len(virtual(9))


@pytest.mark.long
def test_killed_at_random_moments_it_ends_with_the_same_weights(tmp_path: Path) -> None:
    path = study(tmp_path, 120)
    command = [sys.executable, "-m", "seatrial", "identify", str(path), "-o"]
    rng, took = np.random.default_rng(), list[float]()

    def run(out: str, least: float = math.inf) -> int:
        """Begin, and kill it `least` seconds after its first epoch."""
        with subprocess.Popen([*command, str(tmp_path / out)], stderr=subprocess.PIPE, text=True) as job:
            assert job.stderr
            assert any(line.startswith("iteration") for line in job.stderr)
            began = time.monotonic()
            with suppress(subprocess.TimeoutExpired):
                job.communicate(timeout=None if math.isinf(least) else least)
            took.append(time.monotonic() - began)
            job.kill()
        return job.returncode

    assert run("whole") == 0
    for least in took[0] * rng.uniform(0.0, 0.15, 3):  # all three together in the first half of the epochs
        assert run("killed", float(least)) == -signal.SIGKILL, (least, took)
        assert not (tmp_path / "killed" / "weights.npz").exists()
    subprocess.run([*command, str(tmp_path / "killed")], check=True, capture_output=True)
    with np.load(tmp_path / "whole" / "weights.npz") as a, np.load(tmp_path / "killed" / "weights.npz") as b:
        assert all(np.array_equal(a[name], b[name]) for name in a.files)
