"""Identifiability as sections of a page: complete, self-contained, well formed, honest about misfit."""

import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from seatrial.belief.ensemble import bands, ensemble
from seatrial.identify.diagnosis.findings import Diagnosis, Suspicion
from seatrial.identify.posterior.misfit import Misfit, Remainder, misfit
from seatrial.identify.posterior.profile import profiles
from seatrial.identify.trajectory.multistart import MultiStart
from seatrial.report.identifiability import sections
from seatrial.report.page import Page
from seatrial.sensors import Sensors
from suzaku_turns import GNSS, TRUTH, manoeuvre, problem, turn

pytestmark = pytest.mark.slow

PATHS = ("hull.R_0", "propeller.w_P0", "rudder.a_H", "rudder.x_H")
ESTIMATOR = MultiStart(starts=2, method="euler", initial="measured")


@pytest.fixture(scope="module")
def parts():
    told = problem(angles=(10, -35), duration=200.0, paths=PATHS)
    fit = ESTIMATOR.fit(told)
    group = ensemble(fit, told, ESTIMATOR, members=6)
    seen = Sensors(GNSS).read(turn(TRUTH, 20), np.random.default_rng(1))
    return (fit, profiles(fit, told, ESTIMATOR), group, [bands(group, seen, manoeuvre(20))],
            misfit(fit, told, ESTIMATOR))  # fmt: skip


def test_all_sections_are_there_and_well_formed(parts):
    fit, known, group, predicted, left = parts
    made = sections(fit, known, group=group, predicted=predicted, left=left)
    assert [one.title for one in made] == [
        "What the data determine", "Ends of the searches", "Analysis of the residuals", "Prediction intervals",
    ]  # fmt: skip
    whole = Page("Identifiability", tuple(made)).html
    ElementTree.fromstring(f"<x>{''.join(one.html for one in made)}</x>")
    assert "http" not in whole.replace("http-equiv", "")
    assert "nan" not in whole.lower().replace("unantic", "")
    for path in PATHS:
        assert f"Profile of {path}" in whole
    assert "tactical diameter" in whole
    assert whole.count("<svg") == len(PATHS) + 1 + 1 + 3
    assert len(whole) < 500_000


def test_drawings_stay_within_their_frames(parts):
    fit, known, _, predicted, _ = parts
    drawn = 0
    for section in sections(fit, known, predicted=predicted):
        for svg in re.findall(r"<svg.*?</svg>", section.html, re.DOTALL):
            width, height = map(float, re.search(r'viewBox="0 0 (\S+) (\S+)"', svg).groups())
            for pairs in re.findall(r'points="([^"]*)"', svg):
                xy = np.array([pair.split(",") for pair in pairs.split()], dtype=float).reshape(-1, 2)
                assert np.all((xy >= -1) & (xy <= [width + 1, height + 1]))
                drawn += len(xy)
    assert drawn > 20


def test_only_what_is_given_is_shown(parts):
    fit, known, *_ = parts
    assert [one.title for one in sections(fit, known)] == ["What the data determine", "Ends of the searches"]


def test_a_lacking_model_is_said_first(parts):
    fit, known, *_ = parts
    left = Misfit((Remainder("x", 3.0, 0.8, -20.0, 900),))
    body = sections(fit, known, left=left)[-1].html
    assert body.partition("</h2>")[2].startswith('<div class="note">The model lacks something')
    assert "3 times the sensor noise" in body


def test_no_profile_is_identified_where_the_model_does_not_explain_the_data(parts):
    fit, known, *_ = parts
    inside = [0.5 * (p.low + p.high) for p in known.profiles]
    sharp = replace(known, profiles=tuple(
        replace(p, best=at, interval=(at, at), closed=(True, True), loose=False)
        for p, at in zip(known.profiles, inside, strict=True)
    ))  # fmt: skip
    offset = Suspicion("offset.delta", "an offset of delta", "deg", 0.02, 900.0, 0.8, 0.03, 1e-4, {PATHS[0]: 9.0})
    found = {status: sections(replace(fit, diagnosis=one), sharp)[0].html
             for status, one in (("identified", Diagnosis()), ("graded", Diagnosis(suspicions=(offset,))))}
    for status, body in found.items():
        assert set(re.findall(r"<td[^>]*>(identified|graded)</td>", body)) == {status}
        assert body.partition("</h2>")[2].startswith(f"<p>{len(PATHS)} {status}.")
