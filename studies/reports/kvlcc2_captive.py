"""Page of KVLCC2 from captive tests to trials: coefficients, prediction of zigzags, fine-tuning, and a rival model.

    python studies/reports/kvlcc2_captive.py -o RUN

Fits the 81 captive runs of HMRI anew, predicts the zigzags of HSVA and MARIN with their coefficients, tunes them from
there (studies/kvlcc2_captive.toml), does the same with the modified Abkowitz model, and writes RUN/report.html and
.json, and the tuned ship as RUN/model.toml, in about a minute.  The trials are in `$SEATRIAL_DATA`.
"""

from __future__ import annotations

import argparse
import math
import os
import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import kvlcc2_captive_arm as arm
import numpy as np

import seatrial as st

number, Section, soft, table = st.blocks.number, st.page.Section, st.blocks.soft, st.blocks.table

STUDIES = Path(__file__).parents[1]
COLUMNS = STUDIES / "kvlcc2_captive_columns.toml"
DEGREES = math.degrees(1.0)
RESTART = 30.0
PUBLISHED, CAPTIVE, TUNED = "published", "captive tests", "captive tests, tuned"
FROM_PUBLISHED = "published, tuned"
WHOLE = tuple(f"modified Abkowitz, {step}" for step in ("simulated MMG", "captive tests", "captive tests, tuned"))
WHY = {
    "hull.R_0": "The published number is 1.35 times the friction of the ITTC line with its form factor, this one "
    "1.01 times. At the revolutions of the zigzags the published ship is slower than all of them.",
    "hull.X_vv": "Drift to 30 deg here; with X_vvvv it is one curve, whose two terms exchange.",
    "hull.X_vvvv": "As X_vv.",
    "hull.Y_vvv": "A cubic is not the force to 30 deg of drift: see the table of the ranges.",
    "hull.N_vvv": "As Y_vvv.",
    "propeller.t_P": "From runs at six propeller loads with the thrust measured.",
    "propeller.w_P0": "From the thrust and an open-water curve of another propeller.",
    "rudder.kappa": "Goes with epsilon: the product at the approach is alike.",
    "rudder.x_H": "N over Y of the rudder runs is .60 L, beyond the rudder. The point of reference of N, which the "
    "table does not state, and rudder angles above 10°: see the table below.",
    "rudder.gamma_Rn": "The sides differ in the same sense, by less.",
    "rudder.delta_0": "The published model has none: gauges read a moment at midships.",
}  # fmt: skip


@dataclass(frozen=True)
class Found:
    """All that the page shows.

    Attributes:
        tests: the fit to the captive tests; within: the same with drift angles up to a limit [deg].
        whole: that of the modified Abkowitz model.
        study, fit: the fine-tuning from the captive tests.
        ships: by label.
    """

    tests: st.CaptiveFit
    within: Mapping[int, st.CaptiveFit]
    whole: st.CaptiveFit
    study: st.Study
    fit: st.Fit
    ships: Mapping[str, st.Ship]

    @property
    def trials(self) -> tuple[st.Trial, ...]:
        """Those trained on, then those kept back."""
        return (*self.study.problem.trials, *self.study.test)


