"""The live twin against its bars: a day of sailing, planted faults, forecasts on the Esso Osaka, and its cost.

`python benchmarks/live_twin.py [cost] [faults] [adversaries] [esso] [day] [unmatched]` writes results/live_twin.json.
"""

from __future__ import annotations

import json
import math
import os
import sys
import time
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests"))

from seatrial.core.parameters import values  # noqa: E402
from seatrial.data import unwrapped  # noqa: E402
from seatrial.data.formats import frt_esso  # noqa: E402
from seatrial.identify.networks.pushed import undisturbed  # noqa: E402
from seatrial.identify.nuisance import CURRENT  # noqa: E402
from seatrial.models import STATES  # noqa: E402
from seatrial.realtime.twin.ahead import Score, lasting, simpler  # noqa: E402
from seatrial.realtime.twin.follow import Follower, Machine, begun, made  # noqa: E402
from seatrial.realtime.twin.likely import likeliest  # noqa: E402
from seatrial.realtime.twin.live import Live  # noqa: E402
from seatrial.realtime.twin.settings import usual  # noqa: E402
from seatrial.realtime.twin.sources import channels_of, noise_of, rows_of  # noqa: E402
from seatrial.ships.files import load  # noqa: E402
from seatrial.simulate.replay import inputs, smoothed_starts  # noqa: E402
from voyages import KINDS, NOISE, Voyage, coaster, drifting  # noqa: E402

RESULTS = ROOT / "benchmarks" / "results" / "live_twin.json"
_DAY = 24.0
# Planted just before and during a change of course, which comes every 600 s.
_AT = (2399.0, 2410.0)


def unmatched() -> dict[str, Any]:
    """The same day under a gusty wind that turns and that neither log nor model has: as far as it goes wrong."""
    return day(pull=1e-3, gusty=True, sea=0.3)


def day(hours: float = _DAY, **given: object) -> dict[str, Any]:
    """A day with drifting resistance, turning current and a biased gyro: consistency, errors, false alarms."""
    voyage = drifting(hours, **given)
    live = Live(voyage.ship, usual(voyage.ship, list(NOISE), noise=NOISE, free=("hull.R_0",)), ("delta", "delta_cmd"))
    rows: list[tuple[float, float, float]] = []
    for (t, read), truth in voyage.rows():
        live.feed(t, read)
        if live.follower is not None and t >= 3600.0:
            north, east = (live.follower.value(name)[0] for name in CURRENT)
            rows.append((live.follower.value("hull.R_0")[0] / truth["R_0"] - 1.0, north - truth["current_x"],
                         east - truth["current_y"]))  # fmt: skip
    R_0, *current = np.array(rows).T
    away = np.hypot(*current)
    return {
        "hours": hours, "NIS in its 95 % band, share of hours": _share(live, 0.95),
        "NIS in its 99 % band, share of hours": _share(live, 0.99),
        "NIS per reading by hour": [round(one.mean, 4) for one in live.tally.hours],
        "R_0, error from the second hour on": {"rms": _rms(R_0), "99 %": float(np.quantile(abs(R_0), 0.99)),
                                               "largest": float(abs(R_0).max())},
        "current, error [m/s]": {"rms": _rms(away), "99 %": float(np.quantile(away, 0.99)),
                                 "largest": float(away.max())},
        "false alarms": [one.text for one in live.alarms],
    }  # fmt: skip


def _share(live: Live, band: float) -> float:
    whole = live.tally.hours
    return sum(one.inside(band) for one in whole) / len(whole)


def _rms(values: Any) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


NAMES = {"frozen compass": "compass frozen", "gnss jump": "position jumped", "gnss drift": "position drifts",
         "jammed rudder": "delta jammed", "slow rudder": "delta slow", "lost propeller": "n_P without its thrust",
         "log stuck": "log frozen", "current step": "current changed"}  # fmt: skip


