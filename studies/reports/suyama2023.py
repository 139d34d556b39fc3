"""Page of Suyama 2023: its Tables 1 and 3 to 7 and Figures 2 to 11, as printed beside ours.

    seatrial paper suyama2023 -o PAGE.html

Runs studies/suyama2023.toml.  What the paper prints is in studies/suyama2023_printed.toml; long experiments are read
from benchmarks/results, where overfitting.py, boxes.py and flap.py leave them.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

import seatrial as st

figure, gallery, number, Section = st.blocks.figure, st.blocks.gallery, st.blocks.number, st.page.Section
soft, table = st.blocks.soft, st.blocks.table
Row = st.printed.Row

COST = "a minute or two on two cores"
TABLES = (1, 3, 4, 5, 6, 7)
STUDIES = Path(__file__).parents[1]
STUDY, PRINTED = STUDIES / "suyama2023.toml", STUDIES / "suyama2023_printed.toml"
RESULTS = STUDIES.parent / "benchmarks" / "results"
_AT_END, _LONG, _HARD = 1e-3, 900.0, 35.0
# Table 7 is printed with four decimals.
_DIGIT = 1e-4


@dataclass(frozen=True)
class Found:
    """All that the page shows: the study, what came of it, what is printed, and the ships of Table 7 by range."""

    study: st.Study
    tuning: st.tuned.Tuning
    printed: Mapping[str, Any]
    sets: Mapping[str, st.Ship]

    @property
    def base(self) -> st.Ship:
        """The ship before tuning."""
        return self.tuning.problem.ship

    @property
    def paths(self) -> tuple[str, ...]:
        """The parameters of Eq. 37."""
        return tuple(f.path for f in self.tuning.problem.free)

    @property
    def published(self) -> tuple[st.tuned.Range, ...]:
        """The ranges with the values of Table 7 in place of ours."""
        out: list[st.tuned.Range] = []
        for r in self.tuning.ranges:
            ship = self.sets[f"{r.ratio:g}"]
            values = np.array([float(st.parameters.read(ship.model, path)) for path in self.paths])
            out.append(replace(r, fit=replace(r.fit, ship=ship, values=values)))
        return tuple(out)


def page(found: Found, sources: Mapping[str, str]) -> st.page.Page:
    """The tables and figures of the paper, the printed ones beside ours; `sources` are the provenance."""
    inputs, tuned, said = input_rows(found), tuned_rows(found), finding_rows(found)
    every = [row for rows in (*inputs.values(), *tuned.values(), said) for row in rows]
    same = sum(row.same for row in every)
    head = st.blocks.lead(
        f"{found.printed['source']}: every number of its tables and every finding of its figures beside ours."
    )
    counts = [(f"{same} of {len(every)}", "numbers and findings as printed"),
              (f"{sum(row.same for row in said)} of {len(said)}", "of these, findings of the figures")]  # fmt: skip
    parts = (
        Section("", head + st.blocks.tiles(counts)),
        Section("Where this page departs from the paper", st.blocks.bullets(found.printed["departures"]["lines"])),
        Section("What the figures say", st.printed.side_by_side(said, first="finding", digits=3)),
        Section("Tables 1 and 3 to 6: the ship before tuning", headed(inputs)),
        Section("Fig. 2: a trial", one_trial(found)),
        Section("Fig. 3: turns of 35 deg before tuning", before(found)),
        Section("Fig. 4: the search and its restarts", searched(found)),
        Section("Figs. 5 and 6: J over the range", gallery(figure(st.tuning_page.objectives(found.tuning), "Loss J"))),
        Section("Fig. 6: which truths are overfitted at .6", truths()),
        Section("Table 7 and Fig. 7: the tuned parameters", placed(found) + headed(tuned)),
        Section("Figs. 8 to 11: the test trials", trials(found)),
        Section("Readings of the flap and the slipstream", readings()),
        Section("How the box is kept", boxes()),
        st.page.provenance(sources),
    )
    numbers = {"schema": "seatrial-printed/1", "rows": {name: st.printed.fields(rows) for name, rows in (
        *inputs.items(), *tuned.items(), ("findings", said))}}  # fmt: skip
    return st.page.Page("Suyama 2023, printed and ours", (Section("", st.blocks.fields(numbers)), *parts))


def headed(tables: Mapping[str, Sequence[Row]]) -> st.blocks.Body:
    """Tables, each with its heading."""
    return st.blocks.joined(
        st.blocks.heading(title) + st.printed.side_by_side(rows, digits=6) for title, rows in tables.items()
    )


def as_given(ship: st.Ship, path: str, value: float | None = None) -> float:
    """A number of `ship`, or this value of it, in the unit of its file: primed where the file primes it."""
    entry = ship.entries[path]
    if path.startswith("particulars."):
        return entry.given
    inside = float(st.parameters.read(ship.model, path))
    return (inside if value is None else value) * (entry.given / inside if entry.prime else 1.0)


def summed(ship: st.Ship, terms: Iterable[str]) -> float:
    """Sum of numbers of `ship`: a path, one with a minus, or a ratio of two."""
    total = 0.0
    for term in terms:
        above, _, below = term.removeprefix("-").partition("/")
        value = as_given(ship, above) / (as_given(ship, below) if below else 1.0)
        total += -value if term.startswith("-") else value
    return total


def input_rows(found: Found) -> dict[str, list[Row]]:
    """Tables 1 and 3 to 6 by title."""
    return {one["title"]: [
        Row(row["name"], row["printed"], summed(found.base, row["of"]), row.get("unit", "")) for row in one["rows"]
    ] for one in found.printed["input"]}  # fmt: skip


def tuned_rows(found: Found) -> dict[str, list[Row]]:
    """Table 7 by range, with our fits."""
    said, out = found.printed["tuned"], dict[str, list[Row]]()
    for ours, theirs in zip(found.tuning.ranges, found.published, strict=True):
        key = f"{ours.ratio:g}"
        out[f"a_r = {key}"] = [
            Row(name, printed, as_given(found.base, path, float(value)), "", said[where(there, here)], _DIGIT)
            for name, path, printed, value, there, here in zip(
                said["names"], found.paths, said[key], ours.fit.values, ends(theirs), ends(ours), strict=True)
        ]  # fmt: skip
    return out


def ends(r: st.tuned.Range) -> list[int]:
    """-1 or 1 for a value at an end of its range, to the digits printed; else 0."""
    return [int(np.sign(p)) if abs(p) > 1.0 - _AT_END else 0 for p in r.position]


def where(printed: int, ours: int) -> str:
    """Key of the reason why a parameter of Table 7 and ours differ."""
    if ours == printed:
        return "same_end" if ours else "apart"
    return "other_end" if ours else "inside"


def finding_rows(found: Found) -> list[Row]:
    """The statements, each with the finding of its name."""
    ours = findings(found)
    return [Row(f"{one['figure']}: {one['name']}", one["printed"], ours[one["ours"]], one.get("unit", ""),
                one.get("why", "")) for one in found.printed["finding"]]  # fmt: skip


def findings(found: Found) -> dict[str, float | str]:
    """What the figures of the paper say, of ours."""
    tuning, ranges = found.tuning, found.tuning.ranges
    test = [sum(r.test.values()) for r in ranges]
    tune = [sum(r.tune.values()) for r in ranges]
    angles = [float(t.name[1:]) for t in tuning.tests]
    before = {d: diameter(found.base, d) for d in (*angles, _HARD)}
    sets = {a: {d: diameter(ship, d) for d in angles} for a, ship in found.sets.items()}
    fits = [{d: diameter(r.fit.ship, d) for d in angles} for r in ranges]
    apart = {d: abs(sets["0.6"][d] - sets["0.5"][d]) for d in angles}
    said = found.printed["tuned"]["names"]
    return {
        "greater_side": "starboard" if before[_HARD] > before[-_HARD] else "port",
        "restarts_agree": yes(all(np.sum(ends_of(r) <= ends_of(r).min() * (1 + tuning.agreement)) > 1 for r in ranges)),
        "tune_falls": yes(all(b <= a for a, b in pairwise(tune))),
        "test_least": ranges[int(np.argmin(test))].ratio, "test_greatest": ranges[int(np.argmax(test))].ratio,
        "same_end": same_end(ranges, said), "same_end_printed": same_end(found.published, said),
        "nearer": float(nearer(found)),
        "larger": float(sum(bool(one[d] > before[d]) for one in sets.values() for d in angles)),
        "larger_fits": float(sum(bool(one[d] > before[d]) for one in fits for d in angles)),
        "apart_10": apart[-10.0], "apart_others": f"{max(v for d, v in apart.items() if d != -10.0):.2f} at most",
    }  # fmt: skip


def yes(true: bool) -> str:
    return "yes" if true else "no"


def ends_of(r: st.tuned.Range) -> Any:
    """J at the end of each run of CMA-ES."""
    return np.asarray(r.methods["evolution"].ends)[:, 0]


def same_end(ranges: Sequence[st.tuned.Range], names: Sequence[str]) -> str:
    """Parameters at the same end of every range."""
    table_of = np.array([ends(r) for r in ranges])
    return ", ".join(name for name, column in zip(names, table_of.T, strict=True) if abs(column.sum()) == len(ranges))


def turn(ship: st.Ship, degrees: float) -> st.Trial:
    """A turn as the paper simulates it (sec. 6.1): from 6 knots at 106 rpm, the rudder over at once, Euler's rule."""
    speed, n_P = st.approach(ship)
    turn = st.manoeuvres.turning.Turning(n_P, math.radians(degrees))
    return st.run_policy(ship, turn, speed=speed, duration=_LONG, dt=1.0, method="euler", name=f"D{degrees:+g}")


