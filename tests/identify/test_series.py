"""Tables of fits: what a file says, what each cell is, what stays when a run is cut off, what is refused."""

from __future__ import annotations

import json
import os
import sys
import tomllib
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from network_trials import untrained, virtual
from seatrial.belief.spread import NAME, load_members, spreads
from seatrial.cli.app import main
from seatrial.data.trialfile import write_trial
from seatrial.identify import Problem, Progress, StudyError
from seatrial.identify.networks.training import NoTorchError, Training
from seatrial.ships.files import load
from seatrial.ships.writing import save
from seatrial.study.cells import FITS
from seatrial.study.data import read_compositions
from seatrial.study.series import Series, is_series, read_series
from seatrial.validate.series import members
from seatrial.workflow import Silent
from seatrial.workflow.identify import identify

if find_spec("torch") is None:
    pytest.skip("PyTorch is not installed", allow_module_level=True)
ROOT = Path(__file__).parents[2]
STUDY = ROOT / "studies" / "wakita2022.toml"
DATA = Path(os.environ.get("SEATRIAL_DATA", ROOT.parent / "shared" / "data")) / "esso_osaka_frt" / "data"

TABLE = """
schema = "seatrial-series/1"
seeds = [1, 2]

[data]
test = { random = "random 4" }
validation = { other = "random 3" }

[fits.memory]
ship = "untrained.toml"
train = ["random*"]

[fits.memory.estimator]
type = "training:Training"
epochs = 2
batch = 32
stride = 40
horizon = 20
threads = 1

[fits.none]
like = "memory"
seeds = [7]
estimator = { kind = "feedforward" }

[fits.physics]
ship = "esso_osaka_3m"

[[claims]]
says = "memory helps"
better = "memory"
worse = "none"
rows = ["random"]

[budgets.quick]
fits = ["none", "physics"]

[budgets.quick.settings."training:Training"]
epochs = 1

[report]
restart = 20.0
"""


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("series")
    for seed in range(1, 5):
        write_trial(virtual(seed, 30.0), folder / f"random {seed}.csv")
    save(replace(untrained(), name="esso_osaka_3m"), folder / "untrained.toml")
    return folder


def written(logs: Path, text: str = TABLE, name: str = "table.toml") -> Path:
    path = logs / name
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.slow
def test_a_fit_takes_from_the_one_it_is_like(logs: Path) -> None:
    series = read_series(written(logs))
    memory, none, physics = series.rows
    assert [cell.folder.name for cell in memory.cells] == ["seed-1", "seed-2"]
    assert [cell.seed for cell in none.cells] == [7]
    assert not physics.cells
    estimator = none.cells[0].estimator
    assert (estimator.kind, estimator.epochs, estimator.seeds) == ("feedforward", 2, (7,))
    assert len({cell.digest for row in series.rows for cell in row.cells}) == 3


@pytest.mark.slow
def test_what_is_kept_apart_is_in_no_training(logs: Path) -> None:
    series = read_series(written(logs))
    for row in series.rows[:2]:
        problem = row.cells[0].problem
        assert [t.name for t in problem.trials] == ["random 1", "random 2"]
        assert [t.name for t in problem.validation] == ["random 3"]
    assert [t.name for t in series.tests.values()] == ["random 4"]


def test_a_fit_that_watches_less_does_not_train_on_the_rest(logs: Path) -> None:
    series = read_series(written(logs, TABLE.replace("seeds = [7]", "validation = []")))
    problem = series.rows[1].cells[0].problem
    assert [t.name for t in problem.trials] == ["random 1", "random 2"]
    assert not problem.validation


def test_a_budget_is_smaller(logs: Path) -> None:
    series = read_series(written(logs), "quick")
    assert [row.key for row in series.rows] == ["none", "physics"]
    assert series.rows[0].cells[0].estimator.epochs == 1
    assert not series.claims  # one of the two is not in it


def left(series: Series, out: Path) -> list[str]:
    return [cell.name for cell in series.cells if not cell.done(out)]


@pytest.mark.long
def test_a_run_that_is_cut_off_keeps_what_is_done(logs: Path, tmp_path: Path) -> None:
    series = read_series(written(logs))
    assert len(left(series, tmp_path)) == 3

    with pytest.raises(KeyboardInterrupt):
        identify(series.path, tmp_path, sink=Stopping(2))
    first = tmp_path / FITS / "memory" / "seed-1" / "fit.json"
    before = first.stat().st_mtime_ns
    assert left(series, tmp_path) == ["memory, seed-2", "none, seed-7"]
    outcome = identify(series.path, tmp_path)
    assert list(outcome.result) == ["memory, seed-2", "none, seed-7"]
    assert not outcome.errors
    assert first.stat().st_mtime_ns == before
    assert not left(series, tmp_path)
    assert not list(tmp_path.rglob("checkpoint*"))

    again = tmp_path / "again"
    identify(series.path, again, only=["memory"])
    one, other = (members(series.rows[0], out)[1].ship.model.network for out in (tmp_path, again))
    assert one.digest == other.digest
    assert np.isfinite(members(series.rows[0], tmp_path)[0].history[:, 2]).all()


