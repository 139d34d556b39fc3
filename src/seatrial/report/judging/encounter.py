"""One encounter to read: who had which part, what each ship did and when, which rules it broke; and a drawing of it.

The drawing has north up and one scale for both axes.  Marks along the tracks stand at equal times, numbered alike, so
that positions of one time are found; a diamond is where an action begins.  The inset has the other ships as the own one
sees them, north up, in the circle of the safe distance.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ...data import Array
from ...encounters import Tracks
from ...encounters.rules import OPEN_WATER, Judged, Limits, Role, Waters
from .. import figures
from ..blocks import Body, figure, number, table
from ..canvas.frame import Frame, label, whole

NAMES = {
    Role.NONE: "no risk", Role.HEAD_ON: "head-on", Role.OVERTAKING: "overtakes", Role.GIVE_WAY: "gives way",
    Role.STAND_ON: "stands on", Role.OVERTAKEN: "is overtaken", Role.UNSEEN: "restricted visibility",
    Role.YIELDS: "yields (Rule 18)",
}  # fmt: skip
"""Roles in words."""

_COLOURS = (figures.INK, figures.VERMILION, figures.BLUE, figures.GREEN, figures.PINK, figures.ORANGE, figures.SKY)
_DASHES = ("", "7 2", "3 2", "1 2", "7 2 1 2", "5 4", "2 4")
_HULL = ((1.0, 0.0), (0.3, 0.35), (-1.0, 0.35), (-1.0, -0.35), (0.3, -0.35))
_WIDTH, _INSET, _MARKS = 560, 190, 10
_LONG = 600.0
"""Times of shorter encounters have two decimals of a minute [s]."""
Where = tuple[int, ...]


def shown(
    tracks: Tracks, judged: Sequence[Judged], limits: Limits, where: Where = (), waters: Waters = OPEN_WATER
) -> Body:  # fmt: skip
    """Table and drawing of one run of the tracks; `where` is its place among them."""
    caption = _CAPTION if waters.chart is None else f"{_CAPTION} {_CHARTED}"
    picture = drawn(tracks, judged, limits, where, waters)
    return (*verdicts(tracks, judged, where), *figure(picture, caption, least=_WIDTH))


_CAPTION = (
    "Tracks with north up and equal scales; marks of one number are of one time [min]. A diamond: an action begins. "
    "A thin line: closest approach. Inset: other ships relative to the own one, circle of the safe distance."
)

_LAND, _SHOAL, _SAFE, _DEEP, _LANE = "#d9c79a", "#8fb8d9", "#c3dcec", "#eef5fa", "#b55ab5"
_COAST, _CONTOUR = "#6b5a2e", "#6f8fa8"
_CHARTED = (
    "Chart: land, water too shallow for the draught (dark), short of the safety depth (pale), deeper, coast and depth "
    "contours as lines; crosses are dangers, dashed lines lanes and fairways. Depths without tide."
)


def verdicts(tracks: Tracks, judged: Sequence[Judged], where: Where = ()) -> Body:
    """What each ship did towards each other with which there was risk of collision, and the rules that it broke."""
    rows = [_row(tracks, one, where) for one in judged if one.met.exists[where] or one.contact[where]]
    head = ("ship", "verdict", "part", "breaks", "risk from [min]", "acts [min]", "turns [°]", "slows [%]",
            "closest [m]", "hulls [m]")  # fmt: skip
    return table(head, rows, words=(0, 1, 2, 3, 6), wide=True)


def _row(tracks: Tracks, one: Judged, where: Where) -> tuple[str, ...]:
    own, t = one.own, tracks.t
    starboard, port = (math.degrees(float(side[where])) for side in (own.starboard, own.port))
    acted = bool(own.exists[where])
    role = NAMES[Role(int(one.role[where]))]
    also = [NAMES[r] for r in Role if one.met.accepted[(*where, r)] and r != one.role[where]]
    fine = 1 if t[-1] >= _LONG else 2
    return (
        f"{tracks.names[one.ship]} to {tracks.names[one.other]}",
        "contact" if one.contact[where] else "breach" if one.fails[where] else "kept",
        f"{role} (or {', '.join(also)})" if also else role,
        ", ".join(one.broken(where)) or "–",
        f"{t[one.met.begins[where]] / 60.0:.{fine}f}" if one.met.exists[where] else "–",
        f"{t[own.row[where]] / 60.0:.{fine}f}" if acted else "–",
        (f"{starboard:.0f} to starboard" if starboard >= port else f"{port:.0f} to port") if acted else "–",
        f"{100.0 * float(own.slowed[where]):.0f}" if acted else "–",
        number(float(one.at.distance[where])), number(float(one.gap[where])),
    )


def drawn(
    tracks: Tracks, judged: Sequence[Judged], limits: Limits, where: Where = (), waters: Waters = OPEN_WATER
) -> str:  # fmt: skip
    """The drawing of one run, SVG."""
    x, y, psi = (np.asarray(one[where]) for one in (tracks.x, tracks.y, tracks.psi))
    frame = _equal(x, y)
    parts = _sea(frame, waters)
    parts += [frame.line(y[k], x[k], _COLOURS[k % 7], width=1.6, dash=_DASHES[k % 7]) for k in range(len(x))]
    every = _every(tracks.t)
    hull = max(0.012 * (frame.y[1] - frame.y[0]), 0.5 * float(tracks.L.max()))
    for k in range(len(x)):
        parts += _marks(frame, tracks.t, (x[k], y[k], psi[k]), every, hull, _COLOURS[k % 7])
    for one in judged:
        parts += _events(frame, one, where, (x, y))
    names = [label(frame.left + 6, 20 + 13 * k, f"{'—' if not k else '- -'} {_told(tracks, judged, k, where)}",
                   _COLOURS[k % 7]) for k in range(len(x))]  # fmt: skip
    size = frame.left + frame.width + 12
    inset = _relative(tracks, x, y, psi, limits)
    body = [*frame.elements(parts, "east [m]", "north [m]"), *names,
            f'<g transform="translate({size:.0f} 0)">{"".join(inset)}</g>']  # fmt: skip
    return whole(size + _INSET + 60, max(frame.top + frame.height + frame.bottom, _INSET + 60), body)


def _sea(frame: Frame, waters: Waters) -> list[str]:
    """The chart within the frame, each area over those before it."""
    chart = waters.chart
    if chart is None:
        return []
    left, top, width, height = frame.left, frame.top, frame.width, frame.height

    def colour(depth: float) -> str:
        shades = ((0.0, _LAND), (waters.draught, _SHOAL), (waters.safety or waters.draught, _SAFE))
        return next((one for limit, one in shades if depth <= limit), _DEEP)

    def path(line: Array, closed: bool = True) -> str:
        points = " ".join("{:.1f},{:.1f}".format(*frame.at(float(east), float(north))) for north, east in line)
        return f"M{points}{'z' if closed else ''}"

    def near(line: Array) -> bool:
        (south, west), (north, east) = line.min(axis=0), line.max(axis=0)
        return bool(north >= frame.y[0] and south <= frame.y[1] and east >= frame.x[0] and west <= frame.x[1])

    found = [f'<rect x="{left}" y="{top}" width="{width}" height="{height}" fill="{colour(chart.depth)}"/>']
    found += [f'<path d="{" ".join(map(path, (one.outline, *one.holes)))}" fill="{colour(one.depth)}" '
              f'fill-rule="evenodd" stroke="{_SHOAL}" stroke-width=".5"/>'
              for one in chart.areas if near(one.outline)]  # fmt: skip
    found += [f'<path d="{path(line, False)}" fill="none" stroke="{_CONTOUR if depth else _COAST}" '
              f'stroke-width="{0.6 if depth else 1.2}"/>' for line, depth in chart.contours if near(line)]  # fmt: skip
    ways = [path(one.outline) for one in chart.lanes if near(one.outline)]
    ways += [path(line, False) for line in chart.fairways if near(line)]
    found += [f'<path d="{one}" fill="none" stroke="{_LANE}" stroke-width=".8" stroke-dasharray="6 3"/>'
              for one in ways]  # fmt: skip
    for spot in chart.dangers:
        if near(np.array([[spot.x, spot.y]])):
            a, b = frame.at(spot.y, spot.x)
            found.append(f'<path d="M{a - 3:.1f} {b:.1f}h6M{a:.1f} {b - 3:.1f}v6" stroke="{figures.INK}"/>')
    at = f'x="{left}" y="{top}" width="{width}" height="{height}" viewBox="{left} {top} {width} {height}"'
    return [f'<svg {at}>{"".join(found)}</svg>']  # what is beyond its frame is cut off


def _equal(x: Array, y: Array) -> Frame:
    """Axes of one scale around all tracks: east to the right, north up."""
    low, high = np.array([y.min(), x.min()]), np.array([y.max(), x.max()])
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    half = np.maximum(1.08 * half + 1.0, 0.3 * half.max())
    height = round((_WIDTH - 64) * half[1] / half[0])
    if height > _WIDTH:  # a tall encounter: room to its sides
        half[0] *= height / _WIDTH
        height = _WIDTH
    low, high = middle - half, middle + half
    return Frame(_WIDTH, height + 40, (low[0], high[0]), (low[1], high[1]), left=52, bottom=32)


def _every(t: Array) -> float:
    """Seconds between marks: whole minutes, about ten in all."""
    return 60.0 * max(1.0, math.ceil((t[-1] - t[0]) / 60.0 / _MARKS))


def _marks(
    frame: Frame, t: Array, ship: tuple[Array, Array, Array], every: float, hull: float, colour: str
) -> list[str]:
    """Hulls (not to scale where they would be too small to see) at equal times, and the minutes beside them."""
    found: list[str] = []
    for at in np.arange(t[0], t[-1] + 1e-6, every):
        x, y, psi = (float(np.interp(at, t, one)) for one in (ship[0], ship[1], np.unwrap(ship[2])))
        c, s = math.cos(psi), math.sin(psi)
        points = [frame.at(y + hull * (a * s + b * c), x + hull * (a * c - b * s)) for a, b in _HULL]
        place = " ".join(f"{a:.1f},{b:.1f}" for a, b in points)
        found.append(f'<polygon points="{place}" fill="{colour}" fill-opacity=".35" stroke="{colour}"/>')
        a, b = frame.at(y, x)
        found.append(label(a + 7, b - 4, f"{(at - t[0]) / 60.0:.0f}", colour))
    return found


def _events(frame: Frame, one: Judged, where: Where, place: tuple[Array, Array]) -> list[str]:
    """Where a ship's action begins, and the line between both at their closest approach."""
    found: list[str] = []
    x, y = place
    colour = _COLOURS[one.ship % 7]
    if one.met.exists[where] and one.own.exists[where]:
        k = int(one.own.row[where])
        a, b = frame.at(float(y[one.ship, k]), float(x[one.ship, k]))
        shape = f"M{a:.1f} {b - 6:.1f}l6 6l-6 6l-6 -6z"
        found.append(f'<path d="{shape}" fill="#fff" stroke="{colour}" stroke-width="1.6"/>')
    if one.met.exists[where] and one.ship < one.other:
        row, share = int(one.at.row[where]), float(one.at.share[where])
        ends = [tuple(float(axis[k, row] + share * (axis[k, row + 1] - axis[k, row])) for axis in (y, x))
                for k in (one.ship, one.other)]  # fmt: skip
        found.append(frame.line([end[0] for end in ends], [end[1] for end in ends], figures.SOFT, width=0.8))
    return found


