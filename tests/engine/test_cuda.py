"""The kernels of a GPU: their source equals the C kernels on the processor, and compiles for the device.

Without a CUDA device the source runs behind a few macros (`cuda_shim`); with one the same tests run on it too.
"""

from __future__ import annotations

import importlib.util
import io
import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cuda_shim import Shim
from makes import TRACED
from seatrial.core.errors import RequestError
from seatrial.data import Array
from seatrial.engine import System, cache, csource, simd, trace
from seatrial.engine.compilers import Compiler, compiler
from seatrial.engine.cuda import DeviceError, gpu, lanes, source
from seatrial.engine.cuda.named import device_of
from seatrial.engine.rollout import sensitivity, simulator
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load
from seatrial.simulate.loop import closed_loop
from seatrial.simulate.run import campaign, open_loop, simulate

PLAIN = ("-O1", "-ffp-contract=off", "-fno-builtin", "-fno-math-errno", "-shared", "-fPIC")
"""Flags by which a compiler changes no operation and calls the scalar functions of the library."""

FREE = ("hull.Y_v", "hull.N_r", "rudder.t_R", "propeller.w_P0", "hull.X_vv", "hull.N_vvr", "rudder.a_H")


def machine() -> Any:
    """The CUDA device of this machine."""
    try:
        return device_of("cuda")
    except DeviceError as error:
        pytest.skip(str(error))


@pytest.fixture(params=["shim", pytest.param("cuda", marks=pytest.mark.cuda)])
def device(request: Any) -> Any:
    return Shim() if request.param == "shim" else machine()


@pytest.fixture
def plain(monkeypatch: pytest.MonkeyPatch) -> None:
    """Both sources compiled without changing an operation, and printed with all divisions."""
    monkeypatch.setattr(Compiler, "flags", property(lambda _: PLAIN))
    for printer in (source, csource):
        monkeypatch.setattr(printer, "shared_reciprocals", lambda found, scope: found)
    kept = (lanes.rollout_code, lanes.sensitivity_code, simd._rollout_source, simd._sensitivity_source)
    for one in kept:
        one.cache_clear()
    yield
    for one in kept:
        one.cache_clear()


def difference(a: Array, b: Array) -> float:
    """Greatest difference of two runs, each column over its own greatest value."""
    axes = tuple(range(a.ndim - 1))
    size = np.maximum(np.abs(a).max(axis=axes), 1e-30)
    return float((np.abs(a - b).max(axis=axes) / size).max())


def runs(case: Any, *devices: Any, **given: Any) -> list[Array]:
    z, s = case.ahead(37), case.series(37, 40)
    settings: dict[str, Any] = {"dt": case.dt, "steps": 40, "every": 7, "memory0": case.memory(z, s), **given}
    return [simulator(case.system, device=one).run(z, s, case.parameters, **settings).values for one in devices]


@pytest.mark.slow
@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize("case", ["kvlcc2_l7", "esso_osaka_3m"], indirect=True)
def test_the_source_equals_the_c_kernel_bit_for_bit(case: Any) -> None:
    assert np.array_equal(*runs(case, "cpu", Shim()))
    z, s = case.ahead(5), case.series(5, 12)
    given: dict[str, Any] = {"dt": case.dt, "steps": 12, "every": 3}
    free = tuple(name for name in FREE if name in case.system.parameters)
    ours = sensitivity(case.system, free, device=Shim()).run(z, s, case.parameters, **given)
    usual = sensitivity(case.system, free).run(z, s, case.parameters, **given)
    assert np.array_equal(ours[0], usual[0])
    assert np.array_equal(ours[1], usual[1])