def faults() -> dict[str, Any]:
    """Each fault, with and without the rudder's order beside its angle: what is named, and after how many seconds."""
    found: dict[str, Any] = {}
    for feedback in (True, False):
        for kind in KINDS:
            for at in _AT:
                voyage = Voyage(coaster(), (at + 120.0) / 3600.0, fault=kind, at=at, feedback=feedback)
                live = Live(voyage.ship, usual(voyage.ship, list(NOISE), noise=NOISE, free=("hull.R_0",)),
                            ("delta", "delta_cmd") if feedback else ())  # fmt: skip
                for (t, read), _ in voyage.rows():
                    live.feed(t, read)
                named = [(round(one.named - at), one.cause) for one in live.alarms]
                right = bool(named) and named[0][1] == NAMES[kind] and 0 <= named[0][0] <= 60
                label = f"{kind}, {'angle and order' if feedback else 'order alone'}, at {at:g} s"
                found[label] = {"named": right, "alarms": named}
                print(label, found[label], flush=True)
    return {"named within 60 s": sum(one["named"] for one in found.values()), "of": len(found), "each": found}


def cost() -> dict[str, Any]:
    """Processor time of a twin with five parameters at 10 rows a second, everything included."""
    free = ("hull.R_0", "hull.Y_v", "hull.N_r", "propeller.t_P", "rudder.t_R")
    voyage = Voyage(coaster(), 0.036, dt=0.1)
    rows = [row for row, _ in voyage.rows()]
    found: dict[str, Any] = {"rows": len(rows)}
    for estimator in ("ekf", "mhe"):
        settings = usual(voyage.ship, list(NOISE), noise=NOISE, free=free, estimator=estimator)
        live = Live(voyage.ship, settings, ("delta", "delta_cmd"))
        settled = len(rows) // 2  # the window of the horizon is full
        for t, read in rows[:settled]:
            live.feed(t, read)
        begun = time.process_time()
        for t, read in rows[settled:]:
            live.feed(t, read)
        each = (time.process_time() - begun) / (len(rows) - settled)
        found[estimator] = {"states": len(live.machine.names), "ms a row": 1e3 * each,
                            "share of a core at 10 Hz": 10.0 * each}  # fmt: skip
    return found


# What drifts on the Esso Osaka, and how uncertain it is: what studies/esso_osaka_hybrid.toml frees with its priors.
_FIXED = ("propeller.D_P", "propeller.pitch_ratio", "propeller.J_syn", "propeller.J_syn0", "rudder.A_R", "rudder.eta",
          "rudder.x_R")  # fmt: skip
_ESSO, _SHARE = ("hull.*", "propeller.*", "rudder.*", "body.m_x", "body.m_y", "body.I_zG"), 0.3
# Horizons of forecasts [s]; those beyond the first begin at every second start.
_HORIZONS, _SMOOTH = (30.0, 60.0, 120.0, 300.0, 600.0), 5.0
# Steps of a forecast are so many times those of the filter, as those of a live twin; quantile of bands of 90 %.
_LONGER, _QUANTILE = 4.0, 1.6449
# Seconds over which missing surge is averaged where something else has pushed the model, as in the fits of this set.
_PUSHED = 3.0


def esso() -> dict[str, Any]:
    """Forecasts on the random trials of the Esso Osaka, one trial after the other, beside the plain model.

    What has been learnt is carried on by the shares, and with the width, that forecasts which have turned out by then
    show (`ahead.lasting`), those of earlier trials among them.

    The plain model starts from the readings of the last five seconds (`replay.smoothed_starts`); both know controls.
    Settings are those that `seatrial twin` finds on the first trial.  Forecasts are judged with and without those that
    run through seconds in which the model was caught or towed (`undisturbed`), which no model foresees.
    """
    ship, folder = load("esso_osaka_3m"), Path(os.environ["SEATRIAL_DATA"]) / "esso_osaka_frt" / "data" / "random"
    trials = [frt_esso.read(path) for path in sorted(folder.glob("*.csv"))]
    known = [name for name, value in values(ship.model).items() if value and name not in _FIXED]
    drift = [f"{name}={_SHARE}" for name in known if any(fnmatchcase(name, one) for one in _ESSO)]
    settings = usual(ship, channels_of(trials[0], ship.model.controls), noise=noise_of(trials[0]), free=drift)
    settings, factors = likeliest(ship, settings, rows_of(trials[0]))
    machine = made(ship, settings)
    free = undisturbed(ship, trials, _PUSHED)
    carried: Follower | None = None
    scores = {horizon: Score() for horizon in _HORIZONS}
    each: dict[str, Any] = {}
    whole = list[_Error]()
    for trial in trials:
        parts = [part for part in free if part.name == trial.name or part.name.startswith(f"{trial.name}_")]
        carried, found = _forecasts(machine, trial, carried, [(part.t[0], part.t[-1]) for part in parts], scores)
        whole += found
        each[trial.name] = _rms_of([one for one in found if one.horizon == _HORIZONS[0]])
        print(trial.name, each[trial.name], flush=True)
    ahead = {f"{horizon:g} s": {"all": _rms_of(some), "undisturbed": _rms_of([one for one in some if one.free])}
             for horizon in _HORIZONS if (some := [one for one in whole if one.horizon == horizon])}  # fmt: skip
    return {"drifting parameters": len(settings.free), "factors": factors._asdict(), "ahead": ahead, "each": each}


