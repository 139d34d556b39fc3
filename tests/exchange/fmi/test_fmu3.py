"""Co-simulation slaves by FMI 3.0: the same run as by FMI 2.0, in FMPy and in a host that is nothing but C."""

from __future__ import annotations

import inspect
import json
import math
import re
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from slaves import AROUND, DT, GCC, GIVEN, STATES, Made, Run, assert_same, flown, orders

from seatrial.cli.app import main
from seatrial.exchange import save_fmu
from seatrial.exchange.fmi.fmu import slave
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.models import Sampled
from seatrial.ships import ShipError
from seatrial.ships.files import library, load
from seatrial.simulate.approach import approach

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(GCC is None or sys.platform != "linux", reason="no C compiler"),
]
Host = Callable[..., Any]
ONE_OF_EACH = {type(load(name).model): name for name in library() if not issubclass(type(load(name).model), Sampled)}
"""A ship of each kind of model that has rates."""


@pytest.fixture(scope="module")
def run() -> Run:
    ship = load("esso_osaka_3m")
    speed, n_P = approach(ship)
    return flown(ship, Zigzag(n_P, math.radians(20.0), math.radians(20.0)), STATES, speed, AROUND)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Made:
    ship = load("esso_osaka_3m")
    written = save_fmu(ship, tmp_path_factory.mktemp("whole") / "esso.fmu", dt=DT, fmi=3)
    assert [path.name for path in written] == ["esso.fmu"], "libcosim does not read it, so nothing beside it"
    return Made(written[0], slave(ship, dt=DT))


@pytest.fixture(scope="module")
def hull(tmp_path_factory: pytest.TempPathFactory) -> Made:
    ship = load("esso_osaka_3m")
    (path,) = save_fmu(ship, tmp_path_factory.mktemp("hull") / "esso.fmu", hull=True, fmi=3)
    return Made(path, slave(ship, hull=True))


@pytest.fixture
def host(tmp_path: Path) -> Iterator[Host]:
    """Slaves in FMPy, ready to step."""
    fmpy = pytest.importorskip("fmpy")
    from fmpy.fmi3 import FMU3Slave

    opened: list[Any] = []

    def start(made: Made, **given: float) -> Any:
        told = fmpy.read_model_description(str(made.path))
        folder = fmpy.extract(str(made.path), unzipdir=str(tmp_path / f"slave_{len(opened)}"))
        one = FMU3Slave(guid=told.guid, unzipDirectory=folder, modelIdentifier=told.coSimulation.modelIdentifier,
                        instanceName="ship")  # fmt: skip
        one.instantiate()
        opened.append(one)
        one.setFloat64(made.at(*given), list(given.values()))
        one.enterInitializationMode(startTime=0.0)
        one.exitInitializationMode()
        return one

    yield start
    for one in opened:
        one.terminate()
        one.freeInstance()


def stepped(one: Any, made: Made, values: np.ndarray, t: float = 0.0) -> np.ndarray:
    """States from here on, a row of orders a step."""
    rows = [one.getFloat64(made.at(*STATES))]
    for k, row in enumerate(values):
        one.setFloat64(orders(made), row.tolist())
        assert one.doStep(t + k * DT, DT) == (False, False, False, pytest.approx(t + (k + 1) * DT))
        rows.append(one.getFloat64(made.at(*STATES)))
    return np.array(rows)


def test_fmpy_follows_the_engine(whole: Made, run: Run, host: Host) -> None:
    assert_same(stepped(host(whole, **GIVEN, **run.start), whole, run.orders), run.states)


@pytest.mark.long
def test_its_master_runs_it(whole: Made) -> None:
    """The whole way of FMPy, description, start values and all."""
    fmpy = pytest.importorskip("fmpy")
    done = fmpy.simulate_fmu(str(whole.path), stop_time=20.0, output_interval=DT, start_values={"order.delta": 0.2})
    second = save_fmu(load("esso_osaka_3m"), whole.path.with_name("two.fmu"), dt=DT)[0]
    one = fmpy.simulate_fmu(str(second), stop_time=20.0, output_interval=DT, start_values={"order.delta": 0.2})
    for name in STATES:
        np.testing.assert_array_equal(done[name], one[name], err_msg="as by FMI 2.0")
    assert done[STATES[2]][-1] > 0.1


