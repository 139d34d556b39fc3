"""Every manoeuvre of `seatrial simulate`, controllers among them, runs in a campaign, and a run of it is replayed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from seatrial.campaign.chunk import compute, replay
from seatrial.campaign.schema import SCHEMA
from seatrial.workflow.campaigns.reading import campaign_of
from seatrial.workflow.simulation import known

QUICK = ("course-keeping", "turning", "zigzag")
# A ship of its own, where the manoeuvre needs two thrusters.
SHIPS = {"crabbing": "esso_osaka_3m_harbour", "thrust-steps": "milliampere"}
KINDS = [pytest.param(kind, marks=() if kind in QUICK else pytest.mark.long) for kind in known()]


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_each_runs_and_is_replayed(kind: str) -> None:
    document = {"schema": SCHEMA, "ships": [SHIPS.get(kind, "esso_osaka_3m")], "runs": 2,
                "manoeuvre": {"kind": kind, "indices": "all", **({"duration": 60.0} if kind == "straight" else {})},
                "inputs": {"u": {"uniform": [0.95, 1.0], "factor": True}} if kind in QUICK else {}}  # fmt: skip
    plan = campaign_of(document, Path("campaign.toml"))
    part = compute(plan, 0).columns
    figures = set(part) - {"run", "case", "u", "failed", "complete"}
    assert figures
    assert np.isnan(part["failed"]).all()
    runs, policy, trial = replay(plan, 1)
    assert policy.kind == kind
    found = policy.indices(trial, runs.case.ship.L_pp)
    assert any(np.isfinite(part[name][1]) for name in figures)
    for name in figures & set(found):
        np.testing.assert_allclose(part[name][1], found[name].value, rtol=1e-9, atol=1e-12)
