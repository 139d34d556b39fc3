"""The figures of Suyama 2023 for any fine-tuning: search, objective over range, places in the range, tracks."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..data import Trial, unwrapped
from ..identify.tuned import Method, Range, Tuning
from .figures import canvas, svg

MEASURED, UNTUNED = "measured", "untuned"
# Okabe and Ito's palette, with a dash and a mark for each, so that print without colour tells them apart.
_LINES: tuple[tuple[str, Any, str], ...] = (
    ("#56B4E9", (0, (1, 1)), "o"), ("#CC79A7", (0, (3, 1.5)), "s"), ("#D55E00", (0, (6, 2)), "^"),
    ("#009E73", (0, (6, 1.5, 1, 1.5)), "D"), ("#0072B2", "-", "v"), ("#E69F00", (0, (8, 3)), "P"),
)  # fmt: skip
_STATES = (("psi", "ψ [°]"), ("u", "u [m/s]"), ("v_m", "v_m [m/s]"), ("r", "r [°/s]"))
_LEAST = 1e-14


def search(method: Method, name: str) -> str:
    """Best objective of each generation, and what it is above the best of all (Suyama 2023 Fig. 4)."""
    figure, (above, below) = canvas(2)
    rows = method.history
    above.plot(rows[:, 0], rows[:, 1], color="#0072B2", lw=1.0)
    above.set_yscale("log")
    above.set_ylabel("J, best of generation")
    least = float(rows[:, 1].min())
    over = np.maximum(rows[:, 1] - least, _LEAST * max(abs(least), 1e-300))
    below.plot(rows[:, 0], over, color="#0072B2", lw=1.0)
    below.set_yscale("log")
    below.set_ylabel("J − best J")
    below.set_xlabel("generation, all runs one after the other")
    figure.align_ylabels((above, below))
    return svg(figure, f"search {name}")


def objectives(tuning: Tuning) -> str:
    """Loss of the tuning and of the test trials over the range (Suyama 2023 Figs. 5 and 6)."""
    figure, axes = canvas(2 if tuning.tests else 1)
    ratios, ranges = [r.ratio for r in tuning.ranges], tuning.ranges
    curves = [
        ("tuning trials", (("box", [r.tune for r in ranges]), ("each left out, box", [r.left_out for r in ranges]),
                           ("soft", [r.soft_tune for r in ranges]),
                           ("each left out, soft", [r.soft_left_out for r in ranges])), tuning.untuned_tune),
        ("test trials", (("box", [r.test for r in ranges]), ("soft", [r.soft_test for r in ranges])),
         tuning.untuned_test),
    ]  # fmt: skip
    styles = {"box": 4, "soft": 2, "each left out, box": 3, "each left out, soft": 1}
    for ax, (title, drawn, untuned) in zip(axes, curves, strict=False):
        for label, losses in drawn:
            colour, dashes, mark = _LINES[styles[label]]
            total = [sum(loss.values()) for loss in losses]
            ax.plot(ratios, total, color=colour, ls=dashes, marker=mark, ms=5, lw=1.4, label=label)
        ax.axhline(sum(untuned.values()), color="#8a8a8a", ls=(0, (1, 1.5)), lw=1.2, label="untuned")
        ax.axvline(tuning.best.ratio, color="#f0d9a8", lw=6, zorder=0.5)
        ax.set_yscale("log")
        ax.set_ylabel(f"J, {title}")
        ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
    axes[-1].set_xticks(ratios, [f"{r:g}" for r in ratios])
    axes[-1].set_xlabel("range a_r (the chosen one shaded)")
    return svg(figure, "objectives")


def positions(ranges: Sequence[Range]) -> str:
    """Place of each parameter in its range, -1 to +1 (Suyama 2023 Fig. 7); filled marks are at an end."""
    figure, (ax,) = canvas(1, (5.2, 0.42 * len(ranges[0].free) + 1.2))
    paths = [f.path for f in ranges[0].free]
    for k, r in enumerate(ranges):
        colour, _, mark = _LINES[k % len(_LINES)]
        rows = np.arange(len(paths)) + 0.6 * ((k + 0.5) / len(ranges) - 0.5)
        stuck = np.array([path in r.at_bound for path in paths])
        for filled in (True, False):
            some = stuck == filled
            ax.plot(r.position[some], rows[some], mark, color=colour, ms=6, mfc=colour if filled else "white",
                    ls="none", label=f"a_r {r.ratio:g}" if not filled else None, clip_on=False)  # fmt: skip
    for end in (-1.0, 1.0):
        ax.axvline(end, color="#555", lw=1.0)
    ax.axvline(0.0, color="#b5bcc2", lw=1.0)
    for edge in range(1, len(paths)):
        ax.axhline(edge - 0.5, color="#e4e7ea", lw=0.8)
    ax.grid(False)
    ax.set_yticks(range(len(paths)), paths)
    ax.set_ylim(len(paths) - 0.5, -0.5)
    ax.set_xlim(-1.05, 1.05)
    ax.set_xlabel("place in the range (filled: at its end)")
    figure.legend(*ax.get_legend_handles_labels(), loc="outside lower center", ncols=5, handletextpad=0.1,
                  columnspacing=1.0, frameon=False)  # fmt: skip
    return svg(figure, "positions")


def tracks(measured: Trial, predicted: Mapping[str, Trial]) -> str:
    """North over east at equal scale: measured, untuned and each range (Suyama 2023 Figs. 8 to 11, left)."""
    figure, (ax,) = canvas(1)
    for label, trial in predicted.items():
        ax.plot(trial["y"], trial["x"], label=label, **_style(label, predicted))
    ax.plot(measured["y"], measured["x"], color="#111", lw=1.8, label=MEASURED, zorder=2.5)
    ax.plot(measured["y"][:1], measured["x"][:1], "o", color="#111", mfc="white", ms=6, zorder=3)
    ax.set_aspect("equal", adjustable="datalim")
    ax.set_xlabel("east y [m]")
    ax.set_ylabel("north x [m]")
    ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
    return svg(figure, f"tracks {measured.name}")


def motions(measured: Trial, predicted: Mapping[str, Trial]) -> str:
    """Heading, speeds and rate of turn over time (Suyama 2023 Figs. 8 to 11, right)."""
    figure, axes = canvas(len(_STATES))
    for ax, (channel, label) in zip(axes, _STATES, strict=True):
        factor = math.degrees(1.0) if channel in ("psi", "r") else 1.0
        for name, trial in predicted.items():
            ax.plot(trial.t, factor * trial[channel], **_style(name, predicted))
        truth = unwrapped(measured[channel]) if channel == "psi" else measured[channel]
        ax.plot(measured.t, factor * truth, color="#111", lw=1.5, zorder=2.5)
        ax.set_ylabel(label)
    axes[-1].set_xlabel("time t [s]")
    figure.align_ylabels(axes)
    return svg(figure, f"motions {measured.name}")


def _style(label: str, all_: Mapping[str, Trial]) -> dict[str, Any]:
    if label == UNTUNED:
        return {"color": "#8a8a8a", "ls": (0, (1, 1.5)), "lw": 1.4}
    others = [name for name in all_ if name != UNTUNED]
    colour, dashes, _ = _LINES[others.index(label) % len(_LINES)]
    return {"color": colour, "ls": dashes, "lw": 1.3}