def find() -> Found:
    """Fit the captive tests, then the trials."""
    root = Path(os.environ.get("SEATRIAL_DATA", STUDIES.parents[1] / "shared" / "data")) / "kvlcc2_captive"
    water = root / "open_water_characteristics_captive.csv"
    tests = st.captive(STUDIES / "kvlcc2_l7_neutral.toml", [root / "captive.csv"], mapping=COLUMNS, water=water)
    whole = st.captive("modified_abkowitz_kvlcc2_l7", [root / "captive.csv"], mapping=COLUMNS, water=water)
    drift = np.abs(tests.runs.beta) * DEGREES
    within = {limit: st.fit_captive(tests.began, tests.runs.kept(drift < limit + 0.1)) for limit in (12, 20, 30)}
    studies = {label: st.read_study(STUDIES / f"{name}.toml") for label, name in (
        (TUNED, "kvlcc2_captive"), (FROM_PUBLISHED, "kvlcc2_fine_tuning"), (WHOLE[2], "kvlcc2_captive_abkowitz")
    )}  # fmt: skip
    fits = {label: study.estimator.fit(study.problem) for label, study in studies.items()}
    ships = {
        PUBLISHED: st.load("kvlcc2_l7"), FROM_PUBLISHED: fits[FROM_PUBLISHED].ship,
        CAPTIVE: studies[TUNED].problem.ship, TUNED: fits[TUNED].ship,
        WHOLE[0]: st.load("modified_abkowitz_kvlcc2_l7"), WHOLE[1]: studies[WHOLE[2]].problem.ship,
        WHOLE[2]: fits[WHOLE[2]].ship,
    }  # fmt: skip
    return Found(tests, within, whole, studies[TUNED], fits[TUNED], ships)


def errors(ship: st.Ship, trial: st.Trial, restart: float | None) -> dict[str, float]:
    """Root mean square errors of heading [rad], rate of turn [rad/s] and speed [m/s] of one prediction."""
    both = st.metrics.pairs(trial, st.replay(ship, trial, restart=restart), restart)
    return {name: float(np.sqrt(np.nanmean((both[name][1] - both[name][0]) ** 2))) for name in ("psi", "r", "u")}


def executed(trial: st.Trial, delta: float, psi: float) -> float:
    """Mean heading at which the rudder of a measured zigzag leaves its angle [rad]: the tanks reversed it late."""
    heading, rudder = trial["psi"], trial["delta"] / delta
    over = np.abs(rudder) > 0.98
    left = np.flatnonzero(over[:-1] & ~over[1:])
    swung = [
        abs(float(heading[k])) for k in left if np.abs(rudder[k : k + 40]).min() < 0.5
    ]  # not a wobble of the angle
    return float(np.mean(swung)) if swung else psi


def overshoots(trial: st.Trial, ship: st.Ship | None = None) -> list[float]:
    """First and second overshoot beyond the nominal heading [rad], measured or of a ship that runs the zigzag itself.

    The ship starts in the state of the trial and reverses its rudder at the heading at which the trial did.
    """
    policy = st.comparison.manoeuvre(trial)
    if not isinstance(policy, st.manoeuvres.zigzag.Zigzag):
        return []
    late, run = 0.0, trial
    if ship is not None:
        late = executed(trial, policy.delta, policy.psi) - policy.psi
        policy = replace(policy, n_P=float(np.nanmean(trial["n_P"])), psi=policy.psi + late)
        start = (0.0, 0.0, 0.0, *(float(trial[name][0]) for name in ("u", "v_m", "r")))
        run = st.run_policy(replace(ship, validity={}), policy, start=start, duration=trial.duration, dt=0.05)
    got = policy.indices(run, 7.0)
    return [got[name].value + late if name in got else math.nan for name in ("first_overshoot", "second_overshoot")]


def numbers(found: Found) -> dict[str, Any]:
    """The numbers of the page: overshoots and errors by ship and trial, and what the tuning moved."""
    held = {trial.name for trial in found.study.test}
    return {
        "captive": st.captive_page.numbers(found.tests), "captive_whole_ship": st.captive_page.numbers(found.whole),
        "ranges": {str(limit): dict(zip(fit.paths, fit.values.tolist(), strict=True))
                   for limit, fit in found.within.items()},
        "x_H": arm.fits(found.tests), "overshoots_missed": missed(found),
        "trials": {
            trial.name: {
                "held_out": trial.name in held, "overshoots": overshoots(trial),
                "ships": {label: {"overshoots": overshoots(trial, ship), "whole": errors(ship, trial, None),
                                  "restarted": errors(ship, trial, RESTART)}
                          for label, ship in found.ships.items()},
            } for trial in found.trials
        },
        "tuning": {free.path: {"captive": free.start, "prior": free.sigma, "tuned": float(value), "sigma": float(sigma)}
                   for free, value, sigma in zip(found.fit.free, found.fit.values, found.fit.sigma, strict=True)},
    }  # fmt: skip


