"""The page of a fit, as the command line serves it: begun with the fit's title and files, ended with the state."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from seatrial.cli import fits, judging, render
from seatrial.cli.app import main
from seatrial.core.errors import RequestError
from seatrial.report.blocks import Line, document, fields
from seatrial.workflow import Outcome

Said = pytest.CaptureFixture[str]


class Board:
    """What a page shows."""

    def __init__(self, title: Any, files: Any, *, before: Any = ()) -> None:
        self.title, self.files, self.before, self.ends = title, files, before, []
        self.text = "all fits"

    def end(self, state: str, text: str) -> None:
        self.ends.append((state, text))


class Page:
    """What serves it."""

    made: list[Page]

    def __init__(self, board: Board, static: Path, listening: Any) -> None:
        assert (static / "index.html").exists()
        self.board, self.listening, self.did = board, listening, []
        self.made.append(self)

    def __enter__(self) -> None:
        self.did.append("start")

    def __exit__(self, *_: object) -> None:
        self.did.append("close")


@pytest.fixture
def served(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """The pages that were made, and what was listened at."""
    pytest.importorskip("fastapi")
    asked: list[Any] = []

    @contextmanager
    def listen(host: str, port: int, anywhere: bool) -> Iterator[Any]:
        asked.append((host, port, anywhere))
        yield SimpleNamespace(port=port)

    Page.made = []
    monkeypatch.setattr("seatrial.core.listening.listen", listen)
    monkeypatch.setattr("seatrial.core.listening.address", lambda one: f"http://here:{one.port}")
    monkeypatch.setattr("seatrial.realtime.fit_page.board.Board", Board)
    monkeypatch.setattr("seatrial.realtime.fit_page.board.Tracker", nullcontext)
    monkeypatch.setattr("seatrial.realtime.pages.Watched", Page)
    return asked


FILES = {"mine": Path("mine.toml")}


@pytest.mark.slow
def test_a_page_is_begun_with_title_files_and_what_ran_before(served: list[Any], capsys: Said) -> None:
    with fits.watching(9001) as sink:
        with sink.fitting("my study", FILES, ("before",)):
            sink.reporting("report.html")
        sink.stay()
    [page] = Page.made
    assert served == [("127.0.0.1", 9001, False)]
    assert (page.board.title, page.board.files, page.board.before) == ("my study", FILES, ("before",))
    assert page.listening.port == 9001
    assert page.did == ["start", "close"]
    assert page.board.ends == [("writing the report", "report.html"), ("done", "all fits")]
    assert capsys.readouterr().err == "page: http://here:9001\n"


@pytest.mark.parametrize(("error", "state", "text"), [
    (KeyboardInterrupt(), "stopped", "stopped; the same command again resumes here"),
    (RequestError("no such trial"), "failed", "no such trial"),
])  # fmt: skip
def test_a_page_is_told_what_ended_the_fit(served: list[Any], error: BaseException, state: str, text: str) -> None:
    with pytest.raises(type(error)), fits.watching(9001) as sink, sink.fitting("my study", FILES, ()):
        raise error
    assert served
    assert Page.made[0].board.ends == [(state, text)]
    assert Page.made[0].did == ["start", "close"]


def test_without_a_port_nothing_is_served(served: list[Any], capsys: Said) -> None:
    with fits.watching(None) as sink, sink.fitting("my study", FILES, ()):
        sink.reporting("x")
        sink.note("a line")
    assert (served, Page.made) == ([], [])
    assert capsys.readouterr().err == "a line\n"


def test_at_a_terminal_the_page_stays_until_ctrl_c(
    served: list[Any], monkeypatch: pytest.MonkeyPatch, capsys: Said
) -> None:
    def wait(self: Any) -> None:
        raise KeyboardInterrupt

    obeyed: list[bool] = []
    monkeypatch.setattr("threading.Event.wait", wait)
    monkeypatch.setattr("seatrial.core.errors.obeyed", lambda: obeyed.append(True))
    with fits.watching(9001) as sink:
        sink._serve("my study", FILES, ())
        monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
        sink.stay()
    assert capsys.readouterr().err.splitlines()[-2:] == ["page: http://here:9001 stays until Ctrl-C", "page ended"]
    assert obeyed == [True]


def test_a_page_without_its_extra_is_refused(served: list[Any], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "seatrial.realtime.pages", None)
    with pytest.raises(RequestError, match="--page needs"), fits.watching(9001):
        pass
    assert served


@pytest.mark.parametrize(("resumable", "words"), [(True, "run the same command again to go on in out"),
                                                  (False, "run the same command again")])  # fmt: skip
def test_an_interrupted_fit_says_whether_it_can_go_on(
    resumable: bool, words: str, monkeypatch: pytest.MonkeyPatch, capsys: Said
) -> None:
    def interrupted(*_: Any, **__: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("seatrial.workflow.identify.identify", interrupted)
    monkeypatch.setattr("seatrial.workflow.identify.resumes", lambda out: resumable and out == Path("out"))
    assert main(["identify", "s.toml", "-o", "out"]) == 130
    assert capsys.readouterr().err == f"interrupted; {words}\n"
    for work, command in (
        ("evidence.calibrate.calibrate", ["calibrate", "m.toml"]),
        ("campaigns.campaign", ["campaign", "c.toml", "-o", "out"]),
        ("campaigns.analysing.rare", ["campaign", "c.toml", "-o", "out", "--rare", "a"]),
    ):
        monkeypatch.setattr(f"seatrial.workflow.{work}", interrupted)
        assert main(command) == 130
        assert "interrupted; run the same command again to go on" in capsys.readouterr().err


@pytest.mark.parametrize(("errors", "status"), [((), 0), (("a is short",), 1)])
def test_faults_of_trials_and_fits_end_with_1(
    errors: tuple[str, ...], status: int, monkeypatch: pytest.MonkeyPatch, capsys: Said
) -> None:
    outcome = Outcome(SimpleNamespace(fitness=None), fields({"a": 1}, (Line("told"),)), errors)
    for work in ("validate.check", "identify.identify", "validate.predict", "validate.validate"):
        monkeypatch.setattr(f"seatrial.workflow.{work}", lambda *_, **__: outcome)
    for words in (["check", "a.csv"], ["identify", "s.toml", "-o", "out"], ["predict", "kvlcc2", "a.csv", "-o", "out"],
                  ["validate", "kvlcc2", "a.csv"]):  # fmt: skip
        assert main(words) == status
        assert capsys.readouterr().out == "told\n"
        assert main([*words, "--json"]) == status
        assert json.loads(capsys.readouterr().out) == {"a": 1}
    outcome = Outcome(SimpleNamespace(fitness=SimpleNamespace(verdict="fit")), ())
    from seatrial.workflow.comparing import STATUS

    for verdict, code in {"fit": 0, "not fit": 3, "cannot tell": 4}.items():
        assert STATUS[verdict] == code
        outcome.result.fitness.verdict = verdict
        assert main(["validate", "kvlcc2", "a.csv"]) == code


@pytest.mark.parametrize("option", ["--restart", "--smooth-start", "--history"])
@pytest.mark.parametrize("command", [["predict", "-o", "out"], ["validate"]], ids=["predict", "validate"])
def test_times_of_predictions_are_above_zero(command: list[str], option: str, capsys: Said) -> None:
    assert main([*command, "kvlcc2", "a.csv", option, "-5"]) == 2
    assert f"{option} is -5; it must be above zero" in capsys.readouterr().err


# models for a purpose


def test_advice_is_told_in_full() -> None:
    about = SimpleNamespace(key="nomoto", name="Nomoto", next=("seatrial estimate",))
    advice: Any = SimpleNamespace(
        assessment=SimpleNamespace(family=about, ships=(), cost=12.5, coefficients=None), verdict="meets it in part",
        lacks=("a",), poor=("b",), add=("c",), misses=("d",), items=(1,), in_part=(2,), reason="why",
    )  # fmt: skip
    purpose: Any = SimpleNamespace(key="berthing", title="Berthing", about="slow", simplest="mmg", check="x {ship}")
    told = judging._advice_document(purpose, (advice,))
    assert told["ranking"] == [{
        "family": "nomoto", "name": "Nomoto", "verdict": "meets it in part", "lacks": ("a",), "partly": ("b",),
        "to_add": ("c",), "misses": ("d",), "items_unmet": (1,), "items_in_part": (2,), "reason": "why",
        "cost_ns": 12.5, "coefficients": (), "next": ("seatrial estimate",),
    }]  # fmt: skip
    assert {key: told[key] for key in ("purpose", "title", "about", "simplest", "next")} == {
        "purpose": "berthing",
        "title": "Berthing",
        "about": "slow",
        "simplest": "mmg",
        "next": ["seatrial estimate"],
    }
    advice.assessment.coefficients = (2, 5)
    assert judging._advice_document(purpose, (advice,))["ranking"][0]["coefficients"] == (2, 5)


def need(item: int | None, key: str, *, must: bool) -> Any:
    return SimpleNamespace(item=item, about=f"about {key}", place="6.1", keys=(key,), must=must)


@pytest.mark.parametrize("listed", [True, False])
def test_advice_is_shown_by_rank_and_need(listed: bool, monkeypatch: pytest.MonkeyPatch, capsys: Said) -> None:
    monkeypatch.setattr("seatrial.choosing.purposes.fittest", lambda purpose, f: f.ships[0])
    family = SimpleNamespace(key="nomoto", name="Nomoto", classes=("x",), next=("seatrial estimate",))
    found = SimpleNamespace(family=family, ships=("zeefakkel",), cost=12.345, coefficients=(2, 5),
                            answer=lambda keys: "part" if "turns" in keys else "yes")  # fmt: skip
    advice: Any = SimpleNamespace(assessment=found, verdict="meets it", items=(1, 4), in_part=(), reason="small")
    purpose: Any = SimpleNamespace(
        title="Berthing", about="slow", simplest="a model", check="seatrial imo {ship}",
        needs=(need(1 if listed else None, "turns", must=True), need(2 if listed else None, "stops", must=False)),
    )  # fmt: skip
    monkeypatch.setattr(judging, "_advice_document", lambda *given: {"advice": len(given)})
    body = judging._advised(purpose, (advice,))
    assert document(body) == {"advice": 2}
    render.show(body)
    out = capsys.readouterr().out
    lines = [" ".join(line.split()) for line in out.splitlines()]
    assert f"1 nomoto Nomoto meets it {'1, 4 ' if listed else ''}2-5 12 small" in lines
    assert ("1 about turns must part" if listed else "about turns [6.1] must part") in lines
    assert ("2 about stops wish yes" if listed else "about stops [6.1] wish yes") in lines
    assert "Simplest: a model" in lines
    assert out.endswith("Next:\n  seatrial estimate\n  seatrial imo zeefakkel\n")
    head = next(line for line in out.splitlines() if "verdict" in line)
    row = next(line for line in out.splitlines() if "small" in line)
    for name, cell in (("numbers", "2-5"), ("ns", " 12")):
        assert head.index(name) + len(name) == row.index(cell) + len(cell)


def test_bands_of_a_design_are_in_its_document(monkeypatch: pytest.MonkeyPatch, capsys: Said) -> None:
    plan = SimpleNamespace(chosen=(), length=0.0, log_det=0.0, free=(), sigma=(), share=(), verdicts=(), left_out=())
    made = SimpleNamespace(ship=SimpleNamespace(name="mine"), noise={"x": 0.5}, plan=plan, foreseen=())
    monkeypatch.setattr("seatrial.workflow.judging.design", lambda *_, **__: made)
    words = ["design", "kvlcc2", "--free", "hull.*", "--budget", "7", "--json"]
    assert main(words) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["ship"], told["budget"], told["noise"], "bands" in told) == ("mine", 7.0, {"x": 0.5}, False)
    assert main([*words, "--bands", "95"]) == 0
    assert "bands" in json.loads(capsys.readouterr().out)
    assert not math.isnan(told["length"])
