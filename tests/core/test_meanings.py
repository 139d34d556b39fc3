"""What a number of the catalogue may be, and what is assumed where a file is silent: nothing, by rules for all.

The rules: a limit is a round figure; none keeps a number from being small, but for densities, fullness and the like;
what a file leaves out has no force.  What departs from a rule is listed with its value.
"""

from __future__ import annotations

import dataclasses
import importlib
import math
import pkgutil
from collections.abc import Iterator
from typing import Any

import pytest

import seatrial
from seatrial.core.parameters import Spec
from seatrial.environment import CALM, PLACE, Charted, Environment, Uniform
from seatrial.forces import Flow

ROOMS = ("forces", "models", "manoeuvres", "actuators")
TURN = 2.0 * math.pi


def numbers() -> Iterator[tuple[str, Spec, Any]]:
    """Every number of the rooms: class and name, its meaning, its default (None without)."""
    seen: set[type] = set()
    for room in ROOMS:
        whole = importlib.import_module(f"seatrial.{room}")
        inner = pkgutil.iter_modules(whole.__path__) if hasattr(whole, "__path__") else ()
        for module in (whole, *(importlib.import_module(f"seatrial.{room}.{one.name}") for one in inner)):
            for thing in vars(module).values():
                if not (isinstance(thing, type) and dataclasses.is_dataclass(thing)) or thing in seen:
                    continue
                seen.add(thing)
                for one in dataclasses.fields(thing):
                    if isinstance(meaning := one.metadata.get("spec"), Spec):
                        default = None if one.default is dataclasses.MISSING else one.default
                        yield f"{thing.__name__}.{one.name}", meaning, default


@pytest.fixture(scope="module")
def catalogue() -> list[tuple[str, Spec, Any]]:
    assert seatrial.__path__
    return list(numbers())


LEAST = {
    "rho": 500.0, "rho_air": 0.5, "C_b": 0.1, "C_Dt": 0.1, "U_end": 0.1, "U_free": 0.1, "wanting": 1.0, "answer": 1.0,
    "tau_wind": 1.0, "tau_shaft": 0.5,
}  # fmt: skip
"""Numbers that cannot be near zero: water and air have a density, a ship fullness, a tug a speed, a lag a time."""
MOST = {"delta_0": (0.2, 3.2), "delta_max": (math.pi, 3.2), "pulls": (1.5,), "drift_along": (0.1,),
        "drift_across": (0.1,)}  # fmt: skip
"""Numbers with an upper limit below one or no round one."""


def is_round(limit: float) -> bool:
    """1, 2 or 5 times a power of ten, a quarter of a turn or a multiple, zero or infinite."""
    if limit == 0.0 or math.isinf(limit) or math.isclose(abs(limit) % (TURN / 4.0), 0.0, abs_tol=1e-12):
        return True
    digits = abs(limit) / 10.0 ** math.floor(math.log10(abs(limit)) + 1e-9)
    return any(math.isclose(digits, one, rel_tol=1e-9) for one in (1.0, 2.0, 5.0))


def test_limits_are_round_and_keep_no_number_from_being_small(catalogue: list[tuple[str, Spec, Any]]) -> None:
    assert len(catalogue) > 800
    for name, meaning, default in catalogue:
        short = name.partition(".")[2]
        assert meaning.low < meaning.high, name
        assert is_round(meaning.low), f"{name} from {meaning.low}"
        assert is_round(meaning.high) or meaning.high in MOST[short], f"{name} to {meaning.high}"
        assert meaning.low <= 1e-3 or meaning.low == LEAST[short], f"{name} from {meaning.low}"
        assert meaning.high == 0.0 or meaning.high >= 1.0 or meaning.high in MOST[short], f"{name} to {meaning.high}"
        if isinstance(default, float):
            assert meaning.low <= default <= meaning.high or math.isinf(default), name
        if meaning.unit == "rad":
            assert meaning.high <= TURN or math.isinf(meaning.high), name  # degrees are refused
        if meaning.unit == "kg/m^3":
            assert meaning.high == 4.0 * meaning.low, name


ASSUMED = {
    "Azimuth.n_max": 1e6, "Fixed.low": -1.0, "PushTug.U_end": 3.6, "LineTug.U_free": 6.4, "QuayTunnel.l_q": 10.0,
    "Acceleration.fraction": 0.9, "Crabbing.drive": 0.6, "Crabbing.K_p": 3.0, "Stopping.end": 0.2,
    "CrashAstern.end": 0.01, "TugBerthing.closing": 0.2, "TugBerthing.touching": 0.04, "TugBerthing.wanting": 200.0,
    "TugBerthing.answer": 100.0, "Hybrid.tau_wind": 60.0, "Hybrid.tau_shaft": 8.0, "Tanker.z_uv": 0.8,
    "Recovery.short": math.radians(20.0), "Scharnow.short": math.radians(20.0), "Williamson.short": math.radians(20.0),
    "SingleTurn.swing": math.radians(250.0), "Spiral.step": math.radians(5.0), "Spiral.near": math.radians(5.0),
    "Spiral.fine": math.radians(1.0),
}  # fmt: skip
"""What is assumed where nothing is given and that is neither nothing, nor no limit, nor a factor of one."""
FACTORS = {"astern", "f_per_n", "c_bank", "c_passing", "n_0", "to_port", "high", "M", "side", "k_P", "n_1"}


def test_what_a_file_leaves_out_has_no_force(catalogue: list[tuple[str, Spec, Any]]) -> None:
    """A default is zero, no limit, a factor of one, or listed; the drift of waves has published coefficients."""
    for name, meaning, default in catalogue:
        short = name.partition(".")[2]
        if default is None or name in ASSUMED or name.startswith("MeanDrift."):
            assert default is None or name not in ASSUMED or default == pytest.approx(ASSUMED[name]), name
        elif short in FACTORS:
            assert default in (1.0, math.inf), name
        else:
            assert default == 0.0 or math.isinf(default), f"{name} is {default} {meaning.unit} by default"


def test_open_water_is_calm_and_deep() -> None:
    """The environment and the flow have no wind, current, waves, banks or other ship but those that are given."""
    assert set(CALM) == set(Charted()) == set(Flow._field_defaults.values()) == {0.0}
    assert (Environment._fields, PLACE) == (Charted._fields[:8], Charted._fields[8:])
    assert set(Uniform().now()) == {0.0}
    assert Uniform().depth == math.inf
