"""Damaged requests to the links of a range: no crash, no missed step, and refusals as the only errors.

Requests of rosbridge, of the autopilot interface and the subscriptions of Signal K, of the page's panel, and sentences
that acknowledge alarms, damaged in every way, go to a running stage.

    python benchmarks/fuzz_links.py [NUMBER]
"""

from __future__ import annotations

import json
import math
import random
import sys
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT / "tests" / "realtime"), str(ROOT / "tests")]

import mutations  # noqa: E402

from scenes import FERRY, Fault, Limits, on_wire, scene  # noqa: E402
from seatrial.core.errors import RefusalError  # noqa: E402
from seatrial.realtime.links.rosbridge import Rosbridge  # noqa: E402
from seatrial.realtime.links.signalk import SignalK, _Wanted  # noqa: E402
from seatrial.realtime.range.panel import Panel  # noqa: E402

FULL = 1_000_000
PER_STEP = 50
ODD: list[Any] = [None, True, -1, 0, 1e308, -1e308, math.nan, math.inf, 10**400, "", "x" * 5000, "\x00",
                  "/odom", [], {}, [[]], {"data": 1}, {"data": "1"}, {"data": None}, {"path": "*"}, [{"path": "*"}],
                  [{"path": 1}], [1, 2], "deg"]  # fmt: skip
GOOD: list[dict[str, Any]] = [
    {"op": "subscribe", "topic": "/odom", "throttle_rate": 100}, {"op": "unsubscribe", "topic": "/odom"},
    {"op": "publish", "topic": "/cmd/delta", "msg": {"data": 0.1}},
    {"op": "publish", "topic": "/cmd/psi", "msg": {"data": 1}},
    {"op": "publish", "topic": "/cmd/n_P", "msg": {"data": 1.5}},
    {"op": "call_service", "service": "/rosapi/topics", "id": "1"},
    {"value": 0.5, "units": "rad"}, {"value": "auto"}, {"value": "standby"},
    {"context": "*", "subscribe": [{"path": "navigation.*"}]},
    {"context": "vessels.self", "unsubscribe": [{"path": "*"}]},
    {"do": "hand", "to": "wire"}, {"do": "fault", "number": 0, "on": True},
    {"do": "acknowledge", "identifier": 10001, "instance": 1},
]  # fmt: skip
NAMES = ("op", "topic", "msg", "value", "units", "subscribe", "to", "on", "number")
WHATS = ("state", "mode", "target", "target/adjust", "engage", "disengage", "tack/port", "", "../state")


def damaged(rng: random.Random) -> dict[str, Any]:
    """A request with some of its values, or names, exchanged."""
    found = json.loads(json.dumps(rng.choice(GOOD)))
    for _ in range(rng.randint(0, 3)):
        if found and rng.random() < 0.7:
            found[rng.choice(list(found))] = rng.choice(ODD)
        else:
            found[rng.choice(NAMES)] = rng.choice(ODD)
    return found


def run(number: int) -> dict[str, object]:
    stage, wire = on_wire(scene(FERRY, name="kvlcc2", faults=(Fault("jammed", "delta"),), limits=Limits(cpa=5000.0)),
                          page=True)  # fmt: skip
    stage.loop.run(2.0)
    ros, signalk, panel, wanted = Rosbridge(stage), SignalK(stage), Panel(stage), _Wanted("self")
    topics: dict[str, float] = {}
    rng, outcomes, begin, first = random.Random(20261123), Counter[str](), time.perf_counter(), stage.loop.k
    sentences = mutations.datagrams(number, seed=7)
    to: tuple[Callable[[dict[str, Any]], object], ...] = (
        lambda said: ros.obey(said, topics),
        lambda said: signalk._obey(rng.choice(("PUT", "POST")), rng.choice(WHATS), said),
        wanted.change, lambda said: panel.doing[rng.choice(("hand", "fault", "acknowledge"))](said),
    )  # fmt: skip
    for k in range(number):
        try:
            rng.choice(to)(damaged(rng))
            outcomes["taken"] += 1
        except RefusalError:
            outcomes["refused"] += 1
        wire.waiting.append(next(sentences))
        if k % PER_STEP == PER_STEP - 1:
            stage.loop.step()
            wire.out.clear()
            for topic in topics:
                json.dumps(ros.message(topic), allow_nan=False)
            json.dumps([panel.frame(), panel.hello()], allow_nan=False)
    plant = stage.loop.vessels["own"].plant
    return {
        "requests": number, "seconds": round(time.perf_counter() - begin, 1), "outcomes": dict(outcomes),
        "missed_steps": number // PER_STEP - (stage.loop.k - first), "finite": math.isfinite(plant["x"] + plant["r"]),
        "dropped": stage.loop.report.events.get("dropped", 0), "failed": stage.loop.vessels["own"].failure,
        "acknowledgements_refused": stage.reports.refused, "topics": len(topics),
        "orders": dict(stage.on_wire.conning.counts),
    }  # fmt: skip


if __name__ == "__main__":
    number = int(sys.argv[1]) if len(sys.argv) > 1 else FULL
    found = run(number)
    if number == FULL:
        (ROOT / "benchmarks" / "results" / "fuzz_links.json").write_text(json.dumps(found, indent=2) + "\n")
    print(json.dumps(found, indent=2))
