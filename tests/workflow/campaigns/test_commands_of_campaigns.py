"""What commands hand on to a campaign and make of it, and what a card says of calibrated bands: each part by itself."""

from __future__ import annotations

import json
import math
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seatrial.campaign.running import Shard
from seatrial.core.errors import RequestError
from seatrial.data import DataError, Trial
from seatrial.models import STATES
from seatrial.study.grounds import Grounds
from seatrial.workflow import campaigns
from seatrial.workflow.campaigns import analysing, beside, merged, replayed, status
from seatrial.workflow.evidence import calibrate, carded

HERE = Path("here") / "many.toml"


class Held:
    """A folder of a campaign of five parts."""

    def __init__(self, missing: int = 0, path: Path | None = Path("there"), text: str | None = "x = 1") -> None:
        self.parts, self.missing, self.folder = 5, [*range(missing)], str(path)
        self.place = SimpleNamespace(path=path, everywhere=lambda: "everywhere")
        self.manifest = SimpleNamespace(name="n", rows=100, tracks=False, text=text, source=str(HERE), seed=7,
                                        digest="d", version="1.0", devices=["cpu"])  # fmt: skip

    def digest(self) -> str:
        return "whole"


@pytest.mark.parametrize(("missing", "wrong", "verify", "done", "digest"), [
    (0, (), False, 5, "whole"), (2, (), False, 3, None), (0, ("part 1",), True, 5, None), (0, (), True, 5, "whole"),
    (0, ("part 1",), False, 5, "whole"), (5, (), False, 0, None),
])  # fmt: skip
def test_a_campaign_has_a_digest_when_all_is_there_and_nothing_wrong(
    monkeypatch: pytest.MonkeyPatch, missing: int, wrong: Any, verify: bool, done: int, digest: Any
) -> None:
    monkeypatch.setattr(campaigns, "open_folder", lambda where: Held(missing))
    monkeypatch.setattr(campaigns, "wrong_parts", lambda held: list(wrong))
    found = status("there", verify=verify)
    assert (found.done, found.digest, found.faults) == (done, digest, wrong if verify else ())
    document = found.document
    assert (document["done"], document["parts"], document["rows"], document["digest"]) == (done, 5, 100, digest)


def test_a_file_of_a_campaign_is_in_its_folder_unless_it_is_a_store(monkeypatch: pytest.MonkeyPatch) -> None:
    held: Any = Held()
    assert beside(held, None, "a.parquet") == Path("there") / "a.parquet"
    assert beside(held, Path("b"), "a.parquet") == Path("b")
    store: Any = Held(path=None)
    assert beside(store, Path("b"), "a.parquet") == Path("b")
    with pytest.raises(RequestError, match=r"-o a\.parquet"):
        beside(store, None, "a.parquet")
    monkeypatch.setattr(campaigns, "open_folder", lambda where: held)
    monkeypatch.setattr(campaigns, "merge", lambda one, path: (one is held, path))
    assert merged("there") == (True, Path("there") / "campaign.parquet")


def test_a_campaign_runs_its_shard_on_as_many_threads_into_its_folder(monkeypatch: pytest.MonkeyPatch) -> None:
    ran: list[Any] = []
    plan = SimpleNamespace(cases=())
    monkeypatch.setattr(campaigns, "read_campaign", lambda path, note: plan)
    monkeypatch.setattr(campaigns, "run", lambda *given, **more: ran.append((given, more)))

    @contextmanager
    def threads(count: int | None) -> Any:
        yield ("threads", count)

    monkeypatch.setattr(campaigns.executors, "threads", threads)
    campaigns.campaign(HERE, "out", shard="2/3", threads=1)
    ((given, more),) = ran
    assert given == (plan, "out")
    assert (more["pool"], more["source"]) == (("threads", 1), HERE)
    assert more["shard"] == Shard.read("2/3") != Shard()
    with pytest.raises(RequestError, match="--threads is 0"):
        campaigns.campaign(HERE, "out", threads=0)
    with pytest.raises(RequestError, match="give one of them"):
        campaigns.campaign(HERE, "out", threads=1, dask="local:2")


