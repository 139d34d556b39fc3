"""The card of a twin: what it has learnt, how consistent it is, how its forecasts turned out, and its alarms."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from ...core.parameters import specs, values
from ...identify.filters.augmented import ANTENNA
from ...identify.nuisance import CURRENT
from ...report.blocks import bullets, entries, fields, lead, number, soft, table, tiles
from ...report.page import Page, Section
from .ahead import LEVEL
from .live import Live

_SHARE = 0.95


def parameters(live: Live) -> list[dict[str, Any]]:
    """What drifts: path, unit, value before and now, and its standard deviation."""
    if live.follower is None:
        return []
    before, meant = values(live.machine.ship.model), specs(live.machine.ship.model)
    out: list[dict[str, Any]] = []
    for path in live.machine.settings.free:
        value, sd = live.follower.value(path)
        unit = meant[path].unit
        out.append({"path": path, "unit": "" if unit in ("-", "'") else unit, "about": meant[path].about,
                    "before": float(before[path]), "value": value, "sd": sd})  # fmt: skip
    return out


def unseen(live: Live) -> list[dict[str, Any]]:
    """Current, slow forces, errors and places of instruments with their standard deviations."""
    if live.follower is None:
        return []
    told = {CURRENT[0]: ("current north", "m/s"), CURRENT[1]: ("current east", "m/s"),
            "slow.u": ("slow force, surge", "m/s²"), "slow.v_m": ("slow force, sway", "m/s²"),
            "slow.r": ("slow moment, yaw", "rad/s²"), "bias.r": ("error of the rate gyro", "rad/s"),
            ANTENNA[0]: ("antenna, forward of midship", "m"), ANTENNA[1]: ("antenna, to starboard", "m")}  # fmt: skip
    return [dict(zip(("name", "unit", "value", "sd"), (*told[name], *live.follower.value(name)), strict=True))
            for name in live.machine.names if name in told]  # fmt: skip


def page(live: Live, log: str) -> Page:
    """The whole card."""
    ship, inside = live.machine.ship, [one.inside(_SHARE) for one in live.tally.hours]
    t = 0.0 if live.follower is None else live.follower.t
    loud = [one for one in live.alarms if not one.of]
    state = f"{ship.name}: followed {log} to t = {t:.0f} s ({t / 3600.0:.1f} h)"
    consistent = f"{sum(inside)} of {len(inside)}"
    shown = tiles([(consistent, f"hours in which the innovations are within their {100 * _SHARE:.0f} % band"),
                   (str(len(loud)), "alarms"), (str(len(live.active)), "of them last")])  # fmt: skip
    found = parameters(live)
    rows = [(one["path"], one["unit"], number(one["before"], 4), number(one["value"], 4), number(one["sd"], 2),
             f"{100 * (one['value'] / one['before'] - 1):+.1f} %") for one in found]  # fmt: skip
    others = [(one["name"], one["unit"], number(one["value"], 3), number(one["sd"], 2)) for one in unseen(live)]
    ahead = [(f"{h:.0f} s", str(s.count), number(s.rms), number(s.rival),
              f"{100 * s.held:.0f} %" if s.count else "–") for h, s in live.trust.scores.items()]  # fmt: skip
    hours = [(f"{one.start / 3600.0:.0f}", number(one.mean, 4), "–".join(number(v, 4) for v in one.band(_SHARE)),
              str(one.readings), "yes" if ok else "no")
             for one, ok in zip(live.tally.hours, inside, strict=True)]  # fmt: skip
    judged = (
        "The controls in between are those of the log. Constant: the same course and speed. "
        f"Held: share of the fixes within bands of {100 * LEVEL:.0f} %."
    )
    about = {"schema": "seatrial-twin-card/1", "ship": ship.name, "log": log, "t": t}
    sections = (
        Section("", fields(about, lead(state) + shown)),
        Section("What it has learnt", fields(
            {"parameters": found, "unseen": unseen(live)},
            (table(("parameter", "unit", "before", "now", "sd", "change"), rows, words=(1,))
             if rows else soft("No parameter was allowed to drift (--free)."))
            + table(("unseen", "unit", "now", "sd"), others, words=(1,)))),
        Section("How its forecasts turned out", fields(
            {"forecasts": {str(h): {"count": s.count, "rms": s.rms, "constant": s.rival, "held": s.held}
                           for h, s in live.trust.scores.items()}},
            table(("ahead", "judged", "error, rms [m]", "constant [m]", "held"), ahead) + soft(judged))),
        Section("Alarms", fields(
            {"alarms": [alarm(one) for one in live.alarms]},
            bullets(one.line for one in loud) if loud else soft("None."))),
        Section("Consistency", fields(
            {"hours": [{"start": one.start, "nis": one.mean, "readings": one.readings, "inside": ok}
                       for one, ok in zip(live.tally.hours, inside, strict=True)]},
            table(("hour", "NIS per reading", "band", "readings", "within"), hours, words=(4,)))),
        Section("What it assumes", fields({"rows": vars(live.counts)}, entries(_assumed(live)))),
    )  # fmt: skip
    return Page(f"Twin of {ship.name}", sections)


def alarm(one: Any) -> Mapping[str, Any]:
    """An alarm as JSON has it."""
    return {"cause": one.cause, "text": one.text, "since": one.since, "named": one.named,
            "over": None if math.isinf(one.over) else one.over, "size": list(one.size), "unit": one.unit,
            "rivals": list(one.rivals), "advice": one.advice, "of": one.of, "explains": list(one.explains)}  # fmt: skip


def _assumed(live: Live) -> dict[str, str]:
    settings = live.machine.settings
    noise = zip(live.machine.channels, live.machine.traced.model.noise, strict=True)
    sea = live.swell.sea
    moved = {"wave.psi": ("yaw", "deg", 180.0 / math.pi), "wave.x": ("surge", "m", 1.0), "wave.y": ("sway", "m", 1.0)}
    told = [f"{name} {number(factor * sea.size[of], 2)} {unit}" for of, (name, unit, factor) in moved.items()
            if of in sea.size]  # fmt: skip
    waves = {"waves": f"{', '.join(told)} rms, at about {number(sea.period, 2)} s"} if told else {}
    return {"estimator": settings.estimator, **waves,
            "noise of the readings": ", ".join(f"{c} {number(v)}" for c, v in noise),
            "false alarms a day": f"{settings.false_alarms:g} by its limits, if the model is right",
            "rows late or before the first fix": f"{live.counts.late}, {live.counts.waiting}"}  # fmt: skip
