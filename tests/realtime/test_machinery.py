"""FMUs aboard: what they give is what the gear gets, they step with the ship, and a return brings them back too."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest
from machines import (
    ENGINE,
    ENGINE_REALS,
    GOVERNOR,
    GOVERNOR_REALS,
    KEEPER,
    KEEPER_REALS,
    SYSTEM,
    wire,
)  # fmt: skip

from fmus import Real, fmu
from seatrial.core.constants import KNOT
from seatrial.core.errors import RequestError
from seatrial.core.records import document_of
from seatrial.realtime.range.stage import Stage
from seatrial.ships.classes import trusting
from seatrial.workflow.afloat.scenarios import scenario_of

pytestmark = pytest.mark.slow

# What it was given at the start, and the time.
CLOCK = r"""
static void begin(M *m, D *v) { v[1] = 0.1 * v[0]; v[2] = 0.01 * m->kept[7]; }
static S step(M *m, D *v, D t, D dt) { v[2] = 0.01 * (t + dt); return 0; }
"""
CLOCK_REALS = (Real("speed", 0, unit="knot"), Real("first", 1, "output"), Real("time", 2, "output"))
ENGINE_TABLE: dict[str, Any] = {"file": "engine.fmu", "reads": {"ordered": "n_P_cmd"}, "gives": {"shaft": "n_P"}}
KEEPER_TABLE: dict[str, Any] = {"file": "keeper.fmu", "reads": {"heading": "psi", "rate": "r"},
                                "gives": {"rudder": "delta_cmd"}}  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("fmus")
    for stem, body, reals in (("engine", ENGINE, ENGINE_REALS), ("keeper", KEEPER, KEEPER_REALS),
                              ("governor", GOVERNOR, GOVERNOR_REALS), ("clock", CLOCK, CLOCK_REALS)):  # fmt: skip
        fmu(made, stem, body, reals)
    return made


def stage(folder: Path, *tables: dict[str, Any], pilot: str = "none", page: bool = False, **more: Any) -> Stage:
    said = {"schema": "seatrial-scenario/1", "duration": 120.0, "rate": 10.0,
            "own": {"ship": "kvlcc2", "speed": 7.0, "pilot": pilot}, "fmu": list(tables), **more}  # fmt: skip
    with trusting(True):
        return Stage(scenario_of(said, folder / "scene.toml"), page=page)


def orders(one: Stage, name: str, seconds: float) -> list[float]:
    """What the gear of a control was ordered, tick by tick."""
    found: list[float] = []
    one.loop.after(lambda loop: found.append(loop.vessels["own"].plant[name]))
    one.loop.run(seconds)
    return found


def test_the_gear_gets_what_the_engine_gives_in_the_unit_of_the_ship(folder: Path) -> None:
    one = stage(folder, {**ENGINE_TABLE, "start": {"tau": 5.0, "idle": 30.0}})
    plant = one.loop.vessels["own"].plant
    wanted = 1.2
    assert plant["n_P_cmd"] == pytest.approx(30.0 / 60.0, rel=1e-12)  # from the start on
    one.loop.order("own", "n_P", wanted)
    found = orders(one, "n_P_cmd", 20.0)
    exact = [wanted + (0.5 - wanted) * math.exp(-0.1 * k / 5.0) for k in range(1, len(found) + 1)]
    assert found == pytest.approx(exact, rel=1e-12)


def test_fmus_begin_with_the_ship_and_keep_its_time(folder: Path) -> None:
    told = {"file": "clock.fmu", "reads": {"speed": "u"}, "start": {"speed": 3.0}}
    one = stage(folder, {**told, "gives": {"first": "n_P"}})
    plant = one.loop.vessels["own"].plant
    first = 0.1 * 7.0 / KNOT
    assert plant["n_P_cmd"] == pytest.approx(first, rel=1e-12)
    one.loop.run(60.0)
    assert abs(plant["u"] - 7.0) > 0.1
    one.loop.restore(one.loop.snapshot())  # what it was given at the start is that of the start
    one.loop.run(1.0)
    assert plant["n_P_cmd"] == pytest.approx(first, rel=1e-12)
    two = stage(folder, {**told, "gives": {"time": "n_P"}})
    found = orders(two, "n_P_cmd", 2.0)
    two.loop.restore(two.loop.snapshot())
    two.loop.run(2.0)
    assert two.loop.vessels["own"].plant["n_P_cmd"] == pytest.approx(0.04, rel=1e-9)
    assert found[:20] == pytest.approx([0.001 * k for k in range(1, 21)], rel=1e-9)
    three = stage(folder, {**told, "gives": {"time": "n_P"}}).loop.vessels["own"].plant
    assert three["n_P_cmd"] == 0.0


def test_the_gear_keeps_its_limits(folder: Path) -> None:
    one = stage(folder, {**ENGINE_TABLE, "start": {"idle": 1e5}})
    plant = one.loop.vessels["own"].plant
    assert plant["n_P_cmd"] == plant.ranges["n_P"].high


def test_a_controller_steers_as_the_same_law_in_python(folder: Path) -> None:
    one, other = stage(folder, KEEPER_TABLE), stage(folder)
    own = other.loop.vessels["own"].plant
    seen = [own["psi"], own["r"]]

    def steer(loop: Any) -> None:
        loop.order("own", "delta", 1.5 * (0.3 - seen[0]) - 20.0 * seen[1])  # by what was when the tick began
        seen[:] = own["psi"], own["r"]

    other.loop.after(steer)
    one.loop.run(100.0)
    other.loop.run(100.0)
    plant = one.loop.vessels["own"].plant
    assert plant["psi"] == pytest.approx(0.3, abs=0.1)
    assert [plant[name] for name in ("x", "y", "psi", "r")] == [own[name] for name in ("x", "y", "psi", "r")]


def test_an_fmu_that_steers_is_said_to_and_the_mariner_takes_the_ship_from_it(folder: Path) -> None:
    """An engine's FMU does not steer: who does is somebody else, and its orders go on."""
    one = stage(folder, KEEPER_TABLE, page=True)
    assert (one.handover.holder, one.handover.known) == ("fmu", ("fmu", "page"))
    assert stage(folder, ENGINE_TABLE).handover.holder == "nobody"
    assert stage(folder, ENGINE_TABLE, pilot="track").handover.holder == "pilot"
    plant, start = one.loop.vessels["own"].plant, one.loop.snapshot()
    one.loop.run(5.0)
    assert plant["delta_cmd"] > 0.1
    one.handover.hand(one.loop, "page")
    one.loop.order("own", "delta", -0.2)
    one.loop.run(5.0)
    assert plant["delta_cmd"] == pytest.approx(-0.2)
    one.handover.hand(one.loop, "fmu")
    one.loop.run(5.0)
    assert plant["delta_cmd"] > 0.1
    one.handover.hand(one.loop, "page")
    one.loop.restore(start)
    one.loop.run(5.0)
    assert (one.handover.holder, plant["delta_cmd"] > 0.1) == ("fmu", True)


