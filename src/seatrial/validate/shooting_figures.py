"""The figures of You 2023 for a study of shooting: errors by manoeuvre and by steps, servo, thrust, and estimates."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..data import Array, Trial
from ..identify.servo import ServoFit, answered
from ..identify.thrust_map import ThrustMap
from .figures import canvas, svg
from .shooting_cases import AS_SAILED, CALM, FULL, IGNORED, RIVAL, TRUTH, WIND_KNOWN, Case
from .shooting_scores import HORIZONS, VELOCITIES, Score

_DEGREES = math.degrees(1.0)
_AXES = {
    "x": ("x [m]", 1.0), "y": ("y [m]", 1.0), "psi": ("ψ [°]", _DEGREES), "u": ("u [m/s]", 1.0),
    "v_m": ("v_m [m/s]", 1.0), "r": ("r [°/s]", _DEGREES),
}  # fmt: skip
# Okabe and Ito's palette; dashes and marks carry the same distinction in print.
_STYLES: dict[str, dict[str, Any]] = {
    TRUTH: {"color": "#111", "ls": (0, (1, 1.5)), "marker": "x", "zorder": 3},
    FULL: {"color": "#0072B2", "ls": "-", "marker": "o", "zorder": 2.5},
    RIVAL: {"color": "#D55E00", "ls": (0, (6, 2)), "marker": "s"},
}
_FAR = 15.0
"""Errors beyond so many sigma are drawn on a logarithmic scale, so that those within three can be told apart."""
# One and the same in every report, whichever of the cases it has.
_MARKS = {AS_SAILED: ("#0072B2", "o"), WIND_KNOWN: ("#009E73", "D"), IGNORED: ("#E69F00", "^"), CALM: ("#CC79A7", "s")}


def steps(scores: Mapping[str, Score], names: Mapping[str, str], dt: float, what: str) -> str:
    """Root mean square error over the steps predicted (You 2023 Fig. 22); `names` by label of the score."""
    figure, axes = canvas(3, (5.2, 5.4))
    for ax, name in zip(axes, VELOCITIES, strict=True):
        label, factor = _AXES[name]
        for who, score in scores.items():
            ax.plot(HORIZONS, factor * score.steps[name], lw=1.4, ms=4, label=names[who], **_STYLES[who])
        ax.set_ylabel(label)
        ax.set_ylim(bottom=0.0)
    axes[-1].set_xlabel(f"steps predicted, {dt:g} s each")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False)
    figure.align_ylabels(axes)
    return svg(figure, f"steps {what}")


def runs(scores: Mapping[str, Score], names: Mapping[str, str]) -> str:
    """Root mean square error of each run (You 2023 Fig. 21), trials numbered in their order."""
    from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter, StrMethodFormatter

    figure, axes = canvas(3, (5.2, 5.4))
    for ax, name in zip(axes, VELOCITIES, strict=True):
        label, factor = _AXES[name]
        for who, score in scores.items():
            values = [factor * run[name] for run in score.runs.values()]
            style = _STYLES[who] | {"ls": "none"}
            ax.plot(range(1, len(values) + 1), values, ms=4.5, label=names[who], **style)
        ax.set_yscale("log")
        ax.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        ax.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        ax.yaxis.set_minor_formatter(NullFormatter())
        ax.set_ylabel(label)
    axes[-1].xaxis.set_major_locator(MaxNLocator(integer=True))
    axes[-1].set_xlabel("trial kept back, as numbered below")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False)
    figure.align_ylabels(axes)
    return svg(figure, "runs")


def estimates(cases: Sequence[Case]) -> str:
    """Estimate less truth over its standard deviation, a mark for each case."""
    paths = [f.path for f in cases[0].fits[FULL].free]
    figure, (ax,) = canvas(1, (5.2, 0.24 * len(paths) + 1.2))
    ax.axvspan(-3.0, 3.0, color="#eef2f5", zorder=0.5)
    ax.axvline(0.0, color="#b5bcc2", lw=1.0)
    for k, case in enumerate(cases):
        colour, mark = _MARKS[case.name]
        rows = np.arange(len(paths)) + 0.5 * ((k + 0.5) / len(cases) - 0.5)
        ax.plot(case.away, rows, mark, color=colour, ms=4.5, mfc=colour if k == 0 else "white", ls="none",
                label=case.name)  # fmt: skip
    farthest = max(float(np.abs(case.away).max()) for case in cases)
    if farthest > _FAR:
        ax.set_xscale("symlog", linthresh=3.0, linscale=1.5)
        ticks = [v for v in (0, 1, 3, 10, 30, 100, 300, 1000) if v < 2.0 * farthest]
        ax.set_xticks([-v for v in ticks[:0:-1]] + ticks, [f"{v:g}" for v in [-v for v in ticks[:0:-1]] + ticks])
        ax.minorticks_off()
    ax.set_yticks(range(len(paths)), [path.partition(".")[2] for path in paths])
    ax.set_ylim(len(paths) - 0.5, -0.5)
    ax.set_xlabel("(estimate − truth) / sigma; within 3 is shaded")
    figure.legend(*ax.get_legend_handles_labels(), loc="outside lower center", ncols=4, handletextpad=0.1,
                  columnspacing=1.0, frameon=False)  # fmt: skip
    return svg(figure, "estimates")


def motion(measured: Trial, predicted: Mapping[str, Trial], names: Mapping[str, str]) -> str:
    """Velocities of one trial over time, measured and predicted from its first state."""
    figure, axes = canvas(3, (5.2, 4.4))
    for ax, name in zip(axes, VELOCITIES, strict=True):
        label, factor = _AXES[name]
        ax.plot(measured.t, factor * measured[name], color="#c9d0d6", lw=3.6, label="measured")
        for who, trial in predicted.items():
            ax.plot(trial.t, factor * trial[name], lw=1.4, label=names[who], **_STYLES[who] | {"marker": ""})
        ax.set_ylabel(label)
    axes[-1].set_xlabel("time t [s]")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False)
    figure.align_ylabels(axes)
    return svg(figure, f"motion {measured.name}")


def servo(fit: ServoFit, trial: Trial) -> str:
    """Order, angle measured and angle of the servo over one log, and what is left (You 2023 Fig. 15)."""
    name = fit.control
    order, angle = trial[f"{name}_cmd"], trial[name]
    modelled = answered(fit, trial) + fit.offset
    figure, (above, below) = canvas(2, (5.2, 3.8))
    above.step(trial.t, _DEGREES * order, where="post", color="#8a8a8a", ls=(0, (1, 1.5)), lw=1.2, label="ordered")
    above.plot(trial.t, _DEGREES * angle, color="#111", lw=2.2, label="measured")
    above.plot(trial.t, _DEGREES * modelled, color="#56B4E9", ls=(0, (4, 1.5)), lw=1.4, label="servo")
    above.set_ylabel(f"{name} [°]")
    below.plot(trial.t, _DEGREES * (modelled - angle), color="#0072B2", lw=0.8)
    below.set_ylabel("servo − measured [°]")
    below.set_xlabel("time t [s]")
    figure.legend(*above.get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False)
    figure.align_ylabels((above, below))
    return svg(figure, f"servo {name}")


def thrust(fit: ThrustMap, n: Array, pull: Array, true: Array) -> str:
    """Pull by revolutions with the map, and both less the truth (You 2023 Fig. 14); `true` at the rows pulled."""
    figure, (above, below) = canvas(2, (5.2, 3.8))
    fine = np.linspace(0.0, fit.n_max, 200)
    above.plot(n, pull, "o", color="#111", mfc="white", ms=4.5, label="load cell")
    above.plot(fine, fit.thrust(fine), color="#0072B2", lw=1.5, label="map")
    above.set_ylabel("thrust [N]")
    below.axhline(0.0, color="#b5bcc2", lw=1.0)
    below.plot(n, pull - true, "o", color="#111", mfc="white", ms=4.5)
    below.plot(n, fit.thrust(n) - true, color="#0072B2", lw=1.5)
    below.set_ylabel("less the truth [N]")
    below.set_xlabel("revolutions n [1/s]")
    figure.legend(*above.get_legend_handles_labels(), loc="outside lower center", ncols=2, frameon=False)
    figure.align_ylabels((above, below))
    return svg(figure, f"thrust {fit.name}")
