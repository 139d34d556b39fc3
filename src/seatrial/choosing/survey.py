"""The families of ship models beside what the library's ships show of them: findings, inputs, outputs, counts, cost."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from fnmatch import fnmatchcase
from typing import Any

import numpy as np

from ..actuators import Actuators
from ..core.parameters import Terms, walk
from ..core.values import MISSING, dataclass, fields, is_dataclass, replace
from ..environment import CALM
from ..identify.design.excitation import TABLE_1, Published
from ..models import Sampled
from ..models.arx import Arx, lag_of
from ..models.linear import straight
from ..models.nomoto import Nomoto
from ..models.settled import begun
from ..ships import Ship
from ..ships.classes import find_class
from ..ships.files import library, load
from ..simulate.lanes import Kernel, Lanes, Steps, run
from ..simulate.loop import open_loop, open_loop_parameters
from . import ANSWERS, CAPABILITIES, Family, Finding, table
from .probing import Probe, findings, outputs


def _cubic(ship: Ship) -> bool:
    return not isinstance(ship.model, Nomoto) or bool(ship.model.alpha)


def _low_speed(ship: Ship) -> bool:
    """A hull of cross-flow drag: forces without a division by the speed."""
    return type(ship.model.part("hull")).__name__ == "CrossFlow"


def _equations(ship: Ship) -> int:
    model: Any = ship.model
    return len({lag_of(name).output for name in model.coefficients.names})


def vector_arx() -> Ship:
    """The Mariner about its straight run, as a map over a second: a vector ARX model without any fit."""
    base = load("mariner")
    line = straight(base.model, base.speed)
    dt, kept = 1.0, [line.states.index(n) for n in ("u", "v_m", "r")]
    A = np.eye(3) + dt * line.A[np.ix_(kept, kept)]
    b = dt * line.input("delta")[kept]
    at, delta = np.array(line.at.state[3:6]), line.at.orders["delta"]
    rest = at - A @ at - b * delta
    numbers: dict[str, float] = {}
    for i, output in enumerate(("u", "v_m", "r")):
        numbers |= {f"{output}_{of}_1": float(A[i, j]) for j, of in enumerate(("u", "v_m", "r"))}
        numbers |= {f"{output}_delta_1": float(b[i]), f"{output}_constant": float(rest[i])}
    model = Arx(dt=dt, coefficients=Terms(tuple(numbers), tuple(numbers.values())))
    return replace(base, name="mariner, linearised", model=model, actuators=Actuators(), entries={})


_BELONGS: Mapping[str, Callable[[Ship], bool]] = {
    "KT": lambda ship: not _cubic(ship), "Norrbin": _cubic, "ARX": lambda ship: _equations(ship) == 1,
    "VARX": lambda ship: _equations(ship) > 1, "MMG": lambda ship: not _low_speed(ship), "lowMMG": _low_speed,
}  # fmt: skip
"""Which ships with a model of the family's classes are of the family, where not all are."""
_SPECIMENS = {"VARX": vector_arx}


def _family(row: dict[str, Any], shared: Mapping[str, Any]) -> Family:
    """A family as a table of families.toml declares it; some statements are `shared` by several."""
    said = (*shared.get(row.pop("like", ""), ()), *row.pop("declared", ()))
    tuples: dict[str, Any] = {name: tuple(row.pop(name))
                              for name in ("classes", "studies", "counted", "next") if name in row}  # fmt: skip
    return Family(
        **row, **tuples, belongs=_BELONGS.get(row["key"], lambda ship: True), specimen=_SPECIMENS.get(row["key"]),
        declared={key: Finding(answer, f"Sawada 2024 {section}: {text}") for key, answer, section, text in said},
    )


_FOUND = table("families.toml")
FAMILIES = tuple(_family(row, _FOUND["statements"]) for row in _FOUND["family"])
"""All families, from the simplest to the most physical, as families.toml declares them."""

_LANES, _STEPS, _REPEATS = 128, 300, 5
_CHANNELS = ("wind", "current", "waves", "shallow")


@dataclass(frozen=True)
class Assessment:
    """A family as it stands in this library.

    Attributes:
        ships: names of the library's ships of this family.
        example: the one of them, or the specimen, that shows most; the cost is that of it.
        controls: controls of those ships, each name once.
        environment: what of wind, current, waves, shallow water reaches the motion of one of them.
        outputs: velocities that it moves, and states of its own.
        coefficients: how many numbers each ship gives it, fewest and most; None where it is only planned.
        studies: rows of Sawada's Table 1.
        findings: the answer to each capability.
        by_ship: what each ship shows by itself, before a declaration lowers it.
        cost: time of one right-hand side (one sample of a sampled model) in one of 128 lanes [ns].
    """

    family: Family
    ships: tuple[str, ...]
    example: str
    controls: tuple[str, ...]
    environment: tuple[str, ...]
    outputs: tuple[str, ...]
    coefficients: tuple[int, int] | None
    studies: tuple[Published, ...]
    findings: Mapping[str, Finding]
    by_ship: Mapping[str, Mapping[str, Finding]]
    cost: float | None = None

    @property
    def length(self) -> tuple[float, float] | None:
        """Shortest and longest training data that identified it, T' = T V/L (Sawada 2024 Table 1)."""
        ends = [end for study in self.studies for end in study.length]
        return (min(ends), max(ends)) if ends else None

    def answer(self, keys: Sequence[str]) -> str:
        """The worst answer among capabilities."""
        return max((self.findings[key].answer for key in keys), key=ANSWERS.index, default="yes")


