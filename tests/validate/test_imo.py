"""MSC.137(76): the limits by hand, the verdicts on ships whose figures are known, and what cannot be judged."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from seatrial.cli.judging import imo
from seatrial.report.judging.imo import page as page_of
from seatrial.ships.files import library, load
from seatrial.simulate.run import approach
from seatrial.validate.imo import FAIL, NOT_APPLICABLE, PASS, ImoTable, imo_table, no_stop, overshoot_limits
from seatrial.workflow import RequestError

pytestmark = pytest.mark.slow


def rows_of(table: ImoTable) -> dict[tuple[str, str], object]:
    return {(row.name, row.side): row for row in table.rows}


@pytest.mark.parametrize(
    ("L_over_V", "first", "second"),
    [
        (5.0, 10.0, 25.0), (9.999, 10.0, 25.0), (10.0, 10.0, 25.0), (20.0, 15.0, 32.5),
        (29.999, 19.9995, 39.99925), (30.0, 20.0, 40.0), (40.1, 20.0, 40.0),
    ],
)  # fmt: skip
def test_limits_of_the_10_10_zigzag_join_at_10_and_30_seconds(L_over_V, first, second):
    assert overshoot_limits(L_over_V) == pytest.approx((first, second), abs=1e-9)


@pytest.fixture(scope="module")
def kvlcc2() -> ImoTable:
    return imo_table(load("kvlcc2"))


def test_kvlcc2_meets_what_can_be_judged(kvlcc2):
    assert kvlcc2.L_over_V == pytest.approx(320.0 / 7.974, rel=1e-3)
    assert len(kvlcc2.rows) == 13
    assert (kvlcc2.count(PASS), kvlcc2.count(FAIL), kvlcc2.count(NOT_APPLICABLE)) == (12, 0, 1)
    rows = rows_of(kvlcc2)
    first = rows["10/10 zigzag, first overshoot", "starboard"]
    assert (first.limit, rows["10/10 zigzag, second overshoot", "port"].limit) == (20.0, 40.0)
    # figures of the reference runs of full-scale KVLCC2 in this repository's tests
    assert first.value == pytest.approx(4.92, abs=0.02)
    assert rows["advance, rudder 35 deg", "starboard"].value == pytest.approx(2.976, abs=0.002)
    assert rows["tactical diameter, rudder 35 deg", "port"].limit == 5.0


def test_a_shaft_that_ends_at_standstill_does_not_turn_astern():
    """Full astern of 0 1/s is no order astern: the reason is the shaft, not the thrust."""
    ship = load("kvlcc2_l7")
    speed, n_P = approach(ship)
    assert no_stop(ship, speed, n_P, 0.0) == "the shaft of this ship does not turn astern"
    assert no_stop(ship, speed, n_P, -n_P) == ""


def test_kvlcc2_cannot_say_how_it_stops(kvlcc2):
    """Its propeller was fitted ahead: the stop has a value, but no verdict."""
    stop = kvlcc2.rows[-1]
    assert stop.name == "track reach, full astern"
    assert (stop.verdict, stop.limit, stop.unit) == (NOT_APPLICABLE, 15.0, "L")
    assert 1.0 < stop.value < 15.0
    assert "extrapolates: propeller:Standard" in stop.reason
    assert "valid for n_P of 0 1/s and above" in stop.reason
    assert "1 of 13 criteria could not be judged" in kvlcc2.verdict


def test_a_four_quadrant_propeller_is_judged():
    table = imo_table(load("esso_osaka_3m"))
    stop = table.rows[-1]
    assert (stop.verdict, stop.reason) == (PASS, "")
    assert stop.value == pytest.approx(4.06, abs=0.02)
    assert any("100 m and more" in line for line in table.caveats)


def test_a_nomoto_ship_has_no_stop_and_says_what_its_circle_is():
    table = imo_table(load("mariner_nomoto"))
    stop = table.rows[-1]
    assert (stop.verdict, stop.value) == (NOT_APPLICABLE, None)
    assert "no propulsion" in stop.reason
    assert table.conditions["full astern"] == "none"
    assert any("holds its speed" in line for line in table.caveats)
    # L/V = 160.93/7.7175 = 20.85 s
    assert rows_of(table)["10/10 zigzag, first overshoot", "port"].limit == pytest.approx(15.426, abs=1e-3)


@pytest.mark.skipif("mariner" not in library(), reason="no mariner in the library")
def test_mariner_turns_wider_than_the_standard():
    """Re-referenced to the execute, MSS's Mariner has tactical diameters of 6.40 and 6.65 L, advances 3.54 and 3.71."""
    rows = rows_of(imo_table(load("mariner")))
    for side, advance, tactical in (("starboard", 3.54, 6.40), ("port", 3.71, 6.65)):
        row = rows["tactical diameter, rudder 35 deg", side]
        assert (row.verdict, row.value) == (FAIL, pytest.approx(tactical, abs=0.01))
        assert rows["advance, rudder 35 deg", side].value == pytest.approx(advance, abs=0.01)


@pytest.mark.skipif("kcs" not in library(), reason="no kcs in the library")
def test_kcs_has_limits_between_the_ends():
    table = imo_table(load("kcs"))
    first, second = overshoot_limits(table.L_over_V)
    assert table.L_over_V == pytest.approx(230.0 / 12.348, rel=0.01)
    assert first == pytest.approx(5 + 0.5 * table.L_over_V)
    assert second == pytest.approx(17.5 + 0.75 * table.L_over_V)
    assert (table.count(PASS), table.count(FAIL)) == (12, 0)


def test_a_ship_that_leaves_its_validity_is_not_judged_there():
    ship = load("kvlcc2")
    table = imo_table(replace(ship, validity={**ship.validity, "r": (-0.0075, 0.0075)}))
    hard = rows_of(table)["advance, rudder 35 deg", "starboard"]
    assert (hard.verdict, hard.value) == (NOT_APPLICABLE, None)
    assert "r = " in hard.reason
    named = imo_table(replace(ship, name="the run was not over", validity={**ship.validity, "r": (-0.0075, 0.0075)}))
    assert [row.verdict for row in named.rows] == [row.verdict for row in table.rows]
    assert rows_of(table)["10/10 zigzag, first overshoot", "starboard"].verdict == PASS


def test_page_holds_every_verdict_and_asks_for_nothing_outside(kvlcc2):
    text = page_of(kvlcc2).html
    assert text.count("not applicable") == 1
    assert "20/20 zigzag, first overshoot" in text
    assert "extrapolates" in text
    assert "What this does not show" in text
    assert "http" not in text


@pytest.mark.long
def test_command(tmp_path, capsys):
    imo("kvlcc2", tmp_path / "imo.html", json=True)
    found = json.loads(capsys.readouterr().out)
    assert found["ship"] == "kvlcc2"
    assert found["L_over_V"]["value"] == pytest.approx(40.13, abs=0.01)
    assert len(found["criteria"]) == 13
    assert {row["verdict"] for row in found["criteria"]} == {PASS, NOT_APPLICABLE}
    assert (tmp_path / "imo.html").read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    imo("kvlcc2", None)
    text = capsys.readouterr().out
    assert "Meets every criterion that could be judged (12)" in text
    for wrong in (tmp_path / "imo.txt", tmp_path / "nowhere" / "imo.html"):
        with pytest.raises(RequestError):
            imo("kvlcc2", wrong)
