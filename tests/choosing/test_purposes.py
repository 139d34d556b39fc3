"""Ranks of families whose answers are made up, and what the survey counts and times, against a count by hand."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import pytest

from seatrial.choosing import CAPABILITIES, Family, Finding, Need
from seatrial.choosing import survey as surveys
from seatrial.choosing.probing import Probe
from seatrial.choosing.purposes import Purpose, advise, fittest, recommend, unmet
from seatrial.choosing.survey import Assessment, assess, count, nanoseconds, vector_arx
from seatrial.engine import Rollout
from seatrial.ships.files import load
from seatrial.simulate.lanes import Lanes, Steps

KEYS = tuple(c.key for c in CAPABILITIES)
A, B, C = KEYS[:3]
NEEDS = (Need("first", (A,), "5", 1), Need("second", (A, B), "6", 2), Need("nice", (C,), "7", must=False))
PURPOSE = Purpose("fishing", "fishing", "", NEEDS, {"old": "as said (3)"}, ("used",), "", "")


def family(key: str, *answers: str, size: int = 5, by_ship: Any = None) -> Assessment:
    """A family with the given answers to the first three capabilities; without any it is only planned."""
    own = Family(key, key, ("some:Class",) if answers else (), "", "4.1", "", {}, {})
    found = {name: Finding(answer, "") for name, answer in zip(KEYS, answers or ("planned",) * 3, strict=False)}
    return Assessment(
        own, tuple(by_ship or ()), "", (), (), (), (2, size) if answers else None, (), found, by_ship or {}
    )


def order(*families: Assessment) -> list[str]:
    return [one.assessment.family.key for one in recommend(PURPOSE, families)]


@pytest.mark.parametrize(
    ("better", "worse"),
    [
        (family("a", "partly", "yes", "yes"), family("b", "no", "yes", "yes")),
        (family("a", "part", "part", "yes"), family("b", "yes", "partly", "yes")),
        (family("a", "yes", "yes", "no"), family("b", "yes", "partly", "yes")),
        (family("a", "yes", "yes", "partly"), family("b", "yes", "yes", "no")),
        (family("a", "yes", "partly", "no"), family("b", "partly", "yes", "yes")),  # the second needs the first too
        (family("used", "yes", "yes", "yes", size=90), family("b", "yes", "yes", "yes")),
        (family("a", "yes", "yes", "yes"), family("used", "yes", "yes", "partly")),
        (family("a", "yes", "yes", "yes", size=4), family("b", "yes", "yes", "yes", size=5)),
        (family("a", "no", "no", "no"), family("b")),
    ],
)
def test_the_better_family_is_first(better: Assessment, worse: Assessment) -> None:
    first = better.family.key
    assert order(better, worse)[0] == order(worse, better)[0] == first


APART = replace(PURPOSE, needs=tuple(Need(key, (key,), "5", k) for k, key in enumerate((A, B, C), 1)))


@pytest.mark.parametrize(
    ("better", "worse"),
    [
        (("planned", "yes", "yes"), ("no", "no", "yes")), (("partly", "partly", "partly"), ("no", "no", "yes")),
        (("no", "yes", "yes"), ("partly", "partly", "partly")), (("part", "part", "part"), ("partly", "yes", "yes")),
    ],
)  # fmt: skip
def test_two_needs_unmet_weigh_more_than_one_that_is_only_planned(better: Any, worse: Any) -> None:
    """In part is one, not at all two, not built three; a part to add is nothing: also beside a family that is used."""
    told = recommend(APART, (family("a", *better), family("used", *worse)))
    assert told[0].assessment.family.key == "a"


def test_what_is_there_and_what_can_be_added_rank_alike() -> None:
    for first, second in ((("part",) * 3, ("yes",) * 3), (("yes",) * 3, ("part",) * 3)):
        told = recommend(APART, (family("b", *second, size=5), family("a", *first, size=4)))
        assert told[0].assessment.family.key == "a", "by the fewer coefficients"


@pytest.mark.parametrize(
    ("given", "verdict"),
    [
        (("yes", "yes", "no"), "meets it"), (("part", "yes", "yes"), "meets it with parts added"),
        (("part", "partly", "yes"), "meets it in part"), (("no", "partly", "yes"), "does not meet it"),
        ((), "planned"),
    ],
)  # fmt: skip
def test_a_verdict_is_that_of_the_worst_need_that_must_be_met(given: tuple[str, ...], verdict: str) -> None:
    assert advise(PURPOSE, family("a", *given)).verdict == verdict


def test_advice_names_each_need_where_it_belongs() -> None:
    told = advise(PURPOSE, family("old", "part", "no", "partly"))
    assert (told.lacks, told.poor, told.add) == (("second (6)",), (), ("first (5)",))
    assert told.misses == ("nice",)
    assert (told.items, told.in_part) == ((2,), ())
    assert told.reason == "as said (3)"
    other = advise(PURPOSE, family("new", "partly", "yes", "part"))
    assert (other.lacks, other.poor, other.add, other.misses) == ((), ("first (5)", "second (6)"), (), ())
    assert other.in_part == (1, 2) == unmet(family("new", "partly", "yes", "part"), NEEDS, "partly")
    assert "4.1" in other.reason


def test_the_fittest_ship_meets_most_of_what_must_be() -> None:
    said = {"plain": ("no", "yes"), "partly": ("yes", "partly"), "added": ("yes", "part"), "able": ("yes", "yes")}
    ships = {name: {A: Finding(a, ""), B: Finding(b, ""), C: Finding("no", "")} for name, (a, b) in said.items()}
    best = []
    while ships:
        best.append(fittest(PURPOSE, family("a", "yes", "yes", "yes", by_ship=ships)))
        ships.pop(best[-1])
    assert set(best[:1]) == {"able"}
    assert best[-1] == "plain"
    assert fittest(PURPOSE, family("a")) == ""


def test_the_cost_is_the_shortest_time_of_a_step_and_lane(monkeypatch: pytest.MonkeyPatch) -> None:
    """With a clock that says how long each repetition takes: the least of them, over 128 lanes and the steps made."""
    seconds = iter([3.0, 0.5, 2.0, 4.0, 5.0, 6.0, 7.0])
    ticks = itertools.count()
    clock = [0.0]

    def now() -> float:
        clock[0] += next(seconds) if next(ticks) % 2 else 10.0
        return clock[0]

    monkeypatch.setattr(surveys.time, "perf_counter", now)
    counts: list[int] = []
    probe = Probe.of(load("mariner_nomoto"))
    run = surveys.run

    def counted(lanes: Lanes, steps: Steps, threads: int) -> Rollout:
        counts.append(steps.count)
        return run(lanes, steps, threads=threads)

    monkeypatch.setattr(surveys, "run", counted)
    assert nanoseconds(probe) == pytest.approx(0.5e9 / (128 * (counts[0] - 1)))
    assert len(set(counts)) == 1


def test_numbers_left_at_their_default_are_not_counted() -> None:
    """Nomoto's law has K and T beside its speed; Norrbin's term counts once it is given."""
    plain = load("mariner_nomoto")
    assert count(plain, ("K", "T", "alpha", "n_1", "delta_r")) == 2
    assert count(plain, ("*",)) == 3
    model: Any = plain.model
    assert count(replace(plain, model=replace(model, alpha=9.0)), ("*",)) == 4
    assert count(plain, ("nothing",)) == 0


@pytest.mark.slow
def test_a_family_has_the_range_of_its_ships_and_the_example_that_shows_most() -> None:
    flown = [load("mariner_nomoto"), load("tanker_nomoto")]
    kt = next(one for one in surveys.FAMILIES if one.key == "KT")
    alone = replace(kt, belongs=lambda ship: True, counted=("*",), declared={})
    model: Any = flown[0].model
    curved = replace(flown[0], name="curved", model=replace(model, alpha=9.0, n_1=2.0))
    found = assess(alone, [flown[0], curved], costs=False)
    assert found.ships == (flown[0].name, "curved")
    assert found.coefficients == (3, 5)
    assert found.cost is None
    shown = {name: sum(one.answer == "yes" for one in each.values()) for name, each in found.by_ship.items()}
    assert shown[found.example] == max(shown.values()) > min(shown.values())
    assert found.findings["linear"].answer == "yes", "the best of the ships"


@pytest.mark.slow
def test_the_linearised_specimen_keeps_the_straight_run_and_steps_a_second() -> None:
    """One sample at the straight run changes nothing; off it, the change is that of Euler's step of one second."""
    ship = vector_arx()
    model: Any = ship.model
    probe = Probe.of(load("mariner"))
    u, v, r = probe.at.state[3:6]
    orders = (0.0, probe.at.orders["delta"])
    state = (0.0, 0.0, 0.0, u, v, r)
    assert model.dt == 1.0
    still = model.advance(state, orders, surveys.CALM, model.begin(state, orders))[0]
    assert still == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
