"""What the path ahead of the bridge costs: processor time of one path, and late ticks at 20 Hz with and without it.

    python benchmarks/path_ahead.py [-o results/path_ahead.json] [--seconds 30]

The ship is a model tanker with three uncertain coefficients, 200 draws.  Both loops run in turn for five seconds at a
time, so that a machine that works on something else disturbs both.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

TESTS = Path(__file__).parents[1] / "tests"
RATE, PART, PATHS = 20.0, 5.0, 20


def bridge(model: Path, bands: float | None) -> tuple[Any, Any, Any]:
    """Loop, deck and path of a fitted ship."""
    from seatrial.environment import Uniform
    from seatrial.realtime.bridge.deck import Deck, Outfit
    from seatrial.realtime.bridge.path import Ahead
    from seatrial.realtime.bridge.view import OWN
    from seatrial.realtime.loop import Loop
    from seatrial.realtime.plant import plant_of
    from seatrial.ships.files import load
    from seatrial.workflow.asked import Bands
    from seatrial.workflow.evidence.ahead import path_ahead

    ship = load(model)
    own = plant_of(ship, RATE, Uniform(), (0.0, 0.0, 0.0, ship.speed, 0.0, 0.0), 1)
    known = path_ahead(model, Bands(bands))
    loop, ahead = Loop({OWN: own}, RATE, 1.0), None if known is None else Ahead(own, known)
    return loop, Deck(loop, Outfit(folder=model.parent, ahead=ahead)), ahead


def cost(loop: Any, ahead: Any) -> float:
    """Processor time of one path [ms]."""
    state = next(iter(loop.vessels.values())).plant.snapshot()
    ahead.look(state)
    begun = time.process_time()
    for _ in range(PATHS):
        ahead.look(state)
    return 1e3 * (time.process_time() - begun) / PATHS


def main() -> None:
    """Measure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--out", type=Path)
    parser.add_argument("--seconds", type=float, default=30.0)
    given = parser.parse_args()
    sys.path.insert(0, str(TESTS))
    from fitted_run import saved, trial

    parts = round(given.seconds / PART)
    with tempfile.TemporaryDirectory() as folder:
        model = saved(Path(folder) / "run", [trial(35.0), trial(35.0, side=-1)], share=0.05)
        made = {"without": bridge(model, None), "with": bridge(model, 95.0)}
        found: dict[str, Any] = {"ms_a_path": round(cost(made["with"][0], made["with"][2]), 1)}
        used = dict.fromkeys(made, 0.0)
        for _ in range(parts):
            for name, (loop, _, _) in made.items():
                begun = time.process_time()
                loop.run(PART)
                used[name] += time.process_time() - begun
        for _, deck, _ in made.values():
            deck.close()
    found["ticks"] = round(RATE * PART * parts)
    found["late_ticks"] = {name: loop.report.overruns for name, (loop, _, _) in made.items()}
    found["share_of_a_core"] = {name: round(one / (PART * parts), 4) for name, one in used.items()}
    print(json.dumps(found, indent=1))
    if given.out:
        given.out.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
