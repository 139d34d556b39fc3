"""Pages of fits: profiles, draws, tunings, rivals and tables of fits, against the numbers that they are made of."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from example_report import fit
from seatrial.core.parameters import Free
from seatrial.data import Trial
from seatrial.identify import Verdict
from seatrial.identify.diagnosis.blame.contradiction import Contradiction
from seatrial.identify.diagnosis.channels import Channel, Residuals
from seatrial.identify.diagnosis.findings import Diagnosis, Suspicion
from seatrial.identify.posterior.misfit import Misfit, Remainder
from seatrial.identify.posterior.profile import Profile
from seatrial.report import diagnosis, figures, identifiability, rivals, trials
from seatrial.report import tuning as tunings
from seatrial.report.report import posterior
from seatrial.report.series import judged
from seatrial.workflow.reports import leads
from shown import html, items, series, tables, words
from summaries import summary_of

DEG = math.radians(1.0)
LABEL = re.compile(r'<text x="([-\d.]+)" y="([-\d.]+)"[^>]*>([^<]*)</text>')


def places(svg: str) -> list[tuple[float, float]]:
    return [(float(a), float(b)) for a, b in re.findall(r'<circle cx="([-\d.]+)" cy="([-\d.]+)"', svg)]


# Diagnosis


def channel(**changes: Any) -> Channel:
    given = {"noise": 0.5, "size": 1.0, "alike": 0.0, "alike_sigma": 0.01, "lasting": 1.0, "count": 100}
    return Channel(**{**given, **changes})


OFFSET = Suspicion("offset.delta", "an offset of delta", "deg", DEG, 900.0, 0.8, 1.5 * DEG, 1e-4, {"p": 2.0,
    "q": -13.0})
ODD = Contradiction("a", 80.0, 3, 6.0, 2.0, 0.9, {"p": 2.0})


def with_diagnosis(**given: Any) -> Any:
    return replace(fit(), diagnosis=Diagnosis(**given))


def test_the_first_lines_count_what_is_identified_and_name_what_is_not() -> None:
    free = tuple(Free(f"h.{k}", 1.0) for k in range(6))
    told = (Verdict("h.0", "identified", ""), *(Verdict(f"h.{k}", "weak", "") for k in range(1, 6)),
            *(Verdict(f"h.0 and h.{k}", "weak", "") for k in range(1, 5)))  # fmt: skip
    one = replace(fit(), free=free, verdicts=told, diagnosis=Diagnosis({"x": channel(size=1.1),
        "u": channel(size=1.2)}))
    said = words(diagnosis.verdict(one))
    assert "1 of 6 parameters are identified" in said
    assert "Do not read as physics: h.1, h.2, h.3 and 2 more; their verdicts" in said
    assert "Only a combination is determined of: h.0 and h.1; h.0 and h.2; h.0 and h.3; ...." in said
    assert "Residuals are at most 1.2 times the sensor noise" in said
    three = replace(one, verdicts=(*told[:4], *told[6:9]))
    assert "more; their" not in words(diagnosis.verdict(three))
    assert "; ..." not in words(diagnosis.verdict(three))
    clear = replace(one, verdicts=told[:1])
    assert "Do not read" not in words(diagnosis.verdict(clear))


@pytest.mark.parametrize(("given", "there", "not_there"), [
    ({"suspicions": (OFFSET,)}, "The likeliest cause: an offset of delta of 1.5 ± 0.006 deg would remove 80%",
     "Look for a term"),
    ({"suspicions": (replace(OFFSET, share=0.19),)},
     "Suspect: an offset of delta of 1.5 ± 0.006 deg would remove 19%", "likeliest"),
    ({"suspicions": (replace(OFFSET, share=0.19),)}, "Look for a term", "likeliest"),
    ({"suspicions": (replace(OFFSET, share=0.21),)}, "The likeliest cause", "Look for a term"),
    ({"suspicions": (replace(OFFSET, whole=True),)}, "Change it in the mapping file of the log",
        "Correct the log"),
    ({"channels": {"x": channel(size=3.0)}}, "Look for a term of the model", "Correct the log"),
    ({"channels": {"x": channel(size=3.0)}, "widened": {"p": 1.05}}, "No parameter counts as identified. ",
        "white noise"),
    ({"channels": {"x": channel(size=3.0)}, "widened": {"p": 1.15, "q": 1.5}}, "sigma is up to 1.5 times",
        "correlated"),
    ({"channels": {"x": channel(size=3.0), "u": channel(size=4.0), "r": channel(size=1.2, alike=0.7)}},
     "up to 4.0 times the sensor noise (of u) and correlated (0.70 from one to the next of r).", "of x"),
    ({"channels": {"x": channel(size=3.0)}, "contradictions": (ODD,)},
     "The likeliest cause: trial a contradicts the others", "each other"),
    ({"contradictions": (replace(ODD, removes=0.2), replace(ODD, trial="b", removes=0.1))},
     "trials contradict each other, the first of them most: a, b.", "trial a contradicts"),
    ({"terms": (replace(OFFSET, drop=1.0), replace(OFFSET, words="an error of m"))},
        "The likeliest cause: an error of m of 1.5 ±", "an offset"),
])  # fmt: skip
def test_the_first_lines_of_a_fit_that_lacks_something(given: Any, there: str, not_there: str) -> None:
    one = with_diagnosis(**given)
    said = words(diagnosis.verdict(one))
    assert there in said
    assert not_there not in said
    (told,) = leads({"diagnosis": one.diagnosis.numbers()}, Path("run"), True)
    if named := one.diagnosis.cause:
        assert told.startswith(f"not explained: {named.text.partition(';')[0]}")
        assert f"The likeliest cause: {named.text}".replace("+-", "±") in said


def test_the_section_lists_channels_trials_suspects_and_fixed_numbers() -> None:
    t = np.arange(4.0)
    values = {"a": ([1.0, -1.0, 1.0, math.nan], [3.0] * 4), "b": ([2.0, 2.0, 2.0, 2.0], [4.0] * 4)}
    left = {name: Residuals(t, {"x": np.array(x), "r": np.array(r)}, 0.1 * t) for name, (x, r) in values.items()}
    small = replace(OFFSET, name="bias.u", words="a bias of u", drop=3.0, share=0.01, moves={})
    found = Diagnosis(
        {"x": channel(size=1.2345, alike=0.126, count=7), "r": channel(noise=0.02 * DEG, size=2.0, alike=0.9)},
            (OFFSET, small),
        {"a": {"x": 2, "r": 1}}, (OFFSET,), left, ("delta", "rad"),
        fixed=(("body.m", "p", -2.0), ("body.d", "q", 0.099), ("body.e", "q", 0.11)), shares={"body.m": 0.05},
        carried={"p": 0.05, "q": 0.25},
    )  # fmt: skip
    body = diagnosis.section(replace(fit(), diagnosis=found))
    channels, by_trial, suspects, fixed = tables(body)
    assert channels[1] == ["x", "0.50 m", "1.23", "0.13", "7", ""]
    assert channels[2] == ["r", "0.020°/s", "2.00", "0.90", "100", "size, correlation"]
    assert by_trial == [["trial, residual over noise", "x", "r"], ["b", "2.0", "4.0"], ["a", "1.0", "3.0"]]
    assert suspects[1:] == [["*offset.delta", "an offset of delta", "1.5 ± 0.006 deg", "900", "80 %", "q −13.0"],
                            ["bias.u", "a bias of u", "1.5 ± 0.006 deg", "3.00", "1.0 %", "–"]]  # fmt: skip
    assert fixed[1:] == [["body.m", "5.0 %", "p", "−2.0"], ["body.e", "10 %", "q", "+0.1"]]
    assert "leave q uncertain by a further 0.25 times its sigma" in words(body)
    assert items(body) == ["a: outliers left out: 2 of x, 1 of r", "estimated: an offset of delta of 1.5 ± 0.006 deg"]
    less = replace(found, carried={"p": 0.05, "q": 0.099}, fixed=found.fixed[1:2])
    assert "fixed parameter" not in words(diagnosis.section(replace(fit(), diagnosis=less)))
    many = {str(k): Residuals(t, {"x": np.full(4, float(k))}, t) for k in range(10)}
    (rows,) = tables(diagnosis._by_trial(Diagnosis({"x": channel()}, residuals=many)))
    assert rows[0][0] == "the worst 8 of 10 trials"
    assert [row[0] for row in rows[1:]] == [str(k) for k in range(9, 1, -1)]
    assert diagnosis._by_trial(Diagnosis({"x": channel()}, residuals={"0": many["0"]})) == ()


def test_axes_of_residuals_end_at_the_next_round_number() -> None:
    for reach, end in ((1.0, 4.0), (4.0, 4.0), (4.1, 5.0), (7.0, 8.0), (9.0, 10.0), (11.0, 15.0), (160.0, 200.0)):
        assert diagnosis._round(reach) == pytest.approx(end)


def span_of(svg: str) -> np.ndarray:
    found = re.findall(r'<rect x="([-\d.]+)" y="([-\d.]+)" width="([-\d.]+)" height="([-\d.]+)"', svg)
    return np.array([[float(v) for v in one] for one in found])


def polylines(svg: str) -> list[np.ndarray]:
    found = re.findall(r'<polyline points="([^"]*)"', svg)
    return [np.array([[float(v) for v in pair.split(",")] for pair in one.split()]) for one in found]


def test_panels_of_a_channel_stand_side_by_side_below_its_title() -> None:
    """Four panels of 390, 190, 190 and 270 pixels by 118, a title of 16 above them."""
    run = Residuals(np.arange(9.0), {"x": np.ones(9), "u": -np.ones(9)}, np.zeros(9))
    found = Diagnosis({"x": channel(), "u": channel()}, residuals={"a": run}, control=("delta", "rad"))
    drawn = diagnosis.drawing(found)
    places = [(float(a), float(b)) for a, b in re.findall(r'<g transform="translate\(([\d.]+) ([\d.]+)\)">', drawn)]
    assert places[:5] == [(0.0, 0.0), (0.0, 16.0), (390.0, 16.0), (580.0, 16.0), (770.0, 16.0)]
    assert places[5:10] == [(a, b + 134.0) for a, b in places[:5]]
    assert 'viewBox="0 0 1040 284"' in drawn


def test_correlations_of_residuals_are_sums_of_products_over_the_lag() -> None:
    rng = np.random.default_rng(0)
    parts = [rng.normal(size=60), rng.normal(size=80)]
    parts[0][5] = math.nan
    kept = [np.nan_to_num(p) for p in parts]
    total = sum(float(p @ p) for p in kept)
    wanted = [sum(float(p[k:] @ p[:-k]) for p in kept) / total for k in range(1, 21)]
    drawn = "".join(diagnosis._correlation(parts, 0.5, True))
    frame = diagnosis._frame(2, (0.0, 10.25), (min(-0.25, *wanted), 1.0))
    zero, *bars = polylines(drawn)
    assert len(bars) == 20
    for k, (bar, value) in enumerate(zip(bars, wanted, strict=True), start=1):
        np.testing.assert_allclose(bar, [frame.at(0.5 * k, 0.0), frame.at(0.5 * k, value)], atol=0.06)
    assert zero[0][1] == zero[1][1]
    (white,) = span_of(drawn)
    top, low = frame.at(0.0, 2.0 / math.sqrt(140))[1], frame.at(0.0, -2.0 / math.sqrt(140))[1]
    assert (white[1], white[3]) == pytest.approx((top, low - top), abs=0.11)


def test_residuals_stand_over_the_control_with_the_means_of_twelfths() -> None:
    control = np.linspace(-10.0, 10.0, 120) * DEG
    values = 0.1 * control / DEG + 0.5
    drawn = "".join(diagnosis._against_control(control[::-1], values[::-1], 4.0, ("delta", "rad"), True))
    frame = diagnosis._frame(3, (-10.8, 10.8), (-4.0, 4.0))
    means = polylines(drawn)[-1]
    x = np.array_split(control / DEG, 12)
    np.testing.assert_allclose(means, [frame.at(p.mean(), 0.1 * p.mean() + 0.5) for p in x], atol=0.06)
    assert "delta [°]: − port, + starboard" in drawn
    plain = "".join(diagnosis._against_control(np.ones(5), np.ones(5), 4.0, ("n_P", "1/s"), True))
    assert "n_P [1/s]<" in plain
    assert "nan" not in plain


def test_trials_stand_end_to_end_and_every_other_is_shaded() -> None:
    runs = [Residuals(np.arange(n) * 2.0, {}, np.zeros(n)) for n in (5, 10, 20)]
    values = np.concatenate([np.full(n, float(k)) for k, n in enumerate((5, 10, 20))])
    drawn = "".join(diagnosis._over_time(runs, values, 4.0, True))
    frame = diagnosis._frame(0, (0.0, 70.0), (-4.0, 4.0))
    shade = span_of(drawn)[0]
    assert (shade[0], shade[2]) == pytest.approx((frame.at(10.0, 0)[0], frame.at(30.0, 0)[0] - frame.at(10.0, 0)[0]),
        abs=0.11)
    dots = [(float(a), float(b)) for a, b in re.findall(r"M([-\d.]+) ([-\d.]+)h2", drawn)]
    assert len(dots) == 35
    assert dots[6] == pytest.approx(tuple(v - 1.0 for v in frame.at(12.0, 1.0)), abs=0.06)


def test_the_distribution_of_residuals_is_over_its_peak() -> None:
    values = np.concatenate([np.zeros(40), np.full(10, 2.0), [99.0], [math.nan]])
    drawn = "".join(diagnosis._distribution(values, 4.0, True))
    bars, frame = span_of(drawn), diagnosis._frame(1, (-4.0, 4.0), (0.0, 1.08))
    assert len(bars) == 3
    heights = bars[:, 3] / (frame.height / 1.08)
    assert heights == pytest.approx([1.0, 0.25, 1.0 / 40.0], abs=2e-3)
    bell = polylines(drawn)[-1]
    middle = bell[np.argmin(bell[:, 1])]
    assert tuple(middle) == pytest.approx(frame.at(0.0, 1.0), abs=0.06)
    one = bell[np.argmin(np.abs(bell[:, 0] - frame.at(1.2, 0)[0]))]
    assert one[1] == pytest.approx(frame.at(0, math.exp(-0.5 * 1.2**2))[1], abs=0.3)


# Identifiability


def profiled(path: str, best: float, **changes: Any) -> Profile:
    values = np.linspace(best - 2.0, best + 2.0, 9)
    given = {"free": Free(path, best, -10.0, 10.0), "best": best, "low": -10.0, "high": 10.0, "values": values,
             "rise": 4.0 * (values - best) ** 2, "others": np.zeros((9, 1)), "interval": (best - 0.98, best + 0.98),
             "closed": (True, True)}  # fmt: skip
    return Profile(**{**given, **changes})


def known(*profiles: Profile, **changes: Any) -> Any:
    told = (*(p.verdict for p in profiles), Verdict("a and b", "weak", "they trade off"))
    n = len(profiles)
    return SimpleNamespace(**{"profiles": profiles, "correlation": np.eye(n), "better": 0.05, "independent": 123.4,
                              "verdicts": told, **changes})  # fmt: skip


def test_profiles_are_rows_with_their_interval_and_share() -> None:
    two = profiled("a", 1.0), profiled("b", 2.0, interval=(-9.0, 9.0))
    body = identifiability.sections(fit(), known(*two))[0].html
    (rows,) = tables(body)
    assert rows[1][:6] == ["a", "1.000", "0.02000", "1.980", "9.8 %", "identified"]
    assert rows[2][:6] == ["b", "2.000", "−9.000", "9.000", "90 %", "weak"]
    assert "1 identified, 1 weak. A profile holds" in words(body)
    assert "count as 123 independent ones" in words(body)
    assert items(body) == ["a and b: they trade off"]
    assert "found an objective lower" not in body
    assert "lower than the fit by 0.11 units" in words(identifiability.sections(fit(), known(*two,
        better=0.11))[0].html)


def test_a_profile_is_drawn_with_its_limit_interval_and_steps() -> None:
    one = profiled("a", 1.0, low=-1.0, high=3.0)
    assert one.share > 0.2
    svg = identifiability.profile(one)
    frame = identifiability.Frame(300, 170, (-1.0, 3.0), (0.0, 4.0 * identifiability.THRESHOLD), left=34, bottom=30)
    limit, curve = polylines(svg)
    np.testing.assert_allclose(limit, [frame.at(x, identifiability.THRESHOLD) for x in (-1.0, 3.0)], atol=0.06)
    rect = next(r for r in span_of(svg) if r[3] == frame.height)
    assert (rect[0], rect[0] + rect[2]) == pytest.approx((frame.at(0.02, 0)[0], frame.at(1.98, 0)[0]), abs=0.11)
    wanted = [frame.at(v, r) for v, r in zip(one.values, one.rise, strict=True) if r <= 4.0 * identifiability.THRESHOLD]
    np.testing.assert_allclose(places(svg)[:-1], wanted, atol=0.06)
    assert places(svg)[-1] == pytest.approx(frame.at(1.0, 0.0), abs=0.06)
    x = (curve[:, 0] - frame.left) / frame.width * 4.0 - 1.0
    y = np.array([frame.at(v, 4.0 * (v - 1.0) ** 2)[1] for v in x])
    np.testing.assert_allclose(curve[:, 1], y, atol=0.5)
    narrow = profiled("a", 1.0, values=np.linspace(0.9, 1.1, 9), interval=(0.95, 1.02))
    assert narrow.share < 0.2
    labels = [float(s.replace("−", "-")) for x, y, s in LABEL.findall(identifiability.profile(narrow)) if float(y) > 145
              and s[:1] in "−0123456789"]  # fmt: skip
    assert min(labels) >= 1.0 - 0.075 - 1e-9
    assert max(labels) <= 1.0 + 0.075 + 1e-9


def test_ends_of_searches_count_those_at_the_best_objective() -> None:
    ends = np.array([[4.0, -0.3, 0.5], [4.0 + 2e-6, -0.2, 0.5], [4.1, -0.5, 0.5], [math.inf, 0.0, 0.5]])
    one = replace(fit(), ends=ends)
    body = html(identifiability._restarts(one))
    assert "2 of 3 searches ended at the best objective (to 1e-06); among these" in words(body)
    assert "a parameter moves by up to 0.20 of its range" in words(body)
    box = re.search(r'<line x1="(\d+)" x2="(\d+)"', body)
    assert box is not None
    left, right = float(box[1]), float(box[2])
    assert [(x - left) / (right - left) for x, _ in places(body)] == pytest.approx([0.4, 0.6, 0.0], abs=1e-3)
    free = (replace(fit().free[1]),)
    assert "No search has a box" in words(identifiability._restarts(replace(one, free=free, ends=ends[:, [0, 2]])))


def test_residuals_beside_profiles_are_rows() -> None:
    left = Misfit((Remainder("x", 1.123, 0.056, -1.25, 321),))
    body = html(identifiability._residuals(left))
    assert tables(body)[0][1] == ["x", "1.12", "0.056", "−1.2", "321"]
    assert body.startswith("<p>")


def test_indices_of_an_ensemble_have_their_width_in_percent() -> None:
    given: Any = SimpleNamespace(
        indices={"transfer": 0, "advance": 0, "odd": 0}, interval=lambda name: (9.0,
            11.5) if name == "advance" else (1.0, 2.0),
        fitted={"advance": -10.0, "transfer": 0.0}, measured={"advance": 10.25}, units={"advance": "m",
            "transfer": "m"},
        trial=SimpleNamespace(name="t"),
    )  # fmt: skip
    assert identifiability._index_rows(given) == [
        ["t", "advance", "m", "−10.00", "9.000", "11.50", "25", "10.25"],
        ["t", "transfer", "m", "0", "1.000", "2.000", "–", "–"],
    ]


# Draws


def test_marginals_are_rows_and_the_farthest_are_drawn() -> None:
    rng = np.random.default_rng(0)
    count = 26
    draws = rng.normal(size=(20, 2, count))
    shift = np.zeros(count)
    shift[[3, 20]] = 2.0, -5.0
    ratio = np.ones(count)
    ratio[7] = math.exp(-3.0)
    found: Any = SimpleNamespace(
        paths=tuple(f"p{k}" for k in range(count)), shift=shift, ratio=ratio, best=np.arange(count) * 1.0,
        mean=np.arange(count) + 0.5, sigma=np.full(count, 0.25), interval=np.array([np.zeros(count), np.ones(count)]),
        rhat=np.full(count, 1.0042), effective=np.full(count, 432.4), words=("first", "second"), calls=9, draws=draws,
        flat=draws.reshape(-1, count), laplace=np.eye(count), free=tuple(Free(f"p{k}", 0.0) for k in range(count)),
        seconds=2.0, variance=1.5,
    )  # fmt: skip
    body = posterior(found).html
    (rows,) = tables(body)
    assert rows[4] == ["p3", "3.000", "3.500", "0.25", "0 … 1.00", "2.0", "1.00", "1.004", "432"]
    captions = re.findall(r"<figcaption>([^<]*)<", body)
    assert captions[:3] == ["p20", "p7", "p3"]
    assert len(captions) == 24
    assert "The 24 parameters that differ most." in body
    said = words(body)
    assert "9 evaluations of each of 2 chains, 2.00 s of CPU time; squared residuals are divided by 1.50." in said
    assert items(body) == ["second"]


def test_bars_of_a_marginal_and_the_gaussian_beside_them_have_one_area() -> None:
    """Both are densities over one axis: where the draws are Laplace's, bars and bell enclose the same area."""
    draws = np.random.default_rng(1).normal(size=(2000, 2, 1))
    found: Any = SimpleNamespace(
        paths=("p",), shift=np.zeros(1), ratio=np.ones(1), best=np.zeros(1), mean=np.zeros(1), sigma=np.ones(1),
        interval=np.array([[-2.0], [2.0]]), rhat=np.ones(1), effective=np.full(1, 4000.0), words=("first",), calls=9,
        draws=draws, flat=draws.reshape(-1, 1), laplace=np.eye(1), free=(Free("p", 0.0),), seconds=2.0, variance=1.0,
    )  # fmt: skip
    body = posterior(found).html
    bars = re.findall(r'<rect x="[^"]*" y="[^"]*" width="([^"]*)" height="([^"]*)"', body)
    (line,) = re.findall(r'<polyline points="([^"]*)"', body)
    x, y = np.array([[float(v) for v in pair.split(",")] for pair in line.split()]).T
    area = sum(float(width) * float(height) for width, height in bars)
    assert area == pytest.approx(np.trapezoid(y.max() - y, x), rel=0.03)


