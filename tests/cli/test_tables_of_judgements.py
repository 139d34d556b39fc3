"""Tables of captive tests, of criteria, of ships with more motions and of families; and what pages are served at."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from seatrial.choosing.purposes import BERTHING, COLLISION_AVOIDANCE
from seatrial.cli import fits, folders, judging, ships, simulation
from seatrial.cli.app import main
from seatrial.core.parameters import update
from seatrial.report.blocks import fields, line
from seatrial.ships.files import load
from seatrial.validate.imo import Criterion
from seatrial.workflow.asked import Page

Said = pytest.CaptureFixture[str]


def cells(out: str, first: str) -> list[str]:
    """The cells of the row that begins so."""
    line = next(line for line in out.splitlines() if line.strip().startswith(first))
    return re.split(r"\s{2,}", line.strip())


def ends(out: str, *texts: str) -> set[int]:
    """Where each of these cells ends in its line; of a column of numbers all end alike."""
    return {next(m.end() for line in out.splitlines() if (m := re.search(rf"(?<!\S){re.escape(text)}(?!\S)", line)))
            for text in texts}  # fmt: skip


def test_captive_coefficients_are_shown_before_and_after_with_lengths_over_the_ship_s(
    monkeypatch: pytest.MonkeyPatch, capsys: Said
) -> None:
    before = load("kvlcc2_l7")
    after = before.having({"rudder.a_H": 0.41234567, "rudder.l_R": -3.5, "rudder.t_R": 0.5})
    verdicts = [SimpleNamespace(subject=path, status=status, text="") for path, status in (
        ("rudder.a_H", "identified"), ("rudder.l_R", "weak"), ("rudder.t_R", "not tested"))]  # fmt: skip
    verdicts.append(SimpleNamespace(subject="rudder.a_H and rudder.l_R", status="open", text="only together"))
    found = SimpleNamespace(
        ship=after, began=before, verdicts=verdicts, paths=("rudder.a_H", "rudder.l_R"), values=(0.41234567, -3.5),
        sigma=(0.0123456, 0.7), determined_by={"rudder.a_H": {"rudder": 1.0}, "rudder.l_R": {"yaw": 1.0, "drift": 2.0}},
        held={"rudder.t_R": "needs a run with the rudder over"},
    )  # fmt: skip
    monkeypatch.setattr("seatrial.workflow.judging.captive", lambda *_, **__: found)
    monkeypatch.setattr("seatrial.report.judging.captive.numbers", lambda fit: {"ship": fit.ship.name})
    assert main(["captive", "kvlcc2_l7", "a.csv"]) == 0
    out, err = capsys.readouterr()
    assert cells(out, "rudder.a_H ") == ["rudder.a_H", "0.312", "0.4123", "0.012", "identified", "rudder"]
    assert cells(out, "rudder.l_R") == ["rudder.l_R", "-0.71", "-0.5", "0.1", "weak", "yaw, drift"]
    assert cells(out, "rudder.t_R") == [
        "rudder.t_R",
        "0.387",
        "0.5",
        "–",
        "not tested",
        "needs a run with the rudder over",
    ]
    assert len(ends(out, "0.312", "-0.71", "before")) == len(ends(out, "0.4123", "-0.5", "captive")) == 1
    assert len(ends(out, "0.012", "0.1", "sigma")) == 1
    assert err == "note: rudder.a_H and rudder.l_R: only together\n"
    assert update(before.model, {}) == before.model


def test_criteria_are_shown_with_bands_where_draws_were_made(monkeypatch: pytest.MonkeyPatch, capsys: Said) -> None:
    rows = [
        Criterion("advance", "port", 3.14159, "L", 4.5, "pass"),
        Criterion("reach", "", None, "L", 15.0, "fail", "why"),
    ]
    table = SimpleNamespace(rows=rows, conditions={"speed": "15.5 kn"}, caveats=("shallow",), verdict="fails",
                            ship="kvlcc2", L_pp=320.0, speed=7.97, n_P=1.6, L_over_V=40.2, together=None)  # fmt: skip
    monkeypatch.setattr("seatrial.workflow.judging.imo", lambda *_, **__: table)
    assert main(["imo", "kvlcc2"]) == 0
    out = capsys.readouterr().out
    assert cells(out, "advance") == ["advance", "port", "3.14", "4.50", "L", "pass"]
    assert cells(out, "reach ") == ["reach", "–", "–", "15.0", "L", "fail"]
    assert len(ends(out, "3.14", "value")) == len(ends(out, "4.50", "15.0", "limit")) == 1
    assert out.startswith("fails\n")
    assert out.index("advance") < out.index("Reasons")  # the table is read before what it does not show
    assert out.endswith("Reasons\nreach: why\nWhat this does not show\nshallow\nspeed: 15.5 kn\n")
    band: Any = SimpleNamespace(low=2.95, high=math.nan, met=0.5, draws=100)
    from dataclasses import replace

    table.rows = [replace(rows[0], band=band), rows[1]]
    assert main(["imo", "kvlcc2"]) == 0
    out = capsys.readouterr().out
    assert cells(out, "criterion")[1:] == [
        "side", "value", "from", "to", "limit", "unit", "draws that meet it", "verdict"]  # fmt: skip
    assert cells(out, "advance") == ["advance", "port", "3.14", "2.95", "–", "4.50", "L", "50 %", "pass"]
    assert len(ends(out, "2.95", "from")) == len(ends(out, "4.50", "limit")) == 1


def test_a_requirement_is_shown_with_its_verdict(monkeypatch: pytest.MonkeyPatch, capsys: Said) -> None:
    item, said = SimpleNamespace(number="3", text="stops"), SimpleNamespace(verdict="pass", reason="15 L")
    said.findings, said.drawn = (), None
    found = SimpleNamespace(rows=[(item, said)], ship="kvlcc2", scope="berthing", failed=())
    monkeypatch.setattr("seatrial.workflow.judging.requirements", lambda *_, **__: found)
    monkeypatch.setattr("seatrial.report.judging.requirements.verdict", lambda one: "all met")
    assert main(["requirements", "kvlcc2"]) == 0
    out = capsys.readouterr().out
    assert cells(out, "3 ") == ["3", "stops", "✓ pass", "15 L"]
    assert out.startswith("kvlcc2, berthing: all met\n")


def test_more_motions_are_shown_from_their_tables_alone(capsys: Said) -> None:
    made = load("kvlcc2_l7")
    ships._more(made, ("rudder", "propeller"), Path("x.toml"), json=True)
    told = json.loads(capsys.readouterr().out)
    groups = {path.partition(".")[0] for path in told["parameters"]}
    assert groups == {"rudder", "propeller"}
    assert told["parameters"]["propeller.D_P"]["value"] == 0.216
    assert told["parameters"]["propeller.D_P"]["unit"] == "m"
    assert "yasukawa2015" in told["parameters"]["propeller.D_P"]["source"]
    assert told["file"] == "x.toml"
    ships._more(made, ("propeller",), None, json=False)
    out = capsys.readouterr().out
    assert cells(out, "propeller.D_P")[:3] == ["propeller.D_P", "0.216", "m"]
    assert "rudder" not in out.replace("(rudder", "")
    assert len(ends(out, "0.216", "-0.2753", "value")) == 1


def test_seakeeping_adds_roll_and_heave(monkeypatch: pytest.MonkeyPatch) -> None:
    shown: list[Any] = []
    monkeypatch.setattr(ships, "_more", lambda made, tables, out, json: shown.append((made, tables, out, json)))
    monkeypatch.setattr("seatrial.workflow.seaway.making.seakeeping", lambda *_, **__: "ship")
    assert main(["seakeeping", "kvlcc2", "x.nc", "-o", "y.toml"]) == 0
    assert shown == [("ship", ("roll", "heave"), Path("y.toml"), False)]


def test_a_family_is_told_with_what_it_cannot_meet() -> None:
    """Of the lists of section 6.2, items by their own numbers: those not met, and those met in part."""

    def answered(keys: Any) -> str:
        return {"no": "no", "part": "partly"}.get(answers.get(tuple(keys), ""), "yes")

    answers = {tuple(COLLISION_AVOIDANCE[0].keys): "no", tuple(COLLISION_AVOIDANCE[1].keys): "part"}
    about = SimpleNamespace(
        key="a", name="A", classes=(), form="f", section="3", source="s", routes=("r",), next=("n",)
    )
    study = SimpleNamespace(reference=1, model="m", length=(2.0, 3.0))
    from seatrial.choosing import CAPABILITIES

    findings = {one.key: SimpleNamespace(answer="yes", how="measured") for one in CAPABILITIES}
    family: Any = SimpleNamespace(
        family=about, controls=("delta",), environment=("wind",), outputs=("r",), coefficients=(2, 3),
        length=(1.0, 2.0),
        studies=(study,), cost=7.5, example="kvlcc2", ships=("kvlcc2",), findings=findings, answer=answered,
    )  # fmt: skip
    told = judging._document(family)
    assert told["status"] == "planned"
    assert told["items_unmet"]["collision-avoidance"] == tuple(
        one.item for one in COLLISION_AVOIDANCE if one.item and answered(one.keys) == "no")  # fmt: skip
    assert COLLISION_AVOIDANCE[0].item in told["items_unmet"]["collision-avoidance"]
    assert COLLISION_AVOIDANCE[1].item in told["items_in_part"]["collision-avoidance"]
    assert set(told["items_unmet"]["berthing"]) <= {one.item for one in BERTHING}
    assert told["data"] == {"length": (1.0, 2.0), "routes": ("r",), "studies": [{"reference": 1, "length": (2.0, 3.0)}]}
    assert told["represents"][CAPABILITIES[0].key] == {
        "about": CAPABILITIES[0].about,
        "answer": "yes",
        "how": "measured",
    }
    about.classes = ("x",)
    assert judging._document(family)["status"] == "available"


@pytest.mark.parametrize("failure", [None, "the line is gone"])
def test_a_page_with_a_line_ends_with_1_where_it_failed(failure: str | None, monkeypatch: Any, capsys: Said) -> None:
    rigged = SimpleNamespace(written=("a.csv",), failure=failure, document=lambda: {"t": 1.0})
    monkeypatch.setattr("seatrial.workflow.afloat.sail", lambda *_, **__: rigged)
    assert main(["bridge", "kvlcc2", "--signalk"]) == (1 if failure else 0)
    assert capsys.readouterr() == ("a.csv\n", f"error: {failure}\n" if failure else "")


@pytest.mark.parametrize("option", [
    ["--to", "udp://x"], ["--framed"], ["--only", "HDT"], ["--commander", "x"], ["--simulator"], ["--log", "x.nmea"],
    ["--lock-step"], ["--beside", "x"], ["--answer-to", "HDT"],
])  # fmt: skip
def test_what_is_of_a_wire_needs_one(option: list[str], capsys: Said) -> None:
    assert main(["bridge", "kvlcc2", *option]) == 2
    assert f"{option[0]} is of a wire; give --nmea" in capsys.readouterr().err


@pytest.mark.parametrize("option", [["--signalk"], ["--rosbridge"], ["--port", "0"], ["--ghost", "a.csv"],
                                    ["--bands", "95"]])  # fmt: skip
def test_what_is_of_a_page_needs_one(option: list[str], capsys: Said) -> None:
    assert main(["steer", "kvlcc2", "--nmea", "udp://127.0.0.1:0", *option]) == 2
    assert f"{option[0]} is of the page; add --page" in capsys.readouterr().err


def test_pages_of_four_commands_are_at_ports_of_their_own() -> None:
    assert sorted([Page().port, fits.PORT, simulation.TWIN_PORT, folders.DESK_PORT]) == [8020, 8021, 8022, 8030]


def test_a_twin_listens_only_for_a_page_and_lets_go(monkeypatch: pytest.MonkeyPatch, capsys: Said) -> None:
    closed: list[int] = []
    asked: list[Any] = []
    given: list[Any] = []

    def listen(host: str, port: int, *, anywhere: bool) -> Any:
        asked.append((host, port, anywhere))
        return SimpleNamespace(close=lambda: closed.append(port))

    outcome = SimpleNamespace(shown=fields({"a": 1}, line("told")))
    monkeypatch.setattr("seatrial.core.listening.listen", listen)
    monkeypatch.setattr("seatrial.core.listening.address", lambda one: "http://here")
    monkeypatch.setattr("seatrial.workflow.live.twin.twin", lambda *_, **more: given.append(more["page"]) or outcome)
    assert main(["twin", "kvlcc2", "--trial", "a.csv"]) == 0
    assert (asked, closed, given) == ([], [], [None])
    assert main(["twin", "kvlcc2", "--trial", "a.csv", "--page"]) == 0
    assert (asked, closed, given[1] is None) == ([("127.0.0.1", 8022, False)], [8022], False)
    assert capsys.readouterr() == ("told\ntold\n", "page: http://here\n")


def test_the_demo_is_told_in_lines_or_one_object(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: Said) -> None:
    asked: list[Any] = []
    monkeypatch.setattr("seatrial.workflow.demo.tell", lambda out, note: asked.append(out) or {"lines": ["a", "b"]})
    assert main(["demo", "-o", str(tmp_path / "d")]) == 0
    assert capsys.readouterr().out == "a\nb\n"
    assert main(["demo", "-o", str(tmp_path / "d"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"lines": ["a", "b"]}
    assert asked == [tmp_path / "d"] * 2
    monkeypatch.chdir(tmp_path)
    assert main(["demo"]) == 0
    assert asked[2] == Path("demo")


@pytest.mark.parametrize(("state", "status"), [("ok", 0), ("missing", 0), ("error", 1)])
def test_the_doctor_fails_where_a_command_would(state: str, status: int, monkeypatch: Any, capsys: Said) -> None:
    one = SimpleNamespace(area="kernel", what="compiler", state=state, found="gcc 14", remedy="install gcc")
    two = SimpleNamespace(area="data", what="data", state="ok", found="here", remedy="")
    monkeypatch.setattr("seatrial.workflow.installation.examine", lambda: (one, two))
    assert main(["doctor"]) == status
    out = capsys.readouterr().out
    assert cells(out, "kernel") == ["kernel", "compiler", state, "gcc 14"]
    assert out.endswith("compiler: install gcc\n")
    assert main(["doctor", "--json"]) == status
    told = json.loads(capsys.readouterr().out)
    assert told["ok"] is (status == 0)
    assert told["findings"][0] == {"area": "kernel", "what": "compiler", "state": state, "found": "gcc 14",
                                   "remedy": "install gcc"}  # fmt: skip


def test_a_harbour_run_is_told_by_its_indices(monkeypatch: pytest.MonkeyPatch, capsys: Said) -> None:
    from seatrial.manoeuvres import Index

    ran = SimpleNamespace(ship=SimpleNamespace(name="kvlcc2_harbour"), chart=SimpleNamespace(name="quay"),
                          trial=SimpleNamespace(duration=321.0),
                          indices={"contact_speed": Index(0.0712341, "m/s")})  # fmt: skip
    asked: list[Any] = []
    monkeypatch.setattr("seatrial.workflow.harbour.harbour", lambda *given, **_: asked.append(given) or ran)
    assert main(["harbour", "berthing"]) == 0
    out = capsys.readouterr().out
    assert cells(out, "contact speed") == ["contact speed", "0.071234", "m/s", "–"]
    assert "kvlcc2_harbour, berthing, quay" in out
    assert asked == [("berthing", "kvlcc2_harbour", None)]
    assert main(["harbour", "berthing", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {
        "ship": "kvlcc2_harbour", "run": "berthing", "chart": "quay", "time": 321.0,
        "indices": {"contact_speed": {"value": 0.0712341, "unit": "m/s"}}}  # fmt: skip


def test_lists_stand_at_the_end_of_the_help_of_their_commands(capsys: Said) -> None:
    for words, title, listed in ((["simulate"], "Manoeuvres", ("zigzag", "turning")),
                                 (["import"], "Formats", ("csv (with --mapping)", "usv-asw"))):  # fmt: skip
        assert main([*words, "--help"]) == 0
        said = capsys.readouterr().out.rstrip()
        at_end = said[said.index(f"\n{title}:\n") :]
        assert all(one in " ".join(at_end.split()) for one in listed)
        assert at_end.endswith(".")
        assert max(map(len, at_end.splitlines())) <= 78


def test_each_command_shows_a_table_or_one_object(monkeypatch: pytest.MonkeyPatch, capsys: Said) -> None:
    """The bands of a calibration, a design with its bands, an estimate, a scenario and peers."""
    monkeypatch.setattr("seatrial.workflow.evidence.calibrate.calibrate",
                        lambda *_, **__: SimpleNamespace(shown=fields({"a": 1}, line("told"))))  # fmt: skip
    assert main(["calibrate", "m.toml"]) == 0
    assert capsys.readouterr().out == "told\n"
    assert main(["calibrate", "m.toml", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"a": 1}

    shown: list[Any] = []
    made = SimpleNamespace(ship=SimpleNamespace(name="mine"), plan="plan", foreseen="foreseen")
    monkeypatch.setattr("seatrial.workflow.judging.design", lambda *_, **__: made)
    made.noise = {}
    monkeypatch.setattr(judging, "_planned", lambda *given: shown.append(given) or fields({"plan": given[1]}))
    monkeypatch.setattr(judging, "_foreseen", lambda *given: shown.append(given) or fields({"bands": given[0]}))
    assert main(["design", "kvlcc2", "--free", "hull.*"]) == 0
    assert shown == [("mine", "plan")]
    assert main(["design", "kvlcc2", "--free", "hull.*", "--bands", "90"]) == 0
    assert shown[1:] == [("mine", "plan"), ("foreseen", 90.0)]
    assert capsys.readouterr().out == ""
    assert main(["design", "kvlcc2", "--free", "hull.*", "--bands", "90", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told == {"ship": "mine", "budget": 60.0, "noise": {}, "plan": "plan", "bands": "foreseen"}
    del shown[3:]

    number = SimpleNamespace(path="hull.N_r", value=-0.05, unit="", formula="clarke1983", outside=(), basis="table",
                             others={}, spread=0.1, sigma=0.01, share=0.2, sigma_from="ships of it")  # fmt: skip
    other = SimpleNamespace(**vars(number) | {"path": "hull.Y_v", "value": -123.4, "share": 0.05})
    entries = {path: SimpleNamespace(source="estimated") for path in ("hull.N_r", "hull.Y_v")}
    estimated = SimpleNamespace(numbers=(number, other), ship=SimpleNamespace(name="new", entries=entries), cautions=())
    monkeypatch.setattr("seatrial.workflow.judging.estimate", lambda *_, **__: estimated)
    assert main(["estimate", "p.toml", "-o", "s.toml"]) == 0
    out = capsys.readouterr().out
    assert cells(out, "hull.N_r")[:2] == ["hull.N_r", "-0.05"]
    assert len(ends(out, "-0.05", "-123.4")) == len(ends(out, "20%", "5%")) == 1
    assert main(["estimate", "p.toml", "-o", "s.toml", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["ship"], told["file"], told["cautions"]) == ("new", "s.toml", [])
    assert told["numbers"]["hull.Y_v"]["value"] == -123.4
    assert told["numbers"]["hull.Y_v"]["source"] == "estimated"

    ran = SimpleNamespace(met=True, document=lambda: {"met": True})
    monkeypatch.setattr("seatrial.workflow.afloat.sail", lambda *_, **__: ran)
    monkeypatch.setattr(simulation, "_judged", lambda *given: shown.append(given) or ())
    assert main(["range", "x.toml"]) == 0
    assert shown[3:] == [(ran, {"met": True})]

    assert main(["bench", "scipy", "--list"]) == 0
    assert cells(capsys.readouterr().out, "scipy")[2].startswith("installed")
    assert main(["bench", "scipy", "--list", "--json"]) == 0
    assert [one["name"] for one in json.loads(capsys.readouterr().out)["peers"]] == ["scipy"]


@pytest.mark.parametrize("complete", [True, False])
def test_a_run_with_bands_ends_as_one_without(complete: bool, monkeypatch: Any, capsys: Said) -> None:
    shown: list[Any] = []
    run = SimpleNamespace(complete=complete, reason="it drifts")
    banded = SimpleNamespace(run=run)
    monkeypatch.setattr("seatrial.workflow.evidence.bands.simulate_with_bands", lambda *_, **__: banded)
    monkeypatch.setattr(simulation, "bands_shown", lambda *given: shown.append(given) or ())
    assert main(["simulate", "m.toml", "turning", "--bands", "95"]) == (0 if complete else 1)
    assert shown == [(banded,)]
    assert ("it drifts" in capsys.readouterr().err) is not complete


@pytest.mark.parametrize("failure", [None, "blew up"])
def test_a_voyage_that_fails_ends_with_1_after_its_summary(failure: str | None, monkeypatch: Any, capsys: Said) -> None:
    ran = SimpleNamespace(failure=failure)
    shown: list[Any] = []
    monkeypatch.setattr("seatrial.workflow.afloat.sail", lambda *_, **__: ran)
    monkeypatch.setattr(simulation, "_summary", lambda *given: shown.append(given) or fields({"t": 1.0}))
    assert main(["steer", "kvlcc2", "--nmea", "udp://x", "--json"]) == (1 if failure else 0)
    assert shown == [(ran,)]
    out, err = capsys.readouterr()
    assert json.loads(out) == {"t": 1.0}
    assert err == (f"error: {failure}\n" if failure else "")


def test_families_are_surveyed_without_a_purpose_and_advised_on_with_one(monkeypatch: Any, capsys: Said) -> None:
    monkeypatch.setattr("seatrial.choosing.survey.survey", lambda: ("a", "b"))
    monkeypatch.setattr("seatrial.workflow.judging.recommend", lambda key: (f"for {key}", ("a",)))
    monkeypatch.setattr(judging, "_families", lambda every: fields({"families": every}, line(" and ".join(every))))
    monkeypatch.setattr(judging, "_advised", lambda *given: fields({"advice": given}, line(given[0])))
    assert main(["models"]) == 0
    assert main(["models", "--for", "berthing"]) == 0
    assert capsys.readouterr().out == "a and b\nfor berthing\n"
    assert main(["models", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"families": ["a", "b"]}
    assert main(["models", "--for", "berthing", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"advice": ["for berthing", ["a"]]}
