"""What commands show: figures and their digits, units and counts, beside the values that they come from."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from click import Context
from click.exceptions import Exit

from seatrial.cli import campaign, evidence, fits, judging, render, ships, simulation
from seatrial.cli.app import app, main
from seatrial.core.parameters import walk
from seatrial.manoeuvres import Index
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.realtime.afloat import Voyage
from seatrial.realtime.range.judge import Judged
from seatrial.report.blocks import Line, Table, document, fields
from seatrial.ships.files import library, load
from seatrial.simulate.run import approach
from seatrial.simulate.run import simulate as sail
from seatrial.workflow import Outcome, RequestError
from seatrial.workflow.asked import Serving
from seatrial.workflow.data import Imported

Said = pytest.CaptureFixture[str]


def cells(out: str, first: str) -> list[str]:
    """The cells of the row that begins so."""
    line = next(line for line in out.splitlines() if line.strip().startswith(first))
    return re.split(r"\s{2,}", line.strip())


def ends(out: str, *texts: str) -> set[int]:
    """Where each of these cells ends in its line; of a column of numbers all end alike."""
    return {next(m.end() for line in out.splitlines() if (m := re.search(rf"(?<!\S){re.escape(text)}(?!\S)", line)))
            for text in texts}  # fmt: skip


# simulate


@pytest.fixture(scope="module")
def run() -> Any:
    ship = load("kvlcc2_l7")
    policy = Zigzag(approach(ship)[1], math.radians(20), math.radians(20), 1.0)
    return policy.indices(sail(ship, policy, duration=120.0), ship.L_pp)


@pytest.mark.slow
def test_indices_are_those_of_the_run_in_degrees(run: Any, capsys: Said) -> None:
    words = ["simulate", "kvlcc2_l7", "zigzag", "--rudder", "20", "--heading", "20", "--duration", "120"]
    assert main([*words, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["ship"], told["manoeuvre"], told["complete"], told["reason"]) == ("kvlcc2_l7", "zigzag", True, None)
    assert told["time"] == pytest.approx(120.0)
    shown = {name: one["value"] for name, one in told["indices"].items()}
    turned = {name: math.degrees(one.value) if one.unit.startswith("rad") else one.value for name, one in run.items()}
    assert shown == pytest.approx(turned, rel=1e-3)
    assert shown["first_overshoot"] == pytest.approx(math.degrees(run["first_overshoot"].value), rel=1e-3)
    assert main(words) == 0
    out = capsys.readouterr().out
    for name, value in shown.items():
        name_shown, figure, unit, *_ = cells(out, name.replace("_", " "))
        assert name_shown == name.replace("_", " ")
        assert float(figure) == pytest.approx(value, rel=0.01)
        assert unit == told["indices"][name]["unit"]


def test_an_index_is_told_in_degrees_with_its_resolution_and_in_ship_lengths() -> None:
    one = Index(math.pi / 6, "rad", resolution=math.pi / 180)
    assert simulation.index_document(one) == {
        "value": pytest.approx(30.0), "unit": "deg", "resolution": pytest.approx(1.0)}  # fmt: skip
    assert simulation.index_document(Index(math.pi, "rad/s")) == {"value": pytest.approx(180.0), "unit": "deg/s"}
    assert simulation.index_document(Index(640.0, "m", 2.0)) == {"value": 640.0, "unit": "m", "over_L": 2.0}


def test_a_figure_has_the_digits_that_it_is_known_to(capsys: Said) -> None:
    """One of resolution 1 shows a tenth, one of 0.01 thousandths; one without five digits."""
    render.show(simulation.indices_shown("kvlcc2", {
        "loop_width": Index(math.radians(3.14159265), "rad", resolution=math.radians(1.0)),
        "loop_height": Index(math.radians(3.14159265), "rad/s", resolution=math.radians(0.01)),
        "advance": Index(1234.5678, "m", 3.8580246),
    }))  # fmt: skip
    out = capsys.readouterr().out
    assert cells(out, "loop width") == ["loop width", "3.1", "deg", "–"]
    assert cells(out, "loop height") == ["loop height", "3.142", "deg/s", "–"]
    assert cells(out, "advance") == ["advance", "1234.6", "m", "3.858"]
    assert cells(out, "kvlcc2") == ["kvlcc2", "value", "unit", "in L_pp"]
    assert len(ends(out, "3.1", "3.142", "1234.6", "value")) == 1
    assert len(ends(out, "3.858", "in L_pp")) == 1


def test_motions_are_told_in_metres_and_degrees(capsys: Said) -> None:
    motion = SimpleNamespace(expected=math.radians(2), found=math.radians(3), greatest=math.radians(10), unit="rad")
    heave = SimpleNamespace(expected=0.5, found=0.25, greatest=1.5, unit="m")
    body = simulation._motions({"roll": motion, "heave": heave})  # type: ignore[dict-item]
    render.show(body)
    out = capsys.readouterr().out
    assert cells(out, "roll") == ["roll", "2", "3", "10", "deg"]
    assert cells(out, "heave") == ["heave", "0.5", "0.25", "1.5", "m"]
    assert document(body) == {"motions": {"roll": vars(motion), "heave": vars(heave)}}
    assert len(ends(out, "2", "0.5")) == len(ends(out, "3", "0.25")) == len(ends(out, "10", "1.5")) == 1


def test_a_run_that_is_not_whole_ends_with_1(capsys: Said) -> None:
    simulation._incomplete(SimpleNamespace(complete=True, reason=None))  # type: ignore[arg-type]
    with pytest.raises(Exit) as ended:
        simulation._incomplete(SimpleNamespace(complete=False, reason="it sank"))  # type: ignore[arg-type]
    assert ended.value.exit_code == 1  # type: ignore[attr-defined]
    assert "error: it sank" in capsys.readouterr().err


@pytest.mark.parametrize(("words", "said"), [
    (["kvlcc2", "turning", "--draws", "9"], "--draws needs --bands"),
    (["kvlcc2", "turning", "--extrapolate"], "--extrapolate needs --bands"),
    (["12", "--from", "x", "--bands", "95"], "a run of a campaign has none"),
    (["12", "turning", "--from", "x"], "name a run alone"),
    (["one", "--from", "x"], "name a run alone"),
    (["kvlcc2"], "name a manoeuvre"),
    (["kvlcc2", "turning", "--bands", "95", "--sea", "1,8,0"], "without waves"),
    (["kvlcc2", "turning", "--bands", "95", "--rao", "x.nc"], "without waves"),
    (["kvlcc2", "turning", "--bands", "95", "--roll-damping", "0.1"], "without waves"),
    (["kvlcc2", "turning", "--bands", "95", "--device", "cuda"], "on the processor"),
])  # fmt: skip
def test_options_that_do_not_go_together_are_told_before_anything_runs(
    words: list[str], said: str, capsys: Said
) -> None:
    assert main(["simulate", *words]) == 2
    assert said in capsys.readouterr().err


def test_a_run_of_a_campaign_is_shown_with_what_it_was_given(monkeypatch: pytest.MonkeyPatch, capsys: Said) -> None:
    ran = SimpleNamespace(ship="kvlcc2", policy=SimpleNamespace(kind="turning"),
                          inputs={"ship.hull.N_r": -0.0123456789}, complete=True, trial=SimpleNamespace(duration=99.0),
                          indices={"advance": Index(64.0, "m", 2.0)})  # fmt: skip
    asked: list[Any] = []
    monkeypatch.setattr("seatrial.workflow.campaigns.replayed", lambda *given: asked.append(given) or ran)
    assert main(["simulate", "7", "--from", "there", "-o", "run.csv"]) == 0
    out = capsys.readouterr().out
    assert asked == [("there", 7, Path("run.csv"))]
    assert cells(out, "ship.hull.N_r") == ["ship.hull.N_r", "-0.0123457"]
    assert cells(out, "advance") == ["advance", "64", "m", "2"]
    assert "kvlcc2, turning, run 7" in out
    assert main(["simulate", "7", "--from", "there", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told == {"case": "kvlcc2", "manoeuvre": "turning", "inputs": ran.inputs, "complete": True, "time": 99.0,
                    "indices": {"advance": {"value": 64.0, "unit": "m", "over_L": 2.0}}}  # fmt: skip


def test_bands_are_shown_from_and_to_in_degrees(capsys: Said) -> None:
    three = tuple(Index(math.radians(x), "rad") for x in (10.0, 8.0, 13.0))
    lengths = tuple(Index(x, "m") for x in (100.0, 90.0, 123456.0))
    assert evidence._index(*three) == {"value": pytest.approx(10), "low": pytest.approx(8), "high": pytest.approx(13),
                                       "unit": "deg"}  # fmt: skip
    banded: Any = SimpleNamespace(
        run=SimpleNamespace(ship=SimpleNamespace(name="mine"), policy=SimpleNamespace(kind="zigzag"), settings={"a": 1},
                            complete=True, reason=None, trial=SimpleNamespace(duration=90.0)),
        sailed=SimpleNamespace(draws=range(40), caveats=("one",),
                               basis=SimpleNamespace(kind="laplace", recordings=0, words="draws")),
        level=0.95, indices={"first_overshoot": three, "advance": lengths}, posterior=SimpleNamespace(digest="d"),
    )  # fmt: skip
    body = evidence.bands_shown(banded)
    told = document(body)
    assert told.pop("indices") == {"first_overshoot": evidence._index(*three), "advance": evidence._index(*lengths)}
    assert told == {"ship": "mine", "manoeuvre": "zigzag", "settings": {"a": 1}, "complete": True, "reason": None,
                    "time": 90.0, "level": 0.95, "draws": 40, "caveats": ["one"], "fit": "d",
                    "basis": {"kind": "laplace", "recordings": None, "words": "draws"}}  # fmt: skip
    render.show(body)
    out = capsys.readouterr().out
    assert cells(out, "first overshoot") == ["first overshoot", "10", "8", "13", "deg"]
    assert cells(out, "advance") == ["advance", "100", "90", "1.2346e+05", "m"]
    assert cells(out, "mine") == ["mine, zigzag", "value", "from", "to", "unit"]
    assert "from, to: 95 % of 40 draws" in out
    assert len(ends(out, "10", "100")) == len(ends(out, "8", "90")) == len(ends(out, "13", "1.2346e+05")) == 1


# steer, range, bench


def steered(**more: Any) -> Any:
    counts = {"sent": 200, "unsent": 0} | more
    plant = type("Plant", (dict,), {"ship": SimpleNamespace(name="kvlcc2")})(psi=math.radians(-30.0))
    report = SimpleNamespace(t=120.0, overruns=3, ticks=1200, worst_late=0.25, events={"lost": 1})
    return SimpleNamespace(
        plant=plant, state={"x": 1.5},
        stage=SimpleNamespace(
            loop=SimpleNamespace(report=report),
            on_wire=SimpleNamespace(conning=SimpleNamespace(commander="me", mode="heading", counts={"taken": 4}),
                                    wire=SimpleNamespace(counts=counts, address="udp://x"))),
        written=(Path("run.csv"),),
    )  # fmt: skip


def test_a_voyage_on_the_wire_is_summed_up(capsys: Said) -> None:
    render.answer(simulation._summary(steered()), json=False)
    assert capsys.readouterr().out == ("120 s sailed, heading 330.0 deg, 4 orders taken, 200 datagrams sent, "
                                       "3 of 1200 ticks late\nrun.csv\n")  # fmt: skip
    body = simulation._summary(steered(unsent=7))
    render.answer(body, json=False)
    assert "200 datagrams sent, 7 not sent, 3 of 1200 ticks late" in capsys.readouterr().out
    render.answer(body, json=True)
    assert json.loads(capsys.readouterr().out) == {
        "ship": "kvlcc2", "address": "udp://x", "t": 120.0, "state": {"x": 1.5}, "commander": "me", "mode": "heading",
        "orders": {"taken": 4}, "wire": {"sent": 200, "unsent": 7}, "overruns": 3, "worst_late": 0.25,
        "events": {"lost": 1}, "written": ["run.csv"],
    }  # fmt: skip


def test_a_scenario_is_shown_by_ships_and_criteria(capsys: Said) -> None:
    ran: Any = SimpleNamespace(stage=SimpleNamespace(scenario=SimpleNamespace(title="a crossing")), written=("a.csv",))
    found: dict[str, Any] = {
        "indices": {"passing": {"other": {"distance": 1234.567, "at": 98.7654321, "time_in_hand": 55.5555,
                                            "role": "give way", "rules": {"8": 0.2, "15": -0.1}}},
                    "cross_track_max": 12.345},
        "criteria": [{"name": "least_distance", "ship": "other", "value": 1234.567, "limit": 500.0, "unit": "m",
                      "met": True},
                     {"name": "arrival", "ship": None, "value": None, "limit": 60.0, "unit": "s", "met": False}],
        "arrived": None, "time": 300.04, "wire": None,
    }  # fmt: skip
    render.show(simulation._judged(ran, found))
    out = capsys.readouterr().out
    assert cells(out, "other") == ["other", "1234.6", "98.765", "55.56", "give way", "15"]
    assert cells(out, "least distance") == ["least distance", "other", "1234.6", "500", "m", "met"]
    assert cells(out, "arrival") == ["arrival", "–", "60", "s", "not met"]
    assert "a crossing: ended after 300.0 s, at most 12.3 m off the route\na.csv" in out
    assert len(ends(out, "500", "60")) == len(ends(out, "98.765", "after s")) == 1
    assert len(ends(out, "55.56", "time in hand s")) == len(ends(out, "passes at m", "1234.6")) == 1
    found |= {"arrived": 250.0, "criteria": []}
    found["indices"]["passing"] = {}
    render.show(simulation._judged(ran, found))
    out = capsys.readouterr().out
    assert out.startswith("a crossing: arrived after 250.0 s")
    assert "nobody steered" not in out
    for orders, silent in (({"unfit": 3}, True), ({"taken": 1}, False)):
        render.show(simulation._judged(ran, found | {"wire": {"orders": orders, "counts": {"sentences": 301}}}))
        out = capsys.readouterr().out
        assert ("nobody steered: no order was taken of 301 sentences heard; orders are ROR, HTC," in out) == silent


@pytest.mark.parametrize("met", [True, False])
def test_a_range_names_what_was_not_met(met: bool, monkeypatch: pytest.MonkeyPatch, capsys: Said) -> None:
    judged = (Judged("least_distance", 1.0, 2.0, "m", met, "other"), Judged("arrival", None, 1.0, "s", met),
              Judged("speed", 1.0, 2.0, "m/s", True))  # fmt: skip
    ran = Voyage(cast("Any", None), {}, judged, (), None)
    monkeypatch.setattr(Voyage, "document", lambda self: {"met": self.met})
    monkeypatch.setattr("seatrial.workflow.afloat.sail", lambda *_, **__: ran)
    monkeypatch.setattr(simulation, "_judged", lambda ran, document: fields(document))
    assert main(["range", "x.toml", "--json"]) == (0 if met else 1)
    said = capsys.readouterr()
    assert json.loads(said.out) == {"met": met}
    assert said.err == ("" if met else "error: not met: least_distance of other, arrival\n")


@pytest.mark.parametrize(("seconds", "shown"), [
    (2.5e-10, "0.25 ns"), (1.5e-9, "1.5 ns"), (2e-7, "200 ns"), (1.234e-5, "12.3 us"), (2e-3, "2 ms"), (0.5, "500 ms"),
    (3.0, "3 s"), (5000.0, "5e+03 s"),
])  # fmt: skip
def test_a_time_has_three_digits_and_its_unit(seconds: float, shown: str) -> None:
    assert simulation._time(seconds) == shown


def test_peers_are_shown_by_ratio(capsys: Said) -> None:
    render.show(simulation._times({
        "rows": [{"peer": "a", "what": "one step", "ours_s": 2e-9, "theirs_s": 3e-6, "ratio": 1500.0},
                 {"peer": "b", "what": "many", "ours_s": 0.02, "theirs_s": 3.0, "ratio": 150.0}],
        "not_installed": [], "control_loop_ms": 5.04, "slowest_control_loop_ms": 6.06, "machine": "2 cores",
        "busy": False,
    }))  # fmt: skip
    out, err = capsys.readouterr()
    assert cells(out, "a") == ["a", "one step", "2 ns", "3 us", "1.5e+03 x"]
    assert out.endswith("2 cores; Python control loop 5.0 to 6.1 ms\n")
    assert len(ends(out, "2 ns", "20 ms", "ours")) == len(ends(out, "3 us", "3 s")) == 1
    assert len(ends(out, "1.5e+03 x", "150 x", "ratio")) == 1
    assert err == ""


# ships


@pytest.mark.slow
def test_ships_are_listed_with_length_speed_and_count(capsys: Said) -> None:
    assert main(["ships", "--json"]) == 0
    told = {one["name"]: one for one in json.loads(capsys.readouterr().out)["ships"]}
    assert list(told) == list(library())
    assert (told["kvlcc2"]["L_pp"], told["kvlcc2"]["family"]) == (320.0, "Mmg")
    assert told["kvlcc2"]["speed"] == pytest.approx(15.5 * 1852 / 3600, rel=1e-3)
    assert told["kvlcc2"]["parameters"] == len(list(walk(load("kvlcc2").model)))
    assert main(["ships"]) == 0
    out, err = capsys.readouterr()
    assert cells(out, "kvlcc2_l7")[2:5] == ["7", "1.179", "Mmg"]
    assert cells(out, "kvlcc2_l7")[5].startswith("measured: ")
    assert cells(out, "mariner_nomoto")[5].startswith("unverified")
    assert len(ends(out, "1.179", "U [m/s]")) == len(ends(out, "L_pp [m]", "320")) == 1
    assert "further parameter sets" in err
    assert main(["ships", "-o", "x.html"]) == 2
    assert main(["ships", "--check", "-x"]) == 2


@pytest.mark.parametrize(("fit", "status"), [(True, 0), (False, 1)])
def test_a_ship_file_that_is_not_fit_ends_with_1(fit: bool, status: int, monkeypatch: Any, capsys: Said) -> None:
    held = SimpleNamespace(state="measured", why="a trial", told="1 figure")
    checked = SimpleNamespace(fit=fit, ship=load("kvlcc2"), standing=held, findings=[
        SimpleNamespace(what="sources", state="ok", detail="all 40")])  # fmt: skip
    monkeypatch.setattr("seatrial.workflow.contributing.ship_check.check_ship_file", lambda *_, **__: checked)
    assert main(["ships", "--check", "x.toml", "--json"]) == status
    assert json.loads(capsys.readouterr().out) == {
        "ship": "kvlcc2", "state": "measured", "held_against": "a trial", "fit": fit,
        "findings": [{"check": "sources", "state": "ok", "found": "all 40"}]}  # fmt: skip
    assert main(["ships", "--check", "x.toml"]) == status
    assert cells(capsys.readouterr().out, "sources") == ["sources", "ok", "all 40"]


@pytest.mark.slow
def test_a_ship_is_shown_with_every_value_and_where_it_is_from(capsys: Said) -> None:
    ship = load("kvlcc2_l7")
    assert main(["show", "kvlcc2_l7"]) == 0
    out = capsys.readouterr().out
    for path, meaning, value in walk(ship.model):
        row = cells(out, f"{path} ")
        assert row[:2] == [path, f"{value:.6g}"]
        assert meaning.about.split()[0] in row[-1]
    assert len(ends(out, "3270", "10014.4", "value")) == 1
    assert main(["show", "kvlcc2_l7", "--sources"]) == 0
    out = capsys.readouterr().out
    assert "yasukawa2015" in cells(out, "body.L_pp")[-1]
    assert cells(out, "hull.X_0 ")[-1] == "default" if "hull.X_0 " in out else True
    assert main(["show", "kvlcc2_l7", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert "network" not in told
    assert (told["parameters"]["hull.N_r"]["given"], told["parameters"]["hull.N_r"]["prime"]) == (-0.049, True)
    assert told["parameters"]["body.m"]["value"] == 3270.0
    assert told["parameters"]["body.m"]["unit"] == "kg"
    assert ships._origin(None) == {"source": None}


def test_a_network_is_shown_by_its_form(capsys: Said) -> None:
    net = load("esso_osaka_3m_network").model.learned
    assert net is not None
    assert main(["show", "esso_osaka_3m_network", "--json"]) == 0
    form = json.loads(capsys.readouterr().out)["network"]
    sizes = sum(value.size for value in net.weights.values())
    assert (form["layers"], form["memory"], form["weights"]) == (list(net.layers), net.memory, sizes)
    assert form["sha256"] == net.digest
    assert len(form["sha256"]) >= 40
    assert main(["show", "esso_osaka_3m_network"]) == 0
    assert f"network: kind {net.kind}" in capsys.readouterr().err


@pytest.mark.slow
def test_a_scaled_ship_is_shown_before_and_after(tmp_path: Path, capsys: Said) -> None:
    """By Froude's law the speed goes with the root of the length; friction by the ITTC line of 1957."""
    words = ["scale", "kvlcc2_l7", "--to-length", "320"]
    assert main([*words, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["L_pp"] == 320.0
    assert told["speed"] == pytest.approx(1.179 * math.sqrt(320 / 7))
    for side in ("before", "after"):
        one = told["friction"][side]
        assert one["C_F"] == pytest.approx(0.075 / (math.log10(one["Re"]) - 2) ** 2)
    assert main(words) == 0
    out = capsys.readouterr().out
    f = told["friction"]
    assert cells(out, "Reynolds")[1:3] == [f"{f['before']['Re']:.4g}", f"{f['after']['Re']:.4g}"]
    assert cells(out, "C_F")[1:3] == [f"{f['before']['C_F']:.4g}", f"{f['after']['C_F']:.4g}"]
    for path, effect in told["effects"].items():
        assert cells(out, f"{path} ")[1:3] == [f"{effect['before']:.4g}", f"{effect['after']:.4g}"]
    n = told["self_propulsion"]
    assert cells(out, "n_P [1/s]")[1:3] == [f"{n['before']['n_P']:.4g}", f"{n['after']['n_P']:.4g}"]
    assert cells(out, "thrust'")[1:3] == [f"{n[side]['thrust']:.4g}" for side in ("before", "after")]
    assert cells(out, "rudder force")[1:3] == [f"{n[side]['rudder']:.4g}" for side in ("before", "after")]
    for side in ("before", "after"):
        assert len(ends(out, side, f"{f[side]['Re']:.4g}", f"{f[side]['C_F']:.4g}")) == 1
    assert main([*words, "--froude"]) == 0
    said = capsys.readouterr()
    assert said.out == ""
    assert f"L_pp 320 m, {told['speed']:g} m/s, by Froude's law alone" in said.err


def test_a_ship_with_roll_shows_what_is_new_in_it(capsys: Said) -> None:
    assert main(["roll", "kvlcc2_l7", "--gm", "0.125", "--kg", "0.4", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["parameters"]["roll.GM"]["value"] == 0.125
    assert (told["of"], told["file"]) == ("kvlcc2_l7", None)
    assert all(path.startswith("roll.") for path in told["parameters"])
    assert main(["roll", "kvlcc2_l7", "--gm", "0.125", "--kg", "0.4"]) == 0
    out = capsys.readouterr().out
    assert cells(out, "roll.GM")[1:3] == ["0.125", "m"]
    assert len(ends(out, *(f"{one['value']:.4g}" for one in list(told["parameters"].values())[:3]))) == 1


def number(**given: Any) -> Any:
    usual = {"path": "hull.N_r", "value": -0.0491234, "unit": "N m s", "formula": "clarke1983", "outside": (),
             "basis": "table", "others": {"inoue1981": -0.0512345}, "spread": 0.123456, "sigma": 0.00987654,
             "share": 0.2, "sigma_from": "ships of the library"}  # fmt: skip
    return SimpleNamespace(**usual | given)


def test_an_estimate_is_a_line_a_number_and_json_has_its_range_and_rivals() -> None:
    assert ships._row(number()) == ("hull.N_r", "-0.04912", "N m s", "clarke1983", "20%")
    assert ships._row(number(unit="", share=None)) == ("hull.N_r", "-0.04912", "–", "clarke1983", "–")
    said = ships._document(number(), "here")
    assert (said["in_range"], said["others"], said["relative_sigma"]) == (True, {"inoue1981": -0.0512345}, 0.2)
    assert ships._document(number(outside=("C_b",)), "here")["in_range"] is False


@pytest.mark.slow
def test_an_estimate_fits_a_screen_of_80_columns(tmp_path: Path, capsys: Said) -> None:
    particulars = Path(__file__).parents[2] / "examples" / "particulars" / "kvlcc2.toml"
    assert main(["estimate", str(particulars), "-o", str(tmp_path / "ship.toml")]) == 0
    out, told = capsys.readouterr()
    lines = out.splitlines()
    assert len(lines) + len(told.splitlines()) <= 60
    assert all(len(line.rstrip()) <= 80 for line in lines)


# models, design, imo


def test_a_span_of_numbers_is_shown_once_where_both_ends_are_one() -> None:
    assert [judging._span(pair) for pair in (None, (3, 3), (3, 40.5))] == ["–", "3", "3-40.5"]


def test_controls_of_many_ships_are_told_by_kind() -> None:
    def shown(*controls: str) -> str:
        return judging._controls(SimpleNamespace(controls=controls))  # type: ignore[arg-type]

    assert shown("n_P", "delta") == "n_P, delta"
    assert shown("n_1", "n_2", "alpha_1", "delta") == "n_*, alpha_*, delta"
    assert shown() == "–"


def test_items_that_a_family_cannot_meet_are_listed() -> None:
    def shown(items: tuple[int, ...], part: tuple[int, ...]) -> str:
        return judging._numbers(SimpleNamespace(items=items, in_part=part))  # type: ignore[arg-type]

    assert [shown((), ()), shown((1, 4), ()), shown((), (2,)), shown((1,), (2, 3))] == [
        "–", "1, 4", "(partly 2)", "1 (partly 2, 3)"]  # fmt: skip


def family(key: str, ship: str | None, lines: tuple[str, ...], **more: Any) -> Any:
    about = SimpleNamespace(key=key, name=key.title(), form="x' = f", classes=(key,), routes=("fit",), next=lines)
    usual = {"family": about, "ships": (ship,) if ship else (), "controls": ("delta",), "environment": (),
             "outputs": ("r",), "coefficients": (2, 5), "length": None, "cost": 12.345,
             "answer": lambda keys: "planned" if "planned" in keys else "yes"}  # fmt: skip
    return SimpleNamespace(**usual | more)


def test_a_family_has_a_row(capsys: Said) -> None:
    row = judging._row(family("nomoto", "zeefakkel", ()))
    assert row == ("nomoto: Nomoto", "x' = f", "delta", "–", "r", "2-5", "–", "fit", "12", "zeefakkel")
    assert judging._row(family("nomoto", None, (), environment=("wind",), outputs=()))[3:5] == ("wind", "–")
    assert judging._row(family("nomoto", None, ()))[-1] == "none yet; probed on a specimen"
    none = family("nomoto", None, ())
    none.family.classes = ()
    assert judging._row(none)[-1] == "planned"
    assert judging._cell(none, ("a",)) == "–"
    assert judging._cell(family("a", None, ()), ()) == "any"
    assert judging._cell(family("a", None, ()), ("turns",)) == "yes"
    assert judging._cell(family("a", None, ()), ("planned",)) == "–"


def test_the_next_commands_are_of_the_best_three_each_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("seatrial.choosing.purposes.fittest", lambda purpose, f: f.ships[0])
    best = [family(name, ship, lines) for name, ship, lines in (
        ("a", None, ("one", "two")), ("b", "kcs", ("two",)), ("c", "suzaku", ()), ("d", "mariner", ("four",)),
    )]  # fmt: skip
    advice: Any = [SimpleNamespace(assessment=one) for one in best]
    purpose: Any = SimpleNamespace(check="seatrial imo {ship}")
    assert judging._next(purpose, advice) == ["one", "two", "seatrial imo kcs"]


def test_a_design_is_shown_by_what_each_manoeuvre_adds(capsys: Said) -> None:
    free = SimpleNamespace(path="hull.N_r", start=-0.0491234)
    verdicts = [SimpleNamespace(subject="hull.N_r", status="identified", text="well"),
                SimpleNamespace(subject="a and b", status="open", text="only together")]  # fmt: skip
    plan: Any = SimpleNamespace(
        chosen=(("zigzag", 12.3456, 7.891), ("turning", 3.0, 1.5)), length=15.3456, log_det=9.391, free=(free,),
        sigma=np.array([0.0123]), share=np.array([0.876]), verdicts=tuple(verdicts), left_out=("spiral: too long",),
    )  # fmt: skip
    render.show(judging._planned("mine", plan))
    out = capsys.readouterr().out
    assert cells(out, "zigzag") == ["zigzag", "12.35", "7.891"]
    assert cells(out, "together") == ["together", "15.35", "9.391"]
    assert cells(out, "hull.N_r") == ["hull.N_r", "-0.04912", "0.012", "88%", "identified"]
    assert "a and b: only together" in out
    assert "hull.N_r: well" not in out
    assert len(ends(out, "12.35", "3", "15.35")) == len(ends(out, "7.891", "1.5", "9.391")) == 1
    assert len(ends(out, "-0.04912", "value")) == len(ends(out, "0.012", "expected +-")) == 1
    told = judging._plan_document(plan)
    assert told["parameters"] == {"hull.N_r": {"value": free.start, "sigma": 0.0123, "removed": 0.876,
                                               "status": "identified"}}  # fmt: skip
    assert told["open"] == [{"combination": "a and b", "text": "only together"}]
    assert told["manoeuvres"][1] == {"name": "turning", "length": 3.0, "gain": 1.5}
    assert (told["length"], told["log_det"], told["left_out"]) == (15.3456, 9.391, ("spiral: too long",))


def test_the_published_designs_and_the_families_are_shown_with_numbers_to_the_right(
    monkeypatch: pytest.MonkeyPatch, capsys: Said
) -> None:
    from seatrial.choosing import CAPABILITIES
    from seatrial.identify.design.excitation import TABLE_1

    plan: Any = SimpleNamespace(
        chosen=(), length=0.0, log_det=0.0, free=(), sigma=(), share=(), verdicts=(), left_out=()
    )
    render.show(judging._planned("mine", plan))
    out = capsys.readouterr().out
    numbers = [", ".join(map(str, one.parameters)) for one in TABLE_1]
    lines = [
        next(line for line in out.splitlines() if line.strip().startswith(f"[{one.reference}] ")) for one in TABLE_1
    ]
    head = next(line for line in out.splitlines() if "Sawada 2024 Table 1" in line)
    at = head.index("parameters") + len("parameters")
    assert all(line[:at].endswith(text) for line, text in zip(lines, numbers, strict=True))
    assert len({len(line.rstrip()) for line in (head, *lines)}) == 1  # T' is the last, to the right

    findings = {one.key: SimpleNamespace(answer="yes") for one in CAPABILITIES}
    small = family("nomoto", "zeefakkel", (), findings=findings, coefficients=(2, 2), cost=3.0, length=(1.0, 2.0))
    large = family("mmg", "kvlcc2", (), findings=findings, coefficients=(40, 1234), cost=123.0, length=(10.0, 2000.0))
    monkeypatch.setattr(judging, "_document", lambda one: {"family": one.family.key})
    render.show(judging._families((small, large)))
    out = capsys.readouterr().out
    head, one, other = (
        next(line for line in out.splitlines() if word in line) for word in ("equation", "zeefakkel", "kvlcc2")
    )
    for name, first, second in (("numbers", "2", "40-1234"), ("T'", "1-2", "10-2000"), ("ns", "3", "1.2e+02")):
        at = head.index(name) + len(name)
        width = max(len(name), len(first), len(second))
        assert one[: one.rindex(first, at - width, at + width) + len(first)].endswith(first)
        assert other.rindex(second) + len(second) == one.rindex(first, 0, other.rindex(second) + len(second) + 1) + len(
            first
        )
    assert re.search(r"nomoto +mmg", out)


def test_foreseen_bands_are_shown_before_and_after(monkeypatch: pytest.MonkeyPatch, capsys: Said) -> None:
    one = SimpleNamespace(name="advance", unit="L", value=3.14159, before=(2.0, 4.5), after=(3.0, 3.25), share=0.1)
    bare = SimpleNamespace(name="reach", unit="L", value=12.5, before=(math.nan, 4.5), after=(math.nan, 3.2),
                           share=math.nan)  # fmt: skip
    monkeypatch.setattr("seatrial.workflow.evidence.designed.document", lambda found, level: {"level": level})
    body = judging._foreseen([one, bare], 95.0)  # type: ignore[list-item]
    assert document(body) == {"bands": {"level": 95.0}}
    render.show(body)
    out = capsys.readouterr().out
    assert cells(out, "advance") == ["advance", "L", "3.142", "2", "4.5", "3", "3.25", "10%"]
    assert cells(out, "reach") == ["reach", "L", "12.5", "–", "4.5", "–", "3.2", "–"]
    assert len(ends(out, "10%", "width left")) == len(ends(out, "3.142", "12.5")) == 1
    assert "bands of 95 %" in out


# data


def test_trials_are_counted(monkeypatch: pytest.MonkeyPatch, capsys: Said) -> None:
    for files, count in ((["a"], "1 trial in"), (["a", "b"], "2 trials in"), ([], "0 trials in")):
        made = Imported(tuple(map(Path, files)), {}, {}, {one: {"heading": "psi: HEHDT"} for one in files}, {},
                        {one: {"GSA": 2} for one in files})  # fmt: skip
        monkeypatch.setattr("seatrial.workflow.data.import_logs", lambda *_, made=made: made)
        assert main(["import", "csv", "logs", "-o", "out"]) == 0
        *shown, last = capsys.readouterr().out.splitlines()
        assert last.startswith(count)
        rows = [row.split() for row in shown if row.strip()]
        assert (["heading", "all", "psi:", "HEHDT"] in rows) == bool(files)
        assert (["depth", "all", "not", "found"] in rows) == bool(files)
        assert (["ignored:", str(2 * len(files)), "GSA"] in rows) == bool(files)


def guessed(**given: Any) -> Any:
    return SimpleNamespace(
        **{"format": "csv", "text": "schema\n", "notes": ("read 3 logs",), "doubts": ("x", "y"), "asks": ("sign",)}
        | given
    )


def test_a_guess_is_shown_or_written_with_its_doubts(monkeypatch: pytest.MonkeyPatch, capsys: Said) -> None:
    found = guessed()
    monkeypatch.setattr("seatrial.workflow.data.guess_mapping", lambda *_: found)
    assert main(["import", "--guess", "logs"]) == 0
    assert capsys.readouterr() == ("schema\n", "read 3 logs\n")
    assert main(["import", "--guess", "logs", "-o", "m.toml"]) == 0
    out, err = capsys.readouterr()
    assert out == ("m.toml: 2 doubts; answer sign in it, then: seatrial import csv logs --mapping m.toml -o trials\n")
    assert err == "read 3 logs\ndoubt: x\ndoubt: y\n"
    found.doubts, found.asks = ("x",), ()
    assert main(["import", "--guess", "logs", "-o", "m.toml"]) == 0
    assert "m.toml: 1 doubt; read it, then: seatrial" in capsys.readouterr().out
    assert main(["import", "--guess", "logs", "-o", "m.toml", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["file"] == "m.toml"
    found.text = ""
    assert main(["import", "--guess", "logs", "-o", "m.toml"]) == 0
    assert capsys.readouterr().out == ""
    assert main(["import", "--guess", "logs", "-o", "m.toml", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["file"] is None


@pytest.mark.parametrize(("words", "work"), [
    (["resample", "a.csv", "--dt", "0.5", "-o", "out"], "resample"),
    (["mend", "a.csv", "--by", "s.toml", "-o", "out"], "mend"),
    (["convert", "a.csv", "--to", "mcap", "-o", "out"], "convert"),
])  # fmt: skip
def test_what_was_written_is_listed(words: list[str], work: str, monkeypatch: Any, capsys: Said) -> None:
    monkeypatch.setattr(f"seatrial.workflow.data.{work}", lambda *_: [Path("out/a"), Path("out/b")])
    assert main(words) == 0
    assert capsys.readouterr().out == "out/a\nout/b\n"
    assert main([*words, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["written"] == ["out/a", "out/b"]


def test_a_thrust_map_has_a_row_a_thruster(monkeypatch: pytest.MonkeyPatch, capsys: Said) -> None:
    from dataclasses import dataclass

    @dataclass(frozen=True)
    class Map:
        name: str
        n_low: float
        n_max: float
        R2: float
        rmse: float
        coefficients: Any
        powers = (1, 2)
        sigma = (0.1, 0.2)

    maps = (Map("port", -5.0, 12.5, 0.987654321, 0.123456, (1.23456789, 2.0)), Map("bow", 0.0, 9.0, 1.0, 12.0, (3.0,)))
    monkeypatch.setattr("seatrial.workflow.plant.thrust_map", lambda *_: maps)
    assert main(["thrust-map", "t.csv"]) == 0
    out = capsys.readouterr().out
    assert cells(out, "port") == ["port", "n^1 n^2", "-5 to 12.5", "0.98765", "0.123", "1.2346", "2"]
    assert cells(out, "thruster")[-2:] == ["c_4", "c_5"]
    assert len(ends(out, "0.98765", "1.00000", "R^2")) == len(ends(out, "rmse [N]", "12")) == 1
    assert len(ends(out, "1.2346", "3", "c_0")) == len(ends(out, "2", "c_1")) == 1
    assert main(["thrust-map", "t.csv", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)["thrusters"]["port"]
    assert (told["powers"], told["sigma"], told["n_max"]) == ([1, 2], [0.1, 0.2], 12.5)
    assert "name" not in told


def test_a_servo_is_shown_in_degrees_with_its_spread(monkeypatch: pytest.MonkeyPatch, capsys: Said) -> None:
    def fitted(control: str, rate: float, **given: Any) -> Any:
        servo = SimpleNamespace(rate=rate, lag=2.0, dead_time=0.5)
        usual = {"control": control, "servo": servo, "offset": math.radians(1.5), "rmse": math.radians(0.25),
                 "R2": 0.998765, "samples": 601, "sigma": {"rate": math.radians(0.1), "lag": 0.05,
                                                           "offset": math.radians(0.02)}}  # fmt: skip
        return SimpleNamespace(**usual | given)

    found = (fitted("delta", math.radians(3.0)), fitted("alpha_1", math.radians(9.0), samples=12, R2=1.0))
    read = [SimpleNamespace(name="a")]
    monkeypatch.setattr("seatrial.workflow.plant.servo", lambda *_: (read, found))
    assert main(["servo", "a.csv"]) == 0
    out = capsys.readouterr().out
    assert cells(out, "delta") == ["delta", "3 ± 0.1", "2 ± 0.05", "–", "1.5 ± 0.02", "0.25", "0.99877", "601"]
    assert len(ends(out, "601", "12", "samples")) == len(ends(out, "0.99877", "1.00000", "R^2")) == 1
    assert main(["servo", "a.csv", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["trials"] == ["a"]
    assert told["servos"]["delta"]["rate"] == pytest.approx(math.radians(3.0))
    assert told["servos"]["delta"]["samples"] == 601
    assert not {"control", "servo"} & set(told["servos"]["delta"])


# campaigns


@pytest.mark.parametrize(("words", "said"), [
    (["--status", "--verify"], "--status and --verify: give one"), (["--merge", "--rare", "a"], "--merge and --rare"),
    (["--report", "--status"], "--status and --report"), (["--status", "--device", "cpu"], "--device is for the run"),
    (["--device", "cpu"], "--device is for the run"), (["--runs", "9", "-o", "x"], "--runs is for --rare"),
    ([], "with -o DIR"),
    (["--rare", "a", "-o", "s3://x/y"], "a folder of this machine"),
])  # fmt: skip
def test_requests_of_a_campaign_that_do_not_go_together(words: list[str], said: str, capsys: Said) -> None:
    assert main(["campaign", "there", *words]) == 2
    assert said in capsys.readouterr().err


def test_how_far_a_campaign_is(monkeypatch: pytest.MonkeyPatch, capsys: Said) -> None:
    manifest = SimpleNamespace(name="many", rows=100, tracks=SimpleNamespace(every=5, columns=("x", "y")))
    found = SimpleNamespace(held=SimpleNamespace(manifest=manifest, parts=8), done=3, digest="abc", faults=(),
                            document={"done": 3})  # fmt: skip
    monkeypatch.setattr("seatrial.workflow.campaigns.status", lambda *_, **__: found)
    assert main(["campaign", "there", "--status"]) == 0
    assert capsys.readouterr().out == ("many: 3 of 8 parts of 100 runs are done\ntracks of each run, every 5 samples: "
                                       "x, y\ndigest abc\n")  # fmt: skip
    assert main(["campaign", "there", "--status", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"done": 3}
    manifest.tracks = None
    found.faults, found.digest = ("part 2 is short",), ""
    assert main(["campaign", "there", "--verify"]) == 1
    assert capsys.readouterr() == ("many: 3 of 8 parts of 100 runs are done\n", "error: part 2 is short\n")


def test_what_a_campaign_wrote(monkeypatch: pytest.MonkeyPatch, capsys: Said) -> None:
    monkeypatch.setattr("seatrial.workflow.campaigns.merged", lambda *_: (Path("a.parquet"), Path("t.parquet")))
    monkeypatch.setattr("seatrial.workflow.campaigns.analysing.report", lambda *_: Path("a.html"))
    for flag, written in (("--merge", {"file": "a.parquet", "tracks": "t.parquet"}), ("--report", {"file": "a.html"})):
        assert main(["campaign", "there", flag]) == 0
        assert capsys.readouterr().out == "".join(f"wrote {path}\n" for path in written.values())
        assert main(["campaign", "there", flag, "--json"]) == 0
        assert json.loads(capsys.readouterr().out) == written


def test_a_campaign_tells_its_rate_and_what_is_left(monkeypatch: pytest.MonkeyPatch, capsys: Said) -> None:
    ran = SimpleNamespace(runs=1200, seconds=4.0, parts=8, held=SimpleNamespace(missing=(1, 2)))
    monkeypatch.setattr("seatrial.workflow.campaigns.campaign", lambda *_, **__: ran)
    assert main(["campaign", "c.toml", "-o", "out"]) == 0
    assert capsys.readouterr().out == "1200 runs in 4.0 s (300 a second); 2 parts are left; out\n"
    assert main(["campaign", "c.toml", "-o", "out", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"folder": "out", "parts": 8, "runs": 1200, "seconds": 4.0,
                                                   "missing": 2}  # fmt: skip
    ran.seconds = 0.0
    assert main(["campaign", "c.toml", "-o", "out"]) == 0
    assert "(0 a second)" in capsys.readouterr().out


def test_a_rare_violation_is_told_with_its_interval(monkeypatch: pytest.MonkeyPatch, capsys: Said) -> None:
    at = SimpleNamespace(probability=1.2345e-4, interval=(1e-4, 1.6e-4), variation=0.123)
    one = SimpleNamespace(case="calm", estimate=at, reached=True, runs=3000, run=17, unknown=0.034)
    other = SimpleNamespace(case="storm", estimate=at, reached=False, runs=500, run=None, unknown=0.0)
    monkeypatch.setattr("seatrial.workflow.campaigns.analysing.rare",
                        lambda *_, **__: SimpleNamespace(cases=(one, other), document={}))  # fmt: skip
    assert main(["campaign", "c.toml", "-o", "out", "--rare", "far"]) == 0
    out, err = capsys.readouterr()
    assert out.splitlines() == [
        "calm: far is violated with probability 0.000123 (0.0001 to 0.00016, 95 %; coefficient of variation 0.12), "
        "3000 runs",
        "a likely violation: seatrial simulate --from out 17; out/report.html",
        "storm: no tenth of a level violates far down to 1.2e-04, 500 runs",
    ]
    assert "3.4% of the last level" in err


def test_progress_of_a_campaign_says_what_is_left(monkeypatch: pytest.MonkeyPatch, capsys: Said) -> None:
    """3 of 8 parts in 30 s leave 50 s; off a terminal it is a line in ten seconds."""
    now = [100.0]
    monkeypatch.setattr(campaign.time, "monotonic", lambda: now[0])
    told: list[str] = []
    campaign._Progress(told.append)(3, 8, 600, 30.0)
    assert told == ["3 of 8 parts, 20 runs a second, 50 s left"]
    quiet = campaign._Progress(None)
    for later, said in ((5.0, False), (10.5, True), (15.0, False), (20.0, False), (21.0, True)):
        now[0] = 100.0 + later
        quiet(4, 8, 10, 2.0)
        assert capsys.readouterr().err == ("4 of 8 parts, 5 runs a second, 2 s left\n" if said else "")
    campaign._Progress(told.append)(1, 2, 0, 0.0)
    assert told[-1] == "1 of 2 parts, 0 runs a second, 0 s left"


# fits


def test_an_outcome_is_shown_block_by_block_and_its_errors_end_it_with_1(capsys: Said) -> None:
    table = Table(("what", "number"), (("long name", "1"), ("b", "22.5")))
    outcome = Outcome(None, fields({"a": 1.0}, (Line("a line"), table)), ("it failed",))
    with pytest.raises(Exit) as ended:
        fits.end(outcome, json=False)
    assert ended.value.exit_code == 1
    out, err = capsys.readouterr()
    assert out.startswith("a line\n")
    assert cells(out, "b") == ["b", "22.5"]
    assert len(ends(out, "1", "22.5", "number")) == 1
    assert err == "error: it failed\n"
    fits.end(Outcome(None, fields({"a": 1.0}, (Line("a line"),))), json=True)
    assert json.loads(capsys.readouterr().out) == {"a": 1.0}


def test_a_port_is_of_the_page() -> None:
    asked = (Serving(page=True), Serving(0, True), Serving(9000, True), Serving())
    assert [fits.port_of(one, fits.PORT) for one in asked] == [fits.PORT, 0, 9000, None]
    with pytest.raises(RequestError, match="--port 9000 is of the page"):
        fits.port_of(Serving(9000, False), fits.PORT)


def test_progress_in_words_is_seldom_off_a_terminal(monkeypatch: pytest.MonkeyPatch, capsys: Said) -> None:
    """The first row, each tenth after a second, and any after ten."""
    now = [50.0]
    monkeypatch.setattr(fits.time, "monotonic", lambda: now[0])
    words, told = fits.Words(None, "calm"), []
    for later, row in (
        (0.0, 1),
        (0.1, 2),
        (0.5, 10),
        (3.0, 11),
        (3.5, 20),
        (4.0, 30),
        (5.0, 40),
        (14.9, 41),
        (15.0, 42),
    ):
        now[0] = 50.0 + later
        words(row, 0.123456789, 0.5 if row == 1 else math.nan)
        told += [row] if (said := capsys.readouterr().err) else []
        assert not said or said == (f"calm: iteration {row}: objective 0.123457"
                                    + (", validation 0.5\n" if row == 1 else "\n"))  # fmt: skip
    assert told == [1, 20, 40, 42]
    lines: list[str] = []
    moving = fits.Words(lines.append)
    for row in (7, 8):
        moving(row, 2.0, math.nan)
    moving.stage("compiling")
    assert lines == ["iteration 7: objective 2", "iteration 8: objective 2", "compiling"]


def test_fits_side_by_side_share_one_silence(monkeypatch: pytest.MonkeyPatch, capsys: Said) -> None:
    monkeypatch.setattr(fits.time, "monotonic", lambda: 50.0)
    words, problem = fits.Words(None), SimpleNamespace()
    first, second = (words.part(name, problem) for name in ("a", "b"))  # type: ignore[arg-type]
    first(10, 1.0, math.nan)
    second(10, 1.0, math.nan)
    assert capsys.readouterr().err == "a: iteration 10: objective 1\n"


class Board:
    """What a page of fits is told."""

    def __init__(self) -> None:
        self.text, self.told = "half way", []

    def begin(self, *given: Any) -> Any:
        self.told.append(given)
        return SimpleNamespace(beside=None)

    def end(self, *given: Any) -> None:
        self.told.append(given)


def test_fits_are_shown_on_the_page_where_there_is_one() -> None:
    sink, board = fits.Terminal(), Board()
    problem: Any = SimpleNamespace(name="p")
    alone = sink.fit("calm", problem, 30.0, several=False)
    assert isinstance(alone, fits.Words)
    sink.stay()
    sink.reporting("x")
    sink.close("failed", "x")
    sink._board = board  # type: ignore[assignment]
    part: Any = sink.fit("calm", problem, 30.0, several=False)
    assert isinstance(part.beside, fits.Words)
    many: Any = sink.fit("calm", problem, 40.0, several=True)
    assert many.part("one", problem).beside is not None
    sink.reporting("page 3")
    sink.stay()
    sink.close()
    sink.close("failed", "why")
    assert board.told == [("calm", problem, 30.0), ("one", problem, 40.0), ("writing the report", "page 3"),
                          ("done", "half way"), ("failed", "why")]  # fmt: skip


# the terminal


def test_shells_complete_by_what_is_typed() -> None:
    ship, manoeuvre = app.whole()["simulate"].params[:2]
    with Context(app) as context:
        typed = [one.value for one in ship.shell_complete(context, "kvlcc2_l7")]
        assert typed == [name for name in library() if name.startswith("kvlcc2_l7")]
        assert "kvlcc2" in [one.value for one in ship.shell_complete(context, "kv")]
        assert [one.value for one in manoeuvre.shell_complete(context, "zig")] == ["zigzag"]


def test_a_long_line_keeps_its_beginning_and_its_end() -> None:
    text = "".join(chr(97 + k % 26) for k in range(5000))
    line = render.one_line(text)
    assert len(line) == 2000 - 100 + 5 + 90
    assert line.startswith(text[:1900])
    assert line.endswith(text[-90:])
    assert render.one_line("x" * 2000) == "x" * 2000


def test_json_has_null_for_what_is_no_number(capsys: Said) -> None:
    render.emit({"a": math.nan, "b": math.inf, "c": Path("x"), "d": "é\u202e"})
    out = capsys.readouterr().out
    assert json.loads(out) == {"a": None, "b": None, "c": "x", "d": "é\u202e"}
    assert "é" in out
    assert "\u202e" not in out


def test_other_programs_are_handed_on_to_the_stream_asked_for(capsys: Said) -> None:
    render.hand_on("here\x1b", aside=False)
    render.hand_on("aside", aside=True)
    assert capsys.readouterr() == ("here\x1b", "aside")
    render.note_warning("careful")
    assert capsys.readouterr().err == "note: careful\n"


def test_a_table_of_many_columns_leaves_less_between_columns(capsys: Said) -> None:
    wide, narrow = [], []
    for lines, count in ((wide, 2), (narrow, 20)):
        render.show((Table(("a",) * count, (("1",) * count,)),))
        lines += capsys.readouterr().out.splitlines()
    assert re.search("1 {3,}1", "\n".join(wide))
    assert re.search("1 {1,2}1", "\n".join(narrow))
