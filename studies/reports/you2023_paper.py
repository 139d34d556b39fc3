"""Sections of the page of You 2023 that set every printed number beside ours, and its Figures 9 to 12."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import you2023_six as six
import you2023_validation as validation
from you2023_variants import OURS, PRINTED, QUANTITIES, Attempt, Weather, eq_17

import seatrial as st

figure, number, soft, table = st.blocks.figure, st.blocks.number, st.blocks.soft, st.blocks.table
Section = st.page.Section
Row = st.printed.Row
CALM, free_runs, FULL, one_step = st.rivals.CALM, st.rivals.free_runs, st.rivals.FULL, st.rivals.one_step
RIVAL, VELOCITIES = st.rivals.RIVAL, st.rivals.VELOCITIES

MOTIONS = {"u": "surge", "v_m": "sway", "r": "yaw"}
# One sample in so many is drawn.
_DRAWN = 3
_LINES: Mapping[str, Mapping[str, Any]] = {
    PRINTED: {"color": st.figures.VERMILION, "ls": (0, (5, 1.5))}, OURS: {"color": st.figures.BLUE, "ls": "-"},
    "Table 4 as printed": {"color": st.figures.GREEN, "ls": (0, (1, 1.2))},
}  # fmt: skip


@dataclass(frozen=True)
class Paper:
    """All that these sections show.

    Attributes:
        printed: the data file.
        weathers: as sailed, calm.
        attempts, ridges: of `you2023_variants`.
        servos: of Eq. 9, by azimuth; maps: of the fifth order (A) and as cross-validated (B), by thruster.
        small: ship of Table 4; readings: of its numbers.
    """

    found: st.rivals.Rivals
    printed: Mapping[str, Any]
    weathers: tuple[Weather, ...]
    attempts: tuple[Attempt, ...]
    ridges: Mapping[float, st.Fit]
    servos: Mapping[str, st.smooth_servo.SmoothServo]
    maps: Mapping[str, tuple[st.thrust_map.ThrustMap, st.thrust_map.ThrustMap]]
    small: st.Ship
    readings: tuple[six.Reading, ...]

    @property
    def calm(self) -> Weather:
        """The weather nearest to the paper's pool."""
        return next(one for one in self.weathers if one.name == CALM)


def sections(paper: Paper) -> tuple[Section, ...]:
    """All of them, in the order of the paper."""
    rows = {name: list(one) for name, one in every(paper).items()}
    counted = sum(len(one) for one in rows.values())
    same = sum(row.same for one in rows.values() for row in one)
    head = (
        f"{paper.printed['source']}: {counted} comparisons of its numbers and findings, {same} as printed. A: as "
        "printed. B: our default. Both are fitted to the same twelve manoeuvres."
    )
    names = {
        "start": "Where the search begins (Eqs. 11, 16 and 17)", "table 3": "22 parameters (Table 3)",
        "table 4": "6 parameters (Table 4)", "table 5": "Relative errors, printed and ours (Table 5)",
        "drive": "Thrust and servos (Eqs. 9 and 20)", "findings": "Findings of the figures",
    }  # fmt: skip
    table_5 = _errors(paper) + six.section(paper.readings, paper.printed["table_5"]["printed"])
    more = {"table 5": table_5, "table 4": _searches(paper), "table 3": _ridge(paper)}
    sailed, servo = paper.weathers[0], paper.found.drive.servos["alpha_1"]
    model = sailed.variants[OURS].whole[FULL].ship
    return (
        Section("Printed and ours", st.blocks.line(head)),
        Section("Where this page departs from the paper", st.blocks.bullets(paper.printed["departures"])),
        *(Section(title, st.printed.side_by_side(rows[key]) + more.get(key, ())) for key, title in names.items()),
        Section("Inputs (Figs. 7 and 8)", _inputs(paper)),
        Section("Single steps and whole runs (Figs. 9 to 12)", _sequences(paper)),
        Section("Held-out manoeuvres (Figs. 16 to 20)", validation.held_out(model, sailed.tests, servo)),
        Section("Numbers of steps (Figs. 23 and 24)", validation.by_steps(model, sailed.tests)),
    )


