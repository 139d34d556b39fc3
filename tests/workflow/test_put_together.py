"""Workflows whose parts are long: what each is given, in which order, and what is made of its answer."""

from __future__ import annotations

import math
import socket
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from calibrated_run import calibrated
from fitted_run import saved, trial
from seatrial.belief.bands.manoeuvring import Bands
from seatrial.belief.bands.prediction import Fan
from seatrial.belief.fit_first import Beginning
from seatrial.core import listening
from seatrial.core.errors import RequestError
from seatrial.core.parameters import Free
from seatrial.data import Trial
from seatrial.data.trialfile import read_trial
from seatrial.models import STATES
from seatrial.ships.files import load
from seatrial.simulate.replay import replay
from seatrial.workflow import Silent, harbour, seaway
from seatrial.workflow.asked import Bands as Asked
from seatrial.workflow.asked import Draws
from seatrial.workflow.evidence import calibrate as calibrating
from seatrial.workflow.evidence import designed, fans, judged
from seatrial.workflow.evidence.fans import Banding, write_fan
from seatrial.workflow.harbour import RUNS
from seatrial.workflow.harbour import harbour as run_harbour

DEG = math.pi / 180.0
L7 = load("kvlcc2_l7")


class Noting(Silent):
    def __init__(self) -> None:
        self.lines: list[str] = []

    def note(self, line: str) -> None:
        self.lines.append(line)


@pytest.fixture(scope="module")
def held(tmp_path_factory: pytest.TempPathFactory) -> Path:
    model = saved(tmp_path_factory.mktemp("held") / "run", [trial(35), trial(20, 20)])
    calibrated(model)
    return model


def banding(model: Path, **more: Any) -> Banding:
    made = Banding.of(str(model), Asked(90.0, 60, extrapolate=more.pop("extrapolate", False)))
    return replace(made, **more)


def fan_of(trial: Trial, run: Trial, *, half: float = 0.5, kind: str = "turning", level: float = 0.9) -> Fan:
    return Fan(run, run.t - run.t[0], np.full((len(run), 6), half), level, kind, ("mind this",))