def _told(tracks: Tracks, judged: Sequence[Judged], ship: int, where: Where) -> str:
    """Name of a ship and its part towards the own one, of the own one towards all."""
    mine = [one for one in judged if one.ship == ship and one.met.exists[where] and (ship == 0 or one.other == 0)]
    parts = [f"{NAMES[Role(int(one.role[where]))]}{f' to {tracks.names[one.other]}' if ship == 0 else ''}"
             for one in mine]  # fmt: skip
    return f"{tracks.names[ship]}: {'; '.join(parts) or 'no risk'}"


def _relative(tracks: Tracks, x: Array, y: Array, psi: Array, limits: Limits) -> list[str]:
    """The other ships as the own one sees them, north up, until they are as far off as they began at most."""
    north, east = x[1:] - x[0], y[1:] - y[0]
    far = 1.05 * max(float(np.hypot(north[:, 0], east[:, 0]).max()), 1.0)
    frame = Frame(_INSET + 60, _INSET + 50, (-far, far), (-far, far), left=46, bottom=32)
    frame.width = frame.height = min(frame.width, frame.height)
    a, b = frame.at(0.0, 0.0)
    ahead = 0.12 * far
    scale = frame.width / (2.0 * far)
    safe = float(limits.passing.of(tracks.L[:1].max(keepdims=True))[0])
    parts = [f'<circle cx="{a:.1f}" cy="{b:.1f}" r="{safe * scale:.1f}" fill="none" stroke="{figures.SOFT}"/>',
             frame.dot(0.0, 0.0, figures.INK, 2.0),
             frame.line([0.0, ahead * math.sin(psi[0, 0])], [0.0, ahead * math.cos(psi[0, 0])], figures.INK)]
    for k in range(len(north)):
        inside = np.hypot(north[k], east[k]) <= far
        parts.append(frame.line(np.where(inside, east[k], np.nan), north[k], _COLOURS[(k + 1) % 7], width=1.4,
                                dash=_DASHES[(k + 1) % 7]))  # fmt: skip
        parts.append(frame.dot(float(east[k, 0]), float(north[k, 0]), _COLOURS[(k + 1) % 7], 2.5))
    return frame.elements(parts, "relative east [m]", "relative north [m]")
