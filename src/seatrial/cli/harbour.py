"""The command that runs a ship in a harbour."""

from __future__ import annotations

from . import options as o
from .render import emit
from .simulation import index_document, show_indices


def harbour(
    run: o.HarbourRun, ship: o.HarbourShip = None, chart: o.Chart = None, wind: o.Wind = None,
    speed: o.HarbourSpeed = None, duration: o.Duration = None, start: o.Start = None, out: o.TrialOut = None,
    json: o.Json = False,
) -> None:  # fmt: skip
    """Run a ship in a harbour: banks, tugs, contact."""
    from ..workflow.harbour import SHIP
    from ..workflow.harbour import harbour as ran_in

    ran = ran_in(run, ship or SHIP, chart, wind=wind, speed=speed, duration=duration, start=start, out=out)
    indices = {key: index_document(index) for key, index in ran.indices.items()}
    if json:
        emit(
            {"ship": ran.ship.name, "run": run, "chart": ran.chart.name, "time": ran.trial.duration, "indices": indices}
        )
    else:
        show_indices(f"{ran.ship.name}, {run}, {ran.chart.name}", indices)
