"""The live twin against its bars: a day of sailing, planted faults, forecasts on the Esso Osaka, and its cost.

`python benchmarks/live_twin.py [day] [faults] [esso] [cost]` writes results/live_twin.json.
"""

from __future__ import annotations

import json
import math
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests" / "realtime"))

from voyages import KINDS, NOISE, Voyage, coaster, drifting

from seatrial.identify.nuisance import CURRENT
from seatrial.realtime.twin.live import Live
from seatrial.realtime.twin.settings import usual

RESULTS = ROOT / "benchmarks" / "results" / "live_twin.json"
_DAY = 24.0
# Planted just before and during a change of course, which comes every 600 s.
_AT = (2399.0, 2410.0)


def day(hours: float = _DAY) -> dict[str, Any]:
    """A day with drifting resistance, turning current and a biased gyro: consistency, errors, false alarms."""
    voyage = drifting(hours)
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
        "current, error [m/s]": {"rms": _rms(away), "99 %": float(np.quantile(away, 0.99)), "largest": float(away.max())},
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
    voyage = Voyage(coaster(), 0.05, dt=0.1)
    live = Live(voyage.ship, usual(voyage.ship, list(NOISE), noise=NOISE, free=free), ("delta", "delta_cmd"))
    rows = [row for row, _ in voyage.rows()]
    begun = time.process_time()
    for t, read in rows:
        live.feed(t, read)
    each = (time.process_time() - begun) / len(rows)
    return {"rows": len(rows), "states": len(live.machine.names), "ms a row": 1e3 * each,
            "share of a core at 10 Hz": 10.0 * each}  # fmt: skip


def main() -> None:
    """Run the parts that are named, all of them without a name, and keep the results of the others."""
    parts = {"day": day, "faults": faults, "cost": cost}
    found = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    for name in sys.argv[1:] or parts:
        found[name] = parts[name]()
        print(name, json.dumps(found[name], indent=1), flush=True)
        RESULTS.write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
