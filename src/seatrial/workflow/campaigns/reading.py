"""Campaigns from a file: ships, manoeuvres, weather and distributions, checked."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

import numpy as np

from ...belief.reading import posterior
from ...campaign import Campaign, Case, Correlated, Criterion, Tracks, usual_chunk
from ...campaign import chunk as chunks
from ...campaign.columns import index_units, meanings, shown
from ...campaign.inputs import Input, Kind
from ...campaign.schema import SCHEMA, CampaignFile, CriterionTable, InputTable, ManoeuvreTable, PosteriorTable
from ...core.parameters import unknown
from ...core.records import document_of, filled, of_schema
from ...data.units import KNOWN
from ...engine.cuda.named import device_of
from ...environment import Uniform
from ...identify import StudyError
from ...ships import Ship, ShipError
from ...simulate.approach import approach, time_step
from ...study.store import MODEL
from .. import RequestError
from ..asked import Approach, Around, Orders, Span
from ..request import Note, ship_of, silent, surroundings
from ..simulation import ahead_of, helm_of, order, simulate

# Draws of a posterior that is not normal, of which each run takes one.
_DRAWS, _SEED = 16_384, 1
_KINDS: tuple[Kind, ...] = ("uniform", "normal", "lognormal", "triangular", "choice", "values")


def read_campaign(path: Path, note: Note = silent) -> Campaign:
    """A campaign from its file, with ships, manoeuvres and distributions checked.

    Raises:
        RequestError: what is wrong in the file, and at which key.
    """
    return campaign_of(document_of(path), path, note)


def campaign_of(document: dict[str, Any], path: Path, note: Note = silent) -> Campaign:
    """A campaign from the contents of its file; `path` is for messages, and ships are looked for beside it.

    Raises:
        RequestError: what is wrong in the file, and at which key.
    """
    table = filled(CampaignFile, of_schema(document, SCHEMA, path), path)
    ships = [_ship(path, name) for name in table.ships]
    wanted = table.manoeuvre if isinstance(table.manoeuvre, list) else [table.manoeuvre]
    around, gusts = _weather(table, ships, note)
    cases = tuple(case_of(ship, one, len(ships) > 1, len(wanted) > 1, around) for ship in ships for one in wanted)
    units = {name: unit for case in cases for name, unit in index_units(case, around).items()}
    known = {name: shown(one.unit) for case in cases for name, one in meanings(case).items()}
    try:
        kept = table.tracks
        tracks = Tracks(kept.every, tuple(kept.columns), kept.precision) if kept else None
        campaign = Campaign(
            table.title or path.stem, cases, table.runs,
            {name: _input(path, name, one, known.get(name)) for name, one in table.inputs.items()},
            _posterior(path, table.posterior) if table.posterior else None, table.design, table.seed, around,
            gusts, table.revolutions == "balanced",
            {name: _criterion(path, name, one, units) for name, one in table.criteria.items()},
            table.chunk or usual_chunk(cases, tracks), tracks,
        )  # fmt: skip
        chunks.check(campaign)
    except ValueError as error:
        raise RequestError(f"{path}: {str(error).removeprefix(f'{path}: ')}") from None
    return campaign


def _ship(path: Path, name: str) -> Ship:
    beside = path.parent / name
    return ship_of(beside if name.endswith(".toml") and beside.exists() else name)


def _weather(table: CampaignFile, ships: list[Ship], note: Note) -> tuple[Uniform, str | None]:
    """Steady weather, and the spectrum of gusts; every ship must feel what is given."""
    given = {key: value for key, value in vars(table.weather).items() if key != "gusts"}
    places = [surroundings(ship, Around(**given), note=note) for ship in ships]
    found = cast("Uniform", places[0].weather)  # without gusts it is steady
    if table.weather.gusts is not None and not (found.U_T or "U_T" in table.inputs):
        raise RequestError("weather.gusts need a mean wind to blow about; give weather.wind or the input U_T")
    return found, table.weather.gusts


def case_of(ship: Ship, one: ManoeuvreTable, ships: bool, manoeuvres: bool, around: Uniform) -> Case:
    """A ship in a manoeuvre; without a duration the run lasts as long as `seatrial simulate` lets it."""
    device_of(one.device, one.precision)
    orders = Orders(one.rudder, one.steer, one.heading, one.side, one.seed)
    begin = Approach(one.speed, one.rps, one.throttle)
    U, n_P = approach(ship, one.speed, ahead_of(ship, begin))
    rudder = helm_of(ship, one.kind, orders)
    given = {"rudder": rudder, "heading": one.heading, "side": one.side, "seed": one.seed}
    policy = order(one.kind, ship, U, n_P, {key: value for key, value in given.items() if value is not None})
    speed = 0.0 if policy.from_rest else U
    dt = one.dt or time_step(ship)
    duration = one.duration
    if duration is None:
        duration = simulate(ship, one.kind, orders=orders, begin=begin, span=Span(dt=dt)).trial.duration
    parts = ([ship.name] if ships or not manoeuvres else []) + ([one.name or one.kind] if manoeuvres else [])
    return Case(" ".join(parts) or ship.name, ship, policy, speed, duration, dt, one.method, one.indices == "all",
                one.device, one.precision)  # fmt: skip


def _input(path: Path, name: str, one: InputTable, unit: str | None) -> Input:
    told = vars(one)
    given: list[tuple[Kind, list[float]]] = [(kind, told[kind]) for kind in _KINDS if told[kind] is not None]
    if one.value is not None:
        given.append(("constant", [one.value]))
    if len(given) != 1:
        raise RequestError(f"{path}: inputs.{name}: give one of value, {', '.join(_KINDS)}; it has {len(given)}")
    (kind, numbers), scale = given[0], _scale(path, f"inputs.{name}", one.unit, "-" if one.factor else unit)
    spread = kind == "lognormal"  # the second number is of the logarithm
    numbers = [n if spread and k == 1 else n * scale for k, n in enumerate(numbers)]
    within = None if one.within is None else (one.within[0] * scale, one.within[1] * scale)
    try:
        return Input(kind, tuple(numbers), tuple(one.weights), within, one.factor)
    except ValueError as error:
        raise RequestError(f"{path}: inputs.{name}: {error}") from None


def _scale(path: Path, key: str, unit: str | None, wanted: str | None) -> float:
    """Factor of a unit to that of what it is given for; without `wanted`, which is not known, to SI."""
    if unit is None:
        return 1.0
    if unit not in KNOWN:
        raise RequestError(f"{path}: {key}.unit: {unknown(unit, KNOWN, 'unit')}")
    si, factor = KNOWN[unit]
    if wanted is not None and si != wanted:
        right = "it has none" if wanted == "-" else f"it is in {wanted}"
        raise RequestError(f"{path}: {key}.unit: '{unit}' cannot measure it; {right}")
    return factor


def _criterion(path: Path, name: str, one: CriterionTable, units: Mapping[str, str]) -> Criterion:
    if name not in units:
        raise RequestError(f"{path}: criteria.{name}: {unknown(name, units, 'index')}")
    scale = _scale(path, f"criteria.{name}", one.unit, units[name])
    low, high = one.at_least, one.at_most
    if low is None and high is None:
        raise RequestError(f"{path}: criteria.{name}: give at_most, at_least or both")
    return Criterion(name, -math.inf if low is None else low * scale, math.inf if high is None else high * scale)


def _posterior(path: Path, table: PosteriorTable) -> Correlated:
    """Parameters of a fit by its posterior, `widen` times as far from the estimates.

    Where nothing but the covariance of the fit is known, and no bound cuts it, each parameter takes a dimension of the
    design; else draws of the posterior are listed, of which one dimension chooses.
    """
    file = path.parent / table.fit if not Path(table.fit).is_absolute() else Path(table.fit)
    if not file.exists():
        raise RequestError(f"{path}: posterior.fit: {file}: no such file; name the folder of a run, which seatrial "
                           "identify STUDY -o RUN writes")  # fmt: skip
    try:
        held = posterior((file if file.is_dir() else file.parent) / MODEL)
    except (StudyError, ShipError) as error:
        raise RequestError(f"{path}: posterior.fit: {error}") from None
    names, mean = tuple(f"ship.{name}" for name in held.names), held.mean
    if not held.normal:
        drawn = held.draws(_DRAWS, _SEED)
        return Correlated(names, mean, np.eye(len(names)), mean + table.widen * (drawn - mean))
    values, vectors = np.linalg.eigh(held.covariance)
    triangular: Any = np.linalg.qr((vectors * np.sqrt(np.maximum(values, 0.0))).T, mode="r")
    root = triangular.T
    return Correlated(names, mean, table.widen * root * np.sign(np.diag(root)))