def every(paper: Paper) -> dict[str, Iterator[Row]]:
    """All rows, by table."""
    return {
        "start": _start(paper), "table 3": _table_3(paper), "table 4": _table_4(paper), "table 5": _table_5(paper),
        "drive": _drive(paper), "findings": _findings(paper),
    }  # fmt: skip


def numbers(paper: Paper) -> dict[str, Any]:
    """The rows, the errors of Table 5 by weather, the searches and the ridge."""
    return {
        "rows": {name: st.printed.fields(rows) for name, rows in every(paper).items()},
        "errors": {one.name: one.errors for one in paper.weathers},
        "fits": {one.name: {
            f"{letter} {who} {way}": {"objective": fit.objective, "status": fit.status, "seconds": fit.seconds,
                                      "values": fit.vector.by_path(fit.values)}
            for letter, variant in one.variants.items()
            for way, fits in (("GO", variant.whole), ("LO", variant.local)) for who, fit in fits.items()
        } for one in paper.weathers},
        "searches": paper.attempts,
        "readings": {one.what: {"errors": {way: v.tolist() for way, v in one.errors.items()}, "off": one.off}
                     for one in paper.readings},
        "ridge": {f"{w:g}": {"objective": fit.objective, "values": fit.vector.by_path(fit.values)}
                  for w, fit in paper.ridges.items()},
    }  # fmt: skip


def _inputs(paper: Paper) -> st.blocks.Body:
    virtual = paper.found.study.virtual
    if virtual is None:
        return ()
    drawn = validation.inputs(virtual.ship, paper.calm.trials)
    return figure(drawn, "Figs. 7 and 8: revolutions, azimuth, and forces by Eqs. 7, 8 and 20, of both thrusters")


def _start(paper: Paper) -> Iterator[Row]:
    study = paper.found.study
    begun = {f.path: f.start for f in eq_17(study.problem, study)}
    default = {f.path: f.start for f in study.problem.free}
    for said in paper.printed["start"]:
        path = f"inertia.{said['name']}"
        yield Row(f"{said['name']}, {PRINTED}", said["printed"], begun[path], said["unit"],
                  "by Eq. 11 to the letter; Eq. 17 adds rounded terms of Eq. 16")  # fmt: skip
        yield Row(f"{said['name']}, {OURS}", said["printed"], default[path], said["unit"], said["why"])


def _of(paper: Paper, who: str) -> Iterator[tuple[Weather, str, st.Fit]]:
    for one in reversed(paper.weathers):
        for letter, variant in one.variants.items():
            yield one, letter, variant.whole[who]


def _table_3(paper: Paper) -> Iterator[Row]:
    said = paper.printed["table_3"]
    for path, printed in said["values"].items():
        for one, letter, fit in _of(paper, FULL):
            k = fit.vector.paths.index(path)
            off = (fit.values[k] - printed) / fit.sigma[k]
            cause = said["why_current"] if letter == PRINTED and one.name != CALM else said["why"]
            yield Row(f"{path.partition('.')[2]}, {letter}, {one.name}", printed, float(fit.values[k]), "",
                      f"{cause}: {number(float(off), 2)} sigma")  # fmt: skip


def _table_4(paper: Paper) -> Iterator[Row]:
    said = paper.printed["table_4"]
    for path, printed in said["values"].items():
        for one, letter, fit in _of(paper, RIVAL):
            value = float(fit.values[fit.vector.paths.index(path)])
            yield Row(f"{path.partition('.')[2]}, {letter}, {one.name}", printed, value, "", said["why"][path])


def _table_5(paper: Paper) -> Iterator[Row]:
    said = paper.printed["table_5"]
    for quantity in QUANTITIES:
        for velocity, motion in MOTIONS.items():
            both = said["printed"][f"{motion} {quantity}"]
            for who, printed in zip((FULL, RIVAL), both, strict=True):
                why = said["rival"] if who == RIVAL else said.get(f"full_{quantity}", said["full"])
                for letter in (PRINTED, OURS):
                    error = paper.calm.errors[f"{letter} {who}"]["fitted"][quantity][velocity]
                    count = len(paper.calm.variants[letter].whole[who].free)
                    yield Row(f"{motion} {quantity}, {count} parameters, {letter}", printed, 100.0 * error, "%", why)