def test_a_saved_state_is_taken_up_to_the_bit(whole: Made, run: Run, host: Host) -> None:
    one, other = host(whole, **GIVEN, **run.start), host(whole)
    stepped(one, whole, run.orders[:50])
    copy = one.getFMUState()
    saved = one.serializeFMUState(copy)
    wanted = stepped(one, whole, run.orders[50:90], 50 * DT)
    one.setFMUState(copy)
    np.testing.assert_array_equal(stepped(one, whole, run.orders[50:90], 50 * DT), wanted)
    taken = other.deserializeFMUState(saved)
    other.setFMUState(taken)
    np.testing.assert_array_equal(stepped(other, whole, run.orders[50:90], 50 * DT), wanted)
    one.freeFMUState(copy)
    other.freeFMUState(taken)


def test_a_reset_begins_anew(whole: Made, run: Run, host: Host) -> None:
    one = host(whole)
    wanted = stepped(one, whole, run.orders[:20])
    one.reset()
    one.enterInitializationMode(startTime=0.0)
    one.exitInitializationMode()
    np.testing.assert_array_equal(stepped(one, whole, run.orders[:20]), wanted)


def test_time_stands_among_the_values(whole: Made, run: Run, host: Host) -> None:
    one, time = host(whole), len(whole.layout.all)
    stepped(one, whole, run.orders[:3])
    surge, north = one.getFloat64(whole.at(STATES[3], STATES[0]))
    assert one.getFloat64([time]) == [pytest.approx(3 * DT)]
    assert one.getFloat64([*whole.at(STATES[3]), time, *whole.at(STATES[0])]) == [surge, pytest.approx(3 * DT), north]


@pytest.mark.parametrize(("do", "told"), [
    (lambda one, made: one.setFloat64(made.at("ned_position.north"), [1.0]), "is an output and cannot be set"),
    (lambda one, made: one.getFloat64([9999]), "no real variable 9999"),
    (lambda one, made: one.setFloat64(orders(made)[:1], [math.nan]), "no finite number"),
    (lambda one, made: one.setFloat64(made.at("initial.body_velocity.surge"), [1.0]), "fixed once the run has begun"),
    (lambda one, made: one.doStep(0.0, -DT), "it must be above zero"),
    (lambda one, made: one.doStep(5.0, DT), "a step from t = 5 s, but the ship is at 0 s"),
    (lambda one, made: one.getInt32([0]), "all variables are of type Float64"),
    (lambda one, made: one.enterEventMode(), "no events here"),
])  # fmt: skip
def test_a_wrong_call_is_told_in_one_line(whole: Made, host: Host, capfd: Any, do: Any, told: str) -> None:
    one = host(whole)
    with pytest.raises(Exception, match="fmi3"):
        do(one, whole)
    assert told in capfd.readouterr().out
    one.doStep(0.0, DT)  # and the ship is where it was


@pytest.mark.parametrize("given", [{"eventModeUsed": True}, {"guid": "another"}])
def test_what_is_not_instantiated(whole: Made, tmp_path: Path, given: dict[str, Any], capfd: Any) -> None:
    fmpy = pytest.importorskip("fmpy")
    from fmpy.fmi3 import FMU3Slave

    told = fmpy.read_model_description(str(whole.path))
    folder, name = fmpy.extract(str(whole.path), str(tmp_path / "open")), told.coSimulation.modelIdentifier
    one = FMU3Slave(guid=given.pop("guid", told.guid), unzipDirectory=folder, modelIdentifier=name, instanceName="ship")
    with pytest.raises(Exception, match="instantiate"):
        one.instantiate(**given)
    assert "modelDescription.xml" in (out := capfd.readouterr().out) or "without the event mode" in out