def diameter(ship: st.Ship, degrees: float) -> float:
    """Steady diameter of a turn, in lengths."""
    run = turn(ship, degrees)
    u, v_m, r = (float(run[name][-1]) for name in ("u", "v_m", "r"))
    return 2.0 * math.hypot(u, v_m) / abs(r) / ship.L_pp


def away(ship: st.Ship, trial: st.Trial) -> float:
    """Root mean square distance of the predicted track from the trial [m]."""
    run = st.replay(ship, trial, method="euler")
    rows = slice(0, len(run))
    return math.sqrt(float(np.mean((run["x"] - trial["x"][rows]) ** 2 + (run["y"] - trial["y"][rows]) ** 2)))


def nearer(found: Found) -> int:
    """How many predictions of the test trials by tuned ships are nearer than those of the untuned one."""
    return sum(away(r.fit.ship, t) < away(found.base, t) for t in found.tuning.tests for r in found.tuning.ranges)


def before(found: Found) -> st.blocks.Body:
    """Fig. 3: the turns to both sides before tuning."""
    port, starboard = (turn(found.base, side * _HARD) for side in (-1.0, 1.0))
    return gallery(figure(st.tuning_page.tracks(starboard, {"to port": port}),
                          "Starboard (measured style) and port, 35 deg, 106 rpm, from 6 knots"))  # fmt: skip