@pytest.mark.usefixtures("plain")
def test_a_closed_loop_equals_the_c_kernel_bit_for_bit() -> None:
    ship, policy = load("kvlcc2_l7"), Zigzag(n_P=11.0, delta=0.35, psi=0.35)
    vary = {"ship.hull.Y_v": np.linspace(-0.4, -0.25, 9), "rudder.rate": np.linspace(0.1, 0.6, 9)}
    given: dict[str, Any] = {"speed": 1.1, "duration": 20.0, "every": 5}
    usual, ours = (campaign(ship, policy, vary, device=one, **given).values for one in ("cpu", Shim()))
    assert np.array_equal(usual, ours)
    assert np.ptp(ours[:, -1, 1]) > 0.1  # lanes that differ


@pytest.mark.slow
@pytest.mark.parametrize("case", ["kvlcc2_l7", "esso_osaka_3m_hybrid", "kvlcc2_l7_arx"], indirect=True)
def test_a_device_equals_the_processor(case: Any, device: Any) -> None:
    usual, ours = runs(case, "cpu", device)
    assert difference(usual, ours) < 1e-11
    z, s = case.ahead(37), case.series(37, 40)
    single = simulator(case.system, device=device, precision="single").run(
        z, s, case.parameters, dt=case.dt, steps=40, every=7, memory0=case.memory(z, s)
    )
    assert 1e-9 < difference(usual, single.values) < 2e-5


@pytest.mark.long
@pytest.mark.parametrize("case", TRACED, indirect=True)
def test_every_ship_of_the_library_on_a_device(case: Any, device: Any) -> None:
    assert difference(*runs(case, "cpu", device)) < 1e-11
    if isinstance(device, Shim) and importlib.util.find_spec("cuda"):
        for single in (False, True):
            assert gpu.compiled(lanes.rollout_code(case.system, (), single), "sm_90", single)


def test_euler_and_series_that_hold_or_are_shared(l7: Any, device: Any) -> None:
    z, s = l7.ahead(5), l7.series(1, 20)[0]
    held, shared = np.repeat(s[None, :1], 5, axis=0), np.broadcast_to(s, (5, *s.shape))
    for series in (held, shared):
        for method in ("rk4", "euler"):
            given: dict[str, Any] = {"dt": 0.05, "steps": 20, "method": method, "t0": 3.0}
            usual, ours = (simulator(l7.system, device=one).run(z, series, l7.parameters, **given)
                           for one in ("cpu", device))  # fmt: skip
            assert difference(usual.values, ours.values) < 1e-12
            assert np.array_equal(usual.t, ours.t)


@pytest.mark.slow
@pytest.mark.parametrize(("precision", "off"), [("double", 1e-11), ("single", 1e-4)])
def test_sensitivities_on_a_device(l7: Any, device: Any, precision: str, off: float) -> None:
    """Seven parameters and six initial states: more columns than a kernel carries, lane-wise parameters among them."""
    z, s = l7.ahead(5), l7.series(5, 30)
    own = np.linspace(0.9, 1.1, 5)[:, None] * l7.parameters[l7.system.parameters.index("hull.Y_v")]
    given: dict[str, Any] = {"dt": 0.05, "steps": 30, "every": 9, "lanewise": own}
    usual, ours = (
        sensitivity(l7.system, FREE, ("hull.Y_v",), device=one, precision=kind).run(z, s, l7.parameters, **given)
        for one, kind in (("cpu", "double"), (device, precision))
    )
    assert ours[1].shape == (5, 4, 6, 13)
    assert difference(usual[0], ours[0]) < off
    assert difference(usual[1].swapaxes(2, 3), ours[1].swapaxes(2, 3)) < off


def test_a_lane_depends_on_no_other(l7: Any, device: Any) -> None:
    z, s, engine = l7.ahead(40), l7.series(40, 10), simulator(l7.system, device=device)
    many = engine.run(z, s, l7.parameters, dt=0.05, steps=10).values
    few = engine.run(z[7:12], s[7:12], l7.parameters, dt=0.05, steps=10).values
    assert np.array_equal(many[7:12], few)


