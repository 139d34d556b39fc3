"""The stack of the examples that knows only sentences: to whom it gives way, when it stands on, when it goes back."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import pytest

from seatrial.data.nmea.sentences import decode
from seatrial.workflow.safety.stacks import Stack

PATH = Path(__file__).parents[3] / "examples" / "cases" / "keep_clear.py"


@pytest.fixture
def stack() -> Any:
    spec = importlib.util.spec_from_file_location("keep_clear", PATH)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def hears(pilot: Any, heading: float, bearing: float, cpa: float, tcpa: float, number: int = 1) -> float:
    """What it steers after its heading, and one contact of the radar [deg, nautical miles, min]."""
    pilot.hear(f"$HEHDT,{heading:.1f},T*00")
    pilot.hear(f"$RATTM,{number:02},5.0,{bearing:.1f},T,15.0,270.0,T,{cpa:.2f},{tcpa:.1f},N,a,T,,120000.00,A*00")
    return float(pilot.steer())


def test_it_alters_to_starboard_for_a_ship_to_starboard_and_goes_back_when_that_is_past(stack: Any) -> None:
    pilot = stack.Pilot()
    assert hears(pilot, 350.0, 35.0, 0.1, 30.0) == 350.0  # too early
    assert hears(pilot, 350.0, 35.0, 0.1, 20.0) == 35.0  # 45 deg to starboard of 350
    assert hears(pilot, 10.0, 35.0, 0.5, 18.0) == 35.0  # still turning
    assert hears(pilot, 34.0, 30.0, 2.0, 15.0) == 35.0  # it suffices, and the ship is forward
    assert hears(pilot, 35.0, 200.0, 2.0, -1.0) == 350.0


def test_it_stands_on_for_a_ship_to_port_until_five_minutes_are_left(stack: Any) -> None:
    pilot = stack.Pilot()
    assert hears(pilot, 0.0, 315.0, 0.1, 20.0) == 0.0
    assert hears(pilot, 0.0, 315.0, 0.1, 4.9) == 45.0


def test_a_turn_that_does_not_suffice_goes_on(stack: Any) -> None:
    pilot = stack.Pilot()
    assert hears(pilot, 0.0, 20.0, 0.1, 20.0) == 45.0
    assert hears(pilot, 44.0, 20.0, 0.6, 18.0) == 65.0
    assert hears(pilot, 50.0, 20.0, 0.6, 18.0) == 65.0


def test_what_it_says_is_a_heading_to_steer(stack: Any) -> None:
    said = decode(stack.sentence("AGHTC,V,,,H,N,,,,,45.0,,,T,C"))
    assert (said.kind, said["steermode"], said["cmdheading"], said["headingref"]) == ("HTC", "H", 45.0, "T")
    assert Stack(command="python keep_clear.py {address}").answers == "ZDA"
