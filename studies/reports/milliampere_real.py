"""Page of the real milliAmpere: forecasts over 5, 10 and 20 s of whole minutes that the fit has not seen, with bands.

    python studies/reports/milliampere_real.py -o RUN

Fits studies/milliampere_real.toml four times, each without three minutes (two of nlp1 and one of qp1), and forecasts
these from every second on by a filter that has seen the 20 s before and nothing else.  What part of the model's way to
take, and how wide the bands are, each fold chooses on minutes of its own, forecast by fits without these.  Writes
RUN/report.html and .json, in some three minutes.  The trials are in `$SEATRIAL_DATA`.  With `--also FOLDER` a fit to
all minutes forecasts the trials of that folder too, which are in the same files as these.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import seatrial as st

Ahead, joined, MODEL, RIVALS = st.ahead.Ahead, st.ahead.joined, st.ahead.MODEL, st.ahead.RIVALS
number, Section = st.blocks.number, st.page.Section
Features = st.stacking.Features

STUDY = Path(__file__).parents[1] / "milliampere_real.toml"
MAPPING = STUDY.parent / "mappings" / "milliampere.toml"
DEGREES = math.degrees(1.0)
HORIZONS, WARM, EVERY, STATED = (5.0, 10.0, 20.0), 20.0, 1.0, 0.9
# Time between starts of the forecasts from which a fold chooses [s].
INNER = 2.0
# A ship whose middle is as far from the line of the quay [m] is beside it, and so far is off it.
BESIDE, OFF = 2.0, 4.0
FOLDS, TRIALS = 4, ("nlp1", "qp1")
# Iterations of a fit without some minutes, of which there are ten; those of the study itself are more.
FEW = 40
# Disturbances: random accelerations [m/s^2/sqrt(Hz), rad/s^2/sqrt(Hz)], current and yaw moment that wander.
WALK = {"u": 0.06, "v_m": 0.06, "r": 0.03, "current": 0.003, "steady.N_0": 1.0}
FILTER = st.Kalman(
    measurement={"gnss": st.Antenna(0.01), "compass": st.Heading(0.003)}, process=WALK, current=True,
    parameters=(st.Free("steady.N_0", 0.0, prior=0.0, sigma=30.0),),
)  # fmt: skip


@dataclass(frozen=True)
class Fold:
    """A fit without some minutes, and its forecasts of them, one a horizon: the filter's, and what is made of them.

    `stack` and `bands` name what the fold chose.
    """

    ship: st.Ship
    left: tuple[str, ...]
    bare: tuple[Ahead, ...]
    ahead: tuple[Ahead, ...]
    stack: str
    bands: str


def nearness(ship: st.Ship, some: Ahead) -> st.Array:
    """One beside the quay, none off it, by where the ship is at the start."""
    north, east, way = (
        float(st.parameters.read(ship.model, f"quay.{name}")) for name in ("north", "east", "direction")
    )
    away = math.cos(way) * (some.state[:, 1] - east) - math.sin(way) * (some.state[:, 0] - north)
    return np.clip((OFF - away) / (OFF - BESIDE), 0.0, 1.0)


def stacks(ship: st.Ship) -> dict[str, Features | None]:
    """What the shares of model and constant velocity may depend on."""

    def on(*features: Features) -> Features:
        return lambda some: np.column_stack([np.ones(len(some.trial)), *(one(some) for one in features)])

    def near(some: Ahead) -> st.Array:
        return nearness(ship, some)

    def surprise(some: Ahead) -> st.Array:
        return np.log10(np.maximum(some.surprise, 1e-3)).astype(np.float64)

    def speed(some: Ahead) -> st.Array:
        return (np.hypot(some.state[:, 3], some.state[:, 4]) / ship.speed).astype(np.float64)

    return {"model": None, "constant": on(), "quay": on(near), "surprise": on(surprise), "speed": on(speed),
            "quay and surprise": on(near, surprise)}  # fmt: skip


def regimes(ship: st.Ship) -> dict[str, tuple[st.stacking.Regime, bool]]:
    """What the width of the bands may depend on."""

    def beside(some: Ahead) -> NDArray[np.intp]:
        return (nearness(ship, some) > 0.5).astype(np.intp)

    return {"sigma": (lambda some: 0 * beside(some), False), "sigma, quay": (beside, False), "quay": (beside, True)}


def made(ship: st.Ship, groups: Sequence[Sequence[Ahead]], bare: Sequence[Ahead]) -> tuple[str, str, tuple[Ahead, ...]]:
    """Names of stack and bands chosen on `groups` of forecasts, by horizon, and forecasts `bare` with these."""
    stack = st.stacking.chosen(groups, stacks(ship), TRIALS)
    features = stacks(ship)[stack]
    stacked = [st.stacking.crossed(some, features) for some in groups]
    bands = st.stacking.banded(stacked, regimes(ship), STATED)
    regime, alone = regimes(ship)[bands]
    out: list[Ahead] = []
    for some, tried, one in zip(groups, stacked, bare, strict=True):
        best = one if features is None else st.stacking.Stack.fitted(joined(some), features).of(one)
        out.append(st.stacking.Bands.fitted(joined(tried), regime, STATED, alone=alone).of(best))
    return stack, bands, tuple(out)


Looks = dict[tuple[int, int], tuple[Ahead, ...]]


def looks(study: st.Study, every: float = EVERY, inner: float = INNER) -> tuple[dict[int, st.Ship], Looks]:
    """Ships without each group of minutes, and forecasts of group j by a fit without groups k and j, by (k, j).

    Minutes k and k + 4 of nlp1 and minute k of qp1 are a group.
    """
    trials, ships, found = study.problem.trials, dict[tuple[int, int], st.Ship](), Looks()
    given: Any = study.estimator
    estimator = replace(given, iterations=FEW)
    for k in range(FOLDS):
        for j in range(FOLDS):
            pair = (min(j, k), max(j, k))
            if pair not in ships:
                kept = tuple(t for t in trials if _group(t) not in pair)
                ships[pair] = estimator.fit(replace(study.problem, trials=kept)).ship
            left, step = [t for t in trials if _group(t) == j], every if j == k else inner
            found[k, j] = st.ahead.looked_ahead(FILTER, ships[pair], left, HORIZONS, warm=WARM, every=step)
    return {k: ships[k, k] for k in range(FOLDS)}, found


def _group(trial: st.Trial) -> int:
    return (int(trial.name.rpartition("_")[2]) - 1) % FOLDS


def folds(ships: dict[int, st.Ship], found: Looks) -> tuple[Fold, ...]:
    """The cross-validation; each fold chooses on forecasts of its own minutes, by fits without these."""
    out: list[Fold] = []
    for k, ship in ships.items():
        groups = list(zip(*(found[k, j] for j in range(FOLDS) if j != k), strict=True))
        stack, bands, ahead = made(ship, groups, found[k, k])
        out.append(Fold(ship, tuple(dict.fromkeys(ahead[0].trial)), found[k, k], ahead, stack, bands))
    return tuple(out)


def others(study: st.Study, found: Sequence[Fold], folder: Path, every: float = EVERY) -> tuple[Ahead, ...]:
    """Forecasts of whole trials of a folder by a fit to all minutes of the study, one a horizon."""
    log = st.formats()["csv"]
    mapping = replace(log.read_mapping(MAPPING), trial=())
    trials = [trial for one in log.recordings(folder, mapping) for trial in log.read_all(one, mapping)]
    ship = study.estimator.fit(study.problem).ship
    ahead = st.ahead.looked_ahead(FILTER, ship, trials, HORIZONS, warm=WARM, every=every)
    return made(ship, list(zip(*(one.bare for one in found), strict=True)), ahead)[2]


def row(name: str, some: Ahead) -> dict[str, Any]:
    """Errors of the forecasts of a trial."""
    return {
        "trial": name, "horizon": some.horizon, "forecasts": len(some.trial),
        "position": {who: some.rms(who)[0] for who in (MODEL, *RIVALS)},
        "heading": {who: some.rms(who)[1] for who in (MODEL, *RIVALS)},
        "ratio": some.ratio(), "covered": some.covered(STATED),
    }  # fmt: skip


def errors(rows: Sequence[dict[str, Any]]) -> st.blocks.Body:
    """The table of some forecasts."""
    whom = [f"{who} [{unit}]" for unit in ("m", "°") for who in ("model", "stays", "goes on")]
    head = ("trial", "ahead [s]", "number", *whom[:3], "ratio", *whom[3:], "ratio", "within band", "°")
    cells = [[one["trial"], number(one["horizon"]), str(one["forecasts"]),
              *(number(one["position"][who]) for who in (MODEL, *RIVALS)), number(one["ratio"][0]),
              *(number(DEGREES * one["heading"][who]) for who in (MODEL, *RIVALS)), number(one["ratio"][1]),
              *(f"{100.0 * share:.0f} %" for share in one["covered"])] for one in rows]  # fmt: skip
    return st.blocks.table(head, cells, words=(0,))


def numbers(found: Sequence[Fold], more: Sequence[Ahead], paths: Sequence[str]) -> dict[str, Any]:
    """The numbers of the page."""
    every, bare = (
        [joined(some) for some in zip(*each, strict=True)]
        for each in zip(*((f.ahead, f.bare) for f in found), strict=True)
    )
    names = dict.fromkeys(name for one in more for name in one.trial)
    values = {path: [float(st.parameters.read(one.ship.model, path)) for one in found] for path in paths}
    return {
        "forecasts": [row(name, one.of(name)) for one in every for name in TRIALS],
        "bare": [row(name, one.of(name)) for one in bare for name in TRIALS],
        "others": [row(name, one.of(name)) for one in more for name in names],
        "folds": [{"left": list(one.left), "stack": one.stack, "bands": one.bands} for one in found],
        "parameters": values,
    }  # fmt: skip


def page(study: st.Study, found: Sequence[Fold], more: Sequence[Ahead] = ()) -> st.page.Page:
    """The page."""
    said = numbers(found, more, [free.path for free in study.problem.free])
    story = "; ".join(
        f"{one['trial']} at 10 s: {number(one['position'][MODEL])} m and {number(DEGREES * one['heading'][MODEL])}°, "
        f"{number(one['ratio'][0], 2)} and {number(one['ratio'][1], 2)} of the better of staying put and going on"
        for one in said["forecasts"] if one["horizon"] == 10.0
    )  # fmt: skip
    told = st.blocks.soft(
        f"Root mean square errors at the end of each forecast, of the model, of who stays put, and of who goes on at "
        f"constant velocity; ratio: to the better of the two.  Bands state {STATED:.0%}.  Parameters, shares of the "
        "model's way and widths of a minute come from elsewhere; the place of the quay, the delay of the thrust and "
        "the antenna were read off both trials, and the filter's noises are round numbers.  Chosen, fold by fold: "
        f"shares by {', '.join(one.stack for one in found)}; widths by {'; '.join(one.bands for one in found)}."
    )
    caption = f"s ahead: errors and band of {STATED:.0%}, by the time at which the forecast ends"
    shown = [(i, horizon, name) for i, horizon in enumerate(HORIZONS) if i for name in TRIALS]
    drawings = st.blocks.gallery(
        *(st.blocks.figure(drawn(found, i, name), f"{name}, {horizon:g} {caption}") for i, horizon, name in shown)
    )
    parameters = st.blocks.table(
        ("parameter", *(f"fold {k + 1}" for k in range(FOLDS))),
        [[path, *(number(v) for v in values)] for path, values in said["parameters"].items()],
    )
    sections = (
        Section("", st.blocks.fields(said, st.blocks.lead(story + "."))),
        Section("Forecasts of left-out minutes", told + errors(said["forecasts"])),
        Section("The filter alone, its own bands", errors(said["bare"])),
        Section("Other trials, by the fit to all minutes", errors(said["others"]) if more else ()),
        Section("Errors and bands", drawings),
        Section("Parameters of the folds", parameters),
        st.page.provenance({"study": study.name, "digest": study.digest, "program": f"seatrial {st.__version__}"}),
    )
    return st.page.Page("milliAmpere: forecasts of minutes that the fit has not seen", sections)


def drawn(found: Sequence[Fold], i: int, name: str) -> str:
    """Forecast, band and measurement of north and heading over time, as changes since the start of each forecast."""
    some = joined([one.ahead[i] for one in found]).of(name)
    order = np.argsort(some.start)
    t, (fig, axes) = some.start[order] + some.horizon, st.figures.canvas(2, (9.0, 5.2))
    for ax, error, sigma, stay, factor, label in (
        (axes[0], some.north, some.sigma[:, 0], None, 1.0, "error north [m]"),
        (
            axes[1],
            some.heading[MODEL],
            some.sigma[:, 2],
            some.heading[st.ahead.STAYING],
            DEGREES,
            "error of heading [°]",
        ),
    ):
        band = 1.645 * factor * sigma[order]
        _gaps(ax, t, np.zeros_like(t), band)
        ax.plot(t, factor * error[order], ".", ms=4, color=st.figures.BLUE, label="model")
        if stay is not None:
            ax.plot(t, factor * stay[order], "x", ms=3, color=st.figures.GREY, label=st.ahead.STAYING)
        most = 1.5 * float(np.quantile(np.append(np.abs(factor * error), band), 0.97))
        ax.set(ylabel=label, ylim=(-most, most))
    axes[1].set_xlabel("time at the end of the forecast [s]")
    st.figures.legend_below(fig, axes[1])
    return st.figures.svg(fig, f"{name} {some.horizon:g}")


def _gaps(ax: Any, t: st.Array, middle: st.Array, band: st.Array) -> None:
    """A band that is broken where forecasts are missing."""
    breaks = np.flatnonzero(np.diff(t) > 5.0 * EVERY) + 1
    for part in np.split(np.arange(t.size), breaks):
        ax.fill_between(t[part], (middle - band)[part], (middle + band)[part], alpha=0.2, lw=0, color=st.figures.BLUE,
                        label="band" if part.size and part[0] == 0 else None)  # fmt: skip


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", dest="out", type=Path, required=True, help="folder for report.html and report.json")
    parser.add_argument("--also", type=Path, help="folder of trials that were kept back")
    given = parser.parse_args()
    try:
        study = st.read_study(STUDY)
        found = folds(*looks(study))
        made = page(study, found, others(study, found, given.also) if given.also else ())
    except st.SeatrialError as error:
        sys.exit(f"error: {error}")
    given.out.mkdir(parents=True, exist_ok=True)
    sys.stdout.write(f"wrote {st.page.write(given.out / 'report.html', made)}\n")


if __name__ == "__main__":
    main()
