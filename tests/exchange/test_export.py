"""Exported plants: the same rates and the same trajectory as the engine, in programs that have no seatrial."""

from __future__ import annotations

import json
import math
import re
import shutil
import subprocess
import sys
import zipfile
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from makes import ships
from seatrial.actuators import Actuator, Actuators, Shaft
from seatrial.cli.app import main
from seatrial.core.parameters import ParameterError, Parts
from seatrial.engine import floats
from seatrial.engine.rollout import simulator
from seatrial.exchange import Equations, equations_of, save_c, save_casadi, save_fmu, save_python
from seatrial.exchange.traced import _remembered
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.models import Sampled
from seatrial.ships import Entry, Ship, ShipError
from seatrial.ships.files import library, load, save
from seatrial.simulate.loop import closed_loop, loop_memory, open_loop, open_loop_parameters
from seatrial.simulate.run import approach, campaign
from tiers import slow_but

CONTINUOUS = tuple(name for name in library() if not isinstance(load(name).model, Sampled))
STABLE = ("kvlcc2", "esso_osaka_3m", "qiuxin5", "mariner_nomoto")
GCC = shutil.which("gcc")
needs_gcc = pytest.mark.skipif(GCC is None, reason="no C compiler")
# Ahead and astern, in calm and in wind, current, waves and shallow water; the last two at rest, in wind and in calm.
ROWS = 9


@cache
def exported(name: str) -> Equations:
    return equations_of(load(name))


