"""What is drawn, against the numbers that it is drawn from: the place of each tick gives the scale of the drawing."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seatrial.belief.bands.held import GROUPS, Held
from seatrial.belief.bands.manoeuvring import Bands
from seatrial.belief.bands.prediction import Fan
from seatrial.campaign.analysis.sensitivity import Effect, Sensitivity
from seatrial.campaign.analysis.spread import Histogram
from seatrial.core.parameters import Free
from seatrial.data import Trial
from seatrial.report import figures, identifiability, tuning
from seatrial.report.campaign import distribution, rare, shares
from seatrial.report.campaign.shown import Unit
from seatrial.report.canvas.frame import Frame
from seatrial.report.canvas.panels import Axis
from seatrial.report.canvas.ticks import plain, rounded
from seatrial.report.identifiability import band, correlations, restarts, tracks
from seatrial.report.judging import bands as judged
from seatrial.report.judging import coverage, fans, tested
from seatrial.report.page import html
from seatrial.report.report import _marginal
from seatrial.study.grounds import Beyond, Grounds, Plane

LABEL = re.compile(r'<text x="([-\d.]+)" y="([-\d.]+)"[^>]*>([^<]*)</text>')
RECT = re.compile(r'<rect x="([-\d.]+)" y="([-\d.]+)" width="([-\d.]+)" height="([-\d.]+)"')
SKY = figures.SKY


def lines(svg: str) -> list[np.ndarray]:
    """Points of each line or outline of a drawing, shape (points, 2)."""
    found = re.findall(r'points="([^"]*)"', svg)
    return [np.array([[float(v) for v in pair.split(",")] for pair in one.split()]) for one in found]


def axes(svg: str, left: float) -> tuple[Callable[[Any], Any], Callable[[Any], Any]]:
    """Values at places across and up, from the numbers at the ticks: those of the ordinate end left of the axis."""
    numbers = []
    for x, y, said in LABEL.findall(svg):
        try:
            numbers.append((float(x), float(y), float(said.replace("−", "-"))))
        except ValueError:
            continue
    up = np.array([(y - 3.0, value) for x, y, value in numbers if x == left - 4])
    across = np.array([(x, value) for x, y, value in numbers if x != left - 4])
    fits = [np.polyfit(one[:, 0], one[:, 1], 1) for one in (across, up)]
    return tuple(lambda v, fit=fit: np.polyval(fit, v) for fit in fits)  # type: ignore[return-value]


@pytest.mark.parametrize(("low", "high"), [(0.0, 4.0), (-3.0, 17.0), (0.012, 0.019), (-250.0, 1800.0), (0.0, 1.0)])
def test_ticks_are_round_within_the_range_and_told_apart(low: float, high: float) -> None:
    found = rounded(low, high)
    steps = np.diff(found)
    size = steps[0] / 10.0 ** math.floor(math.log10(steps[0]) + 1e-9)
    assert min(abs(size - one) for one in (1.0, 2.0, 5.0)) < 1e-6
    np.testing.assert_allclose(steps, steps[0])
    assert low - 1e-9 <= found[0] < low + steps[0]
    assert high + 1e-9 >= found[-1] > high - steps[0]
    assert 2 <= len(found) <= 5
    said = plain(found)
    assert len(set(said)) == len(found)
    np.testing.assert_allclose([float(one.replace("−", "-")) for one in said], found, atol=0.3 * steps[0])


@pytest.mark.parametrize("ends", [(0.73, 4.99), (-1.34, 1.14), (-4.5, 5.8), (0.0, 1e-4), (11.2, 11.9), (-20.0, 35.0)])
@pytest.mark.parametrize("length", [60.0, 115.0, 400.0])
def test_no_axis_has_fewer_than_two_numbers_however_short_it_is(ends: tuple[float, float], length: float) -> None:
    values = [value for value, _ in Axis(given=ends).marked(length, 45.0)[0]]
    assert len(values) >= 2
    assert min(values) >= ends[0] - 1e-9
    assert max(values) <= ends[1] + 1e-9
    assert len(values) <= max(4, 1 + length / 45.0)


def test_a_line_stands_where_its_ticks_say() -> None:
    frame = Frame(400, 300, (-2.0, 10.0), (1.0, 5.0), left=50, bottom=30)
    svg = frame.svg([frame.line([0.0, 4.0, math.nan, 8.0], [2.0, 3.0, 1.0, 4.0], "#000")], "x", "y")
    across, up = axes(svg, 50)
    (found,) = lines(svg)
    np.testing.assert_allclose(across(found[:, 0]), [0.0, 4.0, 8.0], atol=0.01)
    np.testing.assert_allclose(up(found[:, 1]), [2.0, 3.0, 4.0], atol=0.01)
    for x, y, inside in ((-2.0, 1.0, True), (10.1, 2.0, False), (0.0, 0.9, False), (9.9, 5.0, True), (-2.1, 3, False)):
        assert frame.holds(x, y) == inside
    ((left, top, width, height),) = RECT.findall(frame.span((1.0, 3.0), (2.0, 4.0), "#000"))
    ends = across(float(left)), across(float(left) + float(width)), up(float(top) + float(height)), up(float(top))
    assert ends == pytest.approx((1.0, 3.0, 2.0, 4.0), abs=0.02)
    clipped = frame.points(np.array([99.0, math.nan, 1.0]), np.array([-9.0, 1.0, 2.0]), "#000", 0.0)
    places = re.findall(r"M([-\d.]+) ([-\d.]+)h", clipped)
    told = [(across(float(a)), up(float(b))) for a, b in places]
    np.testing.assert_allclose(told, [(10.0, 1.0), (1.0, 2.0)], atol=0.02)


def test_a_marginal_has_the_draws_as_bars_and_laplace_as_a_line() -> None:
    """The areas of bars and bell are both one, in one scale; the bell is highest at the best value."""
    rng = np.random.default_rng(3)
    values = rng.normal(4.0, 0.5, 5000)
    free = (Free("a", 0.0, 0.0, 1.0), Free("b", 4.0, -9.0, 99.0))
    flat = np.column_stack([rng.random(5000), values])
    found: Any = SimpleNamespace(flat=flat, best=np.array([0.5, 4.2]), laplace=np.diag([0.1, 0.36]), free=free)
    svg = _marginal(found, 1)
    low, high = (float(said.replace("−", "-")) for _, _, said in LABEL.findall(svg))
    assert low == pytest.approx(min(values.min(), 4.2 - 1.8), rel=0.01)
    assert high == pytest.approx(max(values.max(), 4.2 + 1.8), rel=0.01)
    bars = np.array([[float(v) for v in one] for one in RECT.findall(svg)])
    (bell,) = lines(svg)
    bell[:, 1] = bell[:, 1].max() - bell[:, 1]
    scale = (high - low) / np.ptp(bell[:, 0])
    assert low + scale * (bell[np.argmax(bell[:, 1]), 0] - bell[0, 0]) == pytest.approx(4.2, abs=0.05)
    area = float(np.sum(0.5 * (bell[1:, 1] + bell[:-1, 1]) * np.diff(bell[:, 0])))
    assert float((bars[:, 2] * bars[:, 3]).sum()) == pytest.approx(area, rel=0.03)
    middle = low + scale * (bars[:, 0] + 0.5 * bars[:, 2] - bell[0, 0])
    weight = bars[:, 2] * bars[:, 3]
    assert float((middle * weight).sum() / weight.sum()) == pytest.approx(values.mean(), abs=0.03)
    cut = _marginal(found, 0)
    assert [float(said) for _, _, said in LABEL.findall(cut)] == [0.0, 1.0], "cut at the bounds"


def test_a_histogram_of_a_campaign_has_the_shares_of_its_bars() -> None:
    drawn = Histogram(np.array([0.0, 0.1, 0.3]), np.array([[0.75, 0.25], [0.4, 0.6]]), (0.0, 0.0))
    unit = Unit.of("rad")
    svg = distribution(drawn, ("a", "b"), unit, "angle", (0.2, 0.5))
    across, up = axes(svg, 46)
    one, two, bound = lines(svg)
    np.testing.assert_allclose(across(one[:, 0]), np.degrees([0, 0, 0.1, 0.1, 0.3, 0.3]), atol=0.06)
    np.testing.assert_allclose(up(one[:, 1]), [0, 75, 75, 25, 25, 0], atol=0.4)
    np.testing.assert_allclose(up(two[:, 1]), [0, 40, 40, 60, 60, 0], atol=0.4)
    np.testing.assert_allclose(across(bound[:, 0]), np.degrees(0.2), atol=0.06)
    single = distribution(Histogram(drawn.edges, drawn.shares[:1], (0.0,)), ("a",), unit, "angle", ())
    bars = np.array([[float(v) for v in bar] for bar in RECT.findall(single)])
    assert bars[0, 3] / bars[1, 3] == pytest.approx(3.0, rel=0.02)
    assert bars[1, 2] / bars[0, 2] == pytest.approx(2.0, rel=0.02)
    assert 'd="' in svg
    assert "angle [°]" in svg


def test_shares_of_the_inputs_are_bars_with_their_errors_the_largest_first() -> None:
    effects = (Effect("small", 0.1, 0.02, 0.2, 0.03), Effect("large", 0.5, 0.04, 0.75, 0.05),
               Effect("below", -0.05, math.nan, 0.0, math.nan))  # fmt: skip
    svg = shares(Sensitivity("saltelli", 9, 0, effects))
    zero, one = (float(x) for x, _, said in LABEL.findall(svg) if said in ("0", "1"))
    names = [said for _, _, said in LABEL.findall(svg) if said in ("small", "large", "below")]
    assert names == ["large", "small", "below"]
    bars = [(float(x), float(w)) for x, _, w, _ in RECT.findall(svg)]
    assert [w / (one - zero) for _, w in bars] == pytest.approx([0.5, 0.75, 0.1, 0.2, 0.0, 0.0], abs=1e-3)
    assert {x for x, _ in bars} == {zero}
    whiskers = re.findall(r'<line x1="([\d.]+)" x2="([\d.]+)" y1="([\d.]+)" y2="\3" stroke', svg)
    spans = [((float(b) - float(a)) / (one - zero), ((float(a) + float(b)) / 2 - zero) / (one - zero))
             for a, b, _ in whiskers]  # fmt: skip
    np.testing.assert_allclose(spans, [(0.08, 0.5), (0.1, 0.75), (0.04, 0.1), (0.06, 0.2)], atol=2e-3)


def test_bands_about_the_fit_and_tracks_at_equal_scale() -> None:
    t = np.linspace(0.0, 10.0, 50)
    low, high, seen = -0.5 * t, 0.8 * t, 0.3 * t
    svg = band(t, (low, high), seen, "heading")
    across, up = axes(svg, 52)
    outline, zero, measured = lines(svg)
    np.testing.assert_allclose(up(outline[:50, 1]), high, atol=0.1)
    np.testing.assert_allclose(up(outline[50:, 1])[::-1], low, atol=0.1)
    np.testing.assert_allclose(across(outline[:50, 0]), t, atol=0.05)
    np.testing.assert_allclose(up(zero[:, 1]), 0.0, atol=0.1)
    np.testing.assert_allclose(up(measured[:, 1]), seen, atol=0.1)
    best = np.column_stack([30.0 * t, 4.0 * t])
    members = best + np.array([[[5.0, 0.0]], [[-5.0, -20.0]]])
    drawn = tracks(members, best, (best[:, 0], best[:, 1] + 2.0))
    across, up = axes(drawn, 52)
    first, second, fitted, seen_track = lines(drawn)
    for points, wanted in (
        (first, members[0]),
        (second, members[1]),
        (fitted, best),
        (seen_track, best + np.array([0.0, 2.0])),
    ):
        np.testing.assert_allclose(up(points[:, 1]), wanted[:, 0], atol=1.5)
        np.testing.assert_allclose(across(points[:, 0]), wanted[:, 1], atol=1.5)
    # the scale of both axes is the same to the shape of the frame
    assert abs(across(1.0) - across(0.0)) == pytest.approx(abs(up(1.0) - up(0.0)), rel=0.05)


@pytest.mark.parametrize("way", [(300.0, 10.0), (10.0, 300.0), (0.1, 0.2)])
def test_whole_tracks_are_within_their_frame(way: tuple[float, float]) -> None:
    best = np.outer(np.linspace(0.0, 1.0, 30), way)
    (one, fitted) = lines(tracks(best[None] - 1.0, best, None))
    for points in (one, fitted):
        assert points[:, 0].min() >= 52.0
        assert points[:, 0].max() <= 420.0
        assert points[:, 1].min() >= 8.0
        assert points[:, 1].max() <= 400.0 - 36.0


def test_the_curve_of_rare_events_falls_level_by_level_and_ends_within_its_frame() -> None:
    """Two levels, the second within the nearest hundredth of the first."""
    wide = np.linspace(1.0, 10.0, 100)
    near = np.linspace(0.02, 1.0, 50)
    levels = (SimpleNamespace(margins=wide, next_bound=1.0, share=0.01, bound=math.inf, accepted=1.0),
              SimpleNamespace(margins=near, next_bound=0.0, share=0.01, bound=1.0, accepted=0.4))  # fmt: skip
    one: Any = SimpleNamespace(levels=levels, case="a")
    svg = html(rare._curve(one, Unit("m", 1.0)))
    across, up = axes(svg, 46)
    (drawn,) = lines(svg)
    margin, log = across(drawn[:, 0]), up(drawn[:, 1])
    wanted = [math.log10((np.sum(wide <= m + 0.02) / 100) if m > 1.05 else 0.01 * np.sum(near <= m + 0.02) / 50)
              for m in margin]  # fmt: skip
    inner = (margin > 0.2) & (np.abs(margin - 1.0) > 0.2)
    np.testing.assert_allclose(log[inner], np.array(wanted)[inner], atol=0.12)
    assert log.min() == pytest.approx(math.log10(0.01 / 50), abs=0.05)
    axis = re.search(r"V(\d+)H", svg)
    assert axis is not None
    assert drawn[:, 1].max() <= float(axis[1]) + 0.1


def test_ends_of_searches_stand_at_their_share_of_the_box() -> None:
    svg = restarts(("a", "b"), np.array([[0.0, 0.25], [1.0, 0.5]]), (True, False))
    circles = re.findall(r'<circle cx="([\d.]+)" cy="(\d+)" r="4" fill="([^"]+)"', svg)
    left, right = (float(x) for x in re.search(r'<line x1="(\d+)" x2="(\d+)"', svg).groups())  # type: ignore[union-attr]
    share = [(float(x) - left) / (right - left) for x, _, _ in circles]
    assert share == pytest.approx([0.0, 1.0, 0.25, 0.5], abs=1e-3)
    assert [look == "none" for _, _, look in circles] == [False, True, False, True]


def test_correlations_are_written_where_strong() -> None:
    matrix = np.array([[1.0, -0.9, 0.3], [-0.9, 1.0, 0.5], [0.3, 0.5, 1.0]])
    svg = correlations(("a", "b", "c"), matrix)
    assert re.findall(r"<title>([^<]*)</title>", svg) == ["b, a: -0.900", "c, a: +0.300", "c, b: +0.500"]
    said = [words for _, _, words in LABEL.findall(svg) if words[:1] in "+−"]
    assert said == ["−0.90", "+0.50"]
    opacity = [float(x) for x in re.findall(r'opacity="([\d.]+)"', svg)]
    assert opacity == pytest.approx([0.9**1.5, 0.3**1.5, 0.5**1.5], abs=0.006)
    fills = re.findall(r'<rect [^>]*fill="([^"]+)"', svg)
    assert fills[0] != fills[1] == fills[2]


def test_what_is_off_the_track_is_across_the_course_of_the_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    """A fit that goes north-east; members 2 m to either side, the log 1 m to starboard."""
    t = np.linspace(0.0, 10.0, 21)
    north = east = 3.0 * t
    psi = 0.05 * t
    best = np.column_stack([north, east, psi, t * 0, t * 0, t * 0])
    side = np.linspace(-2.0, 2.0, 401)[:, None] / math.sqrt(2.0)
    states = np.repeat(best[None], 401, axis=0)
    states[:, :, 0] -= side
    states[:, :, 1] += side
    off = 1.0 / math.sqrt(2.0)
    trial = Trial("log", t, {"x": north - off, "y": east + off, "psi": psi + 0.02 - 2 * math.pi})
    told: list[Any] = []
    monkeypatch.setattr(identifiability, "band", lambda *given: told.append(given) or "")
    spread = (best[:, 2] - 0.1, best[:, 2] + 0.2)
    one: Any = SimpleNamespace(t=t, best=best, states=states, trial=trial, band=lambda name: spread)
    identifiability._off(one)
    identifiability._heading(one)
    (_, (low, high), seen, _), (_, (port, starboard), heading, _) = told
    np.testing.assert_allclose(low, -1.9, atol=1e-9)
    np.testing.assert_allclose(high, 1.9, atol=1e-9)
    np.testing.assert_allclose(seen, 1.0, atol=1e-9)
    np.testing.assert_allclose(port, math.degrees(-0.1))
    np.testing.assert_allclose(starboard, math.degrees(0.2))
    np.testing.assert_allclose(np.mod(heading, 360.0), math.degrees(0.02))


@pytest.fixture
def kept(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Figures as they are handed on."""
    found: list[Any] = []
    monkeypatch.setattr(figures, "svg", lambda drawn, name: found.append(drawn) or "")
    return found


