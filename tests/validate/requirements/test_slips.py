"""The slip that was made is the one that is named, on families of every form; of a good ship none is."""

from __future__ import annotations

import math

import gallery
import pytest

from seatrial.ships import Ship
from seatrial.validate.requirements import Judgement, Table, scopes, slips, typical, whole
from seatrial.validate.requirements.draws import judged_by
from seatrial.validate.requirements.probe import Probe


def said(ship: Ship) -> list[str]:
    """What does not hold of the figures and numbers of a ship, in words."""
    p = Probe.of(ship)
    return [one.wrong for one in slips.named(p, [*typical.numbers(p), *whole.findings(p)]) if not one.holds]


@pytest.mark.slow
@pytest.mark.parametrize(("base", "paths", "change", "words"), [
    ("kvlcc2", "hull.N_r+hull.N_v", "exchanged", "N_r and N_v look exchanged"),
    ("kvlcc2", "rudder.a_H", "sign", "the sign of a_H looks wrong"),
    ("kvlcc2", "rudder.f_alpha", "radians", "f_alpha looks divided by 57.3"),
    ("suzaku", "hull.Y_v+hull.N_v", "exchanged", "N_v and Y_v look exchanged"),
    ("mariner", "derivatives.Y_v+derivatives.N_v", "exchanged", "N_v and Y_v look exchanged"),
    ("mariner", "derivatives.N_vvr", "sign", "the sign of N_vvr looks wrong"),
    ("mariner", "derivatives.Y_vvv", "tenfold", "Y_vvv looks a factor of ten too large"),
    ("mariner", "body.X_udot+body.Y_vdot", "exchanged", "X_udot and Y_vdot look exchanged"),
    ("modified_abkowitz_kvlcc2_l7", "derivatives.N_v+derivatives.N_r", "exchanged", "N_r and N_v look exchanged"),
    ("container_son_nomoto", "derivatives.N_v+derivatives.N_r", "exchanged", "N_r and N_v look exchanged"),
    ("supply_76m", "damping.N_r+damping.Y_v", "exchanged", "N_r and Y_v look exchanged"),
    ("supply_76m", "inertia.m_11+inertia.m_22", "exchanged", "m_11 and m_22 look exchanged"),
    ("gms_110", "hull.N_b", "sign", "the sign of N_b looks wrong"),
])  # fmt: skip
def test_the_slip_that_was_made_is_named(base: str, paths: str, change: str, words: str) -> None:
    found = said(gallery.changed(gallery.good(base), tuple(paths.split("+")), change))
    assert found
    assert words in found[0]


def test_a_good_ship_is_told_no_slip() -> None:
    assert said(gallery.good("kvlcc2")) == []


@pytest.mark.slow
def test_what_is_hardly_unusual_is_told_without_a_slip() -> None:
    """Mariner with N_v and N_r exchanged is as probable as Mariner: a doubt, and nothing that points to a slip."""
    (found,) = said(gallery.changed(gallery.good("mariner"), ("derivatives.N_v", "derivatives.N_r"), "exchanged"))
    assert "N_v is that of no such ship" in found
    assert "look" not in found


@pytest.mark.slow
def test_what_no_slip_explains_is_told_without_one() -> None:
    """Two numbers wrong at once: neither mended by itself makes all figures usual."""
    ship = gallery.changed(gallery.good("kvlcc2"), ("hull.N_v", "hull.Y_vvv"), "fourfold")
    found = said(ship)
    assert found
    assert not [one for one in found if "look" in one]


def test_a_slip_that_makes_another_figure_unusual_is_not_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """Places in the ranges: 1 is the end of the usual."""
    slip = {words: slips._Slip(words, {}) for words in ("moves it on", "mends it", "mends it less")}
    after = {"moves it on": {"a": 0.0, "b": 1.4}, "mends it": {"a": 0.1, "b": 0.2},
             "mends it less": {"a": 0.9, "b": 0.2}}  # fmt: skip
    monkeypatch.setattr(slips, "_places", lambda p: {"a": 1.8, "b": 0.2})
    p = Probe.of(gallery.good("mariner"))
    for tried, named in ((["moves it on"], ""), (["moves it on", "mends it"], "mends it"),
                         (["mends it less", "mends it"], "mends it")):  # fmt: skip
        monkeypatch.setattr(slips, "_tried", lambda *_, tried=tried: ((slip[one], after[one]) for one in tried))
        assert slips._likely(p) == named


@pytest.mark.parametrize(("value", "low", "high", "place"), [
    (0.5, 0.0, 1.0, 0.0), (1.0, 0.5, 1.0, 1.0), (-0.5, 0.0, 1.0, -2.0), (0.1, 0.02, 2.0, -math.log10(2.0)),
    (0.2, 0.02, 2.0, 0.0), (2.0, 0.02, 2.0, 1.0), (-0.1, 0.02, 2.0, -5.0), (99.0, 0.0, 1.0, 5.0),
])  # fmt: skip
def test_places_in_a_range_are_by_the_logarithm_where_it_spans_decades(
    value: float, low: float, high: float, place: float
) -> None:
    assert slips._place(value, low, high) == pytest.approx(place, abs=1e-12)


@pytest.mark.slow
def test_draws_of_a_fit_are_judged_without_a_search(monkeypatch: pytest.MonkeyPatch) -> None:
    """Numbers of a fit were not written by hand, and draws that fail alike are counted by their reason."""
    asked: list[Probe] = []
    monkeypatch.setattr(slips, "_likely", lambda p: asked.append(p) or "a slip")
    item = scopes.COLLISION_AVOIDANCE[2]
    wrong = gallery.changed(gallery.good("mariner"), ("derivatives.Y_v", "derivatives.N_v"), "exchanged")
    table = Table("mariner", "collision-avoidance", ((item, Judgement("pass", "good")),))
    ((_, found),) = judged_by(table, [wrong], 0.9).rows
    assert found.verdict == "fail"
    assert not asked
    assert "a slip" in scopes.checked(item, Probe.of(wrong)).reason
    assert len(asked) == 1
