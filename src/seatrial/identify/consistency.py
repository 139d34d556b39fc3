"""Whether the innovations of a filter are as large as the filter believes.

Under the right model the normalised innovation squared (NIS) of each update is chi-squared with as
many degrees of freedom as there were readings, and independent of the others, so its sum over a window
is too.  A window above the band says that the model no longer fits there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..data import Array


@dataclass(frozen=True)
class Window:
    """One stretch of the innovation test.

    Attributes:
        start, end: its times [s].
        nis: NIS in it, per degree of freedom; 1 on average under the right model.
        limit: what a right model stays below.
        readings: degrees of freedom.
    """

    start: float
    end: float
    nis: float
    limit: float
    readings: int


@dataclass(frozen=True)
class Consistency:
    """The outcome of the innovation test.

    Attributes:
        fits: whether no window is above its limit.
        since: start of the first window that is [s]; NaN where none is.
        text: the same in words.
        windows: one after the other.
    """

    fits: bool
    since: float
    text: str
    windows: tuple[Window, ...]


def innovation_test(
    t: Array, innovations: Array, squares: Array, nis: Array, channels: tuple[str, ...], *,
    window: float, false_alarm: float,
) -> Consistency:  # fmt: skip
    """Judge the innovations window by window.

    Args:
        t: times of the updates [s], shape (updates,).
        innovations, squares: innovation and its normalised square channel by channel, shape
            (updates, channels); NaN where there was no reading.
        nis: shape (updates,).
        window: length of a window [s].
        false_alarm: probability that a right model is found wrong anywhere in the trial.
    """
    from scipy.special import chdtri

    count = max(1, int((t[-1] - t[0]) / window + 1e-9))
    which = np.minimum(((t - t[0]) / window + 1e-9).astype(int), count - 1)
    dof = np.isfinite(innovations).sum(axis=1)
    each = 1.0 - (1.0 - false_alarm) ** (1.0 / np.unique(which).size)
    found: list[Window] = []
    for k in np.unique(which):
        rows = which == k
        m = int(dof[rows].sum())
        start, end = t[0] + k * window, t[-1] if k == count - 1 else t[0] + (k + 1) * window
        found.append(Window(float(start), float(end), float(nis[rows].sum()) / m, float(chdtri(m, each)) / m, m))
    loud = [w for w in found if w.nis > w.limit]
    if not loud:
        return Consistency(True, float("nan"), _fitting(nis, dof, false_alarm), tuple(found))
    since = loud[0].start
    rows = (t >= since) & (t <= loud[-1].end)
    worst = channels[int(np.nanargmax(np.nanmean(np.vstack([squares[rows], np.zeros(len(channels))]), axis=0)))]
    until = "on" if loud[-1] is found[-1] else f"to {loud[-1].end:.4g} s"
    peak = max(loud, key=lambda w: w.nis / w.limit)
    text = (
        f"from t = {since:.4g} s {until} the model no longer fits: the innovations are {np.sqrt(peak.nis):.3g} times "
        f"as large as they should be in the window at {peak.start:.4g} s (limit {np.sqrt(peak.limit):.3g}), "
        f"most of all those of {worst}"
    )
    return Consistency(False, since, text, tuple(found))


def _fitting(nis: Array, dof: Array, false_alarm: float) -> str:
    from scipy.special import chdtri

    total, m = float(nis.sum()), int(dof.sum())
    ratio = np.sqrt(total / m)
    if total < float(chdtri(m, 1.0 - false_alarm)):
        return f"the innovations are {ratio:.3g} times as large as stated: noise or process noise is stated too large"
    return f"the model fits throughout: the innovations are {ratio:.3g} times as large as they should be"
