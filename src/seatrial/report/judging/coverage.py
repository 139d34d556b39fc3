"""Page and section on coverage: distributions of states and inputs in training and in other trials, and novelty."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ...belief.coverage import WIND, Coverage, Reference, columns
from ...data import Array, Trial, unwrapped
from .. import figures
from ..blocks import fields, figure, gallery, heading, line, note, number, table
from ..page import Page, Section, text

_BINS = 40
_DEGREES = math.degrees(1.0)
_LABELS = {
    "u": "surge speed u [m/s]", "v_m": "sway speed v_m [m/s]", "r": "rate of turn r [°/s]",
    "n_P": "propeller n_P [1/s]", "delta": "rudder δ [°]", WIND[0]: "apparent wind from ahead [m/s]",
    WIND[1]: "apparent wind from starboard [m/s]",
}  # fmt: skip
_SMALL = (4.2, 2.5)
_DRAWN = 12


def page(
    reference: Reference, train: Sequence[Trial], trials: Sequence[Trial], found: Sequence[Coverage],
    notes: Sequence[str] = (),
) -> Page:  # fmt: skip
    """The whole page; `notes` are findings to put first."""
    return Page("Coverage", (Section("", note("", notes)), section(reference, train, trials, found)))


def section(
    reference: Reference, train: Sequence[Trial], trials: Sequence[Trial], found: Sequence[Coverage]
) -> Section:  # fmt: skip
    """Verdicts, the distributions in training and in the trials, and novelty over time."""
    verdicts = table(
        ("trial", "novel samples", "of the training files, at most", "verdict", "in"),
        ((c.name, f"{100 * c.share:.1f} %", f"{100 * max(reference.own.values()):.1f} %", c.verdict,
          ", ".join(c.channels) or "–") for c in found), words=(3, 4),
    )  # fmt: skip
    drawn = (figure(histogram(name, columns_of(train, name), columns_of(trials, name)), _LABELS.get(name, name))
             for name in reference.channels)  # fmt: skip
    worst = sorted(found, key=lambda c: -c.share)[:_DRAWN]
    over = gallery(*(figure(novelty(c), f"{c.name}: {number(100 * c.share, 2)} % of the samples are novel")
                     for c in worst if c.share > 0))  # fmt: skip
    remark = (
        f"{len(train)} training files, {len(reference.points)} samples, one a second. A sample is novel if its nearest "
        "training samples are farther away than those of 99 in 100 training samples are in the other files: "
        f"{number(reference.limit)} standard deviations."
    )
    body = line(remark) + verdicts + heading("Distributions") + gallery(*drawn)
    body += heading("Novelty over time") + over if over else ()
    return Section("Does the training cover this?", fields({"coverage": {c.name: c.numbers() for c in found}}, body))


def histogram(name: str, train: Array, trial: Array) -> str:
    """Distribution of a channel in the training set and in the trials (Wakita 2022 Fig. 3).

    Args:
        name: of the channel.
        train, trial: its samples in SI units; NaN is left out.
    """
    own, over, past = name.partition(" over ")
    factor = _DEGREES if own in ("r", "delta", "psi") else 1.0
    pools = [factor * values[np.isfinite(values)] for values in (train, trial)]
    both = np.concatenate(pools)
    low, high = (float(both.min()), float(both.max())) if both.size else (0.0, 1.0)
    edges = np.linspace(low, high if high > low else low + 1.0, _BINS + 1)
    drawn, (ax,) = figures.canvas(1, _SMALL)
    styles = figures.line_styles(("trials", "training"), "training")
    for label, values in zip(("training", "trials"), pools, strict=True):
        share = 100.0 * np.histogram(values, edges)[0] / max(values.size, 1)
        colour, dashes = styles[label]
        ax.stairs(share, edges, fill=label == "training", color=colour, alpha=0.45 if label == "training" else 1.0,
                  ls="-" if label == "training" else dashes, lw=1.4, label=label)  # fmt: skip
    ax.set(xlabel=f"{_LABELS.get(own, text(own))}{over and ', mean over '}{past}", ylabel="samples [%]")
    ax.legend()
    return figures.svg(drawn, f"histogram {name}")


def novelty(found: Coverage) -> str:
    """Novelty of one trial over time, and the limit."""
    drawn, (ax,) = figures.canvas(1, _SMALL)
    step = max(1, math.ceil(found.t.size / 600))
    ax.plot(found.t[::step], found.novelty[::step], color=figures.BLUE, lw=1.3)
    ax.axhline(1.0, color=figures.GREY, lw=1.0, ls=figures.BASELINE[1])
    ax.set_ylim((0.0, max(1.2, 1.05 * float(found.novelty.max()))))
    ax.set(xlabel="time t [s]", ylabel="distance over limit [-]")
    return figures.svg(drawn, f"novelty {found.name}")


def columns_of(trials: Sequence[Trial], name: str) -> Array:
    """One channel of several trials, one behind the other; a heading is made continuous."""
    parts = [columns(trial, (name,))[:, 0] for trial in trials]
    return np.concatenate([unwrapped(p) if name == "psi" else p for p in parts])
