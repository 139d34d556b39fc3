"""Noise account of the Esso Osaka tests: error from sensors, initial states, wind and current.  Writes a JSON file.

    SEATRIAL_DATA=DIR python studies/reports/noise_esso_osaka.py [-o noise_esso_osaka.json] [--only SECTION]

The low-speed MMG is fitted to four fifths of the files of each kind and judged on the rest, five times over, as
the common evaluator has it (restart every 100 s, sum over the states, mean over the samples).  Every setting of
a disturbance filter is chosen on the training files of its fold; figures are of the files held out.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from noise_disturbances import (
    Drift,
    averaged,
    coherence,
    correlation,
    drifted,
    fitted,
    lagged,
    memory,
    missing_acceleration,
    previous,
)
from noise_windows import (
    BODY,
    CURRENT,
    EARTH,
    WIND,
    Cut,
    Predictor,
    kinematic_floor,
    loss,
    scatter,
    sensor_floor,
    slow_velocity_error,
    smoothed,
    start_floor,
    white_noise,
)

import seatrial as st

KINDS, FOLDS, RESTART = ("random", "turning", "zigzag", "berthing"), 5, 100.0
# As the common evaluator steps and starts.
PROTOCOL = st.Trajectory(window=RESTART, every=10, method="euler", initial="measured")
COPY = "turn_cut_14-Sep-2020_15_58_08"  # repeats part of turn_14-Sep-2020_15_58_08
FREED = ("hull.*", "propeller.*", "rudder.*", "wind.*", "body.m_x", "body.m_y", "body.I_zG")
MEASURED = {"propeller.D_P", "propeller.pitch_ratio", "propeller.J_syn", "propeller.J_syn0", "rudder.A_R",
            "rudder.eta", "rudder.x_R", "wind.A_T", "wind.A_L", "wind.L_wind", "wind.rho_air"}  # fmt: skip
# Standard deviations before a window is seen: a current of 2 cm/s, half a metre per second of wind, 1 mm/s^2.
PRIORS = {"current": (CURRENT, 0.02), "wind": (WIND, 0.5), "acceleration": (BODY, 1e-3), "earth": (EARTH, 1e-3)}
WALKS = (0.0006, 0.0015)
RESTS = (0.2, 1.0)
SHARES = (0.0, 0.25, 0.5, 0.75, 1.0)
DRIFTS = tuple(Drift(a, b, c) for a in (3.0, 10.0, 30.0, 100.0) for b in (5.0, 10.0, 20.0, 60.0) for c in (0.5, 1.0))
DRIVEN, DRIVEN_OVER = (0.0, 0.0025, 0.005, 0.0075), 300.0
BANDS = ((0.0, 0.02), (0.02, 0.05), (0.05, 0.1))
SPANS = (1.0, 2.0, 3.0, 5.0, 10.0)

SECTIONS = (
    "fitted MMG", "sensors", "disturbances", "tracked current", "wind", "current driven by the wind",
    "current driven and tracked", "novelty",
)  # fmt: skip

Sets = Mapping[str, Sequence[st.Trial]]
Change = Callable[[int, Cut, Predictor], Cut]


def files(root: Path) -> dict[str, list[st.Trial]]:
    """The files of each kind in the order of the folds."""
    if not root.is_dir():
        sys.exit(f"{root}: no such folder; set SEATRIAL_DATA (public set NAOE-5thLab/FRT-DS-ESSO)")
    return {
        kind: [
            st.drop_trailing_gaps(st.reader("frt-esso")(f))
            for f in sorted((root / kind).glob("*.csv"))
            if f.stem != COPY
        ]
        for kind in KINDS
    }


@dataclass(frozen=True)
class Folds:
    """Five fitted ships, and the windows that each is judged on.

    Attributes:
        cut: all windows.
        fold: the fold that holds each window out, shape (lanes,).
        predictors: one for each fold, fitted to the others.
        ships: the same as ships.
    """

    cut: Cut
    fold: st.Array
    predictors: tuple[Predictor, ...]
    ships: tuple[st.Ship, ...]

    @staticmethod
    def of(ship: st.Ship, free: Sequence[st.Free], sets: Sets) -> Folds:
        """Fit, five times."""
        ships: list[st.Ship] = []
        for fold in range(FOLDS):
            train = tuple(t for some in sets.values() for i, t in enumerate(some) if i % FOLDS != fold)
            problem = st.Problem(ship, train, tuple(free), st.Loss(st.metrics.ESSO_OSAKA_SIGMA, correlation=5.0))
            ships.append(PROTOCOL.fit(problem).ship)
        cut = Cut.of(sets, ship, st.metrics.ESSO_OSAKA_SIGMA, RESTART)
        number = np.array([i % FOLDS for some in sets.values() for i, _ in enumerate(some)])
        return Folds(cut, number[cut.trial], Predictor.of(ships), tuple(ships))

    def errors(self, change: Change = lambda fold, cut, predictor: cut) -> st.Array:
        """Errors of every window by the ship that has not seen it, under what `change` makes of the windows."""
        out = np.zeros_like(self.cut.measured)
        for fold, predictor in enumerate(self.predictors):
            mine = np.flatnonzero(self.fold == fold)
            out[mine] = predictor.errors(change(fold, self.cut, predictor).lanes(mine))
        return out

    def loss(self, change: Change = lambda fold, cut, predictor: cut) -> dict[str, float]:
        """Standardised error by kind and of all."""
        return loss(self.cut, self.errors(change))

    def best(self, changes: Sequence[Change]) -> tuple[st.Array, list[int]]:
        """Errors with the change that serves each fold's training files best, and which that was."""
        out, picked = np.zeros_like(self.cut.measured), []
        for fold, predictor in enumerate(self.predictors):
            seen = np.flatnonzero(self.fold != fold)
            tried = [predictor.errors(change(fold, self.cut, predictor)) for change in changes]
            scores = [float((e[seen] ** 2).sum()) for e in tried]
            picked.append(int(np.argmin(scores)))
            out[self.fold == fold] = tried[picked[-1]][self.fold == fold]
        return out, picked

    def gain(self, errors: st.Array) -> dict[str, float]:
        """Change of the pooled error by these errors, and its standard deviation over the choice of files."""
        first, now = ((e**2).sum(axis=(1, 2)) for e in (self.errors(), errors))
        count = np.isfinite(self.cut.measured[..., 0]).sum(axis=1)
        files = np.unique(self.cut.trial)
        sums = np.array([[(now - first)[self.cut.trial == k].sum(), count[self.cut.trial == k].sum()] for k in files])
        drawn = np.random.default_rng(1).integers(0, len(files), (2000, len(files)))
        spread = sums[drawn].sum(axis=1)
        return {"change": float(sums[:, 0].sum() / sums[:, 1].sum()), "sd": float((spread[:, 0] / spread[:, 1]).std())}