@pytest.mark.slow
def test_pages_of_coverage_draw_shares_of_the_samples_and_novelty(kept: list[Any]) -> None:
    train, trial = np.radians([0.0, 1.0, 2.0, 3.0, math.nan, 10.0]), np.radians([20.0, 0.0])
    coverage.histogram("delta", train, trial)
    (ax,) = kept[0].axes
    (x, filled), outline = ax.areas[0].parts[0], ax.lines[0]
    edges = x[::2]
    assert (ax.areas[0].label, outline.label) == ("training", "trials")
    assert (edges[0], edges[-1]) == pytest.approx((0.0, 20.0))
    assert filled[1:-1:2].sum() == pytest.approx(100.0)
    for share, pool, each in ((filled, [0, 1, 2, 3, 10], 20.0), (outline.y, [20, 0], 50.0)):
        assert (share[0], share[-1]) == (0.0, 0.0), "an area stands on the axis"
        np.testing.assert_allclose(share[1:-1], np.repeat(np.histogram(pool, edges)[0] * each, 2))
    t = np.arange(1500.0)
    found: Any = SimpleNamespace(name="x", t=t, novelty=0.001 * t, share=0.3)
    coverage.novelty(found)
    line = kept[1].axes[0].lines[0]
    np.testing.assert_allclose(line.y, 0.001 * line.x)
    assert 300 <= len(line.x) <= 600
    assert line.x[-1] > 1490
    top = kept[1].axes[0].y.ends
    assert top[0] == 0.0
    assert top[1] > 1.499