def test_two_fmus_hear_of_each_other_what_was_when_the_step_began(folder: Path) -> None:
    heard = {"turns": "diesel.shaft", "wanted": "n_P_cmd"}
    one = stage(folder, {"file": "governor.fmu", "name": "gov", "reads": heard},
                {**ENGINE_TABLE, "name": "diesel", "reads": {"ordered": "gov.demand"}})  # fmt: skip
    one.loop.order("own", "n_P", 1.0)
    found = orders(one, "n_P_cmd", 30.0)
    shaft, demand, total, exact = 60.0, 60.0, 0.0, []
    for _ in found:
        before = shaft
        shaft = demand + (shaft - demand) * math.exp(-0.1 / 8.0)
        total += 0.1 * (60.0 - before)
        demand = 60.0 + 0.02 * total
        exact.append(shaft / 60.0)
    assert found == pytest.approx(exact, rel=1e-12)


def test_a_return_brings_the_fmus_back(folder: Path) -> None:
    tables = ENGINE_TABLE, KEEPER_TABLE
    one = stage(folder, *tables)
    one.loop.order("own", "n_P", 1.4)
    one.loop.run(25.0)
    saved = one.loop.snapshot()
    one.loop.run(25.0)
    end = one.digest
    one.loop.restore(saved)
    one.loop.run(25.0)
    assert one.digest == end
    another = stage(folder, *tables)
    another.loop.restore(saved)
    another.loop.run(25.0)
    assert another.digest == end
    one.loop.reset()
    one.loop.order("own", "n_P", 1.4)
    one.loop.run(50.0)
    assert one.digest == end


