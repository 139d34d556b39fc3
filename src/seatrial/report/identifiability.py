"""Sections on identifiability: profiles, correlations, restarts, residuals and prediction bands.

Angles are in degrees, all else in SI units.  A page has dozens of these small drawings, so they are plain SVG: twelve
profiles, a matrix and three bands take 0.02 s, on the canvas of `figures` 1.5 s.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..belief.ensemble import Bands, Ensemble
from ..data import Array, unwrapped
from ..identify import Fit
from ..identify.posterior.misfit import Misfit
from ..identify.posterior.profile import THRESHOLD, Identifiability, Profile
from ..identify.posterior.verdicts import capped
from ..models import STATES
from . import figures
from .blocks import Body, Line, bullets, figure, gallery, heading, joined, line, number, soft, table
from .canvas.frame import Frame, label, whole
from .page import Section, text

# Ends within this share of the best objective are as good as it.
_AS_GOOD = 1e-6
_WIDE = 760
_DEGREES = math.degrees(1.0)
_WORDS = ("identified", "graded", "weak", "at bound", "not identified")
_SHOWN = ("advance", "transfer", "tactical_diameter", "steady_diameter", "time_90", "time_180")


def sections(
    fit: Fit, known: Identifiability, *, group: Ensemble | None = None, predicted: Sequence[Bands] = (),
    left: Misfit | None = None,
) -> list[Section]:  # fmt: skip
    """The sections, in the order to show.

    Args:
        fit: the optimum; its `ends` are the restarts that are shown.
        known: its profiles.
        group: the ensemble behind `predicted`.
        predicted: trials with their bands.
        left: what the residuals say.
    """
    out = [Section("What the data determine", _determined(fit, known))]
    if fit.ends.size:
        out.append(Section("Ends of the searches", _restarts(fit)))
    if left is not None:
        out.append(Section("Analysis of the residuals", _residuals(left)))
    if predicted:
        out.append(Section("Prediction intervals", _bands(predicted, group)))
    return out


def _determined(fit: Fit, known: Identifiability) -> Body:
    names = [p.free.path for p in known.profiles]
    found = capped(known.verdicts, fit.diagnosis)
    single, combined = found[: len(names)], found[len(names) :]
    counts = [(sum(v.status == word for v in single), word) for word in _WORDS]
    summary = ", ".join(f"{n} {word}" for n, word in counts if n)
    better: Body = ()
    if known.better > 0.1:
        better = (Line(f"A profile found an objective lower than the fit by {number(known.better, 2)} units of the "
                       "noise: the fit is not the optimum; search from more starts.", "warning"),)  # fmt: skip
    rows = [
        [p.free.path, number(p.best, 4), number(p.interval[0], 4), number(p.interval[1], 4),
         p.percent, v.status, v.text]
        for p, v in zip(known.profiles, single, strict=True)
    ]  # fmt: skip
    head = ["parameter", "fitted", "95 % from", "to", "of the range", "verdict", "in words"]
    drawings = (figure(profile(p), f"Profile of {p.free.path}") for p in known.profiles)
    matrix = figure(correlations(names, known.correlation), "Correlation of the estimates within the box", most=_WIDE)
    loose = heading("Combinations that the data leave open") + bullets(f"{v.subject}: {v.text}" for v in combined)
    first = (
        f"{summary}. A profile holds one parameter and fits all others again: below the dashed line the data do not "
        f"distinguish its values (95 %). The residuals count as {known.independent:.0f} independent ones."
    )
    return (line(first) + better + table(head, rows, words=(5, 6), wide=True) + (loose if combined else ())
            + gallery(*drawings, least=300) + matrix)  # fmt: skip


def _restarts(fit: Fit) -> Body:
    low, high = np.array([f.low for f in fit.free]), np.array([f.high for f in fit.free])
    ends = fit.ends[np.isfinite(fit.ends[:, 0])]
    bounded = np.isfinite(high - low)
    if not bounded.any() or not ends.size:
        return line("No search has a box to end in.")
    values = ends[:, 1:][:, bounded]
    places = (values - low[bounded]) / (high - low)[bounded]
    best = float(ends[:, 0].min())
    good = ends[:, 0] <= best + _AS_GOOD * abs(best)
    spread = float(np.ptp(places[good], axis=0).max())
    names = [f.path for f, b in zip(fit.free, bounded, strict=True) if b]
    words = (f"{int(good.sum())} of {len(ends)} searches ended at the best objective (to {_AS_GOOD:g}); among these a "
             f"parameter moves by up to {number(spread, 2)} of its range.")  # fmt: skip
    caption = "Ends within the box: filled as good as the best, open worse"
    return line(words) + figure(restarts(names, places, good.tolist()), caption, most=_WIDE)


def _residuals(left: Misfit) -> Body:
    rows = [[r.channel, number(r.size), number(r.correlation, 2), number(r.runs, 2), str(r.samples)]
            for r in left.remainders]  # fmt: skip
    head = ["channel", "size over noise", "correlation", "runs [deviations]", "samples"]
    said = (Line(left.words[0], "warning" if left.lacking else ""),)
    more = bullets(left.words[1:]) if left.lacking else ()
    remark = (
        "The initial state of each prediction is free within the noise. White noise has size 1, correlation 0 and runs "
        "within ±2."
    )
    return said + more + table(head, rows) + soft(remark)


def _bands(predicted: Sequence[Bands], group: Ensemble | None) -> Body:
    words = "Bands contain 95 % of the fits that the data are consistent with"
    if group is not None:
        noise = ", ".join(f"{n} {number(_DEGREES * s if n in ('psi', 'r') else s, 2)}{_UNIT[n]}"
                          for n, s in group.noise.items() if s > 1e-5)  # fmt: skip
        words += f": {len(group.values)} repetitions of the trials with noise {noise}"
    rows = [row for one in predicted for row in _index_rows(one)]
    head = ["trial", "index", "unit", "fit", "95 % from", "to", "width [%]", "measured"]
    parts = [line(f"{words}."), table(head, rows, words=(1, 2)) if rows else ()]
    for one in predicted:
        measured = {n: one.trial[n] for n in ("x", "y", "psi") if n in one.trial}
        track = (measured["x"], measured["y"]) if {"x", "y"} <= set(measured) else None
        caption = "Tracks of the members, the fit bold, measured dashed"
        drawings = (
            figure(tracks(one.states, one.best, track), caption),
            figure(_heading(one), "Heading relative to the fit: 95 % band, measured dashed"),
            figure(_off(one), "Distance across the fit's track: 95 % band"),
        )
        parts.append(heading(one.trial.name) + gallery(*drawings))
    return joined(parts)


_UNIT = {"x": " m", "y": " m", "psi": "°", "u": " m/s", "v_m": " m/s", "r": "°/s"}


def _index_rows(one: Bands) -> list[list[str]]:
    out: list[list[str]] = []
    for name in (n for n in _SHOWN if n in one.indices):
        low, high = one.interval(name)
        fitted = one.fitted[name]
        width = 100.0 * (high - low) / abs(fitted) if fitted else math.nan
        values = [number(v, 4) for v in (fitted, low, high)]
        measured = number(one.measured.get(name, math.nan), 4)
        out.append([one.trial.name, name.replace("_", " "), one.units[name], *values, number(width, 2), measured])
    return out


def _heading(one: Bands) -> str:
    k = STATES.index("psi")
    low, high = one.band("psi")
    measured = None
    if "psi" in one.trial:
        psi = np.interp(one.t, one.trial.t, unwrapped(one.trial["psi"]))
        measured = _DEGREES * (psi - one.best[:, k])
    edges = (_DEGREES * (low - one.best[:, k]), _DEGREES * (high - one.best[:, k]))
    return band(one.t, edges, measured, "heading ψ [°]")


def _off(one: Bands) -> str:
    """Members' positions across the course of the fit's track."""
    x, y = one.best[:, 0], one.best[:, 1]
    course = np.arctan2(np.gradient(y), np.gradient(x))
    across: Array = (one.states[:, :, 1] - y) * np.cos(course) - (one.states[:, :, 0] - x) * np.sin(course)
    low, high = np.quantile(across, (0.025, 0.975), axis=0)
    measured = None
    if {"x", "y"} <= set(one.trial.channels):
        east, north = (np.interp(one.t, one.trial.t, one.trial[n]) for n in ("y", "x"))
        measured = (east - y) * np.cos(course) - (north - x) * np.sin(course)
    return band(one.t, (low, high), measured, "across the track [m]")


_INK, _SOFT, _RULE, _LINE, _OTHER = figures.INK, figures.SOFT, figures.GRID, figures.BLUE, figures.VERMILION
_WORD = {"identified": figures.GREEN, "graded": figures.BLUE, "weak": figures.OCHRE,
         "not identified": figures.VERMILION, "at bound": figures.PINK}  # fmt: skip
_TOP = 4.0 * THRESHOLD


def profile(one: Profile) -> str:
    """Rise of the objective over one parameter, with the 95 % limit and the interval."""
    frame = Frame(300, 170, (one.low, one.high), (0.0, _TOP), left=34, bottom=30)
    if one.share < 0.2:  # a narrow valley is drawn by itself, the table has the range
        half = 1.5 * max(one.interval[1] - one.best, one.best - one.interval[0])
        half = max(half, 1e-9 * (one.high - one.low))
        frame = Frame(300, 170, (max(one.best - half, one.low), min(one.best + half, one.high)), (0.0, _TOP),
                       left=34, bottom=30)  # fmt: skip
    rise = np.minimum(np.where(np.isfinite(one.rise), one.rise, 10.0 * _TOP), 10.0 * _TOP)
    # Between steps the root of the rise is about straight.
    x = np.linspace(one.values[0], one.values[-1], 800)
    y = np.interp(x, one.values, np.sqrt(rise)) ** 2
    inside = (x >= frame.x[0]) & (x <= frame.x[1]) & (y <= _TOP)
    a, b = (frame.at(v, 0.0)[0] for v in one.interval)
    steps = [(v, r) for v, r in zip(one.values, rise, strict=True) if frame.holds(float(v), float(r))]
    colour = _WORD[one.status]
    # The status stands in the upper corner that the curve leaves free.
    near = x <= frame.x[0] + 0.3 * (frame.x[1] - frame.x[0])
    left = not np.any((y > 0.6 * _TOP) & near & (x >= frame.x[0]))
    return frame.svg([
        f'<rect x="{a:.1f}" y="{frame.top}" width="{max(b - a, 1.0):.1f}" height="{frame.height}" fill="{colour}" '
        'opacity=".14"/>',
        frame.line([frame.x[0], frame.x[1]], [THRESHOLD, THRESHOLD], _SOFT, dash="4 3"),
        frame.line(x[inside], y[inside], colour, width=1.8),
        *(frame.dot(float(v), float(r), colour, 2.0) for v, r in steps),
        frame.dot(one.best, 0.0, _INK, 3.0),
        label(frame.left + 4 if left else frame.left + frame.width - 4, frame.top + 10, one.status, colour,
              weight=600, anchor="start" if left else "end"),
    ], one.free.path, "rise")  # fmt: skip


def correlations(names: Sequence[str], matrix: Array) -> str:
    """Lower triangle of a correlation matrix, blue together, orange against; numbers where strong."""
    n, size, left = len(names), 34, 150
    parts = [label(left - 6, 14 + size * (i + 0.6), name, _INK, anchor="end") for i, name in enumerate(names)]
    for i in range(n):
        for j in range(i):
            c = float(matrix[i, j])
            x, y = left + size * j, 14 + size * i
            colour = _LINE if c > 0 else _OTHER
            parts.append(f'<rect x="{x}" y="{y}" width="{size - 1}" height="{size - 1}" fill="{colour}" '
                         f'opacity="{abs(c) ** 1.5:.2f}"><title>{text(names[i])}, {text(names[j])}: {c:+.3f}</title>'
                         "</rect>")  # fmt: skip
            if abs(c) >= 0.5:
                ink = "#fff" if abs(c) > 0.8 else _INK
                parts.append(label(x + size / 2, y + size * 0.62, f"{c:+.2f}".replace("-", "−"), ink, anchor="middle"))
        parts.append(label(left + size * i + 4, 14 + size * (i + 0.6), names[i].split(".")[-1], _SOFT))
    return whole(left + size * n + 60, 20 + size * n, parts)


def restarts(names: Sequence[str], places: Array, better: Sequence[bool]) -> str:
    """Ends of the searches within the box, a row for each parameter; those as good as the best filled."""
    step, left, width = 22, 150, 420
    parts: list[str] = []
    for k, name in enumerate(names):
        y = 20 + step * k
        parts.append(label(left - 6, y + 4, name, _INK, anchor="end"))
        parts.append(f'<line x1="{left}" x2="{left + width}" y1="{y}" y2="{y}" stroke="{_RULE}"/>')
        for place, good in zip(places[:, k], better, strict=True):
            look = f'fill="{_LINE}" opacity=".55"' if good else f'fill="none" stroke="{_OTHER}"'
            parts.append(f'<circle cx="{left + width * place:.1f}" cy="{y}" r="4" {look}/>')
    bottom = 20 + step * len(names)
    parts += [label(left, bottom + 6, "low", _SOFT), label(left + width, bottom + 6, "high", _SOFT, anchor="end")]
    return whole(left + width + 20, bottom + 14, parts)


def tracks(members: Array, best: Array, measured: tuple[Array, Array] | None) -> str:
    """Tracks of all members (rows x, y), of the fit, and as measured; north up, at equal scale."""
    every = max(1, best.shape[0] // 120)
    shown = members[:60, ::every]
    x, y = np.append(shown[:, :, 0].ravel(), best[:, 0]), np.append(shown[:, :, 1].ravel(), best[:, 1])
    half = 0.54 * max(float(np.nanmax(x) - np.nanmin(x)), float(np.nanmax(y) - np.nanmin(y)), 1.0)
    east, north = (0.5 * (float(np.nanmax(v)) + float(np.nanmin(v))) for v in (y, x))
    frame = Frame(420, 400, (east - half, east + half), (north - half, north + half), left=52, bottom=36)
    parts = [frame.line(one[:, 1], one[:, 0], _LINE, width=0.8, fade=0.25) for one in shown]
    parts.append(frame.line(best[::every, 1], best[::every, 0], _LINE, width=1.8))
    if measured is not None:
        step = max(1, measured[0].size // 240)
        parts.append(frame.line(measured[1][::step], measured[0][::step], _INK, width=1.4, dash="5 3"))
    return frame.svg(parts, "east y [m]", "north x [m]")


def band(t: Array, edges: tuple[Array, Array], measured: Array | None, what: str) -> str:
    """A band over time, and the measured line in it; all relative to the fit."""
    every = max(1, t.size // 240)
    t, low, high = t[::every], edges[0][::every], edges[1][::every]
    values = [low, high] + ([] if measured is None else [measured[::every]])
    reach = 1.1 * max(float(np.nanmax(np.abs(v))) for v in values) or 1.0
    frame = Frame(420, 220, (float(t[0]), float(t[-1])), (-reach, reach), left=52, bottom=36)
    points = [*zip(t, high, strict=True), *zip(t[::-1], low[::-1], strict=True)]
    outline = " ".join(f"{a:.1f},{b:.1f}" for a, b in (frame.at(float(x), float(y)) for x, y in points))
    parts = [f'<polygon points="{outline}" fill="{_LINE}" opacity=".25"/>', frame.line(t, 0.0 * t, _LINE, width=1.6)]
    if measured is not None:
        parts.append(frame.line(t, measured[::every], _INK, width=1.0, dash="5 3"))
    return frame.svg(parts, "time t [s]", what)