# Tunings


def method(objective: float, seconds: float, ends: Any) -> Any:
    history = np.array([[1.0, 9.0, 0, 0], [2.0, 5.0, 0, 0], [3.0, 6.0, 0, 0]])
    return SimpleNamespace(objective=objective, evaluations=7, seconds=seconds, ends=np.array(ends), history=history)


@pytest.mark.slow
def test_both_methods_of_a_tuning_stand_side_by_side() -> None:
    one = SimpleNamespace(ratio=0.4, apart=0.01, kept="gradient", methods={
        "evolution": method(2.0, 3.0, [[2.0], [2.1], [2.0 + 1e-4]]), "gradient": method(1.5, 4.0, [[1.5], [1.5]])})
    given: Any = SimpleNamespace(ranges=(one,), best=one, agreement=1e-4)
    body = tunings._methods(given)
    assert tables(body)[0][1] == ["0.4", "2.00000", "1.50000", "0.010", "gradient", "7", "7", "3.00", "4.00",
        "2 of 3", "2 of 2"]
    drawn = series(tunings.search(one.methods["evolution"], "x"))
    above, below = (drawn[key] for key in drawn)
    np.testing.assert_allclose(above, [[1, 9], [2, 5], [3, 6]])
    np.testing.assert_allclose(below[:, 1], [4.0, 5e-14, 1.0], rtol=1e-4)


