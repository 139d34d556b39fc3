"""Breaches by levels: their probability against closed forms, what the ship's error adds, and how a case keeps them."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, get_args

import numpy as np
import pytest
from scipy.special import ndtri

from seatrial.belief.posterior import Posterior
from seatrial.cli.app import main
from seatrial.core.errors import RequestError
from seatrial.core.parameters import Free, read
from seatrial.core.records import from_json
from seatrial.encounters import Tracks
from seatrial.encounters.rules import judge
from seatrial.ships.files import load
from seatrial.workflow import SILENT
from seatrial.workflow.safety import case as module
from seatrial.workflow.safety.case import Setup
from seatrial.workflow.safety.claimed import SCHEMA, CaseFile
from seatrial.workflow.safety.rare import SHIPS, Breach, Rarely, Reached, Seldom, margins, ordered, rarely, told

A = 0.02


def corner(cube: np.ndarray, ship: np.ndarray) -> np.ndarray:
    """Below zero where both numbers are below A: A^2; with a ship s of 0 to 1, below A (1 + s): 7/3 A^2 over all."""
    return cube[:, :2].max(axis=1) - A * (1.0 + np.nan_to_num(ship))


@pytest.mark.slow
def test_probabilities_are_those_of_a_closed_form_and_intervals_hold_them() -> None:
    found = [rarely(corner, Seldom(runs=1000), 2, case="c", seed=seed, posterior=True) for seed in range(0, 60, 2)]
    for values, true in (([one.fitted for one in found], A**2), ([one.drawn for one in found], 7.0 / 3.0 * A**2)):
        some = [one for one in values if one is not None]
        assert len(some) == 30
        assert all(one.reached and one.low <= one.probability <= one.high for one in some)
        spread = np.std([one.probability for one in some]) / math.sqrt(30.0)
        assert np.mean([one.probability for one in some]) == pytest.approx(true, abs=4.0 * spread)
        assert spread < 0.1 * true
        assert sum(one.low <= true <= one.high for one in some) >= 24  # of 28.5 expected: four standard errors
        assert {one.runs for one in some} <= {1000 + 900 * k for k in range(2, 5)}


def test_a_search_that_is_cut_off_goes_on_with_the_runs_it_has(tmp_path: Path) -> None:
    """Both searches ask at once; what was answered is not asked again, but where its file was cut."""
    calls, left = list[int](), [7]

    def limit(cube: np.ndarray, ship: np.ndarray) -> np.ndarray:
        if not left[0]:
            raise KeyboardInterrupt
        left[0] -= 1
        calls.append(len(cube))
        assert cube.shape == (len(ship), 2)
        assert np.isnan(ship).sum() in (0, len(ship) // 2, len(ship))
        if np.isnan(ship).sum() == len(ship) // 2:  # two searches, not one told twice
            assert not np.isin(cube[np.isnan(ship)], cube[~np.isnan(ship)]).any()
        return corner(cube, ship)

    notes = list[str]()
    sink: Any = SimpleNamespace(note=notes.append)
    asked = Seldom(runs=100)
    with pytest.raises(KeyboardInterrupt):
        rarely(limit, asked, 2, case="c", seed=4, posterior=True, kept=tmp_path / "levels")
    assert calls == [200, *[20] * 6]
    kept = sorted((tmp_path / "levels").iterdir())
    assert len(kept) == 7
    kept[0].write_bytes(kept[0].read_bytes()[:-8])
    calls.clear()
    left[0] = -1
    found = rarely(limit, asked, 2, case="c", seed=4, posterior=True, kept=tmp_path / "levels", sink=sink)
    whole = rarely(corner, asked, 2, case="c", seed=4, posterior=True)
    assert found == whole
    assert whole.fitted == rarely(corner, asked, 2, case="c", seed=4, posterior=False).fitted  # beside another or alone
    assert whole.drawn is not None
    levels = [1 + (one.runs - 100) // 90 for one in (whole.fitted, whole.drawn)]
    assert len(calls) == 1 + 9 * (max(levels) - 1) - 6
    assert len(notes) == sum(levels) - 2
    assert notes[0] == "ship as fitted: level 1 of 12 at most is done, contact is less probable than 0.10"
    other = rarely(limit, asked, 2, case="d", seed=4, posterior=True, kept=tmp_path / "levels")
    assert replace(other, case="c") == whole
    assert len(calls) == 2 * (1 + 9 * (max(levels) - 1)) - 6  # of another case nothing is taken


FAR = 4.264890793922825  # of a standard normal number 1e-5 lie beyond


@pytest.mark.slow
@pytest.mark.parametrize("part", [0.3, 0.6])
def test_intervals_hold_one_in_a_hundred_thousand_with_ships_of_a_posterior(part: float) -> None:
    """The breach is a sum of the sea's and the ship's normal numbers beyond 4.265; of 20 000 runs at most."""
    sigma = np.array([2e-4, 2e-2, 1e-1])  # two of three parameters go together, of which one is felt and the third
    covariance = np.array([[1.0, 0.75, 0.0], [0.75, 1.0, 0.0], [0.0, 0.0, 1.0]]) * np.outer(sigma, sigma)
    ship = load("kvlcc2_l7")
    free = tuple(Free(one, float(read(ship.model, one))) for one in ("hull.R_0", "hull.X_vv", "hull.Y_v"))
    mean = np.array([one.start for one in free])
    held = Posterior(ship, free, mean, covariance, fitted=False)
    found = list[Rarely]()
    for seed in range(100):
        along = (ordered(held.draws(SHIPS, seed)) - mean) @ (np.array([1.0, 0.0, 1.0]) / sigma) * math.sqrt(0.5)

        def beyond(cube: np.ndarray, ship: np.ndarray, along: np.ndarray = along) -> np.ndarray:
            of_ship = np.where(np.isnan(ship), 0.0, along[(np.nan_to_num(ship) * SHIPS).astype(int)])
            return FAR - math.sqrt(1.0 - part**2) * ndtri(cube[:, 0]) - part * of_ship

        found.append(rarely(beyond, Seldom(runs=3600), 1, case="c", seed=2 * seed, posterior=True))
    fitted = 0.5 * math.erfc(FAR / math.sqrt(1.0 - part**2) / math.sqrt(2.0))
    drawn = [one.drawn for one in found if one.drawn is not None]
    assert len(drawn) == 100
    assert max(one.runs for one in drawn) <= 20_000
    assert sum(one.low <= 1e-5 <= one.high for one in drawn) >= 90
    assert sum(one.fitted.low <= fitted <= one.fitted.high for one in found) >= 90


@pytest.mark.slow
def test_a_model_that_fails_is_no_breach() -> None:
    def half(cube: np.ndarray, ship: np.ndarray) -> np.ndarray:
        return np.where(cube[:, 2] < 0.5, np.nan, corner(cube, ship))

    some = [rarely(half, Seldom(runs=1000), 3, case="c", seed=seed, posterior=False) for seed in range(20)]
    assert np.mean([one.fitted.probability for one in some]) == pytest.approx(0.5 * A**2, rel=0.25)
    assert all(one.drawn is None for one in some)


def test_what_levels_do_not_take_is_a_line() -> None:
    with pytest.raises(RequestError, match="multiple of 10, such as 1000"):
        rarely(corner, Seldom(runs=1005), 2, case="c", seed=1, posterior=False)
    with pytest.raises(RequestError, match="nine tenths of level 2 are equally far"):
        rarely(lambda cube, _: np.ones(len(cube)), Seldom(runs=100), 2, case="c", seed=1, posterior=False)
    never = rarely(lambda cube, _: cube[:, 0] + 1e-3, Seldom(runs=100), 1, case="c", seed=1, posterior=False).fitted
    assert not never.reached
    assert (never.low, never.high) == (0.0, 1.0)
    assert never.probability <= 1e-10


def test_ships_lie_in_the_order_of_their_widest_direction() -> None:
    rng = np.random.default_rng(2)
    along = rng.standard_normal(500)
    draws = np.column_stack([5.0 + 1e-3 * along, 1e3 * (along + 0.3 * rng.standard_normal(500)), np.full(500, 7.0)])
    found = ordered(draws)
    assert sorted(map(tuple, found)) == sorted(map(tuple, draws))
    assert np.corrcoef(np.arange(500), found[:, 0])[0, 1] > 0.9  # a normal distribution's ranks: .977
    assert np.array_equal(ordered(draws[::-1]), found)


def test_margins_are_those_of_the_worst_ship() -> None:
    def one(gap: list[float], margin: list[float]) -> Any:
        return SimpleNamespace(gap=np.array(gap), margins={"16": np.array(margin)})

    own = [one([100.0, -3.0, 50.0], [0.5, np.nan, np.nan]), one([40.0, 90.0, 60.0], [0.7, -0.2, np.nan])]
    assert margins(own, "contact") == pytest.approx([40.0, -3.0, 50.0])
    assert margins(own, "16") == pytest.approx([0.5, -0.2, 10.0])  # where it does not apply nothing is near


def test_every_breach_that_can_be_asked_for_is_one_of_the_judge() -> None:
    t = np.array([0.0, 10.0, 20.0])
    x = np.array([[0.0, 80.0, 160.0], [5000.0, 4920.0, 4840.0]])
    zero = np.zeros((2, 3))
    tracks = Tracks(t, x, zero, np.array([[0.0] * 3, [math.pi] * 3]), zero + 8.0, zero, np.full(2, 100.0),
                    np.full(2, 16.0))  # fmt: skip
    own = judge(tracks, own=True)
    assert set(get_args(Breach)) == {"contact", *own[0].margins} - {"19(d)", "19(e)"}  # in sight of one another
    assert np.isfinite([margins(own, breach) for breach in get_args(Breach)]).all()


@pytest.mark.parametrize(("drawn", "said"), [
    (Reached(5e-4, 4e-4, 6e-4, 1900, True), "adds 3.0e−04 (the intervals lie apart)"),
    (Reached(2.5e-4, 1e-4, 6e-4, 1900, True), "less than the intervals tell apart"),
    (Reached(1e-11, 0.0, 1.0, 1900, False), "was not reached"),
    (None, "known exactly"),
])  # fmt: skip
def test_a_page_says_what_the_error_of_the_ship_adds(drawn: Reached | None, said: str) -> None:
    body = told(Rarely("c", Reached(2e-4, 1e-4, 3e-4, 1000, True), drawn), Seldom(breach="16"))
    text = repr(body)
    assert said in text
    assert "probability of Rule 16" in text


def asked(folder: Path, **more: Any) -> Path:
    (folder / "case.toml").write_text(
        'schema = "seatrial-case/1"\nclaim = "it keeps clear"\nship = "kvlcc2_l7"\n'
        'traffic = ["ignores"]\n' + more.get("stack", 'stack = "ignores"\n') + "[encounters]\n"
        + more.get("encounters", 'roles = ["give-way"]\nruns = 2\n')
        + more.get("rare", "[rare]\nruns = 100\n"), encoding="utf-8")  # fmt: skip
    return folder / "case.toml"


@pytest.mark.slow
def test_a_case_keeps_what_levels_found_and_signs_it(tmp_path: Path, capsys: Any) -> None:
    """Nobody acts, so every run is a contact: one level, of which all are in the event."""
    path, out = asked(tmp_path), tmp_path / "out"
    assert main(["case", str(path), "-o", str(out)]) == 0
    said = json.loads((out / "case.json").read_text(encoding="utf-8"))
    assert said["rare"]["fitted"] == {"probability": 1.0, "low": 1.0, "high": 1.0, "runs": 100, "reached": True}
    assert said["rare"]["drawn"] is None
    assert "probability of contact" in (out / "case.html").read_text(encoding="utf-8")
    assert not list(out.glob(".levels*"))  # there while it searches
    before = (out / "rare.json").stat().st_mtime_ns
    assert main(["case", str(path), "-o", str(out)]) == 0
    assert (out / "rare.json").stat().st_mtime_ns == before
    assert json.loads((out / "case.json").read_text(encoding="utf-8"))["results"] == said["results"]
    assert main(["case", "--verify", str(out)]) == 0
    text = (out / "rare.json").read_text(encoding="utf-8")
    (out / "rare.json").write_text(text.replace('"high": 1.0', '"high": 0.5'), encoding="utf-8")
    capsys.readouterr()
    assert main(["case", "--verify", str(out)]) == 2
    assert "parts have changed since" in capsys.readouterr().err
    (out / "rare.json").write_text(text.replace(said["digest"], "0" * 8), encoding="utf-8")
    assert main(["case", str(path), "-o", str(out)]) == 2
    assert "of another case" in capsys.readouterr().err


@pytest.mark.parametrize(("change", "said"), [
    ({"encounters": 'set = "imazu"\n'}, "nothing to vary"),
    ({"rare": '[rare]\nbreach = "5"\n'}, "17(c)"),
    ({"rare": "[rare]\nruns = 10\n"}, "100"),
    ({"rare": "[sensors.radar]\n[rare]\n"}, "sensors"),
    ({"rare": '[rare]\n', "stack": '[stack]\ncommand = "python keep.py {address}"\n'}, "one encounter at a time"),
])  # fmt: skip
def test_a_case_that_levels_cannot_follow_is_refused_before_it_runs(
    tmp_path: Path, capsys: Any, change: dict[str, str], said: str,
) -> None:  # fmt: skip
    assert main(["case", str(asked(tmp_path, **change)), "-o", str(tmp_path / "out")]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_levels_sail_the_ships_of_the_posterior_in_their_order(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    draws = np.random.default_rng(3).standard_normal((SHIPS, 2))
    held: Any = SimpleNamespace(draws=lambda count, seed: draws[:count], names=("a", "b"), digest="fit",
                                mean=np.array([7.0, 8.0]))  # fmt: skip
    file = from_json(CaseFile, {"claim": "c", "ship": "kvlcc2_l7", "traffic": ["ignores"], "rare": {"runs": 100},
                                "encounters": {"roles": ["give-way"], "runs": 2}}, tmp_path / SCHEMA)  # fmt: skip
    setup = replace(Setup.of(file, tmp_path), posterior=held)
    seen: list[Any] = []

    def at(self: Any, space: Any, points: Any, draws: Any = None) -> Any:
        seen.append(draws)
        return SimpleNamespace(runs=np.array([1]), tracks=None)  # the first of two runs fails

    monkeypatch.setattr(Setup, "at", at)
    monkeypatch.setattr(module, "judge", lambda *_, **__: None)
    monkeypatch.setattr(module, "margins", lambda own, breach: np.array([3.0]))
    got: list[np.ndarray] = []

    def stand_in(margin: Any, *_: Any, **more: Any) -> Rarely:
        assert more["posterior"]
        cube = np.full((2, len(setup.space.free)), 0.5)
        got.extend([margin(cube, np.full(2, np.nan)), margin(cube, np.array([0.0, 1.0 - 1e-12]))])
        return Rarely(setup.digest, Reached(0.1, 0.0, 0.2, 1, True), None)

    monkeypatch.setattr(module, "rarely", stand_in)
    module._rarely(setup, tmp_path, SILENT)
    for margin in got:
        assert np.isnan(margin[0])
        assert margin[1] == 3.0
    assert np.column_stack([seen[0]["a"], seen[0]["b"]]) == pytest.approx(np.array([[7.0, 8.0]] * 2))  # as fitted
    line = ordered(draws)
    assert np.column_stack([seen[1]["a"], seen[1]["b"]]) == pytest.approx(line[[0, -1]])