def sensors(folds: Folds, sets: Sets) -> dict[str, Any]:
    """Noise of the readings and of the starts."""
    every = [trial for some in sets.values() for trial in some]
    white, coloured = white_noise(every), scatter(every)
    slow = np.concatenate([coloured[:3], np.maximum(coloured[3:], slow_velocity_error(every))])
    named = {"white": white, "5 s cubic": coloured, "positions": slow}
    out: dict[str, Any] = {
        "sd": {name: dict(zip(st.models.STATES, sd.tolist(), strict=True)) for name, sd in named.items()},
        "readings": {name: sensor_floor(sd, st.metrics.ESSO_OSAKA_SIGMA) for name, sd in named.items()},
        "kinematics": kinematic_floor(folds.cut), "start propagated": {}, "start smoothed": {},
    }  # fmt: skip
    for name, sd in named.items():
        squared = np.zeros_like(folds.cut.measured)
        for fold, predictor in enumerate(folds.predictors):
            mine = np.flatnonzero(folds.fold == fold)
            squared[mine] = start_floor(folds.cut.lanes(mine), predictor, sd)
        out["start propagated"][name] = loss(folds.cut, np.sqrt(squared))
    for span in SPANS:
        better = smoothed(folds.cut, every, span)
        out["start smoothed"][f"{span:g} s"] = folds.loss(lambda fold, cut, predictor, c=better: c)
    return out