def swept(ratio: float, tune: float, test: float, out: float, soft: float) -> Any:
    return SimpleNamespace(ratio=ratio, tune={"a": tune, "b": 1.0}, test={"c": test}, left_out={"a": out, "b": 2.0},
                           soft_tune={"a": soft}, soft_test={"c": 2 * soft}, soft_left_out={"a": 3 * soft}, at_bound=())


@pytest.mark.slow
def test_losses_over_the_range_are_sums_over_the_trials() -> None:
    sweep = (swept(0.2, 10.0, 5.0, 20.0, 7.0), swept(0.4, 8.0, 6.0, 15.0, 9.0))
    problem = SimpleNamespace(trials=(SimpleNamespace(name="a"), SimpleNamespace(name="b")))
    given: Any = SimpleNamespace(ranges=sweep, best=sweep[1], tests=("c",), untuned_tune={"a": 30.0, "b": 3.0},
                                 untuned_test={"c": 12.0}, problem=problem)  # fmt: skip
    drawn = {(panel.split(" over")[0], name): points[:, 1].tolist() for (panel, name), points in
             series(tunings.objectives(given)).items() if len(points)}  # fmt: skip
    assert drawn["J, tuning trials", "box"] == [11.0, 9.0]
    assert drawn["J, tuning trials", "each left out, box"] == [22.0, 17.0]
    assert drawn["J, tuning trials", "soft"] == [7.0, 9.0]
    assert drawn["J, tuning trials", "each left out, soft"] == [21.0, 27.0]
    assert drawn["J, test trials", "box"] == [5.0, 6.0]
    assert drawn["J, test trials", "soft"] == [14.0, 18.0]
    assert drawn["J, tuning trials", "untuned"] == [33.0, 33.0]
    (rows,) = tables(tunings._left_out(given))
    assert rows[1:] == [["0.2", "20.00", "*2.000", "22.00", "21.00"], ["0.4", "*15.00", "*2.000", "*17.00", "27.00"]]
    worse = replace_ns(given, best=swept(0.4, 8.0, 12.5, 15.0, 9.0))
    assert tunings.worse_than_start(worse) == {"fitted": 12.5, "untuned": 12.0, "what": "loss"}
    assert tunings.worse_than_start(replace_ns(given, best=swept(0.4, 8.0, 12.1, 15.0, 9.0))) is None
    alone = replace_ns(given, tests=(), best=swept(0.4, 40.0, 1.0, 15.0, 9.0))
    assert tunings.worse_than_start(alone) == {"fitted": 41.0, "untuned": 33.0, "what": "loss"}


