"""Parameters and their three lives: meaning (`Spec`), value (in the ship file), freedom (`Free`).

A physics class is a frozen dataclass whose numbers are declared with `spec(...)`; a dotted path
such as ``rudder.t_R`` names one number of a composed model.  Everything here works on floats and
on symbols alike, because values are moved without being inspected.
"""

from __future__ import annotations

import difflib
import fnmatch
import math
import numbers
import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from .errors import ParameterError as ParameterError
from .values import MISSING, dataclass, field, fields, is_dataclass, replace

Scalar = Any
"""A Python float or a CasADi symbol: the one deliberate `Any` of the package."""
Scalars = tuple[Scalar, ...]
"""Several of them, such as a state, the controls or a memory."""

# Prefixes by which a primed number becomes dimensional; see `ships.files`.
PRIME = "'"

_PART = re.compile(r"\w+([ -]\w+)*")


@dataclass(frozen=True)
class Spec:
    """Meaning of a number: its unit, description, and physical range."""

    unit: str
    about: str
    low: float = -math.inf
    high: float = math.inf


def spec(unit: str, about: str, limits: tuple[float, float] = (-math.inf, math.inf), default: Any = MISSING) -> Any:
    """Declare one number of a physics class; `default` only where the formula is valid without it."""
    return field(default=default, metadata={"spec": Spec(unit, about, *limits)})


@dataclass(frozen=True)
class Terms:
    """Numbers whose names the ship file chooses, such as the terms of a polynomial.

    A physics class declares one with `terms(meaning)`; the dotted path is ``field.name``.
    """

    names: tuple[str, ...] = ()
    numbers: tuple[Scalar, ...] = ()

    def items(self) -> tuple[tuple[str, Scalar], ...]:
        """(name, number) in the order of the file."""
        return tuple(zip(self.names, self.numbers, strict=True))

    def get(self, name: str, absent: Scalar = 0.0) -> Scalar:
        """The number of a name; `absent` where the file has none."""
        return self.numbers[self.names.index(name)] if name in self.names else absent


@dataclass(frozen=True)
class Parts:
    """Components whose names the ship file chooses, such as thrusters; declared with `parts()`.

    A name becomes part of paths, of controls, of columns and of exported sources, so it holds letters, digits, `_`,
    `-` and single spaces only.

    Raises:
        ParameterError: another name.
    """

    names: tuple[str, ...] = ()
    components: tuple[Any, ...] = ()

    def __post_init__(self) -> None:
        for name in self.names:
            if not _PART.fullmatch(name):
                raise ParameterError(f"a part is named {name!a}; take letters, digits, '_', '-' and single spaces")

    def items(self) -> tuple[tuple[str, Any], ...]:
        """(name, component) in the order of the file."""
        return tuple(zip(self.names, self.components, strict=True))


def terms(meaning: Callable[[str], Spec]) -> Any:
    """Declare a field of type `Terms`; `meaning` gives the `Spec` of a name.

    `meaning` raises a ParameterError for a name that cannot be a term.
    """
    return field(default_factory=Terms, metadata={"terms": meaning})


def parts(role: str) -> Any:
    """Declare a field of type `Parts`, none by default; `role` is what its components are, such as "thruster"."""
    return field(default_factory=Parts, metadata={"parts": role})


def choice(about: str, options: tuple[str, ...], default: str) -> Any:
    """Declare a text of a physics class that picks one of several published forms."""
    return field(default=default, metadata={"choice": (about, options)})


@dataclass(frozen=True)
class Free:
    """One parameter that a study searches, with its interval and its Gaussian prior.

    Attributes:
        path: dotted path in the model, such as ``rudder.t_R``.
        start: initial value of the search.
        low, high: bounds of the search; infinite where only the prior holds the parameter.
        prior: mean of the Gaussian prior.
        sigma: its standard deviation; infinite means no prior.
        tied: correlations of the prior with those of other parameters, (path, correlation); each pair is stated once.
    """

    path: str
    start: float
    low: float = -math.inf
    high: float = math.inf
    prior: float = math.nan
    sigma: float = math.inf
    tied: tuple[tuple[str, float], ...] = ()

    def __post_init__(self) -> None:
        if not self.low < self.high:
            raise ParameterError(
                f"{self.path}: the interval [{self.low:g}, {self.high:g}] has no width; "
                "give low < high, or leave the parameter out of [free]"
            )
        if not self.low <= self.start <= self.high:
            raise ParameterError(
                f"{self.path}: the bounds [{self.low:g}, {self.high:g}] exclude the start "
                f"{self.start:g}; widen them or move the start"
            )
        if not self.sigma > 0:
            raise ParameterError(f"{self.path}: sigma is {self.sigma:g}; a prior needs sigma > 0")
        for path, c in self.tied:
            if not (-1.0 < c < 1.0 and math.isfinite(self.sigma)):
                raise ParameterError(
                    f"{self.path}: tied to {path} by {c:g}; give a sigma, and a correlation between -1 and 1"
                )

    @property
    def scale(self) -> float:
        """Typical size of a change, used to scale the search."""
        if math.isfinite(self.sigma):
            return self.sigma
        if math.isfinite(self.high - self.low):
            return 0.25 * (self.high - self.low)
        return max(abs(self.start), 1.0)