@pytest.mark.slow
def test_bands_of_a_manoeuvre_are_the_quantiles_of_its_draws(kept: list[Any]) -> None:
    t = np.arange(0.0, 30.0)
    scale, still = np.linspace(0.0, 1.0, 201)[:, None], 0.0 * t
    speeds = (1.0 + scale + still, 0.1 * scale + still, 0.02 * scale + still)
    columns = [scale * t, 2.0 * t + scale, 0.01 * scale * t, *speeds]
    found = Bands(t, np.stack(columns, axis=2), {}, np.full(201, np.nan))
    middle = (0.5 * t, 2.0 * t, 0.005 * t, 1.5 + still, 0.05 + still, 0.01 + still)
    run = Trial("run", t, dict(zip(("x", "y", "psi", "u", "v_m", "r"), middle, strict=True)))
    judged._motion(found, 0.9, run)
    degree = math.degrees(1.0)
    for ax, name, factor, top in zip(kept[0].axes, ("psi", "u", "v_m", "r"), (degree, 1.0, 1.0, degree),
                                     (0.01 * 29, 1.0, 0.1, 0.02), strict=True):  # fmt: skip
        np.testing.assert_allclose(ax.lines[0].y, factor * run[name])
        corners = np.column_stack(ax.areas[0].parts[0])
        last = corners[np.isclose(corners[:, 0], 29.0), 1]
        base = 1.0 if name == "u" else 0.0
        assert last.min() == pytest.approx(factor * (base + 0.05 * top), rel=1e-6)
        assert last.max() == pytest.approx(factor * (base + 0.95 * top), rel=1e-6)
    judged._fan(found, 0.9, run)
    (ax,) = kept[1].axes
    np.testing.assert_allclose(ax.lines[0].y, found.tracks[0, :, 0])
    np.testing.assert_allclose(ax.lines[59].y, found.tracks[-1, :, 0])
    np.testing.assert_allclose(ax.lines[59].x, found.tracks[-1, :, 1])
    np.testing.assert_allclose(ax.lines[60].x, run["y"])


