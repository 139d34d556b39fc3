"""The table: what the twin says of each planted fault, and its false alarms.

`python -m twin_faults.run [SHIP ...] [--kinds NAME ...] [--seeds N ...] [--weather calm|wind|waves] [--quiet HOURS]
[--json FILE]`, from tests/.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from seatrial.realtime.twin.faults.alarms import Alarm
from seatrial.realtime.twin.live import Live
from seatrial.realtime.twin.settings import usual

from .kinds import KINDS, Kind
from .passage import Passage, Weather
from .vessels import VESSELS, Vessel

# What is named so long after the first alarm is another matter [s].
_SETTLED = 120.0

_FORK = multiprocessing.get_context("fork")


@dataclass(frozen=True)
class Outcome:
    """What was said of one fault.

    Attributes:
        ship, kind, seed: which.
        verdict: right; right with more than one cause; late; wrong, or wrong with the right one told as not to be told
            from it (rival); silent; false where an alarm came before the fault.
        said: alarms from the onset on: seconds after it, cause and rivals.
    """

    ship: str
    kind: str
    seed: int
    verdict: str
    said: tuple[str, ...]


def twin(vessel: Vessel, channels: tuple[str, ...]) -> Live:
    """A twin as `seatrial twin` makes it for a wire."""
    noise = {**vessel.noise, "y": vessel.noise["x"], "v_east": vessel.noise["v_north"]}
    return Live(vessel.known, usual(vessel.known, channels, noise=noise), channels)


def planted(vessel: Vessel, kinds: Sequence[Kind], seed: int, weather: Weather) -> Iterator[Outcome]:
    """Plant each fault just before a change of course, which most need to show; the log until then is followed once."""
    early = 6.0 * float(np.random.default_rng([seed, 17]).uniform())
    change = Passage(vessel, 0.0, seed=seed).change(max(120.0, 10.0 * vessel.own) + 6.0 * vessel.own)
    at = vessel.dt * round((change - early) / vessel.dt)
    before = [row for row in Passage(vessel, at + vessel.dt, weather, seed=seed).rows() if row[0] < at]
    for ordered in (True, False):
        some = [kind for kind in kinds if kind.ordered == ordered]
        if not some:
            continue
        names = tuple(name for name in before[-1][1] if ordered or not name.endswith("_cmd"))
        live = twin(vessel, names)
        for t, read in before:
            live.feed(t, {name: read[name] for name in names})
        for kind in some:
            yield _forked(partial(_outcome, live, vessel, kind, seed, weather, at))


def _forked(work: Callable[[], Outcome]) -> Outcome:
    """The outcome of work that is done in a copy of this process, so that the twin here stays as it is."""
    queue = _FORK.SimpleQueue()
    child = _FORK.Process(target=lambda: queue.put(work()))
    child.start()
    found = queue.get()
    child.join()
    return found


def _outcome(live: Live, vessel: Vessel, kind: Kind, seed: int, weather: Weather, at: float) -> Outcome:
    random = np.random.default_rng([seed, 17, *kind.name.encode()])
    size = float(random.uniform(0.8, 1.6)) * (float(random.choice([-1.0, 1.0])) if kind.signed else 1.0)
    fault = kind.fault(vessel, size, at)
    early = len(live.alarms)
    for t, read in Passage(vessel, at + kind.within + 60.0, weather, fault, seed).rows():
        if len(live.alarms) > early and t > live.alarms[early].named + _SETTLED:
            break
        if t >= at:
            live.feed(t, read if kind.ordered else {n: v for n, v in read.items() if not n.endswith("_cmd")})
    controls = vessel.real.controls
    places = {stem: next(name for name in controls if name.startswith(part))
              for stem, part in (("rudder", "delta"), ("shaft", "n"))}  # fmt: skip
    right = tuple(one.format(**places) for one in kind.right)
    said = causes(live)[early:]
    if early:
        verdict = "false"
    elif not said:
        verdict = "silent"
    elif not said[0].cause.startswith(right):
        verdict = "rival" if any(one.startswith(right) for one in said[0].rivals) else "wrong"
    elif any(not one.cause.startswith(right) for one in said[1:]):
        verdict = "more"
    else:
        verdict = "right" if said[0].named - at <= kind.within else "late"
    text = tuple(f"{one.named - at:.0f} s {'(' if one.of else ''}{one.cause}{')' if one.of else ''}"
                 f"{' | ' + ', '.join(one.rivals) if one.rivals else ''}" for one in live.alarms)  # fmt: skip
    return Outcome(vessel.real.name, kind.name, seed, verdict, text)


def causes(live: Live) -> list[Alarm]:
    """The alarms that a watch is told as such."""
    return [one for one in live.alarms if not one.of]


def quiet(vessel: Vessel, hours: float) -> dict[str, list[str]]:
    """Alarms without a fault, by weather."""
    found = dict[str, list[str]]()
    for name, weather in weathers(vessel).items():
        rows = Passage(vessel, 3600.0 * hours, weather, seed=5, turns=20.0).rows()
        live = twin(vessel, tuple(rows[0][1]))
        for t, read in rows:
            live.feed(t, read)
        found[name] = [f"{one.named:.0f} s {one.cause}" for one in live.alarms]
    return found


def weathers(vessel: Vessel) -> dict[str, Weather]:
    """Calm with a current, wind that is logged, waves."""
    U = vessel.real.speed
    calm = Weather(current=(0.04 * U, -0.03 * U), force=0.3)
    windy = replace(calm, wind=U)
    return {"calm": calm, "wind": windy, "waves": replace(windy, waves=1.0)}


def say(text: str) -> None:
    """One line, at once."""
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


def main(given: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("ships", nargs="*", default=list(VESSELS))
    parser.add_argument("--kinds", nargs="*", default=list(KINDS))
    parser.add_argument("--seeds", type=int, nargs="*", default=[1])
    parser.add_argument("--weather", default="calm")
    parser.add_argument("--quiet", type=float, default=0.0)
    parser.add_argument("--json", type=Path)
    asked = parser.parse_args(given)
    every: list[Outcome] = []
    for ship in asked.ships:
        vessel = VESSELS[ship]
        for seed in asked.seeds:
            for one in planted(vessel, [KINDS[name] for name in asked.kinds], seed, weathers(vessel)[asked.weather]):
                every.append(one)
                say(f"{ship:14} {one.kind:24} {one.verdict:7} {'; '.join(one.said)}")
        if asked.quiet:
            for name, alarms in quiet(vessel, asked.quiet).items():
                say(f"{ship:14} no fault, {name}: {len(alarms)} in {asked.quiet:g} h: {alarms}")
    for ship in asked.ships:
        count = Counter(one.verdict for one in every if one.ship == ship)
        total = sum(count.values())
        if total:
            say(f"{ship}: " + ", ".join(f"{name} {n} ({100.0 * n / total:.0f} %)" for name, n in count.items()))
    if asked.json:
        table = {"verdicts": dict(Counter(one.verdict for one in every)), "each": [asdict(one) for one in every]}
        asked.json.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
