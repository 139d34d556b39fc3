"""Bounds of numbers keep out what is absurd, by round figures; defaults leave a term out, or are published.

A bound is 1, 2 or 5 times a power of ten, or a half, a whole or two half turns; the lower one is nothing, minus the
upper one, or small.  What is bounded otherwise by physics is listed by quantity.  A number that is left out is 0 (no
such term), 1 (a factor) or without limit, but for those of the published forms and the settings listed here.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Iterator
from dataclasses import MISSING, fields, is_dataclass
from importlib import import_module
from pkgutil import iter_modules
from typing import Any

import pytest

from seatrial import actuators, forces, manoeuvres, models

OWN = {
    # densities of water and air
    "rho": (500.0, 2000.0), "rho_air": (0.5, 2.0),
    # shares of thrust and of speed; a screw can gain a little of either
    "t": (-0.5, 1.0), "t_P": (-0.5, 1.0), "w_P": (-0.5, 1.0), "w_P0": (-0.5, 1.0), "a_H": (-1.0, 5.0),
    # a ship can be unstable upright, up to ten metres
    "GM": (-10.0, 100.0),
    # what slows only, as it is defined below zero
    "X_0": (-1.0, 0.0), "X_uu": (-1.0, 0.0), "C_w": (-100.0, 0.0), "C_10": (-10.0, 0.0), "J_syn": (-10.0, 0.0),
    "J_syn0": (-10.0, 0.0),
    # shapes and coefficients that cannot be near zero
    "C_b": (0.1, 1.0), "C_Dt": (0.1, 2.0),
    # of a thruster of commands and of tugs
    "low": (-1.0, 0.0), "pulls": (0.0, 1.5), "U_end": (0.1, 20.0), "U_free": (0.1, 20.0),
    # times and measures of a hybrid, gains of a berthing by tugs
    "tau_wind": (1.0, 1e5), "tau_shaft": (0.5, 1e3), "delta_0": (1e-6, 3.2), "delta_max": (1e-6, 3.2),
    "wanting": (1.0, 1e4), "answer": (1.0, 1e4),
}  # fmt: skip

ORDERED = {
    # the cubics of a public code, attributed to Daidola et al. 1986; see the module
    "MeanDrift": {"X_0": 0.05, "X_1": -0.2, "X_2": 0.75, "X_3": -0.51, "Y_0": 0.46, "Y_1": 6.83, "Y_2": -15.65,
                  "Y_3": 8.44, "N_0": -0.11, "N_1": 0.68, "N_2": -0.79, "N_3": 0.21},
    "PushTug": {"U_end": 3.6}, "LineTug": {"U_free": 6.4}, "QuayTunnel": {"l_q": 10.0}, "Fixed": {"low": -1.0},
    "Azimuth": {"n_max": 1e6}, "Hybrid": {"tau_wind": 60.0, "tau_shaft": 8.0}, "Tanker": {"z_uv": 0.8},
    "Acceleration": {"fraction": 0.9}, "Crabbing": {"drive": 0.6, "K_p": 3.0},
    "Recovery": {"short": math.radians(20)}, "Williamson": {"short": math.radians(20)},
    "Scharnow": {"short": math.radians(20)}, "SingleTurn": {"swing": math.radians(250)},
    "Spiral": {"step": math.radians(5), "near": math.radians(5), "fine": math.radians(1)},
    "Stopping": {"end": 0.2}, "CrashAstern": {"end": 0.01},
    "TugBerthing": {"closing": 0.2, "touching": 0.04, "wanting": 200.0, "answer": 100.0},
}  # fmt: skip


def numbers() -> Iterator[tuple[type, Any, Any]]:
    """Every number of forces, models, manoeuvres and actuators: its class, its field and its meaning."""
    modules = [actuators]
    for room in (forces, models, manoeuvres):
        modules += [import_module(f"{room.__name__}.{one.name}") for one in iter_modules(room.__path__)]
    for module in modules:
        for cls in vars(module).values():
            if inspect.isclass(cls) and is_dataclass(cls) and cls.__module__ == module.__name__:
                for f in fields(cls):
                    meaning = next((one for one in f.metadata.values() if hasattr(one, "low")), None)
                    if meaning is not None:
                        yield cls, f, meaning


NUMBERS = list(numbers())


def is_round(value: float) -> bool:
    if value == 0.0 or math.isinf(value):
        return True
    turns = abs(value) / (0.5 * math.pi)
    leading = abs(value) / 10.0 ** math.floor(math.log10(abs(value)) + 1e-12)
    return min(abs(turns - k) for k in (1, 2, 4)) < 1e-9 or min(abs(leading - k) for k in (1, 2, 5)) < 1e-9


def usual(low: float, high: float) -> bool:
    below = low in (0.0, -math.inf, -high) or (0.0 < low <= 0.01 and is_round(low))
    return below and is_round(high)


def test_bounds_are_round_or_those_of_the_quantity() -> None:
    assert len(NUMBERS) > 800
    odd = [f"{cls.__name__}.{f.name}: {meaning.low} to {meaning.high}" for cls, f, meaning in NUMBERS
           if not usual(meaning.low, meaning.high) and OWN.get(f.name) != (meaning.low, meaning.high)]  # fmt: skip
    assert not odd


def test_what_is_left_out_is_no_term_a_factor_of_one_or_published() -> None:
    given = [(cls, f) for cls, f, _ in NUMBERS if f.default is not MISSING]
    assert len(given) > 250
    plain = (0.0, 1.0, math.inf, -math.inf)
    listed = {(name, key): value for name, own in ORDERED.items() for key, value in own.items()}
    odd = [f"{cls.__name__}.{f.name} = {f.default}" for cls, f in given if f.default not in plain
           and f.default != pytest.approx(listed.get((cls.__name__, f.name), math.nan), rel=1e-12)]  # fmt: skip
    assert not odd


def test_a_default_lies_within_its_bounds() -> None:
    for cls, f, meaning in NUMBERS:
        if f.default is not MISSING and math.isfinite(f.default):
            assert meaning.low <= f.default <= meaning.high, (cls, f.name)
