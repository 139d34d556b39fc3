"""AR, ARX and vector AR of a real ship in waves: order by AIC, and error of the forecast against its horizon.

The data are the first 500 rows of HAKUSAN (R package TSSS): yaw rate, roll, pitch and rudder of a container ship under
autopilot, 1 Hz.  Models are fitted to the first 350 rows and judged by the last 150, which decide nothing.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import seatrial as st

figure, gallery, number, Section = st.blocks.figure, st.blocks.gallery, st.blocks.number, st.page.Section
table = st.blocks.table

HOME = Path(__file__).parents[1]
MAPPING = HOME / "hakusan_mapping.toml"
FILE = Path("hakusan") / "hakusan_first_500.txt"

TRAIN, STEPS, MOST = 350, 15, 15
REHEARSAL = 250
"""Rows of training; horizon [s]; longest lag tried; rows of training for the rehearsal within them."""

LABELS = {"r": "yaw rate", "phi": "roll", "theta": "pitch", "delta": "rudder"}
SHOWN = (1, 2, 3, 5, 8, 10, 15)
_DRAWS, _BLOCK = 1000, 15
_UNIT = {"r": "yaw rate [°/s], if hundredths", "phi": "roll [°], if hundredths"}


@dataclass(frozen=True)
class Rival:
    """One way to forecast: its outputs and inputs, and what it knows of the rudder to come."""

    label: str
    outputs: tuple[str, ...]
    inputs: tuple[str, ...] = ()
    rudder: str = "held"


RIVALS = (
    Rival("AR of yaw rate", ("r",)),
    Rival("AR of roll", ("phi",)),
    Rival("ARX of yaw rate, rudder held", ("r",), ("delta",)),
    Rival("ARX of yaw rate, rudder known", ("r",), ("delta",), "known"),
    Rival("vector ARX of yaw rate, roll; rudder held", ("r", "phi"), ("delta",)),
    Rival("vector AR of yaw rate, roll, pitch", ("r", "phi", "theta")),
    Rival("vector AR with the rudder as output", ("r", "phi", "theta", "delta")),
)


def read_rows(path: Path) -> st.Trial:
    """The rows through the mapping.

    Raises:
        DataError: no such file, or other columns.
    """
    if not path.is_file():
        raise st.DataError(f"{path}: no such file; save the first 500 rows of HAKUSAN (R package TSSS) there")
    return st.reader("csv", MAPPING)(path)


@dataclass(frozen=True)
class Judged:
    """Errors of one way to forecast by horizon, relative to the spread of the judged rows about the training mean.

    Attributes:
        error: root mean square by step, shape (steps,); `low`, `high` hold 90 of 100 resamples of blocks of rows.
        gain: error over that of persistence, and its interval, each of shape (steps,).
        inside: share of the readings within the forecast's 95 % interval, shape (steps,); NaN for the baselines.
    """

    error: st.Array
    low: st.Array
    high: st.Array
    gain: tuple[st.Array, st.Array, st.Array]
    inside: st.Array


def forecasts(
    model: st.VectorAr, trial: st.Trial, starts: NDArray[np.intp], output: str, rudder: str
) -> tuple[st.Array, st.Array]:
    """Forecasts of one output, shape (starts, steps), and their standard deviation, shape (steps,)."""
    k = model.outputs.index(output)
    return st.forecast(model, trial, starts, STEPS, inputs=rudder)[:, :, k], model.spread(STEPS)[:, k]


def judged(made: st.Array, sigma: st.Array | None, truth: st.Array, held: st.Array, scale: float) -> Judged:
    """Compare forecasts with what came, all of shape (starts, steps); `held` are those of persistence."""
    square, theirs = (made - truth) ** 2, (held - truth) ** 2
    rng, count = np.random.default_rng(1), len(square)
    blocks = rng.integers(0, count - _BLOCK, (_DRAWS, -(-count // _BLOCK)))
    drawn = (blocks[:, :, None] + np.arange(_BLOCK)).reshape(_DRAWS, -1)[:, :count]
    ours = np.sqrt(square[drawn].mean(axis=1))
    ratio = ours / np.sqrt(theirs[drawn].mean(axis=1))
    error = np.sqrt(square.mean(axis=0))
    inside = np.full(STEPS, np.nan) if sigma is None else (np.sqrt(square) < 1.96 * sigma).mean(axis=0)
    span = [np.quantile(one, at, axis=0) for one in (ours / scale, ratio) for at in (0.05, 0.95)]
    return Judged(error / scale, span[0], span[1], (error / np.sqrt(theirs.mean(axis=0)), span[2], span[3]), inside)


def compared(
    trial: st.Trial, models: Sequence[tuple[Rival, st.VectorAr]], first: int, output: str
) -> tuple[dict[str, Judged], dict[str, st.Array]]:
    """Every model that forecasts this output beside persistence and the mean, from row `first` on; and forecasts."""
    values = trial[output]
    starts = np.arange(first - 1, len(values) - STEPS)
    truth = np.stack([values[starts + h] for h in range(1, STEPS + 1)], axis=1)
    held = np.tile(values[starts][:, None], (1, STEPS))
    mean = float(np.mean(values[:first]))
    scale = float(np.sqrt(np.mean((values[first:] - mean) ** 2)))
    out = {"persistence": judged(held, None, truth, held, scale),
           "mean": judged(np.full_like(truth, mean), None, truth, held, scale)}  # fmt: skip
    made: dict[str, st.Array] = {}
    for rival, model in models:
        if output in model.outputs:
            made[rival.label], sigma = forecasts(model, trial, starts, output, rival.rudder)
            out[rival.label] = judged(made[rival.label], sigma, truth, held, scale)
    return out, made


def page(trial: st.Trial, given: Path) -> st.page.Page:
    """Fit, order, judge, and write down."""
    past = trial.rows(slice(0, TRAIN))
    tables = {rival.label: st.vector_orders(past, rival.outputs, rival.inputs, most=MOST) for rival in RIVALS}
    # The order is chosen on common rows; the model then takes every row of training.
    models = [(rival, st.fit_vector_ar(past, rival.outputs, rival.inputs, order=tables[rival.label][0].order))
              for rival in RIVALS]  # fmt: skip
    found = {output: compared(trial, models, TRAIN, output) for output in ("r", "phi")}
    rehearsed = _rehearsed(trial)
    # Which way is the best was decided before the judged rows were looked at.
    chosen = {output: _best(judgements) for output, judgements in rehearsed.items()}
    sections = [Section("", st.blocks.lead(_summary(found, chosen)) + st.blocks.bullets(_caveats(trial)))]
    for output, (judgements, _) in found.items():
        sections.append(_errors(output, judgements, chosen[output]))
    sections += [_orders(tables, models), _drawn(trial, found, chosen), _rehearsal(rehearsed),
                 st.page.provenance({"data": f"{FILE}: 500 rows at 1 Hz, of which the first {TRAIN} for training",
                             "version": f"seatrial {st.__version__}",
                             "command": f"python studies/reports/hakusan.py -o {given}"})]  # fmt: skip
    numbers = {"train_rows": TRAIN, "judged_rows": len(trial) - TRAIN, "models": {
        rival.label: {"order": model.order, "aic": tables[rival.label][0].aic, "radius": model.radius}
        for rival, model in models}}  # fmt: skip
    return st.page.Page(
        "HAKUSAN: forecasts of yaw rate and roll in waves by AR, ARX and vector AR",
        (Section("", st.blocks.fields(numbers)), *sections),
    )


def _rehearsed(trial: st.Trial) -> dict[str, dict[str, Judged]]:
    """The same within the training rows: fitted to the first 250, judged by the next 100."""
    past = trial.rows(slice(0, REHEARSAL))
    models = [(rival, st.vector_orders(past, rival.outputs, rival.inputs, most=MOST)[0]) for rival in RIVALS]
    return {output: compared(trial.rows(slice(0, TRAIN)), models, REHEARSAL, output)[0] for output in ("r", "phi")}


def _best(judgements: dict[str, Judged]) -> str:
    """The way with the least error over the first five seconds, of those that know no rudder to come."""
    honest = [label for label in judgements if "known" not in label]
    return min(honest, key=lambda label: float(np.mean(judgements[label].error[:5])))


def _summary(found: dict[str, tuple[dict[str, Judged], dict[str, st.Array]]], chosen: dict[str, str]) -> str:
    parts: list[str] = []
    for output, (judgements, _) in found.items():
        best = judgements[label := chosen[output]]
        error, gain = (", ".join(f"{one[k]:.2f}" for k in (0, 2, 4)) for one in (best.error, best.gain[0]))
        parts.append(f"{LABELS[output]}: {label} has {error} of the spread at 1, 3, 5 s, and {gain} of persistence")
    return "On the 150 rows that no fit has seen, by the ways that the rehearsal preferred: " + "; ".join(parts) + "."


def _caveats(trial: st.Trial) -> list[str]:
    """What the data do not say."""
    r, pitch, phi = np.degrees(trial["r"]), np.degrees(trial["theta"]), np.degrees(trial["phi"])
    return [
        "Units and signs are undocumented. Hundredths of a degree, and of a degree per second, are assumed; "
        "no relative error depends on it.",
        f"They are doubtful: the mean yaw rate would be {np.mean(r):.2f} °/s, {abs(np.mean(r)) * trial.duration:.0f}° "
        f"in the {trial.duration:.0f} s, under an autopilot (a bias of the gyro, or another unit); pitch would swing "
        f"by {np.std(pitch):.1f}° and roll by {np.std(phi):.1f}° (standard deviations), unlike a container ship.",
        "The rudder is the autopilot's: it follows the yaw, so a coefficient of the rudder here is no steering gain.",
        "Beyond about ten seconds no model beats the mean: waves are forgotten after a period or two.",
    ]


def _errors(output: str, judgements: dict[str, Judged], best: str) -> Section:
    drawn, (ax,) = st.figures.canvas(1, (7.0, 4.4))
    styles = {**st.figures.line_styles([k for k in judgements if k not in ("persistence", "mean")], "persistence"),
              "mean": (st.figures.SOFT, "-")}  # fmt: skip
    steps = np.arange(1, STEPS + 1)
    for label, one in judgements.items():
        colour, dashes = styles[label]
        ax.plot(steps, one.error, color=colour, ls=dashes, lw=1.6, marker="o" if label == best else "", ms=3.5,
                label=label)  # fmt: skip
        if label == best:
            ax.fill_between(steps, one.low, one.high, color=colour, alpha=0.15, lw=0)
    ax.set(xlabel="horizon [s]", ylabel=f"error of {LABELS[output]} / spread [-]", ylim=(0.0, None), xlim=(1, STEPS))
    st.figures.legend_below(drawn, ax)
    head = ("way", *(f"{s} s" for s in SHOWN), "of persistence at 3 s", "within 95 % band at 1, 5 s")
    rows: list[tuple[str, ...]] = []
    for label, one in judgements.items():
        gain = f"{one.gain[0][2]:.2f} ({one.gain[1][2]:.2f} … {one.gain[2][2]:.2f})"
        inside = "–" if np.isnan(one.inside[0]) else f"{100 * one.inside[0]:.0f} %, {100 * one.inside[4]:.0f} %"
        rows.append((label, *(number(float(one.error[s - 1]), 2) for s in SHOWN), gain, inside))
    note = st.blocks.soft(
        "Root mean square over the spread of the judged rows about the training mean: 1 is as good as the mean. "
        "In brackets 90 % of resamples of blocks of 15 s. “Known” uses the logged rudder of the time to come."
    )
    numbers = {f"error_{output}": {label: {
        "error": one.error.tolist(), "low": one.low.tolist(), "high": one.high.tolist(),
        "of_persistence": one.gain[0].tolist(), "inside": one.inside.tolist(),
    } for label, one in judgements.items()}}  # fmt: skip
    name = LABELS[output].capitalize()
    caption = f"{name}: error over horizon; the band is of {best}, the best of the rehearsal"
    shown = gallery(figure(st.figures.svg(drawn, output), caption), least=640)
    body = shown + table(head, rows, wide=True) + note
    return Section(f"{name}: error against horizon", st.blocks.fields(numbers, body))


def _orders(tables: dict[str, list[st.VectorAr]], models: Sequence[tuple[Rival, st.VectorAr]]) -> Section:
    """AIC over the order, of each way less its least; and what was chosen."""
    drawn, (ax,) = st.figures.canvas(1, (7.0, 3.8))
    styles = st.figures.line_styles([*tables], "")
    for label, tried in tables.items():
        if "known" in label:
            continue
        by = {p: min(one.aic for one in tried if one.order[0] == p) for p in range(1, MOST + 1)}
        colour, dashes = styles[label]
        ax.plot([*by], np.array([*by.values()]) - min(by.values()), color=colour, ls=dashes, lw=1.4, label=label)
    ax.set(xlabel="lags of the outputs [s]", ylabel="AIC above its least", ylim=(-5.0, 200.0), xlim=(1, MOST))
    st.figures.legend_below(drawn, ax)
    rows = [(rival.label, str(model.order[0]), str(model.order[1] or "–"),
             str(model.A.size + model.B.size + len(model.outputs)), number(tables[rival.label][0].aic, 5),
             number(min(one.bic for one in tables[rival.label]), 5),
             str(min(tables[rival.label], key=lambda one: one.bic).order[0]), number(model.radius, 3))
            for rival, model in models]  # fmt: skip
    head = ("way", "lags", "of the rudder", "coefficients", "AIC", "least BIC", "its lags", "largest root")
    about = st.blocks.soft(
        "Orders up to 15 are compared on the same 335 rows; AIC of different outputs are not comparable. "
        "A largest root below 1 is a stable model."
    )
    shown = gallery(figure(st.figures.svg(drawn, "orders"), "AIC over the order"), least=640)
    return Section("Order by AIC", shown + table(head, rows, wide=True) + about)


def _drawn(
    trial: st.Trial, found: dict[str, tuple[dict[str, Judged], dict[str, st.Array]]], chosen: dict[str, str]
) -> Section:  # fmt: skip
    """What was forecast 3 s before, beside what came."""
    shown: list[st.blocks.Body] = []
    ahead = 3
    for output, (_, made) in found.items():
        drawn, (ax,) = st.figures.canvas(1, (7.0, 3.2))
        label = chosen[output]
        values = np.degrees(trial[output])
        rows = np.arange(TRAIN - 1 + ahead, len(values) - STEPS + ahead)
        ax.plot(trial.t[TRAIN:], values[TRAIN:], color=st.figures.INK, lw=1.3, label="measured")
        colour, dashes, _ = st.figures.LINES[0]
        ax.plot(trial.t[rows], np.degrees(made[label][:, ahead - 1]), color=colour, ls=dashes, lw=1.3,
                label=f"forecast {ahead} s before")  # fmt: skip
        ax.set(xlabel="time t [s]", ylabel=_UNIT[output])
        st.figures.legend_below(drawn, ax)
        shown.append(figure(st.figures.svg(drawn, f"traces {output}"), f"{LABELS[output]}: {label}"))
    return Section("Three seconds ahead", gallery(*shown, least=640))


def _rehearsal(found: dict[str, dict[str, Judged]]) -> Section:
    """Whether the order of the ways was to be seen before the last rows."""
    rows = [(f"{LABELS[output]}: {label}", *(number(float(one.error[s - 1]), 2) for s in SHOWN))
            for output, judgements in found.items() for label, one in judgements.items()]  # fmt: skip
    after = TRAIN - REHEARSAL
    about = f"The same within the training rows: fitted to the first {REHEARSAL}, judged by the next {after}."
    body = st.blocks.line(about) + table(("way", *(f"{s} s" for s in SHOWN)), rows, wide=True)
    return Section("Rehearsal", body)


def final(trial: st.Trial) -> dict[str, object]:
    """The vector AR of yaw rate, roll and pitch on all rows, for forecasts of rows to come: coefficients in SI."""
    outputs = ("r", "phi", "theta")
    order = st.vector_orders(trial.rows(slice(0, TRAIN)), outputs, most=MOST)[0].order
    model = st.fit_vector_ar(trial, outputs, order=order)
    return {"outputs": outputs, "sample_time": 1.0, "A": model.A.tolist(), "constant": model.constant.tolist(),
            "covariance": model.covariance.tolist(), "rows": model.rows, "order": order}  # fmt: skip


def main(arguments: list[str] | None = None) -> int:
    """Fit, judge, write the page and the model."""
    asked = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    asked.add_argument("-o", "--out", type=Path, required=True, metavar="RUN", help="folder of the page")
    given = asked.parse_args(arguments)
    root = Path(os.environ.get("SEATRIAL_DATA", HOME.parents[1] / "shared" / "data"))
    try:
        trial = read_rows(root / FILE)
        path = st.page.write(given.out / "report.html", page(trial, given.out))
        (given.out / "model.json").write_text(json.dumps(final(trial)) + "\n", encoding="utf-8")
    except (st.DataError, OSError) as error:
        sys.stderr.write(f"{error}\n")
        return 2
    sys.stdout.write(f"wrote {path}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