@pytest.mark.parametrize(
    ("name", "ends", "words"),
    [
        ("delta", (-math.radians(20.0), math.radians(20.0)), "rudder −20.0 to 20.0 °"),
        ("u", (1.0, 1.0), "surge speed 1.00 m/s"),
        ("depth", (math.inf, math.inf), "depth deep"), ("r", (0.0, math.radians(0.5)), "rate of turn 0 to 0.500 °/s"),
        ("n_bow", (2.0, 4.0), "n_bow 2.00 to 4.00 1/s"), ("alpha_1", (0.0, math.pi), "alpha_1 0 to 180 °"),
    ],
)  # fmt: skip
def test_ranges_are_told_in_the_units_of_people(name: str, ends: tuple[float, float], words: str) -> None:
    assert tested.span(name, ends) == words
    told = tested.reach(Beyond(name, ends, ends))
    assert told.startswith(words.split(" to ")[0].rstrip("°").rstrip())
    assert "(trials: " in told


def test_what_was_not_tested_together_is_told_with_what_it_stood_beside() -> None:
    one = Beyond("r", (0.0, math.radians(0.5)), (math.radians(2.0),) * 2, (("u", 7.5),))
    assert tested.reached([one]) == "rate of turn 2.00 °/s (trials: 0 to 0.500 there) at surge speed 7.50 m/s"