def walk(model: Any, prefix: str = "") -> Iterator[tuple[str, Spec, Any]]:
    """Every declared number of `model` as (path, Spec, value), in the order of declaration."""
    for f in fields(model):
        value = getattr(model, f.name)
        meaning = f.metadata.get("spec")
        if meaning is not None:
            yield prefix + f.name, meaning, value
        elif isinstance(value, Terms):
            for name, number in value.items():
                yield f"{prefix}{f.name}.{name}", f.metadata["terms"](name), number
        elif isinstance(value, Parts):
            for name, component in value.items():
                yield from walk(component, f"{prefix}{f.name}.{name}.")
        elif is_dataclass(value) and not isinstance(value, type):
            yield from walk(value, f"{prefix}{f.name}.")


def values(model: Any) -> dict[str, Any]:
    """All parameters of `model` by path."""
    return {path: value for path, _, value in walk(model)}


def _known(model: Any, *paths: str) -> dict[str, Any]:
    """All parameters of `model`, with those at the paths among them."""
    known = values(model)
    for path in paths:
        if path not in known:
            raise ParameterError(unknown(path, known))
    return known


def specs(model: Any) -> dict[str, Spec]:
    """The meaning of all parameters of `model` by path."""
    return {path: meaning for path, meaning, _ in walk(model)}


def unknown(name: str, known: Any, what: str = "parameter") -> str:
    """One line for an unknown name that lists the near ones, or all where none is near."""
    names = list(known)
    last = {n.rsplit(".", 1)[-1].lower(): n for n in names}
    close = difflib.get_close_matches(name, names, n=4, cutoff=0.6)
    close += [last[n] for n in difflib.get_close_matches(name.rsplit(".", 1)[-1].lower(), last, n=4)]
    listed = ", ".join(dict.fromkeys(close)) or ", ".join(names[:40])
    return f"no {what} '{name}'; known: {listed}" if not close else f"no {what} '{name}'; near: {listed}"


def possible(known: Mapping[str, Spec], given: Mapping[str, Any]) -> None:
    """Raise a ParameterError for a number outside its range; symbols, NaN and unknown names are accepted."""
    for name, value in given.items():
        meaning = known.get(name)
        if meaning is None or not isinstance(value, numbers.Real):
            continue
        if float(value) < meaning.low or float(value) > meaning.high:
            unit = "" if meaning.unit in ("", "-", PRIME) else f" {meaning.unit}"
            degrees = " (180 deg is 3.14 rad)" if meaning.unit == "rad" else ""
            raise ParameterError(
                f"{name} is {float(value):g}{unit}; it can be {meaning.low:g} to {meaning.high:g}{unit}{degrees}"
            )


def read(model: Any, path: str) -> Any:
    """Value of the parameter at `path`."""
    return _known(model, path)[path]


def update(model: Any, changes: Mapping[str, Any]) -> Any:
    """A copy of `model` with the parameters at the given paths replaced."""
    _known(model, *changes)
    return _update(model, changes) if changes else model


def _update(model: Any, changes: Mapping[str, Any]) -> Any:
    here: dict[str, Any] = {}
    below: dict[str, dict[str, Any]] = {}
    for path, value in changes.items():
        head, dot, rest = path.partition(".")
        if dot:
            below.setdefault(head, {})[rest] = value
        else:
            here[path] = value
    for head, nested in below.items():
        here[head] = _update(dict(model.items())[head] if isinstance(model, Parts) else getattr(model, head), nested)
    if isinstance(model, Terms):
        return replace(model, numbers=tuple(here.get(name, number) for name, number in model.items()))
    if isinstance(model, Parts):
        return replace(model, components=tuple(here.get(name, part) for name, part in model.items()))
    return replace(model, **here)


def match(model: Any, pattern: str) -> list[str]:
    """Paths of `model` that fit a shell-style pattern (``hull.*``); at least one."""
    known = list(values(model))
    found = [path for path in known if fnmatch.fnmatchcase(path, pattern)]
    if not found:
        raise ParameterError(unknown(pattern, known))
    return found


MOST = 10.0
"""Largest ratio of a parameter's interval to its value; a larger one is taken for percent."""


def far(key: str, share: float) -> str:
    """Why a share of a value is too wide."""
    return f"{key} is {share:g}: {share:g} times the value either way; {share:g} % is {share / 100.0:g}"


def near(model: Any, *paths: str, ratio: float) -> tuple[Free, ...]:
    """Each parameter free within `ratio` of its value: ``[P - a|P|, P + a|P|]`` (Suyama 2023 Eq. 38).

    Raises:
        ParameterError: an unknown path; a value of zero, whose interval would be empty; an interval outside the
            parameter's range; a ratio beyond `MOST`.

    >>> from seatrial.ships.files import load
    >>> (one,) = near(load("kvlcc2_l7").model, "hull.R_0", ratio=0.5)
    >>> one.path, round(one.low, 4), round(one.high, 4)
    ('hull.R_0', 0.011, 0.033)
    """
    if ratio > MOST:
        raise ParameterError(far("ratio", ratio))
    meanings = specs(model)
    return tuple(
        _near(path, float(read(model, path)), meanings[path], ratio)
        for pattern in paths
        for path in match(model, pattern)
    )


def _near(path: str, value: float, meaning: Spec, ratio: float) -> Free:
    half = ratio * abs(value)
    low, high = value - half, value + half
    if not low < high:
        raise ParameterError(f"{path} is {value:g}: an interval of ratio {ratio:g} has no width; give low and high")
    if low < meaning.low or high > meaning.high:
        asked, reach = f"[{low:.3g}, {high:.3g}]", f"[{meaning.low:g}, {meaning.high:g}]"
        raise ParameterError(f"{path}: the range {asked} leaves what it can be, {reach}; take a lower ratio")
    return Free(path, value, low, high)
