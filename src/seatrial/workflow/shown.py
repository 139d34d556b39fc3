"""Summaries of finished runs for a terminal, read from their documents, one function for each schema."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..report.report import Report
from . import Document, Shown, Table, figure

_DEGREE = math.pi / 180.0


def shown(document: Document, out: Path, kept_back: bool) -> tuple[Shown, ...]:
    """The summary of the run in `out`.

    Args:
        document: what `plans.Plan.document` returns.
        kept_back: whether it is judged on trials that the fit has not seen.
    """
    of = "trials kept back" if kept_back else "the training trials (none was kept back)"
    summary = _SUMMARIES.get(str(document["schema"]))
    return (_wrote(out),) if summary is None else summary(document, out, of)


def comparisons(report: Report) -> Table:
    """Standardised errors by trial and label, the pooled ones last."""
    labels = report.labels
    rows = [
        (name, *(figure(found[label].standardised) if label in found else "failed" for label in labels))
        for name, found in report.trials.items()
    ]
    rows.append(("pooled", *(figure(report.pooled[label]) for label in labels)))
    return Table(("standardised error", *labels), tuple(rows), tuple(range(1, len(labels) + 1)))


def _fit(found: Mapping[str, Any], out: Path, of: str) -> tuple[Shown, ...]:
    """Parameters, standardised errors and forecasts of one fit."""
    status = {v["subject"]: v["status"] for v in found["verdicts"]}
    rows = tuple(
        (path, figure(p["start"]), figure(p["value"]), figure(p["sigma"], 2), figure(p["shrinkage"], 2),
         "at bound" if p["at_bound"] else status.get(path, ""))
        for path, p in found["parameters"].items()
    )  # fmt: skip
    head = ("parameter", "start", "fitted", "sigma", "from data", "verdict")
    parameters = (Table(head, rows, (1, 2, 3, 4)),) if rows else ()  # a network has weights, no parameters
    return (
        *parameters,
        *(f"standardised error on {of}, {label}: {figure(value)}" for label, value in found["standardised"].items()),
        *(f"forecast of {f['trial']} over {f['horizon']:g} s, {f['label']}: {figure(f['position'])} m, "
          f"{figure(f['heading'] / _DEGREE)} deg" for f in found["forecasts"]),
        f"{found['status']}; {found['seconds']:.1f} s; {_wrote(out)}",
    )  # fmt: skip


def _tuning(found: Mapping[str, Any], out: Path, _: str) -> tuple[Shown, ...]:
    """Losses of each range of a fine-tuning, and its findings."""
    before = [figure(sum(found["untuned"][key].values())) for key in ("tune", "test")]
    rows: list[tuple[str, ...]] = [("untuned", *before, "", "", "", "")]
    for r in found["ranges"]:
        totals = [figure(sum(r[key].values())) for key in ("tune", "test", "left_out")]
        stuck = sum(p["at_bound"] for p in r["parameters"].values())
        chosen = " chosen" if r["ratio"] == found["chosen"] else ""
        seconds = " + ".join(f"{m['seconds']:.1f}" for m in r["methods"].values())
        bounds = f"{stuck} of {len(r['parameters'])}"
        rows.append((f"{r['ratio']:g}{chosen}", *totals, bounds, figure(r["apart"], 2), seconds))
    head = ("a_r", "J tuning", "J test", "J left out", "at a bound", "methods apart", "seconds, CMA-ES + gradient")
    findings = (f"{'warning: ' if f['severity'] == 'warning' else ''}{f['where']}: {f['text']}"
                for f in found["findings"])  # fmt: skip
    return Table(head, tuple(rows), (1, 2, 3, 4, 5, 6)), *findings, _wrote(out)


def _shooting(found: Mapping[str, Any], out: Path, _: str) -> tuple[Shown, ...]:
    """Relative errors of a model, its rival and the truth in each weather, and the servos."""
    rows: list[tuple[str, ...]] = []
    for name, case in found["cases"].items():
        off = max(abs(z) for z in case["sigmas_off"].values())
        for who, score in case["scores"].items():
            errors = (_percent(score["relative"][v]) for v in ("u", "v_m", "r"))
            label = f"{len(case['fits'][who]['parameters'])} parameters" if who in case["fits"] else who
            full = (figure(max(case["model_over_truth"].values())), figure(off)) if who == "full" else ("", "")
            rows.append((name, label, *errors, *full))
    head = ("weather", "model", "surge", "sway", "yaw", "50 steps / truth", "sigma off at most")
    servos = (f"{name}: {figure(servo['rate'], 5)} rad/s +- {figure(servo['sigma']['rate'], 2)}"
              for name, servo in found["servos"].items())  # fmt: skip
    return Table(head, tuple(rows), (2, 3, 4, 5, 6)), *servos, _wrote(out)


def _table(found: Mapping[str, Any], out: Path, _: str) -> tuple[Shown, ...]:
    """Errors of each model of a table of fits on each test, and its claims."""
    tests = [*found["tests"], "together"]
    rows = tuple(
        (key, str(len(one["seeds"])), *(_error(one, test) for test in tests)) for key, one in found["models"].items()
    )
    claims = (f"{claim['says']}: " + ", ".join(f"{row['test']}: {row['verdict']}" for row in claim["rows"])
              for claim in found["claims"])  # fmt: skip
    table = Table(("standardised error", "seeds", *tests), rows, tuple(range(1, len(tests) + 2)))
    return table, *claims, f"wrote {out}/report.html, {out}/report.json"


def _wrote(out: Path) -> str:
    return f"wrote {out}/model.toml, {out}/report.html"


def _percent(share: float | None) -> str:
    return "blows up" if share is None else f"{figure(100.0 * share)} %"


def _error(one: Mapping[str, Any], test: str) -> str:
    mean, spread = one["mean"][test], one["standard_deviation"][test]
    if mean is None:
        return "no number" if one["seeds"] else ""
    return figure(mean, 3) + ("" if spread is None else f" +- {figure(spread, 2)}")


_SUMMARIES = {
    "seatrial-fit/1": _fit, "seatrial-tuning/1": _tuning, "seatrial-shooting/1": _shooting,
    "seatrial-networks/1": _table,
}  # fmt: skip