def test_planes_are_drawn_with_their_hull_inside_the_box_of_ranges(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[Any] = []
    monkeypatch.setattr(tested.figures, "svg", lambda figure, name: drawn.append(figure) or "drawn")
    ranges = {"u": (0.0, 2.0), "r": (-0.1, 0.1), "delta": (-0.5, 0.5), "n_P": (1.0, 2.0)}
    diamond = ((0.0, 0.0), (1.0, -0.1), (2.0, 0.0), (1.0, 0.1))
    flat = ((1.0, 0.0), (2.0, 0.0))
    planes = (Plane("delta", "n_P", flat), Plane("r", "delta", diamond), Plane("u", "r", diamond))
    found = Grounds(covered=ranges, tested=planes)
    assert tested.picture(found) == "drawn"
    first = drawn[0].axes[0]
    assert (first.x.name, first.y.name) == ("surge speed [m/s]", "rate of turn [°/s]"), "motion comes first"
    hull, box = (np.column_stack([line.x, line.y]) for line in first.lines)
    np.testing.assert_allclose(hull, [[x, math.degrees(y)] for x, y in (*diamond, diamond[0])])
    assert (box[:, 0].min(), box[:, 0].max()) == (0.0, 2.0)
    assert box[:, 1].max() == pytest.approx(math.degrees(0.1))
    assert tested.picture(Grounds(covered=ranges)) == ""


@pytest.mark.slow
def test_a_fan_is_drawn_about_the_prediction_with_a_gap_at_each_restart(kept: list[Any]) -> None:
    t = np.arange(0.0, 40.0)
    names = ("x", "y", "psi", "u", "v_m", "r")
    predicted = Trial("run", t, {name: (k + 1.0) * 0.1 + 0.01 * t for k, name in enumerate(names)})
    half = np.tile(0.05 * np.arange(1.0, 7.0), (40, 1))
    made = Fan(predicted, np.mod(t, 20.0), half, 0.95, "turning", ())
    measured = predicted.having(psi=predicted["psi"] + 0.02 - 2.0 * math.pi, u=predicted["u"] + 0.03)
    fans.fan(made, measured)
    degree = math.degrees(1.0)
    off = {"psi": 0.02, "u": 0.03}
    for ax, name in zip(kept[0].axes, ("x", "y", "psi", "u", "v_m", "r"), strict=True):
        factor, k = (degree if name in ("psi", "r") else 1.0), names.index(name)
        middle, seen = ax.lines[0].y, ax.lines[1].y
        assert np.flatnonzero(np.isnan(middle)).tolist() == [0, 20]
        np.testing.assert_allclose(middle[1:20], factor * predicted[name][1:20])
        np.testing.assert_allclose(seen, factor * (predicted[name] + off.get(name, 0.0)))
        heights = np.concatenate([np.column_stack(part) for part in ax.areas[0].parts])
        last = heights[np.isclose(heights[:, 0], 39.0), 1]
        assert np.ptp(last) == pytest.approx(2.0 * factor * half[0, k])
        assert 0.5 * (last.min() + last.max()) == pytest.approx(factor * predicted[name][39])
    assert [ax.x.name for ax in kept[0].axes][-1] == "time t [s]"


def test_widths_of_bands_are_told_in_degrees_and_shares_in_percent() -> None:
    groups = {name: 0.5 + 0.1 * k for k, name in enumerate(GROUPS)}
    width = dict(zip(("x", "y", "psi", "u", "v_m", "r"), (11.0, 12.0, math.radians(3.0), 0.4, 0.5, math.radians(0.6)),
                     strict=True))  # fmt: skip
    row = Held("turning", 60.0, 12, 3, groups, dict.fromkeys(groups, (0.21, 0.89)), width, width)
    cells = re.findall(r"<td[^>]*>([^<]*)</td>", html(fans.held_table([row])))
    assert cells[0] == "turning"
    assert [float(cell) for cell in cells[1:3]] == [60.0, 12.0]
    shares = [float(cell.removesuffix(" % (21–89)")) for cell in cells[3 : 3 + len(groups)]]
    assert shares == pytest.approx([100.0 * share for share in groups.values()])
    assert [float(cell) for cell in cells[3 + len(groups) :]] == pytest.approx([11.0, 12.0, 3.0, 0.4, 0.5, 0.6])
    assert fans.words([row], 0.9) == (
        "bands of 90 % held at least in 50 % (21–89) at 60 s (turning); that is less often than they say")  # fmt: skip
    assert not fans.words([row], 0.85).endswith("say")


def test_tracks_of_a_tuning_lie_north_over_east_each_in_its_colour() -> None:
    """At equal scale; the untuned model is grey, and no line is drawn of what was not predicted."""
    t = np.arange(5.0)
    zero = dict.fromkeys(("psi", "v_m", "r", "delta"), 0.0 * t)
    measured = Trial("a", t, {**zero, "x": 10.0 * t, "y": 0.0 * t, "u": 1.0 + zero["r"]}, {}, {"L_pp": 7.0})
    ways = {"10 %": 2.0, tuning.UNTUNED: -3.0}

    def drawn(*names: str) -> dict[str, np.ndarray]:
        svg = tuning.tracks(measured, {name: measured.having(y=ways[name] * t) for name in names})
        found = re.findall(r'<path d="M([-\d. l]+)" fill="none" stroke="(#\w+)" stroke-width="1.3"', svg)
        return {colour: np.array([float(v) for v in re.findall(r"-?[\d.]+", path)]).reshape(-1, 2)[1:].sum(axis=0)
                for path, colour in found if path.count(" ") > 4}  # a legend's have two points

    found = drawn("10 %", tuning.UNTUNED)
    assert set(found) == {figures.LINES[0][0], figures.GREY}
    for name, colour in (("10 %", figures.LINES[0][0]), (tuning.UNTUNED, figures.GREY)):
        across, down = found[colour]
        assert across / -down == pytest.approx(4.0 * ways[name] / 40.0, abs=5e-3)
    assert set(drawn(tuning.UNTUNED)) == {figures.GREY}
    told = tuning.tracks(measured, dict.fromkeys(ways, measured))
    line = r'stroke="(#\w+)" stroke-width="1.3" stroke-linejoin="round"(?: stroke-dasharray="([^"]*)")?/>'
    dashes = dict(re.findall(line, told))
    assert dashes[figures.LINES[0][0]] == ""
    assert [float(one) for one in dashes[figures.GREY].split()] == pytest.approx([1.3, 1.95])  # 1 and 1.5 widths