def replace_ns(one: Any, **changes: Any) -> Any:
    return SimpleNamespace(**{**vars(one), **changes})


@pytest.mark.slow
def test_places_in_the_range_are_drawn_filled_at_an_end() -> None:
    free = (Free("hull.a", 0.0), Free("hull.b", 0.0))
    sweep: Any = tuple(SimpleNamespace(free=free, ratio=r, position=np.array(p), at_bound=b)
                       for r, p, b in ((0.2, (0.5, 1.0), ("hull.b",)), (0.4, (-0.25, 0.75), ())))  # fmt: skip
    drawn = series(tunings.positions(sweep))
    points = sorted(tuple(p) for line in drawn.values() for p in line.tolist())
    wanted = sorted([(0.5, -0.15), (1.0, 0.85), (-0.25, 0.15), (0.75, 1.15)])
    np.testing.assert_allclose(points, wanted, atol=1e-6)


def test_the_distance_from_the_track_is_that_of_the_rows_predicted() -> None:
    t = np.arange(10.0)
    seen = Trial("m", t, {"x": t, "y": 0.0 * t})
    guess = Trial("p", t[4:], {"x": t[4:] + 3.0, "y": 4.0 + 0.0 * t[4:]})
    assert tunings._away(seen, guess) == pytest.approx(5.0)
    assert tunings._away(seen, None) == math.inf
    assert tunings._bolded([2.0, 1.0, math.inf]) == ["2.000", "*1.000", "–"]


