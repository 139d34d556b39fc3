"""Networks as co-simulation slaves: their weights in C, the tracks of the engine, and no Python in the host."""

from __future__ import annotations

import json
import runpy
import shutil
import subprocess
import sys
import zipfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from slaves import C_HOST, GCC, assert_same

from seatrial.cli.app import main
from seatrial.environment import Uniform
from seatrial.exchange import save_fmu, save_network
from seatrial.exchange.fmi.fmu import slave
from seatrial.exchange.fmi.source import compiled, memory_of, sources
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.models.network import KINDS, Limits, Network, initial
from seatrial.models.neural import Neural
from seatrial.ships import Ship, ShipError
from seatrial.ships.files import load
from seatrial.ships.writing import save
from seatrial.simulate.loop import closed_loop
from seatrial.simulate.run import campaign

pytestmark = pytest.mark.skipif(GCC is None or sys.platform != "linux", reason="no C compiler")
DT, SECONDS = 0.1, 300.0
MEMORY = {"feedforward": 1, "forgetting": 4}
LIMITS = Limits((-0.5, -0.2, -0.2, -9.0, -0.3), (0.5, 0.2, 0.2, 9.0, 0.3), (0.02, 0.02, 0.02), 2.0)
STATES = ("ned_position.north", "ned_position.east", "ned_position.yaw", "body_velocity.surge", "body_velocity.sway",
          "body_velocity.yaw")  # fmt: skip
AROUND = Uniform(U_T=2.0, gamma_T=0.5, U_C=0.1, gamma_C=2.0)
GIVEN = {"current_velocity.north": 0.1 * np.cos(2.0), "current_velocity.east": 0.1 * np.sin(2.0)}
WIND = {"wind.speed": 2.0, "wind.from": 0.5}
CASES = [(kind, (None, LIMITS)[k % 2]) for k, kind in enumerate(KINDS)]
OTHERS = [(kind, (LIMITS, None)[k % 2]) for k, kind in enumerate(KINDS)]


def ship_of(kind: str, layers: tuple[int, ...] = (8, 7), limits: Limits | None = None, memory: int = 4) -> Ship:
    """The 3 m model with an untrained network whose accelerations are of its size; bounded ones see no wind."""
    net = initial(Network(kind, layers, wind=limits is None, memory=min(MEMORY.get(kind, 0), 1) * memory
                          if kind == "forgetting" else MEMORY.get(kind, 0), limits=limits), 3)  # fmt: skip
    last = f"W_{len(layers)}"
    net = net.having({**net.weights, last: 0.02 * net.weights[last]})
    return replace(load("esso_osaka_3m"), name="net", model=Neural(dt=DT, network=net), n_P=8.0, notes={}, validity={})


@dataclass(frozen=True)
class Flown:
    """A zigzag of the engine: states and orders per step."""

    states: np.ndarray
    orders: np.ndarray


def flown(ship: Ship, seconds: float = SECONDS) -> Flown:
    policy = Zigzag(8.0, 0.35, 0.35)
    run = campaign(ship, policy, {}, speed=0.4, duration=seconds, dt=DT, threads=1, environment=AROUND)
    stored, rows = closed_loop(ship, policy, DT).stored, run.values[0]
    return Flown(rows[:, :6], rows[:-1][:, [stored.index("n_P_cmd"), stored.index("delta_cmd")]])


def start_of(ship: Ship, run: Flown) -> dict[str, float]:
    wind = WIND if ship.model.network.wind else {}  # type: ignore[attr-defined]
    start = {f"initial.{name}": float(v) for name, v in zip(STATES, run.states[0], strict=True)}
    return {**GIVEN, **wind, **start, "initial.feedback.n_P": 8.0}


def opened(path: Path, folder: Path) -> Any:
    fmpy = pytest.importorskip("fmpy")
    from fmpy.fmi2 import FMU2Slave

    told = fmpy.read_model_description(str(path))
    one = FMU2Slave(guid=told.guid, unzipDirectory=fmpy.extract(str(path), unzipdir=str(folder)),
                    modelIdentifier=told.coSimulation.modelIdentifier, instanceName="net")  # fmt: skip
    one.instantiate()
    return one