class _Error(NamedTuple):
    """Errors of a forecast at its end [m]; how many of x and y are in their bands; whether nothing else pushed."""

    horizon: float
    twin: float
    plain: float
    held: int
    free: bool


def _rms_of(errors: list[_Error]) -> dict[str, Any]:
    twin, plain = _rms([one.twin for one in errors]), _rms([one.plain for one in errors])
    middle = [float(np.median([getattr(one, name) for one in errors])) for name in ("twin", "plain")]
    return {"forecasts": len(errors), "twin, rms [m]": twin, "plain, rms [m]": plain, "ratio": twin / plain,
            "medians [m]": middle, "bands of 90 % hold": sum(one.held for one in errors) / max(2 * len(errors), 1),
            }  # fmt: skip


def _forecasts(
    machine: Machine, trial: Any, carried: Follower | None, free: list[tuple[float, float]], scores: dict[float, Score]
) -> tuple[Follower, list[_Error]]:
    """The twin at the end of a trial, and errors of each forecast."""
    ship, own = machine.ship, machine.traced.own
    series, read = inputs(trial, ship.model), np.column_stack([trial[name] for name in machine.channels])
    measured = trial.stack(*STATES)
    measured[:, 2] = unwrapped(measured[:, 2])
    first = int(np.argmax(np.isfinite(read).all(axis=1)))
    further = None if carried is None else (carried.mean[own:], carried.cov[own:, own:])
    follower = begun(machine, float(trial.t[first]), read[first], further)
    starts = [int(np.searchsorted(trial.t, at)) for at in np.arange(trial.t[first] + 60.0, trial.t[-1] - 31.0, 15.0)]
    starts = [k for k in starts if np.isfinite(measured[k]).all()]
    smooth = dict(zip(starts, smoothed_starts(trial.t, measured, starts, _SMOOTH), strict=True))
    found, last = list[_Error](), first
    known = values(ship.model)
    plain = np.array([known.get(name, 0.0) for name in machine.names])
    waiting: list[_Turned] = []
    for k in range(first + 1, len(trial)):
        if (k - first) % 2 and k not in smooth:
            continue
        follower, _ = follower.row(float(trial.t[k]), series[last:k].mean(axis=0), read[k])
        last = k
        if k in smooth:
            plain[: len(STATES)] = smooth[k]
            longest = len(_HORIZONS) if starts.index(k) % 2 == 0 else 1
            for one in [one for one in waiting if one.span[1] <= trial.t[k]]:
                scores[one.horizon].note(*one.ways, one.missed, one.held, one.span)
                waiting.remove(one)
            some, turned = _judged(follower, plain, (trial.t, series, measured[:, :2]), k, free,
                                   {horizon: scores[horizon] for horizon in _HORIZONS}, longest)  # fmt: skip
            found += some
            waiting += turned
    for one in waiting:
        scores[one.horizon].note(*one.ways, one.missed, one.held, one.span)
    return follower, found


class _Turned(NamedTuple):
    """How a forecast turns out: what `Score.note` takes."""

    horizon: float
    ways: Any
    missed: Any
    held: float
    span: tuple[float, float]


