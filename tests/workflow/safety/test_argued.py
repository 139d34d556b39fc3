"""The argument of a case: each question has its section, and what was signed is found changed where it is."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatrial.campaign.analysis.proportion import Proportion
from seatrial.cli.app import main
from seatrial.core.records import to_json
from seatrial.encounters.meeting import drawn
from seatrial.encounters.rules import OPEN_WATER, Role, Waters
from seatrial.encounters.sensing import Ais, Sensing
from seatrial.environment.chart import Chart
from seatrial.ships.files import load
from seatrial.workflow import RequestError
from seatrial.workflow.safety import argued
from seatrial.workflow.safety.argued import verified
from seatrial.workflow.safety.claimed import PART, Around, Case, CaseFile, Part, Where


def signed(folder: Path, *, sensors: Sensing | None = None, failed: bool = True) -> Case:
    """A case of six runs in two parts, as the command leaves it."""
    broken = (("15", "contact"), (), None) if failed else ((), (), ())
    parts = (Part("in", 0, broken, (("15",), ("15", "16"), ())), Part("in", 3, (("16",), (), ()), (("16",),) * 3))
    if not failed:
        parts = (Part("in", 0, broken, (("15",),) * 3),)
    found = Case(CaseFile(claim="it keeps clear", ship="kvlcc2", sensors=sensors), "in", parts, "")
    folder.mkdir(exist_ok=True)
    for part in parts:
        (folder / f"part-{part.first:07d}.json").write_text(to_json(part, PART), encoding="utf-8")
    meeting = drawn([Role.GIVE_WAY], len(found.broken), 8.0, 1)
    page = argued.page(found, load("kvlcc2"), meeting, Path("case.toml"), lambda runs: iter(()), None)
    argued.kept(folder, page)
    return found


def test_a_case_is_as_it_was_signed(tmp_path: Path, capsys: Any) -> None:
    found = signed(tmp_path / "a")
    again = verified(tmp_path / "a").result
    assert again == found
    assert main(["case", "--verify", str(tmp_path / "a")]) == 0
    assert found.sealed in capsys.readouterr().out
    page = (tmp_path / "a" / "case.html").read_text(encoding="utf-8")
    assert found.sealed in page
    digest, name = (tmp_path / "a" / "case.sha256").read_text(encoding="utf-8").splitlines()[0].split("  ")
    assert (name, digest) == ("case.html", hashlib.sha256(page.encode()).hexdigest())  # as `sha256sum -c` reads it
    assert main(["case", "a.toml"]) == 2
    assert "--verify" in capsys.readouterr().err


@pytest.mark.parametrize(("change", "said"), [
    (lambda folder: _edit(folder / "part-0000003.json", ["16"], []), "parts have changed since"),
    (lambda folder: (folder / "part-0000003.json").unlink(), "parts have changed since"),
    (lambda folder: _put(folder, lambda said: said["rules"]["15"].update(broken=0)), "rules is not what the parts say"),
    (lambda folder: _put(folder, lambda said: said.update(claim="more")), "claim is not what the parts say"),
    (lambda folder: _put(folder, lambda said: said.update(digest="other")), "is of case in, the numbers are of other"),
    (lambda folder: _put(folder, lambda said: said["case"].update(ship="suzaku")), "ship is not what the parts say"),
    (lambda folder: (folder / "case.json").unlink(), "case.json"),
    (lambda folder: _said(folder / "case.html", "keeps clear", "keeps clear of all"), "case.html: has changed"),
    (lambda folder: _said(folder / "case.json", "{", "{ "), "case.json: has changed"),
    (lambda folder: (folder / "case.html").unlink(), "case.html: cannot be read"),
    (lambda folder: (folder / "case.sha256").unlink(), "case.sha256: cannot be read"),
    (lambda folder: (folder / "case.sha256").write_text(""), "case.html: has changed"),
])  # fmt: skip
def test_what_was_changed_since_is_told(tmp_path: Path, change: Any, said: str) -> None:
    signed(tmp_path / "a")
    change(tmp_path / "a")
    with pytest.raises(RequestError, match=said):
        verified(tmp_path / "a")


def _edit(path: Path, old: Any, new: Any) -> None:
    document = json.loads(path.read_text(encoding="utf-8"))
    document["broken"] = [new if one == old else one for one in document["broken"]]
    path.write_text(json.dumps(document), encoding="utf-8")


def _said(path: Path, old: str, new: str) -> None:
    path.write_text(path.read_text(encoding="utf-8").replace(old, new, 1), encoding="utf-8")


def _put(folder: Path, change: Any) -> None:
    path = folder / "case.json"
    document = json.loads(path.read_text(encoding="utf-8"))
    change(document)
    path.write_text(json.dumps(document), encoding="utf-8")


def test_the_page_answers_in_the_order_of_a_surveyor(tmp_path: Path) -> None:
    signed(tmp_path / "a")
    page = (tmp_path / "a" / "case.html").read_text(encoding="utf-8")
    asked = ("What is claimed", "How many runs", "Which ship", "What failed", "Show me", "What was not tried",
             "Who says", "Repeat it", "Sign it")  # fmt: skip
    places = [page.index(one) for one in asked]
    assert places == sorted(places)
    assert "measured" in page  # what stands behind KVLCC2
    assert "Hagen et al. 2023" in page
    assert "MASS Code" in page


def test_what_failed_is_told_by_what_broke_together_and_nothing_where_nothing_did(tmp_path: Path) -> None:
    [table] = [one for one in argued._failed(signed(tmp_path / "a")) if hasattr(one, "rows")]
    assert [tuple(row) for row in table.rows] == [("15, contact", "1", "0"), ("16", "1", "3")]
    assert "Nothing" in str(argued._failed(signed(tmp_path / "b", failed=False)))


def test_contacts_are_drawn_first_and_one_run_of_each_combination() -> None:
    """Of forty breaches of one kind before a contact the first four showed nothing of that."""
    last = (("13",), ("contact",), (), None, ("13",), ("17(b)",), ("15", "contact"), ("15",))
    broken = (*((("16", "8(b)"),) * 40), *last)
    found = Case(CaseFile(claim="c", ship="s"), "d", (Part("d", 0, broken, ((),) * len(broken)),), "")
    asked: list[Any] = []
    body = argued._failures(found, lambda runs: asked.append(list(runs)) or iter(()), OPEN_WATER)
    assert asked == [[0, 40, 41, 46]]  # both with contact, then the most frequent
    assert "Of 46 runs that fail 4 are drawn" in str(body)
    same = Case(found.file, "d", (Part("d", 0, ((), ("16",), ("16",), ("contact",), ("16",), ("16",)), ((),) * 6),), "")
    argued._failures(same, lambda runs: asked.append(list(runs)) or iter(()), OPEN_WATER)
    assert asked[1] == [1, 2, 3, 4]  # where there are fewer combinations, more of one
    [table] = [one for one in argued._failed(found) if hasattr(one, "rows")]
    assert [row[0] for row in table.rows][:4] == ["contact", "15, contact", "16, 8(b)", "13"]


def test_where_nothing_failed_the_nearest_passes_are_drawn() -> None:
    part = Part("d", 0, ((), (), None, ()), ((),) * 4, closest=(310.0, 95.5, None, 120.0))
    found = Case(CaseFile(claim="c", ship="s"), "d", (part,), "")
    asked: list[Any] = []
    body = str(argued._failures(found, lambda runs: asked.append(list(runs)) or iter(()), OPEN_WATER))
    assert asked == [[1, 3]]
    assert "None failed. Of 3 runs those are drawn in which the hulls came nearest." in body
    none = Case(found.file, "d", (Part("d", 0, (None,), ((),), closest=(None,)),), "")
    assert "None failed." in str(argued._failures(none, lambda runs: iter(()), OPEN_WATER))


def test_rules_stand_in_their_order_with_how_often_of_how_many_and_the_interval() -> None:
    judged = ("15", "16", "17(b)", "8(a)", "6", "19(d)")
    part = Part("d", 0, (("8(a)",), ()), (judged, judged))
    found = Case(CaseFile(claim="c", ship="s"), "d", (part,), "")
    [table] = [one for one in argued.results(found) if hasattr(one, "rows")]
    rows = [tuple(str(cell) for cell in row) for row in table.rows]
    assert [row[0].removeprefix("Rule ") for row in rows] == ["contact", "6", "8(a)", "15", "16", "17(b)", "19(d)"]
    assert rows[2][1:] == ("1 of 2", "50.0 %", "1.26 to 98.7 %")  # Clopper and Pearson: 1 - .975^(1/2), and its mirror


@pytest.mark.parametrize("share", [0.3, 0.1, 0.01, 0.001])
def test_so_many_runs_without_a_breach_show_so_little(share: float) -> None:
    """By the interval itself: with so many its upper end lies below the share, with one fewer it does not."""
    runs = argued.needed(share)
    assert Proportion(0, runs).interval[1] <= share < Proportion(0, runs - 1).interval[1]


def test_silence_is_told_where_it_is_what_failed() -> None:
    part = Part("d", 0, (("silent",), ("silent", "8(a)"), ("15",), ()), ((),) * 4)
    said = str(argued.answer(Case(CaseFile(claim="c", ship="s"), "d", (part,), "")))
    assert "3 of 4 runs fail (a rule broken, contact, silence), 2 of them by falling silent" in said
    part = Part("d", 0, (("15",), ()), ((),) * 2)
    assert "by falling silent" not in str(argued.answer(Case(CaseFile(claim="c", ship="s"), "d", (part,), "")))


def test_weather_that_is_not_there_is_told_so() -> None:
    found = Case(CaseFile(claim="c", ship="s", weather=Around(current=(0.0, 0.5))), "d", (), "")
    assert "no wind, current 0 to 0.5 m/s" in argued._asked(found, load("kvlcc2"), OPEN_WATER)


def test_what_was_not_tried_follows_what_was() -> None:
    tried: Any = type("S", (), {"hit": (3, 38)})()
    blind = Case(CaseFile(claim="c", ship="s"), "d", (), "")
    seeing = Case(CaseFile(claim="c", ship="s", sensors=Sensing(ais=Ais())), "d", (), "")
    assert argued._not_tried(blind, tried, OPEN_WATER)[0].startswith("35 of 38 cells")
    assert "sees everybody as they are" in argued._not_tried(blind, tried, OPEN_WATER)[1]
    assert "clutter" in argued._not_tried(seeing, tried, OPEN_WATER)[1]
    assert "land, depth and lanes: open water" in argued._not_tried(blind, tried, OPEN_WATER)
    assert "restricted visibility" in argued._not_tried(blind, tried, OPEN_WATER)
    charted = Waters(Chart("here", 20.0, lacks=("3 rocks have no depth",)), 10.0, None, 2000.0)
    said = " ".join(argued._not_tried(blind, tried, charted))
    assert "the chart: 3 rocks have no depth" in said
    assert "open water:" not in said
    assert "restricted visibility" not in said


def test_where_a_case_is_is_told() -> None:
    file = CaseFile(claim="c", ship="s", waters=Where(chart="here", at=(100.0, -20.0), psi=0.5 * np.pi))
    found = Case(file, "d", (), "")
    said = argued._where(found, Waters(Chart("here", 20.0, source="a survey"), 10.0, 14.0, 2000.0))
    assert said == ("chart here (a survey), from 100 m north, −20.0 m east on 90.0°, draught 10.0 m, safety depth 14.0 "
                    "m; visibility 2000 m: Rules 6 and 19 in place of 11 to 18")  # fmt: skip
    assert argued._where(found, OPEN_WATER) == "open water, in sight of one another"


def test_a_case_in_which_every_model_failed_has_numbers(tmp_path: Path) -> None:
    part = Part("in", 0, (None, None), ((), ()))
    said = argued.document(Case(CaseFile(claim="c", ship="s"), "in", (part,), ""))
    assert json.loads(json.dumps(said, allow_nan=False))["rules"]["contact"]["share"] is None
    assert np.isnan(Case(CaseFile(claim="c", ship="s"), "in", (part,), "").share("contact").value)


def test_the_range_of_validity_is_told() -> None:
    ship = load("kvlcc2")
    ends = "u 0 to 10.0 m/s, v_m −3.50 to 3.50 m/s, r −1.26 to 1.26 °/s"  # .022 rad/s
    assert argued._valid(ship).startswith(f"its file calls it valid for {ends}")
    assert argued._valid(ship).endswith("its motion through the water is watched in each run")
    assert "states no range" in argued._valid(replace(ship, validity={}))
