"""Blocks as text, and numbers to read: digits, bounds of the plain form, columns to either side."""

from __future__ import annotations

import math

import pytest

from seatrial.report.blocks import (
    Blanks,
    Figure,
    Group,
    Line,
    Lines,
    Numbers,
    Table,
    Verdict,
    bullets,
    cell,
    entries,
    figure,
    gallery,
    heading,
    joined,
    lead,
    line,
    note,
    number,
    plain_text,
    soft,
    table,
    tiles,
)
from shown import aligned


@pytest.mark.parametrize(("value", "digits", "said"), [
    (0.0, 3, "0"), (-0.0, 3, "0"), (math.nan, 3, "–"), (math.inf, 3, "–"), (-math.inf, 3, "–"),
    (1.0, 3, "1.00"), (-1.5, 3, "−1.50"), (12.345, 3, "12.3"), (123.45, 3, "123"), (1234.5, 3, "1234"),
    (999999.0, 3, "999999"), (1000000.0, 3, "1.00e+06"), (0.001, 3, "0.00100"), (0.000999, 3, "9.99e−04"),
    (-0.0001, 2, "−1.0e−04"), (0.5, 1, "0.5"), (7.0, 1, "7"), (3.14159, 5, "3.1416"), (2.0e7, 1, "2e+07"),
])  # fmt: skip
def test_a_number_has_its_digits_and_its_powers_beyond_six_places_or_three_zeros(
    value: float, digits: int, said: str
) -> None:
    assert number(value, digits) == said


def test_a_number_has_three_digits_unless_told_and_a_cell_four() -> None:
    assert number(2.71828) == "2.72"
    assert cell(-2.71828) == "-2.718"
    assert (cell(None), cell(3), cell("a"), cell(1e-9)) == ("", "3", "a", "1.000e-09")


def text(*blocks: object) -> list[str]:
    return list(plain_text(blocks))  # type: ignore[arg-type]


def test_every_block_is_text() -> None:
    assert text(Line("one"), Line("two", command="seatrial x")) == ["one", "two seatrial x"]
    assert text(Lines(("a", "b"))) == ["a", "b"]
    assert text(Lines(("a",), "over it", boxed=True)) == ["over it", "a"]
    assert text(Figure("<svg/>", "below it")) == ["below it"]
    assert text(Group((Line("a"), Line("b")))) == ["a", "b"]
    assert text(Numbers((("speed", "3 m/s"), ("t", "1 s")))) == ["speed: 3 m/s", "t: 1 s"]
    assert text(Verdict("no", "too fast", (("Next", "slow down"),))) == ["no: too fast", "Next: slow down"]
    assert text(Verdict("yes")) == ["yes"]
    assert text(Blanks(("name", "date"))) == ["name:", "date:"]


def test_columns_of_text_stand_below_each_other_numbers_to_the_right() -> None:
    some = Table(("name", "x", "why"), (("a", 1.0, "far off"), ("longer", -12.5, None)), words=(2,), title="over",
                 notes=("below",))  # fmt: skip
    assert text(some) == ["over", "name         x  why", "a        1.000  far off", "longer  -12.50", "below"]
    assert text(Table(("name", "x"), ())) == []  # no heading without rows
    assert text(Table(("k", "of"), ((10, "a"), (7, "bc")))) == ["k   of", "10   a", "7   bc"]


def test_what_has_nothing_to_show_shows_nothing() -> None:
    assert soft("") == note("title", []) == gallery() == entries({}) == gallery((), ()) == ()
    assert soft("x") == (Line("x", "soft"),)
    assert note("t", iter(["x"])) == (Lines(("x",), "t", boxed=True),)
    assert lead("x") == (Line("x", "lead"),)
    assert heading("x") == (Line("x", "heading"),)
    assert line("x", command="c") == (Line("x", "", "c"),)
    assert bullets(["x"]) == (Lines(("x",)),)


def test_values_stand_before_what_they_are_in_tiles_and_after_it_in_entries() -> None:
    assert tiles([("3 m", "error"), ("4", "trials")]) == (Numbers((("error", "3 m"), ("trials", "4")), main=True),)
    assert entries({"ship": "a"}) == (Numbers((("ship", "a"),)),)
    assert gallery(figure("<svg/>", "c", least=300), least=280) == (Group((Figure("<svg/>", "c", 300),), 280),)
    assert Group(()).least == 420
    assert gallery(figure("<svg/>", "c"))[0] == Group((Figure("<svg/>", "c"),), 420)
    assert joined([line("a"), (), line("b")]) == (Line("a"), Line("b"))
    assert table(["a"], [["1"]], words=[0], wide=True, folded=True) == (Table(("a",), (("1",),), (0,), True, True),)


def test_the_check_of_columns_fails_where_words_stand_to_the_right() -> None:
    aligned(table(("a", "x", "why"), [("a", "1 m", "far"), ("b", "–", "")], words=(2,)))
    for words in ((), (1,), (1, 2)):
        with pytest.raises(AssertionError, match="column"):
            aligned(table(("a", "x", "why"), [("a", "1 m", "far")], words=words))