def _errors(paper: Paper) -> st.blocks.Body:
    """Table 5 in every weather, on trials fitted and held out, with the ships of Tables 3 and 4 as printed."""
    head = ["", *(f"{MOTIONS[v]} {q}" for q in ("vel.", "acc.", "dist.") for v in VELOCITIES)]
    names = {f"{a} {w}": f"{a}, {n}" for a in (PRINTED, OURS) for w, n in ((FULL, "22"), (RIVAL, "6"))}
    rows = [
        [f"{one.name}, {kept}: {names.get(who, who)}",
         *(_percent(errors[kept][q][v]) for q in QUANTITIES for v in VELOCITIES)]
        for one in reversed(paper.weathers) for kept in ("fitted", "held out") for who, errors in one.errors.items()
    ]  # fmt: skip
    remark = (
        "Rows above: calm, the twelve trials fitted, as section 4.3 of the paper. Here every weather, and the 28 held "
        "out. Table 3 is the truth: its errors are those of the noise alone. Table 4 spins: its yaw grows beyond all "
        "bounds of a ship."
    )
    return st.blocks.heading("In every weather, per cent") + table(head, rows) + soft(remark)


def _percent(share: float) -> str:
    return number(100.0 * share) if np.isfinite(share) else "diverges"


def _searches(paper: Paper) -> st.blocks.Body:
    """Algorithm 1 by one and by more searches, and what single steps give."""
    best = min(one.objective for one in paper.attempts)
    names = list(paper.printed["table_4"]["values"])
    rows = [
        [one.what, _above(one.objective / best), *(number(one.values[n], 4) if one.values else "" for n in names[:3]),
         one.status]
        for one in paper.attempts
    ]  # fmt: skip
    head = ["search", "above the best", *(n.partition(".")[2] for n in names[:3]), "it says"]
    local = [
        [f"{letter}, {one.name}", *(number(variant.local[RIVAL].vector.by_path(variant.local[RIVAL].values)[n], 4)
                                    for n in names)]
        for one in reversed(paper.weathers) for letter, variant in one.variants.items()
    ]  # fmt: skip
    printed = ["Table 4 as printed", *(number(v, 4) for v in paper.printed["table_4"]["values"].values())]
    remark = (
        "Calm, six parameters, no ridge. A search that grew with its trials can end at a poor optimum of all of them, "
        "or where the mass matrix is none; a second search from the momentum balance finds the best, and the status "
        "says that they disagree."
    )
    small = ["", *(n.partition(".")[2] for n in names)]
    heading = st.blocks.heading
    return (heading("Algorithm 1 by one search and by more") + table(head, rows, words=(5,)) + soft(remark)
            + heading("Six parameters from LO: A by single steps (Eq. 15), B by the momentum balance")
            + table(small, [printed, *local]))  # fmt: skip


def _above(ratio: float) -> str:
    return f"{100.0 * (ratio - 1.0):.1f} %" if ratio < 10.0 else "far"


def _ridge(paper: Paper) -> st.blocks.Body:
    """What lambda |P|^2 does to the estimates."""
    head = ["lambda", "objective", *(f.path.partition(".")[2] for f in next(iter(paper.ridges.values())).free[:8]),
            "rms of (estimate - Table 3)/sigma"]  # fmt: skip
    said, free = paper.printed["table_3"]["values"], next(iter(paper.ridges.values()))
    true = np.array([said[f.path] for f in free.free])
    rows = [
        [f"{w:g}", number(fit.objective, 6), *(number(float(v), 4) for v in fit.values[:8]),
         number(float(np.sqrt((((fit.values - true) / free.sigma) ** 2).mean())))]
        for w, fit in paper.ridges.items()
    ]  # fmt: skip
    remark = "Calm; sigma without ridge. The paper prints no lambda: what it costs is bias, in units that differ."
    return st.blocks.heading("The ridge of Eq. 13") + table(head, rows) + soft(remark)


