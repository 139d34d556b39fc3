"""Single rows, heel, and what the findings of several logs say: each bound from both sides, on logs of a line."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from seatrial.data import Array, Trial
from seatrial.data.check.attitude.heel import _against_rate, _straight, heel_faults
from seatrial.data.check.findings import _finding, _pairs, _repeats, check_folder, check_set
from seatrial.data.check.rows.outliers import _aloof, _beyond, _blocks, _differences, _spikes, outlier_faults
from seatrial.data.check.rows.still import _by_digits, _exact, _made_of_psi, _rounded, still_faults
from seatrial.data.check.sensors import Fault
from seatrial.data.prepare import Remedy, Step

DEGREE = math.pi / 180.0
NAN = np.nan
T = np.arange(200.0)


def log(t: Array = T, length: float | None = 50.0, name: str = "a", **channels: Any) -> Trial:
    wide = {key: np.broadcast_to(np.asarray(value, dtype=np.float64), t.size) for key, value in channels.items()}
    return Trial(name, t, wide, meta={} if length is None else {"L_pp": length})


def spoilt(values: Array, rows: slice, value: float) -> Array:
    out = np.array(values, dtype=np.float64)
    out[rows] = value
    return out


# -- rows far from all others


@pytest.mark.parametrize(("name", "span"), [
    ("x", 100.0), ("y", 100.0), ("u", 5.0), ("v_m", 5.0), ("r", 0.1), ("p", 0.1), ("phi", 0.5), ("U_G", 5.0),
    ("u_w", 5.0), ("U_A", 20.0), ("U_T", 20.0), ("U_C", 3.0), ("delta", 0.5 * math.pi), ("depth", 100.0),
])  # fmt: skip
def test_a_stray_is_three_spans_from_the_others(name: str, span: float) -> None:
    """Of a channel that hardly moves: three times what any log may span."""
    flat = 0.01 * span * np.sin(T)
    for far, out in ((2.95, False), (3.1, True)):
        for side in (1.0, -1.0):
            rows = np.flatnonzero(_aloof(log(**{name: spoilt(flat, slice(20, 22), side * far * span)}), name))
            assert rows.tolist() == ([20, 21] if out else [])


def test_strays_are_a_minority_and_alike_where_they_last() -> None:
    flat = np.sin(T)
    assert _aloof(log(u=spoilt(flat, slice(0, 79), 999.0)), "u").sum() == 79
    assert not _aloof(log(u=spoilt(flat, slice(0, 81), 999.0)), "u").any()  # two fifths
    apart = flat.copy()
    apart[20:30] = 999.0 + np.arange(10.0)  # nine, of a hundredth of what lies between
    assert _aloof(log(u=apart), "u").sum() == 10
    apart[20:30] = 999.0 + 1.2 * np.arange(10.0)
    assert not _aloof(log(u=apart), "u").any()
    apart = flat.copy()
    apart[20:23] = [999.0, 1100.0, 1200.0]  # three rows need not be alike
    assert _aloof(log(u=apart), "u").any()
    assert not _aloof(log(np.arange(19.0), u=spoilt(flat[:19], slice(3, 4), 999.0)), "u").any()
    assert _aloof(log(np.arange(20.0), u=spoilt(flat[:20], slice(3, 4), 999.0)), "u").any()


def test_a_spike_comes_back_at_once_and_stands_out() -> None:
    wave = np.sin(0.05 * T)
    for size, out in ((0.08, False), (0.12, True)):  # a twentieth of nine tenths of 2, where the wave is level
        found = _spikes(log(u=wave + size * (T == 31)), "u")
        assert np.flatnonzero(found).tolist() == ([31] if out else [])
    assert not _spikes(log(u=wave + 1.5 * (T >= 60)), "u").any()  # a step
    assert np.flatnonzero(_spikes(log(u=wave - 1.5 * (T == 60)), "u")).tolist() == [60]
    assert not _spikes(log(u=(wave + 1.5 * (T == 40))).rows(slice(0, 49)), "u").any()
    wrapped = np.mod(0.1 * T + 3.0, 2.0 * math.pi)
    assert not _spikes(log(psi=wrapped), "psi").any()
    assert _differences("psi", np.array([3.1, -3.1]))[0] == pytest.approx(2.0 * math.pi - 6.2)
    assert _differences("u", np.array([3.1, -3.1]))[0] == pytest.approx(-6.2)


def test_how_far_out_a_value_must_be() -> None:
    far = np.linspace(0.0, 10.0, 10001)

    def least(trial: Trial, name: str) -> float:
        return float(far[_beyond(trial, name, trial[name], far)][0])

    noise = np.random.default_rng(0).normal(0.0, 0.1, 4000)
    assert least(log(np.arange(4000.0), u=noise), "u") == pytest.approx(1.2, rel=0.1)  # twelve times the noise
    line = np.linspace(0.0, 100.0, 200)
    assert least(log(u=line), "u") == pytest.approx(4.5, abs=1e-3)  # a twentieth of nine tenths
    assert least(log(x=line), "x") == pytest.approx(2.5, abs=1e-3)  # a twentieth of the length
    assert least(log(length=None, x=line), "x") == pytest.approx(0.5, abs=2e-3)
    assert least(log(psi=line), "psi") == pytest.approx(0.05 * math.pi, abs=1e-3)
    assert not _beyond(log(u=line), "u", line, far[far < 4.49]).any()


def test_a_block_of_one_value_leaps_in_and_out() -> None:
    wave = 3.0 + np.sin(0.05 * T)
    assert np.flatnonzero(_blocks(log(u=spoilt(wave, slice(40, 50), 0.0)), "u")).tolist() == list(range(40, 50))
    assert not _blocks(log(u=spoilt(wave, slice(40, 41), 0.0)), "u").any()  # one row is a spike
    assert not _blocks(log(u=spoilt(wave, slice(40, 81), 0.0)), "u").any()  # a fifth of the rows
    assert _blocks(log(u=spoilt(wave, slice(40, 79), 0.0)), "u").any()
    assert not _blocks(log(u=spoilt(wave, slice(40, 200), 0.0)), "u").any()  # it does not come back
    slow = 3.0 + np.sin(0.005 * T)  # a twentieth of what it spans is .038: both leaps are over twice that
    for leap, told in ((0.06, False), (0.2, True)):
        assert _blocks(log(u=spoilt(slow, slice(40, 50), float(slow[40]) - leap)), "u").any() == told
    found, clean = outlier_faults(log(u=spoilt(wave, slice(40, 50), 0.0)))
    assert [(one.key, one.evidence) for one in found] == [("zeros", "0 in 10 of 200 rows, the first at t = 40 s")]
    assert np.flatnonzero(np.isnan(clean["u"])).tolist() == list(range(40, 50))
    (filled,), _ = outlier_faults(log(u=spoilt(wave, slice(40, 50), 9.0)))
    assert (filled.key, filled.evidence.startswith("9 m/s in 10")) == ("sentinel", True)
    (spike,), _ = outlier_faults(log(u=wave + 1.5 * (T == 60)))
    assert spike.evidence == "1 of 200 rows, the first at t = 60 s, up to 1.5 m/s off the rows beside"


# -- stillness


def test_a_simulated_run_agrees_with_itself_and_a_frozen_sensor_does_not() -> None:
    t = 0.5 * np.arange(200.0)
    psi = 0.02 * t
    x = (5.0 * np.sin(psi) + 0.3 * np.cos(psi)) / 0.02
    y = (-5.0 * np.cos(psi) + 0.3 * np.sin(psi)) / 0.02
    run = log(t, x=x, y=y, psi=psi, u=5.0, v_m=0.3, r=0.02)
    assert not _made_of_psi(run.having(r=np.full(200, 0.021)))
    assert _made_of_psi(run)  # the difference of a steady turn is its rate, exactly
    near = run.having(r=np.full(200, 0.02 + 2e-9))
    assert _exact(near, 0, 199)
    assert not _exact(near.having(u=np.full(200, 5.0 * 1.0005)), 0, 199)
    assert _exact(near.having(u=np.full(200, 5.0 * 1.0001)), 0, 199)
    assert not _exact(near.having(psi=psi + 1e-3), 0, 199)
    assert _exact(near.having(psi=psi + 1e-4), 0, 199)
    found, _ = still_faults(near)
    assert [one.key for one in found] == ["steady"]
    stuck, _ = still_faults(near.having(u=np.full(200, 4.0)))
    assert "frozen" in {one.key for one in stuck}


def test_a_rounded_heading_rests_while_the_ship_meets_its_rudder() -> None:
    t = np.arange(120.0)
    psi = DEGREE * np.round(3.0 * np.sin(2.0 * np.pi * t / 120.0))
    runs = [(19, 22), (79, 22)]  # three degrees to either side
    slow = log(t, psi=psi, r=0.0, u=1.0)
    assert psi[18] != psi[19] == psi[41] != psi[42]
    assert _rounded(slow, "psi", *runs[0], runs)
    for turned, rests in ((1.45, True), (1.55, False)):  # steps by the rate, in that time
        assert _rounded(slow.having(r=np.full(120, turned * DEGREE / 22.0)), "psi", *runs[0], runs) == rests
    assert not _rounded(slow, "psi", *runs[0], [runs[0], (79, 5)])  # no other lasts a quarter of it
    assert _rounded(slow, "psi", *runs[0], [runs[0], (79, 6)])
    assert not _rounded(slow, "u", *runs[0], runs)


def test_steps_of_digits_last_as_long_as_the_motion_is_slow() -> None:
    wave = 50.0 * np.sin(0.03 * T)
    assert _by_digits(log(x=np.round(wave)), "x")
    assert not _by_digits(log(x=np.repeat(wave[::4], 4)), "x")  # a sensor that is slower than the log


# -- heel


def rolling(**more: Any) -> Trial:
    """A zigzag with a lever of -2 m/m: tan phi = -2 u r / g; the rate is its derivative."""
    t = 0.5 * np.arange(400.0)
    r = 0.02 * np.sin(0.1 * t)
    phi = -2.0 * 8.0 * r / 9.81
    return log(t, **{"phi": phi, "p": np.gradient(phi, t), "r": r, "u": 8.0, **more})


def heel(trial: Trial) -> list[tuple[str, str]]:
    return [(one.where, one.what) for one in heel_faults(trial)]


def test_a_sound_heel_and_its_signs() -> None:
    one = rolling()
    assert heel(one) == []
    assert heel(one.having(phi=-one["phi"])) == [("phi", "heels into the turn")]
    assert heel(one.having(phi=-one["phi"], p=-one["p"])) == [("phi, p", "heels into the turn")]
    assert heel(one.having(p=-one["p"])) == [("p", "roll rate against the heel")]
    assert heel(one.having(p=one["p"] / DEGREE)) == [("p", "roll rate is in degrees")]
    assert heel(one.having(phi=one["phi"] / DEGREE, p=one["p"] / DEGREE)) == [("phi, p", "heel is in degrees")]
    assert heel(one.having(phi=one["phi"] / DEGREE)) == [("phi", "heel is in degrees")]
    assert _against_rate(one) == pytest.approx(1.0, abs=2e-3)
    assert _against_rate(one.having(p=2.0 * one["p"])) == pytest.approx(0.5, abs=2e-3)
    assert _against_rate(one.having(p=np.random.default_rng(0).normal(0, 1, 400))) is None


@pytest.mark.parametrize(("ratio", "degrees"), [(0.0495, True), (0.0505, False), (1 / 169.0, True), (1 / 171.0, False)])
def test_a_roll_rate_twenty_to_a_hundred_and_seventy_times_too_large_is_in_degrees(ratio: float, degrees: bool) -> None:
    one = rolling()
    unit = float(_against_rate(one) or 1.0)
    assert bool(heel(one.having(p=one["p"] * unit / ratio))) == degrees


@pytest.mark.parametrize(("lever", "degrees"), [(24.5, False), (25.5, True)])
def test_a_lever_of_no_ship_is_one_of_degrees(lever: float, degrees: bool) -> None:
    one = rolling(r=0.002 * np.sin(0.05 * np.arange(400.0)))
    phi = -lever * 8.0 * one["r"] / 9.81
    trial = one.having(phi=phi, p=np.gradient(phi, one.t))
    assert [what for _, what in heel(trial)] == ["heel is in degrees"] * degrees


def test_a_heel_on_a_straight_course_is_a_list() -> None:
    t = 0.5 * np.arange(400.0)
    r = np.where(t < 100.0, 0.0, 0.02)

    def listing(degrees: float) -> list[Fault]:
        return [one for one in heel_faults(log(t, phi=degrees * DEGREE - 0.03 * (r > 0), r=r, u=8.0))
                if one.key == "heel_offset"]  # fmt: skip

    assert not listing(0.49)
    (fault,) = listing(-0.51)
    assert fault.evidence == "0.51 deg to port"
    assert isinstance(fault.remedy, Remedy)
    assert fault.remedy.steps[0].amount == (pytest.approx(0.51 * DEGREE),)
    swing = 0.02 * np.sign(np.sin(0.1 * t))
    for degrees, told in ((0.98, False), (1.02, True)):
        both = log(t, phi=degrees * DEGREE - 1.5 * swing, r=swing, u=8.0)
        assert [one.what for one in heel_faults(both)] == ["heel midway between turns to either side"] * told
    for until, rows in ((57.5, 14), (57.0, 0)):  # a length of 50 m in 6.25 s
        assert _straight(log(t, r=np.where((t > 50) & (t < until), 0.001, 0.02), u=8.0)).sum() == rows
    assert not _straight(log(t, r=np.where((t > 50) & (t < 60), 0.0021, 0.02), u=8.0)).any()


# -- findings


def test_rows_in_common_are_counted_from_ten_on() -> None:
    rng = np.random.default_rng(0)
    ours = Trial("ours", np.arange(50.0), {"x": rng.random(50), "psi": rng.random(50)})
    for rows, told in ((9, False), (10, True)):
        other = {name: np.concatenate([one[20 : 20 + rows], rng.random(30)]) for name, one in ours.channels.items()}
        found = check_set([ours], [Trial("theirs", np.arange(30.0 + rows), other)])
        assert [one.evidence for one in found] == [
            f"{rows} rows are the same, {100 * rows / (30 + rows):.0f} % of theirs"
        ] * told  # fmt: skip
    shifted = Trial("later", 99.0 + np.arange(50.0), {name: v[::-1] for name, v in ours.channels.items()})
    assert _pairs([ours], [shifted]) == [(0, 0, 50, 1.0)]
    digits = Trial("d", ours.t, {name: np.round(v, 9) for name, v in ours.channels.items()})
    assert _pairs([ours], [digits])[0][2] == 50
    assert _pairs([ours], [Trial("e", ours.t, {name: v + 1e-8 for name, v in ours.channels.items()})]) == []


def test_a_fault_of_several_trials_is_told_once_with_their_names() -> None:
    def fault(amount: float, evidence: str = "e") -> Fault:
        step = Step(do="add", channels=("psi",), amount=(amount,), unit="deg")
        return Fault("warning", "psi", "off", evidence, Remedy(steps=(step,)), "quality", "heading_bias")

    one = _finding([("a", fault(1.0))])
    assert (one.where, one.trials, one.steps[0].trials, one.evidence) == ("a: psi", ("a",), ("a",), "e")
    same = _finding([("a", fault(1.0)), ("b", fault(1.0))])
    assert (same.where, same.trials) == ("2 trials: psi", ("a", "b"))
    assert [step.trials for step in same.steps] == [("a", "b")]
    other = _finding([("a", fault(1.0, "x")), ("b", fault(2.0, "y"))])
    assert [step.trials for step in other.steps] == [("a",), ("b",)]
    assert (other.evidence, other.remedy.endswith("; likewise in 1 more")) == ("a: x", True)
    unit = Fault("error", "psi", "in degrees", "", "", "unit", "unit")
    shadow = Fault("info", "psi", "wraps", "", "", "quality", "wraps")
    assert _repeats(shadow, [unit, shadow])
    assert not _repeats(fault(1.0), [unit])
    assert not _repeats(shadow, [fault(1.0)])
    assert not _repeats(unit, [unit])


def test_less_than_twenty_rows_are_too_short_to_judge() -> None:
    for rows, keys in ((19, ["short"]), (20, [])):
        t = np.arange(float(rows))
        found = check_folder([log(t, psi=0.01 * t + 0.001 * np.sin(7 * t))])
        assert [one.key for one in found] == keys


# -- leaps of the clock


def _ahead(by: float, speed: float = 5.0, lost: int = 0, stop: float = 0.0) -> Trial:
    """A straight run whose clock leaps at row 100; rows that are lost there, or a stop, are no leap of the clock."""
    rows = np.delete(np.arange(200.0), slice(100, 100 + lost))
    t = rows + np.where(rows >= 100, by, 0.0)
    sailed = speed * rows + np.where(rows >= 100, stop, 0.0)
    noise = np.random.default_rng(0).normal(0.0, 0.05, (2, rows.size))
    return log(t, x=0.8 * sailed + noise[0], y=0.6 * sailed + noise[1])


@pytest.mark.parametrize(("by", "speed", "lost", "stop", "told"), [
    (18.0, 5.0, 0, 0.0, True), (3.0, 5.0, 0, 0.0, True), (3600.0, 1.0, 0, 0.0, True),  # a clock that was set
    (0.0, 5.0, 18, 0.0, False), (40.0, 5.0, 0, 200.0, False),  # lost rows; a pause in which the ship went on
    (18.0, 0.0, 0, 0.0, False), (0.0, 5.0, 0, 0.0, False),  # at rest; no leap
])  # fmt: skip
def test_a_clock_that_is_set_ahead_is_told_from_rows_that_are_lost(
    by: float, speed: float, lost: int, stop: float, told: bool
) -> None:
    found = [one for one in check_folder([_ahead(by, speed, lost, stop)]) if one.key == "clock_ahead"]
    assert bool(found) == told
    if told:
        assert f"by {by:.3g} s at t = 99 s" in found[0].evidence
        assert [one.do for one in found[0].steps] == ["split"]
    assert any(one.key == "missing_rows" for one in check_folder([_ahead(by, speed, lost, stop)])) == (
        not told and bool(by or lost)
    )
