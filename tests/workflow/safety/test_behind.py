"""What stands behind a model in a case: bands of how near ships come, and where runs leave what trials tested."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seatrial.core.errors import RequestError
from seatrial.encounters import Tracks
from seatrial.study.grounds import Grounds, Plane
from seatrial.workflow.evidence import card as carded
from seatrial.workflow.safety import behind
from seatrial.workflow.safety.behind import band, closest, untested
from seatrial.workflow.safety.claimed import Case, CaseFile, Part

SQUARE = Plane("u", "r", ((0.8, -0.05), (1.2, -0.05), (1.2, 0.05), (0.8, 0.05)))
GROUNDS = Grounds(covered={"u": (0.8, 1.2), "r": (-0.05, 0.05)}, tested=(SQUARE,))


def turned(u: float, r: float, runs: int = 1) -> Tracks:
    """Two ships, the own one on a circle."""
    t = np.arange(0.0, 100.0, 10.0)
    psi = np.tile(np.array([r * t, 0.0 * t]), (runs, 1, 1))
    zero = np.zeros_like(psi)
    return Tracks(t, zero + np.array([[0.0], [500.0]]), zero, psi, zero + u, zero, np.full(2, 7.0), np.full(2, 1.0))


@pytest.mark.parametrize(("u", "r", "said"), [
    (1.0, 0.02, ""), (1.5, 0.0, "u"), (1.0, 0.08, "r"), (1.0, -0.08, "r"), (0.5, 0.09, "r, u"), (1.23, 0.0, ""),
])  # fmt: skip
def test_a_run_leaves_what_trials_tested_by_its_channels(u: float, r: float, said: str) -> None:
    assert untested(turned(u, r), GROUNDS, (np.zeros(1), np.zeros(1))) == [said]


def test_it_is_the_motion_through_the_water_that_counts() -> None:
    """Over ground at 1.5 on course north in a current of .5 north: 1 through the water; the other run has none."""
    made = turned(1.5, 0.0, runs=2)
    assert untested(made, GROUNDS, (np.array([0.5, 0.0]), np.zeros(2))) == ["", "u"]
    assert untested(made, None, (np.zeros(2), np.zeros(2))) == ["", ""]


def test_the_closest_is_of_all_others() -> None:
    some: Any = [SimpleNamespace(gap=np.array([5.0, 90.0])), SimpleNamespace(gap=np.array([70.0, -1.0]))]
    assert closest(some).tolist() == [5.0, -1.0]
    one: Any = [SimpleNamespace(gap=np.float64(3.0))]
    assert closest(one).tolist() == [3.0]


def held(drawn: Any, plain: Any, out: Any = ()) -> Case:
    n = len(drawn)
    part = Part("d", 0, ((),) * n, ((),) * n, ((),) * len(plain), tuple(drawn), tuple(plain), tuple(out))
    return Case(CaseFile(claim="c", ship="s"), "d", (part,), "f1")


def test_the_band_is_of_pairs_of_runs() -> None:
    """Differences -50 to 50 by ones, and a run that failed: quantiles .025 and .975 of 101 are -47.5 and 47.5."""
    plain = [1000.0] * 102
    drawn = [*(1000.0 + one for one in range(-50, 51)), None]
    assert band(held(drawn, plain)) == pytest.approx((-47.5, 47.5))
    assert band(held(drawn[:10], plain[:10])) is None
    assert band(held(drawn, ())) is None


def test_the_page_tells_bands_validity_and_card(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    limits = [SimpleNamespace(verdict=verdict, reason=f"{k} of 9", limit=SimpleNamespace(about=f"error {k}"))
              for k, verdict in enumerate(("fit", "not fit", "not fit"))]  # fmt: skip
    berthing = SimpleNamespace(title="Berthing", verdict="not fit", found=tuple(limits))
    uses = SimpleNamespace(uses=(berthing,), unjudged={"IMO": "no turn"},
                           missing=())  # fmt: skip
    monkeypatch.setattr(carded, "card", lambda model: SimpleNamespace(result=uses))
    monkeypatch.setattr(behind, "grounds_of", lambda path: GROUNDS)
    case = held([100.0] * 30, [90.0] * 30, ["", "r, u", "u"] + [""] * 27)
    said = str(behind.told(case, tmp_path / "model.toml"))
    assert "pass 10.0 to 10.0 m farther off" in said
    assert "2 of 30 runs leave what the trials of its fit tested, in r, u" in said
    assert "Berthing" in said
    assert "not fit" in said
    assert "not judged: no turn" in said
    assert "'Berthing', 'not fit: error 1, 1 of 9'" in said  # the first that decides
    assert "draws are of the fit alone" in said
    (tmp_path / "model.bands.json").write_text("{}", encoding="utf-8")
    assert "as wide as trials that were left out" in str(behind.told(case, tmp_path / "model.toml"))
    monkeypatch.setattr(behind, "grounds_of", lambda path: None)
    assert "was not kept" in str(behind.told(case, tmp_path / "model.toml"))

    def none(model: str) -> None:
        raise RequestError("no fit is beside it")

    monkeypatch.setattr(carded, "card", none)
    assert "its card cannot be made: no fit is beside it" in str(behind.told(case, tmp_path / "model.toml"))
    assert behind.told(Case(CaseFile(claim="c", ship="s"), "d", case.parts, ""), tmp_path / "m.toml") == ()
    assert behind.grounds_of is not None
