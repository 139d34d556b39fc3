"""The motion of a ship in waves, superposed on a run: manoeuvring is slow, waves are fast.

The manoeuvre is simulated with the mean forces alone; the motions to first order are read from operators at the
place, the heading and the velocity of that slow run and are added to it.  This holds as long as the waves are much
faster than the rudder's loop and the heel is small.  Parametric roll, broaching and what waves do to rudder and
propeller are not in it.
"""

from __future__ import annotations

import numpy as np

from ..data import Array, Trial
from ..environment.sea import Sea
from ..environment.sea.rao import Rao

UNITS = {"z": "m", "w": "m/s", "p": "rad/s", "q": "rad/s", "zeta": "m", "psi_slow": "rad"}
"""Channels that a run in waves has besides those of a trial: heave, its rate, rates of roll and pitch, the surface."""


def in_waves(run: Trial, sea: Sea, rao: Rao) -> Trial:
    """The run as instruments at midship would see it.

    x, y, psi, u, v_m and r become totals; phi, theta and heave z (down) with their rates p, q and w are added, phi
    and p to those of a model that heels, with the wave surface zeta (up) above midship, and `psi_slow`, the heading
    without waves.

    Raises:
        WeatherError: operators that do not cover the frequencies of the sea.
        DataError: a run without x, y, psi, u or v_m.
    """
    rao.covers(sea)
    x, y, psi, u, v = (run[name] for name in ("x", "y", "psi", "u", "v_m"))
    c, s = np.cos(psi), np.sin(psi)
    rate = np.column_stack([c * u - s * v, s * u + c * v])
    moved, speed = rao.motions(sea.waves, run.t, x, y, psi, rate)
    surge, sway, heave, roll, pitch, yaw = moved.T
    none = np.zeros_like(run.t)

    def with_slow(name: str, fast: Array) -> Array:
        return run.channels.get(name, none) + fast

    seen = run.having(
        x=x + c * surge - s * sway, y=y + s * surge + c * sway, psi=psi + yaw,
        u=u + speed[:, 0], v_m=v + speed[:, 1], r=with_slow("r", speed[:, 5]),
        z=with_slow("z", heave), phi=with_slow("phi", roll), theta=with_slow("theta", pitch),
        w=with_slow("w", speed[:, 2]), p=with_slow("p", speed[:, 3]), q=with_slow("q", speed[:, 4]),
        zeta=_surface(sea, run.t, x, y), psi_slow=psi,
    )  # fmt: skip
    return Trial(seen.name, seen.t, seen.channels, {**UNITS, **run.units}, seen.meta, run.file).noting(
        "first-order motion in waves superposed by operators")  # fmt: skip


def _surface(sea: Sea, t: Array, x: Array, y: Array) -> Array:
    parts = [slice(k, k + 2048) for k in range(0, t.size, 2048)]
    return np.concatenate([sea.waves.elevation(t[k], x[k], y[k]) for k in parts])
