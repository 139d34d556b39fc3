"""Radar and transponders through sensors, on the wire: what arrives, when, and how far off."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from scenes import FERRY, on_wire, scene
from seatrial.core.constants import MILE
from seatrial.data.nmea.sentences import decode
from seatrial.encounters.sensing import Ais, Radar, Sensing
from seatrial.realtime.range.contacts import Sensed

EXACT = Radar(bearing=0.0, distance=0.0, share=0.0, missed=0.0)


def told(sensing: Sensing | None, kind: str, until: float, **more: Any) -> list[tuple[float, bytes]]:
    """Sentences of a kind, with the time at which each went out."""
    there = scene(FERRY, rate=2.0, route=(), sensing=sensing, **more)
    stage, wire = on_wire(there, only=("TTM", "VDM"), rates={"HDT": 1.0})
    found: list[tuple[float, bytes]] = []
    while stage.loop.t < until:
        before = len(wire.said(kind))
        stage.loop.step()
        found += [(stage.loop.t, line) for line in wire.said(kind)[before:]]
    return found


@pytest.mark.slow
def test_a_radar_without_errors_says_what_the_truth_is_once_it_has_a_track() -> None:
    true, seen = told(None, "TTM", 100.0), told(Sensing(radar=EXACT), "TTM", 100.0)
    assert 57.0 < seen[0][0] < 65.0
    by_time = dict(true)
    for t, line in seen[5:]:
        one, other = decode(line), decode(by_time[t])
        within = {"targetdist": 0.002, "targetbearing": 0.2, "targetspeed": 0.1, "targetcourse": 0.5}
        for name, most in within.items():
            assert one.number(name) == pytest.approx(other.number(name), abs=most)


@pytest.mark.slow
def test_bearings_scatter_as_asked_and_nothing_is_seen_beyond_the_range() -> None:
    noisy = told(Sensing(radar=Radar(bearing=2.0, distance=0.0, share=0.0, missed=0.0, memory=3.0)), "TTM", 150.0)
    true = dict(told(None, "TTM", 150.0))
    off = [decode(line).number("targetbearing") - decode(true[t]).number("targetbearing") for t, line in noisy]  # type: ignore[operator]
    assert 0.5 < float(np.std(off)) < 2.5  # less than that of a plot by the filter
    assert not told(Sensing(radar=Radar(range=2000.0)), "TTM", 100.0)
    assert not told(Sensing(ais=Ais()), "TTM", 80.0)  # no radar


@pytest.mark.slow
def test_reports_of_transponders_are_late_lost_or_not_sent() -> None:
    true = told(None, "VDM", 60.0)
    late = told(Sensing(ais=Ais(missed=0.0, delay=3.0, place=0.0)), "VDM", 60.0)
    first = [t for t, _ in true]
    moved = [t for t, line in late if line in [one for _, one in true] and t - 3.0 in first]
    assert len(moved) >= 4  # the same reports, three seconds later
    assert not told(Sensing(ais=Ais(silent=1.0)), "VDM", 40.0)
    assert not told(Sensing(radar=EXACT), "VDM", 40.0)
    assert len(told(Sensing(ais=Ais(missed=1.0)), "VDM", 40.0)) == 2  # static data alone, in two parts


@pytest.mark.slow
def test_sensors_go_on_alike_from_what_was_saved() -> None:
    sensing = Sensing(radar=Radar(), ais=Ais())
    stages = [on_wire(scene(FERRY, rate=2.0, route=(), sensing=sensing))[0] for _ in range(2)]
    stages[0].loop.run(80.0)
    stages[1].loop.restore(stages[0].loop.snapshot())
    found = []
    for stage in stages:
        stage.loop.run(20.0)
        sensed: Any = stage.reports._sensed
        assert isinstance(sensed, Sensed)
        one = sensed.contacts(stage.loop.t)["ferry"]
        found.append((one.distance, one.bearing, one.U, sensed.heard("ferry")))
        true = stage.contacts.seen["ferry"]
        assert one.distance == pytest.approx(true.distance, abs=60.0)
        assert one.distance != true.distance
        assert abs(one.distance * math.sin(one.bearing - true.bearing)) < 0.1 * MILE
    assert found[0] == found[1]