def one_trial(found: Found) -> st.blocks.Body:
    """Fig. 2: the virtual trial of the angle that the paper shows."""
    trial = next(t for t in found.tuning.problem.trials if t.name == "D+10")
    return gallery(figure(st.tuning_page.tracks(trial, {}), f"{trial.name}, ours"),
                   figure(st.tuning_page.motions(trial, {}), "As logged: the rudder as ordered"))  # fmt: skip


def searched(found: Found) -> st.blocks.Body:
    """Fig. 4 for every range, and the end of each run."""
    estimator: Any = found.study.estimator
    rows = [[f"{r.ratio:g}", *(number(float(j), 7) for j in ends_of(r))] for r in found.tuning.ranges]
    most = max(len(row) for row in rows)
    sizes = [min(estimator.population * 2**k, estimator.largest) for k in range(most - 1)]
    head = ["a_r", *(f"J, population {size}" for size in sizes)]
    drawn = (figure(st.tuning_page.search(r.methods["evolution"], f"{r.ratio:g}"), f"a_r = {r.ratio:g}")
             for r in found.tuning.ranges)  # fmt: skip
    return table(head, [row + ["–"] * (most - len(row)) for row in rows]) + gallery(*drawn)


def placed(found: Found) -> st.blocks.Body:
    """Fig. 7 as printed and ours."""
    return gallery(
        figure(st.tuning_page.positions(found.published), "Table 7 as printed: place of each parameter in its range"),
        figure(st.tuning_page.positions(found.tuning.ranges), "Ours, tuned to the virtual trials"),
    )


def trials(found: Found) -> st.blocks.Body:
    """Figs. 8 to 11: the test trials with the published sets and with our fits."""
    parts = [soft("The black track is our virtual trial, not the paper's. Left, the sets of Table 7 as our model turns "
                  "with them; right, our fits.")]  # fmt: skip
    for trial in found.tuning.tests:

        def ran(ranges: Sequence[st.tuned.Range], trial: st.Trial = trial) -> dict[str, st.Trial]:
            ships = {st.tuning_page.UNTUNED: found.base} | {f"a_r {r.ratio:g}": r.fit.ship for r in ranges}
            return {label: st.replay(ship, trial, method="euler") for label, ship in ships.items()}

        theirs, ours = ran(found.published), ran(found.tuning.ranges)
        parts.append(st.blocks.heading(trial.name) + gallery(
            figure(st.tuning_page.tracks(trial, theirs), "Sets of Table 7"),
            figure(st.tuning_page.tracks(trial, ours), "Our fits"),
            figure(st.tuning_page.motions(trial, theirs), "Sets of Table 7"),
            figure(st.tuning_page.motions(trial, ours), "Our fits"),
        ))  # fmt: skip
    return st.blocks.joined(parts)


def result(name: str) -> Mapping[str, Any]:
    """A file of benchmarks/results."""
    return json.loads((RESULTS / f"suyama2023_{name}.json").read_text(encoding="utf-8"))


