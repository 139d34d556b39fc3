"""A complete MMG ship from its particulars: one formula a number, the others as its uncertainty.

`estimate` reads a file of particulars and returns an `Estimate`; docs/tutorials/estimate.md has the
keys of the file, and which formula was chosen and why.  The rule for sigma: the larger of the
standard deviation between formulas that give different values, and the scatter of the chosen one about four
published sets (`SCATTER`); where neither exists, a share of the value that is assumed (`STATED`);
and with it what the assumed particulars add, each moved by its own sigma.  Revolutions that are given hold the speed:
what is least certain moves (`agreement`).
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from ..actuators import Actuator, Actuators
from ..core.constants import KNOT
from ..core.parameters import PRIME, Spec, unknown
from ..core.values import dataclass, field, fields, replace
from ..environment import CALM
from ..forces.body import Body
from ..forces.hull import Polynomial
from ..forces.propeller import Standard as Propeller
from ..forces.rudder import Standard as Rudder
from ..forces.shallow import ShallowPolynomial
from ..forces.wind import Fujiwara
from ..models.mmg import Mmg
from ..models.twin import TwinMmg
from . import Entry, Ship, ShipError
from .agreement import Agreement, agree, refuse, revolutions
from .formulas import Formula, Particulars, added_mass, hull, propeller, resistance, rudder, table, wind
from .formulas.reading import SHARES, Known, as_table, read_particulars
from .formulas.stability import metacentric_height
from .numbers import Yardsticks, number, resolve
from .rolled import Stability, with_roll

FORMULAS: tuple[Formula, ...] = (
    *added_mass.FORMULAS, *resistance.FORMULAS, *hull.FORMULAS, *propeller.FORMULAS, *rudder.FORMULAS, *wind.FORMULAS,
)  # fmt: skip
"""For every number the first that gives it is used; the others make its spread."""

SCATTER = {row["number"]: float(row["rms"]) for row in table("scatter")}
"""Differences of the first formula of each number from the published sets of KVLCC2, KCS, Esso Osaka and SUZAKU.

