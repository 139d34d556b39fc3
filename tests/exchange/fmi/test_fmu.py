"""Co-simulation slaves: the engine's trajectories in FMPy, in libcosim and in a host that is nothing but C."""

from __future__ import annotations

import io
import json
import math
import re
import shutil
import struct
import subprocess
import sys
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from slaves import AROUND, C_HOST, DT, GCC, GIVEN, STATES, Made, Run, assert_same, flown, orders

from seatrial.cli.app import main
from seatrial.core.version import __version__
from seatrial.exchange import save_fmu
from seatrial.exchange.fmi.binaries import FLAGS
from seatrial.exchange.fmi.fmu import FORCES, _zipped, hull_of, slave
from seatrial.exchange.fmi.source import sources
from seatrial.exchange.fmi.xml import exponents, osp_description
from seatrial.manoeuvres import Policy
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.models import Sampled
from seatrial.ships import Ship, ShipError
from seatrial.ships.files import library, load
from seatrial.simulate.approach import approach

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(GCC is None or sys.platform != "linux", reason="no C compiler"),
]
HULLED = ("kvlcc2", "twin_virtual", "milliampere")


@pytest.fixture(scope="module")
def model() -> Ship:
    """Stable on a straight course, and in the wind."""
    return load("esso_osaka_3m")


@pytest.fixture(scope="module")
def run(model: Ship) -> Run:
    speed, n_P = approach(model)
    made = flown(model, Zigzag(n_P, math.radians(20.0), math.radians(20.0)), STATES, speed, AROUND)
    assert np.ptp(made.orders[:, 1]) > 0.6, "it turned both ways"
    return made


@pytest.fixture(scope="module")
def whole(model: Ship, tmp_path_factory: pytest.TempPathFactory) -> Made:
    path, _ = save_fmu(model, tmp_path_factory.mktemp("whole") / "esso.fmu", dt=DT)
    return Made(path, slave(model, dt=DT))


@pytest.fixture(scope="module")
def hull(model: Ship, tmp_path_factory: pytest.TempPathFactory) -> Made:
    path, _ = save_fmu(model, tmp_path_factory.mktemp("hull") / "esso_hull.fmu", dt=DT, hull=True)
    return Made(path, slave(model, dt=DT, hull=True))


Host = Callable[..., Any]


@pytest.fixture
def host(tmp_path: Path) -> Iterator[Host]:
    """Slaves in FMPy, ready to step."""
    fmpy = pytest.importorskip("fmpy")
    from fmpy.fmi2 import FMU2Slave

    opened: list[Any] = []

    def start(made: Made, **given: float) -> Any:
        told = fmpy.read_model_description(str(made.path))
        folder = fmpy.extract(str(made.path), unzipdir=str(tmp_path / f"slave_{len(opened)}"))
        one = FMU2Slave(guid=told.guid, unzipDirectory=folder, modelIdentifier=told.coSimulation.modelIdentifier,
                        instanceName="ship")  # fmt: skip
        one.instantiate()
        opened.append(one)
        one.setupExperiment(startTime=0.0)
        one.setReal(made.at(*given), list(given.values()))
        one.enterInitializationMode()
        one.exitInitializationMode()
        return one

    yield start
    for one in opened:
        one.terminate()
        one.freeInstance()


def stepped(one: Any, made: Made, names: list[int], values: np.ndarray, t: float = 0.0) -> np.ndarray:
    """States from here on, a row of inputs a step."""
    rows = [one.getReal(made.at(*STATES))]
    for k, row in enumerate(values):
        one.setReal(names, row.tolist())
        one.doStep(t + k * DT, DT)
        rows.append(one.getReal(made.at(*STATES)))
    return np.array(rows)


def test_fmpy_follows_the_engine(whole: Made, run: Run, host: Host) -> None:
    one = host(whole, **GIVEN, **run.start)
    assert_same(stepped(one, whole, orders(whole), run.orders), run.states)


