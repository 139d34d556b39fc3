"""Faults of the heel are told, sound logs are not: degrees, signs, offsets, frozen sensors."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from seatrial.data import Trial
from seatrial.data.check import Finding, check
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load
from seatrial.simulate.run import simulate

DEGREES = 180.0 / math.pi
NOISE = {"x": 0.5, "y": 0.5, "psi": 2e-3, "u": 0.02, "v_m": 0.02, "r": 1e-4, "phi": 2e-3, "p": 4e-4}


@cache
def log(name: str, kind: str, noisy: bool = True) -> Trial:
    """A log of a ship that rolls, sampled each half second."""
    ship, policy = load(name), (Turning(0.0, 0.5) if kind == "turning" else Zigzag(0.0, 0.3, 0.3, 1.0))
    policy = replace(policy, n_P=80.0 / 60.0 if name.startswith("container") else 10.0)
    trial = simulate(ship, policy, duration=400.0 if name.startswith("container") else 150.0, dt=0.05, every=10)
    if not noisy:
        return trial
    rng = np.random.default_rng(0)
    noise = {n: trial[n] + sd * rng.standard_normal(len(trial)) for n, sd in NOISE.items()}
    return replace(trial.having(**noise), meta={**trial.meta, "source": "virtual"})


def heard(trial: Trial, **channels: Any) -> list[Finding]:
    """Warnings and errors about heel or roll rate."""
    found = check(trial.having(**channels))
    return [one for one in found if set(one.channels) & {"phi", "p"} and one.severity != "info"]


LOGS = [(n, k) for n in ("container_son_nomoto", "naval_blanke") for k in ("turning", "zigzag")]


@pytest.mark.parametrize(("name", "kind"), LOGS)
@pytest.mark.parametrize("noisy", [True, False])
def test_a_sound_log_is_left_alone(name: str, kind: str, noisy: bool) -> None:
    assert not heard(log(name, kind, noisy))


@pytest.mark.slow
@pytest.mark.parametrize(("name", "kind"), LOGS)
def test_degrees_are_told_from_radians(name: str, kind: str) -> None:
    one = log(name, kind)
    phi, p = one["phi"] * DEGREES, one["p"] * DEGREES
    for changes, what, channels in (
        ({"phi": phi}, "heel is in degrees", ("phi",)),
        ({"phi": phi, "p": p}, "heel is in degrees", ("phi", "p")),
        ({"p": p}, "roll rate is in degrees", ("p",)),
    ):
        (found,) = heard(one, **changes)
        assert (found.severity, found.what, found.channels, found.kind) == ("error", what, channels, "unit")
        mended = one.having(**changes)
        for step in found.steps:
            mended = step.apply(mended)
        assert np.allclose(mended["phi"], one["phi"])
        assert np.allclose(mended["p"], one["p"])


@pytest.mark.slow
@pytest.mark.parametrize(("name", "kind"), LOGS)
def test_signs_are_told_by_the_turning_and_by_each_other(name: str, kind: str) -> None:
    one = log(name, kind)
    for flipped, channels, severity in ((("phi",), ("phi",), "warning"), (("phi", "p"), ("phi", "p"), "warning"),
                                        (("p",), ("p",), "error")):  # fmt: skip
        (found,) = heard(one, **{n: -one[n] for n in flipped})
        assert (found.severity, found.channels, found.key) == (severity, channels, "sign")


@pytest.mark.parametrize("name", ["container_son_nomoto", "naval_blanke"])
def test_an_offset_shows_between_turns_to_either_side(name: str) -> None:
    one = log(name, "zigzag")
    (found,) = heard(one, phi=one["phi"] - math.radians(2.0))
    assert found.key == "heel_offset"
    assert found.steps[0].amount[0] == pytest.approx(math.radians(2.0), abs=math.radians(0.3))


def test_an_offset_shows_on_a_straight_course() -> None:
    one = log("naval_blanke", "turning")
    before = {n: np.concatenate([np.full(100, one[n][0]), one[n]]) for n in one.channels}
    whole = Trial("whole", 0.5 * np.arange(len(one) + 100), before, one.units, one.meta)
    rng = np.random.default_rng(1)
    phi, r = whole["phi"] + math.radians(1.0), whole["r"].copy()
    phi[:100] += 2e-3 * rng.standard_normal(100)
    r[:100] += 1e-4 * rng.standard_normal(100)
    assert "heel_offset" in {one.key for one in heard(whole, phi=phi, r=r)}


def test_a_frozen_inclinometer_is_told() -> None:
    one = log("naval_blanke", "zigzag")
    phi = one["phi"].copy()
    phi[100:] = phi[100]
    assert any(found.key == "frozen" and "phi" in found.channels for found in heard(one, phi=phi))


def test_a_log_without_heel_or_without_turning_is_not_judged() -> None:
    one = log("naval_blanke", "zigzag")
    assert not heard(Trial("bare", one.t, {n: v for n, v in one.channels.items() if n not in ("phi", "p")}))
    still = {n: np.zeros(len(one)) for n in ("r", "v_m", "psi", "y")}
    assert not [found for found in heard(one, **still) if found.key in ("sign", "unit")]
