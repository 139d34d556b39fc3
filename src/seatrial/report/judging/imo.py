"""Page and numbers of the IMO manoeuvring criteria (MSC.137(76)) of a ship."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ...data import Array, Trial
from ...validate.imo import FAIL, PASS, UNDECIDED, Criterion, ImoTable, Source
from .. import figures
from ..blocks import Body, bullets, entries, fields, figure, gallery, heading, lead, note, number, table
from ..page import Page, Section

_NAME = "criterion (MSC.137(76) section 5.3)"
_HEAD = (_NAME, "side", "value", "limit", "unit", "verdict")
_BANDED = (_NAME, "side", "value", "from", "to", "limit", "unit", "draws that meet it", "verdict")
_SHOWN, _DEGREES = 60, math.degrees(1.0)
_MARKS = ((PASS, figures.BLUE, "o"), (UNDECIDED, figures.OCHRE, "D"), (FAIL, figures.VERMILION, "s"))


def page(found: ImoTable) -> Page:
    """The criteria with values, limits and verdicts, what they leave out, and the conditions."""
    drawn = figure(_drawn(found), "Values, their bands and the limit, which is 1") if banded(found) else ()
    runs = gallery(*(figure(draw(found), said) for draw, said, index in _RUNS if _sources(found, index)))
    return Page(
        f"{found.ship}: IMO manoeuvring standards",
        (
            Section("", fields(numbers(found), _head(found))),
            Section("Criteria", _criteria(found) + drawn + _reasons(found.rows)),
            *((Section("Circle and zigzag", runs),) if runs else ()),
            Section("Conditions", entries(found.conditions)),
        ),
    )


def brief(found: ImoTable) -> Body:
    """The same without drawings, for a terminal."""
    return fields(numbers(found), lead(found.verdict) + _criteria(found) + _reasons(found.rows) + _unshown(found)
                  + entries(found.conditions))  # fmt: skip


def _head(found: ImoTable) -> Body:
    return lead(found.verdict) + _unshown(found)


def _unshown(found: ImoTable) -> Body:
    return note("What this does not show", found.caveats)


def _criteria(found: ImoTable) -> Body:
    if banded(found):
        return table(_BANDED, map(_banded, found.rows), words=(1, 6, 8))
    return table(_HEAD, map(_row, found.rows), words=(1, 4, 5))


def numbers(found: ImoTable) -> dict[str, object]:
    """The table as JSON has it."""
    return {
        "ship": found.ship, "standard": "IMO MSC.137(76)", "L_pp": {"value": found.L_pp, "unit": "m"},
        "speed": {"value": found.speed, "unit": "m/s"}, "n_P": {"value": found.n_P, "unit": "1/s"},
        "L_over_V": {"value": found.L_over_V, "unit": "s"}, "verdict": found.verdict,
        **({} if found.together is None else {"probability": found.together}),
        "criteria": [
            {"criterion": row.name, "side": row.side or None, "value": row.value, "limit": row.limit,
             "unit": row.unit, "verdict": row.verdict, "reason": row.reason, **_band(row)}
            for row in found.rows
        ],
        "conditions": dict(found.conditions), "caveats": list(found.caveats),
    }  # fmt: skip


def _band(row: Criterion) -> dict[str, object]:
    if row.band is None:
        return {}
    low, high = (None if math.isnan(edge) else edge for edge in (row.band.low, row.band.high))
    return {"band": {"low": low, "high": high, "met": row.band.met, "draws": row.band.draws}}


def banded(found: ImoTable) -> bool:
    """Whether any criterion was judged by draws."""
    return any(row.band is not None for row in found.rows)


def _edges(row: Criterion) -> tuple[str, str]:
    """Lower and upper edge of the band in words; dashes where there is none."""
    found = () if row.band is None else (row.band.low, row.band.high)
    return tuple("–" if math.isnan(edge) else number(edge) for edge in found) or ("–", "–")  # type: ignore[return-value]


def _row(row: Criterion) -> tuple[str, ...]:
    value = "–" if row.value is None else number(row.value)
    return (row.name, row.side or "–", value, number(row.limit), row.unit, row.verdict)


def _banded(row: Criterion) -> tuple[str, ...]:
    name, side, value, limit, unit, verdict = _row(row)
    met = "–" if row.band is None else f"{math.floor(100.0 * row.band.met):d} %"
    return (name, side, value, *_edges(row), limit, unit, met, verdict)


def _drawn(found: ImoTable) -> str:
    """Each criterion on a line: its band as a bar and its value as a mark, in parts of the limit."""
    rows = [row for row in found.rows if row.band is not None and row.value is not None]
    drawn, (ax,) = figures.canvas(1, (9.5, 0.9 + 0.27 * len(rows)))
    for verdict, colour, mark in _MARKS:
        own = [(k, row) for k, row in enumerate(rows) if row.verdict == verdict]
        for k, row in own:
            low, high = (edge / row.limit for edge in _ends(row))
            ax.plot([low, high], [k, k], color=colour, lw=5, alpha=0.45)
        if own:
            ax.plot([(row.value or 0.0) / row.limit for _, row in own], [k for k, _ in own], mark, color=colour, ms=6,
                    label=verdict)  # fmt: skip
    ax.axvline(1.0, color=figures.INK, lw=1.2)
    figures.rows_of(drawn, ax, [row.title for row in rows], "value / limit [-]", len(_MARKS))
    return figures.svg(drawn, f"criteria of {found.ship}")


def _sources(found: ImoTable, index: str) -> list[Source]:
    """The runs to both sides that give an index."""
    return [row.source for row in found.rows if row.source is not None and row.source.index == index]


def _circle(found: ImoTable) -> str:
    """Tracks of the turning circle to both sides, with those of draws."""
    drawn, (ax,) = figures.canvas(1)
    sources = _sources(found, "advance")
    for source in sources:
        for track in _some(source):
            ax.plot(track[:, 1], track[:, 0], color=figures.SKY, lw=0.6, alpha=0.5, label="_draw")
        ax.plot(source.run["y"], source.run["x"], color=figures.INK, lw=1.3, label="_run")
    ax.set(xlabel="east y [m]", ylabel="north x [m]")
    draws = [(track[:, 1], track[:, 0]) for source in sources for track in _some(source)]
    east, north = (np.concatenate([source.run[name] for source in sources]) for name in "yx")
    figures.frame(ax, draws, (east, north))  # a draw that runs away shrinks no other
    return figures.svg(drawn, f"circle of {found.ship}")


def _zigzag(found: ImoTable) -> str:
    """Heading and rudder of the 10/10 zigzag to starboard, with the headings of draws."""
    drawn, (ax,) = figures.canvas(1)
    source = _sources(found, "second_overshoot")[0]
    for track in _some(source):
        t = source.draws.t if source.draws else ()
        ax.plot(t, _DEGREES * track[:, 2], color=figures.SKY, lw=0.6, alpha=0.5, label="_draw")
    ax.plot(source.run.t, _DEGREES * source.run["psi"], color=figures.INK, lw=1.3, label="heading")
    ax.plot(source.run.t, _DEGREES * _helm(source.run), color=figures.VERMILION, lw=1.1, label="rudder")
    ax.set(xlabel="time t [s]", ylabel="heading, rudder [°]", ylim=_tall(source.run), xlim=(0.0, source.run.t[-1]))
    figures.legend_below(drawn, ax)
    return figures.svg(drawn, f"zigzag of {found.ship}")


def _helm(run: Trial) -> Array:
    """The rudder of a run; of two that of the port side."""
    return run[next(name for name in run.channels if name == "delta" or name.startswith("delta_"))]


def _tall(run: Trial) -> tuple[float, float]:
    """Limits of the headings: a draw that never turns back does not flatten the others."""
    most = 2.5 * _DEGREES * float(np.abs(run["psi"]).max())
    return -most, most


def _some(source: Source) -> Array:
    """Some tracks of draws, shape (draws, rows, 6); none of a run without."""
    if source.draws is None:
        return np.zeros((0, 0, 6))
    tracks = source.draws.tracks
    return tracks[np.linspace(0, len(tracks) - 1, min(_SHOWN, len(tracks))).astype(int)]


_RUNS = (
    (_circle, "Turning circle to both sides, at equal scale; thin lines are draws", "advance"),
    (_zigzag, "10/10 zigzag to starboard; thin lines are headings of draws", "second_overshoot"),
)


def _ends(row: Criterion) -> tuple[float, float]:
    """Edges of the band; the value itself where too few draws give it."""
    value = float(row.value or 0.0)
    band = row.band
    return (value, value) if band is None or math.isnan(band.low) else (band.low, band.high)


def _reasons(rows: Sequence[Criterion]) -> Body:
    """Each reason once, after the criteria that it belongs to."""
    reasons = dict.fromkeys(row.reason for row in rows if row.reason)
    said = [f"{', '.join(row.title for row in rows if row.reason == reason)}: {reason}" for reason in reasons]
    return heading("Reasons") + bullets(said) if said else ()