def missed(found: Found) -> dict[str, float]:
    """Mean size of the error of both overshoots of all zigzags [deg], by the point about which N is taken to be."""
    return {name: float(np.nanmean([
        np.abs(np.subtract(overshoots(trial, fit.ship), overshoots(trial))) for trial in found.trials
    ])) * DEGREES for name, fit in arm.at_points(found.tests).items()}  # fmt: skip


def page(found: Found, sources: Mapping[str, str]) -> st.page.Page:
    """The story in its order."""
    said = numbers(found)
    parts = (
        Section("", st.blocks.fields(said, st.blocks.lead(story(said)) + means(said))),
        Section("1. Captive tests", beside(found) + arms(found, said) + ranges(found)),
        *st.captive_page.sections(found.tests)[1:],
        Section("2. Prediction of the zigzags", predicted(found, said)),
        Section("3. Fine-tuning to the zigzags", moved(found)),
        Section("4. Held-out zigzags", drawn(found)),
        Section("5. The modified Abkowitz model", whole_ship(found)),
        st.page.provenance(sources),
    )
    return st.page.Page("KVLCC2: captive tests, prediction, fine-tuning", parts)


def story(said: Mapping[str, object]) -> str:
    """The outcome in three sentences."""
    speed, heading, over = (
        [by * mean(said, label, True, kind, name) if kind else DEGREES * miss(said, label, True)
         for label in (PUBLISHED, CAPTIVE, TUNED)]
        for kind, name, by in (("whole", "u", 1.0), ("restarted", "psi", DEGREES), ("", "", 1.0))
    )  # fmt: skip
    return (
        f"Three held-out zigzags: speed is missed by {number(speed[0])} m/s with published coefficients, by "
        f"{number(speed[1])} with those of captive tests, none of which has yaw; overshoots by {number(over[0])}° "
        f"and {number(over[1])}°. Tuned to eight other zigzags, the latter miss overshoots by {number(over[2])}°, "
        f"and the heading within 30 s by {number(heading[2])}° ({number(heading[1])}° before)."
    )


def mean(said: Mapping[str, object], label: str, held: bool, kind: str, name: str) -> float:
    """Mean error of a ship over the trials held out, or over the others."""
    rows = [one for one in said["trials"].values() if one["held_out"] == held]  # type: ignore[attr-defined]
    return float(np.mean([one["ships"][label][kind][name] for one in rows]))


def miss(said: Mapping[str, object], label: str, held: bool) -> float:
    """Mean size of the error of both overshoots [rad], where both runs have them."""
    rows = [one for one in said["trials"].values() if one["held_out"] == held]  # type: ignore[attr-defined]
    missed = [np.abs(np.subtract(one["ships"][label]["overshoots"], one["overshoots"])) for one in rows]
    return float(np.nanmean(missed))


def means(said: Mapping[str, object]) -> st.blocks.Body:
    """Mean errors of each ship, held-out zigzags first."""
    labels = list(next(iter(said["trials"].values()))["ships"])  # type: ignore[attr-defined]
    rows = [
        [label, *(number(cell) for held in (True, False) for cell in (
            DEGREES * mean(said, label, held, "restarted", "psi"), DEGREES * mean(said, label, held, "restarted", "r"),
            DEGREES * mean(said, label, held, "whole", "psi"), mean(said, label, held, "whole", "u"),
            DEGREES * miss(said, label, held)))]
        for label in labels
    ]  # fmt: skip
    kinds = ("ψ [°], 30 s", "r [°/s], 30 s", "ψ [°], whole", "u [m/s], whole", "overshoots [°]")
    head = ("model", *(f"held out: {kind}" for kind in kinds), *(f"trained: {kind}" for kind in kinds))
    remark = (
        "Root mean square errors, mean over three zigzags held out and eight trained on; restarted from the measured "
        "state every 30 s, and free-running over the whole trial. Overshoots: mean size of the error of the first two; "
        "each ship runs the zigzag itself and reverses its rudder at the heading at which the tank did. Only models "
        "that are called tuned have seen a trial, and none a held-out one."
    )
    return table(head, rows) + soft(remark)


