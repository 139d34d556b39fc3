"""Page of the recordings in a folder: a table, and of each its track, speed, heading and controls."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from itertools import groupby

import numpy as np

from ..data import Array, unwrapped
from ..data.kinds import ABOUT
from ..validate.folder import Entry, Survey
from . import figures
from .blocks import bullets, fields, figure, gallery, heading, lead, line, note, number, soft, table
from .page import Page, Section

_DEGREE = math.degrees(1.0)
_POINTS, _DOTS = 300, 2500
_HEAD = ("recording", "recognised", "told", "time [s]", "u [m/s]", "rudder [°]", "revs [1/s]", "new")
_MARK = {"agrees": "✓", "close": "≈", "differs": "✗", "": ""}
_SIZE = (7.4, 3.3)
_RATES = ("r", "delta")
_SPAN = " … "


def page(found: Survey) -> Page:
    """Table first, then a figure of every recording, kind by kind."""
    some = sorted(found.entries.items(), key=lambda one: (list(found.counts).index(one[1].kind.name), one[0]))
    hours = sum(entry.trial.duration for _, entry in some) / 3600.0
    counted = ", ".join(f"{count} {name}" for name, count in found.counts.items())
    first = lead(f"{len(some)} recordings, {number(hours)} h: {counted}.") + note("", warnings(found))
    first += note("Unreadable, and on no other place of this page:", list(found.folder.unread.values()))
    legend = "Told: by the sidecar or the reader (✓ agrees, ≈ one is part of the other, ✗ differs). "
    legend += "Ranges: 1st to 99th percentile. New: samples unlike any of the other recordings "
    legend += f"({found.uncovered})." if found.uncovered else "(1 % is usual for more of the same)."
    rows = (_row(name, entry) for name, entry in some)
    body = table(_HEAD, rows, words=(1, 2), wide=True) + soft(legend)
    doubtful = [
        f"{name}: {entry.kind.label}: {'; '.join(entry.kind.doubts)}" for name, entry in some if entry.kind.doubts
    ]
    body += heading("Doubts") + bullets(doubtful) if doubtful else ()
    parts = [Section("", first), Section("Recordings", body)]
    if drawn := _plane(found):
        plane = figure(drawn, f"Some {_DOTS} samples of all recordings, by kind")
        parts.append(Section("Where the samples lie", gallery(plane, least=800)))
    for kind, group in groupby(some, key=lambda one: one[1].kind.name):
        shown = (figure(_drawn(name, entry), _caption(name, entry)) for name, entry in group)
        parts.append(Section(kind, line(f"{ABOUT[kind]}.") + gallery(*shown)))
    title = f"Trials in {found.folder.root.name or found.folder.root}"
    return Page(title, (Section("", fields(numbers(found))), *parts))


def warnings(found: Survey) -> list[str]:
    """Recordings that hold the same rows, and kinds that differ from what the sidecar says."""
    out = [str(one) for one in found.overlaps]
    out += [f"{name}: told as {entry.told}, recognised as {entry.kind.label} ({'; '.join(entry.kind.evidence)})"
            for name, entry in found.entries.items() if entry.verdict == "differs"]  # fmt: skip
    return [*out, *(f"{name}: {held(entry)}" for name, entry in found.entries.items() if entry.parts)]


def held(entry: Entry) -> str:
    """The manoeuvres of a recording of several, each with its time by the clock."""
    told = "; ".join(f"{one.kind.label} {one.when(entry.trial)}" for one in entry.parts)
    several = f"{len(entry.parts)} manoeuvres in one file" if len(entry.parts) > 1 else "a manoeuvre among other things"
    return f"{several}: {told}"


def numbers(found: Survey) -> dict[str, object]:
    """The survey as JSON has it, SI units and radians."""
    return {
        "folder": str(found.folder.root), "format": found.folder.format or None, "counts": found.counts,
        "trials": {name: {
            "file": str(found.folder.files[name]), "duration": entry.trial.duration, "dt": entry.trial.dt,
            "rows": len(entry.trial), "channels": list(entry.trial.channels), "kind": entry.kind.name,
            "label": entry.kind.label, "settings": dict(entry.kind.settings), "evidence": list(entry.kind.evidence),
            "doubts": list(entry.kind.doubts), "told": entry.told or None, "compared": entry.verdict or None,
            "ranges": {channel: list(pair) for channel, pair in entry.ranges.items()}, "new": entry.new,
            "parts": [{"kind": one.kind.name, "label": one.kind.label, "start": one.start, "stop": one.stop}
                      for one in entry.parts],
        } for name, entry in found.entries.items()},
        "unread": dict(found.folder.unread),
        "overlaps": [{"trials": list(one.trials), "evidence": one.evidence} for one in found.overlaps],
    }  # fmt: skip


def span(entry: Entry, channel: str) -> str:
    """Range of a channel in the units of the page; a dash where it is not recorded."""
    if channel not in entry.ranges:
        return "–"
    low, high = (value * (_DEGREE if channel in _RATES else 1.0) for value in entry.ranges[channel])
    widest = max(abs(low), abs(high), 1e-12)
    if high - low < 0.02 * widest:
        return number(0.5 * (low + high), 3)
    digits = max(0, 1 - math.floor(math.log10(widest)))
    return _SPAN.join(f"{0.0 if abs(value) < 0.5 * 10.0**-digits else value:.{digits}f}".replace("-", "−")
                      for value in (low, high))  # fmt: skip


def _row(name: str, entry: Entry) -> tuple[str, ...]:
    told = f"{_MARK[entry.verdict]} {entry.told}".strip() or "–"
    new = f"{100 * entry.new:.1f} %" if math.isfinite(entry.new) else "–"
    return (name, entry.kind.label, told, f"{entry.trial.duration:.0f}",
            *(span(entry, channel) for channel in ("u", "delta", "n_P")), new)  # fmt: skip


def _caption(name: str, entry: Entry) -> str:
    seen = "; ".join((*entry.kind.evidence, *(f"doubt: {one}" for one in entry.kind.doubts)))
    return f"{name}: {entry.kind.label}. {seen}"


def _plane(found: Survey) -> str:
    """Rate of turn and rudder over speed, one sample a second, each kind in its colour; empty without such channels."""
    fit = [entry for entry in found.entries.values() if "u" in entry.trial and "r" in entry.trial]
    if not fit:
        return ""
    total = sum(len(entry.trial) for entry in fit)
    drawn, axes = figures.panels(1, 2, (9.0, 3.6))
    kinds = list(dict.fromkeys(entry.kind.name for entry in fit))
    for k, kind in enumerate(kinds):
        colour, _, mark = figures.LINES[k % len(figures.LINES)]
        for j, entry in enumerate(one for one in fit if one.kind.name == kind):
            rows = slice(None, None, max(1, total // _DOTS))
            for ax, channel in zip(axes[0], ("r", "delta"), strict=True):
                if channel in entry.trial:
                    ax.plot(entry.trial["u"][rows], _DEGREE * entry.trial[channel][rows], mark, ms=2.0, color=colour,
                            alpha=0.5, mew=0, label=kind if j == 0 else None)  # fmt: skip
    for ax, what in zip(axes[0], ("r [°/s]", "rudder δ [°]"), strict=True):
        ax.set(xlabel="u [m/s]", ylabel=what)
    axes[0, 0].legend()
    return figures.svg(drawn, "plane")


def _drawn(name: str, entry: Entry) -> str:
    """The track, north up at equal scale, beside speed, heading and controls over time."""
    trial = entry.trial
    rows = slice(None, None, max(1, len(trial) // _POINTS))
    tracked = all(one in trial and np.isfinite(trial[one]).any() for one in ("x", "y"))
    curves = list(_curves(entry))
    drawn, axes = figures.panels(max(len(curves), 1), 2 if tracked else 1, _SIZE)
    for ax, (label, values) in zip(axes[:, -1], curves, strict=False):
        for k, own in enumerate(values.values()):
            colour, dashes, _ = figures.LINES[k % len(figures.LINES)]
            ax.plot(trial.t[rows], own[rows], color=colour if len(values) > 1 else figures.INK, ls=dashes, lw=1.1)
        ax.set_ylabel(label)
        ax.y.size, ax.y.bins = 8.0, 4
    axes[-1, -1].set_xlabel("time t [s]")
    if tracked:
        ax = drawn.tall(0)
        figures.measured_track(ax, trial)
        figures.frame(ax, (), (trial["y"], trial["x"]))
        ax.x.bins = ax.y.bins = 5
    return figures.svg(drawn, f"trial {name}")


_CONTROLS = (("delta", "δ [°]", _DEGREE), ("steering", "steering [%]", 100.0), ("alpha", "α [°]", _DEGREE),
             ("n", "n [1/s]", 1.0), ("f", "f [N]", 1.0), ("throttle", "throttle [%]", 100.0))  # fmt: skip
"""Beginnings of the names of controls, their labels and what they are multiplied by."""


def _curves(entry: Entry) -> Iterator[tuple[str, Mapping[str, Array]]]:
    """What is drawn over time: label, then lines by name."""
    trial = entry.trial
    if "u" in trial:
        yield "u [m/s]", {"u": trial["u"]}
    if "psi" in trial:
        yield "ψ [°]", {"psi": _DEGREE * unwrapped(trial["psi"])}
    elif "r" in trial:
        yield "r [°/s]", {"r": _DEGREE * trial["r"]}
    for kind, label, factor in _CONTROLS:
        names = [name for name in trial.channels if name.partition("_")[0] == kind]
        names = [name for name in names if not name.endswith("_cmd")] or names
        if names:
            yield label, {name: factor * trial[name] for name in sorted(names)}