def test_validation_is_clean(whole: Made, hull: Made) -> None:
    validation = pytest.importorskip("fmpy.validation")
    assert validation.validate_fmu(str(whole.path)) == []
    assert validation.validate_fmu(str(hull.path)) == []


@pytest.mark.long
@pytest.mark.parametrize("name", ONE_OF_EACH.values())
def test_every_kind_of_model_goes_out(name: str, tmp_path: Path) -> None:
    """The C of a ship is that of FMI 2.0, where every ship goes out; what is around it is another."""
    validation = pytest.importorskip("fmpy.validation")
    import fmpy

    (path,) = save_fmu(load(name), tmp_path / "ship.fmu", fmi=3)
    assert validation.validate_fmu(str(path)) == []
    done = fmpy.simulate_fmu(str(path), stop_time=20.0)
    assert np.isfinite(done["ned_position.north"]).all()
    assert done["ned_position.north"][-1] > 0.0


def test_every_file_is_where_the_standard_has_it(whole: Made) -> None:
    schemas = Path(pytest.importorskip("fmpy").__file__).parent / "schema" / "fmi3"
    lxml = pytest.importorskip("lxml.etree")
    with zipfile.ZipFile(whole.path) as archive:
        names = set(archive.namelist())
        for file, schema in (("modelDescription.xml", "fmi3ModelDescription.xsd"),
                             ("sources/buildDescription.xml", "fmi3BuildDescription.xsd"),
                             ("terminalsAndIcons/terminalsAndIcons.xml", "fmi3TerminalsAndIcons.xsd")):  # fmt: skip
            lxml.XMLSchema(lxml.parse(str(schemas / schema))).assertValid(lxml.fromstring(archive.read(file)))
        built = ElementTree.fromstring(archive.read("sources/buildDescription.xml"))
        page = archive.read("documentation/index.html").decode()
        terminals = ElementTree.fromstring(archive.read("terminalsAndIcons/terminalsAndIcons.xml"))
    assert any(re.fullmatch(r"binaries/(x86_64|aarch64)-linux/esso_osaka_3m\.so", name) for name in names)
    assert {f"sources/{one.attrib['name']}" for one in built.iter("SourceFile")} <= names
    members = [one.attrib["variableName"] for one in terminals.iter("TerminalMemberVariable")]
    assert set(members) == {real.name for real in (*whole.layout.outputs, *whole.layout.inputs)}
    assert "ship.hull.Y_v" in page
    assert "order.delta" in page


def test_the_binary_shows_the_entry_points_of_the_standard(whole: Made, tmp_path: Path) -> None:
    fmi3 = pytest.importorskip("fmpy.fmi3")
    if not shutil.which("nm"):
        pytest.skip("no binutils")
    with zipfile.ZipFile(whole.path) as archive:
        archive.extractall(tmp_path)
    binary = next((tmp_path / "binaries").rglob("*.so"))
    listed = subprocess.run(["nm", "-D", "--defined-only", str(binary)], capture_output=True, text=True, check=True)
    names = {line.split()[-1] for line in listed.stdout.splitlines()}
    assert set(re.findall(r'_call\(\s*"(fmi3\w+)"', inspect.getsource(fmi3))) <= names
    assert all(name.startswith("fmi3") for name in names)


