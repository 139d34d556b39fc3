"""A figure shows what it was given: places are read back from the drawing by the numbers along its axes."""

from __future__ import annotations

import math
import re
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from seatrial.report import figures
from seatrial.report.canvas.frame import Frame
from seatrial.report.canvas.panels import Axis, Figure
from seatrial.report.canvas.svg import svg
from seatrial.report.canvas.ticks import alone, labels, logarithmic, plain

TEXT = re.compile(r'<text x="([-\d.]+)" y="([-\d.]+)"[^>]*text-anchor="(\w+)"[^>]*>([^<]*)</text>')
RAISED = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")


def value(words: str) -> float:
    times, _, power = words.replace("−", "-").partition("10")
    if power and power[0] in "⁻⁰¹²³⁴⁵⁶⁷⁸⁹":
        return float(times.rstrip("×") or 1.0) * 10.0 ** int(power.translate(RAISED))
    return float(words.replace("−", "-"))


def scale(drawn: str, along: str, log: bool = False) -> Any:
    """Data by place, from the numbers along the first panel's axis."""
    anchor, at = ("middle", 0) if along == "x" else ("end", 1)
    found = [(float(one[at]), one[3]) for one in TEXT.findall(drawn) if one[2] == anchor]
    known = []
    for place, words in found:
        try:
            known.append((place - (0.0 if along == "x" else 3.5), value(words)))
        except ValueError:
            continue
    (a, low), (b, high) = known[0], known[-1]
    if log:
        low, high = math.log10(low), math.log10(high)
    straight = lambda place: low + (np.asarray(place) - a) / (b - a) * (high - low)  # noqa: E731
    return (lambda place: 10.0 ** straight(place)) if log else straight


def paths(drawn: str, dashes: str = "") -> list[np.ndarray]:
    """The absolute points of stroked lines."""
    out = []
    for path, rest in re.findall(r'<path d="(M[^"]*l[^"]*)" fill="none"([^>]*)>', drawn):
        if dashes and dashes not in rest:
            continue
        for part in path.split("M")[1:]:
            start, _, steps = part.partition("l")
            moves = np.array([*start.split(), *steps.split()], dtype=float).reshape(-1, 2)
            out.append(np.cumsum(moves, axis=0))
    return out


def frame_of(drawn: str) -> tuple[float, ...]:
    """Left, top, bottom and right of the first panel."""
    return tuple(map(float, re.search(r'd="M([\d.]+) ([\d.]+)V([\d.]+)H([\d.]+)"', drawn).groups()))


def test_words_beside_a_panel_stand_at_its_ends() -> None:
    figure, (ax,) = figures.canvas(1)
    ax.plot([0.0, 1.0], [0.0, 1.0])
    ax.text("stbd", 1.0)
    ax.text("port", 0.0)
    drawn = svg(figure, "a")
    _, top, low, right = frame_of(drawn)
    at = {words: (float(x), float(y)) for x, y, _, words in TEXT.findall(drawn)}
    assert right < at["stbd"][0] == at["port"][0] < 72.0 * figure.size[0] - 12.0
    assert top < at["stbd"][1] < top + 10.0
    assert low - 5.0 < at["port"][1] <= low


def test_a_bar_reaches_as_far_to_either_side_of_its_point() -> None:
    figure, (ax,) = figures.canvas(1)
    ax.errorbar([1.0, 2.0], [5.0, 7.0], [0.0, 1.5], color="#111111", marker="o")
    drawn = svg(figure, "a")
    line, bar = paths(drawn)
    up = scale(drawn, "y")
    assert up(line[:, 1]) == pytest.approx([5.0, 7.0], abs=0.03)
    assert sorted(up(bar[:, 1])) == pytest.approx([5.5, 8.5], abs=0.03)


def test_a_line_stands_where_the_numbers_say_with_its_gaps() -> None:
    figure, (ax,) = figures.canvas(1)
    x = np.linspace(-3.0, 7.0, 21)
    y = np.where(x == 2.0, np.nan, 40.0 + x**2)
    ax.plot(x, y)
    drawn = svg(figure, "a")
    first, second = paths(drawn)
    across, up = scale(drawn, "x"), scale(drawn, "y")
    points = np.concatenate([first, second])
    np.testing.assert_allclose(across(points[:, 0]), x[x != 2.0], atol=0.01)
    np.testing.assert_allclose(up(points[:, 1]), y[x != 2.0], atol=0.05)
    assert len(first) == 10