def _judged(
    start: Follower, plain: Any, log: tuple[Any, Any, Any], k: int, free: list[tuple[float, float]],
    scores: dict[float, Score], longest: int,
) -> tuple[list[_Error], list[_Turned]]:  # fmt: skip
    """Forecasts from row `k` of a log (times, what acts, places), over the first `longest` horizons."""
    t, series, places = log
    machine, twin, model, now, found = start.machine, start, plain, k, list[_Error]()
    step, simple, turned = _LONGER * machine.settings.step, simpler(start), list[_Turned]()
    taken = lasting(scores, machine)
    for horizon in list(scores)[:longest]:
        end = int(np.searchsorted(t, t[k] + horizon))
        if end >= len(t):
            break
        while now < end:
            after = max(min(int(np.searchsorted(t, t[now] + step)), end), now + 1)
            acting, span = series[now:after].mean(axis=0), float(t[after] - t[now])
            twin, _ = twin.ahead(float(t[after]), acting, step)
            model, *simple = (machine.traced.onward(one, acting, span)[0] for one in (model, *simple))
            now = after
        bare, learnt = (one[:2] for one in simple)
        ways, missed = (learnt - bare, twin.mean[:2] - learnt), places[end] - bare
        first, second, width = taken[horizon]
        away = missed - first * ways[0] - second * ways[1]
        errors = [float(np.hypot(*one)) for one in (away, model[:2] - places[end])]
        if all(math.isfinite(one) for one in errors):
            spread = np.sqrt(np.diagonal(twin.cov)[:2] + machine.traced.model.noise[:2] ** 2)
            held = int((np.abs(away) <= _QUANTILE * width * spread).sum())
            turned.append(_Turned(horizon, ways, missed, 0.5 * held, (float(t[k]), float(t[end]))))
            found.append(_Error(horizon, *errors, held, any(a <= t[k] and t[end] <= b for a, b in free)))
    return found, turned


def adversaries() -> dict[str, Any]:
    """Half an hour of what a twin does not expect: it must neither crash nor blame a sensor that is right."""
    ship = coaster()
    usual_rows = [row for row, _ in Voyage(ship, 0.5).rows()]
    late = [{**read, **{n: usual_rows[max(k - 1, 0)][1][n] for n in ("x", "y", "v_north", "v_east")}}
            for k, (_, read) in enumerate(usual_rows)]  # fmt: skip
    heavy = ship.having({"body.m": 1.3 * float(ship.model.body.m)})
    pushed = Voyage(ship, 0.5, pull=3e-3)
    cases = {
        "mass 30 % too large": (heavy, usual_rows),
        "rudder of the wrong sign": (ship, [(t, {**r, "delta": -r["delta"], "delta_cmd": -r["delta_cmd"]})
                                            for t, r in usual_rows]),
        "gaps of 20 s each minute": (ship, [(t, r) for t, r in usual_rows if t % 60.0 < 40.0]),
        "compass alone for 5 min": (ship, [(t, {n: v for n, v in r.items() if n in ("psi", "n_P", "delta", "delta_cmd")}
                                            if 900.0 < t < 1200.0 else r) for t, r in usual_rows]),
        "steady side wind that is not logged": (ship, [row for row, _ in pushed.rows()]),
        "GNSS 1 s late": (ship, [(t, r) for (t, _), r in zip(usual_rows, late, strict=True)]),
        "clock jumps an hour ahead, then back": (ship, [
            (t + (3600.0 if 900.0 < t < 1200.0 else 0.0), r) for t, r in usual_rows]),
    }  # fmt: skip
    found: dict[str, Any] = {}
    for name, (model, rows) in cases.items():
        live = Live(model, usual(model, list(NOISE), noise=NOISE, free=("hull.R_0",)), ("delta", "delta_cmd"))
        for t, read in rows:
            live.feed(t, read)
        found[name] = {
            "finite": live.follower is not None and bool(np.isfinite(live.follower.cov).all()),
            "NIS per reading": [round(one.mean, 3) for one in live.tally.hours],
            "rows": vars(live.counts), "alarms": [f"{one.named:.0f} s: {one.text}" for one in live.alarms],
        }  # fmt: skip
        print(name, found[name], flush=True)
    return found


def main() -> None:
    """Run the parts that are named, all of them without a name, and keep the results of the others."""
    parts = {"cost": cost, "faults": faults, "adversaries": adversaries, "esso": esso, "day": day,
             "unmatched": unmatched}  # fmt: skip
    found = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    for name in sys.argv[1:] or parts:
        found[name] = parts[name]()
        print(name, json.dumps(found[name], indent=1), flush=True)
        RESULTS.write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