def disturbances(folds: Folds) -> dict[str, Any]:
    """Constants in each window, those of the window before, and the filtered drift."""
    out: dict[str, Any] = {}
    for name, (channels, sd) in PRIORS.items():
        found, timid = ([fitted(folds.cut, predictor, channels, sd, rest) for predictor in folds.predictors]
                        for rest in RESTS)  # fmt: skip
        own = np.concatenate([np.flatnonzero(folds.fold == f) for f in range(FOLDS)])
        held = np.empty_like(found[0])
        held[own] = np.concatenate([found[f][folds.fold == f] for f in range(FOLDS)])
        carried, picked = folds.best([
            lambda fold, cut, predictor, s=s, c=channels, v=v: cut.adding(c, s * previous(cut, v[fold]))
            for v in (found, timid) for s in SHARES
        ])  # fmt: skip
        out[name] = {
            "window itself": folds.loss(lambda fold, cut, predictor, c=channels, v=found: cut.adding(c, v[fold])),
            "rms": np.sqrt((held**2).mean(axis=0)).tolist(), "memory": memory(folds.cut, held).tolist(),
            "window before": loss(folds.cut, carried), **folds.gain(carried),
            "rest and share": [(RESTS[k // len(SHARES)], SHARES[k % len(SHARES)]) for k in picked],
        }  # fmt: skip
    missing = [missing_acceleration(folds.cut, predictor) for predictor in folds.predictors]
    still = np.array([folds.fold[folds.cut.trial == k][0] for k in np.unique(folds.cut.trial)])
    own_missing = [missing[f][k] for k, f in enumerate(still.tolist())]
    carried, picked = folds.best([
        lambda fold, cut, predictor: cut,
        *(lambda fold, cut, predictor, d=d: d.carried(cut, missing[fold]) for d in DRIFTS),
    ])  # fmt: skip
    lags = (10.0, 20.0, 30.0, 50.0, 100.0)
    out["drift"] = {
        "filtered": loss(folds.cut, carried), **folds.gain(carried),
        "picked": [repr(DRIFTS[k - 1]) if k else "none" for k in picked],
        "correlation of 10 s means": {
            f"{lag:g} s": row for lag, row in zip(lags, correlation(own_missing, folds.cut.dt, 10.0, lags).tolist(),
                                                  strict=True)},
    }  # fmt: skip
    return out


def winds(ship: st.Ship, free: Sequence[st.Free], sets: Sets, folds: Folds) -> dict[str, Any]:
    """Other winds in place of the measured one, the model fitted anew to each, and the coherence."""
    changes: dict[str, Callable[[st.Trial], st.Trial]] = {
        "none": lambda t: t.having(U_T=np.zeros(len(t))), "mean of the file": lambda t: averaged(t, np.inf),
        **{f"mean of {s:g} s": lambda t, s=s: averaged(t, s) for s in (100.0, 30.0, 10.0, 3.0)},
        **{f"{s:+g} s": lambda t, s=s: lagged(t, s) for s in (-10.0, -3.0, -1.0, 1.0, 3.0, 10.0)},
    }  # fmt: skip
    out: dict[str, Any] = {"fitted anew": {name: _anew(ship, free, sets, c).loss() for name, c in changes.items()}}
    found = coherence(folds.cut, folds.predictors[0], BANDS)
    out["coherence"] = {
        "bands [Hz]": BANDS, "force of the wind and motion": found.before.tolist(),
        "force of the wind and what is left": found.after.tolist(), "power left": found.left.tolist(),
        "by chance": found.chance,
    }  # fmt: skip
    return out


def _anew(ship: st.Ship, free: Sequence[st.Free], sets: Sets, change: Callable[[st.Trial], st.Trial]) -> Folds:
    return Folds.of(ship, free, {kind: [change(t) for t in some] for kind, some in sets.items()})


def driven(ship: st.Ship, free: Sequence[st.Free], sets: Sets, folds: Folds) -> dict[str, Any]:
    """A surface current driven by the wind of the past, the model fitted anew; then the filtered drift on top."""
    tried = [folds, *(_anew(ship, free, sets, lambda t, k=k: drifted(t, k, DRIVEN_OVER)) for k in DRIVEN[1:])]
    out: dict[str, Any] = {f"{100 * k:g} % of the wind": one.loss() for k, one in zip(DRIVEN, tried, strict=True)}
    plain, both = np.zeros_like(folds.cut.measured), np.zeros_like(folds.cut.measured)
    picked: list[float] = []
    for fold in range(FOLDS):
        seen, mine = folds.fold != fold, folds.fold == fold
        errors = [one.predictors[fold].errors(one.cut) for one in tried]
        k = int(np.argmin([(e[seen] ** 2).sum() for e in errors]))
        picked.append(DRIVEN[k])
        missing = missing_acceleration(tried[k].cut, tried[k].predictors[fold])
        over = [tried[k].predictors[fold].errors(d.carried(tried[k].cut, missing)) for d in DRIFTS]
        best = min(over, key=lambda e: float((e[seen] ** 2).sum()))
        plain[mine], both[mine] = errors[k][mine], best[mine]
    return {
        **out, "picked": picked, "current": {**loss(folds.cut, plain), **folds.gain(plain)},
        "current and drift": {**loss(folds.cut, both), **folds.gain(both)},
    }  # fmt: skip


@dataclass(frozen=True)
class Speeds:
    """u and v_m over ground, as the set's own filter gives them."""

    angle: ClassVar[bool] = False

    sd: float
    delay: float = 0.0
    channels: tuple[str, ...] = ("u", "v_m")

    def read(
        self, state: tuple[st.parameters.Scalar, ...], environment: st.environment.Environment
    ) -> tuple[st.parameters.Scalar, ...]:
        """Along and across [m/s]."""
        return state[3], state[4]


def tracked(sets: Sets, folds: Folds) -> dict[str, Any]:
    """A current that walks, tracked by an extended Kalman filter up to each restart, and carried into the window.

    The filter sees every fifth row.  Walk and share are chosen by the files that the other folds hold out.
    """
    every = [(i % FOLDS, trial) for some in sets.values() for i, trial in enumerate(some)]
    found: dict[float, st.Array] = {}
    for walk in WALKS:
        kalman = st.Kalman(
            {"gnss": st.Antenna(0.01), "compass": st.Heading(0.003), "gyro": st.Rate(0.0005), "speeds": Speeds(0.002)},
            process={"u": 0.005, "v_m": 0.003, "r": 0.0015, "current": walk}, current=True,
            start={f"environment.{name}": (0.0, 0.005) for name in CURRENT},
        )  # fmt: skip
        trackers = [kalman.prepared(ship) for ship in folds.ships]
        found[walk] = np.zeros((len(folds.cut.label), 2))
        for k, (fold, trial) in enumerate(every):
            run = trackers[fold].run(trial.rows(slice(None, None, 5)))
            places = [run.names.index(f"environment.{name}") for name in CURRENT]
            mine = np.flatnonzero(folds.cut.trial == k)
            found[walk][mine] = run.states[folds.cut.row[mine] // 5][:, places]
    settings = [(walk, share) for walk in WALKS for share in SHARES]
    errors = [
        folds.errors(lambda fold, cut, predictor, w=w, s=s: cut.adding(CURRENT, s * found[w])) for w, s in settings
    ]
    best, picked = np.zeros_like(errors[0]), []
    for fold in range(FOLDS):
        k = int(np.argmin([(e[folds.fold != fold] ** 2).sum() for e in errors]))
        picked.append(settings[k])
        best[folds.fold == fold] = errors[k][folds.fold == fold]
    return {
        "carried": loss(folds.cut, best), **folds.gain(best), "walk and share": picked,
        "rms": {f"{w:g}": np.sqrt((v**2).mean(axis=0)).tolist() for w, v in found.items()},
        "all settings": {f"walk {w:g}, share {s:g}": loss(folds.cut, e)["all"]
                         for (w, s), e in zip(settings, errors, strict=True)},
    }  # fmt: skip


def driven_and_tracked(ship: st.Ship, free: Sequence[st.Free], sets: Sets) -> dict[str, Any]:
    """The tracked current on top of one of 0.75 % of the wind, which the training files of every fold choose."""
    windy = {kind: [drifted(t, 0.0075, DRIVEN_OVER) for t in some] for kind, some in sets.items()}
    folds = Folds.of(ship, free, windy)
    return {"driven": folds.loss(), **tracked(windy, folds)}


def novelty(sets: Sets, folds: Folds) -> dict[str, Any]:
    """Whether windows that leave the training data are predicted worse."""
    far = np.full(len(folds.cut.label), np.nan)
    every = [(i % FOLDS, trial) for some in sets.values() for i, trial in enumerate(some)]
    for fold in range(FOLDS):
        reference = st.coverage.Reference.of([trial for f, trial in every if f != fold])
        for k, (f, trial) in enumerate(every):
            if f == fold:
                found = st.coverage.coverage(reference, trial)
                for lane in np.flatnonzero(folds.cut.trial == k):
                    a = folds.cut.row[lane]
                    far[lane] = found.novelty[a : a + folds.cut.series.shape[1]].mean()
    count = np.isfinite(folds.cut.measured[..., 0]).sum(axis=1)
    each = (folds.errors() ** 2).sum(axis=(1, 2))
    edges = np.quantile(far, (0.0, 0.25, 0.5, 0.75, 0.9, 1.0))
    place = np.clip(np.searchsorted(edges, far, "right") - 1, 0, len(edges) - 2)
    return {
        "mean novelty of the window": [[float(edges[k]), float(edges[k + 1])] for k in range(len(edges) - 1)],
        "error": [float(each[place == k].sum() / count[place == k].sum()) for k in range(len(edges) - 1)],
        "windows": [int((place == k).sum()) for k in range(len(edges) - 1)],
    }


def main() -> None:
    """Everything, in the order of the page docs/noise-esso-osaka.md."""
    asked = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    asked.add_argument("-o", "--out", type=Path, default=Path("noise_esso_osaka.json"))
    asked.add_argument("--only", choices=SECTIONS, help="renew one section of the file")
    given = asked.parse_args()
    data = Path(os.environ.get("SEATRIAL_DATA", Path(__file__).parents[3] / "shared" / "data"))
    sets = files(data / "esso_osaka_frt" / "data")
    ship = st.load("esso_osaka_3m")
    free = tuple(f for f in st.free_everywhere(ship, FREED, 0.3) if f.path not in MEASURED)
    folds = Folds.of(ship, free, sets)
    sections: dict[str, Callable[[], dict[str, Any]]] = {
        "fitted MMG": folds.loss, "sensors": lambda: sensors(folds, sets),
        "disturbances": lambda: disturbances(folds), "tracked current": lambda: tracked(sets, folds),
        "wind": lambda: winds(ship, free, sets, folds),
        "current driven by the wind": lambda: driven(ship, free, sets, folds),
        "current driven and tracked": lambda: driven_and_tracked(ship, free, sets),
        "novelty": lambda: novelty(sets, folds),
    }  # fmt: skip
    found: dict[str, Any] = {
        "what": "standardised error of FRT-DS-ESSO by kind, five folds, restart 100 s; see docs/noise-esso-osaka.md",
        "command": "SEATRIAL_DATA=DIR python studies/reports/noise_esso_osaka.py",
    }
    if given.only and given.out.exists():
        found |= json.loads(given.out.read_text(encoding="utf-8"))
    for name in [given.only] if given.only else sections:
        found[name] = sections[name]()
        sys.stderr.write(f"{name}\n")
    given.out.write_text(json.dumps(found, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    sys.stdout.write(f"wrote {given.out}\n")


if __name__ == "__main__":
    main()