def test_decades_are_even_along_a_logarithmic_axis() -> None:
    figure, (ax,) = figures.canvas(1)
    x, y = np.array([1.0, 2.0, 3.0, 4.0]), np.array([0.02, 0.5, 30.0, 2e7])
    ax.plot(x, y)
    ax.set(yscale="log", xlabel="x", ylabel="loss")
    drawn = svg(figure, "a")
    (points,) = paths(drawn)
    np.testing.assert_allclose(scale(drawn, "y", log=True)(points[:, 1]) / y, 1.0, rtol=0.02)


def test_equal_scale_is_equal_by_the_box_and_by_the_limits() -> None:
    for adjustable in ("box", "datalim"):
        figure, (ax,) = figures.canvas(1, (6.0, 3.0))
        turn = np.linspace(0.0, 2.0 * math.pi, 80)
        ax.plot(30.0 + 5.0 * np.cos(turn), 5.0 * np.sin(turn))
        ax.set_aspect("equal", adjustable=adjustable)
        (points,) = paths(svg(figure, "a"))
        size = np.ptp(points, axis=0)
        assert size[0] == pytest.approx(size[1], abs=0.5)
        left, top, low, right = frame_of(svg(figure, "a"))
        middle = np.mean([points.min(axis=0), points.max(axis=0)], axis=0)
        assert middle == pytest.approx([0.5 * (left + right), 0.5 * (top + low)], abs=0.3)
        if adjustable == "box":
            assert right - left == pytest.approx(low - top)
            assert 0.5 * (left + right) == pytest.approx(222.0, abs=8.0), "in the middle of its room"
        assert points.min() > 0
        assert (points.max(axis=0) < 72.0 * np.array(figure.size)).all()


def test_what_leaves_the_limits_is_cut_off_and_bands_lie_below_lines() -> None:
    figure, (ax,) = figures.canvas(1)
    x = np.linspace(0.0, 10.0, 50)
    ax.plot(x, 100.0 * x, color="#123456")
    ax.fill_between(x, np.where(x > 5, np.nan, 0.0 * x), 0.0 * x + 1.0, color="#abcdef", alpha=0.5)
    ax.set_ylim((0.0, 2.0))
    drawn = svg(figure, "a")
    (x_0, y_0, wide, high), = re.findall(r'<rect x="([\d.]+)" y="([\d.]+)" width="([\d.]+)" height="([\d.]+)"', drawn)
    assert float(x_0) + float(wide) < 72.0 * figure.size[0]
    assert float(y_0) + float(high) < 72.0 * figure.size[1]
    mark = re.search(r'<clipPath id="(\w+)"', drawn)[1]
    inner = drawn[drawn.index(f'clip-path="url(#{mark})"') :]
    assert inner.index("#abcdef") < inner.index("#123456")
    assert 'opacity="0.5"' in inner
    area = re.search(r'd="M([-\d.]+) ([-\d.]+)l([^z]*)z" fill="#abcdef"', drawn)
    corners = np.cumsum(np.array([area[1], area[2], *area[3].split()], dtype=float).reshape(-1, 2), axis=0)
    ends = scale(drawn, "x")(corners[:, 0])
    assert (ends.min(), ends.max()) == pytest.approx((0.0, x[x <= 5].max()), abs=0.05)
    heights = scale(drawn, "y")(corners[:, 1])
    assert (heights.min(), heights.max()) == pytest.approx((0.0, 1.0), abs=0.02)


