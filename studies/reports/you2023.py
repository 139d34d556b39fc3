"""Page of You 2023: its Tables 3 to 5, Figures 7 to 12 and 14 to 24 and equations with numbers, beside ours.

    seatrial paper you2023 -o PAGE.html

Fits the model of 22 parameters and its rival of 6 to the virtual trials of studies/you2023.toml, as printed (A) and by
our default (B), and compares them with the truth and with studies/you2023_printed.toml.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import you2023_paper
from you2023_paper import Paper
from you2023_six import readings
from you2023_variants import attempts, ridges, shooting, weathers

import seatrial as st

canvas, legend_below, svg = st.figures.canvas, st.figures.legend_below, st.figures.svg
figure, Section = st.blocks.figure, st.page.Section
FULL, RIVAL, Rivals = st.rivals.FULL, st.rivals.RIVAL, st.rivals.Rivals
AXES = st.rivals_page.AXES

COST = "two to six minutes on two cores"
TABLES = (3, 4, 5)
STUDY = Path(__file__).parents[1] / "you2023.toml"
PRINTED, LETTER = STUDY.with_name("you2023_printed.toml"), STUDY.with_name("you2023_as_printed.toml")
DEGREES = math.degrees(1.0)


def page(found: Rivals, sources: Mapping[str, str], paper: Paper | None = None) -> st.page.Page:
    """The tables and figures of the paper, our values beside the published ones.

    Args:
        found: B, judged beside the truth.
        sources: provenance.
        paper: A and B beside the printed numbers; None leaves these sections out.
    """
    parts = (
        Section("", st.rivals_page.summary(found)),
        *(you2023_paper.sections(paper) if paper else ()),
        Section("B: relative errors in every weather (You 2023 Tab. 5)", st.rivals_page.relative(found)),
        Section("B: errors over the steps predicted (You 2023 Fig. 22)", st.rivals_page.growth(found)),
        Section("B: errors by manoeuvre (You 2023 Fig. 21)", by_manoeuvre(found)),
        Section("B: the parameters (You 2023 Tab. 3)", st.rivals_page.parameters(found)),
        Section(
            "B: thrust and azimuth servos (You 2023 Figs. 14 and 15)", st.rivals_page.drive(found) + drawn_drive(found)
        ),
        st.page.provenance(sources),
    )
    more = {"paper": you2023_paper.numbers(paper)} if paper else {}
    numbers = st.blocks.fields({**st.rivals_page.numbers(found), **more})
    return st.page.Page(found.study.title, (Section("", numbers), *parts))


def compared(found: Rivals, printed: Mapping[str, Any]) -> Paper:
    """Variants A and B and all else that stands beside a printed number."""
    letter, small = shooting(st.read_study(LETTER)), st.load("qiuxin5_6")
    ships = {"Table 3 as printed": st.load("qiuxin5"), "Table 4 as printed": small}
    busy = [t for t in found.study.problem.trials if not t.name.startswith("line")]  # manoeuvres 5 to 12
    both = weathers(found, letter, ships)
    calm = next(one for one in both if one.name == st.rivals.CALM)
    return Paper(
        found, printed, both, attempts(found, letter),
        ridges(found, letter, printed["ridges"]["weights"]),
        {name: st.smooth_servo.fit_smooth_servo(busy, name) for name in found.drive.servos},
        {name: (st.thrust_map.fit_thrust(n, pull, name=name, order=5, offset=True), fit)
         for name, (fit, n, pull) in found.drive.maps.items()},
        small, readings(calm, small, printed["table_5"]["printed"]),
    )  # fmt: skip


def by_manoeuvre(found: Rivals) -> st.blocks.Body:
    """Fig. 21 as a figure and a table, and the trial in which the model has its largest error in yaw."""
    case, names = found.cases[0], st.rivals_page.labels(found)
    sizes = {who: len(case.fits[who].free) for who in (FULL, RIVAL)}
    head = ["", "trial", *(f"{AXES[v][0]}, {sizes[who]}" for v in st.rivals.VELOCITIES for who in (FULL, RIVAL))]
    rows = [
        [str(k + 1), name, *(st.blocks.number(AXES[v][1] * case.scores[who].runs[name][v]) for v in st.rivals.VELOCITIES
                             for who in (FULL, RIVAL))]
        for k, name in enumerate(case.scores[FULL].runs)
    ]  # fmt: skip
    drawn = st.blocks.gallery(
        figure(runs(case.scores, names), "Root mean square error of each whole run"), worst(found, case)
    )
    remark = "By velocity and number of parameters; the figure has the truth too."
    return drawn + st.blocks.table(head, rows, words=(1,)) + st.blocks.soft(remark)


def worst(found: Rivals, case: st.rivals.Case) -> st.blocks.Body:
    """The held-out trial with the largest error of the model in yaw, measured and predicted."""
    errors, names = case.scores[FULL].runs, st.rivals_page.labels(found)
    trial = max(found.study.test, key=lambda t: errors[t.name]["r"])
    predicted: dict[str, st.Trial] = {}
    for who in (FULL, RIVAL):
        try:
            predicted[who] = st.replay(case.fits[who].ship, trial)
        except st.SimulationError:
            continue
    caption = f"{trial.name}, the largest error of {names[FULL]} in yaw: predicted from its first state"
    return figure(motion(trial, predicted, names), caption)


def drawn_drive(found: Rivals) -> st.blocks.Body:
    """Figs. 14 and 15: the bollard pull of each thruster, and each servo in the log with the most of its orders."""
    drawn = [figure(thrust(fit, n, pull, found.drive.thrust(name)), f"Bollard pull of thruster {name}")
             for name, (fit, n, pull) in found.drive.maps.items()]  # fmt: skip
    for name, fit in found.drive.servos.items():
        busiest = max(found.study.problem.trials, key=lambda t, c=name: float(np.abs(np.diff(t[f"{c}_cmd"])).sum()))
        drawn.append(figure(servo(fit, busiest), f"{name} in {busiest.name}"))
    return st.blocks.gallery(*drawn)


def runs(scores: Mapping[str, st.rivals.Score], names: Mapping[str, str]) -> str:
    """Root mean square error of each run (Fig. 21), trials numbered in their order."""
    drawn, axes = canvas(3, (5.2, 5.4))
    for ax, (name, (label, factor)) in zip(axes, AXES.items(), strict=True):
        for who, score in scores.items():
            values = [factor * run[name] for run in score.runs.values()]
            style = {**st.rivals_page.STYLES[who], "ls": "none"}
            ax.plot(range(1, len(values) + 1), values, ms=4.5, label=names[who], **style)
        ax.set_yscale("log")
        ax.set_ylabel(label)
    axes[-1].set_xlabel("held-out trial, as numbered below")
    legend_below(drawn, axes[0])
    return svg(drawn, "runs")


def motion(measured: st.Trial, predicted: Mapping[str, st.Trial], names: Mapping[str, str]) -> str:
    """Velocities of one trial over time, measured and predicted from its first state."""
    drawn, axes = canvas(3, (5.2, 4.4))
    for ax, (name, (label, factor)) in zip(axes, AXES.items(), strict=True):
        ax.plot(measured.t, factor * measured[name], color="#c9d0d6", lw=3.6, label="measured")
        for who, trial in predicted.items():
            ax.plot(
                trial.t, factor * trial[name], lw=1.4, label=names[who], **{**st.rivals_page.STYLES[who], "marker": ""}
            )
        ax.set_ylabel(label)
    axes[-1].set_xlabel("time t [s]")
    legend_below(drawn, axes[0])
    return svg(drawn, f"motion {measured.name}")


def servo(fit: st.servo.ServoFit, trial: st.Trial) -> str:
    """Order, measured angle and angle of the servo over one log, and the residual (Fig. 15)."""
    name = fit.control
    order, angle = trial[f"{name}_cmd"], trial[name]
    modelled = st.servo.answered(fit, trial) + fit.offset
    drawn, (above, below) = canvas(2, (5.2, 3.8))
    colour, dashes = st.figures.BASELINE
    above.step(trial.t, DEGREES * order, color=colour, ls=dashes, lw=1.2, label="order")
    above.plot(trial.t, DEGREES * angle, color=st.figures.INK, lw=2.2, label="measured")
    above.plot(trial.t, DEGREES * modelled, color=st.figures.SKY, ls=(0, (4, 1.5)), lw=1.4, label="servo")
    above.set_ylabel(f"{name} [°]")
    below.plot(trial.t, DEGREES * (modelled - angle), color=st.figures.BLUE, lw=0.8)
    below.set_ylabel("servo − measured [°]")
    below.set_xlabel("time t [s]")
    legend_below(drawn, above)
    return svg(drawn, f"servo {name}")


def thrust(fit: st.thrust_map.ThrustMap, n: st.Array, pull: st.Array, true: st.Array) -> str:
    """Pull by revolutions with the map, and both less the truth (Fig. 14); `true` at the rows pulled."""
    drawn, (above, below) = canvas(2, (5.2, 3.8))
    fine = np.linspace(fit.n_low, fit.n_max, 200)
    cell: dict[str, Any] = {"color": st.figures.INK, "mfc": "white", "ms": 4.5}
    above.plot(n, pull, "o", label="load cell", **cell)
    above.plot(fine, fit.thrust(fine), color=st.figures.BLUE, lw=1.5, label="map")
    above.set_ylabel("thrust [N]")
    below.axhline(0.0, color=st.figures.RULE, lw=1.0)
    below.plot(n, pull - true, "o", **cell)
    below.plot(n, fit.thrust(n) - true, color=st.figures.BLUE, lw=1.5)
    below.set_ylabel("less the truth [N]")
    below.set_xlabel("revolutions n [1/s]")
    legend_below(drawn, above)
    return svg(drawn, f"thrust {fit.name}")


def made(command: str) -> st.page.Page:
    """Fit and judge; `command` is told on the page."""
    study, printed = st.read_study(STUDY), st.read_toml(PRINTED)
    if study.virtual is None or not study.rival:
        raise TypeError(f"{STUDY}: no [virtual] or no [rival]; this page needs both")
    fit = st.overruled(study.estimator.fit(study.problem), study.unidentified)
    found = st.rivals.judged(study, fit, study.virtual)
    return page(found, {"study": str(STUDY), "digest": study.digest, "version": f"seatrial {st.__version__}",
                        "truth": f"{study.virtual.ship.name}, seed {study.virtual.seed}",
                        "command": command}, compared(found, printed))  # fmt: skip