def _drive(paper: Paper) -> Iterator[Row]:
    said = paper.printed["thrust"]
    for name, maps in paper.maps.items():
        for letter, fit in zip((PRINTED, OURS), maps, strict=True):
            for power, printed in enumerate(said["printed"]):
                ours = 2.0 * float(fit.coefficients[power])
                why = said["why"] if ours else said["why_zero"]
                yield Row(f"Eq. 20: n^{power}, thruster {name}, {letter}", printed, ours, f"N s^{power}", why)
    servos = paper.printed["servo"]
    for name, fit in paper.servos.items():
        plain: Any = paper.found.drive.servos[name]
        epsilon = f"{number(fit.epsilon, 2)} ± {number(fit.sigma[1], 1)}"
        pairs = {"K": ("rad/s", fit.rate, float(plain.servo.rate)), "epsilon": ("rad", epsilon, "0"),
                 "R2": ("", fit.R2, plain.R2)}  # fmt: skip
        for what, (unit, *both) in pairs.items():
            for letter, ours in zip((PRINTED, OURS), both, strict=True):
                yield Row(f"Eq. 9: {what} of {name}, {letter}", servos[name][what], ours, unit, servos["why"][what])


def _findings(paper: Paper) -> Iterator[Row]:
    ours = _told(paper)
    for one in paper.printed["finding"]:
        yield Row(one["name"], one["printed"], ours[one["ours"]], "", one["why"])


def _told(paper: Paper) -> dict[str, str]:
    """What our figures say under each key of the findings."""
    trials, cases = paper.calm.trials, paper.found.cases
    still = next(case for case in cases if case.name == CALM)
    errors = {(who, way): _rms(made(fits[who].ship, trials), trials)
              for way, fits, made in (("LO", paper.calm.variants[PRINTED].local, one_step),
                                      ("GO", paper.calm.variants[PRINTED].whole, free_runs))
              for who in (FULL, RIVAL)}  # fmt: skip
    over = {who: errors[who, "GO"].mean(axis=0) / errors[who, "LO"].mean(axis=0) for who in (FULL, RIVAL)}
    turns = errors[FULL, "LO"][-4:].mean(axis=0) / errors[FULL, "LO"][:-4].mean(axis=0)
    score = still.scores[FULL]
    fast, slow = (np.mean([[run[v] for v in VELOCITIES] for name, run in score.runs.items() if name.endswith(f" {n}")],
                          axis=0) for n in (10, 3))  # fmt: skip
    spans = {case.name: [case.scores[FULL].steps[v][-1] / case.scores[FULL].steps[v][0] for v in VELOCITIES]
             for case in (cases[0], still)}  # fmt: skip
    largest = max(VELOCITIES, key=lambda v: score.relative[v])
    share, least = _percent(score.relative[largest]), _percent(still.scores[st.rivals.TRUTH].relative[largest])
    return {
        "go_over_lo": f"GO over LO {_three(over[FULL])}",
        "lo_worst": f"turns over the other eight {_three(turns)}",
        "six_steps": f"GO over LO {_three(over[RIVAL])}",
        "worst_velocity": f"{MOTIONS[largest]}: {share} % (truth {least} %)",
        "grows_with_speed": _three(fast / slow),
        "grows_with_steps": "; ".join(f"{name} {_three(times)} times" for name, times in spans.items()),
    }


def _three(values: Sequence[float] | st.Array) -> str:
    return " / ".join(number(float(value), 2) for value in values)


def _rms(made: Sequence[st.Array], trials: Sequence[st.Trial]) -> st.Array:
    """Root mean square error by trial and velocity, shape (trials, 3)."""
    with np.errstate(all="ignore"):
        return np.array([np.sqrt(((a - t.stack(*VELOCITIES)) ** 2).mean(axis=0))
                         for a, t in zip(made, trials, strict=True)])  # fmt: skip


