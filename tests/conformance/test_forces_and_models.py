"""Every ship of the library: its modules and its model keep the contract of `forces` and `models`."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import fields, is_dataclass, replace
from importlib import import_module
from inspect import isclass
from pkgutil import iter_modules
from typing import Any

import casadi as ca
import numpy as np
import pytest

import seatrial.forces
from seatrial.environment import Environment
from seatrial.forces import Flow, Force, Slipstream
from seatrial.forces.propeller import KoseWake
from seatrial.parameters import update, walk
from seatrial.ships.files import library, load

PAIRS = (("gamma_Rp", "gamma_Rn"), ("gamma_P", "gamma_N"), ("C_2p", "C_2n"))
HELD = ("rho", "L_pp", "d")


def modules() -> dict[str, tuple[Any, Any]]:
    """Every force module of the library by class, with the body it acts on."""
    found: dict[str, tuple[Any, Any]] = {}
    for name in library():
        model: Any = load(name).model
        for part in ("hull", "propeller", "rudder", "wind"):
            module = getattr(model, part, None)
            if module is not None:
                key = f"{type(module).__module__.rsplit('.', 1)[-1]}:{type(module).__name__}"
                found[key] = (module, model.body)
    standard, body = found["propeller:Standard"]
    shared = {f.name: getattr(standard, f.name) for f in fields(KoseWake)}
    return found | {"propeller:KoseWake": (KoseWake(**shared), body)}


MODULES = modules()
every_module = pytest.mark.parametrize("name", list(MODULES))
every_ship = pytest.mark.parametrize("name", library())
CHANNELS = ("u", "v_m", "r", "n_P", "delta", "u_A", "v_A")


def call(module: Any, body: Any, x: Any, slip: Any = None) -> tuple[Any, ...]:
    """Outputs of any module; a rudder gets the slipstream given, or one of its own making."""
    flow = Flow(*x, *(getattr(body, key) for key in HELD))
    if "Rudder" in type(module).__module__ or "rudder" in type(module).__module__:
        slipstream = Slipstream(*(slip if slip is not None else (0.6 * x[0], 0.3 * x[3] * 0.01, 0.2)))
        return tuple(module.force(flow, slipstream))
    out = module.force(flow)
    return tuple(out) if isinstance(out, Force) else (*out[0], *out[1])


def compiled(f: Callable[[Any], tuple[Any, ...]], n: int) -> tuple[ca.Function, ca.Function]:
    x = ca.SX.sym("x", n)
    y = ca.vertcat(*(ca.SX(e) for e in f(tuple(x[i] for i in range(n)))))
    return ca.Function("f", [x], [y]), ca.Function("j", [x], [ca.jacobian(y, x)])


GRID = [
    (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    *itertools.product((0.0, 0.4, -0.4), (0.0, 0.1, -0.1), (0.0, 0.05, -0.05), (0.0, 9.0, -9.0), (0.0, 0.3),
                       (0.0, -2.0), (0.0, 1.0)),
    (1e-9, 0.0, 0.0, 0.0, 0.3, 0.0, 0.0), (0.0, 1e-7, 1e-9, 1e-6, -0.3, 1e-8, 0.0),
    (0.3, 0.0, 0.0, 0.0, math.pi / 2, 0.0, 0.0),
]  # fmt: skip
SAMPLES = np.random.default_rng(7).uniform(-1, 1, (200, 7)) * (1.2, 0.5, 0.3, 12.0, 0.7, 5.0, 5.0)


def test_every_force_class_is_flown_by_some_ship() -> None:
    known = {name.split(":")[1] for name in MODULES} | {"Body"}
    for info in iter_modules(seatrial.forces.__path__):
        module = import_module(f"seatrial.forces.{info.name}")
        for cls in vars(module).values():
            if isclass(cls) and is_dataclass(cls) and cls.__module__ == module.__name__:
                assert cls.__name__ in known, f"no ship of the library uses {info.name}:{cls.__name__}"


@every_module
def test_numbers_are_declared(name: str) -> None:
    module, _ = MODULES[name]
    for path, meaning, value in walk(module):
        assert meaning.about, path
        assert meaning.low <= value <= meaning.high, path


@every_module
def test_silent_at_rest(name: str) -> None:
    assert all(abs(y) == 0 for y in call(*MODULES[name], (0.0,) * 7)[:3])


@every_module
def test_mirrored(name: str) -> None:
    module, body = MODULES[name]
    if not module.mirror_symmetric:
        pytest.skip("the module says that it is not symmetric")
    for a, b in PAIRS:
        if hasattr(module, a):
            module = update(module, {a: getattr(module, b)})
    for x in SAMPLES:
        here = call(module, body, tuple(map(float, x)))
        there = call(module, body, tuple(map(float, x * (1, -1, -1, 1, -1, 1, -1))))
        assert (there[0], -there[1], -there[2], *there[3:]) == pytest.approx(here, rel=1e-12, abs=1e-13)


@every_module
def test_finite_with_finite_jacobians(name: str) -> None:
    module, body = MODULES[name]
    f, j = compiled(lambda x: call(module, body, x), 7)
    for x in GRID:
        assert np.isfinite(np.array(f(x))).all(), x
        assert np.isfinite(np.array(ca.DM(j(x)).full())).all(), x


@every_module
def test_floats_equal_symbols(name: str) -> None:
    module, body = MODULES[name]
    f, _ = compiled(lambda x: call(module, body, x), 7)
    for x in [*map(tuple, SAMPLES.tolist()), *GRID]:
        direct = np.array(call(module, body, x), dtype=float)
        scale = max(float(np.abs(direct).max()), 1e-12)
        np.testing.assert_allclose(np.array(f(x)).ravel(), direct, rtol=0, atol=1e-12 * scale)


def _flat(model: Any) -> Callable[[Any], tuple[Any, ...]]:
    return lambda x: model.derivative(tuple(x[:6]), tuple(x[6:8]), Environment(*x[8:12]))


@every_ship
def test_model_is_finite_everywhere_and_equal_on_symbols(name: str) -> None:
    ship = load(name)
    g = _flat(ship.model)
    f, j = compiled(g, 12)
    scale = (
        1e3,
        1e3,
        3.0,
        ship.speed,
        0.3 * ship.speed,
        0.5 * ship.speed / ship.L_pp,
        12.0,
        0.6,
        5.0,
        5.0,
        0.3,
        0.3,
    )
    random = np.random.default_rng(3).uniform(-1, 1, (100, 12)) * scale
    rest = [np.zeros(12), *(np.eye(12)[i] * s for i in (3, 4, 5, 6, 7) for s in (0.3, -0.3))]
    for x in [*random, *rest]:
        direct = np.array(g(tuple(map(float, x))), dtype=float)
        symbols = np.array(f(x)).ravel()
        assert np.isfinite(direct).all()
        assert np.isfinite(ca.DM(j(x)).full()).all()
        np.testing.assert_allclose(symbols, direct, rtol=0, atol=1e-12 * max(1.0, np.abs(direct).max()))


@every_ship
def test_model_mirrors(name: str) -> None:
    model: Any = load(name).model
    for part in ("propeller", "rudder"):
        module = getattr(model, part, None)
        for a, b in PAIRS:
            if hasattr(module, a):
                model = update(model, {f"{part}.{a}": getattr(module, b)})
    ahead = (0.0, 0.0, 0.3, 0.8, -0.1, 0.05), (9.0, 0.2), Environment(3.0, 1.0, 0.2, -0.1)
    (x, y, p, u, v, r), (n, d), e = ahead
    here = model.derivative(*ahead)
    mirrored = Environment(e.wind_x, -e.wind_y, e.current_x, -e.current_y)
    there = model.derivative((x, -y, -p, u, -v, -r), (n, -d), mirrored)
    signs = (1, -1, -1, 1, -1, -1)
    assert tuple(s * w for s, w in zip(signs, there, strict=True)) == pytest.approx(
        here, rel=1e-12, abs=1e-15
    )


@every_ship
def test_parameters_may_be_symbols(name: str) -> None:
    model: Any = load(name).model
    names = [path for path, _, _ in walk(model)]
    p = ca.SX.sym("p", len(names))
    symbolic = update(model, {path: p[i] for i, path in enumerate(names)})
    x = (0.0, 0.0, 0.2, 0.5, -0.1, 0.03)
    y = ca.vertcat(*symbolic.derivative(x, (8.0, 0.2), Environment(2.0, 1.0, 0.1, 0.0)))
    values = [value for _, _, value in walk(model)]
    found = ca.Function("f", [p], [y, ca.jacobian(y, p)])(values)
    direct = model.derivative(x, (8.0, 0.2), Environment(2.0, 1.0, 0.1, 0.0))
    assert np.array(found[0]).ravel() == pytest.approx(np.array(direct, dtype=float), rel=1e-10)
    assert np.isfinite(found[1].full()).all()


def test_wind_blows_only_where_the_ship_has_a_wind_module() -> None:
    model: Any = load("esso_osaka_3m").model
    at = (0.0,) * 6, (0.0, 0.0)
    gale = Environment(0.0, 10.0)  # from the east, heading north: pushed to port
    assert model.derivative(*at, gale)[4] < 0
    assert replace(model, wind=None).derivative(*at, gale) == (0.0,) * 6