def test_marks_stand_on_their_points_and_rules_from_side_to_side() -> None:
    figure, (ax,) = figures.canvas(1)
    x, y = np.array([1.0, 2.0, 4.0]), np.array([5.0, 3.0, 9.0])
    ax.plot(x, y, "o", ms=8.0, color="#111111", label="seen")
    ax.axhline(4.0, color="#222222")
    ax.axvline(3.0, color="#333333")
    ax.axvspan(1.5, 2.5, color="#444444")
    drawn = svg(figure, "a")
    across, up = scale(drawn, "x"), scale(drawn, "y")
    shown = re.search(r'd="(M[^"]*)" fill="#111111"', drawn)[1]
    circle = r"m-4 0a4 4 0 1 0 8 0a4 4 0 1 0 -8 0z"
    points = np.array(re.findall(rf"M([\d.]+) ([\d.]+){circle}", shown), dtype=float)
    np.testing.assert_allclose(across(points[:, 0]), x, atol=0.01)
    np.testing.assert_allclose(up(points[:, 1]), y, atol=0.03)
    level, upright = paths(drawn)
    assert up(level[:, 1]) == pytest.approx([4.0, 4.0], abs=0.03)
    assert across(upright[:, 0]) == pytest.approx([3.0, 3.0], abs=0.02)
    left, top, low, right = frame_of(drawn)
    assert level[:, 0] == pytest.approx([left, right], abs=0.1)
    assert sorted(upright[:, 1]) == pytest.approx([top, low], abs=0.1)
    band = re.search(r'd="M([\d.]+) ([\d.]+)l([-\d.]+) [^"]*" fill="#444444"', drawn)
    assert across([float(band[1]), float(band[1]) + float(band[3])]) == pytest.approx([1.5, 2.5], abs=0.02)


def test_panels_over_one_abscissa_share_it_and_only_the_last_has_its_numbers() -> None:
    figure, (upper, lower) = figures.canvas(2)
    upper.plot([0.0, 10.0], [0.0, 1.0])
    lower.plot([0.0, 30.0], [5.0, 6.0])
    lower.set_xlabel("t [s]")
    drawn = svg(figure, "a")
    first, second = paths(drawn)
    assert np.ptp(second[:, 0]) == pytest.approx(3.0 * np.ptp(first[:, 0]), abs=0.3)
    assert first[:, 1].max() < second[:, 1].min()
    across = [one for one in TEXT.findall(drawn) if one[2] == "middle"]
    (numbers,) = {float(one[1]) for one in across if one[3] != "t [s]"}
    assert numbers > second[:, 1].max()
    apart, grid = figures.panels(2, 1, (5.0, 4.0), shared=False)
    for ax in grid[:, 0]:
        ax.plot([0.0, 10.0], [0.0, 1.0])
    across = [one for one in TEXT.findall(svg(apart, "a")) if one[2] == "middle"]
    assert len({one[1] for one in across}) == 2


def test_a_tall_panel_reaches_over_all_rows() -> None:
    figure, grid = figures.panels(3, 2, (8.0, 5.0))
    for ax in grid[:, 1]:
        ax.plot([0.0, 1.0], [0.0, 1.0], color="#111111")
    figure.tall(0).plot([0.0, 1.0], [0.0, 1.0], color="#222222")
    assert len(figure.axes) == 4
    drawn = svg(figure, "a")
    frames = [tuple(map(float, one)) for one in re.findall(r'd="M([\d.]+) ([\d.]+)V([\d.]+)H([\d.]+)"', drawn)]
    tall, *others = sorted(frames)
    assert tall[1] == min(one[1] for one in others)
    assert tall[2] == pytest.approx(max(one[2] for one in others))
    assert tall[3] < min(one[0] for one in others)
    for above, below in pairwise(sorted(others, key=lambda one: one[1])):
        assert above[2] < below[1]


def test_a_legend_takes_the_corner_with_the_fewest_points_and_fits_its_figure() -> None:
    for x, y in ((1, 1), (-1, 1), (1, -1), (-1, -1)):
        figure, (ax,) = figures.canvas(1)
        t = np.linspace(0.0, 1.0, 200)
        ax.plot(x * t, y * t, label="on the way")
        ax.plot(x * (0.9 + 0.1 * t), y * (0.9 + 0.1 * t[::-1]))
        ax.plot(-x * (0.01 * t), -y * (0.01 * t))
        ax.legend()
        drawn = svg(figure, "a")
        at = next((float(a), float(b)) for a, b, _, words in TEXT.findall(drawn) if words == "on the way")
        corner = at[0] > 36.0 * figure.size[0], at[1] > 36.0 * figure.size[1]
        assert corner not in ((x > 0, y < 0), (x < 0, y > 0)), "not where the lines are"
    figure, (ax,) = figures.canvas(1)
    for k in range(9):
        ax.plot([0.0, 1.0], [k, k], label=f"a rather long name of a line {k}")
    figure.legend(ax.named, 4)
    drawn = svg(figure, "a")
    shown = [(float(a), float(b)) for a, b, _, words in TEXT.findall(drawn) if words.startswith("a rather")]
    assert len(shown) == 9
    assert min(a for a, _ in shown) > 0.0
    assert max(a for a, _ in shown) + 6.0 * 29 * 0.9 <= 72.0 * figure.size[0]
    assert max(b for _, b in shown) < 72.0 * figure.size[1]


