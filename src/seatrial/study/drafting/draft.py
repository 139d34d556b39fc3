"""A first study of a ship and a folder of recordings: what is held out, what is free, in a file that a person edits.

Whole recordings are held out, the latest of each kind of manoeuvre, and never one that shares rows with another.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np

from ...core.parameters import values
from ...core.values import dataclass
from ...data import Trial
from ...data.folder import Folder
from ...data.kinds import Kind, recognised
from ...data.kinds.parts import parts as manoeuvres
from ...data.prepare import derivable, drop_trailing_gaps
from ...identify import StudyError
from ...identify.components.actuation import shown
from ...identify.trajectory.suspects import suspects
from ...models import STATES, Sampled
from ...ships import Ship
from ...simulate.begun import begun, too_little
from ..assumed import LEVEL, SPEED, levels, unassumed, wanting, with_assumed
from ..data import DATA
from ..freedom import stated
from .held_out import ROWS, copies, cut, held_out, timed
from .instruments import shared, smoothed
from .limits import limits
from .text import OWN, Freedom, text_of, window_of
from .wind import blown, table, unfelt, with_wind

_NO_USE = ("at rest", "unknown")
# Shares by which a length or a step may differ and still be the same, written with two digits.
_LENGTH, _STEP = 0.02, 0.01

_RULES: tuple[tuple[str, float, str], ...] = (
    ("body.m_x", 0.3, "surge"), ("body.m_y", 0.3, "turn"), ("body.J_z", 0.3, "turn"),
    ("body.X_udot", 0.3, "surge"), ("body.Y_vdot", 0.3, "turn"), ("body.N_rdot", 0.3, "turn"),
    ("body.X_udotz", 0.3, "surge"), ("body.Y_vdotz", 0.3, "turn"), ("body.N_rdotz", 0.3, "turn"),
    ("inertia.m_11", 0.3, "surge"), ("inertia.m_22", 0.3, "turn"), ("inertia.m_33", 0.3, "turn"),
    ("hull.[RX]_*", 0.3, "surge"), ("hull.*", 0.3, "turn"), ("damping.X_*", 0.5, "surge"), ("damping.*", 0.5, "turn"),
    ("derivatives.X_*", 0.3, "surge"), ("derivatives.*", 0.3, "turn"),
    ("*.t_P", 0.3, "surge"), ("*.w_P0", 0.2, "surge"),
    ("propeller.[ABCk]_*", 0.3, "engine"), ("propeller*.C_*", OWN, "turn"), ("propeller*.x_P", OWN, "turn"),
    ("propeller*.k_*", OWN, "surge"), ("rudder*.f_alpha", OWN, "turn"), ("rudder*.eta", OWN, "turn"),
    ("rudder*.x_R", OWN, "turn"),
    ("rudder*.t_R", 0.3, "turn"), ("rudder*.a_H", 0.3, "turn"), ("rudder*.x_H", 0.3, "turn"),
    ("rudder*.epsilon", 0.3, "turn"), ("rudder*.kappa", 0.3, "turn"), ("rudder*.k_x", 0.3, "turn"),
    ("rudder*.l_R", 0.3, "turn"), ("rudder*.gamma_*", 0.3, "turn"),
    ("screw.T_*", 0.2, "surge"), ("[XYN]_*", 0.2, "turn"),
    ("thrusters.*.T_[12]", 0.3, "surge"), ("thrusters.*.k", 0.3, "surge"), ("thrusters.*.c_[1-5]", 0.3, "surge"),
    ("thrusters.*.astern", 0.3, "astern"), ("thrusters.*.against", 0.5, "astern"),
    ("thrusters.*.sternway", OWN, "astern"),
    ("K", 0.5, "turn"), ("T", 0.5, "turn"), ("T[123]", 0.5, "turn"), ("delta_r", 0.5, "turn"),
    ("K_*", 0.5, "turn"), ("T_*", 0.5, "turn"),
    ("wind.[XYN]_*", 0.3, "wind"),
)  # fmt: skip
"""Patterns of parameters that trials can tell, the relative prior of each, and what the trials must show for it.

