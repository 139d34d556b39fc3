"""Residuals on a page, and its first lines: whether to trust a fit, why, and what next; controls under the tracks."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from example_report import fit, report, weaving
from seatrial.identify.diagnosis.channels import Channel, Residuals
from seatrial.identify.diagnosis.findings import Diagnosis, Suspicion
from seatrial.report import diagnosis, figures
from seatrial.report.page import html
from seatrial.report.report import worse_words


def channel_of(noise, size, alike):
    return Channel(noise=noise, size=size, alike=alike, alike_sigma=0.01, lasting=0.0, count=9000)


CALM = channel_of(0.5, 1.01, 0.01)
OFFSET = Suspicion("offset.delta", "an offset of delta", "deg", np.radians(1.0), 900.0, 0.8, np.radians(1.5), 1e-4,
                   {"hull.Y_v": -13.0})  # fmt: skip


def judged(channel=CALM, rows=9000, **changes):
    rng = np.random.default_rng(1)
    one = {name: Residuals(np.arange(rows) * 1.0, {"x": rng.normal(size=rows), "r": rng.normal(size=rows)},
                           0.6 * np.sin(np.arange(rows) / 50.0)) for name in ("turn", "zigzag")}  # fmt: skip
    channels = {"x": channel, "r": channel_of(np.radians(0.01), 1.0, 0.0)}
    found = Diagnosis(**{"channels": channels, "residuals": one, "control": ("delta", "rad"), **changes})
    return replace(fit(), diagnosis=found)


def plain(body):
    return re.sub(r"<[^>]+>", " ", html(body))


def test_a_fit_that_was_not_tested_has_neither():
    assert diagnosis.verdict(fit()) == diagnosis.section(fit()) == ()


def test_the_first_lines_of_a_sound_fit_name_what_is_left_open():
    words = plain(diagnosis.verdict(judged()))
    assert "The model explains the data" in words
    assert "1 of 2 parameters are identified" in words
    assert "Do not read as physics: rudder.t_R" in words


def test_the_first_lines_name_the_cause_and_the_remedy():
    bad = judged(channel_of(0.5, 4.0, 0.9), suspicions=(OFFSET,), widened={"hull.Y_v": 18.0})
    words = plain(diagnosis.verdict(bad))
    assert "The model does not explain the data." in words
    assert "No parameter counts as identified, and sigma is up to 18 times" in words
    assert "4.0 times the sensor noise (of x) and correlated (0.90" in words
    assert "The likeliest cause: an offset of delta of 1.5 ± 0.006 deg would remove 80% of the" in words
    assert "offset.delta" in words
    assert "missing" not in words


@pytest.mark.parametrize("suspicions", [(), (replace(OFFSET, share=0.01),)])
def test_where_no_instrument_accounts_for_it_the_model_is_to_blame(suspicions):
    words = plain(diagnosis.verdict(judged(channel_of(0.5, 300.0, 0.9), suspicions=suspicions)))
    assert "Look for a term of the model, or an input, that is missing" in words
    assert "likeliest cause" not in words


def test_the_section_has_units_trials_and_the_errors_of_fixed_parameters():
    bad = judged(channel_of(0.5, 4.0, 0.9), suspicions=(OFFSET,), shares={"body.m": 0.05},
                 fixed=(("body.m", "hull.Y_v", 3.0), ("body.d", "hull.Y_v", -2.0)),
                 carried={"hull.Y_v": 3.0})  # fmt: skip
    words = plain(diagnosis.section(bad))
    for what in ("0.50 m", "0.010°/s", "size, correlation", "zigzag", "delta [°]: − port, + starboard",
                 "1.5 ± 0.006 deg", "hull.Y_v −13.0", "5.0 %", "10 %", "−2.0",
                 "a further 3.0 times its sigma"):  # fmt: skip
        assert what in words, what


def test_the_drawing_is_small_however_long_the_logs_are():
    drawn = diagnosis.drawing(judged().diagnosis)
    assert drawn.count("M") < 4000
    assert len(drawn) < 100_000
    assert "nan" not in drawn


def test_a_gap_and_a_control_that_never_moves_are_drawn():
    found = judged().diagnosis
    still = {name: replace(one, control=np.zeros_like(one.control),
                           values={**one.values, "x": np.full_like(one.t, np.nan)})
             for name, one in found.residuals.items()}  # fmt: skip
    assert "nan" not in diagnosis.drawing(replace(found, residuals=still))


def test_the_rudder_and_the_revolutions_are_drawn_below_the_motion():
    t = weaving().t
    controls = {"delta_1": 0.2 + 0.0 * t, "delta_2": -0.2 + 0.0 * t, "n_P": 1.5 + 0.0 * t, "n_P_cmd": 1.6 + 0.0 * t}
    _, axes = figures.motion_canvas(weaving().having(**controls))
    rudders, shaft = axes[len(figures.MOTION):]
    assert [line.label for line in rudders.lines[:2]] == ["delta_1", "delta_2"]
    assert rudders.lines[0].y[0] == pytest.approx(np.degrees(0.2))
    assert [one.text for one in rudders.texts] == ["stbd", "port"]
    assert rudders.texts[0].height > rudders.texts[1].height
    assert shaft.y.name == "n_P [1/s]"
    assert [line.label for line in shaft.lines] == ["n_P"]
    low, high = shaft.y.ends
    assert high - low >= 0.1 * 1.5


def test_a_trial_without_controls_has_the_motion_only():
    assert len(figures.motion_canvas(weaving())[1]) == len(figures.MOTION)


def test_a_fit_worse_than_the_ship_it_began_from_is_told_first():
    good = report()
    swapped = [replace(c, label={"fitted": "published", "published": "fitted"}.get(c.label, c.label))
               for c in good.comparisons if c.restart]  # fmt: skip
    bad = replace(good, comparisons=tuple(swapped))
    (line,) = worse_words(bad)
    assert line.startswith("worse than untuned: standardised error")
    assert worse_words(good) == ()


def test_no_correlation_is_shown_below_minus_one():
    words = plain(diagnosis.section(judged(channel_of(0.5, 0.7, -2.0))))
    assert "−1.0" in words
    assert "−2.0" not in words
