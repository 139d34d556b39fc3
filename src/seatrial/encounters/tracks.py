"""The tracks of an own ship and of the ships around it, as what behaviour is judged on."""

from __future__ import annotations

import numpy as np

from ..core.errors import RequestError
from ..core.values import dataclass, field
from ..data import Array


@dataclass(frozen=True, eq=False)
class Tracks:
    """Ships in common time; the first is the own ship.

    Motions have any axes before the last two, such as one of runs, so that many runs are judged at once.

    Attributes:
        t: time [s], strictly increasing, shape (rows,).
        x, y, psi: place of midship north and east [m] and heading [rad], shape (..., ships, rows).
        u, v_m: velocity over ground ahead and to starboard [m/s], same shape.
        L, B: length and breadth [m], shape (ships,).
        names: of the ships; own, target 1, ... unless given.
    """

    t: Array
    x: Array
    y: Array
    psi: Array
    u: Array
    v_m: Array
    L: Array
    B: Array
    names: tuple[str, ...] = field(default=())

    def __post_init__(self) -> None:
        shape, ships = np.shape(self.x), len(self.L)
        if len(self.t) < 2 or not (np.diff(self.t) > 0.0).all():
            raise RequestError("tracks: t has to increase strictly, over two rows or more")
        if shape[-2:] != (ships, len(self.t)):
            raise RequestError(f"tracks: x has the shape {shape}; its last two are ships and rows, "
                               f"{ships} and {len(self.t)}")  # fmt: skip
        for name in ("x", "y", "psi", "u", "v_m"):
            values = getattr(self, name)
            if np.shape(values) != shape:
                raise RequestError(f"tracks: {name} has the shape {np.shape(values)}, x has {shape}")
            if not np.isfinite(values).all():
                raise RequestError(f"tracks: {name} has gaps; encounters are judged on whole tracks")
        if len(self.B) != ships or not ((self.L > 0.0).all() and (self.B > 0.0).all()):
            raise RequestError("tracks: every ship needs a length L and a breadth B above zero")
        if not self.names:
            object.__setattr__(self, "names", ("own", *(f"target {k}" for k in range(1, ships))))
        elif len(self.names) != ships:
            raise RequestError(f"tracks: {len(self.names)} names for {ships} ships")