def test_the_sources_compile_under_every_warning(whole: Made, hull: Made, tmp_path: Path) -> None:
    strict = ["-std=c99", "-fsyntax-only", "-Wall", "-Wextra", "-Werror", "-pedantic"]
    for k, made in enumerate((whole, hull)):
        with zipfile.ZipFile(made.path) as archive:
            archive.extractall(tmp_path / str(k))
        files = [str(tmp_path / str(k) / "sources" / name) for name in ("fmi3.c", "slave.c", "ship.c")]
        done = subprocess.run([str(GCC), *strict, *files], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr


C_HOST = r"""
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdio.h>
#include "fmi3.h"

int main(int argc, char* argv[])
{
    void* lib = dlopen(argv[1], RTLD_NOW | RTLD_LOCAL);
    __typeof__(fmi3InstantiateCoSimulation)* make;
    __typeof__(fmi3EnterInitializationMode)* enter;
    __typeof__(fmi3ExitInitializationMode)* leave;
    __typeof__(fmi3GetFloat64)* get;
    __typeof__(fmi3DoStep)* step;
    fmi3ValueReference at[2] = {0, 3};
    double x[2], reached = 0.0;
    bool event, ended, early;
    int k, bad = 0;
    if (argc < 3 || !lib) { fprintf(stderr, "%s\n", dlerror()); return 2; }
    *(void**)&make = dlsym(lib, "fmi3InstantiateCoSimulation");
    *(void**)&enter = dlsym(lib, "fmi3EnterInitializationMode");
    *(void**)&leave = dlsym(lib, "fmi3ExitInitializationMode");
    *(void**)&get = dlsym(lib, "fmi3GetFloat64");
    *(void**)&step = dlsym(lib, "fmi3DoStep");
    fmi3Instance ship = make("ship", argv[2], NULL, false, false, false, false, NULL, 0, NULL, NULL, NULL);
    if (!ship) return 3;
    bad += enter(ship, false, 0.0, 5.0, false, 0.0) != fmi3OK; bad += leave(ship) != fmi3OK;
    for (k = 0; k < 100; k++)
        bad += step(ship, 5.0 + 0.1 * k, 0.1, true, &event, &ended, &early, &reached) != fmi3OK;
    bad += step(ship, 0.0, 0.1, true, &event, &ended, &early, &reached) != fmi3Error;
    bad += get(ship, at, 2, x, 2) != fmi3OK;
    printf("%.9g %.9g %.9g\n", x[0], x[1], reached);
    return bad ? 4 : 0;
}
"""


def test_a_host_without_python_runs_it(whole: Made, tmp_path: Path) -> None:
    with zipfile.ZipFile(whole.path) as archive:
        archive.extractall(tmp_path)
        token = ElementTree.fromstring(archive.read("modelDescription.xml")).attrib["instantiationToken"]
    (tmp_path / "host.c").write_text(C_HOST)
    program = tmp_path / "host"
    command = [str(GCC), "-std=gnu99", "-I", str(tmp_path / "sources"), str(tmp_path / "host.c"), "-o", str(program)]
    subprocess.run([*command, "-ldl"], check=True, capture_output=True)
    binary = next((tmp_path / "binaries").rglob("*.so"))
    done = subprocess.run([str(program), str(binary), token], capture_output=True, text=True, check=False, env={})
    assert done.returncode == 0, (done.returncode, done.stderr)
    north, surge, reached = map(float, done.stdout.split())
    assert reached == pytest.approx(15.0)
    assert surge == pytest.approx(load("esso_osaka_3m").speed, rel=1e-6), "a straight run, with nobody who listens"
    assert north == pytest.approx(10.0 * surge, rel=1e-6)


def test_the_command(tmp_path: Path, capsys: Any) -> None:
    path = tmp_path / "mariner.fmu"
    assert main(["export", "mariner_nomoto", "--fmu", str(path), "--fmi", "3", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["written"] == [str(path)]
    with zipfile.ZipFile(path) as archive:
        assert ElementTree.fromstring(archive.read("modelDescription.xml")).attrib["fmiVersion"] == "3.0"


@pytest.mark.parametrize(("options", "told"), [
    (("--fmi", "3"), "--fmi .*--fmu"),
    (("--fmi", "1", "--fmu", "k.fmu"), "--fmi is 1; .*2, 3"),
])  # fmt: skip
def test_versions_that_are_not(
    options: tuple[str, ...], told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["export", "kvlcc2", *options]) == 2
    assert re.fullmatch(rf"error: {told}.*\n", capsys.readouterr().err)
    with pytest.raises(ShipError, match=r"\b4\b.*\b2, 3"):
        save_fmu(load("kvlcc2"), "k.fmu", fmi=4)
    assert not list(tmp_path.iterdir())