Root mean square of those that have the number in the same term, both sides of gamma_R and C_2 together, in the units of
the formulas, of R_0 as a share of the value (`SHARED`); tests/ships/test_estimate.py computes them anew.  R_0 is
compared at the scale where it was measured.  f_alpha is left out: the published ones are Fujii's formula.
"""
SHARED = ("hull.R_0",)
"""Numbers whose scatter is a share, as they differ by more between a model and its ship than between two formulas."""

STATED: Mapping[str, tuple[float, str]] = {
    "body.I_zG": (0.16, "radius of gyration 0.23 to 0.27 L_pp"),
    "propeller.C_1": (0.3, "no published scatter"),
    "rudder.f_alpha": (0.1, "no published scatter"),
    "rudder.eta": (0.1, "no published scatter"),
    "rudder.x_R": (0.03, "rudder stock within 0.015 L_pp of the perpendicular"),
    "wind.": (0.2, "no published scatter"),
}
"""Relative sigma of numbers without a second formula and without scatter, by path or its beginning: judgements."""

PARTS: Mapping[str, type] = {
    "body": Body, "hull": Polynomial, "propeller": Propeller, "rudder": Rudder, "wind": Fujiwara,
}  # fmt: skip
COPIED = {
    "hull.B": "B", "hull.C_b": "C_b", "body.rho": "rho", "body.L_pp": "L_pp", "body.B": "B", "body.d": "d",
    "body.x_G": "x_G", "propeller.D_P": "D_P", "rudder.A_R": "A_R",
}  # fmt: skip
"""Numbers of the model that stand among the particulars."""

_PLANING = 0.45
"""Froude number above which hulls begin to be carried by dynamic lift."""

_BEYOND = "the craft begins to plane, which no formula here knows; see 'Small craft' in docs/tutorials/estimate.md"
_SHALLOW = (
    "shallow water: factors on the hull and its added mass alone, from codes; two forms of them differ by half in a "
    "turn at h/d 1.2 (hull.form), and wake, thrust deduction and rudder stay those of deep water"
)
_TWO_SCREWS = (
    "two screws: no published regression covers the interaction of two rudders with the hull, so the numbers of a "
    "single one stand for it; brackets and bossings add to the resistance: give R_0"
)
MADE = "estimate"
"""Note of a ship file that says what it was estimated from; a fit adds its provenance to it."""
FIRST_LOOK = "estimated numbers: good for a first look and as the prior of a fit, not as a model of this ship"
"""Caution of every estimated ship, until a fit."""
_INERTIA = "assumed: m (0.25 L_pp)^2"
_FELT = ("pitch_ratio", "D_P", "speed")
"""Assumed particulars that thrust and resistance hang on."""
_PULL, _PULLS = "propeller.k_0", ("propeller.k_0", "propeller.k_1", "propeller.k_2")
_TOLD = 0.05
"""Sigmas by which a number moves before a caution tells it."""
_EXACT = 0.1
"""Thrust over resistance, less one, that numbers which are all given may leave."""


@dataclass(frozen=True)
class Number:
    """One number of the ship and where it comes from.

    Attributes:
        path: dotted path in the model.
        value: as the ship file gives it, in `unit`; primed where that is an apostrophe.
        formula: name of the formula, "given" or "assumed".
        outside: the ratios of the ship that leave its range, in words; empty where the range holds.
        basis: where the range comes from; empty for a number that no formula gave.
        others: value of every other formula for the same number, by name.
        spread: standard deviation between the formulas; None where only one gives the number.
        sigma: value of the ship file, in `unit`.
        sigma_from: what sigma rests on, in words; empty without sigma.
    """

    path: str
    value: float
    unit: str
    formula: str
    outside: tuple[str, ...] = ()
    basis: str = ""
    others: Mapping[str, float] = field(default_factory=dict[str, float])
    spread: float | None = None
    sigma: float | None = None
    sigma_from: str = ""

    @property
    def share(self) -> float | None:
        """Sigma as a share of the value; None without one."""
        return None if self.sigma is None or not self.value else self.sigma / abs(self.value)


@dataclass(frozen=True)
class Estimate:
    """A ship made from its particulars.

    Attributes:
        ship: the ship, every number with its source.
        numbers: each estimated, assumed or given number, in the order of the ship file.
        cautions: what to know before trusting it, in lines.
        particulars: what was known or assumed of it.
    """

    ship: Ship
    numbers: tuple[Number, ...]
    cautions: tuple[str, ...]
    particulars: Particulars


def estimate(path: str | Path, *, shallow: bool = False, GM: float | None = None) -> Estimate:
    """The ship that a file of particulars describes.

    Args:
        shallow: whether the hull feels the depth of the water, by the factors of `forces.shallow`.
        GM: metacentric height [m] of a ship that heels; its centre of gravity is where breadth, draught and C_b put
            the metacentre, less GM.

    Raises:
        ShipError: a file that cannot be used, a formula that gives an impossible number, or a height that no ship has.
    """
    made = _Work(Path(path), read_particulars(path), shallow).run()
    if GM is None:
        return made
    B, d, C_b = (getattr(made.particulars, name) for name in ("B", "d", "C_b"))
    KG = metacentric_height(B, d, C_b, GM)
    ship = with_roll(made.ship, Stability(GM=GM, KG=KG, C_m=made.particulars.C_m))
    return replace(made, ship=ship, cautions=tuple(ship.notes["cautions"]))


@dataclass
class _Work:
    """One estimate in the making.

    Attributes:
        shallow: whether the hull feels the depth.
        agreed: what moved so that given revolutions hold the speed.
        uncertain: sigma of what may move, before.
        added: standard deviation of each number by the assumed particulars, in the units of the formulas.
        pull: the propeller's thrust at bollard pull, before.
    """

    path: Path
    known: Known
    shallow: bool = False
    numbers: list[Number] = field(default_factory=list[Number])
    values: dict[str, float] = field(default_factory=dict[str, float])
    entries: dict[str, Entry] = field(default_factory=dict[str, Entry])
    agreed: Agreement = field(default_factory=lambda: Agreement({}, {}))
    uncertain: dict[str, float] = field(default_factory=dict[str, float])
    added: dict[str, float] = field(default_factory=dict[str, float])
    pull: float = 1.0

    def run(self) -> Estimate:
        specs = {f"{part}.{f.name}": f.metadata["spec"]
                 for part, cls in self.parts.items() for f in fields(cls) if "spec" in f.metadata}  # fmt: skip
        self.refuse_unknown(specs)
        self.take(specs)
        if "n_P" in self.known.values:
            self.settle(specs)
        model, cautions = self.model(self.values), tuple(self.cautions())
        return Estimate(self.ship(model, cautions), tuple(self.numbers), cautions, self.known.ship)

    @property
    def parts(self) -> dict[str, type]:
        parts = {name: cls for name, cls in PARTS.items() if name != "wind" or self.known.ship.air}
        return {**parts, "hull": ShallowPolynomial} if self.shallow else parts

    def take(self, specs: Mapping[str, Spec]) -> None:
        """Every number from where it is known."""
        self.numbers.clear()
        found, self.added = self.candidates(self.known.ship), self.inherited()
        for path, meaning in specs.items():
            if path in self.known.given:
                self.take_given(path, meaning, found.get(path, []))
            elif path in found:
                self.take_formula(path, meaning, found[path])
            else:
                self.take_particular(path, meaning)

    def settle(self, specs: Mapping[str, Spec]) -> None:
        """Move what is least certain until the given revolutions hold the speed; then take every number anew.

        Raises:
            ShipError: nothing near enough does.
        """
        n_P = self.known.values["n_P"]
        self.uncertain, self.pull = self.sigmas(), self.values[_PULL]
        found = self.nearest(n_P, specs)
        refuse(f"{self.path}: particulars", self.known.ship.speed, n_P,
               revolutions(lambda n: self.surplus({}, n, specs), n_P), found)  # fmt: skip
        self.agreed = found = found or Agreement({}, {})
        ship, values, entries = self.moved(found.moves), dict(self.known.values), dict(self.known.entries)
        for name in (name for name in found.moves if name in SHARES):
            values[name] = float(getattr(ship, name))
            entries[name] = Entry(entries[name].source + _met(found.moves[name]), values[name],
                                  sigma=self.uncertain[name] * found.left[name])  # fmt: skip
        self.known = replace(self.known, ship=ship, values=values, entries=entries)
        self.take(specs)

    def nearest(self, n_P: float, specs: Mapping[str, Spec]) -> Agreement | None:
        """The least moves that make the revolutions hold the speed; where all is given as exact, none."""
        if not self.uncertain:
            return Agreement({}, {}) if abs(self.surplus({}, n_P, specs)) < _EXACT else None
        return agree(lambda z: self.surplus(z, n_P, specs), tuple(self.uncertain))

    def sigmas(self) -> dict[str, float]:
        """Sigma of what thrust and resistance hang on: assumed particulars, and numbers that formulas gave."""
        found = {name: SHARES[name] * self.known.values[name] for name in _FELT if name in self.known.assumed}
        own = {n.path: n for n in self.numbers}
        for path in ("hull.R_0", "propeller.w_P0", "propeller.t_P", _PULL):
            if not {path, *(_PULLS if path == _PULL else ())} & set(self.known.given):
                found[path] = _sigma(path, own[path].value, own[path].spread)[0] or 0.0
        return found

    def moved(self, moves: Mapping[str, float]) -> Particulars:
        """The ship with some assumed particulars, and its wake, moved by so many sigmas."""
        ship, known = self.known.ship, self.known.values
        wake = moves.get("propeller.w_P0", 0.0) * self.uncertain.get("propeller.w_P0", 0.0)
        found = {name: known[name] * (1.0 + z * SHARES[name]) for name, z in moves.items() if name in SHARES}
        return replace(ship, **found, w_P0=ship.w_P0 + wake)

    def surplus(self, moves: Mapping[str, float], n_P: float, specs: Mapping[str, Spec]) -> float:
        """Thrust over resistance, less one, with everything moved by so many sigmas."""
        ship, made = self.moved(moves), dict(self.values)
        for path, found in self.candidates(ship).items():
            if path in specs and path not in self.known.given:
                factor = self.scale.factor(specs[path].unit)
                made[path] = self.met(path, found[0][1], moves) * (factor if factor == factor else 1.0)
        model = self.model(made | {"propeller.D_P": ship.D_P})
        U, body = ship.speed, model.part("body")
        rate = float(model.derivative((0.0, 0.0, 0.0, U, 0.0, 0.0), model.obey({"n_P": n_P}), CALM)[3])
        return rate * float(body.m + body.m_x) / (0.5 * ship.rho * ship.L_pp * ship.d * U * U * made["hull.R_0"])

    def met(self, path: str, value: float, moves: Mapping[str, float]) -> float:
        """A number that was moved by so many sigmas; K_T as a whole by those of its first term."""
        if path in _PULLS and _PULL in moves:
            return value * (1.0 + moves[_PULL] * self.uncertain[_PULL] / self.pull)
        return value + moves[path] * self.uncertain[path] if path in moves else value

    def model(self, values: Mapping[str, float]) -> Any:
        """The ship of its parts: with one screw, or with two that turn opposite ways."""
        made: dict[str, Any] = {part: cls(**_below(values, part)) for part, cls in self.parts.items()}
        if self.known.ship.screws == 1.0:
            return Mmg(**made)
        y_P, y_R = (self.known.values[key] for key in ("y_P", "y_R"))
        self.entries |= {key: self.known.entries[key] for key in ("y_P", "y_R")}
        return TwinMmg(**made, y_P=y_P, y_R=y_R)

    def refuse_unknown(self, specs: Mapping[str, Spec]) -> None:
        free = [path for path in specs if path not in COPIED and path not in ("body.m", "wind.A_T", "wind.A_L")]
        for path in self.known.given:
            if path not in free:
                hint = f"; {COPIED[path]} stands in [particulars]" if path in COPIED else ""
                raise ShipError(f"{self.path}: given: {unknown(path, free, 'number')}{hint}")

    def candidates(self, ship: Particulars) -> dict[str, list[tuple[Formula, float]]]:
        """Every formula's answer by path, the first to be used."""
        found: dict[str, list[tuple[Formula, float]]] = {}
        for formula in FORMULAS:
            for path, value in formula.gives(ship).items():
                found.setdefault(path, []).append((formula, value))
        return found

    def inherited(self) -> dict[str, float]:
        """Standard deviation of each number by the particulars that were assumed, in the units of the formulas."""
        here = {path: found[0][1] for path, found in self.candidates(self.known.ship).items()}
        found = dict.fromkeys(here, 0.0)
        for name in SHARES:
            if name in self.known.assumed:
                left = self.agreed.left.get(name, 1.0)
                for path, others in self.candidates(self.moved({name: left})).items():
                    found[path] = math.hypot(found.get(path, 0.0), others[0][1] - here.get(path, others[0][1]))
        return found

    def take_given(self, path: str, meaning: Spec, found: list[tuple[Formula, float]]) -> None:
        given = as_table(self.known.given[path], meaning.unit, self.path)
        value, entry = number(given, meaning, f"{self.path}: given.{path}", self.scale)
        self.values[path], self.entries[path] = value, entry
        unit = PRIME if entry.prime or meaning.unit == PRIME else entry.unit or meaning.unit
        others = {formula.name: x for formula, x in found}
        basis = "" if entry.sigma is None else "given"
        self.numbers.append(Number(path, entry.given, unit, "given", others=others, sigma=entry.sigma,
                                   sigma_from=basis))  # fmt: skip

    def take_formula(self, path: str, meaning: Spec, found: list[tuple[Formula, float]]) -> None:
        (formula, value), *rest = found
        factor = self.scale.factor(meaning.unit)
        prime = factor == factor
        outside = formula.outside(self.known.ship)
        distinct = list(dict.fromkeys(float(f"{x:.9g}") for _, x in found))
        spread = statistics.stdev(distinct) if len(distinct) > 1 else None
        sigma, basis = _sigma(path, value, spread)
        key = _PULL if path in _PULLS else path
        value, z = self.met(path, value, self.agreed.moves), self.agreed.moves.get(key)
        sigma = None if sigma is None else sigma * self.agreed.left.get(key, 1.0)
        if not meaning.low <= value * (factor if prime else 1.0) <= meaning.high:
            raise ShipError(
                f"{self.path}: {formula.name} gives {path} = {value:.4g}, which is impossible for the {meaning.about}; "
                "the ship is too far from its range: give the number in [given]"
            )
        if added := self.added.get(path, 0.0):
            sigma, basis = math.hypot(sigma or 0.0, added), "; ".join(filter(None, (basis, "assumed particulars")))
        source = self.wording(formula, found) + (f"; sigma: {basis}" if basis else "") + ("" if z is None else _met(z))
        entry = Entry(source=source, given=value, prime=prime,
                      sigma=None if sigma is None else sigma * (factor if prime else 1.0))  # fmt: skip
        self.entries[path], self.values[path] = entry, resolve(entry, meaning.unit, self.scale) or 0.0
        self.numbers.append(Number(
            path, value, PRIME if prime else meaning.unit, formula.name, tuple(outside), formula.basis,
            {other.name: x for other, x in rest}, spread, sigma, basis,
        ))  # fmt: skip

    def wording(self, formula: Formula, found: list[tuple[Formula, float]]) -> str:
        """The source of one number: formula, range, results of the others."""
        text = f"estimated: {formula.source}"
        outside = formula.outside(self.known.ship)
        if outside:
            text += f"; OUTSIDE its range ({'; '.join(outside)})"
        others = ", ".join(f"{other.name} {x:.4g}" for other, x in found[1:])
        return text + (f"; others: {others}" if others else "; no other formula")

    def take_particular(self, path: str, meaning: Spec) -> None:
        ship, key = self.known.ship, COPIED.get(path, path.partition(".")[2])
        if path == "body.m":
            entry = Entry(source=f"rho volume; {self.known.entries['volume'].source}", given=ship.rho * ship.volume)
        elif path == "body.I_zG":
            inertia = self.values["body.m"] * (0.25 * ship.L_pp) ** 2
            sigma, basis = _sigma(path, inertia, None)
            entry = Entry(source=f"{_INERTIA}; sigma: {basis}", given=inertia, sigma=sigma)
        elif path == "wind.L_wind":
            entry = Entry(source="L_pp, as in the authors' code", given=ship.L_pp)
        else:
            entry = self.known.air[key] if path.startswith("wind.") else self.known.entries[key]
        value = resolve(entry, meaning.unit, self.scale)
        self.entries[path], self.values[path] = entry, value if value is not None else entry.given
        how = "assumed" if key in self.known.assumed or entry.source.startswith(_INERTIA) else "given"
        basis = "" if entry.sigma is None else how
        self.numbers.append(Number(path, self.values[path], meaning.unit, how, sigma=entry.sigma, sigma_from=basis))

    @property
    def scale(self) -> Yardsticks:
        ship = self.known.ship
        return Yardsticks(ship.rho, ship.L_pp, ship.d)

    def cautions(self) -> Iterator[str]:
        left: dict[str, list[str]] = {}
        for item in self.numbers:
            if item.outside:
                left.setdefault(f"{item.formula}: {'; '.join(item.outside)}", []).append(item.path)
        for reason, paths in left.items():
            yield f"outside the range of {reason}: {', '.join(paths)}"
        if self.known.assumed:
            yield f"not given, so assumed: {', '.join(self.known.assumed)}"
        if moved := {n: z for n, z in self.agreed.moves.items() if abs(z) >= _TOLD}:
            said = ", ".join(f"{name} by {z:+.2g} sigma" for name, z in moved.items())
            n_P, U = 60.0 * self.known.values["n_P"], self.known.ship.speed / KNOT
            yield f"so that {n_P:.4g} rpm hold {U:.4g} kn, moved: {said}"
        ship = self.known.ship
        said_if = {
            "hull.R_0 holds at the approach speed only: waves grow faster than the square of the speed":
                "hull.R_0" not in self.known.given,
            "the propeller is larger than the rudder is high; eta is held at 1": ship.D_P > ship.H_R,
            _SHALLOW: self.shallow, _TWO_SCREWS: ship.screws == 2.0,
            f"a Froude number of {ship.ratios['F_n']:.2g}: {_BEYOND}": ship.ratios["F_n"] > _PLANING,
            FIRST_LOOK: True,
        }  # fmt: skip
        yield from (line for line, holds in said_if.items() if holds)

    def ship(self, model: Any, cautions: tuple[str, ...]) -> Ship:
        values, entries = self.known.values, self.known.entries
        U, L, limit, most = values["speed"], values["L_pp"], values["delta_max"], entries["delta_max"]
        self.entries |= {
            "particulars.C_b": entries["C_b"], "particulars.volume": entries["volume"],
            "approach.speed": entries["speed"], "actuators.rudder.low": Entry(most.source, -most.given, unit=most.unit),
            "actuators.rudder.high": most, "actuators.rudder.rate": entries["delta_rate"],
            **({"approach.n_P": entries["n_P"]} if "n_P" in entries else {}),
        }  # fmt: skip
        return Ship(
            name=self.known.name, model=model, L_pp=L, speed=U, n_P=values.get("n_P"), entries=self.entries,
            actuators=Actuators({"rudder": Actuator(low=-limit, high=limit, rate=values["delta_rate"])}),
            validity={"u": (0.0, 1.2 * U), "v_m": (-0.5 * U, 0.5 * U), "r": (-U / L, U / L),
                      **{name: (-limit, limit) for name in model.controls if name.startswith("delta")}},
            notes={"title": self.known.title, "cautions": list(cautions), **self.known.notes,
                   MADE: {"particulars": self.path.name}},
        )  # fmt: skip


def _sigma(path: str, value: float, spread: float | None) -> tuple[float | None, str]:
    """Sigma of an estimated number in its unit, and what it rests on in words."""
    known = {"difference of the formulas": spread, "scatter about published ships": SCATTER.get(path)}
    found = {basis: sigma for basis, sigma in known.items() if sigma is not None}
    if path in SHARED and path in SCATTER:
        found["scatter about published ships"] = SCATTER[path] * abs(value)
    if found:
        basis = max(found, key=lambda name: found[name])
        return found[basis], basis
    share, why = next((stated for start, stated in STATED.items() if path.startswith(start)), (0.0, ""))
    return (share * abs(value), f"assumed {share:.0%}, {why}") if share and value else (None, "")


def _met(z: float) -> str:
    """What the source of a number says that moved by so many sigmas."""
    return f"; moved by {z:+.2g} sigma so that n_P holds the speed"


def _below(values: Mapping[str, float], part: str) -> dict[str, float]:
    return {path.removeprefix(f"{part}."): value for path, value in values.items() if path.startswith(f"{part}.")}