def test_residuals_of_a_tuning_are_in_degrees() -> None:
    left = SimpleNamespace(rms={"psi": 2.0 * DEG, "x": 1.5}, noise={"psi": 0.5 * DEG, "x": 0.25},
                           correlation={"psi": 0.9, "x": 0.1}, bias={"psi": {"a": -1.0 * DEG}, "x": {"a": 0.125}})
    given: Any = SimpleNamespace(residuals=left, problem=SimpleNamespace(trials=(SimpleNamespace(name="a"),)))
    (rows,) = tables(tunings._residuals(given))
    assert rows[1:] == [["psi [°]", "2.00", "0.500", "0.900", "−1.0"], ["x [m]", "1.50", "0.250", "0.100", "0.12"]]


# Rivals


@pytest.mark.slow
def test_errors_over_the_steps_and_estimates_are_drawn_in_degrees_and_sigma() -> None:
    steps = np.arange(1.0, 12.0)
    scores: Any = {"truth": SimpleNamespace(steps={"u": 0.1 * steps, "v_m": 0.2 * steps, "r": 0.01 * steps})}
    drawn = series(rivals.steps(scores, {"truth": "the truth"}, 0.2, "x"))
    for (panel, name), points in drawn.items():
        factor = {"u": 0.1, "v": 0.2, "r": math.degrees(0.01)}[panel[0]]
        assert name == "the truth"
        np.testing.assert_allclose(points, np.column_stack([rivals.HORIZONS, factor * steps]), rtol=1e-4)
    free = (Free("hull.a", 0.0), Free("hull.b", 0.0))
    cases: Any = [SimpleNamespace(name=n, away=np.array(a), fits={"full": SimpleNamespace(free=free)})
                  for n, a in (("as sailed", (1.0, -20.0)), ("calm", (0.5, 2.0)))]  # fmt: skip
    found = series(rivals.estimates(cases))
    lines = {name: points for (_, name), points in found.items()}
    np.testing.assert_allclose(lines["as sailed"], [[1.0, -0.125], [-20.0, 0.875]], atol=1e-6)
    np.testing.assert_allclose(lines["calm"], [[0.5, 0.125], [2.0, 1.125]], atol=1e-6)