def places(ship: Ship, *names: str) -> list[int]:
    every = [real.name for real in slave(ship).all]
    return [every.index(name) for name in names]


def sailed(ship: Ship, path: Path, folder: Path, run: Flown, share: int = 1) -> np.ndarray:
    """States at each communication point, `share` of them a sample."""
    one, given = opened(path, folder), start_of(ship, run)
    at, orders = places(ship, *STATES), places(ship, "order.n_P", "order.delta")
    one.setupExperiment(startTime=0.0)
    one.setReal(places(ship, *given), list(given.values()))
    one.enterInitializationMode()
    one.exitInitializationMode()
    rows = [one.getReal(at)]
    for k in range(share * len(run.orders)):
        if k % share == 0:
            one.setReal(orders, run.orders[k // share].tolist())
        one.doStep(k * DT / share, DT / share)
        rows.append(one.getReal(at))
    one.terminate()
    one.freeInstance()
    return np.array(rows)


def named(case: tuple[str, Limits | None]) -> str:
    return f"{case[0]}-{'free' if case[1] is None else 'bounded'}"


def follow(kind: str, limits: Limits | None, seconds: float, folder: Path) -> None:
    ship = ship_of(kind, limits=limits)
    run = flown(ship, seconds)
    path, beside = save_fmu(ship, folder / "net.fmu")
    assert beside.name == "net_OspModelDescription.xml"
    assert_same(sailed(ship, path, folder / "open", run), run.states)
    validation = pytest.importorskip("fmpy.validation")
    assert validation.validate_fmu(str(path)) == []
    assert np.ptp(run.states[:, 2]) > 0.05, "it turned"


@pytest.mark.parametrize(("kind", "limits"), CASES, ids=map(named, CASES))
@pytest.mark.long
def test_fmpy_follows_the_engine_for_300_s(kind: str, limits: Limits | None, tmp_path: Path) -> None:
    follow(kind, limits, SECONDS, tmp_path)


@pytest.mark.long
@pytest.mark.parametrize(("kind", "limits"), OTHERS, ids=map(named, OTHERS))
def test_fmpy_follows_the_other_half(kind: str, limits: Limits | None, tmp_path: Path) -> None:
    follow(kind, limits, SECONDS, tmp_path)


@pytest.mark.long
def test_a_wide_network_follows_its_double_precision_pass(tmp_path: Path) -> None:
    """The engine takes wide ones in single precision; the exported Python file in double, as the slave does."""
    ship = ship_of("forgetting", (120, 110), memory=10)
    run = flown(ship, 30.0)
    path, _ = save_fmu(ship, tmp_path / "net.fmu")
    save_network(ship, tmp_path / "net.py")
    module, around = runpy.run_path(str(tmp_path / "net.py")), AROUND.now()
    got = sailed(ship, path, tmp_path / "open", run)
    assert_same(got, run.states, 1e-4)
    one, x, memory, u = slave(ship), tuple(run.states[0]), None, [8.0, 0.0]
    assert one.network is ship.model
    rows = [x]
    rate = float(ship.actuators.rudder.rate) * DT  # type: ignore[attr-defined]
    for order in run.orders:
        x, memory = module["step"](x, u, around, memory)
        u = [order[0], u[1] + float(np.clip(order[1] - u[1], -rate, rate))]
        rows.append(x)
    assert_same(got, np.array(rows))


@pytest.mark.slow
def test_points_within_a_sample_lie_on_its_straight_line(tmp_path: Path) -> None:
    ship = ship_of("gru")
    run = flown(ship, 10.0)
    path, _ = save_fmu(ship, tmp_path / "net.fmu")
    whole = sailed(ship, path, tmp_path / "whole", run)
    split = sailed(ship, path, tmp_path / "split", run, share=2)
    np.testing.assert_allclose(split[::2], whole, rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(split[1::2], 0.5 * (whole[1:] + whole[:-1]), rtol=1e-12, atol=1e-14)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["forgetting", "lstm"])
def test_a_saved_state_is_taken_up_to_the_bit(kind: str, tmp_path: Path) -> None:
    ship = ship_of(kind)
    run = flown(ship, 10.0)
    path, _ = save_fmu(ship, tmp_path / "net.fmu")
    one, orders, at = opened(path, tmp_path / "open"), places(ship, "order.n_P", "order.delta"), places(ship, *STATES)
    one.setupExperiment(startTime=0.0)
    one.enterInitializationMode()
    one.exitInitializationMode()

    def on(first: int, last: int) -> list[list[float]]:
        rows: list[list[float]] = []
        for k in range(first, last):
            one.setReal(orders, run.orders[k].tolist())
            one.doStep(k * DT, DT)
            rows.append(one.getReal(at))
        return rows

    on(0, 30)
    copy = one.getFMUState()
    taken = one.deserializeFMUState(one.serializeFMUState(copy))
    wanted = on(30, 80)
    for saved in (copy, taken):
        one.setFMUState(saved)
        assert on(30, 80) == wanted
        one.freeFMUState(saved)
    one.freeInstance()


@pytest.mark.long
def test_libcosim_follows_the_engine(tmp_path: Path) -> None:
    logging = pytest.importorskip("libcosimpy.CosimLogging")
    logging.log_output_level(logging.CosimLogLevel.ERROR)
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimManipulator import CosimManipulator
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    ship = ship_of("lstm")
    run = flown(ship)
    path, _ = save_fmu(ship, tmp_path / "net.fmu")
    master = CosimExecution.from_step_size(round(DT * 1e9))
    index = master.add_local_slave(CosimLocalSlave(fmu_path=str(path), instance_name="net"))
    for name, value in start_of(ship, run).items():
        assert master.real_initial_value(index, places(ship, name)[0], float(value))
    hand, eye = CosimManipulator.create_override(), CosimObserver.create_last_value()
    master.add_manipulator(hand)
    master.add_observer(eye)
    rows = [list(run.states[0])]
    at, orders = places(ship, *STATES), places(ship, "order.n_P", "order.delta")
    for row in run.orders:
        assert hand.slave_real_values(index, orders, row.tolist())
        assert master.step()
        rows.append(eye.last_real_values(index, at))
    assert_same(np.array(rows), run.states)


@pytest.mark.long
def test_a_host_without_python_runs_it_without_taking_memory(tmp_path: Path) -> None:
    ship = ship_of("forgetting")
    run = flown(ship)
    path, _ = save_fmu(ship, tmp_path / "net.fmu")
    with zipfile.ZipFile(path) as archive:
        archive.extractall(tmp_path)
        guid = ElementTree.fromstring(archive.read("modelDescription.xml")).attrib["guid"]
    binary, program = next((tmp_path / "binaries" / "linux64").iterdir()), tmp_path / "host"
    (tmp_path / "host.c").write_text(C_HOST)
    command = [str(GCC), "-std=gnu99", "-I", str(tmp_path / "sources"), str(tmp_path / "host.c"), "-o", str(program)]
    subprocess.run([*command, "-ldl"], check=True, capture_output=True)
    given = start_of(ship, run)
    told = [str(part) for name, value in given.items() for part in (places(ship, name)[0], repr(float(value)))]
    orders = [str(k) for k in places(ship, "order.n_P", "order.delta")]
    done = subprocess.run(
        [str(program), str(binary), guid, repr(DT), *orders, *told], capture_output=True, text=True, check=False,
        env={}, input="\n".join(" ".join(f"{v!r}" for v in row) for row in run.orders.tolist()),
    )  # fmt: skip
    assert done.returncode == 0, (done.returncode, done.stderr)
    assert_same(np.array([[float(v) for v in line.split()] for line in done.stdout.splitlines()]), run.states[1:])
    if shutil.which("ldd"):
        needs = subprocess.run(["ldd", str(binary)], capture_output=True, text=True, check=True).stdout
        assert "python" not in needs


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "limits"), CASES, ids=map(named, CASES))
def test_the_sources_compile_under_every_warning(kind: str, limits: Limits | None, tmp_path: Path) -> None:
    files, _ = sources(slave(ship_of(kind, limits=limits)))
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    strict = ["-std=c99", "-fsyntax-only", "-Wall", "-Wextra", "-Werror", "-pedantic"]
    which = [str(tmp_path / name) for name in compiled(2)]
    done = subprocess.run([str(GCC), *strict, *which], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("kind", KINDS)
def test_the_memory_is_that_of_the_model(kind: str) -> None:
    model: Any = ship_of(kind).model
    assert memory_of(model.network) == len(model.memory)


@pytest.mark.long
def test_it_goes_out_by_the_third_version_too(tmp_path: Path) -> None:
    fmpy = pytest.importorskip("fmpy")
    from fmpy.validation import validate_fmu

    ship = ship_of("forgetting")
    second, third = save_fmu(ship, tmp_path / "two.fmu")[0], save_fmu(ship, tmp_path / "three.fmu", fmi=3)[0]
    assert validate_fmu(str(third)) == []
    ends = [fmpy.simulate_fmu(str(path), stop_time=20.0, output_interval=DT, start_values={"order.delta": 0.2})[-1]
            for path in (second, third)]  # fmt: skip
    assert [ends[0][name] for name in STATES] == [ends[1][name] for name in STATES]


@pytest.mark.slow
def test_one_sample_back_is_a_forgetting_network_without_a_chain(tmp_path: Path) -> None:
    ship = ship_of("forgetting", memory=1)
    run = flown(ship, 10.0)
    path, _ = save_fmu(ship, tmp_path / "net.fmu")
    assert_same(sailed(ship, path, tmp_path / "open", run), run.states)


def test_what_it_takes_and_gives() -> None:
    free, bounded = slave(ship_of("rnn")), slave(ship_of("rnn", limits=LIMITS))
    assert [real.name for real in free.inputs] == ["order.n_P", "order.delta", *WIND, *GIVEN]
    assert [real.name for real in bounded.inputs] == ["order.n_P", "order.delta", *GIVEN]
    assert next(r for r in free.outputs if r.name == "body_acceleration.yaw").about.endswith("over the last sample")


@pytest.mark.slow
def test_the_command_writes_both_forms_of_a_network(tmp_path: Path, capsys: Any) -> None:
    model = save(ship_of("rnn", limits=LIMITS), tmp_path / "net.toml")
    path, python = tmp_path / "net.fmu", tmp_path / "net_step.py"
    assert main(["export", str(model), "--fmu", str(path), "--python", str(python), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["fmu"]["step"] == DT
    assert told["fmu"]["inputs"]["order.delta"] == "rad"
    assert str(path) in told["written"]
    assert str(python) in told["written"]


@pytest.mark.parametrize(("options", "told"), [
    (("--fmu", "k.fmu", "--dt", "0.2"), "a step of 0.2 s; its network runs at 0.1 s and no other"),
    (("--fmu", "k.fmu", "--hull"), "--hull takes an Mmg, TwinMmg or Fossen model; Neural"),
    (("--fmu", "k.fmu", "--c", "k"), "a network has no symbolic right-hand side"),
    (("--fmu", "k.fmu", "--actuators", "0.1"), "--actuators: a network is exported without its actuators"),
])  # fmt: skip
def test_what_a_network_does_not_go_out_as(
    options: tuple[str, ...], told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    save(ship_of("rnn"), tmp_path / "net.toml")
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    assert main(["export", str(tmp_path / "net.toml"), *options]) == 2
    err = capsys.readouterr().err
    assert told in err
    assert len(err.strip().splitlines()) == 1
    assert not list((tmp_path / "here").iterdir())


def test_a_network_without_weights(tmp_path: Path) -> None:
    ship = replace(load("esso_osaka_3m"), model=Neural(dt=DT, network=Network("rnn", (4,))), notes={}, validity={})
    with pytest.raises(ShipError, match=r"^esso_osaka_3m: .*weights"):
        save_fmu(ship, tmp_path / "net.fmu")
    assert not list(tmp_path.iterdir())
