"""Every force module is right by dimensions: lengths by a ratio and times by its root give forces by its cube.

Density and gravity stay, as by Froude's law; each number of a module goes by its declared unit, so a wrong unit, a
length to a wrong power, or a product for a quotient shows in any form of any module.
"""

from __future__ import annotations

import re

import numpy as np
import pytest

from seatrial.core.parameters import update, walk
from seatrial.testing.discovery import Part, force_modules
from seatrial.testing.forces import samples

MODULES = force_modules()
RATIO = 2.3
POWERS = {"m": 1.0, "s": 0.5, "kg": 3.0, "N": 3.0, "rad": 0.0}
FLOW = (0.5, 0.5, -0.5, -0.5, 0.0, 0.5, 0.5, 1.0, 1.0, 0.5, 0.0, 0.0, 0.0, -1.0, -1.0, 1.0, 1.0, 0.5, 1.0, 2.0)
"""Powers of the ratio by which the inputs of `Part.outputs` go, in the order of the flow."""
OWN = {"n": -0.5, "alpha": 0.0, "delta": 0.0, "N": 4.0}
"""Those of the controls of a thruster by prefix; any other is a force."""
ABSOLUTE = ("barrass2004", "DredgedAnchor")
"""A formula of knots to the power 2.08; a drag that fades out below 5 cm/s."""


def power(unit: str) -> float:
    """Of the ratio by which a number of this unit goes."""
    total = 0.0
    for k, side in enumerate(unit.replace("'", "").split("/")):
        for name, exponent in re.findall(r"([A-Za-z]+)(?:\^(\d+))?", side):
            total += (-1.0 if k else 1.0) * POWERS[name] * float(exponent or 1)
    return total


def scaled(part: Part) -> Part:
    numbers = {path: value * RATIO ** power(meaning.unit) for path, meaning, value in walk(part.module)}
    module = update(part.module, numbers)
    return part._replace(module=module, L_pp=part.L_pp * RATIO, d=part.d * RATIO, U=part.U * RATIO**0.5,
                         n=part.n / RATIO**0.5)  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in MODULES if not any(one in name for one in ABSOLUTE)])
def test_forces_go_with_the_cube_of_the_scale(name: str) -> None:
    part = MODULES[name]
    other, rows = scaled(part), samples(part)[:60]
    by = RATIO ** np.array([*FLOW, *(OWN.get(prefix, 3.0) for prefix in part.prefixes)])
    for x in rows:
        here, there = part.outputs(tuple(x))[:3], other.outputs(tuple(x * by))[:3]
        size = max(map(abs, here[:2])) * RATIO**3
        assert there[:2] == pytest.approx(np.array(here[:2]) * RATIO**3, rel=1e-6, abs=1e-6 * size + 1e-9)
        assert there[2] == pytest.approx(here[2] * RATIO**4, rel=1e-6, abs=1e-6 * size * part.L_pp * RATIO + 1e-9)
