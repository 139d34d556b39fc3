"""Every force module of the library, in each of its published forms, keeps the contract of `seatrial.forces`."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from discovery import BIASES, PAIRS, SHIPS, Part, choices, classes_of, compiled, components, even, force_modules

import seatrial.forces
from seatrial.core.parameters import walk

MODULES = force_modules()
every_module = pytest.mark.parametrize("name", list(MODULES))


def grid(part: Part) -> list[Any]:
    """At rest, ahead, astern, sideways; stopped, ahead and reversed; in weather; afloat, touching ground and beyond."""
    own = len(part.prefixes)
    moves = itertools.product(
        (0.0, 0.4, -0.4), (0.0, 0.2, -0.2), (0.0, 0.3, -0.3), (0.0, 1.0, -1.0), (0.0, 0.5, 1.2),
        ((0, 0), (-1, 0.5)), ((0, 0, 0), (0.8, 0.2, 0.9), (-0.8, 0.2, 0)), (0.0, 0.8, 1.25, 1.4),
    )  # fmt: skip
    rows = [(u, v, r, n, d, *wind, *waves, h, *([n, d, 0.4][:own])) for u, v, r, n, d, wind, waves, h in moves]
    tiny = [(1e-9, 0, 0, 0, 0.3), (0, 1e-7, 1e-9, 1e-6, -0.3, 1e-8), (0.3, 0, 0, 0, math.pi / 1.4), (0, -1e-12)]
    rows += [(*row, *([0.0] * (11 + own - len(row)))) for row in tiny]
    return np.array(rows, dtype=float) * part.size


def samples(part: Part) -> Any:
    return np.random.default_rng(7).uniform(-1, 1, (150, len(part.size))) * part.size


def test_every_force_class_and_every_published_form_is_tried() -> None:
    """A new class, or a new option of a choice, needs a ship of the library or a line in examples.py."""
    flown = {type(part.module) for part in MODULES.values()}
    flown |= {type(component) for ship in SHIPS.values() for _, component in components(ship.model)}
    assert not [cls.__qualname__ for cls in classes_of(seatrial.forces) if cls not in flown]
    tried = {(type(p.module), field, getattr(p.module, field)) for p in MODULES.values() for field in choices(p.module)}
    wanted = {(cls, field, option) for cls, field, _ in tried
              for m in MODULES.values() if type(m.module) is cls for option in choices(m.module)[field]}  # fmt: skip
    assert wanted == tried


@pytest.mark.parametrize("ship", list(SHIPS))
def test_numbers_are_declared_and_within_what_physics_allows(ship: str) -> None:
    for path, meaning, value in walk(SHIPS[ship].model):
        assert meaning.about, path
        assert meaning.low <= value <= meaning.high, path


@every_module
def test_numbers_of_a_module_are_declared(name: str) -> None:
    for path, meaning, value in walk(MODULES[name].module):
        assert meaning.about, path
        assert meaning.low <= value <= meaning.high, path


@every_module
def test_silent_at_rest(name: str) -> None:
    """In still air and water with stopped propellers, whatever the rudder, the azimuth and the depth."""
    part = MODULES[name]
    for angle, depth in ((0.0, 0.0), (0.4, 0.6), (-1.0, 1.2)):
        x = [0.0] * 4 + [angle] + [0.0] * 4 + [3.0, depth]
        x += [angle if prefix == "alpha" else 0.0 for prefix in part.prefixes]
        assert all(abs(y) == 0 for y in part.outputs(tuple(x))[:3])


def reflected(part: Part, x: Any) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
    """Outputs, and those of the mirror image (part and input) seen in the mirror."""
    module = part.module
    if hasattr(module, "y"):
        module = replace(module, y=-module.y)
    there = part._replace(module=module).outputs(tuple(map(float, x * part.mirror)))
    return part.outputs(tuple(map(float, x))), (there[0], -there[1], -there[2], *there[3:])


@every_module
def test_mirrored(name: str) -> None:
    """Port is the mirror image of starboard; what says that it is not, is not, and would be without its side terms."""
    part = MODULES[name]
    if not part.module.mirror_symmetric:
        pairs = [reflected(part, x) for x in samples(part)]
        assert any(here != pytest.approx(there, rel=1e-6) for here, there in pairs)
        assert any(hasattr(part.module, a) for a, _ in PAIRS) or type(part.module).__name__ in BIASES
    part = part._replace(module=even(part.module))
    for x in samples(part):
        here, there = reflected(part, x)
        assert there == pytest.approx(here, rel=1e-12, abs=1e-12 * max(map(abs, here)))


@every_module
def test_finite_with_finite_jacobians(name: str) -> None:
    part = MODULES[name]
    x = grid(part)
    f, j = compiled(part.outputs, len(part.size))
    assert np.isfinite(f(x.T).full()).all()
    assert np.isfinite(j(x.T).full()).all()


@every_module
def test_floats_equal_symbols(name: str) -> None:
    """To 1e-12 of the largest entry of the outputs."""
    part = MODULES[name]
    x = np.vstack([samples(part), grid(part)[::17]])
    symbols = compiled(part.outputs, len(part.size))[0](x.T).full().T
    direct = np.array([part.outputs(tuple(row)) for row in x.tolist()], dtype=float)
    scale = np.abs(direct).max(axis=1, keepdims=True)
    assert (np.abs(symbols - direct) <= 1e-12 * scale + 1e-300).all()