def test_the_weather_of_the_truth_is_told_in_degrees() -> None:
    sail = lambda size: SimpleNamespace(current=None if size is None else (size, 0.0))  # noqa: E731

    def told(sails: Any = (), **changes: Any) -> str:
        wind = SimpleNamespace(**{"U_T": 0.0, "gamma_T": 0.0, "U_C": 0.0, "gamma_C": 0.0, **changes.pop("wind", {})})
        virtual = SimpleNamespace(wind=wind, gusts="", sails=dict(enumerate(map(sail, sails))),
                                  sensors=SimpleNamespace(noise={"x": 0.5, "psi": 0.2 * DEG, "r": DEG}))  # fmt: skip
        return rivals._weather(SimpleNamespace(study=SimpleNamespace(virtual=replace_ns(virtual,
            **changes))))  # type: ignore[arg-type]

    assert told() == "Weather: calm. White noise of the sensors (SI, angles in degrees): x 0.5, psi 0.20°, r 1.0°."
    assert "wind of 5 m/s from 90° with gusts (davenport) and a current of 0.25 m/s towards 180°" in told(
        wind={"U_T": 5.0, "gamma_T": 90 * DEG, "U_C": 0.25, "gamma_C": math.pi}, gusts="davenport")
    assert "a current of 0.1 to 0.3 m/s in 2 of 4 trials" in told(sails=(0.1, 0.3, None, 0.0))
    assert "a current of 0.3 m/s in 2 of 2 trials" in told(sails=(0.3, 0.3))
    assert rivals._weather(SimpleNamespace(study=SimpleNamespace(virtual=None))) == ""  # type: ignore[arg-type]


