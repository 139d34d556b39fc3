"""Section of a fit's page on its residuals: whether the model explains the data, why not, and what to do next."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..data import Array
from ..identify import Fit
from ..identify.posterior.diagnosis import Diagnosis, Residuals
from . import figures
from .page import bullets, figure, gallery, lead, number, soft, table

_LAGS = 20
_POINTS = 1500
_LISTED = 8


def verdict(fit: Fit) -> str:
    """Whether the result can be trusted and what to do next: the first lines of the page; empty if not tested."""
    found = fit.diagnosis
    if found is None:
        return ""
    if not found.lacking:
        return lead("The model explains the data: what it leaves looks like sensor noise.")
    if found.causes:
        first = found.causes[0]
        remedy = (f"The likeliest cause: {first.text}. Check the instrument, or estimate its error: --free-suspects, "
                  f"or \"{first.name}\" in [nuisance.common].")  # fmt: skip
    else:
        remedy = "No error of an instrument accounts for it: a term of the model, or an input, is missing."
    return lead(
        "The model does not explain the data. Sigma has been widened, and no parameter counts as identified. " + remedy
    )


def section(fit: Fit) -> str:
    """Residuals, suspects and outliers of a fit; empty where it was not tested."""
    found = fit.diagnosis
    if found is None:
        return ""
    return (
        bullets(found.lines) + _channels(found) + _suspects(found) + _fixed(found)
        + (gallery(figure(_drawing(found), "Residuals over the sensor noise: over time, their distribution beside that "
                          "of white noise, their correlation, and against the control"), least=900)
           if found.residuals else "")
    )  # fmt: skip


def _channels(found: Diagnosis) -> str:
    rows = [[name, number(c.noise, 2), number(c.size, 3), number(c.alike, 2), str(c.count)]
            for name, c in found.channels.items()]  # fmt: skip
    head = ["channel", "sensor noise [SI]", "residual over noise", "correlation of neighbours", "samples"]
    return table(head, rows) + soft("White residuals of a right model have the size 1 and no correlation.")


def _suspects(found: Diagnosis) -> str:
    if not found.suspicions:
        return ""
    rows = []
    for s in found.suspicions[:_LISTED]:
        most = max(s.moves, key=lambda path: abs(s.moves[path]), default="")
        rows.append([s.name, s.words, s.value, number(s.drop, 3), f"{s.share:.0%}",
                     f"{most} by {s.moves[most]:+.1f} sigma" if most else "–", "yes" if s.matters else ""])  # fmt: skip
    head = ["suspect", "error of an instrument", "estimate", "drop [sigma²]", "share", "would move", "matters"]
    remark = ("Score test of what the fit does not estimate: expected drop of the objective in squared sigma, and in "
              "one Gauss-Newton step its size and what would move.")  # fmt: skip
    return f"<h3>Suspects</h3>{table(head, rows, words=(1, 5, 6))}{soft(remark)}"


def _fixed(found: Diagnosis) -> str:
    rows = [[path, free, f"{moved:+.1f}"] for path, free, moved in found.fixed if abs(moved) >= 0.1]
    if not rows:
        return ""
    head = ["fixed parameter, 10 % larger", "would move", "by [sigma]"]
    return f"<h3>What the fixed parameters decide</h3>{table(head, rows, words=(1,))}"


def _drawing(found: Diagnosis) -> str:
    names = list(found.channels)
    sheet, axes = figures.panels(len(names), 4, (11.0, 1.35 * len(names) + 0.6))
    control, unit = found.control
    factor = math.degrees(1.0) if unit == "rad" else 1.0
    for row, name in zip(axes, names, strict=True):
        _over_time(row[0], found.residuals, name)
        together = np.concatenate([one.values[name] for one in found.residuals.values()])
        _distribution(row[1], together[np.isfinite(together)])
        _correlation(row[2], [one.values[name] for one in found.residuals.values()])
        _against(row[3], found.residuals, name, factor)
        row[0].set_ylabel(name)
    axes[-1][0].set_xlabel("time in the trial [s]")
    axes[-1][1].set_xlabel("residual over noise")
    axes[-1][2].set_xlabel("lag [samples]")
    axes[-1][3].set_xlabel(f"{control} [{'°' if unit == 'rad' else unit}]")
    return figures.svg(sheet, "residuals")


def _over_time(ax: Any, residuals: Mapping[str, Residuals], name: str) -> None:
    for k, one in enumerate(residuals.values()):
        step = max(1, len(one.t) * len(residuals) // _POINTS)
        ax.plot(one.t[::step], one.values[name][::step], ".", ms=1.5, color=figures.LINES[k % len(figures.LINES)][0])
    ax.axhline(0.0, color=figures.GREY, lw=0.6)


def _distribution(ax: Any, values: Array) -> None:
    reach = max(4.0, float(np.quantile(np.abs(values), 0.99))) if values.size else 4.0
    ax.hist(np.clip(values, -reach, reach), bins=41, range=(-reach, reach), density=True, color=figures.LINES[0][0],
            alpha=0.5)  # fmt: skip
    at = np.linspace(-reach, reach, 121)
    ax.plot(at, np.exp(-0.5 * at**2) / math.sqrt(2.0 * math.pi), color=figures.INK, lw=1.0)
    ax.set_yticks([])


def _correlation(ax: Any, parts: list[Array]) -> None:
    lags = np.arange(1, _LAGS + 1)
    known = [np.nan_to_num(part) for part in parts]
    total = sum(float(part @ part) for part in known)
    alike = [sum(float(part[k:] @ part[:-k]) for part in known if part.size > k) / max(total, 1e-300) for k in lags]
    band = 2.0 / math.sqrt(max(sum(part.size for part in known), 1))
    ax.axhspan(-band, band, color=figures.TINT)
    ax.vlines(lags, 0.0, alike, color=figures.INK, lw=1.4)
    ax.axhline(0.0, color=figures.GREY, lw=0.6)


def _against(ax: Any, residuals: Mapping[str, Residuals], name: str, factor: float) -> None:
    for k, one in enumerate(residuals.values()):
        step = max(1, len(one.t) * len(residuals) // _POINTS)
        ax.plot(factor * one.control[::step], one.values[name][::step], ".", ms=1.5,
                color=figures.LINES[k % len(figures.LINES)][0])  # fmt: skip
    ax.axhline(0.0, color=figures.GREY, lw=0.6)
