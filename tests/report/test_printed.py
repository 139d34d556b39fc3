"""Printed numbers beside ours: what counts as the same, and that no difference goes without a reason."""

from seatrial.report.page import html
from seatrial.report.printed import SAME, Row, fields, side_by_side


def test_the_same_to_the_digits_printed() -> None:
    assert Row("w_P0", 0.5064, 0.50644).same
    assert not Row("w_P0", 0.5064, 0.50646).same
    assert Row("L_pp", 83.0, 83.4).same
    assert Row("C_w", -2.4, -2.44).same
    assert not Row("C_w", -2.4, -2.44, digit=1e-4).same
    assert not Row("S", 3.31e-6, 3.4e-6).same
    assert not Row("L_pp", 83.0, float("nan")).same
    assert Row("least at", "0.5", "0.5").same


def test_every_difference_has_a_reason() -> None:
    assert Row("a", 1.5, 1.5, why="never shown").reason == SAME
    assert Row("a", 1.5, 1.4, why="flap law").reason == "flap law"
    assert Row("a", 1.5, 1.4).reason == "not explained"


def test_table_and_fields_hold_both_numbers() -> None:
    rows = [Row("D <-10>", 1.5, 1.41, "L_pp", "flap & law"), Row("falls", "yes", "no", why="wind")]
    shown = html(side_by_side(rows, first="Fig. 8"))
    for part in ("Fig. 8", "D &lt;-10&gt; [L_pp]", ">1.5<", ">1.410<", "flap &amp; law", ">yes<", ">no<", "wind"):
        assert part in shown
    assert fields(rows)[0] == {"name": "D <-10>", "printed": 1.5, "ours": 1.41, "unit": "L_pp", "why": "flap & law",
                               "same": False}  # fmt: skip
