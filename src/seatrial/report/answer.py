"""The first screen of a fit: whether to trust it, its errors, the cause of what is left, what to do, what it is for.

One value, that a terminal, a page, a notebook and JSON draw.  Errors are those of predictions so many seconds after
their start in the measured state, root mean square over the starts and trials that every label predicts.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Literal

import numpy as np

from ..core.once import by_identity
from ..core.values import dataclass
from ..data import Array
from ..identify import Fit
from ..identify.filters import CONSTANT_VELOCITY
from ..identify.posterior.verdicts import within
from ..validate import Comparison
from ..validate.fitness import FIT, NOT_FIT
from ..validate.metrics import reached
from .blocks import Body, Verdict, number
from .evidence import TIE, Evidence

SECONDS = (10.0, 60.0)
"""After how long errors are told [s]; a study whose predictions restart earlier tells its longest."""

_DEGREES = math.degrees(1.0)
# Parameters and purposes that a line names.
_NAMED = 3
# An error so many times another is the greater one however few starts there are.
_CLEARLY = 1.5
_THEN = "seatrial card MODEL -o card.html; seatrial calibrate MODEL widens its bands by what trials left out show"
_MORE = "seatrial design MODEL says which trials would tell more"
# A share of the motion above this is no more told by its digits [%].
_ALL = 99.9

Trust = Literal["yes", "predictions", "no", "unknown"]
_TRUST: Mapping[Trust, str] = {
    "yes": "Yes, for motions as in the trials, and for the parameters that they determine",
    "predictions": "Yes, for predictions with the errors below; its parameters as far as the last line says",
    "no": "No",
    "unknown": "Not known, as no trial was kept back: these are errors of trials of the fit",
}


@dataclass(frozen=True)
class Answer:
    """What a user wants to know of a fit first, SI units and radians.

    Attributes:
        trust: for what the fit can be trusted.
        why: the ground of a "no"; else how much of the motion it explains, and when its error passes the ship's length.
        errors: of position [m] and heading [rad], by seconds since the start, then by label.
        cause: the likeliest of what the fit leaves, with its size.
        further: what to do next.
        uses: verdict by purpose.
        parameters: how well the trials determine them.
    """

    trust: Trust
    why: str
    errors: Mapping[str, Mapping[str, tuple[float | None, float | None]]]
    cause: str
    further: str
    uses: Mapping[str, str]
    parameters: str

    @property
    def body(self) -> Body:
        """The lines."""
        grounds = [(f"Error after {end} s", _beside(found)) for end, found in self.errors.items()]
        grounds += [("Cause of what is left", self.cause), ("Next", self.further), ("Use", _uses(self.uses)),
                    ("Parameters", self.parameters)]  # fmt: skip
        return (Verdict(_TRUST[self.trust], self.why, tuple((name, said) for name, said in grounds if said)),)


def answered(found: Mapping[str, Any]) -> Answer:
    """The value from its fields as JSON has them."""
    return Answer(**found)


@by_identity
def answer(report: Evidence) -> Answer | None:
    """The first screen of a fit beside the ship before and constant velocity; None without one, or a comparison."""
    fit = report.fit
    if fit is None or not report.comparisons:
        return None
    shared = [found for found in report.trials.values() if len(found) == len(report.labels)]
    errors = {f"{end:g}": {label: _after([found[label] for found in shared], end) for label in report.labels}
              for end in _ends(report.comparisons)}  # fmt: skip
    errors = {end: by for end, by in errors.items() if any(error is not None for pair in by.values() for error in pair)}
    unseen = not all(name in report.trained_on for name in report.trials)
    lost = _lost(report, shared, errors)
    sure = fit.diagnosis is not None and not fit.diagnosis.lacking and any(
        one.status == "identified" for one in fit.verdicts)  # fmt: skip
    trust: Trust = "no" if lost else "unknown" if not unseen else "yes" if sure else "predictions"
    return Answer(
        trust, lost or _explains(shared, report.labels[0], errors, fit.ship.L_pp), errors, _cause(fit),
        _next(fit, trust), report.uses, _parameters(fit),
    )  # fmt: skip


def _ends(comparisons: Iterable[Comparison]) -> list[float]:
    longest = min((c.restart for c in comparisons if c.restart is not None), default=math.inf)
    return sorted({min(end, longest) for end in SECONDS})


def _after(found: Sequence[Comparison], end: float) -> tuple[float | None, float | None]:
    """Error of position and heading so long after a start."""
    rows = [reached(c.measured, c.predicted, c.restart, end) for c in found]
    return _root(_squares(rows)), _root([row["psi"] ** 2 for row in rows if "psi" in row])


def _places(found: Sequence[Comparison], end: float) -> list[Array]:
    """Squared error of position so long after each start, trial by trial."""
    return _squares([reached(c.measured, c.predicted, c.restart, end) for c in found])


def _squares(rows: Sequence[Mapping[str, Array]]) -> list[Array]:
    return [row["x"] ** 2 + row["y"] ** 2 for row in rows
            if {"x", "y"} <= row.keys() and row["x"].size == row["y"].size]  # fmt: skip


def _farther(ours: Sequence[Array], theirs: Sequence[Array]) -> bool:
    """Whether our errors from the same starts are clearly the greater, or beyond what these starts scatter by.

    Student's t of the differences of squares, one-sided at 97.5 %: near a steady turn both predict to within the noise
    of two fixes, and either may come out ahead.  A single start has no scatter, and is taken by its error.
    """
    first, second = (np.concatenate([np.zeros(0), *one]) for one in (ours, theirs))
    if first.size != second.size:
        return False
    known = np.isfinite(first) & np.isfinite(second)
    ratio = float(np.sqrt(first[known].sum() / second[known].sum())) if known.any() else 0.0
    worse, count = (first - second)[known], int(known.sum())
    if ratio <= 1.0 + TIE or count == 1 or ratio > _CLEARLY:
        return ratio > 1.0 + TIE
    from scipy.special import stdtrit

    return bool(worse.mean() > stdtrit(count - 1, 0.975) * worse.std(ddof=1) / math.sqrt(count))


def _root(squares: Sequence[Array]) -> float | None:
    known = np.concatenate([np.zeros(0), *squares])
    known = known[np.isfinite(known)]
    return float(np.sqrt(known.mean())) if known.size else None


def _lost(
    report: Evidence, shared: Sequence[Mapping[str, Comparison]],
    errors: Mapping[str, Mapping[str, tuple[float | None, float | None]]],
) -> str:  # fmt: skip
    """Who predicts better than the fitted ship; empty where nobody does."""
    pooled, subject = report.pooled, report.labels[0]
    mine = pooled[subject]
    for label in report.labels[1:]:
        if mine > (1.0 + TIE) * pooled[label]:
            return (f"'{label}' predicts these trials better (standardised error {number(pooled[label])} against "
                    f"{number(mine)})")  # fmt: skip
    for end in errors if CONSTANT_VELOCITY in report.labels else ():
        ours, steady = (_places([found[label] for found in shared], float(end))
                        for label in (subject, CONSTANT_VELOCITY))  # fmt: skip
        if _farther(ours, steady):
            return f"after {end} s its position is worse than that of constant velocity"
    return ""


def _explains(
    shared: Sequence[Mapping[str, Comparison]], subject: str,
    errors: Mapping[str, Mapping[str, tuple[float | None, float | None]]], length: float,
) -> str:  # fmt: skip
    """How much of the motion the model explains, and where its error passes a ship's length."""
    if not errors:
        return ""
    end, last = list(errors.items())[-1]
    ours, steady = last[subject][0], last.get(CONSTANT_VELOCITY, (None, None))[0]
    said: list[str] = []
    if ours is not None and steady:
        share = 100.0 * max(1.0 - (ours / steady) ** 2, 0.0)
        part = "more than 99.9" if share > _ALL else f"{share:.3g}"
        said.append(f"it explains {part} % of the motion after {end} s")
    ends = sorted({e for found in shared for e in found[subject].horizons})
    passed = [e for e in ends if (error := _within(shared, subject, e)) is not None and error > length]
    if ends:
        said.append(f"its error passes a ship's length within {passed[0]:g} s" if passed
                    else "its error stays below a ship's length")  # fmt: skip
    return "; ".join(said)


