"""The command range: scenarios without a page, for tests of an autopilot."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import typer

from . import options as o
from .render import emit, figure, hand_on, note, say_lines, show_table

if TYPE_CHECKING:
    from ..workflow.ranges import Ranged


def range_(
    scenario: o.ScenarioPath, nmea: o.RangeNmea = None, to: o.To = None, anywhere: o.Anywhere = False,
    framed: o.Framed = False, only: o.Sentences = None, factor: o.RangeFactor = None, lock_step: o.LockStep = False,
    answer_to: o.AnswerTo = "ZDA", patience: o.Patience = 20.0, hold: o.Hold = 10.0, commander: o.Commander = None,
    duration: o.End = None, log: o.SentenceLog = None, out: o.Record = None, beside: o.Beside = None,
    simulator: o.Simulator = False, json: o.Json = False,
) -> None:  # fmt: skip
    """Run a scenario without a page and judge its criteria."""
    from ..workflow.ranges import play

    ran = play(scenario, nmea, to=to or (), anywhere=anywhere, framed=framed, only=only, factor=factor,
               lock_step=lock_step, answer_to=answer_to, patience=patience, hold=hold, commander=commander or (),
               duration=duration, log=log, out=out, beside=beside, simulator=simulator, note=note,
               printed=lambda text: hand_on(text, aside=json))  # fmt: skip
    document = ran.document()
    if json:
        emit(document)
    else:
        _show(ran, document)
    if not ran.met:
        missed = [f"{one.name}{f' of {one.where}' if one.where else ''}" for one in ran.judged if not one.met]
        note(f"error: {ran.failure or 'not met: ' + ', '.join(missed)}")
        raise typer.Exit(1)


def _show(ran: Ranged, document: dict[str, Any]) -> None:
    indices = document["indices"]
    rows = [(name, figure(one["distance"], 5), figure(one["at"], 5), figure(one["time_in_hand"], 4))
            for name, one in indices["passing"].items()]  # fmt: skip
    if rows:
        show_table(("ship", "passes at m", "after s", "time in hand s"), rows, right=(1, 2, 3))
    rows = [(one["name"].replace("_", " "), one["ship"] or "", figure(one["value"], 5), figure(one["limit"], 5),
             one["unit"], "met" if one["met"] else "not met") for one in document["criteria"]]  # fmt: skip
    if rows:
        show_table(("criterion", "of", "value", "limit", "unit", ""), rows, right=(2, 3))
    arrived = document["arrived"]
    end = f"arrived after {arrived:.1f} s" if arrived is not None else f"ended after {document['time']:.1f} s"
    say_lines(f"{ran.stage.scenario.title}: {end}, at most {indices['cross_track_max']:.1f} m off the route",
              *ran.written)  # fmt: skip