def beside(found: Found) -> st.blocks.Body:
    """Published coefficients beside those of these tests, and why they differ."""
    published, tests = found.ships[PUBLISHED], found.tests
    rows: list[list[str]] = []
    for path, value, sigma in zip(tests.paths, tests.values.tolist(), tests.sigma.tolist(), strict=True):
        unit = st.parameters.specs(tests.ship.model)[path].unit
        printed = 0.0 if path == "rudder.delta_0" else float(st.parameters.read(published.model, path))
        a, b, s = (st.captive_page.shown(path, v, unit, 7.0) for v in (printed, value, sigma))
        far = abs(b - a) > 2.0 * s
        rows.append([path, number(a), number(b), number(s, 2), number((b - a) / s, 2),
                     WHY.get(path, "") if far else "within two sigma"])  # fmt: skip
    head = ("parameter", "published", "captive", "sigma", "difference / sigma", "why they differ")
    return table(head, rows, words=(5,), wide=True)


def arms(found: Found, said: Mapping[str, Any]) -> st.blocks.Body:
    """Why x_H differs."""
    return arm.section(found.tests, found.ships[PUBLISHED], said["x_H"], said["overshoots_missed"])


def ranges(found: Found) -> st.blocks.Body:
    """How the coefficients of drift depend on the range of drift angles."""
    paths = ("hull.Y_v", "hull.Y_vvv", "hull.N_v", "hull.N_vvv", "hull.X_vv", "rudder.gamma_Rp", "rudder.gamma_Rn")
    rows = [
        [f"{limit}° ({len(fit.runs)} runs)",
         *(f"{number(fit.values[k])} ± {number(fit.sigma[k], 2)}" for k in map(fit.paths.index, paths))]
        for limit, fit in found.within.items()
    ]  # fmt: skip
    published = [
        "published (20°)",
        *(number(float(st.parameters.read(found.ships[PUBLISHED].model, path))) for path in paths),
    ]
    remark = (
        "The same tests with drift up to a limit: linear and cubic terms depend on it by more than white noise would "
        "allow, which is why sigma is a jackknife over conditions."
    )
    return st.blocks.heading("The range of drift") + table(("drift up to", *paths), [published, *rows]) + soft(remark)


def predicted(found: Found, said: Mapping[str, object]) -> st.blocks.Body:
    """Overshoots and errors of each zigzag: measured, published, captive tests, tuned."""
    labels = (PUBLISHED, CAPTIVE, TUNED)
    turns: list[list[str]] = []
    rows: list[list[str]] = []
    for name, one in said["trials"].items():  # type: ignore[attr-defined]
        title = f"{name}{' (held out)' if one['held_out'] else ''}"
        turns.append([title, both(one["overshoots"]), *(both(one["ships"][label]["overshoots"]) for label in labels)])
        shown = (("restarted", "psi", DEGREES), ("whole", "psi", DEGREES), ("whole", "u", 1.0))
        cells = [one["ships"][label][kind][value] * by for kind, value, by in shown for label in labels]
        rows.append([title, *map(number, cells)])
    short = ("publ.", "captive", "tuned")
    head = ("trial", *(f"{what}, {step}" for what in ("ψ [°] 30 s", "ψ [°] whole", "u [m/s]") for step in short))
    remark = (
        "Root mean square errors: ψ with restarts every 30 s, ψ and u free-running over the whole trial, where an "
        "early error of this unstable ship grows. Tuned: section 3."
    )
    over = table(("trial", "measured", *labels), turns)
    below = soft("First and second overshoot beyond the nominal heading [°]; the rudder reverses where the tank's did.")
    heading = st.blocks.heading
    return heading("Overshoots") + over + below + heading("Errors") + table(head, rows) + soft(remark)