def test_parameters_of_all_lanes_are_those_of_each_run(l7: Any, device: Any) -> None:
    z, s, engine = l7.ahead(3), l7.series(3, 10), simulator(l7.system, device=device)
    other = l7.parameters.copy()
    other[l7.system.parameters.index("hull.Y_v")] *= 1.5
    first = engine.run(z, s, l7.parameters, dt=0.05, steps=10).values
    second = engine.run(z, s, other, dt=0.05, steps=10).values
    assert np.abs(first - second).max() > 1e-6
    assert np.array_equal(engine.run(z, s, l7.parameters, dt=0.05, steps=10).values, first)


def test_failures_and_one_run_on_a_device(device: Any) -> None:
    explosive = System(states=("a",), series=("c",), parameters=(), derivative=lambda z, a, p: (z[0] * z[0] + a[0],))
    run = simulator(explosive, device=device).run(np.array([[1.0], [-1.0]]), np.zeros((2, 1, 1)), np.zeros(0), dt=0.05,
                                                  steps=60)  # fmt: skip
    (failure,) = run.failures
    assert failure.lane == 0
    assert 0.9 < failure.time < 1.6
    ship = load("kvlcc2_l7")
    policy = Turning(n_P=11.0, delta=0.6)
    usual, ours = (simulate(ship, policy, duration=30.0, device=one) for one in ("cpu", device))
    assert ours["psi"] == pytest.approx(usual["psi"], rel=1e-9)


@pytest.mark.slow
def test_what_a_device_cannot_do_is_said(l7: Any) -> None:
    with pytest.raises(DeviceError, match="precision"):
        simulator(l7.system, precision="single")
    with pytest.raises(DeviceError, match="'half'"):
        simulator(l7.system, device=Shim(), precision="half")
    for name in ("gpu", "cuda:x", "CUDA"):
        with pytest.raises(DeviceError, match="known: cpu, cuda"):
            simulator(l7.system, device=name)
    with pytest.raises(DeviceError, match="processor"):
        simulator(l7.system, device=Shim()).evaluate(l7.ahead(1), np.zeros((1, 10)), l7.parameters)
    with pytest.raises(ValueError, match="3 lanes of 5 steps"):
        simulator(l7.system, device=Shim()).run(l7.ahead(3), l7.series(3, 5), l7.parameters, dt=0.1, steps=9)


@pytest.mark.slow
@pytest.mark.cuda
def test_threads_with_parameters_of_their_own(l7: Any) -> None:
    z, s, engine = l7.ahead(3), l7.series(3, 10), simulator(l7.system, device=machine())

    def run(share: float) -> Array:
        return engine.run(z, s, share * l7.parameters, dt=0.05, steps=10).values

    shares = [0.9, 1.0, 1.1] * 10
    alone = {share: run(share) for share in shares[:3]}
    with ThreadPoolExecutor(3) as pool:
        for share, there in zip(shares, pool.map(run, shares), strict=True):
            assert np.array_equal(there, alone[share])


@pytest.mark.cuda
def test_what_does_not_fit_the_device_is_said() -> None:
    with pytest.raises(DeviceError, match=r"no room for 5\.63e\+05 GB.*fewer lanes"):
        machine().empty((1 << 46,), np.float64)


def test_without_a_device_one_line_says_what_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    gpu.gpu.cache_clear()
    with pytest.raises(RequestError, match="99") as said:  # exit status 2
        device_of("cuda:99")
    assert "\n" not in str(said.value)

    def absent(name: str) -> Any:
        raise ImportError(name)

    monkeypatch.setattr(gpu, "import_module", absent)
    gpu._part.cache_clear()
    with pytest.raises(DeviceError, match=r"seatrial\[cuda\]"):
        device_of("cuda:98")


