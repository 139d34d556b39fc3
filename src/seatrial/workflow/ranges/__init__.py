"""`seatrial range`: a scenario without a page, with its own pilot or with an autopilot on the wire, and its indices."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...core.errors import RunError
from ...core.parameters import unknown
from ...data import DataError
from ...realtime.bridge.view import OWN
from ...realtime.loop import LoopError
from ...realtime.on_wire import RATES, TRANSPONDER, TRANSPONDER_RATE
from ...realtime.range.judge import Judged
from ...realtime.range.lockstep import Lockstep
from ...realtime.range.reports import REPORTED
from ...realtime.range.scenario import Scenario
from ...realtime.range.stage import Line, Stage
from ...realtime.recording import Recording
from ...realtime.wire import Authority, WireError
from ...realtime.wire import Line as Port
from .. import RequestError
from ..request import DEGREE, Note, obeyed, positive, silent
from ..steer import gone, maybe, rates_of, reporter, running_beside, tell_places, where, writing
from .reading import read_scenario


@dataclass(frozen=True)
class Ranged:
    """A scenario that has been played.

    Attributes:
        stage: in its final state.
        judged: the criteria.
        written: recorded trial files.
        failure: why the run ended early; None if it did not.
    """

    stage: Stage
    judged: tuple[Judged, ...]
    written: tuple[Path, ...]
    failure: str | None

    @property
    def met(self) -> bool:
        """Whether the run reached its end and every criterion is met."""
        return self.failure is None and all(one.met for one in self.judged)

    def document(self) -> dict[str, Any]:
        """Indices and criteria; metres, seconds and degrees."""
        stage, scenario, loop = self.stage, self.stage.scenario, self.stage.loop
        passed = {
            name: {"distance": one.distance, "at": one.t, "touched": one.touched, "time_in_hand": one.in_hand}
            for name, one in stage.contacts.passed.items()
        }  # fmt: skip
        error = stage.judge.heading_error
        return {
            "scenario": scenario.title, "ship": scenario.own.ship.name, "time": loop.t, "arrived": stage.judge.arrived,
            "steered_by": stage.handover.holder, "met": self.met, "failure": self.failure,
            "indices": {
                "passing": passed, "cross_track_max": stage.judge.cross_track,
                "cross_track_rms": stage.judge.cross_track_rms,
                "heading_error_max": None if error is None else error / DEGREE,
                "under_keel": stage.judge.under_keel if math.isfinite(stage.judge.under_keel) else None,
            },
            "criteria": [_criterion(one) for one in self.judged],
            "events": stage.told(), "state": stage.digest, "written": self.written,
            "wire": None if stage.on_wire is None else
            {"orders": dict(stage.on_wire.conning.counts), "counts": dict(stage.on_wire.wire.counts)},
        }  # fmt: skip


def _criterion(one: Judged) -> dict[str, Any]:
    angle = one.unit == "rad"
    scale, unit = (1.0 / DEGREE, "deg") if angle else (1.0, one.unit)
    value = None if one.value is None or not math.isfinite(one.value) else one.value * scale
    return {"name": one.name, "ship": one.where or None, "value": value, "limit": one.limit * scale, "unit": unit,
            "met": one.met}  # fmt: skip


def play(
    scenario: str | Path | Scenario, nmea: str | None = None, *, to: Sequence[str] = (), anywhere: bool = False,
    framed: bool = False, only: str | None = None, factor: float | None = None, lock_step: bool = False,
    answer_to: str = "ZDA", patience: float = 20.0, hold: float = 10.0, commander: Sequence[str] = (),
    duration: float | None = None, log: Path | None = None, out: Path | None = None, beside: str | None = None,
    simulator: bool = False, note: Note = silent, printed: Note = silent,
) -> Ranged:  # fmt: skip
    """Play a scenario to its end: the last waypoint abeam, or its duration over.

    Args:
        scenario: its file, or a scenario.
        nmea: address of the wire on which an autopilot steers; None: the own ship's track pilot does.
        factor: simulated over clock time; by default as fast as possible without a wire or in lock step, else 1.
        note: takes events.
        printed: takes the standard output of the program beside the ship.

    The others are the options of `seatrial range`, whose help has their meaning and units.

    Raises:
        RequestError: a request that cannot be carried out.
        RunError: no autopilot on the wire, or the program beside the ship failed.
    """
    positive(duration=duration, patience=patience, hold=hold)
    played = scenario if isinstance(scenario, Scenario) else read_scenario(Path(scenario))
    if nmea is None and (lock_step or beside is not None or log is not None or to or only is not None):
        raise RequestError("--lock-step, --beside, --log, --to and --only are of a wire; give --nmea udp://127.0.0.1:0")
    own, reports = split(only)
    if answer_to not in RATES:
        raise RequestError(f"--answer-to: {unknown(answer_to, RATES, 'sentence')}")
    authority = Authority.of(tuple(commander))
    try:
        with maybe(nmea, to, anywhere) as wire, writing(log) as file:
            line = None if wire is None else Line(wire, framed, own, reports, hold, authority, simulator, file)
            stage = Stage(played, (math.inf if wire is None or lock_step else 1.0) if factor is None else factor, line)
            tell_places(log, stage.loop.vessels[OWN])
            record = None if out is None else stage.record(out)
            step = Lockstep(stage.loop, stage.on_wire, answer_to, patience) if lock_step and stage.on_wire else None
            _run(stage, step, duration, beside, wire, note, printed)
            if record is not None:
                with suppress(DataError):  # why the last row was not written is in its failure
                    record.close()
    except (WireError, LoopError) as error:
        raise RequestError(str(error)) from None
    failure = _failure(stage, record, step, wire)
    return Ranged(stage, stage.judge.judged(stage.contacts), tuple(record.paths) if record else (), failure)


def split(only: str | None) -> tuple[dict[str, float] | None, tuple[str, ...]]:
    """Rates of the own ship's sentences and the others that are sent, from the option --only."""
    if only is None:
        return None, REPORTED
    names = [name.strip().upper() for name in only.split(",")]
    reports = tuple(name for name in names if name in REPORTED)
    own = [name for name in names if name not in REPORTED]
    known = {**RATES, TRANSPONDER: TRANSPONDER_RATE}
    return rates_of(",".join(own), (*known, *REPORTED)) if own else {}, reports


def _run(
    stage: Stage, step: Lockstep | None, duration: float | None, command: str | None, wire: Port | None, note: Note,
    printed: Note,
) -> None:  # fmt: skip
    stage.loop.after(reporter(note))
    note(f"{stage.scenario.title}{'' if wire is None else f' on {wire.address}'}")
    with running_beside(command, where(wire), printed) as process:
        if process is not None and step is not None:
            step.alive = lambda: process.poll() is None
        try:
            if step is not None:
                step.meet()
            stage.run(duration)
        except KeyboardInterrupt:
            obeyed()
            note("ended")
        failed = process is not None and process.poll()
    if failed:
        raise RunError(f"the program of --beside failed, exit status {failed}")


def _failure(stage: Stage, record: Recording | None, step: Lockstep | None, wire: Port | None) -> str | None:
    vessel = stage.loop.vessels[OWN]
    if vessel.failure is not None:
        return f"the simulation of {vessel.plant.ship.name} failed: {vessel.failure}"
    if (lost := gone(wire)) is not None:
        return lost
    if step is not None and step.failure:
        return step.failure
    return f"the recording is not whole: {record.failure}" if record is not None and record.failure else None
