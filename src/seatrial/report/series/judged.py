"""Report of a table of fits: errors of each model on each test trial over its seeds (Wakita 2022, Table 9)."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from ...belief.coverage import Coverage, Reference, coverage
from ...belief.spread import WIDE
from ...data import UNITS, DataError
from ...study.series import FULL, Claim, Row, Series
from ...study.store import Summary
from ...validate import Comparison
from ...validate.metrics import segments
from ...validate.series import BASELINE, TOGETHER, Found, Standing, Table, compositions
from .. import figures
from ..blocks import Body, bullets, fields, figure, gallery, heading, joined, lead, note, number, soft, table, tiles
from ..figures import LINES, canvas, legend_below, panels, svg
from ..page import Page, Section
from ..page import provenance as origin
from .protocol import beside, pair

_MINUTE = 60.0
_MEANT = {
    "holds": "holds", "holds without residual": "holds for the physics alone, no residual,",
    "does not hold": "does not hold", "not run": "not run yet",
    "within the spread of the seeds": "indistinguishable from chance",
}  # fmt: skip


def page(
    series: Series, found: Table, cover: Mapping[str, Mapping[str, Coverage]], *, provenance: Mapping[str, str],
    failed: Sequence[str] = (),
) -> Page:  # fmt: skip
    """The whole page.

    Args:
        cover: coverage of each test trial by composition, see `covered`.
        failed: cells whose fit failed, with the reason.
    """
    parts = (
        Section("", _head(series, found, failed)),
        Section("The models on held-out trials", _scores(series, found)),
        beside(series, found),
        learning(series, found),
        Section("Expected orders of the models", _claims(found)),
        Section("Validation loss during training", _curves(found)),
        Section("Tracks", _tracks(series, found)),
        Section("Does the training cover the tests?", _cover(cover)),
        Section("Spread of the hybrids on the tests", _validity(found)),
        Section("Cost of each fit", _cost(found)),
        origin(provenance),
    )
    return Page(series.title, (Section("", fields({**numbers(series, found, cover), "failed": list(failed)})), *parts))


def _head(series: Series, found: Table, failed: Sequence[str]) -> Body:
    run = [one for one in found.standings if one.members and math.isfinite(one.mean(TOGETHER))]
    best = min(run, key=lambda one: one.mean(TOGETHER), default=None)
    outcomes = [f.verdict for _, rows in found.claims for f in rows if f.verdict != "not run"]
    trained = [m for one in found.standings for m in one.members if m.summary]
    shown: list[tuple[str, str]] = []
    if best is not None:
        shown.append((number(best.mean(TOGETHER)), f"least error, all test trials together: {best.name}"))
    shown.append((number(found.standings[-1].mean(TOGETHER)), f"the same for {BASELINE}"))
    if outcomes:
        shown.append((f"{outcomes.count('holds')} of {len(outcomes)}", "rows in which an expected order holds"))
    shown.append((f"{len(trained)}", f"fits, {number(sum(m.seconds for m in trained) / _MINUTE, 2)} minutes in all"))
    care = [f"failed: {line}" for line in failed]
    if series.budget != FULL:
        what = "it shows that everything runs; its errors are meaningless"
        care.append(f"A rehearsal in the budget '{series.budget}': {what}.")
    waiting = [one.key for one in found.standings[:-1] if len(one.members) < max(len(series.row(one.key).cells), 1)]
    if waiting:
        care.append(f"Not complete: {', '.join(waiting)} {'is' if len(waiting) == 1 else 'are'} not fitted yet.")
    return (lead(series.about) if series.about else ()) + tiles(shown) + note("Warnings", care)


def _scores(series: Series, found: Table) -> Body:
    """Mean and standard deviation over the seeds."""
    tests, least = found.tests, {test: _least(found, test) for test in found.tests}
    rows: list[list[str]] = []
    for one in found.standings:
        cells = [_cell(one, test, least[test]) for test in tests]
        several = f", {len(one.members)} seeds" if len(one.members) > 1 else ""
        rows.append([one.name + several, *cells])
    drawn = [one for one in found.standings if one.members]
    caption = "Mean error of each model by trial"
    marks = bars(
        [one.title for one in drawn], {test: [one.mean(test) for one in drawn] for test in found.tests},
        "standardised error (Eq. 25) [-]",
    ) if drawn else ""  # fmt: skip
    restart = "predictions run through" if series.restart is None else f"restarts every {series.restart:g} s"
    scale = ", ".join(f"{name} {number(value, 4)} {UNITS[name]}" for name, value in found.sigma.items())
    chosen = any(math.isfinite(one.width) for one in found.standings)
    remark = (
        f"Wakita 2022 Eq. 25: sum over six states of the mean squared error over sigma squared; {restart} from the "
        f"measured state, measured controls and true wind held from sample to sample, Euler's rule. sigma: {scale}. "
        "Mean ± standard deviation over the seeds; of a single one, its error. Bold: least of its column."
        + (" Residual width: of its prior, over the one declared; left-out trials chose it." if chosen else "")
    )
    files = bullets(f"{label}: {trial.name}, {trial.duration:.0f} s" for label, trial in series.tests.items())
    return (table(["model", *tests], rows) + soft(remark) + gallery(figure(marks, caption))
            + heading("The test trials") + files)  # fmt: skip


def _least(found: Table, test: str) -> float:
    return min((one.mean(test) for one in found.standings if one.members), default=math.inf)


def _cell(one: Standing, test: str, least: float) -> str:
    mean = one.mean(test)
    if math.isnan(mean):
        return "–"
    if math.isinf(mean):
        return "no number"
    return ("*" if mean <= least else "") + pair(mean, one.deviation(test))


def _claims(found: Table) -> Body:
    if not found.claims:
        return ()
    words = bullets(_words(found, claim, rows) for claim, rows in found.claims)
    rows = [
        [f"{k}. {_name(found, claim.better)} against {_name(found, claim.worse)}", f.test, _number(f.better),
         _number(f.worse), _number(f.ratio), f"{claim.factor:g}", f.verdict]
        for k, (claim, outcome) in enumerate(found.claims, start=1) for f in outcome if f.verdict != "not run"
    ]  # fmt: skip
    head = ["order", "in", "first", "second", "ratio", "at least", "verdict"]
    remark = (
        "The ratio is the second error over the first, and an order asks for a least ratio: 1 for better, less for no "
        "worse than by a margin (0.9: the first error may be 1/0.9 = 1.11 times the second). It holds, or does not, "
        "where the mean errors are two standard errors over the seeds away from that; nearer it is within the spread "
        "of the seeds. One seed has no spread, so with one seed on either side only the ratio counts."
    )
    return words + (table(head, rows, words=(1, 6)) + soft(remark) if rows else ())


def _words(found: Table, claim: Claim, rows: Sequence[Found]) -> str:
    """One sentence on a claim: whether it holds, where, and by how much."""
    by_verdict: dict[str, list[str]] = {}
    for f in rows:
        by_verdict.setdefault(f.verdict, []).append(f"{f.test} ({_number(f.worse)} against {_number(f.better)}, "
                                                    f"{_number(f.ratio)} times)")  # fmt: skip
    parts = (_MEANT[verdict] + (f" in {', '.join(names)}" if verdict != "not run" else "")
            for verdict, names in by_verdict.items())  # fmt: skip
    return f"{claim.says}: {_credit(found, claim)}{'; '.join(parts)}."


def _name(found: Table, key: str) -> str:
    one = found.standing(key)
    return key if one is None else one.name


def _credit(found: Table, claim: Claim) -> str:
    """Note for a hybrid without residual, chosen by left-out trials."""
    bare = [one.title for key in (claim.better, claim.worse) if (one := found.standing(key)) and one.width == 0.0]
    return "".join(f"{name} has no residual (left-out trials chose none) and stands for its physics; " for name in bare)


def _number(value: float) -> str:
    return "no number" if math.isinf(value) else number(value)


def _curves(found: Table) -> Body:
    some = [one for one in found.standings if one.weights and all(len(m.history) for m in one.members)]
    drawn = gallery(*(figure(validation(one), one.title) for one in some))
    remark = (
        "Loss of the windows of the validation trials, which decides the weights that are kept (circle). Losses of "
        "different kinds and of different validation trials cannot be compared."
    )
    return soft(remark) + drawn if drawn else ()


def _tracks(series: Series, found: Table) -> Body:
    chosen = [one for key in series.draw if (one := found.standing(key)) is not None and one.drawn]
    if not chosen or not series.tracks:
        return ()
    baseline = chosen[-1].title if len(chosen) > 1 and not chosen[-1].members[0].summary else ""
    several = [one for key in series.seeds if (one := found.standing(key)) is not None and len(one.members) > 1]
    styles = figures.line_styles([one.title for one in chosen], baseline)
    parts: list[Body] = []
    for test in series.tracks:
        some = [one.drawn[test] for one in chosen if test in one.drawn]
        if not some:
            continue
        spread = figure(seeds(several, test), f"{test}: every seed of each model") if several else ()
        parts.append(
            heading(f"{test}: {series.tests[test].name}") + gallery(
                figure(figures.track(some, styles, test), f"{test}: track, north up, at equal scale, from the start"),
                figure(figures.series(some, styles, test), f"{test}: motion and controls over time; lines as beside"),
                spread,
            )
        )
    remark = "Of several seeds, the one that the validation trials prefer."
    if series.restart is not None:
        remark += f" Every {series.restart:g} s a prediction is reset to the measured state."
    return soft(remark) + joined(parts)


def _cover(cover: Mapping[str, Mapping[str, Coverage]]) -> Body:
    if not cover:
        return ()
    tests = list(next(iter(cover.values())))
    rows = [[test, *(_covered(found[test]) for found in cover.values())] for test in tests]
    remark = (
        "Share of samples whose nearest training samples, in speeds, controls and apparent wind, are farther than "
        "those of 99 in 100 training samples are in the other training files; 1 % is usual. Above 5 % a trial touches "
        "the edge of the training data, above 20 % it leaves them; the channels that do so are named. "
        "Each composition sets its own limit: the denser its files cover each other, the sooner a trial is novel."
    )
    head = ["test trial", *(f"trained on {name}" for name in cover)]
    return table(head, rows, words=range(1, len(head))) + soft(remark)


def _covered(found: Coverage) -> str:
    where = f" ({', '.join(found.channels)})" if found.channels else ""
    return f"{found.verdict}, {100 * found.share:.1f} %{where}"


def _validity(found: Table) -> Body:
    """Spread of the members of each hybrid on each test; empty if no model has members."""
    drifts, titles = found.validity, {one.key: one.title for one in found.standings}
    if not drifts:
        return ()
    tests = list(next(iter(drifts.values())))
    rows = [[test, *(f"{one[test].verdict}, {number(one[test].ratio, 2)}" for one in drifts.values())]
            for test in tests]  # fmt: skip
    remark = (
        "Each fitted hybrid has members: ships that its training trials allow equally (spread.npz). Their spread on a "
        "test, over the value that nine in ten training trials do not exceed, ranks the tests by what the data leave "
        f"undetermined; it is no error bar. Above {WIDE:g}, or with a fifth of its samples novel, a trial leaves the "
        "training data. 'seatrial predict' and 'seatrial validate' report the same for any other trial."
    )
    head = ["test trial", *(titles[key] for key in drifts)]
    return table(head, rows, words=range(1, len(head))) + soft(remark)


def _cost(found: Table) -> Body:
    rows = [
        [one.name, str(m.seed) if m.seed is not None else "–", str(one.weights) if one.weights else "–",
         str(len(m.history)), str(m.summary.evaluations), number(m.seconds / _MINUTE, 2),
         number(m.objective), m.summary.status]
        for one in found.standings for m in one.members if m.summary
    ]  # fmt: skip
    head = ["model", "seed", "weights", "epochs", "updates", "minutes", "loss that decided", "ended"]
    remark = "For a fit of physics: iterations and evaluations for epochs and updates, and its objective for the loss."
    return table(head, rows, words=(7,), wide=True) + soft(remark) if rows else ()


_SMALL = (4.6, 3.0)


def validation(standing: Standing) -> str:
    """Loss of the validation windows over the epochs, a line for each seed; the circle is what was kept."""
    drawn, (ax,) = canvas(1, _SMALL)
    for k, member in enumerate(standing.members):
        colour, dashes, _ = figures.LINES[k % len(figures.LINES)]
        epochs, loss, watched = member.history[:, 0], member.history[:, 1], member.history[:, 2]
        seen = watched if np.isfinite(watched).any() else loss
        ax.plot(epochs, seen, color=colour, ls=dashes, lw=1.4,
                label="validation" if member.seed is None else f"seed {member.seed}")  # fmt: skip
        best = int(np.nanargmin(seen))
        ax.plot(epochs[best], seen[best], "o", color=colour, mfc="white", ms=5)
    ax.set_yscale("log")
    ax.set_xlabel("epoch")
    ax.x.whole = True
    ax.set_ylabel("validation loss [-]")
    ax.legend(columns=2)
    return svg(drawn, f"validation {standing.key}")


def seeds(standings: Sequence[Standing], test: str) -> str:
    """North over east of one trial at equal scale: measured, and every seed of each model."""
    drawn, (ax,) = canvas(1)
    for k, standing in enumerate(standings):
        colour, dashes, _ = figures.LINES[k % len(figures.LINES)]
        runs = [one[test] for one in standing.every if one.get(test) is not None]
        for k_run, run in enumerate(runs):
            if run is not None:
                label = f"{standing.title}, {len(runs)} seeds" if len(runs) > 1 else standing.title
                east, north = _broken(run)
                ax.plot(east, north, color=colour, ls=dashes, lw=1.1, label="_" if k_run else label)
    measured = _measured(standings, test)
    figures.measured_track(ax, measured)
    middle = [0.5 * float(np.nanmin(measured[n]) + np.nanmax(measured[n])) for n in ("y", "x")]
    half = 0.75 * max(float(np.ptp(measured[n])) for n in ("y", "x"))
    ax.set(xlim=(middle[0] - 1.15 * half, middle[0] + 1.15 * half), ylim=(middle[1] - half, middle[1] + half))
    ax.set_aspect("equal", adjustable="box")
    legend_below(drawn, ax)
    return svg(drawn, f"seeds {test}")


def bars(names: Sequence[str], values: Mapping[str, Sequence[float]], what: str) -> str:
    """One mark for each name and label along a logarithmic axis; what is not finite is left out."""
    drawn, (ax,) = canvas(1, (5.2, 0.34 * len(names) + 1.2))
    places = np.arange(len(names))
    for k, (label, found) in enumerate(values.items()):
        colour, _, mark = figures.LINES[k % len(figures.LINES)]
        ax.plot(found, places, mark, color=colour, ms=5, ls="none", label=label, alpha=0.9)
    ax.set_xscale("log")
    figures.rows_of(drawn, ax, names, what, 3)
    return svg(drawn, f"bars {what}")


def _measured(standings: Sequence[Standing], test: str) -> Any:
    found = (one[test] for standing in standings for one in standing.every)
    return next(run for run in found if run is not None).measured


def _broken(run: Comparison) -> tuple[Any, Any]:
    """The predicted track, interrupted at each restart."""
    gaps = np.flatnonzero(np.diff(segments(run.measured.t, run.restart))) + 1
    return tuple(np.insert(run.predicted[name], gaps, np.nan) for name in ("y", "x"))  # type: ignore[return-value]


SCHEMA = "seatrial-networks/1"


def covered(series: Series) -> dict[str, dict[str, Coverage]]:
    """How each test trial lies within each composition; one without the channels that it takes is left out."""
    found: dict[str, dict[str, Coverage]] = {}
    for name, trials in compositions(series).items():
        try:
            reference = Reference.of(trials)
            found[name] = {label: coverage(reference, trial) for label, trial in series.tests.items()}
        except DataError:
            continue
    return found


def numbers(series: Series, found: Table, cover: Mapping[str, Mapping[str, Coverage]]) -> dict[str, Any]:
    """The numbers of the page, SI units and radians."""
    published = series.published
    return {
        "schema": SCHEMA, "series": series.name, "title": series.title, "budget": series.budget,
        "restart": series.restart, "sigma": found.sigma,
        "tests": {label: trial.name for label, trial in series.tests.items()},
        "validation": {label: trial.name for label, trial in series.watched.items()},
        "models": {one.key: _of(series, one, found.tests) for one in found.standings},
        "claims": [
            {"says": claim.says, "better": claim.better, "worse": claim.worse, "factor": claim.factor,
             "rows": rows}
            for claim, rows in found.claims
        ],
        "coverage": {name: {test: c.numbers() for test, c in some.items()} for name, some in cover.items()},
        "spread": {key: {test: s.numbers() for test, s in some.items()} for key, some in found.validity.items()},
        "published": {"source": published.source, "note": published.note, "protocol": "not confirmed",
                      "rows": published.rows},
    }  # fmt: skip


def _of(series: Series, one: Standing, tests: Iterable[str]) -> dict[str, Any]:
    row = next((row for row in series.rows if row.key == one.key), None)
    return {
        "title": one.title, "train": [] if row is None else list(row.train), "published": one.published,
        "trained_on": [t.name for t in row.cells[0].problem.trials] if row is not None and row.cells else [],
        "weights": one.weights, "width": one.width,
        "seeds": [
            {"seed": m.seed, "objective": m.objective, "seconds": m.seconds, **_made(m.summary),
             "errors": {test: one.errors[test][k] for test in tests}, "history": m.history}
            for k, m in enumerate(one.members)
        ],
        "mean": {test: one.mean(test) for test in tests},
        "standard_deviation": {test: one.deviation(test) for test in tests},
    }  # fmt: skip


def _made(summary: Summary | None) -> dict[str, Any]:
    """How a fit came about; of a ship as it is, nothing."""
    if summary is None:
        return {"status": "", "updates": None, "digest": ""}
    return {"status": summary.status, "updates": summary.evaluations, "digest": summary.digest}


Point = tuple[float, float, float]
"""Seconds, mean error over the seeds and their standard deviation (NaN of a single one)."""

Lines = Mapping[str, Mapping[str, Mapping[str, Sequence[Point]]]]
"""Points in the order of their seconds, by test, kind and model."""

# Share of the seconds of another kind that counts as all of them.
_ALL = 0.99


def learning(series: Series, found: Table) -> Section:
    """The section; empty where the study asks for no curve, or less than two of its fits are done."""
    drawn = lines(series, found)
    if not any(len(some) > 1 for kinds in drawn.values() for by in kinds.values() for some in by.values()):
        return Section("", fields({"learning": {}}))
    remark = (
        "Error (Eq. 25) over the seconds of one kind of trial in the training, all of the other kinds with it; bars: "
        "standard deviation over the seeds. The farthest point to the right is the same model in every panel of a row."
    )
    shown = figure(picture(drawn), "Learning curves") + soft(remark)
    return Section("Errors over the seconds of training", fields({"learning": drawn}, shown))


def lines(series: Series, found: Table) -> Lines:
    """Points of every curve, from the fits that are done."""
    rows = [series.row(key) for keys in series.curves.values() for key in keys]
    held = {row.key: seconds(row) for row in rows}
    kinds = list(dict.fromkeys(kind for one in held.values() for kind in one))
    most = {kind: max(one.get(kind, 0.0) for one in held.values()) for kind in kinds}
    out: dict[str, dict[str, dict[str, list[Point]]]] = {}
    for test in series.tests:
        for kind in kinds:
            for label, keys in series.curves.items():
                points = [(held[key].get(kind, 0.0), one.mean(test), one.deviation(test)) for key in keys
                          if (one := found.standing(key)) is not None and one.members
                          and all(held[key].get(k, 0.0) >= _ALL * most[k] for k in kinds if k != kind)]  # fmt: skip
                out.setdefault(test, {}).setdefault(kind, {})[label] = sorted(p for p in points if math.isfinite(p[1]))
    return out


def seconds(row: Row) -> dict[str, float]:
    """Seconds of training by kind of trial."""
    out: dict[str, float] = {}
    for trial in row.cells[0].problem.trials if row.cells else ():
        kind = str(trial.meta.get("kind", "free"))
        out[kind] = out.get(kind, 0.0) + trial.duration
    return out


def picture(drawn: Lines) -> str:
    """Tests as rows of panels, kinds as columns; one logarithmic axis of errors a row."""
    tests, kinds = list(drawn), list(next(iter(drawn.values())))
    sheet, axes = panels(len(tests), len(kinds), (2.5 * len(kinds) + 0.6, 2.1 * len(tests) + 0.6))
    for i, test in enumerate(tests):
        for j, kind in enumerate(kinds):
            ax: Any = axes[i, j]
            for k, (label, points) in enumerate(drawn[test][kind].items()):
                colour, dashes, mark = LINES[k % len(LINES)]
                if points:
                    x, y, bar = zip(*points, strict=True)
                    ax.errorbar(x, y, [0.0 if math.isnan(b) else b for b in bar], color=colour, ls=dashes, marker=mark,
                                ms=4, lw=1.4, label=label)  # fmt: skip
            if i == len(tests) - 1:
                ax.set_xlabel(f"{kind} [s]")
            if j == 0:
                ax.set_ylabel(f"error, {test} [-]")
        seen = [p[1] for by in drawn[test].values() for points in by.values() for p in points if p[1] > 0.0]
        for ax in axes[i] if seen else ():
            ax.set_yscale("log")
            ax.set_ylim((0.8 * min(seen), 1.25 * max(seen)))
    sheet.legend(axes[0, 0].named, 3)
    return svg(sheet, "learning curves")
