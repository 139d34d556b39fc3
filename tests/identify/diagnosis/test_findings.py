"""What a diagnosis says of its numbers: thresholds from both sides, units, order, and what is said first."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seatrial.data import Trial
from seatrial.identify import Loss, Nuisance, Problem
from seatrial.identify.diagnosis import diagnose, stages
from seatrial.identify.diagnosis.alternatives import _of, _stuck
from seatrial.identify.diagnosis.blame.contradiction import Contradiction
from seatrial.identify.diagnosis.channels import Channel
from seatrial.identify.diagnosis.findings import Diagnosis, Differing, Suspicion
from seatrial.identify.networks.pushed import _mean, _parts
from seatrial.ships.files import load

DEG = math.radians(1.0)


def channel(**changes: Any) -> Channel:
    given = {"noise": 0.5, "size": 1.0, "alike": 0.0, "alike_sigma": 0.01, "lasting": 1.0, "count": 100}
    return Channel(**{**given, **changes})


def suspicion(**changes: Any) -> Suspicion:
    given = {"name": "offset.delta", "words": "an offset of delta", "unit": "deg", "per": DEG, "drop": 900.0,
        "share": 0.8,
             "size": 1.5 * DEG, "sigma": 0.0123 * DEG, "moves": {"p": -13.0, "q": 2.0}}  # fmt: skip
    return Suspicion(**{**given, **changes})


def contradiction(**changes: Any) -> Contradiction:
    given = {"trial": "a", "chi": 80.4, "freedom": 3, "deviates": 6.0, "together": 2.0, "removes": 0.9,
             "moves": {"p": 1.0, "q": -2.25}}  # fmt: skip
    return Contradiction(**{**given, **changes})


@pytest.mark.parametrize(("changes", "count"), [
    ({"size": 1.29}, 0), ({"size": 1.31}, 1), ({"size": 1.8, "by_inputs": 1.0}, 0), ({"size": 1.9, "by_inputs": 1.0},
        1),
    ({"alike": 0.18, "size": 1.1}, 0), ({"alike": 0.2, "size": 1.1}, 1), ({"alike": 0.9, "size": 0.99}, 0),
    ({"alike": 0.9, "size": 1.2, "by_inputs": 1.0}, 0), ({"alike": 0.2, "alike_sigma": 0.02, "size": 1.1}, 0),
    ({"alike": 0.9, "size": 2.0}, 2),
])  # fmt: skip
def test_residuals_contradict_a_model_beyond_noise_and_chance(changes: Any, count: int) -> None:
    assert len(channel(**changes).grounds("x")) == count


def test_grounds_are_told_in_the_units_of_people() -> None:
    assert channel(size=3.14159).grounds("x") == ("x: residuals are 3.1 times the sensor noise (0.50 m)",)
    assert channel(size=340.0, noise=0.1 * DEG).grounds("psi") == (
        "psi: residuals are 340 times the sensor noise (0.10 deg)",)
    assert channel(size=20.0, noise=math.radians(12.0)).grounds("r")[0].endswith("(12 deg/s)")
    assert channel(size=1.2, alike=0.456).grounds("u") == ("u: neighbouring residuals are alike (correlation 0.46)",)


def test_an_error_has_its_size_in_its_unit_and_a_scale_as_a_share_of_the_truth() -> None:
    assert suspicion().value == "1.5 +- 0.01 deg"
    assert suspicion().sized == "an offset of delta of 1.5 +- 0.01 deg"
    # a reading of 1 means 1 - size in truth: size .2 is 25 % of the truth, its sigma over (1 - size)^2
    scale = suspicion(name="scale.u", unit="%", per=0.01, size=0.2, sigma=0.018, of_reading=True)
    assert scale.value == "25 +- 3 %"  # .018 / .8^2 = 2.8 %, one digit
    assert replace(scale, size=0.95).value == "95 +- 2 %"
    assert replace(scale, of_reading=False).value == "20 +- 2 %"
    whole = suspicion(whole=True)
    assert (whole.value, whole.sized) == ("whole", "an offset of delta")
    assert whole.remedy.startswith("change it in the mapping file")
    assert 'common = { "offset.delta" = inf }' in suspicion().remedy
    assert '{ "current.north" = inf, "current.east" = inf }' in suspicion(name="current.east").remedy
    wind = suspicion(name="scale.wind", size=0.6)
    assert wind.turned
    assert wind.text.endswith("add 180 deg to gamma_T")
    assert not replace(wind, size=0.4).turned
    assert not replace(wind, name="scale.u").turned
    assert suspicion().text == ("an offset of delta of 1.5 +- 0.01 deg would remove 80% of the objective; "
                                "p would move by -13.0 sigma")  # fmt: skip
    assert "would move" not in suspicion(moves={}).text


@pytest.mark.parametrize(("changes", "matters"), [
    ({}, True), ({"drop": 24.9}, False), ({"drop": 25.1}, True), ({"moves": {"p": 0.9}, "share": 0.04}, False),
    ({"moves": {"p": -1.1}, "share": 0.04}, True), ({"moves": {"p": 0.9}, "share": 0.06}, True),
    ({"moves": {}, "share": 0.04}, False),
])  # fmt: skip
def test_a_suspect_matters_if_significant_and_of_consequence(changes: Any, matters: bool) -> None:
    assert suspicion(**changes).matters == matters


def test_an_error_by_trial_tells_the_extremes_among_those_known() -> None:
    each = {name: suspicion(size=size * DEG, sigma=sd * DEG)
            for name, size, sd in (("a", 1.0, 0.1), ("b", -2.0, 0.1), ("c", 9.0, 0.31), ("d", 3.0, 0.29), ("e", 0.0,
                0.1))}
    one = Differing("an offset of delta", each, 90.0, 0.3, {"p": 2.0, "q": -4.0})
    assert (one.numbers, one.name) == (5, "offset.delta")
    assert one.text == ("an offset of delta that differs from trial to trial, -2 +- 0.1 deg in b to 3 +- 0.3 deg in d, "
                        "would remove 30% of the objective; q would move by -4.0 sigma")  # fmt: skip
    alone = Differing("an offset", {"b": each["b"]}, 90.0, 0.3, {})
    assert alone.text == "an offset of -2 +- 0.1 deg in trial b alone would remove 30% of the objective"
    assert alone.remedy == 'correct the log of b, or leave it out: exclude = ["b"] in [data] of the study'


@pytest.mark.parametrize(("changes", "matters", "odd", "alone"), [
    ({}, True, True, True), ({"moves": {"p": 0.9, "q": -0.9}}, False, True, True), ({"moves": {}}, False, True, True),
    ({"deviates": 4.9}, False, True, False), ({"deviates": 4.9, "together": 5.1}, True, True, False),
    ({"deviates": 2.9}, False, False, False), ({"deviates": 3.1}, False, True, False),
    ({"removes": 0.74}, True, True, False), ({"removes": 0.76}, True, True, True),
])  # fmt: skip
def test_a_trial_contradicts_the_others(changes: Any, matters: bool, odd: bool, alone: bool) -> None:
    one = contradiction(**changes)
    assert (one.matters, one.odd, one.alone) == (matters, odd, alone)


def test_trials_that_are_apart_are_named_once() -> None:
    assert contradiction().text == ("trial a contradicts the others (chi square 80 where 3 is expected); without it "
                                    "q would move by -2.2 sigma")  # fmt: skip
    first, second, third = contradiction(), contradiction(trial="b", removes=0.2), contradiction(trial="c",
        deviates=1.0)
    assert Diagnosis(contradictions=(first, second, third)).apart == (first,)
    shared = replace(first, removes=0.3)
    assert Diagnosis(contradictions=(shared, second, third)).apart == (shared, second)
    faint = tuple(replace(one, deviates=1.0, together=6.0) for one in (first, second))
    assert Diagnosis(contradictions=faint).apart == faint
    calm = replace(third, together=1.0)
    assert Diagnosis(contradictions=(calm,)).apart == ()


@pytest.mark.parametrize(("given", "lacking"), [
    ({}, False), ({"channels": {"x": channel()}}, False), ({"channels": {"x": channel(), "y": channel(size=2.0)}},
        True),
    ({"suspicions": (suspicion(drop=1.0),)}, False), ({"suspicions": (suspicion(drop=1.0), suspicion())}, True),
    ({"terms": (suspicion(drop=1.0),)}, False), ({"terms": (suspicion(drop=1.0), suspicion())}, True),
    ({"contradictions": (contradiction(),)}, True), ({"contradictions": (contradiction(moves={}),)}, False),
    ({"pulled": {"p": 1.9, "q": -1.9}}, False), ({"pulled": {"p": 0.0, "q": -2.1}}, True),
    ({"differing": (Differing("a", {"t": suspicion()}, 90.0, 0.3, {}),)}, True),
])  # fmt: skip
def test_a_model_is_lacking_where_anything_that_matters_says_so(given: Any, lacking: bool) -> None:
    found = Diagnosis(**given)
    assert found.lacking == lacking
    assert found.numbers()["explained"] == (not lacking)
    assert found.lines[0].startswith("the model does not explain" if lacking else "the residuals look like")


def test_lines_of_a_sound_fit_name_the_fixed_number_it_rests_on_and_outliers() -> None:
    fixed = (("body.m", "q", 9.0), ("hull.k", "p", 2.9), ("hull.l", "q", -3.1))
    found = Diagnosis(fixed=fixed, shares={"hull.l": 0.25}, rejected={"t": {"psi": 2, "u": 1}}, errors=(suspicion(),))
    assert found.lines == (
        "the residuals look like sensor noise",
        "sigma takes the fixed numbers as right: hull.l larger by 25% would move q by -3.1 sigma",
        "t: outliers left out: 2 of psi, 1 of u", "estimated: an offset of delta of 1.5 +- 0.01 deg",
    )  # fmt: skip
    assert len(Diagnosis(fixed=fixed[:2]).lines) == 1
    told = found.numbers()
    assert told["fixed"][1] == {"parameter": "hull.k", "error": 0.1, "moves": "p", "sigmas": 2.9}  # type: ignore[index]
    assert told["estimated"] == {"offset.delta": {"size": 1.5 * DEG, "sigma": 0.0123 * DEG}}
    assert told["outliers"] == {"t": {"psi": 2, "u": 1}}


def test_lines_of_a_fit_that_lacks_something_lead_with_what_accounts_for_it() -> None:
    """Residuals twice the noise exceed it by 3/4 of their square; a fifth of that is a good part."""
    channels = {"x": channel(size=2.0), "u": channel(size=2.0, count=300)}
    strong, weak = suspicion(share=0.16), suspicion(name="bias.u", words="a bias of u", share=0.14)
    found = Diagnosis(channels, (strong, weak), pulled={"p": 3.0})
    lines = found.lines
    assert lines[1] == f"suspect: {strong.text}"
    assert lines[2] == f"remedy of the first: {strong.remedy}"
    assert lines[3].startswith("noise of the measured states pulls this fit: long predictions would "
                               "move p by +3.0 sigma")
    assert lines[4].startswith("x: residuals are 2 times")
    assert lines[-1] == f"suspect: {weak.text}"
    own = Differing("an offset of delta", {"t": suspicion(), "s": suspicion()}, 90.0, 0.5, {})
    held = suspicion(name="body.m", words="an error of body.m", share=0.3)
    more = Diagnosis(channels, (strong, weak), differing=(own,), terms=(held, replace(held, drop=1.0)))
    listed = [line for line in more.lines if line.startswith(("suspect", "or the ship"))]
    assert listed == [f"suspect: {own.text}", f"or the ship: {held.text}", f"suspect: {weak.text}"]
    assert more.lines.index(listed[1]) < more.lines.index("x: residuals are 2 times the sensor noise (0.50 m)")
    many = tuple(suspicion(name=f"bias.{k}", words=f"bias {k}", share=0.5 - 0.01 * k) for k in range(7))
    assert [line.split(" of ")[0] for line in Diagnosis(channels, many[::-1]).lines if line.startswith("suspect")] == [
        f"suspect: bias {k}" for k in range(5)]
    below = {"x": channel(size=0.8, alike=0.9), "u": channel(size=1.4, count=1)}
    assert Diagnosis(below, (replace(weak, share=1e-6),)).lines[1].startswith("suspect")


def test_trials_apart_come_first_if_one_is_alone_and_after_the_suspects_if_not() -> None:
    alone, other = contradiction(), contradiction(trial="b", removes=0.3)
    channels = {"x": channel(size=2.0)}
    found = Diagnosis(channels, (suspicion(),), contradictions=(alone, other))
    assert found.lines[1] == alone.text
    assert found.remedies == ('leave it out: exclude = ["a"] in [data] of the study',)
    assert sum("contradict" in line for line in found.lines) == 1
    shared = Diagnosis(channels, (suspicion(),), contradictions=(replace(alone, removes=0.4), other))
    assert shared.lines[3] == "trials contradict each other, the first of them most: a, b"
    assert shared.remedies == (suspicion().remedy,)
    # where all differ, or what is suspected explains little, no line helps
    differ = Diagnosis(channels, (suspicion(share=0.1),), contradictions=(replace(alone, removes=0.4), other))
    assert len(differ.remedies) == 1
    assert differ.remedies[0].startswith("look for a term of the model")
    single = Diagnosis(channels, (suspicion(),), contradictions=(replace(alone, removes=0.4), replace(other,
        deviates=1.0)))
    assert single.lines[3].startswith("trial a contradicts the others")


# What logs would be with two columns exchanged


def test_alternatives_are_those_of_ships_with_several_rudders_or_shafts() -> None:
    series = np.arange(24.0).reshape(2, 3, 4) + 1.0
    found = {one.name: one.of(series) for one in _of(("delta_P", "delta_S", "n_P", "n_S"))}
    assert list(found) == ["sign.delta_P", "sign.delta_S", "exchange.delta", "sign.delta", "exchange.n", "exchange"]
    turned = series * [-1.0, 1.0, 1.0, 1.0]
    assert np.array_equal(found["sign.delta_P"], turned)
    assert np.array_equal(found["sign.delta_S"], series * [1.0, -1.0, 1.0, 1.0])
    assert np.array_equal(found["sign.delta"], series * [-1.0, -1.0, 1.0, 1.0])
    assert np.array_equal(found["exchange.delta"], series[..., [1, 0, 2, 3]])
    assert np.array_equal(found["exchange.n"], series[..., [0, 1, 3, 2]])
    assert np.array_equal(found["exchange"], series[..., [1, 0, 3, 2]])
    assert list(_of(("delta", "n_P"))) == []
    assert [one.name for one in _of(("alpha_1", "alpha_2", "alpha_3"))] == ["sign.alpha_1", "sign.alpha_2",
        "sign.alpha_3"]
    pair = [one.name for one in _of(("delta", "n_1", "n_2", "alpha_1"))]  # one pair alone, and what stands by itself
    assert pair == ["sign.alpha_1", "exchange.n"]
    words = {one.name: one.words for one in _of(("delta_P", "delta_S"))}
    assert words["exchange.delta"] == "an exchange of delta_P and delta_S"


def test_one_rudder_of_several_may_stand_still_at_some_angle() -> None:
    series = np.arange(24.0).reshape(2, 3, 4) + 1.0
    found = list(_stuck(("delta_P", "n_P", "delta_S", "n_S")))
    assert {one.name for one in found} == {"stuck.delta_P", "stuck.delta_S"}
    [held] = [one for one in found if one.name == "stuck.delta_S" and "near 5 deg" in one.words]
    expected = series.copy()
    expected[..., 2] = 5.0 * DEG
    np.testing.assert_allclose(held.of(series), expected)
    assert series[0, 0, 2] == 3.0
    assert list(_stuck(("delta", "n_P"))) == []  # a single one is for `data.check`


# Seconds in which something has pushed


def test_a_mean_over_rows_is_centred() -> None:
    values = np.zeros(21)
    values[10] = 5.0
    found = _mean(values, 5)
    assert np.flatnonzero(found).tolist() == [8, 9, 10, 11, 12]
    np.testing.assert_allclose(found[8:13], 1.0)
    assert _mean(values, 0)[10] == 5.0
    assert _mean(np.ones(2), 5).shape == (2,)


def test_what_is_left_out_reaches_a_third_of_the_span_before_and_twice_that_after() -> None:
    t = 0.1 * np.arange(1001)
    trial = Trial("a", t, {"u": t})
    pushed = np.zeros(1001, dtype=bool)
    pushed[500:511] = True
    assert _parts(trial, np.zeros(1001, dtype=bool), 2.1) == [trial]
    first, second = _parts(trial, pushed, 2.1)
    assert (first.name, second.name) == ("a_1", "a_2")
    assert (first.t[0], first.t[-1]) == pytest.approx((0.0, 49.2))  # 50.0 - .35 x 2.1 = 49.265 goes with it
    assert (second.t[0], second.t[-1]) == pytest.approx((52.5, 100.0))  # 51.0 + .7 x 2.1 = 52.47
    for row, parts in ((173, 1), (178, 2)):  # 16.5 s or 17 s before: only what is 8 spans long, 16.8 s, stays
        near = np.zeros(1001, dtype=bool)
        near[[row, 300]] = True
        kept = _parts(trial, near, 2.1)
        assert len(kept) == parts
        assert (kept[-1].t[0], kept[-1].t[-1]) == pytest.approx((31.5, 100.0))


# What is estimated next, and how residuals weigh then


def test_the_first_cause_with_a_size_is_estimated_if_it_pays_for_a_parameter() -> None:
    whole, small = suspicion(name="sign.x", whole=True), suspicion(name="bias.u", drop=26.0)
    channels = {"x": channel(count=10**6), "u": channel(count=10**6)}

    def worth(*suspects: Suspicion, **channels: Channel) -> str:
        return stages._worth(SimpleNamespace(diagnosis=Diagnosis(channels, suspects)))  # type: ignore[arg-type]

    assert worth(whole, suspicion(), small, **channels) == "offset.delta"
    assert worth(whole) == worth() == worth(suspicion(drop=1.0)) == ""
    assert stages._worth(SimpleNamespace(diagnosis=None)) == ""  # type: ignore[arg-type]
    # Schwarz: a parameter costs the logarithm of the number of residuals
    assert worth(small, x=channel(count=10**11), u=channel(count=10**11)) == ""
    assert worth(small, x=channel(count=10**11)) == "bias.u"
    assert stages._whole("wind.north") == ("wind.north", "wind.east")
    assert stages._whole("bias.u") == ("bias.u",)


def test_weights_follow_the_residuals_and_initial_states_the_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Any] = []
    monkeypatch.setattr(stages, "noise", lambda trials, motion: asked.append((trials, motion)) or {"x": 0.5,
        "u": 0.1, "r": 9.0})
    ship = load("kvlcc2_l7")
    problem = Problem(ship, (), (), Loss(weights={"z*": 2.0}))
    channels = {"x": channel(noise=0.5, size=3.0, lasting=4.0), "u": channel(noise=0.1, size=0.5, lasting=1.0),
                "psi": channel(noise=0.2, size=1.0, lasting=9.0)}  # fmt: skip
    then = stages._weighed(replace(problem, nuisance=Nuisance(initial={"x": 7.0})), channels)
    # an error that lasts twice as long counts for half as many readings
    assert then.loss.sigma == pytest.approx({"x": 1.5, "u": 0.1 * 0.5, "psi": 0.2 * 1.5})
    assert (then.loss.correlation, then.loss.weights) == (4.0, {"z*": 2.0})
    assert then.nuisance.initial == {"x": 7.0}
    assert asked == [((), ship.model.motion)]
    two = {name: channels[name] for name in ("x", "u")}
    initial = stages._weighed(problem, two).nuisance.initial
    assert {name: initial[name] for name in two} == {"x": 0.5, "u": 0.1}
    # what nothing reads is as free as ships go: of the order of their speed, and of that over their length
    assert sorted(initial) == ["psi", "r", "u", "v_m", "x"]
    assert 0.1 < initial["v_m"] / ship.speed <= 1.0
    assert initial["r"] == pytest.approx(initial["v_m"] / ship.L_pp)


def test_residuals_count_by_how_long_those_of_their_channel_last() -> None:
    cut = SimpleNamespace(dt=0.5, every=4, weight=0.1)
    objective: Any = SimpleNamespace(
        windows=cut, problem=SimpleNamespace(ship=SimpleNamespace(model=SimpleNamespace(motion=("x", "u", "r")))))
    channels = {"x": channel(lasting=40.0), "r": channel(lasting=1.0)}
    assert diagnose._independent(objective, channels).tolist() == [0.05, 0.1, 1.0]
    cut.weight = 1.0
    assert diagnose._independent(objective, channels).tolist() == [1.0, 1.0, 1.0]


def test_alternatives_count_their_moves_in_sigmas_and_stand_among_the_suspects(monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[Any] = []
    found = suspicion(name="exchange", drop=500.0)
    monkeypatch.setattr(diagnose, "alternatives", lambda *given: told.append(given) or (found,))
    tested = (suspicion(), suspicion(name="bias.u", drop=30.0))
    given: Any = ("objective", "p", "eta", np.diag([4.0, 0.25]))
    some = diagnose._with_alternatives(*given, {"x": channel(size=3.0)}, tested, "problem")  # type: ignore[arg-type]
    assert [one.drop for one in some] == [900.0, 500.0, 30.0]
    np.testing.assert_allclose(told[0][3], [2.0, 0.5])
    assert diagnose._with_alternatives(*given, {"x": channel()}, tested, "problem") is tested  # type: ignore[arg-type]
    assert len(told) == 1
