"""The space of encounters as a picture: where the other ship bears at the start, and how it heads, in cells of 30 deg.

Both angles together fix who has which part.  Ships meet only in some cells, each at some ratio of speeds; of those in
which they can, the empty ones are what was not tried.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ...core.values import dataclass
from ...data import Array
from ...encounters.meeting import Meeting
from ...encounters.rules.geometry import Bools, wrapped
from .. import figures
from ..blocks import Body, figure
from ..canvas.frame import Frame, label

CELLS = 12
_RATIOS = (0.25, 2.0)
"""Speeds of others over the own one that count as possible: the range of DNV's generator."""
_FINE = 6
_CAPTION = (
    "Cells by number of ships met; the red part of a cell is of runs that failed. Crossed out: ships of 0.25 to 2 "
    "times the own speed can meet there, and none was tried. White: none can."
)
_FAR = 5e5
"""Ships so far off stand for nobody [m]."""


@dataclass(frozen=True, eq=False)
class Space:
    """Runs by cell; first axis the bearing from the own bow, second the course relative to the own one, from -180 deg.

    Attributes:
        tried, broken: other ships met there, and those of runs that failed; shape (CELLS, CELLS).
        possible: cells in which ships can meet.
    """

    tried: NDArray[np.intp]
    broken: NDArray[np.intp]
    possible: Bools

    @property
    def hit(self) -> tuple[int, int]:
        """Cells tried, of those that are possible."""
        return int((self.possible & (self.tried > 0)).sum()), int(self.possible.sum())


def space(meeting: Meeting, failed: Bools) -> Space:
    """Where the other ships of runs are; `failed` is of shape (runs,)."""
    beta, psi = np.arctan2(meeting.y, meeting.x), wrapped(np.asarray(meeting.psi, dtype=np.float64))
    there = np.hypot(meeting.x, meeting.y) < _FAR
    runs = np.broadcast_to(failed[:, None], beta.shape)
    return Space(_counted(beta[there], psi[there]), _counted(beta[there & runs], psi[there & runs]), _possible())


def _counted(beta: Array, psi: Array) -> NDArray[np.intp]:
    k, j = (np.clip(((one + math.pi) / (2.0 * math.pi) * CELLS).astype(int), 0, CELLS - 1) for one in (beta, psi))
    found = np.zeros((CELLS, CELLS), dtype=np.intp)
    np.add.at(found, (k, j), 1)
    return found


def _possible() -> Bools:
    """Cells in which a ship of some ratio k of speeds is on a steady bearing and draws near.

    The relative velocity is along the bearing where k sin(beta - psi) = sin(beta), and draws near where
    cos(beta) > k cos(psi - beta).
    """
    step = 2.0 * math.pi / CELLS
    at = -math.pi + step * (np.arange(CELLS * _FINE) + 0.5) / _FINE
    beta, psi = np.meshgrid(at, at, indexing="ij")
    with np.errstate(divide="ignore", invalid="ignore"):
        k = np.sin(beta) / np.sin(beta - psi)
        meets = (k >= _RATIOS[0]) & (k <= _RATIOS[1]) & (np.cos(beta) > k * np.cos(psi - beta))
    return np.asarray(meets.reshape(CELLS, _FINE, CELLS, _FINE).any(axis=(1, 3)))


def drawn(found: Space) -> Body:
    """The picture: shade by how many were tried, red by the share that failed, hatched where nothing was tried."""
    frame = Frame(520, 440, (-180.0, 180.0), (-180.0, 180.0), left=52, bottom=36)
    size = 360.0 / CELLS
    most = max(int(found.tried.max()), 1)
    parts: list[str] = []
    for k, j in np.ndindex(CELLS, CELLS):
        x, y = (-180.0 + size * k, -180.0 + size * (k + 1)), (-180.0 + size * j, -180.0 + size * (j + 1))
        tried, broken = int(found.tried[k, j]), int(found.broken[k, j])
        if tried:
            parts.append(frame.span(x, y, figures.BLUE, 0.12 + 0.5 * math.sqrt(tried / most)))
            parts += [frame.span((x[0], x[1]), (y[0], y[0] + size * broken / tried), figures.VERMILION, 0.75)]
            parts.append(label(frame.at(x[0] + 0.5 * size, 0.0)[0], frame.at(0.0, y[0] + 0.4 * size)[1], f"{tried}",
                               figures.INK, anchor="middle"))  # fmt: skip
        elif found.possible[k, j]:
            parts.append(frame.span(x, y, figures.SOFT, 0.18))
            parts.append(frame.line(x, y, figures.SOFT))
    svg = frame.svg(parts, "bearing of the other ship from the own bow [°]", "its course relative to the own one [°]")
    return figure(svg, _CAPTION, least=480, most=640)