def test_an_axis_ends_beyond_its_data_or_where_it_is_told() -> None:
    axis = Axis(seen=[np.array([0.0, 10.0, math.nan])])
    assert axis.ends == pytest.approx((-0.5, 10.5))
    axis.given = (0.0, None)
    assert axis.ends == pytest.approx((0.0, 10.5))
    still = Axis(seen=[np.array([4.0])]).ends
    assert still[0] < 4.0 < still[1]
    low, high = Axis(scale="log", seen=[np.array([-1.0, 0.0, 1.0, 100.0])]).ends
    assert (low, high) == pytest.approx((100.0**-0.05, 100.0**1.05))
    beyond = Axis(scale="symlog", knee=3.0)
    np.testing.assert_allclose(beyond.place(np.array([-30.0, -3.0, 0.0, 1.5, 3.0, 300.0])),
                               [-2.5, -1.5, 0.0, 0.75, 1.5, 3.5])  # fmt: skip


@pytest.mark.parametrize(("low", "high"), [(0.02, 3e7), (0.19141, 0.19171), (0.7, 4.0), (1.0, 1e12), (3e-9, 4e-3)])
def test_numbers_of_a_logarithmic_axis_are_round_and_apart(low: float, high: float) -> None:
    found = logarithmic(low, high, 5)
    assert 2 <= len(found) <= 10
    assert found == sorted(found)
    assert low <= found[0] <= found[-1] <= high
    said = [alone(one) for one in found]
    assert len(set(said)) == len(found)
    np.testing.assert_allclose([value(one) for one in said], found, rtol=1e-3)


def test_large_and_small_numbers_share_a_power_of_ten() -> None:
    assert labels([0.0, 2e6, 4e6]) == (["0", "2", "4"], "×10⁶")
    assert labels([-2e-5, 0.0, 2e-5]) == (["−2", "0", "2"], "×10⁻⁵")
    assert labels([0.0, 50000.0]) == (["0", "50000"], "")
    assert plain([0.0, 0.25, 0.5]) == ["0.00", "0.25", "0.50"] or plain([0.0, 0.2, 0.4]) == ["0.0", "0.2", "0.4"]
    assert labels([]) == ([], "")


def test_numbers_of_an_ordinate_that_has_no_room_for_them_are_told_by_a_power_of_ten() -> None:
    """Digits of ten points are 6.4 wide in DejaVu Sans, a sign 8.4, a point 3.2; a name takes 16 of the room."""
    thousands = [-1000.0, 0.0, 1000.0]
    assert labels(thousands, 34.1)[1] == ""
    assert labels(thousands, 33.9) == (["−1", "0", "1"], "×10³")
    assert labels([0.0, 0.002, 0.004], 25.0) == (["0", "2", "4"], "×10⁻³")
    assert labels([0.0, 0.002, 0.004], 30.0)[1] == ""
    for reach, left, name, power in ((100000.0, 34, "", "×10⁵"), (1000.0, 34, "", "×10³"), (100.0, 34, "", ""),
                                     (100.0, 34, "y", "×10²"), (1000.0, 39, "", ""), (1e3, 55, "y", "")):  # fmt: skip
        drawn = "".join(Frame(300, 100, (0.0, 1.0), (-reach, reach), left=left, bottom=20).elements([], "", name))
        assert ("×10" in drawn) == bool(power), (reach, left, name)
        assert power in drawn
        bare = Frame(300, 100, (0.0, 1.0), (-reach, reach), left=left, bottom=20)
        assert "×10" not in "".join(bare.elements([], "", name, scale=False))


def test_figures_of_a_page_cut_each_by_its_own_frame() -> None:
    names = set()
    for salt in ("a", "b"):
        figure = Figure(2, 1, (4.0, 4.0), shared=True)
        for ax in figure.axes:
            ax.plot([0.0, 1.0], [0.0, 1.0])
        names |= set(re.findall(r'clipPath id="(\w+)"', svg(figure, salt)))
    assert len(names) == 4
