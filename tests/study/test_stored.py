"""Fits read back from a folder that people may have edited."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatrial.belief.reading import posterior
from seatrial.core.parameters import Free
from seatrial.data import Trial
from seatrial.identify import Fit, Loss, Problem, StudyError, Verdict
from seatrial.identify.diagnosis.blame.contradiction import Contradiction
from seatrial.identify.diagnosis.channels import Channel, Residuals
from seatrial.identify.diagnosis.findings import Diagnosis, Suspicion
from seatrial.ships.files import load
from seatrial.study.store import read_summary, save_fit, write_summary
from seatrial.study.stored import load_fit

FREE = (Free("hull.Y_v", -0.3), Free("hull.N_v", -0.1, -0.2, -0.05, -0.1, 0.02))
SUSPECT = Suspicion("offset.delta", "an offset", "deg", 0.0174, 30.0, 0.2, 0.01, 0.002, {"hull.Y_v": 1.5})
DIAGNOSIS = Diagnosis(
    {"u": Channel(0.01, 1.1, float("nan"), 0.1, float("inf"), 7)}, (SUSPECT,), {"a": {"u": 2}}, (),
    {"a": Residuals(np.arange(3.0), {"u": np.array([0.1, np.nan, 1.0 / 3.0])}, np.ones(3))}, ("delta", "rad"),
    {"hull.Y_v": 1.2}, (("hull.R_0", "hull.Y_v", 3.0),), {"hull.R_0": 0.1},
    contradictions=(Contradiction("a", 9.0, 2, 1.5, 0.2, 0.1, {"hull.Y_v": 0.3}),),
)  # fmt: skip


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    ship = load("kvlcc2_l7")
    fit = Fit(
        ship.having({"hull.Y_v": -0.31}), FREE, np.array([-0.31, -0.11]), np.array([0.01, np.inf]), np.eye(2) / 3.0,
        np.ones(2), ("hull.N_v",), (Verdict("hull.Y_v", "identified", "fine"),), np.array([[0, 2.0, np.nan, 0.1]]),
        2.0, 0.1, 1, "done", "d", np.array([[2.0, -0.31, -0.11]]), {"a": {"current_x": 0.1}}, DIAGNOSIS,
        Loss({"u": 0.1}, None, {"a*": 0.5}),
    )  # fmt: skip
    save_fit(fit, tmp_path, Problem(ship, (Trial("a", np.arange(2.0), {}),), FREE), study="s")
    return tmp_path


def test_every_field_comes_back(folder: Path) -> None:
    again = load_fit(folder)
    assert repr(again.free) == repr(FREE)
    assert again.values.tolist() == [-0.31, -0.11]
    assert np.array_equal(again.covariance, np.eye(2) / 3.0)
    assert (again.at_bound, again.verdicts) == (("hull.N_v",), (Verdict("hull.Y_v", "identified", "fine"),))
    assert again.ends.tolist() == [[2.0, -0.31, -0.11]]
    assert again.nuisances == {"a": {"current_x": 0.1}}
    assert again.loss == Loss({"u": 0.1}, None, {"a*": 0.5})
    found = again.diagnosis
    assert found is not None
    assert found.suspicions == (SUSPECT,)
    assert (found.contradictions, found.fixed, found.shares) == (
        DIAGNOSIS.contradictions, DIAGNOSIS.fixed, DIAGNOSIS.shares,
    )  # fmt: skip
    assert repr(found.channels) == repr(DIAGNOSIS.channels)  # NaN and infinity too
    assert np.array_equal(found.residuals["a"].values["u"], DIAGNOSIS.residuals["a"].values["u"], equal_nan=True)


def _without(key: str) -> Callable[[dict[str, Any]], object]:
    return lambda document: document.pop(key)


def _with(value: object, *keys: str) -> Callable[[dict[str, Any]], object]:
    def change(document: dict[str, Any]) -> None:
        for key in keys[:-1]:
            document = document[key]
        document[keys[-1]] = value

    return change


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (_without("covariance"), "fit.json: covariance is missing"),
        (_with([[1.0]], "covariance"), "covariance must be 2 rows of 2 numbers"),
        (_with("wide", "parameters", "hull.Y_v", "sigma"), "parameters.hull.Y_v.sigma is 'wide'; it must be a number"),
        (_with(True, "objective"), "objective is True"),
        (_with(None, "parameters", "hull.Y_v", "value"), "hull.Y_v.value is nan; it must be a finite number"),
        (_with(-0.01, "parameters", "hull.Y_v", "sigma"), "hull.Y_v.sigma is -0.01; it must be above zero"),
        (_with(0.0, "parameters", "hull.Y_v", "sigma"), "hull.Y_v.sigma is 0; it must be above zero"),
        (_with([[1.0, 0.1], [0.2, 1.0]], "covariance"), "covariance must be symmetric"),
        (_with([[-1.0, 0.0], [0.0, 1.0]], "covariance"), "covariance has a negative variance"),
        (_with([[1.0, 2.0], [2.0, 1.0]], "covariance"), "covariance has a negative variance"),
        (_with([1], "parameters"), r"parameters is \[1\]; it must be a table"),
        (_with(-1.0, "parameters", "hull.N_v", "start"), "hull.N_v: the bounds .* exclude the start"),
        (_with([{"subject": "a"}], "verdicts"), "verdicts.0.status is missing"),
        (_with({"a": {"current_x": "x"}}, "nuisances"), "nuisances.a.current_x is 'x'; it must be a number"),
        (_with("other", "digest"), "fit.npz: of fit d, fit.json is of other"),
    ],
)
def test_what_cannot_be_is_named_by_file_and_key(change: Callable[[Any], object], told: str, folder: Path) -> None:
    path = folder / "fit.json"
    document = json.loads(path.read_text())
    change(document)
    write_summary(folder, document)
    with pytest.raises(StudyError, match=told):
        load_fit(folder)


def test_a_number_that_is_changed_after_the_fit_is_noticed_wherever_the_fit_is_read(folder: Path) -> None:
    """Halving a variance is as possible as what the fit found; only a digest tells them apart."""
    path = folder / "fit.json"
    text = path.read_text()
    document = json.loads(text)
    document["covariance"][0][0] /= 2.0
    path.write_text(json.dumps(document))
    readers: tuple[Callable[[], object], ...] = (
        lambda: load_fit(folder), lambda: read_summary(folder), lambda: posterior(folder / "model.toml"))
    for read in readers:
        with pytest.raises(StudyError, match=r"fit\.json: was changed after the fit"):
            read()
    path.write_text(json.dumps(json.loads(text), indent=8, sort_keys=True))  # the same content
    assert load_fit(folder).covariance[0, 0] == 1.0 / 3.0


def test_a_ship_that_is_changed_after_its_fit_is_noticed(folder: Path) -> None:
    """Also where the number is not one that the fit found; comments and layout are free."""
    model = folder / "model.toml"
    text = model.read_text()
    model.write_text("# a comment\n" + text)
    load_fit(folder)
    changed = re.sub(r"(?m)^B = .*$", "B = 1.3", text)
    assert changed != text
    model.write_text(changed)
    with pytest.raises(StudyError, match=r"model\.toml: was changed after the fit"):
        load_fit(folder)


def test_a_fit_of_before_there_were_digests_is_read(folder: Path) -> None:
    document = json.loads((folder / "fit.json").read_text())
    del document["seal"]
    (folder / "fit.json").write_text(json.dumps(document))
    assert load_fit(folder).values.tolist() == [-0.31, -0.11]


def test_a_damaged_or_foreign_array_file_is_named(folder: Path) -> None:
    (folder / "fit.npz").write_bytes(b"PK\x03\x04 nothing")
    with pytest.raises(StudyError, match=r"fit\.npz: cannot be read"):
        load_fit(folder)
    said = {"schema": "seatrial-arrays/1", "digest": "d", "loss": {"sigma": {"u": "x"}}, "diagnosis": None}
    np.savez(folder / "fit.npz", said=np.array(json.dumps(said)), numbers=np.zeros(0), ends=np.zeros((0, 0)))
    with pytest.raises(StudyError, match=r"loss\.sigma\.u is 'x'; it must be a number; delete it"):
        load_fit(folder)


def test_an_empty_folder_and_a_table_of_fits_are_told_apart(tmp_path: Path) -> None:
    with pytest.raises(StudyError, match="none is there"):
        load_fit(tmp_path)
    (tmp_path / "fits").mkdir()
    with pytest.raises(StudyError, match="one a folder below fits/"):
        load_fit(tmp_path)


@pytest.mark.slow
def test_a_fit_without_residuals_removes_those_of_one_before(folder: Path) -> None:
    ship = load("kvlcc2_l7")
    bare = Fit(ship, (), np.zeros(0), np.zeros(0), np.zeros((0, 0)), np.zeros(0), (), (), np.zeros((0, 4)), 1.0, 0.1, 1,
               "done", "e")  # fmt: skip
    save_fit(bare, folder, Problem(ship, (), ()), study="s")
    assert not (folder / "fit.npz").exists()
    assert load_fit(folder).diagnosis is None