def test_a_long_communication_step_is_many_internal_ones(whole: Made, run: Run, host: Host) -> None:
    """The orders of every fourth step, held: as the same held step by step."""
    held = np.repeat(run.orders[::4], 4, axis=0)
    wanted = stepped(host(whole, **GIVEN, **run.start), whole, orders(whole), held)
    one = host(whole, **GIVEN, **run.start)
    for k, row in enumerate(run.orders[::4]):
        one.setReal(orders(whole), row.tolist())
        one.doStep(k * 4 * DT, 4 * DT)
        np.testing.assert_array_equal(one.getReal(whole.at(*STATES)), wanted[4 * (k + 1)])


@pytest.mark.parametrize("share", [1.0 / 4.0, 0.7, 1.5])
def test_a_communication_step_of_any_length_meets_the_same_states(
    whole: Made, run: Run, host: Host, share: float
) -> None:
    wanted = stepped(host(whole, **run.start), whole, orders(whole), run.orders[:1].repeat(84, axis=0))
    one, t = host(whole, **run.start), 0.0
    one.setReal(orders(whole), run.orders[0].tolist())
    for k in range(round(80 / share)):
        t = k * share * DT
        one.doStep(t, share * DT)
        at = (t + share * DT) / DT
        if abs(at - round(at)) < 1e-9:
            np.testing.assert_allclose(one.getReal(whole.at(*STATES)), wanted[round(at)], rtol=1e-12, atol=1e-14)
        low, high = np.sort(wanted[math.floor(at + 1e-9) : math.floor(at + 1e-9) + 2, 0])
        north = one.getReal(whole.at(STATES[0]))[0]
        assert low - 1e-12 <= north <= high + 1e-12, "between its neighbours on the grid"


def test_rates_and_feedback(whole: Made, run: Run, host: Host) -> None:
    one = host(whole, **run.start)
    stepped(one, whole, orders(whole), run.orders[:100])
    before = np.array(one.getReal(whole.at(*STATES[3:])))
    rates = np.array(one.getReal(whole.at(*(f"body_acceleration.{axis}" for axis in ("surge", "sway", "yaw")))))
    one.doStep(100 * DT, 1e-3 * DT)
    after = np.array(one.getReal(whole.at(*STATES[3:])))
    np.testing.assert_allclose((after - before) / (1e-3 * DT), rates, rtol=2e-2, atol=1e-5)
    (n_P, delta) = one.getReal(whole.at("feedback.n_P", "feedback.delta"))
    assert n_P == pytest.approx(run.orders[0, 0])
    assert abs(delta) == pytest.approx(math.radians(20.0), rel=1e-6)


def test_a_saved_state_is_taken_up_to_the_bit(whole: Made, run: Run, host: Host) -> None:
    one, other = host(whole, **GIVEN, **run.start), host(whole)
    stepped(one, whole, orders(whole), run.orders[:50])
    copy = one.getFMUState()
    saved = one.serializeFMUState(copy)
    wanted = stepped(one, whole, orders(whole), run.orders[50:90], 50 * DT)
    one.setFMUState(copy)
    np.testing.assert_array_equal(stepped(one, whole, orders(whole), run.orders[50:90], 50 * DT), wanted)
    taken = other.deserializeFMUState(saved)
    other.setFMUState(taken)
    np.testing.assert_array_equal(stepped(other, whole, orders(whole), run.orders[50:90], 50 * DT), wanted)
    one.freeFMUState(copy)
    other.freeFMUState(taken)


@pytest.mark.parametrize(("spoilt", "told"), [
    (lambda saved, at: bytes([255]) * len(saved), "the state of another FMU, or of none"),
    (lambda saved, at: saved[:at] + bytes([255]) * 8 + saved[at + 8 :], "with what is no finite number"),
    (lambda saved, at: saved[:-1], "are no state of"),
])  # fmt: skip
def test_bytes_that_are_no_state_of_this_ship_are_refused(
    whole: Made, run: Run, host: Host, capfd: Any, spoilt: Callable[[bytes, int], bytes], told: str
) -> None:
    one = host(whole, **GIVEN, **run.start)
    stepped(one, whole, orders(whole), run.orders[:5])
    copy = one.getFMUState()
    saved = bytes(one.serializeFMUState(copy))
    at = saved.index(struct.pack("d", one.getReal(whole.at(STATES[0]))[0]))
    before = one.getReal(whole.at(*STATES))
    with pytest.raises(Exception, match="fmi2"):
        one.deserializeFMUState(spoilt(saved, at))
    assert told in capfd.readouterr().out
    assert one.getReal(whole.at(*STATES)) == before
    one.freeFMUState(copy)