def test_a_fault_stands_between_the_order_and_the_engine(folder: Path) -> None:
    lost = {"kind": "lost", "of": "n_P", "at": 10.0}
    one = stage(folder, {**ENGINE_TABLE, "start": {"tau": 2.0}}, faults=[lost])
    one.loop.order("own", "n_P", 1.0)
    found = orders(one, "n_P_cmd", 20.0)
    assert found[95] == pytest.approx(1.0, rel=0.02)
    assert found[-1] == pytest.approx(math.exp(-10.0 / 2.0), rel=0.1)
    assert one.faults.ordered("n_P") == 1.0


@pytest.mark.parametrize(("start", "said"), [({"fails": 1.0}, "engine.fmu failed"), ({"fails": -1.0}, "shaft is nan")])
def test_an_fmu_that_fails_ends_the_run(folder: Path, start: dict[str, float], said: str) -> None:
    one = stage(folder, {**ENGINE_TABLE, "start": start})
    one.run(60.0)
    failure = one.loop.vessels["own"].failure
    assert failure is not None
    assert said in failure
    assert one.loop.t < 31.0


def engine(**more: Any) -> dict[str, Any]:
    return {**ENGINE_TABLE, **more}


@pytest.mark.parametrize(("tables", "said"), [
    ([engine(file="none.fmu")], r"fmu 1\.file: .*none\.fmu: no such file"),
    ([engine(reads={"order": "n_P_cmd"})], "no input 'order'; near: ordered"),
    ([engine(reads={"ordered": "n_p_cmd"})], "fmu 1.reads.ordered: no value of the ship 'n_p_cmd'; near: n_P_cmd"),
    ([engine(gives={"shaft": "u"})], "fmu 1.gives.shaft: no value of the ship 'u'"),
    ([engine(gives={"ordered": "n_P"})], "ordered is input of type Real; it must be a real output"),
    ([engine(gives={"shaft": "delta"})], "engine.fmu: shaft is in rpm; it must be in rad, deg"),
    ([engine(start={"taux": 1.0})], "fmu 1.start: no variable 'taux'; near: tau"),
    ([engine(), engine(name="two")], "fmu 2.gives.shaft: engine gives n_P already"),
    ([engine(), engine(gives={})], "two are called 'engine'"),
    ([engine(name="a.b")], "fmu 1.name: 'a.b' has a dot"),
    ([engine(reads={"ordered": "gov.demand"})], "no FMU 'gov'; known: engine"),
    ([engine(reads={}, gives={})], "fmu 1: is wired to nothing"),
    ([KEEPER_TABLE, engine(reads={"ordered": "keeper.rudder"})], "ordered is in rpm; it must be in rad"),
])  # fmt: skip
def test_wires_that_lead_nowhere_are_a_line(folder: Path, tables: list[dict[str, Any]], said: str) -> None:
    with pytest.raises(RequestError, match=said) as told:
        stage(folder, *tables)
    assert "\n" not in str(told.value)


def test_two_who_order_the_rudder_are_a_line(folder: Path) -> None:
    with pytest.raises(RequestError, match="keeper orders the rudder as the track pilot does; write pilot"):
        stage(folder, KEEPER_TABLE, pilot="track")


# -- a system of the Open Simulation Platform


