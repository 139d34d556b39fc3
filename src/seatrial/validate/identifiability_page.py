"""Sections of a page: what the data determine, and how sure a prediction is.  Angles in degrees, all else in SI."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..data import Array, unwrapped
from ..identify import Fit
from ..identify.ensemble import Bands, Ensemble
from ..identify.misfit import Misfit
from ..identify.profile import Identifiability
from ..models import STATES
from . import identifiability_figures as draw
from .page import bullets, figure, number, table, text

# Ends within this share of the best objective are as good as it.
_AS_GOOD = 1e-6
_THREE = "repeat(auto-fill,minmax(min(100%,300px),1fr))"
_WIDE = '<div style="max-width:760px;margin:1rem 0">'
_DEGREES = math.degrees(1.0)
_WORDS = ("identified", "weak", "at bound", "not identified")
_SHOWN = ("advance", "transfer", "tactical_diameter", "steady_diameter", "time_90", "time_180")


def sections(
    fit: Fit, known: Identifiability, *, group: Ensemble | None = None, predicted: Sequence[Bands] = (),
    left: Misfit | None = None,
) -> list[tuple[str, str]]:  # fmt: skip
    """Titles and bodies of the sections, in the order to show.

    Args:
        fit: the optimum; its `ends` are the restarts that are shown.
        known: its profiles.
        group: the ensemble behind `predicted`.
        predicted: trials with their bands.
        left: what the residuals say.
    """
    out = [("What the data determine", _determined(known))]
    if fit.ends.size:
        out.append(("Where the searches ended", _restarts(fit)))
    if left is not None:
        out.append(("What the residuals say", _residuals(left)))
    if predicted:
        out.append(("How sure the predictions are", _bands(predicted, group)))
    return out


def html(parts: Sequence[tuple[str, str]]) -> str:
    """The sections one beneath the other."""
    return "".join(f"<h2>{text(title)}</h2>{body}" for title, body in parts)


def _determined(known: Identifiability) -> str:
    names = [p.free.path for p in known.profiles]
    single, combined = known.verdicts[: len(names)], known.verdicts[len(names) :]
    counts = [(sum(v.status == word for v in single), word) for word in _WORDS]
    told = ", ".join(f"{n} {word}" for n, word in counts if n)
    better = ""
    if known.better > 0.1:
        better = (f'<div class="note">A profile found an objective lower than the fit by {number(known.better, 2)} '
                  "units of the noise: the fit is not the optimum; search from more starts.</div>")  # fmt: skip
    rows = [
        [p.free.path, number(p.best, 4), number(p.interval[0], 4), number(p.interval[1], 4),
         p.percent, v.status, v.text]
        for p, v in zip(known.profiles, single, strict=True)
    ]  # fmt: skip
    head = ["parameter", "fitted", "95 % from", "to", "of the range", "verdict", "in words"]
    drawings = "".join(figure(draw.profile(p), f"Profile of {p.free.path}") for p in known.profiles)
    matrix = figure(draw.correlations(names, known.correlation), "Correlation of the estimates within the box")
    loose = f"<h3>Combinations that the data leave open</h3>{bullets(f'{v.subject}: {v.text}' for v in combined)}"
    lead = (
        f"{told}. A profile holds one parameter and fits all others again: where it stays below the dashed line the "
        f"data cannot tell (95 %). The residuals count as {known.independent:.0f} independent ones."
    )
    return (
        f"<p>{text(lead)}</p>{better}{_wrapped(head, rows)}{loose if combined else ''}"
        f'<div class="figures" style="grid-template-columns:{_THREE}">{drawings}</div>{_WIDE}{matrix}</div>'
    )


def _wrapped(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    return f'<div class="wrap">{table(head, rows, words=(5, 6))}</div>'


def _restarts(fit: Fit) -> str:
    low, high = np.array([f.low for f in fit.free]), np.array([f.high for f in fit.free])
    ends = fit.ends[np.isfinite(fit.ends[:, 0])]
    bounded = np.isfinite(high - low)
    if not bounded.any() or not ends.size:
        return "<p>No search has a box to end in.</p>"
    values = ends[:, 1:][:, bounded]
    places = (values - low[bounded]) / (high - low)[bounded]
    best = float(ends[:, 0].min())
    good = ends[:, 0] <= best + _AS_GOOD * abs(best)
    spread = float(np.ptp(places[good], axis=0).max())
    names = [f.path for f, b in zip(fit.free, bounded, strict=True) if b]
    words = (f"{int(good.sum())} of {len(ends)} searches ended at the best objective (to {_AS_GOOD:g}); among these a "
             f"parameter moves by up to {number(spread, 2)} of its range.")  # fmt: skip
    caption = "Ends within the box: filled as good as the best, open worse"
    return f"<p>{text(words)}</p>{_WIDE}{figure(draw.restarts(names, places, good.tolist()), caption)}</div>"


def _residuals(left: Misfit) -> str:
    rows = [[r.channel, number(r.size), number(r.correlation, 2), number(r.runs, 2), str(r.samples)]
            for r in left.remainders]  # fmt: skip
    head = ["channel", "size over noise", "correlation", "runs [deviations]", "samples"]
    first = text(left.words[0])
    said = f'<div class="note">{first}</div>' if left.lacking else f"<p>{first}</p>"
    more = bullets(left.words[1:]) if left.lacking else ""
    note = ('<p class="soft">After the start of each prediction was left free within the noise. White noise has '
            "size 1, correlation 0 and runs within ±2.</p>")  # fmt: skip
    return f"{said}{more}{table(head, rows)}{note}"


def _bands(predicted: Sequence[Bands], group: Ensemble | None) -> str:
    words = "Bands hold 95 % of the fits that the data might as well have given"
    if group is not None:
        noise = ", ".join(f"{n} {number(_DEGREES * s if n in ('psi', 'r') else s, 2)}{_UNIT[n]}"
                          for n, s in group.noise.items() if s > 1e-5)  # fmt: skip
        words += f": {len(group.values)} repetitions of the trials with noise {noise}"
    rows = [row for one in predicted for row in _index_rows(one)]
    head = ["trial", "index", "unit", "fit", "95 % from", "to", "width [%]", "measured"]
    parts = [f"<p>{text(words)}.</p>", table(head, rows, words=(1, 2)) if rows else ""]
    for one in predicted:
        measured = {n: one.trial[n] for n in ("x", "y", "psi") if n in one.trial}
        line = (measured["x"], measured["y"]) if {"x", "y"} <= set(measured) else None
        caption = "Tracks of the members, the fit bold, measured dashed"
        drawings = [figure(draw.tracks(one.states, one.best, line), caption)]
        drawings.append(figure(_heading(one), "Heading relative to the fit: 95 % band, measured dashed"))
        drawings.append(figure(_off(one), "Distance across the fit's track: 95 % band"))
        parts.append(f'<h3>{text(one.trial.name)}</h3><div class="figures">{"".join(drawings)}</div>')
    return "".join(parts)


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
    return draw.band(one.t, edges, measured, "heading ψ [°]")


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
    return draw.band(one.t, (low, high), measured, "across the track [m]")
