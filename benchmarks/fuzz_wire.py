"""A million damaged datagrams against a ship on the wire: no crash, no missed step, no effect but by valid sentences.

Every datagram goes through the sieve and to the steering of a running ship; whatever changes its orders or its steering
control must have a sentence behind it that pynmeagps, which is more lenient, takes as well.

    python benchmarks/fuzz_wire.py [NUMBER]
"""

from __future__ import annotations

import json
import math
import sys
import time
from collections import Counter
from pathlib import Path

import pynmeagps

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests" / "realtime"))

import mutations  # noqa: E402

from seatrial.data.nmea.framing import TOKEN  # noqa: E402
from seatrial.data.nmea.ship import Fittings  # noqa: E402
from seatrial.realtime.conning import Conning  # noqa: E402
from seatrial.realtime.on_wire import fitted  # noqa: E402
from seatrial.realtime.plant import Plant  # noqa: E402
from seatrial.realtime.wire import Intake  # noqa: E402
from seatrial.ships.files import load  # noqa: E402

FULL = 1_000_000
PER_STEP = 20  # datagrams between two steps of the ship


def valid(data: bytes) -> bool:
    for line in data.removeprefix(TOKEN).splitlines():
        try:
            if pynmeagps.NMEAReader.parse(line[line.rfind(b"\\") + 1 :]) is not None:
                return True
        except (pynmeagps.NMEAParseError, pynmeagps.NMEAMessageError, pynmeagps.NMEATypeError):
            continue
    return False


def settings(con: Conning) -> tuple:
    control = con.control
    return con.mode, con.commander, con.counts["taken"], control.course, control.across, control.rate


def run(number: int) -> dict[str, object]:
    ship = load("kvlcc2_l7")
    plant = Plant.of(ship, dt=0.1)
    con, intake = Conning(ship, fitted(ship, Fittings())), Intake(rate=1e9)
    wrong, effects, kinds = 0, 0, Counter()
    start = time.perf_counter()
    for k, data in enumerate(mutations.datagrams(number, seed=20261121)):
        before, orders = settings(con), {}
        for sentence in intake.take(data, "fuzz", 0.1 * k):
            kinds[sentence.kind] += 1
            orders |= con.take(sentence, "fuzz", plant.t)
        if orders or settings(con) != before:
            effects += 1
            wrong += not valid(data)
        for control, value in orders.items():
            plant.order(control, value)
        if k % PER_STEP == PER_STEP - 1:
            for control, value in con.steered(plant["psi"], plant["r"], plant.t, 0.1).items():
                plant.order(control, value)
            plant.step()
    return {
        "datagrams": number, "seconds": round(time.perf_counter() - start, 1), "steps": plant.k,
        "missed_steps": number // PER_STEP - plant.k, "finite": math.isfinite(plant["x"] + plant["r"]),
        "effects": effects, "effects_without_a_valid_sentence": wrong, "sieve": dict(intake.counts),
        "sentences": dict(kinds), "orders": dict(con.counts),
    }  # fmt: skip


if __name__ == "__main__":
    number = int(sys.argv[1]) if len(sys.argv) > 1 else FULL
    found = run(number)
    if number == FULL:
        (ROOT / "benchmarks" / "results" / "fuzz_wire.json").write_text(json.dumps(found, indent=2) + "\n")
    print(json.dumps(found, indent=2))