def test_the_state_of_another_step_is_refused(
    whole: Made, model: Ship, run: Run, host: Host, tmp_path: Path, capfd: Any
) -> None:
    path, _ = save_fmu(model, tmp_path / "half.fmu", dt=0.5 * DT)
    one, other = host(whole, **run.start), host(Made(path, slave(model, dt=0.5 * DT)))
    copy = one.getFMUState()
    with pytest.raises(Exception, match="fmi2"):
        other.deserializeFMUState(one.serializeFMUState(copy))
    assert "the state of another FMU" in capfd.readouterr().out
    one.freeFMUState(copy)


def test_accelerations_answer_a_force_at_once(hull: Made, host: Host) -> None:
    """As modelDescription.xml declares: they depend on the inputs without a step between."""
    one = host(hull)
    one.doStep(0.0, DT)
    names = hull.at("body_acceleration.surge", "body_acceleration.sway", "body_acceleration.yaw")
    still = one.getReal(names)
    one.setReal(hull.at("external_forces.sway"), [5.0])
    assert one.getReal(names)[1] > still[1] + 1e-3
    one.setReal(hull.at("external_forces.sway"), [0.0])
    assert one.getReal(names) == still


def test_a_reset_begins_anew(whole: Made, run: Run, host: Host) -> None:
    one = host(whole)
    wanted = stepped(one, whole, orders(whole), run.orders[:20])
    one.reset()
    one.setupExperiment(startTime=0.0)
    one.enterInitializationMode()
    one.exitInitializationMode()
    np.testing.assert_array_equal(stepped(one, whole, orders(whole), run.orders[:20]), wanted)


def test_left_alone_it_holds_its_course_and_speed(whole: Made, host: Host, model: Ship) -> None:
    one = host(whole)
    states = stepped(one, whole, [], np.empty((50, 0)))
    np.testing.assert_allclose(states[-1, 3:], (model.speed, 0.0, 0.0), atol=1e-6 * model.speed)


def test_a_parameter_can_be_set(whole: Made, run: Run, host: Host, model: Ship) -> None:
    path = "hull.X_0" if any(r.name == "ship.hull.X_0" for r in whole.layout.numbers) else "rudder.t_R"
    before = next(real.start for real in whole.layout.numbers if real.name == f"ship.{path}")
    other = model.having({path: 1.2 * before})
    made = Made(whole.path, slave(other, dt=DT))
    speed, n_P = approach(model)
    policy = Zigzag(n_P, math.radians(20.0), math.radians(20.0))
    wanted = flown(other, policy, STATES, speed, None)
    one = host(made, **wanted.start, **{f"ship.{path}": 1.2 * before, "initial.feedback.n_P": n_P})
    assert_same(stepped(one, made, orders(made), wanted.orders), wanted.states)


@dataclass(frozen=True)
class Pushes(Policy):
    """Forces from outside that change with time."""

    X: float

    @property
    def orders(self) -> tuple[str, ...]:
        return FORCES

    def begin(self, state: Any) -> tuple[Any, ...]:
        return ()

    def command(self, t: Any, state: Any, memory: Any) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
        from seatrial.core.symbolic import cos, sin

        return (self.X * (1.0 + cos(t)), 0.3 * self.X * sin(0.7 * t), 0.2 * self.X * cos(0.3 * t)), memory

    def schedule(self, dt: float, steps: int) -> np.ndarray:
        return np.zeros((steps, 0))


