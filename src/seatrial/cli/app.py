"""The command line: one command per workflow, each a few lines over a function of `workflow`.

Results go to standard output (one JSON object with ``--json``), messages to standard error.
Exit status: 0 done, 1 the run failed, 2 the request was wrong.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

import typer

from . import choosing, data, judging, plant, realtime, ships, simulation
from . import options as o
from .command import Command, Group, WithManoeuvres, offered
from .outcome import ended
from .render import emit, note, say

if TYPE_CHECKING:
    from ..data import Trial

app = typer.Typer(
    name="seatrial", cls=Group, no_args_is_help=True, add_completion=False, rich_markup_mode=None,
    pretty_exceptions_enable=False, help="Build a ship manoeuvring model that you can trust from sea trial logs.",
)  # fmt: skip

def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; the exit status."""
    return ended(typer.main.get_command(app), sys.argv[1:] if arguments is None else arguments)


def check(
    trials: o.Trials, against: o.Against = None, out: o.CoveragePage = None, json: o.Json = False
) -> None:
    """Check trials: what is wrong, where and the remedy."""
    from .check import check as run

    run(trials, against or [], out, json)


def identify(
    study: o.StudyFile, out: o.RunFolder, quick: o.Quick = False, only: o.OnlyFits = None, page: o.FitPage = False,
    port: o.FitPort = None, json: o.Json = False,
) -> None:  # fmt: skip
    """Fit a ship to trials; write the model and a report."""
    from .page import port_of
    from .runs import identify as run

    run(study, out, json, quick, only or (), port_of(page, port))


def predict(
    model: o.ShipName, trials: o.Trials, out: o.PredictionFolder, restart: o.Restart = None,
    smooth_start: o.SmoothStart = None, json: o.Json = False,
) -> None:  # fmt: skip
    """Predict trials from their controls and initial states."""
    from ..data.trialfile import read_trials, write_trial
    from ..engine import SimulationError
    from ..simulate.replay import replay
    from .cautions import cautions, trained
    from .compared import in_found_currents
    from .spread import spread_numbers, tell_spread
    from .support import make_folder, positive, read_ship, separate

    positive(restart=restart, smooth_start=smooth_start)
    ship, measured = trained(read_ship(model), model), read_trials(trials)
    separate(out, trials)
    for line in cautions(ship, measured):
        note(line)
    predictions: list[Trial] = []
    for trial in in_found_currents(measured, model):
        try:
            predictions.append(replay(ship, trial, restart=restart, smooth_start=smooth_start))
        except SimulationError as error:  # the others go on
            note(f"error: {error}")
    make_folder(out)
    for prediction in predictions:
        write_trial(prediction, out / f"{prediction.name}.csv")
    written = [str(out / f"{one.name}.csv") for one in predictions]
    sure = tell_spread(model, ship, measured)
    if json:
        emit({"model": ship.name, "restart": restart, "written": written} | spread_numbers(sure))
    else:
        say("".join(f"{path}\n" for path in written))
    if len(written) < len(measured):
        raise typer.Exit(1)


def validate(
    model: o.ShipName, trials: o.Trials, out: o.Report = None, restart: o.Restart = None,
    smooth_start: o.SmoothStart = None, scale: o.Scale = None, json: o.Json = False,
) -> None:  # fmt: skip
    """Validate a model on trials beside two baselines."""
    from .runs import validate as run

    run(model, trials, out, restart, json, smooth_start, scale)


for _command in (
    simulation.demo, ships.ships, ships.show, simulation.simulate, choosing.models, ships.estimate, choosing.design,
    judging.requirements, judging.imo, plant.export, plant.thrust_map, plant.servo, data.resample, simulation.bench,
    data.import_, data.convert, check, identify, realtime.steer, realtime.bridge, predict, validate,
):  # fmt: skip
    _cls = WithManoeuvres if _command is simulation.simulate else Command
    app.command(_command.__name__.strip("_").replace("_", "-"), cls=_cls)(offered(_command))