def both(pair: list[float]) -> str:
    """Two overshoots in degrees."""
    return ", ".join(number(DEGREES * one, 3) for one in pair)


def moved(found: Found) -> st.blocks.Body:
    """What the tuning moved, in sigmas of the captive tests."""
    meanings = st.parameters.specs(found.study.problem.ship.model)
    rows: list[list[str]] = []
    for free, value, sigma in zip(found.fit.free, found.fit.values, found.fit.sigma, strict=True):
        a, s, b, t = (st.captive_page.shown(free.path, float(v), meanings[free.path].unit, 7.0)
                      for v in (free.start, free.sigma, value, sigma))  # fmt: skip
        origin = "captive tests" if free.path in found.tests.paths else "published, 30 %"
        rows.append([free.path, number(a), number(s, 2), origin, number(b), number(t, 2), number((b - a) / s, 2)])
    head = ("parameter", "before", "prior sigma", "prior from", "tuned", "sigma", "moved by, in prior sigmas")
    return table(head, rows, words=(3,)) + soft("Lengths over L_pp.")


def drawn(found: Found) -> st.blocks.Body:
    """Heading of the held-out zigzags over time."""
    labels = (PUBLISHED, CAPTIVE, TUNED)
    styles = st.figures.line_styles(labels, PUBLISHED)
    out: list[st.blocks.Body] = []
    for trial in found.study.test:
        graph, (ax,) = st.figures.canvas(1, (5.2, 3.2))
        st.figures.measured_motion(ax, trial, "psi", DEGREES)
        ax.lines[-1].look["label"] = "measured"
        for label in labels:
            run = st.replay(found.ships[label], trial)
            colour, dashes = styles[label]
            ax.plot(run.t[::10], DEGREES * run["psi"][::10], color=colour, ls=dashes, lw=1.4, label=label)
        low, high = DEGREES * np.nanmin(trial["psi"]), DEGREES * np.nanmax(trial["psi"])
        ax.set(xlabel="time t [s]", ylabel="ψ [°]", ylim=(2.5 * low - 1.5 * high, 2.5 * high - 1.5 * low))
        st.figures.legend_below(graph, ax)
        out.append(
            st.blocks.figure(
                st.figures.svg(graph, f"heading {trial.name}"), f"{trial.name}: free-running, by the measured rudder"
            )
        )
    return st.blocks.gallery(*out)


def whole_ship(found: Found) -> st.blocks.Body:
    """Coefficients of the modified Abkowitz model from the captive tests."""
    words = (
        "The same tests and trials fitted with the modified Abkowitz model, whose errors are in the first table. Terms "
        "with yaw begin at what a fit to the simulated MMG ship gave, since no captive run has yaw."
    )
    return st.blocks.line(words) + st.captive_page.sections(found.whole)[1].body


def main(arguments: list[str] | None = None) -> int:
    """Fit, predict, tune, write the page."""
    asked = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    asked.add_argument("-o", "--out", type=Path, required=True, metavar="RUN", help="folder of the page")
    given = asked.parse_args(arguments)
    try:
        found = find()
        sources = {
            "captive tests": found.tests.runs.source,
            "study": "studies/kvlcc2_captive.toml",
            "digest": found.study.digest,
            "version": f"seatrial {st.__version__}",
            "command": f"python studies/reports/kvlcc2_captive.py -o {given.out}",
        }
        path = st.page.write(given.out / "report.html", page(found, sources))
        st.save(
            found.fit.ship, given.out / "model.toml", {"study": "kvlcc2_captive", "digest": found.study.digest}
        )
    except st.SeatrialError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    except OSError as error:
        sys.stderr.write(f"{error.filename}: cannot be written: {error.strerror}\n")
        return 1
    sys.stdout.write(f"wrote {path}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