A ship that states the sigma of every parameter of a pattern has its own instead; a pattern of `OWN` is free of such a
ship only: what was measured is fixed, but what a regression gave is not known, and a wrong number that is held makes
others wrong, or an instrument that is right."""

_TURNS = ("turning", "zigzag", "spiral", "pull-out", "recovery", "initial-turning", "mixed", "berthing",
          "course-keeping", "station", "sideways", "astern")  # fmt: skip


@dataclass(frozen=True)
class Draft:
    """A study that is to be written.

    Attributes:
        text: of the file.
        train, test: names of the recordings, by kind.
        left_out: names with the reason of each.
        cut: trials that were made of one recording, to be written to a folder beside the study; empty where none was.
        notes: what the user should know.
    """

    text: str
    train: Mapping[str, tuple[str, ...]]
    test: Mapping[str, tuple[str, ...]]
    left_out: Mapping[str, str]
    cut: tuple[Trial, ...] = ()
    notes: tuple[str, ...] = ()


def draft(name: str, ship: Ship, folder: Folder, out: Path, mapping: Path | None = None) -> Draft:
    """A study for a ship and a folder.

    Args:
        name: of the ship as the study is to name it.
        ship: the ship.
        folder: its recordings.
        out: where the study will be written; its paths are relative to this.
        mapping: of the format of the folder, if it needs one.

    Raises:
        StudyError: a ship that no such study fits, or no recording that it could be fitted to.
    """
    _fitted_otherwise(name, ship)
    whole = {one: drop_trailing_gaps(trial) for one, trial in folder.trials.items()}
    kinds = {one: recognised(trial) for one, trial in whole.items()}
    left_out = _useless(ship, whole, kinds)
    usable = {one: trial for one, trial in whole.items() if one not in left_out}
    if not usable:
        first, why = next(iter(left_out.items()))
        more = f" (and {len(left_out) - 1} more recordings)" if len(left_out) > 1 else ""
        raise StudyError(f"{folder.root}: no recording that {ship.name} can be fitted to: {first}: {why}{more}")
    left_out |= {**copies(usable), **folder.unread}
    usable = {one: trial for one, trial in usable.items() if one not in left_out}
    assumed = _assumed(ship, usable.values())
    usable = {one: with_assumed(trial, tuple(assumed), ship) for one, trial in usable.items()}
    several = tuple(_several(folder, usable, kinds))
    parts: tuple[Trial, ...] = ()
    if len(usable) == 1:
        usable, parts = cut(usable)
        kinds = {one: kinds[next(iter(kinds.keys() - left_out.keys()))] for one in usable}
    train, test, notes = held_out(usable, kinds, bool(parts))
    bare, ship = ship, with_wind(ship, usable.values())
    free = _free(ship, [usable[one] for some in train.values() for one in some], [kinds[one] for one in usable])
    clock, duration = _clock(ship, usable.values()), min(trial.duration for trial in usable.values())
    every = tuple(usable.values())
    common, told = shared(every, ship.L_pp, clock, suspects(ship.model, every))
    common |= dict.fromkeys(levels([usable[one] for some in train.values() for one in some], ship), LEVEL)
    notes = (*notes, *several, *unfelt(bare, ship, usable.values()), *_assuming(assumed), *told)
    root, format = (f"{out.stem}_trials", "") if parts else (_relative(folder.root, out), folder.format)
    # the study takes a recording by its file name, and a note that it is a copy into the list of those left out
    files = {
        one: one if parts else folder.files[one].relative_to(folder.root).as_posix() for one in (*usable, *left_out)
    }
    text = text_of(
        ship=name, family=type(ship.model).__name__, root=root, format=format,
        actuators=tuple(shown(ship, every)), wind=table(ship) if ship is not bare else (),
        mapping=_relative(mapping, out) if mapping else "", files=files, kinds=kinds, train=train, test=test,
        left_out={} if parts else left_out, free=free,
        limits=limits(ship, [path for *_, paths in free for path in paths]), sampled=isinstance(ship.model, Sampled),
        timed=timed(usable), clock=clock, duration=duration,
        windy=ship.model.feels_wind and any(map(blown, usable.values())),
        sigma=smoothed(every, window_of(clock, duration)), assumed=tuple(assumed), common=common,
    )  # fmt: skip
    return Draft(text, train, test, left_out, parts, notes)


def _fitted_otherwise(name: str, ship: Ship) -> None:
    if ship.model.learned is not None:
        raise StudyError(f"{name}: is a network, which has weights and no parameters; start from "
                         "studies/esso_osaka_3m_network.toml, or take a ship of another family")  # fmt: skip


def _useless(ship: Ship, trials: Mapping[str, Trial], kinds: Mapping[str, Kind]) -> dict[str, str]:
    """Recordings that the ship cannot be fitted to, with the reason."""
    model: Any = ship.model
    step = float(model.dt) if isinstance(model, Sampled) else None
    out: dict[str, str] = {}
    for name, trial in trials.items():
        known = {channel for channel in trial.channels if np.isfinite(trial[channel]).any()}
        absent = [name for name in STATES if step is not None and name not in known]
        absent += [name for name, of in wanting(trial, ship).items() if step is not None or not of]
        length = trial.meta.get("L_pp")
        if absent:
            out[name] = f"no channel {', '.join(absent)}, which {ship.name} needs{derivable(trial, absent)}"
        elif told := too_little(trial) or unassumed(trial, ship):
            out[name] = told
        elif isinstance(length, int | float) and abs(length / ship.L_pp - 1.0) > _LENGTH:
            out[name] = f"is of a ship of {length:g} m, {ship.name} has {ship.L_pp:g} m"
        elif step is not None and abs(trial.dt / step - 1.0) > _STEP:
            out[name] = (f"is sampled every {trial.dt:g} s, {ship.name} runs at {step:g} s only: "
                         f"seatrial resample TRIALS --dt {step:g} -o DIR")  # fmt: skip
        elif kinds[name].name in _NO_USE:
            out[name] = "; ".join((kinds[name].name, *kinds[name].evidence, *kinds[name].doubts))
        elif len(trial) < ROWS:
            out[name] = f"{len(trial)} rows are too few"
    return out


def _assumed(ship: Ship, trials: Iterable[Trial]) -> dict[str, str]:
    """Controls that some of the trials lack, and what tells them."""
    return {name: of for trial in trials for name, of in wanting(trial, ship).items()}


def _assuming(assumed: Mapping[str, str]) -> Iterator[str]:
    """Notes on what is assumed, and what to do where it is known."""
    if ordered := [name for name, of in assumed.items() if of != SPEED]:
        yield (f"{', '.join(ordered)}: only orders are on record; the actuator of the ship file follows them "
               "(assumed in [data])")  # fmt: skip
    if held := [name for name, of in assumed.items() if of == SPEED]:
        yield (f"{', '.join(held)}: not on record; constant in each trial, as holds its first speed by the ship file "
               "(assumed in [data]), and its level there is estimated; thrust and resistance cannot be told apart. "
               'Where it is known: seatrial mend, do = "constant" (docs/data.md)')  # fmt: skip


def _free(ship: Ship, train: Sequence[Trial], kinds: Iterable[Kind]) -> Freedom:
    """Patterns with their priors and the parameters that each frees, as far as these trials can tell them."""
    every = values(ship.model)
    known = [path for path, value in every.items() if np.ndim(value) == 0 and float(value) != 0.0]
    if isinstance(ship.model, Sampled):
        return (("coefficients.*", math.nan, tuple(path for path in known if path != "dt")),)
    shows = {"surge", *(("turn",) if any(kind.name in _TURNS for kind in kinds) else ())}
    shows |= {"wind"} if ship.model.feels_wind and any(map(blown, train)) else set()
    shows |= {"engine"} if any("n_P" in trial and (trial["n_P"] < 0.0).any() for trial in train) else set()
    known, back = _worked(ship, known, train)
    shows |= {"astern"} if back else set()
    out: list[tuple[str, float, tuple[str, ...]]] = []
    sigmas = stated(ship)
    taken: set[str] = set()
    for k, (pattern, prior, needs) in enumerate(_RULES):
        if any(other == f"{pattern.partition('.')[0]}.*" and need in shows for other, _, need in _RULES[k + 1 :]):
            continue  # a wider pattern follows, of the same prior
        paths = tuple(path for path in known if fnmatchcase(path, pattern) and path not in taken)
        # A pattern without a dot is of a model without parts.
        if "." not in pattern:
            paths = tuple(path for path in paths if "." not in path)
        own = all(path in sigmas for path in paths)
        if paths and needs in shows and (own or prior != OWN):
            # a pattern that takes others too, which state no sigma, would ask for theirs
            wide = own and any(fnmatchcase(path, pattern) and path not in sigmas for path in every)
            out += [(path, OWN, (path,)) for path in paths] if wide else [(pattern, OWN if own else prior, paths)]
            taken |= set(paths)
    if not out:
        raise StudyError(f"{ship.name}: no parameter that these recordings could tell; write [free] by hand")
    return tuple(out)


def _worked(ship: Ship, known: Sequence[str], train: Sequence[Trial]) -> tuple[list[str], bool]:
    """The parameters without those of thrusters that rest in all trials, and whether any thruster goes astern."""
    logs = {name: [trial[name] for trial in train if name in trial]
            for name in ship.model.controls if name.partition("_")[0] in ("n", "throttle")}  # fmt: skip
    moved = {name.partition("_")[2] for name, some in logs.items() if any(np.nanmax(np.abs(one)) > 0.0 for one in some)}
    rest = [path for path in known if not path.startswith("thrusters.") or path.split(".")[1] in moved]
    return rest, any(bool((one < 0.0).any()) for some in logs.values() for one in some)


def _clock(ship: Ship, trials: Iterable[Trial]) -> float:
    """L/U of the trials [s]."""
    starts = (begun(trial)[0] for trial in trials)
    fast = max((float(np.nanquantile(np.hypot(state[:, 3], state[:, 4]), 0.9)) for state in starts), default=0.0)
    return ship.L_pp / max(fast, 1e-3)


def _several(folder: Folder, usable: Mapping[str, Trial], kinds: Mapping[str, Kind]) -> Iterator[str]:
    """Recordings of several manoeuvres, of which whole days would be held out."""
    if found := [one for one, trial in usable.items() if manoeuvres(trial, kinds[one])]:
        yield (f"{', '.join(found)}: several manoeuvres in one recording; make a trial of each first: "
               f"seatrial trials {folder.root} --remedy steps.toml")  # fmt: skip


def _relative(path: Path, out: Path) -> str:
    """A path as the study names it: below the public data sets by their variable, else relative to the study."""
    home = os.environ.get(DATA)
    if home and path.resolve().is_relative_to(Path(home).resolve()):
        return f"${DATA}/{path.resolve().relative_to(Path(home).resolve()).as_posix()}"
    return Path(os.path.relpath(path.resolve(), out.resolve().parent)).as_posix()
