"""What a bridge, a report and a plan are made with: starts, rates, keys, commands and titles."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from fitted_run import trial
from seatrial.belief.bands.manoeuvring import Bands
from seatrial.core.errors import RequestError
from seatrial.manoeuvres import Index
from seatrial.realtime.afloat import Voyage
from seatrial.realtime.bridge import server
from seatrial.realtime.bridge.view import OWN
from seatrial.realtime.pages import LOCAL, anywhere
from seatrial.ships.files import load
from seatrial.study.schema import Published
from seatrial.study.series import Series
from seatrial.study.study import Study
from seatrial.workflow import Silent, identify, judging, reports
from seatrial.workflow.afloat import sail
from seatrial.workflow.asked import Departure, Page, RealTime
from seatrial.workflow.evidence.bands import Banded
from seatrial.workflow.live import twin as following

L7 = load("kvlcc2_l7")


@pytest.fixture
def served(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """What the server of a page was given."""
    seen: list[Any] = []

    def serve(deck: Any, loop: Any, listening: Any, *given: Any) -> None:
        seen.append((loop, *given))
        raise KeyboardInterrupt

    monkeypatch.setattr(server, "serve", serve)
    return seen


def bridge(run: RealTime, departure: Departure = Departure(), **more: Any) -> Voyage:
    return sail("kvlcc2_l7", departure=departure, run=run, page=Page(page=True, port=0), **more)


@pytest.mark.slow
def test_a_bridge_begins_as_it_is_told(served: list[Any], tmp_path: Path) -> None:
    notes: list[str] = []
    departure = Departure(heading=30.0, speed=0.9, place="35,139", other=("kvlcc2_l7@40,50,270,0.5",))
    ran = bridge(RealTime(factor=2.0, out=tmp_path), departure, note=notes.append)
    ((loop, hosts, key, links, duration),) = served
    assert (hosts, key, links, duration, ran.written) == (LOCAL, "", [], math.inf, ())
    own, other = loop.vessels[OWN].plant, loop.vessels["1 kvlcc2_l7"].plant
    assert [own[name] for name in ("x", "y", "psi", "u", "v_m", "r")] \
        == pytest.approx([0.0, 0.0, math.radians(30.0), 0.9, 0.0, 0.0])
    assert [other[name] for name in ("x", "y", "psi", "u")] \
        == pytest.approx([40.0, 50.0, math.radians(270.0), 0.5])
    assert loop.rate == pytest.approx(20.0)
    assert loop.factor == 2.0
    assert notes[0].startswith("kvlcc2_l7: http://127.0.0.1:")
    assert notes[-1] == "ended"


@pytest.mark.slow
def test_a_bridge_for_other_machines_has_a_key(served: list[Any], tmp_path: Path) -> None:
    notes: list[str] = []
    bridge(RealTime(anywhere=True, out=tmp_path), note=notes.append)
    ((_, hosts, key, *_),) = served
    assert hosts == anywhere()
    assert len(key) >= 16
    assert notes[0].partition("#")[2].startswith(key)


def test_a_bridge_that_cannot_be_is_refused(tmp_path: Path) -> None:
    for name, value in (("place", "35,139"), ("start", "1,2,3"), ("heading", 0.0)):
        with pytest.raises(RequestError, match=f"--{name} and --ghost both set the position"):
            sail("kvlcc2_l7", departure=Departure(**{name: value}), page=Page(page=True, ghost=tmp_path / "a.csv"))
    with pytest.raises(RequestError, match="--hold is 0"):
        bridge(RealTime(hold=0.0))
    with pytest.raises(RequestError, match="no such folder"):
        bridge(RealTime(out=tmp_path / "none"))
    (tmp_path / "file").write_text("")
    with pytest.raises(RequestError, match="a file; recordings go into a folder"):
        bridge(RealTime(out=tmp_path / "file"))


def test_a_fitted_ship_of_captive_tests_is_of_the_ship_that_it_began_from() -> None:
    def named(began: Any) -> Any:
        return judging._named(SimpleNamespace(began=began, held=("a", "b"), ship=L7), "mine")  # type: ignore[arg-type]

    plain = named(replace(L7, of="", notes={"title": "T", "provenance": {}, "cautions": ["c"]}))
    assert (plain.name, plain.of) == ("mine", "kvlcc2_l7")
    assert plain.notes["title"] == "T; coefficients of captive tests"
    assert plain.notes["cautions"] == ["c", "Not determined by the tests, and as in kvlcc2_l7: a, b."]
    assert "provenance" not in plain.notes
    assert named(replace(L7, of="parent")).of == "parent"


def test_every_trial_of_a_twin_has_its_channels(tmp_path: Path) -> None:
    from seatrial.data import DataError

    good = trial(20).rows(slice(0, 20))
    def without(*names: str) -> Any:
        return replace(good, channels={n: v for n, v in good.channels.items() if n not in names})

    said: list[str] = []
    with pytest.raises(DataError, match="delta"):  # neither the angle nor an order of it
        following._of(L7, "a", (good, without("delta", "delta_cmd")), None, said.append)
    assert not said
    assert following._of(L7, "logs/a.csv", (good,), (1.0, 2.0), said.append).name == "a.csv"
    assert not said
    following._of(L7, "a", (good, without("n_P", "n_P_cmd"), without("delta")), None, said.append)
    assert [one.partition(" in the log: ")[0] for one in said] == ["no n_P", "no delta"]


def test_an_index_has_a_value_and_both_edges() -> None:
    import numpy as np

    values = np.linspace(0.0, 1.0, 101)
    made = Bands(np.zeros(1), np.zeros((101, 1, 6)), {"a": values}, np.full(101, np.nan))
    run: Any = SimpleNamespace(ship=L7, trial=None, policy=SimpleNamespace(indices=lambda t, L: {"a": Index(0.4, "m")}))
    banded = Banded(run, 0.8, None, SimpleNamespace(bands=made))  # type: ignore[arg-type]
    value, low, high = banded.indices["a"]
    assert (value.value, low.value, high.value) == (0.4, pytest.approx(0.1), pytest.approx(0.9))


def study(**more: Any) -> Study:
    problem = SimpleNamespace(ship=replace(L7, name="mine"), trials=(trial(20),), validation=(), free=())
    usual: dict[str, Any] = {"name": "s", "path": Path("s.toml"), "problem": problem, "estimator": None, "test": (),
                             "restart": 5.0, "digest": "d"}  # fmt: skip
    return Study(**(usual | more))


def test_a_study_is_called_by_its_title_else_by_ship_and_file_and_may_keep_trials_back() -> None:
    assert identify._heading(study()) == "mine: s"
    assert identify._heading(study(title="T")) == "T"
    assert study().kept_back is False
    assert study(test=(1,)).kept_back is True



class Numbered:
    """Details that bring a page of their own."""

    def page(self, fit: Any, provenance: Any) -> Any:
        return fit, provenance


def test_the_report_of_a_study_has_what_made_it(tmp_path: Path) -> None:
    fit: Any = SimpleNamespace(details=Numbered())
    page: Any = reports.reporting(study(), tmp_path).page(reports.Made({"s": fit}, (), "the command", Silent()))
    assert page[0] is fit
    assert [*page[1]] == ["study", "digest", "version", "command"]
    assert (page[1]["study"], page[1]["digest"], page[1]["command"]) == ("s.toml", "d", "the command")


@pytest.mark.parametrize(("quick", "only", "suspects", "options"), [
    (False, (), False, ""), (True, (), False, " --quick"), (False, (), True, " --free-suspects"),
    (False, ("a", "b"), True, " --only a --only b --free-suspects"),
])  # fmt: skip
def test_the_command_has_the_options_that_made_a_run(
    quick: bool, only: tuple[str, ...], suspects: bool, options: str
) -> None:
    said = identify._command(Path("t.toml"), Path("run"), quick, only, suspects)
    assert said == f"seatrial identify t.toml{options} -o run"


def test_the_report_of_a_table_is_of_all_fits_that_are_done(monkeypatch: pytest.MonkeyPatch) -> None:
    import seatrial.report.series
    import seatrial.validate.series

    series = Series("t", Path("t.toml"), "", "", (), {"a": trial(20)}, {}, (), Published(source=""), None, {}, (), (),
                    ())  # fmt: skip
    monkeypatch.setattr(seatrial.validate.series, "judged", lambda table, out: ("judged", out))
    monkeypatch.setattr(seatrial.report.series, "covered", lambda table: "covered")
    monkeypatch.setattr(seatrial.report.series, "page", lambda *given, **more: (given, more))
    made = reports.Made({}, ("a failed",), "the command", Silent())
    (given, more) = reports.reporting(series, Path("run")).page(made)  # type: ignore[misc]
    assert given == (series, ("judged", Path("run")), "covered")
    assert more["failed"] == ("a failed",)
    assert [*more["provenance"]] == ["study", "version", "data", "command"]
    assert more["provenance"]["command"] == "the command"


def test_rivals_name_the_truth(monkeypatch: pytest.MonkeyPatch) -> None:
    import seatrial.report.rivals
    import seatrial.validate.rivals

    virtual: Any = SimpleNamespace(ship=SimpleNamespace(name="truth"), seed=7)
    fit: Any = SimpleNamespace(status="converged", details=None)
    one = study(virtual=virtual, rival=("a",))
    monkeypatch.setattr(seatrial.validate.rivals, "judged", lambda *given: given)
    monkeypatch.setattr(seatrial.report.rivals, "page", lambda found, provenance: (found, provenance))
    made = reports.Made({"s": fit}, (), "the command", Silent())
    found, provenance = reports.reporting(one, Path("run")).page(made)  # type: ignore[misc]
    assert found == (one, fit, virtual)
    assert provenance["truth"] == "truth, seed 7"
    assert study(virtual=virtual).rivals is None
    assert study(rival=("a",)).rivals is None
