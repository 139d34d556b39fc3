"""What the printed percentages of six parameters (You 2023 Table 5) and their values (Table 4) can be.

Sets of six parameters run through the twelve manoeuvres in a calm, against the nine printed errors, by several ways to
define a relative error, of which the paper gives none.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from you2023_variants import PRINTED, QUANTITIES, Weather, of_rows

import seatrial as st

number = st.blocks.number

_DEGREES = math.degrees(1.0)
_YAW = {"inertia.m_33": 0.0632, "damping.N_r": -0.2629}

Pairs = Sequence[tuple[st.Array, st.Array]]
"""Predicted and measured rows of each run."""


def _rms(rows: st.Array) -> st.Array:
    return np.sqrt((rows**2).mean(axis=0))


def _all(pairs: Pairs) -> tuple[st.Array, st.Array]:
    """Errors and measured, all rows."""
    return np.concatenate([a - b for a, b in pairs]), np.concatenate([b for _, b in pairs])


def _norms(pairs: Pairs) -> st.Array:
    error, measured = _all(pairs)
    return _rms(error) / _rms(measured)


def _sizes(pairs: Pairs) -> st.Array:
    error, measured = _all(pairs)
    return np.abs(error).mean(axis=0) / np.abs(measured).mean(axis=0)


def _mean(pairs: Pairs) -> st.Array:
    return np.mean([_rms(a - b) / _rms(b) for a, b in pairs], axis=0)


def _median(pairs: Pairs) -> st.Array:
    return np.median([_rms(a - b) / _rms(b) for a, b in pairs], axis=0)


def _ends(pairs: Pairs) -> st.Array:
    return np.mean([np.abs((a - b)[-1]) / np.abs(b).max(axis=0) for a, b in pairs], axis=0)


WAYS: Mapping[str, Callable[[Pairs], st.Array]] = {
    "norms, all rows": _norms, "squares of these": lambda pairs: _norms(pairs) ** 2, "mean sizes": _sizes,
    "norms, mean of runs": _mean, "norms, median of runs": _median, "last row over the largest": _ends,
}  # fmt: skip
"""Ways to define a relative error of each velocity; the first is that of the page."""


@dataclass(frozen=True)
class Reading:
    """One set of six parameters, or another reading of the printed ones.

    Attributes:
        errors: in per cent by way, rows as `QUANTITIES`, columns as `VELOCITIES`.
        off: by way, the factor by which they are off the printed ones, geometric mean of the nine.
    """

    what: str
    errors: Mapping[str, st.Array]
    off: Mapping[str, float]


def readings(calm: Weather, small: st.Ship, printed: Mapping[str, Sequence[float]]) -> tuple[Reading, ...]:
    """All of them; `small` is the ship of Table 4, `printed` the errors of Table 5 by motion and quantity."""
    said = np.array([[pair[1] for name, pair in printed.items() if name.endswith(q)] for q in QUANTITIES])
    whole, local = (fits[st.rivals.RIVAL].ship for fits in (calm.variants[PRINTED].whole, calm.variants[PRINTED].local))
    ships = {
        "Table 4 as printed": small,
        "Table 4, yaw for degrees a second": small.having({k: v * _DEGREES for k, v in _YAW.items()}),
        "Table 4, yaw a hundred times": small.having({k: v * 100.0 for k, v in _YAW.items()}),
        "A by single steps (LO)": local, "A by whole runs (GO)": whole,
        "A by whole runs, yaw of Table 4": whole.having(_YAW),
    }  # fmt: skip
    return tuple(_read(what, ship, calm.trials, said) for what, ship in ships.items())


def _read(what: str, ship: st.Ship, trials: Sequence[st.Trial], said: st.Array) -> Reading:
    dt = trials[0].dt
    sides = [(of_rows(run, dt), of_rows(t.stack(*st.rivals.VELOCITIES), dt))
             for run, t in zip(st.rivals.free_runs(ship, trials), trials, strict=True)]  # fmt: skip
    errors = {way: 100.0 * np.array([by([(a[q], b[q]) for a, b in sides]) for q in QUANTITIES])
              for way, by in WAYS.items()}  # fmt: skip
    off = {way: float(np.exp(np.sqrt((np.log(found / said) ** 2).mean()))) for way, found in errors.items()}
    return Reading(what, errors, off)


def section(found: Sequence[Reading], printed: Mapping[str, Sequence[float]]) -> st.blocks.Body:
    """The table of readings, and what follows."""
    first = next(iter(WAYS))
    said = [[pair[1] for name, pair in printed.items() if name.endswith(q)] for q in QUANTITIES]
    rows = [["printed", *map(_three, said), "", ""]]
    for one in found:
        best = min(one.off, key=lambda way, one=one: one.off[way])
        least = f"{number(one.off[best], 2)}, {best}"
        rows.append([one.what, *map(_three, one.errors[first]), number(one.off[first], 2), least])
    head = ["six parameters", *QUANTITIES, "off by", "least of six ways"]
    remark = (
        "Per cent, surge / sway / yaw, whole runs, calm, twelve trials; off by: factor, root mean square of the "
        "logarithms of the nine ratios; yaw: m_33 and d_33. What follows: (1) Surge and sway of Table 4 are "
        "what single steps give, within an eighth, and not what whole runs give: the table looks like a result of LO. "
        "(2) m_33 and d_33 are best understood for rates in degrees a second: read so, the errors of yaw are "
        "of the size printed instead of twenty thousand per cent, and of all sets this one is nearest. It is no "
        "proof: they would be 3.6 kg m² and 15 kg m²/s, and single steps give 82 and 31. (3) No set and no "
        "definition has surge or sway velocity off by much more than 100 %. With X_u "
        "= 44 kg/s and the thrust of Eq. 20 the speed of a straight run is at most 1.35 times the measured, so 215 % "
        "needs another thrust, another X_u or an error divided by something smaller than the measured speed. None of "
        "these is in the paper, and so these two stay unexplained."
    )
    return (
        st.blocks.heading("What the printed six parameters can be") + st.blocks.table(head, rows, words=(5,))
        + st.blocks.soft(remark)
    )


def _three(values: Sequence[float] | st.Array) -> str:
    return " / ".join(number(float(value), 3) for value in values)
