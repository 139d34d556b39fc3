"""What the verbs take where nothing is given is what the command line takes, and calm is calm."""

from __future__ import annotations

import inspect
import re
from dataclasses import fields

import numpy as np
import pytest

import seatrial as st
from seatrial.campaign.schema import CampaignFile
from seatrial.face import orders
from seatrial.face.orders import Order, Weather
from seatrial.face.tables import html, table_of
from seatrial.manoeuvres import Given, Settings
from seatrial.report.blocks import plain_text
from seatrial.workflow.asked import Span
from seatrial.workflow.simulation import known, simulate


@pytest.mark.slow
def test_weather_that_is_not_given_is_none() -> None:
    assert {name: value for name, value in vars(Weather()).items() if value} == {"seed": 1}
    ship = st.load("esso_osaka_3m")
    calm = ship.simulate(st.Straight(), duration=10.0, weather=Weather())
    bare = simulate("esso_osaka_3m", "straight", span=Span(10.0)).trial
    for name in ("x", "y", "psi", "u"):
        assert np.array_equal(calm[name], bare[name])
    assert np.abs(calm["y"]).max() < 1e-9


def test_seeds_are_those_of_the_command_line() -> None:
    usual = inspect.signature(Settings).parameters["seed"].default
    seeded = [one for one in vars(orders).values() if isinstance(one, type) and issubclass(one, Order)
              and "seed" in {f.name for f in fields(one)}]  # fmt: skip
    assert len(seeded) >= 3
    assert {one().seed for one in seeded} == {usual}  # type: ignore[attr-defined]
    assert {kind for kind, one in known().items() if "seed" in one.takes} == {one.kind for one in seeded if one.kind}
    asked = inspect.signature(st.campaign).parameters
    for name in ("seed", "design"):
        assert asked[name].default == vars(CampaignFile)[name]


def test_a_ship_tells_its_approach_and_how_many_numbers_it_has() -> None:
    ship = st.load("kvlcc2_l7")
    page = ship._repr_html_()
    rows = dict(re.findall(r"<dt>(.*?)</dt><dd>(.*?)</dd>", page))
    assert rows["approach"] == "1.179 m/s, with the revolutions that hold it"
    assert (rows["L_pp"], rows["model"], rows["controls"]) == ("7 m", "Mmg", "n_P, delta")
    assert int(rows["parameters"]) == len(ship.parameters) == len(list(ship.parameters))
    turning = st.load("esso_osaka_3m")
    held = re.search(r"m/s, ([0-9.]+) 1/s", turning._repr_html_())
    assert (held is None) == (turning.n_P is None)
    if held:
        assert float(held[1]) == pytest.approx(turning.n_P, rel=1e-3)


@pytest.mark.slow
def test_a_run_in_a_notebook_has_its_indices_and_a_prediction_has_none() -> None:
    run = st.load("kvlcc2_l7").simulate(st.Turning())
    assert "advance" in run._repr_html_()
    bare = st.load("kvlcc2_l7").simulate(Given(("n_P", "delta")), duration=2.0)
    assert run._repr_html_().count("<table>") == bare._repr_html_().count("<table>") + 1


def test_a_table_shows_four_digits_and_numbers_to_the_right() -> None:
    rows = (("x", 3.14159265), ("longer", -12345.678), ("none", None), ("n", 7))
    table = table_of("a title", ("name", "value"), rows, ("a note",))
    lines = [*plain_text((table,))]
    assert (lines[0], lines[-1]) == ("a title", "a note")
    assert [line.split()[1:] for line in lines[2:4]] == [["3.142"], ["-12346"]]
    assert len({len(line) for line in (lines[1], lines[2], lines[3], lines[5])}) == 1  # they end alike
    assert [line[0] for line in lines[1:6]] == ["n", "x", "l", "n", "n"]
    assert table.words == (0,)
    assert 'class="text"' in html((table,))
    assert [*plain_text((table_of("empty", ("a",), (), ("nothing",)),))] == ["empty", "nothing"]


def test_the_verb_of_a_trial_draws_as_many_outlines_as_its_function() -> None:
    from seatrial.face.plots import track

    asked = [inspect.signature(one).parameters["outlines"].default for one in (st.Trial.plot, track)]
    assert asked[0] == asked[1] > 0
