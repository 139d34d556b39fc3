"""The test of a ship's connection: it passes a ship that talks, and fails one that is deaf or says something else."""

from __future__ import annotations

import pytest

from seatrial.realtime import connection
from seatrial.realtime.conning import Conning
from seatrial.ships.files import load


@pytest.mark.slow
def test_a_ship_that_tells_its_state_and_obeys_passes() -> None:
    found = connection.connection(load("kvlcc2_l7"))
    assert found.verdict == "pass"
    assert len([one for one in found.findings if one.bound]) >= 6


@pytest.mark.slow
def test_a_ship_that_is_deaf_to_orders_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Conning, "take", lambda self, sentence, sender, t: {})
    found = connection.connection(load("kvlcc2_l7"))
    assert found.verdict == "fail"
    assert "rudder order" in found.reason


@pytest.mark.slow
def test_a_ship_that_tells_another_heading_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    usual = connection.decode

    def turned(line: bytes):
        said = usual(line)
        return type(said)(said.talker, said.kind, {**said.fields, "headingT": 90.0}) if said.kind == "HDT" else said

    monkeypatch.setattr(connection, "decode", turned)
    found = connection.connection(load("kvlcc2_l7"))
    assert found.verdict == "fail"
    assert "HDT" in found.reason


@pytest.mark.slow
def test_a_ship_of_ordered_forces_obeys_no_sentence() -> None:
    found = connection.connection(load("cybership2"))
    assert found.verdict == "fail"
    assert "X_tau" in found.reason