def test_the_hull_follows_the_engine(hull: Made, model: Ship, host: Host) -> None:
    wanted = flown(hull_of(model), Pushes(0.001 * 9.81 * float(model.model.body.m)), STATES, 0.3, None)  # type: ignore[attr-defined]
    one = host(hull, **wanted.start)
    names = hull.at(*(f"thrust.{axis}" for axis in ("surge", "sway", "yaw")))
    assert_same(stepped(one, hull, names, wanted.orders), wanted.states)
    assert np.ptp(wanted.states[:, 2]) > 0.05, "it turned"


def test_forces_of_all_sources_add_up(hull: Made, host: Host) -> None:
    one, other = host(hull), host(hull)
    groups = ("thrust", "wind_forces", "wave_forces", "external_forces")
    shares = hull.at(*(f"{group}.{axis}" for group in groups for axis in ("surge", "sway", "yaw")))
    split = stepped(one, hull, shares, np.tile([1.0, -0.5, 0.25] * 4, (20, 1)))
    together = stepped(other, hull, shares, np.tile([4.0, -2.0, 1.0, *[0.0] * 9], (20, 1)))
    np.testing.assert_allclose(split, together, rtol=1e-12)


@pytest.mark.parametrize("name", HULLED)
def test_a_hull_under_the_forces_of_its_drive_moves_as_the_ship(name: str) -> None:
    ship, flow = load(name), {}
    model: Any = replace(ship.model, wind=None, waves=None)
    cut, state = hull_of(ship).model, (0.0, 0.0, 0.3, ship.speed, 0.1 * ship.speed, 0.1 * ship.speed / ship.L_pp)
    from seatrial.environment import CALM
    from seatrial.models.common import Surroundings

    control = tuple(0.3 * (k + 1) for k in range(len(model.controls)))
    around = Surroundings.of(state, CALM)
    fixed = control[:2] if name == "kvlcc2" else ()
    flow = around.flow(model.body, *fixed)
    whole = model.force(flow, control[len(fixed) :])
    bare = model.damping.force(flow) if name == "milliampere" else model.hull.force(flow)
    drive = (whole.X - bare.X, whole.Y - bare.Y, whole.N - bare.N)
    np.testing.assert_allclose(
        cut.derivative(state, drive, CALM), model.derivative(state, control, CALM), rtol=1e-9, atol=1e-14
    )


SCENE = """<?xml version="1.0" encoding="UTF-8"?>
<OspSystemStructure xmlns="http://opensimulationplatform.com/MSMI/OSPSystemStructure" version="0.1">
  <BaseStepSize>{dt}</BaseStepSize>
  <Algorithm>fixedStep</Algorithm>
  <Simulators>
    <Simulator name="ship" source="esso.fmu"/>
    <Simulator name="hull" source="esso_hull.fmu"/>
  </Simulators>
  <Connections>
    <VariableGroupConnection>
      <VariableGroup simulator="ship" name="body_acceleration"/>
      <VariableGroup simulator="hull" name="external_forces"/>
    </VariableGroupConnection>
  </Connections>
</OspSystemStructure>
"""


@pytest.fixture
def quiet() -> None:
    logging = pytest.importorskip("libcosimpy.CosimLogging")
    logging.log_output_level(logging.CosimLogLevel.ERROR)


@pytest.mark.usefixtures("quiet")
def test_libcosim_follows_the_engine(whole: Made, run: Run) -> None:
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimManipulator import CosimManipulator
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    master = CosimExecution.from_step_size(round(DT * 1e9))
    ship = master.add_local_slave(CosimLocalSlave(fmu_path=str(whole.path), instance_name="ship"))
    for name, value in {**GIVEN, **run.start}.items():
        assert master.real_initial_value(ship, whole.at(name)[0], float(value))
    hand, eye = CosimManipulator.create_override(), CosimObserver.create_last_value()
    master.add_manipulator(hand)
    master.add_observer(eye)
    rows = [list(run.states[0])]
    for row in run.orders:
        assert hand.slave_real_values(ship, orders(whole), row.tolist())
        assert master.step()
        rows.append(eye.last_real_values(ship, whole.at(*STATES)))
    assert_same(np.array(rows), run.states)