class Stopping(Silent):
    """A sink that interrupts a fit at its first row."""

    def __init__(self, number: int) -> None:
        self.left = number

    def fit(self, name: str, problem: Problem, restart: float | None, *, several: bool) -> Progress:
        self.left -= 1

        def stop(*_: float) -> None:
            if self.left == 0:
                raise KeyboardInterrupt

        return stop


@pytest.mark.slow
def test_a_table_that_goes_on_counts_what_is_done(
    logs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    study, out = str(written(logs)), str(tmp_path / "run")
    whole = Training.fit

    def fit(self: Training, problem: Problem, **given: object) -> object:
        if self.seeds == (2,):
            raise KeyboardInterrupt
        return whole(self, problem, **given)  # type: ignore[arg-type]

    monkeypatch.setattr(Training, "fit", fit)
    assert main(["identify", study, "-o", out]) == 130
    said = capsys.readouterr().err
    assert "2 of 3: memory, seed-2" in said
    assert f"run the same command again to go on in {out}" in said
    assert main(["identify", study, "-o", out]) == 130
    said = capsys.readouterr().err
    assert f"{out}: 1 of 3 fits are done already" in said
    assert "2 of 3: memory, seed-2" in said


def test_only_some(logs: Path, tmp_path: Path) -> None:
    path = written(logs)
    assert left(read_series(path, only=["none"]), tmp_path) == ["none, seed-7"]
    with pytest.raises(StudyError, match="no fit 'nome'; near: none"):
        read_series(path, only=["nome"])


@pytest.mark.slow
def test_a_folder_of_other_settings_is_refused(logs: Path, tmp_path: Path) -> None:
    series = read_series(written(logs), "quick")
    identify(series.path, tmp_path, quick=True)
    other = read_series(written(logs))
    with pytest.raises(StudyError, match=r"other settings or data.* or remove this one"):
        left(other, tmp_path)


@pytest.mark.slow
def test_a_damaged_file_of_a_fit_is_named(logs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, out = written(logs), tmp_path / "run"
    identify(path, out, quick=True)
    where = next(out.rglob("fit.json")).parent
    whole = json.loads((where / "fit.json").read_text())
    unsealed = {key: value for key, value in whole.items() if key != "seal"}
    lost = {key: value for key, value in unsealed.items() if key != "objective"}
    for name, content in (
        ("fit.json", json.dumps(whole)[:-50]), ("fit.json", "[]"), ("fit.json", json.dumps(lost)),
        ("fit.json", json.dumps({**whole, "objective": 0.0})), ("fit.json", json.dumps({**unsealed, "parameters": 3})),
        ("fit.json", json.dumps({**unsealed, "objective": "low"})), ("history.csv", "a,b\n1,2\n"),
        ("history.csv", "iteration\n1,x,2,3\n"), ("history.csv", "\x00"),
    ):  # fmt: skip
        before = (where / name).read_bytes()
        (where / name).write_text(content)
        capsys.readouterr()
        assert main(["identify", str(path), "--quick", "-o", str(out)]) == 2, (name, content)
        (line,) = (line for line in capsys.readouterr().err.splitlines() if "done" not in line)
        assert line.startswith(f"error: {where / name}: "), line
        (where / name).write_bytes(before)
    assert main(["identify", str(path), "--quick", "-o", str(out)]) == 0


@pytest.mark.slow
def test_validate_gives_the_error_of_the_table(
    logs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Where it is asked for its scales, though it is shown one of two tests; the ship of that name is another model."""
    two = TABLE.replace('{ random = "random 4" }', '{ random = "random 4", second = "random 2" }')
    out = tmp_path / "run"
    assert main(["identify", str(written(logs, two)), "--quick", "-o", str(out), "--json"]) == 0
    table = json.loads(capsys.readouterr().out)["models"]["none"]["mean"]
    fit = str(out / FITS / "none" / "seed-7" / "model.toml")
    model = [fit, str(logs / "random 4.csv"), "--restart", "20", "--scale", fit]
    assert main(["validate", *model, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert set(found["standardised"]) == {"fitted", "constant velocity"}
    assert found["standardised"]["fitted"] == pytest.approx(table["random"], rel=1e-6)
    assert main(["validate", *model]) == 0
    (line,) = [line for line in capsys.readouterr().out.splitlines() if line.startswith("errors divided by: x ")]
    assert line.endswith(f"deg/s (as where {fit} was fitted)")


MIXED = TABLE.replace("[fits.physics]", """[fits.fitted]
ship = "esso_osaka_3m_hybrid"
train = ["random*"]

[fits.fitted.estimator]
type = "widths:Widths"
window = 15.0
iterations = 2
parts = 2

[fits.fitted.free]
"hull.Y_v" = { prior = 0.3 }
"residual_Y.d_n_N" = { sigma = 1.0 }

[fits.physics]""")


def torch_fails(monkeypatch: pytest.MonkeyPatch, error: ImportError) -> None:
    """Let an import of PyTorch end with `error`."""

    class Broken:
        def find_spec(self, name: str, *_: object) -> None:
            if name == "torch":
                raise error

    monkeypatch.delitem(sys.modules, "torch", raising=False)
    monkeypatch.setattr(sys, "meta_path", [Broken(), *sys.meta_path])


@pytest.mark.long
def test_without_pytorch_the_other_fits_are_made(
    logs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    torch_fails(monkeypatch, ModuleNotFoundError("No module named 'torch'", name="torch"))
    out = tmp_path / "run"
    assert main(["identify", str(written(logs, MIXED)), "-o", str(out)]) == 1
    said = capsys.readouterr().err
    reason = "memory, none: estimator: training needs PyTorch; pip install 'seatrial[neural]'"
    assert f"3 of 4 fits failed, first {reason}" in said
    found = json.loads((out / "report.json").read_text(encoding="utf-8"))
    assert found["failed"] == [reason]
    assert [key for key, model in found["models"].items() if model["seeds"]] == ["fitted", "physics"]
    assert [path.name for path in (out / FITS).iterdir()] == ["fitted"]


@pytest.mark.long
def test_a_hybrid_has_members_that_judge_the_tests(
    logs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "run"
    assert main(["identify", str(written(logs, MIXED)), "--only", "fitted", "-o", str(out), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    folder = out / FITS / "fitted" / "one"
    assert {p.name for p in folder.iterdir()} == {
        "fit.json", "fit.npz", "history.csv", "model.toml", "run.json", "spread.npz"}  # fmt: skip
    told = spreads(load_members(folder / NAME, load(folder / "model.toml")), load(folder / "model.toml"),
                   [virtual(4, 30.0)])[0]  # fmt: skip
    assert found["spread"]["fitted"]["random"]["ratio"] == pytest.approx(told.ratio)
    assert "Spread of the hybrids on the tests" in (out / "report.html").read_text(encoding="utf-8")
    status = found["models"]["fitted"]["seeds"][0]["status"]
    assert f"prior width {found['models']['fitted']['width']:g} by left-out" in status
    assert found["models"]["physics"]["width"] is None


@pytest.mark.slow
def test_what_is_refused_leaves_no_folder(logs: Path, tmp_path: Path) -> None:
    path = written(logs, MIXED.replace("parts = 2", "parts = 3"))
    with pytest.raises(StudyError, match="parts is 3; there are 2 recordings"):
        identify(path, tmp_path / "run", only=["fitted"])
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("error", "said"), [
    (ModuleNotFoundError("No module named 'torch'", name="torch"), "needs PyTorch; pip install 'seatrial[neural]'"),
    (ModuleNotFoundError("No module named 'sympy'", name="sympy"), "fails to load: No module named 'sympy'"),
    (ImportError("libcudart.so.12: cannot open", name="torch._C"), "fails to load: libcudart.so.12"),
])  # fmt: skip
def test_only_a_missing_torch_is_told_as_such(monkeypatch: pytest.MonkeyPatch, error: ImportError, said: str) -> None:
    torch_fails(monkeypatch, error)
    with pytest.raises(NoTorchError) as caught:
        Training().fit(Problem(untrained(), (virtual(1, 30.0),), ()))
    assert said in str(caught.value)
    assert ("needs PyTorch" in str(caught.value)) == (error.name == "torch")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("seeds = [7]", "seed = 7", "no key 'seed'"),
        ('like = "memory"', 'like = "memroy"', "memory"),
        ('better = "memory"', 'better = "memori"', "memory"),
        ('rows = ["random"]', 'rows = ["turning"]', "turning"),
        ('ship = "untrained.toml"\n', "", "fits.memory.ship is missing"),
        ('train = ["random*"]\n', "", "fits.memory.train is missing"),
        ("epochs = 2", "epoch = 2", "epochs"),
        ("epochs = 2", "epochs = 0", "1 or more"),
        ('test = { random = "random 4" }', "test = {}", "data.test"),
        ('fits = ["none", "physics"]', 'fits = ["non"]', "none"),
        ('settings."training:Training"', 'settings."shooting:Trajectory"', "quick.settings: no estimator among"),
        ('fits = ["none", "physics"]', 'fits = ["physics"]', "no estimator among its fits 'training:Training'"),
        ("seeds = [7]", 'title = "memory"', "fits.memory.title: two fits are called 'memory'"),
        ("restart = 20.0", "restart = 0", "report.restart"),
        ("seeds = [1, 2]", "seeds = []", "seeds"),
        ("restart = 20.0", 'curves = { a = ["memroy"] }', "report.curves.a: no fit 'memroy'; near: memory"),
        ("seeds = [1, 2]", 'published = "absent.toml"', "published: no such file"),
    ],
)
def test_bad_files_are_refused_in_one_line(logs: Path, old: str, new: str, said: str) -> None:
    assert old in TABLE
    path = written(logs, TABLE.replace(old, new, 1), "bad.toml")
    with pytest.raises(StudyError) as caught:
        read_series(path)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)
    assert "bad.toml" in str(caught.value)


@pytest.mark.long
def test_at_the_command_line(logs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, out = written(logs), tmp_path / "run"
    assert main(["identify", str(path), "--quick", "--only", "none", "-o", str(out), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["budget"] == "quick"
    assert set(found["models"]) == {"none", "physics", "constant velocity"}
    assert (out / "report.html").exists()
    assert main(["identify", str(path), "--quick", "-o", str(out)]) == 0
    said = capsys.readouterr()
    assert "nothing was run" in said.err
    assert "physics" in said.out
    assert main(["identify", str(ROOT / "studies" / "esso_osaka_mmg.toml"), "--quick", "-o", str(out)]) == 2
    assert "one study" in capsys.readouterr().err


def test_what_is_a_table(logs: Path) -> None:
    assert is_series(written(logs))
    assert is_series(STUDY)
    assert not is_series(ROOT / "studies" / "esso_osaka_mmg.toml")
    assert not is_series(logs / "absent.toml")


def test_the_study_keeps_its_tests_out_of_the_small_compositions() -> None:
    """By the rule that it states: of each kind by name, the first files that are in neither TZB nor TZRB."""
    said = tomllib.loads(STUDY.read_text(encoding="utf-8"))["data"]
    sets = read_compositions(STUDY.parent / said["sets"])
    small = {*sets["TZB"].files, *sets["TZRB"].files}
    apart = [*said["test"].values(), *said["validation"].values()]
    assert len(set(apart)) == len(apart) == 9
    for kind, letter, count in (("random", "R", 1), ("turning", "T", 1), ("zigzag", "Z", 1), ("berthing", "B", 2)):
        free = [name for name in sorted(sets["TZRB+"].parts[letter]) if name not in small]
        tests = [name for name in said["test"].values() if name.startswith(kind)]
        assert tests == free[:count]
        assert said["validation"][kind] == free[count]
    assert not set(apart) & set(sets["test"].files)


@pytest.mark.skipif(not DATA.is_dir(), reason="Esso Osaka data absent: set SEATRIAL_DATA (NAOE-5thLab/FRT-DS-ESSO)")
@pytest.mark.long
def test_the_rehearsal_of_the_study(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["identify", str(STUDY), "--quick", "-o", str(tmp_path), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert set(found["tests"]) == {"random", "turning", "zigzag", "berthing 1", "berthing 2"}
    published = found["models"]["published"]["mean"]
    assert published["together"] == pytest.approx(0.518, abs=0.001)  # the library's ship does not change
    assert found["models"]["mmg-little"]["mean"]["together"] < published["together"]
    assert len(found["models"]["hybrid-little"]["seeds"][0]["history"]) <= 3  # its own settings of the budget
    assert found["models"]["hybrid-little"]["width"] == 0.0
    seconds = {name: sum(trial_seconds(name)) for name in ("TZB", "TZRB")}
    assert seconds == {"TZB": pytest.approx(2562.9, abs=2.0), "TZRB": pytest.approx(2536.3, abs=2.0)}


def trial_seconds(name: str) -> list[float]:
    """Duration of each training trial of a composition of the study."""
    series = read_series(STUDY, "quick")
    row = next(row for row in series.rows if row.train == (f"@{name}",))
    return [trial.duration for trial in row.cells[0].problem.trials]


@pytest.mark.parametrize("name", ["../../../X", "/abs/x", "a/b", "..", "a\\u001bb"])
def test_the_name_of_a_fit_is_no_path(logs: Path, tmp_path: Path, name: str, capsys) -> None:
    text = TABLE[: TABLE.index("[[claims]]")].replace("[fits.physics]", f'[fits."{name}"]')
    assert main(["identify", str(written(logs, text)), "-o", str(tmp_path / "run")]) == 2
    assert "names a folder of the run" in capsys.readouterr().err
    assert not (tmp_path / "run").exists()