def points(name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """States, controls and environments."""
    ship, rng = load(name), np.random.default_rng(7)
    U, L, n = ship.speed, ship.L_pp, len(ship.model.controls)
    x = rng.uniform(-1, 1, (ROWS, len(ship.model.states)))
    x[:, :6] *= (10 * L, 10 * L, math.pi, U, 0.3 * U, 0.3 * U / L)
    u = np.empty((ROWS, n))
    for k, control in enumerate(exported(name).controls):
        low, high = (at if math.isfinite(at) else other for at, other in ((control.low, -5.0), (control.high, 5.0)))
        u[:, k] = rng.uniform(low, high, ROWS)
    e = rng.uniform(-1, 1, (ROWS, 8)) * (U, U, 0.1 * U, 0.1 * U, 0.01 * L, 0.01 * L, 0.0, 0.0)
    e[:, 6], e[:, 7] = 2.0 * math.sqrt(L), 1.0 / (3.0 * float(getattr(ship.model, "body", ship).L_pp))
    e[:2], e[-1], x[-2:], u[-2:] = 0.0, 0.0, 0.0, 0.0
    return x, u, e


def engine_rates(name: str, x: np.ndarray, u: np.ndarray, e: np.ndarray) -> np.ndarray:
    ship = load(name)
    return simulator(open_loop(ship)).evaluate(x, np.hstack([u, e]), open_loop_parameters(ship))


def assert_rates(got: np.ndarray, wanted: np.ndarray, name: str) -> None:
    """1e-12 of each rate, and nothing where the engine has nothing."""
    worst = np.abs(got - wanted) - 1e-12 * np.abs(wanted)
    assert (worst <= 0.0).all(), f"{name}: {worst.max():.2e}"


def bare(code: str, text: str, *, casadi: bool = False, cwd: Path | None = None) -> list[list[float]]:
    """Rows that a Python without seatrial prints; without any installed package unless `casadi`."""
    block = "import sys, json; sys.modules['seatrial'] = None\n" if casadi else "import sys, json\n"
    flags = ["-I"] if casadi else ["-I", "-S"]
    done = subprocess.run(
        [sys.executable, *flags, "-c", block + code], input=text, capture_output=True, text=True, check=False, cwd=cwd
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def compiled(made: Equations, folder: Path, main_: str) -> Path:
    """A program of the exported C and a `main`, under every warning."""
    _, source = save_c(made, folder)
    driver, program = folder / f"{made.name}_main.c", folder / made.name
    driver.write_text(f'#include <stdio.h>\n#include "{made.name}.h"\nint main(void)\n{{\n{main_}\nreturn 0;\n}}\n')
    strict = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-pedantic"]
    done = subprocess.run(
        [str(GCC), *strict, str(driver), str(source), "-o", str(program), "-lm"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return program


def printed(program: Path, rows: np.ndarray) -> np.ndarray:
    text = "\n".join(" ".join(f"{v:.17g}" for v in row) for row in rows)
    done = subprocess.run([str(program)], input=text, capture_output=True, text=True, check=True)
    return np.array([[float(v) for v in line.split()] for line in done.stdout.splitlines()])


@pytest.mark.slow
@pytest.mark.parametrize("name", ships(CONTINUOUS))
def test_rates_of_the_casadi_function(name: str) -> None:
    x, u, e = points(name)
    got = np.array([np.asarray(exported(name).rates(*row)).ravel() for row in zip(x, u, e, strict=True)])
    assert_rates(got, engine_rates(name, x, u, e), name)


# Ships of the common kinds of model; the rest is slow.
QUICK = ("container_175m_nomoto2", "cybership2", "esso_190k_tanker", "esso_osaka", "kcs", "kvlcc2_l7", "mariner",
         "naval_blanke", "twin_virtual", "zeefakkel_speeds")  # fmt: skip


@pytest.mark.parametrize("name", slow_but(ships(CONTINUOUS), *QUICK))
def test_rates_of_the_python_file(name: str, tmp_path: Path) -> None:
    x, u, e = points(name)
    path = save_python(exported(name), tmp_path / "ship.py")
    space: dict[str, Any] = {}
    exec(compile(path.read_text(encoding="utf-8"), str(path), "exec"), space)
    got = np.array([space["rates"](*row) for row in zip(x.tolist(), u.tolist(), e.tolist(), strict=True)])
    assert_rates(got, engine_rates(name, x, u, e), name)
    assert "seatrial" not in path.read_text(encoding="utf-8")


@pytest.mark.long
@needs_gcc
@pytest.mark.parametrize("name", ships(CONTINUOUS))
def test_rates_of_the_c_file(name: str, tmp_path: Path) -> None:
    made, (x, u, e) = exported(name), points(name)
    upper = made.name.upper()
    program = compiled(made, tmp_path, f"""
        double v[{upper}_NX + {upper}_NU + {upper}_NE], d[{upper}_NX]; int i, k = 0;
        while (scanf("%lf", &v[k]) == 1) {{
            if (++k < {upper}_NX + {upper}_NU + {upper}_NE) continue;
            k = 0;
            {made.name}_rates(v, v + {upper}_NX, v + {upper}_NX + {upper}_NU, d);
            for (i = 0; i < {upper}_NX; i++) printf("%.17g ", d[i]);
            printf("\\n");
        }}""")  # fmt: skip
    assert_rates(printed(program, np.hstack([x, u, e])), engine_rates(name, x, u, e), name)


@dataclass(frozen=True)
class Run:
    """A turning circle of the engine: states, orders, memory of the actuators at the start."""

    made: Equations
    states: np.ndarray
    orders: np.ndarray
    memory: list[float]

    def check(self, x: Any) -> None:
        size = np.abs(self.states).max(axis=0)
        worst = np.abs(np.asarray(x, dtype=float) - self.states) / np.where(size > 0, size, 1.0)
        assert worst.max() <= 1e-9, f"{self.made.name}: {worst.max():.2e}"


@cache
def turning(name: str) -> Run:
    """Rudder (or thrusters) to 20 degrees, through the actuators."""
    ship = load(name)
    speed, n_P = approach(ship)
    run = flown(ship, Turning(n_P, math.radians(20.0)), speed)
    assert np.abs(run.states[-1, 2]) > 0.3, "it turned"
    return run


def flown(ship: Ship, policy: Any, speed: float, steps: int = 300) -> Run:
    dt = 2.0 if ship.L_pp > 50.0 else 0.2
    run = campaign(ship, policy, {}, speed=speed, duration=steps * dt, dt=dt, threads=1)
    system, n = closed_loop(ship, policy, dt), len(ship.model.states)
    controls = [system.stored.index(f"{control}_cmd") for control in ship.model.controls]
    memory = loop_memory(ship, policy, dt, {"policy.n_P": policy.n_P}, (0.0,) * 6)
    rows = run.values[0]
    made = equations_of(ship, dt)
    kept = len(made.servos.memory) if made.servos else 0  # what the policy remembers comes after
    return Run(made, rows[:, :n], rows[:-1][:, controls], [float(v) for v in memory[:kept]])


PYTHON_RUN = """
sys.path.insert(0, ".")
import ship
given = json.load(sys.stdin)
x, a, rows = given["x"], given["a"], [given["x"]]
for o in given["o"]:
    x, a = ship.ordered_step(x, a, o)
    rows.append(list(x))
print(json.dumps(rows))
"""

CASADI_RUN = """
import casadi as ca
rates, step, ordered = (ca.Function.load(f"ship{s}.casadi") for s in ("", "_step", "_ordered_step"))
assert rates.name_in() == ["x", "u", "e"] and rates.name_out() == ["dx"], rates
assert step.name_in() == ["x", "u", "e", "dt"] and step.name_out() == ["x_next"], step
assert ordered.name_in() == ["x", "a", "o", "e"] and ordered.name_out() == ["x_next", "a_next"], ordered
given = json.load(sys.stdin)
x, a, rows = given["x"], given["a"], [given["x"]]
for o in given["o"]:
    now = ordered(x=x, a=a, o=o)
    x, a = now["x_next"], now["a_next"]
    rows.append([float(v) for v in x.full().ravel()])
print(json.dumps(rows))
"""


def told(run: Run) -> str:
    return json.dumps({"x": run.states[0].tolist(), "a": run.memory, "o": run.orders.tolist()})


@pytest.mark.slow
@pytest.mark.parametrize("name", STABLE)
def test_trajectory_of_the_python_file(name: str, tmp_path: Path) -> None:
    run = turning(name)
    save_python(run.made, tmp_path / "ship.py")
    run.check(bare(PYTHON_RUN, told(run), cwd=tmp_path))


@pytest.mark.slow
@pytest.mark.parametrize("name", STABLE)
def test_trajectory_of_the_casadi_file(name: str, tmp_path: Path) -> None:
    run = turning(name)
    save_casadi(run.made, tmp_path / "ship.casadi")
    run.check(bare(CASADI_RUN, told(run), casadi=True, cwd=tmp_path))


@pytest.mark.slow
@needs_gcc
@pytest.mark.parametrize("name", STABLE)
def test_trajectory_of_the_c_file(name: str, tmp_path: Path) -> None:
    run = turning(name)
    upper, n = run.made.name.upper(), len(run.memory)
    program = compiled(run.made, tmp_path, f"""
        double x[{upper}_NX], a[{upper}_NA], o[{upper}_NU], e[{upper}_NE] = {{0.0}}; int i;
        for (i = 0; i < {upper}_NX; i++) if (scanf("%lf", &x[i]) != 1) return 1;
        for (i = 0; i < {upper}_NA; i++) if (scanf("%lf", &a[i]) != 1) return 1;
        for (;;) {{
            for (i = 0; i < {upper}_NX; i++) printf("%.17g ", x[i]);
            printf("\\n");
            for (i = 0; i < {upper}_NU; i++) if (scanf("%lf", &o[i]) != 1) return 0;
            {run.made.name}_ordered_step(x, a, o, e, x, a);
        }}""")  # fmt: skip
    first = np.concatenate([run.states[0], run.memory])
    assert len(first) == run.states.shape[1] + n
    run.check(printed(program, [first, *run.orders]))  # type: ignore[arg-type]


@pytest.mark.slow
def test_actuators_with_lag_dead_time_and_memory(tmp_path: Path) -> None:
    ship = load("kvlcc2")
    speed, n_P = approach(ship)
    rudder = Actuator(low=-0.6, high=0.6, rate=math.radians(2.3), lag=1.5, dead_time=3.0)
    shaft = Shaft(low=-1.0, high=2.0, rate=0.01, rate_down=0.02, pause=10.0, dead_time=1.0)
    ship = replace(ship, actuators=Actuators({"rudder": rudder, "propeller": shaft}))
    run = flown(ship, Zigzag(n_P, math.radians(10.0), math.radians(10.0)), speed)
    assert len(np.unique(run.orders[:, 1])) == 2, "the rudder was reversed"
    assert [one.name for one in run.made.servos.memory] == [  # type: ignore[union-attr]
        "n_P", "n_P.pause_left", "n_P.last_side", "n_P.order_0", "delta", "delta.order_0", "delta.order_1"
    ]
    save_python(run.made, tmp_path / "ship.py")
    run.check(bare(PYTHON_RUN, told(run), cwd=tmp_path))
    save_casadi(run.made, tmp_path / "ship.casadi")
    run.check(bare(CASADI_RUN, told(run), casadi=True, cwd=tmp_path))


@pytest.mark.slow
def test_no_text_of_a_ship_breaks_a_file(tmp_path: Path) -> None:
    rough = '*/ """ \\ ??/ /* \n # é'
    ship = load("qiuxin5")
    entries = {path: Entry(rough, entry.given) for path, entry in ship.entries.items()}
    made = equations_of(replace(ship, name=f"5 é{rough}", notes={"title": rough}, entries=entries), 0.2)
    space: dict[str, Any] = {}
    exec(save_python(made, tmp_path / "tug.py").read_text(encoding="utf-8"), space)
    x, u, e = points("qiuxin5")
    assert space["rates"](x[0], u[0], e[0]) == pytest.approx(engine_rates("qiuxin5", x, u, e)[0], rel=1e-12)
    assert made.name.isidentifier()
    if GCC is not None:
        compiled(made, tmp_path, "")


def test_a_step_far_below_the_dead_time_is_refused() -> None:
    late = replace(load("kvlcc2"), actuators=Actuators({"rudder": Actuator(dead_time=3.0)}))
    with pytest.raises(ShipError, match=r"\b3000000\b.*\bdelta\b"):
        equations_of(late, 1e-6)


def test_step_is_that_of_the_engine() -> None:
    ship, (x, u, e) = load("kvlcc2"), points("kvlcc2")
    got = np.asarray(exported("kvlcc2").step(x[0], u[0], e[0], 2.0)).ravel()
    parameters = tuple(open_loop_parameters(ship).tolist())
    wanted = floats.step(open_loop(ship), tuple(x[0]), (*u[0], *e[0]), parameters, 2.0)
    assert got == pytest.approx(np.array(wanted), rel=1e-12)


def test_names_units_and_sources_are_in_the_files(tmp_path: Path) -> None:
    made = exported("qiuxin5")
    header = save_c(made, tmp_path)[0].read_text()
    script = save_python(made, tmp_path / "tug.py").read_text(encoding="utf-8")
    assert "x[2]  psi [rad]" in header
    assert "u[0]  n_1 [1/s]" in header
    assert "damping.X_u = -8.9859 kg/s" in header
    assert re.search(r'"damping.X_u": -8.9859,  # kg/s, .*; you2023 Tab. 3', script)
    described = json.loads(save_casadi(made, tmp_path / "tug.casadi")[-1].read_text(encoding="utf-8"))
    assert [one["name"] for one in described["u"]] == ["n_1", "alpha_1", "n_2", "alpha_2"]
    assert described["u"][0] | {"about": ""} == {"name": "n_1", "unit": "1/s", "about": "", "low": 0.0, "high": 10.0}


def test_numbers_of_the_python_file_can_be_changed(tmp_path: Path) -> None:
    space: dict[str, Any] = {}
    exec(save_python(exported("qiuxin5"), tmp_path / "tug.py").read_text(encoding="utf-8"), space)
    state, control = (0.0, 0.0, 0.0, 0.5, 0.0, 0.0), (5.0, 0.0, 5.0, 0.0)
    heavier = space["NUMBERS"] | {"inertia.m_11": 2.0 * space["NUMBERS"]["inertia.m_11"]}
    assert space["rates"](state, control, p=heavier)[3] == pytest.approx(0.5 * space["rates"](state, control)[3])


def test_no_allocation_and_no_globals_in_c(tmp_path: Path) -> None:
    source = save_c(equations_of(load("esso_osaka_3m"), 0.2), tmp_path)[1].read_text()
    assert not re.search(r"\b(malloc|calloc|realloc|free|static)\b", source)
    assert not re.search(r"^(const )?(double|int)\b", source, re.MULTILINE)


def test_models_in_discrete_time_are_refused() -> None:
    with pytest.raises(ShipError, match=r"^kvlcc2_l7_arx: .*discrete time"):
        equations_of(load("kvlcc2_l7_arx"))


def test_a_file_is_replaced_whole(tmp_path: Path) -> None:
    path = tmp_path / "tug.py"
    path.write_text("old")
    save_python(exported("qiuxin5"), path)
    assert path.read_text(encoding="utf-8").startswith('"""Qiuxin')
    assert [p.name for p in tmp_path.iterdir()] == ["tug.py"]


@pytest.mark.parametrize(("options", "text"), [
    ((), "export to what? give --casadi FILE, --c FOLDER, --python FILE or --fmu FILE"),
    (("--casadi", "none/f.casadi"), "no such folder: none"),
    (("--python", "none/f.py"), "no such folder: none"),
    (("--python", "f.txt"), "a Python file ends in .py"),
    (("--casadi", "."), "is a folder; name a file"),
    (("--c", "taken"), "not a folder that can be made"),
    (("--python", "f.py", "--casadi", "f.py"), "name one file"),
    (("--python", "f.py", "--actuators", "0"), "a step of 0 s; it must be above zero"),
    (("--python", "f.py", "--actuators", "nan"), "it must be above zero"),
])  # fmt: skip
def test_a_wrong_request_is_one_line(
    options: tuple[str, ...], text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("taken").write_text("")
    assert main(["export", "mariner_nomoto", *options]) == 2
    said = capsys.readouterr()
    assert text in said.err
    assert said.err.count("\n") == 1
    assert [p.name for p in tmp_path.iterdir()] == ["taken"]


def test_the_command_writes_all_forms(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    monkeypatch.chdir(tmp_path)
    asked = ["--casadi", "f.casadi", "--c", "c", "--python", "f.py", "--actuators", "0.2", "--json"]
    assert main(["export", "qiuxin5", *asked]) == 0
    written = json.loads(capsys.readouterr().out)["written"]
    assert sorted(written) == ["c/qiuxin5.c", "c/qiuxin5.h", "f.casadi", "f.casadi.json", "f.py",
                               "f_ordered_step.casadi", "f_step.casadi"]  # fmt: skip
    assert all(Path(path).stat().st_size for path in written)


def blocks(language: str) -> list[str]:
    text = (Path(__file__).parents[2] / "docs" / "tutorials" / "export.md").read_text(encoding="utf-8")
    return re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)


@pytest.mark.slow
def test_the_tutorial_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for line in blocks("console")[0].splitlines():
        assert main(line.removeprefix("$ seatrial ").split()) == 0
    for block in blocks("python"):
        done = subprocess.run([sys.executable, "-c", block], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
    if GCC is not None:
        head, body = blocks("c")[0].split("\n\n", 1)
        code = f"#include <stdio.h>\n{head}\nint main(void)\n{{\n{body}\nprintf(\"%g\\n\", heading);\nreturn 0;\n}}\n"
        Path("tug/main.c").write_text(code)
        built = [GCC, "-std=c99", "-Wall", "-Wextra", "-Werror", "tug/main.c", "tug/qiuxin5.c", "-o", "try", "-lm"]
        done = subprocess.run(built, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        assert float(subprocess.run(["./try"], capture_output=True, text=True, check=True).stdout) != 0.0


ODD = ("bow\nimport os\nos.abort()", "bow\x01", "bow\x1b[2J", "../bow", "a.b", "'''", "", " bow")


@pytest.mark.parametrize("name", ODD)
def test_a_name_that_could_become_code_is_refused_where_the_ship_is_read(name: str, tmp_path: Path) -> None:
    path = save(load("qiuxin5"), tmp_path / "tug.toml")
    whole = path.read_text()
    path.write_text(whole.replace("[thrusters.1]", f"[thrusters.{json.dumps(name)}]"))
    with pytest.raises(ShipError, match=r"tug\.toml: thrusters: ") as refused:
        load(path)
    assert str(refused.value).isprintable()
    with pytest.raises(ParameterError, match="is named"):
        Parts((name,), (None,))
    path.write_text(whole.replace('name = "qiuxin5"', f"name = {json.dumps('a' + chr(1) + name)}"))
    with pytest.raises(ShipError, match=r"tug\.toml: name\b") as refused:
        load(path)
    assert str(refused.value).isprintable()


@pytest.mark.slow
def test_names_in_other_letters_reach_python_and_c_and_are_refused_for_an_fmu(tmp_path: Path) -> None:
    ship, x, u = load("qiuxin5"), [0.0, 0.0, 0.0, 0.5, 0.1, 0.01], [1.0, 0.2, 1.0, 0.1]
    model: Any = ship.model
    renamed = replace(ship, model=replace(model, thrusters=Parts(("hélice-1", "2"), model.thrusters.components)))
    loaded: list[dict[str, Any]] = [{}, {}]
    for names, made in zip(loaded, (equations_of(ship), equations_of(renamed)), strict=True):
        exec(save_python(made, tmp_path / "tug.py").read_text(encoding="utf-8"), names)
    assert loaded[1]["CONTROLS"][0] == "n_hélice-1"
    assert loaded[1]["rates"](x, u) == loaded[0]["rates"](x, u)
    assert all(path.read_text(encoding="utf-8").isascii() for path in save_c(equations_of(renamed), tmp_path))
    with pytest.raises(ShipError, match="ASCII"):
        save_fmu(renamed, tmp_path / "tug.fmu")
    assert not list(tmp_path.glob("*.fmu"))


@pytest.mark.slow
def test_the_description_of_an_fmu_is_xml_whatever_its_texts_hold(tmp_path: Path) -> None:
    ship = load("mariner_nomoto")
    odd = replace(ship, name="m\x01\x1b", notes={"title": 'a "<b>" \x02 &\ufffe'})
    target, *_ = save_fmu(odd, tmp_path / "odd\x01.fmu")
    with zipfile.ZipFile(target) as archive:
        root = ElementTree.fromstring(archive.read("modelDescription.xml"))
    assert root.attrib["modelName"].isprintable()


@pytest.mark.slow
@pytest.mark.parametrize("name", ships(CONTINUOUS))
def test_the_python_file_takes_arrays_as_it_takes_lists(name: str, tmp_path: Path) -> None:
    """Of any type of number, for rates, step and actuators: the same floats, those of the engine."""
    made: dict[str, Any] = {}
    exec(save_python(equations_of(load(name), 0.1), tmp_path / "ship.py").read_text(encoding="utf-8"), made)
    x, u, e = points(name)
    got = np.array([made["rates"](*row) for row in zip(x, u, e, strict=True)])
    assert_rates(got, engine_rates(name, x, u, e), name)
    a = np.linspace(-0.3, 0.3, len(exported_memory(name)))
    for of in (np.float32, np.float64):
        for row in zip(x.astype(of), u.astype(of), e.astype(of), strict=True):
            lists = [one.astype(float).tolist() for one in row]
            assert made["rates"](*row) == made["rates"](*lists)
            assert made["step"](*row, dt=of(0.5)) == made["step"](*lists, dt=0.5)
            after = made["ordered_step"](row[0], a.astype(of), row[1], row[2])
            assert after == made["ordered_step"](lists[0], a.astype(of).astype(float).tolist(), *lists[1:])
            assert {type(value) for part in after for value in part} == {float}


def exported_memory(name: str) -> tuple[Any, ...]:
    servos: Any = equations_of(load(name), 0.1).servos
    return servos.memory


@pytest.mark.parametrize(("name", "of"), [
    ("n_P", "1/s"), ("n_P.pause_left", "s"), ("n_P.last_side", ""), ("n_P.order_0", "1/s"), ("delta", "rad"),
    ("delta.order_1", "rad"), ("delta.pause_left", "s"),
])  # fmt: skip
def test_what_an_actuator_remembers_has_its_unit(name: str, of: str) -> None:
    assert _remembered(name).unit == of
