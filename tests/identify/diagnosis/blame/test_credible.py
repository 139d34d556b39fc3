"""Whether an instrument is at fault or the model: gains in other trials, and what the logs say without a model."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from seatrial.data import Array, Trial
from seatrial.identify.diagnosis.blame.gain import CERTAIN, Gain, gain, gains
from seatrial.identify.diagnosis.blame.witness import Witness, witnesses
from seatrial.identify.diagnosis.channels import Channel
from seatrial.identify.diagnosis.findings import Diagnosis, Suspicion

DEG = math.radians(1.0)

# -- gains


def blocks(seed: int, lanes: int, rows: int = 40) -> tuple[Array, Array]:
    """Noise of one, and a derivative by a suspect."""
    rng = np.random.default_rng(seed)
    return rng.standard_normal((lanes, rows)), rng.standard_normal((lanes, rows))


def left_out(e: Array, own: Array, groups: list[Array]) -> float:
    """Squares that each group loses by the size which least squares finds in the others."""
    gained = 0.0
    for group in groups:
        others = np.setdiff1d(np.arange(len(e)), group)
        size, *_ = np.linalg.lstsq(own[others].reshape(-1, 1), -e[others].ravel(), rcond=None)
        gained += float((e[group] ** 2).sum() - ((e[group] + size * own[group]) ** 2).sum())
    return gained


@pytest.mark.parametrize(("trial", "groups"), [
    ([0, 0, 1, 1, 2, 2], [[0, 1], [2, 3], [4, 5]]), ([7, 7, 7, 9, 9, 9], [[k] for k in range(6)])])  # fmt: skip
def test_a_gain_is_what_a_size_from_the_other_trials_takes_away(trial: list[int], groups: list[list[int]]) -> None:
    """Of two trials each says hardly anything of the other: then windows judge each other."""
    e, own = blocks(1, 6)
    e -= np.array([0.3, 0.5, 0.1, 0.4, 0.8, 0.2])[:, None] * own
    gained, cost, expected = left_out(e, own, [np.array(g) for g in groups]), float((e**2).sum()), 128.0
    found = gain(e, own, np.array(trial), expected)
    assert found.share == pytest.approx(gained / (cost - expected - 32.0))  # two deviations of chi square: 2 sqrt(256)
    # Residuals that are hardly larger than noise need no more than that an error is sure.
    assert gain(e, own, np.array(trial), cost).share == 1.0


def test_an_error_of_another_sign_in_each_trial_gains_nothing_and_is_not_sure() -> None:
    e, own = blocks(2, 8)
    trial = np.arange(8)
    same, other = e - 2.0 * own, e - np.array([2.0, -2.0] * 4)[:, None] * own
    steady, mixed = (gain(one, own, trial, float(e.size)) for one in (same, other))
    assert steady.share > 0.9
    assert steady.credible
    assert mixed.share < 0.0
    assert not mixed.credible


def test_the_scatter_counts_windows_that_are_alike_within_a_trial_once() -> None:
    """Copies of a window hold no more than it does: the error stays as many deviations away as in one of each."""
    e, own = blocks(3, 6)
    e -= 0.5 * own
    once = gain(e, own, np.arange(6), 200.0)
    again = gain(np.repeat(e, 5, axis=0), np.repeat(own, 5, axis=0), np.repeat(np.arange(6), 5), 1000.0)
    assert again.deviates == pytest.approx(once.deviates, rel=1e-9)
    # by hand: the size over the root of the sum of squared scores, with the degree of freedom of the mean
    size = -float((own * e).sum() / (own**2).sum())
    scores = (own * (e + size * own)).sum(axis=1)
    assert once.deviates == pytest.approx(abs(size) * float((own**2).sum()) / math.sqrt(1.2 * float((scores**2).sum())))


@pytest.mark.slow
def test_deviates_of_no_error_are_standard_where_residuals_last() -> None:
    """Noise that is alike over a window: white noise would call every third of these beyond five deviations."""
    rng = np.random.default_rng(4)
    found, white = [], []
    for _ in range(400):
        shape = np.ones((24, 30)) * rng.standard_normal((24, 1))
        e = 3.0 * rng.standard_normal((24, 1)) * np.ones((24, 30)) + rng.standard_normal((24, 30))
        found.append(gain(e, shape, np.arange(24), 720.0).deviates)
        white.append(abs((e * shape).sum()) / math.sqrt((shape**2).sum()))
    assert float(np.mean(np.square(found))) == pytest.approx(1.0, abs=0.35)  # of 400 squares, t of 23 degrees: .08
    assert np.mean(np.array(white) > 5.0) > 0.5


def test_what_is_certain_is_no_misfit_of_the_others() -> None:
    e, own = blocks(5, 6, 400)
    own = np.stack([own, blocks(6, 6, 400)[1]], axis=-1)
    e = e - 9.0 * own[..., 0] - 0.5 * own[..., 1]
    alone, beside = (gains(e, own, np.arange(6), some, float(e.size))[1] for some in ((), (0,)))
    assert alone.share < 0.02
    assert beside.share > 0.8
    # One that is nearly the same is judged by what it has of its own.
    near = np.stack([own[..., 0], own[..., 0] + 0.3 * own[..., 1]], axis=-1)
    found = gains(e, near, np.arange(6), (0,), float(e.size))[1]
    first = near[..., 0].ravel()
    rest, mine = (x.ravel() - first * (first @ x.ravel()) / (first @ first) for x in (e, near[..., 1]))
    wanted = gain(rest.reshape(e.shape), mine.reshape(e.shape), np.arange(6), float(e.size))
    assert (found.share, found.deviates) == pytest.approx((wanted.share, wanted.deviates))
    assert found.share > 0.8
    none = np.zeros((6, 400, 1))
    assert gains(e, none, np.arange(6), (), 1.0)[0].deviates == 0.0


@pytest.mark.parametrize(("given", "credible"), [
    ((0.51, 5.1), True), ((0.49, 5.1), False), ((0.51, 4.9), False)])  # fmt: skip
def test_an_error_is_credible_where_it_is_sure_and_explains_most(given: tuple[float, float], credible: bool) -> None:
    assert Gain(*given).credible == credible


# -- what the logs say without a model


def log(seed: int = 0, errors: dict[str, float] | None = None, name: str = "a", **gone: float) -> Trial:
    """A weaving ship of 60 m, its positions and speeds those of an exact path, read with white noise and errors."""
    of = {"bias_psi": 0.0, "ahead": 0.0, "aside": 0.0, "late_r": 0.0, "scale_r": 0.0, "north": 0.0, "late_x": 0.0,
          **(errors or {})}  # fmt: skip
    t = np.arange(0.0, 600.0)
    rng = np.random.default_rng(seed)
    fine = np.arange(-20.0, 620.0, 0.05)

    def rate(s: Array) -> Array:
        return np.asarray(0.012 * np.sin(s / 23.0) + 0.009 * np.sin(s / 41.0 + seed), dtype=np.float64)

    r = rate(fine)
    psi = np.cumsum(r) * 0.05 + seed
    u, v = 6.0 + 0.5 * np.cos(fine / 90.0), -9.0 * r
    x, y = (np.cumsum(one) * 0.05 for one in (u * np.cos(psi) - v * np.sin(psi), u * np.sin(psi) + v * np.cos(psi)))

    def at(values: Array, late: float = 0.0) -> Array:
        return np.asarray(np.interp(t - late, fine, values), dtype=np.float64)

    c, s = np.cos(at(psi)), np.sin(at(psi))
    read = {
        "x": at(x, of["late_x"]) + of["ahead"] * c - of["aside"] * s + of["north"] * t,
        "y": at(y, of["late_x"]) + of["ahead"] * s + of["aside"] * c,
        "psi": at(psi) + of["bias_psi"], "r": at(r, of["late_r"]) * (1.0 + of["scale_r"]), "u": at(u), "v_m": at(v),
    }  # fmt: skip
    noise = {"x": 0.1, "y": 0.1, "psi": 0.1 * DEG, "r": 0.01 * DEG, "u": 0.02, "v_m": 0.02}
    channels = {key: value + noise[key] * rng.standard_normal(t.size) for key, value in read.items() if key not in gone}
    return Trial(name, t, channels, {}, {"L_pp": 60.0})


SHOWN = {
    "bias.psi": ("bias_psi", 2.0 * DEG), "antenna.ahead": ("ahead", 4.0), "antenna.starboard": ("aside", -4.0),
    "delay.r": ("late_r", 1.5), "scale.r": ("scale_r", 0.06), "delay.position": ("late_x", 2.0),
}  # fmt: skip


@pytest.mark.parametrize("name", SHOWN)
def test_the_logs_show_the_error_that_was_planted_and_deny_the_others(name: str) -> None:
    key, size = SHOWN[name]
    found = witnesses([log(seed, {key: size}) for seed in range(3)])
    assert found[name].shown
    assert found[name].size == pytest.approx(size, rel=0.08)  # one step towards it, of large errors
    assert not found[name].denies(size)
    assert not found[name].denies(5.0 * size)
    # At a steady speed an antenna ahead is a receiver that is early by the time to get there.
    same = {"delay.receiver"} if name == "antenna.ahead" else set[str]()
    assert {one for one, witness in found.items() if witness.shown} - same == {name}
    if name != "delay.r":
        assert found["delay.r"].denies(1.5)
    if name != "antenna.starboard":
        assert found["antenna.starboard"].denies(-4.0)


def test_logs_without_a_fault_deny_what_a_model_would_blame_and_allow_what_they_cannot_tell() -> None:
    found = witnesses([log(seed) for seed in range(3)])
    assert not any(one.shown for one in found.values())
    for name, size in (("bias.psi", DEG), ("antenna.ahead", 2.0), ("delay.position", 1.0), ("delay.r", 0.5),
                       ("scale.r", 0.05), ("deviation.east", DEG)):  # fmt: skip
        assert found[name].denies(size), name
        assert not found[name].denies(0.5 * found[name].sigma), name


@pytest.mark.slow
def test_estimates_from_the_logs_scatter_as_they_say() -> None:
    found = [witnesses([log(seed)]) for seed in range(20, 44)]
    for name in ("antenna.ahead", "delay.r", "bias.psi"):
        z = np.array([one[name].size / one[name].sigma for one in found])
        # of 24 squares; windows overlap, and a floor of what instruments agree to makes sigma the larger
        assert 0.1 < float(np.mean(z**2)) < 2.0, name


def test_a_current_in_speeds_through_the_water_is_no_error_of_an_instrument() -> None:
    found = witnesses([log(seed, {"north": 0.4}) for seed in range(3)])
    assert not any(one.shown for one in found.values())
    assert found["antenna.ahead"].denies(3.0)


def test_without_a_second_instrument_there_is_no_witness() -> None:
    found = witnesses([log(seed, x=0.0, y=0.0) for seed in range(3)])
    assert not {"antenna.ahead", "bias.psi", "scale.u"} & set(found)
    assert found["delay.r"].denies(1.0)
    assert witnesses([log(0, x=0.0, y=0.0, r=0.0)]) == {}


@pytest.mark.slow
def test_yaw_that_follows_the_rudder_says_how_late_the_rudder_was_logged() -> None:
    """Nomoto's equation, T r' + r = K delta; the hull leaves .35 root (L/g) open, .87 s."""
    t, T, K = np.arange(0.0, 900.0), 12.0, 0.05
    fine = np.arange(0.0, 900.0, 0.02)
    delta = 0.17 * np.sign(np.sin(2.0 * np.pi * fine / 130.0))
    r = np.zeros(fine.size)
    for k in range(1, fine.size):
        r[k] = r[k - 1] + 0.02 * (K * delta[k - 1] - r[k - 1]) / T
    rng = np.random.default_rng(0)
    for late in (0.0, 3.0):
        read = {"delta": np.interp(t - late, fine, delta), "r": np.interp(t, fine, r), "u": 5.0 + 0.0 * t}
        noisy = {name: values + 1e-4 * rng.standard_normal(t.size) for name, values in read.items()}
        found = witnesses([Trial("a", t, noisy, {}, {})], 60.0)["delay.delta"]
        assert found.size == pytest.approx(late, abs=0.87)
        assert found.shown == (late > 0)
        assert found.denies(-3.0) == (late == 0)


def helm(angles: tuple[float, ...], straight: float) -> Trial:
    """A ship of 60 m that goes straight, then holds each rudder angle of its indicator [deg] and turns by what acts."""
    t = np.arange(0.0, 60.0 * (len(angles) + 1))
    told = np.repeat([straight, *angles], 60)
    rng = np.random.default_rng(len(angles))
    r = np.convolve(0.002 * (told - straight) * DEG * 20.0, np.exp(-np.arange(60.0) / 10.0) / 10.0)[: t.size]
    noise = rng.standard_normal((2, t.size))
    read = {"delta": told * DEG + 0.05 * DEG * noise[0], "r": r + 1e-5 * noise[1], "u": np.full(t.size, 6.0)}
    return Trial("a", t, read, {}, {"L_pp": 60.0})


@pytest.mark.parametrize(("angles", "straight", "offset"), [
    ((12.5, -7.5, 22.5, -17.5), 2.5, 2.5), ((12.5, -7.5, 22.5, -17.5, 27.5), 2.5, 2.5),
    ((8.8, -11.2, 18.8, -21.2, -36.2), -1.2, -1.2),
    ((10.0, -10.0, 20.0, -20.0), 0.0, None), ((10.0, -10.0, 20.0, -20.0, 25.0), 0.0, None),
    ((10.0, -10.0, 20.0, -20.0), 2.5, None),  # a ship that needs a rudder to go straight
    ((10.0, 15.0, 20.0, 25.0, -10.0, -20.0), 2.5, None),  # the same, or an offset: both explain these angles
    ((12.5, -7.5, 20.0, -20.0, 30.0), 2.5, None), ((12.5, 22.5, -7.5), 2.5, None),
])  # fmt: skip
def test_angles_held_to_both_sides_and_straight_ahead_show_an_offset_of_the_rudder(
    angles: tuple[float, ...], straight: float, offset: float | None
) -> None:
    """An indicator that is off shifts every angle alike; what goes straight shifts with them."""
    found = witnesses([helm(angles, straight)]).get("offset.delta")
    assert (found is None) == (offset is None)
    if found is not None and offset is not None:
        assert found.size == pytest.approx(offset * DEG, abs=0.05 * DEG)
        assert found.shown
        assert found.leads
        assert not found.denies(offset * DEG)


EVEN, OFF = (10.0, -10.0, 20.0, -20.0), (12.5, -7.5, 22.5, -17.5)


@pytest.mark.parametrize(("port", "starboard", "leads"), [
    ((OFF, 2.5), (OFF, 2.5), {"offset.delta": 2.5}), ((EVEN, 0.0), (OFF, 2.5), {"offset.delta_2": 2.5}),
    (((11.2, -8.8, 21.2, -18.8), 1.2), (OFF, 2.5), {"offset.delta_1": 1.2, "offset.delta_2": 2.5}),
    ((EVEN, 0.0), (EVEN, 0.0), {}),
])  # fmt: skip
def test_an_offset_that_two_rudders_have_alike_is_one(
    port: tuple[tuple[float, ...], float], starboard: tuple[tuple[float, ...], float], leads: dict[str, float]
) -> None:
    """Of what both have only the sum acts; what one has alone, or more of, is its own."""
    log = helm(*starboard)
    both = replace(log, channels={"u": log["u"], "r": log["r"], "delta_1": helm(*port)["delta"],
                                  "delta_2": log["delta"]})  # fmt: skip
    found = witnesses([both])
    shown = {name: one.size / DEG for name, one in found.items() if one.leads}
    assert shown == pytest.approx(leads, abs=0.05)
    assert all(found[name].shown for name in leads)
    # of a common one, each of the rudders is told as well
    assert {name.partition("_")[0] for name, one in found.items() if one.shown} == {"offset.delta"} if leads else True


@pytest.mark.slow
def test_rudders_that_are_late_alike_are_late_by_one_number() -> None:
    t, fine = np.arange(0.0, 900.0), np.arange(0.0, 900.0, 0.02)
    delta = 0.17 * np.sign(np.sin(2.0 * np.pi * fine / 130.0))
    r = np.zeros(fine.size)
    for k in range(1, fine.size):
        r[k] = r[k - 1] + 0.02 * (0.05 * delta[k - 1] - r[k - 1]) / 12.0
    rng = np.random.default_rng(0)
    read = {"delta_1": np.interp(t - 2.0, fine, delta), "delta_2": np.interp(t - 2.0, fine, delta),
            "r": np.interp(t, fine, r), "u": 5.0 + 0.0 * t}  # fmt: skip
    noisy = {name: values + 1e-4 * rng.standard_normal(t.size) for name, values in read.items()}
    found = witnesses([Trial("a", t, noisy, {}, {})], 60.0)
    assert found["delay.delta"].size == pytest.approx(2.0, abs=0.87)
    assert [name for name, one in found.items() if one.leads] == ["delay.delta"]


def test_of_errors_that_explain_the_same_one_leads() -> None:
    found = witnesses([log(seed, {"ahead": 4.0}) for seed in range(3)])
    assert {name for name, one in found.items() if one.shown} == {"antenna.ahead", "delay.receiver"}
    assert sum(one.leads for one in found.values()) == 1


# -- who is blamed


def suspicion(**changes: Any) -> Suspicion:
    given: dict[str, Any] = {"name": "antenna.starboard", "words": "an antenna to starboard", "unit": "m", "per": 1.0,
                             "drop": 900.0, "share": 0.4, "size": 2.0, "sigma": 0.1, "moves": {"p": 9.0}}  # fmt: skip
    return Suspicion(**{**given, **changes})


WRONG = Gain(0.4, 9.0)


@pytest.mark.parametrize(("changes", "blamed"), [
    ({"gain": CERTAIN}, True), ({"gain": WRONG}, False), ({"gain": CERTAIN, "log": Witness(0.1, 0.1, False)}, False),
    ({"gain": WRONG, "log": Witness(1.9, 0.1, True)}, True), ({"gain": WRONG, "log": Witness(1.5, 0.1, False)}, False),
    ({"gain": CERTAIN, "log": Witness(1.5, 0.1, False)}, True),
    # ... and by a log that has it alike, though it does not show it beyond doubt
    ({"gain": WRONG, "log": Witness(1.9, 0.3, False)}, True), ({"gain": WRONG, "log": Witness(1.9, 0.4, False)}, False),
    ({"gain": WRONG, "log": Witness(2.9, 0.29, False)}, False),
    ({"gain": CERTAIN, "log": Witness(0.0, 0.9, False)}, True), ({"gain": WRONG, "name": "current.north"}, True),
    ({"gain": WRONG, "whole": True}, True), ({"gain": CERTAIN, "drop": 1.0}, False)])  # fmt: skip
def test_an_instrument_is_blamed_by_the_logs_or_by_most_of_the_misfit(changes: Any, blamed: bool) -> None:
    one = suspicion(**changes)
    assert (Diagnosis(suspicions=(one,)).causes == (one,)) == blamed
    assert Diagnosis(suspicions=(one,)).lacking == (one.drop > 25.0)


def test_an_instrument_that_is_not_blamed_is_told_with_the_reason_unless_another_one_is() -> None:
    denied = suspicion(log=Witness(0.1, 0.25, False))
    [told] = Diagnosis(suspicions=(denied,)).grounds
    assert told == "an antenna to starboard of 2 +- 0.1 m is not it: the other instruments allow 0.1 +- 0.2 m"
    small = suspicion(gain=WRONG)
    [told] = Diagnosis(suspicions=(small,)).grounds
    assert told.endswith("in other trials than those it is estimated in it explains 40% of what exceeds the noise")
    assert "-" not in replace(small, gain=Gain(-0.2, 1.0)).excused.rpartition("explains")[2]
    blamed = suspicion(name="scale.r")
    assert Diagnosis(suspicions=(denied, blamed)).grounds == ()


def test_a_number_of_the_ship_that_would_be_off_by_more_than_itself_is_no_cause() -> None:
    """The same misfit, by 80 % of a number or by 250 %."""
    given = {"name": "propeller.k_1", "words": "an error of k_1", "unit": "%", "per": 0.01, "share": 0.9, "most": 1.0}
    near, far = (suspicion(**given, size=size, sigma=0.05) for size in (-0.8, -2.5))
    assert any("an error of k_1" in line for line in Diagnosis(terms=(near,)).lines)
    lines = Diagnosis(terms=(far,)).lines
    assert not any("k_1" in line for line in lines)
    assert lines[0].startswith("the model does not explain")


def test_an_error_that_fit_and_logs_have_alike_comes_with_its_line_however_little_it_explains() -> None:
    """A model of a wrong form leaves most of the misfit: a rudder 3 s late was 3 % of it, and 40 sigma."""
    channels = {"x": Channel(1.0, 3.0, 0.9, 0.01, 1.0, 100)}
    own = suspicion(name="delay.delta", size=4.2, share=0.03, gain=WRONG)
    for log, told in ((Witness(3.8, 0.5, False), True), (Witness(3.8, 1.0, False), False)):
        found = Diagnosis(channels, (replace(own, log=log),))
        assert ('common = { "delay.delta" = inf }' in found.remedies[0]) == told
        assert (found.cause is not None) == told


@pytest.mark.parametrize(("own", "all_", "named"), [
    (0.40, 0.39, ["offset.delta"]), (0.40, 0.30, ["offset.delta_2", "offset.delta"]),
    (0.40, None, ["offset.delta_2"])])  # fmt: skip
def test_where_only_the_sum_of_two_rudders_acts_the_offset_of_both_is_the_cause(
    own: float, all_: float | None, named: list[str]
) -> None:
    one = suspicion(name="offset.delta_2", share=own)
    both = suspicion(name="offset.delta", share=all_) if all_ else suspicion(name="scale.r", drop=1.0)
    assert [cause.name for cause in Diagnosis(suspicions=(one, both)).causes] == named
