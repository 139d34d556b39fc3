"""The engine against shipmmg, against our own equations on Python floats, and against scipy on those."""

from __future__ import annotations

import time
import warnings

from timing import best, publish

from seatrial.bench import shipmmg, turn
from seatrial.engine import floats
from seatrial.simulate.loop import open_loop


def put_in_at_each_call() -> float:
    """Time of one right-hand side of the slow path that reads as the equations do [s]."""
    _, p, held = turn.engine()
    system, start, numbers = open_loop(turn.ship()), tuple(turn.start().tolist()), tuple(p.tolist())
    steps = 500
    return best(lambda: floats.rollout(system, start, held[0], numbers, dt=0.1, steps=steps), 3.0, 3) / (
        4 * (steps - 1)
    )


def main() -> None:
    begun = time.perf_counter()
    warnings.simplefilter("ignore")
    per_call, theirs, bare = turn.per_call(), shipmmg.their_call(), turn.bare()
    slow, by_scipy, even = put_in_at_each_call(), turn.by_scipy(), shipmmg.even_turn()
    rows = [
        ("our engine, 1 thread, 128 ships", 1e9 * per_call, "ns per RHS and ship", "-"),
        ("shipmmg 0.0.11, its solver with steps of 0.1 s", 1e6 * theirs, "us per RHS", "-"),
        ("shipmmg over ours, per RHS and ship", theirs / per_call, "x", ">= 1000"),
        ("our model's derivative on Python floats, bare", 1e6 * bare, "us per RHS", "-"),
        ("bare floats over ours", bare / per_call, "x", ">= 100"),
        ("engine.floats (parameters put in at each call) over ours", slow / per_call, "x", "-"),
        ("scipy solve_ivp on our floats over ours, per RHS and ship", by_scipy / per_call, "x", "-"),
        ("track error of shipmmg at its default tolerance", even.error / turn.ship().L_pp, "L", "-"),
        ("our widest step with no larger error", even.dt, "s", "-"),
        ("shipmmg over ours at equal error, a whole turn", even.theirs / even.ours, "x", ">= 50"),
    ]
    publish("peers", [dict(zip(("what", "value", "unit", "bar"), r, strict=True)) for r in rows])
    print(f"{time.perf_counter() - begun:.0f} s in all")


if __name__ == "__main__":
    main()
