"""A safety case: counted runs with their interval, runs that go on, a stack of one's own, and what cannot be asked."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from s57_cell import Cell
from seatrial.cli.app import main
from seatrial.core.errors import StudyError
from seatrial.core.records import read_record
from seatrial.encounters import Tracks
from seatrial.encounters.conduct import CONDUCTS, Scene, Watch
from seatrial.encounters.meeting import dnv, imazu
from seatrial.encounters.rules import Alone, Role, Waters
from seatrial.encounters.rules.waters import AGROUND, CONTOUR
from seatrial.encounters.sailing import Sailing, Sea
from seatrial.encounters.sensing import Sensing
from seatrial.environment.chart import Area, Chart
from seatrial.environment.enc import read_cell
from seatrial.report.judging.encounter import _COAST, _CONTOUR
from seatrial.ships.files import load
from seatrial.workflow import RequestError
from seatrial.workflow.safety import argued
from seatrial.workflow.safety import case as module
from seatrial.workflow.safety.case import case
from seatrial.workflow.safety.claimed import CONTACT, MUTE, Around, Case, CaseFile, Encountered, Met, Part, Where
from seatrial.workflow.safety.setting import alike, place_in
from seatrial.workflow.safety.stacks import Stack

TEXT = '''schema = "seatrial-case/1"
claim = "it keeps clear"
ship = "kvlcc2_l7"
stack = "{stack}"
traffic = ["ignores"]
[encounters]
roles = ["give-way"]
runs = {runs}
'''


def written(folder: Path, stack: str = "rules", runs: int = 4, more: str = "") -> Path:
    path = folder / "case.toml"
    path.write_text(TEXT.format(stack=stack, runs=runs) + more, encoding="utf-8")
    return path


def test_shares_are_of_the_runs_to_which_a_rule_applied() -> None:
    first = Part("d", 0, (("15", CONTACT), (), None), (("15",), ("15", "16"), ()))
    parts = (first, Part("d", 3, (("16",),), (("16",),)))
    found = Case(CaseFile(claim="c", ship="s"), "d", parts, "")
    assert (found.share("15").hits, found.share("15").runs) == (1, 2)
    assert (found.share("16").hits, found.share("16").runs) == (1, 2)
    assert (found.share(CONTACT).hits, found.share(CONTACT).runs) == (1, 3)  # a model that failed is no evidence
    low, high = found.share(CONTACT).interval  # Clopper and Pearson by the beta distribution
    assert (low, high) == pytest.approx((0.00840, 0.90570), abs=1e-4)
    [failed, known] = argued._split(found)
    assert failed.startswith("1 runs ended in a failure of the model")
    assert known.startswith("ship: taken as known exactly")


def test_what_the_error_of_the_ship_adds_is_counted_by_pairs() -> None:
    part = Part("d", 0, (("15",), ("15",), (), ("8(d)",)), ((),) * 4, (("15",), (), (), None))
    found = Case(CaseFile(claim="c", ship="s"), "d", (part, Part("d", 4, (("15",),), ((),))), "f1")
    said, shares = argued._split(found)  # the second part was not sailed again
    assert "2 of 3 break a rule with ships drawn from fit f1, 1 on the ship as it was fitted; 1 do so only" in said
    assert shares.startswith("stack and encounters: 33.3 %; the ship's error adds 33.3 points")
    split: Any = argued.document(found)["split"]
    assert (split["runs"], split["drawn"], split["fitted"]) == (3, pytest.approx(2 / 3), pytest.approx(1 / 3))
    # 1 of 3 and 0 of 3 by Clopper and Pearson at 97.5 %: the roots of p^3 + 3 p^2 q, q^3 and so on = .0125
    assert (split["low"], split["high"]) == pytest.approx((0.00418 - 0.76792, 0.93398), abs=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("worse", [0.0, 0.02, 0.2])
def test_what_the_ship_adds_lies_within_its_interval(worse: float) -> None:
    """Of 200 cases of 500 pairs each, in which a share fails on the drawn ship only and .05 on the fitted one only."""
    rng, held = np.random.default_rng(4), 0
    for _ in range(200):
        which = rng.choice(4, 500, p=(worse, 0.05, 0.1, 0.85 - worse))
        drawn, plain = (tuple(("15",) if one in some else () for one in which) for some in ((0, 2), (1, 2)))
        part = Part("d", 0, drawn, ((),) * 500, plain)
        value, low, high = Case(CaseFile(claim="c", ship="s"), "d", (part,), "").added
        assert value == pytest.approx(((which == 0).sum() - (which == 1).sum()) / 500)
        assert high - low < 0.14
        held += low <= worse - 0.05 <= high
    assert held >= 190


@pytest.mark.parametrize(("runs", "again"), [(4000, 4), (10_000, 10), (19_000, 19), (40_000, 10), (100_000, 10)])
def test_of_many_runs_some_parts_are_sailed_on_both_ships(runs: int, again: int, monkeypatch: Any) -> None:
    plains: list[int] = []
    monkeypatch.setattr(module, "_of_part", lambda _, rows, plain: (plains.append(rows.start) if plain else None) or [])
    setup: Any = SimpleNamespace(together=1000, runs=runs, posterior=object(), digest="d")
    for first in range(0, runs, 1000):
        module._part(setup, first)
    assert len(plains) == again
    assert len(set(np.diff(plains))) == 1


@pytest.mark.parametrize("some", [imazu(5.0, 600.0), dnv(5.0)], ids=["imazu", "dnv"])
def test_fixed_sets_have_as_many_ships_in_each_run_and_nobody_meets_those_added(some: Any) -> None:
    most = max(len(one.x) for one in some)
    whole = alike(some, most)
    assert whole.x.shape == (len(some), most)
    for k, one in enumerate(some):
        n = len(one.x)
        assert (whole.x[k, :n] == one.x).all()
        assert (whole.psi[k, :n] == one.psi).all()
        assert (whole.U_target[k, :n] == one.U_target).all()
        assert (whole.roles[k, n:] == Role.NONE).all()
        assert (whole.approach[1][k, n:] <= 0.0).all()  # they draw apart from the first
        assert (np.hypot(whole.x, whole.y)[k, n:] > 5e5).all()


def test_a_run_that_failed_is_none_and_the_others_keep_their_places() -> None:
    one: Any = SimpleNamespace(ship=0, margins={"15": np.array([1.0, -1.0])}, contact=np.array([False, False]),
                               gap=np.array([7.0, 3.0]), broken=lambda where: ("15",) if where == (1,) else ())
    zero = np.zeros((2, 2, 3))
    tracks: Any = SimpleNamespace(t=np.arange(3.0), x=zero, psi=zero, u=zero, v_m=zero)
    sailed: Any = SimpleNamespace(tracks=tracks, runs=np.array([0, 2]), silent=np.array([np.nan, 30.0]))
    setup: Any = SimpleNamespace(judged=lambda tracks: ((one,), Alone()), grounds=None,
                                 current=lambda first, count: np.zeros((2, count)))  # fmt: skip
    found = module._broken(setup, sailed, slice(10, 13))
    broken, applied = (tuple(getattr(one, name) for one in found) for name in ("broken", "judged"))
    assert [one.closest for one in found] == [7.0, None, 3.0]
    assert broken == ((), None, ("15", MUTE))
    assert applied == (("15",), (), ("15",))


LONG_SHIP: Any = SimpleNamespace(L_pp=320.0)


def test_a_model_is_met_at_the_times_of_its_ship_by_the_law_that_judges_it(tmp_path: Path) -> None:
    """Thresholds go with the root of the length: at those of a ship nobody meets a model within their horizon."""
    file = CaseFile(claim="c", ship="kvlcc2_l7", encounters=Encountered(runs=400))
    small, large = (module.Setup.of(replace(file, ship=ship), tmp_path) for ship in ("kvlcc2_l7", "kvlcc2"))
    L = small.ship.L_pp
    for setup, scale in ((small, math.sqrt(L / 300.0)), (large, 1.0)):
        T = setup.meeting.approach[1]
        assert 600.0 * scale <= T.min() < 610.0 * scale
        assert 1190.0 * scale < T.max() <= 1200.0 * scale
        assert T.min() < setup.rules.horizon.of(np.array(setup.ship.L_pp))
        assert pytest.approx((600.0 * scale, 1200.0 * scale)) == setup.space.ranges.T
    # 10 s by the root of 7/300, in steps of half a second; of a long run no more than 600 rows
    assert [small.every(duration) for duration in (60.0, 900.0, 2640.0)] == [1.5, 1.5, 4.5]
    assert [large.every(duration) for duration in (60.0, 2640.0, 12_000.0)] == [10.0, 10.0, 20.0]
    fixed = [module.Setup.of(replace(file, ship=ship, encounters=Encountered(set="imazu")), tmp_path).meeting
             for ship in ("kvlcc2_l7", "kvlcc2")]  # fmt: skip
    near = [float(np.max(one.approach[1][np.isfinite(one.approach[1])])) for one in fixed]
    assert near[0] / near[1] == pytest.approx(math.sqrt(L / 300.0), rel=1e-6)


def test_each_part_has_its_own_draws_of_the_ship(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = np.arange(12.0).reshape(6, 2)
    posterior: Any = SimpleNamespace(names=("a", "b"), draws=lambda count, seed: drawn)
    taken: list[Any] = []
    monkeypatch.setattr(module, "sail", lambda *given: taken.append(given))
    met = imazu(5.0, 600.0)[1]
    some = module.Meeting(np.full(6, 5.0), *(np.tile(np.atleast_2d(one), (6, 1))
                                             for one in (met.x, met.y, met.psi, met.U_target)))  # fmt: skip
    setup = module.Setup(CaseFile(claim="c", ship="s"), LONG_SHIP, posterior, some, "rules", module.Rules(), "d")
    for rows, plain in ((slice(4, 6), False), (slice(4, 6), True)):
        setup.sailed(rows, 4, plain)
    assert taken[0][6]["a"].tolist() == [8.0, 10.0]
    assert taken[0][6]["b"].tolist() == [9.0, 11.0]
    assert taken[1][6] is None
    assert len(taken[0][1].x) == 2


@pytest.mark.parametrize("stack", ["rules", "own"])
def test_sensors_stand_between_the_stack_and_the_ships(monkeypatch: pytest.MonkeyPatch, stack: str) -> None:
    """With no sensor at all nobody is seen: the stack is shown ships that are far astern, and keeps its course."""
    shown: list[Any] = []

    class Mine:
        def look(self, scene: Any) -> Any:
            shown.append(scene)

    met = imazu(5.0, 600.0)[4]
    some = module.Meeting(np.full(2, 5.0), *(np.tile(one, (2, 1)) for one in (met.x, met.y, met.psi, met.U_target)))
    given: Any = stack if stack == "rules" else lambda scene: Mine()
    taken: list[Any] = []
    monkeypatch.setattr(module, "sail", lambda *all_: taken.append(all_))
    for sensors in (None, Sensing()):
        file = CaseFile(claim="c", ship="s", sensors=sensors)
        module.Setup(file, LONG_SHIP, None, some, given, module.Rules(), "d").sailed(slice(0, 2), 0, plain=True)
    assert taken[0][3] is given
    L = np.array([100.0, 100.0, 100.0])
    none = np.zeros((2, 1))
    x, y, psi = (np.hstack([none, one]) for one in (some.x, some.y, some.psi))
    speed = np.hstack([none + 5.0, some.U_target])
    scene = Scene(0.0, x, y, psi, speed * np.cos(psi), speed * np.sin(psi), L)
    orders = taken[1][3](scene).look(scene)
    if stack == "own":
        assert (shown[0].x[:, 1:] < -9e5).all()
        assert (shown[0].x[:, 0] == 0.0).all()
    else:
        assert orders.psi.tolist() == [0.0, 0.0]
        seen = Watch((CONDUCTS["rules"],), np.zeros(2, dtype=np.intp), 0, scene, speed[:, 0], module.Rules())
        assert (seen.look(scene).psi > 0.1).all()  # with its eyes it alters course here


@pytest.mark.slow
def test_a_case_is_run_once_and_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    monkeypatch.setattr(module, "_TOGETHER", 2)
    path, out = written(tmp_path), tmp_path / "out"
    whole = case(path, out).result
    assert [part.first for part in whole.parts] == [0, 2]
    (out / "part-0000002.json").unlink()
    sailed: list[int] = []
    real = module.Setup.sailed
    monkeypatch.setattr(module.Setup, "sailed", lambda self, rows, first, plain: sailed.append(first)
                        or real(self, rows, first, plain))  # fmt: skip
    again = case(path, out).result
    assert again == whole
    assert sailed in ([2], [2, 0], [2, 2], [2, 0, 2])  # what failed is sailed again to be drawn
    assert main(["case", str(path), "-o", str(out), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert (said["runs"], said["failed"], said["digest"]) == (4, 0, whole.digest)
    assert said["rules"][CONTACT]["high"] == pytest.approx(1.0 - 0.025 ** (1 / 4))  # no hit in four runs
    assert "seatrial case" in (out / "case.html").read_text(encoding="utf-8")
    written(tmp_path, runs=5)
    with pytest.raises(RequestError, match=r"part-0000000\.json: is of another case"):
        case(path, out)


@pytest.mark.slow
def test_two_shards_write_the_bytes_of_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def parts(folder: str) -> dict[str, bytes]:
        return {one.name: one.read_bytes() for one in sorted((tmp_path / folder).glob("part-*"))}

    path = written(tmp_path, runs=1001)
    monkeypatch.setattr(module, "LONG", 0.05)  # of each run the beginning
    case(path, tmp_path / "one")
    first = case(path, tmp_path / "shards", shard="2/2")
    assert first.result.parts[0].first == 1000
    assert not (tmp_path / "shards" / "case.html").exists()
    case(path, tmp_path / "shards", shard="1/2")
    assert (tmp_path / "shards" / "case.html").read_bytes() == (tmp_path / "one" / "case.html").read_bytes()
    assert parts("shards") == parts("one")
    assert sorted(parts("one")) == ["part-0000000.json", "part-0001000.json"]


@pytest.mark.slow
def test_who_does_not_give_way_breaks_the_rules_and_is_drawn(tmp_path: Path) -> None:
    (tmp_path / "stack.py").write_text(
        "import numpy as np\n"
        "from seatrial.encounters.conduct import Orders\n"
        "class Straight:\n"
        "    def look(self, scene):\n"
        "        return Orders(np.zeros(len(scene.x)), np.ones(len(scene.x)))\n"
        "def begin(scene):\n"
        "    return Straight()\n", encoding="utf-8")  # fmt: skip
    found = case(written(tmp_path, "stack.py:begin"), tmp_path / "out").result
    assert all("16" in (one or ()) for one in found.broken)
    assert all(CONTACT in (one or ()) for one in found.broken)  # all meet at one place
    page = (tmp_path / "out" / "case.html").read_text(encoding="utf-8")
    assert page.count("<svg") >= 4
    assert "own ship as give-way" in page
    assert "Sawada et al. 2024, section 6.2" in page
    plain = case(written(tmp_path, "ignores"), tmp_path / "two").result
    assert plain.broken == found.broken


def test_weather_is_within_its_range_and_from_all_sides() -> None:
    file = CaseFile(claim="c", ship="s", weather=Around(wind=(3.0, 9.0), current=(1.0, 1.0)))
    setup: Any = SimpleNamespace(file=file)
    around = module.Setup._around(setup, 0, 4000)
    speed = np.hypot(around[:, 0], around[:, 1])
    assert (speed.min() >= 3.0, speed.max() <= 9.0) == (True, True)
    assert speed.mean() == pytest.approx(6.0, abs=0.1)
    assert np.abs(np.mean(around[:, :2], axis=0)).max() < 0.3
    assert np.hypot(around[:, 2], around[:, 3]) == pytest.approx(np.ones(4000))
    assert np.abs(np.mean(around[:, 2:4], axis=0)).max() < 0.06
    assert not around[:, 4:].any()
    assert (module.Setup._around(setup, 500, 10) != around[:10]).any()


@pytest.mark.parametrize(("change", "said"), [
    ({"stack": "rulez"}, "stack: no conduct 'rulez'"),
    ({"stack": "none.py:begin"}, "no such Python file"),
    ({"traffic": ("rule",)}, "traffic: no conduct 'rule'"),
    ({"traffic": ()}, "traffic: name a conduct"),
    ({"weather": Around(wind=(5.0, 1.0))}, "the least comes first"),
    ({"encounters": Encountered(roles=())}, "encounters.roles: name one"),
    ({"encounters": Encountered(set="given")}, "encounters.ships: give one at least"),
    ({"encounters": Encountered(set="given", ships=(Met(x=1e4, y=0.0, psi=3.0, U=1.0, conduct="port"),))},
     "conduct 'port' is not in traffic"),
    ({"weather": Around(wind_from=(1.0, 0.5))}, "weather.wind_from: 1 to 0.5; the least comes first"),
    ({"encounters": Encountered(kinds=("fishing",) * 4)}, "encounters.kinds: 4 of them; 3 ships are met at most"),
    ({"encounters": Encountered(kinds=("fishing",)), "stack": Stack(command="python a.py")}, "is not told kinds"),
    ({"sensors": Sensing(), "stack": Stack(speaks="signalk", command="python a.py")}, "Signal K tells ships"),
    ({"waters": Where(safety=20.0)}, "is of a chart; give chart too"),
    ({"waters": Where(at=(1.0, 0.0))}, "is of a chart; give chart too"),
    ({"waters": Where(chart="none")}, r"waters\.chart: .*none"),
    ({"waters": Where(chart="canal", safety=0.1)}, "and the depth no less"),
])  # fmt: skip
def test_what_cannot_be_asked_is_a_line(tmp_path: Path, change: dict[str, Any], said: str) -> None:
    with pytest.raises(RequestError, match=said):
        module.Setup.of(CaseFile(claim="c", ship="kvlcc2_l7", **change), tmp_path)


@pytest.mark.slow
def test_a_case_is_judged_where_it_is_and_a_search_is_of_open_water(tmp_path: Path) -> None:
    """On 30 deg from (100, -200) a ship 1000 m on and 20 m to starboard is at (956, 317); there its shoal is."""
    (tmp_path / "c.geojson").write_text(json.dumps({
        "type": "FeatureCollection", "schema": "seatrial-chart/1", "frame": "metres", "depth": 50.0, "features": [
            {"type": "Feature", "properties": {"kind": "depth", "depth": 0.3}, "geometry": {"type": "Polygon",
             "coordinates": [[[250, 900], [350, 900], [350, 1030], [250, 1030], [250, 900]]]}}]}), encoding="utf-8")
    where = Where(chart="c.geojson", at=(100.0, -200.0), psi=np.pi / 6.0, safety=1.0, visibility=900.0)
    file = CaseFile(claim="c", ship="kvlcc2_l7", waters=where, encounters=Encountered(kinds=("fishing",)))
    setup = module.Setup.of(file, tmp_path)
    assert setup.waters.draught == pytest.approx(0.455, abs=0.01)  # of its file
    under = Sailing(setup.ship, setup._some(slice(0, 2)), Sea(10.0, start=np.array([setup.start])), ("ignores",))
    x, y, psi, _, drift = under.fleet.motion[:, 0]
    assert (x[0], y[0], psi[0], drift[0]) == pytest.approx((100.0, -200.0, np.pi / 6.0, 0.0))
    met = setup.meeting  # the other ship is seen from there, on the way of both
    far, bearing = np.hypot(met.x[0, 0], met.y[0, 0]), np.arctan2(met.y[0, 0], met.x[0, 0])
    towards = bearing + np.pi / 6.0
    assert (x[1] - x[0], y[1] - y[0]) == pytest.approx((far * np.cos(towards), far * np.sin(towards)))
    assert psi[1] - psi[0] == pytest.approx(met.psi[0, 0])
    t = np.linspace(0.0, 200.0, 21)
    zero, c, s = np.zeros((2, 21)), np.cos(np.pi / 6.0), np.sin(np.pi / 6.0)
    ahead = np.array([5.0 * t, 9000.0 + 0.0 * t])
    tracks = Tracks(t, 100.0 + ahead * c - 20.0 * s, -200.0 + ahead * s + 20.0 * c, zero + np.pi / 6.0,
                    zero + np.array([[5.0], [0.0]]), zero, np.full(2, 7.0), np.full(2, 1.0))  # fmt: skip
    _, by_itself = setup.judged(tracks)
    assert {AGROUND, CONTOUR} <= set(by_itself.broken())
    assert "6" in by_itself.margins  # visibility is restricted, so Rule 19 is judged
    assert setup.waters.restricted
    assert setup.ranks == (0, 2)
    assert len(setup.judged(tracks, own=False)[0]) == 2
    with pytest.raises(RequestError, match="a search is in open water"):
        _ = setup.space
    assert AGROUND not in setup.judged(replace(tracks, y=tracks.y + 200.0))[1].broken()
    moved = module.Setup.of(replace(file, waters=replace(where, psi=0.0)), tmp_path)
    assert moved.digest != setup.digest
    (tmp_path / "c.geojson").write_text((tmp_path / "c.geojson").read_text() + " ", encoding="utf-8")
    assert module.Setup.of(file, tmp_path).digest != setup.digest


@pytest.mark.slow
def test_a_cell_is_felt_judged_drawn_and_what_it_lacks_is_told(tmp_path: Path, capsys: Any) -> None:
    """Ahead of the ship lies a flat with 24 m, on which KVLCC2 (20.8 m) has h/d 1.15, and behind it one with 12 m."""
    pytest.importorskip("pyogrio", reason="the extra enc")
    cell = Cell()
    for south, north, depth in ((49.9, 50.04, 60), (50.04, 50.1, 24), (50.1, 50.3, 12)):
        cell.area("DEPARE", [(9.8, south), (9.8, north), (10.2, north), (10.2, south)], DRVAL1=depth, DRVAL2=depth)
        cell.line("DEPCNT", [(9.8, north), (10.2, north)], VALDCO=depth)
    cell.line("COALNE", [(9.8, 50.03), (10.2, 50.03)])
    cell.write(tmp_path / "ST4TEST.000")
    chart, datum = read_cell(tmp_path / "ST4TEST.000")
    x, y = datum.north_east(50.0, 10.0)
    path = tmp_path / "case.toml"
    where = f'[waters]\nchart = "ST4TEST.000"\nat = [{x}, {y}]\nsafety = 30.0\n'
    path.write_text(TEXT.format(stack="ignores", runs=2).replace("_l7", "_shallow").replace("[enc", f"{where}[enc"),
                    encoding="utf-8")  # fmt: skip
    setup = module.Setup.of(read_record(path, CaseFile, module.SCHEMA), tmp_path)
    own = setup.sailed(slice(0, 2), 0, plain=True).tracks
    over = np.interp(chart.depth_at(own.x[0, 0], own.y[0, 0]), (0.0, 24.0, 60.0), (0.0, 1.0, 2.0))
    deep, flat = own.u[0, 0, over == 2.0][-20], own.u[0, 0, over == 1.0][-10]
    assert flat < 0.95 * deep  # more resistance, the same revolutions
    assert main(["case", str(path), "-o", str(tmp_path / "out")]) == 0
    said = json.loads((tmp_path / "out" / "case.json").read_text(encoding="utf-8"))
    assert [said["rules"][rule]["broken"] for rule in (AGROUND, CONTOUR)] == [2, 2]
    page = (tmp_path / "out" / "case.html").read_text(encoding="utf-8")
    assert "squat, but for what the draught has of it" in page
    assert "chart: no" in page or "the chart: " in page  # what the cell lacks
    assert page.count('fill-rule="evenodd"') >= 3  # its areas
    assert page.count(f'stroke="{_CONTOUR}" stroke-width="0.6"') >= 2  # of the drawings, that end before the third
    assert page.count(f'stroke="{_COAST}" stroke-width="1.2"') >= 1
    bare = Cell()
    bare.line("COALNE", [(9.9, 50.0), (10.1, 50.0)])
    bare.write(tmp_path / "ST4TEST.000")
    capsys.readouterr()
    assert main(["case", str(path), "-o", str(tmp_path / "none")]) == 2
    assert len(capsys.readouterr().err.strip().splitlines()) == 1


def test_the_posterior_of_another_ship_is_refused_and_none_is_asked_of_a_ship_without_a_fit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:  # fmt: skip
    """It was taken for a ship that is known exactly."""
    def wrong(path: Path) -> Any:
        raise StudyError("is of another fit")

    monkeypatch.setattr(module, "posterior", wrong)
    model = tmp_path / "model.toml"
    assert module._posterior(model) is None
    (tmp_path / "fit.json").write_text("{}", encoding="utf-8")
    with pytest.raises(RequestError, match="ship: is of another fit; as_fitted = true takes"):
        module._posterior(model)
    assert module._posterior(tmp_path / "other.toml") is None


def test_ships_that_begin_in_contact_are_told_before_anything_is_sailed(tmp_path: Path, capsys: Any) -> None:
    path = written(tmp_path, more="""[[encounters.ships]]
