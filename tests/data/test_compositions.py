"""Named sets of recordings: what a file of them may say, and the compositions of Wakita 2022 against its Table 6."""

from __future__ import annotations

from pathlib import Path

import pytest

from seatrial.data import DataError
from seatrial.data.check import check_set
from seatrial.data.formats.frt_esso import read
from seatrial.data.prepare import drop_trailing_gaps
from seatrial.data.trialfile import write_trial
from seatrial.identify import StudyError
from seatrial.identify.lint import lint
from seatrial.study.data import expanded, read_compositions
from seatrial.study.study import read_study

SETS = Path(__file__).parents[2] / "studies" / "esso_osaka_sets.toml"
WHOLE, PART = "turning/turn_14-Sep-2020_15_58_08", "turning/turn_cut_14-Sep-2020_15_58_08"

# Wakita 2022 Table 6 [s]
TABLE_6 = {
    "TZB": {"T": 1490.0, "Z": 737.1, "B": 335.8},
    "TZRB": {"T": 556.4, "Z": 342.9, "R": 1301.2, "B": 335.8},
    "TZRB+": {"T": 5674.7, "Z": 1151.0, "R": 5861.2, "B": 788.9},
}
TEST = {"T": 1, "Z": 1, "R": 1, "B": 3}


def write(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.long
def test_durations_are_those_of_the_papers_table(data_file):
    sets, cache = read_compositions(SETS), {}
    root = data_file("esso_osaka_frt", "data")
    for name, kinds in TABLE_6.items():
        assert set(sets[name].parts) == set(kinds), name
        for kind, wanted in kinds.items():
            total = 0.0
            for one in sets[name].parts[kind]:
                if one not in cache:
                    cache[one] = drop_trailing_gaps(read(root / f"{one}.csv")).duration
                total += cache[one]
            # printed to a tenth; the random files add up to one sample of 0.1 s less than printed
            assert total == pytest.approx(wanted, abs=0.1001), (name, kind)


def test_the_papers_test_files_are_in_no_training_set():
    sets = read_compositions(SETS)
    assert {kind: len(names) for kind, names in sets["test"].parts.items()} == TEST
    for name in TABLE_6:
        assert not set(sets[name].files) & set(sets["test"].files)


@pytest.mark.slow
def test_no_training_set_overlaps_another_unseen_but_for_the_known_copy(data_file):
    """TZB holds the whole turn, TZRB a cut of it under another name: the rows tell."""
    sets, root = read_compositions(SETS), data_file("esso_osaka_frt", "data")
    train = [read(root / f"{name}.csv") for name in sets["TZRB"].parts["T"]]
    others = [name for name in sets["TZB"].parts["T"] if name not in sets["TZRB"].files]
    found = check_set(train, [read(root / f"{name}.csv") for name in others])
    assert [f.where for f in found] == [f"{Path(PART).name} and {Path(WHOLE).name}"]


def test_references_stand_for_their_recordings_in_order():
    sets = read_compositions(SETS)
    assert expanded("x", ["@TZRB.B", "random/*"], sets) == [*sets["TZRB"].parts["B"], "random/*"]
    assert expanded("x", ["@TZRB+"], sets) == list(sets["TZRB+"].files)
    assert expanded("x", ["@TZRB", "@TZRB.T"], sets) == list(sets["TZRB"].files)


@pytest.mark.parametrize(
    ("entry", "words"),
    [("@TZRX", "unknown set 'TZRX'"), ("@TZRB.Q", "unknown kind 'Q'"), ("@TZB.R", "unknown kind 'R'")],
)
def test_an_unknown_reference_is_refused_with_the_known_ones(entry, words):
    with pytest.raises(DataError, match=r"TZRB|T, Z") as caught:
        expanded("study.toml: data.train", [entry], read_compositions(SETS))
    assert words.split("'")[1] in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('schema = "x"', "this version reads 'seatrial-sets/1'"),
        ("[", "cannot be read as TOML"),
        ('schema = "seatrial-sets/1"', "sets is missing"),
        ('schema = "seatrial-sets/1"\n[sets]', "sets is {}; it must be a table of 1 or more"),
        ('schema = "seatrial-sets/1"\n[sets.A]', r"sets\.A is {}; it must be a table of 1 or more"),
        ('schema = "seatrial-sets/1"\nset = 1\n[sets.A]\nT = ["a"]', "set: no key 'set'; near: sets"),
        ('schema = "seatrial-sets/1"\n[sets]\nA = 1', "must be a table"),
        ('schema = "seatrial-sets/1"\n[sets.A]\nT = "a"', r"sets\.A\.T is 'a'; it must be a list"),
        ('schema = "seatrial-sets/1"\n[sets.A]\nT = ["a", 1]', r"sets\.A\.T\.1 is 1; it must be a text"),
        ('schema = "seatrial-sets/1"\n[sets.A]\nT = ["a"]\nZ = ["a"]', "is in T already"),
    ],
)
def test_a_wrong_file_of_sets_is_refused_in_one_line(tmp_path, text, words):
    with pytest.raises(DataError, match=words) as caught:
        read_compositions(write(tmp_path / "sets.toml", text))
    assert "\n" not in str(caught.value)


def test_no_file_of_sets(tmp_path):
    with pytest.raises(DataError, match=r"sets\.toml: cannot be read"):
        read_compositions(tmp_path / "sets.toml")


STUDY = """
schema = "seatrial-study/1"
ship = "esso_osaka_3m"
[data]
{sets}
train = {train}
validation = {validation}
[free]
"hull.C_D" = {{ prior = 0.3 }}
[estimator]
type = "shooting:Trajectory"
window = 50.0
"""


@pytest.fixture
def folder(tmp_path, made):
    from dataclasses import replace

    trial = replace(made, meta={**made.meta, "ship": "esso_osaka_3m"})
    for name, part in {"a": slice(0, 1200), "b": slice(1200, 2000), "copy": slice(1300, 1900)}.items():
        write_trial(replace(trial.rows(part), name=name), tmp_path / f"{name}.csv")
    write(tmp_path / "sets.toml", 'schema = "seatrial-sets/1"\n[sets.X]\nZ = ["a", "b"]\n[sets.Y]\nZ = ["copy"]\n')
    return tmp_path


def study(folder: Path, train: str, validation: str = "[]", sets: str = 'sets = "sets.toml"'):
    return read_study(write(folder / "study.toml", STUDY.format(train=train, validation=validation, sets=sets)))


def test_a_study_takes_its_trials_from_a_set_less_what_it_keeps_back(folder):
    found = study(folder, '["@X"]', '["b"]')
    assert [t.name for t in found.problem.trials] == ["a"]
    assert [t.name for t in found.problem.validation] == ["b"]


@pytest.mark.slow
def test_lint_names_both_files_of_an_overlap_under_two_names(folder):
    found = study(folder, '["@X"]', '["@Y"]')
    errors = [i for i in lint(found.problem) if i.severity == "error" and "share a recording" in i.text]
    assert [i.where for i in errors] == ["b and copy"]
    assert "training and validation" in errors[0].text


def test_a_reference_without_a_file_of_sets_is_refused(folder):
    with pytest.raises((DataError, StudyError), match="needs a file of sets"):
        study(folder, '["@X"]', sets="")