def _within(shared: Sequence[Mapping[str, Comparison]], subject: str, end: float) -> float | None:
    squares = [np.array([h["x"] ** 2 + h["y"] ** 2]) for found in shared
               if {"x", "y"} <= (h := found[subject].horizons.get(end, {})).keys()]  # fmt: skip
    return _root(squares)


def _cause(fit: Fit) -> str:
    found = fit.diagnosis
    if found is None:
        return ""
    if not found.lacking:
        return "none: it looks like sensor noise"
    if found.cause is not None:
        return found.cause.text
    return "no error of an instrument that was tested: a term of the model or an input is missing"


def _next(fit: Fit, trust: Trust) -> str:
    found = fit.diagnosis
    if found is not None and found.remedies:
        return found.remedies[0]
    if all(math.isfinite(free.sigma) for free in fit.free):  # the priors hold what the trials leave open
        return _MORE if trust == "no" else _THEN
    grouped = [one.text for one in fit.verdicts if one.subject not in fit.vector.paths]
    return grouped[0] if grouped else "predict trials that the fit has not seen: seatrial validate"


def _parameters(fit: Fit) -> str:
    """Of how many the trials tell something, how closely, and which they leave open."""
    status = {one.subject: one.status for one in fit.verdicts}
    known = [k for k, free in enumerate(fit.free) if status.get(free.path) in ("identified", "graded")]
    if not fit.free:
        return ""
    text = f"{len(known)} of {len(fit.free)} determined by these trials"
    if known:
        far = [100.0 * within(float(fit.values[k]), float(fit.sigma[k])) for k in known]
        low, high = number(min(far), 2), number(max(far), 2)
        text += f" within {low} %" if low == high else f" within {low} to {high} %"
        if any(status[fit.free[k].path] == "graded" for k in known):
            text += ", if the form is right"
    open_ = [free.path for free in fit.free if status.get(free.path) == "not identified"]
    if open_:
        more = f" and {len(open_) - _NAMED} more" if len(open_) > _NAMED else ""
        text += f"; not determined: {', '.join(open_[:_NAMED])}{more}"
    return text


def _beside(found: Mapping[str, tuple[float | None, float | None]]) -> str:
    """The errors of the first label, and beside it those of the others."""
    first, *others = [(label, _pair(*pair)) for label, pair in found.items()]
    aside = "; ".join(f"{label} {said}" for label, said in others)
    return f"{first[1]} ({aside})" if aside else first[1]


def _pair(place: float | None, turn: float | None) -> str:
    said = [f"{number(place, 2)} m"] if place is not None else []
    said += [f"{number(_DEGREES * turn, 2)}°"] if turn is not None else []
    return ", ".join(said) or "–"


def _uses(uses: Mapping[str, str]) -> str:
    order = (FIT, NOT_FIT, *(verdict for verdict in uses.values() if verdict not in (FIT, NOT_FIT)))
    parts = {verdict: [key for key, one in uses.items() if one == verdict] for verdict in order}
    return "; ".join(f"{verdict}: {', '.join(keys)}" for verdict, keys in parts.items() if keys)