@pytest.mark.usefixtures("quiet")
def test_libcosim_connects_the_groups(whole: Made, hull: Made, tmp_path: Path) -> None:
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimObserver import CosimObserver

    for made in (whole, hull):
        for path in made.path.parent.iterdir():
            shutil.copy(path, tmp_path)
    (tmp_path / "OspSystemStructure.xml").write_text(SCENE.format(dt=DT))
    master, eye = CosimExecution.from_osp_config_file(str(tmp_path)), CosimObserver.create_last_value()
    master.add_observer(eye)
    assert master.step(3)
    places = [master.slave_index_from_instance_name(name) for name in ("ship", "hull")]
    sent = eye.last_real_values(places[0], whole.at("body_acceleration.surge"))
    assert eye.last_real_values(places[1], hull.at("external_forces.surge")) == pytest.approx(sent, abs=1e-6)


@pytest.mark.parametrize("cut", ["whole", "hull"])
@pytest.mark.long
def test_fmpy_finds_nothing_wrong(cut: str, request: pytest.FixtureRequest) -> None:
    validation = pytest.importorskip("fmpy.validation")
    assert validation.validate_fmu(str(request.getfixturevalue(cut).path)) == []


@pytest.mark.long
@pytest.mark.parametrize("name", [n for n in library() if not isinstance(load(n).model, Sampled)])
def test_every_ship_goes_out(name: str, tmp_path: Path) -> None:
    validation = pytest.importorskip("fmpy.validation")
    import fmpy

    path, _ = save_fmu(load(name), tmp_path / "ship.fmu")
    assert validation.validate_fmu(str(path)) == []
    done = fmpy.simulate_fmu(str(path), stop_time=20.0)
    assert np.isfinite(done["ned_position.north"]).all()
    assert done["ned_position.north"][-1] > 0.0



def unpacked(made: Made, folder: Path) -> Path:
    with zipfile.ZipFile(made.path) as archive:
        archive.extractall(folder)
    return next((folder / "binaries" / "linux64").iterdir())


def guid_of(made: Made) -> str:
    with zipfile.ZipFile(made.path) as archive:
        return ElementTree.fromstring(archive.read("modelDescription.xml")).attrib["guid"]


def test_a_host_without_python_runs_it_without_taking_memory(whole: Made, run: Run, tmp_path: Path) -> None:
    binary = unpacked(whole, tmp_path)
    source, program = tmp_path / "host.c", tmp_path / "host"
    source.write_text(C_HOST)
    command = [str(GCC), "-std=gnu99", "-I", str(tmp_path / "sources"), str(source), "-o", str(program), "-ldl"]
    subprocess.run(command, check=True, capture_output=True)
    given = [str(part) for name, value in {**GIVEN, **run.start}.items()
             for part in (whole.at(name)[0], repr(float(value)))]  # fmt: skip
    told = "\n".join(" ".join(f"{v!r}" for v in row) for row in run.orders.tolist())
    places = [str(k) for k in orders(whole)]
    done = subprocess.run(
        [str(program), str(binary), guid_of(whole), repr(DT), *places, *given],
        input=told, capture_output=True, text=True, check=False, env={},
    )  # fmt: skip
    assert done.returncode == 0, (done.returncode, done.stderr)
    rows = np.array([[float(v) for v in line.split()] for line in done.stdout.splitlines()])
    assert_same(rows, run.states[1:])
    if shutil.which("ldd"):
        needs = subprocess.run(["ldd", str(binary)], capture_output=True, text=True, check=True).stdout
        assert "python" not in needs