def _sequences(paper: Paper) -> st.blocks.Body:
    """Figs. 9 to 12: all twelve manoeuvres one after the other, and LO against GO by manoeuvre."""
    calm = paper.calm
    out: st.blocks.Body = ()
    for who, numbers_, size in ((FULL, (9, 10), 22), (RIVAL, (11, 12), 6)):
        lo = {a: one_step(v.local[who].ship, calm.trials) for a, v in calm.variants.items()}
        free = {a: free_runs(v.local[who].ship, calm.trials) for a, v in calm.variants.items()}
        go = {a: free_runs(v.whole[who].ship, calm.trials) for a, v in calm.variants.items()}
        extra = {} if who == FULL else {"Table 4 as printed": paper.small}
        steps = {**lo, **{name: one_step(ship, calm.trials) for name, ship in extra.items()}}
        runs = {**go, **{name: free_runs(ship, calm.trials) for name, ship in extra.items()}}
        out += figure(sequence(calm.trials, steps), f"Fig. {numbers_[0]}: LO, {size} parameters, each row from the "
                      "measured row before")  # fmt: skip
        out += figure(sequence(calm.trials, runs), f"Fig. {numbers_[1]}: GO, {size} parameters, each manoeuvre from "
                      "its first row")  # fmt: skip
        out += _against(calm, {a: (lo[a], free[a], go[a]) for a in calm.variants}, size)
    return out


def _against(calm: Weather, made: Mapping[str, tuple[Sequence[st.Array], ...]], size: int) -> st.blocks.Body:
    """Root mean square errors of each manoeuvre: single steps of LO, LO run freely, GO run freely."""
    out: st.blocks.Body = ()
    for letter, ways in made.items():
        errors = [_rms(one, calm.trials) for one in ways]
        rows = [
            [
                trial.name,
                *(
                    number(st.rivals_page.AXES[v][1] * float(one[k, c]), 2)
                    for c, v in enumerate(VELOCITIES)
                    for one in errors
                ),
            ]
            for k, trial in enumerate(calm.trials)
        ]
        head = [f"{letter}, {size}", *(f"{v}: {way}" for v in VELOCITIES for way in ("LO steps", "LO run", "GO run"))]
        out += table(head, rows)
    remark = (
        "Calm; root mean square error in m/s and degrees a second: single steps and free runs by LO, free runs by GO."
    )
    return out + soft(remark)


def sequence(trials: Sequence[st.Trial], curves: Mapping[str, Sequence[st.Array]]) -> str:
    """Velocities of all manoeuvres one after the other, measured and by each of the `curves`."""
    drawn, axes = st.figures.canvas(3, (11.0, 5.0))
    edges = np.cumsum([0.0, *(t.duration + t.dt for t in trials)])
    for c, (ax, (_, (label, factor))) in enumerate(zip(axes, st.rivals_page.AXES.items(), strict=True)):
        for k, trial in enumerate(trials):
            t = edges[k] + (trial.t - trial.t[0])[::_DRAWN]
            logged = factor * trial.stack(*VELOCITIES)[::_DRAWN, c]
            ax.plot(t, logged, color="#c9d0d6", lw=3.2, label="measured" if not k else None)
            for name, made in curves.items():
                style = _LINES[name]
                ax.plot(t, factor * made[k][::_DRAWN, c], lw=1.1, label=name if not k else None, **style)
        every_one = factor * np.concatenate([t.stack(*VELOCITIES)[:, c] for t in trials])
        room = 0.25 * float(np.ptp(every_one))
        ax.set_ylim((float(every_one.min()) - room, float(every_one.max()) + room))
        for edge in edges[1:-1]:
            ax.axvline(edge, color=st.figures.RULE, lw=0.8)
        ax.set_ylabel(label)
    axes[-1].set_xticks(0.5 * (edges[1:] + edges[:-1]), [t.name for t in trials])
    axes[-1].set_xlim((0.0, edges[-1]))
    axes[-1].x.size = 6.5
    st.figures.legend_below(drawn, axes[0])
    return st.figures.svg(drawn, f"sequence {' '.join(curves)} {float(next(iter(curves.values()))[0][-1, 0]):.6g}")