def test_parameters_beyond_three_sigma_are_named() -> None:
    free = (Free("hull.a", 0.0), Free("hull.b", 0.0), Free("hull.c", 0.0))

    def case(*away: float) -> Any:
        return SimpleNamespace(name="calm", about="no wind", away=np.array(away),
            fits={"full": SimpleNamespace(free=free)})

    assert rivals._within(case(1.0, -3.1, 3.0)) == "calm (no wind): at most 3.10 sigma off; beyond 3 sigma: hull.b"
    assert rivals._within(case(1.0, -2.5, 0.0)) == "calm (no wind): at most 2.50 sigma off; all within 3 sigma"
    assert (rivals._counted(1), rivals._counted(2)) == ("1 parameter", "2 parameters")
    assert (rivals._percent(0.01234), rivals._percent(math.inf)) == ("1.23 %", "diverges")


# Tables of fits


@pytest.mark.slow
def test_estimates_far_away_are_drawn_on_a_logarithmic_axis(monkeypatch: pytest.MonkeyPatch) -> None:
    kept: list[Any] = []
    monkeypatch.setattr(rivals, "svg", lambda drawn, name: kept.append(drawn) or "")
    for far, scale in ((14.0, "linear"), (16.0, "symlog")):
        case: Any = SimpleNamespace(name="calm", away=np.array([-far]),
            fits={"full": SimpleNamespace(free=(Free("hull.a", 0.0),))})
        rivals.estimates([case])
        (ax,) = kept[-1].axes
        assert ax.x.scale == scale
    told = [words for _, words in ax.x.ticks]
    assert told == ["-30", "-10", "-3", "-1", "0", "1", "3", "10", "30"]
    assert [words for _, words in ax.y.ticks] == ["a"]


@pytest.mark.slow
def test_every_seed_is_drawn_north_over_east_and_broken_at_restarts() -> None:
    t = np.arange(20.0)
    seen = Trial("m", t, {"x": 2.0 * t, "y": -t})
    run = SimpleNamespace(measured=seen, restart=10.0, predicted={"x": 2.0 * t + 1.0, "y": -t + 0.5})
    one: Any = SimpleNamespace(title="a model", every=({"t": run}, {"t": None}, {"t": run}))
    drawn = {name: points for (_, name), points in series(judged.seeds([one], "t")).items()}
    np.testing.assert_allclose(drawn["a model, 2 seeds"], np.column_stack([-t + 0.5, 2.0 * t + 1.0]))
    np.testing.assert_allclose(drawn["measured"], np.column_stack([-t, 2.0 * t]))
    east, _ = judged._broken(run)  # type: ignore[arg-type]
    assert np.flatnonzero(np.isnan(east)).tolist() == [10]


def test_what_each_fit_took_is_in_minutes() -> None:
    member = SimpleNamespace(seed=3, weights=120, history=np.zeros((7, 4)), summary=summary_of(evaluations=42),
                             seconds=92.6, objective=0.12345)  # fmt: skip
    plain = SimpleNamespace(seed=None, weights=0, history=np.zeros((0, 4)), seconds=30.0, objective=1.0,
                            summary=summary_of(status="x", evaluations=5))  # fmt: skip
    found: Any = SimpleNamespace(standings=(SimpleNamespace(name="net", members=(member,)), SimpleNamespace(
        name="physics", members=(plain, SimpleNamespace(summary=None)))))  # fmt: skip
    for one in found.standings:
        for m in one.members:
            m.weights = getattr(m, "weights", 0)
        one.weights = one.members[0].weights
    (rows,) = tables(judged._cost(found))
    assert rows[1:] == [["net", "3", "120", "7", "42", "1.5", "0.123", "done"],
                        ["physics", "–", "–", "0", "5", "0.50", "1.00", "x"]]  # fmt: skip


@pytest.mark.slow
def test_a_control_that_hardly_moves_has_an_axis_of_a_tenth_of_it() -> None:
    t = np.arange(50.0)
    own = dict.fromkeys(("x", "y", "psi", "u", "v_m", "r"), 0.0 * t)
    trial = Trial("a", t, {**own, "n_P": 1.5 + 0.001 * np.sin(t), "delta": 0.1 * np.sin(t)})
    rudder, shaft = figures.motion_canvas(trial)[1][-2:]
    low, high = shaft.y.ends
    assert high - low == pytest.approx(0.15, abs=2e-3)
    low, high = rudder.y.ends
    assert high - low == pytest.approx(1.2 * 1.1 * 2 * math.degrees(0.1), rel=0.02)


