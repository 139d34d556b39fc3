"""The figures of Wakita 2022 for any series of fits: validation curves (Fig. 4), tracks of all seeds (Figs. 6 to 8)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from . import Comparison
from .figures import canvas, legend_below, svg
from .metrics import segments
from .network_scores import Standing

# Okabe and Ito's palette, with a dash for each, so that print without colour tells them apart.
_LINES: tuple[tuple[str, Any], ...] = (
    ("#0072B2", "-"), ("#D55E00", (0, (6, 2))), ("#009E73", (0, (3, 1.5))), ("#CC79A7", (0, (1, 1))),
    ("#E69F00", (0, (6, 1.5, 1, 1.5))), ("#56B4E9", (0, (2, 2))),
)  # fmt: skip
_SMALL = (4.6, 3.0)
# Along a logarithmic axis: up to which ratio of its ends every tick has a number, and up to which these have.
_SHORT, _LONG, _ROUND = 2.5, 100.0, ("2.0", "3.0", "5.0")
_GREY = "#8a8a8a"


def validation(standing: Standing) -> str:
    """Loss of the validation windows over the epochs, a line for each seed; the circle is what was kept."""
    figure, (ax,) = canvas(1, _SMALL)
    for k, member in enumerate(standing.members):
        colour, dashes = _LINES[k % len(_LINES)]
        epochs, loss, watched = member.history[:, 0], member.history[:, 1], member.history[:, 2]
        seen = watched if np.isfinite(watched).any() else loss
        ax.plot(epochs, seen, color=colour, ls=dashes, lw=1.4,
                label="validation" if member.seed is None else f"seed {member.seed}")  # fmt: skip
        best = int(np.nanargmin(seen))
        ax.plot(epochs[best], seen[best], "o", color=colour, mfc="white", ms=5)
    ax.set_yscale("log")
    _in_digits(ax.yaxis)
    ax.set_xlabel("epoch")
    ax.xaxis.get_major_locator().set_params(integer=True)
    ax.set_ylabel("validation loss [-]")
    ax.legend(loc="best", ncols=2, frameon=False)
    return svg(figure, f"validation {standing.key}")


def seeds(standings: Sequence[Standing], test: str) -> str:
    """North over east of one trial at equal scale: measured, and every seed of each model."""
    figure, (ax,) = canvas(1)
    for k, standing in enumerate(standings):
        colour, dashes = _LINES[k % len(_LINES)]
        runs = [one[test] for one in standing.every if one.get(test) is not None]
        for number, run in enumerate(runs):
            if run is not None:
                label = f"{standing.title}, {len(runs)} seeds" if len(runs) > 1 else standing.title
                east, north = _broken(run)
                ax.plot(east, north, color=colour, ls=dashes, lw=1.1, label="_" if number else label)
    measured = _measured(standings, test)
    ax.plot(measured["y"], measured["x"], color="#111", lw=1.6, label="measured", zorder=2.5)
    ax.plot(measured["y"][:1], measured["x"][:1], "o", color="#111", mfc="white", ms=6, zorder=3)
    middle = [0.5 * float(np.nanmin(measured[n]) + np.nanmax(measured[n])) for n in ("y", "x")]
    half = 0.75 * max(float(np.ptp(measured[n])) for n in ("y", "x"))
    ax.set_xlim(middle[0] - 1.15 * half, middle[0] + 1.15 * half)
    ax.set_ylim(middle[1] - half, middle[1] + half)
    ax.set_aspect("equal", adjustable="box")
    ax.set_xlabel("east y [m]")
    ax.set_ylabel("north x [m]")
    legend_below(figure, ax)
    return svg(figure, f"seeds {test}")


def bars(names: Sequence[str], values: Mapping[str, Sequence[float]], what: str) -> str:
    """One mark for each name and label along a logarithmic axis; what is not finite is left out."""
    figure, (ax,) = canvas(1, (5.2, 0.34 * len(names) + 1.2))
    places = np.arange(len(names))
    for k, (label, found) in enumerate(values.items()):
        colour, _ = _LINES[k % len(_LINES)]
        ax.plot(found, places, "osD^vP"[k % 6], color=colour, ms=5, ls="none", label=label, alpha=0.9)
    ax.set_xscale("log")
    _in_digits(ax.xaxis)
    ax.set_yticks(places, names)
    ax.set_ylim(len(names) - 0.5, -0.5)
    ax.set_xlabel(what)
    figure.legend(*ax.get_legend_handles_labels(), loc="outside lower center", ncols=3, handletextpad=0.1,
                  frameon=False)  # fmt: skip
    return svg(figure, f"bars {what}")


def _in_digits(axis: Any) -> None:
    """Numbers along a drawn logarithmic axis as one reads them; between the powers of ten where these are few."""
    from matplotlib.ticker import FuncFormatter

    low, high = axis.get_view_interval()

    def digits(value: float, _: object = None) -> str:
        return f"{value:.6g}"

    def between(value: float, _: object = None) -> str:
        told = high < _SHORT * low or (high < _LONG * low and f"{value:e}"[:3] in _ROUND)
        return digits(value) if told else ""

    axis.set_major_formatter(FuncFormatter(digits))
    axis.set_minor_formatter(FuncFormatter(between))


def _measured(standings: Sequence[Standing], test: str) -> Any:
    found = (one[test] for standing in standings for one in standing.every)
    return next(run for run in found if run is not None).measured


def _broken(run: Comparison) -> tuple[Any, Any]:
    """The predicted track, interrupted where it begins anew."""
    gaps = np.flatnonzero(np.diff(segments(run.measured.t, run.restart))) + 1
    return tuple(np.insert(run.predicted[name], gaps, np.nan) for name in ("y", "x"))  # type: ignore[return-value]
