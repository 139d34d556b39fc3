"""Commands about what a model is worth: its bands, those of a manoeuvre (of simulate), its card, the yardstick."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ..core.errors import RequestError
from ..report.blocks import Body, bullets, fields, table
from ..workflow.asked import Cluster, Shares
from . import options as o
from .fits import Terminal, end, show
from .render import figure

if TYPE_CHECKING:
    from ..manoeuvres import Index
    from ..workflow.evidence.bands import Banded

_DEGREES = math.degrees(1.0)


def card(
    model: o.FittedModel, out: o.Report = None, trials: o.Unseen = (), restart: o.Windows = None,
    json: bool = False,
) -> None:  # fmt: skip
    """Write the card of a fitted model: validity, errors, uses."""
    from ..workflow.evidence.card import card as run

    show(run(model, out=out, trials=trials, restart=restart, sink=Terminal()), json)


def cite(run: o.RunOrShip, json: bool = False) -> None:
    """Print what a result owes to whom: papers, data sets, programs."""
    from ..workflow.evidence.cited import cite as work

    show(work(run), json)


def calibrate(
    model: o.FittedModel, parts: o.LeftOutParts = None, folds: o.Folds = None, horizon: o.BandHorizon = None,
    history: o.CalibratedHistory = None, fit_first: o.CalibratedFirst = None,
    cluster: Cluster = Cluster(), json: bool = False,
) -> None:  # fmt: skip
    """Fit without some trials in turn; write bands that hold."""
    from ..workflow.evidence.calibrate import calibrate as run
    from ..workflow.request import Stopped

    try:
        outcome = run(model, parts=parts, by=folds, horizon=horizon, history=history, first=fit_first,
                      dask=cluster.dask, sink=Terminal())  # fmt: skip
    except KeyboardInterrupt:
        raise Stopped("interrupted; run the same command again to go on") from None
    show(outcome, json)


def yardstick(
    sets: o.YardstickSets = (), method: o.Methods = (), out: o.YardstickFile = None, json: bool = False
) -> None:  # fmt: skip
    """Measure methods of prediction on public data sets."""
    from ..workflow.evidence.yardstick import yardstick as run

    end(run(sets, method, out=out, sink=Terminal()), json)


def case(
    file: o.CasePath, out: o.CaseFolder = None, search: o.CaseSearch = None, shares: Shares = Shares(),
    verify: o.CaseVerify = False,
    json: bool = False,
) -> None:  # fmt: skip
    """Judge an autonomy stack in many encounters: a safety case."""
    from ..core.executors import processors
    from ..workflow.request import Stopped
    from ..workflow.safety.argued import verified
    from ..workflow.safety.case import case as run

    if verify:
        end(verified(file), json)
        return
    if out is None:
        raise RequestError("give the folder of the parts and the page with -o DIR; or --verify one")
    if search is not None:
        if shares != Shares():
            raise RequestError("--search goes by what it found and is not shared; leave --shard and --dask out")
        from ..workflow.safety.failing import search as look

        end(look(file, out, search, sink=Terminal()), json)
        return
    try:
        end(run(file, out, workers=processors(), shard=shares.shard, dask=shares.dask, sink=Terminal()), json)
    except KeyboardInterrupt:
        raise Stopped("interrupted; run the same command again to go on") from None


def paper(key: o.PaperKey, out: o.PaperPage, table: o.PaperTable = None, json: bool = False) -> None:
    """Run a published paper anew, its tables and figures beside ours."""
    from ..workflow.evidence.paper import paper as run

    end(run(key, out, table=table, sink=Terminal()), json)


def bands_shown(banded: Banded) -> Body:
    """The indices with their bands, and what these leave out."""
    from ..report.judging.bands import numbers

    ran, found = banded.run, banded.sailed
    indices = {name: _index(*three) for name, three in banded.indices.items()}
    rows = [(name.replace("_", " "), *(figure(one[key], 5) for key in ("value", "low", "high")), one["unit"])
            for name, one in indices.items()]  # fmt: skip
    title = f"{ran.ship.name}, {ran.policy.kind}"
    return fields(
        {"ship": ran.ship.name, "manoeuvre": ran.policy.kind, "settings": ran.settings, "complete": ran.complete,
         "reason": ran.reason, "time": ran.trial.duration, "level": banded.level, "draws": len(found.draws),
         "basis": numbers(found.basis), "indices": indices, "caveats": list(found.caveats),
         "fit": banded.posterior.digest},
        table((title, "value", "from", "to", "unit"), rows, words=(4,))
        + bullets((f"from, to: {100 * banded.level:g} % of {len(found.draws)} draws",
                   "–: too few of them reach it, or it is read of single runs only")),
    )  # fmt: skip


def _index(value: Index, low: Index, high: Index) -> Mapping[str, Any]:
    """An index with the edges of its band; angles in degrees."""
    angle = value.unit in ("rad", "rad/s")
    factor = _DEGREES if angle else 1.0
    return {"value": factor * value.value, "low": factor * low.value, "high": factor * high.value,
            "unit": value.unit.replace("rad", "deg") if angle else value.unit}  # fmt: skip