@pytest.mark.slow
def test_losses_of_validation_are_drawn_with_the_kept_one() -> None:
    def member(seed: Any, watched: Any) -> Any:
        loss = np.array([9.0, 8.0, 7.0])
        return SimpleNamespace(seed=seed, history=np.column_stack([[1, 2, 3], loss, watched, [0, 0, 0]]))

    one: Any = SimpleNamespace(key="k", members=(member(5, [3.0, 1.0, 2.0]), member(None, [math.nan] * 3)))
    found = {name: points for (_, name), points in series(judged.validation(one)).items()}
    np.testing.assert_allclose(found["seed 5"], [[1, 3], [2, 1], [3, 2]])
    np.testing.assert_allclose(found["validation"], [[1, 9], [2, 8], [3, 7]])
    kept = [points.tolist() for name, points in found.items() if name.startswith("line")]
    assert kept == [[[2.0, 1.0]], [[3.0, 7.0]]]
    marks = series(judged.bars(["a", "b"], {"t": [0.5, 2.0], "s": [1.0, math.inf]}, "error"))
    lines = {name: points.tolist() for (_, name), points in marks.items()}
    assert lines == {"t": [[0.5, 0.0], [2.0, 1.0]], "s": [[1.0, 0.0]]}


def test_cells_of_a_table_of_fits_mark_the_least() -> None:
    def standing(mean: float, deviation: float = math.nan) -> Any:
        return SimpleNamespace(mean=lambda test: mean, deviation=lambda test: deviation)

    assert judged._cell(standing(0.5, 0.25), "t", 0.5) == "*0.500 ± 0.250"
    assert judged._cell(standing(12.0), "t", 0.5) == "12.00"
    assert judged._cell(standing(math.inf), "t", 0.5) == "no number"
    assert judged._cell(standing(math.nan), "t", 0.5) == "–"
    assert (judged.pair(9.99), judged.pair(10.0), judged.pair(100.0), judged.pair(1000.0)) == ("9.990", "10.00",
        "100.0", "1000")


# Recordings


def entry(name: str, t: Any, **channels: Any) -> Any:
    trial = Trial(name, t, channels)
    kind = SimpleNamespace(name="zigzag", label="zigzag 20/20", evidence=("seen",), doubts=("odd",),
        settings={"rudder": 0.35})
    return SimpleNamespace(trial=trial, kind=kind, told="zigzag", verdict="agrees", ranges={}, new=0.0123)


def test_ranges_of_recordings_are_told_to_two_digits() -> None:
    def span(low: float, high: float, channel: str = "u") -> str:
        return trials.span(SimpleNamespace(ranges={channel: (low, high)}), channel)  # type: ignore[arg-type]

    assert span(0.0, 1.26) == "0.0 … 1.3"
    assert span(-12.4, 3.0) == "−12 … 3"
    assert span(-0.35, 0.35, "delta") == "−20 … 20"
    assert span(-0.02, 0.35, "r") == "−1 … 20"
    assert span(1.5, 1.52) == "1.51"
    assert span(1.5, 1.54) == "1.5 … 1.5"
    assert span(-0.004, 1.0) == "0.0 … 1.0"
    assert trials.span(SimpleNamespace(ranges={}), "u") == "–"  # type: ignore[arg-type]


@pytest.mark.slow
def test_recordings_are_drawn_with_speed_heading_and_controls() -> None:
    t = np.arange(700.0)
    psi = np.angle(np.exp(0.05j * t))
    one = entry("a", t, x=2.0 * t, y=-t, u=0.01 * t, psi=psi, r=0.05 + 0.0 * t, delta_1=0.1 + 0.0 * t,
        delta_1_cmd=0.2 + 0.0 * t,
                n_P=5.0 + 0.0 * t)  # fmt: skip
    curves = dict(trials._curves(one))
    assert list(curves) == ["u [m/s]", "ψ [°]", "δ [°]", "n [1/s]"]
    np.testing.assert_allclose(curves["ψ [°]"]["psi"], np.degrees(0.05 * t), atol=1e-9)
    assert list(curves["δ [°]"]) == ["delta_1"]
    np.testing.assert_allclose(curves["δ [°]"]["delta_1"], math.degrees(0.1))
    drawn = series(trials._drawn("a", one))
    track = drawn["north x [m] over east y [m]", "measured"]
    np.testing.assert_allclose(track[:, 1], -2.0 * track[:, 0])
    speed = next(points for (panel, _), points in drawn.items() if panel.startswith("u [m/s]"))
    np.testing.assert_allclose(speed[:, 1], 0.01 * speed[:, 0])
    assert len(speed) == 350
    bare = dict(trials._curves(entry("b", t, r=0.05 + 0.0 * t, n_P_cmd=5.0 + 0.0 * t)))
    assert list(bare) == ["r [°/s]", "n [1/s]"]
    np.testing.assert_allclose(bare["r [°/s]"]["r"], math.degrees(0.05))
    assert trials._row("a", one)[-1] == "1.2 %"
    assert trials._row("a", one)[2:4] == ("✓ zigzag", "699")
    plane = series(trials._plane(SimpleNamespace(entries={"a": one, "b": entry("b", t,
        r=t)})))  # type: ignore[arg-type]
    (points,) = [p for (panel, _), p in plane.items() if panel.startswith("r [")]
    np.testing.assert_allclose(points[:, 1], math.degrees(0.05), rtol=1e-4)
    assert trials._plane(SimpleNamespace(entries={"b": entry("b", t, r=t)})) == ""  # type: ignore[arg-type]
