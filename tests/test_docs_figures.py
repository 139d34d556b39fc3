"""Figures of the pages are those of benchmarks/results: a page with a number that no run gave is stale."""

from __future__ import annotations

import importlib
import json
import re
import sys
from typing import Any

import pytest

from house import REPOSITORY
from seatrial.choosing import table
from seatrial.workflow.simulation import known

RESULTS = REPOSITORY / "benchmarks" / "results"
README, FIGURES, PAPER, JOSS = (
    (REPOSITORY / name).read_text(encoding="utf-8")
    for name in ("README.md", "docs/figures.md", "paper/paper.md", "docs/joss.md")
)


def result(name: str) -> Any:
    return json.loads((RESULTS / f"{name}.json").read_text(encoding="utf-8"))


def row(name: str, what: str) -> float:
    """The value of a row of a benchmark."""
    (found,) = (one["value"] for one in result(name)["rows"] if one["what"] == what)
    return found


def test_the_table_of_the_yardstick_is_that_of_its_results(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(REPOSITORY / "docs"))
    make = importlib.import_module("make_yardstick")
    sys.modules.pop("make_yardstick")
    assert make.page() == make.PAGE.read_text(encoding="utf-8"), "run: python docs/make_yardstick.py"


def test_errors_of_the_hybrid_are_those_of_its_run() -> None:
    found = result("hybrid_folds")
    said = [[f"{found[by][name]['together']:.2f} ± {found[by][name]['spread']:.2f}" for by in ("kind", "day")]
            for name in ("hybrid", "MMG")]  # fmt: skip
    assert f"| {' and '.join(said[0])}, its physics alone (MMG) {' and '.join(said[1])}; published" in README
    kinds = ("random", "turning", "zigzag", "berthing")
    for by in ("kind", "day"):
        own, later, physics = (found[by][name] for name in ("hybrid", "the same, --history 60", "MMG"))
        each, before = (" ".join(f"{one[kind]:.3f}" for kind in kinds) for one in (own, physics))
        whole = [f"{one['together']:.3f} ± {one['spread']:.3f}" for one in (own, later, physics)]
        assert (f"each {by} left out whole {each}, {whole[0]}, with `--history 60` {whole[1]}, "
                f"MMG {before}, {whole[2]}") in FIGURES
        assert all(own[kind] <= 1.01 * physics[kind] for kind in kinds), "never worse than the MMG model"


def test_coverage_is_that_of_its_run() -> None:
    kinds = result("coverage")["coverage"]
    shares = [100.0 * one["together"] for name, one in kinds.items() if name != "all kinds"]
    whole = 100.0 * kinds["all kinds"]["together"]
    days = [100.0 * share for share in result("coverage")["by day"].values()]
    assert (f"| {whole:.1f} %; {min(shares):.1f} to {max(shares):.1f} % by kind of manoeuvre, "
            f"{min(days):.1f} to {max(days):.1f} % by day |") in README


def test_times_of_the_right_hand_side_are_those_of_their_run() -> None:
    ours = row("peers", "our engine, 1 thread, 128 ships")
    ratio = row("peers", "shipmmg over ours, per RHS and ship")
    for page in (README, FIGURES):
        said = re.search(r"\| (\d+) ns; shipmmg 0\.0\.11 takes over (\d+) times as long \|", page)
        assert said is not None
        assert int(said[1]) == round(ours)
        assert 0.9 * ratio < int(said[2]) < ratio
    assert f"takes {ours:.0f} ns a ship on one core" in " ".join(PAPER.split())


def test_every_claim_of_the_paper_that_has_a_number_has_its_command() -> None:
    """The page of the checklist has a row for each, and the words of the row stand in the paper."""
    rows = re.findall(r"^\| \"([^\"]+)\" \| `([^`]+)` \|$", JOSS, re.MULTILINE)
    words = " ".join(PAPER.split())
    assert len(rows) >= 5
    assert all(claim in words for claim, _ in rows), [claim for claim, _ in rows if claim not in words]
    counted = set(re.findall(r"\b(?:fourteen|twenty|\d+ ns)\b", words.partition("# References")[0]))
    assert counted <= set(re.findall(r"\b(?:fourteen|twenty|\d+ ns)\b", " ".join(claim for claim, _ in rows).lower()))


def test_the_paper_counts_families_and_manoeuvres_as_the_program_has_them() -> None:
    words = {14: "fourteen", 20: "twenty"}
    families = table("families.toml")["family"]
    assert f"fits models of {words[len(families)]} families" in " ".join(PAPER.split())
    assert f"{words[len(known())]} manoeuvres with the indices" in " ".join(PAPER.split())
