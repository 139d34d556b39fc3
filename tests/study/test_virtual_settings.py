"""What a trial of [virtual] has of its own: settings of its manoeuvre and a current; and what of both the log tells."""

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from seatrial.core.records import filled
from seatrial.identify import StudyError
from seatrial.study import virtual
from seatrial.study.schema import VirtualTable

STUDY = (Path(__file__).parents[2] / "studies" / "milliampere_full.toml").read_text(encoding="utf-8")


def source(*changes):
    text = STUDY.replace("duration = 60.0", "duration = 4.0")
    for before, after in changes:
        assert before in text
        text = text.replace(before, after)
    return virtual.read(filled(VirtualTable, tomllib.loads(text)["virtual"], "s.toml", StudyError))


def first(read):
    return replace(read, sails=dict(list(read.sails.items())[:1])).run()[0]


def test_each_trial_has_its_settings_and_its_current():
    read = source()
    sail = read.sails["surge 3"]
    assert (sail.policy.X, sail.policy.X_mean, sail.policy.Y, sail.policy.N) == (400.0, 300.0, 0.0, 0.0)
    assert (sail.policy.K_p, sail.policy.x_second, sail.policy.seed) == (600.0, -1.8, 3)
    assert sail.speed == 0.0
    flows = [read.weather(k).series(0.2, 2)[0, 2:4] for k in range(3)]
    assert [np.hypot(*flow) for flow in flows] == pytest.approx([0.15, 0.20, 0.10])
    assert flows[0][0] == pytest.approx(0.15 * np.cos(np.radians(77.0)))
    assert read.weather(0).series(0.2, 2)[0, 0] != read.weather(1).series(0.2, 2)[0, 0]  # gusts of their own


@pytest.mark.parametrize(
    ("written", "there"),
    [
        ('["wind"]', {"U_T", "gamma_T"}),
        ('["current"]', {"U_C", "gamma_C"}),
        ("true", {"U_T", "gamma_T", "U_C", "gamma_C"}),
        ("false", set()),
    ],
)
def test_the_log_tells_what_it_is_said_to_tell(written, there):
    trial = first(source(('known = ["wind"]', f"known = {written}")))
    assert {"U_T", "gamma_T", "U_C", "gamma_C"} & set(trial.channels) == there


def test_what_acts_is_what_the_log_holds():
    trial = first(source())
    assert set(trial.meta["held"]) == {"f_bow", "alpha_bow", "f_stern", "alpha_stern"}


@pytest.mark.parametrize(
    ("before", "after", "told"),
    [
        ("X_mean = 300.0", "X_maen = 300.0", "virtual.trials.surge 3.set: .*X_mean"),
        ("hold = 8.0", "hold = 0.0", "virtual.trials.surge 1: hold"),
    ],
)
def test_bad_settings_are_named(before, after, told):
    with pytest.raises(StudyError, match=told):
        source((before, after))