def test_a_system_of_the_platform_is_the_same_as_its_tables(folder: Path) -> None:
    (folder / "OspSystemStructure.xml").write_text(SYSTEM, encoding="utf-8")
    one = stage(folder, system={"file": "OspSystemStructure.xml", "ship": "vessel"})
    other = stage(
        folder, {**ENGINE_TABLE, "name": "diesel", "start": {"tau": 3.0}, "reads": {"ordered": "governor.demand"}},
        {"file": "governor.fmu", "reads": {"turns": "diesel.shaft", "wanted": "n_P_cmd"}}, KEEPER_TABLE,
    )  # fmt: skip
    for each in (one, other):
        each.loop.order("own", "n_P", 1.3)
        each.loop.run(60.0)
    assert one.digest == other.digest
    plant = one.loop.vessels["own"].plant
    assert abs(plant["delta_cmd"]) > 1e-4
    assert plant["n_P_cmd"] == pytest.approx(1.3, rel=0.2)


@pytest.mark.parametrize(("old", "new", "said"), [
    ("0.1</Base", "0.5</Base", r"has steps of 0\.5 s; write rate = 2"),
    ("0.1</Base", "a</Base", "BaseStepSize is 'a'; it must be a number"),
    ('simulator="keeper" name="rate"', 'simulator="kept" name="rate"', "connects the simulator 'kept'; it has vessel"),
    ('name="order.delta"', 'name="wind_velocity.north"', "connects wind_velocity.north of the ship; its orders"),
    (wire(("keeper.rate", "vessel.body_velocity.yaw")), wire(("keeper.a", "vessel.b"), "VariableGroup"),
     "connects the groups keeper.a and vessel.b; name their variables"),
    ("<?xml version=\"1.0\" encoding=\"utf-8\"?>", "<!DOCTYPE a>", "declares entities of its own"),
    ('encoding="utf-8"', 'encoding="utf0x10"', "no whole XML file .unknown encoding"),
    ('encoding="utf-8"', 'encoding="shift_jis"', "no whole XML file .multi-byte encodings"),
    ("OspSystemStructure", "System", "its root is System; it must be OspSystemStructure"),
    ("</OspSystemStructure>", "", "no whole XML file"),
    ("</OspSystemStructure>", "<Functions><Sum name=\"s\"/></Functions></OspSystemStructure>", "has Functions"),
    ('<Real value="3"/>', '<String value="3"/>', "InitialValue diesel.tau has no Real or Integer"),
])  # fmt: skip
def test_a_system_that_cannot_be_played_is_a_line(folder: Path, tmp_path: Path, old: str, new: str, said: str) -> None:
    assert old in SYSTEM
    for one in folder.glob("*.fmu"):
        (tmp_path / one.name).symlink_to(one)
    (tmp_path / "s.xml").write_text(SYSTEM.replace(old, new), encoding="utf-8")
    with pytest.raises(RequestError, match=said) as told:
        stage(tmp_path, system={"file": "s.xml", "ship": "vessel"})
    assert "\n" not in str(told.value)


def test_the_ship_of_a_system_is_one_of_its_simulators(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "s.xml").write_text(SYSTEM, encoding="utf-8")
    with pytest.raises(RequestError, match="no simulator 'vesel'; near: vessel"):
        stage(tmp_path, system={"file": "s.xml", "ship": "vesel"})
    with pytest.raises(RequestError, match=r"none\.xml: cannot be read"):
        stage(tmp_path, system={"file": "none.xml", "ship": "vessel"})


def test_it_is_read_from_a_scenario_file(folder: Path) -> None:
    (folder / "scene.toml").write_text(
        'schema = "seatrial-scenario/1"\nduration = 10\n[own]\nship = "kvlcc2"\n[[fmu]]\nfile = "engine.fmu"\n'
        'reads = { ordered = "n_P_cmd" }\ngives = { shaft = "n_P" }\nstart = { tau = 4 }\n',
        encoding="utf-8")  # fmt: skip
    path = folder / "scene.toml"
    with pytest.raises(RequestError, match=r"engine\.fmu is a program, .*allow that by --trust engine"):
        scenario_of(document_of(path), path)
    with trusting("engine"):
        (found,) = scenario_of(document_of(path), path).aboard
    assert (found.name, dict(found.start), found.factors["shaft"]) == ("engine", {"tau": 4.0}, 1.0 / 60.0)