def test_the_binary_shows_its_entry_points_and_knows_no_machine(whole: Made, tmp_path: Path) -> None:
    assert not [flag for flag in FLAGS if flag.startswith("-m") or "fast" in flag]
    binary = unpacked(whole, tmp_path)
    assert str(Path.home()).encode() not in binary.read_bytes() or Path.home() == Path("/")
    if not shutil.which("nm") or not shutil.which("objdump"):
        pytest.skip("no binutils")
    listed = subprocess.run(["nm", "-D", "--defined-only", str(binary)], capture_output=True, text=True, check=True)
    names = {line.split()[-1] for line in listed.stdout.splitlines()}
    header = (tmp_path / "sources" / "fmi2.h").read_text()
    assert names == set(re.findall(r"^ENTRY .*?(fmi2\w+)\(", header, re.MULTILINE))
    assert len(names) == 34
    code = subprocess.run(["objdump", "-d", str(binary)], capture_output=True, text=True, check=True).stdout
    assert not re.search(r"%[yz]mm|\bv(add|mul|fmadd)", code), "instructions that not every processor has"


def test_the_sources_compile_under_every_warning(whole: Made, hull: Made, tmp_path: Path) -> None:
    for made in (whole, hull):
        folder = tmp_path / made.path.stem
        unpacked(made, folder)
        strict = ["-std=c99", "-fsyntax-only", "-Wall", "-Wextra", "-Werror", "-pedantic"]
        files = [str(folder / "sources" / name) for name in ("fmi2.c", "slave.c", "ship.c")]
        done = subprocess.run([str(GCC), *strict, *files], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr


def test_the_same_ship_gives_the_same_bytes(model: Ship, hull: Made, tmp_path: Path) -> None:
    again, beside = save_fmu(model, tmp_path / "esso_hull.fmu", dt=DT, hull=True)
    assert again.read_bytes() == hull.path.read_bytes()
    with zipfile.ZipFile(io.BytesIO(again.read_bytes())) as archive:
        assert archive.read("resources/OspModelDescription.xml") == beside.read_bytes()
    assert sources(slave(model, dt=DT))[1] != sources(slave(model, dt=2 * DT))[1]


def test_every_variable_of_the_groups_is_one_of_the_slave(whole: Made) -> None:
    root = ElementTree.fromstring(osp_description(whole.layout))
    refs = [one.attrib["ref"] for one in root.iter() if one.tag.endswith("}Variable")]
    assert set(refs) == {real.name for real in (*whole.layout.outputs, *whole.layout.inputs)}
    assert len(refs) == len(set(refs))


def test_a_range_through_the_water_is_none_over_ground() -> None:
    """KCS holds within speeds through the water; a following current may take it beyond them over ground."""
    ranges = {real.name: (real.low, real.high) for real in slave(load("kcs"), dt=DT).outputs}
    assert ranges["body_velocity.surge"] == (-math.inf, math.inf)


def test_only_what_is_felt_goes_in() -> None:
    names = {real.name for real in slave(load("mariner")).inputs}
    assert names == {"order.n_P", "order.delta", "current_velocity.north", "current_velocity.east"}
    assert "water.depth" in {real.name for real in slave(load("kvlcc2_shallow")).inputs}


@pytest.mark.parametrize(("unit", "wanted"), [
    ("kg m^2/s", {"kg": 1, "m": 2, "s": -1}), ("N s^2/m", {"kg": 1}), ("1/s^2", {"s": -2}),
    ("rad/s", {"rad": 1, "s": -1}), ("N m", {"kg": 1, "m": 2, "s": -2}), ("degC", None),
])  # fmt: skip
def test_units(unit: str, wanted: dict[str, int] | None) -> None:
    assert exponents(unit) == wanted


def test_limits_and_rates_carry_the_unit_of_their_control(whole: Made) -> None:
    units = {real.name: real.unit for real in whole.layout.servos}
    assert units["actuator.rudder.rate"] == "rad/s"
    assert units["actuator.rudder.high"] == "rad"
    assert units["actuator.propeller.high"] == "1/s"
    assert not next(real for real in whole.layout.servos if real.name == "actuator.propeller.rate").shown


@pytest.mark.parametrize(("do", "told"), [
    (lambda one, made: one.setReal(made.at("ned_position.north"), [1.0]), "is an output and cannot be set"),
    (lambda one, made: one.setReal([9999], [1.0]), "no real variable 9999"),
    (lambda one, made: one.getReal([9999]), "no real variable 9999"),
    (lambda one, made: one.setReal(orders(made)[:1], [math.nan]), "no finite number"),
    (lambda one, made: one.setReal(made.at("initial.body_velocity.surge"), [1.0]), "fixed once the run has begun"),
    (lambda one, made: one.doStep(0.0, -DT), "it must be above zero"),
    (lambda one, made: one.doStep(5.0, DT), "a step from t = 5 s, but the ship is at 0 s"),
    (lambda one, made: one.getInteger([0]), "all variables are real"),
])  # fmt: skip
def test_a_wrong_call_is_told_in_one_line(whole: Made, host: Host, capfd: Any, do: Any, told: str) -> None:
    one = host(whole)
    with pytest.raises(Exception, match="fmi2"):
        do(one, whole)
    assert told in capfd.readouterr().out
    one.doStep(0.0, DT)  # and the ship is where it was


def test_bad_input_is_discarded_and_the_run_goes_on(whole: Made, host: Host) -> None:
    """Status 2, fmi2Discard: nothing of the call is taken, also not its good values; a wrong call is an error, 3."""
    one, other = host(whole), host(whole)
    names = orders(whole)
    for slave_, values in ((one, [1.5, 0.2]), (other, [1.5, 0.2])):
        slave_.setReal(names[:2], values)
    with pytest.raises(Exception, match="status 2"):
        one.setReal(names[:2], [0.5, math.inf])
    with pytest.raises(Exception, match="status 3"):
        one.setReal([9999], [1.0])
    for slave_ in (one, other):
        slave_.doStep(0.0, DT)
    assert one.getReal(whole.at(*STATES)) == other.getReal(whole.at(*STATES))


def test_who_made_it_is_in_its_description(whole: Made) -> None:
    with zipfile.ZipFile(whole.path) as archive:
        root = ElementTree.fromstring(archive.read("modelDescription.xml"))
    assert (root.attrib["author"], root.attrib["version"]) == ("seatrial", __version__)
    assert root.attrib["license"].startswith("MIT")


@pytest.mark.parametrize(("arguments", "told"), [
    (("kvlcc2", "--hull"), "--hull is of the co-simulation slave: give --fmu FILE.fmu too"),
    (("kvlcc2", "--dt", "0.1"), "--dt is of the co-simulation slave"),
    (("kvlcc2", "--fmu", "k.zip"), "k.zip: a co-simulation slave ends in .fmu"),
    (("kvlcc2", "--fmu", "nowhere/k.fmu"), "no such folder"),
    (("kvlcc2", "--fmu", "k.fmu", "--dt", "0"), "--dt is 0; it must be above zero"),
    (("mariner", "--fmu", "k.fmu", "--hull"), "--hull takes an Mmg, TwinMmg or Fossen model; Abkowitz"),
    (("kvlcc2_l7_arx", "--fmu", "k.fmu"), "is a model in discrete time"),
])  # fmt: skip
def test_what_cannot_go_out(
    arguments: tuple[str, ...], told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["export", *arguments]) != 0
    err = capsys.readouterr().err
    assert told in err
    assert len(err.strip().splitlines()) == 1
    assert not list(tmp_path.iterdir())


FULL = """gcc: note: compiling
/tmp/ccX.s: Assembler messages:
/tmp/ccX.s: Fatal error: can't write 64 bytes to section .text of model.o: 'No space left on device'
compilation terminated."""


@pytest.mark.parametrize(("said", "told"), [
    (FULL, "No space left on device.*TMPDIR"),
    ("model.c:3:1: error: expected ';'\n    3 | x\n1 error generated.", "cc failed: model.c:3:1: error: expected ';'$"),
])  # fmt: skip
def test_a_compiler_that_fails_is_quoted_where_it_says_why(
    model: Ship, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, said: str, told: str
) -> None:
    """Its last words, "compilation terminated.", help nobody whose folder for scratch files is full."""
    (tmp_path / "said").write_text(said, encoding="utf-8")
    compiler = tmp_path / "cc"
    compiler.write_text(f"#!/bin/sh\ncat '{tmp_path / 'said'}' >&2\nexit 1\n", encoding="utf-8")
    compiler.chmod(0o755)
    monkeypatch.setenv("SEATRIAL_CC", str(compiler))
    with pytest.raises(ShipError, match=told):
        save_fmu(model, tmp_path / "a.fmu")
    assert not (tmp_path / "a.fmu").exists()


def test_the_compiler_s_scratch_files_go_where_there_is_room(
    model: Ship, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Python passes over a TMPDIR it cannot write to and takes the next folder; the compiler has to follow."""
    compiler = tmp_path / "cc"
    compiler.write_text('#!/bin/sh\ntouch "$TMPDIR/ccX.s" || exit 1\nexec gcc "$@"\n', encoding="utf-8")
    compiler.chmod(0o755)
    monkeypatch.setenv("SEATRIAL_CC", str(compiler))
    monkeypatch.setenv("TMPDIR", str(tmp_path / "full"))
    assert save_fmu(model, tmp_path / "a.fmu")[0].exists()


def test_no_folder_for_scratch_files_is_told_in_one_line(
    model: Ship, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "none"))
    with pytest.raises(ShipError, match=r"none: .*TMPDIR"):
        save_fmu(model, tmp_path / "a.fmu")


def test_without_a_compiler(model: Ship, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SEATRIAL_CC", "none")
    with pytest.raises(ShipError, match=r"k\.fmu: .*\bnone\b"):
        save_fmu(model, tmp_path / "k.fmu")


def test_the_command(tmp_path: Path, capsys: Any) -> None:
    path = tmp_path / "mariner.fmu"
    assert main(["export", "mariner_nomoto", "--fmu", str(path), "--dt", "0.5", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["fmu"]["step"] == 0.5
    assert told["fmu"]["inputs"]["order.delta"] == "rad"
    assert told["written"] == [str(path), str(tmp_path / "mariner_OspModelDescription.xml")]


def test_a_step_that_is_too_long_is_told(tmp_path: Path, capsys: Any) -> None:
    assert main(["export", "mariner_nomoto", "--fmu", str(tmp_path / "mariner.fmu"), "--dt", "100"]) == 0
    [line] = [line for line in capsys.readouterr().err.splitlines() if line.startswith("warning: ")]
    assert re.search(r"--dt\b.*\b100 s\b.*\bmariner_nomoto\b", line)


def test_time_may_begin_anywhere(whole: Made) -> None:
    fmpy = pytest.importorskip("fmpy")
    ends = [fmpy.simulate_fmu(str(whole.path), start_time=t, stop_time=t + 20.0, output_interval=DT,
                              start_values={"order.delta": 0.2})[-1] for t in (0.0, 1000.0)]  # fmt: skip
    for name in STATES:
        assert ends[1][name] == pytest.approx(ends[0][name], rel=1e-9, abs=1e-12)


def test_seconds_since_1970_are_a_time(whole: Made, run: Run, host: Host) -> None:
    """At 1.7e9 s a step has lost its seventh digit: every step must still be one, none late."""
    wanted = stepped(host(whole, **run.start), whole, orders(whole), run.orders[:40])
    late = host(whole)
    late.reset()
    late.setupExperiment(startTime=1.7e9)
    late.setReal(whole.at(*run.start), list(run.start.values()))
    late.enterInitializationMode()
    late.exitInitializationMode()
    np.testing.assert_array_equal(stepped(late, whole, orders(whole), run.orders[:40], 1.7e9), wanted)


def test_what_an_fmu_unpacks_to_is_readable_by_all_and_its_bytes_are_the_same_on_every_day() -> None:
    content = {"modelDescription.xml": b"<a/>" * 99, "sources/a.c": b"int a;"}
    packed = _zipped(content)
    with zipfile.ZipFile(io.BytesIO(packed)) as archive:
        entries = archive.infolist()
        assert {one.filename: archive.read(one) for one in entries} == content
    assert {one.external_attr >> 16 for one in entries} == {0o644}
    assert {one.date_time for one in entries} == {(1980, 1, 1, 0, 0, 0)}
    assert len(packed) < 700
    assert _zipped(content) == packed