def printed(single: bool) -> dict[str, str]:
    """CUDA sources of a zigzag, and of the sensitivities with respect to as many parameters as a kernel carries."""
    ship = load("kvlcc2_l7")
    loop, system = closed_loop(ship, Zigzag(n_P=11.0, delta=0.35, psi=0.35), 0.1), open_loop(ship)
    part = lanes.parts(FREE, 6, lanes.SINGLE_COLUMNS if single else lanes.COLUMNS)[0]
    return {"rollout": lanes.rollout_code(loop, (), single),
            "sensitivity": lanes.sensitivity_code(system, part, (), single)}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("single", [False, pytest.param(True, marks=pytest.mark.long)])
def test_nvrtc_compiles_what_it_is_given(single: bool) -> None:
    """To machine code of an H100, where a closed loop stays in its registers."""
    core = pytest.importorskip("cuda.core")
    pytest.importorskip("cuda.bindings.nvrtc")
    for name, text in printed(single).items():
        log = io.StringIO()
        options = core.ProgramOptions(arch="sm_90", ptxas_options="-v", disable_warnings=True)
        code = core.Program(text, "c++", options).compile("cubin", logs=log).code
        assert code[:4] == b"\x7fELF"
        told = log.getvalue().partition(f"entry function '{name}'")[2]
        if name == "rollout":
            assert re.findall(r"(\d+) bytes spill stores", told)[0] == "0"
            assert int(re.findall(r"Used (\d+) registers", told)[0]) <= (
                64 if single else 128
            )  # 8 or 4 warps a scheduler


@pytest.mark.slow
def test_code_is_kept_by_content(monkeypatch: pytest.MonkeyPatch, tmp_path: Any) -> None:
    pytest.importorskip("cuda.core")
    monkeypatch.setenv("SEATRIAL_CACHE", str(tmp_path))
    text = 'extern "C" __global__ void k(double* x) { x[0] = sin(x[1]); }'
    first = gpu.compiled(text, "sm_90", False)
    (kept,) = (tmp_path / "kernels").iterdir()
    written = kept.stat().st_mtime_ns
    assert gpu.compiled(text, "sm_90", False) == first
    assert kept.stat().st_mtime_ns == written
    kept.write_bytes(kept.read_bytes()[:-5])  # an accident
    assert gpu.compiled(text, "sm_90", False) == first
    assert gpu.compiled(text, "sm_80", False) != first
    with pytest.raises(cache.CompilerError, match="NVRTC"):
        gpu.compiled("this is no CUDA", "sm_90", False)


@pytest.mark.slow
def test_divisions_by_one_denominator_become_products(l7: Any) -> None:
    j = trace.jacobian(l7.system, FREE)
    text = source.sensitivity_source(l7.system, j, 6, {}, False)
    in_stages = text.partition("int stage=0")[2] or text.partition("stage<stages")[2]
    assert 0 < in_stages.count("/") < 10
    assert sum("/" in one.expression for one in source.statements(j.function)[0]) > 40


@pytest.mark.long
def test_the_way_to_a_gpu_by_a_stand_in_for_its_driver(tmp_path: Path) -> None:
    """Every test of a device through cuda-core, whose calls of the driver end in main memory."""
    pytest.importorskip("cuda.core")
    tests = Path(__file__).parents[1]
    build = [
        *compiler().command,
        "-O1",
        "-shared",
        "-fPIC",
        "-o",
        str(tmp_path / "libcuda.so.1"),
        str(tests / "cuda_driver.c"),
    ]
    subprocess.run([*build, "-ldl"], check=True, capture_output=True)
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "cuda_driver", "-p", "no:cacheprovider", "-m", "cuda",
         str(Path(__file__)), str(tests / "envs" / "test_device.py")],
        env={**os.environ, "LD_LIBRARY_PATH": str(tmp_path), "PYTHONPATH": os.pathsep.join((str(tests), *sys.path))},
        cwd=tests.parent, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout[-3000:]
    passed = re.search(r"(\d+) passed", done.stdout)
    assert passed is not None
    assert int(passed[1]) >= 14