def survey(*, costs: bool = True) -> tuple[Assessment, ...]:
    """Every family, probed on every ship of the library that belongs to it.

    Args:
        costs: whether to measure the cost; kernels are compiled once and kept.
    """
    known = [load(name) for name in library()]
    return tuple(assess(family, known, costs=costs) for family in FAMILIES)


def assess(family: Family, known: Sequence[Ship], *, costs: bool = True) -> Assessment:
    """One family beside the ships of `known` that belong to it, or its specimen."""
    classes = tuple(find_class(name, "models", family.name) for name in family.classes)
    own = [ship for ship in known if isinstance(ship.model, classes) and family.belongs(ship)] if classes else []
    flown = [Probe.of(ship) for ship in own or ([family.specimen()] if family.specimen else [])]
    measured = [findings(probe) for probe in flown]
    found = {c.key: _judged(family, c.key, [m[c.key] for m in measured if c.key in m]) for c in CAPABILITIES}
    shown = [sum(one.answer == "yes" for one in each.values()) for each in measured]
    example = flown[shown.index(max(shown))] if flown else None
    counts = [count(probe.ship, family.counted) for probe in flown]
    return Assessment(
        family=family,
        ships=tuple(ship.name for ship in own),
        example=example.ship.name if example else "",
        controls=tuple(dict.fromkeys(name for probe in flown for name in probe.ship.model.controls)),
        environment=tuple(key for key in _CHANNELS if found[key].answer in ("yes", "part")),
        outputs=tuple(dict.fromkeys(name for probe in flown for name in outputs(probe))),
        coefficients=(min(counts), max(counts)) if counts else None,
        studies=tuple(row for row in TABLE_1 if row.reference in family.studies),
        findings=found,
        by_ship={probe.ship.name: each for probe, each in zip(flown, measured, strict=True)},
        cost=nanoseconds(example) if costs and example else None,
    )


def _judged(family: Family, key: str, measured: Sequence[Finding]) -> Finding:
    """The best that a ship shows, lowered by what is declared."""
    best = min(measured, key=lambda f: ANSWERS.index(f.answer), default=None)
    said = family.declared.get(key)
    if best is None or said is None:
        return best or said or Finding("no", "neither measured nor declared")
    return said if ANSWERS.index(said.answer) > ANSWERS.index(best.answer) else best


def count(ship: Ship, patterns: Sequence[str]) -> int:
    """Numbers of the model at paths that fit the patterns and are not left at their default; weights of a network."""
    usual, network = _defaults(ship.model), ship.model.learned
    if network is not None:
        return network.count
    return sum(
        any(fnmatchcase(path, pattern) for pattern in patterns) and float(value) != usual.get(path)
        for path, _, value in walk(ship.model)
    )


def _defaults(model: Any, prefix: str = "") -> dict[str, float]:
    out: dict[str, float] = {}
    for f in fields(model):
        value = getattr(model, f.name)
        if "spec" in f.metadata and f.default is not MISSING:
            out[prefix + f.name] = float(f.default)
        elif is_dataclass(value) and "spec" not in f.metadata and not {"terms", "parts"} & set(f.metadata):
            out |= _defaults(value, f"{prefix}{f.name}.")
    return out


def nanoseconds(probe: Probe) -> float:
    """Shortest time of a step of Euler's method over 128 lanes on one thread, per lane and step [ns]."""
    ship, kernel = probe.ship, Kernel(open_loop(probe.ship))
    system = kernel.system
    model: Any = ship.model
    dt = float(model.dt) if isinstance(model, Sampled) else 0.01 * ship.L_pp / ship.speed
    control, state = probe.control(1.0, 0.1), probe.state(1.0, 0.0, 0.0)
    state = begun(ship.model, state, control, CALM)
    memory = model.begin(state, control) if isinstance(model, Sampled) else ()
    memory = memory[: len(system.memory) + len(system.hidden)]
    z, m = np.tile(np.array(state), (_LANES, 1)), np.tile(np.array(memory, dtype=float), (_LANES, 1))
    series = kernel.pack(np.tile(np.array([*control, *CALM], dtype=float), (_LANES, 1, 1)))
    lanes, best = Lanes(kernel, open_loop_parameters(ship), z, series, m), float("inf")
    steps = _STEPS // 30 if kernel.forward.virtual else _STEPS
    for _ in range(_REPEATS):
        start = time.perf_counter()
        run(lanes, Steps(dt, steps, steps - 1, "euler"), threads=1)
        best = min(best, time.perf_counter() - start)
    return 1e9 * best / (_LANES * (steps - 1))
