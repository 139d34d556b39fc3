"""Priors against data by the Gaussian that they are, and errors by what instruments can have."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seatrial.core.parameters import Free
from seatrial.identify.diagnosis.channels import Channel
from seatrial.identify.diagnosis.diagnose import _suspicions
from seatrial.identify.diagnosis.findings import Diagnosis, Suspicion
from seatrial.identify.diagnosis.linear import Linear
from seatrial.identify.diagnosis.priors import Pull, pulls
from seatrial.identify.trajectory.suspects import Suspect
from seatrial.identify.vector import Vector

DEG = math.radians(1.0)


def suspicion(name: str, size: float, sigma: float, *, of_reading: bool = True, share: float = 0.6) -> Suspicion:
    one = Suspect(name, f"an error {name}", "%", 0.01, of_reading=of_reading)
    return Suspicion(one.name, one.words, one.unit, one.per, 900.0, share, size, sigma, {"p": 9.0}, of_reading,
                     most=one.most)  # fmt: skip


def pull(**changes: Any) -> Pull:
    given = {"path": "hull.R_0", "prior": 0.014, "sigma": 0.003, "wanted": 0.0233, "deviates": 3.05, "share": 0.3}
    return Pull(**{**given, **changes})


def lacking(**given: Any) -> Diagnosis:
    return Diagnosis({"r": Channel(0.1, 10.0, 0.0, 0.01, 1.0, 100)}, **given)


@pytest.mark.parametrize("wanted", [5.0, 0.0])
def test_a_prior_is_compared_with_what_the_data_alone_want(wanted: float) -> None:
    """Data N(wanted, .5^2), prior N(2, .8^2): the posterior is their product, and the cavity gives the data back."""
    s, t, mean = 0.8, 0.5, 2.0
    v = 1.0 / (s**-2 + t**-2)
    m = v * (mean / s**2 + wanted / t**2)
    vector = Vector.of([Free("a", 1.0, prior=mean, sigma=s), Free("b", 1.0)])
    cost = 1000.0
    [one] = pulls(vector, np.array([m, 7.0]), np.array([v, 0.1]), cost)
    assert one.path == "a"
    assert one.wanted == pytest.approx(wanted, rel=1e-12)
    assert one.deviates == pytest.approx((wanted - mean) / math.hypot(s, t), rel=1e-12)
    assert one.share * cost == pytest.approx(((wanted - m) / t) ** 2, rel=1e-12)  # squares of the data, m to wanted
    assert one.matters == (wanted == 5.0)


def test_deviates_of_a_prior_that_is_right_are_standard() -> None:
    rng = np.random.default_rng(3)
    s, t = 1.5, 0.7
    vector, v = Vector.of([Free("a", 0.0, prior=0.0, sigma=s)]), 1.0 / (s**-2 + t**-2)
    data = s * rng.standard_normal(4000) + t * rng.standard_normal(4000)
    found = np.array([pulls(vector, np.array([v * d / t**2]), np.array([v]), 1.0)[0].deviates for d in data])
    assert abs(found.mean()) < 4.0 / math.sqrt(4000)
    assert abs(found.std() - 1.0) < 4.0 / math.sqrt(8000)


def test_data_that_say_nothing_of_a_parameter_want_it_nowhere() -> None:
    vector = Vector.of([Free("a", 0.0, prior=0.0, sigma=1.0)])
    assert pulls(vector, np.array([0.2]), np.array([0.97]), 1.0) == ()
    assert len(pulls(vector, np.array([0.2]), np.array([0.93]), 1.0)) == 1


def test_a_prior_is_told_in_its_sigma_with_the_line_that_widens_it() -> None:
    assert pull().text == "the data want hull.R_0 3.1 sigma above its prior: 0.0233 for 0.014 +- 0.003"
    assert "1.0 sigma below" in pull(wanted=0.011).text
    assert pull().remedy == 'widen the prior: "hull.R_0" = { sigma = 0.009 } in [free] of the study'


@pytest.mark.parametrize(("deviates", "first"), [(3.1, "prior"), (-4.9, "prior"), (5.1, "error"), (2.9, "error")])
def test_a_prior_off_by_a_few_sigma_comes_before_an_instrument_and_one_off_by_many_by_its_share(
    deviates: float, first: str
) -> None:
    found = lacking(suspicions=(suspicion("scale.u", 0.1, 0.01),), pulls=(pull(deviates=deviates),))
    assert found.cause is not None
    assert first in found.cause.text
    # one value says cause and remedy everywhere
    assert found.remedies[0] == found.cause.remedy
    assert found.numbers()["cause"] == found.cause.text
    assert found.lines[1] == f"suspect: {found.cause.text}"
    assert [line for line in found.lines if "remedy" in line] == [f"remedy of the first: {found.cause.remedy}"]


def test_a_prior_that_pulls_is_told_of_a_sound_fit_and_makes_it_no_unsound_one() -> None:
    sound = Diagnosis({"r": Channel(0.1, 1.0, 0.0, 0.01, 1.0, 100)}, pulls=(pull(),))
    assert not sound.lacking
    assert sound.lines == ("the residuals look like sensor noise", pull().text)
    assert pull().text not in replace(sound, pulls=(pull(deviates=2.9),)).lines


@pytest.mark.parametrize(("name", "size", "of_reading", "possible"), [
    ("scale.delta", 0.13, True, True),  # 15 %
    ("scale.delta", 0.25, True, False),  # a quarter of the reading, a third of the truth
    ("scale.delta", 0.533, True, False),  # 114 %
    ("scale.r", -3.95, False, False),  # -395 %
    ("scale.r", 0.06, False, True),
    ("scale.u", 0.27, False, True), ("scale.u", 0.95, False, False),
    ("bias.psi", 10 * DEG, False, True), ("bias.psi", 40 * DEG, False, False),
    ("delay.delta", 18.0, False, True), ("delay.position", 3.0, False, True), ("delay.psi", 90.0, False, False),
    ("antenna.ahead", -100.0, False, True), ("antenna.starboard", 60.0, False, False),
    ("scale.wind", -2.97, True, False),  # reads a quarter of the wind
    ("scale.wind", 2.0, True, True),  # reversed
])  # fmt: skip
def test_no_instrument_is_blamed_for_what_none_has(name: str, size: float, of_reading: bool, possible: bool) -> None:
    one = suspicion(name, size, 0.001 * abs(size), of_reading=of_reading)
    found = Diagnosis(suspicions=(one,))
    assert one.possible == possible
    assert found.causes == ((one,) if possible else ())
    assert found.lacking  # whatever it is called
    said = " ".join(found.lines)
    assert (one.value in said) == possible
    assert ("larger than any of an instrument" in said) != possible


def test_a_size_that_is_hardly_known_may_be_a_possible_one() -> None:
    assert suspicion("scale.u", 0.5, 0.11, of_reading=False).possible
    assert not suspicion("scale.u", 0.5, 0.09, of_reading=False).possible


@pytest.mark.parametrize(("size", "word"), [(1.0, "stuck"), (0.93, "stuck"), (2.05, "sign"), (0.85, ""), (1.5, "")])
def test_a_control_that_does_not_act_or_acts_the_other_way_has_no_size(size: float, word: str) -> None:
    one = suspicion("scale.delta_2", size, 0.001)
    assert one.possible == bool(word)
    assert word in one.instead
    assert bool(one.instead) == bool(word)
    if word:
        assert "%" not in one.sized
        assert one.remedy.startswith("change it in the mapping file")


def test_a_misfit_that_the_ship_explains_with_wider_priors_is_hardly_an_instrument_s() -> None:
    """One parameter, .2 from its prior; an instrument acts like it but for a part across."""
    rng = np.random.default_rng(5)
    rows, width = 4000, 1
    J, across = rng.standard_normal((2, 1, rows, 1))
    extra, precision = J + 0.3 * across, np.array([[4.0 * rows]])
    # The prior weighs four times the data, and so leaves four fifths of what they want.
    A = float((J**2).sum() + precision[0, 0])
    true = 0.2
    noise = rng.standard_normal((1, rows, 1))
    p = float((J * (true * J + noise)).sum()) / A
    e, none = J * p - (true * J + noise), np.zeros((1, rows, 0))
    linear = Linear.of(e.reshape(1, rows, width), np.concatenate([J, extra, none], axis=-1), (1, 1, 0, 0),
                       np.zeros((1, rows, width)), np.zeros(1, dtype=int), (precision, np.full(1, 1e9)))  # fmt: skip
    one = Suspect("scale.u", "a scale error of the speed", "%", 0.01)
    problem: Any = SimpleNamespace(vector=SimpleNamespace(paths=("p",)))
    drop = [_suspicions(own, np.ones(1), [one], np.eye(1), problem)[0].drop for own in
            (linear, linear.freed(precision))]  # fmt: skip
    assert linear.freed(precision).A[0, 0] == pytest.approx(float((J**2).sum()) + precision[0, 0] / 9.0)
    # What the parameter does not take up of the part along J: 1 - 1/(1 + prior/data); across, .3 is left anyway.
    along = [1.0 - 1.0 / (1.0 + ratio) for ratio in (4.0, 4.0 / 9.0)]
    loose, tight = (a**2 / (a**2 + 0.3**2) for a in reversed(along))
    assert drop[1] / drop[0] == pytest.approx(loose / tight, abs=0.08)
    assert drop[0] > 25.0