def truths() -> st.blocks.Body:
    """The truths that were tried, by group and each by itself."""
    of = result("truths")
    ratios, rows = of["ratios"], [row for row in of["rows"] if "failed" not in row]
    groups = dict.fromkeys(row["group"] for row in of["rows"])
    counted: list[list[str]] = []
    for group in groups:
        some = [row for row in rows if row["group"] == group]
        failed = sum(row["group"] == group for row in of["rows"]) - len(some)
        least = [sum(row["least"] == a for row in some) for a in ratios]
        greatest = [row for row in some if row["greatest"] == ratios[-1]]
        both = sum(row["least"] == ratios[-2] for row in greatest)
        counts = (len(some), failed, *least, sum(worse(row) for row in some), len(greatest), both)
        counted.append([group, *map(str, counts)])
    head = ["truths", "tried", "left out", *(f"least {a:g}" for a in ratios), ".6 over .5", ".6 greatest", "Fig. 6"]
    head_of = ["group", "truth", *(f"J test, {a:g}" for a in ratios), "least at"]
    lines = [[row["group"], row["truth"], *(number(j) for j in row["test"]), f"{row['least']:g}"] for row in rows]
    every = table(head_of, lines, words=(1,))
    remark = (
        f"{of['command']}: the gradient from {of['starts']} starts in each range, {of['seconds']:.0f} s. Every truth "
        "that was tried is listed; those that leave the validity of the ship are left out. Counted: where J of the "
        "test trials is least, whether it is larger in the widest range than in the one before, and than in all; "
        "Fig. 6 is least at .5 and greatest at .6. The groups finer and finest were searched after those before them "
        "were seen."
    )
    return table(head, counted) + soft(remark) + st.blocks.heading("Each truth") + every


def worse(row: Mapping[str, Any]) -> bool:
    """Whether the widest range predicts the test trials worse than the one before."""
    return bool(row["test"][-1] > row["test"][-2])


def readings() -> st.blocks.Body:
    """The readings of Eq. 30 and of the flap against what the figures say."""
    rows = [
        [f"{r['slipstream']}, {r['flap']}", f"{r['right']:.2f} > {r['left']:.2f}", str(r["larger"]),
         *(f"{r['apart'][d]:+.2f}" for d in ("-10", "+20", "-35", "+40")),
         *(f"{r['table7'][a]['off']:.2f}; {r['table7'][a]['same_bound']} of {r['table7'][a]['bounds']}"
           for a in ("0.5", "0.6"))]
        for r in result("flap")["rows"]
    ]  # fmt: skip
    head = ["slipstream, flap", "Fig. 3, D [L]", "larger, of 20", "D(.6) - D(.5), -10", "at +20",
            "at -35", "at +40", "Table 7 from .5", "from .6"]  # fmt: skip
    remark = (
        "Printed: right greater; 20 of 20; about 1.5; not much. Table 7: fits in the narrower ranges to the turns of "
        "the set named: rms difference of the places in the range (-1 to 1) from the printed ones; and how many of the "
        "values that are printed at an end are at this end. It hardly distinguishes the readings."
    )
    return table(head, rows) + soft(remark)


def boxes() -> st.blocks.Body:
    """Penalties of CMA-ES: how near and how soon, over seeds."""
    of, rows = result("boxes"), list[list[str]]()
    for row in of["rows"]:
        gaps = np.array(row["objectives"]) / row["optimum"] - 1.0
        soon = [n for n in row["to_target"] if n is not None]
        rows.append([f"{row['ratio']:g}", row["penalty"], str(row["population"]), number(float(np.median(gaps)), 2),
                     number(float(gaps.max()), 2), f"{int((gaps <= of['target']).sum())} of {gaps.size}",
                     f"{np.median(soon):.0f}" if soon else "–", f"{np.median(row['evaluations']):.0f}"])  # fmt: skip
    head = ["a_r", "penalty", "population", "J above best, median", "worst", f"within {of['target']:g}",
            "evals to it", "evals in all"]  # fmt: skip
    remark = (
        f"{of['command']}: {of['seeds']} seeds each. The optimum is the best of all runs and of 40 starts of the "
        'gradient. "spread" is ours, "hansen2009" the method that Sakamoto and Akimoto (2017) revise.'
    )
    return table(head, rows, words=(1, 2)) + soft(remark)


def made(command: str) -> st.page.Page:
    """Tune and compare; `command` is told on the page."""
    study, printed = st.read_study(STUDY), st.read_toml(PRINTED)
    if not isinstance(study.estimator, st.FineTuning):
        raise TypeError(f"{STUDY}: estimator.type is no fine-tuning; this page needs one")
    tuning = study.estimator.tune(study.problem, study.test)
    found = Found(study, tuning, printed, {a: st.load(name) for a, name in printed["tuned"]["ships"].items()})
    return page(found, {"study": str(STUDY), "digest": study.digest, "version": f"seatrial {st.__version__}",
                        "command": command})  # fmt: skip