@pytest.mark.slow
def test_a_prediction_with_bands_is_the_replay_and_they_are_given_how_it_begins(
    held: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[dict[str, Any]] = []

    def fan(own: Any, found: Any, one: Trial, run: Trial, level: float, **given: Any) -> Fan:
        seen.append({"level": level, "run": run, "trial": one, "found": found, **given})
        return fan_of(one, run)

    monkeypatch.setattr(fans, "fan", fan)
    asked, one, lines = banding(held), trial(35), list[str]()
    run, made = asked.predicted(one, 20.0, lines.append)
    plain = replay(asked.held.ship, one, restart=20.0)
    assert run["x"] == pytest.approx(plain["x"])
    assert made.predicted is run
    assert lines == [f"warning: {one.name}: mind this"]
    (given,) = seen
    assert given["trial"] is one
    assert given["found"] is asked.found
    assert (given["level"], given["restart"], given["draws"]) == (pytest.approx(0.9), 20.0, 60)
    assert given["current"] == math.inf
    assert (given["past"], given["plain"], given["begin"]) == (None, None, None)
    assert asked.replay(one, restart=20.0)["x"] == pytest.approx(plain["x"])
    state = np.array([one[name][20] for name in STATES])
    first = Beginning(one, float(one.t[20]), state, {"current.north": 0.3}, {"current.north": 0.1}, 1.0)
    later, _ = asked.predicted(one, None, lines.append, first)
    assert later.t[0] == one.t[20]
    assert seen[1]["begin"][0] == one.t[20]
    assert seen[1]["current"] == pytest.approx(0.1)
    with pytest.raises(RequestError, match="leaves the trials of the fit"):
        asked.predicted(one.having(n_P=1.5 * one["n_P"]), 20.0, lines.append)
    assert len(seen) == 2
    fast = one.having(n_P=1.5 * one["n_P"])
    banding(held, extrapolate=True).predicted(fast, 20.0, lines.append)
    assert len(seen) == 3


@pytest.mark.slow
def test_a_prediction_with_a_past_is_carried_on(held: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    one, seen = trial(35), list[Any]()

    def carried(filters: Any, law: Any, some: Trial, restart: float | None = None) -> tuple[Trial, str]:
        seen.append((filters, some, restart))
        return some.having(u=0.95 * some["u"]), "past"

    monkeypatch.setattr(fans, "carried", carried)
    monkeypatch.setattr(fans, "fan", lambda *a, **given: (seen.append(given), fan_of(one, a[3]))[1])
    asked = banding(held, filters="filters", plain="plain")
    assert asked.replay(one, restart=7.0)["u"] == pytest.approx(0.95 * one["u"])
    run, _ = asked.predicted(one, 7.0, lambda _: None)
    assert run["u"] == pytest.approx(0.95 * one["u"])
    assert seen[0] == ("filters", one, 7.0)
    assert (seen[2]["past"], seen[2]["plain"]) == ("past", "plain")


@pytest.mark.slow
def test_edges_of_a_prediction_are_a_trial_file_beside_it(tmp_path: Path) -> None:
    one = trial(35).rows(slice(0, 20))
    path = write_fan(fan_of(one, one, half=0.25), tmp_path)
    assert path == tmp_path / "bands" / f"{one.name}.csv"
    again = read_trial(path)
    for name in STATES:
        assert again[f"{name}_low"] == pytest.approx(one[name] - 0.25)
        assert again[f"{name}_high"] == pytest.approx(one[name] + 0.25)
        assert again.unit(f"{name}_low") == one.unit(name)
    assert again.meta["kind"] == "turning"
    assert again.meta["source"] == "bands of 90 %"


@pytest.mark.slow
def test_coverage_is_counted_up_to_the_restart_and_the_reach_of_the_bands(held: Path) -> None:
    from seatrial.belief.bands.held import SHARES

    asked, one = banding(held), trial(35)
    off = one.having(x=one["x"] + 0.4, psi=one["psi"] + 0.6)  # half widths of .5: places held, headings not
    since = np.mod(one.t - one.t[0], 20.0)
    made = replace(fan_of(one, off), since=since)
    found = fans.judged([(made, one)], asked, 20.0)
    assert found is not None
    assert (found.level, found.recordings) == (pytest.approx(0.9), 24)
    assert {row.horizon for row in found.rows} <= {share * 20.0 for share in SHARES}
    assert {row.inside["position"] for row in found.rows} == {1.0}
    assert {row.inside["heading"] for row in found.rows} == {0.0}
    whole = fans.judged([(fan_of(one, one), one)], asked, None)
    assert whole is not None
    longest = min(asked.found.reach(0.9), one.duration)
    assert max(row.horizon for row in whole.rows) == pytest.approx(max(SHARES) * longest, rel=0.02)
    assert fans.judged([(replace(made, half=np.full((len(one), 6), np.nan)), one)], asked, 20.0) is None


@pytest.mark.slow
def test_a_calibration_leaves_parts_out_and_keeps_a_file_for_each_beginning(
    tmp_path: Path, held: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from seatrial.belief.bands.calibration import beside
    from seatrial.belief.bands.calibration import load as load_bands
    from seatrial.belief.reading import posterior

    model = saved(tmp_path / "run", [trial(35), trial(20, 20)])
    own = posterior(str(model))
    first = load_bands(calibrated(model).parent / "model.toml", own)
    beside(model).unlink()
    seen: list[Any] = []

    def left_out(
        estimator: Any, problem: Any, fit: Any, held: Any, *, out: Any, folder: Path, pool: Any, each: Any
    ) -> list[str]:
        assert folder.is_dir()
        seen.append((out, folder.parent.name, pool))
        for done in range(1, len(out) + 1):
            each(done)
        return ["out"]

    grounds = SimpleNamespace(measured=lambda: first)
    monkeypatch.setattr(calibrating, "_study", lambda *_: SimpleNamespace(
        estimator=None, problem=SimpleNamespace(trials=("a", "b", "c"))))
    monkeypatch.setattr(calibrating, "left_out", left_out)
    monkeypatch.setattr(calibrating, "folds", lambda trials, by, parts: [trials[k::parts] for k in range(parts)])
    monkeypatch.setattr(calibrating, "_errors", lambda out, study: calibrating.Errors(0.2, (0.1, 0.4)))
    monkeypatch.setattr(calibrating, "power", lambda fit, problem, estimator, out: "widened by left-out trials")
    monkeypatch.setattr(calibrating, "Withheld", SimpleNamespace(of=lambda held, out, horizon: (
        seen.append((held.digest, held.power, out, horizon)), grounds)[1]))
    monkeypatch.setattr(calibrating, "by_history", lambda g, span: replace(first, begin=f"history {span:g}"))
    monkeypatch.setattr(calibrating, "by_first", lambda g, span, how: replace(first, begin=f"fit-first {span:g}"))
    sink = Noting()
    made = calibrating.calibrate(str(model), parts=2, horizon=60.0, history=5.0, first=7.0, sink=sink)
    assert seen == [([("a", "c"), ("b",)], "left-out", None), (own.digest, "widened by left-out trials", ["out"], 60.0)]
    assert sink.lines[:2] == ["1 of 2 parts of the recordings left out and fitted without",
                              "2 of 2 parts of the recordings left out and fitted without"]
    assert made.result.left is first.left
    assert made.result.errors == {"recording": calibrating.Errors(0.2, (0.1, 0.4))}
    files = [beside(model), beside(model, "history 5"), beside(model, "fit-first 7")]
    assert sink.lines[2:] == [f"wrote {file}" for file in files]
    assert all(file.is_file() for file in files)
    assert {"history 5", "fit-first 7"} <= set(made.document)
    assert made.document["written"] == str(files[0])
    assert made.document["folds"] == "recording"
    quoted: Any = made.document["errors"]
    assert quoted["recording"] == {"mean": 0.2, "spread": pytest.approx(0.3 / np.sqrt(2.0)), "parts": [0.1, 0.4]}
    assert not (model.parent / "left-out").exists()
    alone = calibrating.calibrate(str(model), parts=2)
    assert not {"history 5", "fit-first 7"} & set(alone.document)
    (less,), (more,) = alone.shown, made.shown
    assert less.body == more.body[: len(less.body)]  # type: ignore[union-attr]


@pytest.mark.parametrize(("option", "value"), [("speed", 0.0), ("speed", -1.0), ("speed", 1e5), ("duration", 0.0),
                                               ("duration", 2e5), ("speed", math.nan)])  # fmt: skip
def test_a_run_in_a_harbour_has_a_speed_and_a_duration(option: str, value: float) -> None:
    with pytest.raises(RequestError, match=f"--{option} is {value:g}; it is above zero, and below 100000"):
        run_harbour("canal", **{option: value})
    with pytest.raises(RequestError, match="no run in a harbour 'dock'"):
        run_harbour("dock")


def test_a_run_in_a_harbour_is_simulated_as_it_was_planned(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    seen: list[dict[str, Any]] = []
    t = np.arange(5.0)

    def simulate(ship: Any, policy: Any, **given: Any) -> Trial:
        seen.append({"ship": ship, "policy": policy, **given})
        return Trial(given["name"], t, {"x": t, "y": 3.0 * t, "psi": 0.0 * t})

    monkeypatch.setattr(harbour, "simulate", simulate)
    monkeypatch.setattr(harbour, "place_of", lambda ship, chart, other=None: ("place", other))
    monkeypatch.setattr(harbour, "contact_indices", lambda *_: {"a": 1})
    monkeypatch.setattr(harbour, "keel_indices", lambda *_: {"b": 2})
    ran = run_harbour("canal", wind="8,90", speed=3.0, out=tmp_path / "run.csv")
    usual = RUNS["canal"][1](ran.ship, ran.chart, 3.0)
    (given,) = seen
    assert given["start"] == usual.start
    assert given["duration"] == usual.duration
    assert (given["place"], given["every"], given["name"]) == (("place", None), 10, "kvlcc2_harbour_canal")
    now = given["environment"].now()
    assert (now.wind_x, now.wind_y) == pytest.approx((0.0, 8.0), abs=1e-12)
    assert (tmp_path / "run.csv").is_file()
    assert {"a", "b", "off_fairway", "off_fairway_end"} <= set(ran.indices)
    run_harbour("canal", duration=12.0, start="5,-6,90")
    assert seen[1]["duration"] == 12.0
    assert seen[1]["start"][:3] == pytest.approx((5.0, -6.0, 0.5 * math.pi))
    assert seen[1]["start"][3] == 3.5  # the usual speed of a canal
    run_harbour("meeting")
    assert seen[2]["place"][1] is not None
    assert RUNS["lock"][1](ran.ship, harbour.load_chart("lock"), None).start[3] == 1.5


def test_the_way_off_a_fairway_is_the_greatest_and_the_last() -> None:
    line = np.array([[0.0, 0.0], [100.0, 0.0]])
    chart: Any = SimpleNamespace(fairways=[line, line + np.array([0.0, 50.0])])
    t = np.arange(4.0)
    run = Trial("a", t, {"x": 10.0 * t, "y": np.array([0.0, 20.0, 45.0, -3.0])})
    found = harbour._beside(run, chart)
    assert (found["off_fairway"].value, found["off_fairway_end"].value) == (20.0, 3.0)  # of the nearer line
    assert harbour._beside(run, SimpleNamespace(fairways=[])) == {}  # type: ignore[arg-type]


def test_motions_of_a_ship_that_has_them_are_about_their_means() -> None:
    """Heave [m], roll and pitch [rad]: deviations of the run beside those of the spectrum."""
    t = np.arange(4.0)
    run = Trial("a", t, {"z": 2.0 + np.array([1.0, -1.0, 1.0, -1.0]), "phi": 0.1 * np.array([0.0, 2.0, 0.0, 2.0]),
                         "theta": np.array([0.0, 0.0, 0.0, 0.4]), "psi": 0.7 + 0.0 * t})  # fmt: skip
    asked: list[float] = []

    def variances(waves: Any, heading: float) -> np.ndarray:
        asked.append(heading)
        return np.array([1.0, 4.0, 9.0, 16.0, 25.0, 36.0])

    rao: Any = SimpleNamespace(variances=variances)
    sea: Any = SimpleNamespace(waves=None)
    made = seaway.Seaway({}, sea, rao, rao)
    same, motions = made.seen(run, lambda _: None)
    assert same is run
    assert asked == [0.7]
    assert [(m.expected, m.unit) for m in motions.values()] == [(3.0, "m"), (4.0, "rad"), (5.0, "rad")]
    assert (motions["heave"].found, motions["heave"].greatest) == (1.0, 1.0)
    assert (motions["roll"].found, motions["roll"].greatest) == (pytest.approx(0.1), pytest.approx(0.1))
    assert motions["pitch"].greatest == pytest.approx(0.3)


def test_motions_upon_a_run_are_along_and_across_its_heading(monkeypatch: pytest.MonkeyPatch) -> None:
    """Heading east: north is to port, so a motion to the north is a negative sway."""
    t = np.arange(3.0)
    zero = 0.0 * t
    run = Trial("a", t, {"x": zero, "y": zero, "psi": zero + 0.5 * math.pi})
    total = run.having(x=np.array([0.0, 1.0, -1.0]), y=np.array([0.0, 2.0, 0.0]), z=np.array([0.0, 3.0, 0.0]),
                       phi=np.array([0.0, 0.6, 0.0]), theta=zero, psi=run["psi"] + np.array([0.0, 0.0, -0.2]))
    import seatrial.simulate.seaway as upon

    monkeypatch.setattr(upon, "in_waves", lambda *_: total)
    rao: Any = SimpleNamespace(variances=lambda waves, heading: np.full(6, 4.0))
    notes: list[str] = []
    _, motions = seaway.Seaway({}, SimpleNamespace(waves=None), rao).seen(run, notes.append)  # type: ignore[arg-type]
    assert [m.unit for m in motions.values()] == ["m", "m", "m", "rad", "rad", "rad"]
    assert motions["surge"].greatest == pytest.approx(2.0)
    assert motions["surge"].found == pytest.approx(np.std([0.0, 2.0, 0.0]))
    assert motions["sway"].found == pytest.approx(np.std([0.0, -1.0, 1.0]))
    assert (motions["heave"].greatest, motions["yaw"].greatest) == (3.0, pytest.approx(0.2))
    assert motions["roll"].expected == 2.0
    assert notes[0].startswith("warning: --rao: roll reaches 34.4 deg")
    notes.clear()
    monkeypatch.setattr(upon, "in_waves", lambda *_: total.having(phi=np.array([0.0, 0.5, 0.0])))
    seaway.Seaway({}, SimpleNamespace(waves=None), rao).seen(run, notes.append)  # type: ignore[arg-type]
    assert notes == []  # 28.6 deg are still small


def test_the_address_of_a_page_is_that_of_its_socket_with_the_key_in_the_fragment() -> None:
    with listening.listen("localhost", 0, False) as one:
        port = one.getsockname()[1]
        assert listening.address(one) == f"http://127.0.0.1:{port}/"
        assert listening.address(one, "abc") == f"http://127.0.0.1:{port}/#abc"
    with listening.listen("0.0.0.0", 0, True) as one:
        shown = listening.address(one)
        assert "0.0.0.0" not in shown
        assert shown.endswith(f":{one.getsockname()[1]}/")
        host = shown.removeprefix("http://").partition(":")[0]
        assert socket.inet_aton(host)
    for port in (-1, 65536):
        with pytest.raises(RequestError, match=f"--port is {port}"):
            listening.listen("127.0.0.1", port, False)


def row(title: str, run: Any, **more: Any) -> Any:
    source = None if run is None else SimpleNamespace(run=run, policy="policy", index="a")
    return SimpleNamespace(title=title, unit="L", value=1.0, source=source, **more)


def test_draws_before_and_after_a_design_are_made_once_a_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """After: inverse of the sum of the inverse covariance before and the information."""
    seen: list[dict[str, Any]] = []

    def bands(ship: Any, policy: Any, names: Any, drawn: Any, **given: Any) -> Bands:
        seen.append({"drawn": drawn, **given})
        values = drawn[:, 0]
        return Bands(np.zeros(1), np.zeros((len(values), 1, 6)), {"a": values}, np.full(len(values), np.nan))

    t = np.array([5.0, 5.25, 45.0])
    one, other = SimpleNamespace(t=t, duration=40.0), SimpleNamespace(t=t, duration=10.0)
    table = SimpleNamespace(rows=[row("A", one), row("B", one), row("C", other), row("D", None)], speed=1.5, L_pp=2.0)
    monkeypatch.setattr(designed, "bands", bands)
    monkeypatch.setattr(designed, "imo_table", lambda ship: table)
    free = (Free("hull.Y_v", -0.3, prior=-0.3, sigma=0.1),)
    plan: Any = SimpleNamespace(free=free, information=np.array([[300.0]]))
    made = designed.foreseen(L7, plan, Draws(80.0, 400))
    assert [one.name for one in made] == ["A", "B", "C"]
    assert [given["duration"] for given in seen] == pytest.approx([52.0, 13.0, 52.0, 13.0])  # 1.3 times the run
    assert (seen[0]["speed"], seen[0]["dt"], seen[0]["held"]) == (1.5, 0.25, False)
    wide, narrow = seen[0]["drawn"][:, 0], seen[2]["drawn"][:, 0]
    assert wide.std() == pytest.approx(0.1, rel=0.1)
    assert narrow.std() == pytest.approx(1.0 / math.sqrt(1.0 / 0.1**2 + 300.0), rel=0.1)
    assert wide.mean() == pytest.approx(-0.3, abs=0.02)
    assert made[0].before[0] < -0.15 < made[0].before[1]  # in lengths of 2 m
    assert made[0].share == pytest.approx(0.5, rel=0.1)


def test_rows_of_one_run_share_its_draws_and_what_is_refused_is_undecided(monkeypatch: pytest.MonkeyPatch) -> None:
    from seatrial.validate.imo import FAIL, NOT_APPLICABLE, PASS, UNDECIDED, Criterion, Source

    values = np.concatenate([np.full(99, 4.0), [6.0]])
    found = Bands(np.zeros(1), np.zeros((100, 1, 6)), {"a": values}, np.full(100, np.nan))
    good, beyond = trial(35), trial(20, 20)
    sailed: list[dict[str, Any]] = []

    def sail(ship: Any, policy: Any, run: Trial, **given: Any) -> Any:
        sailed.append({"run": run, **given})
        return SimpleNamespace(bands=found, caveats=("a caveat",))

    asked: Any = SimpleNamespace(level=0.9, held=SimpleNamespace(ship=L7, fitted=True), sail=sail,
                                 refusal=lambda run: "" if run is good else f"beyond{judged.UNKNOWN}accept it")
    simulated: list[float] = []
    monkeypatch.setattr(judged, "simulate", lambda ship, policy, **given: simulated.append(given["duration"]))
    sources: list[Any] = [Source("p", run, "a") for run in (good, good, beyond)]  # type: ignore[arg-type]
    rows = [Criterion(name, "", 1.0, "L", 0.7, PASS, source=source)
            for name, source in zip("ABC", sources, strict=True)]  # fmt: skip
    rows += [replace(rows[0], name="D", verdict=NOT_APPLICABLE), replace(rows[0], name="E", source=None)]
    table: Any = SimpleNamespace(rows=rows, speed=1.1, L_pp=7.0)
    caveats: dict[str, None] = {}
    notes: list[str] = []
    (a, met), (b, _), (c, none), (d, _), (e, _) = judged._rows(table, asked, notes.append, caveats)
    assert met is not None
    assert met.tolist() == [True] * 99 + [False]
    assert none is None
    assert len(sailed) == 1
    assert simulated == pytest.approx([1.3 * good.duration])
    assert sailed[0]["speed"] == 1.1
    assert sailed[0]["dt"] == pytest.approx(good.t[1] - good.t[0])
    assert (a.verdict, b.verdict) == (PASS, PASS)  # 99 of 100 draws are 4 m, .57 L
    assert a.band is not None
    assert a.band.met == pytest.approx(0.99)
    assert (c.verdict, c.reason) == (UNDECIDED, "beyond")
    assert (d.verdict, e.band) == (NOT_APPLICABLE, None)
    assert set(caveats) == {"a caveat", "undecided rows: accept it"}
    assert notes == ["draws: A", "draws: C"]
    assert FAIL != PASS
