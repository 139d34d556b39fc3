"""Commands that follow a ship while it sails."""

from __future__ import annotations

import math

from . import options as o
from .fits import show
from .render import note


def twin(
    model: o.ShipName, nmea: o.NmeaLog = None, mcap: o.McapLog = None, trial: o.TrialLog = None,
    mapping: o.Mapping = None, out: o.TwinFolder = None, free: o.Drifting = None, estimator: o.Estimator = "ekf",
    rate: o.RowRate = 10.0, factor: o.LogFactor = math.inf, page: o.TwinPage = False, port: o.TwinPort = 8022,
    json: o.Json = False,
) -> None:  # fmt: skip
    """Run a twin on the log of a ship; name faults."""
    from ..workflow.live.twin import twin as run
    from ..workflow.realtime import HERE, address, listen

    listening = listen(HERE, port, anywhere=False) if page else None
    try:
        if listening is not None:
            note(f"page: {address(listening)}")
        show(run(model, nmea=nmea, mcap=mcap, trial=trial, mapping=mapping, out=out, free=free or (),
                 estimator=estimator, rate=rate, factor=factor, page=listening, note=note), json)  # fmt: skip
    finally:
        if listening is not None:
            listening.close()
