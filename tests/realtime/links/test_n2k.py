"""NMEA 2000 by another decoder: signs and units of each field; astern never looks like ahead."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from seatrial.data.nmea.ship import Fittings
from seatrial.realtime.links.n2k import GROUPS, identifier

decoder = pytest.importorskip("nmea2000.decoder")
can = pytest.importorskip("can")

FIT = Fittings(rudders=("delta_1", "delta_2"), shafts=("n_P_1", "n_P_2"))
AHEAD = {
    "psi": 5.9, "r": 0.0123, "delta_1": 0.2, "delta_2": -0.31, "n_P_1": 1.75, "n_P_2": 0.0, "u_w": 4.31, "v_w": 0.21,
    "u": 3.9, "v_m": -0.6, "v_w_stern": 1.01, "v_stern": -0.72, "latitude": -33.8567844, "longitude": 151.2152967,
    "U": 3.946, "chi": 0.7, "U_A": 11.3, "gamma_A": 5.5, "U_T": 9.2, "gamma_T_bow": 2.5,
}  # fmt: skip


def decoded(pgn: int, said: dict[str, float], sid: int = 3) -> list[dict[str, Any]]:
    """The messages of a group by field, as another decoder reads them."""
    reader, found = decoder.NMEA2000Decoder(), []
    for data in GROUPS[pgn][1](said, FIT, sid):
        assert len(data) == 8
        frame = can.Message(arbitration_id=identifier(pgn), data=data, is_extended_id=True)
        if (message := reader.decode(frame)) is not None:
            found.append({field.id: field.value for field in message.fields})
    return found


def astern(said: dict[str, float]) -> dict[str, float]:
    return {**said, **{name: -said[name] for name in ("n_P_1", "u_w", "u")}}


def test_each_group_has_the_values_in_its_units():
    port, starboard = decoded(127245, AHEAD)
    assert (port["position"], starboard["position"]) == (pytest.approx(0.2), pytest.approx(-0.31))
    assert decoded(127250, AHEAD)[0]["heading"] == pytest.approx(5.9, abs=5.1e-5)
    assert decoded(127251, AHEAD)[0]["rate"] == pytest.approx(0.0123, abs=2e-8)
    speed = decoded(128259, AHEAD)[0]
    assert speed["speedWaterReferenced"] == pytest.approx(4.31, abs=0.0051)
    assert speed["speedGroundReferenced"] == pytest.approx(math.hypot(3.9, 0.6), abs=0.0051)
    assert speed["speedDirection"] == 0
    place = decoded(129025, AHEAD)[0]
    assert (place["latitude"], place["longitude"]) == (pytest.approx(-33.8567844), pytest.approx(151.2152967))
    course = decoded(129026, AHEAD)[0]
    assert (course["cog"], course["sog"]) == (pytest.approx(0.7, abs=5.1e-5), pytest.approx(3.946, abs=0.0051))
    apparent, true = decoded(130306, AHEAD)
    assert (apparent["reference"], true["reference"]) == ("Apparent", "True (boat referenced)")
    assert (apparent["windSpeed"], apparent["windAngle"]) == (pytest.approx(11.3), pytest.approx(5.5))
    assert (true["windSpeed"], true["windAngle"]) == (pytest.approx(9.2), pytest.approx(2.5))
    engines = decoded(127488, AHEAD)
    assert [one["speed"] for one in engines] == [pytest.approx(105.0, abs=0.13), 0.0]


@pytest.mark.parametrize("sid", range(10))
def test_signed_speeds_come_in_two_frames(sid):
    for said in (AHEAD, astern(AHEAD)):
        (found,) = decoded(130578, said, sid)
        assert found["longitudinalSpeedWaterReferenced"] == pytest.approx(said["u_w"], abs=5.1e-4)
        assert found["transverseSpeedWaterReferenced"] == pytest.approx(said["v_w"], abs=5.1e-4)
        assert found["longitudinalSpeedGroundReferenced"] == pytest.approx(said["u"], abs=5.1e-4)
        assert found["transverseSpeedGroundReferenced"] == pytest.approx(said["v_m"], abs=5.1e-4)
        assert found["sternSpeedWaterReferenced"] == pytest.approx(said["v_w_stern"], abs=5.1e-4)
        assert found["sternSpeedGroundReferenced"] == pytest.approx(said["v_stern"], abs=5.1e-4)
    assert decoded(130578, {"u_w": -0.5})[0]["longitudinalSpeedGroundReferenced"] is None


def test_astern_never_looks_like_ahead():
    back = astern(AHEAD)
    assert [one["transmissionGear"] for one in decoded(127493, AHEAD)] == ["Forward", "Neutral"]
    assert [one["transmissionGear"] for one in decoded(127493, back)] == ["Reverse", "Neutral"]
    assert [one["speed"] for one in decoded(127488, back)] == [one["speed"] for one in decoded(127488, AHEAD)]
    speed = decoded(128259, back)[0]
    assert speed["speedWaterReferenced"] is speed["speedGroundReferenced"] is None
    assert speed["speedDirection"] == 1
    mixed = decoded(128259, {**AHEAD, "u": -0.2})[0]  # ahead through the water, set back over ground
    assert mixed["speedWaterReferenced"] == pytest.approx(4.31)
    assert mixed["speedGroundReferenced"] is None


def test_what_is_not_known_is_not_available():
    assert all(not decoded(pgn, {}) for pgn in GROUPS)
    assert decoded(128259, {"u_w": 1.0})[0]["speedGroundReferenced"] is None
    alone = replace(FIT, rudders=("delta",), shafts=("n_P",))
    assert len([*GROUPS[127245][1]({"delta": 0.1}, alone, 0)]) == 1


def test_values_beyond_a_field_stop_at_its_end():
    """The three largest values of a field mean something else: error, not available."""
    assert decoded(128259, {"u_w": 1e4})[0]["speedWaterReferenced"] == pytest.approx(655.32)
    assert decoded(130578, {"u_w": -1e4})[0]["longitudinalSpeedWaterReferenced"] == pytest.approx(-32.764)
    assert decoded(127250, {"psi": -1e-9})[0]["heading"] == 0.0
    assert decoded(127250, {"psi": -0.5})[0]["heading"] == pytest.approx(math.tau - 0.5, abs=5.1e-5)
    assert [decoded(127251, {"r": r})[0]["rate"] > 0.0 for r in (100.0, -100.0)] == [True, False]