x = 2.0
y = 0.4
psi = 3.0
U = 1.0
conduct = "ignores"
""")  # fmt: skip
    text = path.read_text(encoding="utf-8").replace('roles = ["give-way"]', 'set = "given"').replace("runs = 4\n", "")
    path.write_text(text, encoding="utf-8")
    assert main(["case", str(path), "-o", str(tmp_path / "out")]) == 2
    [said] = capsys.readouterr().err.strip().splitlines()
    assert "own and target 1 touch in the first row of 1 of 1 runs" in said
    assert not list((tmp_path / "out").glob("*.json"))


@pytest.mark.slow
def test_depth_is_felt_by_a_ship_whose_model_knows_it_down_to_where_that_holds() -> None:
    area = np.array([[-900.0, -900.0], [-900.0, 900.0], [900.0, 900.0], [900.0, -900.0]])
    waters = Waters(Chart("flat", areas=(Area(area, 21.0),)), 20.8)
    assert place_in(waters, load("kvlcc2")) is None
    place = place_in(waters, load("kvlcc2_shallow"))
    assert place is not None
    assert place.grid is not None
    assert 1.0 / place.grid.field.look(np.zeros(1), np.zeros(1))[0][0, 0] == pytest.approx(1.2 * 20.8)
    assert place_in(Waters(), load("kvlcc2_shallow")) is None


def test_a_wrong_file_is_one_line(tmp_path: Path, capsys: Any) -> None:
    path = written(tmp_path, more="wind = 3\n")
    assert main(["case", str(path), "-o", str(tmp_path / "out")]) == 2
    told = capsys.readouterr().err
    assert "encounters" in told
    assert told.count("\n") == 1
    assert not (tmp_path / "out").exists()
    assert main(["case", str(written(tmp_path, runs=0)), "-o", str(tmp_path / "out")]) == 2


def test_a_case_meets_the_ships_of_its_table_and_is_another_case_when_they_change(tmp_path: Path) -> None:
    rows = [f"{t},{ship},{55.0 + sign * (0.05 - 5e-5 * t)},11.0,10.8,{course}"
            for t in range(0, 900, 10) for ship, sign, course in ((1, 1, 180.0), (2, -1, 0.0))]  # fmt: skip
    path = tmp_path / "area.csv"
    path.write_text("t,mmsi,lat,lon,sog,cog\n" + "\n".join(rows), encoding="utf-8")
    file = CaseFile(claim="c", ship="kvlcc2", encounters=Encountered(set="ais", file="area.csv"))
    setup = module.Setup.of(file, tmp_path)
    assert setup.runs == 2
    assert np.abs(np.degrees(setup.meeting.psi)) == pytest.approx(np.full((2, 1), 180.0), abs=0.2)
    path.write_text(path.read_text(encoding="utf-8") + "\n900,1,55.0,11.0,10.8,180.0", encoding="utf-8")
    assert module.Setup.of(file, tmp_path).digest != setup.digest
    for wrong, said in ((Encountered(set="ais"), "encounters.file"), (Encountered(file="area.csv"), "encounters.file"),
                        (Encountered(set="ais", file="none.csv"), "none.csv: not a table")):  # fmt: skip
        with pytest.raises(RequestError, match=said):
            module.Setup.of(CaseFile(claim="c", ship="kvlcc2", encounters=wrong), tmp_path)


def test_what_widens_draws_is_of_the_inputs_that_are_signed(tmp_path: Path) -> None:
    """A calibration or samples that come later make another case; for a ship that is not drawn they are nothing."""
    file = CaseFile(claim="c", ship="model.toml")
    plain = module._beside(file, tmp_path, drawn=True)
    assert plain == []
    marks = []
    for name in ("model.bands.json", "posterior.npz"):
        (tmp_path / name).write_bytes(name.encode())
        marks.append(module._beside(file, tmp_path, drawn=True))
    assert [len(one) for one in marks] == [1, 2]
    assert marks[1][0] == marks[0][0]
    (tmp_path / "model.bands.json").write_bytes(b"wider")
    assert module._beside(file, tmp_path, drawn=True)[0] != marks[0][0]
    assert module._beside(file, tmp_path, drawn=False) == []
