"""What the past could take away of the error of the Esso Osaka's hybrid: laws that carry on, and oracles.

    SEATRIAL_DATA=DIR python benchmarks/history_limits.py [-o history_limits.json]

Five outer folds by kind; each is predicted by a fit to the other four.  What a law has to learn it learns on trials of
those four, each predicted by a fit that has seen neither it nor the outer fold.  Oracles are fitted to what they
predict and say what no law of their form can go below.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from seatrial.data import Array
from seatrial.engine.rollout import Simulator, simulator
from seatrial.identify.record import Record, even
from seatrial.models import STATES
from seatrial.ships import Ship
from seatrial.simulate.carried import beyond, disturbed
from seatrial.simulate.loop import open_loop_parameters
from seatrial.study.study import Study, read_study
from seatrial.validate.metrics import ESSO_OSAKA_SIGMA

sys.path.insert(0, str(Path(__file__).parents[1] / "examples"))
from hybrid_folds import KINDS, STUDY, Files, read_files

HERE = Path(__file__).parent / "results" / "history_limits.json"
FOLDS = 5
WIDTHS = (0.3, 1.0)  # the residual in full: with the physics alone among them the error by turns is larger
STEPS, EVERY, DT = 1001, 10, 0.1
SIGMA = np.array([ESSO_OSAKA_SIGMA[name] for name in STATES])
# Inputs that may be off, with a small step of each.
INPUTS = {"d_u": 1e-4, "d_v_m": 1e-4, "d_r": 1e-4, "current_x": 2e-3, "current_y": 2e-3}
ACCELERATIONS = ("d_u", "d_v_m", "d_r")
# Time constants of the means over the past, of the fading, and weights of the ridge; restarts of trials to learn from.
MEANS, FADES, RIDGES, STRIDE = (2.0, 8.0, 20.0, 60.0), (5.0, 20.0, 1e9), (0.1, 1.0, 10.0, 100.0, 1e3), 25.0


@dataclass(frozen=True)
class Windows:
    """Windows of 100 s of some trials, predicted by a fit that has not seen them."""

    code: Simulator
    parameters: Array
    begun: Array
    lanes: Array
    measured: Array
    trial: Array
    first: Array
    means: Array  # of what acted before, (windows, means, 3)
    count: Array

    @staticmethod
    def of(ship: Ship, trials: Sequence[Any], stride: float) -> Windows:
        """Cut the trials; `stride` in seconds."""
        code, parameters = simulator(disturbed(ship)), open_loop_parameters(ship)
        found: list[tuple[Any, ...]] = []
        for number, trial in enumerate(trials):
            record = Record.of(even(trial, DT), ship.model)
            state = np.hstack([record.bridged, record.hidden])
            acting = np.hstack([record.series, np.zeros((len(state), 3))])
            acted = beyond(code, parameters, DT * np.arange(len(state), dtype=np.float64), state, acting)
            for begin in range(int(record.complete[0]), record.last, round(stride / DT)):
                rows = np.arange(begin, begin + STEPS)
                inside = (rows <= record.last) & (rows < begin + STEPS - 1)
                held = np.minimum(rows, record.last)
                past = acted[max(begin - 600, 0) : begin]
                age = DT * (np.arange(len(past))[::-1] + 0.5)
                means = [(np.exp(-age / tau) * DT / tau) @ past for tau in MEANS]
                measured = np.where(inside[:, None], record.state[held], np.nan)
                found.append((state[begin], acting[held], measured, number, begin == record.complete[0], means,
                              int(inside.sum())))  # fmt: skip
        return Windows(code, parameters, *(np.array(column) for column in zip(*found, strict=True)))

    def errors(self, names: Sequence[str] = (), off: Array | None = None, fade: float = np.inf) -> Array:
        """Standardised errors every second, inputs off by (windows, names); zero where a window is over."""
        lanes = self.lanes.copy()
        fading = np.exp(-DT * np.arange(STEPS) / fade)
        for k, name in enumerate(names):
            lanes[:, :, self.code.system.series.index(name)] += np.asarray(off)[:, k, None] * fading
        run = self.code.stored(self.begun, lanes, self.parameters, dt=DT, every=EVERY, steps=STEPS, method="euler")
        return np.nan_to_num((run[:, :, : len(STATES)] - self.measured[:, ::EVERY]) / SIGMA)

    def slopes(self, names: Sequence[str], fade: float = np.inf, at: Array | None = None) -> Array:
        """Change of the errors by a small step of each input, shape (windows, rows, 6, names)."""
        at = np.zeros((len(self.begun), len(names))) if at is None else at
        plain = self.errors(names, at, fade)
        each = [self.errors(names, at + INPUTS[n] * np.eye(len(names))[k], fade) for k, n in enumerate(names)]
        return np.stack([one - plain for one in each], axis=-1)


def cost(e: Array) -> float:
    """Sum over the samples, of which every tenth is taken."""
    return EVERY * float((e**2).sum())


def oracle(cut: Windows, names: Sequence[str], groups: Array) -> Array:
    """Squared error of each window, constant inputs of each group fitted to it by damped Gauss-Newton steps."""
    many = int(groups.max()) + 1
    step = np.array([INPUTS[name] for name in names])
    off, damping = np.zeros((many, len(names))), np.full(many, 1e-3)

    def squares(off: Array) -> Array:
        return (cut.errors(names, off[groups]) ** 2).sum(axis=(1, 2))

    now = np.bincount(groups, squares(off), many)
    for _ in range(8):
        e, J = cut.errors(names, off[groups]), cut.slopes(names, at=off[groups])
        A, b = np.zeros((many, len(names), len(names))), np.zeros((many, len(names)))
        np.add.at(A, groups, np.einsum("wtcp,wtcq->wpq", J, J))
        np.add.at(b, groups, np.einsum("wtcp,wtc->wp", J, e))
        held = A + (damping[:, None] * np.einsum("gpp->gp", A) + 1e-9)[:, :, None] * np.eye(len(names))
        then = off - np.linalg.solve(held, b[..., None])[..., 0] * step
        after = np.bincount(groups, squares(then), many)
        better = after < now
        off, now = np.where(better[:, None], then, off), np.where(better, after, now)
        damping = np.where(better, damping / 3.0, damping * 8.0)
    return squares(off)


def law(cut: Windows) -> Array:
    """What each term of a linear law does to the errors: means of the past, carried on and fading."""
    terms: list[Array] = []
    for fade in FADES:
        slopes = cut.slopes(ACCELERATIONS, fade)
        for k, name in enumerate(ACCELERATIONS):
            terms += [cut.means[:, m, k, None, None] / INPUTS[name] * slopes[..., k] for m in range(len(MEANS))]
    return np.stack(terms, axis=-1)


def fitted(cuts: Sequence[Windows], ridge: float, *, robust: bool) -> Array:
    """Coefficients of the law on some windows; robust: those with large errors count less."""
    A, b = np.zeros((36, 36)), np.zeros(36)
    for cut in cuts:
        e, X = cut.errors(), law(cut)
        size = (e**2).sum(axis=(1, 2)) / np.maximum(cut.count, 1)
        weight = 1.0 / (1.0 + size / np.median(size)) if robust else np.ones(len(e))
        A += np.einsum("wtcj,wtck,w->jk", X, X, weight)
        b += np.einsum("wtcj,wtc,w->j", X, e, weight)
    return -np.linalg.solve(A + ridge * np.diag(np.diag(A)), b)


def others(cut: Windows, ridge: float) -> float:
    """Squared error where constant inputs of a trial are those of all its other windows, earlier and later."""
    J, e = cut.slopes(tuple(INPUTS)), cut.errors()
    A, b = np.einsum("wtcp,wtcq->wpq", J, J), np.einsum("wtcp,wtc->wp", J, e)
    usual, total = np.diag(A.mean(axis=0)), 0.0
    for k in range(len(e)):
        rest = (cut.trial == cut.trial[k]) & (np.arange(len(e)) != k)
        off = -np.linalg.solve(A[rest].sum(axis=0) + ridge * np.diag(usual), b[rest].sum(axis=0))
        moved = np.where(e[k] == 0.0, 0.0, e[k] + J[k] @ off)
        total += cost(moved)
    return total


def fits(study: Study, files: Files) -> dict[tuple[int, ...], Ship]:
    """The hybrid without each fold, and without each two."""
    who: Any = replace(study.estimator, widths=WIDTHS)
    found: dict[tuple[int, ...], Ship] = {}
    for left in [*((k,) for k in range(FOLDS)), *combinations(range(FOLDS), 2)]:
        train = tuple(t for kind in KINDS for i, t in enumerate(files[kind]) if i % FOLDS not in left)
        problem = replace(study.problem, trials=train)
        values = np.mean([one for _, (one, _) in zip(who.widths, who.each(problem), strict=True)], axis=0)
        found[left] = problem.ship.having(problem.vector.by_path(values))
        sys.stderr.write(f"fitted without {' '.join(map(str, left))}\n")
    return found


def measured(ships: dict[tuple[int, ...], Ship], files: Files) -> dict[str, float]:
    """Pooled errors by what is known."""
    held = [[t for kind in KINDS for i, t in enumerate(files[kind]) if i % FOLDS == f] for f in range(FOLDS)]
    test = [Windows.of(ships[(f,)], held[f], 100.0) for f in range(FOLDS)]
    seen = {(f, g): Windows.of(ships[min(f, g), max(f, g)], held[g], STRIDE)
            for f in range(FOLDS) for g in range(FOLDS) if g != f}  # fmt: skip
    inner = {key: Windows.of(ships[min(key), max(key)], held[key[1]], 100.0) for key in seen}
    samples = sum(int(cut.count.sum()) for cut in test)
    found = {"nothing of the past": sum(cost(cut.errors()) for cut in test),
             "of it in the first window of each trial": sum(cost(cut.errors()[cut.first]) for cut in test)}  # fmt: skip
    for names in (("d_v_m", "d_r"), ACCELERATIONS, tuple(INPUTS)):
        text = " ".join(names)
        found[f"oracle, constant in a trial: {text}"] = sum(EVERY * oracle(c, names, c.trial).sum() for c in test)
        own = [EVERY * oracle(cut, names, np.arange(len(cut.begun))) for cut in test]
        found[f"oracle, constant in a window: {text}"] = sum(one.sum() for one in own)
        plain = sum(cost(cut.errors()[cut.first]) for cut in test)
        found[f"the same, nothing in the first of a trial: {text}"] = plain + sum(
            one[~cut.first].sum() for one, cut in zip(own, test, strict=True))  # fmt: skip
    learned, constant = 0.0, 0.0
    for f, cut in enumerate(test):
        folds = [g for g in range(FOLDS) if g != f]
        weights = fitted([seen[f, g] for g in folds], 0.1, robust=True)
        learned += cost(cut.errors() + law(cut) @ weights)
        best = min(RIDGES, key=lambda ridge: sum(others(inner[f, g], ridge) for g in folds))
        constant += others(cut, best)
    found["linear law of 36 terms, learned on the other folds"] = learned
    weights = fitted(test, 1e-3, robust=False)
    found["the same, fitted to what it predicts"] = sum(cost(cut.errors() + law(cut) @ weights) for cut in test)
    found["constant in a trial, from all its other windows"] = constant
    return {name: float(value) / samples for name, value in found.items()}


def main() -> None:
    """Measure, print and write."""
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("-o", "--out", type=Path, default=HERE)
    where: Path = asked.parse_args().out
    files = read_files()
    found = measured(fits(read_study(STUDY), files), files)
    told = {"what": "standardised error of files held out, five folds, restart 100 s, every tenth sample",
            "command": "SEATRIAL_DATA=DIR python benchmarks/history_limits.py", **found}  # fmt: skip
    where.write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")
    for name, value in found.items():
        sys.stdout.write(f"{value:.4f} {name}\n")


if __name__ == "__main__":
    main()
