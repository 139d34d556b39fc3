"""Test of a ship's equations: exported as one readable file of the standard library, they give the same motion.

Sawada 2024 sections 6.1 item 4 and 6.2, non-functional requirements: simple enough to be interpreted without
ambiguity, and described by equations.
"""

from __future__ import annotations

import random
from typing import Any

from ..core.errors import ShipError
from ..core.parameters import values
from ..environment import CHANNELS, Environment
from ..ships import Ship
from ..validate.requirements import Finding, Judgement, judged
from ..validate.requirements import thresholds as limit
from .python_source import module_text
from .traced import equations_of

# Random points at which the printed equations are held against the model: a wrong term cannot vanish at all.
_POINTS = 50


def equations(ship: Ship) -> Judgement:
    """Whether the exported equations of a ship stand alone and give its rates."""
    paths = values(ship.model)
    sourced = sum(path in ship.entries for path in paths)
    try:
        text = module_text(equations_of(ship))
    except ShipError as error:
        return Judgement("not judged", f"the model has no right-hand side to be written out: {error}")
    module: dict[str, Any] = {}
    exec(compile(text, "plant.py", "exec"), module)  # our own text, as `seatrial export --python` writes it
    rng, apart = random.Random(1), 0.0
    model, beyond = ship.model, len(ship.model.states) - 6
    for _ in range(_POINTS):
        U = ship.speed
        state = (0.0, 0.0, rng.uniform(-3, 3), U * rng.uniform(0.5, 1.0), 0.2 * U * rng.uniform(-1, 1),
                 0.3 * U / ship.L_pp * rng.uniform(-1, 1), *([0.0] * beyond))  # fmt: skip
        control = tuple(rng.uniform(0.0, 0.5) for _ in model.controls)
        around = tuple(rng.uniform(-1, 1) * (k < 4) for k in range(len(CHANNELS)))
        ours = [float(x) for x in model.derivative(state, control, Environment(*around))]
        theirs = [float(x) for x in module["rates"](state, control, around)]
        size = max(map(abs, ours)) or 1.0
        apart = max(apart, max(abs(a - b) for a, b in zip(ours, theirs, strict=True)) / size)
    found = [
        Finding("rates by the exported equations, from the model's", apart, "of the greatest", limit.SAME_EQUATIONS,
                "the exported equations do not give the motion of the model"),
        Finding("lines of the exported file", float(text.count("\n")), "-", limit.READABLE,
                "the equations are too long to be read"),
        Finding("parameters", float(len(paths)), "-"), Finding("of them with a source", float(sourced), "-"),
    ]  # fmt: skip
    return judged(
        f"written out as one file of {text.count(chr(10))} lines (seatrial export --python), its equations give the "
        f"same rates; {sourced} of {len(paths)} numbers are given with their source (seatrial show SHIP --sources), "
        "the rest are constants of a published formula or leave a term out", found,
    )  # fmt: skip
