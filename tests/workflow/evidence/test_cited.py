"""What a result owes to whom: nothing that its files and equations name is left out."""

from __future__ import annotations

import json
import re
from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest

from fitted_run import PATHS, saved, trial
from seatrial.cli.app import main
from seatrial.core.version import __version__
from seatrial.ships.files import FOLDER, library
from seatrial.workflow.evidence.cited import Owed, cite, named, references

STUDY = 'schema = "seatrial-study/1"\nship = "kvlcc2_l7"\n'


def owed(run: str | Path, what: str) -> dict[str, Owed]:
    return {one.key or one.reference: one for one in cite(str(run)).result.owed if one.what == what}


def run(folder: Path, text: str, file: Path | str = "", **meta: str) -> Path:
    """A run that has freed three numbers of KVLCC2."""
    one = trial(20.0, duration=20.0)
    saved(folder, [replace(one, meta={**one.meta, **meta})], text=text, file=str(file))
    return folder


@pytest.mark.parametrize("name", ["kvlcc2_l7", "suzaku", "mariner", "esso_osaka_3m"])
def test_every_key_of_a_ship_file_is_credited_with_as_many_numbers(name: str) -> None:
    text = (FOLDER / f"{name}.toml").read_text(encoding="utf-8").partition("[[notes")[0]
    counted = Counter(key for source in re.findall(r'source = "([^"]*)"', text)
                      for key in dict.fromkeys(re.findall(r"\b[a-z]+(?:19|20)\d\d\b", source)))  # fmt: skip
    found = owed(name, "numbers")
    credited = {key: sum(map(int, re.findall(r" (\d+)", one.why))) for key, one in found.items()}
    assert {key: credited[key] for key in counted} == dict(counted)
    assert all(one.reference for one in found.values())


def test_a_text_names_papers_by_key_or_by_author_and_year() -> None:
    assert list(named("The search of Suyama 2023, after Auger and\n Hansen (2005); as in hansen2007.")) == [
        "suyama2023", "auger2005", "hansen2007"]  # fmt: skip
    assert list(named("Fujiwara, Ueno and Nimura 1998; Sawada et al. 2024 (Eq. 3), assumed2024")) == [
        "fujiwara1998", "sawada2024"]  # fmt: skip
    assert named("of 1998, in May 2000 or so") == {"may2000": "May 2000"}
    assert named("") == {}


@pytest.mark.slow
def test_equations_and_the_estimator_are_credited_by_their_docstrings(tmp_path: Path) -> None:
    found = owed("kvlcc2_l7", "equations")
    assert "hull:Polynomial" in found["yasukawa2015"].why
    where = run(tmp_path / "usual", STUDY)
    assert owed(where, "estimator")["wakita2022"].why == "shooting:Trajectory"
    where = run(tmp_path / "searched", f'{STUDY}[estimator]\ntype = "evolution:Evolution"\n')
    assert {"suyama2023", "auger2005"} <= set(owed(where, "estimator"))
    where = run(tmp_path / "own", f'{STUDY}[estimator]\ntype = "own.module:Mine"\n')
    assert owed(where, "estimator")["not of this package; see its own documentation"].why == "own.module:Mine"
    table = '[fits.a]\n[fits.b.estimator]\ntype = "logo:Shooting"\n'
    found = owed(run(tmp_path / "table", f'schema = "seatrial-series/1"\n{table}'), "estimator")
    assert {name for one in found.values() for name in one.why.split(", ")} == {"shooting:Trajectory", "logo:Shooting"}


def test_a_fitted_number_stands_on_what_it_began_from(tmp_path: Path) -> None:
    before = owed("kvlcc2_l7", "numbers")["yasukawa2015"].why
    assert owed(run(tmp_path, STUDY), "numbers")["yasukawa2015"].why == before
    model = tmp_path / "model.toml"
    (tmp_path / "alone").mkdir()
    (tmp_path / "alone" / "model.toml").write_text(model.read_text(encoding="utf-8"), encoding="utf-8")
    found = cite(str(tmp_path / "alone")).result
    assert found.others["fitted in study"] == 3
    assert "3 numbers were fitted" in found.cautions[0]


def test_the_ship_that_a_fit_began_from_may_be_a_file_beside_the_study(tmp_path: Path) -> None:
    mine = (FOLDER / "kvlcc2_l7.toml").read_text(encoding="utf-8").replace("yasukawa2015", "alfheim2017")
    (tmp_path / "mine.toml").write_text(mine, encoding="utf-8")
    study = tmp_path / "study.toml"
    where = run(tmp_path / "run", 'schema = "seatrial-study/1"\nship = "mine.toml"\n', file=study)
    hull = sum(int(n) for n in re.findall(r"hull (\d+)", owed(where, "numbers")["alfheim2017"].why))
    assert hull == sum(path.startswith("hull.") for path in PATHS)
    (tmp_path / "mine.toml").unlink()
    assert "not at hand" in cite(str(where)).result.cautions[0]


def test_what_a_formula_was_compared_with_is_not_its_source(tmp_path: Path) -> None:
    text = (FOLDER / "kvlcc2_l7.toml").read_text(encoding="utf-8")
    compared = text.replace('Y_v = { prime = -0.315, source = "yasukawa2015', 'Y_v = { prime = -0.315, source = "'
                            'estimated: yoshimura2012 Eq. 11; others: Inoue 1981 -0.3')  # fmt: skip
    (tmp_path / "mine.toml").write_text(compared, encoding="utf-8")
    found = owed(tmp_path / "mine.toml", "numbers")
    assert found["yoshimura2012"].why == "hull 1"
    assert "inoue1981" not in found


def test_trials_are_credited_by_their_sidecars(tmp_path: Path) -> None:
    found = owed(run(tmp_path / "a", STUDY, source="a ferry, 2021"), "data")
    assert found["a ferry, 2021"].why == "1 trial"
    assert "name who sailed them" in next(iter(owed(run(tmp_path / "b", STUDY, source=""), "data")))


def test_the_command_prints_one_object_and_refuses_what_is_no_run(tmp_path: Path, capsys) -> None:
    assert main(["cite", "suzaku", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["ship"] == "suzaku"
    programs = [one["reference"] for one in said["owed"] if one["what"] == "program"]
    assert any(__version__ in one for one in programs)
    assert any("CasADi" in one for one in programs)
    assert main(["cite", str(tmp_path)]) == 2
    assert "model.toml: no such ship file" in capsys.readouterr().err


@pytest.mark.slow
def test_every_ship_of_the_library_can_be_cited() -> None:
    for name in library():
        result = cite(name).result
        assert result.owed
        assert all(one.key in references() for one in result.owed if one.what == "numbers")
