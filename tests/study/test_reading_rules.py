"""Lists of recordings, references to sets, roots of data and tables of fits: what is chosen, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seatrial.core.records import filled
from seatrial.data import DataError, Trial
from seatrial.data.trialfile import write_trial
from seatrial.identify import Issue, Problem, StudyError
from seatrial.ships.files import load
from seatrial.study import cells, data, series, study
from seatrial.study.data import Composition, chosen, expanded, read_compositions, read_data
from seatrial.study.schema import DataTable

L7 = load("kvlcc2_l7")
LINE = Problem(L7, (), ())
HERE = Path("s.toml")


def test_patterns_choose_in_their_own_order_and_each_must_fit() -> None:
    names = ["turn/a.csv", "turn/b.csv", "zigzag/c.csv", "zigzag/d.v2.csv"]
    assert chosen(HERE, "k", ["zigzag/*", "turn/a"], names) == ["zigzag/c.csv", "zigzag/d.v2.csv", "turn/a.csv"]
    assert chosen(HERE, "k", ["turn/b.csv", "turn/*"], names) == ["turn/b.csv", "turn/a.csv"]
    assert chosen(HERE, "k", ["zigzag/d.v2"], names) == ["zigzag/d.v2.csv"]
    assert chosen(HERE, "k", [], names) == []
    with pytest.raises(StudyError, match=r"s\.toml: k: 'turn/x' fits no file; near: turn/"):
        chosen(HERE, "k", ["turn/x"], names)
    with pytest.raises(StudyError, match="'a' fits no file; there is none"):
        chosen(HERE, "k", ["a"], [])
    with pytest.raises(StudyError, match=r"fits no file; near: turn/a\.csv, turn/b\.csv, zigzag/c\.csv"):
        chosen(HERE, "k", ["0"], names)


def test_a_reference_stands_for_a_set_or_one_kind_of_it() -> None:
    sets = {"A": Composition("A", {"t": ("one", "two"), "z": ("three",)}), "B.c": Composition("B.c", {"t": ("four",)})}
    assert sets["A"].files == ("one", "two", "three")
    assert expanded("w", ["x", "@A.z", "@A", "@B.c", "@B.c.t"], sets) == ["x", "three", "one", "two", "four"]
    for entry, told in (("@C", "no set 'C'"), ("@C.t", "no set 'C.t'"), ("@A.q", "w: @A: no kind 'q'")):
        with pytest.raises(DataError, match=told):
            expanded("w", [entry], sets)
    with pytest.raises(DataError, match="'@A' needs a file of sets"):
        expanded("w", ["@A"], {})


def test_a_file_of_sets_names_each_recording_once(tmp_path: Path) -> None:
    path = tmp_path / "sets.toml"
    head = 'schema = "seatrial-sets/1"\n'
    path.write_text(head + 'source = "x"\n[sets.A]\nt = ["a", "b"]\nz = ["c"]\n[sets.B]\nt = ["a"]\n')
    found = read_compositions(path)
    assert (found["A"].files, found["B"].files) == (("a", "b", "c"), ("a",))
    for text, told in (('schema = "other/1"\n', "sets"), (head, "sets is missing"),
                       (head + "sets = 3\n", "sets is 3; it must be a table"),
                       (head + "more = 1\n[sets.A]\nt = []\n", "no key 'more'"),
                       (head + "[sets]\nA = 3\n", "sets.A is 3; it must be a table"),
                       (head + "[sets.A]\n", "it must be a table"),
                       (head + "[sets.A]\nt = 3\n", "sets.A.t is 3; it must be a list"),
                       (head + "[sets.A]\nt = [3]\n", "sets.A.t.0 is 3; it must be a text"),
                       (head + '[sets.A]\nt = ["a"]\nz = ["a"]\n', "sets.A.z: a is in t already")):  # fmt: skip
        path.write_text(text)
        with pytest.raises(DataError, match=told):
            read_compositions(path)
    with pytest.raises(DataError, match=r"gone\.toml: .*No such file"):
        read_compositions(tmp_path / "gone.toml")


def test_a_root_is_beside_the_study_with_its_variables(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "logs").mkdir()
    monkeypatch.setenv("MINE", str(tmp_path))
    file = tmp_path / "s.toml"
    for root in ("logs", "$MINE/logs", "${MINE}/logs", str(tmp_path / "logs")):
        assert data._root(file, "data", root).resolve() == (tmp_path / "logs").resolve()
    with pytest.raises(StudyError, match=r"data\.root: the variable NOBODY is not set"):
        data._root(file, "data", "$NOBODY/logs")
    with pytest.raises(StudyError, match="make it, or name another"):
        data._root(file, "data", "none")
    monkeypatch.setenv("SEATRIAL_DATA", str(tmp_path / "gone"))
    with pytest.raises(StudyError, match="set SEATRIAL_DATA to the folder"):
        data._root(file, "data", "$SEATRIAL_DATA/x")
    monkeypatch.delenv("SEATRIAL_DATA")
    (tmp_path / "repo" / "studies").mkdir(parents=True)
    (tmp_path / "repo" / "pyproject.toml").write_text("")
    (tmp_path / "shared" / "data" / "x").mkdir(parents=True)
    found = data._root(tmp_path / "repo" / "studies" / "s.toml", "data", "$SEATRIAL_DATA/x")
    assert found.resolve() == (tmp_path / "shared" / "data" / "x").resolve()


def log(name: str, **meta: Any) -> Trial:
    t = np.arange(20.0)
    return Trial(name, t, dict.fromkeys(("x", "y", "psi", "u", "v_m", "r", "n_P", "delta"), t), meta=meta)


@pytest.fixture
def logs(tmp_path: Path) -> Path:
    (tmp_path / "logs").mkdir()
    for name in "abcd":
        write_trial(log(name), tmp_path / "logs" / f"{name}.csv")
    return tmp_path / "s.toml"


def made(table: dict[str, Any]) -> DataTable:
    return filled(DataTable, table, "s.toml", StudyError)


def read(path: Path, **table: Any) -> list[list[str]]:
    found = read_data(path, made({"root": "logs", **table}), L7)
    return [[trial.name for trial in part] for part in found]


def test_a_pattern_yields_to_test_then_to_validation(logs: Path) -> None:
    assert read(logs, train=["*"], validation=["[bc]*"], test=["c"]) == [["a", "d"], ["b"], ["c"]]
    assert read(logs, train=["*"], exclude=["a", "b"]) == [["c", "d"], [], []]
    assert read(logs, train=["d", "[ab]*"], test=["c"], exclude=["b"]) == [["d", "a"], [], ["c"]]
    # a recording below a folder by its own name, as a fit names it
    (logs.parent / "logs" / "day").mkdir()
    write_trial(log("e"), logs.parent / "logs" / "day" / "e.csv")
    assert read(logs, train=["*"], exclude=["e", "a"]) == [["b", "c", "d"], [], []]
    for more, told in (({"train": ["a"], "test": ["a"]}, r"data\.train: a\.csv is in test too"),
                       ({"train": ["a"], "validation": ["a"]}, "is in validation too"),
                       ({"train": ["*"], "exclude": ["*"]}, "nothing is left to train on"),
                       ({"train": []}, r"data\.train is missing"), ({"train": ["z"]}, "fits no file")):  # fmt: skip
        with pytest.raises(StudyError, match=told):
            read(logs, **more)


def test_a_list_beside_several_sets_is_refused(logs: Path) -> None:
    two = [{"root": "logs", "train": ["a"], "test": ["b"]}, {"root": "logs", "train": ["c"], "validation": ["d"]}]
    found = read_data(logs, made({"set": two, "extrapolate": True}), L7)
    assert [[trial.name for trial in part] for part in found] == [["a", "c"], ["d"], ["b"]]
    with pytest.raises(StudyError, match=r"data\.train stands beside \[\[data\.set\]\]"):
        read_data(logs, made({"set": two, "train": ["a"]}), L7)


@pytest.mark.slow
def test_a_format_has_its_mapping_where_it_needs_one(logs: Path) -> None:
    for table, told in (({"mapping": "m.toml"}, r"data\.mapping is of no use without a format"),
                        ({"format": "csv"}, r"data\.mapping is missing; the format csv needs it"),
                        ({"format": "vhs"}, r"data\.format: ")):  # fmt: skip
        with pytest.raises(StudyError, match=told):
            read(logs, train=["a"], **table)
    (logs.parent / "empty").mkdir()
    with pytest.raises(StudyError, match="holds no trial file"):
        read(logs, root="empty", train=["a"])


@pytest.mark.parametrize("length", [None, 0.0, -7.0, True, "7"])
def test_a_scale_needs_a_length(length: Any) -> None:
    with pytest.raises(StudyError, match="a does not say of what length its ship is"):
        data._scaled(HERE, "data", log("a", **({} if length is None else {"L_pp": length})), L7)


def test_a_trial_of_another_scale_is_taken_as_one_of_the_ship() -> None:
    """Lengths by the ratio, times and speeds by its root."""
    found = data._scaled(HERE, "data", log("a", L_pp=L7.L_pp * 4.0, ship="big"), L7)
    assert found["x"][-1] == pytest.approx(19.0 / 4.0)
    assert found["u"][-1] == pytest.approx(19.0 / 2.0)
    assert found.t[-1] == pytest.approx(19.0 / 2.0)
    assert found.meta["ship"] == "kvlcc2_l7"
    assert "recorded as of big, L_pp 28 m" in str(found.meta["processing"])


def test_raw_readings_are_of_what_is_kept_back_where_a_set_is_smoothed(monkeypatch: pytest.MonkeyPatch) -> None:
    smoother = {"position": 1.0, "heading": 0.1}
    table = made({"set": [{"train": ["a"], "smoother": smoother}, {"train": ["b"]}]})
    asked: list[Any] = []

    def one(path: Path, where: str, some: Any, ship: Any) -> tuple[tuple[Trial, ...], ...]:
        asked.append((some.smoother, some.train))
        return (log("test"),), (log("validation"),), ()

    monkeypatch.setattr(data, "_one", one)
    found = data.read_raw(HERE, table, L7)
    assert asked == [(None, [])]
    assert [trial.name for _, trial in found] == ["validation", "test"]
    assert all(said.position == 1.0 for said, _ in found)


def test_a_fit_takes_what_it_leaves_out_from_the_one_it_is_like() -> None:
    """Estimators and freedom setting by setting, other tables whole."""
    found = series._completed(HERE, {
        "a": {"ship": "s", "estimator": {"type": "t", "epochs": 2}, "free": {"x": 1}, "loss": {"scale": "noise"}},
        "b": {"like": "a", "estimator": {"epochs": 3}, "free": {"y": 2}, "loss": {"correlation": 1.0}},
        "c": {"like": "b", "ship": "other"}, "d": {"ship": "s"},
    })  # fmt: skip
    assert found["b"]["estimator"] == {"type": "t", "epochs": 3}
    assert found["b"]["free"] == {"x": 1, "y": 2}
    assert found["b"]["loss"] == {"correlation": 1.0}
    assert (found["b"]["ship"], found["c"]["ship"]) == ("s", "other")
    assert found["c"]["estimator"] == {"type": "t", "epochs": 3}
    assert "estimator" not in found["d"]
    assert series._completed(HERE, {"a": 3}) == {"a": 3}
    with pytest.raises(StudyError, match=r"fits\.a\.like: no fit before it 'b'"):
        series._completed(HERE, {"a": {"like": "b"}, "b": {}})


def test_a_cell_is_named_by_its_seed() -> None:
    made = [made_cell(seed) for seed in (None, 0, 7)]
    assert [cell.name for cell in made] == ["key, one", "key, seed-0", "key, seed-7"]
    assert [cell.folder for cell in made] == [Path("fits/key/one"), Path("fits/key/seed-0"), Path("fits/key/seed-7")]


def test_a_study_is_a_table_of_one_cell_in_the_folder_of_the_run(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text("as written")
    problem = SimpleNamespace(trials=(1,), validation=(2,))
    one = study.Study("mine", tmp_path / "mine.toml", problem, "who", (3, 4), 5.0, "d", unidentified={"a": "b"})  # type: ignore[arg-type]
    (cell,) = one.cells
    assert (cell.name, tmp_path / cell.folder, cell.digest, cell.text) == ("mine", tmp_path, "d", "as written")
    assert (cell.file, cell.restart, cell.test, cell.unidentified) == (str(one.path), 5.0, (3, 4), {"a": "b"})
    assert cell.posed is cell
    assert one.judged_on == (2, 3, 4)
    assert one.kept_back


def test_one_of_several_fits_takes_all_that_is_kept_back_as_tests() -> None:
    problem = replace(LINE, validation=("b",))  # type: ignore[arg-type]
    cell = cells.Cell(None, problem, SimpleNamespace(several=True), test=("c",))  # type: ignore[arg-type]
    assert (cell.posed.problem.validation, cell.posed.test) == (("b", "c"), ())
    assert (cell.problem.validation, cell.test) == (("b",), ("c",))


def made_cell(seed: int | None, key: str = "key") -> cells.Cell:
    return cells.Cell(seed, None, None, "s", key)  # type: ignore[arg-type]


def many(*keys: str, only: tuple[str, ...] = ()) -> series.Series:
    rows = tuple(series.Row(key, key, L7, (), tuple(made_cell(seed, key) for seed in (1, 2))) for key in keys)
    return series.Series("table", HERE, "", "", rows, {"t": "test"}, {}, (), None, None, {}, (), (), (), only=only)  # type: ignore[arg-type]


def test_cells_are_asked_for_by_the_keys_of_their_models() -> None:
    table = many("a", "b", "c", only=("c", "a"))
    assert [cell.name for cell in table.cells] == ["a, seed-1", "a, seed-2", "c, seed-1", "c, seed-2"]
    assert len(many("a", "b", "c").cells) == 6
    assert table.apart == ("test",)


def test_cells_are_left_where_no_fit_is_in_their_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    table = many("a")
    monkeypatch.setattr(cells.Cell, "digest", property(lambda self: f"d{self.seed}"))
    done = tmp_path / "fits" / "a" / "seed-2"
    done.mkdir(parents=True)
    (done / "fit.json").write_text("{}")
    (done / "run.json").write_text('{"schema": "seatrial-run/1", "study": "s", "digest": "d2"}')
    assert [cell.seed for cell in table.cells if not cell.done(tmp_path)] == [1]
    (done / "run.json").write_text('{"schema": "seatrial-run/1", "study": "s", "digest": "other"}')
    with pytest.raises(StudyError, match="or remove this one, and it is fitted anew"):
        table.cells[1].done(tmp_path)


def test_a_fit_in_a_folder_that_no_run_has_claimed_is_made_anew(tmp_path: Path) -> None:
    """Nothing says of which problem it is; a study is done when its report is written too."""
    one = cells.Cell(None, None, None, "s", run="d")  # type: ignore[arg-type]
    for name in ("fit.json", "report.html"):
        (tmp_path / name).write_text("{}")
        assert not one.done(tmp_path)
    (tmp_path / "report.json").write_text("{}")
    assert not (tmp_path / "run.json").exists()
    assert not one.done(tmp_path)
    assert one.done(tmp_path)  # it is claimed now


def test_folders_above_a_refused_cell_go_with_it_unless_they_were_there(tmp_path: Path) -> None:
    where, out = tmp_path / "run" / "fits" / "a" / "one", tmp_path / "run"

    def refused(made: Path) -> None:
        with cells.swept(where, out):
            made.mkdir(parents=True)
            raise StudyError("no")

    with pytest.raises(StudyError):
        refused(where.parent)
    assert not out.exists()
    out.mkdir()
    with pytest.raises(StudyError):
        refused(where.parent)
    assert out.exists()
    assert not (out / "fits").exists()
    with pytest.raises(StudyError):
        refused(where)
    assert where.exists()  # something is in it


def test_a_rival_has_some_of_the_free_parameters() -> None:
    from seatrial.core.parameters import Free

    free = tuple(Free(path, 1.0) for path in ("a", "b", "c"))
    assert [one.path for one in study._rival(HERE, ("c", "a"), free)] == ["a", "c"]
    assert study._rival(HERE, (), free) == ()
    with pytest.raises(StudyError, match=r"rival\.free: no free parameter 'd'"):
        study._rival(HERE, ("d",), free)


def test_a_weight_is_for_a_trial_of_training() -> None:
    said: Any = SimpleNamespace(sigma={"u": 0.1}, correlation=2.0, weights={"a*": 0.5}, scale="spread")
    made = study._loss(HERE, said, [log("ab"), log("c")])
    assert (made.sigma, made.correlation, made.weights, made.scale) == ({"u": 0.1}, 2.0, {"a*": 0.5}, "spread")
    with pytest.raises(StudyError, match=r"loss\.weights: 'a\*' fits no training trial; they are named b, c"):
        study._loss(HERE, said, [log("b"), log("c")])


def test_what_a_publication_prints_is_in_the_table_or_a_file_beside_it(tmp_path: Path) -> None:
    from seatrial.study.schema import Published

    table = tmp_path / "t.toml"
    assert series._published(table, None) == Published(source="")
    own = Published(source="a paper")
    assert series._published(table, own) is own
    for text, told in (('schema = "seatrial-published/1"\nsource = "b"\nnote = "n"\n', ""),
                       ('source = "b"\n', r"p\.toml"),
                       ('schema = "seatrial-study/1"\n', "seatrial-published/1"), ("a = [", r"p\.toml: "),
                       ('schema = "seatrial-published/1"\n', "source is missing")):  # fmt: skip
        (tmp_path / "p.toml").write_text(text)
        if not told:
            assert series._published(table, "p.toml") == Published(source="b", note="n")
            continue
        with pytest.raises(StudyError, match=told):
            series._published(table, "p.toml")
    with pytest.raises(StudyError, match="published: no such file"):
        series._published(table, "gone.toml")


def test_one_problem_is_judged_once_however_many_seeds_it_has(monkeypatch: pytest.MonkeyPatch) -> None:
    judged: list[str] = []

    def lint(problem: Any, tests: Any, estimator: Any) -> list[Issue]:
        judged.append(problem.ship.name)
        return [Issue("warning", problem.ship.name, "odd")]

    monkeypatch.setattr(cells, "lint", lint)
    monkeypatch.setattr(cells, "raise_on_errors", lambda issues: None)

    def cell(name: str) -> Any:
        problem = SimpleNamespace(ship=SimpleNamespace(name=name), free=(), trials=(), validation=())
        return SimpleNamespace(problem=problem, estimator=None)

    assert cells.check([cell("a"), cell("a"), cell("b"), cell("a")], ()) == (
        Issue("warning", "a", "odd"), Issue("warning", "b", "odd"),
    )  # fmt: skip
    assert judged == ["a", "b"]
