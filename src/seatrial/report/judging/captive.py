"""Page of a fit to captive tests: coefficients beside those before, and residuals by kind of test."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ...core.parameters import read, specs
from ...data import Array
from ...data.captive import OTHER_LOAD
from ...identify.regression.captive import CaptiveFit
from .. import figures
from ..blocks import Body, fields, figure, gallery, lead, number, soft, table
from ..figures import legend_below, panels, svg
from ..page import Page, Section
from ..page import provenance as origin

_DEGREES = math.degrees(1.0)
_LOADS = {"X": "X [N]", "Y": "Y [N]", "N": "N [N m]", "T": "T [N]", "F_N": "F_N [N]"}


def page(found: CaptiveFit, provenance: Mapping[str, str]) -> Page:
    """The whole page."""
    title = f"{found.ship.name}: coefficients from captive tests"
    return Page(title, (Section("", fields({"title": title})), *sections(found), origin(provenance)))


def sections(found: CaptiveFit) -> tuple[Section, ...]:
    """Outcome, coefficients, what is held, and the residuals of each kind of test."""
    return (
        Section("", fields(numbers(found), _head(found))),
        Section("Coefficients of the captive tests", _coefficients(found)),
        Section("Parameters that the tests do not determine", _held(found)),
        Section("Loads by kind of test", _loads(found)),
    )


def numbers(found: CaptiveFit) -> dict[str, object]:
    """The fit as JSON has it, SI units and radians."""
    status = {v.subject: v for v in found.verdicts}
    return {
        "ship": found.ship.name, "began": found.began.name, "runs": len(found.runs), "repeated": found.runs.repeated,
        "kinds": _counts(found), "noise": {k: {"straight": a, "oblique": b} for k, (a, b) in found.noise.items()},
        "explained": dict(found.explained),
        "parameters": {
            path: {"value": float(value), "sigma": float(sigma), "before": float(read(found.began.model, path)),
                   "unit": specs(found.ship.model)[path].unit, "verdict": status[path].status,
                   "text": status[path].text, "determined_by": dict(found.determined_by[path])}
            for path, value, sigma in zip(found.paths, found.values, found.sigma, strict=True)
        },
        "held": dict(found.held),
        "combinations": [{"of": v.subject, "text": v.text} for v in found.verdicts if " and " in v.subject],
    }  # fmt: skip


def in_words(found: CaptiveFit) -> str:
    """Runs and kinds of test in one line."""
    kinds = ", ".join(f"{count} {kind}" for kind, count in _counts(found).items())
    again = f"; {found.runs.repeated} rows repeat a run and count once" if found.runs.repeated else ""
    return f"{len(found.runs)} runs of a model of {found.runs.L_pp:g} m ({kinds}){again}"


def _counts(found: CaptiveFit) -> dict[str, int]:
    kinds = found.runs.kinds
    return {kind: kinds.count(kind) for kind in dict.fromkeys(kinds)}


def _head(found: CaptiveFit) -> Body:
    rows = [
        [_LOADS[name], number(straight), number(oblique), f"{100.0 * found.explained[name]:.2f} %"]
        for name, (straight, oblique) in found.noise.items()
    ]
    head = ("load", "misfit straight ahead", "misfit with drift or yaw", "variance explained")
    remark = (
        "The misfit is that of one run, in the unit of the load and at the scale of the test; it weighs the runs. With "
        "drift or yaw it holds what the terms of the model lack, besides the noise of the gauge."
    )
    return lead(f"{in_words(found)}.") + table(head, rows) + soft(remark)


def shown(path: str, value: float, unit: str, L_pp: float) -> float:
    """A number as tables print it: lengths over L_pp."""
    return value / L_pp if unit == "m" else value


def _coefficients(found: CaptiveFit) -> Body:
    meanings, status = specs(found.ship.model), {v.subject: v for v in found.verdicts}
    rows: list[list[str]] = []
    for path, value, sigma in zip(found.paths, found.values.tolist(), found.sigma.tolist(), strict=True):
        unit, L = meanings[path].unit, found.ship.L_pp
        before, now, spread = (shown(path, v, unit, L) for v in (float(read(found.began.model, path)), value, sigma))
        kinds = found.determined_by[path].items()
        by = ", ".join(f"{kind} (×{'∞' if math.isinf(ratio) else f'{ratio:.1f}'})" for kind, ratio in kinds)
        rows.append([path, "'" if unit in ("'", "m") else unit, number(before), number(now), number(spread, 2),
                     number((now - before) / spread, 2), status[path].status, by or "all alike"])  # fmt: skip
    head = ("parameter", "unit", "before", "captive", "sigma", "difference / sigma", "verdict", "determined by")
    combined = [f"{v.subject}: {v.text}." for v in found.verdicts if " and " in v.subject]
    remark = (
        f"Before: {found.began.name}. Determined by: kinds of test without which sigma is larger, with the factor. "
        "Sigma is the larger of that of independent errors and that of leaving out one condition at a time. "
        + " ".join(combined)
    )
    return table(head, rows, words=(1, 6, 7)) + soft(remark)


def _held(found: CaptiveFit) -> Body:
    if not found.held:
        return ()
    meanings = specs(found.ship.model)
    rows = [
        [path, number(shown(path, float(read(found.ship.model, path)), meanings[path].unit, found.ship.L_pp)), why]
        for path, why in found.held.items()
    ]
    remark = f"Held at the value of {found.began.name}; lengths over L_pp."
    return table(("parameter", "held at", "why"), rows, words=(2,)) + soft(remark)


def _loads(found: CaptiveFit) -> Body:
    kinds = np.array(found.runs.kinds)
    drawn = [
        figure(_drawn(found, kinds == kind, kind), f"{kind}: measured and computed loads, and measured less computed")
        for kind in dict.fromkeys(found.runs.kinds) if (kinds == kind).sum() > 1
    ]  # fmt: skip
    return gallery(*drawn)


def _abscissa(found: CaptiveFit, rows: NDArray[np.bool_], kind: str) -> tuple[Array, str]:
    """What a kind of test varies most."""
    runs = found.runs
    if OTHER_LOAD in kind:
        return runs.U[rows], "U [m/s]"
    if kind.startswith("drift"):
        return _DEGREES * runs.beta[rows], "β [°]"
    if kind.startswith("yaw"):
        return (runs.column("r") * runs.L_pp / runs.U)[rows], "r'"
    if kind.startswith("rudder"):
        return _DEGREES * runs.column("delta")[rows], "δ [°]"
    return np.arange(int(rows.sum()), dtype=np.float64), "run"


def _drawn(found: CaptiveFit, rows: NDArray[np.bool_], kind: str) -> str:
    """Left the loads, right measured less computed, a row each."""
    x, words = _abscissa(found, rows, kind)
    order = np.argsort(x, kind="stable")
    names = tuple(found.noise)
    drawn, axes = panels(len(names), 2, (7.4, 1.3 * len(names) + 0.6))
    for k, name in enumerate(names):
        left, right = axes[k]
        measured, computed = found.runs.loads[name][rows][order], found.predicted[name][rows][order]
        left.plot(x[order], computed, color=figures.VERMILION, marker="x", ms=5, ls="none", label="computed", zorder=3)
        left.plot(x[order], measured, color=figures.INK, marker="o", ms=4.5, mfc="white", ls="none", label="measured")
        misfit = found.noise[name][int("drift" in kind or "yaw" in kind or kind.startswith("PMM"))]
        right.axhspan(-misfit, misfit, color=figures.TINT, zorder=0)
        right.axhline(0.0, color=figures.RULE, lw=0.8)
        right.plot(x[order], measured - computed, color=figures.BLUE, marker="o", ms=3.5, ls="none")
        left.set_ylabel(_LOADS[name])
    axes[0, 0].set_title("load")
    axes[0, 1].set_title("measured − computed (band: misfit)")
    for ax in axes[-1]:
        ax.set_xlabel(words)
    legend_below(drawn, axes[0, 0])
    return svg(drawn, f"captive {kind}")
