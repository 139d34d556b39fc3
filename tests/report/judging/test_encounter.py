"""The table and the drawing of an encounter: scale, sides, times and parts as they are."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from kinematic import Sailed, meeting, tracks
from seatrial.encounters.rules import Limits, judge
from seatrial.report.blocks import Table, plain_text
from seatrial.report.judging.encounter import drawn, shown

TURNS = ((600.0, 40.0, 1.0), (1900.0, -40.0, 1.0))


def lines(svg: str) -> list[np.ndarray]:
    found = re.findall(r'<polyline points="([^"]+)"', svg)
    return [np.array([[float(v) for v in pair.split(",")] for pair in one.split()]) for one in found]


@pytest.fixture(scope="module")
def crossing() -> tuple[object, ...]:
    made = tracks([Sailed(0, 0, 0, 8.0, TURNS), Sailed(*meeting(-90.0, 1500.0), -90.0, 8.0)], T=2700.0)
    return made, judge(made)


def test_north_is_up_and_both_scales_are_equal(crossing: tuple) -> None:
    made, judged = crossing
    own, other = lines(drawn(made, judged, Limits()))[:2]
    for line, k in ((own, 0), (other, 1)):
        east, north = np.diff(made.y[k][[0, -1]])[0], np.diff(made.x[k][[0, -1]])[0]
        right, down = line[-1] - line[0]
        assert np.sign(right) == np.sign(round(east)) or abs(east) < 50.0
        for pixels, metres in ((right, east), (-down, north)):
            if abs(metres) > 1000.0:
                scale = pixels / metres
                assert scale == pytest.approx((own[0, 1] - own[-1, 1]) / (made.x[0, -1] - made.x[0, 0]), rel=0.01)


def test_marks_stand_at_equal_times(crossing: tuple) -> None:
    """Both ships have as many, and minutes beside them count alike."""
    made, judged = crossing
    svg = drawn(made, judged, Limits())
    text = r'fill="#(?:111|D55E00)" text-anchor="start" font-weight="400">(\d+)<'
    minutes = [int(one) for one in re.findall(text, svg)]
    assert minutes == [*range(0, 46, 5)] * 2
    assert svg.count("<polygon") == 20


def test_the_action_is_marked_where_it_begins(crossing: tuple) -> None:
    made, judged = crossing
    svg = drawn(made, judged, Limits())
    (x, y), = [tuple(map(float, one)) for one in re.findall(r'd="M([\d.]+) ([\d.]+)l6 6l-6 6', svg)]
    own = lines(svg)[0]
    k = int(np.searchsorted(made.t, 600.0))
    assert (x, y + 6.0) == pytest.approx(tuple(own[k]), abs=2.0)


def test_the_table_tells_parts_actions_and_breaches(crossing: tuple) -> None:
    made, judged = crossing
    table = next(block for block in shown(made, judged, Limits()) if isinstance(block, Table))
    one, two = ([str(cell) for cell in row] for row in table.rows)
    assert one[:4] == ["own to target 1", "kept", "gives way", "–"]
    assert one[5:7] == ["10.0", "40 to starboard"]
    assert two[:3] == ["target 1 to own", "kept", "stands on"]
    assert two[5:7] == ["–", "–"]


def test_times_of_a_model_are_told_to_the_hundredth_of_a_minute(crossing: tuple) -> None:
    """The same encounter of a ship a hundredth as long takes a tenth of the time."""
    made, judged = crossing
    small = replace(made, t=0.1 * made.t)
    table = next(block for block in shown(small, judged, Limits()) if isinstance(block, Table))
    assert str(next(iter(table.rows))[5]) == "1.00"


def test_contact_is_told_before_all() -> None:
    made = tracks([Sailed(0, 0, 0, 8.0), Sailed(*meeting(-90.0, 1500.0), -90.0, 8.0)], T=2700.0)
    text = "\n".join(plain_text(shown(made, judge(made), Limits())))
    assert text.count("contact") == 2
    assert "8(a), 8(b), 8(d), 16" in text


def test_one_run_of_many_is_drawn_as_itself(crossing: tuple) -> None:
    made, judged = crossing
    still = tracks([Sailed(0, 0, 0, 8.0), Sailed(*meeting(-90.0, 1500.0), -90.0, 8.0)], T=2700.0)
    both = replace(made, **{name: np.stack([getattr(still, name), getattr(made, name)])
                            for name in ("x", "y", "psi", "u", "v_m")})  # fmt: skip
    assert drawn(both, judge(both), Limits(), (1,)) == drawn(made, judged, Limits())