def test_a_run_is_sailed_again_where_the_campaign_is_the_same(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    run = Trial("r", np.arange(3.0), {"u": np.ones(3)})
    policy = SimpleNamespace(indices=lambda trial, L: {"L": (trial.name, L)}, complete=lambda trial: trial is run)
    runs = SimpleNamespace(columns={"U_T": np.array([4.0, 9.0])},
                           case=SimpleNamespace(name="a", ship=SimpleNamespace(L_pp=7.0)))  # fmt: skip
    held, plan = Held(), SimpleNamespace(digest="d", cases=())
    asked: list[Any] = []
    monkeypatch.setattr(campaigns, "open_folder", lambda where: held)
    monkeypatch.setattr(campaigns, "campaign_of", lambda table, path: asked.append((table, path)) or plan)
    monkeypatch.setattr(campaigns, "on_devices", lambda one, devices: asked.append(devices) or one)
    monkeypatch.setattr(campaigns, "replay", lambda one, number: asked.append(number) or (runs, policy, run))
    found = replayed(tmp_path, 17, tmp_path / "run.csv")
    assert asked == [({"x": 1}, HERE), ["cpu"], 17]
    assert (found.ship, found.inputs, found.complete, found.indices) == ("a", {"U_T": 4.0}, True, {"L": ("r", 7.0)})
    assert (tmp_path / "run.csv").exists()
    plan.digest = "other"
    with pytest.raises(RequestError, match="have changed since"):
        replayed(tmp_path, 17)
    held.manifest.text = None
    with pytest.raises(RequestError, match="not begun from a campaign file"):
        replayed(tmp_path, 17)


# --- what a campaign shows ---


def test_units_of_a_campaign_are_those_of_its_cases_in_its_weather(monkeypatch: pytest.MonkeyPatch) -> None:
    cases = [{"advance": "m"}, {"first_overshoot": "rad"}]
    plan = SimpleNamespace(cases=cases, weather="calm")
    monkeypatch.setattr(analysing, "campaign_of", lambda table, path: plan)
    monkeypatch.setattr(analysing, "index_units", lambda case, weather: case if weather == "calm" else {})
    held: Any = Held()
    assert analysing._units(held) == {"advance": "m", "first_overshoot": "rad"}
    for gone in ({"text": None}, {"source": None}):
        bare: Any = Held()
        vars(bare.manifest).update(gone)
        assert analysing._units(bare) == {}

    def refuse(table: Any, path: Path) -> Any:
        raise RequestError("gone")

    monkeypatch.setattr(analysing, "campaign_of", refuse)
    assert analysing._units(held) == {}


def rare_case() -> Any:
    levels = (SimpleNamespace(bound=math.inf, share=0.1, accepted=0.5, margins=np.zeros(3)),)
    estimate = SimpleNamespace(probability=1e-4, variation=0.3, interval=(5e-5, 2e-4))
    return SimpleNamespace(case="a", levels=levels, reached=True, runs=1600, unknown=0.01, nearest={"U_T": 9.0},
                           distance=4.5, run=12, estimate=estimate)  # fmt: skip


@pytest.mark.parametrize(("runs", "wanted"), [(None, 1600), (100, 100)])
def test_a_search_for_a_rare_violation_leaves_numbers_and_a_page(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, runs: int | None, wanted: int
) -> None:
    bound = SimpleNamespace(index="advance", low=None, high=3.0)
    plan = SimpleNamespace(name="n", criteria={"far": bound}, cases=[{}, {"advance": "m"}], weather="calm", seed=7,
                           digest="d")  # fmt: skip
    case, calls = rare_case(), list[Any]()
    monkeypatch.setattr(analysing, "read_campaign", lambda path, note: plan)
    monkeypatch.setattr(analysing, "search", lambda *given, **more: calls.append((given, more)) or (case,))
    monkeypatch.setattr(analysing, "index_units", lambda one, weather: one if weather == "calm" else {})
    monkeypatch.setattr(analysing, "rare_page", lambda *given: calls.append(given) or "page")
    monkeypatch.setattr(analysing, "write", lambda path, page: calls.append((path, page)))
    found = analysing.rare(HERE, "far", tmp_path, runs=runs, threads=3)
    (searched, how), shown, written = calls
    assert searched == (plan, "far", tmp_path)
    assert (how["runs"], how["threads"], how["source"]) == (wanted, 3, HERE)
    assert shown[:6] == ("n", "far", bound, (case,), "m", str(tmp_path))
    assert (shown[6]["seed"], shown[6]["digest"]) == ("7", "d")
    assert written == (tmp_path / "report.html", "page")
    document = json.loads((tmp_path / "rare.json").read_text())
    assert (document["criterion"], document["bound"]["high"]) == ("far", 3.0)
    (told,) = document["cases"]
    assert told["interval"] == [5e-5, 2e-4]
    assert (told["probability"], told["variation"], told["distance"], told["run"]) == (1e-4, 0.3, 4.5, 12)
    assert told["levels"] == [{"margin": None, "share": 0.1, "accepted": 0.5}]
    assert (found.criterion, found.cases) == ("far", (case,))
    with pytest.raises(RequestError, match="--threads is 0"):
        analysing.rare(HERE, "far", tmp_path, threads=0)


def test_a_report_never_overwrites_the_manifest(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    held: Any = Held(path=tmp_path)
    monkeypatch.setattr(analysing, "open_folder", lambda where: held)
    monkeypatch.setattr(analysing, "analyse", lambda one: ("analysis", one is held))
    monkeypatch.setattr(analysing, "_units", lambda one: {"advance": "m"})
    monkeypatch.setattr(analysing, "page", lambda *given: given)
    monkeypatch.setattr(analysing, "write", lambda path, page: (path, page))
    path, (analysis, units, origin) = analysing.report(tmp_path)  # type: ignore[misc]
    assert path == tmp_path / "report.html"
    assert analysis == ("analysis", True)
    assert units == {"advance": "m"}
    assert origin == {"campaign": str(HERE), "folder": "everywhere", "seed": "7", "digest": "d", "seatrial": "1.0"}
    manifest = Path(analysing.MANIFEST).with_suffix(".html").name
    with pytest.raises(RequestError, match="would overwrite"):
        analysing.report(tmp_path, tmp_path / manifest)
    assert analysing.report(tmp_path, tmp_path.parent / manifest)[0] == tmp_path.parent / manifest  # type: ignore[index]


# --- what a card says of calibrated bands ---


class Heard:
    def __init__(self) -> None:
        self.notes: list[str] = []

    def note(self, line: str) -> None:
        self.notes.append(line)


@pytest.fixture
def bands(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> dict[str, Any]:
    """A calibration of three recordings of two kinds that reaches 80 s, and what is asked of it."""
    asked: dict[str, Any] = {"fans": [], "reach": 80.0}
    left = SimpleNamespace(kinds=("zigzag", "turning", "zigzag"), groups=("a", "b", "c"))

    def reach(level: float) -> float:
        if asked["reach"] is None:
            raise RequestError("too few recordings")
        return asked["reach"] * (level == 0.95)

    found = SimpleNamespace(left=left, reach=reach, errors={})
    (tmp_path / "calibration").touch()
    monkeypatch.setattr(carded, "beside", lambda model: tmp_path / "calibration" if model == "m" else tmp_path / "no")
    monkeypatch.setattr(carded, "load", lambda model, held: found)
    monkeypatch.setattr(carded, "of_one_day", lambda one: ["of one day"])
    monkeypatch.setattr(carded, "crossed", lambda one, level: ("crossed", level))
    monkeypatch.setattr(carded, "replay", lambda ship, trial, restart: (ship, trial.name, restart))

    def fan(held: Any, one: Any, trial: Any, predicted: Any, level: float, **how: Any) -> Any:
        if trial.name == "bad":
            raise DataError("no wind")
        asked["fans"].append((held, one is found, trial.name, predicted, level, how))
        return SimpleNamespace(notes=("a note",), trial=trial.name)

    monkeypatch.setattr(carded, "fan", fan)
    monkeypatch.setattr(carded, "windows", lambda own, trial, horizons: (own.trial, tuple(horizons)))
    monkeypatch.setattr(carded, "held", tuple)
    return asked


def held_posterior(**covered: Any) -> Any:
    return SimpleNamespace(ship=SimpleNamespace(model=SimpleNamespace(controls=())), grounds=Grounds(covered=covered))


@pytest.mark.parametrize(("seconds", "horizons"), [(200.0, (8.0, 40.0, 80.0)), (50.0, (5.0, 25.0, 50.0))])
def test_bands_are_judged_up_to_their_reach_or_the_restart(bands: Any, seconds: float, horizons: Any) -> None:
    held, trial = held_posterior(), Trial("t", np.arange(3.0), {})
    found = carded.calibrated_of("m", held, [trial], seconds, Heard())
    assert found is not None
    assert (found.recordings, found.kinds, found.reach) == (3, ("turning", "zigzag"), 80.0)
    assert found.unseen == (("t", pytest.approx(horizons)),)
    assert found.left_out == ("crossed", 0.95)
    assert found.doubts == ("of one day", "t: a note")
    ((one, own, name, predicted, level, how),) = bands["fans"]
    assert (one is held, own, name, level) == (True, True, "t", 0.95)
    assert predicted == (held.ship, "t", seconds)
    assert (how["restart"], how["draws"]) == (seconds, 300)


def test_what_has_no_bands_is_a_doubt_and_what_has_no_calibration_nothing(bands: dict[str, Any]) -> None:
    heard = Heard()
    trials = [Trial(name, np.arange(3.0), {}) for name in ("bad", "good")]
    found = carded.calibrated_of("m", held_posterior(), trials, 60.0, heard)
    assert found is not None
    assert found.doubts == ("of one day", "bad has no bands: no wind", "good: a note")
    assert [name for name, _ in found.unseen] == ["good"]  # type: ignore[misc]
    assert carded.calibrated_of("other", held_posterior(), trials, 60.0, heard) is None
    assert carded.calibrated_of("m", None, trials, 60.0, heard) is None
    assert heard.notes == []
    bands["reach"] = None
    assert carded.calibrated_of("m", held_posterior(), trials, 60.0, heard) is None
    assert heard.notes == ["warning: too few recordings"]


def test_a_trial_beyond_those_of_the_fit_is_a_doubt(bands: dict[str, Any]) -> None:
    held = held_posterior(u=(0.0, 5.0))
    trials = [Trial("t", np.arange(3.0), {"u": np.array([1.0, u, 1.0])}) for u in (5.4, 6.0)]
    within, over = (carded.calibrated_of("m", held, [one], 60.0, Heard()) for one in trials)
    assert within is not None
    assert not any("leaves" in line for line in within.doubts)
    assert over is not None
    assert over.doubts[1] == "t leaves the trials of the fit: surge speed 1.00 to 6.00 m/s (trials: 0 to 5.00)"


def calibration(power: Any = None) -> Any:
    """Two windows at three horizons, the last of which none reaches; kinds turning, and any other."""
    spread = np.array([1.0, 3.0])[:, None, None] * np.ones((2, 3, 6))
    spread[:, 2] = np.nan
    left = SimpleNamespace(groups=("2020-01-02 a", "2020-01-02 b"), trials=("a", "b"), kinds=("turning",) * 2,
                           horizons=np.array([10.0, 20, 40]), spread=spread, novelty=None,
                           usual=8.0 * np.ones((3, 6)))  # fmt: skip
    factor = np.array([2.0, 5.0])[:, None, None] * np.ones((2, 3, 6))
    made = SimpleNamespace(factor=factor, kinds=("turning", ""), recordings=np.array([[2, 2, 0], [2, 2, 0]]))
    process = [SimpleNamespace(sigma=0.0, tau=1.0), SimpleNamespace(sigma=0.5, tau=30.0)]
    return SimpleNamespace(
        level=0.95, fit="digest", trials=("a", "b"), left=left, share=1.0 / 3.0, novel=0.0, power=power,
        begin="measured",
        factors=lambda level: made, reach=lambda level: 20.0,
        disturbance=SimpleNamespace(current=0.1, processes=process),
    )  # fmt: skip


def test_half_widths_are_the_factor_times_the_usual_spread(monkeypatch: pytest.MonkeyPatch) -> None:
    """The median spread of 2 to a third, times the 8 of all windows to two thirds; 1 where no window reaches."""
    usual = 2.0 ** (1.0 / 3.0) * 4.0
    np.testing.assert_allclose(calibrate._usual(calibration())[:2], usual)
    np.testing.assert_allclose(calibrate._usual(calibration())[2], 4.0)
    document = calibrate._document(calibration(), Path("c.npz"))
    assert (document["recordings"], document["windows"], document["reach"]) == (2, 2, 20.0)
    assert document["kinds"] == ["turning"]
    assert document["left_out"] is None
    assert document["disturbance"] == {"current": 0.1, "accelerations": [{"sigma": 0.5, "tau": 30.0}]}
    assert set(document["half_width"]) == {"turning", "any other"}
    np.testing.assert_allclose(document["half_width"]["turning"]["x"], [2.0 * usual, 2.0 * usual, 8.0])
    np.testing.assert_allclose(document["half_width"]["any other"]["psi"], [5.0 * usual, 5.0 * usual, 20.0])
    power = SimpleNamespace(numbers=lambda: {"factor": 2.0}, words=("counted by half",))
    assert calibrate._document(calibration(power), Path("c"))["left_out"] == {"factor": 2.0}
    assert len(STATES) == 6
    new = calibration()
    new.novel, new.left.novelty = 0.5, np.array([[4.0, 9.0, 1.0], [4.0, 9.0, 1.0]])
    np.testing.assert_allclose(calibrate._usual(new)[:2], usual * np.array([[2.0], [3.0]]) * np.ones((2, 6)))
    assert any("less like the trials of the fit, by its root" in one.text for one in calibrate._shown(new)[1:])


def test_a_terminal_shows_the_first_the_middle_and_the_last_horizon_in_degrees() -> None:
    found = calibration()
    found.left.horizons = np.array([10.0, 20.0, 40.0, 60.0, 80.0])
    found.left.spread = np.full((2, 5, 6), 8.0)
    found.left.usual = np.full((5, 6), 8.0)
    made = SimpleNamespace(factor=np.ones((1, 5, 6)), kinds=("",), recordings=np.array([[9, 8, 7, 6, 5]]))
    found.factors = lambda level: made
    rows, *said = calibrate._shown(found)
    assert [row[:3] for row in rows.rows] == [("any other", h, n) for h, n in (("10", "9"), ("40", "7"), ("80", "5"))]
    assert rows.rows[0][3:] == ("8", "8", "4.6e+02", "8", "8", "4.6e+02")
    lines = [one.text for one in said]
    assert lines[0] == "half widths of usual bands of 95 %, by kind of manoeuvre"
    assert lines[1] == "bands hold up to 20 s from a start"
    found.begin = "history"
    assert calibrate._shown(found)[1].text.endswith("; predictions by --history")
