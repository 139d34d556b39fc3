"""Section on a sampled posterior: what the draws say, and each marginal beside Laplace's."""

from __future__ import annotations

import numpy as np

from ..belief.sampling.sampled import Sampled
from .blocks import bullets, figure, gallery, lead, number, soft, table
from .drawing import label, whole
from .page import Section

_WIDTH, _HEIGHT, _LEFT, _TOP, _FLOOR = 300.0, 150.0, 12.0, 8.0, 124.0
_BINS, _DRAWN = 36, 24
_FILL, _LINE = "#8fb3d9", "#b3541e"


def section(found: Sampled) -> Section:
    """What the draws say, the marginals that differ most from Laplace's, and all of them as a table."""
    words = found.words
    order = np.argsort(-(np.abs(found.shift) + np.abs(np.log(found.ratio))))[:_DRAWN]
    rows = [
        [path, number(found.best[k], 4), number(found.mean[k], 4), number(found.sigma[k], 2),
         f"{number(found.interval[0, k])} … {number(found.interval[1, k])}", number(found.shift[k], 2),
         number(found.ratio[k], 3), f"{found.rhat[k]:.3f}", f"{found.effective[k]:.0f}"]
        for k, path in enumerate(found.paths)
    ]  # fmt: skip
    head = ["parameter", "best", "mean", "sigma", "95 %", "shift [Laplace sigmas]", "sigma over Laplace's", "R-hat",
            "effective draws"]  # fmt: skip
    remark = (
        "Bars: draws; line: Laplace's approximation about the best values; SI units. "
        f"{found.calls} evaluations of each of {found.draws.shape[1]} chains, {number(found.seconds)} s of CPU time; "
        f"squared residuals are divided by {number(found.variance)}."
    )
    drawings = [figure(_marginal(found, int(k)), found.paths[k]) for k in order]
    shown = f"The {_DRAWN} parameters that differ most. " if len(found.paths) > _DRAWN else ""
    body = lead(words[0]) + bullets(words[1:]) + gallery(*drawings, least=280) + soft(shown + remark)
    return Section("Posterior, sampled", body + table(head, rows))


def _marginal(found: Sampled, k: int) -> str:
    """One marginal: histogram of the draws, and Laplace's Gaussian, cut at the bounds as the draws are."""
    values, best = found.flat[:, k], float(found.best[k])
    sd = float(np.sqrt(found.laplace[k, k]))
    low = max(min(float(values.min()), best - 3.0 * sd), found.free[k].low)
    high = min(max(float(values.max()), best + 3.0 * sd), found.free[k].high)
    density, edges = np.histogram(values, _BINS, (low, high), density=True)
    x = np.linspace(low, high, 120)
    bell = np.exp(-0.5 * ((x - best) / sd) ** 2) / (sd * np.sqrt(2.0 * np.pi))
    across = (_WIDTH - 2 * _LEFT) / (high - low)
    up = (_FLOOR - _TOP) / max(float(density.max()), float(bell.max()))
    parts = [
        f'<rect x="{_LEFT + (edges[i] - low) * across:.1f}" y="{_FLOOR - d * up:.1f}" '
        f'width="{(edges[i + 1] - edges[i]) * across:.1f}" height="{d * up:.1f}" fill="{_FILL}"/>'
        for i, d in enumerate(density) if d > 0
    ]  # fmt: skip
    line = " ".join(f"{_LEFT + (a - low) * across:.1f},{_FLOOR - b * up:.1f}" for a, b in zip(x, bell, strict=True))
    parts += [
        f'<polyline points="{line}" fill="none" stroke="{_LINE}" stroke-width="1.6"/>',
        f'<line x1="{_LEFT}" y1="{_FLOOR}" x2="{_WIDTH - _LEFT}" y2="{_FLOOR}" stroke="#888"/>',
        label(_LEFT, _HEIGHT - 8, number(low), "#555"),
        label(_WIDTH - _LEFT, _HEIGHT - 8, number(high), "#555", anchor="end"),
    ]
    return whole(_WIDTH, _HEIGHT, parts)
