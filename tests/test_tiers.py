"""Marks of tiers: a module is left unread only where `-m` takes none of its tests, and no case of a family is lost."""

from __future__ import annotations

import pytest

from tiers import left_out, slow_but

SLOW, LONG = "import pytest\n\npytestmark = pytest.mark.slow\n", "pytestmark = [\n    pytest.mark.long,\n    A,\n]\n"
NONE = 'pytestmark = pytest.mark.skipif(True, reason="")\n\n\n@pytest.mark.slow\ndef test_a():\n    pass\n'


@pytest.mark.parametrize(
    ("module", "expression", "out"),
    [
        (SLOW, "not slow and not long", True), (SLOW, "not long", False), (SLOW, "slow and not long", False),
        (LONG, "not slow and not long", True), (LONG, "slow and not long", True), (LONG, "not slow", False),
        (LONG, "not long or slow", False), (LONG, "not (long and slow)", False), (LONG, "", False),
        (NONE, "not slow and not long", False),
    ],
)  # fmt: skip
def test_a_module_is_left_out_where_none_of_its_tests_is_taken(module: str, expression: str, out: bool) -> None:
    assert left_out(module, expression) is out


def test_every_case_is_kept_with_its_marks_and_all_but_the_named_are_slow() -> None:
    long = pytest.param(3, 4, marks=pytest.mark.long, id="three")
    cases = slow_but([(1, 2), [2, 3], long], (2, 3))
    assert [case.values for case in cases] == [(1, 2), (2, 3), (3, 4)]
    assert [sorted(mark.name for mark in case.marks) for case in cases] == [["slow"], [], ["long", "slow"]]
    assert cases[2].id == "three"
    assert [case.values for case in slow_but("ab", "b") if not case.marks] == [("b",)]
    with pytest.raises(ValueError, match="c"):
        slow_but("ab", "c")
